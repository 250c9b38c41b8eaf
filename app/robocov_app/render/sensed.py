"""The obstacle points that a team has sensed so far: all that it could know of the obstacles."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from robocov.arrays import Array, IntArray

CELL = 0.05
"""Points that a robot senses within the same square of so many metres count once."""

MOST = 20_000
"""More are not remembered."""


class Sensed:
    """A growing set of points, each with its robot and the time when it was sensed first."""

    def __init__(self) -> None:
        self._points = np.empty((256, 2))
        self._times = np.empty(256)
        self._robots = np.empty(256, dtype=np.intp)
        self._known: set[tuple[int, int, int]] = set()
        self._count = 0

    def __len__(self) -> int:
        return self._count

    def add(self, time: float, numbers: Sequence[int], points: Array) -> None:
        """Add what robots of these numbers sense now, (n, 2) m, nan for nothing."""
        if self._count + len(numbers) > MOST:
            return
        cells = np.floor(points / CELL)
        for number, cell, point in zip(numbers, cells.tolist(), points.tolist(), strict=True):
            if cell[0] != cell[0]:  # nan
                continue
            key = number, int(cell[0]), int(cell[1])
            if key not in self._known:
                self._known.add(key)
                self._append(time, number, point)

    def until(self, time: float) -> tuple[Array, IntArray]:
        """Return the points that were known at a time, (k, 2) m in order, and the numbers of the robots."""
        count = int(np.searchsorted(self._times[: self._count], time + 1e-6, side="right"))
        return self._points[:count], self._robots[:count]

    def copy(self) -> Sensed:
        """Return a set of its own with the same points."""
        twin = Sensed()
        twin._points, twin._times = self._points.copy(), self._times.copy()
        twin._robots = self._robots.copy()
        twin._known, twin._count = set(self._known), self._count
        return twin

    def cut(self, time: float) -> None:
        """Forget what was sensed after a time."""
        count = len(self.until(time)[0])
        for k in range(count, self._count):
            x, y = np.floor(self._points[k] / CELL).tolist()
            self._known.discard((int(self._robots[k]), int(x), int(y)))
        self._count = count

    def _append(self, time: float, number: int, point: list[float]) -> None:
        if self._count == len(self._points):
            self._points = np.concatenate([self._points, np.empty_like(self._points)])
            self._times = np.concatenate([self._times, np.empty_like(self._times)])
            self._robots = np.concatenate([self._robots, np.empty_like(self._robots)])
        self._points[self._count] = point
        self._times[self._count], self._robots[self._count] = time, number
        self._count += 1
