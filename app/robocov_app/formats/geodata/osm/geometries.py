"""Geometries of elements of OpenStreetMap, in degrees."""

import re

import shapely

from robocov_app.formats.geodata.osm.data import OsmData, OsmElement
from robocov_app.formats.geometry.shapes.collection import Shapes, SourceGeometry

_WIDTH = re.compile(r"(\d{1,3}(?:\.\d+)?)\s*m?")


def to_point(data: OsmData, node: OsmElement) -> SourceGeometry:
    """Return a node as a point."""
    return SourceGeometry("point", (data.get_point(node)[None],), node.labels, node.location)


def to_line(data: OsmData, way: OsmElement, shapes: Shapes) -> SourceGeometry | None:
    """Return a way as a line; if nodes are missing, count it as left out and return None."""
    lines = data.get_lines(way)
    if lines is None:
        shapes.count_omission("way", "with missing nodes")
        return None
    return SourceGeometry("line", (lines[0],), way.labels, way.location, width=parse_width(way.tags))


def to_polygon(data: OsmData, element: OsmElement, shapes: Shapes) -> SourceGeometry | None:
    """Return a way or relation as a polygon; if it has no area, count it as left out and return None."""
    lines = data.get_lines(element)
    if lines is None:
        shapes.count_omission(element.kind, "with missing nodes")
        return None
    merged = shapely.line_merge(shapely.MultiLineString([shapely.LineString(line) for line in lines]))
    rings = [shapely.get_coordinates(part) for part in shapely.get_parts(merged)]
    if not rings:  # all nodes have the same position
        shapes.count_omission(element.kind, "without an area")
        return None
    if not all((ring[0] == ring[-1]).all() for ring in rings):
        shapes.count_omission(element.kind, "without a closed outline")
        return None
    return SourceGeometry("polygon", tuple(rings), element.labels, element.location, rule="evenodd")


def parse_width(tags: dict[str, str]) -> float | None:
    """Return the value of the tag ``width`` in meters, or None if it is missing or invalid."""
    match = _WIDTH.fullmatch(tags.get("width", "").strip())
    return float(match[1]) if match else None
