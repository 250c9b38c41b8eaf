"""The painter: draws the layers of a scene on a pygame surface, with or without a display."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import partial
from itertools import groupby
from typing import NamedTuple

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
from robocov_app.render.surface_cache import LatestValue
from robocov_app.render.trajectories import Trajectories

_UNIT_WIDTH_PX = 1024
_UNIT_HEIGHT_PX = 576
_SCALE_STEP = 0.125
_MIN_SCALE = 0.875
_MAX_SCALE = 6.0
_FIELD_LAYERS = frozenset({"distances", "geodesic_cells"})
"""Layers that need the distances to the nearest robot."""
_LEGEND_PADDING = 6
"""Space above and below the legend, px at scale 1."""

_extra = partial(Layer, default=False)
_fixed = partial(Layer, static=True)
_strip = partial(Layer, in_world=False)


def standard_layers(trails: ColorScheme = "robots") -> list[Layer]:
    """Build one of each layer, from the lowest to the topmost.

    Parameters
    ----------
    trails : {"robots", "paper"}
        Colors of the trajectories.

    Returns
    -------
    list of Layer
    """
    distances = heatmaps.field_drawing(heatmaps.draw_distances)
    geodesic = heatmaps.field_drawing(heatmaps.draw_geodesic_cells)
    sensed = knowledge.SensedObstacles()
    trajectories = Trajectories(trails)
    snapshot = ("snapshot",)

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
        _extra("links", "Neighbors", forces.draw_links, snapshot, forces.links_legend),
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
    """Check names of layers, which may have dashes instead of underscores.

    Parameters
    ----------
    option : str
        Name of the option in messages.
    names : iterable of str

    Returns
    -------
    frozenset of str
        The names with underscores.

    Raises
    ------
    ParameterError
        If a layer is unknown.
    """
    known_names = [layer.name for layer in standard_layers()]
    layer_names = [name.replace("-", "_") for name in names]
    for name in layer_names:
        if name not in known_names:
            raise ParameterError(f"{option}: {describe_unknown_name('layer', name, known_names)}")
    return frozenset(layer_names)


def pane_layers(trails: ColorScheme = "robots") -> list[Layer]:
    """Build the layers of one picture among several, which has a caption instead of the shared legend."""

    def draw_status(canvas: Canvas, scene: Scene) -> None:
        # The caption contains the name of the controller and the cost.
        annotations.draw_status(canvas, replace(scene, label="", cost=""))

    return [
        *(layer for layer in standard_layers(trails) if layer.name not in ("legend", "status")),
        _strip("caption", "Caption", annotations.draw_caption),
        _strip("status", "Status line", draw_status),
    ]


def scale_for(size: tuple[int, int]) -> float:
    """Return the scale of text and lines of films: 1.25 for 1280 x 720 pixels, in steps of 1/8."""
    width, height = size
    exact = min(width / _UNIT_WIDTH_PX, height / _UNIT_HEIGHT_PX)
    rounded = round(exact / _SCALE_STEP) * _SCALE_STEP
    return min(max(rounded, _MIN_SCALE), _MAX_SCALE)


class _Margins(NamedTuple):
    """Space that strips and the color scale have needed with some layers, size and scale."""

    key: object
    legend_rows: int
    color_bar_width: float
    """px"""


class Painter:
    """Draws scenes of one environment.

    Parameters
    ----------
    environment : Environment
    size : (int, int), px
    theme : Theme
    layers : sequence of Layer, optional
        From the lowest to the topmost; by default those of `standard_layers`.
    scale : float, optional
        Scale of text and lines; by default that of films.

    Attributes
    ----------
    visible : set of str
        Names of the layers that are drawn.
    """

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
        self._camera: Camera | None = None  # None shows the whole region.
        self._hues = choose_robot_hues(0)
        self._static = LatestValue[pygame.Surface]()
        self._own_surface: pygame.Surface | None = None
        self._margins = _Margins(None, 0, 0.0)

    def show(self, names: Iterable[str]) -> None:
        """Show these layers, and no others; raise ParameterError if one is unknown."""
        visible = set(names)
        known = {layer.name for layer in self.layers}
        unknown = visible - known
        if unknown:
            raise ParameterError(describe_unknown_name("layer", min(unknown), known))
        self.visible = visible

    def change(self, also: Iterable[str], without: Iterable[str]) -> None:
        """Show some layers as well, and hide others; unknown names are ignored."""
        known = {layer.name for layer in self.layers}
        self.visible = (self.visible | set(also) & known) - set(without)

    @property
    def needs_field(self) -> bool:
        """Whether a visible layer needs the distances to the nearest robot."""
        return not _FIELD_LAYERS.isdisjoint(self.visible)

    @property
    def camera(self) -> Camera:
        """The camera, with the view that is left by strips and the color scale. Set it to zoom and pan."""
        view = self._compute_view()
        if self._camera is not None:
            return self._camera.with_view(view)
        left, top, width, height = view
        side = MARGIN * self.scale
        sides = 1 if self._margins.color_bar_width else 2
        inner = (left + side, top, max(width - sides * side, 1.0), height)
        fitted = Camera.fit(self.environment.region.bounds, inner, margin=2 * self.scale)
        return fitted.with_view(view)

    @camera.setter
    def camera(self, camera: Camera) -> None:
        self._camera = camera

    def _compute_view(self) -> tuple[float, float, float, float]:
        """Return left, top, width and height of the area for the world, px."""
        width, height = self.size
        rows = self._margins.legend_rows
        top = MARGIN
        if rows:
            top = _LEGEND_PADDING + LEGEND_ROW * rows + _LEGEND_PADDING
        has_strip = bool({"scale_bar", "status"} & self.visible)
        is_small = annotations.is_small(height, self.scale, self.visible)
        bottom = STRIP if has_strip and not is_small else MARGIN
        view_width = max(width - self._margins.color_bar_width, 1.0)
        view_height = max(height - top * self.scale - bottom * self.scale, 1.0)
        return 0.0, top * self.scale, view_width, view_height

    def fit(self) -> None:
        """Show the whole region, also after changes of the size."""
        self._camera = None

    def legend(self, scene: Scene) -> list[str]:
        """Return the texts of the legend, those of the layers that draw something of a scene."""
        return [entry.text for entry in self.legend_entries(scene)]

    def legend_entries(self, scene: Scene) -> list[LegendEntry]:
        """Return the entries of the legend, those of the layers that draw something of a scene."""
        return [entry for layer in self._list_visible() if layer.has(scene) for entry in layer.legend(scene)]

    def draw(self, surface: pygame.Surface, scene: Scene) -> None:
        """Draw a scene on the whole of a surface, whose size becomes that of the painter.

        Parameters
        ----------
        surface : pygame.Surface
        scene : Scene
        """
        self.size = surface.get_size()
        self._update_hues(scene)
        canvas = Canvas(
            surface,
            self.camera,
            self.theme,
            self.scale,
            self._hues,
            frozenset(self.visible),
            self.legend_entries(scene),
        )
        self._update_margins(canvas, scene)
        canvas = replace(canvas, camera=self.camera)
        clip = pygame.Rect([round(side) for side in canvas.camera.view])
        surface.fill(self.theme.background)
        for is_static, group in groupby(self._list_visible(), key=lambda layer: layer.static):
            if is_static:
                page = self._get_static_page(canvas, scene, list(group), clip)
                surface.blit(page, (0, 0), special_flags=pygame.BLEND_PREMULTIPLIED)
                continue
            for layer in group:
                if layer.has(scene):
                    surface.set_clip(clip if layer.in_world else None)
                    layer.draw(canvas, scene)
        surface.set_clip(None)

    def _update_hues(self, scene: Scene) -> None:
        """Choose the hues of the robots. In small teams each robot keeps the hue of its number."""
        numbers = scene.numbers
        if numbers is not None and max(numbers, default=1) <= MAX_OWN_HUES:
            self._hues = np.array(numbers, dtype=np.intp) - 1
        else:
            self._hues = choose_robot_hues(len(scene.team), scene.adjacency, self._hues)

    def _update_margins(self, canvas: Canvas, scene: Scene) -> None:
        """Measure the legend and the color scale; with the same layers and size, margins only grow.

        Otherwise the map would jump whenever the legend changes.
        """
        names = {layer.name for layer in self._list_visible()}
        rows = 0
        if "caption" in names:
            rows = 1
        elif "legend" in names:
            rows = len(annotations.legend_rows(canvas, canvas.legend))
        color_bar_width = heatmaps.bar_room(canvas, scene)
        key = (self.size, self.scale, canvas.visible_layers)
        if key == self._margins.key:
            rows = max(rows, self._margins.legend_rows)
            color_bar_width = max(color_bar_width, self._margins.color_bar_width)
        self._margins = _Margins(key, rows, color_bar_width)

    def frame(self, scene: Scene) -> NDArray[np.uint8]:
        """Draw a scene without a display.

        Parameters
        ----------
        scene : Scene

        Returns
        -------
        (height, width, 3) array of uint8
            RGB values.
        """
        if self._own_surface is None or self._own_surface.get_size() != self.size:
            self._own_surface = pygame.Surface(self.size, 0, 32)
        self.draw(self._own_surface, scene)
        width, height = self.size
        content = pygame.image.tobytes(self._own_surface, "RGB")
        return np.frombuffer(content, dtype=np.uint8).reshape(height, width, 3)

    def _list_visible(self) -> list[Layer]:
        return [layer for layer in self.layers if layer.name in self.visible]

    def _get_static_page(
        self, canvas: Canvas, scene: Scene, layers: list[Layer], clip: pygame.Rect
    ) -> pygame.Surface:
        """Return a page with neighboring static layers, which is drawn again after a change."""
        # The density is not drawn below a distance map.
        has_distances = scene.field is not None and "distances" in canvas.visible_layers
        names = [layer.name for layer in layers]
        key = (names, canvas.camera, self.theme.name, self.scale, self.size, has_distances)

        def draw_page() -> pygame.Surface:
            page = pygame.Surface(self.size, pygame.SRCALPHA, 32)
            page.set_clip(clip)
            for layer in layers:
                if layer.has(scene):
                    layer.draw(replace(canvas, surface=page), scene)
            return page

        return self._static.get(scene.environment, key, draw_page)
