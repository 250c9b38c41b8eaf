"""The cells of robots, whatever divides them; `robocov.voronoi` has two kinds."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

from robocov.arrays import Array, IntArray
from robocov.density.cell_edges import CellEdges


@dataclass(eq=False)
class Cells(ABC):
    """The cells of robots within the region; most of it is computed when it is first asked for.

    Attributes
    ----------
    generators : (n, 2) m
    mass : (n,) m²
        M of equation (2): the areas of the cells where the density is 1.
    centroid : (n, 2) m
        C of equation (2). An empty cell's is its generator.
    """

    generators: Array
    mass: Array
    centroid: Array

    @property
    @abstractmethod
    def edges(self) -> CellEdges:
        """The edges of all cells, with what lies beyond them."""

    @property
    @abstractmethod
    def adjacency(self) -> IntArray:
        """The pairs (i, j), i < j, of cells with a border between them, (m, 2), ascending.

        Where communication is limited, cells overlap: i and j are then a pair when the border
        between them is an edge of either.
        """

    @property
    @abstractmethod
    def outlines(self) -> tuple[list[Array], IntArray]:
        """The outlines of the cells, (k, 2) m each, and whose each is, in an order to paint them in."""

    @property
    @abstractmethod
    def polar_moment(self) -> Array:
        """J_{V,p} of equation (2), (n,) m⁴: the polar moments of the cells about their generators."""

    @property
    def polar_moment_about_centroid(self) -> Array:
        """J_{V,C}, (n,) m⁴, by the parallel axis theorem, equation (3)."""
        lever = self.generators - self.centroid
        return self.polar_moment - self.mass * (lever[:, 0] ** 2 + lever[:, 1] ** 2)
