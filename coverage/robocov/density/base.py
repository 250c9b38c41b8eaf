"""Densities φ: values at places, moments of cells, by their edges, integrals over other polygons."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar

import numpy as np
import shapely

from robocov.arrays import Array, BoolArray, IntArray
from robocov.compiled import kernel
from robocov.errors import ParameterError, quote

REGION = -1
"""Neighbour of an edge of a cell that is a piece of the region's boundary."""

MAX_WEIGHT = 1e6
"""Largest value that a weight may have."""

_NOTHING = 1e-9
"""Density that counts as zero, as a part of the highest."""

_AT_ONCE = 1 << 16
"""Squares that are looked at at once, which bounds the memory."""


@dataclass(frozen=True, slots=True, eq=False)
class CellEdges:
    """All edges of all cells, each cell's in one run and counter-clockwise round the cell."""

    start: Array
    """(s, 2) m, where edges begin, **relative to the generator** of their cell, so that a tiny cell far from
    the origin keeps all its digits, and"""
    end: Array
    """where they end."""
    cell: IntArray
    """(s,) Whose edge it is, ascending."""
    beyond: IntArray
    """(s,) The robot on the other side, or `REGION`."""

    def build_polygons(self, generators: Array) -> list[Array]:
        """Return one counter-clockwise ring a cell, (k, 2) m, the first vertex not repeated.

        Edges of no length are left out; an empty cell is a (0, 2) array.
        """
        long = self._long()
        cell = self.cell[long]
        vertices = self.start[long] + generators[cell]
        stops = np.cumsum(np.bincount(cell, minlength=len(generators))).tolist()
        return [vertices[start:stop] for start, stop in pairwise([0, *stops])]

    def compute_moments(self, count: int) -> Array:
        """Return area, first moments and polar moment of `count` cells about their generators, (n, 4).

        In m², m³ and m⁴: each edge adds the triangle that it spans with the generator.
        """
        return _moments(self.start, self.end, self.cell, count)

    def list_adjacent_pairs(self) -> IntArray:
        """Return the pairs (i, j), i < j, of cells with an edge between them, (m, 2), ascending."""
        between = (self.beyond != REGION) & self._long()
        one, other = self.cell[between], self.beyond[between]
        count = int(max(one.max(initial=0), other.max(initial=0))) + 1
        # a pair as one number: sorting pairs takes several times as long
        numbers = np.unique(np.minimum(one, other) * count + np.maximum(one, other))
        return np.column_stack(np.divmod(numbers, count)).astype(np.intp, copy=False)

    def _long(self) -> BoolArray:
        """Return which edges have a length: more than rounding makes of a point so far from the generator."""
        (x, y), (u, v) = self.start.T, self.end.T
        return np.asarray(np.hypot(u - x, v - y) > 1e-12 * (np.hypot(x, y) + np.hypot(u, v)))


@kernel
def _moments(start: Array, end: Array, cell: IntArray, count: int) -> Array:
    sums = np.zeros((count, 4))
    for k in range(len(cell)):
        x, y, u, v = start[k, 0], start[k, 1], end[k, 0], end[k, 1]
        cross, c = x * v - u * y, cell[k]
        sums[c, 0] += cross / 2.0
        sums[c, 1] += cross * (x + u) / 6.0
        sums[c, 2] += cross * (y + v) / 6.0
        sums[c, 3] += cross * (x * (x + u) + u * u + y * (y + v) + v * v) / 12.0
    return sums


