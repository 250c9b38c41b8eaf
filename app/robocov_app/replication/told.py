"""What the page says of how the study was made: its protocol, what decides its numbers, errata, citation."""

from __future__ import annotations

from typing import TYPE_CHECKING

from robocov.metrics import SETTLED_DISTANCE, SETTLED_WINDOW
from robocov.record import versions
from robocov_app.figures.statistics import RESAMPLES
from robocov_app.replication import claims
from robocov_app.replication.contenders import (
    RAPF_DEFAULT,
    RAPF_SHARED,
    RPF_SHARED,
    Contender,
    potential_text,
)
from robocov_app.replication.maps import NON_CONVEX, RADII, TIGHT
from robocov_app.replication.plan import ROBOTS, Plan, complete_gains
from robocov_app.replication.verdicts import LEAST_MAPS, amount

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

CITATION = (
    "A. Renzaglia and A. Martinelli, “Distributed Coverage Control for a Multi-Robot Team in a Non-Convex "
    "Environment”. Equation and figure numbers are the paper's; its sentences are quoted where they stand "
    "between quotation marks."
)

ERRATA = (
    "(28) is printed as m q″ − ν q′. With that sign the viscous term feeds energy in; meant, and simulated "
    "here, is m q″ = F − ν q′.",
    "(18): the second integral carries the wrong sign. It does no harm, since it sums to zero round the "
    "cell.",
    "After (14) the text says that the optimum does not depend on the height h. It does: on an "
    "asymmetric cell "
    "it moves from the optimum for h → 0 to the centroid for h → ∞. On the pentagon (0, 0), (4, 0), (5, 2), "
    "(2, 4), (−1, 1.5) it lies at (2.0912, 1.6745) for h = 0.01, at (2.0849, 1.6650) for h = 1 and at "
    "(2.0542, 1.6190) for h = 20; the centroid is (2.0538, 1.6183).",
)
"""What is wrong in the paper, and was proved to be."""

DEPENDS = (
    "The attraction (27) grows with the cube of the distance. The shared and the best gains leave it so, as "
    "the paper has it; then robots are pushed into walls. robocov's default limits it to 2 N, what drives a "
    "robot at full speed: fewer contacts, often a slightly higher cost.",
    "A robot settles where forces balance, not at its goal. With a weak attraction (k_att = 1 or 3) the last "
    "metre takes long and ends early: the shared gains therefore leave a larger gap than strong attraction "
    "does, and many robots count as stuck although nothing holds them but the balance.",
    "A robot is stuck when its goal is more than 0.5 m away and it moved less than 0.05 m over the last 5 s. "
    f"A team has settled when no robot gets {SETTLED_DISTANCE:g} m in any {SETTLED_WINDOW:g} s from then on; "
    "by instantaneous speed many never would, since the nearest obstacle point jumps and robots tremble.",
    "Lloyd's algorithm knows no obstacles: here its robots slide along whatever they touch. A controller "
    "that "
    "stops at walls would do worse.",
    "The repulsion (24) is infinite in contact; below 1 cm it no longer grows.",
    "Larger maps are harder with the same gains and the same time: the bundled maps are up to 40 m long, the "
    "generated ones 10 m. The table of gaps tells them apart.",
    "J is the exact mean of the geodesic distance over the sites of a lattice, not an approximation on a "
    "grid; the reference is refined on the same sites.",
)
"""Where another study would get other numbers, and why."""


