"""Model of the editor: sketches, their files and their problems. Independent of pygame."""

from typing import TypeVar

from robocov.errors import MapError

_Value = TypeVar("_Value")


def require(value: _Value | None, message: str) -> _Value:
    """Return a value unchanged; raise MapError with a message if it is None, false, zero or empty."""
    if not value:
        raise MapError(message)
    return value
