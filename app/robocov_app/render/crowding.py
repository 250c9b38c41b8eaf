"""Sizes of marks and lines that become smaller in a crowd."""

from typing import Any

import numpy as np
from scipy.spatial import KDTree

from robocov.typing import FloatArray
from robocov_app.render.camera import Camera

MAX_MARKED_ROBOTS = 100
"""If more robots are in view, their numbers, starts and centroids would only be clutter."""
_MAX_POINTS_WITHOUT_TREE = 120
"""With at most this many points, comparing all pairs is faster than building a tree."""
_MAX_SAMPLED_POINTS = 250
"""Approximate maximum number of points whose distances decide on the size of marks."""
_MAX_LINES_AT_FULL_WIDTH = 20
_MIN_WIDTH_FACTOR = 0.5


def compute_nearest_distances(points: FloatArray, sample_step: int = 1) -> FloatArray:
    """Return the distance of each point to the nearest other one.

    Parameters
    ----------
    points : (n, 2) array
    sample_step : int
        Evaluate only every `sample_step`-th point, if there are more than `_MAX_POINTS_WITHOUT_TREE`.

    Returns
    -------
    (m,) array
        In the unit of the points; inf for a single point.
    """
    if len(points) < 2:
        return np.full(len(points), np.inf)
    if len(points) <= _MAX_POINTS_WITHOUT_TREE:
        delta = points[:, None] - points[None]
        squares = np.asarray(delta[..., 0] ** 2 + delta[..., 1] ** 2)
        np.fill_diagonal(squares, np.inf)
        return np.asarray(np.sqrt(squares.min(axis=1)))
    # The nearest point in the tree is the point itself, so the second nearest one is queried.
    distances, _ = KDTree(points).query(points[::sample_step], k=[2])
    return np.asarray(distances).ravel()


def fit_radii(centers: FloatArray, true_radii: FloatArray, low: float, high: float) -> FloatArray:
    """Choose the radii of discs so that they are well visible and do not overlap.

    Each disc reaches halfway to its nearest neighbor, within the limits.

    Parameters
    ----------
    centers : (n, 2) array
    true_radii : (n,) array
        Discs are never smaller than this, even if they overlap.
    low, high : float
        Limits of the radii, unless the true radius is larger.

    Returns
    -------
    (n,) array
    """
    half_distances = compute_nearest_distances(centers) / 2
    return np.asarray(np.maximum(true_radii, np.clip(half_distances, low, high)))


def fit_mark_size(points: FloatArray, low: float, high: float) -> float:
    """Choose one size for all marks, such that about half of them do not overlap.

    The size is the median distance to the nearest other mark, within limits.

    Parameters
    ----------
    points : (n, 2) array
    low, high : float
        Minimum and maximum size.

    Returns
    -------
    float
    """
    if not len(points):
        return high
    sample_step = 1 + len(points) // _MAX_SAMPLED_POINTS
    distances = compute_nearest_distances(points, sample_step)
    return float(np.clip(np.median(distances), low, high))


def measure_spacing(points: FloatArray) -> float:
    """Return the median distance of points to their nearest neighbors; inf for fewer than two points."""
    return fit_mark_size(points, 0.0, np.inf)


def select_spaced_rows(points: FloatArray, spacing: float) -> list[int]:
    """Select points, in their order, that are at least `spacing` from all selected ones.

    Parameters
    ----------
    points : (n, 2) array
    spacing : float
        In the unit of the points.

    Returns
    -------
    list of int
        Rows of the selected points.

    Examples
    --------
    >>> select_spaced_rows(np.array([[0.0, 0.0], [1.0, 0.0], [3.0, 0.0]]), 2.0)
    [0, 2]
    """
    selected: list[int] = []
    for row, point in enumerate(points):
        distances = np.hypot(*(points[selected] - point).T)
        if (distances >= spacing).all():
            selected.append(row)
    return selected


def is_crowd(positions: FloatArray, camera: Camera) -> bool:
    """Return whether more robots are in view than can be marked one by one.

    Parameters
    ----------
    positions : (n, 2) array, m
        Positions of all robots.
    camera : Camera
        Zooming in reduces the number of robots in view.

    Returns
    -------
    bool
    """
    if len(positions) <= MAX_MARKED_ROBOTS:
        return False
    low_x, low_y, high_x, high_y = camera.compute_visible_bounds()
    x, y = positions.T
    is_visible = (low_x <= x) & (x <= high_x) & (low_y <= y) & (y <= high_y)
    return bool(np.count_nonzero(is_visible) > MAX_MARKED_ROBOTS)


def choose_width_factor(n_lines: int) -> float:
    """Return the factor for the width of lines: from 1 for a few lines down to 0.5 for many."""
    factor = np.sqrt(_MAX_LINES_AT_FULL_WIDTH / max(n_lines, 1))
    return float(np.clip(factor, _MIN_WIDTH_FACTOR, 1.0))


def round_to_half(sizes: Any) -> Any:
    """Round sizes, px, to halves of a pixel, so that few different marks have to be rendered."""
    return np.round(sizes * 2) / 2
