"""Unicycles: wheel speeds that make a two-wheeled robot follow the force that acts on a point robot.

The force of a controller gives the acceleration a of a point robot, with viscosity and within its limits. A
unicycle is a differential drive with its center between its wheels. It has a speed v >= 0 along its heading h
and a turning rate ω. In every substep, the acceleration of the point determines a target of the unicycle's
motion:

- The turning rate. The point would have the velocity v h + τ a after the response time τ = 0.2 s. The
  unicycle turns toward this velocity, which differs from the heading by the angle e: ω* = e / τ, limited by
  the maximum turning rate, and by the rate from which the wheels can still stop at e = 0.
- The speed. It changes by the acceleration along the heading, a·h. Across the heading, turning provides only
  the acceleration v ω. If the point would accelerate more, the unicycle brakes by the difference:
  v* = v + dt (a·h - max(0, |a × h| - v ω)), but at least 0.

The unicycle thus turns in place if the point would start in another direction, and drives once it nearly
faces this direction. The speeds of the wheels are v ∓ ω b / 2, where b is the track width. They approach the
target as fast as `max_acceleration` allows: braking has priority over turning, and turning over speeding up.
If the target exceeds `max_speed`, turning has priority over driving.

Such heading control, with ω from e and the speed from the projection on the heading, is commonly attributed
to Aicardi, Casalino, Bicchi and Balestrino (1995) and Astolfi (1999). Their texts were not consulted.

Guarantees:

- Neither the wheels nor the turning rate exceed their limits. In a substep, a unicycle gains no more speed
  than the point would along the heading.
- If the point would brake along the heading, the unicycle brakes just as hard at once: braking has priority
  over turning.
- There is no sideways slip, except in contact and under external forces. Under an external force, a unicycle
  moves as a point and keeps its heading. When the force ends, the wheels stop the sideways part of its
  velocity.

Unicycles may come into contact where points would not. A point turns its velocity by up to max_acceleration /
v, which at low speed is more than the maximum turning rate. A unicycle brakes instead, but meanwhile it moves
straight ahead. A proof that a controller avoids all contact, as for safety barrier certificates, therefore
holds only for points. For unicycles, it is tested on maps, not proven.
"""

import math
from typing import NamedTuple

import numpy as np

from robocov.arrays import copy_read_only
from robocov.compiled import kernel
from robocov.team import Team
from robocov.typing import BoolArray, FloatArray
from robocov.world.dynamics import MotionResponse, compute_clip_factor

RESPONSE_TIME_S = 0.2
"""Response time τ, within which a unicycle turns to the direction in which it should move."""
_DAMPING_FRACTION = 0.005
"""Fraction of the maximum acceleration below which turning is damped, so that noise does not turn a robot at
rest."""


class Wheels(NamedTuple):
    """The wheels of a team, (n,) each."""

    track_width: FloatArray
    """Distance between the wheels of each robot, m."""
    max_turning_rate: FloatArray
    """Maximum turning rate of each robot, rad/s."""
    is_rolling: BoolArray
    """Whether wheels move each robot. The other robots are points, or are moved by external forces."""


class DriveCommand(NamedTuple):
    """Motion of the wheels in one substep.

    Under `forces` and `response`, each unicycle that its wheels move gets exactly its new velocity. Its
    response has no viscosity or limits, because the motion of the wheels already accounts for these. The rows
    of other robots are unchanged.
    """

    forces: FloatArray
    """(n, 2) N, in place of the forces of the controllers."""
    steering: FloatArray
    """(n, 2) rad and rad/s, heading and turning rate after the substep."""
    response: MotionResponse
    """Response of the robots to these forces."""


