"""The real editor under X11: a floor plan from nothing to a running demo, and nothing lost by kill -9."""

import json
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from command_calls import COMMAND
from driven_x11_window import (
    MARKS,
    MAX_WAIT_S,
    X11Driver,
    read_errors,
    run_window,
    start_display,
    wait_for_end,
)
from PIL import Image

from robocov.environment import CircleObstacle, PolygonObstacle, WallObstacle
from robocov.mapfile import load_map
from robocov_app.editor.canvas.canvas import LEGEND_MARGIN_PX, MARGIN_PX
from robocov_app.render.annotations.legend_strip import ROW_HEIGHT_PX
from robocov_app.render.annotations.scale_bar import STRIP_HEIGHT_PX
from robocov_app.render.camera import Camera
from robocov_app.storage.autosave import FOLDER_VARIABLE as DRAFTS
from robocov_app.storage.settings import FOLDER_VARIABLE
from robocov_app.toolkit.window.layout import build_layout

pytestmark = MARKS

SIZE = (1000, 640)
PLAN = (0.0, 0.0, 12.0, 8.0)


@pytest.fixture(scope="module")
def display() -> Iterator[str]:
    with start_display() as number:
        yield number


@contextmanager
def run_editor(display: str, folder: Path, *words: object) -> Iterator[X11Driver]:
    size = f"{SIZE[0]}x{SIZE[1]}"
    command = [*COMMAND, "edit", *words, "--folder", folder, "--size", size, "--scale", "1"]
    variables = {FOLDER_VARIABLE: str(folder / "settings"), DRAFTS: str(folder / "drafts")}
    with run_window(display, folder, command, **variables) as driver:
        driver.take_screenshot()  # now it listens
        yield driver


class Sheet:
    """Converts positions on the map to pixels of the window."""

    def __init__(self, bounds: tuple[float, float, float, float]) -> None:
        left, top, width, height = build_layout(SIZE, 1.0, plot=False).arena
        above = LEGEND_MARGIN_PX + ROW_HEIGHT_PX
        view = float(left), float(top + above), float(width), height - above - STRIP_HEIGHT_PX
        self.camera = Camera.fit(bounds, view, MARGIN_PX)

    def __call__(self, x: float, y: float) -> tuple[float, float]:
        px, py = self.camera.to_pixels(np.array([x, y])).tolist()
        return px, py


def test_a_floor_plan_is_drawn_saved_and_tried(display: str, tmp_path: Path) -> None:
    with run_editor(display, tmp_path) as driver:
        at = Sheet((0.0, 0.0, 10.0, 10.0))  # the boundary that is offered
        driver.press("b")
        driver.click(*at(0, 0))
        driver.move(*at(5, 5))
        driver.type("12 x 8")
        driver.press("Return")
        driver.press("f")
        at = Sheet(PLAN)

        driver.press("w")
        for point in ((4, 0), (4, 5)):
            driver.click(*at(*point))
        driver.press("Return")
        time.sleep(0.4)  # or it would be a double click
        driver.click(*at(8, 8))
        driver.move(*at(8, 6))
        driver.type("5")  # meters downwards
        driver.press("Return", "Return")
        driver.press("r")
        driver.drag(at(9, 1), at(10, 1.5), at(11, 2))
        driver.press("c")
        driver.drag(at(2, 2), at(2.3, 2), at(2.5, 2))
        driver.press("p")
        for point in ((1, 5), (3, 5), (3, 7)):
            driver.click(*at(*point))
        driver.press("Return")
        driver.press("s")
        driver.drag(at(6, 4), at(6.5, 4), at(7, 4))
        drawn = driver.take_screenshot()
        assert np.abs(drawn - drawn[5, 500]).max() > 60

        driver.press("ctrl+s")
        driver.press("ctrl+BackSpace")
        driver.type("plan")
        driver.press("Return")
        driver.wait_until((tmp_path / "plan.json").exists, "saved map")

        driver.press("F5")
        tried = wait_for_change(driver, drawn, 0.3)  # cells are colored
        wait_for_change(driver, tried, 0.0)  # robots move
        driver.press("F5")
        time.sleep(0.5)

        # Earlier changes can still be undone and redone.
        driver.press("ctrl+z", "ctrl+y", "ctrl+s")
        driver.press("ctrl+q")
        assert wait_for_end(driver.process) == 0, read_errors(driver.process)
        assert read_errors(driver.process) == ""

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


def wait_for_change(driver: X11Driver, from_picture: np.ndarray, part: float) -> np.ndarray:
    """Return the first picture whose arena is different in more than a part of its pixels."""
    arena = np.s_[: SIZE[1] - 210, : SIZE[0] - 320]
    started_at = time.monotonic()
    while True:
        picture = driver.take_screenshot()
        if (np.abs(picture - from_picture)[arena].max(axis=2) > 30).mean() > part:
            return picture
        assert time.monotonic() - started_at < MAX_WAIT_S, "nothing happens"
        time.sleep(0.2)


