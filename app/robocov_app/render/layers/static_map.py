"""Layers of the map: grid, obstacles and boundary."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pygame
import shapely

from robocov.environment import Environment
from robocov.typing import FloatArray
from robocov_app.look.colors import Color
from robocov_app.look.legend import MOVING_OBSTACLE, UNKNOWN_OBSTACLE
from robocov_app.look.lengths import round_down
from robocov_app.render.canvas import Canvas, LegendEntry, premultiply
from robocov_app.render.layers.layer import build_legend
from robocov_app.render.moving_obstacles import MovingObstacle
from robocov_app.render.scene import Scene

MIN_GRID_GAP_PX = 34.0
"""Minimum distance between lines of the grid, at scale 1."""
_NEXT_ROUND_LENGTH = 2.5001
"""Factor from a round length (1, 2, 5, 10, ...) to one between the next and the one after."""
_TRANSPARENT = (0, 0, 0, 0)
_HEADING_HALF_LENGTH_PX = 11.0
"""Half the length of the arrow in a moving obstacle, at scale 1."""


def draw_grid(canvas: Canvas, scene: Scene) -> None:
    """Draw the lines of the grid within the region, as close together as the zoom permits."""
    step = _choose_grid_step(MIN_GRID_GAP_PX * canvas.scale / canvas.camera.zoom)
    environment = scene.environment
    bounds = environment.region.bounds
    visible = canvas.camera.compute_visible_bounds()
    for axis in (0, 1):
        low = max(bounds[axis], visible[axis])
        high = min(bounds[axis + 2], visible[axis + 2])
        # Lines are at multiples of the step, so that they stay in place when the view moves.
        for coordinate in np.arange(np.ceil(low / step), np.floor(high / step) + 1) * step:
            _draw_grid_line(canvas, environment, axis, coordinate)


def _choose_grid_step(min_step: float) -> float:
    step = round_down(min_step)
    if step >= min_step:
        return step
    return round_down(_NEXT_ROUND_LENGTH * step)


def _draw_grid_line(canvas: Canvas, environment: Environment, axis: int, coordinate: float) -> None:
    """Draw the part inside the region of the line on which x (axis 0) or y (axis 1) has a value, m."""
    region = environment.region
    line = np.full((2, 2), coordinate)
    line[:, 1 - axis] = (region.bounds[1 - axis], region.bounds[3 - axis])
    inside = shapely.get_coordinates(shapely.intersection(region.polygon, shapely.LineString(line)))
    if len(inside) != 2:
        return
    width = canvas.scale_width(canvas.theme.line)
    ends = canvas.camera.to_pixels(inside)
    corner = ends.min(axis=0)
    size = (np.rint(ends.max(axis=0)) - np.rint(corner)).astype(int)
    corner[axis] -= width / 2
    size[axis] = width
    box = pygame.Rect(np.rint(corner).astype(int).tolist(), size.tolist())
    color = premultiply(canvas.theme.grid, 0.5)
    canvas.surface.fill(color, box.clip(canvas.surface.get_clip()))


def draw_obstacles(canvas: Canvas, scene: Scene) -> None:
    """Draw all areas that block robots: obstacles, and areas outside a concave boundary."""
    theme = canvas.theme
    edge = theme.obstacle_edge
    if scene.field is not None and "distances" in canvas.visible_layers:
        # On the dark colors of large distances, only an outline in the color of the page stands out.
        edge = theme.background
    page = pygame.Surface(canvas.surface.get_size(), pygame.SRCALPHA, 32)
    page.set_clip(canvas.surface.get_clip())
    draw_blocked_area(
        replace(canvas, surface=page),
        scene,
        fill=theme.obstacle,
        moving_fill=theme.moving_obstacle,
        edge=edge,
    )
    canvas.surface.blit(page, (0, 0), special_flags=pygame.BLEND_PREMULTIPLIED)


def draw_blocked_area(canvas: Canvas, scene: Scene, *, fill: Color, moving_fill: Color, edge: Color) -> None:
    """Draw the obstacles: those at rest with their outlines, then the moving ones.

    Parameters
    ----------
    canvas : Canvas
        Its surface must be transparent, so that the layers below show through courtyards.
    scene : Scene
    fill, moving_fill, edge : Color
        Colors of obstacles at rest, of moving ones and of outlines.
    """
    outlines: list[FloatArray] = []
    # Largest first: a courtyard must be cleared before the obstacles in it are drawn.
    polygons = sorted(scene.environment.blocked.geoms, key=_compute_outer_area, reverse=True)
    for polygon in polygons:
        outer = _get_corners(canvas, polygon.exterior)
        inner = [_get_corners(canvas, ring) for ring in polygon.interiors]
        canvas.fill_polygon(outer, (*fill, 255))
        for corners in inner:
            canvas.fill_polygon(corners, _TRANSPARENT)
        outlines += [outer, *inner]
    for corners in outlines:
        canvas.draw_outline(corners, edge, canvas.scale_width(canvas.theme.line))
    for obstacle in scene.moving:
        _draw_moving_obstacle(canvas, scene, obstacle, moving_fill, edge)


def _get_corners(canvas: Canvas, ring: shapely.LinearRing) -> FloatArray:
    """Return the corners of a ring, (k, 2) px."""
    return canvas.camera.to_pixels(np.asarray(ring.coords)[:-1])


def _compute_outer_area(polygon: shapely.Polygon) -> float:
    """Return the area within the outer ring of a polygon, including its courtyards."""
    return float(shapely.Polygon(polygon.exterior).area)


def _draw_moving_obstacle(
    canvas: Canvas, scene: Scene, obstacle: MovingObstacle, fill: Color, edge: Color
) -> None:
    """Draw a moving obstacle with its path, and with an arrow that shows its heading."""
    theme = canvas.theme
    camera = canvas.camera
    width = canvas.scale_width(theme.line)
    visible = shapely.intersection(obstacle.polygon, scene.environment.region.polygon)
    for part in shapely.get_parts(visible):
        if not isinstance(part, shapely.Polygon):
            continue
        # `fill_polygon` cannot leave out holes, so that obstacles with holes only have outlines.
        if not part.interiors:
            canvas.fill_polygon(_get_corners(canvas, part.exterior), (*fill, 255))
        for ring in (part.exterior, *part.interiors):
            canvas.draw_outline(_get_corners(canvas, ring), edge, 2 * width)
    for start, end in pairwise(camera.to_pixels(obstacle.path).tolist()):
        canvas.draw_dashed_line(start, end, theme.ink, width)
    middle = camera.to_pixels(obstacle.middle)
    # Pixels run downwards.
    half_arrow = _HEADING_HALF_LENGTH_PX * canvas.scale * obstacle.heading * np.array([1.0, -1.0])
    tail = (middle - half_arrow).tolist()
    tip = (middle + half_arrow).tolist()
    canvas.draw_arrow(tail, tip, theme.ink, 2.0 * canvas.scale)


def _draw_obstacle_symbol(canvas: Canvas, x: float, y: float) -> None:
    canvas.draw_swatch(x, y, canvas.theme.obstacle, canvas.theme.obstacle_edge)


def _draw_moving_obstacle_symbol(canvas: Canvas, x: float, y: float) -> None:
    canvas.draw_swatch(x, y, canvas.theme.moving_obstacle, canvas.theme.obstacle_edge)
    start, end = canvas.get_symbol_line(x, y, 10.0)
    canvas.draw_arrow(start, end, canvas.theme.ink, 1.6 * canvas.scale)


_build_static_legend = build_legend(
    UNKNOWN_OBSTACLE, _draw_obstacle_symbol, lambda scene: not scene.environment.blocked.is_empty
)
_build_moving_legend = build_legend(
    MOVING_OBSTACLE, _draw_moving_obstacle_symbol, lambda scene: bool(scene.moving)
)


def build_obstacles_legend(scene: Scene) -> list[LegendEntry]:
    """Build the legend of obstacles at rest and moving obstacles, if the scene has any."""
    return [*_build_static_legend(scene), *_build_moving_legend(scene)]


def draw_boundary(canvas: Canvas, scene: Scene) -> None:
    """Draw the boundary of the region."""
    corners = canvas.camera.to_pixels(scene.environment.region.vertices)
    canvas.draw_outline(corners, canvas.theme.boundary, canvas.scale_width(canvas.theme.boundary_line))
