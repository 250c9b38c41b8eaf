"""Rasterization of a map: cells are free if their center is, and walls thinner than a cell have no gaps."""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy import ndimage
from shapely.geometry.base import BaseGeometry

from robocov.arrays import concatenate_ranges
from robocov.defaults import DEFAULT_RADIUS_M
from robocov.environment import Environment
from robocov.errors import ParameterError, format_count
from robocov.typing import BoolArray, FloatArray, IntArray
from robocov_app.formats.files import MAX_CELLS
from robocov_app.formats.geometry.crossings import extract_sides
from robocov_app.formats.options import get_or_default
from robocov_app.formats.reports import ExportReport

DEFAULT_CELL_M = 0.05
"""Side of a cell, as in most robot maps."""
_MIN_PART_AREA_M2 = math.pi * DEFAULT_RADIUS_M**2
"""Smaller parts of the free space are too small for a robot and are not counted."""
_MAX_TRIED_CELLS = 16_000_000
"""Size of the largest grid that is tried in order to keep passages that a coarser grid closes."""
_DIGITS = 6
"""Decimals of the corner of a grid, in m: it is rounded to a micrometer."""


class _Crossings(NamedTuple):
    """Points in which the sides of polygons cross lines of cell centers, (k,) each.

    Attributes
    ----------
    line : array of int
        Row or column of centers.
    position : array
        Position along it, in cells; the center of cell i is at i.
    """

    line: IntArray
    position: FloatArray


@dataclass(frozen=True, eq=False)
class CellGrid:
    """A grid over a map with one spare cell on each side.

    Attributes
    ----------
    rows, columns : int
    cell : float, m
        Side of a cell.
    origin : (float, float), m
        Lower left corner.
    """

    rows: int
    columns: int
    cell: float
    origin: tuple[float, float]

    def find_covered_cells(self, geometry: BaseGeometry, subdivision: int = 1) -> BoolArray:
        """Find the cells whose center lies inside polygons.

        Parameters
        ----------
        geometry : polygons, m
        subdivision : int
            Number of smaller cells along each side of a cell.

        Returns
        -------
        (rows * subdivision, columns * subdivision) array of bool
            The lowest row first.
        """
        rows = self.rows * subdivision
        columns = self.columns * subdivision
        row, position = self._find_crossings(geometry, subdivision)
        is_inside = (row >= 0) & (row < rows)
        # At each crossing, all cells to the right change between inside and outside. Two crossings in the
        # same cell cancel, so only the parity of their number counts.
        changes = np.zeros((rows, columns + 1), np.uint8)
        column = np.clip(np.ceil(position[is_inside]).astype(np.intp), 0, columns)
        np.add.at(changes, (row[is_inside], column), 1)
        changes &= 1
        return np.bitwise_xor.accumulate(changes, axis=1)[:, :-1].astype(bool)

    def find_thin_walls(self, geometry: BaseGeometry) -> BoolArray:
        """Find cells for the walls between polygons that are too thin to contain the center of a cell.

        Parameters
        ----------
        geometry : polygons, m

        Returns
        -------
        (rows, columns) array of bool
            The lowest row first.

        Notes
        -----
        This is the grid-intersection digitization of thin sets (Klette and Rosenfeld 2004, Digital Geometry,
        chapter 2): along each row and column of centers, one cell of each interval outside the polygons.
        Together with the cells whose center is outside, these cells are connected regardless of the positions
        of the walls.
        """
        cells = np.zeros((self.rows, self.columns), dtype=bool)
        for view, is_transposed in ((cells, False), (cells.T, True)):
            line, position = self._find_crossings(geometry, transposed=is_transposed)
            order = np.lexsort((position, line))
            line = line[order]
            position = position[order]
            # Along each line, entries into the polygons and exits from them alternate. A wall is between an
            # exit and the following entry.
            first_on_line = np.searchsorted(line, line)
            number_on_line = np.arange(len(line)) - first_on_line
            exits = np.flatnonzero(number_on_line % 2)
            if len(exits) and exits[-1] == len(line) - 1:
                exits = exits[:-1]
            # A wall around a single center marks the cell of that center, which is outside the polygons
            # anyway. So a wall that ends at a center gives the same cells however its ends were rounded.
            is_narrow = np.ceil(position[exits + 1]) - np.ceil(position[exits]) <= 1
            exits = exits[(line[exits] == line[exits + 1]) & is_narrow]
            middle = np.rint((position[exits] + position[exits + 1]) / 2).astype(np.intp)
            view[line[exits], middle] = True
        return cells

    def _find_crossings(
        self, area: BaseGeometry, subdivision: int = 1, *, transposed: bool = False
    ) -> _Crossings:
        """Find the crossings of polygons with the rows of cell centers, or with columns if `transposed`."""
        sides = (extract_sides(area) - self.origin) / (self.cell / subdivision) - 0.5
        if transposed:
            sides = sides[..., ::-1]
        x0, y0 = sides[:, 0].T
        x1, y1 = sides[:, 1].T
        # Each side crosses the lines from its lower end, inclusive, to its upper end.
        low = np.ceil(np.minimum(y0, y1)).astype(np.intp)
        count = np.ceil(np.maximum(y0, y1)).astype(np.intp) - low
        line = concatenate_ranges(low, count)
        side = np.arange(len(low)).repeat(count)
        slope = np.divide(x1 - x0, y1 - y0, out=np.zeros_like(x0), where=count > 0)
        return _Crossings(line, x0[side] + (line - y0[side]) * slope[side])


