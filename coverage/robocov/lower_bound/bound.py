"""The lower bound on the coverage cost: a search for prices and a proof; see `lower_bound`."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np
import shapely
from scipy.optimize import Bounds, minimize

from robocov.arrays import Array, BoolArray, IntArray, freeze
from robocov.cost import CoverageCost
from robocov.defaults import DEFAULT_RADIUS_M
from robocov.environment import GRID_M, Environment, compute_center_areas
from robocov.errors import ParameterError, require_number
from robocov.geodesic.angular_index import AngularWallIndex
from robocov.geodesic.geodesics import SOURCE_BINS, Geodesics
from robocov.lower_bound.price_table import PriceTable, add_paid_shares
from robocov.lower_bound.profit_bounds import (
    CENTER_PROFIT,
    PROFIT_BOUND,
    SiteData,
    TriangleScratch,
    bound_profits,
    halve_triangles,
)

MIN_PRECISION = 1e-5
"""The smallest precision that may be requested."""

_ROUGH_SMOOTHINGS = (0.02, 0.007)
"""Smoothing of the maximal profit in the first searches for prices, as fractions of the cost."""

_SMOOTHING = 0.0025
"""Smoothing before the first proof. It is halved before each later proof."""

_FINAL_SMOOTHING = 0.125
"""Smoothing of the last search for prices, as a fraction of the requested precision."""

_SLACK = 0.3
"""Tolerance of a proof, as a fraction of the smoothing."""

_MIN_SCALE = 1e-9
"""Smallest cost by which a search divides the dual, because the cost of a placement may be zero. It is a
fraction of the cost that would result if every site were as far away as the map is large."""

_MAX_ITERATIONS = 100
"""Maximum number of iterations of each search for prices."""

_MIN_CANDIDATES = 500
"""Approximate minimum number of positions in the table."""

_CANDIDATES_PER_ROBOT = 60
"""Approximate minimum number of positions in the table per robot."""

_MAX_PRICE_RANK = 4
"""The price of a site is at most its distance to the robot of this rank, here the fourth-nearest one."""

_CANDIDATES_PER_BLOCK = 256
"""Number of positions whose distances are computed at the same time, to limit memory."""

_MAX_TRIANGLES = 1_000_000
"""A proof ends after this number of triangles, with the bound that it has reached."""

_EROSION = 0.98
"""Fraction of the radius by which the free space is eroded.

Before GEOS offsets walls, it simplifies them by up to 1 % of the offset. Eroding by less ensures that no
possible position is lost.
"""

_ROUNDING = 1e-10
"""Allowance per robot and site, as a fraction of the map's size, far larger than all rounding errors."""

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
        Lower bound on the mean distance of any placement; see `CoverageResult`.
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
    >>> 0.0 < bound.gap < 0.02
    True
    """

    mean_distance: float
    value: float
    placement_mean_distance: float
    prices: Array

    @property
    def gap(self) -> float:
        """Largest possible excess cost of the placement over the best one, as a fraction of its own cost."""
        if self.placement_mean_distance == 0.0:
            return 0.0
        return 1.0 - self.mean_distance / self.placement_mean_distance


def compute_lower_bound(
    environment: Environment,
    positions: Array,
    *,
    radius: float = DEFAULT_RADIUS_M,
    lattice: int = 64,
    precision: float = 0.001,
    progress: Callable[[float], None] | None = None,
) -> LowerBound:
    """Compute a lower bound on the coverage cost of every placement of a team.

    The bound holds for as many robots as there are positions, anywhere in the free space where a disc of the
    given radius fits. If the free space has several components, it covers only those that contain positions:
    it bounds the cost of these components for all placements in them. Gaps that are narrower than a robot
    separate components; see `CoverageCost`. Robots may overlap each other.

    Parameters
    ----------
    environment : Environment
        The map.
    positions : (n, 2) array, m
        A placement of low cost, such as that of `find_optimum`. The lower its cost, the smaller the gap.
    radius : float, m
        Radius of the robots, at least 1 µm. A robot without extent could be in two rooms at once, at a point
        where their walls touch.
    lattice : int
        Number of cells along a side of the lattice; see `CoverageCost`.
    precision : float
        The search ends if the gap is at most this fraction of the cost, or if the bound is within about this
        fraction of the best one that the dual problem can give.
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
    The bound is lowered by 1e-10 of the map's size per robot and site, far more than all rounding errors.

    Examples
    --------
    >>> import robocov as rc
    >>> square = rc.Environment("square", ((0, 0), (2, 0), (2, 2), (0, 2)))
    >>> bound = rc.compute_lower_bound(square, [[1, 1]], lattice=16)
    >>> bound.gap < 0.001
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
    dual = _Dual.build(cost, np.asarray(positions, dtype=float), radius)
    best = _search_best_prices(dual, precision, report)
    report(1.0)
    mean_distance = max(best.bound, 0.0) / dual.total_weight
    all_prices = np.full(len(cost.points), np.nan)
    all_prices[dual.site_numbers] = best.prices
    mass = float(cost.closed_environment.free_masses[dual.is_covered].sum())
    return LowerBound(
        mean_distance=mean_distance,
        value=mean_distance * mass,
        placement_mean_distance=dual.placement_cost / dual.total_weight,
        prices=freeze(all_prices),
    )


