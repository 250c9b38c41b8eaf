"""The canvas: the sheet seen by a camera, the layers on top of it, the legend above and the status below."""

from dataclasses import replace

import numpy as np
from pygame import Rect, Surface

from robocov.environment import Point
from robocov.errors import format_count
from robocov_app.editor.canvas import overlay
from robocov_app.editor.canvas.layers import build_layers
from robocov_app.editor.canvas.legend import build_legend_entries
from robocov_app.editor.canvas.scene import EditorScene
from robocov_app.editor.canvas.sheet import Sheet, compute_hull_excess
from robocov_app.editor.canvas.sheet_view import View
from robocov_app.editor.editor import Editor
from robocov_app.editor.edits import transform
from robocov_app.editor.model.geometry import distance
from robocov_app.editor.model.selection import Selection
from robocov_app.editor.model.sketch import Sketch
from robocov_app.editor.model.validation import Problem
from robocov_app.editor.team import Team
from robocov_app.editor.tools.tool_overlay import EditorToolOverlay
from robocov_app.look.theme import Theme
from robocov_app.render.annotations import legend_strip, scale_bar
from robocov_app.render.camera import Camera
from robocov_app.render.canvas import LegendEntry
from robocov_app.render.density_shading import compute_density_range
from robocov_app.render.density_text import describe_density_range
from robocov_app.render.fonts import shorten_to_width
from robocov_app.render.layers.density import build_density_entry
from robocov_app.render.surface_cache import LatestValue
from robocov_app.toolkit.tools.viewport import pan_within, zoom_about
from robocov_app.toolkit.window.layout import Layout, is_inside

# Lengths in pixels at scale 1.
MARGIN_PX = 26.0  # around the map when all of it is shown
LEGEND_MARGIN_PX = 10  # below the legend
SCROLL_MARGIN_PX = 80  # a problem nearer to the edge is moved to the center of the view
BADGE_REACH_PX = 10
SCALE_BAR_LABEL_PX = 90

MAX_PAN_FRACTION = 0.45  # of the view: maximum distance of its center from the map
EMPTY_VIEW_M = (0.0, 0.0, 10.0, 10.0)  # visible part of an empty sheet
FACT_SEPARATOR = "   ·   "
MIN_VIEW_M = 0.2  # minimum width and height of a fitted view
MIN_HULL_EXCESS_M2 = 1e-6  # smaller areas are not in the legend


def list_map_facts(editor: Editor) -> list[str]:
    """Return the texts on a map, least important first: obstacles, free area, errors and warnings."""
    facts = [format_count(len(editor.sketch.obstacles), "obstacle")]
    measurement = editor.measurement
    if measurement is not None:
        facts.append(f"{measurement.free_area:.2f} m² free")
        errors = sum(problem.is_error for problem in measurement.problems)
        warnings = len(measurement.problems) - errors
        if errors:
            facts.append(f"draft: {format_count(errors, 'error')}")
        if warnings:
            facts.append(format_count(warnings, "warning"))
    return facts


def measure_legend_height(editor: Editor, scale: float) -> int:
    """Return the height of the legend above the map, px.

    Further rows are drawn over the map, so that it does not move when entries come and go.
    """
    if "legend" not in editor.shown:
        return 0
    return round((LEGEND_MARGIN_PX + legend_strip.ROW_HEIGHT_PX) * scale)


