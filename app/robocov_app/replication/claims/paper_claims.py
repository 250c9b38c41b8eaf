"""All claims of the paper, with p-values that are adjusted for their number."""

from collections.abc import Mapping

from robocov_app.replication.claims.claim import Claim, adjust_claims
from robocov_app.replication.claims.convex_claims import judge_convex_final, judge_convex_spreading
from robocov_app.replication.claims.gain_claims import (
    judge_gains_choice,
    judge_gains_every,
    judge_gains_result,
    select_common_instances,
)
from robocov_app.replication.claims.nonconvex_claims import (
    judge_against_lloyd,
    judge_against_rpf,
    judge_gap,
    judge_lloyd_unusable,
)
from robocov_app.replication.claims.start_claims import judge_starts_cost, judge_starts_placement
from robocov_app.replication.design.contenders import GAIN_CHOICES
from robocov_app.replication.results.outcomes import GainOutcomes, Outcomes


def judge_paper_claims(
    convex: Outcomes, nonconvex: Outcomes, limited: Outcomes, gains: Mapping[str, GainOutcomes]
) -> list[Claim]:
    """Judge all claims of the paper, each with every choice of gains.

    Parameters
    ----------
    convex, nonconvex, limited : Outcomes
        Outcomes in convex regions, on non-convex maps, and on non-convex maps at limited ranges.
    gains : Mapping
        Outcomes of the gain grids of "rapf" and "rpf".

    Returns
    -------
    list of Claim
    """
    claims = [
        *(judge_convex_final(convex, choice) for choice in GAIN_CHOICES),
        *(judge_convex_spreading(convex, choice) for choice in GAIN_CHOICES),
        *_judge_nonconvex_claims(nonconvex, gains),
        *_judge_limited_claims(limited),
    ]
    return adjust_claims(claims)


def _judge_nonconvex_claims(outcomes: Outcomes, gains: Mapping[str, GainOutcomes]) -> list[Claim]:
    """Judge the claims on non-convex maps."""
    rapf, rpf = select_common_instances(gains["rapf"], gains["rpf"])
    return [
        *(judge_against_rpf(outcomes, choice, "final") for choice in GAIN_CHOICES),
        judge_gains_every(rapf, rpf),
        *(judge_against_rpf(outcomes, choice, "motion") for choice in GAIN_CHOICES),
        judge_gains_result(rapf, rpf),
        judge_gains_choice(rapf, rpf),
        *(judge_starts_cost(outcomes, choice) for choice in GAIN_CHOICES),
        *(judge_starts_placement(outcomes, choice) for choice in GAIN_CHOICES),
        judge_lloyd_unusable(outcomes),
        *(judge_against_lloyd(outcomes, choice) for choice in GAIN_CHOICES),
        *(judge_gap(outcomes, "rapf", choice) for choice in GAIN_CHOICES),
        *(judge_gap(outcomes, "rpf", choice) for choice in GAIN_CHOICES),
        judge_gap(outcomes, "lloyd"),
    ]


def _judge_limited_claims(outcomes: Outcomes) -> list[Claim]:
    """Judge the main claims on non-convex maps at limited ranges."""
    return [
        *(judge_against_rpf(outcomes, choice, "final", limited=True) for choice in GAIN_CHOICES),
        *(judge_against_rpf(outcomes, choice, "motion", limited=True) for choice in GAIN_CHOICES),
        *(judge_against_lloyd(outcomes, choice, limited=True) for choice in GAIN_CHOICES),
        *(judge_gap(outcomes, "rapf", choice, limited=True) for choice in GAIN_CHOICES),
    ]
