"""The sweeps of the study, each with its folder's name.

1. ``figures-…``: the runs that figures 2 to 8 show;
2. ``gains``: grids of gains on maps of their own, for the claims on gains and for the best gains;
3. ``convex``: RAPF and LA in convex regions;
4. ``claims``: the paper's contenders on non-convex maps, none of which was used in 2.

Beyond the paper:

5. ``rival-gains``: grids of the baselines' gains, on maps of their own;
6. ``ours-…``, ``rivals``: every registered controller, on the maps of the claims and from the same starts;
7. ``unseen``: ours on maps that played no part in its development;
8. ``targets``: RAPF heading for another optimum of its cell than the centroid;
9. ``density``, ``density-ignored``: RAPF that knows which places count more, and RAPF that does not;
10. ``teams``: robots of different speeds, with cells by distance and by time;
11. ``conditions-…``: disturbances, one sweep for each axis of `AXES`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

from robocov.controllers.gains import Value
from robocov.mapfile import load_map
from robocov_app.replication import maps
from robocov_app.replication.contenders import (
    GRIDS,
    LLOYD,
    OWN,
    RAPF_DEFAULT,
    RAPF_SHARED,
    RPF_SHARED,
    TARGETS,
    TEAMS,
    UNTUNED,
    Contender,
    baselines,
    distinct_gains,
    grid,
    strongest,
    with_gains,
)
from robocov_app.replication.plan import ROBOTS, TEAM, Plan
from robocov_app.sweep import study as sweep_study
from robocov_app.sweep.study import Study, StudyMap

FIGURES = {
    # name of the study: (map, starts, contenders)
    "figures-convex": ("pentagon", ("corner",), (RAPF_SHARED, LLOYD)),
    "figures-a": ("blocks-a", ("paper",), (RAPF_SHARED, RPF_SHARED)),
    "figures-b": ("blocks-b", ("paper", "other"), (RAPF_SHARED, RPF_SHARED)),
}
"""Which runs the figures show. Both maps have the same start "paper"; "other" is figure 8's."""

DENSITY_MAP, DENSITY_START = "hospital", "reception"
"""Of the picture of a density."""

GROUPS = ({"count": 2, "max_speed": 1.0}, {"count": 2, "max_speed": 0.5}, {"count": 2, "max_speed": 0.25})
"""A team of robots of different speeds."""

AXES: Mapping[str, tuple[float | None, ...]] = {
    "loss": (0.0, 0.3, 0.6, 0.9),
    "delay": (0.0, 0.5, 1.0, 2.0),
    "communication_range": (None, 6.0, 4.0, 2.0),
    "position_noise": (0.0, 0.05, 0.1, 0.2),
    "sensing_noise": (0.0, 0.05, 0.1, 0.2),
    "failure_rate": (0.0, 0.005, 0.01, 0.02),
}
"""Disturbances, from none to bad; the first value of each is the ideal."""

ALWAYS = {"message_rate": 2.0}
"""Conditions of all these runs, the ideal ones as well: of sixty messages a second nobody would miss one."""

DISTURBED = ("rapf", "lloyd")
"""Controllers that are disturbed."""


@dataclass(frozen=True, eq=False)
class Contest:
    """A sweep, and which contenders take part in it."""

    study: Study
    contenders: tuple[Contender, ...]


@cache
def claim_maps(plan: Plan) -> tuple[StudyMap, ...]:
    """Return the non-convex maps on which the claims are tested."""
    return (*map(maps.bundled, plan.bundled), *map(maps.generated, plan.generated))


@cache
def tuning_maps(plan: Plan) -> tuple[StudyMap, ...]:
    """Return the non-convex maps of the grids of gains."""
    return tuple(map(maps.generated, plan.tuning))


@cache
def convex_maps(plan: Plan) -> tuple[StudyMap, ...]:
    """Return the convex regions."""
    bundled = (maps.bundled(name, maps.CONVEX_KINDS) for name in maps.CONVEX)
    return (*bundled, *map(maps.convex_region, plan.convex_generated))


