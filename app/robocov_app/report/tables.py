"""The tables of a report: captions, heads and cells as text."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from operator import itemgetter
from typing import TypeAlias

import numpy as np

from robocov.controllers.gains import format_value
from robocov.errors import format_count
from robocov_app.figures.statistics import group_by
from robocov_app.report import groups as grouped
from robocov_app.report.groups import Comparison, Group, gain_text, ratio_text, setting_label
from robocov_app.report.results import RESTARTS, Entry, Result

NOTHING = "–"  # stands where there is no number
MOST_ROWS = 60  # runs up to which each has a row of its own
MOST_SETS = 200  # sets of gains up to which they are listed
MOST_SETTINGS = 40  # settings up to which the summary is told for each


@dataclass(frozen=True)
class Table:
    """A table whose first column names the rows; `texts` are other columns of words, `notes` stand below."""

    caption: str
    head: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]
    texts: frozenset[int] = frozenset()
    notes: tuple[str, ...] = ()


Column: TypeAlias = tuple[str, Callable[[Sequence[Entry]], str]]  # head, and text of one or several runs


def controllers_table(result: Result) -> Table:
    groups = grouped.shown_groups(result)
    known = {group.controller for group in groups}
    failed = group_by(result.failed, lambda entry: entry.controller).items()
    lost = [Group(own[0].label, name, None, tuple(own[:1])) for name, own in failed if name not in known]
    return _gains_table("Controllers and their gains", [*groups, *lost], result)


def gains_table(result: Result) -> Table | None:
    """Return all sets of gains by letters, None where `controllers_table` has them or they are many."""
    apart = grouped.variants(result)
    if len(apart) == len(grouped.shown_groups(result)) or len(apart) > MOST_SETS:
        return None
    return _gains_table("Sets of gains", apart, result)


def _gains_table(caption: str, groups: Sequence[Group], result: Result) -> Table:
    rows = []
    for group in groups:
        gains = _ranges_text(group, result) if group.gains is None else gain_text(group.gains, result.units)
        rows.append((group.label, group.controller, gains or NOTHING))
    return Table(caption, ("Controller", "Name", "Gains"), rows, frozenset({1, 2}))


def summary_tables(result: Result) -> list[Table]:
    groups, every = grouped.shown_groups(result), grouped.settings(result)
    distance, over_run, *others = _figure_columns(result)

    def above(entries: Sequence[Entry]) -> str:
        return _quartiles([100.0 * gap for entry in entries if np.isfinite(gap := result.gap(entry))], 1)

    gap: list[Column] = [("Above J_ref, %", above)] * bool(result.references)

    def rest(entries: Sequence[Entry]) -> str:
        count = len(_values(entries, "settled_at_s"))
        return f"{count} of {len(entries)}" if len(entries) > 1 else "yes" if count else "no"

    settled: Column = "Settled", rest

    def table(caption: str, columns: Sequence[Column], parts: Sequence[Group], *notes: str) -> Table:
        rows = [(own.label, str(len(own.entries)), *(of(own.entries) for _, of in columns)) for own in parts]
        return Table(caption, ("Controller", "Runs", *(head for head, _ in columns)), rows, notes=notes)

    tables = []
    if len(every) > 1:
        scales = grouped.medians(result)
        name = "Mean distance / median"  # meters of different maps have no common median
        parted: Column = name, lambda own: _quartiles(grouped.relative(own, scales).tolist(), 3)
        note = f"{name}: divided by the median over all runs on the same map with the same team."
        tables.append(table("All maps and teams together", [parted, *gap, settled, *others], groups, note))
    for setting in every if len(every) <= MOST_SETTINGS else ():
        caption = setting_label(result, setting) if len(every) > 1 else "Final figures"
        parts = [part for part in (group.at(setting) for group in groups) if part.entries]
        tables.append(table(caption, [distance, *gap, over_run, settled, *others], parts))
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


def runs_table(result: Result) -> Table | None:
    labels = grouped.labels(result)
    if len(result.fine) > MOST_ROWS or len(result.fine) == len(set(labels.values())):
        return None  # too many, or the summary tells all of them
    columns = _figure_columns(result, unsettled="no")
    rows = []
    for entry in result.fine:
        seed = NOTHING if entry.seed is None else str(entry.seed)
        where = labels[entry], setting_label(result, entry.setting), entry.start or NOTHING, seed
        rows.append((*where, *(text([entry]) for _, text in columns)))
    head = ("Controller", "Map", "Start", "Seed", *(head for head, _ in columns))
    return Table("Every run", head, rows, frozenset({1, 2}))


def _figure_columns(result: Result, unsettled: str = NOTHING) -> list[Column]:
    """Return the columns of figures; the time to come is known where robots are not equally fast."""

    def spread(name: str, decimals: int, nothing: str = NOTHING) -> Callable[[Sequence[Entry]], str]:
        return lambda entries: _quartiles(_values(entries, name), decimals, nothing)

    def count(name: str, several: Callable[[list[float]], str]) -> Callable[[Sequence[Entry]], str]:
        def text(entries: Sequence[Entry]) -> str:
            values = _values(entries, name)
            return NOTHING if not values else f"{values[0]:.0f}" if len(entries) == 1 else several(values)

        return text

    def clearance(entries: Sequence[Entry]) -> str:
        # a minus as wide as a digit; none before nothing but zeros
        number = f"{min(values):.3f}" if (values := _values(entries, "min_clearance_m")) else NOTHING
        return number.replace("-", "\u2212" if number.strip("-0.") else "")

    timed = any(entry.has("mean_time_s") for entry in result.fine)
    return [
        ("Mean distance, m", spread("mean_distance_m", 3)),
        ("Over the run, m", spread("mean_distance_over_run_m", 3)),
        ("Settled at, s", spread("settled_at_s", 1, unsettled)),
        ("Contacts", count("contacts", lambda own: f"{sum(each > 0 for each in own)} of {len(own)}")),
        ("Clearance, m", clearance),
        ("Path, m", spread("path_length_m", 2)),
        ("Stuck robots", count("stuck_robots", lambda own: f"{np.mean(own):.2g} per run")),
        *([("Mean time, s", spread("mean_time_s", 3))] if timed else []),
    ]


def pairs_table(comparisons: Sequence[Comparison]) -> Table:
    rows = []
    for each in comparisons:
        lower = sum(int((own.a < own.b).sum()) for own in each.maps)
        words = each.tally() if each.pairs > 1 else "one pair only"
        labels = each.first.label, each.second.label
        rows.append((*labels, ratio_text(each.ratio), words, f"{lower} of {each.pairs}"))
    head = ("First", "Second", "Ratio", "First is", "First is lower in")
    return Table("Final mean distance of the first by that of the second", head, rows, frozenset({1, 3}))


def map_pairs_tables(comparisons: Sequence[Comparison]) -> list[Table]:
    head = ("Map", "Pairs", "First, m", "Second, m", "Ratio", "First is", "First is lower in")
    tables = []
    for each in comparisons:
        rows = []
        for own in each.maps:
            count, lower = len(own.a), (own.a < own.b).sum()
            means = [f"{np.mean(values):.3f}" for values in (own.a, own.b)]
            ratio = ratio_text(own.ratio)
            rows.append((own.name, str(count), *means, ratio, own.verdict, f"{lower} of {count}"))
        if len(rows) > 1:
            tables.append(Table(each.label, head, rows, frozenset({5})))
    return tables


def failures_table(result: Result) -> Table | None:
    rows: list[tuple[str, ...]] = []
    for entry in result.failed:
        where, gains = setting_label(result, entry.setting), gain_text(entry.gains, result.units)
        rows.append((entry.label, where, f"{entry.start}, {entry.seed}", gains, entry.error or ""))
    # what cannot be read is known by its folder alone
    rows += [(each.folder, *3 * [NOTHING], each.reason) for each in result.damaged]
    if not rows:
        return None
    left = len(rows) - MOST_ROWS
    notes = (f"{format_count(left, 'more run')}.",) if left > 0 else ()
    head = ("Controller or folder", "Map", "Start, seed", "Gains", "Error")
    return Table("Runs that failed or cannot be read", head, rows[:MOST_ROWS], frozenset({1, 2, 3, 4}), notes)


def _values(entries: Sequence[Entry], name: str) -> list[float]:
    return [float(entry.figures[name] or 0.0) for entry in entries if entry.has(name)]


def _quartiles(values: Sequence[float], decimals: int, nothing: str = NOTHING) -> str:
    """Return the median with the quartiles, of a single value the value."""
    if not values:
        return nothing
    low, middle, high = np.percentile(values, [25, 50, 75])
    text = f"{middle:.{decimals}f}"
    return text if len(values) == 1 else f"{text} ({low:.{decimals}f}–{high:.{decimals}f})"


def _ranges_text(group: Group, result: Result) -> str:
    parts = []
    gains = group_by((gain for entry in group.entries for gain in entry.gains), itemgetter(0))
    for name, own in gains.items():
        every = [value for _, value in own]
        numbers = [value for value in every if isinstance(value, int | float)]
        if any(isinstance(value, str) for value in every):
            span = " or ".join(dict.fromkeys(map(format_value, every)))
        elif numbers:
            low, high = min(numbers), max(numbers)
            unit = f" {result.units.get(name, '')}".rstrip()
            span = (f"{low:.6g}" if low == high else f"{low:.4g} to {high:.4g}") + unit
            span += " or none" if len(numbers) < len(every) else ""
        else:
            span = "none"
        parts.append(f"{name} {span}")
    return ", ".join(parts)
