"""Holes of polygons, which are obstacles even where other polygons overlap them."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon

from robocov.errors import MapError, format_count
from robocov_app.formats.geometry.crossings import CrossingCounter
from robocov_app.formats.geometry.polygons import to_multipolygon, unite
from robocov_app.formats.geometry.shapes.collection import Shapes, SourceGeometry

MAX_OVERLAPS = 50_000
"""Maximum number of pairs of a hole and a polygon that intersect."""
_HOLES_PER_QUERY = 20
"""Number of holes that are compared at once, to limit the memory."""


def exclude_holes(geometries: list[SourceGeometry], shapes: Shapes) -> list[SourceGeometry]:
    """Subtract the holes of polygons from all other polygons, except for polygons completely inside the hole.

    Parameters
    ----------
    geometries : list of SourceGeometry
        Geometries with coordinates in meters.
    shapes : Shapes
        Collects a note about the changes.

    Returns
    -------
    list of SourceGeometry
        The geometries in the same order. A polygon may have become several.

    Raises
    ------
    MapError
        If edges cross too often, or too many holes and polygons overlap.
    """
    valid = _build_valid_polygons(geometries)
    polygons = list(valid.values())
    holes: list[Polygon] = []
    for polygon in polygons:
        holes += [Polygon(ring) for ring in polygon.interiors]
    if len(polygons) < 2 or not holes:
        return geometries
    CrossingCounter(shapes.source_name).add(list(shapely.get_rings(polygons)))
    indices = list(valid)
    remainders: dict[int, MultiPolygon] = {}
    for k, overlapping_holes in _group_overlapping_holes(holes, polygons, shapes.source_name).items():
        remainder = shapely.difference(polygons[k], unite(overlapping_holes))
        remainders[indices[k]] = to_multipolygon(remainder)
    if not remainders:
        return geometries
    count = format_count(len(remainders), "polygon")
    shapes.notes.append(f"holes excluded from polygons that overlap them, as in JuPedSim: {count}")
    return _replace_polygons(geometries, remainders)


def _build_valid_polygons(geometries: list[SourceGeometry]) -> dict[int, Polygon]:
    """Return the valid polygons, keyed by their index; invalid ones are repaired later, one by one."""
    valid: dict[int, Polygon] = {}
    for index, geometry in enumerate(geometries):
        if geometry.kind != "polygon" or any(len(ring) < 4 for ring in geometry.rings):
            continue
        polygon = Polygon(geometry.rings[0], geometry.rings[1:])
        if polygon.is_valid:
            valid[index] = polygon
    return valid


def _group_overlapping_holes(
    holes: list[Polygon], polygons: list[Polygon], source_name: str
) -> dict[int, list[Polygon]]:
    """Return the holes that overlap each polygon, keyed by the polygon's index."""
    groups: dict[int, list[Polygon]] = {}
    for hole, k in _find_overlaps(holes, polygons, source_name):
        groups.setdefault(k, []).append(hole)
    return groups


def _find_overlaps(
    holes: list[Polygon], polygons: list[Polygon], source_name: str
) -> Iterator[tuple[Polygon, int]]:
    """Yield the pairs of a hole and the index of a polygon that overlaps it but is not inside it."""
    tree = shapely.STRtree(polygons)
    pair_count = 0
    for start in range(0, len(holes), _HOLES_PER_QUERY):
        batch = np.array(holes[start : start + _HOLES_PER_QUERY], dtype=object)
        hole_index, polygon_index = tree.query(batch, predicate="intersects")
        pair_count += len(hole_index)
        if pair_count > MAX_OVERLAPS:
            limit = f"at most {MAX_OVERLAPS} overlaps of holes and polygons"
            raise MapError(f"{source_name}: expected {limit}, got more")
        paired_holes = batch[hole_index]
        paired_polygons = tree.geometries[polygon_index]
        have_common_area = shapely.relate_pattern(paired_holes, paired_polygons, "T********")
        overlaps = have_common_area & ~shapely.covered_by(paired_polygons, paired_holes)
        yield from zip(paired_holes[overlaps], polygon_index[overlaps].tolist(), strict=True)


def _replace_polygons(
    geometries: list[SourceGeometry], remainders: dict[int, MultiPolygon]
) -> list[SourceGeometry]:
    """Replace polygons by their remainders, which are keyed by the indices of the polygons."""
    result: list[SourceGeometry] = []
    for index, geometry in enumerate(geometries):
        if index not in remainders:
            result.append(geometry)
            continue
        for part in remainders[index].geoms:
            rings = tuple(np.array(ring.coords) for ring in shapely.get_rings(part))
            result.append(replace(geometry, rings=rings))
    return result
