"""A scanner for text, which reports the positions of errors."""

from __future__ import annotations

import re
from typing import NoReturn

from robocov.errors import MapError, quote
from robocov.files.json_positions import find_line_and_column

_SPACE = re.compile(r"\s*")
_MAX_QUOTED_CHARACTERS = 24


class Scanner:
    """A text and the position up to which it has been read.

    Parameters
    ----------
    text : str
    source_name : str
        The file, for messages.

    Attributes
    ----------
    text : str
    position : int
        Index of the next character.
    """

    def __init__(self, text: str, source_name: str) -> None:
        self.text = text
        self.position = 0
        self._source_name = source_name

    def skip_space(self) -> None:
        """Move past white space."""
        match = _SPACE.match(self.text, self.position)
        assert match is not None  # the pattern also matches empty text
        self.position = match.end()

    def is_at_end(self) -> bool:
        """Move past white space, and return whether nothing follows."""
        self.skip_space()
        return self.position == len(self.text)

    def is_at(self, text: str) -> bool:
        """Return whether a text follows at the current position."""
        return self.text.startswith(text, self.position)

    def match(self, pattern: re.Pattern[str]) -> re.Match[str] | None:
        """Match a pattern at the current position, without moving past it."""
        return pattern.match(self.text, self.position)

    def accept(self, characters: str) -> bool:
        """Move past white space and then, if it is among `characters`, past the next character.

        Return whether it is.
        """
        self.skip_space()
        character = self.text[self.position : self.position + 1]
        if not character or character not in characters:
            return False
        self.position += 1
        return True

    def expect(self, character: str) -> None:
        """Move past white space and a given character; raise MapError if another one follows."""
        if not self.accept(character):
            self.raise_error(f"expected {character}, got {self.quote_next()}")

    def quote_next(self) -> str:
        """Move past white space, and quote the beginning of the text that follows for a message."""
        self.skip_space()
        lines = self.text[self.position : self.position + _MAX_QUOTED_CHARACTERS].splitlines()
        return quote(lines[0]) if lines else "the end"

    def raise_error(self, problem: str, position: int | None = None) -> NoReturn:
        """Raise a MapError about a position, by default the next character."""
        if position is None:
            position = self.position
        line, column = find_line_and_column(self.text, position)
        raise MapError(f"{self._source_name}:{line}:{column}: {problem}")
