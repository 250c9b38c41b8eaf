"""Collection of the points and edges of a map to which the pointer can snap."""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeAlias

import numpy as np
import shapely

from robocov.environment import CircleObstacle, DiscStart, Point, PointsStart, WallObstacle
from robocov_app.editor.model.geometry import to_array
from robocov_app.editor.model.selection import Vertex
from robocov_app.editor.model.sketch import Owner, Sketch, VertexRing, build_geometry
from robocov_app.render.surface_cache import LatestValue
from robocov_app.toolkit.tools.snap_targets import Edges, SnapTargets, list_outline_edges

Dragged: TypeAlias = Iterable[Owner | Vertex]
MANY_VERTICES = 1500  # in maps with fewer vertices, the window waits for the targets


class _TargetCollector:
    """Collects the points and edges of objects, without the vertices that are being dragged."""

    def __init__(self, dragged: dict[tuple[Owner, int], set[int]]) -> None:
        self.dragged = dragged  # indices of dragged vertices by (owner, ring)
        self.vertices: list[Point] = []
        self.other_points: list[Point] = []  # on the rims of circles, for example
        self.centers: list[Point] = []
        self.edges: list[tuple[Point, Point]] = []
        self.walls: list[shapely.Geometry] = []
        self.circles: list[shapely.Geometry] = []

    def add(self, sketch: Sketch, owner: Owner) -> None:
        """Add the points and edges of an object."""
        shape = sketch.get_shape(owner)
        dragged = self.dragged[owner, 0]
        if isinstance(shape, PointsStart):
            self.centers += [point for k, point in enumerate(shape.positions) if k not in dragged]
        elif not dragged:
            # A circle, disc or wall whose vertex is dragged changes with it, and offers no targets.
            self._add_outline(sketch, owner)
        for ring in sketch.list_rings(owner):
            self._add_ring(ring, self.dragged[owner, ring.number])

    def build_targets(self) -> SnapTargets:
        """Build the snap targets from everything that was added."""
        starts, ends = np.array(self.edges, dtype=float).reshape(-1, 2, 2).transpose(1, 0, 2)
        wall_corners = list_outline_edges(self.walls).starts
        vertices = np.concatenate([to_array([*self.vertices, *self.other_points]), wall_corners])
        # The pointer also snaps to the visible outlines of walls and circles.
        outlines = list_outline_edges([*self.walls, *self.circles])
        return SnapTargets(vertices, to_array(self.centers), Edges(starts, ends), outlines)

    def _add_outline(self, sketch: Sketch, owner: Owner) -> None:
        """Add the center and the rim of a circle, or the outline of a wall."""
        shape = sketch.get_shape(owner)
        if isinstance(shape, CircleObstacle | DiscStart):
            self.centers.append(shape.center)
            self.other_points += sketch.list_vertex_rings(owner)[0][1:]
        if isinstance(shape, CircleObstacle):
            self.circles.append(build_geometry(shape))
        elif isinstance(shape, WallObstacle):
            self.walls.append(build_geometry(shape))

    def _add_ring(self, ring: VertexRing, dragged: set[int]) -> None:
        points = ring.points
        self.vertices += [point for k, point in enumerate(points) if k not in dragged]
        for k in range(ring.edge_count):
            following = (k + 1) % len(points)
            if k not in dragged and following not in dragged:
                self.edges.append((points[k], points[following]))


def collect_snap_targets(
    sketch: Sketch, ignored: Dragged = (), extra_points: Sequence[Point] = ()
) -> SnapTargets:
    """Collect the snap targets of a map: vertices, centers, edges, and outlines of walls and circles.

    Parameters
    ----------
    sketch : Sketch
        The map. Hidden obstacles are ignored.
    ignored : iterable of Owner or Vertex
        Objects and vertices to ignore, because they are being dragged.
    extra_points : sequence of Point
        Additional points, m.
    """
    dragged: dict[tuple[Owner, int], set[int]] = defaultdict(set)
    skipped: set[Owner] = {item.key for item in sketch.obstacles if item.hidden}
    for target in ignored:
        if isinstance(target, Vertex):
            dragged[target.owner, target.ring].add(target.index)
        else:
            skipped.add(target)
    collector = _TargetCollector(dragged)
    collector.other_points += extra_points
    for owner in sketch.owners:
        if owner not in skipped:
            collector.add(sketch, owner)
    return collector.build_targets()


class Snapper:
    """Computes snap targets in a thread, and caches the latest ones.

    Attributes
    ----------
    waits_for_targets : bool
        Whether to wait even for the targets of large maps.
    """

    def __init__(self) -> None:
        self.waits_for_targets = False
        self._latest: LatestValue[Future[SnapTargets]] = LatestValue()
        self._pool = ThreadPoolExecutor(1, "targets")

    def find_targets(
        self, sketch: Sketch, ignored: Dragged = (), extra_points: Sequence[Point] = ()
    ) -> SnapTargets | None:
        """Return the targets from `collect_snap_targets`; None while those of a large map are computed."""
        # The key of the cache must be hashable.
        dragged = frozenset(ignored)
        points = tuple(extra_points)
        future = self._latest.get_or_compute(
            sketch,
            (dragged, points),
            lambda: self._pool.submit(collect_snap_targets, sketch, dragged, points),
        )
        must_wait = self.waits_for_targets or count_vertices(sketch) < MANY_VERTICES
        if must_wait or future.done():
            return future.result()
        return None

    def close(self) -> None:
        """End the thread."""
        self._pool.shutdown(cancel_futures=True)


def count_vertices(sketch: Sketch) -> int:
    """Count the vertices of all polygons and walls, without those of holes."""
    count = 0
    for item in sketch.obstacles:
        if not isinstance(item.shape, CircleObstacle):
            count += len(sketch.list_vertex_rings(item.key)[0])
    return count
