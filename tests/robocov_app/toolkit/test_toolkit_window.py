"""A window draws while something moves, and otherwise what is different."""

from __future__ import annotations

from pathlib import Path

import pygame
import pytest
from driven_window import opened
from PIL import Image

from robocov_app.toolkit.display import open_display
from robocov_app.toolkit.window import CALM_S, BaseWindow


class Counting(BaseWindow):
    """Counts its pictures, and closes after some seconds."""

    def __init__(self) -> None:
        super().__init__((900, 600))
        self.drawn, self.frames, self.passed, self.shows, self.lasts = 0, 0, 0.0, "", 1.5
        self.events: list[int] = []

    def handle_event(self, event: pygame.event.Event) -> None:
        self.events.append(event.type)

    def update(self, seconds: float) -> None:
        self.frames, self.passed = self.frames + 1, self.passed + seconds
        self.closed = self.passed >= self.lasts

    def draw(self) -> None:
        self.drawn += 1

    def close(self) -> None:
        pass

    def get_visible_state(self) -> object:
        return None if self.shows == "moves" else self.shows


@pytest.fixture
def window():
    with open_display(headless=True):
        pygame.event.clear()
        yield Counting()


def rested(window: Counting) -> None:
    for _ in range(4):
        window.run_frame(CALM_S / 2)
    window.drawn = 0


def test_it_rests_when_nothing_happens_and_wakes_when_something_does(window: Counting) -> None:
    window.lasts = 60.0
    rested(window)
    window.run_frame(0.1)
    assert window.is_resting and window.drawn == 0
    window.shows = "something else"
    window.run_frame(0.1)
    window.run_frame(0.1)
    assert window.is_resting and window.drawn == 1  # once, without being wide awake
    pygame.event.post(pygame.event.Event(pygame.MOUSEMOTION, pos=(1, 1), rel=(1, 1), buttons=(0, 0, 0)))
    window.run_frame(0.1)
    assert not window.is_resting and window.drawn == 2 and pygame.MOUSEMOTION in window.events
    rested(window)
    window.shows = "moves"
    for _ in range(30):
        window.run_frame(CALM_S)
    assert not window.is_resting and window.drawn == 30


def test_it_takes_few_looks_while_it_rests(window: Counting) -> None:
    window.lasts = 60.0
    rested(window)
    window.frames, window.lasts = 0, window.passed + 0.5
    window.run()
    assert window.closed and window.frames <= 8


def test_full_screen_and_back(window: Counting, tmp_path: Path) -> None:
    window.toggle_fullscreen()
    assert window.windowed_size == (900, 600)
    window.toggle_fullscreen()
    assert window.windowed_size is None and window.screen.get_size() == (900, 600)
    window.screen.fill("red")
    words = window.save_screenshot(tmp_path)
    (saved,) = tmp_path.iterdir()
    assert str(saved) in words and Image.open(saved).getpixel((10, 10))[:3] == (255, 0, 0)


def test_a_paused_window_is_drawn_when_its_cost_or_words_change_only(tmp_path: Path) -> None:
    with opened(tmp_path) as driver:
        window, viewer = driver.window, driver.viewer
        drawn: list[bool] = []
        draw = window.draw
        window.draw = lambda: (drawn.append(True), draw())  # type: ignore[method-assign, func-returns-value]
        driver.frames(120)
        drawn.clear()
        driver.frames(20)
        assert window.is_resting and not drawn
        viewer.show_message("something")
        driver.frames(5)
        assert len(drawn) == 1
        driver.session.playback.is_playing = True
        driver.frames(5)
        assert len(drawn) == 6 and not window.is_resting
        driver.session.timeline.is_settled = True  # time goes on, and nothing moves
        assert window.get_visible_state() is not None
        window._calm_s, before = CALM_S, driver.session.displayed.time
        window.advance(0.5)
        assert driver.session.displayed.time == pytest.approx(before + 0.5, abs=0.05)
