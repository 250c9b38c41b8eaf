"""Actions on single robots: selecting, failing, reviving, removing."""

from robocov.errors import ParameterError
from robocov_app.viewer.model import ViewerModel
from robocov_app.viewer.session.session import toggle_failure


class RobotActions:
    """Actions that select a robot and change the selected one.

    Parameters
    ----------
    viewer : ViewerModel
        The viewer.
    """

    def __init__(self, viewer: ViewerModel) -> None:
        self._viewer = viewer

    def select(self, number: int) -> None:
        """Select a robot to inspect it.

        Raises
        ------
        ParameterError
            If there is no robot with that number.
        """
        if number not in self._viewer.robot_numbers:
            raise ParameterError(f"there is no robot {number}")
        self._viewer.inspection.select_robot(number)

    def select_next(self, steps: int) -> None:
        """Select the robot that is `steps` places further in the order of their numbers, cyclically."""
        numbers = self._viewer.robot_numbers
        selected = self._viewer.selected_robot
        if selected is not None:
            index = numbers.index(selected)
        else:
            # So that the first selection is the first robot forwards, and the last robot backwards.
            index = -1 if steps > 0 else 0
        self._viewer.inspection.select_robot(numbers[(index + steps) % len(numbers)])

    def fail_or_revive(self) -> None:
        """Make the selected robot fail, or revive it."""
        toggle_failure(self._viewer.session, self._require_selected())

    def remove(self) -> None:
        """Remove the selected robot from the team."""
        self._viewer.session.remove_robot(self._require_selected())

    def add_at_cursor(self) -> str:
        """Add a robot at the free position nearest to the cursor; return a message."""
        cursor = self._viewer.inspection.cursor
        if cursor is None:
            raise ParameterError("move the mouse to where the robot should join")
        return f"robot {self._viewer.session.add_robot(cursor)} joined"

    def toggle_following(self) -> str:
        """Let the camera follow the selected robot, or stop following; return a message."""
        inspection = self._viewer.inspection
        number = self._require_selected()
        if inspection.followed == number:
            inspection.followed = None
            return f"the view no longer follows robot {number}"
        if number not in self._viewer.session.displayed.numbers:
            raise ParameterError(f"robot {number} has failed: revive it first")
        inspection.followed = number
        return f"the view follows robot {number}; panning or F stops it"

    def _require_selected(self) -> int:
        selected = self._viewer.selected_robot
        if selected is None:
            raise ParameterError("no robot is selected: click one first, or press I")
        return selected
