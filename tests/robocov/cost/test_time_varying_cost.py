"""The coverage cost of maps whose obstacles move."""

from __future__ import annotations

import numpy as np
import pytest

from robocov.cost import CoverageCost, TimeVaryingCost
from robocov.environment import CircleObstacle, Environment, ObstaclePath

SQUARE = ((0, 0), (6, 0), (6, 4), (0, 4))
STANDING = Environment("standing", SQUARE, (CircleObstacle((4.5, 2.0), 0.5),))
CROSSED = Environment(
    "crossed",
    SQUARE,
    (CircleObstacle((1.0, 1.0), 0.4, path=ObstaclePath(((1.0, 1.0), (5.0, 1.0)), 1.0, "back-and-forth")),),
)
ROBOTS = np.array([[1.0, 1.0], [5.0, 3.0], [3.0, 1.0]])


def test_without_moving_obstacles_the_given_cost_is_used() -> None:
    cost = CoverageCost(STANDING, 24)
    time_varying_cost = TimeVaryingCost(cost)
    assert time_varying_cost.get_cost(7.0) is cost
    result = time_varying_cost.evaluate_all_robots(7.0, ROBOTS)
    assert result is not None
    assert result.value == cost(ROBOTS).value
    assert time_varying_cost.evaluate_all_robots(0.0, ROBOTS[:0]) is None


def test_results_have_a_row_for_each_robot_whether_it_counts_or_not() -> None:
    cost = CoverageCost(CROSSED, 24)
    time_varying_cost = TimeVaryingCost(cost)
    working = np.array([True, True, False])
    result = time_varying_cost.evaluate_all_robots(0.0, ROBOTS, working)
    assert result is not None
    np.testing.assert_array_equal(result.positions, ROBOTS)
    # The first robot is run over at this time, and the last one has failed.
    assert set(result.owners.tolist()) == {1}
    assert (
        result.mean_distance
        == time_varying_cost.compute_summary(0.0, ROBOTS, working).mean_distance
        == cost(ROBOTS[1:2]).mean_distance
    )
    later = time_varying_cost.evaluate_all_robots(2.0, ROBOTS)
    assert later is not None
    assert set(later.owners.tolist()) == {0, 1}
    assert time_varying_cost.evaluate_all_robots(0.0, ROBOTS[:1]) is None


def test_only_the_latest_maps_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("robocov.cost.time_varying_cost._MAX_CACHED_MAPS", 2)
    time_varying_cost = TimeVaryingCost(CoverageCost(CROSSED, 8))
    first, second, third = [time_varying_cost.get_cost(time) for time in (1.0, 2.0, 3.0)]
    assert time_varying_cost.get_cost(2.0) is second
    assert time_varying_cost.get_cost(3.0) is third
    assert time_varying_cost.get_cost(1.0) is not first


def test_building_the_cost_of_another_time_can_be_canceled() -> None:
    def stop(done: float) -> None:
        raise InterruptedError

    time_varying_cost = TimeVaryingCost(CoverageCost(CROSSED, 24), progress=stop)
    with pytest.raises(InterruptedError):
        time_varying_cost.get_cost(1.0)
