"""Cells from a Delaunay triangulation, whose edges connect robots with a common border."""

from typing import NamedTuple

import numpy as np

from robocov.compiled import inlined_kernel, kernel
from robocov.observation.region import SIDE_NORMAL_X, SIDE_NORMAL_Y, SIDE_OFFSET, SIDE_X, SIDE_Y
from robocov.typing import FloatArray, IntArray
from robocov.voronoi.clipping import (
    OTHER_CELL,
    CellArrays,
    VertexRange,
    Workspace,
    X,
    Y,
    clip_cell,
    create_workspace,
    write_cell,
    write_neighbor,
)
from robocov.voronoi.delaunay import (
    CORNER,
    TWIN,
    Mesh,
    get_next_half_edge,
    get_previous_half_edge,
    is_half_edge,
    update_triangulation,
)

FAILED = -1
"""Returned instead of a number of edges if the triangulation failed."""
_MAX_OFFSET_SIZES = 2.0
"""Maximum offset of a robot from the center of the region in x and y, as a multiple of the region's size.

The sentinels are at least 9 sizes away from the center. Robots within these offsets lie in the triangle of
the sentinels, and are nearer than any sentinel to every point of the region, so that no sentinel cuts a cell.
"""
_AREA_TOLERANCE = 1e-12
"""Maximum difference between the total area of the cells and the area of the region that may be due to
rounding, as a fraction of the area of the region."""


class Triangulation(NamedTuple):
    """A Delaunay triangulation of n robots and three sentinels."""

    mesh: Mesh
    """(2, 8 n + 4) Corners and twins of the half-edges."""
    cotangents: FloatArray
    """(8 n + 4,) Cotangent of the angle opposite to each half-edge."""
    half_edges: IntArray
    """(n + 3,) A half-edge that starts at each robot and each sentinel."""


class _Fan(NamedTuple):
    """The triangles around a robot, counter-clockwise."""

    neighbor_count: int
    """Number of neighbors, and of Voronoi vertices."""
    half_edge_to_lowest: int
    """Half-edge that leads to the neighbor with the lowest index among the robots."""
    lowest_position: int
    """Position of this neighbor in the order of the triangles."""
    max_squared_distance: float
    """Squared distance of the farthest Voronoi vertex from the robot, m²; infinite if robots alone do not
    bound the cell."""


@kernel
def compute_triangulated_cells(points: FloatArray, sides: FloatArray, mesh: Mesh, cells: CellArrays) -> int:
    """Compute all cells from a Delaunay triangulation.

    If a robot lacks a neighbor in the triangulation, its cell is too large. The cells are therefore correct
    if the sum of their areas is the area of the region.

    Parameters
    ----------
    points : (n, 2) array, m
        The generators.
    sides : (k, 5) array
        The region, as `Region.sides`.
    mesh : (2, 8 n + 4) int32 array
        Triangulation of a previous partition, if there is one; see `update_triangulation`. Changed in place.
    cells : CellArrays
        Overwritten by the cells.

    Returns
    -------
    int
        Number of edges of all cells, or `FAILED`. The triangulation may fail if robots coincide.
    """
    # Three distant sentinels are triangulated together with the robots.
    half_edges = np.empty(len(points) + 3, np.intp)
    triangulation = Triangulation(mesh, np.empty(mesh.shape[1]), half_edges)
    if not _triangulate(triangulation, points, sides):
        return FAILED
    workspace = create_workspace(len(points), len(sides))
    edge_count = 0
    total_area = 0.0
    for i in range(len(points)):
        vertex_range = _find_cell(workspace, triangulation, points, sides, i)
        edge_count = write_cell(workspace, vertex_range, points, i, cells, edge_count)
        total_area += cells.masses[i]
    region_area = _compute_region_area(sides)
    is_complete = abs(total_area - region_area) <= _AREA_TOLERANCE * region_area
    return edge_count if is_complete else FAILED


@kernel
def _triangulate(triangulation: Triangulation, points: FloatArray, sides: FloatArray) -> bool:
    """Build the Delaunay triangulation of the robots and three sentinels; return whether it succeeded.

    The sentinels are distant points, which form a triangle around all robots and the region. `sides` are the
    sides of the region. The triangulation fails if rounding makes its triangles inconsistent, or if a robot
    is so far outside the region that the cell of a sentinel could reach into the region.
    """
    n = len(points)
    x, y, size = _compute_center_and_size(sides)
    vertices = np.empty((n + 3, 2))
    for i in range(n):
        vertices[i, 0] = points[i, 0]
        vertices[i, 1] = points[i, 1]
        if max(abs(points[i, 0] - x), abs(points[i, 1] - y)) > _MAX_OFFSET_SIZES * size:
            return False
    _place_sentinels(vertices[n:], x, y, size)
    mesh = triangulation.mesh
    half_edges = triangulation.half_edges
    stack = np.empty(mesh.shape[1], np.intp)
    if not update_triangulation(mesh, vertices, triangulation.cotangents, stack):
        return False
    # Store a half-edge that starts at each point. It does not matter which one.
    for h in range(mesh.shape[1]):
        if is_half_edge(h):
            half_edges[mesh[CORNER, h]] = h
    return True


@inlined_kernel
def _place_sentinels(sentinels: FloatArray, x: float, y: float, size: float) -> None:
    """Write the sentinels, a large triangle around the region's center (x, y); see `_MAX_OFFSET_SIZES`."""
    sentinels[0, 0] = x - 8.0 * size
    sentinels[0, 1] = y - 5.0 * size
    sentinels[1, 0] = x + 8.0 * size
    sentinels[1, 1] = y - 5.0 * size
    sentinels[2, 0] = x
    sentinels[2, 1] = y + 9.0 * size


