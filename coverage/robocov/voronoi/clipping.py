"""The cell of one robot: the region, clipped along the bisectors between the robot and its neighbors.

All coordinates are relative to the generator of the cell, so that those of a tiny cell far from the origin
keep their full precision.
"""

from typing import NamedTuple

import numpy as np

from robocov.compiled import inlined_kernel, kernel
from robocov.density.cell_edges import REGION
from robocov.observation.region import SIDE_X, SIDE_Y
from robocov.typing import FloatArray

X = 0
"""Column of a vertex: its offset from the generator in x, m."""
Y = 1
"""Column of a vertex: its offset from the generator in y, m."""
OTHER_CELL = 2
"""Column of a vertex: the cell on the other side of the edge that starts there, or `REGION`."""
_EXCESS = 3
"""Column of a vertex: its excess q · d - |d|²/2 over the current bisector, where q is the vertex and d the
offset of the neighbor, m². It is positive beyond the bisector."""
_VERTEX_COLUMNS = 4
"""Number of columns of a vertex."""

DX = 0
"""Column of a neighbor: its offset from the generator in x, m."""
DY = 1
"""Column of a neighbor: its offset from the generator in y, m."""
SQUARED_DISTANCE = 2
"""Column of a neighbor: its squared distance from the generator, m²."""
ROBOT = 3
"""Column of a neighbor: its index."""
_NEIGHBOR_COLUMNS = 4
"""Number of columns of a neighbor."""

EDGE_START_X = 0
"""Column of an edge: x of its start relative to the generator, m."""
EDGE_START_Y = 1
"""Column of an edge: y of its start, m."""
EDGE_END_X = 2
"""Column of an edge: x of its end, m."""
EDGE_END_Y = 3
"""Column of an edge: y of its end, m."""
EDGE_CELL = 4
"""Column of an edge: the cell that it bounds, as the index of its robot."""
EDGE_OTHER_CELL = 5
"""Column of an edge: the cell on the other side, or `REGION`."""
EDGE_COLUMNS = 6
"""Number of columns of an edge."""

_NO_VERTEX = -1
"""Used in place of a vertex if there is none."""
_NOT_CUT = -1
"""Returned instead of a number of vertices if a bisector does not cut a cell."""

_SORTED_NEIGHBORS = 6
"""Number of neighbors that cut a cell in order of their distance. After them, few others can still cut it."""


class Workspace(NamedTuple):
    """Scratch space for the computation of one cell after another."""

    vertices: FloatArray
    """(k, 4) Vertices of the cell; the columns are `X`, `Y`, `OTHER_CELL` and `_EXCESS`."""
    new_vertices: FloatArray
    """(k, 4) Vertices of the cell after a cut; the columns are the same."""
    neighbors: FloatArray
    """(n, 4) Neighbors that may bound the cell; the columns are `DX`, `DY`, `SQUARED_DISTANCE`, `ROBOT`."""


class VertexRange(NamedTuple):
    """The rows of `Workspace.vertices` that contain the vertices of a cell, and where its outline starts."""

    vertex_count: int
    """Number of vertices. They are in the first rows, in counter-clockwise order."""
    start: int
    """Row of the vertex at which the first edge of the cell starts.

    It is 0 if the region was clipped. In a triangulation, it is chosen so that the order of the edges does
    not depend on the history of the triangulation.
    """


class _CutVertices(NamedTuple):
    """The consecutive vertices of a convex polygon that a bisector cuts off, as rows of `Workspace.vertices`.

    The last row is followed by the first one, so that `last` may be smaller than `first`.
    """

    before: int
    """The vertex before those that are cut off."""
    first: int
    """The first vertex that is cut off."""
    last: int
    """The last vertex that is cut off."""
    after: int
    """The vertex after those that are cut off; `_NO_VERTEX` if all vertices are cut off."""


class CellArrays(NamedTuple):
    """Results for n cells, for density 1."""

    masses: FloatArray
    """(n,) Area of each cell, m²."""
    centroids: FloatArray
    """(n, 2) Centroid of each cell, m."""
    edges: FloatArray
    """(e, 6) Edges of all cells; for the columns, see the constants `EDGE_...`."""


