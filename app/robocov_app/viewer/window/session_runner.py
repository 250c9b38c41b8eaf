"""Advances the session of the window with real time, and reports why it stops."""

from robocov.errors import RobocovError
from robocov_app.viewer.key_hints import explain_record_end
from robocov_app.viewer.model import ViewerModel, simplify_message

STEP_RATE_WEIGHT = 0.1  # weight of the newest frame in the moving average of the step rate


class SessionRunner:
    """Simulates the session of a viewer, or plays its past.

    Parameters
    ----------
    viewer : ViewerModel
        The viewer.

    Attributes
    ----------
    step_rate : float
        Moving average of the number of steps per second.
    """

    def __init__(self, viewer: ViewerModel) -> None:
        self.step_rate = 0.0
        self._viewer = viewer

    def advance(self, seconds: float, slices: int) -> None:
        """Advance the session by real time.

        Parameters
        ----------
        seconds : float
            Real time since the last call, s.
        slices : int
            Number of equal parts in which the time is simulated, normally 1.
        """
        viewer = self._viewer
        session = viewer.session
        was_playing = session.playback.is_playing
        steps = self._simulate(seconds, slices)
        if session.timeline.is_settled:
            viewer.settled_change = session.timeline.head
        if session.playback.is_playing != was_playing:
            viewer.revision += 1
            self._report_end()
        if seconds > 0 and not session.playback.is_suspended:
            self.step_rate += STEP_RATE_WEIGHT * (steps / seconds - self.step_rate)
        viewer.update_cost_map()

    def _simulate(self, seconds: float, slices: int) -> int:
        """Simulate; show errors that controllers raise. Return the number of steps."""
        session = self._viewer.session
        try:
            steps = sum(session.playback.advance(seconds / slices) for _ in range(slices))
            # Let controllers decide here rather than while drawing, so that their errors are caught.
            for pane in session.timeline.panes:
                session.displayed.get_snapshot(pane)
        except RobocovError as error:
            self._viewer.show_message(simplify_message(str(error)), is_error=True)
            return 0
        return steps

    def _report_end(self) -> None:
        """Show why playback has stopped."""
        viewer = self._viewer
        timeline = viewer.session.timeline
        if timeline.is_settled:
            viewer.show_message(f"settled at {viewer.session.displayed.time:.1f} s")
        elif timeline.is_at_record_end and timeline.is_live and not viewer.has_error_message:
            viewer.show_message(explain_record_end(viewer.view))
