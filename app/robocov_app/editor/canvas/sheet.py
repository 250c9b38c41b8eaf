"""The sheet: floor, background image, grid, obstacles and boundary.

It is drawn on a cached image, of which only changes are redrawn.
"""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import pygame
import shapely
from pygame import Rect, Surface

from robocov.typing import FloatArray
from robocov_app.editor.canvas.background_renderer import BackgroundRenderer
from robocov_app.editor.canvas.outlines import Outline, Outlines
from robocov_app.editor.canvas.sheet_view import (
    View,
    choose_hull_excess_color,
    choose_hull_excess_edge,
    choose_outside_color,
    compute_pixel_box,
)
from robocov_app.editor.model.geometry import Box
from robocov_app.editor.model.sketch import Item, Sketch
from robocov_app.look.colors import Color, choose_text_color, mix
from robocov_app.look.lengths import round_up
from robocov_app.render import fonts
from robocov_app.render.camera import Camera
from robocov_app.render.canvas import Canvas
from robocov_app.render.clipping import is_within_limit
from robocov_app.render.layers.density import draw_density_shading
from robocov_app.render.surface_cache import LatestValue
from robocov_app.toolkit.overlay import wrap_text

# Lengths in pixels at scale 1.
MIN_FINE_GRID_PX = 11.0  # between the fine lines of the grid
MIN_COARSE_GRID_PX = 55.0  # between the coarse lines
REDRAW_MARGIN_PX = 6  # around changed objects
FLAT_LINE_WIDTH_PX = 1.5  # of parts of obstacles that have no area
NAME_MARGIN_PX = 4.0  # free space to the left and right of a name, both together
LINE_REACH_PX = 2  # at any scale; distance beyond its ends to which a line may be drawn
MIN_NAMED_HEIGHT_MARGIN_PX = 4.0  # at any scale; by which an obstacle must be higher than its name
MIN_SPACE_HEIGHT_MARGIN_PX = 2.0  # at any scale; by which the free space must be higher than the name

PIXEL_BIAS = 1e-4  # small shift of the camera, because round coordinates would lie exactly between two pixels
MAX_SCROLL_ERROR_PX = 0.02  # maximum deviation of a camera motion from whole pixels for scrolling
MAX_REDRAWN_FRACTION = 0.5  # of the image; if more has changed, all of it is redrawn
MAX_BOXES = 40  # more boxes are merged into one
LINE_HEIGHT_FACTOR = 1.25  # distance of the lines of a name, relative to the size of the text
MIN_LABEL_CHARACTERS = 6  # a name that must be shortened to fewer characters is not shown
MIN_NAMED_WIDTH_FACTOR = 3.0  # minimum width of an obstacle with a name, relative to the height of the text
OBSTACLE_OPACITY = 0.62  # of obstacles on top of a background image
_TRANSPARENT = (0, 0, 0, 0)


@dataclass(frozen=True, eq=False)
class _ImageState:
    """Content of the cached image."""

    look: tuple[object, ...]  # everything except for the obstacles and the position of the camera
    camera: Camera
    items: dict[int, Item]


