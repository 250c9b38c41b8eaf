"""Cost curves of the time line, with events and the ghosts of other branches; thinned with age."""

from bisect import bisect_left, bisect_right
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from robocov.arrays import Array

MOST_SAMPLES = 3000  # when a curve has so many, every second one of its older half goes


@dataclass(frozen=True)
class Event:
    """Something that happened at a time, s; `kind`: ``obstacle``, ``robot``, ``failure``, ``law``, ..."""

    time: float
    kind: str
    text: str


class Curve:
    """The mean distance to the nearest robot, (22) by area or by ∫φ, or the mean time, at ascending times."""

    def __init__(self) -> None:
        self._time, self._value = list[float](), list[float]()

    def __len__(self) -> int:
        return len(self._time)

    @property
    def time(self) -> Array:
        return np.array(self._time)

    @property
    def value(self) -> Array:
        return np.array(self._value)

    @property
    def last_time(self) -> float:
        """The time of the newest sample, s; -inf if there is none."""
        return self._time[-1] if self._time else -np.inf

    def add(self, time: float, value: float) -> None:
        """Take a sample at any time; one of the same time is replaced."""
        if not np.isfinite([time, value]).all():
            return
        k = bisect_left(self._time, time - 1e-9)
        if k < len(self._time) and self._time[k] <= time + 1e-9:
            self._value[k] = value
            return
        if len(self._time) >= MOST_SAMPLES:
            half = MOST_SAMPLES // 2
            self._time[:half], self._value[:half] = self._time[:half:2], self._value[:half:2]
            k = bisect_left(self._time, time)
        self._time.insert(k, time)
        self._value.insert(k, value)

    def outline(self, most: int) -> list[list[float]]:
        stride = -(-len(self) // most)
        times, values = self._time[::-stride][::-1], self._value[::-stride][::-1]
        return [[round(time, 3) for time in times], [float(f"{value:.5g}") for value in values]]

    def between(self, begin: float, end: float) -> "Curve":
        first, last = bisect_left(self._time, begin - 1e-6), bisect_right(self._time, end + 1e-6)
        part = Curve()
        part._time, part._value = self._time[first:last], self._value[first:last]
        return part

    def extend(self, later: "Curve", until: float = np.inf) -> None:
        """Append those samples of another curve that are later than the last one here, up to a time, s."""
        for time, value in zip(later._time, later._value, strict=True):
            if self.last_time + 1e-9 < time <= until + 1e-6:
                self.add(time, value)

    def at(self, time: float) -> float:
        """Return the value at a time, between samples on the straight line; nan before the first."""
        if not self._time or time < self._time[0] - 1e-6:
            return float("nan")
        return float(np.interp(time, self._time, self._value))


@dataclass(frozen=True, eq=False)
class Ghost:
    """The rest of a curve that was left when the run was resumed from before."""

    law: str  # name of the controller
    words: str  # what was different then
    time: Array
    value: Array
    of: str = "distance"  # or "time"
    node: int = 0  # at whose end the branch ends


class Plotted(NamedTuple):
    """Plottable quantity. `title`, `short`: as people call it."""

    name: str
    title: str
    short: str
    unit: str


DISTANCE = Plotted("distance", "Mean distance to the nearest robot", "mean distance", "m")
TIME = Plotted("time", "Mean time until the first robot is there", "mean time", "s")
