"""Conditions: what goes wrong, or changes, during a run.

Without them the world of the paper is ideal: who is in range is heard at once and always, everybody knows
exactly where it is, the range sensor is exact, and all robots work from the beginning to the end.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from numbers import Integral
from typing import Any, NamedTuple, TypeVar

import numpy as np

from robocov.arrays import Array, BoolArray
from robocov.conditions.random_streams import Draws
from robocov.errors import ParameterError, is_number, quote, require_number

LOSS, POSITION, SENSING, SCANNING, FAILING = range(5)
"""The independent streams of random numbers of a run."""
TIME_TOLERANCE_S = 1e-9
"""Seconds by which two moments may differ and still be one: what sums of steps miss."""
_LONGEST = 1e6

LIMITS: dict[str, tuple[float, float, str, str]] = {
    # smallest, largest, unit, what it is called in run.json
    "loss": (0.0, 1.0, "", "loss"),
    "delay": (0.0, 1e3, "s", "delay_s"),
    "message_rate": (1e-3, 1e4, "Hz", "message_rate_hz"),
    "forget_after": (1e-3, _LONGEST, "s", "forget_after_s"),
    "position_noise": (0.0, 1e3, "m", "position_noise_m"),
    "sensing_noise": (0.0, 1e3, "m", "sensing_noise_m"),
    "failure_rate": (0.0, 1e3, "1/s", "failure_rate_per_s"),
}
"""Ranges of the conditions that are numbers."""
UNITS = {name: unit for name, (_, _, unit, _) in LIMITS.items()}


class Failure(NamedTuple):
    """A robot, numbered from 1, that fails at a time, s: from then on it is a silent obstacle."""

    robot: int
    time: float

    def __str__(self) -> str:
        return f"{self.robot}@{self.time:g}"


class Join(NamedTuple):
    """A robot, numbered from 1, that joins at a time, s, at a place, (x, y) m, or as near as it fits then."""

    robot: int
    time: float
    place: tuple[float, float] | None = None
    """By default where it would have started."""

    def __str__(self) -> str:
        place = "" if self.place is None else f":{self.place[0]:g},{self.place[1]:g}"
        return f"{self.robot}@{self.time:g}{place}"


class JoinedRobot(NamedTuple):
    """A robot, numbered from 1, that has joined: when, s, where, and where it was to join, (x, y) m."""

    robot: int
    time: float
    place: tuple[float, float]
    requested: tuple[float, float]

    @property
    def offset(self) -> float:
        """Distance from the requested place, m: above 0 where a wall or another robot was too near."""
        return math.dist(self.place, self.requested)


@dataclass(frozen=True)
class Conditions:
    """All that varies during a run, seeded.

    Communication is ideal, as without conditions, unless there is loss, delay, a message rate or position
    noise. A robot that fails is then forgotten at once, else after `forget_after`.

    Raises ParameterError on a value out of range; the message names it.
    """

    loss: float = 0.0
    """Packet loss: the probability with which a message does not reach a receiver."""
    delay: float = 0.0
    """Latency of messages, s."""
    message_rate: float | None = None
    """Rate at which robots broadcast their positions to who is in range, Hz; None: at every control step."""
    forget_after: float = 3.0
    """Timeout, s, after which a robot that has not been heard of is taken to be gone, no more to be where its
    last message said."""
    position_noise: float = 0.0
    """Localization noise, sigma in x and in y, m, white over the control steps. A robot acts on the noisy
    position and broadcasts it; the physics goes on from the true one."""
    sensing_noise: float = 0.0
    """Range noise of the sensor, sigma, m."""
    failure_rate: float = 0.0
    """Failures per second of each robot, while it works: lifetimes are exponentially distributed."""
    failures: tuple[Failure, ...] = ()
    """At most one a robot; also given as ``(robot, time)``."""
    joins: tuple[Join, ...] = ()
    """At most one a robot; also given as ``(robot, time)`` or ``(robot, time, place)``."""
    seed: int = 0

    def __post_init__(self) -> None:
        for name, (low, high, unit, _) in LIMITS.items():
            value, null = getattr(self, name), name == "message_rate"
            if value is not None or not null:
                unit += " or null" * null
                object.__setattr__(self, name, require_number(f"conditions.{name}", value, low, high, unit))
        object.__setattr__(self, "failures", _entries("failures", Failure, self.failures))
        object.__setattr__(self, "joins", _entries("joins", Join, self.joins))
        if not is_number(self.seed, Integral) or self.seed < 0:
            raise ParameterError(f"conditions.seed: {quote(self.seed)}, but a whole number from 0 was wanted")
        if self.message_rate is not None and self.forget_after * self.message_rate < 1.0:
            wanted = f"at least the {1.0 / self.message_rate:g} s between two messages was wanted"
            raise ParameterError(f"conditions.forget_after: {self.forget_after:g} s, but {wanted}")
        fails = {each.robot: each.time for each in self.failures}
        for k, join in enumerate(self.joins):
            if fails.get(join.robot, math.inf) <= join.time:
                joins = f"conditions.joins[{k}]: robot {join.robot} joins at {join.time:g} s"
                raise ParameterError(f"{joins}, but it has failed at {fails[join.robot]:g} s")

    @property
    def is_ideal(self) -> bool:
        """Whether this is as good as no conditions."""
        return not (self.uses_messages or self.sensing_noise or self.has_team_changes)

    @property
    def uses_messages(self) -> bool:
        """Whether robots know of each other by messages only."""
        return bool(self.loss or self.delay or self.message_rate is not None or self.position_noise)

    @property
    def has_team_changes(self) -> bool:
        """Whether robots may fail or join."""
        return bool(self.failure_rate or self.failures or self.joins)

    def drop_team_changes(self) -> Conditions | None:
        """Return the conditions without failing and joining; None where ideal ones are left."""
        rest = replace(self, failure_rate=0.0, failures=(), joins=())
        return None if rest.is_ideal else rest

    def check_team(self, count: int) -> None:
        """Raise ParameterError unless `count` robots have all that fail or join, and one from the start."""
        for name in ("failures", "joins"):
            for k, each in enumerate(getattr(self, name)):
                if each.robot > count:
                    wanted = f"one of 1 to {count} was wanted"
                    raise ParameterError(f"conditions.{name}[{k}]: robot {each.robot}, but {wanted}")
        if len(self.joins) == count and min(each.time for each in self.joins) > 0.0:
            raise ParameterError("conditions.joins: all robots, but at least one from the start was wanted")

    def compute_working_periods(self, count: int) -> tuple[Array, Array]:
        """Return from when and until when each robot works, (n,) s each; -inf and inf without limit."""
        begins, ends = np.full(count, -np.inf), np.full(count, np.inf)
        for join in self.joins:
            begins[join.robot - 1] = join.time
        if self.failure_rate:
            chance = Draws(self.seed, FAILING).uniform(0, np.arange(count))
            ends = np.maximum(begins, 0.0) - np.log(chance) / self.failure_rate
        for failure in self.failures:
            ends[failure.robot - 1] = min(ends[failure.robot - 1], failure.time)
        return begins, ends

    def find_working(self, time: float | Array, count: int) -> BoolArray:
        """Return which robots are there and have not failed at times (...), s: (..., n) bool."""
        return self.find_present(time, count) & ~self.find_failed(time, count)

    def find_failed(self, time: float | Array, count: int) -> BoolArray:
        """Return which robots have failed, as `working` does."""
        return np.asarray(
            self.compute_working_periods(count)[1] <= np.asarray(time)[..., None] + TIME_TOLERANCE_S
        )

    def find_present(self, time: float | Array, count: int) -> BoolArray:
        """Return which robots are there, working or failed, as `working` does."""
        return np.asarray(
            self.compute_working_periods(count)[0] <= np.asarray(time)[..., None] + TIME_TOLERANCE_S
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the conditions as plain JSON, units in the key names."""
        plain: dict[str, Any] = {key: getattr(self, name) for name, (*_, key) in LIMITS.items()}
        plain["failures"] = [{"robot": robot, "time_s": time} for robot, time in self.failures]
        plain["joins"] = [
            {"robot": robot, "time_s": time, "place_m": place and [*place]}
            for robot, time, place in self.joins
        ]
        return plain | {"seed": int(self.seed)}

    @classmethod
    def from_dict(cls, plain: Mapping[str, Any]) -> Conditions:
        """Return the conditions that `to_dict` wrote; raises ParameterError when they cannot be used."""
        try:
            given: dict[str, Any] = {name: plain[key] for name, (*_, key) in LIMITS.items()}
            given["failures"] = [(each["robot"], each["time_s"]) for each in plain["failures"]]
            given["joins"] = [(each["robot"], each["time_s"], each["place_m"]) for each in plain["joins"]]
            return cls(**given, seed=plain["seed"])
        except (KeyError, TypeError) as error:
            raise ParameterError(f"conditions: cannot be read ({error!r})") from error

    def __repr__(self) -> str:
        said = ((each.name, repr(getattr(self, each.name)), repr(each.default)) for each in fields(self))
        return f"Conditions({', '.join(f'{name}={value}' for name, value, usual in said if value != usual)})"


