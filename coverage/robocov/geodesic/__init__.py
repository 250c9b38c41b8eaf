"""Exact shortest distances in the free space of a map: d~ of equation (22).

The distance of two points is the infimum over the paths in the *open* free space, extended to its
closure: there is no way through a point or along an edge where two obstacles touch. A shortest path
is a chain of segments that bends only at corners, so that a graph of the corners that see each
other holds all that is needed.
"""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np
import shapely

from robocov.arrays import Array, BoolArray, IntArray
from robocov.compiled import kernel
from robocov.environment import GRID_M, Environment
from robocov.errors import InputError
from robocov.geodesic.angular_index import AngularWallIndex, add_walls, is_box_hidden, is_visible
from robocov.geodesic.walls import (
    LEAF_SIZE,
    Grid,
    Walls,
    build_walls,
    can_bend_at_corner,
    count_windings,
    skip_subtree,
)

BINS, CORNER_BINS = 128, 256
"""Angular bins of a source; a corner looks at many targets."""

_BLOCK = 64
"""Corners that are looked at between two words of progress."""

_TARGETS = 1024
"""Targets whose views are held at once."""


class Graph(NamedTuple):
    """The corners that see each other and can follow each other on a shortest path.

    The links of a corner are those from its own `first`, (k + 1,), up to the next.
    """

    first: IntArray
    corner: IntArray
    length: Array


@kernel
def seen_corners(walls: Walls, index: AngularWallIndex, i: int, least: int, out: IntArray) -> int:
    """Write the corners from number `least` on in useful view of source i; return how many.

    The index must hold all walls.
    """
    corners, boxes = walls.corners, walls.corner_boxes
    leaves, found, node = len(boxes) // 2, 0, 1
    while node:
        if boxes[node, 0] == np.inf or is_box_hidden(boxes, node, index, i):
            node = skip_subtree(node)
            continue
        if node < leaves:
            node *= 2
            continue
        begin = (node - leaves) * LEAF_SIZE
        for k in range(max(begin, least), min(begin + LEAF_SIZE, len(corners))):
            if can_bend_at_corner(corners, k, index.sources[i, 0], index.sources[i, 1]) and is_visible(
                walls, index, i, corners[k, 0], corners[k, 1]
            ):
                out[found] = k
                found += 1
        node = skip_subtree(node)
    return found


@kernel
def _corner_links(
    walls: Walls, seen: IntArray, begin: int, end: int, index: AngularWallIndex, links: IntArray,
    lengths: Array,
) -> int:  # fmt: skip
    """Write the linked pairs of a corner, from `begin` to `end`, and one of higher number, and their lengths.

    Return how many there are, -1 if there is no room.
    """
    corners, used = walls.corners, 0
    for i in range(begin, end):
        if add_walls(walls, index, 0, corners[i, 0], corners[i, 1], np.inf, 0) < 0:
            return -1
        found = seen_corners(walls, index, 0, i + 1, seen)
        if used + found > len(links):
            return -1
        for j in range(found):
            # each of the two must be useful to the other
            x, y = corners[seen[j], 0], corners[seen[j], 1]
            if can_bend_at_corner(corners, i, x, y):
                dx, dy = x - corners[i, 0], y - corners[i, 1]
                links[used, 0], links[used, 1], lengths[used, 0] = i, seen[j], np.sqrt(dx * dx + dy * dy)
                used += 1
    return used


@kernel
def relax(graph: Graph, distance: Array, ways: IntArray, queue: IntArray, waiting: int) -> None:
    """Lower the distances of the corners from the sources to those by way of other corners.

    Of equally short ways that from the source of lowest number is taken. The distances, (k,) grid steps, are
    those in direct view, inf where there is none. The ways, (k, at least 3), are the source, the corner where
    the way from it bends first, and the corner before this one. The queue, (2, k + 1), begins with `waiting`
    corners in its first row; the second says of all corners whether they wait.
    """
    size = queue.shape[1]
    head, tail = 0, waiting
    while head != tail:
        k = queue[0, head]
        head = head + 1 if head + 1 < size else 0
        queue[1, k] = 0
        for link in range(graph.first[k], graph.first[k + 1]):
            other, total = graph.corner[link], distance[k] + graph.length[link]
            if total < distance[other] or (total == distance[other] and ways[k, 0] < ways[other, 0]):
                distance[other], ways[other, 0], ways[other, 1] = total, ways[k, 0], ways[k, 1]
                ways[other, 2] = k
                if not queue[1, other]:
                    queue[1, other], queue[0, tail] = 1, other
                    tail = tail + 1 if tail + 1 < size else 0


