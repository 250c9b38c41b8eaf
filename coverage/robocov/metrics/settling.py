"""Settling of a team: whether it is at rest, and when it came to rest."""

from __future__ import annotations

import numpy as np

from robocov.arrays import compute_point_distances
from robocov.typing import BoolArray, FloatArray

SETTLED_WINDOW_S = 4.0
"""Time over which the net displacement of a robot at rest is measured."""
SETTLED_DISTANCE_M = 0.05
"""Net displacement below which a robot is at rest."""


def is_team_at_rest(before: FloatArray, after: FloatArray, distance: float = SETTLED_DISTANCE_M) -> BoolArray:
    """Return whether a team is at rest: all its robots have a small net displacement over a window of time.

    Parameters
    ----------
    before : (..., n, 2) array, m
        Positions of the robots at the start of the window.
    after : (..., n, 2) array, m
        Positions of the robots at the end of the window, usually `SETTLED_WINDOW_S` later.
    distance : float, m
        Net displacement below which a robot is at rest.

    Returns
    -------
    (...) bool array
        Whether each team is at rest.

    Examples
    --------
    >>> before = np.zeros((2, 2))
    >>> bool(is_team_at_rest(before, before + [[0.0, 0.0], [0.01, 0.0]]))
    True
    >>> bool(is_team_at_rest(before, before + [[0.0, 0.0], [1.0, 0.0]]))
    False
    """
    is_moving = compute_point_distances(after, before) >= distance
    return np.asarray(~is_moving.any(axis=-1))


def find_settling_time(
    time: FloatArray,
    positions: FloatArray,
    window: float = SETTLED_WINDOW_S,
    distance: float = SETTLED_DISTANCE_M,
) -> float | None:
    """Find the time at which the team came to rest.

    Parameters
    ----------
    time : (T,) array, s
        Times of the positions, evenly spaced.
    positions : (T, n, 2) array, m
        Positions of the robots over time.
    window : float, s
        Time over which the net displacement is measured.
    distance : float, m
        Net displacement below which a robot is at rest.

    Returns
    -------
    float or None
        Earliest time, s, such that the team is at rest in every window that starts then or later. None
        if the team was still moving at the end.

    See Also
    --------
    summarize : The results of a run, among them the time at which it settled.

    Notes
    -----
    Speed is not a suitable criterion, because a robot may jitter in place forever.

    Examples
    --------
    >>> import numpy as np
    >>> import robocov as rc
    >>> time = np.arange(0.0, 12.0)
    >>> x = np.minimum(time, 3.0)
    >>> rc.find_settling_time(time, np.stack([x, 0.0 * x], axis=1)[:, None, :])
    3.0
    """
    dt = float(time[1] - time[0]) if len(time) > 1 else 0.0
    window_steps = round(window / dt) if dt > 0 else 0
    if window_steps == 0 or len(time) <= window_steps:
        return None
    # Whether the team moves in the window that starts at each step.
    is_moving = ~is_team_at_rest(positions[:-window_steps], positions[window_steps:], distance)
    last_moving = int(np.flatnonzero(is_moving).max(initial=-1))
    first_at_rest = last_moving + 1
    return float(time[first_at_rest]) if first_at_rest < len(is_moving) else None
