"""Sessions with panes that are added and removed, and with a map that is edited under the robots."""

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
    get_positions,
    start_session,
)

from robocov.environment import CircleObstacle, PolygonObstacle
from robocov.errors import ParameterError, StartError
from robocov_app.viewer.session.editing.map_edits import replace_obstacles
from robocov_app.viewer.session.setup.robot_properties import RobotProperties
from robocov_app.viewer.session.setup.scenario import MAX_PANES

MAX_PENETRATION_M = 2e-3


def test_panes_are_added_and_removed():
    session = advance_session(start_session(RAPF), 10)
    timeline = session.timeline
    session.add_pane(LLOYD)
    assert [pane.controller for pane in timeline.panes] == [RAPF, LLOYD]
    assert session.displayed.time == 0.0
    advance_session(session, 10)
    session.remove_pane(timeline.panes[0])
    assert [pane.number for pane in timeline.panes] == [1]
    assert timeline.scenario.controllers == (LLOYD,)
    advance_session(session, 10)
    session.show_time(5 / 60)
    assert get_positions(session)[0].shape == (3, 2)
    session.branch()
    advance_session(session, 20)
    assert timeline.panes[0].time == pytest.approx(timeline.end_time)


def test_the_number_of_panes_is_limited():
    session = start_session(*[RAPF] * MAX_PANES)
    with pytest.raises(ParameterError, match="expected at most 4 controllers"):
        session.add_pane(RPF)


def test_the_last_pane_cannot_be_removed():
    session = start_session(RAPF)
    with pytest.raises(ParameterError, match="cannot remove the last pane"):
        session.remove_pane(session.timeline.panes[0])


def test_an_obstacle_that_is_drawn_over_robots_pushes_them():
    session = advance_session(start_session(RAPF, LLOYD, robots=4), 30)
    center = tuple(np.round(get_positions(session)[0][1], 3).tolist())
    pushed = session.edit_map(add_pillar(pillar=CircleObstacle(center, 0.2)), "circle drawn")
    assert pushed >= 1
    assert session.displayed.environment.obstacles[-1].center == center
    assert compute_penetration(session) <= MAX_PENETRATION_M
    assert session.timeline.events[-1].text == "circle drawn"
    advance_session(session, 30)
    assert compute_penetration(session) <= MAX_PENETRATION_M


def test_an_obstacle_elsewhere_pushes_no_robot():
    session = advance_session(start_session(RAPF, LLOYD, robots=4), 30)
    environment = add_pillar(session.displayed.environment, CircleObstacle((5.8, 0.2), 0.1))
    assert session.edit_map(environment, "circle drawn") == 0


def test_a_robot_that_leans_on_a_wall_is_not_pushed():
    session = start_session(LLOYD, robots=1)
    session.playback.is_playing = True
    session.drag_robot(1, (0.0, 2.0))
    for _ in range(10):
        session.playback.advance(0.1)
    session.release()
    assert get_positions(session)[0][0, 0] < 0.11
    assert session.edit_map(add_pillar(), "circle drawn") == 0


def test_edits_of_the_map_are_undone_and_redone():
    session = advance_session(start_session(RAPF, LLOYD), 10)
    timeline = session.timeline
    with_circle = add_pillar()
    without_pillar = replace_obstacles(with_circle, 0, 1)
    session.edit_map(with_circle, "circle drawn")
    advance_session(session, 5)
    session.edit_map(without_pillar, "pillar deleted")
    assert session.undo() == "pillar deleted"
    assert session.displayed.environment == with_circle
    assert session.undo() == "circle drawn"
    assert session.displayed.environment == HALL
    assert timeline.scenario.environment == HALL
    advance_session(session, 5)
    assert session.redo() == "circle drawn"
    assert session.redo() == "pillar deleted"
    assert session.displayed.environment == without_pillar
    assert [event.text for event in timeline.events] == ["circle drawn", "pillar deleted"]
    assert {event.kind for event in timeline.events} == {"obstacle"}
    assert {pane.setup.environment for pane in timeline.panes} == {session.displayed.environment}


def test_a_map_without_space_for_the_robots_is_rejected():
    session = advance_session(start_session(RAPF, LLOYD, robots=5), 40)
    before = describe_state(session)
    block = PolygonObstacle(((0, 0.1), (6, 0.1), (6, 4), (0, 4)))
    with pytest.raises(StartError, match="fits nowhere"):
        session.edit_map(add_pillar(pillar=block), "filled")
    assert describe_state(session) == before


def test_no_pane_changes_if_one_of_them_cannot(monkeypatch):
    session = advance_session(start_session(RAPF, LLOYD), 21)
    before = describe_state(session)

    def raise_start_error(continuation):
        raise StartError("no room")

    monkeypatch.setattr(session.timeline.panes[1], "build_changed_simulation", raise_start_error)
    center = tuple(get_positions(session)[0][0].tolist())
    for edit in (
        lambda: session.edit_map(add_pillar(pillar=CircleObstacle(center, 0.3)), "drawn"),
        lambda: session.set_properties(RobotProperties(radius=0.2)),
        lambda: session.add_robot((3.0, 3.0)),
        lambda: session.fail_robot(1),
        lambda: session.place_robot(1, (5.0, 3.0)),
    ):
        with pytest.raises(StartError, match="no room"):
            edit()
        assert describe_state(session) == before
