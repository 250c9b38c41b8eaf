"""Edits of the paths along which obstacles move: way points, speed, and what happens at the end."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import shapely

from robocov.environment import Obstacle, ObstaclePath, Point, Repeat
from robocov.errors import MapError
from robocov.mapfile.models import FASTEST, SLOWEST, SMALLEST
from robocov_app.editor.model.geometry import nearest_on, ring_near
from robocov_app.editor.model.selection import Change, Selection, display_name
from robocov_app.editor.model.sketch import Item, Sketch

FIRST_SPEED = 0.5
"""Metres a second of a new path, until another speed is typed."""


def path_of(sketch: Sketch, key: int) -> ObstaclePath | None:
    """Return the path of an obstacle; None where it stands."""
    return sketch.item(key).shape.path


def moving(sketch: Sketch) -> tuple[int, ...]:
    """Return the obstacles that move, in their order."""
    return tuple(item.key for item in sketch.obstacles if item.shape.path is not None)


def goes(path: ObstaclePath) -> bool:
    """Return whether a path leads anywhere; that of a draft may not."""
    return len(set(path.points)) > 1 and path.speed > 0.0


def way_point_added(
    sketch: Sketch, key: int, point: Point, at: int | None = None, speed: float = FIRST_SPEED
) -> Change:
    """Add a way point; the first one makes a path from the obstacle's middle to there.

    Parameters
    ----------
    sketch : Sketch
    key : int
        Of the obstacle.
    point : (x, y), m
    at : int or None
        Before which way point; None adds it as the last.
    speed : float, m/s
        Of a new path.
    """
    path = path_of(sketch, key)
    if path is None:
        begin = middle_of(sketch.item(key))
        path = ObstaclePath((begin, _place(point)), _speed(speed), "back-and-forth")
        return _put(sketch, key, path, "moves")
    where = len(path.points) if at is None else at
    points = (*path.points[:where], _place(point), *path.points[where:])
    return _put(sketch, key, replace(path, points=points), "way point added")


def way_point_moved(sketch: Sketch, key: int, number: int, point: Point) -> Change:
    """Move a way point. With the first one, the obstacle keeps its place at time zero."""
    path = _path(sketch, key, number)
    points = (*path.points[:number], _place(point), *path.points[number + 1 :])
    return _put(sketch, key, replace(path, points=points), "way point moved")


def way_point_removed(sketch: Sketch, key: int, number: int) -> Change:
    """Take a way point away; of two, the path goes."""
    path = _path(sketch, key, number)
    if len(path.points) <= 2:
        return path_removed(sketch, Selection.of(key))
    points = path.points[:number] + path.points[number + 1 :]
    return _put(sketch, key, replace(path, points=points), "way point taken away")


def path_removed(sketch: Sketch, selection: Selection) -> Change:
    """Let the selected obstacles stand."""
    chosen = _moving_of(sketch, selection)
    shapes = {key: replace(sketch.item(key).shape, path=None) for key in chosen}
    words = f"{Selection.of(*chosen).words(sketch)}: path taken away"
    return Change(sketch.with_shapes(shapes), selection, words)


def path_turned(sketch: Sketch, selection: Selection) -> Change:
    """Let the selected obstacles come back the way they went, or if they do that go in a loop."""
    chosen = _moving_of(sketch, selection)
    loops = all(_repeat(sketch, key) == "back-and-forth" for key in chosen)
    repeat: Repeat = "loop" if loops else "back-and-forth"
    shapes = {key: _with_path(sketch, key, repeat=repeat) for key in chosen}
    words = "goes in a loop" if loops else "goes back and forth"
    return Change(sketch.with_shapes(shapes), selection, f"{Selection.of(*chosen).words(sketch)}: {words}")


def path_paced(sketch: Sketch, selection: Selection, speed: float) -> Change:
    """Let the selected obstacles move at another speed, m/s."""
    chosen, speed = _moving_of(sketch, selection), _speed(speed)
    shapes = {key: _with_path(sketch, key, speed=speed) for key in chosen}
    words = f"{Selection.of(*chosen).words(sketch)}: {speed:g} m/s"
    return Change(sketch.with_shapes(shapes), selection, words)


def speed_of(text: str) -> float:
    """Return a typed speed, m/s."""
    try:
        return _speed(float(text.strip().removesuffix("m/s")))
    except ValueError:
        raise MapError(f"“{text}”, but a speed in m/s was wanted, as in 0.5") from None


def middle_of(item: Item) -> Point:
    """Return the middle of an obstacle's bounding box, m."""
    if item.geometry.is_empty:
        raise MapError("what covers nothing cannot move")
    low_x, low_y, high_x, high_y = item.geometry.bounds
    return _place(((low_x + high_x) / 2.0, (low_y + high_y) / 2.0))


