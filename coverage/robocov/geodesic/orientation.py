"""A grid of integers on which the side of a line that a point lies on is decided exactly."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from robocov.arrays import Array
from robocov.compiled import inlined_kernel, kernel

BITS = 48
"""The square that holds the map is 2**48 grid steps wide: 4e-15 of its side, below a double's rounding
for a map that does not start at zero, yet few enough that `cross` can be exact."""

_DOUBT = 2.0**48
"""More than the roundings of a cross product of two differences, whose products are below 2**98."""


@dataclass(frozen=True, slots=True, eq=False)
class Grid:
    """Integer coordinates, kept in floats, for the points of one map.

    Attributes
    ----------
    origin : (2,) m
        Lower left corner of the map.
    unit : float, m
        One grid step, a power of two, so that no length is rounded by the change of scale.
    """

    origin: Array
    unit: float

    @classmethod
    def over(cls, low: Array, side: float) -> Grid:
        """Return the grid for points from `low` (2,) m to `side` metres right of and above it."""
        return cls(np.asarray(low, dtype=float), 2.0 ** (math.ceil(math.log2(side)) - BITS))

    def snap(self, points: Array) -> Array:
        """Return (..., 2) metres as grid coordinates, rounded to whole steps."""
        return np.rint((points - self.origin) / self.unit)

    def metres(self, points: Array) -> Array:
        """Return (..., 2) grid coordinates as metres."""
        return np.asarray(points * self.unit + self.origin)


@inlined_kernel
def cross(ux: float, uy: float, vx: float, vy: float) -> float:
    """Return ``ux vy - uy vx`` with its exact sign.

    Positive where v points to the left of u. The value is rounded as usual; the sign is right for
    whole numbers of magnitude up to 2**49, which differences of grid coordinates are.

    >>> big = 2.0**40 + 1
    >>> cross(big, big - 1, big + 1, big)  # naive floats give 0
    1.0
    """
    value = ux * vy - uy * vx
    if abs(value) < _DOUBT:
        # integers wrap around at 2**64, so that a small difference of large products comes out right
        value = float(int(ux) * int(vy) - int(uy) * int(vx))
    return value


@kernel
def crosses(u: Array, v: Array) -> Array:
    """Return the cross products of (n, 2) vectors."""
    values = np.empty(len(u))
    for i in range(len(u)):
        values[i] = cross(u[i, 0], u[i, 1], v[i, 0], v[i, 1])
    return values
