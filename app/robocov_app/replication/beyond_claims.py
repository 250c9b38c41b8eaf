"""Claims beyond the paper: the goals of our own controller, how it compares, and what the paper leaves open.

All thresholds were set before anything was run, those of the goals before the controller was written. Its
gains were tuned on other generated maps, but what it reached on those of the study was looked at as well
while its rules were made, as the page says; `unseen_claim` is on maps on which nobody did. A goal speaks of
the runs that there are: it is met or missed by the measured value. Its interval, and with it the verdict of
the claim, says whether other maps might have given something else.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from robocov.arrays import Array, IntArray
from robocov.controllers import controller_kind, information_of
from robocov_app.figures.statistics import Interval, bootstrap, bootstrap_by, median_time
from robocov_app.replication import claims
from robocov_app.replication.claims import Claim, Criterion, amount
from robocov_app.replication.contenders import OURS, OWN, PAPER, TARGETS, TEAMS, Contender, strongest
from robocov_app.replication.outcomes import Outcomes
from robocov_app.replication.plan import Plan
from robocov_app.replication.results import BeyondResults, Degradation
from robocov_app.replication.step_times import StepTimes

# which questions the claims beyond the paper belong to; those of the paper are 1 to 6
GOALS, RIVALS, EXTENSIONS = 7, 8, 9
QUESTIONS = {
    GOALS: "Does our own controller reach its goals?",
    RIVALS: "Is it better than its rivals?",
    EXTENSIONS: "What the paper leaves to others: what difference does it make?",
}

# the goals
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


class Goal(NamedTuple):
    """A goal, as a claim with one criterion; `met` by the measured value, None where nothing was measured."""

    claim: Claim
    met: bool | None

    @property
    def missed(self) -> str:
        """By how much it is missed: "1.8 % instead of at most 1.4 %"."""
        (criterion,) = self.claim.criteria
        return f"{amount(criterion.interval.estimate, criterion.unit)} instead of {criterion.wanted}"

    @property
    def words(self) -> str:
        """The verdict in words: "met", "missed: 1.8 % instead of at most 1.4 %"."""
        if self.met is None:
            return "not measured"
        (criterion,) = self.claim.criteria
        unsure = criterion.met is None and math.isfinite(criterion.interval.low)
        words = "met" if self.met else f"missed: {self.missed}"
        return words + ("; the interval reaches over the bound" if unsure else "")


def beyond_goals(results: BeyondResults) -> list[Goal]:
    """Return the goals of the first of ours."""
    return goals(results.outcomes, OWN[0], results.contenders, results.steps, results.plan)


def beyond_unseen(results: BeyondResults) -> Claim | None:
    """Return what ours reached on maps that played no part in its development, if it ran there."""
    return None if results.unseen is None else unseen_claim(results.unseen, OWN[0], results.contenders)


def beyond_claims(results: BeyondResults) -> tuple[Claim, ...]:
    """Return all claims beyond the paper with what the runs say of them."""
    unseen = beyond_unseen(results)
    return (
        *(goal.claim for goal in beyond_goals(results)),
        *([] if unseen is None else [unseen]),
        *rival_claims(results.outcomes, OWN[0], results.contenders),
        targets_claim(results.targets),
        density_claim(results.density.outcomes),
        *(teams_claim(results.teams, law) for law in ("rapf", "lloyd")),
        conditions_claim(results.degradations, len(results.plan.beyond.conditions_maps)),
    )


def _first_criteria(fine: Outcomes, key: str) -> tuple[Criterion, Criterion, Criterion]:
    """Return the goals of gap, contacts and rest, with what was measured in these scenarios."""
    gap = bootstrap(fine.of(key, "gap"), clusters=fine.maps)
    touched = claims.share_of(fine.of(key, "contacts") > 0, fine)
    rest = claims.share_of(np.isfinite(fine.of(key, "settled")), fine)
    return (
        Criterion("median of J/J_ref - 1", gap, high=LEAST_GAP, unit="%"),
        Criterion("runs with a contact", touched, high=RARELY, unit="%"),
        Criterion("runs that come to rest", rest, AT_REST, unit="%"),
    )


def goals(
    outcomes: Outcomes,
    ours: Contender,
    contenders: Sequence[Contender],
    steps: Mapping[int, StepTimes],
    plan: Plan,
) -> list[Goal]:
    """Return the goals of a controller of ours among all `contenders`, with what was measured."""
    key, label = ours.key, ours.label
    fine = outcomes.measured("gap", key)
    found: list[Goal] = []

    def add(name: str, text: str, criterion: Criterion, explanation: str, *, timed: bool = False) -> None:
        value, head = criterion.interval.estimate, Claim(f"goal-{name}", GOALS, text)
        claim = head.judged((criterion,), explanation, fine, 1)
        if timed:
            claim = replace(claim, runs=0, maps=1, least_maps=1)
        found.append(Goal(claim, None if math.isnan(value) else criterion.low <= value <= criterion.high))

    if fine.scenarios:
        near, untouched, resting = _first_criteria(fine, key)
        gap, settled, maps = fine.of(key, "gap"), fine.of(key, "settled"), fine.maps
        reference = f"within {amount(LEAST_GAP, '%')} of the centralised reference in the median"
        add("gap", f"{label}'s cost is {reference}.", near, claims.half_text(gap))

        text = f"On every map {label}'s median is within {amount(MAP_GAP, '%')} of the reference."
        criterion = Criterion("highest median of a map", worst_median(gap, maps), high=MAP_GAP, unit="%")
        add("every-map", text, criterion, _highest_text(fine.median_by_map(key), MAP_GAP))

        for other in strongest(contenders):
            pairs = outcomes.compared(key, other.key)
            if pairs is not None:
                above = amount(NEVER_WORSE - 1.0, "%")
                text = f"On no map {label}'s median is more than {above} above that of {other.label}."
                mine, theirs = (pairs.fine.median_by_map(each, "final") for each in (key, other.key))
                words = _highest_text({name: mine[name] / theirs[name] for name in mine}, NEVER_WORSE)
                worst = worst_ratio(pairs.a, pairs.b, pairs.fine.maps)
                measure = f"highest ratio of a map's medians to {other.label}"
                add(f"not-worse-{other.key}", text, Criterion(measure, worst, high=NEVER_WORSE), words)

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

    large, huge = (steps.get(robots) for robots in (plan.beyond.large, plan.beyond.huge))
    if large is not None and math.isfinite((ratio := large.ratio_interval(ours.controller)).estimate):
        most = f"at most {STEP_RATIO:g} times as long as RAPF's with {large.robots} robots"
        words = "Timed in turn, over whole seconds of simulated time: plans and scans count by their share."
        criterion = Criterion("time of a step by RAPF's", ratio, high=STEP_RATIO)
        add("step", f"A step of {label} takes {most}.", criterion, words, timed=True)
    if huge is not None and math.isfinite((taken := huge.interval(ours.controller)).estimate):
        part = Interval(*(value / huge.dt for value in (taken.estimate, taken.low, taken.high)))
        words = "One process; the physics of the world included."
        text = f"{label} runs in real time with {huge.robots} robots."
        criterion = Criterion("computing time by simulated time", part, high=1.0)
        add("real-time", text, criterion, words, timed=True)
    return found


def _highest_text(values: Mapping[str, float], bound: float) -> str:
    """Return in words on which map a value is the highest, and how many are above a bound."""
    above = sum(value > bound for value in values.values())
    return f"Highest on {max(values, key=values.__getitem__)}; above it on {above} of {len(values)} maps."


def unseen_claim(outcomes: Outcomes, ours: Contender, contenders: Sequence[Contender]) -> Claim | None:
    """Return whether the first goals hold for `outcomes` on maps that played no part in the development."""
    key, label = ours.key, ours.label
    fine = outcomes.measured("gap", key)
    if not fine.scenarios:
        return None
    criteria = [*_first_criteria(fine, key)]
    for other in strongest(contenders):
        pairs = outcomes.compared(key, other.key)
        if pairs is not None:
            text = f"median of J({label}) / J({other.label}) at the end"
            criteria.append(Criterion(text, pairs.ratio, high=1.0))
    medians = fine.median_by_map(key)
    worst = max(medians, key=lambda name: medians[name])
    explanation = (
        f"{len(medians)} generated maps, {len(fine.scenarios)} runs of {label}. Highest median of a map: "
        f"{amount(medians[worst], '%')}, on {worst}."
    )
    text = f"The same holds on maps on which nothing was looked at while {label} was developed."
    return Claim("goal-unseen", GOALS, text).judged(criteria, explanation, fine, 1)


def rival_claims(outcomes: Outcomes, ours: Contender, contenders: Sequence[Contender]) -> list[Claim]:
    """Return whether one of ours ends at a lower cost than each other contender, and closes RAPF's gap."""
    papers = strongest(contenders)
    found = [gap_closed(outcomes, ours, papers[0])] if papers else []
    others = [each for each in contenders if each.controller not in (*PAPER, *OURS)]
    for other in (*papers, *others):
        knows = information_of(controller_kind(other.controller))
        text = f"{ours.label} ends at a lower cost than {other.label}"
        text += "." if knows == "own" else f", which goes by the {knows}."
        head = Claim(f"beyond-{ours.key}-{other.key}", RIVALS, text)
        ratio = f"median of J({ours.label}) / J({other.label}) at the end"
        wins, pairs = f"runs in which {ours.label}'s is the lower one", outcomes.compared(ours.key, other.key)
        found.append(claims.pair_claim(head, pairs, ratio, wins, lambda pairs: claims.lost_text(pairs, "It")))
    return found