@kernel
def create_workspace(robot_count: int, side_count: int) -> Workspace:
    """Allocate the scratch space for the cells of a team in a region.

    Parameters
    ----------
    robot_count : int
        Number of robots of the team.
    side_count : int
        Number of sides of the region.

    Returns
    -------
    Workspace
    """
    # Each cut adds at most one vertex. Two more are spare.
    max_vertices = side_count + robot_count + 2
    return Workspace(
        vertices=np.empty((max_vertices, _VERTEX_COLUMNS)),
        new_vertices=np.empty((max_vertices, _VERTEX_COLUMNS)),
        neighbors=np.empty((robot_count, _NEIGHBOR_COLUMNS)),
    )


@inlined_kernel
def add_neighbor(neighbors: FloatArray, count: int, dx: float, dy: float, robot: int) -> int:
    """Append a neighbor to the list of neighbors that may bound a cell.

    A neighbor at the position of the generator is left out, because there is no bisector between the two.

    Parameters
    ----------
    neighbors : (n, 4) array
        The list, which is changed in place; see `Workspace`.
    count : int
        Number of neighbors in the list so far.
    dx, dy : float, m
        Offset of the neighbor from the generator.
    robot : int
        Index of the neighbor.

    Returns
    -------
    int
        The new number of neighbors in the list.
    """
    write_neighbor(neighbors, count, dx, dy, robot)
    return count + 1 if neighbors[count, SQUARED_DISTANCE] > 0.0 else count


@inlined_kernel
def write_neighbor(neighbors: FloatArray, row: int, dx: float, dy: float, robot: int) -> None:
    """Write a neighbor to a row of the list of neighbors that may bound a cell.

    Parameters
    ----------
    neighbors : (n, 4) array
        The list, which is changed in place; see `Workspace`.
    row : int
        Row of the list.
    dx, dy : float, m
        Offset of the neighbor from the generator.
    robot : int
        Index of the neighbor.
    """
    neighbors[row, DX] = dx
    neighbors[row, DY] = dy
    neighbors[row, SQUARED_DISTANCE] = dx * dx + dy * dy
    neighbors[row, ROBOT] = robot


@inlined_kernel
def clip_cell(
    workspace: Workspace, neighbor_count: int, points: FloatArray, sides: FloatArray, i: int
) -> VertexRange:
    """Compute the cell of robot i: clip the region along the bisectors between the robot and its neighbors.

    Parameters
    ----------
    workspace : Workspace
        Contains the neighbors of the robot in the first rows of `neighbors`. They are reordered. Its vertices
        are overwritten.
    neighbor_count : int
        Number of neighbors of the robot.
    points : (n, 2) array, m
        The generators.
    sides : (k, 5) array
        The region, as `Region.sides`.
    i : int
        Index of the robot.

    Returns
    -------
    VertexRange
        Location of the vertices of the cell in the workspace.
    """
    vertices = workspace.vertices
    new_vertices = workspace.new_vertices
    neighbor_rows = workspace.neighbors
    # At first, the cell is the whole region. The nearest neighbors cut it first, so that few of the others
    # can still cut it.
    count = len(sides)
    for k in range(count):
        vertices[k, X] = sides[k, SIDE_X] - points[i, 0]
        vertices[k, Y] = sides[k, SIDE_Y] - points[i, 1]
        vertices[k, OTHER_CELL] = REGION
    squared_range = _compute_squared_range(vertices, count)
    for row in range(neighbor_count):
        is_sorted = row < _SORTED_NEIGHBORS
        if is_sorted:
            _move_nearest_to(neighbor_rows, row, neighbor_count)
        if neighbor_rows[row, SQUARED_DISTANCE] <= squared_range:
            new_count = _cut_polygon(vertices, new_vertices, count, neighbor_rows, row)
            if new_count != _NOT_CUT:
                count = new_count
                _copy_vertices(new_vertices, vertices, count)
                squared_range = _compute_squared_range(vertices, count)
        elif is_sorted:
            # This is the nearest of the remaining neighbors. If it is too far away, so are all others.
            break
    return VertexRange(vertex_count=count, start=0)


@inlined_kernel
def _copy_vertices(source: FloatArray, target: FloatArray, count: int) -> None:
    """Copy the first `count` vertices."""
    for k in range(count):
        for column in range(_VERTEX_COLUMNS):
            target[k, column] = source[k, column]


