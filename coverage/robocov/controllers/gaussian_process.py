"""Gaussian process of a density: its posterior on a grid of squares, given measurements in some of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robocov.compiled import kernel
from robocov.controllers.square_grid import SquareGrid
from robocov.observation.region import Region
from robocov.typing import BoolArray, FloatArray, IntArray

NOISE_VARIANCE = 1e-2
"""Variance of a measurement, relative to that of the prior. It includes changes of φ within a square."""
SAMPLES_PER_SIDE = 2
"""Number of samples along each side of a square."""


@dataclass(frozen=True, slots=True, eq=False)
class ProcessGrid:
    """Squares in which robots measure a density, and finer samples of the Voronoi cells."""

    centers: FloatArray
    """(s, 2) m, centers of the squares, row by row from the lowest."""
    prior_correlations: FloatArray
    """(s, s) Correlations of φ at the centers of the squares, before any measurement. They are a
    squared-exponential function of the distance."""
    samples: FloatArray
    """(k, 2) m, samples of the region."""
    surrounding_squares: IntArray
    """(k, 4) Indices of the four squares around each sample."""
    square_weights: FloatArray
    """(k, 4) Weights of these squares in the bilinear interpolation."""

    @classmethod
    def build(cls, region: Region, squares_per_side: int, correlation: float) -> ProcessGrid:
        """Build the grid of a region.

        Parameters
        ----------
        region : Region
        squares_per_side : int
            Number of squares along the longer side of the bounding box.
        correlation : float
            Correlation length of the process, relative to this side.
        """
        grid = SquareGrid.build(region, squares_per_side)
        rows, columns = grid.shape
        low, high = np.reshape(region.bounds, (2, 2))
        length = correlation * float((high - low).max())
        sample_cells = _list_cells(SAMPLES_PER_SIDE * rows, SAMPLES_PER_SIDE * columns)
        # Coordinates of the samples in squares, from the lower left corner of the grid.
        coordinates = (sample_cells + 0.5) / SAMPLES_PER_SIDE
        samples = low + grid.side * coordinates
        is_inside = region.contains(samples)
        surrounding_squares, square_weights = _find_surrounding_squares(coordinates[is_inside], rows, columns)
        squared_distances = ((grid.centers[:, None] - grid.centers) ** 2).sum(axis=2)
        return cls(
            centers=grid.centers,
            prior_correlations=np.exp(-squared_distances / (2.0 * length**2)),
            samples=samples[is_inside],
            surrounding_squares=surrounding_squares,
            square_weights=square_weights,
        )

    def find_square(self, position: FloatArray) -> int:
        """Return the index of the square whose center is nearest to a position, (2,) m."""
        return int(((self.centers - position) ** 2).sum(axis=1).argmin())

    def interpolate(self, values: FloatArray) -> FloatArray:
        """Interpolate values of the squares, (s,), to the samples, (k,)."""
        return np.asarray((values[self.surrounding_squares] * self.square_weights).sum(axis=1))


@dataclass(frozen=True, slots=True, eq=False)
class Posterior:
    """Posterior covariances of φ between squares, after measurements in some of them. Immutable.

    They do not depend on the measured values, and are updated whenever another square is measured.

    Attributes
    ----------
    covariances : (s, s) array
        Posterior covariances of φ in the squares, divided by the prior variance.
    is_measured : (s,) bool array
        The squares with a measurement.

    Examples
    --------
    >>> region = Region(np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]]))
    >>> grid = ProcessGrid.build(region, squares_per_side=4, correlation=0.1)
    >>> measurements = np.full(16, np.nan)
    >>> measurements[0] = 3.0
    >>> posterior = Posterior.build_prior(grid).condition_on(~np.isnan(measurements))
    >>> mean = posterior.compute_mean(measurements, prior_mean=1.0)
    >>> deviations = posterior.compute_deviations()
    >>> mean[[0, 15]].round(2), deviations[[0, 15]].round(2)
    (array([2.98, 1.  ]), array([0.1, 1. ]))
    """

    covariances: FloatArray
    is_measured: BoolArray

    @classmethod
    def build_prior(cls, grid: ProcessGrid) -> Posterior:
        """Build the posterior without any measurement."""
        square_count = len(grid.centers)
        return cls(grid.prior_correlations, np.zeros(square_count, dtype=bool))

    def condition_on(self, is_measured: BoolArray) -> Posterior:
        """Return the posterior given measurements in these squares.

        Parameters
        ----------
        is_measured : (s,) bool array
            All squares with a measurement. They include those of this posterior.

        Returns
        -------
        Posterior
        """
        new_squares = np.flatnonzero(is_measured & ~self.is_measured)
        if not len(new_squares):
            return self
        covariances = _add_measurements(self.covariances, new_squares, NOISE_VARIANCE)
        return Posterior(covariances, is_measured.copy())

    def compute_mean(self, measurements: FloatArray, prior_mean: float) -> FloatArray:
        """Compute the posterior mean of φ in each square.

        Parameters
        ----------
        measurements : (s,) array
            The measurements in the measured squares; nan in the others.
        prior_mean : float
            Mean of φ before any measurement.

        Returns
        -------
        (s,) array
        """
        known = np.flatnonzero(self.is_measured)
        residuals = (measurements[known] - prior_mean) / NOISE_VARIANCE
        return prior_mean + _multiply_columns(self.covariances, known, residuals)

    def compute_deviations(self) -> FloatArray:
        """Compute the standard deviation of φ in each square, (s,), relative to that of the prior."""
        return np.sqrt(np.maximum(np.diagonal(self.covariances), 0.0))


def _list_cells(rows: int, columns: int) -> FloatArray:
    """Return the column and the row of each cell of a grid, (rows * columns, 2)."""
    row_numbers, column_numbers = np.indices((rows, columns))
    return np.column_stack([column_numbers.ravel(), row_numbers.ravel()])


def _find_surrounding_squares(
    coordinates: FloatArray, rows: int, columns: int
) -> tuple[IntArray, FloatArray]:
    """Return the indices of the four squares around each point, and their bilinear weights, (k, 4) each.

    Squares are numbered row by row. `coordinates`, (k, 2), are measured from the lower left corner of the
    grid, in sides of a square. A point outside the outermost centers is moved to the nearest point between
    them.
    """
    # The center of the first square is at 0.
    limits = np.array([columns - 1, rows - 1])
    center_coordinates = np.clip(coordinates - 0.5, 0.0, limits)
    lower = np.minimum(center_coordinates.astype(np.intp), np.maximum(limits - 1, 0))
    upper = np.minimum(lower + 1, limits)
    fraction_x, fraction_y = (center_coordinates - lower).T
    surrounding_squares = np.column_stack(
        [
            lower[:, 1] * columns + lower[:, 0],
            lower[:, 1] * columns + upper[:, 0],
            upper[:, 1] * columns + lower[:, 0],
            upper[:, 1] * columns + upper[:, 0],
        ]
    )
    weights = np.column_stack(
        [
            (1.0 - fraction_x) * (1.0 - fraction_y),
            fraction_x * (1.0 - fraction_y),
            (1.0 - fraction_x) * fraction_y,
            fraction_x * fraction_y,
        ]
    )
    return surrounding_squares, weights


@kernel
def _add_measurements(covariances: FloatArray, new_squares: IntArray, noise_variance: float) -> FloatArray:
    """Return the posterior covariances after the new squares have been measured, one after another.

    Rank-one update per square s: K - k kᵀ / (k_ss + σ²), where k is the column of K for s, and σ² is the
    variance of a measurement. All variances and covariances are divided by the prior variance.

    The results have the same bits on all processors, unlike those of a factorization by LAPACK.
    """
    covariances = covariances.copy()
    count = len(covariances)
    for square in new_squares:
        row = covariances[square].copy()
        variance = row[square] + noise_variance
        for i in range(count):
            factor = row[i] / variance
            # Skip distant squares, whose correlation has underflowed to 0.
            if factor != 0.0:
                for j in range(count):
                    covariances[i, j] -= factor * row[j]
    return covariances


@kernel
def _multiply_columns(matrix: FloatArray, columns: IntArray, factors: FloatArray) -> FloatArray:
    """Return the sum of some columns of a symmetric matrix, each multiplied by a factor."""
    result = np.zeros(len(matrix))
    for k in range(len(columns)):
        row = matrix[columns[k]]
        for i in range(len(result)):
            result[i] += row[i] * factors[k]
    return result
