from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sample_sessions import LLOYD, RAPF, advance_session, start_session

from robocov_app.viewer.session import trails as module
from robocov_app.viewer.session.trails import MAX_TRAIL_RATE_HZ, MAX_TRAIL_ROWS, Trail, rebuild_trail

STEP = 1 / 60


def walked(rows: int, step: float = 1 / MAX_TRAIL_RATE_HZ, n: int = 1) -> Trail:
    trail = Trail(n)
    for k in range(rows):
        trail.add(k * step, np.full((n, 2), float(k)))
    return trail


def test_rows_come_back_in_their_order():
    trail = walked(3, n=2)
    assert len(trail) == 3
    assert trail.positions.shape == (3, 2, 2)
    assert trail.positions[:, 1, 0].tolist() == [0.0, 1.0, 2.0]
    assert trail.times == pytest.approx([0, 1 / 30, 2 / 30])
    assert len(Trail(4)) == 0
    assert Trail(4).positions.shape == (0, 4, 2)


def test_at_most_thirty_rows_a_second():
    trail = walked(121, STEP)
    assert len(trail) == 61
    assert np.diff(trail.times) == pytest.approx(1 / MAX_TRAIL_RATE_HZ)
    slow = walked(10, 0.25)
    assert len(slow) == 10


def test_what_must_not_be_missed_is_always_taken():
    trail = walked(2)
    trail.add(1 / MAX_TRAIL_RATE_HZ + STEP, np.array([[7.0, 7.0]]), always=True)
    assert trail.positions[:, 0, 0].tolist() == [0.0, 1.0, 7.0]


def test_one_row_for_one_time():
    """A robot that is dragged while the run is paused leaves no row for each move of the mouse."""
    trail = walked(2)
    for k in range(100):
        trail.add(1 / MAX_TRAIL_RATE_HZ, np.full((1, 2), 100.0 + k), always=True)
    assert trail.positions[:, 0, 0].tolist() == [0.0, 199.0]


@given(st.lists(st.tuples(st.floats(0.0, 0.2), st.booleans()), max_size=300), st.integers(8, 64))
@settings(max_examples=150)
def test_whatever_is_added_it_ascends_and_is_bounded(steps, most):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "MAX_TRAIL_ROWS", most // 2 * 2)
        trail, time = Trail(1), 0.0
        for step, always in steps:
            time += step
            trail.add(time, np.full((1, 2), time), always=always)
            assert trail.times[-1] == pytest.approx(time, abs=1 / MAX_TRAIL_RATE_HZ)
        assert len(trail) <= most
        assert (np.diff(trail.times) > 0).all()
        # a row stays with its time
        assert trail.positions[:, 0, 0].tolist() == trail.times.tolist()


def test_of_the_older_half_every_second_row_goes():
    trail = walked(MAX_TRAIL_ROWS + 1)
    kept = trail.positions[:, 0, 0]
    half = MAX_TRAIL_ROWS // 2
    assert len(kept) == half // 2 + half + 1
    assert kept[:3].tolist() == [0.0, 2.0, 4.0]
    assert kept[-half - 1 :].tolist() == list(range(half, MAX_TRAIL_ROWS + 1))
    long = walked(6 * MAX_TRAIL_ROWS)
    assert len(long) <= MAX_TRAIL_ROWS
    assert long.positions[0, 0, 0] == 0.0
    assert long.positions[-1, 0, 0] == 6 * MAX_TRAIL_ROWS - 1


def test_until_a_time():
    trail = walked(10)
    for time, count in (
        (-1.0, 0),
        (0.0, 1),
        (3 / MAX_TRAIL_RATE_HZ, 4),
        (3 / MAX_TRAIL_RATE_HZ + 0.01, 4),
        (99.0, 10),
    ):
        positions, times = trail.get_until(time)
        assert len(positions) == len(times) == count


def test_a_trail_of_moments():
    trail = Trail(1)
    for k in range(7):
        trail.add(k * STEP, np.full((1, 2), float(k)))
    assert trail.positions[:, 0, 0].tolist() == [0.0, 2.0, 4.0, 6.0]


def test_the_trail_of_a_past_is_that_which_was_left():
    session = advance_session(start_session(RAPF, LLOYD), 60)
    for pane in session.timeline.panes:
        told, starts = rebuild_trail(session.timeline.history, pane.number, 60)
        np.testing.assert_array_equal(told.positions, pane.trail.positions)
        assert told.times == pytest.approx(pane.trail.times)
        np.testing.assert_array_equal(starts, pane.starts)


def test_robots_that_came_later_were_nowhere_before():
    session = advance_session(start_session(robots=2), 10)
    place = session.add_robot((3.5, 3.0))
    advance_session(session, 10)
    session.fail_robot(1)
    advance_session(session, 10)
    assert session.displayed.numbers == (2, place)
    told, starts = rebuild_trail(session.timeline.history, 0, 30)
    assert told.positions.shape[1] == 2
    assert np.isfinite(told.positions[:, 0]).all()
    assert np.isnan(told.positions[told.times < 9.5 / 60, 1]).all()
    assert np.isfinite(told.positions[told.times > 9.5 / 60, 1]).all()
    assert starts[1].tolist() == [3.5, 3.0]
    # of those that worked then
    earlier, starts = rebuild_trail(session.timeline.history, 0, 5)
    assert np.isfinite(earlier.positions).all()
    np.testing.assert_array_equal(starts, session.timeline.history[0].states[0].positions)


@pytest.mark.parametrize("steps", range(1, 7))
def test_who_came_in_between_two_rows_is_in_the_last_one(steps):
    session = advance_session(start_session(robots=1), 3)
    session.add_robot((3.5, 3.0))
    advance_session(session, steps)
    for last in range(3, 3 + steps + 1):
        told, _ = rebuild_trail(session.timeline.history, 0, last)
        np.testing.assert_array_equal(told.positions[-1], session.timeline.history[last].states[0].positions)
        assert told.times[-1] == pytest.approx(last * STEP)
        assert told.positions[np.isfinite(told.positions[:, 1, 0]), 1][0].tolist() == [3.5, 3.0]
