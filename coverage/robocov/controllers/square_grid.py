"""A grid of squares over a region."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter

from robocov.observation.region import Region
from robocov.typing import BoolArray, FloatArray

_ROUNDING_TOLERANCE = 1e-9
"""Fraction of a square by which the region may exceed the grid because of rounding."""


@dataclass(frozen=True, slots=True, eq=False)
class SquareGrid:
    """Squares that cover a region, in which robots measure the density."""

    centers: FloatArray
    """(s, 2) m, row by row from the lowest."""
    is_inside: BoolArray
    """(s,) Whether the center of each square is in the region."""
    shape: tuple[int, int]
    """Number of rows and columns."""
    side: float
    """Side of a square, m."""

    @classmethod
    def build(cls, region: Region, squares_per_side: int) -> SquareGrid:
        """Build a grid with a given number of squares along the longer side of the bounding box."""
        low_x, low_y, high_x, high_y = region.bounds
        side = max(high_x - low_x, high_y - low_y) / squares_per_side
        columns = int(np.ceil((high_x - low_x) / side - _ROUNDING_TOLERANCE))
        rows = int(np.ceil((high_y - low_y) / side - _ROUNDING_TOLERANCE))
        x, y = np.meshgrid(
            low_x + (np.arange(columns) + 0.5) * side,
            low_y + (np.arange(rows) + 0.5) * side,
        )
        centers = np.column_stack([x.ravel(), y.ravel()])
        return cls(centers=centers, is_inside=region.contains(centers), shape=(rows, columns), side=side)

    def count_nearby(self, is_counted: BoolArray, half_width: float) -> FloatArray:
        """Count the marked squares in a box around each square.

        Parameters
        ----------
        is_counted : (s,) bool array
            Which squares are counted.
        half_width : float, m
            Half the width of the box, which is rounded down to whole squares on either side.

        Returns
        -------
        (s,) array
        """
        squares_across = 2 * int(half_width / self.side) + 1
        # The number is the mean over the box times the number of squares in the box.
        values = is_counted.reshape(self.shape).astype(np.float64)
        mean = uniform_filter(values, squares_across, mode="constant")
        return np.asarray(np.rint(mean * squares_across**2).ravel())
