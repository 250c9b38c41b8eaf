"""The communication graph, and neighbors within a reach."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from voronoi_cases import SQUARE

from robocov.errors import InputError
from robocov.observation import Observations
from robocov.observation.close_pairs import find_close_pairs
from robocov.observation.neighbors import Neighbors


@given(n=st.integers(1, 120), reach=st.floats(0.0, 8.0), seed=st.integers(0, 2**32))
def test_close_pairs_agree_with_all_distances(n: int, reach: float, seed: int) -> None:
    positions = np.random.default_rng(seed).uniform(0, 10, size=(n, 2))
    first, second, distance = find_close_pairs(positions, reach)
    expected = [
        (i, j)
        for i in range(n)
        for j in range(n)
        if i != j and np.hypot(*(positions[i] - positions[j])) <= reach
    ]
    assert list(zip(first.tolist(), second.tolist(), strict=True)) == expected
    np.testing.assert_allclose(distance, np.hypot(*(positions[first] - positions[second]).T))


@given(n=st.integers(1, 60), seed=st.integers(0, 2**32))
def test_two_robots_are_neighbors_when_both_are_in_range(n: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    positions = rng.uniform(0, 10, size=(n, 2))
    ranges = rng.uniform(0, 8, size=n)
    neighbors = Neighbors.from_ranges(positions, ranges)
    assert not neighbors.is_complete
    for i in range(n):
        expected = [
            j
            for j in range(n)
            if j != i and np.hypot(*(positions[i] - positions[j])) <= min(ranges[i], ranges[j])
        ]
        assert neighbors.list_neighbors(i).tolist() == expected


def build_observations(positions: np.ndarray, neighbors: Neighbors) -> Observations:
    return Observations(positions, positions, neighbors, positions, SQUARE)


def test_infinite_ranges_give_the_complete_graph() -> None:
    positions = np.array([[0.0, 0.0], [1e5, 0.0], [0.0, 2.0]])
    neighbors = Neighbors.from_ranges(positions, np.full(3, np.inf))
    assert neighbors.is_complete
    assert neighbors.list_neighbors(1).tolist() == [0, 2]
    first, second, _, _ = build_observations(positions, neighbors).find_neighbors(5.0)
    assert list(zip(first.tolist(), second.tolist(), strict=True)) == [(0, 2), (2, 0)]


def test_combined_graphs_have_the_ranges_of_all_robots() -> None:
    positions = np.array([[0.0, 0.0], [1.0, 0.0], [5.0, 0.0]])
    limited = Neighbors.from_ranges(positions, np.array([2.0, 3.0, 4.0]))
    complete = Neighbors(2)
    combined = Neighbors.combine([limited, complete])
    assert [combined.list_neighbors(i).tolist() for i in range(5)] == [[1], [0], [], [4], [3]]
    np.testing.assert_array_equal(combined.ranges, [2.0, 3.0, 4.0, np.inf, np.inf])
    assert Neighbors.combine([complete, complete]).ranges is None


@pytest.mark.parametrize("communication_range", [10.0, np.inf])
def test_neighbors_at_exactly_the_reach_are_near(communication_range: float) -> None:
    positions = np.array([[0.0, 0.0], [2.0, 0.0], [0.0, 2.5]])
    neighbors = Neighbors.from_ranges(positions, np.full(3, communication_range))
    near = build_observations(positions, neighbors).find_neighbors(2.0)
    assert list(zip(near[0].tolist(), near[1].tolist(), strict=True)) == [(0, 1), (1, 0)]


def test_near_neighbors_are_within_communication_range() -> None:
    positions = np.array([[0.0, 0.0], [1.0, 0.0], [1.5, 0.0]])
    neighbors = Neighbors.from_ranges(positions, np.array([0.5, 3.0, 3.0]))
    first, second, offset, distance = build_observations(positions, neighbors).find_neighbors(2.0)
    assert list(zip(first.tolist(), second.tolist(), strict=True)) == [(1, 2), (2, 1)]
    np.testing.assert_allclose(distance, 0.5)
    np.testing.assert_allclose(offset, [[-0.5, 0.0], [0.5, 0.0]])


@pytest.mark.parametrize(("robot", "neighbor"), [([0], [2]), ([2], [0]), ([-1], [0]), ([0], [-1])])
def test_pairs_of_robots_that_do_not_exist_are_rejected(robot: list[int], neighbor: list[int]) -> None:
    with pytest.raises(InputError, match="neighbors: expected indices of 2 robots, got"):
        Neighbors.from_pairs(2, np.array(robot), np.array(neighbor))
