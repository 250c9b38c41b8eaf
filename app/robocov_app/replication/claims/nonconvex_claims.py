"""Claims on RAPF, RPF and Lloyd's algorithm on non-convex maps."""

from typing import Literal

import numpy as np

from robocov.arrays import Array
from robocov_app.figures.statistics import bootstrap, estimate_fraction
from robocov_app.replication.claims.claim import Claim, Criterion, judge_pairs
from robocov_app.replication.claims.convex_claims import describe_other_gains
from robocov_app.replication.claims.explanations import (
    compute_positive_fraction,
    describe_losses,
    describe_middle_half,
    list_ratios_by_start,
)
from robocov_app.replication.claims.thresholds import (
    CLEARLY_BELOW,
    FAR_FROM_OPTIMUM,
    NEAR_OPTIMUM,
    NEARLY_ALWAYS,
)
from robocov_app.replication.design.contenders import LABELS
from robocov_app.replication.formatting import format_amount, format_median
from robocov_app.replication.results.outcome_tables import FIRST_MINUTE_S
from robocov_app.replication.results.outcomes import Outcomes

_MIN_STUCK_FRACTION = 0.5
_GAP_CLAIMS = {
    "rapf-shared": ("RAPF's coverage is nearly optimal.", "VII: “to achieve an optimal coverage”"),
    "rpf-shared": ("RPF settles far from the optimum.", "IV and I: “usually far from the optimal”"),
    "lloyd": ("Lloyd's algorithm is nearly optimal although it ignores obstacles.", ""),
}
"""The claim on the gap of each contender, and its source."""


def judge_against_rpf(
    outcomes: Outcomes, gains: Literal["shared", "best"], period: Literal["final", "motion"]
) -> Claim:
    """Judge whether RAPF's cost is below RPF's.

    Parameters
    ----------
    outcomes : Outcomes
    gains : str
        "shared" for equal gains, "best" for the best gains of each controller.
    period : str
        "final" for the cost at the end, "motion" for its average over the first minute.
    """
    gains_text = "with the same potential parameters" if gains == "shared" else "each with its own best gains"
    result = "ends at a lower cost than RPF"
    cost = "the final cost"
    measure = "final"
    if period == "motion":
        result = "has a lower cost than RPF while it moves"
        cost = f"the cost averaged over {FIRST_MINUTE_S:g} s"
        measure = "first_minute"
    return judge_pairs(
        Claim(
            f"nonconvex-{period}-{gains}",
            2,
            f"In a non-convex environment RAPF {result}, {gains_text}.",
            "VI-B, figures 4 to 7",
        ),
        outcomes.compare(f"rapf-{gains}", f"rpf-{gains}", measure),
        ratio_measure=f"median ratio, RAPF to RPF, of {cost}",
        wins_measure="runs in which RAPF's is lower",
        explain=lambda pairs: (
            f"Median ratio per start: {list_ratios_by_start(pairs)}. {describe_losses(pairs, 'RAPF')}"
        ),
        max_ratio=CLEARLY_BELOW,
        min_wins=NEARLY_ALWAYS,
    )


def judge_against_lloyd(outcomes: Outcomes) -> Claim:
    """Judge whether RAPF's final cost is below that of Lloyd's algorithm."""
    return judge_pairs(
        Claim(
            "nonconvex-lloyd",
            5,
            "In a non-convex environment RAPF significantly outperforms Lloyd's algorithm too.",
            "VII: “significantly outperforms other existing approaches”; the paper shows RPF only",
        ),
        outcomes.compare("rapf-shared", "lloyd"),
        ratio_measure="median of J(RAPF) / J(Lloyd) at the end",
        wins_measure="runs in which RAPF's is lower",
        explain=lambda _: f"Lloyd's robots slide here along obstacles. {describe_other_gains(outcomes)}",
        max_ratio=CLEARLY_BELOW,
    )


def judge_lloyd_stuck(outcomes: Outcomes) -> Claim:
    """Judge whether robots get stuck at obstacles with Lloyd's algorithm."""
    claim = Claim(
        "lloyd-stuck",
        5,
        "Lloyd's algorithm is unusable in the presence of obstacles: its robots get stuck.",
        "I and IV",
    )
    finished = outcomes.select_finite("stuck", "lloyd")
    if not finished.instances:
        return claim
    counts = finished.get_values("lloyd", "stuck")
    stuck = estimate_fraction(counts > 0, finished.maps)
    criteria = [
        Criterion("Lloyd's runs that end with a stuck robot", stuck, low=_MIN_STUCK_FRACTION, unit="%")
    ]
    with_gap = finished.select_finite("gap", "lloyd")
    if with_gap.instances:
        gap = bootstrap(with_gap.get_values("lloyd", "gap"), clusters=with_gap.maps)
        criteria.append(Criterion("Lloyd: median of J/J_ref - 1", gap, low=FAR_FROM_OPTIMUM, unit="%"))
    others = []
    for key in ("rapf-shared", "rapf-best", "rapf-default"):
        fraction = compute_positive_fraction(outcomes.get_values(key, "stuck"))
        others.append(f"{LABELS[key]} {format_amount(fraction, '%')}")
    explanation = (
        f"On average {format_amount(counts.mean())} robots are stuck in a run. "
        f"Runs with a stuck robot of other controllers: {', '.join(others)}. "
        f"Stuck: the goal is more than 0.5 m away and the robot moved less than 0.05 m in the last 5 s."
    )
    return claim.judge(criteria, explanation, finished, runs_per_instance=1)


def judge_gap(outcomes: Outcomes, key: str) -> Claim:
    """Judge the gap of a contender to the reference: RPF's is claimed to be large, that of others small."""
    text, source = _GAP_CLAIMS[key]
    claim = Claim(f"gap-{key.removesuffix('-shared')}", 6, text, source)
    finished = outcomes.select_finite("gap", key)
    if not finished.instances:
        return claim
    gaps = finished.get_values(key, "gap")
    measure = f"{LABELS[key]}: median of J/J_ref - 1"
    interval = bootstrap(gaps, clusters=finished.maps)
    if key == "rpf-shared":
        criterion = Criterion(measure, interval, low=FAR_FROM_OPTIMUM, unit="%")
    else:
        criterion = Criterion(measure, interval, high=NEAR_OPTIMUM, unit="%")
    return claim.judge((criterion,), _explain_gaps(finished, gaps), finished, runs_per_instance=1)


def _explain_gaps(outcomes: Outcomes, gaps: Array) -> str:
    """Return sentences on the distribution of gaps, (m,), one for each instance."""
    better_than_reference = ""
    if (gaps < 0).any():
        fraction = format_amount((gaps < 0).mean(), "%")
        better_than_reference = f", and was beaten in {fraction} of the runs"
    # Bundled maps are larger and more difficult, so they are listed separately.
    is_generated = np.array([name.startswith("generated-") for name in outcomes.maps], dtype=bool)
    medians = []
    for kind, kind_gaps in (("generated", gaps[is_generated]), ("bundled", gaps[~is_generated])):
        if len(kind_gaps):
            medians.append(f"on {kind} maps {format_median(kind_gaps, '%')}")
    worst = int(np.argmax(gaps))
    return (
        f"{describe_middle_half(gaps).removesuffix('.')}; the worst is {format_amount(gaps.max(), '%')} "
        f"above it ({outcomes.instances[worst]}). Medians: {', '.join(medians)}. "
        f"J_ref is the best of many descents with the whole map known; it is not a bound, "
        f"but hard to beat{better_than_reference}."
    )