class Sheet:
    """Draws the sheet on an image, which is cached and updated.

    Attributes
    ----------
    outlines : Outlines
        Outlines of the obstacles.
    background_renderer : BackgroundRenderer
        Draws the background image.
    """

    def __init__(self) -> None:
        self.outlines = Outlines()
        self.background_renderer = BackgroundRenderer()
        self._cached_image: Surface | None = None
        self._state: _ImageState | None = None
        self._hull_excess: LatestValue[shapely.Geometry] = LatestValue()

    def draw(self, view: View, sketch: Sketch, hidden_keys: frozenset[int] = frozenset()) -> Surface:
        """Draw the sheet, redrawing only the parts that have changed since the last call.

        Parameters
        ----------
        view : View
            The view.
        sketch : Sketch
            The map.
        hidden_keys : frozenset of int
            Keys of obstacles that are not drawn, because they are dragged or changed.

        Returns
        -------
        Surface
            The cached image, as large as the window. The next call draws on it again.
        """
        left, top, width, height = view.camera.view
        camera = view.camera.with_view((left + PIXEL_BIAS, top + PIXEL_BIAS, width, height))
        view = replace(view, camera=camera)
        items = {
            item.key: item for item in sketch.obstacles if item.key not in hidden_keys and not item.hidden
        }
        state = _ImageState(_describe_look(view, sketch), camera, items)
        boxes = self._find_changes(view, self._state, state)
        if self._cached_image is None or self._cached_image.get_size() != view.size:
            self._cached_image = Surface(view.size, 0, 32)
        self._state = state
        for box in boxes:
            self._redraw_box(self._cached_image, view, sketch, items, box)
        return self._cached_image

    def _find_changes(self, view: View, before: _ImageState | None, after: _ImageState) -> list[Rect]:
        """Scroll the image if the camera has moved, and return the boxes that must be redrawn, px."""
        whole = view.clip
        if before is None or before.look != after.look:
            return [whole]
        boxes: list[Rect] = []
        if before.camera.center != after.camera.center:
            uncovered = self._scroll(before.camera, view)
            if uncovered is None:
                return [whole]
            boxes += uncovered
        margin = 2 * round(REDRAW_MARGIN_PX * view.scale)
        for item in _list_changed_items(before.items, after.items):
            bounds = self.outlines.get(item).bounds
            if np.isfinite(bounds[0]):
                boxes.append(compute_pixel_box(view.camera, bounds).inflate(margin, margin))
        visible = [box.clip(whole) for box in boxes]
        visible = [box for box in visible if box]
        area = sum(box.width * box.height for box in visible)
        if area > MAX_REDRAWN_FRACTION * whole.width * whole.height:
            return [whole]
        return _merge_boxes(visible)

    def _scroll(self, camera: Camera, view: View) -> list[Rect] | None:
        """Scroll the image from the view of a previous camera to the current view.

        Returns
        -------
        list of Rect or None
            Parts of the image that have become visible, px; None if the image cannot be scrolled, because the
            camera has moved too far or by a fraction of a pixel.
        """
        shift = np.array(view.camera.middle) - camera.to_pixels(np.array(view.camera.center))
        dx, dy = shift.tolist()
        whole_x = round(dx)
        whole_y = round(dy)
        clip = view.clip
        is_far = abs(whole_x) >= clip.width / 2 or abs(whole_y) >= clip.height / 2
        if is_far or max(abs(dx - whole_x), abs(dy - whole_y)) > MAX_SCROLL_ERROR_PX:
            return None
        assert self._cached_image is not None
        self._cached_image.set_clip(clip)
        self._cached_image.scroll(whole_x, whole_y)
        self._cached_image.set_clip(None)
        boxes = []
        if whole_x:
            left = clip.left if whole_x > 0 else clip.right + whole_x
            boxes.append(Rect(left, clip.top, abs(whole_x), clip.height))
        if whole_y:
            # The two boxes must not overlap.
            top = clip.top if whole_y > 0 else clip.bottom + whole_y
            left = clip.left + max(whole_x, 0)
            boxes.append(Rect(left, top, clip.width - abs(whole_x), abs(whole_y)))
        return boxes

    def _redraw_box(
        self, image: Surface, view: View, sketch: Sketch, items: dict[int, Item], box: Rect
    ) -> None:
        """Draw everything inside a box of the image, px, from bottom to top."""
        image.set_clip(box)
        canvas = view.build_canvas(image)
        boundary = _compute_boundary_pixels(view, sketch)
        _draw_floor(canvas, boundary, box)
        has_background = self._draw_background(image, view, sketch)
        if "grid" in view.shown:
            _draw_grid(image, view, box, has_fine_lines=not has_background)
        if boundary is not None:
            _draw_density(canvas, sketch)
        self._draw_hull_excess(canvas, sketch)
        candidates = self.outlines.find_items(sketch, _compute_visible_box(view, box))
        visible = [item for item in candidates if items.get(item.key) is item]
        if has_background:
            self._draw_translucent_items(canvas, visible, box)
        else:
            self.draw_items(canvas, visible)
        if boundary is not None:
            width = canvas.scale_width(view.theme.boundary_line)
            canvas.draw_outline(boundary, view.theme.boundary, width)
        if "names" in view.shown:
            self._draw_names(canvas, visible)
        image.set_clip(None)

    def _draw_background(self, image: Surface, view: View, sketch: Sketch) -> bool:
        """Draw the background image if it is shown; return whether it is."""
        background = sketch.background
        if background is None or "picture" not in view.shown:
            return False
        self.background_renderer.draw(image, background, view.folder, view.camera, view.clip)
        return background.shown

    def _draw_hull_excess(self, canvas: Canvas, sketch: Sketch) -> None:
        """Draw the areas between the boundary and its convex hull, which robots consider to be free."""
        theme = canvas.theme
        excess = self._hull_excess.get_or_compute(sketch.boundary, None, lambda: compute_hull_excess(sketch))
        fill = choose_hull_excess_color(theme)
        edge = choose_hull_excess_edge(theme)
        for part in shapely.get_parts(excess):
            if isinstance(part, shapely.Polygon):
                corners = canvas.camera.to_pixels(np.asarray(part.exterior.coords)[:-1])
                canvas.fill_polygon(corners, fill)
                canvas.draw_outline(corners, edge, 1)

    def _draw_translucent_items(self, canvas: Canvas, items: list[Item], box: Rect) -> None:
        """Draw translucent obstacles, so that the image under them stays visible."""
        layer = Surface(box.size, pygame.SRCALPHA, 32)
        left, top, width, height = canvas.camera.view
        camera = canvas.camera.with_view((left - box.x, top - box.y, width, height))
        self.draw_items(replace(canvas, surface=layer, camera=camera), items)
        layer.set_alpha(round(255 * OBSTACLE_OPACITY))
        canvas.surface.blit(layer, box)

    def draw_items(
        self, canvas: Canvas, items: list[Item], fill: Color | None = None, edge: Color | None = None
    ) -> None:
        """Draw obstacles, by default in the colors of the theme; parts without area have the error color."""
        fill = fill or canvas.theme.obstacle
        edge = edge or canvas.theme.obstacle_edge
        outlines = [self.outlines.get(item) for item in items]
        rings = [ring for outline in outlines for ring in outline.rings]
        if rings:
            # All rings are drawn with one call. `ends` contains the index after the last corner of each ring.
            ends: list[int] = np.cumsum([len(ring) for ring in rings]).tolist()
            corners = canvas.camera.to_pixels(np.concatenate(rings))
            fills: list[Color | None] = []
            for outline in outlines:
                ring_fill: Color | None = fill
                if outline.has_holes:
                    # These are filled one by one below.
                    ring_fill = None
                fills += [ring_fill] * len(outline.rings)
            canvas.draw_polygons(corners, ends, fills)
            for outline in outlines:
                if outline.has_holes:
                    _fill_with_holes(canvas, outline, fill)
            _draw_rings(canvas, corners, ends, edge)
        for outline in outlines:
            for line in outline.lines:
                points = canvas.camera.to_pixels(line)
                if len(points) > 1:
                    width = canvas.scale_width(FLAT_LINE_WIDTH_PX)
                    canvas.draw_outline(points, canvas.theme.error, width, is_closed=False)

    def _draw_names(self, canvas: Canvas, items: list[Item]) -> None:
        """Write the names of obstacles, if necessary shortened; none on obstacles that are too small."""
        size = canvas.scale_text_size(canvas.theme.small_text)
        color = choose_text_color(canvas.theme.obstacle)
        zoom = canvas.camera.zoom
        for item in items:
            name = item.shape.name
            outline = self.outlines.get(item)
            low_x, low_y, high_x, high_y = outline.bounds.tolist()
            is_low = (high_y - low_y) * zoom < size + MIN_NAMED_HEIGHT_MARGIN_PX
            is_narrow = (high_x - low_x) * zoom < MIN_NAMED_WIDTH_FACTOR * size
            if not name or is_low or is_narrow:
                continue
            space = outline.name_space
            width = space.width * zoom - NAME_MARGIN_PX * canvas.scale
            height = space.height * zoom - MIN_SPACE_HEIGHT_MARGIN_PX
            lines = fit_name(name, size, width, height)
            line_height = LINE_HEIGHT_FACTOR * size
            x, y = canvas.camera.to_pixels(np.array([space.x, space.y])).tolist()
            top = y - 0.5 * line_height * (len(lines) - 1)
            for number, line in enumerate(lines):
                center = (x, top + line_height * number)
                canvas.draw_text(line, center, size=canvas.theme.small_text, color=color, anchor="middle")


