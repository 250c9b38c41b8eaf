"""Hit testing under the cursor and in a box; locked and hidden things are skipped."""

import math
from collections.abc import Iterable

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from robocov.arrays import Array
from robocov.environment import DiscStart, Point, PointsStart, StartSpec
from robocov_app.editor.model.geometry import nearest_on
from robocov_app.editor.model.selection import Edge, Selection, Vertex, ring_points, rings_of
from robocov_app.editor.model.sketch import BOUNDARY, Owner, Sketch


def owners_at(sketch: Sketch, point: Point, reach: float) -> tuple[Owner, ...]:
    """Return what a click may mean within `reach` m: starts, what covers the point, what is near."""
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
    near = np.sort(sketch.tree.query(_box_round(point, reach)))[::-1]
    near = near[[not (sketch.obstacles[k].locked or sketch.obstacles[k].hidden) for k in near]]
    away = shapely.distance(sketch.geometries[near], shapely.Point(point))
    keys = [sketch.obstacles[k].key for k in near.tolist()]
    found += [key for key, distance in zip(keys, away.tolist(), strict=True) if distance == 0.0]
    found += discs
    order = np.argsort(away, kind="stable").tolist()
    found += [keys[k] for k in order if 0.0 < away[k] <= reach]
    if sketch.boundary is not None and edge_at(sketch, point, reach, [BOUNDARY]) is not None:
        found.append(BOUNDARY)
    return tuple(found)


def obstacles_at(sketch: Sketch, point: Point, reach: float) -> list[int]:
    """Return the obstacles of `owners_at`, by their keys."""
    return [each for each in owners_at(sketch, point, reach) if isinstance(each, int) and each != BOUNDARY]


def edge_at(sketch: Sketch, point: Point, reach: float, owners: Iterable[Owner]) -> Edge | None:
    """Return the nearest place on an edge of some things within `reach` metres; None if there is none."""
    best, nearest = reach, None
    wanted = list(owners)
    if len(wanted) > 8:  # of many obstacles, only those that may have something within reach
        near = {sketch.obstacles[k].key for k in sketch.tree.query(_box_round(point, reach)).tolist()}
        wanted = [each for each in wanted if each in near or each not in sketch.places]
    for owner in wanted:
        for ring, points, closed in rings_of(sketch, owner):
            starts = np.array(points, dtype=float).reshape(-1, 2)
            ends = np.roll(starts, -1, axis=0)
            if not closed:
                starts, ends = starts[:-1], ends[:-1]
            if not len(starts):
                continue
            feet = nearest_on(starts, ends, np.array(point))
            away = np.hypot(*(feet - point).T)
            k = int(away.argmin())
            if away[k] <= best and (nearest is None or away[k] < best):
                best = float(away[k])
                nearest = Edge(owner, ring, k, (float(feet[k, 0]), float(feet[k, 1])))
    return nearest


def in_box(sketch: Sketch, a: Point, b: Point, *, touched: bool = False) -> Selection:
    """Return all that lies in a box, `touched`: or only touches it; the boundary counts only as a whole."""
    low, high = np.minimum(a, b), np.maximum(a, b)
    box = shapely.box(*low, *high)
    if touched:
        places = sketch.tree.query(box, predicate="intersects")
    else:
        bounds = shapely.bounds(sketch.geometries).reshape(-1, 4)
        places = np.flatnonzero((bounds[:, :2] >= low).all(axis=1) & (bounds[:, 2:] <= high).all(axis=1))
    items = [sketch.obstacles[k] for k in places.tolist()]
    starts = [name for name, spec in sketch.starts if _start_in_box(spec, low, high, box, touched=touched)]
    ring = np.array(sketch.boundary or (), dtype=float).reshape(-1, 2)
    return Selection(
        frozenset(item.key for item in items if not (item.locked or item.hidden)),
        starts=frozenset(starts),
        boundary=bool(len(ring) and (ring >= low).all() and (ring <= high).all()),
    )


def vertices_in_box(sketch: Sketch, a: Point, b: Point, owners: Iterable[Owner]) -> Selection:
    """Return the vertices of some things that lie in the box with two opposite corners, m."""
    low, high = np.minimum(a, b), np.maximum(a, b)
    found = []
    for owner in owners:
        for ring, points in enumerate(ring_points(sketch, owner)):
            at = np.array(points, dtype=float).reshape(-1, 2)
            inside = (at >= low).all(axis=1) & (at <= high).all(axis=1)
            found += [Vertex(owner, ring, k) for k in np.flatnonzero(inside).tolist()]
    return Selection(vertices=frozenset(found))


def _start_in_box(spec: StartSpec, low: Array, high: Array, box: BaseGeometry, *, touched: bool) -> bool:
    if isinstance(spec, DiscStart):
        if touched:
            return bool(shapely.distance(box, shapely.Point(spec.center)) <= spec.radius)
        center = np.array(spec.center)
        return bool((center - spec.radius >= low).all() and (center + spec.radius <= high).all())
    if isinstance(spec, PointsStart) and spec.positions:
        inside = ((np.array(spec.positions) >= low) & (np.array(spec.positions) <= high)).all(axis=1)
        return bool(inside.any() if touched else inside.all())
    return False


def _box_round(point: Point, reach: float) -> BaseGeometry:
    x, y = point
    return shapely.box(x - reach, y - reach, x + reach, y + reach)
