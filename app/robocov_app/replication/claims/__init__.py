"""The paper's claims, and those beyond it: from the outcomes of many runs to a verdict.

A claim has one or several *criteria* (`claim`): an estimate, its 95% interval, and the range in which it
has to lie. A criterion is met if the whole interval is in that range, refuted if all of it is outside, and
open if it extends over an end of the range. The p-value of a claim is the highest of its criteria
(intersection-union test). Those of the registered claims are adjusted by Holm.

All thresholds (`thresholds`) were set before the study was run. Statistics are medians over problem
instances; the bootstrap samples for their 95% intervals consist of whole maps.

`convex_claims`, `nonconvex_claims`, `gain_claims` and `start_claims` judge the paper's claims, `goals`,
`rivals` and `extensions` those beyond it.
"""

from robocov_app.replication.claims.beyond_claims import judge_beyond_claims
from robocov_app.replication.claims.claim import Claim, Criterion, Verdict, summarize_verdicts
from robocov_app.replication.claims.paper_claims import judge_paper_claims

__all__ = [
    "Claim",
    "Criterion",
    "Verdict",
    "judge_beyond_claims",
    "judge_paper_claims",
    "summarize_verdicts",
]
