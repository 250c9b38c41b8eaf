"""The density in colors and in words, and the words for costs that it weighs."""

from collections.abc import Iterator
from functools import lru_cache
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from robocov.arrays import Array
from robocov.density import Density, Gaussians
from robocov.environment import Environment
from robocov_app.look.theme import Theme

_SAMPLES = 96  # places along the longer side of a map at which the density is looked at for its range
Bounds: TypeAlias = tuple[float, float, float, float]  # smallest x and y, largest x and y in meters


def shading(environment: Environment, most: int, theme: Theme) -> NDArray[np.uint8]:
    """Return RGBA of the region's box, (h, w, 4), lowest row first; `most` dots are along its longer side."""
    assert environment.density is not None
    x, y = dots(environment, most)
    return colors(parts(environment.density, environment.region.bounds, x, y), theme)


def dots(environment: Environment, most: int) -> tuple[Array, Array]:
    """Return x and y, ascending, of even places over the region's box, `most` along the longer side."""
    low_x, low_y, high_x, high_y = environment.region.bounds
    step = max(high_x - low_x, high_y - low_y) / most
    axes = []
    for low, high in ((low_x, high_x), (low_y, high_y)):
        count = max(round((high - low) / step), 1)
        axes.append(low + (np.arange(count) + 0.5) * (high - low) / count)
    return axes[0], axes[1]


def parts(density: Density, bounds: Bounds, x: Array, y: Array) -> Array:
    """Return how far the density at (w,) x and (h,) y, m, is from the least to the most, (h, w), 0 to 1."""
    low, high = value_range(density, bounds)
    value = density.evaluate(_grid(x, y)).reshape(len(y), len(x))
    return np.clip((value - low) / (high - low), 0.0, 1.0) if high > low else np.zeros_like(value)


def colors(way: Array, theme: Theme) -> NDArray[np.uint8]:
    """Return the colors, RGBA (..., 4), of parts of the way from the least density to the most."""
    picture = np.empty((*way.shape, 4), dtype=np.uint8)
    picture[..., :3] = theme.density
    picture[..., 3] = np.rint(255.0 * theme.density_strength * way)
    return picture


def density_range(environment: Environment) -> tuple[float, float]:
    density, bounds = environment.density, environment.region.bounds
    return (1.0, 1.0) if density is None else value_range(density, bounds)


@lru_cache(maxsize=16)
def value_range(density: Density, bounds: Bounds) -> tuple[float, float]:
    low, high = np.array(bounds[:2]), np.array(bounds[2:])
    step = (high - low).max() / _SAMPLES
    x, y = (np.arange(first + 0.5 * step, last, step) for first, last in zip(low, high, strict=True))
    points = _grid(x, y)
    if isinstance(density, Gaussians):  # between samples a narrow one is missed
        centers = np.array([peak.center for peak in density.peaks]).reshape(-1, 2)
        points = np.concatenate([points, centers[((low <= centers) & (centers <= high)).all(axis=1)]])
    value = density.evaluate(points)
    return float(value.min()), float(value.max())


def _grid(x: Array, y: Array) -> Array:
    return np.column_stack([np.tile(x, len(y)), np.repeat(y, len(x))])


def density_label(environment: Environment) -> str:
    density = environment.density
    return "" if density is None or density.is_uniform else range_label(density_range(environment))


def range_label(span: tuple[float, float]) -> str:
    return "density φ, {:.3g} to {:.3g}".format(*span)


def mean_label(environment: Environment) -> str:
    return "mean distance by φ" if density_label(environment) else "mean distance"


def cost_label(what: str, mean_distance: float, mean_time: float | None = None) -> str:
    """Return a mean distance, m, in words, and the mean time until the first robot comes, s, if there is one.

    What is not finite is left out: a team of which no robot works covers nothing.
    """
    told = (what, mean_distance, "m"), ("mean time", mean_time, "s")
    known = (each for each in told if each[1] is not None and np.isfinite(each[1]))
    return ", ".join(f"{words} {value:.3f} {unit}" for words, value, unit in known)


def density_kind(environment: Environment) -> str | None:
    return None if environment.density is None else environment.density.kind


def density_lines(environment: Environment) -> Iterator[str]:
    """Yield the line that says by what the figures above it are weighed; none where nothing weighs them."""
    if environment.density is not None and not environment.density.is_uniform:
        low, high = density_range(environment)
        yield f"weighed by φ    {environment.density.kind}, {low:.3g} to {high:.3g}"
