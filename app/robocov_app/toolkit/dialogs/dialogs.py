"""The open dialog of a window: passing events to it, and drawing it."""

from contextlib import suppress

import pygame
from pygame import Rect, Surface

from robocov_app.look.theme import LIGHT, Theme
from robocov_app.toolkit.dialogs.dialog import Dialog
from robocov_app.toolkit.overlay import draw_card, draw_veil
from robocov_app.toolkit.widgets.ui import Ui
from robocov_app.toolkit.window.input import MOUSE_EVENTS, get_key_name, get_wheel_notches
from robocov_app.toolkit.window.page_view import PageAppearance

_WINDOW_EVENTS = (pygame.QUIT, pygame.VIDEORESIZE, pygame.WINDOWSIZECHANGED)
"""Events that are passed on to the window even while a dialog is open."""
_WHEEL_BUTTONS = (4, 5)
"""Buttons that pygame reports in addition to the event of the wheel."""
_INITIAL_HEIGHT_PX = 100
_SCREEN_MARGIN_PX = 24


class Dialogs:
    """Shows one dialog at a time, and passes events to it.

    Attributes
    ----------
    current : Dialog or None
        The dialog that is open.
    ui : Ui or None
        Page with the widgets of the open dialog; None until it is drawn or receives an event.
    max_width : float or None
        Maximum width of dialogs at scale 1, px; None for their usual width.
    has_key_hints : bool
        Whether dialogs mention keys, which a phone does not have.
    """

    def __init__(self) -> None:
        self.current: Dialog | None = None
        self.ui: Ui | None = None
        self.max_width: float | None = None
        self.has_key_hints = True
        self._ignored_character = ""
        self._is_drawn = False

    @property
    def is_open(self) -> bool:
        """Whether a dialog is open."""
        return self.current is not None

    @property
    def box(self) -> Rect | None:
        """The box of the open dialog, px; None if there is none, or if it has not been drawn."""
        if self.ui is None or not self.is_open or not self._is_drawn:
            return None
        return self.ui.box

    @property
    def is_typing(self) -> bool:
        """Whether typed text goes to a text field of the open dialog."""
        return self.is_open and self.ui is not None and self.ui.edit is not None

    def set_appearance(self, appearance: PageAppearance) -> None:
        """Adopt the appearance that suits the browser page that shows the window."""
        self.max_width = appearance.max_dialog_width
        # On a phone that controls a large window, only the width of dialogs is limited.
        is_on_phone = appearance.is_compact or self.max_width is not None
        self.has_key_hints = not is_on_phone

    def ask(self, dialog: Dialog) -> None:
        """Open a dialog; it replaces the one that is open, if any."""
        self.current = dialog
        self.ui = None
        self._ignored_character = ""
        self._is_drawn = False

    def ignore_character(self, character: str) -> None:
        """Ignore the text event of the key that opened the dialog, so that it is not typed there."""
        self._ignored_character = character if self.is_open else ""

    def close(self) -> None:
        """Cancel the dialog."""
        dialog = self.current
        self.current = None
        if dialog is not None:
            dialog.handle_cancel()

    def discard(self) -> None:
        """Remove a dialog that cannot be drawn, even if canceling it raises."""
        with suppress(Exception):
            self.close()
        self.current = None

    def handle_event(self, event: pygame.event.Event) -> bool:
        """Pass an event to the dialog.

        Returns
        -------
        bool
            Whether the event has been handled and must not reach the window.
        """
        dialog = self.current
        if dialog is None:
            return False
        if event.type == pygame.DROPFILE and not dialog.has_veil:
            self.close()
            return False
        if event.type in MOUSE_EVENTS and not self._is_drawn:
            return True
        # Keys may arrive before the dialog is first drawn; then theme and scale do not matter yet.
        ui = self.ui or self._create_ui(dialog, LIGHT, 1.0)
        ui.needs_redraw = True
        self._pass_event(event, dialog, ui)
        dialog.read_widgets(ui)
        if dialog.is_done and self.current is dialog:
            self.current = None
        return event.type not in _WINDOW_EVENTS

    def _pass_event(self, event: pygame.event.Event, dialog: Dialog, ui: Ui) -> None:
        """Pass an event to the dialog or to its widgets; a click outside may close the dialog."""
        if event.type == pygame.TEXTINPUT:
            ignored = self._ignored_character
            self._ignored_character = ""
            if not ignored or event.text != ignored:
                ui.handle_event(event)
        elif event.type == pygame.KEYDOWN:
            self._handle_key(event, dialog, ui)
        elif event.type == pygame.MOUSEWHEEL:
            if not dialog.handle_wheel(get_wheel_notches(event)):
                ui.handle_event(event)
        elif event.type == pygame.MOUSEBUTTONDOWN and not ui.box.collidepoint(event.pos):
            if dialog.closes_on_outside_click and event.button not in _WHEEL_BUTTONS:
                self.close()
        else:
            ui.handle_event(event)

    def _handle_key(self, event: pygame.event.Event, dialog: Dialog, ui: Ui) -> None:
        """Handle a key press: Escape closes the dialog, unless an input method is composing text."""
        name = get_key_name(event)
        self._ignored_character = ""
        is_composing = ui.edit is not None and bool(ui.edit.composed)
        if name == "escape" and not is_composing:
            self.close()
        elif is_composing or not dialog.handle_key(name, ui):
            ui.handle_event(event)
        if self.current is not dialog:
            # The answer has opened another dialog, which must not receive the character of this key.
            self.ignore_character(event.unicode)

    def _create_ui(self, dialog: Dialog, theme: Theme, scale: float) -> Ui:
        dialog.has_key_hints = self.has_key_hints
        self.ui = Ui(dialog.show_with_margin, theme, scale)
        self.ui.background = None
        self.ui.box = Rect(0, 0, round(dialog.width * scale), _INITIAL_HEIGHT_PX)
        self.ui.run()
        return self.ui

    def draw(self, screen: Surface, theme: Theme, scale: float) -> None:
        """Draw the dialog that is open, if there is one."""
        dialog = self.current
        if dialog is None:
            return
        self._is_drawn = True
        dialog.window_height = screen.get_height() / scale
        ui = self.ui
        if ui is None or ui.theme is not theme or ui.scale != scale:
            ui = self._create_ui(dialog, theme, scale)
        if dialog.has_veil:
            draw_veil(screen, theme)
        width = min(dialog.width * scale, screen.get_width() - _SCREEN_MARGIN_PX * scale)
        if self.max_width is not None:
            width = min(width, self.max_width * scale)
        for _ in range(2):  # The height is known only after the content has run.
            ui.box = Rect(0, 0, round(width), min(round(ui.y * scale), screen.get_height()))
            dialog.place(ui.box, screen.get_rect(), scale)
            ui.run()
        draw_card(screen, ui.box, theme, scale)
        ui.needs_redraw = True
        ui.draw(screen)
        ui.draw_overlays(screen)
