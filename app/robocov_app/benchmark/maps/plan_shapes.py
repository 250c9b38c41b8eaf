"""Shapes from which the plans of the benchmark are built.

Lengths are in meters. Coordinates are rounded to centimeters, so that they are the same on every machine.
"""

from typing import NamedTuple

import numpy as np

from robocov.environment import Obstacle, Point, PolygonObstacle, Ring, WallObstacle
from robocov.typing import FloatArray

INNER_WALL_M = 0.12
"""Thickness of inner walls."""
_MIN_WALL_PIECE_M = 0.15
"""Minimum length of a wall next to a door; shorter walls are left out."""


class FloorPlan(NamedTuple):
    """Boundary and obstacles of a map, and where robots enter it.

    Attributes
    ----------
    boundary : (k, 2) sequence, m
        Outer ring.
    obstacles : list of Obstacle
        Walls, furniture and other solid objects.
    entrance : (2,) sequence, m, or None
        Point near which the robots start; None for the lower left corner of the bounding box.
    """

    boundary: Ring
    obstacles: list[Obstacle]
    entrance: Point | None = None


def round_points(points: FloatArray | list[tuple[float, float]]) -> Ring:
    """Round coordinates to centimeters."""
    return tuple((round(float(x), 2), round(float(y), 2)) for x, y in points)


def build_box(left: float, bottom: float, right: float, top: float) -> Ring:
    """Build the ring of a rectangle with sides parallel to the axes."""
    return round_points([(left, bottom), (right, bottom), (right, top), (left, top)])


def build_block(x: float, y: float, width: float, height: float) -> Obstacle:
    """Build a rectangle whose lower left corner is at (x, y)."""
    return PolygonObstacle(build_box(x, y, x + width, y + height))


def build_rotated_block(center: FloatArray, width: float, height: float, angle: float) -> Obstacle:
    """Build a rectangle around a center, rotated counter-clockwise by an angle, rad."""
    corners = np.array([(-width, -height), (width, -height), (width, height), (-width, height)]) / 2.0
    along = np.array([np.cos(angle), np.sin(angle)])
    across = [-along[1], along[0]]
    return PolygonObstacle(round_points(center + corners @ np.array([along, across])))


def build_wall_with_door(
    offset: float, start: float, end: float, *, door: float, door_width: float, is_vertical: bool
) -> list[Obstacle]:
    """Build the pieces of a wall on either side of its door; very short pieces are left out.

    Parameters
    ----------
    offset : float, m
        x of a vertical wall, or y of a horizontal wall.
    start, end : float, m
        Ends of the wall along its direction.
    door : float, m
        Middle of the door, in the same coordinate as the ends of the wall.
    door_width : float, m
        Width of the door.
    is_vertical : bool
        Whether the wall is parallel to the y axis, instead of the x axis.
    """
    walls: list[Obstacle] = []
    for low, high in ((start, door - door_width / 2.0), (door + door_width / 2.0, end)):
        if high - low <= _MIN_WALL_PIECE_M:
            continue
        ends = [(low, offset), (high, offset)]
        if is_vertical:
            ends = [(offset, low), (offset, high)]
        walls.append(WallObstacle(round_points(ends), INNER_WALL_M))
    return walls
