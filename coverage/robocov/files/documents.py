"""JSON files of robocov: their heads, and those that it wrote itself, read back through a model."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError, WrapValidator
from pydantic_core import PydanticCustomError

from robocov.files.mistakes import MOST_LISTED, Mistake, refusal
from robocov.files.strictjson import parse, read_bytes, shown_json

if TYPE_CHECKING:
    from pathlib import Path
    from typing import Any

    from pydantic import ValidatorFunctionWrapHandler
    from pydantic_core import ErrorDetails


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

    def checked(value: Any, handler: ValidatorFunctionWrapHandler) -> Any:
        try:
            return handler(value)
        except ValidationError:
            raise PydanticCustomError("wanted", words) from None

    return WrapValidator(checked)


def read_document(path: Path, kind: type[Kind], form: str, version: int) -> Kind:
    """Return the content of a JSON file that robocov wrote.

    Parameters
    ----------
    path : Path
    kind : type of Document
    form, version : str, int
        What its ``format`` and ``version`` are to be.

    Raises
    ------
    MapError
        One line: the file, the JSON path, the value and what was wanted.
    """
    where = str(path)
    document = parse(read_bytes(path), where)
    check_header(document, where, form, version)
    try:
        return kind.model_validate(document)
    except ValidationError as error:
        details = error.errors(include_url=False, include_context=False)
        listed = [_mistake(detail) for detail in details[:MOST_LISTED]]
        raise refusal(where, listed, len(details) - len(listed)) from None


def check_header(document: object, where: str, form: str, version: int) -> None:
    """Refuse what is not of a format, or is of another version, before its content is looked at.

    Raises
    ------
    MapError
    """
    if not isinstance(document, dict):
        what = f"{shown_json(document)}, but a JSON object with {_article(form)} was wanted"
        raise refusal(where, [Mistake.at((), what)])
    for key, right in (("format", form), ("version", version)):
        found = document.get(key)
        if type(found) is type(right) and found == right:
            continue
        state = shown_json(found) if key in document else "missing"
        newer = type(found) is int and key == "version" and found > version
        advice = "; it was written by a newer robocov" if newer else ""
        raise refusal(where, [Mistake.at((key,), f"{state}, but {shown_json(right)} was wanted{advice}")])


def _article(form: str) -> str:
    return f"a {form.removeprefix('robocov-')}"


def _mistake(detail: ErrorDetails) -> Mistake:
    """Return one structural error: place, value, what was wanted."""
    path = tuple(step for step in detail["loc"] if step != "[key]")
    if detail["type"] == "missing":
        return Mistake.at(path, "missing")
    words = detail["msg"] if detail["type"] == "wanted" else _WANTED.get(detail["type"], "another value")
    return Mistake.at(path, f"{shown_json(detail['input'])}, but {words} was wanted")
