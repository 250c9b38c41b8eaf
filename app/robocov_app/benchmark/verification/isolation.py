"""A team controlled by separate processes, each of which receives only the observations of its robot.

During a verification, the code of a controller is never in the process that simulates the run, records it and
computes its metrics. That process, the referee, calls an `IsolatedTeam`, which asks other processes for a
decision in each step:

- One process decides for the whole team. Its decisions are executed.
- For each robot that is checked, another process receives only the observations of this robot. Its decision
  must be the same as that for the team, bit for bit. The process of the team does not know which robots are
  checked.

No process receives the observations of a step before it has decided on the previous step, so none can infer
from later observations what the team did. If the decisions of a robot are the same in all steps, the run
would have been the same if a separate process had controlled this robot.

The input of a process depends on the information that the controller declares:

==========  ===========================================================================================
own         The state and measurements of one robot, the positions of its neighbors, and the messages that
            it has received.
shared map  The same; maps are shared by messages.
whole map   The same, and the map.
==========  ===========================================================================================

If the density is unknown, no process has it: the referee measures it on behalf of that robot, within its
sensing range.

The rows of all other robots contain placeholders: positions drawn by the verifier, no velocity, no obstacle,
an empty scan. Only the oracle, whose robots decide together, has no processes for single robots. Its check
shows that its decisions follow from the observations and the map, but ignores the limits of communication.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import chain
from typing import Any, Protocol

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
from robocov_app.benchmark.verification.controller_messages import Setup

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

    def send_observations(self, observations: Observations) -> None:
        """Receive the observations of a step."""

    def receive_decision(self, measure: Any) -> Decision:
        """Return the decision for these observations; raise RobocovError if there is none."""


class IsolatedTeam:
    """Controller of a simulation whose decisions are made elsewhere; see the description of this module.

    Parameters
    ----------
    code : ControllerCode
        The controller.
    team : Decider
        Decides for all robots.
    robots : mapping of int to Decider
        The processes of the robots that are checked, by row.
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
        robots: Mapping[int, Decider],
        *,
        scanning: Scanning | None,
        environment: Environment | None,
        may_send_messages: bool,
        rng: np.random.Generator,
    ) -> None:
        self.scanning = scanning
        self.differences: list[str] = []
        self.declared_bytes = 0
        self.compressed_bytes = 0
        self._may_send_messages = may_send_messages
        self._has_reported_messages = False
        self._code = code
        self._team = team
        self._robots = dict(robots)
        self._environment = environment
        self._rng = rng
        self._substitutes = np.zeros((0, 2))
        self._team_decision: Decision | None = None
        self._own_decisions: dict[int, Decision] = {}

    def begin(self, region: Region, team: Team) -> None:
        """Send all processes what they know before the first step, and wait until they are ready."""
        self._substitutes = sample_substitutes(region, len(team), self._rng)
        deciders: list[tuple[int | None, Decider]] = [(None, self._team), *self._robots.items()]
        for robot, decider in deciders:
            decider.begin(Setup(self._code, robot, self._environment, region, team))
        self._team.wait_until_ready()
        for robot, decider in list(self._robots.items()):
            try:
                decider.wait_until_ready()
            except RobocovError as error:
                self._stop_checking(robot, f"in a separate process: {error}")

    def decide(self, seen: Observations, memory: object) -> Decision:
        """Return the decision for the team, after all processes have decided."""
        self._team.send_observations(seen)
        for robot, decider in self._robots.items():
            decider.send_observations(hide_others(seen, robot, self._substitutes))
        sensor = seen.density_sensor
        team_decision = self._team.receive_decision(None if sensor is None else sensor.measure)
        self._team_decision = team_decision
        if any(team_decision.messages):
            self._report_messages(seen.time)
            self._measure_messages(team_decision)
        self._own_decisions = {}
        for robot, decider in list(self._robots.items()):
            own_sensor = None if sensor is None else _OwnSensor(sensor, robot)
            try:
                self._own_decisions[robot] = decider.receive_decision(
                    None if own_sensor is None else own_sensor.measure
                )
            except RobocovError as error:
                self._stop_checking(robot, f"in a separate process: {error}")
        return team_decision

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

    def compare_decisions(self, snapshot: Snapshot) -> None:
        """Compare the decisions of the latest step. Those of failed robots have no effect and are ignored."""
        assert self._team_decision is not None
        for robot, own_decision in self._own_decisions.items():
            if snapshot.is_working is not None and not snapshot.is_working[robot]:
                continue
            if not _is_same_decision(self._team_decision, own_decision, robot):
                self._stop_checking(
                    robot,
                    f"decides differently from {snapshot.time:.2f} s on "
                    f"if its process receives only {self._describe_knowledge()}",
                )

    def _stop_checking(self, robot: int, difference: str) -> None:
        """Note the first difference of a robot, whose process then receives nothing more."""
        self.differences.append(f"robot {robot + 1} {difference}")
        del self._robots[robot]

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


def _is_same_decision(team_decision: Decision, own_decision: Decision, robot: int) -> bool:
    """Return whether two decisions agree for a robot in force, goal and messages, bit for bit."""
    if not _is_same_row(team_decision.forces, own_decision.forces, robot):
        return False
    if not _is_same_row(team_decision.goals, own_decision.goals, robot):
        return False
    return _list_message_contents(team_decision, robot) == _list_message_contents(own_decision, robot)


def _is_same_row(first: FloatArray | None, second: FloatArray | None, robot: int) -> bool:
    if first is None or second is None:
        return first is second
    return bool(first[robot].tobytes() == second[robot].tobytes())


def _list_message_contents(decision: Decision, robot: int) -> list[tuple[int, Any]]:
    """Return the size and payload of each message sent by a robot."""
    messages: Sequence[Message] = decision.messages[robot] if decision.messages else ()
    return [(message.size, message.payload) for message in messages]
