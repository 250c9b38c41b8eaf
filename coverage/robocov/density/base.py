"""Densities φ: values at places, moments of cells, integrals over other polygons."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import shapely

from robocov.arrays import Array
from robocov.density.cell_edges import REGION, CellEdges
from robocov.errors import ParameterError, shown

HEAVIEST = 1e6
"""Largest value that a weight may have."""

_NOTHING = 1e-9
"""What counts as no density at all, as a part of the highest."""

_AT_ONCE = 1 << 16
"""Squares that are looked at at once, which bounds the memory."""


class Density(ABC):
    """How much each place counts: φ of equation (4), dimensionless, never negative. Immutable.

    Attributes
    ----------
    kind : str
        As map files call it.
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
    def moments(self, edges: CellEdges, origins: Array) -> Array:
        """Return the integrals of φ, φ (q - o) and φ |q - o|² over n cells with origins o, (n, 4).

        The cells are any closed polygons, holes clockwise, their edges relative to the origins, (n, 2) m;
        for Voronoi cells these are the generators.
        """

    @property
    def uniform(self) -> bool:
        """Whether every place counts the same."""
        return self.lowest == self.highest

    def mass_and_centroid(
        self, edges: CellEdges, origins: Array, area: Array, centroid: Array
    ) -> tuple[Array, Array]:
        """Return M and C of equation (2), (n,) m² and (n, 2) m, with this density.

        `area` and `centroid` are the same with density 1. Where a cell has no area, or φ is zero all over it,
        the centroid is that one: a cell whose mean density is below 1e-9 of the highest is filled up to that.
        """
        moments = self.moments(edges, origins)
        mass = np.maximum(moments[:, 0], 0.0)
        filling = np.maximum(_NOTHING * self.highest * area - mass, 0.0)
        weight = mass + filling
        first = moments[:, 1:3] + filling[:, None] * (centroid - origins)
        full = weight > 0.0
        offset = first / np.where(full, weight, 1.0)[:, None]
        return mass, np.where(full[:, None], origins + offset, centroid)


def check_weight(name: str, value: float, *, above: bool = False) -> None:
    """Raise a ParameterError when a weight is out of range."""
    if not ((value > 0.0 if above else value >= 0.0) and value <= HEAVIEST):
        wanted = f"a number {'above' if above else 'from'} 0 to {HEAVIEST:.0f}"
        raise ParameterError(f"{name}: {shown(value)}, but {wanted} was wanted")


@dataclass(frozen=True)
class Uniform(Density):
    """Every place has the same weight, above 0: as no density at all, but for the unit of the cost."""

    kind: ClassVar[str] = "uniform"

    weight: float = 1.0

    def __post_init__(self) -> None:
        check_weight("weight", self.weight, above=True)

    @property
    def lowest(self) -> float:  # noqa: D102
        return self.weight

    @property
    def highest(self) -> float:  # noqa: D102
        return self.weight

    def value(self, points: Array) -> Array:
        """Return φ at (k, 2) points in metres, (k,)."""
        return np.full(len(points), float(self.weight))

    def moments(self, edges: CellEdges, origins: Array) -> Array:
        """Return mass, first and polar moments of cells about their origins."""
        return self.weight * edges.moments(len(origins))


def masses_of_polygons(density: Density, polygons: Sequence[shapely.Polygon]) -> Array:
    """Return the integral of φ over each of some valid polygons, (k,) m², their holes left out."""
    polygons = shapely.orient_polygons(polygons)
    rings, owners = shapely.get_rings(polygons, return_index=True)
    origins = shapely.get_coordinates(shapely.centroid(polygons))
    points, ring = shapely.get_coordinates(rings, return_index=True)
    points -= origins[owners[ring]]
    along = ring[1:] == ring[:-1]
    edges = _edges(points[:-1][along], points[1:][along], owners[ring][:-1][along])
    return np.maximum(density.moments(edges, origins)[:, 0], 0.0)


def means_over_squares(density: Density, middles: Array, side: float) -> Array:
    """Return the mean of φ over axis-parallel squares, (k,), from their middles, (k, 2) m."""
    corners = 0.5 * side * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    means = np.empty(len(middles))
    for k in range(0, len(middles), _AT_ONCE):
        some = middles[k : k + _AT_ONCE]
        start, end = (np.tile(ring, (len(some), 1)) for ring in (corners, np.roll(corners, -1, axis=0)))
        edges = _edges(start, end, np.repeat(np.arange(len(some)), 4))
        means[k : k + len(some)] = density.moments(edges, some)[:, 0]
    # what rounding makes of nothing
    return np.clip(means / (side * side), density.lowest, density.highest)


def _edges(start: Array, end: Array, cell: Array) -> CellEdges:
    owner = cell.astype(np.intp, copy=False)
    return CellEdges(start, end, owner, np.full(len(owner), REGION))
