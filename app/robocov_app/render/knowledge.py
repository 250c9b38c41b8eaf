"""Layers of what robots know: ray scans, sensed obstacle points, the discovered map, the cursor's path."""

from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np
import pygame

from robocov.arrays import Array
from robocov.planning.discovered_map import PRESUMED_WALL, UNKNOWN, WALL, DiscoveredMap
from robocov_app.look.colors import Color, mix
from robocov_app.render import sprites
from robocov_app.render.canvas import Canvas, premultiply
from robocov_app.render.clipping import clip_polygon, clip_segment, limit_pixels
from robocov_app.render.layers import draw_blocked, draw_boundary, says
from robocov_app.render.marks import drawn_radii
from robocov_app.render.scene import Scene

_OPACITY = {UNKNOWN: 0.28, PRESUMED_WALL: 0.45, WALL: 0.85}  # of the colors of cells; free ones are clear


def discovered_map(scene: Scene) -> DiscoveredMap | None:
    """Return the map of the robot that is asked about, None where its controller remembers none."""
    maps = () if scene.snapshot is None else getattr(scene.snapshot.decision.memory, "maps", ())
    known = maps[scene.selected] if scene.selected is not None and scene.selected < len(maps) else None
    return known if isinstance(known, DiscoveredMap) else None


def draw_discovered(canvas: Canvas, known: DiscoveredMap) -> None:
    """Draw what is in view of a discovered map: unknown cells veiled, walls as sensed, outside nothing."""
    raster = known.raster
    view = canvas.surface.get_clip()
    corners = np.array([view.topleft, view.bottomright], dtype=float)
    row, column = raster.find_cells(canvas.camera.to_world(corners))
    seen = slice(row.min(), row.max() + 1), slice(column.min(), column.max() + 1)
    state, outside = np.minimum(known.state[seen], WALL), raster.is_outside[seen]
    pixels = np.zeros((*state.shape, 4), dtype=np.uint8)
    for value, opacity in _OPACITY.items():
        color = canvas.theme.obstacle if value == UNKNOWN else canvas.theme.forces["repulsion_obstacle"]
        pixels[(state == value) & ~outside] = premultiply(color, opacity)
    ends = np.array([[column.min(), row.min()], [column.max() + 1, row.max() + 1]])
    ends = canvas.camera.to_pixels(np.array(raster.origin) + ends * raster.cell_size)
    (left, bottom), (right, top) = ends.round().astype(int).tolist()
    if right <= left or bottom <= top:
        return
    # the lowest row comes first, in a picture the highest
    upright = np.ascontiguousarray(pixels[::-1])
    picture = pygame.image.frombuffer(upright.tobytes(), (state.shape[1], state.shape[0]), "RGBA")
    scaled = pygame.transform.scale(picture, (right - left, bottom - top))
    canvas.surface.blit(scaled, (left, top), special_flags=pygame.BLEND_PREMULTIPLIED)


_FINE = 2  # scans are drawn so many times larger and shrunk: hundreds of smooth lines would take far longer
_RAY_GAP = 5.0  # least pixels between rays at scale 1: nearer to the robot every second one is left out
_PALE = 0.3  # how much of its color is left of an obstacle that nobody has sensed
_DOT = 2.1  # radius of a sensed point in pixels at scale 1
_HIT = 1.5  # radius of the end of a ray in pixels at scale 1


def _dots(canvas: Canvas, centers: Array, radius: float, color: Color) -> None:
    """Draw a dot at each of (n, 2) px; thousands at once, and one only where several are the same."""
    different = np.unique(np.rint((centers + 0.5) * sprites.FINENESS), axis=0) / sprites.FINENESS - 0.5
    canvas.draw_sprites([partial(sprites.render_dot, radius, color)], different)


