"""The functions f of the distance that the locational cost (4) integrates."""

from dataclasses import dataclass
from typing import ClassVar, TypeAlias

import numpy as np

from robocov.errors import ParameterError, quote

SQUARED_DISTANCE, DISTANCE, SENSING = range(3)
"""Numbers by which kernels distinguish the functions."""


@dataclass(frozen=True)
class SquaredDistance:
    """f = r², equation (12), in m². Its optimum is the centroid, (13)."""

    kind: ClassVar[int] = SQUARED_DISTANCE
    """Number of the function, for kernels."""
    sign: ClassVar[float] = 1.0
    """1 if the cost is to be minimized, -1 if it is to be maximized."""
    height: ClassVar[float] = 1.0
    """Not used; kernels expect a height for every function."""


@dataclass(frozen=True)
class Distance:
    """f = r, in m, as in the coverage cost (22) of a convex cell. Its optimum is the median."""

    kind: ClassVar[int] = DISTANCE
    sign: ClassVar[float] = 1.0
    height: ClassVar[float] = 1.0


@dataclass(frozen=True)
class Sensing:
    """f = 1/(r²+h²), equation (14), in 1/m²: how well a sensor at height h perceives a point.

    Parameters
    ----------
    height : float, m
        h, above 0.

    Raises
    ------
    ParameterError
        If the height is not a finite, positive number.

    Notes
    -----
    Contrary to the remark after (14) in the paper, the optimum depends on the height: it is the centroid only
    for h → ∞.
    """

    kind: ClassVar[int] = SENSING
    sign: ClassVar[float] = -1.0

    height: float

    def __post_init__(self) -> None:
        if not 0.0 < self.height < np.inf:
            raise ParameterError(f"height: expected a number above 0, got {quote(self.height)} m")


Performance: TypeAlias = SquaredDistance | Distance | Sensing
"""A function f of the distance."""
