"""All claims, asked of what the runs gave."""

from __future__ import annotations

from typing import TYPE_CHECKING

from robocov_app.replication import claims
from robocov_app.replication.gain_claims import gains_choice, gains_result
from robocov_app.replication.maps import CONVEX_KINDS

if TYPE_CHECKING:
    from collections.abc import Mapping

    from robocov_app.replication.outcomes import GainOutcomes, Outcomes
    from robocov_app.replication.verdicts import Claim

CLUSTERED = CONVEX_KINDS[:-1]
"""Starts in convex regions in which the robots are close together."""

QUESTIONS = {
    1: "In convex regions: does RAPF do as well as Lloyd's algorithm, and spread faster?",
    2: "In non-convex environments: is RAPF better than RPF?",
    3: "Does RAPF's result depend on the gains?",
    4: "Does RAPF's result depend on the starts?",
    5: "Lloyd's algorithm in non-convex environments: how often are robots stuck?",
    6: "How far are they from what a team could reach that knew the map?",
}
"""The six questions that the claims belong to."""


def asked(convex: Outcomes, nonconvex: Outcomes, gains: Mapping[str, GainOutcomes]) -> tuple[Claim, ...]:
    """Return all claims with what the runs say of them, question by question.

    Parameters
    ----------
    convex, nonconvex : Outcomes
        Of the convex regions and of the non-convex maps.
    gains : dict of controller to GainOutcomes
        Of RAPF and RPF.
    """
    return (
        claims.convex_final(convex),
        claims.convex_spreading(convex, CLUSTERED),
        claims.nonconvex(nonconvex, "shared", "final"),
        claims.nonconvex(nonconvex, "best", "final"),
        claims.nonconvex(nonconvex, "shared", "motion"),
        claims.nonconvex(nonconvex, "best", "motion"),
        gains_result(gains["rapf"], gains["rpf"]),
        gains_choice(gains["rapf"], gains["rpf"]),
        claims.starts_cost(nonconvex),
        claims.starts_placement(nonconvex),
        claims.stuck(nonconvex),
        claims.outperforms_lloyd(nonconvex),
        claims.gap_to_reference(nonconvex, "rapf-shared"),
        claims.gap_to_reference(nonconvex, "rpf-shared"),
        claims.gap_to_reference(nonconvex, "lloyd"),
    )
