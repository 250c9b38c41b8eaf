"""What is wrong in a document: its place, what is there, what was wanted; one or many in one error."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

from robocov.errors import MapError

Path: TypeAlias = tuple[str | int, ...]
"""Keys and indices, from the whole document inwards."""

MOST_LISTED = 20
"""Mistakes of one document that are told of; the rest is counted. To find the line of each takes about as
long as reading the file again."""

_LONGEST_KEY = 60
"""Characters of a key that are told."""


@dataclass(frozen=True)
class Mistake:
    """Something wrong in a JSON document.

    Attributes
    ----------
    path : tuple of str and int
        To the value that is wrong, or that is missing; empty for the whole document.
    text : str
        The place as people read it, the value found there and what was wanted.
    at_key : bool
        The key at the end of the path is wrong, not its value.
    line, column : int or None
        Where that begins in the file, counted from 1, characters as columns; None where there is no file.
    """

    path: Path
    text: str
    at_key: bool = False
    line: int | None = None
    column: int | None = None

    @classmethod
    def at(cls, path: Path, what: str) -> Mistake:
        """Return the mistake whose text is the place of `path` and `what` is wrong there."""
        return cls(path, f"{place(path)}: {what}" if path else what)


def refusal(where: str, mistakes: Sequence[Mistake], unlisted: int = 0) -> MapError:
    """Return the error of a document with mistakes: one line with the first, and how many more there are.

    Where the line is known, it begins as compilers' messages do: ``mine.json:14:9: ...``. Terminals and
    editors make that a link.

    Parameters
    ----------
    where : str
        What messages call the document: a file's name.
    mistakes : sequence of Mistake
        At least one.
    unlisted : int
        How many there are beside them.
    """
    others = len(mistakes) - 1 + unlisted
    error = MapError(f"{told(where, mistakes[0])}{f' (and {others} more)' if others else ''}")
    error.mistakes, error.unlisted, error.where = tuple(mistakes), unlisted, where
    return error


def told(where: str, mistake: Mistake) -> str:
    """Return the line for one mistake."""
    at = where if mistake.line is None else f"{where}:{mistake.line}:{mistake.column}"
    return f"{at}: {mistake.text}"


def place(path: Sequence[str | int]) -> str:
    """Return `path` as messages show it; very long keys are cut.

    >>> place(("obstacles", 2, "vertices", 0))
    'obstacles[2].vertices[0]'
    >>> place(("starts", "the lobby", "radius"))
    'starts["the lobby"].radius'
    """
    text = ""
    for step in path:
        if isinstance(step, int):
            text += f"[{step}]"
            continue
        if len(step) > _LONGEST_KEY:
            step = f"{step[: _LONGEST_KEY - 3]}..."
        if step.isidentifier() or step.replace("-", "_").replace("$", "_").isidentifier():
            text += f".{step}" if text else step
        else:
            text += f"[{json.dumps(step, ensure_ascii=True)}]"
    return text
