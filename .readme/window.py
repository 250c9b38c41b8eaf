"""Draw the screenshots of windows in README and handbook; with --video, record the tour as well."""

from __future__ import annotations

import itertools
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import imageio_ffmpeg
import pygame
from PIL import Image, ImageDraw
from small_images import reduce_colors

from robocov.mapfile import find_map_file, load_map
from robocov_app.editor.edits.create import add_rectangle
from robocov_app.editor.ui.importing.dialog import SET_COLOR, ImportDialog
from robocov_app.editor.ui.launch import EditorLauncher
from robocov_app.viewer.launch import HEADLESS_FPS, ViewerLauncher
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice
from robocov_app.viewer.session.setup.scenario import SessionScenario
from robocov_app.viewer.window.screen_video import copy_pixels

if TYPE_CHECKING:
    from robocov_app.editor.ui.window import EditorWindow
    from robocov_app.viewer.start.page import ThemeName
    from robocov_app.viewer.window.window import ViewerWindow

HERE = Path(__file__).parent
PICTURES = HERE.parent / "app/handbook/pictures"
SIZE = (1280, 720)
DIALOG_SIZE = (900, 600)
METERS_PER_PIXEL = 0.025
"""Scale of the floor plan in the import dialog."""
BLUE = (74, 111, 165)


def draw_window(theme: ThemeName, name: str) -> None:
    """Run the viewer for 12 s, with a robot failing after 6 s, and save a screenshot."""
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
        viewer.pass_time(60.0)  # Let earlier messages disappear.
        for _ in range(8):
            window.run_frame(0.0)
        save_screenshot(window, PICTURES / name)


def draw_editor(theme: ThemeName, name: str) -> None:
    """Add a showcase to a museum, drag it until it is aligned with the others, and save a screenshot."""
    path = find_map_file("museum")
    launcher = EditorLauncher(path, HERE, theme=theme, size=SIZE, headless=True)
    with launcher.window() as window:
        editor = window.editor
        editor.apply(add_rectangle(editor.sketch, [(15.6, 7.0), (17.9, 7.6)]))
        window.panel.show_tab("object")
        window.run_frame(0.5)
        path_m = [(16.6, 7.3), (16.8, 7.0), (17.8, 5.0), (18.03, 4.33)]
        points = [tuple(map(round, window.canvas.to_pixel(point))) for point in path_m]
        pygame.event.post(pygame.Event(pygame.MOUSEBUTTONDOWN, pos=points[0], button=1))
        for before, point in itertools.pairwise(points):
            rel = (point[0] - before[0], point[1] - before[1])
            pygame.event.post(pygame.Event(pygame.MOUSEMOTION, pos=point, rel=rel, buttons=(1, 0, 0)))
            window.run_frame(0.1)
        for _ in range(8):
            window.run_frame(0.1)
        save_screenshot(window, PICTURES / name)


def draw_floor_plan(path: Path) -> None:
    """Draw a floor plan of three rooms with furniture, labels, a door and a dimension line."""
    image = Image.new("RGB", (520, 360), "white")
    draw = ImageDraw.Draw(image)
    draw.rectangle((70, 50, 258, 170), fill="#faefd5")
    draw.rectangle((70, 182, 258, 284), fill=BLUE)
    draw.rectangle((266, 50, 452, 284), fill="#e4f0dc")
    # Walls, and the door between the upper and the lower room.
    draw.rectangle((66, 46, 456, 288), outline="#202428", width=8)
    draw.rectangle((258, 46, 266, 288), fill="#202428")
    draw.rectangle((66, 174, 262, 182), fill="#202428")
    draw.rectangle((124, 174, 154, 182), fill="#faefd5")
    draw.rectangle((258, 90, 266, 122), fill="#e4f0dc")
    draw.arc((234, 58, 298, 122), 0, 90, fill="#8090a0", width=1)
    draw.rectangle((350, 132, 408, 180), fill="#8b5a2b")
    draw.ellipse((300, 200, 342, 242), fill="#8b5a2b")
    draw.text((128, 100), "Kitchen", fill="#303840", font_size=15)
    draw.text((318, 88), "Hall", fill="#303840", font_size=15)
    draw.line((66, 316, 456, 316), fill="red")
    draw.line((66, 308, 66, 324), fill="red")
    draw.line((456, 308, 456, 324), fill="red")
    draw.text((238, 322), "9.75 m", fill="red", font_size=15)
    image.save(path)


def draw_import_dialog(theme: ThemeName, name: str) -> None:
    """Open the import dialog for a floor plan, mark the color of a room as free, and save a screenshot."""
    with TemporaryDirectory() as folder:
        plan = Path(folder) / "flat.png"
        draw_floor_plan(plan)
        launcher = EditorLauncher(plan, Path(folder), theme=theme, size=DIALOG_SIZE, headless=True)
        with launcher.window() as window:
            window.run_frame(0.1)
            dialog = window.editor.dialogs.current
            assert isinstance(dialog, ImportDialog)
            dialog.click_action = SET_COLOR
            # Type the size of a pixel, whose field has the focus.
            pygame.event.post(pygame.Event(pygame.TEXTINPUT, text=f"{METERS_PER_PIXEL:g}"))
            window.run_frame(0.1)
            dialog.form.set_text("min_stroke", "0.1")
            dialog.form.cycle_color(BLUE)
            for _ in range(8):
                window.run_frame(0.1)
            save_screenshot(window, PICTURES / name)


def save_screenshot(window: ViewerWindow | EditorWindow, file: Path) -> None:
    """Save a screenshot of a window as a small file."""
    reduce_colors(copy_pixels(window.screen)).save(file, optimize=True)


def record_tour(name: str) -> None:
    """Record a video of the tour, with every second frame, as a small MP4 file."""
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
        window.run_command("tour")
        assert window.lesson.player is not None
        for frame in range(round(window.lesson.player.duration * HEADLESS_FPS)):
            if window.lesson.player is None:
                break
            window.run_frame(1.0 / HEADLESS_FPS)
            if frame % 2 == 0:
                encoder.stdin.write(copy_pixels(window.screen).tobytes())


if __name__ == "__main__":
    suffixes: dict[ThemeName, str] = {"light": "", "dark": "-dark"}
    for window_theme, suffix in suffixes.items():
        draw_window(window_theme, f"window{suffix}.png")
        draw_editor(window_theme, f"editor{suffix}.png")
        draw_import_dialog(window_theme, f"import{suffix}.png")
    if "--video" in sys.argv[1:]:
        record_tour("tour.mp4")
