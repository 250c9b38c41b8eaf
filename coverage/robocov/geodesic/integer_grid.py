"""Integer coordinates for exact side-of-line tests."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from robocov.compiled import kernel
from robocov.typing import FloatArray

GRID_BITS = 48
"""Number of bits of a coordinate: the square around the map is at most 2**48 grid steps wide.

A grid step is then at most 7e-15 of the side of the square, far less than any length that matters. At the
same time, the coordinates are small enough for `cross` to be exact.
"""

_MAX_CROSS_ERROR = 2.0**48
"""Upper bound on the rounding error of a cross product: its two products are at most 2**98 in magnitude."""


@dataclass(frozen=True, slots=True, eq=False)
class Grid:
    """A fine square grid over one map, whose points have integer coordinates.

    Grid coordinates are numbers of grid steps from the origin, stored as floats.

    Attributes
    ----------
    origin : (2,) array, m
        Lower left corner of the map.
    spacing : float, m
        Length of a grid step. It is a power of two, so that multiplying by it does not round.
    """

    origin: FloatArray
    spacing: float

    @classmethod
    def from_square(cls, low: FloatArray, side: float) -> Grid:
        """Build the finest grid on which a square is at most 2**48 steps wide; the step is a power of two.

        Parameters
        ----------
        low : (2,) array, m
            Lower left corner of the square.
        side : float, m
            Length of its sides.

        Returns
        -------
        Grid
            Its spacing is the side, rounded up to a power of two, divided by 2**48.

        Examples
        --------
        >>> grid = Grid.from_square(np.array([0.0, 0.0]), side=8.0)
        >>> grid.spacing == 8.0 / 2.0**48
        True
        """
        side_exponent = math.ceil(math.log2(side))
        return cls(origin=np.asarray(low, dtype=float), spacing=2.0 ** (side_exponent - GRID_BITS))

    def snap(self, points: FloatArray) -> FloatArray:
        """Round points to the grid.

        Parameters
        ----------
        points : (..., 2) array, m

        Returns
        -------
        (..., 2) array, grid steps
            Grid coordinates of the nearest grid points.
        """
        return np.rint((points - self.origin) / self.spacing)

    def to_meters(self, points: FloatArray) -> FloatArray:
        """Convert points from grid coordinates to meters.

        Parameters
        ----------
        points : (..., 2) array, grid steps

        Returns
        -------
        (..., 2) array, m
        """
        return np.asarray(points * self.spacing + self.origin)


@kernel
def cross(ux: float, uy: float, vx: float, vy: float) -> float:
    """Compute the cross product ``ux vy - uy vx`` with its exact sign.

    Parameters
    ----------
    ux, uy, vx, vy : float
        Components of two vectors: integers of magnitude up to 2**49, such as differences of grid coordinates.

    Returns
    -------
    float
        Positive if v points to the left of u. The sign is exact, the value may be rounded.

    Examples
    --------
    >>> big = 2.0**40 + 1
    >>> cross(big, big - 1, big + 1, big)  # naive floats give 0
    1.0
    """
    value = ux * vy - uy * vx
    if abs(value) < _MAX_CROSS_ERROR:
        # Integers wrap around at 2**64: the products may overflow, but their small difference is still exact.
        value = float(int(ux) * int(vy) - int(uy) * int(vx))
    return value


def compute_crosses(u: FloatArray, v: FloatArray) -> FloatArray:
    """Compute the cross products of many pairs of vectors with their exact signs; see `cross`.

    Parameters
    ----------
    u, v : (n, 2) array, grid steps
        The first and the second vector of each pair: integers of magnitude up to 2**49.

    Returns
    -------
    (n,) array
        Positive where v points to the left of u.
    """
    values = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    integer_u = u.astype(np.int64)
    integer_v = v.astype(np.int64)
    # The products wrap around at 2**64. Where the cross product is small, their difference is still exact, as
    # in `cross`.
    wrapped = integer_u[:, 0] * integer_v[:, 1] - integer_u[:, 1] * integer_v[:, 0]
    return np.where(np.abs(values) < _MAX_CROSS_ERROR, wrapped, values)
