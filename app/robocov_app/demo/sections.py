"""Groups of widgets that come and go together, and what pygame_gui's containers do not offer."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeAlias

from pygame_gui.core import UIContainer
from pygame_gui.elements import UIScrollingContainer

if TYPE_CHECKING:
    from collections.abc import Callable

    import pygame
    from pygame_gui.elements import UIDropDownMenu, UIHorizontalSlider, UITextEntryLine

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
