"""The walls of a map in grid coordinates, and the corners where shortest paths can bend."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
import shapely
from shapely import MultiPolygon

from robocov.arrays import Array, BoolArray, IntArray
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
from robocov.geodesic.grid import GRID_BITS, compute_crosses, cross

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
"""Used in place of a wall where there is none, and of the following wall unless there is exactly one."""
NO_VERTEX = -1
"""Returned instead of a vertex if a point does not coincide with any."""

_ON_BOUNDARY = 1000
"""Contribution of a wall through a point to the point's winding number: more than any number of turns."""


class Walls(NamedTuple):
    """The boundary of a free space for kernels, in grid steps.

    A vertex where walls touch (a pinch) has several sectors: wedges of free space, each between an
    outgoing wall and the next incoming wall counter-clockwise. A *corner* is a sector wider than a
    half turn; a shortest path can bend only there. A sector of exactly half a turn is a corner too if
    other sectors share its vertex. A vertex has at most one corner.
    """

    ends: Array
    """(w, 4) Start and end of each wall, with the free space on its left; for the columns, see `START_X`. The
    walls are sorted so that nearby ones have nearby indices."""
    following: IntArray
    """(w,) The wall that starts where this one ends, or `NO_WALL` if several do."""
    component: IntArray
    """(w,) Component of the free space that the wall bounds."""
    can_hide_free_space: BoolArray
    """(w,) Whether free space can be behind the wall; false for walls on the convex hull of the map."""
    boxes: Array
    """The box tree of the walls."""
    vertices: Array
    """(v, 2) Vertices, sorted by x, then by y."""
    first_sector: IntArray
    """(v + 1,) The sectors of vertex k are those from ``first_sector[k]`` up to ``first_sector[k + 1]``."""
    sector_walls: Array
    """(s, 4) Directions of the incoming and the outgoing wall, with free space to their left; for the
    columns, see `INCOMING_X`."""
    sector_is_corner: BoolArray
    """(s,) Whether the sector is a corner."""
    corners: Array
    """(k, 2) Positions of the corners, sorted so that nearby ones have nearby indices."""
    corner_walls: Array
    """(k, 4) Directions of the incoming and the outgoing wall of each corner, like `sector_walls`."""
    corner_boxes: Array
    """The box tree of the corners."""


class _Segments(NamedTuple):
    """Walls as pairs of vertices."""

    vertices: Array
    """(v, 2) grid steps, sorted by x, then by y."""
    start: IntArray
    """(w,) The vertex where each wall starts."""
    end: IntArray
    """(w,) The vertex where each wall ends."""
    component: IntArray
    """(w,) Component of the free space that the wall bounds."""


class _Sectors(NamedTuple):
    """Wedges of free space at the vertices, sorted by vertex."""

    vertex: IntArray
    """(s,) The vertex of each sector."""
    incoming_start: IntArray
    """(s,) The vertex where the incoming wall starts."""
    outgoing_end: IntArray
    """(s,) The vertex where the outgoing wall ends."""


