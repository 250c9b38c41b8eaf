"""Automatic fixes: changes that solve most kinds of problems."""

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Final, NamedTuple, TypeAlias

import numpy as np
import shapely
from shapely import Geometry, LineString, MultiPolygon
from shapely.ops import substring

from robocov.environment import MAX_SAGITTA_M, Point, PointsStart, WallObstacle
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
from robocov_app.editor.model.selection import (
    Change,
    Selection,
    Vertex,
    find_position,
    format_numbered_name,
)
from robocov_app.editor.model.sketch import Item, Owner, Sketch
from robocov_app.editor.model.validation import Problem, ProblemKind, find_problems

BOUNDARY_MARGIN_M = 0.5  # between a new boundary and the objects that it encloses
DEFAULT_BOUNDS_M = (0.0, 0.0, 10.0, 10.0)
FILL_OVERLAP_M = 0.002  # by which a filled area overlaps the objects around it
FILL_MITRE_LIMIT = 2.0
MIN_GAP_ALIGNMENT = 0.5  # minimum cosine of the angle between a gap and a wall that ends at it
SPARE_M = 1e-3  # by which a widened gap exceeds the diameter of a robot
START_DISTANCE_RADII = 2.01  # minimum distance between two robots at a start, in radii


class FixRequest(NamedTuple):
    """A problem to solve.

    Attributes
    ----------
    sketch : Sketch
        The map.
    problem : Problem
        The problem.
    radius : float
        Radius of a robot, m.
    """

    sketch: Sketch
    problem: Problem
    radius: float


FindFix: TypeAlias = Callable[[FixRequest], Change]


class _GapSide(NamedTuple):
    """An obstacle at one end of a gap, with the end at the obstacle and the opposite one."""

    item: Item
    end: Point
    opposite_end: Point


@dataclass(frozen=True)
class Fix:
    """A fix for some kinds of problems.

    Attributes
    ----------
    title : str
        Label of the button.
    find : callable
        Returns the change; raises MapError if the problem cannot be solved.
    """

    title: str
    find: FindFix


def find_fix(sketch: Sketch, problem: Problem, radius: float) -> Change | None:
    """Find the change that solves a problem.

    Parameters
    ----------
    sketch : Sketch
        The map.
    problem : Problem
        The problem.
    radius : float
        Radius of a robot, m.

    Returns
    -------
    Change or None
        None if there is no fix for the problem.
    """
    fix = FIXES.get(problem.kind)
    if fix is None:
        return None
    with suppress(MapError):
        return fix.find(FixRequest(sketch, problem, radius))
    return None


def fill_unreachable(sketch: Sketch, radius: float) -> Change:
    """Fill all free space that robots with a radius, m, cannot reach from the largest reachable part."""
    _, free = find_problems(sketch, radius)
    swept, untouched = compute_reach(free, radius)
    require(swept, f"no robot of radius {radius:g} m fits anywhere")
    unreachable: list[Geometry | None] = [*swept[1:], untouched, *list(free.geoms)[1:]]
    return _fill(sketch, _find_unreachable_parts(free, swept[0], unreachable))


def _draw_boundary(request: FixRequest) -> Change:
    """Draw a rectangular boundary around all objects, with a margin, or of a default size."""
    sketch = request.sketch
    margin = BOUNDARY_MARGIN_M
    bounds = sketch.bounds
    description = "boundary drawn around everything"
    if bounds is None:
        margin = 0.0
        bounds = DEFAULT_BOUNDS_M
        description = f"boundary of {bounds[2] - bounds[0]:g} m × {bounds[3] - bounds[1]:g} m drawn"
    low_x, low_y, high_x, high_y = bounds
    low = round_point((low_x - margin, low_y - margin))
    high = round_point((high_x + margin, high_y + margin))
    boundary = build_rectangle(low, high)
    return Change(replace(sketch, boundary=boundary), Selection(boundary=True), description)


def _fill_sealed_area(request: FixRequest) -> Change:
    return _fill(request.sketch, request.problem.geometry)


def _fill_cut_off_area(request: FixRequest) -> Change:
    _, free = find_problems(request.sketch, request.radius)
    swept, _ = compute_reach(free, request.radius)
    return _fill(request.sketch, _find_unreachable_parts(free, swept[0], [request.problem.geometry]))


