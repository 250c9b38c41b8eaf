"""Measure how soon windows are visible and how fast they answer, with an empty and with a warm cache.

    python tests/bench/first_start.py --seconds 60

The script opens windows on a virtual display (Xvfb, xdotool) and in headless Chromium. For each, it prints
the time from the command to the first picture, and the response times to a key that switches between light
and dark. It presses this key again and again: with an empty cache, while kernels are compiled. The last
window is that of a card of the start page, which is pressed as soon as the page is visible.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "robocov_app"))

from driven_browser import Browser
from served_window import serve_window

from robocov_app.storage.autosave import FOLDER_VARIABLE as DRAFT_FOLDER_VARIABLE

SIZE_PX = (1280, 720)
MAX_WAIT_S = 120.0
PIXEL_STEP = 8
"""Only every eighth row and column of the screen is read, so that the script leaves the processor alone."""
MIN_COLORS = 12
"""A picture with fewer colors shows an empty window."""
KEY_INTERVAL_S = 0.25
"""Time between an answer and the next key."""
POLL_INTERVAL_S = 0.02
THEME_KEY = "t"
FIRST_CARD_KEY = "1"
WINDOW_COMMANDS: Sequence[Sequence[str]] = (("demo",), ("demo", "rooms"), ("edit",))
SERVED_COMMANDS: Sequence[Sequence[str]] = (("demo", "rooms"), ("demo", "rooms", "--each"), ("edit",))

MEASURE_RESPONSES = """
const [seconds, interval, key, done] = arguments;
const limit = 60000;
const pause = (duration) => new Promise((then) => setTimeout(then, duration));
const isDark = () => {
  const [red, green, blue] = context.getImageData(canvas.width - 4, canvas.height - 4, 1, 1).data;
  return red + green + blue < 384;
};
(async () => {
  const times = [];
  const end = performance.now() + 1000 * seconds;
  while (performance.now() < end) {
    const before = isDark();
    const start = performance.now();
    for (const down of [true, false]) send({kind: 'key', key, held: 0, down});
    while (isDark() === before && performance.now() - start < limit) await pause(4);
    times.push((performance.now() - start) / 1000);
    await pause(1000 * interval);
  }
  done(times);
})();
"""
"""JavaScript that presses the key in the page, and returns the response times, s."""


@dataclass(frozen=True)
class Screen:
    """An invisible display, whose picture is in a file.

    Attributes
    ----------
    name : str
    picture_file : Path
        File in the format xwd, into which the X server draws.
    """

    name: str
    picture_file: Path

    def read(self) -> np.ndarray:
        """Return every `PIXEL_STEP`-th row and column of the picture, 0xRRGGBB."""
        header = np.fromfile(self.picture_file, dtype=">u4", count=25)
        header_bytes, width, height, row_bytes, n_colors = (int(header[k]) for k in (0, 4, 5, 12, 19))
        start = header_bytes + 12 * n_colors
        shape = (height, row_bytes // 4)
        rows = np.memmap(self.picture_file, dtype="<u4", mode="r", offset=start, shape=shape)
        return rows[::PIXEL_STEP, :width:PIXEL_STEP] & 0xFFFFFF

    def press(self, key: str) -> None:
        """Press a key."""
        environment = {**os.environ, "DISPLAY": self.name}
        subprocess.run(["xdotool", "key", key], env=environment, check=True)


@contextmanager
def open_screen() -> Iterator[Screen]:
    """Start an X server without a monitor until the context ends."""
    width, height = SIZE_PX
    read_end, write_end = os.pipe()
    with TemporaryDirectory() as folder:
        command = ["Xvfb", "-displayfd", str(write_end), "-screen", "0", f"{width}x{height}x24"]
        server = subprocess.Popen(
            [*command, "-fbdir", folder, "-nolisten", "tcp", "-noreset"],
            pass_fds=(write_end,),
            stderr=subprocess.DEVNULL,
        )
        os.close(write_end)
        try:
            with os.fdopen(read_end) as pipe:
                number = pipe.readline().strip()
            yield Screen(f":{number}", Path(folder) / "Xvfb_screen0")
        finally:
            server.terminate()
            server.wait()


def wait_until(condition: Callable[[], object], interval_s: float = POLL_INTERVAL_S) -> float:
    """Wait until a condition is true, and return the time that it took, s."""
    start_time = time.monotonic()
    while not condition():
        if time.monotonic() - start_time > MAX_WAIT_S:
            raise TimeoutError(f"nothing happened within {MAX_WAIT_S:g} s")
        time.sleep(interval_s)
    return time.monotonic() - start_time


def describe(times_s: Sequence[float]) -> str:
    """Return a summary of response times."""
    ordered = sorted(times_s)
    return (
        f"{len(ordered)} answers: median {1000 * median(ordered):.0f} ms, "
        f"95% within {1000 * ordered[int(0.95 * len(ordered))]:.0f} ms, longest {ordered[-1]:.2f} s"
    )


def build_environment(cache: Path) -> dict[str, str]:
    """Return the environment variables of a user with a cache folder, and without settings and drafts."""
    return {
        "ROBOCOV_CACHE": str(cache),
        "NUMBA_CACHE_DIR": str(cache / "kernels"),
        "ROBOCOV_SETTINGS": "",
        DRAFT_FOLDER_VARIABLE: "",
    }


# On the screen


@contextmanager
def open_window(
    screen: Screen, command: Sequence[str], environment: dict[str, str]
) -> Iterator[subprocess.Popen[bytes]]:
    """Run a command that opens a window until the context ends."""
    variables = {**os.environ, **environment, "DISPLAY": screen.name, "SDL_VIDEODRIVER": "x11"}
    variables.pop("WAYLAND_DISPLAY", None)
    process = subprocess.Popen(
        [sys.executable, "-m", "robocov_app", *command], env=variables, stderr=subprocess.DEVNULL
    )
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def has_picture(screen: Screen) -> bool:
    """Return whether the screen shows more than an empty window."""
    return len(np.unique(screen.read())) >= MIN_COLORS


def read_processor_time(pid: int) -> float:
    """Return the processor time that a process has used, s, which other programs hardly change."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def focus_window(screen: Screen, process: subprocess.Popen[bytes]) -> None:
    """Give the keyboard to the window of a process, as a window manager would."""
    search = ["search", "--sync", "--onlyvisible", "--pid", str(process.pid), "windowfocus"]
    environment = {**os.environ, "DISPLAY": screen.name}
    subprocess.run(["xdotool", *search], env=environment, check=True, stdout=subprocess.DEVNULL)


