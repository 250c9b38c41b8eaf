"""Which runs a page shows as pictures and in the replay: all of few, of many those that tell most."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from robocov_app.report.groups import medians, variants
from robocov_app.report.pairs import contenders

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from robocov_app.report.gathering import Entry, Result
    from robocov_app.report.groups import Group

MOST_RUNS = 50
"""Runs of a result that a page shows as pictures."""


class Choice(NamedTuple):
    """Runs to be shown, in the result's order; how they were chosen; which stand side by side at first."""

    entries: tuple[Entry, ...]
    words: str
    panes: tuple[int, ...]


def chosen(result: Result, most: int = MOST_RUNS, panes: int = 4) -> Choice:
    """Return the runs of a result to be shown.

    All, as long as they are at most `most`. Of more, on every map of each controller the best run and the
    worst, and of one case that is nearest to the middle of all controllers a run of each, so that they can
    be watched from the same starts. Where that is still too much, the same over all maps together.
    """
    fine = result.fine
    if len(fine) <= most:
        return Choice(fine, "All runs.", _side_by_side(result, fine, panes))
    what = (
        "the best and the worst run of each controller by its final mean distance, and the case (start and "
        "seed) that is nearest to the middle for all of them, with the gains that each is compared with"
    )
    maps = list(dict.fromkeys(entry.map for entry in fine))
    found: set[Entry] = set()
    for name in maps:
        found |= _telling(result, [entry for entry in fine if entry.map == name])
    words = f"{{count}} of {len(fine)} runs: on each map {what}."
    if len(found) > most:
        found = _telling(result, fine)
        words = (
            f"{{count}} of {len(fine)} runs: over all maps {what}; distances are divided by the median of "
            f"the same map and team."
        )
    if not found:
        words = f"The first {most} of {len(fine)} runs: none has a final cost."
        return Choice(fine[:most], words, _side_by_side(result, fine[:most], panes))
    entries = tuple(entry for entry in fine if entry in found)[:most]
    return Choice(entries, words.format(count=len(entries)), _side_by_side(result, entries, panes))


def _telling(result: Result, entries: Sequence[Entry]) -> set[Entry]:
    """Return best and worst runs, and those of a middle case."""
    scales = medians(result)
    by: dict[str, list[tuple[float, Entry]]] = {}
    for entry in entries:
        scale = scales.get(entry.setting, 0.0)
        if np.isfinite(entry.final) and scale > 0:
            by.setdefault(entry.controller, []).append((entry.final / scale, entry))
    found = set()
    for ranked in by.values():
        values = [value for value, _ in ranked]
        found |= {ranked[int(np.argmin(values))][1], ranked[int(np.argmax(values))][1]}
    return found | set(_middle_case(_best_variants(result, entries), scales))


def _best_variants(result: Result, entries: Iterable[Entry], few: int = 0) -> list[Group]:
    """Return of each controller the runs with the gains it is compared with, or all variants of few."""
    among = set(entries)
    groups = variants(result)
    if len(groups) > few:
        groups = contenders(result).groups
    return [replace(group, entries=tuple(e for e in group.entries if e in among)) for group in groups]


def _middle_case(groups: Sequence[Group], scales: Mapping[tuple[object, ...], float]) -> tuple[Entry, ...]:
    """Return the runs of the case whose ranks are nearest to the middle, of those that most groups have."""
    ranks: dict[tuple[object, ...], list[float]] = {}
    runs: dict[tuple[object, ...], list[Entry]] = {}
    for group in groups:
        known = [entry for entry in group.entries if np.isfinite(entry.final) and scales[entry.setting] > 0]
        order = sorted(known, key=lambda entry: entry.final / scales[entry.setting])
        for rank, entry in enumerate(order):
            ranks.setdefault(entry.case, []).append(abs(rank - (len(order) - 1) / 2) / len(order))
            runs.setdefault(entry.case, []).append(entry)
    if not ranks:
        return ()
    case = min(ranks, key=lambda each: (-len(ranks[each]), sum(ranks[each])))
    return tuple(runs[case])


def _side_by_side(result: Result, entries: Sequence[Entry], panes: int) -> tuple[int, ...]:
    """Return runs of as many controllers as there are, from the same starts if possible."""
    if not entries:
        return ()
    middle = _middle_case(_best_variants(result, entries, panes), medians(result))
    if not middle:
        return (0,)
    return tuple(entries.index(entry) for entry in middle[:panes])
