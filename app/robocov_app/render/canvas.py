"""The canvas: a surface with a camera and a theme, and the strokes from which layers are drawn."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Literal, TypeAlias

import numpy as np
import pygame

from robocov.typing import FloatArray, IntArray
from robocov_app.look.colors import Color
from robocov_app.look.theme import Theme
from robocov_app.render import sprites
from robocov_app.render.camera import Camera
from robocov_app.render.clipping import clip_polygon, clip_segment, is_within_limit
from robocov_app.render.fonts import measure_text, render_text
from robocov_app.render.sprites import Pixel

_MIN_TEXT_PX = 7
_DASH_FRACTION = 0.55
"""Length of a dash, as a fraction of the distance from one to the next."""
_MIN_CIRCLE_SIDES = 24
_MAX_CIRCLE_SIDES = 720
_SWATCH_PX = 11
_HEAD_LENGTH_FACTOR = 2.6
_MIN_HEAD_LENGTH_PX = 4
"""The head of an arrow is this long for a shaft of width 0, and longer by the factor times the width."""
_HEAD_WIDTH_FACTOR = 0.48
"""Half the width of the head of an arrow, as a fraction of its length."""
_SHAFT_INSET_FACTOR = 0.7
"""Part of a full head that the shaft does not reach, so that its blunt end does not show at the tip."""
_BAR_FACTOR = 1.1
_MIN_HALF_BAR_PX = 1.7
"""Half the length of the bar at the end of an arrow, for a shaft of width 0; the factor is as for heads."""
_DOT_FACTOR = 1.5
"""Radius of the dot at the end of an arrow, compared with the width of the shaft."""
_OUTSIDE_PX = 500
"""Sprites and arrows that start farther outside the surface are left out."""

Sprite: TypeAlias = Callable[[tuple[int, int]], pygame.Surface]
"""Renders a small picture, shifted to the right and down by quarters of a pixel."""
PlacedSprites: TypeAlias = list[tuple[pygame.Surface, tuple[int, int]]]
"""Pictures and their upper left corners, px."""
Glyph: TypeAlias = Callable[["Canvas", float, float], None]
"""Draws a symbol of a legend around a pixel, in 22 x 14 px at scale 1."""
ArrowHead: TypeAlias = Literal["full", "open", "dot", "bar"]
TextAnchor: TypeAlias = Literal["left", "middle", "right"]


def premultiply(color: Color, alpha: float) -> tuple[int, int, int, int]:
    """Return the RGBA color, premultiplied by an opacity from 0 to 1, for ``BLEND_PREMULTIPLIED``."""
    red, green, blue = (round(channel * alpha) for channel in color)
    return red, green, blue, round(255 * alpha)


@dataclass(frozen=True)
class LegendEntry:
    """An entry of a legend.

    Attributes
    ----------
    text : str
    draw : Glyph
        Draws its symbol.
    style : str
        Distinguishes entries that have the same text but different symbols.
    """

    text: str
    draw: Glyph
    style: str = ""

    @property
    def key(self) -> tuple[str, str]:
        """Text and style; entries with the same key look alike."""
        return self.text, self.style


@dataclass(frozen=True, eq=False)
class Canvas:
    """A surface with a camera, a theme and a scale, on which layers are drawn.

    Attributes
    ----------
    surface : pygame.Surface
    camera : Camera
    theme : Theme
    scale : float
        Factor of the sizes of the theme.
    hues : (n,) int array
        Hue of each robot, an index into `Theme.robots`.
    visible_layers : frozenset of str
        Names of the layers that are drawn.
    legend : sequence of LegendEntry
        Entries of the legend.
    """

    surface: pygame.Surface
    camera: Camera
    theme: Theme
    scale: float
    hues: IntArray
    visible_layers: frozenset[str] = frozenset()
    legend: Sequence[LegendEntry] = ()

    def scale_width(self, pixels: float) -> int:
        """Convert a stroke width, px at scale 1, to pixels of the surface: at least one."""
        return max(1, round(pixels * self.scale))

    def scale_text_size(self, pixels: float) -> int:
        """Convert a text size, px at scale 1, to pixels of the surface, but not below a readable size."""
        return max(_MIN_TEXT_PX, round(pixels * self.scale))

    def fill_polygon(self, corners: FloatArray, fill: Color | tuple[int, int, int, int]) -> None:
        """Fill a polygon, (k, 2) px."""
        for ring in clip_polygon(corners):
            pygame.draw.polygon(self.surface, fill, np.rint(ring).tolist())

    def draw_polygons(
        self,
        corners: FloatArray,
        ends: Sequence[int],
        fills: Sequence[Color | None],
        edge: Color | None = None,
    ) -> None:
        """Draw many polygons.

        Parameters
        ----------
        corners : (k, 2) array, px
            The corners of all polygons, one polygon after the other.
        ends : sequence of int
            For each polygon, the row after its last corner.
        fills : sequence of Color or None
            Color of each polygon; those with None are not filled.
        edge : Color, optional
            Color of the outlines, which are not antialiased.
        """
        # Coordinates beyond the limit of pygame are clipped, which takes longer.
        is_near = is_within_limit(corners)
        points = np.rint(corners).tolist()
        edge_width = self.scale_width(1.0)
        start = 0
        for end, fill in zip(ends, fills, strict=True):
            if end - start >= 3:
                if fill is not None and is_near:
                    pygame.draw.polygon(self.surface, fill, points[start:end])
                elif fill is not None:
                    self.fill_polygon(corners[start:end], fill)
                if edge is not None and is_near:
                    pygame.draw.polygon(self.surface, edge, points[start:end], edge_width)
                elif edge is not None:
                    self.draw_outline(corners[start:end], edge, edge_width)
            start = end

    def draw_outline(
        self, corners: FloatArray, color: Color, width: int = 1, *, is_closed: bool = True
    ) -> None:
        """Draw an antialiased line through (k, 2) px, by default back to the first point."""
        points = corners.tolist()
        path = [*points, *points[:1]] if is_closed else points
        for start, end in pairwise(path):
            self.draw_line(start, end, color, width)
        if width > 2:
            # Thick lines have straight ends, which leave notches at the corners.
            dot = partial(sprites.render_dot, width / 2 - 0.5, color)
            for point in points:
                self.draw_sprite(dot, point)

    def draw_line(self, start: Pixel, end: Pixel, color: Color, width: int = 1) -> None:
        """Draw an antialiased line between two pixels."""
        ends = clip_segment(start, end)
        if ends:
            pygame.draw.aaline(self.surface, color, ends[0], ends[1], width)

    def draw_thin_path(self, points: Sequence[Pixel], color: Color, *, is_closed: bool = False) -> None:
        """Draw an antialiased line, 1 px wide, through points within `clipping.MAX_DRAWN_PX`."""
        if len(points) == 2:
            # With two points, aalines of pygame-ce 2.5 reads past their end, so that frames would vary.
            pygame.draw.aaline(self.surface, color, points[0], points[1])
        else:
            pygame.draw.aalines(self.surface, color, is_closed, points)

    def draw_segments(self, ends: FloatArray, color: Color, width: int = 1) -> None:
        """Draw many antialiased lines, (k, 4) px: x and y of one end, then of the other."""
        is_near = is_within_limit(ends)
        for x1, y1, x2, y2 in ends.tolist():
            if is_near:
                pygame.draw.aaline(self.surface, color, (x1, y1), (x2, y2), width)
            else:
                self.draw_line((x1, y1), (x2, y2), color, width)

    def draw_dashed_line(
        self, start: Pixel, end: Pixel, color: Color, width: int = 1, dash: float = 5.0
    ) -> None:
        """Draw a dashed line between two pixels; dashes are about `dash` px long at scale 1."""
        ends = clip_segment(start, end)
        if not ends:
            return
        first = np.array(ends[0])
        along = np.array(ends[1]) - first
        count = max(1, round(float(np.hypot(*along)) / (2 * dash * self.scale)))
        for k in range(count):
            dash_start = first + along * (k / count)
            dash_end = first + along * ((k + _DASH_FRACTION) / count)
            pygame.draw.aaline(self.surface, color, dash_start.tolist(), dash_end.tolist(), width)

    def draw_circle(self, center: Pixel, radius: float, color: Color, *, is_dashed: bool = False) -> None:
        """Draw a circle with a radius in pixels."""
        # An even number of sides, so that dashes and gaps alternate all around.
        sides = int(min(max(radius, _MIN_CIRCLE_SIDES), _MAX_CIRCLE_SIDES)) // 2 * 2
        angle = np.arange(sides + 1) * (2 * np.pi / sides)
        corners = np.asarray(center) + radius * np.column_stack([np.cos(angle), np.sin(angle)])
        step = 2 if is_dashed else 1
        for start, end in list(pairwise(corners.tolist()))[::step]:
            self.draw_line(start, end, color, self.scale_width(1.0))

    def get_symbol_line(self, x: float, y: float, half_length: float) -> tuple[Pixel, Pixel]:
        """Return the ends of the horizontal line that stands for a line in the legend.

        Parameters
        ----------
        x, y : float, px
            Middle of the line.
        half_length : float, px at scale 1

        Returns
        -------
        start, end : (float, float), px
        """
        half = half_length * self.scale
        return (x - half, y), (x + half, y)

    def draw_swatch(self, x: float, y: float, fill: Color | None, edge: Color) -> None:
        """Draw the small square, around a pixel, that stands for an area in the legend."""
        size = _SWATCH_PX * self.scale
        box = pygame.Rect(round(x - size / 2), round(y - size / 2), round(size), round(size))
        if fill is not None:
            pygame.draw.rect(self.surface, fill, box)
        pygame.draw.rect(self.surface, edge, box, self.scale_width(1.0))

    def draw_arrow(
        self, start: Pixel, end: Pixel, color: Color, width: float, head: ArrowHead = "full"
    ) -> None:
        """Draw an arrow between two pixels.

        Parameters
        ----------
        start, end : (float, float), px
        color : Color
        width : float, px
            Width of the shaft.
        head : {"full", "open", "dot", "bar"}
        """
        tail = np.asarray(start, dtype=float)
        tip = np.asarray(end, dtype=float)
        length = float(np.hypot(*(tip - tail)))
        is_outside = (tail <= -_OUTSIDE_PX) | (tail >= np.add(self.surface.get_size(), _OUTSIDE_PX))
        if length < 1.0 or is_outside.any():
            return
        along = (tip - tail) / length
        # Short arrows are only a head.
        head_length = min(_HEAD_LENGTH_FACTOR * width + _MIN_HEAD_LENGTH_PX * self.scale, length)
        half_bar = _BAR_FACTOR * width + _MIN_HALF_BAR_PX * self.scale
        if head == "bar":
            head_points = _list_bar_ends(tip, along, half_bar)
        else:
            head_points = _list_barbs(tip, along, head_length)
        sketch = sprites.Sketch.from_points([tail.tolist(), *head_points], 2 * width)
        if sketch is None:
            return
        shaft_end = tip
        if head == "full":
            shaft_end = tip - _SHAFT_INSET_FACTOR * head_length * along
        sketch.draw_path([tail.tolist(), shaft_end.tolist()], color, width)
        if head == "full":
            sketch.fill_polygon(head_points, color)
        elif head == "dot":
            sketch.draw_dot(tip.tolist(), _DOT_FACTOR * width, color)
        else:
            sketch.draw_path(head_points, color, width)
        sketch.draw_on(self.surface)

    def draw_sprite(self, sprite: Sprite, center: Pixel) -> None:
        """Draw a sprite around a pixel."""
        self.draw_sprites([sprite], np.array([center], dtype=float))

    def draw_sprites(
        self, choices: Sequence[Sprite], centers: FloatArray, indices: IntArray | None = None
    ) -> None:
        """Draw a sprite at each of many pixels.

        Parameters
        ----------
        choices : sequence of Sprite
        centers : (n, 2) array, px
            Rounded to a quarter of a pixel. Those that are nan are skipped.
        indices : (n,) int array, optional
            The sprite at each center, an index into `choices`; by default the first everywhere.
        """
        placed = self.place_sprites(choices, centers, indices)
        self.surface.fblits(placed, pygame.BLEND_PREMULTIPLIED)

    def place_sprites(
        self, choices: Sequence[Sprite], centers: FloatArray, indices: IntArray | None = None
    ) -> PlacedSprites:
        """Return the pictures that `draw_sprites` draws, with their upper left corners, px.

        Centers far outside the surface are skipped. Each sprite is rendered once per shift, however many
        centers it has.
        """
        limit = np.add(self.surface.get_size(), _OUTSIDE_PX)
        is_near = ((centers > -_OUTSIDE_PX) & (centers < limit)).all(axis=1)
        rows = np.flatnonzero(is_near)
        # Whole coordinates are the middles of pixels, as in the lines of pygame.
        quarters = np.rint((centers[rows] + 0.5) * sprites.SUPERSAMPLING).astype(int)
        pixels, shifts = np.divmod(quarters, sprites.SUPERSAMPLING)
        chosen = np.zeros(len(rows), dtype=int)
        if indices is not None:
            chosen = indices[rows]
        rendered: dict[tuple[int, int, int], tuple[pygame.Surface, int]] = {}
        placed = []
        looks = np.column_stack([chosen, shifts])
        for (x, y), (index, right, down) in zip(pixels.tolist(), looks.tolist(), strict=True):
            look = (index, right, down)
            if look not in rendered:
                picture = choices[index]((right, down))
                rendered[look] = (picture, picture.get_width() // 2)
            picture, half = rendered[look]
            placed.append((picture, (x - half, y - half)))
        return placed

    def draw_text(
        self,
        text: str,
        position: Pixel,
        *,
        size: float | None = None,
        color: Color | None = None,
        bold: bool = False,
        anchor: TextAnchor = "left",
    ) -> int:
        """Write one line of text.

        Parameters
        ----------
        text : str
        position : (float, float), px
            Left end, middle or right end of the text, depending on `anchor`, at half its height.
        size : float, px at scale 1, optional
            By default the text size of the theme.
        color : Color, optional
            By default the ink of the theme.
        bold : bool
        anchor : {"left", "middle", "right"}

        Returns
        -------
        int
            Width of the text, px.
        """
        if size is None:
            size = self.theme.text
        picture = render_text(text, self.scale_text_size(size), color or self.theme.ink, bold=bold)
        width, height = picture.get_size()
        x, y = position
        offset = {"left": 0.0, "middle": width / 2, "right": float(width)}[anchor]
        self.surface.blit(picture, (round(x - offset), round(y - height / 2)))
        return width

    def measure_text(self, text: str, size: float | None = None, *, bold: bool = False) -> int:
        """Return the width of a line of text, px; `size` is px at scale 1."""
        if size is None:
            size = self.theme.text
        return measure_text(text, self.scale_text_size(size), bold=bold)


def _list_bar_ends(tip: FloatArray, along: FloatArray, half_bar: float) -> list[list[float]]:
    """Return the two ends of the bar across the tip of an arrow, px; `along` is its direction."""
    across = np.array([-along[1], along[0]])
    return [(tip - half_bar * across).tolist(), (tip + half_bar * across).tolist()]


def _list_barbs(tip: FloatArray, along: FloatArray, head_length: float) -> list[list[float]]:
    """Return the corners of the head of an arrow, px: one barb, the tip and the other barb."""
    across = np.array([-along[1], along[0]])
    base = tip - head_length * along
    half_width = _HEAD_WIDTH_FACTOR * head_length
    return [
        (base + half_width * across).tolist(),
        tip.tolist(),
        (base - half_width * across).tolist(),
    ]
