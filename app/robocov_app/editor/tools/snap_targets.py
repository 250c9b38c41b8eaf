"""Points and edges of a map to which the pointer can snap."""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Literal, TypeAlias

import numpy as np
import shapely
from scipy.spatial import cKDTree

from robocov.arrays import Array
from robocov.environment import CircleObstacle, DiscStart, Point, PointsStart, Ring, WallObstacle
from robocov_app.editor.model.geometry import find_nearest_on_edges, to_array
from robocov_app.editor.model.selection import Vertex
from robocov_app.editor.model.sketch import Owner, Sketch, build_geometry
from robocov_app.render.surface_cache import LatestValue

Dragged: TypeAlias = Iterable[Owner | Vertex]
PointKind: TypeAlias = Literal["vertex", "center", "middle"]
MANY_VERTICES = 1500  # vertices of a map from which on the window does not wait for its targets
MAX_EDGES = 8  # edges near a point: where there are more, nothing can be told apart


class _TargetCollector:
    """Collects the points and edges of the objects of a map that are not dragged."""

    def __init__(self, dragged: dict[tuple[Owner, int], set[int]]) -> None:
        self.dragged = dragged
        self.vertices: list[Point] = []
        self.rim_points: list[Point] = []
        self.centers: list[Point] = []
        self.edges: list[tuple[Point, Point]] = []
        self.walls: list[shapely.Geometry] = []
        self.circles: list[shapely.Geometry] = []

    def add(self, sketch: Sketch, owner: Owner) -> None:
        """Add an object of a map."""
        shape = sketch.find_object(owner)
        if isinstance(shape, CircleObstacle | DiscStart):
            self.centers.append(shape.center)
            self.rim_points += sketch.list_vertex_rings(owner)[0][1:]
        if isinstance(shape, CircleObstacle):
            self.circles.append(build_geometry(shape))
        elif isinstance(shape, WallObstacle):
            self.walls.append(build_geometry(shape))
        elif isinstance(shape, PointsStart):
            dragged = self.dragged[owner, 0]
            self.centers += [point for k, point in enumerate(shape.positions) if k not in dragged]
        for number, ring, is_closed in sketch.list_rings(owner):
            self._add_ring(ring, is_closed, self.dragged[owner, number])

    def _add_ring(self, ring: Ring, is_closed: bool, dragged: set[int]) -> None:
        count = len(ring)
        self.vertices += [point for k, point in enumerate(ring) if k not in dragged]
        for k in range(count if is_closed else count - 1):
            following = (k + 1) % count
            if k not in dragged and following not in dragged:
                self.edges.append((ring[k], ring[following]))


