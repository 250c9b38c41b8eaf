"""Placement of the numbers of robots next to their discs and starts."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from robocov.arrays import compute_lengths
from robocov.typing import BoolArray, FloatArray, IntArray

_DIRECTIONS = 16
"""Number of directions from a mark in which its number may be written."""
_RINGS = (1.0, 1.7, 2.5)
"""Distances of a number from the edge of its mark, as multiples of `_MIN_DISTANCE`."""
_MIN_DISTANCE = 0.6
"""Minimum distance of the center of a number from the edge of its mark, in text sizes."""
_CLEARANCE = 0.6
"""Minimum distance of the center of a number from marks, lines and other numbers, in text sizes."""
_MAX_REACH = _MIN_DISTANCE * max(_RINGS) + 2.0 * _CLEARANCE
"""Distance from the edge of a mark, in text sizes, beyond which nothing can touch its number."""


@dataclass(frozen=True, eq=False)
class Discs:
    """Round marks on a page.

    Attributes
    ----------
    centers : (n, 2) array
    radii : (n,) array
    """

    centers: FloatArray
    radii: FloatArray


def select_discs(discs: Discs, rows: IntArray) -> Discs:
    """Return the discs in the given rows."""
    return Discs(discs.centers[rows], discs.radii[rows])


def join_discs(parts: Sequence[Discs]) -> Discs:
    """Return all discs of several groups."""
    centers = np.concatenate([discs.centers for discs in parts])
    return Discs(centers, np.concatenate([discs.radii for discs in parts]))


def place_numbers(
    marks: Discs,
    obstacles: Discs,
    *,
    text_size: float,
    is_allowed: Callable[[FloatArray], BoolArray] | None = None,
) -> FloatArray:
    """Place a number next to each mark, away from other marks, obstacles and numbers.

    Parameters
    ----------
    marks : Discs
        Marks that get a number.
    obstacles : Discs
        What numbers should not cover, such as points of trajectories, with radii of zero.
    text_size : float
        Text size of the numbers, in the unit of the positions.
    is_allowed : callable, optional
        Returns which of several positions, (k, 2), a number may have, (k,); by default all.

    Returns
    -------
    (n, 2) array
        Centers of the numbers.

    Notes
    -----
    A number is in the first position that is clear of everything: nearest to its mark, counter-clockwise from
    +x. If there is none, it is in the position that is farthest from everything.

    Examples
    --------
    >>> mark = Discs(np.array([[0.0, 0.0]]), np.array([5.0]))
    >>> line = Discs(np.array([[10.0, 0.0], [12.0, 4.0]]), np.zeros(2))
    >>> place_numbers(mark, line, text_size=11.0).round(1)
    array([[ 4.4, 10.7]])
    """
    centers = np.empty_like(marks.centers)
    number_radius = _CLEARANCE * text_size
    for number, (mark, radius) in enumerate(zip(marks.centers, marks.radii, strict=True)):
        candidates = mark + _list_offsets(float(radius), text_size)
        if is_allowed is not None:
            allowed = candidates[is_allowed(candidates)]
            if len(allowed):
                candidates = allowed
        placed = centers[:number]
        points = np.concatenate([marks.centers, obstacles.centers, placed])
        radii = np.concatenate([marks.radii, obstacles.radii, np.full(number, number_radius)])
        is_near = compute_lengths(points - mark) - radii < float(radius) + _MAX_REACH * text_size
        distances = compute_lengths(candidates[:, None] - points[is_near])
        clearances = (distances - radii[is_near]).min(axis=1) - number_radius
        # Rounding lets the first of several equally good positions win on all machines.
        clearances = clearances.round(6)
        is_clear = clearances >= 0.0
        chosen = int(np.argmax(is_clear)) if is_clear.any() else int(np.argmax(clearances))
        centers[number] = candidates[chosen]
    return centers


def _list_offsets(mark_radius: float, text_size: float) -> FloatArray:
    """Return the possible offsets of a number from the center of its mark, (k, 2), the nearest first."""
    angles = np.arange(_DIRECTIONS) * 2.0 * np.pi / _DIRECTIONS
    directions = np.column_stack([np.cos(angles), np.sin(angles)])
    distances = mark_radius + _MIN_DISTANCE * text_size * np.array(_RINGS)
    return np.asarray((distances[:, None, None] * directions).reshape(-1, 2))
