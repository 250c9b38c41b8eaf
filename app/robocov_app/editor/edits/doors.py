"""Doors: openings in walls, which stay walls."""

from dataclasses import replace

import shapely
from shapely import LineString
from shapely.ops import substring

from robocov.environment import Point, WallObstacle
from robocov.errors import MapError
from robocov.mapfile.models import LARGEST, SMALLEST
from robocov_app.editor.edits.create import SHORTEST
from robocov_app.editor.model.geometry import rounded
from robocov_app.editor.model.hit_test import obstacles_at
from robocov_app.editor.model.selection import Change, display_name, replace_obstacles
from robocov_app.editor.model.sketch import Sketch


def wall_at(sketch: Sketch, point: Point, reach: float) -> int | None:
    """Return the wall within `reach` metres of a point, the topmost."""
    keys = obstacles_at(sketch, point, reach)
    return next((key for key in keys if isinstance(sketch.item(key).shape, WallObstacle)), None)


def door_at(sketch: Sketch, key: int, point: Point, width: float) -> tuple[Point, Point]:
    """Return both sides of a door whose middle is as near to a point as the wall allows."""
    line = _line(sketch, key)
    a, b = map(line.interpolate, _span(line, point, min(width, line.length)))
    return (float(a.x), float(a.y)), (float(b.x), float(b.y))


def on_wall(sketch: Sketch, key: int, point: Point) -> Point:
    """Return the place on a wall's line that is nearest to a point."""
    line = _line(sketch, key)
    place = line.interpolate(line.project(shapely.Point(point)))
    return float(place.x), float(place.y)


def door_width(width: float) -> float:
    """Return the width of a door, m; MapError where it is none."""
    if not SHORTEST <= width <= LARGEST:
        raise MapError(f"a door's width is at least {100 * SHORTEST:g} cm")
    return width


def door_opened(sketch: Sketch, key: int, point: Point, width: float) -> Change:
    """Open a door of a width, m, its middle as near to a point as the wall allows."""
    line = _line(sketch, key)
    if door_width(width) > line.length - SMALLEST:
        raise MapError(f"the {display_name(sketch, key)} is not longer than a door of {width:g} m")
    return _opened(sketch, key, *_span(line, point, width))


def wall_opened(sketch: Sketch, key: int, a: Point, b: Point) -> Change:
    """Open a wall between the places on it that are nearest to two points."""
    line = _line(sketch, key)
    begin, end = sorted(line.project(shapely.Point(place)) for place in (a, b))
    door_width(end - begin)
    return _opened(sketch, key, begin, end)


def _span(line: LineString, point: Point, width: float) -> tuple[float, float]:
    middle = min(max(line.project(shapely.Point(point)), width / 2), line.length - width / 2)
    return middle - width / 2, middle + width / 2


def _opened(sketch: Sketch, key: int, begin: float, end: float) -> Change:
    """Take what lies between two lengths along a wall away; the pieces keep its name and note."""
    line, wall = _line(sketch, key), sketch.item(key).shape
    assert isinstance(wall, WallObstacle)
    pieces = []
    for low, high in ((0.0, begin), (end, line.length)):
        if high - low >= SMALLEST:
            points = tuple(map(rounded, substring(line, low, high).coords))
            pieces.append(replace(wall, points=points))
    if not pieces:
        raise MapError(f"nothing would be left of the {display_name(sketch, key)}")
    words = f"door of {end - begin:.3g} m opened in {display_name(sketch, key)}"
    return replace_obstacles(sketch, {key: pieces}, words)


def _line(sketch: Sketch, key: int) -> LineString:
    wall = sketch.item(key).shape
    if not isinstance(wall, WallObstacle) or len(set(wall.points)) < 2:
        raise MapError("doors are opened in walls")
    return LineString(wall.points)
