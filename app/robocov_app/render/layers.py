"""What is drawn of the world, one class a layer: map, cells, robots and where they went.

`aim_marks` has where robots head, `forces` the layers that explain a decision, `furniture` the scale bar,
status and legend.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np
import pygame
import shapely

from robocov.arrays import Array
from robocov_app.render import sprites
from robocov_app.render.camera import Camera, round_length
from robocov_app.render.canvas import Canvas, Sprite, premultiplied
from robocov_app.render.layout import fitted_radii, mark_size
from robocov_app.render.scene import MovingObstacle, Scene
from robocov_app.render.theme import Colour, mix

READABLE = 9.0
"""Radius of a drawn robot in pixels at scale 1 where it has room: a number can be read in it."""

SMALLEST_NUMBER = 6.6
"""Least size of a robot's number in pixels at scale 1."""

SMALLEST = 2.4
"""Radius below which no robot is drawn in pixels at scale 1."""

GRID_GAP = 34.0
"""Least distance between the lines of the grid in pixels at scale 1."""

NARROW = 20.0
"""Width of cells in pixels at scale 1 below which edges between them are not smooth: they hardly show."""


@dataclass(frozen=True)
class LegendEntry:
    """A line of the legend: its text, and how to draw its glyph around a pixel, within 22 x 14 px at scale 1.

    `style` differs when the same words stand beside another glyph.
    """

    text: str
    draw: Callable[[Canvas, float, float], None]
    style: str = ""

    def key(self) -> tuple[str, str]:
        """Return what an entry has in common with those that say and show the same."""
        return self.text, self.style


class Layer(ABC):
    """One thing that a picture can show.

    `title` is for check boxes; `default` is whether it is shown unless asked otherwise; what is `static`
    depends on map, camera and theme alone and is kept; what is `in_world` stays inside the view of the
    camera.
    """

    name: str
    title: str
    default: ClassVar[bool] = True
    static: ClassVar[bool] = False
    in_world: ClassVar[bool] = True

    @abstractmethod
    def draw(self, canvas: Canvas, scene: Scene) -> None:
        """Draw what `scene` has of this layer."""

    def legend(self, scene: Scene) -> list[LegendEntry]:
        """Return the entries of the legend that explain what this layer draws of `scene`."""
        return []


class Cells(Layer):
    """The Voronoi cells, in the tint of their robots."""

    name = "cells"
    title = "Voronoi cells"

    def draw(self, canvas: Canvas, scene: Scene) -> None:
        if scene.cells is None:
            return
        sizes = np.array([len(cell) for cell in scene.cells])
        corners = canvas.camera.to_pixels(np.concatenate(scene.cells))
        ends = np.cumsum(sizes)
        fills: list[Colour | None] = [None] * len(sizes)
        if not self._lines_only(canvas, scene):
            tints = [canvas.theme.cell(hue) for hue in range(len(canvas.theme.robots))]
            hues = canvas.hues if scene.cell_owners is None else canvas.hues[scene.cell_owners]
            fills = [tints[hue] for hue in hues.tolist()]
        wide = canvas.camera.zoom * (scene.environment.region.area / len(sizes)) ** 0.5
        edge = canvas.theme.cell_edge
        narrow = wide < NARROW * canvas.scale
        canvas.polygons(corners, ends.tolist(), fills, edge if narrow else None)
        if narrow:
            return
        following = np.arange(1, len(corners) + 1)
        following[ends[sizes > 0] - 1] = (ends - sizes)[sizes > 0]
        edges = np.hstack([corners, corners[following]])
        # what lies on the rim is drawn over
        edges = _forward(edges) if "boundary" in canvas.shown else _once(edges)
        canvas.segments(edges, edge, canvas.width(canvas.theme.line))

    def legend(self, scene: Scene) -> list[LegendEntry]:
        def glyph(canvas: Canvas, x: float, y: float) -> None:
            fill = None if self._lines_only(canvas, scene) else canvas.theme.cell(0)
            canvas.swatch(x, y, fill, canvas.theme.cell_edge)

        return [LegendEntry("Voronoi cell", glyph)] if scene.cells else []

    @staticmethod
    def _lines_only(canvas: Canvas, scene: Scene) -> bool:
        """Whether colours below mean something else."""
        return scene.field is not None and bool({"distances", "geodesic_cells"} & canvas.shown)


