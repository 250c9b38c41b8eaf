"""Tool tips: short texts that appear when the mouse rests on a widget."""

from time import perf_counter

from pygame import Rect, Surface

from robocov_app.look.colors import Color, mix
from robocov_app.look.theme import LIGHT, Theme
from robocov_app.render.fonts import measure_text, render_text
from robocov_app.toolkit.overlay import draw_rounded_box, wrap_text

TIP_DELAY_S = 0.6
"""Time for which the mouse must rest before a tool tip appears."""

_TEXT_COLOR: Color = (245, 247, 250)
# Lengths in pixels at scale 1.
_TEXT_PX = 11.0
_LINE_PX = 16.0
_MAX_WIDTH_PX = 240.0
_DISTANCE_PX = 5.0
"""Distance of the tip from the widget."""
_TEXT_LEFT_PX = 7.0
_TEXT_TOP_PX = 5.0
_MARGINS_PX = 9.0
"""Space above and below the text, both together."""
_CORNER_RADIUS_PX = 4.0
# Fractions of the color of text in the colors of the tip.
_FILL_STRENGTH = 0.2
_LIGHT_FILL_STRENGTH = 0.92
_EDGE_STRENGTH = 0.24


class ToolTip:
    """Decides when the tool tip of a widget is due."""

    def __init__(self) -> None:
        self._hovered = ""
        self._rested_since_s = perf_counter()

    def restart(self) -> None:
        """Restart the waiting time, because a button or key was pressed."""
        self._rested_since_s = perf_counter()

    def note_hovered(self, widget: str) -> bool:
        """Record the widget under the mouse, and return whether it has changed.

        Parameters
        ----------
        widget : str
            Kind and key of the widget; empty if there is none.
        """
        if widget == self._hovered:
            return False
        self._hovered = widget
        self.restart()
        return True

    @property
    def is_due(self) -> bool:
        """Whether the mouse has rested long enough."""
        return perf_counter() - self._rested_since_s >= TIP_DELAY_S


def draw_tool_tip(screen: Surface, text: str, theme: Theme, scale: float, *, x: int, widget: Rect) -> None:
    """Draw a tool tip below a widget, or above it if there is no space below.

    Parameters
    ----------
    screen : pygame.Surface
    text : str
    theme : Theme
    scale : float
        Size of texts and margins.
    x : int
        Left end of the tip, px.
    widget : pygame.Rect
        Position of the widget in the window, px.
    """
    size = round(_TEXT_PX * scale)
    line_height = round(_LINE_PX * scale)
    lines = wrap_text(text, size, round(_MAX_WIDTH_PX * scale))
    width = max(measure_text(line, size) for line in lines) + round(2 * _TEXT_LEFT_PX * scale)
    box = Rect(0, 0, width, line_height * len(lines) + round(_MARGINS_PX * scale))
    box.topleft = (x, widget.bottom + round(_DISTANCE_PX * scale))
    if box.bottom > screen.get_height():
        box.bottom = widget.top - round(_DISTANCE_PX * scale)
    box.clamp_ip(screen.get_rect())
    # The text is light in both themes.
    strength = _FILL_STRENGTH
    if theme is LIGHT:
        strength = _LIGHT_FILL_STRENGTH
    fill = mix(theme.panel, theme.ink, strength)
    edge = mix(theme.panel, theme.ink, _EDGE_STRENGTH)
    draw_rounded_box(screen, box, fill, edge=edge, radius=round(_CORNER_RADIUS_PX * scale))
    left = box.left + round(_TEXT_LEFT_PX * scale)
    for number, line in enumerate(lines):
        top = box.top + round(_TEXT_TOP_PX * scale) + number * line_height
        screen.blit(render_text(line, size, _TEXT_COLOR), (left, top))
