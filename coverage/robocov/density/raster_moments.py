"""Integrals of pictures over polygons, exact in every pixel they pass.

With P(x, y) the integral of φ along the row from the picture's left side to x, the integral of φ over a
polygon is that of P dy along its edges. P is a prefix sum over the pixels and a polynomial within one, so
that an edge, cut where it passes from one pixel into the next, is integrated by Gauss's rule without error.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from robocov.arrays import Array, IntArray
from robocov.density.moments import Moments

if TYPE_CHECKING:
    from robocov.voronoi.cell_edges import CellEdges

_AT_ONCE = 1 << 12
"""Edges that are looked at at once, which bounds the memory."""


@dataclass(frozen=True, slots=True, eq=False)
class Patches:
    """A density that is bilinear in each cell of a grid, and what its integrals need.

    Places are measured in steps of the grid, from its lower left corner. In the cell of column i and row j
    it is ``a + b ξ + c η + d ξ η``, with ξ and η from 0 to 1. The outermost cells reach to infinity; there
    b and c are such that nothing changes outwards.

    Attributes
    ----------
    origin : (2,) m
    step : (2,) m
    coefficients : (4, rows, columns)
        a, b, c, d.
    left : (3, 2, rows, columns)
        Integrals of φ, u φ and u² φ over the part of a row to the left of each cell, at η = 0, and by how
        much they grow to η = 1.
    nodes, weights : (g,)
        Of the Gauss rule on [0, 1] that is exact for the polynomials here.
    """

    origin: Array
    step: Array
    coefficients: Array
    left: Array
    nodes: Array
    weights: Array

    @classmethod
    def of(cls, values: Array, extent: tuple[float, float, float, float], bilinear: bool) -> Patches:
        """Return the cells of (rows, columns) values, the lowest row first, over an extent in metres."""
        low, high = np.array(extent[:2]), np.array(extent[2:])
        step = (high - low) / values.shape[::-1]
        origin = low
        zero = np.zeros_like(values)
        coefficients = np.stack([values, zero, zero, zero])
        if bilinear:
            # from middle to middle; what lies beyond the outermost is as they are
            padded = np.pad(values, 1, mode="edge")
            a, right, up = padded[:-1, :-1], padded[:-1, 1:], padded[1:, :-1]
            coefficients = np.stack([a, right - a, up - a, padded[1:, 1:] - right - up + a])
            origin = low - 0.5 * step
        a, b, c, d = coefficients
        i = np.arange(a.shape[1])
        rows = np.stack([np.stack([a, c]), np.stack([b, d])])
        # integrals over ξ from 0 to 1 of ξ^k (rows[0] + ξ rows[1])
        whole = [rows[0] / (k + 1) + rows[1] / (k + 2) for k in range(3)]
        powers = np.stack([whole[0], i * whole[0] + whole[1], i * i * whole[0] + 2 * i * whole[1] + whole[2]])
        left = np.zeros_like(powers)
        np.cumsum(powers[..., :-1], axis=-1, out=left[..., 1:])
        nodes, weights = np.polynomial.legendre.leggauss(3 if bilinear else 2)
        return cls(origin, step, coefficients, left, (nodes + 1.0) / 2.0, weights / 2.0)

    def cell(self, u: Array, v: Array) -> tuple[IntArray, IntArray]:
        """Return row and column of the cells that hold places."""
        rows, columns = self.coefficients.shape[1:]
        column = np.clip(np.floor(u), 0, columns - 1).astype(np.intp)
        row = np.clip(np.floor(v), 0, rows - 1).astype(np.intp)
        return row, column

    def value(self, points: Array) -> Array:
        """Return the density at (k, 2) points in metres."""
        u, v = ((points - self.origin) / self.step).T
        row, column = self.cell(u, v)
        a, b, c, d = self.coefficients[:, row, column]
        xi, eta = u - column, v - row
        return np.asarray(a + b * xi + (c + d * xi) * eta)


def patch_moments(patches: Patches, edges: CellEdges, origins: Array) -> Moments:
    """Return the moments of cells with the density of a picture, about the cells' origins.

    Parameters
    ----------
    patches : Patches
    edges : CellEdges
        Relative to the origins of their cells.
    origins : (n, 2) m
    """
    count = len(origins)
    sums = np.zeros((5, count))
    at = (origins - patches.origin)[edges.cell]
    start, end = (edges.start + at) / patches.step, (edges.end + at) / patches.step
    for k in range(0, len(start), _AT_ONCE):
        some = slice(k, k + _AT_ONCE)
        edge, parts = _edge_integrals(patches, start[some], end[some])
        cell = edges.cell[some][edge]
        for row, part in zip(sums, parts, strict=True):
            # one after the other: a cell's sum does not depend on what was looked at together
            np.add.at(row, cell, part)
    # from grid steps to metres, about the origins
    (dx, dy), (px, py) = patches.step, (origins - patches.origin).T
    mass, x, y, xx, yy = sums * (dx * dy)
    x, y = x * dx, y * dy
    polar = xx * (dx * dx) - px * (2.0 * x - px * mass) + yy * (dy * dy) - py * (2.0 * y - py * mass)
    return Moments(mass, np.column_stack([x - px * mass, y - py * mass]), polar)


def _edge_integrals(patches: Patches, start: Array, end: Array) -> tuple[IntArray, list[Array]]:
    """Return pieces of edges: whose they are, and what they add to integrals of φ times 1, u, v, u², v²."""
    edge, t0, t1 = _pieces(start, end, patches.coefficients.shape[1:])
    base, along = start[edge], (end - start)[edge]
    middle = base + (0.5 * (t0 + t1))[:, None] * along
    row, column = patches.cell(middle[:, 0], middle[:, 1])
    a, b, c, d = patches.coefficients[:, row, column]
    left = patches.left[:, :, row, column]
    sums = [np.zeros(len(edge)) for _ in range(5)]
    for node, weight in zip(patches.nodes, patches.weights, strict=True):
        u, v = (base + (t0 + node * (t1 - t0))[:, None] * along).T
        xi, eta = u - column, v - row
        # along the row φ is p + q ξ
        p, q = a + c * eta, b + d * eta
        powers = [xi * (p / (k + 1) + xi * q / (k + 2)) * xi**k for k in range(3)]
        one = left[0, 0] + eta * left[0, 1] + powers[0]
        by_u = left[1, 0] + eta * left[1, 1] + column * powers[0] + powers[1]
        by_uu = left[2, 0] + eta * left[2, 1] + column * (column * powers[0] + 2.0 * powers[1]) + powers[2]
        for total, part in zip(sums, (one, by_u, v * one, by_uu, v * v * one), strict=True):
            total += weight * part
    rise = (t1 - t0) * along[:, 1]
    return edge, [total * rise for total in sums]


def _pieces(start: Array, end: Array, shape: tuple[int, ...]) -> tuple[IntArray, Array, Array]:
    """Return edges cut at the inner lines of a grid: whose each piece is, and where it begins and ends.

    These are parts of the edge, from 0 to 1. Level edges are left out, they enclose nothing with the side.
    """
    live = np.nonzero(start[:, 1] != end[:, 1])[0]
    owners, cuts = [live, live], [np.zeros(len(live)), np.ones(len(live))]
    for axis, lines in enumerate(shape[::-1]):
        one, other = start[live, axis], end[live, axis]
        first = np.maximum(np.floor(np.minimum(one, other)) + 1, 1)
        last = np.minimum(np.ceil(np.maximum(one, other)) - 1, lines - 1)
        count = np.maximum(last - first + 1, 0).astype(np.intp)
        k = np.repeat(np.arange(len(live)), count)
        line = first[k] + np.arange(len(k)) - np.repeat(np.cumsum(count) - count, count)
        owners.append(live[k])
        cuts.append(np.clip((line - one[k]) / (other[k] - one[k]), 0.0, 1.0))
    owner, cut = np.concatenate(owners), np.concatenate(cuts)
    # one number to sort by: far quicker than sorting pairs, and exact to 1e-12 of an edge
    order = np.argsort(2.0 * owner + cut, kind="stable")
    owner, cut = owner[order], cut[order]
    same = np.nonzero(owner[1:] == owner[:-1])[0]
    return owner[same], cut[same], cut[same + 1]
