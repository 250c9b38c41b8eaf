"""The keyboard: which key does what, and where typed letters go."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import pygame

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from robocov_app.viewer.actions import Action
    from robocov_app.viewer.overlays import CommandList

_ALSO_WHILE_TYPING = (pygame.K_F1, pygame.K_F9, pygame.K_F12)


class Commanded(Protocol):
    """What typed commands go to."""

    def attempt(self, action: Callable[[], object]) -> None:
        """Do something; what cannot be done is told, in a sentence."""

    def command(self, text: str) -> None:
        """Do what was typed."""


class Widgeted(Protocol):
    """Widgets that come before everything else."""

    @property
    def typing(self) -> bool:
        """Whether letters go into a field."""

    @property
    def unfolded(self) -> bool:
        """Whether a list is open."""

    def take(self, event: pygame.event.Event) -> bool:
        """Give an event to the widgets."""

    def stop_typing(self) -> None:
        """Take the keys away from all fields."""


class Keyboard:
    """Turns events of the keyboard into actions, or letters for a field or the palette.

    Parameters
    ----------
    desk, panel, palette
    actions : iterable of Action
        Those with keys.
    do : callable
        Does an action by its name.
    repeating : set of str
        Names of the actions that are done again and again while a key is held down.
    """

    def __init__(
        self,
        desk: Commanded,
        panel: Widgeted,
        palette: CommandList,
        actions: Iterable[Action],
        do: Callable[[str], None],
        repeating: frozenset[str] = frozenset(),
    ) -> None:
        self._desk, self._panel, self._palette, self._do = desk, panel, palette, do
        self._keys = {key: action.name for action in actions for key in action.keys}
        self._repeating = repeating
        self._down: set[int] = set()
        self._opened_by = ""

    def press(self, event: pygame.event.Event) -> None:
        """Take a key that goes down."""
        self._pressed(event)
        self._down.add(event.key)

    def release(self, event: pygame.event.Event) -> None:
        """Take a key that comes up."""
        self._down.discard(event.key)

    def leave(self) -> None:
        """The window has no keys any more."""
        self._down.clear()

    def letters(self, text: str) -> None:
        """Take letters for the palette."""
        if text != self._opened_by:
            self._palette.type(text)
        self._opened_by = ""

    def _pressed(self, event: pygame.event.Event) -> None:
        if self._palette.open:
            self._choose(event)
            return
        if event.key == pygame.K_ESCAPE and (self._panel.typing or self._panel.unfolded):
            self._panel.stop_typing()
            return
        if self._panel.typing and event.key not in _ALSO_WHILE_TYPING:
            self._panel.take(event)
            return
        name = self._keys.get(key_of(event))
        # who holds F12 down a little too long wants one picture
        if name is None or (event.key in self._down and name not in self._repeating):
            return
        self._do(name)
        # its letter is still to come, and not meant for the palette
        self._opened_by = event.unicode if name == "palette" else ""

    def _choose(self, event: pygame.event.Event) -> None:
        """Take a key for the palette."""
        palette, self._opened_by = self._palette, ""
        if event.key == pygame.K_ESCAPE:
            palette.open = False
        elif event.key == pygame.K_BACKSPACE:
            palette.erase()
        elif event.key in (pygame.K_UP, pygame.K_DOWN):
            palette.move(1 if event.key == pygame.K_DOWN else -1)
        elif event.key in (pygame.K_RETURN, pygame.K_KP_ENTER):
            palette.open = False
            if palette.is_command():
                self._desk.attempt(lambda: self._desk.command(palette.text))
            elif palette.found:
                self._do(palette.found[palette.chosen].name)


def key_of(event: pygame.event.Event) -> str:
    """Return what a pressed key is called in the list of actions."""
    name = pygame.key.name(event.key)
    if name.startswith("[") and name.endswith("]") and len(name) > 2:
        name = name[1:-1]  # of the key pad
    parts = []
    if event.mod & (pygame.KMOD_CTRL | pygame.KMOD_META):
        parts.append("ctrl")
    if event.mod & pygame.KMOD_ALT:
        parts.append("alt")
    if event.mod & pygame.KMOD_SHIFT:
        parts.append("shift")
    return "+".join([*parts, name])