class EditorCanvas:
    """Draws the map of an editor, and converts between pixels and positions.

    Parameters
    ----------
    editor : Editor
        The editor.
    has_tools : bool
        Whether tools are used on this canvas, so that their reach depends on its zoom.

    Attributes
    ----------
    sheet : Sheet
        Draws floor, grid, obstacles and boundary.
    entries : list of LegendEntry
        Entries of the legend.
    team : Team or None
        The team that is shown at a start.
    hovered : Problem or None
        Problem under the cursor.
    cursor_pixel : Point or None
        Position of the cursor in the window, px; None while it is not over the map.
    camera : Camera
        The view, in pixels of the arena: its upper left corner is (0, 0).
    strip_texts : list of Rect
        Boxes of the scale bar and of the status line below the map, px of the window.
    """

    def __init__(self, editor: Editor, *, has_tools: bool = True) -> None:
        self.editor = editor
        self._has_tools = has_tools
        self.sheet = Sheet()
        self.entries: list[LegendEntry] = []
        self.strip_texts: list[Rect] = []
        self.team: Team | None = None
        self.hovered: Problem | None = None
        self.cursor_pixel: Point | None = None
        self.camera = Camera((0.0, 0.0), 1.0, (0.0, 0.0, 1.0, 1.0))
        self._layers = build_layers(self.sheet)
        self._legend: LatestValue[Surface] = LatestValue()
        self._has_hull_excess: LatestValue[bool] = LatestValue()
        self._fitted: tuple[Point, float] | None = None  # center and zoom of the last view fitted to the map

    def arrange(self, layout: Layout, theme: Theme) -> None:
        """Adapt to a new size or theme of the window; a view that shows the whole map still does."""
        self.layout = layout
        self.theme = theme
        self._set_camera(self.camera.with_view(self._compute_view_box()))
        if self.is_fitted:
            self.fit()

    @property
    def is_fitted(self) -> bool:
        """Whether the view shows the whole map, and will do so in a window of another size."""
        return self._fitted == (self.camera.center, self.camera.zoom)

    def _compute_view_box(self) -> tuple[float, float, float, float]:
        """Return the box between legend and status strip: left, top, width, height in the arena, px."""
        _, _, width, height = self.layout.arena
        scale = self.layout.scale
        legend_height = measure_legend_height(self.editor, scale)
        view_height = max(height - legend_height - round(scale_bar.STRIP_HEIGHT_PX * scale), 1)
        return 0.0, float(legend_height), float(width), float(view_height)

    def _build_legend_entries(self) -> list[LegendEntry]:
        """Build the entries for what the map shows; an empty list while the legend is hidden."""
        editor = self.editor
        if "legend" not in editor.shown:
            return []
        sketch = editor.sketch
        has_excess = self._has_hull_excess.get_or_compute(
            sketch.boundary, None, lambda: compute_hull_excess(sketch).area > MIN_HULL_EXCESS_M2
        )
        team = self.team
        entries = build_legend_entries(
            editor.shown_measurement,
            has_starts=bool(sketch.starts),
            has_team="robots" in editor.shown and team is not None and bool(team.positions),
            has_hull_excess=has_excess,
        )
        density = sketch.density
        if density is not None and not density.is_uniform and sketch.boundary:
            xs, ys = zip(*sketch.boundary, strict=True)
            low, high = compute_density_range(density, (min(xs), min(ys), max(xs), max(ys)))
            entries.append(build_density_entry(describe_density_range(low, high)))
        return entries

    def fit(self, selection: Selection | None = None) -> None:
        """Fit the view to a selection, by default to the whole map."""
        bounds = None
        if selection:
            bounds = transform.compute_bounds(self.editor.sketch, selection)
        low_x, low_y, high_x, high_y = bounds or self.editor.sketch.bounds or EMPTY_VIEW_M
        # Enlarge the bounds of small objects to the minimum size of the view.
        margin_x = max(MIN_VIEW_M - (high_x - low_x), 0) / 2
        margin_y = max(MIN_VIEW_M - (high_y - low_y), 0) / 2
        box = (low_x - margin_x, low_y - margin_y, high_x + margin_x, high_y + margin_y)
        self._set_camera(Camera.fit(box, self._compute_view_box(), MARGIN_PX * self.layout.scale))
        self._fitted = None
        if bounds is None:
            self._fitted = (self.camera.center, self.camera.zoom)

    def follow(self, other: "EditorCanvas") -> None:
        """Show the section of the map that another canvas shows, with its team."""
        self.team = other.team
        if other.is_fitted:
            self.fit()
            return
        width, height = self.camera.view[2:]
        other_width, other_height = other.camera.view[2:]
        zoom = other.camera.zoom * min(width / other_width, height / other_height)
        self._set_camera(replace(self.camera, center=other.camera.center, zoom=zoom))

    def show_problem(self, problem: Problem | None) -> None:
        """Center the view on a problem unless it is well inside the view."""
        if problem is None or problem.geometry is None or problem.geometry.is_empty:
            return
        point = problem.geometry.representative_point()
        margin = round(SCROLL_MARGIN_PX * self.layout.scale)
        visible = Rect(self.camera.view).inflate(-margin, -margin)
        if not visible.collidepoint(self._to_arena(self.to_pixel((point.x, point.y)))):
            self._set_camera(replace(self.camera, center=(point.x, point.y)))

    def zoom(self, factor: float, pixel: Point | None = None) -> None:
        """Zoom about a pixel of the window, by default the cursor or else the center of the view."""
        cursor = self.cursor_pixel
        if pixel is None and cursor is not None and self.contains(cursor):
            pixel = cursor
        fixed = self.camera.middle if pixel is None else self._to_arena(pixel)
        low_x, low_y, high_x, high_y = self.editor.sketch.bounds or EMPTY_VIEW_M
        extent = max(high_x - low_x, high_y - low_y, 1.0)
        self._set_camera(zoom_about(self.camera, factor, fixed, extent))

    def pan(self, dx: float, dy: float) -> None:
        """Move the view by a number of pixels, but not so far that the map leaves it."""
        bounds = self.editor.sketch.bounds or EMPTY_VIEW_M
        self._set_camera(pan_within(self.camera, (dx, dy), bounds, margin_fraction=MAX_PAN_FRACTION))

    def _set_camera(self, camera: Camera) -> None:
        self.camera = camera
        if self._has_tools:
            self.editor.pixel = self.layout.scale / camera.zoom

    def contains(self, pixel: Point) -> bool:
        """Return whether a pixel of the window is in the map view."""
        return is_inside(self.camera.view, self._to_arena(pixel))

    def _to_arena(self, pixel: Point) -> Point:
        """Return the pixel of the arena at a pixel of the window."""
        left, top = self.layout.arena.position
        return pixel[0] - left, pixel[1] - top

    def to_world(self, pixel: Point) -> Point:
        """Return the position of the map at a pixel of the window, m."""
        x, y = self.camera.to_world(np.array(self._to_arena(pixel), dtype=float)).tolist()
        return x, y

    def to_pixel(self, point: Point) -> Point:
        """Return the pixel of the window at a position of the map, m."""
        x, y = self.camera.to_pixels(np.array(point)).tolist()
        left, top = self.layout.arena.position
        return x + left, y + top

    def find_problem(self, pixel: Point) -> Problem | None:
        """Return the problem whose badge is at a pixel of the window, if any."""
        if "problems" not in self.editor.shown:
            return None
        reach = BADGE_REACH_PX * self.layout.scale
        pixel = self._to_arena(pixel)
        drawn_problems = overlay.select_drawn_problems(self.editor.problems, self.editor.problem)
        for problem, position in overlay.place_badges(drawn_problems, self.build_view()):
            if distance(position, pixel) < reach:
                return problem
        return None

    def build_view(self) -> View:
        """Build the description of the current view: camera, theme, size, layers and grid."""
        editor = self.editor
        return View(
            camera=self.camera,
            theme=self.theme,
            scale=self.layout.scale,
            size=self.layout.arena.size,
            shown=frozenset(editor.shown),
            grid=editor.grid,
            folder=editor.document.get_folder(editor.folder),
        )

    def draw(self, screen: Surface) -> None:
        """Draw the map, the legend and the status strip."""
        arena = screen.subsurface(Rect(self.layout.arena))
        self.entries = self._build_legend_entries()
        self._set_camera(self.camera.with_view(self._compute_view_box()))
        scene = self._build_scene(arena)
        arena.fill(self.theme.background)
        self._draw_sheet(scene)
        arena.set_clip(scene.view.clip)
        for layer in self._layers:
            layer.draw(scene)
        arena.set_clip(None)
        self._draw_legend(scene)
        self._draw_status_strip(scene)

    def _build_scene(self, arena: Surface) -> EditorScene:
        """Build the scene of one frame, with the overlay of the active tool and the state of a drag."""
        editor = self.editor
        view = self.build_view()
        tool_overlay = editor.tool.build_overlay(editor)
        sketch, selection = editor.displayed
        cursor = self.cursor_pixel
        if cursor is not None:
            cursor = self._to_arena(cursor)
        return EditorScene(
            surface=arena,
            canvas=view.build_canvas(arena),
            view=view,
            editor=editor,
            tool_overlay=tool_overlay,
            committed_sketch=editor.sketch,
            sketch=sketch,
            selection=selection,
            hidden_keys=_find_hidden_keys(editor.sketch, sketch, tool_overlay),
            team=self.team,
            hovered=self.hovered,
            cursor=cursor,
        )

    def _draw_sheet(self, scene: EditorScene) -> None:
        """Draw the sheet of the committed map; boundary, background and density as a tool changes them."""
        sketch = scene.committed_sketch
        is_boundary_changed = scene.sketch.boundary is not scene.committed_sketch.boundary
        if is_boundary_changed:
            sketch = scene.sketch
        if scene.tool_overlay.background is not None:
            sketch = replace(sketch, background=scene.tool_overlay.background)
        if scene.tool_overlay.pending is not None:
            sketch = replace(sketch, density=scene.tool_overlay.pending.density)
        clip = scene.view.clip
        scene.surface.blit(self.sheet.draw(scene.view, sketch, scene.hidden_keys), clip, clip)
        renderer = self.sheet.background_renderer
        if renderer.error:
            self.editor.show_message(renderer.error, is_error=True)
            renderer.error = ""

    def _draw_legend(self, scene: EditorScene) -> None:
        if not self.entries:
            return
        width = scene.surface.get_width()
        canvas = scene.canvas
        labels = tuple(entry.text for entry in self.entries)
        key = (labels, width, canvas.theme.name, canvas.scale)
        strip = replace(canvas, surface=Surface((width, 1)))
        legend = self._legend.get_or_compute(
            None, key, lambda: legend_strip.render_legend_strip(self.entries, strip)
        )
        scene.surface.blit(legend, (0, 0))

    def _draw_status_strip(self, scene: EditorScene) -> None:
        """Draw the status strip at the bottom: scale bar and status line."""
        box = scene.surface.get_rect()
        scale = scene.canvas.scale
        height = round(scale_bar.STRIP_HEIGHT_PX * scale)
        strip = Rect(0, box.height - height, box.width, height)
        canvas = replace(scene.canvas, surface=scene.surface.subsurface(strip))
        scale_bar.draw_scale_bar(canvas)
        bar_width = scale_bar.choose_bar_length(canvas) * canvas.camera.zoom
        free_width = box.width - (scale_bar.EDGE_PX + SCALE_BAR_LABEL_PX) * scale - bar_width
        text_size = canvas.scale_text_size(canvas.theme.text)
        max_width = free_width - scale_bar.EDGE_PX * scale
        facts = list_map_facts(self.editor)
        while len(facts) > 1 and canvas.measure_text(FACT_SEPARATOR.join(facts)) > max_width:
            facts.pop(0)
        text = shorten_to_width(FACT_SEPARATOR.join(facts), text_size, max_width)
        canvas.draw_text(text, (box.width - scale_bar.EDGE_PX * scale, height / 2), anchor="right")
        text_strip = scale_bar.find_strip(Rect(self.layout.arena), scale)
        self.strip_texts = [
            scale_bar.place_left(text_strip, scale_bar.measure_bar(canvas), scale),
            scale_bar.place_right(text_strip, canvas.measure_text(text), scale),
        ]


def _find_hidden_keys(
    committed: Sketch, displayed: Sketch, tool_overlay: EditorToolOverlay
) -> frozenset[int]:
    """Return the keys of obstacles to leave out of the sheet: those that are dragged, changed or removed."""
    dragged_image = tool_overlay.dragged_image
    if dragged_image is not None and not dragged_image.shows_copies:
        return dragged_image.selection.items
    # The originals of copies stay on the sheet.
    if dragged_image is not None or displayed is committed:
        return frozenset()
    items = {item.key: item for item in displayed.obstacles}
    return frozenset(item.key for item in committed.obstacles if items.get(item.key) is not item)
