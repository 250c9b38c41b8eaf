"""Edits of vertices: moved, inserted, deleted, cut off, left out, straightened; walls joined and split."""

import cmath
import math
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import TypeAlias

import numpy as np
import shapely
from scipy import ndimage
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from shapely import LineString, Polygon

from robocov import environment as env
from robocov.arrays import Array
from robocov.environment import Point, Ring
from robocov.errors import MapError, format_count
from robocov.mapfile.models import MAX_SIZE_M, MIN_SIZE_M
from robocov_app.editor.model import require
from robocov_app.editor.model.geometry import (
    check_point,
    drop_repeated_points,
    round_length,
    round_ring,
    to_array,
)
from robocov_app.editor.model.selection import (
    Change,
    Edge,
    Selection,
    Vertex,
    find_position,
    replace_obstacles,
)
from robocov_app.editor.model.sketch import BOUNDARY, Owner, Sketch

_STRAIGHT = math.radians(0.1)  # a corner that turns by less has nothing to be cut off
_MOST_SEGMENTS = 256
_STEPS = 12  # tolerances that are tried, each half of the one before, until nothing crosses
_Cut: TypeAlias = Callable[[float], tuple[float, int]]  # length and segments for the angle of a turn
_Redraw: TypeAlias = Callable[[tuple[Ring, ...], bool], tuple[Ring, ...]]  # of rings, closed or not
_SAME = 1e-4  # ends of walls that are closer, in metres, are one point


def move_vertices(sketch: Sketch, selection: Selection, dx: float, dy: float) -> Change:
    """Move the selected vertices by (dx, dy) m; a rim's vertex changes the radius."""
    require(selection.vertices, "select vertices first")
    places = {vertex: find_position(sketch, vertex) for vertex in selection.vertices}
    after = place_vertices(sketch, {vertex: (x + dx, y + dy) for vertex, (x, y) in places.items()})
    return Change(after, selection, f"{Selection(vertices=selection.vertices).describe(sketch)} moved")


def place_vertices(sketch: Sketch, places: Mapping[Vertex, Point]) -> Sketch:
    """Return the sketch with vertices elsewhere; a circle's centre moves it, its rim gives the radius."""
    by_owner: dict[Owner, dict[Vertex, Point]] = defaultdict(dict)
    for vertex, place in places.items():
        find_position(sketch, vertex)
        by_owner[vertex.owner][vertex] = place
    for owner, moves in by_owner.items():
        disc = sketch.find_object(owner)
        if isinstance(disc, env.CircleObstacle | env.DiscStart):
            first = min(moves, key=lambda vertex: vertex.index)
            place = check_point(moves[first])
            radius = disc.radius if first.index == 0 else round_length(math.dist(disc.center, place))
            if first.index and radius < MIN_SIZE_M:
                raise MapError("a circle needs a radius: drag its rim away from its centre")
            center = disc.center if first.index else place
            sketch = sketch.with_objects({owner: replace(disc, center=center, radius=radius)})
            continue
        rings = [list(ring) for ring in sketch.list_vertex_rings(owner)]
        for vertex, place in zip(moves, round_ring(list(moves.values())), strict=True):
            rings[vertex.ring][vertex.index] = place
        sketch = sketch.with_rings(owner, rings)
    return sketch


def insert_vertex(sketch: Sketch, edge: Edge) -> Change:
    rings = [list(ring) for ring in sketch.list_vertex_rings(edge.owner)]
    counts = {number: len(ring) - (not closed) for number, ring, closed in sketch.list_rings(edge.owner)}
    require(0 <= edge.index < counts.get(edge.ring, 0), "there is no such edge any more")
    rings[edge.ring].insert(edge.index + 1, check_point(edge.point))
    new = Selection(vertices=frozenset({Vertex(edge.owner, edge.ring, edge.index + 1)}))
    after = sketch.with_rings(edge.owner, rings)
    return Change(after, new, f"vertex inserted in {sketch.display_name(edge.owner)}")


