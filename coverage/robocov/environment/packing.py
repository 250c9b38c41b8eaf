"""Random and dense packings of an area: points that keep a minimum spacing from each other."""

from __future__ import annotations

import math

import numpy as np
import shapely
from scipy.spatial import cKDTree
from shapely.geometry.base import BaseGeometry

from robocov.typing import FloatArray

_ROW_DISTANCE = math.sqrt(3) / 2
"""Distance between the rows of the hexagonal lattice of spacing 1, the densest packing of the plane."""
_AREA_PER_POINT = _ROW_DISTANCE
"""Area per point of this lattice: the distance between two points in a row, 1, times that of the rows."""
_PACKING_TRIALS = 6
"""Number of random packings from which the densest one is chosen."""
_MAX_POINTS_FOR_TRIALS = 300
"""Maximum number of points for which several packings are tried; larger packings take longer."""
_LATTICE_TRIALS = 20
"""Number of random positions and orientations that are tried for a lattice."""
_MAX_LATTICE_STEPS = 2000
"""Maximum number of rows on each side of the middle of a lattice. Larger areas are left to random points."""
_MIN_CANDIDATES = 64
"""Minimum number of random candidates that are drawn at a time."""
_CANDIDATES_PER_POINT = 4
"""Expected number of candidates inside the area that are drawn for each missing point."""
_MAX_CANDIDATES_PER_NEW_POINT = 100
"""The random packing ends when fewer than one in this number of candidates inside the area become points."""
_MIN_AREA_FRACTION = 1e-3
"""Minimum fraction of its bounding box that an area is assumed to fill."""


def bound_point_count(area: BaseGeometry, spacing: float) -> int:
    """Compute an upper bound on the number of points in any packing of an area.

    Parameters
    ----------
    area : geometry, m
        Area that contains the points.
    spacing : float, m
        Minimum distance between two points.

    Returns
    -------
    int
        No packing has more points if all parts of the area are convex; otherwise an estimate.
    """
    # Discs of diameter `spacing` around the points do not overlap, and lie in the area dilated by their
    # radius. No packing of the plane is denser than the hexagonal lattice. For a convex part, the bound
    # follows from Groemer's inequality (1960): N <= 2/√3 A + P/2 + 1 for spacing 1, with the area A and the
    # perimeter P. For other parts, it is an estimate.
    max_count = 0
    for part in shapely.get_parts(area):
        max_count += 1 + int(part.buffer(spacing / 2).area / (spacing**2 * _AREA_PER_POINT))
    return max_count


def estimate_point_count(area: BaseGeometry, spacing: float) -> int:
    """Estimate the number of points in the densest packing of a large area.

    Parameters
    ----------
    area : geometry, m
        Area that contains the points.
    spacing : float, m
        Minimum distance between two points.

    Returns
    -------
    int
        At least 1. Effects of the boundary are neglected.
    """
    return max(1, int(area.area / (spacing**2 * _AREA_PER_POINT)))


def pack_densely(area: BaseGeometry, spacing: float) -> FloatArray:
    """Pack points into an area as densely as possible: choose the best of several random packings.

    Equal areas and spacings always give the same points.

    Parameters
    ----------
    area : geometry, m
        Area that contains the points.
    spacing : float, m
        Minimum distance between two points.

    Returns
    -------
    (k, 2) array, m
        The points.
    """
    best_points = np.empty((0, 2))
    max_count = bound_point_count(area, spacing)
    trial_count = _PACKING_TRIALS if max_count <= _MAX_POINTS_FOR_TRIALS else 1
    for trial in range(trial_count):
        rng = np.random.default_rng(trial)
        lattice_points = pack_lattice(rng, area, max_count, spacing)
        # In passages that are barely wider than a robot, random points are denser than lattices.
        random_points = pack_randomly(rng, area, max_count, spacing)
        for points in (lattice_points, random_points):
            if len(points) > len(best_points):
                best_points = points
    return best_points


