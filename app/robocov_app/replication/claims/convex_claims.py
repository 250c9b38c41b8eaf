"""Claims on RAPF and Lloyd's algorithm in convex regions."""

import numpy as np

from robocov_app.figures.statistics import estimate_fraction
from robocov_app.replication.claims.claim import Claim, Criterion, judge_pairs
from robocov_app.replication.claims.explanations import list_ratios_by_start
from robocov_app.replication.claims.thresholds import CLUSTERED, NEARLY_ALWAYS, NEARLY_SAME, SAME_COST
from robocov_app.replication.design.contenders import GAIN_CHOICES, GainChoice
from robocov_app.replication.formatting import format_amount
from robocov_app.replication.results.outcome_tables import EARLY_S
from robocov_app.replication.results.outcomes import Outcomes


def judge_convex_final(outcomes: Outcomes, gains: GainChoice = "shared") -> Claim:
    """Judge whether RAPF ends at the same cost as Lloyd's algorithm in convex regions."""
    claim = Claim(
        f"convex-final-{gains}",
        question=1,
        text="In a convex region RAPF ends at the same cost as Lloyd's algorithm.",
        source="VI-A, figures 2 and 3",
        gains=GAIN_CHOICES[gains],
    )
    pairs = outcomes.compare(f"rapf-{gains}", "lloyd")
    if pairs is None:
        return claim
    nearly_same = estimate_fraction(np.abs(pairs.ratios - 1.0) <= NEARLY_SAME, pairs.outcomes.maps)
    criteria = (
        Criterion(
            "median of J(RAPF) / J(Lloyd) at the end",
            pairs.median_ratio,
            low=1.0 - SAME_COST,
            high=1.0 + SAME_COST,
        ),
        Criterion(
            f"runs that end within {format_amount(NEARLY_SAME, '%')} of Lloyd",
            nearly_same,
            low=NEARLY_ALWAYS,
            unit="%",
        ),
    )
    lowest = format_amount(pairs.ratios.min())
    highest = format_amount(pairs.ratios.max())
    wins = format_amount(pairs.wins.estimate, "%")
    explanation = (
        f"The ratio lies between {lowest} and {highest}, and is below 1 in {wins} of the runs; Lloyd ends in "
        f"one of several centroidal tessellations of the region."
    )
    return claim.judge(criteria, explanation, pairs.outcomes, runs_per_instance=2)


def judge_convex_spreading(outcomes: Outcomes, gains: GainChoice = "shared") -> Claim:
    """Judge whether RAPF spreads faster than Lloyd's algorithm from starts close together."""
    measure = f"mean distance over the first {EARLY_S:g} s"
    return judge_pairs(
        Claim(
            f"convex-spreading-{gains}",
            question=1,
            text=(
                "From starts close together RAPF spreads faster over a convex region than Lloyd's algorithm."
            ),
            source="VI-A",
            gains=GAIN_CHOICES[gains],
        ),
        outcomes.select_starts(*CLUSTERED).compare(f"rapf-{gains}", "lloyd", "early"),
        ratio_measure=f"median ratio, RAPF to Lloyd, of the {measure}",
        wins_measure=f"runs in which RAPF's {measure} is lower",
        explain=lambda pairs: (
            f"Per start: {list_ratios_by_start(pairs)}. The paper itself concludes that “the improvement of "
            f"RAPF is negligible” in convex regions, after having called it “quite better” from close starts."
        ),
    )