def draw_scans(canvas: Canvas, scene: Scene) -> None:
    """Draw what a range sensor measures all around: what it looks over, its rays, and dots where they hit."""
    camera, color = canvas.camera, canvas.theme.final
    scans = [(camera.to_pixels(place), camera.to_pixels(ends)) for place, ends in scene.scans]
    box = sprites.find_visible_box(
        limit_pixels(np.concatenate([ends for _, ends in scans])), 3.0, canvas.surface
    )
    if box is None:
        return
    sketch = sprites.Sketch(box, _FINE)
    # drawing replaces what is there: where scans overlap nothing gets darker
    corner = np.array(box.topleft) - 0.5
    fine = [((place - corner) * _FINE, (ends - corner) * _FINE) for place, ends in scans]
    outlines = [ring for _, ends in fine for ring in clip_polygon(ends)]
    for ring in outlines:
        pygame.draw.polygon(sketch.large, premultiply(color, 0.11), np.rint(ring).tolist())
    for place, ends in fine:
        _draw_rays(sketch.large, place, ends, canvas)
    for ring in outlines:
        pygame.draw.lines(sketch.large, premultiply(color, 0.4), True, ring.tolist(), _FINE)
    sketch.draw_on(canvas.surface)
    far = [np.hypot(*(ends - place).T) for place, ends in scans]
    hits = [ends[length < length.max() * (1.0 - 1e-6)] for (_, ends), length in zip(scans, far, strict=True)]
    _dots(canvas, np.concatenate(hits), _HIT * canvas.scale, color)


def _draw_rays(large: pygame.Surface, place: Array, ends: Array, canvas: Canvas) -> None:
    along = ends - place
    length = np.hypot(along[:, 0], along[:, 1])
    ray = np.arange(len(ends))
    begin = np.full(len(ends), _RAY_GAP * len(ends) / (2 * np.pi))
    for every in (2, 4, 8):
        begin[ray % every == 0] /= 2
    begin = np.maximum(begin, 12.0) * canvas.scale * _FINE
    shown = length > begin + _FINE
    first = place + along[shown] * (begin[shown] / length[shown])[:, None]
    color = premultiply(canvas.theme.final, 0.3)
    width = max(1, round(0.5 * canvas.scale * _FINE))
    for line in zip(first.tolist(), ends[shown].tolist(), strict=True):
        if seen := clip_segment(*line):
            pygame.draw.line(large, color, seen[0], seen[1], width)


def _scan_glyph(canvas: Canvas, x: float, y: float) -> None:
    color, size = canvas.theme.final, 8 * canvas.scale
    angle = np.array([-0.6, -0.3, 0.0, 0.3, 0.6])
    ends = np.column_stack([x - size + 2 * size * np.cos(angle), y + 1.15 * size * np.sin(angle)])
    for end in ends.tolist():
        canvas.draw_line((x - size, y), end, mix(canvas.theme.background, color, 0.55))
    _dots(canvas, ends, _HIT * canvas.scale, color)


scans_legend = says("ray scan", _scan_glyph)


class SensedObstacles:
    """Sensed points, of the selected robot or of all, over a paler map; and its discovered map."""

    def __init__(self) -> None:
        self._page = pygame.Surface((0, 0))
        self._key: object = None
        self._of: tuple[object, object] = (None, None)
        self._drawn = np.empty((0, 2))

    def draw(self, canvas: Canvas, scene: Scene) -> None:
        assert scene.sensed is not None
        points, robots = scene.sensed.get_until(scene.now.time)
        asked = None if scene.selected is None else scene.get_number(scene.selected)
        size, clip = canvas.surface.get_size(), canvas.surface.get_clip()
        key = canvas.camera, canvas.theme.name, canvas.scale, size, tuple(clip), canvas.visible_layers, asked
        # objects rather than their ids, which others may get when these are gone
        known = self._of[0] is scene.environment and self._of[1] is scene.sensed
        begin = len(self._drawn)
        if not known or self._key != key or not np.array_equal(points[begin - 1 : begin], self._drawn[-1:]):
            self._page, begin = pygame.Surface(size, pygame.SRCALPHA, 32), 0
            self._page.set_clip(clip)
            if "obstacles" in canvas.visible_layers:
                fill, edge = _pale_colors(canvas)
                draw_blocked(replace(canvas, surface=self._page), scene, fill, fill, edge)
                if "boundary" in canvas.visible_layers:  # what of it was covered
                    draw_boundary(replace(canvas, surface=self._page), scene)
        if begin < len(points):
            fresh = points[begin:] if asked is None else points[begin:][robots[begin:] == asked]
            page, color = replace(canvas, surface=self._page), canvas.theme.forces["repulsion_obstacle"]
            _dots(page, canvas.camera.to_pixels(fresh), _DOT * canvas.scale, color)
        self._key, self._of, self._drawn = key, (scene.environment, scene.sensed), points
        canvas.surface.blit(self._page, (0, 0), special_flags=pygame.BLEND_PREMULTIPLIED)
        if (discovered := discovered_map(scene)) is not None:
            draw_discovered(canvas, discovered)


