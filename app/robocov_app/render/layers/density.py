"""The layer of the density."""

import math
from collections.abc import Callable

import numpy as np
import pygame
from numpy.typing import NDArray

from robocov.density import Density
from robocov.typing import FloatArray
from robocov_app.look.theme import Theme
from robocov_app.render.canvas import Canvas, LegendEntry
from robocov_app.render.clipping import clip_polygon, limit_pixels
from robocov_app.render.density_shading import Bounds, color_density, compute_density_fractions
from robocov_app.render.density_text import describe_density
from robocov_app.render.pixel_arrays import build_surface, convert_axes_to_world
from robocov_app.render.scene import Scene

_MAX_SAMPLES = 60_000
"""Maximum number of density samples on a surface; values between samples are interpolated."""
_SYMBOL_WIDTH_PX = 20
_SYMBOL_HEIGHT_PX = 11


def draw_density(canvas: Canvas, scene: Scene) -> None:
    """Draw the density, unless it is uniform or below a distance map."""
    density = scene.environment.density
    is_hidden = scene.field is not None and "distances" in canvas.visible_layers
    if density is not None and not density.is_uniform and not is_hidden:
        draw_density_shading(canvas, density, scene.environment.region.vertices)


def draw_density_shading(canvas: Canvas, density: Density, outline: FloatArray) -> None:
    """Draw a density within an outline.

    The samples do not depend on the clip of the surface, so that parts drawn one by one fit together.

    Parameters
    ----------
    canvas : Canvas
    density : Density
    outline : (k, 2) array, m
    """
    low_x, low_y = outline.min(axis=0).tolist()
    high_x, high_y = outline.max(axis=0).tolist()
    bounds = (low_x, low_y, high_x, high_y)
    box = _find_box(canvas, bounds)
    if not box.width or not box.height:
        return
    fractions = _interpolate_fractions(canvas, density, bounds, box)
    page = build_surface(_build_premultiplied_table(canvas.theme)[fractions])
    mask = pygame.Surface(box.size, pygame.SRCALPHA, 32)
    corners = canvas.camera.to_pixels(outline) - np.array(box.topleft)
    for ring in clip_polygon(corners):
        pygame.draw.polygon(mask, (255, 255, 255, 255), np.rint(ring).tolist())
    page.blit(mask, (0, 0), special_flags=pygame.BLEND_RGBA_MULT)
    canvas.surface.blit(page, box.topleft, special_flags=pygame.BLEND_PREMULTIPLIED)


def _find_box(canvas: Canvas, bounds: Bounds) -> pygame.Rect:
    """Return the part of bounds, m, that is inside the clip of the surface, px."""
    low_x, low_y, high_x, high_y = bounds
    ends = canvas.camera.to_pixels(np.array([[low_x, high_y], [high_x, low_y]]))
    (left, top), (right, bottom) = limit_pixels(ends).astype(int).tolist()
    box = pygame.Rect(left - 1, top - 1, right - left + 3, bottom - top + 3)
    return box.clip(canvas.surface.get_clip())


def _interpolate_fractions(
    canvas: Canvas, density: Density, bounds: Bounds, box: pygame.Rect
) -> NDArray[np.uint8]:
    """Return the density at each pixel of a box, (h, w), from 0 for the lowest to 255 for the highest."""
    width, height = canvas.surface.get_size()
    step = max(1, math.ceil(math.sqrt(width * height / _MAX_SAMPLES)))
    columns, interpolate_columns = _place_samples(box.left, box.width, step)
    rows, interpolate_rows = _place_samples(box.top, box.height, step)
    x, y = convert_axes_to_world(canvas.camera, columns, rows)
    samples = 255.0 * compute_density_fractions(density, bounds, x, y)
    fine_rows = interpolate_columns(samples.T).T
    return np.asarray(np.rint(interpolate_rows(fine_rows)).astype(np.uint8))


def _place_samples(
    start: int, count: int, step: int
) -> tuple[FloatArray, Callable[[FloatArray], FloatArray]]:
    """Place samples one step apart along an axis.

    Sample i is at the pixel coordinate (i + 0.5) * step wherever the box starts, so that adjacent boxes fit
    together.

    Parameters
    ----------
    start, count : int
        First pixel, and number of pixels.
    step : int, px

    Returns
    -------
    samples : (d,) array, px
    interpolate : callable
        Interpolates values at the samples, (d, k), linearly to values at the pixels, (count, k).
    """
    sample_units = (start + np.arange(count) + 0.5) / step - 0.5
    before = np.floor(sample_units).astype(np.intp)
    weights = (sample_units - before)[:, None]
    indices = before - before[0]

    def interpolate(values: FloatArray) -> FloatArray:
        low = values[indices]
        high = values[indices + 1]
        return np.asarray(low + weights * (high - low))

    samples = (np.arange(before[0], before[-1] + 2) + 0.5) * step
    return samples, interpolate


def _build_premultiplied_table(theme: Theme) -> NDArray[np.uint8]:
    """Return the premultiplied RGBA colors, (256, 4), from the lowest density to the highest."""
    table = color_density(np.arange(256) / 255.0, theme).astype(np.uint16)
    table[:, :3] = table[:, :3] * table[:, 3:] // 255
    return table.astype(np.uint8)


def build_density_legend(scene: Scene) -> list[LegendEntry]:
    """Build the legend of the density; empty if the density is uniform."""
    text = describe_density(scene.environment)
    if not text:
        return []
    return [build_density_entry(text)]


def build_density_entry(text: str) -> LegendEntry:
    """Build the entry of the density in a legend."""

    def color_row(theme: Theme, count: int) -> NDArray[np.uint8]:
        return color_density(np.linspace(0.0, 1.0, count), theme)

    return build_gradient_entry(text, color_row)


def build_gradient_entry(text: str, color_row: Callable[[Theme, int], NDArray[np.uint8]]) -> LegendEntry:
    """Build an entry of a legend whose symbol is a color gradient.

    Parameters
    ----------
    text : str
    color_row : callable
        Called with a theme and a count; returns as many colors, (count, 3) or (count, 4), from low to high.

    Returns
    -------
    LegendEntry
    """

    def draw_symbol(canvas: Canvas, x: float, y: float) -> None:
        width = round(_SYMBOL_WIDTH_PX * canvas.scale)
        height = round(_SYMBOL_HEIGHT_PX * canvas.scale)
        row = color_row(canvas.theme, width)
        picture = build_surface(np.broadcast_to(row, (height, *row.shape)))
        canvas.surface.blit(picture, (round(x - width / 2), round(y - height / 2)))

    return LegendEntry(text, draw_symbol)
