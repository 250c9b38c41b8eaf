"""Geodesic distances by brute force, for comparison: whole numbers, scalar code, Dijkstra's algorithm.

Every vertex of the free space, reflex or not, falls into one *germ* for each wedge of free space at
it. Two germs are linked when the open segment between them meets no wall and no vertex and starts and
ends in their wedges, or when it is a wall. Whatever passes through a vertex thus stays in one
wedge: nothing slips through a point where obstacles touch. Query points on a wall become vertices
first; a query point at a vertex stands for all its germs.
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
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def is_strictly_on(a: Node, b: Node, c: Node) -> bool:
    """Whether c lies on the open segment ab."""
    if orient(a, b, c) != 0 or c in (a, b):
        return False
    return (c[0] - a[0]) * (c[0] - b[0]) + (c[1] - a[1]) * (c[1] - b[1]) < 0


def is_inside_turn(v: Node, first: Node, d: Node, second: Node) -> bool:
    """Whether the direction v → d lies strictly in the counter-clockwise turn from `first` to `second`."""
    turn = orient(v, first, second)
    after_first, before_second = orient(v, first, d) > 0, orient(v, d, second) > 0
    if turn > 0:
        return after_first and before_second
    if turn < 0:
        return not (orient(v, second, d) >= 0 and orient(v, d, first) >= 0)
    return after_first  # a straight wall


class BruteForce:
    """Distances between some points of a free space."""

    def __init__(self, free: MultiPolygon, points: Iterable[tuple[float, float]]) -> None:
        rings = [ring for part in free.geoms for ring in (part.exterior, *part.interiors)]
        given = [tuple(map(float, p)) for p in points]
        values = [Fraction(c) for ring in rings for p in ring.coords for c in p]
        values += [Fraction(c) for p in given for c in p]
        self.scale = max(value.denominator for value in values)
        self.points = [self._build_node(p) for p in given]
        self.edges: list[tuple[Node, Node]] = []
        for ring in rings:
            nodes = [self._build_node(p) for p in ring.coords]
            for a, b in pairwise(nodes):
                cuts = {p for p in self.points if is_strictly_on(a, b, p)}
                chain = [a, *sorted(cuts, key=lambda p: abs(p[0] - a[0]) + abs(p[1] - a[1])), b]
                self.edges += pairwise(chain)
        self.wedges: dict[Node, list[tuple[Node, Node]]] = {}
        for v in {a for a, _ in self.edges}:
            into = [a for a, b in self.edges if b == v]
            self.wedges[v] = [
                (out, next(i for i in into if not any(is_inside_turn(v, out, j, i) for j in into if j != i)))
                for out in (b for a, b in self.edges if a == v)
            ]
        self.links: dict[Germ, list[tuple[Germ, float]]] = {
            (v, k): [] for v, wedges in self.wedges.items() for k in range(len(wedges))
        }
        vertices = sorted(self.wedges)
        for i, v in enumerate(vertices):
            for w in vertices[i + 1 :]:
                self._link_if_visible(v, w)
        for p in set(self.points) - set(vertices):
            self.links[(p, 0)] = []
            for v in vertices:
                self._link_if_visible(p, v)

    def _build_node(self, p: tuple[float, ...]) -> Node:
        x, y = (Fraction(c) * self.scale for c in p)
        return int(x), int(y)

    def _is_clear(self, v: Node, w: Node) -> bool:
        """Whether the open segment vw meets no vertex and crosses no wall."""
        for a, b in self.edges:
            if is_strictly_on(v, w, a):
                return False
            left, right = orient(v, w, a), orient(v, w, b)
            if ((left > 0) != (right > 0)) and left and right and orient(a, b, v) * orient(a, b, w) < 0:
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

    def _add_link(self, one: Germ, other: Germ) -> None:
        length = self._compute_length(one[0], other[0])
        self.links[one].append((other, length))
        self.links[other].append((one, length))

    def _link_if_visible(self, v: Node, w: Node) -> None:
        wall = False
        for a, b in ((v, w), (w, v)):
            if (a, b) in self.edges:
                wall = True
                at_a = next(k for k, (out, _) in enumerate(self.wedges[a]) if out == b)
                at_b = next(k for k, (_, into) in enumerate(self.wedges[b]) if into == a)
                self._add_link((a, at_a), (b, at_b))
        if not wall and self._is_clear(v, w):
            one, other = self._find_germ(v, w), self._find_germ(w, v)
            if one and other:
                self._add_link(one, other)

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
            least = min((d for germ, d in best.items() if germ[0] == p), default=math.inf)
            if p not in self.wedges and source not in self.wedges and self._is_clear(source, p):
                least = min(least, self._compute_length(source, p))
            result.append(least)
        return result


def compute_distances(
    free: MultiPolygon, sources: Iterable[tuple[float, float]], targets: Iterable[tuple[float, float]]
) -> np.ndarray:
    """Return the (n, m) geodesic distances."""
    sources, targets = list(sources), list(targets)
    force = BruteForce(free, [*sources, *targets])
    return np.array([force.compute_distances_from(i)[len(sources) :] for i in range(len(sources))])


def is_well_placed(free: MultiPolygon, point: tuple[float, float], size: float) -> bool:
    """Whether a point is exactly on a wall or clearly off every wall: rounding cannot move it across one."""
    p = tuple(Fraction(float(c)) for c in point)
    clear = True
    for ring in (ring for part in free.geoms for ring in (part.exterior, *part.interiors)):
        for a, b in pairwise([tuple(map(Fraction, q)) for q in ring.coords]):
            if p in (a, b) or is_strictly_on(a, b, p):
                return True
            (ux, uy), (dx, dy) = (b[0] - a[0], b[1] - a[1]), (p[0] - a[0], p[1] - a[1])
            along = min(max((dx * ux + dy * uy) / (ux * ux + uy * uy), Fraction(0)), Fraction(1))
            off = math.hypot(dx - along * ux, dy - along * uy)
            clear = clear and off > 1e-9 * size
    return clear
