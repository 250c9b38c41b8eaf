"""Problems, measurements and previews of the tools as drawn in the window."""

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from driven_editor import EditorDriver, build_sheet, load_sketch, open_editor

from robocov.environment import CircleObstacle, DiscStart, Gap, PointsStart, PolygonObstacle, WallObstacle
from robocov_app.editor.canvas import overlay
from robocov_app.editor.canvas.canvas import list_map_facts
from robocov_app.editor.canvas.overlay import STEM_PX, build_gap_label
from robocov_app.editor.model.sketch import Sketch
from robocov_app.editor.settings import LAYERS
from robocov_app.editor.ui import map_facts
from robocov_app.look.theme import DARK, LIGHT, Theme
from robocov_app.toolkit.sentence_case import to_sentence_case

NARROW = (WallObstacle(((0, 5), (4.9, 5)), 0.1), WallObstacle(((5.05, 5), (10, 5)), 0.1))
CROSSED = PolygonObstacle(((2, 2), (4, 4), (4, 2), (2, 4)))


def count_pixels(
    picture: np.ndarray, at: tuple[float, float], color: tuple[int, int, int], distance: int
) -> int:
    """Return the number of pixels of a color around a pixel."""
    x = round(at[0])
    y = round(at[1])
    part = picture[y - distance : y + distance + 1, x - distance : x + distance + 1]
    return int((np.abs(part - np.array(color)).max(axis=2) < 40).sum())


def draw_without_message(driver: EditorDriver) -> np.ndarray:
    driver.editor.message = ""
    driver.move(5, 590)
    driver.window.run_frame(0.0)
    return driver.copy_frame()


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_a_passage_that_is_too_narrow_is_hatched_and_its_gap_marked(tmp_path: Path, theme: str) -> None:
    amber = (LIGHT if theme == "light" else DARK).warning
    with open_editor(tmp_path, build_sheet(*NARROW), theme=theme) as driver:
        driver.press_key("alt+5")  # The badge of the warning has the same color.
        measurement = driver.editor.measurement
        assert measurement.gap.width == pytest.approx(0.15) and not measurement.impassable.is_empty
        at = driver.find_pixel((4.975, 5))
        assert count_pixels(draw_without_message(driver), at, amber, 6) > 15
        driver.run_command("radius 0.05")
        assert count_pixels(draw_without_message(driver), at, amber, 6) == 0
        # A passage that is narrower than a robot by less than a micrometer is wide enough.
        driver.run_command("radius 0.0750004")
        assert count_pixels(draw_without_message(driver), at, amber, 6) == 0
        texts = {fact.label: fact.text for fact in map_facts.list_map_facts(driver.editor)}
        assert texts["Passage"] == "0.150 m ≥ 0.150 m"
        driver.run_command("radius 0.1")
        driver.press_key("alt+1")
        assert count_pixels(draw_without_message(driver), at, amber, 6) == 0


@pytest.mark.parametrize(
    ("width", "radius", "label"),
    [
        (0.15, 0.1, "passage 0.15 m < 0.20 m"),
        (0.023, 0.0125, "passage 2.3 cm < 2.5 cm"),
        (0.1997, 0.1, "passage 0.1997 m < 0.2000 m"),
        (0.0234, 0.01172, "passage 0.02340 m < 0.02344 m"),
        (0.098, 0.05, "passage 0.098 m < 0.100 m"),
        (0.199998, 0.1, "passage 0.199998 m < 0.200000 m"),
        (1.3 - 1.1, 0.1, "passage 0.200 m ≥ 0.200 m"),
        (0.1, 0.1 / 2, "passage 0.100 m ≥ 0.100 m"),
        (0.15, 0.0750004, "passage 0.150 m ≥ 0.150 m"),
        (5.0, 0.02, "passage 5.000 m ≥ 0.040 m"),
    ],
)
def test_the_label_of_a_passage_does_not_contradict_itself(width: float, radius: float, label: str) -> None:
    assert build_gap_label(Gap(width, ((0.0, 0.0), (width, 0.0))), radius) == label


def test_cut_off_areas_are_hatched_and_reported(tmp_path: Path) -> None:
    with open_editor(tmp_path, build_sheet(WallObstacle(((0, 5), (10, 5)), 0.1))) as driver:
        driver.open_tab("map")
        assert len(driver.editor.measurement.components) == 2
        assert not driver.editor.measurement.cut_off.is_empty
        words = [entry.text for entry in driver.window.canvas.entries]
        assert "cut off" in words


