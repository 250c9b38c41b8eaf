"""What there is to snap to: the vertices and edges of a sketch, found quickly near a point."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Literal, TypeAlias

import numpy as np
import shapely
from scipy.spatial import cKDTree
from shapely.geometry.base import BaseGeometry

from robocov.arrays import Array
from robocov.environment import CircleObstacle, DiscStart, Point, PointsStart, WallObstacle
from robocov_app.editor.model.geometry import nearest_on
from robocov_app.editor.model.selection import Vertex, ring_points
from robocov_app.editor.model.sketch import BOUNDARY, Owner, Sketch

PointKind: TypeAlias = Literal["vertex", "centre", "middle"]

_MOST_EDGES = 8
"""Edges near a point that are looked at: more can only be where nothing can be told apart."""


class Targets:
    """The vertices and edges of a sketch, to snap to: made once at the begin of a drag.

    Of a wall, its middle line and its outline; of a circle, its centre, its rim and the four ends of that.

    Parameters
    ----------
    sketch : Sketch
    without : owners or vertices
        What is being dragged, and so is no target: of a vertex, itself and its edges only.
    more : points, m
        More points to snap to, such as those drawn so far.
    """

    def __init__(
        self, sketch: Sketch, without: Iterable[Owner | Vertex] = (), more: Sequence[Point] = ()
    ) -> None:
        dragged = list(without)
        owners = {each for each in dragged if not isinstance(each, Vertex)}
        vertices = {each for each in dragged if isinstance(each, Vertex)}
        lines = _Lines(vertices)
        centres: list[Point] = []
        rims: list[Point] = list(more)
        walls: list[BaseGeometry] = []
        circles: list[BaseGeometry] = []
        if BOUNDARY not in owners:
            lines.take(sketch, BOUNDARY, closed=True)
        for item in sketch.obstacles:
            if item.key in owners:
                continue
            if isinstance(item.shape, CircleObstacle):
                centres.append(item.shape.center)
                rims += ring_points(sketch, item.key)[0][1:]
                circles.append(item.geometry)
                continue
            is_wall = isinstance(item.shape, WallObstacle)
            lines.take(sketch, item.key, closed=not is_wall)
            if is_wall:
                walls.append(item.geometry)
        for name, spec in sketch.starts:
            if name not in owners and isinstance(spec, DiscStart):
                centres.append(spec.center)
                rims += ring_points(sketch, name)[0][1:]
            elif name not in owners and isinstance(spec, PointsStart):
                places = enumerate(spec.positions)
                centres += [at for k, at in places if Vertex(name, 0, k) not in vertices]
        self._take(lines, centres, rims, walls, circles)

    def _take(
        self,
        lines: _Lines,
        centres: list[Point],
        rims: list[Point],
        walls: list[BaseGeometry],
        circles: list[BaseGeometry],
    ) -> None:
        """Make the indices."""
        starts, ends = lines.edges()
        places = {
            "vertex": np.concatenate([lines.points(), _array(rims), _outline(walls)[0]]),
            "centre": _array(centres),
            "middle": (starts + ends) / 2,
        }
        # walls and circles are found by what they look like, too
        around = _outline([*walls, *circles])
        self.starts, self.ends = np.concatenate([starts, around[0]]), np.concatenate([ends, around[1]])
        self._places = {kind: (cKDTree(at), at) for kind, at in places.items() if len(at)}
        low, high = np.minimum(self.starts, self.ends), np.maximum(self.starts, self.ends)
        self._edges = shapely.STRtree(shapely.box(*low.T, *high.T)) if len(low) else None
        # what is in line counts of vertices and centres, sorted along each axis
        marks = np.concatenate([places["vertex"], places["centre"]])
        self._sorted = tuple(marks[np.argsort(marks[:, axis], kind="stable")] for axis in (0, 1))

    def nearest(self, point: Point, kind: PointKind, reach: float) -> Point | None:
        """Return the nearest point of a kind within `reach` metres."""
        if kind not in self._places:
            return None
        tree, places = self._places[kind]
        away, k = tree.query(point, distance_upper_bound=np.nextafter(reach, np.inf))
        if not away <= reach:
            return None
        x, y = places[k].tolist()
        return x, y

    def edges_near(self, point: Point, reach: float) -> tuple[Array, Array]:
        """Return the starts and the ends, (k, 2) m each, of the edges within `reach`, the nearest first."""
        empty = np.empty((0, 2))
        if self._edges is None:
            return empty, empty
        x, y = point
        found = np.sort(self._edges.query(shapely.box(x - reach, y - reach, x + reach, y + reach)))
        starts, ends = self.starts[found], self.ends[found]
        away = np.hypot(*(nearest_on(starts, ends, np.array(point)) - point).T)
        order = np.argsort(away, kind="stable")
        order = order[away[order] <= reach][:_MOST_EDGES]
        return starts[order], ends[order]

    def in_line(self, point: Point, axis: int, reach: float, horizon: float) -> Point | None:
        """Return the mark whose coordinate on an axis is nearest to the point's, within `reach` metres.

        Only marks within `horizon` metres count; of several in line, the one that is nearest to the point.
        """
        marks = self._sorted[axis]
        first, last = np.searchsorted(marks[:, axis], (point[axis] - reach, point[axis] + reach))
        some = marks[first:last]
        some = some[np.hypot(*(some - point).T) <= horizon]
        if not len(some):
            return None
        off = np.round(np.abs(some[:, axis] - point[axis]), 9)
        x, y = some[np.lexsort((np.hypot(*(some - point).T), off))[0]].tolist()
        return x, y


class _Lines:
    """Rings that are collected: vertices and the edges between them, but for some vertices."""

    def __init__(self, without: set[Vertex]) -> None:
        self._without = without
        self._points: list[Point] = []
        self._counts: list[int] = []
        self._closed: list[bool] = []
        self._gone: list[int] = []

    def take(self, sketch: Sketch, owner: Owner, *, closed: bool) -> None:
        """Take the rings of something."""
        for ring, points in enumerate(ring_points(sketch, owner)):
            if points:
                first = len(self._points)
                self._gone += [
                    first + vertex.index
                    for vertex in self._without
                    if vertex.of == owner and vertex.ring == ring and vertex.index < len(points)
                ]
                self._points += points
                self._counts.append(len(points))
                self._closed.append(closed)

    def points(self) -> Array:
        """Return the (n, 2) vertices that are left."""
        return np.delete(_array(self._points), self._gone, axis=0)

    def edges(self) -> tuple[Array, Array]:
        """Return the (m, 2) starts and ends of the edges that are left."""
        points = _array(self._points)
        counts = np.array(self._counts, dtype=np.intp)
        last = np.cumsum(counts) - 1
        after = np.arange(1, len(points) + 1)
        after[last] -= counts
        kept = np.ones(len(points), dtype=bool)
        kept[last[~np.array(self._closed, dtype=bool)]] = False
        if self._gone:
            kept &= ~np.isin(np.arange(len(points)), self._gone) & ~np.isin(after, self._gone)
        return points[kept], points[after[kept]]


def _outline(geometries: list[BaseGeometry]) -> tuple[Array, Array]:
    """Return the (k, 2) starts and ends of the edges of polygons."""
    rings = shapely.get_rings(np.array(geometries, dtype=object))
    points, ring = shapely.get_coordinates(rings, return_index=True)
    is_edge = ring[1:] == ring[:-1]
    return points[:-1][is_edge], points[1:][is_edge]


def _array(points: Sequence[Point]) -> Array:
    return np.array(points, dtype=float).reshape(-1, 2)


MANY = 1500
"""Vertices of a map from which on the window does not wait for its targets."""


def vertex_count(sketch: Sketch) -> int:
    """Return about how many vertices a sketch has."""
    shapes = (item.shape for item in sketch.obstacles)
    return sum(len(getattr(shape, "vertices", getattr(shape, "points", ()))) for shape in shapes)


class Snapper:
    """Keeps the targets that were asked for last.

    Attributes
    ----------
    patient : bool
        Wait for the targets of large maps too.
    """

    def __init__(self) -> None:
        self.patient = False
        self._sketch: Sketch | None = None
        self._key: object = None
        self._known: Targets | None = None
        self._coming: Future[Targets] | None = None
        self._pool: ThreadPoolExecutor | None = None

    def targets(
        self, sketch: Sketch, without: Iterable[Owner | Vertex] = (), more: Sequence[Point] = ()
    ) -> Targets | None:
        """Return what to snap to; None as long as that is being worked out."""
        without, more = frozenset(without), tuple(more)
        if self._sketch is not sketch or self._key != (without, more):
            self._sketch, self._key = sketch, (without, more)
            self._known, self._coming = None, None
            if self.patient or vertex_count(sketch) < MANY:
                self._known = Targets(sketch, without, more)
            else:
                self._pool = self._pool or ThreadPoolExecutor(1, "targets")
                self._coming = self._pool.submit(Targets, sketch, without, more)
        if self._known is None and self._coming is not None and self._coming.done():
            self._known = self._coming.result()
        return self._known

    def close(self) -> None:
        """End."""
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)
