"""Atomic changes of a session: what a touch consists of, and what each does to a pane.

A change is a value that can be written to a file. Those of panes say how one is to go on; `Lockstep` carries
them out in all panes or in none. Robots that do not fit where they are wanted go as near as they fit.
"""

from __future__ import annotations

from bisect import bisect
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from robocov.density import Density
from robocov.environment import Environment, Obstacle, Point
from robocov.errors import ParameterError
from robocov.world.relocation import nearest_free
from robocov_app.viewer.session.history import PaneSetup
from robocov_app.viewer.session.map_edits import painted, with_obstacles
from robocov_app.viewer.session.pane import Continuation, Pane
from robocov_app.viewer.session.scenario import MOST_ROBOTS, ControllerChoice, Scenario, TeamSpec


@dataclass(frozen=True)
class Drag:
    """The hand holds a robot and pulls it towards a point, m, by a spring."""

    robot: int
    to: Point


@dataclass(frozen=True)
class Release:
    """The hand lets go; a robot that was swung flies on."""


@dataclass(frozen=True)
class Place:
    """Put a robot, working or failed, at a point, m."""

    robot: int
    at: Point

    def of(self, pane: Pane) -> Continuation:
        """Return how a pane goes on."""
        setup, row = pane.setup, _row(pane, self.robot)
        if row is None:
            others, radii = pane.simulation.positions, pane.simulation.team.radius
            place = _fitting(_without_wreck(setup, self.robot), self.robot, others, radii, self.at)
            return Continuation(replace(setup, failed={**setup.failed, self.robot: place}))
        positions, velocities = np.array(pane.simulation.positions), np.array(pane.simulation.velocities)
        others, radii = np.delete(positions, row, axis=0), np.delete(setup.team.radius, row)
        positions[row] = _fitting(setup, self.robot, others, radii, self.at)
        velocities[row] = 0.0
        return Continuation(setup, positions, velocities)


@dataclass(frozen=True)
class Join:
    """One robot more, at rest at a point, m."""

    robot: int
    at: Point

    def of(self, pane: Pane) -> Continuation:
        """Return how a pane goes on."""
        there = _there(pane)
        if len(there) >= MOST_ROBOTS:
            raise ParameterError(f"there are {MOST_ROBOTS} robots already")
        if self.robot in there:
            raise ParameterError(f"there is a robot {self.robot} already")
        return _with_robot(pane, pane.setup, self.robot, self.at)


@dataclass(frozen=True)
class Leave:
    """Take a robot out, whether it works or not."""

    robot: int

    def of(self, pane: Pane) -> Continuation:
        """Return how a pane goes on."""
        _row(pane, self.robot)
        _need_another(pane, self.robot)
        return _without_robot(pane, self.robot)


@dataclass(frozen=True)
class Fail:
    """A robot stops where it is, and is not heard any more; the others sense it as they do any obstacle."""

    robot: int

    def of(self, pane: Pane) -> Continuation:
        """Return how a pane goes on."""
        row = _row(pane, self.robot)
        if row is None:
            raise ParameterError(f"robot {self.robot} has failed already")
        _need_another(pane, self.robot)
        x, y = pane.simulation.positions[row].tolist()
        wanted = _without_robot(pane, self.robot)
        failed = {**wanted.setup.failed, self.robot: (x, y)}
        return wanted._replace(setup=replace(wanted.setup, failed=failed))


@dataclass(frozen=True)
class Revive:
    """A robot that failed works again, where it stands or as near as it fits."""

    robot: int

    def of(self, pane: Pane) -> Continuation:
        """Return how a pane goes on."""
        if _row(pane, self.robot) is not None:
            raise ParameterError(f"robot {self.robot} works")
        setup = pane.setup
        return _with_robot(pane, _without_wreck(setup, self.robot), self.robot, setup.failed[self.robot])


@dataclass(frozen=True)
class EditObstacles:
    """Obstacles number `first` to `first + removed - 1` are replaced by others."""

    first: int
    removed: int
    added: tuple[Obstacle, ...]

    def on(self, environment: Environment) -> Environment:
        """Return the changed map, without starts that are covered; MapError where it breaks a rule."""
        there = environment.obstacles
        return with_obstacles(
            environment, (*there[: self.first], *self.added, *there[self.first + self.removed :])
        )


