"""The items of the start page that can be chosen, and which of them is highlighted."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from pygame import Rect

from robocov_app.viewer.start.drawing import StartDrawing


@dataclass(frozen=True)
class StartItem:
    """An element of the page that can be clicked, or chosen by arrow keys and Enter.

    Attributes
    ----------
    name : str
        Unique name.
    box : Rect
        Position and size, px.
    action : callable
        Called when the item is chosen.
    draw : callable
        Draws it; called with a `StartDrawing` and whether the item is highlighted.
    """

    name: str
    box: Rect
    action: Callable[[], object]
    draw: Callable[[StartDrawing, bool], None]


class ItemFocus:
    """Highlights one of the items.

    Attributes
    ----------
    items : sequence of StartItem
        All items, in the order of Tab.
    name : str
        Name of the highlighted item; empty if there is none.
    """

    def __init__(self) -> None:
        self.items: Sequence[StartItem] = ()
        self.name = ""

    @property
    def item(self) -> StartItem | None:
        """The highlighted item; None if there is none."""
        return next((item for item in self.items if item.name == self.name), None)

    def find_at(self, pixel: tuple[int, int]) -> StartItem | None:
        """Return the item at a pixel; None if there is none."""
        return next((item for item in self.items if item.box.collidepoint(pixel)), None)

    def point_at(self, pixel: tuple[int, int]) -> None:
        """Highlight the item under the mouse."""
        item = self.find_at(pixel)
        if item is not None:
            self.name = item.name

    def step(self, steps: int) -> None:
        """Highlight the next or the previous item."""
        names = [item.name for item in self.items]
        if self.name in names:
            self.name = names[(names.index(self.name) + steps) % len(names)]
        else:
            self.name = names[0]

    def move(self, x: int, y: int) -> None:
        """Highlight the nearest item in a direction."""
        current = self.item
        if current is None:
            self.name = self.items[0].name
            return
        best: tuple[float, str] | None = None
        for item in self.items:
            dx = item.box.centerx - current.box.centerx
            dy = item.box.centery - current.box.centery
            along = dx * x + dy * y
            across = abs(dx * y) + abs(dy * x)
            # Items far to the side of the direction are left out, and others count as farther away.
            if along > 0 and along >= across / 2 and (best is None or along + 2 * across < best[0]):
                best = (along + 2 * across, item.name)
        if best is not None:
            self.name = best[1]

    def open(self) -> None:
        """Choose the highlighted item."""
        item = self.item
        if item is not None:
            item.action()
