"""Caches: pictures as long as there is room, so many bytes, and what was made last."""

from collections import OrderedDict
from collections.abc import Callable
from typing import Generic, ParamSpec, TypeVar

import pygame

Arguments = ParamSpec("Arguments")
_Made = TypeVar("_Made")


class Kept(Generic[Arguments]):
    """A function that draws each picture once, and forgets those that were not used for the longest time."""

    def __init__(self, draw: Callable[Arguments, pygame.Surface], most_bytes: int) -> None:
        self._draw, self._most_bytes, self._taken = draw, most_bytes, 0
        self.pictures: OrderedDict[object, pygame.Surface] = OrderedDict()

    def __call__(self, *args: Arguments.args, **kwargs: Arguments.kwargs) -> pygame.Surface:
        key = (args, tuple(kwargs.items())) if kwargs else args
        if (picture := self.pictures.get(key)) is not None:
            self.pictures.move_to_end(key)
            return picture
        picture = self._draw(*args, **kwargs)
        if _bytes(picture) <= self._most_bytes:
            self.pictures[key] = picture
            self._taken += _bytes(picture)
            while self._taken > self._most_bytes:
                self._taken -= _bytes(self.pictures.popitem(last=False)[1])
        return picture

    def cache_clear(self) -> None:
        self.pictures.clear()
        self._taken = 0


def kept(most_bytes: int) -> Callable[[Callable[Arguments, pygame.Surface]], Kept[Arguments]]:
    """Let a function keep pictures of so many bytes together: magnified, a single disc takes megabytes."""
    return lambda draw: Kept(draw, most_bytes)


def _bytes(picture: pygame.Surface) -> int:
    return picture.get_pitch() * picture.get_height()


class Latest(Generic[_Made]):
    """Keeps what was made last."""

    def __init__(self) -> None:
        self._kept: tuple[object, object, _Made] | None = None

    def of(self, source: object, look: object, make: Callable[[], _Made]) -> _Made:
        """Return what `make` makes of a source, anew for another object, or a look that is not equal."""
        if self._kept is None or self._kept[0] is not source or self._kept[1] != look:
            self._kept = source, look, make()
        return self._kept[2]
