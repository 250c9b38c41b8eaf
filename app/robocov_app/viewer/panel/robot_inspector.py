"""Updates the report on the selected robot while it is visible."""

from robocov_app.viewer.explanation.explain import explain_robot
from robocov_app.viewer.panel.panel import ViewerPanel
from robocov_app.viewer.presenter import Presenter

REPORT_INTERVAL_S = 0.2  # minimum time between two reports


class RobotInspector:
    """Keeps the report on the selected robot in the panel up to date.

    Parameters
    ----------
    viewer : Presenter
        The viewer.
    panel : ViewerPanel
        The panel.
    """

    def __init__(self, viewer: Presenter, panel: ViewerPanel) -> None:
        self._viewer = viewer
        self._panel = panel
        self._explained: object = None  # robot, time and version of the session in the latest report
        self._explained_at = 0.0

    def update(self, now: float) -> None:
        """Build a new report if the robot's state has changed and the report is old enough.

        Parameters
        ----------
        now : float
            Time since the window was opened, s.
        """
        viewer = self._viewer
        number = viewer.selected_robot
        if number is None or self._panel.tab != "robot" or self._panel.hidden:
            self._panel.report = None
            return
        session = viewer.session
        state = (number, session.displayed.time, session.timeline.past_version, viewer.revision)
        is_old = state != self._explained and now - self._explained_at >= REPORT_INTERVAL_S
        if self._panel.report is None or is_old:
            self._explained = state
            self._explained_at = now
            self._panel.report = explain_robot(viewer, number)
