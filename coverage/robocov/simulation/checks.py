"""Validation of simulation arguments."""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely

from robocov.conditions import TIME_TOLERANCE_S, Conditions
from robocov.environment import Environment
from robocov.errors import (
    ParameterError,
    StartError,
    format_bound,
    format_count,
    format_position,
    is_number,
    quote,
    require_number,
)
from robocov.team import Team
from robocov.typing import FloatArray

MIN_DT_S = 1e-4
"""Minimum control period."""
MAX_DT_S = 1.0
"""Maximum control period."""
MAX_START_VELOCITY_M_S = 1e4
"""Maximum component of a robot's velocity at the start, ten times the limit of its maximum speed. The physics
divides the steps of faster robots into so many substeps that a run would hardly advance."""


def check_dt(dt: float) -> None:
    """Check a control period.

    Parameters
    ----------
    dt : float, s
        Control period.

    Raises
    ------
    ParameterError
        If the period is not a number from `MIN_DT_S` to `MAX_DT_S`.
    """
    require_number("dt", dt, MIN_DT_S, MAX_DT_S, "s")


def count_steps(duration: float, dt: float) -> int:
    """Return the number of control steps of a run.

    Parameters
    ----------
    duration : float, s
        Simulated time.
    dt : float, s
        Control period.

    Returns
    -------
    int

    Raises
    ------
    ParameterError
        If the duration is negative or not finite.
    """
    if not is_number(duration) or not 0.0 <= duration < np.inf:
        raise ParameterError(f"duration: expected a finite number of at least 0 s, got {quote(duration)}")
    steps: int = round(duration / dt)
    return steps


def check_team(team: Any, robot_count: int) -> Team:
    """Check the size of a team, and return the team; by default, build one of identical robots.

    Parameters
    ----------
    team : Team or None
        By default `Team.homogeneous(robot_count)`.
    robot_count : int
        Expected number of robots.

    Returns
    -------
    Team

    Raises
    ------
    ParameterError
        If `team` is not a team, or has a different number of robots.
    """
    if team is None:
        return Team.homogeneous(robot_count)
    if not isinstance(team, Team):
        raise ParameterError(f"team: expected a Team, got {quote(team)}")
    if len(team) != robot_count:
        expected = format_count(robot_count, "robot")
        raise ParameterError(f"team: expected {expected}, one for each start, got {len(team)}")
    return team


def check_start_velocities(velocities: FloatArray) -> None:
    """Check the velocities of robots at the start.

    Parameters
    ----------
    velocities : (n, 2) array, m/s
        Initial velocities.

    Raises
    ------
    StartError
        If a component of a velocity exceeds `MAX_START_VELOCITY_M_S`.
    """
    for i in np.flatnonzero((np.abs(velocities) > MAX_START_VELOCITY_M_S).any(axis=1)).tolist():
        maximum = format_bound(MAX_START_VELOCITY_M_S)
        expected = f"expected numbers from -{maximum} to {maximum} m/s"
        raise StartError(f"velocities[{i}]: {expected}, got {velocities[i].tolist()}")


def check_conditions(conditions: Any, robot_count: int) -> Conditions | None:
    """Check conditions, and return them unless they are ideal.

    Parameters
    ----------
    conditions : Conditions or None
        None means ideal conditions.
    robot_count : int
        Number of robots of the team.

    Returns
    -------
    Conditions or None
        None if the conditions are ideal.

    Raises
    ------
    ParameterError
        If `conditions` is not a `Conditions` object, or refers to robots that the team does not have.
    """
    if conditions is None:
        return None
    if not isinstance(conditions, Conditions):
        raise ParameterError(f"conditions: expected Conditions, got {quote(conditions)}")
    conditions.check_team(robot_count)
    return None if conditions.is_ideal else conditions


def check_joins(environment: Environment, conditions: Conditions | None) -> None:
    """Check the positions at which robots are to join.

    Parameters
    ----------
    environment : Environment
        The map, whose boundary must enclose the positions.
    conditions : Conditions or None
        Contains the robots that join. None if no robot joins.

    Raises
    ------
    ParameterError
        If a robot is to join outside the boundary, or joins at a given position at time zero.
    """
    if conditions is None:
        return
    for k, join in enumerate(conditions.joins):
        if join.position is None:
            continue
        x, y = join.position
        prefix = f"conditions.joins[{k}]"
        if join.time <= TIME_TOLERANCE_S:
            expected = "expected a time above 0 s for a robot that joins at a given position"
            raise ParameterError(f"{prefix}: {expected}, got robot {join.robot} at {join.time:g} s")
        if not environment.boundary_polygon.covers(shapely.Point(x, y)):
            left, bottom, right, top = map(format_bound, environment.boundary_polygon.bounds)
            inside = f"inside the boundary of map {environment.name!r}"
            extent = f"x from {left} to {right} m, y from {bottom} to {top} m"
            got = f"got {format_position(x, y)} for robot {join.robot}"
            raise ParameterError(f"{prefix}: expected a position {inside} ({extent}), {got}")
