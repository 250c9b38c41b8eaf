"""The density φ: how much each place of the region counts.

    Density
    ├── Uniform           every place the same
    ├── Gaussians         hot spots over a floor
    ├── WeightedPolygons  piecewise constant: rooms that count more, or not at all
    └── Raster            a picture, piecewise constant or bilinear

Every density integrates over all Voronoi cells at once, in closed form or exactly by quadrature: by the
divergence theorem an integral over a cell is a sum over its edges, so that no cell is ever clipped.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar, TypeAlias

import numpy as np

from robocov.arrays import Array
from robocov.density.base import HEAVIEST, Density, check_weight
from robocov.density.gaussian_moments import Bells, bell_moments
from robocov.density.moments import Moments, flat_moments
from robocov.density.polygon_moments import Jumps, step_moments
from robocov.density.raster import FINEST, Interpolation, Raster, sampled
from robocov.errors import ParameterError, shown

if TYPE_CHECKING:
    from shapely import Polygon

    from robocov.voronoi.cell_edges import CellEdges

__all__ = [
    "FINEST",
    "HEAVIEST",
    "Density",
    "Gaussian",
    "Gaussians",
    "Interpolation",
    "Raster",
    "Uniform",
    "WeightedArea",
    "WeightedPolygons",
    "sampled",
]

Point: TypeAlias = tuple[float, float]
Ring: TypeAlias = tuple[Point, ...]
Matrix: TypeAlias = tuple[Point, Point]


@dataclass(frozen=True)
class Uniform(Density):
    """Every place counts the same: as no density at all, but for the unit of the cost.

    Attributes
    ----------
    weight : float
        Above 0.
    """

    kind: ClassVar[str] = "uniform"

    weight: float = 1.0

    def __post_init__(self) -> None:
        check_weight("weight", self.weight, above=True)

    @property
    def lowest(self) -> float:
        """The weight."""
        return self.weight

    @property
    def highest(self) -> float:
        """The weight."""
        return self.weight

    def value(self, points: Array) -> Array:
        """Return φ at (k, 2) points in metres, (k,)."""
        return np.full(len(points), float(self.weight))

    def moments(self, edges: CellEdges, origins: Array) -> Moments:
        """Return mass, first and polar moments of cells about their origins."""
        return flat_moments(edges, len(origins)).times(self.weight)


@dataclass(frozen=True)
class Gaussian:
    """One hot spot, ``weight exp(-½ (q - c)ᵀ S⁻¹ (q - c))``.

    Attributes
    ----------
    center : (x, y) m
    weight : float
        What it adds at its centre, from 0.
    sigma : float, m, or None
        Its standard deviation where it is round; else
    covariance : 2 x 2, m², or None
        S, symmetric and positive definite.
    """

    center: Point
    weight: float
    sigma: float | None = None
    covariance: Matrix | None = None

    def __post_init__(self) -> None:
        check_weight("weight", self.weight)
        if (self.sigma is None) == (self.covariance is None):
            raise ParameterError("sigma and covariance: either one of them was wanted")
        if self.sigma is not None and not 0.0 < self.sigma < math.inf:
            raise ParameterError(f"sigma: {shown(self.sigma)} m, but a number above 0 was wanted")
        if self.covariance is not None and not _definite(self.covariance):
            wanted = "a symmetric, positive definite 2 x 2 matrix was wanted"
            raise ParameterError(f"covariance: {shown(self.covariance)} m², but {wanted}")

    @property
    def matrix(self) -> Matrix:
        """S, m²."""
        if self.covariance is not None:
            return self.covariance
        assert self.sigma is not None
        return (self.sigma**2, 0.0), (0.0, self.sigma**2)


@dataclass(frozen=True)
class Gaussians(Density):
    """A sum of hot spots over a floor. Its integrals are closed forms of erf and of Owen's T function.

    Attributes
    ----------
    peaks : tuple of Gaussian
    floor : float
        What every place counts without them, from 0.

    Examples
    --------
    >>> density = Gaussians((Gaussian((2.0, 0.0), weight=3.0, sigma=1.0),), floor=0.5)
    >>> density.value(np.array([[2.0, 0.0], [9.0, 0.0]])).round(6)
    array([3.5, 0.5])
    """

    kind: ClassVar[str] = "gaussians"

    peaks: tuple[Gaussian, ...]
    floor: float = 0.0

    def __post_init__(self) -> None:
        check_weight("floor", self.floor)
        if not self.floor + sum(peak.weight for peak in self.peaks) > 0.0:
            raise ParameterError("floor: 0, and no peak of a weight above 0, but some weight was wanted")

    @property
    def lowest(self) -> float:
        """The floor."""
        return self.floor

    @property
    def highest(self) -> float:
        """The floor and all weights."""
        return self.floor + sum(peak.weight for peak in self.peaks)

    @cached_property
    def _bells(self) -> Bells:
        return Bells.of(
            np.array([peak.center for peak in self.peaks], dtype=float).reshape(-1, 2),
            np.array([peak.matrix for peak in self.peaks], dtype=float).reshape(-1, 2, 2),
            np.array([peak.weight for peak in self.peaks], dtype=float),
        )

    def value(self, points: Array) -> Array:
        """Return φ at (k, 2) points in metres, (k,)."""
        return self.floor + self._bells.value(np.asarray(points, dtype=float))

    def moments(self, edges: CellEdges, origins: Array) -> Moments:
        """Return mass, first and polar moments of cells about their origins."""
        flat = flat_moments(edges, len(origins)).times(self.floor)
        return flat.plus(bell_moments(self._bells, edges, origins))


@dataclass(frozen=True)
class WeightedArea:
    """A polygon in which every place counts the same.

    Attributes
    ----------
    vertices : ring of [x, y], m
        Either way round, the first not repeated.
    weight : float
        From 0.
    holes : tuple of rings
        Not part of it.
    name : str or None
    """

    vertices: Ring
    weight: float
    holes: tuple[Ring, ...] = ()
    name: str | None = None

    def __post_init__(self) -> None:
        check_weight("weight", self.weight)

    @cached_property
    def polygon(self) -> Polygon:
        """The area as a shapely polygon."""
        from shapely import Polygon

        return Polygon(self.vertices, self.holes)


@dataclass(frozen=True)
class WeightedPolygons(Density):
    """A density that is constant in polygons, and outside them all. Its integrals are exact.

    Attributes
    ----------
    areas : tuple of WeightedArea
        Where some overlap, the last of them counts.
    background : float
        What a place outside them all counts, from 0.
    """

    kind: ClassVar[str] = "polygons"

    areas: tuple[WeightedArea, ...]
    background: float = 1.0

    def __post_init__(self) -> None:
        check_weight("background", self.background)
        if not self.highest > 0.0:
            raise ParameterError("background: 0, and no area of a weight above 0, but some weight was wanted")

    @property
    def lowest(self) -> float:
        """The smallest weight."""
        return min([self.background, *(area.weight for area in self.areas)])

    @property
    def highest(self) -> float:
        """The largest weight."""
        return max([self.background, *(area.weight for area in self.areas)])

    @cached_property
    def _jumps(self) -> Jumps:
        areas = [(area.polygon, area.weight - self.background) for area in self.areas]
        return Jumps.of(areas)

    def value(self, points: Array) -> Array:
        """Return φ at (k, 2) points in metres, (k,)."""
        import shapely

        x, y = np.asarray(points, dtype=float).T
        value = np.full(len(x), float(self.background))
        for area in self.areas:
            value[shapely.contains_xy(area.polygon, x, y)] = area.weight
        return value

    def moments(self, edges: CellEdges, origins: Array) -> Moments:
        """Return mass, first and polar moments of cells about their origins."""
        flat = flat_moments(edges, len(origins)).times(self.background)
        return flat.plus(step_moments(self._jumps, edges, origins))


def _definite(matrix: Matrix) -> bool:
    (a, b), (c, d) = matrix
    # beyond, a Gaussian is a line for this arithmetic
    return b == c and a > 0.0 and d > 0.0 and a * d - b * c > 1e-9 * a * d and a + d < math.inf
