"""Square bins, which restrict the search for close points to a bin and the bins next to it."""

from typing import NamedTuple

import numpy as np

from robocov.compiled import kernel
from robocov.typing import FloatArray, IntArray

_MIN_BINNED_POINTS = 24
"""Minimum number of points for more than one bin: with fewer points, bins save no time."""
_SIDE_MARGIN = 1.000001
"""Minimum side of a bin divided by the distance of close points; slightly above 1 to allow for rounding."""


class Bins(NamedTuple):
    """A grid of square bins that covers a set of points. Bins are numbered row by row."""

    left: float
    """x of the left side of the first column, m."""
    bottom: float
    """y of the lower side of the first row, m."""
    scale: float
    """Bins per meter."""
    columns: int
    rows: int


@kernel
def find_bin(offset: float, scale: float) -> int:
    """Return the index of the row or column of bins at an offset.

    Parameters
    ----------
    offset : float, m
        Distance from the side at which the first row or column begins.
    scale : float, 1/m
        Bins per meter.

    Returns
    -------
    int
        0 if the offset is nan.
    """
    return int(offset * scale) if offset * scale > 0.0 else 0


@kernel
def count_starts(point_count: int) -> int:
    """Return the length that the array `starts` needs in `sort_into_bins`.

    Parameters
    ----------
    point_count : int
        Number of points to sort.

    Returns
    -------
    int
        At least two more than the largest possible number of bins.
    """
    # The bounding box of n points has w x h bins, apart from the last row and column, with w * h <= n and
    # max(w, h) <= n (see `_fit_bins`). Therefore w + h <= n + 1, and (w + 1) * (h + 1) <= 2 n + 2.
    return 2 * point_count + 8


@kernel
def _fit_bins(points: FloatArray, first: int, stop: int, max_distance: float) -> Bins:
    """Return bins that cover ``points[first:stop]`` and whose sides are longer than the distance.

    The sides are also long enough to limit the number of bins in proportion to the number of points.
    """
    count = stop - first
    left = points[first, 0]
    right = points[first, 0]
    bottom = points[first, 1]
    top = points[first, 1]
    for i in range(first, stop):
        left = min(left, points[i, 0])
        right = max(right, points[i, 0])
        bottom = min(bottom, points[i, 1])
        top = max(top, points[i, 1])
    width = right - left
    height = top - bottom
    # The second limit of the side implies width * height / side² <= count, and the third one implies
    # max(width, height) / side <= count. The length of `starts` relies on both, see `count_starts`.
    side = max(_SIDE_MARGIN * max_distance, np.sqrt(width * height / count), max(width, height) / count)
    # With a scale of 0, all points are in one bin.
    scale = 1.0 / side if count >= _MIN_BINNED_POINTS and 0.0 < side < np.inf else 0.0
    columns = find_bin(width, scale) + 1
    rows = find_bin(height, scale) + 1
    return Bins(left, bottom, scale, columns, rows)


@kernel
def _find_bin_of_point(bins: Bins, points: FloatArray, i: int) -> int:
    """Return the bin that contains point i."""
    row = find_bin(points[i, 1] - bins.bottom, bins.scale)
    column = find_bin(points[i, 0] - bins.left, bins.scale)
    return row * bins.columns + column


@kernel
def sort_into_bins(
    points: FloatArray, first: int, stop: int, max_distance: float, starts: IntArray, order: IntArray
) -> Bins:
    """Sort points into square bins, such that close points are in the same bin or in adjacent bins.

    This is a counting sort: it counts the points in each bin, computes where each bin starts in `order`, and
    then writes the points there.

    Parameters
    ----------
    points : (n, 2) array, m
    first, stop : int
        Only ``points[first:stop]`` are sorted.
    max_distance : float, m
        Distance up to which points are close; may be infinite.
    starts : (``count_starts(stop - first)``,) int array
        Overwritten: bin b contains the points ``order[starts[b]:starts[b + 1]]``, ascending.
    order : (stop - first,) int array
        Overwritten with the indices of the points, sorted by bin.

    Returns
    -------
    Bins
    """
    bins = _fit_bins(points, first, stop, max_distance)
    bin_count = bins.columns * bins.rows
    # Count the points: starts[b + 2] is the number of points in bin b.
    for b in range(bin_count + 2):
        starts[b] = 0
    for i in range(first, stop):
        b = _find_bin_of_point(bins, points, i)
        starts[b + 2] += 1
    # Add up the counts: starts[b + 1] becomes the number of points in the bins before b, where bin b begins.
    for b in range(bin_count):
        starts[b + 2] += starts[b + 1]
    # Write each point at starts[b + 1], and advance that index. Once bin b is full, the index has moved to
    # its end, where bin b + 1 begins, as described above for `starts`.
    for i in range(first, stop):
        b = _find_bin_of_point(bins, points, i)
        order[starts[b + 1]] = i
        starts[b + 1] += 1
    return bins
