"""Directions, and distances from edges, in the plane."""

import math
from typing import TypeAlias

import numpy as np

from robocov.typing import FloatArray

Point: TypeAlias = tuple[float, float]

SHIFT_ANGLE_DEG = 45.0
"""While Shift is held, lines and moves have a multiple of this angle."""


def find_nearest_on_edges(
    starts: FloatArray, ends: FloatArray, point: Point
) -> tuple[FloatArray, FloatArray]:
    """Find the point of each edge that is nearest to a given point.

    Parameters
    ----------
    starts, ends : (k, 2) array, m
        Ends of the edges.
    point : Point
        The point, m.

    Returns
    -------
    nearest : (k, 2) array, m
        The nearest point of each edge.
    distances : (k,) array, m
        Its distance from the point.
    """
    along = ends - starts
    # Edges of length 0 are divided by 1 instead.
    squared = np.einsum("kd,kd->k", along, along)
    fractions = np.einsum("kd,kd->k", np.array(point) - starts, along) / np.where(squared > 0.0, squared, 1.0)
    feet = starts + np.clip(fractions, 0.0, 1.0)[:, None] * along
    return feet, np.hypot(*(feet - point).T)


def compute_cos_sin(degrees: float) -> tuple[float, float]:
    """Return the cosine and sine of an angle; the values at multiples of 90° are exact."""
    quarters, rest = divmod(degrees, 90.0)
    if rest == 0.0:
        return ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[int(quarters) % 4]
    return math.cos(math.radians(degrees)), math.sin(math.radians(degrees))


def compute_bearing(a: Point, b: Point) -> float:
    """Return the direction from point a to point b, in degrees counter-clockwise from the x axis."""
    return math.degrees(math.atan2(b[1] - a[1], b[0] - a[0]))


def constrain_angle(origin: Point, point: Point) -> Point:
    """Move a point to the nearest line through `origin` whose angle is a multiple of `SHIFT_ANGLE_DEG`."""
    cos, sin = compute_cos_sin(SHIFT_ANGLE_DEG * round(compute_bearing(origin, point) / SHIFT_ANGLE_DEG))
    along = (point[0] - origin[0]) * cos + (point[1] - origin[1]) * sin
    # Adding 0.0 turns -0.0 into 0.0.
    return round(origin[0] + along * cos, 9) + 0.0, round(origin[1] + along * sin, 9) + 0.0
