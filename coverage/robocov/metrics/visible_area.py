"""Exact visibility polygons, and the area of a map that a team sees.

The view of a robot is divided into sectors, at the directions of the ends of all walls that face the robot.
In each sector, only one wall is visible, and a ray through the middle of the sector finds this wall. The part
of the view in the sector is the triangle between the robot and the two points at which the sides of the
sector meet the wall.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from robocov.compiled import kernel
from robocov.geodesic.angular_index import (
    NO_ENTRY,
    NO_SPACE,
    ONLY_SOURCE,
    AngularWallIndex,
    find_angular_bin,
    index_walls,
)
from robocov.geodesic.integer_grid import Grid
from robocov.geodesic.walls import END_X, END_Y, NO_WALL, START_X, START_Y, Walls, build_walls
from robocov.typing import FloatArray, IntArray

_BIN_COUNT = 512
"""Number of angular bins of a robot's view, a power of 2."""
_INITIAL_ENTRIES_PER_BIN = 64
"""Initial number of entries of the index of walls, per bin. It is doubled whenever it is too small."""
_QUADRANT_SEGMENTS = 128
"""Sides per quadrant of the polygon that represents a sensing disc, for a relative error of the area of
2.5e-5."""


class CoveredAreas(NamedTuple):
    """Areas of the free space that a team covers, m²."""

    sensed: float
    """Area within the sensing range of a robot and in its line of sight."""
    within_range: float
    """Area within the sensing range of a robot, regardless of walls.

    If the ranges of all robots are infinite, only components of the free space that contain a robot count.
    """
    visible: float
    """Area in the line of sight of a robot, at any distance."""


class _Sectors(NamedTuple):
    """Sectors of a view, counter-clockwise, (s,) each. In each sector, one wall is visible."""

    starts: FloatArray
    """Angle at which each sector starts, rad from +x."""
    ends: FloatArray
    """Angle at which each sector ends, rad from +x."""
    walls: IntArray
    """Index of the wall that is visible in each sector."""


def compute_covered_areas(free: BaseGeometry, positions: FloatArray, ranges: FloatArray) -> CoveredAreas:
    """Compute the areas that robots cover.

    Parameters
    ----------
    free : polygon or multipolygon, m
        The free space.
    positions : (n, 2) array, m
        Positions of the robots. A robot outside the free space covers nothing.
    ranges : (n,) array, m
        Sensing ranges, which may be infinite.

    Returns
    -------
    CoveredAreas
        Areas that at least one robot covers.

    Notes
    -----
    Areas in the line of sight are exact except for rounding errors if all ranges are infinite. Finite sensing
    discs are represented by polygons with 512 sides, whose areas are too small by a fraction of 2.5e-5.
    Sources: D. Gage, *Command control for many-robot systems*, 1992, for blanket coverage by discs;
    J. O'Rourke, *Art Gallery Theorems and Algorithms*, 1987, for areas in the line of sight.

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
    diagonal = float(np.hypot(high_x - low_x, high_y - low_y))
    finite_ranges = np.minimum(ranges, diagonal)
    discs = shapely.buffer(shapely.points(positions), finite_ranges, quad_segs=_QUADRANT_SEGMENTS)
    sensed = float(shapely.union_all(shapely.intersection(views, discs)).area)
    within_range = float((shapely.union_all(discs) & free).area)
    return CoveredAreas(sensed, within_range, visible)


def compute_visibility_polygons(free: BaseGeometry, positions: FloatArray) -> Iterator[BaseGeometry]:
    """Compute the visibility polygon of each position.

    Parameters
    ----------
    free : polygon or multipolygon, m
        The free space.
    positions : (n, 2) array, m
        Points inside the free space.

    Yields
    ------
    polygon or multipolygon, m
        Part of the free space that is visible from a position.

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
    # Geodesics need only walls that can hide free space. The outer boundary hides none, but it bounds the
    # view.
    walls.can_hide_free_space[:] = True
    index = AngularWallIndex.allocate(1, _BIN_COUNT, _INITIAL_ENTRIES_PER_BIN * _BIN_COUNT)
    for position in grid.snap(positions):
        index, entry_count = _index_walls(walls, index, position)
        sectors = _find_sectors(walls, index, entry_count, position)
        relative_walls = walls.ends[sectors.walls] - np.tile(position, 2)
        first_corners = _intersect(relative_walls, sectors.starts)
        second_corners = _intersect(relative_walls, sectors.ends)
        corners = np.stack([first_corners, second_corners], axis=1).reshape(-1, 2)
        view = shapely.Polygon(grid.to_meters(position + corners))
        # If corners are in line with the robot, the polygon may touch itself.
        yield view if shapely.is_valid(view) else shapely.make_valid(view)


