"""Hit tests at the cursor and in a box; locked and hidden obstacles are skipped."""

import math
from collections.abc import Iterable, Sequence

import numpy as np
import shapely

from robocov.environment import DiscStart, Point, PointsStart, StartSpec
from robocov.typing import BoolArray, FloatArray
from robocov_app.editor.model.geometry import to_array
from robocov_app.editor.model.selection import Edge, Selection, list_vertices
from robocov_app.editor.model.sketch import BOUNDARY, Item, Owner, Sketch
from robocov_app.toolkit.tools.geometry import find_nearest_on_edges

MANY_OBJECTS = 8  # if there are more objects, only those near the point are searched


def find_owners(sketch: Sketch, point: Point, reach: float) -> tuple[Owner, ...]:
    """Return the objects that a click may refer to, the most likely first.

    Parameters
    ----------
    sketch : Sketch
        The map.
    point : Point
        Position of the click, m.
    reach : float
        Maximum distance of an object from the click, m.

    Returns
    -------
    tuple of Owner
        In this order: starts near the point, obstacles that contain it, disc-shaped starts that contain it,
        obstacles near it, and the boundary if an edge is near.
    """
    near_starts: list[Owner] = []
    surrounding_starts: list[Owner] = []
    for name, start in reversed(sketch.starts):
        if _is_near_start(start, point, reach):
            near_starts.append(name)
        elif isinstance(start, DiscStart) and math.dist(point, start.center) < start.radius:
            surrounding_starts.append(name)
    items = [item for item in reversed(_list_items_near(sketch, point, reach)) if item.is_selectable]
    gaps = [(shapely.distance(item.geometry, shapely.Point(point)), item.key) for item in items]
    owners = list(near_starts)
    owners += [key for gap, key in gaps if gap == 0.0]
    owners += surrounding_starts
    gaps.sort(key=lambda pair: pair[0])
    owners += [key for gap, key in gaps if 0.0 < gap <= reach]
    if sketch.boundary is not None and find_edge(sketch, point, reach, [BOUNDARY]) is not None:
        owners.append(BOUNDARY)
    return tuple(owners)


def _is_near_start(start: StartSpec, point: Point, reach: float) -> bool:
    """Return whether the center or rim of a disc, or any position, is within `reach` meters of a point."""
    if isinstance(start, DiscStart):
        distance = math.dist(point, start.center)
        return distance <= reach or abs(distance - start.radius) <= reach
    if isinstance(start, PointsStart):
        return any(math.dist(point, position) <= reach for position in start.positions)
    return False


def find_obstacles(sketch: Sketch, point: Point, reach: float) -> list[int]:
    """Return the keys of the obstacles that a click may refer to; see `find_owners`."""
    owners = find_owners(sketch, point, reach)
    return [owner for owner in owners if isinstance(owner, int) and owner != BOUNDARY]


def find_edge(sketch: Sketch, point: Point, reach: float, owners: Iterable[Owner]) -> Edge | None:
    """Return the edge of the given objects nearest to a point; None if it is farther than `reach` meters."""
    searched = list(owners)
    if len(searched) > MANY_OBJECTS:
        nearby = {item.key for item in _list_items_near(sketch, point, reach)}
        distant_obstacles = sketch.index_by_key.keys() - nearby
        # The boundary and the starts, which are not obstacles, are always searched.
        searched = [owner for owner in searched if owner not in distant_obstacles]
    smallest_gap = reach
    nearest: Edge | None = None
    for owner in searched:
        for ring in sketch.list_rings(owner):
            if ring.edge_count == 0:
                continue
            points = to_array(ring.points)
            starts = points[: ring.edge_count]
            ends = np.roll(points, -1, axis=0)[: ring.edge_count]
            feet, gaps = find_nearest_on_edges(starts, ends, point)
            index = int(gaps.argmin())
            gap = float(gaps[index])
            is_first_in_reach = nearest is None and gap <= reach
            if is_first_in_reach or gap < smallest_gap:
                smallest_gap = gap
                nearest = Edge(owner, ring.number, index, (float(feet[index, 0]), float(feet[index, 1])))
    return nearest


def find_in_box(sketch: Sketch, a: Point, b: Point, *, includes_partial: bool = False) -> Selection:
    """Select the objects in a box.

    Parameters
    ----------
    sketch : Sketch
        The map.
    a, b : Point
        Opposite corners of the box, m.
    includes_partial : bool
        Whether to include objects that are only partly in the box. The boundary must always be completely
        inside.
    """
    box = shapely.box(*np.minimum(a, b), *np.maximum(a, b))
    if includes_partial:
        indices = sketch.tree.query(box, predicate="intersects")
    else:
        corners = _is_in_box(shapely.bounds(sketch.geometries), a, b).reshape(-1, 2)
        indices = np.flatnonzero(corners.all(axis=1))
    items = [sketch.obstacles[index] for index in indices.tolist()]
    starts = []
    for name, start in sketch.starts:
        if includes_partial and isinstance(start, DiscStart):
            is_inside = shapely.distance(box, shapely.Point(start.center)) <= start.radius
        else:
            is_inside = _is_start_in_box(sketch, name, a, b, includes_partial=includes_partial)
        if is_inside:
            starts.append(name)
    boundary = _is_in_box(sketch.boundary or (), a, b)
    keys = frozenset(item.key for item in items if item.is_selectable)
    has_boundary = bool(boundary.size and boundary.all())
    return Selection(keys, starts=frozenset(starts), boundary=has_boundary)


def _is_start_in_box(sketch: Sketch, name: str, a: Point, b: Point, *, includes_partial: bool) -> bool:
    """Return whether all vertices of a start (with `includes_partial`, any of them) are in a box."""
    inside = _is_in_box([position for _, position in list_vertices(sketch, name)], a, b)
    if includes_partial:
        return bool(inside.any())
    return bool(inside.size and inside.all())


def find_vertices_in_box(sketch: Sketch, a: Point, b: Point, owners: Iterable[Owner]) -> Selection:
    """Select the vertices of the given objects in a box between two corners, m."""
    pairs = [pair for owner in owners for pair in list_vertices(sketch, owner)]
    inside = _is_in_box([position for _, position in pairs], a, b)
    return Selection(vertices=frozenset(pairs[k][0] for k in np.flatnonzero(inside).tolist()))


def _is_in_box(points: Sequence[Point] | FloatArray, a: Point, b: Point) -> BoolArray:
    """Return a mask of the points, (k, 2) m, in a box between two corners."""
    coordinates = to_array(points)
    is_inside = (coordinates >= np.minimum(a, b)) & (coordinates <= np.maximum(a, b))
    return np.asarray(is_inside.all(axis=1))


def _list_items_near(sketch: Sketch, point: Point, reach: float) -> list[Item]:
    """Return the obstacles whose bounds are within `reach` meters of a point, from bottom to top."""
    x, y = point
    indices = sketch.tree.query(shapely.box(x - reach, y - reach, x + reach, y + reach))
    return [sketch.obstacles[index] for index in sorted(indices.tolist())]