def build_walls(free: MultiPolygon) -> Walls:
    """Build the walls of a free space.

    A wall is an edge of the free space, which lies on its left. A sector is a wedge of free space at a
    vertex, between an incoming wall, which ends there, and an outgoing wall, which starts there. It is a
    corner, where a shortest path can bend, if it is wider than half a turn. Walls and corners are each sorted
    so that nearby ones are close together in memory, and get a tree of bounding boxes.

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
    incoming = vertices[sectors.vertex] - vertices[sectors.incoming_start]
    outgoing = vertices[sectors.outgoing_end] - vertices[sectors.vertex]
    sector_walls = np.hstack([incoming, outgoing])
    is_corner = _find_corners(sectors.vertex, incoming, outgoing)
    corners = vertices[sectors.vertex][is_corner]
    order = _compute_spatial_order(corners)
    corners = corners[order]

    segments = _sort_spatially(segments)
    starts = vertices[segments.start]
    ends = vertices[segments.end]
    return Walls(
        ends=np.hstack([starts, ends]),
        following=_find_following(segments),
        component=segments.component,
        # There is no free space behind a wall on the convex hull of the map, so that it hides nothing.
        can_hide_free_space=~_find_hull_walls(segments),
        boxes=build_box_tree(np.minimum(starts, ends), np.maximum(starts, ends)),
        vertices=vertices,
        first_sector=np.searchsorted(sectors.vertex, np.arange(len(vertices) + 1)),
        sector_walls=sector_walls,
        sector_is_corner=is_corner,
        corners=corners,
        corner_walls=sector_walls[is_corner][order],
        corner_boxes=build_box_tree(corners, corners),
    )


def _list_segments(free: MultiPolygon) -> _Segments:
    """List the walls in the order of the rings."""
    rings, ring_component = shapely.get_rings(free.geoms, return_index=True)
    points, ring = shapely.get_coordinates(rings, return_index=True)
    # A wall starts at each point of a ring except the last one, which repeats the first.
    start_rows = np.flatnonzero(ring[1:] == ring[:-1])
    vertices, vertex = np.unique(points, axis=0, return_inverse=True)
    vertex = vertex.reshape(-1)
    start = vertex[start_rows]
    end = vertex[start_rows + 1]
    # Snapping may have merged two vertices.
    has_length = start != end
    component = ring_component[ring[start_rows]]
    return _Segments(vertices, start[has_length], end[has_length], component[has_length])


def _sort_spatially(segments: _Segments) -> _Segments:
    """Sort walls so that nearby ones have nearby indices."""
    middles = (segments.vertices[segments.start] + segments.vertices[segments.end]) / 2.0
    order = _compute_spatial_order(middles)
    return _Segments(
        vertices=segments.vertices,
        start=segments.start[order],
        end=segments.end[order],
        component=segments.component[order],
    )


def _compute_spatial_order(points: Array) -> IntArray:
    """Return the indices that sort (n, 2) points along a Z-curve."""
    cells = (points * 2.0 ** (Z_ORDER_BITS - GRID_BITS)).clip(0, 2**Z_ORDER_BITS - 1).astype(np.int64)
    return np.argsort(compute_z_order(cells[:, 0], cells[:, 1]), kind="stable")


def _find_sectors(segments: _Segments) -> _Sectors:
    """Find the pairs of incoming and outgoing walls that bound the same wedge of free space.

    An incoming wall ends at a vertex, and an outgoing wall starts there; both have free space on their left.
    At most vertices there is one of each. At a pinch, where walls touch, there are several, and each outgoing
    wall is paired with the next incoming wall counter-clockwise.
    """
    vertices = segments.vertices
    # As many walls start at a vertex as end there. Row i of both orders therefore has the same vertex.
    leaving = np.argsort(segments.start, kind="stable")
    arriving = np.argsort(segments.end, kind="stable")
    vertex = segments.start[leaving]
    outgoing_end = segments.end[leaving]
    incoming_start = segments.start[arriving].copy()
    count = np.bincount(vertex, minlength=len(vertices))
    first = np.cumsum(count) - count
    for pinch in np.flatnonzero(count > 1):
        rows = slice(first[pinch], first[pinch] + count[pinch])
        outgoing_angle = _compute_angles(vertices[outgoing_end[rows]] - vertices[pinch])
        incoming_angle = _compute_angles(vertices[incoming_start[rows]] - vertices[pinch])
        # The angle from each outgoing wall, counter-clockwise, to each incoming one.
        turns = (incoming_angle - outgoing_angle[:, None]) % (2.0 * np.pi)
        incoming_start[rows] = incoming_start[rows][turns.argmin(axis=1)]
    return _Sectors(vertex, incoming_start, outgoing_end)


def _compute_angles(vectors: Array) -> Array:
    """Return the angles of (n, 2) vectors, (n,) rad."""
    return np.asarray(np.arctan2(vectors[:, 1], vectors[:, 0]))


def _find_corners(vertex: IntArray, incoming: Array, outgoing: Array) -> BoolArray:
    """Find the sectors that are corners, given their vertices and the directions of their walls.

    A sector, the wedge of free space between an incoming and an outgoing wall, is a corner if it is wider
    than half a turn: then the path along the walls turns right, and its cross product is negative.
    """
    crosses = compute_crosses(incoming, outgoing)
    is_pinch = np.bincount(vertex)[vertex] > 1
    # At a pinch, even a straight wall has a corner: otherwise the walls of the other sector would hide the
    # points ahead.
    return np.asarray((crosses < 0.0) | ((crosses == 0.0) & is_pinch))


def _find_following(segments: _Segments) -> IntArray:
    """Find the wall that starts where each one ends, or `NO_WALL` if several do."""
    count = len(segments.vertices)
    starting = np.full(count, NO_WALL)
    starting[segments.start] = np.arange(len(segments.start))
    is_only_one = np.bincount(segments.start, minlength=count)[segments.end] == 1
    return np.where(is_only_one, starting[segments.end], NO_WALL)


def _find_hull_walls(segments: _Segments) -> BoolArray:
    """Find the walls that lie on the convex hull of all vertices."""
    vertices = segments.vertices
    hull = shapely.get_coordinates(shapely.convex_hull(shapely.multipoints(vertices)))
    is_on_hull = np.zeros(len(segments.start), dtype=bool)
    for start, end in pairwise(hull):
        side = np.broadcast_to(end - start, vertices.shape)
        is_on_side = compute_crosses(side, vertices - start) == 0.0
        is_on_hull |= is_on_side[segments.start] & is_on_side[segments.end]
    return is_on_hull


@kernel
def get_relative_ends(ends: Array, wall: int, x: float, y: float) -> tuple[float, float, float, float]:
    """Return the ends of a wall relative to a point.

    Parameters
    ----------
    ends : (w, 4) array, grid steps
    wall : int
    x, y : float, grid steps
        The point.

    Returns
    -------
    start_x, start_y, end_x, end_y : float, grid steps
    """
    return ends[wall, START_X] - x, ends[wall, START_Y] - y, ends[wall, END_X] - x, ends[wall, END_Y] - y


@kernel
def can_bend_at_corner(corners: Array, corner_walls: Array, corner: int, x: float, y: float) -> bool:
    """Return whether a shortest path that bends at a corner can come from, or go to, a point.

    A corner is a wedge of free space wider than half a turn, between an incoming and an outgoing wall with
    free space on their left. The point must lie in this sector, but not in front of both walls: a path from
    there that bends at the corner could be shortened.

    Parameters
    ----------
    corners : (c, 2) array, grid steps
    corner_walls : (c, 4) array, grid steps
        Directions of the walls that meet at each corner; see `Walls`.
    corner : int
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
    is_in_sector = incoming_side >= 0.0 or outgoing_side >= 0.0
    is_behind_a_wall = incoming_side <= 0.0 or outgoing_side <= 0.0
    return is_in_sector and is_behind_a_wall


