"""Tooltips: short texts, some with a drawing, that appear when the mouse rests on a widget."""

from collections.abc import Callable
from time import perf_counter
from typing import Literal, NamedTuple, TypeAlias

from pygame import BLEND_PREMULTIPLIED, Rect, Surface

from robocov_app.look.colors import Color, mix
from robocov_app.look.theme import LIGHT, Theme
from robocov_app.render.fonts import measure_text, render_text
from robocov_app.toolkit.overlay import draw_rounded_box, wrap_text

TIP_DELAY_S = 0.6
"""Time for which the mouse must rest before a tooltip appears."""

TIP_TEXT_COLOR: Color = (245, 247, 250)
"""Tooltips are light on dark in both themes."""
# Lengths in pixels at scale 1.
_TEXT_PX = 11.0
_LINE_PX = 16.0
_MAX_WIDTH_PX = 240.0
_GAP_TO_WIDGET_PX = 5.0
_TOP_MARGIN_PX = 5.0
"""Distance of the text from the top of the box, and of a drawing from the text."""
_CORNER_RADIUS_PX = 4.0
_SIDE_MARGIN_PX = 7.0
"""Distance of the content from the left and right edges of the box."""
_EXTRA_HEIGHT_PX = 9.0
"""Height of the box in addition to that of its content."""
_FILL_STRENGTH = 0.2
"""Fraction of the color of text in the background of tooltips, with the dark theme."""
_LIGHT_FILL_STRENGTH = 0.92
_EDGE_STRENGTH = 0.24

TipDrawing: TypeAlias = Callable[[float], Surface]
"""Function that renders a drawing for a tooltip, with premultiplied alpha, at a scale."""

TipSide: TypeAlias = Literal["below", "left", "right"]
"""Side on which a tooltip appears: below its widget, or to the left or right of the page with the widget."""


class _Line(NamedTuple):
    """A line of a tooltip."""

    text: str
    is_title: bool


class ToolTip:
    """Decides when the tooltip of a widget is due.

    Attributes
    ----------
    is_immediate : bool
        Whether tooltips appear at once, because the widgets show no names.
    """

    def __init__(self) -> None:
        self.is_immediate = False
        self._hovered = ""
        self._is_dismissed = False
        self._rested_since_s = perf_counter()

    def restart(self) -> None:
        """Restart the waiting time, because a key was pressed."""
        self._rested_since_s = perf_counter()

    def dismiss(self) -> None:
        """Show no tooltip until the mouse is over another widget, because this one was pressed."""
        self._is_dismissed = True

    def set_hovered(self, widget: str) -> bool:
        """Set the widget under the mouse, and return whether it is another one than before.

        Parameters
        ----------
        widget : str
            Kind and key of the widget; empty if there is none.
        """
        if widget == self._hovered:
            return False
        self._hovered = widget
        self._is_dismissed = False
        self.restart()
        return True

    @property
    def is_due(self) -> bool:
        """Whether the mouse has rested long enough over a widget that was not pressed."""
        if self._is_dismissed:
            return False
        return self.is_immediate or perf_counter() - self._rested_since_s >= TIP_DELAY_S


def draw_tool_tip(
    screen: Surface,
    text: str,
    theme: Theme,
    scale: float,
    *,
    widget: Rect,
    page: Rect,
    side: TipSide = "below",
    drawing: TipDrawing | None = None,
) -> None:
    """Draw a tooltip next to a widget, or next to the page that contains it.

    Parameters
    ----------
    screen : pygame.Surface
        Surface to draw on; its size is that of the window.
    text : str
        If it has several lines, the first one is a title.
    theme : Theme
    scale : float
        Factor by which text sizes and margins are multiplied.
    widget : pygame.Rect
        Position of the widget in the window, px.
    page : pygame.Rect
        Position of the panel, bar or menu with the widget, px.
    side : TipSide
        "below" the widget, or to the "left" or "right" of its page. If there is no space next to the page,
        the tooltip is below it; if there is none below either, it is above.
    drawing : TipDrawing, optional
        Drawing below the text.
    """
    text_size = round(_TEXT_PX * scale)
    line_height = round(_LINE_PX * scale)
    gap = round(_GAP_TO_WIDGET_PX * scale)
    top_margin = round(_TOP_MARGIN_PX * scale)
    lines = _list_lines(text, text_size, round(_MAX_WIDTH_PX * scale))
    width = max(measure_text(line.text, text_size, bold=line.is_title) for line in lines)
    height = line_height * len(lines)
    image: Surface | None = None
    if drawing is not None:
        image = drawing(scale)
        width = max(width, image.get_width())
        height += top_margin + image.get_height()
    box_size = (width + round(2 * _SIDE_MARGIN_PX * scale), height + round(_EXTRA_HEIGHT_PX * scale))
    box = _place_box(box_size, widget, page, side, gap=gap, window=screen.get_rect())
    _draw_box(screen, box, theme, scale)
    left = box.left + round(_SIDE_MARGIN_PX * scale)
    top = box.top + top_margin
    for line in lines:
        screen.blit(render_text(line.text, text_size, TIP_TEXT_COLOR, bold=line.is_title), (left, top))
        top += line_height
    if image is not None:
        screen.blit(image, (left, top + top_margin), special_flags=BLEND_PREMULTIPLIED)


def _place_box(
    size: tuple[int, int], widget: Rect, page: Rect, side: TipSide, *, gap: int, window: Rect
) -> Rect:
    """Return the box of a tooltip in the window; `gap` is its distance from the widget or the page, px."""
    box = Rect((0, 0), size)
    # Above its page, the top bar would cover a tooltip.
    below_top_of_page = Rect(window.left, page.top, window.width, window.bottom - page.top)
    if side == "right":
        box.midleft = page.right + gap, widget.centery
        if box.right <= window.right:
            return box.clamp(below_top_of_page)
    elif side == "left":
        box.midright = page.left - gap, widget.centery
        if box.left >= window.left:
            return box.clamp(below_top_of_page)
    anchor = widget if side == "below" else page
    box.midtop = widget.centerx, anchor.bottom + gap
    if box.bottom > window.bottom:
        box.bottom = anchor.top - gap
    return box.clamp(window)


def _draw_box(screen: Surface, box: Rect, theme: Theme, scale: float) -> None:
    """Draw the empty box of a tooltip; its text is light in both themes."""
    strength = _FILL_STRENGTH
    if theme is LIGHT:
        strength = _LIGHT_FILL_STRENGTH
    fill = mix(theme.panel, theme.ink, strength)
    edge = mix(theme.panel, theme.ink, _EDGE_STRENGTH)
    draw_rounded_box(screen, box, fill, edge=edge, radius=round(_CORNER_RADIUS_PX * scale))


def _list_lines(text: str, text_size: int, width: float) -> list[_Line]:
    """Wrap a text into lines of limited width, px; the first of several paragraphs is the title."""
    paragraphs = text.split("\n")
    lines = []
    for number, paragraph in enumerate(paragraphs):
        is_title = number == 0 and len(paragraphs) > 1
        lines += [_Line(line, is_title) for line in wrap_text(paragraph, text_size, width, bold=is_title)]
    return lines
