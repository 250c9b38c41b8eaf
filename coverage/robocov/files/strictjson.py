"""JSON as files should be: UTF-8, finite numbers, no key twice, no absurd depth; errors name the place."""

from __future__ import annotations

import json
import math
from codecs import BOM_UTF8
from collections import Counter
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from robocov.errors import MapError, shown
from robocov.files.jsontext import depth_offset, line_and_column, offset_of
from robocov.files.mistakes import Mistake, refusal
from robocov.files.mistakes import place as place

if TYPE_CHECKING:
    from pathlib import Path

    from robocov.files.mistakes import Path as Steps

MAX_BYTES = 50_000_000
"""Largest file that is read, in bytes."""

MAX_DEPTH = 32
"""Deepest nesting of lists and objects; a map's own needs 6."""

_MAX_DIGITS = 400
"""Whole numbers with more digits exceed every float."""

_SPACE = " \t\n\r"


class _Object(dict[str, Any]):
    """A JSON object that remembers the first key that it was given twice."""

    twice: str | None = None

    @classmethod
    def of_pairs(cls, pairs: list[tuple[str, Any]]) -> _Object:
        values = cls(pairs)
        if len(values) < len(pairs):
            values.twice = Counter(key for key, _ in pairs).most_common(1)[0][0]
        return values


def read_bytes(path: Path) -> bytes:
    """Return the content of the file at `path`.

    Raises
    ------
    MapError
        When there is no such file, it cannot be read, or it is larger than `MAX_BYTES`.
    """
    where = one_line(path)
    try:
        with path.open("rb") as file:
            content = file.read(MAX_BYTES + 1)
    except FileNotFoundError:
        raise MapError(f"{where}: no such file") from None
    except IsADirectoryError:
        raise MapError(f"{where}: is a folder, but a file was wanted") from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise MapError(f"{where}: cannot be read: {one_line(reason)}") from None
    if len(content) > MAX_BYTES:
        raise MapError(f"{where}: larger than {MAX_BYTES // 1_000_000} MB, but a smaller file was wanted")
    return content


def parse(text: str | bytes, where: str) -> Any:
    """Return the value that the JSON `text` stands for.

    Parameters
    ----------
    text : str or bytes
        Bytes are read as UTF-8, with or without a byte order mark.
    where : str
        What messages call the text: a file's name.

    Raises
    ------
    MapError
        When the text is not UTF-8 or not JSON, or has a number that is not finite, a key twice in one
        object, or lists nested deeper than `MAX_DEPTH`; with line and column.
    """
    where = one_line(where)
    if len(text) > MAX_BYTES:
        raise MapError(f"{where}: larger than {MAX_BYTES // 1_000_000} MB, but a smaller file was wanted")
    text = _decoded(text, where)
    if not text.strip():
        raise MapError(f"{where}: empty, but JSON was wanted")
    try:
        value = json.loads(text, object_pairs_hook=_Object.of_pairs, parse_int=_whole_number)
    except json.JSONDecodeError as error:
        at, what = _syntax(text, error)
        raise refusal(where, [_placed(Mistake((), what), text, at)]) from None
    except RecursionError:
        too_deep = Mistake((), _too_deep(""))
        raise refusal(where, [_placed(too_deep, text, depth_offset(text, MAX_DEPTH))]) from None
    try:
        require_json(value, where)
    except MapError as error:
        raise located(error, text, where) from None
    return value


def located(error: MapError, text: str | bytes, where: str) -> MapError:
    """Return the error of a document with the lines and columns of its mistakes in the document's text.

    Parameters
    ----------
    error : MapError
        Comes back as it is when it tells of no place.
    text : str or bytes
        What `parse` has read.
    where : str
        What messages call the text.
    """
    if not error.mistakes:
        return error
    try:
        text = _decoded(text, where)
        found = [
            _placed(mistake, text, offset_of(text, mistake.path, at_key=mistake.at_key))
            for mistake in error.mistakes
        ]
    except RecursionError:  # beside the place, something is nested as deep as parsing goes
        return error
    return refusal(one_line(where), found, error.unlisted)


def require_json(value: object, where: str) -> None:
    """Check that `value` is made of what JSON has: finite numbers, text, lists and objects.

    Raises
    ------
    MapError
        On anything else; the message names the JSON path.
    """
    mistake = _first_mistake(value)
    if mistake is not None:
        raise refusal(where, [mistake])


