"""The canvas: a painted pane for each controller, one camera for all panes, and overlays of tools."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pygame

from robocov.arrays import Array
from robocov.environment import Environment, Point
from robocov_app.look.colors import mix
from robocov_app.look.hues import choose_robot_hues
from robocov_app.look.theme import Theme
from robocov_app.render.camera import Camera
from robocov_app.render.canvas import Canvas
from robocov_app.render.density_text import format_cost, get_cost_name
from robocov_app.render.distance_map.colors import choose_color_limit
from robocov_app.render.layer_catalog import build_pane_layers, build_standard_layers
from robocov_app.render.layers.layer import Layer
from robocov_app.render.layers.robots import compute_drawn_radii
from robocov_app.render.painter import Painter
from robocov_app.render.scene import Scene
from robocov_app.toolkit.tools.viewport import REACH_PX, zoom_about
from robocov_app.toolkit.window.layout import Layout, is_inside
from robocov_app.viewer.canvas.camera_glide import CameraGlide
from robocov_app.viewer.canvas.layer_bar import BAR_HEIGHT_PX
from robocov_app.viewer.canvas.tool_overlay import (
    FAILED_RADIUS_PX,
    draw_drag,
    draw_failed_selection,
    draw_hovered_robot,
    draw_tool_overlay,
)
from robocov_app.viewer.costs.costs import KnownCost
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.session.document import Node
from robocov_app.viewer.session.pane import Pane
from robocov_app.viewer.session.past.states import PaneSetup
from robocov_app.viewer.view import FADE_S
from robocov_app.viewer.window.status import MIN_UNCOVERED_AREA_M2

MAX_RAYS_PER_SCAN = 120
MAX_RAYS_PER_PANE = 720
MIN_RAYS_PER_SCAN = 24  # with fewer, scans are not drawn
UNLIMITED_SCAN_RANGE_M = 12.0  # length of rays if the sensing range is unlimited
MAX_COST_LAG_S = 0.25  # if the displayed cost is older than this, its caption states its time

MAX_GLIDE_STEP_S = 0.05

# Lengths in pixels at scale 1.
_HIT_MARGIN_PX = 3.0  # around a robot; a click within it selects the robot
_ACTIVE_BAR_PX = 3  # height of the bar at the top of the active pane
_FRAME_STRENGTH = 0.18  # fraction of the color of text in the frames of the panes
_COLOR_LIMIT_MARGIN = 1.1  # so that the color scale does not have to change again soon
_BAR_GAP_PX = 6.0  # between the layer bar and the map
_COLOR_LIMIT_RANGE = (0.55, 1.0)  # the color scale stays while the largest distance is in this fraction of it


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

    Attributes
    ----------
    hovered : HoveredRobot or None
        The robot under the cursor, if there is one.
    is_animated : bool
        Whether the camera may glide; False while the window is unattended.
    layout : Layout
        Layout of the window, from `arrange`.
    """

    layout: Layout

    def __init__(self, viewer: Presenter, theme: Theme) -> None:
        """Build a canvas without painters; `arrange` adds them."""
        self.viewer = viewer
        self.theme = theme
        self.is_animated = False
        self.hovered: HoveredRobot | None = None
        self._painters: list[Painter] = []
        self._scenes: list[Scene] = []
        self._environment: Environment | None = None
        self._root: Node | None = None  # of the run that is shown
        self._camera: Camera | None = None  # None while the whole map is shown
        self._glide: CameraGlide | None = None  # towards `_camera`, while it lasts
        self._color_limit = 1.0  # end of the color scale of distances, m
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
            if self._camera is not None:
                painter.camera = self._camera.with_view(painter.camera.view)
            self._painters.append(painter)

    def fit(self) -> None:
        """Show the whole map at once."""
        self._glide = None
        self._camera = None
        for painter in self._painters:
            painter.fit()

    def show_whole_map(self) -> None:
        """Show the whole map, after a smooth change of the camera."""
        start = self._painters[0].camera
        self.fit()
        self._glide_from(start)

    def zoom(self, factor: float, pixel: tuple[float, float]) -> None:
        """Zoom by a factor about a pixel."""
        pane = self.find_pane(pixel) or 0
        left, top, _, _ = self.layout.panes[pane]
        painter = self._painters[pane]
        start = painter.camera
        # Quick turns of the wheel add up, although the map has not yet followed.
        target = start if self._glide is None else self._glide.end.with_view(start.view)
        map_size = float(np.ptp(self._get_bounds(), axis=0).max())
        self._set_camera(zoom_about(target, factor, (pixel[0] - left, pixel[1] - top), map_size))
        self._glide_from(start)

    def _glide_from(self, start: Camera) -> None:
        """Let the camera glide from `start` to the present one, unless the user prefers no motion."""
        if self.is_animated and self.viewer.view.has_motion:
            self._glide = CameraGlide(start, self._painters[0].camera.with_view(start.view))
            self.update(0.0)

    @property
    def is_moving(self) -> bool:
        """Whether the camera is gliding."""
        return self._glide is not None

    def update(self, seconds: float) -> None:
        """Advance a change of the camera by real time, s."""
        if self._glide is None:
            return
        # After a rest, the time since the previous frame may be longer than the whole change.
        camera = self._glide.advance(min(seconds, MAX_GLIDE_STEP_S))
        if self._glide.is_over:
            self._glide = None
        for painter in self._painters:
            painter.camera = camera.with_view(painter.camera.view)
            if self._glide is None and self._camera is None:
                painter.fit()

    def pan(self, dx: float, dy: float) -> None:
        """Move the map by dx and dy pixels; the center of the view stays within the bounds of the map."""
        camera = self._painters[0].camera.pan(dx, dy)
        x, y = np.clip(camera.center, *self._get_bounds()).tolist()
        self._set_camera(replace(camera, center=(x, y)))

    def _get_bounds(self) -> Array:
        """Return the bounds of the map as rows (x_min, y_min) and (x_max, y_max), (2, 2) m."""
        return np.reshape(self.viewer.session.displayed.environment.region.bounds, (2, 2))

    def _set_camera(self, camera: Camera) -> None:
        self._glide = None
        self._camera = camera
        for painter in self._painters:
            painter.camera = camera.with_view(painter.camera.view)

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

    def find_robot(self, pixel: tuple[float, float], pane: int) -> int | None:
        """Return the number of the working or failed robot at a pixel of a pane; None if there is none."""
        if pane >= len(self._scenes):
            return None
        scene = self._scenes[pane]
        point = np.array(self.to_world(pixel, pane))
        # Nothing is drawn: this canvas only provides the radii at which robots are drawn.
        canvas = self._build_canvas(pygame.Surface((1, 1)), pane, scene)
        distances = np.hypot(*(scene.now.positions - point).T) * canvas.camera.zoom
        radii = np.array(compute_drawn_radii(canvas, scene)) + _HIT_MARGIN_PX * self.layout.scale
        rows = np.flatnonzero(distances <= radii).tolist()
        hits = [(float(distances[row]), scene.get_number(row)) for row in rows]
        for number, position in scene.failed.items():
            distance = float(np.hypot(*(np.array(position) - point))) * canvas.camera.zoom
            if distance <= FAILED_RADIUS_PX * self.layout.scale:
                hits.append((distance, number))
        if hits:
            return min(hits, key=lambda hit: hit[0])[1]
        return None

    def draw(self, screen: pygame.Surface) -> None:
        """Draw all panes."""
        session = self.viewer.session
        self._adopt_environment()
        self._scenes = []
        panes = session.timeline.panes
        # A pane that was just added has no painter and no box in the layout yet.
        for pane, painter, box in zip(panes, self._painters, self.layout.panes, strict=False):
            # The caption of a pane is always visible.
            fixed_layers = {"caption"} & {layer.name for layer in painter.layers}
            painter.visible = self.viewer.view.layers | fixed_layers
            painter.top_strip = 0.0
            if len(panes) == 1 and "legend" in self.viewer.view.layers:
                painter.top_strip = BAR_HEIGHT_PX + _BAR_GAP_PX
            scene = self._build_scene(pane, painter)
            surface = screen.subsurface(pygame.Rect(box))
            painter.draw(surface, scene)
            self._draw_overlay(surface, len(self._scenes), scene)
            self._scenes.append(scene)
        if len(self._scenes) > 1:
            self._draw_frames(screen)

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
            self.fit()
        return environment

    def _build_scene(self, pane: Pane, painter: Painter) -> Scene:
        """Build the scene of a pane at the displayed step, with those costs and scans that are visible."""
        viewer = self.viewer
        displayed = viewer.session.displayed
        setup = displayed.get_setup(pane)
        snapshot = displayed.get_snapshot(pane)
        known = viewer.costs.known.get(pane.number)
        selected = viewer.selected_robot
        row = setup.numbers.index(selected) if selected in setup.numbers else None
        if known is not None and painter.needs_field:
            self._update_color_limit(known.field.max_distance)
        return pane.build_scene(
            setup,
            snapshot,
            displayed.get_trail(pane),
            trail_fade=FADE_S if viewer.view.fades_trajectories else None,
            field=known.field if known is not None and painter.needs_field else None,
            field_limit=self._color_limit,
            cost=self._describe_cost(pane),
            selected=row,
            scans=self._list_scans(pane, setup, snapshot.positions, row),
            sensed=pane.sensed,
            path=self._get_path(known),
        )

    def _update_color_limit(self, largest: float) -> None:
        """Adapt the color scale to the largest distance, m, but only when it has changed considerably."""
        low, high = _COLOR_LIMIT_RANGE
        if np.isfinite(largest) and not low * self._color_limit <= largest <= high * self._color_limit:
            self._color_limit = choose_color_limit(_COLOR_LIMIT_MARGIN * largest)

    def _get_path(self, known: KnownCost | None) -> Array | None:
        """Return the path from the cursor to its nearest robot, (k, 2) m; None if it is not shown."""
        if known is None or self.viewer.inspection.cursor is None:
            return None
        return known.path

    def _list_scans(
        self, pane: Pane, setup: PaneSetup, positions: Array, selected: int | None
    ) -> list[tuple[Array, Array]]:
        """Return the scan of the selected robot or, if none is selected, the scans of all robots.

        Nothing is returned for teams so large that each scan would have too few rays.

        Returns
        -------
        list of tuple of array
            For each scan, the position of the robot, (2,) m, and the end points of its rays, (k, 2) m.
        """
        if "scan" not in self.viewer.view.layers:
            return []
        rows = range(len(setup.numbers)) if selected is None else range(selected, selected + 1)
        rays = min(MAX_RAYS_PER_SCAN, MAX_RAYS_PER_PANE // len(rows))
        if rays < MIN_RAYS_PER_SCAN:
            return []
        ranges = setup.team.sensing_range
        reach = np.where(np.isfinite(ranges), ranges, UNLIMITED_SCAN_RANGE_M).tolist()
        sensor = pane.simulation.sensor
        return [(positions[row], sensor.scan_from(positions[row], rays, reach[row])[1]) for row in rows]

    def _describe_cost(self, pane: Pane) -> str:
        """Return the caption with a pane's cost. All panes show their cost at the same time."""
        displayed = self.viewer.session.displayed
        time, distances = displayed.get_costs()
        _, travel_times = displayed.get_costs("time")
        if pane.number not in distances:
            return ""
        name = get_cost_name(displayed.get_setup(pane).environment)
        text = format_cost(name, distances[pane.number], travel_times.get(pane.number))
        known = self.viewer.costs.known.get(pane.number)
        if known is not None and known.result.uncovered_area > MIN_UNCOVERED_AREA_M2:
            # The mean only covers the reachable area, so it decreases when robots are locked out of a room.
            text += f" ({known.result.uncovered_area:.1f} m² cut off)"
        if displayed.time - time > MAX_COST_LAG_S:
            return f"{text} at {time:.1f} s"
        return text

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

    @property
    def layers(self) -> list[Layer]:
        """All layers that can be shown or hidden."""
        return self._layers

    @property
    def scenes(self) -> list[Scene]:
        """Scene of each pane that was drawn last."""
        return self._scenes
