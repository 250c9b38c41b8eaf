"""Drags and clicks of the mouse over a map."""

from __future__ import annotations

import pygame
import pytest

from robocov_app.toolkit.tools.pointer import Gesture, PanGesture, Pointer
from robocov_app.toolkit.window.input import DOUBLE_CLICK_S
from robocov_app.toolkit.window_part import WindowPart


class RecordedPointer(Pointer):
    """A pointer whose drags pan, and that records pans, clicks and consecutive clicks."""

    def __init__(self, scale: float = 1.0) -> None:
        super().__init__((WindowPart(),))
        self.scale = scale
        self.shift = (0, 0)
        self.clicks: list[int] = []
        self.click_counts: list[int] = []

    def get_scale(self) -> float:
        return self.scale

    def start_gesture(self, event: pygame.event.Event, now: float) -> Gesture | None:
        self.click_counts.append(self.record_press(event, now))
        return PanGesture(self.pan, lambda event: self.clicks.append(event.button))

    def pan(self, dx: float, dy: float) -> None:
        self.shift = (self.shift[0] + dx, self.shift[1] + dy)

    def send(self, kind: int, pixel: tuple[int, int], button: int = 1, now: float = 0.0) -> None:
        """Handle an event at a pixel."""
        rel = (pixel[0] - self.pixel[0], pixel[1] - self.pixel[1])
        self.handle_event(pygame.event.Event(kind, pos=pixel, rel=rel, button=button), now)

    def drag(self, *pixels: tuple[int, int], button: int = 1) -> None:
        """Press at the first pixel, and release at the last."""
        self.send(pygame.MOUSEMOTION, pixels[0])
        self.send(pygame.MOUSEBUTTONDOWN, pixels[0], button)
        for pixel in pixels[1:]:
            self.send(pygame.MOUSEMOTION, pixel)
        self.send(pygame.MOUSEBUTTONUP, pixels[-1], button)


def test_a_drag_pans_by_its_whole_length() -> None:
    pointer = RecordedPointer()
    pointer.drag((10, 10), (12, 11), (30, 11), (40, 5))
    assert pointer.shift == (30, -5)
    assert pointer.clicks == []
    assert not pointer.is_busy


def test_a_short_drag_is_a_click() -> None:
    pointer = RecordedPointer()
    pointer.drag((10, 10), (13, 12), button=3)
    assert pointer.shift == (0, 0)
    assert pointer.clicks == [3]


def test_a_drag_that_returns_to_its_start_is_not_a_click() -> None:
    pointer = RecordedPointer()
    pointer.drag((10, 10), (60, 10), (10, 10))
    assert pointer.shift == (0, 0)
    assert pointer.clicks == []


@pytest.mark.parametrize(("scale", "is_click"), [(1.0, False), (2.0, True)])
def test_the_maximum_length_of_a_click_grows_with_the_scale(scale: float, is_click: bool) -> None:
    pointer = RecordedPointer(scale)
    pointer.drag((10, 10), (18, 10))
    assert bool(pointer.clicks) == is_click


def test_other_buttons_have_no_effect_while_one_is_held() -> None:
    pointer = RecordedPointer()
    pointer.send(pygame.MOUSEBUTTONDOWN, (10, 10), button=1)
    pointer.send(pygame.MOUSEBUTTONDOWN, (10, 10), button=3)
    pointer.send(pygame.MOUSEBUTTONUP, (10, 10), button=3)
    assert pointer.is_busy
    pointer.send(pygame.MOUSEBUTTONUP, (10, 10), button=1)
    assert pointer.clicks == [1]


def test_additional_buttons_of_a_mouse_have_no_effect() -> None:
    pointer = RecordedPointer()
    pointer.send(pygame.MOUSEBUTTONDOWN, (10, 10), button=6)
    assert not pointer.is_busy


def test_quick_clicks_at_the_same_pixel_are_counted() -> None:
    pointer = RecordedPointer()
    for now in (0.0, 0.2, 0.4):
        pointer.send(pygame.MOUSEBUTTONDOWN, (10, 10), now=now)
        pointer.send(pygame.MOUSEBUTTONUP, (10, 10))
    assert pointer.click_counts == [1, 2, 3]


@pytest.mark.parametrize(
    ("pixel", "seconds"),
    [pytest.param((10, 10), 2 * DOUBLE_CLICK_S, id="late"), pytest.param((40, 10), 0.1, id="elsewhere")],
)
def test_late_or_distant_clicks_start_a_new_count(pixel: tuple[int, int], seconds: float) -> None:
    pointer = RecordedPointer()
    pointer.send(pygame.MOUSEBUTTONDOWN, (10, 10), now=0.0)
    pointer.send(pygame.MOUSEBUTTONUP, (10, 10))
    pointer.send(pygame.MOUSEBUTTONDOWN, pixel, now=seconds)
    assert pointer.click_counts == [1, 1]
