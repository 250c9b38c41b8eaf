"""Drags of the hand: moving obstacles, changing the shape of one, and selecting those in a box."""

from abc import ABC, abstractmethod
from contextlib import suppress
from math import dist

import numpy as np
import shapely

from robocov.environment import Environment, Obstacle
from robocov.errors import RobocovError
from robocov_app.viewer.inspection import Inspection
from robocov_app.viewer.session.editing import map_edits
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.tools.handles import ObstacleHandle, drag_handle
from robocov_app.viewer.tools.snapping import MapSnapper
from robocov_app.viewer.tools.tool import ViewerPointerEvent, ViewerToolOverlay, change_map

_MIN_SHIFT_M = 1e-3  # an obstacle that is moved by less stays where it is


class ObstacleDrag(ABC):
    """Base class of drags.

    Parameters
    ----------
    session : Session
        The session, whose map is displayed.
    event : ViewerPointerEvent
        The press with which the drag starts.
    """

    def __init__(self, session: Session, event: ViewerPointerEvent) -> None:
        self._environment = session.displayed.environment
        self._start = event.unsnapped_point
        self._end = event.unsnapped_point

    @abstractmethod
    def update(self, event: ViewerPointerEvent) -> None:
        """Follow the pointer."""

    @abstractmethod
    def build_overlay(self) -> ViewerToolOverlay | None:
        """Return a preview of the result; None if the drag has no result yet."""

    @abstractmethod
    def end(self, session: Session, inspection: Inspection) -> str | None:
        """Apply the result, and select it; return a message, or None if nothing has changed."""

    def is_outdated(self, session: Session) -> bool:
        """Return whether the obstacles have been changed since the drag started."""
        return session.displayed.environment.obstacles != self._environment.obstacles


class MoveDrag(ObstacleDrag):
    """Moves obstacles. Shift keeps a multiple of 45°, Alt makes copies.

    Parameters
    ----------
    session, event
        See `ObstacleDrag`.
    obstacles : tuple of Obstacle
        The obstacles that are moved.
    """

    def __init__(self, session: Session, event: ViewerPointerEvent, obstacles: tuple[Obstacle, ...]) -> None:
        super().__init__(session, event)
        self._obstacles = obstacles
        self._copies = False

    def update(self, event: ViewerPointerEvent) -> None:
        """Follow the pointer."""
        self._copies = event.alt
        self._end = event.constrain(self._start)

    def build_overlay(self) -> ViewerToolOverlay | None:
        """Return the obstacles at their new positions and the distance; None if they have not moved."""
        moved = self._move()
        if not moved:
            return None
        line = (self._start, self._end)
        return ViewerToolOverlay(line, obstacles=moved, label=f"{dist(*line):.2f} m")

    def end(self, session: Session, inspection: Inspection) -> str | None:
        """Move or copy the obstacles."""
        moved = self._move()
        if not moved:
            return None
        name = describe_obstacles(moved)
        if self._copies:
            message = add_obstacles(session, moved, f"{name} copied")
        else:
            message = exchange_obstacles(session, self._obstacles, moved, f"{name} moved")
        inspection.select_obstacles(moved)
        return message

    def _move(self) -> tuple[Obstacle, ...]:
        """Return the obstacles at their new positions; empty if they stay where they are."""
        dx = self._end[0] - self._start[0]
        dy = self._end[1] - self._start[1]
        if np.hypot(dx, dy) < _MIN_SHIFT_M:
            return ()
        return tuple(map_edits.move_obstacle(obstacle, dx, dy) for obstacle in self._obstacles)


