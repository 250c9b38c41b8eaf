"""Cutting what lies far outside the surface: the drawing routines compute with 32-bit integers."""

from __future__ import annotations

import numpy as np
import shapely

from robocov.arrays import Array

FAR = 20000.0
"""Pixels. Products of twice this still fit 32 bits."""


def bounded(points: Array) -> Array:
    """Return (..., 2) pixels, those farther out than `FAR` moved to it: for what is not seen there anyway."""
    return np.clip(points, -FAR, FAR)


def clipped_polygon(corners: Array) -> list[Array]:
    """Return the rings of what of the (k, 2) px polygon lies within `FAR`: mostly the one given.

    >>> len(clipped_polygon(np.array([[0.0, 0.0], [10.0, 0.0], [0.0, 10.0]])))
    1
    """
    if len(corners) < 3:
        return []
    if np.abs(corners).max() <= FAR:
        return [corners]
    inside = shapely.clip_by_rect(shapely.Polygon(corners), -FAR, -FAR, FAR, FAR)
    parts = [part for part in shapely.get_parts(inside) if isinstance(part, shapely.Polygon)]
    return [np.asarray(part.exterior.coords)[:-1] for part in parts if not part.is_empty]


def clipped_segment(
    x1: float, y1: float, x2: float, y2: float
) -> tuple[tuple[float, float], tuple[float, float]] | None:
    """Return the ends of what of a segment lies within `FAR`; None when nothing does.

    >>> clipped_segment(0.0, 0.0, 40000.0, 20000.0)
    ((0.0, 0.0), (20000.0, 10000.0))
    """
    if max(abs(x1), abs(y1), abs(x2), abs(y2)) <= FAR:
        return (x1, y1), (x2, y2)
    first, last = 0.0, 1.0
    for start, step in ((x1, x2 - x1), (y1, y2 - y1)):
        if step == 0.0:
            if abs(start) > FAR:
                return None
            continue
        enter, leave = sorted([(-FAR - start) / step, (FAR - start) / step])
        first, last = max(first, enter), min(last, leave)
    if first >= last:
        return None
    dx, dy = x2 - x1, y2 - y1
    return (x1 + dx * first, y1 + dy * first), (x1 + dx * last, y1 + dy * last)
