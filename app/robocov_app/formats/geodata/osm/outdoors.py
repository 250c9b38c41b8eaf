"""Obstacles outdoors: buildings, water, walls and posts."""

import numpy as np

from robocov.environment import Point
from robocov.errors import format_count
from robocov_app.formats.geodata.georeference import DEGREES, convert_to_meters
from robocov_app.formats.geodata.osm.data import OsmData, OsmElement
from robocov_app.formats.geodata.osm.geometries import to_line, to_point, to_polygon
from robocov_app.formats.geometry.shapes.collection import BOUNDARY, Shapes, SourceGeometry

# Barriers that are walls; gates, kerbs and chains are not.
_WALLS = {"wall", "city_wall", "retaining_wall", "fence", "hedge", "guard_rail", "jersey_barrier"}
_POSTS = {"bollard", "block", "tree"}
_GATES = ("gate", "lift_gate")


def add_outdoors(data: OsmData, shapes: Shapes) -> None:
    """Add the obstacles on the ground to `shapes`, and the bounds of the extract as the boundary."""
    geometries = _list_geometries(data, shapes)
    origin: Point | None = None
    if data.bounds:
        bounds = np.array(data.bounds)
        west, south = bounds.min(axis=0)[:2].tolist()
        east, north = bounds.max(axis=0)[2:].tolist()
        origin = ((west + east) / 2, (south + north) / 2)
        corners = np.array([[west, south], [east, south], [east, north], [west, north]])
        geometries.append(SourceGeometry("polygon", (corners,), (BOUNDARY,), "bounds"))
    shapes.add_all(convert_to_meters(geometries, shapes, DEGREES, origin=origin))
    gates = sum(node.tags.get("barrier") in _GATES for node in data.nodes.values())
    if gates:
        shapes.notes.append(f"{format_count(gates, 'gate')} treated as closed")


def _list_geometries(data: OsmData, shapes: Shapes) -> list[SourceGeometry]:
    """Return the obstacles on the ground, in degrees; underground elements are counted as left out."""
    geometries = []
    for element in data.elements:
        if not _is_obstacle(element, is_water_free=shapes.options.water == "free"):
            continue
        if _is_underground(element.tags):
            shapes.count_omission("element", "below the ground")
            continue
        geometry = _build_geometry(data, element, shapes)
        if geometry is not None:
            geometries.append(geometry)
    return geometries


def _is_obstacle(element: OsmElement, *, is_water_free: bool) -> bool:
    tags = element.tags
    if element.is_building or _is_wall(tags) or _is_post(element):
        return True
    is_water = tags.get("natural") == "water" or tags.get("waterway") == "riverbank"
    return is_water and not is_water_free


def _is_wall(tags: dict[str, str]) -> bool:
    return tags.get("barrier") in _WALLS


def _is_post(element: OsmElement) -> bool:
    kinds = {element.tags.get("barrier"), element.tags.get("natural")}
    return element.kind == "node" and bool(_POSTS & kinds)


def _is_underground(tags: dict[str, str]) -> bool:
    is_below = tags.get("location") == "underground" or tags.get("layer", "0").startswith("-")
    return is_below or tags.get("tunnel", "no") != "no"


def _build_geometry(data: OsmData, element: OsmElement, shapes: Shapes) -> SourceGeometry | None:
    """Return an obstacle as a point, a line or a polygon, or None if it has no usable geometry."""
    tags = element.tags
    if _is_post(element):
        return to_point(data, element)
    if element.kind == "node":
        return None
    is_line = _is_wall(tags) and not element.is_building and tags.get("area") != "yes"
    if is_line and element.kind == "way":
        return to_line(data, element, shapes)
    return to_polygon(data, element, shapes)
