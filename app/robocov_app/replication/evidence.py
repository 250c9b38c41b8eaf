"""Tables of what every contender reached, side by side, and what is said of each controller."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from robocov.controllers import controller_kind, gain_values, information_of, make_controller
from robocov.controllers.gains import value_text
from robocov_app.figures.statistics import Interval, bootstrap
from robocov_app.replication.beyond_claims import capitalised
from robocov_app.replication.claims import share_above_zero
from robocov_app.replication.contenders import LABELS, OURS, Contender
from robocov_app.replication.outcomes import Comparison, GainOutcomes, Outcomes
from robocov_app.replication.references import Reference
from robocov_app.replication.results import BeyondResults
from robocov_app.replication.step_times import StepTimes
from robocov_app.replication.verdicts import amount

WORST_MAPS = 3
"""So many maps are named on which a controller does worst."""

OFTEN = 0.05
"""A failure is told of a controller when it happens in more than 5 % of its runs."""

ASSETS = Path(__file__).parent / "assets"

_NOT_READ = "; made from what is generally known of it, not from its text."


class Account(NamedTuple):
    """A controller: the `information` it goes by, its source in short and in full, and what it does."""

    controller: str
    label: str
    information: str
    short: str
    source: str
    does: str


@dataclass(frozen=True)
class LawRow:
    """What one contender reached over all scenarios.

    `gap` is the median of J/J_ref - 1. Shares of runs: those in which a robot `touched` something, that end
    with a robot `stuck` (nan where a law has no goals), and that came to rest (`settled`), after a median
    time of `settling` s.
    """

    key: str
    label: str
    runs: int
    gap: Interval
    quartiles: tuple[float, float]
    touched: float
    stuck: float
    settled: float
    settling: float

    @property
    def rest_text(self) -> str:
        """When its teams came to rest, in words."""
        share = f"({amount(self.settled, '%')} of the runs)"
        return f"{self.settling:.0f} s {share}" if np.isfinite(self.settling) else "never"


@dataclass(frozen=True)
class MapRow:
    """One map: its reference, and the median gap of every contender."""

    map: str
    reference: Reference
    gaps: Mapping[str, float]


@dataclass(frozen=True)
class EvidenceRow:
    """One contender in the table; `steps` are times of a step as multiples of RAPF's, by number of robots."""

    law: LawRow
    controller: str
    account: Account
    ours: bool
    steps: Mapping[int, float]


class Duel(NamedTuple):
    """Ours against a contender, pair by pair."""

    ours: str
    other: str
    pairs: Comparison


@dataclass(frozen=True)
class Evidence:
    """What is said of a registered controller: median gaps of its best contender by map, where it fails."""

    best: EvidenceRow
    maps: Mapping[str, float]
    duels: Sequence[Duel]
    fails: str
    gains: str


@cache
def account_of(controller: str) -> Account:
    """Return what is said of a controller; of one that nothing is known of, its own summary."""
    kind = controller_kind(controller)
    known = tomllib.loads((ASSETS / "controllers.toml").read_text(encoding="utf-8")).get(controller, {})
    source = known.get("source", "")
    if not known.get("read", True):
        source = source.removesuffix(".") + _NOT_READ
    does = known.get("does") or f"{capitalised(kind.summary).rstrip('.')}."
    return Account(controller, kind.label, information_of(kind), known.get("short", "–"), source, does)


def law_rows(outcomes: Outcomes, labels: Mapping[str, str] = LABELS) -> list[LawRow]:
    """Return a row for each contender that has runs, with its label."""
    rows = []
    for key, label in labels.items():
        fine = outcomes.measured("gap", key)
        if not fine.scenarios:
            continue
        gap, settled = fine.of(key, "gap"), fine.of(key, "settled")
        low, high = np.quantile(gap, [0.25, 0.75]).tolist()
        rest = settled[np.isfinite(settled)]
        rows.append(
            LawRow(
                key,
                label,
                runs=len(gap),
                gap=bootstrap(gap, clusters=fine.maps),
                quartiles=(low, high),
                touched=share_above_zero(fine.of(key, "contacts")),
                stuck=share_above_zero(fine.of(key, "stuck")),
                settled=len(rest) / len(settled),
                settling=float(np.median(rest)) if len(rest) else np.nan,
            )
        )
    return rows


def map_rows(outcomes: Outcomes, references: Mapping[str, Reference]) -> list[MapRow]:
    """Return a row for each map of the outcomes that has a reference."""
    medians = {law: outcomes.median_by_map(law) for law in LABELS}
    return [
        MapRow(name, references[name], {law: gaps[name] for law, gaps in medians.items() if name in gaps})
        for name in dict.fromkeys(outcomes.maps)
        if name in references
    ]


