"""Sessions: restarts, and edits of controllers and robot properties."""

from __future__ import annotations

import numpy as np
import pytest
from sample_sessions import (
    HALL,
    LLOYD,
    PILLAR,
    RAPF,
    RPF,
    add_pillar,
    advance_session,
    compute_penetration,
    describe_state,
    get_positions,
    get_robot_numbers,
    start_session,
)

from robocov.environment import CircleObstacle, Environment
from robocov.errors import ParameterError, StartError
from robocov_app.viewer.session.editing.map_edits import add_obstacle
from robocov_app.viewer.session.pane import resume_simulation
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice
from robocov_app.viewer.session.setup.robot_properties import RobotProperties

# Restarts


def test_a_restart_returns_to_the_starts():
    session = start_session(RAPF, LLOYD)
    timeline = session.timeline
    starts = get_positions(session)
    advance_session(session, 20)
    session.fail_robot(1)
    session.add_robot((3.0, 3.0))
    past_version = timeline.past_version
    session.restart()
    assert timeline.past_version == past_version + 1
    assert session.displayed.time == 0.0
    assert timeline.history.steps == [0]
    assert timeline.is_live
    assert get_robot_numbers(session) == ((1, 2, 3), ())
    for positions, expected in zip(get_positions(session), starts, strict=True):
        np.testing.assert_array_equal(positions, expected)
    assert timeline.events == []
    assert timeline.ghosts == []


def test_undo_returns_to_the_run_before_a_restart():
    session = advance_session(start_session(), 20)
    session.fail_robot(1)
    session.restart()
    assert session.undo() == "restarted"
    assert get_robot_numbers(session) == ((2, 3), (1,))
    assert session.displayed.time == 20 / 60


@pytest.mark.parametrize("is_playing", [True, False])
def test_a_step_that_an_unexpected_error_interrupts_is_reverted(monkeypatch, is_playing):
    session = advance_session(start_session(RAPF, LLOYD), 5)
    session.playback.is_playing = is_playing
    point = session.build_save_point()

    def fail(pull):
        raise ZeroDivisionError

    with monkeypatch.context() as patch:
        patch.setattr(session.timeline.panes[1], "step", fail)
        with pytest.raises(ZeroDivisionError):
            session.playback.step()
    session.restore(point)
    assert [pane.simulation.time for pane in session.timeline.panes] == [session.timeline.end_time] * 2
    assert session.timeline.step == 5


def test_all_edits_can_be_undone_across_restarts():
    session = start_session()
    circle = CircleObstacle((5.2, 0.4), 0.2)
    session.edit_map(add_obstacle(session.displayed.environment, circle), "circle drawn")
    session.add_robot((3.4, 3.0))
    session.restart(seed=3)
    assert get_robot_numbers(session) == ((1, 2, 3), ())
    assert [session.undo() for _ in range(4)] == ["seed 3", "robot 4 joined", "circle drawn", None]
    assert session.displayed.environment is HALL
    assert session.timeline.head.parent is None
    assert [session.redo() for _ in range(4)] == ["circle drawn", "robot 4 joined", "seed 3", None]
    assert session.timeline.scenario.seed == 3
    assert get_robot_numbers(session) == ((1, 2, 3), ())


def test_a_restart_may_change_the_scenario():
    session = start_session(RAPF)
    timeline = session.timeline
    session.restart(robots=5)
    assert session.displayed.numbers == (1, 2, 3, 4, 5)
    session.restart(start="far", seed=4)
    expected = HALL.start("far").sample(5, seed=4, radius=0.1)
    np.testing.assert_array_equal(get_positions(session)[0], expected)
    session.restart(controllers=(RPF, LLOYD))
    assert [pane.controller for pane in timeline.panes] == [RPF, LLOYD]
    assert timeline.scenario.start == "far"
    square = Environment("square", ((0, 0), (9, 0), (9, 9), (0, 9)))
    session.restart(environment=square)
    assert session.displayed.environment is square
    assert timeline.scenario.start_name == "uniform"


@pytest.mark.parametrize("is_past_displayed", [False, True])
def test_a_restart_keeps_edits_of_the_present(is_past_displayed):
    session = advance_session(start_session(RAPF, RPF), 10)
    session.set_controller(session.timeline.panes[0], LLOYD)
    session.set_properties(RobotProperties(radius=0.2))
    session.edit_map(add_pillar(), "circle drawn")
    advance_session(session, 10)
    if is_past_displayed:
        session.show_time(0.0)
        assert session.displayed.environment is HALL
    session.restart()
    assert [pane.controller for pane in session.timeline.panes] == [LLOYD, RPF]
    assert session.timeline.panes[0].setup.properties == RobotProperties(radius=0.2)
    assert session.displayed.environment.obstacles[-1] == PILLAR


def test_a_restart_does_not_use_a_covered_start():
    session = start_session(start="far")
    session.edit_map(add_obstacle(HALL, CircleObstacle((5.2, 3.2), 0.6)), "circle drawn")
    assert "far" not in session.displayed.environment.starts
    session.restart()
    assert session.timeline.scenario.start is None
    assert session.timeline.scenario.start_name == "corner"


