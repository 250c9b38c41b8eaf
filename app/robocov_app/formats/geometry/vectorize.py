"""Grids of free, blocked and unknown cells as foreign maps, and the outline of free cells as polygons.

Free cells are connected through their sides, never through a corner only: no robot passes there. So
obstacles that touch at a corner are connected (free cells are 4-connected, obstacles 8-connected), and
the outline joins them by a neck: polygons that touch in a point are neither open nor closed to algorithms.
"""

import math
from collections.abc import Callable
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy import ndimage
from shapely import MultiPolygon, Polygon

from robocov.arrays import Array, BoolArray, IntArray, concatenate_ranges
from robocov.environment import Point
from robocov.errors import MapError
from robocov_app.formats.files import require_coordinate, require_vertices
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.reports import format_area

Cells: TypeAlias = NDArray[np.uint8]
"""`FREE`, `BLOCKED` or `UNKNOWN`, (rows, columns), the top row first."""
FREE = 0
BLOCKED = 1
UNKNOWN = 2
RIM = 2
"""Thickness, in cells, of the solid rim around the known cells if a map is cut to them."""
NECK = 1 / 32
"""Length, in cells, by which the corners of two free cells are cut where obstacles touch."""
_STRIP = 512
"""Number of rows processed at once, which bounds the memory."""
_TOUCHING = np.ones((3, 3), dtype=bool)
"""Known cells that touch at a corner are connected."""


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
    unknown_name: str = "unknown",
    noise: float = 0.0,
    repaired: tuple[str, ...] = (),
    notes: tuple[str, ...] = (),
) -> ForeignMap:
    """Build a map from the cells of a grid.

    Parameters
    ----------
    cells : (rows, columns) array
    where : str
        The file, for messages.
    name, description : str
    cell : float, m
        Side of a cell.
    origin : (float, float), m
        Lower left corner of the grid.
    yaw : float, rad
        Angle by which the grid is turned around that corner.
    unknown : "obstacle", "free" or "cut"
        What unknown cells are; with "cut" the map ends around the known ones.
    unknown_name : str
        What the report calls unknown cells.
    noise : float
        Obstacles of fewer cells are noise.
    repaired, notes : tuple of str
        Lines for the import report.

    Raises
    ------
    MapError
        If no cell is free, if the outline has too many vertices, or if a coordinate is out of range.
    """

    def place(points: Array) -> Array:
        return _place_on_map(points, cell, origin, yaw)

    _require_coordinates(cells, place, where)
    upward = cells[::-1]
    free = upward == FREE
    if unknown == "free":
        free |= upward == UNKNOWN
    if not free.any():
        hint = ""
        if (cells == UNKNOWN).any():
            hint = f" (--unknown free takes {unknown_name} cells as free)"
        raise MapError(f"{where}: no cell is free{hint}")
    boundary = None
    dropped: tuple[str, ...] = ()
    if unknown == "cut" and (cells == UNKNOWN).any():
        main = _find_main_island(upward != UNKNOWN, free)
        lost = int(np.count_nonzero(free & ~main))
        if lost:
            area = format_area(lost * cell * cell, 3)
            dropped = (f"{area} of free space on other islands of known cells",)
        free &= main
        boundary = _build_rim(main, where, place)
    outline = _trace_filled_part(free, where, place)
    return ForeignMap(
        name=name,
        description=description,
        free=outline,
        boundary=boundary,
        vertices_read=count_polygon_vertices(outline),
        cell=cell,
        specks=noise * cell * cell,
        repaired=repaired,
        dropped=dropped,
        notes=(*notes, _describe_cells(cells, cell, unknown, unknown_name)),
    )


def outline_free_cells(free: BoolArray, cell: Point, origin: Point, where: str) -> MultiPolygon:
    """Return free cells as polygons.

    Parameters
    ----------
    free : (rows, columns) array of bool
        The top row first.
    cell : (float, float), m
        Width and height of a cell.
    origin : (float, float), m
        Lower left corner of the grid.
    where : str
        The file, for messages.

    Returns
    -------
    MultiPolygon, m

    Raises
    ------
    MapError
        If no cell is free.
    """
    if not free.any():
        raise MapError(f"{where}: no cell is free")
    return _trace_filled_part(free[::-1], where, lambda points: _place_on_map(points, cell, origin))


def count_polygon_vertices(area: MultiPolygon) -> int:
    """Return the number of vertices of polygons; the first of a ring counts once."""
    ring_count = sum(1 + len(part.interiors) for part in area.geoms)
    return int(shapely.get_num_coordinates(area)) - ring_count