def delete_vertices(sketch: Sketch, selection: Selection) -> Change:
    """Delete the selected vertices, and with too few left the hole or obstacle; the boundary keeps three."""
    require(selection.vertices, "select vertices first")
    after = sketch
    for owner, gone in _by_ring(sketch, selection.vertices).items():
        thing, rings = sketch.find_object(owner), []
        if isinstance(thing, env.DiscStart | env.CircleObstacle):
            what, whole = ("disc", "start") if isinstance(owner, str) else ("circle", "circle")
            raise MapError(f"the points of a {what} cannot be deleted: delete the {whole} itself")
        least = {env.PointsStart: 1, env.WallObstacle: 2}.get(type(thing), 3)
        for number, ring in enumerate(sketch.list_vertex_rings(owner)):
            kept = tuple(point for k, point in enumerate(ring) if k not in gone[number])
            # a hole goes that has too few left, but one that was broken before and is not touched stays
            if number == 0 or not gone[number] or len(kept) >= 3:
                rings.append(kept)
        require(owner != BOUNDARY or len(rings[0]) >= least, "the boundary needs three corners at least")
        after = after.with_rings(owner, rings) if len(rings[0]) >= least else after.without({owner})
    words = f"{Selection(vertices=selection.vertices).describe(sketch)} deleted"
    return Change(after, selection.without_vertices().restrict_to(after), words)


def _by_ring(sketch: Sketch, vertices: Iterable[Vertex]) -> dict[Owner, dict[int, set[int]]]:
    found: dict[Owner, dict[int, set[int]]] = defaultdict(lambda: defaultdict(set))
    for vertex in vertices:
        find_position(sketch, vertex)
        found[vertex.owner][vertex.ring].add(vertex.index)
    return found


def fill_hole(sketch: Sketch, key: int, ring: int) -> Change:
    rings = sketch.list_vertex_rings(key)
    if not isinstance(sketch.find_object(key), env.PolygonObstacle) or not 1 <= ring < len(rings):
        raise MapError("there is no such hole")
    after = sketch.with_rings(key, rings[:ring] + rings[ring + 1 :])
    return Change(after, Selection.of(key), f"hole of {sketch.display_name(key)} filled")


def bevel_corners(sketch: Sketch, selection: Selection, length: float) -> Change:
    """Cut the selected corners off, `length` metres from each along both edges; ends of walls are none."""
    require(0.0 < length < math.inf, "a bevel needs a length above 0 m")
    return _cut(sketch, selection, lambda turn: (length, 1), "bevelled")


def round_corners(sketch: Sketch, selection: Selection, radius: float) -> Change:
    """Round the selected corners with a radius in metres, to a millimetre, by arcs that touch both edges."""
    require(0.0 < radius < math.inf, "expected a radius above 0 m")

    def cut(turn: float) -> tuple[float, int]:
        step = 2.0 * math.acos(max(1.0 - env.MAX_SAGITTA_M / radius, 0.0))
        return radius * math.tan(turn / 2.0), min(_MOST_SEGMENTS, math.ceil(turn / step))

    return _cut(sketch, selection, cut, "rounded")


def _cut(sketch: Sketch, selection: Selection, wanted: _Cut, words: str) -> Change:
    after, count = sketch, 0
    for owner, by_ring in _by_ring(sketch, selection.vertices).items():
        rings = list(sketch.list_vertex_rings(owner))
        for number, ring, closed in sketch.list_rings(owner):
            cuts = _cuts(ring, by_ring[number], closed, wanted)
            arcs = [_arc(ring, k, *cuts[k]) if k in cuts else [ring[k]] for k in range(len(ring))]
            if cuts:
                rings[number] = drop_repeated_points(round_ring(np.concatenate(arcs)), closed=closed)
                count += len(cuts)
                after = after.with_rings(owner, rings)
    require(count, "select corners first, of polygons, walls or the boundary")
    words = f"{count} corners {words}" if count > 1 else f"corner {words}"
    return Change(after, selection.without_vertices(), words)


def _cuts(ring: Ring, indices: set[int], closed: bool, wanted: _Cut) -> dict[int, tuple[float, int]]:
    """Return length and segments for those of the indices that are corners."""
    cuts, count = {}, len(ring)
    for k in sorted(indices):
        before, at, after = (complex(*ring[i % count]) for i in (k - 1, k, k + 1))
        # either way; 0 where an edge has no length
        turn = abs(cmath.phase((after - at) * (at - before).conjugate()))
        if not closed and k in (0, count - 1):
            continue
        require(turn <= math.pi - _STRAIGHT, "a corner that turns right back cannot be cut off")
        if turn >= _STRAIGHT:
            cuts[k] = wanted(turn)
    for k, (length, _) in cuts.items():
        for other in ((k - 1) % count, (k + 1) % count):
            edge = math.dist(ring[k], ring[other])
            taken = length + (cuts[other][0] if other in cuts else 0.0)
            if taken > edge + 1e-9:
                more = " for the corners at both ends" if other in cuts else ""
                lengths = f"{round_length(taken):g} m of an edge that is {round_length(edge):g} m long{more}"
                raise MapError(f"that takes {lengths}: expected less")
    return cuts


