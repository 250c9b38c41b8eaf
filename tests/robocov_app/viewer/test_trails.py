"""Trails of the robots: bounded, with at most thirty rows a second, and rebuilt from recorded states."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples
from sample_sessions import LLOYD, RAPF, advance_session, start_session

from robocov_app.viewer.session.past import history as history_module
from robocov_app.viewer.session.past import trails as module
from robocov_app.viewer.session.past.history import RunHistory
from robocov_app.viewer.session.past.trails import MAX_TRAIL_RATE_HZ, MAX_TRAIL_ROWS, Trail, rebuild_trail

DT = 1 / 60
ROW_INTERVAL_S = 1 / MAX_TRAIL_RATE_HZ


def build_trail(rows: int, interval: float = ROW_INTERVAL_S, robots: int = 1) -> Trail:
    """Build a trail in which the coordinates are the number of the row."""
    trail = Trail(range(1, robots + 1))
    for row in range(rows):
        trail.add(row * interval, np.full((robots, 2), float(row)))
    return trail


def test_rows_are_returned_in_order():
    trail = build_trail(3, robots=2)
    assert len(trail) == 3
    assert trail.positions.shape == (3, 2, 2)
    assert trail.positions[:, 1, 0].tolist() == [0.0, 1.0, 2.0]
    assert trail.times == pytest.approx([0, 1 / 30, 2 / 30])
    assert len(Trail(range(4))) == 0
    assert Trail(range(4)).positions.shape == (0, 4, 2)


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
    assert trail.get_starts(ROW_INTERVAL_S, [1]).tolist() == [[0.0, 0.0]]


def test_a_row_that_replaces_the_first_one_replaces_the_start():
    trail = build_trail(1)
    trail.add(0.0, np.array([[5.0, 6.0]]), always=True)
    assert trail.get_starts(0.0, [1]).tolist() == [[5.0, 6.0]]


@given(st.lists(st.tuples(st.floats(0.0, 0.2), st.booleans()), max_size=300), st.integers(8, 64))
@settings(max_examples=count_examples(150))
def test_times_ascend_and_rows_are_bounded(additions, max_rows):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "MAX_TRAIL_ROWS", max_rows // 2 * 2)
        trail = Trail([1])
        time = 0.0
        for elapsed, always in additions:
            time += elapsed
            trail.add(time, np.full((1, 2), time), always=always)
            assert trail.times[-1] == pytest.approx(time, abs=ROW_INTERVAL_S)
        assert len(trail) <= max_rows
        assert (np.diff(trail.times) > 0).all()
        # Positions stay with their times.
        assert trail.positions[:, 0, 0].tolist() == trail.times.tolist()


def test_rows_that_matter_least_to_the_shape_are_removed():
    """The corners of an early detour stay, although the robot moves straight on for long."""
    corners = [(0.0, 0.0), (3.0, 0.0), (3.0, 2.0), (1.0, 2.0)]
    trail = Trail([1])
    for row in range(6 * MAX_TRAIL_ROWS):
        if row < 80:
            position = np.array(corners[row // 20])
        else:
            position = np.array([5.0 + 1e-3 * row, 4.0])
        trail.add(row * ROW_INTERVAL_S, position[None])
    assert len(trail) <= MAX_TRAIL_ROWS
    rows = list(map(tuple, trail.positions[:, 0].tolist()))
    assert set(corners) <= set(rows)
    assert rows[0] == (0.0, 0.0)
    assert trail.times[-1] == pytest.approx((6 * MAX_TRAIL_ROWS - 1) * ROW_INTERVAL_S)


def test_a_circle_stays_round_however_long_ago():
    trail = Trail([1, 2])
    for row in range(4 * MAX_TRAIL_ROWS):
        angle = min(row, 300) * 2 * np.pi / 300
        circle = (np.cos(angle), np.sin(angle))
        trail.add(row * ROW_INTERVAL_S, np.array([circle, (5.0 + 1e-3 * row, 0.0)]))
    on_circle = trail.positions[trail.times <= 10.0, 0]
    middles = 0.5 * (on_circle[1:] + on_circle[:-1])
    assert np.linalg.norm(middles, axis=1).min() > 0.99


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
        trail = rebuild_trail(session.timeline.history, pane.number)
        np.testing.assert_array_equal(trail.positions, pane.trail.positions)
        assert trail.times == pytest.approx(pane.trail.times)
        np.testing.assert_array_equal(trail.get_starts(1.0, pane.numbers), pane.starts)


def test_a_robot_that_is_placed_before_the_first_step_starts_there():
    session = start_session(robots=3)
    session.place_robot(1, (3.5, 3.0))
    advance_session(session, 30)
    pane = session.timeline.panes[0]
    rebuilt = rebuild_trail(session.timeline.history, pane.number)
    for starts in (pane.starts, rebuilt.get_starts(pane.time, pane.numbers)):
        assert starts[0].tolist() == [3.5, 3.0]
        np.testing.assert_array_equal(starts, pane.trail.positions[0])


def test_a_robot_that_is_placed_in_the_step_in_which_it_joins_starts_there():
    session = advance_session(start_session(robots=2), 10)
    number = session.add_robot((3.5, 3.0))
    session.place_robot(number, (1.0, 3.0))
    advance_session(session, 10)
    pane = session.timeline.panes[0]
    starts = dict(zip(pane.numbers, pane.starts.tolist(), strict=True))
    assert starts[number] == [1.0, 3.0]
    assert starts[1] == pane.trail.positions[0, 0].tolist()


def test_robots_have_no_positions_before_they_join_and_after_they_fail():
    session = advance_session(start_session(robots=2), 10)
    number = session.add_robot((3.5, 3.0))
    advance_session(session, 10)
    session.fail_robot(1)
    advance_session(session, 10)
    assert session.displayed.numbers == (2, number)
    pane = session.timeline.panes[0]
    rebuilt = rebuild_trail(session.timeline.history, 0)
    for trail in (pane.trail, rebuilt):
        assert trail.numbers == (2, number, 1)
        assert np.isfinite(trail.positions[:, 0]).all()
        assert np.isnan(trail.positions[trail.times < 9.5 / 60, 1]).all()
        assert np.isfinite(trail.positions[trail.times > 9.5 / 60, 1]).all()
        assert np.isfinite(trail.positions[trail.times < 19.5 / 60, 2]).all()
        assert np.isnan(trail.positions[trail.times > 19.5 / 60, 2]).all()
        assert trail.get_starts(0.5, [number]).tolist() == [[3.5, 3.0]]


def test_a_robot_that_works_again_keeps_its_start_and_its_trajectory():
    session = advance_session(start_session(robots=2), 10)
    start = session.timeline.panes[0].starts[0].tolist()
    session.fail_robot(1)
    advance_session(session, 10)
    session.revive_robot(1)
    advance_session(session, 10)
    pane = session.timeline.panes[0]
    assert pane.numbers == pane.trail.numbers == (1, 2)
    assert pane.starts[0].tolist() == pane.trail.positions[0, 0].tolist() == start


def test_an_earlier_trail_is_of_the_robots_that_worked_then():
    session = advance_session(start_session(robots=2), 10)
    before = session.timeline.panes[0].trail.positions.copy()
    session.add_robot((3.5, 3.0))
    session.remove_robot(1)
    advance_session(session, 10)
    pane = session.timeline.panes[0]
    assert pane.trail.numbers == (2, 3)
    session.show_time(8 / 60)
    positions, _ = session.displayed.get_trail(pane)
    np.testing.assert_array_equal(positions, before[:5])
    np.testing.assert_array_equal(pane.trail.get_starts(8 / 60, (1, 2)), before[0])


@pytest.fixture
def small_history(monkeypatch):
    """Recorded states are thinned early, as those of a long session are."""
    monkeypatch.setattr(history_module, "MIN_STATES", 20)
    monkeypatch.setattr(RunHistory.__init__, "__defaults__", (40_000,))


def test_starts_and_trails_are_exact_after_undo(small_history):
    session = advance_session(start_session(robots=3), 300)
    timeline = session.timeline
    assert timeline.history.thinned > 100
    pane = timeline.panes[0]
    expected = pane.trail.positions.copy(), pane.trail.times.copy(), pane.starts.copy()
    session.remove_robot(2)
    advance_session(session, 120)
    session.undo()
    timeline.finish_seek()
    pane = timeline.panes[0]
    np.testing.assert_array_equal(pane.trail.positions, expected[0])
    np.testing.assert_array_equal(pane.trail.times, expected[1])
    np.testing.assert_array_equal(pane.starts, expected[2])


def test_the_trail_of_another_branch_is_exact(small_history):
    session = advance_session(start_session(robots=3), 100)
    timeline = session.timeline
    session.fail_robot(3)
    advance_session(session, 200)
    pane = timeline.panes[0]
    expected = pane.trail.positions.copy(), pane.trail.times.copy(), pane.starts.copy()
    session.undo()
    session.add_robot((1.0, 3.0))
    advance_session(session, 200)
    session.undo()
    session.seek(timeline.document.nodes[1])
    timeline.finish_seek()
    pane = timeline.panes[0]
    np.testing.assert_array_equal(pane.trail.positions, expected[0])
    np.testing.assert_array_equal(pane.trail.times, expected[1])
    np.testing.assert_array_equal(pane.starts, expected[2])


@pytest.mark.parametrize("steps", range(1, 7))
def test_a_robot_that_joined_between_two_rows_has_a_row_of_that_time(steps):
    session = advance_session(start_session(robots=1), 3)
    session.add_robot((3.5, 3.0))
    advance_session(session, steps)
    trail = session.timeline.panes[0].trail
    has_joined = np.isfinite(trail.positions[:, 1, 0])
    assert trail.positions[has_joined, 1][0].tolist() == [3.5, 3.0]
    assert trail.times[has_joined][0] == pytest.approx(3 * DT)
