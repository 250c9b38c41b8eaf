"""Annotations around the arena: scale bar, status line and legend, each in a strip of its own."""

from collections.abc import Iterable, Sequence, Set
from dataclasses import replace

import numpy as np
import pygame
from numpy.typing import NDArray

from robocov_app.look.lengths import format_scale_length, round_down
from robocov_app.look.robot_colors import choose_robot_hues
from robocov_app.look.theme import Theme
from robocov_app.render.camera import Camera
from robocov_app.render.canvas import Canvas, LegendEntry
from robocov_app.render.fonts import measure_text, shorten_to_width
from robocov_app.render.scene import Scene
from robocov_app.render.surface_cache import LatestValue

MARGIN = 14.0
EDGE = MARGIN + 2.0
LEGEND_ROW = 22.0
STRIP = 34.0
_SMALL = 240.0
_GLYPH = 28.0
_GAP = 18.0  # pixels at scale 1


def is_small(height: float, scale: float, shown: Set[str]) -> bool:
    """Return whether a pane is too low for a strip at its foot; its scale bar stands in the caption."""
    return "caption" in shown and height < _SMALL * scale


def draw_scale_bar(canvas: Canvas, scene: Scene | None = None) -> None:
    height = canvas.surface.get_height()
    if not is_small(height, canvas.scale, canvas.visible_layers):
        _draw_bar(canvas, EDGE * canvas.scale, height - 0.5 * STRIP * canvas.scale)


def _draw_bar(canvas: Canvas, left: float, y: float) -> float:
    """Draw a bar of a round length, with its length, and return how wide both are, px."""
    length = bar_length(canvas)
    pixels = length * canvas.camera.zoom
    tick, width = 4.0 * canvas.scale, canvas.scale_width(1.5)
    ink = canvas.theme.ink
    for x in (left, left + pixels):
        canvas.surface.fill(ink, (round(x - width / 2), round(y - tick), width, round(2 * tick)))
    canvas.surface.fill(ink, (round(left), round(y - width / 2), round(pixels), width))
    space = pixels + 8 * canvas.scale
    return space + canvas.draw_text(format_scale_length(length), (left + space, y), bold=True)


def bar_length(canvas: Canvas) -> float:
    room = min(max(canvas.surface.get_width() / 8, 30.0), 160 * canvas.scale)
    return round_down(room / canvas.camera.zoom)


def draw_caption(canvas: Canvas, scene: Scene) -> None:
    left, right = EDGE * canvas.scale, canvas.surface.get_width() - EDGE * canvas.scale
    y = (6.0 + 0.5 * LEGEND_ROW) * canvas.scale
    size = 1.15 * canvas.theme.text
    brief = scene.cost.replace("mean distance by φ ", "").replace("mean distance ", "")
    costs = [scene.cost, brief, brief.partition(",")[0]]  # the number stays where the words have no room
    gap = 12 * canvas.scale
    room = right - left - gap - canvas.measure_text(costs[-1])
    name = shorten_to_width(scene.label, canvas.scale_text_size(size), room, bold=True)
    left += canvas.draw_text(name, (left, y), size=size, bold=True) + gap
    if "scale_bar" in canvas.visible_layers and is_small(
        canvas.surface.get_height(), canvas.scale, canvas.visible_layers
    ):
        left += _draw_bar(canvas, left, y) + gap
    cost = next((each for each in costs if canvas.measure_text(each) <= right - left), "")
    canvas.draw_text(cost, (right, y), anchor="right")


