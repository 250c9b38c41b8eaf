"""Edits of single vertices: of polygons and their holes, walls, the boundary, rims of circles, starts.

As in `edits`: a `Change`, or a MapError with a sentence. More are in `corners` and `walls`.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
import shapely

from robocov.arrays import Array
from robocov.environment import (
    SAGITTA,
    CircleObstacle,
    DiscStart,
    Point,
    PointsStart,
    PolygonObstacle,
    Ring,
    WallObstacle,
)
from robocov.errors import MapError
from robocov.mapfile.models import SMALLEST
from robocov_app.editor.model.geometry import ring_near, tenths
from robocov_app.editor.model.selection import (
    Change,
    Edge,
    Selection,
    Vertex,
    display_name,
    place_of,
    ring_points,
    rings_of,
    with_rings,
)
from robocov_app.editor.model.sketch import BOUNDARY, Item, Owner, Sketch


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
    return Change(
        with_rings(sketch, edge.of, rings), new, f"vertex inserted in {display_name(sketch, edge.of)}"
    )


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
    return replace(change, words=f"edge of {display_name(sketch, edge.of)} moved")


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
    return Change(with_places(sketch, places), selection, f"edge of {display_name(sketch, edge.of)} pushed")


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
    return Change(after, Selection.of(key), f"hole cut into {display_name(sketch, key)}")


def hole_filled(sketch: Sketch, key: int, ring: int) -> Change:
    """Take a hole of a polygon away."""
    shape = sketch.item(key).shape
    if not isinstance(shape, PolygonObstacle) or not 1 <= ring <= len(shape.holes):
        raise MapError("there is no such hole")
    holes = shape.holes[: ring - 1] + shape.holes[ring:]
    after = sketch.with_shapes({key: replace(shape, holes=holes)})
    return Change(after, Selection.of(key), f"hole of {display_name(sketch, key)} filled")


def reversed_order(sketch: Sketch, owner: Owner) -> Change:
    """Turn the order of the vertices round."""
    rings = [tuple(reversed(ring)) for ring in ring_points(sketch, owner)]
    if not rings_of(sketch, owner):
        raise MapError(f"the {display_name(sketch, owner)} has no order of vertices")
    after = with_rings(sketch, owner, rings)
    return Change(after, Selection.of(owner), f"order of {display_name(sketch, owner)} turned round")


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


_STRAIGHT = math.radians(0.1)
"""A corner that turns by less has nothing to be cut off."""

_MOST_SEGMENTS = 256


def bevelled(sketch: Sketch, selection: Selection, length: float, *, segments: int = 1) -> Change:
    """Cut the selected corners off, `length` metres from each along both edges; ends of walls are none.

    With more segments they are rounded, by the arc that touches both edges there.
    """
    if not (math.isfinite(length) and length > 0.0):
        raise MapError("a bevel needs a length above 0 m")
    if not 1 <= segments <= _MOST_SEGMENTS:
        raise MapError(f"1 to {_MOST_SEGMENTS} segments were wanted")
    return _cut(sketch, selection, lambda turn: (length, segments), "bevelled")


def rounded_off(sketch: Sketch, selection: Selection, radius: float) -> Change:
    """Round the selected corners with a radius in metres, to a millimetre."""
    if not (math.isfinite(radius) and radius > 0.0):
        raise MapError("a radius above 0 m was wanted")

    def cut(turn: float) -> tuple[float, int]:
        step = 2.0 * math.acos(max(1.0 - SAGITTA / radius, 0.0))
        return radius * math.tan(turn / 2.0), min(_MOST_SEGMENTS, math.ceil(turn / step))

    return _cut(sketch, selection, cut, "rounded")


def _cut(
    sketch: Sketch, selection: Selection, wanted: Callable[[float], tuple[float, int]], words: str
) -> Change:
    """Cut corners; `wanted` says for the angle that a corner turns by the length and the segments."""
    chosen: dict[Owner, dict[int, set[int]]] = defaultdict(lambda: defaultdict(set))
    for vertex in selection.vertices:
        place_of(sketch, vertex)
        chosen[vertex.of][vertex.ring].add(vertex.index)
    after, count = sketch, 0
    for owner, by_ring in chosen.items():
        closed = {number: is_closed for number, _, is_closed in rings_of(sketch, owner)}
        rings = list(ring_points(sketch, owner))
        for number, indices in by_ring.items():
            if number in closed:
                cuts = _cuts(rings[number], indices, closed[number], wanted)
                rings[number] = _without_corners(rings[number], cuts, closed[number])
                count += len(cuts)
        if closed:
            after = with_rings(after, owner, rings)
    if not count:
        raise MapError("select corners first, of polygons, walls or the boundary")
    return Change(
        after,
        Selection(selection.items, frozenset(), selection.starts, selection.boundary),
        (f"{count} corners {words}" if count > 1 else f"corner {words}"),
    )


def _cuts(
    ring: Ring, indices: set[int], closed: bool, wanted: Callable[[float], tuple[float, int]]
) -> dict[int, tuple[float, int]]:
    """Return length and segments for those of the indices that are corners."""
    points = np.array(ring)
    cuts = {}
    for k in sorted(indices):
        if not closed and k in (0, len(ring) - 1):
            continue
        turn = _turn(points, k)
        if turn < _STRAIGHT:
            continue
        if turn > math.pi - _STRAIGHT:
            raise MapError("a corner that turns right back cannot be cut off")
        cuts[k] = wanted(turn)
    count = len(ring)
    for k, (length, _) in cuts.items():
        for other in ((k - 1) % count, (k + 1) % count):
            edge = math.dist(ring[k], ring[other])
            both = other in cuts
            taken = length + (cuts[other][0] if both else 0.0)
            if taken > edge + 1e-9:
                more = " for the corners at both ends" if both else ""
                raise MapError(
                    f"that takes {tenths(taken):g} m of an edge that is {tenths(edge):g} m long{more}: "
                    f"less was wanted"
                )
    return cuts


def _turn(points: Array, k: int) -> float:
    """Return by how many radians a ring turns at a vertex, either way; 0 where an edge has no length."""
    before = points[k] - points[k - 1]
    after = points[(k + 1) % len(points)] - points[k]
    cross = before[0] * after[1] - before[1] * after[0]
    return abs(math.atan2(float(cross), float(before @ after)))


def _without_corners(ring: Ring, cuts: Mapping[int, tuple[float, int]], closed: bool) -> Ring:
    points = np.array(ring)
    count = len(ring)
    new: list[Array] = []
    for k in range(count):
        if k in cuts:
            length, segments = cuts[k]
            new.append(_arc(points[k - 1], points[k], points[(k + 1) % count], length, segments))
        else:
            new.append(points[k : k + 1])
    kept: list[Point] = []
    for point in ring_near(np.concatenate(new)):
        if not kept or point != kept[-1]:
            kept.append(point)
    if closed and len(kept) > 1 and kept[0] == kept[-1]:
        kept.pop()
    return tuple(kept)


def _arc(before: Array, corner: Array, after: Array, length: float, segments: int) -> Array:
    """Return the (segments + 1, 2) points of the arc that touches both edges so far from the corner."""
    back, on = before - corner, after - corner
    back, on = back / np.hypot(*back), on / np.hypot(*on)
    first, last = corner + length * back, corner + length * on
    if segments == 1:
        return np.array([first, last])
    # the centre is where the normals at both ends meet: on the bisector
    half = math.acos(float(np.clip(back @ on, -1.0, 1.0))) / 2.0
    bisector = (back + on) / np.hypot(*(back + on))
    center = corner + bisector * (length / math.cos(half))
    spoke, end = first - center, last - center
    sweep = math.atan2(float(spoke[0] * end[1] - spoke[1] * end[0]), float(spoke @ end))
    angle = np.linspace(0.0, sweep, segments + 1)
    cos, sin = np.cos(angle), np.sin(angle)
    return np.asarray(
        center + np.column_stack([cos * spoke[0] - sin * spoke[1], sin * spoke[0] + cos * spoke[1]])
    )


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
    return Change(after, selection, f"{display_name(sketch, key)} extended")


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
    words = f"{display_name(sketch, item.key)} cut in two"
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