def _widen_gap(request: FixRequest) -> Change:
    """Make a gap wide enough for a robot.

    Shorten a wall that ends at the gap and points across it; if there is none, move the smallest obstacle
    next to the gap.
    """
    sketch = request.sketch
    gap = request.problem.geometry
    assert isinstance(gap, LineString)
    missing = 2.0 * request.radius + SPARE_M - gap.length
    sides = _list_gap_sides(sketch, gap)
    for side in sides:
        shortened = _shorten_wall(side, missing)
        if shortened is not None:
            wall, length = shortened
            key = side.item.key
            description = f"{format_numbered_name(sketch, key)} shortened by {length:.2g} m"
            return Change(sketch.with_objects({key: wall}), Selection.of(key), description)
    movable = _drop_obstacles_at_both_ends(sides)
    require(movable and gap.length > 0.0, "no obstacle next to the passage can be moved")
    item, end, opposite_end = min(movable, key=lambda side: side.item.geometry.area)
    dx = missing * (end[0] - opposite_end[0]) / gap.length
    dy = missing * (end[1] - opposite_end[1]) / gap.length
    change = transform.move(sketch, Selection.of(item.key), dx, dy)
    return replace(change, description=f"{format_numbered_name(sketch, item.key)} moved by {missing:.2g} m")


def _list_gap_sides(sketch: Sketch, gap: LineString) -> list[_GapSide]:
    """Return the obstacles at both ends of a gap, except for locked ones."""
    first = gap.coords[0]
    last = gap.coords[-1]
    sides: list[_GapSide] = []
    for end, opposite_end in ((first, last), (last, first)):
        indices = sketch.tree.query(shapely.Point(end), predicate="dwithin", distance=MAX_SAGITTA_M)
        items = [sketch.obstacles[k] for k in indices.tolist()]
        sides += [_GapSide(item, end, opposite_end) for item in items if not item.locked]
    return sides


def _drop_obstacles_at_both_ends(sides: list[_GapSide]) -> list[_GapSide]:
    """Return the sides whose obstacle touches only one end of the gap."""
    ends_by_key: dict[int, set[Point]] = {}
    for side in sides:
        ends_by_key.setdefault(side.item.key, set()).add(side.end)
    return [side for side in sides if len(ends_by_key[side.item.key]) == 1]


def _shorten_wall(side: _GapSide, missing: float) -> tuple[WallObstacle, float] | None:
    """Shorten a wall at the end next to a gap so that the gap becomes wider.

    The result is None if the obstacle is not such a wall, or if the wall is too short.

    Parameters
    ----------
    side : _GapSide
        The obstacle, which is not always a wall.
    missing : float
        Width that the gap lacks, m.

    Returns
    -------
    wall : WallObstacle
        The shortened wall.
    length : float
        Length that was removed, m. It is larger than the missing width if the wall is oblique to the gap.
    """
    wall = side.item.shape
    if not isinstance(wall, WallObstacle) or len(wall.points) < 2:
        return None
    line = LineString(wall.points)
    if line.length <= wall.width:
        return None
    for points, is_reversed in ((wall.points, False), (wall.points[::-1], True)):
        is_near = math.dist(points[0], side.end) <= wall.width / 2 + MAX_SAGITTA_M
        alignment = _compute_gap_alignment(side, points)
        if not is_near or alignment < MIN_GAP_ALIGNMENT:
            continue
        # The wall's end moves along the wall. Only the component of this shift along the gap widens the gap.
        length = missing / alignment
        remaining_length = line.length - length
        if remaining_length > wall.width:
            low = 0.0 if is_reversed else length
            remaining_part = substring(line, low, low + remaining_length)
            return replace(wall, points=tuple(map(round_point, remaining_part.coords))), length
    return None


def _compute_gap_alignment(side: _GapSide, points: Sequence[Point]) -> float:
    """Return the cosine of the angle between a gap and a wall that continues beyond the first of its points.

    It is 1 for a gap of length 0, which has no direction.
    """
    wall_end = points[0]
    previous = next(point for point in points if point != wall_end)
    outward = np.subtract(wall_end, previous) / math.dist(wall_end, previous)
    across = np.subtract(side.opposite_end, side.end)
    gap_length = math.dist(side.opposite_end, side.end)
    if gap_length == 0.0:
        return 1.0
    return float(outward @ across) / gap_length