def _forward(edges: Array) -> Array:
    """Return those of (m, 4) px edges that run to the right, or straight down.

    Two cells run along the edge between them in opposite directions: each is returned once.
    """
    x1, y1, x2, y2 = np.rint(edges * 16.0).T
    return np.asarray(edges[(x1 < x2) | ((x1 == x2) & (y1 < y2))])


def _once(edges: Array) -> Array:
    """Return (m, 4) px edges without those that are there already, from the other end too.

    Neighbouring cells share edges; a smooth line that is drawn twice is not smooth any more.
    """
    turned = (edges[:, 0] > edges[:, 2]) | ((edges[:, 0] == edges[:, 2]) & (edges[:, 1] > edges[:, 3]))
    edges = np.where(turned[:, None], edges[:, [2, 3, 0, 1]], edges)
    _, first = np.unique(np.rint(edges * 16.0), axis=0, return_index=True)
    return np.asarray(edges[first])


class Grid(Layer):
    """Lines at round distances of metres."""

    name = "grid"
    title = "Grid"
    static = True

    def draw(self, canvas: Canvas, scene: Scene) -> None:
        step = grid_step(canvas.camera.zoom, canvas.scale)
        low_x, low_y, high_x, high_y = scene.environment.region.bounds
        seen_x, seen_y, end_x, end_y = canvas.camera.visible()
        colour = premultiplied(canvas.theme.grid, 0.5)
        width = canvas.width(canvas.theme.line)
        clip = canvas.surface.get_clip()
        region = scene.environment.region.polygon
        for x in (
            np.arange(np.ceil(max(low_x, seen_x) / step), np.floor(min(high_x, end_x) / step) + 1) * step
        ):
            (left, top), (_, bottom) = _across(canvas, region, ((x, high_y), (x, low_y)))
            line = pygame.Rect(round(left - width / 2), round(top), width, round(bottom) - round(top))
            canvas.surface.fill(colour, line.clip(clip))
        for y in (
            np.arange(np.ceil(max(low_y, seen_y) / step), np.floor(min(high_y, end_y) / step) + 1) * step
        ):
            (left, top), (right, _) = _across(canvas, region, ((low_x, y), (high_x, y)))
            line = pygame.Rect(round(left), round(top - width / 2), round(right) - round(left), width)
            canvas.surface.fill(colour, line.clip(clip))


def _across(
    canvas: Canvas, region: shapely.Polygon, line: tuple[tuple[float, float], tuple[float, float]]
) -> list[list[float]]:
    """Return the ends, in pixels, of what of `line` lies in the convex `region`; no length where nothing."""
    inside = shapely.get_coordinates(shapely.intersection(region, shapely.LineString(line)))
    if len(inside) != 2:
        return canvas.camera.to_pixels(np.array([line[0], line[0]])).tolist()  # type: ignore[no-any-return]
    if np.hypot(*(inside[0] - line[0])) > np.hypot(*(inside[1] - line[0])):
        inside = inside[::-1]
    return canvas.camera.to_pixels(inside).tolist()  # type: ignore[no-any-return]


def grid_step(zoom: float, scale: float) -> float:
    """Return the distance of the grid's lines in metres: the least round one that leaves `GRID_GAP`."""
    least = GRID_GAP * scale / zoom
    below = round_length(least)
    return below if below >= least else round_length(2.5001 * below)


