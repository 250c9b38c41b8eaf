"""Connections through passages that the moves of a coarse lattice miss.

The moves of a lattice are straight lines between nodes. In a large window the nodes are far apart, and there
may be no such line through a narrow door. The lattice then consists of separate pieces, although the free
cells are connected. *Portals* connect these pieces: they are the shortest paths from cell to cell between
nodes of different pieces. They lead only through cells that are known to be free, because a wall that has
been seen only in part seems to have narrow holes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import ndimage
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from robocov.compiled import kernel
from robocov.planning.lattice import Edges
from robocov.planning.raster import SIDE_STEPS
from robocov.typing import BoolArray, FloatArray, IntArray

_CORNER_STEPS = ((1, 1), (1, -1), (-1, 1), (-1, -1))
"""Steps, in rows and columns, to the four neighbors of a cell that share only a corner with it."""
_NEIGHBOR_STEPS = np.array((*SIDE_STEPS, *_CORNER_STEPS))
"""Steps to the eight neighbors of a cell: first those that share a side, then those at the corners."""
_SIDE_COUNT = len(SIDE_STEPS)
"""Number of neighbors that share a side."""
_SIDE_COST = 5
"""Cost of a step to a neighbor that shares a side."""
_CORNER_COST = 7
"""Cost of a step to a neighbor at a corner: 7 / 5 is close to √2, and not above it."""
_NONE = -1
"""Index that stands for no cell, or no node."""


class Portals(NamedTuple):
    """Paths between nodes of different pieces of a lattice."""

    first_nodes: IntArray
    """(p,) The node at the start of each path."""
    last_nodes: IntArray
    """(p,) The node at the end of each path."""
    lengths: FloatArray
    """(p,) Length of each path, in sides of a cell."""
    paths: list[IntArray]
    """Rows and columns, in the window, of the cells on each path between its two nodes, (k, 2)."""


class _ShortestPaths(NamedTuple):
    """The shortest path to each cell from the nearest of several nodes."""

    nodes: IntArray
    """(h, w) Index of the nearest node; `_NONE` for cells to which no path leads."""
    costs: IntArray
    """(h, w) Sum of the costs of the steps on the path."""
    previous_cells: IntArray
    """(h, w) Flat index of the cell before, on the path; `_NONE` for the cells of the nodes themselves."""


def find_portals(is_passable: BoolArray, node_cells: IntArray, graph: csr_array) -> Portals:
    """Find the portals between the pieces of a lattice.

    Parameters
    ----------
    is_passable : (h, w) bool array
        Whether each cell is known to be free, and not near a wall.
    node_cells : (m, 2) int array
        Row and column of the cell in which each node lies.
    graph : (m, m) csr_array
        The moves of the lattice.

    Returns
    -------
    Portals
        For each pair of nodes of different pieces, the shortest path between them, if some cell nearest to
        one of the nodes adjoins a cell nearest to the other. There are no portals if the lattice connects all
        nodes that the cells connect.
    """
    rows, columns = node_cells.T
    # Pieces are connected in both directions: no move leads on from a node without clearance.
    _, labels = connected_components(graph, directed=True, connection="strong")
    pieces = np.asarray(labels, dtype=np.intp)
    areas, _ = ndimage.label(is_passable)
    nodes = np.flatnonzero(is_passable[rows, columns])
    node_areas = areas[rows, columns][nodes]
    pairs = np.unique(np.column_stack([node_areas, pieces[nodes]]), axis=0)
    if len(pairs) == len(np.unique(node_areas)):
        # All nodes in the same connected area of cells belong to the same piece.
        return Portals(nodes[:0], nodes[:0], np.empty(0), [])
    shortest = _find_shortest_paths(is_passable, node_cells, nodes)
    first_cells, last_cells = _find_meeting_cells(shortest, pieces)
    costs = shortest.costs.ravel()
    return Portals(
        first_nodes=shortest.nodes.ravel()[first_cells],
        last_nodes=shortest.nodes.ravel()[last_cells],
        lengths=(costs[first_cells] + costs[last_cells] + _SIDE_COST) / _SIDE_COST,
        paths=[
            _trace_path(shortest, first, last)
            for first, last in zip(first_cells.tolist(), last_cells.tolist(), strict=True)
        ],
    )


@kernel
def _find_shortest_paths(
    is_passable: BoolArray, node_cells: IntArray, source_nodes: IntArray
) -> _ShortestPaths:
    """Find the shortest path to each cell from the nearest source node, by Dijkstra's algorithm.

    The search starts from all source nodes at once. Costs are integers, so that equal ones are exactly equal,
    and the front is a bucket of cells for each cost (Dial's algorithm). The costs in the front differ by at
    most that of a step, so `_CORNER_COST + 1` buckets are enough and are reused cyclically.
    """
    height, width = is_passable.shape
    nodes = np.full((height, width), _NONE)
    costs = np.full((height, width), np.iinfo(np.int64).max)
    previous_cells = np.full((height, width), _NONE)
    # Numba infers the type of the elements from the first one.
    buckets = [[0] for _ in range(_CORNER_COST + 1)]
    for bucket in buckets:
        bucket.clear()
    for node in source_nodes:
        row = node_cells[node, 0]
        column = node_cells[node, 1]
        nodes[row, column] = node
        costs[row, column] = 0
        buckets[0].append(row * width + column)
    front_size = len(source_nodes)
    cost = 0
    while front_size > 0:
        bucket = buckets[cost % len(buckets)]
        front_size -= len(bucket)
        # The order of the cells decides between paths of the same cost.
        bucket.sort()
        for cell in bucket:
            row = cell // width
            column = cell % width
            if cost > costs[row, column]:
                # A shorter path to this cell has been found in the meantime.
                continue
            for k in range(len(_NEIGHBOR_STEPS)):
                next_row = row + _NEIGHBOR_STEPS[k, 0]
                next_column = column + _NEIGHBOR_STEPS[k, 1]
                if not (0 <= next_row < height and 0 <= next_column < width):
                    continue
                if not is_passable[next_row, next_column]:
                    continue
                step_cost = _SIDE_COST
                if k >= _SIDE_COUNT:
                    # A step across a corner must not cut the corner of a wall.
                    if not (is_passable[row, next_column] and is_passable[next_row, column]):
                        continue
                    step_cost = _CORNER_COST
                next_cost = cost + step_cost
                if next_cost < costs[next_row, next_column]:
                    nodes[next_row, next_column] = nodes[row, column]
                    costs[next_row, next_column] = next_cost
                    previous_cells[next_row, next_column] = cell
                    buckets[next_cost % len(buckets)].append(next_row * width + next_column)
                    front_size += 1
        bucket.clear()
        cost += 1
    return _ShortestPaths(nodes, costs, previous_cells)


def _find_meeting_cells(shortest: _ShortestPaths, pieces: IntArray) -> tuple[IntArray, IntArray]:
    """Find the cells in which the paths from two nodes of different pieces meet.

    Returns
    -------
    first_cells, last_cells : (p,) int arrays
        Flat indices of two cells that share a side: for each pair of nodes, those on the shortest path
        between the nodes. The first cell belongs to the node with the lower index.
    """
    height, width = shortest.nodes.shape
    nodes = shortest.nodes.ravel()
    # The piece of each cell. The index `_NONE` selects the appended element.
    cell_pieces = np.append(pieces, _NONE)[shortest.nodes]
    # All pairs of cells that share a side, if the cells belong to nodes of different pieces.
    flat_indices = np.arange(height * width).reshape(height, width)
    left_cells = flat_indices[:, :-1][_are_different(cell_pieces[:, :-1], cell_pieces[:, 1:])]
    lower_cells = flat_indices[:-1][_are_different(cell_pieces[:-1], cell_pieces[1:])]
    cells = np.concatenate([left_cells, lower_cells])
    neighbors = np.concatenate([left_cells + 1, lower_cells + width])
    is_lower_first = nodes[cells] < nodes[neighbors]
    first = np.where(is_lower_first, cells, neighbors)
    last = np.where(is_lower_first, neighbors, cells)
    costs = shortest.costs.ravel()[first] + shortest.costs.ravel()[last]
    # Of the pairs of cells for the same two nodes, keep the one with the lowest cost. The indices of the
    # cells break ties.
    order = np.lexsort((last, first, costs, nodes[last], nodes[first]))
    _, unique = np.unique(np.column_stack([nodes[first], nodes[last]])[order], axis=0, return_index=True)
    return first[order][unique], last[order][unique]


def _are_different(first_pieces: IntArray, last_pieces: IntArray) -> BoolArray:
    """Return whether two cells belong to different pieces, for arrays of cells; False without a piece."""
    are_known = (first_pieces != _NONE) & (last_pieces != _NONE)
    return np.asarray(are_known & (first_pieces != last_pieces))


def _trace_path(shortest: _ShortestPaths, first_cell: int, last_cell: int) -> IntArray:
    """Trace the path between two nodes through the adjacent cells in which the paths from them meet.

    Parameters
    ----------
    shortest : _ShortestPaths
    first_cell, last_cell : int
        Flat indices of these cells. Each belongs to one of the two nodes.

    Returns
    -------
    (k, 2) int array
        Rows and columns of the cells on the path, from the node of `first_cell` to that of `last_cell`.
    """
    previous_cells = shortest.previous_cells.ravel()
    halves = []
    for meeting_cell in (first_cell, last_cell):
        # From the meeting cell back to the node.
        half = [meeting_cell]
        while previous_cells[half[-1]] != _NONE:
            half.append(int(previous_cells[half[-1]]))
        halves.append(half)
    first_half, last_half = halves
    cells = [*reversed(first_half), *last_half]
    rows, columns = np.unravel_index(cells, shortest.nodes.shape)
    return np.column_stack([rows, columns])


def add_portals(edges: Edges, portals: Portals, cell_size: float) -> Edges:
    """Add portals to the edges of a lattice, in both directions.

    Parameters
    ----------
    edges : Edges
    portals : Portals
    cell_size : float, m
        Side of a cell.

    Returns
    -------
    Edges
    """
    node_count = len(edges.edge_starts) - 1
    starts = np.repeat(np.arange(node_count), np.diff(edges.edge_starts))
    starts = np.concatenate([starts, portals.first_nodes, portals.last_nodes])
    ends = np.concatenate([edges.ends, portals.last_nodes, portals.first_nodes])
    portal_lengths = portals.lengths * cell_size
    lengths = np.concatenate([edges.lengths, portal_lengths, portal_lengths])
    order = np.argsort(starts, kind="stable")
    edge_starts = np.concatenate([[0], np.cumsum(np.bincount(starts, minlength=node_count))])
    return Edges(lengths[order], ends[order], edge_starts.astype(np.intp))
