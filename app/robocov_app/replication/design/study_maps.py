"""Bundled and generated maps with the kinds of starts of the study."""

from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from itertools import product

import numpy as np
import shapely

from robocov.environment import DiscStart, Environment, StartSpec, UniformStart
from robocov.errors import StartError
from robocov.generator import generate_map
from robocov.mapfile import load_map
from robocov_app.evaluation.hot_spots import add_hot_spots
from robocov_app.replication.design.plan import CONVEX, CONVEX_KINDS, FAMILIES, KINDS, UNSEEN, Plan
from robocov_app.sweep.study.study import StudyMap

START_RADII_M = (0.8, 0.6, 0.45)
"""Radii of the discs of clustered starts; the first that fits is used."""
TIGHT_RADIUS_M = 0.35
"""Radius of the disc of "tight" starts, which is hardly larger than six robots need."""
SIDE_M = 10.0
"""Side of the square in which maps and regions are generated."""
_HULL_POINTS = 9
_MIN_HULL_AREA_M2 = 40.0
_MIN_HULL_WIDTH_M = 5.0
_MIN_PASSAGE_M = 0.6


def load_study_map(name: str, kinds: Iterable[str] = KINDS) -> StudyMap:
    """Return a bundled map with the study's starts."""
    return StudyMap(name, replace_starts(load_map(name), kinds))


def generate_study_map(seed: int) -> StudyMap:
    """Generate a non-convex map with the study's starts.

    Four to eight obstacles, about three in five of them convex, one an L and one a U, block 16 to 25% of a
    square with a side of ten meters. Every passage is at least 0.6 m wide, and the free space is connected.
    """
    rng = np.random.default_rng([seed, 2])
    obstacles = int(rng.integers(4, 9))
    area = round(float(rng.uniform(0.16, 0.25)), 3)
    environment = generate_map(
        seed, kind="polygons", obstacles=obstacles, area=area, gap=_MIN_PASSAGE_M, side=SIDE_M
    )
    return StudyMap(f"generated-{seed}", replace_starts(environment))


def generate_convex_region(seed: int) -> StudyMap:
    """Generate a convex region without obstacles, with the study's starts.

    It is the convex hull of nine random points in a square with a side of ten meters. Hulls smaller than
    40 m² or narrower than 5 m are rejected. Coordinates are whole centimeters.
    """
    rng = np.random.default_rng([seed, 1])
    area = 0.0
    width = 0.0
    while area < _MIN_HULL_AREA_M2 or width < _MIN_HULL_WIDTH_M:
        points = np.round(rng.uniform(0.0, SIDE_M, size=(_HULL_POINTS, 2)), 2)
        hull = shapely.convex_hull(shapely.MultiPoint(points))
        corners = np.asarray(shapely.minimum_rotated_rectangle(hull).exterior.coords)
        area = hull.area
        # The width is the shorter side of the smallest rectangle around the hull.
        sides = np.hypot(*np.diff(corners[:3], axis=0).T)
        width = sides.min()
    ring = np.asarray(shapely.orient_polygons(hull).exterior.coords)[:-1]
    boundary = tuple((float(x), float(y)) for x, y in ring)
    region = Environment(f"convex-{seed}", boundary, description="A convex region drawn by chance.")
    return StudyMap(region.name, replace_starts(region, CONVEX_KINDS))


def replace_starts(environment: Environment, kinds: Iterable[str] = KINDS) -> Environment:
    """Return a map whose starts are replaced by those of the study.

    Raises
    ------
    StartError
        If no disc of a start fits into the free space.
    """
    return replace(environment, starts={kind: _build_start(environment, kind) for kind in kinds})


def _build_start(environment: Environment, kind: str) -> StartSpec:
    """Build a start: anywhere, or in a free disc as near as possible to the lower left corner or middle.

    Raises
    ------
    StartError
        If no disc fits into the free space.
    """
    if kind == "uniform":
        return UniformStart()
    min_x, min_y, max_x, max_y = environment.region.bounds
    desired = shapely.Point(min_x, min_y)
    if kind == "centre":
        desired = shapely.Point((min_x + max_x) / 2, (min_y + max_y) / 2)
    radii = (TIGHT_RADIUS_M,) if kind == "tight" else START_RADII_M
    for radius in radii:
        centers = environment.free.geoms[0].buffer(-radius)
        if not centers.is_empty:
            x, y = shapely.shortest_line(centers, desired).coords[0]
            # Rounding makes the start the same on every processor.
            return DiscStart((round(x, 2), round(y, 2)), radius)
    raise StartError(f"map {environment.name!r}: no free disc of {radii[-1]:g} m radius")


@cache
def build_generated_maps(seeds: tuple[int, ...]) -> tuple[StudyMap, ...]:
    """Return the generated non-convex maps for some seeds."""
    return tuple(generate_study_map(seed) for seed in seeds)


@cache
def build_family_maps(kinds: tuple[str, ...], seeds: tuple[int, ...]) -> tuple[StudyMap, ...]:
    """Return generated maps of given kinds, for each seed, with the study's starts."""
    maps = []
    for kind, seed in product(kinds, seeds):
        environment = generate_map(seed, kind=kind)
        maps.append(StudyMap(f"{kind}-{seed}", replace_starts(environment)))
    return tuple(maps)


@cache
def build_claim_maps(plan: Plan) -> tuple[StudyMap, ...]:
    """Return the non-convex maps on which the claims are tested."""
    bundled = (load_study_map(name) for name in plan.bundled)
    families = build_family_maps(FAMILIES, plan.families)
    return (*bundled, *build_generated_maps(plan.generated), *families)


def build_tuning_maps(plan: Plan) -> tuple[StudyMap, ...]:
    """Return the maps on which the gains of RAPF and RPF are tuned."""
    return (*build_generated_maps(plan.tuning), *build_family_maps(FAMILIES, plan.tuning_families))


def get_map_kind(name: str) -> str:
    """Return the kind of a map of the study by its name: "bundled", "polygons", or a kind in `FAMILIES`.

    Examples
    --------
    >>> get_map_kind("rooms"), get_map_kind("generated-3"), get_map_kind("rooms-401")
    ('bundled', 'polygons', 'rooms')
    """
    kind, _, seed = name.rpartition("-")
    if not seed.isdigit():
        return "bundled"
    return "polygons" if kind == "generated" else kind


@cache
def build_convex_maps(plan: Plan) -> tuple[StudyMap, ...]:
    """Return the convex regions on which the claims are tested."""
    bundled = [load_study_map(name, CONVEX_KINDS) for name in CONVEX]
    generated = [generate_convex_region(seed) for seed in plan.convex_generated]
    return (*bundled, *generated)


def build_unseen_maps(plan: Plan) -> tuple[StudyMap, ...]:
    """Return the generated maps on which the goals of our own controller are judged again."""
    return build_family_maps(UNSEEN, plan.beyond.unseen)


def build_baseline_maps(plan: Plan) -> tuple[StudyMap, ...]:
    """Return the maps for the baselines and our own controllers, a selection from the maps of the claims."""
    names = {*plan.beyond.bundled, *(f"generated-{seed}" for seed in plan.beyond.generated)}
    return tuple(study_map for study_map in build_claim_maps(plan) if study_map.name in names)


def build_density_maps(plan: Plan) -> tuple[StudyMap, ...]:
    """Return generated maps with a random density."""
    maps = []
    seeds = plan.beyond.maps
    for study_map, seed in zip(build_generated_maps(seeds), seeds, strict=True):
        maps.append(StudyMap(study_map.name, add_hot_spots(study_map.environment, seed)))
    return tuple(maps)
