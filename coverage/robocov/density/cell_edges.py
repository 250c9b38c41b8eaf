"""The edges of cells, and what follows from them alone: polygons, moments, who borders whom."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray
from robocov.compiled import kernel

REGION = -1
"""What lies beyond an edge of a cell that is a piece of the region's boundary."""


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

    def polygons(self, generators: Array) -> list[Array]:
        """Return one counter-clockwise ring a cell, (k, 2) m, the first vertex not repeated.

        Edges of no length are left out; an empty cell is a (0, 2) array.
        """
        long = self._long()
        cell = self.cell[long]
        vertices = self.start[long] + generators[cell]
        stops = np.cumsum(np.bincount(cell, minlength=len(generators))).tolist()
        return [vertices[start:stop] for start, stop in pairwise([0, *stops])]

    def moments(self, count: int) -> Array:
        """Return area, first moments and polar moment of `count` cells about their generators, (n, 4).

        In m², m³ and m⁴: each edge adds the triangle that it spans with the generator.
        """
        return _moments(self.start, self.end, self.cell, count)

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
