"""What our own controller is measured by: its goals, and how it compares, as claims.

The thresholds stand here; they were set before the controller was written. Its gains were tuned on other
generated maps, but what it reached on those of the study was looked at as well while its rules were made, as
the page says; `unseen_claim` is on maps on which nobody did. A goal speaks of the runs that there are: it is
met or missed by the measured value. Its interval, and with it the verdict of the claim, says whether other
maps might have given something else.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from robocov.arrays import Array, IntArray
from robocov_app.figures.statistics import Interval, bootstrap, bootstrap_by
from robocov_app.replication.accounts import account_of
from robocov_app.replication.beyond_plan import HUGE, IN_CLAIMS, LARGE, OURS
from robocov_app.replication.claims import compared
from robocov_app.replication.contenders import strongest
from robocov_app.replication.verdicts import LEAST_MAPS, Claim, Criterion, amount

if TYPE_CHECKING:
    from robocov_app.replication.contenders import Contender
    from robocov_app.replication.outcomes import Outcomes
    from robocov_app.replication.steps import StepTimes

GOALS, RIVALS, EXTENSIONS = 7, 8, 9
"""Which questions the claims beyond the paper belong to; those of the paper are 1 to 6."""

QUESTIONS = {
    GOALS: "Does our own controller reach its goals?",
    RIVALS: "Is it better than its rivals?",
    EXTENSIONS: "What the paper leaves to others: what difference does it make?",
}

LEAST_GAP = 0.014
"""Goal: the median of J/J_ref - 1, at most. RAPF at its best gains had about 5 % when this was set."""

MAP_GAP = 0.03
"""Goal: the median on every single map, at most."""

NEVER_WORSE = 1.01
"""Goal: its median on a map by that of RAPF or LA on the same map, at most."""

AT_REST = 0.97
"""Goal: the share of its runs that come to rest."""

REST_TIME = 40.0
"""Goal: the median time after which they do, s."""

STEP_RATIO = 10.0
"""Goal: the time of a step of `LARGE` robots by that of RAPF, at most."""

CLOSED = 0.5
"""Most of a gap is closed when more than half of it is."""

_RESAMPLES = 2000


class Goal(NamedTuple):
    """A goal with what became of it.

    Attributes
    ----------
    claim : Claim
        With one criterion.
    met : bool or None
        Whether the measured value reaches it; None where nothing was measured.
    words : str
        That in plain words: "met", "missed: 1.8 % instead of at most 1.4 %".
    """

    claim: Claim
    met: bool | None
    words: str


def goals(
    outcomes: Outcomes,
    ours: Contender,
    contenders: Sequence[Contender],
    steps: Mapping[int, StepTimes],
    duration: float,
) -> list[Goal]:
    """Return the goals of a controller of ours, with what was measured.

    Parameters
    ----------
    outcomes : Outcomes
    ours : Contender
    contenders : sequence of Contender
        All that took part.
    steps : dict of number of robots to StepTimes
    duration : float, s
        Of the runs: who is not at rest by then counts as longer.
    """
    key, label = ours.key, ours.label
    fine = outcomes.among(outcomes.together((key,), "gap"))
    found: list[Goal] = []

    def add(name: str, claim: str, criterion: Criterion, told: str, *, runs: bool = True) -> None:
        count, maps = (len(fine.scenarios), len(set(fine.maps))) if runs else (0, 1)
        least = LEAST_MAPS if runs else 1
        made = Claim(f"goal-{name}", GOALS, claim, (criterion,), count, maps, told, "", least)
        found.append(_judged(made))

    if fine.scenarios:
        gap, maps = fine.of(key, "gap"), fine.maps
        low, high = np.quantile(gap, [0.25, 0.75]).tolist()
        add(
            "gap",
            f"{label}'s cost is within {amount(LEAST_GAP, '%')} of the centralised reference in the median.",
            Criterion("median of J/J_ref - 1", bootstrap(gap, clusters=maps), high=LEAST_GAP, unit="%"),
            f"Half of the runs lie between {amount(low, '%')} and {amount(high, '%')}.",
        )
        medians = fine.median_by_map(key)
        worst = max(medians, key=lambda name: medians[name])
        above = sum(value > MAP_GAP for value in medians.values())
        add(
            "every-map",
            f"On every map {label}'s median is within {amount(MAP_GAP, '%')} of the reference.",
            Criterion("highest median of a map", worst_median(gap, maps), high=MAP_GAP, unit="%"),
            f"Highest on {worst}; above it on {above} of {len(medians)} maps.",
        )
        for other in strongest(contenders):
            pairs = compared(outcomes, key, other.key)
            if pairs is not None:
                add(
                    f"not-worse-{other.key}",
                    f"On no map {label}'s median is more than {amount(NEVER_WORSE - 1.0, '%')} above that of "
                    f"{other.label}.",
                    *_never_worse(pairs[1], key, other),
                )
        touched = (fine.of(key, "contacts") > 0).astype(float)
        add(
            "contacts",
            f"{label} touches nothing.",
            Criterion("runs with a contact", bootstrap(touched, "mean", maps), high=0.0, unit="%"),
            f"{int(touched.sum())} of {len(touched)} runs.",
        )
        settled = fine.of(key, "settled")
        rest = np.isfinite(settled)
        add(
            "rest",
            f"{label} comes to rest in at least {amount(AT_REST, '%')} of the runs.",
            Criterion(
                "runs that come to rest", bootstrap(rest.astype(float), "mean", maps), AT_REST, unit="%"
            ),
            f"{int((~rest).sum())} of {len(rest)} runs do not.",
        )
        times = np.where(rest, settled, duration)
        add(
            "time",
            f"{label} is at rest within {amount(REST_TIME, 's')} in the median.",
            Criterion("median time until rest", bootstrap(times, clusters=maps), high=REST_TIME, unit="s"),
            "Runs that do not come to rest count as the longest.",
        )
    if LARGE in steps and not math.isnan(steps[LARGE].ratio(ours.controller)):
        add(
            "step",
            f"A step of {label} takes at most {STEP_RATIO:g} times as long as RAPF's with {LARGE} robots.",
            Criterion(
                "time of a step by RAPF's", steps[LARGE].ratio_interval(ours.controller), high=STEP_RATIO
            ),
            "Timed in turn, over whole seconds of simulated time: plans and scans count by their share.",
            runs=False,
        )
    if HUGE in steps and not math.isnan(steps[HUGE].ratio(ours.controller)):
        times_ = steps[HUGE]
        share = times_.interval(ours.controller)
        parts = Interval(*(value / times_.dt for value in (share.estimate, share.low, share.high)))
        add(
            "real-time",
            f"{label} runs in real time with {HUGE} robots.",
            Criterion("computing time by simulated time", parts, high=1.0),
            "One process; the physics of the world included.",
            runs=False,
        )
    return found


def unseen_claim(outcomes: Outcomes, ours: Contender, contenders: Sequence[Contender]) -> Claim | None:
    """Return whether the first goals hold on maps that played no part in the development; None without any.

    Parameters
    ----------
    outcomes : Outcomes
        On those maps.
    ours : Contender
    contenders : sequence of Contender
        All that took part there.
    """
    key, label = ours.key, ours.label
    fine = outcomes.among(outcomes.together((key,), "gap"))
    if not fine.scenarios:
        return None
    gap, maps = fine.of(key, "gap"), fine.maps
    touched = (fine.of(key, "contacts") > 0).astype(float)
    rest = np.isfinite(fine.of(key, "settled")).astype(float)
    criteria = [
        Criterion("median of J/J_ref - 1", bootstrap(gap, clusters=maps), high=LEAST_GAP, unit="%"),
        Criterion("runs with a contact", bootstrap(touched, "mean", maps), high=0.0, unit="%"),
        Criterion("runs that come to rest", bootstrap(rest, "mean", maps), AT_REST, unit="%"),
    ]
    for other in strongest(contenders):
        pairs = compared(outcomes, key, other.key)
        if pairs is not None:
            text = f"median of J({label}) / J({other.label}) at the end"
            criteria.append(Criterion(text, pairs[0].ratio, high=1.0))
    medians = fine.median_by_map(key)
    worst = max(medians, key=lambda name: medians[name])
    told = (
        f"{len(medians)} generated maps, {len(gap)} runs of {label}. Highest median of a map: "
        f"{amount(medians[worst], '%')}, on {worst}."
    )
    claim = f"The same holds on maps on which nothing was looked at while {label} was developed."
    return Claim("goal-unseen", GOALS, claim, tuple(criteria), len(gap), len(medians), told)


def rival_claims(outcomes: Outcomes, ours: Contender, contenders: Sequence[Contender]) -> list[Claim]:
    """Return whether one of ours ends at a lower cost than each other contender, and closes RAPF's gap.

    Parameters
    ----------
    outcomes : Outcomes
    ours : Contender
    contenders : sequence of Contender
        All that took part.
    """
    found = []
    papers = strongest(contenders)
    if papers:
        found.append(gap_closed(outcomes, ours, papers[0]))
    rivals = [each for each in contenders if each.controller not in (*IN_CLAIMS, *OURS)]
    for other in (*papers, *rivals):
        pairs = compared(outcomes, ours.key, other.key)
        knows = account_of(other.controller).information
        claim = f"{ours.label} ends at a lower cost than {other.label}"
        claim += "." if knows == "own" else f", which goes by the {knows}."
        name = f"beyond-{ours.key}-{other.key}"
        if pairs is None:
            found.append(Claim(name, RIVALS, claim, (), 0, 0, "There is no run that could tell."))
            continue
        paired, fine = pairs
        ratio = fine.of(ours.key, "final") / fine.of(other.key, "final")
        criteria = (
            Criterion(f"median of J({ours.label}) / J({other.label}) at the end", paired.ratio, high=1.0),
            Criterion(f"runs in which {ours.label}'s is the lower one", paired.wins, 0.5, unit="%"),
        )
        k = int(np.argmax(ratio))
        where = fine.scenarios[k]
        told = (
            f"It loses {int((ratio >= 1.0).sum())} of {len(ratio)}; the highest ratio is "
            f"{amount(float(ratio[k]))} ({where.map}, start {where.start}, seed {where.seed})."
        )
        maps = len(set(fine.maps))
        found.append(Claim(name, RIVALS, claim, criteria, 2 * len(fine.scenarios), maps, told))
    return found


def gap_closed(outcomes: Outcomes, ours: Contender, other: Contender) -> Claim:
    """Test whether ours closes most of another contender's gap to the reference."""
    claim = f"{ours.label} closes most of the gap that {other.label} leaves to the centralised reference."
    name = f"beyond-{ours.key}-closes"
    fine = outcomes.among(outcomes.together((ours.key, other.key), "gap"))
    if not fine.scenarios:
        return Claim(name, RIVALS, claim, (), 0, 0, "There is no run that could tell.")
    own, theirs = fine.of(ours.key, "gap"), fine.of(other.key, "gap")

    def closed(rows: IntArray) -> float:
        left = float(np.median(theirs[rows]))
        return 1.0 - float(np.median(own[rows])) / left if left > 0.0 else float("nan")

    if math.isnan(closed(np.arange(len(own)))):
        return Claim(name, RIVALS, claim, (), 0, 0, f"{other.label} leaves no gap that could be closed.")
    found = bootstrap_by(closed, fine.maps)
    told = (
        f"Medians of J/J_ref - 1 in the same runs: {amount(float(np.median(own)), '%')} and "
        f"{amount(float(np.median(theirs)), '%')}."
    )
    criteria = (Criterion("part of the median gap that is closed", found, CLOSED, unit="%"),)
    maps = len(set(fine.maps))
    return Claim(name, RIVALS, claim, criteria, 2 * len(fine.scenarios), maps, told)


