"""A real browser without a display, and hands for it."""

import json
import shutil
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
DRIVER = shutil.which("chromedriver")
PATIENCE = 20.0


class Browser:
    """A browser on one page, without network."""

    def __init__(self, profile: Path) -> None:
        from selenium import webdriver
        from selenium.webdriver.chrome.options import Options
        from selenium.webdriver.chrome.service import Service

        options = Options()
        for word in (
            *("headless=new", "no-sandbox", "disable-gpu", "disable-quic", "no-first-run", "hide-scrollbars"),
            *("disable-background-networking", "disable-component-update", "disable-sync"),
            f"user-data-dir={profile}",
        ):
            options.add_argument(f"--{word}")
        options.binary_location = CHROMIUM or ""
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        self.driver = webdriver.Chrome(service=Service(executable_path=DRIVER), options=options)

    def open(self, path: Path, width: int = 1280, height: int = 900, **media: str) -> None:
        phone = width < 500
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": phone}
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        self.prefer(**media)
        self.driver.get(path.as_uri())
        # what is to be clicked must not move meanwhile
        self.js("document.documentElement.style.scrollBehavior = 'auto'")

    def prefer(self, medium: str = "", **media: str) -> None:
        """Say what the reader prefers, as in color_scheme="dark"."""
        features = [
            {"name": f"prefers-{name.replace('_', '-')}", "value": value} for name, value in media.items()
        ]
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": medium, "features": features})

    def js(self, script: str, *values: object) -> Any:
        return self.driver.execute_script(script, *values)

    def find(self, selector: str) -> Any:
        return self.driver.find_element("css selector", selector)

    def all(self, selector: str) -> list[Any]:
        return self.driver.find_elements("css selector", selector)

    def keys(self, *keys: str) -> None:
        from selenium.webdriver import ActionChains

        ActionChains(self.driver).send_keys(*keys).perform()

    def until(self, condition: Callable[[], object]) -> None:
        end = time.monotonic() + PATIENCE
        while not condition():
            assert time.monotonic() < end, "nothing came of it"
            time.sleep(0.03)

    def complaints(self) -> list[str]:
        return [each["message"] for each in self.driver.get_log("browser")]

    def drawn(self) -> list[str]:
        """Return what is on every canvas of the replay: panes, then curves."""
        script = (
            "return [...document.querySelectorAll('.robocov-replay .pane > canvas, .robocov-replay .chart')]"
            ".map((canvas) => canvas.toDataURL())"
        )
        return self.js(script)

    def pixel(self, pane: int, x: float, y: float) -> tuple[int, int, int]:
        script = (
            "const canvas = document.querySelectorAll('.pane > canvas')[arguments[0]];"
            "return [...canvas.getContext('2d').getImageData(arguments[1], arguments[2], 1, 1).data]"
        )
        red, green, blue, _ = self.js(script, pane, round(x), round(y))
        return red, green, blue

    @property
    def time(self) -> float:
        return float(self.find(".transport input").get_property("value"))

    @property
    def playing(self) -> bool:
        return self.find(".main").text == "Pause"

    def seek(self, seconds: float) -> None:
        self.js(
            "const slider = document.querySelector('.transport input'); slider.value = arguments[0];"
            "slider.dispatchEvent(new Event('input', {bubbles: true}))",
            seconds,
        )

    def focus_is_in(self, selector: str) -> bool:
        return bool(self.js(f"return document.activeElement.matches({json.dumps(selector)})"))
