"""Cost curves of the chart, curves of other branches, and events."""

from bisect import bisect_left, bisect_right
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from robocov.typing import FloatArray

MAX_CURVE_SAMPLES = 3000
"""When a curve has this many samples, about half of them are removed."""
_SAME_TIME_S = 1e-9
_TIME_TOLERANCE_S = 1e-6
_FILE_TIME_DECIMALS = 3


@dataclass(frozen=True)
class SessionEvent:
    """An event in a session.

    Attributes
    ----------
    time : float, s
        Time at which it happened.
    kind : str
        Kind of event, such as ``"obstacle"``, ``"robot"``, ``"failure"`` or ``"law"``.
    text : str
        Description.
    """

    time: float
    kind: str
    text: str


class Curve:
    """Samples of a coverage cost at ascending times: the mean distance to the nearest robot, or mean time."""

    def __init__(self) -> None:
        self._times: list[float] = []
        self._values: list[float] = []

    def __len__(self) -> int:
        return len(self._times)

    @property
    def times(self) -> FloatArray:
        """Times of the samples, (k,) s."""
        return np.array(self._times)

    @property
    def values(self) -> FloatArray:
        """Values of the samples, (k,)."""
        return np.array(self._values)

    @property
    def first_time(self) -> float:
        """Time of the oldest sample, s; inf if there is none."""
        if self._times:
            return self._times[0]
        return np.inf

    @property
    def last_time(self) -> float:
        """Time of the newest sample, s; -inf if there is none."""
        if self._times:
            return self._times[-1]
        return -np.inf

    def add(self, time: float, value: float) -> None:
        """Add a sample, or replace the one at the same time; ignore samples that are not finite."""
        if not np.isfinite([time, value]).all():
            return
        index = bisect_left(self._times, time - _SAME_TIME_S)
        if index < len(self._times) and self._times[index] <= time + _SAME_TIME_S:
            self._values[index] = value
            return
        if len(self._times) >= MAX_CURVE_SAMPLES:
            self._thin()
            index = bisect_left(self._times, time)
        self._times.insert(index, time)
        self._values.insert(index, value)

    def sample(self, maximum: int) -> list[list[float]]:
        """Return evenly spaced samples, rounded for a file.

        Parameters
        ----------
        maximum : int
            Maximum number of samples.

        Returns
        -------
        list of list of float
            List of times, s, and list of values. They include the first and the newest sample.
        """
        count = min(maximum, len(self))
        # Counted from the end: if only one sample is requested, it is the newest.
        indices = np.unique(np.linspace(len(self) - 1, 0, count).round().astype(int)).tolist()
        times = [self._times[index] for index in indices]
        values = [self._values[index] for index in indices]
        return [
            [round(time, _FILE_TIME_DECIMALS) for time in times],
            [float(f"{value:.5g}") for value in values],
        ]

    def extract(self, start: float, end: float) -> "Curve":
        """Return the samples between two times, s, inclusive, as a curve."""
        first = bisect_left(self._times, start - _TIME_TOLERANCE_S)
        last = bisect_right(self._times, end + _TIME_TOLERANCE_S)
        part = Curve()
        part._times = self._times[first:last]
        part._values = self._values[first:last]
        return part

    def extend(self, later: "Curve", end: float = np.inf) -> None:
        """Append the samples of another curve after the last one of this curve, up to a time, s."""
        for time, value in zip(later._times, later._values, strict=True):
            if self.last_time + _SAME_TIME_S < time <= end + _TIME_TOLERANCE_S:
                self.add(time, value)

    def interpolate(self, time: float) -> float:
        """Return the value at a time, interpolated linearly; nan before the first sample."""
        if not self._times or time < self._times[0] - _TIME_TOLERANCE_S:
            return float("nan")
        return float(np.interp(time, self._times, self._values))

    def list_gaps(self, min_length: float) -> list[tuple[float, float]]:
        """Return the intervals between successive samples that exceed a length, longest first.

        Parameters
        ----------
        min_length : float, s
            Only longer intervals are returned.

        Returns
        -------
        list of (float, float), s
            Times of the samples at both ends of each interval.
        """
        times = self.times
        lengths = np.diff(times)
        longest_first = np.argsort(-lengths, kind="stable")
        count = int((lengths > min_length).sum())
        return [(float(times[index]), float(times[index + 1])) for index in longest_first[:count]]

    def _thin(self) -> None:
        """Keep about half of the samples, evenly spread over time, with the first and the newest one."""
        times = self.times
        interval = (times[-1] - times[0]) / (MAX_CURVE_SAMPLES // 2)
        intervals = np.floor((times - times[0]) / interval)
        is_kept = np.append(True, intervals[1:] != intervals[:-1])
        is_kept[-1] = True
        self._times = times[is_kept].tolist()
        self._values = self.values[is_kept].tolist()


@dataclass(frozen=True, eq=False)
class GhostCurve:
    """The part of another branch's curve that it does not share with the present branch.

    Attributes
    ----------
    controller : str
        Name of the controller.
    description : str
        Description of the controller with its gains.
    times : (k,) array, s
        Times of the samples.
    values : (k,) array
        Values of the samples.
    quantity : str
        ``"distance"`` or ``"time"``.
    node : int
        Number of the node at which the branch ends.
    """

    controller: str
    description: str
    times: FloatArray
    values: FloatArray
    quantity: str = "distance"
    node: int = 0


class PlottedQuantity(NamedTuple):
    """A quantity that the chart can show.

    Attributes
    ----------
    name : str
        Name in code and files.
    title : str
        Title of the plot.
    short_title : str
        Title for places with little space.
    unit : str
        Unit of the values.
    """

    name: str
    title: str
    short_title: str
    unit: str


DISTANCE = PlottedQuantity("distance", "Mean distance to the nearest robot", "Mean distance", "m")
TIME = PlottedQuantity("time", "Mean time until the first robot is there", "Mean time", "s")
