"""The search for the best positions of a team: the best of many restarts.

Equation numbers refer to Renzaglia and Martinelli, "Distributed Coverage Control for a Multi-Robot Team in a
Non-Convex Environment".
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
import shapely
from scipy.spatial import cKDTree
from shapely.geometry.base import BaseGeometry

from robocov.arrays import compute_lengths, copy_read_only
from robocov.cost import CoverageCost, CoverageResult
from robocov.defaults import DEFAULT_RADIUS_M
from robocov.environment import Environment
from robocov.environment.packing import pack_densely
from robocov.errors import ParameterError, require_number, require_whole_number
from robocov.k_median import apply_best_swaps, run_lloyd, seed_sources
from robocov.optimum.configuration_space import ConfigurationSpace
from robocov.optimum.descent import descend
from robocov.team import PARAMETERS as TEAM_PARAMETERS
from robocov.typing import BoolArray, FloatArray, IntArray

MAX_ROBOTS = 500
"""Maximum number of robots."""

MAX_RESTARTS = 100_000
"""Maximum number of restarts of the search."""

_MIN_CANDIDATES = 600
"""Approximate minimum number of candidate positions for robots."""

_CANDIDATES_PER_ROBOT = 20
"""Approximate minimum number of candidate positions per robot."""

_MAX_GROUPS = 1000
"""Approximate maximum number of groups of sites in the distance table."""

_MAX_GRID_POINTS = 200_000
"""Approximate maximum number of points of the fine grid from which candidates are chosen, in the bounding box
of a component."""

_STEPS_PER_SPACING = 3
"""Number of steps of the fine grid from one candidate to the next."""

_UNREACHABLE_SIZES = 1e4
"""Distance that the table contains if a site cannot be reached, as a multiple of the size of the map."""

_PROGRESS_AFTER_COST = 0.3
"""Completed fraction of the work when the cost has been prepared."""

_PROGRESS_AFTER_TABLE = 0.5
"""Completed fraction of the work when the table has been computed."""


@dataclass(frozen=True, eq=False)
class Optimum:
    """The best positions found for a team on one map, and their coverage cost (22).

    Attributes
    ----------
    positions : (n, 2) array, m
        Positions of the robots from left to right, at which they fit between walls and other robots.
    mean_distance : float, m
        Mean geodesic distance from a site to the nearest robot; see `CoverageResult`.
    value : float, m³
        Coverage cost (22); see `CoverageResult`.
    uncovered_area : float, m²
        Area of the components of the free space without a robot.
    costs : (r,) array, m
        Mean distance at the end of each restart.
    costs_before_descent : (r,) array, m
        Mean distance of each restart before the descent of the exact cost.
    restart : int
        Index of the restart that found the positions; the first one if several restarts found them.

    See Also
    --------
    find_optimum : Find the best positions for a team.
    LowerBound : A bound on how much lower the cost of any placement can be.

    Examples
    --------
    >>> import robocov as rc
    >>> square = rc.Environment("square", ((0, 0), (2, 0), (2, 2), (0, 2)))
    >>> best = rc.find_optimum(square, robots=1, restarts=2)
    >>> round(best.compute_gap(1.1 * best.mean_distance), 3)
    0.1
    """

    positions: FloatArray
    mean_distance: float
    value: float
    uncovered_area: float
    costs: FloatArray
    costs_before_descent: FloatArray
    restart: int

    def compute_agreement(self, within: float = 0.005) -> float:
        """Compute the fraction of restarts that ended with nearly the same mean distance as the best one.

        Parameters
        ----------
        within : float
            Maximum difference from the mean distance of the best restart, as a fraction of it.

        Returns
        -------
        float
        """
        return float((self.costs <= self.mean_distance * (1.0 + within)).mean())

    def compute_gap(self, mean_distance: float) -> float:
        """Compute the gap of a mean distance J to that of this placement J_ref, J / J_ref - 1.

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
        Number of restarts. Each depends only on the seed and its own index, so that more restarts never give
        a higher cost.
    seed : int
        Seed of the random numbers of all restarts.
    progress : callable, optional
        Called regularly with the completed fraction of the work. It may raise an exception to stop.

    Returns
    -------
    Optimum
        The best positions that were found, and their cost.

    Raises
    ------
    ParameterError
        If a parameter is out of range, or the robots do not fit.

    See Also
    --------
    compute_lower_bound : Bound how much lower the cost of any placement can be.
    CoverageCost : Evaluate a placement.

    Notes
    -----
    The coverage cost (22) has many local minima. Each restart first chooses from several hundred candidate
    positions, whose geodesic distances to the sites are known. It draws them at random by the seeding of
    k-means++ [1]_, applied to the k-median problem: with a probability proportional to the distance, rather
    than to its square. Then it improves them by Lloyd's iteration, and by interchange, which escapes most of
    the local minima. From the chosen positions, it descends the exact cost. The best of all restarts is not
    proven to be the global minimum. The more restarts agree on it, the more likely it is.

    If the free space has several components, the robots occupy the largest ones, to cover as much area as
    possible, and minimize the cost there. (The cost alone would be lowest with all robots in the smallest
    room.) Gaps that are narrower than a robot separate components; see `CoverageCost`. Components that are
    too small for a robot, or contain no site of the lattice, are ignored.

    References
    ----------
    .. [1] D. Arthur and S. Vassilvitskii, "k-means++: The advantages of careful seeding", Proceedings of the
       18th ACM-SIAM Symposium on Discrete Algorithms (SODA), 2007, pp. 1027-1035.

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
        positions=copy_read_only(best.positions[from_left_to_right]),
        mean_distance=best.mean_distance,
        value=best.value,
        uncovered_area=best.uncovered_area,
        costs=copy_read_only([outcome.mean_distance for outcome in outcomes]),
        costs_before_descent=copy_read_only([outcome.mean_distance_before_descent for outcome in outcomes]),
        restart=best_restart,
    )


