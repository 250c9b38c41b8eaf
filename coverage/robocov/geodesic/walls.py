"""The walls of a map in grid coordinates, and the corners where shortest paths can bend."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
import shapely
from shapely import MultiPolygon

from robocov.compiled import kernel
from robocov.geodesic.box_tree import (
    END_OF_TREE,
    HIGH_X,
    HIGH_Y,
    LEAF_SIZE,
    LOW_Y,
    ROOT,
    Z_ORDER_BITS,
    build_box_tree,
    compute_z_order,
    get_first_child,
    get_first_item,
    is_leaf,
    skip_subtree,
)
from robocov.geodesic.integer_grid import GRID_BITS, compute_crosses, cross
from robocov.typing import BoolArray, FloatArray, IntArray

START_X = 0
"""Column of `Walls.ends`: x of the start of a wall."""
START_Y = 1
"""Column of `Walls.ends`: y of the start."""
END_X = 2
"""Column of `Walls.ends`: x of the end."""
END_Y = 3
"""Column of `Walls.ends`: y of the end."""
INCOMING_X = 0
"""Column of `Walls.sector_walls` and `Walls.corner_walls`: x of the direction of the incoming wall."""
INCOMING_Y = 1
"""Column of the same arrays: y of the direction of the incoming wall."""
OUTGOING_X = 2
"""Column of the same arrays: x of the direction of the outgoing wall."""
OUTGOING_Y = 3
"""Column of the same arrays: y of the direction of the outgoing wall."""

NO_WALL = -1
"""Used in place of a wall if there is none, or if there are several next walls to choose from."""
NO_VERTEX = -1
"""Used in place of a vertex if a point does not coincide with any."""

_ON_BOUNDARY = 1000
"""Contribution of a wall to the winding number of a point on it, which makes that number larger than 1."""


class Walls(NamedTuple):
    """The boundary of a free space for kernels, in grid steps.

    A *wall* is an edge of the free space, directed so that the free space is on its left. It is the outgoing
    wall of the vertex where it starts, and the incoming wall of the vertex where it ends. A *sector* is a
    wedge of free space at a vertex, between an outgoing wall and the next incoming wall counter-clockwise.
    There is usually one per vertex, but several at a pinch, a vertex where walls touch. A *corner* is a
    sector wider than half a turn; a shortest path can bend only there. At a pinch, a sector of exactly half a
    turn is a corner too. A vertex has at most one corner.
    """

    ends: FloatArray
    """(w, 4) Start and end of each wall; for the columns, see `START_X`. The walls are sorted so that nearby
    ones have nearby indices."""
    next_walls: IntArray
    """(w,) The wall that starts where each wall ends, or `NO_WALL` if several do."""
    components: IntArray
    """(w,) The component of the free space that each wall bounds."""
    can_hide_free_space: BoolArray
    """(w,) Whether free space can be behind each wall; false for walls on the convex hull of the map."""
    tree: FloatArray
    """The box tree of the walls."""
    vertices: FloatArray
    """(v, 2) Vertices, sorted by x, then by y."""
    sector_starts: IntArray
    """(v + 1,) The sectors of vertex k are those from ``sector_starts[k]`` up to ``sector_starts[k + 1]``."""
    sector_walls: FloatArray
    """(s, 4) Directions of the incoming and the outgoing wall of each sector; for the columns, see
    `INCOMING_X`."""
    sector_is_corner: BoolArray
    """(s,) Whether each sector is a corner."""
    corners: FloatArray
    """(k, 2) Positions of the corners, sorted so that nearby ones have nearby indices."""
    corner_walls: FloatArray
    """(k, 4) Directions of the incoming and the outgoing wall of each corner, like `sector_walls`."""
    corner_tree: FloatArray
    """The box tree of the corners."""


class _Segments(NamedTuple):
    """Walls as pairs of vertices."""

    vertices: FloatArray
    """(v, 2) grid steps, sorted by x, then by y."""
    starts: IntArray
    """(w,) Index of the vertex where each wall starts."""
    ends: IntArray
    """(w,) Index of the vertex where each wall ends."""
    components: IntArray
    """(w,) The component of the free space that each wall bounds."""


class _Sectors(NamedTuple):
    """Wedges of free space at the vertices, sorted by vertex."""

    vertices: IntArray
    """(s,) Index of the vertex of each sector."""
    incoming_starts: IntArray
    """(s,) Index of the vertex where the incoming wall starts."""
    outgoing_ends: IntArray
    """(s,) Index of the vertex where the outgoing wall ends."""


def build_walls(free: MultiPolygon) -> Walls:
    """Build the walls, sectors and corners of a free space; see `Walls`.

    Parameters
    ----------
    free : shapely.MultiPolygon, grid steps
        One polygon for each component, with counter-clockwise shells and clockwise holes.

    Returns
    -------
    Walls
    """
    segments = _list_segments(free)
    vertices = segments.vertices
    sectors = _find_sectors(segments)
    sector_points = vertices[sectors.vertices]
    incoming = sector_points - vertices[sectors.incoming_starts]
    outgoing = vertices[sectors.outgoing_ends] - sector_points
    sector_walls = np.hstack([incoming, outgoing])
    is_corner = _find_corners(sectors.vertices, incoming, outgoing)
    corners = sector_points[is_corner]
    corner_order = _compute_spatial_order(corners)
    corners = corners[corner_order]

    segments = _sort_spatially(segments)
    start_points = vertices[segments.starts]
    end_points = vertices[segments.ends]
    return Walls(
        ends=np.hstack([start_points, end_points]),
        next_walls=_find_next_walls(segments),
        components=segments.components,
        # There is no free space behind a wall on the convex hull of the map, so that it hides nothing.
        can_hide_free_space=~_find_hull_walls(segments),
        tree=build_box_tree(np.minimum(start_points, end_points), np.maximum(start_points, end_points)),
        vertices=vertices,
        sector_starts=np.searchsorted(sectors.vertices, np.arange(len(vertices) + 1)),
        sector_walls=sector_walls,
        sector_is_corner=is_corner,
        corners=corners,
        corner_walls=sector_walls[is_corner][corner_order],
        corner_tree=build_box_tree(corners, corners),
    )


def _list_segments(free: MultiPolygon) -> _Segments:
    """List the walls in the order of the rings that bound the free space."""
    rings, ring_components = shapely.get_rings(free.geoms, return_index=True)
    points, point_rings = shapely.get_coordinates(rings, return_index=True)
    # A wall starts at each point of a ring except the last one, which repeats the first.
    start_rows = np.flatnonzero(point_rings[1:] == point_rings[:-1])
    vertices, point_vertices = np.unique(points, axis=0, return_inverse=True)
    point_vertices = point_vertices.reshape(-1)
    starts = point_vertices[start_rows]
    ends = point_vertices[start_rows + 1]
    components = ring_components[point_rings[start_rows]]
    # Snapping to the grid may have merged the two ends of a wall.
    has_length = starts != ends
    return _Segments(vertices, starts[has_length], ends[has_length], components[has_length])


def _sort_spatially(segments: _Segments) -> _Segments:
    """Return the walls, sorted so that nearby ones have nearby indices."""
    middles = (segments.vertices[segments.starts] + segments.vertices[segments.ends]) / 2.0
    order = _compute_spatial_order(middles)
    return _Segments(
        vertices=segments.vertices,
        starts=segments.starts[order],
        ends=segments.ends[order],
        components=segments.components[order],
    )


def _compute_spatial_order(points: FloatArray) -> IntArray:
    """Return the indices that sort (n, 2) points, in grid steps, along a Z-order curve."""
    # The highest bits of the coordinates say in which cell of a coarse grid a point is.
    cells = (points * 2.0 ** (Z_ORDER_BITS - GRID_BITS)).clip(0, 2**Z_ORDER_BITS - 1).astype(np.int64)
    return np.argsort(compute_z_order(cells[:, 0], cells[:, 1]), kind="stable")


def _find_sectors(segments: _Segments) -> _Sectors:
    """Find the sectors: the pairs of incoming and outgoing walls that bound the same wedge of free space.

    An incoming wall ends at a vertex, and an outgoing wall starts there; both have free space on their left.
    At most vertices there is one of each. At a pinch, where walls touch, there are several, and each outgoing
    wall is paired with the next incoming wall counter-clockwise.
    """
    vertices = segments.vertices
    # As many walls start at a vertex as end there. Both orders therefore have the same vertex in each row.
    by_start = np.argsort(segments.starts, kind="stable")
    by_end = np.argsort(segments.ends, kind="stable")
    sector_vertices = segments.starts[by_start]
    outgoing_ends = segments.ends[by_start]
    incoming_starts = segments.starts[by_end].copy()
    counts = np.bincount(sector_vertices, minlength=len(vertices))
    first_rows = np.cumsum(counts) - counts
    for pinch in np.flatnonzero(counts > 1):
        rows = slice(first_rows[pinch], first_rows[pinch] + counts[pinch])
        outgoing_angles = _compute_angles(vertices[outgoing_ends[rows]] - vertices[pinch])
        incoming_angles = _compute_angles(vertices[incoming_starts[rows]] - vertices[pinch])
        # Row i contains the angles from outgoing wall i, counter-clockwise, to the incoming walls.
        turns = (incoming_angles - outgoing_angles[:, None]) % (2.0 * np.pi)
        incoming_starts[rows] = incoming_starts[rows][turns.argmin(axis=1)]
    return _Sectors(sector_vertices, incoming_starts, outgoing_ends)


def _compute_angles(vectors: FloatArray) -> FloatArray:
    """Return the angles of (n, 2) vectors, (n,) rad."""
    return np.asarray(np.arctan2(vectors[:, 1], vectors[:, 0]))


def _find_corners(sector_vertices: IntArray, incoming: FloatArray, outgoing: FloatArray) -> BoolArray:
    """Find the sectors that are corners, given their vertices and the directions of their walls.

    A sector, the wedge of free space between an incoming and an outgoing wall, is a corner if it is wider
    than half a turn. The outgoing wall then turns right from the incoming one: their cross product is
    negative.
    """
    crosses = compute_crosses(incoming, outgoing)
    is_pinch = np.bincount(sector_vertices)[sector_vertices] > 1
    # At a pinch, a sector of exactly half a turn is a corner too. Otherwise a path straight along its walls
    # would be blocked there by the walls of the other sectors.
    return np.asarray((crosses < 0.0) | ((crosses == 0.0) & is_pinch))


def _find_next_walls(segments: _Segments) -> IntArray:
    """Find the wall that starts where each wall ends, or `NO_WALL` if several do."""
    vertex_count = len(segments.vertices)
    outgoing_walls = np.full(vertex_count, NO_WALL)
    outgoing_walls[segments.starts] = np.arange(len(segments.starts))
    is_unique = np.bincount(segments.starts, minlength=vertex_count)[segments.ends] == 1
    return np.where(is_unique, outgoing_walls[segments.ends], NO_WALL)


def _find_hull_walls(segments: _Segments) -> BoolArray:
    """Find the walls that lie on the convex hull of all vertices."""
    vertices = segments.vertices
    hull = shapely.get_coordinates(shapely.convex_hull(shapely.multipoints(vertices)))
    is_on_hull = np.zeros(len(segments.starts), dtype=bool)
    for start, end in pairwise(hull):
        side = np.broadcast_to(end - start, vertices.shape)
        is_on_side = compute_crosses(side, vertices - start) == 0.0
        is_on_hull |= is_on_side[segments.starts] & is_on_side[segments.ends]
    return is_on_hull


@kernel
def get_relative_ends(ends: FloatArray, wall: int, x: float, y: float) -> tuple[float, float, float, float]:
    """Return the ends of a wall relative to a point.

    Parameters
    ----------
    ends : (w, 4) array, grid steps
        The ends of all walls; see `Walls`.
    wall : int
        Index of the wall.
    x, y : float, grid steps
        The point.

    Returns
    -------
    start_x, start_y, end_x, end_y : float, grid steps
        Offsets from the point to the start and to the end of the wall.
    """
    return ends[wall, START_X] - x, ends[wall, START_Y] - y, ends[wall, END_X] - x, ends[wall, END_Y] - y


@kernel
def can_bend_at_corner(
    corners: FloatArray, corner_walls: FloatArray, corner: int, x: float, y: float
) -> bool:
    """Return whether a shortest path that bends at a corner can come straight from a point, or go there.

    A corner is a wedge of free space wider than half a turn, between an incoming and an outgoing wall with
    free space on their left. The point must lie in this wedge, but not on the free side of both walls: from
    there, a path that bends at the corner could be shortened.

    Parameters
    ----------
    corners : (k, 2) array, grid steps
        Positions of all corners.
    corner_walls : (k, 4) array, grid steps
        Directions of the walls that meet at each corner; see `Walls`.
    corner : int
        Index of the corner.
    x, y : float, grid steps
        The point.

    Returns
    -------
    bool
    """
    dx = x - corners[corner, 0]
    dy = y - corners[corner, 1]
    incoming_side = cross(corner_walls[corner, INCOMING_X], corner_walls[corner, INCOMING_Y], dx, dy)
    outgoing_side = cross(corner_walls[corner, OUTGOING_X], corner_walls[corner, OUTGOING_Y], dx, dy)
    is_in_wedge = incoming_side >= 0.0 or outgoing_side >= 0.0
    is_behind_a_wall = incoming_side <= 0.0 or outgoing_side <= 0.0
    return is_in_wedge and is_behind_a_wall


@kernel
def find_vertex(vertices: FloatArray, x: float, y: float) -> int:
    """Find the vertex that a point coincides with.

    Parameters
    ----------
    vertices : (v, 2) array, grid steps
        All vertices, sorted by x, then by y.
    x, y : float, grid steps
        The point.

    Returns
    -------
    int
        Index of the vertex, or `NO_VERTEX`.
    """
    # Binary search for the first vertex that is not before the point in the order.
    low = 0
    high = len(vertices)
    while low < high:
        middle = (low + high) // 2
        if vertices[middle, 0] < x or (vertices[middle, 0] == x and vertices[middle, 1] < y):
            low = middle + 1
        else:
            high = middle
    if low < len(vertices) and vertices[low, 0] == x and vertices[low, 1] == y:
        return low
    return NO_VERTEX


@kernel
def contains_direction(walls: Walls, vertex: int, dx: float, dy: float) -> bool:
    """Return whether a direction from a vertex leads into the free space or along a wall.

    The free space at a vertex consists of sectors, each to the left of an incoming and an outgoing wall. In a
    sector of up to half a turn, the direction must be to the left of both walls. In a corner, which is wider,
    it is enough to be to the left of one of them.

    Parameters
    ----------
    walls : Walls
    vertex : int
        Index of the vertex.
    dx, dy : float
        The direction, as a vector of any length.

    Returns
    -------
    bool
    """
    sectors = walls.sector_walls
    for sector in range(walls.sector_starts[vertex], walls.sector_starts[vertex + 1]):
        incoming_side = cross(sectors[sector, INCOMING_X], sectors[sector, INCOMING_Y], dx, dy)
        outgoing_side = cross(sectors[sector, OUTGOING_X], sectors[sector, OUTGOING_Y], dx, dy)
        is_left_of_incoming = incoming_side >= 0.0
        is_left_of_outgoing = outgoing_side >= 0.0
        if is_left_of_incoming and is_left_of_outgoing:
            return True
        if walls.sector_is_corner[sector] and (is_left_of_incoming or is_left_of_outgoing):
            return True
    return False


@kernel
def count_windings(walls: Walls, points: FloatArray, windings: IntArray) -> None:
    """Compute the winding number of the boundary of each component of the free space around points.

    The winding number is the number of walls to the right of a point that run up, minus the number of those
    that run down. A search in the box tree visits only walls at the height of the point that are not entirely
    to its left.

    Parameters
    ----------
    walls : Walls
    points : (n, 2) array, grid steps
    windings : (n, c) int array
        Result: for each point and component, 1 inside the component, more than 1 on its boundary, 0 outside.
    """
    tree = walls.tree
    for i in range(len(points)):
        x = points[i, 0]
        y = points[i, 1]
        for component in range(windings.shape[1]):
            windings[i, component] = 0
        node = ROOT
        while node != END_OF_TREE:
            if tree[node, LOW_Y] > y or tree[node, HIGH_Y] < y or tree[node, HIGH_X] < x:
                node = skip_subtree(node)
            elif not is_leaf(tree, node):
                node = get_first_child(node)
            else:
                first_wall = get_first_item(tree, node)
                for wall in range(first_wall, min(first_wall + LEAF_SIZE, len(walls.ends))):
                    windings[i, walls.components[wall]] += _count_winding(walls.ends, wall, x, y)
                node = skip_subtree(node)


@kernel
def _count_winding(ends: FloatArray, wall: int, x: float, y: float) -> int:
    """Return the contribution of a wall to the winding number of a point.

    It is 1 if the wall runs up to the right of the point, -1 if it runs down there, `_ON_BOUNDARY` if the
    point is on the wall, and otherwise 0. The lower end of a wall counts, but not its upper end, so that no
    vertex counts twice.
    """
    ax = ends[wall, START_X]
    ay = ends[wall, START_Y]
    bx = ends[wall, END_X]
    by = ends[wall, END_Y]
    if min(ay, by) > y or max(ay, by) < y or max(ax, bx) < x:
        return 0
    side = cross(bx - ax, by - ay, x - ax, y - ay)
    if side == 0.0 and min(ax, bx) <= x:
        return _ON_BOUNDARY
    if ay <= y < by and side > 0.0:
        return 1
    if by <= y < ay and side < 0.0:
        return -1
    return 0
