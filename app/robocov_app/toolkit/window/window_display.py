"""The surface on which a window is drawn, full screen, and screenshots."""

from io import BytesIO
from pathlib import Path

import pygame
from pygame import Surface

from robocov.files.writing import replace_file
from robocov_app.terminal.output import find_free_path
from robocov_app.toolkit.window.display import leave_full_screen, open_window

_MIN_SURFACE_PX = (320, 240)
"""Minimum size of the surface that is drawn, however small the window is."""


class WindowDisplay:
    """The surface on which a window is drawn, full screen, and screenshots.

    Parameters
    ----------
    size : (width, height), px
        Size of the window, which is opened.

    Attributes
    ----------
    surface : pygame.Surface
        Surface on which the window is drawn.
    windowed_size : tuple of int or None
        Size before full screen, px; None if the window does not fill the screen.
    """

    def __init__(self, size: tuple[int, int]) -> None:
        self.surface = open_window(size)
        self.windowed_size: tuple[int, int] | None = None

    def adopt_size(self) -> None:
        """Draw on the display from now on; if it is tiny, on a larger surface that is partly shown.

        Tiling window managers may make a window as small as one pixel, for which there is no layout.
        """
        display = pygame.display.get_surface()
        if display is None:
            return
        width, height = display.get_size()
        min_width, min_height = _MIN_SURFACE_PX
        if width < min_width or height < min_height:
            self.surface = Surface((max(width, min_width), max(height, min_height)), 0, 32)
        else:
            self.surface = display

    def show(self) -> None:
        """Show the frame that was drawn."""
        display = pygame.display.get_surface()
        if display is not None and display is not self.surface:
            display.blit(self.surface, (0, 0))
        pygame.display.flip()

    def toggle_fullscreen(self) -> None:
        """Switch to full screen, or back to the previous size."""
        # pygame.display.toggle_fullscreen keeps the size, so the rest of the screen would be black.
        size = self.windowed_size
        if size is None:
            self.windowed_size = self.surface.get_size()
            self.surface = pygame.display.set_mode((0, 0), pygame.FULLSCREEN)
        else:
            self.windowed_size = None
            # A window that still fills the screen would keep its size.
            leave_full_screen()
            self.surface = open_window(size)

    def save_screenshot(self, folder: Path) -> str:
        """Write the current frame to a new PNG file in a folder, and return a message."""
        target = find_free_path(folder, "robocov", ".png")
        image = BytesIO()
        pygame.image.save(self.surface, image, ".png")
        with replace_file(target) as temporary:
            temporary.write_bytes(image.getvalue())
        return f"screenshot saved: {target}"
