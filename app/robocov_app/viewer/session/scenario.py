"""What a run in the window begins with: map, controllers, team and starts."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from robocov.controllers import controller_kind, gains_of, make_controller
from robocov.controllers.gains import value_text
from robocov.errors import ParameterError, shown
from robocov.robots import UNITS, Team
from robocov.simulation import DEFAULT_DT

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from robocov.arrays import Array
    from robocov.conditions import Conditions
    from robocov.controllers.base import Controller
    from robocov.controllers.gains import Gain, Option, Value
    from robocov.environment import Environment

MOST_ROBOTS = 1000
"""So many robots can be asked for in the window."""

MOST_THAT_TALK = 100
"""So many robots can be asked for where each has messages of its own of every other."""

MOST_PANES = 4
"""So many controllers can be compared side by side."""


@dataclass(frozen=True)
class ControllerChoice:
    """A controller as the user chose it.

    `name`: as `make_controller` takes it. `gains`: those that differ from their defaults.
    """

    name: str
    gains: Mapping[str, Value] = field(default_factory=dict)

    def made(self) -> Controller:
        """Return the controller. Raises ParameterError as `make_controller`."""
        return make_controller(self.name, self.gains)

    # kept, for to look at a controller in a file is to run that file

    @cached_property
    def label(self) -> str:
        """The controller as people call it."""
        return str(controller_kind(self.name).label)

    @cached_property
    def known(self) -> dict[str, Gain | Option]:
        """What is known of its gains, by name."""
        return gains_of(controller_kind(self.name))

    def value(self, gain: str) -> Value:
        """Return the value of a gain."""
        return self.gains[gain] if gain in self.gains else self.known[gain].default

    def with_gain(self, gain: str, value: Value) -> ControllerChoice:
        """Return the law with another value of one gain.

        Raises ParameterError when there is no such gain, or the value is out of range.
        """
        gains = {**self.gains, gain: value}
        replace(self, gains=gains).made()
        return replace(self, gains={name: v for name, v in gains.items() if v != self.known[name].default})


def gain_words(before: ControllerChoice, after: ControllerChoice) -> str:
    """Return which gains differ, as people write them."""
    changed = [name for name in after.known if before.value(name) != after.value(name)]
    return ", ".join(f"{name} = {_said(after.value(name))}" for name in changed)


def branch_words(law: ControllerChoice) -> str:
    """Return how a branch that was left is called."""
    gains = ", ".join(
        f"{name} {_said(value)}" for name, value in law.gains.items() if value != law.known[name].default
    )
    return f"{law.label}, {gains}" if gains else law.label


def _said(value: Value) -> str:
    return value_text(value, digits=3, none="no limit")


@dataclass(frozen=True)
class TeamSpec:
    """What each robot of the team is and can do; SI units, infinite for no limit.

    `radius`, `mass`, `max_speed`, `max_acceleration`, `viscosity`, `sensing_range`, `communication_range`: as
    `Team` has them. `different`: parameters in which robots differ, with the values of those that have one of
    their own.
    """

    radius: float = 0.1
    mass: float = 1.0
    max_speed: float = 1.0
    max_acceleration: float = 2.0
    viscosity: float = 2.0
    sensing_range: float = 3.0
    communication_range: float = np.inf
    different: tuple[tuple[str, tuple[tuple[int, float], ...]], ...] = ()

    def team(self, robots: int | Sequence[int]) -> Team:
        """Return a team of so many robots, or of those with such numbers.

        Raises ParameterError when a value is out of range.
        """
        numbers = range(1, robots + 1) if isinstance(robots, int) else robots
        team = Team.homogeneous(len(numbers), **{name: getattr(self, name) for name in UNITS})
        own = {name: dict(values) for name, values in self.different}
        changed = {
            name: np.array([values.get(number, getattr(self, name)) for number in numbers])
            for name, values in own.items()
        }
        return replace(team, **changed) if changed else team

    def radius_of(self, number: int) -> float:
        """Return the radius of the robot with a number, m."""
        return float(self.team((number,)).radius[0])

    @classmethod
    def of(cls, team: Team, numbers: Sequence[int] | None = None) -> TeamSpec:
        """Return what the robots of a team are and can do; by default they are numbered from 1."""
        columns = {name: getattr(team, name).tolist() for name in UNITS}
        numbers = range(1, len(team) + 1) if numbers is None else numbers
        different = tuple(
            (name, tuple(zip(numbers, values, strict=True)))
            for name, values in columns.items()
            if len(set(values)) > 1
        )
        return cls(**{name: values[0] for name, values in columns.items()}, different=different)


@dataclass(frozen=True, eq=False)
class Scenario:
    """What a run begins with; immutable.

    `laws`: one for each pane. `start`: named start of the map, its first by default. `seed`: of the starts.
    `dt`, s: control period. `given`, (n, 2) m or None: starts that come from somewhere else, as from a saved
    run. `moving`, (n, 2) m/s or None: velocities there; at rest by default. `conditions`: what goes wrong,
    and when robots fail and join by themselves.
    """

    environment: Environment
    laws: tuple[ControllerChoice, ...] = (ControllerChoice("rapf"),)
    robots: int = 6
    start: str | None = None
    seed: int = 0
    limits: TeamSpec = TeamSpec()
    dt: float = DEFAULT_DT
    given: Array | None = None
    moving: Array | None = None
    conditions: Conditions | None = None

    def __post_init__(self) -> None:
        if not 1 <= self.robots <= MOST_ROBOTS:
            raise ParameterError(
                f"robots: {shown(self.robots)}, but a whole number from 1 to {MOST_ROBOTS} was wanted"
            )
        if self.conditions is not None and self.conditions.talks and self.robots > MOST_THAT_TALK:
            raise ParameterError(
                f"robots: {self.robots}, but at most {MOST_THAT_TALK} were wanted where messages "
                f"may be lost or late: the window remembers all of them, of all moments"
            )
        if not 1 <= len(self.laws) <= MOST_PANES:
            raise ParameterError(f"controllers: {len(self.laws)}, but 1 to {MOST_PANES} were wanted")

    @property
    def start_name(self) -> str:
        """The name of the start, also of one that an obstacle has covered since."""
        if self.start is not None and self.start not in self.environment.starts:
            return self.start
        return self.environment.start(self.start).name

    def positions(self) -> Array:
        """Return the starts, (robots, 2) m. Raises StartError when there is no room for the team."""
        if self.given is not None:
            return self.given
        start = self.environment.start(self.start)
        radius = float(self.limits.team(self.robots).radius.max())  # room for the largest
        return start.sample(self.robots, seed=self.seed, radius=radius)
