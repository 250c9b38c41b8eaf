"""Selection of time steps of a record at a rate."""

from __future__ import annotations

import numpy as np

from robocov.arrays import Array, IntArray

TIME_ROUNDING_S = 5e-7
"""Difference between times that is attributed to rounding: times are sums of control periods."""
_TIE_DECIMALS = 6
"""Distances are compared to this number of decimals of a period; the rest is rounding error."""


def select_nearest_steps(time: Array, rate: float) -> IntArray:
    """Select the time steps nearest to multiples of 1/rate, and the first and last ones.

    Parameters
    ----------
    time : (T,) array, s
        Ascending.
    rate : float, Hz
        0 selects only the first and the last time step.

    Returns
    -------
    (K,) int array
        Indices of the time steps, ascending. Of two that are equally near, the earlier one is selected.

    Examples
    --------
    >>> select_nearest_steps(np.array([0.0, 0.4, 0.8, 1.2, 1.6, 2.0]), rate=1.0)
    array([0, 2, 5])
    """
    last = len(time) - 1
    min_step = float(np.diff(time).min(initial=np.inf))
    if min_step * rate >= 1.0:
        return np.arange(last + 1)
    # Sort the steps by their nearest multiple of the period, and by their distance from it. The first step of
    # each multiple is then the nearest one.
    periods = (time - time[0]) * rate
    nearest_multiple = np.rint(periods)
    deviation = np.round(np.abs(periods - nearest_multiple), _TIE_DECIMALS)
    order = np.lexsort([deviation, nearest_multiple])
    is_first_of_multiple = np.diff(nearest_multiple[order], prepend=-1.0) > 0.0
    nearest = order[np.flatnonzero(is_first_of_multiple)]
    return np.union1d(nearest, [0, last])