class Density(ABC):
    """Importance of each place: φ of equation (4), dimensionless, never negative. Immutable."""

    kind: ClassVar[str]
    """As map files call it."""

    @property
    @abstractmethod
    def min_value(self) -> float:
        """A bound that no value falls below."""

    @property
    @abstractmethod
    def max_value(self) -> float:
        """A bound that no value exceeds."""

    @abstractmethod
    def evaluate(self, points: Array) -> Array:
        """Return φ at (k, 2) points in metres, (k,)."""

    @abstractmethod
    def compute_moments(self, edges: CellEdges, origins: Array) -> Array:
        """Return the integrals of φ, φ (q - o) and ``φ |q - o|²`` over n cells with origins o, (n, 4).

        The cells are any closed polygons, holes clockwise, their edges relative to the origins, (n, 2) m;
        for Voronoi cells these are the generators.
        """

    @property
    def is_uniform(self) -> bool:
        """Whether every place counts the same."""
        return self.min_value == self.max_value

    def compute_mass_and_centroid(
        self, edges: CellEdges, origins: Array, area: Array, centroid: Array
    ) -> tuple[Array, Array]:
        """Return M and C of equation (2), (n,) m² and (n, 2) m, with this density.

        `area` and `centroid` are the same with density 1. Where a cell has no area, or φ is zero all over it,
        the centroid is that one: a cell whose mean density is below 1e-9 of the highest is filled up to that.
        """
        moments = self.compute_moments(edges, origins)
        mass = np.maximum(moments[:, 0], 0.0)
        filling = np.maximum(_NOTHING * self.max_value * area - mass, 0.0)
        weight = mass + filling
        first = moments[:, 1:3] + filling[:, None] * (centroid - origins)
        full = weight > 0.0
        offset = first / np.where(full, weight, 1.0)[:, None]
        return mass, np.where(full[:, None], origins + offset, centroid)


def require_weight(name: str, value: float, *, above: bool = False) -> None:
    """Raise a ParameterError when a weight is out of range."""
    if not ((value > 0.0 if above else value >= 0.0) and value <= MAX_WEIGHT):
        wanted = f"a number {'above' if above else 'from'} 0 to {MAX_WEIGHT:.0f}"
        raise ParameterError(f"{name}: {quote(value)}, but {wanted} was wanted")


@dataclass(frozen=True)
class Uniform(Density):
    """Every place has the same weight, above 0: as no density at all, but for the unit of the cost."""

    kind: ClassVar[str] = "uniform"

    weight: float = 1.0

    def __post_init__(self) -> None:
        require_weight("weight", self.weight, above=True)

    @property
    def min_value(self) -> float:  # noqa: D102
        return self.weight

    @property
    def max_value(self) -> float:  # noqa: D102
        return self.weight

    def evaluate(self, points: Array) -> Array:
        """Return φ at (k, 2) points in metres, (k,)."""
        return np.full(len(points), float(self.weight))

    def compute_moments(self, edges: CellEdges, origins: Array) -> Array:
        """Return mass, first and polar moments of cells about their origins."""
        return self.weight * edges.compute_moments(len(origins))


def compute_polygon_masses(density: Density, polygons: Sequence[shapely.Polygon]) -> Array:
    """Return the integral of φ over each of some valid polygons, (k,) m², their holes left out."""
    polygons = shapely.orient_polygons(polygons)
    rings, owners = shapely.get_rings(polygons, return_index=True)
    origins = shapely.get_coordinates(shapely.centroid(polygons))
    points, ring = shapely.get_coordinates(rings, return_index=True)
    points -= origins[owners[ring]]
    along = ring[1:] == ring[:-1]
    edges = _edges(points[:-1][along], points[1:][along], owners[ring][:-1][along])
    return np.maximum(density.compute_moments(edges, origins)[:, 0], 0.0)


def compute_square_means(density: Density, middles: Array, side: float) -> Array:
    """Return the mean of φ over axis-parallel squares, (k,), from their middles, (k, 2) m."""
    corners = 0.5 * side * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    means = np.empty(len(middles))
    for k in range(0, len(middles), _AT_ONCE):
        some = middles[k : k + _AT_ONCE]
        start, end = (np.tile(ring, (len(some), 1)) for ring in (corners, np.roll(corners, -1, axis=0)))
        edges = _edges(start, end, np.repeat(np.arange(len(some)), 4))
        means[k : k + len(some)] = density.compute_moments(edges, some)[:, 0]
    # what rounding makes of nothing
    return np.clip(means / (side * side), density.min_value, density.max_value)


def _edges(start: Array, end: Array, cell: Array) -> CellEdges:
    owner = cell.astype(np.intp, copy=False)
    return CellEdges(start, end, owner, np.full(len(owner), REGION))
