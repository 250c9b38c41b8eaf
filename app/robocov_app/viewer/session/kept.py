"""What is kept of a session: the run since the last touch, retraced step by step, as a record.

A record has one map, one controller and one team. So it begins where the last of these changed. Its
forces, goals and obstacle points are computed anew, by a simulation that retraces the run: it goes on
from moment to moment as the run did, finds what is missing where old moments were thinned out, and tells
where the run did not go its own way because a hand was in it. Who repeats the run from its ``run.json``
does the same; so what is said there is not only meant, but was tried.

``session`` in ``run.json`` is there where a run was not simply begun and left alone:

- ``began_at_s``: the time on the session's clock at which the record begins; the record's is 0 there;
- ``start_velocities_m_per_s``: where the robots did not start at rest;
- ``robots``, ``failed``: what people called the robots, row by row, and where those stand that failed,
  by their names; the map has these as obstacles;
- ``touched``: from when to when which robots were moved by hand;
- ``control_dt_s``: the control period, where moments are missing and ``dt_s``, their distance, is longer;
- ``repeatable``: whether the run can be repeated from the rest of the file.
"""

from __future__ import annotations

import pickle
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from robocov.controllers import remembers
from robocov.environment import CircleObstacle
from robocov.errors import RobocovError
from robocov.observation import Decision, Snapshot
from robocov.record import Recorder
from robocov_app.runs.saved import wreck_name
from robocov_app.viewer.session.history import State
from robocov_app.viewer.session.map_edits import with_obstacle
from robocov_app.viewer.session.pane import simulation_of
from robocov_app.viewer.session.past import Past

if TYPE_CHECKING:
    from collections.abc import Sequence

    from robocov.arrays import Array
    from robocov.environment import Environment
    from robocov.record import Record
    from robocov.simulation import Simulation
    from robocov_app.viewer.session.history import Circumstances

NEAR = 1e-6
"""Metres, and metres per second, by which rounding may lead a run astray; who is farther off was moved."""

_OF_THE_FARTHEST = 0.2
"""Who was led astray by less than so much of what the farthest was, was not touched."""


@dataclass(frozen=True, eq=False)
class Part:
    """One pane of what is to be kept.

    Attributes
    ----------
    circumstances : Circumstances
        They hold from the first moment to the last.
    memory : bytes or None
        What the controller remembered at the first moment, pickled: a controller of the user's must be
        loaded before it can be read. None where it can do without, empty where it cannot be sent.
    """

    circumstances: Circumstances
    memory: bytes | None

    @classmethod
    def of(cls, state: State) -> Part:
        """Return the pane that begins in a state."""
        circumstances = state.circumstances
        # without what has been derived already: that is quickly done again, and long to send
        plain = replace(circumstances, environment=replace(circumstances.environment))
        try:
            memory = None if state.memory is None else pickle.dumps(state.memory)
        except Exception:  # a user's controller may remember anything
            memory = b""
        return cls(plain, memory)


@dataclass(frozen=True, eq=False)
class Job:
    """What is to be kept, but for its moments, which follow.

    Attributes
    ----------
    folder : str
        It is there, and empty.
    dt : float, s
    start : str or None
    seed : int
        Where the starts of the session came from.
    parts : tuple of Part
    moments : int
        How many follow.
    lattice : int
        On which the coverage cost is evaluated.
    """

    folder: str
    dt: float
    start: str | None
    seed: int
    parts: tuple[Part, ...]
    moments: int
    lattice: int


@dataclass(frozen=True, eq=False)
class Moments:
    """Some moments in their order.

    Attributes
    ----------
    steps : (k,) int
    positions, velocities : tuple of (k, n, 2), m and m/s
        One of each for every pane.
    """

    steps: Array
    positions: tuple[Array, ...]
    velocities: tuple[Array, ...]


@dataclass(frozen=True)
class Kept:
    """All is written; with what is to be known about it."""

    remarks: tuple[str, ...]


@dataclass(frozen=True)
class NotKept:
    """Something went wrong; the message is one line."""

    message: str


