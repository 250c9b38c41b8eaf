"""The past of a run: moments that can be resumed from, and trails; bounded, thinned with age."""

from bisect import bisect_right
from collections.abc import Collection, Iterable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import lru_cache
from itertools import compress
from typing import Any, NamedTuple, Self

import numpy as np

from robocov.arrays import Array
from robocov.conditions import Conditions
from robocov.conditions.communication import Inbox
from robocov.environment import CircleObstacle, Environment, Point
from robocov.observation import Decision
from robocov.team import Team
from robocov_app.viewer.session.scenario import ControllerChoice, Scenario, TeamSpec

MOST_BYTES = 24_000_000  # memory that the moments of a window may take
_OVERHEAD = 700  # bytes that a moment of one pane takes beside its arrays
_FEWEST = 300  # moments that are kept however large they are
_KEPT = 0.75  # of the moments, so many stay at most when they are thinned
RATE = 30.0  # most rows for each simulated second
MOST_ROWS = 4096  # when there are so many, every second of the older half goes


@dataclass(frozen=True, eq=False)
class PaneSetup:
    """Setup of a pane, which stays from one touch to the next."""

    environment: Environment  # the map as it is, without robots that failed
    law: ControllerChoice
    limits: TeamSpec
    numbers: tuple[int, ...]  # what people call the robots that work, in the order of the rows
    failed: Mapping[int, tuple[float, float]]  # robots that stand where they failed, (x, y) m each
    conditions: Conditions | None = None  # of messages and sensors; failing and joining is not among them

    @property
    def solid(self) -> Environment:
        """The map with the robots that failed as obstacles, which is what the others sense."""
        if not self.failed:
            return self.environment
        radii = tuple(map(self.limits.radius_of, self.failed))
        return _with_wrecks(self.environment, tuple(self.failed.values()), radii)

    @property
    def there(self) -> list[int]:
        """The numbers of all robots, those that failed with them."""
        return sorted([*self.numbers, *self.failed])

    @property
    def team(self) -> Team:
        return self.limits.team(self.numbers)

    @property
    def speeds(self) -> Array | None:
        """Speed limits, (n,) m/s; None where all robots, failed ones too, are alike."""
        return self.team.max_speed if "max_speed" in self.limits.different else None


# circumstances are many and stay for long, what is derived from a map is large: only the last few are kept
@lru_cache(maxsize=8)
def _with_wrecks(
    environment: Environment, places: tuple[Point, ...], radii: tuple[float, ...]
) -> Environment:
    return replace(environment, obstacles=(*environment.obstacles, *map(CircleObstacle, places, radii)))


class State(NamedTuple):
    """One pane at one moment."""

    setup: PaneSetup
    positions: Array  # (n, 2) m
    velocities: Array  # (n, 2) m/s
    memory: Any  # what the controller remembered; None where it can do without
    recorded: Decision | None = None  # what was decided then, where it comes from a record
    inbox: Inbox | None = None  # the messages that robots had; None where they know the others as they are
    steering: Array | None = None  # heading and turning rate of unicycles, (n, 2) rad and rad/s


class Moment(NamedTuple):
    """All panes at one moment: enough to go on from there, bit for bit."""

    step: int  # since the start
    states: Mapping[int, State]
    scenario: Scenario  # with controllers, limits and map as they were last chosen
    hand: tuple[int, tuple[float, float]] | None = None  # the robot that is dragged, and where to, m
    node: int = 0  # of the document, in whose time it is


class History:
    """Moments in their order.

    When they would take more than `most_bytes`, the older ones are thinned: of those that have grown old only
    every second step stays, of still older ones every fourth, and so on. The newest all stay, and so do,
    unless they are too many themselves, those since which something was touched. `dt` in s.
    """

    def __init__(self, dt: float, most_bytes: int = MOST_BYTES) -> None:
        self.dt, self.most_bytes = dt, most_bytes
        self.moments, self._sizes, self._bytes = list[Moment](), list[int](), 0
        self.thinned = 0  # number of moments that are gone

    def __len__(self) -> int:
        return len(self.moments)

    def __getitem__(self, k: int) -> Moment:
        return self.moments[k]

    @property
    def last(self) -> Moment:
        return self.moments[-1]

    @property
    def steps(self) -> list[int]:
        return [moment.step for moment in self.moments]

    def time(self, k: int) -> float:
        return self.moments[k].step * self.dt

    def add(self, moment: Moment) -> None:
        self.moments.append(moment)
        self._sizes.append(_size(moment))
        self._bytes += self._sizes[-1]
        count = len(self) + 1
        while self._bytes > self.most_bytes and _FEWEST < len(self) < count:
            count = len(self)
            self._thin()

    def amend(self, moment: Moment) -> None:
        """Replace the newest moment, if it is of the same step; else append."""
        if self.moments and self.last.step == moment.step:
            self.moments.pop()
            self._bytes -= self._sizes.pop()
        self.add(moment)

    def rewind(self, last: Moment) -> None:
        """Let a moment that is or was the newest be the newest again."""
        while self.moments and self.last is not last and self.last.step >= last.step:
            self.moments.pop()
            self._bytes -= self._sizes.pop()
        if not self.moments or self.last is not last:
            self.add(last)

    def at(self, time: float) -> int:
        """Return the number of the last moment not after `time`, the first if there is none."""
        return max(bisect_right(self.moments, time / self.dt + 1e-6, key=lambda moment: moment.step) - 1, 0)

    def until(self, k: int) -> Self:
        """Return a history of its own that ends with moment `k`."""
        twin = copy(self)
        twin.moments, twin._sizes = self.moments[: k + 1], self._sizes[: k + 1]
        twin._bytes = sum(twin._sizes)
        return twin

    def _thin(self) -> None:
        """Leave at most `_KEPT`: all of the newest, ever fewer of what is older."""
        count, steps = len(self), np.array(self.steps)
        age, touched = steps[-1] - steps, np.array([True, *map(_changes, self.moments, self.moments[1:])])
        for always in (touched, np.arange(count) == 0):
            whole, keep = count // 2, np.ones(count, dtype=bool)
            while whole > 1 and keep.sum() > _KEPT * count:
                whole //= 2
                # of how many steps one is kept: of 1 while recent, of 2, 4, 8 as the age doubles
                strides = 2 ** np.ceil(np.log2(np.maximum(age / age[-1 - whole], 1.0))).astype(np.intp)
                keep = always | (steps % strides == 0)
            if keep.sum() <= _KEPT * count:
                break
        self.moments, self._sizes = list(compress(self.moments, keep)), list(compress(self._sizes, keep))
        self.thinned += count - len(self)
        self._bytes = sum(self._sizes)


