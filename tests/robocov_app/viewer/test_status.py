"""Texts of the status line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from robocov.mapfile import load_map
from robocov_app.viewer.costs.costs import Costs
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice
from robocov_app.viewer.session.setup.scenario import SessionScenario
from robocov_app.viewer.window.session_runner import SessionRunner
from robocov_app.viewer.window.status import describe_cursor, list_facts


@pytest.fixture
def viewer() -> Presenter:
    session = Session(SessionScenario(load_map("rooms")))
    viewer = Presenter(session, Costs(32, direct=True), set(), Path(), "rooms")
    viewer.costs.request(0, 0.0, session.timeline.panes[0].simulation.positions)
    viewer.costs.poll()
    return viewer


def test_the_status_line_contains_time_cost_and_speed(viewer: Presenter) -> None:
    facts = list_facts(viewer, 60.0, 60.0, None)
    assert facts[0] == "t = 0.00 s"
    assert facts[1].startswith("cost ")
    assert facts[1].endswith(" m³")
    assert facts[-3:] == ["1×", "60 steps/s", "60 fps"]
    viewer.session.playback.is_playing = False
    assert list_facts(viewer, 60.0, 60.0, None)[-2:] == ["1×", "60 fps"], "no step is made while it is paused"


def test_the_cost_in_the_status_line_names_its_controller_if_there_are_several(viewer: Presenter) -> None:
    viewer.session.add_pane(ControllerChoice("lloyd"))
    assert list_facts(viewer, 60.0, 60.0, None)[1].startswith("RAPF: cost ")


def test_an_old_cost_is_shown_with_its_time(viewer: Presenter) -> None:
    for _ in range(60):
        viewer.session.playback.step()
    assert list_facts(viewer, 60.0, 60.0, None)[1].endswith("(at 0.0 s)")


def test_the_status_line_contains_pauses_videos_and_delays(viewer: Presenter) -> None:
    viewer.session.playback.is_playing = False
    facts = list_facts(viewer, 60.0, 0.0, 12.4)
    assert facts[0].startswith("Paused · ")
    assert "● video 12 s" in facts
    viewer.session.playback.is_playing = True
    viewer.session.playback.clock.is_behind = True
    assert "1× (running at 0.5×)" in list_facts(viewer, 60.0, 30.0, None)
    viewer.session.playback.is_suspended = True
    assert "1×" in list_facts(viewer, 60.0, 0.0, None), "an open list is no delay"


def test_the_status_line_says_that_a_simulation_is_slow_while_kernels_are_compiled(
    viewer: Presenter, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("robocov_app.viewer.window.status.is_compiling_in_background", lambda: True)
    viewer.session.playback.is_playing = True
    assert "1×" in list_facts(viewer, 60.0, 60.0, None)
    viewer.session.playback.clock.is_behind = True
    assert "1× (running at 0.5× while compiling)" in list_facts(viewer, 60.0, 30.0, None)


def test_an_open_list_does_not_change_the_measured_rate(viewer: Presenter) -> None:
    runner = SessionRunner(viewer)
    viewer.session.playback.is_playing = True
    for _ in range(50):
        runner.advance(1 / 60, 1)
    rate = runner.step_rate
    assert rate > 30.0
    viewer.session.playback.is_suspended = True
    for _ in range(50):
        runner.advance(1 / 60, 1)
    assert runner.step_rate == rate


def test_the_cursor_is_described_by_robot_and_distance(viewer: Presenter) -> None:
    x, y = viewer.session.timeline.panes[0].simulation.positions[3] + np.array([0.1, 0.05])
    viewer.inspection.cursor = float(x), float(y)
    text = describe_cursor(viewer)
    assert text.startswith(f"({x:.2f}, {y:.2f}) m, ")
    assert text.endswith(" m from robot 4")


def test_the_cursor_in_a_wall_or_outside_is_described(viewer: Presenter) -> None:
    viewer.inspection.cursor = 1.0, 8.5  # in the obstacle in the upper left corner
    assert describe_cursor(viewer).endswith(", inside an obstacle")
    viewer.inspection.cursor = -3.0, -3.0
    assert describe_cursor(viewer).endswith(", outside the map")
    viewer.inspection.cursor = None
    assert describe_cursor(viewer) == ""


def test_cut_off_rooms_are_reported() -> None:
    from robocov.environment import Environment, WallObstacle

    closed = Environment("two", ((0, 0), (4, 0), (4, 2), (0, 2)), (WallObstacle(((2, 0), (2, 2)), 0.1),))
    session = Session(SessionScenario(closed, robots=1, given_starts=np.array([[1.0, 1.0]])))
    viewer = Presenter(session, Costs(32, direct=True), set(), Path(), "two")
    viewer.costs.request(0, 0.0, session.timeline.panes[0].simulation.positions)
    viewer.costs.poll()
    viewer.inspection.cursor = 3.0, 1.0
    assert describe_cursor(viewer).endswith(", out of reach of all robots")
    assert any(fact.startswith("cut off ") for fact in list_facts(viewer, 60.0, 60.0, None))
