"""Odd sizes, files, numbers and texts that once raised an error in a window or blocked it."""

from __future__ import annotations

import math
import os
import sys
from pathlib import Path

import pygame
import pytest
from driven_editor import build_sheet, open_editor
from driven_window import open_viewer, resize_window

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


@pytest.mark.parametrize("size", [(1, 1), (3, 700), (1300, 30)])
def test_a_tiny_window_shows_a_part_of_a_larger_surface(size: tuple[int, int], tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        resize_window(driver, size)
        assert pygame.display.get_surface().get_size() == size
        driver.press_key("ctrl+k")
        driver.press_key("escape")
        driver.press_key("f1")
        resize_window(driver, (900, 600))
        assert driver.window.screen is pygame.display.get_surface()
    with open_editor(tmp_path) as driver:
        resize_window(driver, size)
        driver.press_key("ctrl+k")
        driver.press_key("escape")
        driver.press_key("f5")
        driver.press_key("f5")
        resize_window(driver, (900, 600))
        assert driver.window.screen is pygame.display.get_surface()


@posix_only
@pytest.mark.timeout(60)
@pytest.mark.parametrize("suffix", [".json", ".png", ".robocov"])
def test_a_dropped_pipe_or_loop_of_links_is_refused(suffix: str, tmp_path: Path) -> None:
    pipe = tmp_path / f"pipe{suffix}"
    link = tmp_path / f"loop{suffix}"
    os.mkfifo(pipe)
    link.symlink_to(link)
    with open_viewer(tmp_path / "viewer") as driver:
        for path, expected in ((pipe, "got a pipe or a device"), (link, "got a broken link")):
            driver.post(pygame.DROPFILE, file=str(path))
            driver.settle()
            assert expected in driver.viewer.message
    with open_editor(tmp_path) as driver:
        for path, expected in ((pipe, "got a pipe or a device"), (link, "got a broken link")):
            driver.post(pygame.DROPFILE, file=str(path))
            driver.settle()
            assert expected in driver.message


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


def test_a_question_that_cannot_be_sent_is_reported(capfd: pytest.CaptureFixture[str]) -> None:
    worker = LatestWorker[object]("slow_service:Slow", "works")
    try:
        worker.put(lambda: None)  # a lambda cannot be pickled
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
    def refuse(service: str) -> None:
        raise OSError(11, "Resource temporarily unavailable")

    monkeypatch.setattr("robocov_app.jobs.workers.start_process", refuse)
    worker = LatestWorker[object]("slow_service:Slow", "works")
    worker.put(1)
    assert not worker.is_busy
    assert worker.poll() is None
    assert worker.problem == "the process that works cannot be started: Resource temporarily unavailable"
