from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov_app.viewer.session import clock as module
from robocov_app.viewer.session.clock import FRAME_BUDGET_S, MAX_FRAME_S, SPEEDS, Clock, format_speed

DT = 1 / 60


class Steps:
    """Counts steps; on the clock on the wall each takes a while."""

    def __init__(self, takes: float = 0.0, last: int | None = None) -> None:
        self.made, self.takes, self.last, self.now = 0, takes, last, 0.0

    def __call__(self) -> bool:
        self.made += 1
        self.now += self.takes
        return self.made != self.last


@pytest.fixture
def wall(monkeypatch):
    """Put a clock on the wall that only goes while steps are made."""

    def put(steps: Steps) -> Steps:
        monkeypatch.setattr(module, "perf_counter", lambda: steps.now)
        return steps

    return put


@pytest.mark.parametrize("speed", [speed for speed in SPEEDS if math.isfinite(speed)])
def test_as_many_steps_as_the_speed_says(speed, wall):
    steps, clock = wall(Steps()), Clock(DT, speed, budget=FRAME_BUDGET_S)
    for _ in range(600):
        clock.advance(1 / 60, steps)
    assert steps.made == pytest.approx(600 * speed, abs=1)
    assert not clock.is_behind


@given(st.lists(st.floats(0.0, MAX_FRAME_S), max_size=50), st.sampled_from(SPEEDS[:-1]))
def test_no_time_is_lost_or_made_up(frames, speed):
    steps, clock = Steps(), Clock(DT, speed)
    made = sum(clock.advance(seconds, steps) for seconds in frames)
    assert made == steps.made
    due = sum(frames) * speed / DT
    assert due - 1 - 1e-3 <= made <= due + 1e-3


def test_a_long_frame_is_not_made_up_for(wall):
    steps, clock = wall(Steps()), Clock(DT, budget=FRAME_BUDGET_S)
    assert clock.advance(100.0, steps) == round(MAX_FRAME_S / DT)
    assert clock.advance(0.0, steps) == 0


def test_what_does_not_fit_is_dropped(wall):
    steps, clock = wall(Steps(takes=0.003)), Clock(DT, 16.0, budget=FRAME_BUDGET_S)
    # 16 are due, of which three fit into 8 ms
    assert clock.advance(DT, steps) == 3
    assert clock.is_behind
    assert clock.advance(0.0, steps) == 0
    assert not clock.is_behind
    assert clock.advance(DT, steps) == 3


def test_a_step_that_takes_long_is_made_nonetheless(wall):
    steps, clock = wall(Steps(takes=1.0)), Clock(DT, budget=FRAME_BUDGET_S)
    assert clock.advance(DT, steps) == 1
    assert not clock.is_behind


def test_as_fast_as_it_goes_is_until_the_budget_is_used_up(wall):
    steps, clock = wall(Steps(takes=0.001)), Clock(DT, math.inf, budget=FRAME_BUDGET_S)
    assert clock.advance(DT, steps) == 9
    # slower than that is not behind
    assert not clock.is_behind


def test_without_a_clock_on_the_wall_the_highest_speed_is_one_like_any_other():
    steps, clock = Steps(), Clock(DT, math.inf)
    assert clock.advance(1 / 30, steps) == 32
    # however long the control period is
    slow = Clock(0.5, math.inf)
    assert sum(slow.advance(1 / 30, steps) for _ in range(30)) == 32
    assert steps.made == 64


def test_a_step_may_be_the_last(wall):
    steps, clock = wall(Steps(last=3)), Clock(DT, 16.0, budget=FRAME_BUDGET_S)
    assert clock.advance(DT, steps) == 3
    # what was still due then is not due any more
    steps.last = None
    assert clock.advance(0.0, steps) == 0
    assert clock.advance(DT, steps) == 16
    fast = Clock(DT, math.inf, budget=FRAME_BUDGET_S)
    assert fast.advance(DT, wall(Steps(last=5))) == 5


def test_a_step_that_fails_leaves_nothing_due():
    clock = Clock(DT, 16.0, budget=FRAME_BUDGET_S)

    def fails():
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        clock.advance(DT, fails)
    assert clock.advance(0.0, Steps()) == 0


def test_another_speed_or_period_from_now_on(wall):
    steps, clock = wall(Steps()), Clock(DT, budget=FRAME_BUDGET_S)
    clock.advance(0.9 * DT, steps)
    clock.speed, clock.dt = 0.5, 2 * DT
    assert clock.advance(0.0, steps) == 0
    assert clock.advance(4 * DT, steps) == 1


def test_speeds_in_words():
    words = [format_speed(speed) for speed in SPEEDS]
    assert words == ["0.1×", "0.25×", "0.5×", "1×", "2×", "4×", "8×", "16×", "max"]
