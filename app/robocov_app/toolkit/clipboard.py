"""Text on the system's clipboard, or within the program where the display has none."""

import pygame

_ours = ""


def get() -> str:
    try:
        return (pygame.scrap.get_text() if pygame.scrap.has_text() else "") or _ours
    except (pygame.error, AttributeError):
        return _ours


def put(text: str) -> None:
    global _ours
    _ours = text
    try:
        pygame.scrap.put_text(text)
    except (pygame.error, AttributeError):
        return
