"""Draws the windows that README and handbook show, window.png and editor.png in both themes, and tour.mp4."""

from __future__ import annotations

import itertools
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import imageio_ffmpeg
import pygame
from PIL import Image

from robocov.mapfile import find_map_file, load_map
from robocov_app.editor.edits.create import add_rectangle
from robocov_app.editor.ui.launch import EditorLauncher
from robocov_app.viewer.launch import HEADLESS_FPS, ViewerLauncher
from robocov_app.viewer.session.controller_choice import ControllerChoice
from robocov_app.viewer.session.scenario import SessionScenario
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.window.screen_video import copy_pixels

if TYPE_CHECKING:
    from robocov_app.editor.ui.window import EditorWindow
    from robocov_app.viewer.window.window import ViewerWindow

HERE = Path(__file__).parent
HANDBOOK = HERE.parent / "app/handbook/pictures"
SIZE = (1280, 720)


def picture(theme: str, name: str) -> None:
    """Use the window for a while, and keep what it shows."""
    session = Session(
        SessionScenario(
            load_map("rooms"), (ControllerChoice("rapf"), ControllerChoice("lloyd")), start="kitchen"
        )
    )
    session.playback.clock.speed = 2.0
    layers = frozenset({"force_attraction", "force_repulsion_obstacle", "force_repulsion_robots"})
    launcher = ViewerLauncher(
        session, "rooms", HERE, theme=theme, size=SIZE, shown_layers=layers, headless=True
    )
    with launcher.window() as window:
        for frame in range(12 * HEADLESS_FPS):
            if frame == 6 * HEADLESS_FPS:
                session.fail_robot(5)
            window.run_frame(1.0 / HEADLESS_FPS)
        viewer = window.viewer
        viewer.inspection.active_pane = 1
        viewer.inspection.selected = 4
        window.panel.show_tab("robot")
        viewer.pass_time(60.0)  # what was said is old
        for _ in range(8):
            window.run_frame(0.0)
        keep(window, HERE / name)


def editor(theme: str, name: str) -> None:
    """Draw a show-case into a museum, and drag it until it is in line with the others."""
    path = find_map_file("museum")
    launcher = EditorLauncher(path, HERE, theme=theme, size=SIZE, headless=True)
    with launcher.window() as window:
        editor = window.editor
        editor.apply(add_rectangle(editor.sketch, [(15.6, 7.0), (17.9, 7.6)]))
        window.panel.show_tab("object")
        window.run_frame(0.5)
        to = window.canvas.to_pixel
        hand = [(16.6, 7.3), (16.8, 7.0), (17.8, 5.0), (18.03, 4.33)]
        points = [tuple(map(round, to(point))) for point in hand]
        pygame.event.post(pygame.Event(pygame.MOUSEBUTTONDOWN, pos=points[0], button=1))
        for before, point in itertools.pairwise(points):
            rel = (point[0] - before[0], point[1] - before[1])
            pygame.event.post(pygame.Event(pygame.MOUSEMOTION, pos=point, rel=rel, buttons=(1, 0, 0)))
            window.run_frame(0.1)
        for _ in range(8):
            window.run_frame(0.1)
        keep(window, HANDBOOK / name)


def keep(window: ViewerWindow | EditorWindow, file: Path) -> None:
    """Save what a window shows, as small as it can be."""
    small = Image.fromarray(copy_pixels(window.screen)).quantize(256, dither=Image.Dither.NONE)
    small.save(file, optimize=True)


def film(name: str) -> None:
    """Film the tour, every second frame, as small as it can be read."""
    command = [
        *(imageio_ffmpeg.get_ffmpeg_exe(), "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24"),
        *("-s", f"{SIZE[0]}x{SIZE[1]}", "-r", f"{HEADLESS_FPS // 2}", "-i", "-", "-c:v", "libx264"),
        *("-preset", "veryslow", "-crf", "33", "-tune", "animation", "-pix_fmt", "yuv420p"),
        *("-movflags", "+faststart", str(HERE / name)),
    ]
    session = Session(SessionScenario(load_map("rooms")))
    launcher = ViewerLauncher(session, "rooms", HERE, theme="light", size=SIZE, headless=True)
    with launcher.window() as window, subprocess.Popen(command, stdin=subprocess.PIPE) as encoder:
        assert encoder.stdin is not None
        window.do("tour")
        assert window.lesson.player is not None
        for frame in range(round(window.lesson.player.duration * HEADLESS_FPS)):
            if window.lesson.player is None:
                break
            window.run_frame(1.0 / HEADLESS_FPS)
            if frame % 2 == 0:
                encoder.stdin.write(copy_pixels(window.screen).tobytes())


if __name__ == "__main__":
    picture("light", "window.png")
    picture("dark", "window-dark.png")
    editor("light", "editor.png")
    editor("dark", "editor-dark.png")
    if "--film" in sys.argv[1:]:
        film("tour.mp4")
