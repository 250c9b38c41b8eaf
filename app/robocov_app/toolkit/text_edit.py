"""The text of a one-line field: caret, selection, clipboard, undo, and what an input method composes."""

import re
from dataclasses import dataclass, field
from typing import Self

from robocov.text import remove_controls
from robocov_app.toolkit import clipboard

MAX_CHARS = 10_000  # characters of a field: as many as the longest texts in maps have
_State = tuple[str, int, int]


@dataclass
class TextEdit:
    """A line of text that is being edited."""

    text: str = ""
    caret: int = 0
    anchor: int = 0  # what is between it and the caret is selected
    composed: str = ""  # shown at the caret while an input method is still at it; not part of the text yet
    _undo: list[_State] = field(default_factory=list)
    _redo: list[_State] = field(default_factory=list)
    _typing: bool = False

    @classmethod
    def of(cls, text: str) -> Self:
        return cls(text, len(text), 0)

    @property
    def selection(self) -> tuple[int, int]:
        return min(self.caret, self.anchor), max(self.caret, self.anchor)

    def place(self, caret: int, *, extend: bool = False) -> None:
        self.caret = min(max(caret, 0), len(self.text))
        if not extend:
            self.anchor = self.caret
        self._typing = False

    def select_word(self, at: int) -> None:
        for word in re.finditer(r"[\w.]+|\s+|[^\w.\s]+", self.text):
            if word.start() <= at <= word.end():
                self.anchor, self.caret = word.span()

    def type(self, text: str) -> None:
        """Replace the selection by a text on one line; line ends become blanks, what is too long is cut."""
        low, high = self.selection
        free = MAX_CHARS - len(self.text) + (high - low)
        text = remove_controls(" ".join(text.splitlines()), single_line=True)[: max(free, 0)]
        if text:
            self._replace(*self.selection, text, typing=len(text) == 1)
        self.composed = ""

    def _replace(self, start: int, end: int, text: str, *, typing: bool = False) -> None:
        if not (typing and self._typing and start == end):  # letters in a row are undone together
            self._undo.append((self.text, self.caret, self.anchor))
        self._redo.clear()
        self._typing = typing
        self.text = self.text[:start] + text + self.text[end:]
        self.caret = self.anchor = start + len(text)

    def _word(self, by: int) -> int:
        if by < 0:
            before = re.search(r"\S+\s*$", self.text[: self.caret])
            return before.start() if before else 0
        after = re.match(r"\s*\S+", self.text[self.caret :])
        return self.caret + after.end() if after else len(self.text)

    def key(self, name: str) -> None:
        extend = "shift+" in name
        key = name.replace("shift+", "") if name != "ctrl+shift+z" else name
        (start, end), at = self.selection, self.caret
        moves = {"left": at - 1, "right": at + 1, "home": 0, "end": len(self.text)}
        moves |= {"ctrl+left": self._word(-1), "ctrl+right": self._word(1)}
        erased = moves.get(key.replace("backspace", "left").replace("delete", "right"))
        if key in moves:
            if start != end and not extend and key in ("left", "right"):
                moves |= {"left": start, "right": end}
            self.place(moves[key], extend=extend)
        elif erased is not None:
            low, high = (start, end) if start != end else sorted((at, erased))
            if 0 <= low < high <= len(self.text):
                self._replace(low, high, "")
        elif key == "ctrl+a":
            self.anchor, self.caret = 0, len(self.text)
        elif key in ("ctrl+c", "ctrl+x") and start != end:
            clipboard.put(self.text[start:end])
            if key == "ctrl+x":
                self._replace(start, end, "")
        elif key == "ctrl+v":
            self.type(clipboard.get())
        elif key == "ctrl+z":
            self._swap(self._undo, self._redo)
        elif key in ("ctrl+y", "ctrl+shift+z"):
            self._swap(self._redo, self._undo)

    def _swap(self, source: list[_State], target: list[_State]) -> None:
        if source:
            target.append((self.text, self.caret, self.anchor))
            self.text, self.caret, self.anchor = source.pop()
        self._typing = False
