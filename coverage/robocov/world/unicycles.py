"""Unicycles: wheel speeds that make a two-wheeled robot follow the force that acts on a point robot.

A controller's force gives the acceleration a of a point robot, within its limits and with viscosity.
A unicycle (a differential drive with its center between its wheels) has a speed v >= 0 along its heading h
and a turning rate ω. In every substep it turns that acceleration into

- a turn toward the velocity v h + τ a that the point would have τ = 0.2 s later, which differs from the
  heading by the angle e: ω* = e / τ, up to the turning rate, and never so fast that the wheels could not stop
  at e = 0;
- a speed, from the acceleration along the heading, a·h. The part of a across the heading that turning at v ω
  does not provide is replaced by braking: v* = v + dt (a·h - max(0, |a × h| - v ω)), and at least 0.

So it turns in place if the point would move off in another direction, and drives once it nearly faces that
way. The wheels, v ∓ ω b / 2 with the track width b, approach these speeds as fast as `max_acceleration`
allows. Braking comes first, then the turn, then speeding up; the turn takes its share of `max_speed` first.
Such heading control (ω from e, speed from the projection on the heading) is that of Aicardi, Casalino, Bicchi
and Balestrino (1995) and Astolfi (1999), as it is commonly described; their texts were not consulted.

Guarantees:

- Neither the wheels nor the turning rate exceed their limits; a unicycle gains no more speed in a substep
  than the point would along its heading.
- If the point would brake along the heading, the unicycle brakes just as hard, at once and without turning.
- There is no sideways slip, except in contact and under external forces: those carry a robot, which then
  moves as a point and keeps its heading. When it is released, its wheels stop the sideways part of its
  velocity.

Unicycles may come into contact where points would not. A point turns its velocity by up to
max_acceleration / v, which at low speed is more than the turning rate; a unicycle brakes instead, but keeps
moving straight ahead meanwhile. A proof that a controller avoids all contact, such as that of safety barrier
certificates, therefore holds only for points. For unicycles it is tested on maps, not proven.
"""

import math
from typing import NamedTuple

import numpy as np

from robocov.arrays import Array, BoolArray, freeze
from robocov.compiled import kernel
from robocov.team import Team
from robocov.world.dynamics import MotionResponse, compute_clip_factor

RESPONSE_TIME_S = 0.2
"""τ, the time within which a unicycle turns to the direction in which it should move."""
_DAMPING_FRACTION = 0.005
"""Fraction of the maximum acceleration below which turning is damped, so that noise does not turn a robot at
rest."""


class Wheels(NamedTuple):
    """The wheels of a team; each (n,)."""

    track_width: Array
    """m."""
    max_turning_rate: Array
    """rad/s."""
    is_rolling: BoolArray
    """Mask of the unicycles that their wheels move. The others are points, or external forces carry them."""


