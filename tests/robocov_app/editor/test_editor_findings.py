"""What was found out about a map, and what is being done, seen in the window."""

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from driven_editor import Hands, of_map, opened_editor, sheet

from robocov.environment import CircleObstacle, DiscStart, PointsStart, PolygonObstacle, WallObstacle
from robocov_app.editor.canvas.canvas import describe_map
from robocov_app.editor.canvas.overlay import STEM_PX
from robocov_app.editor.model.sketch import Sketch
from robocov_app.look.theme import DARK, LIGHT

NARROW = (WallObstacle(((0, 5), (4.9, 5)), 0.1), WallObstacle(((5.05, 5), (10, 5)), 0.1))
CROSSED = PolygonObstacle(((2, 2), (4, 4), (4, 2), (2, 4)))


def near(picture: np.ndarray, at: tuple[float, float], color: tuple[int, int, int], within: int) -> int:
    """Return how many pixels around one are of a color."""
    x, y = (round(value) for value in at)
    part = picture[y - within : y + within + 1, x - within : x + within + 1]
    return int((np.abs(part - np.array(color)).max(axis=2) < 40).sum())


def without_message(hands: Hands) -> np.ndarray:
    hands.editor.message = ""
    hands.move(5, 590)
    hands.window.run_frame(0.0)
    return hands.picture()


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_a_passage_that_is_too_narrow_is_hatched_and_its_gap_marked(tmp_path: Path, theme: str) -> None:
    red = (LIGHT if theme == "light" else DARK).trajectory
    with opened_editor(tmp_path, sheet(*NARROW), theme=theme) as hands:
        measurement = hands.editor.measurement
        assert measurement.gap.width == pytest.approx(0.15) and not measurement.impassable.is_empty
        at = hands.pixel((4.975, 5))
        assert near(without_message(hands), at, red, 6) > 15
        hands.command("radius 0.05")
        assert near(without_message(hands), at, red, 6) == 0
        hands.command("radius 0.1")
        hands.key("alt+1")
        assert near(without_message(hands), at, red, 6) == 0


def test_what_is_cut_off_is_hatched_and_told(tmp_path: Path) -> None:
    with opened_editor(tmp_path, sheet(WallObstacle(((0, 5), (10, 5)), 0.1))) as hands:
        hands.turn("map")
        assert len(hands.editor.measurement.components) == 2
        assert not hands.editor.measurement.sealed.is_empty
        words = [entry.text for entry in hands.window.canvas.entries]
        assert "cut off" in words


def test_a_problem_has_a_badge_with_its_words_and_a_click_goes_there(tmp_path: Path) -> None:
    outside = CircleObstacle((30, 30), 1.0)
    with opened_editor(tmp_path, sheet(CROSSED, outside)) as hands:
        problems = hands.editor.problems
        assert problems[0].is_error and "cross" in problems[0].message
        hands.window.canvas.fit()
        hands.frames(1)
        spot = problems[0].geometry.representative_point()
        x, y = hands.pixel((spot.x, spot.y))
        at = x, y - STEM_PX
        assert near(without_message(hands), at, LIGHT.trajectory, 6) > 40
        hands.click(*at)
        assert hands.editor.problem is problems[0] and hands.said == problems[0].message
        hands.turn("problems")
        hands.window.canvas.zoom(8.0, (100.0, 100.0))
        hands.click(*hands.widget("option", f"problem:{len(problems) - 1}").rect.center)
        assert hands.editor.problem is problems[-1]
        where = problems[-1].geometry.representative_point()
        assert hands.window.canvas.contains(hands.pixel((where.x, where.y)))


def test_the_strip_says_whose_map_it_is_and_that_it_is_a_draft(tmp_path: Path) -> None:
    with opened_editor(tmp_path, sheet(CROSSED)) as hands:
        assert describe_map(hands.editor).endswith("draft: 1 problem")
        hands.key("ctrl+a")
        hands.key("delete")
        assert describe_map(hands.editor).startswith("● Untitled   ·   0 obstacles")


def test_a_sheet_with_nothing_on_it_is_drawn_too(tmp_path: Path) -> None:
    with opened_editor(tmp_path, Sketch()) as hands:
        assert "no boundary" in hands.editor.problems[0].message or hands.editor.problems[0].is_error
        for tool in hands.editor.toolbox.by_name:
            hands.window.do(f"tool:{tool}")
            hands.click_all((2, 2), (4, 2), (4, 4))
            hands.key("escape", times=3)


@pytest.mark.slow
@pytest.mark.parametrize("scale", [1.0, 1.5, 2.0])
def test_everything_at_once_is_drawn_at_every_scale_and_in_the_dark(tmp_path: Path, scale: float) -> None:
    starts = (("disc", DiscStart((8, 2), 0.8)), ("spots", PointsStart(((1, 1), (1.5, 1)))))
    size = round(900 * scale), round(600 * scale)
    sketch = sheet(CROSSED, *NARROW, CircleObstacle((8, 8), 1.0), starts=starts)
    with opened_editor(tmp_path, sketch, size=size, scale=scale, theme="dark") as hands:
        hands.key("a")
        hands.key("ctrl+a")
        for tab in ("map", "object", "snap", "problems"):
            hands.turn(tab)
        picture = hands.picture()
        assert picture.mean() < 110 and picture.std() > 15


def test_lengths_stand_beside_the_cursor_and_what_is_typed_below_it(tmp_path: Path) -> None:
    with opened_editor(tmp_path, sheet()) as hands:
        hands.key("p")
        hands.click_all((2, 2), (6, 2))
        hands.go((6, 5))
        before = hands.picture()
        hands.type("3")
        after = hands.picture()
        x, y = (round(value) for value in hands.pixel((6, 5)))
        assert np.abs(after - before)[y + 10 : y + 45, x + 10 : x + 100].max() > 60
        # guides: an angle of 90° from the last corner
        assert any(guide.kind == "angle" for guide in hands.editor.tool.guides)


def await_that(hands: Hands, seen: Callable[[], bool]) -> None:
    """Let the window run until a thread beside it has done something."""
    end = time.monotonic() + 30.0
    while not seen():
        hands.window.run_frame(0.02)
        time.sleep(0.001)
        assert time.monotonic() < end, "nothing happens"


def test_the_team_at_a_start_is_drawn_and_follows_the_map(tmp_path: Path) -> None:
    with opened_editor(tmp_path, of_map("rooms")) as hands:
        hands.key("a")
        await_that(hands, lambda: hands.window.canvas.team is not None)
        team = hands.window.canvas.team
        assert len(team.positions) == 6
        hands.key("shift+=")
        await_that(hands, lambda: hands.window.canvas.team.robots == 7)
        assert len(hands.window.canvas.team.positions) == 7


def test_what_is_wrong_is_marked_already_while_something_is_dragged(tmp_path: Path) -> None:
    with opened_editor(tmp_path, sheet(CircleObstacle((5, 5), 1.0))) as hands:
        assert not hands.editor.problems
        hands.press(*hands.pixel((5, 5)))
        hands.go((8, 5), (11.5, 5), held=1)
        hands.frames(2)
        assert "outside" in hands.editor.problems[0].message
        hands.key("escape")
        hands.release()
        hands.frames(2)
        assert not hands.editor.problems
