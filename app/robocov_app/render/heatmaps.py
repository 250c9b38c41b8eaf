"""Heat maps: the density, distances to the nearest robot, geodesic cells and their color bar."""

import math
from collections.abc import Callable

import numpy as np
import pygame
from numpy.typing import NDArray

from robocov.arrays import Array, IntArray
from robocov.density import Density
from robocov_app.look import legend
from robocov_app.look.lengths import format_scale_length
from robocov_app.look.theme import Theme
from robocov_app.render.annotations import STRIP
from robocov_app.render.canvas import Canvas, LegendEntry
from robocov_app.render.density import colors, density_label, parts
from robocov_app.render.distance_field import Field, levels, middles, palette, strength, ticks
from robocov_app.render.layers import says
from robocov_app.render.scene import Scene
from robocov_app.render.surface_cache import LatestValue

_DOTS = 60_000  # about so many places of a surface at most where the density is looked at, not interpolated


def draw_density(canvas: Canvas, scene: Scene) -> None:
    density, hidden = (
        scene.environment.density,
        scene.field is not None and "distances" in canvas.visible_layers,
    )
    if density is not None and not density.is_uniform and not hidden:
        draw_shading(canvas, density, scene.environment.region.vertices)


def density_legend(scene: Scene) -> list[LegendEntry]:
    words = density_label(scene.environment)
    return [density_entry(words)] if words else []


def density_entry(words: str) -> LegendEntry:
    return _strip_entry(words, lambda theme, count: colors(np.linspace(0.0, 1.0, count), theme))


def _strip_entry(words: str, row: Callable[[Theme, int], NDArray[np.uint8]]) -> LegendEntry:
    def glyph(canvas: Canvas, x: float, y: float) -> None:
        wide, high = round(20 * canvas.scale), round(11 * canvas.scale)
        strip = row(canvas.theme, wide)
        picture = _colored(np.broadcast_to(strip, (high, *strip.shape)))
        canvas.surface.blit(picture, (round(x - wide / 2), round(y - high / 2)))

    return LegendEntry(words, glyph)


def draw_shading(canvas: Canvas, density: Density, ring: Array) -> None:
    """Draw the density within a ring, (k, 2) m; drawn in parts, as the clip says, it is the same picture."""
    (low_x, low_y), (high_x, high_y) = ring.min(axis=0).tolist(), ring.max(axis=0).tolist()
    ends = canvas.camera.to_pixels(np.array([[low_x, high_y], [high_x, low_y]]))
    (left, top), (right, bottom) = np.clip(ends, -30000, 30000).astype(int).tolist()
    box = pygame.Rect(left - 1, top - 1, right - left + 3, bottom - top + 3).clip(canvas.surface.get_clip())
    if not box.width or not box.height:
        return
    wide, high = canvas.surface.get_size()
    step = max(1, math.ceil(math.sqrt(wide * high / _DOTS)))
    columns, across = _dots(box.left, box.width, step)
    rows, down = _dots(box.top, box.height, step)
    x, y = _to_world(canvas, columns, rows)
    coarse = 255.0 * parts(density, (low_x, low_y, high_x, high_y), x, y)
    table = colors(np.arange(256) / 255.0, canvas.theme).astype(np.uint16)
    table[:, :3] = table[:, :3] * table[:, 3:] // 255
    page = _colored(table.astype(np.uint8)[np.rint(down(across(coarse.T).T)).astype(np.uint8)])
    corners = canvas.camera.to_pixels(ring) - np.array(box.topleft)
    mask = pygame.Surface(box.size, pygame.SRCALPHA, 32)
    pygame.draw.polygon(mask, (255, 255, 255, 255), np.rint(np.clip(corners, -3e4, 3e4)).tolist())
    page.blit(mask, (0, 0), special_flags=pygame.BLEND_RGBA_MULT)
    canvas.surface.blit(page, box.topleft, special_flags=pygame.BLEND_PREMULTIPLIED)


def _dots(begin: int, count: int, step: int) -> tuple[Array, Callable[[Array], Array]]:
    """Return where the density is looked at along an axis, (d,) px, and what interpolates (d, k) values."""
    place = (begin + np.arange(count) + 0.5) / step - 0.5
    first = np.floor(place).astype(np.intp)

    def between(values: Array) -> Array:
        before, after = values[first - first[0]], values[first - first[0] + 1]
        return np.asarray(before + (place - first)[:, None] * (after - before))

    return (np.arange(first[0], first[-1] + 2) + 0.5) * step, between


