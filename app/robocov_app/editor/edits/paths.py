"""Edits of the paths along which obstacles move: way points, speed, and what happens at the end."""

from collections.abc import Callable
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from robocov.arrays import Array
from robocov.environment import ObstaclePath, Point, Repeat
from robocov.errors import MapError
from robocov.mapfile.models import MAX_SPEED_M_S, MIN_SIZE_M, MIN_SPEED_M_S
from robocov_app.editor.model import require
from robocov_app.editor.model.geometry import check_point, compute_centre, find_nearest_on_edges, to_array
from robocov_app.editor.model.selection import Change, Selection
from robocov_app.editor.model.sketch import Sketch

_Change: TypeAlias = Callable[[ObstaclePath], ObstaclePath | None]
DEFAULT_SPEED_M_S = 0.5  # metres a second of a new path, until another speed is typed


def list_moving_obstacles(sketch: Sketch) -> tuple[int, ...]:
    return tuple(item.key for item in sketch.obstacles if item.shape.path is not None)


def leads_somewhere(path: ObstaclePath) -> bool:
    """Return whether a path leads anywhere; that of a draft may not."""
    return len(set(path.points)) > 1 and path.speed > 0.0


def add_waypoint(
    sketch: Sketch, key: int, point: Point, at: int | None = None, speed: float = DEFAULT_SPEED_M_S
) -> Change:
    """Add a way point, last or before `at`; the first makes a path from the middle, `speed` in m/s."""
    path = sketch.get_item(key).shape.path
    if path is None:
        geometry = sketch.get_item(key).geometry
        require(not geometry.is_empty, "what covers nothing cannot move")
        ends = check_point(compute_centre(geometry.bounds)), check_point(point)
        return _put(sketch, key, ObstaclePath(ends, _speed(speed), "back-and-forth"), "moves")
    where = len(path.points) if at is None else at
    points = (*path.points[:where], check_point(point), *path.points[where:])
    return _put(sketch, key, replace(path, points=points), "way point added")


def move_waypoint(sketch: Sketch, key: int, number: int, point: Point) -> Change:
    """Move a way point. With the first one, the obstacle keeps its place at time zero."""
    path = _path(sketch, key, number)
    points = (*path.points[:number], check_point(point), *path.points[number + 1 :])
    return _put(sketch, key, replace(path, points=points), "way point moved")


def remove_waypoint(sketch: Sketch, key: int, number: int) -> Change:
    """Take a way point away; of two, the path goes."""
    path = _path(sketch, key, number)
    if len(path.points) <= 2:
        return remove_path(sketch, Selection.of(key))
    points = path.points[:number] + path.points[number + 1 :]
    return _put(sketch, key, replace(path, points=points), "way point taken away")


def remove_path(sketch: Sketch, selection: Selection) -> Change:
    return _with_paths(sketch, selection, lambda path: None, "path taken away")


def toggle_repeat(sketch: Sketch, selection: Selection) -> Change:
    """Let the selected obstacles come back the way they went, or if they do that go in a loop."""
    paths = [item.shape.path for item in selection.list_items(sketch)]
    back = any(path is not None and path.repeat == "loop" for path in paths)
    repeat: Repeat = "back-and-forth" if back else "loop"
    words = "goes back and forth" if back else "goes in a loop"
    return _with_paths(sketch, selection, lambda path: replace(path, repeat=repeat), words)


def set_speed(sketch: Sketch, selection: Selection, speed: float) -> Change:
    speed = _speed(speed)
    return _with_paths(sketch, selection, lambda path: replace(path, speed=speed), f"{speed:g} m/s")


def parse_speed(text: str) -> float:
    try:
        return _speed(float(text.strip().removesuffix("m/s")))
    except ValueError:
        raise MapError(f"expected a speed in m/s, such as 0.5, got “{text}”") from None


def find_waypoint(path: ObstaclePath, point: Point, reach: float) -> int | None:
    points = to_array(path.points)
    return _nearest(find_nearest_on_edges(points, points, point)[1], reach)


def find_leg(path: ObstaclePath, point: Point, reach: float) -> int | None:
    """Return before which way point one at a point goes, if that is on the line within `reach` metres."""
    points = to_array([*path.points, *path.points[:1]] if path.repeat == "loop" else path.points)
    leg = _nearest(find_nearest_on_edges(points[:-1], points[1:], point)[1], reach)
    return None if leg is None else leg + 1


def _nearest(away: Array, reach: float) -> int | None:
    nearest = int(away.argmin()) if len(away) else None
    return None if nearest is None or away[nearest] > reach else nearest


def describe_path(path: ObstaclePath | None) -> str:
    """Return a path in a few words: "0.5 m/s, loop of 6 m in 12 s"."""
    if path is None:
        return "stands"
    if not leads_somewhere(path):
        return "leads nowhere"
    kind = "loop" if path.repeat == "loop" else "there and back"
    return f"{path.speed:g} m/s, {kind} of {path.speed * path.period:.4g} m in {path.period:.4g} s"


def _path(sketch: Sketch, key: int, number: int) -> ObstaclePath:
    path = sketch.get_item(key).shape.path
    if path is None or not 0 <= number < len(path.points):
        raise MapError("there is no such way point any more")
    return path


def _with_paths(sketch: Sketch, selection: Selection, change: _Change, words: str) -> Change:
    shapes = {item.key: item.shape for item in selection.list_items(sketch) if item.shape.path is not None}
    require(shapes, "select an obstacle that moves first; the tool Path gives one a path")
    after = sketch.with_objects({k: replace(s, path=s.path and change(s.path)) for k, s in shapes.items()})
    return Change(after, selection, f"{Selection.of(*shapes).describe(sketch)}: {words}")


def _put(sketch: Sketch, key: int, path: ObstaclePath, words: str) -> Change:
    extent = np.ptp(path.points, axis=0).max()
    require(extent >= MIN_SIZE_M, "the way points lie in one place: click somewhere else")
    after = sketch.with_objects({key: replace(sketch.get_item(key).shape, path=path)})
    return Change(after, Selection.of(key), f"{sketch.display_name(key)}: {words}")


def _speed(speed: float) -> float:
    if not MIN_SPEED_M_S <= speed <= MAX_SPEED_M_S:
        raise MapError(f"speed: expected {MIN_SPEED_M_S:g} to {MAX_SPEED_M_S:g} m/s, got {speed:g} m/s")
    return float(f"{speed:.6g}")