def test_a_problem_has_a_badge_and_a_click_shows_it(tmp_path: Path) -> None:
    outside = CircleObstacle((30, 30), 1.0)
    with open_editor(tmp_path, build_sheet(CROSSED, outside)) as driver:
        problems = driver.editor.problems
        assert problems[0].is_error and "cross" in problems[0].message
        driver.window.canvas.fit()
        driver.run_frames(1)
        spot = problems[0].geometry.representative_point()
        x, y = driver.find_pixel((spot.x, spot.y))
        at = x, y - STEM_PX
        assert count_pixels(draw_without_message(driver), at, LIGHT.trajectory, 6) > 40
        driver.click(*at)
        assert driver.editor.problem is problems[0]
        assert driver.message == to_sentence_case(problems[0].message)
        driver.wait()
        driver.click(*at)
        assert driver.editor.problem is None
        assert driver.message == ""
        driver.open_tab("problems")
        driver.window.canvas.zoom(8.0, (100.0, 100.0))
        driver.click(*driver.get_widget("option", f"problem:{len(problems) - 1}").rect.center)
        assert driver.editor.problem is problems[-1]
        point = problems[-1].geometry.representative_point()
        assert driver.window.canvas.contains(driver.find_pixel((point.x, point.y)))


def test_the_chosen_problem_is_drawn_even_if_there_are_too_many(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(overlay, "MAX_BADGES", 1)
    with open_editor(tmp_path, build_sheet(CROSSED, CircleObstacle((30, 30), 1.0))) as driver:
        driver.window.canvas.fit()
        driver.run_frames(1)
        last = driver.editor.problems[-1]
        point = last.geometry.representative_point()
        x, y = driver.find_pixel((point.x, point.y))
        badge = (x, y - STEM_PX)
        assert driver.window.canvas.find_problem(badge) is None
        without_badge = draw_without_message(driver)
        driver.editor.problem = last
        assert driver.window.canvas.find_problem(badge) is last
        color = driver.window.theme.error if last.is_error else driver.window.theme.warning
        assert count_pixels(without_badge, badge, color, 7) < 10
        assert count_pixels(draw_without_message(driver), badge, color, 7) > 40


@pytest.mark.parametrize("theme", [LIGHT, DARK], ids=["light", "dark"])
def test_warnings_differ_from_errors_in_color_and_shape(tmp_path: Path, theme: Theme) -> None:
    shapes = []
    with open_editor(
        tmp_path, build_sheet(CROSSED, CircleObstacle((30, 30), 1.0)), theme=theme.name
    ) as driver:
        driver.window.canvas.fit()
        driver.run_frames(1)
        picture = draw_without_message(driver)
        for color, other_color in ((theme.error, theme.warning), (theme.warning, theme.error)):
            problems = driver.editor.problems
            (problem,) = [problem for problem in problems if problem.is_error is (color == theme.error)]
            point = problem.geometry.representative_point()
            x, y = driver.find_pixel((point.x, point.y))
            badge = (x, y - STEM_PX)
            assert count_pixels(picture, badge, color, 7) > 40
            assert count_pixels(picture, badge, other_color, 7) < 3
            upper_half = count_pixels(picture, (x, y - STEM_PX - 5), color, 3)
            lower_half = count_pixels(picture, (x, y - STEM_PX + 5), color, 3)
            shapes.append(lower_half / upper_half)
    disc, triangle = shapes
    assert disc < 1.2
    assert triangle > 1.3, "the triangle is wider at its lower side"


def test_the_strip_shows_the_name_and_whether_it_is_a_draft(tmp_path: Path) -> None:
    with open_editor(tmp_path, build_sheet(CROSSED)) as driver:
        assert "draft: 1 error" in list_map_facts(driver.editor)
        driver.press_key("ctrl+a")
        driver.press_key("delete")
        assert list_map_facts(driver.editor)[0] == "0 obstacles"


def test_an_empty_sheet_is_drawn(tmp_path: Path) -> None:
    with open_editor(tmp_path, Sketch()) as driver:
        assert "no boundary" in driver.editor.problems[0].message or driver.editor.problems[0].is_error
        for tool in driver.editor.toolbox.by_name:
            driver.window.run_command(f"tool:{tool}")
            driver.click_all((2, 2), (4, 2), (4, 4))
            driver.press_key("escape", times=3)


def draw_map(driver: EditorDriver) -> np.ndarray:
    """Draw the window, and return the pixels of the map."""
    left, top, width, height = driver.window.layout.arena
    return draw_without_message(driver)[top : top + height, left : left + width]


@pytest.mark.slow
@pytest.mark.parametrize(("scale", "theme"), [(1.0, "dark"), (1.5, "light"), (2.0, "dark")])
def test_every_layer_can_be_seen(tmp_path: Path, scale: float, theme: str) -> None:
    starts = (("disc", DiscStart((8, 2), 0.8)), ("spots", PointsStart(((1, 1), (1.5, 1)))))
    size = round(900 * scale), round(600 * scale)
    sketch = build_sheet(*NARROW, CircleObstacle((8, 8), 1.0, name="pillar"), starts=starts)
    with open_editor(tmp_path, sketch, size=size, scale=scale, theme=theme) as driver:
        driver.press_key("ctrl+a")
        driver.editor.toggle_layer("robots")
        wait_until(driver, lambda: driver.window.canvas.team is not None)
        # The sketch has no background image.
        for layer in LAYERS.keys() - {"picture"}:
            shown = draw_map(driver)
            driver.editor.toggle_layer(layer)
            assert not np.array_equal(draw_map(driver), shown), layer
            driver.editor.toggle_layer(layer)
            assert np.array_equal(draw_map(driver), shown), layer


@pytest.mark.slow
@pytest.mark.parametrize("scale", [1.0, 1.5, 2.0])
def test_every_tab_of_a_dark_editor_opens_at_every_scale(tmp_path: Path, scale: float) -> None:
    size = round(900 * scale), round(600 * scale)
    with open_editor(tmp_path, build_sheet(CROSSED), size=size, scale=scale, theme="dark") as driver:
        driver.press_key("ctrl+a")
        for tab in ("map", "object", "snap", "problems"):
            driver.open_tab(tab)
            assert driver.window.panel.tab == tab
            assert driver.copy_frame().mean() < 110, "the window is not dark"


def test_lengths_are_next_to_the_cursor_and_typed_text_below_it(tmp_path: Path) -> None:
    with open_editor(tmp_path, build_sheet()) as driver:
        driver.press_key("p")
        driver.click_all((2, 2), (6, 2))
        driver.move_to((6, 5))
        before = driver.copy_frame()
        driver.type("3")
        after = driver.copy_frame()
        pixel_x, pixel_y = driver.find_pixel((6, 5))
        x = round(pixel_x)
        y = round(pixel_y)
        assert np.abs(after - before)[y + 10 : y + 45, x + 10 : x + 100].max() > 60
        # The guides include an angle of 90° at the last corner.
        assert any(guide.kind == "angle" for guide in driver.editor.tool.guides)


def test_typed_text_is_complete_at_the_lower_edge_of_the_map(tmp_path: Path) -> None:
    with open_editor(tmp_path, build_sheet(), size=(1280, 720)) as driver:
        heights = []
        for cursor_y in (5.0, 0.0):
            driver.press_key("b")
            driver.click_at((4, cursor_y))
            before = driver.copy_frame()
            driver.type("3")
            after = driver.copy_frame()
            pixel_x = round(driver.find_pixel((4, cursor_y))[0])
            column = np.abs(after - before)[:, pixel_x + 20].max(axis=1)
            heights.append(np.ptp(np.flatnonzero(column)))
            driver.press_key("escape", times=3)
        assert heights[0] > 10
        assert heights[1] == heights[0]


def wait_until(driver: EditorDriver, condition: Callable[[], bool]) -> None:
    """Run the window until a condition holds that depends on a thread."""
    end = time.monotonic() + 30.0
    while not condition():
        driver.window.run_frame(0.02)
        time.sleep(0.001)
        assert time.monotonic() < end, "nothing happens"


def test_the_team_at_a_start_is_drawn_and_follows_the_map(tmp_path: Path) -> None:
    with open_editor(tmp_path, load_sketch("rooms")) as driver:
        driver.press_key("a")
        wait_until(driver, lambda: driver.window.canvas.team is not None)
        team = driver.window.canvas.team
        assert len(team.positions) == 6
        driver.press_key("shift+=")
        wait_until(driver, lambda: driver.window.canvas.team.robots == 7)
        assert len(driver.window.canvas.team.positions) == 7


def test_problems_are_marked_during_a_drag(tmp_path: Path) -> None:
    with open_editor(tmp_path, build_sheet(CircleObstacle((5, 5), 1.0))) as driver:
        assert not driver.editor.problems
        driver.press(*driver.find_pixel((5, 5)))
        driver.move_to((8, 5), (11.5, 5), held=1)
        driver.run_frames(2)
        assert "outside" in driver.editor.problems[0].message
        driver.press_key("escape")
        driver.release()
        driver.run_frames(2)
        assert not driver.editor.problems
