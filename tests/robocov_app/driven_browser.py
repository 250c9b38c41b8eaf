"""A headless browser, and a driver that uses its page."""

import json
import shutil
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
DRIVER = shutil.which("chromedriver")
MAX_WAIT_S = 20.0
POLL_INTERVAL_S = 0.03
TOUCH_INTERVAL_S = 0.05
MAX_PHONE_WIDTH_PX = 500
ARGUMENTS = (
    "headless=new",
    "no-sandbox",
    "disable-gpu",
    "disable-quic",
    "no-first-run",
    "hide-scrollbars",
    "disable-background-networking",
    "disable-component-update",
    "disable-sync",
)


class Browser:
    """A browser with one page and without network access."""

    def __init__(self, profile: Path) -> None:
        from selenium import webdriver
        from selenium.webdriver.chrome.options import Options
        from selenium.webdriver.chrome.service import Service

        options = Options()
        for argument in (*ARGUMENTS, f"user-data-dir={profile}"):
            options.add_argument(f"--{argument}")
        options.binary_location = CHROMIUM or ""
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        self.driver = webdriver.Chrome(service=Service(executable_path=DRIVER), options=options)

    def resize(self, width: int, height: int, pixel_ratio: float = 1.0) -> None:
        """Set the size of the page, CSS px. Narrow pages are those of a phone."""
        metrics = {
            "width": width,
            "height": height,
            "deviceScaleFactor": pixel_ratio,
            "mobile": width < MAX_PHONE_WIDTH_PX,
        }
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)

    def open_file(self, path: Path, width: int = 1280, height: int = 900, **preferences: str) -> None:
        """Open a page from a file, with preferences as in `set_preferences`."""
        self.resize(width, height)
        self.set_preferences(**preferences)
        self.driver.get(path.as_uri())
        # Elements must not move while they are clicked.
        self.run_script("document.documentElement.style.scrollBehavior = 'auto'")

    def set_preferences(self, medium: str = "", **preferences: str) -> None:
        """Set the medium and the user's preferences, as in ``color_scheme="dark"``."""
        features = []
        for name, value in preferences.items():
            features.append({"name": f"prefers-{name.replace('_', '-')}", "value": value})
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": medium, "features": features})

    def set_touch(self, *, is_enabled: bool) -> None:
        """Emulate a touch screen, or stop emulating it."""
        touch: dict[str, object] = {"enabled": is_enabled}
        if is_enabled:
            touch["maxTouchPoints"] = 2
        self.driver.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", touch)

    @contextmanager
    def emulate_touch(self, *, is_enabled: bool = True) -> Iterator[None]:
        """Emulate a touch screen, if enabled, for the duration of a with block."""
        self.set_touch(is_enabled=is_enabled)
        try:
            yield
        finally:
            self.set_touch(is_enabled=False)

    def run_script(self, script: str, *values: object) -> Any:
        """Run JavaScript in the page, and return its result."""
        return self.driver.execute_script(script, *values)

    def find(self, selector: str) -> Any:
        """Return the first element that matches a CSS selector."""
        return self.driver.find_element("css selector", selector)

    def find_all(self, selector: str) -> list[Any]:
        """Return all elements that match a CSS selector."""
        return self.driver.find_elements("css selector", selector)

    def press_keys(self, *keys: str) -> None:
        """Press keys one after the other."""
        from selenium.webdriver import ActionChains

        ActionChains(self.driver).send_keys(*keys).perform()

    def drag(self, *points: tuple[float, float], modifiers: int = 0) -> None:
        """Drag with the left button through points; a single point is clicked."""
        event: dict[str, object] = {"button": "left", "clickCount": 1, "modifiers": modifiers}
        for number, (x, y) in enumerate(points):
            event |= {"type": "mouseMoved" if number else "mousePressed", "x": x, "y": y, "buttons": 1}
            self.driver.execute_cdp_cmd("Input.dispatchMouseEvent", event)
            time.sleep(POLL_INTERVAL_S)
        event |= {"type": "mouseReleased", "buttons": 0}
        self.driver.execute_cdp_cmd("Input.dispatchMouseEvent", event)

    def touch(self, *steps: Sequence[tuple[float, float]]) -> None:
        """Move fingers through steps, each of which has one point for each finger."""
        for number, points in enumerate(steps):
            touches = [{"x": x, "y": y, "id": finger} for finger, (x, y) in enumerate(points)]
            event = {"type": "touchMove" if number else "touchStart", "touchPoints": touches}
            self.driver.execute_cdp_cmd("Input.dispatchTouchEvent", event)
            time.sleep(TOUCH_INTERVAL_S)
        self.driver.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})

    def measure(self, selector: str) -> tuple[float, float, float, float]:
        """Return left, top, width and height of the first element that matches a selector, CSS px."""
        script = (
            "const box = document.querySelector(arguments[0]).getBoundingClientRect();"
            "return [box.left, box.top, box.width, box.height]"
        )
        left, top, width, height = self.run_script(script, selector)
        return left, top, width, height

    def wait_until(self, condition: Callable[[], object]) -> None:
        """Wait until a condition is true."""
        deadline = time.monotonic() + MAX_WAIT_S
        while not condition():
            assert time.monotonic() < deadline, f"the condition was not met within {MAX_WAIT_S:g} s"
            time.sleep(POLL_INTERVAL_S)

    def read_console(self) -> list[str]:
        """Return the new messages in the console, such as errors."""
        return [entry["message"] for entry in self.driver.get_log("browser")]

    # Replays

    def read_canvases(self) -> list[str]:
        """Return the image of each canvas of a replay: first panes, then charts."""
        script = (
            "return [...document.querySelectorAll('.robocov-replay .pane > canvas, .robocov-replay .chart')]"
            ".map((canvas) => canvas.toDataURL())"
        )
        return self.run_script(script)

    def read_pixel(self, pane: int, x: float, y: float) -> tuple[int, int, int]:
        """Return the color of a pixel of a pane."""
        script = (
            "const canvas = document.querySelectorAll('.pane > canvas')[arguments[0]];"
            "return [...canvas.getContext('2d').getImageData(arguments[1], arguments[2], 1, 1).data]"
        )
        red, green, blue, _ = self.run_script(script, pane, round(x), round(y))
        return red, green, blue

    @property
    def time(self) -> float:
        """Displayed time of a replay, s."""
        return float(self.find(".transport input").get_property("value"))

    @property
    def is_playing(self) -> bool:
        return self.find(".main").text == "Pause"

    def seek(self, seconds: float) -> None:
        """Move the slider of a replay to a time."""
        self.run_script(
            "const slider = document.querySelector('.transport input'); slider.value = arguments[0];"
            "slider.dispatchEvent(new Event('input', {bubbles: true}))",
            seconds,
        )

    def has_focus(self, selector: str) -> bool:
        """Return whether the focused element matches a CSS selector."""
        return bool(self.run_script(f"return document.activeElement.matches({json.dumps(selector)})"))
