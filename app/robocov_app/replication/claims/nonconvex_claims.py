"""Claims on RAPF, RPF and Lloyd's algorithm on non-convex maps."""

from typing import Literal

import numpy as np

from robocov.metrics.clearance import MAX_CONTACT_GAP_M
from robocov.typing import FloatArray
from robocov_app.figures.statistics import bootstrap, estimate_fraction
from robocov_app.replication.claims.claim import LIMITED, Claim, Criterion, judge_pairs
from robocov_app.replication.claims.explanations import (
    describe_losses,
    describe_middle_half,
    list_ratios_by_map_kind,
    list_ratios_by_start,
)
from robocov_app.replication.claims.thresholds import (
    CLEARLY_BELOW,
    FAR_FROM_OPTIMUM,
    MOSTLY,
    NEAR_OPTIMUM,
    NEARLY_ALWAYS,
    OFTEN_BLOCKED,
)
from robocov_app.replication.design.contenders import GAIN_CHOICES, LABELS, GainChoice
from robocov_app.replication.design.study_maps import get_map_kind
from robocov_app.replication.formatting import NO_VALUE, format_amount, format_median
from robocov_app.replication.results.outcome_tables import FIRST_MINUTE_S
from robocov_app.replication.results.outcomes import Outcomes

_GAP_CLAIMS = {
    "rapf": ("RAPF's coverage is nearly optimal.", "VII: “to achieve an optimal coverage”"),
    "rpf": ("RPF settles far from the optimum.", "IV and I: “usually far from the optimal”"),
    "lloyd": ("Lloyd's algorithm is nearly optimal although it ignores obstacles.", ""),
}
"""The claim on the gap of each controller, and its source."""


def judge_against_rpf(
    outcomes: Outcomes,
    gains: GainChoice,
    period: Literal["final", "motion"],
    *,
    limited: bool = False,
) -> Claim:
    """Judge whether RAPF's cost is below RPF's.

    Parameters
    ----------
    outcomes : Outcomes
    gains : str
    period : str
        "final" for the cost at the end, "motion" for its average over the first minute.
    limited : bool
        Whether the outcomes are those at limited ranges.
    """
    result = "ends at a lower cost than RPF"
    cost = "the final cost"
    measure = "final"
    if period == "motion":
        result = "has a lower cost than RPF while it moves"
        cost = f"the cost averaged over {FIRST_MINUTE_S:g} s"
        measure = "first_minute"
    return judge_pairs(
        _build_claim(
            f"nonconvex-{period}-{gains}",
            question=2,
            text=f"In a non-convex environment RAPF {result}.",
            source="VI-B, figures 4 to 7",
            gains=gains,
            limited=limited,
        ),
        outcomes.compare(f"rapf-{gains}", f"rpf-{gains}", measure),
        ratio_measure=f"median ratio, RAPF to RPF, of {cost}",
        wins_measure="runs in which RAPF's is lower",
        explain=lambda pairs: (
            f"Median ratio per start: {list_ratios_by_start(pairs)}; per kind of map: "
            f"{list_ratios_by_map_kind(pairs)}. {describe_losses(pairs, 'RAPF')}"
        ),
        max_ratio=CLEARLY_BELOW,
        min_wins=NEARLY_ALWAYS,
    )


def _build_claim(
    key: str, question: int, text: str, source: str, gains: GainChoice | None, *, limited: bool
) -> Claim:
    """Build a claim, or its counterpart at limited ranges."""
    gains_text = GAIN_CHOICES[gains] if gains else ""
    if not limited:
        return Claim(key, question, text, source, gains=gains_text)
    if text.startswith("In "):
        text = f"in {text.removeprefix('In ')}"
    return Claim(f"limited-{key}", LIMITED, f"At limited ranges, {text}", source, gains=gains_text)


def judge_against_lloyd(outcomes: Outcomes, gains: GainChoice = "shared", *, limited: bool = False) -> Claim:
    """Judge whether RAPF's final cost is below that of Lloyd's algorithm."""
    return judge_pairs(
        _build_claim(
            f"nonconvex-lloyd-{gains}",
            question=5,
            text="In a non-convex environment RAPF significantly outperforms Lloyd's algorithm too.",
            source="VII: “significantly outperforms other existing approaches”; the paper shows RPF only",
            gains=gains,
            limited=limited,
        ),
        outcomes.compare(f"rapf-{gains}", "lloyd"),
        ratio_measure="median of J(RAPF) / J(Lloyd) at the end",
        wins_measure="runs in which RAPF's is lower",
        explain=lambda pairs: (
            f"With Lloyd's algorithm, robots slide along obstacles: they touch one in "
            f"{_format_touching_fraction(outcomes, 'lloyd')} of the runs, compared with "
            f"{_format_touching_fraction(outcomes, f'rapf-{gains}')} for RAPF. Median ratio per kind of map: "
            f"{list_ratios_by_map_kind(pairs)}."
        ),
        max_ratio=CLEARLY_BELOW,
    )


