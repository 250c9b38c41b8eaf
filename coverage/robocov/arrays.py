"""The array types that signatures use, and groups of entries in flat arrays."""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
"""Floating point data; the docstring beside it gives shape and unit."""

IntArray: TypeAlias = NDArray[np.intp]
"""Indices."""

ComplexArray: TypeAlias = NDArray[np.complex128]
"""Plane vectors, x + i y."""

BoolArray: TypeAlias = NDArray[np.bool_]
"""Masks."""


def frozen(values: object) -> Array:
    """Return `values` as a read-only C-contiguous float array (a copy)."""
    array = np.array(values, dtype=np.float64, order="C")
    array.setflags(write=False)
    return array


def beginnings(values: IntArray) -> IntArray:
    """Return where runs of equal values begin, in an array of at least one.

    >>> beginnings(np.array([4, 4, 7, 4]))
    array([0, 2, 3])
    """
    return np.append(0, np.flatnonzero(values[1:] != values[:-1]) + 1)


def ranges(first: IntArray, count: IntArray) -> IntArray:
    """Return the numbers from first[0] on, count[0] of them, then those from first[1] on, and so forth.

    >>> ranges(np.array([7, 2]), np.array([3, 2]))
    array([7, 8, 9, 2, 3])
    """
    before = count.cumsum() - count
    return np.asarray(np.arange(count.sum()) + (first - before).repeat(count))


def weighted_mean(values: Array, weights: Array | None = None) -> float:
    """Return the weighted mean of (m,) values, of none, or of none with a weight, nan.

    >>> weighted_mean(np.array([1.0, 4.0]), np.array([2.0, 1.0]))
    2.0
    """
    if weights is None:
        return float(values.sum()) / len(values) if len(values) else np.nan
    total = float(weights.sum())
    return float((weights * values).sum()) / total if total > 0.0 else np.nan
