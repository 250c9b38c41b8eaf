"""The present of a timeline, and building it for any step of a document."""

import math
from collections import defaultdict
from collections.abc import Callable, Generator, Iterator, Mapping
from dataclasses import dataclass
from typing import Self

import numpy as np

from robocov.metrics import SETTLED_WINDOW_S, is_team_at_rest
from robocov_app.render.sensed_points import SensedPoints
from robocov_app.viewer.session.document import MAX_CACHED_STATES, Node, SessionDocument, replay
from robocov_app.viewer.session.pane import Pane
from robocov_app.viewer.session.pane_group import PaneGroup
from robocov_app.viewer.session.past.decision_replay import get_sensor
from robocov_app.viewer.session.past.history import RunHistory
from robocov_app.viewer.session.past.states import RunState
from robocov_app.viewer.session.past.trails import (
    TrailSection,
    build_trail,
    merge_sections,
    rebuild_trail,
)

MAX_SENSED_STATES = 300
"""Maximum number of states from which sensed points are recomputed after a move to another branch."""
_STEP_MARGIN = 0.5
"""Margin for the comparison of times, as a fraction of the control period."""


@dataclass(eq=False)
class Present:
    """The present of a timeline, which is replaced as a whole when the timeline moves to another state.

    Attributes
    ----------
    head : Node
        The node of the document whose time span contains the present.
    run : PaneGroup
        The panes at the present step.
    history : RunHistory
        The recorded states up to the present, which is the last one.
    """

    head: Node
    run: PaneGroup
    history: RunHistory

    @classmethod
    def start(cls, root: Node) -> Self:
        """Build the present at time 0 of a run.

        Parameters
        ----------
        root : Node
            The node with the scenario.

        Returns
        -------
        Present

        Raises
        ------
        StartError
            If there is no space for the team.
        ParameterError
            If a controller or the team does not accept a value.
        """
        run = PaneGroup(root.require_scenario())
        history = RunHistory(run.scenario.dt)
        history.append(run.build_state(root.number))
        return cls(root, run, history)

    def has_settled(self) -> bool:
        """Return whether no robot has moved noticeably during the last `SETTLED_WINDOW_S` seconds."""
        run = self.run
        if run.drag is not None or run.time < SETTLED_WINDOW_S:
            return False
        before = self.history[self.history.find_index(run.time - SETTLED_WINDOW_S)]
        for pane in run.panes:
            state = before.states[pane.number]
            if state.setup is not pane.setup:
                return False
            if not is_team_at_rest(state.positions, pane.positions):
                return False
        return True


def build_present(
    document: SessionDocument,
    old: Present,
    node: Node,
    step: int,
    edit: Callable[[PaneGroup], None] | None = None,
) -> Generator[float, None, Present]:
    """Build the present at a step of a node, in small pieces. The old present is not changed.

    Parameters
    ----------
    document : SessionDocument
        The document.
    old : Present
        The previous present. Its recorded states are reused if they are on the path to the node.
    node : Node
        A node of the document, or a new one.
    step : int
        A step of the node.
    edit : callable or None
        Called with the run at that step, to change it.

    Yields
    ------
    float
        Fraction of the steps done so far, after each step, so that the caller can pause.

    Returns
    -------
    Present

    Raises
    ------
    StartError, ParameterError, InputError
        If the state cannot be built. Controllers may raise any exception.
    """
    path = document.get_path(node)
    history = _copy_common_past(document, old, node, step)
    if len(history):
        run = PaneGroup.resume(history.last)
    else:
        start = Present.start(path[0])
        run = start.run
        history = start.history
    # Simulate only from the last known state on.
    start_node = next(ancestor for ancestor in path if ancestor.number == history.last.node)
    first_step = run.step
    step_count = max(step - first_step, 1)
    for _, current in replay(document, node, step, run, start_node):
        if (run.step, current.number) != (history.last.step, history.last.node):
            history.amend(run.build_state(current.number))
        yield (run.step - first_step) / step_count
    # Store the old present first: the new one may share nodes with it, and reuses their trails and curves.
    cache_present(document, old)
    new = Present(node, run, history)
    for _ in _restore_panes(document, old, new):
        yield 1.0
    if edit is not None:
        edit(run)
    return new


def cache_present(document: SessionDocument, present: Present) -> None:
    """Store the states, trails and curves of the present in the nodes on the path to it.

    They are reused when the timeline returns to this branch from another one.

    Parameters
    ----------
    document : SessionDocument
        The document.
    present : Present
        The present.
    """
    states_by_node = defaultdict[int, list[RunState]](list)
    for state in present.history.states:
        states_by_node[state.node].append(state)
    path = document.get_path(present.head)
    dt = present.run.scenario.dt
    for node, following in zip(path, [*path[1:], None], strict=True):
        node.cached_states = _select_cached_states(states_by_node[node.number], node.cached_states)
        end_time = np.inf if following is None else following.branch_step * dt
        for pane in present.run.panes:
            node.trails[pane.number] = merge_sections(
                pane.trail.extract(node.first_step * dt, end_time), node.trails.get(pane.number, [])
            )
            for quantity, curve in pane.curves.items():
                merged = curve.extract(node.first_step * dt, end_time)
                merged.extend(node.curves[pane.number, quantity])
                node.curves[pane.number, quantity] = merged