def fit_name(name: str, size: int, width: float, height: float) -> list[str]:
    """Return the lines of a name that fit into a space, px: wrapped, or else shortened to one line.

    The list is empty if too little of the name would be readable.
    """
    if height <= size:
        return []
    words = name.split()
    lines = wrap_text(name, size, width)
    has_whole_words = " ".join(lines) == " ".join(words)
    text_height = size + LINE_HEIGHT_FACTOR * size * (len(lines) - 1)
    if has_whole_words and text_height <= height:
        return lines
    text = fonts.shorten_to_width(name, size, width)
    if len(text) > MIN_LABEL_CHARACTERS:
        return [text]
    return []


def _describe_look(view: View, sketch: Sketch) -> tuple[object, ...]:
    """Return everything except obstacles and camera position that determines the image, for comparison."""
    return (
        view.camera.zoom,
        view.camera.view,
        view.theme.name,
        view.scale,
        view.size,
        view.grid,
        view.shown & {"grid", "names", "picture"},
        view.folder,
        sketch.background,
        sketch.boundary,
        sketch.density,
    )


def _list_changed_items(before: dict[int, Item], after: dict[int, Item]) -> list[Item]:
    """Return the old version of removed and changed obstacles, and the new one of added and changed ones."""
    changed = [item for key, item in before.items() if after.get(key) is not item]
    changed += [item for key, item in after.items() if before.get(key) is not item]
    return changed


