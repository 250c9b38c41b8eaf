"""The editor's keyboard: keys for questions, for numbers while something is drawn, fields, and actions."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pygame

from robocov.errors import RobocovError
from robocov_app.editor.ui.commands import all_commands, run_typed
from robocov_app.viewer.keyboard import Keyboard as DemoKeyboard
from robocov_app.viewer.keyboard import key_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from robocov_app.editor.ui.dialogs import Dialogs
    from robocov_app.editor.ui.editor import Editor
    from robocov_app.editor.ui.panel import Panel
    from robocov_app.viewer.overlays import CommandList

_OF_NUMBERS = frozenset("0123456789.,-+@<*/%°×x; ")
"""What numbers are typed with."""

_GOES_ON = frozenset("mcm'\"rad")
"""What may follow in a number: units."""


class Keyboard(DemoKeyboard):
    """Turns events of the keyboard into actions, or letters for whatever is open."""

    def __init__(
        self, desk: Editor, panel: Panel, palette: CommandList, dialogs: Dialogs, do: Callable[[str], None]
    ) -> None:
        commands = all_commands()
        repeating = frozenset(command.name for command in commands if command.repeats)
        super().__init__(self, panel, palette, commands, do, repeating)
        self._editor, self._dialogs, self._page = desk, dialogs, panel
        self._field: object = None  # the one whose former texts are known
        self._undone: list[str] = []
        self._texts: list[str] = []

    def attempt(self, action: Callable[[], object]) -> None:
        """Do something; what cannot be done is told, in a sentence."""
        self._editor.attempt(action)

    def command(self, text: str) -> None:
        """Do what was typed; what cannot be done stays to be corrected."""
        try:
            run_typed(self._editor, text)
        except RobocovError:
            self._palette.show()
            self._palette.type(text)
            raise

    def hold(self, key: int) -> None:
        """Note a key as one that is held down."""
        self._down.add(key)

    def _pressed(self, event: pygame.event.Event) -> None:
        name = key_of(event)
        if self._dialogs.open and event.key != pygame.K_F12:
            asked = self._editor.asked
            self._dialogs.key(name)
            if self._editor.asked is not asked:
                self._dialogs.opened_by(event.unicode)
            return
        if not (self._palette.open or self._panel.typing or self._panel.unfolded) and self._number(
            event, name
        ):
            return
        if not self._palette.open and self._field_takes(name):
            return
        super()._pressed(event)
        if self._dialogs.open:
            self._dialogs.opened_by(event.unicode)

    def _field_takes(self, name: str) -> bool:
        """Undo or redo what was typed into a field; say whether the key was for that."""
        field = self._page.widgets.typed_into if self._page.widgets is not None else None
        if field is not self._field:
            self._field, self._texts, self._undone = field, [], []
        if field is None:
            return False
        now = field.get_text()
        back = name == "ctrl+z"
        if back or name in ("ctrl+y", "ctrl+shift+z"):
            source, other = (self._texts, self._undone) if back else (self._undone, self._texts)
            while source and source[-1] == now:
                source.pop()
            if source:
                other.append(now)
                field.set_text(source.pop())
            return True
        if not self._texts or self._texts[-1] != now:
            self._texts.append(now)
        return False

    def _number(self, event: pygame.event.Event, name: str) -> bool:
        """Take a key for the number that is typed while something is drawn; say whether it was one."""
        desk = self._editor
        if not desk.takes_numbers or event.mod & (pygame.KMOD_CTRL | pygame.KMOD_META | pygame.KMOD_ALT):
            return False
        if desk.typed:
            if name in ("return", "enter"):
                desk.enter()
                return True
            if name == "backspace":
                desk.typed = desk.typed[:-1]
                return True
            if name == "tab":
                desk.typed += " "
                return True
        sign = event.unicode
        begins = sign in _OF_NUMBERS and sign not in ("x×*/ ;%" if desk.tool.busy else "x×*/ ;%,-+@<°")
        follows = bool(desk.typed) and (sign in _OF_NUMBERS or sign in _GOES_ON)
        if len(sign) == 1 and (begins or follows):
            desk.typed = (desk.typed + sign)[:40]
            return True
        return False
