"""The simulation of one run. In each step, robots observe, the controller decides, and robots move."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from copy import copy, deepcopy
from dataclasses import is_dataclass, replace
from time import process_time
from typing import Any, NamedTuple

import numpy as np

from robocov.conditions import Conditions, JoinedRobot
from robocov.conditions.communication import Inbox, Radio
from robocov.conditions.perception import Perception, restrict_decision_to_working
from robocov.controllers.base import Controller
from robocov.controllers.individual import IndividualController
from robocov.defaults import DEFAULT_DT_S
from robocov.drawing import show
from robocov.environment import Environment, require_environment
from robocov.errors import format_count
from robocov.observation import Message, Observations, Snapshot, check_forces
from robocov.observation.neighbors import Neighbors
from robocov.record import Record, Recorder
from robocov.sensor import RangeSensor
from robocov.simulation.checks import (
    check_conditions,
    check_dt,
    check_joins,
    check_start_velocities,
    check_team,
    count_steps,
)
from robocov.simulation.controller_caller import ControllerCaller
from robocov.simulation.sensing import build_observations, get_known_map, is_scan_due
from robocov.simulation.team_state import TeamState, to_team_state
from robocov.team import Team
from robocov.typing import BoolArray, FloatArray
from robocov.world import MAX_PENETRATION_M, ChangingWorld, World
from robocov.world.free_positions import require_free_starts
from robocov.world.obstacle_pieces import build_moving_obstacles, build_obstacles, build_solid_pieces

MAX_START_OVERLAP_M = 1e-6
"""Maximum overlap of robots at rest, with walls or with each other, that is attributed to rounding."""


class _Knowledge(NamedTuple):
    """The observations of a step, and the inbox after the messages of the step were delivered."""

    observations: Observations
    inbox: Inbox | None


class Simulation:
    """The simulation of a team of robots under one controller in one environment.

    Parameters
    ----------
    environment : Environment
        The map.
    controller : Controller or IndividualController
        A controller for one robot is called for every robot in turn.
    starts : (n, 2) array, m, or TeamState
        Positions of robots at rest, or a state from which to continue.
    team : Team or None
        By default `Team.homogeneous(n)`.
    dt : float, s
        Control period. The physics divides it into substeps if it is longer than 0.02 s or robots are fast,
        and into finer ones for robots in contact.
    conditions : Conditions or None
        Imperfect sensing and communication, failing and joining robots; by default everything is ideal.

    Attributes
    ----------
    memory : object
        Memory of the robots, which the controller returned with its last decision.
    inbox : Inbox or None
        Messages that the robots have received, that are in flight, or that wait to be sent. None if robots
        know the positions of others without delay, and there are no controller messages.
    joined : tuple of JoinedRobot
        Robots that have joined since the simulation was built.
    decision_time : float
        Processor time for decisions so far, s.
    sent_bytes : int
        Total size of the controller messages that the robots have sent so far, received or not. Messages
        with positions are not included.

    Raises
    ------
    StartError
        If a robot would start in a wall or in another robot, or faster than `checks.MAX_START_VELOCITY_M_S`.
    ParameterError
        If the control period is out of range, team and starts differ in size, the conditions refer to other
        robots, or the controller cannot be used.

    See Also
    --------
    SimulationBatch : Many runs of identical teams, advanced together.

    Notes
    -----
    A step depends only on the state of the robots, their memory and messages, and the number of steps so
    far. A copy therefore continues identically, bit for bit.

    Examples
    --------
    >>> import robocov as rc
    >>> rooms = rc.load_map("rooms")
    >>> simulation = rc.Simulation(rooms, rc.Rapf(), rooms.start().sample(6, seed=0))
    >>> simulation.step()
    >>> simulation.positions.shape
    (6, 2)
    """

    def __init__(
        self,
        environment: Environment,
        controller: Controller | IndividualController,
        starts: FloatArray | list[list[float]] | TeamState,
        team: Team | None = None,
        dt: float = DEFAULT_DT_S,
        *,
        conditions: Conditions | None = None,
    ) -> None:
        require_environment(environment)
        check_dt(dt)
        state = to_team_state(starts)
        self.environment = environment
        self.team = check_team(team, robot_count=len(state))
        self.dt = dt
        self.conditions = check_conditions(conditions, robot_count=len(state))
        self.joined: tuple[JoinedRobot, ...] = ()
        self.decision_time = 0.0
        self.sent_bytes = 0
        self._steps = state.steps
        if not state.is_computed:
            check_joins(environment, self.conditions)
            if state.velocities is not None:
                check_start_velocities(state.velocities)
            _check_robots_fit(environment, self.team, state, self.conditions, self.time)
        known_map = get_known_map(environment, self.conditions)
        self._controller_caller = ControllerCaller(controller, known_map, self.time)
        self._world = self._build_world(state)
        self.sensor = RangeSensor(build_solid_pieces(environment), build_moving_obstacles(environment))
        has_team_changes = self.conditions is not None and self.conditions.has_team_changes
        self._has_changing_obstacles = environment.has_moving_obstacles or has_team_changes
        self._radio = Radio(self.conditions or Conditions(), self.team.communication_range, dt)
        self._perception: Perception | None = None
        self.inbox: Inbox | None = None
        if self.conditions is not None:
            self._perception = Perception(self.conditions, self.team, dt)
            self.inbox = self._perception.create_inbox()
        # With unlimited communication ranges, the graph is complete at any positions.
        self._complete_graph: Neighbors | None = None
        if np.isinf(self.team.communication_range).all():
            self._complete_graph = Neighbors(len(self.team))
        self.memory: Any = self._controller_caller.begin(environment.region, self.team, self.time)
        self._start_step()

    def _build_world(self, state: TeamState) -> World | ChangingWorld:
        """Build the physics with the robots in a given state."""
        if self.conditions is not None and self.conditions.has_team_changes:
            return ChangingWorld(
                self.conditions,
                self.environment,
                self.team,
                state.positions,
                state.velocities,
                steering=state.steering,
                time=self.time,
            )
        return World(
            build_obstacles(self.environment),
            self.team,
            state.positions,
            state.velocities,
            steering=state.steering,
        )

    def _start_step(self) -> None:
        """Discard the observations and the decision of the previous step, and set the time of the sensor."""
        self._knowledge: _Knowledge | None = None
        self._snapshot: Snapshot | None = None
        if self._has_changing_obstacles:
            self.sensor.set_time(self.time, self._world.failed_robots)

    def __repr__(self) -> str:
        robots = format_count(len(self.team), "robot")
        return (
            f"<Simulation {self.controller.name} on {self.environment.name}, {robots}, at {self.time:.2f} s>"
        )

    @property
    def controller(self) -> Controller:
        """The controller of the team."""
        return self._controller_caller.controller

    @property
    def time(self) -> float:
        """Simulation time, s."""
        return self._steps * self.dt

    @property
    def positions(self) -> FloatArray:
        """Positions of the robots' centers, (n, 2) m."""
        return self._world.positions

    @property
    def velocities(self) -> FloatArray:
        """Velocities, (n, 2) m/s."""
        return self._world.velocities

    @property
    def steering(self) -> FloatArray | None:
        """Heading and turning rate of unicycles, (n, 2) rad and rad/s; None in a team of point robots."""
        return self._world.steering

    @property
    def is_working(self) -> BoolArray:
        """Mask of the robots that are present and have not failed, (n,) bool."""
        return self._world.is_working

    def step(self, external_forces: FloatArray | None = None, *, forces: FloatArray | None = None) -> None:
        """Advance by one control step: observe, decide, move.

        Parameters
        ----------
        external_forces : (n, 2) array or None, N
            Forces that act in addition to the controller's, such as those of a pointer that drags a robot;
            see `World.step`. Records do not contain them.
        forces : (n, 2) array or None, N
            Forces that replace the controller's, for example in reinforcement learning. The controller is
            then not called: its memory stays the same, and no new controller messages are sent.

        Raises
        ------
        ParameterError
            If forces are not finite or not of shape (n, 2), or the controller fails.
        StartError
            If there is no space for a robot that joins. The robots have moved then, but time, memory and
            messages have not changed, so that the simulation must not be continued.
        """
        shape = (len(self.team), 2)
        if external_forces is not None:
            external_forces = check_forces(external_forces, shape, "external_forces")
        next_memory = self.memory
        messages: Sequence[Sequence[Message]] = ()
        if forces is None:
            decision = self.observe_and_decide().decision
            forces = decision.forces
            next_memory = decision.memory
            messages = decision.messages
        else:
            forces = check_forces(forces, shape, "forces")
        inbox = self.inbox
        if inbox is not None:
            # Deliver the messages of this step, even if `forces` replaces the decision.
            inbox = self._get_knowledge().inbox
        next_inbox, sent_bytes = self._radio.send_messages(
            inbox, self._steps, messages, self.positions, self.is_working
        )
        # The physics may raise an error, so everything else that belongs to the state changes after it.
        positions_before = self.positions
        self._world.step(forces, self.dt, external_forces, time=self.time)
        self.memory = next_memory
        self.inbox = next_inbox
        self.sent_bytes += sent_bytes
        self._steps += 1
        self.joined += self._find_new_robots(positions_before)
        self._start_step()

    def observe(self) -> Observations:
        """Return the current observations of the robots, without calling the controller.

        Returns
        -------
        Observations
        """
        return self._get_knowledge().observations

    def observe_and_decide(self) -> Snapshot:
        """Let the robots observe and the controller decide.

        Both happen once in each step: a second call before the next step returns the same snapshot.

        Returns
        -------
        Snapshot
            The current state, the observations of the robots and the decision of the controller.

        Raises
        ------
        ParameterError
            If the controller fails, or does not return a decision for each robot.
        """
        if self._snapshot is None:
            knowledge = self._get_knowledge()
            start_time = process_time()
            decision = self._controller_caller.decide(knowledge.observations, self.memory)
            self.decision_time += process_time() - start_time
            if self._perception is None:
                self._snapshot = Snapshot(knowledge.observations, decision, sent_bytes=self.sent_bytes)
            else:
                self._snapshot = Snapshot(
                    knowledge.observations,
                    restrict_decision_to_working(decision, self.is_working),
                    true_positions=self.positions,
                    is_working=self.is_working,
                    inbox=knowledge.inbox,
                    sent_bytes=self.sent_bytes,
                )
        return self._snapshot

    def _get_knowledge(self) -> _Knowledge:
        """Return the observations and the inbox of this step, computing them only once."""
        if self._knowledge is None:
            observations = self._sense()
            inbox = self.inbox
            if self._perception is not None:
                observations, inbox = self._perception.perceive(observations, inbox, self.is_working)
            inbox, observations = self._radio.receive_messages(inbox, self._steps, observations)
            self._knowledge = _Knowledge(observations, inbox)
        return self._knowledge

    def _sense(self) -> Observations:
        """Return the current observations of robots with ideal sensors and ideal communication."""
        neighbors = self._complete_graph
        if neighbors is None:
            neighbors = Neighbors.from_ranges(self.positions, self.team.communication_range)
        scanning = self._controller_caller.scanning
        return build_observations(
            world=self._world,
            sensor=self.sensor,
            environment=self.environment,
            neighbors=neighbors,
            time=self.time,
            scanning=scanning if is_scan_due(scanning, self._steps, self.dt) else None,
        )

    def _find_new_robots(self, positions_before: FloatArray) -> tuple[JoinedRobot, ...]:
        """Return the robots that joined at the end of the last step.

        `positions_before` are the positions before that step, when the row of a new robot still contained the
        position at which it was requested to join.
        """
        if self.conditions is None or not self.conditions.joins:
            return ()
        times = np.array([self.time - self.dt, self.time])
        was_present, is_present = self.conditions.find_present_robots(times, len(self.team))
        robots = np.flatnonzero(is_present & ~was_present & self.is_working)
        return tuple(
            JoinedRobot(
                robot=robot + 1,
                time=self.time,
                position=(float(self.positions[robot, 0]), float(self.positions[robot, 1])),
                requested_position=(float(positions_before[robot, 0]), float(positions_before[robot, 1])),
            )
            for robot in robots.tolist()
        )

    def snapshots(self, duration: float) -> Iterator[Snapshot]:
        """Simulate for some time, and yield the current snapshot and one after every step.

        Parameters
        ----------
        duration : float, s
            Time to simulate.

        Yields
        ------
        Snapshot

        Raises
        ------
        ParameterError
            If the duration is negative or not finite, or the controller fails.
        StartError
            If there is no space for a robot that joins.
        """
        steps = count_steps(duration, self.dt)
        yield self.observe_and_decide()
        for _ in range(steps):
            self.step()
            yield self.observe_and_decide()

    def run(self, duration: float, *, start: str | None = None, seed: int | None = None) -> Record:
        """Simulate for some time and record the run.

        Parameters
        ----------
        duration : float, s
            Time to simulate.
        start : str or None
            Name of the start from which the positions were sampled, for the record.
        seed : int or None
            Seed from which they were sampled, for the record.

        Returns
        -------
        Record

        Raises
        ------
        ParameterError
            If the duration is negative or not finite, the start or the seed cannot be recorded, or the
            controller fails.
        StartError
            If there is no space for a robot that joins.

        Examples
        --------
        >>> import robocov as rc
        >>> rooms = rc.load_map("rooms")
        >>> rc.Simulation(rooms, rc.Rapf(), rooms.start().sample(6, seed=0)).run(1.0)
        <Record rapf on Rooms, 6 robots, 1.0 s>
        """
        recorder = Recorder(
            self.environment,
            self.team,
            self.controller,
            self.dt,
            start=start,
            seed=seed,
            conditions=self.conditions,
        )
        for snapshot in self.snapshots(duration):
            recorder.add(snapshot)
        return recorder.record(self.joined)

    def show(self, *, height: int = 620) -> Any:
        """Show the simulation in an interactive window, or in a cell of a notebook.

        The window does not change this simulation. It starts at 0 s with the current positions, velocities
        and headings of the robots. Robots fail and join when they would in this simulation. They start
        without memories or messages, and the random numbers for noise and message loss start again from the
        first step.

        Parameters
        ----------
        height : int, px
            Height of the cell.

        Returns
        -------
        object
            See `robocov.show`.

        Raises
        ------
        ParameterError
            If the controller is not built in, obstacles have moved, or no robot works.
        RobocovError
            If the window cannot start.
        """
        return show(self, height=height)

    def copy(self) -> Simulation:
        """Return an independent simulation in the same state, which continues identically.

        Returns
        -------
        Simulation
        """
        duplicate = copy(self)
        duplicate._world = self._world.copy()
        duplicate.memory = deepcopy(self.memory)
        if self._has_changing_obstacles:
            duplicate.sensor = self.sensor.copy()
        # The snapshot contains the memory for the next step, which the two must not share.
        duplicate._start_step()
        return duplicate

    def __getstate__(self) -> dict[str, Any]:
        # The observations and the decision of this step are computed again on demand.
        return {**vars(self), "_knowledge": None, "_snapshot": None}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self._start_step()

    def with_density(self, environment: Environment) -> Simulation:
        """Return a simulation that continues from the same state with another density.

        Parameters
        ----------
        environment : Environment
            The current map with another density. A controller that knows the map receives this one.

        Returns
        -------
        Simulation
        """
        changed = self.copy()
        changed.environment = environment
        known_map = get_known_map(environment, self.conditions)
        changed._controller_caller = ControllerCaller(self.controller, known_map, self.time)
        return changed

    def with_memory(self, memory: Any, inbox: Inbox | None = None) -> Simulation:
        """Return a simulation in the same state, but with another memory.

        Parameters
        ----------
        memory : object
            Memory of the robots.
        inbox : Inbox or None
            Messages of the robots; by default the current ones.

        Returns
        -------
        Simulation
        """
        changed = self.copy()
        changed.memory = deepcopy(memory)
        if inbox is not None:
            changed.inbox = inbox
        return changed

    def with_changes(
        self,
        *,
        environment: Environment | None = None,
        controller: Controller | IndividualController | None = None,
        team: Team | None = None,
        positions: FloatArray | None = None,
        velocities: FloatArray | None = None,
        steering: FloatArray | None = None,
        conditions: Conditions | None = None,
    ) -> Simulation:
        """Return a changed copy of the simulation, which continues from the current state.

        The memory of the robots and the controller messages are dropped if the controller or the number of
        robots changes. All messages are dropped if the conditions or the number of robots change. If the
        memory is kept and is a dataclass with a field ``team``, as that of built-in controllers, it receives
        the new properties of the robots. Maps, plans and routes that were computed with the old ones stay
        until the controller computes new ones. The memory is not adapted to a new boundary.

        Parameters
        ----------
        environment, controller, team, conditions
            See `Simulation`. By default they do not change.
        positions, velocities, steering : (n, 2) arrays or None
            See `TeamState`. By default they do not change. If the number of robots changes, positions
            and velocities must be given.

        Returns
        -------
        Simulation

        Raises
        ------
        StartError
            If a robot overlaps a wall or another robot by more than contacts allow, or positions, velocities
            and steering differ in size.
        ParameterError
            If team and positions differ in size.
        """
        has_same_conditions = conditions is None
        has_same_controller = controller is None
        new_team = self.team if team is None else team
        has_same_size = len(new_team) == len(self.team)
        if steering is None and has_same_size:
            steering = self.steering
        positions = self.positions if positions is None else positions
        velocities = self.velocities if velocities is None else velocities
        environment = self.environment if environment is None else environment
        controller = self.controller if controller is None else controller
        conditions = self.conditions if conditions is None else conditions
        state = TeamState(positions=positions, velocities=velocities, steering=steering, steps=self._steps)
        changed = Simulation(environment, controller, state, new_team, self.dt, conditions=conditions)
        changed.joined = self.joined
        changed.decision_time = self.decision_time
        changed.sent_bytes = self.sent_bytes
        if has_same_size:
            _copy_knowledge(
                self, changed, copy_messages=has_same_conditions, has_same_controller=has_same_controller
            )
        return changed


