"""Gaps that a robot passed before walls moved, and does not pass now."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import shapely
from shapely import MultiPolygon, STRtree

from robocov.arrays.grouping import ranges

if TYPE_CHECKING:
    from shapely import Polygon

    from robocov.arrays import Array, IntArray

_CHUNK = 2048
"""Sides that are looked at together, which bounds the memory."""

_CLEARLY = 1 + 1e-6
"""A gap of just a robot's diameter is none."""


def rooms(free: MultiPolygon, radius: float) -> list[Polygon]:
    """Return where the centre of a robot may be, one polygon for each place that it cannot leave.

    Places smaller than a quarter of the radius squared are none: it hardly moves there.
    """
    inner = free.buffer(-radius, quad_segs=4)
    return [part for part in shapely.get_parts(inner).tolist() if part.area > radius * radius / 4]


def closed_gaps(
    sides: Array, paths: Array, free: MultiPolygon, width: float, moved: float
) -> tuple[IntArray, Array]:
    """Return which gaps have become too narrow.

    A gap is where two sides face each other across the free space. It was wide enough if what these sides
    stand for is further apart there.

    Parameters
    ----------
    sides : (m, 2, 2) m
        The sides of walls as they are now, from point to point.
    paths : (m,) linestrings, m
        What each stands for: the wall as it was.
    free : MultiPolygon, m
        The free space now.
    width : float, m
        A robot's diameter.
    moved : float, m
        No wall has moved further.

    Returns
    -------
    pairs : (p, 2)
        The two sides.
    places : (p, 2) m
        The middle of the gap.
    """
    lines = shapely.linestrings(sides)
    tree = STRtree(lines)
    pairs = np.empty((0, 2), dtype=np.intp)
    for begin in range(0, len(lines), _CHUNK):
        one, other = tree.query(lines[begin : begin + _CHUNK], predicate="dwithin", distance=width)
        one += begin
        # neighbours meet in a corner; and two walls that are far closer now were close before
        apart = (one < other) & (sides[one, 1] != sides[other, 0]).any(axis=1)
        apart &= (sides[other, 1] != sides[one, 0]).any(axis=1)
        one, other = one[apart], other[apart]
        distance = shapely.distance(lines[one], lines[other])
        narrow = (distance < width) & (distance > width - 2 * moved)
        pairs = np.concatenate([pairs, np.column_stack([one[narrow], other[narrow]])])
    ends = shapely.get_coordinates(shapely.shortest_line(lines[pairs[:, 0]], lines[pairs[:, 1]]))
    places = ends.reshape(-1, 2, 2).mean(axis=1)
    shapely.prepare(free)
    across = shapely.contains_xy(free, *places.T)
    pairs, places = pairs[across], places[across]
    reach = width / 2 + 2 * moved
    windows = shapely.box(*(places - reach).T, *(places + reach).T)
    before = [shapely.intersection(paths[pairs[:, k]], windows) for k in (0, 1)]
    # where nothing is left of a wall it was further away
    was = np.nan_to_num(shapely.distance(*before), nan=np.inf)
    lost = was > width * _CLEARLY
    return pairs[lost], places[lost]


def paths_of(points: Array, begin: IntArray, size: IntArray, first: IntArray, last: IntArray) -> Array:
    """Return runs of vertices of rings as linestrings, (m,).

    Parameters
    ----------
    points : (k, 2) m
        Vertices of rings, ring after ring.
    begin, size : (m,)
        Where each run's ring begins, and how many vertices it has.
    first, last : (m,)
        The first and the last vertex of each run, along the ring; the same for all of a ring.
    """
    count = (last - first - 1) % size + 2
    at = begin.repeat(count) + (ranges(first - begin, count)) % size.repeat(count)
    return np.asarray(shapely.linestrings(points[at], indices=np.arange(len(count)).repeat(count)))
