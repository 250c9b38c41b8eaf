"""The sweeps of the study, each with its folder's name.

``gains`` and ``rival-gains`` are grids of gains on maps of their own, for the best gains. On the maps of
``claims`` the paper's contenders run, and from the same starts all others in ``rivals`` and ``ours-…``.
``density-…`` is RAPF that knows which places count more and RAPF that does not.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import product
from typing import Any, TypeAlias

import numpy as np
import shapely

from robocov.controllers import CONTROLLERS
from robocov.controllers.gains import Value
from robocov.environment import DiscStart, Environment, StartSpec, UniformStart
from robocov.errors import StartError
from robocov.generator import generate_map
from robocov.mapfile import load_map
from robocov_app.evaluation.hot_spots import add_hot_spots
from robocov_app.replication import contenders as laws
from robocov_app.replication.contenders import Contender
from robocov_app.replication.plan import CONVEX, CONVEX_KINDS, KINDS, ROBOTS, TEAM, UNSEEN, Plan
from robocov_app.sweep.parameters import TEAM_PARAMETERS
from robocov_app.sweep.study import Study, StudyMap

RADII = (0.8, 0.6, 0.45)  # m, of the discs of clustered starts; the first that fits is taken
TIGHT = 0.35  # m, of the disc of "tight": it has room for the centres of six robots, and hardly more
SIDE = 10.0  # m, of the square in which regions are drawn by chance
_POINTS, _LEAST_AREA, _LEAST_WIDTH = 9, 40.0, 5.0

# which runs the figures show: (map, starts, contenders); "paper" is the same on both maps, "other" figure 8's
FIGURES = {
    "figures-convex": ("pentagon", ("corner",), (laws.RAPF_SHARED, laws.LLOYD)),
    "figures-a": ("blocks-a", ("paper",), (laws.RAPF_SHARED, laws.RPF_SHARED)),
    "figures-b": ("blocks-b", ("paper", "other"), (laws.RAPF_SHARED, laws.RPF_SHARED)),
}

DENSITY_MAP, DENSITY_START = "hospital", "reception"  # of the picture of a density

# a team of robots of different speeds
GROUPS = ({"count": 2, "max_speed": 1.0}, {"count": 2, "max_speed": 0.5}, {"count": 2, "max_speed": 0.25})

Axes: TypeAlias = Mapping[str, tuple[float | None, ...]]
# disturbances, from none to bad; the first value of each is the ideal
AXES: Axes = {
    "loss": (0.0, 0.3, 0.6, 0.9),
    "delay": (0.0, 0.5, 1.0, 2.0),
    "communication_range": (None, 6.0, 4.0, 2.0),
    "position_noise": (0.0, 0.05, 0.1, 0.2),
    "sensing_noise": (0.0, 0.05, 0.1, 0.2),
    "failure_rate": (0.0, 0.005, 0.01, 0.02),
}
# conditions of all these runs, the ideal ones as well: of sixty messages a second nobody would miss one
ALWAYS = {"message_rate": 2.0}
DISTURBED = ("rapf", "lloyd")  # controllers at every value; all others at one, `WORSE`, of a seed
WORSE = 2  # place of that value in `AXES`
BASELINE_GAINS = "rival-gains"


@dataclass(frozen=True, eq=False)
class Contest:
    """A sweep, and which contenders take part in it."""

    study: Study
    contenders: tuple[Contender, ...]


def bundled(name: str, kinds: Iterable[str] = KINDS) -> StudyMap:
    return StudyMap(name, with_kinds_of_starts(load_map(name), kinds))


def generated(seed: int) -> StudyMap:
    """Return a non-convex map drawn by chance, with the study's starts.

    Four to eight obstacles, of five about three convex, one an L and one a U, block 16 to 25 % of a square of
    ten metres; every passage is at least 0.6 m wide, and the free space is in one piece.
    """
    rng = np.random.default_rng([seed, 2])
    obstacles, area = int(rng.integers(4, 9)), round(float(rng.uniform(0.16, 0.25)), 3)
    environment = generate_map(seed, kind="polygons", obstacles=obstacles, area=area, gap=0.6, side=SIDE)
    return StudyMap(f"generated-{seed}", with_kinds_of_starts(environment))


def convex_region(seed: int) -> StudyMap:
    """Return a convex region without obstacles drawn by chance, with the study's starts.

    It is the convex hull of nine points that are uniform in a square of ten metres; hulls below 40 m², and
    those narrower than 5 m, are drawn again. Coordinates are whole centimetres.
    """
    rng = np.random.default_rng([seed, 1])
    area = width = 0.0
    while area < _LEAST_AREA or width < _LEAST_WIDTH:
        points = np.round(rng.uniform(0.0, SIDE, size=(_POINTS, 2)), 2)
        hull = shapely.convex_hull(shapely.MultiPoint(points))
        corners = np.asarray(shapely.minimum_rotated_rectangle(hull).exterior.coords)
        area, width = hull.area, np.hypot(*np.diff(corners[:3], axis=0).T).min()
    ring = np.asarray(shapely.orient_polygons(hull).exterior.coords)[:-1]
    boundary = tuple((float(x), float(y)) for x, y in ring)
    region = Environment(f"convex-{seed}", boundary, description="A convex region drawn by chance.")
    return StudyMap(region.name, with_kinds_of_starts(region, CONVEX_KINDS))


def with_kinds_of_starts(environment: Environment, kinds: Iterable[str] = KINDS) -> Environment:
    """Return the map with the study's starts in place of its own; StartError where no disc fits."""
    return replace(environment, starts={kind: _start(environment, kind) for kind in kinds})


