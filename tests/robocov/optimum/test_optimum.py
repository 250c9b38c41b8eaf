from __future__ import annotations

import subprocess
import sys
from itertools import combinations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
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
    # the mean distance in a square from its middle
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
    x, y = (part.ravel() for part in np.mgrid[0.1:8.95:0.1, 0.1:4.95:0.1])
    is_inside = shapely.contains_xy(arms.free.buffer(-0.1), x, y)
    places = np.column_stack([x, y])[is_inside]
    means = np.array([cost(place[None]).mean_distance for place in places])
    assert best.mean_distance <= means.min()
    np.testing.assert_allclose(best.positions[0], places[means.argmin()], atol=0.1)


@pytest.mark.parametrize("environment", [L_ROOM, TRAP], ids=lambda environment: environment.name)
def test_no_pair_of_sites_is_better_than_two_robots(environment):
    lattice = 20
    cost = CoverageCost(environment, lattice)
    away = shapely.distance(environment.free.boundary, shapely.points(cost.points))
    places = np.nonzero(away >= 0.102)[0]
    table = cost.geodesics.compute_distances(cost.points[places], cost.points)
    lowest = min(np.minimum(table[i], table[j]).mean() for i, j in combinations(range(len(places)), 2))
    best = find_optimum(environment, 2, lattice=lattice)
    assert best.mean_distance <= lowest
    # some site is at most half a diagonal away from each robot, and not much more where walls are near
    assert best.mean_distance >= lowest - cost.spacing


@pytest.mark.slow
@pytest.mark.parametrize("count", [2, 3])
def test_no_other_optimizer_ends_lower(count):
    cost = CoverageCost(TRAP, 24)
    room = TRAP.free.buffer(-0.102)
    shapely.prepare(room)

    def compute_penalized_cost(flat):
        positions = flat.reshape(-1, 2)
        points = shapely.points(positions)
        off = shapely.distance(room, points)
        ends = shapely.get_coordinates(shapely.shortest_line(np.full(count, room), points))[::2]
        return cost(np.where(off[:, None] > 0, ends, positions)).mean_distance + off.sum()

    rng = np.random.default_rng(count)
    ends = []
    for _ in range(6):
        start = rng.uniform((0, 0), (5, 4), (count, 2))
        found = minimize(compute_penalized_cost, start.ravel(), method="Nelder-Mead", options={"maxfev": 300})
        ends.append(found.fun)
    best = find_optimum(TRAP, count, lattice=24)
    assert best.mean_distance <= min(ends) * (1.0 + 1e-6)
    # otherwise the comparison would prove nothing
    assert min(ends) < best.mean_distance * 1.05


def run_lloyd_on_sites(cost, positions):
    """Move each robot to the best site of its cell until the cost stops falling; return the cost."""
    table = cost.geodesics.compute_distances(cost.points, cost.points)
    result = cost(positions)
    while True:
        moved = result.positions.copy()
        for robot in range(len(moved)):
            cell = np.nonzero(result.owner == robot)[0]
            if len(cell):
                moved[robot] = cost.points[table[:, cell].sum(axis=1).argmin()]
        after = cost(moved)
        if not after.mean_distance < result.mean_distance:
            return result.mean_distance
        result = after


@pytest.mark.slow
@pytest.mark.parametrize("name", ["rooms", "museum", "blocks-a", "trap"])
def test_the_result_is_never_worse_than_its_seeds_or_lloyds_iteration_from_them(name):
    environment, lattice, restarts = load_map(name), 16, 6
    best = find_optimum(environment, 5, lattice=lattice, restarts=restarts, seed=3)
    search = _Search(environment, CoverageCost(environment, lattice), 5, 0.1)
    ends = []
    for restart in range(restarts):
        drawn = seed_sources(search.table, 5, np.random.default_rng([3, restart]))
        start = search.candidates[drawn]
        assert best.costs[restart] <= best.costs_before_descent[restart] <= search.cost(start).mean_distance
        ends.append(run_lloyd_on_sites(search.cost, start))
    assert best.mean_distance <= min(ends)
    assert best.costs.min() == best.mean_distance == best.costs[best.restart]
    assert best.compute_gap(min(ends)) == min(ends) / best.mean_distance - 1.0 >= 0.0


