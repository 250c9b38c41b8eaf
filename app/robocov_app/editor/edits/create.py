"""Edits that draw: obstacles, the boundary, starts, and doors in walls, which stay walls."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain, count

import numpy as np
import shapely
from shapely.ops import substring

from robocov import environment as env
from robocov.environment import Obstacle, Point, Ring, StartSpec
from robocov.errors import MapError
from robocov.mapfile.models import MAX_LABEL_CHARACTERS, MAX_SIZE_M, MIN_SIZE_M
from robocov_app.editor.model import require
from robocov_app.editor.model.geometry import (
    build_rectangle,
    check_point,
    drop_repeated_points,
    round_length,
    round_point,
    round_ring,
)
from robocov_app.editor.model.hit_test import find_obstacles
from robocov_app.editor.model.selection import Change, Selection, replace_obstacles
from robocov_app.editor.model.sketch import Sketch

MIN_DRAWN_LENGTH_M = 0.02  # metres below which what is drawn is taken for a slip of the hand


def add_obstacle(sketch: Sketch, shape: Obstacle) -> Change:
    after, keys = sketch.with_obstacles([shape])
    return Change(after, Selection.of(*keys), f"{after.display_name(keys[0])} drawn")


def add_polygon(sketch: Sketch, points: Sequence[Point]) -> Change:
    """Put a polygon down; it may cross itself, which `validation` will say."""
    return add_obstacle(sketch, env.PolygonObstacle(_outline(points, "a polygon")))


def add_rectangle(sketch: Sketch, points: Sequence[Point]) -> Change:
    low, high = round_ring(np.sort(np.array(points, dtype=float), axis=0))  # of two opposite corners
    if min(high[0] - low[0], high[1] - low[1]) < MIN_DRAWN_LENGTH_M:
        raise MapError("a rectangle needs a width and a height: drag from corner to corner")
    return replace(
        add_obstacle(sketch, env.PolygonObstacle(build_rectangle(low, high))), description="rectangle drawn"
    )


def add_circle(sketch: Sketch, center: Point, radius: float) -> Change:
    return add_obstacle(sketch, env.CircleObstacle(check_point(center), _radius(radius, "a circle")))


def add_wall(sketch: Sketch, points: Sequence[Point], width: float) -> Change:
    line = drop_repeated_points(round_ring(points), closed=False)
    if len(line) < 2 or shapely.LineString(line).length < MIN_DRAWN_LENGTH_M:
        raise MapError("a wall needs two points that are apart")
    require(MIN_SIZE_M <= width <= MAX_SIZE_M, f"a wall's width is at least {1000 * MIN_SIZE_M:g} mm")
    return add_obstacle(sketch, env.WallObstacle(line, round_length(width)))


def set_boundary(sketch: Sketch, points: Sequence[Point]) -> Change:
    words = "boundary drawn" if sketch.boundary is None else "boundary drawn anew"
    return Change(replace(sketch, boundary=_outline(points, "a boundary")), Selection(boundary=True), words)


def add_disc_start(sketch: Sketch, center: Point, radius: float) -> Change:
    return _add_start(sketch, env.DiscStart(check_point(center), _radius(radius, "a start")))


def add_points_start(sketch: Sketch, points: Sequence[Point]) -> Change:
    places = require(tuple(dict.fromkeys(round_ring(points))), "a start needs a place for a robot at least")
    return _add_start(sketch, env.PointsStart(places))


def _add_start(sketch: Sketch, spec: StartSpec) -> Change:
    name = find_free_name(sketch, "start")
    return Change(sketch.with_objects({name: spec}), Selection.of(name), f"start “{name}” added")


add_uniform_start = partial(_add_start, spec=env.UniformStart())


def add_objects(
    sketch: Sketch, shapes: Iterable[tuple[Obstacle, str]], starts: Iterable[tuple[str, StartSpec]]
) -> tuple[Sketch, Selection]:
    """Return the sketch with more obstacles, with notes, and starts, under free names; and what they are."""
    after, keys = sketch.with_obstacles(shapes)
    names = []
    for name, spec in starts:
        names.append(find_free_name(after, name or "start"))
        after = after.with_objects({names[-1]: spec})
    return after, Selection.of(*keys, *names)


def find_free_name(sketch: Sketch, name: str) -> str:
    """Return a name for a start that no start has yet: this one, or with a number after it: "start 2"."""
    stem = re.sub(r" \d+$", "", name)
    names = chain([name], (f"{stem} {k}" for k in count(2)))
    return next(each for each in names if each not in dict(sketch.starts))


def clean_label(name: str) -> str:
    name = clean_text(" ".join(name.split()), "a name", MAX_LABEL_CHARACTERS)
    require(all(ord(char) >= 32 and ord(char) != 127 for char in name), "a name is text on one line")
    return name


def clean_text(text: str, what: str, most: int = 10_000) -> str:
    """Return text as maps can have it: without halves of characters, which no file could hold."""
    text = text.encode("utf-8", "ignore").decode("utf-8")
    require(len(text) <= most, f"{what} has at most {most} characters")
    return text.strip()


def _outline(points: Sequence[Point], what: str) -> Ring:
    ring = drop_repeated_points(round_ring(points))
    if len(ring) < 3 or shapely.MultiPoint(ring).convex_hull.area < MIN_DRAWN_LENGTH_M**2:
        raise MapError(f"{what} needs three corners that enclose something")
    return ring


def _radius(radius: float, what: str) -> float:
    require(
        MIN_DRAWN_LENGTH_M <= radius <= MAX_SIZE_M, f"{what} needs a radius: drag from its middle to its rim"
    )
    return round_length(radius)


def find_wall(sketch: Sketch, point: Point, reach: float) -> int | None:
    keys = find_obstacles(sketch, point, reach)
    return next((key for key in keys if isinstance(sketch.get_item(key).shape, env.WallObstacle)), None)


def compute_door_ends(sketch: Sketch, key: int, point: Point, width: float) -> tuple[Point, Point]:
    """Return both sides of a door whose middle is as near to a point as the wall allows."""
    line = _line(sketch, key)
    a, b = _span(line, point, min(width, line.length))
    return _along(line, a), _along(line, b)


def project_on_wall(sketch: Sketch, key: int, point: Point) -> Point:
    line = _line(sketch, key)
    return _along(line, line.project(shapely.Point(point)))


def check_door_width(width: float) -> float:
    require(
        MIN_DRAWN_LENGTH_M <= width <= MAX_SIZE_M,
        f"a door's width is at least {100 * MIN_DRAWN_LENGTH_M:g} cm",
    )
    return width


def open_door(sketch: Sketch, key: int, point: Point, width: float) -> Change:
    line = _line(sketch, key)
    if check_door_width(width) > line.length - MIN_SIZE_M:
        raise MapError(f"the {sketch.display_name(key)} is not longer than a door of {width:g} m")
    return _open_wall_between(sketch, key, *_span(line, point, width))


def open_wall(sketch: Sketch, key: int, a: Point, b: Point) -> Change:
    """Open a wall between the places on it that are nearest to two points."""
    begin, end = sorted(_line(sketch, key).project(shapely.Point(place)) for place in (a, b))
    check_door_width(end - begin)
    return _open_wall_between(sketch, key, begin, end)


def _open_wall_between(sketch: Sketch, key: int, begin: float, end: float) -> Change:
    """Take what lies between two lengths along a wall away; the pieces keep its name and note."""
    line, wall = _line(sketch, key), sketch.get_item(key).shape
    assert isinstance(wall, env.WallObstacle)
    left = [(low, high) for low, high in ((0.0, begin), (end, line.length)) if high - low >= MIN_SIZE_M]
    pieces = [replace(wall, points=tuple(map(round_point, substring(line, *part).coords))) for part in left]
    require(pieces, f"nothing would be left of the {sketch.display_name(key)}")
    words = f"door of {end - begin:.3g} m opened in {sketch.display_name(key)}"
    return replace_obstacles(sketch, {key: pieces}, words)


def _line(sketch: Sketch, key: int) -> shapely.LineString:
    wall = sketch.get_item(key).shape
    if not isinstance(wall, env.WallObstacle) or len(set(wall.points)) < 2:
        raise MapError("doors are opened in walls")
    return shapely.LineString(wall.points)


def _span(line: shapely.LineString, point: Point, width: float) -> tuple[float, float]:
    middle = min(max(line.project(shapely.Point(point)), width / 2), line.length - width / 2)
    return middle - width / 2, middle + width / 2


def _along(line: shapely.LineString, length: float) -> Point:
    ((x, y),) = line.interpolate(length).coords
    return x, y
