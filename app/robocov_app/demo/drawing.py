"""Tools that draw obstacles: polygons, walls and round pillars. Coordinates are metres."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from robocov.errors import RobocovError
from robocov_app.demo.editing import circle_of, polygon_of, wall_of, with_obstacle
from robocov_app.demo.tool import Base, Point, Preview, apart, edited

if TYPE_CHECKING:
    from robocov.environment import Obstacle
    from robocov_app.demo.session import Session

WALL_WIDTH = 0.1
"""Width of drawn walls in metres."""


@dataclass
class Polygon(Base):
    """Draws a polygon, corner by corner."""

    name: str = "polygon"
    title: str = "Polygon"
    hint: str = "click the corners; Enter, a double click or a click on the first corner closes it"
    _corners: list[Point] = field(default_factory=list)
    _at: Point = (0.0, 0.0)

    def press(self, session: Session, point: Point, reach: float, number: int | None) -> str | None:
        """Add a corner, or close the outline at its first."""
        self._at = point
        if len(self._corners) >= 3 and apart(point, self._corners[0]) < reach:
            return self.finish(session)
        if not self._corners or apart(point, self._corners[-1]) > 1e-6:
            self._corners.append(point)
        return None

    def move(self, session: Session, point: Point) -> None:
        """Show the next edge."""
        self._at = point

    def finish(self, session: Session) -> str | None:
        """Put the polygon down."""
        corners, self._corners = self._corners, []
        if not corners:
            return None
        return edited(session, with_obstacle(session.environment, polygon_of(corners)), "polygon drawn")

    def cancel(self, session: Session) -> bool:
        """Give the outline up."""
        had, self._corners = bool(self._corners), []
        return had

    def preview(self, session: Session) -> Preview | None:
        """Show the outline so far."""
        if not self._corners:
            return None
        points = (*self._corners, self._at)
        return Preview(points, len(points) > 2, None, f"{apart(points[-1], points[-2]):.2f} m")


@dataclass
class Wall(Polygon):
    """Draws a wall, point by point."""

    name: str = "wall"
    title: str = "Wall"
    hint: str = "click its points; Enter or a double click ends it; [ and ] change its width"
    width: float = WALL_WIDTH

    def press(self, session: Session, point: Point, reach: float, number: int | None) -> str | None:
        """Add a point, or end at the last one."""
        self._at = point
        if len(self._corners) >= 2 and apart(point, self._corners[-1]) < 0.3 * reach:
            return self.finish(session)
        if not self._corners or apart(point, self._corners[-1]) > 1e-6:
            self._corners.append(point)
        return None

    def finish(self, session: Session) -> str | None:
        """Put the wall down."""
        points, self._corners = self._corners, []
        if not points:
            return None
        wall = wall_of(points, self.width)
        return edited(session, with_obstacle(session.environment, wall), "wall drawn")

    def preview(self, session: Session) -> Preview | None:
        """Show the wall so far."""
        if not self._corners:
            return None
        points = (*self._corners, self._at)
        try:
            shape = wall_of(list(points), self.width)
        except RobocovError:
            shape = None
        words = f"{apart(points[-1], points[-2]):.2f} m, {self.width:g} m wide"
        return Preview(points, False, shape, words)

    def widen(self, factor: float) -> None:
        """Draw wider walls, or narrower ones."""
        self.width = float(np.clip(round(self.width * factor, 3), 0.02, 5.0))


@dataclass
class Circle(Base):
    """Draws a round pillar from its middle."""

    name: str = "circle"
    title: str = "Circle"
    hint: str = "drag from the middle to the rim"
    _middle: Point | None = None
    _at: Point = (0.0, 0.0)

    def press(self, session: Session, point: Point, reach: float, number: int | None) -> str | None:
        """Begin at the middle."""
        self._middle = self._at = point
        return None

    def move(self, session: Session, point: Point) -> None:
        """Show the rim."""
        self._at = point

    def release(self, session: Session, point: Point) -> str | None:
        """Put the pillar down."""
        middle, self._middle = self._middle, None
        if middle is None:
            return None
        circle = circle_of(middle, point)
        return edited(session, with_obstacle(session.environment, circle), "circle drawn")

    def cancel(self, session: Session) -> bool:
        """Give it up."""
        had, self._middle = self._middle is not None, None
        return had

    def preview(self, session: Session) -> Preview | None:
        """Show the pillar."""
        if self._middle is None:
            return None
        try:
            shape: Obstacle | None = circle_of(self._middle, self._at)
        except RobocovError:
            shape = None
        return Preview(
            (self._middle, self._at), False, shape, f"radius {apart(self._middle, self._at):.2f} m"
        )