def _first_mistake(value: object) -> Mistake | None:
    if not isinstance(value, (dict, list, tuple)):
        return _scalar_mistake(value, ())
    stack: list[tuple[Any, Steps]] = [(value, ())]
    while stack:
        holder, path = stack.pop()
        if len(path) >= MAX_DEPTH:
            return Mistake(path, _too_deep(place(path[:4]) + "...: "))
        if isinstance(holder, dict):
            mistake = _key_mistake(holder, path)
            if mistake is not None:
                return mistake
        inner = []
        for key, item in holder.items() if isinstance(holder, dict) else enumerate(holder):
            # most of a large file is numbers: no call, no path for each
            if type(item) is float and math.isfinite(item):
                continue
            if isinstance(item, (dict, list, tuple)):
                inner.append((item, (*path, key)))
            else:
                mistake = _scalar_mistake(item, (*path, key))
                if mistake is not None:
                    return mistake
        stack += reversed(inner)
    return None


def _scalar_mistake(item: object, path: Steps) -> Mistake | None:
    if isinstance(item, float):
        if not math.isfinite(item):
            return Mistake.at(path, f"{item}, but a finite number was wanted")
    elif isinstance(item, str):
        if not _is_text(item):
            return Mistake.at(path, f"{shown(item)}, but text that UTF-8 can hold was wanted")
    elif isinstance(item, int):
        if item.bit_length() > 1023:
            return Mistake.at(path, f"{item.bit_length()} bits long, but a smaller number was wanted")
    elif item is not None:
        return Mistake.at(path, f"{type(item).__name__}, but a JSON value was wanted")
    return None


def shown_json(value: object, limit: int = 60) -> str:
    """Return `value` as it is quoted in messages: as JSON, cut to `limit` characters.

    >>> shown_json([True, None, "x"])
    '[true, null, "x"]'
    """
    text = json.dumps(value, default=repr)
    return text if len(text) <= limit else text[: limit - 3] + "..."


def one_line(text: object) -> str:
    """Return `text` as messages can hold it: without line breaks and other control characters."""
    return "".join(char if char.isprintable() else ascii(char)[1:-1] for char in str(text))


def _key_mistake(item: dict[Any, Any], path: Steps) -> Mistake | None:
    """Return what is wrong with the keys of an object, if anything is."""
    for key in item:
        if not isinstance(key, str) or not _is_text(key):
            at = f"{place(path)}: " if path else ""
            text = f"{at}key {shown(key)}, but text that UTF-8 can hold was wanted"
            return Mistake((*path, key), text, at_key=True)
    twice = item.twice if isinstance(item, _Object) else None
    if twice is None:
        return None
    return replace(Mistake.at((*path, twice), "given twice, but once was wanted"), at_key=True)


def _too_deep(prefix: str) -> str:
    return f"{prefix}nested too deeply, but at most {MAX_DEPTH} levels were wanted"


def _decoded(text: str | bytes, where: str) -> str:
    if isinstance(text, str):
        return text
    body = text.removeprefix(BOM_UTF8)
    try:
        return body.decode("utf-8")
    except UnicodeDecodeError as error:
        before = body[: error.start].decode("utf-8")
        offset = error.start + len(text) - len(body)
        found = f"byte 0x{body[error.start]:02x} at offset {offset}"
        what = f"{found}: not UTF-8, but JSON in UTF-8 was wanted"
        raise refusal(where, [_placed(Mistake((), what), before, len(before))]) from None


def _placed(mistake: Mistake, text: str, offset: int) -> Mistake:
    line, column = line_and_column(text, offset)
    return replace(mistake, line=line, column=column)


def _syntax(text: str, error: json.JSONDecodeError) -> tuple[int, str]:
    """Return where text is no JSON, and why, in words that are the same in every version of Python."""
    at = error.pos
    before = text[:at].rstrip(_SPACE)
    if text[at : at + 1] in ("}", "]") and before.endswith(","):
        at = len(before) - 1  # later versions complain about the comma itself
    rest = text[at : at + 12]
    found = shown(rest.splitlines()[0] or rest) if rest else "end of file"
    if text[at : at + 1] == "," and text[at + 1 :].lstrip(_SPACE)[:1] in ("}", "]"):
        reason = "a comma that nothing follows"
    elif text[at : at + 2] in ("//", "/*") or text[at : at + 1] == "#":
        reason = "JSON has no comments"
    elif text[at : at + 1] == "'":
        reason = "texts stand in double quotes"
    else:
        reason = error.msg[:1].lower() + error.msg[1:]
    return at, f"{found}: not JSON: {reason}"


def _is_text(text: str) -> bool:
    """Return whether `text` has no half of a surrogate pair, which JSON can escape but UTF-8 cannot hold."""
    return text.isascii() or not any("\ud800" <= char <= "\udfff" for char in text)


def _whole_number(digits: str) -> int | float:
    return int(digits) if len(digits) <= _MAX_DIGITS else float(digits)
