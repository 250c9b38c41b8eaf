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
from robocov_app.viewer.session.controller_choice import ControllerChoice
from robocov_app.viewer.session.map_edits import add_obstacle
from robocov_app.viewer.session.pane import resume_simulation
from robocov_app.viewer.session.robot_properties import RobotProperties
from robocov_app.viewer.session.session import Session

# beginning anew


def test_it_begins_anew_as_it_began():
    session = start_session(RAPF, LLOYD)
    start = session.displayed.get_positions(session.timeline.panes[0]).copy()
    advance_session(session, 20)
    session.fail_robot(1)
    session.add_robot((3.0, 3.0))
    serial = session.timeline.past_version
    session.restart()
    assert session.timeline.past_version == serial + 1
    assert (session.displayed.time, session.timeline.history.steps, session.timeline.is_live) == (
        0.0,
        [0],
        True,
    )
    assert get_robot_numbers(session) == ((1, 2, 3), ())
    for pane in session.timeline.panes:
        np.testing.assert_array_equal(session.displayed.get_positions(pane), start)
    assert list(session.timeline.events) == list(session.timeline.ghosts) == []
    assert session.undo() == "restarted"
    assert get_robot_numbers(session) == ((2, 3, 4), (1,)) and session.displayed.time == 20 / 60


def test_everything_can_be_undone_to_the_first_moment_also_restarts() -> None:
    session = start_session()
    session.edit_map(
        add_obstacle(session.displayed.environment, CircleObstacle((5.2, 0.4), 0.2)), "circle drawn"
    )
    session.add_robot((3.4, 3.0))
    session.restart(seed=3)
    assert get_robot_numbers(session) == ((1, 2, 3), ())
    assert [session.undo() for _ in range(4)] == ["seed 3", "robot 4 joined", "circle drawn", None]
    assert session.displayed.environment is HALL and session.timeline.head.parent is None
    assert [session.redo() for _ in range(4)] == ["circle drawn", "robot 4 joined", "seed 3", None]
    assert session.timeline.scenario.seed == 3 and get_robot_numbers(session) == ((1, 2, 3), ())


def test_it_begins_anew_with_changes():
    session = start_session(RAPF)
    session.restart(robots=5)
    assert session.displayed.numbers == (1, 2, 3, 4, 5)
    session.restart(start="far", seed=4)
    np.testing.assert_array_equal(
        session.displayed.get_positions(session.timeline.panes[0]),
        HALL.start("far").sample(5, seed=4, radius=0.1),
    )
    session.restart(controllers=(RPF, LLOYD))
    assert [pane.controller for pane in session.timeline.panes] == [RPF, LLOYD]
    assert session.timeline.scenario.start == "far"
    other = Environment("other", ((0, 0), (9, 0), (9, 9), (0, 9)))
    session.restart(environment=other)
    assert session.displayed.environment is other
    assert session.timeline.scenario.start_name == "uniform"


def test_what_was_chosen_stays_chosen():
    session = start_session(RAPF, RPF)
    session.set_controller(session.timeline.panes[0], LLOYD)
    session.set_properties(RobotProperties(radius=0.2))
    session.edit_map(add_pillar(), "circle drawn")
    session.restart()
    assert [pane.controller for pane in session.timeline.panes] == [LLOYD, RPF]
    assert session.timeline.panes[0].setup.properties == RobotProperties(radius=0.2)
    assert session.displayed.environment.obstacles[-1] == PILLAR


def test_also_while_the_past_is_looked_at():
    session = advance_session(start_session(RAPF), 10)
    session.edit_map(add_pillar(), "circle drawn")
    session.set_controller(session.timeline.panes[0], LLOYD)
    advance_session(session, 10)
    session.show_time(0.0)
    assert session.displayed.environment is HALL
    session.restart()
    assert session.displayed.environment.obstacles[-1] == PILLAR
    assert session.timeline.panes[0].controller == LLOYD


def test_a_start_that_was_covered_is_not_gone_back_to():
    session = start_session(start="far")
    session.edit_map(add_obstacle(HALL, CircleObstacle((5.2, 3.2), 0.6)), "circle drawn")
    assert "far" not in session.displayed.environment.starts
    session.restart()
    assert session.timeline.scenario.start is None
    assert session.timeline.scenario.start_name == "corner"


def test_starts_that_were_given_are_gone_back_to_but_not_by_others():
    given_starts = np.array([[1.0, 1.0], [5.0, 3.0], [3.0, 3.0]])
    session = advance_session(start_session(given_starts=given_starts), 10)
    session.restart(controllers=(RPF,))
    np.testing.assert_array_equal(session.displayed.get_positions(session.timeline.panes[0]), given_starts)
    session.restart(seed=1)
    assert session.timeline.scenario.given_starts is None
    assert np.abs(session.displayed.get_positions(session.timeline.panes[0]) - given_starts).max() > 0.1


