"""The record of a run: all of it as arrays, thinned, saved in one folder and read back through models."""

from __future__ import annotations

import json
import platform
import sys
from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY, dataclass, field, replace
from functools import cache, cached_property
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias

import numpy as np
from pydantic import Field, create_model

from robocov.arrays import Array, BoolArray, IntArray
from robocov.conditions import LIMITS, Conditions, JoinedRobot
from robocov.controllers import Controller, gain_values, short_name
from robocov.controllers.gains import Value
from robocov.drawing import Drawable
from robocov.environment import Environment
from robocov.errors import (
    InputError,
    OutputError,
    ParameterError,
    describe_error,
    format_count,
    quote,
    to_one_line,
)
from robocov.files.array_files import read_arrays
from robocov.files.result_folder import settle
from robocov.files.strictjson import Document, read_document, wanted
from robocov.files.writing import replace_file
from robocov.mapfile import from_json, to_json
from robocov.observation import Decision, Observations, Snapshot
from robocov.observation.neighbours import Neighbours
from robocov.optional_imports import import_optional
from robocov.team import MAX_ROBOTS, Team
from robocov.voronoi import VoronoiPartition, WeightedCells, partition, partition_by_travel_time

_COLUMNS = {
    "positions": ("x_m", "y_m"),
    "velocities": ("vx_m_s", "vy_m_s"),
    "forces": ("fx_N", "fy_N"),
    "goals": ("goal_x_m", "goal_y_m"),
    "obstacle_points": ("obstacle_x_m", "obstacle_y_m"),
    "steering": ("heading_rad", "turning_rate_rad_s"),
}
"""Names of the columns of data frames."""
ARRAYS = ("time", "positions", "velocities", "forces", "goals", "obstacle_points")
TURNING = "steering"  # the array of teams that turn, which others do not have
_LARGEST = {"time": 1e9, "positions": 1e7, "velocities": 1e300, "forces": 1e300, TURNING: 1e9}
"""Largest numbers in the arrays that are finite throughout, s, m, m/s, N, rad and rad/s."""
TIME_ROUNDING_S = 5e-7
"""Difference between times that is taken for rounding: times are sums of control periods."""

Seconds: TypeAlias = Annotated[float, Field(gt=0, le=1e6), wanted("a number above 0 (s)")]
Time: TypeAlias = Annotated[float, Field(ge=0, le=1e9), wanted("a number from 0 (s)")]
Number: TypeAlias = Annotated[int, Field(ge=1, le=MAX_ROBOTS), wanted("the number of a robot, from 1,")]
Key: TypeAlias = Annotated[str, Field(pattern=r"^[1-9]\d{0,8}$"), wanted("the number of a robot")]
Point: TypeAlias = Annotated[list[float], Field(min_length=2, max_length=2), wanted("a point [x, y]")]
Seed: TypeAlias = Annotated[int, Field(ge=0), wanted("a whole number from 0")]


class _Failure(Document):
    robot: Number
    time_s: Time


class _Join(_Failure):
    place_m: Point | None


def _number(low: float, high: float, *, null: bool) -> Any:
    """Return what a field of a model is for a number in a range, or null."""
    words = wanted(f"a number from {low:g} to {high:g}{' or null' if null else ''}")
    number: Any = Annotated[float, Field(ge=low, le=high)]
    return Annotated[number | None if null else number, words], ...


_of_conditions: dict[str, Any] = {
    key: _number(low, high, null=name == "message_rate") for name, (low, high, _, key) in LIMITS.items()
} | {"failures": (list[_Failure], ...), "joins": (list[_Join], ...), "seed": (Seed, ...)}
_Conditions: Any = create_model("_Conditions", __base__=Document, **_of_conditions)


class _Controller(Document):
    name: Annotated[str, Field(min_length=1), wanted("a name")]
    gains: dict[str, Annotated[float | str | bool | None, wanted("a number, a word or null")]]


class _Touch(Document):
    """From when to when which robots were moved by hand."""

    from_s: Time
    to_s: Time
    robots: list[Number]


class _Placement(Document):
    """Which robots were put to another place by hand, and when they were there."""

    time_s: Time
    robots: list[Number]


