"""Route following among walls and other robots: fast where there is room, braking before both."""

import math
from collections.abc import Sequence

import numpy as np

from robocov.arrays import Array, IntArray
from robocov.controllers.driving import approach, avoid, drive, neighbour_offsets, with_nearest
from robocov.observation import Observations
from robocov.team import Team

_TURN = 0.2  # metres from a way-point at which it counts as reached
_BRAKING = 0.4  # part of the acceleration that is counted on: less than half, for the lag of the drive
_FOR_TURNING = 0.7  # part of it that is spent on where to go; the rest is for not running into anything
_MARGIN, _APART = 0.02, 0.04  # gaps that are left to walls and to other robots, m
_EAGERNESS = 10.0  # speed in 1/s with which the distance to what is close may fall to its gap
_CREEP = 0.15  # speed at which a robot moves along what it is closest to, m/s; the more room, the faster
_ASIDE, _HEEDED = 0.3, 1.5  # largest speed, m/s, to pass on the left who is in the way, so many metres away


def follow_routes(
    seen: Observations, team: Team, routes: Sequence[Array], legs: IntArray, returns: Array | None,
    k_prop: float, response_time: float,
) -> tuple[Array, Array, IntArray]:  # fmt: skip
    """Return the forces, (n, 2) N, along the routes, kept off walls and other robots; goals, (n, 2) m; legs.

    A route is its way-points, (w, 2) m, the last one the goal; a leg, (n,), is the number of the one that is
    headed for. `returns` are the points of the last scans (`last_returns`).
    """
    positions = seen.positions
    aim = np.array([route[leg] for route, leg in zip(routes, legs, strict=True)])
    last = np.array([len(route) - 1 for route in routes])
    legs = legs + ((legs < last) & (np.hypot(*(aim - positions).T) < _TURN))
    aim = np.array([route[leg] for route, leg in zip(routes, legs, strict=True)])
    # what is behind a corner comes into sight late: in a narrow place nothing is far
    braking = _BRAKING * team.max_acceleration
    gap = np.maximum(np.hypot(*(positions - seen.obstacle_points).T) - team.radius, 0.0)
    speed = np.fmin(team.max_speed, np.sqrt(2.0 * braking * gap) + _CREEP)
    wanted = approach(aim - positions, math.inf, speed)
    wanted = np.where((legs == last)[:, None], approach(aim - positions, k_prop, speed), wanted)
    # who turns would else spend on that the acceleration that is needed for braking
    change = _FOR_TURNING * team.max_acceleration * response_time
    wanted = seen.velocities + approach(wanted - seen.velocities, 1.0, change)
    # of the size of others a robot knows its own
    apart = 2.0 * team.radius + _APART
    wanted = wanted + _aside(wanted, neighbour_offsets(seen, _HEEDED), apart, braking)
    keep, points = team.radius + _MARGIN, with_nearest(seen, returns)
    wanted = avoid(wanted, seen, team, points, keep, apart, _EAGERNESS, _BRAKING)
    goals = np.array([route[-1] for route in routes])
    return drive(wanted, seen, team, response_time), goals, legs


def _aside(wanted: Array, others: Array, apart: Array, braking: Array) -> Array:
    """Return velocities (n, 2) m/s to the left of whom each robot approaches the most too fast."""
    if not others.shape[1]:
        return np.zeros_like(wanted)
    distance = np.hypot(*np.moveaxis(others, -1, 0))
    away = others / np.maximum(distance, 1e-9)[..., None]
    allowed = np.sqrt(0.5 * braking[:, None] * np.maximum(distance - apart[:, None], 0.0))
    excess = np.nan_to_num(-(away * wanted[:, None]).sum(axis=2) - allowed, nan=-np.inf)
    worst = np.arange(len(wanted)), excess.argmax(axis=1)
    left = np.nan_to_num(away[worst])[:, ::-1] * [1.0, -1.0]
    return np.asarray(left * np.clip(excess[worst], 0.0, _ASIDE)[:, None])
