"""Editor model: sketches, their files, their problems. Knows no pygame."""

from typing import TypeVar

from robocov.errors import MapError

_Value = TypeVar("_Value")


def require(value: _Value | None, message: str) -> _Value:
    """Return a value that an edit needs; raise MapError with a message if it is None, false or empty."""
    if not value:
        raise MapError(message)
    return value