class _Event(Document):
    """A robot that joined, where it did and where it was to."""

    kind: Literal["join"]
    robot: Number
    time_s: Time
    place_m: Point
    requested_m: Point


class _Session(Document):
    """See `robocov_app.viewer.session.kept`."""

    began_at_s: Time = 0.0
    start_velocities_m_per_s: list[Point] = Field([])
    robots: list[Number] = Field([])
    failed: dict[Key, Point] = Field({})
    touched: list[_Touch] = Field([])
    placed: list[_Placement] = Field([])
    control_dt_s: Seconds = 1.0
    repeatable: bool = True


class RunDocument(Document):
    """A run: all that is needed to repeat it, and its summary."""

    map: dict[str, Any]
    controller: _Controller
    team: dict[str, Any]
    start: Annotated[str | None, wanted("the name of a start, or null,")]
    starts_m: list[Point] = Field([])
    seed: Annotated[Seed | None, wanted("a whole number from 0, or null,")]
    dt_s: Seconds
    duration_s: Time = 0.0
    lattice: Annotated[int | None, Field(ge=2, le=2048), wanted("a whole number from 2 to 2048")] = None
    conditions: _Conditions | None = None
    events: list[_Event] = Field([])
    session: _Session = _Session()
    versions: dict[str, str] = Field({})
    summary: dict[str, Any] = Field({})