def _copy_knowledge(
    source: Simulation, target: Simulation, *, copy_messages: bool, has_same_controller: bool
) -> None:
    """Copy the memory and the messages to a simulation of the same robots, unless they are invalid there.

    Another controller would understand neither the memory nor the controller messages. The memory of built-in
    controllers contains the team, whose properties may have changed.
    """
    if copy_messages:
        target.inbox = source.inbox
    if has_same_controller:
        memory = deepcopy(source.memory)
        if is_dataclass(memory) and isinstance(getattr(memory, "team", None), Team):
            memory = replace(memory, team=target.team)  # type: ignore[type-var]
        target.memory = memory
    elif target.inbox is not None:
        target.inbox = target.inbox.drop_messages()


def _check_robots_fit(
    environment: Environment, team: Team, state: TeamState, conditions: Conditions | None, time: float
) -> None:
    """Check that no working robot overlaps with a wall, another working robot or a failed one."""
    max_overlap = MAX_START_OVERLAP_M
    if state.velocities is not None:
        # Bodies in contact overlap a little, and a moving robot may be in contact.
        max_overlap = 2.0 * MAX_PENETRATION_M
    is_working = None if conditions is None else conditions.find_working_robots(time, len(state))
    is_failed = None if conditions is None else conditions.find_failed_robots(time, len(state))
    require_free_starts(environment.at(time), state.positions, team, max_overlap, is_working, is_failed)