def is_dark(screen: Screen) -> bool:
    """Return whether most of the screen is dark."""
    green = (screen.read() >> 8) & 0xFF
    return float(np.mean(green)) < 128.0


def has_switched_theme(screen: Screen, *, was_dark: bool) -> bool:
    """Return whether a screen that was dark is now bright, or the other way round."""
    return is_dark(screen) != was_dark


def measure_responses(screen: Screen, duration_s: float) -> list[float]:
    """Press the key again and again for a time, s; return the response times, s."""
    times: list[float] = []
    end_time = time.monotonic() + duration_s
    while time.monotonic() < end_time:
        was_dark = is_dark(screen)
        start_time = time.monotonic()
        screen.press(THEME_KEY)
        wait_until(partial(has_switched_theme, screen, was_dark=was_dark))
        times.append(time.monotonic() - start_time)
        time.sleep(KEY_INTERVAL_S)
    return times


def measure_window(command: Sequence[str], environment: dict[str, str], duration_s: float) -> str:
    """Open a window on an invisible screen, and return how soon it is visible and how fast it answers."""
    with open_screen() as screen:
        start_time = time.monotonic()
        with open_window(screen, command, environment) as process:
            wait_until(lambda: has_picture(screen))
            visible_s = time.monotonic() - start_time
            processor_s = read_processor_time(process.pid)
            focus_window(screen, process)
            times = measure_responses(screen, duration_s)
    return f"visible after {visible_s:.2f} s ({processor_s:.2f} s of processor time); {describe(times)}"


