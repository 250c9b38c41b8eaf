"""Edits of single vertices: of polygons and their holes, walls, the boundary, rims of circles, starts.

As in `edits`: a `Change`, or a MapError with a sentence. More are in `corners` and `walls`.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import shapely

from robocov.environment import CircleObstacle, DiscStart, PointsStart, PolygonObstacle, WallObstacle
from robocov.errors import MapError
from robocov.mapfile.models import SMALLEST
from robocov_app.editor.edits.corners import bevelled as bevelled
from robocov_app.editor.edits.corners import rounded_off as rounded_off
from robocov_app.editor.edits.walls import extended as extended
from robocov_app.editor.edits.walls import joined as joined
from robocov_app.editor.edits.walls import split as split
from robocov_app.editor.model.document import BOUNDARY, Owner, Sketch
from robocov_app.editor.model.plane import ring_near, tenths
from robocov_app.editor.model.selection import (
    Change,
    Edge,
    Selection,
    Vertex,
    called,
    place_of,
    ring_points,
    rings_of,
    with_rings,
)

if TYPE_CHECKING:
    from robocov.environment import Point, Ring

__all__ = [
    "bevelled",
    "deleted",
    "edge_moved",
    "edge_pushed",
    "extended",
    "hole_cut",
    "hole_filled",
    "inserted",
    "joined",
    "moved",
    "put",
    "reversed_order",
    "rounded_off",
    "split",
    "with_places",
]


def moved(sketch: Sketch, selection: Selection, dx: float, dy: float) -> Change:
    """Move the selected vertices by (dx, dy) m; a rim's vertex changes the radius."""
    if not selection.vertices:
        raise MapError("select vertices first")
    places = {}
    for vertex in selection.vertices:
        x, y = place_of(sketch, vertex)
        places[vertex] = (x + dx, y + dy)
    words = f"{Selection(vertices=selection.vertices).words(sketch)} moved"
    return Change(with_places(sketch, places), selection, words)


def put(sketch: Sketch, places: Mapping[Vertex, Point]) -> Change:
    """Put vertices at places, m: as typed, or dragged."""
    selection = Selection(vertices=frozenset(places))
    return Change(with_places(sketch, places), selection, f"{selection.words(sketch)} moved")


def with_places(sketch: Sketch, places: Mapping[Vertex, Point]) -> Sketch:
    """Return the sketch with vertices at other places.

    Where a circle's centre is among them it moves as a whole; else the first of its rim gives the radius.

    Raises
    ------
    MapError
        When there is no such vertex, a circle would have no radius, or it is too far away.
    """
    by_owner: dict[Owner, dict[Vertex, Point]] = defaultdict(dict)
    for vertex, place in places.items():
        place_of(sketch, vertex)
        by_owner[vertex.of][vertex] = place
    for owner, moves in by_owner.items():
        if isinstance(owner, str):
            spec = sketch.start(owner)
            if isinstance(spec, DiscStart):
                center, radius = _with_rim(spec, moves)
                sketch = sketch.with_start(owner, DiscStart(center, radius))
                continue
        elif owner != BOUNDARY:
            shape = sketch.item(owner).shape
            if isinstance(shape, CircleObstacle):
                center, radius = _with_rim(shape, moves)
                sketch = sketch.with_shapes({owner: replace(shape, center=center, radius=radius)})
                continue
        rings = [list(ring) for ring in ring_points(sketch, owner)]
        for vertex, place in zip(moves, ring_near(np.array(list(moves.values()))), strict=True):
            rings[vertex.ring][vertex.index] = place
        sketch = with_rings(sketch, owner, [tuple(ring) for ring in rings])
    return sketch


def inserted(sketch: Sketch, edge: Edge, point: Point | None = None) -> Change:
    """Insert a vertex on an edge, at the edge's point unless another is given; it is selected then."""
    rings = [list(ring) for ring in ring_points(sketch, edge.of)]
    _ends(sketch, edge)
    (place,) = ring_near(np.array([point or edge.point], dtype=float))
    rings[edge.ring].insert(edge.index + 1, place)
    new = Selection(vertices=frozenset({Vertex(edge.of, edge.ring, edge.index + 1)}))
    return Change(with_rings(sketch, edge.of, rings), new, f"vertex inserted in {called(sketch, edge.of)}")


def deleted(sketch: Sketch, selection: Selection) -> Change:
    """Delete the selected vertices; a ring that has too few left goes, and with it a hole or the obstacle.

    The boundary keeps at least three.
    """
    if not selection.vertices:
        raise MapError("select vertices first")
    gone: dict[Owner, dict[int, set[int]]] = defaultdict(lambda: defaultdict(set))
    for vertex in selection.vertices:
        place_of(sketch, vertex)
        gone[vertex.of][vertex.ring].add(vertex.index)
    after = sketch
    for owner, by_ring in gone.items():
        after = _with_fewer(after, owner, by_ring)
    words = f"{Selection(vertices=selection.vertices).words(sketch)} deleted"
    left = replace(selection, vertices=frozenset()).within(after)
    return Change(after, left, words)


def edge_moved(sketch: Sketch, edge: Edge, dx: float, dy: float) -> Change:
    """Move both ends of an edge by (dx, dy) m."""
    a, b = _ends(sketch, edge)
    change = moved(sketch, Selection(vertices=frozenset({a, b})), dx, dy)
    return replace(change, words=f"edge of {called(sketch, edge.of)} moved")


