"""The centralised reference: the best places for a team that knows the whole map.

The coverage cost (22) has many local minima. Each restart draws places by k-median++, improves them on
a table of geodesic distances between some hundreds of places, first by Lloyd's iteration, then by
interchange, which leaves most of these minima, and at last descends the exact cost itself. The best of
all restarts is no proof of the global minimum; how many restarts agree with it tells how far to trust it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from numbers import Integral
from typing import TYPE_CHECKING

import numpy as np
import shapely
from scipy.spatial import cKDTree

from robocov.arrays import Array, BoolArray, IntArray, frozen
from robocov.cost import CoverageCost
from robocov.errors import ParameterError, checked, is_number, shown
from robocov.k_median import Beat, best_swaps, lloyd_iterations, seeded
from robocov.optimum.descent import Room, descended
from robocov.robots import DEFAULT_RADIUS

if TYPE_CHECKING:
    from collections.abc import Callable

    from shapely.geometry.base import BaseGeometry

    from robocov.cost import CoverageResult
    from robocov.environment import Environment

MOST_ROBOTS = 500

MOST_RESTARTS = 100_000

_SOURCES, _SOURCES_A_ROBOT = 600, 20  # about so many places for robots are in the table, more for large teams
_TARGETS = 1000  # at most about so many groups of sites are in the table
_FINEST = 200_000  # at most so many places are looked at, in the box around a component, for these
_UNREACHED = 1e4  # sizes of the map that count as the distance to what a robot cannot reach
_BUILT, _TABLED = 0.3, 0.5  # parts of the progress at which the cost is built, and the table filled


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

    def agreement(self, within: float = 0.005) -> float:
        """Return the share of the restarts whose mean distance is at most that part above the best."""
        return float((self.costs <= self.mean_distance * (1.0 + within)).mean())

    def gap(self, mean_distance: float) -> float:
        """Return how far a mean distance (m) is above the best, as a part of it: J / J_ref - 1."""
        return mean_distance / self.mean_distance - 1.0


def optimum(
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
    >>> best = optimum(Environment("square", ((0, 0), (2, 0), (2, 2), (0, 2))), 1, restarts=2)
    >>> best.positions.round(3)
    array([[1., 1.]])
    """
    checked("robots", robots, 1, MOST_ROBOTS, whole=True)
    checked("restarts", restarts, 1, MOST_RESTARTS, whole=True)
    if not (is_number(seed, Integral) and seed >= 0):
        raise ParameterError(f"seed: {shown(seed)}, but a whole number of at least 0 was wanted")
    if not (is_number(radius) and 0.0 < radius < math.inf):
        raise ParameterError(f"radius: {shown(radius)} m, but a number above 0 was wanted")
    tell = progress or (lambda part: None)
    cost = CoverageCost(environment, lattice, progress=lambda part: tell(_BUILT * part))
    search = _Search(environment, cost, robots, float(radius))
    tell(_TABLED)

    best: CoverageResult | None = None
    best_restart, outcomes = 0, []
    known: dict[tuple[int, ...], tuple[float, float]] = {}
    for restart in range(restarts):
        part = _TABLED + (1.0 - _TABLED) * restart / restarts
        beat = partial(tell, part)
        sources = search.sources(np.random.default_rng([seed, restart]), beat)
        key = tuple(sources.tolist())
        # many restarts end in the same places: one descent tells where these lead
        if key not in known:
            before, after = search.descended(sources, beat)
            known[key] = before, after.mean_distance
            if best is None or _rank(after) < _rank(best):
                best, best_restart = after, restart
        outcomes.append(known[key])
    tell(1.0)
    assert best is not None
    undescended, costs = np.array(outcomes).T
    order = np.lexsort(best.positions.T[::-1])
    return Optimum(
        positions=frozen(best.positions[order]),
        mean_distance=best.mean_distance,
        value=best.value,
        uncovered_area=best.uncovered_area,
        costs=frozen(costs),
        undescended=frozen(undescended),
        restart=best_restart,
    )


def _rank(result: CoverageResult) -> tuple[float, float]:
    """Return what is to be made small, the first part before the second."""
    return result.uncovered_area, result.mean_distance


class _Search:
    """Shared by all restarts: the cost, the room for the robots, places and the table of distances.

    This, (m, c) m, holds the sums of the geodesic distances from the sites of each target, by their weights.
    """

    def __init__(self, environment: Environment, cost: CoverageCost, robots: int, radius: float) -> None:
        self.cost, self.robots = cost, robots
        self.room = Room(environment.free, radius)
        site_component = cost.geodesics.place(cost.points)[1].argmax(axis=1)
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
            room = f"there is room for about {len(self.component)}" if fit else "there is no room for any"
            raise ParameterError(
                f"robots: {robots} of radius {radius:g} m, but {room} in map {environment.name!r}"
            )
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
        table = cost.geodesics.distances(self.places, cost.points[site[first]])
        table[np.isinf(table)] = _UNREACHED * cost.geodesics.size
        return np.ascontiguousarray((table * weight).T)

    def sources(self, rng: np.random.Generator, beat: Beat) -> IntArray:
        """Return the sources where one restart ends on the table, sorted, (n,).

        The table knows the cost only about: what came before stays where the exact cost says so.
        """
        drawn = seeded(self.table, self.robots, rng)
        lloyd = lloyd_iterations(self.table, drawn, beat=beat)
        stages = best_swaps(self.table, lloyd, beat), lloyd, drawn
        return min(map(np.sort, stages), key=lambda some: _rank(self.cost(self.places[some])))

    def descended(self, sources: IntArray, beat: Beat) -> tuple[float, CoverageResult]:
        """Return the mean distance with robots at the sources, and the cost after the descent from there."""
        places, component = self.places[sources], self.component[sources]
        before = self.cost(places).mean_distance
        return before, descended(self.cost, self.room, places, component, beat)


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