def test_a_killed_editor_loses_nothing(display: str, tmp_path: Path) -> None:
    with run_editor(display, tmp_path) as driver:
        at = Sheet((0.0, 0.0, 10.0, 10.0))
        driver.press("r")
        driver.drag(at(1, 1), at(2, 2), at(3, 3))
        driver.drag(at(5, 5), at(6, 6), at(7, 7))
        driver.wait_until(lambda: count_saved_obstacles(tmp_path) == 2, "draft with both rectangles")
        driver.process.send_signal(signal.SIGKILL)
        assert wait_for_end(driver.process) == -signal.SIGKILL

    with run_editor(display, tmp_path) as driver:
        driver.press("Return")  # Recover
        time.sleep(0.3)
        driver.press("ctrl+s", "ctrl+BackSpace")
        driver.type("saved")
        driver.press("Return")
        driver.wait_until((tmp_path / "saved.json").exists, "saved map")
        driver.press("ctrl+q")
        assert wait_for_end(driver.process) == 0, read_errors(driver.process)
    plan = load_map(tmp_path / "saved.json")
    assert [set(shape.vertices) for shape in plan.obstacles] == [
        {(1, 1), (3, 1), (3, 3), (1, 3)},
        {(5, 5), (7, 5), (7, 7), (5, 7)},
    ]


def count_saved_obstacles(folder: Path) -> int:
    """Return the number of obstacles in the draft; temporary files do not count."""
    found = [0]
    for path in (folder / "drafts").rglob("[!.]*.json"):
        document = json.loads(path.read_text())
        found.append(len((document.get("sketch") or {}).get("obstacles", ())))
    return max(found)


def test_closing_unsaved_work_asks_first(display: str, tmp_path: Path) -> None:
    with run_editor(display, tmp_path, tmp_path / "fresh.json") as driver:
        at = Sheet((0.0, 0.0, 10.0, 10.0))
        driver.press("c")
        empty = driver.take_screenshot()
        driver.drag(at(5, 5), at(5.5, 5), at(6, 5))
        drawn = wait_for_change(driver, empty, 0.002)
        driver.press("ctrl+q")
        wait_for_change(driver, drawn, 0.002)  # there is a question
        assert driver.process.poll() is None
        driver.press("Escape")  # cancel
        driver.take_screenshot()
        assert driver.process.poll() is None
        driver.press("ctrl+q", "s")
        assert wait_for_end(driver.process) == 0, read_errors(driver.process)
    assert not (tmp_path / "drafts").exists() or not list((tmp_path / "drafts").rglob("*.json"))


def test_copies_go_from_one_window_to_another(display: str, tmp_path: Path) -> None:
    with run_editor(display, tmp_path) as first:
        at = Sheet((0.0, 0.0, 10.0, 10.0))
        first.press("r")
        first.drag(at(1, 1), at(2, 2), at(3, 3))
        first.press("ctrl+c")
        first.take_screenshot()
        with run_editor(display, tmp_path, tmp_path / "second.json") as second:
            second.press("ctrl+shift+v", "ctrl+s")
            second.wait_until((tmp_path / "second.json").exists, "saved map")
            second.press("ctrl+q")
            assert wait_for_end(second.process) == 0, read_errors(second.process)
    (pasted,) = load_map(tmp_path / "second.json").obstacles
    assert set(pasted.vertices) == {(1, 1), (3, 1), (3, 3), (1, 3)}


def test_a_picture_is_imported_with_the_room_that_was_clicked(display: str, tmp_path: Path) -> None:
    walls = np.zeros((100, 200), dtype=np.uint8)
    walls[10:90, 10:110] = walls[10:90, 120:190] = 255
    Image.fromarray(walls).save(tmp_path / "plan.png")
    with run_editor(display, tmp_path, tmp_path / "plan.png") as driver:
        driver.type("0.1")

        def find_red_area() -> tuple[float, float]:
            """Return the middle of the red area, px; (0, 0) if there is none."""
            red, green, blue = np.moveaxis(driver.take_screenshot(), 2, 0)
            found = np.argwhere((red > 180) & (green < 160) & (blue < 160))
            return (0.0, 0.0) if len(found) < 1000 else (np.median(found[:, 1]), np.median(found[:, 0]))

        driver.wait_until(lambda: find_red_area()[0], "room that is left out")
        x, y = find_red_area()
        driver.click(x, y)
        driver.wait_until(lambda: 0 < find_red_area()[0] < x - 50, "other room that is left out")
        driver.press("Return", "ctrl+s")
        driver.press("Return")
        driver.wait_until((tmp_path / "plan.json").exists, "saved map")
        driver.press("ctrl+q")
        assert wait_for_end(driver.process) == 0, read_errors(driver.process)
    assert load_map(tmp_path / "plan.json").free_area == pytest.approx(56.0)
