"""The canvas: one painted pane for each controller, one camera for all, and what tools show on top."""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pygame

from robocov.arrays import Array
from robocov.environment import Environment, Point
from robocov_app.look.colors import mix
from robocov_app.look.legend import merge_legends
from robocov_app.look.robot_colors import choose_robot_hues
from robocov_app.look.theme import Theme
from robocov_app.render import sprites
from robocov_app.render.annotations import legend_rows, legend_strip
from robocov_app.render.camera import Camera
from robocov_app.render.canvas import Canvas, LegendEntry
from robocov_app.render.density import cost_label, mean_label
from robocov_app.render.distance_field import round_limit
from robocov_app.render.marks import drawn_radii
from robocov_app.render.picture import Painter, pane_layers, standard_layers
from robocov_app.render.scene import Scene
from robocov_app.toolkit.layout import Layout, inside
from robocov_app.toolkit.overlay import tag
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.session.pane import Pane
from robocov_app.viewer.tools.tool import Preview
from robocov_app.viewer.view import FADE_S

RAYS, MOST_RAYS = 120, 720  # of one scan, of all scans of a pane together
FAR_SCAN = 12.0  # meters that scans reach where the sensor has no limit
_OLD = 0.25  # seconds from which on a cost that lags behind is shown with its time
_REACH = 12.0  # pixels at scale 1 that a finger is wide


