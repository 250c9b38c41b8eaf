"""Corners of outlines on grids."""

from __future__ import annotations

import math

import numpy as np
from shapely import Polygon

from robocov.arrays import Array
from robocov.environment import Point

_SHORT, _NEAR, _PARALLEL = 1.5, 2.0, 0.1
"""In tolerances: what counts as a short edge, and how far from the corner its run may be; and the
sine of the angle below which two walls count as parallel."""


def sharpened(plan: Polygon, tolerance: float) -> Polygon:
    """Return `plan` with its cut corners made whole, or as it is where that would break it.

    `plan` in m. `tolerance`, m: a run of edges of at most 1.5 `tolerance` becomes the point where the long
    edges before and after it meet when they are drawn on, if all of the run is within 2 `tolerance` of that
    point: unlike a plain simplification, it keeps the directions of the walls.

    Examples
    --------
    >>> cut = Polygon([(0, 0), (4, 0), (4, 2.99), (3.99, 3), (0, 3)])
    >>> sharpened(cut, 0.02).area
    12.0
    """
    rings = [_sharpened(np.asarray(ring.coords)[:-1], tolerance) for ring in (plan.exterior, *plan.interiors)]
    sharp = Polygon(rings[0], rings[1:])
    return sharp if sharp.is_valid else plan


def _sharpened(ring: Array, tolerance: float) -> Array:
    """Return the (k, 2) ring with its cut corners made whole."""
    points: list[Point] = [(float(x), float(y)) for x, y in ring]
    count = len(points)
    long = [k for k in range(count) if math.dist(points[k], points[(k + 1) % count]) > _SHORT * tolerance]
    if len(long) < 3:
        return ring
    sharp: list[Point] = []
    for this, following in zip(long, [*long[1:], long[0] + count], strict=True):
        run = [points[k % count] for k in range(this + 1, following + 1)]
        beyond = points[(following + 1) % count]
        corner = _meeting(points[this], run[0], run[-1], beyond) if len(run) > 1 else None
        if corner is not None and max(math.dist(corner, point) for point in run) <= _NEAR * tolerance:
            run = [corner]
        sharp += run
    return np.array(sharp)


def _meeting(a: Point, b: Point, c: Point, d: Point) -> Point | None:
    """Return where the lines a-b and c-d meet, or None where they are nearly parallel."""
    ux, uy, vx, vy = b[0] - a[0], b[1] - a[1], d[0] - c[0], d[1] - c[1]
    cross = ux * vy - uy * vx
    if abs(cross) <= _PARALLEL * math.hypot(ux, uy) * math.hypot(vx, vy):
        return None
    part = ((c[0] - a[0]) * vy - (c[1] - a[1]) * vx) / cross
    return (a[0] + part * ux, a[1] + part * uy)
