"""The canvas: the sheet under a camera, and all that is drawn on top of it while it is edited."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pygame
import shapely

from robocov.environment import Point
from robocov_app.editor.canvas import overlay
from robocov_app.editor.canvas.captions import Strips
from robocov_app.editor.canvas.map_layers import Sheet, View
from robocov_app.editor.canvas.overlay import accent
from robocov_app.editor.edits.motion_path import goes, moving
from robocov_app.editor.edits.transform import bounds_of
from robocov_app.editor.model.geometry import distance
from robocov_app.editor.model.measurement import Measurement
from robocov_app.editor.model.selection import Change, Selection
from robocov_app.editor.model.sketch import BOUNDARY, Item, Owner, Sketch
from robocov_app.editor.model.validation import Problem
from robocov_app.editor.tools.handles import KNOB, frame_of, handles
from robocov_app.editor.tools.select import Moving
from robocov_app.editor.ui.editor import Editor
from robocov_app.editor.ui.team import Team
from robocov_app.render import sprites
from robocov_app.render.camera import Camera
from robocov_app.render.canvas import Canvas
from robocov_app.render.layout import fitted_radii
from robocov_app.render.marks import READABLE
from robocov_app.render.theme import Colour, Theme, mix
from robocov_app.toolkit.cache import Latest
from robocov_app.toolkit.layout import Layout

MANY = 200  # selected things from which on their outlines are drawn once, and then the picture of them
REACH = 12.0  # pixels at scale 1 that a finger is wide
MARGIN = 26.0  # pixels at scale 1 around the map when all of it is shown
STAYS = 0.45  # part of the view by which the map can be moved out of its middle
EMPTY = (0.0, 0.0, 10.0, 10.0)  # m; what is shown of a sheet with nothing on it

_BLEND = pygame.BLEND_PREMULTIPLIED


class EditorCanvas:
    """Draws what is in the editor, and finds what is under the cursor."""

    def __init__(self, editor: Editor) -> None:
        self.editor = editor
        self.sheet = Sheet()
        self.strips = Strips(editor)
        self.team: Team | None = None
        self.hovered: Problem | None = None
        self.at: Point | None = None  # where the mouse is, px; None where it is elsewhere
        self._camera: Camera | None = None
        self._hatched: Latest[tuple[pygame.Surface, pygame.Rect] | None] = Latest()
        self._carried: Latest[pygame.Surface] = Latest()
        self._outlined: Latest[pygame.Surface] = Latest()

    # cameras

    def arrange(self, layout: Layout, theme: Theme) -> None:
        """Fit another layout or theme; what was zoomed or panned stays so."""
        self.layout, self.theme = layout, theme
        if self._camera is not None:
            self._camera = self._camera.within(self._view_box())

    def _view_box(self) -> tuple[float, float, float, float]:
        return self.strips.room(self.layout.arena, self.layout.scale)

    @property
    def camera(self) -> Camera:
        """What is shown where."""
        if self._camera is None:
            self.fit()
        assert self._camera is not None
        return self._camera

    def fit(self) -> None:
        """Show the whole map."""
        self._show(self._bounds)

    def fit_selection(self) -> None:
        """Show what is selected, or all."""
        self._show(bounds_of(self.editor.sketch, self.editor.selection) or self._bounds)

    @property
    def _bounds(self) -> tuple[float, float, float, float]:
        return self.editor.sketch.bounds or EMPTY

    def _show(self, bounds: tuple[float, float, float, float]) -> None:
        low_x, low_y, high_x, high_y = bounds
        least = 0.2
        grow_x, grow_y = max(least - (high_x - low_x), 0) / 2, max(least - (high_y - low_y), 0) / 2
        grown = (low_x - grow_x, low_y - grow_y, high_x + grow_x, high_y + grow_y)
        self._look(Camera.fit(grown, self._view_box(), MARGIN * self.layout.scale))

    def go_to(self, problem: Problem) -> None:
        """Bring a problem into sight."""
        where = problem.where
        if where is None or where.is_empty:
            return
        spot = where.representative_point()
        x, y = self.to_pixel((spot.x, spot.y))
        left, top, width, height = self.camera.view
        edge = 40 * self.layout.scale
        if not (left + edge < x < left + width - edge and top + edge < y < top + height - edge):
            self._look(replace(self.camera, center=(spot.x, spot.y)))

    def zoom(self, factor: float, at: Point) -> None:
        """Magnify what is under a pixel of the window."""
        low_x, low_y, high_x, high_y = self._bounds
        whole = max(high_x - low_x, high_y - low_y, 1.0)
        # neither a dot nor a single wall's paint
        factor = float(np.clip(self.camera.zoom * factor, 20.0 / whole, 2e4)) / self.camera.zoom
        self._look(self.camera.zoomed(factor, at))

    def pan(self, dx: float, dy: float) -> None:
        """Move the sheet by so many pixels; the map stays within reach."""
        camera = self.camera.panned(dx, dy)
        low_x, low_y, high_x, high_y = self._bounds
        far_x, far_y = (STAYS * side / camera.zoom for side in camera.view[2:])
        x = float(np.clip(camera.center[0], low_x - far_x, high_x + far_x))
        y = float(np.clip(camera.center[1], low_y - far_y, high_y + far_y))
        self._look(replace(camera, center=(x, y)))

    def _look(self, camera: Camera) -> None:
        self._camera = camera
        self.editor.pixel = self.layout.scale / camera.zoom

    # what is where

    def over(self, pixel: Point) -> bool:
        """Return whether a pixel of the window shows the sheet."""
        left, top, width, height = self.camera.view
        return left <= pixel[0] < left + width and top <= pixel[1] < top + height

    def to_world(self, pixel: Point) -> Point:
        """Return the place under a pixel of the window, m."""
        x, y = self.camera.to_world(np.array(pixel, dtype=float)).tolist()
        return x, y

    def to_pixel(self, point: Point) -> Point:
        """Return the pixel of the window where a place is."""
        x, y = self.camera.to_pixels(np.array(point)).tolist()
        return x, y

    @property
    def reach(self) -> float:
        """How many metres a finger is wide."""
        return REACH * self.layout.scale / self.camera.zoom

    def problem_at(self, pixel: Point) -> Problem | None:
        """Return the problem whose badge is under a pixel."""
        if "problems" not in self.editor.shown:
            return None
        for problem, at in overlay.badge_places(self.editor.problems, self._view()):
            if distance(at, pixel) < 10 * self.layout.scale:
                return problem
        return None

    # drawing

    def _view(self) -> View:
        editor, layout = self.editor, self.layout
        folder = Path(editor.document.path.parent if editor.document.path is not None else editor.folder)
        shown = frozenset(editor.shown)
        return View(self.camera, self.theme, layout.scale, layout.size, shown, editor.grid, folder)

    def draw(self, screen: pygame.Surface) -> None:
        """Draw all of it."""
        editor, shown, theme = self.editor, self.editor.shown, self.theme
        box = pygame.Rect(self.layout.arena)
        self.strips.update(self._view().canvas(pygame.Surface((box.width, 1))), self.team)
        if self.camera.view != self._view_box():
            self._look(self.camera.within(self._view_box()))
        view = self._view()
        base, (now, chosen) = editor.sketch, editor.preview
        moved = getattr(editor.tools["picture"], "moved", None)
        weighed = getattr(editor.tool, "change", None)
        drag = editor.selector.drag
        carried = drag if isinstance(drag, Moving) and drag.offset is not None else None
        lifted = _changed(base, now)
        if carried is not None:
            lifted = frozenset() if carried.copies else carried.moving.items
        under = now if now.boundary is not base.boundary else base
        if moved is not None:
            under = replace(under, background=moved)
        if isinstance(weighed, Change):
            under = replace(under, density=weighed.sketch.density)
        page = self.sheet.page(view, under, lifted)
        screen.fill(theme.background, box)
        clip = view.clip
        screen.blit(page, clip, clip)
        screen.set_clip(clip)
        # words keep to the canvas
        canvas = view.canvas(screen.subsurface(box))
        canvas.surface.set_clip(clip)
        if carried is not None:
            self._carry(screen, view, carried)
        elif now is not base:
            there = [item for item in now.obstacles if item.key in lifted or item.key not in base.places]
            self.sheet.draw_items(canvas, there, self._lifted_fill)
        measurement = editor.measurement if "impassable" in shown else None
        if measurement is not None:
            self._hatch(screen, view, measurement)
            if measurement.gap is not None:
                overlay.draw_gap(canvas, measurement.gap, measurement.radius)
        self._draw_paths(canvas, weighed.sketch if isinstance(weighed, Change) else now)
        for k, (name, spec) in enumerate(now.starts):
            overlay.draw_start(canvas, spec, name, chosen=name in editor.selection.starts, first=k == 0)
        if self.team is not None and self.team.places and "robots" in shown:
            self._draw_team(canvas, self.team)
        if carried is None:
            self._draw_selection(screen, view, canvas, now, chosen)
        if measurement is not None and measurement.gap is not None:
            busy = editor.tool is not editor.selector or drag is not None
            overlay.tag_gap(canvas, measurement.gap, measurement.radius, self.at if busy else None)
        if "problems" in shown:
            overlay.draw_problems(canvas, view, editor.problems, editor.problem, self.hovered)
        self._draw_tool(canvas)
        screen.set_clip(None)
        self.strips.draw(screen, canvas, self.layout.arena)

    @property
    def _lifted_fill(self) -> Colour:
        return mix(self.theme.obstacle, accent(self.theme), 0.22)

    def _hatch(self, screen: pygame.Surface, view: View, measurement: Measurement) -> None:
        look = view.camera, view.theme.name, view.scale, view.size
        patch = self._hatched.of(measurement, look, lambda: overlay.hatched(view, measurement))
        if patch is not None:
            screen.blit(*patch, special_flags=_BLEND)

    def _carry(self, screen: pygame.Surface, view: View, drag: Moving) -> None:
        """Draw many things that are being moved: once, and then the picture of them."""
        assert drag.offset is not None
        sketch, colour = self.editor.sketch, accent(self.theme)

        def drawn() -> pygame.Surface:
            page = pygame.Surface(view.size, pygame.SRCALPHA, 32)
            there = [item for item in sketch.obstacles if item.key in drag.moving.items]
            self.sheet.draw_items(view.canvas(page), there, self._lifted_fill, colour)
            for owner in drag.moving.owners - drag.moving.items:
                self._draw_owner(view.canvas(page), sketch, owner, colour, 2.0)
            return page

        dx, dy = (view.camera.zoom * by for by in drag.offset)
        screen.blit(self._carried.of(drag, view.camera, drawn), (round(dx), round(-dy)), special_flags=_BLEND)

    def _draw_paths(self, canvas: Canvas, sketch: Sketch) -> None:
        """Draw the ways of obstacles that move, and while they are shown moving where they get to."""
        theme, since = canvas.theme, self.editor.moves_since
        for key in moving(sketch):
            item = sketch.item(key)
            path = item.shape.path
            assert path is not None
            chosen = key in self.editor.selection.items
            colour = accent(theme) if chosen else mix(theme.background, theme.ink, 0.6)
            overlay.draw_path(canvas, path, colour)
            if since is not None and goes(path):
                shift = path.shift(self.editor.now - since)
                moved = shapely.transform(item.geometry, lambda places, by=shift: places + by)
                overlay.draw_ghost(canvas, moved)

    def _draw_team(self, canvas: Canvas, team: Team) -> None:
        theme, scale = canvas.theme, canvas.scale
        places = canvas.camera.to_pixels(np.array(team.places))
        true = np.full(len(places), team.radius * canvas.camera.zoom)
        fitted = fitted_radii(places, true, 2.4 * scale, min(READABLE * scale, 400.0))
        radii = np.minimum(fitted, true.clip(3.0))
        edge = mix(theme.background, theme.ink, 0.55)
        for k, (at, radius) in enumerate(zip(places.tolist(), radii.tolist(), strict=True)):
            fill, number = theme.robots[k % len(theme.robots)], str(k + 1)
            size = round(2 * min(radius, 400.0)) / 2
            text = number if sprites.number_size(size, min(len(number), 4)) > 7.5 * scale else ""
            rim = min(1.4 * scale, 0.3 * size)
            canvas.stamp(partial(sprites.disc, size, fill, theme.robot_ring, rim, edge, text), at)

    def _draw_selection(
        self, screen: pygame.Surface, view: View, canvas: Canvas, sketch: Sketch, selection: Selection
    ) -> None:
        editor, selector, colour = self.editor, self.editor.selector, accent(self.theme)
        floor = self.theme.background
        selection = selection.within(sketch)
        owners: set[Owner] = set(selection.owners) | {vertex.of for vertex in selection.vertices}
        hovered = selector.hovered if editor.tool is selector and not selector.busy and self.at else None
        if hovered is not None and hovered not in owners:
            self._draw_owner(canvas, sketch, hovered, mix(floor, colour, 0.7), 1.5)

        def outline(canvas: Canvas) -> None:
            for owner in owners:
                self._draw_owner(canvas, sketch, owner, colour, 2.0)

        def outlined() -> pygame.Surface:
            page = pygame.Surface(view.size, pygame.SRCALPHA, 32)
            outline(view.canvas(page))
            return page

        if len(owners) > MANY:
            look = (selection, view.camera, view.theme.name, view.scale)
            screen.blit(self._outlined.of(sketch, look, outlined), (0, 0), special_flags=_BLEND)
        else:
            outline(canvas)
        if "handles" not in editor.shown or editor.tool is not selector or not selection:
            return
        box = frame_of(sketch, selection, editor.pixel)
        if box is not None:
            overlay.draw_box(canvas, box, mix(floor, colour, 0.6))
        found = editor.handles if sketch is editor.sketch else handles(sketch, selection, editor.pixel)
        chosen = frozenset(selection.vertices)
        overlay.draw_grips(canvas, found, chosen, selector.near, KNOB * canvas.scale)

    def _draw_owner(self, canvas: Canvas, sketch: Sketch, owner: Owner, colour: Colour, width: float) -> None:
        if isinstance(owner, str):
            if owner in dict(sketch.starts):
                overlay.draw_start(canvas, sketch.start(owner), "", chosen=True, dots=1.3)
        elif owner == BOUNDARY:
            if sketch.boundary is not None:
                ring = np.asarray(sketch.boundary, dtype=float)
                overlay.draw_outline(canvas, [ring], colour, width + 0.5)
        elif owner in sketch.places:
            overlay.draw_outline(canvas, self.sheet.outlines.of(sketch.item(owner)).rings, colour, width)

    def _draw_tool(self, canvas: Canvas) -> None:
        editor = self.editor
        overlay.draw_guides(canvas, editor.tool.guides)
        preview = editor.tool.preview(editor)
        if preview is not None:
            overlay.draw_preview(canvas, preview, self.at)
        if editor.typed:
            overlay.draw_typed(canvas, editor.typed, self.at or pygame.Rect(self.camera.view).center)


def _changed(base: Sketch, now: Sketch) -> frozenset[int]:
    """Return the obstacles of a sketch that are others, or gone, in another."""
    if now is base:
        return frozenset()
    there: dict[int, Item] = {item.key: item for item in now.obstacles}
    return frozenset(item.key for item in base.obstacles if there.get(item.key) is not item)
