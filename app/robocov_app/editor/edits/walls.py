"""Walls cut in two, joined, and gone on with."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from robocov.environment import WallObstacle
from robocov.errors import MapError
from robocov_app.editor.model.document import Item, Sketch
from robocov_app.editor.model.plane import ring_near
from robocov_app.editor.model.selection import Change, Selection, Vertex, called, place_of

if TYPE_CHECKING:
    from robocov.environment import Point, Ring

_SAME = 1e-4
"""Ends of walls that are closer, in metres, are one point."""


def extended(sketch: Sketch, vertex: Vertex, point: Point) -> Change:
    """Go on with a wall from its first or last vertex; the new one is selected then."""
    wall = _wall(sketch, vertex)
    (place,) = ring_near(np.array([point], dtype=float))
    last = len(wall.points) - 1
    if vertex.index not in (0, last):
        raise MapError("a wall goes on from its ends only")
    at_end = vertex.index == last
    points = (*wall.points, place) if at_end else (place, *wall.points)
    key = int(vertex.of)
    selection = Selection(vertices=frozenset({Vertex(key, 0, last + 1 if at_end else 0)}))
    after = sketch.with_shapes({key: replace(wall, points=points)})
    return Change(after, selection, f"{called(sketch, key)} extended")


def split(sketch: Sketch, vertex: Vertex) -> Change:
    """Cut a wall in two at one of its inner vertices; both are selected then."""
    wall = _wall(sketch, vertex)
    if not 0 < vertex.index < len(wall.points) - 1:
        raise MapError("a wall is cut at a vertex between its ends: insert one first")
    place, key = sketch.places[int(vertex.of)], sketch.fresh_key
    item = sketch.obstacles[place]
    first = replace(item, shape=replace(wall, points=wall.points[: vertex.index + 1]))
    second = Item(key, replace(wall, points=wall.points[vertex.index :]), item.note)
    items = (*sketch.obstacles[:place], first, second, *sketch.obstacles[place + 1 :])
    words = f"{called(sketch, item.key)} cut in two"
    return Change(replace(sketch, obstacles=items), Selection.of(item.key, key), words)


def joined(sketch: Sketch, selection: Selection) -> Change:
    """Join the selected walls into one where their ends meet, or are nearest to each other.

    It is as wide as the lowest, and takes its place, and its name and note or else the next one's.
    """
    items = [item for item in sketch.obstacles if item.key in selection.items]
    shapes = [item.shape for item in items if isinstance(item.shape, WallObstacle)]
    if len(shapes) < 2 or len(shapes) < len(items):
        raise MapError("select two or more walls to join, and nothing else")
    chain, *rest = [wall.points for wall in shapes]
    while rest:
        ways = [_chained(chain, line) for line in rest]
        k = min(range(len(rest)), key=lambda k: ways[k][0])
        chain = ways[k][1]
        del rest[k]
    name = next((wall.name for wall in shapes if wall.name is not None), None)
    note = next((item.note for item in items if item.note), "")
    first = items[0]
    whole = WallObstacle(chain, shapes[0].width, name)
    gone = {item.key for item in items[1:]}
    kept = tuple(
        replace(item, shape=whole, note=note) if item.key == first.key else item
        for item in sketch.obstacles
        if item.key not in gone
    )
    return Change(replace(sketch, obstacles=kept), Selection.of(first.key), f"{len(items)} walls joined")


def _chained(chain: Ring, line: Ring) -> tuple[float, Ring]:
    """Return the gap between two lines, m, and the line that they make where their ends are nearest."""
    ways = []
    for a in (chain, chain[::-1]):
        for b in (line, line[::-1]):
            gap = math.dist(a[-1], b[0])
            ways.append((gap, (*a, *(b[1:] if gap <= _SAME else b))))
    return min(ways, key=lambda way: way[0])


def _wall(sketch: Sketch, vertex: Vertex) -> WallObstacle:
    place_of(sketch, vertex)
    shape = (
        sketch.item(vertex.of).shape if vertex.of in sketch.places and isinstance(vertex.of, int) else None
    )
    if not isinstance(shape, WallObstacle):
        raise MapError("that is no wall")
    return shape
