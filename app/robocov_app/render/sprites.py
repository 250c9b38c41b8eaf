"""Anti-aliased strokes and small pictures: drawn large, and shrunk.

Discs with numbers, rings and crosses are kept, for each quarter of a pixel's shift, so that slow
robots glide in films instead of hopping. All is premultiplied: blit with ``BLEND_PREMULTIPLIED``.
"""

import math
from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
import pygame

from robocov.arrays import Array
from robocov_app.look.colors import Color, choose_text_color
from robocov_app.render.fonts import label
from robocov_app.render.surface_cache import kept

FINE = 4  # each sprite is drawn so many times larger; also the number of shifts within a pixel
LARGE = 60.0  # radius in pixels from which on nobody sees quarters of a pixel, and a sprite takes megabytes
STROKE_FINE = 3  # the same for strokes, which may span the whole picture
Shift: TypeAlias = tuple[int, int]  # quarters of a pixel to the right and down
Pixel: TypeAlias = Sequence[float]  # x to the right and y down from the surface's corner


def visible_box(points: Array, margin: float, surface: pygame.Surface) -> pygame.Rect | None:
    """Return what of the surroundings of (..., 2) px points can be seen on a surface; None for nothing."""
    flat = points.reshape(-1, 2)
    flat = flat[np.isfinite(flat[:, 0])]
    if not len(flat):
        return None
    low, high = np.floor(flat.min(axis=0) - margin), np.ceil(flat.max(axis=0) + margin)
    box = pygame.Rect(low.astype(int).tolist(), (high - low).astype(int).tolist()).clip(surface.get_clip())
    return box if box.width and box.height else None


class Sketch:
    """A `box` of a surface, drawn larger, `fine` times, and shrunk: pieces that overlap show no seams."""

    def __init__(self, box: pygame.Rect, fine: int = STROKE_FINE) -> None:
        self.box = box
        self.large = pygame.Surface((box.width * fine, box.height * fine), pygame.SRCALPHA, 32)

    @classmethod
    def around(cls, points: Sequence[Pixel], margin: float) -> "Sketch | None":
        """Return a sketch that holds `points` and `margin` pixels around; None where it would be huge."""
        xs, ys = [point[0] for point in points], [point[1] for point in points]
        left, top = int(min(xs) - margin) - 1, int(min(ys) - margin) - 1
        width, height = int(max(xs) + margin) + 2 - left, int(max(ys) + margin) + 2 - top
        return cls(pygame.Rect(left, top, width, height)) if max(width, height) <= 4000 else None

    def _large_points(self, points: Sequence[Pixel]) -> list[tuple[float, float]]:
        # pixels are squares around their whole numbers: their middle is not at a corner of the large ones
        x, y = self.box.x - 0.5, self.box.y - 0.5
        return [((point[0] - x) * STROKE_FINE, (point[1] - y) * STROKE_FINE) for point in points]

    def path(self, points: Sequence[Pixel], color: Color, width: float) -> None:
        wide = max(width * STROKE_FINE, 1.0)
        large = self._large_points(points)
        pygame.draw.lines(self.large, color, False, large, round(wide))
        for point in large:
            pygame.draw.circle(self.large, color, point, wide / 2)

    def polygon(self, corners: Sequence[Pixel], color: Color) -> None:
        pygame.draw.polygon(self.large, color, self._large_points(corners))

    def dot(self, center: Pixel, radius: float, color: Color) -> None:
        pygame.draw.circle(self.large, color, self._large_points([center])[0], radius * STROKE_FINE)

    def onto(self, surface: pygame.Surface) -> None:
        picture = pygame.transform.smoothscale(self.large, self.box.size)
        surface.blit(picture, self.box, special_flags=pygame.BLEND_PREMULTIPLIED)


def _blank(radius: float, shift: Shift, fine: int = FINE) -> tuple[pygame.Surface, tuple[int, int]]:
    """Return a large transparent square for a sprite of `radius` pixels, and where its middle is."""
    half = (int(radius) + 2) * fine
    return pygame.Surface((2 * half, 2 * half), pygame.SRCALPHA, 32), (half + shift[0], half + shift[1])


