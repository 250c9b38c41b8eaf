"""Commands of the context menu of a robot, a wall, another obstacle, or the floor."""

from robocov_app.viewer.presenter import Presenter

ROBOT_COMMANDS = ("robot:fail", "robot:follow", "", "robot:remove")
WALL_COMMANDS = ("wider", "narrower", "", "duplicate", "delete")
OBSTACLE_COMMANDS = ("duplicate", "delete")
FLOOR_COMMANDS = ("robot:add", "", "undo", "redo", "", "fit")


def list_menu_commands(viewer: Presenter) -> tuple[str, ...]:
    """Return the names of the commands for the selection; an empty name separates two groups."""
    if viewer.selected_robot is not None:
        return ROBOT_COMMANDS
    if viewer.selection.has_wall:
        return WALL_COMMANDS
    if viewer.selected_obstacles:
        return OBSTACLE_COMMANDS
    return FLOOR_COMMANDS