def gap_closed(outcomes: Outcomes, ours: Contender, other: Contender) -> Claim:
    """Test whether ours closes most of another contender's gap to the reference."""
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
    medians = f"{claims.median_text(own, '%')} and {claims.median_text(theirs, '%')}"
    explanation = f"Medians of J/J_ref - 1 in the same runs: {medians}."
    criterion = Criterion("part of the median gap that is closed", found, CLOSED, unit="%")
    return head.judged((criterion,), explanation, fine, 2)


def targets_claim(outcomes: Outcomes) -> Claim:
    """Test whether it matters for which optimum of its cell RAPF heads."""
    text = (
        "Whether RAPF heads for the centroid of its cell, its geometric median or the best place of a "
        "sensor makes no difference to the coverage cost."
    )
    head = Claim("targets", EXTENSIONS, text)
    compared = [outcomes.compared(law.key, TARGETS[0].key) for law in TARGETS[1:]]
    pairs = [each for each in compared if each is not None]
    if not pairs:
        return head
    measure, same = "median of J({}) / J(centroid) at the end", claims.SAME_COST
    criteria = [Criterion(measure.format(each.first), each.ratio, 1.0 - same, 1.0 + same) for each in pairs]
    words = "; ".join(f"{one.first} lower in {amount(one.wins.estimate, '%')} of the runs" for one in pairs)
    runs = sum(2 * len(each.fine.scenarios) for each in pairs)
    return replace(head.judged(criteria, f"{capitalised(words)}.", pairs[-1].fine, 1), runs=runs)