def evidence_rows(
    outcomes: Outcomes, contenders: Sequence[Contender], steps: Mapping[int, StepTimes]
) -> list[EvidenceRow]:
    """Return a row for each contender that has runs, the one with the least median gap first."""
    names = {each.key: each.controller for each in contenders}
    rows = []
    for law in law_rows(outcomes, {each.key: each.label for each in contenders}):
        name = names[law.key]
        ratios = {robots: times.ratio(name) for robots, times in steps.items()}
        rows.append(EvidenceRow(law, name, account_of(name), name in OURS, ratios))
    return sorted(rows, key=lambda row: row.law.gap.estimate)


def evidence(results: BeyondResults, rows: Iterable[EvidenceRow]) -> list[Evidence]:
    """Return what is said of every controller, in the order in which the rows have its best contender."""
    own: dict[str, list[EvidenceRow]] = {}
    for row in rows:
        own.setdefault(row.controller, []).append(row)
    return [
        Evidence(
            best=each[0],
            maps=results.outcomes.median_by_map(each[0].law.key),
            duels=duels(results, each),
            fails=failure_text(results.outcomes, each[0].law),
            gains=gains_text(name, results.gains[name]) if name in results.gains else "",
        )
        for name, each in own.items()
    ]


def duels(results: BeyondResults, rows: Sequence[EvidenceRow]) -> list[Duel]:
    """Return each of our controllers against these contenders, in the scenarios of both."""
    labels = {each.key: each.label for each in results.contenders}
    found = []
    for ours in OURS:
        for row in rows:
            pairs = None if row.law.key == ours else results.outcomes.compared(ours, row.law.key)
            if pairs is not None:
                found.append(Duel(labels[ours], row.law.label, pairs))
    return found


def failure_text(outcomes: Outcomes, law: LawRow) -> str:
    """Return in words where a contender does worst, and what else goes wrong in its runs."""
    medians = sorted(outcomes.median_by_map(law.key).items(), key=lambda item: -item[1])[:WORST_MAPS]
    parts = ["Highest medians: " + ", ".join(f"{name} {amount(high, '%')}" for name, high in medians) + "."]
    gap = outcomes.of(law.key, "gap")
    if np.isfinite(gap).any():
        k = int(np.nanargmax(gap))
        worst = amount(float(gap[k]), "%")
        parts.append(f"Worst run: {worst} above the reference ({outcomes.scenarios[k]}).")
    troubles = "; ".join(
        f"{words} in {amount(share, '%')} of the runs"
        for share, words in (
            (law.touched, "robots touch a wall or each other"),
            (law.stuck, "a robot is stuck away from its goal"),
            (1.0 - law.settled, "the team is not at rest at the end"),
        )
        if share > OFTEN
    )
    if troubles:
        parts.append(f"{capitalised(troubles)}.")
    elif law.touched == 0.0:
        parts.append("No contact in any run.")
    return " ".join(parts)


def gains_text(controller: str, grid: GainOutcomes) -> str:
    """Return in words which of a baseline's gains are best, and how its defaults and the worst set compare.

    Ratios are medians over the runs, pair by pair, in those scenarios in which no set failed.
    """
    grid = grid.complete
    if not grid.scenarios:
        return "Gains: its defaults; in every scenario of the tuning some run failed."
    best, worst = grid.best(), int(np.argmax(grid.excess.mean(axis=1)))
    varied = [name for name in grid.gains[best] if len({gains[name] for gains in grid.gains}) > 1]
    values = ", ".join(f"{name} {value_text(grid.gains[best][name])}" for name in varied)
    usual = dict(gain_values(make_controller(controller)))
    own = next((k for k, gains in enumerate(grid.gains) if dict(gains) == usual), None)
    as_usual = ", as by default" if own == best else ""
    sets, maps = len(grid.gains), len(set(grid.maps))
    words = (
        f"Gains: {values}{as_usual}: of {sets} sets the best on {maps} maps of the tuning, "
        f"mean J/J_ref {_mean(grid, best)}"
    )
    if own is not None and own != best:
        words += f"; with its defaults {_mean(grid, own)}, median ratio {_ratio(grid, best, own)}"
    return f"{words}; with the worst set {_mean(grid, worst)}, median ratio {_ratio(grid, best, worst)}."


def _mean(grid: GainOutcomes, row: int) -> str:
    return amount(float(grid.excess[row].mean()))


def _ratio(grid: GainOutcomes, first: int, second: int) -> str:
    return amount(float(np.median(grid.excess[first] / grid.excess[second])))
