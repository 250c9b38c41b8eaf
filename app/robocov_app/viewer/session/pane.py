"""A pane of the window: the team under one controller."""

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
from robocov_app.viewer.session.controller_choice import ControllerChoice
from robocov_app.viewer.session.past.curves import Curve
from robocov_app.viewer.session.past.states import PaneSetup, PaneState
from robocov_app.viewer.session.past.trails import Trail

STEPS_BETWEEN_SENSED_POINTS = 3
"""Number of steps between two records of the points that robots sense."""
_MOVED_M = 1e-3
"""A robot that is pushed out of an obstacle by more than this comes to rest."""


class Continuation(NamedTuple):
    """State from which an edited pane continues.

    Attributes
    ----------
    setup : PaneSetup
        Setup of the pane from now on.
    positions, velocities : (n, 2) array or None, m and m/s
        Of the working robots; by default as they are.
    """

    setup: PaneSetup
    positions: Array | None = None
    velocities: Array | None = None


class Pane:
    """A team under one controller. Failed robots are obstacles to the others.

    Parameters
    ----------
    number : int
        Number of the pane, which stays the same when others are removed.
    setup : PaneSetup
        Map, controller and robots.
    simulation : Simulation
        The simulation at the present step.

    Attributes
    ----------
    trail : Trail
        Trajectories of the working robots, then those of the robots that failed.
    curves : dict of str to Curve
        Cost curves by quantity, ``"distance"`` and ``"time"``.
    distance_curve : Curve
        Mean distance to the nearest robot.
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
        """Return the row of a robot in arrays; None if it does not work."""
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
        """Build the scene of a step for drawing.

        Parameters
        ----------
        setup : PaneSetup
            Setup of the pane at the step.
        snapshot : Snapshot
            Observations and decision at the step.
        trail : tuple of array
            Positions and times of the trail up to the step.
        **more
            Further fields of `Scene`.

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
            # A user's controller may change its memory in place.
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
        """Build the simulation with which the pane continues after an edit; the pane itself stays as it is.

        Robots that overlap an obstacle are pushed out of it.

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
        # The same controller keeps its memory. One without memory is built again, as when it is resumed.
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
        """Return whether an edit changes at most the density of the map."""
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
        """Return the present rows of robots, (n,); -1 for robots that do not work yet."""
        row_by_number = {number: row for row, number in enumerate(self.numbers)}
        return np.array([row_by_number.get(number, -1) for number in numbers], dtype=np.intp)

    def _build_with_robots(self, continuation: Continuation, controller: Any, rows: IntArray) -> Simulation:
        """Build the changed simulation; robots without space come to rest at the nearest free position."""
        old = self.simulation
        setup = continuation.setup
        environment = setup.sensed_environment
        team = setup.team
        positions = old.positions if continuation.positions is None else continuation.positions
        velocities = old.velocities if continuation.velocities is None else continuation.velocities
        steering = None
        if old.steering is not None:
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
        """Continue with another setup and simulation."""
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
        Initial velocities; by default robots are at rest.

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
    return _build_scenario(setup, positions, dt, velocities).build_simulation()


def resume_simulation(state: PaneState, dt: float, step: int) -> Simulation:
    """Build the simulation of a pane from a recorded state.

    Parameters
    ----------
    state : PaneState
        The recorded state.
    dt : float, s
        Control period.
    step : int
        Step of the state.

    Returns
    -------
    Simulation
    """
    scenario = _build_scenario(state.setup, state.positions, dt, state.velocities, state.steering)
    simulation = scenario.build_simulation(steps=step, is_computed=True)
    memory = simulation.memory if state.memory is None else state.memory
    return simulation.with_memory(memory, state.inbox)


def _build_scenario(
    setup: PaneSetup,
    positions: Array,
    dt: float,
    velocities: Array | None,
    steering: Array | None = None,
) -> Scenario:
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
