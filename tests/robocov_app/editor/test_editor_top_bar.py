"""The top bar and the tool rail of the editor, and labels of starts that avoid obstacles."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from driven_editor import EditorDriver, build_sheet, open_editor

from robocov.environment import DiscStart, PolygonObstacle, StartSpec, WallObstacle
from robocov_app.editor.canvas.start_labels import place_start_label
from robocov_app.editor.edits.create import add_obstacle
from robocov_app.toolkit.command_bar import NO_REDO_REASON, NO_UNDO_REASON, UNSAVED_SIGN
from robocov_app.toolkit.widgets.icons import ICONS

BOX = PolygonObstacle(((2, 2), (4, 2), (4, 4), (2, 4)), name="box")
LABEL_SIZE = (60, 12)


@pytest.fixture
def driver(tmp_path: Path) -> Iterator[EditorDriver]:
    with open_editor(tmp_path, build_sheet(BOX)) as driver:
        yield driver


def test_undo_and_redo_say_why_they_cannot_be_pressed(driver: EditorDriver) -> None:
    assert driver.get_widget("button", "undo").tip.endswith(NO_UNDO_REASON)
    assert driver.get_widget("button", "redo").tip.endswith(NO_REDO_REASON)
    driver.select(0)
    driver.press_key("delete")
    assert driver.get_widget("button", "undo").enabled
    driver.push_button("undo")
    assert driver.shapes == [BOX]
    assert not driver.get_widget("button", "undo").enabled
    driver.push_button("redo")
    assert driver.shapes == []
    assert not driver.get_widget("button", "redo").enabled


def test_a_dot_marks_unsaved_changes_until_the_map_is_saved(driver: EditorDriver) -> None:
    driver.select(0)
    driver.press_key("delete")
    assert driver.get_widget("label", "file").text.startswith(UNSAVED_SIGN)
    driver.push_button("save")
    driver.press_key("return")
    assert driver.get_widget("label", "file").text == "untitled.json"
    assert driver.get_widget("label", "file").tip == str(driver.editor.document.path)


def test_the_bar_creates_tries_and_explains(driver: EditorDriver) -> None:
    driver.push_button("try")
    assert driver.window.play_mode.window is not None
    driver.press_key("f5")
    assert driver.window.play_mode.window is None
    driver.push_button("palette")
    assert driver.window.dialogs.is_open
    driver.press_key("escape")
    driver.push_button("theme")
    assert driver.editor.theme == "dark"
    driver.push_button("panel")
    assert driver.window.layout.panel.width == 0
    driver.push_button("new")
    assert driver.shapes == []


@pytest.mark.parametrize("size", [(900, 600), (1280, 720), (1920, 1080)])
def test_bar_and_rail_have_their_buttons_side_by_side(tmp_path: Path, size: tuple[int, int]) -> None:
    with open_editor(tmp_path, build_sheet(BOX), size=size) as driver:
        bar = driver.window.top_bar.ui
        rects = [widget.rect for widget in bar.widgets.values()]
        assert all(bar.box.contains(rect) for rect in rects)
        for first, second in pairwise(rects):
            assert first.right <= second.left
        rail = driver.window.tool_rail.ui
        rects = [widget.rect for widget in rail.widgets.values()]
        assert all(rail.box.contains(rect) for rect in rects)
        for first, second in pairwise(rects):
            assert first.bottom <= second.top


def test_every_tool_has_a_button_with_its_key_and_an_icon(driver: EditorDriver) -> None:
    for tool in driver.editor.toolbox.by_name.values():
        driver.push_button(f"tool:{tool.name}")
        assert driver.editor.tool is tool
        assert tool.name in ICONS
        selected = [widget for widget in driver.window.tool_rail.ui.widgets.values() if widget.value]
        assert [widget.key for widget in selected] == [f"tool:{tool.name}"]


@pytest.mark.parametrize("scale", [1.0, 1.25, 1.5, 2.0])
def test_names_and_keys_on_the_rail_do_not_touch(tmp_path: Path, scale: float) -> None:
    with open_editor(tmp_path, size=(round(1280 * scale), round(720 * scale)), scale=scale) as driver:
        frame = driver.copy_frame()
        for tool in driver.editor.toolbox.by_name:
            button = driver.window.tool_rail.ui.find("button", f"tool:{tool}")
            left, top, width, height = button.rect
            # The edges of the button that is in use do not count.
            margin = round(3 * scale)
            rows = slice(top + margin, top + height - margin)
            columns = slice(left + round(32 * scale), left + width - margin)
            pixels = frame[rows, columns].astype(int)
            has_ink = (abs(pixels - pixels[0, 0]).max(axis=2) > 40).any(axis=0)
            inked_columns = np.flatnonzero(has_ink)
            assert np.diff(inked_columns).max() >= 6 * scale, tool


def test_presses_on_bar_and_rail_do_not_draw(driver: EditorDriver) -> None:
    driver.press_key("w")
    left, top, width, height = driver.window.layout.bar
    driver.click(left + 0.7 * width, top + height / 2)
    left, top, width, height = driver.window.layout.rail
    driver.click(left + width - 1, top + height - 2)
    assert not driver.editor.tool.is_busy


def test_pixels_and_positions_convert_into_each_other(driver: EditorDriver) -> None:
    canvas = driver.window.canvas
    assert canvas.to_world(canvas.to_pixel((3.0, 7.0))) == pytest.approx((3.0, 7.0))
    left, top, _, _ = driver.window.layout.arena
    assert not canvas.contains((left - 1, top + 100))
    x, y = map(round, driver.find_pixel((3.5, 2.5)))
    assert (driver.copy_frame()[y, x] == driver.window.theme.obstacle).all()


def place_label(driver: EditorDriver, start: StartSpec) -> np.ndarray:
    """Return the corners of the label of a start, (2, 2) m."""
    canvas = driver.window.canvas
    view = canvas.build_view()
    surface = driver.window.screen.subsurface(driver.window.layout.arena)
    surface.set_clip(view.clip)
    box = place_start_label(view.build_canvas(surface), driver.sketch, start, *LABEL_SIZE)
    assert box is not None
    return view.camera.to_world(np.array([box.bottomleft, box.topright], dtype=float))


@pytest.mark.parametrize(("wall_y", "is_above"), [(9.5, True), (6.2, False)])
def test_labels_of_starts_are_above_unless_there_is_a_wall(
    tmp_path: Path, wall_y: float, is_above: bool
) -> None:
    start = DiscStart((5.0, 5.0), 1.0)
    wall = WallObstacle(((2.0, wall_y), (8.0, wall_y)), 0.2)
    with open_editor(tmp_path, build_sheet(wall)) as driver:
        (low_x, low_y), (high_x, high_y) = place_label(driver, start).tolist()
        assert (low_y > 6.0) == is_above
        assert high_y < wall_y - 0.1 or low_y > wall_y + 0.1 or low_x > 8.0 or high_x < 2.0


def test_labels_of_starts_avoid_the_boundary(tmp_path: Path) -> None:
    with open_editor(tmp_path, build_sheet()) as driver:
        (_, low_y), (_, high_y) = place_label(driver, DiscStart((5.0, 9.0), 0.95)).tolist()
        assert high_y < 9.95
        assert low_y > 0.0


def test_a_start_between_walls_has_no_free_place_for_its_label(tmp_path: Path) -> None:
    block = PolygonObstacle(((3, 3), (7, 3), (7, 7), (3, 7)))
    with open_editor(tmp_path, build_sheet(block)) as driver, pytest.raises(AssertionError):
        place_label(driver, DiscStart((5.0, 5.0), 0.1))


def test_new_entries_of_the_legend_do_not_move_the_map(tmp_path: Path) -> None:
    walls = [WallObstacle(((0.0, y), (10.0, y)), 0.1) for y in (3.0, 3.15, 6.0)]
    with open_editor(tmp_path, build_sheet()) as driver:
        camera = driver.window.canvas.camera
        before = len(driver.window.canvas.entries)
        for wall in walls:
            driver.editor.apply(add_obstacle(driver.sketch, wall))
        driver.run_frames(3)
        assert len(driver.window.canvas.entries) > before
        assert driver.window.canvas.camera == camera
