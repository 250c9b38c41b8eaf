"""The viewer's window under X11, with keys, mouse and signals of the system."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from command_calls import COMMAND
from driven_x11_window import MARKS, X11Driver, read_errors, run_window, start_display, wait_for_end

from robocov_app.storage.settings import FOLDER_VARIABLE
from robocov_app.toolkit.window.layout import BAR_HEIGHT_PX

pytestmark = MARKS

SIZE = (1000, 640)


@pytest.fixture(scope="module")
def display() -> Iterator[str]:
    with start_display() as number:
        yield number


@contextmanager
def open_window(display: str, folder: Path) -> Iterator[X11Driver]:
    command = [*COMMAND, "demo", "square", "--folder", str(folder), "--size", f"{SIZE[0]}x{SIZE[1]}"]
    options = ["--scale", "1", "--lattice", "16", "--robots", "3", "--paused"]
    settings = folder / "settings"
    settings.mkdir(exist_ok=True)
    # With a settings file, the window does not offer the lesson.
    (settings / "window.json").write_text("{}")
    with run_window(display, folder, [*command, *options], **{FOLDER_VARIABLE: str(settings)}) as driver:
        yield driver


def test_keys_and_mouse_reach_the_window_until_it_is_closed(display: str, tmp_path: Path) -> None:
    with open_window(display, tmp_path) as driver:
        first = driver.take_screenshot()
        assert first.shape == (SIZE[1], SIZE[0], 3)
        assert first.mean() > 190

        driver.press("t", "w")
        dark = driver.wait_for_screenshot(lambda picture: picture.mean() < 90, "dark window")

        driver.press("c")
        driver.drag((300, 200), (330, 200), (340, 200))
        driver.move(20, 20)

        def shows_pillar(picture: np.ndarray) -> bool:
            around = np.abs(picture - dark)[170:230, 270:330].max(axis=2)
            return (around > 20).mean() > 0.6

        drawn = driver.wait_for_screenshot(shows_pillar, "pillar")

        driver.press("v", "space")
        time.sleep(0.4)
        driver.press("space")
        played = driver.wait_for_screenshot(lambda picture: not np.array_equal(picture, drawn), "motion")

        driver.press("slash")
        driver.run_xdotool("type", "--delay", "20", "robots 1")
        driver.press("Return")
        driver.move(20, 20)
        track = np.s_[SIZE[1] - 26 :]

        def has_restarted(picture: np.ndarray) -> bool:
            return not np.array_equal(picture[track], played[track])

        one_robot = driver.wait_for_screenshot(has_restarted, "time 0")
        driver.move(SIZE[0] - 234, 74 + BAR_HEIGHT_PX)  # the field of the number of robots
        driver.run_xdotool("click", 1)
        driver.run_xdotool("type", "--delay", "20", "3")
        driver.press("Return")
        driver.move(20, 20)
        driver.wait_for_screenshot(
            lambda picture: np.abs(picture - one_robot)[:400, :600].max() > 60, "three robots"
        )
        driver.press("ctrl+shift+s")
        driver.wait_until(lambda: (tmp_path / "square-1.json").exists(), "saved map")
        (pillar,) = json.loads((tmp_path / "square-1.json").read_text())["obstacles"]
        assert pillar["kind"] == "circle"
        assert pillar["radius"] > 0.3

        driver.press("ctrl+q")
        assert wait_for_end(driver.process) == 0, read_errors(driver.process)
        assert read_errors(driver.process) == ""
    settings = json.loads((tmp_path / "settings/window.json").read_text())
    assert settings["theme"] == "dark"
    assert (settings["width"], settings["height"]) == (1280, 720)


def test_full_screen_can_be_switched_on_and_off(display: str, tmp_path: Path) -> None:
    with open_window(display, tmp_path) as driver:
        driver.take_screenshot()
        for shape in ((800, 1200, 3), (SIZE[1], SIZE[0], 3)):
            driver.press("F11")
            time.sleep(0.5)
            driver.find_window()
            picture = driver.take_screenshot()
            assert picture.shape == shape
            assert picture[:, -1].mean() > 190, "the panel is at the right edge"
        driver.press("F11")
        time.sleep(0.5)
        driver.find_window()
        driver.press("ctrl+q")
        assert wait_for_end(driver.process) == 0, read_errors(driver.process)
        assert read_errors(driver.process) == ""
    settings = json.loads((tmp_path / "settings/window.json").read_text())
    assert settings.keys().isdisjoint({"width", "height"}), (
        "neither the option --size nor full screen is saved"
    )


def test_a_signal_closes_the_window_and_completes_its_video(display: str, tmp_path: Path) -> None:
    with open_window(display, tmp_path) as driver:
        driver.press("space", "t", "F9")
        driver.wait_until(lambda: list(tmp_path.glob("*.mp4")), "video")
        time.sleep(0.5)
        driver.process.send_signal(signal.SIGTERM)
        status = wait_for_end(driver.process)
        assert status == 0
        assert read_errors(driver.process) == ""
    import imageio_ffmpeg

    assert imageio_ffmpeg.count_frames_and_secs(str(tmp_path / "robocov-1.mp4"))[0] > 3
    assert json.loads((tmp_path / "settings/window.json").read_text())["theme"] == "dark"


def test_a_window_is_opened_once_so_that_no_key_is_lost(display: str) -> None:
    script = (
        "import pygame\n"
        "from robocov_app.toolkit.window.display import open_display, open_window\n"
        "with open_display(headless=False, missing_message='no display'):\n"
        "    open_window((900, 600))\n"
        "    print([pygame.event.event_name(event.type) for event in pygame.event.get()])\n"
    )
    environment = {**os.environ, "DISPLAY": display}
    environment.pop("SDL_VIDEODRIVER", None)
    result = subprocess.run(
        [sys.executable, "-c", script], env=environment, capture_output=True, text=True, check=True
    )
    assert "WindowShown" in result.stdout
    assert "WindowHidden" not in result.stdout
