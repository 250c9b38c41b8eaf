"""The first start, with an empty cache: windows are visible and answer before any kernel is compiled."""

from __future__ import annotations

import os
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest

from robocov_app.commands import demo
from robocov_app.commands.demo import Arguments
from robocov_app.viewer.start.launch import StartLauncher
from robocov_app.viewer.start.page import StartPage
from robocov_app.viewer.start.preparation import Preparation

OPEN_MAP = """
import sys
from pathlib import Path
import pygame
from robocov.compiled import interpret_kernels, list_compiled_kernels
from robocov.mapfile import load_map
from robocov_app.viewer.launch import ViewerLauncher
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.session.setup.scenario import SessionScenario

def main() -> None:
    # Kernels run as Python until another process has compiled them, which here never happens.
    interpret_kernels(lambda name, arguments: True)
    session = Session(SessionScenario(load_map("rooms")))
    folder = Path(sys.argv[1])
    launcher = ViewerLauncher(session, "rooms", folder, size=(900, 600), headless=True, lattice=8)
    with launcher.window() as window:
        print("colors", len(set(pygame.image.tobytes(window.screen, "RGB"))) > 20)
        session.playback.is_playing = True
        for _ in range(5):
            window.run_frame(1 / 30)
        print("moves", session.timeline.step > 0)
        key = {"key": pygame.K_SPACE, "mod": 0, "unicode": " ", "scancode": 0}
        pygame.event.post(pygame.event.Event(pygame.KEYDOWN, **key))
        window.run_frame(1 / 30)
        print("answers", not session.playback.is_playing)
        print("compiled", sorted(list_compiled_kernels()))

main()
"""


def test_a_map_is_shown_and_robots_move_before_any_kernel_is_compiled(tmp_path: Path) -> None:
    environment = {**os.environ, "ROBOCOV_CACHE": str(tmp_path / "cache"), "SDL_VIDEODRIVER": "dummy"}
    done = subprocess.run(
        [sys.executable, "-c", OPEN_MAP, str(tmp_path)],
        capture_output=True,
        text=True,
        check=True,
        env=environment,
    )
    assert done.stdout.splitlines()[-4:] == ["colors True", "moves True", "answers True", "compiled []"]


def test_another_process_compiles_from_before_a_map_is_opened(monkeypatch: pytest.MonkeyPatch) -> None:
    steps = []

    @contextmanager
    def compile_in_background():
        steps.append("compilation starts")
        yield
        steps.append("compilation ends")

    monkeypatch.setattr("robocov.kernel_compilation.compile_in_background", compile_in_background)
    monkeypatch.setattr(demo, "_build_launcher", lambda options: steps.append("map is loaded"))
    monkeypatch.setattr(demo, "_open_window", lambda launcher, options: steps.append("window is open"))
    demo.command(Arguments(map="rooms"))
    assert steps == ["compilation starts", "map is loaded", "window is open", "compilation ends"]


def test_the_start_page_is_visible_before_the_viewer_is_prepared(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setenv("DISPLAY", ":0")
    steps = []
    draw = StartPage.draw

    def draw_and_note(page: StartPage) -> None:
        draw(page)
        steps.append("drawn")

    monkeypatch.setattr(StartPage, "draw", draw_and_note)
    monkeypatch.setattr(StartPage, "run", lambda page: steps.append("answers"))
    monkeypatch.setattr(Preparation, "start", lambda preparation: steps.append("preparation starts"))
    with StartLauncher("light", (900, 600), 1.0, tmp_path) as start:
        assert start.choose() is None
    assert steps == ["drawn", "preparation starts", "answers"]


def test_the_start_page_reports_that_it_is_too_small_for_the_scale(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setenv("DISPLAY", ":0")
    messages = []
    monkeypatch.setattr(StartPage, "run", lambda page: messages.append(page.model.message))
    monkeypatch.setattr(Preparation, "start", lambda preparation: None)
    with StartLauncher("light", (1280, 720), 1.5, tmp_path) as start:
        start.choose()
    assert messages == ["Scale 1.5 needs a window of 1350 × 900; using 1.125"]
