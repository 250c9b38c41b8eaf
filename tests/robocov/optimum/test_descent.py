"""Descent to a local minimum of the cost: components, stopping, and known minima."""

from __future__ import annotations

from collections import deque

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples
from scipy.spatial.distance import pdist

from robocov.cost import CoverageCost
from robocov.environment import CircleObstacle, Environment, PolygonObstacle, WallObstacle
from robocov.optimum import ConfigurationSpace, descend
from robocov.optimum.descent import _compute_quasi_newton_direction, _CurvaturePair

OFFICE = Environment(
    "office",
    ((0, 0), (12, 0), (12, 5), (9, 5), (9, 8), (0, 8)),
    (
        WallObstacle(((4, 0), (4, 3), (6.5, 3)), 0.2),
        WallObstacle(((3, 8), (3, 5)), 0.2),
        CircleObstacle((8.5, 2.5), 0.8),
        PolygonObstacle(((5, 5), (7, 4.5), (6.5, 6.5))),
    ),
)
COST = CoverageCost(OFFICE, 40)
RADIUS = 0.15
ROOM = ConfigurationSpace(OFFICE.free, RADIUS)
EMPTY = Environment("empty", ((0, 0), (6, 0), (6, 6), (0, 6)))


def sample_starts(seed, count):
    """Return random positions in the room that are far enough apart."""
    rng = np.random.default_rng(seed)
    positions = ROOM.find_nearest(rng.uniform((0, 0), (12, 8), (count, 2)), np.zeros(count, dtype=int))
    assert positions is not None
    return positions


def are_clear(positions, radius, free):
    """Return whether robots overlap neither walls nor each other."""
    distance = shapely.distance(free.boundary, shapely.points(positions))
    is_inside = shapely.contains_properly(free, shapely.points(positions))
    return bool((distance >= radius).all() and is_inside.all() and (pdist(positions) >= 2 * radius).all())


@settings(max_examples=count_examples(60))
@given(st.integers(0, 2**32), st.integers(1, 30))
def test_robots_move_to_the_nearest_free_positions(seed, count):
    rng = np.random.default_rng(seed)
    # About half of the desired positions coincide.
    is_random = rng.random((count, 1)) < 0.5
    desired_positions = np.where(is_random, rng.uniform((-2, -2), (14, 10), (count, 2)), [5.0, 4.0])
    positions = ROOM.find_nearest(desired_positions, np.zeros(count, dtype=int))
    assert positions is not None
    assert are_clear(positions, RADIUS, OFFICE.free)
    # Free positions do not change.
    repeated = ROOM.find_nearest(positions, np.zeros(count, dtype=int))
    np.testing.assert_array_equal(repeated, positions)


def test_no_positions_are_found_where_robots_do_not_fit():
    closet = Environment("closet", ((0, 0), (1, 0), (1, 1), (0, 1)))
    room = ConfigurationSpace(closet.free, 0.2)
    centers = np.full((5, 2), 0.5)
    assert room.find_nearest(centers[:4], np.zeros(4, dtype=int)) is not None
    assert room.find_nearest(centers, np.zeros(5, dtype=int)) is None


def test_robots_stay_in_their_component():
    halves = Environment("halves", EMPTY.boundary, (WallObstacle(((3.5, 0), (3.5, 6)), 0.1),))
    room = ConfigurationSpace(halves.free, 0.1)
    assert [component.centroid.x < 3.5 for component in room.components] == [True, False]
    desired_positions = np.array([[5.0, 2.0], [1.0, 2.0]])
    positions = room.find_nearest(desired_positions, np.array([0, 1]))
    np.testing.assert_allclose(positions, [[3.348, 2.0], [3.652, 2.0]], atol=1e-9)
    result = descend(CoverageCost(halves, 24), room, positions, np.array([0, 1]))
    np.testing.assert_allclose(result.positions, [[1.725, 3.0], [4.775, 3.0]], atol=0.03)


@settings(max_examples=count_examples(25))
@given(st.integers(0, 2**32), st.integers(1, 12))
def test_the_result_is_a_local_minimum_not_above_the_start(seed, count):
    start = sample_starts(seed, count)
    before = COST(start)
    result = descend(COST, ROOM, start, np.zeros(count, dtype=int))
    assert result.mean_distance <= before.mean_distance
    assert are_clear(result.positions, RADIUS, OFFICE.free)
    assert COST(result.positions).mean_distance == result.mean_distance
    # No small step lowers the cost noticeably.
    rng = np.random.default_rng(seed)
    for size in (0.2, 0.02, 0.002):
        for _ in range(8):
            shifted = result.positions + size * rng.normal(size=(count, 2))
            moved = ROOM.find_nearest(shifted, np.zeros(count, dtype=int))
            assert moved is None or COST(moved).mean_distance >= result.mean_distance * (1.0 - 2e-5)


def test_one_robot_ends_at_the_geometric_median_from_any_start():
    triangle = Environment("triangle", ((0, 0), (6, 0), (0, 4)))
    cost = CoverageCost(triangle, 48)
    room = ConfigurationSpace(triangle.free, 0.1)
    # This is Weiszfeld's iteration over the same sites.
    median = cost.points.mean(axis=0)
    for _ in range(500):
        weight = 1.0 / np.hypot(*(cost.points - median).T)
        median = weight @ cost.points / weight.sum()
    for start in ([[0.2, 0.2]], [[5.0, 0.3]], [[1.0, 2.9]]):
        result = descend(cost, room, np.array(start), np.zeros(1, dtype=int))
        np.testing.assert_allclose(result.positions[0], median, atol=2e-3)


def test_a_heartbeat_may_stop_the_descent():
    steps = []

    def interrupt():
        steps.append(1)
        if len(steps) == 3:
            raise InterruptedError

    with pytest.raises(InterruptedError):
        descend(COST, ROOM, sample_starts(0, 5), np.zeros(5, dtype=int), interrupt)
    assert len(steps) == 3


def test_robots_without_a_gradient_stay():
    # The robot in a component without a site has no gradient.
    closet = Environment("closet", EMPTY.boundary, (WallObstacle(((0.25, 0), (0.25, 6)), 0.02),))
    cost = CoverageCost(closet, 6)
    room = ConfigurationSpace(closet.free, 0.1)
    start = np.array([[0.12, 1.0], [3.0, 3.0]])
    result = descend(cost, room, start, np.array([1, 0]))
    np.testing.assert_array_equal(result.positions[0], start[0])
    single = descend(cost, room, start[:1], np.array([1]))
    assert np.isnan(single.mean_distance)


def test_curvature_pairs_of_a_quadratic_lead_to_its_minimum():
    rng = np.random.default_rng(4)
    factor = rng.normal(size=(4, 4))
    hessian = factor @ factor.T + np.eye(4)
    steps = np.linalg.eigh(hessian)[1].T.reshape(4, 2, 2)
    pairs = deque()
    for step in steps:
        change = (hessian @ step.ravel()).reshape(2, 2)
        pairs.append(_CurvaturePair(step, change))
    gradient = rng.normal(size=(2, 2))
    direction = _compute_quasi_newton_direction(gradient, np.ones((2, 1)), pairs)
    np.testing.assert_allclose(hessian @ direction.ravel(), -gradient.ravel(), atol=1e-12)


def test_a_few_dozen_steps_are_sufficient():
    steps = []
    for seed in range(6):
        before = len(steps)
        descend(COST, ROOM, sample_starts(seed, 6), np.zeros(6, dtype=int), lambda: steps.append(1))
        assert len(steps) - before < 60
    assert len(steps) / 6 < 35
