"""The color scale of the distance map, at the right edge of the view."""

import numpy as np
import pygame

from robocov_app.look.lengths import format_scale_length
from robocov_app.render.annotations.scale_bar import STRIP_HEIGHT_PX
from robocov_app.render.canvas import Canvas
from robocov_app.render.distance_map.colors import list_color_ticks
from robocov_app.render.pixel_arrays import build_surface
from robocov_app.render.scene import Scene

# Lengths in pixels at scale 1.
_WIDTH_PX = 12.0
_GAP_PX = 8.0
_TICK_LENGTH_PX = 4
_MAX_HEIGHT_PX = 300
_MAX_HEIGHT_FRACTION = 0.72
"""Maximum fraction of the height of the view."""
_MIN_HEIGHT_PX = 2
_TOLERANCE = 1e-9


def draw_color_bar(canvas: Canvas, scene: Scene) -> None:
    """Draw the color scale of the distance map, with labeled ticks, at the right edge of the view."""
    # The painter calls this only if the layer `color_bar` is visible and the scene has a field.
    if "distances" not in canvas.visible_layers:
        return
    theme = canvas.theme
    scale = canvas.scale
    line_width = canvas.scale_width(1.0)
    box = _find_box(canvas, scene)
    colors = theme.build_heat_table(box.height)[::-1, None]
    picture = build_surface(np.broadcast_to(colors, (box.height, box.width, 3)))
    canvas.surface.blit(picture, box)
    pygame.draw.rect(canvas.surface, theme.faint, box, line_width)
    for distance, text in _list_labels(scene):
        y = box.top + box.height * (1.0 - distance / scene.field_limit)
        tick = (box.right, round(y - 0.5 * line_width), round(_TICK_LENGTH_PX * scale), line_width)
        canvas.surface.fill(theme.faint, tick)
        canvas.draw_text(text, (box.right + _GAP_PX * scale, y), size=theme.small_text)


def _find_box(canvas: Canvas, scene: Scene) -> pygame.Rect:
    """Return the box that the colors fill: at the right edge, vertically centered in the view."""
    scale = canvas.scale
    surface_width, surface_height = canvas.surface.get_size()
    _, top, _, view_height = canvas.camera.view
    free_height = min(view_height, surface_height - STRIP_HEIGHT_PX * scale - top)
    height = max(round(min(_MAX_HEIGHT_FRACTION * free_height, _MAX_HEIGHT_PX * scale)), _MIN_HEIGHT_PX)
    left = surface_width - measure_color_bar(canvas, scene) + _GAP_PX * scale
    box_top = top + (free_height - height) / 2
    return pygame.Rect(round(left), round(box_top), round(_WIDTH_PX * scale), height)


def measure_color_bar(canvas: Canvas, scene: Scene) -> float:
    """Return the width to reserve for the color scale at the right edge, px; 0 if it is not visible."""
    is_visible = {"distances", "color_bar"} <= canvas.visible_layers
    if scene.field is None or not is_visible:
        return 0.0
    texts = [text for _, text in _list_labels(scene)]
    label_width = max(canvas.measure_text(text, canvas.theme.small_text) for text in texts)
    # Gaps to the left of the colors, between colors and labels, and to the right of the labels.
    return (_WIDTH_PX + 3.0 * _GAP_PX) * canvas.scale + label_width


def _list_labels(scene: Scene) -> list[tuple[float, str]]:
    """Return the labeled distances, m, with their texts."""
    assert scene.field is not None
    ticks = list_color_ticks(scene.field_limit)
    texts = ["0", *(format_scale_length(tick) for tick in ticks[1:])]
    # The last color also stands for all distances beyond the end of the scale.
    if scene.field.max_distance > scene.field_limit * (1.0 + _TOLERANCE):
        texts[-1] = f"≥ {texts[-1]}"
    return list(zip(ticks, texts, strict=True))
