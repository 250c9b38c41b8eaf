"""The cost on random maps of many kinds, against distances from point to point and by brute force."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import brute_force_geodesic as brute
import numpy as np
import pytest
import shapely
from cost_cases import compute_distance_error
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from property_examples import count_examples
from random_maps import KINDS, SIDE, build_random_map, draw_positions

from robocov.cost import CoverageCost
from robocov.environment import Environment
from robocov.mapfile import list_bundled_maps, load_map

kinds = st.sampled_from(sorted(KINDS))
seeds = st.integers(0, 2**32)


@settings(max_examples=count_examples(120))
@given(kinds, st.integers(1, 40), seeds, st.integers(1, 24), st.integers(1, 60))
def test_distances_and_owners_agree_with_distances_from_point_to_point(kind, count, seed, lattice, robots):
    environment = build_random_map(kind, count, seed)
    assume(environment is not None)
    try:
        error = compute_distance_error(environment, lattice, draw_positions(environment, robots, seed))
    except Exception as problem:
        assume("at least one site in the free space" not in str(problem))
        raise
    assert error < 1e-12


@settings(max_examples=count_examples(40))
@given(
    kinds,
    st.integers(1, 25),
    seeds,
    st.sampled_from([1e-2, 0.37, 50.0, 1e3]),
    st.sampled_from([0.0, 1e3, -4e5]),
)
def test_distances_are_exact_for_maps_of_any_size_and_position(kind, count, seed, scale, shift):
    environment = build_random_map(kind, count, seed, scale, (shift, -2.0 * shift))
    assume(environment is not None and environment.free_area > 0.0)
    robots = draw_positions(environment, 12, seed)
    # Far from the origin, the coordinates themselves are rounded.
    size = SIDE * scale
    cost = CoverageCost(environment, 16)
    result = cost(robots)
    nearest = cost.geodesics.compute_distances(robots, cost.points).min(axis=0)
    reached = np.isfinite(nearest)
    error = np.abs(result.distances[reached] - nearest[reached]).max(initial=0.0)
    assert error < 1e-12 * size + 1e-15 * abs(shift)


@settings(max_examples=count_examples(50))
@given(kinds, st.integers(1, 8), seeds, st.integers(1, 4))
def test_distances_agree_with_the_brute_force(kind, count, seed, robots):
    environment = build_random_map(kind, count, seed)
    assume(environment is not None and len(shapely.get_coordinates(environment.free)) < 120)
    cost = CoverageCost(environment, 5, radius=0.0)
    candidates = draw_positions(environment, 3 * robots, seed).tolist()
    positions = [point for point in candidates if is_well_placed(environment, point)][:robots]
    is_compared = [is_well_placed(environment, point) for point in cost.points.tolist()]
    assume(positions and any(is_compared))
    points = cost.points[is_compared].tolist()
    expected = brute.compute_distances(environment.free, positions, points).min(axis=0)
    distances = cost(positions).distances[is_compared]
    np.testing.assert_allclose(distances, expected, rtol=0, atol=1e-12 * SIDE)


def is_well_placed(environment, point):
    """Return whether rounding cannot move a point across a wall."""
    return brute.is_well_placed(environment.free, tuple(point), SIDE)


@settings(max_examples=count_examples(40))
@given(kinds, st.integers(1, 30), seeds)
def test_robots_never_lengthen_distances_and_obstacles_never_shorten_them(kind, count, seed):
    environment = build_random_map(kind, count, seed)
    assume(environment is not None)
    robots = draw_positions(environment, 9, seed)
    cost = CoverageCost(environment, 20)
    tolerance = 1e-12 * SIDE
    distances = cost(robots).distances
    assert (distances <= cost(robots[:4]).distances + tolerance).all()
    offsets = cost.points[:, None] - robots
    straight_distances = np.hypot(offsets[:, :, 0], offsets[:, :, 1]).min(axis=1)
    assert (distances >= straight_distances - tolerance).all()
    emptier = Environment("drawn", environment.boundary, environment.obstacles[1:])
    emptier_cost = CoverageCost(emptier, 20)
    is_shared = np.isin(emptier_cost.cells, cost.cells)
    assert is_shared.sum() == len(cost.cells)
    assert (emptier_cost(robots).distances[is_shared] <= distances + tolerance).all()


@settings(max_examples=count_examples(25))
@given(kinds, st.integers(1, 30), seeds)
def test_results_do_not_depend_on_the_order_of_calls_and_robots(kind, count, seed):
    environment = build_random_map(kind, count, seed)
    assume(environment is not None)
    robots = draw_positions(environment, 14, seed)
    cost = CoverageCost(environment, 24)
    first = cost(robots)
    cost(draw_positions(environment, 5, seed + 1))
    repeated = cost(robots)
    by_new_cost = CoverageCost(environment, 24)(robots)
    for name in ("distances", "owners", "first_corners", "last_corners", "gradient"):
        np.testing.assert_array_equal(getattr(repeated, name), getattr(first, name))
        np.testing.assert_array_equal(getattr(by_new_cost, name), getattr(first, name))
    reversed_order = cost(robots[::-1])
    np.testing.assert_allclose(reversed_order.distances, first.distances, rtol=0, atol=1e-13 * SIDE)


@settings(max_examples=count_examples(30))
@given(st.sampled_from(["polygons", "needles", "circles", "rooms"]), st.integers(1, 30), seeds)
def test_the_gradient_is_the_slope_of_the_value(kind, count, seed):
    environment = build_random_map(kind, count, seed)
    assume(environment is not None)
    rng = np.random.default_rng(seed)
    low_x, low_y, high_x, high_y = environment.region.bounds
    robots = rng.uniform((low_x, low_y), (high_x, high_y), (40, 2))
    robots = robots[shapely.contains_xy(environment.free.buffer(-0.01), *robots.T)][:6]
    assume(len(robots))
    cost = CoverageCost(environment, 40)
    result = cost(robots)
    step = 1e-5
    comparisons = 0
    for robot in range(len(robots)):
        for axis in (0, 1):
            shift = np.zeros_like(robots)
            shift[robot, axis] = step
            high = cost(robots + shift)
            low = cost(robots - shift)
            # The value is smooth as long as owners and paths stay the same.
            if have_same_paths(high, result) and have_same_paths(low, result):
                slope = (high.value - low.value) / (2.0 * step)
                tolerance = 1e-6 * max(result.value, 1.0)
                assert slope == pytest.approx(result.gradient[robot, axis], abs=tolerance)
                comparisons += 1
    assert comparisons > 0


def have_same_paths(first, second):
    """Return whether owners and first corners of two results are the same."""
    has_same_owners = np.array_equal(first.owners, second.owners)
    return has_same_owners and np.array_equal(first.first_corners, second.first_corners)


@pytest.mark.parametrize("name", list_bundled_maps())
def test_bundled_maps_agree_with_distances_from_point_to_point(name):
    environment = load_map(name)
    robots = environment.start("uniform").sample(30, seed=1)
    assert compute_distance_error(environment, 32, robots) < 1e-12


@pytest.mark.slow
@pytest.mark.parametrize("name", ["rooms", "corridor"])
def test_medium_maps_agree_with_the_brute_force(name):
    environment = load_map(name)
    cost = CoverageCost(environment, 6)
    candidates = environment.start("uniform").sample(12, seed=5).tolist()
    positions = [point for point in candidates if is_well_placed(environment, point)]
    is_compared = [is_well_placed(environment, point) for point in cost.points.tolist()]
    expected = brute.compute_distances(environment.free, positions, cost.points[is_compared].tolist()).min(
        axis=0
    )
    distances = cost(positions).distances[is_compared]
    np.testing.assert_allclose(distances, expected, rtol=0, atol=1e-12 * cost.geodesics.size)


@pytest.mark.slow
@pytest.mark.parametrize(("lattice", "robots"), [(32, 1000), (128, 1), (256, 300), (384, 50)])
def test_costs_agree_with_distances_for_lattices_and_teams_of_any_size(lattice, robots):
    environment = build_random_map("polygons", 40, 5)
    positions = draw_positions(environment, robots, 3)
    cost = CoverageCost(environment, lattice)
    result = cost(positions)
    samples = min(len(cost.points), 400)
    sites = np.random.default_rng(0).choice(len(cost.points), samples, replace=False)
    expected = cost.geodesics.compute_distances(positions, cost.points[sites]).min(axis=0)
    np.testing.assert_allclose(result.distances[sites], expected, rtol=0, atol=1e-12 * SIDE)
    finite_distances = result.distances[np.isfinite(result.distances)]
    assert result.mean_distance == pytest.approx(finite_distances.mean(), rel=1e-12)


MEASURE_MEMORY = """
import re, sys
from pathlib import Path
sys.path.insert(0, {folder!r})
from random_maps import build_random_map
from robocov.cost import CoverageCost
from robocov.environment import Environment
environment = build_random_map("polygons", 260, 4)
cost = CoverageCost(environment, 512)
cost(cost.points[::1000])
# A child inherits ru_maxrss from the process that starts it.
kilobytes = re.search(r"VmHWM:\\s+(\\d+) kB", Path("/proc/self/status").read_text())[1]
print(len(cost.corners), int(kilobytes) / 1e6)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_a_large_map_takes_less_than_half_a_gigabyte():
    folder = str(Path(__file__).parents[1])
    process = subprocess.run(
        [sys.executable, "-c", MEASURE_MEMORY.format(folder=folder)],
        capture_output=True,
        text=True,
        check=True,
    )
    corners, gigabytes = process.stdout.split()
    assert int(corners) > 400
    assert float(gigabytes) < 0.5


@pytest.mark.parametrize("name", ["museum", "city", "hospital", "warehouse", "office"])
def test_crowded_robots_see_corners_beyond_the_reach_of_their_sites(name):
    """Robots in the middle of a crowd own few sites, but may see corners that others do not see."""
    environment = load_map(name)
    positions = environment.start("uniform").sample(60, seed=3)
    rng = np.random.default_rng(0)
    for center in positions[:2]:
        order = np.argsort(((positions - center) ** 2).sum(axis=1))
        robots = positions[order[:12]].repeat(5, axis=0) + rng.normal(0.0, 0.02, (60, 2))
        robots = robots[shapely.contains_xy(environment.free, robots)]
        assert compute_distance_error(environment, 24, robots) < 1e-12
