"""Actions of robots, which are forces or velocities, and the driving forces that result from them."""

from typing import Any, Literal, TypeAlias, get_args

import numpy as np

from robocov.errors import ParameterError, quote, to_floats
from robocov.team import Team
from robocov.typing import FloatArray

Action: TypeAlias = Literal["force", "velocity"]
"""Kind of an action: a force in N, or a velocity in m/s."""
ACTIONS: tuple[Action, ...] = get_args(Action)
VELOCITY_TIME_CONSTANT_S = 0.1
"""Time constant with which a robot approaches a desired velocity."""


def compute_action_limits(action: Action, team: Team) -> FloatArray:
    """Compute the largest useful value of each component of an action, for each robot.

    A force of m a + ν v suffices to move at the maximum speed v and to accelerate by the maximum acceleration
    a at the same time; a larger force has no further effect. Larger actions are not an error, because the
    world limits speed and acceleration, for learners as for all controllers.

    Parameters
    ----------
    action : str
        Kind of the actions.
    team : Team

    Returns
    -------
    (n,) array, N or m/s
    """
    if action == "velocity":
        return team.max_speed
    return np.asarray(team.mass * team.max_acceleration + team.viscosity * team.max_speed)


def compute_driving_forces(
    action: Action, actions: FloatArray, velocities: FloatArray, team: Team
) -> FloatArray:
    """Compute the forces that execute the actions.

    Parameters
    ----------
    action : str
        Kind of the actions.
    actions : (n, 2) array, N or m/s
    velocities : (n, 2) array, m/s
        Current velocities.
    team : Team

    Returns
    -------
    (n, 2) array, N

    Notes
    -----
    For a desired velocity u, the force is ``F = ν u + m (u - q') / τ``, where q' is the current velocity, and
    τ is `VELOCITY_TIME_CONSTANT_S`. The first term compensates for the viscous drag in equation (28) of the
    paper; the second accelerates the robot toward u.
    """
    if action == "force":
        return actions
    viscosity, stiffness = _compute_velocity_gains(team)
    return np.asarray(viscosity * actions + stiffness * (actions - velocities))


def compute_actions(action: Action, forces: FloatArray, velocities: FloatArray, team: Team) -> FloatArray:
    """Compute the actions that result in given forces: the inverse of `compute_driving_forces`.

    Parameters
    ----------
    action : str
        Kind of the actions.
    forces : (n, 2) array, N
    velocities : (n, 2) array, m/s
        Current velocities.
    team : Team

    Returns
    -------
    (n, 2) array, N or m/s
    """
    if action == "force":
        return forces
    viscosity, stiffness = _compute_velocity_gains(team)
    return np.asarray((forces + stiffness * velocities) / (viscosity + stiffness))


def _compute_velocity_gains(team: Team) -> tuple[FloatArray, FloatArray]:
    """Return the viscosity ν and the gain m / τ of each robot, both (n, 1)."""
    return team.viscosity[:, None], team.mass[:, None] / VELOCITY_TIME_CONSTANT_S


def check_actions(actions: Any, count: int) -> FloatArray:
    """Check the actions of a team, and convert them to an array.

    Parameters
    ----------
    actions : array_like
    count : int
        Number of robots.

    Returns
    -------
    (count, 2) array

    Raises
    ------
    ParameterError
        If the actions are not numbers, have the wrong shape, or are not finite.
    """
    expected = f"an array of shape {(count, 2)}"
    array = to_floats("actions", actions, expected)
    if array.shape != (count, 2):
        raise ParameterError(f"actions: expected {expected}, got one of shape {array.shape}")
    is_finite = np.isfinite(array).all(axis=1)
    if not is_finite.all():
        robot = int(np.flatnonzero(~is_finite)[0])
        raise ParameterError(
            f"action of robot_{robot + 1}: expected finite numbers, got {quote(array[robot].tolist())}"
        )
    return array
