"""Sizes, files, numbers and texts that once raised an error in a window or blocked it."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Callable
from pathlib import Path
from unittest.mock import Mock

import pygame
import pytest
from driven_editor import EditorDriver, build_sheet, open_editor
from driven_window import Driver, open_viewer, resize_window

from robocov.environment import CircleObstacle
from robocov_app.editor.edits.create import add_circle
from robocov_app.editor.model.background import Background
from robocov_app.editor.model.document import Document
from robocov_app.editor.model.map_draft import find_recoverable
from robocov_app.editor.model.selection import Selection
from robocov_app.jobs.workers import LatestWorker
from robocov_app.toolkit.window.input import get_wheel_notches

posix_only = pytest.mark.skipif(sys.platform == "win32", reason="pipes and links")


@pytest.mark.parametrize("precise", [math.nan, math.inf, -math.inf])
def test_whole_notches_replace_a_wheel_value_that_is_not_finite(precise: float) -> None:
    event = pygame.event.Event(pygame.MOUSEWHEEL, x=0, y=2, precise_x=0.0, precise_y=precise)
    assert get_wheel_notches(event) == 2.0


def press_keys(driver: Driver | EditorDriver, *keys: str) -> None:
    for key in keys:
        driver.press_key(key)


@pytest.mark.parametrize("size", [(1, 1), (3, 700), (1300, 30)])
class TestTinyWindow:
    def test_the_viewer_can_be_used(self, size: tuple[int, int], tmp_path: Path) -> None:
        with open_viewer(tmp_path) as driver:
            resize_window(driver, size)
            assert pygame.display.get_surface().get_size() == size
            press_keys(driver, "ctrl+k", "escape", "f1")
            resize_window(driver, (900, 600))
            assert driver.window.screen is pygame.display.get_surface()

    def test_the_editor_can_be_used(self, size: tuple[int, int], tmp_path: Path) -> None:
        with open_editor(tmp_path) as driver:
            resize_window(driver, size)
            press_keys(driver, "ctrl+k", "escape", "f5", "f5")
            resize_window(driver, (900, 600))
            assert driver.window.screen is pygame.display.get_surface()


def create_pipe(path: Path) -> None:
    os.mkfifo(path)


def create_loop_of_links(path: Path) -> None:
    path.symlink_to(path)


@posix_only
@pytest.mark.timeout(60)
@pytest.mark.parametrize("suffix", [".json", ".png", ".robocov"])
@pytest.mark.parametrize(
    ("create_file", "message"),
    [
        pytest.param(create_pipe, "got a pipe or a device", id="pipe"),
        pytest.param(create_loop_of_links, "got a broken link", id="loop"),
    ],
)
class TestDroppedFile:
    def test_the_viewer_rejects_it(
        self, create_file: Callable[[Path], None], message: str, suffix: str, tmp_path: Path
    ) -> None:
        path = tmp_path / f"file{suffix}"
        create_file(path)
        with open_viewer(tmp_path / "viewer") as driver:
            driver.post(pygame.DROPFILE, file=str(path))
            driver.settle()
            assert message in driver.viewer.message

    def test_the_editor_rejects_it(
        self, create_file: Callable[[Path], None], message: str, suffix: str, tmp_path: Path
    ) -> None:
        path = tmp_path / f"file{suffix}"
        create_file(path)
        with open_editor(tmp_path) as driver:
            driver.post(pygame.DROPFILE, file=str(path))
            driver.settle()
            assert message in driver.message


@posix_only
@pytest.mark.timeout(60)
def test_a_background_that_is_a_pipe_does_not_block_the_window(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "plan.png")
    sketch = build_sheet(background=Background("plan.png", (10, 10)))
    with open_editor(tmp_path, sketch) as driver:
        driver.editor.shown.add("picture")
        driver.window.run_frame(0.1)
        assert "got a pipe or a device" in driver.message


def test_a_draft_with_a_huge_circle_is_drawn(tmp_path: Path) -> None:
    sketch = build_sheet(CircleObstacle((5.0, 5.0), 1e308), CircleObstacle((1e308, -1e308), 0.5))
    with open_editor(tmp_path, sketch) as driver:
        driver.select(*(item.key for item in sketch.obstacles))
        assert driver.editor.selection == Selection.of(0, 1)
        driver.window.run_frame(0.1)


def test_an_open_list_with_outdated_names_chooses_nothing(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        driver.click(*driver.get_widget("menu", "map").rect.center)
        assert driver.window.panel.ui.open_list is not None
        driver.viewer.files.open_map("square")
        driver.press_key("return")
        assert driver.viewer.files.map_name == "square"


@posix_only
def test_a_map_whose_file_name_is_not_text_has_drafts(tmp_path: Path) -> None:
    path = Path(os.fsdecode(os.fsencode(tmp_path) + b"/caf\xe9.json"))
    document = Document.new(tmp_path / "drafts", path)
    with open_editor(tmp_path, document=document) as driver:
        driver.editor.apply(add_circle(driver.sketch, (5.0, 5.0), 1.0))
        driver.window.run_frame(0.1)
        assert document.flush()
    (draft,) = find_recoverable(tmp_path / "drafts")
    assert draft.path == path
    assert len(draft.read_sketch().obstacles) == 1


def test_a_request_that_cannot_be_pickled_is_reported() -> None:
    worker = LatestWorker[object]("slow_service:Slow", "works")
    try:
        worker.put(lambda: None)
        for _ in range(2000):
            worker.poll()
            if not worker.is_busy:
                break
            pygame.time.wait(10)
        assert not worker.is_busy
        assert "has ended" in worker.problem
    finally:
        worker.close()


def test_a_process_that_cannot_be_started_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    error = OSError(11, "Resource temporarily unavailable")
    monkeypatch.setattr("robocov_app.jobs.workers.start_process", Mock(side_effect=error))
    worker = LatestWorker[object]("slow_service:Slow", "works")
    worker.put(1)
    assert not worker.is_busy
    assert worker.poll() is None
    assert worker.problem == "the process that works cannot be started: Resource temporarily unavailable"
