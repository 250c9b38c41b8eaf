"""Sizes of marks in a crowd, and panels on a page."""

import numpy as np
from scipy.spatial import KDTree

from robocov.arrays import Array

_FEW = 120  # up to so many points all pairs are looked at faster than a tree is built


def nearest_distance(points: Array, step: int = 1) -> Array:
    """Return how far each of (n, 2) points is from the nearest other; of many, only each `step`-th."""
    if len(points) < 2:
        return np.full(len(points), np.inf)
    if len(points) <= _FEW:
        delta = points[:, None] - points[None]
        square = np.asarray(delta[..., 0] ** 2 + delta[..., 1] ** 2)
        np.fill_diagonal(square, np.inf)
        return np.asarray(np.sqrt(square.min(axis=1)))
    return np.asarray(KDTree(points).query(points[::step], k=[2])[0]).ravel()


def fitted_radii(centers: Array, true: Array, least: float, most: float) -> Array:
    """Return radii, (n,), for discs: `most`, but in a crowd half of the way to the nearest neighbor.

    They are not below the `true` radii, (n,), nor below `least`.
    """
    return np.asarray(np.maximum(true, np.clip(nearest_distance(centers) / 2, least, most)))


def mark_size(points: Array, least: float, most: float) -> float:
    """Return one size for marks at (n, 2) points: `most`, but what keeps about half apart in a crowd."""
    near = nearest_distance(points, 1 + len(points) // 250)
    return float(np.clip(np.median(near), least, most)) if len(points) else most


def line_crowding(count: int) -> float:
    """Return by what the width of lines is multiplied where `count` of them are drawn: 1 to 0.5."""
    return float(np.clip(np.sqrt(20 / max(count, 1)), 0.5, 1.0))


def columns_for(
    count: int, aspect: float, size: tuple[float, float], around: float = 0.0, beside: float = 0.0
) -> int:
    """Return the columns that let `count` panels of one aspect be largest; rows need `around` px besides."""

    def worth(columns: int) -> float:
        rows = -(-count // columns)
        width = min(size[0] / columns - beside, (size[1] / rows - around) * aspect)
        return width * count / (rows * columns)  # a gap in the last row looks like something missing

    return max(range(1, count + 1), key=lambda columns: (round(worth(columns), 6), columns))
