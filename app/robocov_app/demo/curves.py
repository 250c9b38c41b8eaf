"""Cost against time, one curve for each pane, with what happened; bounded like everything here."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from robocov.arrays import Array

MOST_SAMPLES = 3000
"""When a curve has so many, every second one of its older half goes."""


@dataclass(frozen=True)
class Event:
    """Something that happened.

    Attributes
    ----------
    time : float, s
    kind : str
        ``obstacle``, ``robot``, ``failure``, ``law``, ``limits`` or ``hand``.
    text : str
    """

    time: float
    kind: str
    text: str


class Curve:
    """The mean distance to the nearest robot, (22) by area or by ∫φ, or the mean time, at ascending times."""

    def __init__(self) -> None:
        self._time: list[float] = []
        self._value: list[float] = []

    def __len__(self) -> int:
        return len(self._time)

    @property
    def time(self) -> Array:
        """Times, (k,) s."""
        return np.array(self._time)

    @property
    def value(self) -> Array:
        """Mean distances, (k,) m, or times, (k,) s."""
        return np.array(self._value)

    @property
    def last_time(self) -> float:
        """The time of the newest sample, s; minus infinity if there is none."""
        return self._time[-1] if self._time else -np.inf

    def add(self, time: float, value: float) -> None:
        """Append a sample; one that is earlier than the last is left out, one of its time replaces it."""
        if time < self.last_time - 1e-9 or not np.isfinite([time, value]).all():
            return
        if time <= self.last_time + 1e-9:
            self._value[-1] = value
            return
        if len(self._time) >= MOST_SAMPLES:
            half = MOST_SAMPLES // 2
            self._time[:half] = self._time[:half:2]
            self._value[:half] = self._value[:half:2]
        self._time.append(time)
        self._value.append(value)

    def copy(self) -> Curve:
        """Return a curve of its own with the same samples."""
        twin = Curve()
        twin._time, twin._value = self._time[:], self._value[:]
        return twin

    def cut(self, time: float) -> Curve:
        """Forget what came after `time`; return it, the last sample before it too."""
        k = int(np.searchsorted(self._time, time + 1e-6, side="right"))
        rest = Curve()
        rest._time, rest._value = self._time[max(k - 1, 0) :], self._value[max(k - 1, 0) :]
        del self._time[k:], self._value[k:]
        return rest

    def at(self, time: float) -> float:
        """Return the value at a time, between samples on the straight line; nan before the first.

        After the last sample it is that one's.
        """
        if not self._time or time < self._time[0] - 1e-6:
            return float("nan")
        return float(np.interp(time, self._time, self._value))


@dataclass(frozen=True, eq=False)
class Ghost:
    """The rest of a curve that was left when the run was resumed from an earlier moment.

    Attributes
    ----------
    law : str
        Name of the controller.
    words : str
        What was different then.
    time : (k,) s
    value : (k,) m or s
    of : str
        What the value is: "distance" or "time".
    """

    law: str
    words: str
    time: Array
    value: Array
    of: str = "distance"
