"""Tools that draw obstacles point by point: polygons and walls."""

from contextlib import suppress
from dataclasses import dataclass, field
from math import dist

import numpy as np

from robocov.environment import Obstacle, Point
from robocov.errors import RobocovError
from robocov_app.toolkit.drawn_outline import SAME_POINT_M, DrawnOutline
from robocov_app.viewer.session import map_edits
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.tools.snapping import SNAP_REACH_FRACTION, snap_point
from robocov_app.viewer.tools.tool import Preview, Tool, add_obstacle

DEFAULT_WALL_WIDTH_M = 0.1
MIN_WALL_WIDTH_M = 0.02
MAX_WALL_WIDTH_M = 5.0
WALL_END_FRACTION = 0.3  # of a finger's width: a press this close to the last point ends a wall


@dataclass
class SnappedOutline:
    """Points that are drawn one by one and snap to the map.

    Attributes
    ----------
    outline : DrawnOutline
        The points so far.
    end_fraction : float
        Fraction of a finger's width from the last point within which a press completes the outline.
    """

    outline: DrawnOutline
    end_fraction: float = 0.0
    _reach: float = 0.0

    def press(self, session: Session, point: Point, reach: float) -> bool:
        """Add a point; return whether that completes the outline."""
        self._reach = reach
        same_point = max(SAME_POINT_M, self.end_fraction * reach)
        return self.outline.press(self._snap(session, point), point, reach, same_point)

    def move(self, session: Session, point: Point) -> None:
        """Move the end of the line that follows the cursor."""
        self.outline.cursor = self._snap(session, point) if self.outline.points else point

    def release(self, session: Session, point: Point) -> bool:
        """End a drag; return whether that completes the outline."""
        is_complete = self.outline.release(self._snap(session, point), point, self._reach)
        if is_complete:
            self.outline.points.append(self.outline.cursor)
        return is_complete

    def take_points(self) -> list[Point]:
        """Return the points, and start over."""
        return self.outline.take_points()

    def cancel(self) -> bool:
        """Drop the points; return whether there were any."""
        return self.outline.cancel()

    def build_preview(self) -> Preview | None:
        """Return the line up to the cursor, with the length of its last edge."""
        if not self.outline.points:
            return None
        line = (*self.outline.points, self.outline.cursor)
        return Preview(line, is_closed=len(line) > 2, label=f"{dist(line[-2], line[-1]):.2f} m")

    def _snap(self, session: Session, point: Point) -> Point:
        return snap_point(session.displayed.environment, point, SNAP_REACH_FRACTION * self._reach)


@dataclass
class OutlineTool(Tool):
    """Base class of tools that draw an obstacle point by point.

    Attributes
    ----------
    drawing : SnappedOutline
        The points so far.
    """

    ends_on_double_click = True

    drawing: SnappedOutline = field(repr=False)

    def build_obstacle(self, points: list[Point]) -> Obstacle:
        """Build the obstacle with these points, m; raise RobocovError if they do not form one."""
        raise NotImplementedError

    def press(self, session: Session, point: Point, reach: float, number: int | None) -> str | None:
        """Add a point, or complete the obstacle."""
        return self.finish(session) if self.drawing.press(session, point, reach) else None

    def move(self, session: Session, point: Point) -> None:
        """Move the edge that follows the cursor."""
        self.drawing.move(session, point)

    def release(self, session: Session, point: Point) -> str | None:
        """End a drag."""
        return self.finish(session) if self.drawing.release(session, point) else None

    def finish(self, session: Session) -> str | None:
        """Add the obstacle to the map."""
        points = self.drawing.take_points()
        if not points:
            return None
        return add_obstacle(session, self.build_obstacle(points), self.name)

    def cancel(self, session: Session) -> bool:
        """Drop the points."""
        return self.drawing.cancel()

    def build_preview(self, session: Session) -> Preview | None:
        """Return the outline so far."""
        return self.drawing.build_preview()


@dataclass
class AddPolygonTool(OutlineTool):
    """Draws a polygon corner by corner."""

    name = "polygon"
    title = "Polygon"
    key = "p"
    hint = "click the corners; Enter, a double click or a click on the first corner closes it"

    drawing: SnappedOutline = field(
        default_factory=lambda: SnappedOutline(DrawnOutline(min_points=3, closes=True)), repr=False
    )

    def build_obstacle(self, points: list[Point]) -> Obstacle:
        """Build the polygon with these corners, m."""
        return map_edits.build_polygon(points)


@dataclass
class AddWallTool(OutlineTool):
    """Draws a wall point by point, or with a single drag.

    Attributes
    ----------
    width : float
        Width of new walls, m.
    """

    name = "wall"
    title = "Wall"
    key = "w"
    hint = "drag, or click its points; Enter or a double click ends it; [ and ] change its width"
    is_resizable = True

    drawing: SnappedOutline = field(
        default_factory=lambda: SnappedOutline(DrawnOutline(drags=True), WALL_END_FRACTION), repr=False
    )
    width: float = DEFAULT_WALL_WIDTH_M

    def build_obstacle(self, points: list[Point]) -> Obstacle:
        """Build the wall with these points, m."""
        return map_edits.build_wall(points, self.width)

    def build_preview(self, session: Session) -> Preview | None:
        """Return the wall so far."""
        outline = self.drawing.build_preview()
        if outline is None:
            return None
        wall: Obstacle | None = None
        # Two points in the same position are no wall yet.
        with suppress(RobocovError):
            wall = self.build_obstacle(list(outline.line))
        return Preview(outline.line, obstacle=wall, label=f"{outline.label}, {self.width:g} m wide")

    def resize(self, session: Session, factor: float) -> str:
        """Multiply the width of new walls by a factor."""
        width = round(self.width * factor, 3)
        self.width = float(np.clip(width, MIN_WALL_WIDTH_M, MAX_WALL_WIDTH_M))
        return f"new walls are {self.width:g} m wide"
