"""JSON documents that robocov has written, which are checked against pydantic models of their content."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError, WrapValidator
from pydantic_core import ErrorDetails, PydanticCustomError

from robocov.errors import InputError, Issue, MapError, quote, quote_json
from robocov.files.strictjson import parse_json, read_bytes

_EXPECTED_ERROR = "expected"
"""Type of the pydantic error that `expect` raises. The message of the error describes the expected value."""
_EXPECTED_BY_ERROR_TYPE = {
    "string_type": "a string",
    "bool_type": "true or false",
    "list_type": "a list",
    "dict_type": "an object",
    "model_type": "an object",
}
"""Descriptions of the expected value for types of pydantic errors."""


class Document(BaseModel):
    """An object in a file of results. Known keys are checked strictly; unknown keys are accepted."""

    model_config = ConfigDict(extra="allow", strict=True)


DocumentType = TypeVar("DocumentType", bound=Document)


def expect(description: str) -> WrapValidator:
    """Build a validator that describes the expected value of a field in messages.

    Parameters
    ----------
    description : str
        The expected value, such as ``a number above 0 (s)``.

    Returns
    -------
    WrapValidator
        Annotation for the type of the field.
    """

    def validate(value: Any, handler: Callable[[Any], Any]) -> Any:
        try:
            return handler(value)
        except ValidationError:
            raise PydanticCustomError(_EXPECTED_ERROR, description) from None

    return WrapValidator(validate)


def read_document(path: Path, model: type[DocumentType], format_name: str, version: int) -> DocumentType:
    """Read a JSON file that robocov has written.

    Parameters
    ----------
    path : Path
        File to read.
    model : type
        Model of the content, a subclass of `Document`.
    format_name : str
        Expected value of the key ``format``.
    version : int
        Expected value of the key ``version``.

    Returns
    -------
    Document
        An instance of the model.

    Raises
    ------
    MapError
        If the file cannot be read, or is not a document of this format.
    """
    source_name = str(path)
    document = parse_json(read_bytes(path), source_name)
    check_header(document, source_name, format_name, version)
    return validate_document(document, source_name, model)


def read_json_object(path: Path) -> dict[str, Any]:
    """Read a JSON file that contains an object, without a check of its keys.

    Parameters
    ----------
    path : Path
        File to read.

    Returns
    -------
    dict

    Raises
    ------
    InputError
        If the file cannot be read, or contains another value.
    """
    try:
        content = json.loads(path.read_bytes())
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"{path}: cannot be read: {error}") from error
    if not isinstance(content, dict):
        raise InputError(f"{path}: expected a JSON object, got {quote(content)}")
    return content


def validate_document(document: object, source_name: str, model: type[DocumentType]) -> DocumentType:
    """Check a JSON document against its model.

    Parameters
    ----------
    document : object
        Parsed content of a JSON file.
    source_name : str
        Name of the source in messages, such as the path of the file.
    model : type
        Model of the content, a subclass of `Document`.

    Returns
    -------
    Document
        An instance of the model.

    Raises
    ------
    MapError
        If the document does not fit the model.
    """
    try:
        return model.model_validate(document)
    except ValidationError as error:
        raise build_document_error(error, source_name, _build_issue) from None


def check_header(document: object, source_name: str, format_name: str, version: int) -> None:
    """Check the format and the version of a document.

    Parameters
    ----------
    document : object
        Parsed content of a JSON file.
    source_name : str
        Name of the source in messages, such as the path of the file.
    format_name : str
        Expected value of the key ``format``.
    version : int
        Expected value of the key ``version``.

    Raises
    ------
    MapError
        If the document is not an object, or has a different format or version.
    """
    if not isinstance(document, dict):
        expected = f"a JSON object with a {format_name.removeprefix('robocov-')}"
        issue = Issue((), f"expected {expected}, got {quote_json(document)}")
        raise MapError.from_issues(source_name, [issue])
    for key, expected_value in (("format", format_name), ("version", version)):
        value = document.get(key)
        if type(value) is type(expected_value) and value == expected_value:
            continue
        message = describe_mismatch(quote_json(expected_value), value, is_missing=key not in document)
        if key == "version" and type(value) is int and value > version:
            message += "; it was written by a newer robocov"
        raise MapError.from_issues(source_name, [Issue.at_path((key,), message)])


def describe_mismatch(expected: str, value: object, *, is_missing: bool = False) -> str:
    """Describe how a JSON value differs from the expected one.

    Parameters
    ----------
    expected : str
        Description of the expected value.
    value : object
        The value in the document.
    is_missing : bool
        Whether the document has no such value.

    Returns
    -------
    str
        Message without the path of the value.

    Examples
    --------
    >>> describe_mismatch("a number", "abc"), describe_mismatch("a number", None, is_missing=True)
    ('expected a number, got "abc"', 'missing, expected a number')
    """
    return f"missing, expected {expected}" if is_missing else f"expected {expected}, got {quote_json(value)}"


def build_document_error(
    error: ValidationError, source_name: str, build_issue: Callable[[ErrorDetails], Issue]
) -> MapError:
    """Build the error for a document that does not fit its model.

    Parameters
    ----------
    error : ValidationError
        Error of pydantic, with details of all issues.
    source_name : str
        Name of the source in messages, such as the path of the file.
    build_issue : callable
        Converts the details of one issue to an `Issue`.

    Returns
    -------
    MapError
        Error with the first few issues, and the number of the others.
    """
    details = error.errors(include_url=False, include_context=False)
    # If a required key is misspelled, pydantic reports a missing key and an unknown one. The unknown key is
    # listed first, because its message is more helpful.
    details.sort(key=lambda detail: detail["type"] != "extra_forbidden")
    issues = [build_issue(detail) for detail in details[: MapError.MAX_LISTED]]
    return MapError.from_issues(source_name, issues, len(details) - len(issues))


def _build_issue(detail: ErrorDetails) -> Issue:
    """Convert the details of one issue in a `Document`."""
    path = tuple(step for step in detail["loc"] if step != "[key]")
    if detail["type"] == "missing":
        return Issue.at_path(path, "missing")
    if detail["type"] == "extra_forbidden":
        return Issue.at_path(path, "unknown key", at_key=True)
    if detail["type"] == _EXPECTED_ERROR:
        expected = detail["msg"]
    else:
        expected = _EXPECTED_BY_ERROR_TYPE.get(detail["type"], "another value")
    return Issue.at_path(path, describe_mismatch(expected, detail["input"]))
