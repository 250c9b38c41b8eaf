"""The simulation of many runs of identical teams, advanced together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from robocov.conditions import Conditions
from robocov.conditions.communication import Inbox, Radio
from robocov.controllers import has_memory
from robocov.controllers.base import Controller
from robocov.controllers.individual import IndividualController
from robocov.defaults import DEFAULT_DT_S
from robocov.environment import Environment, require_environment
from robocov.errors import (
    ParameterError,
    StartError,
    format_count,
    require_number,
    require_whole_number,
    to_floats,
)
from robocov.observation import Decision, Message, Observations, Scans, Snapshot, check_forces
from robocov.observation.neighbors import Neighbors
from robocov.record import Record, Recorder
from robocov.sensor import RangeSensor
from robocov.simulation.checks import check_dt, check_team, count_steps
from robocov.simulation.controller_caller import ControllerCaller
from robocov.simulation.sensing import build_observations, is_scan_due
from robocov.simulation.simulation import MAX_START_OVERLAP_M
from robocov.simulation.team_state import TeamState
from robocov.team import Team
from robocov.typing import BoolArray, FloatArray
from robocov.world import World
from robocov.world.free_positions import require_free_starts
from robocov.world.obstacle_pieces import build_obstacles

MAX_JOINT_TEAM_SIZE = 15
"""Maximum number of robots of a run for which the controller is called once for all runs. The cells of larger
teams come from a triangulation, for which one call per run is just as fast."""


class _BatchDecision(NamedTuple):
    """The decision for the robots of all runs in a step."""

    forces: FloatArray
    """(runs * n, 2) N, forces on the robots, run by run."""
    goals: FloatArray | None
    """(runs * n, 2) m; None if the controller has no goals."""
    memories: list[Any]
    """The memory of each run; a single one if the controller decides for all runs at once."""
    messages: list[Sequence[Sequence[Message]]]
    """The messages of each run; empty if the controller decides for all runs at once."""


class SimulationBatch:
    """Independent runs of identical teams in one environment, advanced together.

    Small teams under a controller without memory (RAPF, RPF, Lloyd, range-limited) take a fraction of the
    time of separate simulations. Any other controller is called once for each run.

    Parameters
    ----------
    environment : Environment
        Without moving obstacles.
    controller : Controller or IndividualController
        The same in all runs. A controller for one robot is called for every robot in turn.
    starts : (runs, n, 2) array, m
        Positions of the robots of each run, which are at rest.
    team : Team or None
        The team of each run; by default `Team.homogeneous(n)`.
    dt : float, s
        Control period.

    Attributes
    ----------
    team : Team
        The n robots of one run.

    Raises
    ------
    StartError
        If the shape of the starts is not (runs, n, 2), or a robot would start in a wall or in another robot.
    ParameterError
        If an obstacle moves, the control period is out of range, or team and starts differ in size.

    See Also
    --------
    Simulation : One run, which may have moving obstacles and conditions.

    Notes
    -----
    Robots of different runs neither see nor touch each other. A run of point robots is identical, bit for
    bit, to ``Simulation(environment, controller, starts[k], team, dt)``; unicycles agree to within rounding.

    Examples
    --------
    >>> import robocov as rc
    >>> rooms = rc.load_map("rooms")
    >>> starts = [rooms.start().sample(6, seed=seed) for seed in range(3)]
    >>> batch = rc.SimulationBatch(rooms, rc.Rapf(), starts)
    >>> batch.step()
    >>> batch.positions.shape
    (3, 6, 2)
    """

    def __init__(
        self,
        environment: Environment,
        controller: Controller | IndividualController,
        starts: FloatArray | Sequence[FloatArray],
        team: Team | None = None,
        dt: float = DEFAULT_DT_S,
    ) -> None:
        require_environment(environment)
        check_dt(dt)
        if environment.has_moving_obstacles:
            raise ParameterError(
                f"environment: expected a map without moving obstacles, got map {environment.name!r}"
            )
        positions = _to_starts(starts)
        run_count, robot_count, _ = positions.shape
        self.environment = environment
        self.team = check_team(team, robot_count)
        self.dt = dt
        self._steps = 0
        for start_positions in positions:
            require_free_starts(environment, start_positions, self.team, MAX_START_OVERLAP_M)
        self._controller_caller = ControllerCaller(controller, environment.static, time=0.0)
        self._joint_team = Team.concatenate([self.team] * run_count)
        self._rows = [slice(run * robot_count, (run + 1) * robot_count) for run in range(run_count)]
        obstacles = build_obstacles(environment)
        self._world = World(obstacles, self._joint_team, positions.reshape(-1, 2), runs=run_count)
        self.sensor = RangeSensor(obstacles.walls)
        self._complete_graphs: list[Neighbors] | None = None
        self._complete_joint_graph: Neighbors | None = None
        if np.isinf(self.team.communication_range).all():
            self._complete_graphs = [Neighbors(robot_count)] * run_count
            self._complete_joint_graph = Neighbors.combine(self._complete_graphs)
        # Step in which each run started, or was restarted.
        self._first_steps = [0] * run_count
        # Controllers that scan decide for each run separately, because a restarted run scans in other steps.
        self._decides_jointly = (
            robot_count <= MAX_JOINT_TEAM_SIZE
            and not has_memory(self.controller)
            and self._controller_caller.scanning is None
        )
        # There is one memory for all runs, or one for each.
        if self._decides_jointly:
            memories = [self._controller_caller.begin(environment.region, self._joint_team, self.time)]
        else:
            memories = [self._begin_run() for _ in range(run_count)]
        self._memories: list[Any] = memories
        self._radio = Radio(Conditions(), self.team.communication_range, dt)
        self._inboxes: list[Inbox | None] = [None] * run_count
        self._sent_bytes = np.zeros(run_count)
        self._clear_step_cache()

    def _clear_step_cache(self) -> None:
        """Discard the observations and the decision of the previous step."""
        self._graphs: list[Neighbors] | None = None
        self._observations: Observations | None = None
        # Whether the robots of each run scan in this step.
        self._scanning_runs: list[bool] = []
        self._decision: _BatchDecision | None = None

    def _begin_run(self) -> Any:
        """Return the memory of the robots of one run before their first decision."""
        return self._controller_caller.begin(self.environment.region, self.team, self.time)

    def __len__(self) -> int:
        """Return the number of runs."""
        return len(self._rows)

    def __repr__(self) -> str:
        runs = format_count(len(self), "run")
        robots = format_count(len(self.team), "robot")
        return (
            f"<SimulationBatch {self.controller.name} on {self.environment.name}, "
            f"{runs} of {robots}, at {self.time:.2f} s>"
        )

    @property
    def controller(self) -> Controller:
        """The controller of all teams."""
        return self._controller_caller.controller

    @property
    def time(self) -> float:
        """Simulation time, s."""
        return self._steps * self.dt

    @property
    def positions(self) -> FloatArray:
        """Positions of the robots' centers, (runs, n, 2) m."""
        return self._world.positions.reshape(len(self), -1, 2)

    @property
    def velocities(self) -> FloatArray:
        """Velocities, (runs, n, 2) m/s."""
        return self._world.velocities.reshape(len(self), -1, 2)

    @property
    def is_working(self) -> BoolArray:
        """Mask of the robots that have not failed, (runs, n) bool; in a batch, none fails."""
        return self._world.is_working.reshape(len(self), -1)

    def step(self, *, forces: FloatArray | None = None) -> None:
        """Advance all runs by one control step: observe, decide, move.

        Parameters
        ----------
        forces : (runs, n, 2) array or None, N
            Forces that replace the controller's, for example in reinforcement learning. The controller is
            then not called: its memory stays the same, and no controller messages are sent.

        Raises
        ------
        ParameterError
            If forces are not finite, their shape is not (runs, n, 2), or the controller fails.
        """
        next_memories = self._memories
        messages: list[Sequence[Sequence[Message]]] = []
        if forces is None:
            decision = self._observe_and_decide()
            joint_forces = decision.forces
            next_memories = decision.memories
            messages = decision.messages
        else:
            shape = (len(self), len(self.team), 2)
            joint_forces = check_forces(forces, shape, "forces").reshape(len(self._joint_team), 2)
        next_inboxes, sent_bytes = self._send_messages(messages)
        # Change the state only after everything that can fail.
        self._world.step(joint_forces, self.dt)
        self._memories = next_memories
        self._inboxes = next_inboxes
        self._sent_bytes += sent_bytes
        self._steps += 1
        self._clear_step_cache()

    def observe(self) -> Observations:
        """Return the current observations of the robots of all runs.

        Returns
        -------
        Observations
            Row ``r * n + i`` belongs to robot i of run r. Robots communicate only within their own run. If
            any run is due to scan, the observations contain scans of all robots.
        """
        if self._observations is None:
            scanning = self._controller_caller.scanning
            self._scanning_runs = [
                is_scan_due(scanning, self._steps - first_step, self.dt) for first_step in self._first_steps
            ]
            self._observations = build_observations(
                world=self._world,
                sensor=self.sensor,
                environment=self.environment,
                neighbors=self._get_joint_graph(),
                time=self.time,
                scanning=scanning if any(self._scanning_runs) else None,
            )
        return self._observations

    def observe_run(self, run: int) -> Observations:
        """Return the current observations of the robots of one run, as `Simulation.observe` does.

        Parameters
        ----------
        run : int
            Index of the run, from 0.

        Returns
        -------
        Observations

        Raises
        ------
        ParameterError
            If there is no such run.
        """
        run = self._require_run(run)
        observations = self.observe()
        rows = self._rows[run]
        scans = observations.scans if self._scanning_runs[run] else None
        if scans is not None:
            scans = Scans(scans.distances[rows], scans.is_hit[rows])
        return replace(
            observations,
            positions=observations.positions[rows],
            velocities=observations.velocities[rows],
            neighbors=self._get_graphs()[run],
            obstacle_points=observations.obstacle_points[rows],
            max_speeds=self.team.max_speed,
            scans=scans,
            steering=None if observations.steering is None else observations.steering[rows],
        )

    def _require_run(self, run: Any) -> int:
        """Return the index of a run as an int; raise ParameterError unless there is such a run."""
        return int(require_number("run", run, 0, len(self) - 1, whole=True))

    def _get_graphs(self) -> list[Neighbors]:
        """Return the communication graph of each run in this step."""
        if self._complete_graphs is not None:
            return self._complete_graphs
        if self._graphs is None:
            ranges = self.team.communication_range
            self._graphs = [Neighbors.from_ranges(self._world.positions[rows], ranges) for rows in self._rows]
        return self._graphs

    def _get_joint_graph(self) -> Neighbors:
        """Return the communication graph of all robots, which links only those of the same run."""
        if self._complete_joint_graph is not None:
            return self._complete_joint_graph
        return Neighbors.combine(self._get_graphs())

    def _observe_and_decide(self) -> _BatchDecision:
        """Return the decision for this step, computing it only once."""
        if self._decision is None:
            if self._decides_jointly:
                observations = [self.observe()]
            else:
                observations = [self._receive_messages(run) for run in range(len(self))]
            decisions = [
                self._controller_caller.decide(observed, memory)
                for observed, memory in zip(observations, self._memories, strict=True)
            ]
            self._decision = _BatchDecision(
                forces=np.concatenate([decision.forces for decision in decisions]),
                goals=_join_goals(decisions),
                memories=[decision.memory for decision in decisions],
                messages=[] if self._decides_jointly else [decision.messages for decision in decisions],
            )
        return self._decision

    def _receive_messages(self, run: int) -> Observations:
        """Return the observations of one run, with the messages that were sent in the previous step."""
        _, observations = self._radio.receive_messages(self._inboxes[run], self._steps, self.observe_run(run))
        return observations

    def _send_messages(
        self, messages: list[Sequence[Sequence[Message]]]
    ) -> tuple[list[Inbox | None], FloatArray]:
        """Return the inboxes of all runs after messages were sent, and the bytes that were sent in each run.

        The messages arrive in the next step.
        """
        inboxes: list[Inbox | None] = [None] * len(self)
        sent_bytes = np.zeros(len(self))
        is_working = np.ones(len(self.team), dtype=bool)
        for run, run_messages in enumerate(messages):
            # No inbox is passed, because all earlier messages have arrived: there are no delays.
            positions = self._world.positions[self._rows[run]]
            inboxes[run], sent_bytes[run] = self._radio.send_messages(
                None, self._steps, run_messages, positions, is_working
            )
        return inboxes, sent_bytes

    def restart(self, run: int, starts: FloatArray) -> None:
        """Restart one run from other positions. The simulation time of the batch continues.

        Parameters
        ----------
        run : int
            Index of the run, from 0.
        starts : (n, 2) array, m
            Positions of the run's robots, which are at rest.

        Raises
        ------
        ParameterError
            If there is no such run.
        StartError
            If there is not one start for each robot, or a robot would start in a wall or in another robot.
        """
        run = self._require_run(run)
        positions = TeamState(starts).positions
        if len(positions) != len(self.team):
            raise StartError(
                f"starts: expected one for each of {len(self.team)} robots, got {len(positions)}"
            )
        require_free_starts(self.environment, positions, self.team, MAX_START_OVERLAP_M)
        self._world.place(run, positions)
        self._first_steps[run] = self._steps
        if not self._decides_jointly:
            self._memories = [*self._memories[:run], self._begin_run(), *self._memories[run + 1 :]]
            self._inboxes = [*self._inboxes[:run], None, *self._inboxes[run + 1 :]]
        self._clear_step_cache()

    def run(
        self, duration: float, *, start: str | None = None, seeds: Sequence[int] | None = None
    ) -> list[Record]:
        """Simulate all runs for some time and record each.

        Parameters
        ----------
        duration : float, s
            Time to simulate.
        start : str or None
            Name of the start from which the positions were sampled, for the records.
        seeds : sequence of int, or None
            Seed of each run, from which its positions were sampled, for the records.

        Returns
        -------
        list of Record
            One for each run.

        Raises
        ------
        ParameterError
            If the duration is negative or not finite, there is not one valid seed for each run, or the
            controller fails.
        """
        if seeds is not None:
            if len(seeds) != len(self):
                raise ParameterError(f"seeds: expected {len(self)}, one for each run, got {len(seeds)}")
            for run, seed in enumerate(seeds):
                require_whole_number(f"seeds[{run}]", seed, 0)
        steps = count_steps(duration, self.dt)
        recorder = Recorder(self.environment, self._joint_team, self.controller, self.dt, start=start)
        recorder.add(self._to_snapshot())
        sent_bytes = [self._sent_bytes.copy()]
        for _ in range(steps):
            self.step()
            recorder.add(self._to_snapshot())
            sent_bytes.append(self._sent_bytes.copy())
        joint_record = recorder.record()
        records = []
        for run, run_bytes in enumerate(np.transpose(sent_bytes)):
            run_seed = None if seeds is None else int(seeds[run])
            record = self._extract_record(joint_record, run, seed=run_seed)
            # Records of runs without messages have no sent bytes.
            if run_bytes.any():
                record = replace(record, sent_bytes=run_bytes.copy())
            records.append(record)
        return records

    def _to_snapshot(self) -> Snapshot:
        """Return a snapshot of all runs, which contains what a record needs."""
        decision = self._observe_and_decide()
        return Snapshot(self.observe(), Decision(forces=decision.forces, goals=decision.goals))

    def _extract_record(self, joint_record: Record, run: int, seed: int | None) -> Record:
        """Return the record of one run."""
        arrays = {
            name: getattr(joint_record, name)[:, self._rows[run]].copy()
            for name in joint_record.arrays
            if name != "time"
        }
        return replace(joint_record, team=self.team, seed=seed, **arrays)

    def __getstate__(self) -> dict[str, Any]:
        # The observations and the decision of this step are computed again on demand.
        return {**vars(self), "_graphs": None, "_observations": None, "_decision": None}


def _to_starts(starts: Any) -> FloatArray:
    """Return the start positions of all runs, (runs, n, 2) m."""
    positions = to_floats("starts", starts, "[x, y] of each robot of each run in meters", StartError)
    if positions.ndim != 3 or positions.shape[2] != 2 or 0 in positions.shape:
        raise StartError(
            "starts: expected an array of shape (runs, n, 2) with runs >= 1 and n >= 1, "
            f"got shape {positions.shape}"
        )
    return positions


def _join_goals(decisions: Sequence[Decision]) -> FloatArray | None:
    """Return the goals of the robots of all runs, nan where there is none; None if no run has goals."""
    if all(decision.goals is None for decision in decisions):
        return None
    goals = []
    for decision in decisions:
        no_goals = np.full_like(decision.forces, np.nan)
        goals.append(no_goals if decision.goals is None else decision.goals)
    return np.concatenate(goals)
