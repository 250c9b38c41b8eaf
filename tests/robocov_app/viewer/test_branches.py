"""Branches: the displayed state becomes the present, and what came after it stays as a ghost curve."""

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
from robocov_app.viewer.session import pane_group as module
from robocov_app.viewer.session.past.ghosts import MAX_GHOST_BRANCHES
from robocov_app.viewer.session.setup.robot_properties import RobotProperties


@pytest.mark.parametrize("controllers", [(RAPF,), (RPF, LLOYD)])
def test_a_branch_without_edits_is_the_same_bit_for_bit(controllers):
    session = advance_session(start_session(*controllers, robots=4), 100)
    expected = get_positions(session)
    session.show_time(0.5)
    assert session.branch()
    assert session.timeline.is_live
    assert session.timeline.end_time == pytest.approx(0.5)
    assert session.timeline.history.steps[-1] == 30
    advance_session(session, 70)
    for positions, before in zip(get_positions(session), expected, strict=True):
        np.testing.assert_array_equal(positions, before)


def test_a_branch_from_a_thinned_past_is_the_same_bit_for_bit(short_history):
    session = advance_session(start_session(RAPF, LLOYD, robots=4), 100)
    circle = CircleObstacle((3.2, 2.2), 0.3)
    session.edit_map(replace(HALL, obstacles=(*HALL.obstacles, circle)), "circle drawn")
    session.fail_robot(3)
    advance_session(session, 400)
    expected = get_positions(session)
    assert session.timeline.history.thinned > 0
    session.show_time(2.5)
    assert session.branch()
    advance_session(session, 500 - session.timeline.step)
    for positions, before in zip(get_positions(session), expected, strict=True):
        np.testing.assert_array_equal(positions, before)


def test_a_branch_leaves_ghost_curves():
    session = start_session(RAPF, LLOYD)
    advance_with_costs(session, 60)
    timeline = session.timeline
    past_version = timeline.past_version
    session.show_time(0.5)
    assert session.branch()
    assert timeline.past_version == past_version + 1
    assert [ghost.controller for ghost in timeline.ghosts] == ["rapf", "lloyd"]
    assert [ghost.description for ghost in timeline.ghosts] == ["RAPF", "Lloyd"]
    for ghost in timeline.ghosts:
        assert ghost.times[0] == pytest.approx(0.5)
        assert ghost.times[-1] == pytest.approx(59 / 60)
    for pane in timeline.panes:
        assert pane.distance_curve.last_time == pytest.approx(0.5)
        assert pane.distance_curve.interpolate(session.displayed.time) == pytest.approx(2.5)
        assert pane.time == pytest.approx(0.5)
        assert pane.trail.times[-1] == pytest.approx(0.5)


def test_only_the_newest_branches_have_ghost_curves():
    session = start_session(RAPF)
    advance_with_costs(session, 10)
    for number in range(MAX_GHOST_BRANCHES + 3):
        session.show_time(0.1)
        session.set_properties(RobotProperties(max_speed=0.5 + 0.01 * number))
        advance_with_costs(session, 4)
    # The last node is that of the present branch.
    newest = [node.number for node in session.timeline.document.nodes][-MAX_GHOST_BRANCHES - 1 : -1]
    assert [ghost.node for ghost in session.timeline.ghosts] == newest


def test_there_is_no_branch_at_the_present():
    session = advance_session(start_session(), 10)
    before = describe_state(session)
    assert not session.branch()
    session.show_time(99.0)
    assert not session.branch()
    assert describe_state(session) == before


def test_a_branch_starts_with_the_settings_of_its_time():
    session = advance_session(start_session(RAPF, RPF), 20)
    timeline = session.timeline
    session.set_controller(timeline.panes[0], LLOYD)
    session.set_properties(RobotProperties(max_speed=0.5))
    session.edit_map(replace(HALL, obstacles=()), "emptied")
    session.add_robot((1.0, 3.0))
    advance_session(session, 20)
    session.show_time(10 / 60)
    assert session.displayed.environment is HALL
    assert session.displayed.numbers == (1, 2, 3)
    session.branch()
    assert [pane.controller for pane in timeline.panes] == [RAPF, RPF]
    assert timeline.scenario.controllers == (RAPF, RPF)
    assert timeline.scenario.properties == RobotProperties()
    assert timeline.scenario.environment is HALL
    assert timeline.panes[0].starts.shape == (3, 2)
    assert timeline.events == []
    assert timeline.head.parent is None
    advance_session(session, 5)


