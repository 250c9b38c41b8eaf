"""Drafts of served windows: below their folder, offered at the next start, and little lost by kill -9."""

from __future__ import annotations

import json
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from sample_sessions import start_session
from served_window import Link, serve_window

from robocov_app.editor.edits.create import add_circle
from robocov_app.editor.ui.launch import EditorLauncher
from robocov_app.storage.autosave import FOLDER_VARIABLE, SERVED_FOLDER
from robocov_app.viewer.launch import ViewerLauncher

pytest.importorskip("websockets")

from websockets.sync.client import ClientConnection, connect

from robocov_app.web.files import list_saved

PATIENCE_S = 30.0


@pytest.fixture(autouse=True)
def _drafts_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(FOLDER_VARIABLE)
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")  # restored afterwards


def read_drafts(folder: Path) -> list[dict]:
    """Return the drafts that were written, without one that is just being written."""
    return [json.loads(path.read_text()) for path in (folder / SERVED_FOLDER).rglob("draft.json")]


def wait_for(condition: Callable[[], object]) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline, "timed out"
        time.sleep(0.02)


def test_a_served_editor_offers_its_draft_at_the_next_start(tmp_path: Path) -> None:
    with EditorLauncher(None, tmp_path, served=True).window() as window:
        editor = window.editor
        assert editor.dialogs.current is None
        editor.attempt(lambda: editor.apply(add_circle(editor.sketch, (5.0, 5.0), 1.0)))
        window.run_frame(0.1)
    assert list_saved(tmp_path, 0.0) == (), "the page does not list drafts"
    with EditorLauncher(None, tmp_path, served=True).window() as window:
        assert window.editor.dialogs.current.title == "Recover unsaved work?"
        window.editor.dialogs.current.answers[0].call()
        assert len(window.editor.sketch.obstacles) == 1


def test_a_served_viewer_offers_its_draft_at_the_next_start(tmp_path: Path) -> None:
    session = start_session()
    with ViewerLauncher(
        session, "hall", tmp_path, lattice=4, size=(900, 600), served=True
    ).window() as window:
        assert window.dialogs.current is None
        session.fail_robot(2)
        window.run_frame(0.1)
        window.close()
    assert list_saved(tmp_path, 0.0) == (), "the page does not list drafts"
    with ViewerLauncher(
        start_session(), "hall", tmp_path, lattice=4, size=(900, 600), served=True
    ).window() as window:
        assert window.dialogs.current.title == "Recover unsaved work?"
        window.dialogs.current.answers[0].call()
        assert window.viewer.session.displayed.numbers == (1, 3)
        window.close()


class Client:
    """A page that controls a served window, without a browser."""

    def __init__(self, line: ClientConnection) -> None:
        self.line = line
        self.send(kind="page", width=1000, height=700, ratio=1.0, dark=False)

    def send(self, **message: object) -> None:
        self.line.send(json.dumps(message))

    def press(self, key: str, held: int = 0) -> None:
        for down in (True, False):
            self.send(kind="key", key=key, down=down, held=held)

    def drag(self, *places: tuple[float, float]) -> None:
        """Press at the first place, move, and let go at the last."""
        for place in places:
            x, y = place
            if place is places[0]:
                self.send(kind="button", button=1, down=True, x=x, y=y)
            self.send(kind="move", button=1, x=x, y=y)
        self.send(kind="button", button=1, down=False, x=x, y=y)


@contextmanager
def open_controlling_client(link: Link) -> Iterator[Client]:
    place, token = link.split("/?token=")
    address = f"{place.replace('http', 'ws', 1)}/socket?token={token}"
    with connect(address, proxy=None, max_size=None) as line:
        yield Client(line)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals")
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_a_killed_served_editor_loses_at_most_about_a_second(tmp_path: Path, number: int) -> None:
    words = ("edit", "m.json", "--folder", str(tmp_path))
    with serve_window(*words, cwd=tmp_path) as link, open_controlling_client(link) as client:
        client.press("c")  # the tool for circles
        client.drag((300, 300), (330, 300), (350, 300))
        # a second, and as long as it takes until the circle is there
        wait_for(lambda: read_drafts(tmp_path) and read_drafts(tmp_path)[0].get("sketch"))
        client.press("q", held=2)  # which asks whether to save
        link.process.send_signal(number)
        link.process.wait(PATIENCE_S)
    (draft,) = read_drafts(tmp_path)
    assert len(draft["sketch"]["obstacles"]) == 1
    with serve_window(*words, cwd=tmp_path) as link, open_controlling_client(link) as client:
        client.press("Enter")  # Recover
        client.press("s", held=2)  # the map has a name already
        wait_for((tmp_path / "m.json").exists)
    (circle,) = json.loads((tmp_path / "m.json").read_text())["obstacles"]
    assert circle["kind"] == "circle"


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals")
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_a_killed_served_viewer_loses_at_most_about_a_second(tmp_path: Path, number: int) -> None:
    words = ("demo", "square", "--robots", "3", "--lattice", "8", "--paused", "--folder", str(tmp_path))
    with serve_window(*words, cwd=tmp_path) as link, open_controlling_client(link) as client:
        client.press("i")  # selects robot 1
        client.press("Delete")
        wait_for(lambda: read_drafts(tmp_path) and read_drafts(tmp_path)[0].get("session"))
        link.process.send_signal(number)
        link.process.wait(PATIENCE_S)
    with serve_window(*words, cwd=tmp_path) as link, open_controlling_client(link) as client:
        client.press("Enter")  # Recover
        client.press("s", held=2)
        wait_for(lambda: list(tmp_path.glob("*.robocov")))
    (saved,) = tmp_path.glob("*.robocov")
    _, removal = json.loads(saved.read_text())["edits"]
    assert [change["do"] for change in removal["changes"]] == ["leave"]
