"""A pane of the window: a team under one controller."""

from copy import deepcopy
from typing import Any, NamedTuple

import numpy as np

from robocov.arrays import Array, IntArray
from robocov.controllers import has_memory
from robocov.errors import StartError
from robocov.observation import Snapshot
from robocov.scenario import Scenario
from robocov.simulation import Simulation
from robocov.world.free_positions import relocate_robots
from robocov_app.render.scene import Scene
from robocov_app.render.sensed_points import SensedPoints
from robocov_app.viewer.session.past.curves import Curve
from robocov_app.viewer.session.past.states import PaneSetup, PaneState
from robocov_app.viewer.session.past.trails import Trail
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice

STEPS_BETWEEN_SENSED_POINTS = 3
"""Interval, in steps, at which sensed points are recorded."""
_MOVED_M = 1e-3
"""A robot that is moved out of an obstacle by more than this comes to rest."""


class Continuation(NamedTuple):
    """Setup and state with which a pane continues after an edit.

    Attributes
    ----------
    setup : PaneSetup
        New setup of the pane.
    positions, velocities : (n, 2) array or None, m and m/s
        Positions and velocities of the working robots; None if they do not change.
    """

    setup: PaneSetup
    positions: Array | None = None
    velocities: Array | None = None


class Pane:
    """A team under one controller. Failed robots are obstacles to the others.

    Parameters
    ----------
    number : int
        Number of the pane. It does not change when other panes are removed.
    setup : PaneSetup
        Map, controller and robots.
    simulation : Simulation
        The simulation at the current step.

    Attributes
    ----------
    trail : Trail
        Trajectories of the working robots, followed by those of failed robots.
    curves : dict of str to Curve
        Cost curves by quantity, ``"distance"`` and ``"time"``.
    distance_curve : Curve
        Curve of the mean distance to the nearest robot.
    sensed : SensedPoints
        Points that robots have sensed.
    """

    def __init__(self, number: int, setup: PaneSetup, simulation: Simulation) -> None:
        self.number = number
        self.setup = setup
        self.simulation = simulation
        self.trail = Trail(setup.tracked_numbers)
        self.trail.add(simulation.time, simulation.positions)
        self.curves = {"distance": Curve(), "time": Curve()}
        self.distance_curve = self.curves["distance"]
        self.sensed = SensedPoints()
        self._steps = 0

    @property
    def controller(self) -> ControllerChoice:
        """The controller."""
        return self.setup.controller

    @property
    def numbers(self) -> tuple[int, ...]:
        """Numbers of the working robots."""
        return self.setup.numbers

    @property
    def starts(self) -> Array:
        """First positions of the working robots, (n, 2) m."""
        return self.trail.get_starts(self.time, self.numbers)

    @property
    def time(self) -> float:
        """Time of the simulation, s."""
        return self.simulation.time

    def get_row(self, number: int) -> int | None:
        """Return the row of a working robot in arrays; None for other robots."""
        if number in self.numbers:
            return self.numbers.index(number)
        return None

    def step(self, pushes: Array | None = None) -> None:
        """Simulate one step.

        Parameters
        ----------
        pushes : (n, 2) array or None, N
            External forces on the robots.
        """
        if self._steps % STEPS_BETWEEN_SENSED_POINTS == 0:
            seen = self.simulation.observe_and_decide().seen
            self.sensed.add(seen.time, self.numbers, seen.obstacle_points)
        self._steps += 1
        self.simulation.step(pushes)
        self.trail.add(self.time, self.simulation.positions)

    def build_scene(
        self, setup: PaneSetup, snapshot: Snapshot, trail: tuple[Array, Array], **more: Any
    ) -> Scene:
        """Build the scene of a step, for drawing.

        Parameters
        ----------
        setup : PaneSetup
            Setup of the pane at that step.
        snapshot : Snapshot
            Observations and decision at the step.
        trail : tuple of array
            Positions and times of the trajectories up to the step.
        **more
            Other fields of `Scene`.

        Returns
        -------
        Scene
        """
        positions, times = trail
        return Scene.from_snapshot(
            setup.environment,
            self.simulation.team if setup is self.setup else setup.team,
            snapshot,
            numbers=setup.numbers,
            failed=setup.failed,
            failed_radii={number: setup.properties.get_radius(number) for number in setup.failed},
            label=setup.controller.label,
            starts=self.trail.get_starts(snapshot.time, setup.numbers),
            trail=positions,
            trail_time=times,
            **more,
        )

    def build_state(self) -> PaneState:
        """Return the present state, from which the pane can be resumed."""
        simulation = self.simulation
        memory = None
        if has_memory(simulation.controller):
            # A user's controller may later change its memory in place.
            memory = deepcopy(simulation.memory)
        return PaneState(
            self.setup,
            simulation.positions,
            simulation.velocities,
            memory,
            inbox=simulation.inbox,
            steering=simulation.steering,
        )

    def build_changed_simulation(self, continuation: Continuation) -> Simulation:
        """Build the simulation with which the pane continues after an edit; the pane itself is not changed.

        Robots that overlap an obstacle are moved to the nearest free position.

        Parameters
        ----------
        continuation : Continuation
            State from which the pane continues.

        Returns
        -------
        Simulation

        Raises
        ------
        StartError
            If there is no space for a robot.
        ParameterError
            If the controller or the team does not accept a value.
        """
        old = self.simulation
        setup = continuation.setup
        # An unchanged controller keeps its memory. Without memory, it is rebuilt, as on resuming.
        keeps_controller = setup.controller == self.controller and has_memory(old.controller)
        controller = None if keeps_controller else setup.controller.build()
        if self._differs_only_in_density(continuation):
            return old.with_density(setup.sensed_environment)
        rows = self._find_rows(setup.numbers)
        changed = self._build_with_robots(continuation, controller, rows)
        if old.inbox is not None and setup.numbers != self.numbers:
            changed = changed.with_memory(changed.memory, old.inbox.select_robots(rows))
        return changed

    def _differs_only_in_density(self, continuation: Continuation) -> bool:
        """Return whether an edit changes nothing but the density of the map."""
        old = self.setup
        new = continuation.setup
        return (
            continuation.positions is None
            and old.controller == new.controller
            and old.properties == new.properties
            and old.numbers == new.numbers
            and old.failed == new.failed
            and new.environment.has_same_geometry(old.environment)
        )

    def _find_rows(self, numbers: tuple[int, ...]) -> IntArray:
        """Return the current rows of robots, given by their numbers, (n,); -1 for robots not yet working."""
        row_by_number = {number: row for row, number in enumerate(self.numbers)}
        return np.array([row_by_number.get(number, -1) for number in numbers], dtype=np.intp)

    def _build_with_robots(self, continuation: Continuation, controller: Any, rows: IntArray) -> Simulation:
        """Build the changed simulation.

        If robots overlap obstacles or each other, they are moved to the nearest free positions.

        Parameters
        ----------
        continuation : Continuation
            Setup and state with which the pane continues.
        controller : Controller or None
            New controller; None to keep the current one and its memory.
        rows : (n,) int array
            Current row of each robot; -1 for robots that have just joined.

        Returns
        -------
        Simulation
        """
        old = self.simulation
        setup = continuation.setup
        environment = setup.sensed_environment
        team = setup.team
        positions = old.positions if continuation.positions is None else continuation.positions
        velocities = old.velocities if continuation.velocities is None else continuation.velocities
        steering = None
        if old.steering is not None:
            # Robots that have just joined (row -1) start with heading and turning rate 0.
            steering = np.where(rows[:, None] < 0, 0.0, old.steering[rows])

        def build(positions: Array, velocities: Array) -> Simulation:
            return old.with_changes(
                environment=environment,
                controller=controller,
                team=team,
                steering=steering,
                positions=positions,
                velocities=velocities,
            )

        try:
            return build(positions, velocities)
        except StartError:
            placed = relocate_robots(environment.at(old.time), positions, team)
            is_moved = np.hypot(*(placed - positions).T) > _MOVED_M
            return build(placed, np.where(is_moved[:, None], 0.0, velocities))

    def adopt(self, setup: PaneSetup, simulation: Simulation) -> None:
        """Replace the setup and the simulation, and continue the trail with the new team."""
        self.simulation = simulation
        self.setup = setup
        self.trail.change_robots(setup.tracked_numbers)
        self.trail.add(self.time, simulation.positions, always=True)


