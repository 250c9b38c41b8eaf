"""Square bins of points, so that points close to one are found in its own and the adjacent bins."""

from typing import NamedTuple

import numpy as np

from robocov.arrays import Array, IntArray
from robocov.compiled import kernel

_MIN_BINNED_POINTS = 24
"""Number of points from which bins save time; fewer are all in one bin."""
_SIDE_MARGIN = 1.000001
"""Side of a bin relative to the reach: larger by more than rounding."""


class Bins(NamedTuple):
    """Rows and columns of square bins over points."""

    left: float
    """x where the first column begins, m."""
    low: float
    """y where the first row begins, m."""
    scale: float
    """Bins per metre."""
    columns: int
    rows: int


@kernel
def find_bin(offset: float, scale: float) -> int:
    """Return the row or column of bins at an offset from the first one.

    Parameters
    ----------
    offset : float, m
    scale : float, 1/m
        Bins per metre.

    Returns
    -------
    int
        0 if the offset is not a number.
    """
    return int(offset * scale) if offset * scale > 0.0 else 0


@kernel
def sort_into_bins(
    points: Array, first: int, stop: int, reach: float, starts: IntArray, order: IntArray
) -> Bins:
    """Sort points into square bins, row by row; points in reach of each other are in adjacent bins.

    Parameters
    ----------
    points : (n, 2) array, m
    first, stop : int
        The rows of the points that are sorted, ``points[first:stop]``.
    reach : float, m
        May be infinite.
    starts : (2 (stop - first) + 8,) int array
        Overwritten: bin b contains the points ``order[starts[b]:starts[b + 1]]``, ascending.
    order : (stop - first,) int array
        Overwritten.

    Returns
    -------
    Bins
    """
    count = stop - first
    left = points[first, 0]
    right = points[first, 0]
    low = points[first, 1]
    high = points[first, 1]
    for i in range(first, stop):
        left = min(left, points[i, 0])
        right = max(right, points[i, 0])
        low = min(low, points[i, 1])
        high = max(high, points[i, 1])
    width = right - left
    height = high - low
    # Not more bins than points.
    side = max(_SIDE_MARGIN * reach, np.sqrt(width * height / count), max(width, height) / count)
    scale = 1.0 / side if count >= _MIN_BINNED_POINTS and 0.0 < side < np.inf else 0.0
    columns = find_bin(width, scale) + 1
    rows = find_bin(height, scale) + 1
    # A counting sort: sizes two bins ahead, then begins one bin ahead, which advance as the bins fill.
    for b in range(columns * rows + 2):
        starts[b] = 0
    for i in range(first, stop):
        b = find_bin(points[i, 1] - low, scale) * columns + find_bin(points[i, 0] - left, scale)
        starts[b + 2] += 1
    for b in range(columns * rows):
        starts[b + 2] += starts[b + 1]
    for i in range(first, stop):
        b = find_bin(points[i, 1] - low, scale) * columns + find_bin(points[i, 0] - left, scale)
        order[starts[b + 1]] = i
        starts[b + 1] += 1
    return Bins(left, low, scale, columns, rows)
