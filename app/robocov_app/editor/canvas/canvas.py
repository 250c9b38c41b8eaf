"""The canvas: the sheet under a camera, what is drawn on top of it, and the strips above and below."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pygame
import shapely
from pygame import Rect, Surface

from robocov.environment import Point
from robocov.errors import format_count
from robocov_app.editor.canvas import overlay
from robocov_app.editor.canvas.map_layers import Sheet, View, beyond
from robocov_app.editor.canvas.overlay import legend_entries
from robocov_app.editor.edits import paths, transform
from robocov_app.editor.model.geometry import distance
from robocov_app.editor.model.selection import Change, Selection
from robocov_app.editor.model.sketch import BOUNDARY, Owner, Sketch
from robocov_app.editor.model.validation import Problem
from robocov_app.editor.tools.select import Moving
from robocov_app.editor.tools.tool import frame_of, handles
from robocov_app.editor.ui.editor import Editor, Team
from robocov_app.render import annotations, heatmaps, marks, sprites
from robocov_app.render.camera import Camera
from robocov_app.render.canvas import Canvas, LegendEntry
from robocov_app.render.density import range_label, value_range
from robocov_app.render.fonts import shortened
from robocov_app.render.layout import fitted_radii
from robocov_app.render.surface_cache import Latest
from robocov_app.render.theme import Colour, Theme, mix
from robocov_app.toolkit.layout import Layout, inside


def map_words(editor: Editor) -> str:
    sketch, measurement = editor.sketch, editor.measurement
    unsaved = "● " if editor.document.history.unsaved else ""
    said = [f"{unsaved}{editor.document.title}", format_count(len(sketch.obstacles), "obstacle")]
    if measurement is not None:
        said.append(f"{measurement.free_area:.2f} m² free")
        if grave := sum(problem.grave for problem in measurement.problems):
            said.append(f"draft: {format_count(grave, 'problem')}")
    return "   ·   ".join(said)


MANY = 200  # selected things from which on their outlines are drawn once, and then the picture of them
REACH = 12.0  # pixels at scale 1 that a finger is wide
MARGIN = 26.0  # pixels at scale 1 around the map when all of it is shown
STAYS = 0.45  # part of the view by which the map can be moved out of its middle
EMPTY = (0.0, 0.0, 10.0, 10.0)  # m; what is shown of a sheet with nothing on it
_BLEND = pygame.BLEND_PREMULTIPLIED


class EditorCanvas:
    """Draws what is in the editor, and finds what is under the cursor."""

    def __init__(self, editor: Editor) -> None:
        self.editor, self.sheet = editor, Sheet()
        self.entries: list[LegendEntry] = []  # of the legend
        self._rows = 1
        self._rows_for: object = None
        self._unfree: Latest[bool] = Latest()
        self.team: Team | None = None
        self.hovered: Problem | None = None
        self.at: Point | None = None  # where the mouse is, px; None where it is elsewhere
        self.camera = Camera((0.0, 0.0), 1.0, (0.0, 0.0, 1.0, 1.0))
        self._fitted: tuple[Point, float] | None = None  # centre and zoom of the camera that shows all
        self._hatched: Latest[tuple[Surface, Rect] | None] = Latest()
        self._legend, self._carried, self._outlined = Latest[Surface](), Latest[Surface](), Latest[Surface]()

    def arrange(self, layout: Layout, theme: Theme) -> None:
        self.layout, self.theme = layout, theme
        self._look(self.camera.within(self._view_box()))
        if self._fitted == (self.camera.center, self.camera.zoom):  # and not zoomed or panned since
            self.fit()

    def _view_box(self) -> tuple[float, float, float, float]:
        """Return what the legend and the strip at the foot leave: left, top, width and height, px."""
        (left, top, width, height), scale = self.layout.arena, self.layout.scale
        has_legend = "legend" in self.editor.shown
        above = round((10 + annotations.LEGEND_ROW * self._rows) * scale) if has_legend else 0
        below = max(height - above - round(annotations.STRIP * scale), 1)
        return float(left), float(top + above), float(width), float(below)

    def _update_legend(self, canvas: Canvas) -> None:
        editor, sketch, density = self.editor, self.editor.sketch, self.editor.sketch.density
        self.entries = []
        if "legend" in editor.shown:
            unfree = self._unfree.of(sketch.boundary, None, lambda: beyond(sketch).area > 1e-6)
            standing = "robots" in editor.shown and self.team is not None and bool(self.team.places)
            found = editor.measurement if "impassable" in editor.shown else None
            self.entries = legend_entries(found, starts=bool(sketch.starts), team=standing, unfree=unfree)
            if density is not None and not density.is_uniform and sketch.boundary:
                x, y = zip(*sketch.boundary, strict=True)
                span = value_range(density, (min(x), min(y), max(x), max(y)))
                self.entries.append(heatmaps.density_entry(range_label(span)))
        rows = max(len(annotations.legend_rows(canvas, self.entries)), 1)
        key = (canvas.surface.get_width(), canvas.scale, editor.document, "legend" in editor.shown)
        # while things come and go the legend does not become lower again: the map is not to jump
        self._rows = max(rows, self._rows) if key == self._rows_for else rows
        self._rows_for = key

    def fit(self, selection: Selection | None = None) -> None:
        bounds = transform.bounds_of(self.editor.sketch, selection) if selection else None
        low_x, low_y, high_x, high_y = bounds or self.editor.sketch.bounds or EMPTY
        grow_x, grow_y = max(0.2 - (high_x - low_x), 0) / 2, max(0.2 - (high_y - low_y), 0) / 2  # m
        grown = (low_x - grow_x, low_y - grow_y, high_x + grow_x, high_y + grow_y)
        self._look(Camera.fit(grown, self._view_box(), MARGIN * self.layout.scale))
        self._fitted = None if bounds else (self.camera.center, self.camera.zoom)

    def go_to(self, problem: Problem | None) -> None:
        if problem is None or problem.where is None or problem.where.is_empty:
            return
        spot, edge = problem.where.representative_point(), round(80 * self.layout.scale)
        if not Rect(self.camera.view).inflate(-edge, -edge).collidepoint(self.to_pixel((spot.x, spot.y))):
            self._look(replace(self.camera, center=(spot.x, spot.y)))

    def zoom(self, factor: float, at: Point | None = None) -> None:
        """Magnify what is under a pixel of the window: by default under the cursor, or in the middle."""
        if at is None:
            at = self.at if self.at is not None and self.over(self.at) else self.camera.middle
        low_x, low_y, high_x, high_y = self.editor.sketch.bounds or EMPTY
        whole = max(high_x - low_x, high_y - low_y, 1.0)
        # neither a dot nor a single wall's paint
        factor = float(np.clip(self.camera.zoom * factor, 20.0 / whole, 2e4)) / self.camera.zoom
        self._look(self.camera.zoomed(factor, at))

    def pan(self, dx: float, dy: float) -> None:
        camera = self.camera.panned(dx, dy)
        low_x, low_y, high_x, high_y = self.editor.sketch.bounds or EMPTY
        far_x, far_y = (STAYS * side / camera.zoom for side in camera.view[2:])
        low, high = (low_x - far_x, low_y - far_y), (high_x + far_x, high_y + far_y)
        x, y = np.clip(camera.center, low, high).tolist()
        self._look(replace(camera, center=(x, y)))

    def _look(self, camera: Camera) -> None:
        self.camera, self.editor.pixel = camera, self.layout.scale / camera.zoom

    def over(self, pixel: Point) -> bool:
        return inside(self.camera.view, pixel)

    def to_world(self, pixel: Point) -> Point:
        x, y = self.camera.to_world(np.array(pixel, dtype=float)).tolist()
        return x, y

    def to_pixel(self, point: Point) -> Point:
        x, y = self.camera.to_pixels(np.array(point)).tolist()
        return x, y

    def problem_at(self, pixel: Point) -> Problem | None:
        found = self.editor.problems if "problems" in self.editor.shown else ()
        places, reach = overlay.badge_places(found, self._view()), 10 * self.layout.scale
        return next((problem for problem, at in places if distance(at, pixel) < reach), None)

    def _view(self) -> View:
        editor, layout = self.editor, self.layout
        folder = Path(editor.document.path.parent if editor.document.path is not None else editor.folder)
        shown = frozenset(editor.shown)
        return View(self.camera, self.theme, layout.scale, layout.size, shown, editor.grid, folder)

    def draw(self, screen: Surface) -> None:
        editor, shown, theme = self.editor, self.editor.shown, self.theme
        box = Rect(self.layout.arena)
        self._update_legend(self._view().canvas(Surface((box.width, 1))))
        self._look(self.camera.within(self._view_box()))
        view = self._view()
        base, (now, chosen) = editor.sketch, editor.preview
        moved = getattr(editor.tools["picture"], "moved", None)
        weighed, drag = getattr(editor.tool, "change", None), editor.selector.drag
        carried = drag if isinstance(drag, Moving) and drag.offset is not None else None
        lifted: frozenset[int] = frozenset()
        if carried is not None and not carried.copies:
            lifted = carried.moving.items
        elif carried is None and now is not base:  # those that are others by now, or gone
            items = {item.key: item for item in now.obstacles}
            lifted = frozenset(item.key for item in base.obstacles if items.get(item.key) is not item)
        under = now if now.boundary is not base.boundary else base
        if moved is not None:
            under = replace(under, background=moved)
        if isinstance(weighed, Change):
            under = replace(under, density=weighed.sketch.density)
        screen.fill(theme.background, box)
        clip = view.clip
        screen.blit(self.sheet.page(view, under, lifted), clip, clip)
        if self.sheet.underlaid.trouble:
            editor.say(self.sheet.underlaid.trouble, trouble=True)
            self.sheet.underlaid.trouble = ""
        screen.set_clip(clip)
        canvas = view.canvas(screen.subsurface(box))  # words keep to the canvas
        canvas.surface.set_clip(clip)
        if carried is not None:
            self._carry(screen, view, carried)
        elif now is not base:
            there = [item for item in now.obstacles if item.key in lifted or item.key not in base.places]
            self.sheet.draw_items(canvas, there, mix(theme.obstacle, theme.final, 0.22))
        measurement = editor.measurement if "impassable" in shown else None
        if measurement is not None:
            look = view.camera, theme.name, view.scale, view.size
            patch = self._hatched.of(measurement, look, lambda: overlay.hatched(view, measurement))
            if patch is not None:
                screen.blit(*patch, special_flags=_BLEND)
            if measurement.gap is not None:
                overlay.draw_gap(canvas, measurement.gap, measurement.radius)
        self._draw_paths(canvas, weighed.sketch if isinstance(weighed, Change) else now)
        for k, (name, spec) in enumerate(now.starts):
            overlay.draw_start(canvas, spec, name, chosen=name in editor.selection.starts, first=k == 0)
        if self.team is not None and self.team.places and "robots" in shown:
            self._draw_team(canvas, self.team)
        if carried is None:
            self._draw_selection(view, canvas, now, chosen)
        if measurement is not None and measurement.gap is not None:
            busy = editor.tool is not editor.selector or drag is not None
            overlay.tag_gap(canvas, measurement.gap, measurement.radius, self.at if busy else None)
        if "problems" in shown:
            overlay.draw_problems(canvas, view, editor.problems, editor.problem, self.hovered)
        overlay.draw_guides(canvas, editor.tool.guides)
        if (preview := editor.tool.preview(editor)) is not None:
            overlay.draw_preview(canvas, preview, self.at)
        if editor.typed:
            overlay.draw_typed(canvas, editor.typed, self.at or Rect(self.camera.view).center)
        screen.set_clip(None)
        self._draw_strips(screen, canvas, box)

    def _draw_strips(self, screen: Surface, canvas: Canvas, box: Rect) -> None:
        if self.entries:
            key = (tuple(entry.text for entry in self.entries), box.width, canvas.theme.name, canvas.scale)
            wide = replace(canvas, surface=Surface((box.width, 1)))
            screen.blit(self._legend.of(None, key, lambda: annotations.legend_strip(self.entries, wide)), box)
        high = round(annotations.STRIP * canvas.scale)
        own = replace(canvas, surface=screen.subsurface(Rect(box.left, box.bottom - high, box.width, high)))
        annotations.draw_scale_bar(own)
        taken = (annotations.EDGE + 90) * canvas.scale + annotations.bar_length(own) * canvas.camera.zoom
        size = canvas.text_size(canvas.theme.text)
        words = shortened(map_words(self.editor), size, box.width - taken - annotations.EDGE * canvas.scale)
        own.text(words, (box.width - annotations.EDGE * canvas.scale, high / 2), anchor="right")

    def _carry(self, screen: Surface, view: View, drag: Moving) -> None:
        assert drag.offset is not None
        sketch, colour = self.editor.sketch, self.theme.final

        def drawn() -> Surface:
            page = view.page()
            there = [item for item in sketch.obstacles if item.key in drag.moving.items]
            self.sheet.draw_items(page, there, mix(self.theme.obstacle, colour, 0.22), colour)
            for owner in drag.moving.owners - drag.moving.items:
                self._draw_owner(page, sketch, owner, colour, 2.0)
            return page.surface

        dx, dy = (view.camera.zoom * by for by in drag.offset)
        screen.blit(self._carried.of(drag, view.camera, drawn), (round(dx), round(-dy)), special_flags=_BLEND)

    def _draw_paths(self, canvas: Canvas, sketch: Sketch) -> None:
        theme, since = canvas.theme, self.editor.moves_since
        for key in paths.moving(sketch):
            item = sketch.item(key)
            path = item.shape.path
            assert path is not None
            chosen = key in self.editor.selection.items
            overlay.draw_path(canvas, path, theme.final if chosen else mix(theme.background, theme.ink, 0.6))
            if since is not None and paths.goes(path):
                shift = path.compute_displacement(self.editor.now - since)
                moved = shapely.transform(item.geometry, lambda places, by=shift: places + by)
                overlay.draw_ghost(canvas, moved)

    def _draw_team(self, canvas: Canvas, team: Team) -> None:
        theme, scale = canvas.theme, canvas.scale
        places = canvas.camera.to_pixels(np.array(team.places))
        true = np.full(len(places), team.radius * canvas.camera.zoom)
        fitted = fitted_radii(places, true, 2.4 * scale, min(marks.READABLE * scale, 400.0))
        radii = np.minimum(fitted, true.clip(3.0))
        edge = mix(theme.background, theme.ink, 0.55)
        for k, (at, radius) in enumerate(zip(places.tolist(), radii.tolist(), strict=True)):
            fill, number = theme.robots[k % len(theme.robots)], str(k + 1)
            size = round(2 * min(radius, 400.0)) / 2
            text = number if sprites.number_size(size, min(len(number), 4)) > 7.5 * scale else ""
            rim = min(1.4 * scale, 0.3 * size)
            canvas.stamp(partial(sprites.disc, size, fill, theme.robot_ring, rim, edge, text), at)

    def _draw_selection(self, view: View, canvas: Canvas, sketch: Sketch, selection: Selection) -> None:
        editor, selector, colour = self.editor, self.editor.selector, self.theme.final
        floor, selection = self.theme.background, selection.within(sketch)
        owners: set[Owner] = set(selection.owners) | {vertex.of for vertex in selection.vertices}
        hovered = selector.hovered if editor.tool is selector and not selector.busy and self.at else None
        if hovered is not None and hovered not in owners and Selection.of(hovered).within(sketch):
            self._draw_owner(canvas, sketch, hovered, mix(floor, colour, 0.7), 1.5)

        def outline(on: Canvas) -> Surface:
            for owner in owners:
                self._draw_owner(on, sketch, owner, colour, 2.0)
            return on.surface

        if len(owners) > MANY:
            look = (selection, view.camera, view.theme.name, view.scale)
            page = self._outlined.of(sketch, look, lambda: outline(view.page()))
            canvas.surface.blit(page, (0, 0), special_flags=_BLEND)
        else:
            outline(canvas)
        if "handles" not in editor.shown or editor.tool is not selector or not selection:
            return
        if (box := frame_of(sketch, selection, editor.pixel)) is not None:
            rim = overlay.pixels(canvas, shapely.box(*box).exterior.coords).tolist()
            overlay.dashed(canvas, rim, mix(floor, colour, 0.6), 3.0)
        found = editor.handles if sketch is editor.sketch else handles(sketch, selection, editor.pixel)
        overlay.draw_grips(canvas, found, selection.vertices, selector.near)

    def _draw_owner(self, canvas: Canvas, sketch: Sketch, owner: Owner, colour: Colour, width: float) -> None:
        if isinstance(owner, str):
            overlay.draw_start(canvas, sketch.start(owner), "", chosen=True, dots=1.3)
        elif owner == BOUNDARY:
            ring = overlay.pixels(canvas, sketch.boundary or ())
            canvas.outline(ring, colour, canvas.width(width + 0.5))
        else:
            for ring in self.sheet.outlines.of(sketch.item(owner)).rings:
                canvas.outline(canvas.camera.to_pixels(ring), colour, canvas.width(width))
