from __future__ import annotations

import numpy as np
import pytest
from sample_sessions import (
    HALL,
    LLOYD,
    RAPF,
    RPF,
    advance_session,
    compute_penetration,
    describe_state,
    get_positions,
    start_session,
)

from robocov.errors import ParameterError, StartError
from robocov.simulation import Simulation
from robocov_app.viewer.session.controller_choice import ControllerChoice
from robocov_app.viewer.session.robot_properties import RobotProperties
from robocov_app.viewer.session.scenario import SessionScenario
from robocov_app.viewer.session.session import Session

MINE = """
from dataclasses import dataclass
import numpy as np
from robocov.observation import Decision

@dataclass(frozen=True)
class Failing:
    at: float = 0.2

    def begin(self, region, team):
        return None

    def decide(self, seen, memory):
        if seen.time > self.at:
            raise ValueError("enough")
        return Decision(np.zeros_like(seen.positions))
"""


@pytest.fixture(scope="module")
def failing(tmp_path_factory) -> ControllerChoice:
    file = tmp_path_factory.mktemp("own") / "mine.py"
    file.write_text(MINE)
    return ControllerChoice(f"{file}:Failing")


# time


def test_it_goes_as_the_simulation_does():
    session = start_session(RPF, robots=4, seed=2)
    simulation = Simulation(HALL, RPF.build(), HALL.start().sample(4, seed=2))
    advance_session(session, 50)
    for _ in range(50):
        simulation.step()
    np.testing.assert_array_equal(
        session.displayed.get_positions(session.timeline.panes[0]), simulation.positions
    )
    assert session.displayed.time == session.timeline.end_time == pytest.approx(simulation.time)
    assert session.displayed.numbers == (1, 2, 3, 4)
    assert session.displayed.environment is HALL
    assert session.timeline.is_live


def test_lanes_go_in_step():
    session = start_session(RAPF, RPF, LLOYD)
    for k in range(100):
        session.playback.step()
        assert {pane.time for pane in session.timeline.panes} == {session.timeline.panes[0].time}
        assert session.timeline.end_time == pytest.approx((k + 1) / 60)
        assert session.timeline.panes[0].time == pytest.approx(session.timeline.end_time, abs=1e-9)
    # each in its own way from the same starts
    first = [session.timeline.history[0].states[pane.number].positions for pane in session.timeline.panes]
    np.testing.assert_array_equal(first[0], first[2])
    assert np.abs(get_positions(session)[0] - get_positions(session)[2]).max() > 0.1


def test_time_passes_while_it_plays():
    session = start_session()
    assert session.playback.advance(0.1) == 0
    session.playback.is_playing = True
    assert session.playback.advance(0.1) == 6
    session.playback.clock.speed = 4.0
    assert session.playback.advance(0.05) == 12
    assert session.timeline.end_time == pytest.approx(0.3)
    session.playback.step()
    assert not session.playback.is_playing


def test_a_longer_control_period():
    session = start_session(dt=0.1)
    session.playback.is_playing = True
    session.playback.advance(0.1)
    session.playback.advance(0.1)
    assert session.timeline.end_time == pytest.approx(0.2)
    session.restart(dt=0.05)
    session.playback.advance(0.1)
    assert session.timeline.history.steps == [0, 1, 2]


def test_a_controller_that_fails_stops_all_lanes_at_the_same_time(failing):
    session = start_session(RAPF, failing, LLOYD)
    session.playback.is_playing = True
    with pytest.raises(ParameterError, match="enough"):
        for _ in range(10):
            session.playback.advance(0.1)
    assert not session.playback.is_playing
    assert session.timeline.end_time == pytest.approx(13 / 60)
    assert {pane.time for pane in session.timeline.panes} == {session.timeline.panes[0].time}
    before = describe_state(session)
    with pytest.raises(ParameterError, match="enough"):
        session.playback.step()
    assert describe_state(session) == before
    # what it decided can be shown nonetheless, and the past looked at
    assert (
        session.displayed.get_snapshot(session.timeline.panes[1]).decision.forces.tolist()
        == np.zeros((3, 2)).tolist()
    )
    session.show_time(0.1)
    session.displayed.get_snapshot(session.timeline.panes[1])
    # another one goes on
    session.show_time(9.0)
    session.set_controller(session.timeline.panes[1], RPF)
    session.playback.step()
    assert {pane.time for pane in session.timeline.panes} == {session.timeline.panes[0].time}


