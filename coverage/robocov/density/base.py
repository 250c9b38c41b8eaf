"""The interface of all densities, and the uniform density.

Equation numbers refer to Renzaglia and Martinelli, "Distributed Coverage Control for a Multi-Robot Team in a
Non-Convex Environment".
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from robocov.density.cell_edges import MASS, MOMENT_X, MOMENT_Y, CellEdges
from robocov.errors import ParameterError, is_number, quote
from robocov.typing import FloatArray

MAX_WEIGHT = 1e6
"""Maximum value of a weight."""

_MIN_MEAN_DENSITY = 1e-9
"""Minimum mean density for which the centroid of a cell is computed, as a fraction of the maximum
density."""


class Density(ABC):
    """The importance φ of each point, as in equation (4). It is dimensionless and never negative.

    A density is immutable. Subclasses define `kind` and the four abstract members.

    See Also
    --------
    Uniform : The same weight everywhere.
    Gaussians : A sum of Gaussians.
    WeightedPolygons : Polygons of constant weight.
    Raster : An image.
    Environment.with_density : Give a map a density.

    Notes
    -----
    φ is the weight of a point in the locational cost (4), in the masses and centroids (2) of cells, and in
    the coverage cost (22). The paper names it as future work.

    Examples
    --------
    >>> import robocov as rc
    >>> hall = rc.Environment("hall", ((0.0, 0.0), (10.0, 0.0), (10.0, 6.0), (0.0, 6.0)))
    >>> peak = rc.Gaussian((8.0, 3.0), weight=4.0, sigma=1.0)
    >>> weighted = hall.with_density(rc.Gaussians((peak,), floor=0.2))
    >>> isinstance(weighted.density, rc.Density), weighted.density.upper_bound >= 4.0
    (True, True)
    """

    kind: ClassVar[str]
    """Name of this kind of density in map files."""

    @property
    @abstractmethod
    def lower_bound(self) -> float:
        """A lower bound on the density."""

    @property
    @abstractmethod
    def upper_bound(self) -> float:
        """An upper bound on the density."""

    @abstractmethod
    def evaluate(self, points: FloatArray) -> FloatArray:
        """Evaluate the density at points.

        Parameters
        ----------
        points : (k, 2) array, m
            The points.

        Returns
        -------
        (k,) array
            φ at each point.
        """

    @abstractmethod
    def compute_moments(self, edges: CellEdges, origins: FloatArray) -> FloatArray:
        """Compute the mass, first moments and polar moment of each cell about its origin.

        Parameters
        ----------
        edges : CellEdges
            Edges of n cells, relative to the origins. The cells may be any closed polygons, with the edges of
            holes in clockwise order.
        origins : (n, 2) array, m
            Origin of each cell: for Voronoi cells, the generator.

        Returns
        -------
        (n, 4) array, m², m³, m³ and m⁴
            Integrals of φ, of the two components of φ (q - o), and of ``φ |q - o|²`` over the points q of
            each cell, where o is the origin of the cell.
        """

    @property
    def is_uniform(self) -> bool:
        """Whether the density is known to be the same everywhere, because the bounds coincide."""
        return self.lower_bound == self.upper_bound

    def compute_masses_and_centroids(
        self, edges: CellEdges, origins: FloatArray, areas: FloatArray, area_centroids: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Compute the masses and centroids of cells, M and C of equation (2).

        Parameters
        ----------
        edges, origins
            See `compute_moments`.
        areas : (n,) array, m²
            Areas of the cells.
        area_centroids : (n, 2) array, m
            Centroids of the cells for a uniform density.

        Returns
        -------
        masses : (n,) array, m²
            Integral of φ over each cell.
        centroids : (n, 2) array, m
            Center of mass of each cell. For a cell without mass and area, it is that of `area_centroids`.

        Notes
        -----
        Where the mean density of a cell is below 1e-9 of the maximum, rounding errors would dominate the
        centroid. The centroid is then computed as if the cell also contained a uniform density that raises
        its mean to this value. The returned masses are not changed.
        """
        moments = self.compute_moments(edges, origins)
        # Rounding can make the mass of a cell with hardly any density negative.
        masses = np.maximum(moments[:, MASS], 0.0)
        added_masses = np.maximum(_MIN_MEAN_DENSITY * self.upper_bound * areas - masses, 0.0)
        weights = masses + added_masses
        added_moments = added_masses[:, None] * (area_centroids - origins)
        first_moments = moments[:, [MOMENT_X, MOMENT_Y]] + added_moments
        has_weight = weights > 0.0
        offsets = first_moments / np.where(has_weight, weights, 1.0)[:, None]
        return masses, np.where(has_weight[:, None], origins + offsets, area_centroids)


def require_weight(name: str, value: float, *, above_zero: bool = False) -> None:
    """Raise an error unless a weight is between 0 and `MAX_WEIGHT`.

    Parameters
    ----------
    name : str
        Name of the parameter in the error message.
    value : float
        The weight.
    above_zero : bool
        Whether 0 is out of range as well.

    Raises
    ------
    ParameterError
        If the weight is out of range.
    """
    is_in_range = is_number(value) and 0.0 <= value <= MAX_WEIGHT
    if not is_in_range or (above_zero and value == 0.0):
        lower_limit = "above" if above_zero else "from"
        allowed = f"{lower_limit} 0 to {MAX_WEIGHT:.0f}"
        raise ParameterError(f"{name}: expected a number {allowed}, got {quote(value)}")


@dataclass(frozen=True)
class Uniform(Density):
    """The same weight everywhere, which only scales the coverage cost.

    Parameters
    ----------
    weight : float
        The density at every point, above 0.

    Raises
    ------
    ParameterError
        If the weight is out of range.

    See Also
    --------
    Density : The interface of all densities.

    Examples
    --------
    >>> import numpy as np
    >>> import robocov as rc
    >>> rc.Uniform(2.0).evaluate(np.array([[0.0, 0.0], [1.0, 1.0]]))
    array([2., 2.])
    """

    kind: ClassVar[str] = "uniform"

    weight: float = 1.0

    def __post_init__(self) -> None:
        require_weight("weight", self.weight, above_zero=True)

    @property
    def lower_bound(self) -> float:
        """The weight."""
        return self.weight

    @property
    def upper_bound(self) -> float:
        """The weight."""
        return self.weight

    def evaluate(self, points: FloatArray) -> FloatArray:
        """Evaluate the density, which is the weight at every point.

        Parameters
        ----------
        points : (k, 2) array, m
            The points.

        Returns
        -------
        (k,) array
            The weight, once for each point.
        """
        return np.full(len(points), float(self.weight))

    def compute_moments(self, edges: CellEdges, origins: FloatArray) -> FloatArray:
        """Compute the moments of each cell: those for density 1 times the weight.

        Parameters
        ----------
        edges, origins
            See `Density.compute_moments`.

        Returns
        -------
        (n, 4) array, m², m³, m³ and m⁴
            See `Density.compute_moments`.
        """
        return self.weight * edges.compute_moments(len(origins))
