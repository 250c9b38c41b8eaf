"""Write maps as JSON documents and files."""

import json
import math
import re
from pathlib import Path
from typing import Any

from robocov.density import Density, Raster
from robocov.environment import Environment
from robocov.files.strictjson import require_json
from robocov.files.writing import replace_file
from robocov.mapfile.check import check_rules
from robocov.mapfile.models import HEAD, plain, validate
from robocov.mapfile.reading import from_json

_MAX_LINE_CHARACTERS = 100
"""Objects up to this length are written on one line, counting two characters for each number."""
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
_NUMERIC_KEYS = ("boundary", "obstacles", "starts", "density")
"""Keys of numbers that `dump_map` writes short."""
_DIGITS = 9
"""Digits after the point of a coordinate in metres that may be meant: nobody means parts of a nanometre."""
_NOISE = 16
"""Largest rounding error of a few sums and a rotation, in units of the last place (of 1 m at least)."""


def to_json(environment: Environment) -> dict[str, Any]:
    """Build the JSON document of a map, from which `from_json` builds an equal one.

    Parameters
    ----------
    environment : Environment

    Returns
    -------
    dict
    """
    density = environment.density
    return {
        **({} if environment.schema is None else {"$schema": environment.schema}),
        **HEAD,
        "name": environment.name,
        **({"description": environment.description} if environment.description else {}),
        "boundary": plain(environment.boundary),
        "obstacles": plain(environment.obstacles),
        "starts": {name: plain(spec) for name, spec in environment.starts.items()},
        **({} if density is None else {"density": _build_density_document(density)}),
        **({"extra": dict(environment.extra)} if environment.extra else {}),
    }


def save_map(environment: Environment, path: str | Path) -> None:
    """Save a map, whole or not at all.

    Parameters
    ----------
    environment : Environment
    path : str or Path

    Raises
    ------
    MapError
        If the map breaks a rule of map files.
    OutputError
        If the file cannot be written.
    """
    exact = to_json(environment)
    document = _shorten_numbers(exact)
    if document == exact and environment.density is None:
        # what is written is the map itself, whose free space may be known already
        require_json(document, str(path))
        validate(document, str(path))
        check_rules(environment, str(path))
    else:
        from_json(document, str(path))
    with replace_file(Path(path)) as part:
        part.write_bytes(dump_document(document).encode())


def dump_map(environment: Environment) -> str:
    """Return the text of a map file: keys in a fixed order, one list of vertices on a line.

    What is the result of a sum, as 0.30000000000000004, is written as the decimal that it misses by rounding
    errors alone, 0.3. What was written by hand stays as it is.
    """
    return dump_document(to_json(environment))


def dump_document(document: dict[str, Any]) -> str:
    """Return the text of a map file with this document, which may be a draft that no map can be made of.

    Line breaks do not depend on the lengths of numbers: a vertex that has moved changes one line of the file.
    """
    return _format_value(_shorten_numbers(document), "", 0, expanded=True) + "\n"


def _shorten_numbers(document: dict[str, Any]) -> dict[str, Any]:
    return document | {key: _shorten(document[key]) for key in _NUMERIC_KEYS if key in document}


def _shorten(value: Any) -> Any:
    """Return a JSON value with numbers as `dump_map` writes them."""
    if isinstance(value, float):
        decimal = round(value, _DIGITS)
        noise = _NOISE * math.ulp(max(abs(value), 1.0))
        return plain(decimal if abs(decimal - value) <= noise else value)
    if isinstance(value, list):
        return [_shorten(item) for item in value]
    if isinstance(value, dict):
        return {key: _shorten(item) for key, item in value.items()}
    return value


def _format_value(value: Any, indent: str, used: int, *, expanded: bool = False) -> str:
    """Return `value` on one line where it fits or is a list of points, else one item on a line."""
    whole = not isinstance(value, (dict, list)) or not value
    if whole or not expanded:
        line = json.dumps(value, ensure_ascii=False, allow_nan=False)
        points = isinstance(value, list) and all(isinstance(x, list) and not _is_ring(x) for x in value)
        if whole or points or used + len(_NUMBER.sub("00", line)) <= _MAX_LINE_CHARACTERS:
            return line
    inner = indent + "  "
    items = []
    for key, item in value.items() if isinstance(value, dict) else enumerate(value):
        head = f"{json.dumps(key, ensure_ascii=False)}: " if isinstance(value, dict) else ""
        # things stand on lines of their own, and so do the rows of a raster, which are no points
        rows = key == "rows" and isinstance(item, list) and len(item) > 1
        things = not indent and key in ("obstacles", "starts")
        items.append(
            inner + head + _format_value(item, inner, len(inner) + len(head), expanded=rows or things)
        )
    left, right = "[]" if isinstance(value, list) else "{}"
    return left + "\n" + ",\n".join(items) + f"\n{indent}{right}"


def _is_ring(value: object) -> bool:
    return isinstance(value, list) and bool(value) and isinstance(value[0], list) and len(value[0]) == 2


def _build_density_document(density: Density) -> Any:
    """Return a density as a JSON document that `_density` makes an equal one of; it names no picture."""
    if not isinstance(density, Raster):
        return plain(density)
    return {
        "kind": "raster",
        "extent": plain(density.extent),
        "interpolation": density.interpolation,
        "rows": plain(density.values[::-1].tolist()),
    }
