"""A lattice of nodes in a window: its graph, shortest distances on it, and lines of sight.

Edges lead from a node to its neighbors in 16 directions: straight, diagonal, and a knight's move away. In
open space, a path on the lattice is therefore at most 2.8% longer than the straight line. Two nodes are
connected if no cell on the straight line between them is near a wall. Nodes near walls can be reached, but
paths do not pass through them.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from robocov.compiled import inlined_kernel, kernel
from robocov.typing import BoolArray, FloatArray, IntArray

_MOVES = ((0, 1), (1, 0), (1, 1), (1, -1), (1, 2), (1, -2), (2, 1), (2, -1))
"""Rows and columns of half of the moves from a node to its neighbors. The others are their opposites."""
_MAX_MOVE = 2
"""Maximum number of rows or columns in one move."""
_MOVES_PER_AXIS = 2 * _MAX_MOVE + 1
"""Number of different changes of the row, or of the column, in one move."""
_UNKNOWN_DETOUR = 0.4
"""Fraction by which routes through unknown cells are assumed to be longer, because of unknown walls."""
_SIGHT_STEP_CELLS = 0.5
"""Maximum distance between the sampled points of a line of sight."""


class LatticeCells(NamedTuple):
    """The properties of the cells and the nodes on which the graph of a lattice depends."""

    is_near_wall: BoolArray
    """(h, w) Whether each cell is closer to a wall than the clearance."""
    is_blocked: BoolArray
    """(h, w) Whether each cell is a wall or a presumed wall."""
    is_unknown: BoolArray
    """(h, w) Whether each cell is unknown."""
    has_clearance: BoolArray
    """(m,) Whether each node has the required clearance."""


class Edges(NamedTuple):
    """The edges of a directed graph with m nodes, in compressed sparse rows."""

    lengths: FloatArray
    """(e,) Length of each edge, m."""
    ends: IntArray
    """(e,) The node that each edge leads to."""
    edge_starts: IntArray
    """(m + 1,) The edges of node k are those from ``edge_starts[k]`` up to ``edge_starts[k + 1]``."""


class Frame(NamedTuple):
    """Position and size of the cells of a window, in the raster and in the plane."""

    low_x: float
    """x coordinate of the lower left corner of the raster, m."""
    low_y: float
    """y coordinate of that corner, m."""
    cell_size: float
    """Side of a cell, m."""
    first_row: int
    """First row of the raster that is in the window."""
    first_column: int
    """First column of the raster that is in the window."""
    last_row: int
    """Last row of the raster that is in the window."""
    last_column: int
    """Last column of the raster that is in the window."""


class _Moves(NamedTuple):
    """The k moves from a node to its neighbors, and the c cells that they cross."""

    rows: IntArray
    """(k,) Number of rows of nodes that each move leads up."""
    columns: IntArray
    """(k,) Number of columns of nodes that each move leads to the right."""
    lengths: FloatArray
    """(k,) m, length of each move."""
    crossed_rows: IntArray
    """(c,) Row of each cell that the moves cross, relative to the cell of the node."""
    crossed_columns: IntArray
    """(c,) Column of each of these cells."""
    first_crossed: IntArray
    """(k + 1,) The cells of move k are those from ``first_crossed[k]`` up to ``first_crossed[k + 1]``."""


def build_edges(cells: LatticeCells, rows: int, columns: int, stride: int, spacing: float) -> Edges:
    """Build the edges of a lattice.

    Parameters
    ----------
    cells : LatticeCells
    rows, columns : int
        Numbers of rows and columns of nodes.
    stride : int
        Number of cells from one node to the next.
    spacing : float, m
        Distance from one node to the next.

    Returns
    -------
    Edges
        The length of an edge is that of the line between its nodes, increased for unknown cells. Nodes near
        walls are dead ends: no edge leads on from there. Otherwise, a path could lead through a hole in a
        wall that has been seen only in part.
    """
    moves = _build_moves(stride, spacing)
    lengths = _compute_move_lengths(cells, moves, rows, columns, stride)
    return _compress_edges(lengths, columns)


def _build_moves(stride: int, spacing: float) -> _Moves:
    """Build the moves on a lattice with a spacing in m, and find the cells that they cross."""
    crossed = [_list_crossed_cells(up, right, stride) for up, right in _MOVES]
    counts = np.array([len(cells) for cells in crossed])
    rows, columns = np.array(_MOVES).T.copy()
    crossed_rows, crossed_columns = np.concatenate(crossed).T.copy()
    return _Moves(
        rows=rows,
        columns=columns,
        lengths=np.array([math.hypot(*move) for move in _MOVES]) * spacing,
        crossed_rows=crossed_rows,
        crossed_columns=crossed_columns,
        first_crossed=np.concatenate([[0], np.cumsum(counts)]),
    )


@lru_cache(maxsize=512)
def _list_crossed_cells(up: int, right: int, stride: int) -> tuple[tuple[int, int], ...]:
    """List the row and column, relative to a node, of each cell that the line to a neighbor crosses.

    The line is sampled twice per cell. A dictionary removes the duplicates and keeps the order.
    """
    fractions = np.linspace(0.0, 1.0, 2 * max(up, abs(right)) * stride + 1)
    rows = np.rint(fractions * up * stride).astype(int)
    columns = np.rint(fractions * right * stride).astype(int)
    return tuple(dict.fromkeys(zip(rows.tolist(), columns.tolist(), strict=True)))


@kernel
def _compute_move_lengths(
    cells: LatticeCells, moves: _Moves, rows: int, columns: int, stride: int
) -> FloatArray:
    """Compute the length of each move from each node, m; infinite for moves that are not possible.

    A move leads from a node to a neighbor up to `_MAX_MOVE` rows and columns away. The result has the shape
    (m, _MOVES_PER_AXIS, _MOVES_PER_AXIS): entry [node, _MAX_MOVE + up, _MAX_MOVE + right] belongs to the move
    from this node by `up` rows and `right` columns.

    A move is possible if no cell on the straight line is near a wall. Moves through unknown cells count as
    longer, by a fraction of up to `_UNKNOWN_DETOUR`. `moves` contains only one of each two opposite moves, so
    that each line is examined once, for both directions.
    """
    lengths = np.full((rows * columns, _MOVES_PER_AXIS, _MOVES_PER_AXIS), np.inf)
    for move in range(len(moves.lengths)):
        up = moves.rows[move]
        right = moves.columns[move]
        crossed_count = moves.first_crossed[move + 1] - moves.first_crossed[move]
        # From these rows and columns, the move stays on the lattice. `up` is never negative.
        for row in range(rows - up):
            for column in range(max(0, -right), columns - max(0, right)):
                # The node is in the middle of a square block of cells.
                node_row = stride // 2 + row * stride
                node_column = stride // 2 + column * stride
                is_passable, is_without_wall, unknown_count = _examine_crossed_cells(
                    cells, moves, move, node_row, node_column
                )
                node = row * columns + column
                neighbor = (row + up) * columns + column + right
                length = moves.lengths[move] * (1.0 + _UNKNOWN_DETOUR / crossed_count * unknown_count)
                # A node without clearance is a dead end: moves lead to it, from nodes with clearance, but no
                # move leads on from there.
                has_clearance = cells.has_clearance[node]
                neighbor_has_clearance = cells.has_clearance[neighbor]
                if is_passable or (is_without_wall and has_clearance and not neighbor_has_clearance):
                    lengths[node, _MAX_MOVE + up, _MAX_MOVE + right] = length
                if is_passable or (is_without_wall and neighbor_has_clearance and not has_clearance):
                    lengths[neighbor, _MAX_MOVE - up, _MAX_MOVE - right] = length
    return lengths


@inlined_kernel
def _examine_crossed_cells(
    cells: LatticeCells, moves: _Moves, move: int, node_row: int, node_column: int
) -> tuple[bool, bool, int]:
    """Examine the cells that a move crosses, from a node in the cell with the given row and column.

    Return whether none of them is near a wall, whether none of them is a wall, and how many are unknown.
    """
    is_passable = True
    is_without_wall = True
    unknown_count = 0
    for k in range(moves.first_crossed[move], moves.first_crossed[move + 1]):
        i = node_row + moves.crossed_rows[k]
        j = node_column + moves.crossed_columns[k]
        is_passable = is_passable and not cells.is_near_wall[i, j]
        is_without_wall = is_without_wall and not cells.is_blocked[i, j]
        unknown_count += cells.is_unknown[i, j]
    return is_passable, is_without_wall, unknown_count


@kernel
def _compress_edges(lengths: FloatArray, columns: int) -> Edges:
    """Collect the possible moves from all nodes as edges in compressed sparse rows.

    Entry [node, _MAX_MOVE + up, _MAX_MOVE + right] of `lengths` is the length in meters of the move by `up`
    rows and `right` columns; see `_compute_move_lengths`. A move of infinite length is not possible.
    """
    count = 0
    edge_lengths = np.empty(lengths.size)
    ends = np.empty(lengths.size, dtype=np.intp)
    edge_starts = np.zeros(len(lengths) + 1, dtype=np.intp)
    for node in range(len(lengths)):
        for up in range(-_MAX_MOVE, _MAX_MOVE + 1):
            for right in range(-_MAX_MOVE, _MAX_MOVE + 1):
                length = lengths[node, _MAX_MOVE + up, _MAX_MOVE + right]
                if length < np.inf:
                    edge_lengths[count] = length
                    ends[count] = node + up * columns + right
                    count += 1
        edge_starts[node + 1] = count
    return Edges(edge_lengths[:count].copy(), ends[:count].copy(), edge_starts)


@kernel
def compute_distances(
    edges: Edges, shortest_edge: float, sources: IntArray, offsets: FloatArray, limit: float
) -> FloatArray:
    """Compute the distance from each node to the nearest of several sources.

    Parameters
    ----------
    edges : Edges
        Directed edges between m nodes.
    shortest_edge : float, m
        Lower bound of the lengths of the edges.
    sources : (k,) int array
        Nodes at which paths start.
    offsets : (k,) array, m
        Length that is added to the paths from each source.
    limit : float, m
        Maximum length of a path.

    Returns
    -------
    (m,) array, m
        Infinite for nodes that no path within the limit reaches.

    Notes
    -----
    This is Dijkstra's algorithm, except that it settles several nodes in each iteration: the nearest node of
    the front, and all nodes whose distance exceeds that of the nearest by less than the shortest edge. A
    path from one of these nodes to another would be longer than the path already known. The *front* contains
    the nodes that a path has reached, but whose distance is not final yet.
    """
    node_count = len(edges.edge_starts) - 1
    distances = np.full(node_count, np.inf)
    # The first `front_size` entries of `front` are the nodes of the front, in any order.
    front = np.empty(node_count, dtype=np.intp)
    is_in_front = np.zeros(node_count, dtype=np.bool_)
    front_size = _add_sources(sources, offsets, distances, front, is_in_front)
    settled = np.empty(node_count, dtype=np.intp)
    while front_size:
        remaining_count = _settle_nearest_nodes(distances, front, front_size, shortest_edge, settled)
        settled_count = front_size - remaining_count
        front_size = remaining_count
        for k in range(settled_count):
            is_in_front[settled[k]] = False
        # Update the distances of the neighbors of settled nodes.
        for k in range(settled_count):
            node = settled[k]
            for edge in range(edges.edge_starts[node], edges.edge_starts[node + 1]):
                end = edges.ends[edge]
                length = distances[node] + edges.lengths[edge]
                if length >= distances[end] or length > limit:
                    continue
                distances[end] = length
                if not is_in_front[end]:
                    front[front_size] = end
                    is_in_front[end] = True
                    front_size += 1
    return distances


@kernel
def _add_sources(
    sources: IntArray, offsets: FloatArray, distances: FloatArray, front: IntArray, is_in_front: BoolArray
) -> int:
    """Set the distances of the sources, in m, and add them to an empty front; return the number added.

    The last three arrays are changed in place. A source that is given several times is added once.
    """
    front_size = 0
    for k in range(len(sources)):
        node = sources[k]
        distances[node] = min(distances[node], offsets[k])
        if not is_in_front[node]:
            front[front_size] = node
            is_in_front[node] = True
            front_size += 1
    return front_size


@kernel
def _settle_nearest_nodes(
    distances: FloatArray, front: IntArray, front_size: int, shortest_edge: float, settled: IntArray
) -> int:
    """Move the nodes to settle from the front to `settled`; return the number of nodes that remain.

    These are the nodes whose distance exceeds that of the nearest one by less than the shortest edge. The
    nodes that remain become the first entries of `front`.
    """
    min_distance = np.inf
    for k in range(front_size):
        min_distance = min(min_distance, distances[front[k]])
    settled_count = 0
    remaining_count = 0
    for k in range(front_size):
        node = front[k]
        if distances[node] < min_distance + shortest_edge:
            settled[settled_count] = node
            settled_count += 1
        else:
            front[remaining_count] = node
            remaining_count += 1
    return remaining_count


@kernel
def find_nearest_nodes(
    position: FloatArray, nodes: FloatArray, is_candidate: BoolArray, max_count: int
) -> IntArray:
    """Find the candidates that are nearest to a position, in order of distance.

    Parameters
    ----------
    position : (2,) array, m
    nodes : (m, 2) array, m
    is_candidate : (m,) bool array
    max_count : int

    Returns
    -------
    (k,) int array
        At most `max_count` nodes.
    """
    # This is an insertion sort of the nearest nodes so far: a new node moves forward to its position in the
    # list, and the last one is dropped if the list is full.
    nearest = np.empty(max_count, dtype=np.intp)
    squared_distances = np.empty(max_count)
    count = 0
    for node in range(len(nodes)):
        squared_distance = (nodes[node, 0] - position[0]) ** 2 + (nodes[node, 1] - position[1]) ** 2
        is_too_far = count == max_count and squared_distance >= squared_distances[max_count - 1]
        if is_too_far or not is_candidate[node]:
            continue
        count = min(count + 1, max_count)
        k = count - 1
        while k > 0 and squared_distances[k - 1] > squared_distance:
            nearest[k] = nearest[k - 1]
            squared_distances[k] = squared_distances[k - 1]
            k -= 1
        nearest[k] = node
        squared_distances[k] = squared_distance
    return nearest[:count]


@kernel
def find_clear_lines(
    position: FloatArray, ends: FloatArray, is_obstructing: BoolArray, frame: Frame, ignored_length: float
) -> BoolArray:
    """Find the straight lines from a position that cross no obstructing cell.

    Parameters
    ----------
    position : (2,) array, m
    ends : (k, 2) array, m
    is_obstructing : (h, w) bool array
        Whether each cell of a window obstructs lines.
    frame : Frame
        Position of these cells.
    ignored_length : float, m
        Points of a line within this distance of the position are not tested.

    Returns
    -------
    (k,) bool array
        Whether each line is clear.
    """
    # All lines are sampled at the same number of points, at most half a cell apart.
    lengths = np.empty(len(ends))
    max_length = 0.0
    for k in range(len(ends)):
        lengths[k] = math.sqrt((ends[k, 0] - position[0]) ** 2 + (ends[k, 1] - position[1]) ** 2)
        max_length = max(max_length, lengths[k])
    step_count = math.ceil(max_length / (_SIGHT_STEP_CELLS * frame.cell_size)) + 1
    cells_per_meter = 1.0 / frame.cell_size
    is_clear = np.ones(len(ends), dtype=np.bool_)
    for k in range(len(ends)):
        for step in range(step_count + 1):
            # As in `np.linspace`, the last point is exactly the end of the line.
            fraction = step * (1.0 / step_count) if step < step_count else 1.0
            x = position[0] + (ends[k, 0] - position[0]) * fraction
            y = position[1] + (ends[k, 1] - position[1]) * fraction
            row = math.floor((y - frame.low_y) * cells_per_meter)
            column = math.floor((x - frame.low_x) * cells_per_meter)
            # Points beyond the window belong to the nearest cell in it.
            row = min(max(row, frame.first_row), frame.last_row) - frame.first_row
            column = min(max(column, frame.first_column), frame.last_column) - frame.first_column
            is_ignored = ignored_length > 0.0 and lengths[k] * fraction <= ignored_length
            if is_obstructing[row, column] and not is_ignored:
                is_clear[k] = False
                break
    return is_clear
