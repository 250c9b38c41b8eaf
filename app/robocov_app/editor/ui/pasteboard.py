"""The system's clipboard, by SDL; where there is none, one of the window's own."""

from __future__ import annotations

import pygame


class SystemPasteboard:
    """Texts in the system's clipboard."""

    def __init__(self) -> None:
        self._own = ""

    def put(self, text: str) -> None:
        """Put a text there."""
        self._own = text
        try:
            pygame.scrap.put_text(text)
        except pygame.error:  # no clipboard, as without a display
            return

    def get(self) -> str:
        """Return the text that is there."""
        try:
            return (pygame.scrap.get_text() if pygame.scrap.has_text() else "") or self._own
        except pygame.error:
            return self._own


class OwnPasteboard:
    """Texts that stay in this process."""

    def __init__(self) -> None:
        self._text = ""

    def put(self, text: str) -> None:
        """Keep a text."""
        self._text = text

    def get(self) -> str:
        """Return the text."""
        return self._text
