"""Goals of our own controller, each a claim with one criterion.

A goal is about the runs of the study: the measured value meets or misses it. Its verdict as a claim says in
addition whether the result could be different on other maps.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from robocov.typing import FloatArray, IntArray
from robocov_app.figures.statistics import (
    Interval,
    bootstrap,
    bootstrap_statistic,
    estimate_fraction,
    estimate_median_time,
)
from robocov_app.replication.claims.claim import GOALS, Claim, Criterion
from robocov_app.replication.claims.explanations import describe_middle_half
from robocov_app.replication.claims.thresholds import (
    MAX_GAP,
    MAX_MAP_GAP,
    MAX_REST_TIME_S,
    MAX_STEP_RATIO,
    MIN_AT_REST,
    NEVER_WORSE,
    RARELY,
)
from robocov_app.replication.design.contenders import Contender, select_strongest
from robocov_app.replication.design.plan import UNSEEN, Plan
from robocov_app.replication.formatting import format_amount
from robocov_app.replication.results.controller_speed import StepTimes
from robocov_app.replication.results.outcomes import Outcomes, PairedComparison

_RESAMPLES = 2000
_LIMIT_QUANTILES = (0.025, 0.975)
"""Quantiles of the resampled values that are the limits of a 95% interval."""


@dataclass(frozen=True)
class _MainCriteria:
    """Criteria on the gap to the reference, on contacts, and on runs that settle."""

    gap: Criterion
    contacts: Criterion
    rest: Criterion


def _build_main_criteria(outcomes: Outcomes, key: str) -> _MainCriteria:
    """Estimate the main measures of a contender, given by its key."""
    gap = bootstrap(outcomes.get_values(key, "gap"), clusters=outcomes.maps)
    contacts = estimate_fraction(outcomes.get_values(key, "contacts") > 0, outcomes.maps)
    rest = estimate_fraction(np.isfinite(outcomes.get_values(key, "settled")), outcomes.maps)
    return _MainCriteria(
        gap=Criterion("median gap", gap, high=MAX_GAP, unit="%"),
        contacts=Criterion("runs with a contact", contacts, high=RARELY, unit="%"),
        rest=Criterion("runs that settle", rest, low=MIN_AT_REST, unit="%"),
    )


def judge_goals(
    outcomes: Outcomes,
    own: Contender,
    contenders: Sequence[Contender],
    steps: Mapping[int, StepTimes],
    plan: Plan,
) -> list[Claim]:
    """Judge the goals of one of our own controllers.

    Parameters
    ----------
    outcomes : Outcomes
        Outcomes of all contenders.
    own : Contender
    contenders : sequence of Contender
        All contenders, including the paper's strongest ones.
    steps : Mapping
        Step times by the number of robots.
    plan : Plan

    Returns
    -------
    list of Claim
        Goals without data are left out.
    """
    goals: list[Claim] = []
    finished = outcomes.select_finite("gap", own.key)
    if finished.instances:
        goals += _judge_gap_goals(outcomes, own, contenders)
        goals += _judge_rest_goals(finished, own, plan)
    return goals + _judge_step_goals(own, steps, plan)


def _build_goal(name: str, text: str, criterion: Criterion, explanation: str, outcomes: Outcomes) -> Claim:
    """Build a goal with its only criterion, and judge it."""
    goal = Claim(f"goal-{name}", GOALS, text)
    return goal.judge((criterion,), explanation, outcomes, runs_per_instance=1)


def _judge_gap_goals(outcomes: Outcomes, own: Contender, contenders: Sequence[Contender]) -> list[Claim]:
    """Judge the median gap of all runs and of each map, and compare with the paper's strongest contenders."""
    key = own.key
    label = own.label
    finished = outcomes.select_finite("gap", key)
    gaps = finished.get_values(key, "gap")

    def compute_median_gaps(rows: IntArray) -> FloatArray:
        return np.asarray(np.median(gaps[rows], axis=-1))

    highest = estimate_maximum_over_maps(compute_median_gaps, finished.maps)
    goals = [
        _build_goal(
            "gap",
            f"{label}'s cost is within {format_amount(MAX_GAP, '%')} of the reference in the median.",
            _build_main_criteria(finished, key).gap,
            describe_middle_half(gaps),
            finished,
        ),
        _build_goal(
            "every-map",
            f"On every map, {label}'s median is within {format_amount(MAX_MAP_GAP, '%')} of the reference.",
            Criterion("highest median of a map", highest, high=MAX_MAP_GAP, unit="%"),
            _describe_highest(finished.compute_medians_by_map(key), MAX_MAP_GAP),
            finished,
        ),
    ]
    for other in select_strongest(contenders):
        pairs = outcomes.compare(key, other.key)
        if pairs is not None:
            goals.append(_judge_comparison(pairs, own, other))
    return goals


