"""The painter: puts the layers together on any pygame surface, and gives frames without a display."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import partial
from itertools import groupby

import numpy as np
import pygame
from numpy.typing import NDArray

from robocov.environment import Environment
from robocov.errors import ParameterError, describe_unknown_name
from robocov_app.look.robot_colors import MAX_OWN_HUES, ColorScheme, choose_robot_hues
from robocov_app.look.theme import LIGHT, Theme
from robocov_app.render import annotations, forces, heatmaps, knowledge, layers, marks
from robocov_app.render.annotations import LEGEND_ROW, MARGIN, STRIP
from robocov_app.render.camera import Camera
from robocov_app.render.canvas import Canvas, LegendEntry
from robocov_app.render.layers import Layer
from robocov_app.render.scene import Scene
from robocov_app.render.surface_cache import Latest
from robocov_app.render.trajectories import Trajectories

_extra = partial(Layer, default=False)
_fixed = partial(Layer, static=True)
_strip = partial(Layer, in_world=False)


def standard_layers(trails: ColorScheme = "robots") -> list[Layer]:
    """Return one of each layer, from the lowest to the topmost; `trails` are colors of `Trajectories`."""
    distances = heatmaps.field_drawing(heatmaps.draw_distances)
    geodesic = heatmaps.field_drawing(heatmaps.draw_geodesic_cells)
    sensed = knowledge.SensedObstacles()
    trajectories, snapshot = Trajectories(trails), ("snapshot",)

    def obstacles(scene: Scene) -> list[LegendEntry]:
        return [*layers.obstacles_legend(scene), *layers.moving_legend(scene)]

    return [
        _extra("distances", "Distance map", distances, ("field",), heatmaps.distances_legend),
        _extra("geodesic_cells", "Geodesic cells", geodesic, ("field",), heatmaps.geodesic_legend),
        Layer("cells", "Voronoi cells", layers.draw_cells, ("cells",), layers.cells_legend),
        _fixed("grid", "Grid", layers.draw_grid),
        _fixed("density", "Density φ", heatmaps.draw_density, (), heatmaps.density_legend),
        _fixed("obstacles", "Obstacles", layers.draw_obstacles, (), obstacles),
        _fixed("boundary", "Boundary", layers.draw_boundary),
        _extra("sensed", "Known obstacles", sensed.draw, ("sensed", "snapshot"), knowledge.sensed_legend),
        _extra("scan", "Ray scan", knowledge.draw_scans, ("scans",), knowledge.scans_legend),
        forces.range_layer("sensing", "Sensing range"),
        forces.range_layer("communication", "Comm. range"),
        _extra("links", "Neighbours", forces.draw_links, snapshot, forces.links_legend),
        Layer("trajectories", "Trajectories", trajectories.draw, ("trail",), trajectories.legend),
        Layer("starts", "Starts", marks.Starts().draw, ("starts",), marks.starts_legend),
        _extra("obstacle_points", "Nearest obstacle", forces.draw_points, snapshot, forces.points_legend),
        _extra("goals", "Goals", marks.draw_goals, snapshot, marks.goals_legend),
        Layer("centroids", "Centroids", marks.draw_centroids, snapshot, marks.centroids_legend),
        forces.velocity_layer(),
        forces.force_layer("attraction", "Attraction", "full"),
        forces.force_layer("repulsion_robots", "Robot repulsion", "open"),
        forces.force_layer("repulsion_obstacle", "Obstacle repulsion", "dot"),
        forces.force_layer("viscosity", "Viscosity", "bar"),
        forces.force_layer("resultant", "Resultant force", "full"),
        _extra("path", "Path from cursor", knowledge.draw_path, ("path",), knowledge.path_legend),
        Layer("failed", "Failed robots", marks.draw_failed, ("failed",), marks.failed_legend),
        Layer("selection", "Selection", marks.draw_selection, ("snapshot", "selected"), marks.belief_legend),
        Layer("robots", "Robots", marks.draw_robots, snapshot, marks.robots_legend),
        _strip("color_bar", "Color scale", heatmaps.draw_color_bar, ("field",)),
        _strip("legend", "Legend", annotations.LegendStrip().draw),
        _strip("scale_bar", "Scale bar", annotations.draw_scale_bar),
        _strip("status", "Status line", annotations.draw_status),
    ]


def checked_layers(option: str, names: Iterable[str]) -> frozenset[str]:
    """Return names of layers, dashes as underscores; ParameterError names the option of an unknown one."""
    known = [layer.name for layer in standard_layers()]
    wanted = [name.replace("-", "_") for name in names]
    if unknown := [name for name in wanted if name not in known]:
        raise ParameterError(f"{option}: {describe_unknown_name('layer', unknown[0], known)}")
    return frozenset(wanted)


def pane_layers(trails: ColorScheme = "robots") -> list[Layer]:
    """Return the layers of one picture among several: a caption in place of the legend, which they share."""

    def status(canvas: Canvas, scene: Scene) -> None:
        annotations.draw_status(canvas, replace(scene, label="", cost=""))  # the caption says these

    return [
        *(layer for layer in standard_layers(trails) if layer.name not in ("legend", "status")),
        _strip("caption", "Caption", annotations.draw_caption),
        _strip("status", "Status line", status),
    ]


def scale_for(size: tuple[int, int]) -> float:
    """Return the scale of text and lines of films, larger than a window's: 1.25 for 1280 x 720."""
    return min(max(round(min(size[0] / 1024, size[1] / 576) * 8) / 8, 0.875), 6.0)