def start_simulation(
    setup: PaneSetup, positions: Array, dt: float, velocities: Array | None = None
) -> Simulation:
    """Build the simulation of a pane at time 0.

    Parameters
    ----------
    setup : PaneSetup
        Map, controller and robots.
    positions : (n, 2) array, m
        Starting positions.
    dt : float, s
        Control period.
    velocities : (n, 2) array or None, m/s
        Initial velocities; by default, robots are at rest.

    Returns
    -------
    Simulation

    Raises
    ------
    StartError
        If robots overlap obstacles or each other.
    ParameterError
        If the controller or the team does not accept a value.
    """
    return _build_pane_scenario(setup, positions, dt, velocities).build_simulation()


def resume_simulation(state: PaneState, dt: float, step: int) -> Simulation:
    """Build the simulation of a pane from a recorded state.

    Parameters
    ----------
    state : PaneState
        The recorded state.
    dt : float, s
        Control period.
    step : int
        Step at which the state was recorded.

    Returns
    -------
    Simulation
    """
    scenario = _build_pane_scenario(state.setup, state.positions, dt, state.velocities, state.steering)
    simulation = scenario.build_simulation(steps=step, is_computed=True)
    memory = simulation.memory if state.memory is None else state.memory
    return simulation.with_memory(memory, state.inbox)


def _build_pane_scenario(
    setup: PaneSetup,
    positions: Array,
    dt: float,
    velocities: Array | None,
    steering: Array | None = None,
) -> Scenario:
    """Build the scenario of a pane's setup that starts from a given state of the robots."""
    return Scenario(
        setup.sensed_environment,
        setup.controller.build(),
        team=setup.team,
        starts=positions,
        velocities=velocities,
        steering=steering,
        dt=dt,
        conditions=setup.conditions,
    )
