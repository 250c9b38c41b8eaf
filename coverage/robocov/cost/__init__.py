"""The coverage cost (22): the mean distance that the nearest robot must travel to reach a place."""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from robocov.arrays import Array, BoolArray, IntArray, compute_weighted_mean, find_run_starts, freeze
from robocov.cost.site_paths import GROUP, TILE, CornerViews, CostMap, Tiles, Work, corner_views, site_paths
from robocov.density.polygon_masses import compute_square_means
from robocov.drawing import Drawable
from robocov.environment import Environment, require_environment
from robocov.errors import InputError, ParameterError, format_count, quote, require_number, to_floats
from robocov.geodesic import BINS, Geodesics
from robocov.geodesic.angular_index import AngularWallIndex
from robocov.geodesic.walls import build_box_tree, compute_z_order

DEFAULT_LATTICE = 128
"""Cells along a side, unless something else is said."""

MAX_LATTICE = 4096
"""Finest lattice, in cells along a side."""

_BLOCK = 1 << 18
"""Cells that are looked at together, which bounds the memory."""

_REMEMBERED = 64
"""Maps whose costs are kept: an obstacle that moves comes by the same places again."""


@dataclass(frozen=True, eq=False)
class Sites:
    """Sites of a lattice: centres of its cells in free space, where the cost is integrated."""

    lattice: int
    """Cells along a side."""
    spacing: float
    """Side of a cell, m."""
    points: Array
    """(m, 2) m, row by row from the lower left."""
    cells: IntArray
    """(m,) Their numbers among all cells, ``row * lattice + column``."""

    def to_grid(self, values: NDArray[Any]) -> NDArray[Any]:
        """Return (m,) values of the sites as a picture of the whole lattice, (n, n), the lowest row first.

        Cells that are not free hold nan, or -1 where the values are whole numbers.
        """
        fill = np.nan if np.issubdtype(values.dtype, np.inexact) else -1
        picture = np.full(self.lattice**2, fill, dtype=values.dtype)
        picture[self.cells] = values
        return picture.reshape(self.lattice, self.lattice)


