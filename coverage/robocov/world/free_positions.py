"""Room for robots: whether they fit, where they go when an obstacle appears on them, where one more fits."""

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from robocov.arrays import Array, BoolArray
from robocov.environment import Environment, Point
from robocov.errors import StartError
from robocov.observation.neighbours import find_close_pairs
from robocov.team import Team

_GAP = 1e-3  # room in metres that is left beside what a robot is moved away from
_ROUNDS = 300  # after so many the robots that push each other are taken to have no room


def relocate_robots(environment: Environment, positions: Array, team: Team) -> Array:
    """Return places, (n, 2) m, where all robots fit, near where they are; StartError where there is none."""
    places = np.array(positions, dtype=float)
    room = {radius: _room(environment, radius) for radius in np.unique(team.radius).tolist()}
    for radius, inset in room.items():
        if inset.is_empty:
            robot = int(np.argmax(team.radius == radius)) + 1
            raise StartError(f"robot {robot} of radius {radius:g} m fits nowhere in map {environment.name!r}")
    for _ in range(_ROUNDS):
        for robot in np.flatnonzero(_wall_distance(environment, places) < team.radius).tolist():
            line = shapely.shortest_line(room[float(team.radius[robot])], shapely.Point(places[robot]))
            places[robot] = line.coords[0]
        first, second, distance = find_close_pairs(places, 2.0 * float(team.radius.max()))
        missing = team.radius[first] + team.radius[second] - distance
        clash = np.flatnonzero((missing > 0.0) & (first < second))
        if not len(clash):
            return places
        first, second, missing, distance = first[clash], second[clash], missing[clash], distance[clash]
        apart = (places[second] - places[first]) / np.where(distance > 0.0, distance, 1.0)[:, None]
        # robots in one place have no direction apart: one of their own each
        angle = 2.399963 * (first + second)
        apart[distance == 0.0] = np.column_stack([np.cos(angle), np.sin(angle)])[distance == 0.0]
        step = 0.5 * (missing + _GAP)[:, None] * apart
        np.add.at(places, first, -step)
        np.add.at(places, second, step)
    pair = f"robots {first[0] + 1} and {second[0] + 1}"
    raise StartError(f"{pair} have no room beside each other in map {environment.name!r}")


def find_free_position(
    environment: Environment, radius: float, others: Array, point: Point, radii: Array | None = None
) -> Point:
    """Return the place nearest to a point where a robot fits beside others, (n, 2) m, by default as large.

    Raises StartError when there is none.
    """
    beside = np.full(len(others), radius) if radii is None else radii
    apart = np.hypot(*(others - point).T)
    if _wall_distance(environment, np.array([point]))[0] >= radius and (apart >= radius + beside).all():
        return float(point[0]), float(point[1])
    room = _room(environment, radius)
    if len(others):
        # a buffer's polygon is inscribed, and room is wanted all round
        reach = (radius + beside + _GAP) / np.cos(np.pi / 64)
        room = room.difference(shapely.union_all(shapely.buffer(shapely.points(others), reach, quad_segs=16)))
    if room.is_empty:
        raise StartError("there is no room for a robot there")
    x, y = shapely.shortest_line(room, shapely.Point(point)).coords[0]
    return x, y


def require_free_starts(
    environment: Environment, positions: Array, team: Team, slack: float, there: BoolArray | None = None
) -> None:
    """Raise StartError when a robot that is there is in a wall or another one by more than `slack` metres."""
    there = np.ones(len(positions), dtype=bool) if there is None else there
    for i in np.flatnonzero(~np.isfinite(positions).all(axis=1)).tolist():
        raise StartError(f"starts[{i}] = {positions[i].tolist()}: finite numbers were wanted")
    wall = _wall_distance(environment, positions)
    for i in np.flatnonzero(there & (wall < team.radius - slack)).tolist():
        place = f"starts[{i}] = [{positions[i, 0]:g}, {positions[i, 1]:g}]"
        wrong = f"{wall[i]:.3g} m from a wall, but a robot of radius {team.radius[i]:g} m must fit"
        if wall[i] < 0.0:
            wrong = f"inside an obstacle or outside the boundary of map {environment.name!r}"
        raise StartError(f"{place} is {wrong}")
    first, second, distance = find_close_pairs(positions, 2.0 * float(team.radius.max()))
    clash = distance < team.radius[first] + team.radius[second] - slack
    for k in np.flatnonzero(clash & there[first] & there[second]).tolist():
        pair = f"starts[{first[k]}] and starts[{second[k]}]"
        raise StartError(f"{pair} are {distance[k]:.3g} m apart: the robots overlap")


def _room(environment: Environment, radius: float) -> BaseGeometry:
    """Return where a robot fits beside the walls."""
    return environment.free.buffer(-(radius + _GAP), join_style="round")


def _wall_distance(environment: Environment, places: Array) -> Array:
    """Return how far places are from a wall, (n,) m; -inf within one."""
    points = shapely.points(places)
    shapely.prepare(environment.free)
    inside = shapely.contains_properly(environment.free, points)
    return np.where(inside, shapely.distance(environment.free.boundary, points), -np.inf)
