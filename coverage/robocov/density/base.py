"""What every density φ is: values at places, moments of cells."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from robocov.arrays import Array
from robocov.density.moments import Moments
from robocov.errors import ParameterError, shown

if TYPE_CHECKING:
    from robocov.voronoi.cell_edges import CellEdges

HEAVIEST = 1e6
"""Largest value that a weight may have."""

_NOTHING = 1e-9
"""What counts as no density at all, as a part of the highest."""


class Density(ABC):
    """How much each place counts: φ of equation (4), dimensionless, never negative. Immutable.

    Attributes
    ----------
    kind : str
        As map files call it.
    lowest, highest : float
        Between these all values lie.
    """

    kind: ClassVar[str]

    @property
    @abstractmethod
    def lowest(self) -> float:
        """A bound that no value falls below."""

    @property
    @abstractmethod
    def highest(self) -> float:
        """A bound that no value exceeds."""

    @abstractmethod
    def value(self, points: Array) -> Array:
        """Return φ at (k, 2) points in metres, (k,)."""

    @abstractmethod
    def moments(self, edges: CellEdges, origins: Array) -> Moments:
        """Return mass, first and polar moments of cells about their origins.

        Parameters
        ----------
        edges : CellEdges
            Of any closed polygons, holes clockwise: each edge relative to the origin of its cell.
        origins : (n, 2) m
            Of the n cells, the generators for Voronoi cells.
        """

    @property
    def uniform(self) -> bool:
        """Whether every place counts the same."""
        return self.lowest == self.highest

    def mass_and_centroid(
        self, edges: CellEdges, origins: Array, area: Array, centroid: Array
    ) -> tuple[Array, Array]:
        """Return M and C of equation (2), (n,) m² and (n, 2) m, with this density.

        Parameters
        ----------
        edges : CellEdges
        origins : (n, 2) m
        area, centroid : (n,) m² and (n, 2) m
            The same with density 1. Where a cell has no area, or φ is zero all over it, the centroid is
            the latter: a cell whose mean density is below 1e-9 of the highest is filled up to that.
        """
        moments = self.moments(edges, origins)
        mass, first = np.maximum(moments.mass, 0.0), moments.first
        filling = np.maximum(_NOTHING * self.highest * area - mass, 0.0)
        weight = mass + filling
        first = first + filling[:, None] * (centroid - origins)
        full = weight > 0.0
        offset = first / np.where(full, weight, 1.0)[:, None]
        return mass, np.where(full[:, None], origins + offset, centroid)


def check_weight(name: str, value: float, *, above: bool = False) -> None:
    """Check a weight.

    Raises
    ------
    ParameterError
        When it is out of range.
    """
    if not ((value > 0.0 if above else value >= 0.0) and value <= HEAVIEST):
        wanted = f"a number {'above' if above else 'from'} 0 to {HEAVIEST:.0f}"
        raise ParameterError(f"{name}: {shown(value)}, but {wanted} was wanted")
