"""The real editor under X11: a floor plan from nothing to a running demo, and nothing lost by kill -9."""

import json
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from called import COMMAND
from PIL import Image
from x11_hands import MARKS, PATIENCE, Hands, ended, invisible_display, run_window, said

from robocov.environment import CircleObstacle, PolygonObstacle, WallObstacle
from robocov.mapfile import load_map
from robocov_app.editor.canvas.canvas import MARGIN_PX
from robocov_app.render.annotations import STRIP_HEIGHT_PX
from robocov_app.render.camera import Camera
from robocov_app.storage.autosave import FOLDER_VARIABLE as DRAFTS
from robocov_app.storage.settings import FOLDER_VARIABLE
from robocov_app.toolkit.layout import build_layout

pytestmark = MARKS

SIZE = (1000, 640)
PLAN = (0.0, 0.0, 12.0, 8.0)


@pytest.fixture(scope="module")
def display() -> Iterator[str]:
    with invisible_display() as number:
        yield number


@contextmanager
def edited(display: str, folder: Path, *words: object) -> Iterator[Hands]:
    size = f"{SIZE[0]}x{SIZE[1]}"
    command = [*COMMAND, "edit", *words, "--folder", folder, "--size", size, "--scale", "1"]
    places = {FOLDER_VARIABLE: str(folder / "settings"), DRAFTS: str(folder / "drafts")}
    with run_window(display, folder, command, **places) as hands:
        hands.shot()  # now it listens
        yield hands


class Sheet:
    """Where places of the map are in the window."""

    def __init__(self, bounds: tuple[float, float, float, float], legend_rows: int = 1) -> None:
        left, top, width, height = build_layout(SIZE, 1.0, 1, 1.0, plot=False).arena
        above = 10 + 22 * legend_rows
        view = float(left), float(top + above), float(width), height - above - STRIP_HEIGHT_PX
        self.camera = Camera.fit(bounds, view, MARGIN_PX)

    def __call__(self, x: float, y: float) -> tuple[float, float]:
        px, py = self.camera.to_pixels(np.array([x, y])).tolist()
        return px, py


def test_a_floor_plan_from_nothing_to_a_running_demo_and_saved(display: str, tmp_path: Path) -> None:
    with edited(display, tmp_path) as hands:
        at = Sheet((0.0, 0.0, 10.0, 10.0))  # the boundary that is offered
        hands.key("b")
        hands.click(*at(0, 0))
        hands.move(*at(5, 5))
        hands.type("12 x 8")
        hands.key("Return")
        hands.key("f")
        at = Sheet(PLAN)

        hands.key("w")
        for point in ((4, 0), (4, 5)):
            hands.click(*at(*point))
        hands.key("Return")
        time.sleep(0.4)  # or it would be a double click
        hands.click(*at(8, 8))
        hands.move(*at(8, 6))
        hands.type("5")  # meters downwards
        hands.key("Return", "Return")
        hands.key("r")
        hands.drag(at(9, 1), at(10, 1.5), at(11, 2))
        hands.key("c")
        hands.drag(at(2, 2), at(2.3, 2), at(2.5, 2))
        hands.key("p")
        for point in ((1, 5), (3, 5), (3, 7)):
            hands.click(*at(*point))
        hands.key("Return")
        hands.key("s")
        hands.drag(at(6, 4), at(6.5, 4), at(7, 4))
        drawn = hands.shot()
        assert np.abs(drawn - drawn[5, 500]).max() > 60

        hands.key("ctrl+s")
        hands.key("ctrl+BackSpace")
        hands.type("plan")
        hands.key("Return")
        hands.until((tmp_path / "plan.json").exists, "saved map")

        hands.key("F5")
        tried = differs(hands, drawn, 0.3)  # cells are colored
        differs(hands, tried, 0.0)  # robots move
        hands.key("F5")
        time.sleep(0.5)

        # nothing was lost: what was done before can still be undone and done again
        hands.key("ctrl+z", "ctrl+y", "ctrl+s")
        hands.key("ctrl+q")
        assert ended(hands.process) == 0, said(hands.process)
        assert said(hands.process) == ""

    plan = load_map(tmp_path / "plan.json")
    assert sorted(plan.boundary) == [(0.0, 0.0), (0.0, 8.0), (12.0, 0.0), (12.0, 8.0)]
    first, second, table, pillar, corner = plan.obstacles
    assert isinstance(first, WallObstacle) and first.points == ((4.0, 0.0), (4.0, 5.0))
    assert isinstance(second, WallObstacle) and second.points == ((8.0, 8.0), (8.0, 3.0))
    assert isinstance(table, PolygonObstacle) and set(table.vertices) == {(9, 1), (11, 1), (11, 2), (9, 2)}
    assert isinstance(pillar, CircleObstacle) and (pillar.center, pillar.radius) == ((2.0, 2.0), 0.5)
    assert isinstance(corner, PolygonObstacle) and corner.vertices == ((1, 5), (3, 5), (3, 7))
    (start,) = plan.starts.values()
    assert (start.center, start.radius) == ((6.0, 4.0), 1.0)
    assert not list((tmp_path / "drafts").rglob("*.json"))


