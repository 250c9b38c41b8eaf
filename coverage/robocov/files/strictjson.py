"""JSON as files should be: UTF-8, finite numbers, no key twice, no absurd depth; errors name the place.

TOML files are read as strictly, and those that robocov wrote itself through models, `Document`.

Parsing forgets where values were, so that valid files cost nothing; after an error the text is
walked again along the path to the place, and what lies beside that path is skipped by the parser.
"""

from __future__ import annotations

import json
import math
import re
import tomllib
from codecs import BOM_UTF8
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from itertools import count, islice
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError, WrapValidator
from pydantic_core import ErrorDetails, PydanticCustomError

from robocov.errors import (
    InputError,
    JsonPath,
    MapError,
    Mistake,
    describe_error,
    format_path,
    quote,
    quote_json,
    to_one_line,
)

MAX_BYTES = 50_000_000
MAX_DEPTH = 32
"""Deepest nesting of lists and objects; a map's own needs 6."""
MAX_TOML_BYTES = 4_000_000
"""Largest TOML file: a second is needed to parse one of this size."""
_TOML_PART = re.compile(rb"[=,\n]")
_MAX_DOTS = 1000
"""Dots in a key, or in a text without commas."""
_TOO_DEEP = f"nested too deeply, but at most {MAX_DEPTH} levels were wanted"
_MAX_DIGITS = 400
"""Whole numbers with more digits exceed every float."""
_MOST_BITS = 1023
"""Of a whole number that a float can stand for."""
_SPACE = re.compile(r"[ \t\n\r]*")
_BREAK = re.compile(r"\r\n|\r|\n")
_BRACKET = re.compile(r'"(?:[^"\\]|\\.)*"|[\[\]{}]', re.DOTALL)

# numbers may be of any length here: nobody asks for their values
_skipping = json.JSONDecoder(parse_float=len, parse_int=len, parse_constant=len, strict=False)


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
    """Return the content of a file; raise `MapError` when it cannot be read, or larger than `MAX_BYTES`."""
    where = to_one_line(path)
    try:
        with path.open("rb") as file:
            content = file.read(MAX_BYTES + 1)
    except FileNotFoundError:
        raise MapError(f"{where}: no such file") from None
    except IsADirectoryError:
        raise MapError(f"{where}: is a folder, but a file was wanted") from None
    except (OSError, ValueError) as error:
        raise MapError(f"{where}: cannot be read: {describe_error(error)}") from None
    _require_size(content, where)
    return content


def parse(text: str | bytes, where: str) -> Any:
    """Return the value that the JSON `text` stands for, which messages call `where`.

    Raises `MapError` with line and column when the text is not UTF-8 (a byte order mark may be) or not JSON,
    or has a number that is not finite, a key twice in one object, or lists nested deeper than `MAX_DEPTH`.
    """
    where = to_one_line(where)
    _require_size(text, where)
    text = _decoded(text, where)
    if not text.strip():
        raise MapError(f"{where}: empty, but JSON was wanted")
    try:
        value = json.loads(text, object_pairs_hook=_Object.of_pairs, parse_int=_whole_number)
    except json.JSONDecodeError as error:
        at, what = _syntax(text, error)
        raise MapError.from_mistakes(where, [_placed(Mistake((), what), text, at)]) from None
    except RecursionError:
        too_deep = _placed(Mistake((), _TOO_DEEP), text, depth_offset(text, MAX_DEPTH))
        raise MapError.from_mistakes(where, [too_deep]) from None
    try:
        require_json(value, where)
    except MapError as error:
        raise located(error, text, where) from None
    return value


