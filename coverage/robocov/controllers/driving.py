"""Safe velocities toward goals, and the forces that track them.

A controller computes a desired velocity, `avoid_collisions` returns the nearest velocity that is safe as far
as the robot knows, and `compute_drive_forces` returns the force that tracks it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from robocov.compiled import kernel
from robocov.observation import Observations
from robocov.team import Team
from robocov.typing import BoolArray, FloatArray, IntArray

_DEFAULT_APPROACH_RATE = 4.0
"""Rate in 1/s at which the remaining distance may decrease."""
_DEFAULT_BRAKING_FRACTION = 0.5
"""Fraction of the maximum acceleration that is assumed to be available for braking."""
_MIN_LENGTH = 1e-300
"""Minimum divisor; prevents division by zero."""
_MIN_RATE = 1e-9
"""Minimum rate of approach used as a divisor, 1/s; prevents division by zero."""
_RELATIVE_SLACK = 1e-12
"""Tolerance of constraints for rounding errors, relative to the radius of the disc."""
_MIN_SLOPE = 1e-12
"""Sine of the maximum angle between two constraint lines that count as parallel."""


class Margins(NamedTuple):
    """Minimum distances that `avoid_collisions` keeps, and the limits of the speed of approach."""

    clearance: FloatArray
    """(n,) m, minimum distance from the center of each robot to obstacle points."""
    separation: FloatArray
    """(n,) m, minimum distance from the center of each robot to those of others."""
    rate: float
    """1/s, maximum rate of the exponential decrease of the remaining distance."""
    braking: float
    """Fraction of the maximum acceleration that is assumed to be available for braking."""

    @classmethod
    def build_with_gap(cls, team: Team, gap: float) -> Margins:
        """Build the margins for a minimum gap, m, from the surface of a robot to obstacles and other robots.

        Each robot assumes that others may be as large as the largest of the team.
        """
        clearance = team.radius + gap
        return cls(
            clearance=clearance,
            separation=clearance + float(team.radius.max()),
            rate=_DEFAULT_APPROACH_RATE,
            braking=_DEFAULT_BRAKING_FRACTION,
        )


def compute_approach_velocities(offsets: FloatArray, gain: float, max_speed: FloatArray) -> FloatArray:
    """Compute velocities toward goals.

    Parameters
    ----------
    offsets : (n, 2) array, m
        Vectors from the robots to their goals.
    gain : float, 1/s
        Speed per meter of distance; infinite for full speed.
    max_speed : (n,) array, m/s

    Returns
    -------
    (n, 2) array, m/s

    Examples
    --------
    >>> compute_approach_velocities(np.array([[3.0, 4.0], [0.1, 0.0]]), 2.0, np.array([1.0, 1.0]))
    array([[0.6, 0.8],
           [0.2, 0. ]])
    """
    distance = np.sqrt(offsets[:, 0] ** 2 + offsets[:, 1] ** 2)
    factor = np.minimum(gain, max_speed / np.maximum(distance, _MIN_LENGTH))
    return np.asarray(offsets * factor[:, None])


def clip_lengths(vectors: FloatArray, max_length: FloatArray) -> FloatArray:
    """Shorten vectors that are too long.

    Parameters
    ----------
    vectors : (n, 2) array
    max_length : (n,) array

    Returns
    -------
    (n, 2) array

    Examples
    --------
    >>> clip_lengths(np.array([[3.0, 4.0], [0.1, 0.0]]), np.array([1.0, 1.0]))
    array([[0.6, 0.8],
           [0.1, 0. ]])
    """
    return compute_approach_velocities(vectors, 1.0, max_length)


def compute_drive_forces(
    velocities: FloatArray, seen: Observations, team: Team, response_time: float
) -> FloatArray:
    """Compute the forces that track desired velocities.

    Parameters
    ----------
    velocities : (n, 2) array, m/s
    seen : Observations
    team : Team
    response_time : float, s
        Time constant of the approach to the desired velocities.

    Returns
    -------
    (n, 2) array, N
    """
    accelerating_forces = (velocities - seen.velocities) * (team.mass / response_time)[:, None]
    # The second term compensates for the viscosity.
    return np.asarray(accelerating_forces + seen.velocities * team.viscosity[:, None])


def update_returns(seen: Observations, previous: FloatArray | None) -> FloatArray | None:
    """Return the obstacle points in the last scan of each robot.

    Parameters
    ----------
    seen : Observations
    previous : (n, rays, 2) array or None, m
        Result of this function at the previous step. It is returned again if there is no new scan.

    Returns
    -------
    (n, rays, 2) array or None, m
        nan where a ray hit nothing; None before the first scan.
    """
    scans = seen.scans
    if scans is None:
        return previous
    distances = np.where(scans.is_hit, scans.distances, np.nan)
    return np.asarray(seen.positions[:, None] + distances[:, :, None] * scans.directions)


def collect_obstacle_points(seen: Observations, returns: FloatArray | None) -> FloatArray:
    """Collect the closest obstacle point of each robot, and the obstacle points in its last scan.

    Parameters
    ----------
    seen : Observations
    returns : (n, rays, 2) array or None, m
        Obstacle points in the last scans, from `update_returns`.

    Returns
    -------
    (n, k, 2) array, m
        Rows of nan stand for no point.
    """
    nearest = seen.obstacle_points[:, None]
    if returns is None:
        return nearest
    return np.concatenate([nearest, returns], axis=1)


def avoid_collisions(
    velocities: FloatArray, seen: Observations, team: Team, obstacle_points: FloatArray, margins: Margins
) -> FloatArray:
    """Compute the velocities nearest to the desired ones that avoid obstacles and other robots.

    Parameters
    ----------
    velocities : (n, 2) array, m/s
    seen : Observations
    team : Team
    obstacle_points : (n, k, 2) array, m
        As returned by `collect_obstacle_points`; rows of nan stand for no point.
    margins : Margins

    Returns
    -------
    (n, 2) array, m/s
        These velocities satisfy the limits in the notes of `limit_approach_speed`.
    """
    wall_braking = margins.braking * team.max_acceleration
    # Two robots that meet brake on half of the distance each.
    robot_braking = 0.5 * margins.braking * team.max_acceleration
    # A robot at full speed need not brake for anything farther away.
    stopping_distance = np.maximum(
        team.max_speed / max(margins.rate, _MIN_RATE), team.max_speed**2 / (2.0 * robot_braking)
    )
    max_distance = float((margins.separation + stopping_distance).max())
    robot_offsets = list_neighbor_offsets(seen, max_distance)
    wall_offsets = seen.positions[:, None] - obstacle_points
    max_neighbors = robot_offsets.shape[1]
    is_robot = np.arange(max_neighbors + wall_offsets.shape[1]) < max_neighbors
    return limit_approach_speed(
        velocities,
        offsets=np.concatenate([robot_offsets, wall_offsets], axis=1),
        clearance=np.where(is_robot, margins.separation[:, None], margins.clearance[:, None]),
        rate=margins.rate,
        braking=np.where(is_robot, robot_braking[:, None], wall_braking[:, None]),
        max_speed=team.max_speed,
    )


def limit_approach_speed(
    velocities: FloatArray,
    offsets: FloatArray,
    clearance: FloatArray,
    rate: float,
    braking: FloatArray,
    max_speed: FloatArray,
) -> FloatArray:
    """Change velocities as little as possible so that robots can stop before they reach objects.

    Parameters
    ----------
    velocities : (n, 2) array, m/s
    offsets : (n, k, 2) array, m
        Vectors from each object to the robot; rows of nan stand for no object.
    clearance : (n, k) array, m
        Minimum distance of the robot from the object.
    rate : float, 1/s
        Maximum rate of the exponential decrease of the remaining distance to the clearance.
    braking : (n, k) array, m/s²
        Deceleration that must suffice for the robot to stop at the clearance.
    max_speed : (n,) array, m/s

    Returns
    -------
    (n, 2) array, m/s
        The velocities nearest to the desired ones that satisfy the limits (see Notes).

    Notes
    -----
    With the gap g = distance - clearance, the speed of a robot toward an object is limited to

        min(rate g, sqrt(2 braking g))    if g >= 0,
        max(rate g, -max_speed / 2)       if g < 0: the robot has to move away.

    A robot between objects may be unable to move away from all of them at once. For this robot, negative
    limits are replaced by 0: it approaches none of the objects.
    """
    distance = np.sqrt(offsets[..., 0] ** 2 + offsets[..., 1] ** 2)
    normals = offsets / np.where(distance > 0.0, distance, np.nan)[..., None]
    gap = np.nan_to_num(distance - clearance)
    limits = np.minimum(rate * gap, np.sqrt(2.0 * braking * np.maximum(gap, 0.0)))
    # At full speed away from one object, a robot could not avoid another one.
    limits = np.maximum(limits, -0.5 * max_speed[:, None])
    limited, is_feasible = find_nearest_allowed_points(velocities, -normals, limits, max_speed)
    if is_feasible.all():
        return limited
    not_approaching, _ = find_nearest_allowed_points(velocities, -normals, np.maximum(limits, 0.0), max_speed)
    return np.where(is_feasible[:, None], limited, not_approaching)


@kernel
def find_nearest_allowed_points(
    points: FloatArray, normals: FloatArray, offsets: FloatArray, radius: FloatArray
) -> tuple[FloatArray, BoolArray]:
    """Find the points nearest to desired ones in the intersections of discs and half planes.

    Parameters
    ----------
    points : (n, 2) array
        Desired points p.
    normals : (n, m, 2) array
        Unit normals of the half planes; nan for no constraint.
    offsets : (n, m) array
        Distances of the edges of the half planes from the origin, along the normals.
    radius : (n,) array
        Radii of the discs around the origin.

    Returns
    -------
    nearest : (n, 2) array
        Nearest allowed points. Where `is_feasible` is false, a point that violates a constraint.
    is_feasible : (n,) bool array
        Whether there is any allowed point.

    Notes
    -----
    Minimize |u - p|² subject to normals[k] · u <= offsets[k] for all k and |u| <= radius. Half planes are
    added one by one: if the optimum so far violates the next one, the new optimum lies on the edge of this
    half plane, in the interval that the earlier ones and the disc allow. This is incremental linear
    programming (de Berg et al., *Computational Geometry*, section 4.3) with a quadratic objective.
    """
    nearest = np.empty(points.shape)
    is_feasible = np.ones(len(points), dtype=np.bool_)
    for i in range(len(points)):
        r = radius[i]
        slack = _RELATIVE_SLACK * max(r, 1.0)
        # Without half planes, the optimum is the desired point, moved into the disc.
        x = points[i, 0]
        y = points[i, 1]
        length = math.sqrt(x * x + y * y)
        if length > r:
            x = x * (r / length)
            y = y * (r / length)
        for k in range(offsets.shape[1]):
            nx = normals[i, k, 0]
            ny = normals[i, k, 1]
            offset = offsets[i, k]
            # Skip half planes that contain the disc, that already contain the optimum, or that are nan.
            if not (offset < r and nx * x + ny * y - offset > slack):
                continue
            low, high = _find_allowed_interval(normals[i], offsets[i], k, r, slack)
            if low > high + slack:
                is_feasible[i] = False
                break
            # The point of the edge that is nearest to the desired one, moved into the interval. Because of
            # the slack, `low` may be slightly above `high`.
            desired_t = points[i, 1] * nx - points[i, 0] * ny
            t = min(max(desired_t, min(low, high)), high)
            x = offset * nx - t * ny
            y = offset * ny + t * nx
        nearest[i, 0] = x
        nearest[i, 1] = y
    return nearest, is_feasible


@kernel
def _find_allowed_interval(
    normals: FloatArray, offsets: FloatArray, k: int, radius: float, slack: float
) -> tuple[float, float]:
    """Return the interval of t in which the edge of half plane k lies in the disc and half planes 0 to k - 1.

    With (nx, ny) the normal of half plane k, the points of its edge are offset (nx, ny) + t (-ny, nx). The
    lower end of the interval is infinite if no point is allowed.
    """
    nx = normals[k, 0]
    ny = normals[k, 1]
    offset = offsets[k]
    high = math.sqrt(max(radius * radius - offset * offset, 0.0))
    low = -high
    if offset < -radius:
        # Half plane k excludes the whole disc.
        low = math.inf
    for j in range(k):
        # Half plane j allows the points with slope * t <= max_rise. If it is nan, all comparisons are false,
        # and it allows all points.
        slope = normals[j, 1] * nx - normals[j, 0] * ny
        max_rise = offsets[j] - offset * (normals[j, 0] * nx + normals[j, 1] * ny)
        if slope >= _MIN_SLOPE:
            high = min(high, max_rise / slope)
        elif slope <= -_MIN_SLOPE:
            low = max(low, max_rise / slope)
        elif max_rise < -slack:
            # The edges are parallel, and half plane j excludes all of edge k.
            low = math.inf
    return low, high


def list_neighbor_offsets(seen: Observations, max_distance: float) -> FloatArray:
    """List the offsets from the near neighbors of each robot to the robot itself.

    Parameters
    ----------
    seen : Observations
    max_distance : float, m
        Neighbors farther away are left out.

    Returns
    -------
    (n, k, 2) array, m
        Row i belongs to robot i; nan at the end of rows with fewer neighbors.
    """
    pairs = seen.find_neighbors(max_distance)
    return arrange_in_rows(pairs.robots, len(seen.positions), pairs.offsets, np.nan)


def arrange_in_rows(robot: IntArray, n: int, values: FloatArray, fill: float) -> FloatArray:
    """Arrange values of pairs in one row for each robot.

    Parameters
    ----------
    robot : (m,) int array
        Robot that each value belongs to, ascending.
    n : int
        Number of robots.
    values : (m, ...) array
    fill : float
        Value at the ends of rows that are shorter than the longest one.

    Returns
    -------
    (n, k, ...) array

    Examples
    --------
    >>> arrange_in_rows(np.array([0, 2, 2]), 3, np.array([5.0, 6.0, 7.0]), 0.0)
    array([[5., 0.],
           [0., 0.],
           [6., 7.]])
    """
    # The column of a value is its index minus the index of the first value of the same robot.
    count = np.bincount(robot, minlength=n)
    first = np.cumsum(count) - count
    column = np.arange(len(robot)) - np.repeat(first, count)
    rows = np.full((n, int(count.max(initial=0)), *values.shape[1:]), fill)
    rows[robot, column] = values
    return rows


def sum_by_robot(robot: IntArray, vectors: FloatArray, n: int) -> FloatArray:
    """Sum the vectors that belong to each robot.

    Parameters
    ----------
    robot : (m,) int array
        Robot to which each vector belongs.
    vectors : (m, 2) array
    n : int
        Number of robots.

    Returns
    -------
    (n, 2) array
    """
    x = np.bincount(robot, vectors[:, 0], minlength=n)
    y = np.bincount(robot, vectors[:, 1], minlength=n)
    # Without any vectors, `bincount` returns integers.
    return np.column_stack([x, y]).astype(np.float64, copy=False)