def _judge_comparison(pairs: PairedComparison, own: Contender, other: Contender) -> Claim:
    """Judge whether a contender is not much worse than another one on any map."""
    own_medians = pairs.outcomes.compute_medians_by_map(own.key, "final")
    other_medians = pairs.outcomes.compute_medians_by_map(other.key, "final")
    ratios = {name: own_medians[name] / other_medians[name] for name in own_medians}
    margin = format_amount(NEVER_WORSE - 1.0, "%")
    return _build_goal(
        f"not-worse-{other.key}",
        f"On no map is {own.label}'s median more than {margin} above that of {other.label}.",
        Criterion(
            f"highest ratio to the median of {other.label} on a map",
            estimate_worst_ratio(pairs),
            high=NEVER_WORSE,
        ),
        _describe_highest(ratios, NEVER_WORSE),
        pairs.outcomes,
    )


def _judge_rest_goals(finished: Outcomes, own: Contender, plan: Plan) -> list[Claim]:
    """Judge contacts, the fraction of runs that settle, and the median settling time."""
    label = own.label
    criteria = _build_main_criteria(finished, own.key)
    has_contact = finished.get_values(own.key, "contacts") > 0
    settled = finished.get_values(own.key, "settled")
    is_at_rest = np.isfinite(settled)
    censored = np.full(len(is_at_rest), plan.duration)

    def compute_median_time(rows: IntArray) -> float:
        at_rest = is_at_rest[rows]
        return estimate_median_time(settled[rows][at_rest], censored[rows][~at_rest])

    rest_time = bootstrap_statistic(compute_median_time, finished.maps)
    return [
        _build_goal(
            "contacts",
            f"{label} has no contacts.",
            # This goal is about the runs of the study, in which there must be no contact at all.
            replace(criteria.contacts, high=0.0),
            f"{has_contact.sum()} of {len(has_contact)} runs.",
            finished,
        ),
        _build_goal(
            "rest",
            f"{label} settles in at least {format_amount(MIN_AT_REST, '%')} of the runs.",
            criteria.rest,
            f"{(~is_at_rest).sum()} of {len(is_at_rest)} runs do not.",
            finished,
        ),
        _build_goal(
            "time",
            f"{label} settles within {format_amount(MAX_REST_TIME_S, 's')} in the median.",
            Criterion("median settling time", rest_time, high=MAX_REST_TIME_S, unit="s"),
            "Kaplan-Meier: runs that do not settle are censored.",
            finished,
        ),
    ]


def _judge_step_goals(own: Contender, steps: Mapping[int, StepTimes], plan: Plan) -> list[Claim]:
    """Judge the computing time of steps, which is measured separately, on one map."""
    goals = []
    large = steps.get(plan.beyond.large)
    if large is not None:
        ratio = large.compute_ratio(own.controller)
        if math.isfinite(ratio.estimate):
            goals.append(
                Claim(
                    "goal-step",
                    GOALS,
                    f"A step of {own.label} takes at most {MAX_STEP_RATIO:g} times as long as RAPF's with "
                    f"{large.robots} robots.",
                    criteria=(Criterion("time of a step relative to RAPF's", ratio, high=MAX_STEP_RATIO),),
                    explanation="Timed in alternation, over whole seconds of simulated time, "
                    "which include plans and scans.",
                )
            )
    huge = steps.get(plan.beyond.huge)
    if huge is not None:
        factor = huge.compute_real_time_factor(own.controller)
        if math.isfinite(factor.estimate):
            goals.append(
                Claim(
                    "goal-real-time",
                    GOALS,
                    f"{own.label} runs in real time with {huge.robots} robots.",
                    criteria=(Criterion("computing time relative to simulated time", factor, high=1.0),),
                    explanation="One process, including the physics.",
                )
            )
    return [replace(goal, maps=1, min_maps=1) for goal in goals]


