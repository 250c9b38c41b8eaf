from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sample_sessions import HALL, RAPF

from robocov.environment import CircleObstacle
from robocov_app.viewer.session import history as module
from robocov_app.viewer.session.history import RunHistory
from robocov_app.viewer.session.robot_properties import RobotProperties
from robocov_app.viewer.session.states import PaneSetup, PaneState, RunState

DT = 1 / 60
FEWEST = 24
ONE = 700 + 2 * 16
"""Bytes of a moment of one robot."""


@pytest.fixture(autouse=True)
def few(monkeypatch):
    monkeypatch.setattr(module, "MIN_STATES", FEWEST)


def setup(failed=None) -> PaneSetup:
    return PaneSetup(HALL, RAPF, RobotProperties(), (1,), failed or {})


THEN = setup()


def moment(step, there=THEN, n=1, memory=None, pane=0) -> RunState:
    return RunState(
        step, {pane: PaneState(there, np.full((n, 2), float(step)), np.zeros((n, 2)), memory)}, None
    )


def filled(steps, most=60 * ONE, there=lambda step: THEN) -> RunHistory:
    history = RunHistory(DT, most)
    for step in range(steps):
        history.append(moment(step, there(step)))
    return history


def taken(history) -> int:
    return sum(700 * len(each.states) + 32 * len(each.states[0].positions) for each in history.states)


def powers_of_two(numbers) -> bool:
    return all(number & (number - 1) == 0 for number in numbers)


def test_moments_come_back_in_their_order():
    history = filled(5)
    assert len(history) == 5
    assert history.steps == [0, 1, 2, 3, 4]
    assert history[3].step == 3
    assert history.last.step == 4
    assert history.get_time(3) == 3 * DT
    assert history.thinned == 0


