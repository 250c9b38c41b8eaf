"""The centralised reference: the best places for a team that knows the whole map.

The coverage cost (22) has many local minima. Each restart draws places by k-median++, improves them on
a table of geodesic distances between some hundreds of places, first by Lloyd's iteration, then by
interchange, which leaves most of these minima, and at last descends the exact cost itself. The best of
all restarts is no proof of the global minimum; how many restarts agree with it tells how far to trust it.
"""

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from numbers import Integral
from typing import Any

import numpy as np
import scipy
import shapely
from scipy.spatial import cKDTree
from shapely import MultiPolygon
from shapely.geometry.base import BaseGeometry

from robocov.arrays import Array, BoolArray, IntArray, freeze
from robocov.cost import CoverageCost, CoverageResult
from robocov.environment import MIN_START_GAP_RADII, Environment
from robocov.errors import ParameterError, is_number, quote, require_number
from robocov.k_median import Beat, apply_best_swaps, run_lloyd, seed_sources
from robocov.potential import GOLDEN_ANGLE
from robocov.team import DEFAULT_RADIUS

MAX_ROBOTS = 500
MAX_RESTARTS = 100_000

_SOURCES, _SOURCES_A_ROBOT = 600, 20  # about so many places for robots are in the table, more for large teams
_TARGETS = 1000  # at most about so many groups of sites are in the table
_FINEST = 200_000  # at most so many places are looked at, in the box around a component, for these
_UNREACHED = 1e4  # sizes of the map that count as the distance to what a robot cannot reach
_BUILT, _TABLED = 0.3, 0.5  # parts of the progress at which the cost is built, and the table filled

_SEGMENTS = 32  # edges of a quarter circle around corners: they cut 3e-4 of the radius off, less than the gap
_PUSHES = 60  # times that overlapping robots are pushed apart before the place counts as too narrow for them
_FARTHER = 1.005  # they are pushed a little too far, else they would never quite arrive
_MEMORY = 8  # steps from which the curvature is learnt
_ARMIJO = 1e-4  # part of the fall that the slope promises which is good enough
_HALVINGS = 4, 14  # of a step along the learnt direction, and along the slope, before it counts as none
_SLOW = 5, 1e-7  # so many steps that together lower the cost by less than this part of it are the last ones
_STEPS = 300  # most steps; some tens are usual


@dataclass(frozen=True, eq=False)
class Optimum:
    """The best positions that were found for a team on one map, and the coverage cost (22) there."""

    positions: Array  # (n, 2) m, from left to right, in the free space, clear of walls and of the others
    mean_distance: float  # m, as `CoverageResult` has it
    value: float  # m³
    uncovered_area: float  # m², of the components of the free space without a robot
    costs: Array  # (r,) m, the mean distance that each restart ended with, in their order,
    undescended: Array  # (r,) m, and that before the descent of the exact cost
    restart: int  # the one that gave the positions, the first of equals

    def compute_agreement(self, within: float = 0.005) -> float:
        """Return the share of the restarts whose mean distance is at most that part above the best."""
        return float((self.costs <= self.mean_distance * (1.0 + within)).mean())

    def compute_gap(self, mean_distance: float) -> float:
        """Return how far a mean distance (m) is above the best, as a part of it: J / J_ref - 1."""
        return mean_distance / self.mean_distance - 1.0


