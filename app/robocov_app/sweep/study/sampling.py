"""Ranges of gains, and quasi-random samples from them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

import numpy as np

from robocov.errors import MAX_SEED, ParameterError, describe_unknown_name, require_number
from robocov.typing import FloatArray

Scale: TypeAlias = Literal["linear", "log"]
SamplingMethod: TypeAlias = Literal["sobol", "latin-hypercube", "halton"]
MAX_SAMPLES = 100_000
"""Maximum number of samples."""
_SAMPLE_DIGITS = 6
"""Number of significant digits of a sampled gain; further digits could differ between processors."""


@dataclass(frozen=True)
class Range:
    """Range of a gain.

    Attributes
    ----------
    low, high : float
        Ends of the range, both included, in the unit of the gain.
    scale : {"linear", "log"}
        Whether the values or their logarithms are uniformly distributed.
    """

    low: float
    high: float
    scale: Scale = "linear"

    def interpolate(self, fractions: FloatArray) -> list[float]:
        """Return the values at fractions of the range.

        Parameters
        ----------
        fractions : (m,) array
            From 0 for the lower end to 1 for the upper end.

        Returns
        -------
        list of float
            m values, rounded to six significant digits.
        """
        if self.scale == "log":
            low = math.log(self.low)
            high = math.log(self.high)
            exact = np.exp(low + (high - low) * fractions)
        else:
            exact = self.low + (self.high - self.low) * fractions
        values = []
        for value in exact.tolist():
            rounded = float(f"{value:.{_SAMPLE_DIGITS}g}")
            # Rounded values may be outside the range.
            values.append(min(max(rounded, self.low), self.high))
        return values


@dataclass(frozen=True)
class Sampling:
    """Joint sampling of the ranges of a controller, with a scrambled sequence from `scipy.stats.qmc`.

    Attributes
    ----------
    method : {"sobol", "latin-hypercube", "halton"}
        Kind of sequence.
    samples : int
        Number of samples.
    seed : int
        Seed of the scrambling.

    Raises
    ------
    ParameterError
        If a value is invalid.
    """

    method: SamplingMethod = "sobol"
    samples: int = 16
    seed: int = 0

    def __post_init__(self) -> None:
        methods = get_args(SamplingMethod)
        if self.method not in methods:
            raise ParameterError(f"sampling.method: {describe_unknown_name('method', self.method, methods)}")
        require_number("sampling.samples", self.samples, 1, MAX_SAMPLES, whole=True)
        require_number("sampling.seed", self.seed, 0, MAX_SEED, whole=True)

    def draw_points(self, dimensions: int) -> FloatArray:
        """Draw points in the unit cube.

        Parameters
        ----------
        dimensions : int
            Number of coordinates of each point.

        Returns
        -------
        (samples, dimensions) array
            The points, with coordinates from 0 to 1.
        """
        from scipy.stats import qmc

        rng = np.random.default_rng(self.seed)
        if self.method == "sobol":
            # Sobol sequences are balanced if their length is a power of two.
            exponent = (self.samples - 1).bit_length()
            points = qmc.Sobol(dimensions, seed=rng).random_base2(exponent)[: self.samples]
        elif self.method == "halton":
            points = qmc.Halton(dimensions, seed=rng).random(self.samples)
        else:
            points = qmc.LatinHypercube(dimensions, seed=rng).random(self.samples)
        return np.asarray(points)
