"""Timing that is meaningful on a shared machine: alternating calls, medians and ratios."""

import gc
import itertools
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from statistics import median
from time import perf_counter
from typing import Any, TypeAlias

Call: TypeAlias = Callable[[], object]
"""A call whose duration is measured."""
Case: TypeAlias = Callable[[], Iterable["Row"]]
"""A benchmark case: runs its measurements and yields their rows."""


@dataclass(frozen=True)
class Row:
    """A row of the benchmark: a median time, and the baseline's time in the same measurement.

    Parameters
    ----------
    part : str
        Part of the benchmark, as in `robocov bench PART`.
    name : str
        Name of the measured work.
    parameters : Mapping
        Varied parameters, for example ``{"robots": 50}``.
    seconds : float, s
        Median time.
    baseline : str, optional
        Name of the baseline.
    baseline_seconds : float, optional, s
        Median time of the baseline.
    max_ratio : float, optional
        Goal: maximum ratio of the time to that of the baseline.
    max_seconds : float, optional, s
        Goal: maximum time.
    note : str
        The time in another unit, for example "95 x real time".
    earlier_ratio : float, optional
        Approximate ratio before any code was compiled (commit 8838167).
    """

    part: str
    name: str
    parameters: Mapping[str, int | str]
    seconds: float
    baseline: str | None = None
    baseline_seconds: float | None = None
    max_ratio: float | None = None
    max_seconds: float | None = None
    note: str = ""
    earlier_ratio: float | None = None

    @property
    def ratio(self) -> float | None:
        """Ratio of the time to that of the baseline; None without a baseline."""
        if self.baseline_seconds is None:
            return None
        return self.seconds / self.baseline_seconds

    @property
    def meets_goals(self) -> bool | None:
        """Whether all goals are met; None if there are none."""
        results = []
        if self.ratio is not None and self.max_ratio is not None:
            results.append(self.ratio <= self.max_ratio)
        if self.max_seconds is not None:
            results.append(self.seconds <= self.max_seconds)
        if not results:
            return None
        return all(results)

    @property
    def case(self) -> str:
        """Parameters as text, for example "128 x 128, 6 robots"."""
        texts = []
        for name, value in self.parameters.items():
            if name == "lattice":
                texts.append(f"{value} x {value}")
            elif name == "map":
                texts.append(str(value))
            else:
                texts.append(f"{value} {name}")
        return ", ".join(texts)

    def to_dict(self) -> dict[str, Any]:
        """Return the row, with its ratio and result, as a dictionary for JSON."""
        return {
            "part": self.part,
            "name": self.name,
            "parameters": dict(self.parameters),
            "seconds": self.seconds,
            "baseline": self.baseline,
            "baseline_seconds": self.baseline_seconds,
            "goal": self.max_ratio,
            "goal_seconds": self.max_seconds,
            "note": self.note,
            "before": self.earlier_ratio,
            "ratio": self.ratio,
            "met": self.meets_goals,
        }


def measure_interleaved(
    calls: Mapping[str, Call],
    min_rounds: int,
    min_duration: float = 0.0,
    *,
    clock: Callable[[], float] = perf_counter,
    before_round: Call = lambda: None,
) -> dict[str, float]:
    """Time several calls in turn, so that other programs slow all of them down equally.

    A warm-up round, which is not timed, comes first.

    Parameters
    ----------
    calls : Mapping
        The calls by name.
    min_rounds : int
        Minimum number of rounds.
    min_duration : float, s
        Minimum duration of all timed rounds together, including the calls of `before_round`.
    clock : callable
        Returns the current time, s.
    before_round : callable
        Called before each timed round; not part of the times of the calls.

    Returns
    -------
    dict
        Median time of each call, s.
    """
    times: dict[str, list[float]] = {name: [] for name in calls}
    is_gc_enabled = gc.isenabled()
    gc.collect()
    gc.disable()
    try:
        for call in calls.values():
            call()
        end = clock() + min_duration
        for rounds in itertools.count():
            if rounds >= min_rounds and clock() >= end:
                break
            before_round()
            for name, call in calls.items():
                start = clock()
                call()
                times[name].append(clock() - start)
    finally:
        if is_gc_enabled:
            gc.enable()
    return {name: median(measured) for name, measured in times.items()}