def find_optimum(
    environment: Environment,
    robots: int,
    *,
    radius: float = DEFAULT_RADIUS,
    lattice: int = 64,
    restarts: int = 24,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
) -> Optimum:
    """Return the best positions for a team on a map that is known.

    Where the free space has several components, the robots first cover as much of its area as they can,
    the largest components, and then make the cost of these as low as possible. (The cost alone would be
    lowest with all robots in the smallest room.) Components that are too small for a robot, or that hold
    no site of the lattice, are left alone.

    Each restart depends on the seed and its own number only: more of them never give a higher cost.

    `radius` is in m, `lattice` that of `CoverageCost`, whose sites the mean is taken over; `progress` is
    called now and then with the part that is done, and may raise, to give up. A ParameterError tells what
    is out of range, or that the robots do not fit.

    >>> from robocov.environment import Environment
    >>> best = find_optimum(Environment("square", ((0, 0), (2, 0), (2, 2), (0, 2))), 1, restarts=2)
    >>> best.positions.round(3)
    array([[1., 1.]])
    """
    require_number("robots", robots, 1, MAX_ROBOTS, whole=True)
    require_number("restarts", restarts, 1, MAX_RESTARTS, whole=True)
    if not (is_number(seed, Integral) and seed >= 0):
        raise ParameterError(f"seed: {quote(seed)}, but a whole number of at least 0 was wanted")
    if not (is_number(radius) and 0.0 < radius < math.inf):
        raise ParameterError(f"radius: {quote(radius)} m, but a number above 0 was wanted")
    tell = progress or (lambda part: None)
    cost = CoverageCost(environment, lattice, progress=lambda part: tell(_BUILT * part))
    search = _Search(environment, cost, robots, float(radius))
    tell(_TABLED)

    best: CoverageResult | None = None
    best_restart, outcomes = 0, []
    known: dict[tuple[int, ...], tuple[float, float]] = {}
    for restart in range(restarts):
        beat = partial(tell, _TABLED + (1.0 - _TABLED) * restart / restarts)
        sources = search.sources(np.random.default_rng([seed, restart]), beat)
        key = tuple(sources.tolist())
        # many restarts end in the same places: one descent tells where these lead
        if key not in known:
            places = search.places[sources]
            after = descend(cost, search.room, places, search.component[sources], beat)
            known[key] = cost(places).mean_distance, after.mean_distance
            if best is None or _rank(after) < _rank(best):
                best, best_restart = after, restart
        outcomes.append(known[key])
    tell(1.0)
    assert best is not None
    undescended, costs = map(freeze, zip(*outcomes, strict=True))
    positions = freeze(best.positions[np.lexsort(best.positions.T[::-1])])
    cost_there = best.mean_distance, best.value, best.uncovered_area
    return Optimum(positions, *cost_there, costs, undescended, best_restart)


def _rank(result: CoverageResult) -> tuple[float, float]:
    """Return what is to be made small, the first part before the second."""
    return result.uncovered_area, result.mean_distance