@given(st.integers(0, 900), st.integers(30, 120))
@settings(max_examples=200)
def test_whatever_is_added_the_past_stays_bounded_and_even(steps, most):
    history = filled(steps + 1, most * ONE)
    assert len(history) <= most
    assert taken(history) <= most * ONE
    assert len(history) + history.thinned == steps + 1
    gaps = np.diff(history.steps)
    assert (gaps > 0).all()
    assert powers_of_two(gaps.tolist())
    # never finer than what is newer
    assert (np.diff(gaps) <= gaps[:-1]).all()
    assert history.steps[0] == 0
    assert history.last.step == steps
    newest = min(steps, most // 16)
    assert history.steps[-1 - newest :] == list(range(steps - newest, steps + 1))


@st.composite
def runs(draw):
    """Runs that were touched here and there, at which robots came and went."""
    kinds = st.sampled_from(["step"] * 6 + ["touch", "amend", "robots"])
    return draw(st.lists(st.tuples(kinds, st.integers(1, 40)), max_size=40))


@given(runs())
@settings(max_examples=200)
def test_whatever_happens_nothing_gets_out_of_order(run):
    most = 80 * ONE
    history, step, there, n, touched = RunHistory(DT, most), 0, THEN, 1, set()
    history.append(moment(0))
    for kind, number in run:
        if kind == "robots":
            n = number
        if kind in ("touch", "amend", "robots"):
            there = setup()
            history.amend(moment(step, there, n))
            touched |= {step}
        for _ in range(number if kind == "step" else 1):
            step += 1
            history.append(moment(step, there, n))
        assert history.last.step == step
        assert len(history.last.states[0].positions) == n
        assert (np.diff(history.steps) > 0).all()
        assert taken(history) <= most or len(history) <= FEWEST
        assert history.steps[0] == 0
        for time in (-1.0, 0.0, 0.37 * step * DT, step * DT, 1e9):
            k = history.find_index(time)
            assert k == 0 or history.get_time(k) <= time + 1e-6
            assert k == len(history) - 1 or history.get_time(k + 1) > time
    if len(touched) < 8:
        assert touched <= set(history.steps)


def test_what_was_touched_is_kept():
    events = {101: setup(), 203: setup(), 747: setup()}

    def there(step):
        return events[max((begin for begin in events if begin <= step), default=101)]

    history = filled(2000, 100 * ONE, there)
    assert {203, 747} <= set(history.steps)
    assert len(history) <= 100


def test_a_run_that_is_touched_all_the_time_is_thinned_too():
    history = filled(1500, 100 * ONE, lambda step: setup())
    assert len(history) <= 100
    assert taken(history) <= 100 * ONE
    assert history.steps[0] == 0
    assert history.last.step == 1499


def test_few_moments_are_kept_however_large_they_are():
    history = RunHistory(DT, 1000)
    for step in range(100):
        history.append(moment(step, n=50))
        assert len(history) <= FEWEST
    assert len(history) >= FEWEST // 2
    assert history.steps[0] == 0


def test_a_larger_team_takes_more():
    small, large = RunHistory(DT, 60 * ONE), RunHistory(DT, 60 * ONE)
    for step in range(50):
        small.append(moment(step))
        large.append(moment(step, n=100))
    assert len(small) == 50
    assert len(large) < 30


@pytest.mark.parametrize(
    "memory",
    [
        np.zeros(5000),
        {"map": np.zeros(5000)},
        [(np.zeros(2500), np.zeros(2500))],
        RobotProperties(np.zeros(5000)),
    ],
)
def test_what_controllers_remember_counts(memory):
    history = RunHistory(DT, 60 * ONE)
    for step in range(50):
        history.append(moment(step, memory=memory))
    assert len(history) < 30


def test_what_refers_to_itself_is_counted_once_or_so():
    memory = {"word": "x" * 100, "number": 3, "nothing": None}
    memory["itself"] = memory
    history = RunHistory(DT)
    history.append(moment(0, memory=memory))
    assert len(history) == 1


def test_the_last_moment_not_after_a_time():
    history = filled(2000, 100 * ONE)
    steps = np.array(history.steps)
    for step in (0, 1, 2, 3, 500, 777, 1555, 1990, 1999):
        assert history.steps[history.find_index(step * DT)] == steps[steps <= step].max()
        # times come from other sums, too
        assert history.find_index(step * DT - 1e-12) == history.find_index(step * DT)
    assert history.find_index(-3.0) == 0
    assert history.find_index(1e9) == len(history) - 1


def test_the_newest_is_replaced_when_something_was_touched():
    history = filled(4)
    touched = setup()
    history.amend(moment(3, touched))
    assert history.steps == [0, 1, 2, 3]
    assert history.last.states[0].setup is touched
    history.amend(moment(4, touched))
    assert history.steps == [0, 1, 2, 3, 4]
    only = filled(1)
    only.amend(moment(0, touched))
    assert only.steps == [0]
    assert only.last.states[0].setup is touched


@given(st.integers(1, 400), st.integers(0, 400))
@settings(max_examples=100)
def test_what_is_left_out_takes_no_room(steps, k):
    history = filled(steps, 60 * ONE)
    k = min(k, len(history) - 1)
    twin, before = history.copy_until(k), history.steps[:]
    assert history.steps == before
    assert twin.steps == before[: k + 1]
    assert twin._bytes == taken(twin)
    for step in range(twin.last.step + 1, twin.last.step + 200):
        twin.append(moment(step))
    assert taken(twin) <= 60 * ONE


def test_a_history_of_its_own_leaves_the_other_as_it_is():
    history = filled(10)
    twin = history.copy_until(4)
    twin.append(moment(5, setup()))
    assert len(history) == 10
    assert history[5] is not twin[5]
    assert twin.dt == history.dt


def test_failed_robots_are_solid():
    there = setup({2: (1.0, 1.0), 5: (2.0, 3.0)})
    assert setup().sensed_environment is HALL
    assert there.sensed_environment.obstacles[: len(HALL.obstacles)] == HALL.obstacles
    assert there.sensed_environment.obstacles[len(HALL.obstacles) :] == (
        CircleObstacle((1.0, 1.0), 0.1),
        CircleObstacle((2.0, 3.0), 0.1),
    )
    # what is derived from it is so once
    assert there.sensed_environment is there.sensed_environment
