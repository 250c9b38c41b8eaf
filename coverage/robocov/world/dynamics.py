"""Free motion of robots: viscosity and kinematic limits, combined into one net force per robot.

A controller returns a force F. Equation (28) with its sign corrected, m q'' = F - nu q', is solved exactly
over a substep, so that the motion is stable for any time step. Then the change of velocity and the speed are
limited. The net force is the constant force under which a point mass reaches the resulting velocity in this
substep. Pymunk integrates the motion under net forces.

Equation numbers refer to Renzaglia and Martinelli, "Distributed Coverage Control for a Multi-Robot Team in a
Non-Convex Environment".
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from robocov.compiled import kernel
from robocov.team import Team
from robocov.typing import FloatArray


class MotionResponse(NamedTuple):
    """Response of robots to forces during one substep, (n,) each."""

    velocity_loss: FloatArray
    """Fraction of the velocity that viscosity removes, 1 - exp(-nu dt / m)."""
    velocity_per_force: FloatArray
    """Velocity gained per unit of the controller's force, m/s/N."""
    force_per_velocity: FloatArray
    """Net force needed per change of velocity, m / dt, N/(m/s)."""
    max_velocity_change: FloatArray
    """Maximum change of velocity, max_acceleration * dt, m/s."""
    max_speed: FloatArray
    """Maximum speed after the substep, m/s."""


def compute_response(team: Team, dt: float) -> MotionResponse:
    """Compute the response of the robots of a team to forces during a substep.

    Parameters
    ----------
    team : Team
        The n robots.
    dt : float, s
        Duration of the substep.

    Returns
    -------
    MotionResponse
        Coefficients and limits for a substep of this duration.
    """
    decay_rate = team.viscosity / team.mass
    velocity_loss = -np.expm1(-decay_rate * dt)
    is_viscous = decay_rate > 0
    # The change of velocity under a constant force F is F / m times this time, (1 - exp(-nu dt / m)) m / nu,
    # which approaches dt as the viscosity approaches 0.
    effective_time = np.where(is_viscous, velocity_loss / np.where(is_viscous, decay_rate, 1.0), dt)
    return MotionResponse(
        velocity_loss=velocity_loss,
        velocity_per_force=effective_time / team.mass,
        force_per_velocity=team.mass / dt,
        max_velocity_change=team.max_acceleration * dt,
        # The array of the team is read-only, which is a different type for the compiler. A copy is not.
        max_speed=team.max_speed.copy(),
    )


@kernel
def compute_clip_factor(x: float, y: float, limit: float) -> float:
    """Compute the factor that clips a vector to a maximum length.

    Parameters
    ----------
    x, y : float
        Components of the vector.
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
def compute_net_forces(
    forces: FloatArray, velocities: FloatArray, response: MotionResponse, external: FloatArray
) -> FloatArray:
    """Compute the net forces that pymunk integrates.

    The change of velocity is limited first, then the speed. Limiting the speed does not make the change
    larger again, because the old velocity is within the limit too.

    Parameters
    ----------
    forces : (n, 2) array, N
        Forces of the controllers.
    velocities : (n, 2) array, m/s
        Velocities before the substep.
    response : MotionResponse
        Response of the robots to forces.
    external : (n, 2) or (0, 2) array, N
        Further forces, to which no limits apply; empty if there are none.

    Returns
    -------
    (n, 2) array, N
        Force on each robot, constant during the substep.
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
