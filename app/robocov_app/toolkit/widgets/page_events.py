"""Events of a page: the mouse, keys and typed text."""

import pygame

from robocov_app.toolkit.widgets.dropdown import handle_list_event
from robocov_app.toolkit.widgets.page import Page
from robocov_app.toolkit.window.input import ENTER_KEYS, get_key_name, is_function_key

_ARROW_KEYS = ("left", "right", "up", "down")
_WIDGET_KEYS = (*ENTER_KEYS, "space", *_ARROW_KEYS, *(f"shift+{key}" for key in _ARROW_KEYS))
"""Keys that a focused widget without a text cursor reacts to."""


class PageEvents:
    """Passes events to the widgets of a page, with a handler for each type of event.

    Parameters
    ----------
    page : Page
    """

    def __init__(self, page: Page) -> None:
        """Map each type of event to its handler."""
        self._page = page
        self._handlers = {
            pygame.MOUSEMOTION: self._handle_motion,
            pygame.MOUSEBUTTONDOWN: self._handle_press,
            pygame.MOUSEBUTTONUP: self._handle_release,
            pygame.MOUSEWHEEL: self._handle_wheel,
            pygame.KEYDOWN: self._handle_key,
            pygame.TEXTINPUT: self._handle_text,
            pygame.TEXTEDITING: self._handle_composition,
        }

    def handle(self, event: pygame.event.Event) -> bool:
        """Pass an event to the widgets.

        Returns
        -------
        bool
            Whether the event was meant for the page.
        """
        handler = self._handlers.get(event.type)
        return handler is not None and handler(event)

    def _handle_motion(self, event: pygame.event.Event) -> bool:
        """Handle a move of the mouse: restart the tooltip, or run the page while a widget is dragged."""
        page = self._page
        page.pointer = event.pos
        if page.open_list is not None:
            page.open_list.highlight_at(event.pos)
        if page.active is None:
            hovered = ""
            widget = next(page.find_hovered_widgets(), None)
            if widget is not None:
                hovered = f"{widget.kind}:{widget.key}"
            if page.tool_tip.set_hovered(hovered):
                page.needs_redraw = True
            return page.is_pointer_inside()
        self._rerun_page(event)
        return True

    def _handle_press(self, event: pygame.event.Event) -> bool:
        """Handle a press of a mouse button; outside the widget with the focus, it clears the focus."""
        page = self._page
        page.pointer = event.pos
        if event.button != 1:
            return page.is_pointer_inside()
        page.tool_tip.dismiss()
        if handle_list_event(self._page, event):
            return True
        if page.focus is not None and not self._is_focused_widget_at(event.pos):
            page.clear_focus()
        was_held = page.active is not None
        self._rerun_page(event)
        return was_held or page.is_pointer_inside()

    def _handle_release(self, event: pygame.event.Event) -> bool:
        page = self._page
        page.pointer = event.pos
        if handle_list_event(self._page, event):
            return True
        was_held = page.active is not None
        self._rerun_page(event)
        page.active = None
        return was_held or page.is_pointer_inside()

    def _handle_wheel(self, event: pygame.event.Event) -> bool:
        if handle_list_event(self._page, event):
            return True
        self._rerun_page(event)
        return self._page.active is not None or self._page.is_pointer_inside()

    def _handle_key(self, event: pygame.event.Event) -> bool:
        """Handle a key press: pass it to the open list, move or clear the focus, or pass it to a widget."""
        page = self._page
        page.tool_tip.restart()
        if handle_list_event(self._page, event):
            return True
        name = get_key_name(event)
        # Function keys are commands of the window, also while text is being edited.
        if page.focus is None or (page.edit is not None and is_function_key(name)):
            return False
        if name == "tab":
            self._move_focus(1)
        elif name == "shift+tab":
            self._move_focus(-1)
        elif name == "escape":
            page.clear_focus()
        elif page.edit is None and name not in _WIDGET_KEYS:
            return False
        self._rerun_page(event)
        return True

    def _handle_text(self, event: pygame.event.Event) -> bool:
        page = self._page
        if handle_list_event(self._page, event):
            return True
        if page.edit is None:
            return False
        page.edit.type(event.text)
        page.needs_redraw = True
        return True

    def _handle_composition(self, event: pygame.event.Event) -> bool:
        """Show text that an input method is still composing."""
        page = self._page
        if page.edit is None:
            return False
        page.edit.composed = event.text
        page.needs_redraw = True
        return True

    def _rerun_page(self, event: pygame.event.Event) -> None:
        self._page.needs_redraw = True
        self._page.run(event)

    def _move_focus(self, step: int) -> None:
        page = self._page
        keys = page.list_focusable_keys()
        if not keys or page.focus is None:
            return
        number = 0
        if page.focus in keys:
            number = keys.index(page.focus) + step
        page.set_focus(keys[number % len(keys)])

    def _is_focused_widget_at(self, pixel: tuple[int, int]) -> bool:
        widgets = self._page.widgets.values()
        return any(widget.key == self._page.focus and widget.rect.collidepoint(pixel) for widget in widgets)
