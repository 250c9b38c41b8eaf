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
from robocov_app.editor.model.geometry import distinct, point_near, rectangle, ring_near, rounded, tenths
from robocov_app.editor.model.hit_test import obstacles_at
from robocov_app.editor.model.selection import Change, Selection, replace_obstacles
from robocov_app.editor.model.sketch import Sketch

SHORTEST = 0.02  # metres below which what is drawn is taken for a slip of the hand


def drawn(sketch: Sketch, shape: Obstacle) -> Change:
    after, keys = sketch.added([shape])
    return Change(after, Selection.of(*keys), f"{after.display_name(keys[0])} drawn")


def polygon_drawn(sketch: Sketch, points: Sequence[Point]) -> Change:
    """Put a polygon down; it may cross itself, which `validation` will say."""
    return drawn(sketch, env.PolygonObstacle(_outline(points, "a polygon")))


def rectangle_drawn(sketch: Sketch, points: Sequence[Point]) -> Change:
    low, high = ring_near(np.sort(np.array(points, dtype=float), axis=0))  # of two opposite corners
    if min(high[0] - low[0], high[1] - low[1]) < SHORTEST:
        raise MapError("a rectangle needs a width and a height: drag from corner to corner")
    return replace(drawn(sketch, env.PolygonObstacle(rectangle(low, high))), words="rectangle drawn")


def circle_drawn(sketch: Sketch, center: Point, radius: float) -> Change:
    return drawn(sketch, env.CircleObstacle(point_near(center), _radius(radius, "a circle")))


def wall_drawn(sketch: Sketch, points: Sequence[Point], width: float) -> Change:
    line = distinct(ring_near(points), closed=False)
    if len(line) < 2 or shapely.LineString(line).length < SHORTEST:
        raise MapError("a wall needs two points that are apart")
    require(MIN_SIZE_M <= width <= MAX_SIZE_M, f"a wall's width is at least {1000 * MIN_SIZE_M:g} mm")
    return drawn(sketch, env.WallObstacle(line, tenths(width)))


def boundary_drawn(sketch: Sketch, points: Sequence[Point]) -> Change:
    words = "boundary drawn" if sketch.boundary is None else "boundary drawn anew"
    return Change(replace(sketch, boundary=_outline(points, "a boundary")), Selection(boundary=True), words)


def disc_start_drawn(sketch: Sketch, center: Point, radius: float) -> Change:
    return _start_added(sketch, env.DiscStart(point_near(center), _radius(radius, "a start")))


def points_start_drawn(sketch: Sketch, points: Sequence[Point]) -> Change:
    places = require(tuple(dict.fromkeys(ring_near(points))), "a start needs a place for a robot at least")
    return _start_added(sketch, env.PointsStart(places))


def _start_added(sketch: Sketch, spec: StartSpec) -> Change:
    name = free_name(sketch, "start")
    return Change(sketch.with_things({name: spec}), Selection.of(name), f"start “{name}” added")


anywhere_added = partial(_start_added, spec=env.UniformStart())


def added(
    sketch: Sketch, shapes: Iterable[tuple[Obstacle, str]], starts: Iterable[tuple[str, StartSpec]]
) -> tuple[Sketch, Selection]:
    """Return the sketch with more obstacles, with notes, and starts, under free names; and what they are."""
    after, keys = sketch.added(shapes)
    names = []
    for name, spec in starts:
        names.append(free_name(after, name or "start"))
        after = after.with_things({names[-1]: spec})
    return after, Selection.of(*keys, *names)


def free_name(sketch: Sketch, name: str) -> str:
    """Return a name for a start that no start has yet: this one, or with a number after it: "start 2"."""
    stem = re.sub(r" \d+$", "", name)
    names = chain([name], (f"{stem} {k}" for k in count(2)))
    return next(each for each in names if each not in dict(sketch.starts))


