"""Playback: time passes in all panes together, at a speed, until the team has settled."""

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
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice
from robocov_app.viewer.session.setup.robot_properties import RobotProperties
from robocov_app.viewer.session.setup.scenario import SessionScenario

USER_CONTROLLER = """
from dataclasses import dataclass
import numpy as np
from robocov.observation import Decision

@dataclass(frozen=True)
class Failing:
    time: float = 0.2

    def begin(self, region, team):
        return None

    def decide(self, seen, memory):
        if seen.time > self.time:
            raise ValueError("enough")
        return Decision(np.zeros_like(seen.positions))
"""


@pytest.fixture(scope="module")
def failing_controller(tmp_path_factory) -> ControllerChoice:
    file = tmp_path_factory.mktemp("controllers") / "failing.py"
    file.write_text(USER_CONTROLLER)
    return ControllerChoice(f"{file}:Failing")


def play_session(session: Session, frames: int, frame_s: float = 0.1) -> None:
    session.playback.is_playing = True
    for _ in range(frames):
        session.playback.advance(frame_s)


def get_pane_times(session: Session) -> set[float]:
    return {pane.time for pane in session.timeline.panes}


# Starts


def test_a_session_needs_space_for_the_team():
    with pytest.raises(StartError):
        Session(SessionScenario(HALL, robots=400))


def test_a_session_needs_a_controller_that_exists():
    with pytest.raises(ParameterError):
        Session(SessionScenario(HALL, (ControllerChoice("unknown"),)))


def test_a_session_starts_at_given_positions():
    starts = np.array([[1.0, 1.0], [5.0, 3.0]])
    session = start_session(robots=2, given_starts=starts)
    np.testing.assert_array_equal(get_positions(session)[0], starts)


# Time


def test_a_session_advances_like_the_simulation():
    session = start_session(RPF, robots=4, seed=2)
    simulation = Simulation(HALL, RPF.build(), HALL.start().sample(4, seed=2))
    advance_session(session, 50)
    for _ in range(50):
        simulation.step()
    np.testing.assert_array_equal(get_positions(session)[0], simulation.positions)
    assert session.displayed.time == session.timeline.end_time == pytest.approx(simulation.time)
    assert session.displayed.numbers == (1, 2, 3, 4)
    assert session.displayed.environment is HALL
    assert session.timeline.is_live


def test_all_panes_are_at_the_same_step():
    session = start_session(RAPF, RPF, LLOYD)
    for step in range(1, 101):
        session.playback.step()
        assert len(get_pane_times(session)) == 1
        assert session.timeline.end_time == pytest.approx(step / 60)
        assert session.timeline.panes[0].time == pytest.approx(session.timeline.end_time, abs=1e-9)
    states = session.timeline.history[0].states
    np.testing.assert_array_equal(states[0].positions, states[2].positions)
    first, _, third = get_positions(session)
    assert np.abs(first - third).max() > 0.1


def test_time_passes_while_a_session_plays():
    session = start_session()
    assert session.playback.advance(0.1) == 0
    session.playback.is_playing = True
    assert session.playback.advance(0.1) == 6
    session.playback.clock.speed = 4.0
    assert session.playback.advance(0.05) == 12
    assert session.timeline.end_time == pytest.approx(0.3)
    session.playback.step()
    assert not session.playback.is_playing


def test_the_control_period_may_be_longer():
    session = start_session(dt=0.1)
    play_session(session, 2)
    assert session.timeline.end_time == pytest.approx(0.2)
    session.restart(dt=0.05)
    session.playback.advance(0.1)
    assert session.timeline.history.steps == [0, 1, 2]


def test_a_controller_that_fails_pauses_all_panes_at_the_same_step(failing_controller):
    session = start_session(RAPF, failing_controller, LLOYD)
    with pytest.raises(ParameterError, match="enough"):
        play_session(session, 10)
    assert not session.playback.is_playing
    assert session.timeline.end_time == pytest.approx(13 / 60)
    assert len(get_pane_times(session)) == 1
    before = describe_state(session)
    with pytest.raises(ParameterError, match="enough"):
        session.playback.step()
    assert describe_state(session) == before


def test_a_state_in_which_a_controller_fails_can_be_displayed(failing_controller):
    session = start_session(RAPF, failing_controller, LLOYD)
    with pytest.raises(ParameterError, match="enough"):
        play_session(session, 10)
    pane = session.timeline.panes[1]
    assert session.displayed.get_snapshot(pane).decision.forces.tolist() == np.zeros((3, 2)).tolist()
    session.show_time(0.1)
    session.displayed.get_snapshot(pane)