class HandleDrag(ObstacleDrag):
    """Changes the shape of an obstacle by one of its handles; see `drag_handle` for Shift and Alt.

    Points snap to the rest of the map; with Ctrl they do not.

    Parameters
    ----------
    session, event
        See `ObstacleDrag`.
    obstacle : Obstacle
        The obstacle.
    handle : ObstacleHandle
        Its handle that was pressed.
    """

    def __init__(
        self, session: Session, event: ViewerPointerEvent, obstacle: Obstacle, handle: ObstacleHandle
    ) -> None:
        super().__init__(session, event)
        self._obstacle = obstacle
        self._handle = handle
        self._changed: Obstacle | None = None
        self._label = ""
        self._snapper = MapSnapper()
        self._others = _remove_obstacle(self._environment, obstacle)

    def update(self, event: ViewerPointerEvent) -> None:
        """Follow the pointer."""
        point = event.unsnapped_point
        if self._handle.kind == "point" and not (event.ctrl or event.shift):
            point = self._snapper.snap(self._others, point, event.reach)
        self._changed = None
        with suppress(RobocovError):
            self._changed = drag_handle(self._obstacle, self._handle, point, shift=event.shift, alt=event.alt)
        self._end = point
        self._label = f"({point[0]:.2f}, {point[1]:.2f}) m"

    def build_overlay(self) -> ViewerToolOverlay | None:
        """Return a preview of the changed obstacle; None if it has not changed."""
        if self._changed is None or self._changed == self._obstacle:
            return None
        return ViewerToolOverlay((self._end,), obstacles=(self._changed,), label=self._label)

    def end(self, session: Session, inspection: Inspection) -> str | None:
        """Change the obstacle."""
        changed = self._changed
        if changed is None or changed == self._obstacle:
            return None
        text = f"{map_edits.describe_obstacle(changed)} changed"
        message = exchange_obstacles(session, (self._obstacle,), (changed,), text)
        inspection.select_obstacles((changed,))
        return message


class BoxDrag(ObstacleDrag):
    """Selects the obstacles in a box; if it is dragged to the left, also those that are partly inside."""

    def update(self, event: ViewerPointerEvent) -> None:
        """Follow the pointer."""
        self._end = event.unsnapped_point

    def build_overlay(self) -> ViewerToolOverlay | None:
        """Return the box."""
        return ViewerToolOverlay(box=(self._start, self._end), selected=self._find_obstacles())

    def end(self, session: Session, inspection: Inspection) -> str | None:
        """Select the obstacles in the box."""
        selected = self._find_obstacles()
        inspection.select_obstacles(selected)
        if not selected:
            return None
        return f"{describe_obstacles(selected)} selected: arrow keys move, Delete deletes"

    def _find_obstacles(self) -> tuple[Obstacle, ...]:
        (x, y), (end_x, end_y) = self._start, self._end
        box = shapely.box(min(x, end_x), min(y, end_y), max(x, end_x), max(y, end_y))
        is_match = box.intersects if end_x < x else box.contains
        return tuple(obstacle for obstacle in self._environment.obstacles if is_match(obstacle.polygon))


def exchange_obstacles(
    session: Session, before: tuple[Obstacle, ...], after: tuple[Obstacle, ...], description: str
) -> str:
    """Replace obstacles of the map by others; return the message.

    Parameters
    ----------
    session : Session
    before : tuple of Obstacle
        Obstacles of the displayed map.
    after : tuple of Obstacle
        What replaces each of them; empty to delete them all.
    description : str
        Description of the change.

    Returns
    -------
    str
    """
    environment = session.displayed.environment
    # A map may contain equal obstacles. Each obstacle in `before` stands for one of them.
    remaining = list(before)
    replacements = list(after)
    obstacles: list[Obstacle] = []
    for obstacle in environment.obstacles:
        if obstacle not in remaining:
            obstacles.append(obstacle)
            continue
        k = remaining.index(obstacle)
        del remaining[k]
        if replacements:
            obstacles.append(replacements.pop(k))
    changed = map_edits.replace_obstacles(environment, 0, len(environment.obstacles), obstacles)
    return change_map(session, changed, description)


def add_obstacles(session: Session, obstacles: tuple[Obstacle, ...], description: str) -> str:
    """Add obstacles to the map; return the message."""
    environment = session.displayed.environment
    changed = map_edits.replace_obstacles(environment, len(environment.obstacles), 0, obstacles)
    return change_map(session, changed, description)


def describe_obstacles(obstacles: tuple[Obstacle, ...]) -> str:
    """Return the kind and name of a single obstacle, or the number of several."""
    if len(obstacles) == 1:
        return map_edits.describe_obstacle(obstacles[0])
    return f"{len(obstacles)} obstacles"


def _remove_obstacle(environment: Environment, obstacle: Obstacle) -> Environment:
    """Return the map without an obstacle, for snapping; the whole map if it cannot be removed."""
    with suppress(RobocovError):
        return map_edits.replace_obstacles(environment, environment.obstacles.index(obstacle), 1)
    return environment
