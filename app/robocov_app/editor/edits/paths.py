"""Edits of the paths of moving obstacles: waypoints, speed, and whether they go back or in a loop."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from robocov.environment import ObstaclePath, Point, Repeat
from robocov.errors import MapError, format_count
from robocov.mapfile.models import MAX_SPEED_M_S, MIN_SIZE_M, MIN_SPEED_M_S
from robocov.typing import FloatArray
from robocov_app.editor.model import require
from robocov_app.editor.model.geometry import compute_center, round_map_point, to_array
from robocov_app.editor.model.selection import Change, Selection
from robocov_app.editor.model.sketch import Item, Sketch
from robocov_app.toolkit.tools.geometry import find_nearest_on_edges

PathEdit: TypeAlias = Callable[[ObstaclePath], ObstaclePath | None]
DEFAULT_SPEED_M_S = 0.5


def list_moving_obstacles(sketch: Sketch) -> tuple[int, ...]:
    """Return the keys of obstacles that have a path."""
    return tuple(item.key for item in sketch.obstacles if item.shape.path is not None)


def is_moving(path: ObstaclePath) -> bool:
    """Return whether a path results in motion; in an unfinished map, it may not."""
    return len(set(path.points)) > 1 and path.speed > 0.0


def add_waypoint(
    sketch: Sketch, key: int, point: Point, index: int | None = None, speed: float = DEFAULT_SPEED_M_S
) -> Change:
    """Add a waypoint to the path of an obstacle.

    Parameters
    ----------
    sketch : Sketch
        The map.
    key : int
        Key of the obstacle. If it has no path, it gets one from its center to the point.
    point : Point
        The waypoint, m.
    index : int, optional
        Index of the new waypoint; by default, it is appended.
    speed : float
        Speed along a new path, m/s.
    """
    item = sketch.get_item(key)
    path = item.shape.path
    if path is None:
        require(not item.geometry.is_empty, "an obstacle without an area cannot move")
        ends = (round_map_point(compute_center(item.geometry.bounds)), round_map_point(point))
        return _set_path(sketch, key, ObstaclePath(ends, _round_speed(speed), "back-and-forth"), "moves")
    if index is None:
        index = len(path.points)
    points = (*path.points[:index], round_map_point(point), *path.points[index:])
    return _set_path(sketch, key, replace(path, points=points), "waypoint added")


def move_waypoint(sketch: Sketch, key: int, number: int, point: Point) -> Change:
    """Move a waypoint; moving the first one does not change the position of the obstacle at time zero."""
    path = _require_path(sketch, key, number)
    points = (*path.points[:number], round_map_point(point), *path.points[number + 1 :])
    return _set_path(sketch, key, replace(path, points=points), "waypoint moved")


def remove_waypoint(sketch: Sketch, key: int, number: int) -> Change:
    """Remove a waypoint; if only one would remain, remove the path."""
    path = _require_path(sketch, key, number)
    if len(path.points) <= 2:
        return remove_path(sketch, Selection.of(key))
    points = path.points[:number] + path.points[number + 1 :]
    return _set_path(sketch, key, replace(path, points=points), "waypoint removed")


def remove_path(sketch: Sketch, selection: Selection) -> Change:
    """Remove the paths of the selected obstacles."""
    return _edit_paths(sketch, selection, lambda path: None, "path removed")


def toggle_repeat(sketch: Sketch, selection: Selection) -> Change:
    """Toggle the selected obstacles between moving back and forth and moving in a loop."""
    shape_paths = [item.shape.path for item in selection.list_items(sketch)]
    has_loop = any(path is not None and path.repeat == "loop" for path in shape_paths)
    repeat: Repeat = "loop"
    description = "goes in a loop"
    if has_loop:
        repeat = "back-and-forth"
        description = "goes back and forth"
    return _edit_paths(sketch, selection, lambda path: replace(path, repeat=repeat), description)


def set_speed(sketch: Sketch, selection: Selection, speed: float) -> Change:
    """Set the speed of the selected obstacles, m/s."""
    speed = _round_speed(speed)
    return _edit_paths(sketch, selection, lambda path: replace(path, speed=speed), f"{speed:g} m/s")


def parse_speed(text: str) -> float:
    """Parse a speed that the user typed, m/s; raise MapError if it is invalid."""
    try:
        return _round_speed(float(text.strip().removesuffix("m/s")))
    except ValueError:
        raise MapError(f"expected a speed in m/s, such as 0.5, got “{text}”") from None


def find_waypoint(path: ObstaclePath, point: Point, reach: float) -> int | None:
    """Return the index of the nearest waypoint within `reach` meters of a point; None if there is none."""
    points = to_array(path.points)
    _, gaps = find_nearest_on_edges(points, points, point)
    return _find_nearest(gaps, reach)


def find_leg(path: ObstaclePath, point: Point, reach: float) -> int | None:
    """Return the index that a new waypoint at a point would have; None if no leg is within `reach` meters."""
    points = to_array(path.points)
    if path.repeat == "loop":
        points = to_array([*path.points, *path.points[:1]])
    _, gaps = find_nearest_on_edges(points[:-1], points[1:], point)
    leg = _find_nearest(gaps, reach)
    if leg is None:
        return None
    return leg + 1


def _find_nearest(gaps: FloatArray, reach: float) -> int | None:
    """Return the index of the smallest of (k,) distances, m; None if it exceeds `reach`."""
    if not len(gaps):
        return None
    nearest = int(gaps.argmin())
    if gaps[nearest] > reach:
        return None
    return nearest


def describe_path(path: ObstaclePath | None) -> str:
    """Describe a path in a few words, for example "0.5 m/s, loop of 6 m in 12 s"."""
    if path is None:
        return "stands still"
    if not is_moving(path):
        return "leads nowhere"
    kind = "there and back"
    if path.repeat == "loop":
        kind = "loop"
    length = path.speed * path.period
    return f"{path.speed:g} m/s, {kind} of {length:.4g} m in {path.period:.4g} s"


def describe_lost_paths(items: Sequence[Item]) -> str:
    """Return the end of a status message on obstacles that become one, with the path of the lowest.

    Parameters
    ----------
    items : sequence of Item
        The obstacles, the lowest first.

    Returns
    -------
    str
        For example ", 2 paths removed"; empty if no path differs from that of the lowest.
    """
    kept_path = items[0].shape.path
    lost_count = sum(item.shape.path not in (None, kept_path) for item in items)
    if lost_count == 0:
        return ""
    return f", {format_count(lost_count, 'path')} removed"


def _require_path(sketch: Sketch, key: int, number: int) -> ObstaclePath:
    """Return the path of an obstacle; raise MapError if it has no waypoint with the given number."""
    path = sketch.get_item(key).shape.path
    if path is None or not 0 <= number < len(path.points):
        raise MapError("this waypoint no longer exists")
    return path


def _edit_paths(sketch: Sketch, selection: Selection, edit: PathEdit, description: str) -> Change:
    shapes = {}
    for item in selection.list_items(sketch):
        if item.shape.path is not None:
            shapes[item.key] = replace(item.shape, path=edit(item.shape.path))
    require(shapes, "select an obstacle that moves first; the tool Path gives one a path")
    obstacles = Selection.of(*shapes).describe(sketch)
    return Change(sketch.with_objects(shapes), selection, f"{obstacles}: {description}")


def _set_path(sketch: Sketch, key: int, path: ObstaclePath, description: str) -> Change:
    extent = np.ptp(path.points, axis=0).max()
    require(extent >= MIN_SIZE_M, "all waypoints are at the same point: click somewhere else")
    shape = replace(sketch.get_item(key).shape, path=path)
    changed = sketch.with_objects({key: shape})
    return Change(changed, Selection.of(key), f"{sketch.display_name(key)}: {description}")


def _round_speed(speed: float) -> float:
    if not MIN_SPEED_M_S <= speed <= MAX_SPEED_M_S:
        raise MapError(f"speed: expected {MIN_SPEED_M_S:g} to {MAX_SPEED_M_S:g} m/s, got {speed:g} m/s")
    return float(f"{speed:.6g}")
