"""Drawing: what the tools put down, by clicks, drags and typed numbers."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from driven_editor import Hands, opened_editor, sheet
from PIL import Image

from robocov.environment import CircleObstacle, DiscStart, PointsStart, PolygonObstacle, WallObstacle
from robocov_app.editor.tools.draw_state import EditorDrawState


@pytest.fixture
def hands(tmp_path: Path) -> Iterator[Hands]:
    with opened_editor(tmp_path, sheet()) as driver:
        yield driver


def test_a_polygon_is_closed_by_enter_a_double_click_or_its_first_corner(hands: Hands) -> None:
    corners = ((2, 2), (4, 2), (4, 4))
    hands.key("p")
    hands.click_all(*corners)
    hands.key("return")
    hands.click_all(*corners[:2])
    hands.twice(corners[2])
    hands.click_all(*corners, corners[0])
    assert hands.shapes == [PolygonObstacle(corners)] * 3
    assert hands.said == "polygon drawn"


def test_what_is_drawn_snaps_to_the_grid_and_with_ctrl_to_nothing(hands: Hands) -> None:
    hands.key("r")
    hands.drag_at((1.02, 0.98), (2.0, 2.0), (3.03, 2.01))
    assert set(hands.shapes[0].vertices) == {(1, 1), (3, 1), (3, 2), (1, 2)}
    hands.hold("ctrl")
    hands.drag_at((5.037, 5.037), (6.0, 6.0), (7.037, 7.037))
    assert all(abs(x * 10 - round(x * 10)) > 1e-3 for x, _ in hands.shapes[1].vertices)


def test_escape_gives_up_and_backspace_takes_a_point_back(hands: Hands) -> None:
    hands.key("p")
    hands.click_all((2, 2), (4, 2), (5, 5))
    hands.key("backspace")
    hands.click_all((4, 4))
    hands.key("return")
    assert hands.shapes == [PolygonObstacle(((2, 2), (4, 2), (4, 4)))]
    hands.click_all((6, 6), (7, 7))
    hands.key("escape")
    assert len(hands.shapes) == 1 and not hands.editor.tool.is_busy and hands.editor.tool.name == "polygon"
    hands.key("escape")
    assert hands.editor.tool.name == "select"


def test_too_few_points_are_told(hands: Hands) -> None:
    hands.key("p")
    hands.click_all((2, 2), (4, 2))
    hands.key("return")
    assert hands.editor.has_error_message and "2 of at least 3 points" in hands.said and not hands.shapes


def test_a_wall_takes_typed_lengths_and_coordinates(hands: Hands) -> None:
    hands.key("w")
    hands.click_all((1, 1))
    hands.go((1, 4))
    hands.type("2.5")
    assert hands.editor.typed == "2.5"
    hands.key("return")
    hands.type("@2<0")
    hands.key("return")
    hands.type("+0 -1")
    hands.key("return")
    hands.key("return")
    assert hands.shapes == [WallObstacle(((1, 1), (1, 3.5), (3, 3.5), (3, 2.5)), 0.1)]


def test_what_is_typed_can_be_corrected_given_up_and_wrong(hands: Hands) -> None:
    hands.key("w")
    hands.click_all((1, 1))
    hands.go((1, 4))
    hands.type("29")
    hands.key("backspace")
    hands.key("return")
    assert hands.editor.tool.points == [(1.0, 1.0), (1.0, 3.0)]
    hands.type("7")
    hands.key("escape")
    assert hands.editor.typed == "" and hands.editor.tool.is_busy
    hands.type("1..2")
    hands.key("return")
    assert hands.editor.has_error_message and len(hands.editor.tool.points) == 2


def test_the_width_of_walls_is_changed_by_brackets(hands: Hands) -> None:
    hands.key("w")
    hands.key("]")
    hands.key("]")
    hands.key("[")
    hands.click_all((1, 1), (4, 1))
    hands.key("return")
    assert hands.shapes[0].width == pytest.approx(0.125, abs=1e-3)
    hands.key("v")
    hands.key("]")  # the wall that was drawn is selected
    assert hands.shapes[0].width == pytest.approx(0.156, abs=1e-3)


def test_rectangles_and_circles_by_two_clicks_and_by_size(hands: Hands) -> None:
    hands.key("r")
    hands.click_all((1, 1))
    hands.go((0.5, 3))
    hands.type("0.5 x 2")
    hands.key("return")
    hands.click_all((4, 4), (6, 5))
    hands.key("c")
    hands.click_all((8, 8))
    hands.go((8.5, 8))
    hands.type("75cm")
    hands.key("return")
    first, second, circle = hands.shapes
    assert set(first.vertices) == {(1, 1), (0.5, 1), (0.5, 3), (1, 3)}
    assert set(second.vertices) == {(4, 4), (6, 4), (6, 5), (4, 5)}
    assert circle == CircleObstacle((8, 8), 0.75)


def test_shift_makes_squares_and_round_angles(hands: Hands) -> None:
    hands.key("r")
    hands.hold("shift")
    hands.drag_at((1, 1), (2, 1.5), (3, 2))
    hands.hold()
    assert set(hands.shapes[0].vertices) == {(1, 1), (3, 1), (3, 3), (1, 3)}
    hands.key("w")
    hands.click_all((5, 5))
    hands.hold("shift")
    hands.click_all((8, 5.2))
    hands.hold()
    hands.key("return")
    (ax, ay), (bx, by) = hands.shapes[1].points
    assert ay == by == 5 and bx > ax


def test_the_boundary_is_drawn_by_dragging_by_corners_and_by_size(hands: Hands) -> None:
    hands.key("b")
    hands.drag_at((1, 1), (5, 5), (9, 7))
    assert set(hands.sketch.boundary) == {(1, 1), (9, 1), (9, 7), (1, 7)}
    hands.click_all((1, 1), (9, 1), (5, 6))
    hands.key("return")
    assert hands.sketch.boundary == ((1, 1), (9, 1), (5, 6))
    hands.click_all((0, 0))
    hands.go((3, 3))
    hands.type("12 x 8")
    hands.key("return")
    assert set(hands.sketch.boundary) == {(0, 0), (12, 0), (12, 8), (0, 8)}
    hands.key("ctrl+z", times=3)
    assert hands.sketch.boundary == sheet().boundary


def test_the_first_point_can_be_typed(hands: Hands) -> None:
    hands.key("r")
    hands.type("2 3")
    hands.key("return")
    hands.type("1.5 x 1")
    hands.key("return")
    assert set(hands.shapes[0].vertices) == {(2, 3), (3.5, 3), (3.5, 4), (2, 4)}
    hands.key("w")
    hands.type("0 0")
    hands.key("return")
    hands.type("4 0")
    hands.key("return")
    hands.key("return")
    assert hands.shapes[1].points == ((0, 0), (4, 0))
    hands.key("c")
    hands.type("5 5")
    hands.key("return")
    hands.type("1")
    hands.key("return")
    assert hands.shapes[2] == CircleObstacle((5, 5), 1.0)


def test_a_corner_that_is_typed_while_the_mouse_drags_ends_the_drag(hands: Hands) -> None:
    hands.key("b")
    hands.press(*hands.pixel((1, 1)))
    hands.move(*hands.pixel((4, 4)), held=1)
    hands.type("9 2")
    hands.key("return")
    hands.frames(1)
    hands.release()
    assert hands.editor.tool.points == [(1, 1), (9, 2)]


def test_a_wall_is_one_drag_or_several_clicks(hands: Hands) -> None:
    hands.key("w")
    hands.drag_at((1, 1), (2, 1), (4, 1))
    assert hands.shapes == [WallObstacle(((1, 1), (4, 1)), 0.1)]
    hands.click_all((1, 3), (4, 3), (4, 5))
    hands.key("return")
    assert hands.shapes[1].points == ((1, 3), (4, 3), (4, 5))
    hands.press(*hands.pixel((6, 6)))
    hands.move(*(part + 5 for part in hands.pixel((6, 6))), held=1)
    hands.release()  # a hand that shakes has drawn no wall
    assert len(hands.shapes) == 2 and len(hands.editor.tool.points) == 1


def test_doors_are_opened_by_a_click_and_by_dragging(hands: Hands) -> None:
    hands.key("w")
    hands.drag_at((1, 2), (4, 2), (9, 2))
    hands.key("k")
    hands.click_at((3, 2))
    assert [wall.points for wall in hands.shapes] == [((1, 2), (2.55, 2)), ((3.45, 2), (9, 2))]
    hands.type("1.2")
    hands.key("return")
    hands.wait()
    hands.click_at((6, 2))
    assert [wall.points[0][0] for wall in hands.shapes] == [1, 3.45, 6.6]
    hands.wait()
    hands.drag_at((7, 2), (7.5, 2), (8, 2))
    assert [wall.points for wall in hands.shapes][2:] == [((6.6, 2), (7, 2)), ((8, 2), (9, 2))]
    hands.wait()
    hands.click_at((5, 8))
    assert hands.editor.has_error_message and "in walls" in hands.said


def test_starts_are_discs_places_and_anywhere(hands: Hands) -> None:
    hands.key("s")
    hands.drag_at((2, 2), (2.5, 2), (3, 2))
    hands.key("shift+s")
    hands.click_all((5, 5), (6, 5), (7, 5))
    hands.key("return")
    hands.key("shift+u")
    specs = [spec for _, spec in hands.sketch.starts]
    assert specs[0] == DiscStart((2, 2), 1.0)
    assert specs[1] == PointsStart(((5, 5), (6, 5), (7, 5)))
    assert len(specs) == 3 and len({name for name, _ in hands.sketch.starts}) == 3


def test_measuring_tells_and_changes_nothing(hands: Hands) -> None:
    before = hands.sketch
    hands.key("m")
    hands.drag_at((1, 1), (3, 3), (4, 5))
    preview = hands.editor.tool.build_draw_state(hands.editor)
    assert preview.line == ((1, 1), (4, 5)) and "5.00 m" in preview.label
    assert "Δx 3.00  Δy 4.00" in preview.label
    hands.click_all((1, 1), (4, 1), (4, 5))
    hands.key("return")
    assert "7.00 m in all" in hands.editor.tool.build_draw_state(hands.editor).label
    hands.key("escape")
    assert hands.editor.tool.build_draw_state(hands.editor) == EditorDrawState() and hands.sketch is before


def test_a_picture_gets_its_scale_from_two_points_and_a_length(hands: Hands, tmp_path: Path) -> None:
    Image.new("RGB", (200, 100), (200, 40, 40)).save(tmp_path / "plan.png")
    hands.window.documents.open_background(tmp_path / "plan.png")
    hands.settle()
    laid = hands.sketch.background
    assert laid is not None and laid.pixels == (200, 100) and laid.scale == pytest.approx(10 / 200)
    assert hands.editor.tool.name == "picture"
    hands.click_all((2, 2), (4, 2))
    hands.type("4")
    hands.key("return")
    assert hands.sketch.background.scale == pytest.approx(2 * laid.scale, rel=1e-2)
    corner = hands.sketch.background.corner
    hands.drag_at((3, 3), (3.5, 3.5), (4, 3))
    hands.click_all((2, 2), (4, 2.4))
    hands.key("return")
    assert hands.sketch.background.turn == pytest.approx(-11.3, abs=0.5)
    hands.key("ctrl+z")
    moved = hands.sketch.background.corner
    assert moved[0] - corner[0] == pytest.approx(1.0, abs=0.05)
    hands.key("ctrl+z", times=3)
    assert hands.sketch.background is None


def test_two_points_for_a_picture_that_is_not_there(hands: Hands) -> None:
    hands.key("i")
    hands.click_all((2, 2))
    assert hands.editor.has_error_message and "no picture" in hands.said


def test_a_map_is_made_level_along_a_line_that_was_measured(hands: Hands) -> None:
    hands.key("w")
    hands.drag_at((1, 1), (2, 1), (5, 2.5))
    hands.command("level")
    assert hands.editor.has_error_message and "two clicks" in hands.said
    hands.key("m")
    hands.click_all((1, 1), (5, 2.5))
    hands.command("level")
    assert hands.said == "map turned by -20.56°"
    (_, ay), (bx, by) = hands.shapes[0].points
    assert ay == by == 1 and bx == pytest.approx(1 + 18.25**0.5, abs=1e-4)
    assert hands.editor.tool.build_draw_state(hands.editor) == EditorDrawState()
