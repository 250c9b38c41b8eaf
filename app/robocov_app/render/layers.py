"""Layers: what a picture can show of a scene, and those of the map: cells, grid, obstacles, boundary."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TypeAlias

import numpy as np
import pygame
import shapely

from robocov_app.look.colors import Color
from robocov_app.look.legend import MOVING_OBSTACLE, UNKNOWN_OBSTACLE
from robocov_app.look.lengths import round_down
from robocov_app.render.canvas import Canvas, Glyph, LegendEntry, premultiply
from robocov_app.render.moving_obstacles import MovingObstacle
from robocov_app.render.scene import Scene

GRID_GAP = 34.0  # least distance between the lines of the grid in pixels at scale 1
NARROW = 20.0  # width of cells in pixels at scale 1 below which their edges are not smooth: they hardly show

Legend: TypeAlias = Callable[[Scene], list[LegendEntry]]


def says(text: str, glyph: Glyph, when: Callable[[Scene], bool] = lambda scene: True) -> Legend:
    """Return a legend of one entry, in scenes for which `when` holds."""
    return lambda scene: [LegendEntry(text, glyph)] if when(scene) else []


@dataclass(frozen=True, eq=False)
class Layer:
    """One thing that a picture can show, of scenes where no field of `needs` is None or empty.

    `static`: depends on map, camera and theme alone; `in_world`: stays inside the camera's view.
    """

    name: str
    title: str
    draw: Callable[[Canvas, Scene], None]
    needs: tuple[str, ...] = ()
    legend: Legend = lambda scene: []
    default: bool = True
    static: bool = False
    in_world: bool = True

    def has(self, scene: Scene) -> bool:
        values = [getattr(scene, name) for name in self.needs]
        return not any(each is None or (isinstance(each, Sequence | Mapping) and not each) for each in values)


def _colors_mean_distance(canvas: Canvas, scene: Scene) -> bool:
    return scene.field is not None and bool({"distances", "geodesic_cells"} & canvas.visible_layers)


def draw_cells(canvas: Canvas, scene: Scene) -> None:
    assert scene.cells is not None
    sizes = np.array([len(cell) for cell in scene.cells])
    corners = canvas.camera.to_pixels(np.concatenate(scene.cells))
    ends = np.cumsum(sizes)
    fills: list[Color | None] = [None] * len(sizes)
    if not _colors_mean_distance(canvas, scene):
        tints = [canvas.theme.get_cell_color(hue) for hue in range(len(canvas.theme.robots))]
        hues = canvas.hues if scene.cell_owners is None else canvas.hues[scene.cell_owners]
        fills = [tints[hue] for hue in hues.tolist()]
    edge = canvas.theme.cell_edge
    narrow = canvas.camera.zoom * (scene.environment.region.area / len(sizes)) ** 0.5 < NARROW * canvas.scale
    canvas.draw_polygons(corners, ends.tolist(), fills, edge if narrow else None)
    if narrow:
        return
    following = np.arange(1, len(corners) + 1)
    following[ends[sizes > 0] - 1] = (ends - sizes)[sizes > 0]
    edges = np.hstack([corners, corners[following]])
    if "boundary" in canvas.visible_layers:
        # one of the two cells beside has it to the right or straight down; what lies on the rim is drawn over
        x1, y1, x2, y2 = np.rint(edges * 16.0).T
        edges = edges[(x1 < x2) | ((x1 == x2) & (y1 < y2))]
    else:  # each once, also from the other end: drawn twice they are not smooth
        turned = (edges[:, 0] > edges[:, 2]) | ((edges[:, 0] == edges[:, 2]) & (edges[:, 1] > edges[:, 3]))
        edges = np.where(turned[:, None], edges[:, [2, 3, 0, 1]], edges)
        edges = edges[np.unique(np.rint(edges * 16.0), axis=0, return_index=True)[1]]
    canvas.draw_segments(edges, edge, canvas.scale_width(canvas.theme.line))


def cells_legend(scene: Scene) -> list[LegendEntry]:
    def glyph(canvas: Canvas, x: float, y: float) -> None:
        fill = None if _colors_mean_distance(canvas, scene) else canvas.theme.get_cell_color(0)
        canvas.draw_swatch(x, y, fill, canvas.theme.cell_edge)

    return [LegendEntry("Voronoi cell", glyph)]


def draw_grid(canvas: Canvas, scene: Scene) -> None:
    """Draw lines within the region at the least round distance that leaves `GRID_GAP` between them."""
    least = GRID_GAP * canvas.scale / canvas.camera.zoom
    step = round_down(least)
    step = step if step >= least else round_down(2.5001 * step)
    region, seen = scene.environment.region, canvas.camera.compute_visible_bounds()
    color, width = premultiply(canvas.theme.grid, 0.5), canvas.scale_width(canvas.theme.line)
    for axis in (0, 1):
        low, high = max(region.bounds[axis], seen[axis]), min(region.bounds[axis + 2], seen[axis + 2])
        for place in np.arange(np.ceil(low / step), np.floor(high / step) + 1) * step:
            line = np.full((2, 2), place)
            line[:, 1 - axis] = region.bounds[1 - axis], region.bounds[3 - axis]
            inside = shapely.get_coordinates(shapely.intersection(region.polygon, shapely.LineString(line)))
            if len(inside) == 2:
                ends = canvas.camera.to_pixels(inside)
                begin, end = ends.min(axis=0), ends.max(axis=0)
                sides = (np.rint(end) - np.rint(begin)).astype(int)
                begin[axis], sides[axis] = begin[axis] - width / 2, width
                box = pygame.Rect(np.rint(begin).astype(int).tolist(), sides.tolist())
                canvas.surface.fill(color, box.clip(canvas.surface.get_clip()))


def draw_blocked(canvas: Canvas, scene: Scene, fill: Color, moving: Color, edge: Color) -> None:
    """Draw obstacles on a transparent page: what lies below it shows in their courtyards."""
    rings, parts = [], scene.environment.blocked.geoms
    # courtyards before what stands in them
    for part in sorted(parts, key=lambda part: -shapely.Polygon(part.exterior).area):
        colors = [(*fill, 255), *[(0, 0, 0, 0)] * len(part.interiors)]
        for ring, color in zip((part.exterior, *part.interiors), colors, strict=True):
            rings.append(canvas.camera.to_pixels(np.asarray(ring.coords)[:-1]))
            canvas.fill_polygon(rings[-1], color)
    for corners in rings:
        canvas.draw_outline(corners, edge, canvas.scale_width(canvas.theme.line))
    for obstacle in scene.moving:
        draw_motion(canvas, scene, obstacle, moving, edge)


def draw_obstacles(canvas: Canvas, scene: Scene) -> None:
    """Draw obstacles, and what of the robots' convex region lies outside the boundary: they know neither."""
    page, theme = pygame.Surface(canvas.surface.get_size(), pygame.SRCALPHA, 32), canvas.theme
    page.set_clip(canvas.surface.get_clip())
    own = replace(canvas, surface=page)
    draw_blocked(own, scene, theme.obstacle, theme.moving_obstacle, theme.obstacle_edge)
    canvas.surface.blit(page, (0, 0), special_flags=pygame.BLEND_PREMULTIPLIED)


