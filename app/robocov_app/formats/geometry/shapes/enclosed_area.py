"""Areas enclosed by rings, by the rules of polygons with holes and of filled paths."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from robocov.environment import GRID_M
from robocov.typing import BoolArray, FloatArray
from robocov_app.formats.geometry.crossings import CrossingCounter, extract_edges
from robocov_app.formats.geometry.polygons import make_valid, to_multipolygon, unite

Rule: TypeAlias = Literal["holes", "evenodd", "nonzero"]
"""Rule for enclosed areas: with "holes", further rings are holes in the first; else SVG's ``fill-rule``."""
_MAX_RAY_PAIRS = 500_000
"""Number of pairs of a ray and an edge that are compared at once, to limit the memory."""


@dataclass(frozen=True, eq=False)
class EnclosedArea:
    """The area that rings enclose.

    Attributes
    ----------
    area : MultiPolygon, m
        Valid area, with the largest part first; empty if the rings enclose nothing.
    invalidity : str or None
        Why the rings of a polygon with holes were invalid, and where; None if they were valid, if the rule is
        not "holes", or if the area is empty.
    lost_holes : dict of str to int
        Number of holes that remove no area, by reason.
    """

    area: MultiPolygon
    invalidity: str | None = None
    lost_holes: dict[str, int] = field(default_factory=dict)


def find_enclosed_area(
    rings: Sequence[FloatArray], rule: Rule = "holes", crossings: CrossingCounter | None = None
) -> EnclosedArea:
    """Find the area that rings enclose.

    Parameters
    ----------
    rings : sequence of (k, 2) arrays, m
        The rings; their first point may be repeated at the end.
    rule : "holes", "evenodd" or "nonzero"
        See `Rule`.
    crossings : CrossingCounter or None
        Counter of the crossings in the file so far. By default, only those of these rings are counted.

    Returns
    -------
    EnclosedArea

    Raises
    ------
    MapError
        If the file has too many crossings.
    """
    if crossings is None:
        crossings = CrossingCounter()
    has_three_points = [_has_three_points(ring) for ring in rings]
    # Without an outline, there is nothing that the other rings could be holes of.
    if not any(has_three_points) or (rule == "holes" and not has_three_points[0]):
        return EnclosedArea(MultiPolygon())
    lost: Counter[str] = Counter()
    if rule == "holes":
        lost["with fewer than three different points"] = has_three_points[1:].count(False)
    usable_rings = [ring for ring, is_usable in zip(rings, has_three_points, strict=True) if is_usable]
    polygon = Polygon(usable_rings[0], usable_rings[1:])
    # A valid polygon needs no repair, and a single ring that does not cross itself encloses the same area by
    # every rule.
    if (rule == "holes" or len(usable_rings) == 1) and polygon.is_valid:
        # +lost drops the reasons with a count of zero.
        return EnclosedArea(to_multipolygon(polygon), lost_holes=+lost)
    lines = [shapely.linearrings(ring) for ring in usable_rings]
    crossings.add(lines)
    if rule != "holes":
        return EnclosedArea(_fill(lines, rule))
    area = _subtract_holes(usable_rings, lost)
    invalidity: str | None = None
    if not area.is_empty:
        invalidity = shapely.is_valid_reason(polygon)
    return EnclosedArea(area, invalidity, +lost)


def _has_three_points(ring: FloatArray) -> bool:
    """Return whether a ring has at least three different points; ten times as fast as `np.unique`."""
    others = ring[(ring != ring[:1]).any(axis=1)]
    return bool((others != others[:1]).any())


def _subtract_holes(rings: Sequence[FloatArray], lost: Counter[str]) -> MultiPolygon:
    """Subtract all other rings from the first one; count in `lost` those that remove no area."""
    areas = [make_valid(Polygon(ring)) for ring in rings]
    # The parts of rings that run along themselves may share an edge.
    areas = [area if area.is_valid else shapely.union_all([area]) for area in areas]
    outer = areas[0]
    holes = [area for area in map(to_multipolygon, areas[1:]) if not area.is_empty]
    lost["without an area"] += len(areas) - 1 - len(holes)
    shapely.prepare(outer)
    lost["outside of their outline"] += int((~shapely.intersects(outer, holes)).sum())
    if not holes:
        return to_multipolygon(outer)
    return to_multipolygon(shapely.difference(outer, unite(holes)))


def _fill(lines: Sequence[BaseGeometry], rule: Rule) -> MultiPolygon:
    """Return the area that closed lines fill by the rule "evenodd" or "nonzero"."""
    faces = shapely.get_parts(shapely.polygonize(shapely.get_parts(shapely.union_all(lines))))
    if not len(faces):
        return MultiPolygon()
    inside = shapely.get_coordinates(shapely.point_on_surface(faces))
    edges = extract_edges(lines)
    tree = shapely.STRtree(shapely.box(*edges.min(axis=1).T, *edges.max(axis=1).T))
    chunk = max(_MAX_RAY_PAIRS // len(edges), 1)
    is_filled = [
        _test_winding(inside[start : start + chunk], edges, tree, rule)
        for start in range(0, len(inside), chunk)
    ]
    faces = faces[np.concatenate(is_filled)]
    try:
        return to_multipolygon(shapely.coverage_union_all(faces))
    except shapely.GEOSException:  # very thin faces overlap others, due to rounding
        return to_multipolygon(shapely.union_all(faces, grid_size=GRID_M))


def _test_winding(points: FloatArray, edges: FloatArray, tree: shapely.STRtree, rule: Rule) -> BoolArray:
    """Return a mask of the points, (m, 2), that are inside by a fill rule.

    A ray from the point to the right crosses an odd number of edges (evenodd), or crosses upward and downward
    edges a different number of times (nonzero).
    """
    far = np.column_stack([np.full(len(points), edges[..., 0].max() + 1.0), points[:, 1]])
    rays = shapely.linestrings(np.stack([points, far], axis=1))
    ray, near = tree.query(rays)
    point = points[ray]
    start = edges[near, 0]
    end = edges[near, 1]
    is_upward = (start[:, 1] <= point[:, 1]) & (point[:, 1] < end[:, 1])
    is_downward = (end[:, 1] <= point[:, 1]) & (point[:, 1] < start[:, 1])
    # Positive if the point is to the left of the edge.
    left = (end[:, 0] - start[:, 0]) * (point[:, 1] - start[:, 1])
    left = left - (point[:, 0] - start[:, 0]) * (end[:, 1] - start[:, 1])
    sign = np.zeros(len(ray), dtype=int)
    sign[is_upward & (left > 0)] = 1
    sign[is_downward & (left < 0)] = -1
    if rule == "evenodd":
        return np.asarray(np.bincount(ray, np.abs(sign), len(points)) % 2 == 1)
    return np.asarray(np.bincount(ray, sign, len(points)) != 0)