@dataclass(frozen=True)
class Paint:
    """Dabs of a brush of `radius`, m, that raise the density, or lower it."""

    dabs: tuple[Point, ...]
    radius: float
    lowers: bool

    def on(self, environment: Environment) -> Environment:
        """Return the map with the density that it has then."""
        return environment.with_density(painted(environment, self.dabs, self.radius, lowers=self.lowers))


@dataclass(frozen=True, eq=False)
class SetDensity:
    """Places count by another density; None: all the same."""

    density: Density | None

    def on(self, environment: Environment) -> Environment:
        """Return the map with that density."""
        return environment.with_density(self.density)


@dataclass(frozen=True)
class SetController:
    """Another controller, or other gains, take over in a pane."""

    pane: int
    law: ControllerChoice

    def of(self, pane: Pane) -> Continuation:
        """Return how a pane goes on."""
        setup = pane.setup
        return Continuation(replace(setup, law=self.law) if pane.number == self.pane else setup)


@dataclass(frozen=True)
class SetLimits:
    """All robots are, and can do, something else."""

    limits: TeamSpec

    def of(self, pane: Pane) -> Continuation:
        """Return how a pane goes on."""
        return Continuation(replace(pane.setup, limits=self.limits))


@dataclass(frozen=True)
class RemovePane:
    """A pane is left out from now on."""

    pane: int


@dataclass(frozen=True, eq=False)
class Restart:
    """All begin anew, at time 0: the first change of every session, too."""

    scenario: Scenario


MapChange: TypeAlias = EditObstacles | Paint | SetDensity
PaneChange: TypeAlias = Place | Join | Leave | Fail | Revive | SetController | SetLimits
Change: TypeAlias = PaneChange | MapChange | Drag | Release | RemovePane | Restart


def map_change(before: Environment, after: Environment) -> EditObstacles:
    """Return the change from one map to another of the same place that differs in some obstacles."""
    old, new = before.obstacles, after.obstacles
    first = 0
    while first < min(len(old), len(new)) and old[first] == new[first]:
        first += 1
    last = 0
    while last < min(len(old), len(new)) - first and old[-1 - last] == new[-1 - last]:
        last += 1
    return EditObstacles(first, len(old) - first - last, new[first : len(new) - last])


def _there(pane: Pane) -> set[int]:
    return {*pane.numbers, *pane.setup.failed}


def _row(pane: Pane, number: int) -> int | None:
    """Return the row of a robot, None where it has failed."""
    if number not in _there(pane):
        raise ParameterError(f"there is no robot {number}")
    return pane.row(number)


def _need_another(pane: Pane, number: int) -> None:
    if not set(pane.numbers) - {number}:
        raise ParameterError("the last robot that works stays")


def _fitting(setup: PaneSetup, number: int, others: np.ndarray, radii: np.ndarray, point: Point) -> Point:
    """Return the place nearest to a point where a robot fits beside the others and those that failed."""
    return nearest_free(setup.solid, setup.limits.radius_of(number), others, point, radii)


def _without_wreck(setup: PaneSetup, number: int) -> PaneSetup:
    return replace(setup, failed={key: place for key, place in setup.failed.items() if key != number})


def _without_robot(pane: Pane, number: int) -> Continuation:
    setup, row = _without_wreck(pane.setup, number), pane.row(number)
    if row is None:
        return Continuation(setup)
    return Continuation(
        replace(setup, numbers=tuple(each for each in setup.numbers if each != number)),
        np.delete(pane.simulation.positions, row, axis=0),
        np.delete(pane.simulation.velocities, row, axis=0),
    )


def _with_robot(pane: Pane, setup: PaneSetup, number: int, point: Point) -> Continuation:
    """Return a pane's robots and one more, at rest at a point or as near as it fits."""
    positions, row = pane.simulation.positions, bisect(setup.numbers, number)
    place = _fitting(setup, number, positions, pane.simulation.team.radius, point)
    return Continuation(
        replace(setup, numbers=(*setup.numbers[:row], number, *setup.numbers[row:])),
        np.insert(positions, row, place, axis=0),
        np.insert(pane.simulation.velocities, row, 0.0, axis=0),
    )