def build_grid(environment: Environment, cell: float | None, maximum: int = MAX_CELLS) -> CellGrid:
    """Build a grid over the boundary of a map.

    A map that was imported from cells of the same size gets the same cells again.

    Parameters
    ----------
    environment : Environment
    cell : float or None, m
        Side of a cell. None stands for `DEFAULT_CELL_M`.
    maximum : int
        Maximum number of cells.

    Raises
    ------
    ParameterError
        If the grid would have more cells.
    """
    cell = get_or_default(cell, DEFAULT_CELL_M)
    low_x, low_y, high_x, high_y = environment.boundary_polygon.bounds
    # An excess of less than a thousandth of a cell, due to rounding, does not add another column or row.
    columns = math.ceil((high_x - low_x) / cell - 1e-3) + 2
    rows = math.ceil((high_y - low_y) / cell - 1e-3) + 2
    if rows * columns > maximum:
        expected = f"expected at most {maximum // 1_000_000} million cells"
        raise ParameterError(f"cell: {expected}, got {columns} x {rows} of {cell:g} m")
    origin = (round(low_x - cell, _DIGITS), round(low_y - cell, _DIGITS))
    return CellGrid(rows, columns, cell, origin)


def find_free_cells(environment: Environment, grid: CellGrid) -> BoolArray:
    """Find the free cells of a grid.

    A cell is free if its center is, and if neither a thin wall nor a small pillar blocks it. So a robot that
    moves between cells that share a side never passes through a wall of the map.

    Parameters
    ----------
    environment : Environment
    grid : CellGrid

    Returns
    -------
    (rows, columns) array of bool
        The lowest row first.

    Raises
    ------
    ParameterError
        If no cell is free.
    """
    free = grid.find_covered_cells(environment.free) & ~grid.find_thin_walls(environment.free)
    # Obstacles smaller than a cell may lie between the lines of cell centers.
    rings = [ring for part in environment.free.geoms for ring in part.interiors]
    holes = np.array([shapely.polygons(ring) for ring in rings])
    # `reshape` gives zero rows if there are no holes.
    bounds = shapely.bounds(holes).reshape(-1, 4)
    is_small = (bounds[:, 2:] - bounds[:, :2]).max(axis=1, initial=0.0) < grid.cell
    inside = shapely.get_coordinates(shapely.point_on_surface(holes[is_small]))
    column, row = np.floor((inside - grid.origin) / grid.cell).astype(np.intp).T
    free[row, column] = False
    if not free.any():
        raise ParameterError(f"cell: no cell of {grid.cell:g} m is free, expected a smaller size")
    return free


