"""Windows on a display that are ended by SIGTERM or SIGHUP, and their drafts."""

from __future__ import annotations

import json
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from command_calls import COMMAND
from driven_x11_window import MARKS, X11Driver, run_window, start_display
from served_window import serve_window

from robocov_app.storage.autosave import FOLDER_VARIABLE as DRAFTS_VARIABLE
from robocov_app.storage.settings import FOLDER_VARIABLE as SETTINGS_VARIABLE

pytestmark = MARKS

HANG_LIMIT_S = 40.0
"""A window ends within a second, but the machine may be busy."""


@pytest.fixture(scope="module")
def display() -> Iterator[str]:
    with start_display() as number:
        yield number


def build_environment(folder: Path, *, is_cold: bool) -> dict[str, str]:
    """Return environment variables with empty folders for drafts and, if cold, for compiled functions.

    Settings exist, since the first start of a window offers a lesson.
    """
    settings = folder / "settings"
    settings.mkdir()
    (settings / "window.json").write_text("{}")
    environment = {SETTINGS_VARIABLE: str(settings), DRAFTS_VARIABLE: str(folder / "drafts")}
    if is_cold:
        environment["NUMBA_CACHE_DIR"] = str(folder / "kernels")
        environment["ROBOCOV_CACHE"] = str(folder / "cache")
    return environment


def end_process(process: subprocess.Popen[str], number: int) -> None:
    """Send a signal to a process, which has to end soon."""
    process.send_signal(number)
    process.wait(HANG_LIMIT_S)


def read_drafts(folder: Path) -> list[dict]:
    return [json.loads(path.read_text()) for path in folder.rglob("draft.json")]


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_compiling_window_ends(display: str, tmp_path: Path, number: int) -> None:
    command = [*COMMAND, "demo", "square", "--robots", "3", "--folder", str(tmp_path)]
    with run_window(display, tmp_path, command, **build_environment(tmp_path, is_cold=True)) as driver:
        end_process(driver.process, number)


def test_a_compiling_served_window_ends(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in build_environment(tmp_path, is_cold=True).items():
        monkeypatch.setenv(name, value)
    with serve_window("demo", "square", "--robots", "3", "--folder", str(tmp_path)) as link:
        end_process(link.process, signal.SIGTERM)


def draw_circle(driver: X11Driver) -> None:
    driver.take_screenshot()
    driver.press("c")
    driver.drag((300, 300), (330, 300), (350, 300))
    driver.take_screenshot()


def open_save_question(driver: X11Driver) -> None:
    driver.press("ctrl+q")


def open_file_choice(driver: X11Driver) -> None:
    driver.press("ctrl+o")


def open_palette(driver: X11Driver) -> None:
    driver.press("ctrl+k")


def start_drag(driver: X11Driver) -> None:
    driver.move(400, 400)
    driver.run_xdotool("mousedown", 1)
    driver.move(430, 430)


@pytest.mark.parametrize("act", [open_save_question, open_file_choice, open_palette, start_drag])
def test_an_editor_with_an_open_dialog_or_drag_ends_and_keeps_its_draft(
    display: str, tmp_path: Path, act: Callable[[X11Driver], None]
) -> None:
    command = [*COMMAND, "edit", str(tmp_path / "m.json"), "--folder", str(tmp_path), "--size", "1000x640"]
    with run_window(display, tmp_path, command, **build_environment(tmp_path, is_cold=False)) as driver:
        draw_circle(driver)
        act(driver)
        time.sleep(0.3)
        assert driver.process.poll() is None
        end_process(driver.process, signal.SIGTERM)
    (draft,) = read_drafts(tmp_path / "drafts")
    assert len(draft["sketch"]["obstacles"]) == 1
