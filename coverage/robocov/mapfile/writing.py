"""Writing of maps as JSON documents, texts and files."""

import json
import math
import re
from pathlib import Path
from typing import Any

from robocov.density import Density, Raster
from robocov.environment import Environment
from robocov.files.strictjson import require_json
from robocov.files.writing import replace_file
from robocov.mapfile.models import HEADER, to_json_value
from robocov.mapfile.reading import from_json
from robocov.mapfile.rules import check_rules
from robocov.mapfile.structure import validate_document

_MAX_LINE_CHARACTERS = 100
"""Maximum length of an object that is written on one line. Each number counts as two characters."""
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
_NUMERIC_KEYS = ("boundary", "obstacles", "starts", "density")
"""Keys whose numbers `dump_map` shortens."""
_EXPANDED_KEYS = ("obstacles", "starts")
"""Keys whose items are each written on a separate line."""
_DECIMALS = 9
"""Decimal places to which numbers may be shortened, because smaller fractions of a meter have no meaning."""
_MAX_ERROR_ULPS = 16
"""Maximum rounding error after a few sums and a rotation, in units in the last place of the number (or of 1,
if the number is smaller). Shortening a number changes it by no more than this error."""


def to_json(environment: Environment) -> dict[str, Any]:
    """Build the JSON document of a map, from which `from_json` builds an equal map.

    Parameters
    ----------
    environment : Environment
        The map.

    Returns
    -------
    dict
        Content of the map file.
    """
    document: dict[str, Any] = {}
    if environment.schema is not None:
        document["$schema"] = environment.schema
    document.update(HEADER)
    document["name"] = environment.name
    if environment.description:
        document["description"] = environment.description
    document["boundary"] = to_json_value(environment.boundary)
    document["obstacles"] = to_json_value(environment.obstacles)
    document["starts"] = {name: to_json_value(start) for name, start in environment.starts.items()}
    if environment.density is not None:
        document["density"] = _build_density_document(environment.density)
    if environment.extra:
        document["extra"] = dict(environment.extra)
    return document


def save_map(environment: Environment, path: str | Path) -> None:
    """Save a map; the file is written completely or not at all.

    Parameters
    ----------
    environment : Environment
        The map to save.
    path : str or Path
        File to write, which usually ends in ``.json``.

    Raises
    ------
    MapError
        If the map breaks a rule of map files.
    OutputError
        If the file cannot be written.

    See Also
    --------
    load_map : Load a map by name or from a file.

    Examples
    --------
    >>> import tempfile
    >>> import robocov as rc
    >>> hall = rc.Environment("hall", ((0.0, 0.0), (10.0, 0.0), (10.0, 6.0), (0.0, 6.0)))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     rc.save_map(hall, f"{folder}/hall.json")
    ...     rc.load_map(f"{folder}/hall.json") == hall
    True
    """
    exact_document = to_json(environment)
    document = _shorten_numbers(exact_document)
    if document == exact_document and environment.density is None:
        # The file describes exactly this map, whose free space may already have been computed.
        require_json(document, str(path))
        validate_document(document, str(path))
        check_rules(environment, str(path))
    else:
        from_json(document, str(path))
    with replace_file(Path(path)) as temporary:
        temporary.write_bytes(dump_document(document).encode())


def dump_map(environment: Environment) -> str:
    """Format a map as the text of a map file.

    The keys are in a fixed order. Each list of points is on one line.

    Parameters
    ----------
    environment : Environment
        The map.

    Returns
    -------
    str
        Text of the file, with a line break at the end.

    Notes
    -----
    A number that differs from a short decimal only by rounding errors, such as 0.30000000000000004, is
    written as the decimal, 0.3.
    """
    return dump_document(to_json(environment))


def dump_document(document: dict[str, Any]) -> str:
    """Format a JSON document as the text of a map file.

    Line breaks do not depend on the number of digits, so that moving a vertex changes one line of the file.

    Parameters
    ----------
    document : dict
        A JSON document, which need not be a valid map.

    Returns
    -------
    str
        Text of the file, with a line break at the end.
    """
    return _format_members(_shorten_numbers(document), "", is_document=True) + "\n"


def _shorten_numbers(document: dict[str, Any]) -> dict[str, Any]:
    """Return a document with shortened numbers, except for numbers at the user's own keys."""
    return document | {key: _shorten_value(document[key]) for key in _NUMERIC_KEYS if key in document}


def _shorten_value(value: Any) -> Any:
    """Return a JSON value with its numbers rounded as in a map file."""
    if isinstance(value, float):
        decimal = round(value, _DECIMALS)
        max_error = _MAX_ERROR_ULPS * math.ulp(max(abs(value), 1.0))
        return to_json_value(decimal if abs(decimal - value) <= max_error else value)
    if isinstance(value, list):
        return [_shorten_value(item) for item in value]
    if isinstance(value, dict):
        return {key: _shorten_value(item) for key, item in value.items()}
    return value


def _format_members(value: Any, indent: str, *, is_document: bool = False) -> str:
    """Return a non-empty list or object with each member on a separate line."""
    inner_indent = indent + "  "
    if isinstance(value, list):
        items = [inner_indent + _format_value(item, inner_indent, len(inner_indent)) for item in value]
        return "[\n" + ",\n".join(items) + f"\n{indent}]"
    lines = []
    for key, item in value.items():
        head = f"{inner_indent}{json.dumps(key, ensure_ascii=False)}: "
        # Each row of a raster is on a separate line. Unlike points, rows are long.
        has_several_rows = key == "rows" and isinstance(item, list) and len(item) > 1
        if _is_container(item) and (has_several_rows or (is_document and key in _EXPANDED_KEYS)):
            lines.append(head + _format_members(item, inner_indent))
        else:
            lines.append(head + _format_value(item, inner_indent, len(head)))
    return "{\n" + ",\n".join(lines) + f"\n{indent}}}"


def _format_value(value: Any, indent: str, column: int) -> str:
    """Return a value on one line if the line is short or a list of points, and on several lines otherwise."""
    line = json.dumps(value, ensure_ascii=False, allow_nan=False)
    if not _is_container(value):
        return line
    is_point_list = isinstance(value, list) and all(
        isinstance(item, list) and not _is_ring(item) for item in value
    )
    # Each number counts as two characters, so that the layout does not depend on its digits.
    if is_point_list or column + len(_NUMBER.sub("00", line)) <= _MAX_LINE_CHARACTERS:
        return line
    return _format_members(value, indent)


def _is_container(value: object) -> bool:
    """Return whether a value is a list or object that is not empty."""
    return isinstance(value, (dict, list)) and bool(value)


def _is_ring(value: object) -> bool:
    """Return whether a value is a list whose first item is a point."""
    return isinstance(value, list) and bool(value) and isinstance(value[0], list) and len(value[0]) == 2


def _build_density_document(density: Density) -> Any:
    """Build the JSON document of a density, with rows of values even if it was loaded from an image."""
    if not isinstance(density, Raster):
        return to_json_value(density)
    return {
        "kind": "raster",
        "extent": to_json_value(density.extent),
        "interpolation": density.interpolation,
        "rows": to_json_value(density.values[::-1].tolist()),
    }
