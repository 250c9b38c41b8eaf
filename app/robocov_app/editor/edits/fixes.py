"""Fixes: for problems of most kinds the change that mends them."""

from dataclasses import replace
from typing import Final

import numpy as np
import shapely
from shapely import LineString, MultiPolygon
from shapely.geometry.base import BaseGeometry
from shapely.ops import substring

from robocov.environment import SAGITTA, DiscStart, Point, PointsStart, WallObstacle
from robocov.errors import MapError
from robocov_app.editor.edits import boolean, properties, transform
from robocov_app.editor.model.geometry import distinct, outlines, rectangle, rounded
from robocov_app.editor.model.measurement import reach_of
from robocov_app.editor.model.selection import Change, Selection, numbered_name, rings_of, with_rings
from robocov_app.editor.model.sketch import Item, Sketch
from robocov_app.editor.model.validation import Kind, Problem, examined

TITLES: Final[dict[Kind, str]] = {
    "no boundary": "Draw one",
    "crossing": "Repair",
    "double": "Merge",
    "narrow": "Widen",
    "spot": "Move",
    "no room": "Move",
    "outside": "Delete",
    "twice": "Delete",
    "sealed": "Fill",
    "cut off": "Fill",
}
"""Button label of the fix for each kind of problem; other kinds have none."""

_MARGIN = 0.5  # metres between a boundary that is drawn round everything and what it is drawn round
_OVER = 0.002  # metres by which what fills a place reaches into what is round it
_SPARE = 1e-3  # metres by which a widened gap is wider than a robot


def fixed(sketch: Sketch, problem: Problem, radius: float) -> Change | None:
    """Return the change that mends a problem for robots of a radius, m; None where there is none."""
    try:
        return _fixed(sketch, problem, radius)
    except MapError:
        return None


def unreachable_filled(sketch: Sketch, radius: float) -> Change:
    """Fill all places that robots cannot reach from the largest part of the free space."""
    free = examined(sketch, radius)[1]
    reached, untouched = reach_of(free, radius)
    if not reached:
        raise MapError(f"no robot of radius {radius:g} m fits anywhere")
    return _filled(sketch, _beyond(free, reached[0], [*reached[1:], untouched, *list(free.geoms)[1:]]))


def _fixed(sketch: Sketch, problem: Problem, radius: float) -> Change | None:
    owner, where, kind = problem.of, problem.where, problem.kind
    if kind == "no boundary":
        return _boundary_drawn(sketch)
    if kind == "sealed" and where is not None:
        return _filled(sketch, where)
    if kind == "cut off" and where is not None:
        free = examined(sketch, radius)[1]
        return _filled(sketch, _beyond(free, reach_of(free, radius)[0][0], [where]))
    if kind == "narrow" and where is not None:
        return _widened(sketch, LineString(where), 2.0 * radius)
    if owner is None:
        return None
    if kind == "crossing":
        return boolean.repaired(sketch, Selection.of(owner))
    if kind in ("outside", "twice"):
        return properties.deleted(sketch, Selection.of(owner))
    if kind == "double":
        rings = [distinct(points, closed=closed) for _, points, closed in rings_of(sketch, owner)]
        words = f"{numbered_name(sketch, owner)}: vertices merged"
        return Change(with_rings(sketch, owner, rings), Selection.of(owner), words)
    if kind in ("spot", "no room") and isinstance(owner, str) and where is not None:
        return _start_moved(sketch, owner, where, radius)
    return None


def _boundary_drawn(sketch: Sketch) -> Change:
    low_x, low_y, high_x, high_y = sketch.bounds or (0.0, 0.0, 10.0, 10.0)
    by = _MARGIN if sketch.bounds else 0.0
    ring = rectangle(rounded((low_x - by, low_y - by)), rounded((high_x + by, high_y + by)))
    return Change(replace(sketch, boundary=ring), Selection(boundary=True), "boundary drawn round everything")


def _filled(sketch: Sketch, where: BaseGeometry) -> Change:
    shapes = outlines(where.buffer(_OVER, join_style="mitre", mitre_limit=2.0))
    if not shapes:
        raise MapError("there is nothing to fill")
    after, keys = sketch.added(shapes)
    return Change(after, Selection.of(*keys), "filled what cannot be reached")


