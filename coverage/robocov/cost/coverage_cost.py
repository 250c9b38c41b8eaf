"""The coverage cost (22): the mean distance that the nearest robot must travel to reach a point.

Equation numbers refer to Renzaglia and Martinelli, "Distributed Coverage Control for a Multi-Robot Team in a
Non-Convex Environment".
"""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from functools import partial

import numpy as np

from robocov.arrays import compute_weighted_mean, copy_read_only
from robocov.cost.corner_views import (
    INDEX_COLUMNS,
    LENGTH_COLUMNS,
    build_corner_views,
    find_corner_views,
)
from robocov.cost.lattice import MAX_LATTICE, build_lattice
from robocov.cost.result import CoverageResult
from robocov.cost.site_paths import NO_ROBOT, CostMap, Search, SitePaths, find_site_paths
from robocov.defaults import DEFAULT_LATTICE, DEFAULT_RADIUS_M
from robocov.density.polygon_masses import compute_square_means
from robocov.environment import Environment, require_environment
from robocov.errors import InputError, quote, require_number, to_floats
from robocov.geodesic import Geodesics
from robocov.geodesic.angular_index import AngularWallIndex
from robocov.geodesic.corner_graph import NO_CORNER
from robocov.geodesic.geodesics import SOURCE_BINS
from robocov.typing import AnyArray, BoolArray, FloatArray


