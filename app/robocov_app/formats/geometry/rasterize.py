"""A map as cells of a grid: free where their centre is, and walls that are thinner than a cell stay whole."""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import shapely
from scipy import ndimage
from shapely.geometry.base import BaseGeometry

from robocov.arrays import Array, BoolArray, IntArray, concatenate_ranges
from robocov.defaults import DEFAULT_RADIUS_M
from robocov.environment import Environment
from robocov.errors import ParameterError, format_count
from robocov_app.formats.base import ExportReport
from robocov_app.formats.files import MAX_CELLS
from robocov_app.formats.geometry.crossings import extract_sides

DEFAULT_CELL_M = 0.05  # side of a cell in metres where none is given: what maps of robots mostly have
_LEAST = math.pi * DEFAULT_RADIUS_M**2  # parts of the free space without room for a robot do not count, m²
_MOST_TRIED = 16_000_000  # cells of grids that are tried for whether they keep what others lose
_DIGITS = 6  # decimals of a grid's corner: a micrometre


@dataclass(frozen=True, eq=False)
class CellGrid:
    """A grid over a map, one cell to spare on each side; `origin`, m, is its lower left corner."""

    rows: int
    columns: int
    cell: float
    origin: tuple[float, float]

    def covered(self, geometry: BaseGeometry, finer: int = 1) -> BoolArray:
        """Return which cells, or `finer` ones, have their centre in polygons, the lowest row first."""
        rows, columns = self.rows * finer, self.columns * finer
        row, at = self._crossings(geometry, finer)
        inside = (row >= 0) & (row < rows)
        # a crossing turns all that is to the right of it
        turns = np.zeros((rows, columns + 1), np.uint8)
        np.add.at(turns, (row[inside], np.clip(np.ceil(at[inside]).astype(np.intp), 0, columns)), 1)
        turns &= 1
        return np.bitwise_xor.accumulate(turns, axis=1)[:, :-1].astype(bool)

    def between(self, geometry: BaseGeometry) -> BoolArray:
        """Return the cells amid what lies outside of polygons and is too thin to have a centre in it.

        The grid-intersection digitization of thin things (Klette and Rosenfeld 2004, Digital Geometry,
        chapter 2): of each interval outside of the polygons on a line of centres, along rows and along
        columns, one cell. With those whose centre is outside they hang together where what is outside does.
        """
        found = np.zeros((self.rows, self.columns), dtype=bool)
        for cells, across in ((found, False), (found.T, True)):
            line, at = self._crossings(geometry, across=across)
            order = np.lexsort((at, line))
            line, at = line[order], at[order]
            # on each line they go in and out by turns
            ends = np.flatnonzero((np.arange(len(line)) - np.searchsorted(line, line)) % 2)
            ends = ends[:-1] if len(ends) and ends[-1] == len(line) - 1 else ends
            # where they contain one centre it is that cell, however both ways of counting have rounded
            narrow = np.ceil(at[ends + 1]) - np.ceil(at[ends]) <= 1
            ends = ends[(line[ends] == line[ends + 1]) & narrow]
            cells[line[ends], np.rint((at[ends] + at[ends + 1]) / 2).astype(np.intp)] = True
        return found

    def _crossings(self, area: BaseGeometry, finer: int = 1, across: bool = False) -> tuple[IntArray, Array]:
        """Return where sides cross lines of centres, rows or columns: which one, and where on it."""
        sides = (extract_sides(area) - self.origin) / (self.cell / finer) - 0.5
        if across:
            sides = sides[..., ::-1]
        (x0, y0), (x1, y1) = sides[:, 0].T, sides[:, 1].T
        # each side crosses the lines from its lower end, that one too, to its upper end
        low = np.ceil(np.minimum(y0, y1)).astype(np.intp)
        count = np.ceil(np.maximum(y0, y1)).astype(np.intp) - low
        line = concatenate_ranges(low, count)
        side = np.arange(len(low)).repeat(count)
        slope = np.divide(x1 - x0, y1 - y0, out=np.zeros_like(x0), where=count > 0)
        return line, x0[side] + (line - y0[side]) * slope[side]


def build_grid(environment: Environment, cell: float | None, most: int = MAX_CELLS) -> CellGrid:
    """Return a grid over the boundary, which meets the cells that it was made of; at `most` so many cells."""
    cell = DEFAULT_CELL_M if cell is None else cell
    low_x, low_y, high_x, high_y = environment.boundary_polygon.bounds
    # to a thousandth of a cell, so that a wall on the last line of cells needs no more of them
    columns = math.ceil((high_x - low_x) / cell - 1e-3) + 2
    rows = math.ceil((high_y - low_y) / cell - 1e-3) + 2
    if rows * columns > most:
        few = f"expected at most {most // 1_000_000} million"
        raise ParameterError(f"cell: {few} cells, got {columns} x {rows} of {cell:g} m")
    return CellGrid(rows, columns, cell, (round(low_x - cell, _DIGITS), round(low_y - cell, _DIGITS)))


