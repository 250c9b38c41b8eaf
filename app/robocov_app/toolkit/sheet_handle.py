"""The handle of a sheet: the strip above a panel, which closes the panel when tapped or dragged down."""

from collections.abc import Callable

import pygame
from pygame import Rect, Surface

from robocov_app.look.colors import mix
from robocov_app.look.theme import Theme
from robocov_app.toolkit.overlay import draw_edge, draw_rounded_box
from robocov_app.toolkit.tools.pointer import LEFT_BUTTON
from robocov_app.toolkit.window.layout import Layout, is_inside

# Lengths in pixels at scale 1.
_GRIP_SIZE_PX = (44, 5)
_MIN_DRAG_PX = 24
"""Distance by which the handle must be dragged down to close the sheet."""
_GRIP_STRENGTH = 0.35
"""Fraction of the color of text in the grip."""


class SheetHandle:
    """Closes the sheet of a window when its handle is tapped, or dragged down.

    Parameters
    ----------
    close_sheet : callable
        Closes the sheet.
    """

    def __init__(self, close_sheet: Callable[[], object]) -> None:
        self._close_sheet = close_sheet
        self._pressed_y: int | None = None

    def handle_event(self, event: pygame.event.Event, layout: Layout) -> bool:
        """Handle a mouse event; return whether it was meant for the handle."""
        if event.type == pygame.MOUSEBUTTONDOWN:
            if event.button != LEFT_BUTTON:
                return False
            is_pressed = is_inside(layout.handle, event.pos)
            self._pressed_y = event.pos[1] if is_pressed else None
            return is_pressed
        pressed_y = self._pressed_y
        if pressed_y is None:
            return False
        if event.type == pygame.MOUSEBUTTONUP and event.button == LEFT_BUTTON:
            self._pressed_y = None
            is_tap = is_inside(layout.handle, event.pos)
            is_dragged = event.pos[1] - pressed_y >= _MIN_DRAG_PX * layout.scale
            if is_tap or is_dragged:
                self._close_sheet()
        return True

    def draw(self, screen: Surface, layout: Layout, theme: Theme) -> None:
        """Draw the strip with its grip; nothing if the panel is not a sheet."""
        strip = Rect(layout.handle)
        if not strip.height:
            return
        screen.fill(theme.panel, strip)
        draw_edge(screen, Rect(strip.left, strip.top, strip.width, 1), theme)
        width, height = _GRIP_SIZE_PX
        grip = Rect(0, 0, round(width * layout.scale), round(height * layout.scale))
        grip.center = strip.center
        color = mix(theme.panel, theme.ink, _GRIP_STRENGTH)
        draw_rounded_box(screen, grip, color, edge=color, radius=grip.height // 2)