class _Search:
    """Shared by all restarts: room, places, and the table, (m, c) m, of distances from groups of sites."""

    def __init__(self, environment: Environment, cost: CoverageCost, robots: int, radius: float) -> None:
        self.cost, self.robots = cost, robots
        self.room = ConfigurationSpace(environment.free, radius)
        site_component = cost.geodesics.snap_to_free_space(cost.points)[1].argmax(axis=1)
        sites = np.bincount(site_component, minlength=len(self.room.parts))
        fit = [k for k, part in enumerate(self.room.parts) if not part.is_empty and sites[k]]
        # components are in the order of their areas
        covered = fit[:robots]
        area = sum(self.room.parts[k].area for k in covered)
        wanted = max(_SOURCES, _SOURCES_A_ROBOT * robots)
        spacing = max(math.sqrt(area / wanted), self.room.spacing)
        pieces = [_spread(self.room.parts[k], spacing) for k in covered]
        self.component = np.repeat(covered, [len(piece) for piece in pieces]).astype(np.intp)
        if len(self.component) < robots:
            capacity = sum(len(_spread(self.room.parts[k], self.room.spacing)) for k in fit)
            room = f"there is room for about {capacity}" if fit else "there is no room for any"
            told = f"{robots} of radius {radius:g} m, but {room} in map {environment.name!r}"
            raise ParameterError(f"robots: {told}")
        self.places = np.concatenate(pieces)
        self.table = self._distances(site_component, np.isin(site_component, covered))

    def _distances(self, site_component: IntArray, wanted: BoolArray) -> Array:
        """Return the table; its targets are one site for each square of some cells and component."""
        cost = self.cost
        side = max(1, math.ceil(math.sqrt(np.count_nonzero(wanted) / _TARGETS)))
        row, column = np.divmod(cost.cells, cost.lattice)
        square = (row // side * cost.lattice + column // side) * len(self.room.parts) + site_component
        # in whole numbers: of two by two cells all are as near to the middle, and chance decides
        off = (2 * (row % side) - side + 1) ** 2 + (2 * (column % side) - side + 1) ** 2
        chance = np.random.default_rng(0).random(len(square))
        site = np.nonzero(wanted)[0]
        site = site[np.lexsort((chance[site], off[site], square[site]))]
        _, first, count = np.unique(square[site], return_index=True, return_counts=True)
        weight = count if cost.weights is None else np.add.reduceat(cost.weights[site], first)
        table = cost.geodesics.compute_distances(self.places, cost.points[site[first]])
        table[np.isinf(table)] = _UNREACHED * cost.geodesics.size
        return np.ascontiguousarray((table * weight).T)

    def sources(self, rng: np.random.Generator, beat: Beat) -> IntArray:
        """Return the sources where one restart ends on the table, sorted, (n,).

        The table knows the cost only about: what came before stays where the exact cost says so.
        """
        drawn = seed_sources(self.table, self.robots, rng)
        lloyd = run_lloyd(self.table, drawn, beat=beat)
        stages = apply_best_swaps(self.table, lloyd, beat), lloyd, drawn
        return min(map(np.sort, stages), key=lambda some: _rank(self.cost(self.places[some])))


def _spread(part: BaseGeometry, spacing: float) -> Array:
    """Return places in a geometry, (p, 2), at least `spacing` apart: a grid, and what it leaves unfilled."""
    low_x, low_y, high_x, high_y = part.bounds
    # three fine steps make a coarse one
    step = max(spacing / 3.0, math.sqrt((high_x - low_x) * (high_y - low_y) / _FINEST))
    columns, rows = (int(extent / 2.0 / step) for extent in (high_x - low_x, high_y - low_y))
    row, column = (k.ravel() for k in np.mgrid[-rows : rows + 1, -columns : columns + 1])
    x, y = (low_x + high_x) / 2.0 + column * step, (low_y + high_y) / 2.0 + row * step
    inside = shapely.contains_xy(part, x, y)
    coarse = inside & (row % 3 == 0) & (column % 3 == 0)
    places = np.column_stack([x, y])
    chosen, rest = places[coarse].tolist(), places[inside & ~coarse]
    if not chosen:
        spot = part.representative_point()
        chosen = [[spot.x, spot.y]]
    if len(rest):
        away = np.asarray(cKDTree(chosen).query(rest)[0])
        while away[(far := int(away.argmax()))] >= 3.0 * step:
            chosen.append(rest[far].tolist())
            away = np.minimum(away, np.hypot(*(rest - rest[far]).T))
    return np.array(chosen)


class ConfigurationSpace:
    """Free configuration space of robots of some radius (m), a part for each component of the free space.

    They keep from walls (`clearance`), and from each other (`spacing`, m), the distance that starts leave as
    well: their radius (their diameter), and `START_GAP` of it.
    """

    def __init__(self, free: MultiPolygon, radius: float) -> None:
        self.clearance, self.spacing = (
            radius * (1.0 + MIN_START_GAP_RADII),
            2.0 * radius * (1.0 + MIN_START_GAP_RADII),
        )
        parts = [part.buffer(-self.clearance, quad_segs=_SEGMENTS) for part in free.geoms]
        self.parts: tuple[BaseGeometry, ...] = tuple(parts)
        shapely.prepare(list(self.parts))

    def nearest(self, positions: Array, component: IntArray) -> Array | None:
        """Return (n, 2) positions near the given ones where all fit, each in its component, or else None."""
        parts = np.array(self.parts, dtype=object)[component]
        positions = find_nearest_inside(parts, positions)
        for _ in range(_PUSHES):
            pairs = cKDTree(positions).query_pairs(self.spacing * (1.0 - 1e-9), output_type="ndarray")
            if not len(pairs):
                return positions
            positions = find_nearest_inside(parts, self._apart(positions, pairs[np.lexsort(pairs.T)]))
        return None

    def _apart(self, positions: Array, pairs: IntArray) -> Array:
        """Return positions with each of (p, 2) pairs pushed to its distance, half by each."""
        one, other = pairs.T
        between = positions[other] - positions[one]
        apart = np.hypot(between[:, 0], between[:, 1])
        # two robots in one place have no direction apart: a fixed one, another for each pair
        same = apart == 0.0
        angle = GOLDEN_ANGLE * (one[same] + other[same] * len(positions))
        between[same] = np.column_stack([np.cos(angle), np.sin(angle)])
        part = (_FARTHER * self.spacing - apart) / 2.0 / np.where(same, 1.0, apart)
        push = between * part[:, None]
        positions = positions.copy()
        np.subtract.at(positions, one, push)
        np.add.at(positions, other, push)
        return positions


def find_nearest_inside(area: Any, positions: Array) -> Array:
    """Return the nearest place in a geometry, or each in its own of (n,), for (n, 2) positions."""
    points = shapely.points(positions)
    away = np.flatnonzero(~shapely.intersects(area, points))
    if not len(away):
        return positions
    positions = positions.copy()
    lines = shapely.shortest_line(np.broadcast_to(area, len(points))[away], points[away])
    positions[away] = shapely.get_coordinates(lines)[::2]
    return positions


def descend(
    cost: CoverageCost,
    room: ConfigurationSpace,
    positions: Array,
    component: IntArray,
    beat: Beat = lambda: None,
) -> CoverageResult:
    """Return the coverage cost of a local minimum near the given positions, which is never higher.

    Projected quasi-Newton steps: L-BFGS (Nocedal and Wright, *Numerical Optimization*, algorithm 7.4),
    scaled by the curvature that Weiszfeld's iteration for the geometric median uses, from
    `ConfigurationSpace.nearest` back into the room, halved until the cost falls enough (Armijo). The cost
    is only piecewise smooth, as sites change owners and ways, and a wall may stop a robot: where the learnt
    direction does not lead down, the scaled slope alone is followed and the curvature learnt anew. No robot
    leaves its `component` of the free space.
    """
    result = cost(positions)
    slope = _slope(result)
    learnt: deque[tuple[Array, Array]] = deque(maxlen=_MEMORY)
    falls: deque[float] = deque(maxlen=_SLOW[0])

    def lower(way: Array, halvings: int) -> CoverageResult | None:
        """Return the cost after the first of ever shorter steps that lowers it enough, None for none."""
        for k in range(halvings):
            there = room.nearest(result.positions + 0.5**k * way, component)
            promised = 0.0 if there is None else float((slope * (there - result.positions)).sum())
            if there is not None and promised < 0.0:
                after = cost(there)
                if after.mean_distance <= result.mean_distance + _ARMIJO * promised:
                    return after
        return None

    for _ in range(_STEPS):
        beat()
        scale = _curvature(result, cost.spacing / 2.0)[:, None]
        after = lower(_direction(slope, scale, learnt), _HALVINGS[0]) if learnt else None
        if after is None:
            learnt.clear()
            after = lower(-slope / scale, _HALVINGS[1])
        if after is None:
            break
        slope_after = _slope(after)
        step, bend = after.positions - result.positions, slope_after - slope
        # only where it curves upwards the direction stays one of descent
        if (step * bend).sum() > 1e-10 * (bend * bend).sum():
            learnt.append((step, bend))
        falls.append(result.mean_distance - after.mean_distance)
        result, slope = after, slope_after
        if len(falls) == falls.maxlen and sum(falls) < _SLOW[1] * result.mean_distance:
            break
    return result


def _slope(result: CoverageResult) -> Array:
    """Return the derivative of the mean distance by the positions, (n, 2)."""
    if not result.value > 0.0:
        return np.zeros_like(result.positions)
    return result.gradient * (result.mean_distance / result.value)


def _curvature(result: CoverageResult, least: float) -> Array:
    """Return the mean over the sites, by weight, of the inverse distances to first way-points, (n,) 1/m."""
    site = np.nonzero(result.owner >= 0)[0]
    owner = result.owner[site]
    toward = result.first_waypoints[site] - result.positions[owner]
    # a site under the robot would hold it fast
    length = np.maximum(np.hypot(toward[:, 0], toward[:, 1]), least)
    pull, total = 1.0 / length, float(max(len(site), 1))
    if result.weights is not None:
        pull *= result.weights[site]
        total = float(result.weights[site].sum()) or 1.0
    curvature = np.bincount(owner, pull, minlength=len(result.positions)) / total
    return np.where(curvature > 0.0, curvature, 1.0)


def _direction(slope: Array, scale: Array, learnt: deque[tuple[Array, Array]]) -> Array:
    """Return the quasi-Newton direction (n, 2) m, by the steps that were learnt from."""
    step, bend = np.array(learnt).reshape(len(learnt), 2, -1).transpose(1, 0, 2)
    # in coordinates in which the curvature is about 1, from which scipy's recursion begins
    scale = np.broadcast_to(scale, slope.shape).ravel()
    root = np.sqrt(scale * (bend[-1] @ (bend[-1] / scale) / (step[-1] @ bend[-1])))
    way = scipy.optimize.LbfgsInvHessProduct(step * root, bend / root) @ (slope.ravel() / root)
    return np.asarray(-(way / root).reshape(slope.shape))
