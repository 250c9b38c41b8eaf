"""The window on the screen, and a loop that nothing holds up."""

from __future__ import annotations

import gc
import warnings
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

import pygame

from robocov_app.render.fonts import label
from robocov_app.viewer.layout import SMALLEST

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


def show_compiling(size: tuple[int, int]) -> None:
    """Say on the window, or on a new one of a size, why nothing else is there yet."""
    with suppress(pygame.error):
        pygame.display.init()
        screen = pygame.display.get_surface() or shown(size)
        screen.fill("white")
        words = label("compiling the simulation, once", 18, (60, 60, 60))
        screen.blit(words, words.get_rect(center=screen.get_rect().center))
        pygame.display.flip()
        pygame.event.pump()


@contextmanager
def undisturbed() -> Iterator[None]:
    """Keep the garbage collector away from all that is there now, modules most of all.

    It would look at it again every half minute, which holds a frame up by 25 ms. What is new is looked at
    once a frame or so, not after every 700 coordinates.
    """
    before = gc.get_threshold()
    gc.collect()
    gc.freeze()
    gc.set_threshold(50_000, *before[1:])
    try:
        yield
    finally:
        gc.set_threshold(*before)
        gc.unfreeze()
