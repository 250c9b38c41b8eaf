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

from robocov.arrays import Array, IntArray
from robocov.compiled import inner_kernel

_QUARTER = 128
"""Sides of a quarter of the polygon that stands for a disc of sensing: its area is 2.5e-5 too small."""


def visibility_polygon(free: BaseGeometry, place: Array) -> BaseGeometry:
    """Return what is seen from a place, (2,) m, within the free space: a polygon, empty from outside.

    Examples
    --------
    An L of three squares of 1 m, seen from the middle of one end:

    >>> room = shapely.Polygon([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)])
    >>> visibility_polygon(room, np.array([0.5, 1.5])).area
    2.5
    """
    if not shapely.contains_xy(free, *place):
        return shapely.Polygon()
    rings = map(shapely.get_coordinates, shapely.get_rings(shapely.get_parts(free)))
    walls = np.concatenate([np.hstack([ring[:-1] - place, np.diff(ring, axis=0)]) for ring in rings])
    turns = np.unique(np.arctan2(walls[:, 1], walls[:, 0]))
    begin, end = turns, np.append(turns[1:], turns[0] + 2.0 * np.pi)
    middle, wall = (begin + end) / 2.0, np.empty(len(turns), dtype=np.int64)
    _nearest_walls(walls, np.column_stack([np.cos(middle), np.sin(middle)]), wall)
    seen = wall >= 0
    corners = [_meeting(walls[wall[seen]], angles[seen]) for angles in (begin, end)]
    view = shapely.Polygon(place + np.stack(corners, axis=1).reshape(-1, 2))
    # it may touch itself where corners are in line
    return view if shapely.is_valid(view) else shapely.make_valid(view)


@inner_kernel
def _nearest_walls(walls: Array, rays: Array, nearest: IntArray) -> None:
    """Write which of (w, 4) walls, start and along, (m, 2) rays from the origin hit first, -1 for none."""
    for m in range(len(rays)):
        x, y = rays[m, 0], rays[m, 1]
        least, nearest[m] = np.inf, -1
        for k in range(len(walls)):
            ax, ay, ux, uy = walls[k, 0], walls[k, 1], walls[k, 2], walls[k, 3]
            # the origin, the ray and the wall: a + s u = t (x, y)
            across = x * uy - y * ux
            if across != 0.0:
                t, s = (ax * uy - ay * ux) / across, (ax * y - ay * x) / across
                if 0.0 <= s <= 1.0 and 0.0 < t < least:
                    least, nearest[m] = t, k


def _meeting(walls: Array, angles: Array) -> Array:
    """Return where rays at (m,) angles meet the lines of walls, (m, 2), within the walls."""
    x, y, along = np.cos(angles), np.sin(angles), walls[:, 2:]
    across = x * along[:, 1] - y * along[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        s = (walls[:, 0] * y - walls[:, 1] * x) / across
    s = np.where(np.isfinite(s), np.clip(s, 0.0, 1.0), 0.0)
    return np.asarray(walls[:, :2] + s[:, None] * along)


class Covered(NamedTuple):
    """Area of the free space that a team covers, m²."""

    sensed: float
    """Within the sensing range of a robot and in its line of sight."""
    within_range: float
    """Within the sensing range of a robot, walls or not: Gage's blanket coverage by discs."""
    visible: float
    """In line of sight of a robot at any distance: the guards of an art gallery."""


def covered(free: BaseGeometry, places: Array, ranges: Array) -> Covered:
    """Return what robots at (n, 2) m with sensing ranges (n,) m cover of the free space.

    Areas in line of sight are exact up to rounding where nothing limits the range; discs are polygons of 512
    sides, whose areas are 2.5e-5 too small. A robot that is not in the free space covers nothing.

    Source: D. Gage, *Command control for many-robot systems*, 1992, for blanket coverage; J. O'Rourke, *Art
    Gallery Theorems and Algorithms*, 1987, for the other.
    """
    inside = shapely.contains_xy(free, *places.T)
    places, ranges = places[inside], ranges[inside]
    if not len(places):
        return Covered(0.0, 0.0, 0.0)
    views = [visibility_polygon(free, place) for place in places]
    visible = float(shapely.union_all(views).area)
    if np.isinf(ranges).all():
        whole = [part for part in shapely.get_parts(free) if shapely.intersects_xy(part, *places.T).any()]
        return Covered(visible, float(sum(part.area for part in whole)), visible)
    low_x, low_y, high_x, high_y = free.bounds
    far = float(np.hypot(high_x - low_x, high_y - low_y))
    discs = shapely.buffer(shapely.points(places), np.minimum(ranges, far), quad_segs=_QUARTER)
    sensed = float(shapely.union_all([view & disc for view, disc in zip(views, discs, strict=True)]).area)
    return Covered(sensed, float((shapely.union_all(discs) & free).area), visible)
