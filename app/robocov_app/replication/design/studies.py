"""The sweeps of the study, each with the name of its folder.

``gains`` and ``rival-gains`` are gain grids on separate maps, from which the best gains are chosen.
``claims`` contains the runs of the paper's contenders, ``limited`` those at limited ranges, ``rivals`` and
``ours-…`` those of all others on the same maps and from the same starts. In ``density`` RAPF knows the
density, in ``density-ignored`` it does not.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, NamedTuple, TypeAlias

from robocov.controllers import CONTROLLERS
from robocov.controllers.gains import Value
from robocov.mapfile import load_map
from robocov_app.replication.design import contenders
from robocov_app.replication.design.contenders import (
    LLOYD,
    OWN,
    RAPF_DEFAULT,
    RAPF_SHARED,
    RPF_SHARED,
    Contender,
)
from robocov_app.replication.design.plan import (
    LIMITED_RANGES,
    ROBOTS,
    TEAM,
    Plan,
)
from robocov_app.replication.design.study_maps import (
    build_baseline_maps,
    build_claim_maps,
    build_convex_maps,
    build_density_maps,
    build_generated_maps,
    build_tuning_maps,
    build_unseen_maps,
    load_study_map,
)
from robocov_app.sweep.study.parameters import TEAM_PARAMETERS
from robocov_app.sweep.study.study import Study, StudyMap


class FigureCase(NamedTuple):
    """Runs shown in some figures of the paper."""

    map: str
    starts: tuple[str, ...]
    contenders: tuple[Contender, ...]


FIGURE_CASES = {
    "figures-convex": FigureCase("pentagon", ("corner",), (RAPF_SHARED, LLOYD)),
    "figures-a": FigureCase("blocks-a", ("paper",), (RAPF_SHARED, RPF_SHARED)),
    "figures-b": FigureCase("blocks-b", ("paper", "other"), (RAPF_SHARED, RPF_SHARED)),
}
"""Runs of the figures by sweep; "paper" is the same start on both maps, "other" the start of figure 8."""

FIGURE_CHANGES = {"limited": ("figures-a", "figures-b"), "half-step": ("figures-a",)}
"""Sweeps of figures that are repeated at limited ranges, and with half the control period."""

DENSITY_MAP = "hospital"
DENSITY_START = "reception"
"""Map and start of the figure about the density."""

GROUPS = (
    {"count": 2, "max_speed": 1.0},
    {"count": 2, "max_speed": 0.5},
    {"count": 2, "max_speed": 0.25},
)
"""Groups of a team with mixed speeds, m/s."""

Axes: TypeAlias = Mapping[str, tuple[float | None, ...]]
"""Values of each disturbance; the first value means that there is none."""
AXES: Axes = {
    "loss": (0.0, 0.3, 0.6, 0.9),
    "delay": (0.0, 0.5, 1.0, 2.0),
    "communication_range": (None, 6.0, 4.0, 2.0),
    "position_noise": (0.0, 0.05, 0.1, 0.2),
    "sensing_noise": (0.0, 0.05, 0.1, 0.2),
    "failure_rate": (0.0, 0.005, 0.01, 0.02),
}
"""Disturbances, from none to strong."""
COMMON_CONDITIONS = {"message_rate": 2.0}
"""Conditions of all these runs, also the ideal ones: with 60 messages per second, no loss would matter."""
DISTURBED = ("rapf", "lloyd")
"""Controllers that run with every value of `AXES`; all others run only at `STRONG_INDEX`, with one seed."""
STRONG_INDEX = 2
"""Index in `AXES` of a strong disturbance."""
BASELINE_GAINS = "rival-gains"
"""Name of the sweep of the baselines' gain grids."""
_CONDITIONS_DT_S = 1 / 60
_COST_RATE_HZ = 2.0


@dataclass(frozen=True, eq=False)
class Contest:
    """A sweep and its contenders."""

    study: Study
    contenders: tuple[Contender, ...]


class Disturbances(NamedTuple):
    """Controllers, and the disturbances with which they run."""

    controllers: tuple[str, ...]
    seeds: int
    """Number of seeds."""
    axes: Axes


def build_contest(
    plan: Plan,
    maps: Sequence[StudyMap],
    participants: Sequence[Contender],
    starts: Sequence[str],
    seeds: Sequence[int],
    **changes: Any,
) -> Contest:
    """Build the sweep of contenders on maps, with the common options of the study.

    Parameters
    ----------
    plan : Plan
    maps : sequence of StudyMap
    participants : sequence of Contender
    starts : sequence of str
    seeds : sequence of int
    **changes
        Options of the sweep that differ from the common ones.

    Returns
    -------
    Contest
    """
    gains = contenders.collect_gain_sets(participants)
    study = Study(
        maps=tuple(maps),
        controllers=tuple(gains),
        gains=gains,
        starts=starts,
        seeds=seeds,
        metrics=True,
        **(_build_common_options(plan) | changes),
    )
    return Contest(study, tuple(participants))


