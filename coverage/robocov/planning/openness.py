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

from typing import Any

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

BLOCKS = 1000
"""Blocks that a map is divided into, at most."""


def openness(state: NDArray[np.uint8], outside: BoolArray, blocks: int = BLOCKS) -> Array:
    """Return how open each unknown cell is, from 0 to 1; 0 for all other cells, (rows, columns).

    Parameters
    ----------
    state : (rows, columns)
        As in `DiscoveredMap`.
    outside : (rows, columns)
        Cells beyond the region; they do not count at all.
    blocks : int
        So many at most.

    Examples
    --------
    >>> state = np.array([[3, 3, 3, 3], [3, 0, 1, 1], [3, 3, 3, 3]], dtype=np.uint8)
    >>> openness(state, np.zeros((3, 4), dtype=bool)).round(2)[1]
    array([0.  , 0.25, 0.  , 0.  ])
    """
    rows, columns = state.shape
    side = 1
    while -(-rows // side) * -(-columns // side) > blocks:
        side += 1
    high, wide = -(-rows // side), -(-columns // side)
    missing = ((0, high * side - rows), (0, wide * side - columns))
    outside = np.pad(outside, missing, constant_values=True)
    whole = np.pad(state, missing)
    unknown = (whole == UNKNOWN) & ~outside
    open_to = _sums(_beside((whole == FREE) & ~outside) * unknown, side)
    closed_to = _sums(_beside((whole >= PRESUMED) & ~outside) * unknown, side)
    count = _sums(unknown, side)
    some = (count > 0).ravel()
    if not some.any():
        return np.zeros(state.shape)

    # how many cells of a block meet some of the next one
    above = _pairs(unknown, side)
    right = _pairs(unknown.T, side).T
    # the middles of two blocks are one side apart, and a block's border is half a side from its middle
    across, border = 1.0, 2.0
    lost = side * (count / side**2) / LONG**2
    diagonal = border * (open_to + closed_to) + lost
    diagonal[:-1] += across * above
    diagonal[1:] += across * above
    diagonal[:, :-1] += across * right
    diagonal[:, 1:] += across * right

    number = (np.cumsum(some) - 1).reshape(high, wide)
    begin = np.concatenate([number[:-1][above > 0], number[:, :-1][right > 0]])
    end = np.concatenate([number[1:][above > 0], number[:, 1:][right > 0]])
    flow = -across * np.concatenate([above[above > 0], right[right > 0]])
    own = np.arange(int(some.sum()))
    parts = np.concatenate([diagonal.ravel()[some], flow, flow])
    where = np.concatenate([own, begin, end]), np.concatenate([own, end, begin])
    matrix = coo_array((parts, where), shape=(len(own), len(own))).tocsc()
    # the matrix is symmetric
    factors = splu(matrix, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    result = np.zeros(high * wide)
    result[some] = factors.solve((border * open_to + lost * PRIOR).ravel()[some])
    of_cells = result.clip(0.0, 1.0).reshape(high, wide).repeat(side, axis=0).repeat(side, axis=1)
    return np.asarray((of_cells * unknown)[:rows, :columns])


def _beside(cells: BoolArray) -> NDArray[np.uint8]:
    """Return how many of the four cells beside each are some."""
    one = cells.astype(np.uint8)
    result = np.zeros_like(one)
    result[1:] += one[:-1]
    result[:-1] += one[1:]
    result[:, 1:] += one[:, :-1]
    result[:, :-1] += one[:, 1:]
    return result


def _sums(cells: NDArray[Any], side: int) -> Array:
    """Return the sum over each block."""
    rows, columns = cells.shape
    # rows are added as a whole first, which is much quicker than block by block
    strips = cells.reshape(rows // side, side, columns).sum(axis=1, dtype=np.int32)
    blocks = strips.reshape(rows // side, columns // side, side)
    return np.asarray(blocks.sum(axis=2).astype(np.float64))


def _pairs(cells: BoolArray, side: int) -> Array:
    """Return how many cells of each block meet some of the next one above."""
    meet = cells[side - 1 : -1 : side] & cells[side::side]
    return np.asarray(meet.reshape(len(meet), cells.shape[1] // side, side).sum(axis=2, dtype=np.float64))
