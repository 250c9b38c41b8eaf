"""The coverage cost (22): the mean distance that the nearest robot must travel to reach a place."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import shapely

from robocov.arrays import Array, BoolArray, IntArray
from robocov.errors import InputError, ParameterError, shown
from robocov.geodesic import CORNER_BINS, Geodesics
from robocov.visibility import Fans

if TYPE_CHECKING:
    from robocov.environment import Environment

MAX_LATTICE = 4096
"""Finest lattice, in cells along a side."""

_PAIRS = 1 << 19
"""Pairs of sites and corners, or robots, looked at in one piece, which bounds the memory."""


@dataclass(frozen=True, eq=False)
class CoverageResult:
    """The coverage cost of one set of positions, and what it is made of.

    Attributes
    ----------
    mean_distance : float, m
        Mean geodesic distance of the sites to their nearest robot, over the components of the free
        space that hold robots; nan if these are too small to hold a site.
    value : float, m³
        Equation (22): `mean_distance` times the exact area of these components.
    uncovered_area : float, m²
        Area of the components without a robot.
    distances : (m,) m
        Geodesic distance to the nearest robot, inf where none can come.
    owner : (m,)
        The nearest robot (the geodesic Voronoi partition), -1 where none can come.
    first : (m, 2) m
        The first way-point from the owner to the site: a corner, or the site itself; nan where none can come.
    positions : (n, 2) m
    """

    mean_distance: float
    value: float
    uncovered_area: float
    distances: Array
    owner: IntArray
    first: Array
    positions: Array

    @cached_property
    def gradient(self) -> Array:
        """Derivative of `value` by the positions, (n, 2) m².

        Each site pulls its owner towards the first way-point, by a unit vector times the site's part of
        the area. Exact wherever `value` is differentiable with the owners and ways as they are.
        """
        count = len(self.positions)
        site = np.nonzero(self.owner >= 0)[0]
        owner = self.owner[site]
        toward = self.first[site] - self.positions[owner]
        length = np.hypot(toward[:, 0], toward[:, 1])
        toward /= np.where(length > 0.0, length, 1.0)[:, None]
        pull = [np.bincount(owner, toward[:, k], minlength=count) for k in (0, 1)]
        weight = self.value / (self.mean_distance * len(site)) if len(site) and self.mean_distance else 0.0
        return np.asarray(np.column_stack(pull) * -weight)


class CoverageCost:
    """The coverage cost (22) of one environment on a lattice of sites.

    The region's bounding box is widened to a square, anchored at its lower left corner, and cut into
    ``lattice``² square cells; the cell centres in the open free space are the sites. Distances are
    exact; only the mean over the sites is an approximation of the integral.

    Parameters
    ----------
    environment : Environment
    lattice : int
        Cells along a side.

    Attributes
    ----------
    points : (m, 2) m
        The sites, row by row from the lower left.
    cells : (m,)
        The sites' numbers among all cells, ``row * lattice + column``.
    spacing : float, m
        Side of a cell.
    geodesics : Geodesics

    Raises
    ------
    ParameterError
        When `lattice` is not a whole number from 1 to 4096, or so coarse that no site is free.

    Examples
    --------
    >>> from robocov.environment import Environment
    >>> cost = CoverageCost(Environment("square", ((0, 0), (1, 0), (1, 1), (0, 1))), lattice=64)
    >>> round(cost([[0.5, 0.5]]).mean_distance, 3)
    0.383
    """

    def __init__(self, environment: Environment, lattice: int = 64) -> None:
        whole = isinstance(lattice, (int, np.integer)) and not isinstance(lattice, bool)
        if not whole or not 1 <= lattice <= MAX_LATTICE:
            raise ParameterError(
                f"lattice: {shown(lattice)}, but a whole number from 1 to {MAX_LATTICE} was wanted"
            )
        self.lattice = int(lattice)
        self.geodesics = Geodesics(environment)
        self._areas = np.array([part.area for part in environment.free.geoms])
        self._lay()
        self._view()

    def _lay(self) -> None:
        """Find the sites and the component that holds each."""
        grid = self.geodesics.walls.grid
        self.spacing = self.geodesics.size / self.lattice
        middles = (np.arange(self.lattice) + 0.5) * self.spacing
        y, x = np.meshgrid(middles, middles, indexing="ij")
        points = np.column_stack([x.ravel(), y.ravel()]) + grid.origin
        snapped = grid.snap(points)
        component = np.full(len(points), -1, dtype=np.intp)
        for k, part in enumerate(self.geodesics.walls.free.geoms):
            component[shapely.contains_xy(part, snapped[:, 0], snapped[:, 1])] = k
        self.cells = np.nonzero(component >= 0)[0]
        if not len(self.cells):
            raise ParameterError(
                f"lattice: {self.lattice}, but none of its sites is free; a finer one was wanted"
            )
        self.points = points[self.cells]
        self.points.setflags(write=False)
        self._component = component[self.cells]
        self._x, self._y = np.ascontiguousarray(snapped[self.cells].T)

    def _view(self) -> None:
        """List for each site the useful corners in view: rows of site, corner and distance."""
        paths = self.geodesics
        count, sites = len(paths.corner_x), len(self.cells)
        rows = max(1, _PAIRS // sites)
        pieces = [(np.empty(0, np.int32), np.empty(0, np.int32))]
        for begin in range(0, count, rows):
            corner = np.arange(begin, min(begin + rows, count))
            fans = Fans(paths.walls, paths.corner_x[corner], paths.corner_y[corner], CORNER_BINS)
            row, site = np.nonzero(paths.walls.useful(corner[:, None], self._x, self._y))
            seen = fans.see(row, self._x[site], self._y[site])
            pieces.append((site[seen].astype(np.int32), corner[row[seen]].astype(np.int32)))
        site, corner = (np.concatenate([piece[k] for piece in pieces]) for k in (0, 1))
        order = np.argsort(site, kind="stable")
        self._list_corner = corner[order]
        site = site[order]
        self._list_length = np.hypot(
            paths.corner_x[self._list_corner] - self._x[site],
            paths.corner_y[self._list_corner] - self._y[site],
        )
        self._list_first = np.zeros(sites + 1, dtype=np.intp)
        np.cumsum(np.bincount(site, minlength=sites), out=self._list_first[1:])

    def __call__(self, positions: Array) -> CoverageResult:
        """Return the coverage cost of (n, 2) positions in metres.

        Raises
        ------
        InputError
            When there is no robot, or one is outside the free space; the message names it.
        """
        positions = np.array(positions, dtype=float)
        if not len(positions):
            raise InputError("positions: none, but at least one robot was wanted")
        robots = _Robots(self.geodesics, positions)
        corners = robots.to_corners()
        covered = np.asarray(robots.holds.any(axis=0))
        site = np.nonzero(covered[self._component])[0]
        x, y = self._x[site], self._y[site]

        owner, distance = robots.nearest(x, y)
        corner = np.full(len(site), -1, dtype=np.intp)
        hidden = np.nonzero(~robots.see(owner, x, y))[0]
        if len(hidden):
            least, way = self._by_corners(site[hidden], corners.distance)
            other, straight = robots.nearest_seen(x[hidden], y[hidden], least, owner[hidden])
            direct = straight < least
            distance[hidden] = np.minimum(straight, least)
            owner[hidden[direct]] = other[direct]
            by_way = hidden[~direct]
            corner[by_way], owner[by_way] = corners.first[way[~direct]], corners.owner[way[~direct]]
        return self._result(positions, covered, site, distance, owner, corner)

    def _by_corners(self, site: IntArray, distance: Array) -> tuple[Array, IntArray]:
        """Return the least distance of sites by way of a corner, and that corner."""
        first, last = self._list_first[site], self._list_first[site + 1]
        least, way = np.full(len(site), np.inf), np.full(len(site), -1, dtype=np.intp)
        some = np.nonzero(last > first)[0]
        if not len(some):
            return least, way
        count = (last - first)[some]
        begin = np.cumsum(count) - count
        entry = np.arange(begin[-1] + count[-1]) + np.repeat(first[some] - begin, count)
        corner = self._list_corner[entry]
        total = self._list_length[entry] + distance[corner]
        least[some] = np.minimum.reduceat(total, begin)
        hit = np.nonzero(total == np.repeat(least[some], count))[0][::-1]
        way[np.repeat(some, count)[hit]] = corner[hit]
        return least, way

    def _result(
        self,
        positions: Array,
        covered: BoolArray,
        site: IntArray,
        distance: Array,
        owner: IntArray,
        corner: IntArray,
    ) -> CoverageResult:
        paths = self.geodesics
        distances = np.full(len(self.points), np.inf)
        owners = np.full(len(self.points), -1, dtype=np.intp)
        first = np.full(self.points.shape, np.nan)
        distances[site] = distance * paths.walls.grid.unit
        owners[site] = owner
        first[site] = self.points[site]
        bent = np.nonzero(corner >= 0)[0]
        at = corner[bent]
        first[site[bent]] = paths.walls.grid.metres(np.column_stack([paths.corner_x[at], paths.corner_y[at]]))
        mean = float(distances[site].mean()) if len(site) else np.nan
        return CoverageResult(
            mean_distance=mean,
            value=mean * float(self._areas[covered].sum()),
            uncovered_area=float(self._areas[~covered].sum()),
            distances=distances,
            owner=owners,
            first=first,
            positions=positions,
        )

    def path(self, positions: Array, point: Array) -> Array:
        """Return the shortest path from a point to the nearest of (n, 2) robots, (w, 2) way-points in metres.

        Both ends are included; (0, 2) where no robot can come.

        Raises
        ------
        InputError
            When the point or a robot is outside the free space.
        """
        positions = np.asarray(positions, dtype=float)
        point = np.asarray(point, dtype=float)
        distances = self.geodesics.distances(point[None], positions)[0]
        return self.geodesics.path(point, positions[int(distances.argmin())])


@dataclass(frozen=True, slots=True, eq=False)
class _Corners:
    """For every corner the distance to the nearest robot, that robot, and the first corner on its way."""

    distance: Array
    owner: IntArray
    first: IntArray


class _Robots:
    """The robots of one evaluation, and what they see."""

    def __init__(self, paths: Geodesics, positions: Array) -> None:
        self._paths = paths
        self.x, self.y, self.holds = paths.place(positions)
        self._vertex = paths.walls.vertex_at(self.x, self.y)
        self._fans = Fans(paths.walls, self.x, self.y)

    def see(self, robot: IntArray, x: Array, y: Array) -> BoolArray:
        """Return for (m,) pairs of a robot and a target whether the robot sees the target."""
        return self._paths.see(self._fans, self._vertex, robot, x, y)

    def nearest(self, x: Array, y: Array) -> tuple[IntArray, Array]:
        """Return the robot nearest to each of (m,) targets as the crow flies, and its distance."""
        robot = np.empty(len(x), dtype=np.intp)
        rows = max(1, _PAIRS // len(self.x))
        for begin in range(0, len(x), rows):
            at = slice(begin, begin + rows)
            distance2 = (x[at, None] - self.x) ** 2 + (y[at, None] - self.y) ** 2
            robot[at] = distance2.argmin(axis=1)
        return robot, np.hypot(x - self.x[robot], y - self.y[robot])

    def nearest_seen(
        self, x: Array, y: Array, bound: Array, but: IntArray, *, corners: bool = False
    ) -> tuple[IntArray, Array]:
        """Return the nearest robot that sees each of (m,) targets from less than `bound`, and its distance.

        The robot `but` (m,) is left out. Where there is none the distance is inf. With `corners`, the targets
        are all corners, and the robot must be where a path round the corner can come from.
        """
        robot, least = np.zeros(len(x), dtype=np.intp), np.full(len(x), np.inf)
        number = np.arange(len(self.x))
        rows = max(1, _PAIRS // len(self.x))
        for begin in range(0, len(x), rows):
            at = slice(begin, begin + rows)
            distance = np.hypot(x[at, None] - self.x, y[at, None] - self.y)
            target, other = np.nonzero((distance < bound[at, None]) & (number != but[at, None]))
            distance = distance[target, other]
            target += begin
            if corners:
                good = self._paths.walls.useful(target, self.x[other], self.y[other])
                target, other, distance = target[good], other[good], distance[good]
            good = self.see(other, x[target], y[target])
            # the nearest, and of equals the first, is written last
            order = np.lexsort((other[good], distance[good]))[::-1]
            target, other, distance = target[good][order], other[good][order], distance[good][order]
            robot[target], least[target] = other, distance
        return robot, least

    def to_corners(self) -> _Corners:
        """Return the corners' distances: from the nearest robot, by the graph, then from the others."""
        paths = self._paths
        x, y = paths.corner_x, paths.corner_y
        owner, reach = self.nearest(x, y)
        good = paths.walls.useful(np.arange(len(x)), self.x[owner], self.y[owner]) & self.see(owner, x, y)
        reach[~good] = np.inf
        distance = paths.relax(reach)
        other, straight = self.nearest_seen(x, y, distance, owner, corners=True)
        nearer = straight < reach
        reach[nearer], owner[nearer] = straight[nearer], other[nearer]
        distance = paths.relax(np.minimum(distance, reach))
        before = paths.previous(distance, reach)
        first = np.where(before < 0, np.arange(len(before)), before)
        while (first != first[first]).any():
            first = first[first]
        return _Corners(distance, owner[first], first)
