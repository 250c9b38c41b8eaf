"""What is run: the studies of the paper, in full and quick, with all their parameters in one place.

1. ``figures-…``: the runs that figures 2 to 8 show;
2. ``gains``: grids of gains on maps of their own, for the claims on gains and for each law's best gains;
3. ``convex``: RAPF and LA in convex regions;
4. ``claims``: all contenders on non-convex maps, none of which was used in 2.

What goes beyond the paper is in `beyond_studies`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from robocov.mapfile import load_map
from robocov_app.replication import beyond_plan
from robocov_app.replication.contenders import (
    LLOYD,
    RAPF_DEFAULT,
    RAPF_SHARED,
    RPF_SHARED,
    Contender,
)
from robocov_app.replication.maps import (
    CONVEX,
    CONVEX_KINDS,
    KINDS,
    NON_CONVEX,
    convex_region,
    with_kinds_of_starts,
)
from robocov_app.sweep.study import Study, StudyMap

if TYPE_CHECKING:
    from robocov.controllers.gains import Value
    from robocov.environment import Environment
    from robocov_app.replication.beyond_plan import BeyondPlan

ROBOTS = 6
"""As in the paper."""

FIGURES = {
    # name of the study: (map, starts, controllers)
    "figures-convex": ("pentagon", ("corner",), (RAPF_SHARED, LLOYD)),
    "figures-a": ("blocks-a", ("paper",), (RAPF_SHARED, RPF_SHARED)),
    "figures-b": ("blocks-b", ("paper", "other"), (RAPF_SHARED, RPF_SHARED)),
}
"""Which runs the figures show. Both maps have the same start "paper"; "other" is figure 8's."""

PARTITION_SEED = 56
"""Seed of the robots in figure 1: none hides the centre of mass of its cell."""


@dataclass(frozen=True)
class Plan:
    """How much is run.

    Attributes
    ----------
    name : {"full", "quick"}
    duration : float, s
        Of every run.
    dt : float, s
        Control period.
    lattice : int
        Of the coverage cost.
    bundled : names of bundled maps of the claims
    generated : seeds of generated maps of the claims
    seeds : seeds of the starts of the claims
    tuning : seeds of generated maps of the grids of gains; none of them is in `generated`
    tuning_starts : names
    tuning_seed : int
        Seed of their starts, which none of the claims has.
    k_rep, rho_0, k_att : values of the grids
    convex_generated : seeds of convex regions, beside the bundled ones
    convex_seeds : seeds of the starts in them
    restarts : int
        Of the search for the centralised reference.
    beyond : BeyondPlan or None
        How much of what goes beyond the paper; None: nothing.
    """

    name: str
    duration: float
    bundled: tuple[str, ...]
    generated: tuple[int, ...]
    seeds: tuple[int, ...]
    tuning: tuple[int, ...]
    tuning_starts: tuple[str, ...]
    k_rep: tuple[float, ...]
    rho_0: tuple[float, ...]
    k_att: tuple[float, ...]
    convex_generated: tuple[int, ...]
    convex_seeds: tuple[int, ...]
    restarts: int
    tuning_seed: int = 1000
    dt: float = 0.02
    lattice: int = 64
    beyond: BeyondPlan | None = None

    @property
    def team(self) -> dict[str, Any]:
        """Parameters of the team, the same for every law.

        The sensors reach as far as the longest repulsion of the grids, so that `rho_0` alone says how far
        an obstacle acts; robots hear each other everywhere.
        """
        return {
            "radius": 0.1,
            "max_speed": 1.0,
            "max_acceleration": 2.0,
            "viscosity": 2.0,
            "sensing_range": 6.0,
            "communication_range": None,
        }


FULL = Plan(
    name="full",
    duration=120.0,
    bundled=NON_CONVEX,
    generated=tuple(range(1, 21)),
    seeds=(0, 1, 2, 3),
    tuning=tuple(range(101, 107)),
    tuning_starts=KINDS,
    k_rep=(0.1, 0.3, 1.0, 3.0, 10.0),
    rho_0=(1.0, 2.0, 3.0, 6.0),
    k_att=(1.0, 3.0, 10.0, 30.0),
    convex_generated=tuple(range(6)),
    convex_seeds=(0, 1, 2, 3),
    restarts=24,
    beyond=beyond_plan.FULL,
)
"""33 non-convex maps, 8 convex regions, 6 maps for gains."""

QUICK = Plan(
    name="quick",
    duration=60.0,
    bundled=("blocks-a", "blocks-b", "rooms"),
    generated=(1, 2, 3),
    seeds=(0,),
    tuning=tuple(range(101, 106)),
    tuning_starts=("corner", "uniform"),
    k_rep=(0.3, 3.0),
    rho_0=(2.0, 6.0),
    k_att=(3.0, 30.0),
    convex_generated=(0, 1, 2),
    convex_seeds=(0,),
    restarts=8,
    beyond=beyond_plan.QUICK,
)
"""Enough to see that everything works, too little to decide much; ends within four minutes."""


def generated_test_map(seed: int) -> Environment:
    """Return a non-convex map drawn by chance, with the study's starts.

    Four to eight obstacles, of five about three convex, one an L and one a U, block 16 to 25 % of a square
    of ten metres; every passage is at least 0.6 m wide, and the free space is in one piece. See
    `robocov.generator`.

    Parameters
    ----------
    seed : int
        The same seed gives the same map.
    """
    from robocov.generator import generated_map

    rng = np.random.default_rng([seed, 2])
    environment = generated_map(
        seed,
        kind="polygons",
        obstacles=int(rng.integers(4, 9)),
        area=round(float(rng.uniform(0.16, 0.25)), 3),
        gap=0.6,
        side=10.0,
    )
    return with_kinds_of_starts(environment)


