"""From a wanted velocity to the force: for laws that say where to go, not how hard to push."""

from __future__ import annotations

import numpy as np

from robocov.arrays import Array, IntArray
from robocov.controllers.projection import nearest_allowed
from robocov.observation import Observations
from robocov.robots import Team


def approach(offset: Array, k_prop: float, speed: Array) -> Array:
    """Return velocities, (n, 2) m/s, towards goals: proportional to the distance, and at most so fast.

    Parameters
    ----------
    offset : (n, 2) m
        From the robots to their goals.
    k_prop : float, 1/s
    speed : (n,) m/s
    """
    distance = np.sqrt(offset[:, 0] ** 2 + offset[:, 1] ** 2)
    return np.asarray(offset * np.minimum(k_prop, speed / np.maximum(distance, 1e-300))[:, None])


def drive(wanted: Array, seen: Observations, team: Team, response_time: float) -> Array:
    """Return the forces, (n, 2) N, that bring each robot to its wanted velocity.

    The velocity follows with the time constant `response_time`; what viscosity takes is made up for.

    Parameters
    ----------
    wanted : (n, 2) m/s
    seen : Observations
    team : Team
    response_time : float, s
    """
    change = (wanted - seen.velocities) * (team.mass / response_time)[:, None]
    return np.asarray(change + seen.velocities * team.viscosity[:, None])


def limit_approach_speed(
    wanted: Array, away: Array, clearance: Array, rate: float, braking: Array, speed: Array
) -> Array:
    """Return the velocities nearest to the wanted ones, (n, 2) m/s, that are slow towards what is close.

    The distance to each thing falls to its clearance exponentially at most, and no faster than a robot
    can brake; inside it, the velocity leads out. Where not all of that is possible, nothing is approached.

    Parameters
    ----------
    wanted : (n, 2) m/s
    away : (n, k, 2) m
        From the things that are close to the robot; nan where there is none.
    clearance : (n, k) m
    rate : float, 1/s
    braking : (n, k) m/s²
    speed : (n,) m/s
        The largest.
    """
    distance = np.sqrt(away[..., 0] ** 2 + away[..., 1] ** 2)
    normal = away / np.where(distance > 0.0, distance, np.nan)[..., None]
    gap = np.nan_to_num(distance - clearance)
    level = np.minimum(rate * gap, np.sqrt(2.0 * braking * np.maximum(gap, 0.0)))
    # leading out is worth less than full speed, which would leave no room for anything else
    level = np.maximum(level, -0.5 * speed[:, None])
    slowed, feasible = nearest_allowed(wanted, -normal, level, speed)
    held = np.flatnonzero(~feasible)
    if len(held):
        slowed[held], _ = nearest_allowed(
            wanted[held], -normal[held], np.maximum(level[held], 0.0), speed[held]
        )
    return slowed


def offsets_from_neighbours(seen: Observations, reach: float) -> Array:
    """Return the offsets from each robot's neighbours within reach to itself, (n, k, 2) m; nan for none."""
    n = len(seen.positions)
    robot, _, offset, _ = seen.neighbours_within(reach)
    return in_rows(robot, n, offset, np.nan)


def in_rows(robot: IntArray, n: int, values: Array, fill: float) -> Array:
    """Return (m, ...) values that belong to n robots, sorted by robot, as (n, k, ...), filled up."""
    count = np.bincount(robot, minlength=n)
    column = np.arange(len(robot)) - np.repeat(np.cumsum(count) - count, count)
    rows = np.full((n, int(count.max(initial=0)), *values.shape[1:]), fill)
    rows[robot, column] = values
    return rows


def summed(robot: IntArray, vectors: Array, n: int) -> Array:
    """Return the sums of (m, 2) vectors that belong to each of n robots, (n, 2)."""
    sums = np.empty((n, 2))
    for k in (0, 1):
        sums[:, k] = np.bincount(robot, vectors[:, k], minlength=n)
    return sums
