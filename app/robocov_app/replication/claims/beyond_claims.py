"""All claims beyond the paper."""

from robocov_app.replication.claims.claim import Claim, adjust_claims
from robocov_app.replication.claims.extensions import (
    judge_conditions,
    judge_density,
    judge_targets,
    judge_teams,
)
from robocov_app.replication.claims.goals import judge_goals, judge_unseen
from robocov_app.replication.claims.rivals import judge_rivals
from robocov_app.replication.design.contenders import OWN
from robocov_app.replication.results.study_results import BeyondResults


def judge_beyond_claims(results: BeyondResults) -> tuple[Claim, ...]:
    """Judge all claims beyond the paper: our goals, comparisons with rivals, and extensions.

    The p-values of the claims of each of these three questions are adjusted for their number.

    Parameters
    ----------
    results : BeyondResults

    Returns
    -------
    tuple of Claim
    """
    own = OWN[0]
    goals = judge_goals(results.outcomes, own, results.contenders, results.steps, results.plan)
    if results.unseen is not None:
        unseen = judge_unseen(results.unseen, own, results.contenders)
        if unseen is not None:
            goals.append(unseen)
    rivals = judge_rivals(results.outcomes, own, results.contenders)
    extensions = [
        judge_targets(results.targets),
        judge_density(results.density.outcomes),
        judge_teams(results.teams, "rapf"),
        judge_teams(results.teams, "lloyd"),
        judge_conditions(results.degradations, len(results.plan.beyond.conditions_maps)),
    ]
    return (*adjust_claims(goals), *adjust_claims(rivals), *adjust_claims(extensions))
