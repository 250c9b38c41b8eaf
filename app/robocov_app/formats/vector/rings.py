"""Lists of rings, as accepted by triangulation libraries: the first is the outline, the others are holes.

A file contains a list of rings, each a list of points [x, y]: the first ring is the outline of the free
space, and the others are obstacles. It may also contain a single ring, a list of such lists of rings, or
earcut's flat structure: an object with ``vertices`` (x, y, x, y, ...), ``holes`` (the index of the first
vertex of each) and ``dimensions``. There are no units: the option ``scale`` is the size of a unit in meters,
1 by default.
"""

import re
from itertools import pairwise
from pathlib import Path
from typing import Any

from robocov.errors import JsonPath
from robocov.typing import FloatArray
from robocov_app.formats.files import JsonFile, get_map_name, require_shapes
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geometry.shapes.collection import Shapes
from robocov_app.formats.options import ReadOptions, get_or_default

_NESTED_LISTS = re.compile(rb"(?:\xef\xbb\xbf)?\s*\[\s*(?:\[\s*){0,3}-?[\d.]")
_FLAT_VERTICES = re.compile(rb'"vertices"\s*:\s*\[\s*-?[\d.]')


def sniff(path: Path, head: bytes) -> bool:
    """Return whether a file that starts with `head` has this format."""
    if path.suffix.lower() != ".json":
        return False
    return _NESTED_LISTS.match(head) is not None or _FLAT_VERTICES.search(head) is not None


def read(path: Path, options: ReadOptions) -> ForeignMap:
    """Read the polygons of a file.

    Raises
    ------
    MapError
        If the file has none of the accepted structures, or too many polygons.
    """
    parser = _RingParser(JsonFile(path), options)
    polygons = parser.parse_polygons()
    shapes = parser.shapes
    require_shapes(len(polygons), shapes.source_name)
    scale = get_or_default(options.scale, 1.0)
    for number, rings in enumerate(polygons, start=1):
        shapes.add_outline([ring * scale for ring in rings], location=f"polygon {number}")
    shapes.notes = [f"a unit is {scale:g} m"]
    if not options.scale:
        shapes.notes = [f"no unit in the file; assuming {scale:g} m. Set it with --scale."]
    return shapes.build_foreign_map(get_map_name(path), "Imported from rings.", solid=False, overlap=True)


class _RingParser:
    """Parses the polygons in a file. Each polygon is a list of rings, which are (k, 2) arrays."""

    def __init__(self, file: JsonFile, options: ReadOptions) -> None:
        self.file = file
        self.shapes = Shapes(file.source_name, options)

    def parse_polygons(self) -> list[list[FloatArray]]:
        """Return the polygons in the file, in its units. The nesting depth determines the structure."""
        document = self.file.document
        if isinstance(document, dict):
            return [self._parse_flat_polygon(document)]
        match _measure_depth(document):
            case 1:
                return [[self._parse_flat_ring(document, (), 2)]]
            case 2:
                return [[self._parse_ring(document, ())]]
            case 3:
                return [self._parse_polygon(document, ())]
            case 4:
                return [self._parse_polygon(rings, (k,)) for k, rings in enumerate(document)]
        raise self.file.build_error((), document, "a list of rings [[x, y], ...]")

    def _parse_flat_polygon(self, document: dict[str, Any]) -> list[FloatArray]:
        """Return the rings of an object with ``vertices``, ``holes`` and ``dimensions``."""
        dimensions = document.get("dimensions", 2)
        if type(dimensions) is not int or dimensions not in (2, 3):
            raise self.file.build_error(("dimensions",), dimensions, "2 or 3")
        points = self._parse_flat_ring(document.get("vertices"), ("vertices",), dimensions)
        holes = document.get("holes") or []
        if isinstance(holes, list) and all(type(hole) is int for hole in holes):
            ranges = list(pairwise([0, *holes, len(points)]))
            if all(start < stop for start, stop in ranges):
                return [points[start:stop] for start, stop in ranges]
        expected = f"growing indices of vertices, from 1 to {len(points) - 1}"
        raise self.file.build_error(("holes",), holes, expected)

    def _parse_polygon(self, value: Any, location: JsonPath) -> list[FloatArray]:
        if not isinstance(value, list) or not value:
            raise self.file.build_error(location, value, "a list of rings")
        return [self._parse_ring(ring, (*location, k)) for k, ring in enumerate(value)]

    def _parse_ring(self, value: Any, location: JsonPath) -> FloatArray:
        points = self.file.parse_points(value, location, min_count=1, min_dimensions=2, max_dimensions=3)
        return self.shapes.drop_heights(points)

    def _parse_flat_ring(self, value: Any, location: JsonPath, dimensions: int) -> FloatArray:
        """Return the points of a flat list of coordinates, `dimensions` of them for each point."""
        is_list = isinstance(value, list)
        if not is_list or len(value) % dimensions or len(value) < 3 * dimensions:
            raise self.file.build_error(location, value, f"at least 3 times {dimensions} numbers")
        rows = [value[k : k + dimensions] for k in range(0, len(value), dimensions)]
        points = self.file.parse_points(
            rows, location, min_count=3, min_dimensions=dimensions, max_dimensions=dimensions
        )
        return self.shapes.drop_heights(points)


def _measure_depth(value: Any) -> int:
    """Return the depth of nested lists, judging by the first item of each."""
    depth = 0
    while isinstance(value, list) and value:
        depth += 1
        value = value[0]
    return depth
