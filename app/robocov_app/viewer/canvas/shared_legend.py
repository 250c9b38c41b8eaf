"""The legend that several panes share."""

import pygame

from robocov_app.look.hues import choose_robot_hues
from robocov_app.look.theme import Theme
from robocov_app.render.annotations.legend_strip import arrange_legend_rows, render_legend_strip
from robocov_app.render.canvas import Canvas, LegendEntry
from robocov_app.toolkit.overlay import create_flat_canvas
from robocov_app.toolkit.window.layout import Layout


class SharedLegend:
    """Draws the legend of several panes, and caches its image.

    Parameters
    ----------
    theme : Theme
        Colors.

    Attributes
    ----------
    theme : Theme
        Colors.
    """

    def __init__(self, theme: Theme) -> None:
        self.theme = theme
        self._rows = 1
        self._rows_key: object = None  # layout and layers for which `_rows` was computed
        self._picture = pygame.Surface((1, 1))
        self._picture_key: object = None  # entries and size for which `_picture` was drawn

    def count_rows(self, entries: list[LegendEntry], layout: Layout, layers: frozenset[str]) -> int:
        """Return the number of rows needed; it never decreases within a layout, so that panes do not jump."""
        # Only the width of the page, that of the arena, matters for arranging the rows.
        page = pygame.Surface((layout.arena.width, 1))
        rows = len(arrange_legend_rows(create_flat_canvas(page, self.theme, layout.scale), entries))
        key = (layout.size, layout.scale, len(layout.panes), layers)
        if key == self._rows_key:
            rows = max(rows, self._rows)
        self._rows = max(rows, 1)
        self._rows_key = key
        return self._rows

    def draw(
        self, screen: pygame.Surface, entries: list[LegendEntry], layout: Layout, layers: frozenset[str]
    ) -> None:
        """Draw the legend at its position in the layout."""
        x, y, width, height = layout.legend
        key = (tuple(entry.key for entry in entries), layout.legend, self.theme.name, layout.scale)
        if key != self._picture_key:
            page = pygame.Surface((width, max(height, 1)), 0, 32)
            page.fill(self.theme.background)
            camera = create_flat_canvas(page, self.theme, layout.scale).camera
            canvas = Canvas(page, camera, self.theme, layout.scale, choose_robot_hues(1), layers)
            page.blit(render_legend_strip(entries, canvas), (0, 0))
            self._picture = page
            self._picture_key = key
        screen.blit(self._picture, (x, y), pygame.Rect(0, 0, width, height))
