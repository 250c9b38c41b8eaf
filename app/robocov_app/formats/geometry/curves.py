"""Approximation of curves by points, within a tolerance."""

import math
from collections.abc import Callable

import numpy as np
import shapely

from robocov.arrays import concatenate_ranges
from robocov.environment import MAX_SAGITTA_M
from robocov.typing import BoolArray, FloatArray, IntArray

CURVE_TOLERANCE_M = MAX_SAGITTA_M
"""Maximum distance between a curve and its approximation, the same as for round obstacles."""
MAX_POINTS = 250_000
"""Maximum number of points of one call. The largest circle, with a radius of 10 000 km, has 222 thousand."""
_FIRST_STEPS = 8
"""Initial number of steps between two breaks."""
_MIDPOINT_SAFETY = 0.8
"""Fraction of the tolerance allowed at the midpoint of a step; the curve may deviate more elsewhere."""
_MIN_ELLIPSE_POINTS = 8


def flatten_beziers(
    control: FloatArray, tolerance: float, maximum: int = MAX_POINTS
) -> tuple[FloatArray, IntArray]:
    """Approximate cubic Bézier curves by points.

    Parameters
    ----------
    control : (n, 4, 2) array
        Control points of each curve.
    tolerance : float
        Maximum distance from the curve.
    maximum : int
        Maximum number of points.

    Returns
    -------
    points : (k, 2) array
        Points of all curves; the first point of each curve is omitted.
    count : (n,) array of int
        Number of points of each curve.

    Raises
    ------
    ValueError
        If more than `maximum` points are needed.

    Notes
    -----
    The number of equal steps of the parameter is that of Wang's formula: the second differences of the
    control points bound the curvature. (G. Wang, The subdivision method for finding the intersection between
    two Bézier curves or surfaces, Zhejiang University Journal, 1984.)
    """
    second_difference = np.moveaxis(np.diff(control, 2, axis=1), 2, 0)
    bend = np.hypot(*second_difference).max(axis=1, initial=0.0)
    count = _round_counts(np.sqrt(0.75 * bend / tolerance), maximum)
    a, b, c, d = [control[:, k].repeat(count, axis=0) for k in range(4)]
    t = _build_fractions(count)[:, None]
    s = 1.0 - t
    points = s**3 * a + 3.0 * s**2 * t * b + 3.0 * s * t**2 * c + t**3 * d
    # The last point of each curve is exact.
    points[np.cumsum(count) - 1] = control[:, 3]
    return points, count


def flatten_arcs(
    centers: FloatArray,
    u: FloatArray,
    v: FloatArray,
    starts: FloatArray,
    sweeps: FloatArray,
    *,
    tolerance: float,
    maximum: int = MAX_POINTS,
) -> tuple[FloatArray, IntArray]:
    """Approximate elliptic arcs, center + u cos(a) + v sin(a), by points.

    Parameters
    ----------
    centers, u, v : (n, 2) arrays
    starts, sweeps : (n,) arrays, rad
        Angle at the start, and signed angle from there to the end.
    tolerance, maximum
        See `flatten_beziers`.

    Returns
    -------
    points : (k, 2) array
        Points of all arcs; the first point of each arc is omitted.
    count : (n,) array of int
        Number of points of each arc.

    Raises
    ------
    ValueError
        If more than `maximum` points are needed.
    """
    # The larger semi-axis is the larger singular value of the matrix [u v].
    square = (u**2 + v**2).sum(axis=1)
    area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    radius = np.sqrt((square + np.sqrt(np.maximum(square**2 - 4.0 * area**2, 0.0))) / 2.0)
    # The chord of an angle a is at most radius (1 - cos(a / 2)) from the arc.
    step = 4.0 * np.arcsin(np.sqrt(np.minimum(0.5 * tolerance / np.maximum(radius, 1e-300), 0.5)))
    angle = np.abs(sweeps)
    count = _round_counts(np.maximum(angle / step, _MIN_ELLIPSE_POINTS * angle / math.tau), maximum)
    angles = starts.repeat(count) + sweeps.repeat(count) * _build_fractions(count)
    centers = centers.repeat(count, axis=0)
    u = u.repeat(count, axis=0)
    v = v.repeat(count, axis=0)
    return centers + np.cos(angles)[:, None] * u + np.sin(angles)[:, None] * v, count


def flatten_arc(
    center: FloatArray, u: FloatArray, v: FloatArray, *, start: float, sweep: float, tolerance: float
) -> FloatArray:
    """Return the points of an elliptic arc, (k, 2), except for the first one; see `flatten_arcs`."""
    points, _ = flatten_arcs(
        center[None], u[None], v[None], np.array([start]), np.array([sweep]), tolerance=tolerance
    )
    return points


def sample_curve(
    curve: Callable[[FloatArray], FloatArray], breaks: FloatArray, tolerance: float
) -> FloatArray:
    """Sample a curve at points so close that the lines between them are within a tolerance.

    Parameters
    ----------
    curve : callable
        Returns points, (k, 2), at parameters, (k,).
    breaks : (n,) array
        Increasing parameters between which the curve is smooth, including its start and end.
    tolerance : float
        Maximum distance between the curve and the lines.

    Returns
    -------
    (k, 2) array
    """
    fractions = np.arange(_FIRST_STEPS) / _FIRST_STEPS
    starts = breaks[:-1, None] + np.diff(breaks)[:, None] * fractions
    t = np.append(starts.ravel(), breaks[-1])
    points = curve(t)
    while len(t) < MAX_POINTS:
        middle = (t[:-1] + t[1:]) / 2
        midpoints = curve(middle)
        chords = shapely.linestrings(np.stack([points[:-1], points[1:]], axis=1))
        distance = shapely.distance(chords, shapely.points(midpoints))
        is_bent: BoolArray = distance > _MIDPOINT_SAFETY * tolerance
        if not is_bent.any():
            break
        index = np.flatnonzero(is_bent) + 1
        t = np.insert(t, index, middle[is_bent])
        points = np.insert(points, index, midpoints[is_bent], axis=0)
    return points


def _build_fractions(count: IntArray) -> FloatArray:
    """Return 1/n, 2/n, ..., 1 for each count n, one after the other."""
    return np.asarray((concatenate_ranges(np.zeros_like(count), count) + 1) / count.repeat(count))


def _round_counts(count: FloatArray, maximum: int) -> IntArray:
    """Round counts up to integers of at least 1; raise ValueError if their sum exceeds `maximum`."""
    whole = np.ceil(np.clip(count, 1.0, maximum + 1.0))
    if not whole.sum() <= maximum:  # The sum may be nan.
        raise ValueError(f"expected at most {maximum} points, got more")
    return whole.astype(np.intp)
