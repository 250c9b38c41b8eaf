"""Editor model: sketches, their files, their problems. Knows no pygame."""

from robocov.errors import MapError


def require(there: object, words: str) -> None:
    """Raise MapError with these words unless there is what an edit needs."""
    if not there:
        raise MapError(words)
