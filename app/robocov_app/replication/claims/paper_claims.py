"""All claims of the paper, with Holm-adjusted p-values of the registered ones."""

from collections.abc import Mapping
from dataclasses import replace

from robocov_app.figures.statistics import adjust_p_values
from robocov_app.replication.claims.claim import Claim
from robocov_app.replication.claims.convex_claims import judge_convex_final, judge_convex_spreading
from robocov_app.replication.claims.gain_claims import (
    judge_gains_choice,
    judge_gains_result,
    select_common_instances,
)
from robocov_app.replication.claims.nonconvex_claims import (
    judge_against_lloyd,
    judge_against_rpf,
    judge_gap,
    judge_lloyd_stuck,
)
from robocov_app.replication.claims.start_claims import judge_starts_cost, judge_starts_placement
from robocov_app.replication.claims.thresholds import REGISTERED
from robocov_app.replication.results.outcomes import GainOutcomes, Outcomes


def judge_paper_claims(
    convex: Outcomes, nonconvex: Outcomes, gains: Mapping[str, GainOutcomes]
) -> list[Claim]:
    """Judge all claims of the paper.

    Parameters
    ----------
    convex, nonconvex : Outcomes
        Outcomes in convex regions, and on non-convex maps.
    gains : Mapping
        Outcomes of the gain grids of "rapf" and "rpf".

    Returns
    -------
    list of Claim
    """
    rapf, rpf = select_common_instances(gains["rapf"], gains["rpf"])
    claims = [
        judge_convex_final(convex),
        judge_convex_spreading(convex),
        judge_against_rpf(nonconvex, "shared", "final"),
        judge_against_rpf(nonconvex, "best", "final"),
        judge_against_rpf(nonconvex, "shared", "motion"),
        judge_against_rpf(nonconvex, "best", "motion"),
        judge_gains_result(rapf, rpf),
        judge_gains_choice(rapf, rpf),
        judge_starts_cost(nonconvex),
        judge_starts_placement(nonconvex),
        judge_lloyd_stuck(nonconvex),
        judge_against_lloyd(nonconvex),
        judge_gap(nonconvex, "rapf-shared"),
        judge_gap(nonconvex, "rpf-shared"),
        judge_gap(nonconvex, "lloyd"),
    ]
    adjusted = adjust_p_values({claim.key: claim.p_value for claim in claims if claim.key in REGISTERED})
    return [replace(claim, adjusted_p_value=adjusted.get(claim.key)) for claim in claims]