def _to_world(canvas: Canvas, columns: Array | IntArray, rows: Array | IntArray) -> tuple[Array, Array]:
    x = canvas.camera.to_world(np.column_stack([columns, np.zeros(len(columns))]))[:, 0]
    return x, canvas.camera.to_world(np.column_stack([np.zeros(len(rows)), rows]))[:, 1]


_BAR = 12.0  # width of the scale of colors in pixels at scale 1
_BESIDE = 8.0  # pixels between it and what is beside it
_BORDER = 1.6  # width of the borders of geodesic cells
_HATCH = 5  # pixels of the coarse picture from one slanted line to the next


def field_drawing(
    draw_picture: Callable[[Canvas, Scene, Field, Array, Array], pygame.Surface],
) -> Callable[[Canvas, Scene], None]:
    """Return what draws a field, by `draw_picture` at (w,) x and (h,) y m, when field or view change."""
    kept = LatestValue[pygame.Surface]()

    def draw(canvas: Canvas, scene: Scene) -> None:
        field, camera = scene.field, canvas.camera
        low_x, low_y, high_x, high_y = scene.environment.region.bounds
        begin, end = camera.to_pixels(np.array([[low_x, high_y], [high_x, low_y]]))
        # those of the view's pixels that show the region
        begin = np.maximum(np.floor(begin), np.floor(camera.view[:2])).astype(int)
        end = np.minimum(np.ceil(end), np.ceil(np.add(camera.view[:2], camera.view[2:]))).astype(int) + 1
        if field is None or (end <= begin).any():
            return
        corner = begin.tolist()
        key = (corner, end.tolist(), scene.field_limit, camera, canvas.theme.name, canvas.scale)

        def picture() -> pygame.Surface:
            x, y = _to_world(canvas, np.arange(begin[0], end[0]), np.arange(begin[1], end[1]))
            return draw_picture(canvas, scene, field, x, y)

        look = (*key, canvas.hues.tolist(), "distances" in canvas.visible_layers)
        canvas.surface.blit(kept.get(field, look, picture), corner)
        # cover what lies outside the region, one edge after the other
        corners = camera.to_pixels(scene.environment.region.vertices)
        far = 4.0 * (np.ptp(corners, axis=0).sum() + sum(canvas.surface.get_size()))
        for start, stop in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            along = far * (stop - start) / max(float(np.hypot(*(stop - start))), 1e-9)
            # pixels run downwards, so that outside is on the other hand
            outward = np.array([-along[1], along[0]])
            ring = [start - along, stop + along, stop + along + outward, start - along + outward]
            canvas.fill_polygon(np.array(ring), canvas.theme.background)

    return draw


def draw_distances(canvas: Canvas, scene: Scene, field: Field, x: Array, y: Array) -> pygame.Surface:
    # smooth as it is, every second pixel will do
    coarse = levels(field, middles(x, 2), middles(y, 2), scene.field_limit, _HATCH)
    small = _paletted(coarse, palette(canvas.theme)).convert(canvas.surface)
    large = pygame.transform.smoothscale(small, (2 * small.get_width(), 2 * small.get_height()))
    return large.subsurface((0, 0, len(x), len(y)))


unreached_legend = says(
    legend.UNREACHED,
    lambda canvas, x, y: canvas.draw_swatch(x, y, canvas.theme.unreached, canvas.theme.obstacle_edge),
    lambda scene: scene.field is not None and bool((scene.field.result.owner < 0).any()),
)


def distances_legend(scene: Scene) -> list[LegendEntry]:
    return [_strip_entry("distance to the nearest robot", Theme.build_heat_table), *unreached_legend(scene)]


