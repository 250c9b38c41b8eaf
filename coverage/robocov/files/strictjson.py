"""Strict reading of JSON and TOML: UTF-8, finite numbers, no duplicate keys, limited depth and size."""

from __future__ import annotations

import json
import math
import re
import tomllib
from codecs import BOM_UTF8
from collections import Counter
from pathlib import Path
from typing import Any

from robocov.errors import (
    InputError,
    Issue,
    JsonPath,
    MapError,
    describe_error,
    format_path,
    quote,
    to_one_line,
)
from robocov.files.json_positions import find_deep_nesting, find_line_and_column, find_offset

MAX_BYTES = 50_000_000
"""Maximum size of a JSON file."""
MAX_DEPTH = 32
"""Maximum depth of nested lists and objects. Maps need 6."""
MAX_TOML_BYTES = 4_000_000
"""Maximum size of a TOML file. Parsing a file of this size takes a second."""
_TOML_SEPARATOR = re.compile(rb"[=,\n]")
"""Characters that end a key in TOML. They may also occur in texts."""
_MAX_TOML_DOTS = 1000
"""Maximum number of dots between two separators."""
_TOO_DEEP = f"nested too deeply, expected at most {MAX_DEPTH} levels"
_MAX_DIGITS = 400
"""Maximum number of digits of an integer. Numbers with more digits are larger than any float."""
_MAX_BITS = 1023
"""Maximum number of bits of an integer, so that it can be converted to a float."""
_SYNTAX_EXCERPT_CHARACTERS = 12
"""Number of characters of the text that the message about a syntax error quotes."""
_WHITESPACE = " \t\n\r"
_VALUE_START = re.compile(r'["{\[0-9-]')
"""First character of a string, object, list or number in JSON."""


class _Object(dict[str, Any]):
    """A JSON object. `duplicate_key` is a key that it contains more than once, or None."""

    duplicate_key: str | None = None

    @classmethod
    def from_pairs(cls, pairs: list[tuple[str, Any]]) -> _Object:
        """Build an object from its members; `json.loads` calls this for each object."""
        values = cls(pairs)
        if len(values) < len(pairs):
            values.duplicate_key = Counter(key for key, _ in pairs).most_common(1)[0][0]
        return values


def read_bytes(path: Path) -> bytes:
    """Read a file of limited size.

    Parameters
    ----------
    path : Path
        File to read.

    Returns
    -------
    bytes
        Content of the file.

    Raises
    ------
    MapError
        If the file cannot be read, or is larger than `MAX_BYTES`.
    """
    source_name = to_one_line(path)
    try:
        with path.open("rb") as file:
            content = file.read(MAX_BYTES + 1)
    except FileNotFoundError:
        raise MapError(f"{source_name}: no such file") from None
    except IsADirectoryError:
        raise MapError(f"{source_name}: expected a file, got a folder") from None
    except (OSError, ValueError) as error:
        raise MapError(f"{source_name}: cannot be read: {describe_error(error)}") from None
    _require_size(content, source_name)
    return content


def parse_json(text: str | bytes, source_name: str) -> Any:
    """Parse the text of a JSON document.

    Parameters
    ----------
    text : str or bytes
        Text of the document. Bytes may start with a byte order mark.
    source_name : str
        Name of the source in messages, such as the path of the file.

    Returns
    -------
    object
        Content of the document, as nested dicts, lists, strings, numbers, booleans and None.

    Raises
    ------
    MapError
        If the text is not UTF-8 or not JSON, contains a number that is not finite or duplicate keys in an
        object, or is too large or nested too deeply. The message contains the line and the column.

    Examples
    --------
    >>> parse_json('{"a": [1, 2.5]}', "a.json")
    {'a': [1, 2.5]}
    >>> parse_json("[1,]", "a.json")
    Traceback (most recent call last):
    robocov.errors.MapError: a.json:1:3: ',]': not JSON: a comma without a value after it
    """
    source_name = to_one_line(source_name)
    _require_size(text, source_name)
    text = _decode(text, source_name)
    if not text.strip():
        raise MapError(f"{source_name}: expected JSON, got an empty file")
    try:
        value = json.loads(text, object_pairs_hook=_Object.from_pairs, parse_int=_parse_integer)
    except json.JSONDecodeError as error:
        syntax_issue = Issue((), _describe_syntax_error(text, error))
        issue = _locate(syntax_issue, text, _find_error_offset(text, error))
        raise MapError.from_issues(source_name, [issue]) from None
    except RecursionError:
        issue = _locate(Issue((), _TOO_DEEP), text, find_deep_nesting(text, MAX_DEPTH))
        raise MapError.from_issues(source_name, [issue]) from None
    try:
        require_json(value, source_name)
    except MapError as error:
        raise locate_issues(error, text, source_name) from None
    return value


