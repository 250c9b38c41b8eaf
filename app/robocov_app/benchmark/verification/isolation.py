"""A team controlled by a separate process, and robots whose decisions are repeated in processes of their own.

During a verification, the code of a controller is never in the process that simulates the run, records it and
computes its metrics. That process, the referee, calls an `IsolatedTeam`, which asks other processes for
decisions:

- During the run, one process decides for the whole team. Its decisions are executed. It does not know which
  robots are checked, and ends with the run.
- After the run, a new process for each robot that is checked receives the recorded observations of this
  robot, one step after the other. Its decisions must be the same as those for the team, bit for bit.

Only one of these processes exists at a time, so none can learn anything from the timing or the processor load
of another. No process receives the observations of a step before it has decided on the previous step, so none
can infer from later observations what the team did. If the decisions of a robot are the same in all steps,
the run would have been the same if a separate process had controlled this robot.

The input of a process depends on the information that the controller declares:

==========  ===========================================================================================
own         The state and measurements of one robot, the positions of its neighbors, and the messages that
            it has received.
shared map  The same; maps are shared by messages.
whole map   The same, and the map.
==========  ===========================================================================================

If the density is unknown, no process has it, except those of the controllers of CoverageControl: the referee
measures it on behalf of that robot, within its sensing range.

The rows of all other robots contain placeholders: positions drawn by the verifier, no velocity, no obstacle,
an empty scan. The oracle and the controllers of CoverageControl, which decide for all robots at once, have
no processes for single robots. Their check shows that their decisions follow from the observations and the
map, but ignores the limits of communication.
"""

from __future__ import annotations

import pickle
import tempfile
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any, Protocol, Self

import numpy as np

from robocov.environment import Environment
from robocov.errors import RobocovError
from robocov.observation import (
    Decision,
    DensitySensor,
    Message,
    Observations,
    RecordedDensitySensor,
    Scanning,
    Scans,
    Snapshot,
)
from robocov.observation.neighbors import Neighbors
from robocov.observation.region import Region
from robocov.team import Team
from robocov.typing import BoolArray, FloatArray, IntArray
from robocov_app.benchmark.controller_code import ControllerCode
from robocov_app.benchmark.verification.controller_messages import Setup, Step, StepEncoder

_MAX_ATTEMPTS = 1000
"""Maximum number of attempts to sample random points in a region, which may be very thin."""


def hide_others(observations: Observations, robot: int, substitutes: FloatArray) -> Observations:
    """Return the observations of one robot, with placeholders in the rows of the others.

    Parameters
    ----------
    observations : Observations
        Observations of all robots.
    robot : int
        Row of the robot.
    substitutes : (n, 2) array, m
        Placeholders for positions that the robot does not know.

    Returns
    -------
    Observations
    """
    robot_count = len(observations.positions)
    is_own = np.arange(robot_count) == robot
    is_neighbor = is_own.copy()
    is_neighbor[observations.neighbors.list_neighbors(robot)] = True
    is_known_position = is_own
    # If positions are reported by messages, a robot knows those in the messages, not the true ones.
    if observations.reported_positions is None or observations.neighbors.is_complete:
        is_known_position = is_neighbor
    hidden = replace(
        observations,
        positions=_freeze(np.where(is_known_position[:, None], observations.positions, substitutes)),
        velocities=_freeze(np.where(is_own[:, None], observations.velocities, 0.0)),
        obstacle_points=_freeze(np.where(is_own[:, None], observations.obstacle_points, np.nan)),
    )
    if observations.max_speeds is not None:
        own_speed = observations.max_speeds[robot]
        hidden.max_speeds = _freeze(np.where(is_neighbor, observations.max_speeds, own_speed))
    if observations.steering is not None:
        hidden.steering = _freeze(np.where(is_own[:, None], observations.steering, 0.0))
    if observations.scans is not None:
        hidden.scans = _hide_scans(observations.scans, is_own)
    if observations.messages:
        hidden.messages = [observations.messages[k] if k == robot else () for k in range(robot_count)]
    if observations.density_sensor is not None:
        hidden.density_sensor = RecordedDensitySensor(observations.density_sensor.log, robot)
    if observations.send_limits is not None:
        hidden.send_limits = _freeze(np.where(is_own, observations.send_limits, 0))
    return _hide_links(hidden, robot)


def _hide_scans(scans: Scans, is_own: BoolArray) -> Scans:
    """Return scans in which other robots measure nothing: all their rays have length 0."""
    distances = np.where(is_own[:, None], scans.distances, 0.0)
    return Scans(_freeze(distances), _freeze(scans.is_hit & is_own[:, None]))


