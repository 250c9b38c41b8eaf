"""The coverage cost (22): the mean distance that the nearest robot must travel to reach a place."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from robocov.arrays import Array, BoolArray, IntArray, frozen
from robocov.arrays.grouping import weighted_mean
from robocov.cost.arrivals import Ways, checked_speeds, first_there
from robocov.cost.lattice import Lattice, Number, Sites
from robocov.cost.site_paths import CornerViews, looked_for, site_paths
from robocov.density.masses import means_over_squares
from robocov.drawing import Drawable
from robocov.errors import InputError, checked, counted
from robocov.geodesic import Geodesics
from robocov.geodesic.corners import columns

if TYPE_CHECKING:
    from collections.abc import Callable

    from robocov.environment import Environment

MAX_LATTICE = 4096
"""Finest lattice, in cells along a side."""

_BLOCK = 64
"""Corners that look at the sites between two words of progress."""


@dataclass(frozen=True, eq=False)
class CoverageResult(Drawable):
    """The coverage cost of one set of positions, and what it is made of.

    Attributes
    ----------
    mean_distance : float, m
        Mean geodesic distance of the sites to their nearest robot, over the components of the free
        space that hold robots, each site weighed by φ; nan if these are too small to hold a site.
    value : float, m³
        Equation (22), with φ as in (4): `mean_distance` times the exact integral of φ over these
        components, which is their area where there is no density. With `speeds` it is m² s, `mean_time` times
        that integral.
    uncovered_area : float, m²
        Area of the components without a robot.
    distances : (m,) m
        Geodesic distance to the nearest robot, or with `speeds` to the one that is there first; inf where
        none can come.
    owner : (m,)
        That robot (the geodesic Voronoi partition), -1 where none can come.
    corner : (m,)
        The row in `corners` where the way from the owner to the site bends first, -1 where it is straight.
    last_corner : (m,)
        The row where it bends last, -1 where it is straight.
    positions : (n, 2) m
    points : (m, 2) m
        The sites.
    corners : (k, 2) m
        All places where ways can bend.
    environment : Environment or None
        The map, and
    sites : Sites or None
        its lattice, for plots.
    weights : (m,) or None
        The mean of φ over the cell of each site; None where every place counts the same.
    speeds : (n,) m/s or None
        How fast each robot goes, if not the nearest robot counts but the one that is there first.
    mean_time : float, s, or None
        Mean time, with `speeds`, until the first robot is at a site.
    """

    _drawn_as = "result"

    mean_distance: float
    value: float
    uncovered_area: float
    distances: Array
    owner: IntArray
    corner: IntArray
    last_corner: IntArray
    positions: Array
    points: Array
    corners: Array
    environment: Environment | None = None
    sites: Sites | None = None
    weights: Array | None = None
    speeds: Array | None = None
    mean_time: float | None = None

    def __repr__(self) -> str:
        robots = counted(len(self.positions), "robot")
        uncovered = f", {self.uncovered_area:.3f} m² uncovered" if self.uncovered_area else ""
        time = "" if self.mean_time is None else f", mean time {self.mean_time:.3f} s"
        return f"<CoverageResult {robots}, mean distance {self.mean_distance:.3f} m{time}{uncovered}>"

    @cached_property
    def times(self) -> Array:
        """The time until the first robot is at each site, (m,) s, inf where none can come.

        Without `speeds` every robot goes at 1 m/s.
        """
        if self.speeds is None:
            return self.distances
        # where none can come, the distance is infinite whatever the speed
        return np.asarray(self.distances / self.speeds[self.owner])

    @cached_property
    def first(self) -> Array:
        """The first way-point from the owner to the site, (m, 2) m: a corner, or the site itself."""
        first = self.points.copy()
        bent = np.nonzero(self.corner >= 0)[0]
        first[bent] = self.corners[self.corner[bent]]
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
        toward = self.first[site] - self.positions[owner]
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
    ``lattice``² square cells; the cell centres in the open free space are the sites. Distances are
    exact; only the mean over the sites is an approximation of the integral. Where the environment has a
    density φ, each site is weighed by the exact mean of φ over its cell.

    Parameters
    ----------
    environment : Environment
    lattice : int
        Cells along a side.
    progress : callable
        Called now and then, while what is known before the positions is computed, with the part that is
        done. It may raise, to give up.
    geodesics : Geodesics
        The shortest paths of this very environment, where another lattice on it has found them already.

    Attributes
    ----------
    environment : Environment
    points : (m, 2) m
        The sites, row by row from the lower left.
    cells : (m,)
        The sites' numbers among all cells, ``row * lattice + column``.
    spacing : float, m
        Side of a cell.
    sites : Sites
        All of these.
    corners : (k, 2) m
        Where ways can bend.
    geodesics : Geodesics
    weights : (m,) or None
        The mean of φ over the cell of each site; None where every place counts the same.

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

    def __init__(
        self,
        environment: Environment,
        lattice: int = 64,
        *,
        progress: Callable[[float], None] | None = None,
        geodesics: Geodesics | None = None,
    ) -> None:
        self.lattice = int(checked("lattice", lattice, 1, MAX_LATTICE, whole=True))
        self.environment = environment
        beat = None if progress is None else partial(progress, 0.0)
        self.geodesics = Geodesics(environment, beat) if geodesics is None else geodesics
        self._areas = np.array([part.area for part in environment.free.geoms])
        self._masses = environment.free_masses
        self._lattice = Lattice(self.geodesics.walls, self.geodesics.size, self.lattice)
        self.corners = frozen(self.geodesics.corners)
        self._views = self._corner_views(progress)
        self.sites = self._lattice.sites
        self.points, self.cells, self.spacing = self.sites.points, self.sites.cells, self.sites.spacing
        self.weights = self._weights()

    def with_density(self, environment: Environment) -> CoverageCost:
        """Return the coverage cost of the same map with another density; nothing else is computed again.

        Parameters
        ----------
        environment : Environment
            With the free space and the region of this one's.
        """
        twin = copy(self)
        twin.environment = environment
        twin._masses = environment.free_masses
        twin.weights = twin._weights()
        return twin

    def _weights(self) -> Array | None:
        density = self.environment.density
        if density is None or density.uniform:
            return None
        return frozen(means_over_squares(density, self.points, self.spacing))

    def _corner_views(self, progress: Callable[[float], None] | None) -> CornerViews:
        """Return what the corners see of the sites."""
        scene, tiles, count = self.geodesics.scene, self._lattice.tiles, len(self.corners)
        pieces = [(np.empty((0, 3), dtype=np.int64), np.empty((0, 2)))]
        for begin in range(0, count, _BLOCK):
            if progress is not None:
                progress(begin / count)
            pieces.append(looked_for(scene, tiles, begin, min(begin + _BLOCK, count)))
        rows, lengths = (np.concatenate(parts) for parts in zip(*pieces, strict=True))
        order = np.argsort(rows[:, 1], kind="stable")
        first = np.searchsorted(rows[order, 1], np.arange(len(tiles.first)))
        corner, _, mask = columns(rows[order])
        return CornerViews(first, corner, mask, *columns(lengths[order]))

    def __call__(self, positions: Array, speeds: Array | None = None) -> CoverageResult:
        """Return the coverage cost of (n, 2) positions in metres.

        Parameters
        ----------
        positions : (n, 2) m
        speeds : (n,) m/s or None
            How fast each robot goes: then not the nearest robot counts but the one that is there first, and
            the cost is in seconds.

        Raises
        ------
        InputError
            When there is no robot, or one is outside the free space, or speeds are not positive numbers, one
            for each robot; the message names it.
        """
        positions = np.array(positions, dtype=float)
        if not len(positions):
            raise InputError("positions: none, but at least one robot was wanted")
        x, y, holds = self.geodesics.place(positions)
        covered = np.asarray(holds.any(axis=0))
        if speeds is None:
            return self._result(positions, covered, self._nearest(x, y, covered))
        speeds = checked_speeds(speeds, len(positions))
        return self._result(positions, covered, first_there(self._nearest, x, y, holds, speeds), speeds)

    def _nearest(self, x: Array, y: Array, covered: BoolArray) -> Ways:
        """Return the ways of the nearest of the robots at (x, y), which stand in some of the components."""
        return site_paths(self.geodesics.scene, self._lattice.tiles, self._views, x, y, covered)

    def _result(
        self, positions: Array, covered: BoolArray, ways: Ways, speeds: Array | None = None
    ) -> CoverageResult:
        distances, owner, corner, last_corner = ways
        distances = distances * self.geodesics.walls.grid.unit
        reached = distances if covered.all() else distances[owner >= 0]
        weights = self.weights
        some = None if weights is None else weights if covered.all() else weights[owner >= 0]
        mean = weighted_mean(reached, some)
        time = None if speeds is None else weighted_mean(reached / speeds[owner[owner >= 0]], some)
        return CoverageResult(
            mean_distance=mean,
            value=(mean if time is None else time) * float(self._masses[covered].sum()),
            uncovered_area=float(self._areas[~covered].sum()),
            distances=distances,
            owner=owner,
            corner=corner,
            last_corner=last_corner,
            positions=positions,
            points=self.points,
            corners=self.corners,
            environment=self.environment,
            sites=self.sites,
            weights=weights,
            speeds=speeds,
            mean_time=time,
        )

    def grid(self, values: NDArray[Number]) -> NDArray[Number]:
        """Return (m,) values of the sites as a picture of the whole lattice, (n, n), the lowest row first.

        Cells that are not free hold nan, or -1 where the values are whole numbers.

        Examples
        --------
        >>> from robocov.environment import CircleObstacle, Environment
        >>> square = ((0, 0), (3, 0), (3, 3), (0, 3))
        >>> cost = CoverageCost(Environment("ring", square, (CircleObstacle((1.5, 1.5), 0.4),)), lattice=3)
        >>> cost.grid(cost([[0.5, 0.5]]).owner)
        array([[ 0,  0,  0],
               [ 0, -1,  0],
               [ 0,  0,  0]])
        """
        return self.sites.grid(values)

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
