"""Motion of a team over a run: path lengths and stuck robots."""

from __future__ import annotations

import numpy as np

from robocov.arrays import compute_point_distances
from robocov.record import TIME_ROUNDING_S
from robocov.typing import BoolArray, FloatArray

STUCK_WINDOW_S = 5.0
"""Time over which the net displacement of a stuck robot is measured."""
STUCK_DISTANCE_M = 0.05
"""Net displacement below which a robot may be stuck."""
MIN_STUCK_GOAL_DISTANCE_M = 0.5
"""Distance from its goal above which a robot may be stuck."""


def compute_path_lengths(positions: FloatArray, traveled: BoolArray | None = None) -> FloatArray:
    """Compute the length of each robot's path.

    Parameters
    ----------
    positions : (T, n, 2) array, m
        Positions of the robots over time.
    traveled : (T - 1, n) bool array, optional
        Whether each displacement between time steps counts, such as `Record.traveled`. By default, all count.

    Returns
    -------
    (n,) array, m
        Path length of each robot.

    Examples
    --------
    >>> compute_path_lengths(np.array([[[0.0, 0.0]], [[3.0, 4.0]], [[3.0, 5.0]]]))
    array([6.])
    """
    lengths = compute_point_distances(positions[1:], positions[:-1])
    if traveled is not None:
        lengths = np.where(traveled, lengths, 0.0)
    return np.asarray(lengths.sum(axis=0))


def count_stuck_robots(time: FloatArray, positions: FloatArray, goals: FloatArray) -> int | None:
    """Count the robots that are far from their goals at the end of a run and no longer move.

    A robot is stuck if its distance from its goal exceeds `MIN_STUCK_GOAL_DISTANCE_M` and its net
    displacement over the last `STUCK_WINDOW_S` is below `STUCK_DISTANCE_M`.

    Parameters
    ----------
    time : (T,) array, s
        Time of each time step.
    positions : (T, n, 2) array, m
        Positions of the robots over time.
    goals : (T, n, 2) array, m
        Goals of the robots over time; nan for a robot without a goal.

    Returns
    -------
    int or None
        Number of stuck robots. None if no robot has a goal, or the run is shorter than `STUCK_WINDOW_S`.
    """
    window_start = float(time[-1]) - STUCK_WINDOW_S
    has_goal = ~np.isnan(goals[-1]).any(axis=1)
    if not has_goal.any() or window_start < float(time[0]) - TIME_ROUNDING_S:
        return None
    start_step = int(np.searchsorted(time, window_start + TIME_ROUNDING_S, side="right")) - 1
    displacements = compute_point_distances(positions[-1], positions[start_step])
    goal_distances = compute_point_distances(goals[-1], positions[-1])
    is_stuck = (displacements < STUCK_DISTANCE_M) & (goal_distances > MIN_STUCK_GOAL_DISTANCE_M)
    return int(is_stuck.sum())
