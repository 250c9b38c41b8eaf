"""Tools that act on a single click: deleting, adding a robot, letting a robot fail."""

from robocov_app.viewer.session.editing import map_edits
from robocov_app.viewer.session.session import Session, toggle_failure
from robocov_app.viewer.tools.tool import ViewerPointerEvent, ViewerTool, delete_obstacle

ERASE_REACH_FRACTION = 0.5  # fraction of the reach within which a click deletes an obstacle


class EraserTool(ViewerTool):
    """Deletes robots and obstacles."""

    name = "eraser"
    title = "Delete"
    key = "x"
    hint = "click an obstacle or a robot to delete it"
    takes_robots = True

    def press(self, session: Session, event: ViewerPointerEvent) -> str | None:
        """Delete the robot under the cursor; if there is none, delete the obstacle."""
        if event.robot is not None:
            session.remove_robot(event.robot)
            return f"robot {event.robot} removed"
        reach = ERASE_REACH_FRACTION * event.reach
        index = map_edits.find_obstacle(session.displayed.environment, event.unsnapped_point, reach)
        if index is None:
            return None
        return delete_obstacle(session, index)


class AddRobotTool(ViewerTool):
    """Adds robots to the team."""

    name = "robot"
    title = "Add robot"
    key = "a"
    hint = "click where a robot should join"

    def press(self, session: Session, event: ViewerPointerEvent) -> str | None:
        """Add a robot at the free position nearest to the cursor."""
        return f"robot {session.add_robot(event.unsnapped_point)} joined"


class FailureTool(ViewerTool):
    """Lets robots fail, and revives them."""

    name = "failure"
    title = "Failure"
    key = "d"
    hint = "click a robot to make it fail; click it again to revive it"
    takes_robots = True

    def press(self, session: Session, event: ViewerPointerEvent) -> str | None:
        """Let the robot under the cursor fail, or revive it."""
        if event.robot is None:
            return None
        return toggle_failure(session, event.robot)