def _beyond(free: MultiPolygon, largest: BaseGeometry, others: list[BaseGeometry]) -> BaseGeometry:
    """Return those parts of the free space that hold any of some places, without the largest part."""
    parts = shapely.get_parts(free - largest.buffer(SAGITTA))
    wanted = shapely.union_all(others).buffer(-SAGITTA)
    return shapely.union_all(parts[shapely.intersects(parts, wanted)])


def _start_moved(sketch: Sketch, name: str, where: BaseGeometry, radius: float) -> Change | None:
    """Move the spot at the last of some points, or a disc, to where a robot fits that is nearest."""
    room = examined(sketch, radius)[1].buffer(-radius - _SPARE)
    spec = sketch.start(name)
    if isinstance(spec, PointsStart):
        x, y = shapely.get_coordinates(where)[-1].tolist()
        number = max(k for k, at in enumerate(spec.positions) if at == (x, y))
        others = shapely.points(np.delete(np.array(spec.positions), number, axis=0))
        room -= shapely.union_all(shapely.buffer(others, 2.01 * radius + _SPARE))
        place = _nearest(room, (x, y))
        if place is None:
            return None
        positions = (*spec.positions[:number], place, *spec.positions[number + 1 :])
        words = f"start “{name}”: place {number + 1} moved to where a robot fits"
        return Change(sketch.with_start(name, PointsStart(positions)), Selection.of(name), words)
    if not isinstance(spec, DiscStart) or (center := _nearest(room, spec.center)) is None:
        return None
    words = f"start “{name}” moved to where a robot fits"
    return Change(sketch.with_start(name, replace(spec, center=center)), Selection.of(name), words)


def _nearest(room: BaseGeometry, point: Point) -> Point | None:
    if room.is_empty:
        return None
    return rounded(shapely.get_coordinates(shapely.shortest_line(room, shapely.Point(point)))[0])


def _widened(sketch: Sketch, gap: LineString, width: float) -> Change | None:
    """Make a gap as wide as asked: shorten a wall that ends at it, or move the smaller thing beside it."""
    lack = width + _SPARE - gap.length
    ends = [(gap.coords[0], gap.coords[-1]), (gap.coords[-1], gap.coords[0])]
    sides = [(item, a, b) for a, b in ends for item in _touching(sketch, a) if not item.locked]
    for item, a, _ in sides:
        shorter = _shortened(item, a, lack)
        if shorter is not None:
            words = f"{numbered_name(sketch, item.key)} shortened by {lack:.2g} m"
            return Change(sketch.with_shapes({item.key: shorter}), Selection.of(item.key), words)
    here, there = ({item.key for item, a, _ in sides if a == end} for end, _ in ends)
    alone = [side for side in sides if side[0].key not in here & there]
    if not alone or gap.length == 0.0:
        return None
    item, a, b = min(alone, key=lambda side: side[0].geometry.area)
    dx, dy = (lack * (a[k] - b[k]) / gap.length for k in (0, 1))
    change = transform.moved(sketch, Selection.of(item.key), dx, dy)
    return replace(change, words=f"{numbered_name(sketch, item.key)} moved by {lack:.2g} m")


def _touching(sketch: Sketch, point: Point) -> list[Item]:
    near = sketch.tree.query(shapely.Point(point), predicate="dwithin", distance=SAGITTA)
    return [sketch.obstacles[k] for k in near.tolist()]


def _shortened(item: Item, end: Point, by: float) -> WallObstacle | None:
    """Return a wall that is shorter at the end that is near a place; None where none of its ends is."""
    wall = item.shape
    if not isinstance(wall, WallObstacle) or len(wall.points) < 2:
        return None
    line = LineString(wall.points)
    reach = wall.width / 2 + SAGITTA
    for k, (low, high) in ((0, (by, line.length)), (-1, (0.0, line.length - by))):
        if shapely.Point(wall.points[k]).distance(shapely.Point(end)) <= reach and high - low > wall.width:
            return replace(wall, points=tuple(map(rounded, substring(line, low, high).coords)))
    return None
