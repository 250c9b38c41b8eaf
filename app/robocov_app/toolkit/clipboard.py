"""Text on the system's clipboard, or within the program where the display has none."""

from contextlib import suppress

import pygame

_ours = ""


def get() -> str:
    with suppress(pygame.error, AttributeError):
        return (pygame.scrap.get_text() if pygame.scrap.has_text() else "") or _ours
    return _ours


def put(text: str) -> None:
    global _ours
    _ours = text
    with suppress(pygame.error, AttributeError):
        pygame.scrap.put_text(text)
