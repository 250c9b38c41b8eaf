"""Edits of vertices: moved, inserted, deleted, cut off, left out, straightened; walls joined and split."""

import math
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import TypeAlias

import numpy as np
import shapely
from shapely import LineString, Polygon

from robocov import environment as env
from robocov.arrays import Array, BoolArray
from robocov.environment import Point, Ring
from robocov.errors import MapError, counted
from robocov.mapfile.models import LARGEST, SMALLEST
from robocov_app.editor.model.geometry import distinct, point_near, ring_near, tenths
from robocov_app.editor.model.selection import (
    Change,
    Edge,
    Selection,
    Vertex,
    display_name,
    place_of,
    replace_obstacles,
    ring_points,
    rings_of,
    with_rings,
)
from robocov_app.editor.model.sketch import BOUNDARY, Owner, Sketch

_STRAIGHT = math.radians(0.1)  # a corner that turns by less has nothing to be cut off
_MOST_SEGMENTS = 256

_Cut: TypeAlias = Callable[[float], tuple[float, int]]  # length and segments for the angle of a turn
_SAME = 1e-4  # ends of walls that are closer, in metres, are one point


def moved(sketch: Sketch, selection: Selection, dx: float, dy: float) -> Change:
    """Move the selected vertices by (dx, dy) m; a rim's vertex changes the radius."""
    if not selection.vertices:
        raise MapError("select vertices first")
    places = {vertex: place_of(sketch, vertex) for vertex in selection.vertices}
    places = {vertex: (x + dx, y + dy) for vertex, (x, y) in places.items()}
    return replace(put(sketch, places), selection=selection)


def put(sketch: Sketch, places: Mapping[Vertex, Point]) -> Change:
    """Put vertices at places, m: as typed, or dragged."""
    selection = Selection(vertices=frozenset(places))
    return Change(with_places(sketch, places), selection, f"{selection.words(sketch)} moved")


def with_places(sketch: Sketch, places: Mapping[Vertex, Point]) -> Sketch:
    """Return the sketch with vertices elsewhere; a circle's centre moves it, its rim gives the radius."""
    by_owner: dict[Owner, dict[Vertex, Point]] = defaultdict(dict)
    for vertex, place in places.items():
        place_of(sketch, vertex)
        by_owner[vertex.of][vertex] = place
    for owner, moves in by_owner.items():
        if isinstance(owner, str):
            spec = sketch.start(owner)
            if isinstance(spec, env.DiscStart):
                sketch = sketch.with_start(owner, env.DiscStart(*_with_rim(spec, moves)))
                continue
        elif owner != BOUNDARY:
            shape = sketch.item(owner).shape
            if isinstance(shape, env.CircleObstacle):
                center, radius = _with_rim(shape, moves)
                sketch = sketch.with_shapes({owner: replace(shape, center=center, radius=radius)})
                continue
        rings = [list(ring) for ring in ring_points(sketch, owner)]
        for vertex, place in zip(moves, ring_near(np.array(list(moves.values()))), strict=True):
            rings[vertex.ring][vertex.index] = place
        sketch = with_rings(sketch, owner, rings)
    return sketch


def _with_rim(disc: env.CircleObstacle | env.DiscStart, moves: Mapping[Vertex, Point]) -> tuple[Point, float]:
    by_index = {vertex.index: place for vertex, place in moves.items()}
    place = point_near(by_index[min(by_index)])
    if 0 in by_index:
        return place, disc.radius
    radius = tenths(math.dist(disc.center, place))
    if radius < SMALLEST:
        raise MapError("a circle needs a radius: drag its rim away from its centre")
    return disc.center, radius


def inserted(sketch: Sketch, edge: Edge) -> Change:
    """Insert a vertex at the point of an edge; it is selected then."""
    rings = [list(ring) for ring in ring_points(sketch, edge.of)]
    closed = {number: is_closed for number, _, is_closed in rings_of(sketch, edge.of)}
    if edge.ring not in closed or not 0 <= edge.index < len(rings[edge.ring]) - (not closed[edge.ring]):
        raise MapError("there is no such edge any more")
    rings[edge.ring].insert(edge.index + 1, point_near(edge.point))
    new = Selection(vertices=frozenset({Vertex(edge.of, edge.ring, edge.index + 1)}))
    words = f"vertex inserted in {display_name(sketch, edge.of)}"
    return Change(with_rings(sketch, edge.of, rings), new, words)


