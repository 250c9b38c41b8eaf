"""The layer of ray scans, the measurements of range sensors in all directions."""

from functools import partial
from typing import NamedTuple

import numpy as np
import pygame

from robocov.typing import FloatArray
from robocov_app.look.colors import Color, mix
from robocov_app.render import sprites
from robocov_app.render.canvas import Canvas, premultiply
from robocov_app.render.clipping import clip_polygon, clip_segment, limit_pixels
from robocov_app.render.layers.layer import build_legend
from robocov_app.render.scene import Scene

_SUPERSAMPLING = 2
"""Scans are drawn larger and shrunk: drawing hundreds of smooth rays would take far longer."""
_HIT_RADIUS_PX = 1.5
"""Radius of the end of a ray, at scale 1."""
_MIN_RAY_GAP_PX = 5.0
"""Minimum distance between rays, at scale 1; nearer to the robot, every second ray is left out."""
_FIRST_RAY_PX = 12.0
"""Distance from the robot at which rays start, at scale 1."""
_MARGIN_PX = 3.0
"""Space around scans, px, for the width of their outlines."""
_RAY_WIDTH_PX = 0.5
_SYMBOL_SIZE_PX = 8
"""Half the length of the rays in the symbol of the legend."""
_SYMBOL_ANGLES_RAD = (-0.6, -0.3, 0.0, 0.3, 0.6)
_SYMBOL_STRETCH = 1.15
"""Factor of the height of the symbol."""
_SYMBOL_RAY_STRENGTH = 0.55
"""Fraction of the color of final positions in that of the rays of the symbol."""
_MAX_RANGE_TOLERANCE = 1e-6
_AREA_OPACITY = 0.11
_RAY_OPACITY = 0.3
_OUTLINE_OPACITY = 0.4


class _Scan(NamedTuple):
    """A scan on a surface.

    Attributes
    ----------
    position : (2,) array, px
        Position of the sensor.
    ends : (r, 2) array, px
        Ends of the rays.
    """

    position: FloatArray
    ends: FloatArray

    @property
    def hits(self) -> FloatArray:
        """Ends of the rays that hit an obstacle, (k, 2) px: those shorter than the longest ray."""
        lengths = np.hypot(*(self.ends - self.position).T)
        return np.asarray(self.ends[lengths < lengths.max() * (1.0 - _MAX_RANGE_TOLERANCE)])


def draw_dots(canvas: Canvas, centers: FloatArray, radius: float, color: Color) -> None:
    """Draw dots; those that coincide after rounding to a quarter of a pixel are drawn once.

    Parameters
    ----------
    canvas : Canvas
    centers : (n, 2) array, px
    radius : float, px
    color : Color
    """
    quarters = np.unique(np.rint((centers + 0.5) * sprites.SUPERSAMPLING), axis=0)
    different = quarters / sprites.SUPERSAMPLING - 0.5
    canvas.draw_sprites([partial(sprites.render_dot, radius, color)], different)


def draw_scans(canvas: Canvas, scene: Scene) -> None:
    """Draw the scanned area of each range sensor, its rays, and dots where they hit an obstacle."""
    to_pixels = canvas.camera.to_pixels
    scans = [_Scan(to_pixels(position), to_pixels(ends)) for position, ends in scene.scans]
    all_ends = np.concatenate([scan.ends for scan in scans])
    box = sprites.find_visible_box(limit_pixels(all_ends), _MARGIN_PX, canvas.surface)
    if box is None:
        return
    sketch = sprites.Sketch(box, _SUPERSAMPLING)
    _draw_large_scans(sketch, canvas, scans)
    sketch.draw_on(canvas.surface)
    hits = np.concatenate([scan.hits for scan in scans])
    draw_dots(canvas, hits, _HIT_RADIUS_PX * canvas.scale, canvas.theme.final)


def _draw_large_scans(sketch: sprites.Sketch, canvas: Canvas, scans: list[_Scan]) -> None:
    """Draw scans on a sketch: areas, then rays, then outlines.

    Drawing on the sketch replaces colors instead of blending them, so that overlaps are not darker.
    """
    color = canvas.theme.final
    large = sketch.large
    corner = np.array(sketch.box.topleft) - 0.5
    large_scans = [
        _Scan((scan.position - corner) * _SUPERSAMPLING, (scan.ends - corner) * _SUPERSAMPLING)
        for scan in scans
    ]
    outlines: list[FloatArray] = []
    for scan in large_scans:
        outlines += clip_polygon(scan.ends)
    for outline in outlines:
        pygame.draw.polygon(large, premultiply(color, _AREA_OPACITY), np.rint(outline).tolist())
    for scan in large_scans:
        _draw_rays(large, scan, canvas)
    for outline in outlines:
        pygame.draw.lines(large, premultiply(color, _OUTLINE_OPACITY), True, outline.tolist(), _SUPERSAMPLING)


def _draw_rays(large: pygame.Surface, scan: _Scan, canvas: Canvas) -> None:
    """Draw the rays of an enlarged scan, each from where rays are far enough apart."""
    along = scan.ends - scan.position
    lengths = np.hypot(along[:, 0], along[:, 1])
    starts = _choose_ray_starts(len(scan.ends)) * canvas.scale * _SUPERSAMPLING
    is_visible = lengths > starts + _SUPERSAMPLING
    fractions = starts[is_visible] / lengths[is_visible]
    first_points = scan.position + along[is_visible] * fractions[:, None]
    color = premultiply(canvas.theme.final, _RAY_OPACITY)
    width = max(1, round(_RAY_WIDTH_PX * canvas.scale * _SUPERSAMPLING))
    for start, end in zip(first_points.tolist(), scan.ends[is_visible].tolist(), strict=True):
        visible_ends = clip_segment(start, end)
        if visible_ends:
            pygame.draw.line(large, color, visible_ends[0], visible_ends[1], width)


def _choose_ray_starts(n_rays: int) -> FloatArray:
    """Return the distance from the robot at which each ray starts, px at scale 1."""
    rays = np.arange(n_rays)
    starts = np.full(n_rays, _MIN_RAY_GAP_PX * n_rays / (2 * np.pi))
    # Every second ray starts at half the distance, every fourth at a quarter, every eighth at an eighth.
    for divisor in (2, 4, 8):
        starts[rays % divisor == 0] /= 2
    return np.asarray(np.maximum(starts, _FIRST_RAY_PX))


def _draw_scan_symbol(canvas: Canvas, x: float, y: float) -> None:
    size = _SYMBOL_SIZE_PX * canvas.scale
    angles = np.array(_SYMBOL_ANGLES_RAD)
    ends_x = x - size + 2 * size * np.cos(angles)
    ends_y = y + _SYMBOL_STRETCH * size * np.sin(angles)
    ends = np.column_stack([ends_x, ends_y])
    ray_color = mix(canvas.theme.background, canvas.theme.final, _SYMBOL_RAY_STRENGTH)
    for end in ends.tolist():
        canvas.draw_line((x - size, y), end, ray_color)
    draw_dots(canvas, ends, _HIT_RADIUS_PX * canvas.scale, canvas.theme.final)


build_scans_legend = build_legend("ray scan", _draw_scan_symbol)
