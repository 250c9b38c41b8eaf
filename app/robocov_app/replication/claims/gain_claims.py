"""Claims on the gains of RAPF and RPF: how much the result depends on them, and the best ones on the map."""

import numpy as np

from robocov.typing import FloatArray, IntArray
from robocov_app.figures.statistics import (
    RESAMPLES,
    bootstrap,
    bootstrap_statistic,
    compute_coefficient_of_variation,
)
from robocov_app.replication.claims.claim import Claim, Criterion
from robocov_app.replication.claims.thresholds import BARELY, REGRET
from robocov_app.replication.design.contenders import format_potential
from robocov_app.replication.formatting import format_amount, format_median
from robocov_app.replication.results.outcomes import GainOutcomes

_MIN_VARIATION = 1e-12
"""Lower bound of a denominator, to avoid a division by zero."""


def judge_gains_result(rapf: GainOutcomes, rpf: GainOutcomes) -> Claim:
    """Judge whether RAPF's final cost depends less on its gains than RPF's.

    Parameters
    ----------
    rapf, rpf : GainOutcomes
        Outcomes on the same problem instances, without failed runs.
    """
    claim = Claim(
        "gains-result",
        question=3,
        text="RAPF's final cost barely depends on the gains, RPF's does.",
        source="VI-B: “by using the RAPF, it is almost independent”",
    )
    if not rapf.instances:
        return claim
    rapf_variation = compute_variation(rapf)
    rpf_variation = compute_variation(rpf)
    ratios = rapf_variation / np.maximum(rpf_variation, _MIN_VARIATION)
    measure = "median standard deviation of the final cost over the gains, relative to its mean"
    criteria = (
        *build_variation_criteria(measure, rapf_variation, rpf_variation, rapf.maps, BARELY),
        Criterion(
            "median ratio of that deviation, RAPF to RPF", bootstrap(ratios, clusters=rapf.maps), high=1.0
        ),
    )
    rapf_worst = format_median(compute_worst_by_best(rapf))
    rpf_worst = format_median(compute_worst_by_best(rpf))
    explanation = (
        f"{len(rapf.gains)} sets of gains for RAPF and {len(rpf.gains)} for RPF. "
        f"Median ratio of the worst to the best set: RAPF {rapf_worst}, RPF {rpf_worst}. "
        f"RAPF at one attraction: {_describe_attractions(rapf)}."
    )
    return claim.judge(criteria, explanation, rapf, runs_per_instance=len(rapf.gains) + len(rpf.gains))


def _describe_attractions(rapf: GainOutcomes) -> str:
    """Return the variation of RAPF's cost over the gains of the repulsion, for each attraction."""
    texts = []
    for level in rapf.list_levels("k_att"):
        part = rapf.select_gain("k_att", level)
        if len(part.gains) > 1:
            variation = format_median(compute_variation(part), "%")
            worst = format_median(compute_worst_by_best(part))
            texts.append(f"k_att = {level:g}: {variation}, worst/best {worst}")
    return "; ".join(texts)


def judge_gains_every(rapf: GainOutcomes, rpf: GainOutcomes) -> Claim:
    """Judge whether RAPF ends below RPF with the same potential parameters, whichever they are.

    The claims with the shared gains compare one set of parameters, which the study chose. Here, every set of
    the grid counts.

    Parameters
    ----------
    rapf, rpf : GainOutcomes
        Outcomes on the same problem instances, without failed runs.
    """
    claim = Claim(
        "gains-every",
        question=2,
        text=(
            "In a non-convex environment RAPF ends at a lower cost than RPF with the same potential "
            "parameters, whichever set of the grid is used."
        ),
        source="VI, “the same values for the parameters of the potentials”",
        gains="every set of the grid",
    )
    if not rapf.instances:
        return claim
    ratios = compute_ratios_by_set(rapf, rpf)

    def compute_highest_median(rows: IntArray) -> float:
        return float(np.median(ratios[:, rows], axis=1).max())

    highest = bootstrap_statistic(compute_highest_median, rapf.maps, resamples=RESAMPLES)
    criterion = Criterion("highest median ratio of a set, RAPF to RPF", highest, high=1.0)
    medians = np.median(ratios, axis=1)
    explanation = (
        f"{len(medians)} sets with the same k_rep and rho_0 for both. Their median ratios lie between "
        f"{format_amount(medians.min())} and {format_amount(medians.max())}. The highest is that of "
        f"{format_potential(rapf.gains[int(np.argmax(medians))])}."
    )
    return claim.judge((criterion,), explanation, rapf, runs_per_instance=len(rapf.gains) + len(rpf.gains))


