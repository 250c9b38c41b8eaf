"""How likely an unknown place is free: what is behind walls hardly is, what is open to free space is.

The openness u of an unknown cell is the chance that a random walk among unknown cells, which begins there,
comes to a free cell before it comes to a wall:

    Laplace(u) = 0,   u = 1 at free cells,   u = 0 at walls,   no flow through the border of the region.

The inside of an obstacle has only walls around it; what lies in the shadow of one is open to where the
shadow begins; the rock around a cave, though it is one patch with all that is unknown, is closed a few
cells behind its walls. Where walks are very long they end by themselves, in `PRIOR`: of what is far from
all that is known, nothing is known but how much of a usual region is free.

It is solved on blocks of cells: a block is one unknown, joined to its neighbours by as many cells as meet.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.linalg import splu

from robocov.arrays import Array, BoolArray
from robocov.planning.discovered import FREE, PRESUMED, UNKNOWN

PRIOR = 0.8
"""Openness of what is far from all that is known."""

LONG = 30.0
"""So many blocks away is far."""

_BLOCKS = 1000
"""Blocks that a map is divided into, at most."""


def openness(state: NDArray[np.uint8], outside: BoolArray) -> Array:
    """Return how open each unknown cell is, from 0 to 1; 0 for all other cells, (rows, columns).

    Parameters
    ----------
    state : (rows, columns)
        As in `DiscoveredMap`.
    outside : (rows, columns)
        Cells beyond the region; they do not count at all.

    Examples
    --------
    >>> state = np.array([[3, 3, 3, 3], [3, 0, 1, 1], [3, 3, 3, 3]], dtype=np.uint8)
    >>> openness(state, np.zeros((3, 4), dtype=bool)).round(2)[1]
    array([0.  , 0.25, 0.  , 0.  ])
    """
    rows, columns = state.shape
    side = 1
    while -(-rows // side) * -(-columns // side) > _BLOCKS:
        side += 1
    high, wide = -(-rows // side), -(-columns // side)
    block = (np.arange(rows) // side)[:, None] * wide + np.arange(columns) // side
    unknown = (state == UNKNOWN) & ~outside
    free, wall = (state == FREE) & ~outside, (state >= PRESUMED) & ~outside
    size = high * wide

    open_to, closed_to = np.zeros(size), np.zeros(size)
    begins, ends = [], []
    ahead, behind, every = slice(1, None), slice(None, -1), slice(None)
    for here, there in (((ahead, every), (behind, every)), ((every, ahead), (every, behind))):
        for one, other in ((here, there), (there, here)):
            open_to += np.bincount(block[one][unknown[one] & free[other]], minlength=size)
            closed_to += np.bincount(block[one][unknown[one] & wall[other]], minlength=size)
        meet = unknown[here] & unknown[there] & (block[here] != block[there])
        begins.append(block[here][meet])
        ends.append(block[there][meet])
    begin, end = np.concatenate(begins), np.concatenate(ends)
    # the middles of two blocks are one side apart, and a block's border is half a side from its middle
    across, border = 1.0, 2.0
    count = np.bincount(block[unknown], minlength=size)
    lost = side * (count / side**2) / LONG**2
    diagonal = border * (open_to + closed_to) + lost
    diagonal += across * (np.bincount(begin, minlength=size) + np.bincount(end, minlength=size))
    some = count > 0
    if not some.any():
        return np.zeros(state.shape)
    number = np.cumsum(some) - 1
    begin, end, own = number[begin], number[end], np.arange(int(some.sum()))
    flow = np.full(len(begin), -across)
    parts = np.concatenate([diagonal[some], flow, flow])
    where = np.concatenate([own, begin, end]), np.concatenate([own, end, begin])
    matrix = coo_array((parts, where), shape=(len(own), len(own))).tocsc()
    result = np.zeros(size)
    result[some] = splu(matrix).solve((border * open_to + lost * PRIOR)[some])
    return np.asarray(np.where(unknown, result[block].clip(0.0, 1.0), 0.0))