def _pale_colors(canvas: Canvas) -> tuple[Color, Color]:
    """Return fill and edge of obstacles that are there, but not known."""
    theme = canvas.theme
    return mix(theme.background, theme.obstacle, _PALE), mix(theme.background, theme.obstacle_edge, 0.6)


def _sensed_glyph(canvas: Canvas, x: float, y: float) -> None:
    half, top = 8 * canvas.scale, y - 2 * canvas.scale
    fill, edge = _pale_colors(canvas)
    box = pygame.Rect(round(x - half), round(top), round(2 * half), round(6 * canvas.scale))
    pygame.draw.rect(canvas.surface, fill, box)
    pygame.draw.rect(canvas.surface, edge, box, canvas.scale_width(1.0))
    dots = np.column_stack([x + half * np.array([-0.9, -0.3, 0.3, 0.9]), np.full(4, top)])
    _dots(canvas, dots, _DOT * canvas.scale, canvas.theme.forces["repulsion_obstacle"])


sensed_legend = says("known obstacles", _sensed_glyph)


def draw_path(canvas: Canvas, scene: Scene) -> None:
    assert scene.path is not None
    if len(scene.path) < 2:
        return
    corners, theme = canvas.camera.to_pixels(scene.path), canvas.theme
    # the light around it parts it from whatever it crosses
    canvas.draw_outline(corners, theme.background, canvas.scale_width(4.5), is_closed=False)
    canvas.draw_outline(corners, theme.final, canvas.scale_width(2.0), is_closed=False)
    _draw_path_begin(canvas, *corners[0].tolist())
    length = float(np.hypot(*np.diff(scene.path, axis=0).T).sum())
    words = f"{length:.2f} m" if length < 100 else f"{length:.0f} m"
    box = _tag_box(canvas, scene, corners, canvas.measure_text(words, bold=True))
    radius = round(4 * canvas.scale)
    pygame.draw.rect(canvas.surface, theme.background, box, border_radius=radius)
    edge = mix(theme.background, theme.final, 0.5)
    pygame.draw.rect(canvas.surface, edge, box, canvas.scale_width(1.0), border_radius=radius)
    canvas.draw_text(words, box.center, color=theme.final, bold=True, anchor="middle")


def _tag_box(canvas: Canvas, scene: Scene, corners: Array, wide: int) -> pygame.Rect:
    """Return the box of the tag: beside the cursor, where it hides least of path and robots."""
    view, scale = canvas.surface.get_clip(), canvas.scale
    box = pygame.Rect(0, 0, wide + round(12 * scale), round(20 * scale))
    x, y = corners[0].tolist()
    radii = drawn_radii(canvas, scene)
    centers = canvas.camera.to_pixels(scene.snapshot.positions if scene.snapshot else np.empty((0, 2)))
    path = limit_pixels(corners).tolist()
    places = []
    # not below at the right first: the arrow of the cursor is there
    for side, up in ((1, -1), (-1, -1), (-1, 1), (1, 1)):
        away = 14 if (side, up) == (1, 1) else 6
        box.centerx = round(x + side * (box.width / 2 + away * scale))
        box.centery = round(y + up * (box.height / 2 + away * scale))
        placed = box.clamp(view)
        hidden = 4 * (placed != box)
        hidden += 4 * sum(bool(placed.clipline(a, b)) for a, b in pairwise(path))
        outside = np.maximum(np.maximum(placed.topleft - centers, centers - placed.bottomright), 0.0)
        hidden += int((np.hypot(*outside.T) < radii).sum())
        places.append((hidden, placed))
    return min(places, key=lambda each: each[0])[1]


def _draw_path_begin(canvas: Canvas, x: float, y: float) -> None:
    canvas.draw_sprite(partial(sprites.render_dot, 5.0 * canvas.scale, canvas.theme.background), (x, y))
    canvas.draw_sprite(partial(sprites.render_dot, 3.6 * canvas.scale, canvas.theme.final), (x, y))


def _path_glyph(canvas: Canvas, x: float, y: float) -> None:
    canvas.draw_line(*canvas.get_symbol_line(x, y, 9), canvas.theme.final, canvas.scale_width(2.0))
    _draw_path_begin(canvas, x - 9 * canvas.scale + 2 * canvas.scale, y)


path_legend = says(
    "shortest path to the nearest robot",
    _path_glyph,
    lambda scene: scene.path is not None and len(scene.path) > 1,
)