def _get_owner(request: FixRequest) -> Owner:
    """Return the object that has the problem."""
    owner = request.problem.owner
    assert owner is not None
    return owner


def _repair_outline(request: FixRequest) -> Change:
    return boolean.repair_outlines(request.sketch, Selection.of(_get_owner(request)))


def _delete_object(request: FixRequest) -> Change:
    return properties.delete(request.sketch, Selection.of(_get_owner(request)))


def _merge_vertices(request: FixRequest) -> Change:
    sketch = request.sketch
    owner = _get_owner(request)
    rings = [
        drop_repeated_points(points, is_closed=is_closed) for _, points, is_closed in sketch.list_rings(owner)
    ]
    description = f"{format_numbered_name(sketch, owner)}: vertices merged"
    return Change(sketch.with_rings(owner, rings), Selection.of(owner), description)


def _move_start(request: FixRequest) -> Change:
    """Move a disc start, or one position of a start, to the nearest point with space for a robot.

    The last point of the problem's geometry is the position to move.
    """
    sketch = request.sketch
    radius = request.radius
    name = _get_owner(request)
    assert isinstance(name, str)
    start = sketch.get_start(name)
    _, free = find_problems(sketch, radius)
    space = free.buffer(-radius - SPARE_M)  # where the center of a robot can be
    number = 0
    label = ""
    if isinstance(start, PointsStart):
        x, y = shapely.get_coordinates(request.problem.geometry)[-1].tolist()
        # If a position occurs twice, the last one is moved, as in the message.
        number = max(k for k, position in enumerate(start.positions) if position == (x, y))
        others = shapely.points(np.delete(np.array(start.positions), number, axis=0))
        space -= shapely.union_all(shapely.buffer(others, START_DISTANCE_RADII * radius + SPARE_M))
        label = f": position {number + 1}"
    require(not space.is_empty, "there is no free position for a robot")
    vertex = Vertex(name, 0, number)
    nearest = shapely.shortest_line(space, shapely.Point(find_position(sketch, vertex)))
    moved = vertices.place_vertices(sketch, {vertex: round_point(nearest.coords[0])})
    return Change(moved, Selection.of(name), f"start “{name}”{label} moved to where a robot fits")


def _fill(sketch: Sketch, area: Geometry | None) -> Change:
    """Add obstacles that cover an area and slightly overlap the objects around it."""
    assert area is not None
    grown = area.buffer(FILL_OVERLAP_M, join_style="mitre", mitre_limit=FILL_MITRE_LIMIT)
    polygons = extract_polygons(grown)
    require(polygons, "there is nothing to fill")
    filled, keys = sketch.with_obstacles(polygons)
    return Change(filled, Selection.of(*keys), "unreachable areas filled")


def _find_unreachable_parts(
    free: MultiPolygon, reachable: Geometry, areas: list[Geometry | None]
) -> Geometry:
    """Return the parts of the free space outside the reachable space that overlap any of the given areas."""
    # Without the tolerance, slivers along the border of the reachable space would remain.
    parts = shapely.get_parts(free - reachable.buffer(MAX_SAGITTA_M))
    # Parts that only touch an area do not count.
    shrunk_areas = shapely.union_all(areas).buffer(-MAX_SAGITTA_M)
    return shapely.union_all(parts[shapely.intersects(parts, shrunk_areas)])


FIXES: Final[dict[ProblemKind, Fix]] = {
    "no boundary": Fix("Draw one", _draw_boundary),
    "crossing": Fix("Repair", _repair_outline),
    "double": Fix("Merge", _merge_vertices),
    "narrow": Fix("Widen", _widen_gap),
    "spot": Fix("Move", _move_start),
    "no space": Fix("Move", _move_start),
    "outside": Fix("Delete", _delete_object),
    "twice": Fix("Delete", _delete_object),
    "sealed": Fix("Fill", _fill_sealed_area),
    "cut off": Fix("Fill", _fill_cut_off_area),
}
"""The fix for each kind of problem; other kinds have none."""
