"""Atomic changes of a session: what a touch consists of, as files have it, and what each does to a pane."""

from dataclasses import dataclass, field, replace
from itertools import takewhile
from typing import Annotated, Any, Literal, TypeAlias, cast

import numpy as np
from pydantic import ConfigDict, Field, WrapValidator

from robocov.density import Density
from robocov.environment import Environment, Obstacle, Point
from robocov.errors import MapError, ParameterError, RobocovError
from robocov.mapfile import parse_density, to_json
from robocov.mapfile.models import DensityModel, ObstacleModel, to_json_value
from robocov.world.free_positions import find_free_position
from robocov_app.viewer.session.map_edits import painted, with_replaced
from robocov_app.viewer.session.pane import Continuation, Pane
from robocov_app.viewer.session.scenario import MOST_ROBOTS, Law, Limits, Position, Scenario, read_as, refused

Robot: TypeAlias = Annotated[int, Field(strict=True, ge=1, le=1_000_000, description="Number of a robot")]
_Pane: TypeAlias = Annotated[int, Field(strict=True, ge=0, le=100, description="Number of a pane")]
_Count: TypeAlias = Annotated[int, Field(strict=True, ge=0)]
_SINCE = "Control steps since time 0"
Step: TypeAlias = Annotated[int, Field(strict=True, ge=0, le=100_000_000, description=_SINCE)]
_OBSTACLES = read_as(
    list[ObstacleModel],
    lambda models, _: tuple(model.build() for model in models),
    lambda obstacles, _: [to_json_value(each) for each in obstacles],
)


def _density_of(model: Any, context: Any) -> Density | None:
    if model is None:
        return None
    boundary = context.environment(0).boundary
    return parse_density(model.model_dump(exclude_none=True, warnings=False), boundary, context.where)


def _density_json(density: Density | None, context: object = None) -> object:
    square = Environment("square", ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)), (), {})
    return to_json(square.with_density(density)).get("density")


_DENSITY = read_as(DensityModel | None, _density_of, _density_json)


def _begun(value: object, read: Any) -> Scenario:
    try:
        return cast(Scenario, read(value))
    except MapError:
        raise
    except RobocovError as error:
        raise refused(error) from None


@dataclass(frozen=True, kw_only=True)
class _Change:
    """`step`: at which it is made; -1 before that. `do`: what it is called in files.

    `of` tells how a pane goes on then, `on` what becomes of the map; an error says why that cannot be.
    """

    __pydantic_config__ = ConfigDict(extra="forbid", validate_default=True)

    step: Step = -1
    do: str


@dataclass(frozen=True)
class OfRobot(_Change):
    """Change to a robot."""

    robot: Robot


@dataclass(frozen=True)
class Drag(OfRobot):
    """The hand holds a robot and pulls it towards a point, m, by a spring."""

    to: Position
    do: Literal["drag"] = field(default="drag", kw_only=True)


@dataclass(frozen=True)
class Release(_Change):
    """The hand lets go; a robot that was swung flies on."""

    do: Literal["release"] = field(default="release", kw_only=True)


@dataclass(frozen=True)
class Place(OfRobot):
    """Put a robot, working or failed, at a point, m."""

    at: Position
    do: Literal["place"] = field(default="place", kw_only=True)

    def of(self, pane: Pane) -> Continuation:
        row, place = _row(pane, self.robot), _fitting(pane, self.robot, self.at)
        return _with(pane, self.robot, failed=place) if row is None else _with(pane, self.robot, place)


@dataclass(frozen=True)
class Join(OfRobot):
    """One robot more, at rest at a point, m."""

    at: Position
    do: Literal["join"] = field(default="join", kw_only=True)

    def of(self, pane: Pane) -> Continuation:
        there = pane.setup.there
        if len(there) >= MOST_ROBOTS:
            raise ParameterError(f"there are {MOST_ROBOTS} robots already")
        if self.robot in there:
            raise ParameterError(f"there is a robot {self.robot} already")
        return _with(pane, self.robot, _fitting(pane, self.robot, self.at))


@dataclass(frozen=True)
class Leave(OfRobot):
    """Take a robot out, whether it works or not."""

    do: Literal["leave"] = field(default="leave", kw_only=True)

    def of(self, pane: Pane) -> Continuation:
        _row(pane, self.robot)
        _need_another(pane, self.robot)
        return _with(pane, self.robot)


@dataclass(frozen=True)
class Fail(OfRobot):
    """A robot stops where it is, and is not heard any more; the others sense it as they do any obstacle."""

    do: Literal["fail"] = field(default="fail", kw_only=True)

    def of(self, pane: Pane) -> Continuation:
        if (row := _row(pane, self.robot)) is None:
            raise ParameterError(f"robot {self.robot} has failed already")
        _need_another(pane, self.robot)
        x, y = pane.simulation.positions[row].tolist()
        return _with(pane, self.robot, failed=(x, y))


@dataclass(frozen=True)
class Revive(OfRobot):
    """A robot that failed works again, where it stands or as near as it fits."""

    do: Literal["revive"] = field(default="revive", kw_only=True)

    def of(self, pane: Pane) -> Continuation:
        if _row(pane, self.robot) is not None:
            raise ParameterError(f"robot {self.robot} works")
        return _with(pane, self.robot, _fitting(pane, self.robot, pane.setup.failed[self.robot]))