def worst_median(values: Array, maps: Sequence[str]) -> Interval:
    """Return the highest median of a map, with a bootstrap interval that draws runs within each map.

    It speaks of these maps: drawing maps would only leave the worst one out now and then.

    Parameters
    ----------
    values : (m,)
    maps : m names
    """
    return _highest(lambda rows: np.median(values[rows], axis=-1), maps)


def worst_ratio(first: Array, second: Array, maps: Sequence[str]) -> Interval:
    """Return the highest ratio, over the maps, of the medians of two samples of the same runs, (m,) each."""
    return _highest(lambda rows: np.median(first[rows], axis=-1) / np.median(second[rows], axis=-1), maps)


def _highest(statistic: object, maps: Sequence[str]) -> Interval:
    assert callable(statistic)
    rng = np.random.default_rng(0)
    names = np.array(maps)
    estimates, drawn = [], []
    for name in dict.fromkeys(maps):
        rows = np.flatnonzero(names == name)
        estimates.append(float(statistic(rows)))
        drawn.append(statistic(rng.choice(rows, size=(_RESAMPLES, len(rows)))))
    low, high = np.quantile(np.max(drawn, axis=0), [0.025, 0.975])
    return Interval(max(estimates), float(low), float(high))


def _never_worse(fine: Outcomes, key: str, other: Contender) -> tuple[Criterion, str]:
    own, theirs = fine.of(key, "final"), fine.of(other.key, "final")
    mine, yours = fine.median_by_map(key, "final"), fine.median_by_map(other.key, "final")
    ratios = {name: mine[name] / yours[name] for name in mine}
    worst = max(ratios, key=lambda name: ratios[name])
    beyond = sum(value > NEVER_WORSE for value in ratios.values())
    found = worst_ratio(own, theirs, fine.maps)
    text = f"highest ratio of a map's medians to {other.label}"
    return (
        Criterion(text, found, high=NEVER_WORSE),
        f"Highest on {worst}; above it on {beyond} of {len(ratios)} maps.",
    )


def _judged(claim: Claim) -> Goal:
    if not claim.criteria or math.isnan(claim.criteria[0].interval.estimate):
        return Goal(claim, None, "not measured")
    (criterion,) = claim.criteria
    value = criterion.interval.estimate
    met = criterion.low <= value <= criterion.high
    words = "met" if met else f"missed: {amount(value, criterion.unit)} instead of {criterion.wanted}"
    if criterion.met is None:
        words += "; the interval reaches over the bound" if math.isfinite(criterion.interval.low) else ""
    return Goal(claim, met, words)
