"""Benchmark of the exact coverage cost, compared with fast marching (scikit-fmm) and with a k-d tree.

Second-order fast marching computes distances on the same lattice and for the same free sites, starting at the
cells that contain a robot. It is not exact, and it does not compute which robot is nearest to a site. The
robots move by up to a quarter of a cell between calls. The k-d tree computes straight-line distances, the
minimum work of any coverage cost.
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
from robocov.typing import FloatArray
from robocov_app.speed_benchmarks.measure import Call, Case, Row, measure_interleaved

VERTICES = (20, 200, 1000)
"""Numbers of vertices of random obstacles."""
LATTICES = (64, 128, 256, 512)
"""Numbers of sites along a side of the map."""
ROBOTS = (6, 50, 200)
"""Numbers of robots."""
QUICK_SIZES: tuple[tuple[int, int], ...] = ((128, 200), (256, 200))
"""Lattice and vertices of the quick benchmark."""
QUICK_ROBOTS = (6, 50)
"""Numbers of robots of the quick benchmark."""
GOALS = {
    (128, 200, 50): 0.75,
    (256, 200, 50): 0.45,
    (512, 200, 50): 0.25,
    (256, 1000, 50): 0.9,
    (128, 200, 6): 1.0,
    (256, 200, 6): 0.65,
    (512, 200, 6): 0.45,
}
"""Maximum ratios by lattice, vertices and robots."""
BUILD_GOALS_S = {(128, 200): 0.15, (512, 1000): 8.0}
"""Maximum times to build the cost, by lattice and vertices."""
BASELINE = "scikit-fmm, order 2"
"""Name of the baseline among random obstacles."""
_OBSTACLE_CORNERS = 5
"""Number of corners of a random obstacle."""
_BLOCKED_FRACTION = 0.23
"""Total area of the random obstacles divided by the area of the map, if no obstacles overlap."""
_MEAN_OBSTACLE_AREA_RADII2 = 2.2
"""Mean area of an obstacle, divided by the square of the smallest circumradius."""
_MIN_OBSTACLE_AREA_RADII2 = 0.3
"""Minimum area of an obstacle, divided by the same square; slivers with a smaller area are drawn again."""
_MIN_ROUNDS = 7
"""Minimum number of rounds of a case."""
_QUICK_DURATION_S = 0.3
"""Minimum total time of the rounds of a case in the quick benchmark."""
_FULL_DURATION_S = 1.0
"""Minimum total time of the rounds of a case in the full benchmark."""

TREE = "k-d tree of the robots"
"""Name of the baseline on bundled maps."""
EARLIER_RATIOS = {
    ("rooms", 64, 6): 4.5,
    ("rooms", 128, 6): 2.8,
    ("rooms", 256, 6): 1.7,
    ("rooms", 64, 50): 4.9,
    ("rooms", 128, 50): 2.4,
    ("rooms", 256, 50): 1.0,
    ("museum", 64, 6): 7.4,
    ("museum", 128, 6): 3.8,
    ("museum", 256, 6): 1.9,
    ("museum", 64, 50): 6.9,
    ("museum", 128, 50): 4.2,
    ("museum", 256, 50): 1.1,
    ("campus", 64, 6): 19.5,
    ("campus", 128, 6): 14.6,
    ("campus", 256, 6): 4.9,
    ("campus", 64, 50): 20.6,
    ("campus", 128, 50): 10.3,
    ("campus", 256, 50): 3.2,
    ("campus", 64, 1000): 136.8,
}
"""Earlier ratios to the time of the tree, by map, lattice and robots; see `Row.earlier_ratio`."""
SPEEDUPS = {64: 4.0, 128: 2.5, 256: 1.7}
"""Minimum speedups over the ratios in `EARLIER_RATIOS`, by lattice."""
_CAMPUS_FACTOR = 2.0
"""Factor of the minimum speedups on the map "campus"."""
_LARGE_TEAM = 1000
"""Number of robots for which another minimum speedup applies."""
_LARGE_TEAM_SPEEDUP = 10.0
"""Minimum speedup for the large team."""


def list_cases(*, quick: bool = False) -> list[Case]:
    """Return the benchmark cases of the cost on a square with random obstacles."""
    sizes = QUICK_SIZES
    if not quick:
        sizes = tuple((lattice, vertices) for vertices in VERTICES for lattice in LATTICES)
    return [partial(_measure_size, lattice, vertices, quick=quick) for lattice, vertices in sizes]


def list_map_cases(*, quick: bool = False) -> list[Case]:
    """Return the benchmark cases of the cost on bundled maps; quick cases use the smallest lattice only."""
    sizes = sorted({(name, lattice) for name, lattice, _ in EARLIER_RATIOS if not quick or lattice == 64})
    return [partial(_measure_map, name, lattice, quick=quick) for name, lattice in sizes]


def has_baseline() -> bool:
    """Return whether scikit-fmm is installed."""
    return find_spec("skfmm") is not None


def build_random_map(vertices: int, seed: int = 0) -> Environment:
    """Build a unit square with random pentagons, which block about a quarter of the area."""
    rng = np.random.default_rng(seed)
    area_per_obstacle = _BLOCKED_FRACTION / (vertices / _OBSTACLE_CORNERS)
    min_radius = np.sqrt(area_per_obstacle / _MEAN_OBSTACLE_AREA_RADII2)
    obstacles: list[PolygonObstacle] = []
    while len(obstacles) < vertices // _OBSTACLE_CORNERS:
        angle = np.sort(rng.uniform(0.0, 2.0 * np.pi, _OBSTACLE_CORNERS))
        directions = np.column_stack([np.cos(angle), np.sin(angle)])
        # The corners are at random angles on a circle.
        ring = rng.random(2) + min_radius * rng.uniform(1.0, 1.5) * directions
        if shapely.Polygon(ring).area > _MIN_OBSTACLE_AREA_RADII2 * min_radius**2:
            obstacles.append(PolygonObstacle(tuple((float(x), float(y)) for x, y in ring)))
    return Environment("random", ((0, 0), (1, 0), (1, 1), (0, 1)), tuple(obstacles))


class MovingRobots:
    """Robots that move by up to a quarter of a cell in each round without leaving the free space.

    Parameters
    ----------
    cost : CoverageCost
        Cost of the map, whose sites are the starting positions.
    robots : int
        Number of robots.

    Attributes
    ----------
    positions : (n, 2) array, m
        Current positions.
    blocked : (lattice, lattice) array of bool
        Cells without a site.
    """

    def __init__(self, cost: CoverageCost, robots: int) -> None:
        self._rng = np.random.default_rng(1)
        self._start = cost.points[self._rng.choice(len(cost.points), robots, replace=False)]
        self._max_step = cost.spacing / 4.0
        self._geodesics = cost.geodesics
        self.positions: FloatArray = self._start
        blocked = np.ones(cost.lattice**2, dtype=bool)
        blocked[cost.cells] = False
        self.blocked = blocked.reshape(cost.lattice, cost.lattice)

    def move(self) -> None:
        """Move each robot to a random point near its start, or to the start if the point is not free."""
        steps = self._rng.uniform(-self._max_step, self._max_step, self._start.shape)
        positions = self._start + steps
        is_free = shapely.intersects_xy(self._geodesics.free, *self._geodesics.grid.snap(positions).T)
        self.positions = np.where(is_free[:, None], positions, self._start)


def _measure_size(lattice: int, vertices: int, *, quick: bool) -> Iterator[Row]:
    """Measure how long the cost takes to build among random obstacles, and to evaluate for each team size."""
    environment = build_random_map(vertices)
    start = perf_counter()
    cost = CoverageCost(environment, lattice)
    build_time = perf_counter() - start
    size = {"lattice": lattice, "vertices": vertices}
    max_build_time = BUILD_GOALS_S.get((lattice, vertices))
    yield Row("cost", "built, once per map", size, build_time, max_seconds=max_build_time)
    team_sizes = QUICK_ROBOTS if quick else ROBOTS
    for robots in team_sizes:
        if robots > len(cost.points):
            continue
        moving = MovingRobots(cost, robots)
        baseline = _measure_by_marching if has_baseline() else None
        times = _measure_costs(cost, moving, baseline, quick=quick)
        row = Row("cost", "evaluated", size | {"robots": robots}, times["exact"])
        if baseline is not None:
            max_ratio = GOALS.get((lattice, vertices, robots))
            row = replace(row, baseline=BASELINE, baseline_seconds=times["baseline"], max_ratio=max_ratio)
        yield row


def _measure_map(name: str, lattice: int, *, quick: bool) -> Iterator[Row]:
    """Time the evaluation of the cost on a bundled map for each team size in `EARLIER_RATIOS`.

    The baseline is a k-d tree.
    """
    cost = CoverageCost(load_map(name), lattice)
    for (map_name, map_lattice, robots), earlier_ratio in EARLIER_RATIOS.items():
        if (map_name, map_lattice) != (name, lattice):
            continue
        times = _measure_costs(cost, MovingRobots(cost, robots), _measure_by_tree, quick=quick)
        speedup = SPEEDUPS[lattice]
        if name == "campus":
            speedup *= _CAMPUS_FACTOR
        if robots == _LARGE_TEAM:
            speedup = _LARGE_TEAM_SPEEDUP
        size: Mapping[str, int | str] = {"map": name, "lattice": lattice, "robots": robots}
        yield Row(
            "maps",
            "evaluated",
            size,
            times["exact"],
            baseline=TREE,
            baseline_seconds=times["baseline"],
            max_ratio=earlier_ratio / speedup,
            earlier_ratio=earlier_ratio,
        )


def _measure_costs(
    cost: CoverageCost,
    moving: MovingRobots,
    baseline: Callable[[CoverageCost, MovingRobots], object] | None,
    *,
    quick: bool,
) -> dict[str, float]:
    """Return the median times, s, of the "exact" cost and, if given, of the "baseline" in alternation."""
    calls: dict[str, Call] = {"exact": lambda: cost(moving.positions).mean_distance}
    if baseline is not None:
        calls["baseline"] = partial(baseline, cost, moving)
    duration = _QUICK_DURATION_S if quick else _FULL_DURATION_S
    return measure_interleaved(calls, _MIN_ROUNDS, duration, before_round=moving.move)


def _measure_by_marching(cost: CoverageCost, moving: MovingRobots) -> float:
    """Compute the mean distance to the nearest robot by fast marching."""
    import skfmm

    column, row = np.floor(moving.positions / cost.spacing).astype(int).T
    front = np.ones((cost.lattice, cost.lattice))
    # skfmm starts at the zero contour, which surrounds the cells of the robots.
    front[row, column] = -1.0
    masked = np.ma.MaskedArray(front, moving.blocked)
    return float(skfmm.distance(masked, dx=cost.spacing, order=2).mean())


def _measure_by_tree(cost: CoverageCost, moving: MovingRobots) -> object:
    """Find the straight-line distance from each site to its nearest robot with a k-d tree."""
    return cKDTree(moving.positions).query(cost.points)
