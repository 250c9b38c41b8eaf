"""The loop of a window: it draws while something moves, and otherwise only after changes."""

from __future__ import annotations

from pathlib import Path

import pygame
import pytest
from driven_window import open_viewer
from PIL import Image

from robocov_app.toolkit.window.display import open_display
from robocov_app.toolkit.window.window import IDLE_S, BaseWindow


class Counting(BaseWindow):
    """A window that counts its frames, and closes after some seconds."""

    def __init__(self) -> None:
        super().__init__((900, 600))
        self.drawn = 0
        self.frames = 0
        self.passed = 0.0
        self.shows = ""
        self.lasts = 1.5
        self.events: list[int] = []

    def handle_event(self, event: pygame.event.Event) -> None:
        self.events.append(event.type)

    def update(self, seconds: float) -> None:
        self.frames = self.frames + 1
        self.passed = self.passed + seconds
        self.closed = self.passed >= self.lasts

    def draw(self) -> None:
        self.drawn += 1

    def close(self) -> None:
        pass

    def build_frame_key(self) -> object:
        return None if self.shows == "moves" else self.shows


@pytest.fixture
def window():
    with open_display(headless=True):
        pygame.event.clear()
        yield Counting()


def rest_window(window: Counting) -> None:
    for _ in range(4):
        window.run_frame(IDLE_S / 2)
    window.drawn = 0


def test_a_window_rests_without_changes_and_wakes_up(window: Counting) -> None:
    window.lasts = 60.0
    rest_window(window)
    window.run_frame(0.1)
    assert window.is_idle
    assert window.drawn == 0
    window.shows = "something else"
    window.run_frame(0.1)
    window.run_frame(0.1)
    assert window.is_idle
    assert window.drawn == 1, "it is drawn once, and continues to rest"
    pygame.event.post(pygame.event.Event(pygame.MOUSEMOTION, pos=(1, 1), rel=(1, 1), buttons=(0, 0, 0)))
    window.run_frame(0.1)
    assert not window.is_idle
    assert window.drawn == 2
    assert pygame.MOUSEMOTION in window.events
    rest_window(window)
    window.shows = "moves"
    for _ in range(30):
        window.run_frame(IDLE_S)
    assert not window.is_idle
    assert window.drawn == 30


def test_a_resting_window_runs_few_frames(window: Counting) -> None:
    window.lasts = 60.0
    rest_window(window)
    window.frames = 0
    window.lasts = window.passed + 0.5
    window.run()
    assert window.closed
    assert window.frames <= 8


def test_full_screen_can_be_switched_on_and_off(window: Counting, tmp_path: Path) -> None:
    window.toggle_fullscreen()
    assert window.display.windowed_size == (900, 600)
    window.toggle_fullscreen()
    assert window.display.windowed_size is None
    assert window.screen.get_size() == (900, 600)
    window.screen.fill("red")
    message = window.display.save_screenshot(tmp_path)
    (saved,) = tmp_path.iterdir()
    assert str(saved) in message
    assert Image.open(saved).getpixel((10, 10))[:3] == (255, 0, 0)


def test_a_paused_window_is_drawn_only_after_changes(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        window = driver.window
        viewer = driver.viewer
        drawn: list[bool] = []
        draw = window.draw
        window.draw = lambda: (drawn.append(True), draw())  # type: ignore[method-assign, func-returns-value]
        driver.run_frames(120)
        drawn.clear()
        driver.run_frames(20)
        assert window.is_idle
        assert not drawn
        viewer.show_message("something")
        driver.run_frames(5)
        assert len(drawn) == 1
        driver.session.playback.is_playing = True
        driver.run_frames(5)
        assert len(drawn) == 6
        assert not window.is_idle
        driver.session.timeline.is_settled = True  # time goes on, and nothing moves
        assert window.build_frame_key() is not None
        window._idle_s = IDLE_S
        before = driver.session.displayed.time
        window.advance(0.5)
        assert driver.session.displayed.time == pytest.approx(before + 0.5, abs=0.05)
