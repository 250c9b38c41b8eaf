"""Restoration of corners that a coarse grid has cut off."""

import numpy as np
import shapely
from shapely import Polygon

from robocov.arrays import Array
from robocov_app.formats.geometry.vectors import intersect_lines

_MAX_SHORT_SIDE = 1.5
"""Sides up to this length, in tolerances, may belong to a cut corner."""
_MAX_CORNER_DISTANCE = 2.0
"""Distance, in tolerances, of a cut corner's vertices from the corner."""
_MIN_SINE = 0.1
"""Sine of the angle between two walls below which they are parallel."""


def sharpen_corners(plan: Polygon, tolerance: float) -> Polygon:
    """Restore the cut corners of a polygon.

    A run of short sides becomes the point where the long sides before and after it meet, if the whole run is
    near that point. Unlike simplification, it keeps the directions of the walls.

    Parameters
    ----------
    plan : Polygon, m
    tolerance : float, m

    Returns
    -------
    Polygon, m
        The plan itself if the result would be invalid.
    """
    lines = (plan.exterior, *plan.interiors)
    rings = [_sharpen_ring(np.asarray(line.coords)[:-1], tolerance) for line in lines]
    sharp = Polygon(rings[0], rings[1:])
    return sharp if sharp.is_valid else plan


def _sharpen_ring(ring: Array, tolerance: float) -> Array:
    side = np.roll(ring, -1, axis=0) - ring
    length = np.hypot(*side.T)
    long = np.flatnonzero(length > _MAX_SHORT_SIDE * tolerance)
    if len(long) < 3:
        return ring
    following = np.roll(long, -1)
    corner, sine = intersect_lines(ring[long], side[long], ring[following], side[following])
    is_turn = np.abs(sine) > _MIN_SINE * length[long] * length[following]
    runs = np.split(np.roll(ring, -long[0] - 1, axis=0), long[1:] - long[0])
    has_several = np.array([len(run) for run in runs]) > 1
    for k in np.flatnonzero(is_turn & has_several):
        is_near = np.hypot(*(runs[k] - corner[k]).T).max() <= _MAX_CORNER_DISTANCE * tolerance
        if is_near and shapely.LineString(runs[k]).distance(shapely.Point(corner[k])) <= tolerance:
            runs[k] = corner[k : k + 1]
    return np.concatenate(runs)
