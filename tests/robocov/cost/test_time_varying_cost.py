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
    momentary = TimeVaryingCost(cost)
    assert momentary.get_cost(7.0) is cost
    result = momentary.evaluate_all_robots(7.0, ROBOTS)
    assert result is not None
    assert result.value == cost(ROBOTS).value
    assert momentary.evaluate_all_robots(0.0, ROBOTS[:0]) is None


def test_results_have_a_row_for_each_robot_whether_it_counts_or_not() -> None:
    cost = CoverageCost(CROSSED, 24)
    momentary = TimeVaryingCost(cost)
    working = np.array([True, True, False])
    result = momentary.evaluate_all_robots(0.0, ROBOTS, working)
    assert result is not None
    np.testing.assert_array_equal(result.positions, ROBOTS)
    # the first is run over at the time, the last has failed
    assert set(result.owner.tolist()) == {1}
    assert (
        result.mean_distance
        == momentary.compute_figures(0.0, ROBOTS, working)[0]
        == cost(ROBOTS[1:2]).mean_distance
    )
    later = momentary.evaluate_all_robots(2.0, ROBOTS)
    assert later is not None
    assert set(later.owner.tolist()) == {0, 1}
    assert momentary.evaluate_all_robots(0.0, ROBOTS[:1]) is None


def test_building_the_cost_of_another_time_can_be_cancelled() -> None:
    def stop(done: float) -> None:
        raise InterruptedError

    momentary = TimeVaryingCost(CoverageCost(CROSSED, 24), progress=stop)
    with pytest.raises(InterruptedError):
        momentary.get_cost(1.0)
