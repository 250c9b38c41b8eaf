"""Small functions on arrays."""

from typing import Any

import numpy as np

from robocov.typing import FloatArray, IntArray


def copy_read_only(values: object) -> FloatArray:
    """Copy values into a read-only, C-contiguous array of floats.

    Parameters
    ----------
    values : array_like
        Numbers, of any shape.

    Returns
    -------
    array
    """
    array = np.array(values, dtype=np.float64, order="C")
    array.setflags(write=False)
    return array


def to_tuples(values: Any) -> Any:
    """Convert arrays and lists, also inside one another, to tuples, which can be compared and hashed.

    Parameters
    ----------
    values : object
        An array, a list or a tuple. Any other value is returned unchanged.

    Returns
    -------
    tuple or object

    Examples
    --------
    >>> to_tuples([np.array([1.0, 2.0]), (3, 4)])
    ((1.0, 2.0), (3, 4))
    """
    if isinstance(values, np.ndarray):
        return to_tuples(values.tolist())
    if isinstance(values, list | tuple):
        try:
            hash(values)
        except TypeError:
            return tuple(to_tuples(value) for value in values)
    # Hashable values contain no arrays and no lists.
    return values


def compute_lengths(vectors: FloatArray) -> FloatArray:
    """Compute the Euclidean lengths of plane vectors.

    Parameters
    ----------
    vectors : (..., 2) array

    Returns
    -------
    (...) array
        In the unit of the vectors.

    Examples
    --------
    >>> compute_lengths(np.array([[3.0, 4.0], [0.0, 2.0]]))
    array([5., 2.])
    """
    return np.asarray(np.hypot(vectors[..., 0], vectors[..., 1]))


def compute_point_distances(first: FloatArray, second: FloatArray) -> FloatArray:
    """Compute the Euclidean distances between points, sqrt(dx² + dy²).

    Unlike `compute_lengths`, it uses the square root, so that the result has the same bits as in kernels.

    Parameters
    ----------
    first, second : (..., 2) arrays, m
        Their shapes broadcast together.

    Returns
    -------
    (...) array, m

    Examples
    --------
    >>> compute_point_distances(np.array([[3.0, 4.0], [0.0, 2.0]]), np.zeros(2))
    array([5., 2.])
    """
    offsets = first - second
    return np.asarray(np.sqrt(offsets[..., 0] ** 2 + offsets[..., 1] ** 2))


def find_run_starts(values: IntArray) -> IntArray:
    """Find the indices at which runs of equal values start.

    Parameters
    ----------
    values : (m,) int array
        At least one value.

    Returns
    -------
    (r,) int array

    Examples
    --------
    >>> find_run_starts(np.array([4, 4, 7, 4]))
    array([0, 2, 3])
    """
    return np.append(0, np.flatnonzero(values[1:] != values[:-1]) + 1)


def concatenate_ranges(starts: IntArray, counts: IntArray) -> IntArray:
    """Concatenate ranges of consecutive integers.

    Parameters
    ----------
    starts : (k,) int array
        First number of each range.
    counts : (k,) int array
        Length of each range, at least 0.

    Returns
    -------
    (sum of counts,) int array

    Examples
    --------
    >>> concatenate_ranges(np.array([7, 2]), np.array([3, 2]))
    array([7, 8, 9, 2, 3])
    """
    output_starts = counts.cumsum() - counts
    return np.asarray(np.arange(counts.sum()) + (starts - output_starts).repeat(counts))


def compute_weighted_mean(values: FloatArray, weights: FloatArray | None = None) -> float:
    """Compute the weighted mean of some values.

    Parameters
    ----------
    values : (m,) array
    weights : (m,) array or None
        At least 0. By default all values have the same weight.

    Returns
    -------
    float
        nan if there are no values, or if their total weight is 0.

    Examples
    --------
    >>> compute_weighted_mean(np.array([1.0, 4.0]), np.array([2.0, 1.0]))
    2.0
    """
    if weights is None:
        return float(values.sum()) / len(values) if len(values) > 0 else np.nan
    total = float(weights.sum())
    return float((weights * values).sum()) / total if total > 0.0 else np.nan
