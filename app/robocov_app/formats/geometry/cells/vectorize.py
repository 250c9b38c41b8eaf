"""The outline of the free cells of a grid as polygons.

Free cells are connected through their sides, never through a corner only, where no robot can pass. So
obstacles that touch at a corner are connected (free cells are 4-connected, obstacles 8-connected). The
outline joins such obstacles by a small neck, because polygons that touch in a point are invalid or ambiguous.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import shapely
from scipy import ndimage
from shapely import MultiPolygon

from robocov.arrays import concatenate_ranges
from robocov.environment import Point
from robocov.errors import MapError
from robocov.typing import BoolArray, FloatArray, IntArray
from robocov_app.formats.files import require_vertices

NECK = 1 / 32
"""Length, in cells, by which the corners of the two free cells are cut off where obstacles touch."""
_STRIP = 512
"""Number of rows processed at once, to limit the memory."""


def outline_free_cells(free: BoolArray, cell: Point, origin: Point, source_name: str) -> MultiPolygon:
    """Return free cells as polygons.

    Parameters
    ----------
    free : (rows, columns) array of bool
        The top row first.
    cell : (float, float), m
        Width and height of a cell.
    origin : (float, float), m
        Lower left corner of the grid.
    source_name : str
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
        raise MapError(f"{source_name}: no cell is free")
    return outline_cells(free[::-1], lambda points: points * cell + origin, source_name)


def outline_cells(
    cells: BoolArray, place: Callable[[FloatArray], FloatArray], source_name: str
) -> MultiPolygon:
    """Return the outline of cells on a map.

    Parameters
    ----------
    cells : (rows, columns) array of bool
        The bottom row first. At least one cell must be true.
    place : callable
        Converts positions in the grid, (n, 2) in cells from its lower left corner, to positions in m.
    source_name : str
        The file, for messages.

    Returns
    -------
    MultiPolygon, m
    """
    # Only the rows and columns that contain cells are traced.
    row = np.flatnonzero(cells.any(axis=1))
    column = np.flatnonzero(cells.any(axis=0))
    corner = np.array([column[0], row[0]], float)
    outline = trace_outline(cells[row[0] : row[-1] + 1, column[0] : column[-1] + 1], source_name)
    placed: MultiPolygon = shapely.transform(outline, lambda points: place(points + corner))
    return placed


def count_polygon_vertices(area: MultiPolygon) -> int:
    """Return the number of vertices of polygons; the repeated first vertex of a ring is not counted."""
    ring_count = sum(1 + len(part.interiors) for part in area.geoms)
    return int(shapely.get_num_coordinates(area)) - ring_count


