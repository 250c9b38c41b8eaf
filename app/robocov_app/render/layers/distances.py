"""Layers of the distance to the nearest robot: distance map and geodesic cells."""

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
import pygame

from robocov.typing import FloatArray
from robocov_app.look import legend
from robocov_app.look.theme import Theme
from robocov_app.render.canvas import Canvas, LegendEntry
from robocov_app.render.distance_map.colors import build_palette, compute_color_levels, compute_line_opacities
from robocov_app.render.distance_map.pixel_distances import DistanceField, compute_block_middles
from robocov_app.render.layers.density import build_gradient_entry
from robocov_app.render.layers.layer import build_legend
from robocov_app.render.pixel_arrays import build_palette_surface, convert_axes_to_world
from robocov_app.render.scene import Scene
from robocov_app.render.surface_cache import LatestValue

_BORDER_WIDTH_PX = 1.6
"""Width of the borders of geodesic cells, at scale 1."""
_COARSE_PX = 2
"""Distance between the computed pixels of a distance map, which is smooth enough to be enlarged."""
_HATCH_PX = 5
"""Coarse pixels between the lines that hatch unreachable areas."""
_MIN_LENGTH_PX = 1e-9

FieldRenderer: TypeAlias = Callable[[Canvas, Scene, DistanceField, FloatArray, FloatArray], pygame.Surface]
"""Renders a field at columns x, (w,) m, and rows y, (h,) m."""


class FieldLayer:
    """Draws a distance field; its picture is rendered again when the field or the view changes.

    Parameters
    ----------
    render : FieldRenderer
    """

    def __init__(self, render: FieldRenderer) -> None:
        self._render = render
        self._picture = LatestValue[pygame.Surface]()

    def draw(self, canvas: Canvas, scene: Scene) -> None:
        """Draw the field within the region."""
        field = scene.field
        corner, end = _find_visible_pixels(canvas, scene)
        if field is None or (end <= corner).any():
            return
        key = (
            corner.tolist(),
            end.tolist(),
            scene.field_limit,
            canvas.camera,
            canvas.theme.name,
            canvas.scale,
            canvas.hues.tolist(),
            "distances" in canvas.visible_layers,
        )

        def render_picture() -> pygame.Surface:
            columns = np.arange(corner[0], end[0])
            rows = np.arange(corner[1], end[1])
            x, y = convert_axes_to_world(canvas.camera, columns, rows)
            return self._render(canvas, scene, field, x, y)

        picture = self._picture.get_or_compute(field, key, render_picture)
        canvas.surface.blit(picture, corner.tolist())
        _cover_outside(canvas, scene.environment.region.vertices)


def _find_visible_pixels(canvas: Canvas, scene: Scene) -> tuple[FloatArray, FloatArray]:
    """Return the upper left pixel that shows the region, (2,) px, and the one after the lower right."""
    low_x, low_y, high_x, high_y = scene.environment.region.bounds
    corner, end = canvas.camera.to_pixels(np.array([[low_x, high_y], [high_x, low_y]]))
    view_corner = np.array(canvas.camera.view[:2])
    view_end = np.add(canvas.camera.view[:2], canvas.camera.view[2:])
    corner = np.maximum(np.floor(corner), np.floor(view_corner)).astype(int)
    end = np.minimum(np.ceil(end), np.ceil(view_end)).astype(int) + 1
    return corner, end


def _cover_outside(canvas: Canvas, vertices: FloatArray) -> None:
    """Cover the outside of a convex outline, (k, 2) m, with the background, one side after the other."""
    corners = canvas.camera.to_pixels(vertices)
    # Long enough for a rectangle on any side to cover the whole surface beyond it.
    length = 4.0 * (np.ptp(corners, axis=0).sum() + sum(canvas.surface.get_size()))
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        along = length * (end - start) / max(float(np.hypot(*(end - start))), _MIN_LENGTH_PX)
        # Pixels run downwards, so that the outside is to the left of a counter-clockwise outline.
        outward = np.array([-along[1], along[0]])
        ring = [start - along, end + along, end + along + outward, start - along + outward]
        canvas.fill_polygon(np.array(ring), canvas.theme.background)


