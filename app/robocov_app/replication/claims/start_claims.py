"""Claims on the starts: how much the final cost and placement of RAPF and RPF depend on them."""

import numpy as np

from robocov.typing import FloatArray
from robocov_app.figures.statistics import bootstrap, compute_coefficient_of_variation, group_by
from robocov_app.replication.claims.claim import Claim, Criterion
from robocov_app.replication.claims.gain_claims import build_variation_criteria
from robocov_app.replication.claims.thresholds import BARELY_BY_START, SAME_PLACEMENT
from robocov_app.replication.design.contenders import GAIN_CHOICES, GainChoice
from robocov_app.replication.formatting import format_amount, format_median
from robocov_app.replication.results.outcomes import Outcomes

_MIN_VARIATION = 1e-12
"""Lower bound of a denominator, to avoid a division by zero."""


def judge_starts_cost(outcomes: Outcomes, gains: GainChoice = "shared") -> Claim:
    """Judge whether RAPF's final cost depends less on the starts than RPF's."""
    claim = Claim(
        f"starts-cost-{gains}",
        question=4,
        text="RAPF's final cost barely depends on where the robots start, RPF's does.",
        source="VI-B, figures 6 and 8",
        gains=GAIN_CHOICES[gains],
    )
    keys = (f"rapf-{gains}", f"rpf-{gains}")
    finished = outcomes.select_finite("final", *keys)
    rapf, maps = _compute_start_variation(finished, keys[0])
    rpf, _ = _compute_start_variation(finished, keys[1])
    if not maps:
        return claim
    measure = "median standard deviation of the final cost over the starts, relative to its mean"
    criteria = build_variation_criteria(measure, rapf, rpf, maps, BARELY_BY_START)
    ratio = np.median(rpf) / max(np.median(rapf), _MIN_VARIATION)
    lloyd, _ = _compute_start_variation(outcomes.select_finite("final", "lloyd"), "lloyd")
    explanation = (
        f"Over the same map and seed, from {len(set(finished.starts))} kinds of starts. RPF's varies "
        f"{format_amount(ratio)} times as much as RAPF's. Lloyd's varies by {format_median(lloyd, '%')}."
    )
    return claim.judge(criteria, explanation, finished, runs_per_instance=2)


def judge_starts_placement(outcomes: Outcomes, gains: GainChoice = "shared") -> Claim:
    """Judge whether RAPF's final placement depends less on the starts than RPF's."""
    claim = Claim(
        f"starts-placement-{gains}",
        question=4,
        text="RAPF's final placement varies little with where the robots start, RPF's strongly.",
        source="VI-B, figures 6 and 8",
        gains=GAIN_CHOICES[gains],
    )
    keys = (f"rapf-{gains}", f"rpf-{gains}")
    finished = outcomes.select_finite("final", *keys)
    rapf_spreads = finished.compute_placement_spreads(keys[0])
    rpf_spreads = finished.compute_placement_spreads(keys[1])
    maps = [name for name in rapf_spreads if name in rpf_spreads]
    if not maps:
        return claim
    rapf = np.array([rapf_spreads[name] for name in maps])
    rpf = np.array([rpf_spreads[name] for name in maps])
    sides = [finished.length_scale_by_map[name] for name in maps]
    measure = (
        "distance between matched final positions from different starts, "
        "relative to the side of a square with the mean free area per robot"
    )
    criteria = (
        Criterion(f"RAPF: {measure}", bootstrap(rapf, clusters=maps), high=SAME_PLACEMENT, unit="%"),
        Criterion(
            "median ratio of that distance, RAPF to RPF", bootstrap(rapf / rpf, clusters=maps), high=1.0
        ),
    )
    explanation = (
        f"In meters: RAPF {format_median(rapf * sides, 'm')}, RPF {format_median(rpf * sides, 'm')} "
        f"(medians over maps). "
        f"Robots are matched so that the sum of straight-line distances is smallest. "
        f"A placement can differ while its cost does not: many are equally good."
    )
    return claim.judge(criteria, explanation, finished, runs_per_instance=2)


def _compute_start_variation(outcomes: Outcomes, key: str) -> tuple[FloatArray, list[str]]:
    """Return the coefficients of variation of a contender's final cost over the starts, and their maps.

    There is one coefficient for each map and seed with several starts, (k,).
    """
    finals = zip(outcomes.instances, outcomes.get_values(key, "final"), strict=True)
    groups = group_by(finals, lambda pair: (pair[0].map, pair[0].seed))
    variations = []
    maps = []
    for (name, _), pairs in groups.items():
        if len(pairs) > 1:
            variations.append(compute_coefficient_of_variation([final for _, final in pairs]))
            maps.append(name)
    return np.array(variations), maps
