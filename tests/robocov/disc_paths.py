"""Shortest paths of discs, for comparison, from straight pieces and arcs around corners.

The center of a disc keeps its radius from walls. Its shortest paths consist of straight pieces and of arcs of
this radius around corners, which the straight pieces touch. All such pieces that keep the radius from walls
are the edges of a graph, on which Dijkstra's algorithm finds exact shortest paths.

For the shortest path that passes all obstacles on given sides, each obstacle has a ray to the right. Two
paths with the same ends pass all obstacles on the same sides if they cross each ray equally often, where
crossings in opposite directions cancel out. There are exceptions, but not among pairs of shortest paths.
"""

from __future__ import annotations

import heapq
import math
import operator
from collections import defaultdict
from typing import NamedTuple, TypeAlias

import numpy as np
import shapely
from shapely import MultiPolygon

from robocov.typing import FloatArray, IntArray

CLEARANCE_TOLERANCE_M = 1e-6
"""Distance by which a straight piece may be closer to a wall than the radius because of rounding."""
ARC_TOLERANCE = 1e-4
"""The same for arcs, relative to the radius. Chords stand for arcs."""
ARC_STEP_RAD = 0.02
"""Maximum angle of a chord."""
Crossings: TypeAlias = tuple[int, ...]
"""For each ray, how often a path crosses it upward minus how often it crosses it downward."""


class DiscPath(NamedTuple):
    """A path of the center of a disc."""

    length: float
    """Length, m."""
    turning: float
    """Sum of the angles of all arcs, rad."""


class _Edge(NamedTuple):
    """A piece of a path."""

    end: int
    length: float
    turning: float
    crossings: Crossings


class Rays:
    """A ray to the right from a point in each obstacle, for the holes of a free space.

    Parameters
    ----------
    free : MultiPolygon, m
    """

    def __init__(self, free: MultiPolygon) -> None:
        holes = [ring for component in free.geoms for ring in component.interiors]
        points = shapely.point_on_surface(shapely.polygons(holes)) if holes else np.empty(0, dtype=object)
        self.origins = shapely.get_coordinates(points)

    def count_crossings(self, path: FloatArray) -> Crossings:
        """Count the crossings of a path, (w, 2) m, with each ray: 1 for each upward, -1 for each downward."""
        starts = path[:-1, None]
        ends = path[1:, None]
        is_upper_start = starts[..., 1] > self.origins[:, 1]
        is_upper_end = ends[..., 1] > self.origins[:, 1]
        is_crossing = is_upper_start != is_upper_end
        rises = np.where(is_crossing, ends[..., 1] - starts[..., 1], 1.0)
        fractions = (self.origins[:, 1] - starts[..., 1]) / rises
        x = starts[..., 0] + fractions * (ends[..., 0] - starts[..., 0])
        is_crossing &= x > self.origins[:, 0]
        signs = np.where(is_upper_end, 1, -1)
        return tuple((signs * is_crossing).sum(axis=0).tolist())


def find_corners(free: MultiPolygon) -> FloatArray:
    """Return the corners of the walls around which paths can turn, (k, 2) m."""
    corners = [np.empty((0, 2))]
    for component in shapely.orient_polygons(np.array(free.geoms)):
        for ring in (component.exterior, *component.interiors):
            # The free space is on the left of its rings.
            points = shapely.get_coordinates(ring)[:-1]
            before = points - np.roll(points, 1, axis=0)
            after = np.roll(points, -1, axis=0) - points
            turns = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
            corners.append(points[turns < 0.0])
    return np.concatenate(corners)


