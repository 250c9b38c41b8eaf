"""Positions of keys and values in the text of JSON documents.

The JSON parser does not record positions, so that valid files are read fast. After an error, the text is
scanned along the path to the issue. A decoder skips all other values.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from itertools import count, islice

_WHITESPACE = re.compile(r"[ \t\n\r]*")
_LINE_END = re.compile(r"\r\n|\r|\n")
_STRING_OR_BRACKET = re.compile(r'"(?:[^"\\]|\\.)*"|[\[\]{}]', re.DOTALL)
"""A string, which may contain brackets, or a bracket outside strings."""

# Numbers may have any number of digits, because `len` replaces the conversion of digits to a value.
_SKIPPING_DECODER = json.JSONDecoder(parse_float=len, parse_int=len, parse_constant=len, strict=False)


def find_offset(text: str, path: Sequence[str | int], *, at_key: bool = False) -> int:
    """Find the start of a value in valid JSON.

    Parameters
    ----------
    text : str
        Text of the document.
    path : sequence of str and int
        Keys and indices that lead to the value. If an object has a key twice, the last value counts, as in
        Python's JSON decoder.
    at_key : bool
        Whether to find the start of the last key of the path, rather than of its value.

    Returns
    -------
    int
        Offset in the text. If the value is missing, the start of the innermost value on the path that exists.
    """
    value_offset = _skip_whitespace(text, 0)
    key_offset = value_offset
    for step in path:
        offsets = _find_member(text, value_offset, step)
        if offsets is None:
            return value_offset
        key_offset, value_offset = offsets
    return key_offset if at_key else value_offset


def _find_member(text: str, offset: int, step: str | int) -> tuple[int, int] | None:
    """Return the offsets of the key and the value of a member of an object or list; None if it is missing."""
    if text[offset] not in "{[":
        return None
    members = _iterate_members(text, offset)
    if isinstance(step, int):
        members = islice(members, step + 1)
    # An object may repeat a key. Its last value counts, as in Python's JSON decoder.
    offsets = None
    for key, key_offset, value_offset in members:
        if key == step:
            offsets = (key_offset, value_offset)
    return offsets


def _iterate_members(text: str, offset: int) -> Iterator[tuple[str | int, int, int]]:
    """Yield the key or index of each member of an object or list, and the offsets of its key and value."""
    is_object = text[offset] == "{"
    offset = _skip_whitespace(text, offset + 1)
    for index in count():
        if text[offset] in "]}":
            return
        key: str | int = index
        key_offset = offset
        if is_object:
            key, offset = _SKIPPING_DECODER.raw_decode(text, offset)
            colon = _skip_whitespace(text, offset)
            offset = _skip_whitespace(text, colon + 1)
        yield key, key_offset, offset
        _, end = _SKIPPING_DECODER.raw_decode(text, offset)
        offset = _skip_whitespace(text, end)
        if text[offset] == ",":
            offset = _skip_whitespace(text, offset + 1)


def find_deep_nesting(text: str, max_depth: int) -> int:
    """Find the first bracket at which lists and objects are nested deeper than a limit.

    Parameters
    ----------
    text : str
        Text of a document, which need not be valid JSON.
    max_depth : int
        Allowed number of nested lists and objects.

    Returns
    -------
    int
        Offset of the bracket; the length of the text if there is no such bracket.
    """
    depth = 0
    for token in _STRING_OR_BRACKET.finditer(text):
        if token[0] in ("[", "{"):
            depth += 1
        elif token[0] in ("]", "}"):
            depth -= 1
        if depth > max_depth:
            return token.start()
    return len(text)


def find_line_and_column(text: str, offset: int) -> tuple[int, int]:
    r"""Find the line and the column of an offset.

    Parameters
    ----------
    text : str
        Text with line breaks of any kind.
    offset : int
        Index of a character in the text.

    Returns
    -------
    line, column : int
        Line and column of the character, both counted from 1.

    Examples
    --------
    >>> find_line_and_column("one\ntwo", 5)
    (2, 2)
    """
    line = 1
    line_start = 0
    for line_end in _LINE_END.finditer(text, 0, offset):
        line += 1
        line_start = line_end.end()
    return line, offset - line_start + 1


def _skip_whitespace(text: str, offset: int) -> int:
    whitespace = _WHITESPACE.match(text, offset)
    return offset if whitespace is None else whitespace.end()
