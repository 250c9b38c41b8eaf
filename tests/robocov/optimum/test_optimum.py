"""Best known placements: comparison with known optima and with exhaustive search."""

from __future__ import annotations

import subprocess
import sys
from itertools import combinations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples
from scipy.optimize import minimize
from scipy.spatial.distance import pdist

from robocov.cost import CoverageCost
from robocov.environment import Environment, PolygonObstacle, WallObstacle
from robocov.errors import ParameterError
from robocov.generator import generate_map
from robocov.k_median import seed_sources
from robocov.mapfile import load_map
from robocov.optimum import find_optimum
from robocov.optimum.search import _Search


def build_room(width, height, *obstacles, name="room"):
    return Environment(name, ((0, 0), (width, 0), (width, height), (0, height)), obstacles)


def build_box(x0, y0, x1, y1):
    return PolygonObstacle(((x0, y0), (x1, y0), (x1, y1), (x0, y1)))


L_ROOM = build_room(4, 4, build_box(2, 2, 4, 4), name="L")
TRAP = build_room(
    5, 4, WallObstacle(((2.5, 0), (2.5, 2.8), (4, 2.8)), 0.1), build_box(0.8, 2.6, 1.6, 3.2), name="trap"
)


def test_the_optimum_of_one_robot_is_the_center_of_a_square():
    best = find_optimum(build_room(4, 4), 1, restarts=3)
    np.testing.assert_allclose(best.positions, [[2, 2]], atol=1e-3)
    # This is the mean distance in a square from its center.
    assert best.mean_distance == pytest.approx(4 * 0.3825978582, rel=1e-4)
    assert best.value == pytest.approx(best.mean_distance * 16.0)
    assert best.uncovered_area == 0.0
    assert best.compute_agreement() == 1.0


def test_the_optima_of_four_robots_are_the_centers_of_the_quarters():
    best = find_optimum(build_room(4, 4), 4)
    np.testing.assert_allclose(best.positions, [[1, 1], [1, 3], [3, 1], [3, 3]], atol=2e-3)


def test_two_robots_halve_a_corridor():
    best = find_optimum(build_room(20, 0.5), 2, lattice=200, restarts=4)
    np.testing.assert_allclose(best.positions, [[5, 0.25], [15, 0.25]], atol=0.01)


def test_the_optimum_of_one_robot_agrees_with_an_exhaustive_search():
    arms = build_room(9, 5, build_box(0, 0, 4, 4), build_box(5, 0, 9, 4), name="T")
    best = find_optimum(arms, 1, restarts=4)
    cost = CoverageCost(arms, 64)
    grid = np.mgrid[0.1:8.95:0.1, 0.1:4.95:0.1].reshape(2, -1).T
    candidates = grid[shapely.contains_xy(arms.free.buffer(-0.1), *grid.T)]
    means = np.array([cost(position[None]).mean_distance for position in candidates])
    assert best.mean_distance <= means.min()
    np.testing.assert_allclose(best.positions[0], candidates[means.argmin()], atol=0.1)


@pytest.mark.parametrize("environment", [L_ROOM, TRAP], ids=lambda environment: environment.name)
def test_no_pair_of_sites_is_better_than_two_robots(environment):
    lattice = 20
    cost = CoverageCost(environment, lattice)
    clearances = shapely.distance(environment.free.boundary, shapely.points(cost.points))
    candidates = cost.points[clearances >= 0.102]
    distances = cost.geodesics.compute_distances(candidates, cost.points)
    pairs = combinations(range(len(candidates)), 2)
    min_mean_distance = min(np.minimum(distances[i], distances[j]).mean() for i, j in pairs)
    best = find_optimum(environment, 2, lattice=lattice)
    assert best.mean_distance <= min_mean_distance
    # A site is at most half a diagonal away from each robot, or a little more near walls.
    assert best.mean_distance >= min_mean_distance - cost.spacing