def _arc(ring: Ring, k: int, length: float, segments: int) -> Array:
    """Return the (segments + 1, 2) points of the arc that touches both edges so far from a corner."""
    before, corner, after = (complex(*ring[i % len(ring)]) for i in (k - 1, k, k + 1))
    back, on = (before - corner) / abs(before - corner), (after - corner) / abs(after - corner)
    half = cmath.phase(on / back) / 2.0  # the centre is where the normals at both ends meet: on the bisector
    bisector = (back + on) / abs(back + on)
    center = corner + length / math.cos(half) * bisector
    spoke, end = length * back + corner - center, length * on + corner - center
    points = center + spoke * np.exp(1j * np.linspace(0.0, cmath.phase(end / spoke), segments + 1))
    return np.column_stack([points.real, points.imag])


def extend_wall(sketch: Sketch, vertex: Vertex, point: Point) -> Change:
    """Go on with a wall from its first or last vertex; the new one is selected then."""
    points = _wall(sketch, vertex).points
    require(vertex.index in (0, len(points) - 1), "a wall goes on from its ends only")
    at = 0 if vertex.index == 0 else len(points)
    after = sketch.with_rings(vertex.owner, [(*points[:at], check_point(point), *points[at:])])
    selection = Selection(vertices=frozenset({Vertex(vertex.owner, 0, at)}))
    return Change(after, selection, f"{sketch.display_name(vertex.owner)} extended")


def split_wall(sketch: Sketch, vertex: Vertex) -> Change:
    wall = _wall(sketch, vertex)
    if not 0 < vertex.index < len(wall.points) - 1:
        raise MapError("a wall is cut at a vertex between its ends: insert one first")
    halves = wall.points[: vertex.index + 1], wall.points[vertex.index :]
    pieces = {vertex.owner: [replace(wall, points=points) for points in halves]}
    return replace_obstacles(sketch, pieces, f"{sketch.display_name(vertex.owner)} cut in two")


def _wall(sketch: Sketch, vertex: Vertex) -> env.WallObstacle:
    find_position(sketch, vertex)
    wall = sketch.find_object(vertex.owner)
    if not isinstance(wall, env.WallObstacle):
        raise MapError("that is no wall")
    return wall


def join_walls(sketch: Sketch, selection: Selection) -> Change:
    """Join the selected walls by their nearest ends, as wide as the lowest, with the first name and note."""
    items = selection.list_items(sketch)
    shapes = [item.shape for item in items if isinstance(item.shape, env.WallObstacle)]
    require(len(shapes) == len(items) >= 2, "select two or more walls to join, and nothing else")
    chain, *rest = [wall.points for wall in shapes]
    while rest:
        ways = [(a, b, line) for line in rest for a in (chain, chain[::-1]) for b in (line, line[::-1])]
        a, b, line = min(ways, key=lambda way: math.dist(way[0][-1], way[1][0]))
        chain = (*a, *(b[1:] if math.dist(a[-1], b[0]) <= _SAME else b))
        rest.remove(line)
    name = next((wall.name for wall in shapes if wall.name is not None), None)
    note = next((item.note for item in items if item.note), "")
    whole = replace(items[0], shape=env.WallObstacle(chain, shapes[0].width, name), note=note)
    kept = sketch.without(item.key for item in items[1:]).obstacles
    after = replace(sketch, obstacles=tuple(whole if item.key == whole.key else item for item in kept))
    return Change(after, Selection.of(whole.key), f"{len(items)} walls joined")


