"""Unicycles: how a force on a point becomes the speeds of two wheels.

A controller's force says what a point robot would do: accelerate by a, within its limits and with viscosity.
A unicycle (a differential drive, its centre between its wheels) has a speed v >= 0 along its heading h and a
turning rate ω. In every substep it makes of that

- a turn towards the velocity v h + τ a that the point would have τ = 0.2 s later, and which is off by the
  angle e: ω* = e / τ, up to the turning rate, and never so fast that the wheels could not stop at e = 0;
- a speed by the acceleration along the heading, a·h. What of a is across the heading, and not had by turning
  at v ω, is braked instead: v* = v + dt (a·h - max(0, |a × h| - v ω)), and at least 0.

So it turns in place where the point would set out in another direction, and drives once it nearly faces it.
The wheels, v ∓ ω b / 2 with the track width b, go towards these speeds as far as `max_acceleration` allows.
Braking comes first there, then the turn; of `max_speed` the turn gets what it wants, the speed the rest. Such
heading control (ω by e, speed by the projection on the heading) is that of Aicardi, Casalino, Bicchi and
Balestrino (1995) and Astolfi (1999); taken from what is generally known of them, not from their texts.

What is guaranteed:

- Neither the wheels nor the turning rate exceed their limits; a unicycle does not become faster in a substep
  than the point would along its heading.
- Where the point would brake along the heading, the unicycle brakes as hard, at once and without a turn.
- There is no sideways slip, but in contact and in a hand: external forces carry a robot, which moves as a
  point then and keeps its heading; its wheels take the sideways part of its velocity when it is let go.

What is not: a point turns its velocity by up to max_acceleration / v, which when it is slow is more than the
turning rate; a unicycle brakes meanwhile, but it goes on ahead while it does. A law's proof that it touches
nothing, as of safety barrier certificates, is therefore one for points. That unicycles touch nothing either
is tested on maps, not proven.
"""

import math

import numpy as np

from robocov.arrays import Array, BoolArray
from robocov.compiled import inner_kernel, kernel
from robocov.world.engine import shortening

RESPONSE_TIME = 0.2  # s, tau
_FAINT = 0.005  # of max_acceleration: below it a robot that rests turns ever more slowly, as on noise


@inner_kernel
def within(value: float, most: float) -> float:
    """Return the value nearest to a value that is at most `most`, either way."""
    return min(max(value, -most), most)


@kernel
def steered(
    forces: Array,
    velocities: Array,
    steering: Array,
    answer: Array,
    body: Array,
    rolling: BoolArray,
    dt: float,
) -> tuple[Array, Array, Array]:
    """Return what makes unicycles drive: forces, their steering afterwards, and how robots answer to forces.

    Rows of robots that are not `rolling`, (n,), are as before. `steering`, (n, 2) rad and rad/s, is heading
    and turning rate; `answer`, (n, 5), is of `engine.response`; `body`, (n, 2) m and rad/s: track width and
    most turning rate. With the forces, (n, 2) N, a robot has the velocity along its new heading after `dt`
    seconds exactly, without viscosity and limits, which the wheels have kept.
    """
    forces, steering, answer = forces.copy(), steering.copy(), answer.copy()
    for i in range(len(forces)):
        if not rolling[i]:
            continue
        vx, vy, heading, turning = velocities[i, 0], velocities[i, 1], steering[i, 0], steering[i, 1]
        hx, hy, half = math.cos(heading), math.sin(heading), 0.5 * body[i, 0]
        speed = max(vx * hx + vy * hy, 0.0)  # the wheels grip: what was sideways is gone
        decay, drive, most, fastest = answer[i, 0], answer[i, 1], answer[i, 3], answer[i, 4]
        dx, dy = drive * forces[i, 0] - decay * speed * hx, drive * forces[i, 1] - decay * speed * hy
        scale = shortening(dx, dy, most)
        along, across = (dx * hx + dy * hy) * scale, (dy * hx - dx * hy) * scale
        # where the point heads for
        ahead, aside = speed + along * (RESPONSE_TIME / dt), across * (RESPONSE_TIME / dt)
        error = math.atan2(aside, ahead)
        faint = min(1.0, math.hypot(ahead, aside) / (_FAINT * most * (RESPONSE_TIME / dt)))
        rate = min(body[i, 1], fastest / half, abs(error) / RESPONSE_TIME * faint)
        rate = math.copysign(min(rate, math.sqrt(2.0 * most / (half * dt) * abs(error))), error)
        missed = max(abs(across) - speed * max(turning * math.copysign(1.0, error), 0.0) * dt, 0.0)
        wanted = min(max(speed + along - missed, 0.0), max(fastest - abs(rate) * half, 0.0))
        # the wheels have `most` for both: braking comes first, then the turn, then what makes it faster
        faster, wheel = within(wanted - speed, most), turning * half
        turned = wheel + within(rate * half - wheel, most - max(-faster, 0.0))
        if faster < 0.0:
            turned = within(turned, max(fastest - speed - faster, 0.0))
        else:
            faster = max(min(faster, most - abs(turned - wheel), fastest - abs(turned) - speed), 0.0)
        after, steering[i, 1] = speed + faster, turned / half
        heading += steering[i, 1] * dt
        steering[i, 0] = heading - 2.0 * math.pi * math.floor(heading / (2.0 * math.pi) + 0.5)
        answer[i, 0], answer[i, 1], answer[i, 3], answer[i, 4] = 0.0, 1.0 / answer[i, 2], np.inf, np.inf
        forces[i, 0] = (after * math.cos(steering[i, 0]) - vx) * answer[i, 2]
        forces[i, 1] = (after * math.sin(steering[i, 0]) - vy) * answer[i, 2]
    return forces, steering, answer


@kernel
def gripped(velocities: Array, steering: Array, room: Array, rolling: BoolArray) -> None:
    """After a contact leave of velocities, (n, 2) m/s, of who rolls what is forward, up to `room`, (n,)."""
    for i in range(len(velocities)):
        if rolling[i]:
            hx, hy = math.cos(steering[i, 0]), math.sin(steering[i, 0])
            speed = max(min(velocities[i, 0] * hx + velocities[i, 1] * hy, room[i]), 0.0)
            velocities[i, 0], velocities[i, 1] = speed * hx, speed * hy
