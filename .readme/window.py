"""Draws window.png and window-dark.png, the pictures of `robocov demo` in the README."""

from __future__ import annotations

from pathlib import Path

from PIL import Image

from robocov.mapfile import load_map
from robocov_app.demo.film import pixels
from robocov_app.demo.opening import HEADLESS_FPS, Opening
from robocov_app.demo.scenario import Law, Scenario
from robocov_app.demo.session import Session

HERE = Path(__file__).parent


def main() -> None:
    """Use the window for a while, and keep what it shows."""
    for theme, name in (("light", "window.png"), ("dark", "window-dark.png")):
        laws = (Law("rapf"), Law("lloyd"))
        session = Session(Scenario(load_map("rooms"), laws, start="kitchen"))
        session.clock.speed = 2.0
        also = frozenset({"force_attraction", "force_repulsion_obstacle", "force_repulsion_robots"})
        opening = Opening(session, "rooms", HERE, theme=theme, size=(1280, 720), also=also, headless=True)
        with opening.window() as window:
            desk = window.desk
            for frame in range(12 * HEADLESS_FPS):
                if frame == 6 * HEADLESS_FPS:
                    session.fail_robot(5)
                window.frame(1.0 / HEADLESS_FPS)
            desk.active, desk.hand.selected = 1, 4
            window.panel.show_tab("robot")
            for _ in range(8):
                window.frame(0.0)
            desk.pass_time(60.0)
            window.frame(0.0)
            picture = Image.fromarray(pixels(window.screen)).quantize(256, dither=Image.Dither.NONE)
            picture.save(HERE / name, optimize=True)


if __name__ == "__main__":
    main()
