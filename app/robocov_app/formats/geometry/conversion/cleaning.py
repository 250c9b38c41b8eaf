"""Removal of hairs from a free space, and the difference between two free spaces.

A hair is a slit in the free space, or a spur of it, that is thinner than the resolution of the coordinates
but longer than walls may move. Rounding would silently close it, and the report would say that a wall moved
by the hair's length. So hairs are removed first, and counted.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import shapely
from shapely import MultiPolygon, STRtree
from shapely.geometry.base import BaseGeometry

from robocov.arrays import Array
from robocov.environment import GRID_M
from robocov_app.formats.geometry.crossings import extract_sides
from robocov_app.formats.geometry.polygons import buffer_with_mitres, to_multipolygon, unite

_DIGITS = 9
"""Decimals of distances in meters; smaller differences are rounding errors."""
_OVERLAP_M = 2 * GRID_M
"""Distance by which the area that is filled or removed extends beyond a hair."""
_MAX_SAMPLES = 4_000
"""Approximate number of points along walls at which distances are measured."""


class Cleaned(NamedTuple):
    """A free space without hairs.

    Attributes
    ----------
    free : MultiPolygon, m
    number : int
        Number of hairs that were removed.
    area : float, m²
        Total area of these hairs.
    """

    free: MultiPolygon
    number: int = 0
    area: float = 0.0


class Deviation(NamedTuple):
    """Difference of two free spaces.

    Attributes
    ----------
    area : float, m²
        Area that is free in only one of them.
    distance : float, m
        Largest distance by which walls have moved.
    """

    area: float
    distance: float


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


def measure_deviation(before: MultiPolygon, after: MultiPolygon) -> Deviation:
    """Measure the area that differs between two free spaces, and the distance between their walls.

    The latter is the Hausdorff distance, measured at the vertices and at points along long edges.

    Parameters
    ----------
    before, after : MultiPolygon, m

    Returns
    -------
    Deviation
    """
    distance = 0.0
    for first, second in ((before, after), (after, before)):
        points = shapely.points(_sample_walls(first))
        walls = STRtree(shapely.linestrings(extract_sides(second)))
        _, distances = walls.query_nearest(points, return_distance=True, all_matches=False)
        distance = max(distance, float(distances.max()))
    area = float(shapely.symmetric_difference(before, after).area)
    return Deviation(area, round(distance, _DIGITS))


def _sample_walls(area: MultiPolygon) -> Array:
    """Return points on the walls of an area, (n, 2) m: its vertices, and points along long edges."""
    vertices = shapely.get_coordinates(area)
    spare = _MAX_SAMPLES - len(vertices)
    if spare > 0:
        vertices = shapely.get_coordinates(shapely.segmentize(area, 2 * area.length / spare))
    return np.asarray(np.unique(vertices, axis=0))


def _select_long(geometry: BaseGeometry, length: float) -> Array:
    """Return the polygons of a geometry that are longer than `length`, m, without slivers due to rounding."""
    pieces = np.array(to_multipolygon(geometry).geoms, dtype=object)
    x, y, right, top = shapely.bounds(pieces).reshape(-1, 4).T
    # Area over perimeter is half the width of a thin polygon.
    is_rounding = shapely.area(pieces) < 1e-3 * GRID_M * shapely.length(pieces)
    return np.asarray(pieces[(np.hypot(right - x, top - y) > length) & ~is_rounding])


def _close(area: BaseGeometry, width: float) -> BaseGeometry:
    """Fill the gaps in an area that are narrower than `width`, m."""
    closed: BaseGeometry = buffer_with_mitres(buffer_with_mitres(area, width / 2), -width / 2)
    return closed


def _open(area: BaseGeometry, width: float) -> BaseGeometry:
    """Remove the parts of an area that are narrower than `width`, m."""
    opened: BaseGeometry = buffer_with_mitres(buffer_with_mitres(area, -width / 2), width / 2)
    return opened


def _grow(pieces: Array) -> Sequence[BaseGeometry]:
    return list(buffer_with_mitres(pieces, _OVERLAP_M))


def _round_to_grid(area: BaseGeometry) -> MultiPolygon:
    return to_multipolygon(shapely.set_precision(area, GRID_M))