def baseline_maps(plan: Plan) -> tuple[StudyMap, ...]:
    """Return the maps of baselines and ours: those of the claims, or some of them."""
    bundled, generated = plan.beyond.bundled, plan.beyond.generated
    wanted = {
        *(plan.bundled if bundled is None else bundled),
        *(f"generated-{seed}" for seed in (plan.generated if generated is None else generated)),
    }
    return tuple(each for each in claim_maps(plan) if each.name in wanted)


@cache
def unseen_maps(plan: Plan) -> tuple[StudyMap, ...]:
    """Return generated maps that played no part in the development of our own controller."""
    return tuple(map(maps.generated, plan.beyond.unseen))


@cache
def small_maps(plan: Plan) -> tuple[StudyMap, ...]:
    """Return the generated maps of targets, density and mixed teams."""
    return tuple(map(maps.generated, plan.beyond.maps))


def density_maps(plan: Plan) -> tuple[StudyMap, ...]:
    """Return the small maps with a density."""
    return tuple(map(maps.with_hot_spots, small_maps(plan), plan.beyond.maps))


def contest(
    plan: Plan,
    on: Sequence[StudyMap],
    contenders: Sequence[Contender],
    starts: Sequence[str],
    seeds: Sequence[int],
    **other: Any,
) -> Contest:
    """Return a sweep of contenders, in which all else is as the plan has it but for `other`."""
    gains = distinct_gains(contenders)
    study = Study(
        maps=tuple(on),
        controllers=tuple(gains),
        gains=gains,
        starts=starts,
        seeds=seeds,
        **{**_common(plan), **other},
    )
    return Contest(study, tuple(contenders))


def figure_studies(plan: Plan) -> dict[str, Study]:
    """Return the sweeps whose runs the figures show; their paths and costs are kept finely."""
    finely = {"lattice": 2 * plan.lattice, "cost_hz": 5.0, "record_hz": 10.0}
    return {
        name: contest(plan, (StudyMap(on, load_map(on)),), contenders, starts, (0,), **finely).study
        for name, (on, starts, contenders) in FIGURES.items()
    }


def gain_sets(plan: Plan) -> dict[str, list[dict[str, Value]]]:
    """Return the grids of gains: the same potential for both, RAPF with every attraction beside it."""
    potential = grid(k_rep=plan.k_rep, rho_0=plan.rho_0)
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


def convex_contest(plan: Plan, contenders: Sequence[Contender]) -> Contest:
    """Return all but RPF in convex regions."""
    part = [each for each in contenders if each.controller != "rpf"]
    return contest(plan, convex_maps(plan), part, maps.CONVEX_KINDS, plan.convex_seeds)


def claims_contest(plan: Plan, contenders: Sequence[Contender]) -> Contest:
    """Return all of the paper's contenders on non-convex maps."""
    return contest(plan, claim_maps(plan), contenders, maps.KINDS, plan.seeds)


def baseline_gains_study(plan: Plan) -> Study | None:
    """Return the grids of the baselines' gains on some maps of the tuning; None where there are none."""
    if not plan.beyond.tuning:
        return None
    on = [maps.generated(seed) for seed in plan.beyond.tuning]
    sets = [with_gains(name, gains) for name, each in GRIDS.items() for gains in each]
    return contest(plan, on, sets, plan.tuning_starts, (plan.tuning_seed,)).study


def baseline_contests(plan: Plan, best: Mapping[str, Mapping[str, Value]]) -> dict[str, Contest]:
    """Return the baselines, with their `best` gains or their defaults, and each of ours."""
    beyond, on = plan.beyond, baseline_maps(plan)
    parts = {"rivals": baselines(best)} | {f"ours-{each.key}": (each,) for each in OWN}
    return {
        name: contest(plan, on, part, beyond.starts, beyond.seeds_of(part[0].controller))
        for name, part in parts.items()
        if part
    }


