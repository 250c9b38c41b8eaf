"""Drawing with the tools by clicks, drags and typed numbers."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from driven_editor import EditorDriver, build_sheet, open_editor
from PIL import Image

from robocov.environment import CircleObstacle, DiscStart, PointsStart, PolygonObstacle, WallObstacle
from robocov_app.editor.tools.tool_overlay import EditorToolOverlay


@pytest.fixture
def driver(tmp_path: Path) -> Iterator[EditorDriver]:
    with open_editor(tmp_path, build_sheet()) as driver:
        yield driver


def test_a_polygon_is_closed_by_enter_a_double_click_or_its_first_corner(driver: EditorDriver) -> None:
    corners = ((2, 2), (4, 2), (4, 4))
    driver.press_key("p")
    driver.click_all(*corners)
    driver.press_key("return")
    driver.click_all(*corners[:2])
    driver.double_click(corners[2])
    driver.click_all(*corners, corners[0])
    assert driver.shapes == [PolygonObstacle(corners)] * 3
    assert driver.message == "Polygon drawn"


def test_drawing_snaps_to_the_grid_unless_ctrl_is_pressed(driver: EditorDriver) -> None:
    driver.press_key("r")
    driver.drag_at((1.02, 0.98), (2.0, 2.0), (3.03, 2.01))
    assert set(driver.shapes[0].vertices) == {(1, 1), (3, 1), (3, 2), (1, 2)}
    driver.hold_keys("ctrl")
    driver.drag_at((5.037, 5.037), (6.0, 6.0), (7.037, 7.037))
    assert all(abs(x * 10 - round(x * 10)) > 1e-3 for x, _ in driver.shapes[1].vertices)


def test_escape_cancels_and_backspace_removes_a_point(driver: EditorDriver) -> None:
    driver.press_key("p")
    driver.click_all((2, 2), (4, 2), (5, 5))
    driver.press_key("backspace")
    driver.click_all((4, 4))
    driver.press_key("return")
    assert driver.shapes == [PolygonObstacle(((2, 2), (4, 2), (4, 4)))]
    driver.click_all((6, 6), (7, 7))
    driver.press_key("escape")
    assert len(driver.shapes) == 1 and not driver.editor.tool.is_busy and driver.editor.tool.name == "polygon"
    driver.press_key("escape")
    assert driver.editor.tool.name == "select"


def test_too_few_points_are_reported(driver: EditorDriver) -> None:
    driver.press_key("p")
    driver.click_all((2, 2), (4, 2))
    driver.press_key("return")
    assert (
        driver.editor.has_error_message and "2 of at least 3 points" in driver.message and not driver.shapes
    )


def test_a_wall_takes_typed_lengths_and_coordinates(driver: EditorDriver) -> None:
    driver.press_key("w")
    driver.click_all((1, 1))
    driver.move_to((1, 4))
    driver.type("2.5")
    assert driver.editor.typed == "2.5"
    driver.press_key("return")
    driver.type("@2<0")
    driver.press_key("return")
    driver.type("+0 -1")
    driver.press_key("return")
    driver.press_key("return")
    assert driver.shapes == [WallObstacle(((1, 1), (1, 3.5), (3, 3.5), (3, 2.5)), 0.1)]


def test_typed_values_can_be_corrected_and_canceled(driver: EditorDriver) -> None:
    driver.press_key("w")
    driver.click_all((1, 1))
    driver.move_to((1, 4))
    driver.type("29")
    driver.press_key("backspace")
    driver.press_key("return")
    assert driver.editor.tool.points == [(1.0, 1.0), (1.0, 3.0)]
    driver.type("7")
    driver.press_key("escape")
    assert driver.editor.typed == "" and driver.editor.tool.is_busy
    driver.type("1..2")
    driver.press_key("return")
    assert driver.editor.has_error_message and len(driver.editor.tool.points) == 2


def test_the_width_of_walls_is_changed_by_brackets(driver: EditorDriver) -> None:
    driver.press_key("w")
    driver.press_key("]")
    driver.press_key("]")
    driver.press_key("[")
    driver.click_all((1, 1), (4, 1))
    driver.press_key("return")
    assert driver.shapes[0].width == pytest.approx(0.125, abs=1e-3)
    driver.press_key("v")
    driver.press_key("]")  # the wall that was drawn is selected
    assert driver.shapes[0].width == pytest.approx(0.156, abs=1e-3)


def test_rectangles_and_circles_are_drawn_by_clicks_and_by_size(driver: EditorDriver) -> None:
    driver.press_key("r")
    driver.click_all((1, 1))
    driver.move_to((0.5, 3))
    driver.type("0.5 x 2")
    driver.press_key("return")
    driver.click_all((4, 4), (6, 5))
    driver.press_key("c")
    driver.click_all((8, 8))
    driver.move_to((8.5, 8))
    driver.type("75cm")
    driver.press_key("return")
    first, second, circle = driver.shapes
    assert set(first.vertices) == {(1, 1), (0.5, 1), (0.5, 3), (1, 3)}
    assert set(second.vertices) == {(4, 4), (6, 4), (6, 5), (4, 5)}
    assert circle == CircleObstacle((8, 8), 0.75)


def test_shift_makes_squares_and_round_angles(driver: EditorDriver) -> None:
    driver.press_key("r")
    driver.hold_keys("shift")
    driver.drag_at((1, 1), (2, 1.5), (3, 2))
    driver.hold_keys()
    assert set(driver.shapes[0].vertices) == {(1, 1), (3, 1), (3, 3), (1, 3)}
    driver.press_key("w")
    driver.click_all((5, 5))
    driver.hold_keys("shift")
    driver.click_all((8, 5.2))
    driver.hold_keys()
    driver.press_key("return")
    (ax, ay), (bx, by) = driver.shapes[1].points
    assert ay == by == 5 and bx > ax


def test_the_boundary_is_drawn_by_dragging_by_corners_and_by_size(driver: EditorDriver) -> None:
    driver.press_key("b")
    driver.drag_at((1, 1), (5, 5), (9, 7))
    assert set(driver.sketch.boundary) == {(1, 1), (9, 1), (9, 7), (1, 7)}
    driver.click_all((1, 1), (9, 1), (5, 6))
    driver.press_key("return")
    assert driver.sketch.boundary == ((1, 1), (9, 1), (5, 6))
    driver.click_all((0, 0))
    driver.move_to((3, 3))
    driver.type("12 x 8")
    driver.press_key("return")
    assert set(driver.sketch.boundary) == {(0, 0), (12, 0), (12, 8), (0, 8)}
    driver.press_key("ctrl+z", times=3)
    assert driver.sketch.boundary == build_sheet().boundary


def test_the_first_point_can_be_typed(driver: EditorDriver) -> None:
    driver.press_key("r")
    driver.type("2 3")
    driver.press_key("return")
    driver.type("1.5 x 1")
    driver.press_key("return")
    assert set(driver.shapes[0].vertices) == {(2, 3), (3.5, 3), (3.5, 4), (2, 4)}
    driver.press_key("w")
    driver.type("0 0")
    driver.press_key("return")
    driver.type("4 0")
    driver.press_key("return")
    driver.press_key("return")
    assert driver.shapes[1].points == ((0, 0), (4, 0))
    driver.press_key("c")
    driver.type("5 5")
    driver.press_key("return")
    driver.type("1")
    driver.press_key("return")
    assert driver.shapes[2] == CircleObstacle((5, 5), 1.0)


def test_a_corner_that_is_typed_while_the_mouse_drags_ends_the_drag(driver: EditorDriver) -> None:
    driver.press_key("b")
    driver.press(*driver.find_pixel((1, 1)))
    driver.move(*driver.find_pixel((4, 4)), held=1)
    driver.type("9 2")
    driver.press_key("return")
    driver.run_frames(1)
    driver.release()
    assert driver.editor.tool.points == [(1, 1), (9, 2)]


def test_a_wall_is_one_drag_or_several_clicks(driver: EditorDriver) -> None:
    driver.press_key("w")
    driver.drag_at((1, 1), (2, 1), (4, 1))
    assert driver.shapes == [WallObstacle(((1, 1), (4, 1)), 0.1)]
    driver.click_all((1, 3), (4, 3), (4, 5))
    driver.press_key("return")
    assert driver.shapes[1].points == ((1, 3), (4, 3), (4, 5))
    driver.press(*driver.find_pixel((6, 6)))
    driver.move(*(part + 5 for part in driver.find_pixel((6, 6))), held=1)
    driver.release()  # a hand that shakes has drawn no wall
    assert len(driver.shapes) == 2 and len(driver.editor.tool.points) == 1


def test_doors_are_opened_by_a_click_and_by_dragging(driver: EditorDriver) -> None:
    driver.press_key("w")
    driver.drag_at((1, 2), (4, 2), (9, 2))
    driver.press_key("k")
    driver.click_at((3, 2))
    assert [wall.points for wall in driver.shapes] == [((1, 2), (2.55, 2)), ((3.45, 2), (9, 2))]
    driver.type("1.2")
    driver.press_key("return")
    assert [wall.points for wall in driver.shapes] == [((1, 2), (2.4, 2)), ((3.6, 2), (9, 2))]
    driver.wait()
    driver.click_at((6, 2))
    assert [wall.points[0][0] for wall in driver.shapes] == [1, 3.6, 6.6]
    driver.wait()
    driver.drag_at((7, 2), (7.5, 2), (8, 2))
    assert [wall.points for wall in driver.shapes][2:] == [((6.6, 2), (7, 2)), ((8, 2), (9, 2))]
    driver.wait()
    driver.click_at((5, 8))
    assert driver.editor.has_error_message and "in walls" in driver.message


def test_starts_are_discs_positions_or_the_free_space(driver: EditorDriver) -> None:
    driver.press_key("s")
    driver.drag_at((2, 2), (2.5, 2), (3, 2))
    driver.press_key("shift+s")
    driver.click_all((5, 5), (6, 5), (7, 5))
    driver.press_key("return")
    driver.press_key("shift+u")
    specs = [spec for _, spec in driver.sketch.starts]
    assert specs[0] == DiscStart((2, 2), 1.0)
    assert specs[1] == PointsStart(((5, 5), (6, 5), (7, 5)))
    assert len(specs) == 3 and len({name for name, _ in driver.sketch.starts}) == 3


def test_measuring_shows_lengths_and_changes_nothing(driver: EditorDriver) -> None:
    before = driver.sketch
    driver.press_key("m")
    driver.drag_at((1, 1), (3, 3), (4, 5))
    preview = driver.editor.tool.build_overlay(driver.editor)
    assert preview.line == ((1, 1), (4, 5)) and "5.00 m" in preview.label
    assert "Δx 3.00  Δy 4.00" in preview.label
    driver.click_all((1, 1), (4, 1), (4, 5))
    driver.press_key("return")
    assert "total 7.00 m, area 6.00 m²" in driver.editor.tool.build_overlay(driver.editor).label
    driver.press_key("escape")
    assert driver.editor.tool.build_overlay(driver.editor) == EditorToolOverlay() and driver.sketch is before


def test_a_measured_line_that_crosses_itself_has_no_area(driver: EditorDriver) -> None:
    driver.press_key("m")
    driver.click_all((1, 1), (4, 4), (4, 1), (1, 4))
    driver.press_key("return")
    label = driver.editor.tool.build_overlay(driver.editor).label
    assert "total" in label and "m²" not in label


def test_a_picture_gets_its_scale_from_two_points_and_a_length(driver: EditorDriver, tmp_path: Path) -> None:
    Image.new("RGB", (200, 100), (200, 40, 40)).save(tmp_path / "plan.png")
    driver.window.file_commands.open_background(tmp_path / "plan.png")
    driver.settle()
    laid = driver.sketch.background
    assert laid is not None and laid.pixels == (200, 100) and laid.scale == pytest.approx(10 / 200)
    assert driver.editor.tool.name == "background"
    driver.click_all((2, 2), (4, 2))
    driver.type("4")
    driver.press_key("return")
    assert driver.sketch.background.scale == pytest.approx(2 * laid.scale, rel=1e-2)
    corner = driver.sketch.background.corner
    driver.drag_at((3, 3), (3.5, 3.5), (4, 3))
    driver.click_all((2, 2), (4, 2.4))
    driver.press_key("return")
    assert driver.sketch.background.rotation_deg == pytest.approx(-11.3, abs=0.5)
    driver.press_key("ctrl+z")
    moved = driver.sketch.background.corner
    assert moved[0] - corner[0] == pytest.approx(1.0, abs=0.05)
    driver.press_key("ctrl+z", times=3)
    assert driver.sketch.background is None


def test_scaling_requires_a_background_image(driver: EditorDriver) -> None:
    driver.press_key("i")
    driver.click_all((2, 2))
    assert driver.editor.has_error_message and "no background image" in driver.message


def test_a_map_is_levelled_along_a_measured_line(driver: EditorDriver) -> None:
    driver.press_key("w")
    driver.drag_at((1, 1), (2, 1), (5, 2.5))
    driver.run_command("level")
    assert driver.editor.has_error_message and "two clicks" in driver.message
    driver.press_key("m")
    driver.click_all((1, 1), (5, 2.5))
    driver.run_command("level")
    assert driver.message == "Map rotated by -20.56°"
    (_, ay), (bx, by) = driver.shapes[0].points
    assert ay == by == 1 and bx == pytest.approx(1 + 18.25**0.5, abs=1e-4)
    assert driver.editor.tool.build_overlay(driver.editor) == EditorToolOverlay()
