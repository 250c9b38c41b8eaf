"""The maps of the start page: a row of thumbnails that can be scrolled."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from pygame import Rect

from robocov_app.render.fonts import render_text, shorten_to_width
from robocov_app.viewer.start.cards import StartChoice, choose_map
from robocov_app.viewer.start.drawing import StartDrawing
from robocov_app.viewer.start.items import StartItem
from robocov_app.viewer.start.layout import StartLayout
from robocov_app.viewer.start.previews import PreviewStore, draw_outline

# Lengths in pixels at scale 1.
_NAME_PX = 11
_NAME_LINE_PX = 18
_NAME_MARGIN_PX = 4
_BOTTOM_PX = 5
_MARGIN_PX = 6


class MapSection:
    """A row of thumbnails of the bundled maps, which can be scrolled.

    Parameters
    ----------
    previews : PreviewStore
        The outlines of the maps.
    choose : callable
        Called with the choice of a map.

    Attributes
    ----------
    names : list of str
        Names of all maps.
    """

    def __init__(self, previews: PreviewStore, choose: Callable[[StartChoice], None]) -> None:
        self.names = list(previews.outlines)
        self._previews = previews
        self._choose = choose
        self._first = 0  # index of the first thumbnail that is shown
        self._shown_count = 0

    def scroll(self, steps: int) -> None:
        """Show later or earlier thumbnails."""
        self._first = min(max(self._first + steps, 0), self._last_first)

    @property
    def _last_first(self) -> int:
        """Index of the first thumbnail when the last ones are shown."""
        return max(len(self.names) - self._shown_count, 0)

    def can_scroll(self, layout: StartLayout) -> bool:
        """Return whether some thumbnails do not fit."""
        return len(self.names) > len(layout.maps)

    def list_items(self, layout: StartLayout) -> list[StartItem]:
        """Scroll to a valid position for a layout, and return the thumbnails that are shown."""
        self._shown_count = len(layout.maps)
        self._first = min(self._first, self._last_first)
        items: list[StartItem] = []
        for name, box in zip(self.names[self._first :], layout.maps, strict=False):
            action = partial(self._choose, choose_map(name))
            items.append(StartItem(f"map:{name}", box, action, partial(self._draw_map, name, box)))
        return items

    def _draw_map(self, name: str, box: Rect, drawing: StartDrawing, is_focused: bool) -> None:
        """Draw the thumbnail of a map above its name."""
        theme = drawing.theme
        drawing.draw_frame(box, is_focused=is_focused)
        margin = drawing.px(_MARGIN_PX)
        picture = Rect(box.left, box.top, box.width, box.height - drawing.px(_NAME_LINE_PX))
        picture = picture.inflate(-2 * margin, -2 * margin)
        outline = self._previews.outlines[name]
        draw_outline(drawing.screen, outline, picture, theme, drawing.scale, outside=theme.background)
        width = box.width - 2 * _NAME_MARGIN_PX * drawing.scale
        text = shorten_to_width(name, drawing.px(_NAME_PX), width)
        image = render_text(text, drawing.px(_NAME_PX), theme.ink)
        bottom = box.bottom - drawing.px(_BOTTOM_PX)
        drawing.screen.blit(image, image.get_rect(midbottom=(box.centerx, bottom)))
