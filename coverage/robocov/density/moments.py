"""Moments of polygons: mass, first and polar moment, and those of polygons of density 1."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from robocov.arrays import Array

if TYPE_CHECKING:
    from robocov.voronoi.cell_edges import CellEdges


class Moments(NamedTuple):
    """The integrals of φ, φ (q - o) and φ |q - o|² over n cells with origins o.

    Attributes
    ----------
    mass : (n,) m²
    first : (n, 2) m³
    polar : (n,) m⁴
    """

    mass: Array
    first: Array
    polar: Array

    def times(self, weight: float) -> Moments:
        """Return the moments with φ that many times as large."""
        return Moments(self.mass * weight, self.first * weight, self.polar * weight)

    def plus(self, other: Moments) -> Moments:
        """Return the moments of the sum of two densities."""
        return Moments(self.mass + other.mass, self.first + other.first, self.polar + other.polar)


def flat_moments(edges: CellEdges, count: int) -> Moments:
    """Return the moments of cells with density 1: each edge adds the triangle that it spans with the origin.

    Parameters
    ----------
    edges : CellEdges
    count : int
        Number of cells n.
    """
    (x, y), (u, v) = edges.start.T, edges.end.T
    cross = x * v - u * y
    square = x * (x + u) + u * u + y * (y + v) + v * v
    return summed(
        edges, count, cross / 2.0, cross * (x + u) / 6.0, cross * (y + v) / 6.0, cross * square / 12.0
    )


def summed(edges: CellEdges, count: int, mass: Array, x: Array, y: Array, polar: Array) -> Moments:
    """Return the moments of n cells from what each of the edges adds to them, (s,) each."""
    sums = np.array(
        [np.bincount(edges.cell, part, minlength=count) for part in (mass, x, y, polar)], dtype=float
    )
    return Moments(sums[0], sums[1:3].T, sums[3])
