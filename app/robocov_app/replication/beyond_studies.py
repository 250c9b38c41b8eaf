"""What is run beyond the paper, study by study, with all parameters in one place.

1. ``rival-gains``: grids of the rivals' gains, on maps of their own (see `rival_gains`);
2. ``ours``, ``ours-shared``, ``rivals``: every registered controller, on the maps of the claims and from the
   same starts as those of the paper, whose runs are used;
3. ``targets``: RAPF heading for another optimum of its cell than the centroid;
4. ``density``, ``density-ignored``: RAPF that knows what places count, and RAPF that does not;
5. ``teams``: robots that are not equally fast, with cells by distance and by time;
6. ``conditions-…``: what goes wrong, one study for each axis of `robocov_app.replication.degradation`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from robocov.controllers import CONTROLLERS
from robocov.density import Gaussian, Gaussians
from robocov.mapfile import load_map
from robocov_app.replication.beyond_plan import IN_CLAIMS, OURS, BeyondPlan
from robocov_app.replication.contenders import (
    LLOYD,
    RAPF_DEFAULT,
    RAPF_SHARED,
    RPF_SHARED,
    Contender,
    strongest,
)
from robocov_app.replication.degradation import AXES, DegradationPlan
from robocov_app.replication.maps import with_kinds_of_starts
from robocov_app.replication.plan import Plan, claim_maps, generated_test_map, study_of
from robocov_app.sweep.study import TEAM, Study, StudyMap

if TYPE_CHECKING:
    from robocov.environment import Environment

NOT_TUNED: Mapping[str, Contender] = {}
"""Rivals have their default gains."""

UNTUNED = (RAPF_SHARED, RAPF_DEFAULT, RPF_SHARED, LLOYD)
"""Contenders of the claims that take part whether the grids of gains have been run or not."""

TARGETS = (
    Contender("centroid", "the centroid", "rapf", {}),
    Contender("median", "the geometric median", "rapf", {"target": "median"}),
    Contender("sensing", "a sensor's best place, h = 1 m", "rapf", {"target": "sensing"}),
)
"""What RAPF heads for in its cell."""

GROUPS = ({"count": 2, "max_speed": 1.0}, {"count": 2, "max_speed": 0.5}, {"count": 2, "max_speed": 0.25})
"""A team of robots that are not equally fast."""

TEAMS = tuple(
    Contender(f"{name}-{cells}", f"{CONTROLLERS[name].label}, cells by {cells}", name, {"cells": cells})
    for name in ("rapf", "lloyd")
    for cells in ("distance", "time")
)
"""Laws in it, with each kind of cells."""

WEIGHED_MAP = "hospital"
"""The map of the picture of a density, and"""

WEIGHED_START = "reception"

HOT_SPOTS = 2
"""Gaussians that are drawn by chance on each map: 20 times as much counts a place in the middle of one."""

UNSEEN = "unseen"
"""Name of the study of our own controller on maps that played no part in its development."""

BAD = 2
"""Values of each axis of what goes wrong that the quick study takes: the ideal one, and the middle one."""


def of(plan: Plan) -> BeyondPlan:
    """Return how much of it there is."""
    assert plan.beyond is not None
    return plan.beyond


def rivals(tuned: Mapping[str, Contender] = NOT_TUNED) -> tuple[Contender, ...]:
    """Return all registered controllers that are neither the paper's nor ours.

    Parameters
    ----------
    tuned : dict of controller to Contender
        Those with their best gains; all others have their default ones.
    """
    names = [name for name in CONTROLLERS if name not in (*IN_CLAIMS, *OURS)]
    return tuple(tuned.get(name) or contender(name) for name in names)


def ours() -> tuple[Contender, ...]:
    """Return our own controllers, that for which the goals are first."""
    return tuple(contender(name) for name in OURS if name in CONTROLLERS)


def contender(name: str) -> Contender:
    """Return a controller with its default gains."""
    return Contender(name, CONTROLLERS[name].label, name, {})


def rival_maps(plan: Plan) -> tuple[StudyMap, ...]:
    """Return the maps of rivals and ours: those of the claims, or some of them."""
    beyond = of(plan)
    wanted = replace(
        plan,
        bundled=plan.bundled if beyond.bundled is None else beyond.bundled,
        generated=plan.generated if beyond.generated is None else beyond.generated,
    )
    return claim_maps(wanted)


def rival_studies(
    plan: Plan, tuned: Mapping[str, Contender] = NOT_TUNED
) -> dict[str, tuple[Study, tuple[Contender, ...]]]:
    """Return the studies of rivals and ours with who takes part, by name; `tuned` is that of `rivals`."""
    beyond, found = of(plan), {}
    parts = {"rivals": rivals(tuned)}
    parts |= {f"ours-{each.key}": (each,) for each in ours()}
    maps = rival_maps(plan)
    for name, part in parts.items():
        if part:
            seeds = beyond.seeds_of(part[0].controller)
            found[name] = study_of(plan, maps, part, beyond.starts, seeds), part
    return found


def unseen_maps(plan: Plan) -> tuple[StudyMap, ...]:
    """Return generated maps that played no part in the development of our own controller."""
    return tuple(StudyMap(f"generated-{seed}", generated_test_map(seed)) for seed in of(plan).unseen)


def unseen_study(
    plan: Plan, papers: Sequence[Contender] = UNTUNED
) -> tuple[Study, tuple[Contender, ...]] | None:
    """Return the study of our own controller on such maps with who takes part; None where there is none.

    Parameters
    ----------
    plan : Plan
    papers : sequence of Contender
        The paper's controllers with their gains; the strongest take part.
    """
    if not (of(plan).unseen and ours()):
        return None
    laws = (*ours()[:1], *strongest(papers))
    return study_of(plan, unseen_maps(plan), laws, of(plan).starts, of(plan).seeds), laws


def small_maps(plan: Plan) -> tuple[StudyMap, ...]:
    """Return the generated maps of what is small: targets, density and mixed teams."""
    return tuple(StudyMap(f"generated-{seed}", generated_test_map(seed)) for seed in of(plan).maps)


def targets_study(plan: Plan) -> Study:
    """Return RAPF with every target."""
    return study_of(plan, small_maps(plan), TARGETS, of(plan).map_starts, (0,))


def weighed_maps(plan: Plan) -> tuple[StudyMap, ...]:
    """Return the small maps with a density."""
    return tuple(
        StudyMap(each.name, replace(each.environment, density=hot_spots(each.environment, seed)))
        for each, seed in zip(small_maps(plan), of(plan).maps, strict=True)
    )


def hot_spots(environment: Environment, seed: int) -> Gaussians:
    """Return a density drawn by chance: round Gaussians of 1 m in the free space, over a floor of 1.

    Parameters
    ----------
    environment : Environment
    seed : int
        The same seed gives the same density.
    """
    from robocov.environment import UniformStart

    start = replace(environment, starts={"uniform": UniformStart()}).start("uniform")
    centres = start.sample(HOT_SPOTS, seed=seed, radius=0.3)
    peaks = tuple(
        Gaussian((round(float(x), 2), round(float(y), 2)), weight=20.0, sigma=1.0) for x, y in centres
    )
    return Gaussians(peaks, floor=1.0)


def density_studies(plan: Plan) -> dict[str, Study]:
    """Return RAPF that knows the density, and RAPF on the same maps without it."""
    starts = of(plan).map_starts
    return {
        "density": study_of(plan, weighed_maps(plan), (RAPF_DEFAULT,), starts, (0,)),
        "density-ignored": study_of(plan, small_maps(plan), (RAPF_DEFAULT,), starts, (0,)),
    }


def picture_study(plan: Plan, *, weighed: bool) -> Study:
    """Return the run of the picture of a density, with it or without."""
    environment = load_map(WEIGHED_MAP)
    environment = environment if weighed else replace(environment, density=None)
    start = WEIGHED_START if WEIGHED_START in environment.starts else environment.start().name
    maps = (StudyMap(WEIGHED_MAP, environment),)
    return study_of(plan, maps, (RAPF_DEFAULT,), (start,), (0,), record_hz=5.0)


def teams_study(plan: Plan) -> Study:
    """Return laws with both kinds of cells in a team of robots that are not equally fast."""
    return study_of(plan, small_maps(plan), TEAMS, of(plan).map_starts, (0,), group=GROUPS)


def conditions_plan(plan: Plan) -> DegradationPlan:
    """Return what goes wrong: all axes in full, or two values of each."""
    beyond = of(plan)
    quick = plan.name == "quick"
    axes = {name: (values[0], values[BAD]) if quick else values for name, values in AXES.items()}
    return DegradationPlan(
        maps=beyond.conditions_maps,
        axes=axes,
        seeds=beyond.conditions_seeds,
        duration=beyond.conditions_duration,
        lattice=plan.lattice,
    )


def conditions_studies(plan: Plan) -> dict[str, Study]:
    """Return the study of the ideal runs, and one for each axis."""
    conditions = conditions_plan(plan)
    always = dict(conditions.always)
    found = {"conditions-ideal": conditions.study(conditions=always)}
    for name, values in conditions.axes.items():
        bad: list[Any] = list(values[1:])
        changes: dict[str, Any] = {name: bad, "conditions": always}
        if name not in TEAM:
            changes = {"conditions": {**always, name: bad}}
        found[f"conditions-{name.replace('_', '-')}"] = conditions.study(**changes)
    return found


def small_studies(plan: Plan) -> dict[str, Study]:
    """Return all studies but those of rivals and ours, by name, in the order in which they are done."""
    return {
        "targets": targets_study(plan),
        **density_studies(plan),
        "density-picture": picture_study(plan, weighed=True),
        "density-picture-ignored": picture_study(plan, weighed=False),
        "teams": teams_study(plan),
        **conditions_studies(plan),
    }


def all_studies(
    plan: Plan, tuned: Mapping[str, Contender] = NOT_TUNED, papers: Sequence[Contender] = UNTUNED
) -> dict[str, Study]:
    """Return all studies beyond the paper but that of the rivals' gains, by name.

    Parameters are those of `rivals` and `unseen_study`.
    """
    found = {name: study for name, (study, _) in rival_studies(plan, tuned).items()}
    unseen = unseen_study(plan, papers)
    if unseen is not None:
        found[UNSEEN] = unseen[0]
    return {**found, **small_studies(plan)}


def probes(plan: Plan) -> Iterator[Study]:
    """Yield a study of one short run for each controller, by which the time of the others is estimated."""
    maps = (StudyMap("blocks-a", with_kinds_of_starts(load_map("blocks-a"))),)
    short = replace(plan, duration=min(of(plan).probe, plan.duration))
    for each in (*UNTUNED, *rivals(), *ours()):
        yield study_of(short, maps, (each,), ("corner",), (0,))


def controllers(laws: Sequence[Contender]) -> tuple[str, ...]:
    """Return the controllers of contenders, each once."""
    return tuple(dict.fromkeys(law.controller for law in laws))
