"""From a wanted velocity to one that is safe: braking before walls and other robots.

A robot that is `gap` metres off something that does not move may approach it with at most
``sqrt(2 b gap)``: it then stops before it with the deceleration b. Two robots share the gap between them.
The velocity is the wanted one, corrected along the directions to what is too close (the correction is
the projection onto the half-plane of velocities that are allowed, for the most violated one first). Where
corrections contradict each other, as between a wall and a robot, it is slowed down until all is allowed.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from robocov.arrays import Array, IntArray

BRAKING = 0.8
"""Deceleration that is counted on, m/s²: less than half of the usual limit, for the lag of the drive."""

MARGIN = 0.02
"""Gap that is left to walls, m."""

APART = 0.04
"""Gap that is left to other robots, m."""

CREEP = 0.15
"""Speed at which a robot moves along what it is closest to, m/s; the more room, the faster."""

_ROUNDS = 3
_TOLERANCE = 0.01
"""Speed, m/s, by which an approach may be too fast before it is slowed down."""

_ASIDE = 0.3
"""Largest speed, m/s, at which robots that stand in each other's way pass on the left."""


def slowed(velocity: Array, gap: Array) -> Array:
    """Return (n, 2) velocities no faster than the gap to the nearest wall, (n,) m, nan for none, makes wise.

    What is behind a corner comes into sight late: in a narrow place nothing is far.
    """
    room = np.where(np.isnan(gap), np.inf, np.maximum(gap, 0.0))
    most = np.sqrt(2.0 * BRAKING * room) + CREEP
    speed = np.sqrt(velocity[:, 0] ** 2 + velocity[:, 1] ** 2)
    return np.asarray(velocity * np.minimum(1.0, most / np.maximum(speed, 1e-9))[:, None])


def reachable(wanted: Array, velocity: Array, change: Array) -> Array:
    """Return (n, 2) velocities, m/s, that differ from the present by (n,) m/s at most, towards the wanted.

    Whoever turns would else spend on that the acceleration that is needed for braking.
    """
    step = wanted - velocity
    size = np.sqrt(step[:, 0] ** 2 + step[:, 1] ** 2)
    return np.asarray(velocity + step * np.minimum(1.0, change / np.maximum(size, 1e-9))[:, None])


class Limits(NamedTuple):
    """How fast something may be approached.

    Attributes
    ----------
    away : (..., 2)
        Directions from it to the robot, of length 1; 0 where there is nothing.
    speed : (...) m/s
        Of the approach, at most; below 0 where the gap should widen.
    """

    away: Array
    speed: Array


def wall_limits(offset: Array, radius: Array) -> Limits:
    """Return how fast (n,) robots of some radii may approach walls.

    Parameters
    ----------
    offset : (n, k, 2) m
        From points of walls to the robot; nan where there is none.
    radius : (n,) m
    """
    distance = np.sqrt(offset[..., 0] ** 2 + offset[..., 1] ** 2)
    gap = distance - radius[:, None] - MARGIN
    speed = np.where(gap > 0.0, np.sqrt(2.0 * BRAKING * np.maximum(gap, 0.0)), 2.0 * gap)
    away = offset / np.maximum(distance, 1e-9)[..., None]
    return Limits(np.where(np.isnan(away), 0.0, away), np.where(np.isnan(gap), np.inf, speed))


def robot_limits(offset: Array, distance: Array, reach: Array) -> Limits:
    """Return how fast robots may approach neighbours: a half of what two together may.

    Parameters
    ----------
    offset : (m, 2) m
        From the neighbour to the robot.
    distance : (m,) m
    reach : (m,) m
        At which the two touch.
    """
    gap = distance - reach - APART
    speed = np.where(gap > 0.0, 0.5 * np.sqrt(2.0 * BRAKING * np.maximum(gap, 0.0)), 2.0 * gap)
    return Limits(offset / np.maximum(distance, 1e-9)[:, None], speed)


def clear_of_walls(velocity: Array, walls: Limits) -> Array:
    """Return (n, 2) velocities, m/s, that brake before points of walls, (n, k)."""
    away, speed = walls
    rows = np.arange(len(velocity))
    for _ in range(_ROUNDS):
        excess = _approach(velocity, walls) - speed
        worst = excess.argmax(axis=1)
        over = np.maximum(excess[rows, worst], 0.0)
        if not over.any():
            break
        velocity = velocity + away[rows, worst] * over[:, None]
    return velocity


def clear_of_robots(velocity: Array, robot: IntArray, neighbours: Limits) -> Array:
    """Return velocities that brake before other robots, and pass them on the left.

    Parameters
    ----------
    velocity : (n, 2) m/s
    robot : (m,)
        Sorted; whose neighbour it is.
    neighbours : Limits, (m,)
    """
    if not len(robot):
        return velocity
    away, speed = neighbours
    n = len(velocity)
    velocity = velocity.copy()
    # first past each other, then, in a throng, at least not into anybody
    for aside in (_ASIDE, _ASIDE, 0.0, 0.0, 0.0):
        excess = -(away * velocity[robot]).sum(axis=1) - speed
        worst = np.full(n, -np.inf)
        np.maximum.at(worst, robot, excess)
        hit = ((excess == worst[robot]) & (excess > 0.0)).nonzero()[0]
        if not len(hit):
            break
        # of equals the last one
        which = np.full(n, -1)
        which[robot[hit]] = hit
        rows = (which >= 0).nonzero()[0]
        chosen = which[rows]
        over = excess[chosen]
        left = np.column_stack([away[chosen, 1], -away[chosen, 0]])
        velocity[rows] += away[chosen] * over[:, None] + left * np.minimum(over, aside)[:, None]
    return velocity


def scale_to_limits(velocity: Array, walls: Limits, robot: IntArray, neighbours: Limits) -> Array:
    """Return velocities that are slowed down where they still approach anything faster than is allowed.

    Who is too close already may not get closer. Parameters are those of `clear_of_walls` and of
    `clear_of_robots`.
    """
    part = _part(_approach(velocity, walls), walls.speed).min(axis=1, initial=1.0)
    if len(robot):
        approach = -(neighbours.away * velocity[robot]).sum(axis=1)
        np.minimum.at(part, robot, _part(approach, neighbours.speed))
    return np.asarray(velocity * part[:, None])


def _approach(velocity: Array, walls: Limits) -> Array:
    away = walls.away
    return np.asarray(-(away[..., 0] * velocity[:, None, 0] + away[..., 1] * velocity[:, None, 1]))


def _part(approach: Array, allowed: Array) -> Array:
    allowed = np.maximum(allowed, 0.0) + _TOLERANCE
    fast = approach > allowed
    return np.where(fast, allowed / np.where(fast, approach, 1.0), 1.0)
