"""The rectangles of cells outside which scans cannot change a map."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray
from robocov.planning.raster import Raster


class ScanAreas(NamedTuple):
    """Rectangles of cells, one for each scan. A scan changes no cell outside its rectangle.

    Examples
    --------
    >>> from robocov.observation.region import Region
    >>> region = Region(np.array([[0.0, 0.0], [8.0, 0.0], [8.0, 4.0], [0.0, 4.0]]))
    >>> raster = Raster(region, cell_size=1.0)
    >>> areas = ScanAreas.build(np.array([[1.5, 1.5], [6.5, 1.5]]), np.array([0.6, 0.6]), raster)
    >>> areas.mark(raster).sum(axis=0)
    array([4, 4, 4, 4, 4, 4, 4, 4])
    """

    first_rows: IntArray
    """(k,)"""
    last_rows: IntArray
    """(k,) Included in the rectangle."""
    first_columns: IntArray
    """(k,)"""
    last_columns: IntArray
    """(k,) Included in the rectangle."""

    @classmethod
    def build(cls, positions: Array, ranges: Array, raster: Raster) -> ScanAreas:
        """Build the rectangles of scans.

        Parameters
        ----------
        positions : (k, 2) array, m
            Positions from which the scans were taken.
        ranges : (k,) array, m
            Length of the longest ray of each scan.
        raster : Raster

        Returns
        -------
        ScanAreas
        """
        # Rays end in the cell behind the obstacle that they hit. One more cell is for rounding.
        reach = ranges[:, None] + 2.0 * raster.cell_size
        first_rows, first_columns = raster.find_cells(positions - reach)
        last_rows, last_columns = raster.find_cells(positions + reach)
        return cls(first_rows, last_rows, first_columns, last_columns)

    def overlap(self, others: ScanAreas) -> BoolArray:
        """Find the rectangles that overlap at least one of the others.

        Parameters
        ----------
        others : ScanAreas
            m rectangles.

        Returns
        -------
        (k,) bool array
        """
        rows_overlap = (self.first_rows[:, None] <= others.last_rows) & (
            self.last_rows[:, None] >= others.first_rows
        )
        columns_overlap = (self.first_columns[:, None] <= others.last_columns) & (
            self.last_columns[:, None] >= others.first_columns
        )
        return np.asarray((rows_overlap & columns_overlap).any(axis=1))

    def mark(self, raster: Raster) -> BoolArray:
        """Return a mask of the cells that are in at least one rectangle, (rows, columns)."""
        is_inside = np.zeros(raster.shape, dtype=bool)
        for first_row, last_row, first_column, last_column in zip(*self, strict=True):
            is_inside[first_row : last_row + 1, first_column : last_column + 1] = True
        return is_inside
