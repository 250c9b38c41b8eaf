"""The density as colors: the higher the density, the more opaque the color."""

from functools import lru_cache
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from robocov.density import Density, Gaussians
from robocov.environment import Environment
from robocov.typing import FloatArray
from robocov_app.look.theme import Theme

_RANGE_SAMPLES = 96
"""Number of samples along the longer side of a map for the range of a density."""
Bounds: TypeAlias = tuple[float, float, float, float]
"""Low x, low y, high x and high y, m."""


def shade_density(environment: Environment, n_samples: int, theme: Theme) -> NDArray[np.uint8]:
    """Return the colors of the density over the bounds of the region.

    Parameters
    ----------
    environment : Environment
        With a density.
    n_samples : int
        Number of samples along the longer side.
    theme : Theme

    Returns
    -------
    (h, w, 4) array of uint8
        RGBA values, the lowest row first.
    """
    assert environment.density is not None
    x, y = list_sample_coordinates(environment, n_samples)
    fractions = compute_density_fractions(environment.density, environment.region.bounds, x, y)
    return color_density(fractions, theme)


def list_sample_coordinates(environment: Environment, n_samples: int) -> tuple[FloatArray, FloatArray]:
    """Return the coordinates of equally spaced samples over the bounds of the region.

    Parameters
    ----------
    environment : Environment
    n_samples : int
        Number of samples along the longer side.

    Returns
    -------
    x : (w,) array, m
        Ascending.
    y : (h,) array, m
        Ascending.
    """
    low_x, low_y, high_x, high_y = environment.region.bounds
    step = max(high_x - low_x, high_y - low_y) / n_samples
    return _divide_evenly(low_x, high_x, step), _divide_evenly(low_y, high_y, step)


def _divide_evenly(low: float, high: float, step: float) -> FloatArray:
    """Return the middles of equal intervals that are about one step long."""
    count = max(round((high - low) / step), 1)
    return low + (np.arange(count) + 0.5) * (high - low) / count


def compute_density_fractions(density: Density, bounds: Bounds, x: FloatArray, y: FloatArray) -> FloatArray:
    """Return the density at a grid of points, scaled to its range.

    Parameters
    ----------
    density : Density
    bounds : Bounds
        Area in which the range of the density is measured.
    x : (w,) array, m
    y : (h,) array, m

    Returns
    -------
    (h, w) array
        From 0 for the lowest density to 1 for the highest; 0 everywhere if the density is constant.
    """
    low, high = compute_density_range(density, bounds)
    values = density.evaluate(_build_grid(x, y)).reshape(len(y), len(x))
    if high <= low:
        return np.zeros_like(values)
    return np.asarray(np.clip((values - low) / (high - low), 0.0, 1.0))


def color_density(fractions: FloatArray, theme: Theme) -> NDArray[np.uint8]:
    """Convert scaled densities to colors, all of one hue, from transparent to opaque.

    Parameters
    ----------
    fractions : (...) array
        From 0 for the lowest density to 1 for the highest.
    theme : Theme

    Returns
    -------
    (..., 4) array of uint8
        RGBA values.
    """
    colors = np.empty((*fractions.shape, 4), dtype=np.uint8)
    colors[..., :3] = theme.density
    colors[..., 3] = np.rint(255.0 * theme.density_strength * fractions)
    return colors


def get_density_range(environment: Environment) -> tuple[float, float]:
    """Return the lowest and the highest density of an environment; both are 1 if it has no density."""
    if environment.density is None:
        return 1.0, 1.0
    return compute_density_range(environment.density, environment.region.bounds)


@lru_cache(maxsize=16)
def compute_density_range(density: Density, bounds: Bounds) -> tuple[float, float]:
    """Return the lowest and the highest density of a grid of samples within bounds."""
    low = np.array(bounds[:2])
    high = np.array(bounds[2:])
    step = (high - low).max() / _RANGE_SAMPLES
    x = _divide_evenly(low[0], high[0], step)
    y = _divide_evenly(low[1], high[1], step)
    points = _build_grid(x, y)
    if isinstance(density, Gaussians):
        # The grid may miss a narrow peak, so the centers of peaks are samples as well.
        centers = np.array([peak.center for peak in density.peaks]).reshape(-1, 2)
        is_inside = ((low <= centers) & (centers <= high)).all(axis=1)
        points = np.concatenate([points, centers[is_inside]])
    values = density.evaluate(points)
    return float(values.min()), float(values.max())


def _build_grid(x: FloatArray, y: FloatArray) -> FloatArray:
    """Return all pairs of coordinates, (h * w, 2) m, row by row."""
    return np.column_stack([np.tile(x, len(y)), np.repeat(y, len(x))])
