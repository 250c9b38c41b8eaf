"""The canvas: a surface with a camera and a theme, and the strokes that layers are made of."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import TypeAlias

import numpy as np
import pygame
import shapely

from robocov.arrays import Array, IntArray
from robocov_app.look.colors import Color
from robocov_app.look.theme import Theme
from robocov_app.render import sprites
from robocov_app.render.camera import Camera
from robocov_app.render.fonts import label, text_width
from robocov_app.render.sprites import Pixel

FAR = 20000.0  # pixels. Products of twice this still fit 32 bits.


def bounded(points: Array) -> Array:
    """Return (..., 2) pixels, those farther out than `FAR` moved to it: for what is not seen there anyway."""
    return np.clip(points, -FAR, FAR)


def clipped_polygon(corners: Array) -> list[Array]:
    """Return the rings of what of the (k, 2) px polygon lies within `FAR`: mostly the one given."""
    if len(corners) < 3:
        return []
    if np.abs(corners).max() <= FAR:
        return [corners]
    inside = shapely.clip_by_rect(shapely.Polygon(corners), -FAR, -FAR, FAR, FAR)
    parts = [part for part in shapely.get_parts(inside) if isinstance(part, shapely.Polygon)]
    return [np.asarray(part.exterior.coords)[:-1] for part in parts if not part.is_empty]


def clipped_segment(start: Pixel, end: Pixel) -> Sequence[Pixel]:
    """Return the ends of what of a segment lies within `FAR`, none when nothing does."""
    (x1, y1), (x2, y2) = start, end
    if max(abs(x1), abs(y1), abs(x2), abs(y2)) <= FAR:
        return start, end
    if min(x1, x2) > FAR or max(x1, x2) < -FAR or min(y1, y2) > FAR or max(y1, y2) < -FAR:
        return []
    inside = shapely.clip_by_rect(shapely.LineString([start, end]), -FAR, -FAR, FAR, FAR)
    ends: list[Pixel] = shapely.get_coordinates(inside).tolist()
    return ends


Sprite: TypeAlias = Callable[[tuple[int, int]], pygame.Surface]  # for a shift in quarters of a pixel
Placed: TypeAlias = list[tuple[pygame.Surface, tuple[int, int]]]  # pictures and their corners, px
Glyph: TypeAlias = Callable[["Canvas", float, float], None]  # around a pixel, in 22 x 14 px at scale 1


def premultiplied(color: Color, alpha: float) -> tuple[int, int, int, int]:
    """Return a color as ``BLEND_PREMULTIPLIED`` takes it; `alpha` is 0 to 1."""
    red, green, blue = (round(c * alpha) for c in color)
    return red, green, blue, round(255 * alpha)


@dataclass(frozen=True)
class LegendEntry:
    """A line of the legend; `style` differs where the same words stand beside another glyph."""

    text: str
    draw: Glyph
    style: str = ""

    def key(self) -> tuple[str, str]:
        return self.text, self.style


@dataclass(frozen=True, eq=False)
class Canvas:
    """Drawing target; `scale` multiplies the theme's sizes, `hues` (n,) index its colors of robots."""

    surface: pygame.Surface
    camera: Camera
    theme: Theme
    scale: float
    hues: IntArray
    shown: frozenset[str] = frozenset()
    legend: Sequence[LegendEntry] = ()

    def width(self, pixels: float) -> int:
        """Return a stroke's width of `pixels` at scale 1: whole pixels, at least one."""
        return max(1, round(pixels * self.scale))

    def text_size(self, pixels: float) -> int:
        return max(7, round(pixels * self.scale))

    def polygon(self, corners: Array, fill: Color | tuple[int, int, int, int]) -> None:
        for ring in clipped_polygon(corners):
            pygame.draw.polygon(self.surface, fill, np.rint(ring).tolist())

    def polygons(
        self, corners: Array, ends: Sequence[int], fills: Sequence[Color | None], edge: Color | None = None
    ) -> None:
        """Fill polygons, one after the other in (k, 2) px corners up to each of the `ends`."""
        far = len(corners) > 0 and np.abs(corners).max() > FAR
        points, draw, begin = np.rint(corners).tolist(), pygame.draw.polygon, 0
        for end, fill in zip(ends, fills, strict=True):
            for color, width in ((fill, 0), (edge, self.width(1.0))):
                if color is None or end - begin < 3:
                    continue
                if not far:
                    draw(self.surface, color, points[begin:end], width)
                elif width:
                    self.outline(corners[begin:end], color, width)
                else:
                    self.polygon(corners[begin:end], color)
            begin = end

    def outline(self, corners: Array, color: Color, width: int = 1, closed: bool = True) -> None:
        points = corners.tolist()
        for start, end in pairwise([*points, *points[:1]] if closed else points):
            self.line(start, end, color, width)
        if width > 2:  # lines have straight ends: fill the corners' notches
            for point in points:
                self.stamp(partial(sprites.dot, width / 2 - 0.5, color), point)

    def line(self, start: Pixel, end: Pixel, color: Color, width: int = 1) -> None:
        if ends := clipped_segment(start, end):
            pygame.draw.aaline(self.surface, color, ends[0], ends[1], width)

    def thin_path(self, points: Sequence[Pixel], color: Color, closed: bool = False) -> None:
        """Draw a smooth line of one pixel through points within `FAR`."""
        if len(points) == 2:
            # With two points, aalines of pygame-ce 2.5 reads memory beyond them: frames would vary.
            pygame.draw.aaline(self.surface, color, points[0], points[1])
        else:
            pygame.draw.aalines(self.surface, color, closed, points)

    def segments(self, ends: Array, color: Color, width: int = 1) -> None:
        """Draw many smooth lines, (k, 4) px: x and y of one end, then of the other."""
        far = len(ends) > 0 and np.abs(ends).max() > FAR
        for x1, y1, x2, y2 in ends.tolist():
            if far:
                self.line((x1, y1), (x2, y2), color, width)
            else:
                pygame.draw.aaline(self.surface, color, (x1, y1), (x2, y2), width)

    def dashes(self, start: Pixel, end: Pixel, color: Color, width: int = 1, dash: float = 5.0) -> None:
        if not (ends := clipped_segment(start, end)):
            return
        a, b = map(np.array, ends)
        count = max(1, round(float(np.hypot(*(b - a))) / (2 * dash * self.scale)))
        for k in range(count):
            first, last = a + (b - a) * (k / count), a + (b - a) * ((k + 0.55) / count)
            pygame.draw.aaline(self.surface, color, first.tolist(), last.tolist(), width)

    def circle(self, center: Pixel, radius: float, color: Color, dashed: bool = False) -> None:
        sides = int(min(max(radius, 24), 720)) // 2 * 2
        angle = np.arange(sides + 1) * (2 * np.pi / sides)
        corners = np.asarray(center) + radius * np.column_stack([np.cos(angle), np.sin(angle)])
        for start, end in list(pairwise(corners.tolist()))[:: 2 if dashed else 1]:
            self.line(start, end, color, self.width(1.0))

    def level(self, x: float, y: float, half: float) -> tuple[Pixel, Pixel]:
        """Return the ends of a level stroke for the legend, around a pixel; `half` its length at scale 1."""
        return (x - half * self.scale, y), (x + half * self.scale, y)

    def swatch(self, x: float, y: float, fill: Color | None, edge: Color) -> None:
        size = 11 * self.scale
        box = pygame.Rect(round(x - size / 2), round(y - size / 2), round(size), round(size))
        if fill is not None:
            pygame.draw.rect(self.surface, fill, box)
        pygame.draw.rect(self.surface, edge, box, self.width(1.0))

    def arrow(self, start: Pixel, end: Pixel, color: Color, width: float, head: str = "full") -> None:
        """Draw an arrow with a head that is ``full`` or ``open``, a ``dot`` or a ``bar``."""
        a, b = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
        length = float(np.hypot(*(b - a)))
        if length < 1.0 or ((a <= -500.0) | (a >= np.add(self.surface.get_size(), 500.0))).any():
            return
        along = (b - a) / length
        across = np.array([-along[1], along[0]])
        size = min(2.6 * width + 4 * self.scale, length)
        left, right = b - size * along + 0.48 * size * across, b - size * along - 0.48 * size * across
        shaft = [a, b - 0.7 * size * along] if head == "full" else [a, b]
        if head == "bar":
            left, right = (b + side * (1.1 * width + 1.7 * self.scale) * across for side in (-1, 1))
        barbs = np.array([left, right] if head == "bar" else [left, b, right]).tolist()
        sketch = sprites.Sketch.around([a.tolist(), *barbs], 2 * width)
        if sketch is None:
            return
        sketch.path(np.array(shaft).tolist(), color, width)
        if head == "full":
            sketch.polygon(barbs, color)
        elif head == "dot":
            sketch.dot(barbs[1], 1.5 * width, color)
        else:
            sketch.path(barbs, color, width)
        sketch.onto(self.surface)

    def stamp(self, sprite: Sprite, center: Pixel) -> None:
        self.stamps([sprite], np.array([center], dtype=float))

    def stamps(self, some: Sequence[Sprite], centers: Array, which: IntArray | None = None) -> None:
        """Put sprites at (n, 2) px, to a quarter of a pixel: number `which`, (n,), or all the first."""
        self.surface.fblits(self.placed(some, centers, which), pygame.BLEND_PREMULTIPLIED)

    def placed(self, some: Sequence[Sprite], centers: Array, which: IntArray | None = None) -> Placed:
        far = np.add(self.surface.get_size(), 500)
        near = np.flatnonzero(((centers > -500) & (centers < far)).all(axis=1))
        # as for lines, whole numbers are the middles of pixels
        places, shifts = np.divmod(np.rint((centers[near] + 0.5) * sprites.FINE).astype(int), sprites.FINE)
        number = np.zeros(len(near), dtype=int) if which is None else which[near]
        known: dict[tuple[int, int, int], tuple[pygame.Surface, int]] = {}
        pictures = []
        columns = *places.T.tolist(), number.tolist(), *shifts.T.tolist()
        for x, y, sprite, right, down in zip(*columns, strict=True):
            if (look := (sprite, right, down)) not in known:
                picture = some[sprite]((right, down))
                known[look] = picture, picture.get_width() // 2
            picture, half = known[look]
            pictures.append((picture, (x - half, y - half)))
        return pictures

    def text(
        self,
        text: str,
        at: Pixel,
        *,
        size: float | None = None,
        color: Color | None = None,
        bold: bool = False,
        anchor: str = "left",
    ) -> int:
        """Write one line with its left, middle or right (`anchor`) at a pixel; return its width in pixels."""
        pixels = self.text_size(self.theme.text if size is None else size)
        picture = label(text, pixels, color or self.theme.ink, bold)
        width, height = picture.get_size()
        left = at[0] - {"left": 0.0, "middle": width / 2, "right": float(width)}[anchor]
        self.surface.blit(picture, (round(left), round(at[1] - height / 2)))
        return width

    def text_width(self, text: str, size: float | None = None, bold: bool = False) -> int:
        return text_width(text, self.text_size(self.theme.text if size is None else size), bold)
