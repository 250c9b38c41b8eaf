"""Scenario of a run: map, controllers, team and starts; and how these stand in session files."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Annotated, Any, Self, TypeAlias

import numpy as np
from pydantic import AfterValidator, ConfigDict, Field, GetPydanticSchema, WrapSerializer
from pydantic_core import PydanticCustomError, core_schema

from robocov.arrays import Array
from robocov.conditions import Conditions
from robocov.controllers import CONTROLLERS, get_gains, load_controller_class, make_controller
from robocov.controllers.base import Controller
from robocov.controllers.gains import Gain, Option, Value, format_value
from robocov.defaults import (
    DEFAULT_COMMUNICATION_RANGE_M,
    DEFAULT_DT_S,
    DEFAULT_MASS_KG,
    DEFAULT_MAX_ACCELERATION_M_S2,
    DEFAULT_MAX_SPEED_M_S,
    DEFAULT_RADIUS_M,
    DEFAULT_ROBOTS,
    DEFAULT_SENSING_RANGE_M,
    DEFAULT_TRACK_WIDTH_M,
    DEFAULT_TURNING_RATE_RAD_S,
    DEFAULT_VISCOSITY_N_S_M,
)
from robocov.environment import Environment
from robocov.errors import ParameterError, RobocovError, quote
from robocov.team import UNITS, Team

MOST_ROBOTS = 1000  # so many robots can be asked for in the window
MOST_THAT_TALK = 100  # so many robots can be asked for where each has messages of its own of every other
MOST_PANES = 4  # so many controllers can be compared side by side


def read_as(kind: Any, made: Callable[[Any, Any], object], plain: Callable[[Any, Any], object]) -> Any:
    """Let a field stand in files as a `kind`; `made` and `plain` also get the context of the file."""

    def schema(_: object, handler: Any) -> Any:
        return core_schema.with_info_after_validator_function(
            lambda value, info: made(value, info.context),
            handler.generate_schema(kind),
            serialization=core_schema.plain_serializer_function_ser_schema(
                lambda value, info: plain(value, info.context), info_arg=True
            ),
        )

    return GetPydanticSchema(schema)


def refused(error: object) -> PydanticCustomError:
    return PydanticCustomError("refused", "{words}", {"words": str(error)})


def _known(law: "ControllerChoice", info: Any) -> "ControllerChoice":
    """Return a controller of a file as the user has named it: none is run because a file says so."""
    kind, own = law.name.rpartition(":")[2], info.context.controllers
    if law.name not in CONTROLLERS and law.name not in own:
        named = next((each for each in own if each.rpartition(":")[2] == kind), None)
        if named is None:
            how = f"to run it, open the session with --controller {law.name}"
            raise refused(f"{law.name!r} is none of robocov's controllers; {how}")
        law = replace(law, name=named)
    try:
        law.made()
    except RobocovError as error:
        raise refused(error) from None
    return law


Text: TypeAlias = Annotated[str, Field(strict=True, max_length=10_000)]
Coordinate: TypeAlias = Annotated[float, Field(strict=True, ge=-1e6, le=1e6, allow_inf_nan=False)]
Position: TypeAlias = Annotated[tuple[Coordinate, Coordinate], Field(description="[x, y] in meters")]
_VALUE: TypeAlias = Annotated[float, Field(strict=True)] | Annotated[str, Field(strict=True)] | None
_GAINS = read_as(dict[str, _VALUE], lambda gains, _: gains, lambda gains, _: dict(gains))
_LIMIT = read_as(
    Annotated[float | None, Field(strict=True, ge=0, le=1e9, description="null: no limit")],
    lambda value, _: np.inf if value is None else value,
    lambda value, _: value if np.isfinite(value) else None,
)
_ROWS = read_as(
    list[Position] | None,
    lambda rows, _: None if rows is None else np.array(rows),
    lambda rows, _: None if rows is None else np.asarray(rows).tolist(),
)
_MAP = read_as(
    Annotated[int, Field(strict=True, ge=0, description="Number of the map in `maps`")],
    lambda number, context: context.environment(number),
    lambda environment, context: context.number(environment),
)
_CONDITIONS = read_as(
    dict[str, Any] | None,
    lambda plain, _: None if plain is None else Conditions.from_dict(plain),
    lambda conditions, _: None if conditions is None else conditions.to_dict(),
)
Limit: TypeAlias = Annotated[float, _LIMIT]


@dataclass(frozen=True)
class ControllerChoice:
    """A controller, by name as `make_controller` takes it, with gains that differ from their defaults."""

    __pydantic_config__ = ConfigDict(extra="forbid")

    name: Annotated[str, Field(strict=True, min_length=1, max_length=10_000)]
    gains: Annotated[Mapping[str, Value], _GAINS] = field(default_factory=dict)

    def made(self) -> Controller:
        return make_controller(self.name, self.gains)

    @cached_property  # for to look at a controller in a file is to run that file
    def label(self) -> str:
        return str(load_controller_class(self.name).label)

    @cached_property
    def known(self) -> dict[str, Gain | Option]:
        return get_gains(load_controller_class(self.name))

    def value(self, gain: str) -> Value:
        return self.gains[gain] if gain in self.gains else self.known[gain].default

    def with_gain(self, gain: str, value: Value) -> Self:
        """Return the law with another value of one gain; ParameterError as `made`."""
        changed = replace(self, gains={**self.gains, gain: value})
        changed.made()
        return changed.plain()

    def plain(self) -> Self:
        usual = {name: gain.default for name, gain in self.known.items()}.items()
        return replace(self, gains=dict(each for each in self.gains.items() if each not in usual))

    @property
    def words(self) -> str:
        gains = [f"{name} {_said(value)}" for name, value in self.plain().gains.items()]
        return ", ".join([self.label, *gains])

    def words_since(self, before: Self) -> str:
        changed = [name for name in self.known if self.value(name) != before.value(name)]
        return ", ".join(f"{name} = {_said(self.value(name))}" for name in changed)


def _said(value: Value) -> str:
    return format_value(value, digits=3, none="no limit")


@dataclass(frozen=True)
class TeamSpec:
    """Properties of each robot, as `Team` has them; SI units, infinite for no limit.

    `different`: values of single robots, by parameter and number.
    """

    __pydantic_config__ = ConfigDict(extra="forbid")

    radius: Limit = DEFAULT_RADIUS_M
    mass: Limit = DEFAULT_MASS_KG
    max_speed: Limit = DEFAULT_MAX_SPEED_M_S
    max_acceleration: Limit = DEFAULT_MAX_ACCELERATION_M_S2
    viscosity: Limit = DEFAULT_VISCOSITY_N_S_M
    sensing_range: Limit = DEFAULT_SENSING_RANGE_M
    communication_range: Limit = DEFAULT_COMMUNICATION_RANGE_M
    track_width: Limit = DEFAULT_TRACK_WIDTH_M
    turning_rate: Limit = DEFAULT_TURNING_RATE_RAD_S
    different: Mapping[str, Mapping[int, Limit]] = field(default_factory=dict)

    def team(self, robots: int | Sequence[int]) -> Team:
        """Return a team of so many robots, or of those with such numbers; ParameterError as `Team`."""
        numbers = range(1, robots + 1) if isinstance(robots, int) else robots
        team = Team.homogeneous(len(numbers), **{name: getattr(self, name) for name in UNITS})
        changed = dict[str, Array]()
        for name, values in self.different.items():
            changed[name] = np.array([values.get(number, getattr(self, name)) for number in numbers])
        return replace(team, **changed) if changed else team

    def radius_of(self, number: int) -> float:
        return float(self.team((number,)).radius[0])

    @classmethod
    def of(cls, team: Team, numbers: Sequence[int] | None = None) -> Self:
        columns = {name: getattr(team, name).tolist() for name in UNITS}
        numbers = range(1, len(team) + 1) if numbers is None else numbers
        varied = {name: values for name, values in columns.items() if len(set(values)) > 1}
        different = {name: dict(zip(numbers, values, strict=True)) for name, values in varied.items()}
        return cls(**{name: values[0] for name, values in columns.items()}, different=different)


Law: TypeAlias = Annotated[ControllerChoice, AfterValidator(_known)]
Limits: TypeAlias = Annotated[TeamSpec, WrapSerializer(lambda team, plain: _filled(plain(team)))]


def _filled(plain: dict[str, Any]) -> dict[str, Any]:
    # Older files do not have these.
    usual = {
        "different": {},
        "track_width": DEFAULT_TRACK_WIDTH_M,
        "turning_rate": DEFAULT_TURNING_RATE_RAD_S,
    }
    return {key: value for key, value in plain.items() if value != usual.get(key)}


@dataclass(frozen=True, eq=False)
class Scenario:
    """Scenario of a run; immutable.

    `laws`: one for each pane. `start`: named start of the map, its first by default. `seed`: of the starts.
    `dt`, s: control period. `given`, (n, 2) m, `moving`, (n, 2) m/s: starts from elsewhere, as a saved run.
    `conditions`: what goes wrong, and when robots fail and join by themselves.
    """

    __pydantic_config__ = ConfigDict(extra="forbid")

    environment: Annotated[Environment, _MAP, Field(alias="map")]
    laws: Annotated[tuple[Law, ...], Field(alias="controllers")] = (ControllerChoice("rapf"),)
    robots: Annotated[int, Field(strict=True, ge=1, le=MOST_ROBOTS)] = DEFAULT_ROBOTS
    start: Text | None = None
    seed: Annotated[int, Field(strict=True, ge=0)] = 0
    limits: Annotated[Limits, Field(alias="team")] = TeamSpec()
    dt: Annotated[float, Field(strict=True, alias="dt_s", ge=1e-4, le=1)] = DEFAULT_DT_S
    given: Annotated[Array | None, _ROWS, Field(alias="starts_m")] = None
    moving: Annotated[Array | None, _ROWS, Field(alias="start_velocities_m_per_s")] = None
    conditions: Annotated[Conditions | None, _CONDITIONS] = None

    def __post_init__(self) -> None:
        if not 1 <= self.robots <= MOST_ROBOTS:
            wanted = f"expected a whole number from 1 to {MOST_ROBOTS}"
            raise ParameterError(f"robots: {wanted}, got {quote(self.robots)}")
        if self.conditions is not None and self.conditions.uses_messages and self.robots > MOST_THAT_TALK:
            why = "where messages may be lost or late: the window remembers all of them, of all moments"
            raise ParameterError(f"robots: expected at most {MOST_THAT_TALK}, got {self.robots} {why}")
        if not 1 <= len(self.laws) <= MOST_PANES:
            raise ParameterError(f"controllers: expected 1 to {MOST_PANES}, got {len(self.laws)}")

    @property
    def start_name(self) -> str:
        if self.start is not None and self.start not in self.environment.starts:
            return self.start
        return self.environment.start(self.start).name

    def positions(self) -> Array:
        """Return the starts, (robots, 2) m; StartError when there is no room for the team."""
        if self.given is not None:
            return self.given
        radius = float(self.limits.team(self.robots).radius.max())  # room for the largest
        return self.environment.start(self.start).sample(self.robots, seed=self.seed, radius=radius)
