"""Clipping of one cell: the region is cut by the bisectors between a robot and its neighbors.

The polygon of a cell is stored in one of two rings, and each cut writes the other one. All coordinates are
relative to the generator of the cell, so that a tiny cell far from the origin keeps its full precision.
"""

from typing import NamedTuple

import numpy as np

from robocov.arrays import Array
from robocov.compiled import inlined_kernel, kernel
from robocov.density.cell_edges import REGION
from robocov.observation.region import SIDE_X, SIDE_Y

X = 0
"""Column of a vertex: its offset from the generator in x, m."""
Y = 1
"""Column of a vertex: its offset from the generator in y, m."""
BEYOND = 2
"""Column of a vertex: the robot on the other side of the edge that begins there, or `REGION`."""
_EXCESS = 3
"""Column of a vertex: its excess q · d - |d|²/2 over the current bisector, with d the offset of the
neighbor, m²; positive beyond the bisector."""

DX = 0
"""Column of a neighbor: its offset from the generator in x, m."""
DY = 1
"""Column of a neighbor: its offset from the generator in y, m."""
SQUARED_DISTANCE = 2
"""Column of a neighbor: its squared distance, m²."""
ROBOT = 3
"""Column of a neighbor: its number."""
_NEIGHBOR_COLUMNS = 4

_EDGE_START_X = 0
_EDGE_START_Y = 1
_EDGE_END_X = 2
_EDGE_END_Y = 3
"""Columns of an edge: its ends relative to the generator, m."""
EDGE_CELL = 4
"""Column of an edge: the robot to whose cell it belongs."""
EDGE_BEYOND = 5
"""Column of an edge: the robot on the other side, or `REGION`."""

_SORTED_NEIGHBORS = 6
"""Number of neighbors that cut a cell in order of distance; few others can then still cut it."""


class Workspace(NamedTuple):
    """Working memory for the computation of one cell after another."""

    rings: Array
    """(2, k, 4) Vertices of two polygons; the columns are `X`, `Y`, `BEYOND` and one for cuts."""
    neighbors: Array
    """(n, 4) Neighbors that may bound the cell; the columns are `DX`, `DY`, `SQUARED_DISTANCE`, `ROBOT`."""


class CellPolygon(NamedTuple):
    """The polygon of a cell in a `Workspace`."""

    ring: int
    """Index of the ring."""
    vertex_count: int
    start: int
    """Index of the first vertex in the ring."""


class CellArrays(NamedTuple):
    """Results for n cells."""

    mass: Array
    """(n,) m², the areas."""
    centroid: Array
    """(n, 2) m"""
    edges: Array
    """(e, 6) The edges: x, y, u, v of the ends relative to the generator (m), cell and `BEYOND`."""


@kernel
def create_workspace(robot_count: int, side_count: int) -> Workspace:
    """Allocate the working memory for the cells of a team in a region.

    Parameters
    ----------
    robot_count : int
    side_count : int
        Number of sides of the region.

    Returns
    -------
    Workspace
    """
    return Workspace(
        np.empty((2, side_count + robot_count + 2, 4)), np.empty((robot_count, _NEIGHBOR_COLUMNS))
    )


@inlined_kernel
def add_neighbor(neighbors: Array, count: int, dx: float, dy: float, robot: int) -> int:
    """Add a neighbor that may bound a cell to those of a workspace.

    A neighbor at the position of the generator is left out: the two do not cut each other's cells.

    Parameters
    ----------
    neighbors : (n, 4) array
        Changed in place; see `Workspace`.
    count : int
        Number of neighbors before.
    dx, dy : float, m
        Offset of the neighbor from the generator.
    robot : int
        Number of the neighbor.

    Returns
    -------
    int
        Number of neighbors after.
    """
    neighbors[count, DX] = dx
    neighbors[count, DY] = dy
    neighbors[count, SQUARED_DISTANCE] = dx * dx + dy * dy
    neighbors[count, ROBOT] = robot
    return count + 1 if neighbors[count, SQUARED_DISTANCE] > 0.0 else count


@inlined_kernel
def clip_cell(workspace: Workspace, neighbor_count: int, points: Array, sides: Array, i: int) -> CellPolygon:
    """Cut the region by the bisectors between robot i and its neighbors.

    Parameters
    ----------
    workspace : Workspace
        Its first rows are the neighbors; they are reordered.
    neighbor_count : int
    points : (n, 2) array, m
        The generators.
    sides : (k, 5) array
        The region, as `Region.sides`.
    i : int
        Number of the robot.

    Returns
    -------
    CellPolygon
    """
    rings = workspace.rings
    neighbor_rows = workspace.neighbors
    ring = 0
    count = len(sides)
    for k in range(count):
        rings[ring, k, X] = sides[k, SIDE_X] - points[i, 0]
        rings[ring, k, Y] = sides[k, SIDE_Y] - points[i, 1]
        rings[ring, k, BEYOND] = REGION
    # A neighbor can only cut the cell if it is at most twice as far away as the farthest vertex.
    squared_range = _compute_squared_range(rings, ring, count)
    for row in range(neighbor_count):
        if row < _SORTED_NEIGHBORS:
            _move_nearest(neighbor_rows, row, neighbor_count)
        if neighbor_rows[row, SQUARED_DISTANCE] <= squared_range:
            new_count = _cut(rings, ring, count, neighbor_rows, row)
            if new_count >= 0:
                ring = 1 - ring
                count = new_count
                squared_range = _compute_squared_range(rings, ring, count)
        elif row < _SORTED_NEIGHBORS:
            break
    return CellPolygon(ring, count, 0)