class CoverageCost:
    """The coverage cost (22) of one environment on a lattice of sites.

    The region's bounding box is extended from its lower left corner to a square, which is divided into
    ``lattice²`` square cells. The centers of the cells that are in the open free space are the sites.
    Distances are exact; only the mean over the sites is an approximation of the integral. If the environment
    has a density φ, each site is weighted by the exact mean of φ over its cell.

    The paths are those of a point, except that no path leads through a gap that is narrower than a robot. The
    area behind such a gap counts as uncovered. Between positions that the center of a disc can reach, the
    shortest path of the disc that passes all obstacles on the same sides is longer than that of the point by
    at most the radius times the total angle, in radians, by which the path of the disc turns.

    Parameters
    ----------
    environment : Environment
        The map, with its obstacles and its density.
    lattice : int
        Number of cells along a side.
    radius : float, m
        Radius of the smallest robot of the team, see `Environment.close_gaps`. With 0, robots are points and
        paths lead through all gaps, as in the paper.
    progress : callable, optional
        Called with the completed fraction of the preparation. It may raise an exception to stop.
    geodesics : Geodesics, optional
        The shortest paths of the same environment for the same radius, if they have been computed already.

    Attributes
    ----------
    environment : Environment
        The map.
    closed_environment : Environment
        The map with closed gaps; the same object if no gap is narrower than a robot.
    lattice : int
        Number of cells along a side.
    radius : float, m
        Radius of the smallest robot.
    geodesics : Geodesics
        The shortest paths of the map with closed gaps.
    sites : Sites
        The sites of the lattice.
    points : (m, 2) array, m
        Positions of the sites.
    cells : (m,) int array
        Index of the cell of each site.
    spacing : float, m
        Side of a cell.
    corners : (k, 2) array, m
        All points where paths can bend.
    weights : (m,) array or None
        Mean of φ over the cell of each site, or None if all are equal.

    Raises
    ------
    ParameterError
        If `lattice` is not a whole number from 1 to 4096, or so coarse that no site is free, or if `radius`
        is below 0.

    See Also
    --------
    CoverageResult : The result of an evaluation.
    TimeVaryingCost : The cost of a map whose obstacles move.
    find_optimum : Find positions of low cost.
    compute_cost_history : The cost over a run.

    Notes
    -----
    The coverage cost of positions P in the free space Ω is (22), with the density φ of (4)::

        J(P) = ∫_Ω min_i d(q, p_i) φ(q) dq

    where d is the length of the shortest path around obstacles. Controllers do not use it: it rates them.

    Examples
    --------
    >>> import robocov as rc
    >>> square = rc.Environment("square", ((0, 0), (1, 0), (1, 1), (0, 1)))
    >>> cost = rc.CoverageCost(square)
    >>> round(cost([[0.5, 0.5]]).mean_distance, 3)
    0.383
    """

    def __init__(
        self,
        environment: Environment,
        lattice: int = DEFAULT_LATTICE,
        *,
        radius: float = DEFAULT_RADIUS_M,
        progress: Callable[[float], None] | None = None,
        geodesics: Geodesics | None = None,
    ) -> None:
        require_environment(environment)
        self.closed_environment = environment.close_gaps(radius)
        self.radius = float(radius)
        self.lattice = int(require_number("lattice", lattice, 1, MAX_LATTICE, whole=True))
        if geodesics is None:
            heartbeat = None if progress is None else partial(progress, 0.0)
            geodesics = Geodesics(self.closed_environment, heartbeat)
        self.geodesics = geodesics
        self.corners = copy_read_only(geodesics.corners)
        self.sites, tiles = build_lattice(geodesics, self.lattice)
        self.points = self.sites.points
        self.cells = self.sites.cells
        self.spacing = self.sites.spacing
        # The sites that each corner sees do not depend on the robots, and are found only once.
        indices, lengths = geodesics.run_for_corners(
            partial(find_corner_views, geodesics.walls, tiles),
            index_columns=INDEX_COLUMNS,
            length_columns=LENGTH_COLUMNS,
            progress=progress,
        )
        views = build_corner_views(len(tiles.boxes), indices, lengths)
        self._map = CostMap(geodesics.walls, geodesics.graph, tiles, views)
        components = self.closed_environment.free.geoms
        self._component_areas = np.array([component.area for component in components])
        # An initial guess, which `_find_paths` doubles whenever the wall index turns out to be too small.
        self._index_entries_per_robot = 2 * SOURCE_BINS
        self._set_density(environment, self.closed_environment)

    def with_density(self, environment: Environment) -> CoverageCost:
        """Return the coverage cost of an environment that differs only in its density.

        Parameters
        ----------
        environment : Environment
            The same map with another density.

        Returns
        -------
        CoverageCost
            It shares all data that do not depend on the density with this one.
        """
        cost = copy(self)
        closed_environment = environment
        if self.closed_environment is not self.environment:
            closed_environment = self.closed_environment.with_density(environment.density)
        cost._set_density(environment, closed_environment)
        return cost

    def _set_density(self, environment: Environment, closed_environment: Environment) -> None:
        """Set the environment, and compute everything that depends on its density."""
        self.environment = environment
        self.closed_environment = closed_environment
        self._component_masses = closed_environment.free_masses
        self._mass = float(self._component_masses.sum())
        self.weights: FloatArray | None = None
        density = environment.density
        if density is not None and not density.is_uniform:
            self.weights = copy_read_only(compute_square_means(density, self.points, self.spacing))

    def __call__(self, positions: FloatArray, speeds: FloatArray | None = None) -> CoverageResult:
        """Compute the coverage cost of a team.

        Parameters
        ----------
        positions : (n, 2) array, m
            Positions of the robots, in the free space.
        speeds : (n,) array, m/s, optional
            If given, each site belongs to the robot that arrives first instead of the nearest one, and the
            cost is based on travel times.

        Returns
        -------
        CoverageResult

        Raises
        ------
        InputError
            If there is no robot, the positions have the wrong shape, a robot is outside the free space, or
            `speeds` is not one positive number per robot. The message names a robot outside the free space.
        """
        positions = _to_positions(positions)
        grid_positions, is_inside = self.geodesics.snap_to_free_space(positions)
        # A component of the free space is covered if any robot is inside it.
        is_covered: BoolArray = np.asarray(is_inside.any(axis=0))
        if speeds is None:
            paths = self._find_paths(grid_positions[None], is_covered[None])
            return self._build_result(positions, is_covered, paths, team=0)
        checked_speeds = _require_speeds(speeds, len(positions))
        paths = self._find_first_arrivals(grid_positions, is_inside, checked_speeds)
        return self._build_result(positions, is_covered, paths, team=0, speeds=checked_speeds)

    def evaluate_teams(self, positions: FloatArray) -> list[CoverageResult]:
        """Compute the coverage cost of each of several teams of the same size.

        The results are the same as if the cost were called for one team after the other, but it takes less
        time.

        Parameters
        ----------
        positions : (r, n, 2) array, m
            Positions of the robots of each team, in the free space.

        Returns
        -------
        list of r CoverageResult

        Raises
        ------
        InputError
            If the array has the wrong shape, there is no robot, or a robot is outside the free space.

        Examples
        --------
        >>> import robocov as rc
        >>> square = rc.Environment("square", ((0, 0), (1, 0), (1, 1), (0, 1)))
        >>> results = rc.CoverageCost(square, 16).evaluate_teams([[[0.5, 0.5]], [[0.25, 0.25]]])
        >>> [round(result.mean_distance, 2) for result in results]
        [0.38, 0.49]
        """
        teams = to_floats("positions", positions, "[x, y] of each robot of each team in meters", InputError)
        if teams.ndim != 3 or teams.shape[1] == 0 or teams.shape[2] != 2:
            raise InputError(
                f"positions: expected an array of shape (r, n, 2) with n >= 1, got shape {teams.shape}"
            )
        team_count, robot_count, _ = teams.shape
        grid_positions, is_inside = self.geodesics.snap_to_free_space(teams.reshape(-1, 2))
        component_count = is_inside.shape[1]
        is_covered = np.asarray(is_inside.reshape(team_count, robot_count, component_count).any(axis=1))
        paths = self._find_paths(grid_positions.reshape(teams.shape), is_covered)
        return [self._build_result(teams[team], is_covered[team], paths, team) for team in range(team_count)]

    def _find_paths(self, grid_positions: FloatArray, is_covered: BoolArray) -> SitePaths:
        """Find the paths to all sites from the robots of each team, given their positions in grid steps.

        The positions are an (r, n, 2) array. `is_covered`, (r, c), says which components of the free space
        contain robots of each team. The search uses an index of the walls around each robot. If the index
        proves too small, the search is repeated with a larger one.
        """
        team_count, robot_count, _ = grid_positions.shape
        paths = SitePaths.allocate(team_count, len(self.points))
        while True:
            # `add_walls` needs one free entry per bin before it adds a wall. The index has two, so that
            # it is less often too small.
            max_entries = self._index_entries_per_robot * robot_count + 2 * SOURCE_BINS
            search = Search.allocate(
                wall_index=AngularWallIndex.allocate(robot_count, SOURCE_BINS, max_entries),
                robot_count=robot_count,
                corner_count=len(self.corners),
                tile_count=len(self._map.tiles.boxes),
            )
            if find_site_paths(
                self._map, search, grid_positions, is_covered, self.geodesics.grid.spacing, paths
            ):
                return paths
            self._index_entries_per_robot *= 2

    def _find_first_arrivals(
        self, grid_positions: FloatArray, is_inside: BoolArray, speeds: FloatArray
    ) -> SitePaths:
        """Find the path to each site from the robot that arrives first.

        `grid_positions` are (n, 2) grid steps, and `is_inside`, (n, c), says in which components of the free
        space each robot is. Of the robots with the same speed, the nearest one arrives first. There is one
        search for each speed, starting with the highest. A path replaces the one that was found before if the
        robot arrives sooner.
        """
        # One team, without a path to any site yet.
        shape = (1, len(self.points))
        arrivals = SitePaths(
            distances=np.full(shape, np.inf),
            owners=np.full(shape, NO_ROBOT),
            first_corners=np.full(shape, NO_CORNER),
            last_corners=np.full(shape, NO_CORNER),
        )
        times = np.full(shape, np.inf)
        for speed in np.unique(speeds)[::-1]:
            robots = np.flatnonzero(speeds == speed)
            is_covered = is_inside[None, robots].any(axis=1)
            paths = self._find_paths(grid_positions[None, robots], np.asarray(is_covered))
            is_sooner = paths.distances / speed < times
            times[is_sooner] = paths.distances[is_sooner] / speed
            arrivals.distances[is_sooner] = paths.distances[is_sooner]
            # The search numbers the robots of this speed from 0.
            arrivals.owners[is_sooner] = robots[paths.owners[is_sooner]]
            arrivals.first_corners[is_sooner] = paths.first_corners[is_sooner]
            arrivals.last_corners[is_sooner] = paths.last_corners[is_sooner]
        return arrivals

    def _build_result(
        self,
        positions: FloatArray,
        is_covered: BoolArray,
        paths: SitePaths,
        team: int,
        speeds: FloatArray | None = None,
    ) -> CoverageResult:
        """Build the result of one team from the paths of several teams.

        The team has the index `team` in the paths. Its robots are at `positions`, (n, 2) m, in the components
        of the free space that are true in `is_covered`, (c,). The cost is the mean distance of the sites in
        these components (with speeds, the mean time) times the integral of the density over the components,
        `mass`.
        """
        distances = paths.distances[team]
        owners = paths.owners[team]
        reached_distances = distances
        reached_owners = owners
        weights = self.weights
        mass = self._mass
        uncovered_area = 0.0
        # Sites that no robot can reach are left out of the means.
        if not is_covered.all():
            is_reached = owners != NO_ROBOT
            reached_distances = distances[is_reached]
            reached_owners = owners[is_reached]
            weights = None if self.weights is None else self.weights[is_reached]
            mass = float(self._component_masses[is_covered].sum())
            uncovered_area = float(self._component_areas[~is_covered].sum())
        mean_distance = compute_weighted_mean(reached_distances, weights)
        mean_time = None
        value = mean_distance * mass
        if speeds is not None:
            mean_time = compute_weighted_mean(reached_distances / speeds[reached_owners], weights)
            value = mean_time * mass
        return CoverageResult(
            mean_distance=mean_distance,
            value=value,
            uncovered_area=uncovered_area,
            distances=distances,
            owners=owners,
            first_corners=paths.first_corners[team],
            last_corners=paths.last_corners[team],
            positions=positions,
            points=self.points,
            corners=self.corners,
            environment=self.environment,
            sites=self.sites,
            weights=self.weights,
            speeds=speeds,
            mean_time=mean_time,
            radius=self.radius,
        )

    def to_grid(self, values: AnyArray) -> AnyArray:
        """Arrange values of the sites as an image of the lattice.

        Parameters
        ----------
        values : (m,) array
            One value for each site.

        Returns
        -------
        (lattice, lattice) array
            The lowest row first; see `Sites.to_grid`.
        """
        return self.sites.to_grid(values)

    def find_path(self, positions: FloatArray, point: FloatArray) -> FloatArray:
        """Find the shortest path from a point to the nearest robot.

        Parameters
        ----------
        positions : (n, 2) array, m
            Positions of the robots.
        point : (2,) array, m
            The point, in the free space.

        Returns
        -------
        (w, 2) array, m
            The waypoints from the point to the robot, including both ends; of shape (0, 2) if no robot can
            reach the point.

        Raises
        ------
        InputError
            If there is no robot, or the point or a robot is outside the free space.
        """
        positions = _to_positions(positions)
        point = to_floats("point", point, "[x, y] in meters", InputError)
        distances = self.geodesics.compute_distances(point[None], positions)[0]
        path = self.geodesics.find_path(point, positions[int(distances.argmin())])
        return _remove_repeated_ends(path)