def compute_ratios_by_set(rapf: GainOutcomes, rpf: GainOutcomes) -> FloatArray:
    """Return RAPF's cost divided by RPF's with the same potential, for each set of RAPF's gains, (g, m)."""
    rows = {(gains["k_rep"], gains["rho_0"]): row for row, gains in enumerate(rpf.gains)}
    matching_rows = [rows[gains["k_rep"], gains["rho_0"]] for gains in rapf.gains]
    return np.asarray(rapf.relative_costs / rpf.relative_costs[matching_rows])


def build_variation_criteria(
    measure: str, rapf: FloatArray, rpf: FloatArray, maps: tuple[str, ...] | list[str], bound: float
) -> tuple[Criterion, Criterion]:
    """Build the criteria that a variation is below a bound for RAPF and above it for RPF.

    Parameters
    ----------
    measure : str
        Description of the variation.
    rapf, rpf : (m,) arrays
        Variations of RAPF and of RPF.
    maps : sequence of str
        Map of each value.
    bound : float
        Upper bound for RAPF, and lower bound for RPF.
    """
    return (
        Criterion(f"RAPF: {measure}", bootstrap(rapf, clusters=maps), high=bound, unit="%"),
        Criterion("RPF: the same", bootstrap(rpf, clusters=maps), low=bound, unit="%"),
    )


def judge_gains_choice(rapf: GainOutcomes, rpf: GainOutcomes) -> Claim:
    """Judge whether the best gains depend on the map for RPF, and hardly do for RAPF.

    Parameters
    ----------
    rapf, rpf : GainOutcomes
        Outcomes on the same problem instances, without failed runs.
    """
    claim = Claim(
        "gains-choice",
        question=3,
        text="Which gains are best depends on the environment for RPF, but hardly for RAPF.",
        source="VI-B: “the best choice of the potential parameters is environment dependent”",
    )
    rapf_regrets, maps = compute_regrets(rapf)
    rpf_regrets, _ = compute_regrets(rpf)
    if not len(rapf_regrets):
        return claim
    measure = "mean increase of the cost with the best gains of other maps over that with the map's own"
    criteria = (
        Criterion(f"RPF: {measure}", bootstrap(rpf_regrets, "mean", maps), low=REGRET, unit="%"),
        Criterion("RAPF: the same", bootstrap(rapf_regrets, "mean", maps), high=REGRET, unit="%"),
    )
    rapf_best = format_potential(rapf.gains[rapf.find_best()])
    rpf_best = format_potential(rpf.gains[rpf.find_best()])
    explanation = (
        f"Both sets are judged from a start on which neither was chosen. Highest increase: RPF "
        f"{format_amount(rpf_regrets.max(), '%')}, RAPF {format_amount(rapf_regrets.max(), '%')}. "
        f"Best over all maps: RAPF {rapf_best}, RPF {rpf_best}."
    )
    return claim.judge(criteria, explanation, rapf, runs_per_instance=len(rapf.gains) + len(rpf.gains))


def compute_variation(grid: GainOutcomes) -> FloatArray:
    """Return the coefficient of variation of the cost over the sets of gains, for each instance, (m,)."""
    return np.array([compute_coefficient_of_variation(column) for column in grid.relative_costs.T])


def compute_worst_by_best(grid: GainOutcomes) -> FloatArray:
    """Return the ratio of the cost with the worst gains to that with the best, for each instance, (m,)."""
    return np.asarray(grid.relative_costs.max(axis=0) / grid.relative_costs.min(axis=0))


def compute_regrets(grid: GainOutcomes) -> tuple[FloatArray, list[str]]:
    """Compute the cost of choosing gains without knowing the map.

    For every problem instance, two sets of gains are compared: the best set on *other starts of the same
    map*, and the best set on other maps. Neither was chosen on the instance itself, so chance favors neither.

    Parameters
    ----------
    grid : GainOutcomes

    Returns
    -------
    regrets : (k,) array
        J with the gains from other maps divided by J with those from the same map, minus 1.
    maps : list of str
        Map of each value.
    """
    regrets = []
    maps = []
    for k, instance in enumerate(grid.instances):
        same_map = []
        other_maps = []
        for j, other in enumerate(grid.instances):
            if other.map != instance.map:
                other_maps.append(j)
            elif other.start != instance.start:
                same_map.append(j)
        if same_map and other_maps:
            informed = grid.relative_costs[grid.find_best(same_map), k]
            uninformed = grid.relative_costs[grid.find_best(other_maps), k]
            regrets.append(float(uninformed / informed) - 1.0)
            maps.append(instance.map)
    return np.array(regrets), maps


def select_common_instances(rapf: GainOutcomes, rpf: GainOutcomes) -> tuple[GainOutcomes, GainOutcomes]:
    """Return the outcomes of both on the instances on which no run of either failed.

    Both must have the same instances in the same order.
    """
    is_finite = np.isfinite(np.vstack([rapf.relative_costs, rpf.relative_costs]))
    is_complete = np.asarray(is_finite.all(axis=0))
    return rapf.select(is_complete), rpf.select(is_complete)
