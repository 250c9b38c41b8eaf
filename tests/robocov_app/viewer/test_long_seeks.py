"""Seeks to states that take long to recompute: the window does not wait, and nothing is lost."""

from __future__ import annotations

import json
from pathlib import Path

import pygame
import pytest
from driven_window import open_viewer
from sample_sessions import LLOYD, RAPF, advance_session, start_session

from robocov.environment import Environment
from robocov_app.viewer.session import playback, present, seek
from robocov_app.viewer.session.files.session_file import build_session_content, load_session, save_session
from robocov_app.viewer.session.files.workspace import SessionWorkspace
from robocov_app.viewer.session.session import Session


@pytest.fixture
def slow_computer(monkeypatch: pytest.MonkeyPatch) -> None:
    """Compute only one step per frame during a seek, and show the progress immediately."""
    monkeypatch.setattr(playback, "SEEK_SLICE_S", 0.0)
    monkeypatch.setattr(seek, "MIN_NOTICED_SEEK_S", 0.0)


def build_long_session() -> Session:
    """Build a session with three edits, whose recorded states are forgotten."""
    session = start_session(RAPF)
    session.playback.clock.budget = 0.008
    for number in (1, 2):
        advance_session(session, 60)
        session.fail_robot(number)
    advance_session(session, 60)
    session.timeline.cache_present()
    for node in session.timeline.document.nodes:
        node.cached_states = []
    states = session.timeline.history
    session.timeline.history = states.copy_until(0)
    session.timeline.history.append(states.last)
    return session


def play_until_there(session: Session) -> int:
    """Let frames pass until the state is reached, and return their number."""
    frames = 0
    while session.timeline.is_seeking:
        session.playback.advance(1 / 60)
        frames += 1
    return frames


@pytest.mark.parametrize("adds_pane", [False, True])
def test_a_restart_after_a_long_undo_has_the_scenario_of_the_earlier_run(
    adds_pane: bool, slow_computer: None
) -> None:
    session = build_long_session()
    session.restart(environment=Environment("square", ((0, 0), (9, 0), (9, 9), (0, 9))), robots=5)
    for node in session.timeline.document.nodes:
        node.cached_states = []
    assert session.undo() is not None
    assert session.timeline.is_seeking
    if adds_pane:
        session.add_pane(LLOYD)
    else:
        session.restart(seed=3)
    scenario = session.timeline.scenario
    assert (scenario.environment.name, scenario.robots) == ("hall", 3)


def test_each_of_two_undos_in_a_row_undoes_one_edit(slow_computer: None) -> None:
    session = build_long_session()
    assert session.undo() == "robot 2 failed"
    assert session.timeline.is_seeking
    assert session.undo() == "robot 1 failed"
    assert session.undo() is None
    play_until_there(session)
    assert session.displayed.numbers == (1, 2, 3)
    assert session.displayed.time == pytest.approx(1.0)
    assert session.redo() == "robot 1 failed"
    assert session.redo() == "robot 2 failed"
    play_until_there(session)
    assert session.displayed.numbers == (3,)
    assert session.displayed.time == pytest.approx(3.0)


@pytest.fixture
def sensor_calls(monkeypatch: pytest.MonkeyPatch) -> list[Environment]:
    """Record the map of each call of the sensor while sensed points are recomputed."""
    calls: list[Environment] = []
    get_sensor = present.get_sensor

    def record_call(environment, time):
        calls.append(environment)
        return get_sensor(environment, time)

    monkeypatch.setattr(present, "get_sensor", record_call)
    return calls


def build_session_on_another_branch() -> Session:
    session = build_long_session()
    session.undo()
    play_until_there(session)
    session.add_robot((3.0, 3.0))
    return session


def test_sensed_points_are_recomputed_from_a_limited_number_of_states(
    sensor_calls: list[Environment], monkeypatch: pytest.MonkeyPatch
) -> None:
    session = build_session_on_another_branch()
    # The other branch has 121 states: less than twice the maximum.
    monkeypatch.setattr(present, "MAX_SENSED_STATES", 100)
    session.seek(session.timeline.document.nodes[2])
    play_until_there(session)
    assert len(session.timeline.history) == 121
    assert len(sensor_calls) == 61


def test_sensed_points_are_recomputed_one_state_at_a_time(
    slow_computer: None, sensor_calls: list[Environment]
) -> None:
    """Other branches have hundreds of states, which would block a frame if they were taken together."""
    session = build_session_on_another_branch()
    session.seek(session.timeline.document.nodes[2])
    while session.timeline.is_seeking:
        before = len(sensor_calls)
        session.playback.advance(1 / 60)
        assert len(sensor_calls) - before <= 2
    assert len(sensor_calls) > 10


def test_a_saved_session_opens_at_once_and_is_recomputed_afterwards(
    slow_computer: None, tmp_path: Path
) -> None:
    session = build_long_session()
    path = tmp_path / "long.robocov"
    save_session(path, session.timeline.document, *session.timeline.destination, {})
    opened = Session.open(load_session(path), 0.0)
    opened.playback.clock.budget = 0.008
    assert opened.timeline.is_seeking
    assert opened.displayed.time == 0.0
    assert not opened.playback.is_playing
    pending = opened.timeline.pending_seek
    assert pending is not None
    assert pending.progress == pytest.approx(0.0, abs=0.05)
    assert play_until_there(opened) > 100
    assert pending.progress == 1.0
    assert opened.displayed.time == pytest.approx(3.0)
    assert opened.displayed.numbers == (3,)


def test_a_session_that_is_saved_on_its_way_keeps_its_present(slow_computer: None, tmp_path: Path) -> None:
    session = build_long_session()
    document = session.timeline.document
    expected = build_session_content(document, *session.timeline.destination, {})
    path = tmp_path / "long.robocov"
    save_session(path, document, *session.timeline.destination, {})
    opened = Session.open(load_session(path), 0.0)
    assert opened.timeline.is_seeking
    again = SessionWorkspace(opened, None).save(tmp_path, {})
    content = json.loads(again.read_text())
    assert (content["head"], content["step"]) == (expected["head"], expected["step"])


def test_the_window_shows_the_progress(slow_computer: None, tmp_path: Path) -> None:
    session = build_long_session()
    path = tmp_path / "long.robocov"
    save_session(path, session.timeline.document, *session.timeline.destination, {})
    with open_viewer(tmp_path) as driver:
        viewer = driver.viewer
        viewer.session.playback.clock.budget = 0.008
        driver.post(pygame.DROPFILE, file=str(path))
        driver.settle()
        assert viewer.session.timeline.is_seeking
        viewer.clear_message()
        driver.run_frames(1)
        during = driver.copy_frame()
        assert viewer.files.map_name == "hall"
        driver.run_frames(400)
        assert not viewer.session.timeline.is_seeking
        assert viewer.session.displayed.time == pytest.approx(3.0)
        assert not driver.shows_frame(during)
