"""Checks of names and shapes against the rules of map files, with messages for the user."""

import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import shapely
from shapely import LineString, MultiPoint, Polygon

from robocov import environment as env
from robocov.environment import Obstacle, Point, Ring
from robocov.mapfile.models import MAX_COORDINATE_M, MAX_LABEL_CHARACTERS, MAX_SIZE_M, MIN_SIZE_M
from robocov.typing import FloatArray
from robocov_app.editor.model.geometry import to_array
from robocov_app.editor.model.problem import Problem, format_position
from robocov_app.editor.model.selection import format_numbered_name
from robocov_app.editor.model.sketch import BOUNDARY, Owner, Sketch

MAX_TEXT_CHARACTERS = 10_000
MAX_CROSSINGS = 20  # number of crossings of an outline that are marked on the map
FLAT_RATIO = 1e-9  # outlines with a smaller ratio of area to squared extent count as lines
_CONTROL_CHARACTER = re.compile(r"[\x00-\x1f\x7f]")


def check_shapes(sketch: Sketch) -> Iterator[Problem]:
    """Yield the errors in the names, description, boundary, obstacles and starts of a map."""
    for text in _check_label(sketch.name):
        yield Problem(f"the map {text}", None)
    if len(sketch.description) > MAX_TEXT_CHARACTERS:
        yield Problem(f"the description is longer than {MAX_TEXT_CHARACTERS} characters", None)
    if sketch.boundary is None:
        message = "there is no boundary: draw one around the free space"
        yield Problem(message, None, owner=BOUNDARY, kind="no boundary")
    for owner in sketch.owners:
        if isinstance(owner, str):
            for text in _check_label(owner):
                yield Problem(f"a start {text}", None, owner=owner)
        for problem in _check_object(sketch, owner):
            name = format_numbered_name(sketch, owner)
            yield replace(problem, owner=owner, message=f"{name}: {problem.message}")


def _check_label(name: str) -> Iterator[str]:
    if not name:
        yield "has no name"
    elif len(name) > MAX_LABEL_CHARACTERS:
        yield f"has a name of {len(name)} characters: it must not exceed {MAX_LABEL_CHARACTERS}"
    elif _CONTROL_CHARACTER.search(name):
        yield "has a name with line breaks or other control characters"


def _check_object(sketch: Sketch, owner: Owner) -> Iterator[Problem]:
    """Yield the errors of an object; their messages do not contain its name."""
    if owner == BOUNDARY:
        if sketch.boundary is not None:
            yield from _check_ring(sketch.boundary, "it")
        return
    shape = sketch.get_shape(owner)
    if isinstance(shape, Obstacle) and shape.name is not None:
        for text in _check_label(shape.name):
            yield Problem(text, None)
    check = _CHECKS.get(type(shape))
    if check is not None:
        yield from check(shape)


def _check_circle(circle: env.CircleObstacle | env.DiscStart) -> Iterator[Problem]:
    yield from _check_size("radius", circle.radius, (circle.center,))
    yield from _check_distance((circle.center,))


def _check_wall(wall: env.WallObstacle) -> Iterator[Problem]:
    """Yield errors in the width, position and length of a wall."""
    yield from _check_size("width", wall.width, wall.points)
    distance_problems = list(_check_distance(wall.points))
    if distance_problems:
        yield from distance_problems
        return
    points = to_array(wall.points)
    extent = 0.0
    if len(points):
        extent = np.ptp(points, axis=0).max()
    if len(points) < 2 or extent < MIN_SIZE_M:
        yield Problem("it has no length: it needs two different points", _build_line(points))
    elif extent > MAX_SIZE_M:
        message = f"it is {_format_number(extent)} m long: it must not exceed {MAX_SIZE_M / 1000:g} km"
        yield Problem(message, _build_line(points))


def _check_points_start(start: env.PointsStart) -> Iterator[Problem]:
    if not start.positions:
        yield Problem("has no positions: it needs one for each robot", None)
    yield from _check_distance(start.positions)
    seen: set[Point] = set()
    for position in start.positions:
        if position in seen:
            message = f"the position {format_position(*position)} occurs twice: each robot needs its own"
            yield Problem(message, shapely.Point(position), kind="spot")
        seen.add(position)


def _check_polygon(shape: env.PolygonObstacle) -> Iterator[Problem]:
    problems = list(_check_ring(shape.vertices))
    for hole in shape.holes:
        problems += _check_ring(hole, "a hole")
    yield from problems
    if not problems and shape.holes and not shape.polygon.is_valid:
        yield from _check_holes(shape)


def _check_holes(shape: env.PolygonObstacle) -> Iterator[Problem]:
    """Yield an error for each hole that extends beyond the outline, or touches it or another hole."""
    shell = Polygon(shape.vertices)
    valid_holes: list[Ring] = []
    for hole in shape.holes:
        inner = Polygon(hole)
        if not shell.covers(inner):
            yield Problem("a hole sticks out of its outline", inner - shell, kind="crossing")
        elif not Polygon(shape.vertices, [*valid_holes, hole]).is_valid:
            message = "a hole meets the outline or another hole: it must be apart from them"
            yield Problem(message, inner, kind="crossing")
        else:
            valid_holes.append(hole)


