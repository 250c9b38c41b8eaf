"""Lower bounds of the cost: comparison with known optima, and validity on triangles."""

from __future__ import annotations

from itertools import combinations_with_replacement

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples
from random_maps import KINDS, build_random_map

from robocov.cost import CoverageCost
from robocov.density.gaussians import Gaussian, Gaussians
from robocov.environment import Environment, PolygonObstacle
from robocov.errors import InputError, ParameterError
from robocov.k_median import apply_best_swaps, run_lloyd
from robocov.lower_bound import compute_lower_bound
from robocov.lower_bound.bound import _Dual
from robocov.lower_bound.profit_bounds import halve_triangles
from robocov.mapfile import load_map
from robocov.optimum import find_optimum


def build_room(width, height, *obstacles, name="room"):
    return Environment(name, ((0, 0), (width, 0), (width, height), (0, height)), obstacles)


def build_box(x0, y0, x1, y1):
    return PolygonObstacle(((x0, y0), (x1, y0), (x1, y1), (x0, y1)))


L_ROOM = build_room(4, 4, build_box(2, 2, 4, 4), name="L")
PILLARS = build_room(5, 4, build_box(1, 1, 2, 3), build_box(3, 0.8, 3.6, 2.2), name="pillars")


@pytest.mark.slow
def test_the_bound_of_one_robot_in_a_square_is_nearly_exact():
    bound = compute_lower_bound(build_room(4, 4), [[1.2, 3.1]], precision=2e-4)
    # This is the mean distance in a square from its center.
    min_mean_distance = CoverageCost(build_room(4, 4), 64)([[2.0, 2.0]]).mean_distance
    assert min_mean_distance * (1.0 - 4e-4) < bound.mean_distance < min_mean_distance
    assert min_mean_distance == pytest.approx(4 * 0.3825978582, rel=1e-4)
    assert bound.value == pytest.approx(16.0 * bound.mean_distance)
    assert bound.placement_mean_distance > 1.2 * min_mean_distance
    assert bound.max_saving == 1.0 - bound.mean_distance / bound.placement_mean_distance


def test_the_bound_of_two_robots_in_a_corridor_is_nearly_exact():
    corridor = build_room(20, 0.5)
    positions = [[5.0, 0.25], [15.0, 0.25]]
    bound = compute_lower_bound(corridor, positions, lattice=200)
    # The last bit depends on the linear algebra library.
    mean_distance = CoverageCost(corridor, 200)(positions).mean_distance
    assert bound.placement_mean_distance == pytest.approx(mean_distance, rel=1e-14)
    assert 0.0 < bound.max_saving < 0.001


@pytest.mark.parametrize("environment", [L_ROOM, PILLARS], ids=lambda environment: environment.name)
@pytest.mark.parametrize("robots", [1, 2, 3])
def test_the_bound_is_just_below_the_best_of_all_teams_on_sites(environment, robots):
    cost = CoverageCost(environment, 9)
    distances = cost.geodesics.compute_distances(cost.points, cost.points)
    teams = np.array(list(combinations_with_replacement(range(len(distances)), robots)))
    batches = np.array_split(teams, 60)
    means = np.concatenate([distances[batch].min(axis=1).mean(axis=1) for batch in batches])
    bound = compute_lower_bound(environment, cost.points[teams[means.argmin()]], lattice=9, radius=1e-3)
    assert bound.placement_mean_distance == pytest.approx(means.min())
    best = find_optimum(environment, robots, lattice=9, radius=0.02)
    assert bound.mean_distance <= min(best.mean_distance, means.min())
    # The duality gap is larger with few sites.
    assert bound.mean_distance > best.mean_distance * 0.93


@pytest.mark.slow
def test_the_bound_is_close_to_the_optimum_on_a_bundled_map():
    environment = load_map("rooms")
    best = find_optimum(environment, 8, lattice=32, restarts=8)
    bound = compute_lower_bound(environment, best.positions, lattice=32)
    assert bound.placement_mean_distance == pytest.approx(best.mean_distance, rel=1e-12)
    assert 0.0 < bound.max_saving < 0.008