class _Outcome(NamedTuple):
    """The outcome of a restart; see `Optimum`."""

    mean_distance_before_descent: float
    """Mean distance before the descent of the exact cost, m."""
    positions: FloatArray
    """(n, 2) Positions of the robots, m."""
    mean_distance: float
    """Mean geodesic distance from a site to the nearest robot, m."""
    value: float
    """Coverage cost (22), m³."""
    uncovered_area: float
    """Area of the components of the free space without a robot, m²."""


def _check_parameters(robots: int, restarts: int, seed: int, radius: float) -> None:
    """Raise ParameterError if a parameter of `find_optimum` is out of range."""
    require_number("robots", robots, 1, MAX_ROBOTS, whole=True)
    require_number("restarts", restarts, 1, MAX_RESTARTS, whole=True)
    require_whole_number("seed", seed, 0)
    TEAM_PARAMETERS["radius"].require("radius", radius)


def _get_rank(result: CoverageResult | _Outcome) -> tuple[float, float]:
    """Return the key by which results are compared: the uncovered area, then the mean distance."""
    return result.uncovered_area, result.mean_distance


class _SiteGroups(NamedTuple):
    """Groups of neighboring sites; each group has a row in the distance table."""

    representatives: IntArray
    """(t,) The site of each group from which distances are measured."""
    weights: FloatArray | IntArray
    """(t,) Sum of the weights of each group's sites; their number if all weights are equal."""


