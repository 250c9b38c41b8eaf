"""Draws the texts and the frames of the items of the start page."""

from __future__ import annotations

from dataclasses import dataclass

from pygame import Rect, Surface

from robocov_app.look.colors import Color, mix
from robocov_app.look.theme import Theme
from robocov_app.render.fonts import render_text
from robocov_app.toolkit.overlay import draw_rounded_box

# Lengths in pixels at scale 1.
_RADIUS_PX = 8
_EDGE_STRENGTH = 0.18  # fraction of ink in the edges of items without the focus


@dataclass(frozen=True)
class StartDrawing:
    """A frame of the start page while it is drawn.

    Attributes
    ----------
    screen : Surface
    theme : Theme
    scale : float
        Scale of texts and lines.
    seconds : float
        Time of the examples.
    """

    screen: Surface
    theme: Theme
    scale: float
    seconds: float

    def px(self, length: float) -> int:
        """Return a length, px at scale 1, in pixels."""
        return round(length * self.scale)

    def write(
        self, text: str, position: tuple[float, float], size: float, color: Color, *, bold: bool = False
    ) -> None:
        """Write a text with its upper left corner at a pixel; `size` is in px at scale 1."""
        image = render_text(text, self.px(size), color, bold=bold)
        self.screen.blit(image, (round(position[0]), round(position[1])))

    def draw_frame(self, box: Rect, *, is_focused: bool) -> None:
        """Draw the background and the edge of an item; the edge is thick and colored if it has the focus."""
        theme = self.theme
        edge = theme.accent if is_focused else mix(theme.panel, theme.ink, _EDGE_STRENGTH)
        width = max(self.px(2 if is_focused else 1), 1)
        draw_rounded_box(
            self.screen, box, theme.background, edge=edge, radius=self.px(_RADIUS_PX), width=width
        )
