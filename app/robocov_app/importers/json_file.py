"""Foreign JSON: read with care, its coordinates checked, its mistakes told with line and column."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from robocov.errors import MapError, Mistake, one_line, shown_json
from robocov.files.strictjson import located, parse
from robocov_app.importers import limits

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from robocov.arrays import Array
    from robocov.errors import JsonPath as Steps

_BEFORE = b"\xef\xbb\xbf \t\r\n"


def begins_with(head: bytes, bracket: bytes) -> bool:
    """Return whether a file that begins with `head` begins with that bracket, spaces apart."""
    return head.lstrip(_BEFORE)[:1] == bracket


def read_json(path: Path) -> tuple[Any, bytes, str]:
    """Return what the JSON file at `path` holds, its content, and what messages call it.

    Raises
    ------
    MapError
        When it cannot be read, is too large, or is not JSON; see `robocov.files.strictjson.parse`.
    """
    where = one_line(path)
    content = limits.content(path, limits.MAX_TEXT_BYTES)
    # each point is a list of two or three: to count takes a moment, to parse minutes
    limits.require_vertices(max(content.count(b"["), content.count(b",") // 3), where)
    return parse(content, where), content, where


@contextmanager
def located_errors(content: bytes, where: str) -> Iterator[None]:
    """Give a context in which errors about the document in `content` get lines and columns."""
    try:
        yield
    except MapError as error:
        raise located(error, content, where) from None


def positions(value: Any, at: Steps, where: str, *, least: int, dimensions: tuple[int, int]) -> Array:
    """Return the points of a JSON list as (k, d); missing dimensions are nan.

    Parameters
    ----------
    value : JSON value
    at : path of keys and indices
        Where it is in the document.
    where : str
        What messages call the file.
    least : int
        So many points are wanted.
    dimensions : (least, most)
        So many numbers are wanted of each; d is the most that there are.

    Raises
    ------
    MapError
        When it is not such a list.
    """
    if not isinstance(value, list) or len(value) < least:
        points = "point" if least == 1 else "points"
        raise refused(where, at, value, f"a list of at least {least} {points} [x, y] was wanted")
    low, high = dimensions
    for k, point in enumerate(value):
        if not (isinstance(point, list) and low <= len(point) <= high and all(map(is_number, point))):
            raise refused(where, (*at, k), point, "a point [x, y] of finite numbers was wanted")
    wide = max(map(len, value), default=low)
    if min(map(len, value), default=low) < wide:
        value = [[*point, *[np.nan] * (wide - len(point))] for point in value]
    return np.array(value, dtype=float).reshape(-1, wide)


def is_number(value: object) -> bool:
    """Return whether a JSON value is a number, of a size that can be calculated with."""
    return type(value) in (int, float) and -1e100 < value < 1e100  # type: ignore[operator]


def refused(where: str, at: Steps, value: object, wanted: str) -> MapError:
    """Return the error of a value at a place: what is there, what was wanted."""
    return MapError.of(where, [Mistake.at(at, f"{shown_json(value)}, but {wanted}")])
