"""Position estimates under noise and late messages: dead reckoning, and alpha-beta trackers of others."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from robocov.arrays import Array, IntArray
from robocov.compiled import kernel
from robocov.observation import Observations
from robocov.team import Team

_MEMORY = 2.0  # s, over which fixes are averaged
_OUTLIER = 6.0  # standard deviations by which a fix is off where the robot was carried away
_SETTLED = 10  # fixes from which on their noise is known
_LEAST = 1e-9  # m, of a standard deviation
_MANOEUVRE = 0.5  # part of the acceleration that others are taken to change their velocity with
_HORIZON = 1.5  # s, for which others are taken to go on as they did
_DOUBT = 1.0  # standard deviations of a fix by which others may be nearer than estimated,
_DRIFT = 1.0  # and metres for each second since they told where they are


class Estimates(NamedTuple):
    """Filter states of n robots: of its own position, and of each other robot that it has heard of."""

    time: float  # s
    own: Array  # (n, 2) m, the estimate of each robot,
    velocities: Array  # (n, 2) m/s, and its velocity,
    fixes: Array  # (n,), by how many fixes,
    variance: Array  # (n,) m², of one of them in x or y
    sent: Array  # (n, n) s, when the newest message was sent that row's robot has of column's, nan for none,
    messages: IntArray  # (n, n), how many there were,
    at: Array  # (n, n, 2) m, and the filtered position
    going: Array  # (n, n, 2) m/s, and velocity then

    @classmethod
    def nothing(cls, n: int) -> Estimates:
        """Return the state before the first observation."""
        none, pairs = np.zeros((n, 2)), np.zeros((n, n, 2))
        never, zero = np.full((n, n), np.nan), np.zeros((n, n), dtype=np.intp)
        return cls(0.0, none, none, np.zeros(n), np.zeros(n), never, zero, pairs, pairs)


def localized(seen: Observations, before: Estimates, team: Team) -> tuple[Observations, Estimates]:
    """Return the observations with estimated positions, and the filter states after them.

    A robot integrates its own velocity and averages what fixes differ from that over `_MEMORY` seconds.
    Others are tracked by their messages with the steady-state gains of Kalata (1984, *The tracking index*),
    larger ones for the first messages; the noise of a message is that of the robot's own fixes. They are
    taken to go on as they did for at most `_HORIZON` seconds since their last message.
    """
    dt = seen.time - before.time
    predicted = before.own + 0.5 * dt * (before.velocities + seen.velocities)
    off = ((seen.positions - predicted) ** 2).sum(axis=1)
    gate = 2.0 * _OUTLIER**2 * before.variance + (team.max_speed * dt) ** 2
    carried = (off > gate) & (before.fixes >= _SETTLED)
    fixes = np.where(carried, 1.0, before.fixes + 1.0)
    gain = np.maximum(1.0 / fixes, min(dt / _MEMORY, 1.0))
    # the residual of a mean of k - 1 fixes is larger than one fix's error
    square = 0.5 * off * (1.0 - 1.0 / np.maximum(fixes, 1.0))
    rate = np.maximum(1.0 / np.maximum(fixes - 1.0, 1.0), gain)
    variance = np.where(carried, before.variance, before.variance + rate * (square - before.variance))
    own = predicted + gain[:, None] * (seen.positions - predicted)
    points = seen.obstacle_points - seen.positions + own
    assert seen.reported_positions is not None and seen.report_ages is not None
    robot, other = seen.neighbours.list_pairs()
    sigma, change = np.sqrt(variance), _MANOEUVRE * team.max_acceleration
    when, known = seen.time - seen.report_ages, (before.sent, before.messages, before.at, before.going)
    told = seen.reported_positions
    tracks = _tracked(robot, other, told, when, sigma, change, team.max_speed, *known)
    after = Estimates(seen.time, own, seen.velocities, fixes, variance, *tracks)
    ages = np.clip(seen.time - after.sent[robot, other], 0.0, _HORIZON)
    places = after.at[robot, other] + ages[:, None] * after.going[robot, other]
    return replace(seen, positions=own, obstacle_points=points, reported_positions=places), after


def wary(seen: Observations, estimates: Estimates) -> Observations:
    """Return the observations with others as near as they may be, for keeping apart from them."""
    assert seen.reported_positions is not None
    robot, other = seen.neighbours.list_pairs()
    offset = seen.reported_positions - seen.positions[robot]
    distance = np.sqrt((offset**2).sum(axis=1))
    ages = np.clip(seen.time - estimates.sent[robot, other], 0.0, _HORIZON)
    doubt = np.minimum(_DOUBT * np.sqrt(estimates.variance[robot]) + _DRIFT * ages, 0.75 * distance)
    nearer = 1.0 - doubt / np.maximum(distance, _LEAST)
    places = seen.positions[robot] + nearer[:, None] * offset
    return replace(seen, reported_positions=places)


@kernel
def _tracked(
    robot: IntArray, other: IntArray, told: Array, when: Array, sigma: Array, change: Array, speed: Array,
    sent: Array, count: IntArray, at: Array, going: Array,
) -> tuple[Array, IntArray, Array, Array]:  # fmt: skip
    """Return the trackers of others after their messages: when, which, positions, velocities."""
    sent, count, at, going = sent.copy(), count.copy(), at.copy(), going.copy()
    heard = np.zeros(sent.shape, np.bool_)
    for m in range(len(robot)):
        i, j = robot[m], other[m]
        heard[i, j] = True
        # sums of steps miss a little
        if count[i, j] and not when[m] > sent[i, j] + 1e-6:
            continue
        if count[i, j] == 0:
            going[i, j, 0] = going[i, j, 1] = 0.0
            at[i, j, 0], at[i, j, 1] = told[m, 0], told[m, 1]
        else:
            since, k = when[m] - sent[i, j], count[i, j] + 1.0
            index = change[i] * since * since / max(sigma[i], 1e-9)
            root = (4.0 + index - math.sqrt(8.0 * index + index * index)) / 4.0
            alpha = max(1.0 - root * root, 2.0 * (2.0 * k - 1.0) / (k * (k + 1.0)))
            beta = min(max(2.0 * (1.0 - root) ** 2, 6.0 / (k * (k + 1.0))), 1.0)
            for c in range(2):
                expected = at[i, j, c] + since * going[i, j, c]
                off = told[m, c] - expected
                at[i, j, c] = expected + alpha * off
                going[i, j, c] += beta * off / since
            fast = math.sqrt(going[i, j, 0] ** 2 + going[i, j, 1] ** 2)
            if fast > speed[i]:
                going[i, j, 0] *= speed[i] / fast
                going[i, j, 1] *= speed[i] / fast
        sent[i, j] = when[m]
        count[i, j] += 1
    for i in range(len(sent)):
        for j in range(len(sent)):
            if not heard[i, j]:
                count[i, j] = 0
    return sent, count, at, going
