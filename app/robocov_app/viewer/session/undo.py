"""Undo and redo."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator


@dataclass(frozen=True)
class Edit:
    """Something that was done and can be taken back.

    Attributes
    ----------
    words : str
        What people call it.
    back, again : callable
        Take it back; do it again.
    of_map : bool
        It was done to the map, which stays when the run begins anew.
    """

    words: str
    back: Callable[[], object]
    again: Callable[[], object]
    of_map: bool = False


class Undo:
    """What was done, and what was taken back, newest last.

    Parameters
    ----------
    prepare : callable
        Called before something is taken back or done again.
    """

    def __init__(self, prepare: Callable[[], None] = lambda: None) -> None:
        self._prepare = prepare
        self._done: list[Edit] = []
        self._taken_back: list[Edit] = []
        self._held = 0

    def clear(self) -> None:
        """Forget all."""
        self._done, self._taken_back = [], []

    def keep_map(self) -> None:
        """Forget all but what was done to the map: the run begins anew, on the map as it is."""
        self._done = [edit for edit in self._done if edit.of_map]
        self._taken_back = [edit for edit in self._taken_back if edit.of_map]

    def add(self, edit: Edit) -> None:
        """Note what was just done; what had been taken back cannot be done again any more."""
        if self._held:
            return
        self._done.append(edit)
        self._taken_back = []

    def hold(self, action: Callable[[], object]) -> None:
        """Do something without noting it, as a part of undoing."""
        with self._holding():
            action()

    def undo(self) -> str | None:
        """Take back the newest edit; return what it was, None if there is none.

        If that is impossible now, the error passes through and the edit stays.
        """
        return self._turn(self._done, self._taken_back, "back")

    def redo(self) -> str | None:
        """Do again what was taken back last; return what it was, None if there is none."""
        return self._turn(self._taken_back, self._done, "again")

    @property
    def can_undo(self) -> bool:
        """Whether there is something to take back."""
        return bool(self._done)

    @property
    def can_redo(self) -> bool:
        """Whether there is something to do again."""
        return bool(self._taken_back)

    def _turn(self, source: list[Edit], target: list[Edit], name: str) -> str | None:
        if not source:
            return None
        edit = source[-1]
        self._prepare()
        with self._holding():
            getattr(edit, name)()
        source.pop()
        target.append(edit)
        return edit.words

    @contextmanager
    def _holding(self) -> Iterator[None]:
        self._held += 1
        try:
            yield
        finally:
            self._held -= 1
