"""The preview of the editor: a map that a pencil draws."""

from __future__ import annotations

import itertools
import math

import pygame
from pygame import Rect, Surface

from robocov_app.look.colors import mix
from robocov_app.look.theme import Theme
from robocov_app.render.sprites import Sketch

DRAWING_S = 6.0
"""Time in which the drawing is completed."""
_PAUSE_S = 2.0

Point = tuple[float, float]

_WALLS: tuple[tuple[Point, ...], ...] = (
    ((0.04, 0.06), (0.96, 0.06), (0.96, 0.94), (0.04, 0.94), (0.04, 0.06)),
    ((0.38, 0.06), (0.38, 0.42)),
    ((0.38, 0.64), (0.38, 0.94)),
    ((0.96, 0.5), (0.62, 0.5)),
)
"""Walls in the order in which they are drawn, as fractions of the width and the height."""
_GRID_STEPS = 12

# Lengths in pixels at scale 1.
_WALL_PX = 4.0
_PENCIL_PX = 26.0
_PENCIL_WIDTH_FRACTION = 0.22
"""Width of the pencil, as a fraction of its length along x and y."""
_PENCIL_TIP_FRACTION = 0.28
"""Length of its tip, as the same fraction."""


def draw_sketch(screen: Surface, box: Rect, theme: Theme, scale: float, *, seconds: float) -> None:
    """Draw walls one after the other, with a pencil at the end of the last one.

    Parameters
    ----------
    screen : Surface
    box : Rect
    theme : Theme
    scale : float
        Scale of the lines.
    seconds : float
        Time since the drawing was started; it repeats.
    """
    # The pencil is to the upper right of its tip, and must fit into the box, too.
    pencil_size = round(_PENCIL_PX * scale)
    paper = Rect(box.left, box.top + pencil_size, box.width - pencil_size, box.height - pencil_size)
    center = paper.center
    paper.width = min(paper.width, round(1.5 * paper.height))
    paper.center = center
    screen.fill(theme.background, paper)
    _draw_grid(screen, paper, theme)
    fraction = min((seconds % (DRAWING_S + _PAUSE_S)) / DRAWING_S, 1.0)
    sketch = Sketch(box)
    walls = [_to_pixels(wall, paper) for wall in _WALLS]
    remaining = fraction * sum(_measure(wall) for wall in walls)
    tip = walls[0][0]
    for wall in walls:
        drawn = _cut_to_length(wall, remaining)
        remaining -= _measure(wall)
        if len(drawn) > 1:
            sketch.draw_path(drawn, theme.obstacle, _WALL_PX * scale)
        tip = drawn[-1]
        if remaining <= 0:
            break
    if fraction < 1.0:
        _draw_pencil(sketch, tip, theme, scale)
    sketch.draw_on(screen)


def _draw_grid(screen: Surface, paper: Rect, theme: Theme) -> None:
    """Draw square paper."""
    color = mix(theme.background, theme.grid, 0.6)
    spacing = max(paper.width / _GRID_STEPS, 2.0)
    for k in range(int(paper.width / spacing) + 1):
        x = round(paper.left + k * spacing)
        pygame.draw.line(screen, color, (x, paper.top), (x, paper.bottom - 1))
    for k in range(int(paper.height / spacing) + 1):
        y = round(paper.top + k * spacing)
        pygame.draw.line(screen, color, (paper.left, y), (paper.right - 1, y))


def _to_pixels(wall: tuple[Point, ...], paper: Rect) -> list[Point]:
    return [(paper.left + x * paper.width, paper.top + y * paper.height) for x, y in wall]


def _measure(wall: list[Point]) -> float:
    """Return the length of a wall, px."""
    return sum(math.dist(first, second) for first, second in itertools.pairwise(wall))


def _cut_to_length(wall: list[Point], length: float) -> list[Point]:
    """Return the points of a wall from its start up to a length along it, px."""
    part = [wall[0]]
    for first, second in itertools.pairwise(wall):
        distance = math.dist(first, second)
        if length < distance:
            fraction = max(length, 0.0) / distance
            x = first[0] + fraction * (second[0] - first[0])
            y = first[1] + fraction * (second[1] - first[1])
            return [*part, (x, y)]
        part.append(second)
        length -= distance
    return part


def _draw_pencil(sketch: Sketch, tip: Point, theme: Theme, scale: float) -> None:
    """Draw a pencil whose tip is at a pixel."""
    x, y = tip
    length = _PENCIL_PX * scale
    width = _PENCIL_WIDTH_FRACTION * length
    tip_length = _PENCIL_TIP_FRACTION * length
    shoulder = (x + tip_length, y - tip_length)
    end = (x + length, y - length)
    corners = [
        (shoulder[0] - width / 2, shoulder[1] - width / 2),
        (shoulder[0] + width / 2, shoulder[1] + width / 2),
        (end[0] + width / 2, end[1] + width / 2),
        (end[0] - width / 2, end[1] - width / 2),
    ]
    sketch.fill_polygon(corners, theme.accent)
    sketch.fill_polygon([tip, corners[0], corners[1]], theme.ink)
