"""Free positions for robots: checks whether robots fit, and the nearest positions at which they do."""

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from robocov.arrays import compute_lengths
from robocov.environment import Environment, Point, find_nearest_inside
from robocov.errors import StartError, format_position
from robocov.observation.close_pairs import find_close_pairs
from robocov.potential import compute_spread_directions
from robocov.team import Team
from robocov.typing import BoolArray, FloatArray, IntArray

_CLEARANCE_M = 1e-3
"""Gap between a robot and the walls and robots from which it is moved away."""
_MAX_ROUNDS = 300
"""Number of rounds after which robots that still overlap are assumed not to fit."""
_QUADRANT_SEGMENTS = 16
"""Edges per quadrant of the polygons that represent the discs of other robots."""


def relocate_robots(environment: Environment, positions: FloatArray, team: Team) -> FloatArray:
    """Compute new positions of robots that overlap walls or each other, so that all of them fit.

    In each round, robots in walls are moved to the nearest positions outside, and the two robots of each
    overlapping pair are moved apart.

    Parameters
    ----------
    environment : Environment
        The map.
    positions : (n, 2) array, m
        Centers of the robots.
    team : Team
        The n robots.

    Returns
    -------
    (n, 2) array, m
        New positions. Robots that neither overlap nor are pushed by others do not move.

    Raises
    ------
    StartError
        If the robots do not fit.
    """
    positions = np.array(positions, dtype=float)
    areas = _compute_center_areas(environment, team)
    for _ in range(_MAX_ROUNDS):
        _leave_walls(environment, positions, team, areas)
        first, second, distances = find_close_pairs(positions, 2.0 * float(team.radius.max()))
        overlaps = team.radius[first] + team.radius[second] - distances
        rows = np.flatnonzero((overlaps > 0.0) & (first < second))
        if len(rows) == 0:
            return positions
        first = first[rows]
        second = second[rows]
        directions = _compute_directions(positions, first, second, distances[rows])
        # Each robot of a pair moves by half of the distance that is missing.
        displacements = 0.5 * (overlaps[rows] + _CLEARANCE_M)[:, None] * directions
        np.add.at(positions, first, -displacements)
        np.add.at(positions, second, displacements)
    raise StartError(
        f"robots {first[0] + 1} and {second[0] + 1} have no space next to each other "
        f"in map {environment.name!r}"
    )


def _compute_center_areas(environment: Environment, team: Team) -> dict[float, BaseGeometry]:
    """Return the area in which the center of a robot may be, by the radius of the robot.

    Raise a StartError if a robot fits nowhere.
    """
    areas = {}
    for radius in np.unique(team.radius).tolist():
        areas[radius] = _compute_center_area(environment, radius)
        if areas[radius].is_empty:
            robot = int(np.argmax(team.radius == radius)) + 1
            raise StartError(f"robot {robot} of radius {radius:g} m fits nowhere in map {environment.name!r}")
    return areas


def _leave_walls(
    environment: Environment, positions: FloatArray, team: Team, areas: dict[float, BaseGeometry]
) -> None:
    """Move the robots that overlap walls to the nearest positions where they fit, changing the positions."""
    is_in_wall = _compute_wall_distances(environment, positions) < team.radius
    center_areas = np.array([areas[radius] for radius in team.radius[is_in_wall].tolist()], dtype=object)
    positions[is_in_wall] = find_nearest_inside(center_areas, positions[is_in_wall])


def _compute_directions(
    positions: FloatArray, first: IntArray, second: IntArray, distances: FloatArray
) -> FloatArray:
    """Return unit vectors from the first robots of pairs to the second ones, (k, 2)."""
    is_same_point = distances == 0.0
    divisors = np.where(is_same_point, 1.0, distances)
    directions: FloatArray = (positions[second] - positions[first]) / divisors[:, None]
    # The direction between robots at the same point is undefined. Each such pair gets an arbitrary direction.
    directions[is_same_point] = compute_spread_directions((first + second)[is_same_point])
    return directions