@settings(max_examples=12)
@given(st.integers(0, 2**20), st.sampled_from(["polygons", "blocks", "rooms"]), st.integers(1, 9))
def test_positions_are_clear_and_the_cost_is_theirs(seed, kind, robots):
    environment = generate_map(seed, kind=kind, side=8.0, gap=0.4)
    best = find_optimum(environment, robots, lattice=24, restarts=3, seed=seed)
    assert best.positions.shape == (robots, 2)
    points = shapely.points(best.positions)
    assert shapely.contains_properly(environment.free, points).all()
    assert (shapely.distance(environment.free.boundary, points) >= 0.1).all()
    assert robots == 1 or (pdist(best.positions) >= 0.2).all()
    assert (np.diff(best.positions[:, 0]) >= 0).all()
    again = CoverageCost(environment, 24)(best.positions)
    assert again.mean_distance == pytest.approx(best.mean_distance, rel=1e-12)
    assert again.value == pytest.approx(best.value, rel=1e-12)
    assert again.uncovered_area == best.uncovered_area == 0.0


@pytest.mark.slow
def test_more_restarts_are_never_worse_and_start_with_the_same_ones():
    environment = load_map("museum")
    found = [find_optimum(environment, 6, lattice=24, restarts=restarts, seed=1) for restarts in (1, 2, 5, 9)]
    costs = [best.mean_distance for best in found]
    assert costs == sorted(costs, reverse=True)
    assert costs[0] > costs[-1]
    for best in found:
        np.testing.assert_array_equal(best.costs, found[-1].costs[: len(best.costs)])


@pytest.mark.slow
def test_the_same_seed_gives_the_same_bytes_also_in_another_process():
    script = (
        "import sys\nfrom robocov.mapfile import load_map\nfrom robocov.optimum import find_optimum\n"
        "best = find_optimum(load_map('trap'), 4, lattice=32, restarts=4, seed=5)\n"
        "sys.stdout.write(best.positions.tobytes().hex() + best.costs.tobytes().hex())"
    )
    best = find_optimum(load_map("trap"), 4, lattice=32, restarts=4, seed=5)
    here = best.positions.tobytes().hex() + best.costs.tobytes().hex()
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout == here
    other = find_optimum(load_map("trap"), 4, lattice=32, restarts=4, seed=6)
    assert other.costs.tobytes() != best.costs.tobytes()


def test_the_largest_components_are_covered_first():
    halves = build_room(12, 4, build_box(7, 0, 7.2, 4), build_box(9.4, 0, 9.6, 4), name="three")
    areas = [28.0, 9.6, 8.8]
    for robots in (1, 2, 3, 5):
        best = find_optimum(halves, robots, lattice=48, restarts=4)
        assert best.uncovered_area == pytest.approx(sum(areas[robots:]))
        assert best.costs.min() == best.mean_distance
    # of five the largest room gets three
    assert (best.positions[:, 0] < 7).sum() == 3
    one = find_optimum(halves, 1, lattice=48, restarts=2)
    np.testing.assert_allclose(one.positions, [[3.5, 2.0]], atol=0.02)


def test_rooms_are_never_given_up_for_a_lower_mean(monkeypatch):
    halves = build_room(12, 4, build_box(9, 0, 9.2, 4), name="halves")

    def seed_in_small_room(table, count, rng):
        # the candidates farthest from most sites are there
        return np.argsort(table.sum(axis=0))[::-1][:count]

    monkeypatch.setattr("robocov.optimum.search.seed_sources", seed_in_small_room)
    search = _Search(halves, CoverageCost(halves, 32), 3, 0.1)
    drawn = search.candidates[seed_in_small_room(search.table, 3, None)]
    best = find_optimum(halves, 3, lattice=32, restarts=1)
    assert (drawn[:, 0] > 9.2).all()
    assert search.cost(drawn).mean_distance < best.mean_distance
    assert best.uncovered_area == 0.0


