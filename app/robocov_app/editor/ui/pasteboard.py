"""A clipboard of the process, for windows that nobody watches."""

from __future__ import annotations


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