def _compute_visible_box(view: View, box: Rect) -> Box:
    """Return the part of the map that is visible in a box of the image, px, with a margin, m."""
    ends = np.array([box.bottomleft, box.topright], dtype=float)
    (low_x, low_y), (high_x, high_y) = view.camera.to_world(ends).tolist()
    margin = REDRAW_MARGIN_PX * view.scale / view.camera.zoom
    return low_x - margin, low_y - margin, high_x + margin, high_y + margin


def compute_hull_excess(sketch: Sketch) -> shapely.Geometry:
    """Return the convex hull of the boundary without its inside; empty if the boundary is invalid."""
    if not sketch.boundary or len(sketch.boundary) <= 2:
        return shapely.Polygon()
    polygon = shapely.Polygon(sketch.boundary)
    if not polygon.is_valid:
        return shapely.Polygon()
    return shapely.difference(polygon.convex_hull, polygon)


def _compute_boundary_pixels(view: View, sketch: Sketch) -> FloatArray | None:
    """Return the corners of the boundary, (k, 2) px; None if it has no area."""
    if sketch.boundary is None or len(sketch.boundary) <= 2:
        return None
    return view.camera.to_pixels(np.asarray(sketch.boundary, dtype=float))


def _draw_floor(canvas: Canvas, boundary: FloatArray | None, box: Rect) -> None:
    """Fill a box of the image with the colors outside and inside the boundary."""
    canvas.surface.fill(choose_outside_color(canvas.theme), box)
    if boundary is not None:
        canvas.fill_polygon(boundary, canvas.theme.background)


def _draw_density(canvas: Canvas, sketch: Sketch) -> None:
    density = sketch.density
    if density is not None and not density.is_uniform and sketch.boundary is not None:
        draw_density_shading(canvas, density, np.asarray(sketch.boundary, dtype=float))


def _draw_grid(image: Surface, view: View, box: Rect, *, has_fine_lines: bool) -> None:
    theme = view.theme
    fine_step, coarse_step = compute_grid_steps(view.grid, view.camera.zoom, view.scale)
    if has_fine_lines:
        fine_color = mix(theme.background, theme.grid, theme.fine_grid_share)
        _draw_grid_lines(image, view, box, fine_step, fine_color)
    coarse_color = mix(theme.background, theme.grid, theme.coarse_grid_share)
    _draw_grid_lines(image, view, box, coarse_step, coarse_color)


