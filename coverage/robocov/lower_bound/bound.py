"""The lower bound on the coverage cost: a search for prices and a proof; see `lower_bound`.

Equation numbers refer to Renzaglia and Martinelli, "Distributed Coverage Control for a Multi-Robot Team in a
Non-Convex Environment".
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np
import shapely
from scipy.optimize import Bounds, minimize

from robocov.arrays import copy_read_only
from robocov.cost import CoverageCost
from robocov.defaults import DEFAULT_RADIUS_M
from robocov.environment import GRID_M, Environment, compute_center_areas
from robocov.errors import InputError, ParameterError, require_number, to_floats
from robocov.geodesic.angular_index import AngularWallIndex
from robocov.geodesic.geodesics import SOURCE_BINS, Geodesics
from robocov.lower_bound.profit_bounds import (
    CENTER_PROFIT,
    PROFIT_BOUND,
    SiteData,
    TriangleScratch,
    bound_profits,
    halve_triangles,
)
from robocov.lower_bound.site_distances import SiteDistances
from robocov.typing import BoolArray, FloatArray, IntArray

MIN_PRECISION = 1e-5
"""The minimum precision that may be requested."""

_ROUGH_SMOOTHINGS = (0.02, 0.007)
"""Smoothing of the maximum profit in the first searches for prices, as fractions of the cost per robot."""

_FIRST_SMOOTHING = 0.0025
"""Smoothing in the search before the first proof, as a fraction of the cost per robot. It is halved before
each later proof."""

_MAX_FINAL_SMOOTHING = 0.25
"""The search ends at the latest when the smoothing is at most this fraction of the requested precision."""

_RELATIVE_TOLERANCE = 0.3
"""Tolerance of a proof, as a fraction of the smoothing."""

_MIN_SCALE = 1e-9
"""Minimum cost by which a search divides the dual, because the cost of a placement may be zero. It is a
fraction of the cost that would result if the distance of every site were the size of the map."""

_MAX_ITERATIONS = 100
"""Maximum number of iterations of each search for prices."""

_MIN_CANDIDATES = 500
"""Approximate minimum number of positions in the table."""

_CANDIDATES_PER_ROBOT = 60
"""Approximate minimum number of positions in the table per robot."""

_MAX_PRICE_RANK = 4
"""The price of a site is at most its distance from the robot of this rank, the fourth-nearest one."""

_CANDIDATES_PER_BLOCK = 256
"""Number of positions whose distances are computed at the same time, to limit memory."""

_MAX_TRIANGLES = 1_000_000
"""A proof ends after this number of triangles, with the bound that it has reached."""

_EROSION = 0.98
"""Distance by which the free space is eroded, as a fraction of the radius.

Before GEOS offsets walls, it simplifies them by up to 1% of the offset. Eroding by less ensures that no
possible position is lost.
"""

_ROUNDING_ALLOWANCE = 1e-10
"""Reduction of the bound that allows for rounding errors, per robot and site of weight 1, as a fraction of
the map's size. It is far larger than all rounding errors."""

_PROGRESS_BEFORE_TABLE = 0.1
"""Fraction of the work before the table of distances is built."""

_PROGRESS_BEFORE_SEARCH = 0.2
"""Fraction of the work before the search for prices starts."""


@dataclass(frozen=True, eq=False)
class LowerBound:
    """A certified lower bound on the coverage cost (22) of a team, and the cost of one placement.

    Attributes
    ----------
    mean_distance : float, m
        Lower bound on the mean distance (see `CoverageResult`) of any placement.
    value : float, m³
        Lower bound on the cost (22) of any placement.
    placement_mean_distance : float, m
        Mean distance of the placement that was passed to `compute_lower_bound`.
    prices : (m,) array, m
        Prices of the sites that prove the bound; nan in components of the free space without a robot.

    See Also
    --------
    compute_lower_bound : Compute the bound for a placement.

    Examples
    --------
    >>> import robocov as rc
    >>> square = rc.Environment("square", ((0, 0), (2, 0), (2, 2), (0, 2)))
    >>> bound = rc.compute_lower_bound(square, [[0.9, 1.0]], lattice=16, precision=0.01)
    >>> 0.0 < bound.max_saving < 0.02
    True
    """

    mean_distance: float
    value: float
    placement_mean_distance: float
    prices: FloatArray

    @property
    def max_saving(self) -> float:
        """Maximum fraction of the placement's cost that any other placement can save, 1 - J_bound / J."""
        if self.placement_mean_distance == 0.0:
            return 0.0
        return 1.0 - self.mean_distance / self.placement_mean_distance


