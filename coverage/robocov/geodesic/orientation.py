"""A grid of integers on which the side of a line that a point lies on is decided exactly."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from robocov.arrays import Array, IntArray

BITS = 48
"""The square that holds the map is 2**48 grid steps wide: 4e-15 of its side, below a double's rounding
for a map that does not start at zero, yet few enough that `cross` can be exact."""

_DOUBT = 2.0**48
"""More than the roundings of a cross product of two differences, whose products are below 2**98."""

_LIMB = 24
_MASK = (1 << _LIMB) - 1


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


def cross(ux: Array, uy: Array, vx: Array, vy: Array) -> Array:
    """Return ``ux vy - uy vx`` with its exact sign; the four broadcast against each other.

    Positive where v points to the left of u. The value is rounded as usual; the sign is right for
    whole numbers of magnitude up to 2**49, which differences of grid coordinates are.

    >>> big = np.array([2.0**40 + 1])
    >>> cross(big, big - 1, big + 1, big)  # naive floats give 0
    array([1.])
    """
    value = ux * vy - uy * vx
    size = np.abs(value)
    if np.minimum.reduce(size, axis=None, initial=np.inf) < _DOUBT:
        at = (size < _DOUBT).nonzero()
        value[at] = _exact_cross(*(part[at] for part in np.broadcast_arrays(ux, uy, vx, vy)))
    return value


def _exact_cross(ux: Array, uy: Array, vx: Array, vy: Array) -> Array:
    """Return the cross product in three limbs of 24 bits, then as floats."""
    (ux1, ux0), (uy1, uy0), (vx1, vx0), (vy1, vy0) = (_limbs(part) for part in (ux, uy, vx, vy))
    low = ux0 * vy0 - uy0 * vx0
    middle = ux1 * vy0 + ux0 * vy1 - uy1 * vx0 - uy0 * vx1 + (low >> _LIMB)
    high = ux1 * vy1 - uy1 * vx1 + (middle >> _LIMB)
    rest = ((middle & _MASK) << _LIMB) + (low & _MASK)
    return np.asarray(high * 2.0 ** (2 * _LIMB) + rest)


def _limbs(values: Array) -> tuple[IntArray, IntArray]:
    whole = values.astype(np.int64)
    return whole >> _LIMB, whole & _MASK
