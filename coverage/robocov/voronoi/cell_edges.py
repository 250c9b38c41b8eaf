"""The edges of Voronoi cells, and what follows from them alone: polygons, moments, who borders whom."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray

REGION = -1
"""What lies beyond an edge of a cell that is a piece of the region's boundary."""


@dataclass(frozen=True, slots=True, eq=False)
class CellEdges:
    """All edges of all cells, each cell's in one run and counter-clockwise round the cell.

    Attributes
    ----------
    start, end : (s, 2) m
        Ends of the edges **relative to the generator** of their cell, so that a tiny cell far from
        the origin keeps all its digits.
    cell : (s,)
        Whose edge it is, ascending.
    beyond : (s,)
        The robot on the other side, or `REGION`.
    """

    start: Array
    end: Array
    cell: IntArray
    beyond: IntArray

    def polygons(self, generators: Array) -> list[Array]:
        """Return one counter-clockwise ring a cell, (k, 2) m, the first vertex not repeated.

        Edges of no length are left out; an empty cell is a (0, 2) array.
        """
        long = self._long()
        cell = self.cell[long]
        vertices = self.start[long] + generators[cell]
        stops = np.cumsum(np.bincount(cell, minlength=len(generators))).tolist()
        return [vertices[start:stop] for start, stop in pairwise([0, *stops])]

    def polar_moment(self, count: int) -> Array:
        """Return J_{V,p}, the polar moment of each of `count` cells about its generator, (n,) m⁴.

        The second moment of equation (2): each edge adds the triangle that it spans with the generator.
        """
        (x, y), (u, v) = self.start.T, self.end.T
        square = x * (x + u) + u * u + y * (y + v) + v * v
        weights = (x * v - u * y) * square / 12.0
        return np.bincount(self.cell, weights, minlength=count).astype(np.float64, copy=False)

    def adjacency(self) -> IntArray:
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