def initialize_steering(team: Team, velocities: FloatArray, steering: FloatArray | None) -> FloatArray | None:
    """Return the steering of a team at the start of a simulation.

    Parameters
    ----------
    team : Team
        The n robots.
    velocities : (n, 2) array, m/s
        Velocities of the robots.
    steering : (n, 2) array or None, rad and rad/s
        Heading, from +x, and turning rate. By default, robots face the direction in which they move, and do
        not turn.

    Returns
    -------
    (n, 2) array or None, rad and rad/s
        Heading and turning rate, read-only. None for a team without unicycles.
    """
    if not team.is_unicycle.any():
        return None
    if steering is None:
        # `math.atan2` is used, because its results are the same on every processor, unlike those of numpy.
        steering = np.array([(math.atan2(vy, vx), 0.0) for vx, vy in velocities.tolist()])
    return copy_read_only(steering)


@kernel
def clip_magnitude(value: float, limit: float) -> float:
    """Clip a value to a maximum magnitude.

    Parameters
    ----------
    value : float
        Value to clip.
    limit : float
        Maximum magnitude, at least 0.

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
    """Turning rate, rad/s, positive for a turn to the left."""


class _WheelLimits(NamedTuple):
    """Limits of one unicycle in one substep."""

    half_track: float
    """Distance of each wheel from the center, m."""
    max_speed: float
    """Maximum speed of a wheel, m/s."""
    max_change: float
    """Maximum change of the speed of a wheel, m/s."""
    max_turning_rate: float
    """Maximum turning rate, rad/s."""


@kernel
def compute_drive_command(
    forces: FloatArray,
    velocities: FloatArray,
    steering: FloatArray,
    response: MotionResponse,
    wheels: Wheels,
    dt: float,
) -> DriveCommand:
    """Compute the motion of the wheels from the forces of controllers, as the module's docstring explains.

    Parameters
    ----------
    forces : (n, 2) array, N
        Forces of the controllers.
    velocities : (n, 2) array, m/s
        Velocities before the substep.
    steering : (n, 2) array, rad and rad/s
        Heading and turning rate before the substep.
    response : MotionResponse
        Response of point robots to forces.
    wheels : Wheels
        Wheels of the robots. The rows of robots that are not rolling are copied unchanged.
    dt : float, s
        Duration of the substep.

    Returns
    -------
    DriveCommand
        Forces, steering and response in place of those of points.
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
        # The wheels do not slip, so that no sideways velocity remains.
        motion = _Motion(max(vx * hx + vy * hy, 0.0), steering[i, 1])
        limits = _get_wheel_limits(wheels, response, i)
        forward_change, sideways_change = _compute_point_change(forces, response, i, motion.speed, hx, hy)
        target = _choose_motion(motion, forward_change, sideways_change, limits, dt)
        motion = _approach_motion(motion, target, limits)
        new_heading = _wrap_angle(heading + motion.turning_rate * dt)
        new_steering[i, 0] = new_heading
        new_steering[i, 1] = motion.turning_rate
        # The force that gives the robot exactly this motion, under a response without viscosity or limits.
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
    forces: FloatArray, response: MotionResponse, i: int, speed: float, hx: float, hy: float
) -> tuple[float, float]:
    """Return the change of velocity in a substep, m/s, of a point robot in place of robot i.

    The point has the given speed in the direction (hx, hy) of the heading. The first component of the change
    is along the heading, the second one to the left of the heading.
    """
    loss = response.velocity_loss[i]
    gain = response.velocity_per_force[i]
    dx = gain * forces[i, 0] - loss * speed * hx
    dy = gain * forces[i, 1] - loss * speed * hy
    scale = compute_clip_factor(dx, dy, response.max_velocity_change[i])
    return (dx * hx + dy * hy) * scale, (dy * hx - dx * hy) * scale


@kernel
def _wrap_angle(angle: float) -> float:
    """Return the equivalent angle in the interval from -π to π."""
    return angle - 2.0 * math.pi * math.floor(angle / (2.0 * math.pi) + 0.5)


