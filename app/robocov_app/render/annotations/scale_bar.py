"""The scale bar, in the strip below the arena or in the caption of a low pane."""

from collections.abc import Set
from math import ceil

from pygame import Rect

from robocov_app.look.lengths import format_scale_length, round_down
from robocov_app.render.annotations.legend_strip import MARGIN_PX
from robocov_app.render.canvas import Canvas
from robocov_app.render.scene import Scene

# Lengths in pixels at scale 1.
EDGE_PX = MARGIN_PX + 2.0
"""Space at the sides of texts."""
STRIP_HEIGHT_PX = 34.0
"""Height of the strip below the arena."""
_STRIP_TEXT_HEIGHT_PX = 22.0
_STRIP_TEXT_MARGIN_PX = 2.0
"""Space in the box of a text of the strip, to the left and right of the text."""
_MAX_LOW_PANE_PX = 240.0
_MIN_SPACE_PX = 30.0
"""Minimum space for the scale bar, px of the surface at any scale. The bar itself may be shorter."""
_MAX_BAR_PX = 160
BAR_TEXT_GAP_PX = 8
"""Space between the bar and its text."""


def is_low_pane(height: float, scale: float, visible_layers: Set[str]) -> bool:
    """Return whether a pane is too low for a strip below the arena.

    The scale bar of such a pane is drawn in its caption.

    Parameters
    ----------
    height : float, px
    scale : float
    visible_layers : set of str
        Names of the layers that are drawn.

    Returns
    -------
    bool
    """
    return "caption" in visible_layers and height < _MAX_LOW_PANE_PX * scale


def draw_scale_bar(canvas: Canvas, scene: Scene | None = None) -> None:
    """Draw the scale bar in the strip below the arena, unless it is in the caption."""
    height = canvas.surface.get_height()
    if not is_low_pane(height, canvas.scale, canvas.visible_layers):
        draw_bar(canvas, EDGE_PX * canvas.scale, height - 0.5 * STRIP_HEIGHT_PX * canvas.scale)


def draw_bar(canvas: Canvas, left: float, y: float) -> float:
    """Draw a scale bar with its length.

    Parameters
    ----------
    canvas : Canvas
    left, y : float, px
        Left end of the bar.

    Returns
    -------
    float, px
        Width of the bar and its text.
    """
    length = choose_bar_length(canvas)
    bar_width = length * canvas.camera.zoom
    tick_height = 4.0 * canvas.scale
    thickness = canvas.scale_width(1.5)
    ink = canvas.theme.ink
    for x in (left, left + bar_width):
        tick = (round(x - thickness / 2), round(y - tick_height), thickness, round(2 * tick_height))
        canvas.surface.fill(ink, tick)
    canvas.surface.fill(ink, (round(left), round(y - thickness / 2), round(bar_width), thickness))
    text_left = bar_width + BAR_TEXT_GAP_PX * canvas.scale
    return text_left + canvas.draw_text(format_scale_length(length), (left + text_left, y), bold=True)


def find_strip(pane: Rect, scale: float) -> Rect:
    """Return the part of the strip below the map of a pane that contains texts, px."""
    strip = Rect(0, 0, pane.width - 2 * round(EDGE_PX * scale), round(_STRIP_TEXT_HEIGHT_PX * scale))
    strip.center = pane.centerx, pane.bottom - round(0.5 * STRIP_HEIGHT_PX * scale)
    return strip


def place_left(strip: Rect, width: float, scale: float) -> Rect:
    """Return the box of a text, or of the scale bar, of a given width, px, at the left end of a strip."""
    margin = ceil(_STRIP_TEXT_MARGIN_PX * scale)
    return Rect(strip.left - margin, strip.top, ceil(width) + 2 * margin, strip.height)


def place_right(strip: Rect, width: float, scale: float) -> Rect:
    """Return the box of a text of a given width, px, at the right end of a strip."""
    box = place_left(strip, width, scale)
    box.right = strip.right + ceil(_STRIP_TEXT_MARGIN_PX * scale)
    return box


def measure_bar(canvas: Canvas) -> float:
    """Return the width of the scale bar and its text, px."""
    length = choose_bar_length(canvas)
    text_width = canvas.measure_text(format_scale_length(length), bold=True)
    return length * canvas.camera.zoom + BAR_TEXT_GAP_PX * canvas.scale + text_width


def choose_bar_length(canvas: Canvas) -> float:
    """Choose the length of the scale bar.

    Parameters
    ----------
    canvas : Canvas

    Returns
    -------
    float, m
        The largest round length that fits into the space for the bar.
    """
    max_width = min(max(canvas.surface.get_width() / 8, _MIN_SPACE_PX), _MAX_BAR_PX * canvas.scale)
    return round_down(max_width / canvas.camera.zoom)
