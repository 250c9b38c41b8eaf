"""Making room: where robots go when an obstacle appears on top of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import shapely

from robocov.errors import StartError
from robocov.neighbours import Neighbours

if TYPE_CHECKING:
    from robocov.arrays import Array, BoolArray
    from robocov.environment import Environment
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


def _fits(environment: Environment, places: Array, team: Team) -> BoolArray:
    """Return which robots touch no wall."""
    points = shapely.points(places)
    inside = shapely.contains_properly(environment.free, points)
    return np.asarray(inside & (shapely.distance(environment.free.boundary, points) >= team.radius))
