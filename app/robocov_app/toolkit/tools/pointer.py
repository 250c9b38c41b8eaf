"""The mouse over the map of a window: button presses start gestures, and the wheel zooms."""

from collections.abc import Callable, Sequence
from math import dist
from typing import NamedTuple, TypeAlias

import pygame

from robocov_app.toolkit.window.input import DOUBLE_CLICK_S, MAX_CLICK_MOVE_PX
from robocov_app.toolkit.window_part import WindowPart, offer_event

LEFT_BUTTON = 1
RIGHT_BUTTON = 3
BUTTONS = (1, 2, 3)  # left, middle, right
_NEVER_S = -1.0

Pixel: TypeAlias = tuple[int, int]


class Modifiers(NamedTuple):
    """Modifier keys that are held down; Ctrl includes the Command key of macOS."""

    shift: bool
    alt: bool
    ctrl: bool


def read_modifiers() -> Modifiers:
    """Return the modifier keys that are held down."""
    held = pygame.key.get_mods()
    return Modifiers(
        shift=bool(held & pygame.KMOD_SHIFT),
        alt=bool(held & pygame.KMOD_ALT),
        ctrl=bool(held & (pygame.KMOD_CTRL | pygame.KMOD_META)),
    )


class Gesture:
    """Action of the mouse while a button is held down: base class of the gestures.

    Attributes
    ----------
    is_pan : bool
        Whether it pans the map instead of using the tool.
    """

    is_pan = False

    def move(self, event: pygame.event.Event, *, is_click: bool) -> None:
        """Handle a move of the mouse; `is_click` is True while the press may still become a click."""

    def release(self, event: pygame.event.Event, *, is_click: bool) -> None:
        """Handle the release of the button."""


class PanGesture(Gesture):
    """Pans the map with the mouse.

    Parameters
    ----------
    pan : callable
        Pans the map by the given numbers of pixels to the right and down.
    click : callable
        Called with the event if the button is released while the press is still a click.
    """

    is_pan = True

    def __init__(
        self, pan: Callable[[float, float], object], click: Callable[[pygame.event.Event], object]
    ) -> None:
        self._pan = pan
        self._click = click
        # Motion, px, that is held back while the press may still become a click.
        self._pending_motion = (0, 0)

    def move(self, event: pygame.event.Event, *, is_click: bool) -> None:
        """Pan the map with the mouse, unless the press may still become a click."""
        dx = self._pending_motion[0] + event.rel[0]
        dy = self._pending_motion[1] + event.rel[1]
        if is_click:
            self._pending_motion = (dx, dy)
            return
        self._pending_motion = (0, 0)
        self._pan(dx, dy)

    def release(self, event: pygame.event.Event, *, is_click: bool) -> None:
        """Call `click` if the press is still a click."""
        if is_click:
            self._click(event)


class _Press(NamedTuple):
    """The last press of a button, to detect double clicks."""

    time_s: float = _NEVER_S
    pixel: Pixel = (0, 0)
    click_count: int = 0  # number of quick presses at the same pixel up to this one


class Pointer:
    """Turns mouse events over a map into gestures; subclasses decide which gesture a press starts.

    Parameters
    ----------
    parts : sequence of WindowPart
        Parts of the window that get events first unless a button is held down over the map.

    Attributes
    ----------
    pixel : tuple of int
        Pixel under the mouse.
    gesture : Gesture or None
        Gesture of the button that is held down.
    """

    def __init__(self, parts: Sequence[WindowPart]) -> None:
        self.pixel: Pixel = (0, 0)
        self.gesture: Gesture | None = None
        self._parts = parts
        self._button = 0
        self._pressed_at: Pixel = (0, 0)
        self._is_click = False  # the mouse has hardly moved since the press
        self._last_press = _Press()

    # Methods that windows override

    def get_scale(self) -> float:
        """Return the scale of the window."""
        return 1.0

    def start_gesture(self, event: pygame.event.Event, now: float) -> Gesture | None:
        """Return the gesture that a press starts at time `now`, s; None if it starts none."""
        return None

    def hover(self, event: pygame.event.Event) -> None:
        """Handle a move of the mouse, before the gesture does."""

    def leave(self) -> None:
        """React when the mouse leaves the map."""

    def handle_wheel(self, event: pygame.event.Event) -> None:
        """Handle a turn of the mouse wheel."""

    # Events

    @property
    def is_busy(self) -> bool:
        """Whether a button is held down."""
        return self.gesture is not None

    def reset(self) -> None:
        """Drop the current gesture, as if no button were held down."""
        self.gesture = None
        self._button = 0

    def handle_event(self, event: pygame.event.Event, now: float) -> None:
        """Pass a mouse event to the part of the window under the mouse or, over the map, to a gesture.

        Parameters
        ----------
        event : pygame.event.Event
        now : float
            Current time, s, for the detection of double clicks.
        """
        if event.type != pygame.MOUSEWHEEL:
            self.pixel = event.pos
        # While a button is held down over the map, its gesture gets all events.
        is_used_by_part = False
        if not self.is_busy:
            is_used_by_part = offer_event(self._parts, event)
        if event.type == pygame.MOUSEMOTION:
            self.move(event)
        elif event.type == pygame.MOUSEBUTTONUP:
            self.release(event)
        elif is_used_by_part:
            self.leave()
        elif event.type == pygame.MOUSEBUTTONDOWN:
            for part in self._parts:
                part.ui.clear_focus()
            self.press(event, now)
        else:
            self.handle_wheel(event)

    def press(self, event: pygame.event.Event, now: float) -> None:
        """Handle a button press at time `now`, s; ignore it while another button is held."""
        if self.is_busy or event.button not in BUTTONS:
            return
        self._pressed_at = event.pos
        self._button = event.button
        self._is_click = True
        self.gesture = self.start_gesture(event, now)

    def move(self, event: pygame.event.Event) -> None:
        """Handle a move of the mouse."""
        self._is_click = self._is_click and self._is_near(self._pressed_at, event.pos)
        self.hover(event)
        if self.gesture is not None:
            self.gesture.move(event, is_click=self._is_click)

    def release(self, event: pygame.event.Event) -> None:
        """Handle the release of a button; ignore it unless its press started the current gesture."""
        gesture = self.gesture
        if gesture is None or event.button != self._button:
            return
        self.reset()
        is_click = self._is_click and self._is_near(self._pressed_at, event.pos)
        gesture.release(event, is_click=is_click)

    def record_press(self, event: pygame.event.Event, now: float) -> int:
        """Record a press, and return the number of quick presses in a row here: 2 for a double click."""
        last = self._last_press
        is_quick = now - last.time_s < DOUBLE_CLICK_S
        is_same_place = self._is_near(last.pixel, event.pos)
        count = last.click_count + 1 if is_quick and is_same_place else 1
        self._last_press = _Press(now, event.pos, count)
        return count

    def _is_near(self, first: Pixel, second: Pixel) -> bool:
        """Return whether two pixels are so close that moving between them still counts as a click."""
        return dist(first, second) < MAX_CLICK_MOVE_PX * self.get_scale()
