"""The desk: what keys, buttons and typed commands do, without a window."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from driven_window import do, typed
from pointer_events import build_event
from sample_sessions import HALL, LLOYD, RAPF, RPF, build_presenter, describe_state

from robocov.mapfile import list_bundled_maps, load_map
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.session.clock import SPEEDS
from robocov_app.viewer.session.scenario import MAX_ROBOTS
from robocov_app.viewer.tools.tool import ViewerDrawState


def draw_circle(viewer: Presenter, center: tuple[float, float], rim: tuple[float, float]) -> None:
    """Drag a circle from its center to its rim, m."""
    tool = viewer.toolbox.by_name["circle"]
    release = build_event(rim)
    tool.press(viewer.session, build_event(center))
    viewer.attempt(lambda: tool.release(viewer.session, release, clicked=False))


# playing


def test_pausing_playing_and_single_steps() -> None:
    viewer = build_presenter()
    do(viewer, "pause")
    assert viewer.session.playback.is_playing
    do(viewer, "step")
    assert not viewer.session.playback.is_playing and viewer.session.timeline.end_time == pytest.approx(
        viewer.session.timeline.scenario.dt
    )


def test_settling_plays_until_asked_again() -> None:
    viewer = build_presenter()
    do(viewer, "settle")
    assert viewer.session.playback.is_playing and viewer.session.playback.stop_when_settled
    do(viewer, "pause")
    assert not viewer.session.playback.is_playing and not viewer.session.playback.stop_when_settled
    do(viewer, "settle")
    do(viewer, "settle")
    assert viewer.session.playback.is_playing and not viewer.session.playback.stop_when_settled


def test_speeds_go_by_steps_and_stop_at_both_ends() -> None:
    viewer = build_presenter()
    seen = [viewer.session.playback.clock.speed]
    for _ in SPEEDS:
        do(viewer, "faster")
        seen.append(viewer.session.playback.clock.speed)
    assert seen[:2] == [1.0, 2.0] and seen[-2:] == [math.inf, math.inf]
    assert viewer.message == "speed max"
    for _ in SPEEDS:
        do(viewer, "slower")
    assert viewer.session.playback.clock.speed == SPEEDS[0]


def test_a_typed_speed_between_the_steps_goes_on_to_the_next_of_them() -> None:
    viewer = build_presenter()
    typed(viewer, "speed 3.3")
    assert viewer.session.playback.clock.speed == 3.3
    do(viewer, "faster")
    assert viewer.session.playback.clock.speed == 8.0


def test_restarting_keeps_controller_and_gains() -> None:
    viewer = build_presenter()
    typed(viewer, "k_rep 2")
    do(viewer, "step")
    do(viewer, "restart")
    assert viewer.session.timeline.end_time == 0.0 and viewer.pane.controller.get_value("k_rep") == 2.0


def test_another_seed_gives_other_starts_and_another_start_too() -> None:
    viewer = build_presenter()
    places = [viewer.session.displayed.get_positions(viewer.pane).copy()]
    for action in ("seed:next", "start:next", "start:next"):
        do(viewer, action)
        places.append(viewer.session.displayed.get_positions(viewer.pane).copy())
        assert not np.allclose(places[-1], places[-2])
    assert viewer.session.timeline.scenario.start_name == "spread"
    for _ in range(2):
        do(viewer, "start:next")
    assert viewer.session.timeline.scenario.start_name == "corner"


def test_a_start_that_an_obstacle_has_covered_is_still_named_and_left_by_going_on() -> None:
    viewer = build_presenter(start="far")
    draw_circle(viewer, (5.2, 3.2), (5.2, 3.75))
    assert viewer.message.endswith("it covers the start far") and "far" not in viewer.playback.list_starts()
    assert viewer.session.timeline.scenario.start_name == "far"
    do(viewer, "start:next")
    assert not viewer.has_error_message and viewer.session.timeline.scenario.start_name == "corner"


def test_more_and_fewer_robots() -> None:
    viewer = build_presenter(robots=2)
    do(viewer, "more")
    assert viewer.session.timeline.scenario.robots == 3 and len(viewer.session.displayed.numbers) == 3
    for _ in range(3):
        do(viewer, "fewer")
    assert viewer.session.timeline.scenario.robots == 1 and viewer.has_error_message
    assert viewer.message == f"robots: expected a whole number from 1 to {MAX_ROBOTS}, got 0"


def test_robots_without_room_are_told_and_nothing_changes() -> None:
    viewer = build_presenter()
    before = describe_state(viewer.session)
    viewer.attempt(lambda: typed(viewer, "robots 900"))
    assert viewer.has_error_message and "room" in viewer.message
    assert describe_state(viewer.session) == before


# maps


def test_maps_are_turned_through_both_ways() -> None:
    viewer = build_presenter()
    typed(viewer, "map rooms")
    names = list(list_bundled_maps())
    do(viewer, "map:next")
    assert (
        viewer.files.map_name == names[names.index("rooms") + 1]
        and viewer.session.displayed.environment.name != HALL.name
    )
    do(viewer, "map:previous")
    assert viewer.files.map_name == "rooms" and viewer.session.timeline.scenario.start_name == "corridor"


def test_a_map_that_is_no_map_is_told_and_the_old_one_stays(tmp_path: Path) -> None:
    viewer = build_presenter()
    (tmp_path / "x.json").write_text("{")
    for name in ("nowhere", str(tmp_path / "x.json"), str(tmp_path)):
        viewer.attempt(lambda name=name: viewer.files.open_map(name))
        assert viewer.has_error_message and viewer.message and viewer.files.map_name == "hall"
        assert viewer.session.displayed.environment is HALL
        viewer.has_error_message = False


def test_an_own_map_is_offered_beside_the_bundled_ones() -> None:
    viewer = build_presenter()
    assert viewer.files.list_maps() == [*list_bundled_maps(), "hall"]
    typed(viewer, "map square")
    assert viewer.files.list_maps() == list(list_bundled_maps())


def test_a_saved_map_can_be_opened_and_has_what_was_drawn(tmp_path: Path) -> None:
    viewer = build_presenter(folder=tmp_path)
    draw_circle(viewer, (1.0, 3.0), (1.3, 3.0))
    assert viewer.message.startswith("circle drawn")
    do(viewer, "save:map")
    first = tmp_path / "hall-1.json"
    assert viewer.message == f"map saved: {first}" and viewer.files.map_name == str(first)
    assert load_map(str(first)).obstacles == viewer.session.displayed.environment.obstacles
    do(viewer, "save:map")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["hall-1.json", "hall-2.json"]


def test_a_folder_that_cannot_be_written_to_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    viewer = build_presenter(folder=tmp_path / "file")
    do(viewer, "save:map")
    assert viewer.has_error_message and viewer.files.map_name == "hall"


# time


def test_looking_back_and_forth() -> None:
    viewer = build_presenter()
    for _ in range(120):
        do(viewer, "step")
    session = viewer.session
    do(viewer, "back")
    assert session.displayed.time == pytest.approx(119 / 60) and not session.timeline.is_live
    do(viewer, "back:second")
    assert session.displayed.time == pytest.approx(59 / 60, abs=1e-6)
    do(viewer, "forward:second")
    do(viewer, "forward")
    assert session.timeline.is_live
    do(viewer, "first")
    assert session.displayed.time == 0.0
    do(viewer, "live")
    assert session.timeline.is_live and session.displayed.time == pytest.approx(2.0)


def test_branching_goes_on_from_the_past_and_at_the_present_says_how() -> None:
    viewer = build_presenter()
    for _ in range(30):
        do(viewer, "step")
    do(viewer, "branch:here")
    assert "go back first" in viewer.message and not viewer.session.playback.is_playing
    do(viewer, "first")
    do(viewer, "branch:here")
    assert (
        viewer.session.playback.is_playing
        and viewer.session.timeline.end_time == 0.0
        and "ghost" in viewer.message
    )


# panes


def test_panes_come_with_controllers_that_are_not_there_yet_and_go() -> None:
    viewer = build_presenter(RPF)
    for count in (2, 3, 4):
        do(viewer, "pane:add")
        assert len(viewer.session.timeline.panes) == count and viewer.active_pane == count - 1
    names = [pane.controller.name for pane in viewer.session.timeline.panes]
    assert names[0] == "rpf" and len(set(names)) == 4
    do(viewer, "pane:add")
    assert viewer.has_error_message and "4" in viewer.message
    do(viewer, "pane:next")
    assert viewer.active_pane == 0
    for count in (3, 2, 1):
        do(viewer, "pane:remove")
        assert len(viewer.session.timeline.panes) == count
    viewer.has_error_message = False
    do(viewer, "pane:remove")
    assert viewer.has_error_message and len(viewer.session.timeline.panes) == 1


def test_the_chosen_pane_is_one_that_there_is() -> None:
    viewer = build_presenter(RAPF, RPF)
    viewer.inspection.active_pane = 1
    viewer.session.remove_pane(viewer.session.timeline.panes[1])
    assert viewer.pane is viewer.session.timeline.panes[0] and viewer.active_pane == 0


def test_controllers_take_turns() -> None:
    viewer = build_presenter()
    seen = []
    for _ in range(len(viewer.controllers)):
        seen.append(viewer.pane.controller.name)
        do(viewer, "controller:next")
    assert sorted(seen) == sorted(viewer.controllers) and viewer.pane.controller.name == seen[0]


def test_choosing_the_controller_that_is_there_keeps_its_gains() -> None:
    viewer = build_presenter(RAPF, RPF)
    typed(viewer, "k_rep 2")
    viewer.comparison.set_controller(0, "rapf")
    assert viewer.session.timeline.panes[0].controller.get_value("k_rep") == 2.0
    viewer.comparison.set_controller(1, "lloyd")
    assert viewer.active_pane == 1 and viewer.pane.controller == LLOYD


# robots


def test_asking_goes_round_all_robots_also_those_that_failed() -> None:
    viewer = build_presenter()
    viewer.session.fail_robot(2)
    seen = []
    for _ in range(4):
        do(viewer, "robot:next")
        seen.append(viewer.selected_robot)
    assert seen == [1, 2, 3, 1]
    do(viewer, "robot:previous")
    assert viewer.selected_robot == 3


def test_failing_reviving_and_removing_need_a_robot_that_is_asked() -> None:
    viewer = build_presenter()
    for action in ("robot:fail", "robot:remove"):
        viewer.has_error_message = False
        do(viewer, action)
        assert viewer.has_error_message and "no robot is selected" in viewer.message
    viewer.inspection.selected = 2
    do(viewer, "robot:fail")
    assert viewer.session.displayed.numbers == (1, 3) and viewer.selected_robot == 2
    do(viewer, "robot:fail")
    assert viewer.session.displayed.numbers == (1, 2, 3)
    do(viewer, "robot:remove")
    assert viewer.session.displayed.numbers == (1, 3) and viewer.selected_robot is None


def test_undo_says_what_began_anew_and_the_map_has_its_name_again() -> None:
    viewer = build_presenter()
    do(viewer, "more")
    viewer.files.open_map("square")
    viewer.comparison.add_pane()
    assert viewer.files.map_name == "square"
    for words, name in (
        ("RPF compared", "square"),
        ("map Square", "hall"),
        ("4 robots", "hall"),
    ):
        do(viewer, "undo")
        assert viewer.message == f"undone: {words}; back at 0.0 s" and viewer.files.map_name == name
    do(viewer, "redo")
    do(viewer, "redo")
    assert viewer.message == "redone: map Square" and viewer.files.map_name == "square"


def test_undo_and_redo_say_what_they_did() -> None:
    viewer = build_presenter()
    do(viewer, "undo")
    assert viewer.message == "nothing to undo"
    do(viewer, "redo")
    assert viewer.message == "nothing to redo"
    viewer.session.add_robot((5.0, 3.0))
    do(viewer, "undo")
    assert viewer.message == "undone: robot 4 joined; back at 0.0 s" and viewer.session.displayed.numbers == (
        1,
        2,
        3,
    )
    do(viewer, "undo")
    assert viewer.message == "nothing to undo; Alt ← leads to other branches"
    do(viewer, "redo")
    assert viewer.message == "redone: robot 4 joined" and viewer.session.displayed.numbers == (1, 2, 3, 4)


# tools


def test_another_tool_gives_up_what_was_begun_and_says_how_it_works() -> None:
    viewer = build_presenter()
    do(viewer, "tool:polygon")
    assert viewer.message == f"Polygon: {viewer.tool.hint}"
    viewer.tool.press(viewer.session, build_event((1.0, 3.0)))
    assert viewer.tool.build_draw_state(viewer.session).line
    do(viewer, "tool:wall")
    assert viewer.toolbox.by_name["polygon"].build_draw_state(viewer.session) == ViewerDrawState()
    do(viewer, "cancel")
    assert viewer.tool is viewer.toolbox.hand


def test_cancelling_first_gives_up_then_puts_the_tool_away() -> None:
    viewer = build_presenter()
    do(viewer, "tool:wall")
    viewer.tool.press(viewer.session, build_event((1.0, 3.0)))
    do(viewer, "cancel")
    assert viewer.tool.name == "wall" and viewer.tool.build_draw_state(viewer.session) == ViewerDrawState()
    do(viewer, "cancel")
    assert viewer.tool is viewer.toolbox.hand


def test_walls_become_wider_and_narrower() -> None:
    viewer = build_presenter()
    do(viewer, "wider")
    assert viewer.message == "new walls are 0.125 m wide"
    do(viewer, "narrower")
    assert viewer.message == "new walls are 0.1 m wide"
