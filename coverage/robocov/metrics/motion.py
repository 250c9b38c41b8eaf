"""Motion of a team over a run: path lengths and stuck robots."""

from __future__ import annotations

import numpy as np

from robocov.arrays import Array, BoolArray, compute_point_distances
from robocov.record import TIME_ROUNDING_S

STUCK_WINDOW_S = 5.0
"""Time over which the net displacement of a stuck robot is measured."""
STUCK_DISTANCE_M = 0.05
"""Net displacement in this time below which a robot may be stuck."""
MIN_STUCK_GOAL_DISTANCE_M = 0.5
"""Distance from its goal above which a robot that does not move is stuck."""


def compute_path_lengths(positions: Array, traveled: BoolArray | None = None) -> Array:
    """Compute the length of each robot's path.

    Parameters
    ----------
    positions : (T, n, 2) array, m
    traveled : (T - 1, n) bool array, optional
        Mask of the displacements that count, such as `Record.traveled`. By default, all count.

    Returns
    -------
    (n,) array, m

    Examples
    --------
    >>> compute_path_lengths(np.array([[[0.0, 0.0]], [[3.0, 4.0]], [[3.0, 5.0]]]))
    array([6.])
    """
    lengths = compute_point_distances(positions[1:], positions[:-1])
    if traveled is not None:
        lengths = np.where(traveled, lengths, 0.0)
    return np.asarray(lengths.sum(axis=0))


def count_stuck_robots(time: Array, positions: Array, goals: Array) -> int | None:
    """Count the robots that are far from their goals at the end and no longer approach them.

    A robot is stuck if its distance from its goal exceeds `MIN_STUCK_GOAL_DISTANCE_M` and its net
    displacement over the last `STUCK_WINDOW_S` is below `STUCK_DISTANCE_M`.

    Parameters
    ----------
    time : (T,) array, s
    positions : (T, n, 2) array, m
    goals : (T, n, 2) array, m
        nan where a robot has no goal.

    Returns
    -------
    int or None
        None if no robot has a goal, or the run is shorter than `STUCK_WINDOW_S`.
    """
    window_start = float(time[-1]) - STUCK_WINDOW_S
    has_goal = ~np.isnan(goals[-1]).any(axis=1)
    if not has_goal.any() or window_start < float(time[0]) - TIME_ROUNDING_S:
        return None
    earlier = int(np.searchsorted(time, window_start + TIME_ROUNDING_S, side="right")) - 1
    displacement = compute_point_distances(positions[-1], positions[earlier])
    goal_distance = compute_point_distances(goals[-1], positions[-1])
    is_stuck = (displacement < STUCK_DISTANCE_M) & (goal_distance > MIN_STUCK_GOAL_DISTANCE_M)
    return int(is_stuck.sum())