def _place_on_map(points: Array, cell: float | Point, origin: Point, yaw: float = 0.0) -> Array:
    """Transform positions in the grid, (n, 2) in cells, to meters on the map."""
    x, y = (points * cell).T
    if yaw:
        x, y = x * math.cos(yaw) - y * math.sin(yaw), x * math.sin(yaw) + y * math.cos(yaw)
    return np.column_stack([x + origin[0], y + origin[1]])


def _require_coordinates(cells: Cells, place: Callable[[Array], Array], where: str) -> None:
    """Raise MapError if a corner of the grid is too far away for a map."""
    rows, columns = cells.shape
    corners = np.array([[0, 0], [columns, 0], [columns, rows], [0, rows]], float)
    for value in place(corners).ravel().tolist():
        require_coordinate(value, f"{where}: a corner of the grid")


def _describe_cells(
    cells: Cells, cell: float, unknown: Literal["obstacle", "free", "cut"], unknown_name: str
) -> str:
    """Return the line of the import report about the cells."""
    rows, columns = cells.shape
    shares = [_format_share(int(np.count_nonzero(cells == kind)), cells.size) for kind in (FREE, BLOCKED)]
    line = f"{columns} x {rows} cells of {cell:.6g} m: {shares[0]} free, {shares[1]} blocked"
    unknown_count = int(np.count_nonzero(cells == UNKNOWN))
    if not unknown_count:
        return line
    meaning = {"obstacle": "taken as obstacles", "free": "taken as free", "cut": "cut away"}[unknown]
    return f"{line}, {_format_share(unknown_count, cells.size)} {unknown_name}, {meaning}"


def _find_main_island(known: BoolArray, free: BoolArray) -> BoolArray:
    """Return the connected known cells with the most free ones."""
    island, count = ndimage.label(known, structure=_TOUCHING)
    area = np.bincount(island[free], minlength=count + 1)
    return np.asarray(island == int(area.argmax()))


def _build_rim(known: BoolArray, where: str, place: Callable[[Array], Array]) -> Polygon:
    """Return the outline of known cells and a rim around them, without holes, m."""
    wide = ndimage.binary_dilation(np.pad(known, RIM), structure=_TOUCHING, iterations=RIM)
    outline = _trace_filled_part(wide, where, lambda points: place(points - RIM))
    return Polygon(outline.geoms[0].exterior)


def _trace_filled_part(cells: BoolArray, where: str, place: Callable[[Array], Array]) -> MultiPolygon:
    """Return the outline of cells on the map, m; only the part of the grid that they fill is processed."""
    row = np.flatnonzero(cells.any(axis=1))
    column = np.flatnonzero(cells.any(axis=0))
    corner = np.array([column[0], row[0]], float)
    part = trace_outline(cells[row[0] : row[-1] + 1, column[0] : column[-1] + 1], where)
    outline: MultiPolygon = shapely.transform(part, lambda points: place(points + corner))
    return outline


def _format_share(number: int, total: int) -> str:
    """Return a share of the cells in percent, never rounded to none or all."""
    share = 100 * number / total
    if 0.0 < share < 0.1:
        return "<0.1 %"
    return ">99.9 %" if 99.9 < share < 100.0 else f"{share:.3g} %"


def trace_outline(free: BoolArray, where: str) -> MultiPolygon:
    """Return the union of free cells, one polygon for each of their connected parts.

    Parameters
    ----------
    free : (rows, columns) array of bool
        Cell ``free[row, column]`` is the unit square with its lower left corner at (column, row).
    where : str
        The file, for messages.

    Returns
    -------
    MultiPolygon
        Every vertex is a true corner, and no two rings touch: necks join obstacles that do.

    Raises
    ------
    MapError
        At more than `files.MAX_VERTICES`.
    """
    corners = _find_corners(free, where)
    if not len(corners.row):
        return MultiPolygon()
    order, starts = _connect_rings(_pair_vertically(corners), corners.is_north_east_free)
    # The free cell at the first corner of a ring is north-east of it, or the ring is a hole.
    first = order[starts]
    hole = np.where(corners.is_north_east_free[first], 0, 1)
    part = ndimage.label(free)[0][corners.row[first] - hole, corners.column[first] - hole]
    # The rings of a part come together; the first one has the lowest corner, so it is the outer ring.
    rank = np.argsort(part, kind="stable")
    length = np.diff(starts, append=len(order))[rank]
    vertex = order[concatenate_ranges(starts[rank], length)]
    ring = np.arange(len(rank)).repeat(length)
    # Every other side of a ring is horizontal.
    is_leaving_vertically = concatenate_ranges(hole[rank], length) % 2 == 0
    points, is_distinct = _place_necks(corners, vertex, is_leaving_vertically)
    rings = shapely.linearrings(points[is_distinct], indices=ring.repeat(is_distinct.sum(axis=1)))
    _, owner = np.unique(part, return_inverse=True)
    return MultiPolygon(list(shapely.polygons(rings, indices=owner[rank])))