@kernel
def _corner_distances(
    walls: Walls, index: AngularWallIndex, graph: Graph, points: Array, bends: bool, distance: Array,
    ways: IntArray, queue: IntArray,
) -> int:  # fmt: skip
    """Write the distances of (n, 2) points to the corners, (n, k), straight or also by way of other corners.

    The ways, (k, 3), are those of the last point. Return how many entries of the index are used, -1 if there
    is no room.
    """
    used = 0
    for i in range(len(points)):
        used = add_walls(walls, index, i, points[i, 0], points[i, 1], np.inf, used)
        if used < 0:
            return -1
        for k in range(len(walls.corners)):
            distance[i, k], queue[1, k] = np.inf, 0
            ways[k, 0], ways[k, 1], ways[k, 2] = 0, k, -1
        found = seen_corners(walls, index, i, 0, queue[0])
        for j in range(found):
            k = queue[0, j]
            dx, dy = walls.corners[k, 0] - points[i, 0], walls.corners[k, 1] - points[i, 1]
            distance[i, k], queue[1, k] = np.sqrt(dx * dx + dy * dy), 1
        if bends:
            relax(graph, distance[i], ways, queue, found)
    return used


@kernel
def _shortest(
    walls: Walls, index: AngularWallIndex, reach: Array, points: Array, last: Array, near: IntArray,
    table: Array,
) -> None:  # fmt: skip
    """Write the distances of sources and (m, 2) points, (n, m), by those to corners, (n, k) and (m, k).

    There is room for k numbers in `near`.
    """
    for j in range(len(points)):
        count = 0
        for k in range(len(near)):
            if last[j, k] < np.inf:
                near[count] = k
                count += 1
        for i in range(len(reach)):
            best = np.inf
            if is_visible(walls, index, i, points[j, 0], points[j, 1]):
                dx, dy = points[j, 0] - index.sources[i, 0], points[j, 1] - index.sources[i, 1]
                best = np.sqrt(dx * dx + dy * dy)
            for k in range(count):
                best = min(best, reach[i, near[k]] + last[j, near[k]])
            table[i, j] = best