class DiscPaths:
    """All pieces of shortest paths of a disc between two points.

    Parameters
    ----------
    free : MultiPolygon, m
        The free space.
    radius : float, m
        Radius of the disc.
    source, target : (2,) array, m
        The ends of the paths, at least the radius from walls.
    rays : Rays
        Rays that count on which side a path passes each obstacle.
    """

    def __init__(
        self, free: MultiPolygon, radius: float, source: FloatArray, target: FloatArray, rays: Rays
    ) -> None:
        self.radius = radius
        self._target = (float(target[0]), float(target[1]))
        self._rays = rays
        self._walls = free.boundary
        shapely.prepare(self._walls)
        corners = find_corners(free)
        self._centers = np.vstack([corners, source, target])
        self._radii = np.append(np.full(len(corners), radius), [0.0, 0.0])
        self._nodes: list[tuple[float, float]] = []
        self._edges: dict[int, list[_Edge]] = defaultdict(list)
        nodes_by_circle = self._add_tangents()
        for circle in range(len(corners)):
            self._add_arcs(circle, nodes_by_circle[circle])
        source_circle = len(corners)
        # All nodes of a point are at the same position.
        self._source_nodes = nodes_by_circle[source_circle]
        self._target_nodes = set(nodes_by_circle[source_circle + 1])

    def _add_tangents(self) -> dict[int, list[int]]:
        """Add the straight pieces; return the nodes on each circle."""
        circles, segments = self._build_tangents()
        keeps_radius = ~shapely.dwithin(
            self._walls, shapely.linestrings(segments), self.radius - CLEARANCE_TOLERANCE_M
        )
        nodes_by_circle: dict[int, list[int]] = defaultdict(list)
        for pair, segment in zip(circles[keeps_radius].tolist(), segments[keeps_radius], strict=True):
            nodes = []
            for circle, point in zip(pair, segment, strict=True):
                nodes_by_circle[circle].append(len(self._nodes))
                nodes.append(len(self._nodes))
                self._nodes.append((float(point[0]), float(point[1])))
            self._add_edge(nodes[0], nodes[1], segment, length=math.dist(*segment), turning=0.0)
        return nodes_by_circle

    def _build_tangents(self) -> tuple[IntArray, FloatArray]:
        """Build the tangents of all pairs of circles: the circles, (t, 2), and the segments, (t, 2, 2) m."""
        first, second = np.triu_indices(len(self._centers), k=1)
        offsets = self._centers[second] - self._centers[first]
        distances = np.hypot(*offsets.T)
        pairs = []
        segments = []
        # A path turns left around a circle with the sign 1, and right around one with the sign -1.
        for first_sign in (1.0, -1.0):
            for second_sign in (1.0, -1.0):
                first_radii = first_sign * self._radii[first]
                second_radii = second_sign * self._radii[second]
                differences = second_radii - first_radii
                has_tangent = (distances > np.abs(differences)) & (distances > 0.0)
                sines = differences[has_tangent] / distances[has_tangent]
                angles = np.arctan2(*offsets[has_tangent].T[::-1]) - np.arcsin(sines)
                normals = np.column_stack([-np.sin(angles), np.cos(angles)])
                starts = self._centers[first][has_tangent] - first_radii[has_tangent, None] * normals
                ends = self._centers[second][has_tangent] - second_radii[has_tangent, None] * normals
                pairs.append(np.column_stack([first, second])[has_tangent])
                segments.append(np.stack([starts, ends], axis=1))
        return np.concatenate(pairs), np.concatenate(segments)

    def _add_arcs(self, circle: int, nodes: list[int]) -> None:
        """Add the arcs between neighboring nodes on a circle that keep the radius from walls."""
        if len(nodes) < 2:
            return
        center = self._centers[circle]
        offsets = np.array([self._nodes[node] for node in nodes]) - center
        angles = np.arctan2(offsets[:, 1], offsets[:, 0])
        order = np.argsort(angles)
        for k, following in zip(order.tolist(), np.roll(order, -1).tolist(), strict=True):
            turning = float((angles[following] - angles[k]) % (2.0 * math.pi))
            count = 2 + int(turning / ARC_STEP_RAD)
            steps = angles[k] + np.linspace(0.0, turning, count)
            points = center + self.radius * np.column_stack([np.cos(steps), np.sin(steps)])
            if not shapely.dwithin(
                self._walls, shapely.linestrings(points), (1.0 - ARC_TOLERANCE) * self.radius
            ):
                # The ends must be exactly those of the straight pieces, so that crossings add up.
                points[0] = self._nodes[nodes[k]]
                points[-1] = self._nodes[nodes[following]]
                self._add_edge(
                    nodes[k], nodes[following], points, length=self.radius * turning, turning=turning
                )

    def _add_edge(self, start: int, end: int, points: FloatArray, *, length: float, turning: float) -> None:
        """Add a piece in both directions."""
        crossings = self._rays.count_crossings(points)
        self._edges[start].append(_Edge(end, length, turning, crossings))
        backward_crossings = tuple(-count for count in crossings)
        self._edges[end].append(_Edge(start, length, turning, backward_crossings))

    def find_shortest(
        self, crossings: Crossings | None = None, max_length: float = np.inf
    ) -> DiscPath | None:
        """Find the shortest path.

        Parameters
        ----------
        crossings : tuple of int, optional
            Crossings of the path with each ray, so that it passes all obstacles on given sides. By default,
            all paths are compared.
        max_length : float, m
            Length above which the search ends.

        Returns
        -------
        DiscPath or None
            None if there is no such path.
        """
        # Each entry has a lower bound on the length of a path to the target, the length and turning of its
        # first part, the node at the end of this part, and the crossings.
        no_crossings = (0,) * len(self._rays.origins)
        queue = [(0.0, 0.0, 0.0, node, no_crossings) for node in self._source_nodes]
        visited = set()
        while queue:
            bound, length, turning, node, crossed = heapq.heappop(queue)
            if bound > max_length:
                return None
            state = (node, None if crossings is None else crossed)
            if state in visited:
                continue
            visited.add(state)
            if node in self._target_nodes and crossings in (None, crossed):
                return DiscPath(length, turning)
            for edge in self._edges[node]:
                next_length = length + edge.length
                next_bound = next_length + math.dist(self._nodes[edge.end], self._target)
                next_turning = turning + edge.turning
                next_crossed = tuple(map(operator.add, crossed, edge.crossings))
                heapq.heappush(queue, (next_bound, next_length, next_turning, edge.end, next_crossed))
        return None