@settings(max_examples=count_examples(30))
@given(st.sampled_from(sorted(KINDS)), st.integers(0, 2**20), st.integers(1, 7))
def test_no_point_of_a_triangle_has_more_profit_than_its_bound(kind, seed, halvings):
    environment = build_random_map(kind, 12, seed)
    if environment is None:
        return
    rng = np.random.default_rng(seed)
    radius = float(rng.choice([1e-6, 0.02]))
    cost = CoverageCost(environment, 8, radius=radius)
    dual = _Dual.build(cost, rng.choice(cost.points, 3), radius)
    # With prices for few sites, an error at one of them is not hidden by the slack of the others.
    has_price = rng.random(len(dual.site_numbers)) < rng.choice([0.04, 1.0])
    prices = np.where(has_price, rng.uniform(2.0, 12.0, len(dual.site_numbers)), 0.0)
    triangles = dual.triangles
    for _ in range(halvings):
        triangles = halve_triangles(rng.permutation(triangles)[:30])
    _, profit, bound = dual.bound_triangle_profits(prices, triangles)
    barycentric = rng.dirichlet([0.5, 0.5, 0.5], (len(triangles), 12))
    barycentric[:, :3] = np.eye(3)
    grid_points = np.einsum("tpk,tkd->tpd", barycentric, triangles).reshape(-1, 2)
    points = cost.geodesics.grid.to_meters(grid_points)
    distances = cost.geodesics.compute_distances(points, cost.points[dual.site_numbers])
    profits = np.maximum(prices - distances, 0.0).sum(axis=1).reshape(len(triangles), 12)
    slack = 1e-9 * dual.total_weight
    assert (profits.max(axis=1) <= bound + slack).all()
    assert (profit <= bound + slack).all()


@pytest.mark.slow
@settings(max_examples=count_examples(8))
@given(st.sampled_from(sorted(KINDS)), st.integers(0, 2**20), st.integers(1, 9))
def test_no_team_costs_less_than_the_bound(kind, seed, robots):
    environment = build_random_map(kind, 10, seed)
    if environment is None:
        return
    rng = np.random.default_rng(seed)
    cost = CoverageCost(environment, 12)
    clearance = shapely.distance(environment.free.boundary, shapely.points(cost.points))
    candidates = cost.points[clearance >= 0.05]
    if not len(candidates):
        return
    bound = compute_lower_bound(
        environment, rng.choice(candidates, robots), lattice=12, radius=0.05, precision=0.01
    )
    counted_sites = cost.points[~np.isnan(bound.prices)]
    distances = cost.geodesics.compute_distances(candidates, counted_sites)
    distances = np.ascontiguousarray(distances.T)
    teams = [rng.choice(len(candidates), robots) for _ in range(200)]
    finite_distances = np.where(np.isinf(distances), 1e6, distances)
    teams += [apply_best_swaps(finite_distances, run_lloyd(finite_distances, team)) for team in teams[:5]]
    assert min(distances[:, team].min(axis=1).mean() for team in teams) >= bound.mean_distance


def test_triangles_cover_all_free_positions_near_walls():
    """The triangles cover every valid position, although GEOS buffers are not exact."""
    environment = load_map("cave")
    cost = CoverageCost(environment, 16)
    radius = 0.3
    triangles = _Dual.build(cost, cost.points[[0]], radius).triangles
    polygons = shapely.polygons(cost.geodesics.grid.to_meters(triangles))
    low_x, low_y, high_x, high_y = environment.free.bounds
    positions = np.random.default_rng(0).uniform((low_x, low_y), (high_x, high_y), (20_000, 2))
    points = shapely.points(positions)
    is_free = shapely.contains(environment.free, points)
    is_free &= shapely.distance(environment.free.boundary, points) >= radius
    assert is_free.sum() > 2000
    _, distances = shapely.STRtree(polygons).query_nearest(points[is_free], return_distance=True)
    assert (distances < 1e-9).all()


