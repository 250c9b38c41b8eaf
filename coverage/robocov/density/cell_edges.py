"""Cells as edges: polygons, moments and adjacency of all cells at once."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray, compute_lengths
from robocov.compiled import kernel

REGION = -1
"""Used in place of the cell on the other side of an edge that lies on the region's boundary."""

MASS = 0
"""Column of the moments of cells: the integral of φ, m²."""
MOMENT_X = 1
"""Column of the moments of cells: the integral of φ x, m³."""
MOMENT_Y = 2
"""Column of the moments of cells: the integral of φ y, m³."""
POLAR_MOMENT = 3
"""Column of the moments of cells: the integral of φ (x² + y²), m⁴."""

_MIN_RELATIVE_LENGTH = 1e-12
"""Lengths of edges up to this fraction of the distances of their ends from the generator may be rounding
errors."""


@dataclass(frozen=True, slots=True, eq=False)
class CellEdges:
    """All edges of all cells, grouped by cell, counter-clockwise around each cell.

    Attributes
    ----------
    start, end : (s, 2) arrays, m
        Ends of the edges **relative to the generator** of their cell, so that a tiny cell far from the origin
        keeps its full precision.
    cell : (s,) int array
        Cell of each edge, ascending.
    other_cell : (s,) int array
        The cell on the other side of each edge, or `REGION`.
    """

    start: Array
    end: Array
    cell: IntArray
    other_cell: IntArray

    def build_polygons(self, generators: Array) -> list[Array]:
        """Build the polygon of each cell.

        Parameters
        ----------
        generators : (n, 2) array, m

        Returns
        -------
        list of (k, 2) arrays, m
            Counter-clockwise rings, whose first vertex is not repeated. Edges of length zero are left out; an
            empty cell is a (0, 2) array.
        """
        has_length = self._has_length()
        cell = self.cell[has_length]
        vertices = self.start[has_length] + generators[cell]
        stops = np.cumsum(np.bincount(cell, minlength=len(generators))).tolist()
        return [vertices[start:stop] for start, stop in pairwise([0, *stops])]

    def compute_moments(self, cell_count: int) -> Array:
        """Compute the moments of cells about their generators, for density 1.

        Parameters
        ----------
        cell_count : int
            Number of cells n.

        Returns
        -------
        (n, 4) array, m², m³, m³ and m⁴
            Area, first moments in x and y, and polar moment.
        """
        return _sum_moments(self.start, self.end, self.cell, cell_count)

    def list_adjacent_pairs(self) -> IntArray:
        """List the pairs of cells that share an edge.

        Returns
        -------
        (m, 2) int array
            Pairs (i, j) with i < j, in ascending order.
        """
        is_shared = (self.other_cell != REGION) & self._has_length()
        first_cell = self.cell[is_shared]
        second_cell = self.other_cell[is_shared]
        cell_count = int(max(first_cell.max(initial=0), second_cell.max(initial=0))) + 1
        # Each pair is encoded as one number, because sorting rows of an array takes several times as long. An
        # edge is listed by both of its cells; `np.unique` keeps each pair once.
        low = np.minimum(first_cell, second_cell)
        high = np.maximum(first_cell, second_cell)
        codes = np.unique(low * cell_count + high)
        return np.column_stack(np.divmod(codes, cell_count)).astype(np.intp, copy=False)

    def _has_length(self) -> BoolArray:
        """Return whether each edge is longer than the rounding error of its coordinates, (s,)."""
        length = compute_lengths(self.end - self.start)
        distance = compute_lengths(self.start) + compute_lengths(self.end)
        return np.asarray(length > _MIN_RELATIVE_LENGTH * distance)


@kernel
def _sum_moments(start: Array, end: Array, cell: IntArray, cell_count: int) -> Array:
    """Return the moments of cells, (n, 4): area, first moments in x and y, and polar moment.

    They are sums over the triangles between the edges of a cell and its generator, which is the origin. The
    `cross` of the ends of an edge is twice the area of its triangle.
    """
    sums = np.zeros((cell_count, 4))
    for k in range(len(cell)):
        start_x = start[k, 0]
        start_y = start[k, 1]
        end_x = end[k, 0]
        end_y = end[k, 1]
        c = cell[k]
        cross = start_x * end_y - end_x * start_y
        sum_x = start_x + end_x
        sum_y = start_y + end_y
        sums[c, MASS] += cross / 2.0
        sums[c, MOMENT_X] += cross * sum_x / 6.0
        sums[c, MOMENT_Y] += cross * sum_y / 6.0
        squares = start_x * sum_x + end_x * end_x + start_y * sum_y + end_y * end_y
        sums[c, POLAR_MOMENT] += cross * squares / 12.0
    return sums
