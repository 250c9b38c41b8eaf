"""The layer of known obstacles: points that robots have sensed, and the map that a robot has discovered."""

from dataclasses import replace

import numpy as np
import pygame
from numpy.typing import NDArray

from robocov.planning.discovered_map import PRESUMED_WALL, UNKNOWN, WALL, DiscoveredMap
from robocov.typing import FloatArray, IntArray
from robocov_app.look.colors import Color, mix
from robocov_app.look.theme import Theme
from robocov_app.render.canvas import Canvas, premultiply
from robocov_app.render.layers.layer import build_legend
from robocov_app.render.layers.ray_scans import draw_dots
from robocov_app.render.layers.static_map import draw_blocked_area, draw_boundary
from robocov_app.render.scene import Scene

_CELL_OPACITIES = {UNKNOWN: 0.28, PRESUMED_WALL: 0.45, WALL: 0.85}
"""Opacity of the cells of a discovered map; free ones are transparent."""
_UNKNOWN_FILL_STRENGTH = 0.3
_UNKNOWN_EDGE_STRENGTH = 0.6
"""Fractions of the colors of an obstacle that remain where no robot has sensed it."""
_POINT_RADIUS_PX = 2.1
"""Radius of a sensed point, at scale 1."""


class KnownObstaclesLayer:
    """Draws sensed points above paler obstacles, and the discovered map of the selected robot.

    The points are those of the selected robot or, if no robot is selected, of all. They stay on a page, to
    which only new points are added; the page is drawn again when the view changes.
    """

    def __init__(self) -> None:
        self._page = pygame.Surface((0, 0))
        self._key: object = None
        # The objects themselves, not their ids, which may be reused after their deletion.
        self._sources: tuple[object, object] = (None, None)
        self._drawn_points = np.empty((0, 2))

    def draw(self, canvas: Canvas, scene: Scene) -> None:
        """Draw the obstacles that are known at the time of a scene."""
        assert scene.sensed is not None
        points, robots = scene.sensed.get_until(scene.now.time)
        if not self._is_continued(canvas, scene, points):
            self._start_page(canvas, scene)
        self._add_points(canvas, points, robots, _get_selected_number(scene))
        canvas.surface.blit(self._page, (0, 0), special_flags=pygame.BLEND_PREMULTIPLIED)
        discovered = get_discovered_map(scene)
        if discovered is not None:
            draw_discovered_map(canvas, discovered)

    def _is_continued(self, canvas: Canvas, scene: Scene, points: FloatArray) -> bool:
        """Return whether the page can be continued: it shows the first of the points, (k, 2) m, in this view.

        Comparing the last drawn point is enough, since points are only ever appended.
        """
        count = len(self._drawn_points)
        is_same_source = self._sources[0] is scene.environment and self._sources[1] is scene.sensed
        is_same_view = self._key == _build_key(canvas, scene)
        has_last_point = np.array_equal(points[count - 1 : count], self._drawn_points[-1:])
        return is_same_source and is_same_view and has_last_point

    def _start_page(self, canvas: Canvas, scene: Scene) -> None:
        """Start a page with pale obstacles and without points."""
        self._key = _build_key(canvas, scene)
        self._sources = (scene.environment, scene.sensed)
        self._drawn_points = np.empty((0, 2))
        self._page = pygame.Surface(canvas.surface.get_size(), pygame.SRCALPHA, 32)
        self._page.set_clip(canvas.surface.get_clip())
        if "obstacles" not in canvas.visible_layers:
            return
        page = replace(canvas, surface=self._page)
        fill, edge = _get_pale_colors(canvas)
        draw_blocked_area(page, scene, fill=fill, moving_fill=fill, edge=edge)
        if "boundary" in canvas.visible_layers:
            # The pale obstacles hide parts of the boundary, which is drawn in a lower layer.
            draw_boundary(page, scene)

    def _add_points(self, canvas: Canvas, points: FloatArray, robots: IntArray, selected: int | None) -> None:
        """Draw the points, (k, 2) m, that are not on the page yet.

        `robots`, (k,), are the numbers of the robots that sensed them. If a robot is selected, only its own
        points are drawn.
        """
        count = len(self._drawn_points)
        if count < len(points):
            new_points = points[count:]
            if selected is not None:
                new_points = new_points[robots[count:] == selected]
            page = replace(canvas, surface=self._page)
            centers = canvas.camera.to_pixels(new_points)
            color = canvas.theme.forces["repulsion_obstacle"]
            draw_dots(page, centers, _POINT_RADIUS_PX * canvas.scale, color)
        self._drawn_points = points