def _hide_links(observations: Observations, robot: int) -> Observations:
    """Return observations without the links and reports that a robot cannot know.

    A robot that knows the current positions of its neighbors also knows which of them are neighbors.
    """
    neighbors = observations.neighbors
    if neighbors.indptr is None or neighbors.indices is None:
        return observations
    start, stop = neighbors.indptr[robot : robot + 2]
    first, second = neighbors.list_pairs()
    is_known_link = first == robot
    if observations.reported_positions is None:
        is_neighbor = np.zeros(neighbors.robot_count, dtype=bool)
        is_neighbor[neighbors.indices[start:stop]] = True
        is_neighbor[robot] = True
        is_known_link = is_neighbor[first] & is_neighbor[second]
    links = Neighbors.from_pairs(
        neighbors.robot_count, first[is_known_link], second[is_known_link], neighbors.ranges
    )
    hidden = replace(observations, neighbors=links)
    if observations.reported_positions is not None:
        hidden.reported_positions = observations.reported_positions[start:stop].copy()
    if observations.report_ages is not None:
        hidden.report_ages = observations.report_ages[start:stop].copy()
    return hidden


def _freeze(array: Any) -> Any:
    """Make an array read-only, and return it."""
    array.setflags(write=False)
    return array


def sample_substitutes(region: Region, count: int, rng: np.random.Generator) -> FloatArray:
    """Sample random positions in a region, (count, 2) m, as placeholders for the positions of robots."""
    low_x, low_y, high_x, high_y = region.bounds
    for _ in range(_MAX_ATTEMPTS):
        points = rng.uniform((low_x, low_y), (high_x, high_y), size=(16 * count, 2))
        inside = points[region.contains(points)]
        if len(inside) >= count:
            return np.asarray(inside[:count])
    return np.repeat(region.centroid[None], count, axis=0)


class Decider(Protocol):
    """Something that decides for a robot or for the team, such as a `ControllerProcess`."""

    def begin(self, setup: Setup) -> None:
        """Receive what is known before the first step."""

    def wait_until_ready(self) -> None:
        """Wait until the controller is ready; raise RobocovError if it fails."""

    def send_step(self, step: Step) -> None:
        """Receive the observations of a step."""

    def receive_decision(self, measure: Any) -> Decision:
        """Return the decision for these observations; raise RobocovError if there is none."""


@dataclass(frozen=True, eq=False)
class _RobotStep:
    """The observations and the decision of a robot in a step.

    Attributes
    ----------
    time : float, s
        Simulation time.
    step : Step
        The observations of this robot.
    decision : tuple
        The decision of the team's process for this robot; see `_extract_robot_decision`.
    is_working : bool
        Whether the robot works, so that its decision has an effect.
    """

    time: float
    step: Step
    decision: tuple[Any, ...]
    is_working: bool


class _RobotRecord:
    """All steps of a robot, in a temporary file, because messages with maps may need a lot of memory."""

    def __init__(self) -> None:
        self._encoder = StepEncoder()
        self._file = tempfile.TemporaryFile()  # noqa: SIM115

    def encode(self, observations: Observations) -> Step:
        """Return a step with observations, without what earlier steps contain."""
        return self._encoder.encode(observations)

    def add(self, robot_step: _RobotStep) -> None:
        """Record a step."""
        pickle.dump(robot_step, self._file, protocol=pickle.HIGHEST_PROTOCOL)

    def read(self) -> Iterator[_RobotStep]:
        """Yield all steps in order."""
        self._file.seek(0)
        while True:
            try:
                yield pickle.load(self._file)
            except EOFError:
                return

    def close(self) -> None:
        """Remove the file."""
        self._file.close()