def render_distances(
    canvas: Canvas, scene: Scene, field: DistanceField, x: FloatArray, y: FloatArray
) -> pygame.Surface:
    """Render the distance map at columns x, (w,) m, and rows y, (h,) m, as a `FieldRenderer`."""
    coarse_x = compute_block_middles(x, _COARSE_PX)
    coarse_y = compute_block_middles(y, _COARSE_PX)
    levels = compute_color_levels(field, coarse_x, coarse_y, scene.field_limit, _HATCH_PX)
    coarse = build_palette_surface(levels, build_palette(canvas.theme)).convert(canvas.surface)
    size = (_COARSE_PX * coarse.get_width(), _COARSE_PX * coarse.get_height())
    return pygame.transform.smoothscale(coarse, size).subsurface((0, 0, len(x), len(y)))


def render_geodesic_cells(
    canvas: Canvas, scene: Scene, field: DistanceField, x: FloatArray, y: FloatArray
) -> pygame.Surface:
    """Render the geodesic cells, or only their borders if the distance map is visible, as a `FieldRenderer`.

    Geodesic cells are the cells of the coverage cost: a point belongs to the robot with the shortest path to
    it around obstacles.
    """
    if "distances" in canvas.visible_layers:
        return _render_borders(canvas, field, x, y)
    theme = canvas.theme
    zoom = canvas.camera.zoom
    width = _BORDER_WIDTH_PX * canvas.scale
    owners, borders = field.compute_cells(x, y, _get_border_reach(canvas))
    # The last color is for points without a robot (owner -1).
    n_hues = len(theme.robots)
    colors = [*(theme.get_cell_color(hue) for hue in range(n_hues)), theme.unreached]
    color_indices = np.append(canvas.hues, n_hues).astype(np.uint8)
    palette = np.array(colors, dtype=np.uint8)
    # Wrapping turns -1 into the last index.
    indices = color_indices.take(owners, mode="wrap")
    cells = build_palette_surface(indices, palette).convert(canvas.surface)
    pixels = pygame.surfarray.pixels3d(cells)
    border_pixels = (borders.columns, borders.rows)
    opacities = compute_line_opacities(borders, zoom, width)[:, None]
    border_color = np.array(theme.geodesic_border)
    pixels[border_pixels] = np.rint((1.0 - opacities) * pixels[border_pixels] + opacities * border_color)
    # The surface stays locked until the array is deleted.
    del pixels
    return cells


def _render_borders(canvas: Canvas, field: DistanceField, x: FloatArray, y: FloatArray) -> pygame.Surface:
    """Render the borders of geodesic cells on a transparent surface."""
    borders = field.compute_borders(x, y, _get_border_reach(canvas))
    opacities = compute_line_opacities(borders, canvas.camera.zoom, _BORDER_WIDTH_PX * canvas.scale)
    lines = pygame.Surface((len(x), len(y)), pygame.SRCALPHA, 32)
    lines.fill((*canvas.theme.geodesic_border, 0))
    pygame.surfarray.pixels_alpha(lines)[borders.columns, borders.rows] = np.rint(255.0 * opacities)
    # Run-length encoding skips transparent pixels.
    lines.set_alpha(255, pygame.RLEACCEL)
    return lines


def _get_border_reach(canvas: Canvas) -> float:
    """Return the distance from a border within which its line may be visible, m."""
    return (0.5 * _BORDER_WIDTH_PX * canvas.scale + 1.0) / canvas.camera.zoom


def _draw_unreached_symbol(canvas: Canvas, x: float, y: float) -> None:
    canvas.draw_swatch(x, y, canvas.theme.unreached, canvas.theme.obstacle_edge)


def _has_unreached_sites(scene: Scene) -> bool:
    return scene.field is not None and bool((scene.field.result.owners < 0).any())


_build_unreached_legend = build_legend(legend.UNREACHED, _draw_unreached_symbol, _has_unreached_sites)


def build_distances_legend(scene: Scene) -> list[LegendEntry]:
    """Build the legend of the distance map."""
    gradient = build_gradient_entry("distance to the nearest robot", Theme.build_heat_table)
    return [gradient, *_build_unreached_legend(scene)]


def _draw_border_symbol(canvas: Canvas, x: float, y: float) -> None:
    start, end = canvas.get_symbol_line(x, y, 8)
    canvas.draw_line(start, end, canvas.theme.geodesic_border, canvas.scale_width(_BORDER_WIDTH_PX))


build_geodesic_cells_legend = build_legend(legend.GEODESIC_BORDER, _draw_border_symbol)