class DriveCommand(NamedTuple):
    """Motion of the wheels in one substep.

    With `response`, the forces give a unicycle exactly its new velocity: viscosity and limits are left out of
    it, as the wheels have already respected them. The rows of other robots are unchanged.
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
    """Clip a value to a magnitude.

    Parameters
    ----------
    value, limit : float

    Returns
    -------
    float
        The nearest value in [-limit, limit].
    """
    return min(max(value, -limit), limit)


class _Motion(NamedTuple):
    """Motion of one unicycle."""

    speed: float
    """Speed along the heading, m/s, at least 0."""
    turning_rate: float
    """rad/s."""


class _WheelLimits(NamedTuple):
    """Limits of one unicycle in one substep."""

    half_track: float
    """Distance of each wheel from the center, m."""
    max_speed: float
    """Maximum speed of a wheel, m/s."""
    max_change: float
    """Maximum change of the speed of a wheel, m/s."""
    max_turning_rate: float
    """rad/s."""


@kernel
def compute_drive_command(
    forces: Array,
    velocities: Array,
    steering: Array,
    response: MotionResponse,
    wheels: Wheels,
    dt: float,
) -> DriveCommand:
    """Convert the controllers' forces into wheel motion, as explained at the top of this module.

    Parameters
    ----------
    forces : (n, 2) array, N
    velocities : (n, 2) array, m/s
    steering : (n, 2) array, rad and rad/s
        Heading and turning rate before the substep.
    response : MotionResponse
        Response of points to forces.
    wheels : Wheels
        The rows of robots that are not rolling are copied unchanged.
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
        if not wheels.is_rolling[i]:
            continue
        vx = velocities[i, 0]
        vy = velocities[i, 1]
        heading = steering[i, 0]
        hx = math.cos(heading)
        hy = math.sin(heading)
        # The wheels grip, so no sideways velocity remains.
        motion = _Motion(max(vx * hx + vy * hy, 0.0), steering[i, 1])
        limits = _get_wheel_limits(wheels, response, i)
        forward_change, sideways_change = _compute_point_change(forces, response, i, motion.speed, hx, hy)
        target = _choose_motion(motion, forward_change, sideways_change, limits, dt)
        motion = _approach_motion(motion, target, limits)
        new_heading = _wrap_angle(heading + motion.turning_rate * dt)
        new_steering[i, 0] = new_heading
        new_steering[i, 1] = motion.turning_rate
        # The force that gives the robot exactly this motion, and the response without viscosity or limits.
        force_per_velocity = response.force_per_velocity[i]
        new_forces[i, 0] = (motion.speed * math.cos(new_heading) - vx) * force_per_velocity
        new_forces[i, 1] = (motion.speed * math.sin(new_heading) - vy) * force_per_velocity
        velocity_loss[i] = 0.0
        velocity_per_force[i] = 1.0 / force_per_velocity
        max_velocity_change[i] = np.inf
        max_speed[i] = np.inf
    new_response = MotionResponse(
        velocity_loss=velocity_loss,
        velocity_per_force=velocity_per_force,
        force_per_velocity=response.force_per_velocity,
        max_velocity_change=max_velocity_change,
        max_speed=max_speed,
    )
    return DriveCommand(new_forces, new_steering, new_response)


@kernel
def _get_wheel_limits(wheels: Wheels, response: MotionResponse, i: int) -> _WheelLimits:
    """Return the limits of unicycle i."""
    return _WheelLimits(
        half_track=0.5 * wheels.track_width[i],
        max_speed=response.max_speed[i],
        max_change=response.max_velocity_change[i],
        max_turning_rate=wheels.max_turning_rate[i],
    )


@kernel
def _compute_point_change(
    forces: Array, response: MotionResponse, i: int, speed: float, hx: float, hy: float
) -> tuple[float, float]:
    """Return the change of velocity of a point robot in place of robot i, m/s.

    The robot has the given speed in the direction (hx, hy) of its heading. The first component of the change
    is along the heading, the second one to the left of it.
    """
    loss = response.velocity_loss[i]
    gain = response.velocity_per_force[i]
    dx = gain * forces[i, 0] - loss * speed * hx
    dy = gain * forces[i, 1] - loss * speed * hy
    scale = compute_clip_factor(dx, dy, response.max_velocity_change[i])
    return (dx * hx + dy * hy) * scale, (dy * hx - dx * hy) * scale


@kernel
def _wrap_angle(angle: float) -> float:
    """Return the angle from -π up to π with the same direction."""
    return angle - 2.0 * math.pi * math.floor(angle / (2.0 * math.pi) + 0.5)


@kernel
def _choose_motion(
    motion: _Motion, forward_change: float, sideways_change: float, limits: _WheelLimits, dt: float
) -> _Motion:
    """Choose the speed and the turning rate that the wheels should approach.

    A point robot would change its velocity in this substep by `forward_change` along the heading and by
    `sideways_change` to the left of it, m/s. The unicycle turns toward the velocity that the point would have
    after the response time. Turning at a speed also changes the velocity sideways. If that change is less
    than the one of the point, the unicycle brakes by the difference.
    """
    response_substeps = RESPONSE_TIME_S / dt
    future_forward = motion.speed + forward_change * response_substeps
    future_sideways = sideways_change * response_substeps
    angle_error = math.atan2(future_sideways, future_forward)
    # Turning is damped if the point would be slower than this after the response time.
    damping_speed = _DAMPING_FRACTION * limits.max_change * response_substeps
    damping = min(1.0, math.hypot(future_forward, future_sideways) / damping_speed)
    turning_rate = _choose_turning_rate(angle_error, damping, limits, dt)

    # The current turning rate, if the turn is toward the target.
    turning_rate_to_target = max(motion.turning_rate * math.copysign(1.0, angle_error), 0.0)
    change_by_turning = motion.speed * turning_rate_to_target * dt
    braking = max(abs(sideways_change) - change_by_turning, 0.0)
    max_forward_speed = max(limits.max_speed - abs(turning_rate) * limits.half_track, 0.0)
    speed = min(max(motion.speed + forward_change - braking, 0.0), max_forward_speed)
    return _Motion(speed, turning_rate)


