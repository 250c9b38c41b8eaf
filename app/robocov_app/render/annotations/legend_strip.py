"""The legend: a strip of symbols and texts above the arena, or a separate picture."""

from collections.abc import Iterable, Sequence, Set
from dataclasses import replace

import numpy as np
import pygame
from numpy.typing import NDArray

from robocov_app.look.hues import choose_robot_hues
from robocov_app.look.theme import Theme
from robocov_app.render.camera import Camera
from robocov_app.render.canvas import Canvas, LegendEntry
from robocov_app.render.scene import Scene
from robocov_app.render.surface_cache import LatestValue

# Lengths in pixels at scale 1.
MARGIN_PX = 14.0
"""Space at the sides of the legend and around the arena."""
ROW_HEIGHT_PX = 22.0
PADDING_PX = 6.0
"""Space above the first row and below the last one."""
_SYMBOL_WIDTH_PX = 28.0
"""Width of a symbol with the space before its text."""
_SYMBOL_GAP_PX = 6
_ENTRY_GAP_PX = 18.0


class LegendLayer:
    """Draws the legend of a picture; the strip is rendered again when its content changes."""

    def __init__(self) -> None:
        self._strip = LatestValue[pygame.Surface]()

    def draw(self, canvas: Canvas, scene: Scene) -> None:
        """Draw the legend at the top of the surface."""
        # Everything on which the strip depends. Symbols have the color of the first robot.
        key = (
            tuple(entry.key for entry in canvas.legend),
            canvas.surface.get_width(),
            canvas.theme.name,
            canvas.scale,
            canvas.hues[:1].tolist(),
            canvas.visible_layers,
        )
        strip = self._strip.get_or_compute(None, key, lambda: render_legend_strip(canvas.legend, canvas))
        canvas.surface.blit(strip, (0, 0))


def render_legend_strip(entries: Iterable[LegendEntry], canvas: Canvas) -> pygame.Surface:
    """Render a legend that is as wide as the surface of a canvas.

    Parameters
    ----------
    entries : iterable of LegendEntry
    canvas : Canvas

    Returns
    -------
    pygame.Surface
    """
    scale = canvas.scale
    rows = arrange_legend_rows(canvas, entries)
    height = round((PADDING_PX + ROW_HEIGHT_PX * max(len(rows), 1)) * scale)
    strip = pygame.Surface((canvas.surface.get_width(), height), 0, 32)
    strip.fill(canvas.theme.background)
    strip_canvas = replace(canvas, surface=strip)
    for index, row in enumerate(rows):
        x = MARGIN_PX * scale
        y = (PADDING_PX + ROW_HEIGHT_PX * (index + 0.5)) * scale
        for entry in row:
            entry.draw(strip_canvas, x + 0.5 * (_SYMBOL_WIDTH_PX - _SYMBOL_GAP_PX) * scale, y)
            x += _SYMBOL_WIDTH_PX * scale
            x += strip_canvas.draw_text(entry.text, (x, y), size=canvas.theme.small_text)
            x += _ENTRY_GAP_PX * scale
    return strip


def render_legend_image(
    entries: Sequence[LegendEntry],
    width: int,
    theme: Theme,
    scale: float,
    visible_layers: Set[str] = frozenset(),
) -> NDArray[np.uint8]:
    """Render a legend as a separate picture.

    Parameters
    ----------
    entries : sequence of LegendEntry
    width : int, px
    theme : Theme
    scale : float
    visible_layers : set of str
        Names of the layers that the pictures show.

    Returns
    -------
    (h, width, 3) array of uint8
        RGB values.
    """
    camera = Camera((0.0, 0.0), 1.0, (0.0, 0.0, float(width), 1.0))
    canvas = Canvas(
        pygame.Surface((width, 1)), camera, theme, scale, choose_robot_hues(1), frozenset(visible_layers)
    )
    strip = render_legend_strip(entries, canvas)
    pixels = np.frombuffer(pygame.image.tobytes(strip, "RGB"), dtype=np.uint8)
    return pixels.reshape(strip.get_height(), width, 3)


def arrange_legend_rows(canvas: Canvas, entries: Iterable[LegendEntry]) -> list[list[LegendEntry]]:
    """Break the entries of a legend into rows that fit into the width of a canvas.

    Parameters
    ----------
    canvas : Canvas
    entries : iterable of LegendEntry

    Returns
    -------
    list of list of LegendEntry
        The entries of each row, from the top.
    """
    row_width = canvas.surface.get_width() - 2 * MARGIN_PX * canvas.scale
    rows: list[list[LegendEntry]] = []
    used_width = 0.0
    for entry in entries:
        text_width = canvas.measure_text(entry.text, canvas.theme.small_text)
        entry_width = _SYMBOL_WIDTH_PX * canvas.scale + text_width
        if not rows or used_width + entry_width > row_width:
            rows.append([])
            used_width = 0.0
        rows[-1].append(entry)
        used_width += entry_width + _ENTRY_GAP_PX * canvas.scale
    return rows
