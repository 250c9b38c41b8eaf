"""Text on the system's clipboard, or within the program if the display has none."""

from contextlib import suppress

import pygame

from robocov.text import remove_controls

_NOT_AVAILABLE = (pygame.error, AttributeError, ValueError)  # ValueError: the text is not valid UTF-8


class Clipboard:
    """The system's clipboard, which all windows share.

    If the display has no clipboard, the text copied last is kept in this object.
    """

    def __init__(self) -> None:
        self._own_text = ""

    def get(self) -> str:
        """Return the text on the clipboard without control characters; empty if there is none."""
        text = ""
        with suppress(*_NOT_AVAILABLE):
            if pygame.scrap.has_text():
                text = pygame.scrap.get_text()
        return remove_controls(text) or self._own_text

    def put(self, text: str) -> None:
        """Copy text to the clipboard, without control characters."""
        self._own_text = remove_controls(text)
        with suppress(*_NOT_AVAILABLE):
            pygame.scrap.put_text(self._own_text)
