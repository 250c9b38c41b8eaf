"""Exact shortest distances in the free space of a map: d~ of equation (22).

The distance of two points is the infimum over the paths in the *open* free space, extended to its
closure: there is no way through a point or along an edge where two obstacles touch. A shortest path
is a chain of segments that bends only at corners, so that a graph of the corners that see each
other holds all that is needed.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np
import shapely

from robocov.arrays import Array, BoolArray, IntArray
from robocov.environment import GRID
from robocov.errors import InputError
from robocov.geodesic.corners import Walls
from robocov.geodesic.orientation import Grid
from robocov.geodesic.visibility import Fans, WallIndex

if TYPE_CHECKING:
    from collections.abc import Callable

    from robocov.environment import Environment

_CORNER_BINS = 256
"""Angular bins of a corner, which looks at many targets; other sources have the default."""

_PAIRS = 1 << 20
"""Pairs of corners looked at in one piece, which bounds the memory."""


class Geodesics:
    """The shortest paths of one environment; immutable.

    Parameters
    ----------
    environment : Environment
    beat : callable
        Called now and then while what is needed is computed. It may raise, to give up.

    Attributes
    ----------
    walls : Walls
        Vertices, edges and corners, in grid coordinates.
    index : WallIndex
        The edges for `Fans`.
    corner_fans : Fans
        The views of the corners.
    size : float, m
        Side of the square over the region's bounding box.
    graph_row, graph_column : (g,)
        Pairs of corners that see each other and can follow each other on a shortest path, sorted.
    graph_length : (g,) grid steps
    """

    def __init__(self, environment: Environment, beat: Callable[[], None] | None = None) -> None:
        low_x, low_y, high_x, high_y = environment.region.bounds
        self.size = max(high_x - low_x, high_y - low_y)
        self._name = environment.name
        self.walls = Walls.of(environment.free, Grid.over(np.array([low_x, low_y]), self.size))
        shapely.prepare(list(self.walls.free.geoms))
        self.corner_x, self.corner_y = self.walls.corner_x, self.walls.corner_y
        self.index = WallIndex(self.walls)
        everywhere = np.full(len(self.corner_x), np.inf)
        self.corner_fans = Fans(self.index, self.corner_x, self.corner_y, everywhere, _CORNER_BINS)
        self._link(beat)

    def _link(self, beat: Callable[[], None] | None) -> None:
        """Build the graph of the corners."""
        count = len(self.corner_x)
        corner = np.arange(count)
        pieces = [(np.empty(0, np.intp), np.empty(0, np.intp))]
        block = max(1, _PAIRS // max(1, count))
        for begin in range(0, count, block):
            if beat is not None:
                beat()
            # each of the two must be useful to the other
            some = corner[begin : begin + block, None]
            good = self.walls.useful(some, self.corner_x, self.corner_y) & (some < corner)
            good &= self.walls.useful(corner, self.corner_x[some], self.corner_y[some])
            row, column = good.nonzero()
            row += begin
            seen = self.corner_fans.see(row, self.corner_x[column], self.corner_y[column])
            pieces.append((row[seen], column[seen]))
        row, column = (np.concatenate([piece[k] for piece in pieces]) for k in (0, 1))
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
        dx, dy = x - fans.x[source], y - fans.y[source]
        return self.see_along(fans, vertex, source, dx, dy, dx * dx + dy * dy)

    def see_along(
        self, fans: Fans, vertex: IntArray, source: IntArray, dx: Array, dy: Array, distance2: Array
    ) -> BoolArray:
        """Return the same for targets at (dx, dy) from their sources, and the square of that distance."""
        seen = fans.see_along(source, dx, dy, distance2)
        for i in np.nonzero(vertex >= 0)[0]:
            pairs = np.nonzero(source == i)[0]
            seen[pairs] &= self.walls.sectors_hold(int(vertex[i]), dx[pairs], dy[pairs])
        return seen

    def relax(self, reach: Array, sweeps: int | None = None) -> Array:
        """Return the distance of every corner from the sources, given that by direct view.

        After a limited number of sweeps, which is a bound, paths may bend at as many corners more.

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
        for _ in itertools.count() if sweeps is None else range(sweeps):
            by_way_of = reach.take(self.graph_column, axis=-1) + self.graph_length
            shorter = np.minimum.reduceat(by_way_of, self._linked_first, axis=-1)
            former = reach.take(self._linked, axis=-1)
            if not (shorter < former).any():
                break
            reach = reach.copy()
            reach[..., self._linked] = np.minimum(former, shorter)
        return reach

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
