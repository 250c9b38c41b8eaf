"""Connections through passages that the moves of a coarse lattice miss.

The moves of a lattice are straight lines between nodes. In a large window the nodes are far apart, and no
such line may lead through a narrow door. The lattice then falls apart into separate pieces, although the
free cells are connected. *Portals* connect these pieces: they are the shortest paths from cell to cell
between nodes of different pieces. They lead only through cells that have been seen to be free, because a
wall that has been seen only in part seems to have narrow holes.
"""

from __future__ import annotations

import heapq
from typing import NamedTuple

import numpy as np
from scipy import ndimage
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from robocov.arrays import Array, BoolArray, IntArray
from robocov.compiled import kernel
from robocov.planning.lattice import Edges

_NEIGHBORS = np.array([(0, 1), (1, 0), (0, -1), (-1, 0), (1, 1), (1, -1), (-1, 1), (-1, -1)])
"""Rows and columns from a cell to its neighbors: first those that share a side, then those at the corners."""
_SIDES = 4
"""Number of neighbors that share a side."""
_SIDE_COST = 5
"""Cost of a step to a neighbor that shares a side."""
_CORNER_COST = 7
"""Cost of a step to a neighbor at a corner: 7 / 5 is close to √2, and not above it."""
_NONE = -1
"""Stands for a cell, or a node, where there is none."""


class Portals(NamedTuple):
    """Paths between nodes of different pieces of a lattice."""

    first_nodes: IntArray
    """(p,) The node at the start of each path."""
    last_nodes: IntArray
    """(p,) The node at its end."""
    lengths: Array
    """(p,) Length of each path, in sides of a cell."""
    paths: list[IntArray]
    """The cells of each path between the two nodes, (k, 2): row and column in the window."""


class _Reach(NamedTuple):
    """The shortest way to each cell from the nearest of several nodes."""

    nodes: IntArray
    """(h, w) Index of the nearest node, `_NONE` for cells that no node reaches."""
    costs: IntArray
    """(h, w) Sum of the costs of the steps from there."""
    previous_cells: IntArray
    """(h, w) Flat index of the cell before, `_NONE` for the cells of the nodes themselves."""


def find_portals(is_passable: BoolArray, node_cells: IntArray, graph: csr_array) -> Portals:
    """Find the portals between the pieces of a lattice.

    Parameters
    ----------
    is_passable : (h, w) bool array
        Whether each cell is known to be free, and far enough from walls.
    node_cells : (m, 2) int array
        Row and column of the cell in which each node lies.
    graph : (m, m) csr_array
        The moves of the lattice.

    Returns
    -------
    Portals
        For each two nodes of different pieces whose nearest cells meet, the shortest path between them. There
        are none if the lattice connects all nodes that the cells connect.
    """
    rows, columns = node_cells.T
    # In both directions: a node without clearance can be reached, but no move leads on from it.
    _, labels = connected_components(graph, directed=True, connection="strong")
    pieces = np.asarray(labels, dtype=np.intp)
    areas, _ = ndimage.label(is_passable)
    nodes = np.flatnonzero(is_passable[rows, columns])
    node_areas = areas[rows, columns][nodes]
    pairs = np.unique(np.column_stack([node_areas, pieces[nodes]]), axis=0)
    if len(pairs) == len(np.unique(node_areas)):
        # All nodes in the same connected area of cells belong to the same piece.
        return Portals(nodes[:0], nodes[:0], np.empty(0), [])
    reach = _reach_cells(is_passable, node_cells, nodes)
    first_cells, last_cells = _find_meeting_cells(reach, pieces)
    costs = reach.costs.ravel()
    return Portals(
        first_nodes=reach.nodes.ravel()[first_cells],
        last_nodes=reach.nodes.ravel()[last_cells],
        lengths=(costs[first_cells] + costs[last_cells] + _SIDE_COST) / _SIDE_COST,
        paths=[
            _trace_path(reach, first, last)
            for first, last in zip(first_cells.tolist(), last_cells.tolist(), strict=True)
        ],
    )