def deleted(sketch: Sketch, selection: Selection) -> Change:
    """Delete the selected vertices, and with too few left the hole or obstacle; the boundary keeps three."""
    if not selection.vertices:
        raise MapError("select vertices first")
    after = sketch
    for owner, by_ring in _by_ring(sketch, selection.vertices).items():
        after = _with_fewer(after, owner, by_ring)
    words = f"{Selection(vertices=selection.vertices).words(sketch)} deleted"
    return Change(after, selection.without_vertices().within(after), words)


def _by_ring(sketch: Sketch, vertices: Iterable[Vertex]) -> dict[Owner, dict[int, set[int]]]:
    found: dict[Owner, dict[int, set[int]]] = defaultdict(lambda: defaultdict(set))
    for vertex in vertices:
        place_of(sketch, vertex)
        found[vertex.of][vertex.ring].add(vertex.index)
    return found


def _with_fewer(sketch: Sketch, owner: Owner, gone: Mapping[int, set[int]]) -> Sketch:
    rings = [
        tuple(point for k, point in enumerate(ring) if k not in gone.get(number, ()))
        for number, ring in enumerate(ring_points(sketch, owner))
    ]
    if owner == BOUNDARY:
        if len(rings[0]) < 3:
            raise MapError("the boundary needs three corners at least")
        return with_rings(sketch, owner, rings)
    if isinstance(owner, str):
        if not isinstance(sketch.start(owner), env.PointsStart):
            raise MapError("the points of a disc cannot be deleted: delete the start itself")
        if rings[0]:
            return with_rings(sketch, owner, rings)
        return replace(sketch, starts=tuple(pair for pair in sketch.starts if pair[0] != owner))
    shape = sketch.item(owner).shape
    if isinstance(shape, env.CircleObstacle):
        raise MapError("the points of a circle cannot be deleted: delete the circle itself")
    if len(rings[0]) < (2 if isinstance(shape, env.WallObstacle) else 3):
        return sketch.without({owner})
    # a hole goes that has too few left, but one that was broken before and is not touched stays
    kept = [ring for k, ring in enumerate(rings) if k == 0 or k not in gone or len(ring) >= 3]
    return with_rings(sketch, owner, kept)


def hole_filled(sketch: Sketch, key: int, ring: int) -> Change:
    """Take a hole of a polygon away."""
    shape = sketch.item(key).shape
    if not isinstance(shape, env.PolygonObstacle) or not 1 <= ring <= len(shape.holes):
        raise MapError("there is no such hole")
    holes = shape.holes[: ring - 1] + shape.holes[ring:]
    after = sketch.with_shapes({key: replace(shape, holes=holes)})
    return Change(after, Selection.of(key), f"hole of {display_name(sketch, key)} filled")


# corners cut off and rounded


def bevelled(sketch: Sketch, selection: Selection, length: float) -> Change:
    """Cut the selected corners off, `length` metres from each along both edges; ends of walls are none."""
    if not (math.isfinite(length) and length > 0.0):
        raise MapError("a bevel needs a length above 0 m")
    return _cut(sketch, selection, lambda turn: (length, 1), "bevelled")


def rounded_off(sketch: Sketch, selection: Selection, radius: float) -> Change:
    """Round the selected corners with a radius in metres, to a millimetre, by arcs that touch both edges."""
    if not (math.isfinite(radius) and radius > 0.0):
        raise MapError("a radius above 0 m was wanted")

    def cut(turn: float) -> tuple[float, int]:
        step = 2.0 * math.acos(max(1.0 - env.SAGITTA / radius, 0.0))
        return radius * math.tan(turn / 2.0), min(_MOST_SEGMENTS, math.ceil(turn / step))

    return _cut(sketch, selection, cut, "rounded")


def _cut(sketch: Sketch, selection: Selection, wanted: _Cut, words: str) -> Change:
    after, count = sketch, 0
    for owner, by_ring in _by_ring(sketch, selection.vertices).items():
        rings = list(ring_points(sketch, owner))
        closed = {number: is_closed for number, _, is_closed in rings_of(sketch, owner)}
        for number in by_ring.keys() & closed.keys():
            cuts = _cuts(rings[number], by_ring[number], closed[number], wanted)
            rings[number] = _without_corners(rings[number], cuts, closed[number])
            count += len(cuts)
        if closed:
            after = with_rings(after, owner, rings)
    if not count:
        raise MapError("select corners first, of polygons, walls or the boundary")
    words = f"{count} corners {words}" if count > 1 else f"corner {words}"
    return Change(after, selection.without_vertices(), words)


