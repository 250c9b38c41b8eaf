"""A study: the definition of a sweep, with all combinations to try."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any, TypeAlias, cast

from robocov.controllers import load_controller_class
from robocov.controllers.user_modules import ControllerSource
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
    MAX_SEED,
    InputError,
    ParameterError,
    describe_unknown_name,
    format_bound,
    format_path,
    quote,
    require_number,
    require_type,
)
from robocov.mapfile import to_json
from robocov.scenario import MAX_RECORD_ROWS
from robocov.simulation import check_dt, check_joins
from robocov.team_files import build_team
from robocov_app.runs.settings import MAX_LATTICE, MIN_LATTICE
from robocov_app.sweep.study.controller_files import load_study_controller, source_to_json
from robocov_app.sweep.study.gains import Gains, GainsSpecification, build_gains
from robocov_app.sweep.study.parameters import (
    GROUPS,
    KINEMATIC_DEFAULTS,
    TEAM_PARAMETERS,
    ParameterValue,
    build_conditions,
    build_swept_team,
    parse_condition_axes,
    parse_parameter,
)
from robocov_app.sweep.study.sampling import Sampling
from robocov_app.sweep.study.study_size import DEFAULT_MAX_RUNS, MAX_MAX_RUNS, count_values, require_few_runs
from robocov_app.sweep.study.value_paths import parse_values, require_distinct

ALL_STARTS = "*"
"""Selects all starts of each map."""
MAX_ROBOTS = 10_000
"""Maximum number of robots of a run."""
_MAX_MAP_NAME_CHARS = 100
"""Maximum length of the name of a map."""

_MAX_NUMBERS = {"duration": 1e6, "dt": 1.0, "cost_hz": 1e4, "record_hz": 1e4}
"""Maximum values of a study's numbers, in s and Hz."""
Swept: TypeAlias = float | Sequence[float | None] | None
"""A single value, or a list of values that are all tried."""


@dataclass(frozen=True)
class StudyMap:
    """A map of a study.

    Attributes
    ----------
    name : str
        Name of the map in the table.
    environment : Environment
        The map.
    """

    name: str
    environment: Environment


