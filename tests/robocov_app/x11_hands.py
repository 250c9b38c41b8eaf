"""Windows on a display that nobody sees, and hands for them: Xvfb and xdotool."""

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

MISSING = [name for name in ("Xvfb", "xdotool") if shutil.which(name) is None]
MARKS = [
    pytest.mark.slow,
    pytest.mark.xdist_group("x11"),
    pytest.mark.skipif(sys.platform != "linux", reason="X11"),
    pytest.mark.skipif(bool(MISSING), reason=f"not installed: {', '.join(MISSING)}"),
]

PATIENCE = 45.0


def ended(process: subprocess.Popen) -> int:
    """Wait for the end of a process, and see to it."""
    try:
        return process.wait(PATIENCE)
    except subprocess.TimeoutExpired:
        process.kill()
        return process.wait()


@contextmanager
def invisible_display(size: str = "1200x800x24") -> Iterator[str]:
    """Start a display that nobody sees, on a number that is free."""
    read, write = os.pipe()
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", str(write), "-screen", "0", size, "-nolisten", "tcp", "-noreset"],
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
        self.process, self.folder = process, folder
        self.shots = len(list(folder.glob("robocov-*.png")))
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

    def click(self, x: float, y: float, *, times: int = 1) -> None:
        self.move(x, y)
        self.tool("click", "--repeat", times, "--delay", 60, 1)
        time.sleep(0.08)

    def type(self, text: str) -> None:
        self.tool("type", "--delay", "25", text)

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

    def sees(self, there: Callable[[np.ndarray], object], what: str) -> np.ndarray:
        """Return the first picture in which something is there; what was done is drawn a frame later."""
        pictures = []
        self.until(lambda: pictures.append(self.shot()) or there(pictures[-1]), what)
        return pictures[-1]


@contextmanager
def run_window(display: str, folder: Path, command: Sequence[object], **environment: str) -> Iterator[Hands]:
    """Run a command that shows a window, with hands for it."""
    kept = {
        key: value for key, value in os.environ.items() if key not in ("SDL_VIDEODRIVER", "WAYLAND_DISPLAY")
    }
    kept |= {"DISPLAY": display, "SDL_VIDEODRIVER": "x11", **environment}
    process = subprocess.Popen(
        [str(word) for word in command], env=kept, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
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
