"""Unicycles: how the force on a point becomes the speeds of two wheels.

A controller's force says what a point robot would do: accelerate by a, within its limits and with viscosity.
A unicycle (a differential drive with its centre between its wheels) has a speed v >= 0 along its heading h
and a turning rate ω. In every substep it turns that acceleration into

- a turn towards the velocity v h + τ a that the point would have τ = 0.2 s later, which differs from the
  heading by the angle e: ω* = e / τ, up to the turning rate, and never so fast that the wheels could not stop
  at e = 0;
- a speed, from the acceleration along the heading, a·h. The part of a across the heading that turning at v ω
  does not provide is replaced by braking: v* = v + dt (a·h - max(0, |a × h| - v ω)), and at least 0.

So it turns in place where the point would set off in another direction, and drives once it nearly faces it.
The wheels, v ∓ ω b / 2 with the track width b, approach these speeds as fast as `max_acceleration` allows.
Braking comes first, then the turn; of `max_speed` the turn takes what it needs and the speed gets the rest.
Such heading control (ω from e, speed from the projection on the heading) is that of Aicardi, Casalino, Bicchi
and Balestrino (1995) and Astolfi (1999); taken from what is generally known of them, not from their texts.

What is guaranteed:

- Neither the wheels nor the turning rate exceed their limits; a unicycle gains no more speed in a substep
  than the point would along its heading.
- Where the point would brake along the heading, the unicycle brakes as hard, at once and without a turn.
- There is no sideways slip, except in contact and under external forces: those carry a robot, which then
  moves as a point and keeps its heading. When it is released, its wheels stop the sideways part of its
  velocity.

What is not guaranteed: a point turns its velocity by up to max_acceleration / v, which at low speed is more
than the turning rate; a unicycle brakes meanwhile, but it moves straight ahead while it does. A proof that a
controller avoids all contact, such as that of safety barrier certificates, is therefore one for points. For
unicycles it is tested on maps, not proven.
"""

import math
from typing import NamedTuple

import numpy as np

from robocov.arrays import Array, BoolArray, freeze
from robocov.compiled import kernel
from robocov.team import Team
from robocov.world.dynamics import MotionResponse, compute_clip_factor

RESPONSE_TIME_S = 0.2
"""τ, the time within which a unicycle faces the direction that it should take."""
_FAINT_FRACTION = 0.005
"""Fraction of the maximum acceleration below which a robot at rest turns ever more slowly, as under noise."""


class DriveCommand(NamedTuple):
    """What the wheels do in one substep.

    The forces give a unicycle its new velocity exactly, if it responds to them as `response` says: without
    viscosity and limits, which the wheels have already respected. Other robots are unchanged.
    """

    forces: Array
    """(n, 2) N."""
    steering: Array
    """(n, 2) rad and rad/s: heading and turning rate after the substep."""
    response: MotionResponse


def initialize_steering(team: Team, velocities: Array, steering: Array | None) -> Array | None:
    """Return the steering of a team at the start of a simulation.

    Parameters
    ----------
    team : Team
    velocities : (n, 2) array, m/s
    steering : (n, 2) array or None, rad and rad/s
        Heading, from +x, and turning rate. By default robots face the direction in which they move, without
        turning.

    Returns
    -------
    (n, 2) array or None, rad and rad/s
        Read-only; None for a team without unicycles.
    """
    if not team.is_unicycle.any():
        return None
    if steering is None:
        # atan2 from math, not numpy: its results are the same on every processor.
        steering = np.array([(math.atan2(vy, vx), 0.0) for vx, vy in velocities.tolist()])
    return freeze(steering)


@kernel
def clip_magnitude(value: float, limit: float) -> float:
    """Return the value nearest to `value` that lies in [-limit, limit]."""
    return min(max(value, -limit), limit)


