"""The narrowest passage of a free space, to a micrometre.

A disc of growing radius can reach the same places, in the same ways, until its diameter
passes the width of a gap. At such a gap the distance to the walls has a saddle: two wall points
face each other, and the disc between them, with their segment as its diameter, holds no other.
One of the two is then a corner that juts into the free space, or both sides are parallel
and such a corner ends one of them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import shapely
from shapely import MultiPolygon

from robocov.arrays import Array, IntArray
from robocov.environment import GRID, SAGITTA, Point
from robocov.robots import DEFAULT_RADIUS

NEGLIGIBLE = math.pi * DEFAULT_RADIUS**2
"""A gap to a pocket smaller than this, in m², is none: no robot would go there."""
_CRACK = 2 * SAGITTA
"""Walls closer than this, in metres, touch: a circle that touches a wall is a polygon that nearly does."""
_CHUNK = 256
"""Corners that are looked at together, so that memory stays bounded."""
_DIGITS = 6
"""Results are rounded to the grid of the derived geometry, a micrometre."""


class Gap(NamedTuple):
    """A passage: the diameter of the largest disc that passes, m, and where the walls face each other, m."""

    width: float
    between: tuple[Point, Point]


def narrowest_gap(free: MultiPolygon) -> Gap | None:
    """Return the narrowest passage of `free`, or None where there is none.

    A passage leads round an obstacle, or to a part of the free space that is neither smaller
    than `NEGLIGIBLE` nor smaller than the square over the gap: a niche that is shallower than
    wide is none, and nor is an acute corner.

    `free` is disjoint polygons, counter-clockwise.

    >>> room = shapely.box(0, 0, 6, 3) - shapely.box(2.9, 1, 3.1, 2.2)
    >>> narrowest_gap(shapely.MultiPolygon([room])).width
    0.8
    """
    search = _Search(free)
    if search.free.is_empty:
        return None
    low_x, low_y, high_x, high_y = search.free.bounds
    largest = math.hypot(high_x - low_x, high_y - low_y)
    best: Gap | None = None
    below, reach = _CRACK / 2, largest / 4096
    # most maps have a gap far narrower than the map is wide: look near first
    while best is None and below < largest:
        for corners in search.chunks():
            found = next(search.gaps(corners, below, reach if best is None else best.width), None)
            best = found or best
        below, reach = reach, 2 * reach
    return best


def gaps_narrower(free: MultiPolygon, width: float) -> tuple[Gap, ...]:
    """Return all passages of `free` that are narrower than a width in metres, the narrowest first.

    The first is as wide as `narrowest_gap`. One passage may be found several times, as at all corners of a
    door.

    >>> room = shapely.box(0, 0, 6, 3) - shapely.box(2.9, 1, 3.1, 2.2)
    >>> {gap.width for gap in gaps_narrower(shapely.MultiPolygon([room]), 1.5)}
    {0.8, 1.0}
    """
    search = _Search(free)
    found = {gap for corners in search.chunks() for gap in search.gaps(corners, _CRACK / 2, width)}
    return tuple(sorted(found, key=lambda gap: (gap.width, gap.between)))


class _Search:
    """The e edges of a free space among which passages are looked for; it lies to the left of each."""

    def __init__(self, free: MultiPolygon) -> None:
        self.free = free = _without_cracks(free)
        self.boundary = free.boundary
        shapely.prepare(self.boundary)
        shapely.prepare(free)
        rings = [shapely.get_coordinates(ring)[:-1] for ring in shapely.get_rings(shapely.get_parts(free))]
        sizes = np.array([len(ring) for ring in rings], dtype=np.intp)
        self.ring = np.repeat(np.arange(len(rings)), sizes)
        self.start = np.concatenate([np.empty((0, 2)), *rings])
        self.end = np.concatenate([np.empty((0, 2)), *(np.roll(ring, -1, axis=0) for ring in rings)])
        # the first edge of each one's ring and the one after the last, and the edge that ends where it starts
        self.last = np.cumsum(sizes)
        self.first = self.last - sizes
        self.before = np.arange(len(self.start)) - 1
        self.before[self.first] = self.last - 1
        # the edges whose start is a corner that juts into the free space
        turn = _cross(self.start - self.start[self.before], self.end - self.start)
        self.jutting = np.flatnonzero(turn < 0)
        # boxes: the index needs no more, and they are made in one call
        low, high = np.minimum(self.start, self.end), np.maximum(self.start, self.end)
        self.tree = shapely.STRtree(shapely.box(*low.T, *high.T))

    def chunks(self) -> list[IntArray]:
        """Return the corners that jut into the free space, some at a time."""
        return np.array_split(self.jutting, math.ceil(len(self.jutting) / _CHUNK) or 1)

    def gaps(self, corners: IntArray, below: float, limit: float) -> Iterator[Gap]:
        """Yield the passages at some corners, wider than `below` and narrower than `limit`, by width."""
        at = self.start[corners]
        row, edge = self.tree.query(shapely.box(*(at - limit).T, *(at + limit).T))
        corner = corners[row]
        p = self.start[corner]
        along = self.end[edge] - self.start[edge]
        part = np.einsum("kd,kd->k", p - self.start[edge], along) / np.einsum("kd,kd->k", along, along)
        q = self.start[edge] + np.clip(part, 0.0, 1.0)[:, None] * along
        width = np.hypot(*(q - p).T)
        wanted = (width > below) & (width < limit)
        # the sides of the corner may not lean into the disc
        for side in (self.start[self.before[corner]], self.end[corner]):
            wanted &= np.einsum("kd,kd->k", side - p, q - p) <= 1e-9 * width * np.hypot(*(side - p).T)
        found = np.flatnonzero(wanted)
        order = found[np.argsort(width[found], kind="stable")]
        for some in np.array_split(order, max(1, len(order) // 512)):
            middle = shapely.points((p[some] + q[some]) / 2)
            # prepared, which `shapely.distance` would not be: of thousands of walls that makes a difference
            empty = ~shapely.dwithin(self.boundary, middle, width[some] / 2 * (1 - 1e-9) - 1e-12)
            empty[empty] = shapely.contains_properly(self.free, middle[empty])
            for k in some[empty].tolist():
                if self._leads_on(corner[k], edge[k], q[k], width[k]):
                    one, other = sorted(map(tuple, np.round([p[k], q[k]], _DIGITS).tolist()))
                    yield Gap(round(float(width[k]), _DIGITS), (one, other))

    def _leads_on(self, corner: int, edge: int, q: Array, width: float) -> bool:
        """Return whether the gap from a corner to the point q of an edge leads to more than a pocket.

        A cut between two rings separates nothing: the way round is another one. A cut from a ring
        to itself separates the part that the ring sweeps between the two points.
        """
        ring = self.ring[corner]
        if ring != self.ring[edge]:
            return True
        points = np.roll(self.start[self.first[ring] : self.last[ring]], self.first[ring] - corner, axis=0)
        cut = (edge - corner) % len(points) + 1
        halves = np.vstack([points[:cut], q]), np.vstack([q, points[cut:], points[:1]])
        sides = np.array([_area(half) for half in halves])
        # outside a hole's ring there is no pocket: only the side of positive area is one
        pocket = sides.min(where=sides > 0, initial=np.inf)
        return bool(pocket >= max(NEGLIGIBLE, width * width))


def _without_cracks(free: MultiPolygon) -> MultiPolygon:
    """Return `free` without the parts that are narrower than `_CRACK`.

    What touches there becomes one wall, and stays apart by a nanometre so that it does not touch
    in a point again. Corners of less than a degree are cut, vertices that bend a wall by less than
    a micrometre go, everything else comes back as it was.
    """
    for distance in (-_CRACK / 2, _CRACK / 2 - 1e-9):
        free = free.buffer(distance, join_style="mitre", mitre_limit=100.0)
    free = free.simplify(GRID)
    return MultiPolygon([shapely.orient_polygons(part) for part in shapely.get_parts(free)])


def _cross(a: Array, b: Array) -> Array:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _area(ring: Array) -> float:
    """Return the area of a ring, m², negative when clockwise."""
    points = ring - ring[0]
    return float(_cross(points[:-1], points[1:]).sum()) / 2
