"""Fixes: for problems of most kinds the change that mends them."""

import math
from contextlib import suppress
from dataclasses import replace
from typing import Any, Final

import numpy as np
import shapely
from shapely import Geometry, LineString, MultiPolygon
from shapely.ops import substring

from robocov.environment import MAX_SAGITTA_M, Obstacle, Point, PointsStart, WallObstacle
from robocov.errors import MapError
from robocov_app.editor.edits import boolean, properties, transform, vertices
from robocov_app.editor.model import require
from robocov_app.editor.model.geometry import (
    build_rectangle,
    drop_repeated_points,
    extract_polygons,
    round_point,
)
from robocov_app.editor.model.measurement import compute_reach
from robocov_app.editor.model.selection import Change, Selection, Vertex, find_position, format_numbered_name
from robocov_app.editor.model.sketch import Sketch
from robocov_app.editor.model.validation import Kind, Problem, find_problems

_TITLES: dict[str, tuple[Kind, ...]] = {
    "Draw one": ("no boundary",), "Repair": ("crossing",), "Merge": ("double",), "Widen": ("narrow",),
    "Move": ("spot", "no room"), "Delete": ("outside", "twice"), "Fill": ("sealed", "cut off"),
}  # fmt: skip
FIX_TITLES: Final = {kind: title for title, kinds in _TITLES.items() for kind in kinds}
"""Button label of the fix for each kind of problem; other kinds have none."""

_MARGIN = 0.5  # metres between a boundary that is drawn round everything and what it is drawn round
_OVER = 0.002  # metres by which what fills a place reaches into what is round it
_SPARE = 1e-3  # metres by which a widened gap is wider than a robot


def find_fix(sketch: Sketch, problem: Problem, radius: float) -> Change | None:
    owner: Any = problem.owner  # problems of each kind have the place and the owner that its fix needs
    where: Any = problem.geometry
    with suppress(MapError):
        match problem.kind:
            case "no boundary":
                low_x, low_y, high_x, high_y = sketch.bounds or (0.0, 0.0, 10.0, 10.0)
                by = _MARGIN if sketch.bounds else 0.0
                ring = build_rectangle(
                    round_point((low_x - by, low_y - by)), round_point((high_x + by, high_y + by))
                )
                words = "boundary drawn round everything"
                return Change(replace(sketch, boundary=ring), Selection(boundary=True), words)
            case "sealed":
                return _filled(sketch, where)
            case "cut off":
                free = find_problems(sketch, radius)[1]
                return _filled(sketch, _beyond(free, compute_reach(free, radius)[0][0], [where]))
            case "narrow":
                return _widened(sketch, where, 2.0 * radius)
            case "crossing":
                return boolean.repair_outlines(sketch, Selection.of(owner))
            case "outside" | "twice":
                return properties.delete(sketch, Selection.of(owner))
            case "double":
                rings = [
                    drop_repeated_points(points, closed=closed)
                    for _, points, closed in sketch.list_rings(owner)
                ]
                words = f"{format_numbered_name(sketch, owner)}: vertices merged"
                return Change(sketch.with_rings(owner, rings), Selection.of(owner), words)
            case "spot" | "no room":
                return _start_moved(sketch, owner, where, radius)
    return None


def fill_unreachable(sketch: Sketch, radius: float) -> Change:
    free = find_problems(sketch, radius)[1]
    reached, untouched = compute_reach(free, radius)
    require(reached, f"no robot of radius {radius:g} m fits anywhere")
    return _filled(sketch, _beyond(free, reached[0], [*reached[1:], untouched, *list(free.geoms)[1:]]))


def _filled(sketch: Sketch, where: Geometry) -> Change:
    shapes = extract_polygons(where.buffer(_OVER, join_style="mitre", mitre_limit=2.0))
    require(shapes, "there is nothing to fill")
    after, keys = sketch.with_obstacles(shapes)
    return Change(after, Selection.of(*keys), "filled what cannot be reached")


def _beyond(free: MultiPolygon, largest: Geometry, others: list[Geometry]) -> Geometry:
    """Return those parts of the free space that hold any of some places, without the largest part."""
    parts = shapely.get_parts(free - largest.buffer(MAX_SAGITTA_M))
    return shapely.union_all(
        parts[shapely.intersects(parts, shapely.union_all(others).buffer(-MAX_SAGITTA_M))]
    )


def _start_moved(sketch: Sketch, name: str, where: Geometry, radius: float) -> Change:
    """Move the spot at the last of some points, or a disc, to where a robot fits that is nearest."""
    room = find_problems(sketch, radius)[1].buffer(-radius - _SPARE)
    spec, number, spot = sketch.get_start(name), 0, ""
    if isinstance(spec, PointsStart):
        x, y = shapely.get_coordinates(where)[-1].tolist()
        number = max(k for k, at in enumerate(spec.positions) if at == (x, y))
        others = shapely.points(np.delete(np.array(spec.positions), number, axis=0))
        room -= shapely.union_all(shapely.buffer(others, 2.01 * radius + _SPARE))
        spot = f": place {number + 1}"
    require(not room.is_empty, "a robot fits nowhere")
    vertex = Vertex(name, 0, number)
    way = shapely.shortest_line(room, shapely.Point(find_position(sketch, vertex)))
    after = vertices.place_vertices(sketch, {vertex: round_point(way.coords[0])})
    return Change(after, Selection.of(name), f"start “{name}”{spot} moved to where a robot fits")


def _widened(sketch: Sketch, gap: LineString, width: float) -> Change:
    """Make a gap as wide as asked: shorten a wall that ends at it, or move the smaller thing beside it."""
    lack = width + _SPARE - gap.length
    ends = [(gap.coords[0], gap.coords[-1]), (gap.coords[-1], gap.coords[0])]
    sides = []
    for a, b in ends:
        near = sketch.tree.query(shapely.Point(a), predicate="dwithin", distance=MAX_SAGITTA_M).tolist()
        sides += [(sketch.obstacles[k], a, b) for k in near if not sketch.obstacles[k].locked]
    for item, a, _ in sides:
        if shorter := _shortened(item.shape, a, lack):
            words = f"{format_numbered_name(sketch, item.key)} shortened by {lack:.2g} m"
            return Change(sketch.with_objects({item.key: shorter}), Selection.of(item.key), words)
    here, there = ({item.key for item, a, _ in sides if a == end} for end, _ in ends)
    alone = [side for side in sides if side[0].key not in here & there]
    require(alone and gap.length > 0.0, "nothing can move away")
    item, a, b = min(alone, key=lambda side: side[0].geometry.area)
    dx, dy = (lack * (a[k] - b[k]) / gap.length for k in (0, 1))
    change = transform.move(sketch, Selection.of(item.key), dx, dy)
    return replace(change, description=f"{format_numbered_name(sketch, item.key)} moved by {lack:.2g} m")


def _shortened(wall: Obstacle, end: Point, by: float) -> WallObstacle | None:
    """Return a wall that is shorter at the end that is near a place; None where none of its ends is."""
    if not isinstance(wall, WallObstacle) or len(wall.points) < 2:
        return None
    line = LineString(wall.points)
    for at, low, high in ((wall.points[0], by, line.length), (wall.points[-1], 0.0, line.length - by)):
        if math.dist(at, end) <= wall.width / 2 + MAX_SAGITTA_M and high - low > wall.width:
            return replace(wall, points=tuple(map(round_point, substring(line, low, high).coords)))
    return None
