"""The displayed state of a session, now and in the past."""

from __future__ import annotations

import numpy as np
import pytest
from sample_sessions import LLOYD, RAPF, advance_session, get_positions, start_session


def test_states_of_the_past_are_displayed_as_they_were():
    session = start_session(RAPF, LLOYD)
    positions_by_step = [get_positions(session)]
    for _ in range(40):
        session.playback.step()
        positions_by_step.append(get_positions(session))
    displayed = session.displayed
    for step in (3, 0, 39, 17):
        session.show_time(step / 60)
        assert not session.timeline.is_live
        assert displayed.time == pytest.approx(step / 60)
        assert session.timeline.end_time == pytest.approx(40 / 60)
        for pane, expected in zip(session.timeline.panes, positions_by_step[step], strict=True):
            np.testing.assert_array_equal(displayed.get_positions(pane), expected)
            assert displayed.get_snapshot(pane).time == pytest.approx(step / 60)
            trail, times = displayed.get_trail(pane)
            assert times[-1] <= displayed.time + 1e-9
            np.testing.assert_array_equal(trail[0], positions_by_step[0][pane.number])


@pytest.mark.parametrize("time", [40 / 60, 99.0])
def test_the_present_is_displayed_at_its_time_and_later(time):
    session = advance_session(start_session(), 40)
    session.show_time(0.1)
    session.show_time(time)
    assert session.timeline.is_live


def test_neighboring_states_are_displayed():
    session = advance_session(start_session(), 10)
    session.show_offset(-3)
    assert session.displayed.time == pytest.approx(7 / 60)
    session.show_offset(1)
    session.show_offset(1)
    assert session.displayed.time == pytest.approx(9 / 60)
    session.show_offset(1)
    assert session.timeline.is_live
    session.show_offset(5)
    assert session.timeline.is_live
    session.show_offset(-99)
    assert session.displayed.time == 0.0


def test_recent_positions_of_a_robot():
    session = advance_session(start_session(), 300)
    pane = session.timeline.panes[0]
    history = session.timeline.history
    positions = session.displayed.get_recent_positions(pane, 2)
    assert 20 <= len(positions) <= 62
    np.testing.assert_array_equal(positions[0], history[60].states[0].positions[1])
    assert np.abs(positions[-1] - session.displayed.get_positions(pane)[1]).max() < 0.5
    session.show_time(1.0)
    positions = session.displayed.get_recent_positions(pane, 2)
    np.testing.assert_array_equal(positions[0], history[0].states[0].positions[1])
    assert session.displayed.get_recent_positions(pane, 99).shape == (0, 2)


def test_trails_of_failed_robots_end_where_they_failed():
    session = advance_session(start_session(), 30)
    session.fail_robot(2)
    advance_session(session, 30)
    pane = session.timeline.panes[0]
    positions, times = session.displayed.get_trail(pane)
    assert positions.shape[1] == 3, "the failed robot is the last one"
    assert np.isfinite(positions[times < 0.49, 2]).all()
    assert np.isnan(positions[times > 0.49, 2]).all()
    session.show_time(0.25)
    positions, times = session.displayed.get_trail(pane)
    assert positions.shape[1] == 3
    assert times[-1] <= 0.25 + 1e-9
    assert np.isfinite(positions).all()
    repeated_positions, _ = session.displayed.get_trail(pane)
    assert np.shares_memory(repeated_positions, positions), "a trail is rebuilt once"


def test_costs_are_compared_at_a_time_that_all_curves_contain():
    session = start_session(RAPF, LLOYD)
    first, second = session.timeline.panes
    for step in range(31):
        first.distance_curve.add(step / 60, 3.0 - step / 60)
    second.distance_curve.add(0.0, 3.0)
    second.distance_curve.add(0.25, 1.0)
    advance_session(session, 60)
    time, costs = session.displayed.get_costs()
    assert time == pytest.approx(0.25)
    assert costs == {0: pytest.approx(2.75), 1: pytest.approx(1.0)}
    assert session.displayed.get_costs("time") == (session.displayed.time, {})
