"""Edits of the paths along which obstacles move: way points, speed, and what happens at the end."""

from dataclasses import replace

import numpy as np
import shapely

from robocov.environment import ObstaclePath, Point, Repeat
from robocov.errors import MapError
from robocov.mapfile.models import FASTEST, SLOWEST, SMALLEST
from robocov_app.editor.model.geometry import nearest_on, point_near
from robocov_app.editor.model.selection import Change, Selection, display_name
from robocov_app.editor.model.sketch import Item, Sketch

FIRST_SPEED = 0.5  # metres a second of a new path, until another speed is typed


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
    """Add a way point, last or before `at`; the first makes a path from the middle, `speed` in m/s."""
    path = path_of(sketch, key)
    if path is None:
        ends = _middle_of(sketch.item(key)), point_near(point)
        return _put(sketch, key, ObstaclePath(ends, _speed(speed), "back-and-forth"), "moves")
    where = len(path.points) if at is None else at
    points = (*path.points[:where], point_near(point), *path.points[where:])
    return _put(sketch, key, replace(path, points=points), "way point added")


def way_point_moved(sketch: Sketch, key: int, number: int, point: Point) -> Change:
    """Move a way point. With the first one, the obstacle keeps its place at time zero."""
    path = _path(sketch, key, number)
    points = (*path.points[:number], point_near(point), *path.points[number + 1 :])
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
    return _with_paths(sketch, selection, dict.fromkeys(_moving_of(sketch, selection)), "path taken away")


def path_turned(sketch: Sketch, selection: Selection) -> Change:
    """Let the selected obstacles come back the way they went, or if they do that go in a loop."""
    paths = _moving_of(sketch, selection)
    both_ways = all(path.repeat == "back-and-forth" for path in paths.values())
    repeat: Repeat = "loop" if both_ways else "back-and-forth"
    turned = {key: replace(path, repeat=repeat) for key, path in paths.items()}
    return _with_paths(sketch, selection, turned, "goes in a loop" if both_ways else "goes back and forth")


def path_paced(sketch: Sketch, selection: Selection, speed: float) -> Change:
    """Let the selected obstacles move at another speed, m/s."""
    paths, speed = _moving_of(sketch, selection), _speed(speed)
    paced = {key: replace(path, speed=speed) for key, path in paths.items()}
    return _with_paths(sketch, selection, paced, f"{speed:g} m/s")


def speed_of(text: str) -> float:
    """Return a typed speed, m/s."""
    try:
        return _speed(float(text.strip().removesuffix("m/s")))
    except ValueError:
        raise MapError(f"“{text}”, but a speed in m/s was wanted, as in 0.5") from None


def way_point_at(path: ObstaclePath, point: Point, reach: float) -> int | None:
    """Return the way point within `reach` metres of a point: the nearest."""
    if not path.points:
        return None
    away = np.hypot(*(np.array(path.points) - point).T)
    nearest = int(away.argmin())
    return nearest if away[nearest] <= reach else None


def leg_at(path: ObstaclePath, point: Point, reach: float) -> int | None:
    """Return before which way point one at a point goes, if that is on the line within `reach` metres."""
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


def _middle_of(item: Item) -> Point:
    if item.geometry.is_empty:
        raise MapError("what covers nothing cannot move")
    low_x, low_y, high_x, high_y = item.geometry.bounds
    return point_near(((low_x + high_x) / 2.0, (low_y + high_y) / 2.0))


def _moving_of(sketch: Sketch, selection: Selection) -> dict[int, ObstaclePath]:
    paths = {key: path_of(sketch, key) for key in moving(sketch) if key in selection.items}
    if not paths:
        raise MapError("select an obstacle that moves first; the tool Path gives one a path")
    return {key: path for key, path in paths.items() if path is not None}


def _with_paths(
    sketch: Sketch, selection: Selection, paths: dict[int, ObstaclePath] | dict[int, None], words: str
) -> Change:
    shapes = {key: replace(sketch.item(key).shape, path=path) for key, path in paths.items()}
    return Change(sketch.with_shapes(shapes), selection, f"{Selection.of(*paths).words(sketch)}: {words}")


def _speed(speed: float) -> float:
    if not SLOWEST <= speed <= FASTEST:
        raise MapError(f"speed: {speed:g} m/s, but {SLOWEST:g} to {FASTEST:g} m/s was wanted")
    return float(f"{speed:.6g}")


def _put(sketch: Sketch, key: int, path: ObstaclePath, words: str) -> Change:
    extent = np.ptp(np.array(path.points), axis=0).max()
    if extent < SMALLEST or shapely.LineString(path.points).length < SMALLEST:
        raise MapError("the way points lie in one place: click somewhere else")
    after = sketch.with_shapes({key: replace(sketch.item(key).shape, path=path)})
    return Change(after, Selection.of(key), f"{display_name(sketch, key)}: {words}")
