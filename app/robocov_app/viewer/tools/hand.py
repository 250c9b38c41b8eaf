"""The hand, which selects and drags robots and obstacles."""

from dataclasses import dataclass
from math import dist

import numpy as np

from robocov.environment import Obstacle, Point
from robocov_app.toolkit.tools.tool import CursorShape
from robocov_app.viewer.inspection import Inspection
from robocov_app.viewer.session import map_edits
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.tools.tool import ViewerPointerEvent, ViewerTool, ViewerToolOverlay, change_map

MIN_DRAG_M = 0.02  # a shorter move counts as part of a click
_MIN_SHIFT_M = 1e-3  # an obstacle that is moved by less stays where it is


@dataclass
class HandTool(ViewerTool):
    """Selects, drags and throws robots, and selects, moves and copies obstacles.

    While an obstacle is dragged, Shift keeps the direction a multiple of 45°, and Alt makes a copy.

    Attributes
    ----------
    inspection : Inspection
        The selection; a press selects the robot or the obstacle under the pointer.
    robot : int or None
        Number of the robot that is held.
    obstacle : int or None
        Index of the obstacle that is held.
    hovered : Obstacle or None
        The obstacle under the pointer.
    """

    name = "hand"
    title = "Hand"
    key = "v"
    hint = (
        "click or drag a robot or an obstacle; Alt-drag copies it; right click: menu; drag the floor to pan"
    )
    takes_robots = True

    inspection: Inspection
    robot: int | None = None
    obstacle: int | None = None
    hovered: Obstacle | None = None
    _pressed_at: Point = (0.0, 0.0)
    _cursor: Point = (0.0, 0.0)
    _obstacles: tuple[Obstacle, ...] = ()  # of the map when the button was pressed
    _drags: bool = False
    _copies: bool = False

    def press(self, session: Session, event: ViewerPointerEvent) -> str | None:
        """Grab the robot or the obstacle under the cursor."""
        self._pressed_at = event.unsnapped_point
        self._cursor = event.unsnapped_point
        self._drags = False
        self._copies = False
        self._obstacles = session.displayed.environment.obstacles
        self.robot = event.robot
        self.obstacle = None
        if event.robot is not None:
            self.inspection.select_robot(event.robot)
            return None
        self.obstacle = map_edits.find_obstacle(session.displayed.environment, event.unsnapped_point)
        if self.obstacle is not None:
            self.inspection.select_obstacle(self._obstacles[self.obstacle])
        return None

    @property
    def is_holding(self) -> bool:
        """Whether a robot or an obstacle is held."""
        return self.robot is not None or self.obstacle is not None

    def move(self, session: Session, event: ViewerPointerEvent) -> None:
        """Drag the held robot; a held obstacle is moved only when the button is released."""
        if not self.is_holding:
            self._hover(session, event)
            return
        self._follow_pointer(event)
        if dist(self._pressed_at, event.unsnapped_point) > MIN_DRAG_M:
            self._drags = True
        if self.robot is None or not self._drags:
            return
        # The robot may have been removed while it was held.
        if self.robot in session.displayed.get_setup(session.timeline.panes[0]).all_numbers:
            session.drag_robot(self.robot, event.unsnapped_point)

    def _hover(self, session: Session, event: ViewerPointerEvent) -> None:
        """Note the obstacle under the pointer; a robot in front of it takes precedence."""
        environment = session.displayed.environment
        self.hovered = None
        if event.robot is None:
            index = map_edits.find_obstacle(environment, event.unsnapped_point)
            if index is not None:
                self.hovered = environment.obstacles[index]

    def _follow_pointer(self, event: ViewerPointerEvent) -> None:
        """Move a held obstacle with the pointer; Shift keeps its direction, Alt copies it."""
        self._copies = event.alt
        self._cursor = event.unsnapped_point
        if self.obstacle is not None:
            self._cursor = event.constrain(self._pressed_at)

    def release(self, session: Session, event: ViewerPointerEvent, *, clicked: bool) -> str | None:
        """Let go of the held robot, or move or copy the held obstacle to its new position."""
        self._follow_pointer(event)
        index = self.obstacle
        moved = self._move_obstacle(session)
        if self.robot is not None:
            session.release()
        self.robot = None
        self.obstacle = None
        if moved is None or index is None:
            return None
        name = map_edits.describe_obstacle(moved)
        if self._copies:
            environment = map_edits.add_obstacle(session.displayed.environment, moved)
            message = change_map(session, environment, f"{name} copied")
        else:
            environment = map_edits.replace_obstacles(session.displayed.environment, index, 1, [moved])
            message = change_map(session, environment, f"{name} moved")
        self.inspection.select_obstacle(moved)
        return message

    def cancel(self, session: Session) -> bool:
        """Release the held object, or else clear the selection; return whether there was either."""
        if not self.is_holding:
            return self.inspection.clear()
        self.robot = None
        self.obstacle = None
        session.release()
        return True

    def build_overlay(self, session: Session) -> ViewerToolOverlay:
        """Return the selected and the hovered obstacle, or a preview of the held one at its new position."""
        moved = self._move_obstacle(session)
        if moved is None:
            return self._build_outlines(session)
        distance = dist(self._pressed_at, self._cursor)
        line = (self._pressed_at, self._cursor)
        return ViewerToolOverlay(line, obstacle=moved, label=f"{distance:.2f} m")

    def choose_cursor(self, session: Session) -> CursorShape:
        """Return the shape of the cursor where there is no robot."""
        if self.obstacle is not None or self.hovered is not None:
            return "move"
        return "arrow"

    def _build_outlines(self, session: Session) -> ViewerToolOverlay:
        """Return the outlines of the selected obstacle and of the one under the pointer."""
        obstacles = session.displayed.environment.obstacles
        selected = self.inspection.obstacle
        if selected not in obstacles:
            selected = None
        hovered = self.hovered
        # The pointer may have left the map, and the obstacle may have been moved or deleted.
        if self.inspection.cursor is None or hovered not in obstacles or hovered == selected:
            hovered = None
        return ViewerToolOverlay(hovered=hovered, selected=selected)

    def _move_obstacle(self, session: Session) -> Obstacle | None:
        """Return the held obstacle, moved with the cursor; None if none is held or it stays where it is."""
        index = self.obstacle
        if index is None:
            return None
        present = session.displayed.environment.obstacles
        # The map may have been changed while the obstacle was held.
        if present[index : index + 1] != self._obstacles[index : index + 1]:
            return None
        dx = self._cursor[0] - self._pressed_at[0]
        dy = self._cursor[1] - self._pressed_at[1]
        if np.hypot(dx, dy) < _MIN_SHIFT_M:
            return None
        return map_edits.move_obstacle(present[index], dx, dy)