@dataclass(frozen=True)
class EditObstacles(_Change):
    """Obstacles number `first` to `first + removed - 1` are replaced by others."""

    first: _Count
    removed: _Count
    added: Annotated[tuple[Obstacle, ...], _OBSTACLES]
    do: Literal["obstacles"] = field(default="obstacles", kw_only=True)

    def on(self, environment: Environment) -> Environment:
        return with_replaced(environment, self.first, self.removed, self.added)


@dataclass(frozen=True)
class Paint(_Change):
    """Dabs of a brush of `radius`, m, that raise the density, or lower it."""

    dabs: tuple[Position, ...]
    radius: Annotated[float, Field(strict=True, gt=0, le=1e6)]
    lowers: Annotated[bool, Field(strict=True)]
    do: Literal["paint"] = field(default="paint", kw_only=True)

    def on(self, environment: Environment) -> Environment:
        return environment.with_density(painted(environment, self.dabs, self.radius, lowers=self.lowers))


@dataclass(frozen=True, eq=False)
class SetDensity(_Change):
    """Places count by another density; None: all the same."""

    density: Annotated[Density | None, _DENSITY]
    do: Literal["density"] = field(default="density", kw_only=True)

    def on(self, environment: Environment) -> Environment:
        return environment.with_density(self.density)


@dataclass(frozen=True)
class SetController(_Change):
    """Another controller, or other gains, take over in a pane."""

    pane: _Pane
    law: Annotated[Law, Field(alias="controller")]
    do: Literal["controller"] = field(default="controller", kw_only=True)

    def of(self, pane: Pane) -> Continuation:
        return Continuation(replace(pane.setup, law=self.law) if pane.number == self.pane else pane.setup)


@dataclass(frozen=True)
class SetLimits(_Change):
    """All robots are, and can do, something else."""

    limits: Annotated[Limits, Field(alias="team")]
    do: Literal["team"] = field(default="team", kw_only=True)

    def of(self, pane: Pane) -> Continuation:
        return Continuation(replace(pane.setup, limits=self.limits))


@dataclass(frozen=True)
class RemovePane(_Change):
    """A pane is left out from now on."""

    pane: _Pane
    do: Literal["remove-pane"] = field(default="remove-pane", kw_only=True)


@dataclass(frozen=True, eq=False)
class Restart(_Change):
    """All begin anew, at time 0: the first change of every session, too."""

    scenario: Annotated[Scenario, WrapValidator(_begun)]
    do: Literal["restart"] = field(default="restart", kw_only=True)


MapChange: TypeAlias = EditObstacles | Paint | SetDensity
PaneChange: TypeAlias = Place | Join | Leave | Fail | Revive | SetController | SetLimits
Touch: TypeAlias = PaneChange | MapChange | Drag | Release | RemovePane
Change: TypeAlias = Touch | Restart


def map_change(before: Environment, after: Environment) -> EditObstacles:
    old, new = before.obstacles, after.obstacles
    first = _alike(old, new)
    last = _alike(old[first:][::-1], new[first:][::-1])
    return EditObstacles(first, len(old) - first - last, new[first : len(new) - last])


def _alike(old: tuple[Obstacle, ...], new: tuple[Obstacle, ...]) -> int:
    return sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], zip(old, new, strict=False)))


def _row(pane: Pane, number: int) -> int | None:
    """Return the row of a robot, None where it has failed."""
    if number not in pane.setup.there:
        raise ParameterError(f"there is no robot {number}")
    return pane.row(number)


def _need_another(pane: Pane, number: int) -> None:
    if not set(pane.numbers) - {number}:
        raise ParameterError("the last robot that works stays")


def _fitting(pane: Pane, number: int, point: Point) -> Point:
    """Return the place nearest to a point where a robot fits beside all others."""
    setup, simulation = pane.setup, pane.simulation
    rows = [row for row, each in enumerate(pane.numbers) if each != number]
    wrecks = {each: place for each, place in setup.failed.items() if each != number}
    solid, radius = replace(setup, failed=wrecks).solid, setup.limits.radius_of(number)
    return find_free_position(solid, radius, simulation.positions[rows], point, simulation.team.radius[rows])


def _with(pane: Pane, number: int, at: Point | None = None, failed: Point | None = None) -> Continuation:
    """Return a pane with a robot at rest at a place, or failed at one, or without it."""
    setup, simulation, wrecks = pane.setup, pane.simulation, dict(pane.setup.failed)
    moving = zip(simulation.positions, simulation.velocities, strict=True)
    robots: dict[int, Any] = dict(zip(pane.numbers, moving, strict=True))
    robots.pop(number, None)
    if at is not None:
        robots[number] = at, (0.0, 0.0)
    if failed is not None:
        wrecks[number] = failed
    else:
        wrecks.pop(number, None)
    numbers = tuple(sorted(robots))
    if numbers != setup.numbers or wrecks != setup.failed:
        setup = replace(setup, numbers=numbers, failed=wrecks)
    if numbers == pane.numbers and at is None:
        return Continuation(setup)
    return Continuation(setup, *(np.array([robots[each][k] for each in numbers]) for k in (0, 1)))
