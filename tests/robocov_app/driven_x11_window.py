"""Windows on an invisible display, used by keys and mouse with Xvfb and xdotool."""

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

MAX_WAIT_S = 45.0


def wait_for_end(process: subprocess.Popen) -> int:
    """Wait until a process ends, and return its status; kill it if that takes too long."""
    try:
        return process.wait(MAX_WAIT_S)
    except subprocess.TimeoutExpired:
        process.kill()
        return process.wait()


@contextmanager
def start_display(size: str = "1200x800x24") -> Iterator[str]:
    """Start an invisible display, and yield its name."""
    read_end, write_end = os.pipe()
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", str(write_end), "-screen", "0", size, "-nolisten", "tcp", "-noreset"],
        pass_fds=(write_end,),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    os.close(write_end)
    try:
        with os.fdopen(read_end) as pipe:
            number = pipe.readline().strip()
        assert number, "Xvfb did not start"
        yield f":{number}"
    finally:
        server.terminate()
        wait_for_end(server)


class X11Driver:
    """Presses keys and moves the mouse in the window of a process.

    Parameters
    ----------
    process : subprocess.Popen
        The process.
    display : str
        Name of its display.
    folder : Path
        Folder in which the window saves screenshots.
    """

    def __init__(self, process: subprocess.Popen, display: str, folder: Path) -> None:
        self.process = process
        self.folder = folder
        self.screenshot_count = len(list(folder.glob("robocov-*.png")))
        self.environment = {**os.environ, "DISPLAY": display}
        self.window_id = ""

    def run_xdotool(self, *arguments: object) -> str:
        command = ["xdotool", *map(str, arguments)]
        process = subprocess.run(command, env=self.environment, capture_output=True, text=True, check=False)
        return process.stdout.strip()

    def wait_until(self, condition: Callable[[], object], description: str) -> None:
        started_at = time.monotonic()
        while not condition():
            errors = "" if self.process.poll() is None else read_errors(self.process)
            assert self.process.poll() is None, f"the process has ended before {description}: {errors}"
            assert time.monotonic() - started_at < MAX_WAIT_S, f"no {description}"
            time.sleep(0.03)

    def find_window(self) -> None:
        """Wait for the window, and give it the focus."""

        def has_window() -> bool:
            windows = self.run_xdotool("search", "--onlyvisible", "--pid", self.process.pid)
            self.window_id = windows.split("\n")[0]
            return bool(self.window_id)

        self.wait_until(has_window, "window")
        # There is no window manager that would give it the focus.
        self.run_xdotool("windowfocus", "--sync", self.window_id)
        time.sleep(0.3)

    def press(self, *keys: str) -> None:
        self.run_xdotool("key", "--delay", "60", *keys)

    def move(self, x: float, y: float) -> None:
        self.run_xdotool("mousemove", "--window", self.window_id, round(x), round(y))
        time.sleep(0.06)

    def drag(self, *path: tuple[float, float]) -> None:
        self.move(*path[0])
        self.run_xdotool("mousedown", 1)
        time.sleep(0.06)
        for point in path[1:]:
            self.move(*point)
        self.run_xdotool("mouseup", 1)
        time.sleep(0.06)

    def click(self, x: float, y: float, *, times: int = 1) -> None:
        self.move(x, y)
        self.run_xdotool("click", "--repeat", times, "--delay", 60, 1)
        time.sleep(0.08)

    def type(self, text: str) -> None:
        self.run_xdotool("type", "--delay", "25", text)

    def take_screenshot(self) -> np.ndarray:
        """Press F12, and return the saved pixels, (height, width, 3). Black screenshots are skipped."""
        while True:
            self.screenshot_count += 1
            path = self.folder / f"robocov-{self.screenshot_count}.png"
            self.press("F12")
            self.wait_until(path.exists, f"screenshot {path.name}")
            with Image.open(path) as image:
                pixels = np.asarray(image.convert("RGB")).astype(int)
            if pixels.any():
                return pixels

    def wait_for_screenshot(self, condition: Callable[[np.ndarray], object], description: str) -> np.ndarray:
        """Return the first screenshot that fulfills a condition. An action is drawn a frame later."""
        screenshots = []

        def is_fulfilled() -> object:
            screenshots.append(self.take_screenshot())
            return condition(screenshots[-1])

        self.wait_until(is_fulfilled, description)
        return screenshots[-1]


@contextmanager
def run_window(
    display: str, folder: Path, command: Sequence[object], **variables: str
) -> Iterator[X11Driver]:
    """Run a command that shows a window; yield a driver of the window.

    Parameters
    ----------
    display : str
        Name of the display.
    folder : Path
        Folder in which the window saves screenshots.
    command : sequence
        Program and arguments.
    **variables : str
        Further environment variables.
    """
    environment = dict(os.environ)
    environment.pop("WAYLAND_DISPLAY", None)
    environment |= {"DISPLAY": display, "SDL_VIDEODRIVER": "x11", **variables}
    process = subprocess.Popen(
        [str(argument) for argument in command],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        driver = X11Driver(process, display, folder)
        driver.find_window()
        yield driver
    finally:
        if process.poll() is None:
            process.kill()
        wait_for_end(process)
        for stream in (process.stdout, process.stderr):
            if stream is not None:
                stream.close()


def read_errors(process: subprocess.Popen) -> str:
    """Return the error output of a process that has ended, without a warning of SDL."""
    assert process.stderr is not None
    return "\n".join(line for line in process.stderr.read().splitlines() if "XDG_RUNTIME_DIR" not in line)
