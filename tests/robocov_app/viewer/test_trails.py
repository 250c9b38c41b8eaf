"""Trails of the robots: bounded, with at most thirty rows a second, and rebuilt from recorded states."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sample_sessions import LLOYD, RAPF, advance_session, start_session

from robocov_app.viewer.session.past import trails as module
from robocov_app.viewer.session.past.trails import MAX_TRAIL_RATE_HZ, MAX_TRAIL_ROWS, Trail, rebuild_trail

DT = 1 / 60
ROW_INTERVAL_S = 1 / MAX_TRAIL_RATE_HZ


def build_trail(rows: int, interval: float = ROW_INTERVAL_S, robots: int = 1) -> Trail:
    """Build a trail in which the coordinates are the number of the row."""
    trail = Trail(robots)
    for row in range(rows):
        trail.add(row * interval, np.full((robots, 2), float(row)))
    return trail


def test_rows_are_returned_in_order():
    trail = build_trail(3, robots=2)
    assert len(trail) == 3
    assert trail.positions.shape == (3, 2, 2)
    assert trail.positions[:, 1, 0].tolist() == [0.0, 1.0, 2.0]
    assert trail.times == pytest.approx([0, 1 / 30, 2 / 30])
    assert len(Trail(4)) == 0
    assert Trail(4).positions.shape == (0, 4, 2)


def test_there_are_at_most_thirty_rows_a_second():
    trail = build_trail(121, DT)
    assert len(trail) == 61
    assert np.diff(trail.times) == pytest.approx(ROW_INTERVAL_S)
    assert trail.positions[:4, 0, 0].tolist() == [0.0, 2.0, 4.0, 6.0]
    assert len(build_trail(10, 0.25)) == 10


def test_a_row_can_be_added_in_any_case():
    trail = build_trail(2)
    trail.add(ROW_INTERVAL_S + DT, np.array([[7.0, 7.0]]), always=True)
    assert trail.positions[:, 0, 0].tolist() == [0.0, 1.0, 7.0]


def test_a_row_replaces_one_of_the_same_time():
    """A robot that is dragged while the run is paused leaves no row for each move of the pointer."""
    trail = build_trail(2)
    for move in range(100):
        trail.add(ROW_INTERVAL_S, np.full((1, 2), 100.0 + move), always=True)
    assert trail.positions[:, 0, 0].tolist() == [0.0, 199.0]


@given(st.lists(st.tuples(st.floats(0.0, 0.2), st.booleans()), max_size=300), st.integers(8, 64))
@settings(max_examples=150)
def test_times_ascend_and_rows_are_bounded(additions, max_rows):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "MAX_TRAIL_ROWS", max_rows // 2 * 2)
        trail = Trail(1)
        time = 0.0
        for elapsed, always in additions:
            time += elapsed
            trail.add(time, np.full((1, 2), time), always=always)
            assert trail.times[-1] == pytest.approx(time, abs=ROW_INTERVAL_S)
        assert len(trail) <= max_rows
        assert (np.diff(trail.times) > 0).all()
        # Positions stay with their times.
        assert trail.positions[:, 0, 0].tolist() == trail.times.tolist()


def test_every_second_row_of_the_older_half_is_removed():
    rows = build_trail(MAX_TRAIL_ROWS + 1).positions[:, 0, 0]
    half = MAX_TRAIL_ROWS // 2
    assert len(rows) == half // 2 + half + 1
    assert rows[:3].tolist() == [0.0, 2.0, 4.0]
    assert rows[-half - 1 :].tolist() == list(range(half, MAX_TRAIL_ROWS + 1))
    long_trail = build_trail(6 * MAX_TRAIL_ROWS)
    assert len(long_trail) <= MAX_TRAIL_ROWS
    assert long_trail.positions[0, 0, 0] == 0.0
    assert long_trail.positions[-1, 0, 0] == 6 * MAX_TRAIL_ROWS - 1


@pytest.mark.parametrize(
    ("time", "count"),
    [(-1.0, 0), (0.0, 1), (3 * ROW_INTERVAL_S, 4), (3 * ROW_INTERVAL_S + 0.01, 4), (99.0, 10)],
)
def test_a_trail_is_returned_up_to_a_time(time, count):
    positions, times = build_trail(10).get_until(time)
    assert len(positions) == len(times) == count


def test_the_rebuilt_trail_is_that_of_the_run():
    session = advance_session(start_session(RAPF, LLOYD), 60)
    for pane in session.timeline.panes:
        trail, starts = rebuild_trail(session.timeline.history, pane.number, 60)
        np.testing.assert_array_equal(trail.positions, pane.trail.positions)
        assert trail.times == pytest.approx(pane.trail.times)
        np.testing.assert_array_equal(starts, pane.starts)


def test_robots_have_no_positions_before_they_join():
    session = advance_session(start_session(robots=2), 10)
    number = session.add_robot((3.5, 3.0))
    advance_session(session, 10)
    session.fail_robot(1)
    advance_session(session, 10)
    assert session.displayed.numbers == (2, number)
    trail, starts = rebuild_trail(session.timeline.history, 0, 30)
    assert trail.positions.shape[1] == 2
    assert np.isfinite(trail.positions[:, 0]).all()
    assert np.isnan(trail.positions[trail.times < 9.5 / 60, 1]).all()
    assert np.isfinite(trail.positions[trail.times > 9.5 / 60, 1]).all()
    assert starts[1].tolist() == [3.5, 3.0]


def test_an_earlier_trail_is_of_the_robots_that_worked_then():
    session = advance_session(start_session(robots=2), 10)
    session.add_robot((3.5, 3.0))
    advance_session(session, 10)
    trail, starts = rebuild_trail(session.timeline.history, 0, 5)
    assert trail.positions.shape[1] == 2
    assert np.isfinite(trail.positions).all()
    np.testing.assert_array_equal(starts, session.timeline.history[0].states[0].positions)


@pytest.mark.parametrize("steps", range(1, 7))
def test_a_robot_that_joined_between_two_rows_is_in_the_last_one(steps):
    session = advance_session(start_session(robots=1), 3)
    session.add_robot((3.5, 3.0))
    advance_session(session, steps)
    for last in range(3, 3 + steps + 1):
        trail, _ = rebuild_trail(session.timeline.history, 0, last)
        expected = session.timeline.history[last].states[0].positions
        np.testing.assert_array_equal(trail.positions[-1], expected)
        assert trail.times[-1] == pytest.approx(last * DT)
        has_joined = np.isfinite(trail.positions[:, 1, 0])
        assert trail.positions[has_joined, 1][0].tolist() == [3.5, 3.0]