@dataclass(frozen=True, eq=False)
class CoverageResult(Drawable):
    """The coverage cost of one set of positions, and what it is made of."""

    _drawn_as = "result"

    mean_distance: float
    """Mean geodesic distance, m, of the sites to their nearest robot, over the components of the free space
    that hold robots, each site weighed by φ; nan if these are too small to hold a site."""
    value: float
    """Equation (22), m³, with φ as in (4): `mean_distance` times the integral of φ over these components,
    their area without a density. With `speeds` it is m² s, `mean_time` times that integral."""
    uncovered_area: float
    """Area, m², of the components without a robot."""
    distances: Array
    """(m,) m, to the nearest robot, or with `speeds` to the one that is there first; inf for none."""
    owner: IntArray
    """(m,) That robot (the geodesic Voronoi partition), of equals the first, -1 where none can come."""
    first_corner: IntArray
    """(m,) The row in `corners` where the way from the owner to the site bends first, -1 for nowhere,"""
    last_corner: IntArray
    """(m,) and where it bends last."""
    positions: Array
    """(n, 2) m"""
    points: Array
    """(m, 2) m, the sites."""
    corners: Array
    """(k, 2) m, all places where ways can bend."""
    environment: Environment | None = None
    """The map, and"""
    sites: Sites | None = None
    """its lattice, for plots."""
    weights: Array | None = None
    """(m,) The mean of φ over the cell of each site; None where every place counts the same."""
    speeds: Array | None = None
    """(n,) m/s, if not the nearest robot counts but the one that is there first."""
    mean_time: float | None = None
    """Mean time, s, with `speeds`, until the first robot is at a site."""

    def __repr__(self) -> str:
        robots = format_count(len(self.positions), "robot")
        uncovered = f", {self.uncovered_area:.3f} m² uncovered" if self.uncovered_area else ""
        time = "" if self.mean_time is None else f", mean time {self.mean_time:.3f} s"
        return f"<CoverageResult {robots}, mean distance {self.mean_distance:.3f} m{time}{uncovered}>"

    @cached_property
    def times(self) -> Array:
        """The time until the first robot is at each site, (m,) s, inf for none; without `speeds` at 1 m/s."""
        if self.speeds is None:
            return self.distances
        # where none can come, the distance is infinite whatever the speed
        return np.asarray(self.distances / self.speeds[self.owner])

    @cached_property
    def first_waypoints(self) -> Array:
        """The first way-point from the owner to the site, (m, 2) m: a corner, or the site itself."""
        first = self.points.copy()
        bent = np.nonzero(self.first_corner >= 0)[0]
        first[bent] = self.corners[self.first_corner[bent]]
        return first

    @cached_property
    def gradient(self) -> Array:
        """Derivative of `value` by the positions, (n, 2) m², with `speeds` m s.

        Each site pulls its owner towards the first way-point, by a unit vector times the site's part of
        the integral of φ, over the owner's speed. Exact wherever `value` is differentiable with the owners
        and ways as they are.
        """
        count = len(self.positions)
        site = np.nonzero(self.owner >= 0)[0]
        owner = self.owner[site]
        toward = self.first_waypoints[site] - self.positions[owner]
        length = np.hypot(toward[:, 0], toward[:, 1])
        toward /= np.where(length > 0.0, length, 1.0)[:, None]
        total = float(len(site))
        if self.weights is not None:
            toward *= self.weights[site, None]
            total = float(self.weights[site].sum())
        pull = [np.bincount(owner, toward[:, k], minlength=count) for k in (0, 1)]
        mean = self.mean_distance if self.mean_time is None else self.mean_time
        weight = self.value / (mean * total) if total and mean else 0.0
        slope = np.column_stack(pull) * -weight
        return np.asarray(slope if self.speeds is None else slope / self.speeds[:, None])


