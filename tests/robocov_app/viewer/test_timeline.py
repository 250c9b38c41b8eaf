from __future__ import annotations

import numpy as np
import pytest
from touched_run import HALL, LLOYD, RAPF, RPF, all_told, begun, positions_of, stepped, too_deep

from robocov.errors import ParameterError, StartError
from robocov.simulation import Simulation
from robocov_app.viewer.session.scenario import ControllerChoice, Scenario, TeamSpec
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
    session = begun(RPF, robots=4, seed=2)
    simulation = Simulation(HALL, RPF.made(), HALL.start().sample(4, seed=2))
    stepped(session, 50)
    for _ in range(50):
        simulation.step()
    np.testing.assert_array_equal(session.positions(session.panes[0]), simulation.positions)
    assert session.time == session.end == pytest.approx(simulation.time)
    assert session.numbers == (1, 2, 3, 4)
    assert session.environment is HALL
    assert session.live


def test_lanes_go_in_step():
    session = begun(RAPF, RPF, LLOYD)
    for k in range(100):
        session.step()
        assert {pane.time for pane in session.panes} == {session.panes[0].time}
        assert session.end == pytest.approx((k + 1) / 60)
        assert session.panes[0].time == pytest.approx(session.end, abs=1e-9)
    # each in its own way from the same starts
    first = [session.history[0].states[pane.number].positions for pane in session.panes]
    np.testing.assert_array_equal(first[0], first[2])
    assert np.abs(positions_of(session)[0] - positions_of(session)[2]).max() > 0.1


def test_time_passes_while_it_plays():
    session = begun()
    assert session.advance(0.1) == 0
    session.playing = True
    assert session.advance(0.1) == 6
    session.clock.speed = 4.0
    assert session.advance(0.05) == 12
    assert session.end == pytest.approx(0.3)
    session.step()
    assert not session.playing


def test_a_longer_control_period():
    session = begun(dt=0.1)
    session.playing = True
    session.advance(0.1)
    session.advance(0.1)
    assert session.end == pytest.approx(0.2)
    session.restart(dt=0.05)
    session.advance(0.1)
    assert session.history.steps == [0, 1, 2]


def test_a_controller_that_fails_stops_all_lanes_at_the_same_time(failing):
    session = begun(RAPF, failing, LLOYD)
    session.playing = True
    with pytest.raises(ParameterError, match="enough"):
        for _ in range(10):
            session.advance(0.1)
    assert not session.playing
    assert session.end == pytest.approx(13 / 60)
    assert {pane.time for pane in session.panes} == {session.panes[0].time}
    before = all_told(session)
    with pytest.raises(ParameterError, match="enough"):
        session.step()
    assert all_told(session) == before
    # what it decided can be shown nonetheless, and the past looked at
    assert session.snapshot(session.panes[1]).decision.forces.tolist() == np.zeros((3, 2)).tolist()
    session.look_at(0.1)
    session.snapshot(session.panes[1])
    # another one goes on
    session.look_at(9.0)
    session.set_law(session.panes[1], RPF)
    session.step()
    assert {pane.time for pane in session.panes} == {session.panes[0].time}


def test_it_stops_when_all_have_settled():
    session = begun(LLOYD, robots=2)
    session.playing, session.stop_when_settled, session.clock.speed = True, True, 16.0
    for _ in range(60):
        session.advance(0.1)
    assert not session.playing
    assert session.settled
    now = positions_of(session)[0]
    k = session.history.at(session.end - 4.0)
    assert np.abs(now - session.history[k].states[0].positions).max() < 0.05
    # whoever touches it unsettles it
    session.place(1, (3.5, 3.5))
    assert not session.settled


def test_who_is_held_has_not_settled():
    session = begun(LLOYD, robots=2)
    session.playing = True
    session.grab(1, (1.0, 3.0))
    session.clock.speed = 16.0
    for _ in range(20):
        session.advance(0.1)
    assert not session.settled


# the past


def test_the_past_is_as_it_was():
    session = begun(RAPF, LLOYD)
    was = [positions_of(session)]
    for _ in range(40):
        session.step()
        was.append(positions_of(session))
    for k in (3, 0, 39, 17):
        session.look_at(k / 60)
        assert not session.live
        assert session.time == pytest.approx(k / 60)
        assert session.end == pytest.approx(40 / 60)
        for pane, places in zip(session.panes, was[k], strict=True):
            np.testing.assert_array_equal(session.positions(pane), places)
            assert session.snapshot(pane).time == pytest.approx(k / 60)
            assert session.trail(pane)[1][-1] <= session.time + 1e-9
            np.testing.assert_array_equal(session.trail(pane)[0][0], was[0][pane.number])
    session.look_at(40 / 60)
    assert session.live
    session.look_at(99.0)
    assert session.live