@inlined_kernel
def _compute_squared_range(vertices: FloatArray, count: int) -> float:
    """Return the square of the largest distance at which a neighbor can cut the cell, m².

    The bisector is half as far away from the generator as the neighbor. It can cut the cell only if the
    neighbor is at most twice as far away as the farthest vertex.
    """
    squared_range = 0.0
    for k in range(count):
        x = vertices[k, X]
        y = vertices[k, Y]
        squared_range = max(squared_range, 2.0**2 * (x * x + y * y))
    return squared_range


@inlined_kernel
def _move_nearest_to(neighbor_rows: FloatArray, row: int, count: int) -> None:
    """Swap the neighbor in a row with the nearest of the neighbors in this and all later rows."""
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
def _cut_polygon(
    vertices: FloatArray, new_vertices: FloatArray, count: int, neighbor_rows: FloatArray, row: int
) -> int:
    """Cut a convex polygon along the bisector between the generator and the neighbor in a row.

    The part that is nearer to the generator is written to `new_vertices`: the vertices beyond the bisector
    are replaced by the two points where the outline crosses the bisector. A new edge along the bisector
    connects these points, with the cell of the neighbor on the other side.

    Return the new number of vertices, or `_NOT_CUT`, without writing anything, if no vertex is beyond the
    bisector.
    """
    _write_excess(vertices, count, neighbor_rows, row)
    farthest = _find_farthest_vertex(vertices, count)
    if farthest == _NO_VERTEX:
        return _NOT_CUT
    cut = _find_cut_vertices(vertices, count, farthest)
    if cut.after == _NO_VERTEX:
        # The whole polygon is beyond the bisector.
        return 0
    # Copy the vertices that remain.
    new_count = 0
    k = cut.after
    while k != cut.first:
        for column in (X, Y, OTHER_CELL):
            new_vertices[new_count, column] = vertices[k, column]
        new_count += 1
        k = _get_next_vertex(k, count)
    # The new edge starts where the outline leaves the generator's side of the bisector: at the vertex that
    # was copied last, if it is on the bisector, and otherwise at a new vertex.
    robot = neighbor_rows[row, ROBOT]
    if vertices[cut.before, _EXCESS] == 0.0:
        new_vertices[new_count - 1, OTHER_CELL] = robot
    else:
        _add_crossing(vertices, new_vertices, new_count, cut.before, cut.first, robot)
        new_count += 1
    # The new edge ends where the outline returns: at the vertex that was copied first, if it is on the
    # bisector, and otherwise at a new vertex, where the rest of an edge of the old outline starts.
    if vertices[cut.after, _EXCESS] < 0.0:
        other_cell = vertices[cut.last, OTHER_CELL]
        _add_crossing(vertices, new_vertices, new_count, cut.after, cut.last, other_cell)
        new_count += 1
    return new_count


@inlined_kernel
def _find_cut_vertices(vertices: FloatArray, count: int, farthest: int) -> _CutVertices:
    """Return the consecutive vertices with a positive excess around `farthest`, which is one of them.

    Because the polygon is convex, there are no others, unless rounding separates some from these. Such
    vertices are not cut off.
    """
    last = farthest
    next_vertex = _get_next_vertex(last, count)
    while next_vertex != farthest and vertices[next_vertex, _EXCESS] > 0.0:
        last = next_vertex
        next_vertex = _get_next_vertex(last, count)
    first = farthest
    previous = _get_previous_vertex(first, count)
    if next_vertex == farthest:
        return _CutVertices(previous, first, last, _NO_VERTEX)
    while vertices[previous, _EXCESS] > 0.0:
        first = previous
        previous = _get_previous_vertex(first, count)
    return _CutVertices(previous, first, last, next_vertex)


@inlined_kernel
def _get_next_vertex(k: int, count: int) -> int:
    """Return the vertex after vertex k of a polygon with `count` vertices."""
    return k + 1 if k + 1 < count else 0


@inlined_kernel
def _get_previous_vertex(k: int, count: int) -> int:
    """Return the vertex before vertex k of a polygon with `count` vertices."""
    return k - 1 if k > 0 else count - 1