def _check_ring(ring: Ring, label: str = "its outline") -> Iterator[Problem]:
    """Yield errors in the outline of a boundary or polygon, or in a hole; `label` is its name in messages."""
    distance_problems = list(_check_distance(ring))
    if distance_problems:
        yield from distance_problems
        return
    points = to_array(ring)
    # Only different corners count.
    corners = len(set(ring))
    if corners < 3:
        count = ("no corners", "one corner", "two corners")[corners]
        yield Problem(f"{label} has {count}: it needs three", _build_line(points))
        return
    extent = np.ptp(points, axis=0)
    polygon = Polygon(points)
    if extent.max() > MAX_SIZE_M:
        size = f"{_format_number(extent[0])} × {_format_number(extent[1])} m"
        message = f"{label} measures {size}: neither side may exceed {MAX_SIZE_M / 1000:g} km"
        yield Problem(message, _build_line(points))
    elif _is_flat(polygon, extent):
        yield Problem(f"{label} encloses nothing: its corners lie on one line", _build_line(points))
    elif not polygon.is_valid:
        yield _describe_crossings(label, points, polygon)


def _is_flat(polygon: Polygon, extent: FloatArray) -> bool:
    hull_area = shapely.convex_hull(polygon).area
    return bool(extent.min() < MIN_SIZE_M or hull_area <= FLAT_RATIO * float(extent.max()) ** 2)


def _describe_crossings(label: str, points: FloatArray, polygon: Polygon) -> Problem:
    crossings = _find_crossings(points, polygon)
    others = len(crossings) - 1
    suffix = ""
    if others == 1:
        suffix = " and at one more point"
    elif others > 1:
        suffix = f" and at {others} more points"
    message = f"{label} crosses or touches itself at {format_position(*crossings[0])}{suffix}"
    return Problem(message, MultiPoint(crossings[:MAX_CROSSINGS]), kind="crossing")


def _find_crossings(points: FloatArray, polygon: Polygon) -> list[Point]:
    """Return the points where an outline crosses or touches itself, from left to right.

    The outline is cut into pieces at all crossings. More than two pieces end at a crossing.
    """
    line = LineString(np.concatenate([points, points[:1]]))
    pieces = shapely.get_parts(shapely.unary_union(line))
    ends = np.concatenate([np.asarray(piece.coords)[[0, -1]] for piece in pieces])
    positions, counts = np.unique(ends, axis=0, return_counts=True)
    is_crossing = counts > 2
    if not is_crossing.any():
        # An outline that turns back and runs along itself has free ends, where only one piece ends.
        is_crossing = counts != 2
    crossings = positions[is_crossing]
    if not len(crossings):
        # The reason ends with the coordinates of a point, for example "Self-intersection[1 2]".
        reason = shapely.is_valid_reason(polygon)
        x, y = map(float, reason[reason.index("[") + 1 : -1].split())
        return [(x, y)]
    return [(x, y) for x, y in crossings.tolist()]


def _check_size(label: str, size: float, points: Ring) -> Iterator[Problem]:
    """Yield an error if a width or radius, m, is out of range, located at the first of the given points."""
    if MIN_SIZE_M <= size <= MAX_SIZE_M:
        return
    limit = f"must not exceed {MAX_SIZE_M / 1000:g} km"
    if size < MIN_SIZE_M:
        limit = f"must be at least {1000 * MIN_SIZE_M:g} mm"
    point = None
    if points:
        point = shapely.Point(points[0])
    yield Problem(f"its {label} is {_format_number(size)} m: it {limit}", point)


def _check_distance(points: Ring) -> Iterator[Problem]:
    """Yield an error for the first point that is too far from the origin."""
    for x, y in points:
        # This comparison is also false for nan.
        if not max(abs(x), abs(y)) <= MAX_COORDINATE_M:
            limit = f"coordinates must be within {MAX_COORDINATE_M / 1000:.0f} km of the origin"
            yield Problem(f"{format_position(x, y)} is too far away: {limit}", shapely.Point(x, y))
            return


def _format_number(value: float) -> str:
    """Format a number with five digits, or as a whole number from 100,000 to a billion."""
    if 1e5 <= value < 1e9:
        return f"{value:.0f}"
    return f"{value:.5g}"


def _build_line(points: FloatArray) -> shapely.Geometry | None:
    """Build a line from points, or a point if there is only one; return None if there are none."""
    if not len(points):
        return None
    if len(points) == 1:
        return shapely.Point(points[0])
    return LineString(points)


_CHECKS: dict[type, Callable[[Any], Iterator[Problem]]] = {
    env.PolygonObstacle: _check_polygon,
    env.CircleObstacle: _check_circle,
    env.DiscStart: _check_circle,
    env.WallObstacle: _check_wall,
    env.PointsStart: _check_points_start,
}