def describe_lost_passages(environment: Environment, grid: CellGrid, free: BoolArray) -> tuple[str, ...]:
    """Describe which parts of the free space the cells lose or divide, and which cell size would keep them.

    Parameters
    ----------
    environment : Environment
    grid : CellGrid
    free : (rows, columns) array of bool
        The free cells.

    Returns
    -------
    tuple of str
        Empty if nothing is lost.
    """
    losses = _describe_losses(environment, grid, free)
    if not losses:
        return ()
    for cell in _iterate_smaller_sizes(grid.cell):
        try:
            finer = build_grid(environment, cell, _MAX_TRIED_CELLS)
        except ParameterError:
            maximum = f"at most {_MAX_TRIED_CELLS // 1_000_000} million"
            return (f"{losses}; no grid of {maximum} cells keeps it",)
        if not _describe_losses(environment, finer, find_free_cells(environment, finer)):
            return (f"{losses}; cells of {cell:g} m keep it (--cell {cell:g})",)
    return ()


def _describe_losses(environment: Environment, grid: CellGrid, free: BoolArray) -> str:
    """Describe how many parts of the free space the cells lose, and how many they divide.

    The result is empty if the cells have the same parts as the map.
    """
    parts = np.array(environment.free.geoms)
    parts = parts[shapely.area(parts) >= _MIN_PART_AREA_M2]
    islands, _ = ndimage.label(free)
    areas = np.bincount(islands.ravel())[1:] * grid.cell**2
    large = np.flatnonzero(areas >= _MIN_PART_AREA_M2)
    is_single_part_whole = len(parts) == len(large) == 1
    if len(parts) == 0 or is_single_part_whole:
        return ""
    # Each connected group of free cells ("island") belongs to the part of the map nearest to it. A part
    # without islands is lost; a part with several is divided.
    centers = _find_island_cells(islands, large, grid)
    island_counts = np.bincount(shapely.STRtree(parts).nearest(shapely.points(centers)), minlength=len(parts))
    losses = []
    lost = int((island_counts == 0).sum())
    if lost:
        verb = "is" if lost == 1 else "are"
        losses.append(f"{format_count(lost, 'separate part')} of the free space {verb} lost")
    if (island_counts > 1).any():
        separate = format_count(len(large), "separate part")
        losses.append(f"gaps close: the free space has {separate} instead of {len(parts)}")
    return "; ".join(losses)


def _find_island_cells(islands: NDArray[np.integer], chosen: IntArray, grid: CellGrid) -> FloatArray:
    """Return the center of the first cell of each chosen island, (n, 2) m.

    `islands` contains the number of the island of each cell, from 1; `chosen` contains indices from 0.
    """
    windows = ndimage.find_objects(islands)
    cells = []
    for island in chosen.tolist():
        rows, columns = windows[island]
        row, column = np.argwhere(islands[rows, columns] == island + 1)[0]
        cells.append((column + columns.start, row + rows.start))
    return (np.array(cells, dtype=float).reshape(-1, 2) + 0.5) * grid.cell + grid.origin


def _iterate_smaller_sizes(cell: float) -> Iterator[float]:
    """Yield round cell sizes (5, 2 or 1 times a power of ten) below that of a cell, m, the largest first."""
    for power in itertools.count(math.floor(-math.log10(cell))):
        for digit in (5, 2, 1):
            size = round(digit * 10.0**-power, power)
            if size < cell * (1 - 1e-9):
                yield size


def describe_unsupported(environment: Environment, *, names: bool = True) -> tuple[str, ...]:
    """Describe the properties of a map that a format cannot store.

    Parameters
    ----------
    environment : Environment
    names : bool
        Whether to include names of obstacles, which most formats cannot store.
    """
    unsupported = []
    if environment.starts:
        unsupported.append(f"starts: {', '.join(environment.starts)}")
    if names and any(obstacle.name for obstacle in environment.obstacles):
        unsupported.append("names of obstacles")
    return tuple(unsupported)


def build_grid_report(
    name: str, files: tuple[Path, ...], environment: Environment, grid: CellGrid, free: BoolArray
) -> ExportReport:
    """Build the report on a map that was exported as a grid of cells.

    Parameters
    ----------
    name : str
        Name of the format.
    files : tuple of Path
    environment : Environment
    grid : CellGrid
    free : (rows, columns) array of bool
    """
    area = float(np.count_nonzero(free)) * grid.cell**2
    report = ExportReport(
        format=name,
        files=files,
        area=environment.free_area,
        area_written=area,
        dropped=describe_unsupported(environment),
    )
    return replace(report, warnings=describe_lost_passages(environment, grid, free))