@kernel
def compute_drive_command(
    forces: Array,
    velocities: Array,
    steering: Array,
    response: MotionResponse,
    track_width: Array,
    max_turning_rate: Array,
    rolls: BoolArray,
    dt: float,
) -> DriveCommand:
    """Turn the controllers' forces into the motion of wheels, as the module's docstring explains.

    Parameters
    ----------
    forces : (n, 2) array, N
    velocities : (n, 2) array, m/s
    steering : (n, 2) array, rad and rad/s
        Heading and turning rate before the substep.
    response : MotionResponse
        How points respond to forces.
    track_width : (n,) array, m
    max_turning_rate : (n,) array, rad/s
    rolls : (n,) bool array
        Which robots are unicycles on their own wheels. The others keep their rows.
    dt : float, s

    Returns
    -------
    DriveCommand
    """
    new_forces = forces.copy()
    new_steering = steering.copy()
    velocity_loss = response.velocity_loss.copy()
    velocity_per_force = response.velocity_per_force.copy()
    max_velocity_change = response.max_velocity_change.copy()
    max_speed = response.max_speed.copy()
    for i in range(len(forces)):
        if not rolls[i]:
            continue
        vx = velocities[i, 0]
        vy = velocities[i, 1]
        heading = steering[i, 0]
        turning_rate = steering[i, 1]
        half_track = 0.5 * track_width[i]
        hx = math.cos(heading)
        hy = math.sin(heading)
        speed = max(vx * hx + vy * hy, 0.0)  # The wheels grip: nothing sideways remains.

        # The change of velocity of a point robot, along the heading and across it.
        loss = response.velocity_loss[i]
        gain = response.velocity_per_force[i]
        max_change = response.max_velocity_change[i]
        dx = gain * forces[i, 0] - loss * speed * hx
        dy = gain * forces[i, 1] - loss * speed * hy
        scale = compute_clip_factor(dx, dy, max_change)
        along = (dx * hx + dy * hy) * scale
        across = (dy * hx - dx * hy) * scale

        # The turning rate towards the velocity that the point would have after the response time.
        ahead = speed + along * (RESPONSE_TIME_S / dt)
        aside = across * (RESPONSE_TIME_S / dt)
        error = math.atan2(aside, ahead)
        faint_speed = _FAINT_FRACTION * max_change * (RESPONSE_TIME_S / dt)
        damping = min(1.0, math.hypot(ahead, aside) / faint_speed)
        rate = min(
            max_turning_rate[i], response.max_speed[i] / half_track, abs(error) / RESPONSE_TIME_S * damping
        )
        stopping_rate = math.sqrt(2.0 * max_change / (half_track * dt) * abs(error))
        rate = math.copysign(min(rate, stopping_rate), error)

        # The speed; what turning does not provide of the acceleration across the heading is braked.
        turning_part = speed * max(turning_rate * math.copysign(1.0, error), 0.0) * dt
        missing = max(abs(across) - turning_part, 0.0)
        max_forward_speed = max(response.max_speed[i] - abs(rate) * half_track, 0.0)
        target_speed = min(max(speed + along - missing, 0.0), max_forward_speed)

        # The wheels share `max_change`: braking comes first, then the turn, then speeding up.
        speed_change = clip_magnitude(target_speed - speed, max_change)
        wheel = turning_rate * half_track
        turn_allowance = max_change - max(-speed_change, 0.0)
        new_wheel = wheel + clip_magnitude(rate * half_track - wheel, turn_allowance)
        if speed_change < 0.0:
            new_wheel = clip_magnitude(new_wheel, max(response.max_speed[i] - speed - speed_change, 0.0))
        else:
            change_left = max_change - abs(new_wheel - wheel)
            speed_left = response.max_speed[i] - abs(new_wheel) - speed
            speed_change = max(min(speed_change, change_left, speed_left), 0.0)

        new_speed = speed + speed_change
        new_steering[i, 1] = new_wheel / half_track
        heading += new_steering[i, 1] * dt
        new_steering[i, 0] = heading - 2.0 * math.pi * math.floor(heading / (2.0 * math.pi) + 0.5)
        velocity_loss[i] = 0.0
        velocity_per_force[i] = 1.0 / response.force_per_velocity[i]
        max_velocity_change[i] = np.inf
        max_speed[i] = np.inf
        force_per_velocity = response.force_per_velocity[i]
        new_forces[i, 0] = (new_speed * math.cos(new_steering[i, 0]) - vx) * force_per_velocity
        new_forces[i, 1] = (new_speed * math.sin(new_steering[i, 0]) - vy) * force_per_velocity
    new_response = MotionResponse(
        velocity_loss, velocity_per_force, response.force_per_velocity, max_velocity_change, max_speed
    )
    return DriveCommand(new_forces, new_steering, new_response)


@kernel
def remove_sideways_velocity(velocities: Array, steering: Array, max_speed: Array, rolls: BoolArray) -> Array:
    """Return the velocities that remain of unicycles after a contact: forward, and up to a limit.

    Parameters
    ----------
    velocities : (n, 2) array, m/s
    steering : (n, 2) array, rad and rad/s
    max_speed : (n,) array, m/s
        Largest forward speed.
    rolls : (n,) bool array
        Which robots are unicycles on their own wheels. The others keep their velocity.

    Returns
    -------
    (n, 2) array, m/s
    """
    gripped = velocities.copy()
    for i in range(len(velocities)):
        if rolls[i]:
            hx = math.cos(steering[i, 0])
            hy = math.sin(steering[i, 0])
            forward = velocities[i, 0] * hx + velocities[i, 1] * hy
            speed = max(min(forward, max_speed[i]), 0.0)
            gripped[i, 0] = speed * hx
            gripped[i, 1] = speed * hy
    return gripped