class CoverageCost:
    """The coverage cost (22) of one environment on a lattice of sites.

    The region's bounding box is widened to a square, anchored at its lower left corner, and cut into
    ``lattice²`` square cells; the cell centres in the open free space are the sites. Distances are
    exact; only the mean over the sites is an approximation of the integral. Where the environment has a
    density φ, each site is weighed by the exact mean of φ over its cell.

    Parameters
    ----------
    environment : Environment
    lattice : int
        Cells along a side.
    progress : callable
        Told which part of what is known before the positions is computed. It may raise, to give up.
    geodesics : Geodesics
        The shortest paths of this very environment, where another lattice on it has found them already.

    Attributes
    ----------
    environment, lattice, geodesics
    sites : Sites
        Whose `points`, `cells` and `spacing` are attributes here, too.
    corners, weights
        As of `CoverageResult`.

    Raises ParameterError when `lattice` is no whole number from 1 to 4096, or so coarse that no site is free.

    Examples
    --------
    >>> from robocov.environment import Environment
    >>> cost = CoverageCost(Environment("square", ((0, 0), (1, 0), (1, 1), (0, 1))))
    >>> round(cost([[0.5, 0.5]]).mean_distance, 3)
    0.383
    """

    def __init__(
        self,
        environment: Environment,
        lattice: int = DEFAULT_LATTICE,
        *,
        progress: Callable[[float], None] | None = None,
        geodesics: Geodesics | None = None,
    ) -> None:
        require_environment(environment)
        self.lattice = int(require_number("lattice", lattice, 1, MAX_LATTICE, whole=True))
        self.environment = environment
        beat = None if progress is None else partial(progress, 0.0)
        self.geodesics = geodesics = Geodesics(environment, beat) if geodesics is None else geodesics
        self._areas = np.array([part.area for part in environment.free.geoms])
        self.corners = freeze(geodesics.corners)
        self.sites, tiles = _lattice_of(geodesics, self.lattice)
        self.points, self.cells, self.spacing = self.sites.points, self.sites.cells, self.sites.spacing
        rows, spans = geodesics.run_for_corners(partial(corner_views, geodesics.walls, tiles), progress)
        order = np.argsort(rows[:, 1], kind="stable")
        first = np.searchsorted(rows[order, 1], np.arange(len(tiles.boxes) + 1))
        views = CornerViews(first, rows[order][:, [0, 2]], spans[order])
        self._map = CostMap(geodesics.walls, geodesics.graph, tiles, views)
        # so many entries for each robot were enough so far
        self._room = 2 * BINS
        self._weigh()

    def with_density(self, environment: Environment) -> CoverageCost:
        """Return the coverage cost of an environment that differs in its density alone; all else is kept."""
        twin = copy(self)
        twin.environment = environment
        twin._weigh()
        return twin

    def _weigh(self) -> None:
        density, self._masses = self.environment.density, self.environment.free_masses
        self._mass, self.weights = float(self._masses.sum()), None
        if density is not None and not density.is_uniform:
            self.weights = freeze(compute_square_means(density, self.points, self.spacing))

    def __call__(self, positions: Array, speeds: Array | None = None) -> CoverageResult:
        """Return the coverage cost of (n, 2) positions in metres.

        With `speeds`, (n,) m/s, not the nearest robot counts but the one that is there first, and the cost is
        in seconds. Raises InputError when there is no robot, or one is outside the free space, or speeds are
        not positive numbers, one for each robot; the message names it.
        """
        positions = to_floats("positions", positions, "[x, y] of each robot in metres", InputError)
        if not positions.size:
            raise InputError("positions: none, but at least one robot was wanted")
        places, holds = self.geodesics.snap_to_free_space(positions)
        if speeds is None:
            distances, ways = self._nearest(places[None], holds[None])
            return self._result(positions, holds, distances[0], ways[0], None)
        speeds = _checked_speeds(speeds, len(positions))
        # of robots that are equally fast the nearest is first: each speed is one search among its robots
        distances, ways = np.full(len(self.points), np.inf), np.full((3, len(self.points)), -1)
        times = distances.copy()
        for speed in np.unique(speeds)[::-1]:
            rows = np.flatnonzero(speeds == speed)
            some, their = (found[0] for found in self._nearest(places[None, rows], holds[None, rows]))
            sooner = some / speed < times
            their[0] = rows[their[0]]
            times[sooner], distances[sooner] = some[sooner] / speed, some[sooner]
            ways[:, sooner] = their[:, sooner]
        return self._result(positions, holds, distances, ways, speeds)

    def evaluate_teams(self, positions: Array) -> list[CoverageResult]:
        """Return the coverage cost of each of some teams, (r, n, 2) m: as one by one, but quicker."""
        places, holds = self.geodesics.snap_to_free_space(positions.reshape(-1, 2))
        holds = holds.reshape(*positions.shape[:2], -1)
        found = self._nearest(places.reshape(positions.shape), holds)
        return [self._result(*each, None) for each in zip(positions, holds, *found, strict=True)]

    def _nearest(self, places: Array, holds: BoolArray) -> tuple[Array, IntArray]:
        """Return the distances of the sites from teams at (r, n, 2), (r, m) m, and the ways, (r, 3, m)."""
        (teams, n, _), m, k = places.shape, len(self.points), len(self.corners)
        tiles, slots = self._map.tiles.facts.shape[1:]
        lists, queue, hidden = (np.empty(size, np.int64) for size in ((3, n), (2, k + 1), tiles))
        to_corners = np.empty(k), np.empty((k, 3), np.int64)
        to_sites = np.empty((tiles, slots)), np.empty((3, tiles, slots), np.int64)
        found = np.empty((teams, m)), np.empty((teams, 3, m), np.int64)
        covered = np.asarray(holds.any(axis=1))
        while True:
            sight = AngularWallIndex.allocate(n, BINS, self._room * n + 2 * BINS)
            work = Work(sight, lists, queue, hidden, *to_corners, *to_sites)
            if site_paths(self._map, work, places, covered, self.geodesics.grid.unit, *found):
                return found
            self._room *= 2

    def _result(
        self, positions: Array, holds: BoolArray, distances: Array, ways: IntArray, speeds: Array | None
    ) -> CoverageResult:
        owner, corner, last_corner = ways
        covered = holds.any(axis=0)
        reached, weights, whose, mass, uncovered = distances, self.weights, owner, self._mass, 0.0
        if not covered.all():
            some = owner >= 0
            reached, whose = reached[some], whose[some]
            weights = None if weights is None else weights[some]
            mass, uncovered = float(self._masses[covered].sum()), float(self._areas[~covered].sum())
        mean = compute_weighted_mean(reached, weights)
        time = None if speeds is None else compute_weighted_mean(reached / speeds[whose], weights)
        return CoverageResult(
            mean_distance=mean, value=(mean if time is None else time) * mass, uncovered_area=uncovered,
            distances=distances, owner=owner, first_corner=corner, last_corner=last_corner,
            positions=positions, points=self.points, corners=self.corners, environment=self.environment,
            sites=self.sites, weights=self.weights, speeds=speeds, mean_time=time,
        )  # fmt: skip

    def to_grid(self, values: NDArray[Any]) -> NDArray[Any]:
        """Return (m,) values of the sites as a picture; see `Sites.to_grid`."""
        return self.sites.to_grid(values)

    def find_path(self, positions: Array, point: Array) -> Array:
        """Return the shortest path from a point to the nearest of (n, 2) robots, (w, 2) way-points in metres.

        Both ends are included; (0, 2) where no robot can come. Raises InputError when the point or a robot is
        outside the free space.
        """
        positions = np.asarray(positions, dtype=float)
        point = np.asarray(point, dtype=float)
        distances = self.geodesics.compute_distances(point[None], positions)[0]
        return self.geodesics.find_path(point, positions[int(distances.argmin())])


