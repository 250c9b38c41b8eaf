"""Reference images of windows. ``python tests/robocov_app/golden_windows.py`` renders them again."""

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
from PIL import Image

from robocov.mapfile import load_map

FOLDER = Path(__file__).parents[1] / "golden"
SIZE = (900, 600)
FPS = 30
MIN_VISIBLE_DIFFERENCE = 60


def show_comparison(window) -> None:
    window.viewer.comparison.add_pane("rpf")
    play_frames(window, 40)


def inspect_robot(window) -> None:
    window.viewer.inspection.selected = 2
    window.panel.show_tab("robot")
    window.run_command("layer:force_attraction")
    window.run_command("layer:distances")
    play_frames(window, 40)


def show_past(window) -> None:
    play_frames(window, 30)
    window.viewer.attempt(lambda: window.viewer.session.fail_robot(3))
    play_frames(window, 30)
    window.run_command("back:second")
    window.panel.show_tab("show")
    play_frames(window, 1)


def show_help(window) -> None:
    window.run_command("help")
    play_frames(window, 1)


def show_tour(window) -> None:
    window.run_command("tour")
    play_frames(window, 40)


SCENES: dict[str, tuple[str, Callable[[object], None]]] = {
    "comparison-light": ("light", show_comparison),
    "robot-dark": ("dark", inspect_robot),
    "past-light": ("light", show_past),
    "help-dark": ("dark", show_help),
    "tour-light": ("light", show_tour),
}


def play_frames(window, count: int) -> None:
    for _ in range(count):
        window.run_frame(1.0 / FPS)


def draw_scene(name: str, modify: Callable[[object], None] = lambda window: None) -> np.ndarray:
    """Return the pixels of a scene, (height, width, 3), whose window is modified before it is played."""
    from robocov_app.viewer.launch import ViewerLauncher
    from robocov_app.viewer.session.session import Session
    from robocov_app.viewer.session.setup.scenario import SessionScenario
    from robocov_app.viewer.window.screen_video import copy_pixels

    theme, play = SCENES[name]
    session = Session(SessionScenario(load_map("rooms"), robots=4))
    launcher = ViewerLauncher(
        session, "rooms", Path(), theme=theme, size=SIZE, scale=1.0, headless=True, lattice=32
    )
    with launcher.window() as window:
        modify(window)
        play(window)
        return copy_pixels(window.screen).copy()


def read_golden(name: str) -> np.ndarray:
    """Return the pixels of the reference image of a scene, (height, width, 3)."""
    return np.asarray(Image.open(FOLDER / f"{name}.png").convert("RGB"))


def compute_difference(first: np.ndarray, second: np.ndarray) -> float:
    """Return the fraction of pixels with a clearly visible difference."""
    differences = np.abs(first.astype(int) - second.astype(int)).max(axis=2)
    return float((differences > MIN_VISIBLE_DIFFERENCE).mean())


if __name__ == "__main__":
    os.environ["ROBOCOV_SETTINGS"] = ""
    FOLDER.mkdir(exist_ok=True)
    for scene in SCENES:
        Image.fromarray(draw_scene(scene)).save(FOLDER / f"{scene}.png", optimize=True)
        print(scene)
