"""Editing of a one-line text field: cursor, selection, clipboard, undo, and input methods."""

import re
from dataclasses import dataclass, field
from typing import Self

from robocov.text import remove_controls
from robocov_app.toolkit.window.clipboard import Clipboard

MAX_CHARS = 10_000
"""Maximum length of the text, which is that of the longest texts in maps."""

_State = tuple[str, int, int]  # text, caret and anchor


@dataclass
class TextEdit:
    """A line of text that is being edited.

    Attributes
    ----------
    text : str
    caret : int
        Position of the text cursor, from 0 to the number of characters.
    anchor : int
        Other end of the selection. The selection is empty if this equals the caret.
    composed : str
        Text that an input method is composing. It is shown at the caret but is not part of the text yet.
    """

    text: str = ""
    caret: int = 0
    anchor: int = 0
    composed: str = ""
    _undo: list[_State] = field(default_factory=list)
    _redo: list[_State] = field(default_factory=list)
    _typing: bool = False

    @classmethod
    def select_all(cls, text: str) -> Self:
        """Start editing with all text selected, so that typing replaces it."""
        return cls(text, len(text), 0)

    @classmethod
    def append_to(cls, text: str) -> Self:
        """Start editing with the caret at the end of the text."""
        return cls(text, len(text), len(text))

    @property
    def selection(self) -> tuple[int, int]:
        """Start and end of the selected text."""
        return min(self.caret, self.anchor), max(self.caret, self.anchor)

    def place(self, caret: int, *, extend: bool = False) -> None:
        """Move the caret; extend the selection to it, or else clear the selection."""
        self.caret = min(max(caret, 0), len(self.text))
        if not extend:
            self.anchor = self.caret
        self._typing = False

    def select_word(self, position: int) -> None:
        """Select the word at a position."""
        for word in re.finditer(r"[\w.]+|\s+|[^\w.\s]+", self.text):
            if word.start() <= position <= word.end():
                self.anchor, self.caret = word.span()

    def type(self, text: str) -> None:
        """Replace the selection with typed or pasted text.

        Parameters
        ----------
        text : str
            Line breaks become spaces; text beyond `MAX_CHARS` is cut off.
        """
        low, high = self.selection
        max_length = max(MAX_CHARS - len(self.text) + (high - low), 0)
        line = remove_controls(" ".join(text.splitlines()), single_line=True)[:max_length]
        if line:
            self._replace(low, high, line, is_typing=len(line) == 1)
        self.composed = ""

    def press_key(self, name: str, clipboard: Clipboard) -> None:
        """Edit the text in response to a key; keys without a function here are ignored.

        Parameters
        ----------
        name : str
            Name with modifiers, as in ``ctrl+z``.
        clipboard : Clipboard
            Clipboard for Ctrl+C, Ctrl+X and Ctrl+V.
        """
        key = name.replace("shift+", "")
        if key == "ctrl+y" or name == "ctrl+shift+z":
            self._swap(self._redo, self._undo)
            return
        targets = self._find_targets()
        # Backspace erases up to where the left arrow key would go, Delete up to where the right one would.
        erase_key = key.replace("backspace", "left").replace("delete", "right")
        if key in targets:
            self._move(key, targets[key], extend="shift+" in name)
        elif erase_key in targets:
            self._erase(targets[erase_key])
        else:
            self._press_ctrl_key(key, clipboard)

    def _find_targets(self) -> dict[str, int]:
        """Return the new position of the caret for each key that moves it."""
        return {
            "left": self.caret - 1,
            "right": self.caret + 1,
            "home": 0,
            "end": len(self.text),
            "ctrl+left": self._find_word_start(),
            "ctrl+right": self._find_word_end(),
        }

    def _find_word_start(self) -> int:
        match = re.search(r"\S+\s*$", self.text[: self.caret])
        if match is None:
            return 0
        return match.start()

    def _find_word_end(self) -> int:
        match = re.match(r"\s*\S+", self.text[self.caret :])
        if match is None:
            return len(self.text)
        return self.caret + match.end()

    def _move(self, key: str, target: int, *, extend: bool) -> None:
        start, end = self.selection
        if start != end and not extend:
            # Without Shift, an arrow key moves the caret to that end of the selection.
            target = {"left": start, "right": end}.get(key, target)
        self.place(target, extend=extend)

    def _erase(self, target: int) -> None:
        """Erase the selection; if it is empty, erase the text between the caret and `target`."""
        start, end = self.selection
        if start == end:
            start, end = sorted((self.caret, target))
        if 0 <= start < end <= len(self.text):
            self._replace(start, end, "")

    def _press_ctrl_key(self, key: str, clipboard: Clipboard) -> None:
        """Select all, copy, cut, paste or undo."""
        start, end = self.selection
        if key == "ctrl+a":
            self.anchor = 0
            self.caret = len(self.text)
        elif key in ("ctrl+c", "ctrl+x") and start != end:
            clipboard.put(self.text[start:end])
            if key == "ctrl+x":
                self._replace(start, end, "")
        elif key == "ctrl+v":
            self.type(clipboard.get())
        elif key == "ctrl+z":
            self._swap(self._undo, self._redo)

    def _replace(self, start: int, end: int, text: str, *, is_typing: bool = False) -> None:
        # Characters typed in succession are undone together.
        continues_typing = is_typing and self._typing and start == end
        if not continues_typing:
            self._undo.append((self.text, self.caret, self.anchor))
        self._redo.clear()
        self._typing = is_typing
        self.text = self.text[:start] + text + self.text[end:]
        self.caret = start + len(text)
        self.anchor = self.caret

    def _swap(self, source: list[_State], target: list[_State]) -> None:
        """Restore the last state of one list, and append the present state to the other (undo or redo)."""
        if source:
            target.append((self.text, self.caret, self.anchor))
            self.text, self.caret, self.anchor = source.pop()
        self._typing = False
