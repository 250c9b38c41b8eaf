"""The painter: draws the layers of a scene on a pygame surface, with or without a display."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import NamedTuple

import numpy as np
import pygame
from numpy.typing import NDArray

from robocov.environment import Environment
from robocov.errors import ParameterError, describe_unknown_name
from robocov_app.look.hues import MAX_OWN_HUES, choose_robot_hues
from robocov_app.look.theme import LIGHT, Theme
from robocov_app.render.annotations.color_bar import measure_color_bar
from robocov_app.render.annotations.legend_strip import (
    MARGIN_PX,
    PADDING_PX,
    ROW_HEIGHT_PX,
    arrange_legend_rows,
)
from robocov_app.render.annotations.scale_bar import STRIP_HEIGHT_PX, is_low_pane
from robocov_app.render.camera import Camera
from robocov_app.render.canvas import Canvas, LegendEntry
from robocov_app.render.layer_catalog import FIELD_LAYERS, build_standard_layers
from robocov_app.render.layers.layer import Layer
from robocov_app.render.scene import Scene
from robocov_app.render.surface_cache import LatestValue

_UNIT_WIDTH_PX = 1024
_UNIT_HEIGHT_PX = 576
_REGION_MARGIN_PX = 2
"""Space around the region when the camera shows all of it, at scale 1."""
_SCALE_STEP = 0.125
_MIN_SCALE = 0.875
_MAX_SCALE = 6.0


def choose_scale(size: tuple[int, int]) -> float:
    """Return the scale of text and lines for a picture size, px, in steps of 1/8: 1.25 for 1280 x 720."""
    width, height = size
    exact = min(width / _UNIT_WIDTH_PX, height / _UNIT_HEIGHT_PX)
    rounded = round(exact / _SCALE_STEP) * _SCALE_STEP
    return min(max(rounded, _MIN_SCALE), _MAX_SCALE)


@dataclass(frozen=True)
class _View:
    """Everything on which the space for the legend and the color scale depends, apart from the scene."""

    size: tuple[int, int]
    """px"""
    scale: float
    visible_layers: frozenset[str]


class _Margins(NamedTuple):
    """Space that the legend and the color scale have needed so far."""

    view: _View | None
    """View for which the space was measured; None before the first frame."""
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
        From the lowest to the topmost; by default those of `build_standard_layers`.
    scale : float, optional
        Scale of text and lines; by default `choose_scale` of the size.

    Attributes
    ----------
    visible : set of str
        Names of the layers that are drawn.
    top_strip : float
        Height of the strip that the world leaves free above, px at scale 1, for a legend of the caller.
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
        if layers is None:
            layers = build_standard_layers()
        if scale is None:
            scale = choose_scale(size)
        self.layers = list(layers)
        self.scale = scale
        self.visible = {layer.name for layer in self.layers if layer.is_default}
        self.top_strip = 0.0
        self._camera: Camera | None = None  # None shows the whole region.
        self._hues = choose_robot_hues(0)
        self._static = LatestValue[pygame.Surface]()
        self._own_surface: pygame.Surface | None = None
        self._margins = _Margins(None, 0, 0.0)

    def show_only(self, names: Iterable[str]) -> None:
        """Show only the given layers; raise ParameterError if one is unknown."""
        visible = set(names)
        known = {layer.name for layer in self.layers}
        unknown = visible - known
        if unknown:
            raise ParameterError(describe_unknown_name("layer", min(unknown), known))
        self.visible = visible

    def change_visible(self, shown: Iterable[str], hidden: Iterable[str]) -> None:
        """Show some layers in addition, and hide others; unknown names are ignored."""
        known = {layer.name for layer in self.layers}
        self.visible = (self.visible | set(shown) & known) - set(hidden)

    @property
    def needs_field(self) -> bool:
        """Whether a visible layer needs the distances to the nearest robot."""
        return not FIELD_LAYERS.isdisjoint(self.visible)

    @property
    def camera(self) -> Camera:
        """The camera; set it to zoom and pan. By default, it shows the whole region.

        Its view is the picture without the strips above and below it, and without the color scale.
        """
        view = self._compute_view()
        if self._camera is not None:
            return self._camera.with_view(view)
        left, top, width, height = view
        margin = MARGIN_PX * self.scale
        # The color scale takes the place of the right margin.
        margin_count = 1 if self._margins.color_bar_width else 2
        inner_width = max(width - margin_count * margin, 1.0)
        inner_view = (left + margin, top, inner_width, height)
        fitted = Camera.fit(self.environment.region.bounds, inner_view, margin=_REGION_MARGIN_PX * self.scale)
        return fitted.with_view(view)

    @camera.setter
    def camera(self, camera: Camera) -> None:
        self._camera = camera

    def _compute_view(self) -> tuple[float, float, float, float]:
        """Return left, top, width and height of the area in which the world is drawn, px."""
        width, height = self.size
        rows = self._margins.legend_rows
        top = MARGIN_PX
        if rows:
            top = PADDING_PX + ROW_HEIGHT_PX * rows + PADDING_PX
        top = max(top, self.top_strip)
        bottom = MARGIN_PX
        has_strip = bool({"scale_bar", "status"} & self.visible)
        if has_strip and not is_low_pane(height, self.scale, self.visible):
            bottom = STRIP_HEIGHT_PX
        view_width = max(width - self._margins.color_bar_width, 1.0)
        view_height = max(height - top * self.scale - bottom * self.scale, 1.0)
        return 0.0, top * self.scale, view_width, view_height

    def fit(self) -> None:
        """Show the whole region, also after the size of the picture changes."""
        self._camera = None

    def list_legend_entries(self, scene: Scene) -> list[LegendEntry]:
        """Return the legend entries of all visible layers that have something to draw in a scene."""
        entries = []
        for layer in self._list_visible():
            if layer.can_draw(scene):
                entries += layer.legend(scene)
        return entries

    def draw(self, surface: pygame.Surface, scene: Scene) -> None:
        """Draw a scene on a surface, which it fills.

        Adjacent static layers are drawn together on a page, which is kept until it changes.

        Parameters
        ----------
        surface : pygame.Surface
            The painter takes over its size.
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
            self.list_legend_entries(scene),
        )
        # The margins need a canvas to measure texts, and the camera depends on the margins.
        self._update_margins(canvas, scene)
        canvas = replace(canvas, camera=self.camera)
        clip = pygame.Rect([round(side) for side in canvas.camera.view])
        surface.fill(self.theme.background)
        for is_static, group in groupby(self._list_visible(), key=lambda layer: layer.is_static):
            if is_static:
                page = self._get_static_page(canvas, scene, list(group), clip)
                surface.blit(page, (0, 0), special_flags=pygame.BLEND_PREMULTIPLIED)
                continue
            for layer in group:
                if layer.can_draw(scene):
                    surface.set_clip(clip if layer.is_in_world else None)
                    layer.draw(canvas, scene)
        surface.set_clip(None)

    def _update_hues(self, scene: Scene) -> None:
        """Choose the hues of the robots.

        In small teams each number has its own hue. In large teams, adjacent cells have different hues, which
        change as little as possible.
        """
        numbers = scene.numbers
        if numbers is not None and max(numbers, default=1) <= MAX_OWN_HUES:
            self._hues = np.array(numbers, dtype=np.intp) - 1
        else:
            self._hues = choose_robot_hues(len(scene.team), scene.adjacency, self._hues)

    def _update_margins(self, canvas: Canvas, scene: Scene) -> None:
        """Measure the legend and the color scale.

        While the layers and the size stay the same, margins only grow, so that the map does not jump whenever
        the legend changes.
        """
        names = {layer.name for layer in self._list_visible()}
        rows = 0
        if "caption" in names:
            rows = 1
        elif "legend" in names:
            rows = len(arrange_legend_rows(canvas, canvas.legend))
        color_bar_width = measure_color_bar(canvas, scene)
        view = _View(self.size, self.scale, canvas.visible_layers)
        if view == self._margins.view:
            rows = max(rows, self._margins.legend_rows)
            color_bar_width = max(color_bar_width, self._margins.color_bar_width)
        self._margins = _Margins(view, rows, color_bar_width)

    def render_frame(self, scene: Scene) -> NDArray[np.uint8]:
        """Render a scene as an array, without a display.

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
        """Return a page with adjacent static layers, which is drawn again only if something has changed."""
        # The density, a static layer, is hidden below a distance map.
        has_distances = scene.field is not None and "distances" in canvas.visible_layers
        names = [layer.name for layer in layers]
        key = (names, canvas.camera, self.theme.name, self.scale, self.size, has_distances)

        def draw_page() -> pygame.Surface:
            page = pygame.Surface(self.size, pygame.SRCALPHA, 32)
            page.set_clip(clip)
            for layer in layers:
                if layer.can_draw(scene):
                    layer.draw(replace(canvas, surface=page), scene)
            return page

        return self._static.get_or_compute(scene.environment, key, draw_page)
