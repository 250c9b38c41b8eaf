"""The shape of the mouse cursor."""

from contextlib import suppress

import pygame

from robocov_app.toolkit.tools.tool import CursorShape

_SYSTEM_CURSORS: dict[CursorShape, int] = {
    "arrow": pygame.SYSTEM_CURSOR_ARROW,
    "cross": pygame.SYSTEM_CURSOR_CROSSHAIR,
    "hand": pygame.SYSTEM_CURSOR_HAND,
    "move": pygame.SYSTEM_CURSOR_SIZEALL,
    "sideways": pygame.SYSTEM_CURSOR_SIZEWE,
    "updown": pygame.SYSTEM_CURSOR_SIZENS,
    "rising": pygame.SYSTEM_CURSOR_SIZENESW,
    "falling": pygame.SYSTEM_CURSOR_SIZENWSE,
}


class MouseCursor:
    """The mouse cursor of a window.

    Attributes
    ----------
    shape : int
        Constant of pygame, such as ``pygame.SYSTEM_CURSOR_HAND``. It is also set if the display has no
        cursors, because a browser page that shows the window uses it.
    """

    def __init__(self) -> None:
        self.shape = pygame.SYSTEM_CURSOR_ARROW

    def show(self, name: CursorShape) -> None:
        """Change the shape of the cursor."""
        shape = _SYSTEM_CURSORS[name]
        if shape == self.shape:
            return
        self.shape = shape
        with suppress(pygame.error):  # Not every display has cursors.
            pygame.mouse.set_cursor(shape)
