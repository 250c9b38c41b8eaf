"""The loop of a window: it draws while something moves, and otherwise only after changes."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from unittest.mock import Mock

import pygame
import pytest
from driven_window import Driver, open_viewer
from PIL import Image

from robocov_app.toolkit.window.display import open_display
from robocov_app.toolkit.window.window import IDLE_S, BaseWindow

MOVING = "moving"


class CountingWindow(BaseWindow):
    """A window that counts its frames, and closes after some seconds."""

    def __init__(self) -> None:
        super().__init__((900, 600))
        self.draw_count = 0
        self.frame_count = 0
        self.time_s = 0.0
        self.close_time_s = 60.0
        self.content = ""
        self.event_types: list[int] = []

    def handle_event(self, event: pygame.event.Event) -> None:
        self.event_types.append(event.type)

    def update(self, seconds: float) -> None:
        self.frame_count += 1
        self.time_s += seconds
        self.closed = self.time_s >= self.close_time_s

    def draw(self) -> None:
        self.draw_count += 1

    def close(self) -> None:
        pass

    def build_frame_key(self) -> object:
        return None if self.content == MOVING else self.content


@pytest.fixture
def window() -> Iterator[CountingWindow]:
    """A window that is idle."""
    with open_display(headless=True):
        pygame.event.clear()
        window = CountingWindow()
        for _ in range(4):
            window.run_frame(IDLE_S / 2)
        window.draw_count = 0
        window.frame_count = 0
        yield window


class TestIdleWindow:
    def test_an_unchanged_window_is_not_drawn(self, window: CountingWindow) -> None:
        window.run_frame(0.1)
        assert window.is_idle
        assert window.draw_count == 0

    def test_a_change_is_drawn_once(self, window: CountingWindow) -> None:
        window.content = "something else"
        window.run_frame(0.1)
        window.run_frame(0.1)
        assert window.is_idle
        assert window.draw_count == 1

    def test_an_event_wakes_the_window(self, window: CountingWindow) -> None:
        pygame.event.post(pygame.event.Event(pygame.MOUSEMOTION, pos=(1, 1), rel=(1, 1), buttons=(0, 0, 0)))
        window.run_frame(0.1)
        assert not window.is_idle
        assert window.draw_count == 1
        assert pygame.MOUSEMOTION in window.event_types

    def test_moving_content_is_drawn_in_each_frame(self, window: CountingWindow) -> None:
        window.content = MOVING
        for _ in range(30):
            window.run_frame(IDLE_S)
        assert not window.is_idle
        assert window.draw_count == 30

    def test_an_idle_window_runs_few_frames(self, window: CountingWindow) -> None:
        window.close_time_s = window.time_s + 0.5
        window.run()
        assert window.closed
        assert window.frame_count <= 8


def test_full_screen_is_switched_on_and_off(window: CountingWindow) -> None:
    window.toggle_fullscreen()
    assert window.display.windowed_size == (900, 600)
    window.toggle_fullscreen()
    assert window.display.windowed_size is None
    assert window.screen.get_size() == (900, 600)


def test_a_screenshot_is_saved(window: CountingWindow, tmp_path: Path) -> None:
    window.screen.fill("red")
    message = window.display.save_screenshot(tmp_path)
    (path,) = tmp_path.iterdir()
    assert str(path) in message
    assert Image.open(path).getpixel((10, 10))[:3] == (255, 0, 0)


@pytest.fixture
def paused_viewer(tmp_path: Path) -> Iterator[Driver]:
    """A viewer that is paused and idle, and whose calls of `draw` are counted."""
    with open_viewer(tmp_path) as driver:
        driver.window.draw = Mock(wraps=driver.window.draw)  # type: ignore[method-assign]
        driver.run_frames(120)
        driver.window.draw.reset_mock()
        yield driver


class TestPausedViewer:
    def test_a_paused_viewer_is_not_drawn(self, paused_viewer: Driver) -> None:
        paused_viewer.run_frames(20)
        assert paused_viewer.window.is_idle
        assert paused_viewer.window.draw.call_count == 0

    def test_a_message_is_drawn_once(self, paused_viewer: Driver) -> None:
        paused_viewer.viewer.show_message("something")
        paused_viewer.run_frames(5)
        assert paused_viewer.window.draw.call_count == 1

    def test_a_playing_viewer_is_drawn_in_each_frame(self, paused_viewer: Driver) -> None:
        paused_viewer.session.playback.is_playing = True
        paused_viewer.run_frames(5)
        assert paused_viewer.window.draw.call_count == 5
        assert not paused_viewer.window.is_idle

    def test_time_passes_while_settled_robots_are_not_drawn(self, paused_viewer: Driver) -> None:
        session = paused_viewer.session
        session.playback.is_playing = True
        paused_viewer.run_frames(5)
        session.timeline.is_settled = True
        assert paused_viewer.window.build_frame_key() is not None
        paused_viewer.window._idle_s = IDLE_S
        time = session.displayed.time
        paused_viewer.window.advance(0.5)
        assert session.displayed.time == pytest.approx(time + 0.5, abs=0.05)