def test_it_stops_when_all_have_settled():
    session = start_session(LLOYD, robots=2)
    session.playback.is_playing, session.playback.stop_when_settled, session.playback.clock.speed = (
        True,
        True,
        16.0,
    )
    for _ in range(60):
        session.playback.advance(0.1)
    assert not session.playback.is_playing
    assert session.timeline.is_settled
    now = get_positions(session)[0]
    k = session.timeline.history.find_index(session.timeline.end_time - 4.0)
    assert np.abs(now - session.timeline.history[k].states[0].positions).max() < 0.05
    # whoever touches it unsettles it
    session.place_robot(1, (3.5, 3.5))
    assert not session.timeline.is_settled


def test_who_is_held_has_not_settled():
    session = start_session(LLOYD, robots=2)
    session.playback.is_playing = True
    session.drag_robot(1, (1.0, 3.0))
    session.playback.clock.speed = 16.0
    for _ in range(20):
        session.playback.advance(0.1)
    assert not session.timeline.is_settled


# the past


def test_the_past_is_as_it_was():
    session = start_session(RAPF, LLOYD)
    was = [get_positions(session)]
    for _ in range(40):
        session.playback.step()
        was.append(get_positions(session))
    for k in (3, 0, 39, 17):
        session.show_time(k / 60)
        assert not session.timeline.is_live
        assert session.displayed.time == pytest.approx(k / 60)
        assert session.timeline.end_time == pytest.approx(40 / 60)
        for pane, places in zip(session.timeline.panes, was[k], strict=True):
            np.testing.assert_array_equal(session.displayed.get_positions(pane), places)
            assert session.displayed.get_snapshot(pane).time == pytest.approx(k / 60)
            assert session.displayed.get_trail(pane)[1][-1] <= session.displayed.time + 1e-9
            np.testing.assert_array_equal(session.displayed.get_trail(pane)[0][0], was[0][pane.number])
    session.show_time(40 / 60)
    assert session.timeline.is_live
    session.show_time(99.0)
    assert session.timeline.is_live


def test_looking_moment_by_moment():
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


def test_the_past_plays_and_ends_in_the_present():
    session = advance_session(start_session(), 30)
    session.show_time(0.2)
    session.playback.is_playing = True
    session.playback.advance(0.1)
    assert session.displayed.time == pytest.approx(0.3)
    assert session.timeline.end_time == pytest.approx(0.5)
    session.playback.advance(0.1)
    session.playback.advance(0.1)
    # the last moment is the present, from which it goes on
    assert session.timeline.is_live
    assert session.timeline.end_time == pytest.approx(0.5)
    session.playback.advance(0.1)
    assert session.timeline.end_time == pytest.approx(0.6)
    session.show_time(0.2)
    session.playback.step()
    assert (session.displayed.time, session.playback.is_playing) == (pytest.approx(0.2 + 1 / 60), False)


def test_a_thinned_past_plays_at_the_same_speed(short):
    session = advance_session(start_session(robots=1), 600)
    assert session.timeline.history.thinned > 0
    assert session.timeline.history.steps[1] > 4
    session.show_time(0.0)
    session.playback.is_playing = True
    for k in range(1, 31):
        session.playback.advance(0.1)
        assert session.displayed.time == pytest.approx(
            0.1 * k, abs=max(np.diff(session.timeline.history.steps)) / 60 + 1e-9
        )
    # a single step shows the next moment, however far
    session.show_time(0.0)
    session.playback.step()
    assert session.displayed.time == session.timeline.history.get_time(1)


