"""HouseExpo floor plans: one JSON file a house, its free space as one ring ``verts`` in metres.

The ring may be closed or not, repeat vertices and cross itself. Plans are drawn on a grid of 1 cm, with
corners cut by a step or two of it. Doors and furniture are not in the format.
"""

from pathlib import Path

import numpy as np
from shapely import MultiPolygon, Polygon

from robocov.errors import MapError, format_count, to_one_line
from robocov.mapfile.models import MAX_COORDINATE_M
from robocov_app.formats.files import JsonFile, starts_with
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geometry.crossings import CrossingCounter
from robocov_app.formats.geometry.enclosed_area import find_enclosed_area
from robocov_app.formats.options import ReadOptions

_MIN_HOLE = 1e-4  # holes smaller than this, in m², come of rounding


def sniff(path: Path, head: bytes) -> bool:
    """Return whether a file that starts with `head` has this format."""
    return starts_with(head, b"{") and b'"verts"' in head


def read(path: Path, options: ReadOptions) -> ForeignMap:
    file = JsonFile(path)
    document = file.document
    if not isinstance(document, dict) or "verts" not in document:
        raise MapError(f'{file.where}: not a HouseExpo plan, expected an object with "verts"')
    given = document["verts"]
    if not isinstance(given, list) or len(given) < 3:
        raise file.build_error(("verts",), given, "a list of at least 3 points [x, y]")
    for k, point in enumerate(given):
        good = isinstance(point, list) and len(point) == 2
        if not good or not all(
            type(value) in (int, float) and abs(value) <= MAX_COORDINATE_M for value in point
        ):
            raise file.build_error(("verts", k), point, "a point [x, y] in metres")
    vertices = np.array(given, dtype=float)
    ring = vertices[(vertices != np.roll(vertices, 1, axis=0)).any(axis=1)]
    repeated = len(vertices) - len(ring)
    if len(ring) < 3:
        raise MapError(f"{file.where}: verts: expected at least 3 different points, got {len(ring)}")
    enclosed = find_enclosed_area([ring], crossings=CrossingCounter(file.where))
    area, reason = enclosed.area, enclosed.invalidity
    if area.is_empty:
        raise MapError(f"{file.where}: verts: expected an outline with an area, got 0 m²")
    repaired = [f"{repeated} repeated vertices taken out"] if repeated else []
    repaired += [] if reason is None else [f"the outline met itself: {reason}"]
    holes = [[Polygon(hole) for hole in part.interiors] for part in area.geoms]
    small = [hole.area for some in holes for hole in some if hole.area < _MIN_HOLE]
    dropped = [f"{format_count(len(small), 'hole')} of {sum(small):.2g} m² together"] if small else []
    parts = [
        Polygon(part.exterior, [hole.exterior for hole in some if hole.area >= _MIN_HOLE])
        for part, some in zip(area.geoms, holes, strict=True)
    ]
    called, rooms = document.get("id"), document.get("room_num")
    name = called if isinstance(called, str) and called else path.stem
    many = f" of {rooms} rooms" if type(rooms) is int and rooms > 1 else ""
    return ForeignMap(
        name=f"HouseExpo {to_one_line(name)[:60]}",
        description=f"A floor plan{many}, imported from HouseExpo.",
        free=MultiPolygon(parts),
        vertices_read=len(vertices),
        cut_corners=True,
        repaired=tuple(repaired),
        dropped=tuple(dropped),
    )
