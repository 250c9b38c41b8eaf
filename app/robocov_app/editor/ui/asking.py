"""What is asked before something is done: a question with answers, a file, one of a list. Knows no pygame."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

ROWS = 9
"""Lines of a list that are shown at once."""

MOST_LISTED = 500
"""Names that are looked at in a folder with many."""


@dataclass(frozen=True)
class Answer:
    """What a question can be answered with.

    Attributes
    ----------
    text : str
    key : str
        The letter that gives it.
    call : callable
        What it does.
    """

    text: str
    key: str
    call: Callable[[], object]


class Question:
    """A question, with answers side by side: Enter gives the first, Escape the last."""

    def __init__(self, title: str, words: str, answers: Sequence[Answer]) -> None:
        self.title, self.words, self.answers = title, words, tuple(answers)
        self.chosen = 0

    def move(self, by: int) -> None:
        """Choose another answer."""
        self.chosen = (self.chosen + by) % len(self.answers)

    def answer(self, key: str) -> Answer | None:
        """Return the answer that a key gives; None if it gives none."""
        if key in ("return", "enter"):
            return self.answers[self.chosen]
        if key == "escape":
            return self.answers[-1]
        return next((each for each in self.answers if each.key == key), None)


class ListQuestion:
    """Something to be chosen from a list, or typed."""

    def __init__(self, title: str, call: Callable[[str], object], hint: str) -> None:
        self.title, self.call, self.hint = title, call, hint
        self.text = ""
        self.chosen = -1
        self.top = 0

    @property
    def options(self) -> list[tuple[str, str]]:
        """What is offered: what it is called, and what stands beside it."""
        return []

    def type(self, text: str) -> None:
        """Take letters."""
        self.text += "".join(char for char in text if char.isprintable())
        self.chosen, self.top = -1, 0

    def erase(self, *, word: bool = False) -> None:
        """Take the last letter back, or the last name of a path."""
        kept = self.text[:-1]
        if word:
            kept = kept[: max(kept.rfind("/"), kept.rfind("\\"), kept.rfind(" ")) + 1]
        self.text, self.chosen, self.top = kept, -1, 0

    def move(self, by: int) -> None:
        """Choose another line."""
        last = len(self.options) - 1
        self.chosen = min(max(self.chosen + by, -1 if last < 0 else 0), last)
        self.top = min(max(self.top, self.chosen - ROWS + 1), max(self.chosen, 0))

    def complete(self) -> None:
        """Take over what is chosen, or the first that is offered, into the text."""

    def accept(self) -> str | None:
        """Return what was chosen or typed; None where that was only a step."""
        return self.text.strip() or None


class Picker(ListQuestion):
    """One of some names, those that hold all words typed."""

    def __init__(self, title: str, names: Iterable[tuple[str, str]], call: Callable[[str], object]) -> None:
        super().__init__(title, call, "type to find · ↑ ↓ choose · Enter takes it · Esc closes")
        self._names = list(names)
        self.chosen = 0 if self._names else -1

    @property
    def options(self) -> list[tuple[str, str]]:
        """Those that match."""
        words = self.text.lower().split()
        return [each for each in self._names if all(word in " ".join(each).lower() for word in words)]

    def type(self, text: str) -> None:
        """Take letters; the first that matches is chosen."""
        super().type(text)
        self.chosen = 0 if self.options else -1

    def accept(self) -> str | None:
        """Return the name that is chosen."""
        return self.options[self.chosen][0] if 0 <= self.chosen < len(self.options) else None


class FileQuestion(ListQuestion):
    """A file, by its path: typed, completed with Tab, or chosen from the list."""

    def __init__(
        self,
        title: str,
        folder: Path,
        call: Callable[[str], object],
        suffixes: Sequence[str] = (),
        *,
        text: str = "",
        saves: bool = False,
    ) -> None:
        super().__init__(title, call, "Tab completes · ↑ ↓ choose · Enter takes it · Esc closes")
        self.folder, self.saves = folder, saves
        self.text = text
        self._suffixes = tuple(suffix.lower() for suffix in suffixes)
        self._listed: tuple[str, list[tuple[str, str]]] | None = None

    @property
    def options(self) -> list[tuple[str, str]]:
        """Folders and files that begin as the text does."""
        if self._listed is None or self._listed[0] != self.text:
            self._listed = self.text, self._found()
        return self._listed[1]

    def _parted(self) -> tuple[str, str]:
        at = self.text.rfind("/") + 1
        return self.text[:at], self.text[at:]

    def _found(self) -> list[tuple[str, str]]:
        head, begin = self._parted()
        place = self.folder / at_home(head)
        found: list[tuple[bool, str]] = []
        try:
            for entry in place.iterdir():
                hidden = entry.name.startswith(".") and not begin.startswith(".")
                if hidden or not entry.name.lower().startswith(begin.lower()):
                    continue
                folder = entry.is_dir()
                if folder or not self._suffixes or entry.suffix.lower() in self._suffixes:
                    found.append((not folder, entry.name))
                if len(found) >= MOST_LISTED:
                    break
        except (OSError, ValueError, RuntimeError):
            return []
        found.sort(key=lambda each: (each[0], each[1].lower()))
        up = [("..", "folder")] if not begin else []
        return up + [
            (name + ("" if is_file else "/"), "" if is_file else "folder") for is_file, name in found
        ]

    def complete(self) -> None:
        """Take over what is chosen, or what all that is offered begins with."""
        options = [name for name, _ in self.options if name != ".."]
        head, begin = self._parted()
        if 0 <= self.chosen < len(self.options):
            self._take(self.options[self.chosen][0])
        elif len(options) == 1:
            self._take(options[0])
        elif options:
            common = options[0]
            for name in options[1:]:
                while not name.lower().startswith(common.lower()):
                    common = common[:-1]
            if len(common) > len(begin):
                self.text = head + common
        self.chosen, self.top = -1, 0

    def _take(self, name: str) -> None:
        head, _ = self._parted()
        if name == "..":
            above = (self.folder / at_home(head)).resolve().parent.as_posix()
            self.text = above.rstrip("/") + "/"
        else:
            self.text = head + name

    def accept(self) -> str | None:
        """Return the path; a folder is only a step."""
        if 0 <= self.chosen < len(self.options):
            name = self.options[self.chosen][0]
            self._take(name)
            self.chosen, self.top = -1, 0
            if name == ".." or name.endswith("/"):
                return None
        if not self.text.strip():
            return None
        path = self.folder / at_home(self.text.strip())
        try:
            if path.is_dir():
                self.text = self.text.rstrip("/") + "/"
                return None
        except (OSError, ValueError):
            return self.text.strip()
        return str(path)


def at_home(text: str) -> Path:
    """Return a path, with what stands for a home folder written out where there is such a one."""
    try:
        return Path(text).expanduser()
    except RuntimeError:
        return Path(text)
