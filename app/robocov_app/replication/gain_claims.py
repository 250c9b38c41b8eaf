"""The paper's claims on gains: does the result depend on them, and do the best ones on the environment?"""

from __future__ import annotations

import numpy as np

from robocov.arrays import Array
from robocov_app.figures.statistics import bootstrap, paired, spread
from robocov_app.replication.claims import BARELY, REGRET
from robocov_app.replication.contenders import potential_text
from robocov_app.replication.outcomes import GainOutcomes
from robocov_app.replication.verdicts import Claim, Criterion, amount


def gains_result(rapf: GainOutcomes, rpf: GainOutcomes) -> Claim:
    """Test whether RAPF's final cost barely depends on the gains, and RPF's does."""
    claim = "RAPF's final cost barely depends on the gains, RPF's does."
    source = "VI-B: “by using the RAPF, it is almost independent”"
    rapf, rpf = _same_scenarios(rapf, rpf)
    if not rapf.scenarios:
        return Claim("gains-result", 3, claim, (), 0, 0, "There is no run that could tell.", source)
    ours, theirs, maps = variation(rapf), variation(rpf), rapf.maps
    pairs = paired(ours, np.maximum(theirs, 1e-12), maps)
    text = "median standard deviation of the final cost over the gains, by its mean"
    criteria = (
        Criterion(f"RAPF: {text}", bootstrap(ours, clusters=maps), high=BARELY, unit="%"),
        Criterion("RPF: the same", bootstrap(theirs, clusters=maps), low=BARELY, unit="%"),
        Criterion("median ratio of that deviation, RAPF to RPF", pairs.ratio, high=1.0),
    )
    levels = sorted({float(g["k_att"] or 0.0) for g in rapf.gains if "k_att" in g})
    at = "; ".join(
        f"k_att = {level:g}: {amount(float(np.median(variation(part))), '%')}, "
        f"worst by best {amount(float(np.median(worst_by_best(part))))}"
        for level in levels
        if len((part := rapf.with_gain("k_att", level)).gains) > 1
    )
    told = (
        f"{len(rapf.gains)} sets of gains for RAPF and {len(rpf.gains)} for RPF. Worst by best set, median: "
        f"RAPF {amount(float(np.median(worst_by_best(rapf))))}, "
        f"RPF {amount(float(np.median(worst_by_best(rpf))))}. RAPF at one attraction: {at}."
    )
    return Claim("gains-result", 3, claim, criteria, _runs(rapf, rpf), len(set(maps)), told, source)


def gains_choice(rapf: GainOutcomes, rpf: GainOutcomes) -> Claim:
    """Test whether the best gains depend on the environment for RPF, and hardly do for RAPF."""
    claim = "Which gains are best depends on the environment for RPF, and hardly does for RAPF."
    source = "VI-B: “the best choice of the potential parameters is environment dependent”"
    rapf, rpf = _same_scenarios(rapf, rpf)
    ours, maps = regrets(rapf)
    theirs, _ = regrets(rpf)
    if not len(ours):
        return Claim("gains-choice", 3, claim, (), 0, 0, "There is no run that could tell.", source)
    text = "mean cost, in excess, of the gains that are best on other maps instead of on the same one"
    criteria = (
        Criterion(f"RPF: {text}", bootstrap(theirs, "mean", maps), low=REGRET, unit="%"),
        Criterion("RAPF: the same", bootstrap(ours, "mean", maps), high=REGRET, unit="%"),
    )
    told = (
        f"Both sets are judged from a start that neither was chosen on. Highest excess: RPF "
        f"{amount(float(theirs.max()), '%')}, RAPF {amount(float(ours.max()), '%')}. Best over all maps: "
        f"RAPF {written_gains(rapf)}, RPF {written_gains(rpf)}."
    )
    return Claim("gains-choice", 3, claim, criteria, _runs(rapf, rpf), len(set(maps)), told, source)


def variation(outcomes: GainOutcomes) -> Array:
    """Return the standard deviation of the cost over the gains by its mean, for each scenario, (m,)."""
    return np.array([spread(column) for column in outcomes.excess.T])


def worst_by_best(outcomes: GainOutcomes) -> Array:
    """Return the cost of the worst gains by that of the best ones, for each scenario, (m,)."""
    return np.asarray(outcomes.excess.max(axis=0) / outcomes.excess.min(axis=0))


def regrets(outcomes: GainOutcomes) -> tuple[Array, tuple[str, ...]]:
    """Return what it costs not to know the map when gains are chosen, and the map of each value.

    For every scenario two sets of gains are compared: the best one on the *other starts of the same map*,
    and the best one on the other maps. Neither was chosen on the scenario itself, so chance favours none.

    Returns
    -------
    (k,)
        J with the gains of other maps by J with those of the same map, minus 1.
    k names
    """
    found, where = [], []
    for column, scenario in enumerate(outcomes.scenarios):
        same = [
            k
            for k, other in enumerate(outcomes.scenarios)
            if other.map == scenario.map and other.start != scenario.start
        ]
        others = [k for k, other in enumerate(outcomes.scenarios) if other.map != scenario.map]
        if same and others:
            known, unknown = outcomes.best(same), outcomes.best(others)
            found.append(float(outcomes.excess[unknown, column] / outcomes.excess[known, column]) - 1.0)
            where.append(scenario.map)
    return np.array(found), tuple(where)


def written_gains(outcomes: GainOutcomes) -> str:
    """Return the best gains as they are read: "(k_rep 0.3, rho_0 3)"."""
    return potential_text(outcomes.gains[outcomes.best()])


def _same_scenarios(rapf: GainOutcomes, rpf: GainOutcomes) -> tuple[GainOutcomes, GainOutcomes]:
    """Return what both laws did in the scenarios where no run of either failed."""
    rapf, rpf = rapf.complete, rpf.complete
    common = set(rapf.scenarios) & set(rpf.scenarios)

    def part(of: GainOutcomes) -> GainOutcomes:
        columns = [k for k, each in enumerate(of.scenarios) if each in common]
        return GainOutcomes(tuple(of.scenarios[k] for k in columns), of.gains, of.excess[:, columns])

    return part(rapf), part(rpf)


def _runs(*parts: GainOutcomes) -> int:
    return sum(int(part.excess.size) for part in parts)
