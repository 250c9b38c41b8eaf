"""The clock, which takes the simulation steps that are due, within the computing time of a frame."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, math.inf)
"""Selectable speeds, simulated seconds per second; infinite for as fast as possible."""
MAX_FRAME_S = 0.1
"""Maximum real time that is counted for a frame. Longer frames slow the simulation down."""
FRAME_BUDGET_S = 0.008
"""Maximum computing time for the simulation in each frame of a visible window."""
MAX_SPEED_WITHOUT_BUDGET = 16.0
"""Speed that replaces an infinite one if the computing time of a frame is not limited."""
_MAX_COMPARED_SPEED = 1e4
"""Finite speed that replaces higher ones, such as an infinite one, in comparisons."""
_STEP_TOLERANCE = 1e-9
"""Fraction of a step that may be missing when the step is already due; absorbs rounding errors."""


def format_speed(speed: float) -> str:
    """Return the label of a speed."""
    if math.isinf(speed):
        return "max"
    return f"{speed:g}×"


def find_speed_index(speed: float) -> int:
    """Return the index in `SPEEDS` of the speed whose ratio to a given one is nearest to 1."""

    def compute_log_ratio(index: int) -> float:
        return abs(_compute_log(SPEEDS[index]) - _compute_log(speed))

    return min(range(len(SPEEDS)), key=compute_log_ratio)


def _compute_log(speed: float) -> float:
    return math.log(min(speed, _MAX_COMPARED_SPEED))


@dataclass
class Clock:
    """Converts elapsed real time into simulation steps.

    Attributes
    ----------
    dt : float, s
        Simulated time per step.
    speed : float
        Simulated seconds per second.
    budget : float, s
        Maximum computing time for the steps of a frame; infinite to take all steps that are due.
    is_behind : bool
        Whether the last frame had too little computing time for all its steps.
    """

    dt: float
    speed: float = 1.0
    budget: float = math.inf
    is_behind: bool = False
    _due_s: float = 0.0

    def advance(self, seconds: float, take_step: Callable[[], bool]) -> int:
        """Take the steps that are due; drop those for which the computing time does not suffice.

        Parameters
        ----------
        seconds : float, s
            Real time since the previous call.
        take_step : callable
            Takes a step, and returns whether to continue.

        Returns
        -------
        int
            Number of steps that were taken.
        """
        started = perf_counter()
        uses_whole_budget = math.isinf(self.speed) and not math.isinf(self.budget)
        due_s = self._due_s
        due_steps = math.inf
        if not uses_whole_budget:
            speed = MAX_SPEED_WITHOUT_BUDGET if math.isinf(self.speed) else self.speed
            due_s += min(seconds, MAX_FRAME_S) * speed
            due_steps = math.floor(due_s / self.dt + _STEP_TOLERANCE)
        # If a step ends the playback or raises, nothing stays due.
        self._due_s = 0.0
        self.is_behind = False
        taken = 0
        while taken < due_steps:
            taken += 1
            if not take_step():
                return taken
            if perf_counter() - started > self.budget:
                self.is_behind = not uses_whole_budget and taken < due_steps
                break
        if uses_whole_budget:
            self._due_s = due_s
        elif not self.is_behind:
            self._due_s = max(due_s - taken * self.dt, 0.0)
        return taken