class TimeVaryingCost:
    """The coverage cost (22) of a map at any time.

    Only robots count that work: one that has failed goes nowhere. Nor does one that a moving obstacle has
    run over, until it is out again. `cost` is that of the map as it was given, at time zero; `progress` is as
    `CoverageCost` takes it, for the maps of later moments.
    """

    def __init__(self, cost: CoverageCost, progress: Callable[[float], None] | None = None) -> None:
        self._cost, self._progress = cost, progress
        self._known: dict[bytes, CoverageCost] = {}

    def get_cost(self, time: float) -> CoverageCost:
        """Return the coverage cost of the map as it is at a time, s; the given one where nothing moves."""
        environment = self._cost.environment
        if not environment.has_moving_obstacles:
            return self._cost
        now = environment.at(time)
        key = now.free.wkb
        if key not in self._known:
            if len(self._known) >= _REMEMBERED:
                del self._known[next(iter(self._known))]
            self._known[key] = CoverageCost(now, self._cost.lattice, progress=self._progress)
        return self._known[key]

    def find_counted_robots(
        self, time: float, positions: Array, working: BoolArray | None = None
    ) -> BoolArray:
        """Return which robots at (n, 2) m count at a time, s, (n,); all work if `working`, (n,), is None."""
        counted = np.ones(len(positions), dtype=bool) if working is None else working.copy()
        if self._cost.environment.has_moving_obstacles:
            counted &= shapely.contains_properly(
                self.get_cost(time).environment.free, shapely.points(positions)
            )
        return counted

    def __call__(
        self, time: float, positions: Array, working: BoolArray | None = None, speeds: Array | None = None
    ) -> CoverageResult | None:
        """Return the coverage cost at a time; None where no robot counts.

        The parameters are those of `counted`, and `speeds` (n,) m/s those of `CoverageCost`; the rows of the
        result are those of the robots that count.
        """
        counted = self.find_counted_robots(time, positions, working)
        if not counted.any():
            return None
        return self.get_cost(time)(positions[counted], None if speeds is None else speeds[counted])

    def evaluate_all_robots(
        self, time: float, positions: Array, working: BoolArray | None = None
    ) -> CoverageResult | None:
        """Return the same with a row for every robot; one that does not count is nearest to nothing."""
        result = self(time, positions, working)
        if result is None or len(result.positions) == len(positions):
            return result
        rows = np.flatnonzero(self.find_counted_robots(time, positions, working))
        owner = np.where(result.owner >= 0, rows[result.owner], -1)
        return replace(result, positions=np.array(positions), owner=owner)

    def compute_figures(
        self, time: float, positions: Array, working: BoolArray | None = None
    ) -> tuple[float, float, float]:
        """Return mean distance, m, cost (22), m³, and uncovered area, m²; nan, nan, all where none counts."""
        result = self(time, positions, working)
        if result is None:
            return np.nan, np.nan, self.get_cost(time).environment.free_area
        return result.mean_distance, result.value, result.uncovered_area


