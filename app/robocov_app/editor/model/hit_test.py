"""Hit testing under the cursor and in a box; locked and hidden obstacles are skipped."""

import math
from collections.abc import Iterable, Sequence

import numpy as np
import shapely

from robocov.arrays import Array, BoolArray
from robocov.environment import DiscStart, Point, PointsStart
from robocov_app.editor.model.geometry import find_nearest_on_edges, to_array
from robocov_app.editor.model.selection import Edge, Selection, list_vertices
from robocov_app.editor.model.sketch import BOUNDARY, Item, Owner, Sketch


def find_owners(sketch: Sketch, point: Point, reach: float) -> tuple[Owner, ...]:
    """Return the objects that a click may mean: starts, obstacles, and those within `reach` metres."""
    found: list[Owner] = []
    discs: list[Owner] = []
    for name, spec in reversed(sketch.starts):
        if isinstance(spec, DiscStart):
            away = math.dist(point, spec.center)
            if away <= reach or abs(away - spec.radius) <= reach:
                found.append(name)
            elif away < spec.radius:
                discs.append(name)
        elif isinstance(spec, PointsStart) and any(math.dist(point, at) <= reach for at in spec.positions):
            found.append(name)
    near = [item for item in reversed(_items_near(sketch, point, reach)) if item.is_selectable]
    gaps = [(shapely.distance(item.geometry, shapely.Point(point)), item.key) for item in near]
    found += [key for gap, key in gaps if gap == 0.0]
    found += discs
    found += [key for gap, key in sorted(gaps, key=lambda each: each[0]) if 0.0 < gap <= reach]
    if sketch.boundary is not None and find_edge(sketch, point, reach, [BOUNDARY]) is not None:
        found.append(BOUNDARY)
    return tuple(found)


def find_obstacles(sketch: Sketch, point: Point, reach: float) -> list[int]:
    """Return the keys of the obstacles that a click may mean, see `find_owners`."""
    return [each for each in find_owners(sketch, point, reach) if isinstance(each, int) and each != BOUNDARY]


def find_edge(sketch: Sketch, point: Point, reach: float, owners: Iterable[Owner]) -> Edge | None:
    """Return the nearest edge of some objects within `reach` metres of a point."""
    best, nearest = reach, None
    wanted = list(owners)
    if len(wanted) > 8:  # of many obstacles, only those that may have something within reach
        near = {item.key for item in _items_near(sketch, point, reach)}
        wanted = [each for each in wanted if each in near or each not in sketch.index_by_key]
    for owner in wanted:
        for ring, points, closed in sketch.list_rings(owner):
            starts, count = to_array(points), len(points) - (not closed)
            if count <= 0:
                continue
            feet, away = find_nearest_on_edges(starts[:count], np.roll(starts, -1, axis=0)[:count], point)
            k = int(away.argmin())
            if away[k] <= best and (nearest is None or away[k] < best):
                best = float(away[k])
                nearest = Edge(owner, ring, k, (float(feet[k, 0]), float(feet[k, 1])))
    return nearest


def find_in_box(sketch: Sketch, a: Point, b: Point, *, touched: bool = False) -> Selection:
    """Return the objects in a box between two corners, m, with `touched` also those that it touches."""
    box = shapely.box(*np.minimum(a, b), *np.maximum(a, b))
    if touched:
        places = sketch.tree.query(box, predicate="intersects")
    else:
        places = np.flatnonzero(_inside(shapely.bounds(sketch.geometries), a, b).reshape(-1, 2).all(axis=1))
    items = [sketch.obstacles[k] for k in places.tolist()]
    starts = []
    for name, spec in sketch.starts:
        inside = _inside([at for _, at in list_vertices(sketch, name)], a, b)
        caught = inside.any() if touched else inside.size and inside.all()
        if touched and isinstance(spec, DiscStart):
            caught = shapely.distance(box, shapely.Point(spec.center)) <= spec.radius
        starts += [name] if caught else []
    ring = _inside(sketch.boundary or (), a, b)
    keys = frozenset(item.key for item in items if item.is_selectable)
    return Selection(keys, starts=frozenset(starts), boundary=bool(ring.size and ring.all()))


def find_vertices_in_box(sketch: Sketch, a: Point, b: Point, owners: Iterable[Owner]) -> Selection:
    """Return the vertices of some objects in a box between two corners, m."""
    pairs = [pair for owner in owners for pair in list_vertices(sketch, owner)]
    inside = np.flatnonzero(_inside([at for _, at in pairs], a, b)).tolist()
    return Selection(vertices=frozenset(pairs[k][0] for k in inside))


def _inside(points: Sequence[Point] | Array, a: Point, b: Point) -> BoolArray:
    at = to_array(points)
    return np.asarray(((at >= np.minimum(a, b)) & (at <= np.maximum(a, b))).all(axis=1))


def _items_near(sketch: Sketch, point: Point, reach: float) -> list[Item]:
    x, y = point
    near = sketch.tree.query(shapely.box(x - reach, y - reach, x + reach, y + reach))
    return [sketch.obstacles[k] for k in sorted(near.tolist())]