@pytest.mark.parametrize("name", ["museum", "trap"])
def test_the_table_approximates_the_exact_sums_over_all_sites(name):
    environment = load_map(name)
    search = _Search(environment, CoverageCost(environment, 64), 6, 0.1)
    assert 300 < len(search.table) < 1100 < len(search.cost.points)
    some = np.random.default_rng(0).choice(len(search.candidates), 40, replace=False)
    exact = [search.cost(search.candidates[k][None]).mean_distance for k in some]
    means = search.table[:, some].sum(axis=0) / len(search.cost.points)
    np.testing.assert_allclose(means, exact, rtol=0.01)


def test_candidates_fill_the_room():
    environment = load_map("museum")
    search = _Search(environment, CoverageCost(environment, 32), 6, 0.1)
    assert 500 < len(search.candidates) < 900
    (part,) = search.space.components
    assert shapely.covers(part, shapely.points(search.candidates)).all()
    apart = pdist(search.candidates).min()
    assert apart >= search.space.spacing
    # no point of the room is farther from all candidates than they are from each other
    assert part.difference(shapely.MultiPoint(search.candidates).buffer(1.5 * apart)).area < 1e-6 * part.area


def test_pockets_without_a_site_or_too_small_for_a_robot_stay_empty():
    pocket = build_room(6, 4, build_box(0.15, 0, 0.25, 4), name="pocket")  # 0.15 m wide: no robot fits
    best = find_optimum(pocket, 2, lattice=32, restarts=3)
    assert best.uncovered_area == pytest.approx(0.6)
    assert (best.positions[:, 0] > 0.25).all()
    slot = build_room(6, 4, build_box(0.3, 0, 0.4, 4), name="slot")
    best = find_optimum(slot, 2, lattice=6, restarts=3)
    assert best.uncovered_area == pytest.approx(1.2)


def test_a_crowded_room():
    closet = build_room(1.2, 1.2, name="closet")
    best = find_optimum(closet, 16, lattice=32, restarts=2)
    assert (pdist(best.positions) >= 0.2).all()
    with pytest.raises(
        ParameterError, match=r"robots: expected at most about \d\d, as many as fit with radius 0\.1 m in map"
    ):
        find_optimum(closet, 60, lattice=32)
    with pytest.raises(ParameterError, match=r"robots: expected at most about 0, .* in map 'closet'"):
        find_optimum(closet, 1, radius=0.7)


def test_larger_robots_keep_farther_away():
    narrow = build_room(6, 6, build_box(0, 2.6, 5, 3.0), name="narrow")
    for radius in (0.05, 0.3, 0.45):
        best = find_optimum(narrow, 6, radius=radius, lattice=24, restarts=4)
        distance = shapely.distance(narrow.free.boundary, shapely.points(best.positions))
        assert distance.min() >= radius
        assert pdist(best.positions).min() >= 2 * radius


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ({"robots": 0}, "robots: expected a whole number from 1 to 500, got 0"),
        ({"robots": 2.0}, "robots: expected a whole number from 1 to 500, got 2.0"),
        ({"restarts": 0}, "restarts: expected a whole number from 1 to 100000, got 0"),
        ({"restarts": True}, "restarts: expected a whole number from 1 to 100000, got True"),
        ({"seed": -1}, "seed: expected a whole number of at least 0, got -1"),
        ({"radius": 0.0}, "radius: expected a number above 0 m, got 0.0"),
        ({"radius": float("nan")}, "radius: expected a number above 0 m, got nan"),
        ({"lattice": 0}, "lattice: expected a whole number from 1 to 4096, got 0"),
    ],
)
def test_parameters_out_of_range_are_named(words, message):
    with pytest.raises(ParameterError) as caught:
        find_optimum(L_ROOM, **{"robots": 2, **words})
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
