"""Exact visibility polygons, and the area of a map that a team sees.

A robot's view is divided at the directions of the ends of all walls that face it. Between two neighbouring
ones the nearest wall is one and the same, so that one ray through the middle finds it, and the view there is
the triangle of the robot and the two places where the wall's line meets the directions. No direction is ever
shifted by a little.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from robocov.arrays import Array, IntArray
from robocov.compiled import kernel
from robocov.geodesic.angular_index import AngularWallIndex, add_walls, compute_pseudo_angle
from robocov.geodesic.walls import Grid, build_walls

_BINS = 512
"""Angular bins of a robot's view."""

_QUARTER = 128
"""Sides of a quarter of the polygon that stands for a disc of sensing: its area is 2.5e-5 too small."""


def views(free: BaseGeometry, places: Array) -> Iterator[BaseGeometry]:
    """Yield what is seen from each of (n, 2) places, m, within the free space, as a polygon.

    An L of three squares of 1 m, seen from the middle of one end:

    >>> room = shapely.Polygon([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)])
    >>> round(next(views(room, np.array([[0.5, 1.5]]))).area, 9)
    2.5
    """
    low_x, low_y, high_x, high_y = free.bounds
    grid = Grid.from_square(np.array([low_x, low_y]), max(high_x - low_x, high_y - low_y))
    parts = shapely.orient_polygons(shapely.get_parts(free))
    walls = build_walls(shapely.transform(shapely.multipolygons(parts), grid.snap))
    # the hull of the map hides nothing, but is seen
    walls.facts[:, 2] = 1
    index = AngularWallIndex.allocate(1, _BINS, 64 * _BINS)
    for place in grid.snap(places):
        while (used := add_walls(walls, index, 0, place[0], place[1], np.inf, 0)) < 0:
            index = AngularWallIndex.allocate(1, _BINS, 2 * len(index.entries))
        facing = walls.ends[np.unique(index.entries[:used, 0])].reshape(-1, 2) - place
        turns = np.unique(np.arctan2(facing[:, 1], facing[:, 0]))
        begin, end = turns, np.append(turns[1:], turns[0] + 2.0 * np.pi)
        middle, wall = (begin + end) / 2.0, np.empty(len(turns), dtype=np.int64)
        _nearest_walls(walls.ends, index, np.column_stack([np.cos(middle), np.sin(middle)]), wall)
        seen = wall >= 0
        begin, end, wall = begin[seen], end[seen], wall[seen]
        first = np.flatnonzero(wall != np.roll(wall, 1))
        last = np.roll(first, -1) - 1
        walls_seen = walls.ends[wall[first]] - np.tile(place, 2)
        corners = [_meeting(walls_seen, angles) for angles in (begin[first], end[last])]
        view = shapely.Polygon(grid.to_metres(place + np.stack(corners, axis=1).reshape(-1, 2)))
        # it may touch itself where corners are in line
        yield view if shapely.is_valid(view) else shapely.make_valid(view)


@kernel
def _nearest_walls(ends: Array, index: AngularWallIndex, rays: Array, nearest: IntArray) -> None:
    """Write which wall each of (m, 2) rays from the source hits first, -1 for none."""
    for m in range(len(rays)):
        x, y = rays[m, 0], rays[m, 1]
        least, nearest[m] = np.inf, -1
        entry = index.head[0, int(compute_pseudo_angle(x, y) * (_BINS * 0.25)) & (_BINS - 1)]
        while entry >= 0:
            wall = index.entries[entry, 0]
            ax, ay = ends[wall, 0] - index.sources[0, 0], ends[wall, 1] - index.sources[0, 1]
            ux, uy = ends[wall, 2] - ends[wall, 0], ends[wall, 3] - ends[wall, 1]
            # the source, the ray and the wall: a + s u = t (x, y)
            across = x * uy - y * ux
            if across != 0.0:
                t, s = (ax * uy - ay * ux) / across, (ax * y - ay * x) / across
                if 0.0 <= s <= 1.0 and 0.0 < t < least:
                    least, nearest[m] = t, wall
            entry = index.entries[entry, 1]


def _meeting(walls: Array, angles: Array) -> Array:
    """Return where rays from the origin at (m,) angles meet the lines of (m, 4) walls, within the walls."""
    x, y, along = np.cos(angles), np.sin(angles), walls[:, 2:] - walls[:, :2]
    across = x * along[:, 1] - y * along[:, 0]
    s = (walls[:, 0] * y - walls[:, 1] * x) / np.where(across == 0.0, np.inf, across)
    return np.asarray(walls[:, :2] + s.clip(0.0, 1.0)[:, None] * along)


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
    seen = list(views(free, places))
    visible = float(shapely.union_all(seen).area)
    if np.isinf(ranges).all():
        whole = [part for part in shapely.get_parts(free) if shapely.intersects_xy(part, *places.T).any()]
        return Covered(visible, float(sum(part.area for part in whole)), visible)
    low_x, low_y, high_x, high_y = free.bounds
    far = float(np.hypot(high_x - low_x, high_y - low_y))
    discs = shapely.buffer(shapely.points(places), np.minimum(ranges, far), quad_segs=_QUARTER)
    sensed = float(shapely.union_all(shapely.intersection(seen, discs)).area)
    return Covered(sensed, float((shapely.union_all(discs) & free).area), visible)
