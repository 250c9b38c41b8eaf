"""Worlds in the default setting of CoverageControl: an open square with a density of many peaks.

CoverageControl (Agarwal et al. 2024, LPAC) is another simulator of coverage control. By default, a world is
a square of 1024 m without walls, and its density is the sum of 32 circular Gaussians. Each is cut off at two
standard deviations. Robots start anywhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy

from robocov.density import Raster
from robocov.environment import Environment, UniformStart
from robocov.typing import FloatArray

SIDE_M = 1024.0
"""Side of a world."""
PIXELS = 1024
"""Number of pixels along a side of the exact density."""
RASTER_PIXELS = 256
"""Number of pixels along a side of the density of a map."""
ROBOTS = 32
"""Default number of robots."""
PEAKS = 32
"""Number of peaks of a density."""
SIGMA_RANGE_M = (40.0, 50.0)
"""Range of the standard deviation of a peak."""
MASS_RANGE = (6.0, 10.0)
"""Range of the integral of a peak before truncation."""
TRUNCATION = 2.0
"""Distance from its center at which a peak ends, in standard deviations."""
_START_MARGIN_M = 1.0
"""Minimum distance of the starts of `draw_world` from the sides."""
_DENSITY_DIGITS = 3
"""Number of decimal places of the density of a map. Rounding hides differences between processors, which
would change the hash of the map."""


class Peak(NamedTuple):
    """A circular Gaussian, cut off at `TRUNCATION` standard deviations."""

    x: float
    """m"""
    y: float
    """m"""
    sigma: float
    """Standard deviation, m."""
    mass: float
    """Integral of the density before truncation."""


class World(NamedTuple):
    """A world, and the starts of the robots."""

    peaks: Sequence[Peak]
    density: FloatArray
    """(PIXELS, PIXELS) Density by row (y) and column (x), at most 1."""
    starts: FloatArray
    """(ROBOTS, 2) m"""


def draw_world(seed: int) -> World:
    """Draw a world, and starts of robots, with the default parameters of CoverageControl.

    Parameters
    ----------
    seed : int
        Seed of the random numbers.

    Returns
    -------
    World
    """
    rng = np.random.default_rng(seed)
    peaks = _draw_peaks(rng)
    starts = rng.uniform(_START_MARGIN_M, SIDE_M - _START_MARGIN_M, (ROBOTS, 2))
    return World(peaks=peaks, density=compute_density(peaks), starts=starts)


def draw_peaks(seed: int) -> list[Peak]:
    """Draw the peaks of the world that `draw_world` draws with the same seed.

    Parameters
    ----------
    seed : int
        Seed of the random numbers.

    Returns
    -------
    list of Peak
    """
    return _draw_peaks(np.random.default_rng(seed))


def _draw_peaks(rng: np.random.Generator) -> list[Peak]:
    """Draw the peaks of a world."""
    peaks = []
    for _ in range(PEAKS):
        x, y = rng.uniform(0.0, SIDE_M, 2).tolist()
        peaks.append(Peak(x=x, y=y, sigma=rng.uniform(*SIGMA_RANGE_M), mass=rng.uniform(*MASS_RANGE)))
    return peaks


def compute_density(peaks: Sequence[Peak]) -> FloatArray:
    """Compute the density of each pixel: the mass of all peaks in it, divided by the maximum over all pixels.

    Parameters
    ----------
    peaks : sequence of Peak

    Returns
    -------
    (PIXELS, PIXELS) array
        Density by row (y) and column (x), at most 1.
    """
    edges = np.linspace(0.0, SIDE_M, PIXELS + 1)
    centers = 0.5 * (edges[:-1] + edges[1:])
    density = np.zeros((PIXELS, PIXELS))
    for peak in peaks:
        mass_x = np.diff(scipy.special.ndtr((edges - peak.x) / peak.sigma))
        mass_y = np.diff(scipy.special.ndtr((edges - peak.y) / peak.sigma))
        squared_distances = (centers - peak.x) ** 2 + (centers[:, None] - peak.y) ** 2
        is_near = squared_distances <= (TRUNCATION * peak.sigma) ** 2
        density += np.where(is_near, peak.mass * mass_x * mass_y[:, None], 0.0)
    relative: FloatArray = density / density.max()
    return relative


def merge_pixels(density: FloatArray) -> FloatArray:
    """Downsample a density to the raster of a map by averaging blocks of pixels.

    Parameters
    ----------
    density : (PIXELS, PIXELS) array

    Returns
    -------
    (RASTER_PIXELS, RASTER_PIXELS) array
    """
    merged = PIXELS // RASTER_PIXELS
    blocks = density.reshape(RASTER_PIXELS, merged, RASTER_PIXELS, merged)
    means: FloatArray = blocks.mean(axis=(1, 3))
    return means


def build_open_square(name: str, values: FloatArray) -> Environment:
    """Build the map of an open square, in which robots start anywhere.

    Parameters
    ----------
    name : str
        Name of the map.
    values : (RASTER_PIXELS, RASTER_PIXELS) array
        Density by row (y) and column (x).

    Returns
    -------
    Environment
    """
    raster = Raster(values, extent=(0.0, 0.0, SIDE_M, SIDE_M), interpolation="cells")
    square = ((0.0, 0.0), (SIDE_M, 0.0), (SIDE_M, SIDE_M), (0.0, SIDE_M))
    return Environment(name, square, density=raster, starts={"anywhere": UniformStart()})


def build_world(seed: int) -> Environment:
    """Build the map of a world, with its density rounded.

    Parameters
    ----------
    seed : int
        Seed of the random numbers.

    Returns
    -------
    Environment
    """
    values = merge_pixels(compute_density(draw_peaks(seed))).round(_DENSITY_DIGITS)
    return build_open_square(f"worlds-{seed}", values)