def edge_pushed(sketch: Sketch, edge: Edge, by: float) -> Change:
    """Push an edge by so many metres along its normal, to the left; its neighbours keep their directions.

    A neighbour in line with the edge cannot: its end moves along the normal.
    """
    a, b = _ends(sketch, edge)
    ring = np.array(ring_points(sketch, edge.of)[edge.ring])
    p, q = ring[a.index], ring[b.index]
    length = float(np.hypot(*(q - p)))
    if length == 0.0:
        raise MapError("this edge has no length")
    closed = rings_of(sketch, edge.of)[edge.ring][2]
    count = len(ring)
    along = (q - p) / length
    shift = np.array([-along[1], along[0]]) * by
    places = {}
    for vertex, end, step in ((a, p, -1), (b, q, 1)):
        neighbour = vertex.index + step
        moved_to = end + shift
        if closed or 0 <= neighbour < count:
            direction = ring[neighbour % count] - end
            across = direction[0] * along[1] - direction[1] * along[0]
            if abs(across) > 1e-6 * np.hypot(*direction):
                # along the neighbour until it is as far from the edge as the edge is pushed
                moved_to = end + direction * (by / -across)
        places[vertex] = (float(moved_to[0]), float(moved_to[1]))
    selection = Selection(vertices=frozenset({a, b}))
    return Change(with_places(sketch, places), selection, f"edge of {called(sketch, edge.of)} pushed")


def hole_cut(sketch: Sketch, key: int, points: Sequence[Point]) -> Change:
    """Give a polygon a hole."""
    shape = sketch.item(key).shape
    if not isinstance(shape, PolygonObstacle):
        raise MapError("only a polygon can have holes: turn it into one first")
    hole = ring_near(np.array(points, dtype=float).reshape(-1, 2))
    if len(set(hole)) < 3 or shapely.Polygon(hole).area < SMALLEST**2:
        raise MapError("a hole needs three corners that enclose something")
    if not shapely.Polygon(hole).is_valid:
        raise MapError("the hole's outline crosses itself")
    if not sketch.item(key).geometry.covers(shapely.Polygon(hole)):
        raise MapError("a hole must lie inside the polygon, apart from other holes")
    after = sketch.with_shapes({key: replace(shape, holes=(*shape.holes, hole))})
    return Change(after, Selection.of(key), f"hole cut into {called(sketch, key)}")


def hole_filled(sketch: Sketch, key: int, ring: int) -> Change:
    """Take a hole of a polygon away."""
    shape = sketch.item(key).shape
    if not isinstance(shape, PolygonObstacle) or not 1 <= ring <= len(shape.holes):
        raise MapError("there is no such hole")
    holes = shape.holes[: ring - 1] + shape.holes[ring:]
    after = sketch.with_shapes({key: replace(shape, holes=holes)})
    return Change(after, Selection.of(key), f"hole of {called(sketch, key)} filled")


def reversed_order(sketch: Sketch, owner: Owner) -> Change:
    """Turn the order of the vertices round."""
    rings = [tuple(reversed(ring)) for ring in ring_points(sketch, owner)]
    if not rings_of(sketch, owner):
        raise MapError(f"the {called(sketch, owner)} has no order of vertices")
    after = with_rings(sketch, owner, rings)
    return Change(after, Selection.of(owner), f"order of {called(sketch, owner)} turned round")


def _with_rim(held: CircleObstacle | DiscStart, moves: Mapping[Vertex, Point]) -> tuple[Point, float]:
    """Return centre and radius after some of its handles have moved."""
    by_index = {vertex.index: place for vertex, place in moves.items()}
    (place,) = ring_near(np.array([by_index[min(by_index)]], dtype=float))
    if 0 in by_index:
        return place, held.radius
    radius = tenths(math.dist(held.center, place))
    if radius < SMALLEST:
        raise MapError("a circle needs a radius: drag its rim away from its centre")
    return held.center, radius


def _with_fewer(sketch: Sketch, owner: Owner, gone: Mapping[int, set[int]]) -> Sketch:
    """Return the sketch without some vertices of something, by ring and index."""
    rings: list[Ring] = []
    for number, ring in enumerate(ring_points(sketch, owner)):
        rings.append(tuple(point for k, point in enumerate(ring) if k not in gone.get(number, ())))
    if owner == BOUNDARY:
        if len(rings[0]) < 3:
            raise MapError("the boundary needs three corners at least")
        return with_rings(sketch, owner, rings)
    if isinstance(owner, str):
        if not isinstance(sketch.start(owner), PointsStart):
            raise MapError("the points of a disc cannot be deleted: delete the start itself")
        if rings[0]:
            return with_rings(sketch, owner, rings)
        return replace(sketch, starts=tuple(pair for pair in sketch.starts if pair[0] != owner))
    shape = sketch.item(owner).shape
    if isinstance(shape, CircleObstacle):
        raise MapError("the points of a circle cannot be deleted: delete the circle itself")
    if len(rings[0]) < (2 if isinstance(shape, WallObstacle) else 3):
        return sketch.without({owner})
    # a hole goes that has too few left, but one that was broken before and is not touched stays
    kept = [ring for k, ring in enumerate(rings) if k == 0 or k not in gone or len(ring) >= 3]
    return with_rings(sketch, owner, kept)


def _ends(sketch: Sketch, edge: Edge) -> tuple[Vertex, Vertex]:
    """Return the vertices at the ends of an edge."""
    for number, points, closed in rings_of(sketch, edge.of):
        count = len(points)
        if number == edge.ring and 0 <= edge.index < (count if closed else count - 1):
            return Vertex(edge.of, number, edge.index), Vertex(edge.of, number, (edge.index + 1) % count)
    raise MapError("there is no such edge any more")