def compute_lower_bound(
    environment: Environment,
    positions: FloatArray,
    *,
    radius: float = DEFAULT_RADIUS_M,
    lattice: int = 64,
    precision: float = 0.001,
    progress: Callable[[float], None] | None = None,
) -> LowerBound:
    """Compute a lower bound on the coverage cost of every placement of a team.

    The bound holds for every placement of as many robots as there are positions, anywhere in the free space
    where a disc of the given radius fits. The robots may overlap each other. If the free space has several
    components, the bound is on the cost of those that contain positions, and holds for placements in them.
    Gaps that are narrower than a robot separate components; see `CoverageCost`.

    Parameters
    ----------
    environment : Environment
        The map.
    positions : (n, 2) array, m
        A placement of low cost, such as that of `find_optimum`. The lower its cost, the smaller the gap.
    radius : float, m
        Radius of the robots, at least 1 µm. (If it were 0, a robot at a point where two rooms touch could be
        in both rooms at once.)
    lattice : int
        Number of cells along a side of the lattice; see `CoverageCost`.
    precision : float
        The search ends when the gap is at most this fraction of the cost of the placement, or when the bound
        is within about this fraction of the best bound that the method can give.
    progress : callable, optional
        Called regularly with the completed fraction of the work. It may raise an exception to stop.

    Returns
    -------
    LowerBound

    Raises
    ------
    ParameterError
        If a parameter is out of range, or no robot of this radius fits in the components that contain
        positions.
    InputError
        If a position is outside the free space; the message names it.

    See Also
    --------
    find_optimum : Find a placement of low cost.

    Notes
    -----
    To allow for rounding errors, the bound is lowered by 1e-10 of the map's size per robot and site, which is
    far more than all of them.

    Examples
    --------
    >>> import robocov as rc
    >>> square = rc.Environment("square", ((0, 0), (2, 0), (2, 2), (0, 2)))
    >>> bound = rc.compute_lower_bound(square, [[1, 1]], lattice=16)
    >>> bound.max_saving < 0.001
    True
    """
    require_number("radius", radius, GRID_M, math.inf, "m")
    require_number("precision", precision, MIN_PRECISION, 1.0)
    report = progress or (lambda fraction: None)
    cost = CoverageCost(
        environment,
        lattice,
        radius=radius,
        progress=lambda fraction: report(_PROGRESS_BEFORE_TABLE * fraction),
    )
    checked_positions = to_floats("positions", positions, "[x, y] of each robot in meters", InputError)
    dual = _Dual.build(cost, checked_positions, radius)
    proof = _search_best_proof(dual, precision, report)
    report(1.0)
    mean_distance = max(proof.bound, 0.0) / dual.total_weight
    all_prices = np.full(len(cost.points), np.nan)
    all_prices[dual.site_numbers] = proof.prices
    mass = float(cost.closed_environment.free_masses[dual.is_covered].sum())
    return LowerBound(
        mean_distance=mean_distance,
        value=mean_distance * mass,
        placement_mean_distance=dual.placement_cost / dual.total_weight,
        prices=copy_read_only(all_prices),
    )


class _Proof(NamedTuple):
    """A lower bound that was proved for some prices by branch and bound."""

    bound: float
    """Lower bound on the cost, as a weighted sum over the sites, m."""
    prices: FloatArray
    """(m,) Prices of the sites that prove the bound, in meters."""
    better_candidates: FloatArray
    """(p, 2) Positions with a higher profit than any position in the table, grid steps."""