def _lattice_of(geodesics: Geodesics, side: int) -> tuple[Sites, Tiles]:
    """Return the free cells of a lattice of so many cells a side, by rows, and in tiles of 4 by 4 cells."""
    grid, spacing = geodesics.grid, geodesics.size / side

    def middles(cells: IntArray) -> Array:
        return (np.column_stack([cells % side, cells // side]) + 0.5) * spacing + grid.origin

    free, components = [], []
    for block in range(0, side * side, _BLOCK):
        cells = np.arange(block, min(block + _BLOCK, side * side))
        inside = geodesics.count_windings(grid.snap(middles(cells))) == 1
        some = inside.any(axis=1)
        free.append(cells[some])
        components.append(inside[some].argmax(axis=1))
    cells, component = np.concatenate(free), np.concatenate(components)
    if not len(cells):
        raise ParameterError(f"lattice: {side}, but none of its sites is free; a finer one was wanted")
    cells.setflags(write=False)
    sites = Sites(side, spacing, freeze(middles(cells)), cells)

    tile = compute_z_order(cells % side // TILE, cells // side // TILE)
    order = np.argsort(tile, kind="stable")
    begin = find_run_starts(tile[order])
    slots = np.arange(TILE**2)
    empty = slots >= np.diff(begin, append=len(order))[:, None]
    chosen = order[np.where(empty, 0, slots) + begin[:, None]]
    places = np.ascontiguousarray(np.moveaxis(grid.snap(sites.points[chosen]), -1, 0))
    boxes = np.column_stack([*places.min(axis=2), *places.max(axis=2)])
    low, high = boxes[:, :2], boxes[:, 2:]
    groups = np.arange(0, len(low), GROUP)
    around = np.hstack([np.minimum.reduceat(low, groups), np.maximum.reduceat(high, groups)])
    facts = np.stack([np.where(empty, -1, chosen), component[chosen]])
    return sites, Tiles(places, facts, boxes, around, build_box_tree(low, high))


def _checked_speeds(speeds: object, robots: int) -> Array:
    """Return the speeds of so many robots, (n,) m/s; raise InputError when they are not positive numbers."""
    try:
        values = np.array(speeds, dtype=float)
    except (TypeError, ValueError):
        values = np.empty(0)
    if values.shape != (robots,):
        raise InputError(f"speeds: {quote(speeds)}, but a number for each of {robots} robots was wanted")
    for k, value in enumerate(values.tolist()):
        if not 0.0 < value < np.inf:
            raise InputError(f"speeds[{k}]: {quote(value)} m/s, but a number above 0 was wanted")
    return values
