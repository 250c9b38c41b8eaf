"""Actions on the selected robot or obstacle: deleting, duplicating, the width of a wall."""

from dataclasses import replace

import numpy as np

from robocov.environment import Obstacle, WallObstacle
from robocov.errors import ParameterError
from robocov_app.viewer.actions.robots import RobotActions
from robocov_app.viewer.model import ViewerModel
from robocov_app.viewer.session.editing import map_edits
from robocov_app.viewer.tools.obstacle_drags import add_obstacles, describe_obstacles, exchange_obstacles
from robocov_app.viewer.tools.outlines import MAX_WALL_WIDTH_M, MIN_WALL_WIDTH_M

DUPLICATE_OFFSET_M = (0.5, -0.5)
"""Displacement of a duplicate, (x, y)."""
NUDGE_M = 0.05
"""Length by which an arrow key moves the selected obstacles."""
FAR_FACTOR = 10.0
"""Factor by which an arrow key moves them farther with Shift."""
_ARROWS = {"left": (-1.0, 0.0), "right": (1.0, 0.0), "up": (0.0, 1.0), "down": (0.0, -1.0)}


class SelectionActions:
    """Actions on the selected robot or obstacle.

    Parameters
    ----------
    viewer : ViewerModel
        The viewer.
    robots : RobotActions
        Actions on robots.
    """

    def __init__(self, viewer: ViewerModel, robots: RobotActions) -> None:
        self._viewer = viewer
        self._robots = robots

    def delete(self) -> str | None:
        """Delete the selected obstacles, or else remove the selected robot.

        Returns
        -------
        str or None
            Message about the obstacles; None for a robot.
        """
        selected = self._viewer.selected_obstacles
        if not selected:
            self._robots.remove()
            return None
        text = f"{describe_obstacles(selected)} deleted"
        return exchange_obstacles(self._viewer.session, selected, (), text)

    def duplicate(self) -> str:
        """Add a copy of each selected obstacle next to it, and select the copies; return a message."""
        copies = self._build_moved_copies(*DUPLICATE_OFFSET_M)
        name = describe_obstacles(copies)
        message = add_obstacles(self._viewer.session, copies, f"{name} duplicated")
        self._viewer.inspection.select_obstacles(copies)
        return message

    def nudge(self, dx: float, dy: float) -> str:
        """Move the selected obstacles by dx and dy, m; return a message."""
        before = self._require_obstacles()
        moved = self._build_moved_copies(dx, dy)
        name = describe_obstacles(moved)
        message = exchange_obstacles(self._viewer.session, before, moved, f"{name} moved")
        self._viewer.inspection.select_obstacles(moved)
        return message

    def nudge_by_key(self, key: str) -> bool:
        """Move the selected obstacles by an arrow key, with Shift ten times as far.

        Parameters
        ----------
        key : str
            Name of the key.

        Returns
        -------
        bool
            Whether the key was used.
        """
        direction = _ARROWS.get(key.removeprefix("shift+"))
        viewer = self._viewer
        is_selecting = viewer.tool is viewer.toolbox.hand and bool(viewer.selected_obstacles)
        if direction is None or not is_selecting:
            return False
        length = NUDGE_M
        if key.startswith("shift+"):
            length *= FAR_FACTOR
        viewer.attempt(lambda: self.nudge(length * direction[0], length * direction[1]))
        return True

    def _build_moved_copies(self, dx: float, dy: float) -> tuple[Obstacle, ...]:
        """Return copies of the selected obstacles, moved by dx and dy, m."""
        return tuple(map_edits.move_obstacle(obstacle, dx, dy) for obstacle in self._require_obstacles())

    @property
    def has_wall(self) -> bool:
        """Whether a wall alone is selected."""
        selected = self._viewer.selected_obstacles
        return len(selected) == 1 and isinstance(selected[0], WallObstacle)

    def scale_wall_width(self, factor: float) -> str:
        """Multiply the width of the selected wall by a factor; return a message."""
        wall = self._require_obstacles()[0]
        if not isinstance(wall, WallObstacle):
            raise ParameterError("the selected obstacle is not a wall")
        width = float(np.clip(round(wall.width * factor, 3), MIN_WALL_WIDTH_M, MAX_WALL_WIDTH_M))
        changed = replace(wall, width=width)
        text = f"{map_edits.describe_obstacle(wall)}: {width:g} m wide"
        message = exchange_obstacles(self._viewer.session, (wall,), (changed,), text)
        self._viewer.inspection.select_obstacles((changed,))
        return message

    def _require_obstacles(self) -> tuple[Obstacle, ...]:
        selected = self._viewer.selected_obstacles
        if not selected:
            raise ParameterError("no obstacle is selected: click one first")
        return selected