@pytest.mark.slow
@pytest.mark.parametrize("count", [2, 3])
def test_nelder_mead_finds_no_lower_cost(count):
    cost = CoverageCost(TRAP, 24)
    room = TRAP.free.buffer(-0.102)
    shapely.prepare(room)

    def compute_penalized_cost(flat):
        positions = flat.reshape(-1, 2)
        points = shapely.points(positions)
        distances = shapely.distance(room, points)
        nearest = shapely.get_coordinates(shapely.shortest_line(np.full(count, room), points))[::2]
        free_positions = np.where(distances[:, None] > 0, nearest, positions)
        return cost(free_positions).mean_distance + distances.sum()

    rng = np.random.default_rng(count)
    costs = []
    for _ in range(6):
        start = rng.uniform((0, 0), (5, 4), (count, 2))
        result = minimize(
            compute_penalized_cost, start.ravel(), method="Nelder-Mead", options={"maxfev": 300}
        )
        costs.append(result.fun)
    best = find_optimum(TRAP, count, lattice=24)
    assert best.mean_distance <= min(costs) * (1.0 + 1e-6)
    # The comparison is meaningful only if the other optimizer comes close.
    assert min(costs) < best.mean_distance * 1.05


def run_lloyd_on_sites(cost, positions):
    """Move each robot to the best site of its cell until the cost stops falling, and return the cost."""
    distances = cost.geodesics.compute_distances(cost.points, cost.points)
    result = cost(positions)
    while True:
        moved = result.positions.copy()
        for robot in range(len(moved)):
            cell = np.nonzero(result.owners == robot)[0]
            if len(cell):
                moved[robot] = cost.points[distances[:, cell].sum(axis=1).argmin()]
        after = cost(moved)
        if not after.mean_distance < result.mean_distance:
            return result.mean_distance
        result = after


@pytest.mark.slow
@pytest.mark.parametrize("name", ["rooms", "museum", "blocks-a", "trap"])
def test_the_result_is_not_worse_than_its_seeds_or_lloyds_iteration_from_them(name):
    environment = load_map(name)
    lattice = 16
    restarts = 6
    best = find_optimum(environment, 5, lattice=lattice, restarts=restarts, seed=3)
    search = _Search(CoverageCost(environment, lattice), 5)
    lloyd_costs = []
    for restart in range(restarts):
        seeds = seed_sources(search.table, 5, np.random.default_rng([3, restart]))
        start = search.candidates[seeds]
        assert best.costs[restart] <= best.costs_before_descent[restart] <= search.cost(start).mean_distance
        lloyd_costs.append(run_lloyd_on_sites(search.cost, start))
    assert best.mean_distance <= min(lloyd_costs)
    assert best.costs.min() == best.mean_distance == best.costs[best.restart]
    assert best.compute_gap(min(lloyd_costs)) == min(lloyd_costs) / best.mean_distance - 1.0 >= 0.0


@settings(max_examples=count_examples(12))
@given(st.integers(0, 2**20), st.sampled_from(["polygons", "blocks", "rooms"]), st.integers(1, 9))
def test_positions_are_free_and_have_the_returned_cost(seed, kind, robots):
    environment = generate_map(seed, kind=kind, side=8.0, gap=0.4)
    best = find_optimum(environment, robots, lattice=24, restarts=3, seed=seed)
    assert best.positions.shape == (robots, 2)
    points = shapely.points(best.positions)
    assert shapely.contains_properly(environment.free, points).all()
    assert (shapely.distance(environment.free.boundary, points) >= 0.1).all()
    assert robots == 1 or (pdist(best.positions) >= 0.2).all()
    assert (np.diff(best.positions[:, 0]) >= 0).all()
    expected = CoverageCost(environment, 24)(best.positions)
    assert expected.mean_distance == pytest.approx(best.mean_distance, rel=1e-12)
    assert expected.value == pytest.approx(best.value, rel=1e-12)
    assert expected.uncovered_area == best.uncovered_area == 0.0


