"""Placement of the numbers of robots next to the marks of their starts."""

import numpy as np

from robocov.arrays import compute_lengths
from robocov.typing import FloatArray

_DIRECTIONS = 16
"""Number of directions from a start in which its number may be written."""
_NUMBER_DISTANCE = 0.6
"""Distance of the center of a number from the edge of the mark, in text sizes."""
_MAX_DISTANCE = 4.0
"""Marks that are farther from a start than this, in sizes of its mark, do not matter."""


def place_start_numbers(
    starts: FloatArray, marks: FloatArray, *, mark_size: float, text_size: float
) -> FloatArray:
    """Place a number next to each start, away from marks and other numbers.

    Parameters
    ----------
    starts : (n, 2) array
    marks : (m, 2) array
        Points that numbers should not hide, such as other starts and points of trajectories.
    mark_size : float
        Diameter of the mark of a start, in the unit of the positions.
    text_size : float
        Text size of the numbers, in the same unit.

    Returns
    -------
    (n, 2) array
        Centers of the numbers.

    Notes
    -----
    A number stands in the first direction, counterclockwise from +x, in which nothing is closer to it than
    its own start. If there is none, it stands in the direction that is farthest from marks and numbers.

    Examples
    --------
    >>> marks = np.array([[10.0, 0.0], [20.0, 0.0]])
    >>> place_start_numbers(np.array([[0.0, 0.0]]), marks, mark_size=10.0, text_size=11.0).round(1)
    array([[ 4.4, 10.7]])
    """
    angles = np.arange(_DIRECTIONS) * 2.0 * np.pi / _DIRECTIONS
    distance = 0.5 * mark_size + _NUMBER_DISTANCE * text_size
    offsets = distance * np.column_stack([np.cos(angles), np.sin(angles)])
    centers = np.empty_like(starts)
    for number, start in enumerate(starts):
        obstacles = np.concatenate([marks, starts, centers[:number]])
        is_near = compute_lengths(obstacles - start) < _MAX_DISTANCE * mark_size
        candidates = start + offsets
        differences = candidates[:, None] - obstacles[None, is_near]
        clearances = compute_lengths(differences).min(axis=1)
        # Rounding lets the first of several equally good directions win on all machines.
        centers[number] = candidates[np.argmax(clearances.round(6))]
    return centers
