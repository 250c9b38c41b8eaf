"""The outline of the free cells of a grid, as polygons.

Free cells are connected through their sides, never through a corner only: no robot passes there. So
obstacles that touch at a corner hang together (free cells are 4-connected, obstacles 8-connected), and
the outline joins them by a neck: touching in a point is neither open nor closed to what computes with it.
"""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy import ndimage
from shapely import MultiPolygon

from robocov.arrays import Array, BoolArray, IntArray, ranges
from robocov_app.formats.files import require_vertices

NECK = 1 / 32
"""Where obstacles touch at a corner, so much of each side of the two free cells is cut off, in cells."""

_STRIP = 512
"""Rows that are looked at together."""


def traced(free: BoolArray, where: str) -> MultiPolygon:
    """Return the union of the free cells, (rows, columns), one polygon for each of their connected parts.

    Cell ``free[row, column]`` is the unit square whose lower left corner is (column, row). Every vertex is a
    true corner, none lies within a straight wall, and no two rings touch: necks join obstacles that touch at
    a corner. Raises MapError when there are more than `files.MAX_VERTICES`.

    Examples
    --------
    >>> traced(np.array([[True, True], [True, False]]), "grid").wkt
    'MULTIPOLYGON (((0 0, 2 0, 2 1, 1 1, 1 2, 0 2, 0 0)))'
    """
    column, row, twin = _corners(free, where)
    if not len(row):
        return MultiPolygon()
    part, following, points = _links(free, column, row, twin)
    order, begin = _rings(following)
    # the rings of a part come together; the first of them has its lowest corner: it is the outer one
    ring_part = part[order[begin]]
    rank = np.argsort(ring_part, kind="stable")
    length = np.diff(begin, append=len(order))[rank]
    vertex = order[ranges(begin[rank], length)]
    ring = np.arange(len(rank)).repeat(length)
    points, ring = points[vertex].reshape(-1, 2), ring.repeat(2)
    # but for necks, a corner's two points are one
    fresh = np.ones(len(points), dtype=bool)
    fresh[1::2] = (points[1::2] != points[::2]).any(axis=1)
    rings = shapely.linearrings(points[fresh], indices=ring[fresh])
    polygon = np.cumsum(np.diff(ring_part[rank], prepend=ring_part[rank[0]]) > 0)
    return MultiPolygon(list(shapely.polygons(rings, indices=polygon)))


def _corners(free: BoolArray, where: str) -> tuple[IntArray, IntArray, BoolArray]:
    """Return column and row of the corners of the outline, row by row, and where two meet in one."""
    row, column, twin = [], [], []
    count = 0
    for low in range(0, len(free) + 1, _STRIP):  # which bounds the memory
        strip = np.pad(free[max(low - 1, 0) : low + _STRIP], ((low == 0, 0), (1, 1)))
        padded = np.pad(strip, ((0, low + _STRIP > len(free)), (0, 0)))
        south_west, south_east = padded[:-1, :-1], padded[:-1, 1:]
        north_west, north_east = padded[1:, :-1], padded[1:, 1:]
        twins = (south_west == north_east) & (south_east == north_west) & (south_west != south_east)
        corners = south_west ^ south_east ^ north_west ^ north_east
        corners |= twins
        # where two meet, each is a neck of two
        count += int(np.count_nonzero(corners)) + 3 * int(np.count_nonzero(twins))
        require_vertices(count, where)
        rows, columns = corners.nonzero()
        row.append(rows + low)
        column.append(columns)
        twin.append(twins[rows, columns])
    return np.concatenate(column), np.concatenate(row), np.concatenate(twin)


def _links(
    free: BoolArray, column: IntArray, row: IntArray, twin: BoolArray
) -> tuple[NDArray[np.int32], IntArray, Array]:
    """Return what the outline is made of: the part of each corner, the corner after it, and its points.

    Where two corners meet, each is one of a free cell, and the one with the side to the west stands first.
    The free cells are on the left. The points, (k, 2, 2): where the outline comes and where it leaves.
    """
    labels = ndimage.label(free)[0]

    def around(up: int, right: int) -> NDArray[np.int32]:
        y, x = row + up - 1, column + right - 1
        within = (y >= 0) & (y < free.shape[0]) & (x >= 0) & (x < free.shape[1])
        part = np.where(within, labels[np.where(within, y, 0), np.where(within, x, 0)], 0)
        return np.asarray(part.repeat(1 + twin))

    south_west, south_east, north_west, north_east = (around(up, right) for up in (0, 1) for right in (0, 1))
    west = (south_west > 0) != (north_west > 0)
    north = (north_west > 0) != (north_east > 0)
    first = (np.arange(len(twin)) + np.cumsum(twin) - twin)[twin]
    west[first], west[first + 1] = True, False
    north[first] = north_west[first] > 0
    north[first + 1] = ~north[first]
    part = np.where(west, np.maximum(south_west, north_west), np.maximum(south_east, north_east))
    # whether it leaves along its horizontal side, and comes along the vertical one
    leaves = np.where(west, south_west, north_east) > 0

    index = np.arange(len(part))
    row, column, neck = row.repeat(1 + twin), column.repeat(1 + twin), (twin * NECK).repeat(1 + twin)
    # along a line sides join the first corner to the second, the third to the fourth, and so on
    upward = np.lexsort((north, row, column))
    vertical = np.empty_like(index)
    vertical[upward] = upward[index ^ 1]
    beside = np.column_stack([column + np.where(west, -neck, neck), row])
    above = np.column_stack([column, row + np.where(north, neck, -neck)])
    comes = np.where(leaves[:, None], above, beside)
    goes = np.where(leaves[:, None], beside, above)
    return part, np.where(leaves, index ^ 1, vertical), np.stack([comes, goes], axis=1)


def _rings(following: IntArray) -> tuple[IntArray, IntArray]:
    """Return the corners ring by ring, and where each begins: at its first corner, which orders them."""
    after = following.tolist()
    fresh = bytearray(b"\x01") * len(after)
    order: list[int] = []
    begin: list[int] = []
    for first in range(len(after)):
        if not fresh[first]:
            continue
        begin.append(len(order))
        corner = first
        while fresh[corner]:
            fresh[corner] = 0
            order.append(corner)
            corner = after[corner]
    return np.array(order, dtype=np.intp), np.array(begin, dtype=np.intp)
