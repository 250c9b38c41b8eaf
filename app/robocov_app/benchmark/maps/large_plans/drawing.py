"""Drawing of a plan: walls with doors and furniture, in the coordinates of a part of the building."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import shapely

from robocov.environment import Obstacle, Point, PolygonObstacle, Ring, WallObstacle
from robocov.typing import FloatArray
from robocov_app.benchmark.maps.plan_shapes import INNER_WALL_M, build_box, round_points

DOOR_WIDTH_M = 0.9
"""Width of most doors."""
_MIN_WALL_PIECE_M = 0.2
"""Minimum length of a wall between doors; shorter walls are left out."""
_GRID_M = 0.01
"""Distance of the grid to which outlines are rounded; plans have the same resolution."""
_QUARTER_TURN = np.array([(0.0, -1.0), (1.0, 0.0)])
_MIRROR = np.diag([1.0, -1.0])


class Drawing:
    """The obstacles of a plan, drawn in the coordinates of one part of the building.

    Parts of a drawing share its list of obstacles, so that a room or a wing is described once, in coordinates
    that start at its own corner, and drawn in any of the eight orientations.

    Attributes
    ----------
    obstacles : list of Obstacle
        Everything drawn so far, in the coordinates of the plan.
    """

    def __init__(self) -> None:
        self.obstacles: list[Obstacle] = []
        self._origin = np.zeros(2)
        self._axes = np.eye(2)

    def open_part(self, x: float, y: float, quarter_turns: int = 0, *, mirrored: bool = False) -> Drawing:
        """Return a drawing of a part of the building, which adds to the same list of obstacles.

        Parameters
        ----------
        x, y : float, m
            Origin of the part, in the coordinates of this drawing.
        quarter_turns : int
            Number of counter-clockwise quarter turns from the axes of this drawing to those of the part.
        mirrored : bool
            Whether the y axis of the part is reversed before it is turned.
        """
        part = Drawing()
        part.obstacles = self.obstacles
        part._origin = self._origin + self._axes @ (x, y)
        part._axes = self._axes @ np.linalg.matrix_power(_QUARTER_TURN, quarter_turns % 4)
        if mirrored:
            part._axes = part._axes @ _MIRROR
        return part

    def to_plan(self, points: Iterable[Point]) -> Ring:
        """Return points of this part in the coordinates of the plan, rounded to centimeters."""
        return round_points(self._origin + np.array(list(points)) @ self._axes.T)

    def add_wall(self, *points: Point, thickness: float = INNER_WALL_M) -> None:
        """Add a wall along a polyline."""
        self.obstacles.append(WallObstacle(self.to_plan(points), thickness))

    def add_wall_with_doors(
        self,
        start: Point,
        end: Point,
        doors: Sequence[float],
        *,
        width: float = DOOR_WIDTH_M,
        thickness: float = INNER_WALL_M,
    ) -> None:
        """Add the pieces of a straight wall between its doors.

        Parameters
        ----------
        start, end : (2,) sequence, m
            Ends of the wall.
        doors : sequence of float, m
            Distance of the middle of each door from the start.
        width : float, m
            Width of the doors.
        thickness : float, m
            Thickness of the wall.
        """
        origin = np.array(start)
        length = float(np.hypot(*(np.array(end) - origin)))
        direction = (np.array(end) - origin) / length
        piece_start = 0.0
        # The last piece ends at an imaginary door beyond the end of the wall.
        for door in [*sorted(doors), length + width]:
            piece_end = min(door - width / 2.0, length)
            if piece_end - piece_start >= _MIN_WALL_PIECE_M:
                low = origin + piece_start * direction
                high = origin + piece_end * direction
                self.add_wall(tuple(low), tuple(high), thickness=thickness)
            piece_start = door + width / 2.0

    def add_partitions(
        self, positions: Iterable[float], depth: float, *, thickness: float = INNER_WALL_M
    ) -> None:
        """Add the walls between the rooms of a row: one from y = 0 to y = `depth` at each x."""
        for x in positions:
            self.add_wall((x, 0.0), (x, depth), thickness=thickness)

    def add_block(self, left: float, bottom: float, right: float, top: float) -> None:
        """Add a solid rectangle."""
        self.add_polygon(build_box(left, bottom, right, top))

    def add_centered_block(self, x: float, y: float, width: float, depth: float) -> None:
        """Add a solid rectangle around a point."""
        self.add_block(x - width / 2.0, y - depth / 2.0, x + width / 2.0, y + depth / 2.0)

    def add_octagon(self, x: float, y: float, radius: float) -> None:
        """Add a solid octagon around a point."""
        self.add_polygon(build_octagon(x, y, radius))

    def add_polygon(self, points: Iterable[Point]) -> None:
        """Add a solid polygon."""
        self.obstacles.append(PolygonObstacle(self.to_plan(points)))


def build_octagon(x: float, y: float, radius: float) -> Ring:
    """Build a regular octagon of a given circumradius, with two sides parallel to each axis."""
    angles = (np.arange(8) + 0.5) * np.pi / 4.0
    return round_points(np.column_stack([x + radius * np.cos(angles), y + radius * np.sin(angles)]))


def build_outline(parts: Iterable[shapely.Geometry]) -> Ring:
    """Return the outer ring of the union of connected shapes, counter-clockwise."""
    union = shapely.union_all(list(parts))
    if not isinstance(union, shapely.Polygon):
        raise ValueError(f"parts: expected connected shapes, got a {union.geom_type}")
    # Corners that differ by rounding errors coincide on the grid.
    outline = shapely.simplify(shapely.set_precision(union, _GRID_M), 0.0)
    # The first corner of a union depends on the version of GEOS, but that of a normalized polygon does not.
    # Normalizing makes the ring clockwise, so the orientation is set afterwards.
    outline = shapely.orient_polygons(outline.normalize())
    return round_points(np.asarray(outline.exterior.coords)[:-1])


def divide_evenly(start: float, end: float, width: float) -> FloatArray:
    """Divide a range into equal rooms about `width` wide, and return their walls, both ends included."""
    rooms = max(1, round((end - start) / width))
    return np.linspace(start, end, rooms + 1)