def simplify(sketch: Sketch, selection: Selection, tolerance: float) -> Change:
    """Leave vertices out, to `tolerance` m, by Douglas and Peucker (1973): nothing comes to cross itself."""
    require(0.0 <= tolerance <= MAX_SIZE_M, "expected a tolerance of 0 m or more")
    after, changed = _redrawn(sketch, selection, lambda rings, closed: _simpler(rings, tolerance, closed))
    count = sum(len(old) - len(new) for old, new in changed)
    require(count, "no vertex can be left out at that tolerance")
    words = "1 vertex left out" if count == 1 else f"{count} vertices left out"
    return Change(after, selection.without_vertices(), words)


def straighten(sketch: Sketch, selection: Selection, degrees: float = 5.0) -> Change:
    """Make edges horizontal or vertical that nearly are; those in line come to lie on one line."""
    require(0.0 < degrees <= 30.0, "expected an angle of up to 30 degrees")
    after, changed = _redrawn(
        sketch, selection, lambda rings, closed: tuple(_straight(ring, degrees, closed) for ring in rings)
    )
    require(changed, f"no edge is within {degrees:g} degrees of level or upright, and not so already")
    return Change(
        after, selection.without_vertices(), f"{format_count(len(changed), 'outline')} straightened"
    )


def _redrawn(sketch: Sketch, selection: Selection, redraw: _Redraw) -> tuple[Sketch, list[tuple[Ring, Ring]]]:
    """Redraw what is selected, or all obstacles; return the sketch, and what rings were and became."""
    chosen = selection.owners if selection.items or selection.boundary else sketch.index_by_key.keys()
    outlines = {
        each: found for each in sketch.owners if each in chosen and (found := sketch.list_rings(each))
    }
    require(outlines, "select polygons, walls or the boundary first")
    after, changed = sketch, []
    for owner, ((_, _, closed), *_) in outlines.items():
        rings = sketch.list_vertex_rings(owner)
        new = redraw(rings, closed)
        changed += [pair for pair in zip(rings, new, strict=True) if pair[0] != pair[1]]
        after = after.with_rings(owner, new) if new != rings else after
    return after, changed


def _simpler(rings: tuple[Ring, ...], tolerance: float, closed: bool) -> tuple[Ring, ...]:

    def is_sound(rings: tuple[Ring, ...]) -> bool:
        return not closed or (min(map(len, rings)) >= 3 and bool(Polygon(rings[0], rings[1:]).is_valid))

    for step in range(_STEPS):
        fewer = tuple(_fewer(ring, tolerance / 2**step, closed) for ring in rings)
        if is_sound(fewer) >= is_sound(rings):
            return fewer
    return rings


def _fewer(ring: Ring, tolerance: float, closed: bool) -> Ring:
    if len(set(ring)) < (4 if closed else 3):
        return ring
    if not closed:
        return tuple(LineString(ring).simplify(tolerance, preserve_topology=False).coords)
    # begin at a vertex that stays: the one farthest from the middle is a corner of the hull
    points = np.array(ring)
    first = int(np.hypot(*(points - points.mean(axis=0)).T).argmax())
    line = LineString([*ring[first:], *ring[: first + 1]]).simplify(tolerance, preserve_topology=False)
    kept = set(line.coords)
    if len(kept) < 3 or not shapely.MultiPoint(list(kept)).convex_hull.area > 0.0:
        return ring
    return tuple(point for point in ring if point in kept)  # in the order in which they were


def _straight(ring: Ring, degrees: float, closed: bool) -> Ring:
    points = to_array(ring)
    if len(points) < 2:
        return ring
    edges = np.roll(points, -1, axis=0) - points
    if not closed:
        edges[-1] = np.nan
    slope, count = math.tan(math.radians(degrees)), len(points)
    size, moved = np.abs(edges), points.copy()
    # the ends of edges in a row that are level come to the same y, of upright ones to the same x
    for axis in (1, 0):
        flat = np.flatnonzero((size[:, axis] <= slope * size[:, 1 - axis]) & (size.max(axis=1) > 0.0))
        if len(flat) < count:
            row = coo_array((np.ones(len(flat)), (flat, (flat + 1) % count)), shape=(count, count))
            _, run = connected_components(row, directed=False)
            ends = [of(points[:, axis], run, run) for of in (ndimage.minimum, ndimage.maximum)]
            moved[:, axis] = (ends[0] + ends[1]) / 2
    if closed and (len({tuple(p) for p in moved.tolist()}) < 3 or Polygon(moved).area == 0.0):
        return ring
    return round_ring(moved)
