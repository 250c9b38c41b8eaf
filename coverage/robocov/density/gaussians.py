"""Hot spots, and their integrals over polygons in closed form.

Let g = exp(-|q|²/2), and let an edge lie at the signed distance d from the centre along its outward
normal n, between s₁ and s₂ along its direction t. With div[(1 - g) q / |q|²] = g, an edge adds to the mass

    ∫ d (1 - g) / (d² + s²) ds = [atan(s/d) - 2π T(d, s/d)] from s₁ to s₂

where T is Owen's function (Owen 1956). With q g = -grad g, it adds -n E₀ to the first moment, E₀ = ∫ g ds,
and with ∂(qᵢ g)/∂qⱼ = (δᵢⱼ - qᵢ qⱼ) g, -(d n + s t) nᵀ g integrated along it, to the second moments beside
the mass. Any other Gaussian is this one after an affine map.
"""

import math
from dataclasses import dataclass
from typing import ClassVar, TypeAlias

import numpy as np

from robocov.arrays import Array
from robocov.density.base import CellEdges, Density, require_weight
from robocov.errors import ParameterError, quote

Point: TypeAlias = tuple[float, float]
Matrix: TypeAlias = tuple[Point, Point]


@dataclass(frozen=True)
class Gaussian:
    """One hot spot, ``weight exp(-½ (q - c)ᵀ S⁻¹ (q - c))``, its centre and σ in metres.

    Either the standard deviation σ is given, or the covariance S, m², symmetric and positive definite.
    """

    center: Point
    weight: float
    sigma: float | None = None
    covariance: Matrix | None = None

    def __post_init__(self) -> None:
        require_weight("weight", self.weight)
        if (self.sigma is None) == (self.covariance is None):
            raise ParameterError("sigma and covariance: either one of them was wanted")
        if self.sigma is not None and not 0.0 < self.sigma < math.inf:
            raise ParameterError(f"sigma: {quote(self.sigma)} m, but a number above 0 was wanted")
        if self.covariance is not None and not _definite(self.covariance):
            wanted = "a symmetric, positive definite 2 x 2 matrix was wanted"
            raise ParameterError(f"covariance: {quote(self.covariance)} m², but {wanted}")

    @property
    def matrix(self) -> Matrix:
        """S, m²."""
        if self.covariance is not None:
            return self.covariance
        assert self.sigma is not None
        return (self.sigma**2, 0.0), (0.0, self.sigma**2)

    def _root(self) -> tuple[float, float, float]:
        """Return L of S = L Lᵀ, m: its diagonal, and what is below it."""
        (xx, xy), (_, yy) = self.matrix
        a = math.sqrt(xx)
        c = xy / a
        return a, math.sqrt(yy - c * c), c

    def _standard(self, offset: Array) -> Array:
        """Return (s, 2) offsets from the centre in the coordinates where this is the standard Gaussian."""
        a, b, c = self._root()
        u = offset[:, 0] / a
        return np.column_stack([u, (offset[:, 1] - c * u) / b])

    def _moments(self, edges: CellEdges, origins: Array) -> Array:
        a, b, c = self._root()
        lever = origins - np.array(self.center)
        at = lever[edges.cell]
        parts = _edge_integrals(self._standard(edges.start + at), self._standard(edges.end + at))
        count, area = len(origins), self.weight * a * b
        mass, u, v, uu, uv, vv = (np.bincount(edges.cell, part, minlength=count) * area for part in parts)
        # back from L q: moments about the centre, then about the origins
        x, y = a * u, c * u + b * v
        second = (a * a + c * c) * (mass - uu) - 2.0 * b * c * uv + b * b * (mass - vv)
        (px, py), square = lever.T, (lever * lever).sum(axis=1)
        polar = second - 2.0 * (px * x + py * y) + square * mass
        return np.column_stack([mass, x - px * mass, y - py * mass, polar])


@dataclass(frozen=True)
class Gaussians(Density):
    """A sum of hot spots over a floor, from 0. Its integrals are closed forms of erf and Owen's T function.

    >>> density = Gaussians((Gaussian((2.0, 0.0), weight=3.0, sigma=1.0),), floor=0.5)
    >>> density.evaluate(np.array([[2.0, 0.0], [9.0, 0.0]])).round(6)
    array([3.5, 0.5])
    """

    kind: ClassVar[str] = "gaussians"

    peaks: tuple[Gaussian, ...]
    floor: float = 0.0

    def __post_init__(self) -> None:
        require_weight("floor", self.floor)
        if not self.floor + sum(peak.weight for peak in self.peaks) > 0.0:
            raise ParameterError("floor: 0, and no peak of a weight above 0, but some weight was wanted")

    @property
    def min_value(self) -> float:
        return self.floor

    @property
    def max_value(self) -> float:
        return self.floor + sum(peak.weight for peak in self.peaks)

    def evaluate(self, points: Array) -> Array:
        points, total = np.asarray(points, dtype=float), np.full(len(points), float(self.floor))
        for peak in self.peaks:
            x, y = peak._standard(points - np.array(peak.center)).T
            total += peak.weight * np.exp(-0.5 * (x * x + y * y))
        return total

    def compute_moments(self, edges: CellEdges, origins: Array) -> Array:
        total = self.floor * edges.compute_moments(len(origins))
        for peak in self.peaks:
            total += peak._moments(edges, origins)
        return total


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
    xx, xy, yy = nx * (nx * de0 + tx * e1), ny * (nx * de0 + tx * e1), ny * (ny * de0 + ty * e1)
    parts = np.stack([turn, -nx * e0, -ny * e0, xx, xy, yy])
    parts[:, ~long] = 0.0
    parts[0, ~apart] = 0.0
    return parts


def _definite(matrix: Matrix) -> bool:
    (a, b), (c, d) = matrix
    # beyond, a Gaussian is a line for this arithmetic
    return b == c and a > 0.0 and d > 0.0 and a * d - b * c > 1e-9 * a * d and a + d < math.inf