def parse_toml(content: bytes, source_name: str) -> dict[str, Any]:
    """Parse the content of a TOML file.

    Parameters
    ----------
    content : bytes
        Text of the document in UTF-8, at most `MAX_TOML_BYTES`.
    source_name : str
        Name of the source in messages, such as the path of the file.

    Returns
    -------
    dict
        Content of the document.

    Raises
    ------
    InputError
        If the content is not TOML or too large, or its tables are nested deeper than `MAX_DEPTH`.
    """
    if len(content) > MAX_TOML_BYTES:
        max_megabytes = MAX_TOML_BYTES // 1_000_000
        raise InputError(f"{source_name}: expected at most {max_megabytes} MB of TOML, got more")
    # The parser takes seconds for keys with very many dots.
    if max(part.count(b".") for part in _TOML_SEPARATOR.split(content)) > _MAX_TOML_DOTS:
        raise InputError(f"{source_name}: {_TOO_DEEP}")
    try:
        document = tomllib.loads(content.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        raise InputError(f"{source_name}: byte at offset {error.start}: not UTF-8") from None
    except ValueError as error:
        # The content is not TOML, or contains an integer with too many digits for Python.
        text = to_one_line(error)
        raise InputError(f"{source_name}: not TOML: {text[:1].lower()}{text[1:]}") from None
    except RecursionError:
        raise InputError(f"{source_name}: {_TOO_DEEP}") from None
    if _is_nested_deeper(document, MAX_DEPTH):
        raise InputError(f"{source_name}: {_TOO_DEEP}")
    return document


def _is_nested_deeper(value: object, limit: int) -> bool:
    """Return whether lists and dicts are nested deeper than a limit."""
    # Recursion is avoided because the nesting may be deeper than Python's recursion limit.
    current_level: list[object] = [value]
    for _ in range(limit + 1):
        next_level: list[object] = []
        for item in current_level:
            if isinstance(item, dict):
                next_level += item.values()
            elif isinstance(item, list):
                next_level += item
        current_level = next_level
    return bool(current_level)


def locate_issues(error: MapError, text: str | bytes, source_name: str) -> MapError:
    """Return an error about a document with the lines and columns of its issues.

    Parameters
    ----------
    error : MapError
        Error whose issues have the paths of keys and values in the document.
    text : str or bytes
        Text from which the document was parsed.
    source_name : str
        Name of the source in messages, such as the path of the file.

    Returns
    -------
    MapError
        Error with the lines and columns. The same error if it has no issues, or they cannot be located.
    """
    if not error.issues:
        return error
    issues = []
    try:
        text = _decode(text, source_name)
        for issue in error.issues:
            offset = find_offset(text, issue.path, at_key=issue.at_key)
            issues.append(_locate(issue, text, offset))
    except RecursionError:  # Another part of the document is nested as deeply as parsing allows.
        return error
    return MapError.from_issues(to_one_line(source_name), issues, error.unlisted)


def _locate(issue: Issue, text: str, offset: int) -> Issue:
    """Return an issue with the line and the column of an offset in the text."""
    line, column = find_line_and_column(text, offset)
    return issue._replace(line=line, column=column)


def require_json(value: object, source_name: str) -> None:
    """Raise an error unless a value can be written as JSON.

    Parameters
    ----------
    value : object
        Value to check, with everything nested in it.
    source_name : str
        Name of the source in messages, such as the path of the file.

    Raises
    ------
    MapError
        If the value is nested too deeply, or contains anything other than dicts with keys of text, lists,
        tuples, strings, finite numbers, booleans and None.
    """
    issue = _find_first_issue(value, ())
    if issue is not None:
        raise MapError.from_issues(source_name, [issue])


def _find_first_issue(value: Any, path: JsonPath) -> Issue | None:
    """Return the first issue in a value and everything nested in it, or None if it is valid JSON."""
    if not isinstance(value, (dict, list, tuple)):
        message = _describe_invalid_scalar(value)
        return None if message is None else Issue.at_path(path, message)
    if len(path) >= MAX_DEPTH:
        return Issue(path, f"{format_path(path[:4])}...: {_TOO_DEEP}")
    items: Any = enumerate(value)
    if isinstance(value, dict):
        issue = _find_invalid_key(value, path)
        if issue is not None:
            return issue
        items = value.items()
    for key, item in items:
        # Most values in a large file are numbers. Skipping the call for numbers saves time.
        if type(item) is float and math.isfinite(item):
            continue
        issue = _find_first_issue(item, (*path, key))
        if issue is not None:
            return issue
    return None


def _find_invalid_key(value: dict[Any, Any], path: JsonPath) -> Issue | None:
    """Return the issue for the first key that is not valid text, or else for a duplicate key, if any."""
    for key in value:
        if not isinstance(key, str) or not _is_encodable(key):
            prefix = f"{format_path(path)}: " if path else ""
            text = f"{prefix}key: expected text that UTF-8 can encode, got {quote(key)}"
            return Issue((*path, key), text, at_key=True)
    if isinstance(value, _Object) and value.duplicate_key is not None:
        return Issue.at_path((*path, value.duplicate_key), "duplicate key", at_key=True)
    return None


def _describe_invalid_scalar(item: object) -> str | None:
    """Describe why a value that is neither a list nor an object is not JSON; return None if it is."""
    if isinstance(item, float):
        return None if math.isfinite(item) else f"expected a finite number, got {item}"
    if isinstance(item, str):
        return None if _is_encodable(item) else f"expected text that UTF-8 can encode, got {quote(item)}"
    if isinstance(item, int):
        bits = item.bit_length()
        return None if bits <= _MAX_BITS else f"expected a number of at most {_MAX_BITS} bits, got {bits}"
    return None if item is None else f"expected a JSON value, got {type(item).__name__}"


def _require_size(content: str | bytes, source_name: str) -> None:
    if len(content) > MAX_BYTES:
        raise MapError(f"{source_name}: expected at most {MAX_BYTES // 1_000_000} MB, got more")


def _decode(text: str | bytes, source_name: str) -> str:
    """Decode UTF-8, with or without a byte order mark; return a str unchanged."""
    if isinstance(text, str):
        return text
    body = text.removeprefix(BOM_UTF8)
    try:
        return body.decode("utf-8")
    except UnicodeDecodeError as error:
        valid_text = body[: error.start].decode("utf-8")
        offset = error.start + len(text) - len(body)
        issue = Issue((), f"byte 0x{body[error.start]:02x} at offset {offset}: not UTF-8")
        raise MapError.from_issues(source_name, [_locate(issue, valid_text, len(valid_text))]) from None


def _find_error_offset(text: str, error: json.JSONDecodeError) -> int:
    """Return the offset of a syntax error, which is the same for all versions of Python."""
    before = text[: error.pos].rstrip(_WHITESPACE)
    if text[error.pos : error.pos + 1] in ("}", "]") and before.endswith(","):
        return len(before) - 1  # Later versions report the comma itself.
    if _is_comma_missing(text, error):
        return len(before)
    return error.pos


def _is_comma_missing(text: str, error: json.JSONDecodeError) -> bool:
    """Return whether a value follows another one without a comma."""
    return error.msg == "Expecting ',' delimiter" and _VALUE_START.match(text, error.pos) is not None


def _describe_syntax_error(text: str, error: json.JSONDecodeError) -> str:
    """Describe why a text is not JSON, in words that are the same for all versions of Python."""
    offset = _find_error_offset(text, error)
    if _is_comma_missing(text, error):
        last_line = text[max(0, offset - _SYNTAX_EXCERPT_CHARACTERS) : offset].splitlines()[-1]
        return f"not JSON: expected ',' after {quote(last_line)}"
    excerpt = text[offset : offset + _SYNTAX_EXCERPT_CHARACTERS]
    quotation = quote(excerpt.splitlines()[0] or excerpt) if excerpt else "end of file"
    if excerpt[:1] == "," and text[offset + 1 :].lstrip(_WHITESPACE)[:1] in ("}", "]"):
        reason = "a comma without a value after it"
    elif excerpt.startswith(("//", "/*", "#")):
        reason = "JSON has no comments"
    elif excerpt.startswith("'"):
        reason = "strings need double quotes"
    else:
        reason = error.msg[:1].lower() + error.msg[1:]
    return f"{quotation}: not JSON: {reason}"


def _is_encodable(text: str) -> bool:
    """Return whether UTF-8 can encode a text: JSON can also contain unpaired surrogates, as escapes."""
    return text.isascii() or not any("\ud800" <= character <= "\udfff" for character in text)


def _parse_integer(digits: str) -> int | float:
    """Parse an integer; return an infinite float if it has too many digits."""
    return int(digits) if len(digits) <= _MAX_DIGITS else float(digits)