def protocol(plan: Plan, best: Mapping[str, Contender], runs: int, failed: int) -> list[tuple[str, str]]:
    """Return what was done, as pairs of a name and a sentence."""
    team = plan.team
    facts = [
        (
            "Robots",
            f"{ROBOTS} discs of {team['radius']:g} m radius and 1 kg; at most {team['max_speed']:g} m/s and "
            f"{team['max_acceleration']:g} m/s²; ν = {team['viscosity']:g} N s/m, the same for every law.",
        ),
        (
            "What they know",
            f"The convex hull of the map, every other robot's position, and the nearest obstacle point "
            f"within "
            f"{team['sensing_range']:g} m (no less than the longest rho_0, so that rho_0 alone says how far "
            f"an obstacle acts).",
        ),
        (
            "Runs",
            f"{plan.duration:g} s each, a control period of {plan.dt:g} s; {runs:,} runs, {failed:,} of "
            f"which failed.",
        ),
        (
            "Cost",
            f"(22) by the area: the mean geodesic distance to the nearest robot, on a lattice of "
            f"{plan.lattice} × {plan.lattice} sites (figures: {2 * plan.lattice}), twice a second.",
        ),
        ("Shared gains", f"RAPF {gains_text(RAPF_SHARED)}; RPF {gains_text(RPF_SHARED)}."),
    ]
    if best:
        facts += [
            (
                "Best gains",
                f"RAPF {gains_text(best['rapf'])}; RPF {gains_text(best['rpf'])}: those with the least "
                f"mean of "
                f"J/J_ref on {len(plan.tuning)} generated maps (seeds {span(plan.tuning)}) that are used for "
                f"nothing else, from starts with a seed of their own ({plan.tuning_seed}).",
            ),
            (
                "Grid of gains",
                f"k_rep {listed(plan.k_rep)} N m³; rho_0 {listed(plan.rho_0)} m; for RAPF k_att "
                f"{listed(plan.k_att)} N/m³ beside them; on the maps of the tuning, starts "
                f"{', '.join(plan.tuning_starts)}.",
            ),
            ("robocov's default", f"RAPF {gains_text(RAPF_DEFAULT)}."),
            ("Non-convex maps", _maps_text(plan)),
            (
                "Convex regions",
                f"square, pentagon, and {len(plan.convex_generated)} hulls of nine random points in a "
                f"square of "
                f"ten metres (at least 40 m², at least 5 m wide), seeds {span(plan.convex_generated)}.",
            ),
            (
                "Starts",
                f"corner: a disc of {RADII[0]:g} m radius (in narrow maps {RADII[1]:g} or {RADII[2]:g} m) as "
                f"near to the lower left corner as it is free; centre: one as near to the middle; "
                f"uniform: anywhere. In convex regions also tight: a disc of {TIGHT:g} m. Seeds "
                f"{span(plan.seeds)} (convex {span(plan.convex_seeds)}); every law begins in the same "
                f"places.",
            ),
            (
                "Statistics",
                f"Medians with 95 % percentile bootstrap intervals of {RESAMPLES:,} samples that draw "
                f"whole maps; below {LEAST_MAPS} maps a claim is undecided.",
            ),
            ("Thresholds", f"{thresholds()}."),
        ]
    facts.append(("Versions", ", ".join(f"{name} {number}" for name, number in versions().items())))
    return facts


def thresholds() -> str:
    """Return the thresholds of the claims in words."""
    parts = (
        f"two final costs are the same within {amount(claims.SAME_COST, '%')}",
        f"in single runs within {amount(claims.NEARLY_SAME, '%')}",
        f"a law is better below {amount(claims.CLEARLY_BELOW)} of the other's cost",
        f"and nearly always in {amount(claims.NEARLY_ALWAYS, '%')} of the runs",
        f"a result barely depends on gains below {amount(claims.BARELY, '%')} of variation",
        f"on starts below {amount(claims.BARELY_BY_START, '%')}",
        f"a placement below {amount(claims.SAME_PLACEMENT, '%')} of the side of a robot's share",
        f"gains of other maps cost no more than {amount(claims.REGRET, '%')}",
        f"near the reference is {amount(claims.NEAR_OPTIMUM, '%')}",
        f"and far from it {amount(claims.FAR_FROM_OPTIMUM, '%')}",
    )
    return "; ".join(parts)


def gains_text(contender: Contender) -> str:
    """Return a contender's gains as they are read: "(k_rep 1, rho_0 2, no limit)"."""
    return potential_text(complete_gains(contender), "no limit")


def span(numbers: Sequence[int]) -> str:
    """Return whole numbers, those in a row by their ends.

    >>> span((1, 2, 3)), span((5,)), span((1, 3))
    ('1 to 3', '5', '1, 3')
    """
    if len(numbers) > 2 and list(numbers) == list(range(numbers[0], numbers[-1] + 1)):
        return f"{numbers[0]} to {numbers[-1]}"
    return ", ".join(str(number) for number in numbers)


def listed(values: Sequence[float]) -> str:
    """Return values with commas between.

    >>> listed((0.3, 1.0))
    '0.3, 1'
    """
    return ", ".join(f"{value:g}" for value in values)


def _maps_text(plan: Plan) -> str:
    left_out = ""
    if len(plan.bundled) == len(NON_CONVEX):
        left_out = ", all that are not convex but campus, on which 120 s at 1 m/s are too short"
    return (
        f"{len(plan.bundled)} bundled ({', '.join(plan.bundled)}{left_out}) and {len(plan.generated)} "
        f"generated (seeds {span(plan.generated)}): ten metres square, four to eight obstacles of which "
        f"about "
        f"three in five are convex, one an L and one a U, 16 to 25 % blocked, every passage at least 0.6 "
        f"m wide, "
        f"the free space in one piece."
    )
