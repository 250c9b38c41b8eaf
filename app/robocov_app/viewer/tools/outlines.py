"""Tools that draw obstacles point by point: polygons and walls."""

from abc import ABC, abstractmethod
from contextlib import suppress
from dataclasses import dataclass, field
from math import dist

import numpy as np

from robocov.environment import Obstacle, Point
from robocov.errors import RobocovError
from robocov_app.toolkit.tools.drawn_outline import SAME_POINT_M, DrawnOutline
from robocov_app.viewer.session.editing import map_edits
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.tools.tool import ViewerPointerEvent, ViewerTool, ViewerToolOverlay, add_obstacle

DEFAULT_WALL_WIDTH_M = 0.1
MIN_WALL_WIDTH_M = 0.02
MAX_WALL_WIDTH_M = 5.0
WALL_END_FRACTION = 0.3  # fraction of the reach: a press this close to the last point ends a wall


@dataclass
class OutlineTool(ViewerTool, ABC):
    """Base class of tools that draw an obstacle point by point.

    Attributes
    ----------
    end_fraction : float
        Fraction of the pointer's reach: a press this close to the last point completes the outline.
    outline : DrawnOutline
        The points so far.
    """

    snaps = True
    end_fraction = 0.0

    outline: DrawnOutline = field(repr=False)

    @property
    def is_busy(self) -> bool:
        """Whether there are points."""
        return bool(self.outline.points)

    @abstractmethod
    def build_obstacle(self, points: list[Point]) -> Obstacle:
        """Build the obstacle with these points, m; raise RobocovError if they do not define one."""

    def press(self, session: Session, event: ViewerPointerEvent) -> str | None:
        """Add a point, or complete the obstacle."""
        same_point = max(SAME_POINT_M, self.end_fraction * event.reach)
        point = self._constrain(event)
        is_complete = self.outline.press(point, event.unsnapped_point, event.reach, same_point)
        if is_complete:
            return self.finish(session)
        return None

    def double_click(self, session: Session, event: ViewerPointerEvent) -> str | None:
        """Complete the obstacle; the first of the two clicks has already added the last point."""
        return self.finish(session)

    def move(self, session: Session, event: ViewerPointerEvent) -> None:
        """Move the edge that follows the cursor; with Shift, its angle is a multiple of 45°."""
        self.outline.cursor = self._constrain(event)

    def _constrain(self, event: ViewerPointerEvent) -> Point:
        """Return the position of the next point, which depends on Shift and on the last point."""
        if not self.outline.points:
            return event.point
        return event.constrain(self.outline.points[-1])

    def release(self, session: Session, event: ViewerPointerEvent, *, is_click: bool) -> str | None:
        """Complete the obstacle if it was drawn with a single drag."""
        point = self._constrain(event)
        is_complete = self.outline.release(point, event.unsnapped_point, event.reach, is_click=is_click)
        if not is_complete:
            return None
        self.outline.points.append(self.outline.cursor)
        return self.finish(session)

    def finish(self, session: Session) -> str | None:
        """Add the obstacle to the map, and return a message; do nothing if it has no points."""
        points = self.outline.take_points()
        if not points:
            return None
        return add_obstacle(session, self.build_obstacle(points), self.name)

    def cancel(self, session: Session) -> bool:
        """Discard the points; return whether there were any."""
        return self.outline.cancel()

    def build_overlay(self, session: Session) -> ViewerToolOverlay:
        """Return the line up to the cursor, with the length of its last edge."""
        if not self.outline.points:
            return ViewerToolOverlay()
        line = (*self.outline.points, self.outline.cursor)
        label = f"{dist(line[-2], line[-1]):.2f} m"
        return ViewerToolOverlay(line, is_closed=len(line) > 2, label=label)


@dataclass
class AddPolygonTool(OutlineTool):
    """Draws a polygon corner by corner."""

    name = "polygon"
    title = "Polygon"
    key = "p"
    hint = "click the corners; Enter, a double click or a click on the first corner closes it"
    touch_hint = "tap the corners; a double tap or a tap on the first corner closes it"

    outline: DrawnOutline = field(
        default_factory=lambda: DrawnOutline(min_points=3, can_close=True), repr=False
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
    touch_hint = "drag, or tap its points; a double tap ends it"
    is_resizable = True
    end_fraction = WALL_END_FRACTION

    outline: DrawnOutline = field(default_factory=lambda: DrawnOutline(can_drag=True), repr=False)
    width: float = DEFAULT_WALL_WIDTH_M

    def build_obstacle(self, points: list[Point]) -> Obstacle:
        """Build the wall with these points, m."""
        return map_edits.build_wall(points, self.width)

    def build_overlay(self, session: Session) -> ViewerToolOverlay:
        """Return a preview of the wall up to the cursor."""
        state = super().build_overlay(session)
        if not state.line:
            return state
        walls: tuple[Obstacle, ...] = ()
        # Two points at the same position do not define a wall yet.
        with suppress(RobocovError):
            walls = (self.build_obstacle(list(state.line)),)
        label = f"{state.label}, {self.width:g} m wide"
        return ViewerToolOverlay(state.line, obstacles=walls, label=label)

    def resize(self, session: Session, factor: float) -> str:
        """Multiply the width of new walls by a factor, and return a message."""
        width = round(self.width * factor, 3)
        self.width = float(np.clip(width, MIN_WALL_WIDTH_M, MAX_WALL_WIDTH_M))
        return f"new walls are {self.width:g} m wide"
