"""The paper's claims, one function each: from what many runs gave to a verdict.

All thresholds stand here, with their reasons; they were set before the study was run, and are the same for
every run of it. Statistics are medians over scenarios with 95 % bootstrap intervals that draw whole maps.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from robocov.arrays import Array
from robocov_app.figures.statistics import Interval, Paired, bootstrap, paired, spread
from robocov_app.replication.contenders import LABELS
from robocov_app.replication.outcomes import Outcomes
from robocov_app.replication.placements import spread_of_placements
from robocov_app.replication.verdicts import Claim, Criterion, amount

SAME_COST = 0.02
"""Two costs are the same when the median of their ratio is within 2 % of 1."""

NEARLY_SAME = 0.05
"""In single runs two costs are nearly the same when they differ by at most 5 %."""

NEARLY_ALWAYS = 0.9
"""The share of runs that "the result is" speaks of, where the paper makes no exceptions."""

CLEARLY_BELOW = 0.95
"""A law is better than another one when the median of the ratio of their costs is below this."""

EARLY = 20.0
"""Seconds in which a team spreads over a convex region of ten metres; Lloyd's algorithm has settled then."""

FIRST_MINUTE = 60.0
"""Seconds that count as "during the motion"."""

BARELY = 0.05
"""A result barely depends on the gains when its standard deviation over them is below 5 % of its mean."""

REGRET = 0.02
"""The best gains depend on the environment when those of other maps cost more than 2 % on it."""

BARELY_BY_START = 0.1
"""A result barely depends on the starts when its standard deviation over them is below 10 % of its mean.

Starts matter more than gains do in any law that descends to a local optimum, so the bound is wider."""

SAME_PLACEMENT = 0.25
"""Two placements are nearly the same when robots are less than a quarter of the side of their share apart."""

NEAR_OPTIMUM, FAR_FROM_OPTIMUM = 0.1, 0.25
"""A team is near the reference within 10 % of its cost, and far from it above 25 %."""


def compared(
    outcomes: Outcomes, first: str, second: str, measure: str = "final"
) -> tuple[Paired, Outcomes] | None:
    """Return how `first` compares with `second`, and in which scenarios; None where there are none."""
    fine = outcomes.among(outcomes.together((first, second), measure))
    if not fine.scenarios:
        return None
    return paired(fine.of(first, measure), fine.of(second, measure), fine.maps), fine


def convex_final(outcomes: Outcomes) -> Claim:
    """Test whether RAPF ends at LA's cost in convex regions (figure 3)."""
    claim = "In a convex region RAPF ends at the same cost as Lloyd's algorithm."
    found = compared(outcomes, "rapf-shared", "lloyd")
    if found is None:
        return _untested("convex-final", 1, claim, "VI-A, figures 2 and 3")
    pairs, fine = found
    ratio = fine.of("rapf-shared", "final") / fine.of("lloyd", "final")
    near = bootstrap((np.abs(ratio - 1.0) <= NEARLY_SAME).astype(float), "mean", fine.maps)
    criteria = (
        Criterion("median of J(RAPF) / J(LA) at the end", pairs.ratio, 1.0 - SAME_COST, 1.0 + SAME_COST),
        Criterion(f"runs that end within {amount(NEARLY_SAME, '%')} of LA", near, NEARLY_ALWAYS, unit="%"),
    )
    told = (
        f"The ratio lies between {amount(float(ratio.min()))} and {amount(float(ratio.max()))}; "
        f"LA ends in a centroidal tessellation, of which a region has several. "
        + _best_and_default(outcomes, "lloyd")
    )
    return _tested("convex-final", 1, claim, criteria, fine, 2, told, "VI-A, figures 2 and 3")


def convex_spreading(outcomes: Outcomes, clustered: Iterable[str]) -> Claim:
    """Test whether RAPF spreads faster than LA over a convex region from clustered starts."""
    claim = "From starts close together RAPF spreads faster over a convex region than Lloyd's algorithm."
    found = compared(outcomes.from_starts(clustered), "rapf-shared", "lloyd", "early")
    if found is None:
        return _untested("convex-spreading", 1, claim, "VI-A")
    pairs, fine = found
    what = f"mean distance over the first {EARLY:g} s"
    criteria = (
        Criterion(f"median ratio, RAPF to LA, of the {what}", pairs.ratio, high=1.0),
        Criterion(f"runs in which RAPF's {what} is the lower one", pairs.wins, 0.5, unit="%"),
    )
    told = (
        f"Per start: {_by_start(fine, 'rapf-shared', 'lloyd', 'early')}. "
        f"The paper itself concludes that “the improvement of RAPF is negligible” in convex regions, "
        f"after having called it “quite better” from close starts."
    )
    return _tested("convex-spreading", 1, claim, criteria, fine, 2, told, "VI-A")