def draw_geodesic_cells(canvas: Canvas, scene: Scene, field: Field, x: Array, y: Array) -> pygame.Surface:
    """Return which robot is nearest, around obstacles: the cells that the coverage cost really sums over."""
    theme, zoom, width = canvas.theme, canvas.camera.zoom, _BORDER * canvas.scale
    within = (0.5 * width + 1.0) / zoom
    if "distances" in canvas.visible_layers:
        borders = field.borders(x, y, within)
        lines = pygame.Surface((len(x), len(y)), pygame.SRCALPHA, 32)
        lines.fill((*theme.geodesic_border, 0))
        alpha = np.rint(255.0 * strength(borders, zoom, width))
        pygame.surfarray.pixels_alpha(lines)[borders.column, borders.row] = alpha
        # what is empty is passed over
        lines.set_alpha(255, pygame.RLEACCEL)
        return lines
    # nobody, number -1, is the last
    tints = [*(theme.get_cell_color(hue) for hue in range(len(theme.robots))), theme.unreached]
    numbers = np.append(canvas.hues, len(tints) - 1).astype(np.uint8)
    owners, borders = field.cells(x, y, within)
    fills = np.array(tints, dtype=np.uint8)
    cells = _paletted(numbers.take(owners, mode="wrap"), fills).convert(canvas.surface)
    pixels = pygame.surfarray.pixels3d(cells)
    at, part = (borders.column, borders.row), strength(borders, zoom, width)[:, None]
    pixels[at] = np.rint((1.0 - part) * pixels[at] + part * np.array(theme.geodesic_border))
    del pixels  # which keeps the surface locked
    return cells


geodesic_legend = says(
    legend.GEODESIC_BORDER,
    lambda canvas, x, y: canvas.draw_line(
        *canvas.get_symbol_line(x, y, 8), canvas.theme.geodesic_border, canvas.scale_width(_BORDER)
    ),
)


def draw_color_bar(canvas: Canvas, scene: Scene) -> None:
    if "distances" not in canvas.visible_layers:
        return
    scale, theme, width = canvas.scale, canvas.theme, canvas.scale_width(1.0)
    _, top, _, height = canvas.camera.view
    room = canvas.surface.get_height() - STRIP * scale - top
    high = max(round(min(0.72 * min(height, room), 300 * scale)), 2)
    wide = round(_BAR * scale)
    left = round(canvas.surface.get_width() - bar_room(canvas, scene) + _BESIDE * scale)
    upper = round(top + (min(height, room) - high) / 2)
    colors = np.broadcast_to(theme.build_heat_table(high)[::-1, None], (high, wide, 3))
    canvas.surface.blit(_colored(colors), (left, upper))
    pygame.draw.rect(canvas.surface, theme.faint, (left, upper, wide, high), width)
    for mark, text in _marks(scene):
        y = upper + high * (1.0 - mark / scene.field_limit)
        canvas.surface.fill(theme.faint, (left + wide, round(y - 0.5 * width), round(4 * scale), width))
        canvas.draw_text(text, (left + wide + _BESIDE * scale, y), size=theme.small_text)


def bar_room(canvas: Canvas, scene: Scene) -> float:
    """Return how many pixels the scale of colors takes at the right, 0 where it is not shown."""
    if scene.field is None or not {"distances", "color_bar"} <= canvas.visible_layers:
        return 0.0
    words = max(canvas.measure_text(text, canvas.theme.small_text) for _, text in _marks(scene))
    return (_BAR + 3.0 * _BESIDE) * canvas.scale + words


def _marks(scene: Scene) -> list[tuple[float, str]]:
    assert scene.field is not None
    marks = ticks(scene.field_limit)
    words = ["0", *(format_scale_length(mark) for mark in marks[1:])]
    if scene.field.largest > scene.field_limit * (1.0 + 1e-9):
        words[-1] = f"≥ {words[-1]}"
    return list(zip(marks, words, strict=True))


def _paletted(numbers: NDArray[np.uint8], colors: NDArray[np.uint8]) -> pygame.Surface:
    height, width = numbers.shape
    surface = pygame.image.frombytes(numbers.tobytes(), (width, height), "P")
    surface.set_palette([tuple(color) for color in colors.tolist()])
    return surface


def _colored(picture: NDArray[np.uint8]) -> pygame.Surface:
    """Return (h, w, 3) RGB, or (h, w, 4) RGBA, as a surface."""
    height, width, depth = picture.shape
    return pygame.image.frombytes(picture.tobytes(), (width, height), "RGBA"[:depth])  # type: ignore[arg-type]