def _shrunk(large: pygame.Surface, fine: int = FINE) -> pygame.Surface:
    width, height = large.get_size()
    return pygame.transform.smoothscale(large, (width // fine, height // fine))


def number_size(inside: Any, digits: Any) -> Any:
    """Return the text sizes at which 1 to 4 digits fill discs of radius `inside`, in their unit."""
    return inside * np.array([1.5, 1.22, 0.92, 0.72])[digits - 1]


def disc(
    radius: float, fill: Color, ring: Color, ring_width: float, edge: Color, text: str, shift: Shift
) -> pygame.Surface:
    """Return a disc of `radius` px with a ring in it, a hair line around, and a number."""
    return _disc(radius, fill, ring, ring_width, edge, text, shift if radius <= LARGE else (0, 0))


@kept(24_000_000)
def _disc(
    radius: float, fill: Color, ring: Color, ring_width: float, edge: Color, text: str, shift: Shift
) -> pygame.Surface:
    fine = _fineness(radius)
    large, center = _blank(radius + 1, shift, fine)
    pygame.draw.circle(large, edge, center, (radius + 0.6) * fine)
    pygame.draw.circle(large, ring, center, radius * fine)
    pygame.draw.circle(large, fill, center, (radius - ring_width) * fine)
    if text:
        size = number_size(radius - ring_width, min(len(text), 4))
        number = label(text, round(size * fine), choose_text_color(fill), True)
        # the ink of digits, without the room for ascenders and descenders, goes to the middle
        ink = number.get_bounding_rect()
        large.blit(number, (center[0] - ink.centerx, center[1] - ink.centery))
    return _shrunk(large, fine)


NOSE = 1.65  # how far the tip of a nose is from the middle of the disc, in its radii
NOSE_TURNS = 96  # so many directions of noses are told apart


@kept(12_000_000)
def nose(radius: float, fill: Color, edge: Color, turn: int, shift: Shift) -> pygame.Surface:
    """Return what points where a disc faces, to be put under it; `turn` is of `NOSE_TURNS`, 0 right."""
    fine = _fineness(radius)
    large, (x, y) = _blank(NOSE * radius + 1, shift, fine)
    angle, apart = 2 * math.pi * turn / NOSE_TURNS, 0.5
    for color, more in ((edge, 0.6), (fill, 0.0)):
        reach = [(NOSE * radius + 1.5 * more, 0.0), (radius + more, apart), (radius + more, -apart)]
        corners = [(far * math.cos(angle + side), far * math.sin(angle + side)) for far, side in reach]
        pygame.draw.polygon(large, color, [(x + fine * dx, y - fine * dy) for dx, dy in corners])
    return _shrunk(large, fine)


def ring(radius: float, color: Color, width: float, shift: Shift) -> pygame.Surface:
    return _ring(radius, color, width, shift if radius <= LARGE else (0, 0))


@kept(6_000_000)
def _ring(radius: float, color: Color, width: float, shift: Shift) -> pygame.Surface:
    fine = _fineness(radius)
    large, center = _blank(radius + width / 2, shift, fine)
    pygame.draw.circle(large, color, center, (radius + width / 2) * fine)
    pygame.draw.circle(large, (0, 0, 0, 0), center, (radius - width / 2) * fine)
    return _shrunk(large, fine)


def _fineness(radius: float) -> int:
    return FINE if radius <= LARGE else FINE // 2


@kept(4_000_000)
def dot(radius: float, color: Color, shift: Shift) -> pygame.Surface:
    large, center = _blank(radius, shift)
    pygame.draw.circle(large, color, center, radius * FINE)
    return _shrunk(large)


@kept(4_000_000)
def cross(
    arm: float, color: Color, halo: Color, width: float, diagonal: bool, shift: Shift
) -> pygame.Surface:
    """Return a plus, or a times sign, with a thin halo that keeps it readable on any fill."""
    large, (x, y) = _blank(arm + width, shift)
    reach = arm * FINE * (0.75 if diagonal else 1.0)
    turned = ((-1, -1), (1, -1)) if diagonal else ((1, 0), (0, 1))
    for shade, thick in ((halo, width * FINE + FINE * 1.6), (color, width * FINE)):
        more = reach + (FINE * 0.8 if shade is halo else 0.0)
        for dx, dy in turned:
            half_thick = thick / 2 / (2**0.5 if diagonal else 1.0)
            nx, ny = -dy * half_thick, dx * half_thick
            a, b = (x - dx * more, y - dy * more), (x + dx * more, y + dy * more)
            ends = (a, 1), (b, 1), (b, -1), (a, -1)
            pygame.draw.polygon(large, shade, [(px + side * nx, py + side * ny) for (px, py), side in ends])
    return _shrunk(large)
