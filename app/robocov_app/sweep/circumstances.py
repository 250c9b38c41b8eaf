"""What a study varies of the team and of the conditions of a run: names, units, values, columns."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

from robocov.conditions import LIMITS, Conditions, Failure, Join, parsed_entry
from robocov.conditions import UNITS as CONDITION_UNITS
from robocov.errors import ParameterError, place, shown, unknown_name
from robocov.robots import UNITS as TEAM_UNITS
from robocov_app.sweep.gain_choices import NO_LIMIT, once

TeamValue: TypeAlias = float | str | None
"""A value of what is varied of team and conditions."""

WORDS = ("fail", "join")
"""Conditions that are texts: ``3@20 5@40`` are two failures, in one run."""

CONDITIONS = (*LIMITS, *WORDS)
"""The conditions that a study may sweep."""

GROUPS = "groups"
"""Robots that differ, as JSON: the groups of a team file."""

UNITS = {**TEAM_UNITS, **CONDITION_UNITS, **dict.fromkeys((*WORDS, GROUPS), "")}
"""Units of all that may be varied."""

_KEY_UNITS = {"m": "_m", "kg": "_kg", "m/s": "_m_s", "m/s²": "_m_s2", "N s/m": "_n_s_m"}
_KEY_UNITS |= {"": "", "s": "_s", "Hz": "_hz", "1/s": "_per_s"}
"""Units in the names of columns."""


def circumstance_column(name: str) -> str:
    """Return the name of the column of a parameter of the team, or of a condition.

    >>> circumstance_column("max_speed"), circumstance_column("delay"), circumstance_column("loss")
    ('max_speed_m_s', 'delay_s', 'loss')
    """
    return f"{name}{_KEY_UNITS[UNITS[name]]}"


def circumstance_text(name: str, value: TeamValue) -> str:
    """Return a value with its unit.

    >>> circumstance_text("groups", '[{"count": 2, "max_speed": 0.5}, {"count": 1}]')
    '2 with max speed 0.5 m/s; 1 as the rest'
    >>> circumstance_text("delay", 0.5), circumstance_text("loss", 0.2), circumstance_text("fail", "")
    ('0.5 s', '0.2', 'none')
    """
    if name in WORDS:
        return str(value) or "none"
    if name == GROUPS:
        return "; ".join(map(_group_text, json.loads(str(value))))
    return "no limit" if value is None else f"{value:g} {UNITS[name]}".rstrip()


def _group_text(group: Mapping[str, Any]) -> str:
    own = [
        f"{name.replace('_', ' ')} {value if isinstance(value, str) else f'{value:g}'} {UNITS[name]}"
        for name, value in group.items()
        if name != "count"
    ]
    return f"{group['count']} {'with ' + ', '.join(own) if own else 'as the rest'}"


def condition_axes(given: Mapping[str, Any], robots: Sequence[int]) -> dict[str, list[TeamValue]]:
    """Return the values of each condition that is given.

    `robots`: the sizes of teams. Raises ParameterError on an unknown name, or a value that cannot be used;
    the message begins with its place.
    """
    axes: dict[str, list[TeamValue]] = {}
    for name, values in given.items():
        if name not in CONDITIONS:
            raise ParameterError(f"conditions: {unknown_name('condition', name, CONDITIONS)}")
        several = isinstance(values, Sequence) and not isinstance(values, str)
        path = ("conditions", name)
        axes[name] = [
            _value(name, value, (*path, k) if several else path)
            for k, value in enumerate(values if several else (values,))
        ]
        if not axes[name]:
            raise ParameterError(f"conditions.{name}: none, but at least one value was wanted")
        once(axes[name], path)
    return axes


def conditions_of(circumstances: Mapping[str, TeamValue], seed: int, robots: int) -> Conditions | None:
    """Return the conditions among what a study varies; None where they are ideal.

    Raises ParameterError when they cannot be for so many robots.
    """
    values: dict[str, Any] = {name: circumstances[name] for name in LIMITS if name in circumstances}
    conditions = Conditions(
        **values,
        failures=tuple(parsed_entry(Failure, word) for word in str(circumstances.get("fail", "")).split()),
        joins=tuple(parsed_entry(Join, word) for word in str(circumstances.get("join", "")).split()),
        seed=seed,
    )
    conditions.check_team(robots)
    return None if conditions.ideal else conditions


def _value(name: str, value: object, path: tuple[str | int, ...]) -> TeamValue:
    if name in WORDS:
        if not isinstance(value, str):
            raise ParameterError(f'{place(path)}: {shown(value)}, but a text, as in "3@20", was wanted')
        kind: type[Failure | Join] = Failure if name == "fail" else Join
        try:
            return " ".join(str(parsed_entry(kind, word)) for word in value.split())
        except ParameterError as error:
            raise ParameterError(f"{place(path)}: {error}") from None
    if name == "message_rate" and value in (None, NO_LIMIT):
        return None
    try:
        made = Conditions(**{name: value, **({} if name == "forget_after" else {"forget_after": 1e6})})  # type: ignore[arg-type]
    except ParameterError as error:
        raise ParameterError(f"{place(path)}: {str(error).partition(': ')[2]}") from None
    number: float = getattr(made, name)
    return number
