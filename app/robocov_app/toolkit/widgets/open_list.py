"""The list of a drop-down menu while it is open."""

from dataclasses import dataclass
from enum import Enum

import pygame
from pygame import Rect, Surface

from robocov_app.look.colors import mix
from robocov_app.look.theme import Theme
from robocov_app.render.fonts import render_text, shorten_to_width
from robocov_app.toolkit.overlay import draw_rounded_box, get_field_color
from robocov_app.toolkit.window.input import ENTER_KEYS, get_key_name, get_wheel_notches, is_function_key

# Lengths in pixels at scale 1.
MAX_LIST_HEIGHT_PX = 268.0
LIST_ROW_PX = 24.0
_TEXT_PX = 12.0
_RADIUS_PX = 4
_TEXT_LEFT_PX = 8
_TEXT_MARGINS_PX = 14
_SCROLLED_TEXT_MARGINS_PX = 24
"""Margins of the text next to a scroll bar."""
_BAR_WIDTH_PX = 6
_BAR_MARGIN_PX = 2
LIST_EDGE_PX = 1
"""Width of the edge of a list, at any scale."""

# Fractions of the second color that are mixed into the first one.
_EDGE_STRENGTH = 0.4
_BAR_STRENGTH = 0.3
_HIGHLIGHT_STRENGTH = 0.25

_TO_END = 9999
"""A step past the end of any list; the result is clamped to the list."""
_KEY_STEPS = {"up": -1, "down": 1, "page up": -8, "page down": 8, "home": -_TO_END, "end": _TO_END}


class ListResponse(Enum):
    """Effect of an event on an open list."""

    IGNORED = "ignored"
    """The event is not for the list."""
    HANDLED = "handled"
    CLOSED = "closed"
    """The list closes, and the value stays."""
    PICKED = "picked"
    """An option was picked."""