def _cuts(ring: Ring, indices: set[int], closed: bool, wanted: _Cut) -> dict[int, tuple[float, int]]:
    """Return length and segments for those of the indices that are corners."""
    points = np.array(ring)
    cuts = {}
    for k in sorted(indices):
        turn = 0.0 if not closed and k in (0, len(ring) - 1) else _turn(points, k)
        if turn > math.pi - _STRAIGHT:
            raise MapError("a corner that turns right back cannot be cut off")
        if turn >= _STRAIGHT:
            cuts[k] = wanted(turn)
    count = len(ring)
    for k, (length, _) in cuts.items():
        for other in ((k - 1) % count, (k + 1) % count):
            edge = math.dist(ring[k], ring[other])
            taken = length + (cuts[other][0] if other in cuts else 0.0)
            if taken > edge + 1e-9:
                more = " for the corners at both ends" if other in cuts else ""
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
    new = [
        _arc(points[k - 1], points[k], points[(k + 1) % len(ring)], *cuts[k])
        if k in cuts
        else points[k : k + 1]
        for k in range(len(ring))
    ]
    return distinct(ring_near(np.concatenate(new)), closed=closed)


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
    turned = np.column_stack([cos * spoke[0] - sin * spoke[1], sin * spoke[0] + cos * spoke[1]])
    return np.asarray(center + turned)


# walls


def extended(sketch: Sketch, vertex: Vertex, point: Point) -> Change:
    """Go on with a wall from its first or last vertex; the new one is selected then."""
    key, wall = _wall(sketch, vertex)
    place, last = point_near(point), len(wall.points) - 1
    if vertex.index not in (0, last):
        raise MapError("a wall goes on from its ends only")
    at_end = vertex.index == last
    points = (*wall.points, place) if at_end else (place, *wall.points)
    selection = Selection(vertices=frozenset({Vertex(key, 0, last + 1 if at_end else 0)}))
    after = sketch.with_shapes({key: replace(wall, points=points)})
    return Change(after, selection, f"{display_name(sketch, key)} extended")


def split(sketch: Sketch, vertex: Vertex) -> Change:
    """Cut a wall in two at one of its inner vertices; both are selected then."""
    key, wall = _wall(sketch, vertex)
    if not 0 < vertex.index < len(wall.points) - 1:
        raise MapError("a wall is cut at a vertex between its ends: insert one first")
    halves = wall.points[: vertex.index + 1], wall.points[vertex.index :]
    pieces = [replace(wall, points=points) for points in halves]
    return replace_obstacles(sketch, {key: pieces}, f"{display_name(sketch, key)} cut in two")


def joined(sketch: Sketch, selection: Selection) -> Change:
    """Join the selected walls by their nearest ends, as wide as the lowest, with the first name and note."""
    items = [item for item in sketch.obstacles if item.key in selection.items]
    shapes = [item.shape for item in items if isinstance(item.shape, env.WallObstacle)]
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
    whole = replace(items[0], shape=env.WallObstacle(chain, shapes[0].width, name), note=note)
    kept = sketch.without(item.key for item in items[1:]).obstacles
    after = replace(sketch, obstacles=tuple(whole if item.key == whole.key else item for item in kept))
    return Change(after, Selection.of(whole.key), f"{len(items)} walls joined")


def _chained(chain: Ring, line: Ring) -> tuple[float, Ring]:
    """Return the gap between two lines, m, and the line that they make where their ends are nearest."""
    ways = []
    for a in (chain, chain[::-1]):
        for b in (line, line[::-1]):
            gap = math.dist(a[-1], b[0])
            ways.append((gap, (*a, *(b[1:] if gap <= _SAME else b))))
    return min(ways, key=lambda way: way[0])


def _wall(sketch: Sketch, vertex: Vertex) -> tuple[int, env.WallObstacle]:
    place_of(sketch, vertex)
    if isinstance(vertex.of, int) and vertex.of in sketch.places:
        shape = sketch.item(vertex.of).shape
        if isinstance(shape, env.WallObstacle):
            return vertex.of, shape
    raise MapError("that is no wall")


_STEPS = 12  # tolerances that are tried, each half of the one before, until nothing crosses


def simplified(sketch: Sketch, selection: Selection, tolerance: float) -> Change:
    """Leave vertices out, to `tolerance` m, by Douglas and Peucker (1973): nothing comes to cross itself."""
    if not (math.isfinite(tolerance) and 0.0 <= tolerance <= LARGEST):
        raise MapError("a tolerance of 0 m or more was wanted")
    after, before = sketch, 0
    for owner in _owners(sketch, selection):
        rings = ring_points(sketch, owner)
        fewer = _simpler(rings, tolerance, closed=rings_of(sketch, owner)[0][2])
        before += sum(map(len, rings)) - sum(map(len, fewer))
        if fewer != rings:
            after = with_rings(after, owner, fewer)
    if not before:
        raise MapError("no vertex can be left out at that tolerance")
    words = "1 vertex left out" if before == 1 else f"{before} vertices left out"
    return Change(after, selection.without_vertices(), words)


