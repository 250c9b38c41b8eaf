"""The generalized Voronoi graph of free space: the points that are equally far from two walls.

It is the roadmap of Choset and Burdick (IJRR 19, 2000) on a grid. The free cells are thinned to lines. This
preserves connections and loops, and the points halfway between two walls that face each other.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy import ndimage
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from robocov.arrays import compute_point_distances
from robocov.compiled import kernel
from robocov.planning.raster import SIDE_STEPS
from robocov.typing import BoolArray, FloatArray, Int32Array, IntArray

_MIN_FACING_ANGLE_RAD = math.radians(120.0)
"""Minimum angle between the directions from a point to two walls that face each other."""
_NEIGHBOR_STEPS = np.array([(0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1)])
"""Rows and columns from a cell to its eight neighbors, in circular order.

Neighbors with an even index share a side with the cell.
"""
_FORWARD_STEPS = ((0, 1), (1, 0), (1, 1), (1, -1))
"""Rows and columns from a cell to half of its neighbors, so that each pair of neighbors is visited once."""
_CELL_STEP = 1.0
"""Distance between two adjacent cells, in cells."""
NO_VERTEX = -1
"""Index that stands for no vertex, or no group of cells."""
_UP = 0
"""Column of `_NEIGHBOR_STEPS`: number of rows up."""
_RIGHT = 1
"""Column of `_NEIGHBOR_STEPS`: number of columns to the right."""


class VoronoiRoadmap(NamedTuple):
    """Vertices along the generalized Voronoi graph of free space, each with the cells that belong to it."""

    vertices: IntArray
    """(v, 2) Row and column of the cell of each vertex."""
    distances: FloatArray
    """(v, v) Distances along the graph, in cells; infinite between vertices that it does not connect."""
    vertex_of_cell: IntArray
    """(rows, columns) The vertex that each cell belongs to, or `NO_VERTEX`."""

    @classmethod
    def build(
        cls, has_clearance: BoolArray, is_free: BoolArray, spacing: float, max_vertices: int
    ) -> VoronoiRoadmap:
        """Build the roadmap of the cells where the center of a robot may be.

        Parameters
        ----------
        has_clearance : (rows, columns) bool array
            Whether each cell may be part of the graph.
        is_free : (rows, columns) bool array
            Whether to assign each cell to a vertex.
        spacing : float
            Minimum distance from one vertex to the next, in cells.
        max_vertices : int
            Approximate maximum number of vertices.

        Returns
        -------
        VoronoiRoadmap
        """
        # Each group of adjacent cells of the graph becomes a vertex, at its first cell. Two vertices are
        # connected if their groups touch. Finally, the other free cells are added to the nearest group.
        is_in_graph = find_voronoi_cells(has_clearance)
        # Along a line, a group contains more than `steps` cells, unless other groups leave it fewer.
        steps = max(1, math.ceil(max(spacing, np.count_nonzero(is_in_graph) / max_vertices)))
        first_cells, vertex_of_cell = _group_cells(is_in_graph, steps, _NEIGHBOR_STEPS)
        vertices = np.column_stack(np.divmod(first_cells, has_clearance.shape[1]))
        starts, ends = _list_adjacent_groups(vertex_of_cell)
        lengths = compute_point_distances(vertices[starts], vertices[ends])
        graph = csr_array((lengths, (starts, ends)), shape=(len(vertices), len(vertices)))
        _spread_groups(vertex_of_cell, is_free, np.array(SIDE_STEPS))
        return cls(
            vertices=vertices,
            distances=dijkstra(graph, directed=False),
            vertex_of_cell=vertex_of_cell,
        )


def find_voronoi_cells(is_free: BoolArray) -> BoolArray:
    """Find the cells of the generalized Voronoi graph of free cells.

    Parameters
    ----------
    is_free : (rows, columns) bool array
        Everything outside the array counts as wall.

    Returns
    -------
    (rows, columns) bool array
        Lines one or two cells wide.

    Notes
    -----
    Cells are removed, from the walls inwards, if the cells around them stay connected (distance-ordered
    homotopic thinning, Pudney 1998). A cell is not removed if the direction to its nearest wall is very
    different from that of an adjacent cell. Branches into corners therefore vanish, while those into rooms
    remain.
    """
    is_in_graph = np.pad(is_free, 1)
    wall_distances, nearest_walls = ndimage.distance_transform_edt(is_in_graph, return_indices=True)
    must_stay = _find_cells_between_walls(wall_distances, nearest_walls) & is_in_graph
    # The cells nearest to walls are removed first.
    order = np.flatnonzero(is_in_graph)
    order = order[np.argsort(wall_distances.ravel()[order], kind="stable")]
    _thin(is_in_graph, must_stay, order, _NEIGHBOR_STEPS)
    return is_in_graph[1:-1, 1:-1]


def _find_cells_between_walls(wall_distances: FloatArray, nearest_walls: Int32Array) -> BoolArray:
    """Find the cells whose nearest wall is in a very different direction from that of an adjacent cell.

    Parameters
    ----------
    wall_distances : (rows, columns) array
        Distance of each cell from the nearest wall cell, in cells.
    nearest_walls : (2, rows, columns) int array
        Row and column of that wall cell.

    Returns
    -------
    (rows, columns) bool array
    """
    is_between_walls = np.zeros(wall_distances.shape, dtype=bool)
    for axis in (0, 1):
        # Views in which adjacent cells along the axis are in adjacent rows.
        distances = np.swapaxes(wall_distances, 0, axis)
        walls = np.swapaxes(nearest_walls, 1, 1 + axis)
        is_between = np.swapaxes(is_between_walls, 0, axis)
        # The distances between the wall cells that are nearest to two adjacent cells.
        gaps = np.sqrt((np.diff(walls, axis=1) ** 2).sum(axis=0))
        # Two walls at a distance r from a cell, in directions that differ by an angle α, are 2 r sin(α/2)
        # apart. Two adjacent cells along the same wall already have nearest wall cells that are one apart.
        max_distances = np.maximum(distances[:-1], distances[1:])
        is_facing = gaps > 2.0 * max_distances * math.sin(0.5 * _MIN_FACING_ANGLE_RAD) + _CELL_STEP
        is_between[:-1] |= is_facing
        is_between[1:] |= is_facing
    return is_between_walls


@kernel
def _thin(is_in_graph: BoolArray, must_stay: BoolArray, order: IntArray, neighbor_steps: IntArray) -> None:
    """Remove cells from the graph, in place, as long as the neighbors of each removed cell stay connected.

    Cells that must stay are not removed. The other cells are tested in the given order, as indices of the
    flattened array, in several passes until no more can be removed.
    """
    columns = is_in_graph.shape[1]
    has_changed = True
    while has_changed:
        has_changed = False
        for cell in order:
            row = cell // columns
            column = cell % columns
            if not is_in_graph[row, column] or must_stay[row, column]:
                continue
            if _count_crossings(is_in_graph, row, column, neighbor_steps) == 1:
                is_in_graph[row, column] = False
                has_changed = True


@kernel
def _count_crossings(is_in_graph: BoolArray, row: int, column: int, neighbor_steps: IntArray) -> int:
    """Return Hilditch's crossing number of a cell; removing the cell is safe only if it is 1.

    This is the number of separate runs of cells of the graph among the eight neighbors. The neighbors above
    and to the right, for example, touch diagonally, and belong to the same run. Each run is counted at its
    start: a side neighbor that is not in the graph, followed by a neighbor that is.

    A closed ring of neighbors has no start and counts 0. Interior cells are therefore not removed, which
    would make a hole.
    """
    crossings = 0
    for k in range(0, 8, 2):
        has_side = _is_neighbor_in_graph(is_in_graph, row, column, neighbor_steps[k])
        has_corner = _is_neighbor_in_graph(is_in_graph, row, column, neighbor_steps[(k + 1) % 8])
        has_next_side = _is_neighbor_in_graph(is_in_graph, row, column, neighbor_steps[(k + 2) % 8])
        if not has_side and (has_corner or has_next_side):
            crossings += 1
    return crossings


@kernel
def _is_neighbor_in_graph(is_in_graph: BoolArray, row: int, column: int, step: IntArray) -> bool:
    """Return whether the cell one step away belongs to the graph."""
    return bool(is_in_graph[row + step[_UP], column + step[_RIGHT]])


@kernel
def _group_cells(
    is_in_graph: BoolArray, max_steps: int, neighbor_steps: IntArray
) -> tuple[IntArray, IntArray]:
    """Return the first cell of each group, and the group of each cell, (rows, columns), or `NO_VERTEX`.

    The first cell of a group is the first one of the graph that is not in an earlier group. A breadth-first
    search adds the other cells: those that it reaches within `max_steps` steps from neighbor to neighbor.
    """
    columns = is_in_graph.shape[1]
    groups = np.full(is_in_graph.shape, NO_VERTEX)
    first_cells = np.empty(is_in_graph.size, dtype=np.intp)
    queue = np.empty(is_in_graph.size, dtype=np.intp)
    step_counts = np.empty(is_in_graph.size, dtype=np.intp)
    group_count = 0
    for cell in range(is_in_graph.size):
        row = cell // columns
        column = cell % columns
        if is_in_graph[row, column] and groups[row, column] == NO_VERTEX:
            first_cells[group_count] = cell
            groups[row, column] = group_count
            queue[0] = cell
            step_counts[0] = 0
            _fill_group(groups, is_in_graph, max_steps, neighbor_steps, queue, step_counts)
            group_count += 1
    return first_cells[:group_count], groups


@kernel
def _fill_group(
    groups: IntArray,
    is_in_graph: BoolArray,
    max_steps: int,
    neighbor_steps: IntArray,
    queue: IntArray,
    step_counts: IntArray,
) -> None:
    """Add the cells of the graph within `max_steps` steps of a first cell to the group of that cell.

    This is a breadth-first search. `groups` contains the group of each cell, or `NO_VERTEX`. `queue` contains
    flat indices of cells, and at the start only that of the first cell; entry k of `step_counts` is the
    number of steps from the first cell to ``queue[k]``. All three are changed in place.
    """
    rows, columns = is_in_graph.shape
    head = 0
    tail = 1
    while head < tail:
        row = queue[head] // columns
        column = queue[head] % columns
        step_count = step_counts[head]
        head += 1
        for k in range(len(neighbor_steps)):
            i = row + neighbor_steps[k, _UP]
            j = column + neighbor_steps[k, _RIGHT]
            is_inside = 0 <= i < rows and 0 <= j < columns
            if step_count < max_steps and is_inside and is_in_graph[i, j] and groups[i, j] == NO_VERTEX:
                groups[i, j] = groups[row, column]
                queue[tail] = i * columns + j
                step_counts[tail] = step_count + 1
                tail += 1


def _list_adjacent_groups(groups: IntArray) -> tuple[IntArray, IntArray]:
    """List the pairs of groups with adjacent cells, each pair once, the smaller index first."""
    rows, columns = groups.shape
    pairs = []
    for up, right in _FORWARD_STEPS:
        # Two views of the array: `second` contains the neighbors, one step away, of the cells in `first`.
        first = groups[: rows - up, max(0, -right) : columns - max(0, right)]
        second = groups[up:, max(0, right) : columns + min(0, right)]
        is_border = (first != NO_VERTEX) & (second != NO_VERTEX) & (first != second)
        pairs.append(np.sort(np.column_stack([first[is_border], second[is_border]]), axis=1))
    starts, ends = np.unique(np.concatenate(pairs), axis=0).T
    return starts, ends


@kernel
def _spread_groups(groups: IntArray, is_free: BoolArray, neighbor_steps: IntArray) -> None:
    """Add each free cell without a group to the group of the nearest cell that has one, in place.

    Distances are counted in steps between neighbors: a breadth-first search starts from all cells with a
    group at once. Cells without a group contain `NO_VERTEX`.
    """
    rows, columns = is_free.shape
    # The queue contains indices of the flattened array, from `head` up to `tail`.
    queue = np.empty(is_free.size, dtype=np.intp)
    head = 0
    tail = 0
    for cell in range(is_free.size):
        if groups[cell // columns, cell % columns] != NO_VERTEX:
            queue[tail] = cell
            tail += 1
    while head < tail:
        row = queue[head] // columns
        column = queue[head] % columns
        head += 1
        for k in range(len(neighbor_steps)):
            i = row + neighbor_steps[k, _UP]
            j = column + neighbor_steps[k, _RIGHT]
            is_inside = 0 <= i < rows and 0 <= j < columns
            if is_inside and is_free[i, j] and groups[i, j] == NO_VERTEX:
                groups[i, j] = groups[row, column]
                queue[tail] = i * columns + j
                tail += 1