def _remove_repeated_ends(path: FloatArray) -> FloatArray:
    """Remove the corners of a path that are also its ends, so that each waypoint occurs once."""
    if len(path) < 3:
        return path
    corners = path[1:-1]
    is_end = (corners == path[0]).all(axis=1) | (corners == path[-1]).all(axis=1)
    return np.concatenate([path[:1], corners[~is_end], path[-1:]])


def _to_positions(values: object) -> FloatArray:
    """Convert the positions of robots to an array of meters; raise InputError if there is no robot."""
    positions = to_floats("positions", values, "[x, y] of each robot in meters", InputError)
    if not positions.size:
        raise InputError("positions: expected at least one robot, got none")
    return positions


def _require_speeds(speeds: object, robot_count: int) -> FloatArray:
    """Return the speeds as an array, (n,) m/s; raise InputError unless there is one above 0 per robot."""
    try:
        values = np.array(speeds, dtype=float)
    except (TypeError, ValueError):
        values = np.empty(0)
    if values.shape != (robot_count,):
        raise InputError(f"speeds: expected a number for each of {robot_count} robots, got {quote(speeds)}")
    for robot, speed in enumerate(values.tolist()):
        if not 0.0 < speed < np.inf:
            raise InputError(f"speeds[{robot}]: expected a number above 0 m/s, got {quote(speed)}")
    return values
