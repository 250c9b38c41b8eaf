"""The editor's window: panel, keyboard, mouse, menus, palette, help, sizes."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pygame
import pytest
from driven_editor import Hands, of_map, opened_editor, sheet

from robocov.environment import CircleObstacle, DiscStart, PolygonObstacle
from robocov_app.editor.canvas import layers
from robocov_app.editor.edits.create import add_circle, add_polygon
from robocov_app.editor.model.selection import Selection, Vertex
from robocov_app.editor.model.sketch import Sketch
from robocov_app.editor.ui.fields import format_number
from robocov_app.editor.ui.map_facts import list_status
from robocov_app.editor.ui.panel import EditorPanel
from robocov_app.toolkit.commands import help_page
from robocov_app.toolkit.commands.menu import Menu
from robocov_app.toolkit.dialogs import Choice
from robocov_app.toolkit.window.clipboard import Clipboard
from robocov_app.toolkit.window.layout import MIN_SIZE_PX

BOX = PolygonObstacle(((2, 2), (4, 2), (4, 4), (2, 4)), name="box")
PILLAR = CircleObstacle((7, 7), 1.0)


@pytest.fixture
def hands(tmp_path: Path) -> Iterator[Hands]:
    with opened_editor(tmp_path, sheet(BOX, PILLAR, starts=(("door", DiscStart((8, 2), 0.8)),))) as driver:
        yield driver


# the panel


def test_every_button_does_what_its_action_does(hands: Hands) -> None:
    hands.push("tool:wall")
    assert hands.editor.tool.name == "wall"
    hands.push("tool:select")
    hands.select(0)
    hands.turn("object")
    hands.push("rotate:left")
    assert hands.editor.document.history.undo_descriptions
    hands.push("undo")
    assert hands.shapes[0] == BOX
    hands.push("help")
    assert hands.window.is_help_open


def test_the_map_page_takes_name_radius_and_team(hands: Hands) -> None:
    hands.turn("map")
    hands.write("title", "Our office")
    hands.key("return")
    assert hands.sketch.name == "Our office"
    hands.write("radius", "0.25")
    hands.key("return")
    assert hands.editor.radius == 0.25 and hands.editor.measurement.radius == 0.25
    hands.write("robots", "nine")
    hands.key("return")
    assert hands.editor.has_error_message and hands.editor.robots == 6
    hands.push("more")
    assert hands.editor.robots == 7
    hands.tick("show:robots")
    assert "robots" in hands.editor.shown


def test_numbers_stand_in_fields_without_needless_zeros() -> None:
    assert [format_number(value) for value in (2.0, 0.30004, -0.00001, None)] == ["2", "0.3", "0", ""]


def test_the_object_page_takes_names_places_and_sizes(hands: Hands) -> None:
    hands.select(0)
    hands.turn("object")
    assert hands.widget("entry", "name").text == "box"
    hands.write("x", "3.5")
    hands.key("return")
    hands.write("wide", "120cm")
    hands.key("return")
    assert hands.sketch.get_item(0).geometry.bounds == (3.5, 2.0, 4.7, 4.0)
    hands.write("note", "oak")
    hands.key("return")
    assert hands.sketch.get_item(0).note == "oak"
    hands.select(1)
    hands.write("size:radius", "0.5")
    hands.key("return")
    assert hands.shapes[1].radius == 0.5
    hands.select("door")
    hands.write("name", "entrance")
    hands.key("return")
    assert hands.editor.start_names == ["entrance"]


def test_every_kind_of_selection_has_its_page(hands: Hands) -> None:
    hands.turn("object")
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
        hands.editor.select(selection)
        hands.frames(2, 0.2)


def test_the_list_of_vertices_selects_and_scrolls(hands: Hands) -> None:
    ring = tuple((5 + np.cos(a), 5 + np.sin(a)) for a in np.arange(0, 6.2, 0.1))
    hands.editor.apply(add_polygon(hands.sketch, ring))
    hands.turn("object")
    hands.click(*hands.widget("option", "vertex:1").rect.center)
    assert hands.editor.selection.vertices == {Vertex(hands.sketch.obstacles[-1].key, 0, 1)}
    assert hands.find("option", "vertex:61") is None, "what is out of sight is not laid out"
    at = hands.widget("option", "vertex:3").rect.center
    for _ in range(8):
        hands.wheel(*at, -5)
    hands.click(*hands.widget("option", "vertex:61").rect.center)
    (vertex,) = hands.editor.selection.vertices
    assert vertex.index == 61


def test_the_snap_page_switches_and_sets(hands: Hands) -> None:
    hands.turn("snap")
    hands.tick("snap:grid")
    assert "grid" not in hands.editor.snaps
    hands.tick("show:names")
    assert "names" not in hands.editor.shown
    hands.write("grid", "0.5")
    hands.key("return")
    assert hands.editor.grid == 0.5


def test_pages_are_turned_by_keys(hands: Hands) -> None:
    seen = []
    for _ in EditorPanel.tabs:
        hands.key("ctrl+tab")
        seen.append(hands.window.panel.tab)
    assert sorted(seen) == sorted(EditorPanel.tabs)
    hands.key("h")
    assert hands.window.layout.panel[2] == 0
    hands.key("f2")  # the field of the map's name brings the panel back
    assert hands.window.layout.panel[2] > 0 and hands.window.panel.ui.edit
    hands.type("New name")
    hands.key("return")
    assert hands.sketch.name == "New name"


def test_the_cursor_is_the_tools_over_the_map_and_an_arrow_over_the_panel(hands: Hands) -> None:
    hands.key("w")
    hands.go((5.0, 5.0))
    hands.wait()
    assert hands.window.cursor.shape == pygame.SYSTEM_CURSOR_CROSSHAIR
    hands.move(hands.window.layout.panel[0] + 20, 200)
    hands.wait()
    assert hands.window.cursor.shape == pygame.SYSTEM_CURSOR_ARROW


def test_keys_go_into_fields_and_not_to_actions_while_typing(hands: Hands) -> None:
    hands.turn("map")
    hands.write("title", "wall")
    assert hands.editor.tool.name == "select" and hands.window.panel.ui.edit
    hands.key("escape")
    assert not hands.window.panel.ui.edit and hands.sketch.name == "Untitled"


def test_what_is_typed_into_a_field_is_undone_there_and_not_in_the_map(hands: Hands) -> None:
    hands.editor.apply(add_circle(hands.sketch, (5, 5), 0.2))
    drawn = hands.sketch
    hands.turn("map")
    hands.write("title", "ab")
    hands.key("left")
    hands.type("c")
    texts = []
    for key in ("", "ctrl+z", "ctrl+z", "ctrl+z", "ctrl+y", "ctrl+y"):
        if key:
            hands.key(key)
        texts.append(hands.widget("entry", "title").text)
    assert texts == ["acb", "ab", "Untitled", "Untitled", "ab", "acb"] and hands.sketch is drawn


def test_the_list_of_what_was_done_leads_back_and_forth(hands: Hands) -> None:
    for radius in (0.2, 0.3, 0.4):
        hands.editor.apply(add_circle(hands.sketch, (5, 5), radius))
    hands.turn("history")

    def lines() -> list[tuple[str, bool]]:
        hands.frames(1)
        shown = hands.window.panel.ui.widgets.values()
        return [(each.text, bool(each.value)) for each in shown if each.key.startswith("step:")]

    def click(row: int) -> None:
        hands.wait()
        hands.click(*hands.widget("option", f"step:{row}").rect.center)

    assert [chosen for _, chosen in lines()] == [True, False, False, False]
    click(2)
    assert len(hands.shapes) == 3
    assert [chosen for _, chosen in lines()] == [False, False, True, False]
    click(3)
    assert len(hands.shapes) == 2
    click(0)
    assert len(hands.shapes) == 5


# the mouse


def test_wheel_and_right_button_zoom_and_pan(hands: Hands) -> None:
    at = hands.pixel((5, 5))
    zoom = hands.window.canvas.camera.zoom
    hands.wheel(*at, 3)
    assert hands.window.canvas.camera.zoom > zoom * 1.3
    assert hands.pixel((5, 5)) == pytest.approx(at, abs=1)
    center = hands.window.canvas.camera.center
    hands.drag((300, 300), (330, 310), (360, 320), button=3)
    moved = hands.window.canvas.camera.center
    assert moved[0] < center[0] and hands.editor.dialogs.current is None
    hands.key("f")
    assert hands.window.canvas.camera.zoom == pytest.approx(zoom)


def test_space_and_the_pan_tool_move_the_sheet(hands: Hands) -> None:
    center = hands.window.canvas.camera.center
    hands.key("g")
    hands.drag((300, 300), (330, 310), (360, 320))
    assert hands.window.canvas.camera.center != center
    hands.key("v")
    before, center = hands.sketch, hands.window.canvas.camera.center
    hands.post(pygame.KEYDOWN, key=pygame.K_SPACE, mod=0, unicode=" ", scancode=0)
    hands.settle()
    hands.drag_at((3, 3), (3.5, 3.5), (4, 4))
    hands.post(pygame.KEYUP, key=pygame.K_SPACE, mod=0, unicode=" ", scancode=0)
    hands.settle()
    assert hands.sketch is before and hands.window.canvas.camera.center != center
    hands.drag_at((3, 3), (3.5, 3.5), (4, 4))
    assert hands.sketch is not before


def test_the_map_cannot_be_lost_from_sight(hands: Hands) -> None:
    for _ in range(80):
        hands.key("ctrl+left")
        hands.wheel(300, 300, -5)
    low_x, low_y, high_x, high_y = hands.window.canvas.camera.compute_visible_bounds()
    assert low_x < 10 and high_x > 0 and low_y < 10 and high_y > 0
    hands.key("f")
    hands.select(1)
    hands.key("z")
    low_x, _, high_x, _ = hands.window.canvas.camera.compute_visible_bounds()
    assert high_x - low_x < 5


def test_the_menu_offers_what_applies_and_does_it(hands: Hands) -> None:
    hands.click_at((3, 3), button=3)
    menu = hands.editor.dialogs.current
    assert isinstance(menu, Menu) and hands.editor.selection == Selection.of(0)
    hands.window.draw()
    names = [action.name if action else "" for action in menu.rows]
    row = names.index("duplicate")
    hands.key("down", times=sum(1 for name in names[: row + 1] if name))
    hands.key("return")
    assert len(hands.shapes) == 3 and hands.editor.dialogs.current is None
    hands.click_at((9.5, 5), button=3)
    hands.window.draw()
    assert not hands.editor.selection
    assert "paste" in [action.name for action in hands.editor.dialogs.current.rows if action]
    hands.click(*hands.window.dialogs.ui.widgets["option:select:all"].rect.center)
    assert hands.editor.dialogs.current is None and hands.editor.selection
    hands.click_at((3, 3), button=3)
    hands.key("escape")
    assert hands.editor.dialogs.current is None
    hands.click_at((3, 3), button=3)
    hands.post(pygame.DROPFILE, file="nowhere.txt")
    hands.settle()
    assert hands.editor.dialogs.current is None and "nowhere.txt" in hands.said


def test_a_right_click_ends_what_is_being_drawn(hands: Hands) -> None:
    hands.key("p")
    hands.click_all((5, 1), (6, 1), (6, 2))
    hands.click_at((6, 2), button=3)
    assert len(hands.shapes) == 3 and hands.editor.dialogs.current is None


# palette, help, look


def test_the_palette_does_actions_and_commands(hands: Hands) -> None:
    hands.select(0)
    hands.key("ctrl+k")
    hands.type("mirror left")
    hands.key("return")
    assert hands.editor.document.history.undo_descriptions
    hands.command("rotate 90")
    assert "turned" in hands.said or "rotated" in hands.said
    hands.key("/")
    assert isinstance(hands.editor.dialogs.current, Choice) and hands.editor.dialogs.current.text == ""
    hands.key("escape")
    assert hands.editor.dialogs.current is None


@pytest.mark.parametrize(("size", "scale"), [((900, 600), 1.0), ((1280, 720), 1.0), ((1920, 1080), 1.5)])
def test_all_keys_are_on_the_card(tmp_path: Path, size, scale: float, monkeypatch) -> None:
    words: set[str] = set()
    real = help_page.render_text

    def label(text, *rest):
        words.add(text)
        return real(text, *rest)

    with opened_editor(tmp_path, size=size, scale=scale) as hands:
        monkeypatch.setattr(help_page, "render_text", label)
        hands.key("f1")
    for action in hands.window.commands.commands:
        if action.keys and not action.hidden:
            title = action.title.partition(":")[0]
            assert any(word.strip("… ") and title.startswith(word.rstrip("…")) for word in words), title


def test_light_dark_and_every_size(hands: Hands) -> None:
    hands.key("t")
    assert hands.picture().mean() < 90
    for size in (MIN_SIZE_PX, (640, 480), (1600, 500), (700, 1200)):
        pygame.display.set_mode(size, pygame.RESIZABLE)
        hands.post(pygame.WINDOWSIZECHANGED, x=size[0], y=size[1])
        hands.settle()
        hands.frames(2)
        assert hands.window.layout.size == size
        hands.key("f")
        for tab in EditorPanel.tabs:
            hands.window.panel.show_tab(tab)
            hands.frames(1, 0.2)


def test_a_screenshot_is_saved(hands: Hands, tmp_path: Path) -> None:
    hands.key("f12")
    assert (tmp_path / "robocov-1.png").exists()


def test_the_status_line_says_where_what_and_how(hands: Hands) -> None:
    hands.go((3, 3))
    hands.select(0)
    said = list_status(hands.editor, 60.0, None)
    assert said[0].startswith("(3.0") and any("box" in each for each in said) and "60 fps" in said
    hands.key("w")
    assert any(each.startswith("Wall: click its points") for each in list_status(hands.editor, 60.0, None))


def test_the_title_of_the_window_tells_what_is_unsaved(hands: Hands) -> None:
    hands.select(0)
    hands.key("right")
    hands.frames(1)
    assert pygame.display.get_caption()[0] == "● Untitled · robocov edit"


def test_the_clipboard_keeps_texts_also_without_a_display() -> None:
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
    with opened_editor(tmp_path, sketch, size=(1280, 720), readings=NoReadings()) as hands:
        window, sheet = hands.window, hands.window.canvas.sheet
        hands.editor.snapper.waits_for_targets = False
        spot = sketch.obstacles[500].geometry.representative_point()
        x, y = hands.pixel((spot.x, spot.y))
        hands.press(x, y)
        paint, boxes = sheet._paint, []
        sheet._paint = lambda *what: (boxes.append(what[-1]), paint(*what))  # type: ignore[method-assign]
        for k in range(20):
            at = round(x + 2 * k), round(y + k % 7)
            hands.post(pygame.MOUSEMOTION, pos=at, rel=(2, 0), buttons=(1, 0, 0))
            window.run_frame(1 / 60)
        assert hands.editor.displayed[0] is not hands.sketch
        whole = window.canvas.camera.view[2] * window.canvas.camera.view[3]
        assert boxes and all(box.width * box.height < whole / 10 for box in boxes)


class NoReadings:
    is_busy = False

    def put(self, question) -> None:
        pass

    def poll(self) -> None:
        return None


def test_a_double_click_that_drags_still_drags(tmp_path: Path) -> None:
    with opened_editor(tmp_path, of_map("square")) as hands:
        hands.key("r")
        hands.drag_at((2, 2), (3, 3), (6, 6))
        hands.key("v")
        hands.wait()
        hands.click_at((4, 4))
        hands.drag_at((4, 4), (4.5, 4.5), (5, 4))  # at once
        assert hands.sketch.obstacles[0].geometry.bounds == (3.0, 2.0, 7.0, 6.0)


def test_all_things_are_listed_also_those_that_are_hidden(hands: Hands) -> None:
    hands.select(0)
    hands.key("ctrl+h")
    hands.key("ctrl+tab")
    hands.editor.select(Selection())
    hands.frames(2)
    lines = [each for each in hands.window.panel.ui.widgets.values() if each.key.startswith("object:")]
    assert lines[-1].text == "boundary" and len(lines) == len(hands.shapes) + 1 + len(hands.sketch.starts)
    hands.click(*hands.widget("option", "object:0").rect.center)
    assert hands.editor.selection.items == {0}


@pytest.mark.slow
def test_many_selected_things_are_outlined_once_and_look_the_same(tmp_path: Path, monkeypatch) -> None:
    shapes = [CircleObstacle((k % 20 * 0.45 + 0.5, k // 20 * 0.8 + 0.5), 0.2) for k in range(210)]
    pictures = []
    for many in (200, 10_000):
        monkeypatch.setattr(layers, "MANY_OBJECTS", many)
        with opened_editor(tmp_path, sheet(*shapes)) as hands:
            hands.key("ctrl+a")
            hands.frames(2)
            pictures.append(pygame.surfarray.array3d(hands.window.screen).astype(int))
    assert np.abs(pictures[0] - pictures[1]).max() < 8


def test_a_window_that_nobody_touches_is_not_drawn_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with opened_editor(tmp_path) as hands:
        hands.move(300, 300)
        hands.frames(3)
        hands.editor.message = ""
        hands.frames(60)
        drawn: list[int] = []
        monkeypatch.setattr(pygame.display, "flip", lambda: drawn.append(1))
        hands.frames(30)
        assert not drawn
        hands.move(310, 300)
        assert drawn
        hands.editor.show_message("something new")
        drawn.clear()
        hands.frames(1)
        assert drawn
        hands.key("ctrl+k")  # what is asked does not move by itself
        hands.frames(320)
        drawn.clear()
        hands.frames(20)
        assert hands.window.dialogs.is_open and not drawn


def test_a_map_that_is_fitted_stays_so_in_a_window_of_another_size(tmp_path: Path) -> None:
    with opened_editor(tmp_path) as hands:
        shown, zooms = hands.window.canvas, [hands.window.canvas.camera.zoom]
        for size in ((1700, 1300), (900, 600)):
            pygame.display.set_mode(size, pygame.RESIZABLE)
            hands.post(pygame.WINDOWSIZECHANGED, x=size[0], y=size[1])
            hands.frames(2)
            zooms.append(shown.camera.zoom)
            shown.zoom(0.5)  # and not fitted any more
        assert zooms[1] > 1.2 * zooms[0]
        assert zooms[2] == zooms[1] / 2
