"""The session: panes that come and go, and a map that changes under the robots."""

from __future__ import annotations

import numpy as np
import pytest
from sample_sessions import (
    HALL,
    LLOYD,
    RAPF,
    RPF,
    add_pillar,
    advance_session,
    compute_penetration,
    describe_state,
    start_session,
)

from robocov.environment import CircleObstacle, PolygonObstacle
from robocov.errors import ParameterError, StartError
from robocov_app.viewer.session.map_edits import replace_obstacles
from robocov_app.viewer.session.robot_properties import RobotProperties
from robocov_app.viewer.session.scenario import MAX_PANES

# panes


def test_panes_come_and_go():
    session = advance_session(start_session(RAPF), 10)
    session.add_pane(LLOYD)
    assert [pane.controller for pane in session.timeline.panes] == [RAPF, LLOYD]
    assert session.displayed.time == 0.0
    advance_session(session, 10)
    session.remove_pane(session.timeline.panes[0])
    assert [pane.number for pane in session.timeline.panes] == [1]
    assert session.timeline.scenario.controllers == (LLOYD,)
    advance_session(session, 10)
    session.show_time(5 / 60)
    assert session.displayed.get_positions(session.timeline.panes[0]).shape == (3, 2)
    session.branch()
    advance_session(session, 20)
    assert session.timeline.panes[0].time == pytest.approx(session.timeline.end_time)


def test_there_are_neither_too_many_panes_nor_none():
    session = start_session(*[RAPF] * MAX_PANES)
    with pytest.raises(ParameterError, match="expected at most 4 controllers"):
        session.add_pane(RPF)
    session = start_session(RAPF)
    with pytest.raises(ParameterError, match="cannot remove the last pane"):
        session.remove_pane(session.timeline.panes[0])


# the map


def test_an_obstacle_is_drawn_and_pushes_robots():
    session = advance_session(start_session(RAPF, LLOYD, robots=4), 30)
    place = tuple(np.round(session.displayed.get_positions(session.timeline.panes[0])[1], 3).tolist())
    assert session.edit_map(add_pillar(pillar=CircleObstacle(place, 0.2)), "circle drawn") >= 1
    assert session.displayed.environment.obstacles[-1].center == place
    assert compute_penetration(session) <= 2e-3
    assert session.timeline.events[-1].text == "circle drawn"
    assert (
        session.edit_map(
            add_pillar(session.displayed.environment, CircleObstacle((5.8, 0.2), 0.1)), "another"
        )
        == 0
    )
    advance_session(session, 30)
    assert compute_penetration(session) <= 2e-3


def test_who_leans_on_a_wall_is_not_pushed():
    session = start_session(LLOYD, robots=1)
    session.playback.is_playing = True
    session.drag_robot(1, (0.0, 2.0))
    for _ in range(10):
        session.playback.advance(0.1)
    session.release()
    assert session.displayed.get_positions(session.timeline.panes[0])[0, 0] < 0.11
    assert session.edit_map(add_pillar(), "circle drawn") == 0


def test_edits_are_taken_back_and_done_again():
    session = advance_session(start_session(RAPF, LLOYD), 10)
    first = add_pillar()
    second = replace_obstacles(first, 0, 1)
    session.edit_map(first, "circle drawn")
    advance_session(session, 5)
    session.edit_map(second, "pillar deleted")
    assert session.undo() == "pillar deleted"
    assert session.displayed.environment == first
    assert session.undo() == "circle drawn"
    assert session.displayed.environment == HALL
    assert session.timeline.scenario.environment == HALL
    advance_session(session, 5)
    assert session.redo() == "circle drawn"
    assert session.redo() == "pillar deleted"
    assert session.displayed.environment == second
    assert [event.text for event in session.timeline.events] == ["circle drawn", "pillar deleted"]
    assert {event.kind for event in session.timeline.events} == {"obstacle"}
    assert {pane.setup.environment for pane in session.timeline.panes} == {session.displayed.environment}


def test_a_map_without_room_is_refused():
    """In the second pane, where the robots are elsewhere, or in both."""
    session = advance_session(start_session(RAPF, LLOYD, robots=5), 40)
    before = describe_state(session)
    block = PolygonObstacle(((0, 0.1), (6, 0.1), (6, 4), (0, 4)))
    with pytest.raises(StartError, match="fits nowhere"):
        session.edit_map(add_pillar(pillar=block), "filled")
    assert describe_state(session) == before


def test_if_one_pane_cannot_be_changed_none_is(monkeypatch):
    session = advance_session(start_session(RAPF, LLOYD), 21)
    before = describe_state(session)

    def no_room(wanted):
        raise StartError("no room")

    monkeypatch.setattr(session.timeline.panes[1], "build_changed_simulation", no_room)
    place = tuple(session.displayed.get_positions(session.timeline.panes[0])[0].tolist())
    for touch in (
        lambda: session.edit_map(add_pillar(pillar=CircleObstacle(place, 0.3)), "drawn"),
        lambda: session.set_properties(RobotProperties(radius=0.2)),
        lambda: session.add_robot((3.0, 3.0)),
        lambda: session.fail_robot(1),
        lambda: session.place_robot(1, (5.0, 3.0)),
    ):
        with pytest.raises(StartError, match="no room"):
            touch()
        assert describe_state(session) == before


def test_the_newest_cost_of_each_pane():
    session = start_session(RAPF, LLOYD)
    session.timeline.panes[0].distance_curve.add(0.0, 2.0)
    assert session.timeline.panes[0].distance_curve.interpolate(session.displayed.time) == 2.0
    assert np.isnan(session.timeline.panes[1].distance_curve.interpolate(session.displayed.time))
