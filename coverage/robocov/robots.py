"""The team: what the robots are and what they can do, one row for each robot; files that say so.

Team files, TOML or JSON, list groups of robots that are alike:

    [[group]]
    count = 2
    max_speed = 1.5

    [[group]]
    count = 4
    max_speed = 0.5
    radius = 0.15
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from numbers import Integral
from pathlib import Path
from typing import Any

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray, freeze
from robocov.errors import (
    InputError,
    ParameterError,
    describe_unknown_name,
    format_count,
    format_path,
    is_number,
    quote,
    quote_json,
    to_floats,
    to_one_line,
)
from robocov.files.strictjson import parse, parse_toml, read_bytes

DEFAULT_RADIUS = 0.1
"""Radius of a robot in metres where nothing else is said."""
LIMITS: dict[str, tuple[float, float, bool]] = {
    # smallest, largest, whether it may be infinite
    "radius": (1e-3, 1e3, False),
    "mass": (1e-6, 1e6, False),
    "max_speed": (1e-6, 1e3, False),
    "max_acceleration": (1e-6, 1e6, False),
    "viscosity": (0.0, 1e6, False),
    "sensing_range": (0.0, 1e5, True),
    "communication_range": (0.0, 1e5, True),
    "track_width": (0.0, 1e3, False),
    "turning_rate": (1e-3, 1e3, False),
}
KINEMATICS = ("point", "unicycle")
"""A point moves in any direction, a unicycle has two driven wheels and has to turn."""
TURNING_RATE = 4.0
"""Largest turning rate of a unicycle in rad/s where nothing else is said."""
TRACK_PER_RADIUS = 1.6
"""Track width of a unicycle by its radius where nothing else is said: the wheels are within the disc."""
_OF_UNICYCLES = {"track_width": 0.0, "turning_rate": TURNING_RATE}
MOST_ROBOTS = 10_000
NO_LIMIT = "null"
"""Stands for a range without limit where there is no null."""
UNITS = dict(zip(LIMITS, ("m", "kg", "m/s", "m/s²", "N s/m", "m", "m", "m", "rad/s"), strict=True))
_KEYS = ["count", "kinematics", *LIMITS]  # of a group
_KEY_UNITS = {"m": "m", "kg": "kg", "m/s": "m_per_s", "m/s²": "m_per_s2", "N s/m": "n_s_per_m"}
_KEY_UNITS["rad/s"] = "rad_per_s"


def json_key(name: str) -> str:
    """Return what a parameter is called in ``run.json``, with its unit."""
    return f"{name}_{_KEY_UNITS[UNITS[name]]}"


def _as_usual() -> Array:
    return np.zeros(0)


@dataclass(frozen=True, slots=True, eq=False)
class Team:
    """Bodies, limits and ranges of n robots, each (n,); a ParameterError on values out of range.

    Attributes
    ----------
    radius, mass : m, kg
        Robots are discs; their mass is the paper's virtual one, 1 there.
    max_speed, max_acceleration : m/s, m/s²
        The kinematic limits, the same for every controller.
    viscosity : N s/m
        nu of equation (28), with the sign that takes energy out.
    sensing_range : m
        How far the range sensor sees obstacles, from the robot's centre.
    communication_range : m
        Two robots are neighbours when both are in range of each other. Infinite: everybody hears everybody.
    track_width : m
        Distance between the two driven wheels of a unicycle, a differential drive; 0, the default, is a point
        robot, which moves in any direction. No wheel is faster than `max_speed`, or changes its speed by more
        than `max_acceleration`; see `robocov.world.steering`.
    turning_rate : rad/s
        The most at which a unicycle turns, 4 by default; wheels may allow less, 2 max_speed / track_width.
    """

    radius: Array
    mass: Array
    max_speed: Array
    max_acceleration: Array
    viscosity: Array
    sensing_range: Array
    communication_range: Array
    track_width: Array = field(default_factory=_as_usual)
    turning_rate: Array = field(default_factory=_as_usual)

    def __post_init__(self) -> None:
        size = np.atleast_1d(np.asarray(self.radius)).shape[0]
        for name, (low, high, infinite) in LIMITS.items():
            values = freeze(
                np.atleast_1d(to_floats(f"team.{name}", getattr(self, name), "a number for each robot"))
            )
            if name in _OF_UNICYCLES and not len(values):
                values = freeze(np.full(size, _OF_UNICYCLES[name]))
            if values.shape != (size,):
                what = f"{values.shape} values, but one for each of {size} robots was wanted"
                raise ParameterError(f"team.{name}: {what}")
            good = (values >= low) & (values <= high) | (infinite & (values == np.inf))
            if not good.all():
                found = f"{quote(float(values[~good][0]))} {UNITS[name]}"
                wanted = f"a number from {low:g} to {high:g}{' or null for no limit' if infinite else ''}"
                raise ParameterError(f"team.{name}: {found}, but {wanted} was wanted")
            object.__setattr__(self, name, values)

    def __reduce__(self) -> tuple[type[Team], tuple[Array, ...]]:
        """Return how to rebuild the team: pickles do not say that its arrays are read-only."""
        return Team, tuple(getattr(self, name) for name in LIMITS)

    @classmethod
    def homogeneous(
        cls,
        n: int,
        *,
        radius: float = DEFAULT_RADIUS,
        mass: float = 1.0,
        max_speed: float = 1.0,
        max_acceleration: float = 2.0,
        viscosity: float = 2.0,
        sensing_range: float = 3.0,
        communication_range: float = np.inf,
        track_width: float = 0.0,
        turning_rate: float = TURNING_RATE,
        kinematics: str | None = None,
    ) -> Team:
        """Return a team of `n` equal robots (the paper's: 1 kg, at most 1 m/s).

        `kinematics`: "unicycle" is a track width of 1.6 radii unless one is given, "point" is none.
        """
        if kinematics not in (None, *KINEMATICS):
            raise ParameterError(f"team.{describe_unknown_name('kinematics', str(kinematics), KINEMATICS)}")
        if kinematics == "unicycle":
            track_width = track_width or TRACK_PER_RADIUS * radius
        elif kinematics == "point":
            track_width = 0.0
        if not is_number(n, Integral) or n < 1:
            raise ParameterError(f"robots: {quote(n)}, but a whole number of at least 1 was wanted")
        limits = radius, mass, max_speed, max_acceleration, viscosity, sensing_range, communication_range
        values = *limits, track_width, turning_rate
        each = zip(LIMITS, values, strict=True)
        return cls(*(np.full(n, to_floats(f"team.{name}", value, "a number")) for name, value in each))

    @classmethod
    def joined(cls, teams: Sequence[Team]) -> Team:
        """Return the robots of several teams as one team, in their order."""
        if not teams:
            raise ParameterError("robots: 0, but a whole number of at least 1 was wanted")
        return cls(*(np.concatenate([getattr(team, name) for team in teams]) for name in LIMITS))

    @property
    def mixed_speeds(self) -> bool:
        """Whether some robots are faster than others, so that the nearest may not be there first."""
        return bool((self.max_speed != self.max_speed[0]).any())

    @property
    def turns(self) -> BoolArray:
        """Mask of the unicycles, which have to turn, (n,) bool."""
        return np.asarray(self.track_width > 0.0)

    def _columns(self) -> list[str]:
        """Return the parameters that say something: a team of points has neither wheels nor turning rate."""
        return [name for name in LIMITS if name not in _OF_UNICYCLES or self.turns.any()]

    def __getitem__(self, robots: slice | IntArray) -> Team:
        """Return some of the robots as a team."""
        return Team(*(getattr(self, name)[robots] for name in LIMITS))

    def __len__(self) -> int:
        return int(self.radius.shape[0])

    def __repr__(self) -> str:
        parts = []
        for name in self._columns():
            unit = UNITS[name]
            values = getattr(self, name)
            low, high = float(values.min()), float(values.max())
            span = f"{low:g}" if low == high else f"{low:g} to {high:g}"
            parts.append(f"{name} {span} {unit}")
        return f"<Team of {format_count(len(self), 'robot')}: {', '.join(parts)}>"

    def to_dict(self) -> dict[str, Any]:
        """Return the team as plain JSON: None is no limit, and a value that all share is written once."""
        plain: dict[str, Any] = {"robots": len(self)}
        for name in self._columns():
            values = [None if np.isinf(x) else float(x) for x in getattr(self, name)]
            plain[json_key(name)] = values[0] if len(set(values)) == 1 else values
        return plain

    @classmethod
    def from_dict(cls, plain: Mapping[str, Any]) -> Team:
        """Return the team that `to_dict` wrote; raise ParameterError, with the key, on anything else."""
        n = plain.get("robots")
        if not is_number(n, int) or not 1 <= n <= MOST_ROBOTS:
            raise _unusable(plain, "robots", f"a whole number from 1 to {MOST_ROBOTS}")
        columns = []
        for name, (low, high, null) in LIMITS.items():
            value = plain.get(json_key(name), _OF_UNICYCLES.get(name, "missing"))
            column = value if isinstance(value, list) else [value] * n
            good = [(null and x is None) or (is_number(x) and low <= x <= high) for x in column]
            if len(good) != n or not all(good):
                wanted = f"a number from {low:g} to {high:g}{' or null' if null else ''}"
                raise _unusable(plain, json_key(name), f"{wanted}, or one for each of {n} robots,")
            columns.append(np.array([np.inf if x is None else x for x in column], dtype=float))
        return cls(*columns)


def _unusable(plain: Mapping[str, Any], key: str, wanted: str) -> ParameterError:
    found = quote_json(plain[key]) if key in plain else "missing"
    return ParameterError(f"team.{key}: {found}, but {wanted} was wanted")


def read_team(path: Path | str, defaults: Mapping[str, float | str | None] | None = None) -> Team:
    """Return the team in a TOML file, or in a JSON file of the same structure if its name ends in .json.

    What a group leaves open is as in `defaults`, then `Team.homogeneous`; None is a range without limit.
    Raises InputError with the file, the key, the value and what was wanted.
    """
    path = Path(path)
    where, content = to_one_line(path), read_bytes(path)
    document = parse(content, where) if path.suffix.lower() == ".json" else parse_toml(content, where)
    if not isinstance(document, dict):
        raise InputError(f"{where}: {quote(document)}, but an object with a list group was wanted")
    for key in document:
        if key != "group":
            raise InputError(f"{where}: {describe_unknown_name('key', key, ['group'])}")
    try:
        return team_of_groups(document.get("group"), ("group",), defaults)
    except InputError as error:
        raise InputError(f"{where}: {error}") from error


def team_of_groups(
    groups: object, path: tuple[str | int, ...], defaults: Mapping[str, float | str | None] | None = None
) -> Team:
    """Return the team of groups as they stand in a file at a path of keys, with which errors begin."""
    if not isinstance(groups, list) or not groups:
        found = "missing" if groups is None else quote(groups)
        raise InputError(
            f"{format_path(path)}: {found}, but at least one table [[{format_path(path)}]] was wanted"
        )
    parts = [_group(group, (*path, k), dict(defaults or {})) for k, group in enumerate(groups)]
    robots = sum(map(len, parts))
    if robots > MOST_ROBOTS:
        raise InputError(f"{format_path(path)}: {robots} robots, but at most {MOST_ROBOTS} were wanted")
    return Team.concatenate(parts)


def _group(group: object, path: tuple[str | int, ...], values: dict[str, Any]) -> Team:
    if not isinstance(group, dict):
        raise InputError(f"{format_path(path)}: {quote(group)}, but a table was wanted")
    for key in group:
        if key not in _KEYS:
            raise InputError(f"{format_path(path)}: {describe_unknown_name('key', str(key), _KEYS)}")
    count = group.get("count")
    if not is_number(count, int) or not 1 <= count <= MOST_ROBOTS:
        found = f"{format_path((*path, 'count'))}: {'missing' if count is None else quote(count)}"
        raise InputError(f"{found}, but a whole number from 1 to {MOST_ROBOTS} was wanted")
    values |= {key: _value(key, group[key], format_path((*path, key))) for key in LIMITS if key in group}
    if "track_width" in group:  # that of the rest is not this one's kind
        values.pop("kinematics", None)
    if (kind := group.get("kinematics")) is not None:
        if kind not in KINEMATICS:
            wanted = " or ".join(KINEMATICS)
            raise InputError(f"{format_path((*path, 'kinematics'))}: {quote(kind)}, but {wanted} was wanted")
        values["kinematics"] = kind
    known: dict[str, Any] = {name: np.inf if value is None else value for name, value in values.items()}
    return Team.homogeneous(count, **known)


def _value(name: str, value: object, where: str) -> float | None:
    if LIMITS[name][2] and value in (None, NO_LIMIT):
        return None
    if not is_number(value):
        raise InputError(f"{where}: {quote(value)}, but a number was wanted")
    try:
        one: dict[str, Any] = {name: float(value)}
        Team.homogeneous(1, **one)
    except ParameterError as error:
        raise InputError(f"{where}: {str(error).partition(': ')[2]}") from None
    return float(value)
