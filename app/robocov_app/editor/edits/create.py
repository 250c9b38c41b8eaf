"""Edits that add obstacles, starts or a boundary, and that open doors in walls."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import count

import numpy as np
import shapely
from shapely.ops import substring

from robocov import environment as env
from robocov.environment import Obstacle, Point, Ring, StartSpec
from robocov.errors import MapError
from robocov.mapfile.models import MAX_LABEL_CHARACTERS, MIN_SIZE_M
from robocov_app.editor.model import require
from robocov_app.editor.model.geometry import (
    build_rectangle,
    drop_repeated_points,
    require_size,
    round_length,
    round_map_point,
    round_point,
    round_ring,
)
from robocov_app.editor.model.hit_test import find_obstacles
from robocov_app.editor.model.selection import Change, Selection, replace_obstacles
from robocov_app.editor.model.sketch import Sketch

MIN_DRAWN_LENGTH_M = 0.02  # anything smaller was drawn by accident
MAX_TEXT_CHARACTERS = 10_000


def add_obstacle(sketch: Sketch, shape: Obstacle) -> Change:
    """Add an obstacle on top of the others, and select it."""
    added, keys = sketch.with_obstacles([shape])
    return Change(added, Selection.of(*keys), f"{added.display_name(keys[0])} drawn")


def add_polygon(sketch: Sketch, points: Sequence[Point]) -> Change:
    """Add a polygon; if it intersects itself, validation will report that."""
    return add_obstacle(sketch, env.PolygonObstacle(_build_outline(points, "a polygon")))


def add_rectangle(sketch: Sketch, points: Sequence[Point]) -> Change:
    """Add a rectangle between two opposite corners, m."""
    low, high = round_ring(np.sort(np.array(points, dtype=float), axis=0))
    if min(high[0] - low[0], high[1] - low[1]) < MIN_DRAWN_LENGTH_M:
        raise MapError("a rectangle needs a width and a height: drag from corner to corner")
    change = add_obstacle(sketch, env.PolygonObstacle(build_rectangle(low, high)))
    return replace(change, description="rectangle drawn")


def add_circle(sketch: Sketch, center: Point, radius: float) -> Change:
    """Add a circle with a center and radius, m."""
    return add_obstacle(
        sketch, env.CircleObstacle(round_map_point(center), _round_radius(radius, "a circle"))
    )


def add_wall(sketch: Sketch, points: Sequence[Point], width: float) -> Change:
    """Add a wall along a line of points, with a width, m."""
    line = drop_repeated_points(round_ring(points), is_closed=False)
    if len(line) < 2 or shapely.LineString(line).length < MIN_DRAWN_LENGTH_M:
        raise MapError("a wall needs two different points")
    require_size("width", width)
    return add_obstacle(sketch, env.WallObstacle(line, round_length(width)))


def set_boundary(sketch: Sketch, points: Sequence[Point]) -> Change:
    """Set or replace the boundary, and select it."""
    description = "boundary redrawn"
    if sketch.boundary is None:
        description = "boundary drawn"
    boundary = _build_outline(points, "a boundary")
    return Change(replace(sketch, boundary=boundary), Selection(boundary=True), description)


def add_disc_start(sketch: Sketch, center: Point, radius: float) -> Change:
    """Add a disc-shaped start with a center and radius, m."""
    return _add_start(sketch, env.DiscStart(round_map_point(center), _round_radius(radius, "a start")))


def add_points_start(sketch: Sketch, points: Sequence[Point]) -> Change:
    """Add a start with one position for each robot, m; repeated positions are dropped."""
    positions = tuple(dict.fromkeys(round_ring(points)))
    require(positions, "a start needs at least one position")
    return _add_start(sketch, env.PointsStart(positions))


def add_uniform_start(sketch: Sketch) -> Change:
    """Add a start with random positions in the free space."""
    return _add_start(sketch, env.UniformStart())


def _add_start(sketch: Sketch, start: StartSpec) -> Change:
    name = find_free_name(sketch, "start")
    return Change(sketch.with_objects({name: start}), Selection.of(name), f"start “{name}” added")


def add_objects(
    sketch: Sketch, shapes: Iterable[tuple[Obstacle, str]], starts: Iterable[tuple[str, StartSpec]]
) -> tuple[Sketch, Selection]:
    """Add obstacles and starts.

    Parameters
    ----------
    sketch : Sketch
        The map.
    shapes : iterable of Obstacle and str
        Obstacles with their notes.
    starts : iterable of str and StartSpec
        Names and starts; a number is added to names that are taken.

    Returns
    -------
    sketch : Sketch
        The map with the added objects.
    selection : Selection
        The added objects.
    """
    added, keys = sketch.with_annotated_obstacles(shapes)
    names = []
    for name, start in starts:
        free_name = find_free_name(added, name or "start")
        added = added.with_objects({free_name: start})
        names.append(free_name)
    return added, Selection.of(*keys, *names)


def find_free_name(sketch: Sketch, name: str) -> str:
    """Return a name that no start has: the given name, or the name with a number, such as "start 2"."""
    taken = dict(sketch.starts)
    if name not in taken:
        return name
    stem = re.sub(r" \d+$", "", name)
    return next(numbered for k in count(2) if (numbered := f"{stem} {k}") not in taken)


def clean_label(name: str) -> str:
    """Return a name with each run of blanks replaced by one; raise MapError if the name is invalid."""
    name = clean_text(" ".join(name.split()), "a name", MAX_LABEL_CHARACTERS)
    is_printable = all(ord(char) >= 32 and ord(char) != 127 for char in name)
    require(is_printable, "a name is text on one line")
    return name


def clean_text(text: str, label: str, maximum: int = MAX_TEXT_CHARACTERS) -> str:
    """Return a text without leading and trailing blanks; raise MapError if it is too long.

    Parameters
    ----------
    text : str
        The text. Surrogates are dropped, because they cannot be written to files.
    label : str
        Name of the text for the error message.
    maximum : int
        Maximum number of characters.
    """
    text = text.encode("utf-8", "ignore").decode("utf-8")
    require(len(text) <= maximum, f"{label} has at most {maximum} characters")
    return text.strip()


def _build_outline(points: Sequence[Point], label: str) -> Ring:
    ring = drop_repeated_points(round_ring(points))
    if len(ring) < 3 or shapely.MultiPoint(ring).convex_hull.area < MIN_DRAWN_LENGTH_M**2:
        raise MapError(f"{label} needs three corners that enclose an area")
    return ring


def _round_radius(radius: float, label: str) -> float:
    """Round a radius to tenths of a millimeter; raise MapError if it is out of range."""
    require(radius >= MIN_DRAWN_LENGTH_M, f"{label} needs a radius: drag from its center to its rim")
    require_size("radius", radius, MIN_DRAWN_LENGTH_M)
    return round_length(radius)


def find_wall(sketch: Sketch, point: Point, reach: float) -> int | None:
    """Return the key of a wall within `reach` meters of a point; None without one."""
    for key in find_obstacles(sketch, point, reach):
        if isinstance(sketch.get_item(key).shape, env.WallObstacle):
            return key
    return None


def compute_door_ends(sketch: Sketch, key: int, point: Point, width: float) -> tuple[Point, Point]:
    """Compute both ends of a door in a wall, m.

    Parameters
    ----------
    sketch : Sketch
        The map.
    key : int
        Key of the wall.
    point : Point
        Desired position of the door, m. Its center is as close to this point as the wall allows.
    width : float
        Width of the door, m; limited by the length of the wall.
    """
    line = _build_wall_line(sketch, key)
    start, end = _compute_door_span(line, point, min(width, line.length))
    return _interpolate(line, start), _interpolate(line, end)


def project_on_wall(sketch: Sketch, key: int, point: Point) -> Point:
    """Return the point on the center line of a wall that is nearest to a given point, m."""
    line = _build_wall_line(sketch, key)
    return _interpolate(line, line.project(shapely.Point(point)))


def require_door_width(width: float) -> None:
    """Raise MapError if the width of a door, m, is out of range."""
    require_size("door width", width, MIN_DRAWN_LENGTH_M)


def open_door(sketch: Sketch, key: int, point: Point, width: float) -> Change:
    """Cut a door with a width, m, into a wall near a point."""
    line = _build_wall_line(sketch, key)
    require_door_width(width)
    if width > line.length - MIN_SIZE_M:
        raise MapError(f"the {sketch.display_name(key)} is not longer than a door of {width:g} m")
    start, end = _compute_door_span(line, point, width)
    return _open_wall_between(sketch, key, start, end)


def open_wall(sketch: Sketch, key: int, a: Point, b: Point) -> Change:
    """Cut an opening into a wall between two points, m, which are projected on its center line."""
    line = _build_wall_line(sketch, key)
    start, end = sorted(line.project(shapely.Point(point)) for point in (a, b))
    require_door_width(end - start)
    return _open_wall_between(sketch, key, start, end)


def _open_wall_between(sketch: Sketch, key: int, start: float, end: float) -> Change:
    """Cut a door into a wall, from `start` to `end`, m along the wall; the pieces keep its name and note."""
    line = _build_wall_line(sketch, key)
    wall = sketch.get_item(key).shape
    assert isinstance(wall, env.WallObstacle)
    pieces = []
    for low, high in ((0.0, start), (end, line.length)):
        if high - low >= MIN_SIZE_M:
            points = tuple(map(round_point, substring(line, low, high).coords))
            pieces.append(replace(wall, points=points))
    name = sketch.display_name(key)
    require(pieces, f"nothing would be left of the {name}")
    return replace_obstacles(sketch, {key: pieces}, f"{end - start:.3g} m door added to the {name}")


def _build_wall_line(sketch: Sketch, key: int) -> shapely.LineString:
    wall = sketch.get_item(key).shape
    if not isinstance(wall, env.WallObstacle) or len(set(wall.points)) < 2:
        raise MapError("doors are opened in walls")
    return shapely.LineString(wall.points)


def _compute_door_span(line: shapely.LineString, point: Point, width: float) -> tuple[float, float]:
    """Return the distances along a line, m, at which a door near a point starts and ends."""
    nearest = line.project(shapely.Point(point))
    center = min(max(nearest, width / 2), line.length - width / 2)
    return center - width / 2, center + width / 2


def _interpolate(line: shapely.LineString, length: float) -> Point:
    ((x, y),) = line.interpolate(length).coords
    return x, y
