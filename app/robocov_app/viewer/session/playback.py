"""Playback of a session: how it advances with real time."""

import numpy as np

from robocov.errors import RobocovError
from robocov_app.viewer.session.clock import Clock
from robocov_app.viewer.session.timeline import Timeline

SEEK_SLICE_S = 0.03
"""Computing time per frame for a seek to another state of the session."""


class Playback:
    """Plays a timeline: first the recorded past, then by simulating.

    Parameters
    ----------
    timeline : Timeline
        The timeline.

    Attributes
    ----------
    clock : Clock
        Speed, and computing time per frame.
    is_playing : bool
        Whether the session plays rather than pauses.
    stop_when_settled : bool
        Whether to pause when the team has settled.
    is_suspended : bool
        Whether playing waits until a dialog or page that covers the map is closed.
    """

    def __init__(self, timeline: Timeline) -> None:
        self._timeline = timeline
        self.clock = Clock(timeline.scenario.dt)
        self.is_playing = True
        self.stop_when_settled = False
        self.is_suspended = False

    @property
    def seek_seconds(self) -> float:
        """Maximum computing time of `Timeline.seek` in one frame, s."""
        if np.isinf(self.clock.budget):
            return np.inf
        return SEEK_SLICE_S

    def advance(self, seconds: float) -> int:
        """Advance by real time: continue a seek, play the recorded past, or simulate.

        Parameters
        ----------
        seconds : float, s
            Real time since the previous call.

        Returns
        -------
        int
            Number of steps that were simulated or displayed.

        Raises
        ------
        RobocovError
            If a controller raises it; playback then pauses.
        """
        if self._timeline.is_seeking:
            self._timeline.continue_seek(SEEK_SLICE_S)
            return 0
        if not self.is_playing or self.is_suspended:
            return 0
        self.clock.dt = self._timeline.scenario.dt
        return self.clock.advance(seconds, self._play_step)

    def step(self) -> None:
        """Pause, and display the next recorded state, or simulate one step."""
        self.is_playing = False
        timeline = self._timeline
        if timeline.is_live:
            timeline.advance()
        else:
            timeline.show(timeline.displayed_index + 1)

    def _play_step(self) -> bool:
        """Play one step, and return whether to continue."""
        timeline = self._timeline
        if not timeline.is_live:
            timeline.show_next()
            if timeline.is_live and timeline.is_at_record_end:
                # Pause at the end of a record; the user decides whether to continue by simulating.
                self.is_playing = False
            return self.is_playing
        try:
            timeline.advance()
        except RobocovError:
            self.is_playing = False
            raise
        if self.stop_when_settled and timeline.is_settled:
            self.is_playing = False
        return self.is_playing