class _Search:
    """The search for the best positions, with the data that all restarts share.

    Attributes
    ----------
    cost : CoverageCost
        The cost to minimize.
    robot_count : int
        Number of robots.
    space : ConfigurationSpace
        The positions at which robots fit.
    candidates : (c, 2) array, m
        Candidate positions for robots, which are the sources of the table.
    candidate_components : (c,) int array
        Index of the component of the free space that contains each candidate.
    table : (t, c) array, m
        Distances from the groups of sites to the candidates, times the weights of the groups.
    """

    def __init__(self, cost: CoverageCost, robot_count: int) -> None:
        self.cost = cost
        self.robot_count = robot_count
        self.space = ConfigurationSpace(
            cost.environment.free, cost.radius, closed=cost.closed_environment.free
        )
        _, is_inside = cost.geodesics.snap_to_free_space(cost.points)
        # A site on the border of two components belongs to the first one.
        site_components = is_inside.argmax(axis=1)
        areas = self.space.components
        site_counts = np.bincount(site_components, minlength=len(areas))
        usable = [k for k, area in enumerate(areas) if not area.is_empty and site_counts[k]]
        if not usable:
            raise ParameterError(
                f"radius: no space for a robot of radius {cost.radius:g} m in map {cost.environment.name!r}"
            )
        # The components are sorted by area. The robots occupy the largest ones.
        covered = usable[:robot_count]
        candidates = self._spread_candidates(covered)
        candidate_counts = [len(points) for points in candidates]
        self.candidate_components = np.repeat(covered, candidate_counts).astype(np.intp)
        if len(self.candidate_components) < robot_count:
            capacity = len(self.candidate_components)
            raise ParameterError(
                f"robots: expected at most about {capacity}, as many as fit with radius {cost.radius:g} m in "
                f"map {cost.environment.name!r}, got {robot_count}"
            )
        self.candidates = np.concatenate(candidates)
        groups = self._group_sites(site_components, np.isin(site_components, covered))
        self.table = self._compute_table(groups)
        # Many restarts find the same sources. The descent from these is computed only once.
        self._outcome_by_sources: dict[tuple[int, ...], _Outcome] = {}

    def _spread_candidates(self, covered: list[int]) -> list[FloatArray]:
        """Return the candidate positions in each of the covered components, (c, 2) m each.

        There are fewer candidates than robots only if the robots do not fit.
        """
        areas = [self.space.components[k] for k in covered]
        total_area = sum(area.area for area in areas)
        min_candidates = max(_MIN_CANDIDATES, _CANDIDATES_PER_ROBOT * self.robot_count)
        # Each candidate gets a square of the same area, but robots at adjacent candidates must not overlap.
        spacing = max(math.sqrt(total_area / min_candidates), self.space.spacing)
        candidates = [_spread_points(area, spacing) for area in areas]
        if sum(len(points) for points in candidates) >= self.robot_count:
            return candidates
        # The team almost fills the free space: spread points, which form a square grid, are too few.
        packings = [pack_densely(area, self.space.spacing) for area in areas]
        return [max(pair, key=len) for pair in zip(candidates, packings, strict=True)]

    def run_restart(self, rng: np.random.Generator, heartbeat: Callable[[], None]) -> _Outcome:
        """Choose starting positions by the distance table, and descend the exact cost from there.

        Restarts that choose the same positions share one outcome.

        Parameters
        ----------
        rng : numpy.random.Generator
            Random number generator of this restart.
        heartbeat : callable
            Called regularly. It may raise an exception to stop the search.

        Returns
        -------
        _Outcome
        """
        sources = self._find_sources(rng, heartbeat)
        key = tuple(sources.tolist())
        if key not in self._outcome_by_sources:
            positions = self.candidates[sources]
            components = self.candidate_components[sources]
            result = descend(self.cost, self.space, positions, components, heartbeat)
            self._outcome_by_sources[key] = _Outcome(
                mean_distance_before_descent=self.cost(positions).mean_distance,
                positions=result.positions,
                mean_distance=result.mean_distance,
                value=result.value,
                uncovered_area=result.uncovered_area,
            )
        return self._outcome_by_sources[key]

    def _group_sites(self, site_components: IntArray, is_covered: BoolArray) -> _SiteGroups:
        """Group the covered sites: those of the same component in the same square block of lattice cells."""
        cost = self.cost
        block_side = max(1, math.ceil(math.sqrt(np.count_nonzero(is_covered) / _MAX_GROUPS)))
        rows, columns = np.divmod(cost.cells, cost.lattice)
        # The number of a group combines the numbers of its block and its component.
        blocks = rows // block_side * cost.lattice + columns // block_side
        groups = blocks * len(self.space.components) + site_components
        # A group is represented by the site nearest to the middle of its block. Ties, such as between all
        # cells of a two-by-two block, are broken at random.
        row_offsets = _compute_offsets(rows, block_side)
        column_offsets = _compute_offsets(columns, block_side)
        squared_offsets = row_offsets**2 + column_offsets**2
        tie_breakers = np.random.default_rng(0).random(len(groups))
        # Sort the covered sites by group (`lexsort` expects the most important key last). The first site of
        # each group is its representative.
        sites = np.flatnonzero(is_covered)
        sites = sites[np.lexsort((tie_breakers[sites], squared_offsets[sites], groups[sites]))]
        _, first_sites, site_counts = np.unique(groups[sites], return_index=True, return_counts=True)
        weights = site_counts
        if cost.weights is not None:
            weights = np.add.reduceat(cost.weights[sites], first_sites)
        return _SiteGroups(representatives=sites[first_sites], weights=weights)

    def _compute_table(self, groups: _SiteGroups) -> FloatArray:
        """Compute the table of weighted distances from the groups of sites to the candidates, (t, c) m."""
        cost = self.cost
        distances = cost.geodesics.compute_distances(self.candidates, cost.points[groups.representatives])
        distances[np.isinf(distances)] = _UNREACHABLE_SIZES * cost.geodesics.size
        return np.ascontiguousarray((distances * groups.weights).T)

    def _find_sources(self, rng: np.random.Generator, heartbeat: Callable[[], None]) -> IntArray:
        """Return the sources of the table that one restart finds, (n,), in ascending order.

        There are three stages. Each starts from the result of the previous one. Since the table only
        approximates the cost, a later stage may make the exact cost higher. The sources of the stage with the
        lowest exact cost are returned.
        """
        first_sources = seed_sources(self.table, self.robot_count, rng)
        lloyd_sources = run_lloyd(self.table, first_sources, heartbeat=heartbeat)
        swapped_sources = apply_best_swaps(self.table, lloyd_sources, heartbeat)
        stages = [np.sort(sources) for sources in (swapped_sources, lloyd_sources, first_sources)]
        return min(stages, key=lambda sources: _get_rank(self.cost(self.candidates[sources])))


