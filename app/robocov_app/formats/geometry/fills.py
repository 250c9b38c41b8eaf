"""What rings enclose: by the rules of polygons with holes, and by those of filled paths."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from robocov.arrays import Array
from robocov.environment import GRID
from robocov.errors import MapError

Rule: TypeAlias = Literal["holes", "evenodd", "nonzero"]
"""The first ring with the others as holes, or what SVG calls ``fill-rule``."""

MAX_CROSSINGS = 30_000
"""Edges may cross each other so often in a file, those of all its shapes together. A ring of some kB can
cross itself millions of times, and to find all of these places takes minutes and gigabytes."""

_FEW = 12
"""So few edges are compared each with each, which is quicker than a tree of them."""

_RAYS = 500_000
"""So many pairs of a ray and an edge are looked at together, which bounds the memory."""

_SAMPLES, _TOGETHER, _WORK, _CERTAIN = 500, 20, 400_000, 50
"""Edges that are looked at for an estimate, and so many at once; pairs of edges that are compared for it at
most, and crossings that are enough for one."""


@dataclass
class Crossings:
    """Count of edge crossings in a file, over all of its shapes, with `MAX_CROSSINGS` at most.

    `where`: what messages call the file. `count`: so far; an estimate where edges are many.
    """

    where: str = "rings"
    count: float = 0.0

    def add(self, edges: Array) -> None:
        """Count the crossings of some edges, (n, 2, 2) m: start and end of each.

        Ends that meet, and edges on each other, do not count. Where edges are many, some are looked at.
        Raises MapError when there are too many.
        """
        n = len(edges)
        lines = shapely.linestrings(edges)
        if n <= _FEW:
            one, other = np.triu_indices(n, 1)
            self.count += float(shapely.crosses(lines[one], lines[other]).sum())
            self._require_few(self.count)
            return
        tree = shapely.STRtree(lines)
        order = np.random.default_rng(0).permutation(n)[:_SAMPLES]
        crossings = work = seen = 0
        for begin in range(0, len(order), _TOGETHER):
            some = order[begin : begin + _TOGETHER]
            one, other = tree.query(lines[some])
            work += len(one)
            seen += len(some)
            crossings += int(shapely.crosses(lines[some[one]], lines[other]).sum())
            if crossings > _CERTAIN:  # each is seen from both of its edges
                self._require_few(self.count + crossings * n / seen / 2)
            if work > _WORK:
                break
        self.count += crossings * n / seen / 2
        self._require_few(self.count)

    def _require_few(self, count: float) -> None:
        if count > MAX_CROSSINGS:
            raise MapError(
                f"{self.where}: its lines cross each other some {count:.1g} times, but at most "
                f"{MAX_CROSSINGS} times was wanted"
            )


def enclosed(
    rings: Sequence[Array], rule: Rule = "holes", crossings: Crossings | None = None
) -> tuple[MultiPolygon, str | None, dict[str, int]]:
    """Return the valid area that rings enclose, what was wrong with them, and which holes are none.

    `rings`, (k, 2) m: closed or not; repeated vertices do no harm. `rule`: ``holes``: the first ring
    without the others. ``evenodd``, ``nonzero``: what a ray from there crosses an odd number of times, or
    what the rings wind around (SVG 2, 13.3.3). `crossings`: of the file so far. Returns: `area`: the
    largest part first; empty where nothing is enclosed. `reason`: where a ring meets itself or another one,
    of polygons with holes; fills may. `lost`: how many holes of a polygon take nothing out of it, by the
    reason. Raises MapError when the rings cross each other too often. Examples -------- >>> square, inner =
    np.array([[0, 0], [4, 0], [4, 4], [0, 4]]), np.array([[1, 1], [3, 1], [3, 3], [1, 3]]) >>>
    [enclosed([square, inner], rule)[0].area for rule in ("holes", "evenodd", "nonzero")] [12.0, 12.0, 16.0]
    """
    crossings = Crossings() if crossings is None else crossings
    good = [_has_three(ring) for ring in rings]
    lost = Counter({"of fewer than three points": good[1:].count(False)} if rule == "holes" else {})
    if not any(good) or (rule == "holes" and not good[0]):
        return MultiPolygon(), None, {}
    rings = [ring for ring, whole in zip(rings, good, strict=True) if whole]
    plain = Polygon(rings[0], rings[1:])
    if (rule == "holes" or len(rings) == 1) and plain.is_valid:
        return polygons_of(plain), None, +lost
    crossings.add(edges_of(rings, closed=True))
    if rule == "holes":
        area = _mended(rings, lost)
        return area, None if area.is_empty else shapely.is_valid_reason(plain), +lost
    return _filled(rings, rule), None, {}


def united(areas: Sequence[BaseGeometry]) -> BaseGeometry:
    """Return the union of areas, m.

    GEOS unites without a grid ten times as fast as on one, but may lose a part, without a word, where edges
    are almost on each other. So it is looked whether each corner of what was united is still there.
    """
    union = shapely.union_all(areas)
    corners = shapely.points(shapely.get_coordinates(areas))
    shapely.prepare(union)
    if shapely.dwithin(union, corners, GRID).all():
        return union
    return shapely.union_all(areas, grid_size=GRID)


def edges_of(rings: Sequence[Array], *, closed: bool) -> Array:
    """Return the (n, 2, 2) edges of rings, or of lines."""
    parts = [
        np.stack([ring, np.roll(ring, -1, axis=0)], axis=1)
        if closed
        else np.stack([ring[:-1], ring[1:]], axis=1)
        for ring in rings
        if len(ring) > 1
    ]
    return np.concatenate(parts) if parts else np.empty((0, 2, 2))


def _has_three(ring: Array) -> bool:
    """Return whether there are three different points in a ring; ten times as fast as to sort them."""
    others = ring[(ring != ring[:1]).any(axis=1)]
    return bool((others != others[:1]).any())


def _mended(rings: Sequence[Array], lost: Counter[str]) -> MultiPolygon:
    """Return the area of a polygon that is not valid: of the outer ring, without those of the holes."""
    areas = [shapely.make_valid(Polygon(ring), method="structure", keep_collapsed=False) for ring in rings]
    # of rings that run along themselves the parts may share an edge
    areas = [area if area.is_valid else shapely.union_all([area]) for area in areas]
    outer, holes = areas[0], [area for area in map(polygons_of, areas[1:]) if not area.is_empty]
    lost["without an area"] += len(areas) - 1 - len(holes)
    shapely.prepare(outer)
    lost["outside of their outline"] += int((~shapely.intersects(outer, holes)).sum())
    return polygons_of(shapely.difference(outer, united(holes)) if holes else outer)


def _filled(rings: Sequence[Array], rule: Rule) -> MultiPolygon:
    """Return the faces between the rings that the rule fills, as one area."""
    closed = [np.concatenate([ring, ring[:1]]) for ring in rings]
    noded = shapely.unary_union([shapely.linestrings(ring) for ring in closed])
    faces = shapely.get_parts(shapely.polygonize(shapely.get_parts(noded)))
    if not len(faces):
        return MultiPolygon()
    inside = shapely.get_coordinates(shapely.point_on_surface(faces))
    edges = edges_of(rings, closed=True)
    tree = shapely.STRtree(shapely.box(*edges.min(axis=1).T, *edges.max(axis=1).T))
    most = max(_RAYS // len(edges), 1)
    parts = [_windings(inside[k : k + most], edges, tree) for k in range(0, len(inside), most)]
    winding, crossings = (np.concatenate(part) for part in zip(*parts, strict=True))
    chosen = crossings % 2 == 1 if rule == "evenodd" else winding != 0
    try:
        return polygons_of(shapely.coverage_union_all(faces[chosen]))
    except shapely.GEOSException:  # faces so thin that rounding has folded them over others
        return polygons_of(shapely.union_all(faces[chosen], grid_size=GRID))


def _windings(points: Array, edges: Array, tree: shapely.STRtree) -> tuple[Array, Array]:
    """Return how often edges wind around each of (m, 2) points, and how many a ray to the right crosses."""
    start, end = edges[:, 0], edges[:, 1]
    far = np.column_stack([np.full(len(points), edges[..., 0].max() + 1.0), points[:, 1]])
    which, near = tree.query(shapely.linestrings(np.stack([points, far], axis=1)))
    p, a, b = points[which], start[near], end[near]
    up = (a[:, 1] <= p[:, 1]) & (p[:, 1] < b[:, 1])
    down = (b[:, 1] <= p[:, 1]) & (p[:, 1] < a[:, 1])
    left = (b[:, 0] - a[:, 0]) * (p[:, 1] - a[:, 1]) - (p[:, 0] - a[:, 0]) * (b[:, 1] - a[:, 1])
    sign = np.where(up & (left > 0), 1, np.where(down & (left < 0), -1, 0))
    winding = np.bincount(which, weights=sign, minlength=len(points))
    crossings = np.bincount(which, weights=np.abs(sign), minlength=len(points))
    return winding.astype(float), crossings.astype(float)


def polygons_of(geometry: BaseGeometry) -> MultiPolygon:
    """Return the polygons of `geometry`, counter-clockwise, the largest first; lines and points go."""
    parts = [part for part in _flat(geometry) if isinstance(part, Polygon) and part.area > 0.0]
    parts.sort(key=lambda part: (-part.area, part.bounds))
    return MultiPolygon([shapely.orient_polygons(part) for part in parts])


def _flat(geometry: BaseGeometry) -> list[BaseGeometry]:
    parts = [geometry]
    while any(hasattr(part, "geoms") for part in parts):
        parts = [inner for part in parts for inner in getattr(part, "geoms", [part])]
    return parts
