"""Exact visibility polygons, and the area of a map that a team sees.

The view of a robot is divided at the directions of the ends of all walls that face it. Between two successive
directions the nearest wall is the same, and one ray through the middle finds it. The view there is the
triangle between the robot and the two points at which the line of the wall meets the directions.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from robocov.arrays import Array, IntArray
from robocov.compiled import kernel
from robocov.geodesic.angular_index import (
    NO_ENTRY,
    NO_SPACE,
    ONLY_SOURCE,
    AngularWallIndex,
    find_bin,
    index_walls,
)
from robocov.geodesic.grid import Grid
from robocov.geodesic.walls import END_X, END_Y, NO_WALL, START_X, START_Y, Walls, build_walls

_BINS = 512
"""Angular bins of a robot's view, a power of 2."""
_INITIAL_ENTRIES_PER_BIN = 64
"""Initial size of the index of walls, per bin. It is doubled whenever it is too small."""
_QUARTER_SEGMENTS = 128
"""Sides per quadrant of the polygon that represents a sensing disc; its relative area error is 2.5e-5."""


class CoveredAreas(NamedTuple):
    """Areas of the free space that a team covers, m²."""

    sensed: float
    """Within the sensing range of a robot and in its line of sight."""
    within_range: float
    """Within the sensing range of a robot, regardless of walls."""
    visible: float
    """In line of sight of a robot at any distance."""


class _Sectors(NamedTuple):
    """Sectors of a view in which one wall is visible, counter-clockwise, (s,) each."""

    start: Array
    """Angle at which a sector starts, rad from +x."""
    end: Array
    """Angle at which it ends."""
    wall: IntArray
    """Index of the wall."""


def compute_covered_areas(free: BaseGeometry, positions: Array, ranges: Array) -> CoveredAreas:
    """Compute the areas that robots cover.

    Parameters
    ----------
    free : polygon or multipolygon, m
        The free space.
    positions : (n, 2) array, m
        A robot outside the free space covers nothing.
    ranges : (n,) array, m
        Sensing ranges; may be infinite.

    Returns
    -------
    CoveredAreas

    Notes
    -----
    Areas in line of sight are exact up to rounding if the ranges are infinite. Sensing discs are represented
    by polygons with 512 sides, whose areas are too small by a fraction of 2.5e-5. Sources: D. Gage, *Command
    control for many-robot systems*, 1992, for blanket coverage by discs; J. O'Rourke, *Art Gallery Theorems
    and Algorithms*, 1987, for areas in line of sight.

    Examples
    --------
    >>> square = shapely.box(0.0, 0.0, 2.0, 2.0)
    >>> compute_covered_areas(square, np.array([[1.0, 1.0]]), np.array([np.inf]))
    CoveredAreas(sensed=4.0, within_range=4.0, visible=4.0)
    """
    is_inside = shapely.contains_xy(free, positions[:, 0], positions[:, 1])
    positions = positions[is_inside]
    ranges = ranges[is_inside]
    if len(positions) == 0:
        return CoveredAreas(0.0, 0.0, 0.0)
    views = list(compute_visibility_polygons(free, positions))
    visible = float(shapely.union_all(views).area)
    if np.isinf(ranges).all():
        occupied_components = [
            component
            for component in shapely.get_parts(free)
            if shapely.intersects_xy(component, positions[:, 0], positions[:, 1]).any()
        ]
        within_range = float(sum(component.area for component in occupied_components))
        return CoveredAreas(visible, within_range, visible)
    low_x, low_y, high_x, high_y = free.bounds
    diameter = float(np.hypot(high_x - low_x, high_y - low_y))
    discs = shapely.buffer(
        shapely.points(positions), np.minimum(ranges, diameter), quad_segs=_QUARTER_SEGMENTS
    )
    sensed = float(shapely.union_all(shapely.intersection(views, discs)).area)
    within_range = float((shapely.union_all(discs) & free).area)
    return CoveredAreas(sensed, within_range, visible)


