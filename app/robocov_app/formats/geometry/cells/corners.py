"""Restoration of the corners that a coarse grid cuts off."""

import numpy as np
import shapely
from shapely import Polygon

from robocov.typing import FloatArray
from robocov_app.formats.geometry.vectors import intersect_lines

_MAX_SHORT_SIDE = 1.5
"""Maximum length of a side of a cut corner, in tolerances."""
_MAX_CORNER_DISTANCE = 2.0
"""Maximum distance of the vertices of a cut corner from the restored one, in tolerances."""
_MIN_SINE = 0.1
"""Two walls are parallel if the sine of the angle between them is smaller."""


def sharpen_corners(polygon: Polygon, tolerance: float) -> Polygon:
    """Restore the cut corners of a polygon.

    A run of short sides is replaced by the point where the long sides before and after it meet, if the whole
    run is near that point. Unlike simplification, this preserves the directions of the walls.

    Parameters
    ----------
    polygon : Polygon, m
    tolerance : float, m

    Returns
    -------
    Polygon, m
        The sharpened polygon, or `polygon` itself if the result would be invalid.
    """
    lines = (polygon.exterior, *polygon.interiors)
    rings = [_sharpen_ring(np.asarray(line.coords)[:-1], tolerance) for line in lines]
    sharpened = Polygon(rings[0], rings[1:])
    return sharpened if sharpened.is_valid else polygon


def _sharpen_ring(ring: FloatArray, tolerance: float) -> FloatArray:
    """Restore the cut corners of a ring, (k, 2) m, whose first vertex is not repeated."""
    side = np.roll(ring, -1, axis=0) - ring
    length = np.hypot(*side.T)
    long = np.flatnonzero(length > _MAX_SHORT_SIDE * tolerance)
    if len(long) < 3:
        return ring
    following = np.roll(long, -1)
    corner, sine = intersect_lines(ring[long], side[long], ring[following], side[following])
    is_turn = np.abs(sine) > _MIN_SINE * length[long] * length[following]
    # Run k: the vertices from the end of long side k to the start of the following one.
    runs = np.split(np.roll(ring, -long[0] - 1, axis=0), long[1:] - long[0])
    has_several = np.array([len(run) for run in runs]) > 1
    for k in np.flatnonzero(is_turn & has_several):
        is_near = np.hypot(*(runs[k] - corner[k]).T).max() <= _MAX_CORNER_DISTANCE * tolerance
        if is_near and shapely.LineString(runs[k]).distance(shapely.Point(corner[k])) <= tolerance:
            runs[k] = corner[k : k + 1]
    return np.concatenate(runs)
