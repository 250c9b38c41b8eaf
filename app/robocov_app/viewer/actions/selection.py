"""Actions on the selected robot or obstacle: deleting, duplicating, the width of a wall."""

from dataclasses import replace

import numpy as np

from robocov.environment import WallObstacle
from robocov.errors import ParameterError
from robocov_app.viewer.actions.robots import RobotActions
from robocov_app.viewer.model import ViewerModel
from robocov_app.viewer.session import map_edits
from robocov_app.viewer.tools.outlines import MAX_WALL_WIDTH_M, MIN_WALL_WIDTH_M
from robocov_app.viewer.tools.tool import change_map, delete_obstacle

DUPLICATE_OFFSET_M = (0.5, -0.5)
"""Displacement of a duplicate, (x, y)."""


class SelectionActions:
    """Actions on what is selected: a robot or an obstacle.

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
        """Delete the selected obstacle, or remove the selected robot; return a message."""
        index = self._viewer.selected_obstacle
        if index is None:
            self._robots.remove()
            return None
        return delete_obstacle(self._viewer.session, index)

    def duplicate(self) -> str:
        """Add a copy of the selected obstacle next to it, and select the copy; return a message."""
        index = self._require_obstacle()
        session = self._viewer.session
        copy = map_edits.move_obstacle(session.displayed.environment.obstacles[index], *DUPLICATE_OFFSET_M)
        environment = map_edits.add_obstacle(session.displayed.environment, copy)
        message = change_map(session, environment, f"{map_edits.describe_obstacle(copy)} duplicated")
        self._viewer.inspection.select_obstacle(copy)
        return message

    @property
    def has_wall(self) -> bool:
        """Whether a wall is selected."""
        index = self._viewer.selected_obstacle
        if index is None:
            return False
        return isinstance(self._viewer.session.displayed.environment.obstacles[index], WallObstacle)

    def scale_wall_width(self, factor: float) -> str:
        """Multiply the width of the selected wall by a factor; return a message."""
        index = self._require_obstacle()
        session = self._viewer.session
        wall = session.displayed.environment.obstacles[index]
        if not isinstance(wall, WallObstacle):
            raise ParameterError("the selected obstacle is not a wall")
        width = float(np.clip(round(wall.width * factor, 3), MIN_WALL_WIDTH_M, MAX_WALL_WIDTH_M))
        changed = replace(wall, width=width)
        environment = map_edits.replace_obstacles(session.displayed.environment, index, 1, [changed])
        message = change_map(session, environment, f"{map_edits.describe_obstacle(wall)}: {width:g} m wide")
        self._viewer.inspection.select_obstacle(changed)
        return message

    def _require_obstacle(self) -> int:
        index = self._viewer.selected_obstacle
        if index is None:
            raise ParameterError("no obstacle is selected: click one first")
        return index
