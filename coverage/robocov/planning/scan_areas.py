"""Bounding boxes, in cells, of the areas that scans can change."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from robocov.planning.raster import Raster
from robocov.typing import BoolArray, FloatArray, IntArray


class ScanAreas(NamedTuple):
    """Bounding boxes of the cells that each of k scans can change.

    Examples
    --------
    >>> from robocov.observation.region import Region
    >>> region = Region(np.array([[0.0, 0.0], [12.0, 0.0], [12.0, 4.0], [0.0, 4.0]]))
    >>> raster = Raster(region, cell_size=1.0)
    >>> areas = ScanAreas.build(np.array([[5.5, 1.5]]), np.array([1.0]), raster)
    >>> areas.mark(raster).sum(axis=0)
    array([0, 0, 4, 4, 4, 4, 4, 4, 4, 0, 0, 0])
    """

    first_rows: IntArray
    """(k,) First row of each box."""
    last_rows: IntArray
    """(k,) Last row, inclusive."""
    first_columns: IntArray
    """(k,) First column."""
    last_columns: IntArray
    """(k,) Last column, inclusive."""

    @classmethod
    def build(cls, positions: FloatArray, ranges: FloatArray, raster: Raster) -> ScanAreas:
        """Build the bounding boxes of scans.

        Parameters
        ----------
        positions : (k, 2) array, m
            Positions from which the scans were taken.
        ranges : (k,) array, m
            Radius around each position within which the scan changes cells.
        raster : Raster

        Returns
        -------
        ScanAreas
        """
        # The hit of a ray may be marked in the cell behind the surface of the obstacle. Another cell is added
        # for rounding errors. Boxes end at the border of the raster.
        reach = ranges[:, None] + 2.0 * raster.cell_size
        first_rows, first_columns = raster.find_cells(positions - reach)
        last_rows, last_columns = raster.find_cells(positions + reach)
        return cls(first_rows, last_rows, first_columns, last_columns)

    def overlaps_any(self, others: ScanAreas) -> BoolArray:
        """Return whether each box overlaps at least one of m others.

        Parameters
        ----------
        others : ScanAreas

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
        """Return a mask of the cells that are in at least one box, (rows, columns)."""
        is_inside = np.zeros(raster.shape, dtype=bool)
        for first_row, last_row, first_column, last_column in zip(*self, strict=True):
            is_inside[first_row : last_row + 1, first_column : last_column + 1] = True
        return is_inside
