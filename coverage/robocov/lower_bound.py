"""A certified lower bound of the coverage cost: no placement of a team, whoever finds it, is better.

The cost (22) asks for the places p of n robots at which the sum over the sites c of w_c min_i d(c, p_i) is
least: a p-median with geodesic distances d. For any prices u_c of the sites it is at least

    sum_c w_c u_c - n max_p worth(p),    worth(p) = sum_c w_c max(0, u_c - d(c, p)),

as min_i d_i is at least u - sum_i max(0, u - d_i): the Lagrangian dual of the p-median (Cornuéjols, Fisher
and Nemhauser 1977; taken from what is generally known of the paper, not from its text). Prices that make this
large are found on a table of distances from some places, without any proof. How much a place can be worth is
then proved for all places, by branch and bound over triangles that cover them. On a triangle T of free space
d(c, .) is the least of the lengths of the shortest ways to c that pass the obstacles in one manner each. Such
a length is convex on T (the universal cover of the free space has no positive curvature; for simple polygons
Pollack, Sharir and Rote 1989), so nowhere below its tangent at a place q in T, whose slope is that of the
way's first segment. It begins at a corner v that q sees, if not at c. Hence d(c, p) is nowhere on T below the
least of the tangents of |p - v| + d(v, c) over these corners, and of |p - c| if q sees c. With these for the
distances the worth is convex in p, so it is largest at a vertex of T, and what that adds falls with the
square of the size of T.

The best placement may still cost more than the dual tells, as a robot cannot be in part at several places.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.optimize import Bounds, minimize

from robocov.arrays import Array, IntArray, freeze
from robocov.compiled import kernel
from robocov.cost import CoverageCost
from robocov.environment import GRID_M, Environment
from robocov.errors import ParameterError, require_number
from robocov.geodesic.angular_index import AngularWallIndex, add_walls, is_visible
from robocov.geodesic.corner_graph import find_visible_corners
from robocov.geodesic.geodesics import SOURCE_BINS
from robocov.geodesic.walls import Walls
from robocov.k_median import Beat
from robocov.team import DEFAULT_RADIUS

MIN_PRECISION = 1e-5
"""The best precision that may be asked for."""

_ROUGH = 0.02, 0.007  # parts of the cost over which the largest worth is smoothed at first,
_SMOOTHING = 0.0025  # and before the first proof; half of it before each next one
_SLACK = 0.3  # the proof may be off by this part of the smoothing
_STEPS = 100  # most steps of each search for prices
_PLACES, _PLACES_A_ROBOT = 500, 60  # at least about so many places are in the table
_SERVING = 4  # no price is above the distance to so many robots of the placement
_BLOCK = 256  # places whose distances are computed at once
_MOST_TRIANGLES = 1_000_000  # after these the largest bound counts, whatever it is
_EROSION = 0.98  # of the radius: before it moves walls, GEOS simplifies them, by up to 1 % of it
_ROUNDING = 1e-10  # of the map's size, for each robot and site: far more than all roundings together
_BUILT = 0.2  # part of the progress at which the search for prices begins


@dataclass(frozen=True, eq=False)
class LowerBound:
    """Certified lower bound of the coverage cost (22) of a team, beside the cost of one placement."""

    mean_distance: float  # m, as `CoverageResult` has it: no placement has a lower one
    value: float  # m³
    reached: float  # m, the mean distance of the placement that was given
    prices: Array  # (m,) m, of the sites; nan in components of the free space without a robot

    @property
    def gap(self) -> float:
        """Largest possible excess of the placement over the best one, as a part of its own cost."""
        return 1.0 - self.mean_distance / self.reached if self.reached else 0.0


def compute_lower_bound(
    environment: Environment,
    positions: Array,
    *,
    radius: float = DEFAULT_RADIUS,
    lattice: int = 64,
    precision: float = 0.001,
    progress: Callable[[float], None] | None = None,
) -> LowerBound:
    """Return a lower bound of the coverage cost of every placement of a team on a map that is known.

    It holds for as many robots as there are positions, (n, 2) m, anywhere in the free space where a disc of
    `radius` (m) fits, if only one of 1 µm. (A point may be where walls touch, in two rooms at once.) Where
    the free space has several components, it holds for all placements in those that hold the positions, and
    is of the cost of these. Whether the robots fit beside each other is not asked. Positions of a low cost,
    from `optimum`, make the interval small.

    `lattice` is that of `CoverageCost`. The search ends where the interval is no wider than `precision`, a
    part of the cost, or the bound about so much below the best that the dual can give. All roundings are
    covered by 1e-10 of the map's size for each robot and site. `progress` is called now and then with the
    part that is done, and may raise, to give up. A ParameterError tells what is out of range, or that there
    is no room; an InputError which position is not in the free space.

    >>> from robocov.environment import Environment
    >>> square = Environment("square", ((0, 0), (2, 0), (2, 2), (0, 2)))
    >>> bound = compute_lower_bound(square, [[1, 1]], lattice=16)
    >>> bound.gap < 0.001
    True
    """
    require_number("radius", radius, GRID_M, math.inf, "m")
    require_number("precision", precision, MIN_PRECISION, 1.0)
    tell = progress or (lambda part: None)
    cost = CoverageCost(environment, lattice, progress=lambda part: tell(_BUILT / 2.0 * part))
    dual = _Dual(cost, np.asarray(positions, dtype=float), radius)
    prices = dual.first_prices
    for rough in _ROUGH:
        prices = dual.raised(prices, rough, partial(tell, _BUILT))
    best, smoothing = -math.inf, _SMOOTHING
    rounds = max(1, math.ceil(math.log2(8.0 * smoothing / precision)))
    for k in range(rounds):
        beat = partial(tell, _BUILT + (1.0 - _BUILT) * k / rounds)
        prices = dual.raised(prices, smoothing, beat)
        bound, places = dual.proved(prices, _SLACK * smoothing, beat)
        if bound > best:
            best, best_prices = bound, prices
        if best >= (1.0 - precision) * dual.reached:
            break
        dual.add(places)
        smoothing /= 2.0
    tell(1.0)
    mean, everywhere = max(best, 0.0) / dual.total, np.full(len(cost.points), np.nan)
    everywhere[dual.sites] = best_prices
    mass = float(environment.free_masses[dual.covered].sum())
    return LowerBound(mean, mean * mass, dual.reached / dual.total, freeze(everywhere))


class _Known(NamedTuple):
    """Precomputed parts of a worth, grid steps."""

    walls: Walls
    sites: Array
    """(m, 2)"""
    weights: Array
    """(m,)"""
    from_corners: Array
    """(m, k) The distances of the sites from the corners."""


class _Work(NamedTuple):
    """Room for what is known of one triangle, grid steps."""

    near: IntArray
    """(k,) Corners in useful view of a place in the triangle,"""
    lengths: Array
    """(k,) and how far they are."""
    vertices: Array
    """(3, 2) Of the triangle, from the place in it."""
    least: Array
    """(3,) At least the distance of a site there,"""
    sums: Array
    """(3,) and at most the worth."""


@kernel
def _tangent(work: _Work, length: float, dx: float, dy: float, away: float) -> None:
    """Lower what is the least distance at the vertices by a way that begins along -(dx, dy)."""
    for k in range(3):
        slope = (dx * work.vertices[k, 0] + dy * work.vertices[k, 1]) / max(away, 1.0)
        work.least[k] = min(work.least[k], length + slope)


@kernel
def _bounds(
    known: _Known, index: AngularWallIndex, prices: Array, triangles: Array, places: Array, work: _Work,
    out: Array,
) -> int:  # fmt: skip
    """Write what a place in each triangle is worth, and any there at most; return -1 if there is no room."""
    corners, least = known.walls.corners, work.least
    for t in range(len(triangles)):
        x, y, r, worth = places[t, 0], places[t, 1], 0.0, 0.0
        if add_walls(known.walls, index, 0, x, y, np.inf, 0) < 0:
            return -1
        for k in range(3):
            work.vertices[k, 0], work.vertices[k, 1] = triangles[t, k, 0] - x, triangles[t, k, 1] - y
            r = max(r, np.hypot(work.vertices[k, 0], work.vertices[k, 1]))
            work.sums[k] = 0.0
        count = find_visible_corners(known.walls, index, 0, 0, work.near)
        for j in range(count):
            work.lengths[j] = np.hypot(x - corners[work.near[j], 0], y - corners[work.near[j], 1])
        for c in range(len(prices)):
            site_x, site_y, price = known.sites[c, 0], known.sites[c, 1], prices[c]
            away, distance = np.sqrt((x - site_x) * (x - site_x) + (y - site_y) * (y - site_y)), np.inf
            if away - r >= price:
                continue
            for k in range(3):
                least[k] = price
            if is_visible(known.walls, index, 0, site_x, site_y):
                distance = away
                _tangent(work, away, x - site_x, y - site_y, away)
            for j in range(count):
                corner = work.near[j]
                length = work.lengths[j] + known.from_corners[c, corner]
                distance = min(distance, length)
                if length - r < max(least[0], least[1], least[2]):
                    dx, dy = x - corners[corner, 0], y - corners[corner, 1]
                    _tangent(work, length, dx, dy, work.lengths[j])
            worth += known.weights[c] * max(price - distance, 0.0)
            for k in range(3):
                work.sums[k] += known.weights[c] * (price - least[k])
        out[0, t], out[1, t] = worth, max(work.sums[0], work.sums[1], work.sums[2])
    return 0


class _Table(NamedTuple):
    """Distances from places to the sites that may be worth something there."""

    first: IntArray
    """(p + 1,) The entries of a place are those from its own `first` up to the next."""
    site: NDArray[np.int32]
    distance: NDArray[np.float32]


@kernel
def _table_worths(table: _Table, prices: Array, weights: Array, out: Array) -> None:
    """Write what the places of the table are worth."""
    for p in range(len(out)):
        worth = 0.0
        for at in range(table.first[p], table.first[p + 1]):
            worth += weights[table.site[at]] * max(prices[table.site[at]] - table.distance[at], 0.0)
        out[p] = worth


@kernel
def _robots_paid(table: _Table, prices: Array, shares: Array, out: Array) -> None:
    """Add up the shares of a robot, at the places of the table, that each site pays for."""
    for p in range(len(shares)):
        if shares[p] > 1e-9:
            for at in range(table.first[p], table.first[p + 1]):
                if prices[table.site[at]] > table.distance[at]:
                    out[table.site[at]] += shares[p]


class _Dual:
    """The dual of one map and team; sums over the sites, by weight, where the cost is a mean."""

    def __init__(self, cost: CoverageCost, positions: Array, radius: float) -> None:
        self._geodesics = geodesics = cost.geodesics
        self._grid = geodesics.grid
        result = cost(positions)
        self.covered = geodesics.snap_to_free_space(positions)[1].any(axis=0)
        self.sites = np.flatnonzero(result.owner >= 0)
        weights = np.ones(len(cost.points)) if cost.weights is None else cost.weights
        weights, self._robots = weights[self.sites], len(positions)
        self.total = float(weights.sum())
        if not self.total > 0.0:
            raise ParameterError(f"lattice: {cost.lattice}, but no site that counts is where the robots are")
        self.reached = float(weights @ result.distances[self.sites])

        points, corners = cost.points[self.sites], geodesics.walls.corners
        sites, _ = geodesics.snap_to_free_space(points)
        from_corners = np.ascontiguousarray(geodesics.compute_grid_distances(corners, sites).T)
        self._known = _Known(geodesics.walls, sites, weights, from_corners)

        parts = np.array(cost.environment.free.geoms)[self.covered]
        # chords of the arcs around corners: the room is a little too large, never too small
        room = shapely.union_all(shapely.buffer(parts, -_EROSION * radius, quad_segs=2))
        if room.is_empty:
            raise ParameterError(f"radius: {radius:g} m, but no such robot fits where the positions are")
        triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(room))
        assert math.isclose(shapely.area(triangles).sum(), room.area, rel_tol=1e-9)
        self._triangles = self._grid.snap(shapely.get_coordinates(triangles).reshape(-1, 4, 2)[:, :3])

        robots, _ = geodesics.snap_to_free_space(positions)
        none = np.full((_SERVING, len(sites)), np.inf)
        reach = np.sort(
            np.concatenate([geodesics.compute_grid_distances(robots, sites) * self._grid.unit, none]), axis=0
        )
        self._caps = reach[_SERVING - 1]
        # the price of a site lies between its nearest robot and the next; if there is none, beyond all places
        beyond = reach[0] + reach[0].max()
        self.first_prices = np.where(np.isinf(reach[1]), beyond, (reach[0] + reach[1]) / 2.0)

        # one site of each square of some cells
        side = max(1, int(math.sqrt(len(sites) / max(_PLACES, _PLACES_A_ROBOT * len(robots)))))
        self._apart = side * cost.spacing / self._grid.unit
        inside = sites[shapely.intersects_xy(room, points[:, 0], points[:, 1])]
        self._table = _Table(np.zeros(1, np.int64), np.empty(0, np.int32), np.empty(0, np.float32))
        self.add(np.concatenate([robots, self._thinned(inside)]))

    def _thinned(self, places: Array) -> Array:
        """Return the first of (p, 2) places in each square of a grid."""
        _, first = np.unique(np.floor(places * 2.0 / self._apart), axis=0, return_index=True)
        return places[np.sort(first)]

    def add(self, places: Array) -> None:
        """Add (p, 2) places to the table."""
        table = [self._table]
        for begin in range(0, len(places), _BLOCK):
            block = places[begin : begin + _BLOCK]
            rows = self._geodesics.compute_grid_distances(block, self._known.sites) * self._grid.unit
            place, site = np.nonzero((rows < self._caps) & np.isfinite(rows))
            first = table[-1].first[-1] + np.cumsum(np.bincount(place, minlength=len(rows)))
            table.append(_Table(first, site.astype(np.int32), rows[place, site].astype(np.float32)))
        self._table = _Table(*map(np.concatenate, zip(*table, strict=True)))

    def _worths(self, prices: Array) -> Array:
        """Return what the places of the table are worth, (p,)."""
        worths = np.empty(len(self._table.first) - 1)
        _table_worths(self._table, prices, self._known.weights, worths)
        return worths

    def raised(self, prices: Array, part: float, beat: Beat) -> Array:
        """Return prices with which the dual on the table is higher, with its largest worth made smooth.

        In the place of the maximum stands s log sum exp(worth / s), with s a part of the cost of one robot.
        """
        weights, scale = self._known.weights, max(self.reached, 1e-9 * self.total * self._geodesics.size)
        smooth = part * scale / self._robots

        def less_the_dual(prices: Array) -> tuple[float, Array]:
            beat()
            worths = self._worths(prices)
            shares = np.exp((worths - worths.max()) / smooth)
            most = worths.max() + smooth * math.log(shares.sum())
            paid = np.zeros(len(prices))
            _robots_paid(self._table, prices, shares * (self._robots / shares.sum()), paid)
            dual = float(weights @ prices) - self._robots * most
            return -dual / scale, weights * (paid - 1.0) / scale

        how: Any = {"method": "L-BFGS-B", "bounds": Bounds(0.0, self._caps), "options": {"maxiter": _STEPS}}
        return np.asarray(minimize(less_the_dual, prices, jac=True, **how).x)

    def bounds(self, prices: Array, triangles: Array) -> tuple[Array, Array, Array]:
        """Return a place in each triangle, (t, 2), what it is worth, (t,), and any place there at most."""
        unit, k, out = self._grid.unit, len(self._geodesics.corners), np.empty((2, len(triangles)))
        places, _ = self._geodesics.snap_to_free_space(self._grid.to_metres(triangles.mean(axis=1)))
        work = _Work(np.empty(k, np.int64), np.empty(k), np.empty((3, 2)), np.empty(3), np.empty(3))
        steps = prices / unit

        def fill(index: AngularWallIndex, *_: object) -> int:
            return int(_bounds(self._known, index, steps, triangles, places, work, out))

        self._geodesics.run_with_index(1, SOURCE_BINS, fill)
        return places, *(out * unit)

    def proved(self, prices: Array, part: float, beat: Beat) -> tuple[float, Array]:
        """Return a lower bound of the cost, and places, (p, 2), that are worth more than all of the table.

        The bound is less than what it could be with these prices by at most a part of the cost.
        """
        slack, known = part * self.reached / self._robots, self._worths(prices).max()
        most, best, count, triangles = 0.0, 0.0, 0, self._triangles
        leaves, found = [], [np.empty((0, 3))]
        while len(triangles):
            beat()
            places, worth, bound = self.bounds(prices, triangles)
            best, count = max(best, float(worth.max())), count + len(triangles)
            found.append(np.column_stack([worth, places])[worth > known])
            shut = (bound <= best + slack) | (count >= _MOST_TRIANGLES)
            most = max(most, float(bound[shut].max(initial=0.0)))
            leaves.append(triangles[shut])
            triangles = _halves(triangles[~shut])
        # the next proof begins where this one ends
        self._triangles = np.concatenate(leaves)
        rounding = _ROUNDING * self._geodesics.size * self.total * self._robots
        bound_of_all = float(self._known.weights @ prices) - self._robots * most - rounding
        above = np.concatenate(found)
        return bound_of_all, self._thinned(above[np.argsort(-above[:, 0], kind="stable"), 1:])


def _halves(triangles: Array) -> Array:
    """Return the halves, (2t, 3, 2), of (t, 3, 2) triangles, cut through the middle of the longest edge."""
    edges = triangles - np.roll(triangles, -1, axis=1)
    longest = (edges * edges).sum(axis=2).argmax(axis=1)
    one, other, apex = (triangles[np.arange(len(triangles)), (longest + k) % 3] for k in range(3))
    middle = (one + other) / 2.0
    return np.concatenate([np.stack([one, middle, apex], axis=1), np.stack([middle, other, apex], axis=1)])