class ViewerCanvas:
    """Draws the panes of a session, and finds what is under the cursor."""

    def __init__(self, viewer: Presenter, theme: Theme) -> None:
        self.viewer, self.theme = viewer, theme
        self._painters: list[Painter] = []
        self._scenes: list[Scene] = []
        self._limit = 1.0
        self._environment: Environment | None = None
        self._strip: tuple[object, pygame.Surface] | None = None
        self._camera: Camera | None = None
        self._rows: tuple[object, int] = (None, 1)
        self.hovered = -1, -1  # pane and number of the robot under the cursor

    def arrange(self, layout: Layout, theme: Theme) -> None:
        self.layout, self.theme = layout, theme
        self._environment, self._painters = self.viewer.session.displayed.environment, []
        for _, _, width, height in layout.panes:
            layers = standard_layers()
            if len(layout.panes) > 1:  # they share the time, which stands in the window's own status line
                layers = [layer for layer in pane_layers() if layer.name != "status"]
            painter = Painter(self._environment, (width, height), theme, layers, layout.scale)
            if self._camera is not None:
                painter.camera = self._camera.with_view(painter.camera.view)
            self._painters.append(painter)
        self._strip = None

    def fit(self) -> None:
        self._camera = None
        for painter in self._painters:
            painter.fit()

    def zoom(self, factor: float, at: tuple[float, float]) -> None:
        pane = self.pane_at(at) or 0
        (left, top, _, _), camera = self.layout.panes[pane], self._painters[pane].camera
        whole = np.ptp(
            np.reshape(self.viewer.session.displayed.environment.region.bounds, (2, 2)), axis=0
        ).max()
        # neither a dot nor a single wall's paint
        factor = float(np.clip(camera.zoom * factor, 20.0 / whole, 2e4)) / camera.zoom
        self._look(camera.zoom_at(factor, (at[0] - left, at[1] - top)))

    def pan(self, dx: float, dy: float) -> None:
        camera = self._painters[0].camera.pan(dx, dy)
        bounds = np.reshape(self.viewer.session.displayed.environment.region.bounds, (2, 2))
        x, y = np.clip(camera.center, *bounds).tolist()
        self._look(replace(camera, center=(x, y)))

    def _look(self, camera: Camera) -> None:
        self._camera = camera
        for painter in self._painters:
            painter.camera = camera.with_view(painter.camera.view)

    def pane_at(self, pixel: tuple[float, float]) -> int | None:
        return next((pane for pane, box in enumerate(self.layout.panes) if inside(box, pixel)), None)

    def to_world(self, pixel: tuple[float, float], pane: int) -> Point:
        x, y = self._painters[pane].camera.to_world(np.subtract(pixel, self.layout.panes[pane][:2])).tolist()
        return x, y

    def to_pixel(self, point: Point, pane: int = 0) -> tuple[float, float]:
        left, top, _, _ = self.layout.panes[pane]
        x, y = self._painters[pane].camera.to_pixels(np.array(point)).tolist()
        return x + left, y + top

    def reach(self, pane: int) -> float:
        return _REACH * self.layout.scale / self._painters[pane].camera.zoom

    def robot_at(self, pixel: tuple[float, float], pane: int) -> int | None:
        if pane >= len(self._scenes):
            return None
        scene, point = self._scenes[pane], np.array(self.to_world(pixel, pane))
        canvas = self._canvas(pygame.Surface((1, 1)), pane, scene)
        far = np.hypot(*(scene.now.positions - point).T) * canvas.camera.zoom
        radii = np.array(drawn_radii(canvas, scene)) + 3.0 * self.layout.scale
        near = [(float(far[row]), scene.number(row)) for row in np.flatnonzero(far <= radii).tolist()]
        for number, place in scene.failed.items():
            away = float(np.hypot(*(np.array(place) - point))) * canvas.camera.zoom
            if away <= 9.0 * self.layout.scale:
                near.append((away, number))
        return min(near, key=lambda each: each[0])[1] if near else None

    def draw(self, screen: pygame.Surface) -> None:
        session = self.viewer.session
        if session.displayed.environment is not self._environment:
            before, self._environment = self._environment, session.displayed.environment
            for painter in self._painters:
                painter.environment = session.displayed.environment
            if before is not None and before.region.bounds != session.displayed.environment.region.bounds:
                self.fit()
        self._scenes = []
        for pane, painter, box in zip(
            session.timeline.panes, self._painters, self.layout.panes, strict=False
        ):
            painter.visible = self.viewer.view.layers | (
                {"caption"} & {layer.name for layer in painter.layers}
            )
            scene, surface = self._scene(pane, painter), screen.subsurface(pygame.Rect(box))
            painter.draw(surface, scene)
            self._draw_tool(surface, len(self._scenes), scene)
            self._scenes.append(scene)
        self._draw_frames(screen)

    def _scene(self, pane: Pane, painter: Painter) -> Scene:
        viewer, session = self.viewer, self.viewer.session
        setup, snapshot = session.displayed.get_setup(pane), session.displayed.get_snapshot(pane)
        known, field = viewer.costs.known.get(pane.number), None
        if known is not None and painter.needs_field:
            field, largest = known.field, known.field.largest
            # the scale of colors follows what is shown, without trembling
            if np.isfinite(largest) and not 0.55 * self._limit <= largest <= self._limit:
                self._limit = round_limit(1.1 * largest)
        numbers, scans = setup.numbers, list[tuple[Array, Array]]()
        selected = numbers.index(viewer.selected_robot) if viewer.selected_robot in numbers else None
        if "scan" in viewer.view.layers:  # of the robot that is asked about, else of all unless they are many
            rows = range(len(numbers)) if selected is None else [selected]
            ranges, places = setup.team.sensing_range, snapshot.positions
            rays = min(RAYS, MOST_RAYS // len(rows))
            reach = np.where(np.isfinite(ranges), ranges, FAR_SCAN).tolist()
            for row in rows if rays >= 24 else ():
                scans.append(
                    (places[row], pane.simulation.sensor.scan_from(places[row], rays, reach[row])[1])
                )
        path = known.path if known is not None and viewer.inspection.cursor is not None else None
        look: dict[str, Any] = {"field": field, "field_limit": self._limit, "cost": self._caption_cost(pane)}
        look |= {"selected": selected, "scans": scans, "sensed": pane.sensed, "path": path}
        fade = FADE_S if viewer.view.fades_trajectories else None
        return pane.build_scene(setup, snapshot, session.displayed.get_trail(pane), trail_fade=fade, **look)

    def _caption_cost(self, pane: Pane) -> str:
        session = self.viewer.session
        (time, distances), (_, times) = session.displayed.get_costs(), session.displayed.get_costs("time")
        if pane.number not in distances:
            return ""
        what = mean_label(session.displayed.get_setup(pane).environment)
        words = cost_label(what, distances[pane.number], times.get(pane.number))
        return f"{words} at {time:.1f} s" if session.displayed.time - time > _OLD else words

    def _canvas(self, surface: pygame.Surface, pane: int, scene: Scene) -> Canvas:
        camera, hues = self._painters[pane].camera, choose_robot_hues(len(scene.team))
        return Canvas(surface, camera, self.theme, self.layout.scale, hues)

    def _draw_tool(self, surface: pygame.Surface, pane: int, scene: Scene) -> None:
        canvas, ink = self._canvas(surface, pane, scene), self.theme.ink
        surface.set_clip(pygame.Rect([round(x) for x in canvas.camera.view]))
        numbers, positions = list(scene.numbers or ()), scene.now.positions
        if (hand := self.viewer.session.timeline.drag) is not None and hand[0] in numbers:
            place, target = positions[numbers.index(hand[0])], hand[1]
            begin, end = canvas.camera.to_pixels(np.array([place, target])).tolist()
            canvas.dashes(begin, end, ink, canvas.width(1.5), dash=3.0)
        asked = self.viewer.selected_robot
        if asked is not None and asked in scene.failed:
            radius = max(scene.failed_radius(asked) * canvas.camera.zoom, 9.0 * canvas.scale)
            ring = partial(sprites.ring, round(radius) + 4.0 * canvas.scale, ink, 2.2 * canvas.scale)
            canvas.stamp(ring, canvas.camera.to_pixels(np.array(scene.failed[asked])).tolist())
        if pane == self.hovered[0] and self.hovered[1] in numbers:  # it can be taken hold of
            row = numbers.index(self.hovered[1])
            if row != scene.selected:
                radius = drawn_radii(canvas, scene)[row] + 3.5 * canvas.scale
                center = canvas.camera.to_pixels(positions[row]).tolist()
                canvas.stamp(partial(sprites.ring, radius, ink, 1.2 * canvas.scale), center)
        if (preview := self.viewer.tool.build_preview(self.viewer.session)) is not None:
            self._draw_preview(canvas, preview)
        surface.set_clip(None)

    def _draw_preview(self, canvas: Canvas, preview: Preview) -> None:
        accent, surface = self.theme.final, canvas.surface
        if preview.obstacle is not None:
            shape = preview.obstacle.polygon
            for part in getattr(shape, "geoms", [shape]):
                corners = canvas.camera.to_pixels(np.asarray(part.exterior.coords)[:-1])
                page = pygame.Surface(surface.get_size(), pygame.SRCALPHA, 32)
                rim = np.rint(np.clip(corners, -1e4, 1e4)).tolist()
                pygame.draw.polygon(page, (*(round(c * 0.35) for c in self.theme.obstacle), 89), rim)
                surface.blit(page, (0, 0), special_flags=pygame.BLEND_PREMULTIPLIED)
                canvas.outline(corners, accent, canvas.width(1.5))
        if not preview.line:
            return
        points = canvas.camera.to_pixels(np.array(preview.line))
        if len(points) > 1:
            canvas.outline(points, accent, canvas.width(1.5), closed=False)
            if preview.is_closed:
                canvas.dashes(points[-1].tolist(), points[0].tolist(), accent, canvas.width(1.0))
        for x, y in points.tolist() if preview.has_marks else ():
            size = 3 * canvas.scale
            box = pygame.Rect(round(x - size), round(y - size), round(2 * size), round(2 * size))
            pygame.draw.rect(surface, self.theme.background, box)
            pygame.draw.rect(surface, accent, box, canvas.width(1.5))
        if preview.label:
            x, y = points[-1].tolist()
            at = x + 12 * canvas.scale, y - 14 * canvas.scale
            tag(surface, preview.label, at, self.theme, canvas.scale)

    def _draw_frames(self, screen: pygame.Surface) -> None:
        if len(self._scenes) < 2:
            return
        scale, theme = self.layout.scale, self.theme
        for pane, box in enumerate(self.layout.panes):
            rect = pygame.Rect(box)
            pygame.draw.rect(screen, mix(theme.background, theme.ink, 0.18), rect.inflate(2, 2), 2)
            if pane == self.viewer.active_pane:
                bar = pygame.Rect(rect.topleft, (rect.width, max(2, round(3 * scale))))
                screen.fill(
                    theme.get_controller_color(self.viewer.session.timeline.panes[pane].controller.name), bar
                )
        (x, y, wide, high), entries = self.layout.legend, self._legend_entries()
        key = tuple(entry.key() for entry in entries), wide, theme.name, scale
        if self._strip is None or self._strip[0] != key:
            page = pygame.Surface((wide, max(high, 1)), 0, 32)
            page.fill(theme.background)
            camera, shown = self._painters[0].camera, frozenset(self.viewer.view.layers)
            page.blit(
                legend_strip(entries, Canvas(page, camera, theme, scale, choose_robot_hues(1), shown)), (0, 0)
            )
            self._strip = key, page
        screen.blit(self._strip[1], (x, y), pygame.Rect(0, 0, wide, high))

    def shared_rows(self) -> int:
        if len(self._scenes) < 2:
            return 0
        kept = self.layout.size, self.layout.scale, len(self.layout.panes), frozenset(self.viewer.view.layers)
        page = pygame.Surface((self.layout.arena[2], 1))
        canvas = Canvas(page, self._painters[0].camera, self.theme, self.layout.scale, choose_robot_hues(1))
        needed, before = len(legend_rows(canvas, self._legend_entries())), self._rows
        rows = max(needed, 1, before[1] if before[0] == kept else 1)
        self._rows = kept, rows
        return rows

    def _legend_entries(self) -> list[LegendEntry]:
        each = zip(self._painters, self._scenes, strict=False)  # a pane that was just added has no scene yet
        return merge_legends((painter.legend_entries(scene) for painter, scene in each), LegendEntry.key)
