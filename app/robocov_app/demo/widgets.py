"""Widgets of pygame_gui, each bound to what it does; places are pixels at scale 1."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pygame
import pygame_gui
from pygame_gui.elements import (
    UIButton,
    UICheckBox,
    UIDropDownMenu,
    UIHorizontalSlider,
    UILabel,
    UIPanel,
    UIScrollingContainer,
    UITextEntryLine,
)

from robocov_app.demo.actions import key_words
from robocov_app.demo.look import manager_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from robocov_app.demo.actions import Action
    from robocov_app.demo.layout import Box
    from robocov_app.view.theme import Theme

_NO_MARGINS = {"left": 0, "right": 0, "top": 0, "bottom": 0}


class Widgets:
    """Makes widgets in one box of the window, and calls what each is bound to.

    Parameters
    ----------
    size : (width, height), px
        Of the window.
    box : Box
        What the widgets are in.
    theme : Theme
    scale : float
    actions : dict of name to Action
        Give tool tips their keys.
    do : callable
        Does an action by its name.
    """

    def __init__(
        self,
        size: tuple[int, int],
        box: Box,
        theme: Theme,
        scale: float,
        actions: dict[str, Action],
        do: Callable[[str], None],
    ) -> None:
        self.size, self.place, self.scale = size, box, scale
        self._actions, self._do = actions, do
        self.manager = manager_of(size, theme, scale)
        self.clear()

    def clear(self) -> None:
        """Begin anew, with an empty box."""
        self.manager.clear_and_reset()  # type: ignore[no-untyped-call]
        self._pressed: dict[Any, Callable[[], object]] = {}
        self._chosen: dict[Any, Callable[[str], object]] = {}
        self._typed: dict[Any, Callable[[str], object]] = {}
        self._slid: dict[Any, Callable[[float], object]] = {}
        self._switched: dict[Any, Callable[[bool], object]] = {}
        self.buttons: dict[str, UIButton] = {}
        self.entries: dict[str, UITextEntryLine] = {}
        self.sliders: dict[str, UIHorizontalSlider] = {}
        self.checks: dict[str, UICheckBox] = {}
        self.box: Any = UIPanel(
            pygame.Rect(self.place), manager=self.manager, object_id="#panel", margins=_NO_MARGINS
        )

    def rect(self, x: float, y: float, width: float, height: float) -> pygame.Rect:
        """Return a rectangle in pixels."""
        scale = self.scale
        return pygame.Rect(round(x * scale), round(y * scale), round(width * scale), round(height * scale))

    # making

    def label(
        self, text: str, rect: pygame.Rect, *, style: str | None = None, box: Any = None, tip: str = ""
    ) -> UILabel:
        """Write a word; `style` is ``#header`` or ``#unit``."""
        label = UILabel(rect, text, self.manager, box or self.box, object_id=style)
        if tip:
            label.set_tooltip(tip)
        return label

    def button(
        self,
        text: str,
        rect: pygame.Rect,
        call: Callable[[], object],
        *,
        name: str = "",
        box: Any = None,
        tip: str = "",
        style: str | None = None,
    ) -> UIButton:
        """Make a button; one named as an action tells the action's key."""
        known = self._actions.get(name)
        if known is not None:
            keys = " or ".join(key_words(key) for key in known.keys)
            tip = f"{known.title} ({keys})" if keys else known.title
        button = UIButton(
            rect, text, self.manager, box or self.box, tool_tip_text=tip or None, object_id=style
        )
        self._pressed[button] = call
        if name:
            self.buttons[name] = button
        return button

    def does(self, text: str, rect: pygame.Rect, action: str, box: Any = None) -> UIButton:
        """Make a button that does an action."""
        return self.button(text, rect, lambda: self._do(action), name=action, box=box)

    def menu(
        self, options: list[str], now: str, rect: pygame.Rect, call: Callable[[str], object]
    ) -> UIDropDownMenu:
        """Make a menu that drops down."""
        all_options: list[str | tuple[str, str]] = [*([] if now in options else [now]), *options]
        room = round(min(260 * self.scale, self.size[1] - rect.bottom - 20))
        menu = UIDropDownMenu(
            all_options, now, rect, self.manager, self.box, expansion_height_limit=max(room, 60)
        )
        self._chosen[menu] = call
        return menu

    def entry(
        self, name: str, text: str, rect: pygame.Rect, call: Callable[[str], object], box: Any = None
    ) -> None:
        """Make a field that is called with its text when Enter is pressed."""
        entry = UITextEntryLine(rect, self.manager, box or self.box, initial_text=text)
        self._typed[entry] = call
        self.entries[name] = entry

    def slider(
        self,
        name: str,
        rect: pygame.Rect,
        now: float,
        span: tuple[float, float],
        call: Callable[[float], object],
        box: Any = None,
    ) -> None:
        """Make a slider that is called with its value while it moves."""
        slider = UIHorizontalSlider(rect, now, span, self.manager, box or self.box)
        self._slid[slider] = call
        self.sliders[name] = slider

    def check(
        self,
        name: str,
        text: str,
        rect: pygame.Rect,
        now: bool,
        call: Callable[[bool], object],
        box: Any,
        tip: str,
    ) -> None:
        """Make a check box."""
        check = UICheckBox(rect, text, self.manager, box, initial_state=now, tool_tip_text=tip)
        self._switched[check] = call
        self.checks[name] = check

    def scrolled(self, top: int, needed: float) -> tuple[Any, bool]:
        """Return a container from `top` down, and whether it has a scroll bar because more is needed."""
        _, _, width, height = self.place
        rect = pygame.Rect(0, top, width, height - top)
        if needed * self.scale <= rect.height:
            panel = UIPanel(
                rect, manager=self.manager, container=self.box, object_id="#panel", margins=_NO_MARGINS
            )
            return panel, False
        box = UIScrollingContainer(rect, self.manager, container=self.box, allow_scroll_x=False)
        box.set_scrollable_area_dimensions((width - round(18 * self.scale), round(needed * self.scale)))
        return box, True

    # keeping up

    def mark(self, name: str, chosen: bool) -> None:
        """Show a button as chosen, or not."""
        button = self.buttons.get(name)
        if button is None:
            return
        now = button.object_ids is not None and "#chosen" in button.object_ids
        if now != chosen:
            button.change_object_id("#chosen" if chosen else None)

    def caption(self, name: str, text: str) -> None:
        """Let a button show a text."""
        if name in self.buttons and self.buttons[name].text != text:
            self.buttons[name].set_text(text)

    def say(self, name: str, text: str) -> None:
        """Let a field show a text, unless somebody types into it."""
        entry = self.entries.get(name)
        if entry is not None and not entry.is_focused and entry.get_text() != text:
            entry.set_text(text)

    def slide(self, name: str, value: float) -> None:
        """Put a slider where it belongs, unless somebody moves it."""
        slider = self.sliders.get(name)
        if slider is None or slider.has_moved_recently:
            return
        if abs(float(slider.get_current_value()) - value) > 1e-3:
            slider.set_current_value(value)

    def tick(self, name: str, on: bool) -> None:
        """Tick a check box, or not."""
        check = self.checks.get(name)
        if check is not None and check.is_checked != on:
            check.set_state(on)

    @property
    def typing(self) -> bool:
        """Whether keys go into a field."""
        return any(entry.is_focused for entry in self._typed)

    def stop_typing(self) -> None:
        """Take the keys away from all fields."""
        if self.typing:
            self.manager.set_focus_set(None)

    @property
    def unfolded(self) -> bool:
        """Whether a menu is open, which may hang over other things."""
        return any(menu.current_state is menu.menu_states["expanded"] for menu in self._chosen)

    # events

    def take(self, event: pygame.event.Event) -> bool:
        """Give an event to the widgets; return whether one of them took it."""
        taken = bool(self.manager.process_events(event))
        element = getattr(event, "ui_element", None)
        if event.type == pygame_gui.UI_BUTTON_PRESSED and element in self._pressed:
            self._pressed[element]()
        elif event.type == pygame_gui.UI_DROP_DOWN_MENU_CHANGED and element in self._chosen:
            self._chosen[element](event.text)
        elif event.type == pygame_gui.UI_TEXT_ENTRY_FINISHED and element in self._typed:
            call = self._typed[element]
            self.manager.set_focus_set(None)
            call(event.text)
        elif event.type == pygame_gui.UI_HORIZONTAL_SLIDER_MOVED and element in self._slid:
            self._slid[element](float(event.value))
        elif event.type == pygame_gui.UI_CHECK_BOX_CHECKED and element in self._switched:
            self._switched[element](True)
        elif event.type == pygame_gui.UI_CHECK_BOX_UNCHECKED and element in self._switched:
            self._switched[element](False)
        return taken
