"""Which moments stay when a record is thinned, or are looked at now and then."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from robocov.arrays import Array, IntArray


def nearest_moments(time: Array, rate: float) -> IntArray:
    """Return the numbers of the moments that are nearest to multiples of 1/rate seconds from the first.

    Parameters
    ----------
    time : (T,) s
        Ascending.
    rate : float, Hz

    Returns
    -------
    (m,) int
        Ascending, with the first and the last.

    Examples
    --------
    >>> nearest_moments(np.arange(8) * 0.1, rate=4.0).tolist()
    [0, 2, 5, 7]
    """
    last = len(time) - 1
    if float(np.diff(time).min(initial=np.inf)) * rate >= 1.0:
        return np.arange(last + 1)
    turns = (time - time[0]) * rate
    nearest = np.rint(turns)
    # sums of steps are rounded: what is a millionth of a turn nearer is as near
    order = np.lexsort([np.round(np.abs(turns - nearest), 6), nearest])
    first_of_each = np.flatnonzero(np.diff(nearest[order], prepend=-1.0))
    return np.union1d(order[first_of_each], [0, last])