@dataclass(frozen=True, eq=False)
class Record(Drawable):
    """A whole run.

    Attributes
    ----------
    controller, label : str
        Its name, as `make_controller` takes it, and as shown to people.
    start, seed : str or None, int or None
        Where the starts came from.
    dt : float, s
        The control period, and between moments of a record that was not thinned.
    time : (T,) s
    positions, velocities : (T, n, 2) m, m/s
    forces : (T, n, 2) N
        The controller's force at that state, before any limit, viscosity apart.
    goals, obstacle_points : (T, n, 2) m
        nan where none; the nearest obstacle point that each robot sensed.
    steering : (T, n, 2) rad, rad/s
        Heading, from +x, and turning rate of unicycles; None in a team of points.
    session : dict
        Where a run comes from that is a part of a session in the window.
    joined : tuple of JoinedRobot
        The robots that joined during the run, and where.
    """

    _drawn_as = "record"

    environment: Environment
    team: Team
    controller: str
    label: str
    gains: Mapping[str, Value]
    start: str | None
    seed: int | None
    dt: float
    time: Array
    positions: Array
    velocities: Array
    forces: Array
    goals: Array
    obstacle_points: Array
    session: Mapping[str, Any] = field(default_factory=dict)
    conditions: Conditions | None = None  # ideal ones
    steering: Array | None = None
    joined: tuple[JoinedRobot, ...] = ()

    @cached_property
    def working(self) -> BoolArray:
        """Mask of robots present and not failed, (T, n) bool; read-only."""
        return self._of_robots(Conditions.find_working)

    @cached_property
    def present(self) -> BoolArray:
        """Mask of robots present, failed ones included, (T, n) bool; read-only."""
        return self._of_robots(Conditions.find_present)

    @cached_property
    def travelled(self) -> BoolArray:
        """Mask of the displacements that are travel, (T - 1, n) bool; read-only.

        Between two moments a robot that is not there yet, or that was put elsewhere by hand, does not travel.
        """
        mask = self.present[:-1].copy()
        numbers = self.session.get("robots") or range(1, len(self.team) + 1)
        row_of = {number: row for row, number in enumerate(numbers)}
        for placed in self.session.get("placed", ()):
            # half a microsecond forgives the rounding of sums of steps
            after = int(np.searchsorted(self.time, placed["time_s"] - 5e-7))
            rows = [row_of[number] for number in placed["robots"] if number in row_of]
            if 0 < after < len(self.time):
                mask[after - 1, rows] = False
        mask.setflags(write=False)
        return mask

    @property
    def arrays(self) -> tuple[str, ...]:
        """The names of the arrays that it has."""
        return ARRAYS if self.steering is None else (*ARRAYS, TURNING)

    def _of_robots(self, which: Callable[[Conditions, Array, int], BoolArray]) -> BoolArray:
        there = np.ones(self.positions.shape[:2], dtype=bool)
        if self.conditions is not None:
            there = which(self.conditions, self.time, len(self.team))
        there.setflags(write=False)
        return there

    def __len__(self) -> int:
        return len(self.time)

    def __repr__(self) -> str:
        robots = format_count(len(self.team), "robot")
        return f"<Record {self.controller} on {self.environment.name}, {robots}, {self.time[-1]:.1f} s>"

    @property
    def by_time(self) -> bool:
        """Whether the law divided the region by the time to a place, and that differs from by distance."""
        return self.gains.get("cells") == "time" and self.team.has_mixed_speeds

    def cells(self, k: int = -1) -> VoronoiPartition | WeightedCells:
        """Return the cells of the robots that worked at moment `k`, everybody heard; see `by_time`."""
        working = slice(None) if self.conditions is None else self.working[k]
        positions, environment = self.positions[k][working], self.environment
        if self.by_time:
            speeds = self.team.max_speed[working]
            return partition_by_travel_time(
                positions, speeds, environment.region, density=environment.density
            )
        return partition(positions, environment.region, density=environment.density)

    def snapshot(self, k: int) -> Snapshot:
        """Return moment `k` as far as it was recorded: without force terms and cells."""
        working = None if self.conditions is None else self.working[k]
        neighbours = Neighbours.from_ranges(self.positions[k], self.team.communication_range)
        seen = Observations(
            positions=self.positions[k],
            velocities=self.velocities[k],
            neighbours=neighbours if working is None else neighbours.keep_working(working),
            obstacle_points=self.obstacle_points[k],
            region=self.environment.region,
            time=float(self.time[k]),
            max_speeds=self.team.max_speed,
            density=self.environment.density,
            steering=None if self.steering is None else self.steering[k],
        )
        goals = None if np.isnan(self.goals[k]).all() else self.goals[k]
        cells = self.cells(k) if self.by_time else None
        return Snapshot(seen, Decision(forces=self.forces[k], goals=goals, cells=cells), working=working)

    def at(self, time: float) -> Snapshot:
        """Return the moment nearest to `time`, s; raise ParameterError far outside of the run."""
        first, last = float(self.time[0]), float(self.time[-1])
        if not first - self.dt <= time <= last + self.dt:
            wanted = f"a number from {first:g} to {last:g} s"
            raise ParameterError(f"time: {quote(time)} s, but {wanted} was wanted")
        return self.snapshot(int(np.abs(self.time - time).argmin()))

    def until(self, time: float) -> Record:
        """Return the run up to `time`, s, inclusive; raise ParameterError when that is before it."""
        # half a microsecond forgives the rounding of sums of steps
        if not time >= self.time[0] - 5e-7:
            raise ParameterError(f"time: {quote(time)} s, but a number from {self.time[0]:g} s was wanted")
        return self._only(slice(int(np.searchsorted(self.time, time + 5e-7, side="right"))))

    def thinned(self, rate: float) -> Record:
        """Return the `nearest_moments` at a rate, Hz (0: the ends); raise ParameterError when negative."""
        if not 0.0 <= rate < np.inf:
            raise ParameterError(f"rate: {quote(rate)} Hz, but a finite number from 0 was wanted")
        return self._only(nearest_moments(self.time, rate))

    def _only(self, moments: slice | IntArray) -> Record:
        """Return the record of some of the moments; its arrays are copies."""
        return replace(self, **{name: getattr(self, name)[moments].copy() for name in self.arrays})

    def to_pandas(self) -> Any:
        """Return the run as a tidy data frame, one row for each moment and robot, by time, then robot.

        The columns are time_s, robot (from 0; pictures number robots from 1), x_m, y_m, vx_m_s, vy_m_s, fx_N,
        fy_N, goal_x_m, goal_y_m, obstacle_x_m and obstacle_y_m; of teams that turn also heading_rad and
        turning_rate_rad_s. It needs ``robocov[pandas]``.
        """
        pandas = import_optional("pandas", "pandas")
        moments, robots = self.positions.shape[:2]
        columns: dict[str, Array | IntArray] = {
            "time_s": np.repeat(self.time, robots),
            "robot": np.tile(np.arange(robots), moments),
        }
        for array in self.arrays[1:]:
            names = _COLUMNS[array]
            columns |= {name: getattr(self, array)[:, :, k].ravel() for k, name in enumerate(names)}
        return pandas.DataFrame(columns)

    def to_json(
        self, summary: Mapping[str, Any] | None = None, *, lattice: int | None = None
    ) -> dict[str, Any]:
        """Return the content of ``run.json``; the summary's cost was evaluated on `lattice`."""
        return {
            "format": "robocov-run",
            "version": 1,
            "map": to_json(self.environment),
            "controller": {"name": self.controller, "gains": dict(self.gains)},
            "team": self.team.to_dict(),
            "start": self.start,
            "starts_m": self.positions[0].tolist(),
            "seed": self.seed,
            "dt_s": self.dt,
            "duration_s": float(self.time[-1]),
            "lattice": lattice,
            **({"conditions": self.conditions.to_dict()} if self.conditions else {}),
            **({"events": [_event_json(each) for each in self.joined]} if self.joined else {}),
            **({"session": dict(self.session)} if self.session else {}),
            "versions": dict(versions()),
            "summary": dict(summary or {}),
        }

    def save(
        self, folder: Path | str, summary: Mapping[str, Any] | None = None, *, lattice: int | None = None
    ) -> None:
        """Write ``record.npz`` and ``run.json`` to a folder, each whole or not at all; raise OutputError."""
        folder = Path(folder)
        settle(folder)
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OutputError(f"{folder}: cannot be made: {describe_error(error)}") from error
        with replace_file(folder / "record.npz") as part, part.open("wb") as file:
            # compressing gains 10 % and takes 20 times as long
            np.savez(file, **{name: getattr(self, name) for name in self.arrays})
        with replace_file(folder / "run.json") as part:
            text = json.dumps(self.to_json(summary, lattice=lattice), indent=1, allow_nan=False)
            part.write_text(text + "\n", encoding="utf-8")

    @classmethod
    def load(cls, folder: Path | str) -> Record:
        """Return the record that `save` wrote, its controller only named; raise InputError on others."""
        folder = Path(folder)
        settle(folder)
        for file in ("run.json", "record.npz"):
            if not (folder / file).is_file():
                raise InputError(f"{folder}: not the folder of a run (there is no {file})")
        path = folder / "run.json"
        run = read_document(path, RunDocument, "robocov-run", 1)
        environment = from_json(run.map, f"{path}: map")
        conditions = None
        try:
            team = Team.from_dict(run.team)
            if run.conditions is not None:
                conditions = Conditions.from_dict(run.conditions.model_dump())
                conditions.check_team(len(team))
        except ParameterError as error:
            raise InputError(f"{path}: {error}") from error
        known: dict[str, Any] = {
            "environment": environment,
            "team": team,
            "controller": run.controller.name,
            "label": short_name(run.controller.name),
            "gains": run.controller.gains,
            "start": run.start,
            "seed": run.seed,
            "dt": run.dt_s,
            "session": run.session.model_dump(exclude_unset=True),
            "conditions": conditions,
            "joined": tuple(_joined_from(event) for event in run.events),
        }
        return cls(**known, **_arrays_of(folder / "record.npz", team))


