"""A grid of free, blocked and unknown cells as a foreign map, and the outline of its free cells as polygons.

Free cells are connected through their sides, never through a corner only: no robot passes there. So
obstacles that touch at a corner hang together (free cells are 4-connected, obstacles 8-connected), and
the outline joins them by a neck: touching in a point is neither open nor closed to what computes with it.
"""

import math
from collections.abc import Callable
from typing import Any, Literal, TypeAlias

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy import ndimage
from shapely import MultiPolygon, Polygon

from robocov.arrays import Array, BoolArray, IntArray, concatenate_ranges
from robocov.environment import Point
from robocov.errors import MapError
from robocov_app.formats.base import ForeignMap, square_metres
from robocov_app.formats.files import require_coordinate, require_vertices

Cells: TypeAlias = NDArray[np.uint8]  # `FREE`, `BLOCKED` or `UNKNOWN`, (rows, columns), the top row first
FREE, BLOCKED, UNKNOWN = 0, 1, 2
RIM = 2  # around the known cells so many are solid where a map is cut to them
NECK = 1 / 32  # cut at corners where obstacles touch, off each side of the two free cells, in cells
_STRIP = 512  # rows that are looked at together
_TOUCHING = np.ones((3, 3), dtype=bool)  # known cells that touch at a corner belong together


def build_grid_map(
    cells: Cells,
    where: str,
    name: str,
    description: str,
    cell: float,
    *,
    origin: Point = (0.0, 0.0),
    yaw: float = 0.0,
    unknown: Literal["obstacle", "free", "cut"] = "obstacle",
    called: str = "unknown",
    noise: float = 0.0,
    repaired: tuple[str, ...] = (),
    notes: tuple[str, ...] = (),
) -> ForeignMap:
    """Return `cells`, (rows, columns), as a map.

    `cell`, m: side of one. `origin`, m: lower left corner of the grid, about which it is turned by `yaw`,
    rad. `unknown`: what unknown cells are, which the report calls `called`; with ``cut`` the map ends around
    the known ones. `noise`: obstacles of fewer cells are noise. MapError where no cell is free, or the grid
    too rough.
    """
    rows, columns = cells.shape

    def placed(points: Array) -> Array:
        return _placed(points, cell, origin, yaw)

    for value in placed(np.array([[0, 0], [columns, 0], [columns, rows], [0, rows]], float)).ravel().tolist():
        require_coordinate(value, f"{where}: a corner of the grid")
    number = [int(np.count_nonzero(cells == kind)) for kind in (FREE, BLOCKED, UNKNOWN)]
    share = [_format_share(each, cells.size) for each in number]
    told = f"{columns} x {rows} cells of {cell:.6g} m: {share[FREE]} free, {share[BLOCKED]} blocked"
    if number[UNKNOWN]:
        taken = {"obstacle": "taken as obstacles", "free": "taken as free", "cut": "cut away"}[unknown]
        told += f", {share[UNKNOWN]} {called}, {taken}"
    upward = cells[::-1]
    free = upward == FREE
    if unknown == "free":
        free |= upward == UNKNOWN
    if not free.any():
        hint = f" (--unknown free takes {called} cells as free)" if number[UNKNOWN] else ""
        raise MapError(f"{where}: no cell is free{hint}")
    boundary, dropped = None, []
    if unknown == "cut" and number[UNKNOWN]:
        island, count = ndimage.label(upward != UNKNOWN, structure=_TOUCHING)
        area = np.bincount(island[free], minlength=count + 1)
        main = island == int(area.argmax())
        if lost := int(area.sum() - area.max()):
            what = square_metres(lost * cell * cell, 3)
            dropped.append(f"{what} of free space on other islands of known cells")
        free &= main
        # around the known cells and a rim, without holes
        wide = ndimage.binary_dilation(np.pad(main, RIM), structure=_TOUCHING, iterations=RIM)
        boundary = Polygon(_traced(wide, where, lambda points: placed(points - RIM)).geoms[0].exterior)
    outline = _traced(free, where, placed)
    return ForeignMap(
        name=name,
        description=description,
        free=outline,
        boundary=boundary,
        vertices_read=count_polygon_vertices(outline),
        cell=cell,
        specks=noise * cell * cell,
        repaired=repaired,
        dropped=tuple(dropped),
        notes=(*notes, told),
    )


def outline_free_cells(free: BoolArray, cell: Point, origin: Point, where: str) -> MultiPolygon:
    """Return free cells, (rows, columns), the top row first, as polygons, m; MapError where none is."""
    if not free.any():
        raise MapError(f"{where}: no cell is free")
    return _traced(free[::-1], where, lambda points: _placed(points, cell, origin))


def count_polygon_vertices(area: MultiPolygon) -> int:
    return int(shapely.get_num_coordinates(area)) - sum(1 + len(part.interiors) for part in area.geoms)


def _placed(points: Array, cell: float | Point, origin: Point, yaw: float = 0.0) -> Array:
    """Return (n, 2) places in the grid, in cells, in metres on the map."""
    x, y = (points * cell).T
    if yaw:
        x, y = x * math.cos(yaw) - y * math.sin(yaw), x * math.sin(yaw) + y * math.cos(yaw)
    return np.column_stack([x + origin[0], y + origin[1]])