class Painter:
    """Draws scenes of one environment on surfaces of its `size`, px; shows the layers in `visible`."""

    def __init__(
        self,
        environment: Environment,
        size: tuple[int, int],
        theme: Theme = LIGHT,
        layers: Sequence[Layer] | None = None,
        scale: float | None = None,
    ) -> None:
        self.environment = environment
        self.size = size
        self.theme = theme
        self.layers = list(layers) if layers is not None else standard_layers()
        self.scale = scale_for(size) if scale is None else scale
        self.visible = {layer.name for layer in self.layers if layer.default}
        self._camera: Camera | None = None  # None shows the whole region, whatever the size
        self._hues = choose_robot_hues(0)
        self._static = Latest[pygame.Surface]()
        self._own: pygame.Surface | None = None
        self._room: tuple[object, int, float] = (None, 0, 0.0)  # the most that was needed for these layers

    def show(self, names: Iterable[str]) -> None:
        wanted, known = set(names), {layer.name for layer in self.layers}
        if unknown := wanted - known:
            raise ParameterError(describe_unknown_name("layer", min(unknown), known))
        self.visible = wanted

    def change(self, also: Iterable[str], without: Iterable[str]) -> None:
        """Show some layers too, and others not; names that this painter has no layers of are passed over."""
        self.visible = (self.visible | set(also) & {layer.name for layer in self.layers}) - set(without)

    @property
    def needs_field(self) -> bool:
        return bool({"distances", "geodesic_cells"} & self.visible)

    @property
    def camera(self) -> Camera:
        """The camera, with the view that strips and scale of colors leave; set it to zoom and pan."""
        (width, height), scale, (_, rows, beside) = self.size, self.scale, self._room
        top = (6 + LEGEND_ROW * rows + 6 if rows else MARGIN) * scale
        small = annotations.is_small(height, scale, self.visible)
        bottom = (STRIP if {"scale_bar", "status"} & self.visible and not small else MARGIN) * scale
        view = (0.0, top, max(width - beside, 1.0), max(height - top - bottom, 1.0))
        if self._camera is not None:
            return self._camera.with_view(view)
        side = MARGIN * scale
        inner = (side, top, max(view[2] - (1 if beside else 2) * side, 1.0), view[3])
        return Camera.fit(self.environment.region.bounds, inner, margin=2 * scale).with_view(view)

    @camera.setter
    def camera(self, camera: Camera) -> None:
        self._camera = camera

    def fit(self) -> None:
        """Show the whole region again, also after changes of the size."""
        self._camera = None

    def legend(self, scene: Scene) -> list[str]:
        """Return the words of the legend: exactly those of the layers that draw something of `scene`."""
        return [entry.text for entry in self.legend_entries(scene)]

    def legend_entries(self, scene: Scene) -> list[LegendEntry]:
        return [entry for layer in self._shown() if layer.has(scene) for entry in layer.legend(scene)]

    def draw(self, surface: pygame.Surface, scene: Scene) -> None:
        """Draw a scene on all of a surface; what was zoomed or panned stays so in another size."""
        self.size = surface.get_size()
        numbers = scene.numbers
        if numbers is not None and max(numbers, default=1) <= MAX_OWN_HUES:  # a color stays with its robot
            self._hues = np.array(numbers, dtype=np.intp) - 1
        else:
            self._hues = choose_robot_hues(len(scene.team), scene.adjacency, self._hues)
        entries, shown = self.legend_entries(scene), frozenset(self.visible)
        canvas = Canvas(surface, self.camera, self.theme, self.scale, self._hues, shown, entries)
        names = {layer.name for layer in self._shown()}
        rows = int("caption" in names)
        if not rows and "legend" in names:
            rows = len(annotations.legend_rows(canvas, entries))
        beside = heatmaps.bar_room(canvas, scene)
        if self._room[0] == (key := (self.size, self.scale, shown)):  # maps do not jump as words change
            rows, beside = max(rows, self._room[1]), max(beside, self._room[2])
        self._room = key, rows, beside
        canvas = replace(canvas, camera=self.camera)
        clip = pygame.Rect([round(side) for side in canvas.camera.view])
        surface.fill(self.theme.background)
        for static, group in groupby(self._shown(), key=lambda layer: layer.static):
            if static:
                page = self._page(canvas, scene, list(group), clip)
                surface.blit(page, (0, 0), special_flags=pygame.BLEND_PREMULTIPLIED)
                continue
            for layer in group:
                if layer.has(scene):
                    surface.set_clip(clip if layer.in_world else None)
                    layer.draw(canvas, scene)
        surface.set_clip(None)

    def frame(self, scene: Scene) -> NDArray[np.uint8]:
        """Return `scene` as an RGB picture, (height, width, 3), 0 to 255; it needs no display."""
        if self._own is None or self._own.get_size() != self.size:
            self._own = pygame.Surface(self.size, 0, 32)
        self.draw(self._own, scene)
        width, height = self.size
        return np.frombuffer(pygame.image.tobytes(self._own, "RGB"), dtype=np.uint8).reshape(height, width, 3)

    def _shown(self) -> list[Layer]:
        return [layer for layer in self.layers if layer.name in self.visible]

    def _page(self, canvas: Canvas, scene: Scene, layers: list[Layer], clip: pygame.Rect) -> pygame.Surface:
        """Return the page of neighboring static layers, drawn anew only when something changed."""
        # distances, in colors too, hide the density
        colored = scene.field is not None and "distances" in canvas.shown
        names = [layer.name for layer in layers]
        key = names, canvas.camera, self.theme.name, self.scale, self.size, colored

        def drawn() -> pygame.Surface:
            page = pygame.Surface(self.size, pygame.SRCALPHA, 32)
            page.set_clip(clip)
            for layer in layers:
                if layer.has(scene):
                    layer.draw(replace(canvas, surface=page), scene)
            return page

        return self._static.of(scene.environment, key, drawn)
