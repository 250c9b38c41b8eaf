"""The interface of all kinds of cells that robots can divide a region into."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from robocov.arrays import Array, IntArray
from robocov.density.base import Density, Uniform
from robocov.density.cell_edges import CellEdges


@dataclass(eq=False)
class Cells(ABC):
    """The cells of robots within the region; most of it is computed when it is first used."""

    generators: Array
    """(n, 2) m"""
    mass: Array
    """(n,) m², M of equation (2): the area of each cell if the density is 1."""
    centroid: Array
    """(n, 2) m, C of equation (2). That of an empty cell is its generator."""
    density: Density | None = None
    """φ of mass, centroid and moments; None for 1."""
    triangulation: NDArray[np.int32] | None = None
    """Triangulation from which the next partition of slowly moving generators starts, if there is one."""

    @property
    @abstractmethod
    def edges(self) -> CellEdges:
        """The edges of all cells, and what lies beyond them."""

    @property
    @abstractmethod
    def outlines(self) -> tuple[list[Array], IntArray]:
        """The outlines of the cells, (k, 2) m each, and the cell of each, in an order to paint them in."""

    @cached_property
    def adjacency(self) -> IntArray:
        """The pairs (i, j), i < j, of cells with a border between them, (m, 2), ascending.

        If communication is limited, cells may overlap: i and j are then a pair if the border between them is
        an edge of at least one of them.
        """
        return self.edges.list_adjacent_pairs()

    @cached_property
    def polar_moment(self) -> Array:
        """J_{V,p} of equation (2), (n,) m⁴: the polar moment of each cell about its generator."""
        density = self.density or Uniform()
        return density.compute_moments(self.edges, self.generators)[:, 3]
