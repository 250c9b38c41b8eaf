"""Commands of the presenter, without a window: playback, maps, time, panes, robots and tools."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from driven_window import run_command, run_text
from pointer_events import build_event
from sample_sessions import HALL, LLOYD, RAPF, RPF, build_presenter, describe_state

from robocov.environment import Environment
from robocov.errors import ParameterError
from robocov.mapfile import list_bundled_maps, load_map, save_map
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.session.clock import SPEEDS
from robocov_app.viewer.session.setup.scenario import MAX_ROBOTS
from robocov_app.viewer.tools.tool import ViewerToolOverlay


def draw_circle(viewer: Presenter, center: tuple[float, float], rim: tuple[float, float]) -> None:
    """Drag a circle from its center to its rim, m."""
    tool = viewer.toolbox.by_name["circle"]
    release = build_event(rim)
    tool.press(viewer.session, build_event(center))
    viewer.attempt(lambda: tool.release(viewer.session, release, is_click=False))


# playing


def test_pause_and_single_step() -> None:
    viewer = build_presenter()
    run_command(viewer, "pause")
    assert viewer.session.playback.is_playing
    run_command(viewer, "step")
    assert not viewer.session.playback.is_playing
    assert viewer.session.timeline.end_time == pytest.approx(viewer.session.timeline.scenario.dt)


def test_settling_can_be_switched_off() -> None:
    viewer = build_presenter()
    run_command(viewer, "settle")
    assert viewer.session.playback.is_playing
    assert viewer.session.playback.stop_when_settled
    run_command(viewer, "pause")
    assert not viewer.session.playback.is_playing
    assert not viewer.session.playback.stop_when_settled
    run_command(viewer, "settle")
    run_command(viewer, "settle")
    assert viewer.session.playback.is_playing
    assert not viewer.session.playback.stop_when_settled


def test_speed_steps_stop_at_both_ends() -> None:
    viewer = build_presenter()
    speeds = [viewer.session.playback.clock.speed]
    for _ in SPEEDS:
        run_command(viewer, "faster")
        speeds.append(viewer.session.playback.clock.speed)
    assert speeds[:2] == [1.0, 2.0]
    assert speeds[-2:] == [math.inf, math.inf]
    assert viewer.message == "Speed max"
    for _ in SPEEDS:
        run_command(viewer, "slower")
    assert viewer.session.playback.clock.speed == SPEEDS[0]


def test_faster_continues_from_a_typed_speed() -> None:
    viewer = build_presenter()
    run_text(viewer, "speed 3.3")
    assert viewer.session.playback.clock.speed == 3.3
    run_command(viewer, "faster")
    assert viewer.session.playback.clock.speed == 8.0


def test_restart_keeps_controller_and_gains() -> None:
    viewer = build_presenter()
    run_text(viewer, "k_rep 2")
    run_command(viewer, "step")
    run_command(viewer, "restart")
    assert viewer.session.timeline.end_time == 0.0
    assert viewer.pane.controller.get_value("k_rep") == 2.0


def test_next_seed_and_next_start_change_the_positions() -> None:
    viewer = build_presenter()
    positions = viewer.session.displayed.get_positions(viewer.pane).copy()
    for command in ("seed:next", "start:next", "start:next"):
        previous = positions
        run_command(viewer, command)
        positions = viewer.session.displayed.get_positions(viewer.pane).copy()
        assert not np.allclose(positions, previous)
    assert viewer.session.timeline.scenario.start_name == "spread"
    for _ in range(2):
        run_command(viewer, "start:next")
    assert viewer.session.timeline.scenario.start_name == "corner"


def test_a_covered_start_keeps_its_name_until_the_next_start() -> None:
    viewer = build_presenter(start="far")
    draw_circle(viewer, (5.2, 3.2), (5.2, 3.75))
    assert viewer.message.endswith("it covers the start far")
    assert "far" not in viewer.playback.list_starts()
    assert viewer.session.timeline.scenario.start_name == "far"
    run_command(viewer, "start:next")
    assert not viewer.has_error_message
    assert viewer.session.timeline.scenario.start_name == "corner"


def test_more_and_fewer_robots() -> None:
    viewer = build_presenter(robots=2)
    run_command(viewer, "more")
    assert viewer.session.timeline.scenario.robots == 3
    assert len(viewer.session.displayed.numbers) == 3
    for _ in range(3):
        run_command(viewer, "fewer")
    assert viewer.session.timeline.scenario.robots == 1
    assert viewer.has_error_message
    assert viewer.message == f"Robots: expected a whole number from 1 to {MAX_ROBOTS}, got 0"


def test_too_many_robots_are_reported_and_change_nothing() -> None:
    viewer = build_presenter()
    before = describe_state(viewer.session)
    viewer.attempt(lambda: run_text(viewer, "robots 900"))
    assert viewer.has_error_message
    assert "space for about" in viewer.message
    assert describe_state(viewer.session) == before


# maps


def test_next_and_previous_map() -> None:
    viewer = build_presenter()
    run_text(viewer, "map rooms")
    names = list(list_bundled_maps())
    run_command(viewer, "map:next")
    assert viewer.files.map_name == names[names.index("rooms") + 1]
    assert viewer.session.displayed.environment.name != HALL.name
    run_command(viewer, "map:previous")
    assert viewer.files.map_name == "rooms"
    assert viewer.session.timeline.scenario.start_name == "corridor"


def test_an_invalid_map_is_reported_and_the_present_one_stays(tmp_path: Path) -> None:
    viewer = build_presenter()
    (tmp_path / "x.json").write_text("{")
    for name in ("nowhere", str(tmp_path / "x.json"), str(tmp_path)):
        viewer.attempt(lambda name=name: viewer.files.open_map(name))
        assert viewer.has_error_message
        assert viewer.message
        assert viewer.files.map_name == "hall"
        assert viewer.session.displayed.environment is HALL
        viewer.has_error_message = False


def test_the_next_map_skips_maps_that_cannot_be_opened(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    viewer = build_presenter()
    unreadable = tmp_path / "unreadable.json"
    unreadable.write_text("{")
    small = tmp_path / "small.json"
    corners = ((0.0, 0.0), (0.3, 0.0), (0.3, 0.3), (0.0, 0.3))
    save_map(Environment("Small", boundary=corners), small)
    names = ["rooms", str(unreadable), str(small), "square"]
    monkeypatch.setattr(viewer.files, "list_maps", lambda: names)
    run_text(viewer, "map rooms")
    run_command(viewer, "map:next")
    assert viewer.files.map_name == "square"
    assert viewer.message == f"No space for 3 robots: {small}; cannot be read: {unreadable}"


def test_a_map_that_the_controller_rejects_is_not_reported_as_too_small(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    viewer = build_presenter()
    open_map = viewer.files.open_map

    def reject_square(name: str) -> None:
        if name == "square":
            raise ParameterError("the controller does not accept the map")
        open_map(name)

    monkeypatch.setattr(viewer.files, "list_maps", lambda: ["rooms", "square", "office"])
    run_text(viewer, "map rooms")
    monkeypatch.setattr(viewer.files, "open_map", reject_square)
    run_command(viewer, "map:next")
    assert viewer.files.map_name == "office"
    assert viewer.message == "Cannot be used: square"


def test_a_user_map_is_offered_after_the_bundled_maps() -> None:
    viewer = build_presenter()
    assert viewer.files.list_maps() == [*list_bundled_maps(), "hall"]
    run_text(viewer, "map square")
    assert viewer.files.list_maps() == list(list_bundled_maps())


def test_messages_about_saved_files_have_their_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    viewer = build_presenter(folder=Path())
    run_command(viewer, "save:session")
    assert viewer.message == f"Session saved: {tmp_path / 'hall-1.robocov'}"
    viewer.hidden_folder = Path()
    run_command(viewer, "save:map")
    assert viewer.message == "Map saved: hall-1.json. Download copies it to your device."


def test_a_saved_map_contains_drawn_obstacles(tmp_path: Path) -> None:
    viewer = build_presenter(folder=tmp_path)
    draw_circle(viewer, (1.0, 3.0), (1.3, 3.0))
    assert viewer.message.startswith("Circle drawn")
    run_command(viewer, "save:map")
    first = tmp_path / "hall-1.json"
    assert viewer.message == f"Map saved: {first}"
    assert viewer.files.map_name == str(first)
    assert load_map(str(first)).obstacles == viewer.session.displayed.environment.obstacles
    run_command(viewer, "save:map")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["hall-1.json", "hall-2.json"]


def test_an_unwritable_folder_is_reported(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    viewer = build_presenter(folder=tmp_path / "file")
    run_command(viewer, "save:map")
    assert viewer.has_error_message
    assert viewer.files.map_name == "hall"


# time


def test_commands_move_through_time() -> None:
    viewer = build_presenter()
    for _ in range(120):
        run_command(viewer, "step")
    session = viewer.session
    run_command(viewer, "back")
    assert session.displayed.time == pytest.approx(119 / 60)
    assert not session.timeline.is_live
    run_command(viewer, "back:second")
    assert session.displayed.time == pytest.approx(59 / 60, abs=1e-6)
    run_command(viewer, "forward:second")
    run_command(viewer, "forward")
    assert session.timeline.is_live
    run_command(viewer, "first")
    assert session.displayed.time == 0.0
    run_command(viewer, "live")
    assert session.timeline.is_live
    assert session.displayed.time == pytest.approx(2.0)


def test_branching_continues_from_the_past_only() -> None:
    viewer = build_presenter()
    for _ in range(30):
        run_command(viewer, "step")
    run_command(viewer, "branch:here")
    assert "Go back in time first" in viewer.message
    assert not viewer.session.playback.is_playing
    run_command(viewer, "first")
    run_command(viewer, "branch:here")
    assert viewer.session.playback.is_playing
    assert viewer.session.timeline.end_time == 0.0
    assert "another branch" in viewer.message


# panes


def test_panes_are_added_with_unused_controllers_and_removed() -> None:
    viewer = build_presenter(RPF)
    for count in (2, 3, 4):
        viewer.comparison.add_pane(viewer.comparison.list_candidates()[0])
        assert len(viewer.session.timeline.panes) == count
        assert viewer.active_pane == count - 1
    names = [pane.controller.name for pane in viewer.session.timeline.panes]
    assert names[0] == "rpf"
    assert len(set(names)) == 4
    viewer.attempt(lambda: viewer.comparison.add_pane("lloyd"))
    assert viewer.has_error_message
    assert "4" in viewer.message
    run_command(viewer, "pane:next")
    assert viewer.active_pane == 0
    for count in (3, 2, 1):
        run_command(viewer, "pane:remove")
        assert len(viewer.session.timeline.panes) == count
    viewer.has_error_message = False
    run_command(viewer, "pane:remove")
    assert viewer.has_error_message
    assert len(viewer.session.timeline.panes) == 1


def test_the_active_pane_exists_after_a_removal() -> None:
    viewer = build_presenter(RAPF, RPF)
    viewer.inspection.active_pane = 1
    viewer.session.remove_pane(viewer.session.timeline.panes[1])
    assert viewer.pane is viewer.session.timeline.panes[0]
    assert viewer.active_pane == 0


def test_next_controller_cycles_through_all_controllers() -> None:
    viewer = build_presenter()
    names = []
    for _ in range(len(viewer.controllers)):
        names.append(viewer.pane.controller.name)
        run_command(viewer, "controller:next")
    assert sorted(names) == sorted(viewer.controllers)
    assert viewer.pane.controller.name == names[0]


def test_choosing_the_present_controller_keeps_its_gains() -> None:
    viewer = build_presenter(RAPF, RPF)
    run_text(viewer, "k_rep 2")
    viewer.comparison.set_controller(0, "rapf")
    assert viewer.session.timeline.panes[0].controller.get_value("k_rep") == 2.0
    viewer.comparison.set_controller(1, "lloyd")
    assert viewer.active_pane == 1
    assert viewer.pane.controller == LLOYD


# robots


def test_next_robot_includes_failed_robots() -> None:
    viewer = build_presenter()
    viewer.session.fail_robot(2)
    selected = []
    for _ in range(4):
        run_command(viewer, "robot:next")
        selected.append(viewer.selected_robot)
    assert selected == [1, 2, 3, 1]
    run_command(viewer, "robot:previous")
    assert viewer.selected_robot == 3


def test_robot_commands_require_a_selected_robot() -> None:
    viewer = build_presenter()
    for action in ("robot:fail", "robot:remove"):
        viewer.has_error_message = False
        run_command(viewer, action)
        assert viewer.has_error_message
        assert "No robot is selected" in viewer.message
    viewer.inspection.selected = 2
    run_command(viewer, "robot:fail")
    assert viewer.session.displayed.numbers == (1, 3)
    assert viewer.selected_robot == 2
    run_command(viewer, "robot:fail")
    assert viewer.session.displayed.numbers == (1, 2, 3)
    run_command(viewer, "robot:remove")
    assert viewer.session.displayed.numbers == (1, 3)
    assert viewer.selected_robot is None


def test_undoing_a_restart_restores_the_map_name() -> None:
    viewer = build_presenter()
    run_command(viewer, "more")
    viewer.files.open_map("square")
    viewer.comparison.add_pane("rpf")
    assert viewer.files.map_name == "square"
    for description, name in (
        ("RPF compared", "square"),
        ("map Square", "hall"),
        ("4 robots", "hall"),
    ):
        run_command(viewer, "undo")
        assert viewer.message == f"Undone: {description}; back at 0.0 s"
        assert viewer.files.map_name == name
    run_command(viewer, "redo")
    run_command(viewer, "redo")
    assert viewer.message == "Redone: map Square"
    assert viewer.files.map_name == "square"


def test_undo_and_redo_report_the_edit() -> None:
    viewer = build_presenter()
    run_command(viewer, "undo")
    assert viewer.message == "Nothing to undo"
    run_command(viewer, "redo")
    assert viewer.message == "Nothing to redo"
    viewer.session.add_robot((5.0, 3.0))
    run_command(viewer, "undo")
    assert viewer.message == "Undone: robot 4 joined; back at 0.0 s"
    assert viewer.session.displayed.numbers == (
        1,
        2,
        3,
    )
    run_command(viewer, "undo")
    assert viewer.message == "Nothing to undo; Alt+← leads to other branches"
    run_command(viewer, "redo")
    assert viewer.message == "Redone: robot 4 joined"
    assert viewer.session.displayed.numbers == (1, 2, 3, 4)


# tools


def test_choosing_a_tool_discards_the_drawing_and_shows_a_hint() -> None:
    viewer = build_presenter()
    run_command(viewer, "tool:polygon")
    assert viewer.message == f"Polygon: {viewer.tool.hint}"
    viewer.tool.press(viewer.session, build_event((1.0, 3.0)))
    assert viewer.tool.build_overlay(viewer.session).line
    run_command(viewer, "tool:wall")
    assert viewer.toolbox.by_name["polygon"].build_overlay(viewer.session) == ViewerToolOverlay()
    run_command(viewer, "cancel")
    assert viewer.tool is viewer.toolbox.hand


def test_cancel_discards_the_drawing_then_returns_to_the_hand() -> None:
    viewer = build_presenter()
    run_command(viewer, "tool:wall")
    viewer.tool.press(viewer.session, build_event((1.0, 3.0)))
    run_command(viewer, "cancel")
    assert viewer.tool.name == "wall"
    assert viewer.tool.build_overlay(viewer.session) == ViewerToolOverlay()
    run_command(viewer, "cancel")
    assert viewer.tool is viewer.toolbox.hand


def test_wall_width_changes_by_commands() -> None:
    viewer = build_presenter()
    run_command(viewer, "wider")
    assert viewer.message == "New walls are 0.125 m wide"
    run_command(viewer, "narrower")
    assert viewer.message == "New walls are 0.1 m wide"
