"""Free motion of robots: viscosity and kinematic limits, combined into one net force per robot.

A controller returns a force. Equation (28) with its sign corrected, m q'' = F - nu q', is solved exactly over
a substep, so viscosity is stable for any time step; then the change of velocity and the speed are
limited. The net force takes a point mass from its velocity to the resulting one within the substep. It is
what pymunk integrates.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from robocov.arrays import Array
from robocov.compiled import kernel
from robocov.team import Team


class MotionResponse(NamedTuple):
    """Response of robots to forces during one substep; each (n,)."""

    velocity_loss: Array
    """Fraction of the velocity that viscosity removes, 1 - exp(-nu dt / m)."""
    velocity_per_force: Array
    """Velocity gained per unit of the controller's force, m/s/N."""
    force_per_velocity: Array
    """Net force per change of velocity, m / dt, N/(m/s)."""
    max_velocity_change: Array
    """Largest change of velocity, max_acceleration * dt, m/s."""
    max_speed: Array
    """Largest speed after the substep, m/s."""


def compute_response(team: Team, dt: float) -> MotionResponse:
    """Compute the response of the robots of a team to forces during a substep.

    Parameters
    ----------
    team : Team
    dt : float, s
        Duration of the substep.

    Returns
    -------
    MotionResponse
    """
    rate = team.viscosity / team.mass
    velocity_loss = -np.expm1(-rate * dt)
    is_viscous = rate > 0
    effective_time = np.where(is_viscous, velocity_loss / np.where(is_viscous, rate, 1.0), dt)
    return MotionResponse(
        velocity_loss=velocity_loss,
        velocity_per_force=effective_time / team.mass,
        force_per_velocity=team.mass / dt,
        max_velocity_change=team.max_acceleration * dt,
        # A copy, because read-only arrays, such as those of a team, are a different type to the compiler.
        max_speed=team.max_speed.copy(),
    )


@kernel
def compute_clip_factor(x: float, y: float, limit: float) -> float:
    """Compute the factor by which to scale a vector so that it is at most `limit` long.

    Parameters
    ----------
    x, y : float
        The vector.
    limit : float
        Maximum length.

    Returns
    -------
    float
        At most 1; exactly 1 if the vector is short enough.
    """
    squared_length = x * x + y * y
    if squared_length > limit * limit:
        return limit / math.sqrt(squared_length)
    return 1.0


@kernel
def compute_net_forces(forces: Array, velocities: Array, response: MotionResponse, external: Array) -> Array:
    """Compute the net forces that pymunk integrates.

    The change of velocity is limited first, then the speed. Limiting the speed does not make the change
    larger again, because the old velocity is within the limit as well.

    Parameters
    ----------
    forces : (n, 2) array, N
        The controllers' forces.
    velocities : (n, 2) array, m/s
    response : MotionResponse
    external : (n, 2) or (0, 2) array, N
        Further forces, to which no limits apply; empty if there are none.

    Returns
    -------
    (n, 2) array, N
    """
    net = np.empty((len(forces), 2))
    for i in range(len(forces)):
        vx = velocities[i, 0]
        vy = velocities[i, 1]
        loss = response.velocity_loss[i]
        gain = response.velocity_per_force[i]
        dx = gain * forces[i, 0] - loss * vx
        dy = gain * forces[i, 1] - loss * vy
        scale = compute_clip_factor(dx, dy, response.max_velocity_change[i])
        new_vx = vx + dx * scale
        new_vy = vy + dy * scale
        scale = compute_clip_factor(new_vx, new_vy, response.max_speed[i])
        net[i, 0] = (new_vx * scale - vx) * response.force_per_velocity[i]
        net[i, 1] = (new_vy * scale - vy) * response.force_per_velocity[i]
        if len(external) > 0:
            net[i, 0] += external[i, 0]
            net[i, 1] += external[i, 1]
    return net
