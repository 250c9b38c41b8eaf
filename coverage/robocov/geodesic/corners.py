"""The walls of a map: the edges of its free space, the sectors at its vertices, and its corners."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon

from robocov.arrays import Array, BoolArray, IntArray
from robocov.compiled import inlined_kernel, inner_kernel
from robocov.geodesic.orientation import Grid, cross, crosses

if TYPE_CHECKING:
    from collections.abc import Iterator


class Corners(NamedTuple):
    """The sectors wider than a half turn, (k,) each, grid steps."""

    x: Array
    y: Array
    in_x: Array
    in_y: Array
    """Along the wall that ends in the corner."""
    out_x: Array
    out_y: Array
    """Along the wall that begins in it."""


class Sectors(NamedTuple):
    """The vertices (v,), by x, then y, and the wedges of free space at them (s,), by vertex; grid steps."""

    x: Array
    y: Array
    first: IntArray
    """(v + 1,) The sectors of a vertex are those from its own `first` up to the next."""
    in_x: Array
    in_y: Array
    """Free space lies left of the wall that ends in the vertex,"""
    out_x: Array
    out_y: Array
    """and left of the one that begins in it."""
    wide: BoolArray
    """Whether the sector is a corner."""


@dataclass(frozen=True, slots=True, eq=False)
class Walls:
    """The boundary of the free space on a `Grid`.

    A vertex where walls touch (a pinch) has several sectors: wedges of free space, each between an
    outgoing edge and the next incoming edge counter-clockwise. A *corner* is a sector wider than a
    half turn; only there a shortest path can bend. A sector of exactly a half turn is a corner too if
    other sectors share its vertex. A vertex has at most one corner.

    Attributes
    ----------
    grid : Grid
    free : MultiPolygon
        The free space in grid coordinates, one polygon a component.
    start, end : (e,)
        Vertices of the edges that can block a view, free space on the left; those on the convex
        hull of the map are left out.
    sectors : Sectors
    corners : Corners
    """

    grid: Grid
    free: MultiPolygon
    start: IntArray
    end: IntArray
    sectors: Sectors
    corners: Corners

    @classmethod
    def of(cls, free: MultiPolygon, grid: Grid) -> Walls:
        """Return the walls of `free` (metres), a valid MultiPolygon whose shells run counter-clockwise."""
        free = shapely.transform(free, grid.snap)
        rings = [np.asarray(ring.coords)[:-1] for ring in _rings(free)]
        vertices, numbers = np.unique(np.concatenate(rings), axis=0, return_inverse=True)
        numbers = numbers.reshape(-1)
        lengths = np.array([len(ring) for ring in rings])
        following = np.arange(1, len(numbers) + 1)
        following[np.cumsum(lengths) - 1] -= lengths
        start, end = numbers, numbers[following]
        # snapping may have made one point of two vertices
        start, end = start[start != end], end[start != end]

        vertex, before, after = _sectors(vertices, start, end)
        into, out = vertices[vertex] - vertices[before], vertices[after] - vertices[vertex]
        turn = crosses(into, out)
        # a straight wall counts where another sector ends on it: that one's walls would hide what is ahead
        wide = (turn < 0.0) | ((turn == 0.0) & (np.bincount(vertex)[vertex] > 1))
        corners = np.column_stack([vertices[vertex], into, out])[wide]
        inner = ~_on_hull(vertices, start, end)
        first = np.searchsorted(vertex, np.arange(len(vertices) + 1))
        x, y = columns(vertices)
        in_x, in_y, out_x, out_y = columns(np.hstack([into, out]))
        sectors = Sectors(x, y, first, in_x, in_y, out_x, out_y, wide)
        return cls(grid, free, start[inner], end[inner], sectors, Corners(*columns(corners)))


def columns(table: Array) -> Array:
    """Return the columns of a table, one after the other in memory."""
    return np.ascontiguousarray(table.T)


@inlined_kernel
def useful(corners: Corners, k: int, x: float, y: float) -> bool:
    """Return whether a shortest path that bends at a corner can come from, or go to, a point.

    The point must lie in the corner's sector, and not in front of both of its walls: from
    there a path that bends round the corner could be cut short.
    """
    dx, dy = x - corners.x[k], y - corners.y[k]
    first = cross(corners.in_x[k], corners.in_y[k], dx, dy)
    second = cross(corners.out_x[k], corners.out_y[k], dx, dy)
    return (first >= 0.0 or second >= 0.0) and (first <= 0.0 or second <= 0.0)


@inner_kernel
def vertex_at(sectors: Sectors, x: float, y: float) -> int:
    """Return the vertex that a point coincides with, -1 for none."""
    low, high = 0, len(sectors.x)
    while low < high:
        middle = (low + high) // 2
        if sectors.x[middle] < x or (sectors.x[middle] == x and sectors.y[middle] < y):
            low = middle + 1
        else:
            high = middle
    if low < len(sectors.x) and sectors.x[low] == x and sectors.y[low] == y:
        return low
    return -1


@inner_kernel
def sectors_hold(sectors: Sectors, vertex: int, dx: float, dy: float) -> bool:
    """Return whether a direction from a vertex runs into its free space."""
    for s in range(sectors.first[vertex], sectors.first[vertex + 1]):
        first = cross(sectors.in_x[s], sectors.in_y[s], dx, dy) >= 0.0
        second = cross(sectors.out_x[s], sectors.out_y[s], dx, dy) >= 0.0
        if (first and second) or (sectors.wide[s] and (first or second)):
            return True
    return False


def _rings(free: MultiPolygon) -> Iterator[shapely.LinearRing]:
    part: Polygon
    for part in free.geoms:
        yield part.exterior
        yield from part.interiors


def _sectors(vertices: Array, start: IntArray, end: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    """Return vertex, before and after of every sector: an incoming edge's start, an outgoing edge's end."""
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
    """Return for each edge whether it lies on the convex hull of the vertices: nothing is behind it."""
    hull = np.asarray(shapely.convex_hull(shapely.MultiPoint(vertices)).exterior.coords)
    on_hull = np.zeros(len(start), dtype=bool)
    for one, other in pairwise(hull):
        on_line = crosses(np.broadcast_to(other - one, vertices.shape).copy(), vertices - one) == 0.0
        on_hull |= on_line[start] & on_line[end]
    return on_hull
