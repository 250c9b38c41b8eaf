"""The errors that robocov raises on purpose, and the words of their messages.

    RobocovError
    ├── InputError            what a user gave cannot be used (exit status 2)
    │   ├── MapError          a map file, with line, column and JSON path of the place
    │   ├── StartError        a start without room for the team
    │   └── ParameterError    a gain, a limit, a name of a controller
    └── OutputError           a result cannot be written (exit status 2)

Every message is one line and names the source (file or argument), the place in it,
the value found there and what was wanted.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from numbers import Integral, Real
from typing import Any, NamedTuple, TypeAlias, TypeGuard

JsonPath: TypeAlias = tuple[str | int, ...]
"""Keys and indices, from the whole document inwards."""
MOST_LISTED = 20
"""Mistakes of one document that are told of: to find the line of each takes as long as reading the file."""
_LONGEST_NAME = 60
"""Characters of a known name, or of a key, that are told."""


class RobocovError(Exception):
    """Base class of every error that robocov raises on purpose."""


class InputError(RobocovError):
    """Something that the user gave cannot be used."""


class Mistake(NamedTuple):
    """Something wrong in a JSON document, at a value, at one that is missing, or at the path's last key.

    `text` tells the place, the value found there and what was wanted; `line` and `column`, in characters from
    1, are None where there is no file.
    """

    path: JsonPath
    text: str
    at_key: bool = False
    line: int | None = None
    column: int | None = None

    @classmethod
    def at(cls, path: JsonPath, what: str, *, at_key: bool = False) -> Mistake:
        """Return the mistake that `what` is wrong at `path`."""
        return cls(path, f"{place(path)}: {what}" if path else what, at_key)

    def told(self, where: str) -> str:
        """Return its message; terminals make a link of ``mine.json:14:9: ...``, as of compilers'."""
        return f"{where}{'' if self.line is None else f':{self.line}:{self.column}'}: {self.text}"


class MapError(InputError):
    """A map cannot be used; the message names the file, the place in it, the value and what was wanted.

    `mistakes` are at places in the file, which messages call `where`; there are `unlisted` ones beside these.
    """

    mistakes: tuple[Mistake, ...] = ()
    unlisted: int = 0
    where: str = ""

    @classmethod
    def of(cls, where: str, mistakes: Sequence[Mistake], unlisted: int = 0) -> MapError:
        """Return the error of a document with at least one mistake, of which `MOST_LISTED` are kept."""
        others = len(mistakes) - 1 + unlisted
        error = cls(f"{mistakes[0].told(where)}{f' (and {others} more)' if others else ''}")
        error.mistakes, error.where = tuple(mistakes[:MOST_LISTED]), where
        error.unlisted = others + 1 - len(error.mistakes)
        return error

    @property
    def line(self) -> int | None:
        """Line of the first mistake."""
        return self.mistakes[0].line if self.mistakes else None

    @property
    def column(self) -> int | None:
        """Column of the first mistake."""
        return self.mistakes[0].column if self.mistakes else None


class StartError(InputError):
    """A start has no room for the team, or lies inside an obstacle."""


class ParameterError(InputError):
    """A gain, a limit of the team, or a name is out of range or unknown."""


class OutputError(RobocovError):
    """A result cannot be written: no permission, no space, a folder that is in use."""


def shown(value: object, limit: int = 60) -> str:
    """Return `value` as it is quoted in messages: its repr on one line, cut to `limit` characters."""
    return _cut(" ".join(repr(value).split()), limit)


def shown_json(value: object, limit: int = 60) -> str:
    """Return `value` as it is quoted in messages about JSON."""
    return _cut(json.dumps(value, default=repr), limit)


def one_line(text: object) -> str:
    """Return `text` as messages can hold it: without line breaks and other control characters."""
    return "".join(char if char.isprintable() else ascii(char)[1:-1] for char in str(text))


def reason(error: Exception) -> str:
    """Return why the system refused something, on one line."""
    return one_line((isinstance(error, OSError) and error.strerror) or error)


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
        step = _cut(step, _LONGEST_NAME)
        if step.replace("-", "_").replace("$", "_").isidentifier():
            text += f".{step}" if text else step
        else:
            text += f"[{json.dumps(step)}]"
    return text


def is_number(value: object, kind: type = Real) -> TypeGuard[Any]:
    """Return whether `value` is a number of some kind, also one of numpy's; a bool is none."""
    return isinstance(value, kind) and not isinstance(value, bool)


def checked(
    name: str, value: Any, least: float, most: float, unit: str = "", *, whole: bool = False
) -> float:
    """Return a number in its range; raise ParameterError when it is none, or out of it."""
    if not is_number(value, Integral if whole else Real) or not least <= value <= most:
        wanted = f"a {'whole ' if whole else ''}number from {least:g} to {most:g} {unit}".rstrip()
        raise ParameterError(f"{name}: {shown(value)}, but {wanted} was wanted")
    return float(value)


def listed(names: Sequence[str]) -> str:
    """Return the first three of some names, and how many more there are.

    >>> listed(["a", "b"]), listed(["a", "b", "c", "d"])
    ('a, b', 'a, b, c and 1 more')
    """
    more = len(names) - 3
    return ", ".join(names[:3]) + (f" and {more} more" if more > 0 else "")


def counted(count: int, thing: str) -> str:
    """Return how many things there are, in words: 1 robot, 6 robots."""
    return f"{count} {thing}{'' if count == 1 else 's'}"


def unknown_name(kind: str, name: str, known: Iterable[str]) -> str:
    """Return the message for a name that is not among `known`, with the nearest one.

    >>> unknown_name("controller", "rapff", ["lloyd", "rapf", "rpf"])
    "unknown controller 'rapff': did you mean 'rapf'? (known: lloyd, rapf, rpf)"
    """
    names = sorted(known)
    near = get_close_matches(name.lower(), names, n=1, cutoff=0.5)
    hint = f": did you mean {shown(near[0])}?" if near else ""
    known_names = ", ".join(_cut(one_line(each), _LONGEST_NAME) for each in names)
    return f"unknown {kind} {shown(name)}{hint} (known: {known_names})"


def _cut(text: str, limit: int) -> str:
    return text if len(text) <= limit else f"{text[: limit - 3]}..."
