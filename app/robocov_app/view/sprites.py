"""Small anti-aliased pictures: discs with numbers, rings, crosses. Drawn large once, shrunk, and kept.

Each is kept for a quarter of a pixel's shift, so that slow robots glide in films instead of hopping.
All are premultiplied: blit them with ``BLEND_PREMULTIPLIED``.
"""

from __future__ import annotations

from functools import lru_cache

import pygame

from robocov_app.view.fonts import label
from robocov_app.view.theme import Colour, readable_on

FINE = 4
"""Each sprite is drawn so many times larger; also the number of shifts within a pixel."""


def _blank(radius: float) -> tuple[pygame.Surface, int]:
    """Return a large transparent square for a sprite of `radius` pixels and its half side in pixels."""
    half = int(radius) + 2
    return pygame.Surface((2 * half * FINE, 2 * half * FINE), pygame.SRCALPHA, 32), half


def _shrunk(large: pygame.Surface) -> pygame.Surface:
    width, height = large.get_size()
    return pygame.transform.smoothscale(large, (width // FINE, height // FINE))


@lru_cache(maxsize=8192)
def disc(
    radius: float,
    fill: Colour,
    ring: Colour,
    ring_width: float,
    edge: Colour,
    text: str,
    shift: tuple[int, int],
) -> pygame.Surface:
    """Return a disc with a ring around it, a hair line around that, and a number in it.

    Parameters
    ----------
    radius : float, px
        Of the disc with its ring.
    edge : Colour
        Colour of the hair line, which parts the ring from what is behind.
    text : str
        Drawn in the middle when it is not empty.
    shift : pair of int
        Quarters of a pixel to the right and down.
    """
    large, half = _blank(radius + 1)
    center = (half * FINE + shift[0], half * FINE + shift[1])
    pygame.draw.circle(large, edge, center, (radius + 0.6) * FINE)
    pygame.draw.circle(large, ring, center, radius * FINE)
    pygame.draw.circle(large, fill, center, (radius - ring_width) * FINE)
    if text:
        inside = radius - ring_width
        size = inside * (1.5 if len(text) == 1 else 1.22 if len(text) == 2 else 0.92)
        number = label(text, round(size * FINE), readable_on(fill), True)
        # the ink of digits, without the room for ascenders and descenders, goes to the middle
        ink = number.get_bounding_rect()
        large.blit(number, (center[0] - ink.centerx, center[1] - ink.centery))
    return _shrunk(large)


@lru_cache(maxsize=1024)
def ring(radius: float, colour: Colour, width: float, shift: tuple[int, int]) -> pygame.Surface:
    """Return a circle's line, its middle at `radius` pixels."""
    large, half = _blank(radius + width / 2)
    center = (half * FINE + shift[0], half * FINE + shift[1])
    pygame.draw.circle(large, colour, center, (radius + width / 2) * FINE)
    pygame.draw.circle(large, (0, 0, 0, 0), center, (radius - width / 2) * FINE)
    return _shrunk(large)


@lru_cache(maxsize=1024)
def dot(radius: float, colour: Colour, shift: tuple[int, int]) -> pygame.Surface:
    """Return a filled circle."""
    large, half = _blank(radius)
    center = (half * FINE + shift[0], half * FINE + shift[1])
    pygame.draw.circle(large, colour, center, radius * FINE)
    return _shrunk(large)


@lru_cache(maxsize=1024)
def cross(
    arm: float, colour: Colour, halo: Colour, width: float, diagonal: bool, shift: tuple[int, int]
) -> pygame.Surface:
    """Return a plus, or a times sign, with a thin halo that keeps it readable on any fill."""
    large, half = _blank(arm + width)
    x, y = half * FINE + shift[0], half * FINE + shift[1]
    reach = arm * FINE * (0.75 if diagonal else 1.0)
    turned = ((-1, -1), (1, -1)) if diagonal else ((1, 0), (0, 1))
    for shade, thick in ((halo, width * FINE + FINE * 1.6), (colour, width * FINE)):
        more = reach + (FINE * 0.8 if shade is halo else 0.0)
        for dx, dy in turned:
            half_thick = thick / 2 / (2**0.5 if diagonal else 1.0)
            nx, ny = -dy * half_thick, dx * half_thick
            a, b = (x - dx * more, y - dy * more), (x + dx * more, y + dy * more)
            corners = [
                (a[0] + nx, a[1] + ny),
                (b[0] + nx, b[1] + ny),
                (b[0] - nx, b[1] - ny),
                (a[0] - nx, a[1] - ny),
            ]
            pygame.draw.polygon(large, shade, corners)
    return _shrunk(large)
