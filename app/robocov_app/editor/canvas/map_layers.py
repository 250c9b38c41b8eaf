"""The sheet: floor, picture, grid, obstacles and boundary on one page; only what changed is drawn anew."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path

import numpy as np
import pygame
import shapely
from PIL import Image, ImageOps
from pygame import Rect, Surface

from robocov.arrays import Array
from robocov_app.editor.model.background import Background
from robocov_app.editor.model.sketch import Item, Sketch
from robocov_app.render import fonts, heatmaps, surface_cache
from robocov_app.render.camera import Camera, round_length
from robocov_app.render.canvas import FAR, Canvas
from robocov_app.render.theme import LIGHT, Colour, Theme, mix, robot_hues
from robocov_app.storage.regular_files import require_regular_file

_FORGOTTEN = 4  # how many times more outlines than obstacles are kept, those of what was undone among them


@dataclass(frozen=True, eq=False)
class Outline:
    """Screen geometry of an obstacle."""

    rings: list[Array]  # (k, 2) m; of each of its parts the outer ring, then its holes
    outer: list[bool]  # which of them are outer rings
    lines: list[Array]  # (k, 2) m; of what covers nothing
    bounds: Array  # (4,) m
    geometry: shapely.Geometry

    @cached_property
    def name_place(self) -> tuple[float, float, float, float]:
        """Largest free spot for a name: x, y, width, height, m."""
        geometry, best = self.geometry, (0.0, 0.0, 0.0, 0.0)
        for y in () if geometry.is_empty else (geometry.centroid.y, geometry.representative_point().y):
            for part in _cut(geometry, 0, y):
                x = part.centroid.x
                columns = [each for each in _cut(geometry, 1, x) if each.bounds[1] <= y <= each.bounds[3]]
                if columns and part.length > best[2] * 1.2:
                    best = (x, columns[0].centroid.y, part.length, columns[0].length)
        return best


def _cut(geometry: shapely.Geometry, axis: int, at: float) -> Iterable[shapely.Geometry]:
    low_x, low_y, high_x, high_y = geometry.bounds
    ends = [(low_x - 1.0, at), (high_x + 1.0, at)] if axis == 0 else [(at, low_y - 1.0), (at, high_y + 1.0)]
    parts = shapely.get_parts(shapely.intersection(geometry, shapely.LineString(ends)))
    return [part for part in parts if part.length > 0.0]


def outline_of(geometry: shapely.Geometry) -> Outline:
    rings: list[Array] = []
    outer: list[bool] = []
    lines: list[Array] = []
    for part in shapely.get_parts(geometry):
        if isinstance(part, shapely.Polygon):
            rings += [np.asarray(ring.coords)[:-1] for ring in (part.exterior, *part.interiors)]
            outer += [True] + [False] * len(part.interiors)
        elif not part.is_empty:
            lines.append(shapely.get_coordinates(part))
    return Outline(rings, outer, lines, np.array(shapely.bounds(geometry)), geometry)


class Outlines:
    """Outlines of obstacles, made once for each."""

    def __init__(self) -> None:
        self._known: dict[int, tuple[Item, Outline]] = {}
        self._bounds: surface_cache.Latest[Array] = surface_cache.Latest()

    def of(self, item: Item) -> Outline:
        known = self._known.get(id(item))
        if known is None or known[0] is not item:
            known = self._known[id(item)] = (item, outline_of(item.geometry))
        return known[1]

    def touching(self, sketch: Sketch, box: tuple[float, float, float, float]) -> list[Item]:
        def bounds() -> Array:
            if len(self._known) > _FORGOTTEN * len(sketch.obstacles) + 1000:
                self._known = {}
            return np.array([self.of(item).bounds for item in sketch.obstacles]).reshape(-1, 4)

        low_x, low_y, high_x, high_y = self._bounds.of(sketch, None, bounds).T
        there = (low_x <= box[2]) & (high_x >= box[0]) & (low_y <= box[3]) & (high_y >= box[1])
        return [sketch.obstacles[k] for k in np.flatnonzero(there) if not sketch.obstacles[k].hidden]


# pixels at scale 1
FINE, COARSE = 11.0, 55.0  # between the fine and the strong lines of the grid, at least
_EDGE = 6  # around what changed that are drawn anew too
_ROOM = 8.0  # that a name leaves free beside it
BIAS = 1e-4  # pixels by which all is shifted: round numbers would else lie between two, and fall anyhow
PATCHES = 0.5  # part of the page from which on it is drawn anew as a whole
LEAST_LETTERS = 6  # of a shortened name
SEEN_THROUGH = 0.62  # opacity of obstacles over a picture
LARGEST = 4096  # pixels of a side that are kept of a larger picture
_LARGEST_SHOWN = 8192  # of a side of what is made of it at most


@dataclass(frozen=True, eq=False)
class View:
    """View of a sheet: pan, zoom and size."""

    camera: Camera
    theme: Theme
    scale: float
    size: tuple[int, int]  # width and height, px
    shown: frozenset[str]
    grid: float  # m
    folder: Path  # what a picture's path counts from

    @property
    def clip(self) -> Rect:
        return Rect([round(value) for value in self.camera.view])

    def canvas(self, surface: Surface) -> Canvas:
        return Canvas(surface, self.camera, self.theme, self.scale, robot_hues(0))

    def page(self) -> Canvas:
        """Return a clear canvas as large as the window."""
        return self.canvas(Surface(self.size, pygame.SRCALPHA, 32))


def outside_colour(theme: Theme) -> Colour:
    return mix(theme.panel, theme.ink, 0.05) if theme is LIGHT else mix(theme.background, (0, 0, 0), 0.28)


class ReferenceImage:
    """Keeps the picture that was loaded last, and draws it."""

    def __init__(self) -> None:
        self._of: Path | None = None
        self._picture: Surface | None = None
        self._shrunk, self.trouble = 1.0, ""

    def draw(self, page: Surface, background: Background, folder: Path, camera: Camera, clip: Rect) -> None:
        path = folder / background.path
        if path != self._of:
            self._of, self._picture, self.trouble = path, None, ""
            try:
                require_regular_file(path)
                with Image.open(path) as opened:
                    full = ImageOps.exif_transpose(opened)
                    rgb = _on_white(full)
                rgb.thumbnail((LARGEST, LARGEST))
                self._shrunk = full.size[0] / rgb.size[0]
                self._picture = pygame.image.frombytes(rgb.tobytes(), rgb.size, "RGB").convert()
            except Exception as error:  # whatever a broken picture makes its decoder raise
                self.trouble = f"the picture {path.name} cannot be shown: {error}"
        picture = self._picture
        if picture is None or not background.shown or background.opacity <= 0.0:
            return
        factor = background.scale * camera.zoom * self._shrunk
        if background.turn % 360.0:
            if factor * max(picture.get_size()) > _LARGEST_SHOWN:
                return
            shown = pygame.transform.rotozoom(picture.convert_alpha(), background.turn, factor)
            corners = camera.to_pixels(np.array(background.corners))
            x, y = ((corners.min(axis=0) + corners.max(axis=0)) / 2).tolist()
            at = shown.get_rect(center=(round(x), round(y)))
        else:  # the part that can be seen: magnified, the whole may be huge
            left, top = camera.to_pixels(np.array(background.corners[3])).tolist()
            width, height = picture.get_size()
            first_x = max(int((clip.left - left) / factor) - 1, 0)
            first_y = max(int((clip.top - top) / factor) - 1, 0)
            last_x = min(int((clip.right - left) / factor) + 2, width)
            last_y = min(int((clip.bottom - top) / factor) + 2, height)
            at = Rect(round(left + first_x * factor), round(top + first_y * factor), 0, 0)
            to_x, to_y = round(left + last_x * factor), round(top + last_y * factor)
            size = max(to_x - at.x, 1), max(to_y - at.y, 1)
            if last_x <= first_x or last_y <= first_y or max(size) > _LARGEST_SHOWN:
                return
            part = picture.subsurface((first_x, first_y, last_x - first_x, last_y - first_y))
            shown = (pygame.transform.smoothscale if factor < 4.0 else pygame.transform.scale)(part, size)
        shown.set_alpha(round(255 * background.opacity))
        page.blit(shown, at)


def _on_white(picture: Image.Image) -> Image.Image:
    if picture.mode in ("RGBA", "LA", "PA") or "transparency" in picture.info:
        clear = picture.convert("RGBA")
        return Image.alpha_composite(Image.new("RGBA", clear.size, "white"), clear).convert("RGB")
    if picture.mode.startswith("I") or picture.mode == "F":
        values = np.asarray(picture, dtype=float)
        grey = (values - values.min()) * (255.0 / max(float(np.ptp(values)), 1e-9))
        return Image.fromarray(grey.astype(np.uint8)).convert("RGB")
    return picture.convert("RGB")


class Sheet:
    """Draws the page, and keeps it."""

    def __init__(self) -> None:
        self.outlines, self.underlaid = Outlines(), ReferenceImage()
        self._page: Surface | None = None
        self._look: object = None
        self._camera: Camera | None = None
        self._drawn: dict[int, Item] = {}
        self._beyond: surface_cache.Latest[shapely.Geometry] = surface_cache.Latest()

    def page(self, view: View, sketch: Sketch, lifted: frozenset[int] = frozenset()) -> Surface:
        """Return the page with a sketch, without the obstacles that are being dragged."""
        left, top, width, height = view.camera.view
        view = replace(view, camera=view.camera.within((left + BIAS, top + BIAS, width, height)))
        of_view = (view.camera.zoom, view.camera.view, view.theme.name, view.scale, view.size, view.grid)
        shown, below = view.shown & {"grid", "names", "picture"}, (view.folder, sketch.background)
        look = (*of_view, shown, *below, sketch.boundary, sketch.density)
        items = {i.key: i for i in sketch.obstacles if i.key not in lifted and not i.hidden}
        boxes = self._boxes(view, items) if look == self._look else None
        if self._page is None or self._page.get_size() != view.size:
            self._page = Surface(view.size, 0, 32)
        self._look, self._camera, self._drawn = look, view.camera, items
        for box in boxes if boxes is not None else [view.clip]:
            self._paint(self._page, view, sketch, items, box)
        return self._page

    def _boxes(self, view: View, items: dict[int, Item]) -> list[Rect] | None:
        """Return what is to be painted anew, after the page was moved with the camera; None where all is."""
        boxes: list[Rect] = []
        if self._camera is not None and view.camera.center != self._camera.center:
            if (moved := self._scroll(self._camera, view)) is None:
                return None
            boxes += moved
        changed = [item for key, item in self._drawn.items() if items.get(key) is not item]
        changed += [item for key, item in items.items() if self._drawn.get(key) is not item]
        edge = 2 * round(_EDGE * view.scale)
        bounds = [self.outlines.of(item).bounds for item in changed]
        boxes += [pixel_box(view.camera, b).inflate(edge, edge) for b in bounds if np.isfinite(b[0])]
        whole = view.clip
        boxes = [box for box in (each.clip(whole) for each in boxes) if box]
        if sum(box.width * box.height for box in boxes) > PATCHES * whole.width * whole.height:
            return None
        return _merged(boxes)

    def _scroll(self, camera: Camera, view: View) -> list[Rect] | None:
        """Move the page with the camera; return what came into sight, None where it cannot be moved."""
        dx, dy = (np.array(view.camera.middle) - camera.to_pixels(np.array(view.camera.center))).tolist()
        whole_x, whole_y = round(dx), round(dy)
        clip = view.clip
        far = abs(whole_x) >= clip.width / 2 or abs(whole_y) >= clip.height / 2
        if far or abs(dx - whole_x) > 0.02 or abs(dy - whole_y) > 0.02:
            return None
        assert self._page is not None
        self._page.set_clip(clip)
        self._page.scroll(whole_x, whole_y)
        self._page.set_clip(None)
        boxes = []
        if whole_x:
            left = clip.left if whole_x > 0 else clip.right + whole_x
            boxes.append(Rect(left, clip.top, abs(whole_x), clip.height))
        if whole_y:
            # beside the strip that is there already, so that the two do not overlap
            top = clip.top if whole_y > 0 else clip.bottom + whole_y
            left = clip.left + max(whole_x, 0)
            boxes.append(Rect(left, top, clip.width - abs(whole_x), abs(whole_y)))
        return boxes

    def _paint(self, page: Surface, view: View, sketch: Sketch, items: dict[int, Item], box: Rect) -> None:
        page.set_clip(box)
        theme, camera, canvas = view.theme, view.camera, view.canvas(page)
        page.fill(outside_colour(theme), box)
        ring = None
        if sketch.boundary is not None and len(sketch.boundary) > 2:
            ring = camera.to_pixels(np.asarray(sketch.boundary, dtype=float))
            canvas.polygon(ring, theme.background)
        picture = sketch.background if "picture" in view.shown else None
        if picture is not None:
            self.underlaid.draw(page, picture, view.folder, camera, view.clip)
        if "grid" in view.shown:
            self._grid(page, view, box, fine=picture is None or not picture.shown)
        density = sketch.density
        if (
            density is not None
            and not density.is_uniform
            and sketch.boundary is not None
            and ring is not None
        ):
            heatmaps.draw_shading(canvas, density, np.asarray(sketch.boundary, dtype=float))
        # what robots take for free although it lies outside the boundary: it is in their hull
        fill = mix(outside_colour(theme), theme.obstacle, 0.55)
        for part in shapely.get_parts(self._beyond.of(sketch.boundary, None, lambda: beyond(sketch))):
            if isinstance(part, shapely.Polygon):
                corners = camera.to_pixels(np.asarray(part.exterior.coords)[:-1])
                canvas.polygon(corners, fill)
                canvas.outline(corners, mix(fill, theme.obstacle_edge, 0.5), 1)
        ends = np.array([box.bottomleft, box.topright], dtype=float)
        (low_x, low_y), (high_x, high_y) = camera.to_world(ends).tolist()
        edge = _EDGE * view.scale / camera.zoom
        wanted = (low_x - edge, low_y - edge, high_x + edge, high_y + edge)
        there = [item for item in self.outlines.touching(sketch, wanted) if items.get(item.key) is item]
        if picture is None or not picture.shown:
            self.draw_items(canvas, there)
        else:
            over = Surface(box.size, pygame.SRCALPHA, 32)
            shifted = camera.within((camera.view[0] - box.x, camera.view[1] - box.y, *camera.view[2:]))
            self.draw_items(replace(canvas, surface=over, camera=shifted), there)
            over.set_alpha(round(255 * SEEN_THROUGH))
            page.blit(over, box)
        if ring is not None:
            canvas.outline(ring, theme.boundary, canvas.width(theme.boundary_line))
        if "names" in view.shown:
            self._names(canvas, there)
        page.set_clip(None)

    def _grid(self, page: Surface, view: View, box: Rect, *, fine: bool) -> None:
        theme, parts = view.theme, (0.32, 0.75) if view.theme is LIGHT else (0.2, 0.5)
        close, wide = grid_steps(view.grid, view.camera.zoom, view.scale)
        soft, strong = (mix(theme.background, theme.grid, part) for part in parts)
        low_x, low_y, high_x, high_y = view.camera.visible()
        width = max(1, round(view.scale))
        for step, colour in ((close, soft), (wide, strong))[0 if fine else 1 :]:
            xs = np.arange(np.ceil(low_x / step), np.floor(high_x / step) + 1) * step
            ys = np.arange(np.ceil(low_y / step), np.floor(high_y / step) + 1) * step
            columns = view.camera.to_pixels(np.column_stack([xs, np.zeros(len(xs))]))[:, 0]
            rows = view.camera.to_pixels(np.column_stack([np.zeros(len(ys)), ys]))[:, 1]
            for x in columns[(columns >= box.left - 2) & (columns <= box.right + 2)].tolist():
                page.fill(colour, Rect(round(x - width / 2), box.top, width, box.height))
            for y in rows[(rows >= box.top - 2) & (rows <= box.bottom + 2)].tolist():
                page.fill(colour, Rect(box.left, round(y - width / 2), box.width, width))

    def draw_items(
        self, canvas: Canvas, items: list[Item], fill: Colour | None = None, edge: Colour | None = None
    ) -> None:
        fill, edge = fill or canvas.theme.obstacle, edge or canvas.theme.obstacle_edge
        plain = [self.outlines.of(item) for item in items]
        if rings := [ring for each in plain for ring in each.rings]:
            ends: list[int] = np.cumsum([len(ring) for ring in rings]).tolist()
            corners = canvas.camera.to_pixels(np.concatenate(rings))
            fills = [fill if all(each.outer) else None for each in plain for _ in each.rings]
            canvas.polygons(corners, ends, fills)
            clip = canvas.surface.get_clip()
            for each in (each for each in plain if not all(each.outer)):
                # on a page of its own, so that what lies below shows in the holes
                own = replace(canvas, surface=Surface(clip.size, pygame.SRCALPHA, 32))
                for ring, outer in zip(each.rings, each.outer, strict=True):
                    inside = canvas.camera.to_pixels(ring) - np.array(clip.topleft)
                    own.polygon(inside, (*fill, 255) if outer else (0, 0, 0, 0))
                canvas.surface.blit(own.surface, clip, special_flags=pygame.BLEND_PREMULTIPLIED)
            _draw_rings(canvas, corners, ends, edge)
        for each in plain:
            for line in each.lines:
                points = canvas.camera.to_pixels(line)
                if len(points) > 1:
                    canvas.outline(points, canvas.theme.trajectory, canvas.width(1.5), closed=False)

    def _names(self, canvas: Canvas, items: list[Item]) -> None:
        size = canvas.text_size(canvas.theme.small_text)
        colour = mix(canvas.theme.obstacle, canvas.theme.ink, 0.9)
        for item in items:
            name, outline, zoom = item.shape.name, self.outlines.of(item), canvas.camera.zoom
            low_x, low_y, high_x, high_y = outline.bounds.tolist()
            if not name or (high_y - low_y) * zoom < size + 4 or (high_x - low_x) * zoom < 3 * size:
                continue
            x, y, room, high = outline.name_place
            words = fonts.shortened(name, size, room * zoom - _ROOM * canvas.scale)
            if high * zoom > size + 2 and (words == name or len(words) > LEAST_LETTERS):
                at = canvas.camera.to_pixels(np.array([x, y])).tolist()
                canvas.text(words, at, size=canvas.theme.small_text, colour=colour, anchor="middle")


def pixel_box(camera: Camera, bounds: Iterable[float]) -> Rect:
    """Return the pixels that bounds, m, cover, and one or two around them."""
    low_x, low_y, high_x, high_y = bounds
    ends = camera.to_pixels(np.array([[low_x, high_y], [high_x, low_y]]))
    (left, top), (right, bottom) = np.clip(ends, -30000, 30000).tolist()
    return Rect(int(left) - 1, int(top) - 1, int(right - left) + 3, int(bottom - top) + 3)


def beyond(sketch: Sketch) -> shapely.Geometry:
    """Return what of the boundary's convex hull lies outside the boundary."""
    ring = shapely.Polygon(sketch.boundary if sketch.boundary and len(sketch.boundary) > 2 else None)
    return shapely.difference(ring.convex_hull, ring) if ring.is_valid else shapely.Polygon()


