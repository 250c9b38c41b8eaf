"""What a learner's action does: a force, or a velocity that the robot's own loop brings about."""

from __future__ import annotations

from typing import Literal, TypeAlias

import numpy as np

from robocov.arrays import Array
from robocov.errors import ParameterError, unknown_name
from robocov.robots import Team

Action: TypeAlias = Literal["force", "velocity"]
"""A force in N, or a velocity in m/s."""

ACTIONS: tuple[Action, ...] = ("force", "velocity")

FOLLOWING = 0.1
"""Time constant in seconds with which a robot follows a velocity that it is told."""


def checked_action(action: str) -> Action:
    """Return the kind of action that is meant; raises ParameterError when there is none of that name."""
    for known in ACTIONS:
        if action == known:
            return known
    raise ParameterError(f"action: {unknown_name('kind of action', str(action), ACTIONS)}")


def action_limit(action: Action, team: Team) -> Array:
    """Return the largest component of an action that makes sense, (n,) N or m/s.

    A force of m a + nu v is what it takes to go at the largest speed v and be accelerated by the largest
    acceleration a all the same; what is more has no effect. Larger actions are no mistake: the world limits
    speed and acceleration, for learners as for all controllers.

    >>> from robocov.robots import Team
    >>> action_limit("force", Team.homogeneous(2))
    array([4., 4.])
    """
    if action == "velocity":
        return team.max_speed
    return np.asarray(team.mass * team.max_acceleration + team.viscosity * team.max_speed)


def driving_forces(action: Action, values: Array, velocities: Array, team: Team) -> Array:
    """Return the forces of actions, (n, 2) N.

    A velocity u of `values`, (n, 2), asks for ``F = nu u + m (u - q') / FOLLOWING``, where q' are the
    `velocities` now, (n, 2) m/s: against the viscosity of (28), and towards u.
    """
    if action == "force":
        return values
    nu, stiffness = team.viscosity[:, None], team.mass[:, None] / FOLLOWING
    return np.asarray(nu * values + stiffness * (values - velocities))


def actions_of(action: Action, forces: Array, velocities: Array, team: Team) -> Array:
    """Return the actions that give forces now: the other way of `driving_forces`, (n, 2) N or m/s."""
    if action == "force":
        return forces
    nu, stiffness = team.viscosity[:, None], team.mass[:, None] / FOLLOWING
    return np.asarray((forces + stiffness * velocities) / (nu + stiffness))
