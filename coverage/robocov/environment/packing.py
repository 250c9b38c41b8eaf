"""Random and dense packings of points with a minimum spacing."""

from __future__ import annotations

import math

import numpy as np
import shapely
from scipy.spatial import cKDTree
from shapely.geometry.base import BaseGeometry

from robocov.arrays import Array

_ROW_SPACING = math.sqrt(3) / 2
"""Distance between the rows of the hexagonal lattice of spacing 1, the densest packing of the plane.

The area per point is the same number.
"""
_PACKING_TRIALS = 6
"""Number of random packings from which the densest one is chosen."""
_MAX_POINTS_FOR_TRIALS = 300
"""Maximum number of points for which several packings are tried; larger packings take longer."""
_LATTICE_TRIALS = 20
"""Number of random positions and orientations to try for a lattice."""
_MAX_LATTICE_STEPS = 2000
"""Larger lattices are not tried, because darts fill large areas well enough."""
_MIN_DARTS = 64
"""Minimum number of darts that are thrown at a time."""
_DARTS_PER_POINT = 4
"""Expected number of darts inside the area that are thrown for each missing point."""
_MAX_DARTS_PER_HIT = 100
"""Throwing ends when fewer than one in this number of darts inside the area finds space."""
_MIN_AREA_FRACTION = 1e-3
"""Lower limit of the fraction of its bounding box that an area is assumed to fill."""


def compute_max_points(area: BaseGeometry, spacing: float) -> int:
    """Compute an upper bound on the number of points in any packing of an area.

    Parameters
    ----------
    area : geometry, m
    spacing : float, m

    Returns
    -------
    int
    """
    # Discs of diameter `spacing` around the points lie in the buffered area. No packing of the plane is
    # denser than the hexagonal lattice; in each separate part, one more disc may fit.
    max_points = 0
    for part in shapely.get_parts(area):
        max_points += 1 + int(part.buffer(spacing / 2).area / (spacing**2 * _ROW_SPACING))
    return max_points


def estimate_max_points(area: BaseGeometry, spacing: float) -> int:
    """Estimate how many points the densest packing of a large area has, from the size of the area.

    Parameters
    ----------
    area : geometry, m
    spacing : float, m

    Returns
    -------
    int
        At least 1.
    """
    return max(1, int(area.area / (spacing**2 * _ROW_SPACING)))


def pack_densely(area: BaseGeometry, spacing: float) -> Array:
    """Pack points into an area as densely as possible: the best of several random packings.

    The result is deterministic.

    Parameters
    ----------
    area : geometry, m
    spacing : float, m
        Smallest distance between two points.

    Returns
    -------
    (k, 2) array, m
    """
    best = np.empty((0, 2))
    max_points = compute_max_points(area, spacing)
    trials = _PACKING_TRIALS if max_points <= _MAX_POINTS_FOR_TRIALS else 1
    for trial in range(trials):
        rng = np.random.default_rng(trial)
        lattice = pack_lattice(rng, area, max_points, spacing)
        # In passages that are barely wider than a robot, darts pack more densely than lattices.
        darts = throw_darts(rng, area, max_points, spacing)
        for points in (lattice, darts):
            if len(points) > len(best):
                best = points
    return best


def throw_darts(rng: np.random.Generator, area: BaseGeometry, n: int, spacing: float) -> Array:
    """Choose up to n random points one after the other, until almost no more fit.

    Parameters
    ----------
    rng : numpy.random.Generator
    area : geometry, m
    n : int
        Maximum number of points.
    spacing : float, m
        Smallest distance between two points.

    Returns
    -------
    (k, 2) array, m
    """
    low_x, low_y, high_x, high_y = area.bounds
    bounding_box_area = (high_x - low_x) * (high_y - low_y)
    # Most darts thrown at the bounding box of a thin area miss the area.
    area_fraction = max(area.area / bounding_box_area, _MIN_AREA_FRACTION)
    points = np.empty((0, 2))
    shapely.prepare(area)
    while len(points) < n:
        missing = n - len(points)
        count = max(_MIN_DARTS, int(_DARTS_PER_POINT * missing / area_fraction))
        darts = rng.uniform((low_x, low_y), (high_x, high_y), size=(count, 2))
        darts = darts[shapely.contains_xy(area, darts[:, 0], darts[:, 1])]
        if len(points) > 0:
            distances, _ = cKDTree(points).query(darts)
            darts = darts[distances >= spacing]
        new_points = _drop_close_points(darts, spacing)
        points = np.concatenate([points, new_points])
        if len(new_points) < count * area_fraction / _MAX_DARTS_PER_HIT:
            break
    return points[:n]


def _drop_close_points(points: Array, spacing: float) -> Array:
    """Drop each point that is closer than `spacing` to an earlier point that is kept."""
    if len(points) == 0:
        return points
    is_kept = np.ones(len(points), dtype=bool)
    pairs = cKDTree(points).query_pairs(spacing, output_type="ndarray")
    in_order = np.lexsort((pairs[:, 1], pairs[:, 0]))
    for first, second in pairs[in_order].tolist():
        if is_kept[first]:
            is_kept[second] = False
    return points[is_kept]


def pack_lattice(rng: np.random.Generator, area: BaseGeometry, n: int, spacing: float) -> Array:
    """Choose up to n points of a hexagonal lattice with a random position and orientation.

    Several positions and orientations are tried, until one has n points in the area. If none does, the result
    is that with the most points.

    Parameters
    ----------
    rng : numpy.random.Generator
    area : geometry, m
    n : int
        Maximum number of points.
    spacing : float, m
        Smallest distance between two points.

    Returns
    -------
    (k, 2) array, m
        Empty for areas that are too large for a lattice.
    """
    low_x, low_y, high_x, high_y = area.bounds
    max_distance = float(np.hypot(high_x - low_x, high_y - low_y)) / 2 + 2 * spacing
    steps = int(np.ceil(max_distance / (spacing * _ROW_SPACING))) + 1
    if steps > _MAX_LATTICE_STEPS:
        return np.empty((0, 2))
    lattice = _build_lattice(steps) * spacing
    middle = np.array([(low_x + high_x) / 2, (low_y + high_y) / 2])
    best = np.empty((0, 2))
    shapely.prepare(area)
    for _ in range(_LATTICE_TRIALS):
        angle = rng.uniform(0, np.pi / 3)
        rotation = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        points = lattice @ rotation.T + middle + rng.uniform(-spacing, spacing, size=2)
        points = points[shapely.contains_xy(area, points[:, 0], points[:, 1])]
        if len(points) > len(best):
            best = points
        if len(best) >= n:
            return choose_points(rng, best, n)
    return best


def _build_lattice(steps: int) -> Array:
    """Return the hexagonal lattice of spacing 1 with `steps` rows and columns on each side of the origin."""
    numbers = np.arange(-steps, steps + 1)
    columns, rows = np.meshgrid(numbers, numbers)
    # Every other row is shifted by half a step.
    x = (columns + 0.5 * (rows % 2)).ravel()
    y = (rows * _ROW_SPACING).ravel()
    return np.column_stack([x, y])


def choose_points(rng: np.random.Generator, points: Array, n: int) -> Array:
    """Choose n points at random, in their original order.

    Parameters
    ----------
    rng : numpy.random.Generator
    points : (k, 2) array, m
    n : int

    Returns
    -------
    (n, 2) array, m
    """
    chosen = rng.choice(len(points), size=n, replace=False)
    return points[np.sort(chosen)]