@pytest.mark.parametrize(
    "changes",
    [
        {"robots": 0},
        {"robots": 700},
        {"start": "nowhere"},
        {"controllers": (ControllerChoice("nobody"),)},
        {"controllers": ()},
        {"dt": 7.0},
        {"seed": -1},
    ],
)
def test_what_cannot_be_begun_leaves_all_as_it_is(changes):
    session = advance_session(start_session(RAPF, LLOYD), 12)
    session.fail_robot(2)
    session.show_time(0.1)
    before = describe_state(session)
    with pytest.raises((StartError, ParameterError)):
        session.restart(**changes)
    assert describe_state(session) == before


# controllers and limits


def test_another_controller_takes_over_in_one_pane():
    session = advance_session(start_session(RAPF, RAPF), 20)
    session.set_controller(session.timeline.panes[1], LLOYD)
    assert [pane.controller for pane in session.timeline.panes] == [RAPF, LLOYD]
    assert session.timeline.scenario.controllers == (RAPF, LLOYD)
    assert session.timeline.events[-1].text == "Lloyd takes over"
    session.set_controller(session.timeline.panes[0], RAPF.with_gain("k_rep", 0.5))
    assert session.timeline.events[-1].text == "RAPF: k_rep = 0.5"
    assert len(session.timeline.history) == 21
    advance_session(session, 20)


def test_the_same_controller_again_is_no_event():
    session = advance_session(start_session(RAPF), 10)
    session.show_time(0.0)
    before = describe_state(session)
    session.set_controller(session.timeline.panes[0], ControllerChoice("rapf"))
    session.set_properties(RobotProperties())
    assert describe_state(session) == before


def test_what_was_then_counts_not_what_is_now():
    session = advance_session(start_session(), 20)
    session.set_properties(RobotProperties(max_speed=0.5))
    session.set_controller(session.timeline.panes[0], LLOYD)
    advance_session(session, 20)
    session.show_time(0.1)
    session.set_properties(RobotProperties(max_speed=0.5))
    assert session.timeline.is_live
    assert session.timeline.panes[0].setup.properties.max_speed == 0.5
    assert session.timeline.panes[0].controller == RAPF
    assert session.timeline.end_time == pytest.approx(0.1)


def test_limits_are_those_of_all():
    session = advance_session(start_session(RAPF, LLOYD), 20)
    session.set_properties(RobotProperties(max_speed=0.3, communication_range=0.5))
    for pane in session.timeline.panes:
        assert pane.simulation.team.max_speed.tolist() == [0.3] * 3
        assert not pane.simulation.observe_and_decide().seen.neighbors.is_complete
    assert session.timeline.events[-1].kind == "limits"
    before = describe_state(session)
    for limits in (RobotProperties(max_speed=0.0), RobotProperties(radius=1.9)):
        with pytest.raises((ParameterError, StartError)):
            session.set_properties(limits)
        assert describe_state(session) == before


def test_larger_robots_make_room_for_each_other():
    session = start_session(robots=6)
    session.set_properties(RobotProperties(radius=0.3))
    places = session.displayed.get_positions(session.timeline.panes[0])
    apart = np.hypot(*(places[:, None] - places[None]).transpose(2, 0, 1))
    assert apart[np.triu_indices(6, 1)].min() >= 0.6
    assert compute_penetration(session) <= 0.0


def test_unicycles_go_on_from_any_moment_bit_for_bit() -> None:
    session = start_session(RAPF, properties=RobotProperties(track_width=0.16))
    advance_session(session, 60)
    wanted, steering = get_positions(session), session.timeline.panes[0].simulation.steering
    again = Session(session.timeline.document.nodes[0].scenario)
    advance_session(again, 60)
    assert [each.tobytes() for each in get_positions(again)] == [each.tobytes() for each in wanted]
    state = session.timeline.panes[0].build_state()
    going_on = resume_simulation(state, session.timeline.history.dt, 60)
    session.timeline.panes[0].simulation.step()
    going_on.step()
    assert going_on.positions.tobytes() == session.timeline.panes[0].simulation.positions.tobytes()
    assert going_on.steering is not None and steering is not None
    assert (going_on.steering != steering).any()
    # who stays keeps its heading when another one leaves
    now = session.timeline.panes[0].simulation.steering
    session.fail_robot(1)
    assert now is not None and (session.timeline.panes[0].simulation.steering == now[1:]).all()