def test_a_branch_has_the_events_before_it():
    session = advance_session(start_session(), 10)
    session.fail_robot(2)
    advance_session(session, 10)
    session.fail_robot(3)
    advance_session(session, 10)
    session.show_time(10 / 60)
    session.branch()
    assert [event.text for event in session.timeline.events] == ["robot 2 failed"]
    assert session.displayed.numbers == (1, 3)


def test_a_branch_that_is_not_possible_changes_nothing(monkeypatch):
    session = start_session(RAPF, RPF)
    advance_with_costs(session, 40)
    session.show_time(0.3)
    before = describe_state(session)

    def raise_start_error(state):
        raise StartError("no room")

    monkeypatch.setattr(module.PaneGroup, "resume", raise_start_error)
    for edit in (
        session.branch,
        lambda: session.set_controller(session.timeline.panes[0], LLOYD),
        lambda: session.fail_robot(1),
    ):
        with pytest.raises(StartError, match="no room"):
            edit()
        assert describe_state(session) == before


def test_changes_of_a_slider_are_one_event():
    session = advance_session(start_session(RAPF, RPF), 3)
    pane = session.timeline.panes[0]
    for gain in ("k_rep", "k_att"):
        for value in range(1, 20):
            session.set_controller(pane, pane.controller.with_gain(gain, value / 10))
            session.playback.step()
    for value in range(1, 20):
        session.set_properties(RobotProperties(max_speed=value / 10))
        session.playback.step()
    texts = [event.text for event in session.timeline.events]
    assert texts == ["RAPF: k_rep = 1.9", "RAPF: k_att = 1.9", "limits changed"]


def test_later_changes_of_a_slider_are_another_event():
    session = start_session(RAPF, RPF)
    session.set_properties(RobotProperties(max_speed=2.0))
    advance_session(session, 70)
    session.set_properties(RobotProperties(max_speed=3.0))
    for pane in session.timeline.panes:
        session.set_controller(pane, LLOYD)
    texts = [event.text for event in session.timeline.events]
    assert texts == ["limits changed", "limits changed", "Lloyd takes over", "Lloyd takes over"]


def test_a_branch_lists_the_controllers_that_it_ran():
    """Those of a later branch are not those of the branch that it left."""
    session = start_session(LLOYD, RAPF)
    advance_with_costs(session, 20)
    session.set_controller(session.timeline.panes[0], RPF)
    advance_with_costs(session, 20)
    session.remove_pane(session.timeline.panes[1])
    advance_with_costs(session, 20)
    session.undo()
    session.undo()
    session.timeline.finish_seek()
    advance_with_costs(session, 40)
    session.timeline.cache_present()
    branches = session.timeline.document.list_branches()
    controllers = [{pane: choice.name for pane, choice in branch.controllers.items()} for branch in branches]
    assert controllers == [{0: "lloyd", 1: "rapf"}, {0: "rpf"}]
    assert "Lloyd" in branches[0].describe_end(session.timeline.scenario.dt)
    assert {ghost.controller for ghost in session.timeline.ghosts} == {"rpf"}


def test_the_trail_of_a_pane_that_was_removed_is_complete_after_a_return() -> None:
    session = advance_session(start_session(RAPF, LLOYD, robots=2), 20)
    session.remove_pane(session.timeline.panes[0])
    session.show_time(0.2)
    assert session.branch()
    session.show_time(0.1)
    for pane in session.timeline.panes:
        positions, times = session.displayed.get_trail(pane)
        assert times[0] == 0.0
        assert np.isfinite(positions).all()