@dataclass(frozen=True, eq=False)
class Study:
    """Definition of a sweep: all combinations of the given values, for which `generate_tasks` yields tasks.

    For the same map and seed, all controllers start from the same positions.

    Attributes
    ----------
    maps : sequence of StudyMap
        The maps.
    controllers : sequence of str
        Names of controllers, or ``file.py:Class``.
    gains : mapping of str to Gains
        Sets of gains to try for each controller, in any form that `build_gains` accepts. Controllers that are
        not mentioned have their default gains.
    robots : sequence of int
        Numbers of robots.
    starts : sequence of str
        Names of starts, which every map must have. By default the first start of each map is used;
        ``("*",)`` selects all starts of each map.
    seeds : sequence of int
        Seeds of the starting positions and of the conditions.
    duration, dt : float, s
        Simulated time and control period.
    radius, max_speed, max_acceleration, viscosity, sensing_range, communication_range
        Parameters of the robots in SI units; see `robocov.Team`: a value, or a list of values that are all
        tried. None means no limit.
    kinematics, track_width, turning_rate
        Further parameters of the robots, with one or several values as above.
    conditions : mapping of str to object
        A value or a list of values by the name of the condition.
    group : sequence of mapping
        Groups of different robots, as in a team file.
    lattice : int
        Number of sites along each side of the map at which the cost is computed.
    cost_hz : float, Hz
        Rate at which the cost is evaluated; 0 means only at the first and last step.
    record_hz : float, Hz
        Rate at which trajectories are saved; 0 means only the first and last step.
    metrics : bool
        Whether the table also contains the metrics of `robocov.metrics.run_metrics`.
    sampling : Sampling or None
        Method and number of samples of the ranges of gains; None if no gain has a range.
    max_runs : int
        Maximum number of runs; larger studies are rejected.
    folder : Path
        Folder to which relative paths of controllers refer.
    sources : mapping of str to ControllerSource
        Source texts of controllers in files of the user, which are read when the study is built.
    teams : tuple of dict of str to float, str or None
        All combinations of the parameters of the robots and the conditions.

    Raises
    ------
    InputError
        If a value is invalid. The message begins with its path, as in ``gains.rapf.k_rep[1]``.
    """

    maps: tuple[StudyMap, ...]
    controllers: tuple[str, ...]
    gains: Mapping[str, GainsSpecification] = field(default_factory=dict)
    robots: Sequence[int] = (DEFAULT_ROBOTS,)
    starts: Sequence[str] = ()
    seeds: Sequence[int] = (0,)
    duration: float = DEFAULT_DURATION_S
    dt: float = DEFAULT_DT_S
    radius: Swept = DEFAULT_RADIUS_M
    max_speed: Swept = DEFAULT_MAX_SPEED_M_S
    max_acceleration: Swept = DEFAULT_MAX_ACCELERATION_M_S2
    viscosity: Swept = DEFAULT_VISCOSITY_N_S_M
    sensing_range: Swept = DEFAULT_SENSING_RANGE_M
    communication_range: Swept = None
    kinematics: str | Sequence[str] = "point"
    track_width: Swept = DEFAULT_TRACK_WIDTH_M
    turning_rate: Swept = DEFAULT_TURNING_RATE_RAD_S
    conditions: Mapping[str, Any] = field(default_factory=dict)
    group: Sequence[Mapping[str, Any]] = ()
    lattice: int = 64
    cost_hz: float = 2.0
    record_hz: float = 5.0
    metrics: bool = False
    sampling: Sampling | None = None
    max_runs: int = DEFAULT_MAX_RUNS
    folder: Path = Path()
    sources: Mapping[str, ControllerSource] = field(init=False)
    teams: tuple[Mapping[str, ParameterValue], ...] = field(init=False)

    def __post_init__(self) -> None:
        """Check all values, and replace given values by resolved ones; later steps rely on earlier ones."""
        self._check_size()
        for name in ("maps", "controllers", "robots", "starts", "seeds"):
            self._replace_field(name, tuple(getattr(self, name)))
        self._resolve_group_size()
        self._check_names()
        self._check_numbers()
        self._check_lists()
        self._check_starts()
        self._resolve_teams()
        self._resolve_controllers()
        self._check_record_size()

    def _replace_field(self, name: str, value: object) -> None:
        """Replace a given value by its resolved form while the frozen study is being built."""
        object.__setattr__(self, name, value)

    def _check_size(self) -> None:
        """Raise an error if there are too many runs, before combinations are built."""
        require_number("max_runs", self.max_runs, 1, MAX_MAX_RUNS, whole=True)
        names = ("maps", "robots", "seeds", *TEAM_PARAMETERS, *KINEMATIC_DEFAULTS)
        counts = {name: count_values(getattr(self, name)) for name in names}
        counts |= {name: count_values(values) for name, values in self.conditions.items()}
        if tuple(self.starts) == (ALL_STARTS,):
            counts["starts"] = max((len(study_map.environment.starts) for study_map in self.maps), default=1)
        else:
            counts["starts"] = count_values(self.starts)
        require_few_runs(counts, self.controllers, self.gains, self.sampling, self.max_runs)

    def _resolve_group_size(self) -> None:
        """Set the number of robots to that of the groups, if there are groups."""
        if not self.group:
            return
        size = len(build_team(list(self.group), ("team", "group")))
        is_default = self.robots == Study.robots
        if not is_default and self.robots != (size,):
            raise ParameterError(
                f"robots: expected {size} as in the groups of the team, got {list(self.robots)}"
            )
        self._replace_field("robots", (size,))

    def _check_names(self) -> None:
        """Raise an error if the name of a controller or a map is invalid."""
        for index, controller in enumerate(self.controllers):
            require_type(f"controllers[{index}]", controller, str, "a string")
        for index, study_map in enumerate(self.maps):
            name = study_map.name
            is_valid = isinstance(name, str) and 1 <= len(name) <= _MAX_MAP_NAME_CHARS and name.isprintable()
            if not is_valid:
                expected = f"a string of 1 to {_MAX_MAP_NAME_CHARS} characters on one line"
                raise ParameterError(f"maps[{index}]: expected {expected}, got name {quote(name)}")

    def _check_numbers(self) -> None:
        """Raise an error if a number is out of range."""
        for index, robots in enumerate(self.robots):
            require_number(f"robots[{index}]", robots, 1, MAX_ROBOTS, whole=True)
        for index, seed in enumerate(self.seeds):
            require_number(f"seeds[{index}]", seed, 0, MAX_SEED, whole=True)
        require_number("lattice", self.lattice, MIN_LATTICE, MAX_LATTICE, whole=True)
        for name, maximum in _MAX_NUMBERS.items():
            self._replace_field(name, require_number(name, getattr(self, name), 0.0, maximum))
        check_dt(self.dt)
        require_type("metrics", self.metrics, bool, "true or false")

    def _check_lists(self) -> None:
        """Raise an error if a list is empty, or contains a value twice."""
        lists: dict[str, Sequence[object]] = {
            "maps": [study_map.name for study_map in self.maps],
            "controllers": self.controllers,
            "robots": self.robots,
            "seeds": self.seeds,
        }
        for name, values in lists.items():
            if not values:
                raise ParameterError(f"{name}: expected at least one, got none")
            require_distinct(values, (name,))
        require_distinct(self.starts, ("starts",))

    def _check_starts(self) -> None:
        """Raise an error if a map lacks one of the given starts."""
        if self.starts == (ALL_STARTS,):
            return
        for index, start in enumerate(self.starts):
            if start == ALL_STARTS:
                raise ParameterError(
                    f"starts[{index}]: {quote(ALL_STARTS)} selects all starts. Remove the other starts."
                )
            for study_map in self.maps:
                try:
                    study_map.environment.start(start)
                except InputError as error:
                    raise type(error)(f"starts[{index}]: {error}") from None

    def _resolve_teams(self) -> None:
        """Set `teams` to all combinations of the parameters of the robots and the conditions."""
        names = list(TEAM_PARAMETERS)
        # Defaults are left out, so that tasks without these parameters keep their hashes.
        names += [name for name, default in KINEMATIC_DEFAULTS.items() if getattr(self, name) != default]
        axes = {
            name: parse_values(getattr(self, name), ("team", name), partial(parse_parameter, name))
            for name in names
        }
        if self.group:
            axes[GROUPS] = [json.dumps([dict(group) for group in self.group])]
        condition_axes = parse_condition_axes(self.conditions)
        self._check_conditions(_combine(condition_axes))
        self._replace_field("teams", tuple(_combine(axes | condition_axes)))

    def _check_conditions(self, combinations: Sequence[Mapping[str, ParameterValue]]) -> None:
        """Raise an error if a combination of conditions is invalid for a team size or on a map."""
        for values in combinations:
            for robots in self.robots:
                # The checks do not depend on the seed.
                conditions = build_conditions(values, seed=0, robots=robots)
                for study_map in self.maps:
                    check_joins(study_map.environment, conditions)

    def _resolve_controllers(self) -> None:
        """Load all controllers, and build their sets of gains."""
        for name in self.gains:
            if name not in self.controllers:
                unknown = describe_unknown_name("controller of the study", name, self.controllers)
                raise ParameterError(f"{format_path(('gains', name))}: {unknown}")
        sources: dict[str, ControllerSource] = {}
        gains: dict[str, Gains] = {}
        for index, name in enumerate(self.controllers):
            try:
                controller_class, source = load_study_controller(name, self.folder)
            except ParameterError as error:
                raise ParameterError(f"controllers[{index}]: {error}") from error
            if source is not None:
                sources[name] = source
            specification = self.gains.get(name, {})
            gains[name] = build_gains(controller_class, specification, self.sampling, ("gains", name))
        if self.sampling is not None and not any(entry.ranges for entry in gains.values()):
            raise ParameterError("sampling: expected at least one gain with a range {low, high}, got none")
        self._replace_field("sources", sources)
        self._replace_field("gains", gains)

    def _check_record_size(self) -> None:
        """Raise an error if the record of a run would not fit into memory."""
        robots = max(self.robots)
        rows = self.duration / self.dt * robots
        if rows > MAX_RECORD_ROWS:
            raise ParameterError(
                f"duration: expected a record of at most {MAX_RECORD_ROWS / 1e6:g} million rows, "
                f"got {format_bound(self.duration)} s of {robots} robots at {self.dt:g} s, "
                f"which are {rows / 1e6:.3g} million rows"
            )

    def __len__(self) -> int:
        starts = sum(len(self.list_starts(study_map)) for study_map in self.maps)
        choices = sum(len(self.get_gains(name).choices) for name in self.controllers)
        return starts * len(self.robots) * len(self.teams) * len(self.seeds) * choices

    @property
    def varied_parameters(self) -> tuple[str, ...]:
        """Names of the parameters of the robots and of the conditions that have several values."""
        return tuple(name for name in self.teams[0] if len({team[name] for team in self.teams}) > 1)

    @property
    def has_mixed_speeds(self) -> bool:
        """Whether the robots of a run differ in maximum speed."""
        if not self.group:
            return False
        return any(build_swept_team(self.robots[0], team).has_mixed_speeds for team in self.teams)

    def get_gains(self, controller: str) -> Gains:
        """Return the sets of gains that are tried for a controller."""
        return cast("Gains", self.gains[controller])

    def list_starts(self, study_map: StudyMap) -> tuple[str, ...]:
        """Return the names of the starts of a map that the study uses."""
        environment = study_map.environment
        starts = tuple(self.starts)
        if starts == (ALL_STARTS,):
            starts = tuple(environment.starts)
        # A map without starts has a default one.
        return starts or (environment.start().name,)

    def load_controller_class(self, controller: str) -> type[Any]:
        """Return the class of a controller, built from the source text in the study if there is one."""
        return load_controller_class(controller, source=self.sources.get(controller))

    def to_json(self) -> dict[str, Any]:
        """Return the content of ``study.json``, apart from the columns of the table."""
        controllers = [{"name": name, **source_to_json(self.sources.get(name))} for name in self.controllers]
        return {
            "format": "robocov-study",
            "version": 1,
            "runs": len(self),
            "maps": [
                {"name": study_map.name, "map": to_json(study_map.environment)} for study_map in self.maps
            ],
            "controllers": controllers,
            "gains": {name: asdict(self.get_gains(name)) for name in self.controllers},
            "sampling": None if self.sampling is None else asdict(self.sampling),
            "robots": list(self.robots),
            "teams": [dict(team) for team in self.teams],
            "starts": {study_map.name: list(self.list_starts(study_map)) for study_map in self.maps},
            "seeds": list(self.seeds),
            "duration_s": self.duration,
            "dt_s": self.dt,
            "lattice": self.lattice,
            "cost_hz": self.cost_hz,
            "record_hz": self.record_hz,
            "metrics": self.metrics,
        }


def _combine(axes: Mapping[str, Sequence[ParameterValue]]) -> list[dict[str, ParameterValue]]:
    """Return all combinations of values, by the names of the axes; the last axis varies fastest."""
    return [dict(zip(axes, values, strict=True)) for values in product(*axes.values())]
