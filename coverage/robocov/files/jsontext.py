"""Where things are in the text of a JSON document: offsets of values and keys, lines and columns.

Parsing forgets where values were, so that valid files cost nothing; after an error the text is
walked again along the path to the place, and what lies beside that path is skipped by the parser.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence

_SPACE = re.compile(r"[ \t\n\r]*")
_BREAK = re.compile(r"\r\n|\r|\n")
_BRACKET = re.compile(r'"(?:[^"\\]|\\.)*"|[\[\]{}]', re.DOTALL)

# numbers may be of any length here: nobody asks for their values
_skipping = json.JSONDecoder(parse_float=len, parse_int=len, parse_constant=len, strict=False)


def offset_of(text: str, path: Sequence[str | int], *, at_key: bool = False) -> int:
    """Return where the value at `path` begins in valid JSON; of what is missing, where its holder does.

    Parameters
    ----------
    text : str
    path : sequence of str and int
    at_key : bool
        Return where the last key of the path begins instead. Of a key that is given more than once
        the last one counts, as in parsing.

    Examples
    --------
    >>> offset_of('{"a": [1, 2]}', ("a", 1))
    10
    """
    at = _after_space(text, 0)
    for depth, step in enumerate(path):
        key, value = _object_member(text, at, step) if isinstance(step, str) else _list_item(text, at, step)
        if value is None:
            return at
        at = key if at_key and depth == len(path) - 1 else value
    return at


def line_and_column(text: str, offset: int) -> tuple[int, int]:
    r"""Return the line and the column of an offset, counted from 1; a column is a character.

    >>> line_and_column("one\r\ntwo", 6)
    (2, 2)
    """
    line, begin = 1, 0
    for end in _BREAK.finditer(text, 0, offset):
        line, begin = line + 1, end.end()
    return line, offset - begin + 1


def depth_offset(text: str, deepest: int) -> int:
    """Return where lists and objects are first nested deeper than `deepest`; the end where nowhere."""
    depth = 0
    for token in _BRACKET.finditer(text):
        depth += {"[": 1, "{": 1, "]": -1, "}": -1}.get(token[0], 0)
        if depth > deepest:
            return token.start()
    return len(text)


def _after_space(text: str, at: int) -> int:
    space = _SPACE.match(text, at)
    return at if space is None else space.end()


def _object_member(text: str, at: int, name: str) -> tuple[int, int | None]:
    """Return where the key and its value begin in the object that begins at an offset."""
    found: tuple[int, int | None] = (at, None)
    if text[at] != "{":
        return found
    at = _after_space(text, at + 1)
    while text[at] != "}":
        key_at = at
        key, at = _skipping.raw_decode(text, at)
        value_at = _after_space(text, _after_space(text, at) + 1)
        if key == name:
            found = key_at, value_at
        at = _next(text, value_at)
    return found


def _list_item(text: str, at: int, index: int) -> tuple[int, int | None]:
    """Return where an item of the list that begins at an offset begins; None when there is none."""
    if text[at] != "[":
        return at, None
    at = _after_space(text, at + 1)
    while index and text[at] != "]":
        at = _next(text, at)
        index -= 1
    return at, None if text[at] == "]" else at


def _next(text: str, at: int) -> int:
    """Return where the next member begins after the value at an offset, or where its holder ends."""
    _, at = _skipping.raw_decode(text, at)
    at = _after_space(text, at)
    return _after_space(text, at + 1) if text[at] == "," else at