class _ProfitBounds(NamedTuple):
    """Profits in t triangles."""

    centers: FloatArray
    """(t, 2) A point of the free space in each triangle, grid steps."""
    center_profits: FloatArray
    """(t,) Profits of these points, m."""
    bounds: FloatArray
    """(t,) An upper bound on the profit of every point of each triangle, m."""


def _search_best_proof(dual: _Dual, precision: float, report: Callable[[float], None]) -> _Proof:
    """Alternate between searching for prices and proving bounds; return the proof of the highest bound.

    A search finds prices that maximize the dual if only the positions in a table are possible. The maximum
    profit is smoothed, because it has no gradient where two positions are equally profitable. A proof then
    bounds the dual for these prices and all positions. It also finds positions with a higher profit than any
    in the table. They are added to the table, and the smoothing is halved for the next round.

    The search ends when the gap between the bound and the cost of the placement is at most `precision`, as a
    fraction of that cost.
    """
    prices = dual.initial_prices
    for smoothing in _ROUGH_SMOOTHINGS:
        prices = dual.improve_prices(prices, smoothing, partial(report, _PROGRESS_BEFORE_SEARCH))
    best: _Proof | None = None
    smoothing = _FIRST_SMOOTHING
    # The smoothing is halved after each round, until it is at most the final one.
    halving_count = math.ceil(math.log2(smoothing / (_MAX_FINAL_SMOOTHING * precision)))
    round_count = 1 + max(0, halving_count)
    for k in range(round_count):
        fraction = _PROGRESS_BEFORE_SEARCH + (1.0 - _PROGRESS_BEFORE_SEARCH) * k / round_count
        heartbeat = partial(report, fraction)
        prices = dual.improve_prices(prices, smoothing, heartbeat)
        proof = dual.prove(prices, _RELATIVE_TOLERANCE * smoothing, heartbeat)
        if best is None or proof.bound > best.bound:
            best = proof
        if best.bound >= (1.0 - precision) * dual.placement_cost:
            break
        dual.add_candidates(proof.better_candidates)
        smoothing /= 2.0
    assert best is not None
    return best


