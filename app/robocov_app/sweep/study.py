"""A study, what a sweep runs, with every combination of the gains that it tries; its tasks: one run each."""

from __future__ import annotations

import hashlib
import json
import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any, Literal, TypeAlias, TypeVar, cast, get_args

import numpy as np

from robocov.arrays import Array
from robocov.conditions import PARAMETERS, Conditions, Failure, Join, parse_event
from robocov.conditions import UNITS as CONDITION_UNITS
from robocov.controllers import get_gain_values, get_gains, load_controller_class
from robocov.controllers.gains import Gain, Option, Value, instantiate_controller
from robocov.controllers.user_modules import ControllerSource, find_own_modules
from robocov.defaults import (
    DEFAULT_DT_S,
    DEFAULT_DURATION_S,
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
from robocov.errors import (
    InputError,
    ParameterError,
    describe_unknown_name,
    format_path,
    quote,
    require_number,
    require_type,
)
from robocov.mapfile import to_json
from robocov.scenario import MAX_RECORD_ROWS
from robocov.simulation import check_dt, check_joins
from robocov.team import KINEMATICS, Team
from robocov.team import UNITS as TEAM_UNITS
from robocov.team_files import build_team

T = TypeVar("T")
Scale: TypeAlias = Literal["linear", "log"]
Method: TypeAlias = Literal["sobol", "latin-hypercube", "halton"]
NO_LIMIT = "null"  # what stands for None where a file has no word for it
MOST_SAMPLES = 100_000
_SAMPLE_DIGITS = 6  # of a sampled gain: more say nothing, and the last ones differ between processors
_FORMAT = "robocov-task 1"  # of the digest; that the same inputs give other results is told by `made_with`
_SHORT = 24  # characters of each name in the name of a folder
_DIGITS = 10  # hexadecimal digits of the digest in the name of a folder
Place: TypeAlias = tuple[str | int, ...]


@dataclass(frozen=True)
class Range:
    """Range of a gain, both ends included, sampled evenly by value or by its logarithm."""

    low: float
    high: float
    scale: Scale = "linear"

    def values(self, parts: Array) -> list[float]:
        """Return the values at (m,) parts of the range, from 0 to 1, rounded to six digits."""
        log = self.scale == "log"
        low, high = (math.log(self.low), math.log(self.high)) if log else (self.low, self.high)
        exact = low + (high - low) * parts
        exact = np.exp(exact) if log else exact
        return [min(max(float(f"{x:.{_SAMPLE_DIGITS}g}"), self.low), self.high) for x in exact.tolist()]


@dataclass(frozen=True)
class Sampling:
    """Joint sampling of a controller's ranges by `scipy.stats.qmc`, scrambled."""

    method: Method = "sobol"
    samples: int = 16
    seed: int = 0

    def __post_init__(self) -> None:
        if self.method not in get_args(Method):
            raise ParameterError(
                f"sampling.method: {describe_unknown_name('method', self.method, get_args(Method))}"
            )
        require_number("sampling.samples", self.samples, 1, MOST_SAMPLES, whole=True)
        require_number("sampling.seed", self.seed, 0, 2**63 - 1, whole=True)

    def points(self, dimensions: int) -> Array:
        """Return as many points of the unit cube as there are samples, (samples, dimensions)."""
        from scipy.stats import qmc

        rng = np.random.default_rng(self.seed)
        if self.method == "sobol":  # the beginning of a longer, balanced sequence
            points = qmc.Sobol(dimensions, seed=rng).random_base2((self.samples - 1).bit_length())
            return np.asarray(points[: self.samples])
        kind = qmc.Halton if self.method == "halton" else qmc.LatinHypercube
        return np.asarray(kind(dimensions, seed=rng).random(self.samples))


Wanted: TypeAlias = "Gains | Mapping[str, Any] | Sequence[Mapping[str, Any]]"
"""Accepted forms of a controller's gains in a study; see `Gains.of`."""


@dataclass(frozen=True)
class Gains:
    """The gains of one controller in a study, and what was sampled."""

    choices: tuple[Mapping[str, Value], ...]  # a value for every gain
    ranges: Mapping[str, Range] = field(default_factory=dict)

    @classmethod
    def of(cls, kind: type[Any], wanted: Wanted, sampling: Sampling | None, path: Place = ()) -> Gains:
        """Return what is tried of a controller of a class; other gains have their defaults.

        `wanted`: sets of gains, as dicts; or one dict of name to a value, a list of which every combination
        is tried, or a `Range`. Raises ParameterError, which begins with the place.
        """
        if isinstance(wanted, Gains):
            return cls(cls.of(kind, wanted.choices, None, path).choices, wanted.ranges)
        if isinstance(wanted, Mapping):
            return _of_axes(kind, wanted, sampling, path)
        if not wanted:
            raise ParameterError(f"{format_path(path)}: expected at least one set of gains, got none")
        known = get_gains(kind)
        choices = []
        for k, given in enumerate(wanted):
            values = {name: _value(known, name, value, (*path, k, name)) for name, value in given.items()}
            choices.append(get_gain_values(instantiate_controller(kind, values)))
        once(choices, path)
        return cls(tuple(choices))


def _of_axes(kind: type[Any], axes: Mapping[str, Any], sampling: Sampling | None, path: Place) -> Gains:
    """Return every combination of the lists with every sample of the ranges, the samples innermost."""
    known = get_gains(kind)
    lists: dict[str, list[Value]] = {}
    ranges: dict[str, Range] = {}
    for name, given in axes.items():
        at = (*path, name)
        if isinstance(given, Range):
            ranges[name] = _checked_range(known, name, given, at)
        else:
            lists[name] = axis(given, at, partial(_value, known, name))
    samples: list[tuple[float, ...]] = [()]
    if ranges:
        if sampling is None:
            at = (*path, next(iter(ranges)))
            raise ParameterError(
                f"{format_path(at)}: a range, but sampling says neither a method nor how many"
            )
        points = sampling.points(len(ranges))
        columns = [each.values(points[:, k]) for k, each in enumerate(ranges.values())]
        samples = list(zip(*columns, strict=True))
    choices = [
        get_gain_values(
            instantiate_controller(kind, dict(zip([*lists, *ranges], (*row, *sample), strict=True)))
        )
        for row, sample in product(product(*lists.values()), samples)
    ]
    once(choices, (*path, "samples"))  # as of a range that is narrower than the digits of a sample
    return Gains(tuple(choices), ranges)


def _value(known: Mapping[str, Gain | Option], name: str, value: object, path: Place) -> Value:
    """Return a value of a gain; both ``inf`` and ``"null"`` stand for no limit where there may be none."""
    gain = _known(known, name, path)
    if gain.optional and value in (NO_LIMIT, math.inf):
        return None
    return placed(path, lambda: gain.validate(value, ""))


def _known(known: Mapping[str, Gain | Option], name: str, path: Place) -> Gain | Option:
    if name not in known:
        above = format_path(path[: len(path) - 1 - isinstance(path[-1], int)])
        if not known:
            raise ParameterError(f"{above}: {quote(name)}, but the controller has no gains")
        raise ParameterError(f"{above}: {describe_unknown_name('gain', name, known)}")
    return known[name]


def _checked_range(known: Mapping[str, Gain | Option], name: str, given: Range, path: Place) -> Range:
    gain = _known(known, name, path)
    if isinstance(gain, Option):
        wanted = f"one of {', '.join(gain.choices)}, or a list of them"
        raise ParameterError(f"{format_path(path)}: expected {wanted}, got a range")
    ends = []
    for end, value in (("low", given.low), ("high", given.high)):
        if value is None:
            raise ParameterError(f"{format_path((*path, end))}: expected a number, got {quote(None)}")
        ends.append(placed((*path, end), partial(gain.validate, value, "")) or 0.0)
    low, high = ends
    if given.scale not in get_args(Scale):
        unknown = describe_unknown_name("scale", given.scale, get_args(Scale))
        raise ParameterError(f"{format_path((*path, 'scale'))}: {unknown}")
    if not low < high:
        raise ParameterError(f"{format_path((*path, 'high'))}: expected a number above {low:g}, got {high:g}")
    if given.scale == "log" and low <= 0.0:
        wanted = "a number above 0, as the scale is that of logarithms"
        raise ParameterError(f"{format_path((*path, 'low'))}: expected {wanted}, got {low:g}")
    return Range(low, high, given.scale)


def placed(path: Place, check: Callable[[], T]) -> T:
    """Return what `check` returns; its complaint is told of `path`, in place of what it names."""
    try:
        return check()
    except ParameterError as error:
        raise ParameterError(f"{format_path(path)}: {str(error).partition(': ')[2]}") from None


def axis(given: Any, path: Place, check: Callable[[Any, Place], T]) -> list[T]:
    """Return what `check` makes of a value, or of each of a list of values, which differ."""
    if not isinstance(given, Sequence) or isinstance(given, str):
        return [check(given, path)]
    values = [check(value, (*path, k)) for k, value in enumerate(given)]
    if not values:
        raise ParameterError(f"{format_path(path)}: expected at least one value, got none")
    once(values, path)
    return values


def once(values: Sequence[object], path: Place) -> None:
    seen: dict[object, int] = {}
    for k, value in enumerate(values):
        first = seen.setdefault(tuple(value.items()) if isinstance(value, Mapping) else value, k)
        if first < k:
            told = (
                f"{format_path((*path, k))}: {quote(value)} is given already at {format_path((*path, first))}"
            )
            raise ParameterError(f"{told}; duplicate value")


TeamValue: TypeAlias = float | str | None  # of what is varied of team and conditions
EVENTS = {"fail": Failure, "join": Join}  # conditions that are texts: ``3@20 5@40`` are two in one run
CONDITIONS = (*PARAMETERS, *EVENTS)  # the conditions that a study may sweep
WORDS = (*EVENTS, "kinematics")
GROUPS = "groups"  # robots that differ, as JSON: the groups of a team file
UNITS = {**TEAM_UNITS, **CONDITION_UNITS, **dict.fromkeys((*WORDS, GROUPS), "")}


def parameter_column(name: str) -> str:
    """Return the name of the column of a parameter of the team, or of a condition, as ``max_speed_m_s``."""
    unit = UNITS[name].lower().replace("1/", "per ").replace("²", "2")
    return "_".join([name, *re.findall(r"\w+", unit)])


def parameter_text(name: str, value: TeamValue) -> str:
    """Return a value with its unit.

    >>> parameter_text("groups", '[{"count": 2, "max_speed": 0.5}, {"count": 1}]')
    '2 with max speed 0.5 m/s; 1 as the rest'
    >>> parameter_text("delay", 0.5), parameter_text("loss", 0.2), parameter_text("fail", "")
    ('0.5 s', '0.2', 'none')
    """
    if name in WORDS:
        return str(value) or "none"
    if name != GROUPS:
        return "no limit" if value is None else f"{value:g} {UNITS[name]}".rstrip()
    groups = []
    for group in json.loads(str(value)):
        count, own = group.pop("count"), []
        for key, each in group.items():
            text = each if isinstance(each, str) else f"{each:g}"
            own.append(f"{key.replace('_', ' ')} {text} {UNITS[key]}")
        groups.append(f"{count} {'with ' + ', '.join(own) if own else 'as the rest'}")
    return "; ".join(groups)


def condition_axes(given: Mapping[str, Any]) -> dict[str, list[TeamValue]]:
    """Return the values of each condition that is given, or raise ParameterError with the place."""
    axes: dict[str, list[TeamValue]] = {}
    for name, values in given.items():
        if name not in CONDITIONS:
            raise ParameterError(f"conditions: {describe_unknown_name('condition', name, CONDITIONS)}")
        axes[name] = axis(values, ("conditions", name), partial(_value_of, name))
    return axes


def conditions_of(parameters: Mapping[str, TeamValue], seed: int, robots: int) -> Conditions | None:
    """Return the conditions among what a study varies; None where they are ideal."""
    values: dict[str, Any] = {name: parameters[name] for name in PARAMETERS if name in parameters}
    fail, join = (str(parameters.get(name, "")).split() for name in EVENTS)
    values["failures"] = tuple(parse_event(Failure, word) for word in fail)
    values["joins"] = tuple(parse_event(Join, word) for word in join)
    conditions = Conditions(**values, seed=seed)
    conditions.check_team(robots)
    return None if conditions.is_ideal else conditions


DEFAULT_MAX_RUNS = 100_000
"""Runs of a study that does not allow more: on ten cores they take some days."""
MAX_MAX_RUNS = 10_000_000
"""Runs that a study may allow at most: they are listed in memory."""
ALL = "*"  # stands for all starts of a map
TEAM = ("radius", "max_speed", "max_acceleration", "viscosity", "sensing_range", "communication_range")
"""Parameters of a team that a study may sweep."""
UNICYCLES = {"kinematics": "point", "track_width": 0.0, "turning_rate": DEFAULT_TURNING_RATE_RAD_S}
"""More of them, with defaults: what is as by default a study does not tell."""
_UNLIMITED: dict[str, tuple[object, ...]] = {"message_rate": (None, NO_LIMIT)}  # words for no limit
_UNLIMITED |= dict.fromkeys(("sensing_range", "communication_range"), (None, NO_LIMIT, math.inf))
_LONGEST_NAME = 100
_HUGE = 1e300  # what a float can hold, with some to spare
Swept: TypeAlias = float | Sequence[float | None] | None  # one value, or several, each of which is tried


@dataclass(frozen=True)
class StudyMap:
    """A map of a study."""

    name: str  # what the table calls it
    environment: Environment


@dataclass(frozen=True, eq=False)
class Study:
    """Definition of a sweep: every combination of what is given, from the same starts for every controller.

    What has the type `Swept` is a value, in SI units, or several of which each is tried. Raises
    ParameterError or StartError, whose message begins with the place, as in ``gains.rapf.k_rep[1]``.
    """

    maps: tuple[StudyMap, ...]
    controllers: tuple[str, ...]
    gains: Mapping[str, Wanted] = field(default_factory=dict)  # what is tried of each controller
    robots: Sequence[int] = (DEFAULT_ROBOTS,)
    starts: Sequence[str] = ()  # none: the first of each map; ("*",): all of each map
    seeds: Sequence[int] = (0,)
    duration: float = DEFAULT_DURATION_S
    dt: float = DEFAULT_DT_S  # control period, s
    radius: Swept = DEFAULT_RADIUS_M
    max_speed: Swept = DEFAULT_MAX_SPEED_M_S
    max_acceleration: Swept = DEFAULT_MAX_ACCELERATION_M_S2
    viscosity: Swept = DEFAULT_VISCOSITY_N_S_M
    sensing_range: Swept = DEFAULT_SENSING_RANGE_M
    communication_range: Swept = None  # without limit
    kinematics: str | Sequence[str] = "point"
    track_width: Swept = DEFAULT_TRACK_WIDTH_M
    turning_rate: Swept = DEFAULT_TURNING_RATE_RAD_S
    conditions: Mapping[str, Any] = field(default_factory=dict)  # of lists each is tried
    group: Sequence[Mapping[str, Any]] = ()  # robots that differ, as in a team file
    lattice: int = 64
    cost_hz: float = 2.0  # how often the cost is evaluated; 0: at the first moment and the last
    record_hz: float = 5.0  # how many moments are kept of each run; 0: the first and the last
    metrics: bool = False  # whether the table holds `robocov.metrics.run_metrics` of the end as well
    sampling: Sampling | None = None
    max_runs: int = DEFAULT_MAX_RUNS  # a study of more is refused before its combinations are made
    folder: Path = Path()  # where relative paths of controllers begin
    sources: Mapping[str, ControllerSource] = field(init=False)  # of the users' controllers, as they are now
    teams: tuple[Mapping[str, TeamValue], ...] = field(init=False)  # combinations of team and conditions

    def __post_init__(self) -> None:
        require_number("max_runs", self.max_runs, 1, MAX_MAX_RUNS, whole=True)
        require_few_runs(self._count_values(), self.controllers, self.gains, self.sampling, self.max_runs)
        for name in ("maps", "controllers", "robots", "starts", "seeds"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        if self.group:
            size = len(build_team(list(self.group), ("team", "group")))
            if self.robots not in (Study.robots, (size,)):
                raise ParameterError(
                    f"robots: expected {size} as in the groups of the team, got {list(self.robots)}"
                )
            object.__setattr__(self, "robots", (size,))
        for k, controller in enumerate(self.controllers):
            require_type(f"controllers[{k}]", controller, str, "a string")
        for k, each in enumerate(self.maps):
            name = each.name
            if not isinstance(name, str) or not 1 <= len(name) <= _LONGEST_NAME or not name.isprintable():
                wanted = f"a string of 1 to {_LONGEST_NAME} characters on one line"
                raise ParameterError(f"maps[{k}]: expected {wanted}, got name {quote(name)}")
        for name, low, high in (("robots", 1, 10_000), ("seeds", 0, 2**63 - 1)):
            for k, value in enumerate(getattr(self, name)):
                require_number(format_path((name, k)), value, low, high, whole=True)
        require_number("lattice", self.lattice, 2, 2048, whole=True)
        for name, most in (("duration", 1e6), ("dt", 1.0), ("cost_hz", 1e4), ("record_hz", 1e4)):
            object.__setattr__(self, name, require_number(name, getattr(self, name), 0.0, most))
        check_dt(self.dt)
        require_type("metrics", self.metrics, bool, "true or false")
        for name in ("maps", "controllers", "robots", "seeds"):
            if not getattr(self, name):
                raise ParameterError(f"{name}: expected at least one, got none")
            once([item.name for item in self.maps] if name == "maps" else getattr(self, name), (name,))
        once(self.starts, ("starts",))
        for (k, name), each in product(enumerate(self.starts if self.starts != (ALL,) else ()), self.maps):
            if name == ALL:
                beside = "is all of them, so nothing next to it is possible"
                raise ParameterError(f"starts[{k}]: {quote(ALL)} {beside}")
            try:
                each.environment.start(name)
            except InputError as error:
                raise type(error)(f"starts[{k}]: {error}") from None
        names = (*TEAM, *(name for name, usual in UNICYCLES.items() if getattr(self, name) != usual))
        axes = {name: axis(getattr(self, name), ("team", name), partial(_value_of, name)) for name in names}
        if self.group:
            axes[GROUPS] = [json.dumps([dict(each) for each in self.group])]
        axes |= condition_axes(self.conditions)
        for row in product(*(axes[name] for name in self.conditions)):
            for robots in self.robots:
                conditions = conditions_of(dict(zip(self.conditions, row, strict=True)), 0, robots)
                for each in self.maps:
                    check_joins(each.environment, conditions)
        teams = tuple(dict(zip(axes, row, strict=True)) for row in product(*axes.values()))
        object.__setattr__(self, "teams", teams)
        for name, value in zip(("sources", "gains"), self._controllers(), strict=True):
            object.__setattr__(self, name, value)
        rows = self.duration / self.dt * max(self.robots)
        if rows > MAX_RECORD_ROWS:
            rows_of = f"{self.duration:g} s of {max(self.robots)} robots at {self.dt:g} s are {rows:.3g} rows"
            raise ParameterError(
                f"duration: expected at most {MAX_RECORD_ROWS:.0e} rows of a record, got {rows_of}"
            )

    def _count_values(self) -> dict[str, int]:
        """Return how many values are given of what is varied, apart from gains, before they are checked."""
        given = {name: getattr(self, name) for name in ("maps", "robots", "seeds", *TEAM, *UNICYCLES)}
        counts = {name: _count(value) for name, value in (given | dict(self.conditions)).items()}
        counts["starts"] = _count(self.starts)
        if tuple(self.starts) == (ALL,):
            counts["starts"] = max((len(each.environment.starts) for each in self.maps), default=1)
        return counts

    def __len__(self) -> int:
        starts = sum(len(self.starts_on(each)) for each in self.maps)
        choices = sum(len(self.gains_of(name).choices) for name in self.controllers)
        return starts * len(self.robots) * len(self.teams) * len(self.seeds) * choices

    @property
    def swept(self) -> tuple[str, ...]:
        return tuple(name for name in self.teams[0] if len({team[name] for team in self.teams}) > 1)

    @property
    def mixed_speeds(self) -> bool:
        return bool(self.group) and any(team_of(self.robots[0], team).has_mixed_speeds for team in self.teams)

    def gains_of(self, controller: str) -> Gains:
        return cast("Gains", self.gains[controller])

    def starts_on(self, each: StudyMap) -> tuple[str, ...]:
        known = tuple(each.environment.starts) if self.starts == (ALL,) else tuple(self.starts)
        return known or (each.environment.start().name,)

    def kind(self, controller: str) -> type[Any]:
        return load_controller_class(controller, source=self.sources.get(controller))

    def to_json(self) -> dict[str, Any]:
        controllers = [{"name": each, **source_json(self.sources.get(each))} for each in self.controllers]
        return {
            "format": "robocov-study",
            "version": 1,
            "runs": len(self),
            "maps": [{"name": each.name, "map": to_json(each.environment)} for each in self.maps],
            "controllers": controllers,
            "gains": {name: asdict(self.gains_of(name)) for name in self.controllers},
            "sampling": None if self.sampling is None else asdict(self.sampling),
            "robots": list(self.robots),
            "teams": [dict(team) for team in self.teams],
            "starts": {each.name: list(self.starts_on(each)) for each in self.maps},
            "seeds": list(self.seeds),
            "duration_s": self.duration,
            "dt_s": self.dt,
            **{name: getattr(self, name) for name in ("lattice", "cost_hz", "record_hz", "metrics")},
        }

    def _controllers(self) -> tuple[dict[str, ControllerSource], dict[str, Gains]]:
        """Return the sources of the users' controllers, and what is tried of each controller."""
        for name in self.gains:
            if name not in self.controllers:
                known = describe_unknown_name("controller of the study", name, self.controllers)
                raise ParameterError(f"{format_path(('gains', name))}: {known}")
        sources, gains = {}, {}
        for k, name in enumerate(self.controllers):
            file, _, class_name = name.rpartition(":")
            if class_name and file.endswith(".py"):
                path = (self.folder / file).resolve()
                try:
                    sources[name] = ControllerSource(str(path), path.read_text(encoding="utf-8"))
                except (OSError, ValueError) as error:
                    reason = error.strerror if isinstance(error, OSError) else "not UTF-8"
                    raise ParameterError(f"controllers[{k}]: {quote(name)}: {path}: {reason}") from None
            try:
                kind = load_controller_class(name, source=sources.get(name))
            except ParameterError as error:
                raise ParameterError(f"controllers[{k}]: {error}") from error
            if source := sources.get(name):  # now: it may have added folders to sys.path
                sources[name] = source._replace(modules=find_own_modules(source.text))
            gains[name] = Gains.of(kind, self.gains.get(name, {}), self.sampling, ("gains", name))
        if self.sampling is not None and not any(each.ranges for each in gains.values()):
            raise ParameterError("sampling: expected at least one gain with a range {low, high}, got none")
        return sources, gains


def require_few_runs(
    counts: Mapping[str, int],
    controllers: Sequence[str],
    gains: Mapping[str, Any],
    sampling: Sampling | None,
    max_runs: int,
) -> None:
    """Raise ParameterError when a study would have more than `max_runs` runs.

    Nothing is combined for it, as a file of some kB can stand for more runs than any memory holds.

    Parameters
    ----------
    counts : dict of str to int
        Number of values of each thing that is varied, apart from gains.
    controllers, gains, sampling
        As in `Study`.
    max_runs : int
    """
    combined = sum(_count_gains(gains.get(name, {}), sampling) for name in controllers)
    runs = math.prod(max(count, 1) for count in counts.values()) * combined
    if runs <= max_runs:
        return
    several = sorted((name for name, count in counts.items() if count > 1), key=lambda name: -counts[name])
    factors = [f"{_round_count(counts[name])} {name}" for name in several[:5]] + [
        f"{_round_count(combined)} sets of gains"
    ] * (combined > 1)
    product_of = f" ({' x '.join(factors)})" if factors else ""
    way_out = f"max_runs in the study allows more, up to {MAX_MAX_RUNS}"
    raise ParameterError(
        f"runs: expected at most {max_runs}, got {_round_count(runs)}{product_of}. {way_out}."
    )


def _count(values: object) -> int:
    """Return the length of a list of values, 1 for a single one."""
    if isinstance(values, range):  # one may be too long for `len`
        return max(-(-(values.stop - values.start) // values.step), 0)
    is_list = isinstance(values, Sequence) and not isinstance(values, str)
    return len(cast("Sequence[object]", values)) if is_list else 1


def _count_gains(given: Any, sampling: Sampling | None) -> int:
    """Return how many sets of gains are tried of a controller."""
    if isinstance(given, Gains):
        return len(given.choices)
    if not isinstance(given, Mapping):
        return _count(given)
    lists = math.prod(max(_count(values), 1) for values in given.values() if not isinstance(values, Range))
    has_range = any(isinstance(values, Range) for values in given.values())
    return lists * (sampling.samples if has_range and sampling is not None else 1)


def _round_count(count: int) -> str:
    """Return a number as it is read most easily, also one that is too large for a float."""
    if count < 10**9:
        return str(count)
    return f"{count:.3g}" if count < 10**300 else "more than 1e300"


def source_json(source: ControllerSource | None) -> dict[str, Any]:
    """Return what files say of a controller's source: its text, and those of the modules that it imports."""
    modules = {name: module.text for name, module in source.modules.items()} if source else {}
    return ({"source": source.text} if source else {}) | ({"modules": modules} if modules else {})


def _value_of(name: str, value: object, path: Place) -> TeamValue:
    if name == "kinematics":
        if value not in KINEMATICS:
            raise ParameterError(
                f"{format_path(path)}: expected {' or '.join(KINEMATICS)}, got {quote(value)}"
            )
        return str(value)
    if name in EVENTS:
        require_type(format_path(path), value, str, 'a string, as in "3@20"')
        try:
            return " ".join(str(parse_event(EVENTS[name], word)) for word in str(value).split())
        except ParameterError as error:
            raise ParameterError(f"{format_path(path)}: {error}") from None
    if value in _UNLIMITED.get(name, ()):
        return None
    if name in PARAMETERS:
        given: dict[str, Any] = {"forget_after": 1e6, name: value}
        return getattr(placed(path, lambda: Conditions(**given)), name)  # type: ignore[no-any-return]
    if isinstance(value, bool) or not isinstance(value, int | float) or abs(value) > _HUGE:
        raise ParameterError(f"{format_path(path)}: expected a number, got {quote(value)}")
    one: dict[str, Any] = {name: float(value)}
    placed(path, lambda: Team.homogeneous(1, **one))
    return float(value)


def team_of(robots: int, team: Mapping[str, TeamValue]) -> Team:
    """Return so many robots with the parameters of a study, equal ones but for its groups."""
    values: dict[str, Any] = {name: math.inf if team[name] is None else team[name] for name in TEAM}
    values |= {name: team[name] for name in UNICYCLES if name in team}
    if GROUPS in team:
        return build_team(json.loads(str(team[GROUPS])), ("team", "group"), values)
    return Team.homogeneous(robots, **values)


@dataclass(frozen=True, slots=True)
class Task:
    """One run; nothing but this is needed to do it, on whatever machine.

    `document`: the map as JSON. `team`: with conditions. Tasks of one `digest` have one result.
    """

    map: str
    document: str
    controller: str
    source: ControllerSource | None
    gains: Mapping[str, Value]
    robots: int
    team: Mapping[str, TeamValue]
    start: str
    seed: int
    duration: float
    dt: float
    lattice: int
    cost_hz: float
    record_hz: float
    metrics: bool = False
    digest: str = ""

    @property
    def name(self) -> str:
        words = (self.map, self.controller.rpartition(":")[2], self.robots, self.start, self.seed)
        # what can be a part of a folder's name on any system
        parts = (re.sub(r"[^A-Za-z0-9_.]+", "-", str(word)).strip(".-")[:_SHORT] or "x" for word in words)
        return "-".join([*parts, self.digest[:_DIGITS]])


def tasks_of(study: Study) -> Iterator[Task]:
    """Yield the runs in the order of the table: maps outermost, controllers and their gains innermost."""
    names = ("duration", "dt", "lattice", "cost_hz", "record_hz", *(["metrics"] if study.metrics else []))
    once = {name: getattr(study, name) for name in names}
    laws: list[tuple[dict[str, Any], dict[str, Any]]] = []  # what tasks hold of them, what their digests say
    for name in study.controllers:
        source = study.sources.get(name)
        said: dict[str, Any] = {"source": None, "path": None}
        if source is not None:
            said["source"] = _digest(source.text)
            if source.modules:
                said["modules"] = {key: _digest(module.text) for key, module in source.modules.items()}
        for choice in study.gains_of(name).choices:
            own = {"controller": name, "gains": dict(choice)}
            laws.append(({**own, "source": source}, {**own, **said}))
    for each in study.maps:
        document = json.dumps(to_json(each.environment), ensure_ascii=False, allow_nan=False)
        short = {"document": _digest(document)}
        axes = (study.robots, study.teams, study.starts_on(each), study.seeds, laws)
        for robots, team, start, seed, (law, words) in product(*axes):
            own = {"map": each.name, "robots": robots, "team": dict(team), "start": start, "seed": seed}
            inputs: dict[str, Any] = once | own
            digest = _digest(_FORMAT + json.dumps(inputs | words | short, sort_keys=True))
            yield Task(**inputs, **law, document=document, digest=digest)


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()
