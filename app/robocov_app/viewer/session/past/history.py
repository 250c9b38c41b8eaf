"""The recorded past of a run: states from which it can be resumed, within a memory limit."""

from bisect import bisect_right
from collections.abc import Collection, Iterable, Mapping
from copy import copy
from dataclasses import fields, is_dataclass
from itertools import compress
from typing import Any, Self, TypeAlias

import numpy as np

from robocov_app.viewer.session.past.states import RunState

MAX_HISTORY_BYTES = 24_000_000
"""Approximate maximum memory for the recorded past of a window."""
MIN_STATES = 300
"""Number of states below which none is removed, however large they are."""
MAX_KEPT_FRACTION = 0.75
"""Maximum fraction of the states that remain when the past is thinned."""
_PANE_OVERHEAD_BYTES = 700
"""Approximate memory for the state of one pane without its arrays."""
_OBJECT_OVERHEAD_BYTES = 50
"""Approximate memory for an object in the memory of a controller."""
_MAX_SIZE_DEPTH = 4
"""Nesting depth up to which the size of a controller's memory is estimated."""
_STEP_TOLERANCE = 1e-6
_Selection: TypeAlias = np.ndarray[Any, np.dtype[np.bool_]]
"""Whether each state is kept, (k,)."""


class RunHistory:
    """States of a run in ascending order of their steps.

    When the states need more than `max_bytes`, older ones are thinned: beyond a certain age, only every
    second step is kept; beyond twice that age, every fourth; and so on. The newest states are all kept, and
    so are those right after an edit, unless there are too many of them.

    Parameters
    ----------
    dt : float, s
        Control period.
    max_bytes : int
        Approximate memory limit.

    Attributes
    ----------
    states : list of RunState
        The states that are kept.
    thinned : int
        Number of states that were removed.
    """

    def __init__(self, dt: float, max_bytes: int = MAX_HISTORY_BYTES) -> None:
        self.dt = dt
        self.max_bytes = max_bytes
        self.states: list[RunState] = []
        self.thinned = 0
        self._sizes: list[int] = []
        self._bytes = 0

    def __len__(self) -> int:
        return len(self.states)

    def __getitem__(self, index: int) -> RunState:
        return self.states[index]

    @property
    def last(self) -> RunState:
        """The newest state."""
        return self.states[-1]

    @property
    def steps(self) -> list[int]:
        """Steps of all states."""
        return [state.step for state in self.states]

    def get_time(self, index: int) -> float:
        """Return the time of a state, s."""
        return self.states[index].step * self.dt

    def append(self, state: RunState) -> None:
        """Append a newer state; thin the older ones if the memory limit is exceeded."""
        size = estimate_state_bytes(state)
        self.states.append(state)
        self._sizes.append(size)
        self._bytes += size
        # Thin repeatedly, until the states fit or no more of them can be removed.
        previous_count = len(self) + 1
        while self._bytes > self.max_bytes and MIN_STATES < len(self) < previous_count:
            previous_count = len(self)
            self._thin()

    def amend(self, state: RunState) -> None:
        """Append a state; if the newest one has the same step, replace it."""
        if self.states and self.last.step == state.step:
            self._remove_last()
        self.append(state)

    def rewind(self, last: RunState) -> None:
        """Remove the states after a given one, which becomes the newest one again, even if it was removed."""
        while self.states and self.last is not last and self.last.step >= last.step:
            self._remove_last()
        if not self.states or self.last is not last:
            self.append(last)

    def find_index(self, time: float) -> int:
        """Return the index of the last state at or before a time, s; 0 if there is none."""
        step = time / self.dt + _STEP_TOLERANCE
        return max(bisect_right(self.states, step, key=lambda state: state.step) - 1, 0)

    def copy_until(self, index: int) -> Self:
        """Return a copy of the history up to and including the state with an index."""
        duplicate = copy(self)
        duplicate.states = self.states[: index + 1]
        duplicate._sizes = self._sizes[: index + 1]
        duplicate._bytes = sum(duplicate._sizes)
        return duplicate

    def _remove_last(self) -> None:
        self.states.pop()
        self._bytes -= self._sizes.pop()

    def _thin(self) -> None:
        """Remove states, preferably old ones, until at most the fraction `MAX_KEPT_FRACTION` is left."""
        count = len(self)
        is_kept = self._select_states()
        self.states = list(compress(self.states, is_kept))
        self._sizes = list(compress(self._sizes, is_kept))
        self.thinned += count - len(self)
        self._bytes = sum(self._sizes)

    def _select_states(self) -> _Selection:
        """Select the states to keep when the past is thinned.

        States right after an edit are kept as well, unless too many states would be left.
        """
        is_edited = np.array([True, *map(_has_new_setup, self.states, self.states[1:])])
        is_kept = self._select_by_age(is_edited)
        if is_kept.sum() > MAX_KEPT_FRACTION * len(self):
            is_first = np.arange(len(self)) == 0
            is_kept = self._select_by_age(is_first)
        return is_kept

    def _select_by_age(self, is_required: _Selection) -> _Selection:
        """Select the required states and some of the others, preferably new ones.

        The newest `complete_count` states are all selected. Among states up to twice as old as those, every
        second step is selected; among states up to four times as old, every fourth; and so on.
        `complete_count` is halved until at most the fraction `MAX_KEPT_FRACTION` is selected, if possible.
        """
        count = len(self)
        steps = np.array(self.steps)
        ages = steps[-1] - steps
        is_kept = np.ones(count, dtype=bool)
        complete_count = count // 2
        while complete_count > 1 and is_kept.sum() > MAX_KEPT_FRACTION * count:
            complete_count //= 2
            relative_ages = np.maximum(ages / ages[-1 - complete_count], 1.0)
            strides = 2 ** np.ceil(np.log2(relative_ages)).astype(np.intp)
            is_kept = is_required | (steps % strides == 0)
        return is_kept


def _has_new_setup(before: RunState, after: RunState) -> bool:
    """Return whether a pane was edited between two states."""
    return any(
        before.states[pane].setup is not state.setup
        for pane, state in after.states.items()
        if pane in before.states
    )


def estimate_state_bytes(state: RunState) -> int:
    """Estimate the memory that a state needs, in bytes."""
    total = 0
    for pane_state in state.states.values():
        total += _PANE_OVERHEAD_BYTES
        total += _estimate_bytes(pane_state.memory)
        total += _estimate_bytes(pane_state.inbox)
        total += _estimate_bytes(pane_state.steering)
        total += _estimate_bytes(pane_state.positions)
        total += _estimate_bytes(pane_state.velocities)
    return total


def _estimate_bytes(value: Any, depth: int = _MAX_SIZE_DEPTH) -> int:
    """Estimate the memory, in bytes, of a value of any type that a controller remembers."""
    if isinstance(value, np.ndarray):
        return value.nbytes
    if value is None or depth == 0:
        return 0
    if isinstance(value, str | bytes):
        return len(value)
    parts: Iterable[Any] = ()
    if isinstance(value, Mapping):
        parts = value.values()
    elif isinstance(value, Collection):
        parts = value
    elif is_dataclass(value):
        parts = (getattr(value, item.name) for item in fields(value))
    elif hasattr(value, "__dict__"):
        parts = vars(value).values()
    return _OBJECT_OVERHEAD_BYTES + sum(_estimate_bytes(part, depth - 1) for part in parts)
