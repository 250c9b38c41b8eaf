"""The real window under X11: with real keys, a real mouse and a real end."""

from __future__ import annotations

import json
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from called import COMMAND
from x11_hands import MARKS, Hands, ended, invisible_display, run_window, said

from robocov_app.storage.settings import FOLDER_VARIABLE

pytestmark = MARKS

SIZE = (1000, 640)


@pytest.fixture(scope="module")
def display() -> Iterator[str]:
    with invisible_display() as number:
        yield number


@contextmanager
def shown(display: str, folder: Path, *words: str) -> Iterator[Hands]:
    command = [*COMMAND, "demo", "square", "--folder", str(folder), "--size", f"{SIZE[0]}x{SIZE[1]}"]
    options = ["--scale", "1", "--lattice", "16", "--robots", "3", "--paused", *words]
    settings = folder / "settings"
    settings.mkdir(exist_ok=True)
    (settings / "window.json").write_text("{}")  # not the first start, at which the lesson is offered
    with run_window(display, folder, [*command, *options], **{FOLDER_VARIABLE: str(settings)}) as hands:
        yield hands


def test_keys_and_mouse_reach_the_window_and_it_ends_as_it_should(display: str, tmp_path: Path) -> None:
    with shown(display, tmp_path) as hands:
        first = hands.shot()
        assert first.shape == (SIZE[1], SIZE[0], 3) and first.mean() > 190

        hands.key("t", "w")
        dark = hands.sees(lambda picture: picture.mean() < 90, "dark window")

        hands.key("c")
        hands.drag((300, 200), (330, 200), (340, 200))
        hands.move(20, 20)

        def pillar_there(picture: np.ndarray) -> bool:
            around = np.abs(picture - dark)[170:230, 270:330].max(axis=2)
            return (around > 20).mean() > 0.6

        drawn = hands.sees(pillar_there, "pillar")

        hands.key("v", "space")
        time.sleep(0.4)
        hands.key("space")
        played = hands.sees(lambda picture: not np.array_equal(picture, drawn), "motion")

        hands.key("slash")
        hands.tool("type", "--delay", "20", "robots 1")
        hands.key("Return")
        hands.move(20, 20)
        track = np.s_[SIZE[1] - 26 :]
        alone = hands.sees(lambda picture: not np.array_equal(picture[track], played[track]), "time 0")
        hands.move(SIZE[0] - 234, 74)  # the field of the number of robots
        hands.tool("click", 1)
        hands.tool("type", "--delay", "20", "3")
        hands.key("Return")
        hands.move(20, 20)
        hands.sees(lambda picture: np.abs(picture - alone)[:400, :600].max() > 60, "three robots")
        hands.key("ctrl+shift+s")
        hands.until(lambda: (tmp_path / "square-1.json").exists(), "saved map")
        (pillar,) = json.loads((tmp_path / "square-1.json").read_text())["obstacles"]
        assert pillar["kind"] == "circle" and pillar["radius"] > 0.3

        hands.key("ctrl+q")
        assert ended(hands.process) == 0, said(hands.process)
        assert said(hands.process) == ""
    settings = json.loads((tmp_path / "settings/window.json").read_text())
    assert settings["theme"] == "dark" and (settings["width"], settings["height"]) == (1280, 720)


def test_full_screen_and_back(display: str, tmp_path: Path) -> None:
    with shown(display, tmp_path) as hands:
        hands.shot()
        for shape in ((800, 1200, 3), (SIZE[1], SIZE[0], 3)):
            hands.key("F11")
            time.sleep(0.5)
            hands.find()
            picture = hands.shot()
            assert picture.shape == shape
            assert picture[:, -1].mean() > 190  # the panel is at the edge again
        hands.key("F11")
        time.sleep(0.5)
        hands.find()
        hands.key("ctrl+q")
        assert ended(hands.process) == 0, said(hands.process)
        assert said(hands.process) == ""
    settings = json.loads((tmp_path / "settings/window.json").read_text())
    assert (settings["width"], settings["height"]) == (1280, 720), "options hold for one start"


def test_a_signal_closes_it_cleanly_and_ends_its_film(display: str, tmp_path: Path) -> None:
    with shown(display, tmp_path) as hands:
        hands.key("space", "t", "F9")
        hands.until(lambda: list(tmp_path.glob("*.mp4")), "film")
        time.sleep(0.5)
        hands.process.send_signal(signal.SIGTERM)
        status = ended(hands.process)
        words = said(hands.process)
        assert status == 0 and words == ""
    import imageio_ffmpeg

    assert imageio_ffmpeg.count_frames_and_secs(str(tmp_path / "robocov-1.mp4"))[0] > 3
    assert json.loads((tmp_path / "settings/window.json").read_text())["theme"] == "dark"
