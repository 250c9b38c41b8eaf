"""Exact shortest distances in the free space of a map: d~ of equation (22).

The distance of two points is the infimum over the paths in the *open* free space, extended to its
closure: there is no way through a point or along an edge where two obstacles touch. A shortest path
is a chain of segments that bends only at corners, so that a graph of the corners that see each
other holds all that is needed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import shapely

from robocov.arrays import Array, BoolArray, IntArray
from robocov.compiled import inner_kernel, kernel
from robocov.environment import GRID
from robocov.errors import InputError
from robocov.geodesic.corners import Corners, Walls, useful
from robocov.geodesic.orientation import BITS, Grid
from robocov.geodesic.visibility import (
    LEAF,
    Boxes,
    Fans,
    WallTree,
    along_z_curve,
    beyond_horizon,
    boxes_around,
    fans_of,
    sees,
    skipped,
    wall_tree,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from robocov.environment import Environment

BINS, CORNER_BINS = 64, 256
"""Angular bins of a source; a corner looks at many targets."""

_BLOCK = 256
"""Corners that are looked at between two beats."""


class Graph(NamedTuple):
    """The corners that see each other and can follow each other on a shortest path."""

    first: IntArray
    """(k + 1,) The links of a corner are those from its own `first` up to the next."""
    corner: IntArray
    length: Array


class Scene(NamedTuple):
    """What the kernels know of a map, all in grid steps."""

    tree: WallTree
    corners: Corners
    order: IntArray
    """(k,) The corners, neighbours together, and"""
    boxes: Boxes
    """boxes around them."""
    graph: Graph


@inner_kernel
def seen_corners(scene: Scene, fans: Fans, i: int, least: int, out: IntArray) -> int:
    """Write the corners from number `least` on in useful view of source i of `fans`; return how many.

    The fan must reach everywhere.
    """
    x, y, horizon, boxes = fans.x[i], fans.y[i], fans.horizon[i], scene.boxes
    corners, leaves, found = scene.corners, len(scene.boxes.low_x) // 2, 0
    node = 1
    while node:
        if boxes.low_x[node] == np.inf or beyond_horizon(boxes, node, x, y, horizon):
            node = skipped(node)
            continue
        if node < leaves:
            node *= 2
            continue
        begin = (node - leaves) * LEAF
        for k in scene.order[begin : begin + LEAF]:
            if (
                k >= least
                and useful(corners, k, x, y)
                and sees(scene.tree, fans, i, corners.x[k], corners.y[k])
            ):
                out[found] = k
                found += 1
        node = skipped(node)
    return found


@kernel
def corner_links(scene: Scene, begin: int, end: int) -> IntArray:
    """Return the linked pairs of a corner, from `begin` to `end`, and one of higher number, (p, 2)."""
    corners, count = scene.corners, len(scene.corners.x)
    pairs, used = np.empty((16 * (end - begin) + count, 2), dtype=np.int64), 0
    seen = np.empty(count, dtype=np.int64)
    reach = np.full(1, np.inf)
    for i in range(begin, end):
        fans = fans_of(scene.tree, corners.x[i : i + 1], corners.y[i : i + 1], reach, CORNER_BINS)
        for k in seen[: seen_corners(scene, fans, 0, i + 1, seen)]:
            # each of the two must be useful to the other
            if useful(corners, i, corners.x[k], corners.y[k]):
                if used == len(pairs):
                    more = np.empty((2 * used, 2), dtype=np.int64)
                    more[:used] = pairs
                    pairs = more
                pairs[used, 0], pairs[used, 1] = i, k
                used += 1
    return pairs[:used]


@kernel
def relax(graph: Graph, distance: Array, before: IntArray) -> None:
    """Lower the distances of the corners from the sources to those by way of other corners.

    Parameters
    ----------
    graph : Graph
    distance : (k,) grid steps
        In direct view; inf where there is none. Changed.
    before : (k,)
        Written where a distance is lowered: the corner before on the shortest path.
    """
    count = len(distance)
    waiting = distance < np.inf
    queue = np.empty(count + 1, dtype=np.int64)
    head, tail = 0, 0
    for k in np.argsort(distance):
        if waiting[k]:
            queue[tail] = k
            tail += 1
    while head != tail:
        k = queue[head]
        head = (head + 1) % (count + 1)
        waiting[k] = False
        for link in range(graph.first[k], graph.first[k + 1]):
            other, total = graph.corner[link], distance[k] + graph.length[link]
            if total < distance[other]:
                distance[other], before[other] = total, k
                if not waiting[other]:
                    waiting[other] = True
                    queue[tail] = other
                    tail = (tail + 1) % (count + 1)


@kernel
def corner_reach(scene: Scene, fans: Fans, i: int) -> Array:
    """Return the distance of source i of `fans` to the corners in useful view, (k,), inf to the others."""
    corners = scene.corners
    reach = np.full(len(corners.x), np.inf)
    seen = np.empty(len(corners.x), dtype=np.int64)
    for k in seen[: seen_corners(scene, fans, i, 0, seen)]:
        dx, dy = corners.x[k] - fans.x[i], corners.y[k] - fans.y[i]
        reach[k] = np.sqrt(dx * dx + dy * dy)
    return reach


@kernel
def distance_table(scene: Scene, px: Array, py: Array, qx: Array, qy: Array) -> Array:
    """Return the distances of (n,) sources and (m,) targets, (n, m), inf where no way leads."""
    fans = fans_of(scene.tree, px, py, np.full(len(px), np.inf), BINS)
    n, m, count = len(px), len(qx), len(scene.corners.x)
    last, before = np.empty((m, count)), np.empty(count, dtype=np.int64)
    for j in range(m):
        target = fans_of(scene.tree, qx[j : j + 1], qy[j : j + 1], np.full(1, np.inf), BINS)
        last[j] = corner_reach(scene, target, 0)
    table = np.empty((n, m))
    for i in range(n):
        reach = corner_reach(scene, fans, i)
        relax(scene.graph, reach, before)
        for j in range(m):
            best = np.inf
            if sees(scene.tree, fans, i, qx[j], qy[j]):
                dx, dy = qx[j] - px[i], qy[j] - py[i]
                best = np.sqrt(dx * dx + dy * dy)
            for k in range(count):
                best = min(best, reach[k] + last[j, k])
            table[i, j] = best
    return table


@kernel
def corners_between(scene: Scene, x: Array, y: Array) -> tuple[bool, IntArray]:
    """Return whether a way leads from the first of two points to the second, and where it bends."""
    fans = fans_of(scene.tree, x, y, np.full(2, np.inf), BINS)
    if sees(scene.tree, fans, 0, x[1], y[1]):
        return True, np.empty(0, dtype=np.int64)
    distance, before = corner_reach(scene, fans, 0), np.full(len(scene.corners.x), -1)
    relax(scene.graph, distance, before)
    total = distance + corner_reach(scene, fans, 1)
    if not np.any(total < np.inf):
        return False, np.empty(0, dtype=np.int64)
    chain, length = np.empty(len(total), dtype=np.int64), 0
    k = np.argmin(total)
    while k >= 0:
        chain[length] = k
        length += 1
        k = before[k]
    return True, chain[:length][::-1].copy()


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
    scene : Scene
        The same for kernels.
    size : float, m
        Side of the square over the region's bounding box.
    corners : (k, 2) m
        The corners.
    """

    def __init__(self, environment: Environment, beat: Callable[[], None] | None = None) -> None:
        low_x, low_y, high_x, high_y = environment.region.bounds
        self.size = max(high_x - low_x, high_y - low_y)
        self._name = environment.name
        self.walls = Walls.of(environment.free, Grid.over(np.array([low_x, low_y]), self.size))
        shapely.prepare(list(self.walls.free.geoms))
        corners = self.walls.corners
        x, y = corners.x, corners.y
        self.corners = self.walls.grid.metres(np.column_stack([x, y]))
        key = along_z_curve(*((part * 2.0 ** (16 - BITS)).clip(0, 65535).astype(np.int64) for part in (x, y)))
        order = np.argsort(key, kind="stable")
        boxes = boxes_around(x[order], y[order], x[order], y[order])
        nothing = np.empty(0, dtype=np.int64)
        graph = Graph(nothing, nothing, np.empty(0))
        self.scene = Scene(wall_tree(self.walls, 2.0**BITS), corners, order, boxes, graph)
        pieces = [np.empty((0, 2), dtype=np.int64)]
        for begin in range(0, len(x), _BLOCK):
            if beat is not None:
                beat()
            pieces.append(corner_links(self.scene, begin, min(begin + _BLOCK, len(x))))
        links = np.concatenate(pieces)
        links = np.concatenate([links, links[:, ::-1]])
        one, other = links[np.lexsort((links[:, 1], links[:, 0]))].T
        first = np.searchsorted(one, np.arange(len(x) + 1))
        length = np.sqrt((x[one] - x[other]) ** 2 + (y[one] - y[other]) ** 2)
        self.scene = self.scene._replace(graph=Graph(first, other.copy(), length))

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
            around = np.column_stack([self.walls.sectors.x, self.walls.sectors.y])
        return np.asarray(around[np.hypot(*(around - point).T).argmin()])

    def distances(self, sources: Array, targets: Array) -> Array:
        """Return the geodesic distances from (n, 2) to (m, 2) points, (n, m) m, inf where no way leads.

        Raises
        ------
        InputError
            When a point lies outside the free space.
        """
        px, py, _ = self.place(sources, "sources")
        qx, qy, _ = self.place(targets, "targets")
        return np.asarray(distance_table(self.scene, px, py, qx, qy) * self.walls.grid.unit)

    def path(self, source: Array, target: Array) -> Array:
        """Return the way-points of a shortest path, (w, 2) m, both ends included; (0, 2) where none leads.

        Raises
        ------
        InputError
            When an end lies outside the free space.
        """
        x, y, _ = self.place(np.stack([source, target]), "ends of the path")
        reached, bends = corners_between(self.scene, x, y)
        if not reached:
            return np.empty((0, 2))
        ends = self.walls.grid.metres(np.column_stack([x, y]))
        return np.concatenate([ends[:1], self.corners[bends], ends[1:]])