@dataclass
class OpenList:
    """An open list of options.

    Attributes
    ----------
    key : str
        Key of its menu.
    options : list of str
    rect : pygame.Rect
        Position in the window, px.
    row_height : int
        Height of an option, px.
    highlighted : int
        Index of the highlighted option.
    top : float
        Scroll offset: the height of the options hidden above the visible part, px.
    picked : str or None
        Option that the user has picked; None until then.
    """

    key: str
    options: list[str]
    rect: Rect
    row_height: int
    highlighted: int = 0
    top: float = 0.0
    picked: str | None = None

    @property
    def max_top(self) -> float:
        """Maximum of `top`: the height by which the options exceed the list, px."""
        return max(len(self.options) * self.row_height + 2 * LIST_EDGE_PX - self.rect.height, 0)

    @property
    def _inner_rect(self) -> Rect:
        """The part of the list inside its edge."""
        return self.rect.inflate(-2 * LIST_EDGE_PX, -2 * LIST_EDGE_PX)

    def get_item_rect(self, number: int) -> Rect:
        """Return the position of an option in the window, even if it is scrolled out of view."""
        inner = self._inner_rect
        y = inner.top + number * self.row_height - round(self.top)
        return Rect(inner.left, y, inner.width, self.row_height)

    def find_item(self, pixel: tuple[int, int]) -> int | None:
        """Return the index of the option at a pixel; None if there is none."""
        number = int((pixel[1] - self._inner_rect.top + self.top) // self.row_height)
        is_item = self.rect.collidepoint(pixel) and 0 <= number < len(self.options)
        return number if is_item else None

    def highlight(self, number: int) -> None:
        """Highlight the option with this index, limited to the list, and scroll it into view."""
        self.highlighted = min(max(number, 0), len(self.options) - 1)
        # Range of scroll offsets at which the whole option is visible.
        low = self.highlighted * self.row_height
        high = (self.highlighted + 1) * self.row_height + 2 * LIST_EDGE_PX - self.rect.height
        self.top = min(max(self.top, high, 0.0), low)

    def highlight_at(self, pixel: tuple[int, int]) -> None:
        """Highlight the option at a pixel, if there is one."""
        number = self.find_item(pixel)
        if number is not None:
            self.highlighted = number

    def handle_event(self, event: pygame.event.Event) -> ListResponse:
        """Handle an event. While the list is open, it gets all events."""
        if event.type == pygame.MOUSEBUTTONDOWN:
            number = self.find_item(event.pos)
            if number is None:
                return ListResponse.CLOSED
            return self._pick(number)
        if event.type == pygame.MOUSEWHEEL:
            top = self.top - get_wheel_notches(event) * self.row_height
            self.top = min(max(top, 0.0), self.max_top)
            return ListResponse.HANDLED
        if event.type == pygame.KEYDOWN:
            return self._handle_key(get_key_name(event))
        if event.type in (pygame.MOUSEBUTTONUP, pygame.TEXTINPUT):
            return ListResponse.HANDLED
        return ListResponse.IGNORED

    def _handle_key(self, name: str) -> ListResponse:
        """Handle a key: move the highlight, pick an option, or close the list on any other key."""
        if name in _KEY_STEPS:
            self.highlight(self.highlighted + _KEY_STEPS[name])
            return ListResponse.HANDLED
        if name in (*ENTER_KEYS, "space"):
            return self._pick(self.highlighted)
        if len(name) == 1 and self._highlight_by_letter(name):
            return ListResponse.HANDLED
        if is_function_key(name):
            return ListResponse.IGNORED
        return ListResponse.CLOSED

    def _pick(self, number: int) -> ListResponse:
        self.picked = self.options[number]
        return ListResponse.PICKED

    def _highlight_by_letter(self, letter: str) -> bool:
        """Highlight the next option that starts with a letter; return whether there is one."""
        numbers = [k for k, option in enumerate(self.options) if option.lower().startswith(letter)]
        if not numbers:
            return False
        self.highlight(next((number for number in numbers if number > self.highlighted), numbers[0]))
        return True

    def draw(self, screen: Surface, theme: Theme, scale: float) -> None:
        """Draw the list over the window."""
        field = get_field_color(theme)
        edge = mix(theme.panel, theme.ink, _EDGE_STRENGTH)
        draw_rounded_box(screen, self.rect, field, edge=edge, radius=round(_RADIUS_PX * scale))
        inner = self._inner_rect
        text_margins = _TEXT_MARGINS_PX
        if self.max_top:
            text_margins = _SCROLLED_TEXT_MARGINS_PX
        max_text_width = inner.width - round(text_margins * scale)
        text_left = inner.left + round(_TEXT_LEFT_PX * scale)
        size = round(_TEXT_PX * scale)
        screen.set_clip(inner)
        for number, option in enumerate(self.options):
            item = self.get_item_rect(number)
            if not item.colliderect(inner):
                continue
            if number == self.highlighted:
                screen.fill(mix(field, theme.accent, _HIGHLIGHT_STRENGTH), item)
            text = render_text(shorten_to_width(option, size, max_text_width), size, theme.ink)
            screen.blit(text, text.get_rect(midleft=(text_left, item.centery)))
        if self.max_top:
            self._draw_scroll_bar(screen, inner, theme, scale)
        screen.set_clip(None)

    def _draw_scroll_bar(self, screen: Surface, inner: Rect, theme: Theme, scale: float) -> None:
        full_height = inner.height + self.max_top
        bar = Rect(0, 0, round(_BAR_WIDTH_PX * scale), round(inner.height * inner.height / full_height))
        top = inner.top + round(self.top * inner.height / full_height)
        bar.topright = inner.right - round(_BAR_MARGIN_PX * scale), top
        color = mix(theme.panel, theme.ink, _BAR_STRENGTH)
        draw_rounded_box(screen, bar, color, edge=color, radius=round(_BAR_WIDTH_PX / 2 * scale))