def measure_card(environment: dict[str, str], duration_s: float) -> str:
    """Open the start page and press its first card at once; return when its map is visible and answers."""
    with open_screen() as screen, open_window(screen, ["demo"], environment) as process:
        wait_until(lambda: has_picture(screen))
        focus_window(screen, process)
        page = screen.read()
        start_time = time.monotonic()
        screen.press(FIRST_CARD_KEY)
        wait_until(lambda: not np.array_equal(screen.read(), page))
        reaction_s = time.monotonic() - start_time
        # The map has other colors than the page at nearly all pixels of the tool rail.
        wait_until(lambda: np.mean(screen.read()[:, :5] != page[:, :5]) > 0.5)
        map_s = time.monotonic() - start_time
        times = measure_responses(screen, duration_s)
    return f"reacts after {reaction_s:.2f} s, shows the map after {map_s:.2f} s; {describe(times)}"


# In a browser


def measure_page(
    browser: Browser, command: Sequence[str], environment: dict[str, str], duration_s: float
) -> str:
    """Open a served window in a browser, and return how soon it is visible and how fast it answers."""
    with TemporaryDirectory() as folder:
        start_time = time.monotonic()
        options = ["--folder", folder]
        with serve_window(*command, *options, environment=environment) as link:
            link_s = time.monotonic() - start_time
            browser.driver.get(link)
            is_blank = "return document.body.classList.contains('blank')"
            wait_until(lambda: not browser.run_script(is_blank))
            visible_s = time.monotonic() - start_time
            processor_s = read_processor_time(link.process.pid)
            times = browser.driver.execute_async_script(
                MEASURE_RESPONSES, duration_s, KEY_INTERVAL_S, THEME_KEY
            )
            browser.driver.get("about:blank")
    return (
        f"link after {link_s:.2f} s, visible after {visible_s:.2f} s "
        f"({processor_s:.2f} s of processor time); {describe(times)}"
    )


def run_all(browser: Browser, cache: Path, duration_s: float) -> None:
    """Measure all windows. Each has a cache of its own: first empty, then warm."""
    for state in ("empty", "warm"):
        for command in WINDOW_COMMANDS:
            environment = build_environment(cache / "-".join(command))
            result = measure_window(command, environment, duration_s)
            print(f"{state} cache, window of robocov {' '.join(command)}: {result}", flush=True)
        environment = build_environment(cache / "card")
        result = measure_card(environment, duration_s)
        print(f"{state} cache, first card of the start page: {result}", flush=True)
        for command in SERVED_COMMANDS:
            environment = build_environment(cache / f"served-{'-'.join(command)}")
            result = measure_page(browser, command, environment, duration_s)
            print(f"{state} cache, page of robocov {' '.join(command)}: {result}", flush=True)


def main() -> None:
    """Open all windows, and print the measurements."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--seconds",
        type=float,
        default=60.0,
        help="time for which each window is used (default: %(default)s)",
    )
    arguments = parser.parse_args()
    with TemporaryDirectory() as folder:
        browser = Browser(Path(folder) / "profile")
        try:
            browser.resize(*SIZE_PX)
            browser.driver.set_script_timeout(arguments.seconds + MAX_WAIT_S)
            run_all(browser, Path(folder) / "caches", arguments.seconds)
        finally:
            browser.driver.quit()
    loads = ", ".join(f"{load:.1f}" for load in os.getloadavg())
    print(f"system load in the last 1, 5 and 15 minutes: {loads}")


if __name__ == "__main__":
    main()