class Obstacles(Layer):
    """Obstacles, and what of the robots' convex region lies outside the boundary: they know neither."""

    name = "obstacles"
    title = "Obstacles"
    static = True

    def draw(self, canvas: Canvas, scene: Scene) -> None:
        # courtyards are cut out of a page of their own, so that what lies below shows in them
        page = pygame.Surface(canvas.surface.get_size(), pygame.SRCALPHA, 32)
        page.set_clip(canvas.surface.get_clip())
        own = Canvas(page, canvas.camera, canvas.theme, canvas.scale, canvas.hues)
        parts = sorted(scene.environment.blocked.geoms, key=lambda part: -shapely.Polygon(part.exterior).area)
        rings = []
        for part in parts:
            outer = canvas.camera.to_pixels(np.asarray(part.exterior.coords)[:-1])
            own.polygon(outer, (*canvas.theme.obstacle, 255))
            rings.append(outer)
            for hole in part.interiors:
                inner = canvas.camera.to_pixels(np.asarray(hole.coords)[:-1])
                own.polygon(inner, (0, 0, 0, 0))
                rings.append(inner)
        for corners in rings:
            own.outline(corners, canvas.theme.obstacle_edge, canvas.width(canvas.theme.line))
        for obstacle in scene.moving:
            self._draw_motion(own, scene.environment.region.polygon, obstacle)
        canvas.surface.blit(page, (0, 0), special_flags=pygame.BLEND_PREMULTIPLIED)

    @staticmethod
    def _draw_motion(canvas: Canvas, region: shapely.Polygon, obstacle: MovingObstacle) -> None:
        """Draw the path of a moving obstacle, its shape, and an arrow where it heads."""
        theme, camera, width = canvas.theme, canvas.camera, canvas.width(canvas.theme.line)
        for part in shapely.get_parts(shapely.intersection(obstacle.polygon, region)):
            if not isinstance(part, shapely.Polygon):
                continue
            corners = camera.to_pixels(np.asarray(part.exterior.coords)[:-1])
            if not part.interiors:
                canvas.polygon(corners, (*theme.moving_obstacle, 255))
            canvas.outline(corners, theme.obstacle_edge, 2 * width)
        for start, end in pairwise(camera.to_pixels(obstacle.path).tolist()):
            canvas.dashes(start, end, theme.ink, width)
        middle = camera.to_pixels(obstacle.middle)
        along = 11.0 * canvas.scale * obstacle.heading * np.array([1.0, -1.0])
        canvas.arrow((middle - along).tolist(), (middle + along).tolist(), theme.ink, 2.0 * canvas.scale)

    def legend(self, scene: Scene) -> list[LegendEntry]:
        def glyph(canvas: Canvas, x: float, y: float) -> None:
            canvas.swatch(x, y, canvas.theme.obstacle, canvas.theme.obstacle_edge)

        def moving(canvas: Canvas, x: float, y: float) -> None:
            canvas.swatch(x, y, canvas.theme.moving_obstacle, canvas.theme.obstacle_edge)
            half = 10.0 * canvas.scale
            canvas.arrow((x - half, y), (x + half, y), canvas.theme.ink, 1.6 * canvas.scale)

        found = not scene.environment.blocked.is_empty
        entries = [LegendEntry("obstacle (unknown to robots)", glyph)] if found else []
        return [*entries, LegendEntry("moving obstacle and its path", moving)] if scene.moving else entries


class Boundary(Layer):
    """The outline of the convex region, all that robots know of the map."""

    name = "boundary"
    title = "Boundary"
    static = True

    def draw(self, canvas: Canvas, scene: Scene) -> None:
        corners = canvas.camera.to_pixels(scene.environment.region.vertices)
        canvas.outline(corners, canvas.theme.boundary, canvas.width(canvas.theme.boundary_line))


