"""Measure how fast a served window is in a browser.

    python tests/bench/serve_window.py --robots 50 --size 1280x720

The script prints the time until the first frame, the frame rate, and the response time of drags. A drag pans
the map, so that all of it is redrawn. Its response time is from the pointer event until the canvas shows the
map at its new position. All but the first time is measured in the page.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

sys.path.insert(0, str(Path(__file__).parents[1] / "robocov_app"))

from driven_browser import Browser
from served_window import serve_window

MAX_SCRIPT_S = 120.0
WARM_UP_S = 2.0
FRAME_RATE_S = 6.0
"""Time over which frames are counted."""
PAUSE_S = 2.5
"""Time after a pause until the window is quiet."""
IDLE_S = 2.0
"""Time over which messages of a paused window are counted."""

COUNT_FRAMES_AND_MESSAGES = """
window.frames = 0;
window.messages = 0;
const putImageData = CanvasRenderingContext2D.prototype.putImageData;
CanvasRenderingContext2D.prototype.putImageData = function (...all) {
  putImageData.apply(this, all);
  window.frames++;
};
socket.addEventListener('message', () => window.messages++);
"""
"""JavaScript that counts the frames that are drawn and the messages that arrive."""

MEASURE_DRAGS = """
const drags = arguments[0];
const done = arguments[1];
const timeout = 2000;
const x = 80;  // right of the tools, and left of the map
const y = 300;
const times = [];
const pause = (duration) => new Promise((then) => setTimeout(then, duration));
const post = (type, dx, buttons) => canvas.dispatchEvent(new PointerEvent(type, {
  clientX: x + dx, clientY: y, pointerId: 1, bubbles: true,
  buttons, button: type === 'pointermove' ? -1 : 0}));
canvas.setPointerCapture = () => {};
const findWall = () => {  // left wall of the map in the row of the drag
  const row = context.getImageData(0, Math.round(y * devicePixelRatio), canvas.width, 1).data;
  const first = Math.round(x * devicePixelRatio);
  for (let column = first; column < canvas.width; column++) if (row[4 * column] < 110) return column;
};
(async () => {
  post('pointerdown', 0, 1);
  for (let k = 1; k <= drags; k++) {
    await pause(150 + 20 * Math.random());
    const wall = findWall();
    const start = performance.now();
    post('pointermove', k % 2 ? 6 : 0, 1);
    while (findWall() === wall && performance.now() - start < timeout) {
      const frames = window.frames;
      while (window.frames === frames && performance.now() - start < timeout) await pause(1);
    }
    times.push(performance.now() - start);
  }
  post('pointerup', 0, 0);
  done(times);
})();
"""
"""JavaScript that drags the map to and fro, and returns the response times, ms."""


def measure_first_frame(browser: Browser, link: str, canvas_width: int, start_time: float) -> None:
    """Open a window in the browser, and print when it shows its first frame."""
    browser.driver.get(link)
    browser.wait_until(lambda: browser.run_script("return canvas.width") == canvas_width)
    print(f"{time.monotonic() - start_time:.1f} s from the command to the first frame")


def measure_frame_rate(browser: Browser) -> None:
    """Print how many frames per second the page draws."""
    time.sleep(WARM_UP_S)
    start_ms = browser.run_script("window.frames = 0; return performance.now()")
    time.sleep(FRAME_RATE_S)
    frames, end_ms = browser.run_script("return [window.frames, performance.now()]")
    print(f"{1000.0 * frames / (end_ms - start_ms):.1f} frames per second")


def measure_idle_messages(browser: Browser) -> None:
    """Pause the window, and print how many messages it sends while nothing changes."""
    browser.press_keys(" ")
    time.sleep(PAUSE_S)
    browser.run_script("window.messages = 0")
    time.sleep(IDLE_S)
    print(f"{browser.run_script('return window.messages')} messages in {IDLE_S:g} s while paused")


def measure_drags(browser: Browser, drags: int, state: str) -> None:
    """Print the response times of drags."""
    times_ms = sorted(browser.driver.execute_async_script(MEASURE_DRAGS, drags))
    print(
        f"response to a drag while {state}: median {median(times_ms):.0f} ms, "
        f"95% within {times_ms[int(0.95 * len(times_ms))]:.0f} ms, {len(times_ms)} drags"
    )


def parse_arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--robots", type=int, default=50, help="number of robots (default: %(default)s)")
    parser.add_argument("--size", default="1280x720", help="size of the page, CSS px (default: %(default)s)")
    parser.add_argument(
        "--ratio", type=float, default=1.0, help="device pixels per CSS pixel (default: %(default)s)"
    )
    parser.add_argument("--drags", type=int, default=60, help="number of drags (default: %(default)s)")
    parser.add_argument("--screenshots", type=Path, metavar="FOLDER", help="also save a screenshot here")
    return parser.parse_args()


def main() -> None:
    """Serve a window, open it in a browser, and print the measurements."""
    arguments = parse_arguments()
    width, height = map(int, arguments.size.split("x"))
    with TemporaryDirectory() as folder:
        browser = Browser(Path(folder) / "profile")
        try:
            browser.resize(width, height, arguments.ratio)
            browser.driver.set_script_timeout(MAX_SCRIPT_S)
            start_time = time.monotonic()
            options = ["--robots", str(arguments.robots), "--start", "uniform", "--folder", folder]
            with serve_window("demo", "rooms", *options) as link:
                measure_first_frame(browser, link, round(width * arguments.ratio), start_time)
                browser.run_script(COUNT_FRAMES_AND_MESSAGES)
                measure_frame_rate(browser)
                if arguments.screenshots is not None:
                    browser.driver.save_screenshot(str(arguments.screenshots / f"serve-{width}.png"))
                measure_drags(browser, arguments.drags, "running")
                measure_idle_messages(browser)
                measure_drags(browser, arguments.drags, "paused")
                for message in browser.read_console():
                    print(message)
            loads = ", ".join(f"{load:.1f}" for load in os.getloadavg())
            print(f"system load in the last 1, 5 and 15 minutes: {loads}")
        finally:
            browser.driver.quit()


if __name__ == "__main__":
    main()