def _build_common_options(plan: Plan) -> dict[str, Any]:
    """Return the options that all sweeps of contenders and gain grids have in common."""
    return {
        "robots": (ROBOTS,),
        "cost_hz": _COST_RATE_HZ,
        "record_hz": 0.0,
        "duration": plan.duration,
        "dt": plan.dt,
        "lattice": plan.lattice,
        **TEAM,
    }


def build_figure_studies(plan: Plan) -> dict[str, Study]:
    """Build the sweeps of the figures, with the shared gains.

    In addition to the sweeps of `FIGURE_CASES`, there are those of `FIGURE_CHANGES`.

    Returns
    -------
    dict
        Sweeps by name.
    """
    studies = {}
    for name, case in FIGURE_CASES.items():
        studies[name] = _build_figure_study(plan, case, case.contenders)
    for variant, names in FIGURE_CHANGES.items():
        changes = LIMITED_RANGES if variant == "limited" else {"dt": plan.dt / 2.0}
        for name in names:
            case = FIGURE_CASES[name]
            studies[f"{name}-{variant}"] = _build_figure_study(plan, case, case.contenders, **changes)
    return studies


def build_best_figure_studies(plan: Plan, paper_contenders: Sequence[Contender]) -> dict[str, Study]:
    """Build the sweeps of figures 4 to 8 with the best gains; empty if no best gains are known.

    Returns
    -------
    dict
        Sweeps by name.
    """
    best = tuple(contender for contender in paper_contenders if contender.key.endswith("-best"))
    if not best:
        return {}
    studies = {}
    for name, case in FIGURE_CASES.items():
        # Figures that compare with Lloyd's algorithm are not drawn for the best gains.
        if LLOYD not in case.contenders:
            studies[f"{name}-best"] = _build_figure_study(plan, case, best)
    return studies


def _build_figure_study(
    plan: Plan, case: FigureCase, participants: Sequence[Contender], **changes: float
) -> Study:
    """Build the sweep of a case; trajectories and costs are recorded in fine steps."""
    contest = build_contest(
        plan,
        maps=(StudyMap(case.map, load_map(case.map)),),
        participants=participants,
        starts=case.starts,
        seeds=(0,),
        lattice=2 * plan.lattice,
        cost_hz=5.0,
        record_hz=10.0,
        **changes,
    )
    return contest.study


def list_gain_sets(plan: Plan) -> dict[str, list[dict[str, Value]]]:
    """Return the gain grids: the same potentials for both, combined with each attraction for RAPF."""
    potentials = list(contenders.combine_gains(k_rep=plan.k_rep, rho_0=plan.rho_0))
    attractions = contenders.combine_gains(k_att=plan.k_att, attraction_limit=(None,))
    rapf = [potential | attraction for attraction, potential in product(attractions, potentials)]
    return {"rapf": rapf, "rpf": potentials}


def build_gains_study(plan: Plan) -> Study:
    """Build the sweep of the gain grids of RAPF and RPF."""
    return Study(
        build_tuning_maps(plan),
        ("rapf", "rpf"),
        list_gain_sets(plan),
        starts=plan.tuning_starts,
        seeds=(plan.tuning_seed,),
        **_build_common_options(plan),
    )


def build_convex_contest(plan: Plan, paper_contenders: Sequence[Contender]) -> Contest:
    """Build the sweep of the paper's contenders in convex regions, where RPF does not run."""
    participants = [contender for contender in paper_contenders if contender.controller != "rpf"]
    return build_contest(plan, build_convex_maps(plan), participants, plan.convex_starts, plan.convex_seeds)


def build_claims_contest(plan: Plan, paper_contenders: Sequence[Contender]) -> Contest:
    """Build the sweep of the paper's contenders on non-convex maps."""
    return build_contest(plan, build_claim_maps(plan), paper_contenders, plan.starts, plan.seeds)


def build_limited_contest(plan: Plan, paper_contenders: Sequence[Contender]) -> Contest:
    """Build the sweep of the paper's contenders on non-convex maps at limited ranges."""
    maps = build_claim_maps(plan)
    return build_contest(
        plan, maps, paper_contenders, plan.limited_starts, plan.limited_seeds, **LIMITED_RANGES
    )


def build_baseline_gains_study(plan: Plan) -> Study | None:
    """Build the sweep of the baselines' gain grids; None if the plan does not tune them."""
    if not plan.beyond.tuning:
        return None
    participants = []
    for name, gain_sets in contenders.GAIN_GRIDS.items():
        participants += [contenders.build_contender(name, gains) for gains in gain_sets]
    maps = build_generated_maps(plan.beyond.tuning)
    return build_contest(plan, maps, participants, plan.tuning_starts, (plan.tuning_seed,)).study


