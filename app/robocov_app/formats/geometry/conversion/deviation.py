"""The difference between two free spaces: its area, and the distance by which walls have moved."""

from typing import NamedTuple

import numpy as np
import shapely
from shapely import MultiPolygon, STRtree

from robocov.typing import FloatArray
from robocov_app.formats.geometry.crossings import extract_sides

_DIGITS = 9
"""Decimals of distances in meters; smaller differences are rounding errors."""
_MAX_SAMPLES = 4_000
"""Approximate number of points along walls at which distances are measured."""


class Deviation(NamedTuple):
    """Difference of two free spaces.

    Attributes
    ----------
    area : float, m²
        Area that is free in only one of them.
    distance : float, m
        Maximum distance by which walls have moved.
    """

    area: float
    distance: float


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
        _, distances = _measure_distances(first, second)
        distance = max(distance, float(distances.max()))
    area = float(shapely.symmetric_difference(before, after).area)
    return Deviation(area, round(distance, _DIGITS))


def find_moved_walls(before: MultiPolygon, after: MultiPolygon, limit: float) -> FloatArray:
    """Find where walls have moved by more than a limit.

    Parameters
    ----------
    before, after : MultiPolygon, m
    limit : float, m

    Returns
    -------
    (n,) array of shapely.Point, m
        Points on walls of one of the free spaces that are farther than the limit from all walls of the other.
    """
    moved = []
    for first, second in ((before, after), (after, before)):
        points, distances = _measure_distances(first, second)
        moved.append(points[distances > limit])
    return np.concatenate(moved)


def _measure_distances(first: MultiPolygon, second: MultiPolygon) -> tuple[FloatArray, FloatArray]:
    """Return points on the walls of an area, and their distances from the walls of another one, m."""
    points = shapely.points(_sample_walls(first))
    walls = STRtree(shapely.linestrings(extract_sides(second)))
    _, distances = walls.query_nearest(points, return_distance=True, all_matches=False)
    return points, distances


def _sample_walls(area: MultiPolygon) -> FloatArray:
    """Return points on the walls of an area, (n, 2) m: its vertices, and points along long edges."""
    vertices = shapely.get_coordinates(area)
    spare = _MAX_SAMPLES - len(vertices)
    if spare > 0:
        vertices = shapely.get_coordinates(shapely.segmentize(area, 2 * area.length / spare))
    return np.asarray(np.unique(vertices, axis=0))