@pytest.mark.slow
def test_more_restarts_begin_with_the_same_ones_and_are_not_worse():
    environment = load_map("museum")
    results = [
        find_optimum(environment, 6, lattice=24, restarts=restarts, seed=1) for restarts in (1, 2, 5, 9)
    ]
    costs = [best.mean_distance for best in results]
    assert costs == sorted(costs, reverse=True)
    assert costs[0] > costs[-1]
    for best in results:
        np.testing.assert_array_equal(best.costs, results[-1].costs[: len(best.costs)])


@pytest.mark.slow
def test_the_same_seed_gives_the_same_bytes_also_in_another_process():
    script = (
        "import sys\nfrom robocov.mapfile import load_map\nfrom robocov.optimum import find_optimum\n"
        "best = find_optimum(load_map('trap'), 4, lattice=32, restarts=4, seed=5)\n"
        "sys.stdout.write(best.positions.tobytes().hex() + best.costs.tobytes().hex())"
    )
    best = find_optimum(load_map("trap"), 4, lattice=32, restarts=4, seed=5)
    expected = best.positions.tobytes().hex() + best.costs.tobytes().hex()
    process = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert process.stdout == expected
    other = find_optimum(load_map("trap"), 4, lattice=32, restarts=4, seed=6)
    assert other.costs.tobytes() != best.costs.tobytes()


def test_the_largest_components_are_covered_first():
    rooms = build_room(12, 4, build_box(7, 0, 7.2, 4), build_box(9.4, 0, 9.6, 4), name="three")
    areas = [28.0, 9.6, 8.8]
    for robots in (1, 2, 3, 5):
        best = find_optimum(rooms, robots, lattice=48, restarts=4)
        assert best.uncovered_area == pytest.approx(sum(areas[robots:]))
        assert best.costs.min() == best.mean_distance
    # Three of five robots are in the largest room.
    assert (best.positions[:, 0] < 7).sum() == 3
    single = find_optimum(rooms, 1, lattice=48, restarts=2)
    np.testing.assert_allclose(single.positions, [[3.5, 2.0]], atol=0.02)


def test_all_rooms_stay_covered_although_the_mean_would_be_lower_without(monkeypatch):
    halves = build_room(12, 4, build_box(9, 0, 9.2, 4), name="halves")

    def seed_in_small_room(table, count, rng):
        # These candidates are the farthest from most sites.
        return np.argsort(table.sum(axis=0))[::-1][:count]

    monkeypatch.setattr("robocov.optimum.search.seed_sources", seed_in_small_room)
    search = _Search(CoverageCost(halves, 32), 3)
    seeds = search.candidates[seed_in_small_room(search.table, 3, None)]
    best = find_optimum(halves, 3, lattice=32, restarts=1)
    assert (seeds[:, 0] > 9.2).all()
    assert search.cost(seeds).mean_distance < best.mean_distance
    assert best.uncovered_area == 0.0


@pytest.mark.parametrize("name", ["museum", "trap"])
def test_the_table_approximates_the_exact_sums_over_all_sites(name):
    environment = load_map(name)
    search = _Search(CoverageCost(environment, 64), 6)
    assert 300 < len(search.table) < 1100 < len(search.cost.points)
    selection = np.random.default_rng(0).choice(len(search.candidates), 40, replace=False)
    exact = [search.cost(search.candidates[k][None]).mean_distance for k in selection]
    means = search.table[:, selection].sum(axis=0) / len(search.cost.points)
    np.testing.assert_allclose(means, exact, rtol=0.01)


def test_candidates_fill_the_room():
    environment = load_map("museum")
    search = _Search(CoverageCost(environment, 32), 6)
    assert 500 < len(search.candidates) < 900
    (component,) = search.space.components
    assert shapely.covers(component, shapely.points(search.candidates)).all()
    distance = pdist(search.candidates).min()
    assert distance >= search.space.spacing
    # Hardly any point of the room is farther than 1.5 of these distances from all candidates.
    nearby = shapely.MultiPoint(search.candidates).buffer(1.5 * distance)
    assert component.difference(nearby).area < 1e-6 * component.area


