"""The search for the best positions of a team: the best of many restarts."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from numbers import Integral
from typing import NamedTuple

import numpy as np
import shapely
from scipy.spatial import cKDTree
from shapely.geometry.base import BaseGeometry

from robocov.arrays import Array, BoolArray, IntArray, compute_lengths, freeze
from robocov.cost import CoverageCost, CoverageResult
from robocov.defaults import DEFAULT_RADIUS_M
from robocov.environment import Environment
from robocov.errors import ParameterError, is_number, quote, require_number
from robocov.k_median import apply_best_swaps, run_lloyd, seed_sources
from robocov.optimum.configuration_space import ConfigurationSpace
from robocov.optimum.descent import descend

MAX_ROBOTS = 500
"""Maximum number of robots."""

MAX_RESTARTS = 100_000
"""Maximum number of restarts of the search."""

_MIN_CANDIDATES = 600
"""Approximate minimum number of candidate positions for robots."""

_CANDIDATES_PER_ROBOT = 20
"""Approximate minimum number of candidate positions per robot."""

_MAX_TARGETS = 1000
"""Approximate maximum number of groups of sites in the distance table."""

_MAX_GRID_POINTS = 200_000
"""Maximum number of grid points, in the box around a component, from which candidates are chosen."""

_STEPS_PER_SPACING = 3
"""Number of steps of that grid from one candidate to the next."""

_UNREACHABLE_SIZES = 1e4
"""Distance to a site that cannot be reached, in multiples of the size of the map."""

_PROGRESS_AFTER_COST = 0.3
"""Fraction of the work that is done when the cost has been prepared."""

_PROGRESS_AFTER_TABLE = 0.5
"""Fraction of the work that is done when the table has been computed."""


@dataclass(frozen=True, eq=False)
class Optimum:
    """The best positions found for a team on one map, and their coverage cost (22).

    Attributes
    ----------
    positions : (n, 2) array, m
        From left to right, in the free space, clear of walls and of each other.
    mean_distance : float, m
        See `CoverageResult`.
    value : float, m³
        See `CoverageResult`.
    uncovered_area : float, m²
        Area of the components of the free space without a robot.
    costs : (r,) array, m
        Mean distance at the end of each restart.
    costs_before_descent : (r,) array, m
        Mean distance of each restart before the descent of the exact cost.
    restart : int
        The restart that found the positions, the first one if several did.

    See Also
    --------
    find_optimum : Find the best positions for a team.
    LowerBound : Proves how far a placement can be from the optimum.

    Examples
    --------
    >>> import robocov as rc
    >>> square = rc.Environment("square", ((0, 0), (2, 0), (2, 2), (0, 2)))
    >>> best = rc.find_optimum(square, robots=1, restarts=2)
    >>> round(best.compute_gap(1.1 * best.mean_distance), 3)
    0.1
    """

    positions: Array
    mean_distance: float
    value: float
    uncovered_area: float
    costs: Array
    costs_before_descent: Array
    restart: int

    def compute_agreement(self, within: float = 0.005) -> float:
        """Compute the fraction of restarts that ended close to the best one.

        Parameters
        ----------
        within : float
            Maximum excess of their mean distance, relative to the best one.

        Returns
        -------
        float
        """
        return float((self.costs <= self.mean_distance * (1.0 + within)).mean())

    def compute_gap(self, mean_distance: float) -> float:
        """Compute the relative excess of a mean distance over that of the optimum, J / J_ref - 1.

        Parameters
        ----------
        mean_distance : float, m
            Mean distance of another placement on the same map and lattice.

        Returns
        -------
        float
        """
        return mean_distance / self.mean_distance - 1.0


def find_optimum(
    environment: Environment,
    robots: int,
    *,
    radius: float = DEFAULT_RADIUS_M,
    lattice: int = 64,
    restarts: int = 24,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
) -> Optimum:
    """Find the best positions for a team that knows the whole map.

    Parameters
    ----------
    environment : Environment
        The map, which the team knows.
    robots : int
        Number of robots.
    radius : float, m
        Radius of the robots.
    lattice : int
        Number of cells along a side of the lattice; see `CoverageCost`.
    restarts : int
        Number of restarts. Each depends only on the seed and its own number, so more restarts never give a
        higher cost.
    seed : int
        Seed of all restarts.
    progress : callable, optional
        Called regularly with the fraction that is done. It may raise an exception to stop.

    Returns
    -------
    Optimum

    Raises
    ------
    ParameterError
        If a parameter is out of range, or the robots do not fit.

    See Also
    --------
    compute_lower_bound : Prove how far a placement can be from the optimum.
    CoverageCost : Evaluate a placement.

    Notes
    -----
    The coverage cost (22) has many local minima. Each restart draws positions by k-median++ and improves them
    on a table of geodesic distances from several hundred candidate positions: first by Lloyd's iteration,
    then by interchange, which escapes most of these minima. Finally, it descends the exact cost. The best of
    all restarts is not proven to be the global minimum, but the more restarts agree on it, the more likely
    it is.

    If the free space has several components, the robots first cover as much area as possible by occupying the
    largest components, and then minimize the cost there. (The cost alone would be lowest with all robots in
    the smallest room.) Gaps that are narrower than a robot separate components; see `CoverageCost`.
    Components that are too small for a robot, or contain no site of the lattice, are ignored.

    Examples
    --------
    >>> import robocov as rc
    >>> square = rc.Environment("square", ((0, 0), (2, 0), (2, 2), (0, 2)))
    >>> best = rc.find_optimum(square, robots=1, restarts=2)
    >>> best.positions.round(3)
    array([[1., 1.]])
    """
    _check_parameters(robots, restarts, seed, radius)
    report = progress or (lambda fraction: None)
    cost = CoverageCost(
        environment,
        lattice,
        radius=radius,
        progress=lambda fraction: report(_PROGRESS_AFTER_COST * fraction),
    )
    search = _Search(cost, robots)
    report(_PROGRESS_AFTER_TABLE)
    outcomes = []
    for restart in range(restarts):
        fraction = _PROGRESS_AFTER_TABLE + (1.0 - _PROGRESS_AFTER_TABLE) * restart / restarts
        rng = np.random.default_rng([seed, restart])
        outcomes.append(search.run_restart(rng, partial(report, fraction)))
    report(1.0)
    best_restart = min(range(restarts), key=lambda restart: _get_rank(outcomes[restart]))
    best = outcomes[best_restart]
    from_left_to_right = np.lexsort((best.positions[:, 1], best.positions[:, 0]))
    return Optimum(
        positions=freeze(best.positions[from_left_to_right]),
        mean_distance=best.mean_distance,
        value=best.value,
        uncovered_area=best.uncovered_area,
        costs=freeze([outcome.mean_distance for outcome in outcomes]),
        costs_before_descent=freeze([outcome.mean_distance_before_descent for outcome in outcomes]),
        restart=best_restart,
    )


class _Outcome(NamedTuple):
    """The outcome of a restart."""

    mean_distance_before_descent: float
    """m"""
    positions: Array
    """(n, 2) m"""
    mean_distance: float
    """m"""
    value: float
    """m³"""
    uncovered_area: float
    """m²"""


def _check_parameters(robots: int, restarts: int, seed: int, radius: float) -> None:
    """Raise ParameterError if a parameter of `find_optimum` is out of range."""
    require_number("robots", robots, 1, MAX_ROBOTS, whole=True)
    require_number("restarts", restarts, 1, MAX_RESTARTS, whole=True)
    if not (is_number(seed, Integral) and seed >= 0):
        raise ParameterError(f"seed: expected a whole number of at least 0, got {quote(seed)}")
    if not (is_number(radius) and 0.0 < radius < math.inf):
        raise ParameterError(f"radius: expected a number above 0 m, got {quote(radius)}")


def _get_rank(result: CoverageResult | _Outcome) -> tuple[float, float]:
    """Return the sort key of a result: the uncovered area, then the mean distance."""
    return result.uncovered_area, result.mean_distance


class _SiteGroups(NamedTuple):
    """Groups of neighboring sites; each group is one row of the distance table."""

    representatives: IntArray
    """(t,) The site of each group at which distances are measured."""
    weights: Array | IntArray
    """(t,) Sum of the weights of each group's sites; their number if all weights are equal."""


