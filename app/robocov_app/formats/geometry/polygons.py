"""Areas enclosed by rings, by the rules of polygons with holes and filled paths; polygons' decimals."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from robocov.arrays import Array, BoolArray
from robocov.environment import GRID_M
from robocov.errors import MapError

Rule: TypeAlias = Literal["holes", "evenodd", "nonzero"]  # holes in the first ring, or SVG's ``fill-rule``
_MITRE_LIMIT = 5.0  # sharper corners are cut when an area is grown or shrunk
DEFAULT_DIGITS = 6  # decimals of metres by default: the free space is known to a micrometre
# edges may cross each other so often in a file, those of all its shapes together. A ring of some kB can cross
# itself millions of times, and to find all of these places takes minutes and gigabytes.
MAX_CROSSINGS = 30_000
_FEW = 12  # so few edges are compared each with each, which is quicker than a tree of them
_RAYS = 500_000  # so many pairs of a ray and an edge are looked at together, which bounds the memory
# edges that are looked at for an estimate, and so many at once; pairs of edges that are compared for it at
# most, and crossings that are enough for one
_SAMPLES, _TOGETHER, _WORK, _CERTAIN = 500, 20, 400_000, 50


@dataclass
class CrossingCounter:
    """Count of edge crossings in the file `where`, of all its shapes; an estimate where edges are many."""

    where: str = "rings"
    count: float = 0.0

    def add(self, lines: Iterable[BaseGeometry]) -> None:
        """Count how often edges cross, not how they meet; MapError at more than `MAX_CROSSINGS`."""
        edges = shapely.linestrings(extract_edges(lines))
        n = len(edges)
        estimate = 0.0
        if n <= _FEW:
            one, other = np.triu_indices(n, 1)
            estimate = float(shapely.crosses(edges[one], edges[other]).sum())
        else:
            tree = shapely.STRtree(edges)
            order = np.random.default_rng(0).permutation(n)[:_SAMPLES]
            crossings = work = 0
            for begin in range(0, len(order), _TOGETHER):
                some = order[begin : begin + _TOGETHER]
                one, other = tree.query(edges[some])
                work += len(one)
                crossings += int(shapely.crosses(edges[some[one]], edges[other]).sum())
                estimate = crossings * n / (begin + len(some)) / 2  # each is seen from both of its edges
                if work > _WORK or (crossings > _CERTAIN and self.count + estimate > MAX_CROSSINGS):
                    break
        self.count += estimate
        if self.count > MAX_CROSSINGS:
            got = f"about {self.count:.1g}"
            raise MapError(f"{self.where}: expected at most {MAX_CROSSINGS} crossings of lines, got {got}")


def extract_edges(lines: Iterable[BaseGeometry]) -> Array:
    """Return the (n, 2, 2) edges of lines and rings: start and end of each."""
    points, line = shapely.get_coordinates(lines, return_index=True)
    along = line[1:] == line[:-1]
    return np.stack([points[:-1][along], points[1:][along]], axis=1)


def extract_sides(area: BaseGeometry) -> Array:
    return extract_edges(shapely.get_rings(shapely.get_parts(area)))


def find_enclosed_area(
    rings: Sequence[Array], rule: Rule = "holes", crossings: CrossingCounter | None = None
) -> tuple[MultiPolygon, str | None, dict[str, int]]:
    """Return the valid area that rings, (k, 2) m, closed or not, enclose, the largest part first.

    Also where rings of a polygon with holes meet, in words, and how many holes take nothing out of it, by the
    reason. `crossings`: of the file so far; MapError when they are too many.
    """
    crossings = CrossingCounter() if crossings is None else crossings
    good = [_has_three(ring) for ring in rings]
    lost = Counter({"of fewer than three points": good[1:].count(False)} if rule == "holes" else {})
    if not any(good) or (rule == "holes" and not good[0]):
        return MultiPolygon(), None, {}
    rings = [ring for ring, whole in zip(rings, good, strict=True) if whole]
    plain = Polygon(rings[0], rings[1:])
    if (rule == "holes" or len(rings) == 1) and plain.is_valid:
        return to_multipolygon(plain), None, +lost
    lines = [shapely.linearrings(ring) for ring in rings]
    crossings.add(lines)
    if rule != "holes":
        return _filled(lines, rule), None, {}
    areas = [make_valid(Polygon(ring)) for ring in rings]
    # of rings that run along themselves the parts may share an edge
    areas = [area if area.is_valid else shapely.union_all([area]) for area in areas]
    outer, holes = areas[0], [area for area in map(to_multipolygon, areas[1:]) if not area.is_empty]
    lost["without an area"] += len(areas) - 1 - len(holes)
    shapely.prepare(outer)
    lost["outside of their outline"] += int((~shapely.intersects(outer, holes)).sum())
    area = to_multipolygon(shapely.difference(outer, unite(holes)) if holes else outer)
    return area, None if area.is_empty else shapely.is_valid_reason(plain), +lost


def unite(areas: Sequence[BaseGeometry]) -> BaseGeometry:
    """Return the union of areas, m.

    GEOS unites without a grid ten times as fast as on one, but may lose a part, without a word, where edges
    are almost on each other: so each corner is looked for.
    """
    union = shapely.union_all(areas)
    corners = shapely.points(shapely.get_coordinates(areas))
    shapely.prepare(union)
    return (
        union if shapely.dwithin(union, corners, GRID_M).all() else shapely.union_all(areas, grid_size=GRID_M)
    )


def buffer_with_mitres(geometry: Any, distance: float) -> Any:
    """Grow areas by a distance, or shrink them by a negative one, with corners that stay corners.

    Parameters
    ----------
    geometry : shapely geometry, or array of geometries
    distance : float, m

    Returns
    -------
    shapely geometry, or array of geometries

    Notes
    -----
    GEOS divides by the length of an edge, also where points are repeated, and drops such edges afterwards.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        return shapely.buffer(geometry, distance, join_style="mitre", mitre_limit=_MITRE_LIMIT)