class _Proof(NamedTuple):
    """The result of a branch and bound."""

    bound: float
    """Lower bound on the cost, as a weighted sum over the sites, m."""
    prices: Array
    """(m,) m, prices of the sites that prove the bound."""
    better_candidates: Array
    """(p, 2) grid steps, positions with a higher profit than any in the table."""


class _ProfitBounds(NamedTuple):
    """Profits in t triangles."""

    centers: Array
    """(t, 2) grid steps, a point of the free space in each triangle."""
    center_profits: Array
    """(t,) m, profits of these points."""
    bounds: Array
    """(t,) m, an upper bound on the profit of every point of each triangle."""


def _search_best_prices(dual: _Dual, precision: float, report: Callable[[float], None]) -> _Proof:
    """Alternate between searching for prices and proving bounds; return the best proof.

    A search maximizes the dual over a table of candidate positions. The dual is smoothed, because it has no
    gradient where two positions are equally profitable. A proof bounds the dual over all positions, and finds
    positions with a higher profit than any in the table. These are added to the table, and the smoothing is
    halved for the next round.

    `precision` is the relative gap between the bound and the cost of the placement at which the search ends.
    """
    prices = dual.initial_prices
    for smoothing in _ROUGH_SMOOTHINGS:
        prices = dual.improve_prices(prices, smoothing, partial(report, _PROGRESS_BEFORE_SEARCH))
    best: _Proof | None = None
    smoothing = _SMOOTHING
    # As many rounds as it takes to reach the final smoothing, if each one halves it.
    round_count = max(1, math.ceil(math.log2(smoothing / (_FINAL_SMOOTHING * precision))))
    for k in range(round_count):
        fraction = _PROGRESS_BEFORE_SEARCH + (1.0 - _PROGRESS_BEFORE_SEARCH) * k / round_count
        heartbeat = partial(report, fraction)
        prices = dual.improve_prices(prices, smoothing, heartbeat)
        proof = dual.prove(prices, _SLACK * smoothing, heartbeat)
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
    profit of a position is sum_c w_c max(0, u_c - d(c, p)). For any prices, the dual
    sum_c w_c u_c - n max_p profit(p) is a lower bound on the cost of every placement of n robots. The largest
    profit is searched on a table of candidate positions, and then bounded on triangles that cover all
    positions.

    Attributes
    ----------
    geodesics : Geodesics
        Distances on the map.
    robot_count : int
    is_covered : (c,) bool array
        Whether each component of the free space contains robots.
    site_numbers : (m,) int array
        The sites in these components, as indices into the points of the cost.
    site_data : SiteData
        The same sites for kernels.
    placement_cost : float, m
        Cost of the placement from which the dual was built.
    max_prices : (m,) array, m
        Largest prices of the searches, which limit the number of entries in the table.
    initial_prices : (m,) array, m
        Prices with which the search starts.
    candidate_spacing : float, grid steps
        Spacing of the candidates among the sites.
    triangles : (t, 3, 2) array, grid steps
        Triangles that cover all positions. A proof replaces them by those that it ends with.
    table : PriceTable
        Distances from the candidates to the sites.
    """

    geodesics: Geodesics
    robot_count: int
    is_covered: BoolArray
    site_numbers: IntArray
    site_data: SiteData
    placement_cost: float
    max_prices: Array
    initial_prices: Array
    candidate_spacing: float
    triangles: Array
    table: PriceTable

    @classmethod
    def build(cls, cost: CoverageCost, positions: Array, radius: float) -> _Dual:
        """Build the dual problem for a team with as many robots as a placement.

        The placement should have a low cost: the initial prices are derived from it, and its robots are among
        the first candidate positions. The dual covers the components of the free space that contain them.

        Parameters
        ----------
        cost : CoverageCost
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
        # `robots` are the positions in grid steps, (n, 2), and `is_inside`, (n, c), is true where a robot is
        # in a component.
        robots, is_inside = geodesics.snap_to_free_space(positions)
        is_covered = np.asarray(is_inside.any(axis=0))
        site_numbers = np.flatnonzero(result.owner >= 0)
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
            candidate_spacing=stride * cost.spacing / geodesics.grid.unit,
            triangles=geodesics.grid.snap(_triangulate(configuration_space)),
            table=PriceTable.build_empty(),
        )
        site_candidates = dual._choose_site_candidates(configuration_space, cost.points[site_numbers])
        dual.add_candidates(np.concatenate([robots, site_candidates]))
        return dual

    def _choose_site_candidates(self, configuration_space: shapely.Geometry, site_positions: Array) -> Array:
        """Return evenly spread sites where the center of a robot can be, (p, 2) grid steps.

        The positions of all sites, (m, 2), are in meters, like the configuration space.
        """
        x, y = site_positions.T
        is_candidate = shapely.intersects_xy(configuration_space, x, y)
        return self._thin_out(self.site_data.sites[is_candidate])

    @property
    def unit(self) -> float:
        """Length of a grid step, m."""
        return self.geodesics.grid.unit

    @property
    def weights(self) -> Array:
        """Weights of the sites, (m,)."""
        return self.site_data.weights

    @cached_property
    def total_weight(self) -> float:
        """Sum of the weights of the sites."""
        return float(self.weights.sum())

    def _thin_out(self, candidates: Array) -> Array:
        """Return the first position in each square of a grid with half the spacing `candidate_spacing`."""
        squares = np.floor(candidates / (self.candidate_spacing / 2.0))
        _, first = np.unique(squares, axis=0, return_index=True)
        in_original_order = np.sort(first)
        return candidates[in_original_order]

    def add_candidates(self, candidates: Array) -> None:
        """Add positions, (p, 2) grid steps, to the table."""
        for first in range(0, len(candidates), _CANDIDATES_PER_BLOCK):
            block = candidates[first : first + _CANDIDATES_PER_BLOCK]
            distances = self.geodesics.compute_grid_distances(block, self.site_data.sites) * self.unit
            self.table = self.table.append(distances, self.max_prices)

    def improve_prices(self, prices: Array, smoothing: float, heartbeat: Callable[[], None]) -> Array:
        """Search for prices, (m,) m, that increase the dual over the positions in the table.

        The dual is the sum of the weighted prices minus n times the maximum profit of a position. The maximum
        has no gradient, so that the search replaces it by the smooth function ``s log sum exp(profit / s)``.
        `smoothing` is s as a fraction of the cost per robot. The gradient of that function is the mean of the
        gradients of the profits, weighted by the shares exp(profit / s).
        """
        weights = self.weights
        scale = max(self.placement_cost, _MIN_SCALE * self.total_weight * self.geodesics.size)
        s = smoothing * scale / self.robot_count

        def compute_negative_dual(prices: Array) -> tuple[float, Array]:
            """Return minus the smoothed dual at given prices, and its gradient, both divided by `scale`.

            The smoothing s is that of `improve_prices`.
            """
            heartbeat()
            profits = self.table.compute_profits(prices, weights)
            # Subtracting the maximum prevents an overflow of the exponential function.
            max_profit = profits.max()
            shares = np.exp((profits - max_profit) / s)
            smooth_max = max_profit + s * math.log(shares.sum())
            dual = float(weights @ prices) - self.robot_count * smooth_max
            # In the gradient, the n robots are divided among the positions in proportion to the shares.
            # Raising the price of a site by 1 adds its weight to the dual once, and subtracts it once for
            # each robot that the site pays for, that is, each robot that is nearer than its price.
            robot_shares = shares * (self.robot_count / shares.sum())
            paid_shares = np.zeros(len(prices))
            add_paid_shares(self.table, prices, robot_shares, paid_shares)
            return -dual / scale, weights * (paid_shares - 1.0) / scale

        solution = minimize(
            compute_negative_dual,
            prices,
            jac=True,
            method="L-BFGS-B",
            bounds=Bounds(0.0, self.max_prices),
            options={"maxiter": _MAX_ITERATIONS},
        )
        return np.asarray(solution.x)

    def bound_triangle_profits(self, prices: Array, triangles: Array) -> _ProfitBounds:
        """Compute upper bounds on the profits of all points of triangles.

        Parameters
        ----------
        prices : (m,) array, m
        triangles : (t, 3, 2) array, grid steps

        Returns
        -------
        _ProfitBounds
        """
        # The centroid of a triangle may be outside the free space by rounding. The center is the point of the
        # free space that is nearest to it.
        centroids = self.geodesics.grid.to_meters(triangles.mean(axis=1))
        centers, _ = self.geodesics.snap_to_free_space(centroids)
        scratch = TriangleScratch.allocate(len(self.geodesics.corners))
        grid_prices = prices / self.unit

        def run_kernel(wall_index: AngularWallIndex) -> Array | None:
            """Return the profits and their bounds, (2, t); None if the wall index is too small."""
            profits = np.empty((2, len(triangles)))
            has_space = bound_profits(
                self.site_data, wall_index, grid_prices, triangles, centers, scratch, profits
            )
            return profits if has_space else None

        # The index of the walls around a center is enlarged until it is large enough.
        grid_profits = self.geodesics.run_with_index(
            source_count=1, bin_count=SOURCE_BINS, compute=run_kernel
        )
        profits = grid_profits * self.unit
        return _ProfitBounds(
            centers=centers, center_profits=profits[CENTER_PROFIT], bounds=profits[PROFIT_BOUND]
        )

    def prove(self, prices: Array, tolerance: float, heartbeat: Callable[[], None]) -> _Proof:
        """Prove a lower bound on the cost by branch and bound over triangles.

        The lower bound is the sum of the weighted prices minus n times an upper bound on the profit of any
        position. It falls short of the best one for these prices by at most `tolerance` times the cost of the
        placement, unless the limit `_MAX_TRIANGLES` is reached. A triangle is a leaf if no robot in it can
        earn much more than one at the best position found so far. All other triangles are halved.
        """
        # n times the slack is the allowed fraction of the cost.
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
        # The next proof starts with these triangles.
        self.triangles = np.concatenate(leaves)
        rounding_allowance = _ROUNDING * self.geodesics.size * self.total_weight * self.robot_count
        bound = float(self.weights @ prices) - self.robot_count * profit_bound - rounding_allowance
        # The highest profits come first, because `_thin_out` keeps the first candidate in each square.
        by_profit = np.argsort(-np.concatenate(better_profits), kind="stable")
        return _Proof(
            bound=bound,
            prices=prices,
            better_candidates=self._thin_out(np.concatenate(better_candidates)[by_profit]),
        )


