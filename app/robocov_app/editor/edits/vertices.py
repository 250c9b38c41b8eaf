"""Edits of vertices: move, insert, delete, bevel, round, simplify, straighten; join and split walls."""

import cmath
import math
from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import replace
from itertools import product
from typing import NamedTuple, TypeAlias

import numpy as np
import shapely
from scipy import ndimage
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from shapely import LineString, Polygon

from robocov import environment as env
from robocov.environment import Point, Ring
from robocov.errors import MapError, format_count
from robocov.mapfile.models import MAX_SIZE_M, MIN_SIZE_M
from robocov.typing import BoolArray, FloatArray
from robocov_app.editor.edits.paths import describe_lost_paths
from robocov_app.editor.model import require
from robocov_app.editor.model.geometry import (
    drop_repeated_points,
    round_length,
    round_map_point,
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

MIN_CORNER_RAD = math.radians(0.1)  # corners that turn by less are not cut off
MAX_ARC_SEGMENTS = 256
SIMPLIFY_ATTEMPTS = 12  # each with half the previous tolerance, until the outline does not intersect itself
STRAIGHTEN_ANGLE_DEG = 5.0
MAX_STRAIGHTEN_ANGLE_DEG = 30.0
JOIN_DISTANCE_M = 1e-4  # ends of walls that are closer than this become one vertex
_EDGE_TOLERANCE_M = 1e-9


class CornerCut(NamedTuple):
    """Shape of the cut at a corner.

    Attributes
    ----------
    length : float
        Length that is cut off each of the two edges, m.
    segments : int
        Number of segments of the arc that replaces the corner; 1 for a bevel.
    """

    length: float
    segments: int


ComputeCut: TypeAlias = Callable[[float], CornerCut]  # takes the angle by which a corner turns, rad
RingTransform: TypeAlias = Callable[
    [tuple[Ring, ...], bool], tuple[Ring, ...]
]  # takes the rings of an object, and whether they are closed


def move_vertices(sketch: Sketch, selection: Selection, dx: float, dy: float) -> Change:
    """Move the selected vertices by a displacement, m; a vertex on the rim of a circle changes its radius."""
    require(selection.vertices, "select vertices first")
    positions = {}
    for vertex in selection.vertices:
        x, y = find_position(sketch, vertex)
        positions[vertex] = (x + dx, y + dy)
    description = f"{Selection(vertices=selection.vertices).describe(sketch)} moved"
    return Change(place_vertices(sketch, positions), selection, description)


def place_vertices(sketch: Sketch, positions: Mapping[Vertex, Point]) -> Sketch:
    """Set the positions of vertices, m.

    The center vertex of a circle moves the circle; a vertex on the rim changes its radius.
    """
    positions_by_owner: dict[Owner, dict[Vertex, Point]] = defaultdict(dict)
    for vertex, position in positions.items():
        # This raises an error if the vertex no longer exists.
        find_position(sketch, vertex)
        positions_by_owner[vertex.owner][vertex] = position
    for owner, moved in positions_by_owner.items():
        shape = sketch.get_shape(owner)
        if isinstance(shape, env.CircleObstacle | env.DiscStart):
            sketch = sketch.with_objects({owner: _reshape_circle(shape, moved)})
            continue
        rings = [list(ring) for ring in sketch.list_vertex_rings(owner)]
        for vertex, position in zip(moved, round_ring(list(moved.values())), strict=True):
            rings[vertex.ring][vertex.index] = position
        sketch = sketch.with_rings(owner, rings)
    return sketch


def _reshape_circle(
    circle: env.CircleObstacle | env.DiscStart, positions: Mapping[Vertex, Point]
) -> env.CircleObstacle | env.DiscStart:
    """Return a circle moved to the position of its center vertex if given, or else with its rim moved."""
    vertex = min(positions, key=lambda vertex: vertex.index)
    position = round_map_point(positions[vertex])
    # Vertex 0 is the center; the others are on the rim.
    if vertex.index == 0:
        return replace(circle, center=position)
    radius = round_length(math.dist(circle.center, position))
    require(radius >= MIN_SIZE_M, "a circle needs a radius: drag its rim away from its center")
    return replace(circle, radius=radius)


def insert_vertex(sketch: Sketch, edge: Edge) -> Change:
    """Insert a vertex at the point of an edge, and select it."""
    rings = [list(ring) for ring in sketch.list_vertex_rings(edge.owner)]
    edge_counts = {ring.number: ring.edge_count for ring in sketch.list_rings(edge.owner)}
    require(0 <= edge.index < edge_counts.get(edge.ring, 0), "this edge no longer exists")
    rings[edge.ring].insert(edge.index + 1, round_map_point(edge.point))
    inserted = Vertex(edge.owner, edge.ring, edge.index + 1)
    return Change(
        sketch.with_rings(edge.owner, rings),
        Selection(vertices=frozenset({inserted})),
        f"vertex inserted in {sketch.display_name(edge.owner)}",
    )


def delete_vertices(sketch: Sketch, selection: Selection) -> Change:
    """Delete the selected vertices.

    Holes and objects with too few remaining vertices are deleted; the boundary must keep at least three.
    """
    require(selection.vertices, "select vertices first")
    changed = sketch
    for owner, indices_by_ring in _group_by_ring(sketch, selection.vertices).items():
        changed = _delete_from_object(changed, owner, indices_by_ring)
    description = f"{Selection(vertices=selection.vertices).describe(sketch)} deleted"
    return Change(changed, selection.without_vertices().restrict_to(changed), description)


def _delete_from_object(sketch: Sketch, owner: Owner, indices_by_ring: Mapping[int, set[int]]) -> Sketch:
    """Delete vertices of one object, given by ring; delete the object if too few vertices remain."""
    shape = sketch.get_shape(owner)
    if isinstance(shape, env.DiscStart):
        raise MapError("the points of a disc cannot be deleted: delete the start itself")
    if isinstance(shape, env.CircleObstacle):
        raise MapError("the points of a circle cannot be deleted: delete the circle itself")
    rings = []
    for number, ring in enumerate(sketch.list_vertex_rings(owner)):
        indices = indices_by_ring[number]
        remaining = tuple(point for k, point in enumerate(ring) if k not in indices)
        # A hole with too few vertices is kept if none of its vertices are selected.
        if number == 0 or not indices or len(remaining) >= 3:
            rings.append(remaining)
    minimum = {env.PointsStart: 1, env.WallObstacle: 2}.get(type(shape), 3)
    if len(rings[0]) >= minimum:
        return sketch.with_rings(owner, rings)
    require(owner != BOUNDARY, "the boundary needs at least three corners")
    return sketch.without({owner})


def _group_by_ring(sketch: Sketch, vertices: Iterable[Vertex]) -> dict[Owner, dict[int, set[int]]]:
    """Group the indices of vertices by owner and ring; raise MapError if a vertex no longer exists."""
    indices: dict[Owner, dict[int, set[int]]] = defaultdict(lambda: defaultdict(set))
    for vertex in vertices:
        find_position(sketch, vertex)
        indices[vertex.owner][vertex.ring].add(vertex.index)
    return indices


def fill_hole(sketch: Sketch, key: int, ring: int) -> Change:
    """Fill a hole of a polygon, given by the number of its ring."""
    rings = sketch.list_vertex_rings(key)
    if not isinstance(sketch.get_shape(key), env.PolygonObstacle) or not 1 <= ring < len(rings):
        raise MapError("there is no such hole")
    filled = sketch.with_rings(key, rings[:ring] + rings[ring + 1 :])
    return Change(filled, Selection.of(key), f"hole of {sketch.display_name(key)} filled")


def bevel_corners(sketch: Sketch, selection: Selection, length: float) -> Change:
    """Bevel the selected corners: cut off a length, m, of both edges. Ends of walls are not corners."""
    require(0.0 < length < math.inf, "a bevel needs a length above 0 m")
    return _cut_corners(sketch, selection, lambda turn: CornerCut(length, 1), "bevelled")


def round_corners(sketch: Sketch, selection: Selection, radius: float) -> Change:
    """Round the selected corners by polygonal arcs with a radius, m, that touch both edges."""
    require(0.0 < radius < math.inf, "expected a radius above 0 m")

    def compute_cut(turn: float) -> CornerCut:
        # Angle of a segment that deviates from the arc by at most MAX_SAGITTA_M.
        step = 2.0 * math.acos(max(1.0 - env.MAX_SAGITTA_M / radius, 0.0))
        return CornerCut(radius * math.tan(turn / 2.0), min(MAX_ARC_SEGMENTS, math.ceil(turn / step)))

    return _cut_corners(sketch, selection, compute_cut, "rounded")


def _cut_corners(sketch: Sketch, selection: Selection, compute_cut: ComputeCut, action: str) -> Change:
    """Cut off the selected corners of all objects, with the cut that `compute_cut` returns for each."""
    changed = sketch
    count = 0
    for owner, indices_by_ring in _group_by_ring(sketch, selection.vertices).items():
        rings = list(sketch.list_vertex_rings(owner))
        for number, ring, is_closed in sketch.list_rings(owner):
            cuts = _compute_cuts(ring, indices_by_ring[number], is_closed, compute_cut)
            if cuts:
                rings[number] = _replace_corners(ring, cuts, is_closed)
                count += len(cuts)
        if rings != list(sketch.list_vertex_rings(owner)):
            changed = changed.with_rings(owner, rings)
    require(count, "select corners of polygons, walls or the boundary first")
    description = f"corner {action}"
    if count > 1:
        description = f"{count} corners {action}"
    return Change(changed, selection.without_vertices(), description)


def _replace_corners(ring: Ring, cuts: Mapping[int, CornerCut], is_closed: bool) -> Ring:
    """Return a ring in which arcs replace the corners with cuts."""
    points: list[FloatArray] = []
    for index, point in enumerate(ring):
        if index in cuts:
            points.append(_build_arc(ring, index, cuts[index]))
        else:
            points.append(np.array([point]))
    return drop_repeated_points(round_ring(np.concatenate(points)), is_closed=is_closed)


def _compute_cuts(
    ring: Ring, indices: set[int], is_closed: bool, compute_cut: ComputeCut
) -> dict[int, CornerCut]:
    """Return the cut of each given vertex that is a corner.

    Raises MapError if the edges of a corner fold back on each other, or are too short for the cut.
    """
    cuts: dict[int, CornerCut] = {}
    count = len(ring)
    for index in sorted(indices):
        is_end = not is_closed and index in (0, count - 1)
        if is_end:
            continue
        turn = _compute_turn(ring, index)
        require(
            turn <= math.pi - MIN_CORNER_RAD, "a corner whose edges fold back on each other cannot be cut off"
        )
        if turn >= MIN_CORNER_RAD:
            cuts[index] = compute_cut(turn)
    for index, cut in cuts.items():
        for neighbor in ((index - 1) % count, (index + 1) % count):
            edge_length = math.dist(ring[index], ring[neighbor])
            required = cut.length
            reason = ""
            if neighbor in cuts:
                required += cuts[neighbor].length
                reason = " for the corners at both ends"
            if required > edge_length + _EDGE_TOLERANCE_M:
                needed = f"{round_length(required):g} m of an edge{reason}"
                available = f"{round_length(edge_length):g} m"
                raise MapError(f"the cut needs {needed}, but the edge is {available} long")
    return cuts


def _list_neighbors(ring: Ring, index: int) -> tuple[complex, complex, complex]:
    """Return the vertex before a corner, the corner and the vertex after it, as complex numbers x + iy."""
    count = len(ring)
    before = complex(*ring[(index - 1) % count])
    after = complex(*ring[(index + 1) % count])
    return before, complex(*ring[index]), after


def _compute_turn(ring: Ring, index: int) -> float:
    """Return the absolute angle by which a ring turns at a vertex, rad; 0 next to an edge of length 0."""
    before, corner, after = _list_neighbors(ring, index)
    return abs(cmath.phase((after - corner) * (corner - before).conjugate()))


def _build_arc(ring: Ring, index: int, cut: CornerCut) -> FloatArray:
    """Return the points of the arc that replaces a corner and touches both edges, (segments + 1, 2) m."""
    before, corner, after = _list_neighbors(ring, index)
    backwards = (before - corner) / abs(before - corner)
    forwards = (after - corner) / abs(after - corner)
    half_angle = cmath.phase(forwards / backwards) / 2.0
    # The center is on the bisector, where the normals at both ends meet.
    bisector = (backwards + forwards) / abs(backwards + forwards)
    center = corner + cut.length / math.cos(half_angle) * bisector
    first_spoke = cut.length * backwards + corner - center
    last_spoke = cut.length * forwards + corner - center
    angles = np.linspace(0.0, cmath.phase(last_spoke / first_spoke), cut.segments + 1)
    points = center + first_spoke * np.exp(1j * angles)
    return np.column_stack([points.real, points.imag])


def extend_wall(sketch: Sketch, vertex: Vertex, point: Point) -> Change:
    """Extend a wall from its first or last vertex to a point, m, and select the new end."""
    points = _require_wall(sketch, vertex).points
    require(vertex.index in (0, len(points) - 1), "a wall can be extended from its ends only")
    index = 0
    if vertex.index > 0:
        index = len(points)
    extended = sketch.with_rings(vertex.owner, [(*points[:index], round_map_point(point), *points[index:])])
    selection = Selection(vertices=frozenset({Vertex(vertex.owner, 0, index)}))
    return Change(extended, selection, f"{sketch.display_name(vertex.owner)} extended")


def split_wall(sketch: Sketch, vertex: Vertex) -> Change:
    """Split a wall into two walls at a vertex that is not an end."""
    wall = _require_wall(sketch, vertex)
    if not 0 < vertex.index < len(wall.points) - 1:
        raise MapError("a wall is cut at a vertex between its ends: insert one first")
    first = replace(wall, points=wall.points[: vertex.index + 1])
    second = replace(wall, points=wall.points[vertex.index :])
    description = f"{sketch.display_name(vertex.owner)} cut in two"
    return replace_obstacles(sketch, {vertex.owner: [first, second]}, description)


def _require_wall(sketch: Sketch, vertex: Vertex) -> env.WallObstacle:
    """Return the wall of a vertex; raise MapError if the vertex no longer exists or is not part of a wall."""
    find_position(sketch, vertex)
    wall = sketch.get_shape(vertex.owner)
    if not isinstance(wall, env.WallObstacle):
        raise MapError("this is not a wall")
    return wall


def join_walls(sketch: Sketch, selection: Selection) -> Change:
    """Join the selected walls at their nearest ends into one, with the width and path of the lowest wall."""
    items = selection.list_items(sketch)
    walls = [item.shape for item in items if isinstance(item.shape, env.WallObstacle)]
    require(len(walls) == len(items) >= 2, "select two or more walls to join, and nothing else")
    points = _join_lines([wall.points for wall in walls])
    name = next((wall.name for wall in walls if wall.name is not None), None)
    note = next((item.note for item in items if item.note), "")
    joined = replace(items[0], shape=replace(walls[0], points=points, name=name), note=note)
    remaining = sketch.without(item.key for item in items[1:])
    changed = remaining.with_items([joined])
    description = f"{len(items)} walls joined{describe_lost_paths(items)}"
    return Change(changed, Selection.of(joined.key), description)


def _join_lines(lines: list[Ring]) -> Ring:
    """Join lines to the first one, always the line with the nearest end next."""
    chain = lines[0]
    remaining = lines[1:]
    while remaining:
        joints: list[tuple[Ring, Ring, Ring]] = []
        for line in remaining:
            ends = product((chain, chain[::-1]), (line, line[::-1]))
            joints.extend((head, tail, line) for head, tail in ends)
        head, tail, line = min(joints, key=lambda joint: math.dist(joint[0][-1], joint[1][0]))
        if math.dist(head[-1], tail[0]) <= JOIN_DISTANCE_M:
            tail = tail[1:]
        chain = (*head, *tail)
        remaining.remove(line)
    return chain


def simplify(sketch: Sketch, selection: Selection, tolerance: float) -> Change:
    """Remove vertices by the algorithm of Douglas and Peucker (1973) with the given tolerance in meters.

    The tolerance is reduced if an outline would intersect itself.
    """
    require(
        0.0 <= tolerance <= MAX_SIZE_M,
        f"expected a tolerance from 0 to {MAX_SIZE_M:g} m, got {tolerance:g} m",
    )

    def simplify_rings(rings: tuple[Ring, ...], is_closed: bool) -> tuple[Ring, ...]:
        return _simplify_rings(rings, tolerance, is_closed)

    changed, replaced = _transform_rings(sketch, selection, simplify_rings)
    count = sum(len(old) - len(new) for old, new in replaced)
    require(count, "no vertex can be removed at this tolerance")
    description = f"{count} vertices removed"
    if count == 1:
        description = "1 vertex removed"
    return Change(changed, selection.without_vertices(), description)


def straighten(sketch: Sketch, selection: Selection, degrees: float = STRAIGHTEN_ANGLE_DEG) -> Change:
    """Make nearly horizontal or vertical edges exactly so; consecutive ones end up on the same line."""
    is_in_range = 0.0 < degrees <= MAX_STRAIGHTEN_ANGLE_DEG
    require(is_in_range, f"expected an angle above 0 and up to {MAX_STRAIGHTEN_ANGLE_DEG:g} degrees")

    def straighten_rings(rings: tuple[Ring, ...], is_closed: bool) -> tuple[Ring, ...]:
        return tuple(_straighten_ring(ring, degrees, is_closed) for ring in rings)

    changed, replaced = _transform_rings(sketch, selection, straighten_rings)
    require(replaced, f"no edge to straighten is within {degrees:g} degrees of the horizontal or vertical")
    description = f"{format_count(len(replaced), 'outline')} straightened"
    return Change(changed, selection.without_vertices(), description)


def _transform_rings(
    sketch: Sketch, selection: Selection, transform: RingTransform
) -> tuple[Sketch, list[tuple[Ring, Ring]]]:
    """Transform the rings of the selected obstacles and boundary, or of all obstacles if none are selected.

    Returns
    -------
    sketch : Sketch
        The map with the new rings.
    replaced : list of tuple of Ring
        Each ring that has changed, before and after.
    """
    candidates: Collection[Owner] = sketch.index_by_key.keys()
    if selection.items or selection.boundary:
        candidates = selection.owners
    # Circles, for example, have no rings.
    owners = [owner for owner in sketch.owners if owner in candidates and sketch.list_rings(owner)]
    require(owners, "select polygons, walls or the boundary first")
    changed = sketch
    replaced: list[tuple[Ring, Ring]] = []
    for owner in owners:
        _, _, is_closed = sketch.list_rings(owner)[0]
        rings = sketch.list_vertex_rings(owner)
        new_rings = transform(rings, is_closed)
        replaced += [(old, new) for old, new in zip(rings, new_rings, strict=True) if old != new]
        if new_rings != rings:
            changed = changed.with_rings(owner, new_rings)
    return changed, replaced


def _simplify_rings(rings: tuple[Ring, ...], tolerance: float, is_closed: bool) -> tuple[Ring, ...]:
    """Simplify the rings of an object with a tolerance, m, which is reduced while they would intersect."""
    for attempt in range(SIMPLIFY_ATTEMPTS):
        simplified = tuple(_simplify_ring(ring, tolerance / 2**attempt, is_closed) for ring in rings)
        if not is_closed or _is_valid_polygon(simplified) or not _is_valid_polygon(rings):
            return simplified
    return rings


def _is_valid_polygon(rings: tuple[Ring, ...]) -> bool:
    """Return whether closed rings, outline and holes, form a valid polygon."""
    has_corners = min(map(len, rings)) >= 3
    return has_corners and bool(Polygon(rings[0], rings[1:]).is_valid)


def _simplify_ring(ring: Ring, tolerance: float, is_closed: bool) -> Ring:
    """Simplify one ring with a tolerance, m; return it unchanged if it would become degenerate."""
    if len(set(ring)) < 3:
        return ring
    if not is_closed:
        return tuple(LineString(ring).simplify(tolerance, preserve_topology=False).coords)
    if len(set(ring)) == 3:
        return ring
    # Start at a vertex that must remain: the one farthest from the center is a corner of the convex hull.
    points = np.array(ring)
    first = int(np.hypot(*(points - points.mean(axis=0)).T).argmax())
    line = LineString([*ring[first:], *ring[: first + 1]])
    remaining = set(line.simplify(tolerance, preserve_topology=False).coords)
    if len(remaining) < 3 or not shapely.MultiPoint(list(remaining)).convex_hull.area > 0.0:
        return ring
    return tuple(point for point in ring if point in remaining)


def _straighten_ring(ring: Ring, degrees: float, is_closed: bool) -> Ring:
    """Straighten the edges of one ring; return a closed ring unchanged if it would become degenerate."""
    points = to_array(ring)
    count = len(points)
    if count < 2:
        return ring
    edges = np.roll(points, -1, axis=0) - points
    if not is_closed:
        # The last vertex of a line has no edge.
        edges[-1] = np.nan
    max_slope = math.tan(math.radians(degrees))
    widths, heights = np.abs(edges).T
    has_length = np.maximum(widths, heights) > 0.0
    is_upright = (widths <= max_slope * heights) & has_length
    is_level = (heights <= max_slope * widths) & has_length
    # Both ends of an upright edge get the same x, and those of a level edge the same y.
    xs, ys = points.T
    moved = np.column_stack([_align_straight_edges(xs, is_upright), _align_straight_edges(ys, is_level)])
    if is_closed:
        has_corners = len({tuple(point) for point in moved.tolist()}) >= 3
        if not has_corners or Polygon(moved).area == 0.0:
            return ring
    return round_ring(moved)


def _align_straight_edges(coordinates: FloatArray, is_straight: BoolArray) -> FloatArray:
    """Give both ends of each straight edge, and thus those of consecutive ones, the same coordinate.

    Parameters
    ----------
    coordinates : (k,) array, m
        The y coordinates for horizontal edges, the x coordinates for vertical ones.
    is_straight : (k,) array of bool
        Whether the edge from each vertex to the next is to be straight.

    Returns
    -------
    (k,) array, m
        New coordinates; unchanged if all edges are straight.
    """
    count = len(coordinates)
    straight = np.flatnonzero(is_straight)
    if len(straight) == count:
        return coordinates
    connections = (np.ones(len(straight)), (straight, (straight + 1) % count))
    graph = coo_array(connections, shape=(count, count))
    _, components = connected_components(graph, directed=False)
    low = ndimage.minimum(coordinates, components, components)
    high = ndimage.maximum(coordinates, components, components)
    return np.asarray((low + high) / 2)
