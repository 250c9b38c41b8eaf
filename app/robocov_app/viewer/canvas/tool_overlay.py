"""Overlays on a pane: dragged and hovered robots, and previews of tools."""

from functools import partial
from itertools import pairwise

import numpy as np
import pygame
import shapely

from robocov.environment import Obstacle
from robocov.typing import FloatArray
from robocov_app.look.colors import Color, mix
from robocov_app.render import sprites
from robocov_app.render.canvas import Canvas
from robocov_app.render.layers.robots import SELECTION_GAP_PX, SELECTION_WIDTH_PX, compute_drawn_radii
from robocov_app.render.scene import Scene
from robocov_app.toolkit.overlay import draw_tag
from robocov_app.viewer.session.past.states import Drag
from robocov_app.viewer.tools.tool import ViewerToolOverlay

# Lengths in pixels at scale 1.
FAILED_RADIUS_PX = 9.0  # a click within it selects a failed robot, even if the robot is drawn smaller
_MARK_PX = 3.0  # half the side of the mark of a point
_HANDLE_PX = 4.0  # half the side of a handle
_LINE_WIDTH_PX = 1.5
_SELECTED_LINE_WIDTH_PX = 2.5  # outline of the selected obstacle
_CLOSING_LINE_WIDTH_PX = 1.0  # from the last point of an outline to its first one
_DRAG_DASH_PX = 3.0
_HOVER_RING_WIDTH_PX = 1.2
_HOVER_GAP_PX = 3.5
_LABEL_OFFSET_PX = (12.0, -14.0)  # of a label from its point

_HOVER_STRENGTH = 0.7  # fraction of the accent color in the outline of the hovered obstacle
_OBSTACLE_ALPHA = 89  # opacity of a preview, 0 to 255
_PREMULTIPLIED_FRACTION = 0.35  # the same opacity as a fraction, for premultiplied colors
_MAX_PIXEL = 1e4  # limit of the coordinates of polygons, which may be far outside the window


def draw_drag(canvas: Canvas, scene: Scene, drag: Drag | None) -> None:
    """Draw a line from the dragged robot to the point to which it is pulled."""
    numbers = list(scene.numbers or ())
    if drag is None or drag.robot not in numbers:
        return
    position = scene.now.positions[numbers.index(drag.robot)]
    start, end = canvas.camera.to_pixels(np.array([position, drag.target])).tolist()
    canvas.draw_dashed_line(
        start, end, canvas.theme.ink, canvas.scale_width(_LINE_WIDTH_PX), dash=_DRAG_DASH_PX
    )


def draw_failed_selection(canvas: Canvas, scene: Scene, selected: int | None) -> None:
    """Draw a ring around the selected robot if it has failed; the painter does this for working robots."""
    if selected is None or selected not in scene.failed:
        return
    radius = scene.get_failed_radius(selected) * canvas.camera.zoom
    radius = max(radius, FAILED_RADIUS_PX * canvas.scale)
    ring_radius = round(radius) + SELECTION_GAP_PX * canvas.scale
    ring = partial(sprites.render_ring, ring_radius, canvas.theme.ink, SELECTION_WIDTH_PX * canvas.scale)
    canvas.draw_sprite(ring, canvas.camera.to_pixels(np.array(scene.failed[selected])).tolist())


def draw_hovered_robot(canvas: Canvas, scene: Scene, number: int) -> None:
    """Draw a ring around the working robot under the cursor, unless it is selected and has a ring already."""
    # Failed robots are not in `scene.numbers`.
    numbers = list(scene.numbers or ())
    if number not in numbers:
        return
    row = numbers.index(number)
    if row == scene.selected:
        return
    radius = compute_drawn_radii(canvas, scene)[row] + _HOVER_GAP_PX * canvas.scale
    center = canvas.camera.to_pixels(scene.now.positions[row]).tolist()
    ring = partial(sprites.render_ring, radius, canvas.theme.ink, _HOVER_RING_WIDTH_PX * canvas.scale)
    canvas.draw_sprite(ring, center)


