"""Outlines drawn with the mouse, point by point or with a single drag; tools turn them into shapes."""

from dataclasses import dataclass, field
from math import dist
from typing import TypeAlias

Point: TypeAlias = tuple[float, float]

SAME_POINT_M = 1e-6
"""Distance below which two points are the same."""
_UNLIMITED = 1_000_000


@dataclass
class DrawnOutline:
    """An outline that is being drawn.

    Attributes
    ----------
    min_points, max_points : int
        Number of points the outline needs at least, and the number at which it is complete.
    can_close : bool
        Whether pressing on the first point again completes the outline.
    can_drag : bool
        Whether the outline can also be drawn with a single drag.
    points : list of (x, y), m
    cursor : (x, y), m
        Snapped position of the mouse.
    is_dragging : bool
        Whether the button has been held down since the first point.
    """

    min_points: int = 2
    max_points: int = _UNLIMITED
    can_close: bool = False
    can_drag: bool = False
    points: list[Point] = field(default_factory=list)
    cursor: Point = (0.0, 0.0)
    is_dragging: bool = False
    _pressed_at: Point = (0.0, 0.0)

    def press(
        self, point: Point, unsnapped: Point, closing_reach: float, same_point: float = SAME_POINT_M
    ) -> bool:
        """Add a point, or complete the outline.

        Parameters
        ----------
        point : (x, y), m
            Position of the mouse after snapping.
        unsnapped : (x, y), m
            Position of the mouse before snapping.
        closing_reach : float, m
            Distance from the first point within which a press completes a closed outline.
        same_point : float, m
            Distance from the last point within which a press adds no point, but completes the outline if it
            has enough points.

        Returns
        -------
        bool
            Whether the outline is complete.
        """
        self.cursor = point
        has_enough = len(self.points) >= self.min_points
        if self.can_close and has_enough and dist(point, self.points[0]) < closing_reach:
            return True
        if self.points and dist(point, self.points[-1]) < same_point:
            return has_enough
        self.points.append(point)
        self._pressed_at = unsnapped
        self.is_dragging = self.can_drag and len(self.points) == 1
        return len(self.points) == self.max_points

    def release(self, point: Point, unsnapped: Point, reach: float, *, is_click: bool = False) -> bool:
        """End a drag.

        Parameters
        ----------
        point, unsnapped : (x, y), m
            Position of the mouse after and before snapping.
        reach : float, m
            Minimum length of a drag, so that a shaky click draws nothing. It does not apply to outlines of
            two points.
        is_click : bool
            Whether the mouse has hardly moved since the press.

        Returns
        -------
        bool
            Whether the outline is complete.
        """
        was_dragging = self.is_dragging
        self.is_dragging = False
        # A key may have removed the first point during the drag.
        if not was_dragging or not self.points or is_click:
            return False
        self.cursor = point
        return self.max_points == 2 or dist(self._pressed_at, unsnapped) >= reach

    def take_points(self) -> list[Point]:
        """Return the points and start over. If only the second of two points is missing, it is the cursor."""
        points = self.points
        if self.max_points == 2 and len(points) == 1:
            points = [*points, self.cursor]
        self.points = []
        self.is_dragging = False
        return points

    def cancel(self) -> bool:
        """Remove all points; return whether there were any."""
        return bool(self.take_points())
