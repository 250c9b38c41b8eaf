"""HouseExpo floor plans: one JSON file per house, with the free space as one ring ``verts`` in meters.

The ring may be closed or open, repeat vertices and cross itself. Plans are drawn on a grid of 1 cm, with
corners cut off by a step or two of it. The format has no doors and no furniture.
"""

from pathlib import Path
from typing import Any

import numpy as np
from shapely import MultiPolygon, Polygon

from robocov.errors import MapError, format_count, to_one_line
from robocov.mapfile.models import MAX_COORDINATE_M
from robocov.typing import FloatArray
from robocov_app.formats.files import JsonFile, starts_with
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geometry.crossings import CrossingCounter
from robocov_app.formats.geometry.shapes.enclosed_area import EnclosedArea, find_enclosed_area
from robocov_app.formats.options import ReadOptions

_MIN_HOLE_M2 = 1e-4
"""Smaller holes are due to rounding."""
_MAX_NAME_CHARACTERS = 60


def sniff(path: Path, head: bytes) -> bool:
    """Return whether a file that starts with `head` has this format."""
    return starts_with(head, b"{") and b'"verts"' in head


def read(path: Path, options: ReadOptions) -> ForeignMap:
    """Read a floor plan.

    Raises
    ------
    MapError
        If the file has no ring of finite points that encloses an area.
    """
    file = JsonFile(path)
    document = file.document
    if not isinstance(document, dict) or "verts" not in document:
        raise MapError(f'{file.source_name}: not a HouseExpo plan, expected an object with "verts"')
    vertices = _parse_vertices(file, document["verts"])
    point_count = len(np.unique(vertices, axis=0))
    if point_count < 3:
        raise MapError(f"{file.source_name}: verts: expected at least 3 different points, got {point_count}")
    is_new = (vertices != np.roll(vertices, 1, axis=0)).any(axis=1)
    ring = vertices[is_new]
    # The last vertex of a closed ring repeats the first one.
    is_closed = bool((vertices[0] == vertices[-1]).all())
    enclosed = find_enclosed_area([ring], crossings=CrossingCounter(file.source_name))
    if enclosed.area.is_empty:
        raise MapError(f"{file.source_name}: verts: expected an outline with an area, got 0 m²")
    free, dropped = _remove_small_holes(enclosed.area)
    return ForeignMap(
        name=f"HouseExpo {_get_name(document, path)}",
        description=f"A floor plan{_describe_rooms(document)}, imported from HouseExpo.",
        free=free,
        vertices_read=len(vertices),
        cut_corners=True,
        repaired=_describe_repairs(len(vertices) - len(ring) - is_closed, enclosed),
        dropped=dropped,
    )


def _parse_vertices(file: JsonFile, value: Any) -> FloatArray:
    """Return the vertices of the ring, (k, 2) m."""
    if not isinstance(value, list) or len(value) < 3:
        raise file.build_error(("verts",), value, "a list of at least 3 points [x, y]")
    for k, point in enumerate(value):
        is_pair = isinstance(point, list) and len(point) == 2
        if not is_pair or not all(map(_is_coordinate, point)):
            raise file.build_error(("verts", k), point, "a point [x, y] in meters")
    return np.array(value, dtype=float)


def _is_coordinate(value: Any) -> bool:
    return type(value) in (int, float) and abs(value) <= MAX_COORDINATE_M


def _remove_small_holes(area: MultiPolygon) -> tuple[MultiPolygon, tuple[str, ...]]:
    """Remove holes that are due to rounding; return the area, and the line of the report about them."""
    polygons: list[Polygon] = []
    small_holes: list[Polygon] = []
    for polygon in area.geoms:
        large_holes: list[Polygon] = []
        for ring in polygon.interiors:
            hole = Polygon(ring)
            if hole.area < _MIN_HOLE_M2:
                small_holes.append(hole)
            else:
                large_holes.append(hole)
        polygons.append(Polygon(polygon.exterior, [hole.exterior for hole in large_holes]))
    dropped: tuple[str, ...] = ()
    if small_holes:
        small_area = sum(hole.area for hole in small_holes)
        count = format_count(len(small_holes), "hole")
        dropped = (f"{count}, {small_area:.2g} m² in total, due to rounding",)
    return MultiPolygon(polygons), dropped


def _describe_repairs(repeated_vertices: int, enclosed: EnclosedArea) -> tuple[str, ...]:
    repaired = []
    if repeated_vertices:
        noun = "vertex" if repeated_vertices == 1 else "vertices"
        repaired.append(f"{repeated_vertices} repeated {noun} removed")
    if enclosed.invalidity is not None:
        repaired.append(f"the outline crossed or touched itself: {enclosed.invalidity}")
    return tuple(repaired)


def _get_name(document: dict[str, Any], path: Path) -> str:
    identifier = document.get("id")
    if not isinstance(identifier, str) or not identifier:
        identifier = path.stem
    return to_one_line(identifier)[:_MAX_NAME_CHARACTERS]


def _describe_rooms(document: dict[str, Any]) -> str:
    rooms = document.get("room_num")
    if type(rooms) is not int or rooms < 2:
        return ""
    return f" of {rooms} rooms"
