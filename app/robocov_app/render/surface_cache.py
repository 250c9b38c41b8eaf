"""Caches: pictures as long as there is room, so many bytes, and what was made last."""

from collections import OrderedDict
from collections.abc import Callable
from functools import wraps
from typing import Generic, ParamSpec, TypeVar

import pygame

Arguments = ParamSpec("Arguments")
_Made = TypeVar("_Made")


def kept(
    most_bytes: int,
) -> Callable[[Callable[Arguments, pygame.Surface]], Callable[Arguments, pygame.Surface]]:
    """Let a function draw each picture once, and forget the least recently used beyond `most_bytes`.

    A count of pictures would not do: at a high magnification a single disc takes megabytes.

    >>> @kept(1000)
    ... def page(side):
    ...     return pygame.Surface((side, side), 0, 32)
    >>> page(9) is page(9), page(99) is page(99)
    (True, False)
    """

    def decorate(draw: Callable[Arguments, pygame.Surface]) -> Callable[Arguments, pygame.Surface]:
        pictures: OrderedDict[object, pygame.Surface] = OrderedDict()
        taken = 0

        @wraps(draw)
        def drawn(*args: Arguments.args, **kwargs: Arguments.kwargs) -> pygame.Surface:
            nonlocal taken
            key = (args, tuple(kwargs.items())) if kwargs else args
            picture = pictures.get(key)
            if picture is not None:
                pictures.move_to_end(key)
                return picture
            picture = draw(*args, **kwargs)
            size = _bytes(picture)
            if size <= most_bytes:
                pictures[key] = picture
                taken += size
                while taken > most_bytes:
                    taken -= _bytes(pictures.popitem(last=False)[1])
            return picture

        def cache_clear() -> None:
            nonlocal taken
            pictures.clear()
            taken = 0

        drawn.cache_clear = cache_clear  # type: ignore[attr-defined]
        drawn.pictures = pictures  # type: ignore[attr-defined]
        return drawn

    return decorate


def _bytes(picture: pygame.Surface) -> int:
    return picture.get_pitch() * picture.get_height()


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
