"""Pairs of points that are close to each other."""

from typing import NamedTuple

import numpy as np

from robocov.compiled import kernel
from robocov.observation.bins import count_starts, find_bin, sort_into_bins
from robocov.typing import AnyArray, FloatArray, IntArray

_INITIAL_NEIGHBORS = 8
"""Number of neighbors per point for which the arrays have space at first."""


class ClosePairs(NamedTuple):
    """Directed pairs of points, sorted by first, then second.

    Each pair appears twice, once in each direction.
    """

    first: IntArray
    """(k,) Index of the first point of each pair."""
    second: IntArray
    """(k,) Index of the second point."""
    distances: FloatArray
    """(k,) Distance between the two points, m."""


def find_close_pairs(positions: FloatArray, max_distance: float) -> ClosePairs:
    """Find the directed pairs of points that are close to each other.

    Parameters
    ----------
    positions : (n, 2) array, m
    max_distance : float, m
        Maximum distance between the two points of a pair; may be infinite.

    Returns
    -------
    ClosePairs

    Examples
    --------
    >>> pairs = find_close_pairs(np.array([[0.0, 0.0], [1.0, 0.0], [5.0, 0.0]]), 2.0)
    >>> pairs.first, pairs.second, pairs.distances
    (array([0, 1]), array([1, 0]), array([1., 1.]))
    """
    _, pairs = find_pairs_in_range(positions, np.full(len(positions), max_distance))
    return pairs


@kernel
def find_pairs_in_range(points: FloatArray, ranges: FloatArray) -> tuple[IntArray, ClosePairs]:
    """Find the directed pairs of points whose distance is at most the smaller of their ranges.

    Parameters
    ----------
    points : (n, 2) array, m
    ranges : (n,) array, m
        Range of each point.

    Returns
    -------
    indptr : (n + 1,) int array
        ``pairs.second[indptr[i]:indptr[i + 1]]`` are the points in range of point i.
    pairs : ClosePairs
    """
    n = len(points)
    indptr = np.zeros(n + 1, np.intp)
    first = np.empty(_INITIAL_NEIGHBORS * n, np.intp)
    second = np.empty(_INITIAL_NEIGHBORS * n, np.intp)
    distance = np.empty(_INITIAL_NEIGHBORS * n)
    if n == 0:
        return indptr, ClosePairs(first, second, distance)
    starts = np.empty(count_starts(n), np.intp)
    order = np.empty(n, np.intp)
    bins = sort_into_bins(points, 0, n, ranges.max(), starts, order)
    pair_count = 0
    for i in range(n):
        # Make space for pairs of this point with all others.
        if pair_count + n > len(second):
            capacity = 2 * (pair_count + n)
            first = _enlarge(first, pair_count, capacity)
            second = _enlarge(second, pair_count, capacity)
            distance = _enlarge(distance, pair_count, capacity)
        first_pair = pair_count
        row = find_bin(points[i, 1] - bins.bottom, bins.scale)
        column = find_bin(points[i, 0] - bins.left, bins.scale)
        # Points in range are in the same bin or in one of the eight bins around it. Bins are numbered row by
        # row, so the points of three adjacent bins of a row are consecutive in `order`.
        for bin_row in range(max(row - 1, 0), min(row + 2, bins.rows)):
            first_bin = bin_row * bins.columns + max(column - 1, 0)
            stop_bin = bin_row * bins.columns + min(column + 2, bins.columns)
            for k in range(starts[first_bin], starts[stop_bin]):
                j = order[k]
                dx = points[j, 0] - points[i, 0]
                dy = points[j, 1] - points[i, 1]
                separation = np.sqrt(dx * dx + dy * dy)
                if j != i and separation <= min(ranges[i], ranges[j]):
                    first[pair_count] = i
                    _insert(second, distance, first_pair, pair_count, j, separation)
                    pair_count += 1
        indptr[i + 1] = pair_count
    pairs = ClosePairs(first[:pair_count].copy(), second[:pair_count].copy(), distance[:pair_count].copy())
    return indptr, pairs


@kernel
def _enlarge(values: AnyArray, used: int, capacity: int) -> AnyArray:
    """Return an array of length `capacity` that begins with the used values."""
    larger = np.empty(capacity, values.dtype)
    larger[:used] = values[:used]
    return larger


@kernel
def _insert(
    second: IntArray, distance: FloatArray, begin: int, end: int, point: int, separation: float
) -> None:
    """Insert a point and its distance so that ``second[begin:end + 1]`` is ascending; index `end` is free."""
    k = end
    while k > begin and second[k - 1] > point:
        second[k] = second[k - 1]
        distance[k] = distance[k - 1]
        k -= 1
    second[k] = point
    distance[k] = separation
