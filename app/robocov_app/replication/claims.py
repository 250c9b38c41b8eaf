"""When a claim holds, the paper's claims, and those beyond it: from what many runs gave to a verdict.

A claim has one or several *criteria*: an estimate, its 95 % interval, and the range in which it has to
lie. A criterion is met where the whole interval lies in that range, refuted where all of it lies outside,
and open where it reaches over an end of the range. The p-value of a claim is the highest of its criteria's
(intersection-union test); those of the `REGISTERED` ones are adjusted by Holm, and they hold at `ALPHA`.

All thresholds stand here, with their reasons; they were set before the study was run, those of the goals of
our own controller before it was written, and are the same for every run. A goal speaks of the runs that there
are: it is met or missed by the measured value, and its verdict as a claim says whether other maps might have
given something else. Statistics are medians over scenarios; their 95 % bootstrap intervals draw whole maps.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, TypeAlias

import numpy as np

from robocov.arrays import Array, IntArray
from robocov.controllers import get_information, load_controller_class
from robocov_app.figures.statistics import (
    Interval,
    bootstrap,
    bootstrap_by,
    group_by,
    median_time,
    share,
    spread,
)
from robocov_app.figures.statistics import holm as adjusted_by_holm
from robocov_app.replication import contenders as laws
from robocov_app.replication.contenders import LABELS, OURS, OWN, PAPER, TARGETS, TEAMS, Contender
from robocov_app.replication.outcomes import EARLY, FIRST_MINUTE, Comparison, GainOutcomes, Outcomes
from robocov_app.replication.plan import CONVEX_KINDS, Plan
from robocov_app.replication.results import BeyondResults, Degradation
from robocov_app.replication.step_times import StepTimes

Verdict: TypeAlias = Literal["holds", "holds partly", "does not hold", "undecided"]

# how verdicts are said of one claim, and of several
VERDICTS: dict[Verdict, tuple[str, str]] = {
    "holds": ("holds", "hold"),
    "holds partly": ("holds partly", "hold partly"),
    "does not hold": ("does not hold", "do not hold"),
    "undecided": ("is undecided", "are undecided"),
}

SAME_COST = 0.02  # two costs are the same when the median of their ratio is within 2 % of 1
NEARLY_SAME = 0.05  # in single runs two costs are nearly the same when they differ by at most 5 %
# The share of runs that "the result is" speaks of, where the paper makes no exceptions. Its exact interval
# counts maps: on 33 not one may differ, and by Holm even none is too few. Of the full study's 100 four may,
# two where the p-value is the least of all registered ones.
NEARLY_ALWAYS = 0.9
CLEARLY_BELOW = 0.95  # a law is better than another when the median ratio of their costs is below this
BARELY = 0.05  # a result barely depends on the gains: its standard deviation is below 5 % of its mean
REGRET = 0.02  # the best gains depend on the environment when those of other maps cost more than 2 % on it
# a result barely depends on the starts: its standard deviation over them is below 10 % of its mean; starts
# matter more than gains do in any law that descends to a local optimum, so the bound is wider
BARELY_BY_START = 0.1
# two placements are nearly the same when robots are less than a quarter of the side of their share apart
SAME_PLACEMENT = 0.25
# a team is near the reference within 10 % of its cost, and far from it above 25 %
NEAR_OPTIMUM, FAR_FROM_OPTIMUM = 0.1, 0.25
CLUSTERED = CONVEX_KINDS[:-1]  # starts in convex regions in which the robots are close together
GOALS, RIVALS, EXTENSIONS = 7, 8, 9  # questions beyond the paper; its own are 1 to 6

# The goals of our own controller. Its gains were tuned on other generated maps, but what it reached on those
# of the study was looked at while its rules were made; `unseen_claim` is on maps of other families.
LEAST_GAP = 0.014  # the median of J/J_ref - 1, at most; RAPF at its best gains had about 5 % at that time
MAP_GAP = 0.03  # the median on every single map, at most
NEVER_WORSE = 1.01  # its median on a map by that of RAPF or LA on the same map, at most
AT_REST = 0.97  # the share of its runs that come to rest
RARELY = 0.1  # the share of runs with a contact, at most: that of no run is shown by no number of them
REST_TIME = 40.0  # s, the median time after which they do
STEP_RATIO = 10.0  # the time of a step of a large team by that of RAPF, at most
CLOSED = 0.5  # most of a gap is closed when more than half of it is

# what RAPF is to bear: axis and value, words
BORNE = ((("loss", 0.6), "60 % of all messages are lost"), (("delay", 1.0), "messages arrive after 1 s"))
_RESAMPLES = 2000

# the paper's main claims, tested together at the level `ALPHA`; the others are told with their intervals
REGISTERED = (
    *("convex-final", "nonconvex-final-shared", "nonconvex-final-best", "gains-result", "starts-cost"),
    *("lloyd-stuck", "gap-rapf"),
)
ALPHA = 0.05
# maps from which on a claim is judged: of 5 normal clusters a 95 % percentile interval of the mean holds the
# truth in 82 % of all cases, of 12 in 92 %
LEAST_MAPS = 12


@dataclass(frozen=True)
class Criterion:
    """A measure whose interval has to lie between `low` and `high`, both included, for a claim to hold."""

    text: str
    interval: Interval
    low: float = -math.inf
    high: float = math.inf
    unit: str = ""  # "", "%", "m" or "s"; with "%", 0.5 is written as 50 %

    @property
    def met(self) -> bool | None:
        low, high = self.interval.low, self.interval.high
        if self.low <= low and high <= self.high:
            return True
        return False if high < self.low or low > self.high else None  # with nan, all of that is wrong

    @property
    def p(self) -> float:
        return self.interval.p_value(self.low, self.high)

    @property
    def wanted(self) -> str:
        """The range in words: "at most 5 %"."""
        low, high = amount(self.low, self.unit), amount(self.high, self.unit)
        if math.isinf(self.high):
            return f"at least {low}"
        return f"at most {high}" if math.isinf(self.low) else f"between {low} and {high}"

    @property
    def found(self) -> str:
        return described(self.interval, self.unit)

    def to_json(self) -> dict[str, Any]:
        return {
            "measure": self.text,
            "unit": "1" if self.unit in ("", "%") else self.unit,
            "estimate": self.interval.estimate,
            "interval": [self.interval.low, self.interval.high],
            "at_least": self.low,
            "at_most": self.high,
            "met": self.met,
            "p": self.p,
        }


@dataclass(frozen=True)
class Claim:
    """A claim, what the runs say of it, and why."""

    key: str  # stays the same over versions: "nonconvex-final-shared"
    part: int  # which question it belongs to
    claim: str  # the paper's sentence in our words
    source: str = ""  # where the paper says it; empty where the question is ours
    criteria: tuple[Criterion, ...] = ()  # the first is the main one: its estimate stands for the claim
    runs: int = 0  # simulated runs that went into it
    maps: int = 0  # different maps among them
    explanation: str = "There is no run that could tell."
    least_maps: int = LEAST_MAPS  # on fewer maps it is undecided
    adjusted: float | None = None  # its p-value by Holm, where it is registered

    def judged(self, by: Iterable[Criterion], why: str, on: Outcomes | GainOutcomes, runs: int) -> Claim:
        """Return the claim with what `runs` runs in each of some scenarios say of it."""
        runs, maps = runs * len(on.scenarios), len(set(on.maps))
        return replace(self, criteria=tuple(by), explanation=why, runs=runs, maps=maps)

    @property
    def p(self) -> float:
        return max((criterion.p for criterion in self.criteria), default=1.0)

    @property
    def p_text(self) -> str:
        """The p-values in words: "p = 0.001, by Holm 0.007"."""
        known = {"p =": self.p} | ({} if self.adjusted is None else {"by Holm": self.adjusted})
        return ", ".join(f"{name} {amount(p)}" for name, p in known.items())

    @property
    def verdict(self) -> Verdict:
        if self.maps < self.least_maps or not self.criteria:
            return "undecided"
        met = [criterion.met for criterion in self.criteria]
        if all(met):
            return "holds" if self.adjusted is None or self.adjusted <= ALPHA else "undecided"
        return "holds partly" if any(met) else "does not hold" if False in met else "undecided"

    def to_json(self) -> dict[str, Any]:
        main = self.criteria[0].to_json() if self.criteria else {}
        return {
            "claim": self.claim,
            "verdict": self.verdict,
            "estimate": main.get("estimate"),
            "interval": main.get("interval"),
            "p": self.p,
            "p_adjusted": self.adjusted,
            "runs": self.runs,
            "key": self.key,
            "question": self.part,
            "measure": main.get("measure"),
            "maps": self.maps,
            "source": self.source,
            "explanation": self.explanation,
            "criteria": [criterion.to_json() for criterion in self.criteria],
        }


def amount(value: float, unit: str = "") -> str:
    """Return a number with its unit, as short as it can be read.

    >>> amount(0.0512, "%"), amount(0.643), amount(1.0042), amount(1.5, "m"), amount(6420.9, "J")
    ('5.1 %', '0.643', '1.004', '1.5 m', '6,421 J')
    """
    if not math.isfinite(value):
        return "–"
    if value < 0.0:
        return "−" + amount(-value, unit)
    if unit == "%":
        percent = 100.0 * value
        return f"{percent:.1f} %" if percent < 99.95 and round(percent, 1) % 1 else f"{percent:.0f} %"
    # ratios near 1 are told apart by their third digit after the point
    text = f"{value:.3f}" if not unit and 1.0 < value < 1.1 else f"{value:.3g}"
    text = text if value < 999.5 else f"{value:,.0f}"
    return f"{text} {unit}".rstrip()


def described(interval: Interval, unit: str = "") -> str:
    """Return an estimate with its interval: "5.2 % (3.1 % to 8 %)"."""
    estimate, low, high = (amount(each, unit) for each in (interval.estimate, interval.low, interval.high))
    return estimate if math.isnan(interval.low) else f"{estimate} ({low} to {high})"


def verdict_counts(claims: Sequence[Claim]) -> str:
    found = [claim.verdict for claim in claims]
    counts = {verdict: found.count(verdict) for verdict in VERDICTS if verdict in found}
    parts = [f"{count} {VERDICTS[verdict][count > 1]}" for verdict, count in counts.items()]
    return f"Of {len(claims)} claims {', '.join(parts)}."


def paper_claims(convex: Outcomes, nonconvex: Outcomes, gains: Mapping[str, GainOutcomes]) -> list[Claim]:
    rapf, rpf = same_scenarios(gains["rapf"], gains["rpf"])
    found = [
        convex_final(convex),
        convex_spreading(convex),
        *(against_rpf(nonconvex, at, moment) for moment in ("final", "motion") for at in ("shared", "best")),
        gains_result(rapf, rpf),
        gains_choice(rapf, rpf),
        starts_cost(nonconvex),
        starts_placement(nonconvex),
        lloyd_stuck(nonconvex),
        against_lloyd(nonconvex),
        *(gap_to_reference(nonconvex, law) for law in ("rapf-shared", "rpf-shared", "lloyd")),
    ]
    adjusted = adjusted_by_holm({claim.key: claim.p for claim in found if claim.key in REGISTERED})
    return [replace(claim, adjusted=adjusted.get(claim.key)) for claim in found]


def _both(measure: str, ours: Array, theirs: Array, maps: Sequence[str], bound: float) -> list[Criterion]:
    mine, others = (bootstrap(values, clusters=maps) for values in (ours, theirs))
    low = Criterion(f"RAPF: {measure}", mine, high=bound, unit="%")
    return [low, Criterion("RPF: the same", others, low=bound, unit="%")]


def pair_claim(
    head: Claim,
    pairs: Comparison | None,
    ratio: str,
    wins: str,
    explain: Callable[[Comparison], str],
    *,
    below: float = 1.0,
    most: float = 0.5,
) -> Claim:
    """Judge whether the first of a pair has the lower values: in the median ratio, and in most runs.

    `ratio` and `wins` name these measures; `below` and `most` are what they have to reach.
    """
    if pairs is None:
        return head
    criteria = Criterion(ratio, pairs.ratio, high=below), Criterion(wins, pairs.wins, most, unit="%")
    return head.judged(criteria, explain(pairs), pairs.fine, 2)


def convex_final(outcomes: Outcomes) -> Claim:
    text = "In a convex region RAPF ends at the same cost as Lloyd's algorithm."
    head = Claim("convex-final", 1, text, "VI-A, figures 2 and 3")
    pairs = outcomes.compared("rapf-shared", "lloyd")
    if pairs is None:
        return head
    near = share(np.abs(pairs.ratios - 1.0) <= NEARLY_SAME, pairs.fine.maps)
    criteria = (
        Criterion("median of J(RAPF) / J(LA) at the end", pairs.ratio, 1.0 - SAME_COST, 1.0 + SAME_COST),
        Criterion(f"runs that end within {amount(NEARLY_SAME, '%')} of LA", near, NEARLY_ALWAYS, unit="%"),
    )
    explanation = (
        f"The ratio lies between {amount(pairs.ratios.min())} and {amount(pairs.ratios.max())}; LA ends in "
        f"a centroidal tessellation, of which a region has several. {_other_gains(outcomes)}"
    )
    return head.judged(criteria, explanation, pairs.fine, 2)


def convex_spreading(outcomes: Outcomes) -> Claim:
    text = "From starts close together RAPF spreads faster over a convex region than Lloyd's algorithm."
    what = f"mean distance over the first {EARLY:g} s"
    return pair_claim(
        Claim("convex-spreading", 1, text, "VI-A"),
        outcomes.from_starts(*CLUSTERED).compared("rapf-shared", "lloyd", "early"),
        f"median ratio, RAPF to LA, of the {what}",
        f"runs in which RAPF's {what} is the lower one",
        lambda pairs: (
            f"Per start: {_by_start(pairs)}. The paper itself concludes that “the improvement of RAPF is "
            f"negligible” in convex regions, after having called it “quite better” from close starts."
        ),
    )


def against_rpf(outcomes: Outcomes, gains: str, moment: str) -> Claim:
    """Test whether RAPF's cost is below RPF's, at {"shared", "best"} gains, in {"final", "motion"}."""
    at = "with the same potential parameters" if gains == "shared" else "each with its own best gains"
    end, what, measure = "ends at a lower cost than RPF", "the final cost", "final"
    if moment == "motion":
        end, what = "has a lower cost than RPF while it moves", f"the cost averaged over {FIRST_MINUTE:g} s"
        measure = "first_minute"
    text = f"In a non-convex environment RAPF {end}, {at}."
    return pair_claim(
        Claim(f"nonconvex-{moment}-{gains}", 2, text, "VI-B, figures 4 to 7"),
        outcomes.compared(f"rapf-{gains}", f"rpf-{gains}", measure),
        f"median ratio, RAPF to RPF, of {what}",
        "runs in which RAPF's is the lower one",
        lambda pairs: f"Median ratio per start: {_by_start(pairs)}. {lost_text(pairs, 'RAPF')}",
        below=CLEARLY_BELOW,
        most=NEARLY_ALWAYS,
    )


def against_lloyd(outcomes: Outcomes) -> Claim:
    text = "In a non-convex environment RAPF significantly outperforms Lloyd's algorithm too."
    source = "VII: “significantly outperforms other existing approaches”; the paper shows RPF only"
    return pair_claim(
        Claim("nonconvex-lloyd", 5, text, source),
        outcomes.compared("rapf-shared", "lloyd"),
        "median of J(RAPF) / J(LA) at the end",
        "runs in which RAPF's is the lower one",
        lambda _: f"LA here slides along what it touches. {_other_gains(outcomes)}",
        below=CLEARLY_BELOW,
    )


def gains_result(rapf: GainOutcomes, rpf: GainOutcomes) -> Claim:
    text = "RAPF's final cost barely depends on the gains, RPF's does."
    head = Claim("gains-result", 3, text, "VI-B: “by using the RAPF, it is almost independent”")
    if not rapf.scenarios:
        return head
    ours, theirs, maps = variation(rapf), variation(rpf), rapf.maps
    measure = "median standard deviation of the final cost over the gains, by its mean"
    ratio = bootstrap(ours / np.maximum(theirs, 1e-12), clusters=maps)
    relative = Criterion("median ratio of that deviation, RAPF to RPF", ratio, high=1.0)
    criteria = *_both(measure, ours, theirs, maps, BARELY), relative
    parts = ((level, rapf.with_gain("k_att", level)) for level in rapf.levels("k_att"))
    at = "; ".join(
        f"k_att = {level:g}: {median_text(variation(part), '%')}, "
        f"worst by best {median_text(worst_by_best(part))}"
        for level, part in parts
        if len(part.gains) > 1
    )
    explanation = (
        f"{len(rapf.gains)} sets of gains for RAPF and {len(rpf.gains)} for RPF. Worst by best set, median: "
        f"RAPF {median_text(worst_by_best(rapf))}, RPF {median_text(worst_by_best(rpf))}. "
        f"RAPF at one attraction: {at}."
    )
    return head.judged(criteria, explanation, rapf, len(rapf.gains) + len(rpf.gains))


def gains_choice(rapf: GainOutcomes, rpf: GainOutcomes) -> Claim:
    text = "Which gains are best depends on the environment for RPF, and hardly does for RAPF."
    source = "VI-B: “the best choice of the potential parameters is environment dependent”"
    head = Claim("gains-choice", 3, text, source)
    (ours, maps), (theirs, _) = regrets(rapf), regrets(rpf)
    if not len(ours):
        return head
    measure = "mean cost, in excess, of the gains that are best on other maps instead of on the same one"
    criteria = (
        Criterion(f"RPF: {measure}", bootstrap(theirs, "mean", maps), low=REGRET, unit="%"),
        Criterion("RAPF: the same", bootstrap(ours, "mean", maps), high=REGRET, unit="%"),
    )
    best = [laws.potential_text(grid.gains[grid.best()]) for grid in (rapf, rpf)]
    explanation = (
        f"Both sets are judged from a start that neither was chosen on. Highest excess: RPF "
        f"{amount(theirs.max(), '%')}, RAPF {amount(ours.max(), '%')}. Best over all maps: RAPF {best[0]}, "
        f"RPF {best[1]}."
    )
    return head.judged(criteria, explanation, rapf, len(rapf.gains) + len(rpf.gains))


def starts_cost(outcomes: Outcomes) -> Claim:
    text = "RAPF's final cost barely depends on where the robots start, RPF's does."
    head = Claim("starts-cost", 4, text, "VI-B, figures 6 and 8")
    fine = outcomes.measured("final", "rapf-shared", "rpf-shared")
    (ours, maps), (theirs, _) = (_variation_by_start(fine, law) for law in ("rapf-shared", "rpf-shared"))
    if not maps:
        return head
    measure = "median standard deviation of the final cost over the starts, by its mean"
    criteria = _both(measure, ours, theirs, maps, BARELY_BY_START)
    of = {
        law: median_text(_variation_by_start(outcomes.measured("final", law), law)[0], "%")
        for law in ("rapf-best", "rpf-best", "lloyd")
    }
    explanation = (
        f"Over the same map and seed, from {len(set(fine.starts))} kinds of starts. RPF's varies "
        f"{amount(np.median(theirs) / max(np.median(ours), 1e-12))} times as much as RAPF's. At their "
        f"best gains: RAPF {of['rapf-best']}, RPF {of['rpf-best']}; LA {of['lloyd']}."
    )
    return head.judged(criteria, explanation, fine, 2)


def starts_placement(outcomes: Outcomes) -> Claim:
    text = "RAPF's final placement varies little with where the robots start, RPF's strongly."
    head = Claim("starts-placement", 4, text, "VI-B, figures 6 and 8")
    fine = outcomes.measured("final", "rapf-shared", "rpf-shared")
    rapf, rpf = (fine.placement_spreads(law) for law in ("rapf-shared", "rpf-shared"))
    maps = [name for name in rapf if name in rpf]
    if not maps:
        return head
    ours, theirs = (np.array([apart[name] for name in maps]) for apart in (rapf, rpf))
    metres = [median_text(apart * [fine.sides[name] for name in maps], "m") for apart in (ours, theirs)]
    measure = "matched distance between the ends from different starts, by the side of a robot's share"
    ratio = bootstrap(ours / theirs, clusters=maps)
    criteria = (
        Criterion(f"RAPF: {measure}", bootstrap(ours, clusters=maps), high=SAME_PLACEMENT, unit="%"),
        Criterion("median ratio of that distance, RAPF to RPF", ratio, high=1.0),
    )
    explanation = (
        f"In metres: RAPF {metres[0]}, RPF {metres[1]} (medians over maps). "
        f"Robots are matched so that the sum of straight distances is least. "
        f"A placement can differ while its cost does not: many are equally good."
    )
    return head.judged(criteria, explanation, fine, 2)


def lloyd_stuck(outcomes: Outcomes) -> Claim:
    text = "Lloyd's algorithm is unusable in presence of obstacles: its robots get stuck."
    head = Claim("lloyd-stuck", 5, text, "I and IV")
    fine = outcomes.measured("stuck", "lloyd")
    if not fine.scenarios:
        return head
    count = fine.of("lloyd", "stuck")
    stuck = share(count > 0, fine.maps)
    criteria = [Criterion("runs of LA that end with a robot stuck", stuck, 0.5, unit="%")]
    near = fine.measured("gap", "lloyd")
    if near.scenarios:
        gap = bootstrap(near.of("lloyd", "gap"), clusters=near.maps)
        criteria.append(Criterion("LA: median of J/J_ref - 1", gap, FAR_FROM_OPTIMUM, unit="%"))
    others = ", ".join(
        f"{LABELS[law]} {amount(share_above_zero(outcomes.of(law, 'stuck')), '%')}"
        for law in ("rapf-shared", "rapf-best", "rapf-default")
    )
    explanation = (
        f"On average {amount(count.mean())} robots are stuck in a run. "
        f"Runs with a stuck robot of other laws: {others}. Stuck: the goal is more than 0.5 m away and the "
        f"robot moved less than 0.05 m in the last 5 s."
    )
    return head.judged(criteria, explanation, fine, 1)


# of each law: what is claimed of its gap to the reference, and where the paper says it
_GAPS = {
    "rapf-shared": ("RAPF's coverage is nearly optimal.", "VII: “to achieve an optimal coverage”"),
    "rpf-shared": ("RPF comes to rest far from the optimum.", "IV and I: “usually far from the optimal”"),
    "lloyd": ("Lloyd's algorithm, ignorant of obstacles, is nearly optimal all the same.", ""),
}


def gap_to_reference(outcomes: Outcomes, law: str) -> Claim:
    head = Claim(f"gap-{law.removesuffix('-shared')}", 6, *_GAPS[law])
    fine = outcomes.measured("gap", law)
    if not fine.scenarios:
        return head
    gap = fine.of(law, "gap")
    bound = {"low": FAR_FROM_OPTIMUM} if law == "rpf-shared" else {"high": NEAR_OPTIMUM}
    measure = f"{LABELS[law]}: median of J/J_ref - 1"
    criterion = Criterion(measure, bootstrap(gap, clusters=fine.maps), unit="%", **bound)
    beaten = f", and was beaten in {amount((gap < 0).mean(), '%')} of the runs" if (gap < 0).any() else ""
    # bundled maps are larger, and harder
    drawn = np.array([name.startswith("generated-") for name in fine.maps], dtype=bool)
    kinds = ("generated", gap[drawn]), ("bundled", gap[~drawn])
    medians = [f"on {kind} maps {median_text(own, '%')}" for kind, own in kinds if len(own)]
    explanation = (
        f"{half_text(gap)[:-1]}; the worst is {amount(gap.max(), '%')} above it "
        f"({fine.scenarios[int(np.argmax(gap))]}). Medians: {', '.join(medians)}. "
        f"J_ref is the best of many descents with the whole map known; it is no bound, "
        f"only hard to beat{beaten}."
    )
    return head.judged((criterion,), explanation, fine, 1)


def variation(grid: GainOutcomes) -> Array:
    """Return the standard deviation of the cost over the gains by its mean, for each scenario, (m,)."""
    return np.array([spread(column) for column in grid.excess.T])


def worst_by_best(grid: GainOutcomes) -> Array:
    return np.asarray(grid.excess.max(axis=0) / grid.excess.min(axis=0))


def regrets(grid: GainOutcomes) -> tuple[Array, list[str]]:
    """Return what it costs not to know the map when gains are chosen, (k,), and the map of each value.

    For every scenario two sets of gains are compared: the best one on the *other starts of the same map*,
    and the best one on the other maps. Neither was chosen on the scenario itself, so chance favours none. A
    regret is J with the gains of other maps by J with those of the same map, minus 1.
    """
    found, where = [], []
    for column, (name, start, _) in enumerate(grid.scenarios):
        same = [k for k, each in enumerate(grid.scenarios) if each.map == name and each.start != start]
        others = [k for k, each in enumerate(grid.scenarios) if each.map != name]
        if same and others:
            known, unknown = grid.best(same), grid.best(others)
            found.append(float(grid.excess[unknown, column] / grid.excess[known, column]) - 1.0)
            where.append(name)
    return np.array(found), where


def share_above_zero(counts: Array) -> float:
    """Return the share of counts above zero among those that are there; nan where none is."""
    fine = counts[np.isfinite(counts)]
    return float((fine > 0).mean()) if len(fine) else float("nan")


def half_text(gap: Array) -> str:
    low, high = np.quantile(gap, [0.25, 0.75]).tolist()
    return f"Half of the runs lie between {amount(low, '%')} and {amount(high, '%')}."


def lost_text(pairs: Comparison, who: str) -> str:
    worst = int(np.argmax(pairs.ratios))
    ratio, where = amount(pairs.ratios[worst]), pairs.fine.scenarios[worst]
    lost = (pairs.ratios >= 1.0).sum()
    return f"{who} loses {lost} of {len(pairs.ratios)}; the highest ratio is {ratio} ({where})."


def median_text(values: Array, unit: str = "") -> str:
    return amount(float(np.median(values)), unit) if len(values) else "–"


def _by_start(pairs: Comparison) -> str:
    starts, kinds = np.array(pairs.fine.starts), dict.fromkeys(pairs.fine.starts)
    return ", ".join(f"{kind} {median_text(pairs.ratios[starts == kind])}" for kind in kinds)


def _other_gains(outcomes: Outcomes) -> str:
    parts = []
    for law in ("rapf-best", "rapf-default"):
        pairs = outcomes.compared(law, "lloyd")
        if pairs is not None:
            wins = amount(pairs.wins.estimate, "%")
            parts.append(f"{LABELS[law]}: ratio {described(pairs.ratio)}, lower in {wins} of the runs")
    return f"{'; '.join(parts)}." if parts else ""


def _variation_by_start(outcomes: Outcomes, law: str) -> tuple[Array, list[str]]:
    """Return the variation of the final cost over several starts, (k,), and the map of each value."""
    finals = zip(outcomes.scenarios, outcomes.of(law, "final"), strict=True)
    groups = group_by(finals, lambda pair: (pair[0].map, pair[0].seed))
    several = {name: [final for _, final in pairs] for name, pairs in groups.items() if len(pairs) > 1}
    return np.array([spread(own) for own in several.values()]), [name for name, _ in several]


def same_scenarios(rapf: GainOutcomes, rpf: GainOutcomes) -> tuple[GainOutcomes, GainOutcomes]:
    """Return what both laws did in the scenarios, the same of both, where no run of either failed."""
    fine: Any = np.isfinite(np.vstack([rapf.excess, rpf.excess])).all(axis=0)
    return rapf.where(fine), rpf.where(fine)


def beyond_claims(results: BeyondResults) -> tuple[Claim, ...]:
    outcomes, ours, contenders = results.outcomes, OWN[0], results.contenders
    unseen = None if results.unseen is None else unseen_claim(results.unseen, ours, contenders)
    return (
        *goals(outcomes, ours, contenders, results.steps, results.plan),
        *([] if unseen is None else [unseen]),
        *rival_claims(outcomes, ours, contenders),
        targets_claim(results.targets),
        density_claim(results.density.outcomes),
        *(teams_claim(results.teams, law) for law in ("rapf", "lloyd")),
        conditions_claim(results.degradations, len(results.plan.beyond.conditions_maps)),
    )


def _first_criteria(fine: Outcomes, key: str) -> tuple[Criterion, Criterion, Criterion]:
    gap = bootstrap(fine.of(key, "gap"), clusters=fine.maps)
    touched = share(fine.of(key, "contacts") > 0, fine.maps)
    rest = share(np.isfinite(fine.of(key, "settled")), fine.maps)
    return (
        Criterion("median of J/J_ref - 1", gap, high=LEAST_GAP, unit="%"),
        Criterion("runs with a contact", touched, high=RARELY, unit="%"),
        Criterion("runs that come to rest", rest, AT_REST, unit="%"),
    )


def goals(
    outcomes: Outcomes, own: Contender, among: Sequence[Contender], steps: Mapping[int, StepTimes], plan: Plan
) -> list[Claim]:
    """Return the goals of a controller of our own among all, each a claim with one criterion."""
    key, label = own.key, own.label
    fine = outcomes.measured("gap", key)
    found: list[Claim] = []

    def add(name: str, text: str, criterion: Criterion, explanation: str) -> None:
        found.append(Claim(f"goal-{name}", GOALS, text).judged((criterion,), explanation, fine, 1))

    if fine.scenarios:
        near, untouched, resting = _first_criteria(fine, key)
        gap, settled, maps = fine.of(key, "gap"), fine.of(key, "settled"), fine.maps
        reference = f"within {amount(LEAST_GAP, '%')} of the centralised reference in the median"
        add("gap", f"{label}'s cost is {reference}.", near, half_text(gap))

        text = f"On every map {label}'s median is within {amount(MAP_GAP, '%')} of the reference."
        worst = highest_of_maps(lambda rows: np.median(gap[rows], axis=-1), maps)
        criterion = Criterion("highest median of a map", worst, high=MAP_GAP, unit="%")
        add("every-map", text, criterion, _highest_text(fine.median_by_map(key), MAP_GAP))

        for other in laws.strongest(among):
            if (pairs := outcomes.compared(key, other.key)) is not None:
                above = amount(NEVER_WORSE - 1.0, "%")
                text = f"On no map {label}'s median is more than {above} above that of {other.label}."
                mine, theirs = (pairs.fine.median_by_map(each, "final") for each in (key, other.key))
                words = _highest_text({name: mine[name] / theirs[name] for name in mine}, NEVER_WORSE)
                measure = f"highest ratio of a map's medians to {other.label}"
                criterion = Criterion(measure, worst_ratio(pairs), high=NEVER_WORSE)
                add(f"not-worse-{other.key}", text, criterion, words)

        touched, rest = fine.of(key, "contacts") > 0, np.isfinite(settled)
        words = f"{touched.sum()} of {len(touched)} runs."
        add("contacts", f"{label} touches nothing.", replace(untouched, high=0.0), words)

        text = f"{label} comes to rest in at least {amount(AT_REST, '%')} of the runs."
        add("rest", text, resting, f"{(~rest).sum()} of {len(rest)} runs do not.")

        text = f"{label} is at rest within {amount(REST_TIME, 's')} in the median."
        censored = np.full(len(rest), plan.duration)
        times = bootstrap_by(lambda k: median_time(settled[k][rest[k]], censored[k][~rest[k]]), maps)
        criterion = Criterion("median time until rest", times, high=REST_TIME, unit="s")
        add("time", text, criterion, "By Kaplan and Meier: runs that do not come to rest are censored.")

    of_runs = len(found)
    large, huge = (steps.get(robots) for robots in (plan.beyond.large, plan.beyond.huge))
    if large is not None and math.isfinite((ratio := large.ratio_interval(own.controller)).estimate):
        most = f"at most {STEP_RATIO:g} times as long as RAPF's with {large.robots} robots"
        words = "Timed in turn, over whole seconds of simulated time: plans and scans count by their share."
        criterion = Criterion("time of a step by RAPF's", ratio, high=STEP_RATIO)
        add("step", f"A step of {label} takes {most}.", criterion, words)
    if huge is not None and math.isfinite((part := huge.real_time(own.controller)).estimate):
        text = f"{label} runs in real time with {huge.robots} robots."
        criterion = Criterion("computing time by simulated time", part, high=1.0)
        add("real-time", text, criterion, "One process; the physics of the world included.")
    return found[:of_runs] + [replace(goal, runs=0, maps=1, least_maps=1) for goal in found[of_runs:]]


def highest_of_maps(statistic: Callable[[IntArray], Any], maps: Sequence[str]) -> Interval:
    """Return the highest value of a map, with an interval of these maps: runs are drawn within each map.

    `statistic`: of row numbers, (m,) or (k, m), over the last axis.
    """
    rng, names = np.random.default_rng(0), np.array(maps)
    estimates, drawn = [], []
    for name in dict.fromkeys(maps):
        rows = np.flatnonzero(names == name)
        estimates.append(float(statistic(rows)))
        drawn.append(statistic(rng.choice(rows, size=(_RESAMPLES, len(rows)))))
    low, high = np.quantile(highest := np.max(drawn, axis=0), [0.025, 0.975]).tolist()
    return Interval(max(estimates), low, high, highest)


def worst_ratio(pairs: Comparison) -> Interval:
    a, b, maps = pairs.a, pairs.b, pairs.fine.maps
    return highest_of_maps(lambda k: np.median(a[k], axis=-1) / np.median(b[k], axis=-1), maps)


def _highest_text(values: Mapping[str, float], bound: float) -> str:
    above = sum(value > bound for value in values.values())
    return f"Highest on {max(values, key=values.__getitem__)}; above it on {above} of {len(values)} maps."


def is_met(goal: Claim) -> bool:
    (criterion,) = goal.criteria
    return criterion.low <= criterion.interval.estimate <= criterion.high


def _missed_by(goal: Claim) -> str:
    (criterion,) = goal.criteria
    return f"{amount(criterion.interval.estimate, criterion.unit)} instead of {criterion.wanted}"


def goal_outcome(goal: Claim) -> str:
    """Return the verdict in words: "met", "missed: 1.8 % instead of at most 1.4 %"."""
    (criterion,) = goal.criteria
    unsure = criterion.met is None and math.isfinite(criterion.interval.low)
    words = "met" if is_met(goal) else f"missed: {_missed_by(goal)}"
    return words + ("; the interval reaches over the bound" if unsure else "")


def goal_counts(found: Sequence[Claim]) -> str:
    if not found:
        return "Nothing was measured."
    missed = [f"{goal.criteria[0].text} {_missed_by(goal)}" for goal in found if not is_met(goal)]
    head = f"{len(found) - len(missed)} of {len(found)} goals are met."
    return f"{head} Missed: {'; '.join(missed)}." if missed else head


def unseen_claim(outcomes: Outcomes, ours: Contender, contenders: Sequence[Contender]) -> Claim | None:
    key, label = ours.key, ours.label
    fine = outcomes.measured("gap", key)
    if not fine.scenarios:
        return None
    criteria = [*_first_criteria(fine, key)]
    for other in laws.strongest(contenders):
        if (pairs := outcomes.compared(key, other.key)) is not None:
            text = f"median of J({label}) / J({other.label}) at the end"
            criteria.append(Criterion(text, pairs.ratio, high=1.0))
    medians = fine.median_by_map(key)
    worst = max(medians, key=medians.__getitem__)
    explanation = (
        f"{len(medians)} generated maps, {len(fine.scenarios)} runs of {label}. Highest median of a map: "
        f"{amount(medians[worst], '%')}, on {worst}."
    )
    text = "The same holds on maps of other families than those of the claims."
    return Claim("goal-unseen", GOALS, text).judged(criteria, explanation, fine, 1)


def rival_claims(outcomes: Outcomes, ours: Contender, contenders: Sequence[Contender]) -> list[Claim]:
    papers = laws.strongest(contenders)
    found = [gap_closed(outcomes, ours, papers[0])] if papers else []
    others = [each for each in contenders if each.controller not in (*PAPER, *OURS)]
    for other in (*papers, *others):
        knows = get_information(load_controller_class(other.controller))
        text = f"{ours.label} ends at a lower cost than {other.label}"
        text += "." if knows == "own" else f", which goes by the {knows}."
        head = Claim(f"beyond-{ours.key}-{other.key}", RIVALS, text)
        ratio = f"median of J({ours.label}) / J({other.label}) at the end"
        wins, pairs = f"runs in which {ours.label}'s is the lower one", outcomes.compared(ours.key, other.key)
        found.append(pair_claim(head, pairs, ratio, wins, lambda pairs: lost_text(pairs, "It")))
    return found


def gap_closed(outcomes: Outcomes, ours: Contender, other: Contender) -> Claim:
    text = f"{ours.label} closes most of the gap that {other.label} leaves to the centralised reference."
    head = Claim(f"beyond-{ours.key}-closes", RIVALS, text)
    fine = outcomes.measured("gap", ours.key, other.key)
    if not fine.scenarios:
        return head
    own, theirs = fine.of(ours.key, "gap"), fine.of(other.key, "gap")

    def closed(rows: IntArray) -> float:
        left = float(np.median(theirs[rows]))
        return 1.0 - float(np.median(own[rows])) / left if left > 0.0 else float("nan")

    if math.isnan(closed(np.arange(len(own)))):
        return replace(head, explanation=f"{other.label} leaves no gap that could be closed.")
    found = bootstrap_by(closed, fine.maps)
    medians = f"{median_text(own, '%')} and {median_text(theirs, '%')}"
    explanation = f"Medians of J/J_ref - 1 in the same runs: {medians}."
    criterion = Criterion("part of the median gap that is closed", found, CLOSED, unit="%")
    return head.judged((criterion,), explanation, fine, 2)


def targets_claim(outcomes: Outcomes) -> Claim:
    text = (
        "Whether RAPF heads for the centroid of its cell, its geometric median or the best place of a "
        "sensor makes no difference to the coverage cost."
    )
    head = Claim("targets", EXTENSIONS, text)
    compared = [outcomes.compared(law.key, TARGETS[0].key) for law in TARGETS[1:]]
    pairs = [each for each in compared if each is not None]
    if not pairs:
        return head
    measure, same = "median of J({}) / J(centroid) at the end", SAME_COST
    criteria = [Criterion(measure.format(each.first), each.ratio, 1.0 - same, 1.0 + same) for each in pairs]
    words = "; ".join(f"{one.first} lower in {amount(one.wins.estimate, '%')} of the runs" for one in pairs)
    runs = sum(2 * len(each.fine.scenarios) for each in pairs)
    return replace(head.judged(criteria, f"{capitalised(words)}.", pairs[-1].fine, 1), runs=runs)


def density_claim(outcomes: Outcomes) -> Claim:
    text = "Where some places count more, RAPF that knows which ends at a clearly lower weighed cost."
    return pair_claim(
        Claim("density", EXTENSIONS, text),
        outcomes.compared("known", "ignored"),
        "median ratio of the mean distance by φ",
        "runs in which it is the lower one",
        lambda _: (
            "Both are judged by the same φ: two Gaussians of 1 m on every map, 20 high over a floor of 1, "
            "drawn by chance in the free space."
        ),
        below=CLEARLY_BELOW,
    )


def teams_claim(outcomes: Outcomes, controller: str) -> Claim:
    by_distance, by_time = (law for law in TEAMS if law.controller == controller)
    label = by_time.label.partition(",")[0]
    text = f"In a mixed team {label} is at places sooner, in the mean, with cells by time than by distance."
    return pair_claim(
        Claim(f"teams-{controller}", EXTENSIONS, text),
        outcomes.compared(by_time.key, by_distance.key, "time"),
        "median ratio of the mean time, by time to by distance",
        "runs in which it is the lower one",
        lambda pairs: (
            f"Median of the mean time until the first robot is there: {median_text(pairs.b, 's')} "
            f"with cells by distance, {median_text(pairs.a, 's')} by time. "
            f"Two robots each of at most 1, 0.5 and 0.25 m/s."
        ),
    )


def conditions_claim(found: Iterable[Degradation], maps: int) -> Claim:
    text = f"RAPF ends within {amount(NEARLY_SAME, '%')} of its cost where messages get lost or are late."
    head = Claim("conditions", EXTENSIONS, text)
    rapf = [each for each in found if each.controller == "rapf" and math.isfinite(each.ratio.estimate)]
    known = {(each.axis, each.value): each for each in rapf}
    measure = "final cost where {}, by that under ideal conditions"
    borne = [(measure.format(words), known[at]) for at, words in BORNE if at in known]
    if not borne:
        return head
    worst = max(rapf, key=lambda each: each.ratio.estimate)
    value = "none" if worst.value is None else f"{worst.value:g}"
    highest, axis = amount(worst.ratio.estimate), worst.axis.replace("_", " ")
    return replace(
        head,
        criteria=tuple(Criterion(words, each.ratio, high=1.0 + NEARLY_SAME) for words, each in borne),
        runs=sum(2 * each.runs for _, each in borne),
        maps=maps,
        explanation=f"The highest of all medians is {highest}, with {axis} {value}.",
    )


def capitalised(words: str) -> str:
    return words[:1].upper() + words[1:]
