"""The errors that robocov raises on purpose, and the words of their messages.

    RobocovError
    ├── InputError            what a user gave cannot be used (exit status 2)
    │   ├── MapError          a map file, with line, column and JSON path of the place
    │   ├── StartError        a start without room for the team
    │   └── ParameterError    a gain, a limit, a name of a controller
    ├── ControllerEndedError  a user's controller ended Python (exit status 1)
    └── OutputError           a result cannot be written (exit status 2)

Every message is one line and names the source (file or argument), the place in it,
the value found there and what was wanted.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from numbers import Integral, Real
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias, TypeGuard

from robocov.text import escape_controls

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

JsonPath: TypeAlias = tuple[str | int, ...]
"""Keys and indices, from the whole document inwards."""
_LONGEST = 60
"""Characters of a value or a name that are told."""


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
        return cls(path, f"{format_path(path)}: {what}" if path else what, at_key)

    def told(self, where: str) -> str:
        """Return its message, which begins as compilers' do, ``mine.json:14:9: ...``: terminals link that."""
        return f"{where}{'' if self.line is None else f':{self.line}:{self.column}'}: {self.text}"


class MapError(InputError):
    """A map cannot be used; the message names the file, the place in it, the value and what was wanted.

    `mistakes` are at places in the file, which messages call `where`, the first at `line` and `column`; there
    are `unlisted` ones beside these.
    """

    MOST_LISTED = 20  # to find the line of each takes as long as reading the file
    mistakes: tuple[Mistake, ...] = ()
    unlisted: int = 0
    where: str = ""
    line: int | None = None
    column: int | None = None

    @classmethod
    def of(cls, where: str, mistakes: Sequence[Mistake], unlisted: int = 0) -> MapError:
        """Return the error of a document with at least one mistake, of which `MOST_LISTED` are kept."""
        others = len(mistakes) - 1 + unlisted
        error = cls(f"{mistakes[0].told(where)}{f' (and {others} more)' if others else ''}")
        error.mistakes, error.where = tuple(mistakes[: cls.MOST_LISTED]), where
        error.unlisted = others + 1 - len(error.mistakes)
        error.line, error.column = mistakes[0].line, mistakes[0].column
        return error


class StartError(InputError):
    """A start has no room for the team, or lies inside an obstacle."""


class ParameterError(InputError):
    """A gain, a limit of the team, or a name is out of range or unknown."""


class ControllerEndedError(RobocovError):
    """A user's controller ended Python, tried to, or closed its output."""


class OutputError(RobocovError):
    """A result cannot be written: no permission, no space, a folder that is in use."""


def quote(value: object) -> str:
    """Return `value` as it is quoted in messages: its repr on one line, cut where it is long."""
    try:
        text = repr(value)
    except Exception:  # an object of a user may have no usable one
        text = f"<{type(value).__name__}>"
    return _cut(" ".join(text.split()))


def quote_json(value: object) -> str:
    """Return `value` as it is quoted in messages about JSON."""
    return _cut(json.dumps(value, default=repr))


def to_one_line(text: object) -> str:
    """Return `text` as one line of a message, with escapes for line breaks and other control characters."""
    return escape_controls(str(text), single_line=True)


def describe_error(error: Exception) -> str:
    """Return why the system refused something, on one line."""
    return to_one_line((isinstance(error, OSError) and error.strerror) or error)


def format_path(path: Sequence[str | int]) -> str:
    """Return `path` as messages show it; very long keys are cut.

    >>> format_path(("obstacles", 2, "the lobby", "radius"))
    'obstacles[2]["the lobby"].radius'
    """
    text = ""
    for step in path:
        name = step if isinstance(step, int) else _cut(step)
        if isinstance(name, str) and name.replace("-", "_").replace("$", "_").isidentifier():
            text += f".{name}" if text else name
        else:
            text += f"[{json.dumps(name)}]"
    return text


def is_number(value: object, kind: type = Real) -> TypeGuard[Any]:
    """Return whether `value` is a number of some kind, also one of numpy's; a bool is none."""
    return isinstance(value, kind) and not isinstance(value, bool)


def require_number(
    name: str, value: Any, least: float, most: float, unit: str = "", *, whole: bool = False
) -> float:
    """Return a number in its range; raise ParameterError when it is none, or out of it."""
    if not is_number(value, Integral if whole else Real) or not least <= value <= most:
        wanted = f"a {'whole ' if whole else ''}number from {least:g} to {most:g} {unit}".rstrip()
        raise ParameterError(f"{name}: {quote(value)}, but {wanted} was wanted")
    return float(value)


def to_floats(
    name: str, values: Any, wanted: str, kind: type[InputError] = ParameterError
) -> NDArray[np.float64]:
    """Return numbers as a new array of floats; raise an error of some kind where they are none.

    >>> to_floats("starts", "abc", "[x, y] of each robot")
    Traceback (most recent call last):
    robocov.errors.ParameterError: starts: 'abc', but [x, y] of each robot was wanted
    """
    import numpy as np  # not before there are numbers: `robocov bench` first asks for one thread

    try:
        return np.array(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise kind(f"{name}: {quote(values)}, but {wanted} was wanted") from None


def require_type(name: str, value: object, kind: type, wanted: str) -> None:
    """Raise a ParameterError unless a value is of a kind."""
    if not isinstance(value, kind):
        raise ParameterError(f"{name}: {quote(value)}, but {wanted} was wanted")


def summarize_names(names: Sequence[str]) -> str:
    """Return the first three of some names, and how many more there are: a, b, c and 1 more."""
    more = len(names) - 3
    return ", ".join(names[:3]) + (f" and {more} more" if more > 0 else "")


def format_count(count: int, thing: str) -> str:
    """Return how many things there are, in words: 1 robot, 6 robots."""
    return f"{count} {thing}{'' if count == 1 else 's'}"


def describe_unknown_name(kind: str, name: str, known: Iterable[str]) -> str:
    """Return the message for a name that is not among `known`, with the nearest one.

    >>> describe_unknown_name("controller", "rapff", ["lloyd", "rapf", "rpf"])
    "unknown controller 'rapff': did you mean 'rapf'? (known: lloyd, rapf, rpf)"
    """
    names = sorted(known)
    near = get_close_matches(name.lower(), names, n=1, cutoff=0.5)
    hint = f": did you mean {quote(near[0])}?" if near else ""
    return (
        f"unknown {kind} {quote(name)}{hint} (known: {', '.join(_cut(to_one_line(each)) for each in names)})"
    )


def _cut(text: str) -> str:
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3]}..."
