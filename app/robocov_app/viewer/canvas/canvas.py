"""The canvas: a painted pane for each controller, one camera for all panes, and overlays of tools."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pygame

from robocov.environment import Environment, Point
from robocov_app.look.colors import mix
from robocov_app.look.hues import choose_robot_hues
from robocov_app.look.theme import Theme
from robocov_app.render.annotations.captions import measure_status
from robocov_app.render.annotations.scale_bar import (
    find_strip,
    is_low_pane,
    measure_bar,
    place_left,
    place_right,
)
from robocov_app.render.canvas import Canvas
from robocov_app.render.crowding import measure_spacing
from robocov_app.render.layer_catalog import build_pane_layers, build_standard_layers
from robocov_app.render.layers.layer import Layer
from robocov_app.render.layers.robots import compute_drawn_radii
from robocov_app.render.painter import Painter
from robocov_app.render.scene import Scene
from robocov_app.toolkit.tools.viewport import REACH_PX
from robocov_app.toolkit.window.layout import Layout, is_inside
from robocov_app.viewer.canvas.layer_bar import BAR_HEIGHT_PX
from robocov_app.viewer.canvas.scene_builder import SceneBuilder
from robocov_app.viewer.canvas.shared_camera import SharedCamera
from robocov_app.viewer.canvas.tool_overlay import (
    FAILED_RADIUS_PX,
    draw_drag,
    draw_failed_selection,
    draw_hovered_robot,
    draw_tool_overlay,
)
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.session.document import Node

# Lengths in pixels at scale 1.
_HIT_MARGIN_PX = 3.0  # around a robot; a click within it selects the robot
_FINGER_MARGIN_PX = 12.0  # the same on a phone
_MIN_HIT_RADIUS_PX = 12.0  # around a small robot; a click within it selects the robot
FINGER_RADIUS_PX = 24.0
"""The same on a phone: the distance from the center of a robot within which a finger reaches it."""
_ACTIVE_BAR_PX = 3  # height of the bar at the top of the active pane
_FRAME_STRENGTH = 0.18  # fraction of the color of text in the frames of the panes
_BAR_GAP_PX = 6.0  # between the layer bar and the map


class HoveredRobot(NamedTuple):
    """The robot under the cursor.

    Attributes
    ----------
    pane : int
        Index of the pane that shows it.
    number : int
        Number of the robot.
    """

    pane: int
    number: int


class ViewerCanvas:
    """Draws the panes of a session, and converts between pixels, map points and robots.

    Parameters
    ----------
    viewer : Presenter
        The viewer.
    theme : Theme
        Colors.
    has_controls : bool
        Whether the window draws its layer bar over the canvas, and its status line below.

    Attributes
    ----------
    hovered : HoveredRobot or None
        The robot under the cursor, if there is one.
    camera : SharedCamera
        Camera of all panes.
    layout : Layout
        Layout of the window, from `arrange`.
    finger_reach : float, m
        Distance from the center of a robot within which a press selects it, at least; for a phone that shows
        the map of a large window in its own size.
    """

    layout: Layout

    def __init__(self, viewer: Presenter, theme: Theme, *, has_controls: bool = True) -> None:
        """Build a canvas without painters; `arrange` adds them."""
        self.viewer = viewer
        self._has_controls = has_controls
        self.theme = theme
        self.camera = SharedCamera(viewer)
        self.hovered: HoveredRobot | None = None
        self.finger_reach = 0.0
        self._painters: list[Painter] = []
        self._scenes: list[Scene] = []
        self._environment: Environment | None = None
        self._root: Node | None = None  # root of the displayed run
        self._scene_builder = SceneBuilder(viewer)
        self._layers = build_standard_layers()

    def arrange(self, layout: Layout, theme: Theme) -> None:
        """Build the painters of the panes for a layout of the window."""
        self.layout = layout
        self.theme = theme
        environment = self._adopt_environment()
        self._painters = []
        for _, _, width, height in layout.panes:
            # The layer bar of the window is the legend.
            layers = [layer for layer in build_standard_layers() if layer.name != "legend"]
            if len(layout.panes) > 1:
                # All panes show the same time, which is in the status line of the window.
                layers = [layer for layer in build_pane_layers() if layer.name != "status"]
            painter = Painter(environment, (width, height), theme, layers, layout.scale)
            self._painters.append(painter)
        self.camera.attach(self._painters)

    def zoom(self, factor: float, pixel: tuple[float, float]) -> None:
        """Zoom by a factor about a pixel."""
        pane = self.find_pane(pixel) or 0
        left, top, _, _ = self.layout.panes[pane]
        self.camera.zoom(factor, pane, (pixel[0] - left, pixel[1] - top))

    def follow_robot(self) -> None:
        """Center the view on the robot that the camera follows; stop following it if it is not displayed."""
        viewer = self.viewer
        number = viewer.inspection.followed
        displayed = viewer.session.displayed
        numbers = displayed.numbers
        if number is None or number not in numbers:
            viewer.inspection.followed = None
            return
        x, y = displayed.get_positions(viewer.pane)[numbers.index(number)].tolist()
        self.camera.center_on((x, y))

    def find_pane(self, pixel: tuple[float, float]) -> int | None:
        """Return the index of the pane at a pixel; None if there is none."""
        for pane, box in enumerate(self.layout.panes):
            if is_inside(box, pixel):
                return pane
        return None

    def to_world(self, pixel: tuple[float, float], pane: int) -> Point:
        """Return the point of the map, m, at a pixel of the window, as shown by a pane."""
        offset = np.subtract(pixel, self.layout.panes[pane].position)
        x, y = self._painters[pane].camera.to_world(offset).tolist()
        return x, y

    def to_pixel(self, point: Point, pane: int = 0) -> tuple[float, float]:
        """Return the pixel of the window at which a pane shows a point of the map, m."""
        left, top, _, _ = self.layout.panes[pane]
        x, y = self._painters[pane].camera.to_pixels(np.array(point)).tolist()
        return x + left, y + top

    def get_reach(self, pane: int) -> float:
        """Return the reach of the pointer (see `REACH_PX`) on the map of a pane, m."""
        return REACH_PX * self.layout.scale / self._painters[pane].camera.zoom

    def get_zoom(self) -> float:
        """Return the number of pixels per meter, which is the same in all panes."""
        return self._painters[0].camera.zoom

    def find_robot(self, pixel: tuple[float, float], pane: int) -> int | None:
        """Return the number of the working or failed robot at a pixel of a pane; None if there is none."""
        if pane >= len(self._scenes):
            return None
        scene = self._scenes[pane]
        point = np.array(self.to_world(pixel, pane))
        # Nothing is drawn: this canvas only provides the radii at which robots are drawn.
        canvas = self._build_canvas(pygame.Surface((1, 1)), pane, scene)
        distances = np.hypot(*(scene.now.positions - point).T) * canvas.camera.zoom
        margin_px = _FINGER_MARGIN_PX if self.layout.is_compact else _HIT_MARGIN_PX
        min_radius_px = FINGER_RADIUS_PX if self.layout.is_compact else _MIN_HIT_RADIUS_PX
        min_radius = max(min_radius_px * self.layout.scale, self.finger_reach * canvas.camera.zoom)
        radii = np.array(compute_drawn_radii(canvas, scene)) + margin_px * self.layout.scale
        radii = np.maximum(radii, min_radius)
        rows = np.flatnonzero(distances <= radii).tolist()
        hits = [(float(distances[row]), scene.get_number(row)) for row in rows]
        for number, position in scene.failed.items():
            distance = float(np.hypot(*(np.array(position) - point))) * canvas.camera.zoom
            # `FAILED_RADIUS_PX` includes the margin for the mouse.
            failed_radius_px = FAILED_RADIUS_PX + margin_px - _HIT_MARGIN_PX
            if distance <= max(failed_radius_px * self.layout.scale, min_radius):
                hits.append((distance, number))
        if hits:
            return min(hits, key=lambda hit: hit[0])[1]
        return None

    def draw(self, screen: pygame.Surface) -> None:
        """Draw all panes."""
        session = self.viewer.session
        self._adopt_environment()
        panes = session.timeline.panes
        scenes = []
        # A pane that was just added has no painter and no box in the layout yet.
        for pane, painter in zip(panes, self._painters, strict=False):
            self._choose_visible_layers(painter, pane_count=len(panes))
            scenes.append(self._scene_builder.build(pane, painter))
        self._scenes = _share_spacing(scenes)
        shown = zip(self._scenes, self._painters, self.layout.panes, strict=False)
        for index, (scene, painter, box) in enumerate(shown):
            surface = screen.subsurface(pygame.Rect(box))
            painter.draw(surface, scene)
            self._draw_overlay(surface, index, scene)
        if len(self._scenes) > 1:
            self._draw_frames(screen)

    def _choose_visible_layers(self, painter: Painter, *, pane_count: int) -> None:
        """Set the visible layers of a pane's painter, and the strip above the map for the layer bar."""
        # The caption of a pane is always visible.
        fixed_layers = {"caption"}
        if not self._has_controls:
            fixed_layers.add("status")
        fixed_layers &= {layer.name for layer in painter.layers}
        painter.visible = self.viewer.view.layers | fixed_layers
        painter.top_strip = 0.0
        has_layer_bar = self._has_controls and "legend" in self.viewer.view.layers
        if pane_count == 1 and has_layer_bar:
            painter.top_strip = BAR_HEIGHT_PX + _BAR_GAP_PX

    def _adopt_environment(self) -> Environment:
        """Pass the displayed map to the painters; show all of it if it is a different map or has grown.

        Returns
        -------
        Environment
            The displayed map.
        """
        environment = self.viewer.session.displayed.environment
        timeline = self.viewer.session.timeline
        root = timeline.document.get_path(timeline.head)[0]
        is_other_run = root is not self._root
        before = self._environment
        self._root = root
        self._environment = environment
        if before is None or before is environment:
            return environment
        for painter in self._painters:
            painter.environment = environment
        is_other_map = is_other_run and not environment.has_same_geometry(before)
        if is_other_map or before.region.bounds != environment.region.bounds:
            self.camera.fit()
        return environment

    def _build_canvas(self, surface: pygame.Surface, pane: int, scene: Scene) -> Canvas:
        hues = choose_robot_hues(len(scene.team))
        return Canvas(surface, self._painters[pane].camera, self.theme, self.layout.scale, hues)

    def _draw_overlay(self, surface: pygame.Surface, pane: int, scene: Scene) -> None:
        """Draw drags, highlights and previews on top of a pane."""
        canvas = self._build_canvas(surface, pane, scene)
        surface.set_clip(pygame.Rect([round(x) for x in canvas.camera.view]))
        session = self.viewer.session
        draw_drag(canvas, scene, session.timeline.run.drag)
        draw_failed_selection(canvas, scene, self.viewer.selected_robot)
        if self.hovered is not None and self.hovered.pane == pane:
            draw_hovered_robot(canvas, scene, self.hovered.number)
        draw_tool_overlay(canvas, self.viewer.tool.build_overlay(session))
        surface.set_clip(None)

    def _draw_frames(self, screen: pygame.Surface) -> None:
        """Draw a frame around each pane, and a bar in its controller's color at the top of the active one."""
        theme = self.theme
        for pane, box in enumerate(self.layout.panes):
            rect = pygame.Rect(box)
            pygame.draw.rect(screen, mix(theme.background, theme.ink, _FRAME_STRENGTH), rect.inflate(2, 2), 2)
            if pane == self.viewer.active_pane:
                bar_height = max(2, round(_ACTIVE_BAR_PX * self.layout.scale))
                bar = pygame.Rect(rect.topleft, (rect.width, bar_height))
                controller = self.viewer.session.timeline.panes[pane].controller
                screen.fill(theme.get_controller_color(controller.name), bar)

    def find_strip_texts(self, screen: pygame.Surface) -> list[pygame.Rect]:
        """Return the boxes of the scale bars and of the status line below the maps, px of the screen."""
        boxes: list[pygame.Rect] = []
        shown = zip(self._scenes, self._painters, self.layout.panes, strict=False)
        for index, (scene, painter, pane) in enumerate(shown):
            scale = painter.scale
            names = painter.visible & {layer.name for layer in painter.layers}
            if is_low_pane(pane.height, scale, names):
                continue
            canvas = self._build_canvas(screen.subsurface(pygame.Rect(pane)), index, scene)
            strip = find_strip(pygame.Rect(pane), scale)
            if "scale_bar" in names:
                boxes.append(place_left(strip, measure_bar(canvas), scale))
            if "status" in names:
                boxes.append(place_right(strip, measure_status(canvas, scene), scale))
        return boxes

    @property
    def layers(self) -> list[Layer]:
        """All layers that can be shown or hidden."""
        return self._layers

    @property
    def scenes(self) -> list[Scene]:
        """The scene drawn last in each pane."""
        return self._scenes


def _share_spacing(scenes: list[Scene]) -> list[Scene]:
    """Return scenes whose robots have discs of the same size, which suits the one with the least space."""
    if len(scenes) < 2:
        return scenes
    spacing = min(measure_spacing(scene.now.positions) for scene in scenes)
    return [replace(scene, spacing=spacing) for scene in scenes]
