"""Lists of rings, as triangulation libraries take them: the first is the outline, the others are holes."""

import re
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from robocov.arrays import Array
from robocov.errors import JsonPath as Steps
from robocov_app.formats import files
from robocov_app.formats.base import ForeignMap, Importer, ReadOptions
from robocov_app.formats.geometry.shapes import Shapes, foreign_map

_LISTS = re.compile(rb"(?:\xef\xbb\xbf)?\s*\[\s*(?:\[\s*){0,3}-?[\d.]")
_FLAT = re.compile(rb'"vertices"\s*:\s*\[\s*-?[\d.]')


def _read(path: Path, options: ReadOptions) -> ForeignMap:
    """Return the polygons in a file of rings.

    It holds a list of rings, each a list of points [x, y], of which the first is the outline of the free
    space and the others are obstacles; or one ring alone; or a list of such lists; or, flat, an object with
    ``vertices`` (x, y, x, y, ...), ``holes`` (the index of the first vertex of each) and ``dimensions``.
    There are no units: the option ``scale`` is metres a unit, 1 by default.
    """
    document, content, where = files.read_json(path)
    shapes = Shapes(where, options)
    scale = 1.0 if options.scale is None else options.scale
    with files.located_errors(content, where):
        polygons = _polygons(document, shapes)
    files.require_shapes(len(polygons), where)
    for number, rings in enumerate(polygons, start=1):
        shapes.add_outline([ring * scale for ring in rings], at=f"polygon {number}")
    shapes.notes = [f"a unit is {scale:g} m" + ("" if options.scale else " (the file says none; --scale)")]
    name, text = files.name_of_map(path), "Imported from rings."
    return foreign_map(shapes, IMPORTER.name, name, text, solid=False, accessible=True)


def _polygons(document: Any, shapes: Shapes) -> list[list[Array]]:
    if isinstance(document, dict):
        return [_flat(document, shapes)]
    depth, inner = 0, document
    while isinstance(inner, list) and inner:
        depth, inner = depth + 1, inner[0]
    if depth == 1:
        return [[_pairs(document, (), 2, shapes)]]
    if depth == 2:
        return [[_ring(document, (), shapes)]]
    if depth == 3:
        return [_rings(document, (), shapes)]
    if depth == 4:
        return [_rings(rings, (k,), shapes) for k, rings in enumerate(document)]
    raise files.refused(shapes.where, (), document, "a list of rings [[x, y], ...] was wanted")


def _rings(value: Any, at: Steps, shapes: Shapes) -> list[Array]:
    if not isinstance(value, list) or not value:
        raise files.refused(shapes.where, at, value, "a list of rings was wanted")
    return [_ring(ring, (*at, k), shapes) for k, ring in enumerate(value)]


def _ring(value: Any, at: Steps, shapes: Shapes) -> Array:
    points = files.positions(value, at, shapes.where, least=1, dimensions=(2, 3))
    shapes.leave_heights(points[:, 2:3])
    return points[:, :2]


def _flat(document: dict[str, Any], shapes: Shapes) -> list[Array]:
    dimensions = document.get("dimensions", 2)
    if type(dimensions) is not int or dimensions not in (2, 3):
        raise files.refused(shapes.where, ("dimensions",), dimensions, "2 or 3 was wanted")
    points = _pairs(document.get("vertices"), ("vertices",), dimensions, shapes)
    holes = document.get("holes") or []
    good = isinstance(holes, list) and all(type(hole) is int for hole in holes)
    cuts = [0, *holes, len(points)] if good else []
    if not good or any(a >= b for a, b in pairwise(cuts)):
        wanted = f"growing indices of vertices, from 1 to {len(points) - 1}, were wanted"
        raise files.refused(shapes.where, ("holes",), holes, wanted)
    return [points[a:b] for a, b in pairwise(cuts)]


def _pairs(value: Any, at: Steps, dimensions: int, shapes: Shapes) -> Array:
    """Return the points of a flat list of numbers, (k, 2)."""
    if not isinstance(value, list) or len(value) % dimensions or len(value) < 3 * dimensions:
        raise files.refused(shapes.where, at, value, f"at least 3 times {dimensions} numbers were wanted")
    pairs = [value[k : k + dimensions] for k in range(0, len(value), dimensions)]
    points = files.positions(pairs, at, shapes.where, least=3, dimensions=(dimensions, dimensions))
    shapes.leave_heights(points[:, 2:3])
    return np.ascontiguousarray(points[:, :2])


IMPORTER = Importer(
    "rings", "lists of rings (JSON as earcut takes it): outline and holes", (".json",),
    lambda path, head: path.suffix.lower() == ".json" and bool(_LISTS.match(head) or _FLAT.search(head)),
    _read, options=frozenset({"scale", "outlines", "around"}),
)  # fmt: skip
