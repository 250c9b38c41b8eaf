"""Trajectories of the robots of a pane up to the present, within a memory limit."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import compress
from typing import NamedTuple, TypeAlias

import numpy as np

from robocov.environment import Point
from robocov.typing import BoolArray, FloatArray, IntArray
from robocov_app.viewer.session.past.history import RunHistory
from robocov_app.viewer.session.past.states import PaneSetup

MAX_TRAIL_RATE_HZ = 30.0
"""Maximum number of rows per simulated second."""
MAX_TRAIL_ROWS = 4096
"""When a trail has this many rows, those that matter least to the shape of the trajectories are removed."""
_MIN_ROW_INTERVAL_S = 1.0 / MAX_TRAIL_RATE_HZ - 1e-6
_SAME_TIME_S = 1e-9
_TIME_TOLERANCE_S = 1e-6

Numbers: TypeAlias = tuple[int, ...]
"""Numbers of robots, one for each column of a trail."""


@dataclass(frozen=True, eq=False)
class TrailSection:
    """Rows of a trail between two changes of the team.

    Attributes
    ----------
    numbers : tuple of int
        Number of the robot in each column.
    starts : mapping of int to tuple
        First positions of these robots, (x, y) m.
    positions : (k, n, 2) array, m
        Positions; nan where a robot does not work.
    times : (k,) array, s
        Ascending times of the rows.
    """

    numbers: Numbers
    starts: Mapping[int, Point]
    positions: FloatArray
    times: FloatArray

    def cut(self, start: float, end: float) -> "TrailSection":
        """Return a copy of the rows with start <= time < end, s."""
        first, last = np.searchsorted(self.times, [start - _SAME_TIME_S, end - _SAME_TIME_S])
        positions = self.positions[first:last].copy()
        return TrailSection(self.numbers, self.starts, positions, self.times[first:last].copy())


class Trail:
    """Positions of robots at ascending times.

    Each robot has a column. When the team changes, the columns become those of the new team: removed robots
    are left out, and robots that have just joined are nan in earlier rows.

    Parameters
    ----------
    numbers : sequence of int
        Numbers of the robots, in the order of the columns.

    Attributes
    ----------
    numbers : tuple of int
        Numbers of the current robots.
    """

    def __init__(self, numbers: Sequence[int]) -> None:
        """Build an empty trail."""
        self.numbers: Numbers = tuple(numbers)
        # The operating system allocates this memory only when it is written to.
        self._positions = np.empty((MAX_TRAIL_ROWS, len(numbers), 2))
        self._times = np.empty(MAX_TRAIL_ROWS)
        self._count = 0
        self._starts: dict[int, Point] = {}
        self._closed_sections: list[TrailSection] = []
        self._section_start = 0
        self._start_arrays: dict[Numbers, FloatArray] = {}
        self._earlier_trail: _EarlierTrail | None = None

    def __len__(self) -> int:
        return self._count

    @property
    def positions(self) -> FloatArray:
        """Positions of the current robots, (k, n, 2) m, oldest first; nan where they do not work."""
        return self._positions[: self._count]

    @property
    def times(self) -> FloatArray:
        """Times of the positions, (k,) s."""
        return self._times[: self._count]

    @property
    def last_time(self) -> float:
        """Time of the last row, s; -inf if there is none."""
        if self._count == 0:
            return -np.inf
        return float(self._times[self._count - 1])

    def add(self, time: float, positions: FloatArray, *, always: bool = False) -> None:
        """Append positions, unless the last row is too recent.

        Parameters
        ----------
        time : float, s
            Time of the positions.
        positions : (m, 2) array, m
            Positions of the robots in the first m columns. The others do not work.
        always : bool
            Whether to append the positions even if the last row is recent; a row with the same time is
            replaced.
        """
        elapsed = time - self.last_time
        if elapsed < _SAME_TIME_S and always:
            self._remove_last_row()
        elif elapsed < _MIN_ROW_INTERVAL_S and not always:
            return
        if self._count == len(self._times):
            self._simplify()
        row = self._positions[self._count]
        row[: len(positions)] = positions
        row[len(positions) :] = np.nan
        self._times[self._count] = time
        self._count += 1
        self._note_starts(positions)

    def change_robots(self, numbers: Sequence[int]) -> None:
        """Continue with the columns of another team; `get_until` still knows the earlier columns."""
        numbers = tuple(numbers)
        if numbers == self.numbers:
            return
        self._closed_sections = self.extract(-np.inf, np.inf)
        positions = select_robots(self.positions, self.numbers, numbers)
        self._positions = np.empty((MAX_TRAIL_ROWS, len(numbers), 2))
        self._positions[: self._count] = positions
        self._starts = {number: start for number, start in self._starts.items() if number in numbers}
        self._start_arrays = {}
        self._earlier_trail = None
        self._section_start = self._count
        self.numbers = numbers

    def get_until(self, time: float) -> tuple[FloatArray, FloatArray]:
        """Return the trail of the robots that were in the team at a time, up to that time.

        Returns
        -------
        positions : (k, n, 2) array, m
        times : (k,) array, s
        """
        trail = self._find_trail(time)
        count = int(np.searchsorted(trail.times, time + _TIME_TOLERANCE_S, side="right"))
        return trail._positions[:count], trail._times[:count]

    def get_starts(self, time: float, numbers: Sequence[int]) -> FloatArray:
        """Return the first positions of robots that are in the team at a time.

        Returns
        -------
        (n, 2) array, m
            nan for robots without a known start. The same array object as in the last call, unless starts
            have changed.
        """
        trail = self._find_trail(time)
        key = tuple(numbers)
        if key not in trail._start_arrays:
            unknown = (np.nan, np.nan)
            starts = [trail._starts.get(number, unknown) for number in numbers]
            trail._start_arrays[key] = np.array(starts).reshape(-1, 2)
        return trail._start_arrays[key]

    def extract(self, start: float, end: float) -> list[TrailSection]:
        """Return the rows with start <= time < end, s, in sections with the same team."""
        open_rows = slice(self._section_start, self._count)
        open_section = TrailSection(
            self.numbers, dict(self._starts), self._positions[open_rows], self._times[open_rows]
        )
        sections: list[TrailSection] = []
        # The first row of a section replaces a row of the same time in the section before it.
        for section in [open_section, *reversed(self._closed_sections)]:
            part = section.cut(start, end)
            if len(part.times):
                sections.append(part)
            if len(section.times):
                end = min(end, float(section.times[0]))
        return sections[::-1]

    def extend(self, sections: Iterable[TrailSection]) -> None:
        """Append the rows of sections that are later than the last row."""
        for section in sections:
            later = section.cut(self.last_time + 2 * _SAME_TIME_S, np.inf)
            if not len(later.times):
                continue
            self.change_robots(later.numbers)
            self._starts = {**later.starts, **self._starts}
            self._start_arrays = {}
            # A chunk fits into the space that `_simplify` makes.
            chunk_rows = max(MAX_TRAIL_ROWS // 8, 1)
            for first in range(0, len(later.times), chunk_rows):
                rows = slice(first, first + chunk_rows)
                self._append_rows(later.positions[rows], later.times[rows])

    def _remove_last_row(self) -> None:
        """Remove the last row.

        Robots that are in no other row get a new start with their next row: an edit may have moved them.
        """
        self._count -= 1
        self._section_start = min(self._section_start, self._count)
        is_absent: BoolArray = np.all(np.isnan(self.positions[..., 0]), axis=0)
        for number in compress(self.numbers, is_absent):
            if self._starts.pop(number, None) is not None:
                self._start_arrays = {}

    def _append_rows(self, positions: FloatArray, times: FloatArray) -> None:
        while self._count + len(times) > len(self._times):
            self._simplify()
        rows = slice(self._count, self._count + len(times))
        self._positions[rows] = positions
        self._times[rows] = times
        self._count += len(times)

    def _note_starts(self, positions: FloatArray) -> None:
        """Store the positions of robots that have just joined as their starts."""
        for row, number in enumerate(self.numbers[: len(positions)]):
            if number not in self._starts:
                x, y = positions[row].tolist()
                self._starts[number] = (x, y)
                self._start_arrays = {}

    def _find_trail(self, time: float) -> "Trail":
        """Return the trail with the team at a time, s: this one, or one built from earlier sections."""
        section_count = self._count_sections_until(time)
        if section_count > len(self._closed_sections) or not self._closed_sections:
            return self
        earlier = self._earlier_trail
        if earlier is None or earlier.section_count != section_count:
            trail = build_trail(self._closed_sections[:section_count])
            earlier = self._earlier_trail = _EarlierTrail(section_count, trail)
        return earlier.trail

    def _count_sections_until(self, time: float) -> int:
        """Return the number of sections that have started by a time, s; the first one always counts.

        The section that is still open counts if it has rows.
        """
        starts = [float(section.times[0]) for section in self._closed_sections]
        if self._section_start < self._count:
            starts.append(float(self._times[self._section_start]))
        count = len(starts)
        while count > 1 and starts[count - 1] > time + _TIME_TOLERANCE_S:
            count -= 1
        return count

    def _simplify(self) -> None:
        """Remove a quarter of the rows: those whose removal changes the trajectories least.

        Only every second row is a candidate, so that no two neighbors are removed.
        """
        candidates = np.arange(1, self._count - 1, 2)
        deviations = _compute_deviations(self.positions, candidates)
        order = np.argsort(deviations, kind="stable")
        removed = candidates[order[: max(len(candidates) // 2, 1)]]
        is_kept = np.ones(self._count, dtype=bool)
        is_kept[removed] = False
        self._section_start -= int((removed < self._section_start).sum())
        count = int(is_kept.sum())
        self._positions[:count] = self.positions[is_kept]
        self._times[:count] = self.times[is_kept]
        self._count = count


class _EarlierTrail(NamedTuple):
    """A trail of the first closed sections of another one, cached because it is often needed again."""

    section_count: int
    trail: Trail


def build_trail(sections: Sequence[TrailSection]) -> Trail:
    """Build a trail from one or more sections in chronological order."""
    trail = Trail(sections[0].numbers)
    trail.extend(sections)
    return trail


def merge_sections(sections: list[TrailSection], later: Iterable[TrailSection]) -> list[TrailSection]:
    """Return sections, followed by those rows of `later` that come after their last row."""
    merged = [section for section in sections if len(section.times)]
    last_time = -np.inf
    if merged:
        last_time = float(merged[-1].times[-1])
    rest = [section.cut(last_time + 2 * _SAME_TIME_S, np.inf) for section in later]
    return merged + [section for section in rest if len(section.times)]


def _compute_deviations(positions: FloatArray, rows: IntArray) -> FloatArray:
    """Return the changes of the trajectories if single rows are removed, (r,) m.

    A row at which a robot joins or fails has an infinite deviation.

    Parameters
    ----------
    positions : (k, n, 2) array, m
        All rows; nan for robots that do not work.
    rows : (r,) int array
        Rows to consider; each has a neighbor on both sides.
    """
    before = positions[rows - 1]
    point = positions[rows] - before
    chord = positions[rows + 1] - before
    with np.errstate(invalid="ignore", divide="ignore"):
        fraction = (point * chord).sum(axis=2) / (chord * chord).sum(axis=2)
    # If both neighbors are at the same point, the fraction is nan, and that point is the nearest.
    fraction = np.clip(np.nan_to_num(fraction), 0.0, 1.0)
    offset = point - fraction[..., None] * chord
    distances = np.hypot(offset[..., 0], offset[..., 1])
    is_absent = np.isnan(positions[..., 0])
    is_change = (is_absent[rows] != is_absent[rows - 1]) | (is_absent[rows] != is_absent[rows + 1])
    distances[is_change] = np.inf
    deviations: FloatArray = np.nan_to_num(distances, nan=0.0, posinf=np.inf).max(axis=1, initial=0.0)
    return deviations


def select_robots(positions: FloatArray, before: Sequence[int], after: Sequence[int]) -> FloatArray:
    """Rearrange the columns of positions for another team.

    Parameters
    ----------
    positions : (..., n, 2) array, m
        Positions of the robots `before`.
    before, after : sequence of int
        Numbers of the robots in the columns before and after.

    Returns
    -------
    (..., m, 2) array, m
        Positions of the robots `after`; nan for those that are not among the robots `before`.
    """
    row_by_number = {number: row for row, number in enumerate(before)}
    rows = np.array([row_by_number.get(number, -1) for number in after], dtype=np.intp)
    return np.where(rows[:, None] < 0, np.nan, positions[..., rows, :])


def rebuild_trail(history: RunHistory, pane: int) -> Trail:
    """Build a trail from recorded states, for a run without a trail.

    Parameters
    ----------
    history : RunHistory
        The recorded past.
    pane : int
        Number of the pane.

    Returns
    -------
    Trail
    """
    trail = Trail(history[0].states[pane].setup.tracked_numbers)
    previous_setup: PaneSetup | None = None
    for index in range(len(history)):
        state = history[index].states[pane]
        is_edited = state.setup is not previous_setup
        is_last = index == len(history) - 1
        trail.change_robots(state.setup.tracked_numbers)
        # The last state is always added, because it may contain robots that have just joined.
        trail.add(history.get_time(index), state.positions, always=is_edited or is_last)
        previous_setup = state.setup
    return trail