def test_given_starts_are_kept_until_other_starts_are_chosen():
    starts = np.array([[1.0, 1.0], [5.0, 3.0], [3.0, 3.0]])
    session = advance_session(start_session(given_starts=starts), 10)
    session.restart(controllers=(RPF,))
    np.testing.assert_array_equal(get_positions(session)[0], starts)
    session.restart(seed=1)
    assert session.timeline.scenario.given_starts is None
    assert np.abs(get_positions(session)[0] - starts).max() > 0.1


@pytest.mark.parametrize(
    "changes",
    [
        {"robots": 0},
        {"robots": 700},
        {"start": "nowhere"},
        {"controllers": (ControllerChoice("unknown"),)},
        {"controllers": ()},
        {"dt": 7.0},
        {"seed": -1},
    ],
)
def test_a_restart_that_is_not_possible_changes_nothing(changes):
    session = advance_session(start_session(RAPF, LLOYD), 12)
    session.fail_robot(2)
    session.show_time(0.1)
    before = describe_state(session)
    with pytest.raises((StartError, ParameterError)):
        session.restart(**changes)
    assert describe_state(session) == before


# Controllers


def test_the_controller_of_one_pane_is_replaced():
    session = advance_session(start_session(RAPF, RAPF), 20)
    timeline = session.timeline
    session.set_controller(timeline.panes[1], LLOYD)
    assert [pane.controller for pane in timeline.panes] == [RAPF, LLOYD]
    assert timeline.scenario.controllers == (RAPF, LLOYD)
    assert timeline.events[-1].text == "Lloyd takes over"
    session.set_controller(timeline.panes[0], RAPF.with_gain("k_rep", 0.5))
    assert timeline.events[-1].text == "RAPF: k_rep = 0.5"
    assert len(timeline.history) == 21
    advance_session(session, 20)


def test_the_same_controller_and_properties_are_not_an_edit():
    session = advance_session(start_session(RAPF), 10)
    session.show_time(0.0)
    before = describe_state(session)
    session.set_controller(session.timeline.panes[0], ControllerChoice("rapf"))
    session.set_properties(RobotProperties())
    assert describe_state(session) == before


def test_an_edit_is_compared_with_the_displayed_state():
    session = advance_session(start_session(), 20)
    session.set_properties(RobotProperties(max_speed=0.5))
    session.set_controller(session.timeline.panes[0], LLOYD)
    advance_session(session, 20)
    session.show_time(0.1)
    # The newest state has this speed already, but the displayed one does not, so this is an edit: it starts a
    # branch at 0.1 s, before the controller was replaced.
    session.set_properties(RobotProperties(max_speed=0.5))
    assert session.timeline.is_live
    assert session.timeline.panes[0].setup.properties.max_speed == 0.5
    assert session.timeline.panes[0].controller == RAPF
    assert session.timeline.end_time == pytest.approx(0.1)


# Robot properties


def test_properties_are_changed_in_all_panes():
    session = advance_session(start_session(RAPF, LLOYD), 20)
    session.set_properties(RobotProperties(max_speed=0.3, communication_range=0.5))
    for pane in session.timeline.panes:
        assert pane.simulation.team.max_speed.tolist() == [0.3] * 3
        assert not pane.simulation.observe_and_decide().seen.neighbors.is_complete
    assert session.timeline.events[-1].kind == "limits"


@pytest.mark.parametrize("properties", [RobotProperties(max_speed=0.0), RobotProperties(radius=1.9)])
def test_properties_that_are_not_possible_change_nothing(properties):
    session = advance_session(start_session(RAPF, LLOYD), 20)
    before = describe_state(session)
    with pytest.raises((ParameterError, StartError)):
        session.set_properties(properties)
    assert describe_state(session) == before


def test_larger_robots_push_each_other_apart():
    session = start_session(robots=6)
    session.set_properties(RobotProperties(radius=0.3))
    positions = get_positions(session)[0]
    distances = np.hypot(*(positions[:, None] - positions[None]).transpose(2, 0, 1))
    assert distances[np.triu_indices(6, 1)].min() >= 0.6
    assert compute_penetration(session) <= 0.0


def test_unicycles_are_resumed_bit_for_bit():
    session = start_session(RAPF, properties=RobotProperties(track_width=0.16))
    pane = session.timeline.panes[0]
    advance_session(session, 60)
    repeated = advance_session(Session(session.timeline.document.nodes[0].scenario), 60)
    assert get_positions(repeated)[0].tobytes() == get_positions(session)[0].tobytes()
    steering = pane.simulation.steering
    resumed = resume_simulation(pane.build_state(), session.timeline.history.dt, 60)
    pane.simulation.step()
    resumed.step()
    assert resumed.positions.tobytes() == pane.simulation.positions.tobytes()
    assert (resumed.steering != steering).any()


def test_the_other_unicycles_keep_their_headings_when_one_fails():
    session = start_session(RAPF, properties=RobotProperties(track_width=0.16))
    pane = session.timeline.panes[0]
    advance_session(session, 60)
    steering = pane.simulation.steering
    session.fail_robot(1)
    assert (pane.simulation.steering == steering[1:]).all()


def test_an_edit_before_a_pane_was_removed_brings_it_back():
    session = advance_session(start_session(RAPF, LLOYD), 5)
    session.remove_pane(session.timeline.panes[0])
    session.show_time(0.0)
    session.edit_map(add_pillar(session.displayed.environment), "pillar added")
    assert len(session.timeline.panes) == 2
    assert [len(pane.simulation.environment.obstacles) for pane in session.timeline.panes] == [3, 3]