def estimate_maximum_over_maps(statistic: Callable[[IntArray], Any], maps: Sequence[str]) -> Interval:
    """Estimate the highest value that a statistic of the runs on a map has on any map.

    The interval is from a bootstrap that resamples the runs on each map, but not the maps.

    Parameters
    ----------
    statistic : callable
        Takes row numbers, (m,) or (k, m), and reduces the last axis to one value.
    maps : sequence of str
        Map of each row.

    Returns
    -------
    Interval
    """
    rng = np.random.default_rng(0)
    names = np.array(maps)
    estimates = []
    resampled = []
    for name in dict.fromkeys(maps):
        rows = np.flatnonzero(names == name)
        estimates.append(float(statistic(rows)))
        resampled.append(statistic(rng.choice(rows, size=(_RESAMPLES, len(rows)))))
    highest = np.max(resampled, axis=0)
    low, high = np.quantile(highest, _LIMIT_QUANTILES).tolist()
    return Interval(max(estimates), low, high, highest)


def estimate_worst_ratio(pairs: PairedComparison) -> Interval:
    """Estimate the highest ratio of the two contenders' medians on any map."""

    def compute_ratio(rows: IntArray) -> Any:
        first = np.median(pairs.first_values[rows], axis=-1)
        return first / np.median(pairs.second_values[rows], axis=-1)

    return estimate_maximum_over_maps(compute_ratio, pairs.outcomes.maps)


def _describe_highest(values: Mapping[str, float], bound: float) -> str:
    """Return a sentence with the map of the highest value, and the number of maps above a bound."""
    above = sum(value > bound for value in values.values())
    highest = max(values, key=values.__getitem__)
    return f"Highest on {highest}; above the bound on {above} of {len(values)} maps."


def is_goal_met(goal: Claim) -> bool:
    """Return whether the measured value of a goal is in the range of its criterion."""
    (criterion,) = goal.criteria
    return criterion.low <= criterion.interval.estimate <= criterion.high


def _describe_miss(goal: Claim) -> str:
    """Return the measured value of a missed goal and its bound, such as "1.8% instead of at most 1.4%"."""
    (criterion,) = goal.criteria
    estimate = format_amount(criterion.interval.estimate, criterion.unit)
    return f"{estimate} instead of {criterion.range_text}"


def describe_goal(goal: Claim) -> str:
    """Return the outcome of a goal, such as "met" or "missed: 1.8% instead of at most 1.4%"."""
    (criterion,) = goal.criteria
    text = "met" if is_goal_met(goal) else f"missed: {_describe_miss(goal)}"
    if criterion.is_met is None and math.isfinite(criterion.interval.low):
        text += "; the interval includes the bound"
    return text


def summarize_goals(goals: Sequence[Claim]) -> str:
    """Return sentences with the number of goals that are met, and the missed goals."""
    if not goals:
        return "Nothing was measured."
    missed = [f"{goal.criteria[0].measure} {_describe_miss(goal)}" for goal in goals if not is_goal_met(goal)]
    summary = f"{len(goals) - len(missed)} of {len(goals)} goals are met."
    if missed:
        summary += f" Missed: {'; '.join(missed)}."
    return summary


def judge_unseen(outcomes: Outcomes, own: Contender, contenders: Sequence[Contender]) -> Claim | None:
    """Judge our own controller on generated maps on which its goals are not judged.

    The families of these maps are those in `UNSEEN`. Our own controller was developed on maps of the
    benchmark, which has the same families, and three of them are also families of the paper's claims.

    Parameters
    ----------
    outcomes : Outcomes
        Outcomes on these maps.
    own : Contender
    contenders : sequence of Contender
        All contenders, including the paper's strongest ones.

    Returns
    -------
    Claim or None
        None if there are no runs.
    """
    finished = outcomes.select_finite("gap", own.key)
    if not finished.instances:
        return None
    main = _build_main_criteria(finished, own.key)
    criteria = [main.gap, main.contacts, main.rest]
    for other in select_strongest(contenders):
        pairs = outcomes.compare(own.key, other.key)
        if pairs is not None:
            measure = f"median of J({own.label}) / J({other.label}) at the end"
            criteria.append(Criterion(measure, pairs.median_ratio, high=1.0))
    medians = finished.compute_medians_by_map(own.key)
    worst = max(medians, key=medians.__getitem__)
    explanation = (
        f"{len(medians)} generated maps, {len(finished.instances)} runs of {own.label}. "
        f"Highest median gap of a map: {format_amount(medians[worst], '%')} ({worst})."
    )
    families = f"{', '.join(UNSEEN[:-1])} and {UNSEEN[-1]}"
    statement = (
        f"On generated {families}, {own.label} meets limits on gap, contacts and settling, "
        "and in the median over runs, its cost is not above that of the paper's strongest controllers in the "
        "same run."
    )
    claim = Claim("goal-unseen", GOALS, statement)
    return claim.judge(criteria, explanation, finished, runs_per_instance=1)
