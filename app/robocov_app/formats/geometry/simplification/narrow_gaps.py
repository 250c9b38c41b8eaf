"""Gaps between walls through which a robot fitted before the walls were moved, but no longer fits."""

import numpy as np
import shapely
from shapely import MultiPolygon, STRtree

from robocov.typing import FloatArray, IntArray

_SIDES_AT_ONCE = 2048
"""Number of sides compared at once, to limit the memory."""
_MAX_GAPS = 200_000
_MAX_RAY_CROSSINGS = 300_000_000
"""Maximum number of sides crossed by the rays that decide which points are inside."""
_PASSABLE = 1 + 1e-6
"""A robot fits through a gap that is wider than the robot by this factor."""


def count_ray_crossings(sides: FloatArray, y: FloatArray) -> int:
    """Count how often sides cross horizontal lines.

    The count is the cost of deciding which points at these heights are inside the sides.

    Parameters
    ----------
    sides : (n,) array of LineString
    y : (m,) array, m
        Heights of the horizontal lines.
    """
    bounds = shapely.bounds(sides)
    low = np.sort(bounds[:, 1])
    high = np.sort(bounds[:, 3])
    return int((np.searchsorted(low, y, side="right") - np.searchsorted(high, y)).sum())


def find_closed_gaps(
    sides: FloatArray, paths: FloatArray, free: MultiPolygon, width: float, moved: float
) -> tuple[IntArray, FloatArray] | None:
    """Find gaps that are now too narrow for a robot, but were wide enough before.

    A gap is where two walls face each other across the free space.

    Parameters
    ----------
    sides : (m, 2, 2) array, m
        Start and end of each side of the simplified walls.
    paths : (m,) array of LineString, m
        The run of the original walls that each side represents.
    free : MultiPolygon, m
        The simplified free space.
    width : float, m
        Diameter of a robot.
    moved : float, m
        Upper limit of the distance by which walls have moved.

    Returns
    -------
    pairs : (p, 2) array of int
        Indices of the two sides that form each gap.
    middles : (p, 2) array, m
        Midpoints of the gaps.

    None is returned if there are too many gaps to check.
    """
    lines = shapely.linestrings(sides)
    pairs = _find_narrow_pairs(sides, lines, width, moved)
    if pairs is None:
        return None
    shortest = shapely.shortest_line(lines[pairs[:, 0]], lines[pairs[:, 1]])
    middles = shapely.get_coordinates(shortest).reshape(-1, 2, 2).mean(axis=1)
    if count_ray_crossings(lines, middles[:, 1]) > _MAX_RAY_CROSSINGS:
        return None
    shapely.prepare(free)
    is_across = shapely.contains_xy(free, *middles.T)
    pairs = pairs[is_across]
    middles = middles[is_across]
    reach = width / 2 + 2 * moved
    windows = shapely.box(*(middles - reach).T, *(middles + reach).T)
    first = shapely.intersection(paths[pairs[:, 0]], windows)
    second = shapely.intersection(paths[pairs[:, 1]], windows)
    # A wall outside the window was farther away: its distance is nan.
    distance_before = np.nan_to_num(shapely.distance(first, second), nan=np.inf)
    is_closed = distance_before > width * _PASSABLE
    return pairs[is_closed], middles[is_closed]


def _find_narrow_pairs(sides: FloatArray, lines: FloatArray, width: float, moved: float) -> IntArray | None:
    """Return the pairs of sides, (p, 2), between which a robot does not fit; None if there are too many.

    Pairs that were too close before the walls moved are left out.
    """
    tree = STRtree(lines)
    pairs = np.empty((0, 2), dtype=np.intp)
    for start in range(0, len(lines), _SIDES_AT_ONCE):
        chunk = lines[start : start + _SIDES_AT_ONCE]
        first, second = tree.query(chunk, predicate="dwithin", distance=width)
        first += start
        # Adjacent sides meet at a corner and form no gap.
        is_apart = (first < second) & (sides[first, 1] != sides[second, 0]).any(axis=1)
        is_apart &= (sides[second, 1] != sides[first, 0]).any(axis=1)
        first = first[is_apart]
        second = second[is_apart]
        distance = shapely.distance(lines[first], lines[second])
        # Each wall moved by at most `moved`: walls that are even closer were too close before.
        is_narrow = (distance < width) & (distance > width - 2 * moved)
        pairs = np.concatenate([pairs, np.column_stack([first[is_narrow], second[is_narrow]])])
        if len(pairs) > _MAX_GAPS:
            return None
    return pairs
