"""Integrals of Gaussians over polygons, in closed form.

Let g = exp(-|q|²/2), and let an edge lie at the signed distance d from the centre along its outward
normal n, between s₁ and s₂ along its direction t. With div[(1 - g) q / |q|²] = g, an edge adds to the mass

    ∫ d (1 - g) / (d² + s²) ds = [atan(s/d) - 2π T(d, s/d)] from s₁ to s₂

where T is Owen's function (Owen 1956). With q g = -grad g, it adds -n E₀ to the first moment, E₀ = ∫ g ds,
and with ∂(qᵢ g)/∂qⱼ = (δᵢⱼ - qᵢ qⱼ) g, -(d n + s t) nᵀ g integrated along it, to the second moments beside
the mass. Any other Gaussian is this one after an affine map.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from robocov.arrays import Array
from robocov.density.moments import Moments

if TYPE_CHECKING:
    from robocov.voronoi.cell_edges import CellEdges

_AT_ONCE = 1 << 17
"""Pairs of edges and Gaussians that are looked at at once, which bounds the memory."""


@dataclass(frozen=True, slots=True, eq=False)
class Bells:
    """Gaussians as their integrals need them.

    Attributes
    ----------
    centers : (k, 2) m
    weights : (k,)
    roots : (k, 2, 2) m
        L of the covariance L Lᵀ.
    inverses : (k, 2, 2) 1/m
        L⁻¹, which makes the Gaussian the standard one.
    areas : (k,) m²
        det L.
    """

    centers: Array
    weights: Array
    roots: Array
    inverses: Array
    areas: Array

    @classmethod
    def of(cls, centers: Array, covariances: Array, weights: Array) -> Bells:
        """Return the Gaussians of (k, 2, 2) covariances in m²."""
        roots = np.asarray(np.linalg.cholesky(covariances), dtype=np.float64)
        a, b, c = roots[:, 0, 0], roots[:, 1, 1], roots[:, 1, 0]
        inverses = np.zeros_like(roots)
        inverses[:, 0, 0], inverses[:, 1, 1], inverses[:, 1, 0] = 1.0 / a, 1.0 / b, -c / (a * b)
        return cls(centers, weights, roots, inverses, a * b)

    def value(self, points: Array) -> Array:
        """Return the sum of the Gaussians at (k, 2) points."""
        total = np.zeros(len(points))
        for center, inverse, weight in zip(self.centers, self.inverses, self.weights, strict=True):
            x, y = _mapped(inverse, points - center).T
            total += weight * np.exp(-0.5 * (x * x + y * y))
        return total


def bell_moments(bells: Bells, edges: CellEdges, origins: Array) -> Moments:
    """Return the moments of the sum of Gaussians over cells, about the cells' origins.

    Parameters
    ----------
    bells : Bells
    edges : CellEdges
        Relative to the origins of their cells.
    origins : (n, 2) m
    """
    count, cell = len(origins), edges.cell
    mass, polar, first = np.zeros(count), np.zeros(count), np.zeros((count, 2))
    for center, weight, root, inverse, area in zip(
        bells.centers, bells.weights, bells.roots, bells.inverses, bells.areas, strict=True
    ):
        lever = origins - center
        at = lever[cell]
        parts = np.empty((6, len(cell)))
        for k in range(0, len(cell), _AT_ONCE):
            some = slice(k, k + _AT_ONCE)
            start = _mapped(inverse, edges.start[some] + at[some])
            end = _mapped(inverse, edges.end[some] + at[some])
            parts[:, some] = _edge_integrals(start, end)
        m, fx, fy, xx, xy, yy = (np.bincount(cell, part, minlength=count) * (weight * area) for part in parts)
        xx, xy, yy = m - xx, -xy, m - yy
        one = _mapped(root, np.column_stack([fx, fy]))
        a, c, b = root[0, 0], root[1, 0], root[1, 1]
        second = (a * a + c * c) * xx + 2.0 * b * c * xy + b * b * yy
        square = lever[:, 0] ** 2 + lever[:, 1] ** 2
        mass += m
        first += one - lever * m[:, None]
        polar += second - 2.0 * (lever * one).sum(axis=1) + square * m
    return Moments(mass, first, polar)


def _mapped(triangle: Array, points: Array) -> Array:
    """Return (s, 2) points after a lower triangular map.

    Row by row, unlike a product of matrices, whose last bits depend on how many rows there are.
    """
    x, y = points.T
    return np.column_stack([triangle[0, 0] * x, triangle[1, 0] * x + triangle[1, 1] * y])


def _edge_integrals(start: Array, end: Array) -> Array:
    """Return what edges add to integrals of the standard Gaussian, (6, s).

    These are the mass, the first moments, and what the second moments xx, xy, yy are less than the mass
    (less than zero for xy).
    """
    from scipy.special import erf, owens_t  # not at once: loading a map needs none of it

    along = end - start
    length = np.hypot(along[:, 0], along[:, 1])
    long = length > 0.0
    tx, ty = (along / np.where(long, length, 1.0)[:, None]).T
    nx, ny = ty, -tx
    (x, y), (u, v) = start.T, end.T
    d = x * nx + y * ny
    s1, s2 = x * tx + y * ty, u * tx + v * ty
    # at d = 0 the two terms cancel
    apart = d != 0.0
    with np.errstate(over="ignore"):
        a1, a2 = s1 / np.where(apart, d, 1.0), s2 / np.where(apart, d, 1.0)
    turn = np.arctan(a2) - np.arctan(a1) - 2.0 * np.pi * (owens_t(d, a2) - owens_t(d, a1))
    # far out squares overflow, and the exponential is zero all the same
    peak = np.exp(-0.5 * d * d)
    e0 = peak * np.sqrt(np.pi / 2.0) * (erf(s2 / np.sqrt(2.0)) - erf(s1 / np.sqrt(2.0)))
    e1 = peak * (np.exp(-0.5 * s1 * s1) - np.exp(-0.5 * s2 * s2))
    de0 = d * e0
    parts = np.stack(
        [
            turn,
            -nx * e0,
            -ny * e0,
            nx * (nx * de0 + tx * e1),
            ny * (nx * de0 + tx * e1),
            ny * (ny * de0 + ty * e1),
        ]
    )
    parts[:, ~long] = 0.0
    parts[0, ~apart] = 0.0
    return parts
