"""JSON files of robocov: their heads, and those that it wrote itself, read back through a model."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError, WrapValidator
from pydantic_core import ErrorDetails, PydanticCustomError

from robocov.errors import MOST_LISTED, MapError, Mistake, shown_json
from robocov.files.strictjson import parse, read_bytes


class Document(BaseModel):
    """An object in a file of results: strict about what it knows, and what else is there is kept unread."""

    model_config = ConfigDict(extra="allow", strict=True)


Kind = TypeVar("Kind", bound=Document)
_WANTED = {
    "string_type": "a text",
    "bool_type": "true or false",
    "list_type": "a list",
    "dict_type": "an object",
    "model_type": "an object",
}
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
        raise MapError.of(where, [Mistake((), f"{shown_json(document)}, but {kind} was wanted")])
    for key, right in (("format", form), ("version", version)):
        found = document.get(key)
        if type(found) is type(right) and found == right:
            continue
        state = shown_json(found) if key in document else "missing"
        newer = type(found) is int and key == "version" and found > version
        what = f"{state}, but {shown_json(right)} was wanted"
        what += "; it was written by a newer robocov" if newer else ""
        raise MapError.of(where, [Mistake.at((key,), what)])


def refused(error: ValidationError, where: str, mistake: Callable[[ErrorDetails], Mistake]) -> MapError:
    """Return the error of a document that is not like its model; `mistake` puts pydantic's in words."""
    details = error.errors(include_url=False, include_context=False)
    # a misspelt key is also a missing one: naming the key that is there helps more
    details.sort(key=lambda detail: detail["type"] != "extra_forbidden")
    listed = [mistake(detail) for detail in details[:MOST_LISTED]]
    return MapError.of(where, listed, len(details) - len(listed))


def _mistake(detail: ErrorDetails) -> Mistake:
    path = tuple(step for step in detail["loc"] if step != "[key]")
    if detail["type"] == "missing":
        return Mistake.at(path, "missing")
    words = detail["msg"] if detail["type"] == "wanted" else _WANTED.get(detail["type"], "another value")
    return Mistake.at(path, f"{shown_json(detail['input'])}, but {words} was wanted")