def claim_maps(plan: Plan) -> tuple[StudyMap, ...]:
    """Return the non-convex maps on which the claims are tested."""
    bundled = [StudyMap(name, with_kinds_of_starts(load_map(name))) for name in plan.bundled]
    return (*bundled, *_generated(plan.generated, generated_test_map, "generated"))


def tuning_maps(plan: Plan) -> tuple[StudyMap, ...]:
    """Return the non-convex maps of the grids of gains."""
    return _generated(plan.tuning, generated_test_map, "generated")


def convex_maps(plan: Plan) -> tuple[StudyMap, ...]:
    """Return the convex regions."""
    bundled = [StudyMap(name, with_kinds_of_starts(load_map(name), CONVEX_KINDS)) for name in CONVEX]
    return (
        *bundled,
        *_generated(
            plan.convex_generated,
            lambda seed: with_kinds_of_starts(convex_region(seed), CONVEX_KINDS),
            "convex",
        ),
    )


def figure_studies(plan: Plan) -> dict[str, Study]:
    """Return the studies whose runs the figures show; their paths and costs are kept finely."""
    return {
        name: study_of(
            plan,
            (StudyMap(map_, load_map(map_)),),
            contenders,
            starts,
            (0,),
            lattice=2 * plan.lattice,
            cost_hz=5.0,
            record_hz=10.0,
        )
        for name, (map_, starts, contenders) in FIGURES.items()
    }


def probe_study(plan: Plan) -> Study:
    """Return one run of each law, by which the time of the others is estimated."""
    maps = (StudyMap("blocks-a", load_map("blocks-a")),)
    return study_of(plan, maps, (RAPF_SHARED, RPF_SHARED, LLOYD), ("paper",), (0,))


def gain_sets(plan: Plan) -> dict[str, list[dict[str, Value]]]:
    """Return the grids of gains: the same potential for both laws, RAPF with every attraction beside it."""
    potential = [{"k_rep": k, "rho_0": r} for k, r in product(plan.k_rep, plan.rho_0)]
    attracted: list[dict[str, Value]] = [
        {**both, "k_att": k_att, "attraction_limit": None} for k_att in plan.k_att for both in potential
    ]
    return {"rapf": attracted, "rpf": [dict(both) for both in potential]}


def gains_study(plan: Plan) -> Study:
    """Return the grids of gains on the maps of the tuning."""
    return Study(
        maps=tuning_maps(plan),
        controllers=("rapf", "rpf"),
        gains=gain_sets(plan),
        starts=plan.tuning_starts,
        seeds=(plan.tuning_seed,),
        **_common(plan),
    )


def convex_contenders(best: Mapping[str, Contender]) -> tuple[Contender, ...]:
    """Return who takes part in convex regions."""
    return (RAPF_SHARED, best["rapf"], RAPF_DEFAULT, LLOYD)


def convex_study(plan: Plan, best: Mapping[str, Contender]) -> Study:
    """Return the study of convex regions."""
    return study_of(plan, convex_maps(plan), convex_contenders(best), CONVEX_KINDS, plan.convex_seeds)


def claim_contenders(best: Mapping[str, Contender]) -> tuple[Contender, ...]:
    """Return who takes part on non-convex maps."""
    return (RAPF_SHARED, best["rapf"], RAPF_DEFAULT, RPF_SHARED, best["rpf"], LLOYD)


def claims_study(plan: Plan, best: Mapping[str, Contender]) -> Study:
    """Return the study of non-convex maps."""
    return study_of(plan, claim_maps(plan), claim_contenders(best), KINDS, plan.seeds)


def distinct(contenders: Sequence[Contender]) -> list[tuple[str, dict[str, Value]]]:
    """Return the controllers with their gains, each once, in the order in which a study runs them.

    A law's best gains may be the shared ones: then there is one run for both contenders.
    """
    order = list(dict.fromkeys(contender.controller for contender in contenders))
    found: list[tuple[str, dict[str, Value]]] = []
    for controller in order:
        for contender in contenders:
            entry = (controller, complete_gains(contender))
            if contender.controller == controller and entry not in found:
                found.append(entry)
    return found


def complete_gains(contender: Contender) -> dict[str, Value]:
    """Return all gains of a contender, the controller's defaults among them."""
    from robocov.controllers import gain_values, make_controller

    return dict(gain_values(make_controller(contender.controller, contender.gains)))


def study_of(
    plan: Plan,
    maps: tuple[StudyMap, ...],
    contenders: Sequence[Contender],
    starts: Sequence[str],
    seeds: Sequence[int],
    **other: Any,
) -> Study:
    """Return the study of some contenders, in which all else is as the plan has it but for `other`."""
    gains: dict[str, list[dict[str, Value]]] = {}
    for controller, choice in distinct(contenders):
        gains.setdefault(controller, []).append(choice)
    return Study(
        maps=maps,
        controllers=tuple(gains),
        gains=gains,
        starts=starts,
        seeds=seeds,
        **{**_common(plan), **other},
    )


def _common(plan: Plan) -> dict[str, Any]:
    return {
        "robots": (ROBOTS,),
        "duration": plan.duration,
        "dt": plan.dt,
        "lattice": plan.lattice,
        "cost_hz": 2.0,
        "record_hz": 0.0,
        **plan.team,
    }


def _generated(seeds: Sequence[int], make: Callable[[int], Environment], name: str) -> tuple[StudyMap, ...]:
    return tuple(StudyMap(f"{name}-{seed}", make(seed)) for seed in seeds)
