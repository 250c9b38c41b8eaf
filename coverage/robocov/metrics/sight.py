"""What robots see of a map: visibility polygons, exact, and the areas that a team covers.

A robot's view is divided at the directions of all corners. Between two neighbouring ones the nearest wall is
one and the same, so that one ray through the middle finds it, and the view there is the triangle of the robot
and the two places where the wall's line meets the directions. No direction is ever shifted by a little.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from robocov.arrays import Array

_PAIRS = 1 << 19
"""Pairs of directions and walls looked at at once, which bounds the memory."""

_QUARTER = 128
"""Sides of a quarter of the polygon that stands for a disc of sensing: its area is 2.5e-5 too small."""


class Walls(NamedTuple):
    """The boundary of a free space.

    Attributes
    ----------
    free : shapely geometry
    start, along : (w, 2) m
        Where the walls begin, and from there to their ends.
    """

    free: BaseGeometry
    start: Array
    along: Array

    @classmethod
    def of(cls, free: BaseGeometry) -> Walls:
        """Return the walls of a free space, of one or several polygons."""
        starts, ends = [np.empty((0, 2))], [np.empty((0, 2))]
        for part in shapely.get_parts(free):
            for ring in (part.exterior, *part.interiors):
                corners = np.asarray(ring.coords)
                starts.append(corners[:-1])
                ends.append(corners[1:])
        start = np.concatenate(starts)
        return cls(free, start, np.concatenate(ends) - start)


def visibility_polygon(walls: Walls, place: Array) -> BaseGeometry:
    """Return what is seen from a place, (2,) m, within the free space: a polygon, empty from outside.

    Examples
    --------
    An L of three squares of 1 m, seen from the middle of one end:

    >>> room = shapely.Polygon([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)])
    >>> visibility_polygon(Walls.of(room), np.array([0.5, 1.5])).area
    2.5
    """
    if not shapely.contains_xy(walls.free, *place):
        return shapely.Polygon()
    start = walls.start - place
    turns = np.unique(np.arctan2(start[:, 1], start[:, 0]))
    begin, end = turns, np.append(turns[1:], turns[0] + 2.0 * np.pi)
    wall = _nearest(start, walls.along, (begin + end) / 2.0)
    seen = wall >= 0
    begin, end, wall = begin[seen], end[seen], wall[seen]
    a, along = start[wall], walls.along[wall]
    corners = np.stack([_meeting(a, along, begin), _meeting(a, along, end)], axis=1)
    view = shapely.Polygon(place + corners.reshape(-1, 2))
    # it may touch itself where corners are in line
    return view if shapely.is_valid(view) else shapely.make_valid(view)


def _nearest(start: Array, along: Array, angles: Array) -> Array:
    """Return the number of the wall that rays from the origin at (m,) angles hit first, -1 for none."""
    wall = np.full(len(angles), -1)
    size = max(1, _PAIRS // max(len(start), 1))
    for k in range(0, len(angles), size):
        part = angles[k : k + size, None]
        x, y = np.cos(part), np.sin(part)
        # the origin, the ray and the wall: a + s along = t (x, y)
        across = x * along[:, 1] - y * along[:, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (start[:, 0] * along[:, 1] - start[:, 1] * along[:, 0]) / across
            s = (start[:, 0] * y - start[:, 1] * x) / across
        t = np.where((s >= 0.0) & (s <= 1.0) & (t > 0.0), t, np.inf)
        nearest = t.argmin(axis=1)
        wall[k : k + size] = np.where(np.isfinite(t[np.arange(len(t)), nearest]), nearest, -1)
    return wall


def _meeting(start: Array, along: Array, angles: Array) -> Array:
    """Return where rays at (m,) angles meet the lines of walls, (m, 2), within the walls."""
    x, y = np.cos(angles), np.sin(angles)
    across = x * along[:, 1] - y * along[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        s = (start[:, 0] * y - start[:, 1] * x) / across
    s = np.where(np.isfinite(s), np.clip(s, 0.0, 1.0), 0.0)
    return np.asarray(start + s[:, None] * along)


class Covered(NamedTuple):
    """How much of the free space a team covers, in m².

    Attributes
    ----------
    sensed : float
        Within the sensing range of a robot and in its line of sight.
    within_range : float
        Within the sensing range of a robot, walls or not: Gage's blanket coverage by discs.
    visible : float
        In line of sight of a robot at any distance: the guards of an art gallery.
    """

    sensed: float
    within_range: float
    visible: float


def covered(walls: Walls, places: Array, ranges: Array) -> Covered:
    """Return what robots at (n, 2) m with sensing ranges (n,) m cover of the free space.

    Areas in line of sight are exact up to rounding where nothing limits the range; discs are polygons of 512
    sides, whose areas are 2.5e-5 too small. A robot that is not in the free space covers nothing.

    Source: D. Gage, *Command control for many-robot systems*, 1992, for blanket coverage; J. O'Rourke, *Art
    Gallery Theorems and Algorithms*, 1987, for the other.
    """
    inside = shapely.contains_xy(walls.free, *places.T)
    places, ranges = places[inside], ranges[inside]
    if not len(places):
        return Covered(0.0, 0.0, 0.0)
    views = [visibility_polygon(walls, place) for place in places]
    visible = float(shapely.union_all(views).area)
    if np.isinf(ranges).all():
        whole = [
            part for part in shapely.get_parts(walls.free) if shapely.intersects_xy(part, *places.T).any()
        ]
        return Covered(visible, float(sum(part.area for part in whole)), visible)
    far = float(np.hypot(*np.ptp(walls.start, axis=0)))
    discs = shapely.buffer(shapely.points(places), np.minimum(ranges, far), quad_segs=_QUARTER)
    sensed = float(shapely.union_all([view & disc for view, disc in zip(views, discs, strict=True)]).area)
    return Covered(sensed, float((shapely.union_all(discs) & walls.free).area), visible)
