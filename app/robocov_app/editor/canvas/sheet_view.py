"""The view of the sheet: camera, theme and visible layers."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pygame
from pygame import Rect, Surface

from robocov_app.look.colors import Color, mix
from robocov_app.look.hues import choose_robot_hues
from robocov_app.look.theme import LIGHT, Theme
from robocov_app.render.camera import Camera
from robocov_app.render.canvas import Canvas

HULL_EXCESS_SHARE = 0.55  # of the obstacle color in areas between the boundary and its convex hull
HULL_EXCESS_EDGE_SHARE = 0.5  # of the edge color of obstacles in the edges of these areas
_LIGHT_OUTSIDE_SHARE = 0.05  # of the ink in the color outside the boundary
_DARK_OUTSIDE_SHARE = 0.28  # of black in this color
_BLACK = (0, 0, 0)

MAX_RECT_PX = 30_000  # coordinates of rectangles are limited to this


@dataclass(frozen=True, eq=False)
class View:
    """View of the sheet: everything that determines how a map is drawn.

    Attributes
    ----------
    camera : Camera
        Position and magnification, in pixels of the arena.
    theme : Theme
        Colors.
    scale : float
        Scale of the window.
    size : tuple of int
        Width and height of the arena, px.
    shown : frozenset of str
        Names of the visible layers.
    grid : float
        Spacing of the grid, m.
    folder : Path
        Folder to which the path of the background image is relative.
    """

    camera: Camera
    theme: Theme
    scale: float
    size: tuple[int, int]
    shown: frozenset[str]
    grid: float
    folder: Path

    @property
    def clip(self) -> Rect:
        """Part of the arena in which the sheet is visible, px."""
        return Rect([round(value) for value in self.camera.view])

    def build_canvas(self, surface: Surface) -> Canvas:
        """Build a canvas that draws on a surface in this view."""
        return Canvas(surface, self.camera, self.theme, self.scale, choose_robot_hues(0))

    def build_transparent_canvas(self) -> Canvas:
        """Build a canvas with a transparent surface as large as the arena."""
        return self.build_canvas(Surface(self.size, pygame.SRCALPHA, 32))


def choose_outside_color(theme: Theme) -> Color:
    """Return the color of the sheet outside the boundary."""
    if theme is LIGHT:
        return mix(theme.panel, theme.ink, _LIGHT_OUTSIDE_SHARE)
    return mix(theme.background, _BLACK, _DARK_OUTSIDE_SHARE)


def choose_hull_excess_color(theme: Theme) -> Color:
    """Return the color of the areas between the boundary and its convex hull."""
    return mix(choose_outside_color(theme), theme.obstacle, HULL_EXCESS_SHARE)


def choose_hull_excess_edge(theme: Theme) -> Color:
    """Return the color of the edges of these areas."""
    return mix(choose_hull_excess_color(theme), theme.obstacle_edge, HULL_EXCESS_EDGE_SHARE)


def compute_pixel_box(camera: Camera, bounds: Iterable[float]) -> Rect:
    """Return the box of pixels that covers bounds, m, with a margin of one or two pixels."""
    low_x, low_y, high_x, high_y = bounds
    ends = camera.to_pixels(np.array([[low_x, high_y], [high_x, low_y]]))
    (left, top), (right, bottom) = np.clip(ends, -MAX_RECT_PX, MAX_RECT_PX).tolist()
    return Rect(int(left) - 1, int(top) - 1, int(right - left) + 3, int(bottom - top) + 3)