def draw_status(canvas: Canvas, scene: Scene) -> None:
    bar = bar_length(canvas)
    taken = (EDGE + 8 + 16) * canvas.scale + bar * canvas.camera.zoom
    taken += canvas.measure_text(format_scale_length(bar), bold=True)
    right = canvas.surface.get_width() - EDGE * canvas.scale
    y = canvas.surface.get_height() - 0.5 * STRIP * canvas.scale
    size = canvas.scale_text_size(canvas.theme.text)
    name = shorten_to_width(scene.label, size, right - taken, bold=True)
    text = fitting_status(scene, size, right - taken - canvas.measure_text(name, bold=True))
    canvas.draw_text(text, (right, y), anchor="right")
    left = right - canvas.measure_text(text) if text else right
    canvas.draw_text(name, (left, y), anchor="right", bold=True)


def fitting_status(scene: Scene, size: int, room: float) -> str:
    """Return what follows the controller's name, whole facts only: first the map's name is left out."""
    time = f"t = {scene.snapshot.time:.1f} s" if scene.snapshot is not None else ""
    facts = [text for text in (time, scene.cost, scene.environment.name) if text]
    lead = "   ·   " if scene.label else ""
    while len(facts) > 1 and measure_text(lead + "   ·   ".join(facts), size) > room:
        facts.pop()
    return shorten_to_width(lead + "   ·   ".join(facts), size, room) if facts else ""


class LegendStrip:
    """Glyphs, drawn as the layers draw them, with words; kept until one changes."""

    def __init__(self) -> None:
        self._strip = LatestValue[pygame.Surface]()

    def draw(self, canvas: Canvas, scene: Scene) -> None:
        width, words = canvas.surface.get_width(), tuple(entry.key for entry in canvas.legend)
        key = (words, width, canvas.theme.name, canvas.scale, canvas.hues[:1].tolist(), canvas.visible_layers)
        canvas.surface.blit(self._strip.get(None, key, lambda: legend_strip(canvas.legend, canvas)), (0, 0))


def legend_strip(entries: Iterable[LegendEntry], canvas: Canvas) -> pygame.Surface:
    """Return a strip as wide as the canvas's surface with these entries, for several pictures at once."""
    rows = legend_rows(canvas, entries)
    height = round((6.0 + LEGEND_ROW * max(len(rows), 1)) * canvas.scale)
    strip = pygame.Surface((canvas.surface.get_width(), height), 0, 32)
    strip.fill(canvas.theme.background)
    own = replace(canvas, surface=strip)
    for number, row in enumerate(rows):
        x = MARGIN * canvas.scale
        y = (6.0 + LEGEND_ROW * (number + 0.5)) * canvas.scale
        for entry in row:
            entry.draw(own, x + 0.5 * (_GLYPH - 6) * canvas.scale, y)
            x += _GLYPH * canvas.scale
            x += own.draw_text(entry.text, (x, y), size=canvas.theme.small_text) + _GAP * canvas.scale
    return strip


def legend_picture(
    entries: Sequence[LegendEntry], width: int, theme: Theme, scale: float, shown: Set[str] = frozenset()
) -> NDArray[np.uint8]:
    """Return entries as an RGB picture of a width, (height, width, 3), for pictures of the layers `shown`."""
    camera = Camera((0.0, 0.0), 1.0, (0.0, 0.0, float(width), 1.0))
    canvas = Canvas(pygame.Surface((width, 1)), camera, theme, scale, choose_robot_hues(1), frozenset(shown))
    strip = legend_strip(entries, canvas)
    pixels = np.frombuffer(pygame.image.tobytes(strip, "RGB"), dtype=np.uint8)
    return pixels.reshape(strip.get_height(), width, 3)


def legend_rows(canvas: Canvas, entries: Iterable[LegendEntry]) -> list[list[LegendEntry]]:
    room = canvas.surface.get_width() - 2 * MARGIN * canvas.scale
    rows: list[list[LegendEntry]] = []
    used = 0.0
    for entry in entries:
        wide = _GLYPH * canvas.scale + canvas.measure_text(entry.text, canvas.theme.small_text)
        if not rows or used + wide > room:
            rows.append([])
            used = 0.0
        rows[-1].append(entry)
        used += wide + _GAP * canvas.scale
    return rows
