"""Exact shortest distances in the free space of a map: d~ of equation (22).

The distance of two points is the infimum over the paths in the *open* free space, extended to its
closure: there is no way through a point or along an edge where two obstacles touch. A shortest path
is a chain of segments that bends only at corners, so that a graph of the corners that see each
other holds all that is needed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import shapely

from robocov.arrays import Array, BoolArray, IntArray
from robocov.clusters import Clusters
from robocov.corners import Walls
from robocov.environment import GRID
from robocov.errors import InputError
from robocov.orientation import Grid
from robocov.visibility import Fans, WallIndex

if TYPE_CHECKING:
    from robocov.environment import Environment

_CORNER_BINS = 256
"""Angular bins of a corner, which looks at many targets; other sources have the default."""


class Geodesics:
    """The shortest paths of one environment; immutable.

    Parameters
    ----------
    environment : Environment

    Attributes
    ----------
    walls : Walls
        Vertices, edges and corners, in grid coordinates.
    index : WallIndex
        The edges for `Fans`.
    corner_clusters : Clusters
    corner_fans : Fans
        The views of the corners.
    size : float, m
        Side of the square over the region's bounding box.
    graph_row, graph_column : (g,)
        Pairs of corners that see each other and can follow each other on a shortest path, sorted.
    graph_length : (g,) grid steps
    """

    def __init__(self, environment: Environment) -> None:
        low_x, low_y, high_x, high_y = environment.region.bounds
        self.size = max(high_x - low_x, high_y - low_y)
        self._name = environment.name
        self.walls = Walls.of(environment.free, Grid.over(np.array([low_x, low_y]), self.size))
        shapely.prepare(list(self.walls.free.geoms))
        self.corner_x, self.corner_y = self.walls.corner_x, self.walls.corner_y
        self.index = WallIndex(self.walls)
        self.corner_clusters = Clusters(self.corner_x, self.corner_y, leaf=8)
        everywhere = np.full(len(self.corner_x), np.inf)
        self.corner_fans = Fans(self.index, self.corner_x, self.corner_y, everywhere, _CORNER_BINS)
        self._link()

    def _link(self) -> None:
        """Build the graph of the corners."""
        count = len(self.corner_x)
        corner = np.arange(count)
        useful = np.empty((count, count), dtype=bool)
        for v in range(count):
            useful[v] = self.walls.useful(corner[v : v + 1], self.corner_x, self.corner_y)
        row, column = np.nonzero(np.triu(useful & useful.T, 1))
        seen = self.corner_fans.see(row, self.corner_x[column], self.corner_y[column])
        row, column = row[seen], column[seen]
        row, column = np.concatenate([row, column]), np.concatenate([column, row])
        order = np.lexsort((column, row))
        self.graph_row, self.graph_column = row[order], column[order]
        self.graph_length = np.hypot(
            self.corner_x[self.graph_row] - self.corner_x[self.graph_column],
            self.corner_y[self.graph_row] - self.corner_y[self.graph_column],
        )
        # corners without links have no place in reduceat
        self._linked, self._linked_first = np.unique(self.graph_row, return_index=True)

    def place(self, points: Array, what: str = "positions") -> tuple[Array, Array, BoolArray]:
        """Return points in grid coordinates, those a hair outside the free space moved into it.

        Parameters
        ----------
        points : (n, 2) m
        what : str
            What the message calls them.

        Returns
        -------
        x, y : (n,) grid steps
        holds : (n, c)
            Which component's closure holds which point.

        Raises
        ------
        InputError
            When a point lies outside the free space by more than rounding (2 µm and 1e-9 of the
            map's size), or is not finite.
        """
        points = np.asarray(points, dtype=float)
        if points.ndim != 2 or points.shape[1] != 2:
            raise InputError(
                f"{what}: an array of shape {points.shape}, but one [x, y] in metres each was wanted"
            )
        finite = np.asarray(np.isfinite(points).all(axis=1))
        snapped = self.walls.grid.snap(np.where(finite[:, None], points, 0.0))
        holds = self._holds(snapped)
        for i in np.nonzero(~(finite & holds.any(axis=1)))[0]:
            place = f"{what}[{i}] = [{points[i, 0]:.12g}, {points[i, 1]:.12g}]"
            if not finite[i]:
                raise InputError(f"{place}: finite numbers were wanted")
            moved = self._nearest_free(snapped[i])
            depth = float(np.hypot(*(moved - snapped[i]))) * self.walls.grid.unit
            if depth > 2.0 * GRID + 1e-9 * self.size:
                raise InputError(
                    f"{place} is {depth:.3g} m outside the free space of map {self._name!r}; "
                    f"a point inside the boundary and outside every obstacle was wanted"
                )
            snapped[i] = moved
            holds[i] = self._holds(moved[None])[0]
        x, y = np.ascontiguousarray(snapped.T)
        return x, y, holds

    def _holds(self, points: Array) -> BoolArray:
        columns = [shapely.intersects_xy(part, points[:, 0], points[:, 1]) for part in self.walls.free.geoms]
        return np.column_stack(columns)

    def _nearest_free(self, point: Array) -> Array:
        """Return the nearest grid point of the closed free space, to within a few steps."""
        line = shapely.shortest_line(self.walls.free, shapely.Point(point))
        foot = np.rint(np.asarray(line.coords)[0])
        # the foot on a slanted wall is no grid point: the nearest that is not behind the wall
        steps = np.arange(-2, 3)
        around = foot + np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
        around = around[self._holds(around).any(axis=1)]
        if not len(around):
            around = np.column_stack([self.walls.x, self.walls.y])
        return np.asarray(around[np.hypot(*(around - point).T).argmin()])

    def see(self, fans: Fans, vertex: IntArray, source: IntArray, x: Array, y: Array) -> BoolArray:
        """Return for (m,) pairs of a source and a target whether the source sees the target.

        `vertex` (n,) is the vertex that each source coincides with, -1 for none.
        """
        seen = fans.see(source, x, y)
        for i in np.nonzero(vertex >= 0)[0]:
            pairs = np.nonzero(source == i)[0]
            seen[pairs] &= self.walls.sectors_hold(int(vertex[i]), x[pairs], y[pairs])
        return seen

    def relax(self, reach: Array) -> Array:
        """Return the distance of every corner from the sources, given that by direct view.

        Parameters
        ----------
        reach : (..., k) grid steps
            Distance to the sources in direct view; inf where there is none.

        Returns
        -------
        (..., k) grid steps
        """
        if not len(self._linked):
            return reach
        while True:
            by_way_of = reach[..., self.graph_column] + self.graph_length
            shorter = np.minimum.reduceat(by_way_of, self._linked_first, axis=-1)
            if not (shorter < reach[..., self._linked]).any():
                return reach
            reach = reach.copy()
            reach[..., self._linked] = np.minimum(reach[..., self._linked], shorter)

    def previous(self, distance: Array, reach: Array) -> IntArray:
        """Return for every corner the one before it on its shortest path, -1 where that is the source.

        `distance` (k,) is ``relax(reach)``. Of equally short ways the direct one, then that by the
        corner of lowest index.
        """
        before = np.full(len(distance), -1, dtype=np.intp)
        by_way_of = distance[self.graph_column] + self.graph_length
        hit = np.nonzero((by_way_of == distance[self.graph_row]) & np.isfinite(by_way_of))[0][::-1]
        before[self.graph_row[hit]] = self.graph_column[hit]
        before[reach <= distance] = -1
        return before

    def _views(self, x: Array, y: Array) -> tuple[Fans, IntArray, Array]:
        """Return fans and vertices of (n,) points, and their (n, k) distances to useful corners in view."""
        fans, vertex = Fans(self.index, x, y, np.full(len(x), np.inf)), self.walls.vertex_at(x, y)
        count = len(self.corner_x)
        source, corner = np.indices((len(x), count)).reshape(2, -1)
        good = self.walls.useful(corner, x[source], y[source])
        source, corner = source[good], corner[good]
        good = self.see(fans, vertex, source, self.corner_x[corner], self.corner_y[corner])
        source, corner = source[good], corner[good]
        reach = np.full((len(x), count), np.inf)
        reach[source, corner] = np.hypot(self.corner_x[corner] - x[source], self.corner_y[corner] - y[source])
        return fans, vertex, reach

    def distances(self, sources: Array, targets: Array) -> Array:
        """Return the geodesic distances from (n, 2) to (m, 2) points, (n, m) m, inf where no way leads.

        Raises
        ------
        InputError
            When a point lies outside the free space.
        """
        px, py, _ = self.place(sources, "sources")
        qx, qy, _ = self.place(targets, "targets")
        fans, vertex, reach = self._views(px, py)
        _, _, last = self._views(qx, qy)
        reach = self.relax(reach)
        distance = np.full((len(px), len(qx)), np.inf)
        for k in range(len(self.corner_x)):
            np.minimum(distance, reach[:, k, None] + last[:, k], out=distance)
        source, target = np.indices(distance.shape).reshape(2, -1)
        straight = np.hypot(qx[target] - px[source], qy[target] - py[source])
        seen = self.see(fans, vertex, source, qx[target], qy[target])
        distance = np.minimum(distance, np.where(seen, straight, np.inf).reshape(distance.shape))
        return np.asarray(distance * self.walls.grid.unit)

    def path(self, source: Array, target: Array) -> Array:
        """Return the way-points of a shortest path, (w, 2) m, both ends included; (0, 2) where none leads.

        Raises
        ------
        InputError
            When an end lies outside the free space.
        """
        x, y, _ = self.place(np.stack([source, target]), "ends of the path")
        fans, vertex, views = self._views(x, y)
        straight = self.see(fans, vertex, np.zeros(1, dtype=np.intp), x[1:], y[1:])[0]
        corners: list[int] = []
        if not straight:
            distance = self.relax(views[0])
            total = distance + views[1]
            if not np.isfinite(total).any():
                return np.empty((0, 2))
            before = self.previous(distance, views[0])
            corner = int(total.argmin())
            while corner >= 0:
                corners.insert(0, corner)
                corner = int(before[corner])
        way = np.column_stack(
            [np.r_[x[0], self.corner_x[corners], x[1]], np.r_[y[0], self.corner_y[corners], y[1]]]
        )
        return self.walls.grid.metres(way)
