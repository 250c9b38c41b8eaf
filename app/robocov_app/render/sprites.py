"""Antialiased shapes: sketches, which are drawn enlarged and shrunk, and sprites, small cached marks.

Sprites are cached for each quarter of a pixel, so that slow robots glide in videos instead of hopping. All
colors are premultiplied: blit with ``pygame.BLEND_PREMULTIPLIED``.
"""

import math
from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
import pygame

from robocov.typing import FloatArray
from robocov_app.look.colors import Color, choose_text_color
from robocov_app.render.fonts import render_text
from robocov_app.render.surface_cache import cache_surfaces

SUPERSAMPLING = 4
"""Factor by which sprites are drawn larger and then shrunk; also the number of shifts in a pixel."""
SKETCH_SUPERSAMPLING = 3
"""Factor for sketches, which may be as large as the whole picture."""
MAX_FINE_RADIUS_PX = 60.0
"""Larger sprites take megabytes: they have half the supersampling, and no shift, which would be invisible."""
NOSE_LENGTH = 1.65
"""Distance of the tip of a nose from the center of its disc, in radii."""
N_NOSE_DIRECTIONS = 96
_NOSE_HALF_ANGLE = 0.5
"""Angle at the center between the tip of a nose and each end of its base, rad."""
_EDGE_PX = 0.6
"""Width of the edge around discs and noses."""
_CROSS_HALO_PX = 1.6
"""Additional width of the halo of a cross."""
_DIAGONAL_ARM = 0.75
"""Length of the arms of an x along each axis, as a fraction of those of a plus sign."""
_DIGIT_SIZES = (1.5, 1.22, 0.92, 0.72)
"""Text sizes of numbers with 1, 2, 3 and 4 digits in a disc of radius 1."""
_AXIS_DIRECTIONS = ((1, 0), (0, 1))
_DIAGONAL_DIRECTIONS = ((-1, -1), (1, -1))
_MAX_SKETCH_PX = 4000

Shift: TypeAlias = tuple[int, int]
"""Shift of a sprite to the right and down, in quarters of a pixel."""
Pixel: TypeAlias = Sequence[float]
"""Position on a surface, px: x to the right and y down."""


def find_visible_box(points: FloatArray, margin: float, surface: pygame.Surface) -> pygame.Rect | None:
    """Return the box around points with a margin, clipped to the visible part of a surface.

    Parameters
    ----------
    points : (..., 2) array, px
        May contain nan.
    margin : float, px
        Space around the points.
    surface : pygame.Surface
        Only the area in its clip rectangle is visible.

    Returns
    -------
    pygame.Rect or None
        None if nothing is visible.
    """
    flat = points.reshape(-1, 2)
    flat = flat[np.isfinite(flat[:, 0])]
    if not len(flat):
        return None
    low = np.floor(flat.min(axis=0) - margin)
    high = np.ceil(flat.max(axis=0) + margin)
    box = pygame.Rect(low.astype(int).tolist(), (high - low).astype(int).tolist())
    visible = box.clip(surface.get_clip())
    if not visible.width or not visible.height:
        return None
    return visible


class Sketch:
    """A drawing of a rectangle of a surface, made larger and then shrunk: overlapping strokes show no seams.

    Parameters
    ----------
    box : pygame.Rect, px
        The rectangle of the surface.
    supersampling : int
        Factor by which the drawing is larger.

    Attributes
    ----------
    box : pygame.Rect, px
    large : pygame.Surface
        The enlarged drawing.
    """

    def __init__(self, box: pygame.Rect, supersampling: int = SKETCH_SUPERSAMPLING) -> None:
        self.box = box
        self.large = pygame.Surface(
            (box.width * supersampling, box.height * supersampling), pygame.SRCALPHA, 32
        )
        self._supersampling = supersampling

    @classmethod
    def from_points(cls, points: Sequence[Pixel], margin: float) -> "Sketch | None":
        """Build a sketch that contains points with a margin around them, px.

        Returns
        -------
        Sketch or None
            None if a side would exceed `_MAX_SKETCH_PX`.
        """
        xs = [point[0] for point in points]
        ys = [point[1] for point in points]
        left = int(min(xs) - margin) - 1
        top = int(min(ys) - margin) - 1
        width = int(max(xs) + margin) + 2 - left
        height = int(max(ys) + margin) + 2 - top
        if max(width, height) > _MAX_SKETCH_PX:
            return None
        return cls(pygame.Rect(left, top, width, height))

    def to_large(self, points: Sequence[Pixel]) -> list[tuple[float, float]]:
        """Convert pixels of the surface to pixels of the enlarged drawing."""
        # Whole coordinates are the middles of pixels, so the first pixel starts half a pixel earlier.
        left = self.box.x - 0.5
        top = self.box.y - 0.5
        supersampling = self._supersampling
        return [((point[0] - left) * supersampling, (point[1] - top) * supersampling) for point in points]

    def draw_path(self, points: Sequence[Pixel], color: Color, width: float) -> None:
        """Draw a line through points, with a width in px and round joints and ends."""
        large_width = max(width * self._supersampling, 1.0)
        large_points = self.to_large(points)
        pygame.draw.lines(self.large, color, False, large_points, round(large_width))
        for point in large_points:
            pygame.draw.circle(self.large, color, point, large_width / 2)

    def fill_polygon(self, corners: Sequence[Pixel], color: Color) -> None:
        """Fill a polygon."""
        pygame.draw.polygon(self.large, color, self.to_large(corners))

    def draw_dot(self, center: Pixel, radius: float, color: Color) -> None:
        """Draw a dot of a radius, px."""
        large_center = self.to_large([center])[0]
        pygame.draw.circle(self.large, color, large_center, radius * self._supersampling)

    def draw_on(self, surface: pygame.Surface) -> None:
        """Shrink the drawing, and blit it on a surface at its box."""
        picture = pygame.transform.smoothscale(self.large, self.box.size)
        surface.blit(picture, self.box, special_flags=pygame.BLEND_PREMULTIPLIED)


