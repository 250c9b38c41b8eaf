"""Arithmetic on arrays of plane vectors, (k, 2)."""

import numpy as np

from robocov.typing import FloatArray

_MIN_CROSS = 1e-200
"""Lines are parallel if the cross product of their directions is smaller."""


def compute_cross(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the cross product of each pair of vectors, (k,)."""
    return np.asarray(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])


def compute_dot(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the dot product of each pair of vectors, (k,)."""
    return np.asarray(np.einsum("kd,kd->k", first, second))


def project_onto_lines(points: FloatArray, origins: FloatArray, directions: FloatArray) -> FloatArray:
    """Project each point onto a line of its own.

    Parameters
    ----------
    points, origins : (k, 2) arrays, m
    directions : (k, 2) array
        Unit vectors along the lines.

    Returns
    -------
    (k, 2) array, m
    """
    return np.asarray(origins + compute_dot(points - origins, directions)[:, None] * directions)


def intersect_lines(
    first_origins: FloatArray,
    first_directions: FloatArray,
    second_origins: FloatArray,
    second_directions: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Intersect pairs of infinite lines.

    Parameters
    ----------
    first_origins, first_directions, second_origins, second_directions : (k, 2) arrays

    Returns
    -------
    intersections : (k, 2) array
        Arbitrary for parallel lines.
    cross : (k,) array
        Cross products of the directions; 0 for parallel lines.
    """
    cross = compute_cross(first_directions, second_directions)
    divisor = np.where(np.abs(cross) < _MIN_CROSS, 1.0, cross)
    parameter = compute_cross(second_origins - first_origins, second_directions) / divisor
    return first_origins + parameter[:, None] * first_directions, cross
