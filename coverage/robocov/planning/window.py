"""The rectangular part of a raster that a lattice of nodes covers."""

from __future__ import annotations

import math
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from robocov.planning.raster import Raster
from robocov.typing import FloatArray, IntArray

_MIN_HALF_WIDTH_CELLS = 4
"""Minimum of half the width of a window."""
_STEPS_PER_HALF_WIDTH = 4
"""A window moves in steps of half its width divided by this number."""

CellValue = TypeVar("CellValue", bound=np.generic)


class Window(NamedTuple):
    """A rectangle of square blocks of cells in a raster, with a node in the middle of each block."""

    first_row: int
    """The lowest row of cells."""
    first_column: int
    """The leftmost column of cells."""
    rows: int
    """Number of rows of nodes."""
    columns: int
    """Number of columns of nodes."""
    stride: int
    """Number of cells along the side of a block."""

    @classmethod
    def build_around(cls, raster: Raster, center: FloatArray, half_width: float, max_nodes: int) -> Window:
        """Build the window around a point, with the smallest possible blocks.

        Parameters
        ----------
        raster : Raster
        center : (2,) array, m
        half_width : float, m
            Half the width and half the height of the window, which may be a little larger: it moves in steps
            of a quarter of this length, so that it stays the same while the center barely moves. Infinite
            for the whole raster.
        max_nodes : int
            Maximum number of nodes.

        Returns
        -------
        Window
        """
        rows, columns = raster.shape
        row, column = raster.find_cells(np.asarray(center, dtype=float))
        if math.isinf(half_width):
            half_width_cells = rows + columns
        else:
            half_width_cells = max(_MIN_HALF_WIDTH_CELLS, math.ceil(half_width / raster.cell_size))
        low_row, high_row = _compute_stepped_interval(int(row), half_width_cells, rows)
        low_column, high_column = _compute_stepped_interval(int(column), half_width_cells, columns)
        height = high_row - low_row
        width = high_column - low_column
        # The stride is the smallest one, starting from an estimate, for which there are not too many nodes.
        stride = max(1, math.floor(math.sqrt(height * width / max_nodes)))
        while math.ceil(height / stride) * math.ceil(width / stride) > max_nodes:
            stride += 1
        return cls(
            first_row=low_row,
            first_column=low_column,
            rows=math.ceil(height / stride),
            columns=math.ceil(width / stride),
            stride=stride,
        )

    @property
    def shape(self) -> tuple[int, int]:
        """Number of rows and columns of cells. The last ones may lie beyond the raster."""
        return self.rows * self.stride, self.columns * self.stride

    @property
    def block_shape(self) -> tuple[int, int, int, int]:
        """Shape of the cells by block: rows of blocks, rows in each, columns of blocks, columns in each."""
        return self.rows, self.stride, self.columns, self.stride

    def crop(self, cells: NDArray[CellValue], fill: CellValue | bool) -> NDArray[CellValue]:
        """Crop an array of cells to the window.

        Parameters
        ----------
        cells : (rows, columns) array
            Values of all cells of the raster.
        fill : scalar
            Value for the cells of the window that lie beyond the raster.

        Returns
        -------
        (h, w) array
            h and w are those of `shape`.
        """
        height, width = self.shape
        cropped = cells[
            self.first_row : self.first_row + height, self.first_column : self.first_column + width
        ]
        missing_rows = height - cropped.shape[0]
        missing_columns = width - cropped.shape[1]
        if missing_rows == 0 and missing_columns == 0:
            return cropped
        return np.pad(cropped, ((0, missing_rows), (0, missing_columns)), constant_values=fill)

    def compute_nodes(self, raster: Raster) -> FloatArray:
        """Compute the positions of the nodes, row by row.

        Parameters
        ----------
        raster : Raster

        Returns
        -------
        (m, 2) array, m
        """
        row, column = self.compute_node_cells().T
        return raster.compute_centers(row + self.first_row, column + self.first_column)

    def find_nodes(self, rows: IntArray, columns: IntArray) -> IntArray:
        """Find the node that represents each of the given cells: the one in the middle of the cell's block.

        Parameters
        ----------
        rows, columns : (...) int arrays
            Rows and columns of the cells in the window.

        Returns
        -------
        (...) int array
            Indices of the nodes.

        Examples
        --------
        >>> window = Window(first_row=0, first_column=0, rows=2, columns=3, stride=5)
        >>> window.find_nodes(np.array([4, 5]), np.array([10, 10]))
        array([2, 5])
        """
        block_rows = rows // self.stride
        block_columns = columns // self.stride
        return np.asarray(block_rows * self.columns + block_columns)

    def compute_node_cells(self) -> IntArray:
        """Compute the row and column, within the window, of the cell in which each node lies.

        Returns
        -------
        (m, 2) int array
            Row by row.
        """
        blocks = np.mgrid[: self.rows, : self.columns].reshape(2, -1).T
        return np.ascontiguousarray(blocks * self.stride + self.stride // 2)


def _compute_stepped_interval(middle: int, half_width: int, count: int) -> tuple[int, int]:
    """Return the bounds of an interval of cells around `middle`, rounded outward to whole steps.

    Because of the rounding, the interval stays the same while the middle moves only a little. The bounds are
    clipped to the cells from 0 up to `count`.
    """
    step = max(1, half_width // _STEPS_PER_HALF_WIDTH)
    low = (middle - half_width) // step * step
    high = math.ceil((middle + half_width + 1) / step) * step
    return max(0, low), min(count, high)
