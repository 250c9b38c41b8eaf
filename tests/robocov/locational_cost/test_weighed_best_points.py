"""The best points of cells with a density φ: sums over a fine lattice, and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from density_cases import GAUSSIANS, KINDS, POLYGONS, RASTERS
from numpy.testing import assert_allclose
from voronoi_cases import evaluate_performance

from robocov.density import Gaussian, Gaussians, WeightedArea, WeightedPolygons
from robocov.locational_cost import Distance, Sensing, SquaredDistance
from robocov.locational_cost.best_points import find_best_points, find_targets
from robocov.observation.neighbors import Neighbors
from robocov.observation.region import Region
from robocov.voronoi import partition

SQUARE = Region(np.array([[0.0, 0.0], [8.0, 0.0], [8.0, 8.0], [0.0, 8.0]]))
FUNCTIONS = {"median": Distance(), "low": Sensing(0.3), "high": Sensing(3.0)}


def sample_ring(ring, side):
    """Return the points inside a ring of a lattice with `side` points on each side, (n, 2) m."""
    low = ring.min(axis=0)
    high = ring.max(axis=0)
    fractions = (np.arange(side) + 0.5) / side
    x = low[0] + fractions * (high[0] - low[0])
    y = low[1] + fractions * (high[1] - low[1])
    points = np.column_stack([np.tile(x, side), np.repeat(y, side)])
    return points[shapely.contains_xy(shapely.Polygon(ring), *points.T)]


@pytest.mark.slow
@pytest.mark.parametrize("f", FUNCTIONS.values(), ids=FUNCTIONS)
@pytest.mark.parametrize(
    ("density", "tolerance"),
    [(GAUSSIANS["two"], 3e-3), (RASTERS["bilinear"], 1e-2), (POLYGONS["rooms"], 4e-2)],
    ids=["Gaussians", "raster", "polygons"],
)
def test_sums_over_a_fine_lattice_find_nothing_better(density, tolerance, f):
    """The gradient is small against the sum of its absolute terms, and no other point is better."""
    points = np.array([[2.5, 3.0], [6.5, 6.5]])
    side = 500
    cells = partition(points, SQUARE, density=density)
    for point, ring in zip(find_best_points(cells, f, density), cells.polygons, strict=True):
        samples = sample_ring(ring, side)
        weights = density.evaluate(samples)
        offsets = samples - point
        r = np.hypot(*offsets.T)
        slopes = weights
        if isinstance(f, Sensing):
            slopes = weights * (2.0 * r / (r**2 + f.height**2) ** 2)
        gradient = (slopes / np.maximum(r, 1e-12)) @ offsets
        assert np.hypot(*gradient) < tolerance * slopes.sum()
        if isinstance(f, Sensing) and f.height < 1.0:
            # A low sensor has several optima if the density has several maxima.
            continue
        best = f.sign * float(weights @ evaluate_performance(f, r))
        for other in samples[:: len(samples) // 9]:
            distances = np.hypot(*(samples - other).T)
            assert f.sign * float(weights @ evaluate_performance(f, distances)) > best


@pytest.mark.parametrize("f", FUNCTIONS.values(), ids=FUNCTIONS)
def test_with_a_nearly_uniform_density_best_points_agree_with_the_closed_form(f):
    points = np.random.default_rng(2).uniform(0.5, 7.5, (12, 2))
    density = Gaussians((Gaussian((4.0, 4.0), 1e-9, sigma=2.0),), 1.0)
    cells = partition(points, SQUARE, density=density)
    expected = find_best_points(partition(points, SQUARE), f)
    tolerance = 2e-3
    if isinstance(f, Sensing) and f.height < 1.0:
        tolerance = 3e-2
    assert_allclose(find_best_points(cells, f, density), expected, atol=tolerance)


@pytest.mark.parametrize("target", ["median", "sensing"])
@pytest.mark.parametrize("density", KINDS.values(), ids=KINDS)
def test_targets_lie_in_their_cells(density, target):
    points = np.random.default_rng(4).uniform(0.2, 7.8, (9, 2))
    cells = partition(points, SQUARE, density=density)
    goals = find_targets(cells, density, target, 1.0)
    for goal, ring in zip(goals, cells.polygons, strict=True):
        assert shapely.Polygon(ring).buffer(1e-6).contains(shapely.Point(goal))


def test_the_best_point_for_squared_distances_is_the_weighted_centroid():
    points = np.random.default_rng(3).uniform(0.5, 7.5, (12, 2))
    density = GAUSSIANS["two"]
    cells = partition(points, SQUARE, density=density)
    best_points = find_best_points(cells, SquaredDistance(), density)
    assert_allclose(best_points, cells.centroids, atol=1e-6)


def test_the_median_is_in_the_room_with_most_of_the_mass():
    room = WeightedArea(((6.0, 6.0), (8.0, 6.0), (8.0, 8.0), (6.0, 8.0)), 100.0)
    density = WeightedPolygons((room,))
    cells = partition(np.array([[2.0, 2.0]]), SQUARE, density=density)
    x, y = find_best_points(cells, Distance(), density)[0]
    assert 6.0 < x < 8.0
    assert 6.0 < y < 8.0


def test_a_cell_without_mass_keeps_its_centroid():
    room = WeightedArea(((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)), 1.0)
    density = WeightedPolygons((room,), 0.0)
    cells = partition(np.array([[1.0, 4.0], [7.0, 4.0]]), SQUARE, density=density)
    points = find_best_points(cells, Distance(), density)
    assert np.array_equal(points[1], cells.centroids[1])
    assert points[0] == pytest.approx([0.5, 0.5], abs=0.2)


@pytest.mark.parametrize("target", ["median", "sensing"])
def test_a_target_depends_only_on_robots_within_range(target):
    density = GAUSSIANS["two"]
    points = np.random.default_rng(5).uniform(0.5, 7.5, (30, 2))
    ranges = np.full(len(points), 1.6)

    def find_first_target(positions):
        neighbors = Neighbors.from_ranges(positions, ranges[: len(positions)])
        cells = partition(positions, SQUARE, neighbors, density=density)
        return find_targets(cells, density, target, 1.0)[0].tolist()

    in_range = np.flatnonzero(np.hypot(*(points - points[0]).T) <= 1.6)
    assert find_first_target(points) == find_first_target(points[in_range])