def draw_tool_overlay(canvas: Canvas, overlay: ViewerToolOverlay) -> None:
    """Draw the overlay of a tool in a pane."""
    if overlay.hovered is not None:
        color = mix(canvas.theme.background, canvas.theme.accent, _HOVER_STRENGTH)
        _draw_obstacle_outline(canvas, overlay.hovered, color, _LINE_WIDTH_PX)
    for obstacle in overlay.selected:
        _draw_obstacle_outline(canvas, obstacle, canvas.theme.accent, _SELECTED_LINE_WIDTH_PX)
    for obstacle in overlay.obstacles:
        _draw_obstacle(canvas, obstacle)
    if overlay.handles:
        _draw_marks(canvas, canvas.camera.to_pixels(np.array(overlay.handles)), _HANDLE_PX)
    if overlay.box is not None:
        _draw_box(canvas, canvas.camera.to_pixels(np.array(overlay.box)))
    if not overlay.line:
        return
    points = canvas.camera.to_pixels(np.array(overlay.line))
    _draw_line(canvas, points, is_closed=overlay.is_closed)
    if overlay.has_marks:
        _draw_marks(canvas, points, _MARK_PX)
    if overlay.label:
        x, y = points[-1].tolist()
        dx, dy = _LABEL_OFFSET_PX
        position = (x + dx * canvas.scale, y + dy * canvas.scale)
        draw_tag(canvas.surface, overlay.label, position, canvas.theme, canvas.scale)


def _draw_obstacle(canvas: Canvas, obstacle: Obstacle) -> None:
    """Draw a translucent preview of an obstacle that is being drawn or moved."""
    fill = [round(channel * _PREMULTIPLIED_FRACTION) for channel in canvas.theme.obstacle]
    for polygon in shapely.get_parts(obstacle.polygon):
        corners = canvas.camera.to_pixels(np.asarray(polygon.exterior.coords)[:-1])
        ring = np.rint(np.clip(corners, -_MAX_PIXEL, _MAX_PIXEL)).tolist()
        page = pygame.Surface(canvas.surface.get_size(), pygame.SRCALPHA, 32)
        pygame.draw.polygon(page, (*fill, _OBSTACLE_ALPHA), ring)
        canvas.surface.blit(page, (0, 0), special_flags=pygame.BLEND_PREMULTIPLIED)
        canvas.draw_outline(corners, canvas.theme.accent, canvas.scale_width(_LINE_WIDTH_PX))


def _draw_obstacle_outline(canvas: Canvas, obstacle: Obstacle, color: Color, width: float) -> None:
    """Draw the outline of an obstacle on the map; the width is in px at scale 1."""
    for polygon in shapely.get_parts(obstacle.polygon):
        for ring in (polygon.exterior, *polygon.interiors):
            corners = canvas.camera.to_pixels(np.asarray(ring.coords)[:-1])
            canvas.draw_outline(corners, color, canvas.scale_width(width))


def _draw_line(canvas: Canvas, points: FloatArray, *, is_closed: bool) -> None:
    if len(points) < 2:
        return
    canvas.draw_outline(points, canvas.theme.accent, canvas.scale_width(_LINE_WIDTH_PX), is_closed=False)
    if is_closed:
        canvas.draw_dashed_line(
            points[-1].tolist(),
            points[0].tolist(),
            canvas.theme.accent,
            canvas.scale_width(_CLOSING_LINE_WIDTH_PX),
        )


def _draw_box(canvas: Canvas, corners: FloatArray) -> None:
    """Draw a dashed box between two opposite corners, px."""
    (left, top), (right, bottom) = corners.tolist()
    outline = [(left, top), (right, top), (right, bottom), (left, bottom), (left, top)]
    for start, end in pairwise(outline):
        canvas.draw_dashed_line(start, end, canvas.theme.accent, canvas.scale_width(_LINE_WIDTH_PX))


def _draw_marks(canvas: Canvas, points: FloatArray, half_size: float) -> None:
    """Draw a square at each point; half of its size is in px at scale 1."""
    size = half_size * canvas.scale
    for x, y in points.tolist():
        box = pygame.Rect(round(x - size), round(y - size), round(2 * size), round(2 * size))
        pygame.draw.rect(canvas.surface, canvas.theme.background, box)
        pygame.draw.rect(canvas.surface, canvas.theme.accent, box, canvas.scale_width(_LINE_WIDTH_PX))
