"""The desk: what is shown, gains, limits and typed commands, without a window."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from driven_window import do, listed, typed
from hypothesis import given
from hypothesis import strategies as st
from sample_sessions import RAPF, RPF, build_presenter, describe_state, start_session

from robocov.errors import InputError, ParameterError, RobocovError
from robocov_app.terminal.output import find_free_path
from robocov_app.toolkit.window_model import MESSAGE_S
from robocov_app.viewer.costs import Costs
from robocov_app.viewer.model import simplify_message
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.session.scenario import MAX_ROBOTS

# what is shown


def test_layers_theme_fading_and_panel_are_switched() -> None:
    viewer = build_presenter()
    do(viewer, "layer:cells")
    do(viewer, "layer:scan")
    assert viewer.view.layers == {"robots", "scan"}
    for action, what, values in (
        ("theme", "theme", ("light", "dark")),
        ("fade", "fades_trajectories", (False, True)),
        ("panel", "has_panel", (True, False)),
    ):
        assert getattr(viewer.view, what) == values[0]
        do(viewer, action)
        assert getattr(viewer.view, what) == values[1]
        do(viewer, action)
        assert getattr(viewer.view, what) == values[0]


def test_messages_stay_for_a_while() -> None:
    viewer = build_presenter()
    viewer.show_message("hello")
    viewer.pass_time(MESSAGE_S - 0.1)
    assert viewer.message == "hello"
    viewer.pass_time(0.2)
    assert viewer.message == ""


def test_trouble_is_told_without_the_places_in_files() -> None:
    viewer = build_presenter()
    viewer.attempt(lambda: viewer.comparison.set_parameter("team.radius", -1.0))
    assert viewer.has_error_message and viewer.message.startswith("radius: ")
    assert simplify_message("obstacles: too many") == "too many"


def test_a_new_map_is_told_to_the_cost() -> None:
    viewer = build_presenter()
    told = []
    viewer.costs.set_environment = told.append  # type: ignore[method-assign]
    do(viewer, "step")
    assert told == []
    viewer.attempt(lambda: viewer.files.open_map("square"))
    assert told == [viewer.session.displayed.environment]


# gains and limits


def test_gains_are_of_the_chosen_pane_and_limits_of_all() -> None:
    viewer = build_presenter(RAPF, RPF)
    viewer.inspection.active_pane = 1
    viewer.comparison.set_parameter("k_rep", 1.5)
    viewer.comparison.set_parameter("team.max_speed", 0.7)
    assert [pane.controller.get_value("k_rep") for pane in viewer.session.timeline.panes] == [
        RAPF.get_value("k_rep"),
        1.5,
    ]
    assert all(pane.setup.properties.max_speed == 0.7 for pane in viewer.session.timeline.panes)
    names = [each.name for each in viewer.comparison.list_parameters()]
    assert "k_att" not in names and "team.radius" in names


def test_no_limit_can_be_set_where_there_may_be_none() -> None:
    viewer = build_presenter()
    typed(viewer, "sensing_range none")
    assert viewer.pane.setup.properties.sensing_range == math.inf
    with pytest.raises(ParameterError, match="expected a number"):
        typed(viewer, "max_speed none")


# typed commands


@pytest.mark.parametrize("text", ["k_rep 0.5", "k_rep=0.5", " k_rep  =  0.5 ", "k_rep 0,5"])
def test_gains_can_be_typed(text: str) -> None:
    viewer = build_presenter()
    typed(viewer, text)
    assert viewer.pane.controller.get_value("k_rep") == 0.5


def test_what_can_be_typed_is_done(tmp_path: Path) -> None:
    viewer = build_presenter(folder=tmp_path)
    typed(viewer, "robots 4")
    typed(viewer, "seed 7")
    typed(viewer, "start far")
    scenario = viewer.session.timeline.scenario
    assert (scenario.robots, scenario.seed, scenario.start_name) == (4, 7, "far")
    typed(viewer, "controller rpf")
    assert viewer.pane.controller == RPF
    typed(viewer, "speed max")
    assert math.isinf(viewer.session.playback.clock.speed)
    typed(viewer, "speed 4×")
    assert viewer.session.playback.clock.speed == 4.0
    for _ in range(60):
        viewer.session.playback.step()
    typed(viewer, "time 0.5")
    assert viewer.session.displayed.time == pytest.approx(0.5)
    typed(viewer, "robot 3")
    assert viewer.selected_robot == 3
    typed(viewer, "branch 1")
    typed(viewer, f"save {tmp_path / 'story.robocov'}")
    typed(viewer, f"open {tmp_path / 'story.robocov'}")
    assert viewer.message.startswith("session opened: ")
    typed(viewer, "map square")
    assert viewer.files.map_name == "square"
    words = "robots seed start controller speed time robot map open save branch"
    assert set(words.split()) == {each.name for each in listed(viewer).commands if each.argument is not None}


def test_an_own_controller_can_be_typed_and_is_offered_from_then_on(tmp_path: Path) -> None:
    mine = tmp_path / "mine.py"
    mine.write_text(
        "import numpy as np\n"
        "from dataclasses import dataclass\n"
        "@dataclass(frozen=True)\n"
        "class Still:\n"
        "    def force(self, own):\n"
        "        return np.zeros(2)\n"
    )
    viewer = build_presenter()
    typed(viewer, f"controller {mine}:Still")
    assert viewer.controllers[-1] == f"{mine}:Still" == viewer.pane.controller.name
    viewer.session.playback.step()
    do(viewer, "controller:next")
    assert viewer.pane.controller.name == viewer.controllers[0]


@pytest.mark.parametrize(
    "text",
    [
        "",
        "   ",
        "fly",
        "fly 3",
        "robots",
        "robots many",
        "robots 1.5",
        "robots -3",
        f"robots {MAX_ROBOTS + 1}",
        "seed -1",
        "seed x",
        "start nowhere",
        "start",
        "map",
        "map nowhere.json",
        "map a\0b",
        "map /",
        "map " + 5000 * "x",
        "speed",
        "speed 0",
        "speed -2",
        "speed nan",
        "speed 1e9",
        "controller",
        "controller nobody",
        "controller nothing.py:None",
        "controller /:x",
        "time",
        "time soon",
        "time -1",
        "time inf",
        "robot",
        "robot one",
        "robot 99",
        "k_rep",
        "k_rep -1",
        "k_rep nan",
        "k_rep inf",
        "k_rep 1e400",
        "radius 0",
        "radius 50",
        "max_speed -1",
    ],
)
def test_what_means_nothing_is_told_in_a_line_and_changes_nothing(text: str) -> None:
    viewer = build_presenter()
    for _ in range(3):
        viewer.session.playback.step()
    before = (
        describe_state(viewer.session),
        viewer.files.map_name,
        viewer.inspection.selected,
        list(viewer.controllers),
    )
    viewer.attempt(lambda: typed(viewer, text))
    assert viewer.has_error_message, text
    assert viewer.message and "\n" not in viewer.message and "Traceback" not in viewer.message
    assert (
        describe_state(viewer.session),
        viewer.files.map_name,
        viewer.inspection.selected,
        list(viewer.controllers),
    ) == before


def test_a_slip_of_the_finger_is_answered_with_what_was_meant() -> None:
    with pytest.raises(InputError, match="robots"):
        typed(build_presenter(), "robts 3")


@given(st.text(max_size=12))
def test_no_text_is_too_odd(text: str) -> None:
    viewer = Presenter(start_session(robots=1), Costs(2, direct=True), set(), Path(), "hall")
    try:
        typed(viewer, text)
    except RobocovError as error:
        assert str(error)


# names of files


def test_names_count_on(tmp_path: Path) -> None:
    assert find_free_path(tmp_path, "robocov", ".png").name == "robocov-1.png"
    (tmp_path / "robocov-1.png").write_text("")
    (tmp_path / "robocov-3.png").write_text("")
    assert find_free_path(tmp_path, "robocov", ".png").name == "robocov-2.png"
    assert find_free_path(tmp_path, "rooms-12", ".json").name == "rooms-1.json"
    assert find_free_path(tmp_path, "2024", ".json").name == "2024-1.json"
