"""Checking that robots use nothing but their own observations, by repeating the decisions of single robots.

First a run is recorded: its transcript contains the observations and the decisions of all steps. Then, for
each robot that is checked, the controller is called again in a new process with the observations of only this
robot. The simulation depends on the controller only through its decisions. Therefore, if forces, goals and
messages are the same in all steps, bit for bit, the run would have been the same if each of these robots had
been controlled by a separate process.

The input of a process depends on the information that the controller declares:

==========  ===========================================================================================
own         The state and measurements of one robot, the positions of its neighbors, and the messages that
            it has received.
shared map  The same; maps are shared by messages.
whole map   The same, and the map.
==========  ===========================================================================================

If the density is unknown, no process receives it: its sensor repeats the measurements that the robot has made
in the run, and raises an error for all others.

The rows of all other robots contain placeholders: positions drawn by the verifier, no velocity, no obstacle,
an empty scan. Only the oracle, whose robots decide together, receives the observations of all robots. Its
check shows that the decisions follow from the observations and the map, but ignores the limits of
communication.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from robocov.controllers.base import Information
from robocov.environment import Environment
from robocov.observation import Message, Observations, RecordedDensitySensor, Scans, Snapshot
from robocov.observation.neighbors import Neighbors
from robocov.observation.region import Region
from robocov.typing import BoolArray, FloatArray
from robocov_app.sweep.tasks import Task

_MAX_ATTEMPTS = 1000
"""Maximum number of attempts to draw random points in a region, which may be very thin."""


@dataclass(eq=False)
class Transcript:
    """Observations and decisions of a run, for all of its steps.

    Attributes
    ----------
    observations : list of Observations
        Observations of all robots in each step.
    working : list of (n,) bool array or None
        Mask of the working robots in each step; None if all are working.
    forces : list of (n, 2) array, N
        Forces that the controller commanded in each step.
    goals : list of (n, 2) array or None, m
        Goals in each step; None if the controller has none.
    messages : list of sequence of sequence of Message
        Messages that each robot sent in each step.
    """

    observations: list[Observations] = field(default_factory=list)
    working: list[BoolArray | None] = field(default_factory=list)
    forces: list[FloatArray] = field(default_factory=list)
    goals: list[FloatArray | None] = field(default_factory=list)
    messages: list[Sequence[Sequence[Message]]] = field(default_factory=list)

    def add(self, snapshot: Snapshot) -> None:
        """Append the observations and decisions of a step."""
        self.observations.append(snapshot.seen)
        self.working.append(snapshot.working)
        self.forces.append(snapshot.decision.forces)
        self.goals.append(snapshot.decision.goals)
        self.messages.append(snapshot.decision.messages)


@dataclass(frozen=True, eq=False)
class Replay:
    """The observations for which a controller is called again, in a separate process.

    Attributes
    ----------
    task : Task
        The run, from which the controller and the team are taken.
    robot : int or None
        Row of the robot that is checked; None for the whole team.
    observations : sequence of Observations
        Observations of each step, without those that the process must not receive.
    environment : Environment or None
        The map, if the controller may know it.
    """

    task: Task
    robot: int | None
    observations: Sequence[Observations]
    environment: Environment | None


@dataclass(frozen=True, eq=False)
class Decisions:
    """Decisions in a replay.

    Attributes
    ----------
    forces, goals, messages : list
        As in `Transcript`, for the steps up to an error.
    problem : str
        Error of the controller that ended the replay; empty if there was none.
    """

    forces: list[FloatArray] = field(default_factory=list)
    goals: list[FloatArray | None] = field(default_factory=list)
    messages: list[Sequence[Sequence[Message]]] = field(default_factory=list)
    problem: str = ""


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


def draw_substitutes(region: Region, count: int, rng: np.random.Generator) -> FloatArray:
    """Draw random positions in a region, (count, 2) m, as placeholders for the positions of robots."""
    low_x, low_y, high_x, high_y = region.bounds
    for _ in range(_MAX_ATTEMPTS):
        points = rng.uniform((low_x, low_y), (high_x, high_y), size=(16 * count, 2))
        inside = points[region.contains(points)]
        if len(inside) >= count:
            return np.asarray(inside[:count])
    return np.repeat(region.centroid[None], count, axis=0)


def build_replay(
    task: Task, transcript: Transcript, information: Information, robot: int | None, rng: np.random.Generator
) -> Replay:
    """Build the replay that checks a robot of a run.

    Parameters
    ----------
    task : Task
        The run.
    transcript : Transcript
        Observations and decisions of the run.
    information : Information
        The information that the controller declares. It determines the input of the process.
    robot : int or None
        Row of the robot; if None, the process receives the observations of all robots.
    rng : Generator
        Random numbers for the placeholders.

    Returns
    -------
    Replay
    """
    task = task.hide_unknown_density()
    environment = None
    if information == "whole map":
        environment = task.build_environment().static
    observations = transcript.observations
    if robot is not None:
        substitutes = draw_substitutes(observations[0].region, task.robots, rng)
        observations = [hide_others(each, robot, substitutes) for each in observations]
    return Replay(task, robot, observations, environment)


def find_difference(transcript: Transcript, replay: Replay, decisions: Decisions) -> str | None:
    """Find the first difference between the decisions of a run and those of a replay.

    Parameters
    ----------
    transcript : Transcript
        Observations and decisions of the run.
    replay : Replay
        The replay of the run.
    decisions : Decisions
        Decisions in the replay.

    Returns
    -------
    str or None
        Description of the difference; None if there is none. Decisions of failed robots are ignored.
    """
    checked = np.array([replay.robot])
    if replay.robot is None:
        checked = np.arange(len(transcript.forces[0]))
    for step, observations in enumerate(transcript.observations):
        working = transcript.working[step]
        robots = checked if working is None else checked[working[checked]]
        if step >= len(decisions.forces):
            reason = decisions.problem or "the process ended"
            return f"{_format_robot(replay.robot)} in a separate process: {reason}"
        is_same = _have_same_rows(transcript.forces[step], decisions.forces[step], robots)
        is_same &= _have_same_rows(transcript.goals[step], decisions.goals[step], robots)
        is_same &= _have_same_messages(transcript.messages[step], decisions.messages[step], robots)
        if not is_same.all():
            robot = int(robots[~is_same][0])
            return (
                f"robot {robot + 1} decides differently from {observations.time:.2f} s on "
                f"if its process receives only {_describe_knowledge(replay)}"
            )
    return None


def _have_same_rows(expected: FloatArray | None, actual: FloatArray | None, robots: Any) -> BoolArray:
    """Return a mask of the k robots whose rows are the same in two arrays, bit for bit."""
    if expected is None or actual is None:
        return np.full(len(robots), expected is actual)
    pairs = zip(expected[robots], actual[robots], strict=True)
    return np.array([first.tobytes() == second.tobytes() for first, second in pairs], dtype=bool)


def _have_same_messages(
    expected: Sequence[Sequence[Message]], actual: Sequence[Sequence[Message]], robots: Any
) -> BoolArray:
    """Return a mask of the k robots whose sent messages are the same."""
    if not expected and not actual:
        return np.ones(len(robots), dtype=bool)
    is_same = []
    for robot in robots:
        own_expected = expected[robot] if expected else ()
        own_actual = actual[robot] if actual else ()
        is_same.append(is_same_content(_list_contents(own_expected), _list_contents(own_actual)))
    return np.array(is_same, dtype=bool)


def _list_contents(messages: Sequence[Message]) -> list[tuple[int, Any]]:
    return [(message.size, message.payload) for message in messages]


def is_same_content(first: Any, second: Any) -> bool:
    """Return whether two objects have the same content, bit for bit.

    Arrays, containers and objects with attributes are compared by their content, floats by their bits.

    Parameters
    ----------
    first, second : object

    Returns
    -------
    bool

    Examples
    --------
    >>> is_same_content([1.0, {"map": np.zeros(3)}], [1.0, {"map": np.zeros(3)}])
    True
    >>> is_same_content((0.0,), (-0.0,))
    False
    """
    if type(first) is not type(second):
        return False
    if isinstance(first, np.ndarray):
        if first.dtype != second.dtype or first.shape != second.shape:
            return False
        if first.dtype.hasobject:
            return is_same_content(first.tolist(), second.tolist())
        return bool(first.tobytes() == second.tobytes())
    if isinstance(first, float):
        return bool(first.hex() == second.hex())
    if isinstance(first, Mapping):
        return is_same_content(list(first.items()), list(second.items()))
    if isinstance(first, list | tuple):
        pairs = zip(first, second, strict=False)
        return len(first) == len(second) and all(is_same_content(*pair) for pair in pairs)
    if isinstance(first, str | bytes | int | None | set | frozenset):
        return bool(first == second)
    return _get_attributes(first) == {} or is_same_content(_get_attributes(first), _get_attributes(second))


def _get_attributes(value: Any) -> dict[str, Any]:
    """Return the attributes of an object, including those in slots, by name."""
    names = [name for kind in type(value).__mro__ for name in getattr(kind, "__slots__", ())]
    attributes = {name: getattr(value, name) for name in names if hasattr(value, name)}
    return {**attributes, **getattr(value, "__dict__", {})}


def _format_robot(robot: int | None) -> str:
    return "the team" if robot is None else f"robot {robot + 1}"


def _describe_knowledge(replay: Replay) -> str:
    knowledge = "the observations of the team"
    if replay.robot is not None:
        knowledge = "its own observations"
    if replay.environment is not None:
        knowledge += " and the map"
    return knowledge