class IsolatedTeam:
    """Controller of a simulation whose decisions are made elsewhere; see the description of this module.

    As a context manager, it removes the records of the robots at the end.

    Parameters
    ----------
    code : ControllerCode
        The controller.
    team : Decider
        Decides for all robots.
    robots : sequence of int
        Rows of the robots that will be checked after the run.
    scanning : Scanning or None
        Settings of the range scans that the controller needs.
    environment : Environment or None
        The map, if the controller may know it.
    may_send_messages : bool
        Whether the information that the controller declares includes messages.
    rng : Generator
        Random numbers for the placeholders.

    Attributes
    ----------
    differences : list of str
        The first difference of each robot, and messages that the robots must not send.
    step_count : int
        Number of steps in which the team has decided.
    checked_robot_count : int
        Number of robots with at least one compared decision.
    declared_bytes : int
        Total size of the messages of all robots, as their controller declares it.
    compressed_bytes : int
        Total size of the compressed payloads of these messages.
    """

    name = label = "isolated"
    summary = "decides in separate processes"

    def __init__(
        self,
        code: ControllerCode,
        team: Decider,
        robots: Sequence[int],
        *,
        scanning: Scanning | None,
        environment: Environment | None,
        may_send_messages: bool,
        rng: np.random.Generator,
    ) -> None:
        self.scanning = scanning
        self.differences: list[str] = []
        self.step_count = 0
        self.checked_robot_count = 0
        self.declared_bytes = 0
        self.compressed_bytes = 0
        self._may_send_messages = may_send_messages
        self._has_reported_messages = False
        self._code = code
        self._team = team
        self._team_encoder = StepEncoder()
        self._records = {robot: _RobotRecord() for robot in robots}
        self._sensors: list[DensitySensor | None] = []
        self._environment = environment
        self._rng = rng
        self._substitutes = np.zeros((0, 2))
        self._setup: Setup | None = None
        self._seen: Observations | None = None
        self._decision: Decision | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        for record in self._records.values():
            record.close()

    def begin(self, region: Region, team: Team) -> None:
        """Send the process of the team what it knows before the first step, and wait until it is ready."""
        self._substitutes = sample_substitutes(region, len(team), self._rng)
        self._setup = Setup(self._code, None, self._environment, region, team)
        self._team.begin(self._setup)
        self._team.wait_until_ready()

    def decide(self, seen: Observations, memory: object) -> Decision:
        """Return the decision for the team."""
        self._team.send_step(self._team_encoder.encode(seen))
        sensor = seen.density_sensor
        decision = self._team.receive_decision(None if sensor is None else sensor.measure)
        self._seen = seen
        self._decision = decision
        if any(decision.messages):
            self._report_messages(seen.time)
            self._measure_messages(decision)
        return decision

    def _report_messages(self, time: float) -> None:
        """Note that robots send messages at a time, s, if they must not; the first time is enough."""
        if self._may_send_messages or self._has_reported_messages:
            return
        self._has_reported_messages = True
        self.differences.append(
            f'robots send messages from {time:.2f} s on, but declare the information "own"'
        )

    def _measure_messages(self, decision: Decision) -> None:
        """Add up the declared sizes of the messages, and those of their compressed payloads."""
        for message in chain.from_iterable(decision.messages):
            self.declared_bytes += message.size
            self.compressed_bytes += len(zlib.compress(message.payload))

    def record_step(self, snapshot: Snapshot) -> None:
        """Record what the robots that will be checked have observed and decided in the latest step."""
        assert self._seen is not None
        assert self._decision is not None
        self.step_count += 1
        # The log of the measurements of all robots would need a lot of memory.
        sensor = self._seen.density_sensor
        self._sensors.append(None if sensor is None else sensor.copy_without_log())
        for robot, record in self._records.items():
            own_observations = hide_others(self._seen, robot, self._substitutes)
            record.add(
                _RobotStep(
                    time=snapshot.time,
                    step=record.encode(own_observations),
                    decision=_extract_robot_decision(self._decision, robot),
                    is_working=snapshot.is_working is None or bool(snapshot.is_working[robot]),
                )
            )

    def check_robot(self, robot: int, decider: Decider) -> None:
        """Repeat the decisions of a robot in all recorded steps, and note the first one that differs.

        Decisions of a failed robot have no effect and are not compared.

        Parameters
        ----------
        robot : int
            Row of the robot.
        decider : Decider
            Decides for this robot only.
        """
        assert self._setup is not None
        is_compared = False
        try:
            decider.begin(replace(self._setup, robot=robot))
            decider.wait_until_ready()
            for sensor, recorded in zip(self._sensors, self._records[robot].read(), strict=True):
                decider.send_step(recorded.step)
                own_sensor = None if sensor is None else _OwnSensor(sensor, robot)
                decision = decider.receive_decision(None if own_sensor is None else own_sensor.measure)
                if not recorded.is_working:
                    continue
                is_compared = True
                if _extract_robot_decision(decision, robot) != recorded.decision:
                    self.differences.append(
                        f"robot {robot + 1} decides differently from {recorded.time:.2f} s on "
                        f"if its process receives only {self._describe_knowledge()}"
                    )
                    break
        except RobocovError as error:
            self.differences.append(f"robot {robot + 1} in a separate process: {error}")
        if is_compared:
            self.checked_robot_count += 1

    def _describe_knowledge(self) -> str:
        if self._environment is None:
            return "its own observations"
        return "its own observations and the map"


class _OwnSensor:
    """Measures an unknown density for a single robot.

    Parameters
    ----------
    sensor : DensitySensor
        Sensor of the team in this step.
    robot : int
        Row of the robot. All other robots measure 1.
    """

    def __init__(self, sensor: DensitySensor, robot: int) -> None:
        self._sensor = sensor
        self._robot = robot

    def measure(self, robots: IntArray, points: FloatArray) -> FloatArray:
        """Return the density at the points of the robot."""
        values = np.ones(len(points))
        is_own = robots == self._robot
        values[is_own] = self._sensor.measure(robots[is_own], points[is_own])
        return values


def _extract_robot_decision(decision: Decision, robot: int) -> tuple[Any, ...]:
    """Return the force, the goal and the messages of a robot, with bytes in place of arrays."""
    force = decision.forces[robot].tobytes()
    goal = None if decision.goals is None else decision.goals[robot].tobytes()
    messages: Sequence[Message] = decision.messages[robot] if decision.messages else ()
    return force, goal, [(message.size, message.payload) for message in messages]