class _Search:
    """The data that all restarts share.

    Attributes
    ----------
    space : ConfigurationSpace
    candidates : (c, 2) array, m
        Candidate positions for robots, which are the sources of the table.
    component : (c,) int array
        The component of the free space that contains each candidate.
    table : (t, c) array, m
        Distances from groups of sites to the candidates, times the weights of the groups.
    """

    def __init__(self, cost: CoverageCost, robot_count: int) -> None:
        self.cost = cost
        self.robot_count = robot_count
        self.space = ConfigurationSpace(
            cost.environment.free, cost.radius, closed=cost.closed_environment.free
        )
        _, is_inside = cost.geodesics.snap_to_free_space(cost.points)
        # A site on the border of two components belongs to the first one.
        site_component = is_inside.argmax(axis=1)
        areas = self.space.components
        site_counts = np.bincount(site_component, minlength=len(areas))
        usable = [k for k, area in enumerate(areas) if not area.is_empty and site_counts[k]]
        # The robots occupy the largest components; these come first.
        covered = usable[:robot_count]
        candidates = self._spread_candidates(covered)
        self.component = np.repeat(covered, [len(points) for points in candidates]).astype(np.intp)
        if len(self.component) < robot_count:
            capacity = sum(len(_spread_points(areas[k], self.space.spacing)) for k in usable)
            raise ParameterError(
                f"robots: expected at most about {capacity}, as many as fit with radius {cost.radius:g} m in "
                f"map {cost.environment.name!r}, got {robot_count}"
            )
        self.candidates = np.concatenate(candidates)
        groups = self._group_sites(site_component, np.isin(site_component, covered))
        self.table = self._compute_table(groups)
        # Many restarts find the same sources; the descent from them is computed only once.
        self._outcome_by_sources: dict[tuple[int, ...], _Outcome] = {}

    def _spread_candidates(self, covered: list[int]) -> list[Array]:
        """Return candidate positions in each of the covered components, (c, 2) m each."""
        areas = [self.space.components[k] for k in covered]
        total_area = sum(area.area for area in areas)
        count = max(_MIN_CANDIDATES, _CANDIDATES_PER_ROBOT * self.robot_count)
        # Each candidate gets a square of the same area, but robots at adjacent candidates must not overlap.
        spacing = max(math.sqrt(total_area / count), self.space.spacing)
        return [_spread_points(area, spacing) for area in areas]

    def run_restart(self, rng: np.random.Generator, heartbeat: Callable[[], None]) -> _Outcome:
        """Find sources and descend from them."""
        sources = self._find_sources(rng, heartbeat)
        key = tuple(sources.tolist())
        if key not in self._outcome_by_sources:
            positions = self.candidates[sources]
            result = descend(self.cost, self.space, positions, self.component[sources], heartbeat)
            self._outcome_by_sources[key] = _Outcome(
                mean_distance_before_descent=self.cost(positions).mean_distance,
                positions=result.positions,
                mean_distance=result.mean_distance,
                value=result.value,
                uncovered_area=result.uncovered_area,
            )
        return self._outcome_by_sources[key]

    def _group_sites(self, site_component: IntArray, is_covered: BoolArray) -> _SiteGroups:
        """Group the covered sites by component, in square blocks of lattice cells."""
        cost = self.cost
        # The side of a block, in cells.
        side = max(1, math.ceil(math.sqrt(np.count_nonzero(is_covered) / _MAX_TARGETS)))
        row, column = np.divmod(cost.cells, cost.lattice)
        # A group is numbered by its block, and within a block by its component.
        block = row // side * cost.lattice + column // side
        group = block * len(self.space.components) + site_component
        # A group is represented by the site nearest to the middle of its block. Ties, such as between all
        # cells of a two by two block, are broken at random.
        squared_offset = _compute_offsets(row, side) ** 2 + _compute_offsets(column, side) ** 2
        tie_breaker = np.random.default_rng(0).random(len(group))
        # Sort the covered sites by group (`lexsort` expects the most important key last). The first site of
        # each group is its representative.
        sites = np.flatnonzero(is_covered)
        sites = sites[np.lexsort((tie_breaker[sites], squared_offset[sites], group[sites]))]
        _, starts, counts = np.unique(group[sites], return_index=True, return_counts=True)
        weights = counts if cost.weights is None else np.add.reduceat(cost.weights[sites], starts)
        return _SiteGroups(representatives=sites[starts], weights=weights)

    def _compute_table(self, groups: _SiteGroups) -> Array:
        """Compute the table of weighted distances from groups of sites to the candidates."""
        cost = self.cost
        distances = cost.geodesics.compute_distances(self.candidates, cost.points[groups.representatives])
        distances[np.isinf(distances)] = _UNREACHABLE_SIZES * cost.geodesics.size
        return np.ascontiguousarray((distances * groups.weights).T)

    def _find_sources(self, rng: np.random.Generator, heartbeat: Callable[[], None]) -> IntArray:
        """Return the sources that one restart finds on the table, sorted, (n,).

        Since the table only approximates the cost, the result of an earlier stage is used if its exact cost
        is lower.
        """
        first_sources = seed_sources(self.table, self.robot_count, rng)
        lloyd_sources = run_lloyd(self.table, first_sources, heartbeat=heartbeat)
        swapped_sources = apply_best_swaps(self.table, lloyd_sources, heartbeat)
        stages = [np.sort(sources) for sources in (swapped_sources, lloyd_sources, first_sources)]
        return min(stages, key=lambda sources: _get_rank(self.cost(self.candidates[sources])))


