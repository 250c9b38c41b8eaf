"""The past of a run, so that it can be looked at again and resumed from: bounded, thinned with age."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Collection, Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from robocov.environment import CircleObstacle

if TYPE_CHECKING:
    from collections.abc import Iterable

    from robocov.arrays import Array, IntArray
    from robocov.conditions import Conditions
    from robocov.conditions.perception import Inbox
    from robocov.environment import Environment
    from robocov.observation import Decision
    from robocov.robots import Team
    from robocov_app.viewer.session.scenario import ControllerChoice, Scenario, TeamSpec

MOST_BYTES = 24_000_000
"""Memory that the moments of a window may take."""

_OVERHEAD = 700
"""Bytes that a moment of one pane takes beside its arrays."""

_FEWEST = 300
"""Moments that are kept however large they are."""

_KEPT = 0.75
"""Of the moments, so many stay at most when they are thinned."""

RATE = 30.0
"""Most rows for each simulated second."""

MOST_ROWS = 4096
"""When there are so many, every second of the older half goes."""


@dataclass(frozen=True, eq=False)
class PaneSetup:
    """Setup of a pane, which stays from one touch to the next.

    `environment`: the map as it is, without robots that failed. `numbers`, (n,) int: what people call the
    robots that work, in the order of the rows. `failed`, (x, y) m each: robots that stand where they failed.
    `conditions`: what goes wrong with messages and sensors; None: nothing. Failing and joining is not among
    it.
    """

    environment: Environment
    law: ControllerChoice
    limits: TeamSpec
    numbers: tuple[int, ...]
    failed: Mapping[int, tuple[float, float]]
    conditions: Conditions | None = None

    @property
    def solid(self) -> Environment:
        """The map with the robots that failed as obstacles, which is what the others sense."""
        if not self.failed:
            return self.environment
        radii = tuple(map(self.limits.radius_of, self.failed))
        return _with_wrecks(self.environment, tuple(self.failed.values()), radii)

    @property
    def team(self) -> Team:
        """The robots that work."""
        return self.limits.team(self.numbers)


# circumstances are many and stay for long, what is derived from a map is large: only the last few are kept
@lru_cache(maxsize=8)
def _with_wrecks(
    environment: Environment, places: tuple[tuple[float, float], ...], radii: tuple[float, ...]
) -> Environment:
    wrecks = tuple(map(CircleObstacle, places, radii))
    return replace(environment, obstacles=(*environment.obstacles, *wrecks))


class State(NamedTuple):
    """One pane at one moment.

    `positions`, `velocities`: (n, 2) m and m/s. `memory`: what the controller remembered; None where it can
    do without. `recorded`: what was decided then, where it comes from a record. `inbox`: the messages that
    the robots had; None where they know the others as they are. `steering`: heading and turning rate of
    unicycles, (n, 2) rad and rad/s; None in a team of points.
    """

    setup: PaneSetup
    positions: Array
    velocities: Array
    memory: Any
    recorded: Decision | None = None
    inbox: Inbox | None = None
    steering: Array | None = None


class Moment(NamedTuple):
    """All panes at one moment: enough to go on from there, bit for bit.

    `step`: steps since the start. `scenario`: controllers, limits and map as they were last chosen; None in
    the past of a record. `hand`, (number, (x, y) m) or None: the robot that is dragged, and where to. `node`:
    node of the document in whose time it is.
    """

    step: int
    states: Mapping[int, State]
    scenario: Scenario | None = None
    hand: tuple[int, tuple[float, float]] | None = None
    node: int = 0


class History:
    """Moments in their order.

    When they would take more than `most_bytes`, the older ones are thinned: of those that have grown old only
    every second step stays, of still older ones every fourth, and so on. The newest all stay, and so do,
    unless they are too many themselves, those since which something was touched. `dt` in s.
    """

    def __init__(self, dt: float, most_bytes: int = MOST_BYTES) -> None:
        self.dt = dt
        self.most_bytes = most_bytes
        self._moments: list[Moment] = []
        self._steps: list[int] = []
        self._sizes: list[int] = []
        self._bytes = 0
        self.thinned = 0
        """Number of moments that are gone."""

    def __len__(self) -> int:
        return len(self._moments)

    def __getitem__(self, k: int) -> Moment:
        return self._moments[k]

    @property
    def last(self) -> Moment:
        """The newest moment."""
        return self._moments[-1]

    @property
    def steps(self) -> list[int]:
        """The steps of the moments, ascending; not to be changed."""
        return self._steps

    def since(self, k: int) -> list[Moment]:
        """Return the moments from number `k` on."""
        return self._moments[k:]

    def time(self, k: int) -> float:
        """Return the time of moment `k`, s."""
        return self._steps[k] * self.dt

    def add(self, moment: Moment) -> None:
        """Append a moment that is later than all."""
        self._moments.append(moment)
        self._steps.append(moment.step)
        self._sizes.append(_size(moment))
        self._bytes += self._sizes[-1]
        count = len(self._moments) + 1
        while self._bytes > self.most_bytes and _FEWEST < len(self._moments) < count:
            count = len(self._moments)
            self._thin()

    def amend(self, moment: Moment) -> None:
        """Replace the newest moment, if it is of the same step; else append."""
        if self._moments and self._moments[-1].step == moment.step:
            self.cut(len(self._moments) - 2)
        self.add(moment)

    def at(self, time: float) -> int:
        """Return the number of the last moment not after `time`, the first if there is none."""
        return max(bisect_right(self._steps, time / self.dt + 1e-6) - 1, 0)

    def cut(self, k: int) -> None:
        """Forget what came after moment `k`."""
        self._bytes -= sum(self._sizes[k + 1 :])
        del self._moments[k + 1 :], self._steps[k + 1 :], self._sizes[k + 1 :]

    def until(self, k: int) -> History:
        """Return a history of its own that ends with moment `k`."""
        twin = History(self.dt, self.most_bytes)
        twin._moments, twin._steps = self._moments[: k + 1], self._steps[: k + 1]
        twin._sizes = self._sizes[: k + 1]
        twin._bytes, twin.thinned = sum(twin._sizes), self.thinned
        return twin

    def _thin(self) -> None:
        """Leave at most `_KEPT`: all of the newest, ever fewer of what is older."""
        count = len(self._moments)
        steps = np.array(self._steps)
        age = steps[-1] - steps
        touched = np.array([True, *map(_changes, self._moments, self._moments[1:])])
        for always in (touched, np.arange(count) == 0):
            whole, keep = count // 2, np.ones(count, dtype=bool)
            while whole > 1 and keep.sum() > _KEPT * count:
                whole //= 2
                keep = always | (steps % _strides(age, int(age[-1 - whole])) == 0)
            if keep.sum() <= _KEPT * count:
                break
        kept = np.flatnonzero(keep).tolist()
        self.thinned += count - len(kept)
        self._moments = [self._moments[k] for k in kept]
        self._steps = [self._steps[k] for k in kept]
        self._sizes = [self._sizes[k] for k in kept]
        self._bytes = sum(self._sizes)


def _strides(age: IntArray, recent: int) -> IntArray:
    """Return of how many steps one is kept at ages: 1 while recent, 2, 4, 8 as the age doubles.

    >>> _strides(np.array([0, 100, 101, 200, 201, 401, 801]), 100).tolist()
    [1, 1, 2, 2, 4, 8, 16]
    """
    return np.asarray(2 ** np.ceil(np.log2(np.maximum(age / recent, 1.0))).astype(np.intp))


def _changes(before: Moment, after: Moment) -> bool:
    """Whether something was touched between two moments: such are kept, so that no event is lost."""
    return any(
        pane in before.states and before.states[pane].setup is not state.setup
        for pane, state in after.states.items()
    )


def _size(moment: Moment) -> int:
    """Return about how many bytes a moment takes."""
    return sum(
        _OVERHEAD
        + state.positions.nbytes
        + state.velocities.nbytes
        + _bytes_of(state.memory)
        + _bytes_of(state.inbox)
        + _bytes_of(state.steering)
        for state in moment.states.values()
    )


def _bytes_of(memory: Any, depth: int = 4) -> int:
    """Return about how many bytes a memory takes, by the arrays in it."""
    if isinstance(memory, np.ndarray):
        return memory.nbytes
    if memory is None or depth == 0:
        return 0
    if isinstance(memory, str | bytes):
        return len(memory)
    parts: Iterable[Any] = ()
    if isinstance(memory, Mapping):
        parts = memory.values()
    elif isinstance(memory, Collection):
        parts = memory
    elif is_dataclass(memory):
        parts = (getattr(memory, item.name) for item in fields(memory))
    elif hasattr(memory, "__dict__"):
        parts = vars(memory).values()
    return 50 + sum(_bytes_of(part, depth - 1) for part in parts)


class Trail:
    """Positions at ascending times, for the robots that work now; bounded."""

    def __init__(self, n: int) -> None:
        self._rows = np.empty((64, n, 2))
        self._times = np.empty(64)
        self._count = 0

    def __len__(self) -> int:
        return self._count

    @property
    def positions(self) -> Array:
        """The positions so far, (k, n, 2) m, oldest first; nan before a robot was there."""
        return self._rows[: self._count]

    @property
    def time(self) -> Array:
        """Their times, (k,) s."""
        return self._times[: self._count]

    def add(self, time: float, positions: Array, *, always: bool = False) -> None:
        """Append the (n, 2) m positions at `time`, unless the last are younger than 1 / `RATE`.

        With `always` they are taken in any case; they replace those of the same time.
        """
        since = time - self._times[self._count - 1] if self._count else np.inf
        if since < 1e-9 and always:
            self._count -= 1
        elif since < 1.0 / RATE - 1e-6 and not always:
            return
        if self._count == MOST_ROWS:
            self._thin()
        if self._count == len(self._rows):
            self._rows = np.concatenate([self._rows, np.empty_like(self._rows)])
            self._times = np.concatenate([self._times, np.empty_like(self._times)])
        self._rows[self._count], self._times[self._count] = positions, time
        self._count += 1

    def cut(self, time: float) -> None:
        """Forget what came after `time`."""
        self._count = int(np.searchsorted(self.time, time + 1e-6, side="right"))

    def until(self, time: float) -> tuple[Array, Array]:
        """Return positions and times up to `time`."""
        count = int(np.searchsorted(self.time, time + 1e-6, side="right"))
        return self._rows[:count], self._times[:count]

    def _thin(self) -> None:
        half = MOST_ROWS // 2
        keep = np.concatenate([np.arange(0, half, 2), np.arange(half, MOST_ROWS)])
        self._rows[: len(keep)] = self._rows[keep]
        self._times[: len(keep)] = self._times[keep]
        self._count = len(keep)


def trail_of(history: History, pane: int, last: int) -> Trail:
    """Return where the robots that worked in a pane at moment `last` went until then."""
    numbers = history[last].states[pane].setup.numbers
    trail = Trail(len(numbers))
    before: PaneSetup | None = None
    rows: list[int] = []
    their_rows: list[int] = []
    latest = -np.inf
    for k in range(last + 1):
        time, state = history.time(k), history[k].states[pane]
        touched = state.setup is not before
        # who came in since is in the last row, too
        if time - latest < 1.0 / RATE - 1e-6 and not touched and k < last:
            continue
        if touched:
            before = state.setup
            rows = [row for row, number in enumerate(numbers) if number in before.numbers]
            their_rows = [before.numbers.index(numbers[row]) for row in rows]
        places = np.full((len(numbers), 2), np.nan)
        places[rows] = state.positions[their_rows]
        trail.add(time, places, always=True)
        latest = time
    return trail


def starts_of(history: History, pane: int, last: int) -> Array:
    """Return where the robots that worked in a pane at moment `last` had come in, (n, 2) m."""
    starts: dict[int, list[float]] = {}
    before: PaneSetup | None = None
    for k in range(last + 1):
        state = history[k].states[pane]
        if state.setup is not before:
            before = state.setup
            for number, place in zip(before.numbers, state.positions.tolist(), strict=True):
                starts.setdefault(number, place)
    return np.array([starts[number] for number in history[last].states[pane].setup.numbers])