@kernel
def _choose_motion(
    motion: _Motion, forward_change: float, sideways_change: float, limits: _WheelLimits, dt: float
) -> _Motion:
    """Choose the target speed and turning rate, which the wheels should approach.

    A point robot would change its velocity in this substep by `forward_change` along the heading and by
    `sideways_change` to the left of the heading, m/s. The unicycle turns toward the velocity that the point
    would have after the response time. Turning while driving also changes the velocity sideways. If this
    change is less than that of the point, the unicycle brakes by the difference.
    """
    response_substeps = RESPONSE_TIME_S / dt
    future_forward = motion.speed + forward_change * response_substeps
    future_sideways = sideways_change * response_substeps
    angle_error = math.atan2(future_sideways, future_forward)
    # Turning is damped if the point would be slower than this speed after the response time.
    damping_speed = _DAMPING_FRACTION * limits.max_change * response_substeps
    damping = min(1.0, math.hypot(future_forward, future_sideways) / damping_speed)
    turning_rate = _choose_turning_rate(angle_error, damping, limits, dt)

    # The current turning rate toward the target; 0 if the robot turns away from the target.
    turning_rate_to_target = max(motion.turning_rate * math.copysign(1.0, angle_error), 0.0)
    change_by_turning = motion.speed * turning_rate_to_target * dt
    braking = max(abs(sideways_change) - change_by_turning, 0.0)
    max_forward_speed = max(limits.max_speed - abs(turning_rate) * limits.half_track, 0.0)
    speed = min(max(motion.speed + forward_change - braking, 0.0), max_forward_speed)
    return _Motion(speed, turning_rate)


@kernel
def _choose_turning_rate(angle_error: float, damping: float, limits: _WheelLimits, dt: float) -> float:
    """Choose the target rate, rad/s, of a turn by an angle, within the limits and able to stop in time."""
    turning_rate = min(
        limits.max_turning_rate,
        limits.max_speed / limits.half_track,
        abs(angle_error) / RESPONSE_TIME_S * damping,
    )
    # A rate ω decreases to 0 within the angle ω² / (2 α), where α is the maximum angular deceleration.
    stopping_rate = math.sqrt(2.0 * limits.max_change / (limits.half_track * dt) * abs(angle_error))
    return math.copysign(min(turning_rate, stopping_rate), angle_error)


@kernel
def _approach_motion(motion: _Motion, target: _Motion, limits: _WheelLimits) -> _Motion:
    """Return the motion after a substep in which the wheels approach the target within their limits.

    The speed of a wheel is the speed of the robot's center plus or minus the turning speed. The changes of
    these two speeds therefore share the maximum change of a wheel's speed: braking takes its share first,
    then the turn, then speeding up. The two speeds share the maximum speed of a wheel in the same way.
    """
    speed_change = clip_magnitude(target.speed - motion.speed, limits.max_change)
    # The turning speed is the speed of the right wheel relative to the center of the robot, m/s.
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
        # The turn has taken its share. Speeding up gets the remainder.
        max_increase_by_acceleration = limits.max_change - abs(new_turning_speed - turning_speed)
        max_increase_by_speed = limits.max_speed - abs(new_turning_speed) - motion.speed
        speed_change = max(min(speed_change, max_increase_by_acceleration, max_increase_by_speed), 0.0)
    return _Motion(motion.speed + speed_change, new_turning_speed / limits.half_track)


@kernel
def remove_sideways_velocity(
    velocities: FloatArray, steering: FloatArray, max_speed: FloatArray, is_rolling: BoolArray
) -> FloatArray:
    """Remove from unicycles the velocity after a contact that their wheels do not allow.

    A unicycle keeps its forward velocity, up to its maximum speed. Sideways and backward velocity is removed.

    Parameters
    ----------
    velocities : (n, 2) array, m/s
        Velocities after a contact.
    steering : (n, 2) array, rad and rad/s
        Heading and turning rate.
    max_speed : (n,) array, m/s
        Maximum forward speed.
    is_rolling : (n,) bool array
        Whether each robot is moved by wheels. All other robots keep their velocity.

    Returns
    -------
    (n, 2) array, m/s
        Velocities. For robots moved by wheels, they are along the heading, and at most `max_speed`.
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
