"""A pane of the window: a team under one controller."""

from copy import deepcopy
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from robocov.conditions import Conditions
from robocov.controllers import has_memory
from robocov.environment import Point
from robocov.errors import StartError
from robocov.observation import Snapshot
from robocov.scenario import Scenario
from robocov.simulation import Simulation
from robocov.simulation.team_state import TeamState
from robocov.team import Team
from robocov.typing import FloatArray, IntArray
from robocov.world.free_positions import relocate_robots
from robocov_app.render.record_scene import select_robots
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
    positions: FloatArray | None = None
    velocities: FloatArray | None = None


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
        self.trail.add(simulation.time, self.positions)
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
    def positions(self) -> FloatArray:
        """Positions of the working robots, (n, 2) m."""
        return self._select_working(self.simulation.positions)

    @property
    def velocities(self) -> FloatArray:
        """Velocities of the working robots, (n, 2) m/s."""
        return self._select_working(self.simulation.velocities)

    @property
    def steering(self) -> FloatArray | None:
        """Headings and turning rates of working unicycles, (n, 2) rad and rad/s; None in a team of points."""
        steering = self.simulation.steering
        if steering is None:
            return None
        return self._select_working(steering)

    @property
    def team(self) -> Team:
        """The working robots."""
        if self.setup.follows_schedule:
            return self.setup.team
        return self.simulation.team

    def _select_working(self, rows: FloatArray) -> FloatArray:
        """Return the rows of the working robots."""
        if self.setup.follows_schedule:
            return rows[self.setup.simulated_rows]
        return rows

    def observe_and_decide(self) -> Snapshot:
        """Return observations and decisions of the working robots; see `Simulation.observe_and_decide`."""
        return select_working(self.simulation.observe_and_decide(), self.setup)

    @property
    def starts(self) -> FloatArray:
        """First positions of the working robots, (n, 2) m."""
        return self.trail.get_starts(self.time, self.numbers)

    @property
    def time(self) -> float:
        """Time of the simulation, s."""
        return self.simulation.time

    def get_row(self, number: int) -> int | None:
        """Return the array row of a robot, or None if it is not working."""
        if number in self.numbers:
            return self.numbers.index(number)
        return None

    def step(self, pushes: FloatArray | None = None) -> None:
        """Simulate one step.

        Parameters
        ----------
        pushes : (n, 2) array or None, N
            External forces on the robots.
        """
        if self._steps % STEPS_BETWEEN_SENSED_POINTS == 0:
            seen = self.observe_and_decide().seen
            self.sensed.add(seen.time, self.numbers, seen.obstacle_points)
        self._steps += 1
        self.simulation.step(pushes)
        if not self.follow_schedule():
            self.trail.add(self.time, self.positions)

    def follow_schedule(self) -> bool:
        """Adopt the robots that have failed or joined in the simulation; return whether there were any."""
        setup = self.setup
        if not setup.follows_schedule or setup.conditions is None:
            return False
        simulation = self.simulation
        numbers = tuple((np.flatnonzero(simulation.is_working) + 1).tolist())
        if numbers == setup.numbers:
            return False
        has_failed = setup.conditions.find_failed_robots(simulation.time, setup.scheduled_robots)
        failed: dict[int, Point] = {}
        for row in np.flatnonzero(has_failed).tolist():
            x, y = simulation.positions[row].tolist()
            failed[row + 1] = (x, y)
        self.adopt(replace(setup, numbers=numbers, failed=failed), simulation)
        return True

    def build_scene(
        self, setup: PaneSetup, snapshot: Snapshot, trail: tuple[FloatArray, FloatArray], **more: Any
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
            self.team if setup is self.setup else setup.team,
            snapshot,
            numbers=setup.numbers,
            memory_rows=setup.simulated_rows,
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
        all_robots: TeamState | None = None
        if self.setup.follows_schedule:
            all_robots = TeamState(
                positions=simulation.positions,
                velocities=simulation.velocities,
                steering=simulation.steering,
            )
        return PaneState(
            self.setup,
            self.positions,
            self.velocities,
            memory,
            inbox=simulation.inbox,
            steering=self.steering,
            all_robots=all_robots,
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
        if self._differs_only_in_density(continuation):
            return old.with_density(setup.simulated_environment)
        has_same_robots = setup.simulated_numbers == self.setup.simulated_numbers
        # An unchanged controller keeps its memory, except for one of all robots of a schedule that ends here.
        # A controller without memory is rebuilt, as when a recorded state is resumed.
        is_same_controller = setup.controller == self.controller and has_memory(old.controller)
        leaves_schedule = self.setup.follows_schedule and not setup.follows_schedule
        controller = None if is_same_controller and not leaves_schedule else setup.controller.build()
        rows = self._find_rows(setup.simulated_numbers)
        if setup.follows_schedule:
            changed = self._build_on_schedule(continuation, controller)
        else:
            changed = self._build_with_robots(continuation, controller, rows)
        if old.inbox is not None and not has_same_robots:
            changed = changed.with_memory(changed.memory, old.inbox.select_robots(rows))
        return changed

    def _build_on_schedule(self, continuation: Continuation, controller: Any) -> Simulation:
        """Build a changed simulation that contains all robots, as before, and keeps its conditions."""
        old = self.simulation
        setup = continuation.setup
        rows = setup.simulated_rows
        team = setup.simulated_team
        positions = old.positions.copy()
        velocities = old.velocities.copy()
        if continuation.positions is not None:
            positions[rows] = continuation.positions
        if continuation.velocities is not None:
            velocities[rows] = continuation.velocities
        try:
            return old.with_changes(
                environment=setup.environment,
                controller=controller,
                team=team,
                positions=positions,
                velocities=velocities,
            )
        except StartError:
            free_map = setup.sensed_environment.at(old.time)
            placed = relocate_robots(free_map, positions[rows], setup.team)
            is_moved = np.hypot(*(placed - positions[rows]).T) > _MOVED_M
            positions[rows] = placed
            velocities[rows[is_moved]] = 0.0
            return old.with_changes(
                environment=setup.environment,
                controller=controller,
                team=team,
                positions=positions,
                velocities=velocities,
            )

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
        """Return the row of each of these robots in the simulation, (n,); -1 for robots that it lacks."""
        row_by_number = {number: row for row, number in enumerate(self.setup.simulated_numbers)}
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
        positions = self.positions if continuation.positions is None else continuation.positions
        velocities = self.velocities if continuation.velocities is None else continuation.velocities
        conditions: Conditions | None = None
        if self.setup.follows_schedule:
            conditions = setup.conditions or Conditions()
        steering = None
        if old.steering is not None:
            # Robots that have just joined (row -1) start with heading and turning rate 0.
            steering = np.where(rows[:, None] < 0, 0.0, old.steering[rows])

        def build(positions: FloatArray, velocities: FloatArray) -> Simulation:
            return old.with_changes(
                environment=environment,
                controller=controller,
                team=team,
                steering=steering,
                positions=positions,
                velocities=velocities,
                conditions=conditions,
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
        self.trail.add(self.time, self.positions, always=True)


def select_working(snapshot: Snapshot, setup: PaneSetup) -> Snapshot:
    """Return the observations and decisions of the working robots from those of the whole simulation."""
    if not setup.follows_schedule:
        return snapshot
    return select_robots(snapshot, setup.simulated_rows)


def start_simulation(
    setup: PaneSetup,
    positions: FloatArray,
    dt: float,
    velocities: FloatArray | None = None,
    steering: FloatArray | None = None,
) -> Simulation:
    """Build the simulation of a pane at time 0.

    Parameters
    ----------
    setup : PaneSetup
        Map, controller and robots.
    positions : (n, 2) array, m
        Starting positions of the robots of the simulation.
    dt : float, s
        Control period.
    velocities : (n, 2) array or None, m/s
        Initial velocities; by default, robots are at rest.
    steering : (n, 2) array or None, rad and rad/s
        Initial headings and turning rates of unicycles.

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
    return _build_pane_scenario(setup, positions, dt, velocities, steering).build_simulation()


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
    # If the team follows a schedule, the simulation contains all robots, not only the working ones.
    robots = state.all_robots
    if robots is None:
        robots = TeamState(positions=state.positions, velocities=state.velocities, steering=state.steering)
    scenario = _build_pane_scenario(state.setup, robots.positions, dt, robots.velocities, robots.steering)
    simulation = scenario.build_simulation(steps=step, is_computed=True)
    memory = simulation.memory if state.memory is None else state.memory
    return simulation.with_memory(memory, state.inbox)


def _build_pane_scenario(
    setup: PaneSetup,
    positions: FloatArray,
    dt: float,
    velocities: FloatArray | None,
    steering: FloatArray | None = None,
) -> Scenario:
    """Build the scenario of a pane's setup that starts from a given state of the robots."""
    return Scenario(
        setup.simulated_environment,
        setup.controller.build(),
        team=setup.simulated_team,
        starts=positions,
        velocities=velocities,
        steering=steering,
        dt=dt,
        conditions=setup.conditions,
    )
