"""The desk: what keys, buttons and typed commands do, without a window."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from touched_run import HALL, LLOYD, RAPF, RPF, all_told, begun

from robocov.errors import InputError, ParameterError, RobocovError
from robocov.mapfile import bundled_maps, load_map
from robocov_app.demo.clock import SPEEDS
from robocov_app.demo.costs import DirectCosts
from robocov_app.demo.desk import SAID_FOR, Desk, plain
from robocov_app.demo.scenario import MOST_ROBOTS, Law
from robocov_app.demo.typed import COMMAND_WORDS
from robocov_app.output import free_name


def desk_of(*laws: Law, folder: Path = Path(), **changes) -> Desk:
    """Return a desk in the hall, paused at its beginning."""
    return Desk(begun(*laws, **changes), DirectCosts(8), {"cells", "robots"}, folder, "hall")


# playing


def test_pausing_playing_and_single_steps() -> None:
    desk = desk_of()
    desk.do("pause")
    assert desk.session.playing
    desk.do("step")
    assert not desk.session.playing and desk.session.end == pytest.approx(desk.session.scenario.dt)


def test_settling_plays_until_asked_again() -> None:
    desk = desk_of()
    desk.do("settle")
    assert desk.session.playing and desk.session.stop_when_settled
    desk.do("pause")
    assert not desk.session.playing and not desk.session.stop_when_settled
    desk.do("settle")
    desk.do("settle")
    assert desk.session.playing and not desk.session.stop_when_settled


def test_speeds_go_by_steps_and_stop_at_both_ends() -> None:
    desk = desk_of()
    seen = [desk.session.clock.speed]
    for _ in SPEEDS:
        desk.do("faster")
        seen.append(desk.session.clock.speed)
    assert seen[:2] == [1.0, 2.0] and seen[-2:] == [math.inf, math.inf]
    assert desk.message == "speed max"
    for _ in SPEEDS:
        desk.do("slower")
    assert desk.session.clock.speed == SPEEDS[0]


def test_a_typed_speed_between_the_steps_goes_on_to_the_next_of_them() -> None:
    desk = desk_of()
    desk.command("speed 3.3")
    assert desk.session.clock.speed == 3.3
    desk.do("faster")
    assert desk.session.clock.speed == 8.0


def test_restarting_keeps_controller_and_gains() -> None:
    desk = desk_of()
    desk.command("k_rep 2")
    desk.do("step")
    desk.do("restart")
    assert desk.session.end == 0.0 and desk.lane.law.value("k_rep") == 2.0


def test_another_seed_gives_other_starts_and_another_start_too() -> None:
    desk = desk_of()
    places = [desk.session.positions(desk.lane).copy()]
    for action in ("seed", "start", "start"):
        desk.do(action)
        places.append(desk.session.positions(desk.lane).copy())
        assert not np.allclose(places[-1], places[-2])
    assert desk.session.scenario.start_name == "spread"
    for _ in range(2):
        desk.do("start")
    assert desk.session.scenario.start_name == "corner"


def test_a_start_that_an_obstacle_has_covered_is_still_named_and_left_by_going_on() -> None:
    desk = desk_of(start="far")
    desk.tools["circle"].press(desk.session, (5.2, 3.2), 0.1, None)
    desk.attempt(lambda: desk.tools["circle"].release(desk.session, (5.2, 3.75)))
    assert desk.message.endswith("it covers the start far") and "far" not in desk.starts()
    assert desk.session.scenario.start_name == "far"
    desk.do("start")
    assert not desk.trouble and desk.session.scenario.start_name == "corner"


def test_more_and_fewer_robots() -> None:
    desk = desk_of(robots=2)
    desk.do("more")
    assert desk.session.scenario.robots == 3 and len(desk.session.numbers) == 3
    for _ in range(3):
        desk.do("fewer")
    assert desk.session.scenario.robots == 1 and desk.trouble
    assert desk.message == f"robots: 0, but a whole number from 1 to {MOST_ROBOTS} was wanted"


def test_robots_without_room_are_told_and_nothing_changes() -> None:
    desk = desk_of()
    before = all_told(desk.session)
    desk.attempt(lambda: desk.command("robots 900"))
    assert desk.trouble and "room" in desk.message
    assert all_told(desk.session) == before


# maps


def test_maps_are_turned_through_both_ways() -> None:
    desk = desk_of()
    desk.command("map rooms")
    names = list(bundled_maps())
    desk.do("map:next")
    assert desk.map_name == names[names.index("rooms") + 1] and desk.session.environment.name != HALL.name
    desk.do("map:previous")
    assert desk.map_name == "rooms" and desk.session.scenario.start_name == "corridor"


def test_a_map_that_is_no_map_is_told_and_the_old_one_stays(tmp_path: Path) -> None:
    desk = desk_of()
    (tmp_path / "x.json").write_text("{")
    for name in ("nowhere", str(tmp_path / "x.json"), str(tmp_path)):
        desk.attempt(lambda name=name: desk.open_map(name))
        assert desk.trouble and desk.message and desk.map_name == "hall"
        assert desk.session.environment is HALL
        desk.trouble = False


def test_an_own_map_is_offered_beside_the_bundled_ones() -> None:
    desk = desk_of()
    assert desk.maps() == [*bundled_maps(), "hall"]
    desk.command("map square")
    assert desk.maps() == list(bundled_maps())


def test_a_saved_map_can_be_opened_and_has_what_was_drawn(tmp_path: Path) -> None:
    desk = desk_of(folder=tmp_path)
    desk.tools["circle"].press(desk.session, (1.0, 3.0), 0.1, None)
    desk.attempt(lambda: desk.tools["circle"].release(desk.session, (1.3, 3.0)))
    assert desk.message.startswith("circle drawn")
    desk.do("save:map")
    first = tmp_path / "hall-1.json"
    assert desk.message == f"map saved: {first}" and desk.map_name == str(first)
    assert load_map(str(first)).obstacles == desk.session.environment.obstacles
    desk.do("save:map")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["hall-1.json", "hall-2.json"]


def test_a_folder_that_cannot_be_written_to_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    desk = desk_of(folder=tmp_path / "file")
    desk.do("save:map")
    assert desk.trouble and desk.map_name == "hall"


# time


def test_looking_back_and_forth() -> None:
    desk = desk_of()
    for _ in range(120):
        desk.do("step")
    session = desk.session
    desk.do("back")
    assert session.time == pytest.approx(119 / 60) and not session.live
    desk.do("back:second")
    assert session.time == pytest.approx(59 / 60, abs=1e-6)
    desk.do("forward:second")
    desk.do("forward")
    assert session.live
    desk.do("first")
    assert session.time == 0.0
    desk.do("live")
    assert session.live and session.time == pytest.approx(2.0)


def test_branching_goes_on_from_the_past_and_at_the_present_says_how() -> None:
    desk = desk_of()
    for _ in range(30):
        desk.do("step")
    desk.do("branch")
    assert "go back first" in desk.message and not desk.session.playing
    desk.do("first")
    desk.do("branch")
    assert desk.session.playing and desk.session.end == 0.0 and "ghost" in desk.message


# panes


def test_panes_come_with_controllers_that_are_not_there_yet_and_go() -> None:
    desk = desk_of(RPF)
    for count in (2, 3, 4):
        desk.do("pane:add")
        assert len(desk.session.lanes) == count and desk.active == count - 1
    names = [lane.law.name for lane in desk.session.lanes]
    assert names[0] == "rpf" and len(set(names)) == 4
    desk.do("pane:add")
    assert desk.trouble and "4" in desk.message
    desk.do("pane:next")
    assert desk.active == 0
    for count in (3, 2, 1):
        desk.do("pane:remove")
        assert len(desk.session.lanes) == count
    desk.trouble = False
    desk.do("pane:remove")
    assert desk.trouble and len(desk.session.lanes) == 1


def test_the_chosen_pane_is_one_that_there_is() -> None:
    desk = desk_of(RAPF, RPF)
    desk.active = 1
    desk.session.remove_pane(desk.session.lanes[1])
    assert desk.lane is desk.session.lanes[0] and desk.active == 0


def test_controllers_take_turns() -> None:
    desk = desk_of()
    seen = []
    for _ in range(len(desk.laws)):
        seen.append(desk.lane.law.name)
        desk.do("law")
    assert sorted(seen) == sorted(desk.laws) and desk.lane.law.name == seen[0]


def test_choosing_the_controller_that_is_there_keeps_its_gains() -> None:
    desk = desk_of(RAPF, RPF)
    desk.command("k_rep 2")
    desk.set_law(0, "rapf")
    assert desk.session.lanes[0].law.value("k_rep") == 2.0
    desk.set_law(1, "lloyd")
    assert desk.active == 1 and desk.lane.law == LLOYD


# robots


def test_asking_goes_round_all_robots_also_those_that_failed() -> None:
    desk = desk_of()
    desk.session.fail_robot(2)
    seen = []
    for _ in range(4):
        desk.do("robot:next")
        seen.append(desk.selected)
    assert seen == [1, 2, 3, 1]
    desk.do("robot:previous")
    assert desk.selected == 3


def test_failing_reviving_and_removing_need_a_robot_that_is_asked() -> None:
    desk = desk_of()
    for action in ("robot:fail", "robot:remove"):
        desk.trouble = False
        desk.do(action)
        assert desk.trouble and "no robot is chosen" in desk.message
    desk.hand.selected = 2
    desk.do("robot:fail")
    assert desk.session.numbers == (1, 3) and desk.selected == 2
    desk.do("robot:fail")
    assert desk.session.numbers == (1, 2, 3)
    desk.do("robot:remove")
    assert desk.session.numbers == (1, 3) and desk.selected is None


def test_undo_and_redo_say_what_they_did() -> None:
    desk = desk_of()
    desk.do("undo")
    assert desk.message == "nothing to undo"
    desk.do("redo")
    assert desk.message == "nothing to redo"
    desk.session.add_robot((5.0, 3.0))
    desk.do("undo")
    assert desk.message == "undone: robot 4" and desk.session.numbers == (1, 2, 3)
    desk.do("redo")
    assert desk.message == "done again: robot 4" and desk.session.numbers == (1, 2, 3, 4)


# tools


def test_another_tool_gives_up_what_was_begun_and_says_how_it_works() -> None:
    desk = desk_of()
    desk.do("tool:polygon")
    assert desk.message == f"Polygon: {desk.tool.hint}"
    desk.tool.press(desk.session, (1.0, 3.0), 0.1, None)
    assert desk.tool.preview(desk.session) is not None
    desk.do("tool:wall")
    assert desk.tools["polygon"].preview(desk.session) is None
    desk.do("cancel")
    assert desk.tool is desk.hand


def test_cancelling_first_gives_up_then_puts_the_tool_away() -> None:
    desk = desk_of()
    desk.do("tool:wall")
    desk.tool.press(desk.session, (1.0, 3.0), 0.1, None)
    desk.do("cancel")
    assert desk.tool.name == "wall" and desk.tool.preview(desk.session) is None
    desk.do("cancel")
    assert desk.tool is desk.hand


def test_walls_become_wider_and_narrower() -> None:
    desk = desk_of()
    desk.do("wider")
    assert desk.message == "walls are 0.125 m wide"
    desk.do("narrower")
    assert desk.message == "walls are 0.1 m wide"


# what is shown


def test_layers_theme_fading_and_panel_are_switched() -> None:
    desk = desk_of()
    desk.do("layer:cells")
    desk.do("layer:scan")
    assert desk.shown == {"robots", "scan"}
    for action, what, values in (
        ("theme", "theme", ("light", "dark")),
        ("fade", "fade", (False, True)),
        ("panel", "panel", (True, False)),
    ):
        assert getattr(desk, what) == values[0]
        desk.do(action)
        assert getattr(desk, what) == values[1]
        desk.do(action)
        assert getattr(desk, what) == values[0]


def test_what_the_desk_does_not_know_is_left_to_the_window() -> None:
    desk = desk_of()
    version = desk.version
    assert not desk.do("fullscreen") and desk.version == version
    assert desk.do("pause") and desk.version > version


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
    desk.do("step")
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
    desk.command("sensing_range none")
    assert desk.lane.circumstances.limits.sensing_range == math.inf
    with pytest.raises(ParameterError, match="number was wanted"):
        desk.command("max_speed none")


# typed commands


@pytest.mark.parametrize("text", ["k_rep 0.5", "k_rep=0.5", " k_rep  =  0.5 ", "k_rep 0,5"])
def test_gains_can_be_typed(text: str) -> None:
    desk = desk_of()
    desk.command(text)
    assert desk.lane.law.value("k_rep") == 0.5


def test_what_can_be_typed_is_done() -> None:
    desk = desk_of()
    desk.command("robots 4")
    desk.command("seed 7")
    desk.command("start far")
    scenario = desk.session.scenario
    assert (scenario.robots, scenario.seed, scenario.start_name) == (4, 7, "far")
    desk.command("controller rpf")
    assert desk.lane.law == RPF
    desk.command("speed max")
    assert math.isinf(desk.session.clock.speed)
    desk.command("speed 4×")
    assert desk.session.clock.speed == 4.0
    for _ in range(60):
        desk.session.step()
    desk.command("time 0.5")
    assert desk.session.time == pytest.approx(0.5)
    desk.command("robot 3")
    assert desk.selected == 3
    desk.command("map square")
    assert desk.map_name == "square"
    assert {"robots", "seed", "start", "controller", "speed", "time", "robot", "map"} == set(COMMAND_WORDS)


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
    desk.command(f"controller {mine}:Still")
    assert desk.laws[-1] == f"{mine}:Still" == desk.lane.law.name
    desk.session.step()
    desk.do("law")
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
    desk.attempt(lambda: desk.command(text))
    assert desk.trouble, text
    assert desk.message and "\n" not in desk.message and "Traceback" not in desk.message
    assert (all_told(desk.session), desk.map_name, desk.hand.selected, list(desk.laws)) == before


def test_a_slip_of_the_finger_is_answered_with_what_was_meant() -> None:
    with pytest.raises(InputError, match="robots"):
        desk_of().command("robts 3")


@given(st.text(max_size=12))
def test_no_text_is_too_odd(text: str) -> None:
    desk = Desk(begun(robots=1), DirectCosts(2), set(), Path(), "hall")
    try:
        desk.command(text)
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