def _create_enlarged_surface(
    radius: float, shift: Shift, supersampling: int
) -> tuple[pygame.Surface, tuple[int, int]]:
    """Create an enlarged transparent square for a sprite with a radius, px; return it with its center."""
    half = (int(radius) + 2) * supersampling
    surface = pygame.Surface((2 * half, 2 * half), pygame.SRCALPHA, 32)
    return surface, (half + shift[0], half + shift[1])


def _shrink(large: pygame.Surface, supersampling: int) -> pygame.Surface:
    width, height = large.get_size()
    return pygame.transform.smoothscale(large, (width // supersampling, height // supersampling))


def _choose_supersampling(radius: float) -> int:
    return SUPERSAMPLING if radius <= MAX_FINE_RADIUS_PX else SUPERSAMPLING // 2


def _choose_shift(radius: float, shift: Shift) -> Shift:
    return shift if radius <= MAX_FINE_RADIUS_PX else (0, 0)


def choose_number_size(radius: Any, n_digits: Any) -> Any:
    """Return the text size at which a number fills a disc.

    Parameters
    ----------
    radius : float or (n,) array
    n_digits : int or (n,) int array
        From 1 to 4.

    Returns
    -------
    float or (n,) array
        In the unit of the radius.
    """
    return radius * np.array(_DIGIT_SIZES)[n_digits - 1]


def render_disc(
    radius: float,
    shift: Shift,
    *,
    fill: Color,
    ring: Color,
    ring_width: float,
    edge: Color,
    text: str = "",
) -> pygame.Surface:
    """Render a robot: a disc with a ring, a thin edge and a number.

    Parameters
    ----------
    radius : float, px
    shift : Shift
    fill : Color
    ring : Color
        Color of the ring at the rim of the disc.
    ring_width : float, px
    edge : Color
        Color of the thin edge around the ring.
    text : str
        Number at the center, of up to four digits.

    Returns
    -------
    pygame.Surface
    """
    return _render_disc(
        radius,
        _choose_shift(radius, shift),
        fill=fill,
        ring=ring,
        ring_width=ring_width,
        edge=edge,
        text=text,
    )


@cache_surfaces(24_000_000)
def _render_disc(
    radius: float,
    shift: Shift,
    *,
    fill: Color,
    ring: Color,
    ring_width: float,
    edge: Color,
    text: str,
) -> pygame.Surface:
    """Render a disc as `render_disc`, with a shift that is already adapted to its size.

    Circles are drawn from the largest to the smallest: edge, ring, fill.
    """
    supersampling = _choose_supersampling(radius)
    large, center = _create_enlarged_surface(radius + 1, shift, supersampling)
    pygame.draw.circle(large, edge, center, (radius + _EDGE_PX) * supersampling)
    pygame.draw.circle(large, ring, center, radius * supersampling)
    pygame.draw.circle(large, fill, center, (radius - ring_width) * supersampling)
    if text:
        size = choose_number_size(radius - ring_width, min(len(text), len(_DIGIT_SIZES)))
        number = render_text(text, round(size * supersampling), choose_text_color(fill), bold=True)
        # Center the visible part of the digits; the font leaves space for ascenders and descenders.
        ink = number.get_bounding_rect()
        large.blit(number, (center[0] - ink.centerx, center[1] - ink.centery))
    return _shrink(large, supersampling)


@cache_surfaces(12_000_000)
def render_nose(radius: float, fill: Color, edge: Color, direction: int, shift: Shift) -> pygame.Surface:
    """Render the nose of a robot, a triangle that shows its heading and is drawn below its disc.

    Parameters
    ----------
    radius : float, px
        Radius of the disc.
    fill, edge : Color
    direction : int
        Heading, counter-clockwise from the right, in steps of 2 pi / `N_NOSE_DIRECTIONS`.
    shift : Shift

    Returns
    -------
    pygame.Surface
    """
    supersampling = _choose_supersampling(radius)
    large, center = _create_enlarged_surface(NOSE_LENGTH * radius + 1, shift, supersampling)
    heading = 2 * math.pi * direction / N_NOSE_DIRECTIONS
    for color, margin in ((edge, _EDGE_PX), (fill, 0.0)):
        base = radius + margin
        # An edge of uniform width extends farther at the sharp tip.
        tip = NOSE_LENGTH * radius + 1.5 * margin
        corners = []
        for distance, angle in ((tip, 0.0), (base, _NOSE_HALF_ANGLE), (base, -_NOSE_HALF_ANGLE)):
            dx = distance * math.cos(heading + angle)
            dy = distance * math.sin(heading + angle)
            corners.append((center[0] + supersampling * dx, center[1] - supersampling * dy))
        pygame.draw.polygon(large, color, corners)
    return _shrink(large, supersampling)


def render_ring(radius: float, color: Color, width: float, shift: Shift) -> pygame.Surface:
    """Render a ring.

    Parameters
    ----------
    radius : float, px
        Radius of the middle of the stroke.
    color : Color
    width : float, px
    shift : Shift

    Returns
    -------
    pygame.Surface
    """
    return _render_ring(radius, color, width, _choose_shift(radius, shift))


@cache_surfaces(6_000_000)
def _render_ring(radius: float, color: Color, width: float, shift: Shift) -> pygame.Surface:
    supersampling = _choose_supersampling(radius)
    large, center = _create_enlarged_surface(radius + width / 2, shift, supersampling)
    pygame.draw.circle(large, color, center, (radius + width / 2) * supersampling)
    pygame.draw.circle(large, (0, 0, 0, 0), center, (radius - width / 2) * supersampling)
    return _shrink(large, supersampling)


@cache_surfaces(4_000_000)
def render_dot(radius: float, color: Color, shift: Shift) -> pygame.Surface:
    """Render a dot of a radius, px."""
    large, center = _create_enlarged_surface(radius, shift, SUPERSAMPLING)
    pygame.draw.circle(large, color, center, radius * SUPERSAMPLING)
    return _shrink(large, SUPERSAMPLING)


@cache_surfaces(4_000_000)
def render_cross(
    arm: float, shift: Shift, *, color: Color, halo: Color, width: float, is_diagonal: bool
) -> pygame.Surface:
    """Render a plus sign or an x, with a thin halo that keeps it readable on any background.

    Parameters
    ----------
    arm : float, px
        Length of the arms of a plus sign; those of an x extend `_DIAGONAL_ARM` times as far along each axis.
    shift : Shift
    color, halo : Color
    width : float, px
    is_diagonal : bool
        Whether it is an x.

    Returns
    -------
    pygame.Surface
    """
    large, center = _create_enlarged_surface(arm + width, shift, SUPERSAMPLING)
    length = arm * SUPERSAMPLING * (_DIAGONAL_ARM if is_diagonal else 1.0)
    large_width = width * SUPERSAMPLING
    halo_px = _CROSS_HALO_PX * SUPERSAMPLING
    directions = _DIAGONAL_DIRECTIONS if is_diagonal else _AXIS_DIRECTIONS
    for shade, reach, shade_width in (
        (halo, length + halo_px / 2, large_width + halo_px),
        (color, length, large_width),
    ):
        for direction in directions:
            pygame.draw.polygon(large, shade, _build_bar(center, direction, reach, shade_width))
    return _shrink(large, SUPERSAMPLING)


@cache_surfaces(1_000_000)
def render_burst(arm: float, shift: Shift, *, color: Color, halo: Color, width: float) -> pygame.Surface:
    """Render a star of eight rays, with a thin halo that keeps it readable on any background.

    Parameters
    ----------
    arm : float, px
        Length of the rays.
    shift : Shift
    color, halo : Color
    width : float, px

    Returns
    -------
    pygame.Surface
    """
    large, center = _create_enlarged_surface(arm + width, shift, SUPERSAMPLING)
    halo_px = _CROSS_HALO_PX * SUPERSAMPLING
    for shade, more in ((halo, halo_px), (color, 0.0)):
        for directions, fraction in ((_AXIS_DIRECTIONS, 1.0), (_DIAGONAL_DIRECTIONS, _DIAGONAL_ARM)):
            reach = arm * SUPERSAMPLING * fraction + more / 2
            for direction in directions:
                bar = _build_bar(center, direction, reach, width * SUPERSAMPLING + more)
                pygame.draw.polygon(large, shade, bar)
    return _shrink(large, SUPERSAMPLING)


def _build_bar(
    center: tuple[int, int], direction: tuple[int, int], reach: float, width: float
) -> list[tuple[float, float]]:
    """Return the corners of a bar from `center - reach * direction` to `center + reach * direction`."""
    x, y = center
    dx, dy = direction
    half_width = width / 2 / (dx * dx + dy * dy) ** 0.5
    side_x = -dy * half_width
    side_y = dx * half_width
    start_x = x - dx * reach
    start_y = y - dy * reach
    end_x = x + dx * reach
    end_y = y + dy * reach
    return [
        (start_x + side_x, start_y + side_y),
        (end_x + side_x, end_y + side_y),
        (end_x - side_x, end_y - side_y),
        (start_x - side_x, start_y - side_y),
    ]