def _has_three(ring: Array) -> bool:
    """Return whether there are three different points in a ring; ten times as fast as to sort them."""
    others = ring[(ring != ring[:1]).any(axis=1)]
    return bool((others != others[:1]).any())


def _filled(lines: Sequence[BaseGeometry], rule: Rule) -> MultiPolygon:
    faces = shapely.get_parts(shapely.polygonize(shapely.get_parts(shapely.union_all(lines))))
    if not len(faces):
        return MultiPolygon()
    inside = shapely.get_coordinates(shapely.point_on_surface(faces))
    edges = extract_edges(lines)
    tree = shapely.STRtree(shapely.box(*edges.min(axis=1).T, *edges.max(axis=1).T))
    most = max(_RAYS // len(edges), 1)
    chosen = [_is_filled(inside[k : k + most], edges, tree, rule) for k in range(0, len(inside), most)]
    faces = faces[np.concatenate(chosen)]
    try:
        return to_multipolygon(shapely.coverage_union_all(faces))
    except shapely.GEOSException:  # faces so thin that rounding has folded them over others
        return to_multipolygon(shapely.union_all(faces, grid_size=GRID_M))


def _is_filled(points: Array, edges: Array, tree: shapely.STRtree, rule: Rule) -> BoolArray:
    """Return which (m, 2) points edges wind around, or, by evenodd, cross a ray to the right oddly often."""
    far = np.column_stack([np.full(len(points), edges[..., 0].max() + 1.0), points[:, 1]])
    which, near = tree.query(shapely.linestrings(np.stack([points, far], axis=1)))
    p, a, b = points[which], edges[near, 0], edges[near, 1]
    up = (a[:, 1] <= p[:, 1]) & (p[:, 1] < b[:, 1])
    down = (b[:, 1] <= p[:, 1]) & (p[:, 1] < a[:, 1])
    left = (b[:, 0] - a[:, 0]) * (p[:, 1] - a[:, 1]) - (p[:, 0] - a[:, 0]) * (b[:, 1] - a[:, 1])
    sign = np.where(up & (left > 0), 1, np.where(down & (left < 0), -1, 0))
    turns = np.bincount(which, np.abs(sign) if rule == "evenodd" else sign, len(points))
    return np.asarray(turns % 2 == 1 if rule == "evenodd" else turns != 0)


def make_valid(area: BaseGeometry) -> BaseGeometry:
    made: BaseGeometry = shapely.make_valid(area, method="structure", keep_collapsed=False)
    return made


def list_polygons(geometry: BaseGeometry) -> list[Polygon]:
    """Return the polygons in `geometry`, counter-clockwise, the largest first; lines and points go."""
    flat = shapely.get_parts(shapely.get_parts(geometry))
    parts = [part for part in flat if isinstance(part, Polygon) and part.area > 0.0]
    return [shapely.orient_polygons(part) for part in sorted(parts, key=lambda p: (-p.area, p.bounds))]


def to_multipolygon(geometry: BaseGeometry) -> MultiPolygon:
    return MultiPolygon(list_polygons(geometry))


def fill_holes(geometry: BaseGeometry) -> Polygon:
    return Polygon(list_polygons(geometry)[0].exterior)


def round_polygons(geometry: BaseGeometry, digits: int) -> MultiPolygon:
    """Return the polygons of `geometry` with coordinates of so many decimals, valid; the largest first.

    Vertices that are the same after rounding, or on the line between their neighbours, are left out.
    """

    def decimals(points: Array) -> Array:
        return np.round(points, digits) + 0.0  # no negative zero

    plain = shapely.transform(geometry, decimals)
    if not plain.is_valid:
        # simplified walls may cross a boundary that was simplified beside them, which GEOS refuses to round
        plain = shapely.transform(shapely.set_precision(make_valid(geometry), 10.0**-digits), decimals)
    parts = list_polygons(plain)
    tidy = [_tidy_polygon(part, digits) for part in parts]
    if not all(part.is_valid for part in tidy):  # rings that touched where a vertex was
        tidy = parts
    return to_multipolygon(MultiPolygon(tidy))


def _tidy_polygon(polygon: Polygon, digits: int) -> Polygon:
    outer, *holes = (
        tidy_ring(shapely.get_coordinates(ring)[:-1], digits)
        for ring in (polygon.exterior, *polygon.interiors)
    )
    return Polygon(outer, holes)


def tidy_ring(points: Array, digits: int) -> Array:
    """Return a ring without vertices that say nothing: repeated ones, and those on a straight line.

    Parameters
    ----------
    points : (k, 2) array
        Vertices of so many `digits`, the first one not repeated.
    digits : int

    Returns
    -------
    (m, 2) array
        As many of them, in their order. The area that the ring encloses is the same.
    """
    # whole numbers, whose products are exact
    places = [tuple(place) for place in np.rint(points * 10.0**digits).astype(np.int64).tolist()]
    kept: list[int] = []
    for k in range(len(places)):
        while len(kept) > 1 and _is_straight(places[kept[-2]], places[kept[-1]], places[k]):
            kept.pop()
        if kept and places[kept[-1]] == places[k]:
            continue
        kept.append(k)
    # the same where the ring closes
    while len(kept) > 2:
        if _is_straight(places[kept[-2]], places[kept[-1]], places[kept[0]]):
            kept.pop()
        elif _is_straight(places[kept[-1]], places[kept[0]], places[kept[1]]):
            kept.pop(0)
        else:
            break
    return points[kept]


def _is_straight(a: tuple[int, int], b: tuple[int, int], c: tuple[int, int]) -> bool:
    """Return whether b is on the line through a and c, or the same as one of them."""
    return (b[0] - a[0]) * (c[1] - b[1]) == (b[1] - a[1]) * (c[0] - b[0])


def build_boundary(
    free: MultiPolygon, given: Polygon | None, *, hull: bool, margin: float, digits: int
) -> tuple[Polygon, list[Polygon]]:
    """Return a boundary around `free`, with coordinates of so many `digits`, and what is solid in it.

    It is `given`, m, without holes, or the outline of `free`, or of several parts the convex hull; or the
    `hull` of that; with so much `margin`, m, around it.
    """
    parts = list(free.geoms)
    if given is not None:
        # rounded first: where the two run along each other they do so afterwards, too
        base = fill_holes(
            round_polygons(shapely.union(fill_holes(round_polygons(given, digits)), free), digits)
        )
    else:
        base = free.convex_hull if len(parts) > 1 else Polygon(parts[0].exterior)
    if hull:
        base = base.convex_hull
    if margin > 0.0:
        base = fill_holes(base.buffer(margin, join_style="mitre", mitre_limit=2.0))
    if given is None and not hull and margin == 0.0 and len(parts) == 1:
        return base, [Polygon(hole) for hole in parts[0].interiors]
    base = fill_holes(round_polygons(base, digits))
    if not shapely.covers(base, free):  # by a rounded hair
        base = fill_holes(round_polygons(shapely.union(base, free), digits))
    return base, list_polygons(round_polygons(shapely.difference(base, free), digits))


def snap_to_grid(geometry: BaseGeometry, digits: int) -> list[Polygon]:
    """Return the `polygons` of a valid geometry with coordinates of so many decimals, still valid."""
    near = shapely.set_precision(geometry, 10.0**-digits)
    return list_polygons(shapely.transform(near, lambda points: np.round(points, digits)))


def format_decimal(value: float, digits: int) -> str:
    """Return a number with at most so many decimals, and none that say nothing."""
    text = f"{value:.{digits}f}"
    if "." in text:
        text = text.rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def list_rings(polygon: Polygon) -> list[list[tuple[float, float]]]:
    """Return the rings of a polygon, the outer one first; their last point is the first."""
    return [[(x, y) for x, y in ring.coords] for ring in (polygon.exterior, *polygon.interiors)]


def compute_free_area(boundary: BaseGeometry, obstacles: Iterable[BaseGeometry]) -> float:
    """Return the area inside of a boundary and outside of obstacles, as `Environment.free` has it, m²."""
    blocked = shapely.union_all(list(obstacles), grid_size=GRID_M)
    return float(shapely.difference(boundary, blocked, grid_size=GRID_M).area)
