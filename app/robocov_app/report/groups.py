"""What is compared with what: the runs of a result by controller and gains, by setting, and in pairs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from robocov.arrays import Array
from robocov.controllers.gains import value_text
from robocov_app.statistics import Paired, paired
from robocov_app.sweep.circumstances import circumstance_text

if TYPE_CHECKING:
    from robocov.controllers.gains import Value
    from robocov_app.report.gathering import Entry, Result

MOST_GROUPS = 8
"""Controllers with their gains up to which each is shown apart; of more, each controller as a whole."""

MOST_COMPARED = 4
"""Groups up to which each is compared with each; of more, each with the first."""

LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"

CLUSTERS = 5
"""Maps from which on intervals speak of maps in general: whole maps are drawn then."""


@dataclass(frozen=True, eq=False)
class Group:
    """Runs of one controller: with the same gains, or with all that were tried.

    Attributes
    ----------
    label : str
    controller : str
    gains : tuple of (name, value), or None
        None where they differ.
    entries : tuple of Entry
        Those that did not fail, in the result's order.
    """

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


@dataclass(frozen=True)
class Comparison:
    """Two groups, case by case.

    Attributes
    ----------
    first, second : Group
    cases : tuple
        What the pairs share, in the result's order.
    a, b : (m,) m
        Mean distances at the end.
    paired : Paired
    by_map : bool
        Whether intervals draw whole maps.
    """

    first: Group
    second: Group
    cases: tuple[tuple[object, ...], ...]
    a: Array
    b: Array
    paired: Paired
    by_map: bool


def variants(result: Result) -> list[Group]:
    """Return the runs that did not fail by controller and gains, lettered where a controller has several."""
    found: dict[tuple[object, ...], list[Entry]] = {}
    for entry in result.fine:
        found.setdefault((entry.controller, entry.gains), []).append(entry)
    sizes: dict[str, int] = {}
    for entries in found.values():
        sizes[entries[0].controller] = sizes.get(entries[0].controller, 0) + 1
    numbers: dict[str, int] = {}
    groups = []
    for entries in found.values():
        head = entries[0]
        number = numbers.get(head.controller, 0)
        numbers[head.controller] = number + 1
        label = head.label if sizes[head.controller] == 1 else f"{head.label} {_letters(number)}"
        groups.append(Group(label, head.controller, head.gains, tuple(entries)))
    return groups


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


def compared_groups(result: Result) -> list[Group]:
    """Return the groups that are compared in pairs: `variants`, or of each controller the best of them."""
    apart = variants(result)
    if len(apart) <= MOST_COMPARED:
        return apart
    best: dict[str, Group] = {}
    scales = medians(result)
    for group in apart:
        kept = best.get(group.controller)
        if kept is None or _standing(group, scales) < _standing(kept, scales):
            best[group.controller] = group
    return list(best.values())


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
        parts.append(f"{parameter.replace('_', ' ')} {circumstance_text(parameter, value)}")
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


def comparisons(result: Result) -> list[Comparison]:
    """Return how groups compare on the same cases: each with each, or many with the first."""
    groups = compared_groups(result)
    firsts = groups if len(groups) <= MOST_COMPARED else groups[:1]
    found = []
    for k, first in enumerate(firsts):
        for second in groups[k + 1 :]:
            comparison = compared(first, second)
            if comparison is not None:
                found.append(comparison)
    return found


def compared(first: Group, second: Group) -> Comparison | None:
    """Return how two groups compare on the cases that both have, None where they have none."""
    a, b = _by_case(first), _by_case(second)
    cases = tuple(case for case in a if case in b)
    if not cases:
        return None
    left, right = np.array([a[case] for case in cases]), np.array([b[case] for case in cases])
    maps = [case[0] for case in cases]
    by_map = len(set(maps)) >= CLUSTERS
    return Comparison(
        first, second, cases, left, right, paired(left, right, maps if by_map else None), by_map
    )


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


def _by_case(group: Group) -> dict[tuple[object, ...], float]:
    return {
        entry.case: entry.final for entry in group.entries if np.isfinite(entry.final) and entry.final > 0
    }


def _standing(group: Group, scales: Mapping[tuple[object, ...], float]) -> float:
    values = relative(group, scales)
    return float(np.median(values)) if len(values) else float("inf")


def _letters(number: int) -> str:
    """Return A, B, ..., Z, A2, B2, ..."""
    turn, place = divmod(number, len(LETTERS))
    return LETTERS[place] + (str(turn + 1) if turn else "")
