"""The coverage cost of robots of different speeds: times until the first robot arrives."""

from __future__ import annotations

import numpy as np
import pytest
from cost_cases import OFFICE, build_environment
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.cost import CoverageCost
from robocov.errors import InputError

COST = CoverageCost(OFFICE, lattice=24)
ROOM = CoverageCost(build_environment(), lattice=32)
seeds = st.integers(0, 2**32 - 1)


def draw_positions(n: int, rng: np.random.Generator) -> np.ndarray:
    """Return positions close to sites, no two at the same one."""
    return COST.points[rng.choice(len(COST.points), n, replace=False)] + rng.uniform(-1e-3, 1e-3, (n, 2))


@settings(max_examples=count_examples(25))
@given(seeds, st.integers(1, 7), st.sampled_from([(1.0, 0.4), (1.0,), (0.3, 0.5, 0.9, 1.1)]))
def test_times_are_the_minimum_of_path_length_over_speed(seed: int, n: int, speeds: tuple) -> None:
    """The expected distances come from the search from point to point, which shares no code with this one."""
    rng = np.random.default_rng(seed)
    robots = draw_positions(n, rng)
    speed = rng.choice(speeds, n)
    result = COST(robots, speeds=speed)
    sites = rng.choice(len(COST.points), 30, replace=False)
    distances = COST.geodesics.compute_distances(COST.points[sites], robots)
    times = distances / speed
    np.testing.assert_allclose(result.times[sites], times.min(axis=1), rtol=1e-6)
    owner = result.owners[sites]
    np.testing.assert_allclose(times[np.arange(30), owner], times.min(axis=1), rtol=1e-6)
    np.testing.assert_allclose(result.distances[sites], distances[np.arange(30), owner], rtol=1e-6)
    assert result.mean_time == pytest.approx(result.times.mean(), rel=1e-12)
    assert result.value == pytest.approx(result.mean_time * OFFICE.free.area, rel=1e-12)


@given(seeds, st.integers(1, 6), st.floats(0.1, 5.0))
def test_equal_speeds_only_change_the_unit(seed: int, n: int, speed: float) -> None:
    robots = draw_positions(n, np.random.default_rng(seed))
    plain = COST(robots)
    timed = COST(robots, speeds=np.full(n, speed))
    np.testing.assert_array_equal(timed.owners, plain.owners)
    np.testing.assert_array_equal(timed.distances, plain.distances)
    assert timed.mean_distance == plain.mean_distance
    assert timed.mean_time == pytest.approx(plain.mean_distance / speed, rel=1e-12)
    np.testing.assert_allclose(timed.gradient, plain.gradient / speed, rtol=1e-10, atol=1e-12)


@settings(max_examples=count_examples(15))
@given(seeds)
def test_the_gradient_is_that_of_the_value(seed: int) -> None:
    rng = np.random.default_rng(seed)
    robots = draw_positions(4, rng)
    speeds = np.array([1.0, 0.4, 1.0, 0.7])
    result = COST(robots, speeds=speeds)
    i = int(rng.integers(4))
    axis = int(rng.integers(2))
    step = 1e-6
    shift = np.zeros((4, 2))
    shift[i, axis] = step
    low = COST(robots - shift, speeds=speeds)
    high = COST(robots + shift, speeds=speeds)
    if (low.owners == high.owners).all() and (low.first_corners == high.first_corners).all():
        slope = (high.value - low.value) / (2 * step)
        assert slope == pytest.approx(result.gradient[i, axis], abs=1e-4)


def test_of_robots_that_arrive_together_the_fastest_owns_the_site() -> None:
    """Robot 0 needs 0.5 s for 0.25 m, robot 1 needs 0.5 s for 0.5 m."""
    site = ROOM.points[16 * 32 + 12]
    result = ROOM([site - [0.25, 0.0], site + [0.5, 0.0]], speeds=np.array([0.5, 1.0]))
    assert result.owners[16 * 32 + 12] == 1
    assert result.distances[16 * 32 + 12] == 0.5
    assert result.times[16 * 32 + 12] == 0.5


def test_a_fast_robot_owns_sites_that_are_nearer_to_a_slow_one() -> None:
    robots = np.array([[0.4, 0.5], [0.6, 0.5]])
    result = ROOM(robots, speeds=np.array([0.1, 1.0]))
    assert (result.owners == 0).mean() < 0.05
    assert result.mean_time is not None
    assert result.mean_time < ROOM(robots[1:], speeds=np.ones(1)).mean_time
    assert result.mean_distance > ROOM(robots).mean_distance
    assert "mean time" in repr(result)


def test_rooms_without_a_robot_are_uncovered_for_any_speed() -> None:
    halves = CoverageCost(build_environment(((0.45, 0.0), (0.55, 0.0), (0.55, 1.0), (0.45, 1.0))), lattice=20)
    result = halves([[0.2, 0.5], [0.3, 0.5]], speeds=[1.0, 2.0])
    assert np.isinf(result.times[result.owners < 0]).all()
    assert result.uncovered_area == pytest.approx(0.45)
    assert result.value == pytest.approx(result.mean_time * 0.45)


@pytest.mark.parametrize(
    ("speeds", "message"),
    [
        ([1.0], r"expected a number for each of 2 robots, got \[1.0\]"),
        ([1.0, 0.0], r"speeds\[1\]: expected a number above 0 m/s, got 0.0"),
        ([np.nan, 1.0], r"speeds\[0\]: expected a number above 0 m/s, got nan"),
        (["fast", 1.0], "a number for each of 2 robots"),
    ],
)
def test_invalid_speeds_are_rejected(speeds: list, message: str) -> None:
    with pytest.raises(InputError, match=message):
        ROOM([[0.2, 0.5], [0.3, 0.5]], speeds=speeds)
