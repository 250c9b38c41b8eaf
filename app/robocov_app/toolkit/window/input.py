"""Names of keys, cleaning of events, and notches of the mouse wheel."""

import math
from collections.abc import Sequence

import pygame

from robocov.text import remove_controls

KEY_REPEAT_MS = (350, 40)
"""Delay before a held key repeats, and interval of the repetitions."""
DOUBLE_CLICK_S = 0.35
"""Maximum time between the two clicks of a double click."""
MAX_CLICK_MOVE_PX = 5.0
"""Distance at scale 1 that the mouse may move during a click."""
ZOOM_PER_NOTCH = 1.15
"""Magnification of one notch of the wheel."""
SCROLL_PX_PER_NOTCH = 40.0
"""Distance at scale 1 scrolled by one notch of the wheel."""
MOUSE_EVENTS = (pygame.MOUSEBUTTONDOWN, pygame.MOUSEBUTTONUP, pygame.MOUSEMOTION, pygame.MOUSEWHEEL)
COMMAND_EVENT = pygame.event.custom_type()
"""Event with the name of a command that the user has chosen outside the window, in a browser page."""
ENTER_KEYS = ("return", "enter")

_MAX_NOTCHES = 5.0
_MODIFIERS = {
    "ctrl": pygame.KMOD_CTRL | pygame.KMOD_META,
    "alt": pygame.KMOD_ALT,
    "shift": pygame.KMOD_SHIFT,
}
_KEY_SYMBOLS = {"left": "←", "right": "→", "up": "↑", "down": "↓", "return": "Enter"}


def clean_event(event: pygame.event.Event) -> pygame.event.Event | None:
    """Remove control characters from the text of an event.

    From the name of a dropped file, only NUL is removed; file names may contain all other characters.

    Parameters
    ----------
    event : pygame.event.Event

    Returns
    -------
    pygame.event.Event or None
        The event without control characters; None if no text is left.
    """
    if event.type in (pygame.TEXTINPUT, pygame.TEXTEDITING):
        text = remove_controls(event.text, single_line=True)
        if not text and event.text:
            return None
        return pygame.event.Event(event.type, {**event.dict, "text": text})
    if event.type == pygame.DROPFILE:
        return pygame.event.Event(event.type, {**event.dict, "file": str(event.file).replace("\0", "")})
    return event


def drop_late_repeats(events: Sequence[pygame.event.Event], held: set[int]) -> list[pygame.event.Event]:
    """Drop the repeats of a key that was released while the window was busy.

    If a key is tapped during a long frame, it seems to be held, because its release has not been read yet.

    Parameters
    ----------
    events : sequence of pygame.event.Event
        All events that have arrived, oldest first.
    held : set of int
        Keys held down before these events; updated in place to those held down after them.

    Returns
    -------
    list of pygame.event.Event
    """
    last_releases = {event.key: index for index, event in enumerate(events) if event.type == pygame.KEYUP}
    timely: list[pygame.event.Event] = []
    for index, event in enumerate(events):
        if event.type == pygame.KEYDOWN:
            if event.key in held and index < last_releases.get(event.key, -1):
                continue
            held.add(event.key)
        elif event.type == pygame.KEYUP:
            held.discard(event.key)
        elif event.type == pygame.WINDOWFOCUSLOST:
            held.clear()
        timely.append(event)
    return timely


def get_key_name(event: pygame.event.Event) -> str:
    """Return the name of a pressed key with its modifiers, such as ``ctrl+shift+z``."""
    name = pygame.key.name(event.key)
    name = name.strip("[]") or name  # pygame puts the names of numeric keypad keys in brackets.
    modifiers = [modifier for modifier, mask in _MODIFIERS.items() if event.mod & mask]
    return "+".join([*modifiers, name])


def is_function_key(name: str) -> bool:
    """Return whether a key is one of F1 to F12."""
    return name[:1] == "f" and name[1:].isdigit()


def split_key_name(name: str) -> list[str]:
    """Split the name of a key into its modifiers and the key itself, which may be "+"."""
    if name == "+" or name.endswith("++"):
        return [*name[:-1].split("+")[:-1], "+"]
    return name.split("+")


def format_key(name: str) -> str:
    """Format the name of a key for display.

    >>> format_key("ctrl+shift+z")
    'Ctrl+Shift+Z'
    """
    parts = split_key_name(name)
    return "+".join(_KEY_SYMBOLS.get(part, part[:1].upper() + part[1:]) for part in parts)


def get_wheel_notches(event: pygame.event.Event) -> float:
    """Return the number of notches by which the wheel was turned.

    Touchpads report fractions of a notch. The result is limited to plus or minus `_MAX_NOTCHES`.
    """
    notches = float(getattr(event, "precise_y", event.y) or event.y)
    if not math.isfinite(notches):
        notches = float(event.y)
    return min(max(notches, -_MAX_NOTCHES), _MAX_NOTCHES)
