"""Tools that act on a single click: deleting, adding a robot, letting a robot fail."""

from robocov_app.viewer.session.editing import map_edits
from robocov_app.viewer.session.session import Session, toggle_failure
from robocov_app.viewer.tools.tool import ViewerPointerEvent, ViewerTool, delete_obstacle

ERASE_REACH_FRACTION = 0.5  # fraction of the reach within which a click deletes an obstacle

_NOTHING_TO_DELETE = "nothing to delete here: choose an obstacle or a robot"
_NO_ROBOT_TO_FAIL = "no robot here: choose a robot to make it fail"


class EraserTool(ViewerTool):
    """Deletes robots and obstacles."""

    name = "eraser"
    title = "Delete"
    key = "x"
    hint = "click an obstacle or a robot to delete it"
    touch_hint = "tap an obstacle or a robot to delete it"
    takes_robots = True

    def press(self, session: Session, event: ViewerPointerEvent) -> str | None:
        """Delete the robot under the cursor, otherwise the obstacle; show a hint if there is neither."""
        if event.robot is not None:
            session.remove_robot(event.robot)
            return f"robot {event.robot} removed"
        reach = ERASE_REACH_FRACTION * event.reach
        index = map_edits.find_obstacle(session.displayed.environment, event.unsnapped_point, reach)
        if index is None:
            return _NOTHING_TO_DELETE
        return delete_obstacle(session, index)


class AddRobotTool(ViewerTool):
    """Adds robots to the team."""

    name = "robot"
    title = "Add robot"
    key = "a"
    hint = "click where a robot should join"
    touch_hint = "tap where a robot should join"

    def press(self, session: Session, event: ViewerPointerEvent) -> str | None:
        """Add a robot at the free position nearest to the cursor."""
        return f"robot {session.add_robot(event.unsnapped_point)} joined"


class FailureTool(ViewerTool):
    """Makes robots fail, and revives them."""

    name = "failure"
    title = "Fail robot"
    key = "d"
    hint = "click a robot to make it fail; click it again to revive it"
    touch_hint = "tap a robot to make it fail; tap it again to revive it"
    takes_robots = True

    def press(self, session: Session, event: ViewerPointerEvent) -> str | None:
        """Make the robot under the cursor fail, or revive it; show a hint if there is none."""
        if event.robot is None:
            return _NO_ROBOT_TO_FAIL
        return toggle_failure(session, event.robot)
