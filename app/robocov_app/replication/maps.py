"""The maps of the study, and the same kinds of starts on all of them.

- ``corner``: a disc near the lower left corner, as in the paper's figures 4 and 6;
- ``centre``: a disc near the middle;
- ``uniform``: anywhere in the free space.

The discs are put by a rule: of the first of `RADII` that fits, wholly free, as near to the corner, or the
middle, of the map's bounding box as can be. In convex regions there is also ``tight``, the smallest disc that
holds six robots with a little room, as near to the corner.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import shapely

from robocov.density import Gaussian, Gaussians
from robocov.environment import DiscStart, Environment, StartSpec, UniformStart
from robocov.errors import StartError
from robocov.generator import generated_map
from robocov.mapfile import load_map
from robocov_app.sweep.study import StudyMap

KINDS = ("corner", "centre", "uniform")  # the starts on non-convex maps; all but the last are clustered
CONVEX_KINDS = (
    "corner",
    "centre",
    "tight",
    "uniform",
)  # those in convex regions; all but the last are clustered

RADII = (0.8, 0.6, 0.45)  # m, of the discs of clustered starts; the first that fits is taken
TIGHT = 0.35  # m, of the disc of "tight": it has room for the centres of six robots, and hardly more

# bundled maps of the study: all that are not convex, but for ``campus``, which is 120 m wide: at 1 m/s the
# robots would not have arrived when the run ends
NON_CONVEX = (
    *("blocks-a", "blocks-b", "l-shape", "rooms", "trap", "gaps", "cave", "courtyard", "corridor"),
    *("museum", "office", "warehouse", "city"),
)
CONVEX = ("square", "pentagon")  # bundled maps of the convex case

SIDE = 10.0  # m, of the square in which regions are drawn by chance
HOT_SPOTS = 2  # Gaussians drawn by chance on a map: in the middle of one a place counts 20 times as much

_POINTS, _LEAST_AREA, _LEAST_WIDTH = 9, 40.0, 5.0


def bundled(name: str, kinds: Iterable[str] = KINDS) -> StudyMap:
    """Return a bundled map with the study's starts."""
    return StudyMap(name, with_kinds_of_starts(load_map(name), kinds))


def generated(seed: int) -> StudyMap:
    """Return a non-convex map drawn by chance, with the study's starts.

    Four to eight obstacles, of five about three convex, one an L and one a U, block 16 to 25 % of a square of
    ten metres; every passage is at least 0.6 m wide, and the free space is in one piece.
    """
    rng = np.random.default_rng([seed, 2])
    obstacles, area = int(rng.integers(4, 9)), round(float(rng.uniform(0.16, 0.25)), 3)
    environment = generated_map(seed, kind="polygons", obstacles=obstacles, area=area, gap=0.6, side=SIDE)
    return StudyMap(f"generated-{seed}", with_kinds_of_starts(environment))


def convex_region(seed: int) -> StudyMap:
    """Return a convex region without obstacles drawn by chance, with the study's starts.

    It is the convex hull of nine points that are uniform in a square of ten metres; hulls below 40 m², and
    those narrower than 5 m, are drawn again. Coordinates are whole centimetres.
    """
    rng = np.random.default_rng([seed, 1])
    while True:
        points = np.round(rng.uniform(0.0, SIDE, size=(_POINTS, 2)), 2)
        hull = shapely.convex_hull(shapely.MultiPoint(points))
        corners = np.asarray(shapely.minimum_rotated_rectangle(hull).exterior.coords)
        width = np.hypot(*np.diff(corners[:3], axis=0).T).min()
        if hull.area >= _LEAST_AREA and width >= _LEAST_WIDTH:
            break
    ring = np.asarray(shapely.orient_polygons(hull).exterior.coords)[:-1]
    boundary = tuple((float(x), float(y)) for x, y in ring)
    region = Environment(f"convex-{seed}", boundary, description="A convex region drawn by chance.")
    return StudyMap(region.name, with_kinds_of_starts(region, CONVEX_KINDS))


def with_hot_spots(each: StudyMap, seed: int) -> StudyMap:
    """Return a map with a density drawn by chance: Gaussians of 1 m in the free space, over a floor of 1."""
    start = replace(each.environment, starts={"uniform": UniformStart()}).start("uniform")
    centres = start.sample(HOT_SPOTS, seed=seed, radius=0.3)
    peaks = tuple(
        Gaussian((round(float(x), 2), round(float(y), 2)), weight=20.0, sigma=1.0) for x, y in centres
    )
    return StudyMap(each.name, replace(each.environment, density=Gaussians(peaks, floor=1.0)))


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
