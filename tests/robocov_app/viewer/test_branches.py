"""The timeline: what is tried from a moment of the past, and what it remembers having happened."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from sample_sessions import (
    HALL,
    LLOYD,
    RAPF,
    RPF,
    advance_session,
    advance_with_costs,
    describe_state,
    get_positions,
    start_session,
)

from robocov.environment import CircleObstacle
from robocov.errors import StartError
from robocov_app.viewer.session import lockstep as module
from robocov_app.viewer.session.robot_properties import RobotProperties

# branches


@pytest.mark.parametrize("laws", [(RAPF,), (RPF, LLOYD)])
def test_a_branch_that_nobody_touches_goes_the_same_way(laws):
    session = advance_session(start_session(*laws, robots=4), 100)
    end = get_positions(session)
    session.show_time(0.5)
    assert session.branch()
    assert session.timeline.is_live
    assert session.timeline.end_time == pytest.approx(0.5)
    assert session.timeline.history.steps[-1] == 30
    advance_session(session, 70)
    for now, before in zip(get_positions(session), end, strict=True):
        # bit for bit
        np.testing.assert_array_equal(now, before)


def test_so_it_does_from_a_thinned_past_after_touches(short):
    session = advance_session(start_session(RAPF, LLOYD, robots=4), 100)
    session.edit_map(
        replace(HALL, obstacles=(*HALL.obstacles, CircleObstacle((3.2, 2.2), 0.3))), "circle drawn"
    )
    session.fail_robot(3)
    advance_session(session, 400)
    end = get_positions(session)
    assert session.timeline.history.thinned > 0
    session.show_time(2.5)
    assert session.branch()
    while session.timeline.end_time < 500 / 60 - 1e-9:
        session.playback.step()
    for now, before in zip(get_positions(session), end, strict=True):
        np.testing.assert_array_equal(now, before)


def test_a_branch_leaves_a_ghost():
    session = start_session(RAPF, LLOYD)
    advance_with_costs(session, 60)
    serial = session.timeline.past_version
    session.show_time(0.5)
    assert session.branch()
    assert session.timeline.past_version == serial + 1
    assert [ghost.controller for ghost in session.timeline.ghosts] == ["rapf", "lloyd"]
    assert [ghost.description for ghost in session.timeline.ghosts] == ["RAPF", "Lloyd"]
    for ghost in session.timeline.ghosts:
        assert ghost.times[0] == pytest.approx(0.5)
        assert ghost.times[-1] == pytest.approx(59 / 60)
    for pane in session.timeline.panes:
        assert pane.distance_curve.last_time == pytest.approx(0.5)
        assert pane.time == pytest.approx(0.5)
        assert pane.trail.times[-1] == pytest.approx(0.5)
    assert [
        pane.distance_curve.interpolate(session.displayed.time) for pane in session.timeline.panes
    ] == pytest.approx([2.5, 2.5])


def test_the_present_is_no_branch():
    session = advance_session(start_session(), 10)
    before = describe_state(session)
    assert not session.branch()
    session.show_time(99.0)
    assert not session.branch()
    assert describe_state(session) == before


def test_a_branch_takes_back_what_was_chosen_later():
    session = advance_session(start_session(RAPF, RPF), 20)
    session.set_controller(session.timeline.panes[0], LLOYD)
    session.set_properties(RobotProperties(max_speed=0.5))
    session.edit_map(replace(HALL, obstacles=()), "emptied")
    session.add_robot((1.0, 3.0))
    advance_session(session, 20)
    session.show_time(10 / 60)
    assert session.displayed.environment is HALL
    assert session.displayed.numbers == (1, 2, 3)
    session.branch()
    assert [pane.controller for pane in session.timeline.panes] == [RAPF, RPF]
    assert session.timeline.scenario.controllers == (RAPF, RPF)
    assert session.timeline.scenario.properties == RobotProperties()
    assert session.timeline.scenario.environment is HALL
    assert session.timeline.panes[0].starts.shape == (3, 2)
    assert list(session.timeline.events) == []
    assert session.timeline.head.parent is None
    advance_session(session, 5)


def test_events_up_to_the_branch_stay():
    session = advance_session(start_session(), 10)
    session.fail_robot(2)
    advance_session(session, 10)
    session.fail_robot(3)
    advance_session(session, 10)
    session.show_time(10 / 60)
    session.branch()
    assert [event.text for event in session.timeline.events] == ["robot 2 failed"]
    assert session.displayed.numbers == (1, 3)


def test_a_branch_that_cannot_be_changes_nothing(monkeypatch):
    session = start_session(RAPF, RPF)
    advance_with_costs(session, 40)
    session.show_time(0.3)
    before = describe_state(session)

    def no_room(moment):
        raise StartError("no room")

    monkeypatch.setattr(module.Lockstep, "resume", no_room)
    for touch in (
        session.branch,
        lambda: session.set_controller(session.timeline.panes[0], LLOYD),
        lambda: session.fail_robot(1),
    ):
        with pytest.raises(StartError, match="no room"):
            touch()
        assert describe_state(session) == before


# events


def test_a_slider_that_is_dragged_is_one_event():
    session = advance_session(start_session(RAPF, RPF), 3)
    for k in range(1, 20):
        session.set_controller(session.timeline.panes[0], RAPF.with_gain("k_rep", k / 10))
        session.playback.step()
    for k in range(1, 20):
        session.set_controller(
            session.timeline.panes[0], session.timeline.panes[0].controller.with_gain("k_att", k / 10)
        )
        session.playback.step()
    for k in range(1, 20):
        session.set_properties(RobotProperties(max_speed=k / 10))
        session.playback.step()
    assert [event.text for event in session.timeline.events] == [
        "RAPF: k_rep = 1.9",
        "RAPF: k_att = 1.9",
        "limits changed",
    ]
    # later it is another one
    advance_session(session, 70)
    session.set_properties(RobotProperties(max_speed=3.0))
    session.set_controller(session.timeline.panes[0], LLOYD)
    session.set_controller(session.timeline.panes[1], LLOYD)
    assert [event.text for event in session.timeline.events][3:] == [
        "limits changed",
        *["Lloyd takes over"] * 2,
    ]
