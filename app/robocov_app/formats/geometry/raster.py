"""A grid of free, blocked and unknown cells as a foreign map, and the outline of its free cells as polygons.

Free cells are connected through their sides, never through a corner only: no robot passes there. So
obstacles that touch at a corner hang together (free cells are 4-connected, obstacles 8-connected), and
the outline joins them by a neck: touching in a point is neither open nor closed to what computes with it.
"""

import math
from typing import Literal, TypeAlias

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy import ndimage
from shapely import MultiPolygon, Polygon

from robocov.arrays import Array, BoolArray, IntArray, ranges
from robocov.environment import Point
from robocov.errors import MapError
from robocov_app.formats.base import ForeignMap, square_metres
from robocov_app.formats.files import require_coordinate, require_vertices

Cells: TypeAlias = NDArray[np.uint8]
"""`FREE`, `BLOCKED` or `UNKNOWN` for each cell, (rows, columns), the top row first as in pictures."""

FREE, BLOCKED, UNKNOWN = 0, 1, 2

RIM = 2
"""Around the known cells so many are solid where a map is cut to them."""

NECK = 1 / 32
"""Cut at corners where obstacles touch, off each side of the two free cells, in cells."""

_STRIP = 512  # rows that are looked at together
_TOUCHING = np.ones((3, 3), dtype=bool)  # known cells that touch at a corner belong together


def foreign_map(
    cells: Cells,
    *,
    name: str,
    description: str,
    format: str,  # noqa: A002 - as of the map
    cell: float,
    origin: Point = (0.0, 0.0),
    yaw: float = 0.0,
    unknown: Literal["obstacle", "free", "cut"] = "obstacle",
    called: str = "unknown",
    noise: float = 0.0,
    where: str,
    repaired: tuple[str, ...] = (),
    notes: tuple[str, ...] = (),
) -> ForeignMap:
    """Return `cells`, (rows, columns), as a map.

    `cell`, m: side of a cell. `origin`, m: lower left corner of the lower left one, about which the grid is
    turned by `yaw`, rad. `unknown`: what unknown cells are, which the report calls `called`; with ``cut`` the
    map ends around the known ones. `noise`: obstacles of fewer cells are noise. Raises MapError when no cell
    is free, or the grid is too rough or too far away.
    """
    rows, columns = cells.shape

    def placed(points: Array) -> Array:
        return _placed(points, cell, origin, yaw)

    corners = placed(np.array([[0, 0], [columns, 0], [columns, rows], [0, rows]], float))
    for value in corners.ravel().tolist():
        require_coordinate(value, f"{where}: a corner of the grid")
    number = [int(np.count_nonzero(cells == kind)) for kind in (FREE, BLOCKED, UNKNOWN)]
    told = [*notes, _counts(number, rows, columns, cell, called, unknown)]
    dropped: list[str] = []
    upward = cells[::-1]
    free = upward == FREE
    if unknown == "free":
        free |= upward == UNKNOWN
    if not free.any():
        hint = f" (--unknown free takes {called} cells as free)" if number[UNKNOWN] else ""
        raise MapError(f"{where}: no cell is free, but some were wanted{hint}")
    boundary: Polygon | None = None
    if unknown == "cut" and number[UNKNOWN]:
        known = upward != UNKNOWN
        island, count = ndimage.label(known, structure=_TOUCHING)
        area = np.bincount(island[free], minlength=count + 1)
        main = island == int(area.argmax())
        lost = int(area.sum() - area.max())
        if lost:
            what = square_metres(lost * cell * cell, 3)
            dropped.append(f"{what} of free space on other islands of known cells")
        free &= main
        # around the known cells and a rim, without holes
        wide = ndimage.binary_dilation(np.pad(main, RIM), structure=_TOUCHING, iterations=RIM)
        around = Polygon(_traced(wide, where).geoms[0].exterior)
        boundary = shapely.transform(around, lambda points: placed(points - RIM))
    area = shapely.transform(_traced(free, where), placed)
    return ForeignMap(
        name=name,
        description=description,
        format=format,
        free=area,
        boundary=boundary,
        vertices_read=vertices_of(area),
        cell=cell,
        specks=noise * cell * cell,
        repaired=repaired,
        dropped=tuple(dropped),
        notes=tuple(told),
    )


def free_area(free: BoolArray, cell: Point, origin: Point, where: str) -> MultiPolygon:
    """Return the free cells, (rows, columns), the top row first, as polygons in metres.

    `cell`, m: width and height of one. `origin`, m: lower left corner of all. Raises MapError as
    `foreign_map`.
    """
    if not free.any():
        raise MapError(f"{where}: no cell is free, but some were wanted")
    outline = _traced(free[::-1], where)
    area: MultiPolygon = shapely.transform(outline, lambda points: _placed(points, cell, origin))
    return area


def vertices_of(area: MultiPolygon) -> int:
    """Return the number of vertices of polygons."""
    return int(shapely.get_num_coordinates(area)) - sum(1 + len(part.interiors) for part in area.geoms)


def _placed(points: Array, cell: float | Point, origin: Point, yaw: float = 0.0) -> Array:
    """Return (n, 2) places in the grid, in cells, in metres on the map."""
    x, y = (points * cell).T
    if yaw:
        x, y = x * math.cos(yaw) - y * math.sin(yaw), x * math.sin(yaw) + y * math.cos(yaw)
    return np.column_stack([x + origin[0], y + origin[1]])


def _traced(cells: BoolArray, where: str) -> MultiPolygon:
    """Return the outline of the cells; only the part of the grid that they fill is looked at."""
    row, column = np.flatnonzero(cells.any(axis=1)), np.flatnonzero(cells.any(axis=0))
    corner = np.array([column[0], row[0]], float)
    part = traced(cells[row[0] : row[-1] + 1, column[0] : column[-1] + 1], where)
    outline: MultiPolygon = shapely.transform(part, lambda points: points + corner)
    return outline


def _counts(number: list[int], rows: int, columns: int, cell: float, called: str, unknown: str) -> str:
    total = rows * columns
    words = f"{columns} x {rows} cells of {cell:.6g} m: {_share(number[FREE], total)} free"
    words += f", {_share(number[BLOCKED], total)} blocked"
    if number[UNKNOWN]:
        taken = {"obstacle": "taken as obstacles", "free": "taken as free", "cut": "cut away"}[unknown]
        words += f", {_share(number[UNKNOWN], total)} {called}, {taken}"
    return words


def _share(number: int, total: int) -> str:
    """Return a part of the cells in per cent, never rounded to none or all.

    >>> _share(1, 100_000), _share(500, 1000)
    ('<0.1 %', '50 %')
    """
    share = 100 * number / total
    if 0.0 < share < 0.1:
        return "<0.1 %"
    return ">99.9 %" if 99.9 < share < 100.0 else f"{share:.3g} %"


def traced(free: BoolArray, where: str) -> MultiPolygon:
    """Return the union of the free cells, (rows, columns), one polygon for each of their connected parts.

    Cell ``free[row, column]`` is the unit square whose lower left corner is (column, row). Every vertex is a
    true corner, none lies within a straight wall, and no two rings touch: necks join obstacles that touch at
    a corner. Raises MapError when there are more than `files.MAX_VERTICES`.

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