def straightened(sketch: Sketch, selection: Selection, degrees: float = 5.0) -> Change:
    """Make edges horizontal or vertical that nearly are; those in line come to lie on one line."""
    if not 0.0 < degrees <= 30.0:
        raise MapError("an angle of up to 30 degrees was wanted")
    after, count = sketch, 0
    for owner in _owners(sketch, selection):
        rings = []
        for _, points, closed in rings_of(sketch, owner):
            rings.append(_straight(points, degrees, closed=closed))
            count += rings[-1] != points
        if any(new != old for new, old in zip(rings, ring_points(sketch, owner), strict=True)):
            after = with_rings(after, owner, rings)
    if not count:
        raise MapError(f"no edge is within {degrees:g} degrees of level or upright, and not so already")
    return Change(after, selection.without_vertices(), f"{counted(count, 'outline')} straightened")


def _owners(sketch: Sketch, selection: Selection) -> list[Owner]:
    everything = not (selection.items or selection.boundary)
    owners: list[Owner] = [
        item.key
        for item in sketch.obstacles
        if (everything or item.key in selection.items) and rings_of(sketch, item.key)
    ]
    if selection.boundary and sketch.boundary is not None:
        owners.append(BOUNDARY)
    if not owners:
        raise MapError("select polygons, walls or the boundary first")
    return owners


def _simpler(rings: tuple[Ring, ...], tolerance: float, *, closed: bool) -> tuple[Ring, ...]:
    """Return the rings of one thing with fewer vertices; the vertices that stay are the same."""
    sound = _is_sound(rings, closed=closed)
    for step in range(_STEPS):
        fewer = tuple(_fewer(ring, tolerance / 2**step, closed=closed) for ring in rings)
        if _is_sound(fewer, closed=closed) >= sound:
            return fewer
    return rings


def _is_sound(rings: tuple[Ring, ...], *, closed: bool) -> bool:
    if not closed:
        return True
    return min(map(len, rings)) >= 3 and bool(Polygon(rings[0], rings[1:]).is_valid)


def _fewer(ring: Ring, tolerance: float, *, closed: bool) -> Ring:
    if len(set(ring)) < (4 if closed else 3):
        return ring
    if not closed:
        return tuple(LineString(ring).simplify(tolerance, preserve_topology=False).coords)
    # begin at a vertex that stays: the one farthest from the middle is a corner of the hull
    points = np.array(ring)
    first = int(np.hypot(*(points - points.mean(axis=0)).T).argmax())
    turned = np.roll(points, -first, axis=0)
    line = LineString(np.concatenate([turned, turned[:1]])).simplify(tolerance, preserve_topology=False)
    kept = [(float(x), float(y)) for x, y in line.coords[:-1]]
    if len(set(kept)) < 3 or not shapely.MultiPoint(kept).convex_hull.area > 0.0:
        return ring
    # in the order in which they were
    there = set(kept)
    return tuple(point for point in ring if point in there)


def _straight(ring: Ring, degrees: float, *, closed: bool) -> Ring:
    points = np.array(ring, dtype=float).reshape(-1, 2)
    if len(points) < 2:
        return ring
    edges = np.roll(points, -1, axis=0) - points
    if not closed:
        edges[-1] = np.nan
    slope = math.tan(math.radians(degrees))
    size = np.abs(edges)
    moved = points.copy()
    # level edges give their ends the same y, upright ones the same x
    for axis, flat in ((1, size[:, 1] <= slope * size[:, 0]), (0, size[:, 0] <= slope * size[:, 1])):
        for run in _runs(flat & (size.max(axis=1) > 0.0)):
            values = points[run, axis]
            moved[run, axis] = (values.min() + values.max()) / 2
    if closed and (len({tuple(p) for p in moved.tolist()}) < 3 or Polygon(moved).area == 0.0):
        return ring
    return ring_near(moved)


def _runs(flat: BoolArray) -> list[list[int]]:
    """Return the vertices of each run of edges of a ring that are flat, one after another."""
    count = len(flat)
    if flat.all():
        return []
    first = int(np.flatnonzero(~flat)[0]) + 1
    runs: list[list[int]] = []
    for k in (np.arange(first, first + count) % count).tolist():
        if not flat[k]:
            continue
        if not runs or runs[-1][-1] != k:
            runs.append([k])
        runs[-1].append((k + 1) % count)
    return runs
