"""Grids of free, blocked and unknown cells as foreign maps."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from shapely import Polygon

from robocov.environment import Point
from robocov.errors import MapError, format_area
from robocov.typing import BoolArray, FloatArray
from robocov_app.formats.files import require_coordinate
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geometry.cells.vectorize import count_polygon_vertices, outline_cells

Cells: TypeAlias = NDArray[np.uint8]
"""(rows, columns) array of `FREE`, `BLOCKED` and `UNKNOWN`, the top row first."""
Meaning: TypeAlias = Literal["obstacle", "free", "cut"]
"""Treatment of unknown cells. With "cut", the map ends at the edge of the known cells."""
FREE = 0
BLOCKED = 1
UNKNOWN = 2
RIM = 2
"""Thickness, in cells, of the solid rim around the known cells with "cut"."""
_WITH_CORNERS = np.ones((3, 3), dtype=bool)
"""Known cells that touch at a corner are connected."""


@dataclass(frozen=True)
class GridFrame:
    """The position of a grid on the map.

    Attributes
    ----------
    cell : float, m
        Side of a cell.
    origin : (x, y), m
        Lower left corner of the grid.
    yaw : float, rad
        Angle by which the grid is rotated about that corner.
    """

    cell: float
    origin: Point = (0.0, 0.0)
    yaw: float = 0.0

    def place(self, points: FloatArray) -> FloatArray:
        """Convert positions in the grid, (n, 2) in cells from its lower left corner, to positions in m."""
        x, y = (points * self.cell).T
        rotated_x = x
        rotated_y = y
        if self.yaw:
            cos = math.cos(self.yaw)
            sin = math.sin(self.yaw)
            rotated_x = x * cos - y * sin
            rotated_y = x * sin + y * cos
        return np.column_stack([rotated_x + self.origin[0], rotated_y + self.origin[1]])


def build_grid_map(
    cells: Cells,
    frame: GridFrame,
    source_name: str,
    *,
    name: str,
    description: str,
    unknown: Meaning = "obstacle",
    unknown_name: str = "unknown",
    noise_cells: float = 0.0,
    repaired: tuple[str, ...] = (),
    notes: tuple[str, ...] = (),
) -> ForeignMap:
    """Build a map from the cells of a grid.

    Parameters
    ----------
    cells : (rows, columns) array
    frame : GridFrame
    source_name : str
        The file, for messages.
    name, description : str
    unknown : "obstacle", "free" or "cut"
        What unknown cells become. With "cut", the map ends at the edge of the known cells.
    unknown_name : str
        Word for unknown cells in the report.
    noise_cells : float
        Obstacles smaller than this many cells are noise.
    repaired, notes : tuple of str
        Lines for the import report.

    Raises
    ------
    MapError
        If no cell is free, the outline has too many vertices, or a coordinate is out of range.
    """
    _require_coordinates(cells, frame, source_name)
    # From here on the bottom row is first, in the direction of the y axis.
    known = cells[::-1] != UNKNOWN
    free = _find_free_cells(cells[::-1], unknown, unknown_name, source_name)
    boundary = None
    dropped: tuple[str, ...] = ()
    if unknown == "cut" and not known.all():
        island = _find_main_island(known, free)
        dropped = _describe_lost_cells(free & ~island, frame.cell)
        free &= island
        boundary = _build_rim(island, frame, source_name)
    outline = outline_cells(free, frame.place, source_name)
    return ForeignMap(
        name=name,
        description=description,
        free=outline,
        boundary=boundary,
        vertices_read=count_polygon_vertices(outline),
        cell=frame.cell,
        specks=noise_cells * frame.cell * frame.cell,
        repaired=repaired,
        dropped=dropped,
        notes=(*notes, _describe_cells(cells, frame.cell, unknown, unknown_name)),
    )


def _find_free_cells(
    cells: Cells, unknown_meaning: Meaning, unknown_name: str, source_name: str
) -> BoolArray:
    """Return the mask of the free cells.

    Raises
    ------
    MapError
        If no cell is free, with a hint if unknown cells could be free.
    """
    is_unknown = cells == UNKNOWN
    free: BoolArray = cells == FREE
    if unknown_meaning == "free":
        free |= is_unknown
    if free.any():
        return free
    hint = ""
    if is_unknown.any():
        hint = f" (--unknown free treats {unknown_name} cells as free)"
    raise MapError(f"{source_name}: no cell is free{hint}")


def _require_coordinates(cells: Cells, frame: GridFrame, source_name: str) -> None:
    """Raise MapError if a corner of the grid is too far away for a map."""
    rows, columns = cells.shape
    corners = np.array([[0, 0], [columns, 0], [columns, rows], [0, rows]], float)
    for value in frame.place(corners).ravel().tolist():
        require_coordinate(value, f"{source_name}: a corner of the grid")


def _describe_cells(cells: Cells, cell: float, unknown_meaning: Meaning, unknown_name: str) -> str:
    """Return the line of the import report about the numbers of free, blocked and unknown cells."""
    rows, columns = cells.shape
    free = _format_share(int(np.count_nonzero(cells == FREE)), cells.size)
    blocked = _format_share(int(np.count_nonzero(cells == BLOCKED)), cells.size)
    line = f"{columns} x {rows} cells of {cell:.6g} m: {free} free, {blocked} blocked"
    unknown_count = int(np.count_nonzero(cells == UNKNOWN))
    if not unknown_count:
        return line
    treatments = {"obstacle": "treated as obstacles", "free": "treated as free", "cut": "cut away"}
    treatment = treatments[unknown_meaning]
    return f"{line}, {_format_share(unknown_count, cells.size)} {unknown_name}, {treatment}"


def _format_share(number: int, total: int) -> str:
    """Format a share of the cells in percent. A share other than 0 and 1 is not rounded to 0 or 100%."""
    share = 100 * number / total
    if 0.0 < share < 0.1:
        return "<0.1%"
    if 99.9 < share < 100.0:
        return ">99.9%"
    return f"{share:.1f}%"


def _find_main_island(known: BoolArray, free: BoolArray) -> BoolArray:
    """Return the mask of the connected group of known cells that contains the most free cells."""
    island, count = ndimage.label(known, structure=_WITH_CORNERS)
    free_counts = np.bincount(island[free], minlength=count + 1)
    return np.asarray(island == int(free_counts.argmax()))


def _describe_lost_cells(lost: BoolArray, cell: float) -> tuple[str, ...]:
    """Return the line of the import report about free cells outside the map, or nothing if there are none."""
    count = int(np.count_nonzero(lost))
    if not count:
        return ()
    return (f"{format_area(count * cell * cell, 3)} of free space on other islands of known cells",)


def _build_rim(known: BoolArray, frame: GridFrame, source_name: str) -> Polygon:
    """Return the outline of the known cells and the rim around them, m, without holes."""
    wide = ndimage.binary_dilation(np.pad(known, RIM), structure=_WITH_CORNERS, iterations=RIM)
    outline = outline_cells(wide, lambda points: frame.place(points - RIM), source_name)
    return Polygon(outline.geoms[0].exterior)
