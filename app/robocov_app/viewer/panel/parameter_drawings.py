"""Drawings in tooltips of parameters: the same scene with a small and with a large value."""

from collections.abc import Callable, Mapping
from functools import partial
from math import cos, radians, sin
from types import MappingProxyType
from typing import TypeAlias

import pygame
from pygame import Surface

from robocov_app.look.colors import Color
from robocov_app.render.fonts import render_text
from robocov_app.render.surface_cache import cache_surfaces
from robocov_app.toolkit.widgets.tool_tip import TIP_TEXT_COLOR, TipDrawing

# Tooltips are light on dark in both themes.
_FAINT: Color = (158, 169, 186)
_OBSTACLE: Color = (104, 117, 138)
_ROBOT: Color = (255, 190, 92)
_FORCE: Color = (120, 184, 255)
_SENSED: Color = (120, 224, 150)

# Lengths in pixels at scale 1. A scene is drawn in a square, with the origin in its upper left corner.
_SCENE_PX = 84.0
_GAP_PX = 14.0
_CAPTION_PX = 15.0
_CAPTION_TEXT_PX = 10.0
_ROBOT_RADIUS_PX = 6.0
_LINE_PX = 1.6
_ARROW_HEAD_PX = 5.0
_SUPERSAMPLING = 4
"""Drawings are rendered larger by this factor and then scaled down, which smooths their edges."""
_DASH_COUNT = 28
"""Number of dashes of a dashed circle."""
_CACHE_BYTES = 1_000_000

Point: TypeAlias = tuple[float, float]


class _Pen:
    """Draws shapes of one color each on an enlarged surface.

    Parameters
    ----------
    surface : pygame.Surface
        Surface that is later scaled down.
    unit : float
        Number of its pixels for a pixel at scale 1.
    """

    def __init__(self, surface: Surface, unit: float) -> None:
        self._surface = surface
        self._unit = unit

    def fill_polygon(self, color: Color, *points: Point) -> None:
        """Fill the polygon with these corners."""
        pygame.draw.polygon(self._surface, color, [self._to_pixel(point) for point in points])

    def draw_disc(self, color: Color, center: Point, radius: float) -> None:
        """Fill a circle."""
        pygame.draw.circle(self._surface, color, self._to_pixel(center), radius * self._unit)

    def draw_line(self, color: Color, start: Point, end: Point, width: float = _LINE_PX) -> None:
        """Draw a line with a width at scale 1."""
        pixels = round(width * self._unit)
        pygame.draw.line(self._surface, color, self._to_pixel(start), self._to_pixel(end), pixels)

    def draw_outline(self, color: Color, *points: Point) -> None:
        """Draw a closed line through points."""
        for start, end in zip(points, (*points[1:], points[0]), strict=True):
            self.draw_line(color, start, end)

    def draw_arrow(self, color: Color, start: Point, length: float) -> None:
        """Draw an arrow to the right."""
        x, y = start
        tip = x + length
        self.draw_line(color, start, (tip - _ARROW_HEAD_PX, y), 2 * _LINE_PX)
        low = (tip - _ARROW_HEAD_PX - 1, y - _ARROW_HEAD_PX)
        high = (tip - _ARROW_HEAD_PX - 1, y + _ARROW_HEAD_PX)
        self.fill_polygon(color, (tip + 1, y), low, high)

    def draw_dashed_circle(self, color: Color, center: Point, radius: float) -> None:
        """Draw a dashed circle."""
        for number in range(_DASH_COUNT):
            start = 360.0 * number / _DASH_COUNT
            end = start + 180.0 / _DASH_COUNT
            self.draw_line(
                color, _find_rim_point(center, radius, start), _find_rim_point(center, radius, end)
            )

    def _to_pixel(self, point: Point) -> Point:
        return point[0] * self._unit, point[1] * self._unit


def _find_rim_point(center: Point, radius: float, degrees: float) -> Point:
    return center[0] + radius * cos(radians(degrees)), center[1] + radius * sin(radians(degrees))


def _draw_repulsion(pen: _Pen, *, is_large: bool) -> None:
    """Draw an obstacle, and the force that pushes a robot away from it."""
    pen.fill_polygon(_OBSTACLE, (4, 8), (22, 8), (22, 76), (4, 76))
    robot = (36.0, 42.0)
    pen.draw_arrow(_FORCE, robot, 44.0 if is_large else 20.0)
    pen.draw_disc(_ROBOT, robot, _ROBOT_RADIUS_PX)


def _draw_attraction(pen: _Pen, *, is_large: bool) -> None:
    """Draw a Voronoi cell with its centroid, and the force that pulls a robot to it."""
    pen.draw_outline(_FAINT, (4, 20), (40, 5), (80, 24), (76, 66), (34, 79), (6, 60))
    x, y = 66.0, 42.0
    pen.draw_line(TIP_TEXT_COLOR, (x - 5, y), (x + 5, y))
    pen.draw_line(TIP_TEXT_COLOR, (x, y - 5), (x, y + 5))
    robot = (18.0, 42.0)
    pen.draw_arrow(_FORCE, robot, 40.0 if is_large else 19.0)
    pen.draw_disc(_ROBOT, robot, _ROBOT_RADIUS_PX)


def _draw_sensing(pen: _Pen, *, is_large: bool) -> None:
    """Draw the circle within which a robot senses obstacles, and the part of an obstacle that it senses."""
    robot = (36.0, 42.0)
    pen.fill_polygon(_OBSTACLE, (62, 8), (80, 8), (80, 76), (62, 76))
    if is_large:
        pen.draw_line(_SENSED, (62, 21), (62, 63), 3 * _LINE_PX)
    pen.draw_dashed_circle(_FORCE, robot, 34.0 if is_large else 18.0)
    pen.draw_disc(_ROBOT, robot, _ROBOT_RADIUS_PX)


_SCENES: Mapping[str, Callable[..., None]] = MappingProxyType(
    {"k_rep": _draw_repulsion, "k_att": _draw_attraction, "team.sensing_range": _draw_sensing}
)
"""Function that draws the scene of a parameter, by the name of the parameter."""


def get_parameter_drawing(parameter: str) -> TipDrawing | None:
    """Return the drawing of a parameter; None if it has none."""
    if parameter not in _SCENES:
        return None
    return partial(_render_drawing, parameter)


@cache_surfaces(_CACHE_BYTES)
def _render_drawing(parameter: str, scale: float) -> Surface:
    """Render the scene of a parameter with a small value at the left and with a large one at the right."""
    side = round(_SCENE_PX * scale)
    gap = round(_GAP_PX * scale)
    drawing = Surface((2 * side + gap, side + round(_CAPTION_PX * scale)), pygame.SRCALPHA, 32)
    text_size = round(_CAPTION_TEXT_PX * scale)
    for is_large, caption in ((False, "small"), (True, "large")):
        large = Surface((side * _SUPERSAMPLING, side * _SUPERSAMPLING), pygame.SRCALPHA, 32)
        _SCENES[parameter](_Pen(large, side * _SUPERSAMPLING / _SCENE_PX), is_large=is_large)
        scene = pygame.transform.smoothscale(large.premul_alpha(), (side, side))
        left = side + gap if is_large else 0
        drawing.blit(scene, (left, 0))
        text = render_text(caption, text_size, _FAINT).premul_alpha()
        drawing.blit(text, text.get_rect(midtop=(left + side // 2, side)))
    return drawing