class _Corners(NamedTuple):
    """The corners of an outline, (k,) each, row by row.

    Attributes
    ----------
    column, row : array of int
        Position. Where two corners coincide, the one with the side to the west is first.
    is_west, is_north : array of bool
        Whether the sides of the outline go west and north.
    neck : array
        Length of the neck.
    is_north_east_free : array of bool
        Whether the cell north-east is free.
    """

    column: IntArray
    row: IntArray
    is_west: BoolArray
    is_north: BoolArray
    neck: Array
    is_north_east_free: BoolArray


def _pair_vertically(corners: _Corners) -> IntArray:
    """Return for each corner the other end of its vertical side."""
    index = np.arange(len(corners.row))
    # Along a line, sides connect the first corner to the second, the third to the fourth, and so on.
    upward = np.lexsort((corners.is_north, corners.row, corners.column))
    vertical = np.empty_like(index)
    vertical[upward] = upward[index ^ 1]
    return vertical


def _place_necks(
    corners: _Corners, vertex: IntArray, is_leaving_vertically: BoolArray
) -> tuple[Array, BoolArray]:
    """Return the two ends of the neck of each vertex, (k, 2, 2), and which of them are distinct, (k, 2)."""
    column, row, is_west, is_north, neck, _ = corners
    beside = np.column_stack([column + np.where(is_west, -neck, neck), row])[vertex]
    above = np.column_stack([column, row + np.where(is_north, neck, -neck)])[vertex]
    is_above_first = is_leaving_vertically[:, None]
    points = np.stack(
        [np.where(is_above_first, above, beside), np.where(is_above_first, beside, above)], axis=1
    )
    is_distinct = np.column_stack([np.ones(len(vertex), dtype=bool), neck[vertex] > 0.0])
    return points, is_distinct


def _find_corners(free: BoolArray, where: str) -> _Corners:
    """Find the corners of the outline of free cells. Raises MapError if there are too many."""
    strips = []
    count = 0
    for low in range(0, len(free) + 1, _STRIP):
        padding = ((low == 0, low + _STRIP > len(free)), (1, 1))
        strip = np.pad(free[max(low - 1, 0) : low + _STRIP], padding)
        south_west = strip[:-1, :-1]
        south_east = strip[:-1, 1:]
        north_west = strip[1:, :-1]
        north_east = strip[1:, 1:]
        is_double = (south_west == north_east) & (south_east == north_west) & (south_west != south_east)
        is_corner = south_west ^ south_east ^ north_west ^ north_east | is_double
        # Two corners at the same point have a neck of two vertices each.
        count += int(np.count_nonzero(is_corner)) + 3 * int(np.count_nonzero(is_double))
        require_vertices(count, where)
        row, column = is_corner.nonzero()
        is_west = south_west ^ north_west
        is_north = north_west ^ north_east
        facts = [fact[is_corner] for fact in (is_west, is_north, is_double, north_east)]
        strips.append((column, row + low, *facts))
    column, row, is_west, is_north, is_double, north_east = map(np.concatenate, zip(*strips, strict=True))
    repeats = 1 + is_double
    is_second = concatenate_ranges(np.zeros_like(row), repeats) == 1
    is_double = is_double.repeat(repeats)
    north_east = north_east.repeat(repeats)
    return _Corners(
        column=column.repeat(repeats),
        row=row.repeat(repeats),
        is_west=is_west.repeat(repeats) & ~is_second,
        is_north=is_north.repeat(repeats) ^ (is_double & (north_east ^ is_second)),
        neck=NECK * is_double,
        is_north_east_free=north_east,
    )


def _connect_rings(vertical: IntArray, is_outer: BoolArray) -> tuple[IntArray, IntArray]:
    """Return the corners ring by ring, and where each ring starts, which is at its first corner.

    From there an outer ring leaves along its horizontal side, a hole along the vertical one.
    """
    # Lists are faster than arrays for single elements.
    vertical_ends = vertical.tolist()
    leaves_horizontally = is_outer.tolist()
    is_fresh = bytearray(b"\x01") * len(vertical_ends)
    order: list[int] = []
    starts: list[int] = []
    for corner, is_horizontal in enumerate(leaves_horizontally):
        if is_fresh[corner]:
            starts.append(len(order))
        while is_fresh[corner]:
            is_fresh[corner] = 0
            order.append(corner)
            corner = corner ^ 1 if is_horizontal else vertical_ends[corner]
            is_horizontal = not is_horizontal
    return np.array(order, dtype=np.intp), np.array(starts, dtype=np.intp)
