"""The editor's window: panel, keyboard, mouse, menus, palette, help, sizes."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pygame
import pytest
from drawn_strip_texts import (
    MESSAGES_OF_ALL_LENGTHS,
    check_only_boxes_have_texts,
    check_texts_are_complete_or_hidden,
)
from driven_editor import EditorDriver, build_sheet, load_sketch, open_editor

from robocov.environment import CircleObstacle, DiscStart, PolygonObstacle
from robocov_app.editor.canvas import layers
from robocov_app.editor.edits.create import add_circle, add_polygon
from robocov_app.editor.model.selection import Selection, Vertex
from robocov_app.editor.model.sketch import Sketch
from robocov_app.editor.team import Team
from robocov_app.editor.ui.fields import format_number
from robocov_app.editor.ui.map_facts import _describe_team, list_status
from robocov_app.editor.ui.panel import EditorPanel
from robocov_app.toolkit.commands import help_page
from robocov_app.toolkit.commands.menu import Menu
from robocov_app.toolkit.dialogs import Choice
from robocov_app.toolkit.window.clipboard import Clipboard
from robocov_app.toolkit.window.layout import MIN_SIZE_PX

BOX = PolygonObstacle(((2, 2), (4, 2), (4, 4), (2, 4)), name="box")
PILLAR = CircleObstacle((7, 7), 1.0)


@pytest.fixture
def driver(tmp_path: Path) -> Iterator[EditorDriver]:
    with open_editor(
        tmp_path, build_sheet(BOX, PILLAR, starts=(("door", DiscStart((8, 2), 0.8)),))
    ) as driver:
        yield driver


# the panel


def test_every_button_runs_its_command(driver: EditorDriver) -> None:
    driver.push_button("tool:wall")
    assert driver.editor.tool.name == "wall"
    driver.push_button("tool:select")
    driver.select(0)
    driver.open_tab("object")
    driver.push_button("rotate:left")
    assert driver.editor.document.history.undo_descriptions
    driver.push_button("undo")
    assert driver.shapes[0] == BOX
    driver.push_button("help")
    assert driver.window.help_page.is_open


def test_the_map_page_edits_name_radius_and_team(driver: EditorDriver) -> None:
    driver.open_tab("map")
    driver.type_into("title", "Our office")
    driver.press_key("return")
    assert driver.sketch.name == "Our office"
    driver.type_into("radius", "0.25")
    driver.press_key("return")
    assert driver.editor.radius == 0.25 and driver.editor.measurement.radius == 0.25
    driver.type_into("robots", "nine")
    driver.press_key("return")
    assert driver.editor.has_error_message and driver.editor.robots == 6
    driver.push_button("more")
    assert driver.editor.robots == 7
    driver.toggle_check_box("show:robots")
    assert "robots" in driver.editor.shown


def test_numbers_in_fields_have_no_trailing_zeros() -> None:
    assert [format_number(value) for value in (2.0, 0.30004, -0.00001, None)] == ["2", "0.3", "0", ""]


def test_the_object_page_edits_names_positions_and_sizes(driver: EditorDriver) -> None:
    driver.select(0)
    driver.open_tab("object")
    assert driver.get_widget("entry", "name").text == "box"
    driver.type_into("x", "3.5")
    driver.press_key("return")
    driver.type_into("wide", "120cm")
    driver.press_key("return")
    assert driver.sketch.get_item(0).geometry.bounds == (3.5, 2.0, 4.7, 4.0)
    driver.type_into("wide", "0")
    driver.press_key("return")
    assert driver.message.startswith("Expected a width from ")
    assert driver.sketch.get_item(0).geometry.bounds == (3.5, 2.0, 4.7, 4.0)
    driver.type_into("note", "oak")
    driver.press_key("return")
    assert driver.sketch.get_item(0).note == "oak"
    driver.select(1)
    driver.type_into("size:radius", "0.5")
    driver.press_key("return")
    assert driver.shapes[1].radius == 0.5
    driver.select("door")
    driver.type_into("name", "entrance")
    driver.press_key("return")
    assert driver.editor.start_names == ["entrance"]


def test_every_kind_of_selection_has_its_page(driver: EditorDriver) -> None:
    driver.open_tab("object")
    vertex = frozenset({Vertex(0, 0, 1)})
    for selection in (
        Selection(),
        Selection.of(0),
        Selection.of(1),
        Selection.of(0, 1),
        Selection.of(-1),
        Selection.of("door"),
        Selection(vertices=vertex),
        Selection(vertices=vertex | {Vertex(0, 0, 2)}),
    ):
        driver.editor.select(selection)
        driver.run_frames(2, 0.2)


def test_the_list_of_vertices_selects_and_scrolls(driver: EditorDriver) -> None:
    ring = tuple((5 + np.cos(a), 5 + np.sin(a)) for a in np.arange(0, 6.2, 0.1))
    driver.editor.apply(add_polygon(driver.sketch, ring))
    driver.open_tab("object")
    driver.click(*driver.get_widget("option", "vertex:1").rect.center)
    assert driver.editor.selection.vertices == {Vertex(driver.sketch.obstacles[-1].key, 0, 1)}
    assert driver.find_widget("option", "vertex:61") is None, "what is out of sight is not laid out"
    at = driver.get_widget("option", "vertex:3").rect.center
    for _ in range(8):
        driver.turn_wheel(*at, -5)
    driver.click(*driver.get_widget("option", "vertex:61").rect.center)
    (vertex,) = driver.editor.selection.vertices
    assert vertex.index == 61


def test_the_snap_page_edits_snapping_and_layers(driver: EditorDriver) -> None:
    driver.open_tab("snap")
    driver.toggle_check_box("snap:grid")
    assert "grid" not in driver.editor.snaps
    driver.toggle_check_box("show:names")
    assert "names" not in driver.editor.shown
    driver.type_into("grid", "0.5")
    driver.press_key("return")
    assert driver.editor.grid == 0.5


def test_keys_switch_pages(driver: EditorDriver) -> None:
    seen = []
    for _ in EditorPanel.tabs:
        driver.press_key("ctrl+tab")
        seen.append(driver.window.panel.tab)
    assert sorted(seen) == sorted(EditorPanel.tabs)
    driver.press_key("h")
    assert driver.window.layout.panel.width == 0
    driver.press_key("f2")  # the field of the map's name brings the panel back
    assert driver.window.layout.panel.width > 0 and driver.window.panel.ui.edit
    driver.type("New name")
    driver.press_key("return")
    assert driver.sketch.name == "New name"


def test_the_cursor_depends_on_tool_and_panel(driver: EditorDriver) -> None:
    driver.press_key("w")
    driver.move_to((5.0, 5.0))
    driver.wait()
    assert driver.window.cursor.shape == pygame.SYSTEM_CURSOR_CROSSHAIR
    driver.move(driver.window.layout.panel.left + 20, 200)
    driver.wait()
    assert driver.window.cursor.shape == pygame.SYSTEM_CURSOR_ARROW


def test_keys_go_into_fields_and_not_to_actions_while_typing(driver: EditorDriver) -> None:
    driver.open_tab("map")
    driver.type_into("title", "wall")
    assert driver.editor.tool.name == "select" and driver.window.panel.ui.edit
    driver.press_key("escape")
    assert not driver.window.panel.ui.edit and driver.sketch.name == "Untitled"


def test_undo_in_a_field_does_not_change_the_map(driver: EditorDriver) -> None:
    driver.editor.apply(add_circle(driver.sketch, (5, 5), 0.2))
    drawn = driver.sketch
    driver.open_tab("map")
    driver.type_into("title", "ab")
    driver.press_key("left")
    driver.type("c")
    texts = []
    for key in ("", "ctrl+z", "ctrl+z", "ctrl+z", "ctrl+y", "ctrl+y"):
        if key:
            driver.press_key(key)
        texts.append(driver.get_widget("entry", "title").text)
    assert texts == ["acb", "ab", "Untitled", "Untitled", "ab", "acb"] and driver.sketch is drawn


def test_the_history_page_undoes_and_redoes(driver: EditorDriver) -> None:
    for radius in (0.2, 0.3, 0.4):
        driver.editor.apply(add_circle(driver.sketch, (5, 5), radius))
    driver.open_tab("history")

    def list_lines() -> list[tuple[str, bool]]:
        driver.run_frames(1)
        shown = driver.window.panel.ui.widgets.values()
        return [(each.text, bool(each.value)) for each in shown if each.key.startswith("step:")]

    def click(row: int) -> None:
        driver.wait()
        driver.click(*driver.get_widget("option", f"step:{row}").rect.center)

    assert [chosen for _, chosen in list_lines()] == [True, False, False, False]
    click(2)
    assert len(driver.shapes) == 3
    assert [chosen for _, chosen in list_lines()] == [False, False, True, False]
    click(3)
    assert len(driver.shapes) == 2
    click(0)
    assert len(driver.shapes) == 5


# the mouse


def test_wheel_and_right_button_zoom_and_pan(driver: EditorDriver) -> None:
    at = driver.find_pixel((5, 5))
    zoom = driver.window.canvas.camera.zoom
    driver.turn_wheel(*at, 3)
    assert driver.window.canvas.camera.zoom > zoom * 1.3
    assert driver.find_pixel((5, 5)) == pytest.approx(at, abs=1)
    center = driver.window.canvas.camera.center
    driver.drag((300, 300), (330, 310), (360, 320), button=3)
    moved = driver.window.canvas.camera.center
    assert moved[0] < center[0] and driver.editor.dialogs.current is None
    driver.press_key("f")
    assert driver.window.canvas.camera.zoom == pytest.approx(zoom)


def test_space_and_the_pan_tool_move_the_sheet(driver: EditorDriver) -> None:
    center = driver.window.canvas.camera.center
    driver.press_key("g")
    driver.drag((300, 300), (330, 310), (360, 320))
    assert driver.window.canvas.camera.center != center
    driver.press_key("v")
    before = driver.sketch
    center = driver.window.canvas.camera.center
    driver.post(pygame.KEYDOWN, key=pygame.K_SPACE, mod=0, unicode=" ", scancode=0)
    driver.settle()
    driver.drag_at((3, 3), (3.5, 3.5), (4, 4))
    driver.post(pygame.KEYUP, key=pygame.K_SPACE, mod=0, unicode=" ", scancode=0)
    driver.settle()
    assert driver.sketch is before and driver.window.canvas.camera.center != center
    driver.drag_at((3, 3), (3.5, 3.5), (4, 4))
    assert driver.sketch is not before


def test_the_map_always_stays_visible(driver: EditorDriver) -> None:
    for _ in range(80):
        driver.press_key("ctrl+left")
        driver.turn_wheel(300, 300, -5)
    low_x, low_y, high_x, high_y = driver.window.canvas.camera.compute_visible_bounds()
    assert low_x < 10 and high_x > 0 and low_y < 10 and high_y > 0
    driver.press_key("f")
    driver.select(1)
    driver.press_key("z")
    low_x, _, high_x, _ = driver.window.canvas.camera.compute_visible_bounds()
    assert high_x - low_x < 5


def test_the_menu_offers_and_runs_applicable_commands(driver: EditorDriver) -> None:
    driver.click_at((3, 3), button=3)
    menu = driver.editor.dialogs.current
    assert isinstance(menu, Menu) and driver.editor.selection == Selection.of(0)
    driver.window.draw()
    names = [action.name if action else "" for action in menu.rows]
    row = names.index("duplicate")
    driver.press_key("down", times=sum(1 for name in names[: row + 1] if name))
    driver.press_key("return")
    assert len(driver.shapes) == 3 and driver.editor.dialogs.current is None
    driver.click_at((9.5, 5), button=3)
    driver.window.draw()
    assert not driver.editor.selection
    assert "paste" in [action.name for action in driver.editor.dialogs.current.rows if action]
    driver.click(*driver.window.dialogs.ui.widgets["option:select:all"].rect.center)
    assert driver.editor.dialogs.current is None and driver.editor.selection
    driver.click_at((3, 3), button=3)
    driver.press_key("escape")
    assert driver.editor.dialogs.current is None
    driver.click_at((3, 3), button=3)
    driver.post(pygame.DROPFILE, file="nowhere.txt")
    driver.settle()
    assert driver.editor.dialogs.current is None and "nowhere.txt" in driver.message


def test_a_right_click_completes_a_drawing(driver: EditorDriver) -> None:
    driver.press_key("p")
    driver.click_all((5, 1), (6, 1), (6, 2))
    driver.click_at((6, 2), button=3)
    assert len(driver.shapes) == 3 and driver.editor.dialogs.current is None


# palette, help, look


def test_the_palette_runs_commands(driver: EditorDriver) -> None:
    driver.select(0)
    driver.press_key("ctrl+k")
    driver.type("mirror left")
    driver.press_key("return")
    assert driver.editor.document.history.undo_descriptions
    driver.run_command("rotate 90")
    assert "turned" in driver.message or "rotated" in driver.message
    driver.press_key("/")
    assert isinstance(driver.editor.dialogs.current, Choice) and driver.editor.dialogs.current.text == ""
    driver.press_key("escape")
    assert driver.editor.dialogs.current is None


def test_the_rail_has_space_for_all_tools_and_the_camera(tmp_path: Path) -> None:
    with open_editor(tmp_path, size=(1280, 720)) as driver:
        rail = driver.window.tool_rail.ui
        for command in ("fit", "zoom:in", "zoom:out"):
            button = rail.find("button", command)
            assert button is not None
            assert rail.box.contains(button.rect)


def test_a_team_is_described_by_its_size_and_start() -> None:
    assert _describe_team(Team("door", 1, 0.1, ((1.0, 1.0),))) == "1 robot at door"
    assert _describe_team(Team(None, 2, 0.1, ((1.0, 1.0), (2.0, 1.0)))) == "2 robots at anywhere"


@pytest.mark.parametrize(("size", "scale"), [((900, 600), 1.0), ((1280, 720), 1.0), ((1920, 1080), 1.5)])
def test_the_help_lists_all_keys(tmp_path: Path, size, scale: float, monkeypatch) -> None:
    words: set[str] = set()
    real = help_page.render_text

    def label(text, *rest, **options):
        words.add(text)
        return real(text, *rest, **options)

    with open_editor(tmp_path, size=size, scale=scale) as driver:
        monkeypatch.setattr(help_page, "render_text", label)
        driver.press_key("f1")
        for _ in range(5):
            driver.press_key("page down")
    for action in driver.window.commands.commands:
        if action.keys and not action.hidden:
            title = action.title.partition(":")[0]
            assert any(word.strip("… ") and title.startswith(word.rstrip("…")) for word in words), title


def test_the_window_is_drawn_in_every_theme_and_size(driver: EditorDriver) -> None:
    driver.press_key("t")
    assert driver.copy_frame().mean() < 90
    for size in (MIN_SIZE_PX, (640, 480), (1600, 500), (700, 1200)):
        pygame.display.set_mode(size, pygame.RESIZABLE)
        driver.post(pygame.WINDOWSIZECHANGED, x=size[0], y=size[1])
        driver.settle()
        driver.run_frames(2)
        assert driver.window.layout.size == size
        driver.press_key("f")
        for tab in EditorPanel.tabs:
            driver.window.panel.show_tab(tab)
            driver.run_frames(1, 0.2)


def test_a_message_hides_texts_below_the_map_that_it_would_cover_in_part(driver: EditorDriver) -> None:
    driver.run_frames(1)
    boxes = driver.window.canvas.strip_texts
    without_message = driver.copy_frame()
    check_only_boxes_have_texts(without_message, boxes, driver.window.layout.arena)
    for text in MESSAGES_OF_ALL_LENGTHS:
        driver.editor.show_message(text)
        driver.run_frames(1, seconds=0.0)
        message_box = driver.window.message_box
        assert message_box is not None
        check_texts_are_complete_or_hidden(driver.copy_frame(), without_message, boxes, message_box)


def test_a_screenshot_is_saved(driver: EditorDriver, tmp_path: Path) -> None:
    driver.press_key("f12")
    assert (tmp_path / "robocov-1.png").exists()


def test_the_status_line_shows_position_tool_and_selection(driver: EditorDriver) -> None:
    driver.move_to((3, 3))
    driver.select(0)
    said = list_status(driver.editor, 60.0, None)
    assert said[0].startswith("(3.0") and any("box" in each for each in said) and "60 fps" in said
    driver.press_key("w")
    assert any(each.startswith("Wall: click its points") for each in list_status(driver.editor, 60.0, None))


def test_the_title_of_the_window_marks_unsaved_changes(driver: EditorDriver) -> None:
    driver.select(0)
    driver.press_key("right")
    driver.run_frames(1)
    assert pygame.display.get_caption()[0] == "● Untitled · robocov edit"


def test_the_clipboard_works_without_a_display() -> None:
    pygame.display.quit()
    clipboard = Clipboard()
    clipboard.put("text")
    assert clipboard.get() == "text"


@pytest.mark.slow
def test_dragging_one_of_a_thousand_obstacles_does_not_draw_the_others_again(tmp_path: Path) -> None:
    generator = np.random.default_rng(0)
    rings = []
    for k in range(1000):
        angles = np.sort(generator.uniform(0, 2 * np.pi, 20))
        points = np.column_stack([np.cos(angles), np.sin(angles)]) * generator.uniform(0.25, 0.42, (20, 1))
        rings.append(np.round(points + (k % 32 + 0.5, k // 32 + 0.5), 4))
    shapes = [PolygonObstacle(tuple(map(tuple, ring.tolist()))) for ring in rings]
    sketch = Sketch(boundary=((0, 0), (32, 0), (32, 32), (0, 32))).with_obstacles(shapes)[0]
    with open_editor(tmp_path, sketch, size=(1280, 720), readings=NoReadings()) as driver:
        window = driver.window
        sheet = driver.window.canvas.sheet
        driver.editor.snapper.waits_for_targets = False
        spot = sketch.obstacles[500].geometry.representative_point()
        x, y = driver.find_pixel((spot.x, spot.y))
        driver.press(x, y)
        paint = sheet._redraw_box
        boxes = []
        sheet._redraw_box = lambda *what: (boxes.append(what[-1]), paint(*what))  # type: ignore[method-assign]
        for k in range(20):
            at = round(x + 2 * k), round(y + k % 7)
            driver.post(pygame.MOUSEMOTION, pos=at, rel=(2, 0), buttons=(1, 0, 0))
            window.run_frame(1 / 60)
        assert driver.editor.displayed[0] is not driver.sketch
        whole = window.canvas.camera.view[2] * window.canvas.camera.view[3]
        assert boxes and all(box.width * box.height < whole / 10 for box in boxes)


class NoReadings:
    is_busy = False

    def put(self, question) -> None:
        pass

    def poll(self) -> None:
        return None


def test_a_double_click_that_drags_still_drags(tmp_path: Path) -> None:
    with open_editor(tmp_path, load_sketch("square")) as driver:
        driver.press_key("r")
        driver.drag_at((2, 2), (3, 3), (6, 6))
        driver.press_key("v")
        driver.wait()
        driver.click_at((4, 4))
        driver.drag_at((4, 4), (4.5, 4.5), (5, 4))  # at once
        assert driver.sketch.obstacles[0].geometry.bounds == (3.0, 2.0, 7.0, 6.0)


def test_all_objects_are_listed_including_hidden_ones(driver: EditorDriver) -> None:
    driver.select(0)
    driver.press_key("ctrl+h")
    driver.press_key("ctrl+tab")
    driver.editor.select(Selection())
    driver.run_frames(2)
    lines = [each for each in driver.window.panel.ui.widgets.values() if each.key.startswith("object:")]
    assert lines[-1].text == "boundary" and len(lines) == len(driver.shapes) + 1 + len(driver.sketch.starts)
    driver.click(*driver.get_widget("option", "object:0").rect.center)
    assert driver.editor.selection.items == {0}


def test_a_start_that_is_named_like_a_number_is_selected_in_the_list(tmp_path: Path) -> None:
    """Obstacles have numbers as keys, and so has the boundary."""
    starts = (("0", DiscStart((8, 2), 0.8)), ("-1", DiscStart((2, 8), 0.8)))
    with open_editor(tmp_path, build_sheet(BOX, starts=starts)) as driver:
        driver.open_tab("object")
        driver.editor.select(Selection())
        driver.run_frames(2)
        widgets = driver.window.panel.ui.widgets.values()
        boxes = {each.text: each.rect for each in widgets if each.key.startswith("object:")}
        for text, selection in (
            ("polygon “box”", Selection.of(0)),
            ("start “0”", Selection.of("0")),
            ("start “-1”", Selection.of("-1")),
            ("boundary", Selection(boundary=True)),
        ):
            driver.editor.select(Selection())
            driver.run_frames(2)
            driver.click(*boxes[text].center)
            assert driver.editor.selection == selection


@pytest.mark.slow
def test_many_selected_objects_are_outlined_once_with_the_same_pixels(tmp_path: Path, monkeypatch) -> None:
    shapes = [CircleObstacle((k % 20 * 0.45 + 0.5, k // 20 * 0.8 + 0.5), 0.2) for k in range(210)]
    pictures = []
    for many in (200, 10_000):
        monkeypatch.setattr(layers, "MANY_OBJECTS", many)
        with open_editor(tmp_path, build_sheet(*shapes)) as driver:
            driver.press_key("ctrl+a")
            driver.run_frames(2)
            pictures.append(pygame.surfarray.array3d(driver.window.screen).astype(int))
    assert np.abs(pictures[0] - pictures[1]).max() < 8


def test_an_idle_window_is_not_redrawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with open_editor(tmp_path) as driver:
        driver.move(300, 300)
        driver.run_frames(3)
        driver.editor.message = ""
        driver.run_frames(60)
        drawn: list[int] = []
        monkeypatch.setattr(pygame.display, "flip", lambda: drawn.append(1))
        driver.run_frames(30)
        assert not drawn
        driver.move(310, 300)
        assert drawn
        driver.editor.show_message("something new")
        drawn.clear()
        driver.run_frames(1)
        assert drawn
        driver.press_key("ctrl+k")  # an open dialog needs no frames
        driver.run_frames(320)
        drawn.clear()
        driver.run_frames(20)
        assert driver.window.dialogs.is_open and not drawn


def test_a_fitted_map_stays_fitted_when_the_window_is_resized(tmp_path: Path) -> None:
    with open_editor(tmp_path) as driver:
        shown = driver.window.canvas
        zooms = [driver.window.canvas.camera.zoom]
        for size in ((1700, 1300), (900, 600)):
            pygame.display.set_mode(size, pygame.RESIZABLE)
            driver.post(pygame.WINDOWSIZECHANGED, x=size[0], y=size[1])
            driver.run_frames(2)
            zooms.append(shown.camera.zoom)
            shown.zoom(0.5)  # and not fitted any more
        assert zooms[1] > 1.2 * zooms[0]
        assert zooms[2] == zooms[1] / 2