def _select_cached_states(recorded: list[RunState], cached: list[RunState]) -> list[RunState]:
    """Return the recorded states and later cached states, evenly thinned to `MAX_CACHED_STATES`."""
    last_recorded_step = recorded[-1].step if recorded else -1
    states = [*recorded, *(state for state in cached if state.step > last_recorded_step)]
    stride = max(math.ceil(len(states) / MAX_CACHED_STATES), 1)
    # Counted from the end, so that the last state is always among them.
    return states[::-stride][::-1]


def _restore_trail(path: list[Node], last_steps: Mapping[int, int], pane: Pane, dt: float) -> None:
    """Prepend the trail stored in the nodes of a path to the trail of the steps simulated again.

    Parameters
    ----------
    path : list of Node
        Nodes from the root of the run to the present.
    last_steps : mapping of int to int
        Last step of each node on the path, keyed by node number.
    pane : Pane
        Pane whose trail is extended.
    dt : float, s
        Control period.
    """
    sections: list[TrailSection] = []
    for node, following in zip(path, [*path[1:], None], strict=True):
        end = last_steps[node.number] * dt
        if following is None:
            # A row at the end of a node belongs to the node that follows; that of the last node is included.
            end += _STEP_MARGIN * dt
        sections += [section.cut(-np.inf, end) for section in node.trails.get(pane.number, [])]
    simulated = pane.trail.extract(-np.inf, np.inf)
    pane.trail = build_trail(merge_sections(sections, simulated))


def _copy_common_past(document: SessionDocument, old: Present, node: Node, step: int) -> RunHistory:
    """Return the known states on the path to a step of a node; an empty history if there are none."""
    path = document.get_path(node)
    last_steps = document.get_last_steps(node, step)
    common_numbers = {ancestor.number for ancestor in document.get_path(old.head)}
    common_numbers.intersection_update(last_steps)
    common_count = 0
    for state in old.history.states:
        if state.node in common_numbers and state.step <= last_steps[state.node]:
            common_count += 1
    if common_count:
        # Paths share their first nodes, so the common states are the first ones of the history.
        history = old.history.copy_until(common_count - 1)
    else:
        history = RunHistory(path[0].require_scenario().dt)
    _add_cached_states(history, path, last_steps)
    return history


def _add_cached_states(history: RunHistory, path: list[Node], last_steps: Mapping[int, int]) -> None:
    """Append the states that are cached from an earlier visit to a branch.

    Parameters
    ----------
    history : RunHistory
        The states that are known so far; it may be empty.
    path : list of Node
        Nodes from the root of the run to the end of the branch.
    last_steps : mapping of int to int
        Last step of each node on the path, keyed by node number.
    """
    first_missing = 0
    if len(history):
        first_missing = [node.number for node in path].index(history.last.node)
    for node in path[first_missing:]:
        for state in node.cached_states:
            is_later = not len(history) or state.step >= history.last.step
            if is_later and state.step <= last_steps[node.number]:
                history.amend(state)


def _restore_panes(document: SessionDocument, old: Present, new: Present) -> Iterator[None]:
    """Restore trails, curves and sensed points of the panes of a new present; yield after each piece."""
    path = document.get_path(new.head)
    last_steps = document.get_last_steps(new.head, new.run.step)
    old_last_step = document.get_last_steps(old.head, old.run.step).get(new.head.number, -1)
    # Sensed points can be copied if the new present lies on the path to the old one.
    is_in_old_past = new.run.step <= old_last_step
    old_panes = {pane.number: pane for pane in old.run.panes} if is_in_old_past else {}
    dt = new.run.scenario.dt
    for pane in new.run.panes:
        _restore_trail(path, last_steps, pane, dt)
        if pane.trail.times[0] > new.history.get_time(0) + _STEP_MARGIN * dt:
            # A pane that was removed later: its trail was not stored in the nodes.
            earlier = rebuild_trail(new.history, pane.number).extract(-np.inf, np.inf)
            pane.trail = build_trail(merge_sections(earlier, pane.trail.extract(-np.inf, np.inf)))
        for quantity, curve in pane.curves.items():
            for node in path:
                curve.extend(node.curves[pane.number, quantity], last_steps[node.number] * dt)
        if pane.number in old_panes:
            pane.sensed = old_panes[pane.number].sensed.copy()
            pane.sensed.remove_after(new.run.time)
        elif new.run.step > 0:
            yield from _rebuild_sensed_points(new.history, pane)


def _rebuild_sensed_points(history: RunHistory, pane: Pane) -> Iterator[None]:
    """Recompute the sensed points of a pane from at most `MAX_SENSED_STATES` of the recorded states.

    Yield after each state, so that the window stays responsive.
    """
    sensed = SensedPoints()
    stride = max(1, math.ceil(len(history) / MAX_SENSED_STATES))
    for index in range(0, len(history), stride):
        time = history.get_time(index)
        state = history[index].states[pane.number]
        setup = state.setup
        sensor = get_sensor(setup.sensed_environment, time)
        points = sensor.find_nearest_points(state.positions, setup.team.sensing_range)
        sensed.add(time, setup.numbers, points)
        yield
    pane.sensed = sensed