def _build_key(canvas: Canvas, scene: Scene) -> tuple[object, ...]:
    """Return all that the page depends on, apart from the points."""
    return (
        canvas.camera,
        canvas.theme.name,
        canvas.scale,
        canvas.surface.get_size(),
        tuple(canvas.surface.get_clip()),
        canvas.visible_layers,
        _get_selected_number(scene),
    )


def _get_selected_number(scene: Scene) -> int | None:
    """Return the number of the selected robot; None if no robot is selected."""
    if scene.selected is None:
        return None
    return scene.get_number(scene.selected)


def get_discovered_map(scene: Scene) -> DiscoveredMap | None:
    """Return the map that the selected robot has discovered; None if its controller has no maps."""
    if scene.snapshot is None or scene.selected is None:
        return None
    # Controllers of users define memories of their own, which need not have maps.
    maps = getattr(scene.snapshot.decision.memory, "maps", ())
    row = scene.selected
    if scene.memory_rows is not None:
        row = int(scene.memory_rows[row])
    if row >= len(maps):
        return None
    known_map = maps[row]
    if not isinstance(known_map, DiscoveredMap):
        return None
    return known_map


def draw_discovered_map(canvas: Canvas, known_map: DiscoveredMap) -> None:
    """Draw the visible cells of a discovered map: a veil over unknown ones, walls in color, no free ones."""
    raster = known_map.raster
    clip = canvas.surface.get_clip()
    clip_corners = np.array([clip.topleft, clip.bottomright], dtype=float)
    rows, columns = raster.find_cells(canvas.camera.to_world(clip_corners))
    visible = (slice(rows.min(), rows.max() + 1), slice(columns.min(), columns.max() + 1))
    low = np.array([columns.min(), rows.min()])
    high = np.array([columns.max() + 1, rows.max() + 1])
    ends = canvas.camera.to_pixels(np.array(raster.origin) + np.array([low, high]) * raster.cell_size)
    (left, bottom), (right, top) = ends.round().astype(int).tolist()
    if right <= left or bottom <= top:
        return
    pixels = _color_cells(known_map, visible, canvas.theme)
    # The first row is the lowest one in the map, but the highest one in a picture.
    upright = np.ascontiguousarray(pixels[::-1])
    n_rows, n_columns, _ = pixels.shape
    picture = pygame.image.frombuffer(upright.tobytes(), (n_columns, n_rows), "RGBA")
    scaled = pygame.transform.scale(picture, (right - left, bottom - top))
    canvas.surface.blit(scaled, (left, top), special_flags=pygame.BLEND_PREMULTIPLIED)


def _color_cells(known_map: DiscoveredMap, visible: tuple[slice, slice], theme: Theme) -> NDArray[np.uint8]:
    """Return the premultiplied RGBA colors, (rows, columns, 4), of the visible cells of a discovered map."""
    # States above WALL are drawn as walls.
    state = np.minimum(known_map.state[visible], WALL)
    is_inside = ~known_map.raster.is_outside[visible]
    pixels = np.zeros((*state.shape, 4), dtype=np.uint8)
    for value, opacity in _CELL_OPACITIES.items():
        color = theme.obstacle if value == UNKNOWN else theme.forces["repulsion_obstacle"]
        pixels[(state == value) & is_inside] = premultiply(color, opacity)
    return pixels


def _get_pale_colors(canvas: Canvas) -> tuple[Color, Color]:
    """Return the fill and edge colors of obstacles that no robot has sensed."""
    theme = canvas.theme
    fill = mix(theme.background, theme.obstacle, _UNKNOWN_FILL_STRENGTH)
    edge = mix(theme.background, theme.obstacle_edge, _UNKNOWN_EDGE_STRENGTH)
    return fill, edge


def _draw_known_obstacle_symbol(canvas: Canvas, x: float, y: float) -> None:
    half_width = 8 * canvas.scale
    top = y - 2 * canvas.scale
    fill, edge = _get_pale_colors(canvas)
    box = pygame.Rect(round(x - half_width), round(top), round(2 * half_width), round(6 * canvas.scale))
    pygame.draw.rect(canvas.surface, fill, box)
    pygame.draw.rect(canvas.surface, edge, box, canvas.scale_width(1.0))
    dots = np.column_stack([x + half_width * np.array([-0.9, -0.3, 0.3, 0.9]), np.full(4, top)])
    color = canvas.theme.forces["repulsion_obstacle"]
    draw_dots(canvas, dots, _POINT_RADIUS_PX * canvas.scale, color)


build_known_obstacles_legend = build_legend("known obstacles", _draw_known_obstacle_symbol)
