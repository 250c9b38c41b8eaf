"""Removal of hairs from a free space, and by how much two free spaces differ.

A hair is a slit in the free space, or a spur of it, that is thinner than the decimals of a map but longer
than walls may move. Rounding would close it without a word, and the report would say that a wall moved by its
length. So hairs are taken out first, and counted.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import shapely
from shapely import MultiPolygon, STRtree
from shapely.geometry.base import BaseGeometry

from robocov.arrays import Array
from robocov.environment import GRID_M
from robocov_app.formats.geometry.polygons import buffer_with_mitres, extract_sides, to_multipolygon, unite

_DIGITS = 9  # of distances in metres: what is less comes of rounding
_OVERLAP_M = 2 * GRID_M  # by how much what is filled or cut reaches beyond a hair
_MAX_SAMPLES = 4_000  # places along walls whose distances are measured


class Cleaned(NamedTuple):
    """A free space without hairs; the number of these, and the area that they covered, m²."""

    free: MultiPolygon
    number: int = 0
    area: float = 0.0


class Deviation(NamedTuple):
    """How two free spaces differ: the area that changed sides, m², and how far walls moved at most, m."""

    area: float
    distance: float


def remove_hairs(free: MultiPolygon, width: float, length: float) -> Cleaned:
    """Remove what is thinner and longer than given.

    Parameters
    ----------
    free : MultiPolygon, m, valid
    width : float, m
        Slits and spurs that are narrower are hairs,
    length : float, m
        if they are longer than this.

    Returns
    -------
    Cleaned
    """
    slits = _select_long(shapely.difference(_close(free, width), free), length)
    filled = free if not len(slits) else _round(unite([free, *_grow(slits)]))
    spurs = _select_long(shapely.difference(filled, _open(filled, width)), length)
    cleaned = filled if not len(spurs) else _round(shapely.difference(filled, unite(_grow(spurs))))
    if cleaned.is_empty:
        return Cleaned(free)
    area = float(shapely.area(slits).sum() + shapely.area(spurs).sum())
    return Cleaned(cleaned, len(slits) + len(spurs), area)


def measure_deviation(before: MultiPolygon, after: MultiPolygon) -> Deviation:
    """Measure by how much walls moved: the Hausdorff distance between them, at vertices and along edges.

    Parameters
    ----------
    before, after : MultiPolygon, m

    Returns
    -------
    Deviation
    """
    distance = 0.0
    for one, other in ((before, after), (after, before)):
        points = shapely.points(_sample_walls(one))
        walls = STRtree(shapely.linestrings(extract_sides(other)))
        _, away = walls.query_nearest(points, return_distance=True, all_matches=False)
        distance = max(distance, float(away.max()))
    area = float(shapely.symmetric_difference(before, after).area)
    return Deviation(area, round(distance, _DIGITS))


def _sample_walls(area: MultiPolygon) -> Array:
    """Return places on the walls of an area: its vertices, and some along long edges."""
    vertices = shapely.get_coordinates(area)
    spare = _MAX_SAMPLES - len(vertices)
    if spare > 0:
        vertices = shapely.get_coordinates(shapely.segmentize(area, 2 * area.length / spare))
    return np.asarray(np.unique(vertices, axis=0))


def _select_long(geometry: BaseGeometry, length: float) -> Array:
    """Return the polygons of a geometry that are longer than so many metres."""
    pieces = np.array(to_multipolygon(geometry).geoms, dtype=object)
    x, y, right, top = shapely.bounds(pieces).reshape(-1, 4).T
    is_rounding = shapely.area(pieces) < 1e-3 * GRID_M * shapely.length(pieces)
    return np.asarray(pieces[(np.hypot(right - x, top - y) > length) & ~is_rounding])


def _close(area: BaseGeometry, width: float) -> BaseGeometry:
    return _offset(_offset(area, width / 2), -width / 2)


def _open(area: BaseGeometry, width: float) -> BaseGeometry:
    return _offset(_offset(area, -width / 2), width / 2)


def _offset(area: BaseGeometry, distance: float) -> BaseGeometry:
    grown: BaseGeometry = buffer_with_mitres(area, distance)
    return grown


def _grow(pieces: Array) -> Sequence[BaseGeometry]:
    return list(buffer_with_mitres(pieces, _OVERLAP_M))


def _round(area: BaseGeometry) -> MultiPolygon:
    return to_multipolygon(shapely.set_precision(area, GRID_M))