def draw_motion(canvas: Canvas, scene: Scene, obstacle: MovingObstacle, fill: Color, edge: Color) -> None:
    theme, camera, width = canvas.theme, canvas.camera, canvas.scale_width(canvas.theme.line)
    for part in shapely.get_parts(shapely.intersection(obstacle.polygon, scene.environment.region.polygon)):
        if not isinstance(part, shapely.Polygon):
            continue
        corners = camera.to_pixels(np.asarray(part.exterior.coords)[:-1])
        if not part.interiors:
            canvas.fill_polygon(corners, (*fill, 255))
        canvas.draw_outline(corners, edge, 2 * width)
    for start, end in pairwise(camera.to_pixels(obstacle.path).tolist()):
        canvas.draw_dashed_line(start, end, theme.ink, width)
    middle = camera.to_pixels(obstacle.middle)
    along = 11.0 * canvas.scale * obstacle.heading * np.array([1.0, -1.0])
    canvas.draw_arrow((middle - along).tolist(), (middle + along).tolist(), theme.ink, 2.0 * canvas.scale)


def _moving_glyph(canvas: Canvas, x: float, y: float) -> None:
    canvas.draw_swatch(x, y, canvas.theme.moving_obstacle, canvas.theme.obstacle_edge)
    canvas.draw_arrow(*canvas.get_symbol_line(x, y, 10.0), canvas.theme.ink, 1.6 * canvas.scale)


obstacles_legend = says(
    UNKNOWN_OBSTACLE,
    lambda canvas, x, y: canvas.draw_swatch(x, y, canvas.theme.obstacle, canvas.theme.obstacle_edge),
    lambda scene: not scene.environment.blocked.is_empty,
)
moving_legend = says(MOVING_OBSTACLE, _moving_glyph, lambda scene: bool(scene.moving))


def draw_boundary(canvas: Canvas, scene: Scene) -> None:
    corners = canvas.camera.to_pixels(scene.environment.region.vertices)
    canvas.draw_outline(corners, canvas.theme.boundary, canvas.scale_width(canvas.theme.boundary_line))
