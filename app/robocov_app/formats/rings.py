"""Lists of rings, as triangulation libraries take them: the first is the outline, the others are holes.

It holds a list of rings, each a list of points [x, y], of which the first is the outline of the free space
and the others are obstacles; or one ring alone; or a list of such lists; or, flat, an object with
``vertices`` (x, y, x, y, ...), ``holes`` (the index of the first vertex of each) and ``dimensions``. There
are no units: the option ``scale`` is metres a unit, 1 by default.
"""

import re
from itertools import pairwise
from pathlib import Path
from typing import Any

from robocov.arrays import Array
from robocov.errors import JsonPath as Steps
from robocov_app.formats.files import JsonFile, get_map_name, require_shapes
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geometry.shapes import Shapes
from robocov_app.formats.options import ReadOptions

_LISTS = re.compile(rb"(?:\xef\xbb\xbf)?\s*\[\s*(?:\[\s*){0,3}-?[\d.]")
_FLAT = re.compile(rb'"vertices"\s*:\s*\[\s*-?[\d.]')


def sniff(path: Path, head: bytes) -> bool:
    return path.suffix.lower() == ".json" and bool(_LISTS.match(head) or _FLAT.search(head))


def read(path: Path, options: ReadOptions) -> ForeignMap:
    file = JsonFile(path)
    shapes = Shapes(file.where, options)
    scale = 1.0 if options.scale is None else options.scale
    polygons = _polygons(file, shapes)
    require_shapes(len(polygons), file.where)
    for number, rings in enumerate(polygons, start=1):
        shapes.add_outline([ring * scale for ring in rings], at=f"polygon {number}")
    shapes.notes = [f"a unit is {scale:g} m" + ("" if options.scale else " (the file says none; --scale)")]
    return shapes.build_foreign_map(get_map_name(path), "Imported from rings.", solid=False, overlap=True)


def _polygons(file: JsonFile, shapes: Shapes) -> list[list[Array]]:
    """Return the polygons in a file, each as its rings, (k, 2)."""

    def polygon(value: Any, at: Steps) -> list[Array]:
        if not isinstance(value, list) or not value:
            raise file.build_error(at, value, "a list of rings")
        return [ring(each, (*at, k)) for k, each in enumerate(value)]

    def ring(value: Any, at: Steps) -> Array:
        return shapes.drop_heights(
            file.parse_points(value, at, min_count=1, min_dimensions=2, max_dimensions=3)
        )

    def flat_ring(value: Any, at: Steps, size: int) -> Array:
        if not isinstance(value, list) or len(value) % size or len(value) < 3 * size:
            raise file.build_error(at, value, f"at least 3 times {size} numbers")
        pairs = [value[k : k + size] for k in range(0, len(value), size)]
        return shapes.drop_heights(
            file.parse_points(pairs, at, min_count=3, min_dimensions=size, max_dimensions=size)
        )

    document = inner = file.document
    if isinstance(document, dict):
        dimensions = document.get("dimensions", 2)
        if type(dimensions) is not int or dimensions not in (2, 3):
            raise file.build_error(("dimensions",), dimensions, "2 or 3")
        points = flat_ring(document.get("vertices"), ("vertices",), dimensions)
        holes = document.get("holes") or []
        good = isinstance(holes, list) and all(type(hole) is int for hole in holes)
        cuts = [0, *holes, len(points)] if good else []
        if not good or any(a >= b for a, b in pairwise(cuts)):
            wanted = f"growing indices of vertices, from 1 to {len(points) - 1}"
            raise file.build_error(("holes",), holes, wanted)
        return [[points[a:b] for a, b in pairwise(cuts)]]
    depth = 0
    while isinstance(inner, list) and inner:
        depth, inner = depth + 1, inner[0]
    match depth:
        case 1:
            return [[flat_ring(document, (), 2)]]
        case 2:
            return [[ring(document, ())]]
        case 3:
            return [polygon(document, ())]
        case 4:
            return [polygon(rings, (k,)) for k, rings in enumerate(document)]
    raise file.build_error((), document, "a list of rings [[x, y], ...]")
