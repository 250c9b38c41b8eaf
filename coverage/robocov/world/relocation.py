"""Making room: where robots go when an obstacle appears on top of them, or where one more fits."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import shapely

from robocov.errors import StartError
from robocov.observation.neighbours import Neighbours

if TYPE_CHECKING:
    from robocov.arrays import Array, BoolArray
    from robocov.environment import Environment, Point
    from robocov.robots import Team

_GAP = 1e-3
"""Room in metres that is left beside what a robot is moved away from."""

_ROUNDS = 300
"""After so many the robots that push each other are taken to have no room."""


def relocated(environment: Environment, positions: Array, team: Team) -> Array:
    """Return places where all robots fit, near where they are.

    Who fits stays where it is, unless others that have to go somewhere push it.

    Parameters
    ----------
    environment : Environment
    positions : (n, 2) m
        Anywhere.
    team : Team

    Returns
    -------
    (n, 2) m

    Raises
    ------
    StartError
        When there is no room; the message names a robot.
    """
    places = np.array(positions, dtype=float)
    room = {
        radius: environment.free.buffer(-(radius + _GAP), join_style="round")
        for radius in np.unique(team.radius).tolist()
    }
    for radius, inset in room.items():
        if inset.is_empty:
            robot = int(np.argmax(team.radius == radius)) + 1
            raise StartError(f"robot {robot} of radius {radius:g} m fits nowhere in map {environment.name!r}")
    crowd = Neighbours(len(places))
    reach = 2.0 * float(team.radius.max())
    for _ in range(_ROUNDS):
        stuck = ~_fits(environment, places, team)
        for robot in np.flatnonzero(stuck).tolist():
            inset = room[float(team.radius[robot])]
            line = shapely.shortest_line(inset, shapely.Point(places[robot]))
            places[robot] = np.asarray(line.coords)[0]
        first, second, distance = crowd.closer_than(places, reach)
        missing = team.radius[first] + team.radius[second] - distance
        clash = np.flatnonzero((missing > 0.0) & (first < second))
        if not len(clash):
            return places
        first, second, missing, distance = first[clash], second[clash], missing[clash], distance[clash]
        # robots in one place have no direction apart: one of their own each
        angle = 2.399963 * (first + second)
        apart = np.where(
            (distance > 0.0)[:, None],
            (places[second] - places[first]) / np.where(distance > 0.0, distance, 1.0)[:, None],
            np.column_stack([np.cos(angle), np.sin(angle)]),
        )
        step = 0.5 * (missing + _GAP)[:, None] * apart
        np.add.at(places, first, -step)
        np.add.at(places, second, step)
    pair = f"robots {first[0] + 1} and {second[0] + 1}"
    raise StartError(f"{pair} have no room beside each other in map {environment.name!r}")


def nearest_free(
    environment: Environment, radius: float, others: Array, point: Point, radii: Array | None = None
) -> Point:
    """Return the place nearest to a point where a robot fits, the others staying where they are.

    Parameters
    ----------
    environment : Environment
    radius : float, m
        Of the robot.
    others : (n, 2) m
    point : (x, y) m
    radii : (n,) m or None
        Of the others; None: as the robot's.

    Raises
    ------
    StartError
        When there is none.
    """
    place, free = shapely.Point(point), environment.free
    beside = np.full(len(others), radius) if radii is None else radii
    apart = np.hypot(*(others - point).T)
    if (
        shapely.contains_properly(free, place)
        and shapely.distance(free.boundary, place) >= radius
        and (apart >= radius + beside).all()
    ):
        return float(point[0]), float(point[1])
    room = free.buffer(-(radius + _GAP), join_style="round")
    if len(others):
        # a buffer's polygon is inscribed, and room is wanted all round
        reach = (radius + beside + _GAP) / np.cos(np.pi / 64)
        room = room.difference(shapely.union_all(shapely.buffer(shapely.points(others), reach, quad_segs=16)))
    if room.is_empty:
        raise StartError("there is no room for a robot there")
    x, y = np.asarray(shapely.shortest_line(room, place).coords)[0].tolist()
    return x, y


def _fits(environment: Environment, places: Array, team: Team) -> BoolArray:
    """Return which robots touch no wall."""
    points = shapely.points(places)
    inside = shapely.contains_properly(environment.free, points)
    return np.asarray(inside & (shapely.distance(environment.free.boundary, points) >= team.radius))


def check_starts(
    environment: Environment, positions: Array, team: Team, slack: float, there: BoolArray | None = None
) -> None:
    """Check that robots are free, but for so many metres.

    Parameters
    ----------
    environment : Environment
    positions : (n, 2) m
    team : Team
    slack : float, m
    there : (n,) bool or None
        Which robots are looked at; None: all.

    Raises
    ------
    StartError
        When a robot is in a wall or in another one; the message names it.
    """
    there = np.ones(len(positions), dtype=bool) if there is None else there
    for i in np.flatnonzero(~np.isfinite(positions).all(axis=1)).tolist():
        raise StartError(f"starts[{i}] = {positions[i].tolist()}: finite numbers were wanted")
    points = shapely.points(positions)
    inside = shapely.contains_properly(environment.free, points)
    wall = shapely.distance(environment.free.boundary, points)
    for i in np.flatnonzero(there).tolist():
        place = f"starts[{i}] = [{positions[i, 0]:g}, {positions[i, 1]:g}]"
        if not inside[i]:
            raise StartError(
                f"{place} is inside an obstacle or outside the boundary of map {environment.name!r}"
            )
        if wall[i] < team.radius[i] - slack:
            raise StartError(
                f"{place} is {wall[i]:.3g} m from a wall, but a robot of radius {team.radius[i]:g} m must fit"
            )
    first, second, distance = Neighbours(len(positions)).closer_than(
        positions, 2.0 * float(team.radius.max())
    )
    clash = distance < team.radius[first] + team.radius[second] - slack
    clash &= there[first] & there[second]
    if clash.any():
        k = int(np.flatnonzero(clash)[0])
        raise StartError(
            f"starts[{first[k]}] and starts[{second[k]}] are {distance[k]:.3g} m apart: the robots overlap"
        )
