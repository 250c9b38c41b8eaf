"""Costs of the displayed step: asked for in every frame, added to the curves when they are known."""

import numpy as np

from robocov.arrays import Array
from robocov_app.viewer.model import ViewerModel
from robocov_app.viewer.session.pane import Pane

MAX_INITIAL_GAP_S = 0.3  # a curve that starts later is completed backwards
TIME_TOLERANCE_S = 1e-9


class CostCurves:
    """Asks for the costs of the displayed step, and adds the answers to the curves of the panes.

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
        self._serial = -1  # of the session whose costs were asked for last

    def update(self) -> None:
        """Ask for new costs, and add those that have arrived."""
        session = self._viewer.session
        if session.timeline.past_version != self._serial:
            self._serial = session.timeline.past_version
            self._viewer.costs.forget()
        for pane in session.timeline.panes:
            self._ask_for_pane(pane)
        self._ask_for_first_seconds()
        self._add_answers()

    def _ask_for_pane(self, pane: Pane) -> None:
        """Ask for the cost of a pane, unless it is known and no path to the cursor is shown."""
        session = self._viewer.session
        costs = self._viewer.costs
        positions = session.displayed.get_positions(pane)
        point = self._find_path_target()
        known = costs.known.get(pane.number)
        is_known = (
            known is not None
            and point is None
            and abs(known.time - session.displayed.time) < TIME_TOLERANCE_S
            and np.array_equal(known.result.positions, positions)
        )
        if not is_known:
            costs.ask(
                pane.number,
                session.displayed.time,
                positions,
                point,
                session.displayed.get_setup(pane).speed_limits,
            )

    def _find_path_target(self) -> Array | None:
        """Return the point to which a path is shown, (2,) m."""
        cursor = self._viewer.inspection.cursor
        if cursor is None or "path" not in self._viewer.view.layers:
            return None
        return np.array(cursor)

    def _ask_for_first_seconds(self) -> None:
        """Ask for costs of the first seconds, for which there were no answers yet, every other time."""
        session = self._viewer.session
        if session.timeline.head.kind != "begin" or not session.timeline.is_live:
            return
        if session.playback.is_playing and self.answer_count % 2:
            return
        for pane in session.timeline.panes:
            first = min(pane.distance_curve.times, default=0.0)
            if first <= MAX_INITIAL_GAP_S:
                continue
            target = first - MAX_INITIAL_GAP_S if first > 2 * MAX_INITIAL_GAP_S else 0.0
            index = session.timeline.history.find_index(target)
            state = session.timeline.history[index].states[pane.number]
            time = session.timeline.history.get_time(index)
            self._viewer.costs.ask(
                pane.number, time, state.positions, speeds=state.setup.speed_limits, is_for_curve=True
            )

    def _add_answers(self) -> None:
        for number, known in self._viewer.costs.poll():
            self.answer_count += 1
            for pane in self._viewer.session.timeline.panes:
                if pane.number != number or known.time > pane.time + TIME_TOLERANCE_S:
                    continue
                pane.distance_curve.add(known.time, known.result.mean_distance)
                if known.travel_time is not None:
                    pane.curves["time"].add(known.time, known.travel_time)
