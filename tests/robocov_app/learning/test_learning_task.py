"""Tasks of learning: times, teams and rejected values."""

from __future__ import annotations

from typing import Any

import pytest

from robocov.conditions import Conditions
from robocov.errors import ParameterError
from robocov.team import Team
from robocov_app.learning import CoverageTask
from robocov_app.learning.task import change_task


def test_the_period_and_the_number_of_cycles_follow_from_the_times() -> None:
    task = CoverageTask(duration=10.0, dt=0.05, repeat=4)
    assert task.period == pytest.approx(0.2)
    assert task.cycles == 50
    assert CoverageTask().cycles == 600


def test_a_team_takes_precedence_over_the_number_of_robots() -> None:
    task = CoverageTask(robots=9, team=Team.homogeneous(3, max_speed=0.5))
    assert task.robots == 3
    assert task.agents == ["robot_1", "robot_2", "robot_3"]
    assert len(change_task(task, {"robots": 5}).whole_team) == 5
    assert change_task(task, {"duration": 5.0}).team is task.team
    assert change_task(None, {"robots": 2}).robots == 2
    assert repr(task) == "<CoverageTask 3 robots, 60 s, 600 actions, force, reward shared>"


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"robots": 0}, "robots: expected a whole number from 1 to 10000, got 0"),
        ({"repeat": 1.5}, r"repeat: expected a whole number"),
        ({"reward_every": 0}, "reward_every: expected a whole number"),
        ({"duration": 0.05}, r"duration: expected at least the time of one action, 0\.1 s"),
        ({"duration": float("nan")}, "duration: expected at least the time of one action, 0.1 s, got nan s"),
        ({"dt": 2.0}, r"dt: expected a number .*, got 2\.0"),
        ({"action": "push"}, "action: unknown kind of action 'push'"),
        ({"reward": "none"}, "reward: unknown kind of reward 'none'"),
        (
            {"action": "velocity", "dt": 0.2},
            r"dt: expected at most 0\.1 s for robots to follow velocities, got 0\.2 s",
        ),
        ({"contact_penalty": -1.0}, r"contact_penalty: expected a finite number of at least 0, got -1\.0"),
        ({"team": 6}, "team: expected a Team, got 6"),
        ({"observation": None}, "observation: expected an ObservationLayout, got None"),
        (
            {"conditions": Conditions(failures=((7, 3.0),))},
            r"conditions\.failures\[0\]: expected a robot from 1 to 6, got robot 7",
        ),
    ],
)
def test_invalid_values_are_rejected(values: dict[str, Any], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        CoverageTask(**values)


def test_unknown_names_of_values_are_rejected() -> None:
    with pytest.raises(ParameterError, match="unknown attribute of a task 'robot': did you mean 'robots'"):
        change_task(None, {"robot": 6})
