"""The hand, which selects and drags robots and obstacles."""

from dataclasses import dataclass
from math import dist

from robocov.environment import Obstacle, Point
from robocov_app.toolkit.tools.tool import CursorShape
from robocov_app.viewer.inspection import Inspection
from robocov_app.viewer.session.editing import map_edits
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.tools.handles import find_handle, list_handles
from robocov_app.viewer.tools.obstacle_drags import BoxDrag, HandleDrag, MoveDrag, ObstacleDrag
from robocov_app.viewer.tools.tool import ViewerPointerEvent, ViewerTool, ViewerToolOverlay

MIN_DRAG_M = 0.02  # a shorter move counts as part of a click


@dataclass
class HandTool(ViewerTool):
    """Selects, drags and throws robots; selects, moves, copies and resizes obstacles.

    While an obstacle is dragged, Shift keeps the direction a multiple of 45°, and Alt makes a copy. A click
    with Shift adds an obstacle to the selection, and a drag of the floor with Shift selects those in a box.

    Attributes
    ----------
    inspection : Inspection
        The selection; a press selects the robot or the obstacle under the pointer.
    robot : int or None
        Number of the robot that is held.
    drag : ObstacleDrag or None
        The drag of obstacles, of a handle or of a box.
    hovered : Obstacle or None
        The obstacle under the pointer.
    """

    name = "hand"
    title = "Hand"
    key = "v"
    hint = (
        "click or drag a robot or an obstacle; Alt-drag copies it; Shift-drag selects several; "
        "right click: menu; drag the floor to pan"
    )
    touch_hint = "tap or drag a robot or an obstacle; hold it for a menu; drag the floor to pan"
    takes_robots = True

    inspection: Inspection
    robot: int | None = None
    drag: ObstacleDrag | None = None
    hovered: Obstacle | None = None
    _pressed_at: Point = (0.0, 0.0)
    _reach: float = 0.0  # of the latest event, m
    _has_dragged: bool = False
    _is_over_handle: bool = False

    def press(self, session: Session, event: ViewerPointerEvent) -> str | None:
        """Grab the handle, robot or obstacle under the cursor; with Shift, start a box on the floor."""
        self._pressed_at = event.unsnapped_point
        self._reach = event.reach
        self._has_dragged = False
        self.drag = self._start_handle_drag(session, event)
        self.robot = None
        if self.drag is not None:
            return None
        if event.robot is not None:
            self.robot = event.robot
            self.inspection.select_robot(event.robot)
            return None
        index = map_edits.find_obstacle(session.displayed.environment, event.unsnapped_point)
        if index is not None:
            self._press_obstacle(session, event, session.displayed.environment.obstacles[index])
        elif event.shift:
            self.drag = BoxDrag(session, event)
        return None

    def _start_handle_drag(self, session: Session, event: ViewerPointerEvent) -> ObstacleDrag | None:
        """Return the drag of the handle under the pointer; None if there is none."""
        selected = self._get_single_selection(session)
        if selected is None:
            return None
        handle = find_handle(selected, event.unsnapped_point, event.reach)
        if handle is None:
            return None
        return HandleDrag(session, event, selected, handle)

    def _press_obstacle(self, session: Session, event: ViewerPointerEvent, pressed: Obstacle) -> None:
        """Select an obstacle; if it is one of several selected ones, drag all of them."""
        if event.shift and self.inspection.obstacles:
            self.inspection.toggle_obstacle(pressed)
        elif pressed not in self.inspection.obstacles:
            self.inspection.select_obstacles((pressed,))
        obstacles = session.displayed.environment.obstacles
        selected = tuple(obstacle for obstacle in self.inspection.obstacles if obstacle in obstacles)
        self.drag = MoveDrag(session, event, selected)

    def _get_single_selection(self, session: Session) -> Obstacle | None:
        """Return the selected obstacle if it is the only one, and still on the displayed map."""
        selected = self.inspection.obstacles
        if len(selected) != 1 or selected[0] not in session.displayed.environment.obstacles:
            return None
        return selected[0]

    @property
    def is_holding(self) -> bool:
        """Whether a robot, an obstacle, a handle or a box is held."""
        return self.robot is not None or self.drag is not None

    def move(self, session: Session, event: ViewerPointerEvent) -> None:
        """Drag the held robot; held obstacles are changed only when the button is released."""
        self._reach = event.reach
        if not self.is_holding:
            self._update_hover(session, event)
            return
        if self.drag is not None:
            self.drag.update(event)
        if dist(self._pressed_at, event.unsnapped_point) > MIN_DRAG_M:
            self._has_dragged = True
        if self.robot is None or not self._has_dragged:
            return
        # The robot may have been removed while it was held.
        if self.robot in session.displayed.get_setup(session.timeline.panes[0]).all_numbers:
            session.drag_robot(self.robot, event.unsnapped_point)

    def _update_hover(self, session: Session, event: ViewerPointerEvent) -> None:
        """Find the handle under the pointer or, if there is no handle or robot, the obstacle."""
        environment = session.displayed.environment
        self.hovered = None
        selected = self._get_single_selection(session)
        self._is_over_handle = False
        if selected is not None:
            self._is_over_handle = find_handle(selected, event.unsnapped_point, event.reach) is not None
        if event.robot is None and not self._is_over_handle:
            index = map_edits.find_obstacle(environment, event.unsnapped_point)
            if index is not None:
                self.hovered = environment.obstacles[index]

    def release(self, session: Session, event: ViewerPointerEvent, *, is_click: bool) -> str | None:
        """Let go of the held robot, or apply the drag of obstacles."""
        drag = self.drag
        if self.robot is not None:
            session.release()
        self.robot = None
        self.drag = None
        if drag is None or is_click:
            return None
        drag.update(event)
        if drag.is_outdated(session):
            return None
        return drag.end(session, self.inspection)

    def cancel(self, session: Session) -> bool:
        """Release the held object, or else clear the selection; return whether there was either."""
        if not self.is_holding:
            return self.inspection.clear()
        self.robot = None
        self.drag = None
        session.release()
        return True

    def build_overlay(self, session: Session) -> ViewerToolOverlay:
        """Return a preview of the drag, or the outlines and handles of the selection."""
        overlay = None
        if self.drag is not None and not self.drag.is_outdated(session):
            overlay = self.drag.build_overlay()
        return overlay or self._build_outlines(session)

    def choose_cursor(self, session: Session) -> CursorShape:
        """Return the shape of the cursor where there is no robot."""
        if isinstance(self.drag, BoxDrag):
            return "cross"
        if self._is_over_handle:
            return "hand"
        if self.drag is not None or self.hovered is not None:
            return "move"
        return "arrow"

    def _build_outlines(self, session: Session) -> ViewerToolOverlay:
        """Return the outlines of the selected obstacles, their handles, and the one under the pointer."""
        obstacles = session.displayed.environment.obstacles
        selected = tuple(obstacle for obstacle in self.inspection.obstacles if obstacle in obstacles)
        hovered = self.hovered
        # The pointer may have left the map, and the obstacle may have been moved or deleted.
        if self.inspection.cursor is None or hovered not in obstacles or hovered in selected:
            hovered = None
        handles: tuple[Point, ...] = ()
        if len(selected) == 1:
            handles = tuple(handle.position for handle in list_handles(selected[0], self._reach))
        return ViewerToolOverlay(hovered=hovered, selected=selected, handles=handles)
