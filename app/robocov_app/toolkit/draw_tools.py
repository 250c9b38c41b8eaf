"""Outlines drawn with the mouse, point by point or with a single drag; tools make shapes of them."""

from dataclasses import dataclass, field
from math import dist
from typing import TypeAlias

Point: TypeAlias = tuple[float, float]
SAME = 1e-6  # meters below which two points are one


@dataclass
class Outline:
    """Points that are being drawn; `press` and `release` return whether they complete the outline."""

    least: int = 2  # points that are needed
    most: int = 1_000_000  # and that are taken
    closes: bool = False  # whether a press on the first point ends it
    drags: bool = False  # whether it can be drawn by a single drag, too
    points: list[Point] = field(default_factory=list)
    at: Point = (0.0, 0.0)
    dragging: bool = False
    _pressed: Point = (0.0, 0.0)

    def press(self, point: Point, raw: Point, closing: float, same: float = SAME) -> bool:
        """Add a point; one within `closing` m of the first, or `same` m of the last, ends the outline."""
        self.at, enough = point, len(self.points) >= self.least
        if self.closes and enough and dist(point, self.points[0]) < closing:
            return True
        if self.points and dist(point, self.points[-1]) < same:
            return enough
        self.points.append(point)
        self._pressed, self.dragging = raw, self.drags and len(self.points) == 1
        return len(self.points) == self.most

    def release(self, point: Point, raw: Point, reach: float, *, clicked: bool = False) -> bool:
        """End a drag; a hand that shakes in a click has drawn nothing, unless two points are wanted."""
        dragging, self.dragging = self.dragging, False
        if not dragging or not self.points or clicked:  # meanwhile a key may have taken the point back
            return False
        self.at = point
        return self.most == 2 or dist(self._pressed, raw) >= reach

    def take(self) -> list[Point]:
        """Return the points, of two the cursor's as the second, and begin again."""
        points = [*self.points, self.at] if self.most == 2 and len(self.points) == 1 else self.points
        self.points, self.dragging = [], False
        return points

    def cancel(self) -> bool:
        return bool(self.take())