def nonconvex(outcomes: Outcomes, gains: str, moment: str) -> Claim:
    """Test whether RAPF's cost is below RPF's, at the end or during the motion.

    Parameters
    ----------
    gains : {"shared", "best"}
    moment : {"final", "motion"}
    """
    measure = "final" if moment == "final" else "first_minute"
    at = "with the same potential parameters" if gains == "shared" else "each with its own best gains"
    end = "ends at a lower cost than RPF" if moment == "final" else "has a lower cost than RPF while it moves"
    claim = f"In a non-convex environment RAPF {end}, {at}."
    key, source = f"nonconvex-{moment}-{gains}", "VI-B, figures 4 to 7"
    ours, theirs = f"rapf-{gains}", f"rpf-{gains}"
    found = compared(outcomes, ours, theirs, measure)
    if found is None:
        return _untested(key, 2, claim, source)
    pairs, fine = found
    what = "the final cost" if moment == "final" else f"the cost averaged over {FIRST_MINUTE:g} s"
    criteria = (
        Criterion(f"median ratio, RAPF to RPF, of {what}", pairs.ratio, high=CLEARLY_BELOW),
        Criterion("runs in which RAPF's is the lower one", pairs.wins, NEARLY_ALWAYS, unit="%"),
    )
    told = f"Median ratio per start: {_by_start(fine, ours, theirs, measure)}." + _lost(
        fine, ours, theirs, measure
    )
    return _tested(key, 2, claim, criteria, fine, 2, told, source)


def outperforms_lloyd(outcomes: Outcomes) -> Claim:
    """Test whether RAPF outperforms LA in non-convex environments, which the paper does not show."""
    claim = "In a non-convex environment RAPF significantly outperforms Lloyd's algorithm too."
    source = "VII: “significantly outperforms other existing approaches”; the paper shows RPF only"
    found = compared(outcomes, "rapf-shared", "lloyd")
    if found is None:
        return _untested("nonconvex-lloyd", 5, claim, source)
    pairs, fine = found
    criteria = (
        Criterion("median of J(RAPF) / J(LA) at the end", pairs.ratio, high=CLEARLY_BELOW),
        Criterion("runs in which RAPF's is the lower one", pairs.wins, 0.5, unit="%"),
    )
    told = "LA here slides along what it touches. " + _best_and_default(outcomes, "lloyd")
    return _tested("nonconvex-lloyd", 5, claim, criteria, fine, 2, told, source)


def starts_cost(outcomes: Outcomes) -> Claim:
    """Test whether RAPF's final cost barely depends on the starts, and RPF's does."""
    claim = "RAPF's final cost barely depends on where the robots start, RPF's does."
    source = "VI-B, figures 6 and 8"
    fine = outcomes.among(outcomes.together(("rapf-shared", "rpf-shared"), "final"))
    groups = _groups_of_starts(fine)
    if not groups:
        return _untested("starts-cost", 4, claim, source)
    maps = [map_ for map_, _ in groups]
    ours, theirs = (
        np.array([spread(fine.of(law, "final")[rows]) for _, rows in groups])
        for law in ("rapf-shared", "rpf-shared")
    )
    criteria = (
        Criterion(
            "RAPF: median standard deviation of the final cost over the starts, by its mean",
            bootstrap(ours, clusters=maps),
            high=BARELY_BY_START,
            unit="%",
        ),
        Criterion("RPF: the same", bootstrap(theirs, clusters=maps), low=BARELY_BY_START, unit="%"),
    )
    told = (
        f"Over the same map and seed, from {len(set(fine.starts))} kinds of starts. RPF's varies "
        f"{amount(float(np.median(theirs) / max(np.median(ours), 1e-12)))} times as much as RAPF's. At their "
        f"best gains: RAPF {_variation(outcomes, 'rapf-best')}, RPF {_variation(outcomes, 'rpf-best')}; "
        f"LA {_variation(outcomes, 'lloyd')}."
    )
    return _tested("starts-cost", 4, claim, criteria, fine, 2, told, source)


