"""Caches for drawing: many small surfaces in bounded memory, or the latest value of one kind."""

from collections import OrderedDict
from collections.abc import Callable
from typing import Generic, ParamSpec, TypeVar

import pygame

Arguments = ParamSpec("Arguments")
_Value = TypeVar("_Value")


class CachedRenderer(Generic[Arguments]):
    """A function that renders surfaces and caches them.

    When the cache is full, the least recently used surfaces are dropped.

    Parameters
    ----------
    render : callable
        Renders a surface; its arguments must be hashable.
    max_bytes : int
        Maximum memory of all cached surfaces.

    Attributes
    ----------
    surfaces : OrderedDict
        The cached surfaces by their arguments, the least recently used first.
    """

    def __init__(self, render: Callable[Arguments, pygame.Surface], max_bytes: int) -> None:
        self.surfaces: OrderedDict[object, pygame.Surface] = OrderedDict()
        self._render = render
        self._max_bytes = max_bytes
        self._used_bytes = 0

    def __call__(self, *args: Arguments.args, **kwargs: Arguments.kwargs) -> pygame.Surface:
        """Return the surface for the given arguments, from the cache if possible."""
        key = (args, tuple(kwargs.items())) if kwargs else args
        cached = self.surfaces.get(key)
        if cached is not None:
            self.surfaces.move_to_end(key)
            return cached
        surface = self._render(*args, **kwargs)
        self._add(key, surface)
        return surface

    def _add(self, key: object, surface: pygame.Surface) -> None:
        """Cache a surface unless it is larger than the whole cache; drop others to make space."""
        size = _count_bytes(surface)
        if size > self._max_bytes:
            return
        self.surfaces[key] = surface
        self._used_bytes += size
        while self._used_bytes > self._max_bytes:
            _, dropped = self.surfaces.popitem(last=False)
            self._used_bytes -= _count_bytes(dropped)

    def cache_clear(self) -> None:
        """Drop all surfaces."""
        self.surfaces.clear()
        self._used_bytes = 0


def cache_surfaces(
    max_bytes: int,
) -> Callable[[Callable[Arguments, pygame.Surface]], CachedRenderer[Arguments]]:
    """Decorate a function so that the surfaces that it returns are cached.

    Memory is limited in bytes, not in surfaces, since a single magnified disc may take megabytes.

    Parameters
    ----------
    max_bytes : int
        Maximum memory of all cached surfaces.

    Returns
    -------
    callable
        The decorator.
    """
    return lambda render: CachedRenderer(render, max_bytes)


def _count_bytes(surface: pygame.Surface) -> int:
    return surface.get_pitch() * surface.get_height()


class LatestValue(Generic[_Value]):
    """A cache for one value, which is computed again when its source or its key changes."""

    def __init__(self) -> None:
        self._cached: tuple[object, object, _Value] | None = None

    def get_or_compute(self, source: object, key: object, compute: Callable[[], _Value]) -> _Value:
        """Return the cached value, or compute it if the source or the key has changed.

        Parameters
        ----------
        source : object
            Object that the value is computed from; compared by identity, since it may be large.
        key : object
            Further properties that the value depends on; compared by equality.
        compute : callable
            Returns the value.

        Returns
        -------
        object
        """
        if self._cached is None or self._cached[0] is not source or self._cached[1] != key:
            self._cached = (source, key, compute())
        return self._cached[2]
