"""Route following among walls and other robots: fast in open space, braking before both."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from robocov.arrays import Array, IntArray
from robocov.controllers.driving import (
    Margins,
    avoid_collisions,
    clip_lengths,
    collect_obstacle_points,
    compute_approach_velocities,
    compute_drive_forces,
    list_neighbor_offsets,
)
from robocov.observation import Observations
from robocov.team import Team

_WAYPOINT_RADIUS_M = 0.2
"""Distance from a waypoint at which it counts as reached."""
_BRAKING_FRACTION = 0.4
"""Fraction of the maximum acceleration reserved for braking: less than half, because the drive lags."""
_STEERING_FRACTION = 0.7
"""Fraction of the maximum acceleration that is used to follow the route; the rest avoids collisions."""
_WALL_GAP_M = 0.02
"""Gap between a robot and walls."""
_ROBOT_GAP_M = 0.04
"""Gap between two robots."""
_APPROACH_RATE = 10.0
"""Rate in 1/s at which a distance may decrease toward its gap."""
_MIN_SPEED_LIMIT = 0.15
"""Speed in m/s that a robot may reach even close to a wall."""
_MAX_EVASION_SPEED = 0.3
"""Maximum speed in m/s at which a robot passes another one on the left."""
_EVASION_RANGE_M = 1.5
"""Distance from which robots pass each other on the left."""
_MIN_DISTANCE_M = 1e-9
"""Lower limit of distances in divisions."""


class RouteCommand(NamedTuple):
    """Forces that lead robots along their routes in one step."""

    forces: Array
    """(n, 2) N"""
    goals: Array
    """(n, 2) m, ends of the routes."""
    legs: IntArray
    """(n,) Index of the waypoint that each robot heads for now."""


def follow_routes(
    seen: Observations,
    team: Team,
    *,
    routes: Sequence[Array],
    legs: IntArray,
    returns: Array | None,
    k_prop: float,
    response_time: float,
) -> RouteCommand:
    """Compute the forces that lead robots along their routes, away from walls and other robots.

    Parameters
    ----------
    seen : Observations
    team : Team
    routes : sequence of (w, 2) arrays, m
        Waypoints of each robot; the last one is the goal.
    legs : (n,) int array
        Index of the waypoint that each robot headed for.
    returns : (n, rays, 2) array or None, m
        Points of the last scans, as `driving.update_returns` returns them.
    k_prop : float, 1/s
        Speed per meter of distance to the goal.
    response_time : float, s
        Time constant of the approach to the desired velocities.

    Returns
    -------
    RouteCommand
    """
    last_legs = np.array([len(route) - 1 for route in routes])
    targets = _select_waypoints(routes, legs)
    is_reached = np.hypot(*(targets - seen.positions).T) < _WAYPOINT_RADIUS_M
    legs = legs + ((legs < last_legs) & is_reached)
    offsets = _select_waypoints(routes, legs) - seen.positions

    speed_limit = _compute_speed_limits(seen, team)
    to_waypoint = compute_approach_velocities(offsets, math.inf, speed_limit)
    to_goal = compute_approach_velocities(offsets, k_prop, speed_limit)
    velocities = np.where((legs == last_legs)[:, None], to_goal, to_waypoint)
    # Turning must not use up the acceleration that is needed for braking.
    max_change = _STEERING_FRACTION * team.max_acceleration * response_time
    velocities = seen.velocities + clip_lengths(velocities - seen.velocities, max_change)
    # A robot does not know how large others are: it assumes its own size.
    separation = 2.0 * team.radius + _ROBOT_GAP_M
    velocities = velocities + _compute_evasion(seen, team, velocities, separation)
    margins = Margins(
        clearance=team.radius + _WALL_GAP_M,
        separation=separation,
        rate=_APPROACH_RATE,
        braking=_BRAKING_FRACTION,
    )
    obstacle_points = collect_obstacle_points(seen, returns)
    velocities = avoid_collisions(velocities, seen, team, obstacle_points, margins)
    return RouteCommand(
        forces=compute_drive_forces(velocities, seen, team, response_time),
        goals=np.array([route[-1] for route in routes]),
        legs=legs,
    )


def _select_waypoints(routes: Sequence[Array], legs: IntArray) -> Array:
    """Return the waypoint that each robot heads for, (n, 2) m."""
    return np.array([route[leg] for route, leg in zip(routes, legs, strict=True)])


def _compute_speed_limits(seen: Observations, team: Team) -> Array:
    """Return the speed, (n,) m/s, at which each robot can still stop before the nearest obstacle.

    Robots are slow in narrow passages, because obstacles behind a corner come into view late.
    """
    gap = np.maximum(np.hypot(*(seen.positions - seen.obstacle_points).T) - team.radius, 0.0)
    braking = _BRAKING_FRACTION * team.max_acceleration
    # fmin ignores nan, which stands for no obstacle in range.
    return np.asarray(np.fmin(team.max_speed, np.sqrt(2.0 * braking * gap) + _MIN_SPEED_LIMIT))


def _compute_evasion(seen: Observations, team: Team, velocities: Array, separation: Array) -> Array:
    """Return velocities, (n, 2) m/s, to the left of the other robot that each one approaches too fast."""
    offsets = list_neighbor_offsets(seen, _EVASION_RANGE_M)
    if not offsets.shape[1]:
        return np.zeros_like(velocities)
    braking = _BRAKING_FRACTION * team.max_acceleration
    distance = np.hypot(*np.moveaxis(offsets, -1, 0))
    normals = offsets / np.maximum(distance, _MIN_DISTANCE_M)[..., None]
    allowed_speed = np.sqrt(0.5 * braking[:, None] * np.maximum(distance - separation[:, None], 0.0))
    excess = -(normals * velocities[:, None]).sum(axis=2) - allowed_speed
    excess = np.nan_to_num(excess, nan=-np.inf)
    rows = np.arange(len(velocities))
    worst = excess.argmax(axis=1)
    left = np.nan_to_num(normals[rows, worst])[:, ::-1] * [1.0, -1.0]
    speed = np.clip(excess[rows, worst], 0.0, _MAX_EVASION_SPEED)
    return np.asarray(left * speed[:, None])