def _draw_grid_lines(image: Surface, view: View, box: Rect, step: float, color: Color) -> None:
    """Draw the grid lines with a spacing, m, that cross a box of the image."""
    low_x, low_y, high_x, high_y = view.camera.compute_visible_bounds()
    width = max(1, round(view.scale))
    xs = np.arange(np.ceil(low_x / step), np.floor(high_x / step) + 1) * step
    ys = np.arange(np.ceil(low_y / step), np.floor(high_y / step) + 1) * step
    columns = view.camera.to_pixels(np.column_stack([xs, np.zeros(len(xs))]))[:, 0]
    rows = view.camera.to_pixels(np.column_stack([np.zeros(len(ys)), ys]))[:, 1]
    for x in columns[(columns >= box.left - 2) & (columns <= box.right + 2)].tolist():
        image.fill(color, Rect(round(x - width / 2), box.top, width, box.height))
    for y in rows[(rows >= box.top - 2) & (rows <= box.bottom + 2)].tolist():
        image.fill(color, Rect(box.left, round(y - width / 2), box.width, width))


def compute_grid_steps(grid: float, zoom: float, scale: float) -> tuple[float, float]:
    """Compute the spacings of the fine and coarse grid lines.

    Parameters
    ----------
    grid : float
        Spacing of the grid, m.
    zoom : float
        Magnification, px/m.
    scale : float
        Scale of the window.

    Returns
    -------
    fine, coarse : float
        Spacings, m: multiples of the grid spacing that are far enough apart on the screen.
    """
    min_fine = MIN_FINE_GRID_PX * scale / zoom
    fine = grid * round_up(max(min_fine / grid, 1.0))
    min_coarse = MIN_COARSE_GRID_PX * scale / zoom
    coarse = fine * round_up(max(min_coarse / fine, 1.0))
    return float(f"{fine:.12g}"), float(f"{coarse:.12g}")


def _fill_with_holes(canvas: Canvas, outline: Outline, fill: Color) -> None:
    """Fill an obstacle on a separate surface, so that the content below shows through its holes."""
    clip = canvas.surface.get_clip()
    layer = replace(canvas, surface=Surface(clip.size, pygame.SRCALPHA, 32))
    for ring, is_outer in zip(outline.rings, outline.outer, strict=True):
        corners = canvas.camera.to_pixels(ring) - np.array(clip.topleft)
        if is_outer:
            layer.fill_polygon(corners, (*fill, 255))
        else:
            layer.fill_polygon(corners, _TRANSPARENT)
    canvas.surface.blit(layer.surface, clip, special_flags=pygame.BLEND_PREMULTIPLIED)


def _draw_rings(canvas: Canvas, corners: FloatArray, ends: list[int], color: Color) -> None:
    """Draw several closed rings.

    Parameters
    ----------
    canvas : Canvas
    corners : (k, 2) array, px
        Corners of all rings, ring by ring.
    ends : list of int
        Index after the last corner of each ring.
    color : tuple of int
        Color of the lines.
    """
    width = canvas.scale_width(canvas.theme.line)
    if width == 1 and is_within_limit(corners):
        for start, end in pairwise((0, *ends)):
            if end - start > 1:
                canvas.draw_thin_path(corners[start:end].tolist(), color, is_closed=True)
        return
    # Index of the next corner in the ring: after the last corner, the first one.
    next_corners = np.arange(1, len(corners) + 1)
    first_corners = [0, *ends[:-1]]
    last_corners = np.array(ends) - 1
    next_corners[last_corners] = first_corners
    edges = np.hstack([corners, corners[next_corners]])
    # Skipping edges outside the image saves time.
    box = canvas.surface.get_clip().inflate(2 * LINE_REACH_PX, 2 * LINE_REACH_PX)
    low = np.minimum(edges[:, :2], edges[:, 2:])
    high = np.maximum(edges[:, :2], edges[:, 2:])
    is_visible = (high[:, 0] >= box.left) & (low[:, 0] <= box.right)
    is_visible &= (high[:, 1] >= box.top) & (low[:, 1] <= box.bottom)
    canvas.draw_segments(edges[is_visible], color, width)


def _merge_boxes(boxes: list[Rect]) -> list[Rect]:
    """Merge boxes that overlap; if there are too many boxes, merge all of them."""
    if len(boxes) > MAX_BOXES:
        boxes = [boxes[0].unionall(boxes[1:])]
    merged: list[Rect] = []
    for box in boxes:
        union = box.copy()
        while (index := union.collidelist(merged)) >= 0:
            union.union_ip(merged.pop(index))
        merged.append(union)
    return merged
