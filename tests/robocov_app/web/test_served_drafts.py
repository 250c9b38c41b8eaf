"""Drafts of served windows: they are in the served folder, and survive a crash of the process."""

from __future__ import annotations

import json
import signal
import sys
from contextlib import AbstractContextManager
from pathlib import Path

import pytest
from sample_sessions import start_session
from served_window import serve_window

from robocov.environment import CircleObstacle
from robocov_app.editor.edits.create import add_circle
from robocov_app.editor.ui.launch import EditorLauncher
from robocov_app.storage.autosave import FOLDER_VARIABLE, SERVED_FOLDER
from robocov_app.viewer.launch import ViewerLauncher
from robocov_app.viewer.window.window import ViewerWindow

pytest.importorskip("websockets")

from page_client import MAX_WAIT_S, connect_page, wait_until

from robocov_app.web.files import list_saved


@pytest.fixture(autouse=True)
def _write_drafts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(FOLDER_VARIABLE)
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")  # restored afterwards


def read_drafts(folder: Path) -> list[dict]:
    """Return the drafts in the folder of a served window."""
    return [json.loads(path.read_text()) for path in (folder / SERVED_FOLDER).rglob("draft.json")]


def test_a_served_editor_offers_to_recover_its_draft(tmp_path: Path) -> None:
    with EditorLauncher(None, tmp_path, served=True).window() as window:
        editor = window.editor
        assert editor.dialogs.current is None
        editor.attempt(lambda: editor.apply(add_circle(editor.sketch, (5.0, 5.0), 1.0)))
        window.run_frame(0.1)
    assert list_saved(tmp_path, 0.0) == (), "drafts are no files to download"
    with EditorLauncher(None, tmp_path, served=True).window() as window:
        assert window.editor.dialogs.current.title == "Recover unsaved work?"
        window.editor.dialogs.current.answers[0].call()
        assert len(window.editor.sketch.obstacles) == 1


def open_served_viewer(folder: Path) -> AbstractContextManager[ViewerWindow]:
    """Open the window of a new session that is served from a folder."""
    launcher = ViewerLauncher(start_session(), "hall", folder, lattice=4, size=(900, 600), served=True)
    return launcher.window()


def recover_numbers(window: ViewerWindow) -> tuple[int, ...]:
    """Recover the draft that a window offers, and return the numbers of the robots that work."""
    assert window.dialogs.current.title == "Recover unsaved work?"
    window.dialogs.current.answers[0].call()
    # On a busy machine, the session is recomputed over several frames.
    window.viewer.session.timeline.finish_seek()
    numbers = window.viewer.session.displayed.numbers
    window.close()
    return numbers


def test_a_served_viewer_offers_to_recover_its_draft(tmp_path: Path) -> None:
    with open_served_viewer(tmp_path) as window:
        assert window.dialogs.current is None
        window.viewer.session.fail_robot(2)
        window.run_frame(0.1)
        window.close()
    assert list_saved(tmp_path, 0.0) == (), "drafts are no files to download"
    with open_served_viewer(tmp_path) as window:
        assert recover_numbers(window) == (1, 3)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals")
@pytest.mark.parametrize("signal_number", [signal.SIGKILL, signal.SIGTERM])
def test_a_killed_served_editor_recovers_the_work_of_its_draft(tmp_path: Path, signal_number: int) -> None:
    arguments = ("edit", "m.json", "--folder", str(tmp_path))
    with serve_window(*arguments, cwd=tmp_path) as link, connect_page(link) as page:
        page.report_page(1000, 700)
        page.press_key("c")  # the circle tool
        page.drag((300, 300), (330, 300), (350, 300))
        wait_until(lambda: read_drafts(tmp_path) and read_drafts(tmp_path)[0].get("sketch"))
        page.press_key("q", held=2)  # The window asks whether to save.
        link.process.send_signal(signal_number)
        link.process.wait(MAX_WAIT_S)
    with EditorLauncher(None, tmp_path, served=True).window() as window:
        window.editor.dialogs.current.answers[0].call()
        (circle,) = window.editor.sketch.obstacles
        assert isinstance(circle.shape, CircleObstacle)
        assert window.editor.document.path == tmp_path / "m.json"


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals")
@pytest.mark.parametrize("signal_number", [signal.SIGKILL, signal.SIGTERM])
def test_a_killed_served_viewer_recovers_the_work_of_its_draft(tmp_path: Path, signal_number: int) -> None:
    arguments = ("demo", "square", "--robots", "3", "--lattice", "8", "--paused", "--folder", str(tmp_path))
    with serve_window(*arguments, cwd=tmp_path) as link, connect_page(link) as page:
        page.report_page(1000, 700)
        page.press_key("i")  # Select robot 1.
        page.press_key("Delete")
        wait_until(lambda: read_drafts(tmp_path) and read_drafts(tmp_path)[0].get("session"))
        link.process.send_signal(signal_number)
        link.process.wait(MAX_WAIT_S)
    with open_served_viewer(tmp_path) as window:
        assert recover_numbers(window) == (2, 3)