def test_another_controller_continues_after_one_that_fails(failing_controller):
    session = start_session(RAPF, failing_controller, LLOYD)
    with pytest.raises(ParameterError, match="enough"):
        play_session(session, 10)
    session.set_controller(session.timeline.panes[1], RPF)
    session.playback.step()
    assert session.timeline.end_time == pytest.approx(14 / 60)
    assert len(get_pane_times(session)) == 1


def test_playback_stops_when_the_team_has_settled():
    session = start_session(LLOYD, robots=2)
    session.playback.stop_when_settled = True
    session.playback.clock.speed = 16.0
    session.playback.is_playing = True
    for _ in range(60):
        session.playback.advance(0.1)
    assert not session.playback.is_playing
    assert session.timeline.is_settled
    history = session.timeline.history
    before = history[history.find_index(session.timeline.end_time - 4.0)].states[0].positions
    assert np.abs(get_positions(session)[0] - before).max() < 0.05
    session.place_robot(1, (3.5, 3.5))
    assert not session.timeline.is_settled


def test_a_team_with_a_dragged_robot_has_not_settled():
    session = start_session(LLOYD, robots=2)
    session.playback.is_playing = True
    session.drag_robot(1, (1.0, 3.0))
    session.playback.clock.speed = 16.0
    play_session(session, 20)
    assert not session.timeline.is_settled


# The past


def test_the_past_plays_until_the_present_and_is_continued():
    session = advance_session(start_session(), 30)
    session.show_time(0.2)
    play_session(session, 1)
    assert session.displayed.time == pytest.approx(0.3)
    assert session.timeline.end_time == pytest.approx(0.5)
    play_session(session, 2)
    assert session.timeline.is_live
    assert session.timeline.end_time == pytest.approx(0.5)
    play_session(session, 1)
    assert session.timeline.end_time == pytest.approx(0.6)


def test_a_step_in_the_past_displays_the_next_state():
    session = advance_session(start_session(), 30)
    session.show_time(0.2)
    session.playback.is_playing = True
    session.playback.step()
    assert session.displayed.time == pytest.approx(0.2 + 1 / 60)
    assert not session.playback.is_playing


def test_a_thinned_past_plays_at_the_same_speed(short_history):
    session = advance_session(start_session(robots=1), 600)
    history = session.timeline.history
    assert history.thinned > 0
    assert history.steps[1] > 4
    longest_gap_s = max(np.diff(history.steps)) / 60
    session.show_time(0.0)
    for frame in range(1, 31):
        play_session(session, 1)
        assert session.displayed.time == pytest.approx(0.1 * frame, abs=longest_gap_s + 1e-9)
    session.show_time(0.0)
    session.playback.step()
    assert session.displayed.time == history.get_time(1), "a step displays the next state at any distance"


# Dragging


def test_a_dragged_robot_keeps_its_velocity_when_it_is_released():
    session = advance_session(start_session(LLOYD, RPF, robots=2), 5)
    panes = session.timeline.panes
    session.playback.is_playing = True
    session.drag_robot(1, (5.3, 3.3))
    assert session.timeline.run.drag == (1, (5.3, 3.3))
    for _ in range(12):
        session.playback.advance(0.1)
        assert compute_penetration(session) < 2e-3
    for pane in panes:
        assert np.hypot(*(pane.simulation.positions[0] - (5.3, 3.3))) < 0.3
    session.drag_robot(1, (1.0, 3.3))
    session.playback.advance(0.1)
    speeds = [float(np.hypot(*pane.simulation.velocities[0])) for pane in panes]
    assert min(speeds) > 1.5
    session.release()
    assert session.timeline.run.drag is None
    assert session.timeline.events[-1].text == "robot 1 was dragged"
    session.playback.advance(0.1)
    # The robot brakes from a speed that it could not reach by itself.
    for pane, speed in zip(panes, speeds, strict=True):
        assert 1.0 < np.hypot(*pane.simulation.velocities[0]) < speed
    session.release()
    assert len(session.timeline.events) == 1


def test_a_robot_that_is_dragged_against_walls_stays_inside():
    session = start_session(RAPF, robots=1, properties=RobotProperties(radius=0.3, mass=3.0))
    session.playback.is_playing = True
    for target in ((6.5, 4.5), (-0.5, -0.5), (6.5, -0.5), (-0.5, 4.5), (4.2, 1.2), (2.5, 9.0)):
        session.drag_robot(1, target)
        for _ in range(10):
            session.playback.advance(0.1)
            assert compute_penetration(session) < 2e-3


def test_a_dragged_robot_is_released_when_the_past_is_displayed():
    session = advance_session(start_session(), 10)
    session.playback.is_playing = True
    session.drag_robot(1, (3.0, 3.0))
    session.show_time(0.1)
    assert session.timeline.run.drag is None
    assert session.timeline.events[-1].kind == "hand"
