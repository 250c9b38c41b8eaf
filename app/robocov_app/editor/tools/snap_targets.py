"""What there is to snap to: the vertices and edges of a sketch, found quickly near a point."""

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
from robocov_app.editor.model.selection import Vertex, ring_points, rings_of
from robocov_app.editor.model.sketch import BOUNDARY, Owner, Sketch

PointKind: TypeAlias = Literal["vertex", "centre", "middle"]

MANY = 1500  # vertices of a map from which on the window does not wait for its targets
_MOST_EDGES = 8  # edges near a point that are looked at: more can only be where nothing can be told apart


class Targets:
    """What to snap to, with `more` points, without what is dragged; outlines of walls and circles too."""

    def __init__(
        self, sketch: Sketch, without: Iterable[Owner | Vertex] = (), more: Sequence[Point] = ()
    ) -> None:
        dragged = list(without)
        vertices = {each for each in dragged if isinstance(each, Vertex)}
        owners = {each for each in dragged if not isinstance(each, Vertex)}
        owners |= {item.key for item in sketch.obstacles if item.hidden}
        touched = {(vertex.of, vertex.ring) for vertex in vertices}
        rims, centres = list(more), list[Point]()
        walls, circles = list[BaseGeometry](), list[BaseGeometry]()
        points, starts, ends = list[Point](), list[Point](), list[Point]()
        for owner in (BOUNDARY, *sketch.places):
            for ring, line, closed in rings_of(sketch, owner) if owner not in owners else ():
                begin, end = line if closed else line[:-1], (*line[1:], *(line[:1] if closed else ()))
                if (owner, ring) in touched:
                    gone = [Vertex(owner, ring, k) in vertices for k in range(len(line))]
                    line = tuple(point for point, is_gone in zip(line, gone, strict=True) if not is_gone)
                    kept = [k for k in range(len(begin)) if not (gone[k] or gone[(k + 1) % len(gone)])]
                    begin, end = tuple(begin[k] for k in kept), tuple(end[k] for k in kept)
                points += line
                starts += begin
                ends += end
        for item in sketch.obstacles:
            if item.key in owners:
                continue
            if isinstance(item.shape, CircleObstacle):
                centres.append(item.shape.center)
                rims += ring_points(sketch, item.key)[0][1:]
                circles.append(item.geometry)
            elif isinstance(item.shape, WallObstacle):
                walls.append(item.geometry)
        for name, spec in sketch.starts:
            if name not in owners and isinstance(spec, DiscStart):
                centres.append(spec.center)
                rims += ring_points(sketch, name)[0][1:]
            elif name not in owners and isinstance(spec, PointsStart):
                places = enumerate(spec.positions)
                centres += [at for k, at in places if Vertex(name, 0, k) not in vertices]
        lows, highs = _array(starts), _array(ends)
        kinds = {
            "vertex": np.concatenate([_array(points), _array(rims), _outline(walls)[0]]),
            "centre": _array(centres),
            "middle": (lows + highs) / 2,
        }
        self._places = {kind: (cKDTree(at), at) for kind, at in kinds.items() if len(at)}
        # walls and circles are found by what they look like, too
        around = _outline([*walls, *circles])
        self.starts, self.ends = np.concatenate([lows, around[0]]), np.concatenate([highs, around[1]])
        low, high = np.minimum(self.starts, self.ends), np.maximum(self.starts, self.ends)
        self._edges = shapely.STRtree(shapely.box(*low.T, *high.T))
        # what is in line counts of vertices and centres, sorted along each axis
        marks = np.concatenate([kinds["vertex"], kinds["centre"]])
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
        x, y = point
        found = np.sort(self._edges.query(shapely.box(x - reach, y - reach, x + reach, y + reach)))
        starts, ends = self.starts[found], self.ends[found]
        away = np.hypot(*(nearest_on(starts, ends, np.array(point)) - point).T)
        order = np.argsort(away, kind="stable")
        order = order[away[order] <= reach][:_MOST_EDGES]
        return starts[order], ends[order]

    def in_line(self, point: Point, axis: int, reach: float, horizon: float) -> Point | None:
        """Return the mark within the horizon that is nearest along an axis, within `reach` m, then at all."""
        marks = self._sorted[axis]
        first, last = np.searchsorted(marks[:, axis], (point[axis] - reach, point[axis] + reach))
        some = marks[first:last]
        some = some[np.hypot(*(some - point).T) <= horizon]
        if not len(some):
            return None
        off = np.round(np.abs(some[:, axis] - point[axis]), 9)
        x, y = some[np.lexsort((np.hypot(*(some - point).T), off))[0]].tolist()
        return x, y


class Snapper:
    """The targets that were asked for last; of large maps worked out beside the window."""

    def __init__(self) -> None:
        self.patient = False  # to wait for the targets of large maps too
        self._sketch: Sketch | None = None
        self._key: object = None
        self._known: Targets | None = None
        self._coming: Future[Targets] | None = None
        self._pool: ThreadPoolExecutor | None = None

    def targets(
        self, sketch: Sketch, without: Iterable[Owner | Vertex] = (), more: Sequence[Point] = ()
    ) -> Targets | None:
        """Return what to snap to; None as long as that is being worked out."""
        key = frozenset(without), tuple(more)
        if self._sketch is not sketch or self._key != key:
            self._sketch, self._key, self._known, self._coming = sketch, key, None, None
            if self.patient or vertex_count(sketch) < MANY:
                self._known = Targets(sketch, *key)
            else:
                self._pool = self._pool or ThreadPoolExecutor(1, "targets")
                self._coming = self._pool.submit(Targets, sketch, *key)
        if self._known is None and self._coming is not None and self._coming.done():
            self._known = self._coming.result()
        return self._known

    def close(self) -> None:
        """End."""
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)


def vertex_count(sketch: Sketch) -> int:
    """Return about how many vertices a sketch has."""
    shapes = (item.shape for item in sketch.obstacles)
    return sum(len(getattr(shape, "vertices", getattr(shape, "points", ()))) for shape in shapes)


def _outline(geometries: list[BaseGeometry]) -> tuple[Array, Array]:
    rings = shapely.get_rings(np.array(geometries, dtype=object))
    points, ring = shapely.get_coordinates(rings, return_index=True)
    is_edge = ring[1:] == ring[:-1]
    return points[:-1][is_edge], points[1:][is_edge]


def _array(points: Sequence[Point]) -> Array:
    return np.array(points, dtype=float).reshape(-1, 2)