def unseen_contest(plan: Plan, papers: Sequence[Contender]) -> Contest | None:
    """Return ours and the strongest of the paper's on maps that nobody looked at; None without any."""
    beyond = plan.beyond
    if not beyond.unseen:
        return None
    return contest(plan, unseen_maps(plan), (OWN[0], *strongest(papers)), beyond.starts, beyond.seeds)


def small_contests(plan: Plan) -> dict[str, Contest]:
    """Return targets, density and mixed teams."""
    starts, on = plan.beyond.map_starts, small_maps(plan)
    known = load_map(DENSITY_MAP)
    start = DENSITY_START if DENSITY_START in known.starts else known.start().name
    picture = {
        name: contest(
            plan, (StudyMap(DENSITY_MAP, environment),), (RAPF_DEFAULT,), (start,), (0,), record_hz=5.0
        )
        for name, environment in (
            ("density-picture", known),
            ("density-picture-ignored", replace(known, density=None)),
        )
    }
    return {
        "targets": contest(plan, on, TARGETS, starts, (0,)),
        "density": contest(plan, density_maps(plan), (RAPF_DEFAULT,), starts, (0,)),
        "density-ignored": contest(plan, on, (RAPF_DEFAULT,), starts, (0,)),
        **picture,
        "teams": contest(plan, on, TEAMS, starts, (0,), group=GROUPS),
    }


def axes_of_disturbances(plan: Plan) -> dict[str, tuple[float | None, ...]]:
    """Return all values of each axis, or two of them."""
    quick = plan.name == "quick"
    return {name: (values[0], values[2]) if quick else values for name, values in AXES.items()}


def conditions_studies(plan: Plan) -> dict[str, Study]:
    """Return the sweep of the ideal runs, and one for each axis of disturbances."""
    common: dict[str, Any] = {
        "maps": tuple(StudyMap(name, load_map(name)) for name in plan.beyond.conditions_maps),
        "controllers": DISTURBED,
        "robots": (ROBOTS,),
        "seeds": range(plan.beyond.conditions_seeds),
        "duration": plan.beyond.conditions_duration,
        "dt": 1 / 60,
        "lattice": plan.lattice,
        "cost_hz": 0.0,
        "record_hz": 0.0,
    }
    found = {"conditions-ideal": Study(**common, conditions=dict(ALWAYS))}
    for name, (_, *bad) in axes_of_disturbances(plan).items():
        changed: dict[str, Any] = {"conditions": {**ALWAYS, name: bad}}
        if name in sweep_study.TEAM:
            changed = {name: bad, "conditions": dict(ALWAYS)}
        found[f"conditions-{name.replace('_', '-')}"] = Study(**common, **changed)
    return found


def beyond_studies(
    plan: Plan, best: Mapping[str, Mapping[str, Value]], papers: Sequence[Contender]
) -> dict[str, Study]:
    """Return all sweeps beyond the paper but that of the baselines' gains."""
    contests = baseline_contests(plan, best)
    if (unseen := unseen_contest(plan, papers)) is not None:
        contests["unseen"] = unseen
    contests |= small_contests(plan)
    return {name: each.study for name, each in contests.items()} | conditions_studies(plan)


def paper_probe(plan: Plan) -> Study:
    """Return one run of each of the paper's controllers, by which the time of the others is estimated."""
    on = (StudyMap("blocks-a", load_map("blocks-a")),)
    return contest(plan, on, (RAPF_SHARED, RPF_SHARED, LLOYD), ("paper",), (0,)).study


def beyond_probes(plan: Plan) -> list[Study]:
    """Return one short run of each contender, by which the time of the others is estimated."""
    short = replace(plan, duration=min(plan.beyond.probe, plan.duration))
    on = (maps.bundled("blocks-a"),)
    contenders = (*UNTUNED, *baselines({}), *OWN)
    return [contest(short, on, (each,), ("corner",), (0,)).study for each in contenders]


def _common(plan: Plan) -> dict[str, Any]:
    return {
        "robots": (ROBOTS,),
        "duration": plan.duration,
        "dt": plan.dt,
        "lattice": plan.lattice,
        "cost_hz": 2.0,
        "record_hz": 0.0,
        **TEAM,
    }
