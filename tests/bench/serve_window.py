"""First picture, pictures a second, and the time from a drag to its picture, of a window in a real browser.

    python tests/bench/serve_window.py [--robots 50] [--size 1280x720] [--ratio 1] [--shots FOLDER]

All but the first is measured in the page. A drag pans the map, which draws all of it anew: the time is from
when the pointer event is made to when the picture with the map at its new place is on the canvas.
"""

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

WATCH = """
window.drawn = 0; window.came = 0;
const put = CanvasRenderingContext2D.prototype.putImageData;
CanvasRenderingContext2D.prototype.putImageData = function (...all) { put.apply(this, all); window.drawn++; };
socket.addEventListener('message', () => window.came++);
"""
DRAG = """
const done = arguments[0], waits = [], pause = (time) => new Promise((then) => setTimeout(then, time));
const pointer = (kind, x, buttons) => canvas.dispatchEvent(new PointerEvent(kind, {
  clientX: x, clientY: 300, buttons, button: kind === 'pointermove' ? -1 : 0, pointerId: 1, bubbles: true}));
canvas.setPointerCapture = () => {};
const wall = () => {  // the map's left wall in the row where the drag is
  const row = context.getImageData(0, Math.round(300 * devicePixelRatio), canvas.width, 1).data;
  for (let x = 0; x < canvas.width; x++) if (row[4 * x] < 110) return x;
};
(async () => {
  pointer('pointerdown', 10, 1);
  for (let k = 1; k <= 60; k++) {
    await pause(150 + 20 * Math.random());
    const at = wall(), began = performance.now();
    pointer('pointermove', 10 + (k % 2 ? 6 : 0), 1);
    while (wall() === at && performance.now() - began < 2000) {
      const seen = window.drawn;
      while (window.drawn === seen && performance.now() - began < 2000) await pause(1);
    }
    waits.push(performance.now() - began);
  }
  pointer('pointerup', 10, 0);
  done(waits);
})();
"""


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--robots", default="50")
    parser.add_argument("--size", default="1280x720")
    parser.add_argument("--ratio", type=float, default=1.0)
    parser.add_argument("--shots")
    options = parser.parse_args()
    width, height = map(int, options.size.split("x"))
    with TemporaryDirectory() as folder:
        browser = Browser(Path(folder) / "profile")
        try:
            size = {"width": width, "height": height, "deviceScaleFactor": options.ratio}
            size["mobile"] = width < 500
            browser.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
            browser.driver.set_script_timeout(120)
            begun = time.monotonic()
            more = "--robots", options.robots, "--start", "uniform", "--folder", folder
            with serve_window("demo", "rooms", *more) as link:
                browser.driver.get(link)
                browser.until(lambda: browser.js("return canvas.width") == round(width * options.ratio))
                print(f"{time.monotonic() - begun:.1f} s from the command to its first picture")
                measure(browser, options.shots and Path(options.shots) / f"serve-{width}.png")
            print("load", *(f"{each:.1f}" for each in os.getloadavg()))
        finally:
            browser.driver.quit()


def measure(browser: Browser, shot: Path | None) -> None:
    browser.js(WATCH)
    time.sleep(2.0)
    begun = browser.js("window.drawn = 0; return performance.now()")
    time.sleep(6.0)
    drawn, ended = browser.js("return [window.drawn, performance.now()]")
    print(f"{drawn / (ended - begun) * 1e3:.1f} pictures a second")
    if shot:
        browser.driver.save_screenshot(str(shot))
    for state in ("moving", "paused"):
        if state == "paused":
            browser.keys(" ")
            time.sleep(2.5)
            browser.js("window.came = 0")
            time.sleep(2.0)
            print(f"{browser.js('return window.came')} messages in 2 s while nothing changes")
        waits = sorted(browser.driver.execute_async_script(DRAG))
        print(
            f"from a drag to its picture, {state}: median {median(waits):.0f} ms, "
            f"95 % within {waits[int(0.95 * len(waits))]:.0f} ms, {len(waits)} drags"
        )
    for line in browser.complaints():
        print(line)


if __name__ == "__main__":
    main()
