"""The desk: what is shown, gains, limits and typed commands, without a window."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from driven_window import do, listed, typed
from hypothesis import given
from hypothesis import strategies as st
from touched_run import RAPF, RPF, all_told, begun, desk_of

from robocov.errors import InputError, ParameterError, RobocovError
from robocov_app.terminal.output import free_name
from robocov_app.viewer.costs import Costs
from robocov_app.viewer.presenter import SAID_FOR, Presenter, plain
from robocov_app.viewer.session.scenario import MOST_ROBOTS

# what is shown


def test_layers_theme_fading_and_panel_are_switched() -> None:
    desk = desk_of()
    do(desk, "layer:cells")
    do(desk, "layer:scan")
    assert desk.shown == {"robots", "scan"}
    for action, what, values in (
        ("theme", "theme", ("light", "dark")),
        ("fade", "fade", (False, True)),
        ("panel", "panel", (True, False)),
    ):
        assert getattr(desk, what) == values[0]
        do(desk, action)
        assert getattr(desk, what) == values[1]
        do(desk, action)
        assert getattr(desk, what) == values[0]


def test_messages_stay_for_a_while() -> None:
    desk = desk_of()
    desk.say("hello")
    desk.pass_time(SAID_FOR - 0.1)
    assert desk.message == "hello"
    desk.pass_time(0.2)
    assert desk.message == ""


def test_trouble_is_told_without_the_places_in_files() -> None:
    desk = desk_of()
    desk.attempt(lambda: desk.set_parameter("team.radius", -1.0))
    assert desk.trouble and desk.message.startswith("radius: ")
    assert plain("obstacles: too many") == "too many"


def test_a_new_map_is_told_to_the_cost() -> None:
    desk = desk_of()
    told = []
    desk.costs.environment = told.append  # type: ignore[method-assign]
    do(desk, "step")
    assert told == []
    desk.attempt(lambda: desk.open_map("square"))
    assert told == [desk.session.environment]


# gains and limits


def test_gains_are_of_the_chosen_pane_and_limits_of_all() -> None:
    desk = desk_of(RAPF, RPF)
    desk.active = 1
    desk.set_parameter("k_rep", 1.5)
    desk.set_parameter("team.max_speed", 0.7)
    assert [lane.law.value("k_rep") for lane in desk.session.lanes] == [RAPF.value("k_rep"), 1.5]
    assert all(lane.circumstances.limits.max_speed == 0.7 for lane in desk.session.lanes)
    names = [each.name for each in desk.parameters()]
    assert "k_att" not in names and "team.radius" in names


def test_no_limit_can_be_set_where_there_may_be_none() -> None:
    desk = desk_of()
    typed(desk, "sensing_range none")
    assert desk.lane.circumstances.limits.sensing_range == math.inf
    with pytest.raises(ParameterError, match="number was wanted"):
        typed(desk, "max_speed none")


# typed commands


@pytest.mark.parametrize("text", ["k_rep 0.5", "k_rep=0.5", " k_rep  =  0.5 ", "k_rep 0,5"])
def test_gains_can_be_typed(text: str) -> None:
    desk = desk_of()
    typed(desk, text)
    assert desk.lane.law.value("k_rep") == 0.5


def test_what_can_be_typed_is_done(tmp_path: Path) -> None:
    desk = desk_of(folder=tmp_path)
    typed(desk, "robots 4")
    typed(desk, "seed 7")
    typed(desk, "start far")
    scenario = desk.session.scenario
    assert (scenario.robots, scenario.seed, scenario.start_name) == (4, 7, "far")
    typed(desk, "controller rpf")
    assert desk.lane.law == RPF
    typed(desk, "speed max")
    assert math.isinf(desk.session.clock.speed)
    typed(desk, "speed 4×")
    assert desk.session.clock.speed == 4.0
    for _ in range(60):
        desk.session.step()
    typed(desk, "time 0.5")
    assert desk.session.time == pytest.approx(0.5)
    typed(desk, "robot 3")
    assert desk.selected == 3
    typed(desk, "branch 1")
    typed(desk, f"save {tmp_path / 'story.robocov'}")
    typed(desk, f"open {tmp_path / 'story.robocov'}")
    assert desk.message.startswith("session opened: ")
    typed(desk, "map square")
    assert desk.map_name == "square"
    words = "robots seed start controller speed time robot map open save branch"
    assert set(words.split()) == {each.name for each in listed(desk).listed if each.takes is not None}


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
    desk = desk_of()
    typed(desk, f"controller {mine}:Still")
    assert desk.laws[-1] == f"{mine}:Still" == desk.lane.law.name
    desk.session.step()
    do(desk, "law")
    assert desk.lane.law.name == desk.laws[0]


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
        f"robots {MOST_ROBOTS + 1}",
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
    desk = desk_of()
    for _ in range(3):
        desk.session.step()
    before = all_told(desk.session), desk.map_name, desk.hand.selected, list(desk.laws)
    desk.attempt(lambda: typed(desk, text))
    assert desk.trouble, text
    assert desk.message and "\n" not in desk.message and "Traceback" not in desk.message
    assert (all_told(desk.session), desk.map_name, desk.hand.selected, list(desk.laws)) == before


def test_a_slip_of_the_finger_is_answered_with_what_was_meant() -> None:
    with pytest.raises(InputError, match="robots"):
        typed(desk_of(), "robts 3")


@given(st.text(max_size=12))
def test_no_text_is_too_odd(text: str) -> None:
    desk = Presenter(begun(robots=1), Costs(2, direct=True), set(), Path(), "hall")
    try:
        typed(desk, text)
    except RobocovError as error:
        assert str(error)


# names of files


def test_names_count_on(tmp_path: Path) -> None:
    assert free_name(tmp_path, "robocov", ".png").name == "robocov-1.png"
    (tmp_path / "robocov-1.png").write_text("")
    (tmp_path / "robocov-3.png").write_text("")
    assert free_name(tmp_path, "robocov", ".png").name == "robocov-2.png"
    assert free_name(tmp_path, "rooms-12", ".json").name == "rooms-1.json"
    assert free_name(tmp_path, "2024", ".json").name == "2024-1.json"
