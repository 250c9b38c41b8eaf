"""The probability that each unknown cell of an occupancy grid is free."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from robocov.arrays import Array, BoolArray
from robocov.compiled import kernel
from robocov.planning.discovered_map import FREE, UNKNOWN

PRIOR_OPENNESS = 0.8
"""Openness of cells that are far from everything known."""
WALK_LENGTH_BLOCKS = 30.0
"""Distance that a random walk gets from where it began before it usually ends by itself."""
MAX_BLOCKS = 1000
"""Number of blocks that a map is divided into."""

_RELAXATION_FACTOR = 1.9  # the best one for walks of that length
_MAX_ITERATIONS = 1000
_TOLERANCE = 1e-5
_OUTSIDE = 255
"""State of cells outside the region."""


class _BlockGrid(NamedTuple):
    """Square blocks of cells, and the number of sides of cells that they share with their neighbours."""

    unknown_cells: Array
    """(rows, columns) Number of unknown cells in each block."""
    free_sides: Array
    """(rows, columns) Sides between its unknown cells and free ones."""
    wall_sides: Array
    """(rows, columns) Sides between its unknown cells and walls."""
    links_up: Array
    """(rows + 1, columns + 1) Sides between its unknown cells and those of the block above."""
    links_right: Array
    """(rows + 1, columns + 1) The same with the block to the right."""


def compute_openness(state: NDArray[np.uint8], is_outside: BoolArray, max_blocks: int = MAX_BLOCKS) -> Array:
    """Compute how likely each unknown cell is free.

    Parameters
    ----------
    state : (rows, columns) uint8 array
        That of a `DiscoveredMap`.
    is_outside : (rows, columns) bool array
        Cells outside the region, which do not count at all.
    max_blocks : int
        Maximum number of square blocks of cells; each is one unknown of the equation.

    Returns
    -------
    (rows, columns) array
        From 0 to 1; 0 for all cells that are not unknown.

    Notes
    -----
    The openness u of an unknown cell is the probability that a random walk among unknown cells that begins
    there comes to a free cell before it comes to a wall:

        Laplace(u) = 0,   u = 1 at free cells,   u = 0 at walls,   no flow through the border of the region.

    The inside of an obstacle has only walls around it; cells in the shadow of an obstacle are open to where
    the shadow begins; the rock around a cave, though connected with everything unknown, is closed a few cells
    behind its walls. Very long walks end by themselves with the value `PRIOR_OPENNESS`: far from everything
    known, all that is known is the free fraction of a usual region.

    Examples
    --------
    >>> state = np.array([[3, 3, 3, 3], [3, 0, 1, 1], [3, 3, 3, 3]], dtype=np.uint8)
    >>> compute_openness(state, np.zeros((3, 4), dtype=bool)).round(2)[1]
    array([0.  , 0.25, 0.  , 0.  ])
    """
    rows, columns = state.shape
    block_side = 1
    while -(-rows // block_side) * -(-columns // block_side) > max_blocks:
        block_side += 1
    cells = np.where(is_outside, _OUTSIDE, state).astype(np.uint8)
    blocks = _build_blocks(cells, block_side)
    block_openness = _solve_laplace(blocks, block_side)
    return _spread_to_cells(cells, block_openness, block_side)


@kernel
def _build_blocks(cells: NDArray[np.uint8], block_side: int) -> _BlockGrid:
    """Build the blocks of a grid, in which `_OUTSIDE` marks cells that do not count."""
    rows, columns = cells.shape
    block_rows = -(-rows // block_side)
    block_columns = -(-columns // block_side)
    blocks = _BlockGrid(
        np.zeros((block_rows, block_columns)),
        np.zeros((block_rows, block_columns)),
        np.zeros((block_rows, block_columns)),
        np.zeros((block_rows + 1, block_columns + 1)),
        np.zeros((block_rows + 1, block_columns + 1)),
    )
    for row in range(rows):
        i = row // block_side
        for column in range(columns):
            j = column // block_side
            state = cells[row, column]
            if state == UNKNOWN:
                blocks.unknown_cells[i, j] += 1.0
            if row + 1 < rows:
                a = (row + 1) // block_side
                if state == UNKNOWN and cells[row + 1, column] == UNKNOWN and a > i:
                    blocks.links_up[i, j] += 1.0
                _count_side(state, cells[row + 1, column], i, j, blocks)
                _count_side(cells[row + 1, column], state, a, j, blocks)
            if column + 1 < columns:
                b = (column + 1) // block_side
                if state == UNKNOWN and cells[row, column + 1] == UNKNOWN and b > j:
                    blocks.links_right[i, j] += 1.0
                _count_side(state, cells[row, column + 1], i, j, blocks)
                _count_side(cells[row, column + 1], state, i, b, blocks)
    return blocks


@kernel
def _count_side(state: int, neighbour_state: int, i: int, j: int, blocks: _BlockGrid) -> None:
    """Count the side between a cell in block (i, j) and a neighbour, if only the cell is unknown."""
    if state == UNKNOWN and neighbour_state != UNKNOWN and neighbour_state != _OUTSIDE:
        if neighbour_state == FREE:
            blocks.free_sides[i, j] += 1.0
        else:
            blocks.wall_sides[i, j] += 1.0


@kernel
def _solve_laplace(blocks: _BlockGrid, block_side: int) -> Array:
    """Compute the openness of blocks, (rows + 1, columns + 1), by successive over-relaxation.

    The last row and the last column are spare ones without links, which index -1 leads to as well.
    """
    block_rows, block_columns = blocks.unknown_cells.shape
    up = blocks.links_up
    right = blocks.links_right
    u = np.full((block_rows + 1, block_columns + 1), PRIOR_OPENNESS)
    for _ in range(_MAX_ITERATIONS):
        max_step = 0.0
        for i in range(block_rows):
            for j in range(block_columns):
                if blocks.unknown_cells[i, j] == 0.0:
                    continue
                # Centres of two blocks are one side apart; its own border is half a side from a centre.
                ended = blocks.unknown_cells[i, j] / (block_side * WALK_LENGTH_BLOCKS**2)
                flow = 2.0 * blocks.free_sides[i, j] + ended * PRIOR_OPENNESS
                links = 2.0 * (blocks.free_sides[i, j] + blocks.wall_sides[i, j]) + ended
                flow += up[i, j] * u[i + 1, j] + up[i - 1, j] * u[i - 1, j]
                flow += right[i, j] * u[i, j + 1] + right[i, j - 1] * u[i, j - 1]
                links += up[i, j] + up[i - 1, j] + right[i, j] + right[i, j - 1]
                step = _RELAXATION_FACTOR * (flow / links - u[i, j])
                u[i, j] += step
                max_step = max(max_step, abs(step))
        if max_step < _TOLERANCE:
            break
    return u


@kernel
def _spread_to_cells(cells: NDArray[np.uint8], block_openness: Array, block_side: int) -> Array:
    """Give each unknown cell the openness of its block, and 0 to all others."""
    rows, columns = cells.shape
    openness = np.zeros((rows, columns))
    for row in range(rows):
        for column in range(columns):
            if cells[row, column] == UNKNOWN:
                value = block_openness[row // block_side, column // block_side]
                openness[row, column] = min(max(value, 0.0), 1.0)
    return openness
