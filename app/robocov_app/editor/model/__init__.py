"""Editor model: sketches, their files, their problems. Knows no pygame."""

from typing import TypeVar

from robocov.errors import MapError

_Needed = TypeVar("_Needed")


def require(there: _Needed | None, words: str) -> _Needed:
    """Return what an edit needs; MapError with these words unless it is there, and true."""
    if not there:
        raise MapError(words)
    return there
