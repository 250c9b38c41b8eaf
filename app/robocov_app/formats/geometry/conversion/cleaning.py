"""Removal of hairs from a free space, and of slivers next to its boundary.

A hair is a slit in the free space, or a spur of it, that is thinner than the resolution of the coordinates
but longer than walls may move. Rounding would silently close it, and the report would say that a wall moved
by the hair's length. So hairs are removed first, and counted.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from robocov.environment import GRID_M
from robocov.typing import FloatArray
from robocov_app.formats.geometry.polygons import buffer_with_mitres, to_multipolygon, unite

_MIN_HALF_WIDTH_M = 1e-3 * GRID_M
"""Thinner polygons are due to rounding."""
_OVERLAP_M = 2 * GRID_M
"""Distance by which the area that is filled or removed extends beyond a hair."""


class Cleaned(NamedTuple):
    """A free space without hairs.

    Attributes
    ----------
    free : MultiPolygon, m
    hair_count : int
        Number of hairs that were removed.
    hair_area : float, m²
        Total area of these hairs.
    """

    free: MultiPolygon
    hair_count: int = 0
    hair_area: float = 0.0


def remove_hairs(free: MultiPolygon, width: float, length: float) -> Cleaned:
    """Remove slits and spurs that are thinner than `width` and longer than `length`.

    Parameters
    ----------
    free : MultiPolygon, m
        Must be valid.
    width, length : float, m

    Returns
    -------
    Cleaned
    """
    slits = _select_long(shapely.difference(_close(free, width), free), length)
    filled = free
    if len(slits):
        filled = _round_to_grid(unite([free, *_grow(slits)]))
    spurs = _select_long(shapely.difference(filled, _open(filled, width)), length)
    cleaned = filled
    if len(spurs):
        cleaned = _round_to_grid(shapely.difference(filled, unite(_grow(spurs))))
    if cleaned.is_empty:
        return Cleaned(free)
    area = float(shapely.area(slits).sum() + shapely.area(spurs).sum())
    return Cleaned(cleaned, len(slits) + len(spurs), area)


def remove_slivers(
    solid: list[Polygon], solid_before: BaseGeometry, boundary: Polygon, tolerance: float
) -> list[Polygon]:
    """Remove slivers between a boundary and the free space next to it.

    Slivers arise where simplification moved the boundary and the outline of the free space apart: they are
    thinner than the tolerance, and most of their area was not solid before. What was solid extends from the
    boundary by at most the tolerance, so that removing it moves no wall by more.
    """
    if not solid or tolerance == 0.0:
        return solid
    parts = np.array(solid, dtype=object)
    is_thin = shapely.is_empty(shapely.buffer(parts, -tolerance, quad_segs=2))
    before = shapely.intersection(parts[is_thin], solid_before)
    is_new = shapely.area(before) < shapely.area(parts[is_thin]) / 2
    is_new &= shapely.covered_by(before, shapely.buffer(boundary.exterior, tolerance))
    return list(np.delete(parts, np.flatnonzero(is_thin)[is_new]))


def _select_long(geometry: BaseGeometry, length: float) -> FloatArray:
    """Return the polygons of a geometry that are longer than `length`, m, without slivers due to rounding."""
    pieces = np.array(to_multipolygon(geometry).geoms, dtype=object)
    x, y, right, top = shapely.bounds(pieces).reshape(-1, 4).T
    # Area over perimeter is half the width of a thin polygon.
    is_rounding = shapely.area(pieces) < _MIN_HALF_WIDTH_M * shapely.length(pieces)
    return np.asarray(pieces[(np.hypot(right - x, top - y) > length) & ~is_rounding])


def _close(area: BaseGeometry, width: float) -> BaseGeometry:
    """Fill the gaps in an area that are narrower than `width`, m."""
    closed: BaseGeometry = buffer_with_mitres(buffer_with_mitres(area, width / 2), -width / 2)
    return closed


def _open(area: BaseGeometry, width: float) -> BaseGeometry:
    """Remove the parts of an area that are narrower than `width`, m."""
    opened: BaseGeometry = buffer_with_mitres(buffer_with_mitres(area, -width / 2), width / 2)
    return opened


def _grow(pieces: FloatArray) -> Sequence[BaseGeometry]:
    return list(buffer_with_mitres(pieces, _OVERLAP_M))


def _round_to_grid(area: BaseGeometry) -> MultiPolygon:
    return to_multipolygon(shapely.set_precision(area, GRID_M))
