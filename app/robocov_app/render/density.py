"""The density φ as a soft shading: the more a place counts, the stronger the colour."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pygame

from robocov_app.render.layers import Layer, LegendEntry
from robocov_app.render.phi import colours, density_words, parts

if TYPE_CHECKING:
    from robocov.arrays import Array, IntArray
    from robocov.density import Density
    from robocov_app.render.canvas import Canvas
    from robocov_app.render.scene import Scene

_DOTS = 60_000
"""On a surface the density is looked at in at most about so many places; between them it is interpolated."""


class DensityShading(Layer):
    """How much each place counts, where not all count the same; distances, in colours too, hide it."""

    name = "density"
    title = "Density φ"
    static = True

    def draw(self, canvas: Canvas, scene: Scene) -> None:
        density = scene.environment.density
        hidden = scene.field is not None and "distances" in canvas.shown
        if density is not None and not density.uniform and not hidden:
            draw_shading(canvas, density, scene.environment.region.vertices)

    def legend(self, scene: Scene) -> list[LegendEntry]:
        words = density_words(scene.environment)
        return [density_entry(words)] if words else []


def density_entry(words: str) -> LegendEntry:
    """Return the legend's entry."""

    def glyph(canvas: Canvas, x: float, y: float) -> None:
        wide, high = round(20 * canvas.scale), round(11 * canvas.scale)
        strip = np.broadcast_to(colours(np.linspace(0.0, 1.0, wide), canvas.theme)[None], (high, wide, 4))
        page = pygame.image.frombytes(np.ascontiguousarray(strip).tobytes(), (wide, high), "RGBA")
        canvas.surface.blit(page, (round(x - wide / 2), round(y - high / 2)))

    return LegendEntry(words, glyph)


def draw_shading(canvas: Canvas, density: Density, ring: Array) -> None:
    """Draw the shading within a ring, (k, 2) m, over what is there, premultiplied or opaque.

    Where it is drawn in parts, as the clip says, these are parts of the same picture.
    """
    (low_x, low_y), (high_x, high_y) = ring.min(axis=0).tolist(), ring.max(axis=0).tolist()
    ends = canvas.camera.to_pixels(np.array([[low_x, high_y], [high_x, low_y]]))
    (left, top), (right, bottom) = np.clip(ends, -30000, 30000).astype(int).tolist()
    box = pygame.Rect(left - 1, top - 1, right - left + 3, bottom - top + 3).clip(canvas.surface.get_clip())
    if not box.width or not box.height:
        return
    wide, high = canvas.surface.get_size()
    step = max(1, math.ceil(math.sqrt(wide * high / _DOTS)))
    columns, rows = _Dots.over(box.left, box.width, step), _Dots.over(box.top, box.height, step)
    x = canvas.camera.to_world(np.column_stack([columns.at, np.zeros(len(columns.at))]))[:, 0]
    y = canvas.camera.to_world(np.column_stack([np.zeros(len(rows.at)), rows.at]))[:, 1]
    coarse = 255.0 * parts(density, (low_x, low_y, high_x, high_y), x, y)
    fine = rows.between(columns.between(coarse.T).T)
    table = colours(np.arange(256) / 255.0, canvas.theme).astype(np.uint16)
    table[:, :3] = table[:, :3] * table[:, 3:] // 255
    pixels = table.astype(np.uint8)[np.rint(fine).astype(np.uint8)]
    page = pygame.image.frombytes(pixels.tobytes(), box.size, "RGBA")
    corners = canvas.camera.to_pixels(ring) - np.array(box.topleft)
    mask = pygame.Surface(box.size, pygame.SRCALPHA, 32)
    pygame.draw.polygon(mask, (255, 255, 255, 255), np.rint(np.clip(corners, -3e4, 3e4)).tolist())
    page.blit(mask, (0, 0), special_flags=pygame.BLEND_RGBA_MULT)
    canvas.surface.blit(page, box.topleft, special_flags=pygame.BLEND_PREMULTIPLIED)


class _Dots(NamedTuple):
    """Where the density is looked at along one axis, and how the pixels between are made of that.

    Attributes
    ----------
    at : (d,) px
        Middles of the dots; they are the same whichever pixels are wanted.
    first : (p,)
        The dot before each pixel's middle.
    part : (p, 1)
        How far it is on the way to the next.
    """

    at: Array
    first: IntArray
    part: Array

    @classmethod
    def over(cls, begin: int, count: int, step: int) -> _Dots:
        """Return the dots, `step` pixels apart, for `count` pixels."""
        place = (begin + np.arange(count) + 0.5) / step - 0.5
        first = np.floor(place).astype(np.intp)
        dots = np.arange(first[0], first[-1] + 2)
        return cls((dots + 0.5) * step, first - first[0], (place - first)[:, None])

    def between(self, values: Array) -> Array:
        """Return (p, k) values at the pixels from (d, k) at the dots."""
        before = values[self.first]
        return np.asarray(before + self.part * (values[self.first + 1] - before))