def _index_walls(walls: Walls, index: AngularWallIndex, position: FloatArray) -> tuple[AngularWallIndex, int]:
    """Index the walls around a position; return the index, enlarged if needed, and its number of entries."""
    x, y = position
    entry_count = index_walls(walls, index, x, y)
    while entry_count == NO_SPACE:
        index = AngularWallIndex.allocate(1, _BIN_COUNT, 2 * len(index.entry_walls))
        entry_count = index_walls(walls, index, x, y)
    return index, entry_count


def _find_sectors(walls: Walls, index: AngularWallIndex, entry_count: int, position: FloatArray) -> _Sectors:
    """Find the sectors of the view from a position, whose index of walls has `entry_count` entries.

    The visible wall can only change in the directions of the ends of walls. In each sector between two such
    directions, the visible wall is therefore the one that a ray through the middle hits first.
    """
    facing_walls = np.unique(index.entry_walls[:entry_count])
    wall_ends = walls.ends[facing_walls].reshape(-1, 2) - position
    start_angles = np.unique(np.arctan2(wall_ends[:, 1], wall_ends[:, 0]))
    end_angles = np.append(start_angles[1:], start_angles[0] + 2.0 * np.pi)
    middle_angles = (start_angles + end_angles) / 2.0
    visible_walls = np.empty(len(start_angles), dtype=np.int64)
    rays = np.column_stack([np.cos(middle_angles), np.sin(middle_angles)])
    _find_nearest_walls(walls.ends, index, rays, visible_walls)
    is_bounded = visible_walls != NO_WALL
    start_angles = start_angles[is_bounded]
    end_angles = end_angles[is_bounded]
    visible_walls = visible_walls[is_bounded]
    # Merge successive sectors with the same wall.
    first = np.flatnonzero(visible_walls != np.roll(visible_walls, 1))
    last = np.roll(first, -1) - 1
    return _Sectors(starts=start_angles[first], ends=end_angles[last], walls=visible_walls[first])


@kernel
def _find_nearest_walls(
    ends: FloatArray, index: AngularWallIndex, rays: FloatArray, nearest: IntArray
) -> None:
    """Find the wall that each of (m, 2) rays from the source hits first.

    The indices of the walls, or `NO_WALL`, are written to `nearest`, (m,).
    """
    for m in range(len(rays)):
        x = rays[m, 0]
        y = rays[m, 1]
        nearest[m] = NO_WALL
        min_distance = np.inf
        # The walls of a bin are a linked list, from its last entry to the first one.
        entry = index.heads[ONLY_SOURCE, find_angular_bin(_BIN_COUNT, x, y)]
        while entry != NO_ENTRY:
            wall = index.entry_walls[entry]
            # The vector a leads from the source to the start of the wall, and u from there to its end.
            ax = ends[wall, START_X] - index.positions[ONLY_SOURCE, 0]
            ay = ends[wall, START_Y] - index.positions[ONLY_SOURCE, 1]
            ux = ends[wall, END_X] - ends[wall, START_X]
            uy = ends[wall, END_Y] - ends[wall, START_Y]
            # The ray meets the line of the wall at a + s u = t (x, y), solved for s and t by Cramer's rule.
            determinant = x * uy - y * ux
            if determinant != 0.0:
                t = (ax * uy - ay * ux) / determinant
                s = (ax * y - ay * x) / determinant
                if 0.0 <= s <= 1.0 and 0.0 < t < min_distance:
                    min_distance = t
                    nearest[m] = wall
            entry = index.previous_entries[entry]


def _intersect(walls: FloatArray, angles: FloatArray) -> FloatArray:
    """Return the points at which rays from the origin meet walls, one ray for each of (m, 4) walls, (m, 2).

    If rounding errors put a point beyond an end of its wall, the end is returned.
    """
    x = np.cos(angles)
    y = np.sin(angles)
    starts = walls[:, [START_X, START_Y]]
    directions = walls[:, [END_X, END_Y]] - starts
    determinants = x * directions[:, 1] - y * directions[:, 0]
    # For a wall that is parallel to its ray, the division by infinity gives 0, which is the start of the
    # wall.
    fractions = (starts[:, 0] * y - starts[:, 1] * x) / np.where(determinants == 0.0, np.inf, determinants)
    return np.asarray(starts + fractions.clip(0.0, 1.0)[:, None] * directions)
