"""The functions f of the distance, whose integral over a cell is the locational cost (4).

Equation numbers refer to Renzaglia and Martinelli, "Distributed Coverage Control for a Multi-Robot Team in a
Non-Convex Environment".
"""

from dataclasses import dataclass
from typing import ClassVar, TypeAlias

import numpy as np

from robocov.errors import ParameterError, quote

SQUARED_DISTANCE, DISTANCE, SENSING = range(3)
"""Numbers by which kernels distinguish the functions f."""


@dataclass(frozen=True)
class SquaredDistance:
    """The function f = r² of equation (12), in m². The best point of a cell is its centroid, (13)."""

    kind: ClassVar[int] = SQUARED_DISTANCE
    """Number of the function, for kernels."""
    sign: ClassVar[float] = 1.0
    """1 if the cost is to be minimized, -1 if it is to be maximized."""
    height: ClassVar[float] = 1.0
    """Not used; kernels expect a height for every function."""


@dataclass(frozen=True)
class Distance:
    """The function f = r, in m, as in the coverage cost (22). The best point of a cell is its median."""

    kind: ClassVar[int] = DISTANCE
    sign: ClassVar[float] = 1.0
    height: ClassVar[float] = 1.0


@dataclass(frozen=True)
class Sensing:
    """The function f = 1/(r²+h²) of equation (14), in 1/m²: how well a sensor at height h perceives a point.

    Parameters
    ----------
    height : float, m
        The height h of the sensor, above 0.

    Raises
    ------
    ParameterError
        If the height is not a finite, positive number.

    Notes
    -----
    Contrary to the remark after (14) in the paper, the best point of a cell depends on the height: it is the
    centroid only in the limit h → ∞.
    """

    kind: ClassVar[int] = SENSING
    sign: ClassVar[float] = -1.0

    height: float

    def __post_init__(self) -> None:
        if not 0.0 < self.height < np.inf:
            raise ParameterError(f"height: expected a number above 0, got {quote(self.height)} m")


Performance: TypeAlias = SquaredDistance | Distance | Sensing
"""A function f of the distance."""
