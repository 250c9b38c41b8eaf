"""Parameters of robots and conditions that a study may vary: their values, units and table columns."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from functools import partial
from typing import Any, TypeAlias, cast, get_args

from robocov.conditions import PARAMETERS, Conditions, DensityKnowledge, Failure, Join, parse_event
from robocov.conditions import UNITS as CONDITION_UNITS
from robocov.defaults import DEFAULT_TURNING_RATE_RAD_S
from robocov.errors import JsonPath, ParameterError, describe_unknown_name, format_path, quote, require_type
from robocov.team import KINEMATICS, Team
from robocov.team import UNITS as TEAM_UNITS
from robocov.team_files import build_team
from robocov_app.sweep.study.gains import NO_LIMIT
from robocov_app.sweep.study.value_paths import parse_values, validate_at

ParameterValue: TypeAlias = float | str | None
"""Value of a parameter of the team, or of a condition; None means no limit."""
TEAM_PARAMETERS = (
    "radius",
    "max_speed",
    "max_acceleration",
    "viscosity",
    "sensing_range",
    "communication_range",
)
"""Parameters of the robots that a study may vary. Every task contains a value for each."""
KINEMATIC_DEFAULTS = {
    "kinematics": "point",
    "track_width": 0.0,
    "turning_rate": DEFAULT_TURNING_RATE_RAD_S,
}
"""Further parameters of the robots, with their defaults. A task contains only values that differ."""
EVENT_TYPES = {"fail": Failure, "join": Join}
"""Conditions that are given as text, for example ``3@20 5@40`` for two events in the same run."""
CHOICES = {"kinematics": KINEMATICS, "density": get_args(DensityKnowledge)}
"""Parameters whose values are one of several texts, with these texts."""
CONDITIONS = (*PARAMETERS, *EVENT_TYPES, "density")
"""Conditions that a study may vary."""
TEXT_PARAMETERS = (*EVENT_TYPES, *CHOICES)
"""Parameters whose values are text."""
GROUPS = "groups"
"""Parameter for a team of different robots: the groups as in a team file, as JSON text."""
UNITS = {**TEAM_UNITS, **CONDITION_UNITS, **dict.fromkeys((*TEXT_PARAMETERS, GROUPS), "")}
"""Units of the parameters."""
_MAX_NUMBER = 1e300
"""Maximum absolute value of a number; larger integers cannot be converted to floats."""
_NO_LIMIT_VALUES: dict[str, tuple[object, ...]] = {
    "message_rate": (None, NO_LIMIT),
    "bandwidth": (None, NO_LIMIT),
    "sensing_range": (None, NO_LIMIT, math.inf),
    "communication_range": (None, NO_LIMIT, math.inf),
}
"""Values that mean "no limit", for parameters that may be unlimited."""


def name_parameter_column(name: str) -> str:
    """Return the name of a parameter's column, which includes the unit.

    Examples
    --------
    >>> name_parameter_column("max_speed"), name_parameter_column("loss")
    ('max_speed_m_s', 'loss')
    """
    unit = UNITS[name].lower().replace("1/", "per ").replace("²", "2")
    return "_".join([name, *re.findall(r"\w+", unit)])


def format_parameter(name: str, value: ParameterValue) -> str:
    """Format the value of a parameter with its unit.

    Parameters
    ----------
    name : str
        Name of a parameter of the team, or of a condition.
    value : float, str or None
        Its value, as `parse_parameter` returns it.

    Returns
    -------
    str

    Examples
    --------
    >>> format_parameter("groups", '[{"count": 2, "max_speed": 0.5}, {"count": 1}]')
    '2 with max speed 0.5 m/s; 1 as the rest'
    >>> format_parameter("delay", 0.5), format_parameter("loss", 0.2), format_parameter("fail", "")
    ('0.5 s', '0.2', 'none')
    """
    if name in TEXT_PARAMETERS:
        return str(value) or "none"
    if name == GROUPS:
        return "; ".join(_format_group(group) for group in json.loads(str(value)))
    if value is None:
        return "no limit"
    return f"{value:g} {UNITS[name]}".rstrip()


def _format_group(group: Mapping[str, Any]) -> str:
    """Format the number of robots in a group, and the parameters in which they differ from the rest."""
    differences = []
    for name, value in group.items():
        if name != "count":
            text = value if isinstance(value, str) else f"{value:g}"
            unit = f" {UNITS[name]}" if UNITS[name] else ""
            differences.append(f"{name.replace('_', ' ')} {text}{unit}")
    if not differences:
        return f"{group['count']} as the rest"
    return f"{group['count']} with {', '.join(differences)}"


def parse_condition_axes(conditions: Mapping[str, Any]) -> dict[str, list[ParameterValue]]:
    """Parse the values of the conditions that a study varies.

    Parameters
    ----------
    conditions : mapping of str to object
        A value or a list of values by the name of the condition.

    Returns
    -------
    dict of str to list
        Values by the name of the condition.

    Raises
    ------
    ParameterError
        If a condition is unknown or a value is invalid.
    """
    axes: dict[str, list[ParameterValue]] = {}
    for name, given in conditions.items():
        if name not in CONDITIONS:
            raise ParameterError(f"conditions: {describe_unknown_name('condition', name, CONDITIONS)}")
        axes[name] = parse_values(given, ("conditions", name), partial(parse_parameter, name))
    return axes


def parse_parameter(name: str, value: object, path: JsonPath) -> ParameterValue:
    """Parse one value of a parameter of the robots, or of a condition.

    Parameters
    ----------
    name : str
        Name of the parameter or the condition.
    value : object
        The value as given in the study.
    path : tuple of str and int
        Path of the value in the study, for messages.

    Returns
    -------
    float, str or None
        None means no limit.

    Raises
    ------
    ParameterError
        If the value is invalid.
    """
    if name in CHOICES:
        return _parse_choice(name, value, path)
    if name in EVENT_TYPES:
        return _parse_events(name, value, path)
    if value in _NO_LIMIT_VALUES.get(name, ()):
        return None
    if name in PARAMETERS:
        return _parse_condition(name, value, path)
    return _parse_team_number(name, value, path)


def _parse_choice(name: str, value: object, path: JsonPath) -> str:
    """Check that a value is one of the texts in `CHOICES`."""
    if value not in CHOICES[name]:
        expected = " or ".join(CHOICES[name])
        raise ParameterError(f"{format_path(path)}: expected {expected}, got {quote(value)}")
    return str(value)


def _parse_events(name: str, value: object, path: JsonPath) -> str:
    """Parse failures or joins, and return them in a uniform notation."""
    require_type(format_path(path), value, str, 'a string, as in "3@20"')
    try:
        events: list[Failure | Join] = [parse_event(EVENT_TYPES[name], word) for word in str(value).split()]
    except ParameterError as error:
        raise ParameterError(f"{format_path(path)}: {error}") from None
    return " ".join(str(event) for event in events)


def _parse_condition(name: str, value: object, path: JsonPath) -> ParameterValue:
    """Check a number against the range of its condition."""
    # `Conditions` also checks values against each other: robots must not be forgotten before their next
    # message is due. With this value of `forget_after`, any other valid value passes the check.
    values: dict[str, Any] = {"forget_after": 1e6, name: value}
    conditions = validate_at(path, lambda: Conditions(**values))
    parsed: float | None = getattr(conditions, name)
    return parsed


def _parse_team_number(name: str, value: object, path: JsonPath) -> float:
    """Check a number against the range of a parameter of the robots."""
    if isinstance(value, bool) or not isinstance(value, int | float) or abs(value) > _MAX_NUMBER:
        raise ParameterError(f"{format_path(path)}: expected a number, got {quote(value)}")
    number = float(value)
    values: dict[str, Any] = {name: number}
    validate_at(path, lambda: Team.homogeneous(1, **values))
    return number


def build_conditions(parameters: Mapping[str, ParameterValue], seed: int, robots: int) -> Conditions | None:
    """Build the conditions of a run.

    Parameters
    ----------
    parameters : mapping of str to float, str or None
        Values of parameters; only the conditions are used.
    seed : int
        Seed of noise, message loss and failures.
    robots : int
        Number of robots.

    Returns
    -------
    Conditions or None
        None if the conditions are ideal.

    Raises
    ------
    ParameterError
        If an event names a robot that does not exist.
    """
    values: dict[str, Any] = {name: parameters[name] for name in PARAMETERS if name in parameters}
    failures = str(parameters.get("fail", "")).split()
    joins = str(parameters.get("join", "")).split()
    conditions = Conditions(
        **values,
        failures=tuple(parse_event(Failure, text) for text in failures),
        joins=tuple(parse_event(Join, text) for text in joins),
        density=cast(DensityKnowledge, parameters.get("density", "known")),
        seed=seed,
    )
    conditions.check_team(robots)
    if conditions.is_ideal:
        return None
    return conditions


def build_swept_team(robots: int, parameters: Mapping[str, ParameterValue]) -> Team:
    """Build the robots of a run.

    Parameters
    ----------
    robots : int
        Number of robots.
    parameters : mapping of str to float, str or None
        Values of parameters; conditions are ignored.

    Returns
    -------
    Team
        A team of equal robots, unless the parameters define groups.
    """
    values: dict[str, Any] = {}
    for name in TEAM_PARAMETERS:
        value = parameters[name]
        values[name] = math.inf if value is None else value
    for name in KINEMATIC_DEFAULTS:
        if name in parameters:
            values[name] = parameters[name]
    if GROUPS in parameters:
        return build_team(json.loads(str(parameters[GROUPS])), ("team", "group"), values)
    return Team.homogeneous(robots, **values)
