"""What the inspector says, drawn: words and the arrows of forces, scrolled where they are too many."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pygame

from robocov_app.render.canvas import Canvas
from robocov_app.render.theme import mix
from robocov_app.viewer.inspector import NOTHING
from robocov_app.viewer.overlays import FLAT, wrapped

if TYPE_CHECKING:
    from robocov_app.render.theme import Theme
    from robocov_app.viewer.inspector import Line, Report
    from robocov_app.viewer.layout import Box

BUTTONS = 34.0
"""Pixels at scale 1 that the buttons above the words take."""

NOTCH = 40.0
"""Pixels at scale 1 that a notch of the wheel scrolls."""

_NOBODY = "Click a robot, or press Tab: it tells why it moves, and why it does not."


class ReportPage:
    """Draws reports into the panel."""

    def __init__(self) -> None:
        self._title = ""
        self._scrolled = 0.0
        self._beyond = 0.0

    def wheel(self, notches: float, scale: float) -> None:
        """Scroll."""
        self._scrolled = float(np.clip(self._scrolled - notches * NOTCH * scale, 0.0, self._beyond))

    def draw(
        self, screen: pygame.Surface, box: Box, theme: Theme, scale: float, report: Report | None
    ) -> None:
        """Draw what is said, or how to ask, below the buttons of the box."""
        left, top, width, height = box
        title = report.title if report is not None else ""
        if title != self._title:
            self._title, self._scrolled = title, 0.0
        page = pygame.Rect(left, round(top + BUTTONS * scale), width, round(height - BUTTONS * scale))
        screen.set_clip(page)
        canvas = Canvas(screen, FLAT, theme, scale, np.zeros(1, dtype=np.intp))
        x, y, wide = left + 12 * scale, page.top + 2 * scale - self._scrolled, width - 24 * scale
        if report is None:
            end = _words(canvas, _NOBODY, (x, y), wide, 12.0, theme.faint)
        else:
            end = _report(canvas, report, (x, y), wide)
        self._beyond = max(end + self._scrolled - page.bottom + 4 * scale, 0.0)
        self._scrolled = min(self._scrolled, self._beyond)
        if self._beyond > 0.0:
            whole = page.height + self._beyond
            bar = pygame.Rect(0, 0, max(3, round(4 * scale)), round(page.height * page.height / whole))
            bar.topright = (
                page.right - round(3 * scale),
                page.top + round(self._scrolled * page.height / whole),
            )
            pygame.draw.rect(screen, mix(theme.panel, theme.ink, 0.3), bar, border_radius=bar.width)
        screen.set_clip(None)


def _report(canvas: Canvas, report: Report, at: tuple[float, float], wide: float) -> float:
    """Draw a report; return where it ends."""
    x, y = at
    scale, theme = canvas.scale, canvas.theme
    y = _words(canvas, report.title, (x, y), wide, 14.0, theme.ink, bold=True) + 4 * scale
    y = _words(canvas, report.verdict, (x, y), wide, 12.5, theme.final, bold=True) + 4 * scale
    sizes = [float(np.hypot(*each.vector)) for each in report.lines if each.vector is not None]
    for each in report.lines:
        indent = 0.0
        if each.vector is not None:
            indent = 34 * scale
            _arrow(canvas, each, (x + 14 * scale, y + 8 * scale), max(sizes))
        y = _words(canvas, each.text, (x + indent, y), wide - indent, 11.5, theme.ink) + 3 * scale
    return y


def _words(
    canvas: Canvas,
    text: str,
    at: tuple[float, float],
    wide: float,
    size: float,
    colour: tuple[int, int, int],
    *,
    bold: bool = False,
) -> float:
    """Write text in lines; return where they end."""
    x, y = at
    for line in wrapped(text, canvas.text_size(size), wide, bold):
        canvas.text(line, (x, y + 8 * canvas.scale), size=size, colour=colour, bold=bold)
        y += (size + 5) * canvas.scale
    return y


def _arrow(canvas: Canvas, line: Line, middle: tuple[float, float], largest: float) -> None:
    assert line.vector is not None
    size = float(np.hypot(*line.vector))
    if size < NOTHING:
        return
    length = 13 * canvas.scale * (0.35 + 0.65 * size / largest)
    half = np.array(line.vector) / size * (length, -length)
    colour = canvas.theme.forces.get(line.kind, canvas.theme.ink)
    start, end = (np.array(middle) - half).tolist(), (np.array(middle) + half).tolist()
    canvas.arrow(start, end, colour, 2 * canvas.scale)
