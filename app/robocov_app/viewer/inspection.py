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
    obstacles : tuple of Obstacle
        The selected obstacles, which may have been changed or removed in the meantime.
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
    obstacles: tuple[Obstacle, ...] = ()
    followed: int | None = None
    active_pane: int = 0
    cursor: Point | None = None
    cursor_pane: int = 0

    def select_robot(self, number: int) -> None:
        """Select a robot, and deselect all obstacles."""
        self.selected = number
        self.obstacles = ()

    def select_obstacles(self, obstacles: tuple[Obstacle, ...]) -> None:
        """Select these obstacles, and deselect everything else."""
        self.selected = None
        self.obstacles = obstacles

    def toggle_obstacle(self, obstacle: Obstacle) -> None:
        """Add an obstacle to the selection; remove it if it is selected already."""
        if obstacle in self.obstacles:
            self.obstacles = tuple(other for other in self.obstacles if other != obstacle)
        else:
            self.select_obstacles((*self.obstacles, obstacle))

    def clear(self) -> bool:
        """Select nothing; return whether something was selected."""
        had_selection = self.selected is not None or bool(self.obstacles)
        self.selected = None
        self.obstacles = ()
        return had_selection
