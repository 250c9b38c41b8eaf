"""The page under the editor: drawing it in patches gives the same pixels as drawing it at once."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pygame
import pytest
import shapely
from driven_editor import build_sheet, load_sketch
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image
from property_examples import count_examples

from robocov.environment import CircleObstacle, PolygonObstacle, WallObstacle
from robocov_app.editor.canvas.outlines import Outlines, build_outline
from robocov_app.editor.canvas.sheet import Sheet, compute_grid_steps, compute_hull_excess, fit_name
from robocov_app.editor.canvas.sheet_view import View, choose_outside_color
from robocov_app.editor.edits import create, properties, transform
from robocov_app.editor.model.background import Background
from robocov_app.editor.model.selection import Selection
from robocov_app.editor.model.sketch import Sketch
from robocov_app.look.theme import DARK, LIGHT
from robocov_app.render.camera import Camera
from robocov_app.toolkit.window.display import open_display
from robocov_app.viewer.window.screen_video import copy_pixels

SIZE = (420, 360)
BOX = (10.0, 30.0, 400.0, 300.0)
SHAPES = (
    PolygonObstacle(((1, 1), (4, 1), (4, 4), (1, 4)), (((2, 2), (3, 2), (3, 3)),), "court"),
    CircleObstacle((7, 7), 1.2, "pillar"),
    WallObstacle(((5, 0), (5, 5), (9, 5)), 0.2),
    PolygonObstacle(((6, 2), (9, 1), (8, 4))),
)


@pytest.fixture(autouse=True, scope="module")
def screen() -> Iterator[None]:
    with open_display(headless=True):
        pygame.display.set_mode(SIZE)
        yield


def build_view(center: tuple[float, float] = (5.0, 5.0), zoom: float = 28.0, **more: object) -> View:
    attributes = {"theme": LIGHT, "scale": 1.0, "shown": frozenset({"grid", "names", "picture"}), "grid": 0.5}
    attributes |= more
    return View(Camera(center, zoom, BOX), size=SIZE, folder=Path(), **attributes)


def copy_page(page: pygame.Surface, at: View) -> np.ndarray:
    left, top, width, height = at.clip
    return copy_pixels(page)[top : top + height, left : left + width].copy()


@settings(
    max_examples=count_examples(25),
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(
    st.lists(st.tuples(st.integers(0, 5), st.integers(-40, 40), st.integers(-40, 40)), max_size=8),
    st.booleans(),
)
def test_patches_and_scrolling_equal_a_full_redraw(steps, dark: bool) -> None:
    sketch = build_sheet(*SHAPES)
    theme = DARK if dark else LIGHT
    kept = Sheet()
    center = (5.0, 5.0)
    kept.draw(build_view(center, theme=theme), sketch)
    for kind, x, y in steps:
        lifted: frozenset[int] = frozenset()
        if kind == 0:
            center = center[0] + x / 28.0, center[1] + y / 28.0
        elif kind == 1:
            sketch = transform.move(sketch, Selection.of(y % 4), x / 40, y / 40).sketch
        elif kind == 2:
            sketch = create.add_circle(sketch, (5 + x / 10, 5 + y / 10), 0.5).sketch
        elif kind == 3 and len(sketch.obstacles) > 4:
            sketch = properties.delete(sketch, Selection.of(sketch.obstacles[-1].key)).sketch
        elif kind == 4:
            lifted = frozenset({x % 4})
        else:
            sketch = transform.move(sketch, Selection.of(0, 1, 2, 3), x / 40, y / 40).sketch
        at = build_view(center, theme=theme)
        page = copy_page(kept.draw(at, sketch, lifted), at)
        redrawn_page = copy_page(Sheet().draw(at, sketch, lifted), at)
        # At the edge of a patch, the pixels of an antialiased line may differ slightly.
        differences = np.abs(page.astype(int) - redrawn_page.astype(int)).max(axis=2)
        assert (differences > 40).sum() <= 6, (kind, x, y)


class RecordedSheet(Sheet):
    """Records which boxes it paints."""

    def __init__(self) -> None:
        super().__init__()
        self.boxes: list[pygame.Rect] = []

    def _redraw_box(self, page: pygame.Surface, build_view: View, *what) -> None:
        self.boxes.append(what[-1])
        super()._redraw_box(page, build_view, *what)

    def count_painted_boxes(self, at: View, sketch: Sketch) -> str | int:
        """Draw the sketch, and return the number of painted boxes; "all" for the whole sheet."""
        self.boxes.clear()
        self.draw(at, sketch)
        return "all" if self.boxes == [at.clip] else len(self.boxes)


def test_only_changes_are_redrawn() -> None:
    sketch = build_sheet(*SHAPES)
    page = RecordedSheet()
    assert page.count_painted_boxes(build_view(), sketch) == "all"
    assert page.count_painted_boxes(build_view(), sketch) == 0
    moved = transform.move(sketch, Selection.of(1), 0.1, 0.0).sketch
    assert page.count_painted_boxes(build_view(), moved) == 1
    assert page.count_painted_boxes(build_view((5.0 + 3 / 28.0, 5.0)), moved) == 1
    assert page.boxes[0].width == 3, "it was scrolled"
    assert page.count_painted_boxes(build_view(zoom=40.0), moved) == "all"
    assert page.count_painted_boxes(build_view(zoom=40.0, theme=DARK), moved) == "all"


def test_lifted_obstacles_are_not_on_the_page() -> None:
    sketch = build_sheet(*SHAPES)
    at = build_view()
    x, y = np.rint(at.camera.to_pixels(np.array([7.0, 6.5]))).astype(int).tolist()
    page = Sheet()
    assert page.draw(at, sketch).get_at((x, y))[:3] == LIGHT.obstacle
    assert page.draw(at, sketch, frozenset({1})).get_at((x, y))[:3] != LIGHT.obstacle


def test_a_hole_shows_what_lies_below() -> None:
    at = build_view(shown=frozenset())
    page = Sheet().draw(at, build_sheet(*SHAPES))

    def get_color(point: tuple[float, float]) -> tuple[int, ...]:
        x, y = at.camera.to_pixels(np.array(point))
        return tuple(page.get_at((round(x), round(y))))[:3]

    assert get_color((2.8, 2.3)) == LIGHT.background
    assert get_color((1.5, 1.5)) == LIGHT.obstacle
    assert get_color((11.0, 5.0)) == choose_outside_color(LIGHT)


def test_areas_added_by_the_hull_are_distinguished() -> None:
    sketch = load_sketch("l-shape")
    area = compute_hull_excess(sketch)
    assert area is not None and area.area > 1.0
    assert compute_hull_excess(build_sheet()).is_empty
    assert compute_hull_excess(replace(sketch, boundary=None)).is_empty
    assert compute_hull_excess(replace(sketch, boundary=((0, 0), (1, 1), (1, 0), (0, 1)))).is_empty


def test_a_picture_lies_under_the_obstacles(tmp_path: Path) -> None:
    Image.new("RGB", (100, 100), (250, 10, 10)).save(tmp_path / "red.png")
    laid = Background(str(tmp_path / "red.png"), (100, 100), 0.1, opacity=1.0)
    for turn in (0.0, 90.0):
        corner = (0.0, 0.0) if turn == 0.0 else (10.0, 0.0)
        sketch = replace(build_sheet(*SHAPES), background=replace(laid, rotation_deg=turn, corner=corner))
        at = build_view(shown=frozenset({"picture"}))
        page = Sheet().draw(at, sketch)
        x, y = at.camera.to_pixels(np.array([1.0, 8.0]))
        assert page.get_at((round(x), round(y)))[0] > 200 > 60 > page.get_at((round(x), round(y)))[1]
        x, y = at.camera.to_pixels(np.array([1.5, 1.5]))
        mixed = page.get_at((round(x), round(y)))
        assert mixed[1] > 40  # the picture shines through
    hidden = Sheet().draw(build_view(shown=frozenset()), sketch)
    x, y = at.camera.to_pixels(np.array([1.0, 8.0]))
    assert hidden.get_at((round(x), round(y)))[:3] == LIGHT.background


@pytest.mark.parametrize("mode", ["RGBA", "L", "I;16", "P", "1"])
def test_pictures_of_all_kinds_are_shown(tmp_path: Path, mode: str) -> None:
    Image.new(mode, (40, 30)).save(tmp_path / "one.png")
    page = Sheet()
    sketch = replace(build_sheet(), background=Background(str(tmp_path / "one.png"), (40, 30), 0.25))
    page.draw(build_view(), sketch)
    assert page.background_renderer.error == ""


def test_an_unreadable_picture_is_reported_and_the_rest_is_drawn(tmp_path: Path) -> None:
    (tmp_path / "bad.png").write_bytes(b"\x89PNG\r\n\x1a\nnothing")
    page = Sheet()
    sketch = replace(build_sheet(*SHAPES), background=Background(str(tmp_path / "bad.png"), (40, 30), 0.25))
    page.draw(build_view(), sketch)
    assert "bad.png" in page.background_renderer.error


def test_grid_lines_are_multiples_of_the_grid_and_far_enough_apart() -> None:
    assert compute_grid_steps(0.1, 60.0, 1.0) == (0.2, 1.0)
    for grid in (0.01, 0.1, 0.25, 1.0, 5.0):
        for zoom in (0.5, 3.0, 28.0, 400.0, 9000.0):
            fine, coarse = compute_grid_steps(grid, zoom, 1.0)
            assert fine * zoom >= 10.9 or fine == grid
            assert abs(fine / grid - round(fine / grid)) < 1e-6 * fine / grid
            assert abs(coarse / fine - round(coarse / fine)) < 1e-6 * coarse / fine
            assert coarse * zoom >= 54


def test_names_are_written_where_they_fit() -> None:
    ring = shapely.Polygon([(0, 0), (6, 0), (6, 1), (1, 1), (1, 6), (0, 6)])
    x, y, room, high = build_outline(ring).name_space
    assert ring.contains(shapely.Point(x, y)) and 1.0 - 1e-9 <= room <= 6.0 + 1e-9 and high >= 1.0 - 1e-9
    assert build_outline(shapely.Polygon()).name_space.width == 0.0


def test_the_space_for_a_name_is_inside_the_obstacle() -> None:
    triangle = shapely.Polygon([(0, 0), (6, 0), (3, 6)])
    x, y, width, height = build_outline(triangle).name_space
    assert triangle.buffer(1e-9).covers(shapely.LineString([(x - width / 2, y), (x + width / 2, y)]))
    assert triangle.buffer(1e-9).covers(shapely.LineString([(x, y - height / 2), (x, y + height / 2)]))


@pytest.mark.parametrize(
    ("size", "lines"),
    [
        ((100, 12), ["meeting table"]),
        ((60, 30), ["meeting", "table"]),
        ((60, 12), ["meeting…"]),
        ((30, 30), []),
        ((100, 8), []),
    ],
)
def test_names_are_wrapped_before_they_are_shortened(size: tuple[int, int], lines: list[str]) -> None:
    width, height = size
    assert fit_name("meeting table", 11, width, height) == lines


def test_outlines_are_built_once_for_each_obstacle() -> None:
    outlines = Outlines()
    sketch = build_sheet(*SHAPES)
    first = outlines.get(sketch.obstacles[0])
    moved = transform.move(sketch, Selection.of(1), 1, 0).sketch
    assert outlines.get(moved.obstacles[0]) is first and first.has_holes
    assert len(outlines.find_items(moved, (0.9, 0.9, 1.1, 1.1))) == 1
    line = build_outline(shapely.LineString([(0, 0), (1, 1)]))
    assert not line.rings and len(line.lines) == 1
