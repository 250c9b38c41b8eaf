"""The errors that robocov raises on purpose.

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

from difflib import get_close_matches
from numbers import Integral, Real
from typing import TYPE_CHECKING, Any, TypeGuard

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from robocov.files.mistakes import Mistake


_LONGEST_KNOWN = 60
"""Names that are known are told up to so many characters."""


class RobocovError(Exception):
    """Base class of every error that robocov raises on purpose."""


class InputError(RobocovError):
    """Something that the user gave cannot be used."""


class MapError(InputError):
    """A map cannot be used; the message names the file, the place in it, the value and what was wanted.

    Attributes
    ----------
    mistakes : tuple of Mistake
        What is wrong in it, where that is more than a word about the file as a whole; the message tells
        of the first.
    unlisted : int
        How many there are beside these.
    where : str
        What the message calls the file.
    """

    mistakes: tuple[Mistake, ...] = ()
    unlisted: int = 0
    where: str = ""

    @property
    def line(self) -> int | None:
        """Line of the first mistake, counted from 1; None where there is no text."""
        return self.mistakes[0].line if self.mistakes else None

    @property
    def column(self) -> int | None:
        """Column of the first mistake, counted from 1; None where there is no text."""
        return self.mistakes[0].column if self.mistakes else None


class StartError(InputError):
    """A start has no room for the team, or lies inside an obstacle."""


class ParameterError(InputError):
    """A gain, a limit of the team, or a name is out of range or unknown."""


class OutputError(RobocovError):
    """A result cannot be written: no permission, no space, a folder that is in use."""


def shown(value: object, limit: int = 60) -> str:
    """Return `value` as it is quoted in messages: its repr on one line, cut to `limit` characters.

    >>> shown("x" * 100, limit=12)
    "'xxxxxxxx..."
    """
    text = " ".join(repr(value).split())
    return text if len(text) <= limit else text[: limit - 3] + "..."


def is_number(value: object, kind: type = Real) -> TypeGuard[Any]:
    """Return whether `value` is a number of some kind, also one of numpy's; a bool is none."""
    return isinstance(value, kind) and not isinstance(value, bool)


def checked(
    name: str, value: Any, least: float, most: float, unit: str = "", *, whole: bool = False
) -> float:
    """Return a number in its range.

    Raises
    ------
    ParameterError
        When it is none, or out of it.
    """
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
    """Return how many things there are, in words.

    >>> counted(1, "robot"), counted(6, "robot")
    ('1 robot', '6 robots')
    """
    return f"{count} {thing}{'' if count == 1 else 's'}"


def unknown_name(kind: str, name: str, known: Iterable[str]) -> str:
    """Return the message for a name that is not among `known`, with the nearest one.

    >>> unknown_name("controller", "rapff", ["lloyd", "rapf", "rpf"])
    "unknown controller 'rapff': did you mean 'rapf'? (known: lloyd, rapf, rpf)"
    """
    names = sorted(known)
    near = get_close_matches(name.lower(), names, n=1, cutoff=0.5)
    hint = f": did you mean {shown(near[0])}?" if near else ""
    return f"unknown {kind} {shown(name)}{hint} (known: {', '.join(map(_told, names))})"


def _told(name: str) -> str:
    """Return a known name for people: on one line, and not too long."""
    name = name if name.isprintable() else ascii(name)[1:-1]
    return name if len(name) <= _LONGEST_KNOWN else f"{name[: _LONGEST_KNOWN - 3]}..."
