"""The cost on maps of every kind, against distances that are computed pair by pair, and by brute force."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import brute_force_geodesic as brute
import numpy as np
import pytest
import shapely
from cost_cases import compared
from drawn_maps import KINDS, SIDE, drawn_map, drawn_places
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from robocov.cost import CoverageCost
from robocov.mapfile import list_bundled_maps, load_map

kinds = st.sampled_from(sorted(KINDS))
seeds = st.integers(0, 2**32)


@settings(max_examples=120)
@given(kinds, st.integers(1, 40), seeds, st.integers(1, 24), st.integers(1, 60))
def test_distances_and_owners_agree_with_distances_from_point_to_point(kind, count, seed, lattice, robots):
    environment = drawn_map(kind, count, seed)
    assume(environment is not None)
    try:
        error = compared(environment, lattice, drawn_places(environment, robots, seed))
    except Exception as problem:
        assume("at least one site in the free space" not in str(problem))
        raise
    assert error < 1e-12


@settings(max_examples=40)
@given(
    kinds,
    st.integers(1, 25),
    seeds,
    st.sampled_from([1e-2, 0.37, 50.0, 1e3]),
    st.sampled_from([0.0, 1e3, -4e5]),
)
def test_distances_are_exact_for_maps_of_any_size_and_position(kind, count, seed, scale, shift):
    environment = drawn_map(kind, count, seed, scale, (shift, -2.0 * shift))
    assume(environment is not None and environment.free_area > 0.0)
    robots = drawn_places(environment, 12, seed)
    # far from the origin, the coordinates themselves are rounded
    size = SIDE * scale
    cost = CoverageCost(environment, 16)
    result = cost(robots)
    nearest = cost.geodesics.compute_distances(robots, cost.points).min(axis=0)
    reached = np.isfinite(nearest)
    error = np.abs(result.distances[reached] - nearest[reached]).max(initial=0.0)
    assert error < 1e-12 * size + 1e-15 * abs(shift)


@settings(max_examples=50)
@given(kinds, st.integers(1, 8), seeds, st.integers(1, 4))
def test_distances_agree_with_the_brute_force(kind, count, seed, robots):
    environment = drawn_map(kind, count, seed)
    assume(environment is not None and len(shapely.get_coordinates(environment.free)) < 120)
    cost = CoverageCost(environment, 5)
    places = [p for p in drawn_places(environment, 3 * robots, seed).tolist() if _well(environment, p)][
        :robots
    ]
    points = [p for p in cost.points.tolist() if _well(environment, p)]
    assume(places and points)
    expected = brute.distances(environment.free, places, points).min(axis=0)
    result = cost(places)
    good = np.array([_well(environment, p) for p in cost.points.tolist()])
    np.testing.assert_allclose(result.distances[good], expected, rtol=0, atol=1e-12 * SIDE)


def _well(environment, point):
    return brute.well_placed(environment.free, tuple(point), SIDE)


@settings(max_examples=40)
@given(kinds, st.integers(1, 30), seeds)
def test_robots_never_lengthen_distances_and_obstacles_never_shorten_them(kind, count, seed):
    environment = drawn_map(kind, count, seed)
    assume(environment is not None)
    robots = drawn_places(environment, 9, seed)
    cost = CoverageCost(environment, 20)
    few, many = cost(robots[:4]), cost(robots)
    assert (many.distances <= few.distances + 1e-12 * SIDE).all()
    straight = np.hypot(*(cost.points[:, None] - robots).transpose(2, 0, 1)).min(axis=1)
    assert (many.distances >= straight - 1e-12 * SIDE).all()
    emptier = type(environment)("drawn", environment.boundary, environment.obstacles[1:])
    other = CoverageCost(emptier, 20)
    shared = np.isin(other.cells, cost.cells)
    assert shared.sum() == len(cost.cells)
    assert (other(robots).distances[shared] <= many.distances + 1e-12 * SIDE).all()


@settings(max_examples=25)
@given(kinds, st.integers(1, 30), seeds)
def test_results_do_not_depend_on_the_order_of_calls_and_robots(kind, count, seed):
    environment = drawn_map(kind, count, seed)
    assume(environment is not None)
    robots, others = drawn_places(environment, 14, seed), drawn_places(environment, 5, seed + 1)
    cost = CoverageCost(environment, 24)
    first = cost(robots)
    cost(others)
    again, fresh = cost(robots), CoverageCost(environment, 24)(robots)
    for name in ("distances", "owner", "first_corner", "last_corner", "gradient"):
        for result in (again, fresh):
            np.testing.assert_array_equal(getattr(result, name), getattr(first, name))
    turned = cost(robots[::-1])
    np.testing.assert_allclose(turned.distances, first.distances, rtol=0, atol=1e-13 * SIDE)


@settings(max_examples=30)
@given(st.sampled_from(["polygons", "needles", "circles", "rooms"]), st.integers(1, 30), seeds)
def test_the_gradient_is_the_slope_of_the_value(kind, count, seed):
    environment = drawn_map(kind, count, seed)
    assume(environment is not None)
    rng = np.random.default_rng(seed)
    # robots away from walls
    low_x, low_y, high_x, high_y = environment.region.bounds
    robots = rng.uniform((low_x, low_y), (high_x, high_y), (40, 2))
    robots = robots[shapely.contains_xy(environment.free.buffer(-0.01), *robots.T)][:6]
    assume(len(robots))
    cost = CoverageCost(environment, 40)
    here = cost(robots)
    step = 1e-5
    compared = 0
    for robot in range(len(robots)):
        for k in (0, 1):
            moves = np.zeros((2, *robots.shape))
            moves[:, robot, k] = step, -step
            ahead, behind = cost(robots + moves[0]), cost(robots + moves[1])
            # a sum of distances is smooth as long as owners and ways stay what they are
            if not all(
                np.array_equal(getattr(there, name), getattr(here, name))
                for there in (ahead, behind)
                for name in ("owner", "first_corner")
            ):
                continue
            slope = (ahead.value - behind.value) / (2.0 * step)
            assert slope == pytest.approx(here.gradient[robot, k], abs=1e-6 * max(here.value, 1.0))
            compared += 1
    assert compared


@pytest.mark.parametrize("name", list_bundled_maps())
def test_bundled_maps_agree_with_distances_from_point_to_point(name):
    environment = load_map(name)
    robots = environment.start("uniform").sample(30, seed=1)
    assert compared(environment, 32, robots) < 1e-12


@pytest.mark.slow
@pytest.mark.parametrize("name", ["rooms", "corridor"])
def test_medium_maps_agree_with_the_brute_force(name):
    environment = load_map(name)
    cost = CoverageCost(environment, 6)
    places = [p for p in environment.start("uniform").sample(12, seed=5).tolist() if _well(environment, p)]
    points = [p for p in cost.points.tolist() if _well(environment, p)]
    expected = brute.distances(environment.free, places, points).min(axis=0)
    found = cost(np.array(places)).distances[[p in points for p in cost.points.tolist()]]
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * cost.geodesics.size)


@pytest.mark.slow
@pytest.mark.parametrize(("lattice", "robots"), [(32, 1000), (128, 1), (256, 300), (512, 50)])
def test_lattices_and_teams_of_every_size(lattice, robots):
    environment = drawn_map("polygons", 40, 5)
    places = drawn_places(environment, robots, 3)
    cost = CoverageCost(environment, lattice)
    result = cost(places)
    chosen = np.random.default_rng(0).choice(len(cost.points), min(len(cost.points), 400), replace=False)
    exact = cost.geodesics.compute_distances(places, cost.points[chosen]).min(axis=0)
    np.testing.assert_allclose(result.distances[chosen], exact, rtol=0, atol=1e-12 * SIDE)
    reached = result.distances[np.isfinite(result.distances)]
    assert result.mean_distance == pytest.approx(reached.mean(), rel=1e-12)


LARGE = """
import re, sys
from pathlib import Path
sys.path.insert(0, {folder!r})
from drawn_maps import drawn_map
from robocov.cost import CoverageCost
environment = drawn_map("polygons", 260, 4)
cost = CoverageCost(environment, 512)
cost(cost.points[::1000])
# not ru_maxrss, which a child inherits from whoever starts it
most = re.search(r"VmHWM:\\s+(\\d+) kB", Path("/proc/self/status").read_text())[1]
print(len(cost.corners), int(most) / 1e6)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="memory is measured otherwise")
def test_a_large_map_takes_less_than_half_a_gigabyte():
    folder = str(Path(__file__).parents[1])
    done = subprocess.run(
        [sys.executable, "-c", LARGE.format(folder=folder)], capture_output=True, text=True, check=True
    )
    corners, gigabytes = done.stdout.split()
    assert int(corners) > 400
    assert float(gigabytes) < 0.5


@pytest.mark.parametrize("name", ["museum", "city", "hospital", "warehouse", "office"])
def test_crowded_robots_see_corners_beyond_the_reach_of_their_sites(name):
    """Those in its midst are nearest to few sites, and yet to corners far away that others do not see."""
    environment = load_map(name)
    many = environment.start("uniform").sample(60, seed=3)
    rng = np.random.default_rng(0)
    for home in many[:2]:
        near = many[np.argsort(((many - home) ** 2).sum(axis=1))[:12]]
        robots = near.repeat(5, axis=0) + rng.normal(0.0, 0.02, (60, 2))
        robots = robots[shapely.contains_xy(environment.free, robots)]
        assert compared(environment, 24, robots) < 1e-12