@pytest.mark.slow
def test_sites_are_weighted_by_the_density():
    environment = L_ROOM.with_density(Gaussians((Gaussian((1.0, 3.0), weight=5.0, sigma=0.4),), floor=0.1))
    best = find_optimum(environment, 2, lattice=32, restarts=4)
    bound = compute_lower_bound(environment, best.positions, lattice=32)
    assert bound.placement_mean_distance == pytest.approx(best.mean_distance, rel=1e-12)
    assert bound.value == pytest.approx(bound.mean_distance * best.value / best.mean_distance)
    assert 0.0 < bound.max_saving < 0.02


@pytest.mark.slow
def test_several_components_are_bounded_together():
    rooms = build_room(12, 4, build_box(7, 0, 7.2, 4), build_box(9.4, 0, 9.6, 4), name="three")
    for robots in (1, 2, 3, 4):
        best = find_optimum(rooms, robots, lattice=48, restarts=4)
        bound = compute_lower_bound(rooms, best.positions, lattice=48, precision=0.003)
        assert bound.value == pytest.approx(bound.mean_distance * best.value / best.mean_distance)
        assert 0.0 < bound.max_saving < 0.01
        counted_sites = CoverageCost(rooms, 48).points[~np.isnan(bound.prices)]
        covers_third_room = robots >= 3 or best.positions[:, 0].max() > 9.6
        assert (counted_sites[:, 0] > 9.6).any() == covers_third_room


def test_a_robot_on_each_site_costs_nothing():
    tiny = build_room(2, 2)
    bound = compute_lower_bound(tiny, CoverageCost(tiny, 2).points, lattice=2)
    assert (bound.mean_distance, bound.placement_mean_distance, bound.max_saving) == (0.0, 0.0, 0.0)


@pytest.mark.slow
def test_the_same_call_gives_the_same_bits():
    positions = [[1.0, 1.0], [3.0, 0.5]]
    first = compute_lower_bound(L_ROOM, positions, lattice=16)
    second = compute_lower_bound(L_ROOM, positions, lattice=16)
    assert first.mean_distance == second.mean_distance
    np.testing.assert_array_equal(first.prices, second.prices)


@pytest.mark.parametrize(
    ("parameters", "error", "message"),
    [
        ({"radius": 0.0}, ParameterError, "radius: expected a number from 0.000001 to inf m, got 0.0"),
        (
            {"radius": 3.0},
            ParameterError,
            "radius: expected a disc that fits in the free space around the positions, got 3 m",
        ),
        ({"precision": 0.0}, ParameterError, "precision: expected a number from 0.00001 to 1, got 0.0"),
        ({"lattice": 0}, ParameterError, "lattice: expected a whole number from 1 to 4096, got 0"),
        ({"positions": [[3.0, 3.0]]}, InputError, "positions[0]: expected a point inside the boundary"),
        ({"positions": []}, InputError, "positions: expected at least one robot, got none"),
        ({"positions": "x"}, InputError, "positions: expected [x, y] of each robot in meters, got 'x'"),
    ],
)
def test_invalid_parameters_are_named(parameters, error, message):
    with pytest.raises(error) as caught:
        compute_lower_bound(L_ROOM, **{"positions": [[1.0, 1.0]], "lattice": 8, **parameters})
    assert str(caught.value).startswith(message)


@pytest.mark.slow
def test_progress_goes_from_zero_to_one_and_may_stop_the_search():
    fractions = []
    compute_lower_bound(L_ROOM, [[1.0, 1.0], [3.0, 0.5]], lattice=8, progress=fractions.append)
    assert fractions == sorted(fractions)
    assert fractions[0] < 0.1
    assert fractions[-1] == 1.0

    def stop(fraction):
        if fraction > 0.3:
            raise InterruptedError

    with pytest.raises(InterruptedError):
        compute_lower_bound(L_ROOM, [[1.0, 1.0], [3.0, 0.5]], lattice=8, precision=1e-4, progress=stop)