class SnapTargets:
    """Snap targets of a map: vertices, centers, middles of edges, edges, and outlines of walls and circles.

    Parameters
    ----------
    sketch : Sketch
        The map; hidden obstacles are no targets.
    without : iterable of Owner or Vertex
        Objects and vertices that are dragged.
    more : sequence of Point
        Further points, m.
    """

    def __init__(self, sketch: Sketch, without: Dragged = (), more: Sequence[Point] = ()) -> None:
        dragged: dict[tuple[Owner, int], set[int]] = defaultdict(set)
        skipped: set[Owner] = {item.key for item in sketch.obstacles if item.hidden}
        for target in without:
            if isinstance(target, Vertex):
                dragged[target.owner, target.ring].add(target.index)
            else:
                skipped.add(target)
        collector = _TargetCollector(dragged)
        collector.rim_points += more
        for owner in sketch.owners:
            if owner not in skipped:
                collector.add(sketch, owner)
        starts, ends = np.array(collector.edges, dtype=float).reshape(-1, 2, 2).transpose(1, 0, 2)
        wall_corners, _ = _list_outline_edges(collector.walls)
        marks = np.concatenate([to_array([*collector.vertices, *collector.rim_points]), wall_corners])
        centers = to_array(collector.centers)
        points_by_kind = {"vertex": marks, "center": centers, "middle": (starts + ends) / 2}
        self._trees = {
            kind: (cKDTree(points), points) for kind, points in points_by_kind.items() if len(points)
        }
        # Walls and circles are found by their visible outlines, too.
        outline_starts, outline_ends = _list_outline_edges([*collector.walls, *collector.circles])
        self.starts = np.concatenate([starts, outline_starts])
        self.ends = np.concatenate([ends, outline_ends])
        low = np.minimum(self.starts, self.ends)
        high = np.maximum(self.starts, self.ends)
        self._edges = shapely.STRtree(shapely.box(*low.T, *high.T))
        # Points align with vertices and centers, sorted along each axis.
        marks = np.concatenate([marks, centers])
        self._sorted_marks = tuple(marks[np.argsort(marks[:, axis], kind="stable")] for axis in (0, 1))

    def find_nearest(self, point: Point, kind: PointKind, reach: float) -> Point | None:
        """Return the nearest target of a kind within `reach` meters, None if there is none."""
        if kind not in self._trees:
            return None
        tree, points = self._trees[kind]
        gap, index = tree.query(point, distance_upper_bound=np.nextafter(reach, np.inf))
        return _to_point(points[index]) if gap <= reach else None

    def list_edges_near(self, point: Point, reach: float) -> list[tuple[Point, Point]]:
        """Return the ends of the edges within `reach` meters, the nearest first."""
        x, y = point
        indices = np.sort(self._edges.query(shapely.box(x - reach, y - reach, x + reach, y + reach)))
        starts = self.starts[indices]
        ends = self.ends[indices]
        _, gaps = find_nearest_on_edges(starts, ends, point)
        order = np.argsort(gaps, kind="stable")
        order = order[gaps[order] <= reach][:MAX_EDGES]
        return [(_to_point(starts[k]), _to_point(ends[k])) for k in order]

    def find_aligned(self, point: Point, axis: int, reach: float, horizon: float) -> Point | None:
        """Return the mark that is best aligned with a point.

        Parameters
        ----------
        point : Point
            Position of the pointer, m.
        axis : int
            0 for marks with nearly the same x, 1 for the same y.
        reach : float
            Maximum difference along the axis, m.
        horizon : float
            Maximum distance of the mark, m.

        Returns
        -------
        Point or None
            The mark with the smallest difference along the axis, of several the nearest.
        """
        marks = self._sorted_marks[axis]
        first, last = np.searchsorted(marks[:, axis], (point[axis] - reach, point[axis] + reach))
        near = marks[first:last]
        near = near[np.hypot(*(near - point).T) <= horizon]
        if not len(near):
            return None
        differences = np.round(np.abs(near[:, axis] - point[axis]), 9)
        order = np.lexsort((np.hypot(*(near - point).T), differences))
        return _to_point(near[order[0]])


class Snapper:
    """Keeps the latest snap targets; those of large maps are computed in a thread.

    Attributes
    ----------
    patient : bool
        Whether to wait for the targets of large maps, too.
    """

    def __init__(self) -> None:
        self.patient = False
        self._latest: LatestValue[Future[SnapTargets]] = LatestValue()
        self._pool = ThreadPoolExecutor(1, "targets")

    def find_targets(
        self, sketch: Sketch, without: Dragged = (), more: Sequence[Point] = ()
    ) -> SnapTargets | None:
        """Return the snap targets of a map, None while they are being computed; see `SnapTargets`."""
        dragged = frozenset(without)
        points = tuple(more)
        future = self._latest.get(
            sketch, (dragged, points), lambda: self._pool.submit(SnapTargets, sketch, dragged, points)
        )
        if future.done() or self.patient or count_vertices(sketch) < MANY_VERTICES:
            return future.result()
        return None

    def close(self) -> None:
        """End the thread."""
        self._pool.shutdown(cancel_futures=True)


def count_vertices(sketch: Sketch) -> int:
    """Return the number of vertices of all polygons and walls, without those of holes."""
    count = 0
    for item in sketch.obstacles:
        if not isinstance(item.shape, CircleObstacle):
            count += len(sketch.list_vertex_rings(item.key)[0])
    return count


def _list_outline_edges(geometries: list[shapely.Geometry]) -> tuple[Array, Array]:
    """Return the (k, 2) starts and ends of the edges of outlines."""
    rings = shapely.get_rings(np.array(geometries, dtype=object))
    points, ring_numbers = shapely.get_coordinates(rings, return_index=True)
    is_edge = ring_numbers[1:] == ring_numbers[:-1]
    return points[:-1][is_edge], points[1:][is_edge]


def _to_point(coordinates: Array) -> Point:
    x, y = coordinates.tolist()
    return x, y
