"""A map as cells of a grid: a cell is free where its centre is."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import shapely
from scipy import ndimage

from robocov.arrays.grouping import ranges
from robocov.errors import ParameterError
from robocov_app.importers.limits import MAX_CELLS

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

    from robocov.arrays import BoolArray
    from robocov.environment import Environment

CELL = 0.05
"""Side of a cell in metres where none is given: what maps of robots mostly have."""

_DIGITS = 6
"""Decimals of a grid's corner: a micrometre."""


@dataclass(frozen=True, eq=False)
class Grid:
    """A grid over a map, with one cell to spare on each side.

    Attributes
    ----------
    rows, columns : int
    cell : float, m
    origin : (x, y), m
        Lower left corner of the lower left cell.
    """

    rows: int
    columns: int
    cell: float
    origin: tuple[float, float]

    def covered(self, geometry: BaseGeometry, finer: int = 1) -> BoolArray:
        """Return which cells have their centre in polygons, (rows, columns), the lowest row first.

        With `finer` each cell is so many by so many, all of which are returned.
        """
        cell = self.cell / finer
        rows, columns = self.rows * finer, self.columns * finer
        rings = shapely.get_rings(shapely.get_parts(geometry))
        points, ring = shapely.get_coordinates(rings, return_index=True)
        same = ring[1:] == ring[:-1]
        # from here on a cell is 1 wide, and centres are at whole numbers
        points = (points - self.origin) / cell - 0.5
        (x0, y0), (x1, y1) = points[:-1][same].T, points[1:][same].T
        # each side crosses the rows from its lower end, that one too, to its upper end
        low = np.ceil(np.minimum(y0, y1)).astype(np.intp)
        count = np.ceil(np.maximum(y0, y1)).astype(np.intp) - low
        row = ranges(low, count)
        side = np.arange(len(low)).repeat(count)
        slope = np.divide(x1 - x0, y1 - y0, out=np.zeros_like(x0), where=count > 0)
        column = np.ceil(x0[side] + (row - y0[side]) * slope[side]).astype(np.intp)
        inside = (row >= 0) & (row < rows)
        # a crossing turns all that is to the right of it
        turns = np.zeros((rows, columns + 1), np.uint8)
        np.add.at(turns, (row[inside], np.clip(column[inside], 0, columns)), 1)
        turns &= 1
        return np.bitwise_xor.accumulate(turns, axis=1)[:, :-1].astype(bool)


def grid_over(environment: Environment, cell: float | None) -> Grid:
    """Return a grid over the boundary of `environment`; what was made of cells of that size meets them again.

    Parameters
    ----------
    environment : Environment
    cell : float or None, m
        Side of a cell; `CELL` by default.

    Raises
    ------
    ParameterError
        When there are more than `limits.MAX_CELLS`.
    """
    cell = CELL if cell is None else cell
    low_x, low_y, high_x, high_y = environment.boundary_polygon.bounds
    # to a thousandth of a cell, so that a wall on the last line of cells needs no more of them
    columns = math.ceil((high_x - low_x) / cell - 1e-3) + 2
    rows = math.ceil((high_y - low_y) / cell - 1e-3) + 2
    if rows * columns > MAX_CELLS:
        raise ParameterError(
            f"cell: {cell:g} m makes {columns} x {rows} cells, but at most {MAX_CELLS // 1_000_000} million "
            f"were wanted"
        )
    return Grid(rows, columns, cell, (round(low_x - cell, _DIGITS), round(low_y - cell, _DIGITS)))


def free_cells(environment: Environment, grid: Grid) -> tuple[BoolArray, tuple[str, ...]]:
    """Return which cells of `grid` are free, (rows, columns), the lowest row first, and what is lost by it.

    Raises
    ------
    ParameterError
        When none is.
    """
    free = grid.covered(environment.free)
    if not free.any():
        raise ParameterError(f"cell: with {grid.cell:g} m no cell is free, but a smaller one was wanted")
    _, parts = ndimage.label(free)
    before = len(environment.free.geoms)
    if parts <= before:
        return free, ()
    return free, (f"the free space falls into {parts} parts, not {before}: a smaller cell keeps gaps open",)


def not_held(environment: Environment) -> tuple[str, ...]:
    """Return what of `environment` no raster format holds, in words."""
    lost = []
    if environment.starts:
        lost.append(f"starts: {', '.join(environment.starts)}")
    if any(obstacle.name for obstacle in environment.obstacles):
        lost.append("names of obstacles")
    return tuple(lost)