def test_where_a_robot_was_lately():
    session = advance_session(start_session(), 300)
    pane = session.timeline.panes[0]
    places = session.displayed.get_recent_positions(pane, 2)
    assert 20 <= len(places) <= 62
    np.testing.assert_array_equal(places[0], session.timeline.history[60].states[0].positions[1])
    assert np.abs(places[-1] - session.displayed.get_positions(pane)[1]).max() < 0.5
    session.show_time(1.0)
    np.testing.assert_array_equal(
        session.displayed.get_recent_positions(pane, 2)[0], session.timeline.history[0].states[0].positions[1]
    )
    assert session.displayed.get_recent_positions(pane, 99).shape == (0, 2)


def test_trails_of_the_past_are_of_who_worked_then():
    session = advance_session(start_session(), 30)
    session.fail_robot(2)
    advance_session(session, 30)
    pane = session.timeline.panes[0]
    assert session.displayed.get_trail(pane)[0].shape[1] == 2
    session.show_time(0.25)
    positions, times = session.displayed.get_trail(pane)
    assert positions.shape[1] == 3
    assert times[-1] <= 0.25 + 1e-9
    assert np.isfinite(positions).all()
    # looked at again, it is not looked for again
    assert session.displayed.get_trail(pane)[0] is positions or np.shares_memory(
        session.displayed.get_trail(pane)[0], positions
    )
    session.show_time(0.5)
    assert session.displayed.get_trail(pane)[0].shape[1] == 2


# the hand


def test_a_hand_pulls_a_robot_and_it_flies_on():
    session = advance_session(start_session(LLOYD, RPF, robots=2), 5)
    session.playback.is_playing = True
    session.drag_robot(1, (5.3, 3.3))
    assert session.timeline.drag == (1, (5.3, 3.3))
    for _ in range(12):
        session.playback.advance(0.1)
        assert compute_penetration(session) < 2e-3
    for pane in session.timeline.panes:
        assert np.hypot(*(pane.simulation.positions[0] - (5.3, 3.3))) < 0.3
    session.drag_robot(1, (1.0, 3.3))
    session.playback.advance(0.1)
    speeds = [float(np.hypot(*pane.simulation.velocities[0])) for pane in session.timeline.panes]
    assert min(speeds) > 1.5
    session.release()
    assert session.timeline.drag is None
    assert session.timeline.events[-1].text == "robot 1 was dragged"
    session.playback.advance(0.1)
    # it brakes from more than it can do by itself
    for pane, speed in zip(session.timeline.panes, speeds, strict=True):
        assert 1.0 < np.hypot(*pane.simulation.velocities[0]) < speed
    session.release()
    assert len(session.timeline.events) == 1


def test_a_robot_that_is_thrown_at_a_wall_stays_inside():
    session = start_session(RAPF, robots=1, properties=RobotProperties(radius=0.3, mass=3.0))
    session.playback.is_playing = True
    for target in ((6.5, 4.5), (-0.5, -0.5), (6.5, -0.5), (-0.5, 4.5), (4.2, 1.2), (2.5, 9.0)):
        session.drag_robot(1, target)
        for _ in range(10):
            session.playback.advance(0.1)
            assert compute_penetration(session) < 2e-3


def test_who_looks_back_lets_go():
    session = advance_session(start_session(), 10)
    session.playback.is_playing = True
    session.drag_robot(1, (3.0, 3.0))
    session.show_time(0.1)
    assert session.timeline.drag is None
    assert session.timeline.events[-1].kind == "hand"


# begin


def test_a_session_needs_room():
    with pytest.raises(StartError):
        Session(SessionScenario(HALL, robots=400))
    with pytest.raises(ParameterError):
        Session(SessionScenario(HALL, (ControllerChoice("nobody"),)))


def test_starts_that_are_given_are_begun_with():
    given = np.array([[1.0, 1.0], [5.0, 3.0]])
    session = start_session(robots=2, given_starts=given)
    np.testing.assert_array_equal(session.displayed.get_positions(session.timeline.panes[0]), given)
