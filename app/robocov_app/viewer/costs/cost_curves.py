"""Costs of the displayed step, which are requested in every frame and added to the curves on arrival."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from robocov.environment import Environment
from robocov.typing import FloatArray
from robocov_app.viewer.costs.costs import Costs, KnownCost
from robocov_app.viewer.model import ViewerModel
from robocov_app.viewer.session.pane import Pane
from robocov_app.viewer.session.past.states import PaneSetup

MAX_GAP_S = 0.3
"""Longer intervals without samples are filled in short curves."""
MAX_GAP_FRACTION = 1 / 150
"""Intervals that are longer than this fraction of the curve are filled in long curves."""
TIME_TOLERANCE_S = 1e-9


class _MissingState(NamedTuple):
    """State of a pane whose cost is not in its curve yet.

    Attributes
    ----------
    pane : int
        Number of the pane.
    time : float, s
    positions : (n, 2) array, m
    setup : PaneSetup
        Map, team and controller at that time.
    radius : float, m
        Radius of the smallest robot of all panes at that time.
    """

    pane: int
    time: float
    positions: FloatArray
    setup: PaneSetup
    radius: float

    @property
    def environment(self) -> Environment:
        """The map at that time."""
        return self.setup.environment


class CostCurves:
    """Requests the costs of the displayed step, and adds the answers to the curves of the panes.

    Parameters
    ----------
    viewer : ViewerModel
        The viewer.

    Attributes
    ----------
    answer_count : int
        Number of answers so far, about the displayed map and about earlier maps.
    """

    def __init__(self, viewer: ViewerModel) -> None:
        self.answer_count = 0
        self._viewer = viewer
        self._past_version = -1  # of the timeline at the last request
        # Numbers of panes whose next request is for the displayed step instead of an earlier one.
        self._panes_due_for_displayed_step: set[int] = set()
        # Numbers of panes, and times at which their cost is not finite and thus never in a curve.
        self._without_cost: set[tuple[int, float]] = set()
        self._earlier_costs: Costs | None = None
        self._earlier_map: Environment | None = None

    def update(self) -> None:
        """Request the costs of the displayed step, and add those that have arrived to the curves."""
        session = self._viewer.session
        if session.timeline.past_version != self._past_version:
            self._past_version = session.timeline.past_version
            self._without_cost.clear()
            self._viewer.costs.forget()
            if self._earlier_costs is not None:
                self._earlier_costs.forget()
        for pane in session.timeline.panes:
            self._request_pane_cost(pane)
        self._request_missing_costs()
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

    def _find_path_target(self) -> FloatArray | None:
        """Return the point whose path to its nearest robot is shown, (2,) m; None if no path is shown."""
        cursor = self._viewer.inspection.cursor
        if cursor is None or "path" not in self._viewer.view.layers:
            return None
        return np.array(cursor)

    def _request_missing_costs(self) -> None:
        """Request costs of earlier steps that the curves lack.

        These steps were simulated before costs could be computed on the map, or faster than costs are
        computed. If the map was edited meanwhile, costs on the earlier map are computed by another process.
        """
        session = self._viewer.session
        if not session.timeline.is_live or self._viewer.costs.state:
            return
        found = [self._find_missing_state(pane) for pane in session.timeline.panes]
        missing = [state for state in found if state is not None]
        displayed_map = session.displayed.environment
        for state in missing:
            if state.environment is displayed_map:
                self._request_on_displayed_map(state)
        earlier = [state for state in missing if state.environment is not displayed_map]
        if earlier:
            self._request_on_earlier_map(earlier)
        elif not missing:
            self.close()

    def _find_missing_state(self, pane: Pane) -> _MissingState | None:
        """Return the next state whose cost the curve of a pane lacks; None if the curve is complete.

        The first one is the start, unless its cost is not finite, so that the curve begins at time 0. The
        others halve the longest gaps.
        """
        curve = pane.distance_curve
        if curve.first_time > TIME_TOLERANCE_S:
            state = self._get_state(pane.number, 0.0)
            if state is not None:
                # The cost of the displayed step is requested anyway.
                is_requested = state.time == self._viewer.session.displayed.time
                return None if is_requested else state
        min_length = max(MAX_GAP_S, MAX_GAP_FRACTION * curve.last_time)
        for start, end in curve.list_gaps(min_length):
            state = self._get_state(pane.number, 0.5 * (start + end))
            # If the history was thinned, it may contain no state within the gap.
            if state is not None and state.time > start + TIME_TOLERANCE_S:
                return state
        return None

    def _get_state(self, pane_number: int, time: float) -> _MissingState | None:
        """Return the recorded state of a pane at or before a time, s; None without a finite cost."""
        history = self._viewer.session.timeline.history
        index = history.find_index(time)
        states = history[index].states
        state = states.get(pane_number)
        state_time = history.get_time(index)
        if state is None or (pane_number, state_time) in self._without_cost:
            return None
        radius = min(other.setup.team.min_radius for other in states.values())
        return _MissingState(pane_number, state_time, state.positions, state.setup, radius)

    def _request_on_displayed_map(self, state: _MissingState) -> None:
        """Request the cost of an earlier state on the displayed map.

        While the run plays, these requests alternate with those for the displayed step of the same pane.
        """
        is_displayed_step_due = state.pane in self._panes_due_for_displayed_step
        if self._viewer.session.playback.is_playing and is_displayed_step_due:
            return
        _request_for_curve(self._viewer.costs, state)

    def _request_on_earlier_map(self, states: Sequence[_MissingState]) -> None:
        """Request the costs of states on the newest of their maps, unless another request is pending."""
        newest = max(states, key=lambda state: state.time)
        costs = self._earlier_costs
        if costs is None:
            costs = self._viewer.costs.create_similar()
            self._earlier_costs = costs
        if self._earlier_map is not newest.environment:
            self._earlier_map = newest.environment
            costs.set_environment(newest.environment, newest.radius)
        if not costs.is_idle:
            return
        for state in states:
            if state.environment is newest.environment:
                _request_for_curve(costs, state)

    def close(self) -> None:
        """End the process that computes costs on earlier maps."""
        if self._earlier_costs is not None:
            self._earlier_costs.close()
        self._earlier_costs = None
        self._earlier_map = None

    def _add_answers(self) -> None:
        """Add the costs that have arrived to the curves of the panes."""
        answers = self._viewer.costs.poll()
        # Each pane has its own turns. With common ones, two panes would always have the same one.
        for number, _ in answers:
            self._panes_due_for_displayed_step ^= {number}
        if self._earlier_costs is not None:
            answers += self._earlier_costs.poll()
        self.answer_count += len(answers)
        panes = {pane.number: pane for pane in self._viewer.session.timeline.panes}
        for number, known_cost in answers:
            pane = panes.get(number)
            if pane is None or known_cost.time > pane.time + TIME_TOLERANCE_S:
                continue
            if np.isfinite(known_cost.result.mean_distance):
                _add_to_curves(pane, known_cost)
            else:
                self._without_cost.add((number, known_cost.time))


def _request_for_curve(costs: Costs, state: _MissingState) -> None:
    """Request the cost of an earlier state, which is only added to a curve."""
    costs.request(
        state.pane,
        state.time,
        state.positions,
        speeds=state.setup.speed_limits,
        is_for_curve=True,
    )


def _add_to_curves(pane: Pane, known_cost: KnownCost) -> None:
    """Add a cost to the curves of a pane."""
    pane.distance_curve.add(known_cost.time, known_cost.result.mean_distance)
    if known_cost.travel_time is not None:
        pane.curves["time"].add(known_cost.time, known_cost.travel_time)
