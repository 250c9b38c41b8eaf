"""Pictures to compare the window with: ``python tests/robocov_app/golden_windows.py`` draws them anew."""

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
from PIL import Image

from robocov.mapfile import load_map

FOLDER = Path(__file__).parents[1] / "golden"
SIZE = (900, 600)
FPS = 30


def compared(window) -> None:
    window.do("pane:add")
    played(window, 40)


def asked(window) -> None:
    window.viewer.inspection.selected = 2
    window.panel.show_tab("robot")
    window.do("layer:force_attraction")
    window.do("layer:distances")
    played(window, 40)


def past(window) -> None:
    played(window, 30)
    window.viewer.attempt(lambda: window.viewer.session.fail_robot(3))
    played(window, 30)
    window.do("back:second")
    window.panel.show_tab("show")
    played(window, 1)


def helped(window) -> None:
    window.do("help")
    played(window, 1)


def toured(window) -> None:
    window.do("tour")
    played(window, 40)


SCENES: dict[str, tuple[str, Callable[[object], None]]] = {
    "compared-light": ("light", compared),
    "asked-dark": ("dark", asked),
    "past-light": ("light", past),
    "helped-dark": ("dark", helped),
    "toured-light": ("light", toured),
}


def played(window, frames: int) -> None:
    for _ in range(frames):
        window.run_frame(1.0 / FPS)


def drawn(name: str, spoil: Callable[[object], None] = lambda window: None) -> np.ndarray:
    """Return the picture of a scene, after something was spoiled, for tests of the tolerance."""
    from robocov_app.viewer.launch import ViewerLauncher
    from robocov_app.viewer.session.scenario import SessionScenario
    from robocov_app.viewer.session.session import Session
    from robocov_app.viewer.window.screen_video import copy_pixels

    theme, play = SCENES[name]
    session = Session(SessionScenario(load_map("rooms"), robots=4))
    opening = ViewerLauncher(
        session, "rooms", Path(), theme=theme, size=SIZE, scale=1.0, headless=True, lattice=32
    )
    with opening.window() as window:
        spoil(window)
        play(window)
        return copy_pixels(window.screen).copy()


def golden(name: str) -> np.ndarray:
    return np.asarray(Image.open(FOLDER / f"{name}.png").convert("RGB"))


def difference(first: np.ndarray, second: np.ndarray) -> float:
    """Return the part of pixels that anyone would see to be different."""
    apart = np.abs(first.astype(int) - second.astype(int)).max(axis=2)
    return float((apart > 60).mean())


if __name__ == "__main__":
    os.environ["ROBOCOV_SETTINGS"] = ""
    FOLDER.mkdir(exist_ok=True)
    for scene in SCENES:
        Image.fromarray(drawn(scene)).save(FOLDER / f"{scene}.png", optimize=True)
        print(scene)
