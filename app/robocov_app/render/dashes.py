"""Dashed curves."""

from collections.abc import Sequence

import numpy as np

from robocov.typing import FloatArray


def cut_into_dashes(points: FloatArray, lengths: Sequence[float]) -> FloatArray:
    """Cut a curve into dashes and gaps along its length, and return the dashes.

    Parameters
    ----------
    points : (k, 2) array, px
        Points of the curve, at least two.
    lengths : sequence of float, px
        Lengths of dashes and gaps in turn; if empty, the curve is solid.

    Returns
    -------
    (m, 4) array, px
        Segments: x and y of one end, then of the other.

    Examples
    --------
    >>> cut_into_dashes(np.array([[0.0, 0.0], [10.0, 0.0]]), [4.0, 2.0]).tolist()
    [[0.0, 0.0, 4.0, 0.0], [6.0, 0.0, 10.0, 0.0]]
    """
    if not lengths:
        return np.hstack([points[:-1], points[1:]])
    steps = np.hypot(*np.diff(points, axis=0).T)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    period = float(sum(lengths))
    n_periods = int(along[-1] / period) + 1
    # Distances along the curve at which a dash or a gap ends.
    ends_in_period = np.cumsum(lengths)
    cuts = (np.arange(n_periods)[:, None] * period + ends_in_period).ravel()
    distances = np.unique(np.concatenate([along, cuts[cuts < along[-1]]]))
    x = np.interp(distances, along, points[:, 0])
    y = np.interp(distances, along, points[:, 1])
    middles = 0.5 * (distances[:-1] + distances[1:])
    parts = np.searchsorted(ends_in_period, middles % period, side="right")
    is_dash = parts % 2 == 0
    segments = np.column_stack([x[:-1], y[:-1], x[1:], y[1:]])
    return np.asarray(segments[is_dash])