def trace_outline(free: BoolArray, source_name: str) -> MultiPolygon:
    """Return the union of free cells, one polygon for each of their connected parts.

    Parameters
    ----------
    free : (rows, columns) array of bool
        Cell ``free[row, column]`` is the unit square with its lower left corner at (column, row).
    source_name : str
        The file, for messages.

    Returns
    -------
    MultiPolygon
        Every vertex is a true corner, and no two rings touch: obstacles that touch are joined by necks.

    Raises
    ------
    MapError
        If there are more than `files.MAX_VERTICES` vertices.
    """
    corners = _find_corners(free, source_name)
    if not len(corners.row):
        return MultiPolygon()
    order, starts = _connect_rings(_pair_vertically(corners), corners.is_north_east_free)
    # At the first corner of an outer ring, the free cell is northeast of it. If that cell is not free, the
    # ring is a hole, and the cell southwest of the corner is free.
    first = order[starts]
    is_hole = ~corners.is_north_east_free[first]
    part = ndimage.label(free)[0][corners.row[first] - is_hole, corners.column[first] - is_hole]
    # Sort the rings by part. The first ring of each part has the lowest corner, so it is the outer one.
    rank = np.argsort(part, kind="stable")
    length = np.diff(starts, append=len(order))[rank]
    vertex = order[concatenate_ranges(starts[rank], length)]
    ring = np.arange(len(rank)).repeat(length)
    # Horizontal and vertical sides of a ring alternate.
    is_leaving_vertically = concatenate_ranges(is_hole[rank].astype(int), length) % 2 == 0
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
        Whether the horizontal side at the corner goes west, and the vertical one north.
    neck : array
        Length of the neck, in cells; 0 where no obstacles touch.
    is_north_east_free : array of bool
        Whether the cell northeast of the corner is free.
    """

    column: IntArray
    row: IntArray
    is_west: BoolArray
    is_north: BoolArray
    neck: FloatArray
    is_north_east_free: BoolArray


def _pair_vertically(corners: _Corners) -> IntArray:
    """Return, for each corner, the index of the corner at the other end of its vertical side."""
    index = np.arange(len(corners.row))
    # Along a line, sides connect the first corner to the second, the third to the fourth, and so on.
    upward = np.lexsort((corners.is_north, corners.row, corners.column))
    vertical_end = np.empty_like(index)
    # index ^ 1 swaps 0 and 1, 2 and 3, and so on.
    vertical_end[upward] = upward[index ^ 1]
    return vertical_end


def _place_necks(
    corners: _Corners, vertex: IntArray, is_leaving_vertically: BoolArray
) -> tuple[FloatArray, BoolArray]:
    """Return the points of each vertex: two where its corner is cut off by a neck, otherwise one.

    Returns
    -------
    points : (k, 2, 2) array
        Both points of each vertex, in the order of the ring.
    is_distinct : (k, 2) array of bool
        Which of them to use; the second equals the first where there is no neck.
    """
    column, row, is_west, is_north, neck, _ = corners
    beside = np.column_stack([column + np.where(is_west, -neck, neck), row])[vertex]
    above = np.column_stack([column, row + np.where(is_north, neck, -neck)])[vertex]
    is_above_first = is_leaving_vertically[:, None]
    points = np.stack(
        [np.where(is_above_first, above, beside), np.where(is_above_first, beside, above)], axis=1
    )
    is_distinct = np.column_stack([np.ones(len(vertex), dtype=bool), neck[vertex] > 0.0])
    return points, is_distinct


def _find_corners(free: BoolArray, source_name: str) -> _Corners:
    """Find the corners of the outline of free cells; raise MapError if there are too many."""
    strips = []
    count = 0
    for low in range(0, len(free) + 1, _STRIP):
        padding = ((low == 0, low + _STRIP > len(free)), (1, 1))
        strip = np.pad(free[max(low - 1, 0) : low + _STRIP], padding)
        south_west = strip[:-1, :-1]
        south_east = strip[:-1, 1:]
        north_west = strip[1:, :-1]
        north_east = strip[1:, 1:]
        # At a double corner, two free cells and two obstacles meet crosswise.
        is_double = (south_west == north_east) & (south_east == north_west) & (south_west != south_east)
        is_corner = south_west ^ south_east ^ north_west ^ north_east | is_double
        # Two corners at the same point have a neck of two vertices each.
        count += int(np.count_nonzero(is_corner)) + 3 * int(np.count_nonzero(is_double))
        require_vertices(count, source_name)
        row, column = is_corner.nonzero()
        is_west = south_west ^ north_west
        is_north = north_west ^ north_east
        attributes = [values[is_corner] for values in (is_west, is_north, is_double, north_east)]
        strips.append((column, row + low, *attributes))
    column, row, is_west, is_north, is_double, north_east = map(np.concatenate, zip(*strips, strict=True))
    # A double corner becomes two corners at the same point, one of each free cell. The first has the side to
    # the west, the second the side to the east, and each has the vertical side of the same cell.
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


def _connect_rings(vertical_end: IntArray, is_outer: BoolArray) -> tuple[IntArray, IntArray]:
    """Return the indices of the corners ring by ring, and where each ring starts in them.

    The first side of an outer ring is horizontal, that of a hole is vertical.
    """
    # Lists are faster than arrays for single elements.
    vertical_ends = vertical_end.tolist()
    leaves_horizontally = is_outer.tolist()
    is_unvisited = bytearray(b"\x01") * len(vertical_ends)
    order: list[int] = []
    starts: list[int] = []
    for corner, is_horizontal in enumerate(leaves_horizontally):
        if is_unvisited[corner]:
            starts.append(len(order))
        while is_unvisited[corner]:
            is_unvisited[corner] = 0
            order.append(corner)
            if is_horizontal:
                # Corners are sorted along each row, so both ends of a horizontal side are neighbors.
                corner = corner ^ 1
            else:
                corner = vertical_ends[corner]
            is_horizontal = not is_horizontal
    return np.array(order, dtype=np.intp), np.array(starts, dtype=np.intp)