def find_free_cells(environment: Environment, grid: CellGrid) -> BoolArray:
    """Return which cells of `grid` are free, (rows, columns), the lowest row first; ParameterError if none.

    A cell is free if its centre is, and nothing solid is lost: no wall is too thin, and no pillar too small,
    to block a cell: where robots drive from side to side of cells they drive on the map.
    """
    free = grid.covered(environment.free) & ~grid.between(environment.free)
    # what is smaller than a cell may lie between all lines of centres
    holes = np.array([shapely.polygons(ring) for part in environment.free.geoms for ring in part.interiors])
    sides = shapely.bounds(holes).reshape(-1, 4)
    small = (sides[:, 2:] - sides[:, :2]).max(axis=1, initial=0.0) < grid.cell
    inside = shapely.get_coordinates(shapely.point_on_surface(holes[small]))
    column, row = np.floor((inside - grid.origin) / grid.cell).astype(np.intp).T
    free[row, column] = False
    if not free.any():
        raise ParameterError(f"cell: no cell of {grid.cell:g} m is free, expected a smaller size")
    return free


def describe_lost_passages(environment: Environment, grid: CellGrid, free: BoolArray) -> tuple[str, ...]:
    """Return what free space is lost in cells, or falls apart, and which cells would keep it."""
    lost = _lost(environment, grid, free)
    if not lost:
        return ()
    for cell in _iterate_smaller_sizes(grid.cell):
        try:
            finer = build_grid(environment, cell, _MOST_TRIED)
        except ParameterError:
            most = f"at most {_MOST_TRIED // 1_000_000} million"
            return (f"{lost}; no cells of which there are {most} keep it",)
        if not _lost(environment, finer, find_free_cells(environment, finer)):
            return (f"{lost}; cells of {cell:g} m keep it (--cell {cell:g})",)
    return ()


def _lost(environment: Environment, grid: CellGrid, free: BoolArray) -> str:
    parts = np.array(environment.free.geoms)
    parts = parts[shapely.area(parts) >= _LEAST]
    islands, _ = ndimage.label(free)
    large = np.flatnonzero(np.bincount(islands.ravel())[1:] * grid.cell**2 >= _LEAST)
    if len(parts) == 0 or len(parts) == len(large) == 1:
        return ""
    places, windows = [], ndimage.find_objects(islands)
    for k in large.tolist():
        row, column = np.argwhere(islands[windows[k]] == k + 1)[0]
        places.append((column + windows[k][1].start, row + windows[k][0].start))
    centres = (np.array(places, dtype=float).reshape(-1, 2) + 0.5) * grid.cell + grid.origin
    pieces = np.bincount(shapely.STRtree(parts).nearest(shapely.points(centres)), minlength=len(parts))
    words = []
    if (pieces == 0).any():
        gone = int((pieces == 0).sum())
        are = "is" if gone == 1 else "are"
        words.append(f"{format_count(gone, 'separate part')} of the free space {are} lost")
    if (pieces > 1).any():
        words.append(f"gaps close: the free space falls into {len(large)} parts, not {len(parts)}")
    return "; ".join(words)


def _iterate_smaller_sizes(cell: float) -> Iterator[float]:
    """Return round sizes below that of a cell, the largest first."""
    for power in itertools.count(math.floor(-math.log10(cell))):
        for digit in (5, 2, 1):
            if (size := round(digit * 10.0**-power, power)) < cell * (1 - 1e-9):
                yield size


def describe_unsupported(environment: Environment, *, names: bool = True) -> tuple[str, ...]:
    """Return what of `environment` a format has no place for, in words; most have none for `names`."""
    lost = [f"starts: {', '.join(environment.starts)}"] if environment.starts else []
    if names and any(obstacle.name for obstacle in environment.obstacles):
        lost.append("names of obstacles")
    return tuple(lost)


def build_grid_report(
    name: str, files: tuple[Path, ...], environment: Environment, grid: CellGrid, free: BoolArray
) -> ExportReport:
    area = float(np.count_nonzero(free)) * grid.cell**2
    report = ExportReport(name, files, environment.free_area, area, describe_unsupported(environment))
    return replace(report, warnings=describe_lost_passages(environment, grid, free))
