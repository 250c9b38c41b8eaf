"""The clock: steps that are due at a speed, within the computing time of a frame."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov_app.viewer.session import clock as module
from robocov_app.viewer.session.clock import (
    FRAME_BUDGET_S,
    MAX_FRAME_S,
    SPEEDS,
    Clock,
    find_speed_index,
    format_speed,
)

DT = 1 / 60
FINITE_SPEEDS = [speed for speed in SPEEDS if math.isfinite(speed)]


class StepCounter:
    """Counts steps.

    Parameters
    ----------
    duration : float, s
        Computing time of a step.
    last : int or None
        Number of the step after which no further ones are wanted.
    """

    def __init__(self, duration: float = 0.0, last: int | None = None) -> None:
        self.count = 0
        self.duration = duration
        self.last = last
        self.elapsed = 0.0

    def __call__(self) -> bool:
        self.count += 1
        self.elapsed += self.duration
        return self.count != self.last


@pytest.fixture
def measure_time(monkeypatch):
    """Advance the time only while steps are computed."""

    def use_counter(counter: StepCounter) -> StepCounter:
        monkeypatch.setattr(module, "perf_counter", lambda: counter.elapsed)
        return counter

    return use_counter


@pytest.mark.parametrize("speed", FINITE_SPEEDS)
def test_the_number_of_steps_is_that_of_the_speed(speed, measure_time):
    counter = measure_time(StepCounter())
    clock = Clock(DT, speed, budget=FRAME_BUDGET_S)
    for _ in range(600):
        clock.advance(1 / 60, counter)
    assert counter.count == pytest.approx(600 * speed, abs=1)
    assert not clock.is_behind


@given(st.lists(st.floats(0.0, MAX_FRAME_S), max_size=50), st.sampled_from(FINITE_SPEEDS))
def test_fractions_of_steps_are_neither_lost_nor_added(frames, speed):
    counter = StepCounter()
    clock = Clock(DT, speed)
    taken = sum(clock.advance(seconds, counter) for seconds in frames)
    assert taken == counter.count
    due = sum(frames) * speed / DT
    assert due - 1 - 1e-3 <= taken <= due + 1e-3


def test_a_long_frame_is_not_made_up_for(measure_time):
    counter = measure_time(StepCounter())
    clock = Clock(DT, budget=FRAME_BUDGET_S)
    assert clock.advance(100.0, counter) == round(MAX_FRAME_S / DT)
    assert clock.advance(0.0, counter) == 0


def test_steps_beyond_the_computing_time_are_dropped(measure_time):
    counter = measure_time(StepCounter(duration=0.003))
    clock = Clock(DT, 16.0, budget=FRAME_BUDGET_S)
    # Sixteen steps are due, of which three fit into 8 ms.
    assert clock.advance(DT, counter) == 3
    assert clock.is_behind
    assert clock.advance(0.0, counter) == 0
    assert not clock.is_behind
    assert clock.advance(DT, counter) == 3


def test_a_single_slow_step_is_taken(measure_time):
    counter = measure_time(StepCounter(duration=1.0))
    clock = Clock(DT, budget=FRAME_BUDGET_S)
    assert clock.advance(DT, counter) == 1
    assert not clock.is_behind


def test_the_highest_speed_uses_up_the_computing_time(measure_time):
    counter = measure_time(StepCounter(duration=0.001))
    clock = Clock(DT, math.inf, budget=FRAME_BUDGET_S)
    assert clock.advance(DT, counter) == 9
    assert not clock.is_behind


def test_without_a_limit_of_computing_time_the_highest_speed_is_finite():
    counter = StepCounter()
    clock = Clock(DT, math.inf)
    assert clock.advance(1 / 30, counter) == 32
    slow_clock = Clock(0.5, math.inf)
    assert sum(slow_clock.advance(1 / 30, counter) for _ in range(30)) == 32
    assert counter.count == 64


def test_steps_that_were_due_at_a_pause_are_dropped(measure_time):
    counter = measure_time(StepCounter(last=3))
    clock = Clock(DT, 16.0, budget=FRAME_BUDGET_S)
    assert clock.advance(DT, counter) == 3
    counter.last = None
    assert clock.advance(0.0, counter) == 0
    assert clock.advance(DT, counter) == 16
    fast_clock = Clock(DT, math.inf, budget=FRAME_BUDGET_S)
    assert fast_clock.advance(DT, measure_time(StepCounter(last=5))) == 5


def test_after_a_step_that_raises_none_is_due():
    clock = Clock(DT, 16.0, budget=FRAME_BUDGET_S)

    def fail():
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        clock.advance(DT, fail)
    assert clock.advance(0.0, StepCounter()) == 0


def test_speed_and_period_can_change(measure_time):
    counter = measure_time(StepCounter())
    clock = Clock(DT, budget=FRAME_BUDGET_S)
    clock.advance(0.9 * DT, counter)
    clock.speed = 0.5
    clock.dt = 2 * DT
    assert clock.advance(0.0, counter) == 0
    assert clock.advance(4 * DT, counter) == 1


def test_speeds_have_labels():
    labels = [format_speed(speed) for speed in SPEEDS]
    assert labels == ["0.1×", "0.25×", "0.5×", "1×", "2×", "4×", "8×", "16×", "max"]


@pytest.mark.parametrize(("speed", "nearest"), [(1.0, 1.0), (0.01, 0.1), (3.0, 4.0), (1e9, math.inf)])
def test_the_nearest_selectable_speed_is_found(speed, nearest):
    assert SPEEDS[find_speed_index(speed)] == nearest