def _build_site_data(cost: CoverageCost, site_numbers: IntArray) -> SiteData:
    """Return the data of the sites with the given numbers; raise ParameterError if none has a weight."""
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
    """Return the spacing of the candidates, in spacings of the sites, that leaves enough of them."""
    min_candidates = max(_MIN_CANDIDATES, _CANDIDATES_PER_ROBOT * robot_count)
    return max(1, int(math.sqrt(site_count / min_candidates)))


def _build_configuration_space(cost: CoverageCost, is_covered: BoolArray, radius: float) -> shapely.Geometry:
    """Return the region of the covered components in which the center of a robot may lie, in meters.

    The region may be slightly too large but is never too small, so the bound holds for every placement.
    """
    # With `quad_segs=2`, chords replace the arcs around corners. They pass closer to the corners, which makes
    # the area larger.
    areas = compute_center_areas(
        cost.environment.free, cost.closed_environment.free, _EROSION * radius, edges_per_quarter=2
    )
    area = shapely.union_all(areas[is_covered])
    if area.is_empty:
        raise ParameterError(
            f"radius: expected a disc that fits in the free space around the positions, got {radius:g} m"
        )
    return area


def _triangulate(area: shapely.Geometry) -> Array:
    """Return triangles that cover an area, (t, 3, 2) m."""
    triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(area))
    assert math.isclose(shapely.area(triangles).sum(), area.area, rel_tol=1e-9)
    rings = shapely.get_coordinates(triangles).reshape(-1, 4, 2)
    return np.asarray(rings[:, :3])


def _compute_initial_prices(geodesics: Geodesics, robots: Array, sites: Array) -> tuple[Array, Array]:
    """Return maximum and initial prices, (m,) m each, for robots and sites in grid steps.

    The maximum price of a site is its distance to the robot of rank `_MAX_PRICE_RANK`, and infinite if there
    are fewer robots.
    """
    distances = geodesics.compute_grid_distances(robots, sites) * geodesics.grid.unit
    # Infinitely distant robots are added, so that there is one of every rank.
    missing_distances = np.full((_MAX_PRICE_RANK, len(sites)), np.inf)
    distances = np.sort(np.concatenate([distances, missing_distances]), axis=0)
    nearest = distances[0]
    second = distances[1]
    # An initial price is halfway between the distances of the nearest robot and the next one. If there is
    # only one robot, it exceeds the distances of all sites.
    single_robot_prices = nearest + nearest.max()
    initial_prices = np.where(np.isinf(second), single_robot_prices, (nearest + second) / 2.0)
    return distances[_MAX_PRICE_RANK - 1], initial_prices
