"""Geodesic distances by brute force, for comparison: whole numbers, scalar code, Dijkstra's algorithm.

Every vertex of the free space, reflex or not, is split into one *germ* for each wedge of free space
at it. Two germs are linked if the open segment between them meets no wall and no vertex and starts and
ends in their wedges, or if it is a wall. A path through a vertex thus stays in one wedge and cannot pass
a point where obstacles touch. Query points on a wall become vertices first. A query point at a vertex
stands for all its germs.
"""

from __future__ import annotations

import heapq
import math
from fractions import Fraction
from itertools import pairwise
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable

    from shapely import MultiPolygon

Number: TypeAlias = int | Fraction
Node: TypeAlias = tuple[Number, Number]
Germ: TypeAlias = tuple[Node, int]


def orient(a: Node, b: Node, c: Node) -> Number:
    """Return twice the signed area of the triangle abc, which is positive if c is left of ab."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def is_strictly_on(a: Node, b: Node, c: Node) -> bool:
    """Return whether c lies on the open segment ab."""
    if orient(a, b, c) != 0 or c in (a, b):
        return False
    return (c[0] - a[0]) * (c[0] - b[0]) + (c[1] - a[1]) * (c[1] - b[1]) < 0


def is_inside_turn(v: Node, first: Node, d: Node, second: Node) -> bool:
    """Return whether v → d is strictly in the counter-clockwise turn from v → first to v → second."""
    turn = orient(v, first, second)
    is_after_first = orient(v, first, d) > 0
    if turn > 0:
        return is_after_first and orient(v, d, second) > 0
    if turn < 0:
        return not (orient(v, second, d) >= 0 and orient(v, d, first) >= 0)
    # The wall is straight.
    return is_after_first


def list_rings(free: MultiPolygon) -> list[list[tuple[float, float]]]:
    """Return the vertices of all rings of a free space. The first vertex is also the last one."""
    rings = []
    for component in free.geoms:
        rings += [list(ring.coords) for ring in (component.exterior, *component.interiors)]
    return rings


class BruteForce:
    """The geodesic distances between given points of a free space."""

    def __init__(self, free: MultiPolygon, points: Iterable[tuple[float, float]]) -> None:
        rings = list_rings(free)
        float_points = [tuple(map(float, point)) for point in points]
        coordinates = list(float_points)
        for ring in rings:
            coordinates += ring
        self.scale = max(Fraction(value).denominator for point in coordinates for value in point)
        self.points = [self._build_node(point) for point in float_points]
        self.edges: list[tuple[Node, Node]] = []
        for ring in rings:
            self._add_edges([self._build_node(point) for point in ring])
        self.wedges = {v: self._find_wedges(v) for v in {a for a, _ in self.edges}}
        self.links: dict[Germ, list[tuple[Germ, float]]] = {}
        for v, wedges in self.wedges.items():
            for k in range(len(wedges)):
                self.links[(v, k)] = []
        self._link_all()

    def _add_edges(self, ring: list[Node]) -> None:
        """Add the edges of a ring, cut at the query points on them."""
        for a, b in pairwise(ring):
            cuts = {point for point in self.points if is_strictly_on(a, b, point)}
            chain = [a, *sorted(cuts, key=lambda point: abs(point[0] - a[0]) + abs(point[1] - a[1])), b]
            self.edges += pairwise(chain)

    def _find_wedges(self, v: Node) -> list[tuple[Node, Node]]:
        """Return the ends of the two edges of each wedge of free space at a vertex."""
        wedges = []
        predecessors = [a for a, b in self.edges if b == v]
        for out in [b for a, b in self.edges if a == v]:
            for into in predecessors:
                others = [other for other in predecessors if other != into]
                if not any(is_inside_turn(v, out, other, into) for other in others):
                    wedges.append((out, into))
                    break
        return wedges

    def _link_all(self) -> None:
        vertices = sorted(self.wedges)
        for i, v in enumerate(vertices):
            for w in vertices[i + 1 :]:
                self._link_if_visible(v, w)
        for p in set(self.points) - set(vertices):
            self.links[(p, 0)] = []
            for v in vertices:
                self._link_if_visible(p, v)

    def _build_node(self, p: tuple[float, ...]) -> Node:
        x, y = p
        return int(Fraction(x) * self.scale), int(Fraction(y) * self.scale)

    def _is_clear(self, v: Node, w: Node) -> bool:
        """Return whether the open segment vw meets no vertex and crosses no wall."""
        for a, b in self.edges:
            if is_strictly_on(v, w, a):
                return False
            separates_a_and_b = orient(v, w, a) * orient(v, w, b) < 0
            if separates_a_and_b and orient(a, b, v) * orient(a, b, w) < 0:
                return False
        return True

    def _find_germ(self, v: Node, toward: Node) -> Germ | None:
        if v not in self.wedges:
            return v, 0
        for k, (out, into) in enumerate(self.wedges[v]):
            if is_inside_turn(v, out, toward, into):
                return v, k
        return None

    def _compute_length(self, v: Node, w: Node) -> float:
        return math.hypot((v[0] - w[0]) / self.scale, (v[1] - w[1]) / self.scale)

    def _add_link(self, first: Germ, second: Germ) -> None:
        length = self._compute_length(first[0], second[0])
        self.links[first].append((second, length))
        self.links[second].append((first, length))

    def _link_if_visible(self, v: Node, w: Node) -> None:
        is_wall = False
        for a, b in ((v, w), (w, v)):
            if (a, b) in self.edges:
                is_wall = True
                at_a = next(k for k, (out, _) in enumerate(self.wedges[a]) if out == b)
                at_b = next(k for k, (_, into) in enumerate(self.wedges[b]) if into == a)
                self._add_link((a, at_a), (b, at_b))
        if not is_wall and self._is_clear(v, w):
            first = self._find_germ(v, w)
            second = self._find_germ(w, v)
            if first and second:
                self._add_link(first, second)

    def compute_distances_from(self, index: int) -> list[float]:
        """Return the distance of every point from the point of this index."""
        source = self.points[index]
        best: dict[Germ, float] = {}
        queue: list[tuple[float, Germ]] = [(0.0, germ) for germ in self.links if germ[0] == source]
        while queue:
            distance, germ = heapq.heappop(queue)
            if germ in best:
                continue
            best[germ] = distance
            if germ[0] not in self.wedges and distance > 0.0:
                continue
            for other, length in self.links[germ]:
                if other not in best:
                    heapq.heappush(queue, (distance + length, other))
        result = []
        for p in self.points:
            distance = min((d for germ, d in best.items() if germ[0] == p), default=math.inf)
            if p not in self.wedges and source not in self.wedges and self._is_clear(source, p):
                distance = min(distance, self._compute_length(source, p))
            result.append(distance)
        return result


def compute_distances(
    free: MultiPolygon, sources: Iterable[tuple[float, float]], targets: Iterable[tuple[float, float]]
) -> np.ndarray:
    """Return the (n, m) geodesic distances."""
    sources = list(sources)
    brute_force = BruteForce(free, [*sources, *targets])
    rows = [brute_force.compute_distances_from(i) for i in range(len(sources))]
    return np.array([row[len(sources) :] for row in rows])


def is_well_placed(free: MultiPolygon, point: tuple[float, float], size: float) -> bool:
    """Return whether rounding cannot move a point across a wall: it is exactly on one or off all walls."""
    p = tuple(Fraction(float(c)) for c in point)
    is_clear = True
    for ring in list_rings(free):
        for a, b in pairwise([tuple(map(Fraction, vertex)) for vertex in ring]):
            if p in (a, b) or is_strictly_on(a, b, p):
                return True
            ux = b[0] - a[0]
            uy = b[1] - a[1]
            dx = p[0] - a[0]
            dy = p[1] - a[1]
            along = min(max((dx * ux + dy * uy) / (ux * ux + uy * uy), Fraction(0)), Fraction(1))
            distance = math.hypot(dx - along * ux, dy - along * uy)
            is_clear = is_clear and distance > 1e-9 * size
    return is_clear