@kernel
def _compute_center_and_size(sides: FloatArray) -> tuple[float, float, float]:
    """Return the center of the region's bounding box, and the region's size: its width plus its height, m."""
    left = sides[0, SIDE_X]
    right = sides[0, SIDE_X]
    low = sides[0, SIDE_Y]
    high = sides[0, SIDE_Y]
    for k in range(1, len(sides)):
        left = min(left, sides[k, SIDE_X])
        right = max(right, sides[k, SIDE_X])
        low = min(low, sides[k, SIDE_Y])
        high = max(high, sides[k, SIDE_Y])
    return 0.5 * (left + right), 0.5 * (low + high), right - left + high - low


@kernel
def _compute_region_area(sides: FloatArray) -> float:
    """Return the area of the region, m², by the shoelace formula.

    The coordinates of the vertices, at which the sides start, are taken relative to the center of the region
    to reduce rounding errors.
    """
    center_x, center_y, _ = _compute_center_and_size(sides)
    area = 0.0
    for k in range(len(sides)):
        next_side = k + 1 if k + 1 < len(sides) else 0
        area += 0.5 * (
            (sides[k, SIDE_X] - center_x) * (sides[next_side, SIDE_Y] - center_y)
            - (sides[next_side, SIDE_X] - center_x) * (sides[k, SIDE_Y] - center_y)
        )
    return area


@inlined_kernel
def _find_cell(
    workspace: Workspace, triangulation: Triangulation, points: FloatArray, sides: FloatArray, i: int
) -> VertexRange:
    """Find the cell of robot i from the triangles around it.

    The neighbors of the robot are the other corners of these triangles, and the vertices of its cell are the
    circumcenters of the triangles. If the cell may extend beyond the region, the region is clipped along the
    bisectors to these neighbors instead.
    """
    fan = _walk_around(workspace, triangulation, points, i, triangulation.half_edges[i])
    clearance = _compute_clearance(sides, points[i, 0], points[i, 1])
    # In both cases below, the cell starts at the neighbor with the lowest index, so that its last bits do not
    # depend on the triangle at which the walk starts.
    is_within_region = clearance > 0.0 and fan.max_squared_distance < clearance * clearance
    if is_within_region:
        return VertexRange(vertex_count=fan.neighbor_count, start=fan.lowest_position)
    fan = _walk_around(workspace, triangulation, points, i, fan.half_edge_to_lowest)
    return clip_cell(workspace, fan.neighbor_count, points, sides, i)


@inlined_kernel
def _compute_clearance(sides: FloatArray, x: float, y: float) -> float:
    """Return the distance of (x, y) from the nearest side of the region, negative outside, m."""
    clearance = np.inf
    for k in range(len(sides)):
        distance = sides[k, SIDE_OFFSET] - (sides[k, SIDE_NORMAL_X] * x + sides[k, SIDE_NORMAL_Y] * y)
        clearance = min(clearance, distance)
    return clearance


@inlined_kernel
def _walk_around(
    workspace: Workspace, triangulation: Triangulation, points: FloatArray, i: int, first_half_edge: int
) -> _Fan:
    """Write the neighbors and Voronoi vertices of robot i to the workspace, counter-clockwise.

    The walk visits the half-edges that start at the robot, from `first_half_edge` on. Each leads to a
    neighbor j, and belongs to a triangle, whose circumcenter is a Voronoi vertex. All coordinates are
    relative to the robot. Points with an index of n or more are sentinels, not neighbors.
    """
    mesh = triangulation.mesh
    vertices = workspace.vertices
    n = len(points)
    count = 0
    lowest_robot = n
    half_edge_to_lowest = first_half_edge
    lowest_position = 0
    max_squared_distance = 0.0
    h = first_half_edge
    while True:
        previous = get_previous_half_edge(h)
        j = mesh[CORNER, get_next_half_edge(h)]
        if j < n:
            if j < lowest_robot:
                lowest_robot = j
                half_edge_to_lowest = h
                lowest_position = count
            dx = points[j, 0] - points[i, 0]
            dy = points[j, 1] - points[i, 1]
            x, y = _compute_voronoi_vertex(dx, dy, triangulation.cotangents[h])
            max_squared_distance = max(max_squared_distance, x * x + y * y)
            vertices[count, X] = x
            vertices[count, Y] = y
            # The edge from this Voronoi vertex to the next one borders on the cell of the triangle's third
            # corner.
            vertices[count, OTHER_CELL] = mesh[CORNER, previous]
            write_neighbor(workspace.neighbors, count, dx, dy, j)
            count += 1
        else:
            # Robot i is connected to a sentinel, so that other robots alone do not bound its cell.
            max_squared_distance = np.inf
        # Turn to the next triangle counter-clockwise.
        h = mesh[TWIN, previous]
        if h == first_half_edge:
            return _Fan(
                neighbor_count=count,
                half_edge_to_lowest=half_edge_to_lowest,
                lowest_position=lowest_position,
                max_squared_distance=max_squared_distance,
            )


@inlined_kernel
def _compute_voronoi_vertex(dx: float, dy: float, cotangent: float) -> tuple[float, float]:
    """Return the circumcenter of a triangle relative to one of its corners, m.

    An edge of the triangle leads from this corner to the next one counter-clockwise, which is at the offset
    (dx, dy). `cotangent` is that of the angle opposite to the edge. The circumcenter lies on the bisector of
    the edge, to its left by half the length of the edge times the cotangent.
    """
    return 0.5 * (dx - cotangent * dy), 0.5 * (dy + cotangent * dx)
