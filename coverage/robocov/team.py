"""The team: the size, limits and ranges of each robot.

Equation numbers refer to Renzaglia and Martinelli, "Distributed Coverage Control for a Multi-Robot Team in a
Non-Convex Environment".
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from robocov.arrays import copy_read_only
from robocov.defaults import (
    DEFAULT_COMMUNICATION_RANGE_M,
    DEFAULT_MASS_KG,
    DEFAULT_MAX_ACCELERATION_M_S2,
    DEFAULT_MAX_SPEED_M_S,
    DEFAULT_RADIUS_M,
    DEFAULT_SENSING_RANGE_M,
    DEFAULT_TRACK_WIDTH_M,
    DEFAULT_TURNING_RATE_RAD_S,
    DEFAULT_VISCOSITY_N_S_M,
)
from robocov.errors import (
    InputError,
    ParameterError,
    describe_unknown_name,
    format_bound,
    format_count,
    is_number,
    quote,
    quote_json,
    require_number,
    to_floats,
)
from robocov.typing import BoolArray, FloatArray, IntArray

MAX_ROBOTS = 10_000
"""Maximum number of robots in a team file or a record, and of those that `Team.homogeneous` builds."""
DEFAULT_TRACK_PER_RADIUS = 1.6
"""Default track width of a unicycle divided by its radius; the wheels are within the disc."""
POINT = "point"
"""Kinematics of a robot that moves in any direction."""
UNICYCLE = "unicycle"
"""Kinematics of a robot with two driven wheels, which has to turn before it can move sideways."""
KINEMATICS = (POINT, UNICYCLE)
"""Names of the kinematics of a robot."""


class TeamParameter(NamedTuple):
    """Range and unit of a parameter of a robot, and its name in files.

    Attributes
    ----------
    minimum, maximum : float
        Range of finite values.
    unit : str
        Unit of the values, as it appears in messages.
    json_key : str
        Name in ``run.json``, with the unit.
    may_be_infinite : bool
        Whether the value may be infinite, which means no limit. JSON contains null instead.
    """

    minimum: float
    maximum: float
    unit: str
    json_key: str
    may_be_infinite: bool = False

    def describe(self, infinity: str = "null for no limit") -> str:
        """Describe the valid values, for messages.

        Parameters
        ----------
        infinity : str
            Description of an infinite value.

        Returns
        -------
        str
        """
        text = f"a number from {format_bound(self.minimum)} to {format_bound(self.maximum)}"
        return f"{text} or {infinity}" if self.may_be_infinite else text

    def require(self, name: str, value: object, error_type: type[InputError] = ParameterError) -> float:
        """Return a finite value as a float, or raise an error unless it is a number in the range.

        Parameters
        ----------
        name : str
            Name of the parameter in the message.
        value : object
            The value to check.
        error_type : type
            Class of the error to raise.

        Returns
        -------
        float

        Raises
        ------
        InputError
            Of type `error_type`, if the value is not a number in the range.
        """
        return require_number(name, value, self.minimum, self.maximum, self.unit, error_type=error_type)


PARAMETERS: dict[str, TeamParameter] = {
    "radius": TeamParameter(1e-3, 1e3, "m", "radius_m"),
    "mass": TeamParameter(1e-6, 1e6, "kg", "mass_kg"),
    "max_speed": TeamParameter(1e-6, 1e3, "m/s", "max_speed_m_per_s"),
    "max_acceleration": TeamParameter(1e-6, 1e6, "m/s²", "max_acceleration_m_per_s2"),
    "viscosity": TeamParameter(0.0, 1e6, "N s/m", "viscosity_n_s_per_m"),
    "sensing_range": TeamParameter(0.0, 1e5, "m", "sensing_range_m", may_be_infinite=True),
    "communication_range": TeamParameter(0.0, 1e5, "m", "communication_range_m", may_be_infinite=True),
    "track_width": TeamParameter(0.0, 1e3, "m", "track_width_m"),
    "turning_rate": TeamParameter(1e-3, 1e3, "rad/s", "turning_rate_rad_per_s"),
}
"""The parameters of a robot, in the order of the fields of `Team`."""
UNITS = {name: parameter.unit for name, parameter in PARAMETERS.items()}
"""Units of the parameters."""

_POINT_ROBOT_VALUES = {"track_width": DEFAULT_TRACK_WIDTH_M, "turning_rate": DEFAULT_TURNING_RATE_RAD_S}
"""Parameters that only unicycles use, with their values for point robots."""

_MISSING = "missing"
"""Used in place of a value that is missing in JSON. Like any text, it is not valid for a parameter."""


def _build_default_column() -> FloatArray:
    """Return an empty array, which `Team.__post_init__` replaces with the default value for each robot."""
    return np.zeros(0)


@dataclass(frozen=True, slots=True, eq=False)
class Team:
    """Sizes, limits and ranges of n robots.

    Every attribute is a read-only array of shape (n,).

    Attributes
    ----------
    radius, mass : m, kg
        Robots are discs. Their mass is the virtual mass of the paper, where it is 1.
    max_speed, max_acceleration : m/s, m/s²
        Kinematic limits, which every controller is subject to.
    viscosity : N s/m
        ν of equation (28), with the sign that dissipates energy.
    sensing_range : m
        Distance from the robot's center up to which the range sensor detects obstacles.
    communication_range : m
        Two robots are neighbors if each is within the range of the other. Infinity: no limit.
    track_width : m
        Distance between the two driven wheels of a unicycle, a differential drive. 0, the default, means
        a point robot, which moves in any direction. Each wheel is limited to `max_speed` and
        `max_acceleration`; see `robocov.world.unicycles`.
    turning_rate : rad/s
        Maximum turning rate of a unicycle, by default 4. The wheels may allow less:
        ``2 max_speed / track_width``.

    Raises
    ------
    ParameterError
        If a value is out of range, or the length of an array differs from that of `radius`.

    See Also
    --------
    read_team : Read a team from a file.
    Conditions : Noise, message loss, and robots that fail or join.

    Notes
    -----
    Robots move by equation (28), m q'' = F - ν q', within `max_speed` and `max_acceleration`. The paper
    prints the viscous term with the other sign, which would add energy.

    Examples
    --------
    >>> import robocov as rc
    >>> team = rc.Team.homogeneous(3, max_speed=0.5)
    >>> team.max_speed
    array([0.5, 0.5, 0.5])
    >>> len(team[:2])
    2
    """

    radius: FloatArray
    mass: FloatArray
    max_speed: FloatArray
    max_acceleration: FloatArray
    viscosity: FloatArray
    sensing_range: FloatArray
    communication_range: FloatArray
    track_width: FloatArray = field(default_factory=_build_default_column)
    turning_rate: FloatArray = field(default_factory=_build_default_column)

    def __post_init__(self) -> None:
        robot_count = np.atleast_1d(np.asarray(self.radius)).shape[0]
        for name in PARAMETERS:
            floats = to_floats(f"team.{name}", getattr(self, name), "a number for each robot")
            values = copy_read_only(np.atleast_1d(floats))
            if name in _POINT_ROBOT_VALUES and len(values) == 0:
                values = copy_read_only(np.full(robot_count, _POINT_ROBOT_VALUES[name]))
            _check_column(name, values, robot_count)
            object.__setattr__(self, name, values)

    def __reduce__(self) -> tuple[type[Team], tuple[FloatArray, ...]]:
        """Rebuild the team when it is unpickled, because pickled arrays lose their read-only flag."""
        return Team, tuple(getattr(self, name) for name in PARAMETERS)

    @classmethod
    def homogeneous(  # noqa: PLR0913 - a keyword for each attribute
        cls,
        n: int,
        *,
        radius: float = DEFAULT_RADIUS_M,
        mass: float = DEFAULT_MASS_KG,
        max_speed: float = DEFAULT_MAX_SPEED_M_S,
        max_acceleration: float = DEFAULT_MAX_ACCELERATION_M_S2,
        viscosity: float = DEFAULT_VISCOSITY_N_S_M,
        sensing_range: float = DEFAULT_SENSING_RANGE_M,
        communication_range: float = DEFAULT_COMMUNICATION_RANGE_M,
        track_width: float = DEFAULT_TRACK_WIDTH_M,
        turning_rate: float = DEFAULT_TURNING_RATE_RAD_S,
        kinematics: str | None = None,
    ) -> Team:
        """Build a team of identical robots, by default those of the paper.

        Parameters
        ----------
        n : int
            Number of robots.
        radius, mass, max_speed, max_acceleration, viscosity, sensing_range, communication_range : float
            See the attributes of `Team`.
        track_width, turning_rate : float, m and rad/s
            See the attributes of `Team`.
        kinematics : {"point", "unicycle"} or None
            "unicycle" sets the track width to 1.6 radii unless it is given, "point" sets it to 0. By default,
            the track width decides.

        Returns
        -------
        Team

        Raises
        ------
        ParameterError
            If a value is not a number, or out of range.
        """
        require_number("robots", n, 1, MAX_ROBOTS, whole=True)
        values: dict[str, float] = {
            "radius": radius,
            "mass": mass,
            "max_speed": max_speed,
            "max_acceleration": max_acceleration,
            "viscosity": viscosity,
            "sensing_range": sensing_range,
            "communication_range": communication_range,
            "track_width": track_width,
            "turning_rate": turning_rate,
        }
        numbers = {name: _to_number(name, value) for name, value in values.items()}
        numbers["track_width"] = _choose_track_width(kinematics, numbers["track_width"], numbers["radius"])
        return cls(**{name: np.full(n, number) for name, number in numbers.items()})

    @classmethod
    def concatenate(cls, teams: Sequence[Team]) -> Team:
        """Build one team from the robots of several, in their order.

        Parameters
        ----------
        teams : sequence of Team
            The teams to join, at least one.

        Returns
        -------
        Team

        Raises
        ------
        ParameterError
            If there are no teams.
        """
        if len(teams) == 0:
            raise ParameterError("robots: expected a whole number of at least 1, got 0")
        return cls(**{name: np.concatenate([getattr(team, name) for team in teams]) for name in PARAMETERS})

    @property
    def has_mixed_speeds(self) -> bool:
        """Whether the robots differ in maximum speed, so that the nearest one may not arrive first."""
        return bool((self.max_speed != self.max_speed[0]).any())

    @property
    def min_radius(self) -> float:
        """Radius of the smallest robot, m."""
        return float(self.radius.min())

    @property
    def is_unicycle(self) -> BoolArray:
        """Mask of the robots that are unicycles and have to turn, (n,) bool."""
        return np.asarray(self.track_width > 0.0)

    def _list_relevant_parameters(self) -> list[str]:
        """Return the parameters that this team uses: point robots have neither wheels nor a turning rate."""
        if self.is_unicycle.any():
            return list(PARAMETERS)
        return [name for name in PARAMETERS if name not in _POINT_ROBOT_VALUES]

    def __getitem__(self, robots: slice | IntArray) -> Team:
        """Return the team of the selected robots."""
        return Team(**{name: getattr(self, name)[robots] for name in PARAMETERS})

    def __len__(self) -> int:
        return int(self.radius.shape[0])

    def __repr__(self) -> str:
        descriptions = []
        for name in self._list_relevant_parameters():
            values = getattr(self, name)
            low = float(values.min())
            high = float(values.max())
            span = f"{low:g}" if low == high else f"{low:g} to {high:g}"
            descriptions.append(f"{name} {span} {UNITS[name]}")
        return f"<Team of {format_count(len(self), 'robot')}: {', '.join(descriptions)}>"

    def to_dict(self) -> dict[str, Any]:
        """Return the team as a JSON object.

        Returns
        -------
        dict
            The number of robots, and for each parameter either a list with a value for each robot, or the
            value that all robots share. An infinite range is None.
        """
        document: dict[str, Any] = {"robots": len(self)}
        for name in self._list_relevant_parameters():
            values = [None if np.isinf(value) else float(value) for value in getattr(self, name)]
            is_shared = len(set(values)) == 1
            document[PARAMETERS[name].json_key] = values[0] if is_shared else values
        return document

    @classmethod
    def from_dict(cls, document: Mapping[str, Any]) -> Team:
        """Build a team from the result of `to_dict`.

        Parameters
        ----------
        document : mapping
            JSON object in the format of `to_dict`.

        Returns
        -------
        Team

        Raises
        ------
        ParameterError
            If a value is missing or out of range. The message names its key.
        """
        robot_count = document.get("robots")
        if not is_number(robot_count, int) or not 1 <= robot_count <= MAX_ROBOTS:
            raise _build_json_error(document, "robots", expected=f"a whole number from 1 to {MAX_ROBOTS}")
        columns = {name: _read_column(document, name, robot_count) for name in PARAMETERS}
        return cls(**columns)


def _to_number(name: str, value: object) -> float:
    """Return the value of a parameter as a float; raise ParameterError if it is not a single number."""
    number = to_floats(f"team.{name}", value, "a number")
    # NumPy converts None to nan.
    if value is None or number.ndim > 0:
        raise ParameterError(f"team.{name}: expected a number, got {quote(value)}")
    return float(number)


def _choose_track_width(kinematics: str | None, track_width: float, radius: float) -> float:
    """Return the track width of robots with the given kinematics, m; None keeps `track_width`."""
    if kinematics not in (None, *KINEMATICS):
        message = describe_unknown_name("kinematics", str(kinematics), KINEMATICS)
        raise ParameterError(f"team.kinematics: {message}")
    if kinematics == POINT:
        return 0.0
    if kinematics == UNICYCLE and track_width == 0.0:
        return DEFAULT_TRACK_PER_RADIUS * radius
    return track_width


def _check_column(name: str, values: FloatArray, robot_count: int) -> None:
    """Raise a ParameterError unless there is one value in range for each robot."""
    if values.shape != (robot_count,):
        expected = f"a value for each of {robot_count} robots"
        raise ParameterError(f"team.{name}: expected {expected}, got shape {quote(values.shape)}")
    parameter = PARAMETERS[name]
    is_valid = (values >= parameter.minimum) & (values <= parameter.maximum)
    if parameter.may_be_infinite:
        is_valid |= values == np.inf
    if not is_valid.all():
        first_wrong = float(values[~is_valid][0])
        raise ParameterError(
            f"team.{name}: expected {parameter.describe()}, got {quote(first_wrong)} {parameter.unit}"
        )


def _read_column(document: Mapping[str, Any], name: str, robot_count: int) -> FloatArray:
    """Return the values of a parameter, (n,). JSON contains a value for each robot, or one for all."""
    parameter = PARAMETERS[name]
    value = document.get(parameter.json_key, _POINT_ROBOT_VALUES.get(name, _MISSING))
    values = value if isinstance(value, list) else [value] * robot_count
    is_valid = len(values) == robot_count and all(_is_valid_json(parameter, entry) for entry in values)
    if not is_valid:
        expected = f"{parameter.describe(infinity='null')}, or one for each of {robot_count} robots"
        raise _build_json_error(document, parameter.json_key, expected)
    return np.array([np.inf if entry is None else entry for entry in values], dtype=float)


def _is_valid_json(parameter: TeamParameter, value: object) -> bool:
    """Return whether a JSON value is valid for a parameter. None, which is null in JSON, means infinity."""
    if value is None:
        return parameter.may_be_infinite
    return is_number(value) and bool(parameter.minimum <= value <= parameter.maximum)


def _build_json_error(document: Mapping[str, Any], key: str, expected: str) -> ParameterError:
    """Return the error for a missing or invalid value of a JSON object."""
    got = quote_json(document[key]) if key in document else "nothing"
    return ParameterError(f"team.{key}: expected {expected}, got {got}")
