"""The point of a cell from which its locational cost (4) with a density φ that varies is best, by quadrature.

A cell is taken apart into the triangles that the point itself spans with the edges. In the coordinates
q = p + u (e(t) - p), where e(t) runs along an edge, distance and direction from p are smooth, so that Gauss's
rule converges quickly where φ is smooth; where it jumps within a cell, the error is of the order of the
distance of the nodes. Newton's method is that of `best_points`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from robocov.locational.best_points import Slopes, newton
from robocov.locational.cost import CellSides, Sensing

if TYPE_CHECKING:
    from robocov.arrays import Array, BoolArray
    from robocov.density import Density
    from robocov.locational.cost import Distance, Seen
    from robocov.voronoi import VoronoiPartition
    from robocov.voronoi.weighted_cells import WeightedCells

_ALONG, _OUTWARD = 16, 12
"""Nodes along an edge, and from the point to it."""

_NEAR = 1e-6
"""A step so short, relative to the cell's size, is the last."""

_ROUNDS = 30
"""Evaluations after which a cell has what it has."""

_NOTHING = 1e-12
"""φ so small, relative to its highest value, all over a cell is nothing: its centroid is as good a point."""


def weighed_best_points(
    cells: VoronoiPartition | WeightedCells, density: Density, f: Distance | Sensing
) -> Array:
    """Return the points where ∫ f(|q-p|) φ(q) dq over each cell is best, (n, 2) m.

    From the centroid by φ on: of f = r and a convex cell it is the best of all, of f = 1/(r²+h²) the one
    that lies downhill from there. A cell that is not convex, or in which φ is nothing, keeps its centroid.

    Parameters
    ----------
    cells : VoronoiPartition or WeightedCells
        With the density.
    density : Density
    f : Distance or Sensing
    """
    start = cells.centroid - cells.generators
    sides = CellSides(cells.edges, len(start))
    room = sides.room(sides.seen_from(*start.T))
    searching = (room > 1e-9 * sides.size) & (cells.mass > _NOTHING * density.highest * sides.area)
    quadrature = _Quadrature(cells, density, f, sides.size)
    return np.asarray(cells.generators + newton(sides, quadrature.slopes, start, searching, _NEAR, _ROUNDS))


class _Quadrature:
    """Gradients and Hessians of the cells' costs by their points."""

    def __init__(
        self,
        cells: VoronoiPartition | WeightedCells,
        density: Density,
        f: Distance | Sensing,
        size: Array,
    ) -> None:
        self._edges, self._generators = cells.edges, cells.generators
        self._density, self._f = density, f
        nodes, weights = np.polynomial.legendre.leggauss(_ALONG)
        self._t, self._t_weights = 0.5 * (nodes + 1.0), 0.5 * weights
        nodes, weights = np.polynomial.legendre.leggauss(_OUTWARD)
        tau, weights = 0.5 * (nodes + 1.0), 0.5 * weights
        if isinstance(f, Sensing):
            # as close to the point as f is steep
            bend = np.arcsinh(np.maximum(size / f.height, 1e-3))[:, None]
            self._u = np.sinh(bend * tau) / np.sinh(bend)
            self._u_weights = weights * bend * np.cosh(bend * tau) / np.sinh(bend) * self._u
        else:
            self._u = np.broadcast_to(tau, (len(size), _OUTWARD))
            self._u_weights = np.broadcast_to(weights * tau, (len(size), _OUTWARD))

    def slopes(self, x: Array, y: Array, seen: Seen, wanted: BoolArray) -> Slopes:
        """Return the slopes at points relative to the generators, zero for cells that are not wanted."""
        edges = self._edges
        some = np.flatnonzero(wanted[edges.cell])
        cell = edges.cell[some]
        at_x, at_y = x[cell], y[cell]
        sx, sy = edges.start[some, 0] - at_x, edges.start[some, 1] - at_y
        ex, ey = edges.end[some, 0] - at_x, edges.end[some, 1] - at_y
        double = sx * ey - ex * sy
        # (s, along, outward)
        rim_x = (sx[:, None] + (ex - sx)[:, None] * self._t)[:, :, None]
        rim_y = (sy[:, None] + (ey - sy)[:, None] * self._t)[:, :, None]
        u = self._u[cell][:, None, :]
        dx, dy = rim_x * u, rim_y * u
        weight = double[:, None, None] * self._t_weights[:, None] * self._u_weights[cell][:, None, :]
        generator = self._generators[cell]
        places = np.stack(
            [
                dx + (generator[:, 0] + at_x)[:, None, None],
                dy + (generator[:, 1] + at_y)[:, None, None],
            ],
            axis=-1,
        )
        weight = weight * self._density.value(places.reshape(-1, 2)).reshape(weight.shape)
        square = dx * dx + dy * dy
        if isinstance(self._f, Sensing):
            low = 1.0 / (square + self._f.height**2)
            first, second = 2.0 * weight * low * low, -8.0 * weight * low * low * low
        else:
            inverse = 1.0 / np.sqrt(np.maximum(square, 1e-300))
            first, second = weight * inverse, -weight * inverse * inverse * inverse
        parts = (
            -first * dx,
            -first * dy,
            first + second * dx * dx,
            second * dx * dy,
            first + second * dy * dy,
        )
        count = len(x)
        return Slopes(
            *(np.bincount(cell, part.sum(axis=(1, 2)), minlength=count).astype(float) for part in parts)
        )
