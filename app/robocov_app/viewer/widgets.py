"""Widgets of pygame_gui, each bound to what it does; places are pixels at scale 1."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass, field
from html import escape
from typing import TYPE_CHECKING, Any, TypeAlias

import pygame
import pygame_gui
from pygame_gui.core import UIContainer
from pygame_gui.elements import (
    UIButton,
    UICheckBox,
    UIDropDownMenu,
    UIHorizontalSlider,
    UILabel,
    UIScrollingContainer,
    UITextEntryLine,
)

from robocov_app.render.fonts import shortened
from robocov_app.viewer.actions import KEY_REPEAT, key_words
from robocov_app.viewer.look import BAR, TEXT, manager_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from robocov_app.render.theme import Theme
    from robocov_app.viewer.actions import Action
    from robocov_app.viewer.layout import Box

MOST_PAGES = 12
"""Pages that are kept although they are not open, so that turning to them costs nothing."""

LONGEST_LIST = 268
"""Pixels at scale 1 that an open menu is high at most."""

_FAR = 100_000

_INDENT = "\u00a0\u00a0"
"""Before what a menu offers, where the library knows no padding."""


Call: TypeAlias = "Callable[[Any], object]"


class Glass(UIContainer):
    """Lies over others without hiding them from the mouse: open menus hang in it."""

    def check_hover(self, time_delta: float, hovered_higher_element: bool) -> bool:
        """Leave what is below to be hovered over."""
        return False


class Scrolled(UIScrollingContainer):
    """Scrolls, with a bar as wide as the scale asks."""

    def __init__(self, rect: pygame.Rect, manager: Any, container: Any, bar: int) -> None:
        self._bar = bar
        super().__init__(rect, manager, container=container, allow_scroll_x=False)

    def _check_scroll_bars(self) -> tuple[bool, bool]:
        horizontal, vertical = super()._check_scroll_bars()
        if vertical:
            self.scroll_bar_width = self._bar
        return horizontal, vertical


@dataclass
class Section:
    """Widgets that are built, moved, hidden and taken away together.

    Attributes
    ----------
    key : object
        What they were built for.
    top : int, px
    elements : list
        To be moved and taken away.
    calls : dict of type of event and widget to callable
    named : dict of ``kind:name`` to widget
    """

    key: object
    top: int
    elements: list[Any] = field(default_factory=list)
    calls: dict[tuple[int, Any], Call] = field(default_factory=dict)
    named: dict[str, Any] = field(default_factory=dict)
    menus: list[UIDropDownMenu] = field(default_factory=list)
    entries: list[UITextEntryLine] = field(default_factory=list)
    sliders: list[UIHorizontalSlider] = field(default_factory=list)
    scrolled: Scrolled | None = None

    def move(self, top: int) -> None:
        """Move everything to another height."""
        for element in self.elements:
            x, y = element.relative_rect.topleft
            element.set_relative_position((x, y + top - self.top))
        self.top = top

    def kill(self) -> None:
        """Take everything away."""
        for element in self.elements:
            element.kill()


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
        self.size, self.place, self.theme, self.scale = size, box, theme, scale
        self._actions, self._do = actions, do
        self.manager = manager_of(size, theme, scale)
        self._sections: dict[str, Section] = {}
        self._pages: OrderedDict[object, Section] = OrderedDict()
        self._now = Section(None, 0)
        self._was_held = False
        self._was_typing: UITextEntryLine | None = None
        self._box = UIContainer(pygame.Rect(box), self.manager)
        self._over = Glass(pygame.Rect(box), self.manager, starting_height=20)
        self._into: Any = self._box

    def resize(self, size: tuple[int, int], box: Box) -> None:
        """Move everything into another box of another window; pages are built anew."""
        self.size, self.place = size, box
        self.manager.set_window_resolution(size)
        for container in (self._box, self._over):
            container.set_position(box[:2])
            container.set_dimensions(box[2:])
        self._forget_pages()

    # sections

    def section(self, name: str, key: object, y: float, build: Callable[[], object]) -> None:
        """Have a section at a height: build it, unless it is there for the same key."""
        top = round(y * self.scale)
        there = self._sections.get(name)
        if there is not None and there.key == key:
            if there.top != top:
                there.move(top)
            return
        if there is not None:
            there.kill()
        self._sections[name] = self._now = Section(key, top)
        self._into = self._box
        build()

    def page(self, key: object, y: float, needed: float, build: Callable[[float], object]) -> None:
        """Turn to a page from a height down; build it, unless it has been there before.

        `build` is told what width a scroll bar takes because more height is needed than there is.
        """
        top = round(y * self.scale)
        whole = (key, top)
        open_page = self._sections.get("page")
        if open_page is not None and open_page.key == whole:
            return
        if open_page is not None:
            for element in open_page.elements:
                element.hide()
            self._pages[open_page.key] = open_page
        kept = self._pages.pop(whole, None)
        if kept is not None:
            for element in kept.elements:
                element.show()
            self._sections["page"] = kept
            return
        while len(self._pages) >= MOST_PAGES:
            self._pages.popitem(last=False)[1].kill()
        self._sections["page"] = self._now = Section(whole, 0)
        _, _, width, height = self.place
        rect = pygame.Rect(0, top, width, max(height - top, 1))
        bar = 0
        if needed * self.scale <= rect.height:
            self._into = UIContainer(rect, self.manager, container=self._box)
        else:
            bar = round(BAR * self.scale)
            self._into = self._now.scrolled = Scrolled(rect, self.manager, self._box, bar)
            self._into.set_scrollable_area_dimensions((width - bar, round(needed * self.scale)))
        self._now.elements.append(self._into)
        build(bar / self.scale)
        if bar:  # or its knob would have sharp corners at first
            self._into.vert_scroll_bar.sliding_button.rebuild()

    def _forget_pages(self) -> None:
        for page in self._pages.values():
            page.kill()
        self._pages.clear()
        open_page = self._sections.pop("page", None)
        if open_page is not None:
            open_page.kill()

    def rect(self, x: float, y: float, width: float, height: float) -> pygame.Rect:
        """Return a rectangle in pixels, down from the section's top."""
        scale = self.scale
        left, top = round(x * scale), self._now.top + round(y * scale)
        return pygame.Rect(left, top, round(width * scale), round(height * scale))

    # making

    def _made(self, element: Any, kind: str, name: str) -> None:
        if self._into is self._box:  # what is in a page comes and goes with it
            self._now.elements.append(element)
        if name:
            self._now.named[f"{kind}:{name}"] = element

    def label(
        self, text: str, rect: pygame.Rect, *, name: str = "", style: str | None = None, tip: str = ""
    ) -> None:
        """Write a word, shortened where there is no room; `style` is ``#header`` or ``#unit``."""
        size, bold = TEXT.get(style or "", TEXT[""])
        text = shortened(text, round(size * self.scale), rect.width - 1, bold)
        label = UILabel(rect, text, self.manager, self._into, object_id=style)
        if tip:
            label.set_tooltip(escape(tip))
        self._made(label, "label", name)

    def button(
        self,
        text: str,
        rect: pygame.Rect,
        call: Callable[[], object],
        *,
        name: str = "",
        tip: str = "",
        style: str | None = None,
    ) -> None:
        """Make a button; one named as an action tells the action's key."""
        known = self._actions.get(name)
        if known is not None:
            keys = " or ".join(key_words(key) for key in known.keys)
            tip = f"{known.title} ({keys})" if keys else known.title
        button = UIButton(
            rect, text, self.manager, self._into, tool_tip_text=escape(tip) or None, object_id=style
        )
        self._now.calls[pygame_gui.UI_BUTTON_PRESSED, button] = lambda _: call()
        self._made(button, "button", name)

    def does(self, text: str, rect: pygame.Rect, action: str, *, style: str | None = None) -> None:
        """Make a button that does an action."""
        self.button(text, rect, lambda: self._do(action), name=action, style=style)

    def menu(
        self, name: str, options: list[str], now: str, rect: pygame.Rect, call: Callable[[str], object]
    ) -> None:
        """Make a menu that drops down; what there is no room for is shortened."""
        size = round(TEXT[""][0] * self.scale)
        # the list leaves out the arrow, and its bar if it has one
        room = rect.width - (54 if 24 * len(options) > LONGEST_LIST else 34) * self.scale
        whole = {_INDENT + shortened(each, size, room): each for each in (now, *options)}
        if len(whole) < len({now, *options}):
            whole = {_INDENT + each: each for each in (now, *options)}
        short = {each: text for text, each in whole.items()}
        shown: list[str | tuple[str, str]] = [*([] if now in options else [short[now]])]
        shown += [short[each] for each in options]
        high = round(min(LONGEST_LIST * self.scale, self.place[3] - rect.bottom - 8 * self.scale))
        menu = UIDropDownMenu(
            shown, short[now], rect, self.manager, self._over, expansion_height_limit=max(high, 60)
        )

        def chosen(text: str) -> object:
            return call(whole.get(text, text))

        self._now.calls[pygame_gui.UI_DROP_DOWN_MENU_CHANGED, menu] = chosen
        self._now.menus.append(menu)
        self._now.elements.append(menu)
        self._now.named[f"menu:{name}"] = menu

    def entry(self, name: str, text: str, rect: pygame.Rect, call: Callable[[str], object]) -> None:
        """Make a field that is called with its text when Enter is pressed."""
        entry = UITextEntryLine(rect, self.manager, self._into, initial_text=text)
        self._now.calls[pygame_gui.UI_TEXT_ENTRY_FINISHED, entry] = call
        self._now.entries.append(entry)
        self._made(entry, "entry", name)

    def slider(
        self,
        name: str,
        rect: pygame.Rect,
        now: float,
        span: tuple[float, float],
        call: Callable[[float], object],
    ) -> None:
        """Make a slider that is called with its value while it moves."""
        slider = UIHorizontalSlider(rect, float(now), span, self.manager, self._into)
        if slider.sliding_button is not None:
            slider.sliding_button.set_hold_range((_FAR, _FAR))
        self._now.calls[pygame_gui.UI_HORIZONTAL_SLIDER_MOVED, slider] = call
        self._now.sliders.append(slider)
        self._made(slider, "slider", name)

    def check(
        self, name: str, text: str, rect: pygame.Rect, now: bool, call: Callable[[bool], object], tip: str
    ) -> None:
        """Make a check box."""
        check = UICheckBox(rect, text, self.manager, self._into, initial_state=now, tool_tip_text=escape(tip))
        self._now.calls[pygame_gui.UI_CHECK_BOX_CHECKED, check] = lambda _: call(True)
        self._now.calls[pygame_gui.UI_CHECK_BOX_UNCHECKED, check] = lambda _: call(False)
        self._made(check, "check", name)

    # keeping up

    def find(self, kind: str, name: str) -> Any:
        """Return a widget that is shown, None if there is none of that kind and name."""
        wanted = f"{kind}:{name}"
        for section in self._sections.values():
            if wanted in section.named:
                return section.named[wanted]
        return None

    def mark(self, name: str, chosen: bool, styles: tuple[str, str | None] = ("#chosen", None)) -> None:
        """Show a button as chosen, or not."""
        button = self.find("button", name)
        style = styles[0] if chosen else styles[1]
        if button is not None and button.object_ids[-1] != style:
            button.change_object_id(style)

    def say(self, kind: str, name: str, text: str) -> None:
        """Let a button or a label show a text."""
        widget = self.find(kind, name)
        if widget is not None and widget.text != text:
            widget.set_text(text)

    def fill(self, name: str, text: str) -> None:
        """Let a field show a text, unless it is being typed into."""
        entry = self.find("entry", name)
        if entry is not None and not entry.is_focused and entry.get_text() != text:
            entry.set_text(text)

    def slide(self, name: str, value: float) -> None:
        """Put a slider where it belongs, unless somebody holds it."""
        slider = self.find("slider", name)
        if slider is None or slider.sliding_button.held:
            return
        if abs(float(slider.get_current_value()) - value) > 1e-6:
            slider.set_current_value(value, warn=False)

    def tick(self, name: str, on: bool) -> None:
        """Tick a check box, or not."""
        check = self.find("check", name)
        if check is not None and check.is_checked != on:
            check.is_checked = on
            # not `set_state`: what that posts is as if somebody had clicked
            check._update_visual_state()

    def _all(self, kind: str) -> Iterator[Any]:
        for section in self._sections.values():
            yield from getattr(section, kind)

    @property
    def typed_into(self) -> UITextEntryLine | None:
        """The field that keys go into."""
        return next((entry for entry in self._all("entries") if entry.is_focused), None)

    @property
    def held(self) -> bool:
        """Whether somebody holds a slider or the scroll bar."""
        page = self._sections.get("page")
        bars = [page.scrolled.vert_scroll_bar] if page is not None and page.scrolled is not None else []
        return any(each.sliding_button.held for each in [*self._all("sliders"), *bars])

    @property
    def open_menu(self) -> UIDropDownMenu | None:
        """The menu that is open, which may hang over other things."""
        menus = self._all("menus")
        return next((menu for menu in menus if menu.current_state is menu.menu_states["expanded"]), None)

    def focus(self, name: str) -> None:
        """Let keys go into a field, in place of what is in it."""
        entry = self.find("entry", name)
        if entry is not None:
            self.manager.set_focus_set(entry)
            self._select(None)

    def let_go(self) -> None:
        """Take the keys away from all fields, and close the menu that is open."""
        self.manager.set_focus_set(None)
        if (menu := self.open_menu) is not None and menu.current_state is not None:
            menu.current_state.should_transition = True

    def ended(self) -> bool:
        """Return whether, since this was asked last, somebody has left a field or let go of a slider."""
        held, field = self.held, self.typed_into
        left = self._was_typing is not None and field is not self._was_typing
        ended = left or (self._was_held and not held)
        if left and field is None:
            pygame.key.set_repeat(*KEY_REPEAT)  # fields change it, and leave none behind
        self._was_held, self._was_typing = held, field
        return ended

    # events

    def take(self, event: pygame.event.Event) -> bool:
        """Give an event to the widgets; return whether one of them took it."""
        focused = None
        if event.type == pygame.MOUSEBUTTONDOWN and event.button == 1 and self.open_menu is None:
            focused = self.typed_into
            self._jump(event.pos)
        taken = bool(self.manager.process_events(event))
        if event.type == pygame.MOUSEBUTTONDOWN and event.button == 1:
            self._select(focused)
            self._toggle(event.pos)
        element = getattr(event, "ui_element", None)
        if element is not None:
            self._told(event.type, element, event)
        return taken

    def _told(self, kind: int, element: Any, event: pygame.event.Event) -> None:
        for section in self._sections.values():
            call = section.calls.get((kind, element))
            if call is None:
                continue
            if kind == pygame_gui.UI_TEXT_ENTRY_FINISHED:
                self.manager.set_focus_set(None)
            call(getattr(event, "text", getattr(event, "value", None)))
            return

    def _jump(self, pixel: tuple[int, int]) -> None:
        """Bring the knob of a slider to where it was pressed, so that it is held from there."""
        for slider in self._all("sliders"):
            knob = slider.sliding_button
            if not slider.hover_point(*pixel) or knob.hover_point(*pixel):
                continue
            part = (pixel[0] - slider.rect.left - knob.rect.width / 2) / max(slider.scrollable_width, 1)
            low, high = slider.value_range
            value = low + min(max(part, 0.0), 1.0) * (high - low)
            slider.set_current_value(value, warn=False)
            event = pygame.event.Event(pygame_gui.UI_HORIZONTAL_SLIDER_MOVED, value=value, ui_element=slider)
            self._told(event.type, slider, event)
            return

    def _select(self, before: Any) -> None:
        """Select what is in a field that has just been clicked, so that typing replaces it."""
        for entry in self._all("entries"):
            if entry.is_focused and entry is not before:
                entry.selection_in_progress = False
                entry.edit_position = len(entry.get_text())
                entry.select_range = [0, len(entry.get_text())]

    def _toggle(self, pixel: tuple[int, int]) -> None:
        """Let the words beside a check box do as the box does."""
        for section in self._sections.values():
            for name, check in section.named.items():
                if name.startswith("check:") and check.text_label.hover_point(*pixel):
                    check._toggle_state()
                    return
