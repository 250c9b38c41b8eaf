"""Groups of entries in flat arrays: where they begin, which numbers they run over, the least, the mean."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from robocov.arrays.types import Array, IntArray


def beginnings(values: IntArray) -> IntArray:
    """Return where runs of equal values begin, in an array of at least one.

    >>> beginnings(np.array([4, 4, 7, 4]))
    array([0, 2, 3])
    """
    fresh = np.ones(len(values), dtype=bool)
    np.not_equal(values[1:], values[:-1], out=fresh[1:])
    return fresh.nonzero()[0]


def sizes(begin: IntArray, total: int) -> IntArray:
    """Return how long the groups are that begin there, of entries of which there are so many.

    >>> sizes(np.array([0, 2, 3]), 4)
    array([2, 1, 1])
    """
    size = np.empty_like(begin)
    np.subtract(begin[1:], begin[:-1], out=size[:-1])
    size[-1:] = total - begin[-1:]
    return size


def ranges(first: IntArray, count: IntArray) -> IntArray:
    """Return the numbers from first[0] on, count[0] of them, then those from first[1] on, and so forth.

    >>> ranges(np.array([7, 2]), np.array([3, 2]))
    array([7, 8, 9, 2, 3])
    """
    end = count.cumsum()
    total = int(end[-1]) if len(end) else 0
    return np.asarray(np.arange(total) + (first - end + count).repeat(count))


def weighted_mean(values: Array, weights: Array | None = None) -> float:
    """Return the weighted mean of (m,) values, of none, or of none with a weight, nan.

    >>> weighted_mean(np.array([1.0, 4.0]), np.array([2.0, 1.0]))
    2.0
    """
    if weights is None:
        return float(values.sum()) / len(values) if len(values) else np.nan
    total = float(weights.sum())
    return float((weights * values).sum()) / total if total > 0.0 else np.nan
