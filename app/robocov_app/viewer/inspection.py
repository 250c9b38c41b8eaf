"""Inspected items: a robot or an obstacle, a pane, and the point under the cursor."""

from dataclasses import dataclass

from robocov.environment import Obstacle, Point


@dataclass
class Inspection:
    """Robot or obstacle, pane and point that the user inspects.

    Attributes
    ----------
    selected : int or None
        Number of the selected robot, which may have been removed in the meantime.
    obstacle : Obstacle or None
        The selected obstacle, which may have been changed or removed in the meantime.
    followed : int or None
        Number of the robot that the camera follows.
    active_pane : int
        Index of the pane whose controller and gains are edited.
    cursor : Point or None
        Point of the map under the cursor, m.
    cursor_pane : int
        Index of the pane under the cursor.
    """

    selected: int | None = None
    obstacle: Obstacle | None = None
    followed: int | None = None
    active_pane: int = 0
    cursor: Point | None = None
    cursor_pane: int = 0

    def select_robot(self, number: int) -> None:
        """Select a robot instead of what was selected before."""
        self.selected = number
        self.obstacle = None

    def select_obstacle(self, obstacle: Obstacle) -> None:
        """Select an obstacle instead of what was selected before."""
        self.selected = None
        self.obstacle = obstacle

    def clear(self) -> bool:
        """Select nothing; return whether something was selected."""
        had_selection = self.selected is not None or self.obstacle is not None
        self.selected = None
        self.obstacle = None
        return had_selection
