"""Panes that advance together, with a dragged robot, and robots that join or fail by the conditions."""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple, Self

import numpy as np

from robocov.conditions import TIME_TOLERANCE_S, Conditions
from robocov.environment import Point
from robocov.errors import ParameterError
from robocov.simulation import check_joins
from robocov.typing import BoolArray, FloatArray
from robocov_app.viewer.session.editing.drag_spring import compute_spring_forces
from robocov_app.viewer.session.editing.edits import (
    AddRobot,
    DragRobot,
    EditObstacles,
    FailRobot,
    MapEdit,
    PaintDensity,
    PaneEdit,
    PlaceRobot,
    ReleaseRobot,
    RemovePane,
    RunEdit,
    SetDensity,
)
from robocov_app.viewer.session.pane import Continuation, Pane, resume_simulation, start_simulation
from robocov_app.viewer.session.past.states import Drag, PaneSetup, RunState
from robocov_app.viewer.session.setup.scenario import SessionScenario

MIN_REPORTED_OFFSET_M = 5e-4
"""If a robot joins farther than this from the requested position, the event states the distance."""


class AutomaticEvent(NamedTuple):
    """An event that the conditions cause, not the user: a robot fails or joins.

    Attributes
    ----------
    step : int
        Step at which it happens.
    kind : str
        Kind of the event, as in `SessionEvent`.
    text : str
        Description.
    """

    step: int
    kind: str
    text: str


