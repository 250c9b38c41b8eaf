"""What a run in the window begins with: map, controllers, team and starts."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from robocov.controllers import controller_kind, gains_of, make_controller
from robocov.errors import ParameterError, shown
from robocov.robots import UNITS, Team
from robocov.simulation import DEFAULT_DT

if TYPE_CHECKING:
    from collections.abc import Mapping

    from robocov.arrays import Array
    from robocov.controllers.base import Controller
    from robocov.controllers.gains import Gain
    from robocov.environment import Environment

MOST_ROBOTS = 1000
"""So many robots can be asked for in the window."""

MOST_PANES = 4
"""So many controllers can be compared side by side."""


@dataclass(frozen=True)
class Law:
    """A controller as the user chose it.

    Attributes
    ----------
    name : str
        As `make_controller` takes it.
    gains : dict of name to value
        Those that differ from their defaults.
    """

    name: str
    gains: Mapping[str, float | None] = field(default_factory=dict)

    def made(self) -> Controller:
        """Return the controller.

        Raises
        ------
        ParameterError
            As `make_controller`.
        """
        return make_controller(self.name, self.gains)

    # kept, for to look at a controller in a file is to run that file

    @cached_property
    def label(self) -> str:
        """The controller as people call it."""
        return str(controller_kind(self.name).label)

    @cached_property
    def known(self) -> dict[str, Gain]:
        """What is known of its gains, by name."""
        return gains_of(controller_kind(self.name))

    def value(self, gain: str) -> float | None:
        """Return the value of a gain."""
        return self.gains[gain] if gain in self.gains else self.known[gain].default

    def with_gain(self, gain: str, value: float | None) -> Law:
        """Return the law with another value of one gain.

        Raises
        ------
        ParameterError
            When there is no such gain, or the value is out of range.
        """
        gains = {**self.gains, gain: value}
        replace(self, gains=gains).made()
        return replace(self, gains={name: v for name, v in gains.items() if v != self.known[name].default})


def gain_words(before: Law, after: Law) -> str:
    """Return which gains differ, as people write them."""
    changed = [name for name in after.known if before.value(name) != after.value(name)]
    words = []
    for name in changed:
        value = after.value(name)
        words.append(f"{name} = {'no limit' if value is None else f'{value:.3g}'}")
    return ", ".join(words)


def branch_words(law: Law) -> str:
    """Return how a branch that was left is called."""
    gains = ", ".join(
        f"{name} {'no limit' if value is None else f'{value:.3g}'}"
        for name, value in law.gains.items()
        if value != law.known[name].default
    )
    return f"{law.label}, {gains}" if gains else law.label


@dataclass(frozen=True)
class Limits:
    """What each robot of the team is and can do; SI units, infinite for no limit."""

    radius: float = 0.1
    mass: float = 1.0
    max_speed: float = 1.0
    max_acceleration: float = 2.0
    viscosity: float = 2.0
    sensing_range: float = 3.0
    communication_range: float = np.inf

    def team(self, n: int) -> Team:
        """Return a team of `n` such robots.

        Raises
        ------
        ParameterError
            When a value is out of range.
        """
        return Team.homogeneous(n, **self.__dict__)

    @classmethod
    def of(cls, team: Team) -> Limits:
        """Return what the first robot of a team is and can do."""
        return cls(**{name: float(getattr(team, name)[0]) for name in UNITS})


@dataclass(frozen=True, eq=False)
class Scenario:
    """What a run begins with; immutable.

    Attributes
    ----------
    environment : Environment
    laws : tuple of Law
        One for each pane.
    robots : int
    start : str or None
        Named start of the map, its first by default.
    seed : int
        Of the starts.
    limits : Limits
    dt : float, s
        Control period.
    given : (n, 2) m or None
        Starts that come from somewhere else, as from a saved run.
    moving : (n, 2) m/s or None
        Velocities there; at rest by default.
    """

    environment: Environment
    laws: tuple[Law, ...] = (Law("rapf"),)
    robots: int = 6
    start: str | None = None
    seed: int = 0
    limits: Limits = Limits()
    dt: float = DEFAULT_DT
    given: Array | None = None
    moving: Array | None = None

    def __post_init__(self) -> None:
        if not 1 <= self.robots <= MOST_ROBOTS:
            raise ParameterError(
                f"robots: {shown(self.robots)}, but a whole number from 1 to {MOST_ROBOTS} was wanted"
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
        """Return the starts, (robots, 2) m.

        Raises
        ------
        StartError
            When there is no room for the team.
        """
        if self.given is not None:
            return self.given
        start = self.environment.start(self.start)
        return start.sample(self.robots, seed=self.seed, radius=self.limits.radius)
