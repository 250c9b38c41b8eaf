"""Claims on our own controller compared with all others."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from robocov.controllers import get_information, load_controller_class
from robocov.typing import IntArray
from robocov_app.figures.statistics import bootstrap_statistic
from robocov_app.replication.claims.claim import RIVALS, Claim, Criterion, judge_pairs
from robocov_app.replication.claims.explanations import describe_losses
from robocov_app.replication.claims.thresholds import MIN_CLOSED_FRACTION
from robocov_app.replication.design.contenders import OURS, PAPER, Contender, select_strongest
from robocov_app.replication.formatting import format_median
from robocov_app.replication.results.outcomes import Outcomes


def judge_rivals(outcomes: Outcomes, own: Contender, contenders: Sequence[Contender]) -> list[Claim]:
    """Judge, for each other controller, whether our own controller ends at a lower cost.

    Parameters
    ----------
    outcomes : Outcomes
        Outcomes of all contenders.
    own : Contender
    contenders : sequence of Contender

    Returns
    -------
    list of Claim
    """
    strongest = select_strongest(contenders)
    claims = []
    if strongest:
        claims.append(judge_closed_gap(outcomes, own, strongest[0]))
    others = [contender for contender in contenders if contender.controller not in (*PAPER, *OURS)]
    for other in (*strongest, *others):
        information = get_information(load_controller_class(other.controller))
        text = f"{own.label} ends at a lower cost than {other.label}"
        text += "." if information == "own" else f", which uses the {information}."
        claims.append(
            judge_pairs(
                Claim(f"beyond-{own.key}-{other.key}", RIVALS, text),
                outcomes.compare(own.key, other.key),
                ratio_measure=f"median of J({own.label}) / J({other.label}) at the end",
                wins_measure=f"runs in which {own.label}'s is lower",
                explain=lambda pairs: describe_losses(pairs, "It"),
            )
        )
    return claims


def judge_closed_gap(outcomes: Outcomes, own: Contender, other: Contender) -> Claim:
    """Judge whether our own controller closes most of the gap that another one leaves to the reference."""
    claim = Claim(
        f"beyond-{own.key}-closes",
        RIVALS,
        f"{own.label} closes most of the gap that {other.label} leaves to the reference.",
    )
    finished = outcomes.select_finite("gap", own.key, other.key)
    if not finished.instances:
        return claim
    own_gaps = finished.get_values(own.key, "gap")
    other_gaps = finished.get_values(other.key, "gap")

    def compute_closed_fraction(rows: IntArray) -> float:
        other_gap = float(np.median(other_gaps[rows]))
        if other_gap <= 0.0:
            return float("nan")
        return 1.0 - float(np.median(own_gaps[rows])) / other_gap

    if math.isnan(compute_closed_fraction(np.arange(len(own_gaps)))):
        return replace(claim, explanation=f"{other.label} leaves no gap that could be closed.")
    closed = bootstrap_statistic(compute_closed_fraction, finished.maps)
    explanation = (
        f"Median gaps in the same runs: {format_median(own_gaps, '%')} and {format_median(other_gaps, '%')}."
    )
    criterion = Criterion(
        "fraction of the median gap that is closed", closed, low=MIN_CLOSED_FRACTION, unit="%"
    )
    return claim.judge((criterion,), explanation, finished, runs_per_instance=2)