@kernel
def _choose_turning_rate(angle_error: float, damping: float, limits: _WheelLimits, dt: float) -> float:
    """Choose the rate of a turn by an angle, rad, within the limits and such that it can stop at its end."""
    turning_rate = min(
        limits.max_turning_rate,
        limits.max_speed / limits.half_track,
        abs(angle_error) / RESPONSE_TIME_S * damping,
    )
    # With the wheels' deceleration, this rate decreases to 0 within the angle.
    stopping_rate = math.sqrt(2.0 * limits.max_change / (limits.half_track * dt) * abs(angle_error))
    return math.copysign(min(turning_rate, stopping_rate), angle_error)


@kernel
def _approach_motion(motion: _Motion, target: _Motion, limits: _WheelLimits) -> _Motion:
    """Return the motion after a substep in which the wheels approach the target within their limits.

    The wheels run at the speed of the robot's center plus and minus its turning speed. The changes of these
    two speeds therefore share the maximum change of a wheel's speed: braking takes its share first, then the
    turn, then speeding up. The two speeds share the maximum speed of a wheel in the same way.
    """
    speed_change = clip_magnitude(target.speed - motion.speed, limits.max_change)
    # The turning speed is that of the right wheel relative to the center of the robot, m/s.
    turning_speed = motion.turning_rate * limits.half_track
    target_turning_speed = target.turning_rate * limits.half_track
    braking = max(-speed_change, 0.0)
    max_turning_change = limits.max_change - braking
    turning_change = clip_magnitude(target_turning_speed - turning_speed, max_turning_change)
    new_turning_speed = turning_speed + turning_change
    if speed_change < 0.0:
        max_turning_speed = max(limits.max_speed - motion.speed - speed_change, 0.0)
        new_turning_speed = clip_magnitude(new_turning_speed, max_turning_speed)
    else:
        # The turn has taken its share; speeding up gets the remainder.
        max_increase_by_acceleration = limits.max_change - abs(new_turning_speed - turning_speed)
        max_increase_by_speed = limits.max_speed - abs(new_turning_speed) - motion.speed
        speed_change = max(min(speed_change, max_increase_by_acceleration, max_increase_by_speed), 0.0)
    return _Motion(motion.speed + speed_change, new_turning_speed / limits.half_track)


@kernel
def remove_sideways_velocity(
    velocities: Array, steering: Array, max_speed: Array, is_rolling: BoolArray
) -> Array:
    """Remove the velocity that a contact has caused but the wheels of unicycles do not allow.

    Parameters
    ----------
    velocities : (n, 2) array, m/s
    steering : (n, 2) array, rad and rad/s
    max_speed : (n,) array, m/s
        Largest forward speed.
    is_rolling : (n,) bool array
        Mask of the unicycles that their wheels move. All other robots keep their velocity.

    Returns
    -------
    (n, 2) array, m/s
        Along the heading and at most `max_speed` for these unicycles.
    """
    remaining = velocities.copy()
    for i in range(len(velocities)):
        if is_rolling[i]:
            hx = math.cos(steering[i, 0])
            hy = math.sin(steering[i, 0])
            forward = velocities[i, 0] * hx + velocities[i, 1] * hy
            speed = max(min(forward, max_speed[i]), 0.0)
            remaining[i, 0] = speed * hx
            remaining[i, 1] = speed * hy
    return remaining
