"""Groups of robots that controllers on shared maps plan for, and the assignment of their goals."""

from __future__ import annotations

import numpy as np
import pytest
from planning_cases import REGION, build_map, build_planner

from robocov.controllers.exploration.shared_map import (
    MAX_SILENCE_S,
    Group,
    Placement,
    Plan,
    RobotLimits,
    Situation,
    _build_group,
    assign_goals,
)
from robocov.observation import Observations
from robocov.observation.neighbors import Neighbors
from robocov.team import Team


def test_goals_are_assigned_by_squared_path_lengths() -> None:
    """The sum of the path lengths would be smaller if robot 2 stayed where it is."""
    positions = np.array([[1.0, 1.0], [3.0, 1.0]])
    goals = np.array([[4.0, 2.4], [3.0, 1.0]])
    situation = Situation(
        group=Group(robots=np.arange(2), positions=positions, message_times=np.zeros(2)),
        previous_plan=None,
        known_map=build_map(),
        planner=build_planner(),
        density=None,
        limits=RobotLimits(radius=0.1, max_speed=1.0, sensing_range=3.0),
    )
    np.testing.assert_array_equal(assign_goals(situation, goals), goals[[1, 0]])


@pytest.mark.parametrize(
    ("goal", "silence", "is_expected"),
    [
        ([2.0, 1.0], 0.5 * MAX_SILENCE_S, True),
        ([2.0, 1.0], 2.0 * MAX_SILENCE_S, False),
        ([7.0, 1.0], 2.0 * MAX_SILENCE_S, True),
    ],
    ids=["short silence", "missed at its goal", "goal out of range"],
)
def test_silent_robots_are_expected_at_their_goals_until_they_are_missed_there(
    goal: list[float], silence: float, is_expected: bool
) -> None:
    time = 60.0
    positions = np.array([[1.0, 1.0], [7.0, 3.0]])
    not_linked = Neighbors.from_ranges(positions, np.full(2, 3.0))
    seen = Observations(positions, np.zeros((2, 2)), not_linked, np.full((2, 2), np.nan), REGION, time=time)
    previous_group = Group(
        robots=np.array([0, 1]), positions=positions, message_times=np.array([time, time - silence])
    )
    previous_plan = Plan(
        group=previous_group,
        placement=Placement(goals=np.array([[1.0, 1.0], goal]), is_final=False),
        known_map=build_map(),
        planner=build_planner(),
        density=None,
    )
    team = Team.homogeneous(2, communication_range=3.0)
    group = _build_group(seen, team, previous_plan, 0)
    assert group.robots.tolist() == ([0, 1] if is_expected else [0])
    if is_expected:
        assert group.positions[1].tolist() == goal
        assert group.message_times[1] == time - silence
