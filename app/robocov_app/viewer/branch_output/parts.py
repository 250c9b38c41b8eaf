"""Parts of a branch, from edit to edit; in each part, map, team and controllers stay the same."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from robocov.controllers import has_memory
from robocov.environment import CircleObstacle, Environment
from robocov.metrics import CostHistory
from robocov.record import Record, Recorder
from robocov_app.render.density_text import format_cost, get_cost_name
from robocov_app.render.scene import Scene
from robocov_app.runs.saved_runs import name_failed_robot
from robocov_app.viewer.session.document import Node, SessionDocument, replay
from robocov_app.viewer.session.editing.edits import PlaceRobot
from robocov_app.viewer.session.editing.map_edits import add_obstacle, replace_obstacles
from robocov_app.viewer.session.pane import Pane
from robocov_app.viewer.session.pane_group import PaneGroup
from robocov_app.viewer.session.past.states import PaneSetup
from robocov_app.viewer.session.setup.scenario import SessionScenario

_TIME_TOLERANCE_S = 1e-9


@dataclass(frozen=True)
class SelectedBranch:
    """A branch of a session up to a step.

    Attributes
    ----------
    document : SessionDocument
        The session.
    node : Node
        Last node of the branch.
    last_step : int
        Step at which it ends.
    """

    document: SessionDocument
    node: Node
    last_step: int

    @property
    def root(self) -> Node:
        """The node at which the run starts."""
        return self.document.get_path(self.node)[0]

    @property
    def scenario(self) -> SessionScenario:
        """Scenario at the start of the run."""
        return self.root.require_scenario()

    def replay(self) -> Iterator[tuple[PaneGroup, Node]]:
        """Simulate the branch; yield the run at each step, with the node whose time span contains it."""
        return replay(self.document, self.node, self.last_step)

    def is_end(self, run: PaneGroup, node: Node) -> bool:
        """Return whether a run has reached the end of the branch."""
        return node is self.node and run.step >= self.last_step


@dataclass
class HandledTime:
    """A period in which the user dragged or placed a robot.

    Attributes
    ----------
    robot : int
        Number of the robot.
    first_step : int
        First step of the period.
    end_step : int
        The step after its last step.
    """

    robot: int
    first_step: int
    end_step: int


@dataclass(frozen=True)
class PartCost:
    """Cost during one part of a branch, for one controller.

    Attributes
    ----------
    start_time : float
        Time at which the part starts, s.
    controller : str
        Name of the controller.
    history : CostHistory
        The cost; its time starts at 0.
    """

    start_time: float
    controller: str
    history: CostHistory


@dataclass(eq=False)
class BranchPart:
    """A part of a branch.

    Attributes
    ----------
    node : Node
        Node of the document; the part starts at its edit.
    first_step, last_step : int
        First and last step.
    setups : dict of int to PaneSetup
        Setup of each pane, by its number.
    environments : dict of int to Environment
        Map of each pane, by its number, without failed robots. Moving obstacles are at time 0 where they are
        at the start of the part.
    recorders : dict of int to Recorder
        Recorder of each pane, by its number.
    scenes : list of Scene
        Scenes for the legend: those of all panes at the start of the part; in the last part, also those at
        the end of the branch.
    handled : list of HandledTime
        Periods in which the user dragged or placed robots.
    placed : list of (int, int)
        Steps at which the user placed robots, with their numbers.
    """

    node: Node
    first_step: int
    setups: dict[int, PaneSetup]
    environments: dict[int, Environment]
    recorders: dict[int, Recorder]
    scenes: list[Scene]
    handled: list[HandledTime] = field(default_factory=list)
    placed: list[tuple[int, int]] = field(default_factory=list)
    last_step: int = 0

    def add_step(self, run: PaneGroup, node: Node) -> None:
        """Record the current step of a run, and the robots that the user places or drags in it."""
        self.last_step = run.step
        for pane in run.panes:
            self.recorders[pane.number].add(pane.observe_and_decide())
        placed = {edit.robot for edit in node.edits if edit.step == run.step and isinstance(edit, PlaceRobot)}
        self.placed += [(run.step, robot) for robot in sorted(placed)]
        dragged = set() if run.drag is None else {run.drag.robot}
        for robot in dragged | placed:
            self._add_handled(robot, run.step)

    def _add_handled(self, robot: int, step: int) -> None:
        """Extend the robot's current period by one step, or start a new period.

        Parameters
        ----------
        robot : int
            Number of the robot.
        step : int
            Step in which it is dragged or placed.
        """
        for period in self.handled:
            if period.robot == robot and period.end_step >= step - 1:
                period.end_step = step + 1
                return
        self.handled.append(HandledTime(robot, step, step + 1))


def split_branch(branch: SelectedBranch) -> list[BranchPart]:
    """Simulate a branch, and split it into recorded parts. A new part starts whenever a setup changes."""
    parts: list[BranchPart] = []
    panes: list[Pane] = []
    for run, node in branch.replay():
        panes = run.panes
        setups = {pane.number: pane.setup for pane in panes}
        if not parts or parts[-1].setups != setups:
            # An edit that lasts several steps may change the setups in each of them. Only its last change
            # starts a part, so drop the part that an earlier change of the same node started. If the node
            # restarts the run, that part stays, because it contains the start.
            if parts and parts[-1].node is node and node.scenario is None:
                parts.pop()
            environments = {
                number: _advance_map(setup.environment, run.time) for number, setup in setups.items()
            }
            recorders = {
                number: _build_recorder(setup, environments[number], run.scenario.dt)
                for number, setup in setups.items()
            }
            scenes = [build_pane_scene(pane) for pane in panes]
            parts.append(BranchPart(node, run.step, setups, environments, recorders, scenes))
        parts[-1].add_step(run, node)
    parts[-1].scenes += [build_pane_scene(pane) for pane in panes]
    return parts


def _advance_map(environment: Environment, start_time: float) -> Environment:
    """Return the map of a part, with obstacle paths shifted so that time 0 is its start time, s."""
    advanced = environment.advance(start_time)
    if advanced is environment:
        return environment
    # This removes starts that the moved obstacles cover. A map with covered starts cannot be loaded.
    return replace_obstacles(advanced, 0, len(advanced.obstacles), advanced.obstacles)


def _build_recorder(setup: PaneSetup, environment: Environment, dt: float) -> Recorder:
    """Build the recorder of a pane. Failed robots are added to the map as obstacles."""
    controller = setup.controller
    for number, position in setup.failed.items():
        name = name_failed_robot(number)
        environment = add_obstacle(
            environment, CircleObstacle(position, setup.properties.get_radius(number), name)
        )
    return Recorder(
        environment,
        setup.team,
        controller.build(),
        dt,
        name=controller.name,
        conditions=setup.constant_conditions,
    )


def build_part_records(part: BranchPart, root: Node) -> list[Record]:
    """Return the records of a part, one for each pane; the times of each start at 0.

    Parameters
    ----------
    part : BranchPart
        The part.
    root : Node
        Node at which the run starts.
    """
    scenario = root.require_scenario()
    # Only the first part of a run starts at positions that can be sampled again from start and seed.
    is_reproducible_start = part.first_step == 0 and part.node is root and scenario.given_starts is None
    records: list[Record] = []
    for number, recorder in part.recorders.items():
        record = recorder.record()
        record = replace(
            record,
            time=np.arange(len(record), dtype=float) * scenario.dt,
            session=_describe_origin(part, part.setups[number], record, scenario.dt),
        )
        if is_reproducible_start:
            record = replace(record, start=scenario.start_name, seed=scenario.seed)
        records.append(record)
    return records


def _describe_origin(part: BranchPart, setup: PaneSetup, record: Record, dt: float) -> dict[str, Any]:
    """Return entries for ``run.json`` on the origin of a record; empty if it is that of an ordinary run."""
    origin = {**_describe_start(part, setup, record, dt), **_describe_user_actions(part, dt)}
    is_repeatable = _is_repeatable(part, setup, record)
    if not origin and is_repeatable:
        return {}
    return {**origin, "repeatable": is_repeatable}


def _describe_start(part: BranchPart, setup: PaneSetup, record: Record, dt: float) -> dict[str, Any]:
    """Return what differs from a start at time 0, at rest, with all robots working."""
    origin: dict[str, Any] = {}
    if part.first_step:
        origin["began_at_s"] = part.first_step * dt
    if record.velocities[0].any():
        origin["start_velocities_m_per_s"] = record.velocities[0].tolist()
    # Without failed and removed robots, the numbers are 1, 2, 3 and so on.
    complete_numbers = tuple(range(1, len(setup.numbers) + 1))
    if setup.failed or setup.numbers != complete_numbers:
        origin["robots"] = list(setup.numbers)
        origin["failed"] = {str(number): list(position) for number, position in setup.failed.items()}
    return origin


def _describe_user_actions(part: BranchPart, dt: float) -> dict[str, Any]:
    """Return the robots that the user dragged or placed, with times since the start of the part, s."""
    origin: dict[str, Any] = {}
    if part.handled:
        origin["edits"] = [_describe_handled(period, part.first_step, dt) for period in part.handled]
    if part.placed:
        origin["placements"] = [
            {"time_s": (step - part.first_step) * dt, "robots": [robot]} for step, robot in part.placed
        ]
    return origin


def _is_repeatable(part: BranchPart, setup: PaneSetup, record: Record) -> bool:
    """Return whether a simulation from the start of the record, without user actions, reproduces it."""
    has_known_memory = part.first_step == 0 or not has_memory(setup.controller.build())
    # In later parts, obstacle paths are shifted, which changes positions by rounding errors.
    has_exact_paths = part.first_step == 0 or not setup.environment.has_moving_obstacles
    is_turned = record.steering is not None and bool(record.steering[0].any())
    has_all_robots = setup.numbers == setup.simulated_numbers
    is_start_complete = has_known_memory and has_exact_paths and has_all_robots and not is_turned
    return is_start_complete and not part.handled


def _describe_handled(period: HandledTime, first_step: int, dt: float) -> dict[str, Any]:
    start = (period.first_step - first_step) * dt
    end = (period.end_step - first_step) * dt
    return {"from_s": start, "to_s": end, "robots": [period.robot]}


def build_pane_scene(pane: Pane, costs: list[PartCost] | None = None, name: str = "") -> Scene:
    """Return the scene of a pane at its current step.

    Parameters
    ----------
    pane : Pane
        The pane.
    costs : list of PartCost, optional
        Costs during the parts of the branch; the newest one is shown as caption.
    name : str
        Name of the pane's controller in `costs`.
    """
    mean_distances: list[float] = []
    for cost in costs or []:
        if cost.controller == name:
            times = cost.start_time + cost.history.time
            is_past = times <= pane.time + _TIME_TOLERANCE_S
            mean_distances += cost.history.mean_distance[is_past].tolist()
    caption = ""
    if mean_distances:
        caption = format_cost(get_cost_name(pane.setup.environment), mean_distances[-1], None)
    snapshot = pane.observe_and_decide()
    return pane.build_scene(pane.setup, snapshot, pane.trail.get_until(pane.time), cost=caption)