def test_pockets_without_a_site_or_too_small_for_a_robot_stay_empty():
    # No robot fits in a pocket that is 0.15 m wide.
    pocket = build_room(6, 4, build_box(0.15, 0, 0.25, 4), name="pocket")
    best = find_optimum(pocket, 2, lattice=32, restarts=3)
    assert best.uncovered_area == pytest.approx(0.6)
    assert (best.positions[:, 0] > 0.25).all()
    slot = build_room(6, 4, build_box(0.3, 0, 0.4, 4), name="slot")
    best = find_optimum(slot, 2, lattice=6, restarts=3)
    assert best.uncovered_area == pytest.approx(1.2)


def test_robots_fill_a_small_room_and_too_many_are_rejected():
    closet = build_room(1.2, 1.2, name="closet")
    best = find_optimum(closet, 16, lattice=32, restarts=2)
    assert (pdist(best.positions) >= 0.2).all()
    with pytest.raises(
        ParameterError, match=r"robots: expected at most about \d\d, as many as fit with radius 0\.1 m in map"
    ):
        find_optimum(closet, 60, lattice=32)
    with pytest.raises(
        ParameterError, match=r"radius: no space for a robot of radius 0\.7 m in map 'closet'"
    ):
        find_optimum(closet, 1, radius=0.7)


def test_the_search_places_teams_that_only_a_dense_packing_holds():
    """A square grid of the same spacing has only 25 points."""
    closet = build_room(1.2, 1.2, name="closet")
    assert len(closet.start().sample(28)) == 28
    best = find_optimum(closet, 28, lattice=16, restarts=1)
    assert (pdist(best.positions) >= 0.2).all()
    assert (shapely.distance(closet.free.boundary, shapely.points(best.positions)) >= 0.1).all()


def test_larger_robots_keep_farther_away():
    narrow = build_room(6, 6, build_box(0, 2.6, 5, 3.0), name="narrow")
    for radius in (0.05, 0.3, 0.45):
        best = find_optimum(narrow, 6, radius=radius, lattice=24, restarts=4)
        distance = shapely.distance(narrow.free.boundary, shapely.points(best.positions))
        assert distance.min() >= radius
        assert pdist(best.positions).min() >= 2 * radius


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"robots": 0}, "robots: expected a whole number from 1 to 500, got 0"),
        ({"robots": 2.0}, "robots: expected a whole number from 1 to 500, got 2.0"),
        ({"restarts": 0}, "restarts: expected a whole number from 1 to 100000, got 0"),
        ({"restarts": True}, "restarts: expected a whole number from 1 to 100000, got True"),
        ({"seed": -1}, "seed: expected a whole number of at least 0, got -1"),
        ({"radius": 0.0}, "radius: expected a number from 0.001 to 1000 m, got 0.0"),
        ({"radius": float("nan")}, "radius: expected a number from 0.001 to 1000 m, got nan"),
        ({"radius": 1e-5}, "radius: expected a number from 0.001 to 1000 m, got 1e-05"),
        ({"lattice": 0}, "lattice: expected a whole number from 1 to 4096, got 0"),
    ],
)
def test_parameters_out_of_range_are_named(parameters, message):
    with pytest.raises(ParameterError) as caught:
        find_optimum(L_ROOM, **{"robots": 2, **parameters})
    assert str(caught.value).startswith(message)


def test_progress_goes_from_zero_to_one_and_may_stop_the_search():
    fractions = []
    find_optimum(TRAP, 2, lattice=24, restarts=5, progress=fractions.append)
    assert fractions == sorted(fractions)
    assert fractions[0] < 0.3
    assert fractions[-1] == 1.0
    assert len(set(fractions)) > 5

    def stop(fraction):
        if fraction > 0.7:
            raise InterruptedError

    with pytest.raises(InterruptedError):
        find_optimum(TRAP, 2, lattice=24, restarts=5, progress=stop)
