"""Commands of the presenter, without a window: layers, messages, gains, limits and typed commands."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from driven_window import build_command_table, run_command, run_text
from hypothesis import given
from hypothesis import strategies as st
from sample_sessions import RAPF, RPF, build_presenter, describe_state, start_session

from robocov.errors import InputError, ParameterError, RobocovError
from robocov_app.terminal.output import find_free_path
from robocov_app.toolkit.window.window_model import MESSAGE_S
from robocov_app.viewer.costs.costs import Costs
from robocov_app.viewer.model import simplify_message
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.session.setup.scenario import MAX_ROBOTS

# layers and messages


def test_commands_toggle_layers_theme_fading_and_panel() -> None:
    viewer = build_presenter()
    run_command(viewer, "layer:cells")
    run_command(viewer, "layer:scan")
    assert viewer.view.layers == {"robots", "scan"}
    for command, attribute, (before, after) in (
        ("theme", "theme", ("light", "dark")),
        ("fade", "fades_trajectories", (False, True)),
        ("panel", "has_panel", (True, False)),
    ):
        assert getattr(viewer.view, attribute) == before
        run_command(viewer, command)
        assert getattr(viewer.view, attribute) == after
        run_command(viewer, command)
        assert getattr(viewer.view, attribute) == before


def test_messages_disappear_after_a_while() -> None:
    viewer = build_presenter()
    viewer.show_message("hello")
    viewer.pass_time(MESSAGE_S - 0.1)
    assert viewer.message == "Hello"
    viewer.pass_time(0.2)
    assert viewer.message == ""


def test_errors_are_shown_without_paths_in_files() -> None:
    viewer = build_presenter()
    viewer.attempt(lambda: viewer.comparison.set_parameter("team.radius", -1.0))
    assert viewer.has_error_message
    assert viewer.message.startswith("Radius: ")
    assert simplify_message("obstacles: too many") == "too many"


def test_a_new_map_is_passed_to_the_costs() -> None:
    viewer = build_presenter()
    maps = []
    viewer.costs.set_environment = lambda environment, _radius: maps.append(environment)  # type: ignore[method-assign]
    run_command(viewer, "step")
    assert maps == []
    viewer.attempt(lambda: viewer.files.open_map("square"))
    assert maps == [viewer.session.displayed.environment]


# gains and limits


def test_gains_apply_to_the_active_pane_and_limits_to_all() -> None:
    viewer = build_presenter(RAPF, RPF)
    viewer.inspection.active_pane = 1
    viewer.comparison.set_parameter("k_rep", 1.5)
    viewer.comparison.set_parameter("team.max_speed", 0.7)
    first, second = viewer.session.timeline.panes
    assert first.controller.get_value("k_rep") == RAPF.get_value("k_rep")
    assert second.controller.get_value("k_rep") == 1.5
    for pane in (first, second):
        assert pane.setup.properties.max_speed == 0.7
    names = [parameter.name for parameter in viewer.comparison.list_parameters()]
    assert "k_att" not in names
    assert "team.radius" in names


def test_no_limit_is_accepted_for_optional_limits_only() -> None:
    viewer = build_presenter()
    run_text(viewer, "sensing_range none")
    assert viewer.pane.setup.properties.sensing_range == math.inf
    with pytest.raises(ParameterError, match="expected a number"):
        run_text(viewer, "max_speed none")


# typed commands


@pytest.mark.parametrize("text", ["k_rep 0.5", "k_rep=0.5", " k_rep  =  0.5 ", "k_rep 0,5"])
def test_gains_are_typed(text: str) -> None:
    viewer = build_presenter()
    run_text(viewer, text)
    assert viewer.pane.controller.get_value("k_rep") == 0.5


def test_typed_commands_run(tmp_path: Path) -> None:
    viewer = build_presenter(folder=tmp_path)
    run_text(viewer, "robots 4")
    run_text(viewer, "seed 7")
    run_text(viewer, "start far")
    scenario = viewer.session.timeline.scenario
    assert (scenario.robots, scenario.seed, scenario.start_name) == (4, 7, "far")
    run_text(viewer, "controller rpf")
    assert viewer.pane.controller == RPF
    run_text(viewer, "speed max")
    assert math.isinf(viewer.session.playback.clock.speed)
    run_text(viewer, "speed 4×")
    assert viewer.session.playback.clock.speed == 4.0
    for _ in range(60):
        viewer.session.playback.step()
    run_text(viewer, "time 0.5")
    assert viewer.session.displayed.time == pytest.approx(0.5)
    run_text(viewer, "robot 3")
    assert viewer.selected_robot == 3
    run_text(viewer, "branch 1")
    run_text(viewer, f"save {tmp_path / 'session.robocov'}")
    run_text(viewer, f"open {tmp_path / 'session.robocov'}")
    assert viewer.message.startswith("Session opened: ")
    run_text(viewer, "map square")
    assert viewer.files.map_name == "square"
    commands = build_command_table(viewer).commands
    names = {command.name for command in commands if command.argument is not None}
    assert names == set("robots seed start controller speed time robot map open save branch".split())


def test_a_typed_user_controller_is_offered_afterwards(tmp_path: Path) -> None:
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
    run_text(viewer, f"controller {mine}:Still")
    assert viewer.controllers[-1] == f"{mine}:Still" == viewer.pane.controller.name
    viewer.session.playback.step()
    run_command(viewer, "controller:next")
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
def test_invalid_commands_are_reported_in_one_line_and_change_nothing(text: str) -> None:
    viewer = build_presenter()
    for _ in range(3):
        viewer.session.playback.step()
    before = (
        describe_state(viewer.session),
        viewer.files.map_name,
        viewer.inspection.selected,
        list(viewer.controllers),
    )
    viewer.attempt(lambda: run_text(viewer, text))
    assert viewer.has_error_message, text
    assert viewer.message
    assert "\n" not in viewer.message
    assert "Traceback" not in viewer.message
    assert (
        describe_state(viewer.session),
        viewer.files.map_name,
        viewer.inspection.selected,
        list(viewer.controllers),
    ) == before


def test_a_speed_that_is_too_small_is_answered_with_the_limits() -> None:
    with pytest.raises(ParameterError, match=r"speed: expected a number from 0.01 to 1000, got '0.001'"):
        run_text(build_presenter(), "speed 0.001")


def test_a_misspelled_command_is_answered_with_the_nearest_name() -> None:
    with pytest.raises(InputError, match="robots"):
        run_text(build_presenter(), "robts 3")


@given(st.text(max_size=12))
def test_any_text_is_run_or_rejected(text: str) -> None:
    viewer = Presenter(start_session(robots=1), Costs(2, direct=True), set(), Path(), "hall")
    try:
        run_text(viewer, text)
    except RobocovError as error:
        assert str(error)


# file names


def test_free_file_names_are_numbered(tmp_path: Path) -> None:
    assert find_free_path(tmp_path, "robocov", ".png").name == "robocov-1.png"
    (tmp_path / "robocov-1.png").write_text("")
    (tmp_path / "robocov-3.png").write_text("")
    assert find_free_path(tmp_path, "robocov", ".png").name == "robocov-2.png"
    assert find_free_path(tmp_path, "rooms-12", ".json").name == "rooms-1.json"
    assert find_free_path(tmp_path, "2024", ".json").name == "2024-1.json"
