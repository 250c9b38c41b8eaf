"""One legend for several pictures."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Sequence
from typing import TypeVar

T = TypeVar("T")


def united(legends: Iterable[Sequence[T]], key: Callable[[T], Hashable]) -> list[T]:
    """Return the entries of all legends, each once.

    They stand in the first one's order; what only a later one has follows what precedes it there.
    """
    found: list[T] = []
    for legend in legends:
        keys = [key(entry) for entry in found]
        place = 0
        for entry in legend:
            name = key(entry)
            if name in keys:
                place = keys.index(name) + 1
            else:
                found.insert(place, entry)
                keys.insert(place, name)
                place += 1
    return found
