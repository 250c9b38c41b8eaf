"""The best points of cells by φ: against a search over a fine lattice, and against the closed forms."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from density_cases import GAUSSIANS, KINDS, POLYGONS, RASTERS
from numpy.testing import assert_allclose
from voronoi_cases import evaluate_performance

from robocov.density import Gaussian, Gaussians, WeightedArea, WeightedPolygons
from robocov.locational_cost import Distance, Sensing
from robocov.locational_cost.best_points import find_best_points, find_targets
from robocov.observation.neighbors import Neighbors
from robocov.observation.region import Region
from robocov.voronoi import partition

SQUARE = Region(np.array([[0.0, 0.0], [8.0, 0.0], [8.0, 8.0], [0.0, 8.0]]))
FUNCTIONS = {"median": Distance(), "low": Sensing(0.3), "high": Sensing(3.0)}


@pytest.mark.slow
@pytest.mark.parametrize("f", FUNCTIONS.values(), ids=FUNCTIONS)
@pytest.mark.parametrize(
    ("density", "within"),
    [(GAUSSIANS["two"], 3e-3), (RASTERS["bilinear"], 1e-2), (POLYGONS["rooms"], 4e-2)],
    ids=["Gaussians", "raster", "polygons"],
)
def test_sums_over_a_fine_lattice_find_nothing_better(density, within, f):
    """The slope there is nearly nothing of what all places pull, and no other place is better."""
    points, side = np.array([[2.5, 3.0], [6.5, 6.5]]), 500
    cells = partition(points, SQUARE, density=density)
    for point, ring in zip(find_best_points(cells, f, density), cells.polygons, strict=True):
        low, high = ring.min(axis=0), ring.max(axis=0)
        x, y = (low[k] + (np.arange(side) + 0.5) * (high[k] - low[k]) / side for k in (0, 1))
        places = np.column_stack([np.tile(x, side), np.repeat(y, side)])
        places = places[shapely.contains_xy(shapely.Polygon(ring), *places.T)]
        weights = density.evaluate(places)
        off = places - point
        r = np.hypot(*off.T)
        pull = weights * (1.0 if isinstance(f, Distance) else 2.0 * r / (r**2 + f.height**2) ** 2)
        slope = (pull / np.maximum(r, 1e-12)) @ off
        assert np.hypot(*slope) < within * pull.sum()
        if isinstance(f, Sensing) and f.height < 1.0:
            continue  # where the density has several tops, so has what such a sensor sees
        best = f.sign * float(weights @ evaluate_performance(f, r))
        for other in places[:: len(places) // 9]:
            assert f.sign * float(weights @ evaluate_performance(f, np.hypot(*(places - other).T))) > best


@pytest.mark.parametrize("f", FUNCTIONS.values(), ids=FUNCTIONS)
def test_with_a_density_that_hardly_varies_it_is_the_closed_form(f):
    points = np.random.default_rng(2).uniform(0.5, 7.5, (12, 2))
    nearly = Gaussians((Gaussian((4.0, 4.0), 1e-9, sigma=2.0),), 1.0)
    cells = partition(points, SQUARE, density=nearly)
    plain = find_best_points(partition(points, SQUARE), f)
    within = 3e-2 if isinstance(f, Sensing) and f.height < 1.0 else 2e-3
    assert_allclose(find_best_points(cells, f, nearly), plain, atol=within)


@pytest.mark.parametrize("target", ["median", "sensing"])
@pytest.mark.parametrize("density", KINDS.values(), ids=KINDS)
def test_targets_lie_in_their_cells(density, target):
    points = np.random.default_rng(4).uniform(0.2, 7.8, (9, 2))
    cells = partition(points, SQUARE, density=density)
    goals = find_targets(cells, density, target, 1.0)
    for goal, ring in zip(goals, cells.polygons, strict=True):
        assert shapely.Polygon(ring).buffer(1e-6).contains(shapely.Point(goal))


def test_a_heavy_room_holds_the_median():
    room = WeightedArea(((6.0, 6.0), (8.0, 6.0), (8.0, 8.0), (6.0, 8.0)), 100.0)
    density = WeightedPolygons((room,))
    cells = partition(np.array([[2.0, 2.0]]), SQUARE, density=density)
    x, y = find_best_points(cells, Distance(), density)[0]
    assert 6.0 < x < 8.0 and 6.0 < y < 8.0


def test_where_nothing_counts_the_centroid_stays():
    room = WeightedArea(((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)), 1.0)
    density = WeightedPolygons((room,), 0.0)
    cells = partition(np.array([[1.0, 4.0], [7.0, 4.0]]), SQUARE, density=density)
    found = find_best_points(cells, Distance(), density)
    assert np.array_equal(found[1], cells.centroid[1])
    assert found[0] == pytest.approx([0.5, 0.5], abs=0.2)


@pytest.mark.parametrize("target", ["median", "sensing"])
def test_a_target_depends_only_on_robots_within_range(target):
    density = GAUSSIANS["two"]
    points = np.random.default_rng(5).uniform(0.5, 7.5, (30, 2))
    ranges = np.full(len(points), 1.6)

    def find_first_target(places):
        neighbors = Neighbors.from_ranges(places, ranges[: len(places)])
        cells = partition(places, SQUARE, neighbors, density=density)
        return find_targets(cells, density, target, 1.0)[0].tolist()

    near = np.flatnonzero(np.hypot(*(points - points[0]).T) <= 1.6)
    assert find_first_target(points) == find_first_target(points[near])
