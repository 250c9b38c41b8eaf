"""Trajectories that fade into the past."""

from itertools import pairwise
from typing import NamedTuple, TypeAlias

import numpy as np
import pygame

from robocov.typing import BoolArray, FloatArray, IntArray
from robocov_app.look.colors import Color
from robocov_app.render.canvas import Canvas, premultiply
from robocov_app.render.clipping import limit_pixels
from robocov_app.render.sprites import Sketch, find_visible_box

FADE_STEPS = 24
"""Number of shades, and of times that a section is drawn again until it has faded away."""
MARGIN_PX = 5.0
"""Space around trajectories, px, in addition to their width."""
FADE_PIECE_PX = 4.0
"""Distance that the fastest robot covers between two drawn corners, at scale 1."""
_SUPERSAMPLING = 2
"""Trajectories are drawn this many times larger and then shrunk, for antialiasing."""
_FADE_EXPONENT = 0.7
"""Below 1, trajectories fade slowly at first, so that older parts can still be followed."""
_MIN_ROUNDED_WIDTH_PX = 2.5
"""The joints of wider lines are rounded, px."""


RgbaColor: TypeAlias = tuple[int, int, int, int]


class Pen(NamedTuple):
    """Look of trajectories.

    Attributes
    ----------
    colors : list of Color
        Color of each robot.
    width : float, px
    """

    colors: list[Color]
    width: float


def draw_fading_trails(
    page: pygame.Surface, canvas: Canvas, trail: FloatArray, times: FloatArray, *, fade: float, pen: Pen
) -> None:
    """Draw the most recent part of trajectories: the older, the more transparent.

    Parameters
    ----------
    page : pygame.Surface
        Transparent surface that is drawn on.
    canvas : Canvas
        Its camera and scale are used.
    trail : (k, n, 2) array, m
        nan for absent robots.
    times : (k,) array, s
    fade : float, s
        Time after which a section has faded away.
    pen : Pen
    """
    first_row = int(np.searchsorted(times, times[-1] - fade))
    pixels = limit_pixels(canvas.camera.to_pixels(trail[first_row:]))
    box = find_visible_box(pixels, MARGIN_PX + pen.width, page)
    if box is None:
        return
    ages = np.ceil((times[-1] - times[first_row:]) / fade * FADE_STEPS)
    # Rounding errors may give one step too many.
    steps = np.minimum(ages, FADE_STEPS).astype(int)
    rows = _select_corners(pixels, steps, FADE_PIECE_PX * canvas.scale)
    steps = steps[rows]
    sketch = Sketch(box, _SUPERSAMPLING)
    points = (pixels[rows] - np.array(box.topleft) + 0.5) * _SUPERSAMPLING
    # All robots' sections of one shade are drawn before newer ones, so that these are on top at crossings.
    bounds = [0, *(np.flatnonzero(np.diff(steps)) + 1).tolist(), len(rows) - 1]
    tips = np.full((len(pen.colors), 2), np.nan)
    for start, end in pairwise(bounds):
        # Each shade has the opacity of the middle of its step.
        opacity = (1.0 - max(float(steps[start]) - 0.5, 0.0) / FADE_STEPS) ** _FADE_EXPONENT
        tips = _draw_shade(sketch, points[start : end + 1], tips, opacity, pen)
    sketch.draw_on(page)


def _draw_shade(sketch: Sketch, points: FloatArray, tips: FloatArray, opacity: float, pen: Pen) -> FloatArray:
    """Draw the section of each trajectory that has a given shade.

    All positions are in pixels of the sketch, which is enlarged by `_SUPERSAMPLING`.

    Parameters
    ----------
    sketch : Sketch
    points : (k, n, 2) array, px
    tips : (n, 2) array, px
        Ends of the sections drawn before; nan for robots without one.
    opacity : float
    pen : Pen

    Returns
    -------
    (n, 2) array, px
        The ends of the sections drawn now; unchanged for robots that have hardly moved.
    """
    shades = {color: premultiply(color, opacity) for color in set(pen.colors)}
    width = max(1, round(pen.width * _SUPERSAMPLING))
    is_rounded = width > _MIN_ROUNDED_WIDTH_PX * _SUPERSAMPLING
    # Negated, so that robots without a tip (nan) count as moved.
    has_moved = ~(np.abs(points - tips).max(axis=(0, 2)) < _SUPERSAMPLING)
    is_present: BoolArray = np.asarray(np.isfinite(points).all(axis=(0, 2)))
    continues = is_present & ~np.isnan(tips[:, 0])
    paths = points.copy()
    # Each section starts where the one before it ended, so that there are no gaps between them.
    paths[0, continues] = tips[continues]
    for robot in np.flatnonzero(has_moved).tolist():
        path = paths[:, robot]
        lines = [path.tolist()] if is_present[robot] else _split_at_absences(path)
        for line in lines:
            if len(line) > 1:
                _draw_line(sketch.large, line, shades[pen.colors[robot]], width, is_rounded=is_rounded)
    new_tips = tips.copy()
    new_tips[has_moved] = points[-1, has_moved]
    return new_tips


def _draw_line(
    large: pygame.Surface, line: list[list[float]], color: RgbaColor, width: int, *, is_rounded: bool
) -> None:
    pygame.draw.lines(large, color, False, line, width)
    if is_rounded:
        # Lines have straight ends, which leave notches at the corners.
        for point in line:
            pygame.draw.circle(large, color, point, width / 2)


def _select_corners(points: FloatArray, steps: IntArray, min_distance: float) -> IntArray:
    """Select the rows of trajectories at which they are drawn: few if all robots are slow.

    Parameters
    ----------
    points : (k, n, 2) array, px
    steps : (k,) int array
        Shade of each row; rows where it changes are selected.
    min_distance : float, px
        Distance that the fastest robot covers between two rows.

    Returns
    -------
    (m,) int array
    """
    is_absent = np.isnan(points[..., 0])
    lengths = np.hypot(*np.moveaxis(np.diff(points, axis=0), -1, 0))
    max_lengths = np.where(np.isnan(lengths), 0.0, lengths).max(axis=1)
    pieces = np.floor(np.cumsum(max_lengths) / min_distance)
    changes_presence = (is_absent[1:] != is_absent[:-1]).any(axis=1)
    starts_piece = np.diff(pieces, prepend=0.0) > 0
    changes_shade = np.diff(steps) != 0
    is_needed = np.append(True, starts_piece | changes_shade | changes_presence)
    # The row before a robot joins or fails is needed as well.
    is_needed[:-1] |= changes_presence
    is_needed[-1] = True
    return np.flatnonzero(is_needed)


def _split_at_absences(path: FloatArray) -> list[list[list[float]]]:
    """Return the parts of a path, (k, 2), during which its robot is present."""
    is_present = np.isfinite(path[:, 0])
    pieces = np.split(path, np.flatnonzero(np.diff(is_present)) + 1)
    return [piece.tolist() for piece in pieces if np.isfinite(piece[0, 0])]
