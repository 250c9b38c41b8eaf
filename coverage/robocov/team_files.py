"""Team files, TOML or JSON, which list groups of identical robots.

[[group]]
count = 2
max_speed = 1.5

[[group]]
count = 4
max_speed = 0.5
radius = 0.15
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from robocov.errors import (
    InputError,
    JsonPath,
    ParameterError,
    describe_unknown_name,
    format_path,
    is_number,
    quote,
    to_one_line,
)
from robocov.files.strictjson import parse_json, parse_toml, read_bytes
from robocov.team import KINEMATICS, MAX_ROBOTS, PARAMETERS, Team

TeamDefaults: TypeAlias = Mapping[str, float | str | None]
"""Arguments of `Team.homogeneous` for groups that do not set them; None means an unlimited range."""

_NO_LIMIT = "null"
"""Value for an unlimited range in TOML, which has no null."""
_GROUP_KEYS = ["count", "kinematics", *PARAMETERS]
"""Keys that a group may contain."""


def read_team(path: Path | str, defaults: TeamDefaults | None = None) -> Team:
    """Read a team from a file.

    Parameters
    ----------
    path : Path or str
        A TOML file, or a JSON file of the same structure if its name ends in .json.
    defaults : mapping or None
        Parameters for groups that do not set them. Any other parameter has the default of
        `Team.homogeneous`. None as a value means an unlimited range.

    Returns
    -------
    Team
        The robots of all groups, in the order of the file.

    Raises
    ------
    InputError
        If the file cannot be read or used. The message names the file and the key.

    See Also
    --------
    Team.homogeneous : Build a team of identical robots.
    Team.concatenate : Build one team from several.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import robocov as rc
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder) / "team.toml"
    ...     _ = file.write_text("group = [{count = 2, max_speed = 1.5}, {count = 1}]")
    ...     rc.read_team(file).max_speed
    array([1.5, 1.5, 1. ])
    """
    path = Path(path)
    file_name = to_one_line(path)
    content = read_bytes(path)
    if path.suffix.lower() == ".json":
        document = parse_json(content, file_name)
    else:
        document = parse_toml(content, file_name)
    if not isinstance(document, dict):
        raise InputError(f'{file_name}: expected an object with a list "group", got {quote(document)}')
    for key in document:
        if key != "group":
            raise InputError(f"{file_name}: {describe_unknown_name('key', key, ['group'])}")
    try:
        return build_team(document.get("group"), ("group",), defaults)
    except InputError as error:
        raise InputError(f"{file_name}: {error}") from error


def build_team(groups: object, path: JsonPath, defaults: TeamDefaults | None = None) -> Team:
    """Build a team from the groups in a file.

    Parameters
    ----------
    groups : object
        The value of the key; expected to be a list of tables, one for each group.
    path : tuple of str and int
        Path of the groups in their file; messages begin with it.
    defaults : mapping or None
        See `read_team`.

    Returns
    -------
    Team

    Raises
    ------
    InputError
        If the groups cannot be used.

    Examples
    --------
    >>> groups = [{"count": 1, "max_speed": 0.5}, {"count": 2}]
    >>> build_team(groups, ("group",)).max_speed
    array([0.5, 1. , 1. ])
    """
    if not isinstance(groups, list) or len(groups) == 0:
        got = "nothing" if groups is None else quote(groups)
        raise InputError(
            f"{format_path(path)}: expected at least one table [[{format_path(path)}]], got {got}"
        )
    teams = [_build_group(group, (*path, k), defaults or {}) for k, group in enumerate(groups)]
    robot_count = sum(len(team) for team in teams)
    if robot_count > MAX_ROBOTS:
        raise InputError(f"{format_path(path)}: expected at most {MAX_ROBOTS} robots, got {robot_count}")
    return Team.concatenate(teams)


def _build_group(group: object, path: JsonPath, defaults: TeamDefaults) -> Team:
    """Build the team of one group, whose path is used in messages."""
    if not isinstance(group, dict):
        raise InputError(f"{format_path(path)}: expected a table, got {quote(group)}")
    for key in group:
        if key not in _GROUP_KEYS:
            raise InputError(f"{format_path(path)}: {describe_unknown_name('key', str(key), _GROUP_KEYS)}")
    count = _read_count(group, path)
    values = dict(defaults)
    for name in PARAMETERS:
        if name in group:
            values[name] = _read_value(name, group[name], format_path((*path, name)))
    if "track_width" in group:
        # The kinematics of the defaults would overrule the track width of the group.
        values.pop("kinematics", None)
    kinematics = group.get("kinematics")
    if kinematics is not None:
        if kinematics not in KINEMATICS:
            expected = " or ".join(KINEMATICS)
            raise InputError(
                f"{format_path((*path, 'kinematics'))}: expected {expected}, got {quote(kinematics)}"
            )
        values["kinematics"] = kinematics
    arguments: dict[str, Any] = {name: np.inf if value is None else value for name, value in values.items()}
    return Team.homogeneous(count, **arguments)


def _read_count(group: Mapping[str, object], path: JsonPath) -> int:
    """Return the number of robots of a group."""
    count = group.get("count")
    if not is_number(count, int) or not 1 <= count <= MAX_ROBOTS:
        got = "nothing" if count is None else quote(count)
        raise InputError(
            f"{format_path((*path, 'count'))}: expected a whole number from 1 to {MAX_ROBOTS}, got {got}"
        )
    return int(count)


def _read_value(name: str, value: object, key: str) -> float | None:
    """Return the value of a parameter of a group; None means an unlimited range."""
    if PARAMETERS[name].may_be_infinite and value in (None, _NO_LIMIT):
        return None
    if not is_number(value):
        raise InputError(f"{key}: expected a number, got {quote(value)}")
    parameters: dict[str, Any] = {name: value}
    try:
        Team.homogeneous(1, **parameters)  # Checks the range.
    except ParameterError as error:
        _, _, explanation = str(error).partition(": ")
        raise InputError(f"{key}: {explanation}") from None
    return float(value)
