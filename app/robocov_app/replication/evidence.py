"""Tables of what every contender reached, side by side, and what is said of each controller."""

import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np

from robocov.controllers import get_gain_values, get_information, load_controller_class, make_controller
from robocov.controllers.gains import format_value
from robocov_app.figures.statistics import Interval, bootstrap, group_by, median_time
from robocov_app.replication.claims import amount, capitalised, share_above_zero
from robocov_app.replication.contenders import ASSETS, OWN, Contender
from robocov_app.replication.outcomes import Comparison, GainOutcomes, Outcomes
from robocov_app.replication.results import IDEAL, BeyondResults, Degradation
from robocov_app.replication.studies import AXES, WORSE

WORST_MAPS = 3  # so many maps are named on which a controller does worst
MEDIANS = ("final", "over_run", "path", "work")  # of a law, in a table
OFTEN = 0.05  # a failure is told of a controller when it happens in more than 5 % of its runs


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
    """Results of one contender over all scenarios."""

    contender: Contender
    runs: int
    gap: Interval  # median of J/J_ref - 1
    quartiles: tuple[float, float]
    touched: float  # share of runs in which a robot touches something
    stuck: float  # that end with a robot stuck; nan where a law has no goals
    settled: float  # that come to rest
    settling: float  # s, median time until they do, by Kaplan and Meier; inf where most do not
    medians: Mapping[str, float]  # of J at the end (final), its mean over_run, a robot's path, m; of work, J


@dataclass(frozen=True)
class Evidence:
    """Evidence on a registered controller."""

    account: Account
    rows: Sequence[LawRow]  # of its contenders; what follows is of the best, the first
    maps: Mapping[str, float]  # median gaps
    duels: Sequence[tuple[str, str, Comparison]]  # labels of one of ours and of a contender
    fails: str  # where it does, in words
    gains: str


@cache
def account_of(controller: str) -> Account:
    """Return what is said of a controller; of one that nothing is known of, its own summary."""
    kind = load_controller_class(controller)
    known = tomllib.loads((ASSETS / "controllers.toml").read_text(encoding="utf-8")).get(controller, {})
    source = known.get("source", "")
    if not known.get("read", True):
        source = source.removesuffix(".") + "; made from what is generally known of it, not from its text."
    does = known.get("does") or f"{capitalised(kind.summary).rstrip('.')}."
    return Account(controller, kind.label, get_information(kind), known.get("short", "–"), source, does)


def law_rows(outcomes: Outcomes, contenders: Iterable[Contender], duration: float) -> list[LawRow]:
    rows = []
    for each in contenders:
        fine = outcomes.measured("gap", each.key)
        if not fine.scenarios:
            continue
        gap, settled = fine.of(each.key, "gap"), fine.of(each.key, "settled")
        low, high = np.quantile(gap, [0.25, 0.75]).tolist()
        rest = settled[np.isfinite(settled)]
        rows.append(
            LawRow(
                each,
                runs=len(gap),
                gap=bootstrap(gap, clusters=fine.maps),
                quartiles=(low, high),
                touched=share_above_zero(fine.of(each.key, "contacts")),
                stuck=share_above_zero(fine.of(each.key, "stuck")),
                settled=len(rest) / len(settled),
                settling=median_time(rest, np.full(len(settled) - len(rest), duration)),
                medians={name: np.median(fine.of(each.key, name)) for name in MEDIANS},
            )
        )
    return rows


def ranked_rows(results: BeyondResults) -> list[LawRow]:
    rows = law_rows(results.outcomes, results.contenders, results.plan.duration)
    return sorted(rows, key=lambda row: row.gap.estimate)


def evidence(results: BeyondResults, rows: Iterable[LawRow]) -> list[Evidence]:
    own = group_by(rows, lambda row: row.contender.controller)
    return [
        Evidence(
            account_of(name),
            each,
            maps=results.outcomes.median_by_map(each[0].contender.key),
            duels=duels(results, each),
            fails=failure_text(results.outcomes, each[0]),
            gains=gains_text(name, results.gains[name]) if name in results.gains else "",
        )
        for name, each in own.items()
    ]


def duels(results: BeyondResults, rows: Sequence[LawRow]) -> list[tuple[str, str, Comparison]]:
    both = [(ours, row.contender) for ours in OWN for row in rows if row.contender.key != ours.key]
    pairs = [(a.label, b.label, results.outcomes.compared(a.key, b.key)) for a, b in both]
    return [(first, second, found) for first, second, found in pairs if found is not None]


def conditions_rows(results: BeyondResults, rows: Iterable[LawRow]) -> dict[str, list[Degradation]]:
    """Return by controller, in the order of `rows`, what it bears: no disturbance, then one of each kind."""
    known = {(each.controller, each.axis, each.value): each for each in results.degradations}
    wanted = (IDEAL, None), *((axis, values[WORSE]) for axis, values in AXES.items())
    names = dict.fromkeys(row.contender.controller for row in rows)
    return {name: [known[name, *at] for at in wanted] for name in names}


def failure_text(outcomes: Outcomes, law: LawRow) -> str:
    key = law.contender.key
    medians = sorted(outcomes.median_by_map(key).items(), key=lambda item: -item[1])[:WORST_MAPS]
    highest = ", ".join(f"{name} {amount(high, '%')}" for name, high in medians)
    gap = outcomes.of(key, "gap")
    worst = int(np.nanargmax(gap))
    words = f"Highest medians: {highest}. Worst run: {amount(gap[worst], '%')} above the reference"
    troubles = "; ".join(
        f"{words} in {amount(share, '%')} of the runs"
        for share, words in (
            (law.touched, "robots touch a wall or each other"),
            (law.stuck, "a robot is stuck away from its goal"),
            (1.0 - law.settled, "the team is not at rest at the end"),
        )
        if share > OFTEN
    )
    if not troubles and law.touched == 0.0:
        troubles = "No contact in any run"
    words = f"{words} ({outcomes.scenarios[worst]})."
    return f"{words} {capitalised(troubles)}." if troubles else words


def gains_text(controller: str, grid: GainOutcomes) -> str:
    grid = grid.complete
    if not grid.scenarios:
        return "Gains: its defaults; in every scenario of the tuning some run failed."
    best, worst = grid.best(), int(np.argmax(grid.excess.mean(axis=1)))
    varied = [name for name in grid.gains[best] if len({gains[name] for gains in grid.gains}) > 1]
    values = ", ".join(f"{name} {format_value(grid.gains[best][name])}" for name in varied)
    usual = dict(get_gain_values(make_controller(controller)))
    own = next((k for k, gains in enumerate(grid.gains) if dict(gains) == usual), None)
    means = [amount(mean) for mean in grid.excess.mean(axis=1)]

    def ratio(row: int) -> str:
        return f"median ratio {amount(float(np.median(grid.excess[best] / grid.excess[row])))}"

    words = (
        f"Gains: {values}{', as by default' if own == best else ''}: of {len(grid.gains)} sets the best on "
        f"{len(set(grid.maps))} maps of the tuning, mean J/J_ref {means[best]}"
    )
    if own is not None and own != best:
        words += f"; with its defaults {means[own]}, {ratio(own)}"
    return f"{words}; with the worst set {means[worst]}, {ratio(worst)}."