def _event_json(joined: JoinedRobot) -> dict[str, Any]:
    place, requested = list(joined.place), list(joined.requested)
    times = {"kind": "join", "robot": joined.robot, "time_s": joined.time}
    return {**times, "place_m": place, "requested_m": requested}


def _joined_from(event: _Event) -> JoinedRobot:
    place, requested = (event.place_m[0], event.place_m[1]), (event.requested_m[0], event.requested_m[1])
    return JoinedRobot(event.robot, event.time_s, place, requested)


@dataclass(eq=False)
class Recorder:
    """Collects snapshots into a `Record`; raises ParameterError where a gain cannot be recorded.

    `name` is the controller's where it is not its own, as in ``mine.py:MyController``.
    """

    environment: Environment
    team: Team
    controller: Controller
    dt: float
    _: KW_ONLY
    name: str | None = None
    start: str | None = None
    seed: int | None = None
    conditions: Conditions | None = None

    def __post_init__(self) -> None:
        self.name = self.controller.name if self.name is None else self.name
        self._gains = gain_values(getattr(self.controller, "law", self.controller))
        for gain, value in self._gains.items():
            number = isinstance(value, int | float) and abs(value) <= sys.float_info.max
            if not (value is None or isinstance(value, str) or number):
                wanted = "a finite number was wanted, for the record"
                raise ParameterError(f"controller {self.name!r}: {gain}: {quote(value)}, but {wanted}")
        self._moments: list[tuple[float | Array, ...]] = []

    def add(self, snapshot: Snapshot) -> None:
        """Append one moment; its arrays are copied."""
        seen, decision = snapshot.seen, snapshot.decision
        goals = np.full_like(seen.positions, np.nan) if decision.goals is None else decision.goals
        arrays = [snapshot.positions, seen.velocities, decision.forces, goals, seen.obstacle_points]
        arrays += [] if snapshot.steering is None else [snapshot.steering]
        self._moments.append((seen.time, *(array.copy() for array in arrays)))

    def record(self, joined: tuple[JoinedRobot, ...] = ()) -> Record:
        """Return what was collected so far; `joined` are the robots that joined in the simulation."""
        names = (*ARRAYS, TURNING) if self.team.is_unicycle.any() else ARRAYS
        columns = zip(*self._moments, strict=True) if self._moments else [()] * len(names)
        arrays: dict[str, Any] = {name: np.array(rows) for name, rows in zip(names, columns, strict=True)}
        law = str(self.name), to_one_line(self.controller.label), self._gains
        origin = self.start, self.seed, self.dt
        arrays |= {"conditions": self.conditions, "joined": joined}
        return Record(self.environment, self.team, *law, *origin, **arrays)


