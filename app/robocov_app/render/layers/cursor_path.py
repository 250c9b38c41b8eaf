"""The layer of the shortest path from the cursor to its nearest robot."""

from functools import partial
from itertools import pairwise

import numpy as np
import pygame

from robocov.typing import FloatArray
from robocov_app.look.colors import mix
from robocov_app.render import sprites
from robocov_app.render.canvas import Canvas
from robocov_app.render.clipping import limit_pixels
from robocov_app.render.layers.layer import build_legend
from robocov_app.render.layers.robots import compute_drawn_radii
from robocov_app.render.scene import Scene

# Lengths in pixels at scale 1.
_LINE_WIDTH_PX = 2.0
_HALO_WIDTH_PX = 4.5
_START_RADIUS_PX = 3.6
_START_HALO_RADIUS_PX = 5.0
_SYMBOL_HALF_PX = 9
_SYMBOL_START_INSET_PX = 2
"""Distance of the dot from the end of the line in the symbol of the legend."""
_TAG_CORNER_PX = 4
_TAG_PADDING_PX = 12
_TAG_HEIGHT_PX = 20
_TAG_GAP_PX = 6
_TAG_GAP_AT_ARROW_PX = 14
"""Gap between the tag and the position of the cursor on the side of its arrow."""
_TAG_SIDES = ((1, -1), (-1, -1), (-1, 1), (1, 1))
"""Sides of the cursor, right and down, on which the tag may be, the best first: the arrow is lower right."""
_HIDDEN_PATH_COST = 4
"""Hiding a section of the path, or moving a tag into the view, is as bad as hiding this many robots."""
_MAX_LENGTH_WITH_CENTIMETERS_M = 100
_TAG_EDGE_STRENGTH = 0.5


def draw_cursor_path(canvas: Canvas, scene: Scene) -> None:
    """Draw the path, and a tag with its length next to the cursor."""
    path = scene.path
    assert path is not None
    if len(path) < 2:
        return
    theme = canvas.theme
    corners = canvas.camera.to_pixels(path)
    # The halo sets the path off from the lines and areas that it crosses.
    canvas.draw_outline(corners, theme.background, canvas.scale_width(_HALO_WIDTH_PX), is_closed=False)
    canvas.draw_outline(corners, theme.final, canvas.scale_width(_LINE_WIDTH_PX), is_closed=False)
    _draw_path_start(canvas, float(corners[0, 0]), float(corners[0, 1]))
    text = _format_length(float(np.hypot(*np.diff(path, axis=0).T).sum()))
    box = _place_tag(canvas, scene, corners, canvas.measure_text(text, bold=True))
    radius = round(_TAG_CORNER_PX * canvas.scale)
    edge = mix(theme.background, theme.final, _TAG_EDGE_STRENGTH)
    pygame.draw.rect(canvas.surface, theme.background, box, border_radius=radius)
    pygame.draw.rect(canvas.surface, edge, box, canvas.scale_width(1.0), border_radius=radius)
    canvas.draw_text(text, box.center, color=theme.final, bold=True, anchor="middle")


def _format_length(length: float) -> str:
    if length < _MAX_LENGTH_WITH_CENTIMETERS_M:
        return f"{length:.2f} m"
    return f"{length:.0f} m"


def _place_tag(canvas: Canvas, scene: Scene, corners: FloatArray, text_width: int) -> pygame.Rect:
    """Choose the box of the tag next to the cursor that hides the least of the path and the robots.

    Parameters
    ----------
    canvas : Canvas
    scene : Scene
    corners : (w, 2) array, px
        Path, from the cursor on.
    text_width : int, px
    """
    scale = canvas.scale
    x, y = corners[0].tolist()
    box = pygame.Rect(0, 0, text_width + round(_TAG_PADDING_PX * scale), round(_TAG_HEIGHT_PX * scale))
    best_cost = np.inf
    best_box = box
    for side, down in _TAG_SIDES:
        is_at_arrow = (side, down) == (1, 1)
        gap = (_TAG_GAP_AT_ARROW_PX if is_at_arrow else _TAG_GAP_PX) * scale
        box.centerx = round(x + side * (box.width / 2 + gap))
        box.centery = round(y + down * (box.height / 2 + gap))
        visible_box = box.clamp(canvas.surface.get_clip())
        cost = _compute_hiding_cost(canvas, scene, corners, visible_box)
        if visible_box != box:
            cost += _HIDDEN_PATH_COST
        if cost < best_cost:
            best_cost = cost
            best_box = visible_box
    return best_box


def _compute_hiding_cost(canvas: Canvas, scene: Scene, corners: FloatArray, box: pygame.Rect) -> int:
    """Return a cost that counts the sections of the path, (w, 2) px, and the robots that a box would hide."""
    path = limit_pixels(corners).tolist()
    n_sections = sum(bool(box.clipline(start, end)) for start, end in pairwise(path))
    cost = _HIDDEN_PATH_COST * n_sections
    if scene.snapshot is None:
        return cost
    centers = canvas.camera.to_pixels(scene.snapshot.positions)
    outside = np.maximum(np.maximum(box.topleft - centers, centers - box.bottomright), 0.0)
    is_hidden = np.hypot(*outside.T) < compute_drawn_radii(canvas, scene)
    return cost + int(is_hidden.sum())


def _draw_path_start(canvas: Canvas, x: float, y: float) -> None:
    """Draw the dot at the cursor, with a halo in the background color."""
    halo = partial(sprites.render_dot, _START_HALO_RADIUS_PX * canvas.scale, canvas.theme.background)
    dot = partial(sprites.render_dot, _START_RADIUS_PX * canvas.scale, canvas.theme.final)
    canvas.draw_sprite(halo, (x, y))
    canvas.draw_sprite(dot, (x, y))


def _draw_path_symbol(canvas: Canvas, x: float, y: float) -> None:
    start, end = canvas.get_symbol_line(x, y, _SYMBOL_HALF_PX)
    canvas.draw_line(start, end, canvas.theme.final, canvas.scale_width(_LINE_WIDTH_PX))
    _draw_path_start(canvas, start[0] + _SYMBOL_START_INSET_PX * canvas.scale, y)


def _has_path(scene: Scene) -> bool:
    return scene.path is not None and len(scene.path) > 1


build_cursor_path_legend = build_legend("shortest path to the nearest robot", _draw_path_symbol, _has_path)