def starts_placement(outcomes: Outcomes) -> Claim:
    """Test whether RAPF's final placement barely depends on the starts, and RPF's does."""
    claim = "RAPF's final placement varies little with where the robots start, RPF's strongly."
    source = "VI-B, figures 6 and 8"
    laws = ("rapf-shared", "rpf-shared")
    fine = outcomes.among(outcomes.together(laws, "final"))
    apart = {law: _placement_spreads(fine, law) for law in laws}
    maps = [map_ for map_ in apart[laws[0]] if map_ in apart[laws[1]]]
    if not maps:
        return _untested("starts-placement", 4, claim, source)
    ours, theirs = (np.array([apart[law][map_] for map_ in maps]) for law in laws)
    pairs = paired(ours, theirs, maps)
    metres = {
        law: bootstrap([apart[law][map_] * fine.shares[map_] for map_ in maps], clusters=maps) for law in laws
    }
    criteria = (
        Criterion(
            "RAPF: matched distance between the ends from different starts, by the side of a robot's share",
            bootstrap(ours, clusters=maps),
            high=SAME_PLACEMENT,
            unit="%",
        ),
        Criterion("median ratio of that distance, RAPF to RPF", pairs.ratio, high=1.0),
    )
    told = (
        f"In metres: RAPF {amount(metres[laws[0]].estimate, 'm')}, "
        f"RPF {amount(metres[laws[1]].estimate, 'm')} (medians over maps). "
        f"Robots are matched so that the sum of straight distances is least. "
        f"A placement can differ while its cost does not: many are equally good."
    )
    return _tested("starts-placement", 4, claim, criteria, fine, 2, told, source)


def stuck(outcomes: Outcomes) -> Claim:
    """Test how often LA leaves robots stuck in non-convex environments."""
    claim = "Lloyd's algorithm is unusable in presence of obstacles: its robots get stuck."
    source = "I and IV"
    fine = outcomes.among(outcomes.together(("lloyd",), "stuck"))
    if not fine.scenarios:
        return _untested("lloyd-stuck", 5, claim, source)
    count = fine.of("lloyd", "stuck")
    some = bootstrap((count > 0).astype(float), "mean", fine.maps)
    gap = fine.of("lloyd", "gap")
    kept = np.isfinite(gap)
    criteria = [Criterion("runs of LA that end with a robot stuck", some, 0.5, unit="%")]
    if kept.any():
        maps = [map_ for map_, good in zip(fine.maps, kept, strict=True) if good]
        criteria.append(
            Criterion(
                "LA: median of J/J_ref - 1", bootstrap(gap[kept], clusters=maps), FAR_FROM_OPTIMUM, unit="%"
            )
        )
    others = ", ".join(
        f"{LABELS[law]} {_share_stuck(outcomes, law)}" for law in ("rapf-shared", "rapf-best", "rapf-default")
    )
    told = (
        f"On average {amount(float(count.mean()))} robots are stuck in a run. "
        f"Runs with a stuck robot of other laws: {others}. Stuck: the goal is more than 0.5 m away and the "
        f"robot moved less than 0.05 m in the last 5 s."
    )
    return _tested("lloyd-stuck", 5, claim, tuple(criteria), fine, 1, told, source)


def gap_to_reference(outcomes: Outcomes, law: str) -> Claim:
    """Test how far a law stays above the centralised reference.

    Parameters
    ----------
    law : {"rapf-shared", "rpf-shared", "lloyd"}
    """
    near = law != "rpf-shared"
    claim, source = {
        "rapf-shared": ("RAPF's coverage is nearly optimal.", "VII: “to achieve an optimal coverage”"),
        "rpf-shared": ("RPF comes to rest far from the optimum.", "IV and I: “usually far from the optimal”"),
        "lloyd": ("Lloyd's algorithm, ignorant of obstacles, is nearly optimal all the same.", ""),
    }[law]
    key = f"gap-{law.removesuffix('-shared')}"
    fine = outcomes.among(outcomes.together((law,), "gap"))
    if not fine.scenarios:
        return _untested(key, 6, claim, source)
    gap = fine.of(law, "gap")
    found = bootstrap(gap, clusters=fine.maps)
    criteria = (
        Criterion(
            f"{LABELS[law]}: median of J/J_ref - 1",
            found,
            *((-np.inf, NEAR_OPTIMUM) if near else (FAR_FROM_OPTIMUM, np.inf)),
            unit="%",
        ),
    )
    low, high = np.quantile(gap, [0.25, 0.75]).tolist()
    worst = fine.scenarios[int(np.argmax(gap))]
    told = (
        f"Half of the runs lie between {amount(low, '%')} and {amount(high, '%')}; the worst is "
        f"{amount(float(gap.max()), '%')} above it ({worst.map}, start {worst.start}, seed {worst.seed}). "
        f"{_by_family(fine, gap)} "
        f"J_ref is the best of many descents with the whole map known; it is no bound, only hard to beat"
        + (
            f", and was beaten in {amount(float((gap < 0).mean()), '%')} of the runs."
            if (gap < 0).any()
            else "."
        )
    )
    return _tested(key, 6, claim, criteria, fine, 1, told, source)


