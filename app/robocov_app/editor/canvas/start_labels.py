"""Labels of starts, which avoid obstacles and the boundary."""

import numpy as np
import shapely
from pygame import Rect

from robocov.environment import DiscStart, Point, PointsStart, StartSpec
from robocov_app.editor.model.sketch import Sketch
from robocov_app.look.colors import mix
from robocov_app.render.canvas import Canvas
from robocov_app.toolkit.overlay import draw_tag

# Lengths in pixels at scale 1.
_GAP_PX = 3.0
"""Distance between a start and its label."""
_RING_RADIUS_PX = 5.0
"""Radius of the rings at the positions of a start."""
_MARGIN_PX = 1.0
"""Minimum distance between a label and an obstacle."""

_INK_STRENGTH = 0.45
"""Fraction of the color of text in the color of labels."""


def draw_start_label(canvas: Canvas, sketch: Sketch, start: StartSpec, label: str) -> None:
    """Write a label next to a start, where no obstacle is under it.

    If there is an obstacle everywhere around the start, the label gets a background.

    Parameters
    ----------
    canvas : Canvas
        The canvas; its clip is the visible part of the map.
    sketch : Sketch
        The map, whose obstacles and boundary are avoided.
    start : StartSpec
        The start. One that is uniform over the free space has no label.
    label : str
        May be empty.
    """
    theme = canvas.theme
    width = canvas.measure_text(label, theme.small_text)
    height = canvas.scale_text_size(theme.small_text)
    boxes = _list_boxes(canvas, start, width, height)
    if not label or not boxes:
        return
    box = place_start_label(canvas, sketch, start, width, height)
    if box is None:
        draw_tag(canvas.surface, label, boxes[0].midleft, theme, canvas.scale)
        return
    color = mix(theme.start, theme.ink, _INK_STRENGTH)
    canvas.draw_text(label, box.center, size=theme.small_text, color=color, anchor="middle")


def place_start_label(
    canvas: Canvas, sketch: Sketch, start: StartSpec, width: int, height: int
) -> Rect | None:
    """Return the box of a label of a size, px, next to a start; None if obstacles are everywhere."""
    boxes = _list_boxes(canvas, start, width, height)
    return next((box for box in boxes if _is_free(canvas, sketch, box)), None)


def _list_boxes(canvas: Canvas, start: StartSpec, width: int, height: int) -> list[Rect]:
    """Return the boxes in which a label of a size, px, may be, the best one first."""
    if isinstance(start, DiscStart):
        radius = start.radius * canvas.camera.zoom
        boxes = _list_boxes_around(canvas, start.center, radius, width, height)
        inside = Rect(0, 0, width, height)
        above, _, right, _ = boxes
        inside.center = above.centerx, right.centery
        if width < 2 * radius - 2 * _GAP_PX * canvas.scale:
            boxes.append(inside)
        return boxes
    if isinstance(start, PointsStart):
        radius = _RING_RADIUS_PX * canvas.scale
        boxes = []
        for position in start.positions:
            boxes += _list_boxes_around(canvas, position, radius, width, height)
        return boxes
    return []


def _list_boxes_around(canvas: Canvas, center: Point, radius: float, width: int, height: int) -> list[Rect]:
    """Return the boxes above, below, to the right and to the left of a circle with a radius in px."""
    pixel = np.nan_to_num(canvas.camera.to_pixels(np.array(center)))
    limit = float(sum(canvas.surface.get_size())) + width
    x, y = np.clip(pixel, -limit, limit).tolist()
    distance = min(radius + _GAP_PX * canvas.scale, 2 * limit)
    boxes = [Rect(0, 0, width, height) for _ in range(4)]
    above, below, right, left = boxes
    above.midbottom = round(x), round(y - distance)
    below.midtop = round(x), round(y + distance)
    right.midleft = round(x + distance), round(y)
    left.midright = round(x - distance), round(y)
    return boxes


def _is_free(canvas: Canvas, sketch: Sketch, box: Rect) -> bool:
    """Return whether a box is visible, and no obstacle and no edge of the boundary is in it."""
    if not canvas.surface.get_clip().contains(box):
        return False
    margin = round(2 * _MARGIN_PX * canvas.scale)
    space = box.inflate(margin, margin)
    corners = canvas.camera.to_world(np.array([space.bottomleft, space.topright], dtype=float))
    (low_x, low_y), (high_x, high_y) = corners.tolist()
    area = shapely.box(low_x, low_y, high_x, high_y)
    if len(sketch.tree.query(area, predicate="intersects")):
        return False
    if sketch.boundary is None or len(sketch.boundary) < 3:
        return True
    return not shapely.LinearRing(sketch.boundary).intersects(area)