@kernel
def _reach_cells(is_passable: BoolArray, node_cells: IntArray, source_nodes: IntArray) -> _Reach:
    """Find the nearest of the source nodes of each cell, by Dijkstra's algorithm from all of them at once."""
    height, width = is_passable.shape
    nodes = np.full((height, width), _NONE)
    costs = np.full((height, width), np.iinfo(np.int64).max)
    previous_cells = np.full((height, width), _NONE)
    front = [(0, 0, 0)]
    front.clear()
    for node in source_nodes:
        row = node_cells[node, 0]
        column = node_cells[node, 1]
        nodes[row, column] = node
        costs[row, column] = 0
        heapq.heappush(front, (0, row, column))
    while len(front) > 0:
        cost, row, column = heapq.heappop(front)
        if cost > costs[row, column]:
            # A shorter way to this cell has been found since.
            continue
        for k in range(len(_NEIGHBORS)):
            next_row = row + _NEIGHBORS[k, 0]
            next_column = column + _NEIGHBORS[k, 1]
            if not (0 <= next_row < height and 0 <= next_column < width):
                continue
            if not is_passable[next_row, next_column]:
                continue
            step_cost = _SIDE_COST
            if k >= _SIDES:
                # A step across a corner must not cut the corner of a wall.
                if not (is_passable[row, next_column] and is_passable[next_row, column]):
                    continue
                step_cost = _CORNER_COST
            if cost + step_cost < costs[next_row, next_column]:
                nodes[next_row, next_column] = nodes[row, column]
                costs[next_row, next_column] = cost + step_cost
                previous_cells[next_row, next_column] = row * width + column
                heapq.heappush(front, (cost + step_cost, next_row, next_column))
    return _Reach(nodes, costs, previous_cells)


def _find_meeting_cells(reach: _Reach, pieces: IntArray) -> tuple[IntArray, IntArray]:
    """Find where the cells of two nodes of different pieces meet.

    Returns
    -------
    first_cells, last_cells : (p,) int arrays
        Flat indices of neighboring cells: for each two nodes, those on the shortest path between the nodes.
        The first one belongs to the node with the lower index.
    """
    height, width = reach.nodes.shape
    cells = np.arange(height * width).reshape(height, width)
    a = np.concatenate([cells[:, :-1].ravel(), cells[:-1].ravel()])
    b = np.concatenate([cells[:, 1:].ravel(), cells[1:].ravel()])
    nodes = reach.nodes.ravel()
    is_reached = (nodes[a] != _NONE) & (nodes[b] != _NONE)
    a = a[is_reached]
    b = b[is_reached]
    is_meeting = pieces[nodes[a]] != pieces[nodes[b]]
    a = a[is_meeting]
    b = b[is_meeting]
    has_lower_node = nodes[a] < nodes[b]
    first = np.where(has_lower_node, a, b)
    last = np.where(has_lower_node, b, a)
    costs = reach.costs.ravel()[first] + reach.costs.ravel()[last]
    # The cheapest of each pair of nodes comes first. The cells themselves break ties.
    order = np.lexsort((last, first, costs, nodes[last], nodes[first]))
    _, unique = np.unique(np.column_stack([nodes[first], nodes[last]])[order], axis=0, return_index=True)
    return first[order][unique], last[order][unique]


def _trace_path(reach: _Reach, first_cell: int, last_cell: int) -> IntArray:
    """Return the cells of the path between two nodes over the two given cells, (k, 2): rows and columns."""
    previous_cells = reach.previous_cells.ravel()
    ends = []
    for cell in (first_cell, last_cell):
        path = [cell]
        while previous_cells[path[-1]] != _NONE:
            path.append(int(previous_cells[path[-1]]))
        ends.append(path)
    to_first, to_last = ends
    return np.column_stack(np.unravel_index([*reversed(to_first), *to_last], reach.nodes.shape))


def add_portals(edges: Edges, portals: Portals, cell_size: float) -> Edges:
    """Add portals to the edges of a lattice, in both directions.

    Parameters
    ----------
    edges : Edges
    portals : Portals
    cell_size : float, m

    Returns
    -------
    Edges
    """
    node_count = len(edges.first_edge) - 1
    starts = np.repeat(np.arange(node_count), np.diff(edges.first_edge))
    starts = np.concatenate([starts, portals.first_nodes, portals.last_nodes])
    ends = np.concatenate([edges.ends, portals.last_nodes, portals.first_nodes])
    portal_lengths = portals.lengths * cell_size
    lengths = np.concatenate([edges.lengths, portal_lengths, portal_lengths])
    order = np.argsort(starts, kind="stable")
    first_edge = np.concatenate([[0], np.cumsum(np.bincount(starts, minlength=node_count))])
    return Edges(lengths[order], ends[order], first_edge.astype(np.intp))
