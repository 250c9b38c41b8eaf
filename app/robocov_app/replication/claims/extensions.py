"""Claims on extensions of the paper: targets, density, mixed teams, disturbances."""

import math
from collections.abc import Iterable
from dataclasses import replace

from robocov_app.replication.claims.claim import EXTENSIONS, Claim, Criterion, judge_pairs
from robocov_app.replication.claims.thresholds import CLEARLY_BELOW, NEARLY_SAME, SAME_COST, TOLERATED
from robocov_app.replication.design.contenders import TARGETS, TEAMS
from robocov_app.replication.formatting import capitalize, format_amount, format_median
from robocov_app.replication.results.outcomes import Outcomes
from robocov_app.replication.results.study_results import Degradation


def judge_targets(outcomes: Outcomes) -> Claim:
    """Judge whether the final cost of RAPF depends on the kind of target in the cells."""
    claim = Claim(
        "targets",
        EXTENSIONS,
        "Whether RAPF moves to the centroid of its cell, its geometric median or the best position of a "
        "sensor makes no difference to the coverage cost.",
    )
    centroid = TARGETS[0]
    pairs = []
    for target in TARGETS[1:]:
        comparison = outcomes.compare(target.key, centroid.key)
        if comparison is not None:
            pairs.append(comparison)
    if not pairs:
        return claim
    criteria = []
    wins = []
    for comparison in pairs:
        measure = f"median of J({comparison.first}) / J(centroid) at the end"
        criteria.append(
            Criterion(measure, comparison.median_ratio, low=1.0 - SAME_COST, high=1.0 + SAME_COST)
        )
        fraction = format_amount(comparison.wins.estimate, "%")
        wins.append(f"{comparison.first} lower in {fraction} of the runs")
    explanation = f"{capitalize('; '.join(wins))}."
    runs = sum(2 * len(comparison.outcomes.instances) for comparison in pairs)
    # The comparisons may have different numbers of runs, so the number is replaced by their sum.
    judged = claim.judge(criteria, explanation, pairs[-1].outcomes, runs_per_instance=1)
    return replace(judged, runs=runs)


def judge_density(outcomes: Outcomes) -> Claim:
    """Judge whether RAPF ends at a lower weighted cost if it knows the density."""
    return judge_pairs(
        Claim(
            "density",
            EXTENSIONS,
            "With a density, RAPF ends at a clearly lower weighted cost if it knows the density.",
        ),
        outcomes.compare("known", "ignored"),
        ratio_measure="median ratio of the mean distance weighted by φ",
        wins_measure="runs in which it is lower",
        explain=lambda _: (
            "Both are rated by the same φ: two Gaussians of 1 m on every map, 20 high on a floor of 1, "
            "at random positions of the free space."
        ),
        max_ratio=CLEARLY_BELOW,
    )


def judge_teams(outcomes: Outcomes, controller: str) -> Claim:
    """Judge whether a team of mixed speeds reaches points sooner with cells by time than by distance."""
    by_distance, by_time = [contender for contender in TEAMS if contender.controller == controller]
    label = by_time.label.partition(",")[0]
    return judge_pairs(
        Claim(
            f"teams-{controller}",
            EXTENSIONS,
            f"In a mixed team, {label} reaches points sooner on average with cells by time than by distance.",
        ),
        outcomes.compare(by_time.key, by_distance.key, "time"),
        ratio_measure="median of the mean time with cells by time / with cells by distance",
        wins_measure="runs in which it is lower",
        explain=lambda pairs: (
            f"Median of the mean time until the first robot arrives: "
            f"{format_median(pairs.second_values, 's')} "
            f"with cells by distance, {format_median(pairs.first_values, 's')} by time. "
            f"Of the six robots, two each have a maximum speed of 1, 0.5 and 0.25 m/s."
        ),
    )


def judge_conditions(degradations: Iterable[Degradation], maps: int) -> Claim:
    """Judge whether RAPF tolerates lost messages and late messages.

    Parameters
    ----------
    degradations : iterable of Degradation
    maps : int
        Number of maps of these runs.
    """
    claim = Claim(
        "conditions",
        EXTENSIONS,
        f"RAPF ends within {format_amount(NEARLY_SAME, '%')} of its cost if messages are lost or late.",
    )
    rapf = [
        degradation
        for degradation in degradations
        if degradation.controller == "rapf" and math.isfinite(degradation.ratio.estimate)
    ]
    by_value = {(degradation.axis, degradation.value): degradation for degradation in rapf}
    criteria = []
    runs = 0
    for disturbance, description in TOLERATED:
        degradation = by_value.get(disturbance)
        if degradation is not None:
            measure = f"final cost if {description}, relative to that under ideal conditions"
            criteria.append(Criterion(measure, degradation.ratio, high=1.0 + NEARLY_SAME))
            runs += 2 * degradation.runs
    if not criteria:
        return claim
    worst = max(rapf, key=lambda degradation: degradation.ratio.estimate)
    highest = format_amount(worst.ratio.estimate)
    axis = worst.axis.replace("_", " ")
    value = "none" if worst.value is None else f"{worst.value:g}"
    return replace(
        claim,
        criteria=tuple(criteria),
        runs=runs,
        maps=maps,
        explanation=f"The highest of all medians is {highest}, with {axis} {value}.",
    )
