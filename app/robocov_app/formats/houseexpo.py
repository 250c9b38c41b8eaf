"""HouseExpo floor plans: one JSON file a house, its free space as one ring ``verts`` in metres."""

from pathlib import Path
from typing import Any

import numpy as np
from shapely import MultiPolygon, Polygon

from robocov.arrays import Array
from robocov.errors import MapError, counted, one_line
from robocov.mapfile.models import FARTHEST
from robocov_app.formats.base import ForeignMap, Importer, ReadOptions
from robocov_app.formats.files import begins_with, located_errors, read_json, refused
from robocov_app.formats.geometry.polygons import Crossings, enclosed

_MIN_HOLE = 1e-4  # holes smaller than this, in m², come of rounding


def _read(path: Path, options: ReadOptions) -> ForeignMap:
    """Return a floor plan.

    The ring may be closed or not, repeat vertices and cross itself. Plans are drawn on a grid of 1 cm, with
    corners cut by a step or two of it. Doors and furniture are not in the format.
    """
    document, content, where = read_json(path)
    with located_errors(content, where):
        vertices = _vertices(document, where)
        repaired: list[str] = []
        parts = _parts(vertices, where, repaired)
    small = [hole for part in parts for hole in map(Polygon, part.interiors) if hole.area < _MIN_HOLE]
    dropped = [f"{counted(len(small), 'hole')} of {sum(hole.area for hole in small):.2g} m² together"]
    given, rooms = document.get("id"), document.get("room_num")
    name = given if isinstance(given, str) and given else path.stem
    many = f" of {rooms} rooms" if type(rooms) is int and rooms > 1 else ""
    return ForeignMap(
        name=f"HouseExpo {one_line(name)[:60]}",
        description=f"A floor plan{many}, imported from HouseExpo.",
        format=IMPORTER.name,
        free=MultiPolygon([_without_small_holes(part) for part in parts]),
        vertices_read=len(vertices),
        cut_corners=True,
        repaired=tuple(repaired),
        dropped=tuple(dropped if small else ()),
    )


def _vertices(document: Any, where: str) -> Array:
    """Return the vertices of the file as (k, 2) m."""
    if not isinstance(document, dict) or "verts" not in document:
        raise MapError(f'{where}: not a HouseExpo plan, but an object with "verts" was wanted')
    given = document["verts"]
    if not isinstance(given, list) or len(given) < 3:
        raise refused(where, ("verts",), given, "a list of at least 3 points [x, y] was wanted")
    for k, point in enumerate(given):
        good = isinstance(point, list) and len(point) == 2
        if not good or not all(type(value) in (int, float) and abs(value) <= FARTHEST for value in point):
            raise refused(where, ("verts", k), point, "a point [x, y] in metres was wanted")
    return np.array(given, dtype=float)


def _parts(vertices: Array, where: str, repaired: list[str]) -> list[Polygon]:
    """Return the valid polygons that the ring of `vertices` stands for, the largest first."""
    ring = vertices[(vertices != np.roll(vertices, 1, axis=0)).any(axis=1)]
    if len(ring) < len(vertices):
        repaired.append(f"{len(vertices) - len(ring)} repeated vertices taken out")
    if len(ring) < 3:
        raise MapError(f"{where}: verts: {len(ring)} different points, but at least 3 were wanted")
    area, reason, _ = enclosed([ring], crossings=Crossings(where))
    if reason is not None:
        repaired.append(f"the outline met itself: {reason}")
    if area.is_empty:
        raise MapError(f"{where}: verts: area 0 m², but an outline with an area was wanted")
    return list(area.geoms)


def _without_small_holes(part: Polygon) -> Polygon:
    return Polygon(part.exterior, [hole for hole in part.interiors if Polygon(hole).area >= _MIN_HOLE])


IMPORTER = Importer(
    "houseexpo", "HouseExpo floor plans (JSON with verts in metres)", (".json",),
    lambda path, head: begins_with(head, b"{") and b'"verts"' in head, _read,
)  # fmt: skip