@inlined_kernel
def _write_excess(vertices: FloatArray, count: int, neighbor_rows: FloatArray, row: int) -> None:
    """Write the excess of each vertex over the bisector to a neighbor to the column `_EXCESS`.

    The excess of a vertex q is q · d - |d|²/2, where d is the offset of the neighbor from the generator. It
    is proportional to the signed distance of the vertex from the bisector, and positive if the vertex is
    nearer to the neighbor.
    """
    dx = neighbor_rows[row, DX]
    dy = neighbor_rows[row, DY]
    half_squared_distance = 0.5 * neighbor_rows[row, SQUARED_DISTANCE]
    for k in range(count):
        vertices[k, _EXCESS] = vertices[k, X] * dx + vertices[k, Y] * dy - half_squared_distance


@inlined_kernel
def _find_farthest_vertex(vertices: FloatArray, count: int) -> int:
    """Return the vertex farthest beyond the current bisector, or `_NO_VERTEX` if none is beyond it."""
    farthest = _NO_VERTEX
    max_excess = 0.0
    for k in range(count):
        if vertices[k, _EXCESS] > max_excess:
            farthest = k
            max_excess = vertices[k, _EXCESS]
    return farthest


@inlined_kernel
def _add_crossing(
    vertices: FloatArray, new_vertices: FloatArray, new_row: int, inner: int, outer: int, other_cell: float
) -> None:
    """Add a vertex to `new_vertices` at the point where an edge of the polygon crosses the current bisector.

    The edge connects the vertex `inner`, on the generator's side of the bisector, with the vertex `outer` on
    the other side. The crossing is found by linear interpolation between their excesses, which are
    proportional to their signed distances from the bisector. It is written to row `new_row` of
    `new_vertices`. `other_cell` is the cell on the other side of the edge that starts at the new vertex.
    """
    inner_excess = vertices[inner, _EXCESS]
    fraction = inner_excess / (inner_excess - vertices[outer, _EXCESS])
    for column in (X, Y):
        step = vertices[outer, column] - vertices[inner, column]
        new_vertices[new_row, column] = vertices[inner, column] + fraction * step
    new_vertices[new_row, OTHER_CELL] = other_cell


@inlined_kernel
def write_cell(
    workspace: Workspace,
    vertex_range: VertexRange,
    points: FloatArray,
    i: int,
    cells: CellArrays,
    edge_count: int,
) -> int:
    """Write mass, centroid and edges of the cell of robot i, for density 1.

    Parameters
    ----------
    workspace : Workspace
        Scratch space that contains the vertices of the cell.
    vertex_range : VertexRange
        Location of these vertices in the workspace.
    points : (n, 2) array, m
        The generators.
    i : int
        Index of the robot.
    cells : CellArrays
        Arrays to which the results are written. Edges that do not fit are counted, but not written.
    edge_count : int
        Number of edges of the previous cells.

    Returns
    -------
    int
        Number of edges of all cells so far.
    """
    vertices = workspace.vertices
    edges = cells.edges
    # Twice the area and six times the first moments are sums over the triangles between edges and generator.
    doubled_area = 0.0
    moment_sum_x = 0.0
    moment_sum_y = 0.0
    k = vertex_range.start
    for edge in range(edge_count, edge_count + vertex_range.vertex_count):
        next_vertex = _get_next_vertex(k, vertex_range.vertex_count)
        start_x = vertices[k, X]
        start_y = vertices[k, Y]
        end_x = vertices[next_vertex, X]
        end_y = vertices[next_vertex, Y]
        cross = start_x * end_y - end_x * start_y
        doubled_area += cross
        moment_sum_x += cross * (start_x + end_x)
        moment_sum_y += cross * (start_y + end_y)
        if edge < len(edges):
            edges[edge, EDGE_START_X] = start_x
            edges[edge, EDGE_START_Y] = start_y
            edges[edge, EDGE_END_X] = end_x
            edges[edge, EDGE_END_Y] = end_y
            edges[edge, EDGE_CELL] = i
            edges[edge, EDGE_OTHER_CELL] = vertices[k, OTHER_CELL]
        k = next_vertex
    factor = 1.0 / (3.0 * doubled_area) if doubled_area > 0.0 else 0.0
    cells.masses[i] = max(0.5 * doubled_area, 0.0)
    cells.centroids[i, 0] = points[i, 0] + moment_sum_x * factor
    cells.centroids[i, 1] = points[i, 1] + moment_sum_y * factor
    return edge_count + vertex_range.vertex_count
