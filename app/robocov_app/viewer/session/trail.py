"""Where the robots of a pane went, as one growing array for the trajectories layer."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable

    from robocov.arrays import Array
    from robocov_app.viewer.session.history import History, PaneSetup

RATE = 30.0
"""Most rows for each simulated second."""

MOST_ROWS = 4096
"""When there are so many, every second of the older half goes."""


class Trail:
    """Positions at ascending times, for the robots that work now; bounded."""

    def __init__(self, n: int) -> None:
        self._rows = np.empty((64, n, 2))
        self._times = np.empty(64)
        self._count = 0

    def __len__(self) -> int:
        return self._count

    @property
    def positions(self) -> Array:
        """The positions so far, (k, n, 2) m, oldest first; nan before a robot was there."""
        return self._rows[: self._count]

    @property
    def time(self) -> Array:
        """Their times, (k,) s."""
        return self._times[: self._count]

    def add(self, time: float, positions: Array, *, always: bool = False) -> None:
        """Append the (n, 2) m positions at `time`, unless the last are younger than 1 / `RATE`.

        With `always` they are taken in any case; they replace those of the same time.
        """
        since = time - self._times[self._count - 1] if self._count else np.inf
        if since < 1e-9 and always:
            self._count -= 1
        elif since < 1.0 / RATE - 1e-6 and not always:
            return
        if self._count == MOST_ROWS:
            self._thin()
        if self._count == len(self._rows):
            self._rows = np.concatenate([self._rows, np.empty_like(self._rows)])
            self._times = np.concatenate([self._times, np.empty_like(self._times)])
        self._rows[self._count], self._times[self._count] = positions, time
        self._count += 1

    def cut(self, time: float) -> None:
        """Forget what came after `time`."""
        self._count = int(np.searchsorted(self.time, time + 1e-6, side="right"))

    def until(self, time: float) -> tuple[Array, Array]:
        """Return positions and times up to `time`."""
        count = int(np.searchsorted(self.time, time + 1e-6, side="right"))
        return self._rows[:count], self._times[:count]

    @classmethod
    def of(cls, n: int, moments: Iterable[tuple[float, Array]]) -> Trail:
        """Return the trail of moments in their order: times, s, and (n, 2) m positions."""
        trail = cls(n)
        for time, positions in moments:
            trail.add(time, positions)
        return trail

    def _thin(self) -> None:
        half = MOST_ROWS // 2
        keep = np.concatenate([np.arange(0, half, 2), np.arange(half, MOST_ROWS)])
        self._rows[: len(keep)] = self._rows[keep]
        self._times[: len(keep)] = self._times[keep]
        self._count = len(keep)


def trail_of(history: History, pane: int, last: int) -> Trail:
    """Return where the robots that worked in a pane at moment `last` went until then."""
    numbers = history[last].states[pane].setup.numbers
    trail = Trail(len(numbers))
    before: PaneSetup | None = None
    rows: list[int] = []
    their_rows: list[int] = []
    latest = -np.inf
    for k in range(last + 1):
        time, state = history.time(k), history[k].states[pane]
        touched = state.setup is not before
        # who came in since is in the last row, too
        if time - latest < 1.0 / RATE - 1e-6 and not touched and k < last:
            continue
        if touched:
            before = state.setup
            rows = [row for row, number in enumerate(numbers) if number in before.numbers]
            their_rows = [before.numbers.index(numbers[row]) for row in rows]
        places = np.full((len(numbers), 2), np.nan)
        places[rows] = state.positions[their_rows]
        trail.add(time, places, always=True)
        latest = time
    return trail


def starts_of(history: History, pane: int, last: int) -> Array:
    """Return where the robots that worked in a pane at moment `last` had come in, (n, 2) m."""
    starts: dict[int, list[float]] = {}
    before: PaneSetup | None = None
    for k in range(last + 1):
        state = history[k].states[pane]
        if state.setup is not before:
            before = state.setup
            for number, place in zip(before.numbers, state.positions.tolist(), strict=True):
                starts.setdefault(number, place)
    return np.array([starts[number] for number in history[last].states[pane].setup.numbers])
