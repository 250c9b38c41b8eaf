"""Parsing the values of a study, with errors that begin with the path, as in ``gains.rapf.k_rep[1]: ...``."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

from robocov.errors import JsonPath, ParameterError, format_path, quote

T = TypeVar("T")


def validate_at(path: JsonPath, validate: Callable[[], T]) -> T:
    """Validate a value, and report errors with the path of the value.

    Parameters
    ----------
    path : tuple of str and int
        Path of the value in the study.
    validate : callable
        Returns the valid value, or raises ParameterError. The name before the first colon of its message is
        replaced by the path.

    Returns
    -------
    object
        The result of `validate`.

    Raises
    ------
    ParameterError
        If the value is invalid.
    """
    try:
        return validate()
    except ParameterError as error:
        description = str(error).partition(": ")[2]
        raise ParameterError(f"{format_path(path)}: {description}") from None


def parse_values(given: Any, path: JsonPath, parse: Callable[[Any, JsonPath], T]) -> list[T]:
    """Parse a single value or a list of values.

    Parameters
    ----------
    given : object
        A value, or a list of at least one value.
    path : tuple of str and int
        Path of the value or list in the study.
    parse : callable
        Called with each value and its path; returns the parsed value.

    Returns
    -------
    list
        The parsed values, as a list even if a single value is given.

    Raises
    ------
    ParameterError
        If the list is empty or contains a value twice.
    """
    if not isinstance(given, Sequence) or isinstance(given, str):
        return [parse(given, path)]
    values = [parse(value, (*path, index)) for index, value in enumerate(given)]
    if not values:
        raise ParameterError(f"{format_path(path)}: expected at least one value, got none")
    require_distinct(values, path)
    return values


def require_distinct(values: Sequence[object], path: JsonPath) -> None:
    """Raise ParameterError if a list contains a value twice.

    Parameters
    ----------
    values : sequence
        Hashable values, or dicts of them.
    path : tuple of str and int
        Path of the list.
    """
    first_indices: dict[object, int] = {}
    for index, value in enumerate(values):
        key = tuple(value.items()) if isinstance(value, Mapping) else value
        first_index = first_indices.setdefault(key, index)
        if first_index < index:
            location = format_path((*path, index))
            first_location = format_path((*path, first_index))
            raise ParameterError(
                f"{location}: duplicate value {quote(value)}, already given at {first_location}"
            )
