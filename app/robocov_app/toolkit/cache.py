"""A cache of one value: what is costly to make, kept until it is of something else."""

from collections.abc import Callable
from typing import Generic, TypeVar

_Made = TypeVar("_Made")


class Latest(Generic[_Made]):
    """Keeps what was made last.

    >>> page, size = Latest(), [1, 2]
    >>> page.of(size, "light", lambda: object()) is page.of(size, "light", lambda: object())
    True
    """

    def __init__(self) -> None:
        self._kept: tuple[object, object, _Made] | None = None

    def of(self, source: object, look: object, make: Callable[[], _Made]) -> _Made:
        """Return what `make` makes of a source, anew for another object, or a look that is not equal."""
        if self._kept is None or self._kept[0] is not source or self._kept[1] != look:
            self._kept = source, look, make()
        return self._kept[2]
