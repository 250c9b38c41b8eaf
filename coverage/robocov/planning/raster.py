"""Square cells that cover the bounding box of a region."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from robocov.compiled import kernel
from robocov.observation.region import Region
from robocov.typing import BoolArray, FloatArray, IntArray

SIDE_STEPS = ((0, 1), (1, 0), (0, -1), (-1, 0))
"""Steps, in rows and columns, to the four cells that share a side with a cell: right, above, left, below."""
_ROUNDING_CELLS = 1e-9
"""Length, in cells, that is attributed to rounding: it does not add another row or column."""


class CellGrid(NamedTuple):
    """Lower left corner and cell size of a raster, for kernels."""

    low_x: float
    """x coordinate of the lower left corner, m."""
    low_y: float
    """y coordinate of that corner, m."""
    cell_size: float
    """Side of a cell, m."""


@dataclass(frozen=True, eq=False)
class Raster:
    """Square cells that cover the bounding box of a region, the lowest row first.

    Parameters
    ----------
    region : Region
    cell_size : float, m
        Length of the sides of a cell.

    Examples
    --------
    >>> region = Region(np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]]))
    >>> raster = Raster(region, cell_size=0.5)
    >>> raster.shape
    (2, 4)
    >>> row, column = raster.find_cells(np.array([1.6, 0.2]))
    >>> int(row), int(column)
    (0, 3)
    >>> raster.compute_centers(row, column)
    array([1.75, 0.25])
    """

    region: Region
    cell_size: float

    @property
    def origin(self) -> tuple[float, float]:
        """Lower left corner, m."""
        return self.region.bounds[:2]

    @property
    def grid(self) -> CellGrid:
        """Lower left corner and cell size."""
        low_x, low_y = self.origin
        return CellGrid(low_x=low_x, low_y=low_y, cell_size=self.cell_size)

    @cached_property
    def shape(self) -> tuple[int, int]:
        """Number of rows and of columns."""
        low_x, low_y, high_x, high_y = self.region.bounds
        rows = max(1, math.ceil((high_y - low_y) / self.cell_size - _ROUNDING_CELLS))
        columns = max(1, math.ceil((high_x - low_x) / self.cell_size - _ROUNDING_CELLS))
        return rows, columns

    @cached_property
    def is_outside(self) -> BoolArray:
        """Whether the center of each cell is outside the region, (rows, columns)."""
        rows, columns = np.indices(self.shape)
        return np.asarray(~self.region.contains(self.compute_centers(rows, columns)))

    def compute_centers(self, rows: IntArray, columns: IntArray) -> FloatArray:
        """Compute the centers of cells.

        Parameters
        ----------
        rows, columns : (...) int arrays

        Returns
        -------
        (..., 2) array, m
        """
        x, y = self.origin
        return np.stack([x + (columns + 0.5) * self.cell_size, y + (rows + 0.5) * self.cell_size], axis=-1)

    def find_cells(self, points: FloatArray) -> tuple[IntArray, IntArray]:
        """Find the cells that contain points. A point outside the raster belongs to the nearest cell.

        Parameters
        ----------
        points : (..., 2) array, m

        Returns
        -------
        rows, columns : (...) int arrays
        """
        rows, columns = self.shape
        cells = np.floor((points - self.origin) * (1.0 / self.cell_size)).astype(np.intp)
        cells = np.minimum(np.maximum(cells, 0), (columns - 1, rows - 1))
        return cells[..., 1], cells[..., 0]


@kernel
def find_row(y: float, grid: CellGrid, rows: int) -> int:
    """Return the row of cells at a y coordinate. Outside the raster, it is the nearest row.

    Parameters
    ----------
    y : float, m
    grid : CellGrid
    rows : int
        Number of rows.

    Returns
    -------
    int
    """
    return min(max(math.floor((y - grid.low_y) / grid.cell_size), 0), rows - 1)


@kernel
def find_column(x: float, grid: CellGrid, columns: int) -> int:
    """Return the column of cells at an x coordinate. Outside the raster, it is the nearest column.

    Parameters
    ----------
    x : float, m
    grid : CellGrid
    columns : int
        Number of columns.

    Returns
    -------
    int
    """
    return min(max(math.floor((x - grid.low_x) / grid.cell_size), 0), columns - 1)
