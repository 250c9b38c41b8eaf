"""Pictures a second, and the time from a drag to its picture, of a served window in a real browser.

    python tests/bench/serve_window.py [--robots 50] [--size 1280x720] [--shots FOLDER]

All is measured in the page: when a pointer event is made there, and when the next picture is on its canvas.
"""

import argparse
import sys
import time
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

sys.path.insert(0, str(Path(__file__).parents[1] / "robocov_app"))

from driven_browser import Browser
from served_window import served

WATCH = """
window.drawn = [];
const put = CanvasRenderingContext2D.prototype.putImageData;
CanvasRenderingContext2D.prototype.putImageData = function (...all) {
  put.apply(this, all); window.drawn.push(performance.now());
};
"""
DRAG = """
const done = arguments[0], canvas = document.querySelector('canvas'), waits = [];
const pointer = (kind, x, y, buttons) => canvas.dispatchEvent(new PointerEvent(kind, {
  clientX: x, clientY: y, buttons, button: kind === 'pointermove' ? -1 : 0, pointerId: 1, bubbles: true}));
canvas.setPointerCapture = () => {};
(async () => {
  pointer('pointerdown', 30, 300, 1);
  for (let k = 0; k < 60; k++) {
    let seen = -1;  // until no picture of the drag before is on its way
    while (seen !== window.drawn.length) {
      seen = window.drawn.length;
      await new Promise((then) => setTimeout(then, 150 + 20 * Math.random()));
    }
    const before = window.drawn.length, began = performance.now();
    pointer('pointermove', 30 + k * 3, 300, 1);
    for (let n = 0; n < 400 && window.drawn.length === before; n++) {
      await new Promise((then) => setTimeout(then, 1));
    }
    if (window.drawn.length > before) waits.push(window.drawn[before] - began);
  }
  pointer('pointerup', 200, 300, 0);
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
    more = ["rooms", "--robots", options.robots, "--start", "uniform"]
    with TemporaryDirectory() as folder, served("demo", *more, "--folder", folder) as link:
        browser = Browser(Path(folder) / "profile")
        try:
            size = {
                "width": width,
                "height": height,
                "deviceScaleFactor": options.ratio,
                "mobile": width < 500,
            }
            browser.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
            browser.driver.get(link)
            browser.until(lambda: browser.js("return canvas.width") == round(width * options.ratio))
            browser.js(WATCH)
            time.sleep(2.0)
            begun = browser.js("window.drawn = []; return performance.now()")
            time.sleep(6.0)
            drawn, ended = browser.js("return [window.drawn.length, performance.now()]")
            print(f"{drawn / (ended - begun) * 1e3:.1f} pictures a second")
            if options.shots:
                browser.driver.save_screenshot(str(Path(options.shots) / f"serve-{width}.png"))
            browser.keys(" ")
            time.sleep(2.5)
            still = browser.js("window.drawn = []; return 0")
            time.sleep(2.0)
            still = browser.js("return window.drawn.length")
            browser.driver.set_script_timeout(60)
            waits = sorted(browser.driver.execute_async_script(DRAG))
            print("each drag:", *(round(each) for each in waits), "ms")
            print(f"{still} pictures in 2 s while nothing changes")
            print(
                f"from a drag to its picture: median {median(waits):.0f} ms, "
                f"95 % within {waits[int(0.95 * len(waits))]:.0f} ms, {len(waits)} drags"
            )
            for line in browser.complaints():
                print(line)
        finally:
            browser.driver.quit()


if __name__ == "__main__":
    main()