class Starts(Layer):
    """Green rings where the robots began."""

    name = "starts"
    title = "Starts"

    def __init__(self) -> None:
        self._kept: tuple[Array, object, list[tuple[pygame.Surface, tuple[int, int]]]] | None = None

    def draw(self, canvas: Canvas, scene: Scene) -> None:
        if scene.starts is None:
            return
        view = canvas.camera, canvas.scale, canvas.theme.name, canvas.surface.get_size()
        if self._kept is None or self._kept[0] is not scene.starts or self._kept[1] != view:
            centers = canvas.camera.to_pixels(scene.starts)
            radius = rounded(0.5 * mark_size(centers, 5.0 * canvas.scale, 9.0 * canvas.scale))
            rings = canvas.placed([self._ring(canvas, radius)], centers)
            self._kept = scene.starts, view, rings
        canvas.surface.fblits(self._kept[2], pygame.BLEND_PREMULTIPLIED)

    @staticmethod
    def _ring(canvas: Canvas, radius: float) -> Sprite:
        width = min(1.6 * canvas.scale, 0.4 * radius)
        return partial(sprites.ring, radius, canvas.theme.start, width)

    def legend(self, scene: Scene) -> list[LegendEntry]:
        def glyph(canvas: Canvas, x: float, y: float) -> None:
            canvas.stamp(self._ring(canvas, 4.5 * canvas.scale), (x, y))

        return [LegendEntry("start", glyph)] if scene.starts is not None else []


class Robots(Layer):
    """The robots: discs with numbers; in a crowd smaller ones, down to their true size, without."""

    name = "robots"
    title = "Robots"

    def draw(self, canvas: Canvas, scene: Scene) -> None:
        if scene.snapshot is None:
            return
        theme, scale = canvas.theme, canvas.scale
        edge = mix(theme.background, theme.ink, 0.55)
        radii = drawn_radii(canvas, scene)
        numbers = np.arange(len(radii)) + 1 if scene.numbers is None else np.array(scene.numbers)
        rings = np.minimum(1.6 * scale, rounded(0.3 * radii))
        sizes = sprites.number_size(radii - rings, 1 + np.digitize(numbers, [10, 100, 1000]))
        told = np.where(sizes < SMALLEST_NUMBER * scale, 0, numbers)
        # in a crowd many look the same
        looks: dict[tuple[float, float, int, int], int] = {}
        columns = radii.tolist(), rings.tolist(), canvas.hues.tolist(), told.tolist()
        which = [looks.setdefault(look, len(looks)) for look in zip(*columns, strict=True)]
        discs = [
            partial(sprites.disc, radius, theme.robots[hue], theme.robot_ring, ring, edge, str(number or ""))
            for radius, ring, hue, number in looks
        ]
        canvas.stamps(discs, canvas.camera.to_pixels(scene.snapshot.positions), np.array(which, dtype=int))

    def legend(self, scene: Scene) -> list[LegendEntry]:
        def glyph(canvas: Canvas, x: float, y: float) -> None:
            theme, scale = canvas.theme, canvas.scale
            edge = mix(theme.background, theme.ink, 0.55)
            canvas.stamp(
                lambda shift: sprites.disc(
                    6.5 * scale, theme.robots[0], theme.robot_ring, 1.4 * scale, edge, "", shift
                ),
                (x, y),
            )

        return [LegendEntry("robot", glyph)] if scene.snapshot is not None else []


def drawn_radii(canvas: Canvas, scene: Scene) -> Array:
    """Return the radius in pixels at which each robot is drawn, in steps of half a pixel.

    Large enough for a number where there is room; in a crowd smaller, so that discs keep apart, but
    never below the true size.
    """
    return _drawn_radii(scene, canvas.camera, canvas.scale)


@lru_cache(maxsize=8)  # several layers ask in each frame
def _drawn_radii(scene: Scene, camera: Camera, scale: float) -> Array:
    if scene.snapshot is None:
        return np.empty(0)
    centers = camera.to_pixels(scene.snapshot.positions)
    true = scene.team.radius * camera.zoom
    radii: Array = rounded(np.minimum(fitted_radii(centers, true, SMALLEST * scale, READABLE * scale), 400.0))
    return radii


def rounded(pixels: Any) -> Any:
    """Return sizes in steps of half a pixel, so that few sprites are made."""
    return np.round(pixels * 2) / 2