@dataclass(eq=False)
class _Dual:
    """The dual problem of one map and team. Costs are weighted sums over the sites, not means.

    Each site c of weight w_c offers a robot at position p its price u_c minus the distance d(c, p). The
    profit of a position is sum_c w_c max(0, u_c - d(c, p)). For any prices, the dual sum_c w_c u_c - n max_p
    profit(p) is a lower bound on the cost of every placement of n robots. During the search for prices, the
    maximum profit is taken over a table of candidate positions. In a proof, it is bounded on triangles that
    cover all possible positions.

    Attributes
    ----------
    geodesics : Geodesics
        The shortest paths of the map.
    robot_count : int
        Number of robots, n.
    is_covered : (c,) bool array
        Whether each component of the free space contains robots.
    site_numbers : (m,) int array
        The sites in these components, as rows of `CoverageCost.points`.
    site_data : SiteData
        Data of these sites for kernels.
    placement_cost : float, m
        Cost of the placement from which the dual was built.
    max_prices : (m,) array, m
        Maximum price of each site in a search. It limits the number of entries in the table.
    initial_prices : (m,) array, m
        Prices with which the first search starts.
    candidate_spacing : float, grid steps
        Approximate spacing of the candidate positions.
    triangles : (t, 3, 2) array, grid steps
        Triangles that cover all possible positions. A proof replaces them by smaller ones.
    table : SiteDistances
        Distances from the candidate positions to the sites.
    """

    geodesics: Geodesics
    robot_count: int
    is_covered: BoolArray
    site_numbers: IntArray
    site_data: SiteData
    placement_cost: float
    max_prices: FloatArray
    initial_prices: FloatArray
    candidate_spacing: float
    triangles: FloatArray
    table: SiteDistances

    @classmethod
    def build(cls, cost: CoverageCost, positions: FloatArray, radius: float) -> _Dual:
        """Build the dual problem for a team with as many robots as a placement.

        The placement should have a low cost, because the initial prices are derived from it, and its
        positions are among the first candidate positions. The dual is limited to the components of the free
        space that contain these positions.

        Parameters
        ----------
        cost : CoverageCost
            The coverage cost of the map.
        positions : (n, 2) array, m
            The placement.
        radius : float, m
            Radius of the robots.

        Returns
        -------
        _Dual
        """
        geodesics = cost.geodesics
        result = cost(positions)
        # `robots` are the positions in grid steps, (n, 2), and `is_inside`, (n, c), says in which components
        # each robot is.
        robots, is_inside = geodesics.snap_to_free_space(positions)
        is_covered = np.asarray(is_inside.any(axis=0))
        site_numbers = np.flatnonzero(result.owners >= 0)
        site_data = _build_site_data(cost, site_numbers)
        configuration_space = _build_configuration_space(cost, is_covered, radius)
        max_prices, initial_prices = _compute_initial_prices(geodesics, robots, site_data.sites)
        stride = _choose_candidate_stride(len(site_numbers), len(positions))
        dual = cls(
            geodesics=geodesics,
            robot_count=len(positions),
            is_covered=is_covered,
            site_numbers=site_numbers,
            site_data=site_data,
            placement_cost=float(site_data.weights @ result.distances[site_numbers]),
            max_prices=max_prices,
            initial_prices=initial_prices,
            candidate_spacing=stride * cost.spacing / geodesics.grid.spacing,
            triangles=geodesics.grid.snap(_triangulate(configuration_space)),
            table=SiteDistances.build_empty(),
        )
        site_candidates = dual._choose_site_candidates(configuration_space, cost.points[site_numbers])
        dual.add_candidates(np.concatenate([robots, site_candidates]))
        return dual

    def _choose_site_candidates(
        self, configuration_space: shapely.Geometry, site_positions: FloatArray
    ) -> FloatArray:
        """Return evenly spread sites at which the center of a robot can be, (p, 2) grid steps.

        `site_positions` are the positions of all sites, (m, 2), in meters like the configuration space.
        """
        x, y = site_positions.T
        is_candidate = shapely.intersects_xy(configuration_space, x, y)
        return self._thin_out(self.site_data.sites[is_candidate])

    @property
    def grid_spacing(self) -> float:
        """Length of a grid step, m."""
        return self.geodesics.grid.spacing

    @property
    def weights(self) -> FloatArray:
        """Weights of the sites, (m,)."""
        return self.site_data.weights

    @cached_property
    def total_weight(self) -> float:
        """Sum of the weights of the sites."""
        return float(self.weights.sum())

    def _thin_out(self, candidates: FloatArray) -> FloatArray:
        """Return the first candidate in each square of a grid with half the candidate spacing."""
        squares = np.floor(candidates / (self.candidate_spacing / 2.0))
        _, first = np.unique(squares, axis=0, return_index=True)
        in_original_order = np.sort(first)
        return candidates[in_original_order]

    def add_candidates(self, candidates: FloatArray) -> None:
        """Add candidate positions, (p, 2) grid steps, to the table."""
        for first in range(0, len(candidates), _CANDIDATES_PER_BLOCK):
            block = candidates[first : first + _CANDIDATES_PER_BLOCK]
            distances = self.geodesics.compute_grid_distances(block, self.site_data.sites) * self.grid_spacing
            self.table = self.table.with_positions(distances, self.max_prices)

    def improve_prices(
        self, prices: FloatArray, smoothing: float, heartbeat: Callable[[], None]
    ) -> FloatArray:
        """Search for prices, (m,) in meters, that maximize the dual over the positions in the table.

        The dual is the sum of the weighted prices minus n times the maximum profit of a position. The maximum
        has no gradient where several positions are equally profitable. The search therefore replaces it by
        the smooth function ``s log sum exp(profit / s)``, where `smoothing` is s as a fraction of the cost
        per robot. The gradient of this function is the mean of the gradients of the profits, weighted by
        ``exp(profit / s)``.
        """
        weights = self.weights
        scale = max(self.placement_cost, _MIN_SCALE * self.total_weight * self.geodesics.size)
        s = smoothing * scale / self.robot_count

        def compute_negative_dual(trial_prices: FloatArray) -> tuple[float, FloatArray]:
            """Return minus the smoothed dual for given prices, and its gradient, both divided by `scale`."""
            heartbeat()
            profits = self.table.compute_profits(trial_prices, weights)
            # Subtracting the maximum prevents an overflow of the exponential function.
            max_profit = profits.max()
            shares = np.exp((profits - max_profit) / s)
            smooth_max = max_profit + s * math.log(shares.sum())
            dual = float(weights @ trial_prices) - self.robot_count * smooth_max
            # The n robots are divided among the positions in proportion to their shares. A site pays for the
            # robots that are nearer to it than its price. The derivative of the dual with respect to this
            # price is the weight of the site times one minus the number of robots that it pays for.
            robot_counts = shares * (self.robot_count / shares.sum())
            paid_robot_counts = self.table.count_paid_robots(trial_prices, robot_counts)
            return -dual / scale, weights * (paid_robot_counts - 1.0) / scale

        solution = minimize(
            compute_negative_dual,
            prices,
            jac=True,
            method="L-BFGS-B",
            bounds=Bounds(0.0, self.max_prices),
            options={"maxiter": _MAX_ITERATIONS},
        )
        return np.asarray(solution.x)

    def bound_triangle_profits(self, prices: FloatArray, triangles: FloatArray) -> _ProfitBounds:
        """Compute an upper bound on the profit of all points of each of several triangles.

        Parameters
        ----------
        prices : (m,) array, m
            Prices of the sites.
        triangles : (t, 3, 2) array, grid steps
            Vertices of the triangles.

        Returns
        -------
        _ProfitBounds
        """
        # The centroid of a triangle may be slightly outside the free space due to rounding. The nearest point
        # of the free space is used instead.
        centroids = self.geodesics.grid.to_meters(triangles.mean(axis=1))
        centers, _ = self.geodesics.snap_to_free_space(centroids)
        scratch = TriangleScratch.allocate(len(self.geodesics.corners))
        grid_prices = prices / self.grid_spacing

        def run_kernel(wall_index: AngularWallIndex) -> FloatArray | None:
            """Return the profits and their bounds, (2, t); None if the wall index is too small."""
            profits = np.empty((2, len(triangles)))
            has_space = bound_profits(
                self.site_data, wall_index, grid_prices, triangles, centers, scratch, profits
            )
            return profits if has_space else None

        grid_profits = self.geodesics.run_with_index(
            source_count=1, bin_count=SOURCE_BINS, compute=run_kernel
        )
        profits = grid_profits * self.grid_spacing
        return _ProfitBounds(
            centers=centers, center_profits=profits[CENTER_PROFIT], bounds=profits[PROFIT_BOUND]
        )

    def prove(self, prices: FloatArray, tolerance: float, heartbeat: Callable[[], None]) -> _Proof:
        """Prove a lower bound on the cost by branch and bound over triangles.

        The lower bound is the sum of the weighted prices minus n times an upper bound on the profit of any
        position. It is lower than the best bound for these prices by at most `tolerance` times the cost of
        the placement, unless the limit `_MAX_TRIANGLES` is reached. A triangle is a leaf if the profit of no
        position in it can be much higher than the highest profit found so far. All other triangles are
        halved.
        """
        # A profit that is too high by this slack lowers the bound by n times as much.
        slack = tolerance * self.placement_cost / self.robot_count
        best_table_profit = self.table.compute_profits(prices, self.weights).max()
        profit_bound = 0.0
        best_profit = 0.0
        triangle_count = 0
        triangles = self.triangles
        leaves = []
        better_candidates = [np.empty((0, 2))]
        better_profits = [np.empty(0)]
        while len(triangles):
            heartbeat()
            centers, center_profits, bounds = self.bound_triangle_profits(prices, triangles)
            best_profit = max(best_profit, float(center_profits.max()))
            triangle_count += len(triangles)
            is_better = center_profits > best_table_profit
            better_candidates.append(centers[is_better])
            better_profits.append(center_profits[is_better])
            is_leaf = (bounds <= best_profit + slack) | (triangle_count >= _MAX_TRIANGLES)
            profit_bound = max(profit_bound, float(bounds[is_leaf].max(initial=0.0)))
            leaves.append(triangles[is_leaf])
            triangles = halve_triangles(triangles[~is_leaf])
        # The prices of the next proof are similar, so it starts with these triangles.
        self.triangles = np.concatenate(leaves)
        rounding_allowance = _ROUNDING_ALLOWANCE * self.geodesics.size * self.total_weight * self.robot_count
        bound = float(self.weights @ prices) - self.robot_count * profit_bound - rounding_allowance
        # The highest profits come first, because `_thin_out` keeps the first candidate in each square.
        by_profit = np.argsort(-np.concatenate(better_profits), kind="stable")
        return _Proof(
            bound=bound,
            prices=prices,
            better_candidates=self._thin_out(np.concatenate(better_candidates)[by_profit]),
        )