def find_free_position(
    environment: Environment, radius: float, others: FloatArray, point: Point, radii: FloatArray | None = None
) -> Point:
    """Find the free position for one more robot that is nearest to a point.

    Parameters
    ----------
    environment : Environment
        The map.
    radius : float, m
        Radius of the robot.
    others : (n, 2) array, m
        Positions of the other robots.
    point : (x, y), m
        Requested position.
    radii : (n,) array or None, m
        Radii of the other robots; by default the same as `radius`.

    Returns
    -------
    (x, y), m
        The point itself if the robot fits there.

    Raises
    ------
    StartError
        If the robot fits nowhere.
    """
    if radii is None:
        radii = np.full(len(others), radius)
    distances = compute_lengths(others - point)
    wall_distance = _compute_wall_distances(environment, np.array([point]))[0]
    if wall_distance >= radius and (distances >= radius + radii).all():
        return float(point[0]), float(point[1])
    area = _compute_center_area(environment, radius)
    if len(others) > 0:
        # Shapely represents a disc by an inscribed polygon, whose edges are nearer to the center. The disc is
        # enlarged, so that the edges are at the required distance.
        inradius_ratio = np.cos(np.pi / (4 * _QUADRANT_SEGMENTS))
        circumradii = (radius + radii + _CLEARANCE_M) / inradius_ratio
        discs = shapely.buffer(shapely.points(others), circumradii, quad_segs=_QUADRANT_SEGMENTS)
        area = area.difference(shapely.union_all(discs))
    if area.is_empty:
        raise StartError(f"no space for a robot of radius {radius:g} m in map {environment.name!r}")
    x, y = find_nearest_inside(area, np.array([point], dtype=float))[0].tolist()
    return x, y


def require_finite_starts(positions: FloatArray) -> None:
    """Raise an error if a position is not finite.

    Parameters
    ----------
    positions : (n, 2) array, m
        Positions at which the robots start.

    Raises
    ------
    StartError
        If a position is not finite. The message names the first such robot.
    """
    for i in np.flatnonzero(~np.isfinite(positions).all(axis=1)).tolist():
        raise StartError(f"starts[{i}]: expected finite numbers, got {positions[i].tolist()}")


def require_free_starts(
    environment: Environment,
    positions: FloatArray,
    team: Team,
    tolerance: float,
    is_working: BoolArray | None = None,
    is_failed: BoolArray | None = None,
) -> None:
    """Raise an error if a robot starts inside a wall or inside another robot.

    Parameters
    ----------
    environment : Environment
        The map.
    positions : (n, 2) array, m
        Positions at which the robots start.
    team : Team
        The n robots.
    tolerance : float, m
        Depth up to which overlaps are accepted.
    is_working : (n,) bool array or None
        Whether each robot works. Only working robots are checked; by default, all robots work.
    is_failed : (n,) bool array or None
        Whether each robot has failed, and is an obstacle to the others; by default, no robot has.

    Raises
    ------
    StartError
        If a position is not finite, or a working robot overlaps a wall or a robot that works or has failed.
    """
    if is_working is None:
        is_working = np.ones(len(positions), dtype=bool)
    is_present = is_working if is_failed is None else is_working | is_failed
    require_finite_starts(positions)
    wall_distances = _compute_wall_distances(environment, positions)
    for i in np.flatnonzero(is_working & (wall_distances < team.radius - tolerance)).tolist():
        start = f"starts[{i}] = {format_position(positions[i, 0], positions[i, 1])}"
        if wall_distances[i] < 0.0:
            raise StartError(
                f"{start} is inside an obstacle or outside the boundary of map {environment.name!r}"
            )
        raise StartError(
            f"{start} is {wall_distances[i]:.3g} m from a wall, "
            f"expected at least the radius of the robot, {team.radius[i]:g} m"
        )
    first, second, distances = find_close_pairs(positions, 2.0 * float(team.radius.max()))
    is_overlapping = distances < team.radius[first] + team.radius[second] - tolerance
    is_checked = (is_working[first] & is_present[second]) | (is_present[first] & is_working[second])
    for k in np.flatnonzero(is_overlapping & is_checked).tolist():
        raise StartError(
            f"starts[{first[k]}] and starts[{second[k]}] are {distances[k]:.3g} m apart: the robots overlap"
        )


def _compute_center_area(environment: Environment, radius: float) -> BaseGeometry:
    """Return the area in which the center of a robot may be, with some clearance from walls."""
    return environment.free.buffer(-(radius + _CLEARANCE_M), join_style="round")


def _compute_wall_distances(environment: Environment, positions: FloatArray) -> FloatArray:
    """Return the distances of positions from the nearest wall, (n,) m; -inf inside a wall."""
    points = shapely.points(positions)
    shapely.prepare(environment.free)
    is_free = shapely.contains_properly(environment.free, points)
    return np.where(is_free, shapely.distance(environment.free.boundary, points), -np.inf)
