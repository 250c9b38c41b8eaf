"""Costs of the displayed step, which are requested in every frame and added to the curves on arrival."""

import numpy as np

from robocov.arrays import Array
from robocov_app.viewer.model import ViewerModel
from robocov_app.viewer.session.pane import Pane

MAX_INITIAL_GAP_S = 0.3  # if a curve starts later than this, earlier costs are requested
TIME_TOLERANCE_S = 1e-9


class CostCurves:
    """Requests the costs of the displayed step, and adds the answers to the curves of the panes.

    Parameters
    ----------
    viewer : ViewerModel
        The viewer.

    Attributes
    ----------
    answer_count : int
        Number of answers so far.
    """

    def __init__(self, viewer: ViewerModel) -> None:
        self.answer_count = 0
        self._viewer = viewer
        self._past_version = -1  # of the timeline at the last request

    def update(self) -> None:
        """Request the costs of the displayed step, and add those that have arrived to the curves."""
        session = self._viewer.session
        if session.timeline.past_version != self._past_version:
            self._past_version = session.timeline.past_version
            self._viewer.costs.forget()
        for pane in session.timeline.panes:
            self._request_pane_cost(pane)
        self._request_first_seconds()
        self._add_answers()

    def _request_pane_cost(self, pane: Pane) -> None:
        """Request the cost of a pane at the displayed step, unless the latest answer is still valid.

        While the path to the cursor is shown, the cost is requested in every frame, because the cursor moves.
        """
        session = self._viewer.session
        costs = self._viewer.costs
        positions = session.displayed.get_positions(pane)
        path_target = self._find_path_target()
        latest = costs.known.get(pane.number)
        is_valid = (
            latest is not None
            and path_target is None
            and abs(latest.time - session.displayed.time) < TIME_TOLERANCE_S
            and np.array_equal(latest.result.positions, positions)
        )
        if not is_valid:
            costs.request(
                pane.number,
                session.displayed.time,
                positions,
                path_target,
                session.displayed.get_setup(pane).speed_limits,
            )

    def _find_path_target(self) -> Array | None:
        """Return the point whose path to its nearest robot is shown, (2,) m; None if no path is shown."""
        cursor = self._viewer.inspection.cursor
        if cursor is None or "path" not in self._viewer.view.layers:
            return None
        return np.array(cursor)

    def _request_first_seconds(self) -> None:
        """Request costs of the first seconds, which had passed before costs could be computed on the map.

        They are requested backwards in time from the first known cost. While the run plays, requests for them
        alternate with those for the displayed step.
        """
        session = self._viewer.session
        if not session.timeline.is_live:
            return
        if session.playback.is_playing and self.answer_count % 2:
            return
        history = session.timeline.history
        for pane in session.timeline.panes:
            first_time = min(pane.distance_curve.times, default=0.0)
            if first_time <= MAX_INITIAL_GAP_S:
                continue
            target = 0.0
            if first_time > 2 * MAX_INITIAL_GAP_S:
                target = first_time - MAX_INITIAL_GAP_S
            index = history.find_index(target)
            state = history[index].states.get(pane.number)
            # Costs can only be computed on the displayed map.
            if state is None or state.setup.environment is not session.displayed.environment:
                continue
            self._viewer.costs.request(
                pane.number,
                history.get_time(index),
                state.positions,
                speeds=state.setup.speed_limits,
                is_for_curve=True,
            )

    def _add_answers(self) -> None:
        for number, known_cost in self._viewer.costs.poll():
            self.answer_count += 1
            for pane in self._viewer.session.timeline.panes:
                if pane.number != number or known_cost.time > pane.time + TIME_TOLERANCE_S:
                    continue
                pane.distance_curve.add(known_cost.time, known_cost.result.mean_distance)
                if known_cost.travel_time is not None:
                    pane.curves["time"].add(known_cost.time, known_cost.travel_time)
