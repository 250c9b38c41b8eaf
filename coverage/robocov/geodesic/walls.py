"""The walls of a map on a grid of whole numbers, where sides of lines are exact, and where paths can bend."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import shapely
from shapely import MultiPolygon

from robocov.arrays import Array, BoolArray, IntArray
from robocov.compiled import kernel

BITS = 48
"""The square that holds the map is 2**48 grid steps wide: 4e-15 of its side, below a double's rounding
for a map that does not start at zero, yet few enough that `cross` can be exact."""

LEAF_SIZE = 8
"""Boxes of a leaf of a `build_box_tree`."""

_DOUBT = 2.0**48
"""More than the roundings of a cross product of two differences, whose products are below 2**98."""


@dataclass(frozen=True, slots=True, eq=False)
class Grid:
    """Integer coordinates, kept in floats, for the points of one map.

    Its lower left corner is the origin, (2,) m. The unit, one grid step in metres, is a power of two, so that
    no length is rounded by the change of scale.
    """

    origin: Array
    unit: float

    @classmethod
    def from_square(cls, low: Array, side: float) -> Grid:
        """Return the grid for points from `low` (2,) m to `side` metres right of and above it."""
        return cls(np.asarray(low, dtype=float), 2.0 ** (math.ceil(math.log2(side)) - BITS))

    def snap(self, points: Array) -> Array:
        """Return (..., 2) metres as grid coordinates, rounded to whole steps."""
        return np.rint((points - self.origin) / self.unit)

    def to_metres(self, points: Array) -> Array:
        """Return (..., 2) grid coordinates as metres."""
        return np.asarray(points * self.unit + self.origin)


class Walls(NamedTuple):
    """The boundary of a free space for kernels, in grid steps.

    A vertex where walls touch (a pinch) has several sectors: wedges of free space, each between an
    outgoing wall and the next incoming wall counter-clockwise. A *corner* is a sector wider than a
    half turn; only there a shortest path can bend. A sector of exactly a half turn is a corner too if
    other sectors share its vertex. A vertex has at most one corner.
    """

    ends: Array
    """(e, 4) The walls, ax, ay, bx, by, free space on the left of a → b, neighbours together."""
    facts: IntArray
    """(e, 3) The wall that begins at b, -1 where several do; the component of the free space; whether
    anything can be behind the wall, which is not so on the convex hull of the map."""
    boxes: Array
    """The `build_box_tree` of the walls."""
    vertices: Array
    """(v, 2) By x, then y."""
    first: IntArray
    """(v + 1,) The sectors of a vertex are those from its own `first` up to the next."""
    sectors: Array
    """(s, 5) Along the incoming and the outgoing wall, free space left of both; whether it is a corner."""
    corners: Array
    """(k, 6) The place, and along the incoming and the outgoing wall; neighbours together."""
    corner_boxes: Array
    """The `build_box_tree` of the corners."""


def build_walls(free: MultiPolygon) -> Walls:
    """Return the walls of a free space (grid steps, shells counter-clockwise), one polygon a component."""
    rings, part = shapely.get_rings(free.geoms, return_index=True)
    points, ring = shapely.get_coordinates(rings, return_index=True)
    along = np.flatnonzero(ring[1:] == ring[:-1])
    vertices, numbers = np.unique(points, axis=0, return_inverse=True)
    start, end = numbers.reshape(-1)[along], numbers.reshape(-1)[along + 1]
    # snapping may have made one point of two vertices
    kept = start != end
    start, end, component = start[kept], end[kept], part[ring[along]][kept]

    vertex, before, after = _sectors(vertices, start, end)
    into, out = vertices[vertex] - vertices[before], vertices[after] - vertices[vertex]
    turn = _crosses(into, out)
    # a straight wall counts where another sector ends on it: that one's walls would hide what is ahead
    wide = (turn < 0.0) | ((turn == 0.0) & (np.bincount(vertex)[vertex] > 1))
    corners = np.column_stack([vertices[vertex], into, out])[wide]
    corners = corners[_neighbours_together(corners[:, :2])]

    order = _neighbours_together((vertices[start] + vertices[end]) / 2.0)
    start, end, component = start[order], end[order], component[order]
    beginning = np.full(len(vertices), -1)
    beginning[start] = np.arange(len(start))
    following = np.where(np.bincount(start, minlength=len(vertices))[end] == 1, beginning[end], -1)
    hides = ~_on_hull(vertices, start, end)
    ends = np.hstack([vertices[start], vertices[end]])
    low, high = np.minimum(ends[:, :2], ends[:, 2:]), np.maximum(ends[:, :2], ends[:, 2:])
    return Walls(
        ends,
        np.column_stack([following, component, hides]),
        build_box_tree(low, high),
        vertices,
        np.searchsorted(vertex, np.arange(len(vertices) + 1)),
        np.column_stack([into, out, wide]),
        corners,
        build_box_tree(corners[:, :2], corners[:, :2]),
    )


def _sectors(vertices: Array, start: IntArray, end: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    """Return vertex, before and after of every sector: an incoming wall's start, an outgoing wall's end."""
    leaving, arriving = np.argsort(start, kind="stable"), np.argsort(end, kind="stable")
    vertex, after, before = start[leaving], end[leaving], start[arriving].copy()
    count = np.bincount(vertex, minlength=len(vertices))
    first = np.cumsum(count) - count
    for v in np.nonzero(count > 1)[0]:
        at = slice(first[v], first[v] + count[v])
        out, into = ((vertices[ends[at]] - vertices[v]).T for ends in (after, before))
        turns = (np.arctan2(into[1], into[0]) - np.arctan2(out[1], out[0])[:, None]) % (2.0 * np.pi)
        before[at] = before[at][turns.argmin(axis=1)]
    return vertex, before, after


def _on_hull(vertices: Array, start: IntArray, end: IntArray) -> BoolArray:
    """Return for each wall whether it lies on the convex hull of the vertices."""
    hull = shapely.get_coordinates(shapely.convex_hull(shapely.multipoints(vertices)))
    on_hull = np.zeros(len(start), dtype=bool)
    for one, other in pairwise(hull):
        on_line = _crosses(np.broadcast_to(other - one, vertices.shape), vertices - one) == 0.0
        on_hull |= on_line[start] & on_line[end]
    return on_hull


def _crosses(u: Array, v: Array) -> Array:
    """Return `cross` of (n, 2) vectors."""
    value = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    u, v = u.astype(np.int64), v.astype(np.int64)
    return np.where(np.abs(value) < _DOUBT, u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0], value)


def compute_z_order(column: IntArray, row: IntArray) -> IntArray:
    """Return numbers along a Z-curve, which keeps neighbours together, of whole numbers below 65536."""
    key = np.zeros(len(column), dtype=np.int64)
    for bit in range(16):
        key |= ((column >> bit) & 1) << (2 * bit) | ((row >> bit) & 1) << (2 * bit + 1)
    return key


def _neighbours_together(points: Array) -> IntArray:
    """Return an order of (n, 2) points."""
    column, row = (points * 2.0 ** (16 - BITS)).clip(0, 65535).astype(np.int64).T
    return np.argsort(compute_z_order(column, row), kind="stable")


def build_box_tree(low: Array, high: Array) -> Array:
    """Return a binary tree of boxes around (m, 2) and (m, 2): rows of low x, low y, high x, high y.

    Node k holds nodes 2k and 2k + 1, the root is 1. A leaf, of which there are as many as other nodes, holds
    the next `LEAF_SIZE` boxes.
    """
    leaves = 1
    while leaves * LEAF_SIZE < len(low):
        leaves *= 2
    # with the upper bounds negated all four are least values
    level = np.full((leaves * LEAF_SIZE, 4), np.inf)
    level[: len(low)] = np.hstack([low, -high])
    level = level.reshape(-1, LEAF_SIZE, 4).min(axis=1)
    levels = [level]
    while len(level) > 1:
        level = level.reshape(-1, 2, 4).min(axis=1)
        levels.append(level)
    return np.concatenate([np.full((1, 4), np.inf), *levels[::-1]]) * [1.0, 1.0, -1.0, -1.0]


@kernel
def cross(ux: float, uy: float, vx: float, vy: float) -> float:
    """Return ``ux vy - uy vx`` with its exact sign.

    Positive where v points to the left of u. The value is rounded as usual; the sign is right for
    whole numbers of magnitude up to 2**49, which differences of grid coordinates are.

    >>> big = 2.0**40 + 1
    >>> cross(big, big - 1, big + 1, big)  # naive floats give 0
    1.0
    """
    value = ux * vy - uy * vx
    if abs(value) < _DOUBT:
        # integers wrap around at 2**64, so that a small difference of large products comes out right
        value = float(int(ux) * int(vy) - int(uy) * int(vx))
    return value


@kernel
def skip_subtree(node: int) -> int:
    """Return the node that follows all that is below a node of a tree, 0 at the end."""
    while node & 1:
        node >>= 1
    return node + 1 if node else 0


@kernel
def compute_squared_box_distance(boxes: Array, node: int, x: float, y: float) -> float:
    """Return the squared distance of a point to a box."""
    dx: float = max(boxes[node, 0] - x, x - boxes[node, 2], 0.0)
    dy: float = max(boxes[node, 1] - y, y - boxes[node, 3], 0.0)
    return dx * dx + dy * dy


@kernel
def can_bend_at_corner(corners: Array, k: int, x: float, y: float) -> bool:
    """Return whether a shortest path that bends at a corner can come from, or go to, a point.

    The point must lie in the corner's sector, and not in front of both of its walls: from
    there a path that bends round the corner could be cut short.
    """
    dx, dy = x - corners[k, 0], y - corners[k, 1]
    first = cross(corners[k, 2], corners[k, 3], dx, dy)
    second = cross(corners[k, 4], corners[k, 5], dx, dy)
    return (first >= 0.0 or second >= 0.0) and (first <= 0.0 or second <= 0.0)


@kernel
def find_vertex(vertices: Array, x: float, y: float) -> int:
    """Return the vertex that a point coincides with, -1 for none."""
    low, high = 0, len(vertices)
    while low < high:
        middle = (low + high) // 2
        if vertices[middle, 0] < x or (vertices[middle, 0] == x and vertices[middle, 1] < y):
            low = middle + 1
        else:
            high = middle
    if low < len(vertices) and vertices[low, 0] == x and vertices[low, 1] == y:
        return low
    return -1


@kernel
def contains_direction(first: IntArray, sectors: Array, vertex: int, dx: float, dy: float) -> bool:
    """Return whether a direction from a vertex runs into its free space."""
    for s in range(first[vertex], first[vertex + 1]):
        one = cross(sectors[s, 0], sectors[s, 1], dx, dy) >= 0.0
        other = cross(sectors[s, 2], sectors[s, 3], dx, dy) >= 0.0
        if (one and other) or (sectors[s, 4] != 0.0 and (one or other)):
            return True
    return False


@kernel
def count_windings(walls: Walls, points: Array, holds: IntArray) -> None:
    """Write which components hold which of (n, 2) points, (n, c): 1 inside, more than 1 on the boundary.

    The winding number: walls right of a point, those that run up less those that run down.
    """
    ends, facts, boxes = walls.ends, walls.facts, walls.boxes
    leaves = len(boxes) // 2
    for i in range(len(points)):
        x, y = points[i, 0], points[i, 1]
        for c in range(holds.shape[1]):
            holds[i, c] = 0
        node = 1
        while node:
            if boxes[node, 1] > y or boxes[node, 3] < y or boxes[node, 2] < x:
                node = skip_subtree(node)
                continue
            if node < leaves:
                node *= 2
                continue
            begin = (node - leaves) * LEAF_SIZE
            for wall in range(begin, min(begin + LEAF_SIZE, len(ends))):
                ax, ay, bx, by = ends[wall, 0], ends[wall, 1], ends[wall, 2], ends[wall, 3]
                if min(ay, by) > y or max(ay, by) < y or max(ax, bx) < x:
                    continue
                side = cross(bx - ax, by - ay, x - ax, y - ay)
                if side == 0.0 and min(ax, bx) <= x:
                    holds[i, facts[wall, 1]] += 1000
                elif ay <= y < by and side > 0.0:
                    holds[i, facts[wall, 1]] += 1
                elif by <= y < ay and side < 0.0:
                    holds[i, facts[wall, 1]] -= 1
            node = skip_subtree(node)
