"""Sums of Gaussians, and their integrals over polygons.

Let g = exp(-|q|²/2) be the standard Gaussian, whose center is the origin. Let d be the signed distance of an
edge from the center along the outward normal n, and let s run from s₁ to s₂ along the edge in its direction
t. By the divergence theorem, integrals over a polygon are sums over its edges:

- Since div[(1 - g) q / |q|²] = g, an edge adds to the mass

      ∫ d (1 - g) / (d² + s²) ds = [atan(s/d) - 2π T(d, s/d)] from s₁ to s₂,

  where T is Owen's function (Owen 1956).
- Since q g = -grad g, it adds -n E₀ to the first moment, where E₀ = ∫ g ds.
- Since ∂(qᵢ g)/∂qⱼ = (δᵢⱼ - qᵢ qⱼ) g, it adds ∫ (d n + s t) nᵀ g ds = (d E₀ n + E₁ t) nᵀ to the difference
  between the mass (times the identity) and the second moments, where E₁ = ∫ s g ds.

Any other Gaussian becomes the standard one by an affine map, under which edges stay straight.

On a cell that is much smaller than the standard deviation, the contributions of the edges cancel almost
completely. Such cells are integrated numerically instead: a Gaussian is so smooth there that the result is
accurate to rounding errors.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, TypeAlias

import numpy as np

from robocov.arrays import compute_lengths, to_tuples
from robocov.density.base import Density, require_weight
from robocov.density.cell_edges import CellEdges
from robocov.errors import ParameterError, quote, require_number, to_floats
from robocov.typing import BoolArray, FloatArray, Point

Matrix: TypeAlias = tuple[Point, Point]
"""A 2 x 2 matrix, row by row."""

_MIN_SIGMA_M = 1e-100
_MAX_SIGMA_M = 1e100
"""Within these limits, no square of a length in standard deviations can overflow."""
_SMALL_CELL_SIZE = 0.03
"""Distance from the generator, in standard deviations, up to which a cell is integrated numerically. With the
closed form, the relative error of the polar moment is about 1e-16 divided by the fourth power of the size."""
_QUADRATURE_ORDER = 6
"""Number of nodes in each of two directions on the triangle between a generator and an edge."""
_MIN_RELATIVE_DETERMINANT = 1e-9
"""A covariance counts as nearly singular if its determinant is at most this fraction of the product of its
diagonal."""
CORRELATION_EXPECTED = "an absolute correlation of at most 1 - 5e-10"
"""The same limit in messages. The fraction is 1 minus the square of the correlation."""


class _CholeskyFactor(NamedTuple):
    """Entries of the lower triangular matrix L for which the covariance is L Lᵀ, m."""

    xx: float
    yy: float
    yx: float


class _StandardMoments(NamedTuple):
    """Moments of the standard Gaussian over n cells, or the contributions of e edges to them.

    In place of the second moments, there are the *deficits*, which the integrals along edges give directly:
    the entries of the mass times the identity matrix minus the second moments.
    """

    mass: FloatArray
    """Integral of the Gaussian g."""
    x: FloatArray
    """Integral of x g."""
    y: FloatArray
    """Integral of y g."""
    deficit_xx: FloatArray
    """Mass minus the integral of x² g."""
    deficit_xy: FloatArray
    """Minus the integral of x y g."""
    deficit_yy: FloatArray
    """Mass minus the integral of y² g."""


@dataclass(frozen=True)
class Gaussian:
    """A Gaussian, ``weight exp(-½ (q - c)ᵀ S⁻¹ (q - c))``.

    Parameters
    ----------
    center : (2,) sequence, m
        The center c, where the Gaussian has its maximum.
    weight : float
        Value at the center, at least 0.
    sigma : float or None, m
        Standard deviation in all directions, from 1e-100 to 1e100.
    covariance : (2, 2) sequence or None, m²
        Covariance S, an alternative to `sigma`: a symmetric and positive definite matrix with variances from
        1e-200 to 1e200 and an absolute correlation of at most 1 - 5e-10.

    Raises
    ------
    ParameterError
        If a value is out of range, or both or neither of `sigma` and `covariance` are given.

    See Also
    --------
    Gaussians : The density that consists of Gaussians.

    Examples
    --------
    >>> import robocov as rc
    >>> round_peak = rc.Gaussian((2.0, 0.0), weight=3.0, sigma=1.0)
    >>> long_peak = rc.Gaussian((2.0, 0.0), weight=3.0, covariance=((4.0, 0.0), (0.0, 0.25)))
    >>> rc.Gaussians((round_peak, long_peak)).upper_bound
    6.0
    """

    center: Point
    weight: float
    sigma: float | None = None
    covariance: Matrix | None = None

    def __post_init__(self) -> None:
        require_weight("weight", self.weight)
        if (self.sigma is None) == (self.covariance is None):
            got = "neither" if self.sigma is None else "both"
            raise ParameterError(f"sigma, covariance: expected one of them, got {got}")
        object.__setattr__(self, "center", _check_center(self.center))
        if self.sigma is not None:
            require_number("sigma", self.sigma, _MIN_SIGMA_M, _MAX_SIGMA_M, "m")
        if self.covariance is not None:
            object.__setattr__(self, "covariance", _check_covariance(self.covariance))

    @property
    def matrix(self) -> Matrix:
        """The covariance S, m²."""
        if self.covariance is not None:
            return self.covariance
        assert self.sigma is not None
        return (self.sigma**2, 0.0), (0.0, self.sigma**2)

    def evaluate(self, points: FloatArray) -> FloatArray:
        """Evaluate the Gaussian at points.

        Parameters
        ----------
        points : (k, 2) array, m
            The points.

        Returns
        -------
        (k,) array
            Value at each point.
        """
        standard = self._standardize(points - np.array(self.center))
        x = standard[:, 0]
        y = standard[:, 1]
        return np.asarray(self.weight * np.exp(-0.5 * (x * x + y * y)))

    def compute_moments(self, edges: CellEdges, origins: FloatArray) -> FloatArray:
        """Compute the mass, first moments and polar moment of each cell.

        Parameters
        ----------
        edges, origins
            See `Density.compute_moments`.

        Returns
        -------
        (n, 4) array, m², m³, m³ and m⁴
            See `Density.compute_moments`.
        """
        moments = self._compute_moments_in_closed_form(edges, origins)
        is_small = self._find_small_cells(edges, len(origins))
        if is_small.any():
            moments[is_small] = self._compute_moments_by_quadrature(edges, origins)[is_small]
        return moments

    def _find_small_cells(self, edges: CellEdges, cell_count: int) -> BoolArray:
        """Return whether each cell is much smaller than the standard deviation, (n,)."""
        is_far = compute_lengths(self._standardize(edges.starts)) > _SMALL_CELL_SIZE
        far_counts = np.bincount(edges.cells, is_far, minlength=cell_count)
        return np.asarray(far_counts == 0)

    def _compute_moments_by_quadrature(self, edges: CellEdges, origins: FloatArray) -> FloatArray:
        """Compute the moments of each cell as sums over the triangles between its generator and its edges."""
        nodes, weights = np.polynomial.legendre.leggauss(_QUADRATURE_ORDER)
        fractions = 0.5 * (nodes + 1.0)
        # Points t (start + s (end - start)) of a triangle. The area element, with a sign, is
        # (start x end) t ds dt.
        s, t = np.meshgrid(fractions, fractions)
        weight_grid = 0.25 * np.outer(weights, weights) * t
        along = s[..., None] * (edges.ends - edges.starts)[:, None, None]
        points = t[..., None] * (edges.starts[:, None, None] + along)
        cross = edges.starts[:, 0] * edges.ends[:, 1] - edges.starts[:, 1] * edges.ends[:, 0]
        values = self.evaluate((points + origins[edges.cells][:, None, None]).reshape(-1, 2))
        masses = values.reshape(points.shape[:-1]) * weight_grid * cross[:, None, None]
        x = points[..., 0]
        y = points[..., 1]
        moments = [
            np.bincount(edges.cells, (masses * factor).sum(axis=(1, 2)), minlength=len(origins))
            for factor in (np.ones_like(x), x, y, x * x + y * y)
        ]
        return np.column_stack(moments)

    def _compute_moments_in_closed_form(self, edges: CellEdges, origins: FloatArray) -> FloatArray:
        """Compute the moments of each cell as sums over its edges; see the description of the module."""
        # In standard coordinates, this is the standard Gaussian. The area element is L_xx L_yy times as
        # large.
        factor = self._factorize()
        offsets = origins - np.array(self.center)
        edge_offsets = offsets[edges.cells]
        starts = self._standardize(edges.starts + edge_offsets)
        ends = self._standardize(edges.ends + edge_offsets)
        scale = self.weight * factor.xx * factor.yy
        sums: list[FloatArray] = [
            np.asarray(np.bincount(edges.cells, contributions, minlength=len(origins)) * scale)
            for contributions in _integrate_along_edges(starts, ends)
        ]
        standard = _StandardMoments(*sums)
        # Convert the moments in standard coordinates to moments about the center of the Gaussian, in meters.
        mass = standard.mass
        x = factor.xx * standard.x
        y = factor.yx * standard.x + factor.yy * standard.y
        polar = (
            (factor.xx * factor.xx + factor.yx * factor.yx) * (mass - standard.deficit_xx)
            - 2.0 * factor.yy * factor.yx * standard.deficit_xy
            + factor.yy * factor.yy * (mass - standard.deficit_yy)
        )
        # Convert them to moments about the origins of the cells.
        offset_x = offsets[:, 0]
        offset_y = offsets[:, 1]
        squared_offset = (offsets * offsets).sum(axis=1)
        polar = polar - 2.0 * (offset_x * x + offset_y * y) + squared_offset * mass
        return np.column_stack([mass, x - offset_x * mass, y - offset_y * mass, polar])

    def _factorize(self) -> _CholeskyFactor:
        """Return the Cholesky factor L of the covariance."""
        (xx, xy), (_, yy) = self.matrix
        factor_xx = math.sqrt(xx)
        factor_yx = xy / factor_xx
        factor_yy = math.sqrt(yy - factor_yx * factor_yx)
        return _CholeskyFactor(xx=factor_xx, yy=factor_yy, yx=factor_yx)

    def _standardize(self, offsets: FloatArray) -> FloatArray:
        """Convert offsets from the center, (k, 2) m, to coordinates in which this is the standard Gaussian.

        An offset in meters is the Cholesky factor L times the offset in these coordinates.
        """
        factor = self._factorize()
        x = offsets[:, 0] / factor.xx
        y = (offsets[:, 1] - factor.yx * x) / factor.yy
        return np.column_stack([x, y])


@dataclass(frozen=True)
class Gaussians(Density):
    """A density that is the sum of Gaussians and a constant.

    Its integrals over cells are computed in closed form, with the error function and Owen's T function, or
    numerically for cells much smaller than a standard deviation.

    Parameters
    ----------
    peaks : tuple of Gaussian
        The Gaussians.
    floor : float
        The constant, at least 0.

    Raises
    ------
    ParameterError
        If all weights are 0, or the floor is out of range.

    See Also
    --------
    Gaussian : A peak of this density.
    Density : The interface of all densities.

    Examples
    --------
    >>> import numpy as np
    >>> import robocov as rc
    >>> density = rc.Gaussians((rc.Gaussian((2.0, 0.0), weight=3.0, sigma=1.0),), floor=0.5)
    >>> density.evaluate(np.array([[2.0, 0.0], [9.0, 0.0]])).round(6)
    array([3.5, 0.5])
    """

    kind: ClassVar[str] = "gaussians"

    peaks: tuple[Gaussian, ...]
    floor: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "peaks", to_tuples(self.peaks))
        require_weight("floor", self.floor)
        if not self.upper_bound > 0.0:
            raise ParameterError("floor: expected a number above 0 or a peak with a weight above 0, got 0")

    @property
    def lower_bound(self) -> float:
        """The constant, which is a lower bound on the density."""
        return self.floor

    @property
    def upper_bound(self) -> float:
        """The sum of the constant and all weights, which the density reaches only if all centers coincide."""
        return self.floor + sum(peak.weight for peak in self.peaks)

    def evaluate(self, points: FloatArray) -> FloatArray:
        """Evaluate the density at points.

        Parameters
        ----------
        points : (k, 2) array, m
            The points.

        Returns
        -------
        (k,) array
            Sum of the constant and all peaks at each point.
        """
        points = np.asarray(points, dtype=float)
        total = np.full(len(points), float(self.floor))
        for peak in self.peaks:
            total += peak.evaluate(points)
        return total

    def compute_moments(self, edges: CellEdges, origins: FloatArray) -> FloatArray:
        """Compute the mass, first moments and polar moment of each cell.

        Parameters
        ----------
        edges, origins
            See `Density.compute_moments`.

        Returns
        -------
        (n, 4) array, m², m³, m³ and m⁴
            See `Density.compute_moments`.
        """
        total = self.floor * edges.compute_moments(len(origins))
        for peak in self.peaks:
            total += peak.compute_moments(edges, origins)
        return total


def _integrate_along_edges(starts: FloatArray, ends: FloatArray) -> _StandardMoments:
    """Return the contributions of edges to the moments of the standard Gaussian g = exp(-|q|²/2) over cells.

    The edges lead from `starts` to `ends`, (e, 2) each, relative to the center. Let d be the signed distance
    of an edge from the center along the outward normal n, and let s run from s1 to s2 along the edge in its
    direction t. With e0 = ∫ g ds, e1 = ∫ s g ds, and Owen's function T, an edge adds

    - [atan(s/d) - 2π T(d, s/d)] from s1 to s2 to the mass,
    - -n e0 to the first moment, and
    - (d e0 n + e1 t) nᵀ to the deficits; see the description of the module.
    """
    # SciPy is imported only here, because loading a map does not need it.
    from scipy.special import erf, owens_t

    along = ends - starts
    lengths = compute_lengths(along)
    has_length = lengths > 0.0
    tangent_x, tangent_y = (along / np.where(has_length, lengths, 1.0)[:, None]).T
    normal_x = tangent_y
    normal_y = -tangent_x
    d = starts[:, 0] * normal_x + starts[:, 1] * normal_y
    s1 = starts[:, 0] * tangent_x + starts[:, 1] * tangent_y
    s2 = ends[:, 0] * tangent_x + ends[:, 1] * tangent_y
    has_distance = d != 0.0
    divisor = np.where(has_distance, d, 1.0)
    with np.errstate(over="ignore"):
        ratio1 = s1 / divisor
        ratio2 = s2 / divisor
    mass = np.arctan(ratio2) - np.arctan(ratio1) - 2.0 * np.pi * (owens_t(d, ratio2) - owens_t(d, ratio1))
    # If the line of an edge passes through the center, the integrand is zero.
    mass[~has_distance] = 0.0
    # Far from the center, the exponential underflows to zero, which is correct.
    peak = np.exp(-0.5 * d * d)
    e0 = peak * np.sqrt(np.pi / 2.0) * (erf(s2 / np.sqrt(2.0)) - erf(s1 / np.sqrt(2.0)))
    e1 = peak * (np.exp(-0.5 * s1 * s1) - np.exp(-0.5 * s2 * s2))
    contributions = _StandardMoments(
        mass=mass,
        x=-normal_x * e0,
        y=-normal_y * e0,
        deficit_xx=normal_x * (normal_x * (d * e0) + tangent_x * e1),
        deficit_xy=normal_y * (normal_x * (d * e0) + tangent_x * e1),
        deficit_yy=normal_y * (normal_y * (d * e0) + tangent_y * e1),
    )
    for values in contributions:
        values[~has_length] = 0.0
    return contributions


def _check_center(center: Any) -> Point:
    """Return a center as a tuple of floats; raise a ParameterError if it is not two finite numbers."""
    expected = "finite x and y in meters"
    coordinates = to_floats("center", center, expected)
    if coordinates.shape != (2,) or not np.isfinite(coordinates).all():
        raise ParameterError(f"center: expected {expected}, got {quote(center)}")
    x, y = coordinates.tolist()
    return x, y


def _check_covariance(covariance: Any) -> Matrix:
    """Return a covariance as tuples of floats; raise a ParameterError if it is not valid."""
    expected = (
        "a symmetric, positive definite 2 x 2 matrix in m² with variances from 1e-200 to 1e200 and "
        f"{CORRELATION_EXPECTED}"
    )
    entries = to_floats("covariance", covariance, expected)
    matrix = to_tuples(entries)
    if entries.shape != (2, 2) or not _is_valid_covariance(matrix):
        raise ParameterError(f"covariance: expected {expected}, got {quote(matrix)}")
    checked: Matrix = matrix
    return checked


def _is_valid_covariance(matrix: Matrix) -> bool:
    """Return whether a matrix is symmetric, positive definite, not nearly singular, and within the limits."""
    (a, b), (c, d) = matrix
    is_symmetric = b == c
    min_variance = _MIN_SIGMA_M**2
    max_variance = _MAX_SIGMA_M**2
    has_valid_diagonal = min_variance <= a <= max_variance and min_variance <= d <= max_variance
    return is_symmetric and has_valid_diagonal and not is_nearly_singular(matrix)


def is_nearly_singular(matrix: Sequence[Sequence[float]]) -> bool:
    """Return whether a matrix is singular, nearly singular or not positive definite.

    Parameters
    ----------
    matrix : (2, 2) sequence
        A symmetric matrix with a positive diagonal.

    Returns
    -------
    bool
    """
    (a, b), (c, d) = matrix
    determinant = a * d - b * c
    return determinant <= _MIN_RELATIVE_DETERMINANT * a * d
