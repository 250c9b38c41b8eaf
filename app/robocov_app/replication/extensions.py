"""What the paper leaves to others, as claims: targets, density, mixed teams, what goes wrong.

Thresholds are those of `robocov_app.replication.claims`; they were set before anything here was run.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from robocov_app.replication.beyond_studies import TARGETS, TEAMS, of
from robocov_app.replication.claims import CLEARLY_BELOW, NEARLY_SAME, SAME_COST, compared
from robocov_app.replication.goals import EXTENSIONS
from robocov_app.replication.verdicts import Claim, Criterion, amount

if TYPE_CHECKING:
    from robocov_app.replication.beyond import BeyondMaterial, Weighed
    from robocov_app.replication.degradation import Degradation
    from robocov_app.replication.outcomes import Outcomes

BORNE = (("loss", 0.6, "60 % of all messages are lost"), ("delay", 1.0, "messages arrive after 1 s"))
"""What RAPF is to bear: axis, value, words."""

_NO_RUN = "There is no run that could tell."


def extension_claims(material: BeyondMaterial) -> tuple[Claim, ...]:
    """Return the claims on what the paper leaves to others."""
    return (
        targets_claim(material.targets),
        density_claim(material.weighed),
        *(teams_claim(material.teams, law) for law in ("rapf", "lloyd")),
        conditions_claim(material.degradations, len(of(material.plan).conditions_maps)),
    )


def targets_claim(outcomes: Outcomes) -> Claim:
    """Test whether it matters for which optimum of its cell RAPF heads."""
    claim = (
        "Whether RAPF heads for the centroid of its cell, its geometric median or the best place of a "
        "sensor makes no difference to the coverage cost."
    )
    criteria, told, maps, runs = [], [], 0, 0
    for law in TARGETS[1:]:
        pairs = compared(outcomes, law.key, TARGETS[0].key)
        if pairs is None:
            continue
        paired, fine = pairs
        text = f"median of J({law.key}) / J(centroid) at the end"
        criteria.append(Criterion(text, paired.ratio, 1.0 - SAME_COST, 1.0 + SAME_COST))
        told.append(f"{law.key} lower in {amount(paired.wins.estimate, '%')} of the runs")
        maps, runs = len(set(fine.maps)), runs + 2 * len(fine.scenarios)
    words = f"{'; '.join(told)[:1].upper()}{'; '.join(told)[1:]}." if told else _NO_RUN
    return Claim("targets", EXTENSIONS, claim, tuple(criteria), runs, maps, words)


def density_claim(weighed: Weighed) -> Claim:
    """Test whether it helps RAPF to know which places count more."""
    claim = "Where some places count more, RAPF that knows which ends at a clearly lower weighed cost."
    pairs = compared(weighed.outcomes, "known", "ignored")
    if pairs is None:
        return Claim("density", EXTENSIONS, claim, (), 0, 0, _NO_RUN)
    paired, fine = pairs
    criteria = (
        Criterion("median ratio of the mean distance by φ", paired.ratio, high=CLEARLY_BELOW),
        Criterion("runs in which it is the lower one", paired.wins, 0.5, unit="%"),
    )
    told = (
        "Both are judged by the same φ: two Gaussians of 1 m on every map, 20 high over a floor of 1, drawn "
        "by chance in the free space."
    )
    return Claim("density", EXTENSIONS, claim, criteria, 2 * len(fine.scenarios), len(set(fine.maps)), told)


def teams_claim(outcomes: Outcomes, controller: str) -> Claim:
    """Test whether cells by time help a team whose robots are not equally fast."""
    by_time, by_distance = (
        next(law for law in TEAMS if law.key == f"{controller}-{cells}") for cells in ("time", "distance")
    )
    label = by_time.label.partition(",")[0]
    claim = f"In a mixed team {label} is at places sooner, in the mean, with cells by time than by distance."
    key = f"teams-{controller}"
    pairs = compared(outcomes, by_time.key, by_distance.key)
    if pairs is None:
        return Claim(key, EXTENSIONS, claim, (), 0, 0, _NO_RUN)
    paired, fine = pairs
    criteria = (
        Criterion("median ratio of the mean time, by time to by distance", paired.ratio, high=1.0),
        Criterion("runs in which it is the lower one", paired.wins, 0.5, unit="%"),
    )
    medians = [float(np.median(fine.of(law.key, "final"))) for law in (by_distance, by_time)]
    told = (
        f"Median of the mean time until the first robot is there: {amount(medians[0], 's')} with cells by "
        f"distance, {amount(medians[1], 's')} by time. Two robots each of at most 1, 0.5 and 0.25 m/s."
    )
    return Claim(key, EXTENSIONS, claim, criteria, 2 * len(fine.scenarios), len(set(fine.maps)), told)


def conditions_claim(found: Sequence[Degradation], maps: int) -> Claim:
    """Test whether RAPF bears messages that are lost or late, from what came of it on so many maps."""
    claim = f"RAPF ends within {amount(NEARLY_SAME, '%')} of its cost where messages get lost or are late."
    criteria, runs = [], 0
    for axis, value, words in BORNE:
        for each in found:
            known = each.controller == "rapf" and each.axis == axis and each.value == value
            if known and math.isfinite(each.ratio.estimate):
                text = f"final cost where {words}, by that under ideal conditions"
                criteria.append(Criterion(text, each.ratio, high=1.0 + NEARLY_SAME))
                runs += 2 * each.runs
    rest = [each for each in found if each.controller == "rapf" and math.isfinite(each.ratio.estimate)]
    if not criteria:
        return Claim("conditions", EXTENSIONS, claim, (), 0, 0, _NO_RUN)
    worst = max(rest, key=lambda each: each.ratio.estimate)
    told = (
        f"The highest of all medians is {amount(worst.ratio.estimate)}, with "
        f"{worst.axis.replace('_', ' ')} {'none' if worst.value is None else f'{worst.value:g}'}."
    )
    return Claim("conditions", EXTENSIONS, claim, tuple(criteria), runs, maps, told)
