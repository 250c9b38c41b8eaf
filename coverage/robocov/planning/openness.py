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

from robocov.arrays import Array, BoolArray
from robocov.compiled import kernel
from robocov.planning.discovered import FREE, UNKNOWN

PRIOR = 0.8
"""Openness of what is far from all that is known."""

LONG = 30.0
"""So many blocks away is far."""

BLOCKS = 1000
"""Blocks that a map is divided into, at most."""

_OVER = 1.9  # relaxation factor; the best for walks that end after `LONG` blocks
_SWEEPS, _EXACT = 1000, 1e-11


def openness(state: NDArray[np.uint8], outside: BoolArray, blocks: int = BLOCKS) -> Array:
    """Return how open each unknown cell is, from 0 to 1; 0 for all other cells, (rows, columns).

    The state is that of a `DiscoveredMap`; cells `outside` of the region do not count at all. There are
    `blocks` at most.

    >>> state = np.array([[3, 3, 3, 3], [3, 0, 1, 1], [3, 3, 3, 3]], dtype=np.uint8)
    >>> openness(state, np.zeros((3, 4), dtype=bool)).round(2)[1]
    array([0.  , 0.25, 0.  , 0.  ])
    """
    rows, columns = state.shape
    side = 1
    while -(-rows // side) * -(-columns // side) > blocks:
        side += 1
    return _relaxed(np.where(outside, 255, state).astype(np.uint8), side)


@kernel
def _relaxed(state: NDArray[np.uint8], side: int) -> Array:
    """Solve Laplace's equation on blocks by successive over-relaxation; 255 marks cells that do not count."""
    rows, columns = state.shape
    high, wide = -(-rows // side), -(-columns // side)
    # of each block: unknown cells, those beside that are free, walls, or unknown in the next blocks
    count, open_to, closed_to = np.zeros((high, wide)), np.zeros((high, wide)), np.zeros((high, wide))
    above, right = np.zeros((high + 1, wide + 1)), np.zeros((high + 1, wide + 1))
    for r in range(rows):
        for c in range(columns):
            if state[r, c] != UNKNOWN:
                continue
            i, j = r // side, c // side
            count[i, j] += 1.0
            for a, b in ((r + 1, c), (r, c + 1), (r - 1, c), (r, c - 1)):
                if not (0 <= a < rows and 0 <= b < columns) or state[a, b] == 255:
                    continue
                if state[a, b] == FREE:
                    open_to[i, j] += 1.0
                elif state[a, b] != UNKNOWN:
                    closed_to[i, j] += 1.0
                elif a // side > i:
                    above[i, j] += 1.0
                elif b // side > j:
                    right[i, j] += 1.0
    u = np.full((high + 1, wide + 1), PRIOR)
    for _ in range(_SWEEPS):
        change = 0.0
        for i in range(high):
            for j in range(wide):
                if count[i, j] == 0.0:
                    continue
                # the middles of two blocks are one side apart, a block's border is half a side from its own
                lost = count[i, j] / (side * LONG**2)
                flow = 2.0 * open_to[i, j] + lost * PRIOR
                links = 2.0 * (open_to[i, j] + closed_to[i, j]) + lost
                # row and column -1 are the spare ones, without links
                flow += above[i, j] * u[i + 1, j] + above[i - 1, j] * u[i - 1, j]
                flow += right[i, j] * u[i, j + 1] + right[i, j - 1] * u[i, j - 1]
                links += above[i, j] + above[i - 1, j] + right[i, j] + right[i, j - 1]
                step = _OVER * (flow / links - u[i, j])
                u[i, j] += step
                change = max(change, abs(step))
        if change < _EXACT:
            break
    result = np.zeros((rows, columns))
    for r in range(rows):
        for c in range(columns):
            if state[r, c] == UNKNOWN:
                result[r, c] = min(max(u[r // side, c // side], 0.0), 1.0)
    return result
