"""The probability that each unknown cell of an occupancy grid is free."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from robocov.compiled import kernel
from robocov.planning.discovered_map import FREE, UNKNOWN
from robocov.planning.raster import SIDE_STEPS
from robocov.typing import BoolArray, FloatArray

PRIOR_OPENNESS = 0.8
"""Openness of cells that are far from all known cells."""
WALK_LENGTH_BLOCKS = 30.0
"""Typical distance of a random walk from its start when it is cut off, in blocks."""
MAX_BLOCKS = 1000
"""Default of the maximum number of blocks into which a map is divided."""

_RELAXATION_FACTOR = 1.9
"""Overrelaxation factor with which walks of `WALK_LENGTH_BLOCKS` converge fastest."""
_MAX_ITERATIONS = 1000
"""Maximum number of iterations of the relaxation."""
_TOLERANCE = 1e-5
"""The relaxation ends when no openness changes by more than this in an iteration."""
_OUTSIDE = 255
"""State that marks cells outside the region."""


class _BlockGrid(NamedTuple):
    """Square blocks of cells, with the number of sides that their unknown cells share with other cells."""

    unknown_counts: FloatArray
    """(rows, columns) Number of unknown cells in each block."""
    free_side_counts: FloatArray
    """(rows, columns) Number of sides between unknown cells of each block and free cells."""
    wall_side_counts: FloatArray
    """(rows, columns) Number of sides between unknown cells of each block and walls."""
    link_counts_up: FloatArray
    """(rows + 1, columns + 1) Number of sides between unknown cells of a block and of the block above."""
    link_counts_right: FloatArray
    """(rows + 1, columns + 1) Number of sides between unknown cells of a block and of its right neighbor."""


def compute_openness(
    state: NDArray[np.uint8], is_outside: BoolArray, max_blocks: int = MAX_BLOCKS
) -> FloatArray:
    """Compute the probability that each unknown cell is free.

    Parameters
    ----------
    state : (rows, columns) uint8 array
        State of each cell; see `DiscoveredMap`.
    is_outside : (rows, columns) bool array
        Whether each cell is outside the region and therefore ignored.
    max_blocks : int
        Maximum number of square blocks of cells. Each block is one unknown of the equation.

    Returns
    -------
    (rows, columns) array
        From 0 to 1; 0 for all cells that are not unknown.

    Notes
    -----
    The openness u of an unknown cell is the probability that a random walk through unknown cells that starts
    there reaches a free cell before it reaches a wall:

        Laplace(u) = 0,   u = 1 at free cells,   u = 0 at walls,   no flow through the border of the region.

    The inside of an obstacle is surrounded by walls, so its openness is low. The shadow behind an obstacle
    borders on free cells, so its openness is high. The rock around a cave is connected to all other unknown
    cells, but its openness is low behind the walls. Very long walks are cut off and count as
    `PRIOR_OPENNESS`, the free fraction of a typical region: the best guess far from all known cells.

    Examples
    --------
    >>> state = np.array([[3, 3, 3, 3], [3, 0, 1, 1], [3, 3, 3, 3]], dtype=np.uint8)
    >>> compute_openness(state, np.zeros((3, 4), dtype=bool)).round(2)[1]
    array([0.  , 0.25, 0.  , 0.  ])
    """
    rows, columns = state.shape
    block_side = 1
    while _count_blocks(rows, block_side) * _count_blocks(columns, block_side) > max_blocks:
        block_side += 1
    cells = np.where(is_outside, _OUTSIDE, state).astype(np.uint8)
    blocks = _build_blocks(cells, block_side)
    block_openness = _solve_laplace(blocks, block_side)
    return _spread_to_cells(cells, block_openness, block_side)


@kernel
def _count_blocks(cell_count: int, block_side: int) -> int:
    """Return the number of blocks that a row or a column of cells is divided into, rounded up."""
    return (cell_count + block_side - 1) // block_side


@kernel
def _build_blocks(cells: NDArray[np.uint8], block_side: int) -> _BlockGrid:
    """Divide a grid of cells into square blocks, and count the sides between cells.

    Unknown cells of a block exchange flow with free cells, with walls, and with unknown cells of other
    blocks, in proportion to the number of sides that they share. `_OUTSIDE` marks the cells to ignore. Block
    (i, j) is in row i and column j.
    """
    rows, columns = cells.shape
    block_rows = _count_blocks(rows, block_side)
    block_columns = _count_blocks(columns, block_side)
    blocks = _BlockGrid(
        unknown_counts=np.zeros((block_rows, block_columns)),
        free_side_counts=np.zeros((block_rows, block_columns)),
        wall_side_counts=np.zeros((block_rows, block_columns)),
        link_counts_up=np.zeros((block_rows + 1, block_columns + 1)),
        link_counts_right=np.zeros((block_rows + 1, block_columns + 1)),
    )
    for i in range(block_rows):
        for j in range(block_columns):
            _count_sides(cells, block_side, i, j, blocks)
    return blocks


@kernel
def _count_sides(cells: NDArray[np.uint8], block_side: int, i: int, j: int, blocks: _BlockGrid) -> None:
    """Count the unknown cells of a block, and their sides, in the arrays of `blocks`."""
    rows, columns = cells.shape
    end_row = min((i + 1) * block_side, rows)
    end_column = min((j + 1) * block_side, columns)
    unknown_count = 0
    free_side_count = 0
    wall_side_count = 0
    link_count_up = 0
    link_count_right = 0
    for row in range(i * block_side, end_row):
        for column in range(j * block_side, end_column):
            if cells[row, column] != UNKNOWN:
                continue
            unknown_count += 1
            for up, right in SIDE_STEPS:
                neighbor_row = row + up
                neighbor_column = column + right
                if not (0 <= neighbor_row < rows and 0 <= neighbor_column < columns):
                    continue
                state = cells[neighbor_row, neighbor_column]
                if state == FREE:
                    free_side_count += 1
                elif state == UNKNOWN and neighbor_row == end_row:
                    link_count_up += 1
                elif state == UNKNOWN and neighbor_column == end_column:
                    link_count_right += 1
                elif state not in (UNKNOWN, _OUTSIDE):  # a wall or a presumed wall
                    wall_side_count += 1
    blocks.unknown_counts[i, j] = unknown_count
    blocks.free_side_counts[i, j] = free_side_count
    blocks.wall_side_counts[i, j] = wall_side_count
    blocks.link_counts_up[i, j] = link_count_up
    blocks.link_counts_right[i, j] = link_count_right


@kernel
def _solve_laplace(blocks: _BlockGrid, block_side: int) -> FloatArray:
    """Compute the openness u of blocks, (rows + 1, columns + 1), by successive overrelaxation.

    u is the probability that a random walk through unknown cells reaches a free cell before a wall. It solves
    Laplace's equation: the u of a block is the mean over its surroundings, weighted by conductances, where
    free cells have u = 1, walls have u = 0, and a small leak leads to `PRIOR_OPENNESS`, for walks that are
    cut off. The last row and the last column are padding without links; the index -1 also refers to them.
    """
    block_rows, block_columns = blocks.unknown_counts.shape
    up = blocks.link_counts_up
    right = blocks.link_counts_right
    u = np.full((block_rows + 1, block_columns + 1), PRIOR_OPENNESS)
    for _ in range(_MAX_ITERATIONS):
        max_step = 0.0
        for i in range(block_rows):
            for j in range(block_columns):
                if blocks.unknown_counts[i, j] == 0.0:
                    continue
                # The centers of two blocks are one side apart, but the border of a block is only half a side
                # from its center, so the flow across it is twice as large.
                leak = blocks.unknown_counts[i, j] / (block_side * WALK_LENGTH_BLOCKS**2)
                inflow = 2.0 * blocks.free_side_counts[i, j] + leak * PRIOR_OPENNESS
                conductance = 2.0 * (blocks.free_side_counts[i, j] + blocks.wall_side_counts[i, j]) + leak
                inflow += up[i, j] * u[i + 1, j] + up[i - 1, j] * u[i - 1, j]
                inflow += right[i, j] * u[i, j + 1] + right[i, j - 1] * u[i, j - 1]
                conductance += up[i, j] + up[i - 1, j] + right[i, j] + right[i, j - 1]
                step = _RELAXATION_FACTOR * (inflow / conductance - u[i, j])
                u[i, j] += step
                max_step = max(max_step, abs(step))
        if max_step < _TOLERANCE:
            break
    return u


@kernel
def _spread_to_cells(cells: NDArray[np.uint8], block_openness: FloatArray, block_side: int) -> FloatArray:
    """Return the openness of all cells: that of the block for unknown cells, and 0 for all other cells."""
    rows, columns = cells.shape
    openness = np.zeros((rows, columns))
    for row in range(rows):
        for column in range(columns):
            if cells[row, column] == UNKNOWN:
                value = block_openness[row // block_side, column // block_side]
                openness[row, column] = min(max(value, 0.0), 1.0)
    return openness
