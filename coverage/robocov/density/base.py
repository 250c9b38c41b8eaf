"""The interface of densities, and the uniform one."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from robocov.arrays import Array
from robocov.density.cell_edges import MASS, MOMENT_X, MOMENT_Y, CellEdges
from robocov.errors import ParameterError, quote

MAX_WEIGHT = 1e6
"""Maximum value of a weight."""

_MIN_MEAN_DENSITY = 1e-9
"""Smallest mean density with which a centroid is computed, as a fraction of the largest density."""


class Density(ABC):
    """Importance of each point: φ of equation (4), dimensionless, never negative, and immutable.

    See Also
    --------
    Uniform : The same weight everywhere.
    Gaussians : A sum of Gaussians.
    WeightedPolygons : Polygons of constant weight.
    Raster : An image.
    Environment.with_density : Give a map a density.

    Notes
    -----
    φ weights points in the locational cost (4), in the masses and centroids (2) of cells, and in the coverage
    cost (22). The paper names it as future work.

    Examples
    --------
    >>> import numpy as np
    >>> import robocov as rc
    >>> hall = rc.Environment("hall", ((0.0, 0.0), (10.0, 0.0), (10.0, 6.0), (0.0, 6.0)))
    >>> peak = rc.Gaussian((8.0, 3.0), weight=4.0, sigma=1.0)
    >>> weighted = hall.with_density(rc.Gaussians((peak,), floor=0.2))
    >>> isinstance(weighted.density, rc.Density), weighted.density.max_value >= 4.0
    (True, True)
    """

    kind: ClassVar[str]
    """Name in map files."""

    @property
    @abstractmethod
    def min_value(self) -> float:
        """A lower bound on the density."""

    @property
    @abstractmethod
    def max_value(self) -> float:
        """An upper bound on the density."""

    @abstractmethod
    def evaluate(self, points: Array) -> Array:
        """Evaluate the density.

        Parameters
        ----------
        points : (k, 2) array, m

        Returns
        -------
        (k,) array
        """

    @abstractmethod
    def compute_moments(self, edges: CellEdges, origins: Array) -> Array:
        """Compute mass, first moments and polar moment of cells about given points.

        Parameters
        ----------
        edges : CellEdges
            Edges of n closed polygons of any kind, holes clockwise, relative to the origins.
        origins : (n, 2) array, m
            For Voronoi cells, these are the generators.

        Returns
        -------
        (n, 4) array, m², m³, m³ and m⁴
            Integrals of φ, φ (q - o) and ``φ |q - o|²`` over each cell, with o its origin.
        """

    @property
    def is_uniform(self) -> bool:
        """Whether the density is the same everywhere."""
        return self.min_value == self.max_value

    def compute_mass_and_centroid(
        self, edges: CellEdges, origins: Array, area: Array, centroid: Array
    ) -> tuple[Array, Array]:
        """Compute mass and centroid of cells, M and C of equation (2).

        Parameters
        ----------
        edges, origins
            See `compute_moments`.
        area : (n,) array, m²
            Areas of the cells.
        centroid : (n, 2) array, m
            Centroids for density 1. Cells without area or mass keep them. If the mean density of a cell is
            below 1e-9 of the maximum, uniform mass is added to make up the difference, because rounding
            would otherwise decide where the centroid is.

        Returns
        -------
        mass : (n,) array, m²
        centroid : (n, 2) array, m
        """
        moments = self.compute_moments(edges, origins)
        mass = np.maximum(moments[:, MASS], 0.0)
        added_mass = np.maximum(_MIN_MEAN_DENSITY * self.max_value * area - mass, 0.0)
        weight = mass + added_mass
        first_moments = moments[:, [MOMENT_X, MOMENT_Y]] + added_mass[:, None] * (centroid - origins)
        has_weight = weight > 0.0
        offset = first_moments / np.where(has_weight, weight, 1.0)[:, None]
        return mass, np.where(has_weight[:, None], origins + offset, centroid)


def require_weight(name: str, value: float, *, above_zero: bool = False) -> None:
    """Raise an error unless a weight is between 0 and `MAX_WEIGHT`.

    Parameters
    ----------
    name : str
        Name of the parameter, for the message.
    value : float
    above_zero : bool
        Whether zero is out of range as well.

    Raises
    ------
    ParameterError
        If the weight is out of range.
    """
    is_large_enough = value > 0.0 if above_zero else value >= 0.0
    if not (is_large_enough and value <= MAX_WEIGHT):
        lower_limit = "above" if above_zero else "from"
        allowed = f"{lower_limit} 0 to {MAX_WEIGHT:.0f}"
        raise ParameterError(f"{name}: expected a number {allowed}, got {quote(value)}")


@dataclass(frozen=True)
class Uniform(Density):
    """The same weight everywhere, which only scales the coverage cost.

    Parameters
    ----------
    weight : float
        Above 0.

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
    def min_value(self) -> float:
        """The weight."""
        return self.weight

    @property
    def max_value(self) -> float:
        """The weight."""
        return self.weight

    def evaluate(self, points: Array) -> Array:
        """Evaluate the density: the weight at every point.

        Parameters
        ----------
        points : (k, 2) array, m

        Returns
        -------
        (k,) array
        """
        return np.full(len(points), float(self.weight))

    def compute_moments(self, edges: CellEdges, origins: Array) -> Array:
        """Compute the moments of cells: the moments for density 1, times the weight.

        Parameters
        ----------
        edges, origins
            See `Density.compute_moments`.

        Returns
        -------
        (n, 4) array, m², m³, m³ and m⁴
        """
        return self.weight * edges.compute_moments(len(origins))
