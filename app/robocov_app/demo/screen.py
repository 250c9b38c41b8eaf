"""The window on the screen, and a loop that nothing holds up."""

from __future__ import annotations

import gc
import warnings
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

import pygame

from robocov_app.demo.layout import SMALLEST

if TYPE_CHECKING:
    from collections.abc import Iterator


def shown(size: tuple[int, int]) -> pygame.Surface:
    """Show a window of a size, or give the one that is there another; return its surface."""
    screen = pygame.display.set_mode(size, pygame.RESIZABLE)
    with suppress(AttributeError, pygame.error), warnings.catch_warnings():
        # pygame-ce has no other way yet to give a window of the display module a least size
        warnings.simplefilter("ignore", DeprecationWarning)
        pygame.Window.from_display_module().minimum_size = SMALLEST
    return screen


@contextmanager
def undisturbed() -> Iterator[None]:
    """Keep the garbage collector away from all that is there now, modules most of all.

    It would look at it again every half minute, which holds a frame up by 25 ms.
    """
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()