def test_looking_moment_by_moment():
    session = stepped(begun(), 10)
    session.look_by(-3)
    assert session.time == pytest.approx(7 / 60)
    session.look_by(1)
    session.look_by(1)
    assert session.time == pytest.approx(9 / 60)
    session.look_by(1)
    assert session.live
    session.look_by(5)
    assert session.live
    session.look_by(-99)
    assert session.time == 0.0


def test_the_past_plays_and_ends_in_the_present():
    session = stepped(begun(), 30)
    session.look_at(0.2)
    session.playing = True
    session.advance(0.1)
    assert session.time == pytest.approx(0.3)
    assert session.end == pytest.approx(0.5)
    session.advance(0.1)
    session.advance(0.1)
    # the last moment is the present, from which it goes on
    assert session.live
    assert session.end == pytest.approx(0.5)
    session.advance(0.1)
    assert session.end == pytest.approx(0.6)
    session.look_at(0.2)
    session.step()
    assert (session.time, session.playing) == (pytest.approx(0.2 + 1 / 60), False)


def test_a_thinned_past_plays_at_the_same_speed(short):
    session = stepped(begun(robots=1), 600)
    assert session.history.thinned > 0
    assert session.history.steps[1] > 4
    session.look_at(0.0)
    session.playing = True
    for k in range(1, 31):
        session.advance(0.1)
        assert session.time == pytest.approx(0.1 * k, abs=max(np.diff(session.history.steps)) / 60 + 1e-9)
    # a single step shows the next moment, however far
    session.look_at(0.0)
    session.step()
    assert session.time == session.history.time(1)


def test_where_a_robot_was_lately():
    session = stepped(begun(), 300)
    pane = session.panes[0]
    places = session.recent(pane, 2)
    assert 20 <= len(places) <= 62
    np.testing.assert_array_equal(places[0], session.history[60].states[0].positions[1])
    assert np.abs(places[-1] - session.positions(pane)[1]).max() < 0.5
    session.look_at(1.0)
    np.testing.assert_array_equal(session.recent(pane, 2)[0], session.history[0].states[0].positions[1])
    assert session.recent(pane, 99).shape == (0, 2)


def test_trails_of_the_past_are_of_who_worked_then():
    session = stepped(begun(), 30)
    session.fail_robot(2)
    stepped(session, 30)
    pane = session.panes[0]
    assert session.trail(pane)[0].shape[1] == 2
    session.look_at(0.25)
    positions, times = session.trail(pane)
    assert positions.shape[1] == 3
    assert times[-1] <= 0.25 + 1e-9
    assert np.isfinite(positions).all()
    # looked at again, it is not looked for again
    assert session.trail(pane)[0] is positions or np.shares_memory(session.trail(pane)[0], positions)
    session.look_at(0.5)
    assert session.trail(pane)[0].shape[1] == 2


# the hand


def test_a_hand_pulls_a_robot_and_it_flies_on():
    session = stepped(begun(LLOYD, RPF, robots=2), 5)
    session.playing = True
    session.grab(1, (5.3, 3.3))
    assert session.hand == (1, (5.3, 3.3))
    for _ in range(12):
        session.advance(0.1)
        assert too_deep(session) < 2e-3
    for pane in session.panes:
        assert np.hypot(*(pane.simulation.positions[0] - (5.3, 3.3))) < 0.3
    session.grab(1, (1.0, 3.3))
    session.advance(0.1)
    speeds = [float(np.hypot(*pane.simulation.velocities[0])) for pane in session.panes]
    assert min(speeds) > 1.5
    session.release()
    assert session.hand is None
    assert session.events[-1].text == "robot 1 was dragged"
    session.advance(0.1)
    # it brakes from more than it can do by itself
    for pane, speed in zip(session.panes, speeds, strict=True):
        assert 1.0 < np.hypot(*pane.simulation.velocities[0]) < speed
    session.release()
    assert len(session.events) == 1


def test_a_robot_that_is_thrown_at_a_wall_stays_inside():
    session = begun(RAPF, robots=1, limits=TeamSpec(radius=0.3, mass=3.0))
    session.playing = True
    for target in ((6.5, 4.5), (-0.5, -0.5), (6.5, -0.5), (-0.5, 4.5), (4.2, 1.2), (2.5, 9.0)):
        session.grab(1, target)
        for _ in range(10):
            session.advance(0.1)
            assert too_deep(session) < 2e-3


def test_who_looks_back_lets_go():
    session = stepped(begun(), 10)
    session.playing = True
    session.grab(1, (3.0, 3.0))
    session.look_at(0.1)
    assert session.hand is None
    assert session.events[-1].kind == "hand"


# begin


def test_a_session_needs_room():
    with pytest.raises(StartError):
        Session(Scenario(HALL, robots=400))
    with pytest.raises(ParameterError):
        Session(Scenario(HALL, (ControllerChoice("nobody"),)))


def test_starts_that_are_given_are_begun_with():
    given = np.array([[1.0, 1.0], [5.0, 3.0]])
    session = begun(robots=2, given=given)
    np.testing.assert_array_equal(session.positions(session.panes[0]), given)