def _build_site_data(cost: CoverageCost, site_numbers: IntArray) -> SiteData:
    """Return the data of the sites with the given numbers; raise ParameterError if all weights are 0."""
    geodesics = cost.geodesics
    weights = np.ones(len(cost.points)) if cost.weights is None else cost.weights
    weights = weights[site_numbers]
    if not weights.sum() > 0.0:
        raise ParameterError(
            f"lattice: expected sites with a weight above 0 in the components that contain robots, got "
            f"none with {cost.lattice} cells along a side"
        )
    sites, _ = geodesics.snap_to_free_space(cost.points[site_numbers])
    from_corners = geodesics.compute_grid_distances(geodesics.walls.corners, sites)
    return SiteData(
        walls=geodesics.walls,
        sites=sites,
        weights=weights,
        from_corners=np.ascontiguousarray(from_corners.T),
    )


def _choose_candidate_stride(site_count: int, robot_count: int) -> int:
    """Return the spacing of the candidates, in cells of the lattice, with which there are enough of them."""
    min_candidates = max(_MIN_CANDIDATES, _CANDIDATES_PER_ROBOT * robot_count)
    return max(1, int(math.sqrt(site_count / min_candidates)))


def _build_configuration_space(cost: CoverageCost, is_covered: BoolArray, radius: float) -> shapely.Geometry:
    """Return the area of the covered components in which the center of a robot may lie, in meters.

    The area may be slightly too large, but is never too small, so that the bound holds for every placement.
    """
    # Two chords replace each quarter circle around a corner. They are closer to the corner than the circle,
    # which makes the area larger.
    areas = compute_center_areas(
        cost.environment.free, cost.closed_environment.free, _EROSION * radius, edges_per_quarter=2
    )
    area = shapely.union_all(areas[is_covered])
    if area.is_empty:
        raise ParameterError(
            f"radius: expected a disc that fits in the free space around the positions, got {radius:g} m"
        )
    return area