def label_of(name: str) -> str:
    name = text_of(" ".join(name.split()), "a name", MAX_LABEL_CHARACTERS)
    require(all(ord(char) >= 32 and ord(char) != 127 for char in name), "a name is text on one line")
    return name


def text_of(text: str, what: str, most: int = 10_000) -> str:
    """Return text as maps can have it: without halves of characters, which no file could hold."""
    text = text.encode("utf-8", "ignore").decode("utf-8")
    require(len(text) <= most, f"{what} has at most {most} characters")
    return text.strip()


def _outline(points: Sequence[Point], what: str) -> Ring:
    ring = distinct(ring_near(points))
    if len(ring) < 3 or shapely.MultiPoint(ring).convex_hull.area < SHORTEST**2:
        raise MapError(f"{what} needs three corners that enclose something")
    return ring


def _radius(radius: float, what: str) -> float:
    require(SHORTEST <= radius <= MAX_SIZE_M, f"{what} needs a radius: drag from its middle to its rim")
    return tenths(radius)


def wall_at(sketch: Sketch, point: Point, reach: float) -> int | None:
    keys = obstacles_at(sketch, point, reach)
    return next((key for key in keys if isinstance(sketch.item(key).shape, env.WallObstacle)), None)


def door_at(sketch: Sketch, key: int, point: Point, width: float) -> tuple[Point, Point]:
    """Return both sides of a door whose middle is as near to a point as the wall allows."""
    line = _line(sketch, key)
    a, b = _span(line, point, min(width, line.length))
    return _along(line, a), _along(line, b)


def on_wall(sketch: Sketch, key: int, point: Point) -> Point:
    line = _line(sketch, key)
    return _along(line, line.project(shapely.Point(point)))


def door_width(width: float) -> float:
    require(SHORTEST <= width <= MAX_SIZE_M, f"a door's width is at least {100 * SHORTEST:g} cm")
    return width


def door_opened(sketch: Sketch, key: int, point: Point, width: float) -> Change:
    line = _line(sketch, key)
    if door_width(width) > line.length - MIN_SIZE_M:
        raise MapError(f"the {sketch.display_name(key)} is not longer than a door of {width:g} m")
    return _opened(sketch, key, *_span(line, point, width))


def wall_opened(sketch: Sketch, key: int, a: Point, b: Point) -> Change:
    """Open a wall between the places on it that are nearest to two points."""
    begin, end = sorted(_line(sketch, key).project(shapely.Point(place)) for place in (a, b))
    door_width(end - begin)
    return _opened(sketch, key, begin, end)


def _opened(sketch: Sketch, key: int, begin: float, end: float) -> Change:
    """Take what lies between two lengths along a wall away; the pieces keep its name and note."""
    line, wall = _line(sketch, key), sketch.item(key).shape
    assert isinstance(wall, env.WallObstacle)
    left = [(low, high) for low, high in ((0.0, begin), (end, line.length)) if high - low >= MIN_SIZE_M]
    pieces = [replace(wall, points=tuple(map(rounded, substring(line, *part).coords))) for part in left]
    require(pieces, f"nothing would be left of the {sketch.display_name(key)}")
    words = f"door of {end - begin:.3g} m opened in {sketch.display_name(key)}"
    return replace_obstacles(sketch, {key: pieces}, words)


def _line(sketch: Sketch, key: int) -> shapely.LineString:
    wall = sketch.item(key).shape
    if not isinstance(wall, env.WallObstacle) or len(set(wall.points)) < 2:
        raise MapError("doors are opened in walls")
    return shapely.LineString(wall.points)


def _span(line: shapely.LineString, point: Point, width: float) -> tuple[float, float]:
    middle = min(max(line.project(shapely.Point(point)), width / 2), line.length - width / 2)
    return middle - width / 2, middle + width / 2


def _along(line: shapely.LineString, length: float) -> Point:
    ((x, y),) = line.interpolate(length).coords
    return x, y
