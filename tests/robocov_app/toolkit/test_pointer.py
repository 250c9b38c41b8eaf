"""The mouse over a map: presses become gestures, clicks in a row are counted, slips are no drags."""

from __future__ import annotations

import pygame
import pytest

from robocov_app.toolkit.tools.pointer import Gesture, PanGesture, Pointer
from robocov_app.toolkit.window.input import DOUBLE_CLICK_S
from robocov_app.toolkit.window_part import WindowPart


class RecordedPointer(Pointer):
    """A pointer whose presses pan, and that records pans, clicks and counts of clicks."""

    def __init__(self, scale: float = 1.0) -> None:
        super().__init__((WindowPart(),))
        self.scale = scale
        self.panned = (0, 0)
        self.clicks: list[int] = []
        self.counts: list[int] = []

    def get_scale(self) -> float:
        return self.scale

    def start_gesture(self, event: pygame.event.Event, now: float) -> Gesture | None:
        self.counts.append(self.count_clicks(event, now))
        return PanGesture(self.pan, lambda event: self.clicks.append(event.button))

    def pan(self, dx: float, dy: float) -> None:
        self.panned = (self.panned[0] + dx, self.panned[1] + dy)

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


def test_a_drag_pans_by_all_of_its_length() -> None:
    pointer = RecordedPointer()
    pointer.drag((10, 10), (12, 11), (30, 11), (40, 5))
    assert pointer.panned == (30, -5)
    assert pointer.clicks == []
    assert not pointer.is_busy


def test_a_slip_is_a_click_and_moves_nothing() -> None:
    pointer = RecordedPointer()
    pointer.drag((10, 10), (13, 12), button=3)
    assert pointer.panned == (0, 0)
    assert pointer.clicks == [3]


def test_a_drag_that_returns_is_no_click() -> None:
    pointer = RecordedPointer()
    pointer.drag((10, 10), (60, 10), (10, 10))
    assert pointer.panned == (0, 0)
    assert pointer.clicks == []


@pytest.mark.parametrize(("scale", "is_click"), [(1.0, False), (2.0, True)])
def test_a_slip_may_be_longer_in_a_larger_window(scale: float, is_click: bool) -> None:
    pointer = RecordedPointer(scale)
    pointer.drag((10, 10), (18, 10))
    assert bool(pointer.clicks) == is_click


def test_other_buttons_do_nothing_while_one_is_held() -> None:
    pointer = RecordedPointer()
    pointer.send(pygame.MOUSEBUTTONDOWN, (10, 10), button=1)
    pointer.send(pygame.MOUSEBUTTONDOWN, (10, 10), button=3)
    pointer.send(pygame.MOUSEBUTTONUP, (10, 10), button=3)
    assert pointer.is_busy
    pointer.send(pygame.MOUSEBUTTONUP, (10, 10), button=1)
    assert pointer.clicks == [1]
    pointer.send(pygame.MOUSEBUTTONDOWN, (10, 10), button=6)
    assert not pointer.is_busy


def test_quick_clicks_at_a_pixel_are_counted() -> None:
    pointer = RecordedPointer()
    times = [0.0, 0.2, 0.4, 0.4 + 2 * DOUBLE_CLICK_S]
    for now in times:
        pointer.send(pygame.MOUSEBUTTONDOWN, (10, 10), now=now)
        pointer.send(pygame.MOUSEBUTTONUP, (10, 10))
    pointer.send(pygame.MOUSEBUTTONDOWN, (40, 10), now=times[-1] + 0.1)
    assert pointer.counts == [1, 2, 3, 1, 1]