class PaneGroup:
    """The panes of a session, which are always at the same step.

    Parameters
    ----------
    scenario : SessionScenario
        Map, robots and controllers at time 0.

    Attributes
    ----------
    scenario : SessionScenario
        Current map, controllers and properties.
    step : int
        Number of control steps since time 0.
    drag : Drag or None
        The dragged robot, if there is one.
    panes : list of Pane
        One pane for each controller.

    Raises
    ------
    StartError
        If there is no space for the team.
    ParameterError
        If a controller or the team does not accept a value.
    """

    def __init__(self, scenario: SessionScenario) -> None:
        """Build the panes at time 0, with the robots that work then."""
        positions = scenario.starts
        conditions = scenario.conditions
        is_working = np.ones(len(positions), dtype=bool)
        is_simulated = is_working
        failed: dict[int, Point] = {}
        scheduled_robots = 0
        if conditions is not None:
            check_joins(scenario.environment, conditions)
            is_working = conditions.find_working_robots(0.0, len(positions))
            failed = _find_failed_robots(conditions, positions)
            if keeps_a_robot(conditions, len(positions)):
                scheduled_robots = len(positions)
            else:
                # `advance` adds and stops the robots, but never stops the last one.
                conditions = conditions.drop_team_changes()
                is_simulated = is_working
        velocities = None
        steering = None
        if scenario.given_starts is not None:
            velocities = _select_rows(scenario.velocities, is_simulated)
            steering = _select_rows(scenario.steering, is_simulated)
        numbers = tuple((np.flatnonzero(is_working) + 1).tolist())
        self.scenario = scenario
        self.step = 0
        self.drag: Drag | None = None
        self.panes: list[Pane] = []
        for number, controller in enumerate(scenario.controllers):
            setup = PaneSetup(
                scenario.environment,
                controller,
                scenario.properties,
                numbers,
                failed,
                conditions,
                scheduled_robots,
            )
            simulation = start_simulation(setup, positions[is_simulated], scenario.dt, velocities, steering)
            self.panes.append(Pane(number, setup, simulation))

    @classmethod
    def resume(cls, state: RunState) -> Self:
        """Build the panes from a recorded state."""
        run = cls.__new__(cls)
        run.scenario = state.scenario
        run.step = state.step
        run.drag = state.drag
        run.panes = []
        for number, pane_state in state.states.items():
            simulation = resume_simulation(pane_state, state.scenario.dt, state.step)
            run.panes.append(Pane(number, pane_state.setup, simulation))
        return run

    def build_state(self, node: int = 0) -> RunState:
        """Return the present state of all panes.

        Parameters
        ----------
        node : int
            Number of the node of the undo tree whose time span contains the present.

        Returns
        -------
        RunState
        """
        states = {pane.number: pane.build_state() for pane in self.panes}
        return RunState(self.step, states, self.scenario, self.drag, node)

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self.step * self.scenario.dt

    def advance(self) -> list[AutomaticEvent]:
        """Simulate one step, and return the failures and joins that the conditions have caused."""
        # All controllers decide first: if one raises, no pane has moved yet.
        for pane in self.panes:
            pane.simulation.observe_and_decide()
        before = self.panes[0].setup
        for pane in self.panes:
            pane.step(self._compute_pull(pane))
        self.step += 1
        if before.follows_schedule:
            self._release_failed_robot()
            return self._list_scheduled_events(before)
        return [*self._add_joining_robots(), *self._stop_failing_robots()]

    def _list_scheduled_events(self, before: PaneSetup) -> list[AutomaticEvent]:
        """Return the events of robots that have joined or failed in the simulations during the last step."""
        now = self.panes[0].setup
        events: list[AutomaticEvent] = []
        for number in now.numbers:
            if number not in before.all_numbers:
                offset = self._describe_offset(number, self._find_join_position(number))
                events.append(AutomaticEvent(self.step, "robot", f"robot {number} joined{offset}"))
        events += [
            AutomaticEvent(self.step, "failure", f"robot {number} failed")
            for number in before.numbers
            if number not in now.numbers
        ]
        return events

    def _release_failed_robot(self) -> None:
        """End the drag of a robot that no longer works."""
        if self.drag is not None and self.drag.robot not in self.panes[0].setup.numbers:
            self.drag = None

    def apply(self, edit: RunEdit) -> None:
        """Apply an edit. If it raises, nothing changes.

        Parameters
        ----------
        edit : RunEdit
            The edit.

        Raises
        ------
        StartError
            If there is no space for a robot.
        ParameterError
            If the edit is not possible.
        MapError
            If the edited map would break a rule.
        """
        match edit:
            case DragRobot(robot, to):
                self.drag = Drag(robot, to)
                return
            case ReleaseRobot():
                self.drag = None
                return
            case RemovePane(number):
                self._remove_pane(number)
            case EditObstacles() | PaintDensity() | SetDensity():
                self._edit_map(edit)
            case _:
                self._edit_panes(edit)
        # Map and properties are the same in all panes.
        setup = self.panes[0].setup
        self.scenario = replace(
            self.scenario,
            environment=setup.environment,
            properties=setup.properties,
            controllers=tuple(pane.controller for pane in self.panes),
        )

    def _remove_pane(self, number: int) -> None:
        if len(self.panes) == 1:
            raise ParameterError("cannot remove the last pane")
        self.panes = [pane for pane in self.panes if pane.number != number]

    def _edit_map(self, edit: MapEdit) -> None:
        environment = edit.build_environment(self.scenario.environment)
        self._change_panes(lambda pane: Continuation(replace(pane.setup, environment=environment)))

    def _edit_panes(self, edit: PaneEdit) -> None:
        self._change_panes(edit.build_continuation)
        is_drag_possible = self.drag is not None and self.panes[0].get_row(self.drag.robot) is not None
        if isinstance(edit, PlaceRobot) or not is_drag_possible:
            self.drag = None

    def _change_panes(self, build_continuation: Callable[[Pane], Continuation]) -> None:
        """Apply an edit to the panes; if one of them cannot be changed, raise and change none."""
        continuations = [(pane, build_continuation(pane)) for pane in self.panes]
        changes = []
        for pane, continuation in continuations:
            # Skip panes that the edit does not affect: their simulation continues.
            if continuation.positions is not None or continuation.setup is not pane.setup:
                simulation = pane.build_changed_simulation(continuation)
                changes.append((pane, continuation.setup, simulation))
        for pane, setup, simulation in changes:
            pane.adopt(setup, simulation)

    def _compute_pull(self, pane: Pane) -> FloatArray | None:
        """Return the forces of the spring that pulls the dragged robot, (n, 2) N; None if there is none."""
        if self.drag is None:
            return None
        row = pane.get_row(self.drag.robot)
        if row is None:
            return None
        simulated_row = int(pane.setup.simulated_rows[row])
        return compute_spring_forces(pane.simulation, simulated_row, self.drag.target)

    def _find_changing_robots(self, change_times: FloatArray) -> list[int]:
        """Return the numbers of the robots whose change times, (n,) s, lie within the last step."""
        now = self.time + TIME_TOLERANCE_S
        before = self.time - self.scenario.dt + TIME_TOLERANCE_S
        is_changing = (change_times > before) & (change_times <= now)
        numbers: list[int] = (np.flatnonzero(is_changing) + 1).tolist()
        return numbers

    def _add_joining_robots(self) -> list[AutomaticEvent]:
        """Add the robots whose join time lies within the last step, and return their events."""
        conditions = self.scenario.conditions
        if conditions is None or not conditions.has_team_changes:
            return []
        events = []
        join_times, _ = conditions.compute_working_periods(self.scenario.robots)
        for number in self._find_changing_robots(join_times):
            if number in self.panes[0].setup.all_numbers:
                continue
            position = self._find_join_position(number)
            self.apply(AddRobot(number, position))
            offset = self._describe_offset(number, position)
            events.append(AutomaticEvent(self.step, "robot", f"robot {number} joined{offset}"))
        return events

    def _find_join_position(self, number: int) -> Point:
        """Return the position, m, at which a robot joins by the conditions."""
        conditions = self.scenario.conditions
        joins = () if conditions is None else conditions.joins
        position = next((join.position for join in joins if join.robot == number), None)
        if position is not None:
            return position
        x, y = self.scenario.starts[number - 1].tolist()
        return x, y

    def _stop_failing_robots(self) -> list[AutomaticEvent]:
        """Stop the robots whose failure time lies within the last step, and return their events."""
        conditions = self.scenario.conditions
        if conditions is None or not conditions.has_team_changes:
            return []
        events = []
        _, failure_times = conditions.compute_working_periods(self.scenario.robots)
        for number in self._find_changing_robots(failure_times):
            numbers = self.panes[0].numbers
            if number in numbers and len(numbers) > 1:
                self.apply(FailRobot(number))
                events.append(AutomaticEvent(self.step, "failure", f"robot {number} failed"))
        return events

    def _describe_offset(self, number: int, requested: Point) -> str:
        """Describe the offset of a new robot from the requested position; empty if it is tiny."""
        pane = self.panes[0]
        row = pane.get_row(number)
        offset = 0.0 if row is None else float(np.hypot(*(pane.positions[row] - requested)))
        if offset < MIN_REPORTED_OFFSET_M:
            return ""
        return f" {offset:.2f} m from [{requested[0]:g}, {requested[1]:g}]"


def _find_failed_robots(conditions: Conditions, positions: FloatArray) -> dict[int, Point]:
    """Return the positions of the robots that have failed at time 0, by number."""
    failed: dict[int, Point] = {}
    for row in np.flatnonzero(conditions.find_failed_robots(0.0, len(positions))).tolist():
        x, y = positions[row].tolist()
        failed[row + 1] = (x, y)
    return failed


def _select_rows(rows: FloatArray | None, is_selected: BoolArray) -> FloatArray | None:
    """Return the selected rows of an array; None if there is no array."""
    return None if rows is None else rows[is_selected]


def keeps_a_robot(conditions: Conditions, robot_count: int) -> bool:
    """Return whether conditions let robots fail or join, and at least one robot always works.

    Parameters
    ----------
    conditions : Conditions
    robot_count : int
        Number of all robots.

    Returns
    -------
    bool
    """
    if not conditions.has_team_changes:
        return False
    starts, stops = conditions.compute_working_periods(robot_count)
    times = np.concatenate([[0.0], starts, stops])
    working = conditions.find_working_robots(times[np.isfinite(times)], robot_count)
    return bool(working.any(axis=1).all())