def _triangulate(area: shapely.Geometry) -> FloatArray:
    """Return triangles that cover an area, (t, 3, 2), in meters."""
    triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(area))
    assert math.isclose(shapely.area(triangles).sum(), area.area, rel_tol=1e-9)
    rings = shapely.get_coordinates(triangles).reshape(-1, 4, 2)
    return np.asarray(rings[:, :3])


def _compute_initial_prices(
    geodesics: Geodesics, robots: FloatArray, sites: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the maximum and the initial prices of the sites, (m,) in meters each.

    The positions of the n robots and the m sites are in grid steps. The maximum price of a site is its
    distance from the robot of rank `_MAX_PRICE_RANK`; it is infinite if there are fewer robots.
    """
    distances = geodesics.compute_grid_distances(robots, sites) * geodesics.grid.spacing
    # Robots at an infinite distance are added, so that there is one of every rank.
    missing_distances = np.full((_MAX_PRICE_RANK, len(sites)), np.inf)
    distances = np.sort(np.concatenate([distances, missing_distances]), axis=0)
    nearest = distances[0]
    second = distances[1]
    # An initial price is halfway between the distances of the nearest and the second-nearest robot. If only
    # one robot can reach a site, the price is larger than the distance of every site from its nearest robot.
    single_robot_prices = nearest + nearest.max()
    initial_prices = np.where(np.isinf(second), single_robot_prices, (nearest + second) / 2.0)
    return distances[_MAX_PRICE_RANK - 1], initial_prices