def differs(hands: Hands, from_picture: np.ndarray, part: float) -> np.ndarray:
    """Return the first picture whose arena is different in more than a part of its pixels."""
    arena = np.s_[: SIZE[1] - 210, : SIZE[0] - 320]
    began = time.monotonic()
    while True:
        picture = hands.shot()
        if (np.abs(picture - from_picture)[arena].max(axis=2) > 30).mean() > part:
            return picture
        assert time.monotonic() - began < PATIENCE, "nothing happens"
        time.sleep(0.2)


def test_kill_9_in_the_middle_loses_nothing(display: str, tmp_path: Path) -> None:
    with edited(display, tmp_path) as hands:
        at = Sheet((0.0, 0.0, 10.0, 10.0))
        hands.key("r")
        hands.drag(at(1, 1), at(2, 2), at(3, 3))
        hands.drag(at(5, 5), at(6, 6), at(7, 7))
        hands.until(lambda: kept(tmp_path) == 2, "draft with both rectangles")
        hands.process.send_signal(signal.SIGKILL)
        assert ended(hands.process) == -signal.SIGKILL

    with edited(display, tmp_path) as hands:
        hands.key("Return")  # Recover
        time.sleep(0.3)
        hands.key("ctrl+s", "ctrl+BackSpace")
        hands.type("saved")
        hands.key("Return")
        hands.until((tmp_path / "saved.json").exists, "saved map")
        hands.key("ctrl+q")
        assert ended(hands.process) == 0, said(hands.process)
    plan = load_map(tmp_path / "saved.json")
    assert [set(shape.vertices) for shape in plan.obstacles] == [
        {(1, 1), (3, 1), (3, 3), (1, 3)},
        {(5, 5), (7, 5), (7, 7), (5, 7)},
    ]


def kept(folder: Path) -> int:
    """Return how many obstacles the draft has: not what is still being written, which has another name."""
    found = [0]
    for path in (folder / "drafts").rglob("[!.]*.json"):
        held = json.loads(path.read_text())
        found.append(len((held.get("sketch") or {}).get("obstacles", ())))
    return max(found)


def test_a_question_before_unsaved_work_is_closed(display: str, tmp_path: Path) -> None:
    with edited(display, tmp_path, tmp_path / "fresh.json") as hands:
        at = Sheet((0.0, 0.0, 10.0, 10.0))
        hands.key("c")
        empty = hands.shot()
        hands.drag(at(5, 5), at(5.5, 5), at(6, 5))
        drawn = differs(hands, empty, 0.002)
        hands.key("ctrl+q")
        differs(hands, drawn, 0.002)  # there is a question
        assert hands.process.poll() is None
        hands.key("Escape")  # cancel
        hands.shot()
        assert hands.process.poll() is None
        hands.key("ctrl+q", "s")
        assert ended(hands.process) == 0, said(hands.process)
    assert not (tmp_path / "drafts").exists() or not list((tmp_path / "drafts").rglob("*.json"))


def test_copies_go_from_one_window_to_another(display: str, tmp_path: Path) -> None:
    with edited(display, tmp_path) as first:
        at = Sheet((0.0, 0.0, 10.0, 10.0))
        first.key("r")
        first.drag(at(1, 1), at(2, 2), at(3, 3))
        first.key("ctrl+c")
        first.shot()
        with edited(display, tmp_path, tmp_path / "second.json") as second:
            second.key("ctrl+shift+v", "ctrl+s")
            second.until((tmp_path / "second.json").exists, "saved map")
            second.key("ctrl+q")
            assert ended(second.process) == 0, said(second.process)
    (pasted,) = load_map(tmp_path / "second.json").obstacles
    assert set(pasted.vertices) == {(1, 1), (3, 1), (3, 3), (1, 3)}


def test_a_picture_is_imported_with_the_room_that_was_clicked(display: str, tmp_path: Path) -> None:
    walls = np.zeros((100, 200), dtype=np.uint8)
    walls[10:90, 10:110] = walls[10:90, 120:190] = 255
    Image.fromarray(walls).save(tmp_path / "plan.png")
    with edited(display, tmp_path, tmp_path / "plan.png") as hands:
        hands.type("0.1")

        def left_out() -> tuple[float, float]:
            """Return the middle of what is red, px; (0, 0) for nothing."""
            red, green, blue = np.moveaxis(hands.shot(), 2, 0)
            found = np.argwhere((red > 180) & (green < 160) & (blue < 160))
            return (0.0, 0.0) if len(found) < 1000 else (np.median(found[:, 1]), np.median(found[:, 0]))

        hands.until(lambda: left_out()[0], "room that is left out")
        x, y = left_out()
        hands.click(x, y)
        hands.until(lambda: 0 < left_out()[0] < x - 50, "other room that is left out")
        hands.key("Return", "ctrl+s")
        hands.key("Return")
        hands.until((tmp_path / "plan.json").exists, "saved map")
        hands.key("ctrl+q")
        assert ended(hands.process) == 0, said(hands.process)
    assert load_map(tmp_path / "plan.json").free_area == pytest.approx(56.0)
