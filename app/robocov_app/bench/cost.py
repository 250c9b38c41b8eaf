"""The exact coverage cost against fast marching of second order, by scikit-fmm, and against a k-d tree.

Fast marching travels over the same lattice with the same free sites, from the cells that hold a robot.
It is not exact and cannot tell whose a site is. The robots move by up to a quarter of a cell between calls.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from importlib.util import find_spec
from time import perf_counter

import numpy as np
import shapely
from scipy.spatial import cKDTree

from robocov.cost import CoverageCost
from robocov.environment import Environment, PolygonObstacle
from robocov.mapfile import load_map
from robocov_app.bench.measure import Call, Case, Row, in_turn

VERTICES = (20, 200, 1000)
LATTICES = (64, 128, 256, 512)
ROBOTS = (6, 50, 200)
GOALS = {  # wanted ratios, by lattice, vertices and robots
    (128, 200, 50): 0.75, (256, 200, 50): 0.45, (512, 200, 50): 0.25, (256, 1000, 50): 0.9,
    (128, 200, 6): 1.0, (256, 200, 6): 0.65, (512, 200, 6): 0.45,
}  # fmt: skip
BUILD_GOALS = {(128, 200): 0.15, (512, 1000): 8.0}  # wanted seconds, by lattice and vertices
YARDSTICK = "scikit-fmm, order 2"


def cases(*, quick: bool = False) -> list[Case]:
    sizes = ((128, 200), (256, 200)) if quick else [(n, k) for k in VERTICES for n in LATTICES]
    return [partial(_rows, lattice, vertices, quick) for lattice, vertices in sizes]


def has_yardstick() -> bool:
    return find_spec("skfmm") is not None


def random_map(vertices: int, seed: int = 0) -> Environment:
    """Return a unit square with obstacles of five corners each, about a quarter of it blocked."""
    rng = np.random.default_rng(seed)
    radius = np.sqrt(0.23 / (vertices / 5) / 2.2)
    obstacles: list[PolygonObstacle] = []
    while len(obstacles) < vertices // 5:
        angle = np.sort(rng.uniform(0.0, 2.0 * np.pi, 5))
        steps = np.column_stack([np.cos(angle), np.sin(angle)])
        ring = rng.random(2) + radius * rng.uniform(1.0, 1.5) * steps
        if shapely.Polygon(ring).area > 0.3 * radius**2:
            obstacles.append(PolygonObstacle(tuple((float(x), float(y)) for x, y in ring)))
    return Environment("random", ((0, 0), (1, 0), (1, 1), (0, 1)), tuple(obstacles))


def _rows(lattice: int, vertices: int, quick: bool) -> Iterator[Row]:
    environment = random_map(vertices)
    begin = perf_counter()
    cost = CoverageCost(environment, lattice)
    built = perf_counter() - begin
    size = {"lattice": lattice, "vertices": vertices}
    yield Row("cost", "built, once a map", size, built, goal_seconds=BUILD_GOALS.get((lattice, vertices)))
    for robots in (6, 50) if quick else ROBOTS:
        if robots > len(cost.points):
            continue
        exact, *marched = _compared(cost, Places(cost, robots), _marched if has_yardstick() else None, quick)
        row = Row("cost", "evaluated", size | {"robots": robots}, exact)
        goal = GOALS.get((lattice, vertices, robots))
        yield replace(row, yardstick=YARDSTICK, yardstick_seconds=marched[0], goal=goal) if marched else row


class Places:
    """Robots that move a little with every round."""

    def __init__(self, cost: CoverageCost, robots: int) -> None:
        self._rng = np.random.default_rng(1)
        self._start = cost.points[self._rng.choice(len(cost.points), robots, replace=False)]
        self._step, self._geodesics, self.now = cost.spacing / 4.0, cost.geodesics, self._start
        blocked = np.ones(cost.lattice**2, dtype=bool)
        blocked[cost.cells] = False
        self.blocked = blocked.reshape(cost.lattice, cost.lattice)

    def move(self) -> None:
        places = self._start + self._rng.uniform(-self._step, self._step, self._start.shape)
        free = shapely.intersects_xy(self._geodesics.free, *self._geodesics.grid.snap(places).T)
        self.now = np.where(free[:, None], places, self._start)


def _compared(
    cost: CoverageCost, places: Places, other: Callable[[CoverageCost, Places], object] | None, quick: bool
) -> list[float]:
    """Return the times of the exact cost and of another measure, s, while the robots move."""
    calls: dict[str, Call] = {"exact": lambda: cost(places.now).mean_distance}
    if other is not None:
        calls["other"] = partial(other, cost, places)
    return list(in_turn(calls, 7, 0.3 if quick else 1.0, before=places.move).values())


def _marched(cost: CoverageCost, places: Places) -> float:
    import skfmm

    side = cost.lattice
    column, row = np.floor(places.now / cost.spacing).astype(int).T
    front = np.ones((side, side))
    front[row, column] = -1.0
    return float(skfmm.distance(np.ma.MaskedArray(front, places.blocked), dx=cost.spacing, order=2).mean())


# on bundled maps, against the distances that a k-d tree finds: the least that a coverage cost takes

TREE = "k-d tree of the robots"
BEFORE = {  # multiples of the time of the tree, by map, lattice and robots; see `Row.before`
    ("rooms", 64, 6): 4.5, ("rooms", 128, 6): 2.8, ("rooms", 256, 6): 1.7,
    ("rooms", 64, 50): 4.9, ("rooms", 128, 50): 2.4, ("rooms", 256, 50): 1.0,
    ("museum", 64, 6): 7.4, ("museum", 128, 6): 3.8, ("museum", 256, 6): 1.9,
    ("museum", 64, 50): 6.9, ("museum", 128, 50): 4.2, ("museum", 256, 50): 1.1,
    ("campus", 64, 6): 19.5, ("campus", 128, 6): 14.6, ("campus", 256, 6): 4.9,
    ("campus", 64, 50): 20.6, ("campus", 128, 50): 10.3, ("campus", 256, 50): 3.2,
    ("campus", 64, 1000): 136.8,
}  # fmt: skip
FASTER = {64: 4.0, 128: 2.5, 256: 1.7}  # wanted speed-ups by lattice


def map_cases(*, quick: bool = False) -> list[Case]:
    maps = sorted({(name, lattice) for name, lattice, _ in BEFORE if not quick or lattice == 64})
    return [partial(_on_map, name, lattice, quick) for name, lattice in maps]


def _on_map(name: str, lattice: int, quick: bool) -> Iterator[Row]:
    cost = CoverageCost(load_map(name), lattice)
    for robots in [n for known, size, n in BEFORE if (known, size) == (name, lattice)]:
        places, before = Places(cost, robots), BEFORE[name, lattice, robots]
        exact, tree = _compared(cost, places, lambda cost, at: cKDTree(at.now).query(cost.points), quick)
        faster = 10.0 if robots == 1000 else FASTER[lattice] * (2.0 if name == "campus" else 1.0)
        size: Mapping[str, int | str] = {"map": name, "lattice": lattice, "robots": robots}
        yield Row("maps", "evaluated", size, exact, TREE, tree, before / faster, before=before)
