"""The desk: what keys, buttons and typed commands do, without a window."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from driven_window import do, typed
from touched_run import HALL, LLOYD, RAPF, RPF, all_told, desk_of

from robocov.mapfile import bundled_maps, load_map
from robocov_app.viewer.session.clock import SPEEDS
from robocov_app.viewer.session.scenario import MOST_ROBOTS

# playing


def test_pausing_playing_and_single_steps() -> None:
    desk = desk_of()
    do(desk, "pause")
    assert desk.session.playing
    do(desk, "step")
    assert not desk.session.playing and desk.session.end == pytest.approx(desk.session.scenario.dt)


def test_settling_plays_until_asked_again() -> None:
    desk = desk_of()
    do(desk, "settle")
    assert desk.session.playing and desk.session.stop_when_settled
    do(desk, "pause")
    assert not desk.session.playing and not desk.session.stop_when_settled
    do(desk, "settle")
    do(desk, "settle")
    assert desk.session.playing and not desk.session.stop_when_settled


def test_speeds_go_by_steps_and_stop_at_both_ends() -> None:
    desk = desk_of()
    seen = [desk.session.clock.speed]
    for _ in SPEEDS:
        do(desk, "faster")
        seen.append(desk.session.clock.speed)
    assert seen[:2] == [1.0, 2.0] and seen[-2:] == [math.inf, math.inf]
    assert desk.message == "speed max"
    for _ in SPEEDS:
        do(desk, "slower")
    assert desk.session.clock.speed == SPEEDS[0]


def test_a_typed_speed_between_the_steps_goes_on_to_the_next_of_them() -> None:
    desk = desk_of()
    typed(desk, "speed 3.3")
    assert desk.session.clock.speed == 3.3
    do(desk, "faster")
    assert desk.session.clock.speed == 8.0


def test_restarting_keeps_controller_and_gains() -> None:
    desk = desk_of()
    typed(desk, "k_rep 2")
    do(desk, "step")
    do(desk, "restart")
    assert desk.session.end == 0.0 and desk.lane.law.value("k_rep") == 2.0


def test_another_seed_gives_other_starts_and_another_start_too() -> None:
    desk = desk_of()
    places = [desk.session.positions(desk.lane).copy()]
    for action in ("seed:next", "start:next", "start:next"):
        do(desk, action)
        places.append(desk.session.positions(desk.lane).copy())
        assert not np.allclose(places[-1], places[-2])
    assert desk.session.scenario.start_name == "spread"
    for _ in range(2):
        do(desk, "start:next")
    assert desk.session.scenario.start_name == "corner"


def test_a_start_that_an_obstacle_has_covered_is_still_named_and_left_by_going_on() -> None:
    desk = desk_of(start="far")
    desk.tools["circle"].press(desk.session, (5.2, 3.2), 0.1, None)
    desk.attempt(lambda: desk.tools["circle"].release(desk.session, (5.2, 3.75)))
    assert desk.message.endswith("it covers the start far") and "far" not in desk.starts()
    assert desk.session.scenario.start_name == "far"
    do(desk, "start:next")
    assert not desk.trouble and desk.session.scenario.start_name == "corner"


def test_more_and_fewer_robots() -> None:
    desk = desk_of(robots=2)
    do(desk, "more")
    assert desk.session.scenario.robots == 3 and len(desk.session.numbers) == 3
    for _ in range(3):
        do(desk, "fewer")
    assert desk.session.scenario.robots == 1 and desk.trouble
    assert desk.message == f"robots: 0, but a whole number from 1 to {MOST_ROBOTS} was wanted"


def test_robots_without_room_are_told_and_nothing_changes() -> None:
    desk = desk_of()
    before = all_told(desk.session)
    desk.attempt(lambda: typed(desk, "robots 900"))
    assert desk.trouble and "room" in desk.message
    assert all_told(desk.session) == before


# maps


def test_maps_are_turned_through_both_ways() -> None:
    desk = desk_of()
    typed(desk, "map rooms")
    names = list(bundled_maps())
    do(desk, "map:next")
    assert desk.map_name == names[names.index("rooms") + 1] and desk.session.environment.name != HALL.name
    do(desk, "map:previous")
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
    typed(desk, "map square")
    assert desk.maps() == list(bundled_maps())


def test_a_saved_map_can_be_opened_and_has_what_was_drawn(tmp_path: Path) -> None:
    desk = desk_of(folder=tmp_path)
    desk.tools["circle"].press(desk.session, (1.0, 3.0), 0.1, None)
    desk.attempt(lambda: desk.tools["circle"].release(desk.session, (1.3, 3.0)))
    assert desk.message.startswith("circle drawn")
    do(desk, "save:map")
    first = tmp_path / "hall-1.json"
    assert desk.message == f"map saved: {first}" and desk.map_name == str(first)
    assert load_map(str(first)).obstacles == desk.session.environment.obstacles
    do(desk, "save:map")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["hall-1.json", "hall-2.json"]


def test_a_folder_that_cannot_be_written_to_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    desk = desk_of(folder=tmp_path / "file")
    do(desk, "save:map")
    assert desk.trouble and desk.map_name == "hall"


# time


def test_looking_back_and_forth() -> None:
    desk = desk_of()
    for _ in range(120):
        do(desk, "step")
    session = desk.session
    do(desk, "back")
    assert session.time == pytest.approx(119 / 60) and not session.live
    do(desk, "back:second")
    assert session.time == pytest.approx(59 / 60, abs=1e-6)
    do(desk, "forward:second")
    do(desk, "forward")
    assert session.live
    do(desk, "first")
    assert session.time == 0.0
    do(desk, "live")
    assert session.live and session.time == pytest.approx(2.0)


def test_branching_goes_on_from_the_past_and_at_the_present_says_how() -> None:
    desk = desk_of()
    for _ in range(30):
        do(desk, "step")
    do(desk, "branch:here")
    assert "go back first" in desk.message and not desk.session.playing
    do(desk, "first")
    do(desk, "branch:here")
    assert desk.session.playing and desk.session.end == 0.0 and "ghost" in desk.message


# panes


def test_panes_come_with_controllers_that_are_not_there_yet_and_go() -> None:
    desk = desk_of(RPF)
    for count in (2, 3, 4):
        do(desk, "pane:add")
        assert len(desk.session.lanes) == count and desk.active == count - 1
    names = [lane.law.name for lane in desk.session.lanes]
    assert names[0] == "rpf" and len(set(names)) == 4
    do(desk, "pane:add")
    assert desk.trouble and "4" in desk.message
    do(desk, "pane:next")
    assert desk.active == 0
    for count in (3, 2, 1):
        do(desk, "pane:remove")
        assert len(desk.session.lanes) == count
    desk.trouble = False
    do(desk, "pane:remove")
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
        do(desk, "law")
    assert sorted(seen) == sorted(desk.laws) and desk.lane.law.name == seen[0]


def test_choosing_the_controller_that_is_there_keeps_its_gains() -> None:
    desk = desk_of(RAPF, RPF)
    typed(desk, "k_rep 2")
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
        do(desk, "robot:next")
        seen.append(desk.selected)
    assert seen == [1, 2, 3, 1]
    do(desk, "robot:previous")
    assert desk.selected == 3


def test_failing_reviving_and_removing_need_a_robot_that_is_asked() -> None:
    desk = desk_of()
    for action in ("robot:fail", "robot:remove"):
        desk.trouble = False
        do(desk, action)
        assert desk.trouble and "no robot is chosen" in desk.message
    desk.hand.selected = 2
    do(desk, "robot:fail")
    assert desk.session.numbers == (1, 3) and desk.selected == 2
    do(desk, "robot:fail")
    assert desk.session.numbers == (1, 2, 3)
    do(desk, "robot:remove")
    assert desk.session.numbers == (1, 3) and desk.selected is None


def test_undo_and_redo_say_what_they_did() -> None:
    desk = desk_of()
    do(desk, "undo")
    assert desk.message == "nothing to undo"
    do(desk, "redo")
    assert desk.message == "nothing to redo"
    desk.session.add_robot((5.0, 3.0))
    do(desk, "undo")
    assert desk.message == "undone: robot 4 joined; back at 0.0 s" and desk.session.numbers == (1, 2, 3)
    do(desk, "redo")
    assert desk.message == "done again: robot 4 joined" and desk.session.numbers == (1, 2, 3, 4)


# tools


def test_another_tool_gives_up_what_was_begun_and_says_how_it_works() -> None:
    desk = desk_of()
    do(desk, "tool:polygon")
    assert desk.message == f"Polygon: {desk.tool.hint}"
    desk.tool.press(desk.session, (1.0, 3.0), 0.1, None)
    assert desk.tool.preview(desk.session) is not None
    do(desk, "tool:wall")
    assert desk.tools["polygon"].preview(desk.session) is None
    do(desk, "cancel")
    assert desk.tool is desk.hand


def test_cancelling_first_gives_up_then_puts_the_tool_away() -> None:
    desk = desk_of()
    do(desk, "tool:wall")
    desk.tool.press(desk.session, (1.0, 3.0), 0.1, None)
    do(desk, "cancel")
    assert desk.tool.name == "wall" and desk.tool.preview(desk.session) is None
    do(desk, "cancel")
    assert desk.tool is desk.hand


def test_walls_become_wider_and_narrower() -> None:
    desk = desk_of()
    do(desk, "wider")
    assert desk.message == "walls are 0.125 m wide"
    do(desk, "narrower")
    assert desk.message == "walls are 0.1 m wide"
