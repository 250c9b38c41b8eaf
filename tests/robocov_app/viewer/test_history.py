"""The recorded past of a run: bounded memory, thinned with age, and what is kept."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples
from sample_sessions import HALL, RAPF

from robocov.environment import CircleObstacle
from robocov_app.viewer.session.past import history as module
from robocov_app.viewer.session.past.history import RunHistory
from robocov_app.viewer.session.past.states import PaneSetup, PaneState, RunState
from robocov_app.viewer.session.setup.robot_properties import RobotProperties

DT = 1 / 60
MIN_STATES = 24
PANE_BYTES = 700
ROBOT_BYTES = 2 * 16
MIN_THINNED_EDITS = 8
"""With fewer edits, the states right after all of them are kept."""
STATE_BYTES = PANE_BYTES + ROBOT_BYTES
"""Size of a state with one pane and one robot."""


@pytest.fixture(autouse=True)
def keep_few_states(monkeypatch):
    monkeypatch.setattr(module, "MIN_STATES", MIN_STATES)


def build_setup(failed=None) -> PaneSetup:
    return PaneSetup(HALL, RAPF, RobotProperties(), (1,), failed or {})


SETUP = build_setup()


def build_state(step, setup=SETUP, robots=1, memory=None) -> RunState:
    positions = np.full((robots, 2), float(step))
    pane_state = PaneState(setup, positions, np.zeros((robots, 2)), memory)
    return RunState(step, {0: pane_state}, None)


def build_history(steps, max_bytes=60 * STATE_BYTES, get_setup=lambda step: SETUP) -> RunHistory:
    history = RunHistory(DT, max_bytes)
    for step in range(steps):
        history.append(build_state(step, get_setup(step)))
    return history


def compute_bytes(history) -> int:
    total = 0
    for state in history.states:
        total += PANE_BYTES * len(state.states)
        total += ROBOT_BYTES * len(state.states[0].positions)
    return total


def are_powers_of_two(numbers) -> bool:
    return all(number & (number - 1) == 0 for number in numbers)


def test_states_are_returned_in_order():
    history = build_history(5)
    assert len(history) == 5
    assert history.steps == [0, 1, 2, 3, 4]
    assert history[3].step == 3
    assert history.last.step == 4
    assert history.get_time(3) == 3 * DT
    assert history.thinned == 0


@given(st.integers(0, 900), st.integers(30, 120))
@settings(max_examples=count_examples(200))
def test_the_past_is_bounded_and_becomes_coarser_with_age(steps, max_states):
    history = build_history(steps + 1, max_states * STATE_BYTES)
    assert len(history) <= max_states
    assert compute_bytes(history) <= max_states * STATE_BYTES
    assert len(history) + history.thinned == steps + 1
    gaps = np.diff(history.steps)
    assert (gaps > 0).all()
    assert are_powers_of_two(gaps.tolist())
    assert (np.diff(gaps) <= gaps[:-1]).all()
    assert history.steps[0] == 0
    assert history.last.step == steps
    newest = min(steps, max_states // 16)
    assert history.steps[-1 - newest :] == list(range(steps - newest, steps + 1))


@st.composite
def edited_runs(draw):
    """Draw runs with edits, some of which change the number of robots."""
    kinds = st.sampled_from(["step"] * 6 + ["edit", "robots"])
    return draw(st.lists(st.tuples(kinds, st.integers(1, 40)), max_size=40))


def assert_lookups_are_right(history, end_time):
    """Check that a lookup of a time returns the last state that is not later."""
    between_steps = 0.37 * end_time
    for time in (-1.0, 0.0, between_steps, end_time, 1e9):
        index = history.find_index(time)
        assert index == 0 or history.get_time(index) <= time + 1e-6
        assert index == len(history) - 1 or history.get_time(index + 1) > time


@given(edited_runs())
@settings(max_examples=count_examples(200))
def test_an_edited_history_is_ordered_bounded_and_searchable(run):
    max_bytes = 80 * STATE_BYTES
    history = RunHistory(DT, max_bytes)
    step = 0
    setup = SETUP
    robots = 1
    edited_steps = set()
    history.append(build_state(0))
    for kind, number in run:
        if kind == "robots":
            robots = number
        if kind in ("edit", "robots"):
            setup = build_setup()
            history.amend(build_state(step, setup, robots))
            edited_steps.add(step)
        for _ in range(number if kind == "step" else 1):
            step += 1
            history.append(build_state(step, setup, robots))
        assert history.last.step == step
        assert len(history.last.states[0].positions) == robots
        assert (np.diff(history.steps) > 0).all()
        assert compute_bytes(history) <= max_bytes or len(history) <= MIN_STATES
        assert history.steps[0] == 0
        assert_lookups_are_right(history, step * DT)
    if len(edited_steps) < MIN_THINNED_EDITS:
        assert edited_steps <= set(history.steps)


def test_states_right_after_edits_are_kept():
    setups = {101: build_setup(), 203: build_setup(), 747: build_setup()}

    def get_setup(step):
        first_step = max((first for first in setups if first <= step), default=101)
        return setups[first_step]

    history = build_history(2000, 100 * STATE_BYTES, get_setup)
    assert {203, 747} <= set(history.steps)
    assert len(history) <= 100


def test_a_run_that_is_edited_at_each_step_is_thinned_as_well():
    history = build_history(1500, 100 * STATE_BYTES, lambda step: build_setup())
    assert len(history) <= 100
    assert compute_bytes(history) <= 100 * STATE_BYTES
    assert history.steps[0] == 0
    assert history.last.step == 1499


def test_a_minimum_of_states_is_kept_regardless_of_their_size():
    history = RunHistory(DT, 1000)
    for step in range(100):
        history.append(build_state(step, robots=50))
        assert len(history) <= MIN_STATES
    assert len(history) >= MIN_STATES // 2
    assert history.steps[0] == 0


def test_a_larger_team_needs_more_memory():
    small_team = RunHistory(DT, 60 * STATE_BYTES)
    large_team = RunHistory(DT, 60 * STATE_BYTES)
    for step in range(50):
        small_team.append(build_state(step))
        large_team.append(build_state(step, robots=100))
    assert len(small_team) == 50
    assert len(large_team) < 30


@pytest.mark.parametrize(
    "memory",
    [
        np.zeros(5000),
        {"map": np.zeros(5000)},
        [(np.zeros(2500), np.zeros(2500))],
        RobotProperties(np.zeros(5000)),
    ],
)
def test_the_memory_of_controllers_counts(memory):
    history = RunHistory(DT, 60 * STATE_BYTES)
    for step in range(50):
        history.append(build_state(step, memory=memory))
    assert len(history) < 30


def test_a_memory_that_refers_to_itself_is_measured():
    memory = {"word": "x" * 100, "number": 3, "nothing": None}
    memory["itself"] = memory
    history = RunHistory(DT)
    history.append(build_state(0, memory=memory))
    assert len(history) == 1


def test_the_last_state_at_or_before_a_time_is_found():
    history = build_history(2000, 100 * STATE_BYTES)
    steps = np.array(history.steps)
    for step in (0, 1, 2, 3, 500, 777, 1555, 1990, 1999):
        assert history.steps[history.find_index(step * DT)] == steps[steps <= step].max()
        # Times may be sums that are rounded differently.
        assert history.find_index(step * DT - 1e-12) == history.find_index(step * DT)
    assert history.find_index(-3.0) == 0
    assert history.find_index(1e9) == len(history) - 1


def test_the_newest_state_is_replaced_after_an_edit():
    history = build_history(4)
    edited = build_setup()
    history.amend(build_state(3, edited))
    assert history.steps == [0, 1, 2, 3]
    assert history.last.states[0].setup is edited
    history.amend(build_state(4, edited))
    assert history.steps == [0, 1, 2, 3, 4]
    single = build_history(1)
    single.amend(build_state(0, edited))
    assert single.steps == [0]
    assert single.last.states[0].setup is edited


@given(st.integers(1, 400), st.integers(0, 400))
@settings(max_examples=count_examples(100))
def test_a_copy_has_the_size_of_its_own_states(steps, index):
    history = build_history(steps, 60 * STATE_BYTES)
    index = min(index, len(history) - 1)
    steps_before = history.steps[:]
    duplicate = history.copy_until(index)
    assert history.steps == steps_before
    assert duplicate.steps == steps_before[: index + 1]
    assert duplicate._bytes == compute_bytes(duplicate)
    for step in range(duplicate.last.step + 1, duplicate.last.step + 200):
        duplicate.append(build_state(step))
    assert compute_bytes(duplicate) <= 60 * STATE_BYTES


def test_a_copy_leaves_the_original_as_it_is():
    history = build_history(10)
    duplicate = history.copy_until(4)
    duplicate.append(build_state(5, build_setup()))
    assert len(history) == 10
    assert history[5] is not duplicate[5]
    assert duplicate.dt == history.dt


def test_failed_robots_are_sensed_as_obstacles():
    setup = build_setup({2: (1.0, 1.0), 5: (2.0, 3.0)})
    assert build_setup().sensed_environment is HALL
    obstacles = setup.sensed_environment.obstacles
    assert obstacles[: len(HALL.obstacles)] == HALL.obstacles
    assert obstacles[len(HALL.obstacles) :] == (
        CircleObstacle((1.0, 1.0), 0.1),
        CircleObstacle((2.0, 3.0), 0.1),
    )
    assert setup.sensed_environment is setup.sensed_environment, "the map is built once"
