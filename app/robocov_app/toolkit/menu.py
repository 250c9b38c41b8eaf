"""A menu at the cursor."""

from collections.abc import Callable, Sequence

import pygame

from robocov_app.render.fonts import text_width
from robocov_app.render.theme import Theme
from robocov_app.toolkit.command import Command
from robocov_app.toolkit.input import key_of, key_words
from robocov_app.toolkit.overlay import card
from robocov_app.toolkit.ui import SMALL, TEXT, Ui


class Menu:
    """Commands to choose from at a place of the window, None for a line between groups."""

    def __init__(
        self, commands: Sequence[Command | None], at: tuple[int, int], do: Callable[[str], object]
    ) -> None:
        self.commands, self.at, self._do = commands, at, do
        self.open = True
        self.chosen = -1
        self._ui: Ui | None = None

    def _page(self, ui: Ui) -> None:
        ui.inset(5, 5, 5)
        for k, command in enumerate(self.commands):
            ui.row(height=7 if command is None else 24, below=0)
            if command is None:
                ui.cell()
                continue
            why, chosen = command.when(), k == self.chosen
            if ui.option(command.title, _keys(command), key=command.name, chosen=chosen, why=why):
                self._choose(command)

    def _choose(self, command: Command) -> None:
        self.open = False
        self._do(command.name)

    def take(self, event: pygame.event.Event) -> bool:
        """Take an event; return whether it was meant for the menu. A press beside it closes it."""
        if event.type == pygame.KEYDOWN:
            self._key(key_of(event))
        elif event.type == pygame.MOUSEBUTTONDOWN and self._ui is not None:
            self.open = self._ui.box.collidepoint(event.pos)
            return self._ui.take(event) or not self.open
        elif self._ui is not None:
            self._ui.take(event)
        keys = (pygame.KEYDOWN, pygame.KEYUP, pygame.TEXTINPUT)
        return event.type in (*keys, pygame.MOUSEBUTTONUP, pygame.MOUSEMOTION)

    def _key(self, name: str) -> None:
        usable = [k for k, each in enumerate(self.commands) if each is not None and not each.when()]
        by = {"up": -1, "down": 1}.get(name, 0)
        if name == "escape":
            self.open = False
        elif by and usable:
            k = usable.index(self.chosen) + by if self.chosen in usable else (0 if by > 0 else -1)
            self.chosen = usable[k % len(usable)]
        elif name in ("return", "enter") and self.chosen in usable:
            command = self.commands[self.chosen]
            assert command is not None
            self._choose(command)

    def draw(self, screen: pygame.Surface, theme: Theme, scale: float) -> None:
        """Draw it, whole in the window."""
        if self._ui is None or self._ui.theme is not theme or self._ui.scale != scale:
            self._ui = Ui(self._page, theme, scale)
            self._ui.background = None
        wide = round(50 * scale) + max(
            text_width(each.title, round(TEXT * scale)) + text_width(_keys(each), round(SMALL * scale))
            for each in self.commands
            if each is not None
        )
        high = round(sum(7 if each is None else 24 for each in self.commands) * scale + 10 * scale)
        box = pygame.Rect(*self.at, wide, high)
        self._ui.box = box.clamp(screen.get_rect())
        card(screen, self._ui.box, theme, scale)
        self._ui.stale = True
        self._ui.draw(screen)
        self._ui.draw_over(screen)


def _keys(command: Command) -> str:
    return key_words(command.keys[0]) if command.keys else ""