def build_beyond_contests(
    plan: Plan, best: contenders.BestGains, paper_contenders: Sequence[Contender]
) -> dict[str, Contest]:
    """Build the sweeps of contenders beyond the paper, without the gain grids.

    Parameters
    ----------
    plan : Plan
    best : Mapping
        The best gains of the baselines; baselines without an entry keep their defaults.
    paper_contenders : sequence of Contender
        The paper's contenders; the strongest also run on the unseen maps.

    Returns
    -------
    dict
        Sweeps by name.
    """
    beyond = plan.beyond
    maps = build_generated_maps(beyond.maps)
    contests = {}
    participants_by_sweep = {"rivals": contenders.build_baselines(best)}
    participants_by_sweep |= {f"ours-{contender.key}": (contender,) for contender in OWN}
    for name, participants in participants_by_sweep.items():
        seeds = beyond.get_seeds(participants[0].controller)
        contests[name] = build_contest(plan, build_baseline_maps(plan), participants, beyond.starts, seeds)
    if beyond.unseen:
        strongest = (OWN[0], *contenders.select_strongest(paper_contenders))
        unseen = build_unseen_maps(plan)
        contests["unseen"] = build_contest(plan, unseen, strongest, beyond.starts, beyond.seeds)
    contests["targets"] = build_contest(plan, maps, contenders.TARGETS, beyond.map_starts, (0,))
    contests |= _build_density_contests(plan)
    contests["teams"] = build_contest(plan, maps, contenders.TEAMS, beyond.map_starts, (0,), group=GROUPS)
    return contests


def _build_density_contests(plan: Plan) -> dict[str, Contest]:
    """Build the sweeps of RAPF with and without knowledge of the density, and those for the figure."""
    hospital = load_map(DENSITY_MAP)
    # Maps of the sweep and map of the figure, by the suffix of their names.
    variants = {
        "": (build_density_maps(plan), hospital),
        "-ignored": (build_generated_maps(plan.beyond.maps), replace(hospital, density=None)),
    }
    contests = {}
    for suffix, (maps, figure_map) in variants.items():
        contests[f"density{suffix}"] = build_contest(
            plan,
            maps,
            participants=(RAPF_DEFAULT,),
            starts=plan.beyond.map_starts,
            seeds=(0,),
        )
        contests[f"density-picture{suffix}"] = build_contest(
            plan,
            (StudyMap(DENSITY_MAP, figure_map),),
            participants=(RAPF_DEFAULT,),
            starts=(DENSITY_START,),
            seeds=(0,),
            record_hz=5.0,
        )
    return contests


def list_disturbances(plan: Plan) -> dict[str, Disturbances]:
    """Return the disturbances by the prefix of their sweeps' names."""
    strong_only = {name: (values[0], values[STRONG_INDEX]) for name, values in AXES.items()}
    others = tuple(name for name in CONTROLLERS if name not in DISTURBED)
    axes = strong_only if plan.name == "quick" else AXES
    return {
        "conditions": Disturbances(DISTURBED, plan.beyond.conditions_seeds, axes),
        "conditions-others": Disturbances(others, 1, strong_only),
    }


def build_conditions_studies(plan: Plan) -> dict[str, Study]:
    """Build the sweeps with disturbances, and those under ideal conditions that they are compared with."""
    studies = {}
    for prefix, disturbances in list_disturbances(plan).items():
        options: dict[str, Any] = {
            "maps": tuple(StudyMap(name, load_map(name)) for name in plan.beyond.conditions_maps),
            "controllers": disturbances.controllers,
            "robots": (ROBOTS,),
            "seeds": range(disturbances.seeds),
            "duration": plan.beyond.conditions_duration,
            "dt": _CONDITIONS_DT_S,
            "lattice": plan.lattice,
            "cost_hz": 0.0,
            "record_hz": 0.0,
            "conditions": COMMON_CONDITIONS,
        }
        studies[f"{prefix}-ideal"] = Study(**options)
        for name, values in disturbances.axes.items():
            # The first value is the ideal one.
            disturbed = list(values[1:])
            changes: dict[str, Any] = {"conditions": {**COMMON_CONDITIONS, name: disturbed}}
            if name in TEAM_PARAMETERS:
                changes = {name: disturbed}
            studies[f"{prefix}-{name.replace('_', '-')}"] = Study(**{**options, **changes})
    return studies


def build_probe_studies(plan: Plan, *, beyond: bool) -> list[Study]:
    """Build sweeps with one run of each controller, from which the computing time of the study is estimated.

    Parameters
    ----------
    plan : Plan
    beyond : bool
        Whether to include the controllers beyond the paper, with shorter runs.

    Returns
    -------
    list of Study
    """
    name = "blocks-a"
    paper_contenders = (RAPF_SHARED, RPF_SHARED, LLOYD)
    paper_maps = (StudyMap(name, load_map(name)),)
    studies = [build_contest(plan, paper_maps, paper_contenders, ("paper",), (0,)).study]
    if beyond:
        short_plan = replace(plan, duration=min(plan.beyond.probe, plan.duration))
        maps = (load_study_map(name),)
        others = (*contenders.build_baselines({}), *OWN)
        studies += [
            build_contest(short_plan, maps, (contender,), ("corner",), (0,)).study for contender in others
        ]
    return studies
