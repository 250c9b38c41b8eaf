"""Points of obstacles that robots have sensed so far."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy

import numpy as np

from robocov.typing import BoolArray, FloatArray, IntArray

CELL_SIZE_M = 0.05
"""Of the points that a robot senses within the same square of this size, only the first is stored."""
MAX_POINTS = 20_000
"""Maximum number of stored points; further ones are ignored."""
_TIME_TOLERANCE_S = 1e-6


class SensedPoints:
    """A growing set of points, each with the robot that sensed it and the time at which it first did."""

    def __init__(self) -> None:
        self._times = np.empty(0)
        self._robots = np.empty(0, dtype=np.intp)
        self._points = np.empty((0, 2))
        self._known: set[tuple[int, float, float]] = set()

    def __len__(self) -> int:
        return len(self._times)

    def add(self, time: float, numbers: Sequence[int], points: FloatArray) -> None:
        """Add the points that robots sense at a time.

        Parameters
        ----------
        time : float, s
            Not earlier than in the previous call.
        numbers : sequence of int
            Numbers of the robots.
        points : (n, 2) array, m
            The point that each robot senses; nan if it senses nothing.
        """
        if len(self) + len(numbers) > MAX_POINTS:
            return
        cells = np.floor(points / CELL_SIZE_M)
        keys = list(zip(numbers, *cells.T.tolist(), strict=True))
        is_sensed: BoolArray = np.asarray(np.isfinite(points).all(axis=1))
        new_rows = [row for row, key in enumerate(keys) if is_sensed[row] and key not in self._known]
        if not new_rows:
            return
        self._known.update(keys[row] for row in new_rows)
        self._times = np.append(self._times, np.full(len(new_rows), time))
        self._robots = np.append(self._robots, np.asarray(numbers, dtype=np.intp)[new_rows])
        self._points = np.concatenate([self._points, points[new_rows]])

    def get_until(self, time: float) -> tuple[FloatArray, IntArray]:
        """Return the points that had been sensed by a time, s.

        Returns
        -------
        points : (k, 2) array, m
        robots : (k,) int array
            Numbers of the robots.
        """
        count = int(np.searchsorted(self._times, time + _TIME_TOLERANCE_S, side="right"))
        return self._points[:count], self._robots[:count]

    def copy(self) -> SensedPoints:
        """Return an independent copy."""
        # Arrays are never changed in place, so both copies can share them.
        twin = copy(self)
        twin._known = set(self._known)
        return twin

    def remove_after(self, time: float) -> None:
        """Remove the points that were first sensed after a time, s."""
        self._points, self._robots = self.get_until(time)
        self._times = self._times[: len(self._points)]
        x, y = np.floor(self._points / CELL_SIZE_M).T.tolist()
        self._known = set(zip(self._robots.tolist(), x, y, strict=True))
