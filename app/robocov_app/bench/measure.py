"""Times that can be trusted on a shared machine: calls in turn, medians, ratios."""

import gc
import itertools
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass
from statistics import median
from time import perf_counter
from typing import Any, TypeAlias

Call: TypeAlias = Callable[[], object]
Case: TypeAlias = Callable[[], Iterable["Row"]]  # something to measure


@dataclass(frozen=True)
class Row:
    """One median time, and that of its yardstick in the same run if there is one."""

    part: str
    name: str
    parameters: Mapping[str, int | str]  # what is varied, as in {"robots": 50}
    seconds: float
    yardstick: str | None = None
    yardstick_seconds: float | None = None
    goal: float | None = None  # largest ratio that is wanted
    goal_seconds: float | None = None  # longest time
    note: str = ""  # the time in other words: 95 x real time
    before: float | None = None  # about the ratio when nothing was compiled (commit 8838167)

    @property
    def ratio(self) -> float | None:
        return None if self.yardstick_seconds is None else self.seconds / self.yardstick_seconds

    @property
    def met(self) -> bool | None:
        """Whether what is wanted is reached; None where nothing is."""
        limits = ((self.ratio, self.goal), (self.seconds, self.goal_seconds))
        reached = [value <= goal for value, goal in limits if value is not None and goal is not None]
        return all(reached) if reached else None

    @property
    def case(self) -> str:
        words = {"lattice": "{0} x {0}", "map": "{0}"}
        given = self.parameters.items()
        return ", ".join(words.get(name, "{0} " + name).format(value) for name, value in given)

    def to_dict(self) -> dict[str, Any]:
        return asdict(self) | {"ratio": self.ratio, "met": self.met}


def in_turn(
    calls: Mapping[str, Call],
    count: int,
    seconds: float = 0.0,
    *,
    clock: Callable[[], float] = perf_counter,
    before: Call = lambda: None,
) -> dict[str, float]:
    """Return median times of calls in turn, as a shared machine slows all alike; `before` is not timed.

    There are at least `count` rounds, and `seconds` of them, after one that does not count.
    """
    taken: dict[str, list[float]] = {name: [] for name in calls}
    collecting = gc.isenabled()
    gc.collect()
    gc.disable()
    try:
        for call in calls.values():
            call()
        until = clock() + seconds
        for made in itertools.count():
            if made >= count and clock() >= until:
                break
            before()
            for name, call in calls.items():
                begin = clock()
                call()
                taken[name].append(clock() - begin)
    finally:
        if collecting:
            gc.enable()
    return {name: median(times) for name, times in taken.items()}