def pack_randomly(rng: np.random.Generator, area: BaseGeometry, max_count: int, spacing: float) -> FloatArray:
    """Pack random points into an area, one after another, until almost no more fit.

    Candidates are uniformly distributed in the area. A candidate that is too close to an earlier point is
    rejected ("random sequential addition").

    Parameters
    ----------
    rng : numpy.random.Generator
        Random number generator.
    area : geometry, m
        Area that contains the points.
    max_count : int
        Maximum number of points.
    spacing : float, m
        Minimum distance between two points.

    Returns
    -------
    (k, 2) array, m
        The points.
    """
    low_x, low_y, high_x, high_y = area.bounds
    bounding_box_area = (high_x - low_x) * (high_y - low_y)
    # Candidates are drawn in the bounding box. If the area is thin, most candidates are outside the area.
    area_fraction = max(area.area / bounding_box_area, _MIN_AREA_FRACTION)
    points = np.empty((0, 2))
    shapely.prepare(area)
    while len(points) < max_count:
        missing_count = max_count - len(points)
        drawn_count = max(_MIN_CANDIDATES, int(_CANDIDATES_PER_POINT * missing_count / area_fraction))
        candidates = rng.uniform((low_x, low_y), (high_x, high_y), size=(drawn_count, 2))
        candidates = candidates[shapely.contains_xy(area, candidates[:, 0], candidates[:, 1])]
        if len(points) > 0:
            distances, _ = cKDTree(points).query(candidates)
            candidates = candidates[distances >= spacing]
        new_points = _drop_close_points(candidates, spacing)
        points = np.concatenate([points, new_points])
        if len(new_points) < drawn_count * area_fraction / _MAX_CANDIDATES_PER_NEW_POINT:
            break
    return points[:max_count]


def _drop_close_points(points: FloatArray, spacing: float) -> FloatArray:
    """Drop each point that is within the spacing of an earlier point that remains."""
    if len(points) == 0:
        return points
    is_kept = np.ones(len(points), dtype=bool)
    pairs = cKDTree(points).query_pairs(spacing, output_type="ndarray")
    order = np.lexsort((pairs[:, 1], pairs[:, 0]))
    for first, second in pairs[order].tolist():
        if is_kept[first]:
            is_kept[second] = False
    return points[is_kept]


def pack_lattice(rng: np.random.Generator, area: BaseGeometry, max_count: int, spacing: float) -> FloatArray:
    """Pack points of a hexagonal lattice with a random position and orientation into an area.

    Several positions and orientations are tried, until one puts `max_count` points in the area. If none does,
    the one with the most points is chosen.

    Parameters
    ----------
    rng : numpy.random.Generator
        Random number generator.
    area : geometry, m
        Area that contains the points.
    max_count : int
        Maximum number of points. If more lie in the area, a random selection of this number is returned.
    spacing : float, m
        Minimum distance between two points.

    Returns
    -------
    (k, 2) array, m
        The points; none if the area is too large for a lattice.
    """
    low_x, low_y, high_x, high_y = area.bounds
    # The lattice must cover the area in every orientation. The random shift is up to sqrt(2) spacings long;
    # the margin of two spacings covers it.
    max_distance = float(np.hypot(high_x - low_x, high_y - low_y)) / 2 + 2 * spacing
    steps = int(np.ceil(max_distance / (spacing * _ROW_DISTANCE))) + 1
    if steps > _MAX_LATTICE_STEPS:
        return np.empty((0, 2))
    lattice = _build_lattice(steps) * spacing
    middle = np.array([(low_x + high_x) / 2, (low_y + high_y) / 2])
    best_points = np.empty((0, 2))
    shapely.prepare(area)
    for _ in range(_LATTICE_TRIALS):
        angle = rng.uniform(0, np.pi / 3)
        rotation = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        points = lattice @ rotation.T + middle + rng.uniform(-spacing, spacing, size=2)
        points = points[shapely.contains_xy(area, points[:, 0], points[:, 1])]
        if len(points) > len(best_points):
            best_points = points
        if len(best_points) >= max_count:
            return choose_points(rng, best_points, max_count)
    return best_points


def _build_lattice(steps: int) -> FloatArray:
    """Build the hexagonal lattice of spacing 1 with `steps` rows and columns on each side of the origin."""
    indices = np.arange(-steps, steps + 1)
    columns, rows = np.meshgrid(indices, indices)
    # Every other row is shifted by half the spacing.
    x = (columns + 0.5 * (rows % 2)).ravel()
    y = (rows * _ROW_DISTANCE).ravel()
    return np.column_stack([x, y])


def choose_points(rng: np.random.Generator, points: FloatArray, count: int) -> FloatArray:
    """Choose some of the given points at random, in their original order.

    Parameters
    ----------
    rng : numpy.random.Generator
        Random number generator.
    points : (k, 2) array, m
        Points to choose from.
    count : int
        Number of points to choose, at most k.

    Returns
    -------
    (count, 2) array, m
        The chosen points.
    """
    chosen = rng.choice(len(points), size=count, replace=False)
    return points[np.sort(chosen)]
