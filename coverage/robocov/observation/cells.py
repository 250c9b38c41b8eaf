"""The base class of all kinds of cells into which robots can divide a region.

Equation numbers refer to Renzaglia and Martinelli, "Distributed Coverage Control for a Multi-Robot Team in a
Non-Convex Environment".
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property

from robocov.density.base import Density, Uniform
from robocov.density.cell_edges import POLAR_MOMENT, CellEdges
from robocov.typing import FloatArray, Int32Array, IntArray


@dataclass(eq=False)
class Cells(ABC):
    """The cells of robots in a region. Edges, outlines and polar moments are computed on first use.

    See Also
    --------
    VoronoiPartition : Cells of the nearest robot.
    WeightedCells : Cells of the first robot to arrive.
    """

    generators: FloatArray
    """(n, 2) m, the points to which the cells belong."""
    masses: FloatArray
    """M of equation (2), (n,) m². It is the area of each cell if the density is 1."""
    centroids: FloatArray
    """(n, 2) m, C of equation (2). The centroid of an empty cell is its generator."""
    density: Density | None = None
    """φ, the density of masses, centroids and moments; None stands for 1 everywhere."""
    triangulation: Int32Array | None = None
    """Triangulation from which the partition of slightly moved generators can start, or None."""

    @property
    @abstractmethod
    def edges(self) -> CellEdges:
        """The edges of all cells, with the cell beyond each edge."""

    @property
    @abstractmethod
    def outlines(self) -> tuple[list[FloatArray], IntArray]:
        """The outlines, (k, 2) m each, in the order in which to paint them, and the cell of each outline."""

    @cached_property
    def adjacency(self) -> IntArray:
        """The pairs (i, j), i < j, of cells that share a border, (m, 2), ascending.

        If communication is limited, cells may overlap. Two cells are then a pair if the border between them
        is an edge of at least one of the two.
        """
        return self.edges.list_adjacent_pairs()

    @cached_property
    def polar_moments(self) -> FloatArray:
        """Polar moment of each cell about its generator, J_{V,p} of equation (2), (n,) m⁴."""
        density = self.density or Uniform()
        return density.compute_moments(self.edges, self.generators)[:, POLAR_MOMENT]
