"""The walls of a map: the edges of its free space, the sectors at its vertices, and its corners."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon

from robocov.arrays import Array, BoolArray, IntArray
from robocov.geodesic.orientation import Grid, cross

if TYPE_CHECKING:
    from collections.abc import Iterator


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
    x, y : (v,) grid steps
        The vertices, without repetition.
    start, end : (e,)
        Vertices of the edges that can block a view, free space on the left; those on the convex
        hull of the map are left out.
    sector_vertex, sector_before, sector_after : (s,)
        Vertices: free space lies right of vertex → before, and left of vertex → after.
    sector_wide : (s,)
        True where the sector is a corner.
    corner_x, corner_y : (k,) grid steps
        The corners.
    corner_in, corner_out : (2, k) grid steps
        Their edges, along the wall: before → corner, corner → after.
    """

    grid: Grid
    free: MultiPolygon
    x: Array
    y: Array
    start: IntArray
    end: IntArray
    sector_vertex: IntArray
    sector_before: IntArray
    sector_after: IntArray
    sector_wide: BoolArray
    corner_x: Array
    corner_y: Array
    corner_in: Array
    corner_out: Array

    @classmethod
    def of(cls, free: MultiPolygon, grid: Grid) -> Walls:
        """Return the walls of `free` (metres), a valid MultiPolygon whose shells run counter-clockwise."""
        free = shapely.transform(free, grid.snap)
        rings = [np.asarray(ring.coords)[:-1] for ring in _rings(free)]
        vertices, numbers = np.unique(np.concatenate(rings), axis=0, return_inverse=True)
        numbers = numbers.reshape(-1)
        x, y = np.ascontiguousarray(vertices.T)
        lengths = np.array([len(ring) for ring in rings])
        following = np.arange(1, len(numbers) + 1)
        following[np.cumsum(lengths) - 1] -= lengths
        start, end = numbers, numbers[following]
        # snapping may have made one point of two vertices
        start, end = start[start != end], end[start != end]

        vertex, before, after = _sectors(x, y, start, end)
        turn = cross(x[vertex] - x[before], y[vertex] - y[before], x[after] - x[vertex], y[after] - y[vertex])
        # a straight wall counts where another sector ends on it: that one's walls would hide what is ahead
        wide = (turn < 0.0) | ((turn == 0.0) & (np.bincount(vertex)[vertex] > 1))
        corner = np.nonzero(wide)[0]
        inner = ~_on_hull(x, y, start, end)
        return cls(
            grid=grid,
            free=free,
            x=x,
            y=y,
            start=start[inner],
            end=end[inner],
            sector_vertex=vertex,
            sector_before=before,
            sector_after=after,
            sector_wide=wide,
            corner_x=x[vertex[corner]],
            corner_y=y[vertex[corner]],
            corner_in=_steps(x, y, before[corner], vertex[corner]),
            corner_out=_steps(x, y, vertex[corner], after[corner]),
        )

    def useful(self, corner: IntArray, x: Array, y: Array) -> BoolArray:
        """Return whether a shortest path that bends at a corner can come from, or go to, a point.

        The point must lie in the corner's sector, and not in front of both of its walls: from
        there a path that bends round the corner could be cut short. The three broadcast.
        """
        dx, dy = x - self.corner_x[corner], y - self.corner_y[corner]
        first = cross(self.corner_in[0, corner], self.corner_in[1, corner], dx, dy)
        second = cross(self.corner_out[0, corner], self.corner_out[1, corner], dx, dy)
        return ((first >= 0.0) | (second >= 0.0)) & ((first <= 0.0) | (second <= 0.0))

    def vertex_at(self, x: Array, y: Array) -> IntArray:
        """Return for (n,) points the vertex that they coincide with, -1 for none."""
        # the vertices are sorted by x, then y
        found = np.full(len(x), -1, dtype=np.intp)
        low, high = np.searchsorted(self.x, x, "left"), np.searchsorted(self.x, x, "right")
        for i in np.nonzero(low < high)[0]:
            at = low[i] + np.searchsorted(self.y[low[i] : high[i]], y[i])
            if at < high[i] and self.y[at] == y[i]:
                found[i] = at
        return found

    def sectors_hold(self, vertex: int, dx: Array, dy: Array) -> BoolArray:
        """Return whether each of (n,) directions from `vertex` runs into its free space."""
        holds = np.zeros(len(dx), dtype=bool)
        for s in np.nonzero(self.sector_vertex == vertex)[0]:
            a, b = self.sector_before[s], self.sector_after[s]
            first = cross(self.x[vertex] - self.x[a], self.y[vertex] - self.y[a], dx, dy) >= 0.0
            second = cross(self.x[b] - self.x[vertex], self.y[b] - self.y[vertex], dx, dy) >= 0.0
            holds |= (first | second) if self.sector_wide[s] else (first & second)
        return holds


def _rings(free: MultiPolygon) -> Iterator[shapely.LinearRing]:
    part: Polygon
    for part in free.geoms:
        yield part.exterior
        yield from part.interiors


def _steps(x: Array, y: Array, begin: IntArray, end: IntArray) -> Array:
    return np.stack([x[end] - x[begin], y[end] - y[begin]])


def _sectors(x: Array, y: Array, start: IntArray, end: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    """Return vertex, before and after of every sector: an incoming edge's start, an outgoing edge's end."""
    leaving, arriving = np.argsort(start, kind="stable"), np.argsort(end, kind="stable")
    vertex, after, before = start[leaving], end[leaving], start[arriving].copy()
    count = np.bincount(vertex, minlength=len(x))
    first = np.cumsum(count) - count
    for v in np.nonzero(count > 1)[0]:
        at = slice(first[v], first[v] + count[v])
        out = np.arctan2(y[after[at]] - y[v], x[after[at]] - x[v])
        into = np.arctan2(y[before[at]] - y[v], x[before[at]] - x[v])
        turns = (into[None, :] - out[:, None]) % (2.0 * np.pi)
        before[at] = before[at][turns.argmin(axis=1)]
    return vertex, before, after


def _on_hull(x: Array, y: Array, start: IntArray, end: IntArray) -> BoolArray:
    """Return for each edge whether it lies on the convex hull of the vertices: nothing is behind it."""
    hull = np.asarray(shapely.convex_hull(shapely.MultiPoint(np.column_stack([x, y]))).exterior.coords)
    on_hull = np.zeros(len(start), dtype=bool)
    for one, other in pairwise(hull):
        ux, uy = np.split(other - one, 2)
        on_line = cross(ux, uy, x - one[0], y - one[1]) == 0.0
        on_hull |= on_line[start] & on_line[end]
    return on_hull