def grid_steps(grid: float, zoom: float, scale: float) -> tuple[float, float]:
    """Return the distances of fine and strong lines, m: multiples of the grid, no closer than is clear."""
    least, fine = FINE * scale / zoom, grid
    if fine < least:
        times = round_length(least / grid)
        fine = grid * (times if times >= least / grid else round_length(2.5001 * times))
    times = round_length(max(COARSE * scale / zoom / fine, 1.0))
    coarse = fine * (times if times * fine >= COARSE * scale / zoom else round_length(2.5001 * times))
    return float(f"{fine:.12g}"), float(f"{coarse:.12g}")


def _draw_rings(canvas: Canvas, corners: Array, ends: list[int], colour: Colour) -> None:
    width = canvas.width(canvas.theme.line)
    if width == 1 and (not len(corners) or np.abs(corners).max() <= FAR):
        for begin, end in pairwise((0, *ends)):
            if end - begin > 1:
                pygame.draw.aalines(canvas.surface, colour, True, corners[begin:end].tolist())
        return
    following = np.arange(1, len(corners) + 1)
    following[np.array(ends) - 1] = [0, *ends[:-1]]
    edges = np.hstack([corners, corners[following]])
    clip = canvas.surface.get_clip()  # what lies beside the page would only take time
    low, high = np.minimum(edges[:, :2], edges[:, 2:]), np.maximum(edges[:, :2], edges[:, 2:])
    seen = (high[:, 0] >= clip.left - 2) & (low[:, 0] <= clip.right + 2)
    seen &= (high[:, 1] >= clip.top - 2) & (low[:, 1] <= clip.bottom + 2)
    canvas.segments(edges[seen], colour, width)


def _merged(boxes: list[Rect]) -> list[Rect]:
    """Return boxes that cover the same, no two of which overlap; fewer, where there are many."""
    merged: list[Rect] = []
    for box in boxes if len(boxes) <= 40 else [boxes[0].unionall(boxes[1:])]:
        each = box.copy()
        while (k := each.collidelist(merged)) >= 0:
            each.union_ip(merged.pop(k))
        merged.append(each)
    return merged