def nearest_moments(time: Array, rate: float) -> IntArray:
    """Return which times, (T,) s, are nearest (of two, the earlier) to multiples of 1/rate; and the last."""
    last = len(time) - 1
    if float(np.diff(time).min(initial=np.inf)) * rate >= 1.0:
        return np.arange(last + 1)
    turns = (time - time[0]) * rate
    nearest = np.rint(turns)
    # sums of steps are rounded: what is a millionth of a turn nearer is as near
    order = np.lexsort([np.round(np.abs(turns - nearest), 6), nearest])
    first_of_each = np.flatnonzero(np.diff(nearest[order], prepend=-1.0))
    return np.union1d(order[first_of_each], [0, last])


def _arrays_of(path: Path, team: Team) -> dict[str, Any]:
    """Return the arrays of a record of a team, which are checked."""
    robots, names = len(team), (*ARRAYS, TURNING) if team.is_unicycle.any() else ARRAYS
    with path.open("rb") as file:
        saved = read_arrays(file, str(path))
    for name in names:
        if name not in saved:
            raise InputError(f"{path}: there is no array {name}")
        array, moments = saved[name], saved["time"].shape
        wanted = moments if name == "time" else (*moments, robots, 2)
        if array.dtype != np.float64 or array.shape != wanted or len(moments) != 1 or moments == (0,):
            needed = f"{'(T,)' if name == 'time' else wanted} of float64"
            found = f"{name} has shape {array.shape} of {array.dtype}"
            raise InputError(f"{path}: {found}, but {needed} was wanted")
    for name, largest in _LARGEST.items():
        if name not in names:
            continue
        values = saved[name]
        good = np.abs(values) <= largest
        if not good.all():
            found = f"{values[~good][0]:g}, but finite numbers up to {largest:g}"
            raise InputError(f"{path}: {name}: {found} were wanted")
    if (np.diff(saved["time"]) <= 0.0).any():
        raise InputError(f"{path}: time: ascending numbers were wanted")
    return {name: saved[name] for name in names}


@cache
def versions() -> Mapping[str, str]:
    """Return the versions that a result depends on; not to be changed."""
    found = {"python": platform.python_version()}
    for name in ("robocov", "numpy", "scipy", "shapely", "pymunk"):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "unknown"
    return found
