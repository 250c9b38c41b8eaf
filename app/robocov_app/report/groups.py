"""The runs of a result by controller and gains, and by map and team, with their labels and styles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from robocov.arrays import Array
from robocov.controllers.gains import value_text
from robocov_app.figures.curves import curve_styles, styles_of
from robocov_app.sweep.study import parameter_text

if TYPE_CHECKING:
    from robocov.controllers.gains import Value
    from robocov_app.figures.curves import CurveStyle
    from robocov_app.report.gathering import Entry, Result

MOST_GROUPS = 8
"""Controllers with their gains up to which each is shown apart; of more, each controller as a whole."""

LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"

TUNED = " (tuned)"
"""Stands behind a controller's label where its gains were chosen on other runs than these."""

_DIRECT = 12
"""Letters that a gain and its value may take in a label."""


@dataclass(frozen=True, eq=False)
class Group:
    """Runs of one controller that did not fail: with the same gains, or with all that were tried (None)."""

    label: str
    controller: str
    gains: tuple[tuple[str, Value], ...] | None
    entries: tuple[Entry, ...]

    @cached_property
    def finals(self) -> Array:
        """Mean distances at the end, (m,) m, nan where there is none."""
        return np.array([entry.final for entry in self.entries])

    def at(self, setting: tuple[object, ...]) -> Group:
        """Return the part of the group in one setting."""
        return Group(
            self.label,
            self.controller,
            self.gains,
            tuple(entry for entry in self.entries if entry.setting == setting),
        )


def variants(result: Result) -> list[Group]:
    """Return the runs that did not fail by controller and gains.

    Of a controller with several sets of gains, each is called by the one gain that differs, else by a letter.
    """
    found: dict[str, dict[tuple[tuple[str, Value], ...], list[Entry]]] = {}
    for entry in result.fine:
        found.setdefault(entry.controller, {}).setdefault(entry.gains, []).append(entry)
    groups = {
        (controller, gains): Group(f"{entries[0].label}{suffix}", controller, gains, tuple(entries))
        for controller, sets in found.items()
        for (gains, entries), suffix in zip(sets.items(), _suffixes(list(sets)), strict=True)
    }
    return [groups[key] for key in dict.fromkeys((entry.controller, entry.gains) for entry in result.fine)]


def _suffixes(sets: Sequence[tuple[tuple[str, Value], ...]]) -> list[str]:
    """Return what tells sets of gains of one controller apart."""
    if len(sets) == 1:
        return [""]
    differing = [own for own in zip(*sets, strict=False) if len(set(own)) > 1]
    if len(differing) == 1 and len({name for name, _ in differing[0]}) == 1:
        named = [f" {name} {value_text(value, digits=4)}" for name, value in differing[0]]
        if len(set(named)) == len(sets) and max(map(len, named)) <= _DIRECT:
            return named
    return [f" {_letters(number)}" for number in range(len(sets))]


def styles(result: Result) -> dict[str, CurveStyle]:
    """Return the style of each label: the same for a group in everything that is drawn of a result.

    Groups that are shown apart have a style each; what else there is of a controller has the controller's.
    """
    shown = shown_groups(result)
    there = {group.controller for group in shown}
    lost = dict.fromkeys(each.controller for each in result.entries if each.controller not in there)
    names = [*(group.controller for group in shown), *lost]
    own, apart = curve_styles(names), styles_of(names)
    found = {entry.label + more: own[entry.controller] for entry in result.entries for more in ("", TUNED)}
    found |= {group.label: own[group.controller] for group in variants(result)}
    return found | {group.label: style for group, style in zip(shown, apart, strict=False)}


def by_controller(result: Result) -> list[Group]:
    """Return the runs that did not fail by controller, whatever the gains."""
    found: dict[str, list[Entry]] = {}
    for entry in result.fine:
        found.setdefault(entry.controller, []).append(entry)
    groups = []
    for controller, entries in found.items():
        gains = {entry.gains for entry in entries}
        groups.append(
            Group(entries[0].label, controller, gains.pop() if len(gains) == 1 else None, tuple(entries))
        )
    return groups


def shown_groups(result: Result) -> list[Group]:
    """Return the groups that plots show: `variants`, or `by_controller` where these are too many."""
    apart = variants(result)
    return apart if len(apart) <= MOST_GROUPS else by_controller(result)


def settings(result: Result) -> list[tuple[object, ...]]:
    """Return the settings of all runs that did not fail, in the result's order."""
    return list(dict.fromkeys(entry.setting for entry in result.fine))


def setting_label(result: Result, setting: tuple[object, ...]) -> str:
    """Return what tells a setting from the others of the result: at least its map."""
    every = settings(result)
    name, robots, team = setting
    parts = [str(name)]
    if len({each[1] for each in every}) > 1:
        parts.append(f"{robots} robots")
    assert isinstance(team, tuple)
    for parameter, value in team:
        parts.append(f"{parameter.replace('_', ' ')} {parameter_text(parameter, value)}")
    return ", ".join(parts)


def medians(result: Result) -> dict[tuple[object, ...], float]:
    """Return the median of the final mean distances of all runs in each setting, m."""
    found: dict[tuple[object, ...], list[float]] = {}
    for entry in result.fine:
        if np.isfinite(entry.final):
            found.setdefault(entry.setting, []).append(entry.final)
    return {setting: float(np.median(values)) for setting, values in found.items()}


def relative(group: Group, scales: Mapping[tuple[object, ...], float]) -> Array:
    """Return final mean distances as multiples of their settings' medians, (m,); only the finite ones."""
    values = [
        entry.final / scales[entry.setting]
        for entry in group.entries
        if np.isfinite(entry.final) and scales[entry.setting] > 0
    ]
    return np.array(values)


def dependences(result: Result) -> dict[str, list[str]]:
    """Return the gains that take several values, by name, with the controllers that they vary in."""
    levels: dict[tuple[str, str], set[Value]] = {}
    for entry in result.fine:
        for name, value in entry.gains:
            levels.setdefault((name, entry.controller), set()).add(value)
    found: dict[str, list[str]] = {}
    for (name, controller), values in levels.items():
        if len(values) > 1:
            found.setdefault(name, []).append(controller)
    return found


def gain_text(gains: Sequence[tuple[str, Value]], units: Mapping[str, str]) -> str:
    """Return gains as a line of text.

    >>> gain_text([("k_rep", 0.3), ("attraction_limit", None)], {"k_rep": "N m³"})
    'k_rep 0.3 N m³, attraction_limit none'
    """
    parts = []
    for name, value in gains:
        unit = "" if value is None else units.get(name, "")
        parts.append(f"{name} {value_text(value)} {unit}".rstrip())
    return ", ".join(parts)


def _letters(number: int) -> str:
    """Return A, B, ..., Z, A2, B2, ..."""
    turn, place = divmod(number, len(LETTERS))
    return LETTERS[place] + (str(turn + 1) if turn else "")
