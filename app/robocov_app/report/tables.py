"""The tables of a report: captions, heads and cells as text."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from robocov.controllers.gains import value_text
from robocov.errors import counted
from robocov_app.report.groups import (
    Comparison,
    Group,
    gain_text,
    medians,
    ratio_text,
    relative,
    setting_label,
    settings,
    shown_groups,
    variants,
)
from robocov_app.report.results import RESTARTS

if TYPE_CHECKING:
    from robocov.controllers.gains import Value
    from robocov_app.figures.styles import CurveStyle
    from robocov_app.report.results import Entry, Result

NOTHING = "–"
"""Stands where there is no number."""

MOST_ROWS = 60
"""Runs up to which each has a row of its own."""

MOST_SETS = 200
"""Sets of gains up to which they are listed."""

MOST_SETTINGS = 40
"""Settings up to which the summary is told for each."""


class Cell(NamedTuple):
    """A cell: its text, and the style of the curve that it names."""

    text: str
    style: CurveStyle | None = None


@dataclass(frozen=True)
class Table:
    """A table whose first column names the rows; `texts` are other columns of words, `notes` stand below."""

    caption: str
    head: tuple[str, ...]
    rows: Sequence[tuple[Cell, ...]]
    texts: frozenset[int] = frozenset()
    notes: tuple[str, ...] = ()


def controllers_table(result: Result, styles: dict[str, CurveStyle]) -> Table:
    """Return the controllers with their gains, or between which values these are."""
    groups = shown_groups(result)
    known = {group.controller for group in groups}
    lost: dict[str, Group] = {}
    for entry in result.failed:
        if entry.controller not in known:
            lost.setdefault(entry.controller, Group(entry.label, entry.controller, None, (entry,)))
    return _gains_table("Controllers and their gains", [*groups, *lost.values()], result, styles)


def gains_table(result: Result, styles: dict[str, CurveStyle]) -> Table | None:
    """Return all sets of gains by letters, None where `controllers_table` has them or they are many."""
    apart = variants(result)
    if len(apart) == len(shown_groups(result)) or len(apart) > MOST_SETS:
        return None
    return _gains_table("Sets of gains", apart, result, styles)


def _gains_table(
    caption: str, groups: Sequence[Group], result: Result, styles: dict[str, CurveStyle]
) -> Table:
    rows = []
    for group in groups:
        gains = _ranges_text(group, result) if group.gains is None else gain_text(group.gains, result.units)
        cells = Cell(group.label, styles[group.label]), Cell(group.controller), Cell(gains or NOTHING)
        rows.append(cells)
    return Table(caption, ("Controller", "Name", "Gains"), rows, frozenset({1, 2}))


def summary_tables(result: Result, styles: dict[str, CurveStyle]) -> list[Table]:
    """Return what came of each group, over everything and in each setting."""
    groups = shown_groups(result)
    every = settings(result)
    tables = []
    timed = any(_known(entry, TIME) for entry in result.fine)
    gap = ("Above J_ref, %",) if result.references else ()
    whole = (*_HEAD[:3], *gap, *_HEAD[3:], *(("Mean time, s",) if timed else ()))
    if len(every) > 1:
        scales = medians(result)
        rows = []
        for group in groups:
            row = _summary_row(result, group, styles, timed)
            # metres of different maps have no common median
            parted = Cell(_quartiles(relative(group, scales).tolist(), 3))
            rows.append((*row[:2], parted, *row[3 : 3 + len(gap)], *row[4 + len(gap) :]))
        head = (*whole[:2], "Mean distance / median", *gap, *whole[4 + len(gap) :])
        note = (
            "Mean distance / median: divided by the median over all runs on the same map with the same team."
        )
        tables.append(Table("All maps and teams together", head, rows, notes=(note,)))
    for setting in every if len(every) <= MOST_SETTINGS else ():
        parts = [group.at(setting) for group in groups]
        rows = [_summary_row(result, part, styles, timed) for part in parts if part.entries]
        caption = setting_label(result, setting) if len(every) > 1 else "Final figures"
        tables.append(Table(caption, whole, rows))
    if tables and any(len(group.entries) > 1 for group in groups):
        note = (
            "Of several runs: the median, and quartiles in brackets; contacts: runs in which a robot touched "
            "a wall or another robot; clearance: the smallest gap to a wall in any of them."
        )
        tables[-1] = replace(tables[-1], notes=(note,))
    if tables and result.references:
        note = (
            f"Above J_ref: J/J_ref − 1 of the final mean distance; J_ref is the lowest of {RESTARTS} "
            f"searches for the best placement of the team with the whole map known, on the same lattice."
        )
        tables[0] = replace(tables[0], notes=(*tables[0].notes, note))
    return tables


TIME = "mean_time_s"
"""Known where robots are not equally fast."""

_HEAD = (
    *("Controller", "Runs", "Mean distance, m", "Over the run, m", "Settled", "Settled at, s"),
    *("Contacts", "Clearance, m", "Path, m", "Stuck robots"),
)


def pairs_table(comparisons: Sequence[Comparison], styles: dict[str, CurveStyle]) -> Table:
    """Return how the groups compare over maps, one row a comparison."""
    rows = []
    for each in comparisons:
        lower = sum(int((own.a < own.b).sum()) for own in each.maps)
        names = Cell(each.first.label, styles[each.first.label]), Cell(each.second.label)
        words = each.tally() if each.pairs > 1 else "one pair only"
        rows.append((*names, Cell(ratio_text(each.ratio)), Cell(words), Cell(f"{lower} of {each.pairs}")))
    head = ("First", "Second", "Ratio", "First is", "First is lower in")
    return Table("Final mean distance of the first by that of the second", head, rows, frozenset({1, 3}))


def map_pairs_tables(comparisons: Sequence[Comparison]) -> list[Table]:
    """Return a table for each comparison on several maps, one row a map."""
    head = ("Map", "Pairs", "First, m", "Second, m", "Ratio", "First is", "First is lower in")
    tables = []
    for each in comparisons:
        if len(each.maps) < 2:
            continue
        rows = []
        for own in each.maps:
            means = [Cell(f"{np.mean(values):.3f}") for values in (own.a, own.b)]
            lower = f"{int((own.a < own.b).sum())} of {len(own.a)}"
            how = Cell(ratio_text(own.ratio)), Cell(own.verdict), Cell(lower)
            rows.append((Cell(own.name), Cell(str(len(own.a))), *means, *how))
        tables.append(Table(each.label, head, rows, frozenset({5})))
    return tables


def runs_table(result: Result, styles: dict[str, CurveStyle]) -> Table | None:
    """Return every run in a row of its own, None where they are too many."""
    if len(result.fine) > MOST_ROWS or len(result.fine) == len(variants(result)):
        return None  # too many, or the summary tells all of them
    labels = {entry: group.label for group in variants(result) for entry in group.entries}
    timed = any(_known(entry, TIME) for entry in result.fine)
    rows = []
    for entry in result.fine:
        figures = entry.figures
        rows.append(
            (
                Cell(labels[entry], styles[labels[entry]]),
                Cell(setting_label(result, entry.setting)),
                Cell(entry.start or NOTHING),
                Cell(NOTHING if entry.seed is None else str(entry.seed)),
                Cell(_decimals(figures.get("mean_distance_m"), 3)),
                Cell(_decimals(figures.get("mean_distance_over_run_m"), 3)),
                Cell(_decimals(figures.get("settled_at_s"), 1, "no")),
                Cell(_decimals(figures.get("contacts"), 0)),
                Cell(_decimals(figures.get("min_clearance_m"), 3)),
                Cell(_decimals(figures.get("path_length_m"), 2)),
                Cell(_decimals(figures.get("stuck_robots"), 0)),
                *([Cell(_decimals(figures.get(TIME), 3))] if timed else []),
            )
        )
    head = ("Controller", "Map", "Start", "Seed", *_HEAD[2:4], "Settled at, s", "Contacts", *_HEAD[7:])
    whole = (*head, "Mean time, s") if timed else head
    return Table("Every run", whole, rows, frozenset({1, 2}))


def failures_table(result: Result, styles: dict[str, CurveStyle]) -> Table | None:
    """Return the runs that failed, each with its error, and those that cannot be read; None without any."""
    rows: list[tuple[Cell, ...]] = [
        (
            Cell(entry.label, styles[entry.label]),
            Cell(setting_label(result, entry.setting)),
            Cell(f"{entry.start}, {entry.seed}"),
            Cell(gain_text(entry.gains, result.units)),
            Cell(entry.error or ""),
        )
        for entry in result.failed
    ]
    # what cannot be read is known by its folder alone
    nothing = [Cell(NOTHING)] * 3
    rows += [(Cell(each.folder), *nothing, Cell(each.reason)) for each in result.damaged]
    if not rows:
        return None
    left = len(rows) - MOST_ROWS
    notes = (f"{counted(left, 'more run')}.",) if left > 0 else ()
    head = ("Controller or folder", "Map", "Start, seed", "Gains", "Error")
    return Table("Runs that failed or cannot be read", head, rows[:MOST_ROWS], frozenset({1, 2, 3, 4}), notes)


def _summary_row(
    result: Result, group: Group, styles: dict[str, CurveStyle], timed: bool
) -> tuple[Cell, ...]:
    entries = group.entries
    settled = [e for e in entries if _known(e, "settled_at_s")]
    return (
        Cell(group.label, styles[group.label]),
        Cell(str(len(entries))),
        Cell(_spread(entries, "mean_distance_m", 3)),
        *([Cell(_quartiles(_gaps(result, entries), 1))] if result.references else []),
        Cell(_spread(entries, "mean_distance_over_run_m", 3)),
        Cell(_share(len(settled), len(entries))),
        Cell(_spread(settled, "settled_at_s", 1)),
        Cell(_contacts(entries)),
        Cell(_least(entries, "min_clearance_m")),
        Cell(_spread(entries, "path_length_m", 2)),
        Cell(_stuck(entries)),
        *([Cell(_spread(entries, TIME, 3))] if timed else []),
    )


def _gaps(result: Result, entries: Sequence[Entry]) -> list[float]:
    """Return J / J_ref - 1 of the runs that have it, %."""
    return [100.0 * gap for entry in entries if np.isfinite(gap := result.gap(entry))]


def _known(entry: Entry, name: str) -> bool:
    value = entry.figures.get(name)
    return value is not None and bool(np.isfinite(value))


def _values(entries: Sequence[Entry], name: str) -> list[float]:
    return [float(entry.figures[name] or 0.0) for entry in entries if _known(entry, name)]


def _spread(entries: Sequence[Entry], name: str, decimals: int) -> str:
    return _quartiles(_values(entries, name), decimals)


def _quartiles(values: Sequence[float], decimals: int) -> str:
    """Return the median with the quartiles, of a single value the value."""
    if not values:
        return NOTHING
    low, middle, high = np.percentile(values, [25, 50, 75])
    text = f"{middle:.{decimals}f}"
    return text if len(values) == 1 else f"{text} ({low:.{decimals}f}–{high:.{decimals}f})"


def _least(entries: Sequence[Entry], name: str) -> str:
    values = _values(entries, name)
    return _signed(f"{min(values):.3f}") if values else NOTHING


def _share(count: int, total: int) -> str:
    if total == 1:
        return "yes" if count else "no"
    return f"{count} of {total}"


def _contacts(entries: Sequence[Entry]) -> str:
    values = _values(entries, "contacts")
    if len(entries) == 1:
        return f"{values[0]:.0f}" if values else NOTHING
    return f"{sum(value > 0 for value in values)} of {len(values)}" if values else NOTHING


def _stuck(entries: Sequence[Entry]) -> str:
    values = _values(entries, "stuck_robots")
    if not values:
        return NOTHING
    return f"{values[0]:.0f}" if len(entries) == 1 else f"{np.mean(values):.2g} per run"


def _signed(number: str) -> str:
    """Return a number with a minus that is as wide as a digit, and none before nothing but zeros."""
    return number.replace("-", "\u2212" if number.strip("-0.") else "")


def _decimals(value: Any, decimals: int, nothing: str = NOTHING) -> str:
    return nothing if value is None or not np.isfinite(value) else _signed(f"{value:.{decimals}f}")


def _ranges_text(group: Group, result: Result) -> str:
    """Return between which values the gains of a controller vary."""
    values: dict[str, list[Value]] = {}
    for entry in group.entries:
        for name, value in entry.gains:
            values.setdefault(name, []).append(value)
    parts = []
    for name, every in values.items():
        if any(isinstance(value, str) for value in every):
            parts.append(f"{name} {' or '.join(dict.fromkeys(map(value_text, every)))}")
            continue
        finite = [value for value in every if isinstance(value, int | float)]
        unit = result.units.get(name, "")
        if not finite:
            parts.append(f"{name} none")
        elif min(finite) == max(finite) and len(finite) == len(every):
            parts.append(f"{name} {finite[0]:.6g} {unit}".rstrip())
        else:
            also = " or none" if len(finite) < len(every) else ""
            span = (
                f"{min(finite):.4g} to {max(finite):.4g}" if min(finite) < max(finite) else f"{finite[0]:.6g}"
            )
            parts.append(f"{name} {span} {unit}".rstrip() + also)
    return ", ".join(parts)