def _start(environment: Environment, kind: str) -> StartSpec:
    if kind == "uniform":
        return UniformStart()
    low_x, low_y, high_x, high_y = environment.region.bounds
    wanted = ((low_x + high_x) / 2, (low_y + high_y) / 2) if kind == "centre" else (low_x, low_y)
    for radius in (TIGHT,) if kind == "tight" else RADII:
        room = environment.free.geoms[0].buffer(-radius)
        if not room.is_empty:
            nearest = shapely.shortest_line(room, shapely.Point(wanted)).coords[0]
            # whole centimetres are the same on every processor
            return DiscStart((round(nearest[0], 2), round(nearest[1], 2)), radius)
    raise StartError(f"map {environment.name!r}: no free disc of {RADII[-1]:g} m radius")


@cache
def generated_maps(seeds: tuple[int, ...]) -> tuple[StudyMap, ...]:
    return tuple(map(generated, seeds))


@cache
def claim_maps(plan: Plan) -> tuple[StudyMap, ...]:
    return (*map(bundled, plan.bundled), *generated_maps(plan.generated))


@cache
def convex_maps(plan: Plan) -> tuple[StudyMap, ...]:
    return (*(bundled(name, CONVEX_KINDS) for name in CONVEX), *map(convex_region, plan.convex_generated))


@cache
def unseen_maps(plan: Plan) -> tuple[StudyMap, ...]:
    """Return generated maps of other families than those of the claims, with the study's starts."""
    found = product(UNSEEN, plan.beyond.unseen)
    drawn = {f"{kind}-{seed}": generate_map(seed, kind=kind) for kind, seed in found}
    return tuple(StudyMap(name, with_kinds_of_starts(each)) for name, each in drawn.items())


def baseline_maps(plan: Plan) -> tuple[StudyMap, ...]:
    """Return the maps of baselines and ours: those of the claims, or some of them."""
    wanted = {*plan.beyond.bundled, *(f"generated-{seed}" for seed in plan.beyond.generated)}
    return tuple(each for each in claim_maps(plan) if each.name in wanted)


def density_maps(plan: Plan) -> tuple[StudyMap, ...]:
    maps = []
    for each, seed in zip(generated_maps(plan.beyond.maps), plan.beyond.maps, strict=True):
        maps.append(StudyMap(each.name, add_hot_spots(each.environment, seed)))
    return tuple(maps)


def contest(
    plan: Plan,
    on: Sequence[StudyMap],
    contenders: Sequence[Contender],
    starts: Sequence[str],
    seeds: Sequence[int],
    **other: Any,
) -> Contest:
    """Return a sweep of contenders, with their work; all else is as the plan has it but for `other`."""
    gains = laws.distinct_gains(contenders)
    given = {"controllers": tuple(gains), "gains": gains, "starts": starts, "seeds": seeds, "metrics": True}
    return Contest(Study(maps=tuple(on), **{**_common(plan), **given, **other}), tuple(contenders))


def figure_studies(plan: Plan, papers: Sequence[Contender] = ()) -> dict[str, Study]:
    """Return the sweeps whose runs the figures show; their paths and costs are kept finely.

    With the paper's contenders, they are those of figures 4 to 8 at the best gains of these.
    """
    best = tuple(each for each in papers if each.key.endswith("-best"))
    finely = {"lattice": 2 * plan.lattice, "cost_hz": 5.0, "record_hz": 10.0}
    return {
        f"{name}-best" if best else name: contest(
            plan, (StudyMap(on, load_map(on)),), best or contenders, starts, (0,), **finely
        ).study
        for name, (on, starts, contenders) in FIGURES.items()
        if not (best and laws.LLOYD in contenders)
    }


def gain_sets(plan: Plan) -> dict[str, list[dict[str, Value]]]:
    """Return the grids of gains: the same potential for both, RAPF with every attraction beside it."""
    potential = [*laws.grid(k_rep=plan.k_rep, rho_0=plan.rho_0)]
    attractions = laws.grid(k_att=plan.k_att, attraction_limit=(None,))
    return {"rapf": [both | each for each in attractions for both in potential], "rpf": potential}


def gains_study(plan: Plan) -> Study:
    on, starts, seeds = generated_maps(plan.tuning), plan.tuning_starts, (plan.tuning_seed,)
    return Study(on, ("rapf", "rpf"), gain_sets(plan), starts=starts, seeds=seeds, **_common(plan))


