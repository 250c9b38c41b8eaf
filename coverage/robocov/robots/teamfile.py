"""Team files, TOML or JSON: groups of robots that are alike.

[[group]]
count = 2
max_speed = 1.5

[[group]]
count = 4
max_speed = 0.5
radius = 0.15
"""

from __future__ import annotations

import tomllib
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from robocov.errors import InputError, ParameterError, is_number, one_line, place, shown, unknown_name
from robocov.files.strictjson import parse, read_bytes
from robocov.robots import Team

if TYPE_CHECKING:
    from collections.abc import Mapping

MOST_ROBOTS = 10_000

NO_LIMIT = "null"
"""Stands for a range without limit where there is no null."""

PARAMETERS = tuple(field.name for field in fields(Team))
"""What a group may say of its robots."""

_RANGES = ("sensing_range", "communication_range")


def read_team(path: Path | str, defaults: Mapping[str, float | None] | None = None) -> Team:
    """Return the team in a TOML file, or in a JSON file of the same structure if its name ends in .json.

    What a group leaves open is as in `defaults`, then `Team.homogeneous`; None is a range without limit.

    Raises
    ------
    InputError
        One line: the file, the key, the value and what was wanted; of unknown keys the nearest known one.
    """
    path = Path(path)
    where = one_line(path)
    content = read_bytes(path)
    if path.suffix.lower() == ".json":
        document = parse(content, where)
    else:
        document = _toml(content, where)
    if not isinstance(document, dict):
        raise InputError(f"{where}: {shown(document)}, but an object with a list group was wanted")
    for key in document:
        if key != "group":
            raise InputError(f"{where}: {unknown_name('key', key, ['group'])}")
    try:
        return team_of_groups(document.get("group"), ("group",), defaults)
    except InputError as error:
        raise InputError(f"{where}: {error}") from error


def team_of_groups(
    groups: object, path: tuple[str | int, ...], defaults: Mapping[str, float | None] | None = None
) -> Team:
    """Return the team of groups as they stand in a file at a path of keys; see `read_team`.

    Raises
    ------
    InputError
        The message begins with the place.
    """
    if not isinstance(groups, list) or not groups:
        found = "missing" if groups is None else shown(groups)
        raise InputError(f"{place(path)}: {found}, but at least one table [[{place(path)}]] was wanted")
    parts = [_group(group, (*path, k), dict(defaults or {})) for k, group in enumerate(groups)]
    if sum(map(len, parts)) > MOST_ROBOTS:
        raise InputError(
            f"{place(path)}: {sum(map(len, parts))} robots, but at most {MOST_ROBOTS} were wanted"
        )
    return Team.joined(parts)


def groups_of(team: Team) -> list[dict[str, Any]]:
    """Return the groups of robots in a row that are alike, as `team_of_groups` takes them."""
    rows = np.column_stack([getattr(team, name) for name in PARAMETERS])
    begin = np.flatnonzero(np.concatenate([[True], (rows[1:] != rows[:-1]).any(axis=1)]))
    count = np.diff([*begin.tolist(), len(rows)])
    return [
        {
            "count": size,
            **{name: NO_LIMIT if np.isinf(x) else x for name, x in zip(PARAMETERS, row, strict=True)},
        }
        for row, size in zip(rows[begin].tolist(), count.tolist(), strict=True)
    ]


def _group(group: object, path: tuple[str | int, ...], values: dict[str, float | None]) -> Team:
    if not isinstance(group, dict):
        raise InputError(f"{place(path)}: {shown(group)}, but a table was wanted")
    for key in group:
        if key not in ("count", *PARAMETERS):
            raise InputError(f"{place(path)}: {unknown_name('key', str(key), ['count', *PARAMETERS])}")
    count = group.get("count")
    if not is_number(count, int) or not 1 <= count <= MOST_ROBOTS:
        found = "missing" if count is None else shown(count)
        wanted = f"a whole number from 1 to {MOST_ROBOTS}"
        raise InputError(f"{place((*path, 'count'))}: {found}, but {wanted} was wanted")
    for key in PARAMETERS:
        if key in group:
            values[key] = _value(key, group[key], (*path, key))
    known = {name: np.inf if value is None else value for name, value in values.items()}
    return Team.homogeneous(count, **known)


def _value(name: str, value: object, path: tuple[str | int, ...]) -> float | None:
    if name in _RANGES and value in (None, NO_LIMIT):
        return None
    if not is_number(value):
        raise InputError(f"{place(path)}: {shown(value)}, but a number was wanted")
    try:
        Team.homogeneous(1, **{name: float(value)})
    except ParameterError as error:
        raise InputError(f"{place(path)}: {str(error).partition(': ')[2]}") from None
    return float(value)


def _toml(content: bytes, where: str) -> dict[str, Any]:
    try:
        return tomllib.loads(content.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        raise InputError(f"{where}: byte at offset {error.start}: not UTF-8, but TOML was wanted") from None
    except ValueError as error:  # of TOML, or of a whole number with thousands of digits
        text = one_line(error)
        raise InputError(f"{where}: not TOML: {text[:1].lower()}{text[1:]}") from None
    except RecursionError:
        raise InputError(f"{where}: nested too deeply") from None