@kernel
def find_vertex(vertices: Array, x: float, y: float) -> int:
    """Find the vertex that a point coincides with.

    Parameters
    ----------
    vertices : (v, 2) array, grid steps
        Sorted by x, then y.
    x, y : float, grid steps
        The point.

    Returns
    -------
    int
        The vertex, or `NO_VERTEX`.
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
    """Return whether a direction from a vertex leads into its free space.

    The free space at a vertex consists of sectors, each to the left of an incoming and an outgoing wall. In a
    sector of up to half a turn, the direction must be to the left of both walls. In a corner, which is wider,
    it is enough to be to the left of one of them.

    Parameters
    ----------
    walls : Walls
    vertex : int
    dx, dy : float
        The direction, of any length.

    Returns
    -------
    bool
    """
    sectors = walls.sector_walls
    for sector in range(walls.first_sector[vertex], walls.first_sector[vertex + 1]):
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
def count_windings(walls: Walls, points: Array, windings: IntArray) -> None:
    """Count how often the boundary of each component of the free space winds around points.

    The winding number is the number of walls to the right of a point that run up, minus those that run down.
    A search in the box tree visits only walls at the height of the point that are not entirely to its left.

    Parameters
    ----------
    walls : Walls
    points : (n, 2) array, grid steps
    windings : (n, c) int array
        Result: 1 inside the component, more than 1 on its boundary, 0 outside.
    """
    boxes = walls.boxes
    for i in range(len(points)):
        x = points[i, 0]
        y = points[i, 1]
        for component in range(windings.shape[1]):
            windings[i, component] = 0
        node = ROOT
        while node != END_OF_TREE:
            if boxes[node, LOW_Y] > y or boxes[node, HIGH_Y] < y or boxes[node, HIGH_X] < x:
                node = skip_subtree(node)
            elif not is_leaf(boxes, node):
                node = get_first_child(node)
            else:
                first_wall = get_first_item(boxes, node)
                for wall in range(first_wall, min(first_wall + LEAF_SIZE, len(walls.ends))):
                    windings[i, walls.component[wall]] += _count_winding(walls.ends, wall, x, y)
                node = skip_subtree(node)


@kernel
def _count_winding(ends: Array, wall: int, x: float, y: float) -> int:
    """Return the contribution of a wall to the winding number of a point.

    It is 1 if the wall runs up past the point on its right, -1 if it runs down there, and otherwise 0. The
    lower end of a wall counts, but not its upper end, so that no vertex counts twice.
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
