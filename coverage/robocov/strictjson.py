"""JSON as files should be: UTF-8, finite numbers, no key twice, no absurd depth; errors name the place."""

from __future__ import annotations

import json
import math
from collections import Counter
from typing import TYPE_CHECKING, Any

from robocov.errors import MapError, shown

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

MAX_BYTES = 50_000_000
"""Largest file that is read, in bytes."""

MAX_DEPTH = 32
"""Deepest nesting of lists and objects; a map's own needs 6."""

_MAX_DIGITS = 400
"""Whole numbers with more digits exceed every float."""


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
        When the text is not UTF-8 or not JSON (with line and column), or has a number that is
        not finite, a key twice in one object, or lists nested deeper than `MAX_DEPTH`
        (with the JSON path).
    """
    where = one_line(where)
    if len(text) > MAX_BYTES:
        raise MapError(f"{where}: larger than {MAX_BYTES // 1_000_000} MB, but a smaller file was wanted")
    if isinstance(text, bytes):
        try:
            text = text.decode("utf-8-sig")
        except UnicodeDecodeError as error:
            byte = f"byte 0x{text[error.start]:02x} at offset {error.start}"
            raise MapError(f"{where}: {byte}: not UTF-8, but JSON in UTF-8 was wanted") from None
    if not text.strip():
        raise MapError(f"{where}: empty, but JSON was wanted")
    try:
        value = json.loads(text, object_pairs_hook=_Object.of_pairs, parse_int=_whole_number)
    except json.JSONDecodeError as error:
        place = f"line {error.lineno}, column {error.colno}"
        found = shown(text[error.pos : error.pos + 12]) if error.pos < len(text) else "end of file"
        reason = error.msg[:1].lower() + error.msg[1:]
        raise MapError(f"{where}: {place}: {found}: not JSON: {reason}") from None
    except RecursionError:
        raise MapError(f"{where}: {_too_deep('')}") from None
    require_json(value, where)
    return value


def require_json(value: object, where: str) -> None:
    """Check that `value` is made of what JSON has: finite numbers, text, lists and objects.

    Raises
    ------
    MapError
        On anything else; the message names the JSON path.
    """
    if not isinstance(value, (dict, list, tuple)):
        _require_scalar(value, (), where)
        return
    stack: list[tuple[Any, tuple[str | int, ...]]] = [(value, ())]
    while stack:
        holder, path = stack.pop()
        if len(path) >= MAX_DEPTH:
            raise MapError(f"{where}: {_too_deep(place(path[:4]) + '...: ')}")
        if isinstance(holder, dict):
            problem = _object_problem(holder, path)
            if problem is not None:
                raise MapError(f"{where}: {problem}")
        inner = []
        for key, item in holder.items() if isinstance(holder, dict) else enumerate(holder):
            # most of a large file is numbers: no call, no path for each
            if type(item) is float and math.isfinite(item):
                continue
            if isinstance(item, (dict, list, tuple)):
                inner.append((item, (*path, key)))
            else:
                _require_scalar(item, (*path, key), where)
        stack += reversed(inner)


def _require_scalar(item: object, path: tuple[str | int, ...], where: str) -> None:
    at = f"{place(path)}: " if path else ""
    problem = None
    if isinstance(item, float):
        if not math.isfinite(item):
            problem = f"{item}, but a finite number was wanted"
    elif isinstance(item, str):
        if not _is_text(item):
            problem = f"{shown(item)}, but text that UTF-8 can hold was wanted"
    elif isinstance(item, int):
        if item.bit_length() > 1023:
            problem = f"{item.bit_length()} bits long, but a smaller number was wanted"
    elif item is not None:
        problem = f"{type(item).__name__}, but a JSON value was wanted"
    if problem is not None:
        raise MapError(f"{where}: {at}{problem}")


def place(path: Sequence[str | int]) -> str:
    """Return `path` as messages show it.

    >>> place(("obstacles", 2, "vertices", 0))
    'obstacles[2].vertices[0]'
    >>> place(("starts", "the lobby", "radius"))
    'starts["the lobby"].radius'
    """
    text = ""
    for step in path:
        if isinstance(step, int):
            text += f"[{step}]"
        elif step.isidentifier() or step.replace("-", "_").replace("$", "_").isidentifier():
            text += f".{step}" if text else step
        else:
            text += f"[{json.dumps(step, ensure_ascii=True)}]"
    return text


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


def _object_problem(item: dict[Any, Any], path: tuple[str | int, ...]) -> str | None:
    """Return what is wrong with the keys of an object, if anything is."""
    for key in item:
        if not isinstance(key, str) or not _is_text(key):
            at = f"{place(path)}: " if path else ""
            return f"{at}key {shown(key)}, but text that UTF-8 can hold was wanted"
    twice = item.twice if isinstance(item, _Object) else None
    return None if twice is None else f"{place((*path, twice))}: given twice, but once was wanted"


def _too_deep(prefix: str) -> str:
    return f"{prefix}nested too deeply, but at most {MAX_DEPTH} levels were wanted"


def _is_text(text: str) -> bool:
    """Return whether `text` has no half of a surrogate pair, which JSON can escape but UTF-8 cannot hold."""
    return text.isascii() or not any("\ud800" <= char <= "\udfff" for char in text)


def _whole_number(digits: str) -> int | float:
    return int(digits) if len(digits) <= _MAX_DIGITS else float(digits)