class Moved(NamedTuple):
    """What a hand did between two steps.

    Attributes
    ----------
    since, until : int
        Steps.
    by : (n,) m
        How far each robot was led astray. Those that nobody touched may have been, too, by a little: while
        one is pulled, the steps of all are finer.
    """

    since: int
    until: int
    by: Array

    @property
    def rows(self) -> list[int]:
        """The robots that were touched."""
        return np.flatnonzero(self.by >= _OF_THE_FARTHEST * self.by.max()).tolist()


class Retracing:
    """Goes along the moments of one pane.

    Parameters
    ----------
    part : Part
    dt : float, s

    Attributes
    ----------
    snapshots : dict of step to Snapshot
        Without force terms and cells.
    moved : list of Moved
    proven : bool
        Whether a simulation could follow everywhere.
    """

    def __init__(self, part: Part, dt: float) -> None:
        self._circumstances, self._dt = part.circumstances, dt
        self.controller = part.circumstances.law.made()
        self.proven = True
        self._memory: Any = None
        if part.memory is not None:
            try:
                self._memory = pickle.loads(part.memory)
            except Exception:  # it could not be sent, or is of a class that is not what it was
                self.proven = False
        self.snapshots: dict[int, Snapshot] = {}
        self.moved: list[Moved] = []
        self._past = Past(dt)
        self._simulation: Simulation | None = None
        self._at = 0

    def take(self, step: int, positions: Array, velocities: Array) -> None:
        """Go on to the next moment."""
        between = self._stepped_to(step)
        simulation = self._simulation
        if simulation is not None:
            apart = np.hypot(*(simulation.positions - positions).T)
            faster = np.hypot(*(simulation.velocities - velocities).T)
            if apart.any() or faster.any():
                if max(apart.max(), faster.max()) > NEAR:
                    self._note(step, np.maximum(apart, faster * self._dt))
                    between = {}
                self._seat(step, positions, velocities)
        else:
            self._seat(step, positions, velocities)
        self.snapshots |= between
        self.snapshots[step] = self._seen(step, positions, velocities)
        self._at = step

    def _stepped_to(self, step: int) -> dict[int, Snapshot]:
        """Let the simulation go on to a step; return what was between."""
        found: dict[int, Snapshot] = {}
        if self._simulation is None:
            return found
        try:
            for at in range(self._at + 1, step + 1):
                self._simulation.step()
                if at < step:
                    found[at] = _trimmed(self._simulation.snapshot)
        except RobocovError:  # a user's controller may fail wherever it likes
            self._simulation, self.proven = None, False
            return {}
        return found

    def _note(self, step: int, by: Array) -> None:
        if self.moved and self.moved[-1].until == self._at:
            last = self.moved.pop()
            self.moved.append(Moved(last.since, step, last.by + by))
        else:
            self.moved.append(Moved(self._at, step, by))

    def _seat(self, step: int, positions: Array, velocities: Array) -> None:
        """Let the simulation go on from another state, with what the controller remembers."""
        try:
            if self._simulation is not None:
                self._memory = self._simulation.memory
                self._simulation = self._simulation.changed(positions=positions, velocities=velocities)
            else:
                self._simulation = simulation_of(
                    self._circumstances, positions, self._dt, velocities, step * self._dt
                )
                if self._memory is not None:
                    self._simulation = self._simulation.remembering(self._memory)
        except RobocovError:  # pressed into something by more than a simulation begins with
            self._simulation, self.proven = None, False

    def _seen(self, step: int, positions: Array, velocities: Array) -> Snapshot:
        if self._simulation is not None:
            try:
                return _trimmed(self._simulation.snapshot)
            except RobocovError:
                self._simulation, self.proven = None, False
        state = State(self._circumstances, positions, velocities, self._memory)
        snapshot = self._past.snapshot(state, step * self._dt)
        self._memory = snapshot.decision.memory
        return _trimmed(snapshot)


def _trimmed(snapshot: Snapshot) -> Snapshot:
    """Return what a record wants of a moment: there may be very many of them."""
    decision = snapshot.decision
    return Snapshot(snapshot.seen, Decision(decision.forces, decision.goals))