@inlined_kernel
def _compute_squared_range(rings: Array, ring: int, count: int) -> float:
    """Return the square of the largest distance at which a neighbor can cut the polygon, m²."""
    squared_range = 0.0
    for k in range(count):
        x = rings[ring, k, X]
        y = rings[ring, k, Y]
        squared_range = max(squared_range, 4.0 * (x * x + y * y))
    return squared_range


@inlined_kernel
def _move_nearest(neighbor_rows: Array, row: int, count: int) -> None:
    """Swap the nearest of the neighbors from `row` onwards into that row."""
    nearest = row
    for k in range(row + 1, count):
        if neighbor_rows[k, SQUARED_DISTANCE] < neighbor_rows[nearest, SQUARED_DISTANCE]:
            nearest = k
    for column in range(_NEIGHBOR_COLUMNS):
        neighbor_rows[row, column], neighbor_rows[nearest, column] = (
            neighbor_rows[nearest, column],
            neighbor_rows[row, column],
        )


@inlined_kernel
def _cut(rings: Array, old: int, count: int, neighbor_rows: Array, row: int) -> int:
    """Write the part of a polygon on the generator's side of a bisector to the other ring.

    Return its number of vertices, or -1, without writing anything, if the bisector does not cut the polygon.
    """
    farthest = _compute_excess(rings, old, count, neighbor_rows, row)
    if farthest < 0:
        return -1
    # The vertices beyond the bisector are consecutive, up to rounding, because the polygon is convex.
    last = farthest
    after = farthest
    for _ in range(count):
        after = last + 1 if last + 1 < count else 0
        if rings[old, after, _EXCESS] <= 0.0:
            break
        last = after
    else:
        return 0
    first = farthest
    while rings[old, first - 1 if first else count - 1, _EXCESS] > 0.0:
        first = first - 1 if first else count - 1
    size = 0
    last_kept = after
    k = after
    while k != first:
        for column in (X, Y, BEYOND):
            rings[1 - old, size, column] = rings[old, k, column]
        last_kept = k
        size += 1
        k = k + 1 if k + 1 < count else 0
    robot = neighbor_rows[row, ROBOT]
    if rings[old, last_kept, _EXCESS] == 0.0:
        rings[1 - old, size - 1, BEYOND] = robot
    else:
        _add_crossing(rings, old, size, last_kept, first, robot)
        size += 1
    if rings[old, after, _EXCESS] < 0.0:
        _add_crossing(rings, old, size, after, last, rings[old, last, BEYOND])
        size += 1
    return size


@inlined_kernel
def _compute_excess(rings: Array, ring: int, count: int, neighbor_rows: Array, row: int) -> int:
    """Compute the excess of each vertex over a bisector; return the vertex farthest beyond it, or -1."""
    dx = neighbor_rows[row, DX]
    dy = neighbor_rows[row, DY]
    level = 0.5 * neighbor_rows[row, SQUARED_DISTANCE]
    farthest = -1
    max_excess = 0.0
    for k in range(count):
        excess = rings[ring, k, X] * dx + rings[ring, k, Y] * dy - level
        rings[ring, k, _EXCESS] = excess
        if excess > max_excess:
            farthest = k
            max_excess = excess
    return farthest


@inlined_kernel
def _add_crossing(rings: Array, old: int, size: int, inner: int, outer: int, beyond: float) -> None:
    """Write the intersection of an edge with the bisector as vertex `size` of the other ring."""
    inner_excess = rings[old, inner, _EXCESS]
    fraction = inner_excess / (inner_excess - rings[old, outer, _EXCESS])
    for column in (X, Y):
        step = rings[old, outer, column] - rings[old, inner, column]
        rings[1 - old, size, column] = rings[old, inner, column] + fraction * step
    rings[1 - old, size, BEYOND] = beyond


@inlined_kernel
def write_cell(
    workspace: Workspace, polygon: CellPolygon, points: Array, i: int, cells: CellArrays, total: int
) -> int:
    """Write mass, centroid and edges of the cell of robot i.

    Parameters
    ----------
    workspace : Workspace
    polygon : CellPolygon
    points : (n, 2) array, m
        The generators.
    i : int
        Number of the robot.
    cells : CellArrays
        Changed in place. Edges beyond the last row of its array are not written.
    total : int
        Number of edges of the previous cells.

    Returns
    -------
    int
        Number of edges of all cells so far.
    """
    rings = workspace.rings
    edges = cells.edges
    doubled_area = 0.0
    moment_x = 0.0
    moment_y = 0.0
    k = polygon.start
    for edge in range(total, total + polygon.vertex_count):
        after = k + 1 if k + 1 < polygon.vertex_count else 0
        x = rings[polygon.ring, k, X]
        y = rings[polygon.ring, k, Y]
        u = rings[polygon.ring, after, X]
        v = rings[polygon.ring, after, Y]
        cross = x * v - u * y
        doubled_area += cross
        moment_x += cross * (x + u)
        moment_y += cross * (y + v)
        if edge < len(edges):
            edges[edge, _EDGE_START_X] = x
            edges[edge, _EDGE_START_Y] = y
            edges[edge, _EDGE_END_X] = u
            edges[edge, _EDGE_END_Y] = v
            edges[edge, EDGE_CELL] = i
            edges[edge, EDGE_BEYOND] = rings[polygon.ring, k, BEYOND]
        k = after
    factor = 1.0 / (3.0 * doubled_area) if doubled_area > 0.0 else 0.0
    cells.mass[i] = max(0.5 * doubled_area, 0.0)
    cells.centroid[i, 0] = points[i, 0] + moment_x * factor
    cells.centroid[i, 1] = points[i, 1] + moment_y * factor
    return total + polygon.vertex_count