def way_point_at(path: ObstaclePath, point: Point, reach: float) -> int | None:
    """Return the way point within `reach` metres of a point: the nearest."""
    if not path.points:
        return None
    away = np.hypot(*(np.array(path.points) - point).T)
    nearest = int(away.argmin())
    return nearest if away[nearest] <= reach else None


def leg_at(path: ObstaclePath, point: Point, reach: float) -> int | None:
    """Return before which way point one at a point goes, if that is on the line within `reach` metres.

    The leg that closes a loop ends behind the last way point.
    """
    if len(path.points) < 2:
        return None
    points = np.array(path.points)
    closed = np.concatenate([points, points[:1]]) if path.repeat == "loop" else points
    nearest = nearest_on(closed[:-1], closed[1:], np.array(point, dtype=float))
    away = np.hypot(*(nearest - point).T)
    leg = int(away.argmin())
    return leg + 1 if away[leg] <= reach else None


def path_words(path: ObstaclePath | None) -> str:
    """Return a path in a few words.

    >>> path_words(ObstaclePath(((0.0, 0.0), (3.0, 0.0)), 0.5))
    '0.5 m/s, loop of 6 m in 12 s'
    """
    if path is None:
        return "stands"
    if not goes(path):
        return "leads nowhere"
    kind = "loop" if path.repeat == "loop" else "there and back"
    return f"{path.speed:g} m/s, {kind} of {path.speed * path.period:.4g} m in {path.period:.4g} s"


def _path(sketch: Sketch, key: int, number: int) -> ObstaclePath:
    path = path_of(sketch, key)
    if path is None or not 0 <= number < len(path.points):
        raise MapError("there is no such way point any more")
    return path


def _repeat(sketch: Sketch, key: int) -> str | None:
    path = path_of(sketch, key)
    return None if path is None else path.repeat


def _moving_of(sketch: Sketch, selection: Selection) -> list[int]:
    chosen = [key for key in moving(sketch) if key in selection.items]
    if not chosen:
        raise MapError("select an obstacle that moves first; the tool Path gives one a path")
    return chosen


def _with_path(
    sketch: Sketch, key: int, *, speed: float | None = None, repeat: Repeat | None = None
) -> Obstacle:
    shape = sketch.item(key).shape
    assert shape.path is not None
    speed, repeat = speed or shape.path.speed, repeat or shape.path.repeat
    return replace(shape, path=replace(shape.path, speed=speed, repeat=repeat))


def _speed(speed: float) -> float:
    if not SLOWEST <= speed <= FASTEST:
        raise MapError(f"speed: {speed:g} m/s, but {SLOWEST:g} to {FASTEST:g} m/s was wanted")
    return float(f"{speed:.6g}")


def _place(point: Point) -> Point:
    (place,) = ring_near(np.array([point], dtype=float))
    return place


def _put(sketch: Sketch, key: int, path: ObstaclePath, words: str) -> Change:
    extent = np.ptp(np.array(path.points), axis=0).max()
    if extent < SMALLEST or shapely.LineString(path.points).length < SMALLEST:
        raise MapError("the way points lie in one place: click somewhere else")
    shape = replace(sketch.item(key).shape, path=path)
    return Change(
        sketch.with_shapes({key: shape}), Selection.of(key), f"{display_name(sketch, key)}: {words}"
    )
