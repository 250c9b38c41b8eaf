"""Selection of the time steps of a record that are nearest to regular times."""

from __future__ import annotations

import numpy as np

from robocov.errors import ParameterError, is_number, quote
from robocov.typing import FloatArray, IntArray

TIME_ROUNDING_S = 5e-7
"""Maximum difference between times that is attributed to rounding: times are sums of control periods."""
_TIE_DECIMALS = 6
"""Number of decimals, in periods, of the midpoints between steps; further decimals are rounding errors."""


def require_rate(rate: float) -> None:
    """Raise a ParameterError unless a rate in Hz is a finite number of at least 0.

    Parameters
    ----------
    rate : float, Hz

    Raises
    ------
    ParameterError
        If the rate is negative or not finite.
    """
    if not is_number(rate) or not 0.0 <= rate < np.inf:
        raise ParameterError(f"rate: expected a finite number of at least 0 Hz, got {quote(rate)}")


def select_nearest_steps(time: FloatArray, rate: float) -> IntArray:
    """Select the time steps nearest to multiples of 1/rate, and the first and last ones.

    Parameters
    ----------
    time : (T,) array, s
        Times of the steps, ascending. Multiples of 1/rate are measured from the first time.
    rate : float, Hz
        Number of steps to select per second; 0 selects only the first and the last one.

    Returns
    -------
    (K,) int array
        Indices of the selected time steps, ascending. Of two steps that are equally near to a multiple, the
        earlier one is selected. If all intervals between steps are at least 1/rate, all steps are selected.

    Raises
    ------
    ParameterError
        If the rate is negative or not finite.

    Examples
    --------
    >>> select_nearest_steps(np.array([0.0, 0.4, 0.8, 1.2, 1.6, 2.0]), rate=1.0)
    array([0, 2, 5])
    """
    require_rate(rate)
    last = len(time) - 1
    min_step = float(np.diff(time).min(initial=np.inf))
    if min_step * rate >= 1.0:
        # All steps are selected, whatever the rounding of the midpoints.
        return np.arange(last + 1)
    periods = (time - time[0]) * rate
    midpoints = np.round((periods[:-1] + periods[1:]) / 2.0, _TIE_DECIMALS)
    # A step is nearest to every multiple between the midpoint before it (exclusive) and the midpoint after it
    # (inclusive). There is one if the last multiple up to the midpoint has increased.
    last_multiples = np.floor(midpoints)
    is_nearest = np.diff(last_multiples, prepend=-1.0) > 0.0
    return np.union1d(np.flatnonzero(is_nearest), [0, last])
