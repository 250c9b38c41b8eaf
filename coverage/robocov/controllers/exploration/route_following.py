"""Route following among walls and other robots: fast in open space, and braking before obstacles."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

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
from robocov.typing import FloatArray, IntArray

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
"""Maximum speed in m/s at which a robot swerves to its left to pass another one."""
_EVASION_RANGE_M = 1.5
"""Distance below which robots start to swerve."""
_MIN_DISTANCE_M = 1e-9
"""Minimum divisor; prevents division by zero."""


class RouteProgress(NamedTuple):
    """The routes of the robots, and the waypoint that each robot heads for."""

    routes: Sequence[FloatArray]
    """Waypoints of each robot, (w, 2) m. The last one is its goal."""
    waypoint_indices: IntArray
    """(n,) Index, in its route, of the waypoint that each robot heads for."""

    def get_waypoints(self) -> FloatArray:
        """Return the waypoint that each robot heads for, (n, 2) m."""
        pairs = zip(self.routes, self.waypoint_indices, strict=True)
        return np.array([route[index] for route, index in pairs])


class RouteGains(NamedTuple):
    """Gains with which robots follow their routes."""

    k_prop: float
    """Speed per meter of distance to the goal, 1/s."""
    response_time: float
    """Time constant of the approach to the desired velocities, s."""


class RouteCommand(NamedTuple):
    """Forces that lead robots along their routes in one step."""

    forces: FloatArray
    """(n, 2) N, forces on the robots."""
    goals: FloatArray
    """(n, 2) m, ends of the routes."""
    waypoint_indices: IntArray
    """(n,) Index, in its route, of the waypoint that each robot heads for now."""


def follow_routes(
    seen: Observations, team: Team, progress: RouteProgress, returns: FloatArray | None, gains: RouteGains
) -> RouteCommand:
    """Compute the forces that lead robots along their routes, away from walls and other robots.

    Parameters
    ----------
    seen : Observations
    team : Team
    progress : RouteProgress
        The routes, and the waypoint that each robot headed for at the last step.
    returns : (n, rays, 2) array or None, m
        Obstacle points in the last scans, as `driving.update_returns` returns them.
    gains : RouteGains

    Returns
    -------
    RouteCommand
    """
    progress = _advance_waypoints(progress, seen.positions)
    desired = _compute_desired_velocities(seen, team, progress, gains.k_prop)
    # Turning must not use up the acceleration that is needed for braking.
    max_change = _STEERING_FRACTION * team.max_acceleration * gains.response_time
    velocities = seen.velocities + clip_lengths(desired - seen.velocities, max_change)
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
        forces=compute_drive_forces(velocities, seen, team, gains.response_time),
        goals=np.array([route[-1] for route in progress.routes]),
        waypoint_indices=progress.waypoint_indices,
    )


def _get_last_indices(progress: RouteProgress) -> IntArray:
    """Return the index of the last waypoint of each route, the goal, (n,)."""
    return np.array([len(route) - 1 for route in progress.routes])


def _advance_waypoints(progress: RouteProgress, positions: FloatArray) -> RouteProgress:
    """Return the progress after robots that have reached a waypoint head for the next one."""
    is_reached = np.hypot(*(progress.get_waypoints() - positions).T) < _WAYPOINT_RADIUS_M
    has_next = progress.waypoint_indices < _get_last_indices(progress)
    return progress._replace(waypoint_indices=progress.waypoint_indices + (has_next & is_reached))


def _compute_desired_velocities(
    seen: Observations, team: Team, progress: RouteProgress, k_prop: float
) -> FloatArray:
    """Return the velocities toward the waypoints, (n, 2) m/s; robots slow down only before their goals."""
    offsets = progress.get_waypoints() - seen.positions
    speed_limit = _compute_speed_limits(seen, team)
    to_waypoint = compute_approach_velocities(offsets, math.inf, speed_limit)
    to_goal = compute_approach_velocities(offsets, k_prop, speed_limit)
    is_last_waypoint = progress.waypoint_indices == _get_last_indices(progress)
    return np.where(is_last_waypoint[:, None], to_goal, to_waypoint)


def _compute_speed_limits(seen: Observations, team: Team) -> FloatArray:
    """Return the speed, (n,) m/s, at which each robot can still stop before the nearest obstacle.

    Robots are slow in narrow passages, because obstacles behind a corner come into view late.
    """
    gap = np.maximum(np.hypot(*(seen.positions - seen.obstacle_points).T) - team.radius, 0.0)
    braking = _BRAKING_FRACTION * team.max_acceleration
    # fmin ignores nan, which stands for no obstacle in range.
    return np.asarray(np.fmin(team.max_speed, np.sqrt(2.0 * braking * gap) + _MIN_SPEED_LIMIT))


def _compute_evasion(
    seen: Observations, team: Team, velocities: FloatArray, separation: FloatArray
) -> FloatArray:
    """Return the velocities, (n, 2) m/s, with which robots swerve to their left to pass each other.

    They are zero for robots that approach no other robot faster than the allowed speed.
    """
    offsets = list_neighbor_offsets(seen, _EVASION_RANGE_M)
    if not offsets.shape[1]:
        return np.zeros_like(velocities)
    braking = _BRAKING_FRACTION * team.max_acceleration
    distance = np.hypot(*np.moveaxis(offsets, -1, 0))
    normals = offsets / np.maximum(distance, _MIN_DISTANCE_M)[..., None]
    # `avoid_collisions` allows speeds up to sqrt(braking * gap). Robots start to pass each other before they
    # have to slow down: at that speed divided by sqrt(2).
    allowed_speed = np.sqrt(0.5 * braking[:, None] * np.maximum(distance - separation[:, None], 0.0))
    excess = -(normals * velocities[:, None]).sum(axis=2) - allowed_speed
    excess = np.nan_to_num(excess, nan=-np.inf)
    rows = np.arange(len(velocities))
    worst = excess.argmax(axis=1)
    # The normal points from the other robot to this one. Turned clockwise, it points to the left, as seen by
    # a robot that faces the other one.
    left = np.nan_to_num(normals[rows, worst])[:, ::-1] * [1.0, -1.0]
    speed = np.clip(excess[rows, worst], 0.0, _MAX_EVASION_SPEED)
    return np.asarray(left * speed[:, None])
