"""The clock: how many steps of the simulation are due, at any speed, without ever holding a frame up."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, math.inf)  # simulated seconds per second
LONGEST_FRAME = 0.1  # longest frame, s: what it took beyond is not made up for
FRAME_BUDGET = 0.008  # seconds of a frame that go to the steps of the simulation, where people look on
_PATIENT = 16.0  # speed of "as fast as it goes" where no time runs out


def speed_words(speed: float) -> str:
    return "max" if math.isinf(speed) else f"{speed:g}×"


def speed_index(speed: float) -> int:
    logs = [math.log(min(each, 1e4)) for each in (*SPEEDS, speed)]
    return min(range(len(SPEEDS)), key=lambda k: abs(logs[k] - logs[-1]))


@dataclass
class Clock:
    """Turns seconds that have passed into steps of `dt` seconds, at a speed."""

    dt: float
    speed: float = 1.0
    budget: float = math.inf  # s, so long the steps of a frame may take; infinite: all, whatever they take
    behind: bool = False  # whether the last frame's steps were more than its budget
    _due: float = 0.0

    def advance(self, seconds: float, step: Callable[[], bool]) -> int:
        """Make due steps until one says False; return how many. Those beyond the budget are dropped."""
        speed = _PATIENT if math.isinf(self.speed) and math.isinf(self.budget) else self.speed
        endless, began, made = math.isinf(speed), perf_counter(), 0
        due = self._due + (0.0 if endless else min(seconds, LONGEST_FRAME) * speed)
        wanted = math.inf if endless else math.floor(due / self.dt + 1e-9)
        self._due, self.behind = 0.0, False
        while made < wanted:
            made += 1
            if not step():
                return made
            if perf_counter() - began > self.budget:
                self.behind = not endless and made < wanted
                break
        if not self.behind:
            self._due = due if endless else max(due - made * self.dt, 0.0)
        return made