def _changes(before: Moment, after: Moment) -> bool:
    """Whether something was touched between two moments: such are kept, so that no event is lost."""
    pairs = [(before.states[pane], state) for pane, state in after.states.items() if pane in before.states]
    return any(old.setup is not new.setup for old, new in pairs)


def _size(moment: Moment) -> int:
    states = moment.states.values()
    parts = [(each.memory, each.inbox, each.steering, each.positions, each.velocities) for each in states]
    return sum(_OVERHEAD + sum(map(_bytes_of, each)) for each in parts)


def _bytes_of(memory: Any, depth: int = 4) -> int:
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
        # the system gives memory only as it is written to
        self._rows, self._times, self._count = np.empty((MOST_ROWS, n, 2)), np.empty(MOST_ROWS), 0

    def __len__(self) -> int:
        return self._count

    @property
    def positions(self) -> Array:
        """The positions so far, (k, n, 2) m, oldest first; nan before a robot was there."""
        return self._rows[: self._count]

    @property
    def time(self) -> Array:
        return self._times[: self._count]

    def add(self, time: float, positions: Array, *, always: bool = False) -> None:
        """Append (n, 2) m positions, unless the last are younger than 1 / `RATE`; `always`: in any case."""
        since = time - self._times[self._count - 1] if self._count else np.inf
        if since < 1e-9 and always:
            self._count -= 1
        elif since < 1.0 / RATE - 1e-6 and not always:
            return
        if self._count == len(self._times):
            kept = np.r_[0 : self._count // 2 : 2, self._count // 2 : self._count]
            self._count = len(kept)
            self._rows[: self._count], self._times[: self._count] = self._rows[kept], self._times[kept]
        self._rows[self._count], self._times[self._count] = positions, time
        self._count += 1

    def until(self, time: float) -> tuple[Array, Array]:
        count = int(np.searchsorted(self.time, time + 1e-6, side="right"))
        return self._rows[:count], self._times[:count]

    def of_robots(self, before: Sequence[int], after: Sequence[int]) -> "Trail":
        twin, k = Trail(len(after)), self._count
        twin._rows[:k], twin._times[:k], twin._count = of_robots(self.positions, before, after), self.time, k
        return twin


def of_robots(positions: Array, before: Sequence[int], after: Sequence[int]) -> Array:
    """Return positions, (..., n, 2) m, for other robots, by their numbers: nan where one was not there."""
    rows = {number: row for row, number in enumerate(before)}
    found = np.array([rows.get(number, -1) for number in after])
    return np.where(found[:, None] < 0, np.nan, positions[..., found, :])


def way_of(history: History, pane: int, last: int) -> tuple[Trail, Array]:
    """Return the trail of the robots that worked in a pane at moment `last`, and their starts, (n, 2) m."""
    numbers = history[last].states[pane].setup.numbers
    trail, starts = Trail(len(numbers)), dict[int, list[float]]()
    before: PaneSetup | None = None
    latest = -np.inf
    for k in range(last + 1):
        time, state = history.time(k), history[k].states[pane]
        touched = state.setup is not before
        # who came in since is in the last row, too
        if time - latest < 1.0 / RATE - 1e-6 and not touched and k < last:
            continue
        if touched:
            before = state.setup
            starts = dict(zip(before.numbers, state.positions.tolist(), strict=True)) | starts
        trail.add(time, of_robots(state.positions, state.setup.numbers, numbers), always=True)
        latest = time
    return trail, np.array([starts[number] for number in numbers])
