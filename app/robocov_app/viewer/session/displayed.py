"""The displayed state of a session: the present, or a recorded state of the past."""

from contextlib import suppress

import numpy as np

from robocov.environment import Environment
from robocov.errors import RobocovError
from robocov.metrics import SETTLED_WINDOW_S
from robocov.observation import Snapshot
from robocov.typing import FloatArray
from robocov_app.viewer.session.pane import Pane, resume_simulation, select_working
from robocov_app.viewer.session.past.decision_replay import has_same_forces, rebuild_snapshot
from robocov_app.viewer.session.past.states import PaneSetup, PaneState
from robocov_app.viewer.session.past.trails import MAX_TRAIL_RATE_HZ
from robocov_app.viewer.session.timeline import Timeline

_TARGET_RECENT_POSITIONS = 30
"""Approximate number of positions that `get_recent_positions` returns: up to twice as many."""
MAX_TRAIL_GAP_S = 1.5 / MAX_TRAIL_RATE_HZ
"""If the last row of a trail is older than this, the displayed positions are appended to it."""


class DisplayedState:
    """The state that a timeline displays.

    Parameters
    ----------
    timeline : Timeline
        The timeline.
    """

    def __init__(self, timeline: Timeline) -> None:
        self._timeline = timeline

    @property
    def time(self) -> float:
        """Displayed time, s."""
        return self._timeline.history.get_time(self._timeline.displayed_index)

    @property
    def environment(self) -> Environment:
        """The map, without failed robots."""
        return self.get_setup(self._timeline.panes[0]).environment

    @property
    def numbers(self) -> tuple[int, ...]:
        """Numbers of the working robots."""
        return self.get_setup(self._timeline.panes[0]).numbers

    def get_setup(self, pane: Pane) -> PaneSetup:
        """Return the setup of a pane in the displayed state."""
        return self._get_state(pane).setup

    def get_positions(self, pane: Pane) -> FloatArray:
        """Return the positions of the robots of a pane, (n, 2) m."""
        if self._timeline.is_live:
            return pane.positions
        return self._get_state(pane).positions

    def get_snapshot(self, pane: Pane) -> Snapshot:
        """Return the observations and decision of a pane; the forces are zero if the controller raises."""
        if self._timeline.is_live:
            with suppress(RobocovError):
                return pane.observe_and_decide()
        state = self._get_state(pane)
        dt = self._timeline.scenario.dt
        if state.setup.follows_schedule:
            with suppress(RobocovError):
                simulation = resume_simulation(state, dt, round(self.time / dt))
                snapshot = select_working(simulation.observe_and_decide(), state.setup)
                if state.recorded is None or has_same_forces(snapshot.decision, state.recorded):
                    return snapshot
            # The state cannot be resumed as recorded: show the working robots alone. The recorded memory and
            # messages do not fit them, because they are those of all robots.
            state = state._replace(memory=None, inbox=None)
        return rebuild_snapshot(state, self.time, dt)

    def get_trail(self, pane: Pane) -> tuple[FloatArray, FloatArray]:
        """Return the trajectories of a pane up to the displayed time.

        Parameters
        ----------
        pane : Pane
            The pane.

        Returns
        -------
        positions : (k, n, 2) array, m
            Positions of the working robots, then of the failed ones, which are nan from their failure on.
        times : (k,) array, s
        """
        positions, times = pane.trail.get_until(self.time)
        if self._timeline.is_live or self.time - times[-1] <= MAX_TRAIL_GAP_S:
            return positions, times
        # Rows on a straight section may have been removed; append the displayed positions, so that the
        # trajectories lead up to the robots.
        last = np.full((1, *positions.shape[1:]), np.nan)
        displayed = self.get_positions(pane)
        last[0, : len(displayed)] = displayed
        return np.concatenate([positions, last]), np.append(times, self.time)

    def get_recent_positions(self, pane: Pane, number: int) -> FloatArray:
        """Return positions of a robot during the last `SETTLED_WINDOW_S` before the displayed time.

        Parameters
        ----------
        pane : Pane
            The pane.
        number : int
            Number of the robot.

        Returns
        -------
        (k, 2) array, m
            Positions, oldest first, without times at which the robot was not working.
        """
        history = self._timeline.history
        last = self._timeline.displayed_index
        first = history.find_index(self.time - SETTLED_WINDOW_S)
        stride = max(1, (last - first) // _TARGET_RECENT_POSITIONS)
        positions = []
        for index in range(first, last + 1, stride):
            state = history[index].states.get(pane.number)
            if state is not None and number in state.setup.numbers:
                positions.append(state.positions[state.setup.numbers.index(number)])
        return np.array(positions).reshape(-1, 2)

    def get_costs(self, quantity: str = "distance") -> tuple[float, dict[int, float]]:
        """Return the coverage costs of all panes at the latest time at which all are known.

        Parameters
        ----------
        quantity : str
            ``"distance"`` or ``"time"``.

        Returns
        -------
        time : float, s
            The time of the costs, which is at most the displayed time.
        costs : dict of int to float
            Cost of each pane, by its number; panes without a known cost are missing.
        """
        panes = [pane for pane in self._timeline.panes if len(pane.curves[quantity])]
        time = min([self.time, *(pane.curves[quantity].last_time for pane in panes)])
        costs = {}
        for pane in panes:
            cost = pane.curves[quantity].interpolate(time)
            if np.isfinite(cost):
                costs[pane.number] = cost
        return time, costs

    def _get_state(self, pane: Pane) -> PaneState:
        return self._timeline.history[self._timeline.displayed_index].states[pane.number]
