"""Trajectories of the robots of a pane up to the present, in bounded memory."""

from collections.abc import Sequence

import numpy as np

from robocov.arrays import Array
from robocov_app.viewer.session.past.history import RunHistory
from robocov_app.viewer.session.past.states import PaneSetup

MAX_TRAIL_RATE_HZ = 30.0
"""Maximum number of rows for each simulated second."""
MAX_TRAIL_ROWS = 4096
"""Number of rows at which every second row of the older half is removed."""
_MIN_ROW_INTERVAL_S = 1.0 / MAX_TRAIL_RATE_HZ - 1e-6
_SAME_TIME_S = 1e-9
_TIME_TOLERANCE_S = 1e-6


class Trail:
    """Positions of the working robots at ascending times.

    Parameters
    ----------
    robots : int
        Number of robots.
    """

    def __init__(self, robots: int) -> None:
        # The operating system provides the memory only as it is written to.
        self._positions = np.empty((MAX_TRAIL_ROWS, robots, 2))
        self._times = np.empty(MAX_TRAIL_ROWS)
        self._count = 0

    def __len__(self) -> int:
        return self._count

    @property
    def positions(self) -> Array:
        """Positions, (k, n, 2) m, the oldest first; nan before a robot has joined."""
        return self._positions[: self._count]

    @property
    def times(self) -> Array:
        """Times of the positions, (k,) s."""
        return self._times[: self._count]

    def add(self, time: float, positions: Array, *, always: bool = False) -> None:
        """Append positions, unless the last row is too recent.

        Parameters
        ----------
        time : float, s
            Time of the positions.
        positions : (n, 2) array, m
            Positions of all robots.
        always : bool
            Whether to append the positions in any case. They replace a row of the same time.
        """
        elapsed = time - self._times[self._count - 1] if self._count else np.inf
        if elapsed < _SAME_TIME_S and always:
            self._count -= 1
        elif elapsed < _MIN_ROW_INTERVAL_S and not always:
            return
        if self._count == len(self._times):
            self._thin()
        self._positions[self._count] = positions
        self._times[self._count] = time
        self._count += 1

    def get_until(self, time: float) -> tuple[Array, Array]:
        """Return the trail up to a time.

        Returns
        -------
        positions : (k, n, 2) array, m
        times : (k,) array, s
        """
        count = int(np.searchsorted(self.times, time + _TIME_TOLERANCE_S, side="right"))
        return self._positions[:count], self._times[:count]

    def select_robots(self, before: Sequence[int], after: Sequence[int]) -> "Trail":
        """Return the trail of other robots; see the function `select_robots`."""
        selected = Trail(len(after))
        selected._positions[: self._count] = select_robots(self.positions, before, after)
        selected._times[: self._count] = self.times
        selected._count = self._count
        return selected

    def _thin(self) -> None:
        """Remove every second row of the older half."""
        half = self._count // 2
        rows = np.r_[0:half:2, half : self._count]
        self._count = len(rows)
        self._positions[: self._count] = self._positions[rows]
        self._times[: self._count] = self._times[rows]


def select_robots(positions: Array, before: Sequence[int], after: Sequence[int]) -> Array:
    """Return the positions of other robots.

    Parameters
    ----------
    positions : (..., n, 2) array, m
        Positions of the robots `before`.
    before, after : sequence of int
        Numbers of robots.

    Returns
    -------
    (..., m, 2) array, m
        Positions of the robots `after`; nan for those that are not among the robots `before`.
    """
    row_by_number = {number: row for row, number in enumerate(before)}
    rows = np.array([row_by_number.get(number, -1) for number in after])
    return np.where(rows[:, None] < 0, np.nan, positions[..., rows, :])


def rebuild_trail(history: RunHistory, pane: int, last: int) -> tuple[Trail, Array]:
    """Build the trail up to a recorded state.

    Parameters
    ----------
    history : RunHistory
        The recorded past.
    pane : int
        Number of the pane.
    last : int
        Index of the state.

    Returns
    -------
    trail : Trail
        Trail of the robots that work in that state.
    starts : (n, 2) array, m
        Their first positions.
    """
    numbers = history[last].states[pane].setup.numbers
    trail = Trail(len(numbers))
    start_by_number: dict[int, list[float]] = {}
    previous_setup: PaneSetup | None = None
    latest_time = -np.inf
    for index in range(last + 1):
        time = history.get_time(index)
        state = history[index].states[pane]
        is_edited = state.setup is not previous_setup
        # The last state is always added, because it contains robots that have just joined.
        if time - latest_time < _MIN_ROW_INTERVAL_S and not is_edited and index < last:
            continue
        if is_edited:
            previous_setup = state.setup
            positions = state.positions.tolist()
            start_by_number = dict(zip(state.setup.numbers, positions, strict=True)) | start_by_number
        trail.add(time, select_robots(state.positions, state.setup.numbers, numbers), always=True)
        latest_time = time
    return trail, np.array([start_by_number[number] for number in numbers])
