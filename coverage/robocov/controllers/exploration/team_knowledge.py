"""Knowledge of the other robots when a robot with `Atlas` plans: positions, and whether they move."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from robocov.controllers.exploration.atlas_memory import TeamGoals, TeamKnowledge
from robocov.controllers.exploration.shared_map import CERTAIN_RANGE_FRACTION, MAX_SILENCE_S
from robocov.controllers.exploration.teammates import TeammateReport, Teammates
from robocov.observation import Observations
from robocov.team import Team
from robocov.typing import BoolArray, FloatArray, IntArray

MAX_PLANNING_GROUP = 8
"""Number of robots that a robot with its own map plans for: itself and the nearest others."""
MIN_REST_S = 3.0
"""Time after which a robot that has not moved is at rest."""


class OtherRobots(NamedTuple):
    """The k other robots that a robot knows of. Those that it plans for come first."""

    robots: IntArray
    """(k,) Indices of the robots."""
    positions: FloatArray
    """(k, 2) m, their known or assumed positions."""
    is_fixed: BoolArray
    """(k,) Whether each robot is at rest, out of contact now, or not planned for."""
    is_quiet: bool
    """Whether all of them are at rest or out of contact now."""


class _LostRobots(NamedTuple):
    """Two masks of the k other robots that a robot knows of. Its current neighbors are in neither."""

    has_failed: BoolArray
    """(k,) Whether each robot is silent although it cannot have moved out of range."""
    is_missing: BoolArray
    """(k,) Whether each robot is silent although its assumed position is well within range."""


def update_knowledge(
    knowledge: TeamKnowledge,
    team_goals: TeamGoals | None,
    seen: Observations,
    team: Team,
    robot: int,
    reports: Sequence[TeammateReport],
) -> TeamKnowledge:
    """Return what a robot knows of the others after the observations of a step.

    Parameters
    ----------
    knowledge : TeamKnowledge
        What the robot knew before.
    team_goals : TeamGoals or None
        Goals in the robot's last plan. Robots that are out of range are assumed to be at these goals.
    seen : Observations
    team : Team
    robot : int
        Index of the robot.
    reports : sequence of TeammateReport
        Reports about other robots that have arrived since the last plan.

    Returns
    -------
    TeamKnowledge
    """
    teammates = _assume_at_goals(knowledge.teammates, team_goals)
    lost = _find_lost_robots(teammates, seen, team, robot)
    is_lost = lost.has_failed | lost.is_missing
    failed_robots = teammates.robots[lost.has_failed].tolist()
    lost_robots = teammates.robots[is_lost].tolist()
    loss_times = {**knowledge.loss_times, **dict.fromkeys(lost_robots, seen.time)}
    teammates = teammates.add_observation(
        robots=seen.neighbors.list_neighbors(robot),
        positions=seen.get_neighbor_positions(robot),
        own_position=seen.positions[robot],
        time=seen.time,
        is_lost=is_lost,
    )
    if reports:
        teammates = teammates.add_reports(reports, robot, loss_times)
    encountered = (knowledge.encountered - set(failed_robots)) | set(teammates.robots.tolist())
    return TeamKnowledge(teammates=teammates, encountered=encountered, loss_times=loss_times)


def list_others(
    teammates: Teammates, position: FloatArray, time: float, *, plans_for_all: bool
) -> OtherRobots:
    """List the other robots that a robot knows of, beginning with those that it plans for.

    Parameters
    ----------
    teammates : Teammates
    position : (2,) array, m
        Position of the robot.
    time : float, s
    plans_for_all : bool
        If true, the robot plans for all others. Otherwise, it plans for the nearest ones, at most
        `MAX_PLANNING_GROUP` robots including itself.

    Returns
    -------
    OtherRobots
    """
    is_at_rest = time - teammates.rest_times >= MIN_REST_S
    # A robot out of contact is assumed to have reached its goal, and to rest there.
    is_out_of_contact = teammates.message_times < time
    is_fixed = is_at_rest | is_out_of_contact
    is_outside_group = np.full(len(teammates.robots), not plans_for_all)
    squared_distances = ((teammates.positions - position) ** 2).sum(axis=1)
    nearest = np.argsort(squared_distances, kind="stable")[: MAX_PLANNING_GROUP - 1]
    is_outside_group[nearest] = False
    order = np.argsort(is_outside_group, kind="stable")
    return OtherRobots(
        robots=teammates.robots[order],
        positions=teammates.positions[order],
        is_fixed=(is_fixed | is_outside_group)[order],
        is_quiet=bool(is_fixed.all()),
    )


def _assume_at_goals(teammates: Teammates, team_goals: TeamGoals | None) -> Teammates:
    """Return the knowledge of the others with each robot at its goal in the last plan, if it has one."""
    if team_goals is None:
        return teammates
    _, rows, goal_rows = np.intersect1d(teammates.robots, team_goals.robots, return_indices=True)
    positions = teammates.positions.copy()
    positions[rows] = team_goals.goals[goal_rows]
    return teammates._replace(positions=positions)


def _find_lost_robots(teammates: Teammates, seen: Observations, team: Team, robot: int) -> _LostRobots:
    """Find the robots that have failed or are missing, as far as the robot with the given index can tell."""
    communication_range = float(team.communication_range[robot])
    is_neighbor = np.isin(teammates.robots, seen.neighbors.list_neighbors(robot))
    silence = np.where(is_neighbor, 0.0, seen.time - teammates.message_times)
    # Since their last messages, both robots may have moved apart at full speed, which is assumed to be equal.
    max_distance = teammates.message_distances + 2.0 * float(team.max_speed[robot]) * silence
    distance = np.sqrt(((teammates.positions - seen.positions[robot]) ** 2).sum(axis=1))
    return _LostRobots(
        has_failed=(silence > 0.0) & (max_distance < communication_range),
        is_missing=(silence > MAX_SILENCE_S) & (distance < CERTAIN_RANGE_FRACTION * communication_range),
    )
