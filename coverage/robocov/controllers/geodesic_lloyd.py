"""Lloyd's algorithm on geodesic cells, by robots that know the whole map: a reference for the others.

Equation numbers refer to Renzaglia and Martinelli, "Distributed Coverage Control for a Multi-Robot Team in a
Non-Convex Environment".
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon

from robocov.controllers.base import is_plan_due
from robocov.controllers.driving import compute_approach_velocities, compute_drive_forces
from robocov.controllers.gains import gain, response_time_gain
from robocov.controllers.known_map import WholeMapController, build_configuration_space
from robocov.cost import CoverageCost, CoverageResult
from robocov.environment import Environment, PolygonObstacle, find_nearest_inside
from robocov.geodesic import Geodesics
from robocov.observation import Decision, Observations
from robocov.observation.region import Region
from robocov.team import Team
from robocov.typing import FloatArray, IntArray

_MIN_FIRST_LENGTH_FRACTION = 0.25
"""Minimum distance to a first waypoint, as a fraction of the spacing of sites. Without it, a site at the
position of a robot would have an infinite weight."""


class GeodesicPlan(NamedTuple):
    """Goals of n robots, and the shortest paths to them."""

    goals: FloatArray
    """(n, 2) m, goals of the robots."""
    waypoints: FloatArray
    """(n, 2) m, the first waypoint of each path."""
    remaining_lengths: FloatArray
    """(n,) m, length of each path from its first waypoint to the goal."""


@dataclass(frozen=True, slots=True, eq=False)
class GeodesicMemory:
    """Memory of the last plan."""

    team: Team
    plan: GeodesicPlan | None = None
    plan_time: float = -np.inf
    """Time of the last plan, s."""


@dataclass(frozen=True)
class GeodesicLloyd(WholeMapController):
    """Lloyd's algorithm with geodesic Voronoi cells of the known map.

    Pimenta et al. (CDC 2008) and Bhattacharya, Ghrist and Kumar (IJRR 33, 2014) replace the straight distance
    in the locational cost by the length d of the shortest path. Each robot moves along the shortest path to
    the goal that minimizes an upper bound on the cost of its cell. This controller knows the whole map, and
    therefore serves as a reference for those that do not.

    Notes
    -----
    For each point q of the geodesic cell, the gradient of the cost with f(d) points along the first straight
    piece of the path to q, with the magnitude f'(d). For f = d^s with 1 <= s <= 2, the cost as a function of
    the robot's position p is bounded from above by a paraboloid around the first waypoint c of q, with the
    weight d^(s-1) / |c - p|. The goal minimizes the sum of these paraboloids: it is the weighted mean of the
    first waypoints. The cost never rises on a step to the goal, which is the centroid for s = 2 without
    obstacles, and a step of Weiszfeld's algorithm for s = 1, the cost (22). Points are weighted by the
    density of the map.

    Distances are exact, and cells are sampled on a lattice. Walls are enlarged by the radius of the robot and
    `clearance`; goals are moved into the remaining space, in which robots follow shortest paths.

    We did not have the full texts of the two papers, which compute the Voronoi cells on a grid; details may
    differ.
    """

    name = "geodesic-lloyd"
    label = "Geodesic Lloyd"
    summary = "Lloyd's algorithm with geodesic cells, knowing the whole map (Pimenta 2008, Bhattacharya 2014)"

    exponent: float = gain(2.0, "1", "s in f = d^s; 2 as in the papers, 1 the cost (22)", low=1.0, high=2.0)
    lattice: float = gain(
        48.0, "cells", "number of cells of the lattice along a side", low=4.0, high=512.0, whole=True
    )
    clearance: float = gain(0.03, "m", "margin between robots and walls along paths", high=10.0)
    period: float = gain(0.2, "s", "time between two plans", high=60.0)
    k_prop: float = gain(2.0, "1/s", "desired speed per meter of path to the goal", high=100.0)
    response_time: float = response_time_gain()

    def begin(self, region: Region, team: Team) -> GeodesicMemory:
        """Return the initial memory; raise ParameterError if no robot fits into the map."""
        self._get_planner(team)
        return GeodesicMemory(team)

    def decide(self, seen: Observations, memory: GeodesicMemory) -> Decision:
        """Compute the forces that drive each robot along the shortest path to its goal."""
        team = memory.team
        plan = memory.plan
        if plan is None or is_plan_due(memory.plan_time, self.period, seen.time):
            plan = self._get_planner(team).plan(seen, self.exponent)
            memory = GeodesicMemory(team=team, plan=plan, plan_time=seen.time)
        offsets = plan.waypoints - seen.positions
        distance = np.hypot(*offsets.T)
        speed = np.minimum(self.k_prop * (distance + plan.remaining_lengths), team.max_speed)
        # A robot does not slow down before a waypoint, but must not overshoot it.
        speed = np.minimum(speed, distance / self.response_time)
        velocities = compute_approach_velocities(offsets, np.inf, speed)
        forces = compute_drive_forces(velocities, seen, team, self.response_time)
        return Decision(forces=forces, goals=plan.goals, terms={"attraction": forces}, memory=memory)

    def _get_planner(self, team: Team) -> GeodesicPlanner:
        """Return the planner for a team. Its paths fit the largest robot."""
        clearance = float(team.radius.max()) + self.clearance
        return _build_cached_planner(self.get_environment(), clearance, int(self.lattice), team.min_radius)


class _CellSites(NamedTuple):
    """The s sites in the geodesic cells of some robots."""

    owners: IntArray
    """(s,) The robot whose cell contains each site."""
    first_waypoints: FloatArray
    """(s, 2) m, the first waypoint of the path from the robot to the site."""
    distances: FloatArray
    """(s,) m, the length of that path."""
    densities: FloatArray | None
    """(s,) The density at each site, or None if it is uniform."""


class GeodesicPlanner:
    """Planner of goals and shortest paths on a known map. Immutable.

    Parameters
    ----------
    environment : Environment
    clearance : float, m
        Distance that the centers of robots keep from walls.
    lattice : int
        Number of cells of the lattice of the cost along a side of the region.
    radius : float, m
        Radius of the smallest robot, for the cost.

    Attributes
    ----------
    cost : CoverageCost
        The cost that is minimized.
    configuration_space : shapely.MultiPolygon
        Space where the centers of robots may be.
    paths : Geodesics
        Shortest paths in that space.
    """

    def __init__(self, environment: Environment, clearance: float, lattice: int, radius: float) -> None:
        configuration_space = build_configuration_space(environment, clearance)
        walls = environment.region.polygon.difference(configuration_space)
        obstacles = tuple(
            _build_obstacle(polygon) for polygon in shapely.get_parts(walls) if isinstance(polygon, Polygon)
        )
        boundary = tuple((x, y) for x, y in environment.region.vertices.tolist())
        enlarged = Environment(environment.name, boundary, obstacles)
        self.cost = CoverageCost(environment, lattice, radius=radius)
        self.paths = Geodesics(enlarged)
        self.configuration_space: MultiPolygon = enlarged.free
        shapely.prepare(self.configuration_space)

    def plan(self, seen: Observations, exponent: float) -> GeodesicPlan:
        """Plan the goals of all robots, each from the positions of the robots within communication range.

        Parameters
        ----------
        seen : Observations
        exponent : float
            s in f = d^s.

        Returns
        -------
        GeodesicPlan
        """
        positions = find_nearest_inside(self.configuration_space, seen.positions)
        if seen.neighbors.is_complete:
            goals = self._compute_shared_goals(positions, exponent)
        else:
            goals = self._compute_individual_goals(seen, positions, exponent)
        waypoints = goals.copy()
        remaining_lengths = np.zeros(len(goals))
        lines = shapely.linestrings(np.stack([positions, goals], axis=1))
        is_blocked = ~shapely.covers(self.configuration_space, lines)
        for i in np.flatnonzero(is_blocked).tolist():
            path = self.paths.find_path(positions[i], goals[i])
            if len(path) < 2:
                # The goal is in another room, without any path to it.
                goals[i] = positions[i]
                waypoints[i] = positions[i]
                continue
            waypoints[i] = path[1]
            remaining_lengths[i] = np.hypot(*np.diff(path[1:], axis=0).T).sum()
        return GeodesicPlan(goals=goals, waypoints=waypoints, remaining_lengths=remaining_lengths)

    def _compute_shared_goals(self, positions: FloatArray, exponent: float) -> FloatArray:
        """Return the goals, (n, 2) m, of robots at (n, 2) positions that all know each other."""
        result = self.cost(positions)
        sites = np.flatnonzero(result.owners >= 0)
        cells = _select_sites(result, sites, result.owners[sites])
        return self._compute_goals(positions, cells, exponent)

    def _compute_individual_goals(
        self, seen: Observations, positions: FloatArray, exponent: float
    ) -> FloatArray:
        """Return the goals, (n, 2) m, of robots at (n, 2) positions that each know some of the others.

        The distances of all sites from a position do not depend on other robots. They are therefore computed
        only once for all robots that know the position. Each robot uses those of its own position and of the
        positions that it has received.
        """
        n = len(positions)
        received_positions = [seen.get_neighbor_positions(i) for i in range(n)]
        unique_received, received_rows = np.unique(np.vstack(received_positions), axis=0, return_inverse=True)
        free_received = find_nearest_inside(self.configuration_space, unique_received)
        unique_positions, rows = np.unique(np.vstack([positions, free_received]), axis=0, return_inverse=True)
        results = self.cost.evaluate_teams(unique_positions[:, None])
        distances = np.array([result.distances for result in results])
        # Rows of `distances` that belong to the position of each robot, and to those that it has received.
        own_rows = rows[:n]
        neighbor_ends = np.cumsum([len(received) for received in received_positions])
        neighbor_rows = np.split(rows[n:][received_rows], neighbor_ends[:-1])
        goals = np.empty_like(positions)
        for i in range(n):
            own_distances = distances[own_rows[i]]
            # A site at the same distance from another robot belongs to both cells.
            limits = distances[neighbor_rows[i]].min(axis=0, initial=np.inf)
            sites = np.flatnonzero((own_distances <= limits) & np.isfinite(own_distances))
            cells = _select_sites(results[own_rows[i]], sites, np.zeros(len(sites), dtype=np.int64))
            goals[i] = self._compute_goals(positions[i : i + 1], cells, exponent)[0]
        return goals

    def _compute_goals(self, positions: FloatArray, cells: _CellSites, exponent: float) -> FloatArray:
        """Return the goals, (k, 2) m, of robots at (k, 2) positions, from their geodesic cells.

        They are weighted means of first waypoints; see the notes of `GeodesicLloyd`.
        """
        owners = cells.owners
        first_waypoints = cells.first_waypoints
        first_lengths = np.hypot(*(first_waypoints - positions[owners]).T)
        first_lengths = np.maximum(first_lengths, _MIN_FIRST_LENGTH_FRACTION * self.cost.spacing)
        # The weight d^(s-1) / |c - p| of each first waypoint c.
        weights = np.maximum(cells.distances, first_lengths) ** (exponent - 1.0) / first_lengths
        if cells.densities is not None:
            weights *= cells.densities
        n = len(positions)
        total = np.bincount(owners, weights, minlength=n)
        x = np.bincount(owners, weights * first_waypoints[:, 0], minlength=n)
        y = np.bincount(owners, weights * first_waypoints[:, 1], minlength=n)
        has_cell = total > 0.0
        means = np.column_stack([x, y]) / np.where(has_cell, total, 1.0)[:, None]
        goals = np.where(has_cell[:, None], means, positions)
        return find_nearest_inside(self.configuration_space, goals)


def _select_sites(result: CoverageResult, sites: IntArray, owners: IntArray) -> _CellSites:
    """Return the sites with the given indices, (s,), in the cells of the given owners, (s,)."""
    return _CellSites(
        owners=owners,
        first_waypoints=result.first_waypoints[sites],
        distances=result.distances[sites],
        densities=None if result.weights is None else result.weights[sites],
    )


def _build_obstacle(polygon: Polygon) -> PolygonObstacle:
    """Return the obstacle with the shape of a polygon, with its holes."""
    rings = [polygon.exterior, *polygon.interiors]
    outer, *holes = [tuple(map(tuple, ring.coords[:-1])) for ring in rings]
    return PolygonObstacle(outer, tuple(holes))


# Planners take long to build, and must not be copied with the memories of robots.
_build_cached_planner = lru_cache(maxsize=8)(GeodesicPlanner)