def convex_contest(plan: Plan, contenders: Sequence[Contender]) -> Contest:
    part = [each for each in contenders if each.controller != "rpf"]
    return contest(plan, convex_maps(plan), part, CONVEX_KINDS, plan.convex_seeds)


def claims_contest(plan: Plan, contenders: Sequence[Contender]) -> Contest:
    return contest(plan, claim_maps(plan), contenders, KINDS, plan.seeds)


def baseline_gains_study(plan: Plan) -> Study | None:
    """Return the grids of the baselines' gains on some maps of the tuning; None where there are none."""
    if not plan.beyond.tuning:
        return None
    sets = [laws.with_gains(name, gains) for name, each in laws.GRIDS.items() for gains in each]
    on = generated_maps(plan.beyond.tuning)
    return contest(plan, on, sets, plan.tuning_starts, (plan.tuning_seed,)).study


def beyond_contests(plan: Plan, best: laws.BestGains, papers: Sequence[Contender]) -> dict[str, Contest]:
    """Return the sweeps of contenders beyond the paper, but for that of the baselines' gains.

    Baselines have their `best` gains or their defaults; beside ours on unseen maps are the paper's strongest.
    """
    beyond, starts, on = plan.beyond, plan.beyond.map_starts, generated_maps(plan.beyond.maps)
    sides = {"rivals": laws.baselines(best)} | {f"ours-{each.key}": (each,) for each in laws.OWN}
    found = {
        name: contest(plan, baseline_maps(plan), part, beyond.starts, beyond.seeds_of(part[0].controller))
        for name, part in sides.items()
    }
    if beyond.unseen:
        three = laws.OWN[0], *laws.strongest(papers)
        found["unseen"] = contest(plan, unseen_maps(plan), three, beyond.starts, beyond.seeds)
    found["targets"] = contest(plan, on, laws.TARGETS, starts, (0,))
    known, rapf = load_map(DENSITY_MAP), (laws.RAPF_DEFAULT,)
    both = ("", density_maps(plan), known), ("-ignored", on, replace(known, density=None))
    for suffix, weighed, shown in both:
        found[f"density{suffix}"] = contest(plan, weighed, rapf, starts, (0,))
        picture = (StudyMap(DENSITY_MAP, shown),), rapf, (DENSITY_START,), (0,)
        found[f"density-picture{suffix}"] = contest(plan, *picture, record_hz=5.0)
    return found | {"teams": contest(plan, on, laws.TEAMS, starts, (0,), group=GROUPS)}


def disturbed(plan: Plan) -> dict[str, tuple[tuple[str, ...], int, Axes]]:
    """Return controllers, a number of seeds, and values on axes, by the first words of their sweeps."""
    two = {name: (values[0], values[WORSE]) for name, values in AXES.items()}
    others = tuple(name for name in CONTROLLERS if name not in DISTURBED)
    papers = DISTURBED, plan.beyond.conditions_seeds, two if plan.name == "quick" else AXES
    return {"conditions": papers, "conditions-others": (others, 1, two)}


def conditions_studies(plan: Plan) -> dict[str, Study]:
    common: dict[str, Any] = {
        "maps": tuple(StudyMap(name, load_map(name)) for name in plan.beyond.conditions_maps),
        "robots": (ROBOTS,),
        "duration": plan.beyond.conditions_duration,
        "dt": 1 / 60,
        "lattice": plan.lattice,
        "cost_hz": 0.0,
        "record_hz": 0.0,
        "conditions": ALWAYS,
    }
    found = {}
    for part, (controllers, seeds, axes) in disturbed(plan).items():
        common |= {"controllers": controllers, "seeds": range(seeds)}
        found[f"{part}-ideal"] = Study(**common)
        for name, (_, *bad) in axes.items():
            changed = {name: bad} if name in TEAM_PARAMETERS else {"conditions": {**ALWAYS, name: bad}}
            found[f"{part}-{name.replace('_', '-')}"] = Study(**{**common, **changed})
    return found


def probes(plan: Plan, *, beyond: bool) -> list[Study]:
    """Return runs by which the time of others is estimated, one of each controller; short ones `beyond`."""
    on, short = "blocks-a", replace(plan, duration=min(plan.beyond.probe, plan.duration))
    papers = (laws.RAPF_SHARED, laws.RPF_SHARED, laws.LLOYD)
    others = (*laws.baselines({}), *laws.OWN) if beyond else ()
    shorts = [contest(short, (bundled(on),), (each,), ("corner",), (0,)).study for each in others]
    return [contest(plan, (StudyMap(on, load_map(on)),), papers, ("paper",), (0,)).study, *shorts]


def _common(plan: Plan) -> dict[str, Any]:
    same = {"duration": plan.duration, "dt": plan.dt, "lattice": plan.lattice, **TEAM}
    return {"robots": (ROBOTS,), "cost_hz": 2.0, "record_hz": 0.0, **same}