def evenly_spaced(steps: Sequence[int]) -> range:
    """Return the multiples of the least stride, a power of two, that are all there.

    They go as near to the first and the last of the ascending `steps` as they can.

    >>> evenly_spaced([5, 6, 7]), evenly_spaced([3, 4, 8, 10, 12, 13])
    (range(5, 8), range(4, 13, 4))
    """
    there, first, last = set(steps), steps[0], steps[-1]
    stride = 1
    while stride <= last:
        even = range(-(-first // stride) * stride, last - last % stride + 1, stride)
        if len(even) and there.issuperset(even):
            return even
        stride *= 2
    return range(last, last + 1)


def records_of(job: Job, retracings: Sequence[Retracing]) -> list[Record]:
    """Return a record for each pane, of the same moments."""
    common = set.intersection(*(set(each.snapshots) for each in retracings))
    steps = evenly_spaced(sorted(common))
    return [_record_of(job, part, each, steps) for part, each in zip(job.parts, retracings, strict=True)]


def _record_of(job: Job, part: Part, retracing: Retracing, steps: range) -> Record:
    circumstances, controller = part.circumstances, retracing.controller
    environment = with_wrecks(circumstances)
    team = circumstances.team
    name = circumstances.law.name
    recorder = Recorder(
        environment,
        team,
        controller,
        job.dt * steps.step,
        name=name,
        conditions=circumstances.conditions,
    )
    for step in steps:
        recorder.add(retracing.snapshots[step])
    record = replace(recorder.record(), time=np.arange(len(steps), dtype=float) * (job.dt * steps.step))
    start = _start_of(job, environment, record) if steps[0] == 0 else None
    return replace(
        record,
        start=start,
        seed=None if start is None else job.seed,
        session=_session_of(job, part, retracing, steps, record),
    )


def with_wrecks(circumstances: Circumstances) -> Environment:
    """Return the map with the robots that failed as obstacles with names."""
    environment = circumstances.environment
    for number, place in circumstances.failed.items():
        wreck = CircleObstacle(place, circumstances.limits.radius_of(number), wreck_name(number))
        environment = with_obstacle(environment, wreck)
    return environment


def _start_of(job: Job, environment: Environment, record: Record) -> str | None:
    """Return the name of the start if that is where the record begins, as whoever repeats it will find."""
    try:
        start = environment.start(job.start)
        radius = float(record.team.radius.max())
        positions = start.sample(len(record.team), seed=job.seed, radius=radius)
    except RobocovError:
        return None
    return start.name if np.array_equal(positions, record.positions[0]) else None


def _session_of(job: Job, part: Part, retracing: Retracing, steps: range, record: Record) -> dict[str, Any]:
    """Return what ``run.json`` says of where the run comes from; nothing where there is nothing to say."""
    circumstances, began, dt = part.circumstances, steps[0], job.dt
    touched = [
        {
            "from_s": (max(each.since, began) - began) * dt,
            "to_s": (min(each.until, steps[-1]) - began) * dt,
            "robots": sorted(circumstances.numbers[row] for row in each.rows),
        }
        for each in retracing.moved
        if each.until > began and each.since < steps[-1]
    ]
    # what a controller remembers, and what one of the user's makes of the time, no file tells
    known = not remembers(retracing.controller) or began == 0
    repeatable = retracing.proven and not touched and known
    said: dict[str, Any] = {}
    if began:
        said["began_at_s"] = began * dt
    if record.velocities[0].any():
        said["start_velocities_m_per_s"] = record.velocities[0].tolist()
    if circumstances.failed or circumstances.numbers != tuple(range(1, len(circumstances.numbers) + 1)):
        said["robots"] = list(circumstances.numbers)
        said["failed"] = {str(number): list(place) for number, place in circumstances.failed.items()}
    if touched:
        said["touched"] = touched
    if steps.step > 1:
        said["control_dt_s"] = dt
    return {**said, "repeatable": repeatable} if said or not repeatable else {}


def remarks_on(record: Record) -> list[str]:
    """Return what is to be known of a record, in words."""
    said = []
    for touched in record.session.get("touched", ()):
        robots = touched["robots"]
        who = ", ".join(str(number) for number in robots)
        said.append(f"robot{'s' if len(robots) > 1 else ''} {who} moved by hand")
    if "control_dt_s" in record.session:
        stride = round(record.dt / record.session["control_dt_s"])
        said.append(f"one step in {stride}, as older moments are gone")
    return list(dict.fromkeys(said))
