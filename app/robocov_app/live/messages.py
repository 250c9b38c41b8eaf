"""What the window and the process that computes the cost say to each other, over two pipes."""

from __future__ import annotations

import pickle
import struct
from dataclasses import dataclass, fields
from typing import IO, TYPE_CHECKING, Any, TypeAlias

import numpy as np

if TYPE_CHECKING:
    from robocov.arrays import Array, IntArray
    from robocov.cost import CoverageResult, Sites
    from robocov.environment import Environment
    from robocov_app.live.evaluation import Evaluation

_LENGTH = struct.Struct("<Q")

_INDICES = ("owner", "corner", "last_corner")


@dataclass(frozen=True, eq=False)
class Build:
    """Please prepare the cost of a map."""

    generation: int
    environment: Environment
    lattice: int


@dataclass(frozen=True, eq=False)
class Question:
    """Please evaluate the cost of (n, 2) m positions, of whatever map is ready.

    With a `point`, (2,) m, the shortest path from there to its nearest robot too; with `speeds`, (n,) m/s,
    the mean time until the first robot is at a place. What is said of the `topic` comes back with the answer.
    """

    time: float
    positions: Array
    topic: int = 0
    point: Array | None = None
    speeds: Array | None = None


@dataclass(frozen=True, eq=False)
class Building:
    """How far a map is.

    Attributes
    ----------
    generation : int
        Counts the maps.
    fraction : float
    seconds_left : float
        By what it has taken so far; at the start, by the sizes of the map.
    """

    generation: int
    fraction: float
    seconds_left: float


@dataclass(frozen=True, eq=False)
class Ready:
    """A map is ready; where obstacles move, once more before each answer, as it is at that time.

    Attributes
    ----------
    generation : int
    sites : Sites
    corners : (k, 2) m
        Where ways can bend.
    seconds : float
        What it took.
    weights : (m,) or None
        Of the sites; see `CoverageResult`.
    """

    generation: int
    sites: Sites
    corners: Array
    seconds: float
    weights: Array | None = None


@dataclass(frozen=True, eq=False)
class Values:
    """What differs from one result to the next; see `CoverageResult`."""

    generation: int
    time: float
    positions: Array
    mean_distance: float
    value: float
    uncovered_area: float
    distances: Array
    owner: IntArray
    corner: IntArray
    last_corner: IntArray
    seconds: float
    topic: int = 0
    path: Array | None = None
    travel_time: float | None = None


@dataclass(frozen=True, eq=False)
class Answer:
    """The cost of positions.

    Attributes
    ----------
    generation : int
        Of the map: an older one while the newest is not ready yet.
    time : float
        What the question said.
    result : CoverageResult
    seconds : float
        What the evaluation took.
    topic : int
        What the question said.
    path : (w, 2) m or None
        Way-points from the question's point to its nearest robot, both ends included; empty where none
        can come, None where nothing was asked, or the point is not free.
    travel_time : float, s, or None
        Mean time until the first robot is at a place; None where the question has no speeds.
    """

    generation: int
    time: float
    result: CoverageResult
    seconds: float
    topic: int = 0
    path: Array | None = None
    travel_time: float | None = None


@dataclass(frozen=True, eq=False)
class Failed:
    """Something went wrong: a map without a free site, a robot in an obstacle, or the process has ended.

    Attributes
    ----------
    generation : int
    message : str
        One line.
    """

    generation: int
    message: str


Event: TypeAlias = Building | Ready | Answer | Failed


def values_of(generation: int, question: Question, evaluation: Evaluation, seconds: float) -> Values:
    """Return what is to be sent of the answer to a question."""
    result = evaluation.result
    kept = {item.name: getattr(result, item.name) for item in fields(Values) if hasattr(result, item.name)}
    # half as long on the way
    kept |= {name: kept[name].astype(np.int32) for name in _INDICES}
    return Values(
        generation=generation,
        time=question.time,
        seconds=seconds,
        topic=question.topic,
        path=evaluation.path,
        travel_time=evaluation.travel_time,
        **kept,
    )


def answer_of(values: Values, ready: Ready) -> Answer:
    """Return the answer that values and what is known of their map make."""
    from robocov.cost import CoverageResult

    kept = {
        item.name: getattr(values, item.name) for item in fields(CoverageResult) if hasattr(values, item.name)
    }
    kept |= {name: kept[name].astype(np.intp) for name in _INDICES}
    result = CoverageResult(points=ready.sites.points, corners=ready.corners, weights=ready.weights, **kept)
    return Answer(
        values.generation,
        values.time,
        result,
        values.seconds,
        values.topic,
        values.path,
        values.travel_time,
    )


def send(stream: IO[bytes], message: object) -> None:
    """Write one message."""
    data = pickle.dumps(message, protocol=pickle.HIGHEST_PROTOCOL)
    stream.write(_LENGTH.pack(len(data)))
    stream.write(data)
    stream.flush()


def receive(stream: IO[bytes]) -> Any:
    """Read one message; None at the end, also in the midst of one."""
    head = stream.read(_LENGTH.size)
    if len(head) < _LENGTH.size:
        return None
    (length,) = _LENGTH.unpack(head)
    data = stream.read(length)
    return pickle.loads(data) if len(data) == length else None
