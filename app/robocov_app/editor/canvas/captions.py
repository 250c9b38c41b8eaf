"""The strips above and below the sheet: the legend; scale bar, whose map it is and what it is like."""

from dataclasses import replace

import pygame

from robocov.errors import counted
from robocov_app.editor.canvas.map_layers import beyond
from robocov_app.editor.canvas.overlay import legend_entries
from robocov_app.editor.ui.editor import Editor
from robocov_app.editor.ui.team import Team
from robocov_app.render.annotations import (
    EDGE,
    LEGEND_ROW,
    STRIP,
    bar_length,
    draw_scale_bar,
    legend_rows,
    legend_strip,
)
from robocov_app.render.canvas import Canvas, LegendEntry
from robocov_app.render.density import range_label, value_range
from robocov_app.render.fonts import shortened
from robocov_app.render.heatmaps import density_entry
from robocov_app.toolkit.cache import Latest
from robocov_app.toolkit.layout import Box


class Strips:
    """Draws the strips, and says what they leave to the sheet."""

    def __init__(self, editor: Editor) -> None:
        self._editor = editor
        self._entries: list[LegendEntry] = []
        self._rows = 1
        self._rows_for: object = None
        self._unfree: Latest[bool] = Latest()
        self._legend: Latest[pygame.Surface] = Latest()

    def room(self, box: Box, scale: float) -> tuple[float, float, float, float]:
        """Return what of a box is left: left, top, width and height, px."""
        left, top, width, height = box
        above = round((10 + LEGEND_ROW * self._rows) * scale) if "legend" in self._editor.shown else 0
        below = max(height - above - round(STRIP * scale), 1)
        return float(left), float(top + above), float(width), float(below)

    def update(self, canvas: Canvas, team: Team | None) -> None:
        """Look what there is to tell, on a canvas as wide as the sheet."""
        editor = self._editor
        self._entries = self._found(team)
        rows = max(len(legend_rows(canvas, self._entries)), 1)
        key = (canvas.surface.get_width(), canvas.scale, editor.document, "legend" in editor.shown)
        # while things come and go the legend does not become lower again: the map is not to jump
        self._rows = max(rows, self._rows) if key == self._rows_for else rows
        self._rows_for = key

    def _found(self, team: Team | None) -> list[LegendEntry]:
        sketch, shown = self._editor.sketch, self._editor.shown
        if "legend" not in shown:
            return []
        unfree = self._unfree.of(sketch.boundary, None, lambda: beyond(sketch).area > 1e-6)
        standing = "robots" in shown and team is not None and bool(team.places)
        measurement = self._editor.measurement if "impassable" in shown else None
        found = legend_entries(measurement, starts=bool(sketch.starts), team=standing, unfree=unfree)
        density = sketch.density
        if density is not None and not density.uniform and sketch.boundary:
            x, y = zip(*sketch.boundary, strict=True)
            span = value_range(density, (min(x), min(y), max(x), max(y)))
            found.append(density_entry(range_label(span)))
        return found

    def draw(self, screen: pygame.Surface, canvas: Canvas, box: Box) -> None:
        """Draw both strips."""
        left, top, width, height = box
        if self._entries:
            key = (tuple(entry.text for entry in self._entries), width, canvas.theme.name, canvas.scale)
            wide = replace(canvas, surface=pygame.Surface((width, 1)))
            legend = self._legend.of(None, key, lambda: legend_strip(self._entries, wide))
            screen.blit(legend, (left, top))
        high = round(STRIP * canvas.scale)
        foot = screen.subsurface(pygame.Rect(left, top + height - high, width, high))
        own = replace(canvas, surface=foot)
        draw_scale_bar(own)
        taken = (EDGE + 90) * canvas.scale + bar_length(own) * canvas.camera.zoom
        size = canvas.text_size(canvas.theme.text)
        words = shortened(map_words(self._editor), size, width - taken - EDGE * canvas.scale)
        own.text(words, (width - EDGE * canvas.scale, high / 2), anchor="right")


def map_words(editor: Editor) -> str:
    """Return what the strip below the sheet says: whose map it is, and what it is like."""
    sketch, measurement = editor.sketch, editor.measurement
    unsaved = "● " if editor.document.unsaved else ""
    said = [f"{unsaved}{editor.document.title}", counted(len(sketch.obstacles), "obstacle")]
    if measurement is not None:
        said.append(f"{measurement.free_area:.2f} m² free")
        if grave := sum(problem.grave for problem in measurement.problems):
            said.append(f"draft: {counted(grave, 'problem')}")
    return "   ·   ".join(said)
