"""Clipping of lines and polygons, which pygame draws wrongly if coordinates are huge."""

from collections.abc import Sequence

import numpy as np
import shapely

from robocov.typing import FloatArray
from robocov_app.render.sprites import Pixel

MAX_DRAWN_PX = 20000.0
"""Maximum absolute coordinate that is drawn: products of twice this still fit into 32 bits."""


def limit_pixels(points: FloatArray) -> FloatArray:
    """Limit the coordinates of points to `MAX_DRAWN_PX`; only points far outside the surface move.

    Parameters
    ----------
    points : (..., 2) array, px

    Returns
    -------
    (..., 2) array, px
    """
    return np.clip(points, -MAX_DRAWN_PX, MAX_DRAWN_PX)


def is_within_limit(points: FloatArray) -> bool:
    """Return whether all coordinates, (..., 2) px, are at most `MAX_DRAWN_PX`."""
    return points.size == 0 or bool(np.abs(points).max() <= MAX_DRAWN_PX)


def clip_polygon(corners: FloatArray) -> list[FloatArray]:
    """Clip a polygon to coordinates whose magnitude is at most `MAX_DRAWN_PX`.

    Parameters
    ----------
    corners : (k, 2) array, px

    Returns
    -------
    list of (m, 2) arrays, px
        Outlines of the pieces: the polygon itself if nothing is clipped; none if it has fewer than three
        corners, or nothing of it is left.
    """
    if len(corners) < 3:
        return []
    if is_within_limit(corners):
        return [corners]
    low = -MAX_DRAWN_PX
    high = MAX_DRAWN_PX
    clipped = shapely.clip_by_rect(shapely.Polygon(corners), low, low, high, high)
    polygons = [part for part in shapely.get_parts(clipped) if isinstance(part, shapely.Polygon)]
    return [np.asarray(polygon.exterior.coords)[:-1] for polygon in polygons if not polygon.is_empty]


def clip_segment(start: Pixel, end: Pixel) -> Sequence[Pixel]:
    """Clip a segment to coordinates whose magnitude is at most `MAX_DRAWN_PX`.

    Parameters
    ----------
    start, end : (float, float), px

    Returns
    -------
    sequence of (float, float), px
        The two ends of the visible part; empty if the whole segment is outside.
    """
    x1, y1 = start
    x2, y2 = end
    low = -MAX_DRAWN_PX
    high = MAX_DRAWN_PX
    if max(abs(x1), abs(y1), abs(x2), abs(y2)) <= high:
        return start, end
    if min(x1, x2) > high or max(x1, x2) < low or min(y1, y2) > high or max(y1, y2) < low:
        return []
    clipped = shapely.clip_by_rect(shapely.LineString([start, end]), low, low, high, high)
    ends: list[Pixel] = shapely.get_coordinates(clipped).tolist()
    return ends