def _compute_offsets(index: IntArray, side: int) -> IntArray:
    """Return the offsets of rows, or of columns, from the middles of their blocks of `side` cells.

    They are counted in half cells, so that they are whole numbers, and equal distances are exactly equal.
    """
    return 2 * (index % side) - (side - 1)


def _spread_points(area: BaseGeometry, spacing: float) -> Array:
    """Return points in an area, (p, 2), at least `spacing` apart: a coarse grid with its gaps filled.

    Every third row and column of a fine grid form the coarse grid. The other points of the fine grid fill the
    gaps between the coarse grid and the walls.
    """
    low_x, low_y, high_x, high_y = area.bounds
    min_step = math.sqrt((high_x - low_x) * (high_y - low_y) / _MAX_GRID_POINTS)
    step = max(spacing / _STEPS_PER_SPACING, min_step)
    # Rows and columns of the fine grid are counted from the middle of the bounding box.
    max_column = int((high_x - low_x) / 2.0 / step)
    max_row = int((high_y - low_y) / 2.0 / step)
    row_grid, column_grid = np.mgrid[-max_row : max_row + 1, -max_column : max_column + 1]
    row = row_grid.ravel()
    column = column_grid.ravel()
    x = (low_x + high_x) / 2.0 + column * step
    y = (low_y + high_y) / 2.0 + row * step
    points = np.column_stack([x, y])
    is_inside = shapely.contains_xy(area, x, y)
    is_on_coarse_grid = is_inside & (row % _STEPS_PER_SPACING == 0) & (column % _STEPS_PER_SPACING == 0)
    chosen = points[is_on_coarse_grid]
    if len(chosen) == 0:
        point = area.representative_point()
        chosen = np.array([[point.x, point.y]])
    return _fill_gaps(chosen, points[is_inside & ~is_on_coarse_grid], _STEPS_PER_SPACING * step)


def _fill_gaps(points: Array, candidates: Array, spacing: float) -> Array:
    """Repeatedly add the candidate farthest from all points, while it is at least `spacing` away."""
    if len(candidates) == 0:
        return points
    distance = np.asarray(cKDTree(points).query(candidates)[0])
    farthest = int(distance.argmax())
    added = []
    while distance[farthest] >= spacing:
        added.append(candidates[farthest])
        offset = candidates - candidates[farthest]
        distance = np.minimum(distance, compute_lengths(offset))
        farthest = int(distance.argmax())
    return np.vstack([points, *added])
