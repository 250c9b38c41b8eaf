"""The edges of all cells, and the polygons, moments and adjacency that follow from them."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from robocov.arrays import compute_lengths
from robocov.compiled import kernel
from robocov.typing import BoolArray, FloatArray, IntArray

REGION = -1
"""Used in place of the cell on the other side of an edge if the edge lies on the boundary of the region."""

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
    """The edges of all cells, sorted by cell. Each cell lies to the left of its edges.

    Attributes
    ----------
    starts, ends : (e, 2) arrays, m
        Start and end of each edge **relative to the generator** of its cell, so that the coordinates of a
        tiny cell far from the origin keep their full precision.
    cells : (e,) int array
        Index of the cell of each edge, in ascending order.
    other_cells : (e,) int array
        Index of the cell on the other side of each edge, or `REGION`.
    """

    starts: FloatArray
    ends: FloatArray
    cells: IntArray
    other_cells: IntArray

    def build_polygons(self, generators: FloatArray) -> list[FloatArray]:
        """Build the polygon of each cell, whose edges must be in order around the cell.

        Parameters
        ----------
        generators : (n, 2) array, m
            Generators of the cells.

        Returns
        -------
        list of (k, 2) arrays, m
            Vertices of each cell, counter-clockwise; the first one is not repeated. Edges without length are
            left out. The array of an empty cell has the shape (0, 2).
        """
        has_length = self._has_length()
        cells = self.cells[has_length]
        vertices = self.starts[has_length] + generators[cells]
        stops = np.cumsum(np.bincount(cells, minlength=len(generators))).tolist()
        return [vertices[start:stop] for start, stop in pairwise([0, *stops])]

    def compute_moments(self, cell_count: int) -> FloatArray:
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
        return _sum_moments(self.starts, self.ends, self.cells, cell_count)

    def list_adjacent_pairs(self) -> IntArray:
        """List the pairs of cells that share an edge.

        Returns
        -------
        (m, 2) int array
            Pairs of cells (i, j) with i < j, in ascending order.
        """
        is_shared = (self.other_cells != REGION) & self._has_length()
        first_cells = self.cells[is_shared]
        second_cells = self.other_cells[is_shared]
        cell_count = int(max(first_cells.max(initial=0), second_cells.max(initial=0))) + 1
        # Each pair is encoded as one number, because sorting rows of an array takes several times as long.
        # Both cells of a pair have a common edge; `np.unique` keeps the pair only once.
        low = np.minimum(first_cells, second_cells)
        high = np.maximum(first_cells, second_cells)
        codes = np.unique(low * cell_count + high)
        return np.column_stack(np.divmod(codes, cell_count)).astype(np.intp, copy=False)

    def _has_length(self) -> BoolArray:
        """Return whether each edge is longer than the rounding errors of its coordinates, (e,)."""
        lengths = compute_lengths(self.ends - self.starts)
        distances = compute_lengths(self.starts) + compute_lengths(self.ends)
        return np.asarray(lengths > _MIN_RELATIVE_LENGTH * distances)


@kernel
def _sum_moments(starts: FloatArray, ends: FloatArray, cells: IntArray, cell_count: int) -> FloatArray:
    """Return the moments of cells, (n, 4): area, first moments in x and y, and polar moment.

    They are sums over the edges of a cell. The contribution of an edge is the moment of the triangle that it
    forms with the generator, which is the origin. Twice the area of this triangle is `cross`.
    """
    moments = np.zeros((cell_count, 4))
    for k in range(len(cells)):
        start_x = starts[k, 0]
        start_y = starts[k, 1]
        end_x = ends[k, 0]
        end_y = ends[k, 1]
        i = cells[k]
        cross = start_x * end_y - end_x * start_y
        sum_x = start_x + end_x
        sum_y = start_y + end_y
        moments[i, MASS] += cross / 2.0
        moments[i, MOMENT_X] += cross * sum_x / 6.0
        moments[i, MOMENT_Y] += cross * sum_y / 6.0
        # The polar moment of the triangle with the corners 0, s and e is cross (s·s + s·e + e·e) / 12.
        sum_of_products = start_x * sum_x + end_x * end_x + start_y * sum_y + end_y * end_y
        moments[i, POLAR_MOMENT] += cross * sum_of_products / 12.0
    return moments
