"""The shape of the mouse cursor."""

from contextlib import suppress

import pygame


class MouseCursor:
    """The mouse cursor of a window.

    Attributes
    ----------
    shape : int
        Constant of pygame, such as ``pygame.SYSTEM_CURSOR_HAND``. A display without cursors has a shape, too:
        a page that shows the window in a browser uses it.
    """

    def __init__(self) -> None:
        self.shape = pygame.SYSTEM_CURSOR_ARROW

    def show(self, shape: int) -> None:
        """Give the cursor another shape."""
        if shape == self.shape:
            return
        self.shape = shape
        with suppress(pygame.error):  # Not every display has cursors.
            pygame.mouse.set_cursor(shape)
