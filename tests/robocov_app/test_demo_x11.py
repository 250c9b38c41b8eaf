"""The real window under X11: with real keys, a real mouse and a real end."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from called import COMMAND
from PIL import Image

from robocov_app.demo.settings import FOLDER

MISSING = [name for name in ("Xvfb", "xdotool") if shutil.which(name) is None]
pytestmark = [
    pytest.mark.xdist_group("x11"),
    pytest.mark.skipif(sys.platform != "linux", reason="X11"),
    pytest.mark.skipif(bool(MISSING), reason=f"not installed: {', '.join(MISSING)}"),
]

PATIENCE = 15.0
SIZE = (1000, 640)


def ended(process: subprocess.Popen) -> int:
    """Wait for the end of a process, and see to it."""
    try:
        return process.wait(PATIENCE)
    except subprocess.TimeoutExpired:
        process.kill()
        return process.wait()


@pytest.fixture(scope="module")
def display() -> Iterator[str]:
    """Start a display that nobody sees, on a number that is free."""
    read, write = os.pipe()
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", str(write), "-screen", "0", "1200x800x24", "-nolisten", "tcp", "-noreset"],
        pass_fds=(write,),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    os.close(write)
    try:
        with os.fdopen(read) as told:
            number = told.readline().strip()
        assert number, "Xvfb did not start"
        yield f":{number}"
    finally:
        server.terminate()
        ended(server)


class Hands:
    """Presses keys and the mouse in the window of a process."""

    def __init__(self, process: subprocess.Popen, display: str, folder: Path) -> None:
        self.process, self.folder, self.shots = process, folder, 0
        self.kept = {**os.environ, "DISPLAY": display}
        self.window = ""

    def tool(self, *words: object) -> str:
        done = subprocess.run(
            ["xdotool", *map(str, words)], env=self.kept, capture_output=True, text=True, check=False
        )
        return done.stdout.strip()

    def until(self, there: Callable[[], object], what: str) -> None:
        began = time.monotonic()
        while not there():
            assert self.process.poll() is None, f"it has ended before {what}: {said(self.process)}"
            assert time.monotonic() - began < PATIENCE, f"no {what}"
            time.sleep(0.03)

    def find(self) -> None:
        def found() -> bool:
            self.window = self.tool("search", "--onlyvisible", "--pid", self.process.pid).split("\n")[0]
            return bool(self.window)

        self.until(found, "window")
        # there is no window manager that would do it
        self.tool("windowfocus", "--sync", self.window)
        time.sleep(0.3)

    def key(self, *names: str) -> None:
        self.tool("key", "--delay", "60", *names)

    def move(self, x: float, y: float) -> None:
        self.tool("mousemove", "--window", self.window, round(x), round(y))
        time.sleep(0.06)

    def drag(self, *path: tuple[float, float]) -> None:
        self.move(*path[0])
        self.tool("mousedown", 1)
        time.sleep(0.06)
        for place in path[1:]:
            self.move(*place)
        self.tool("mouseup", 1)
        time.sleep(0.06)

    def shot(self) -> np.ndarray:
        """Press F12, and return the picture that this saves; the first may come before anything is drawn."""
        while True:
            self.shots += 1
            path = self.folder / f"robocov-{self.shots}.png"
            self.key("F12")
            self.until(path.exists, f"picture {path.name}")
            with Image.open(path) as picture:
                pixels = np.asarray(picture.convert("RGB")).astype(int)
            if pixels.any():
                return pixels


@contextmanager
def shown(display: str, folder: Path, *words: str) -> Iterator[Hands]:
    kept = {
        key: value for key, value in os.environ.items() if key not in ("SDL_VIDEODRIVER", "WAYLAND_DISPLAY")
    }
    kept |= {"DISPLAY": display, FOLDER: str(folder / "settings"), "SDL_VIDEODRIVER": "x11"}
    command = [*COMMAND, "demo", "square", "--folder", str(folder), "--size", f"{SIZE[0]}x{SIZE[1]}"]
    options = ["--scale", "1", "--lattice", "16", "--robots", "3", "--paused", *words]
    process = subprocess.Popen(
        [*command, *options], env=kept, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    try:
        hands = Hands(process, display, folder)
        hands.find()
        yield hands
    finally:
        if process.poll() is None:
            process.kill()
        ended(process)
        for stream in (process.stdout, process.stderr):
            if stream is not None:
                stream.close()


def said(process: subprocess.Popen) -> str:
    assert process.stderr is not None
    return "\n".join(line for line in process.stderr.read().splitlines() if "XDG_RUNTIME_DIR" not in line)


def test_keys_and_mouse_reach_the_window_and_it_ends_as_it_should(display: str, tmp_path: Path) -> None:
    with shown(display, tmp_path) as hands:
        first = hands.shot()
        assert first.shape == (SIZE[1], SIZE[0], 3) and first.mean() > 190

        hands.key("t", "w")
        dark = hands.shot()
        assert dark.mean() < 90

        hands.key("c")
        hands.drag((300, 200), (330, 200), (340, 200))
        hands.move(20, 20)
        drawn = hands.shot()
        around = np.abs(drawn - dark)[170:230, 270:330].max(axis=2)
        assert (around > 20).mean() > 0.6  # there is a pillar now

        hands.key("v", "space")
        time.sleep(0.4)
        hands.key("space")
        played = hands.shot()
        assert not np.array_equal(played, drawn)

        hands.key("slash")
        hands.tool("type", "--delay", "20", "robots 1")
        hands.key("Return")
        hands.move(20, 20)
        alone = hands.shot()
        hands.move(SIZE[0] - 234, 74)  # the field of the number of robots
        hands.tool("click", 1)
        hands.tool("type", "--delay", "20", "3")
        hands.key("Return")
        hands.move(20, 20)
        together = hands.shot()
        track = np.s_[SIZE[1] - 26 :]
        assert not np.array_equal(alone[track], played[track])  # its time is 0 again
        assert np.abs(together - alone)[:400, :600].max() > 60
        hands.key("ctrl+s")
        hands.until(lambda: (tmp_path / "square-1.json").exists(), "saved map")
        (pillar,) = json.loads((tmp_path / "square-1.json").read_text())["obstacles"]
        assert pillar["kind"] == "circle" and pillar["radius"] > 0.3

        hands.key("ctrl+q")
        assert ended(hands.process) == 0, said(hands.process)
        assert said(hands.process) == ""
    settings = json.loads((tmp_path / "settings/window.json").read_text())
    assert settings["theme"] == "dark" and (settings["width"], settings["height"]) == SIZE


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
    assert (settings["width"], settings["height"]) == SIZE


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
