"""Curves as points, no farther from the curve than a tolerance."""

import math
from collections.abc import Callable

import numpy as np
import shapely

from robocov.arrays import Array, IntArray, concatenate_ranges
from robocov.environment import MAX_SAGITTA_M

CURVE_TOLERANCE_M = (
    MAX_SAGITTA_M  # m between a curve and the line that stands for it at most: as of round obstacles
)
# steps between two breaks at first; and what of the tolerance the middle of a step may be away, which need
# not be where the curve is farthest
_FIRST, _SAFE = 8, 0.8
_LEAST = 8  # points of a whole ellipse at least, however small it is
MAX_POINTS = 250_000  # of one call; a circle of 10 000 km, as far as coordinates go, has 222 thousand


def flatten_beziers(control: Array, tolerance: float, most: int = MAX_POINTS) -> tuple[Array, IntArray]:
    """Return points, (k, 2), of cubic Bézier curves, (n, 4, 2), without their begins; and how many each has.

    The number of equal steps of the parameter is that of Wang's formula: the second differences of the
    control points bound the curvature. (G. Wang, The subdivision method for finding the intersection between
    two Bézier curves or surfaces, Zhejiang University Journal, 1984.) Raises ValueError when there would be
    more than `most`.
    """
    bend = np.hypot(*np.moveaxis(np.diff(control, 2, axis=1), 2, 0)).max(axis=1, initial=0.0)
    count = _counted(np.sqrt(0.75 * bend / tolerance), most)
    a, b, c, d = (control[:, k].repeat(count, axis=0) for k in range(4))
    t = ((concatenate_ranges(np.zeros_like(count), count) + 1) / count.repeat(count))[:, None]
    s = 1.0 - t
    points = s**3 * a + 3.0 * s**2 * t * b + 3.0 * s * t**2 * c + t**3 * d
    points[np.cumsum(count) - 1] = control[:, 3]
    return points, count


def flatten_arcs(
    centre: Array, u: Array, v: Array, begin: Array, sweep: Array, tolerance: float, most: int = MAX_POINTS
) -> tuple[Array, IntArray]:
    """Return points and counts as `beziers` for arcs centre + u cos(a) + v sin(a), a from `begin` on, rad."""
    # the longer half axis: the greater singular value of [u v]
    square, area = (u**2 + v**2).sum(axis=1), u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    radius = np.sqrt((square + np.sqrt(np.maximum(square**2 - 4.0 * area**2, 0.0))) / 2.0)
    # the chord over an angle a is radius (1 - cos(a / 2)) from the arc
    step = 4.0 * np.arcsin(np.sqrt(np.minimum(0.5 * tolerance / np.maximum(radius, 1e-300), 0.5)))
    around = np.abs(sweep)
    count = _counted(np.maximum(around / step, _LEAST * around / math.tau), most)
    part = (concatenate_ranges(np.zeros_like(count), count) + 1) / count.repeat(count)
    angle = begin.repeat(count) + sweep.repeat(count) * part
    c, p, q = (vector.repeat(count, axis=0) for vector in (centre, u, v))
    return c + np.cos(angle)[:, None] * p + np.sin(angle)[:, None] * q, count


def flatten_arc(centre: Array, u: Array, v: Array, begin: float, sweep: float, tolerance: float) -> Array:
    """Return points of one elliptic arc, without its first, (k, 2); see `arcs`."""
    return flatten_arcs(centre[None], u[None], v[None], np.array([begin]), np.array([sweep]), tolerance)[0]


def sample_curve(curve: Callable[[Array], Array], breaks: Array, tolerance: float) -> Array:
    """Return points of a curve, smooth between growing `breaks`: steps are halved until they are near."""
    part = np.arange(_FIRST) / _FIRST
    t = np.append((breaks[:-1, None] + np.diff(breaks)[:, None] * part).ravel(), breaks[-1])
    points = curve(t)
    while len(t) < MAX_POINTS:
        middle = (t[:-1] + t[1:]) / 2
        between = curve(middle)
        chord = shapely.linestrings(np.stack([points[:-1], points[1:]], axis=1))
        bent = shapely.distance(chord, shapely.points(between)) > _SAFE * tolerance
        if not bent.any():
            break
        at = np.flatnonzero(bent) + 1
        t, points = np.insert(t, at, middle[bent]), np.insert(points, at, between[bent], axis=0)
    return points


def _counted(count: Array, most: int) -> IntArray:
    whole = np.ceil(np.clip(count, 1.0, most + 1.0))
    if not whole.sum() <= most:  # nan is too many
        raise ValueError(f"expected at most {most} points, got more")
    return whole.astype(np.intp)