def density_claim(outcomes: Outcomes) -> Claim:
    """Test whether it helps RAPF to know which places count more."""
    text = "Where some places count more, RAPF that knows which ends at a clearly lower weighed cost."
    return claims.pair_claim(
        Claim("density", EXTENSIONS, text),
        outcomes.compared("known", "ignored"),
        "median ratio of the mean distance by φ",
        "runs in which it is the lower one",
        lambda _: (
            "Both are judged by the same φ: two Gaussians of 1 m on every map, 20 high over a floor of 1, "
            "drawn by chance in the free space."
        ),
        below=claims.CLEARLY_BELOW,
    )


def teams_claim(outcomes: Outcomes, controller: str) -> Claim:
    """Test whether cells by time help a team whose robots are not equally fast."""
    by_distance, by_time = (law for law in TEAMS if law.controller == controller)
    label = by_time.label.partition(",")[0]
    text = f"In a mixed team {label} is at places sooner, in the mean, with cells by time than by distance."
    return claims.pair_claim(
        Claim(f"teams-{controller}", EXTENSIONS, text),
        outcomes.compared(by_time.key, by_distance.key, "time"),
        "median ratio of the mean time, by time to by distance",
        "runs in which it is the lower one",
        lambda pairs: (
            f"Median of the mean time until the first robot is there: {claims.median_text(pairs.b, 's')} "
            f"with cells by distance, {claims.median_text(pairs.a, 's')} by time. "
            f"Two robots each of at most 1, 0.5 and 0.25 m/s."
        ),
    )


def conditions_claim(found: Iterable[Degradation], maps: int) -> Claim:
    """Test whether RAPF bears messages that are lost or late, from what came of it on so many maps."""
    near = amount(claims.NEARLY_SAME, "%")
    text = f"RAPF ends within {near} of its cost where messages get lost or are late."
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
        criteria=tuple(Criterion(words, each.ratio, high=1.0 + claims.NEARLY_SAME) for words, each in borne),
        runs=sum(2 * each.runs for _, each in borne),
        maps=maps,
        explanation=f"The highest of all medians is {highest}, with {axis} {value}.",
    )


def goal_counts(found: Sequence[Goal]) -> str:
    """Return in words how many goals are met, and which are not, with the measured values."""
    measured = [goal for goal in found if goal.met is not None]
    if not measured:
        return "Nothing was measured."
    missed = [f"{goal.claim.criteria[0].text} {goal.missed}" for goal in measured if not goal.met]
    head = f"{len(measured) - len(missed)} of {len(measured)} goals are met."
    return f"{head} Missed: {'; '.join(missed)}." if missed else head


def capitalised(words: str) -> str:
    """Return words with a capital letter at their beginning."""
    return words[:1].upper() + words[1:]


def worst_median(values: Array, maps: Sequence[str]) -> Interval:
    """Return the highest median of a map, with an interval of these maps: runs are drawn within each map."""
    return _highest(lambda rows: np.median(values[rows], axis=-1), maps)


def worst_ratio(first: Array, second: Array, maps: Sequence[str]) -> Interval:
    """Return the highest ratio, over the maps, of the medians of two samples of the same runs, (m,) each."""
    return _highest(lambda rows: np.median(first[rows], axis=-1) / np.median(second[rows], axis=-1), maps)


def _highest(statistic: Callable[[IntArray], Any], maps: Sequence[str]) -> Interval:
    rng = np.random.default_rng(0)
    names = np.array(maps)
    estimates, drawn = [], []
    for name in dict.fromkeys(maps):
        rows = np.flatnonzero(names == name)
        estimates.append(float(statistic(rows)))
        drawn.append(statistic(rng.choice(rows, size=(_RESAMPLES, len(rows)))))
    low, high = np.quantile(np.max(drawn, axis=0), [0.025, 0.975])
    return Interval(max(estimates), float(low), float(high))
