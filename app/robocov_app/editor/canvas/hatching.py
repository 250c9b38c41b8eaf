"""Hatching of areas that are too narrow for robots, and of areas that are cut off from the rest."""

from typing import NamedTuple

import numpy as np
import pygame
from pygame import Rect, Surface
from shapely import total_bounds

from robocov_app.editor.canvas.outlines import Outline, build_outline
from robocov_app.editor.canvas.sheet_view import View, compute_pixel_box
from robocov_app.editor.model.measurement import Measurement
from robocov_app.look.colors import Color

HATCH_STEP_PX = 7  # distance between hatch lines, at scale 1
LINE_WIDTH_PX = 1.2  # of hatch lines, at scale 1
MIN_HATCH_STEP_PX = 4  # at any scale
CUT_OFF_STRENGTH = 0.5
_WHITE = (255, 255, 255)
_TRANSPARENT = (0, 0, 0, 0)
_TINT_OPACITY = 56
_LINE_OPACITY = 235


class _HatchedArea(NamedTuple):
    """An area with the color of its hatching, and the opacity from 0 to 1."""

    outline: Outline
    color: Color
    strength: float


def render_hatching(view: View, measurement: Measurement) -> tuple[Surface, Rect] | None:
    """Hatch the areas that are too narrow for robots, and the areas that are cut off from the rest.

    Parameters
    ----------
    view : View
        The view of the sheet.
    measurement : Measurement
        Its `impassable` area is too narrow, and its `cut_off` area is cut off.

    Returns
    -------
    tuple of Surface and Rect, or None
        A premultiplied image and its position in the window, px; None if nothing is visible.
    """
    areas: list[_HatchedArea] = []
    if not measurement.cut_off.is_empty:
        cut_off = build_outline(measurement.cut_off)
        areas.append(_HatchedArea(cut_off, view.theme.cut_off, CUT_OFF_STRENGTH))
    if not measurement.impassable.is_empty:
        impassable = build_outline(measurement.impassable)
        areas.append(_HatchedArea(impassable, view.theme.warning, 1.0))
    if not areas:
        return None
    bounds = total_bounds([area.outline.geometry for area in areas])
    box = compute_pixel_box(view.camera, bounds).clip(view.clip)
    if not box:
        return None
    image = Surface(box.size, pygame.SRCALPHA, 32)
    for area in areas:
        _hatch_area(view, image, box, area)
    return image, box


def _hatch_area(view: View, image: Surface, box: Rect, area: _HatchedArea) -> None:
    """Hatch one area.

    Parameters
    ----------
    view : View
        The view of the sheet.
    image : Surface
        Premultiplied image to draw on.
    box : Rect
        Position of the image in the window, px.
    area : _HatchedArea
    """
    outline = area.outline
    mask = view.build_canvas(Surface(box.size, pygame.SRCALPHA, 32))
    edges = view.build_canvas(image)
    rings = [view.camera.to_pixels(ring) - np.array(box.topleft) for ring in outline.rings]
    for ring, is_outer in zip(rings, outline.outer, strict=True):
        if is_outer:
            mask.fill_polygon(ring, (*_WHITE, 255))
            # Areas thinner than a pixel stay visible as a line.
            mask.draw_outline(ring, _WHITE, 1)
        else:
            mask.fill_polygon(ring, _TRANSPARENT)
    lines = render_hatch_pattern(box, area.color, view.scale, area.strength)
    mask.surface.blit(lines, (0, 0), special_flags=pygame.BLEND_RGBA_MULT)
    image.blit(mask.surface.premul_alpha(), (0, 0), special_flags=pygame.BLEND_PREMULTIPLIED)
    for ring, is_outer in zip(rings, outline.outer, strict=True):
        if is_outer:
            edges.draw_outline(ring, area.color, edges.scale_width(1.0))


def render_hatch_pattern(box: Rect, color: Color, scale: float, strength: float = 1.0) -> Surface:
    """Draw an image of diagonal lines over a tint.

    Parameters
    ----------
    box : Rect
        Box of the window that the image covers, px.
    color : tuple of int
        Color of the lines and the tint.
    scale : float
        Scale of the window.
    strength : float
        Opacity, from 0 to 1.

    Returns
    -------
    Surface
        Image of the size of the box.
    """
    image = Surface(box.size, pygame.SRCALPHA, 32)
    image.fill((*color, round(_TINT_OPACITY * strength)))
    step = max(MIN_HATCH_STEP_PX, round(HATCH_STEP_PX * scale))
    thickness = max(1, round(LINE_WIDTH_PX * scale))
    line_color = (*color, round(_LINE_OPACITY * strength))
    # The lines have fixed positions in the window, regardless of the position of the box.
    first = -((box.left + box.top) % step)
    for x in range(first, box.width + box.height, step):
        pygame.draw.line(image, line_color, (x, 0), (x - box.height, box.height), thickness)
    return image