class Geodesics:
    """The shortest paths of one environment; immutable.

    `beat` is called now and then while what is needed is computed. It may raise, to give up. Points that are
    not in the free space are refused, see `place`.

    The free space, one polygon a component, and the walls are in coordinates of the grid. In metres are the
    corners, (k, 2), and the size, the side of the square over the region's bounding box.
    """

    def __init__(self, environment: Environment, beat: Callable[[], None] | None = None) -> None:
        low_x, low_y, high_x, high_y = environment.region.bounds
        self.size = max(high_x - low_x, high_y - low_y)
        self._name = environment.name
        self.grid = Grid.from_square(np.array([low_x, low_y]), self.size)
        self.free = shapely.transform(environment.free, self.grid.snap)
        self.walls = build_walls(self.free)
        self.corners = self.grid.to_metres(self.walls.corners[:, :2])
        # so many entries for each source were enough so far
        self._room = {BINS: 256, CORNER_BINS: 1 << 14}
        count = len(self.corners)
        seen = np.empty(count, np.int64)
        links, lengths = self.run_for_corners(
            partial(_corner_links, self.walls, seen), beat and (lambda _: beat())
        )
        one, other = np.concatenate([links[:, :2], links[:, 1::-1]]).T
        order = np.lexsort((other, one))
        first = np.searchsorted(one[order], np.arange(count + 1))
        self.graph = Graph(first, other[order], np.tile(lengths[:, 0], 2)[order])

    def run_for_corners(
        self, look: Callable[..., int], progress: Callable[[float], None] | None
    ) -> tuple[IntArray, Array]:
        """Return what `look` writes about the corners, some at a time; tell which part is done."""
        count, pieces = len(self.corners), [(np.empty((0, 3), np.int64), np.empty((0, 2)))]
        for begin in range(0, count, _BLOCK):
            if progress is not None:
                progress(begin / count)
            some = partial(look, begin, min(begin + _BLOCK, count))
            pieces.append(self.run_with_index(1, CORNER_BINS, some)[1:])
        numbers, lengths = map(np.concatenate, zip(*pieces, strict=True))
        return numbers, lengths

    def run_with_index(
        self, n: int, bins: int, fill: Callable[[AngularWallIndex, IntArray, Array], int]
    ) -> tuple[AngularWallIndex, IntArray, Array]:
        """Return an index of n sources, and what is written of numbers, (used, 3), and lengths, (used, 2).

        `fill` writes all of these and returns how many rows it used, -1 if it wants more room.
        """
        while True:
            entries = self._room[bins] * n + 2 * bins
            index = AngularWallIndex.allocate(n, bins, entries)
            numbers, lengths = np.empty((entries, 3), np.int64), np.empty((entries, 2))
            used = fill(index, numbers, lengths)
            if used >= 0:
                return index, numbers[:used].copy(), lengths[:used].copy()
            self._room[bins] *= 2

    def snap_to_free_space(self, points: Array, what: str = "positions") -> tuple[Array, BoolArray]:
        """Return (n, 2) points in grid coordinates, and (n, c) which component's closure holds which.

        Those a hair outside the free space are moved into it. Raises InputError, which calls them `what`,
        when one lies outside by more than rounding (2 µm and 1e-9 of the map's size), or is not finite.
        """
        points = np.asarray(points, dtype=float)
        if points.ndim != 2 or points.shape[1] != 2:
            wanted = "one [x, y] in metres each was wanted"
            raise InputError(f"{what}: an array of shape {points.shape}, but {wanted}")
        places = self.grid.snap(points)
        # what is not finite is right of, or above, all walls
        holds = self.count_windings(places) > 0
        for i in np.flatnonzero(~holds.any(axis=1)):
            place = f"{what}[{i}] = [{points[i, 0]:.12g}, {points[i, 1]:.12g}]"
            if not np.isfinite(points[i]).all():
                raise InputError(f"{place}: finite numbers were wanted")
            moved = self._nearest_free(places[i])
            depth = float(np.hypot(*(moved - places[i]))) * self.grid.unit
            if depth > 2.0 * GRID_M + 1e-9 * self.size:
                raise InputError(
                    f"{place} is {depth:.3g} m outside the free space of map {self._name!r}; "
                    f"a point inside the boundary and outside every obstacle was wanted"
                )
            places[i] = moved
            holds[i] = self.count_windings(moved[None])[0] > 0
        return places, holds

    def count_windings(self, places: Array) -> IntArray:
        """Return how often components wind round (n, 2) grid points, (n, c): once inside, more on them."""
        holds = np.empty((len(places), len(self.free.geoms)), dtype=np.int64)
        count_windings(self.walls, np.ascontiguousarray(places), holds)
        return holds

    def _nearest_free(self, place: Array) -> Array:
        """Return the nearest grid point of the closed free space, to within a few steps."""
        line = shapely.shortest_line(self.free, shapely.Point(place))
        foot = np.rint(shapely.get_coordinates(line)[0])
        # the foot on a slanted wall is no grid point: the nearest that is not behind the wall
        steps = np.arange(-2.0, 3.0)
        around = foot + np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
        around = around[(self.count_windings(around) > 0).any(axis=1)]
        around = around if len(around) else self.walls.vertices
        return np.asarray(around[np.hypot(*(around - place).T).argmin()])

    def _to_corners(self, places: Array, *, bends: bool) -> tuple[AngularWallIndex, Array, IntArray]:
        """Return views of (n, 2) places, their distances to the corners, (n, k), and the last one's ways."""
        n, count = len(places), len(self.corners)
        distance, ways = np.empty((n, count)), np.empty((count, 3), dtype=np.int64)
        queue = np.empty((2, count + 1), np.int64)

        def fill(index: AngularWallIndex, *_: object) -> int:
            return int(_corner_distances(self.walls, index, self.graph, places, bends, distance, ways, queue))

        return self.run_with_index(n, BINS, fill)[0], distance, ways

    def compute_distances(self, sources: Array, targets: Array) -> Array:
        """Return the geodesic distances from (n, 2) to (m, 2) points, (n, m) m, inf where no way leads."""
        begins, _ = self.snap_to_free_space(sources, "sources")
        ends, _ = self.snap_to_free_space(targets, "targets")
        return self.compute_grid_distances(begins, ends) * self.grid.unit

    def compute_grid_distances(self, begins: Array, ends: Array) -> Array:
        """Return the same of free places in grid coordinates, in grid steps."""
        index, reach, _ = self._to_corners(begins, bends=True)
        table = np.empty((len(begins), len(ends)))
        for k in range(0, len(ends), _TARGETS):
            some = ends[k : k + _TARGETS]
            part = np.empty((len(begins), len(some)))
            last = self._to_corners(some, bends=False)[1]
            _shortest(self.walls, index, reach, some, last, np.empty(last.shape[1], np.int64), part)
            table[:, k : k + _TARGETS] = part
        return table

    def find_path(self, source: Array, target: Array) -> Array:
        """Return the way-points of a shortest path, (w, 2) m, both ends included; (0, 2) where none leads."""
        ends, _ = self.snap_to_free_space(np.stack([source, target]), "ends of the path")
        index, reach, ways = self._to_corners(ends[:1], bends=True)
        last, shortest = self._to_corners(ends[1:], bends=False)[1], np.empty((1, 1))
        _shortest(self.walls, index, reach, ends[1:], last, np.empty(last.shape[1], np.int64), shortest)
        if np.isinf(shortest[0, 0]):
            return np.empty((0, 2))
        total = reach[0] + last[0]
        chain, corner = [], int(total.argmin()) if total.min(initial=np.inf) <= shortest[0, 0] else -1
        while corner >= 0:
            chain.append(corner)
            corner = int(ways[corner, 2])
        metres = self.grid.to_metres(ends)
        return np.concatenate([metres[:1], self.corners[chain[::-1]], metres[1:]])
