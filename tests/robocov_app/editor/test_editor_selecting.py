"""Selecting, moving, turning, scaling, copying, and editing vertices with the mouse."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from driven_editor import EditorDriver, build_sheet, open_editor

from robocov.environment import CircleObstacle, DiscStart, PointsStart, PolygonObstacle, WallObstacle
from robocov_app.editor.model.selection import Selection, Vertex
from robocov_app.editor.model.sketch import BOUNDARY
from robocov_app.editor.tools.handles import find_handle, list_handles, list_vertex_owners
from robocov_app.toolkit.commands.menu import Menu
from robocov_app.toolkit.window.layout import MIN_SIZE_PX

SQUARE = PolygonObstacle(((2, 2), (4, 2), (4, 4), (2, 4)), name="box")
PILLAR = CircleObstacle((7, 7), 1.0)
WALL = WallObstacle(((6, 1), (6, 3), (8, 3)), 0.2)


@pytest.fixture
def driver(tmp_path: Path) -> Iterator[EditorDriver]:
    start = (("corner", DiscStart((1, 8.5), 0.6)),)
    with open_editor(tmp_path, build_sheet(SQUARE, PILLAR, WALL, starts=start)) as driver:
        yield driver


def find_handle_pixel(driver: EditorDriver, kind: str, side: tuple[int, int] = (0, 0)) -> tuple[float, float]:
    """Return the pixel of a handle."""
    handles = driver.editor.handles
    (position,) = [handle.position for handle in handles if handle.kind == kind and handle.side == side]
    return driver.find_pixel(position)


def test_a_click_selects_shift_toggles_and_the_floor_clears(driver: EditorDriver) -> None:
    driver.click_all((3, 3))
    assert driver.editor.selection == Selection.of(0)
    driver.hold_keys("shift")
    driver.click_all((7, 7))
    assert driver.editor.selection == Selection.of(0, 1)
    driver.click_all((3, 3))
    driver.hold_keys()
    assert driver.editor.selection == Selection.of(1)
    driver.click_all((9, 5))
    assert not driver.editor.selection
    driver.click_all((1, 8.5))
    assert driver.editor.selection == Selection.of("corner")
    driver.click_all((10, 5))
    assert driver.editor.selection == Selection.of(BOUNDARY)


def test_a_box_selects_objects_inside_or_leftwards_also_touched_ones(driver: EditorDriver) -> None:
    driver.drag_at((1.5, 1.5), (3, 3), (5, 5))
    assert driver.editor.selection == Selection.of(0)
    driver.press_key("escape")
    driver.drag_at((3, 1.5), (4, 4), (7.5, 5))
    assert driver.editor.selection == Selection()
    driver.drag_at((7.5, 5), (4, 4), (3, 1.5))
    assert driver.editor.selection == Selection.of(0, 2)


def test_dragging_moves_and_can_be_undone_as_one(driver: EditorDriver) -> None:
    driver.drag_at((3, 3), (3.5, 3.2), (4, 3.5), (5, 3))
    assert driver.shapes[0].vertices == ((4, 2), (6, 2), (6, 4), (4, 4))
    assert driver.shapes[0].name == "box" and driver.editor.selection == Selection.of(0)
    driver.press_key("ctrl+z")
    assert driver.shapes[0] == SQUARE
    assert not driver.editor.document.history.undo_descriptions
    driver.press_key("ctrl+y")
    assert driver.shapes[0].vertices[0] == (4, 2)


def test_escape_cancels_a_drag(driver: EditorDriver) -> None:
    before = driver.sketch
    driver.press(*driver.find_pixel((3, 3)))
    driver.move_to((4, 4), (5, 5), held=1)
    assert driver.editor.displayed[0] is not driver.sketch
    driver.press_key("escape")
    driver.move_to((6, 6), held=1)
    driver.release()
    assert driver.sketch is before and driver.editor.displayed[0] is driver.sketch


def test_alt_drag_copies(driver: EditorDriver) -> None:
    driver.hold_keys("alt")
    driver.drag_at((7, 7), (7.5, 5), (9, 5))
    driver.hold_keys()
    assert driver.shapes[1] == PILLAR and driver.shapes[3] == CircleObstacle((9, 5), 1.0)
    assert driver.editor.selection == Selection(items=frozenset({driver.sketch.obstacles[3].key}))


def test_a_drag_takes_a_typed_distance(driver: EditorDriver) -> None:
    driver.press(*driver.find_pixel((3, 3)))
    driver.move_to((3.6, 3.1), (4, 3), held=1)
    driver.type("0.25 -0.5")
    driver.press_key("return")
    driver.release()
    assert driver.shapes[0].vertices[0] == (2.25, 1.5)


def test_a_size_cannot_be_typed_for_a_selection_without_that_size(tmp_path: Path) -> None:
    starts = (("column", PointsStart(((6, 2), (6, 4)))),)
    with open_editor(tmp_path, build_sheet(starts=starts)) as driver:
        driver.select("column")
        driver.press(*find_handle_pixel(driver, "scale", (1, 0)))
        driver.move_to((7, 3), (8, 3), held=1)
        driver.type("2")
        driver.press_key("return")
        assert driver.message == "The selection has no width that can be scaled"
        driver.press_key("escape")
        driver.release()
        assert driver.sketch.starts == starts


def test_a_vertex_is_dragged_alone_and_several_together(driver: EditorDriver) -> None:
    driver.click_all((3, 3))
    driver.drag_at((4, 4), (4.5, 4.5), (5, 5))
    assert driver.shapes[0].vertices == ((2, 2), (4, 2), (5, 5), (2, 4))
    assert driver.editor.selection.vertices == {Vertex(0, 0, 2)}
    driver.hold_keys("shift")
    driver.click_all((4, 2))
    driver.hold_keys()
    assert len(driver.editor.selection.vertices) == 2
    driver.drag_at((4, 2), (4.5, 2), (5, 2))
    assert driver.shapes[0].vertices == ((2, 2), (5, 2), (6, 5), (2, 4))


def test_a_double_click_on_an_edge_inserts_a_vertex_and_delete_removes_it(driver: EditorDriver) -> None:
    driver.click_all((3, 3))
    driver.double_click((3, 4))
    assert (3, 4) in driver.shapes[0].vertices and len(driver.shapes[0].vertices) == 5
    driver.press_key("delete")
    assert driver.shapes[0].vertices == SQUARE.vertices


def test_corners_are_cut_off_and_rounded(driver: EditorDriver) -> None:
    driver.click_all((3, 3), (4, 4))
    driver.press_key("shift+b")
    assert set(driver.shapes[0].vertices) >= {(4, 3.8), (3.8, 4)}
    driver.press_key("ctrl+z")
    driver.run_command("round 0.5")
    assert len(driver.shapes[0].vertices) > 6


def test_a_box_selects_vertices_of_the_selection(driver: EditorDriver) -> None:
    driver.click_all((3, 3))
    driver.drag_at((4.6, 1.4), (4.2, 3), (3.6, 4.6))
    assert driver.editor.selection.vertices == {Vertex(0, 0, 1), Vertex(0, 0, 2)}
    driver.press_key("escape")
    assert driver.editor.selection == Selection.of(0)


def test_the_rim_of_a_circle_and_of_a_start_are_dragged(driver: EditorDriver) -> None:
    driver.click_all((7, 7))
    driver.drag_at((8, 7), (8.2, 7), (8.5, 7))
    assert driver.shapes[1] == CircleObstacle((7, 7), 1.5)
    driver.click_all((1, 8.5))
    driver.drag_at((1, 9.1), (1, 9.2), (1, 9.4))
    assert driver.sketch.get_start("corner") == DiscStart((1, 8.5), 0.9)


def test_the_knob_turns_by_dragging_and_by_degrees(driver: EditorDriver) -> None:
    driver.select(2)
    x, y = find_handle_pixel(driver, "rotate")
    driver.press(x, y)
    driver.move(x + 60, y + 20, held=1)
    driver.type("90")
    driver.press_key("return")
    driver.release()
    # A quarter turn about the center of the frame, which is (6.95, 2.05) because the wall has a width.
    assert np.array(driver.shapes[2].points) == pytest.approx(np.array([(8.0, 1.1), (6.0, 1.1), (6.0, 3.1)]))
    bounds = driver.sketch.get_item(2).geometry.bounds
    assert bounds[2] - bounds[0] == pytest.approx(2.1, abs=1e-3)


def test_shift_turns_in_steps(driver: EditorDriver) -> None:
    driver.select(0)
    x, y = find_handle_pixel(driver, "rotate")
    driver.hold_keys("shift")
    cx, cy = driver.find_pixel((3, 3))
    driver.drag((x, y), (cx + 40, cy - 60), (cx + 100, cy - 97))
    driver.hold_keys()
    assert driver.shapes[0].vertices != SQUARE.vertices
    (ax, ay), (bx, by) = driver.shapes[0].vertices[:2]
    import math

    angle = math.degrees(math.atan2(by - ay, bx - ax))
    assert angle / 15 == pytest.approx(round(angle / 15), abs=1e-2)


def test_corners_and_sides_of_the_box_scale(driver: EditorDriver) -> None:
    driver.select(0)
    x, y = find_handle_pixel(driver, "scale", (1, 0))
    one = driver.find_pixel((1, 0))[0] - driver.find_pixel((0, 0))[0]
    driver.drag((x, y), (x + one / 2, y), (x + one, y))
    assert driver.shapes[0].vertices == ((2, 2), (5, 2), (5, 4), (2, 4))
    x, y = find_handle_pixel(driver, "scale", (1, 1))
    driver.hold_keys("shift")
    driver.drag((x, y), (x + one, y - one), (x + 1.5 * one, y - one))
    driver.hold_keys()
    low_x, low_y, high_x, high_y = driver.sketch.get_item(0).geometry.bounds
    assert (low_x, low_y) == (2, 2)
    assert (high_x - low_x) / (high_y - low_y) == pytest.approx(1.5, rel=1e-3)


def test_a_circle_stays_a_circle_when_it_is_scaled(driver: EditorDriver) -> None:
    driver.select(1)
    x, y = find_handle_pixel(driver, "scale", (1, 0))
    driver.drag((x, y), (x + 20, y), (x + 40, y + 5))
    assert isinstance(driver.shapes[1], CircleObstacle) and driver.shapes[1].radius > 1.0


def test_arrows_nudge_by_the_grid_and_shift_ten_times_as_far(driver: EditorDriver) -> None:
    driver.select(0)
    driver.press_key("right", times=3)
    driver.press_key("up")
    driver.press_key("shift+left")
    assert driver.shapes[0].vertices[0] == (1.3, 2.1)
    driver.press_key("ctrl+z")
    assert driver.shapes[0] == SQUARE  # pressed in a row, they are one


def test_clicking_again_selects_the_object_below(tmp_path: Path) -> None:
    lower = PolygonObstacle(((1, 1), (6, 1), (6, 6), (1, 6)))
    upper = PolygonObstacle(((2, 2), (4, 2), (4, 4)))
    with open_editor(tmp_path, build_sheet(lower, upper)) as driver:
        driver.click_all((3.5, 2.5))
        assert driver.editor.selection == Selection.of(1)
        driver.click_all((3.5, 2.5))
        assert driver.editor.selection == Selection.of(0)
        driver.click_all((3.5, 2.5))
        assert driver.editor.selection == Selection.of(1)


def test_many_objects_are_dragged_as_an_image_with_the_same_result(tmp_path: Path) -> None:
    from robocov_app.editor.edits import transform
    from robocov_app.editor.tools.selection_drags import MANY_POINTS

    ring = tuple((1 + 0.5 * k / 300, 1 + (k % 2) * 0.2) for k in range(MANY_POINTS + 10))
    with open_editor(tmp_path, build_sheet(WallObstacle(ring, 0.01), SQUARE)) as driver:
        expected = transform.move(driver.sketch, Selection.of(0, 1), 1.0, 0.5).sketch
        driver.select(0, 1)
        driver.press(*driver.find_pixel((3, 3)))
        driver.move_to((3.5, 3.2), (4, 3.5), held=1)
        assert driver.editor.displayed[0] is driver.sketch
        assert driver.editor.toolbox.selector.drag.dragged_image.offset == pytest.approx((1.0, 0.5))
        driver.release()
        assert driver.shapes == [item.shape for item in expected.obstacles]


def test_handles_belong_to_the_shown_vertices(driver: EditorDriver) -> None:
    assert list_vertex_owners(Selection()) == () and list_vertex_owners(Selection.of(0, 1)) == ()
    assert list_vertex_owners(Selection.of(2)) == (2,)
    assert list_vertex_owners(Selection(vertices=frozenset({Vertex(1, 0, 0)}))) == (1,)
    found = list_handles(driver.sketch, Selection.of(0), 0.01)
    assert sum(each.kind == "vertex" for each in found) == 4
    assert sum(each.kind == "scale" for each in found) == 8
    assert find_handle(found, (4, 4), 0.2).vertex == Vertex(0, 0, 2)
    assert find_handle(found, (3, 3), 0.2) is None


def test_the_cursor_shows_the_effect_of_a_press(driver: EditorDriver) -> None:
    selector = driver.editor.toolbox.selector
    driver.move_to((9, 5))
    assert selector.choose_cursor(driver.editor) == "arrow"
    driver.move_to((3, 3))
    assert selector.choose_cursor(driver.editor) == "hand"
    driver.select(0)
    driver.move_to((3, 3.01))
    assert selector.choose_cursor(driver.editor) == "move"
    driver.move(*find_handle_pixel(driver, "scale", (1, 1)))
    assert selector.choose_cursor(driver.editor) == "rising"


def test_small_objects_are_dragged_instead_of_their_vertices(tmp_path: Path) -> None:
    pillar = PolygonObstacle(((5, 5), (5.4, 5), (5.4, 5.4), (5, 5.4)))
    wide = replace(build_sheet(pillar), boundary=((0, 0), (80, 0), (80, 80), (0, 80)))
    with open_editor(tmp_path, wide) as driver:
        driver.press_key("f")
        driver.click_at((5.2, 5.2))
        assert driver.editor.selection == Selection.of(0)
        driver.wait()
        driver.hold_keys("ctrl")
        driver.drag_at((5.2, 5.2), (15, 15), (25.2, 25.2))
        (moved,) = driver.shapes
        assert moved.polygon.area == pytest.approx(0.16, abs=1e-3)
        assert moved.vertices[0] == pytest.approx((25, 25), abs=0.3)


def get_ink(driver: EditorDriver, point: tuple[float, float]) -> tuple[int, ...]:
    x, y = map(round, driver.find_pixel(point))
    return tuple(driver.copy_frame()[y, x].tolist())


def test_the_object_under_the_cursor_has_an_outline(driver: EditorDriver) -> None:
    edge = (2.0, 3.0)
    driver.move_to((9, 5))
    plain = get_ink(driver, edge)
    driver.move_to((3, 3))
    assert get_ink(driver, edge) != plain
    driver.move_to((9, 5))
    assert get_ink(driver, edge) == plain


def test_shift_moves_objects_along_multiples_of_45_degrees(driver: EditorDriver) -> None:
    driver.select(0)
    driver.hold_keys("shift")
    driver.drag_at((3, 3), (3.5, 3.6), (4.2, 4.0))
    driver.hold_keys()
    x, y = driver.shapes[0].vertices[0]
    assert x > 2.5
    assert x - 2 == pytest.approx(y - 2, abs=1e-3)


def open_menu(driver: EditorDriver, point: tuple[float, float]) -> list[str]:
    """Right-click a position, m, and return the names of the commands in the menu."""
    driver.click_at(point, button=3)
    menu = driver.editor.dialogs.current
    assert isinstance(menu, Menu)
    driver.window.draw()
    return [command.name for command in menu.rows if command is not None]


def test_the_menu_of_a_wall_changes_its_width(driver: EditorDriver) -> None:
    assert "wall:width" not in open_menu(driver, (3, 3))
    driver.press_key("escape")
    point = WALL.points[0]
    assert {"duplicate", "delete", "wider", "narrower", "wall:width"} <= set(open_menu(driver, point))
    driver.click(*driver.window.dialogs.ui.widgets["option:wider"].rect.center)
    assert driver.shapes[2].width == pytest.approx(1.25 * WALL.width, abs=1e-3)
    open_menu(driver, point)
    driver.click(*driver.window.dialogs.ui.widgets["option:wall:width"].rect.center)
    driver.type("0.4")
    driver.press_key("return")
    assert driver.shapes[2].width == 0.4


def test_menus_fit_into_the_smallest_window(tmp_path: Path) -> None:
    shapes = [SQUARE, PILLAR, WALL, PolygonObstacle(((1, 1), (9, 9), (9, 1), (1, 9)))]
    with open_editor(tmp_path, build_sheet(*shapes), size=MIN_SIZE_PX) as driver:
        driver.select(0, 1, 2, 3)
        assert len(open_menu(driver, (3, 3))) > 15
        window = driver.window.screen.get_rect()
        rects = [widget.rect for widget in driver.window.dialogs.ui.widgets.values()]
        assert all(window.contains(rect) for rect in rects)
        assert all(rect.height > 10 for rect in rects)
