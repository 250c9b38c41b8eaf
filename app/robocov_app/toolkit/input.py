"""Names of keys, events without control characters, and the state of the mouse that every window keeps."""

import math
from contextlib import suppress

import pygame

from robocov.text import remove_controls

KEY_REPEAT = (350, 40)  # milliseconds until a held key is pressed again, the first time and from then on
DOUBLE = 0.35  # seconds between the two clicks of a double click, at most
SLIP = 5.0  # pixels that a click may move
WHEEL = 1.15  # magnification of one notch of the wheel
OF_THE_MOUSE = (pygame.MOUSEBUTTONDOWN, pygame.MOUSEBUTTONUP, pygame.MOUSEMOTION, pygame.MOUSEWHEEL)


def clean_event(event: pygame.event.Event) -> pygame.event.Event | None:
    """Return an event without control characters in its text; None if nothing is left of that.

    The name of a dropped file may hold any character but NUL, and stays as it is otherwise.
    """
    if event.type in (pygame.TEXTINPUT, pygame.TEXTEDITING):
        text = remove_controls(event.text, single_line=True)
        if not text and event.text:
            return None
        return pygame.event.Event(event.type, {**event.dict, "text": text})
    if event.type == pygame.DROPFILE:
        return pygame.event.Event(event.type, {**event.dict, "file": str(event.file).replace("\0", "")})
    return event


def key_of(event: pygame.event.Event) -> str:
    """Return the name of a pressed key with its modifiers, as in ``ctrl+shift+z``."""
    name = pygame.key.name(event.key)
    name = name.strip("[]") or name  # those of the key pad stand in brackets
    ctrl = pygame.KMOD_CTRL | pygame.KMOD_META
    modifiers = {"ctrl": ctrl, "alt": pygame.KMOD_ALT, "shift": pygame.KMOD_SHIFT}
    return "+".join([*(held for held, mask in modifiers.items() if event.mod & mask), name])


def key_words(key: str) -> str:
    """Return a key as people write it: Ctrl Shift Z."""
    arrows = {"left": "←", "right": "→", "up": "↑", "down": "↓", "return": "Enter"}
    parts = [*key[:-1].split("+")[:-1], "+"] if key.endswith("++") or key == "+" else key.split("+")
    return " ".join(arrows.get(part, part[:1].upper() + part[1:]) for part in parts)


def wheel_notches(event: pygame.event.Event) -> float:
    """Return the number of notches that the wheel was turned by; touch pads turn it by fractions of one."""
    notches = float(getattr(event, "precise_y", event.y) or event.y)
    if not math.isfinite(notches):
        notches = float(event.y)
    return min(max(notches, -5.0), 5.0)


_cursor = pygame.SYSTEM_CURSOR_ARROW


def shown_cursor() -> int:
    """Return the shape that the cursor has, or would have if the display had one."""
    return _cursor


def show_cursor(shape: int) -> None:
    global _cursor
    if shape != _cursor:
        _cursor = shape
        with suppress(pygame.error):  # not every display has cursors
            pygame.mouse.set_cursor(shape)
