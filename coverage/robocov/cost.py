"""The coverage cost (22): the mean distance that the nearest robot must travel to reach a place."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import shapely

from robocov.arrays import Array, BoolArray, IntArray, frozen
from robocov.clusters import Clusters, coherent_order
from robocov.errors import InputError, ParameterError, shown
from robocov.geodesic import Geodesics
from robocov.robot_views import RobotViews, first_of_least

if TYPE_CHECKING:
    from robocov.environment import Environment

MAX_LATTICE = 4096
"""Finest lattice, in cells along a side."""

_PAIRS = 1 << 16
"""Pairs of sites and corners looked at in one piece, which bounds the memory."""


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
    corner : (m,)
        The row in `corners` where the way from the owner to the site bends first, -1 where it is straight.
    positions : (n, 2) m
    points : (m, 2) m
        The sites.
    corners : (k, 2) m
        All places where ways can bend.
    """

    mean_distance: float
    value: float
    uncovered_area: float
    distances: Array
    owner: IntArray
    corner: IntArray
    positions: Array
    points: Array
    corners: Array

    @cached_property
    def first(self) -> Array:
        """The first way-point from the owner to the site, (m, 2) m: a corner, or the site itself."""
        first = self.points.copy()
        bent = np.nonzero(self.corner >= 0)[0]
        first[bent] = self.corners[self.corner[bent]]
        return first

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
        self.points = frozen(points[self.cells])
        self._corners = frozen(
            grid.metres(np.column_stack([self.geodesics.corner_x, self.geodesics.corner_y]))
        )
        row, column = np.divmod(self.cells, self.lattice)
        order = coherent_order(column, row)
        self._rank = np.empty_like(order)
        self._rank[order] = np.arange(len(order))
        self._component = component[self.cells[order]]
        self._x, self._y = np.ascontiguousarray(snapped[self.cells[order]].T)
        self._clusters = Clusters(self._x, self._y, leaf=16)

    def _view(self) -> None:
        """List for each site the useful corners in view: rows of site, corner and distance."""
        paths = self.geodesics
        count, sites = len(paths.corner_x), len(self.cells)
        rows = max(1, _PAIRS // sites)
        pieces = [(np.empty(0, np.int32), np.empty(0, np.int32))]
        for begin in range(0, count, rows):
            corner = np.arange(begin, min(begin + rows, count))
            row, site = np.nonzero(paths.walls.useful(corner[:, None], self._x, self._y))
            row += begin
            seen = paths.corner_fans.see(row, self._x[site], self._y[site])
            pieces.append((site[seen].astype(np.int32), row[seen].astype(np.int32)))
        site, corner = (np.concatenate([piece[k] for piece in pieces]) for k in (0, 1))
        order = np.argsort(site, kind="stable")
        self._list_corner = corner[order].astype(np.intp)
        site = site[order]
        self._list_length = np.hypot(
            paths.corner_x[self._list_corner] - self._x[site],
            paths.corner_y[self._list_corner] - self._y[site],
        )
        self._list_count = np.bincount(site, minlength=sites)
        self._list_first = np.cumsum(self._list_count) - self._list_count
        self._listed = np.nonzero(self._list_count)[0]

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
        paths = self.geodesics
        x, y, holds = paths.place(positions)
        covered = np.asarray(holds.any(axis=0))
        owner, distance2 = self._clusters.nearest(x, y)
        near, near2 = paths.corner_clusters.nearest(x, y)
        reach2 = np.zeros(len(x))
        np.maximum.at(reach2, owner, distance2)
        robots = RobotViews(paths, x, y, np.sqrt(reach2))

        corner = np.full(len(owner), -1, dtype=np.intp)
        distance = np.sqrt(distance2)
        seen = robots.see(owner, self._x, self._y)
        if not covered.all():
            away = ~covered[self._component]
            owner[away], distance[away], seen[away] = -1, np.inf, True
        hidden = np.nonzero(~seen)[0]
        if len(hidden):
            ways = robots.to_corners(near, np.sqrt(near2))
            least, way = self._by_corners(hidden, ways.distance)
            site, other, straight = self._clusters.within(x, y, np.where(seen, 0.0, least))
            pairs = other != owner[site]
            site, other, straight = site[pairs], other[pairs], straight[pairs]
            pairs = robots.see_beyond(other, self._x[site], self._y[site], straight)
            if len(ways.first):
                way = way[hidden]
                distance[hidden], corner[hidden], owner[hidden] = (
                    least[hidden],
                    ways.first[way],
                    ways.owner[way],
                )
            site, other, straight = first_of_least(site[pairs], other[pairs], straight[pairs])
            distance[site], corner[site], owner[site] = straight, -1, other
        return self._result(positions, covered, distance, owner, corner)

    def _by_corners(self, site: IntArray, distance: Array) -> tuple[Array, IntArray]:
        """Return the least distance of all sites by way of a corner, and that corner; of `site` at least."""
        least, way = np.full(len(self._x), np.inf), np.zeros(len(self._x), dtype=np.intp)
        corner, length = self._list_corner, self._list_length
        # to look at all is quicker than to pick more than half
        some = self._listed if len(site) > len(self._x) // 2 else site[self._list_count[site] > 0]
        count = self._list_count[some]
        begin = np.cumsum(count) - count
        if some is not self._listed:
            entry = np.arange(count.sum()) + np.repeat(self._list_first[some] - begin, count)
            corner, length = corner[entry], length[entry]
        if len(some):
            total = length + distance.take(corner)
            best = np.minimum.reduceat(total, begin)
            least[some] = best
            # of equals the first is written last
            hit = np.nonzero(total == np.repeat(best, count))[0][::-1]
            way[np.repeat(some, count)[hit]] = corner[hit]
        return least, way

    def _result(
        self, positions: Array, covered: BoolArray, distance: Array, owner: IntArray, corner: IntArray
    ) -> CoverageResult:
        """Put the sites, which are worked on group by group, back row by row."""
        paths = self.geodesics
        distances = distance[self._rank] * paths.walls.grid.unit
        owner = owner[self._rank]
        reached = distances if covered.all() else distances[owner >= 0]
        mean = float(reached.mean()) if len(reached) else np.nan
        return CoverageResult(
            mean_distance=mean,
            value=mean * float(self._areas[covered].sum()),
            uncovered_area=float(self._areas[~covered].sum()),
            distances=distances,
            owner=owner,
            corner=corner[self._rank],
            positions=positions,
            points=self.points,
            corners=self._corners,
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
