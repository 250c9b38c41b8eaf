"""What stands around the arena: scale bar, status line and legend, each in a strip of its own."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import pygame

from robocov_app.view.camera import length_label, round_length
from robocov_app.view.canvas import Canvas
from robocov_app.view.fonts import shortened
from robocov_app.view.layers import Layer, LegendEntry
from robocov_app.view.scene import Scene

if TYPE_CHECKING:
    from collections.abc import Iterable

MARGIN = 14.0
LEGEND_ROW = 22.0
STRIP = 34.0
_GLYPH = 28.0
_GAP = 18.0
"""Pixels at scale 1."""


class ScaleBar(Layer):
    """A bar of a round length in metres."""

    name = "scale_bar"
    title = "Scale bar"
    in_world = False

    def draw(self, canvas: Canvas, scene: Scene) -> None:
        length = bar_length(canvas)
        pixels = length * canvas.camera.zoom
        left = MARGIN * canvas.scale
        y = canvas.surface.get_height() - 0.5 * STRIP * canvas.scale
        tick, width = 4.0 * canvas.scale, canvas.width(1.5)
        ink = canvas.theme.ink
        for x in (left, left + pixels):
            box = pygame.Rect(round(x - width / 2), round(y - tick), width, round(2 * tick))
            canvas.surface.fill(ink, box)
        canvas.surface.fill(ink, pygame.Rect(round(left), round(y - width / 2), round(pixels), width))
        canvas.text(length_label(length), (left + pixels + 8 * canvas.scale, y), bold=True)


def bar_length(canvas: Canvas) -> float:
    """Return the length of the scale bar in metres: round, and at most an eighth of the surface wide."""
    room = min(max(canvas.surface.get_width() / 8, 30.0), 160 * canvas.scale)
    return round_length(room / canvas.camera.zoom)


class Status(Layer):
    """Time, controller and cost in the strip below the arena."""

    name = "status"
    title = "Status line"
    in_world = False

    def draw(self, canvas: Canvas, scene: Scene) -> None:
        bar = bar_length(canvas)
        taken = (
            (MARGIN + 8 + 16) * canvas.scale
            + bar * canvas.camera.zoom
            + canvas.text_width(length_label(bar), bold=True)
        )
        right = canvas.surface.get_width() - MARGIN * canvas.scale
        y = canvas.surface.get_height() - 0.5 * STRIP * canvas.scale
        text = shortened(status_text(scene), canvas.text_size(canvas.theme.text), right - taken)
        canvas.text(text, (right, y), anchor="right", colour=canvas.theme.ink)


def status_text(scene: Scene) -> str:
    """Return what the status line says, what may be cut last: the map's name."""
    time = f"t = {scene.snapshot.time:.1f} s" if scene.snapshot is not None else ""
    return "   ·   ".join(text for text in (scene.label, time, scene.cost, scene.environment.name) if text)


class Legend(Layer):
    """Glyphs, drawn as the layers draw them, with words; only of the layers that are shown."""

    name = "legend"
    title = "Legend"
    in_world = False

    def __init__(self) -> None:
        self.entries: list[LegendEntry] = []
        self._strip: pygame.Surface | None = None
        self._key: object = None

    def draw(self, canvas: Canvas, scene: Scene) -> None:
        width = canvas.surface.get_width()
        words = tuple((entry.text, entry.style) for entry in self.entries)
        key = (words, width, canvas.theme.name, canvas.scale, canvas.hues[:1].tolist())
        if self._strip is None or key != self._key:
            rows = legend_rows(canvas, self.entries)
            height = round((6.0 + LEGEND_ROW * len(rows)) * canvas.scale)
            self._strip, self._key = pygame.Surface((width, height), 0, 32), key
            self._strip.fill(canvas.theme.background)
            self._fill(replace(canvas, surface=self._strip), rows)
        canvas.surface.blit(self._strip, (0, 0))

    @staticmethod
    def _fill(canvas: Canvas, rows: list[list[LegendEntry]]) -> None:
        for number, row in enumerate(rows):
            x = MARGIN * canvas.scale
            y = (6.0 + LEGEND_ROW * (number + 0.5)) * canvas.scale
            for entry in row:
                entry.draw(canvas, x + 0.5 * (_GLYPH - 6) * canvas.scale, y)
                x += _GLYPH * canvas.scale
                x += canvas.text(entry.text, (x, y), size=canvas.theme.small_text) + _GAP * canvas.scale


def legend_rows(canvas: Canvas, entries: Iterable[LegendEntry]) -> list[list[LegendEntry]]:
    """Break the entries into rows that fit the surface's width."""
    room = canvas.surface.get_width() - 2 * MARGIN * canvas.scale
    rows: list[list[LegendEntry]] = []
    used = 0.0
    for entry in entries:
        wide = _GLYPH * canvas.scale + canvas.text_width(entry.text, canvas.theme.small_text)
        if not rows or used + wide > room:
            rows.append([])
            used = 0.0
        rows[-1].append(entry)
        used += wide + _GAP * canvas.scale
    return rows