def _tested(
    key: str,
    part: int,
    claim: str,
    criteria: tuple[Criterion, ...],
    fine: Outcomes,
    laws: int,
    explanation: str,
    source: str,
) -> Claim:
    maps = len(set(fine.maps))
    return Claim(key, part, claim, criteria, laws * len(fine.scenarios), maps, explanation, source)


def _untested(key: str, part: int, claim: str, source: str) -> Claim:
    return Claim(key, part, claim, (), 0, 0, "There is no run that could tell.", source)


def _by_start(outcomes: Outcomes, first: str, second: str, measure: str) -> str:
    ratio = outcomes.of(first, measure) / outcomes.of(second, measure)
    parts = []
    for start in dict.fromkeys(outcomes.starts):
        chosen = [each == start for each in outcomes.starts]
        parts.append(f"{start} {amount(float(np.median(ratio[chosen])))}")
    return ", ".join(parts)


def _by_family(outcomes: Outcomes, gap: Array) -> str:
    """Return the medians on generated and on bundled maps, which are larger, and harder."""
    drawn = np.array([map_.startswith("generated-") for map_ in outcomes.maps], dtype=bool)
    parts = [
        f"on {name} maps {amount(float(np.median(gap[chosen])), '%')}"
        for name, chosen in (("generated", drawn), ("bundled", ~drawn))
        if chosen.any()
    ]
    return f"Medians: {', '.join(parts)}."


def _lost(outcomes: Outcomes, first: str, second: str, measure: str) -> str:
    ratio = outcomes.of(first, measure) / outcomes.of(second, measure)
    worst = int(np.argmax(ratio))
    lost = int((ratio >= 1.0).sum())
    where = outcomes.scenarios[worst]
    return (
        f" RAPF loses {lost} of {len(ratio)}; the highest ratio is {amount(float(ratio[worst]))} "
        f"({where.map}, start {where.start}, seed {where.seed})."
    )


def _best_and_default(outcomes: Outcomes, other: str) -> str:
    parts = []
    for law in ("rapf-best", "rapf-default"):
        found = compared(outcomes, law, other)
        if found is not None:
            pairs, _ = found
            wins = amount(pairs.wins.estimate, "%")
            parts.append(f"{LABELS[law]}: ratio {_short(pairs.ratio)}, lower in {wins} of the runs")
    return ("; ".join(parts) + ".") if parts else ""


def _short(interval: Interval) -> str:
    if np.isnan(interval.low):
        return amount(interval.estimate)
    return f"{amount(interval.estimate)} ({amount(interval.low)} to {amount(interval.high)})"


def _groups_of_starts(outcomes: Outcomes) -> list[tuple[str, list[int]]]:
    """Return the scenarios of each map and seed, where there are several starts."""
    groups: dict[tuple[str, int], list[int]] = {}
    for k, (map_, _, seed) in enumerate(outcomes.scenarios):
        groups.setdefault((map_, seed), []).append(k)
    return [(map_, rows) for (map_, _), rows in groups.items() if len(rows) > 1]


def _variation(outcomes: Outcomes, law: str) -> str:
    fine = outcomes.among(outcomes.together((law,), "final"))
    groups = _groups_of_starts(fine)
    if not groups:
        return "–"
    found = [spread(fine.of(law, "final")[rows]) for _, rows in groups]
    return amount(float(np.median(found)), "%")


def _placement_spreads(outcomes: Outcomes, law: str) -> dict[str, float]:
    """Return for each map how far ends from different starts are apart, by the side of a robot's share."""
    places = outcomes.placements.get(law)
    if places is None:
        return {}
    found: dict[str, float] = {}
    for map_ in dict.fromkeys(outcomes.maps):
        rows: Sequence[int] = [k for k, each in enumerate(outcomes.maps) if each == map_]
        apart = spread_of_placements(places[rows], [outcomes.starts[k] for k in rows])
        if np.isfinite(apart) and map_ in outcomes.shares:
            found[map_] = apart / outcomes.shares[map_]
    return found


def _share_stuck(outcomes: Outcomes, law: str) -> str:
    count: Array = outcomes.of(law, "stuck")
    fine = np.isfinite(count)
    return amount(float((count[fine] > 0).mean()), "%") if fine.any() else "–"