def parse_toml(content: bytes, where: str) -> dict[str, Any]:
    """Return what a TOML file holds.

    Parameters
    ----------
    content : bytes
        At most `MAX_TOML_BYTES` of UTF-8.
    where : str
        What messages call the file.

    Raises
    ------
    InputError
        When the content is no TOML, too large, or has tables nested deeper than `MAX_DEPTH`.
    """
    if len(content) > MAX_TOML_BYTES:
        raise InputError(f"{where}: expected at most {MAX_TOML_BYTES // 1_000_000} MB of TOML, got more")
    # the parser takes seconds for a key of very many parts
    if max(part.count(b".") for part in _TOML_PART.split(content)) > _MAX_DOTS:
        raise InputError(f"{where}: nested too deeply, expected at most {MAX_DEPTH} levels")
    try:
        document = tomllib.loads(content.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        raise InputError(f"{where}: byte at offset {error.start}: not UTF-8, but TOML was wanted") from None
    except ValueError as error:  # of TOML, or of a whole number with thousands of digits
        text = to_one_line(error)
        raise InputError(f"{where}: not TOML: {text[:1].lower()}{text[1:]}") from None
    except RecursionError:
        raise InputError(f"{where}: nested too deeply, expected at most {MAX_DEPTH} levels") from None
    if _is_deeper_than(MAX_DEPTH, document):
        raise InputError(f"{where}: nested too deeply, expected at most {MAX_DEPTH} levels")
    return document


def _is_deeper_than(limit: int, value: object) -> bool:
    """Return whether lists and tables are nested deeper than a limit, however deep they are."""
    level: list[object] = [value]
    for _ in range(limit + 1):
        inner: list[object] = []
        for item in level:
            if isinstance(item, dict):
                inner += item.values()
            elif isinstance(item, list):
                inner += item
        level = inner
    return bool(level)


def located(error: MapError, text: str | bytes, where: str) -> MapError:
    """Return the error of a document with lines and columns in the text that was parsed."""
    if not error.mistakes:
        return error
    try:
        text = _decoded(text, where)
        found = [
            _placed(each, text, offset_of(text, each.path, at_key=each.at_key)) for each in error.mistakes
        ]
    except RecursionError:  # beside the place, something is nested as deep as parsing goes
        return error
    return MapError.from_mistakes(to_one_line(where), found, error.unlisted)


def require_json(value: object, where: str) -> None:
    """Raise `MapError` unless `value` is made of what JSON has: finite numbers, text, lists and objects."""
    if mistake := _first_mistake(value, ()):
        raise MapError.from_mistakes(where, [mistake])


def _first_mistake(value: Any, path: JsonPath) -> Mistake | None:
    if not isinstance(value, (dict, list, tuple)):
        what = _wrong(value)
        return None if what is None else Mistake.at_path(path, what)
    if len(path) >= MAX_DEPTH:
        return Mistake(path, f"{format_path(path[:4])}...: {_TOO_DEEP}")
    if isinstance(value, dict):
        for key in value:
            if not isinstance(key, str) or not _is_text(key):
                at = f"{format_path(path)}: " if path else ""
                text = f"{at}key {quote(key)}, but text that UTF-8 can hold was wanted"
                return Mistake((*path, key), text, at_key=True)
        if isinstance(value, _Object) and value.twice is not None:
            return Mistake.at_path((*path, value.twice), "given twice, but once was wanted", at_key=True)
    for key, item in value.items() if isinstance(value, dict) else enumerate(value):
        # most of a large file is numbers: no call, no path for each
        if not (type(item) is float and math.isfinite(item)):
            mistake = _first_mistake(item, (*path, key))
            if mistake is not None:
                return mistake
    return None


def _wrong(item: object) -> str | None:
    """Return what is wrong with a number, a text, or what JSON has not."""
    if isinstance(item, float):
        return None if math.isfinite(item) else f"{item}, but a finite number was wanted"
    if isinstance(item, str):
        return None if _is_text(item) else f"{quote(item)}, but text that UTF-8 can hold was wanted"
    if isinstance(item, int):
        bits = item.bit_length()
        return None if bits <= _MOST_BITS else f"{bits} bits long, but a smaller number was wanted"
    return None if item is None else f"{type(item).__name__}, but a JSON value was wanted"


def offset_of(text: str, path: Sequence[str | int], *, at_key: bool = False) -> int:
    """Return where the value at `path` begins in valid JSON; of what is missing, where its holder does.

    With `at_key`, where the last key begins. Of a key that is given twice the last counts, as in parsing.
    """
    key_at = at = _after_space(text, 0)
    for step in path:
        members = _members(text, at) if text[at] in "{[" else ()
        to_step = islice(members, step + 1 if isinstance(step, int) else None)
        found = [places for key, *places in to_step if key == step]
        if not found:
            return at
        key_at, at = found[-1]
    return key_at if at_key else at


def _members(text: str, at: int) -> Iterator[tuple[str | int, int, int]]:
    """Yield key or index of each member of an object or list, and where its key and its value begin."""
    named = text[at] == "{"
    at = _after_space(text, at + 1)
    for index in count():
        if text[at] in "]}":
            return
        key: str | int = index
        begin = at
        if named:
            key, at = _skipping.raw_decode(text, at)
            at = _after_space(text, _after_space(text, at) + 1)
        yield key, begin, at
        at = _after_space(text, _skipping.raw_decode(text, at)[1])
        if text[at] == ",":
            at = _after_space(text, at + 1)


def line_and_column(text: str, offset: int) -> tuple[int, int]:
    """Return the line and the column of an offset, counted from 1; a column is a character."""
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


def _placed(mistake: Mistake, text: str, offset: int) -> Mistake:
    line, column = line_and_column(text, offset)
    return mistake._replace(line=line, column=column)


def _require_size(content: str | bytes, where: str) -> None:
    if len(content) > MAX_BYTES:
        raise MapError(f"{where}: larger than {MAX_BYTES // 1_000_000} MB, but a smaller file was wanted")


def _decoded(text: str | bytes, where: str) -> str:
    if isinstance(text, str):
        return text
    body = text.removeprefix(BOM_UTF8)
    try:
        return body.decode("utf-8")
    except UnicodeDecodeError as error:
        before = body[: error.start].decode("utf-8")
        found = f"byte 0x{body[error.start]:02x} at offset {error.start + len(text) - len(body)}"
        what = f"{found}: not UTF-8, but JSON in UTF-8 was wanted"
        raise MapError.from_mistakes(where, [_placed(Mistake((), what), before, len(before))]) from None


def _syntax(text: str, error: json.JSONDecodeError) -> tuple[int, str]:
    """Return where text is no JSON, and why, in words that are the same in every version of Python."""
    at = error.pos
    before = text[:at].rstrip(" \t\n\r")
    if text[at : at + 1] in ("}", "]") and before.endswith(","):
        at = len(before) - 1  # later versions complain about the comma itself
    rest = text[at : at + 12]
    found = quote(rest.splitlines()[0] or rest) if rest else "end of file"
    if rest[:1] == "," and text[at + 1 :].lstrip(" \t\n\r")[:1] in ("}", "]"):
        why = "a comma that nothing follows"
    elif rest.startswith(("//", "/*", "#")):
        why = "JSON has no comments"
    elif rest.startswith("'"):
        why = "texts stand in double quotes"
    else:
        why = error.msg[:1].lower() + error.msg[1:]
    return at, f"{found}: not JSON: {why}"


def _is_text(text: str) -> bool:
    """Return whether `text` has no half of a surrogate pair, which JSON can escape but UTF-8 cannot hold."""
    return text.isascii() or not any("\ud800" <= char <= "\udfff" for char in text)


def _whole_number(digits: str) -> int | float:
    return int(digits) if len(digits) <= _MAX_DIGITS else float(digits)


class Document(BaseModel):
    """An object in a file of results: strict about what it knows, and what else is there is kept unread."""

    model_config = ConfigDict(extra="allow", strict=True)


Kind = TypeVar("Kind", bound=Document)
_WORDS = {"string_type": "a text", "bool_type": "true or false", "list_type": "a list"}
_WORDS |= dict.fromkeys(("dict_type", "model_type"), "an object")
"""Words for what was wanted, by the type of pydantic's error."""


def wanted(words: str) -> WrapValidator:
    """Return what makes messages about a field of a model say that `words` were wanted."""

    def checked(value: Any, handler: Callable[[Any], Any]) -> Any:
        try:
            return handler(value)
        except ValidationError:
            raise PydanticCustomError("wanted", words) from None

    return WrapValidator(checked)


def read_document(path: Path, kind: type[Kind], form: str, version: int) -> Kind:
    """Return the content of a JSON file that robocov wrote, of that ``format`` and ``version``."""
    where = str(path)
    document = parse(read_bytes(path), where)
    check_header(document, where, form, version)
    try:
        return kind.model_validate(document)
    except ValidationError as error:
        raise refused(error, where, _mistake) from None


def check_header(document: object, where: str, form: str, version: int) -> None:
    """Raise `MapError` on what is not of a format, or of another version, before its content is looked at."""
    if not isinstance(document, dict):
        kind = f"a JSON object with a {form.removeprefix('robocov-')}"
        raise MapError.from_mistakes(where, [Mistake((), f"{quote_json(document)}, but {kind} was wanted")])
    for key, right in (("format", form), ("version", version)):
        found = document.get(key)
        if type(found) is type(right) and found == right:
            continue
        state = quote_json(found) if key in document else "missing"
        newer = type(found) is int and key == "version" and found > version
        what = f"{state}, but {quote_json(right)} was wanted"
        what += "; it was written by a newer robocov" if newer else ""
        raise MapError.from_mistakes(where, [Mistake.at_path((key,), what)])


def refused(error: ValidationError, where: str, mistake: Callable[[ErrorDetails], Mistake]) -> MapError:
    """Return the error of a document that is not like its model; `mistake` puts pydantic's in words."""
    details = error.errors(include_url=False, include_context=False)
    # a misspelt key is also a missing one: naming the key that is there helps more
    details.sort(key=lambda detail: detail["type"] != "extra_forbidden")
    listed = [mistake(detail) for detail in details[: MapError.MAX_LISTED]]
    return MapError.from_mistakes(where, listed, len(details) - len(listed))


def _mistake(detail: ErrorDetails) -> Mistake:
    path = tuple(step for step in detail["loc"] if step != "[key]")
    if detail["type"] == "missing":
        return Mistake.at_path(path, "missing")
    words = detail["msg"] if detail["type"] == "wanted" else _WORDS.get(detail["type"], "another value")
    return Mistake.at_path(path, f"{quote_json(detail['input'])}, but {words} was wanted")