def compute_visibility_polygons(free: BaseGeometry, positions: Array) -> Iterator[BaseGeometry]:
    """Yield the visibility polygon of each position.

    Parameters
    ----------
    free : polygon or multipolygon, m
        The free space.
    positions : (n, 2) array, m
        Points in it.

    Yields
    ------
    polygon or multipolygon, m

    Examples
    --------
    An L of three squares of 1 m, seen from the middle of one end:

    >>> room = shapely.Polygon([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)])
    >>> view = next(compute_visibility_polygons(room, np.array([[0.5, 1.5]])))
    >>> round(view.area, 9)
    2.5
    """
    low_x, low_y, high_x, high_y = free.bounds
    grid = Grid.from_square(np.array([low_x, low_y]), max(high_x - low_x, high_y - low_y))
    components = shapely.orient_polygons(shapely.get_parts(free))
    walls = build_walls(shapely.transform(shapely.multipolygons(components), grid.snap))
    # The map's outer hull hides no free space, but it bounds the view.
    walls.can_hide_free_space[:] = True
    index = AngularWallIndex.allocate(1, _BINS, _INITIAL_ENTRIES_PER_BIN * _BINS)
    for position in grid.snap(positions):
        index, entries = _index_walls(walls, index, position)
        sectors = _find_sectors(walls, index, entries, position)
        walls_from_robot = walls.ends[sectors.wall] - np.tile(position, 2)
        first_corners = _intersect(walls_from_robot, sectors.start)
        second_corners = _intersect(walls_from_robot, sectors.end)
        corners = np.stack([first_corners, second_corners], axis=1).reshape(-1, 2)
        view = shapely.Polygon(grid.to_meters(position + corners))
        # The polygon may touch itself where corners are in line with the robot.
        yield view if shapely.is_valid(view) else shapely.make_valid(view)


def _index_walls(walls: Walls, index: AngularWallIndex, position: Array) -> tuple[AngularWallIndex, int]:
    """Index the walls around a position; return the index, enlarged if needed, and its number of entries."""
    x, y = position
    entries = index_walls(walls, index, x, y)
    while entries == NO_SPACE:
        index = AngularWallIndex.allocate(1, _BINS, 2 * len(index.entry_walls))
        entries = index_walls(walls, index, x, y)
    return index, entries


def _find_sectors(walls: Walls, index: AngularWallIndex, entries: int, position: Array) -> _Sectors:
    """Return the sectors of the view from a position; the first `entries` of the index are in use.

    The visible wall can only change in the directions of the ends of walls. In each sector between two such
    directions, the visible wall is therefore the one that a ray through the middle hits first.
    """
    facing_walls = np.unique(index.entry_walls[:entries])
    ends = walls.ends[facing_walls].reshape(-1, 2) - position
    start = np.unique(np.arctan2(ends[:, 1], ends[:, 0]))
    end = np.append(start[1:], start[0] + 2.0 * np.pi)
    middle = (start + end) / 2.0
    wall = np.empty(len(start), dtype=np.int64)
    rays = np.column_stack([np.cos(middle), np.sin(middle)])
    _find_nearest_walls(walls.ends, index, rays, wall)
    is_bounded = wall != NO_WALL
    start = start[is_bounded]
    end = end[is_bounded]
    wall = wall[is_bounded]
    # Successive sectors with the same wall become one.
    first = np.flatnonzero(wall != np.roll(wall, 1))
    last = np.roll(first, -1) - 1
    return _Sectors(start[first], end[last], wall[first])


@kernel
def _find_nearest_walls(ends: Array, index: AngularWallIndex, rays: Array, nearest: IntArray) -> None:
    """Write the index of the wall that each of (m, 2) rays from the source hits first, or `NO_WALL`."""
    for m in range(len(rays)):
        x = rays[m, 0]
        y = rays[m, 1]
        nearest[m] = NO_WALL
        min_distance = np.inf
        # The walls of a bin are a linked list, from its last entry to the first one.
        entry = index.heads[ONLY_SOURCE, find_bin(_BINS, x, y)]
        while entry != NO_ENTRY:
            wall = index.entry_walls[entry]
            # From the source to the start a of the wall, and from there along the wall u.
            ax = ends[wall, START_X] - index.positions[ONLY_SOURCE, 0]
            ay = ends[wall, START_Y] - index.positions[ONLY_SOURCE, 1]
            ux = ends[wall, END_X] - ends[wall, START_X]
            uy = ends[wall, END_Y] - ends[wall, START_Y]
            # The ray meets the line of the wall where a + s u = t (x, y).
            determinant = x * uy - y * ux
            if determinant != 0.0:
                t = (ax * uy - ay * ux) / determinant
                s = (ax * y - ay * x) / determinant
                if 0.0 <= s <= 1.0 and 0.0 < t < min_distance:
                    min_distance = t
                    nearest[m] = wall
            entry = index.previous_entries[entry]


def _intersect(walls: Array, angles: Array) -> Array:
    """Return where rays from the origin meet (m, 4) walls, (m, 2); clipped to the ends of the walls."""
    x = np.cos(angles)
    y = np.sin(angles)
    starts = walls[:, [START_X, START_Y]]
    along = walls[:, [END_X, END_Y]] - starts
    determinant = x * along[:, 1] - y * along[:, 0]
    # On a wall that is parallel to its ray, s is 0, which is the start of the wall.
    s = (starts[:, 0] * y - starts[:, 1] * x) / np.where(determinant == 0.0, np.inf, determinant)
    return np.asarray(starts + s.clip(0.0, 1.0)[:, None] * along)
