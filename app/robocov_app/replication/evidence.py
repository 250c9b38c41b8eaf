"""What every controller reached, side by side: the rows of the table, and what is said of each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from robocov_app.replication.accounts import Account, account_of
from robocov_app.replication.beyond_plan import LARGE, OURS, SMALL
from robocov_app.replication.claims import compared
from robocov_app.replication.tables import LawRow, law_rows
from robocov_app.replication.verdicts import amount

if TYPE_CHECKING:
    from robocov_app.figures.statistics import Paired
    from robocov_app.replication.beyond import BeyondMaterial
    from robocov_app.replication.contenders import Contender
    from robocov_app.replication.outcomes import Outcomes
    from robocov_app.replication.steps import StepTimes

WORST_MAPS = 3
"""So many maps are named on which a controller does worst."""

OFTEN = 0.05
"""A failure is told of a controller when it happens in more than 5 % of its runs."""


@dataclass(frozen=True)
class EvidenceRow:
    """One contender in the table.

    Attributes
    ----------
    law : LawRow
    controller : str
    account : Account
    ours : bool
    steps : dict of number of robots to float
        Time of a step as a multiple of RAPF's.
    """

    law: LawRow
    controller: str
    account: Account
    ours: bool
    steps: Mapping[int, float]


@dataclass(frozen=True)
class Duel:
    """Ours against a contender, pair by pair.

    Attributes
    ----------
    ours, other : str
        Labels.
    paired : Paired
        Ratio of final costs, ours by the other's, and share of runs that ours won.
    maps : int
        On which the pairs are.
    """

    ours: str
    other: str
    paired: Paired
    maps: int


@dataclass(frozen=True)
class Evidence:
    """What is said of one registered controller.

    Attributes
    ----------
    account : Account
    ours : bool
    rows : sequence of EvidenceRow
        Its contenders: one for each choice of gains.
    maps : dict of map to float
        Median gap on each map, of its best contender, and
    best : EvidenceRow or None
        that contender.
    duels : sequence of Duel
    fails : str
        Where it does badly, in words.
    """

    account: Account
    ours: bool
    rows: Sequence[EvidenceRow]
    maps: Mapping[str, float]
    best: EvidenceRow | None
    duels: Sequence[Duel]
    fails: str


def evidence_rows(
    outcomes: Outcomes, contenders: Sequence[Contender], steps: Mapping[int, StepTimes]
) -> list[EvidenceRow]:
    """Return a row for each contender that has runs, the one with the least median gap first."""
    labels = {each.key: each.label for each in contenders}
    controllers = {each.key: each.controller for each in contenders}
    rows = []
    for law in law_rows(outcomes, labels, labels):
        name = controllers[law.key]
        ratios = {robots: times.ratio(name) for robots, times in steps.items() if robots in (SMALL, LARGE)}
        rows.append(EvidenceRow(law, name, account_of(name), name in OURS, ratios))
    return sorted(rows, key=lambda row: row.law.gap.estimate)


def evidence(material: BeyondMaterial, rows: Sequence[EvidenceRow]) -> list[Evidence]:
    """Return what is said of every controller, in the order in which the rows have its best contender."""
    found = []
    for name in dict.fromkeys(row.controller for row in rows):
        own = [row for row in rows if row.controller == name]
        found.append(
            Evidence(
                own[0].account,
                own[0].ours,
                own,
                material.outcomes.median_by_map(own[0].law.key),
                own[0],
                duels(material, own),
                fails(material.outcomes, own[0]),
            )
        )
    return found


def duels(material: BeyondMaterial, rows: Sequence[EvidenceRow]) -> list[Duel]:
    """Return each of our controllers against these contenders, in the scenarios of both."""
    labels = {each.key: each.label for each in material.contenders}
    found = []
    for ours in OURS:
        if ours not in labels:
            continue
        for row in rows:
            pairs = None if row.law.key == ours else compared(material.outcomes, ours, row.law.key)
            if pairs is not None:
                paired, fine = pairs
                found.append(Duel(labels[ours], row.law.label, paired, len(set(fine.maps))))
    return found


def fails(outcomes: Outcomes, row: EvidenceRow) -> str:
    """Return in words where a contender does worst, and what else goes wrong in its runs."""
    key = row.law.key
    medians = sorted(outcomes.median_by_map(key).items(), key=lambda item: -item[1])[:WORST_MAPS]
    parts = ["Highest medians: " + ", ".join(f"{name} {amount(high, '%')}" for name, high in medians) + "."]
    gap = outcomes.of(key, "gap")
    if np.isfinite(gap).any():
        k = int(np.nanargmax(gap))
        where = outcomes.scenarios[k]
        parts.append(
            f"Worst run: {amount(float(gap[k]), '%')} above the reference "
            f"({where.map}, start {where.start}, seed {where.seed})."
        )
    touched, stuck, restless = row.law.touched, row.law.stuck, 1.0 - row.law.settled
    troubles = [
        f"{words} in {amount(share, '%')} of the runs"
        for share, words in (
            (touched, "robots touch a wall or each other"),
            (stuck, "a robot is stuck away from its goal"),
            (restless, "the team is not at rest at the end"),
        )
        if share > OFTEN
    ]
    if troubles:
        words = "; ".join(troubles)
        parts.append(f"{words[0].upper()}{words[1:]}.")
    elif touched == 0.0:
        parts.append("No contact in any run.")
    return " ".join(parts)