def _compute_offsets(indices: IntArray, block_side: int) -> IntArray:
    """Return the offsets of rows, or of columns, from the middle of their blocks, in half cells.

    In half cells, the offsets are whole numbers, so that equal distances are exactly equal.
    """
    return 2 * (indices % block_side) - (block_side - 1)


def _spread_points(area: BaseGeometry, spacing: float) -> FloatArray:
    """Return points in an area, (p, 2), at least `spacing` apart, with no large gaps between them.

    Every third row and column of a fine grid form a coarse grid. The gaps between the coarse grid and the
    walls are filled by other points of the fine grid. On a map that is very large for `spacing`, all
    distances are larger, because the fine grid is limited to `_MAX_GRID_POINTS`.
    """
    low_x, low_y, high_x, high_y = area.bounds
    min_step = math.sqrt((high_x - low_x) * (high_y - low_y) / _MAX_GRID_POINTS)
    step = max(spacing / _STEPS_PER_SPACING, min_step)
    # Rows and columns of the fine grid are counted from the middle of the bounding box.
    max_column = int((high_x - low_x) / 2.0 / step)
    max_row = int((high_y - low_y) / 2.0 / step)
    row_grid, column_grid = np.mgrid[-max_row : max_row + 1, -max_column : max_column + 1]
    rows = row_grid.ravel()
    columns = column_grid.ravel()
    x = (low_x + high_x) / 2.0 + columns * step
    y = (low_y + high_y) / 2.0 + rows * step
    fine_points = np.column_stack([x, y])
    is_inside = shapely.contains_xy(area, x, y)
    is_on_coarse_grid = (rows % _STEPS_PER_SPACING == 0) & (columns % _STEPS_PER_SPACING == 0)
    coarse_points = fine_points[is_inside & is_on_coarse_grid]
    if len(coarse_points) == 0:
        # The area may be too narrow to contain a point of the coarse grid.
        point = area.representative_point()
        coarse_points = np.array([[point.x, point.y]])
    other_points = fine_points[is_inside & ~is_on_coarse_grid]
    return _fill_gaps(coarse_points, other_points, _STEPS_PER_SPACING * step)


def _fill_gaps(points: FloatArray, candidates: FloatArray, spacing: float) -> FloatArray:
    """Add candidates to points, (p, 2), as long as one is at least `spacing` away from all of them.

    Each time, the candidate that is farthest from the nearest point is added.
    """
    if len(candidates) == 0:
        return points
    distances = np.asarray(cKDTree(points).query(candidates)[0])
    farthest = int(distances.argmax())
    added = []
    while distances[farthest] >= spacing:
        added.append(candidates[farthest])
        offsets = candidates - candidates[farthest]
        distances = np.minimum(distances, compute_lengths(offsets))
        farthest = int(distances.argmax())
    return np.vstack([points, *added])