def _traced(cells: BoolArray, where: str, placed: Callable[[Array], Array]) -> MultiPolygon:
    """Return the outline of the cells, placed; only the part of the grid that they fill is looked at."""
    row, column = np.flatnonzero(cells.any(axis=1)), np.flatnonzero(cells.any(axis=0))
    corner = np.array([column[0], row[0]], float)
    part = trace_outline(cells[row[0] : row[-1] + 1, column[0] : column[-1] + 1], where)
    outline: MultiPolygon = shapely.transform(part, lambda points: placed(points + corner))
    return outline


def _format_share(number: int, total: int) -> str:
    """Return a part of the cells in per cent, never rounded to none or all."""
    share = 100 * number / total
    if 0.0 < share < 0.1:
        return "<0.1 %"
    return ">99.9 %" if 99.9 < share < 100.0 else f"{share:.3g} %"


def trace_outline(free: BoolArray, where: str) -> MultiPolygon:
    """Return the union of the free cells, (rows, columns), one polygon for each of their connected parts.

    Cell ``free[row, column]`` is the unit square from (column, row) on. Every vertex is a true corner, and no
    two rings touch: necks join obstacles that do. Raises MapError at more than `files.MAX_VERTICES`.
    """
    column, row, west, north, neck, north_east = _corners(free, where)
    if not len(row):
        return MultiPolygon()
    index = np.arange(len(row))
    # along a line sides join the first corner to the second, the third to the fourth, and so on
    upward = np.lexsort((north, row, column))
    vertical = np.empty_like(index)
    vertical[upward] = upward[index ^ 1]
    order, begin = _rings(vertical, north_east)
    # the free cell at a ring's first corner is north-east of it, or it is a hole
    first = order[begin]
    hole = np.where(north_east[first], 0, 1)
    part = ndimage.label(free)[0][row[first] - hole, column[first] - hole]
    # the rings of a part come together; the first of them has its lowest corner: it is the outer one
    rank = np.argsort(part, kind="stable")
    length = np.diff(begin, append=len(order))[rank]
    vertex, ring = order[concatenate_ranges(begin[rank], length)], np.arange(len(rank)).repeat(length)
    # of a ring every other side is horizontal
    leaves = (concatenate_ranges(hole[rank], length) % 2 == 0)[:, None]
    beside = np.column_stack([column + np.where(west, -neck, neck), row])[vertex]
    above = np.column_stack([column, row + np.where(north, neck, -neck)])[vertex]
    points = np.stack([np.where(leaves, above, beside), np.where(leaves, beside, above)], axis=1)
    # but for necks, a corner's two points are one
    fresh = np.column_stack([np.ones(len(vertex), dtype=bool), neck[vertex] > 0.0])
    rings = shapely.linearrings(points[fresh], indices=ring.repeat(fresh.sum(axis=1)))
    return MultiPolygon(list(shapely.polygons(rings, indices=np.unique(part, return_inverse=True)[1][rank])))


def _corners(free: BoolArray, where: str) -> list[Any]:
    """Return column and row of each corner of the outline, row by row, and how that goes there, (k,) each.

    Whether its sides go west and north, how long its neck is, whether the cell north-east is free. Of two in
    one place the one with the side to the west stands first.
    """
    found = []
    count = 0
    for low in range(0, len(free) + 1, _STRIP):  # which bounds the memory
        strip = np.pad(free[max(low - 1, 0) : low + _STRIP], ((low == 0, low + _STRIP > len(free)), (1, 1)))
        south_west, south_east, north_west, north_east = (
            strip[up : len(strip) - 1 + up, right : strip.shape[1] - 1 + right]
            for up, right in ((0, 0), (0, 1), (1, 0), (1, 1))
        )
        twins = (south_west == north_east) & (south_east == north_west) & (south_west != south_east)
        corners = south_west ^ south_east ^ north_west ^ north_east | twins
        # where two meet, each is a neck of two
        count += int(np.count_nonzero(corners)) + 3 * int(np.count_nonzero(twins))
        require_vertices(count, where)
        row, column = corners.nonzero()
        facts = (south_west ^ north_west, north_west ^ north_east, twins, north_east)
        found.append((column, row + low, *(each[corners] for each in facts)))
    column, row, west, north, twin, north_east = map(np.concatenate, zip(*found, strict=True))
    second = concatenate_ranges(np.zeros_like(row), 1 + twin) == 1
    column, row, west, north, twin, north_east = (
        each.repeat(1 + twin) for each in (column, row, west, north, twin, north_east)
    )
    return [column, row, west & ~second, north ^ (twin & (north_east ^ second)), NECK * twin, north_east]


def _rings(vertical: IntArray, outer: BoolArray) -> tuple[IntArray, IntArray]:
    """Return the corners ring by ring, and where each begins: at its first corner.

    From there an `outer` ring goes along its horizontal side, a hole along the vertical one.
    """
    beyond, levels = vertical.tolist(), outer.tolist()
    fresh = bytearray(b"\x01") * len(beyond)
    order: list[int] = []
    begin: list[int] = []
    for corner, level in enumerate(levels):
        if fresh[corner]:
            begin.append(len(order))
        while fresh[corner]:
            fresh[corner] = 0
            order.append(corner)
            corner = corner ^ 1 if level else beyond[corner]
            level = not level
    return np.array(order, dtype=np.intp), np.array(begin, dtype=np.intp)