Entry = TypeVar("Entry", bound=Failure | Join)

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d{1,3})?"
_ENTRY = re.compile(rf"(\d{{1,9}})@({_NUMBER})(?::({_NUMBER}),({_NUMBER}))?", re.ASCII)


def parse_event(kind: type[Entry], text: str) -> Entry:
    """Return what a text says: a failure ``3@20``, of robot 3 after 20 s, or a join ``5@30``, ``5@30:2.5,1``.

    Raises ParameterError when it says none.
    """
    found = _ENTRY.fullmatch(text)
    if found is None or (kind is Failure and found[3] is not None):
        wanted = "ROBOT@SECONDS, as in 3@20," if kind is Failure else "ROBOT@SECONDS or ROBOT@SECONDS:X,Y"
        raise ParameterError(f"{quote(text)}, but {wanted} was wanted")
    place = () if found[3] is None else ((float(found[3]), float(found[4])),)
    return kind(int(found[1]), float(found[2]), *place)


def _entries(name: str, kind: type[Entry], given: Iterable[Any]) -> tuple[Entry, ...]:
    """Return failures or joins in the order of the robots, checked."""
    found: dict[int, Entry] = {}
    for k, each in enumerate(given):
        at = f"conditions.{name}[{k}]"
        try:
            robot, time, *rest = each
            kind(robot, time, *rest)
        except (TypeError, ValueError):
            raise ParameterError(f"{at}: {quote(each)}, but a robot and a time were wanted") from None
        if not is_number(robot, Integral) or robot < 1:
            raise ParameterError(f"{at}: robot {quote(robot)}, but a whole number from 1 was wanted")
        if robot in found:
            raise ParameterError(f"{at}: robot {robot} is given twice")
        if not is_number(time) or not 0.0 <= time <= _LONGEST:
            wanted = f"a number from 0 to {_LONGEST:g} s"
            raise ParameterError(f"{at}: time {quote(time)}, but {wanted} was wanted")
        places = [None if place is None else _place(at, place) for place in rest]
        found[int(robot)] = kind(int(robot), float(time), *places)
    return tuple(found[robot] for robot in sorted(found))


def _place(at: str, given: Any) -> tuple[float, float]:
    with suppress(TypeError, ValueError):
        x, y = given
        if all(is_number(value) and math.isfinite(value) for value in (x, y)):
            return float(x), float(y)
    raise ParameterError(f"{at}: place {quote(given)}, but [x, y] in metres was wanted")