def _format_touching_fraction(outcomes: Outcomes, key: str) -> str:
    """Return the fraction of a contender's runs in which a robot touches a wall, as text."""
    clearances = outcomes.select_finite("clearance", key).get_values(key, "clearance")
    return (
        format_amount(float(np.mean(clearances <= MAX_CONTACT_GAP_M)), "%") if len(clearances) else NO_VALUE
    )


def judge_lloyd_unusable(outcomes: Outcomes) -> Claim:
    """Judge whether Lloyd's robots run into obstacles, are blocked by them, and end at a high cost."""
    claim = Claim(
        "lloyd-unusable",
        question=5,
        text=(
            "Lloyd's algorithm is unusable in the presence of obstacles: its robots run into them and "
            "get stuck."
        ),
        source="I and IV",
    )
    finished = outcomes.select_finite("blocked", "lloyd")
    if not finished.instances:
        return claim
    is_touching = finished.get_values("lloyd", "clearance") <= MAX_CONTACT_GAP_M
    touching = estimate_fraction(is_touching, finished.maps)
    blocked_fractions = finished.get_values("lloyd", "blocked")
    blocked = bootstrap(blocked_fractions, "mean", finished.maps)
    criteria = [
        Criterion("Lloyd's runs in which a robot touches a wall", touching, low=MOSTLY, unit="%"),
        Criterion("Lloyd's robots that are blocked at the end", blocked, low=OFTEN_BLOCKED, unit="%"),
    ]
    with_gap = finished.select_finite("gap", "lloyd")
    if with_gap.instances:
        gap = bootstrap(with_gap.get_values("lloyd", "gap"), clusters=with_gap.maps)
        criteria.append(Criterion("Lloyd: median gap", gap, low=FAR_FROM_OPTIMUM, unit="%"))
    others = []
    for gains in GAIN_CHOICES:
        key = f"rapf-{gains}"
        values = outcomes.select_finite("blocked", key).get_values(key, "blocked")
        if len(values):
            touching_text = _format_touching_fraction(outcomes, key)
            blocked_text = format_amount(float(values.mean()), "%")
            others.append(
                f"{LABELS[key]}: walls touched in {touching_text}, {blocked_text} of the robots blocked"
            )
    explanation = (
        f"{'; '.join(others)}. A robot is blocked if a wall is on the straight line between it and its goal "
        f"at the end of the run."
    )
    return claim.judge(criteria, explanation, finished, runs_per_instance=1)


def judge_gap(
    outcomes: Outcomes,
    controller: Literal["rapf", "rpf", "lloyd"],
    gains: GainChoice | None = None,
    *,
    limited: bool = False,
) -> Claim:
    """Judge the gap to the reference, which is claimed to be large for RPF, and small for the others.

    Parameters
    ----------
    outcomes : Outcomes
    controller : str
    gains : str or None
        None for Lloyd's algorithm, which has none.
    limited : bool
        Whether the outcomes are those at limited ranges.
    """
    text, source = _GAP_CLAIMS[controller]
    key = f"{controller}-{gains}" if gains else controller
    claim = _build_claim(f"gap-{key}", question=6, text=text, source=source, gains=gains, limited=limited)
    finished = outcomes.select_finite("gap", key)
    if not finished.instances:
        return claim
    gaps = finished.get_values(key, "gap")
    measure = f"{LABELS[key]}: median gap"
    interval = bootstrap(gaps, clusters=finished.maps)
    if controller == "rpf":
        criterion = Criterion(measure, interval, low=FAR_FROM_OPTIMUM, unit="%")
    else:
        criterion = Criterion(measure, interval, high=NEAR_OPTIMUM, unit="%")
    return claim.judge((criterion,), _explain_gaps(finished, gaps), finished, runs_per_instance=1)


def _explain_gaps(outcomes: Outcomes, gaps: FloatArray) -> str:
    """Return sentences on the distribution of gaps, (m,), one for each instance."""
    beaten = ""
    if (gaps < 0).any():
        fraction = format_amount((gaps < 0).mean(), "%")
        beaten = f", and was beaten in {fraction} of the runs"
    kinds = np.array([get_map_kind(name) for name in outcomes.maps])
    medians = [f"{kind} {format_median(gaps[kinds == kind], '%')}" for kind in dict.fromkeys(kinds.tolist())]
    worst = int(np.argmax(gaps))
    return (
        f"{describe_middle_half(gaps).removesuffix('.')}; the worst is {format_amount(gaps.max(), '%')} "
        f"({outcomes.instances[worst]}). Medians per kind of map: {', '.join(medians)}. "
        f"The reference is the best of many descents with the whole map known; it is not a "
        f"bound, but hard to beat{beaten}."
    )
