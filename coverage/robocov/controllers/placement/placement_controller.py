"""Common parts of the controllers that choose goals for the whole team on the known map."""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment

from robocov.controllers.base import is_plan_due
from robocov.controllers.driving import update_returns
from robocov.controllers.exploration.route_following import RouteGains, RouteProgress, follow_routes
from robocov.controllers.exploration.sightings import Sightings
from robocov.controllers.gains import gain, response_time_gain
from robocov.controllers.geodesic_lloyd import GeodesicPlanner
from robocov.controllers.known_map import WholeMapController
from robocov.environment import Environment, find_nearest_inside
from robocov.observation import Decision, Observations, Scanning
from robocov.observation.region import Region
from robocov.team import Team
from robocov.typing import FloatArray, IntArray

_MAX_LATTICE = 512
"""Maximum number of cells of the lattice along a side of the region."""
_MISSING_PATH_FACTOR = 2.0
"""Length that stands for a missing path, as a multiple of the longest path on the map."""
_POSITION_DECIMALS = 6
"""Number of decimals to which known positions, in m, are rounded. Robots that know the same positions then
make the same plan, in spite of rounding errors."""


class PlacementMap:
    """Points of a known map at which robots can be placed, and the distances from there. Immutable.

    Parameters
    ----------
    environment : Environment
    clearance : float, m
        Distance that the centers of robots keep from walls.
    nodes : int
        Approximate number of sites: the points of a square lattice that are in the free space.
    radius : float, m
        Radius of the smallest robot, for the distances in `table`: no path leads through a gap that is
        narrower than this robot.

    Attributes
    ----------
    planner : GeodesicPlanner
        The space in which the centers of robots can be, and shortest paths there.
    candidates : (c, 2) array, m
        The sites in that space, at which robots can be placed.
    components : (c,) int array
        Index of the component of that space that contains each candidate.
    table : (m, c) array
        Geodesic distances from m sites to the candidates, times the density at the sites. Sites without a
        path to any candidate are left out.
    """

    def __init__(self, environment: Environment, clearance: float, nodes: int, radius: float) -> None:
        low_x, low_y, high_x, high_y = environment.region.bounds
        spacing = math.sqrt(environment.free.area / nodes)
        lattice = math.ceil(max(high_x - low_x, high_y - low_y) / spacing)
        self.planner = GeodesicPlanner(environment, clearance, min(lattice, _MAX_LATTICE), radius)
        cost = self.planner.cost
        # A site is in the configuration space if it is itself the nearest point of that space.
        nearest = find_nearest_inside(self.planner.configuration_space, cost.points)
        self.candidates = cost.points[(nearest == cost.points).all(axis=1)]
        self.components = self.find_components(self.candidates)
        distances = cost.geodesics.compute_distances(self.candidates, cost.points).T
        has_path = np.isfinite(distances)
        is_reached = has_path.any(axis=1)
        max_length = distances[has_path].max(initial=0.0)
        finite_distances = np.where(has_path, distances, _MISSING_PATH_FACTOR * max_length)
        table = finite_distances[is_reached]
        if cost.weights is not None:
            table *= cost.weights[is_reached][:, None]
        self.table = np.ascontiguousarray(table)

    def find_components(self, positions: FloatArray) -> IntArray:
        """Return the component of the configuration space that contains each position.

        Parameters
        ----------
        positions : (k, 2) array, m
            Positions in the configuration space.

        Returns
        -------
        (k,) int array
        """
        _, is_inside = self.planner.paths.snap_to_free_space(positions)
        return np.asarray(is_inside.argmax(axis=1))

    def find_nearest_candidates(self, positions: FloatArray, components: IntArray) -> IntArray:
        """Find the candidate nearest to each position in a straight line, without using any candidate twice.

        A wall may stand between a position and its candidate. Candidates only start a search, and most
        positions are previous goals, which are candidates themselves.

        Parameters
        ----------
        positions : (k, 2) array, m
        components : (k,) int array
            The component that must contain the candidate of each position.

        Returns
        -------
        (q,) int array
            Indices of the candidates, ascending. There are fewer than k if a component has too few.
        """
        is_taken = np.zeros(len(self.candidates), dtype=bool)
        for position, component in zip(positions, components, strict=True):
            is_usable = ~is_taken & (self.components == component)
            if is_usable.any():
                squared_distances = ((self.candidates - position) ** 2).sum(axis=1)
                is_taken[np.where(is_usable, squared_distances, np.inf).argmin()] = True
        return np.flatnonzero(is_taken)

    def assign(self, positions: FloatArray, chosen: IntArray) -> FloatArray:
        """Assign candidates to robots so that the sum of the squared path lengths is minimal.

        Parameters
        ----------
        positions : (k, 2) array, m
            Positions of the robots in the configuration space.
        chosen : (q,) int array
            At most k candidates.

        Returns
        -------
        (k, 2) array, m
            The goal of each robot, or its position if no candidate that it can reach is left for it.
        """
        goals = positions.copy()
        if len(chosen) == 0:
            return goals
        lengths = self.planner.paths.compute_distances(positions, self.candidates[chosen])
        has_path = np.isfinite(lengths)
        max_length = lengths[has_path].max(initial=0.0)
        # A missing path costs more than all paths of the team together.
        costs = np.where(has_path, lengths**2, (len(positions) + 1.0) * (max_length**2 + 1.0))
        robots, columns = linear_sum_assignment(costs)
        is_reachable = has_path[robots, columns]
        goals[robots[is_reachable]] = self.candidates[chosen[columns[is_reachable]]]
        return goals


# Maps take long to build. They are not part of the memory of robots, which is sometimes copied.
_build_cached_map = lru_cache(maxsize=8)(PlacementMap)


class KnownTeam(NamedTuple):
    """Knowledge of a robot about the k robots that it knows of, itself included, in the order of indices."""

    robots: IntArray
    """(k,) Their indices."""
    positions: FloatArray
    """(k, 2) m, their last known positions, moved into the configuration space."""
    components: IntArray
    """(k,) Index of the component of the configuration space that contains each position."""
    previous_goals: FloatArray
    """(k, 2) m, their goals in the robot's last plan, or their positions if they were not in it."""


@dataclass(frozen=True, slots=True, eq=False)
class PlacementMemory:
    """Memory of all robots of a team. Row or entry i belongs to robot i alone."""

    team: Team
    sightings: Sightings
    """The last known positions of others."""
    goals: FloatArray
    """(n, n, 2) m. Entry (i, j) is the goal of robot j in the last plan of robot i; nan for none."""
    routes: tuple[FloatArray, ...]
    """Waypoints of each robot, (w, 2) m. The last one is its goal."""
    waypoint_indices: IntArray
    """(n,) Index, in its route, of the waypoint that each robot heads for."""
    plan_time: float = -math.inf
    """Time of the last plan, s."""
    returns: FloatArray | None = None
    """(n, rays, 2) m, obstacle points in the last scan of each robot; nan for none."""


@dataclass(frozen=True)
class PlacementController(WholeMapController):
    """Base class of controllers that choose goals for the whole team on the known map.

    Each robot plans for all robots that it knows of: itself, those within communication range, and others
    that it assumes at their last known positions. It forgets a robot that has been silent for 5 s although it
    would certainly be in range at its last known position. Robots with the same knowledge make the same plan.

    Once in each `period`, goals are assigned to robots so that the sum of the squared lengths of the shortest
    paths is minimal. With this assignment, no robot has to pass another one that is already at its goal.
    """

    scanning = Scanning(rays=240, period=0.5)

    nodes: float = gain(
        1000.0, "1", "number of lattice points in the free space", low=16.0, high=20000.0, whole=True
    )
    clearance: float = gain(0.03, "m", "margin between robots and walls along paths", high=10.0)
    period: float = gain(1.0, "s", "time between two plans", low=0.05, high=60.0)
    k_prop: float = gain(2.0, "1/s", "desired speed per meter of distance to the goal", high=100.0)
    response_time: float = response_time_gain()

    @abstractmethod
    def choose_candidates(self, placement_map: PlacementMap, known_team: KnownTeam) -> IntArray:
        """Choose the candidates that become goals.

        Parameters
        ----------
        placement_map : PlacementMap
        known_team : KnownTeam

        Returns
        -------
        (q,) int array
            At most one candidate for each robot, in any order.
        """

    def begin(self, region: Region, team: Team) -> PlacementMemory:
        """Return the initial memory; raise ParameterError if no robot fits into the map."""
        self._get_placement_map(team)
        n = len(team)
        return PlacementMemory(
            team=team,
            sightings=Sightings.build_empty(n),
            goals=np.full((n, n, 2), np.nan),
            routes=(),
            waypoint_indices=np.zeros(n, dtype=np.intp),
        )

    def decide(self, seen: Observations, memory: PlacementMemory) -> Decision:
        """Compute the forces that drive each robot along the shortest path to its goal."""
        if is_plan_due(memory.plan_time, self.period, seen.time):
            memory = self._plan(seen, memory)
        returns = update_returns(seen, memory.returns)
        command = follow_routes(
            seen,
            memory.team,
            RouteProgress(memory.routes, memory.waypoint_indices),
            returns,
            RouteGains(self.k_prop, self.response_time),
        )
        memory = replace(memory, waypoint_indices=command.waypoint_indices, returns=returns)
        terms = {"attraction": command.forces}
        return Decision(command.forces, command.goals, terms, memory=memory)

    def _get_placement_map(self, team: Team) -> PlacementMap:
        """Return the placement map of a team, which is built only once.

        The routes (`planner.paths`) are wide enough for the largest robot. The distances in `table` are those
        of the coverage cost: gaps count as closed only if they are narrower than the smallest robot.
        """
        clearance = float(team.radius.max()) + self.clearance
        return _build_cached_map(self.get_environment(), clearance, int(self.nodes), team.min_radius)

    def _plan(self, seen: Observations, memory: PlacementMemory) -> PlacementMemory:
        """Return the memory with new goals and routes."""
        placement_map = self._get_placement_map(memory.team)
        planner = placement_map.planner
        sightings = memory.sightings.update(seen, memory.team)
        # Entry (i, j) is the goal of robot j in the plan of robot i.
        goals = np.full_like(memory.goals, np.nan)
        routes = []
        # Robots with the same knowledge share a plan, which is computed only once.
        plans: dict[bytes, FloatArray] = {}
        for robot in range(len(goals)):
            known_positions = sightings.positions[robot].copy()
            known_positions[robot] = seen.positions[robot]
            known_positions = known_positions.round(_POSITION_DECIMALS)
            knowledge = known_positions.tobytes() + memory.goals[robot].tobytes()
            if knowledge not in plans:
                plans[knowledge] = self._compute_goals(placement_map, known_positions, memory.goals[robot])
            goals[robot] = plans[knowledge]
            start = find_nearest_inside(planner.configuration_space, seen.positions[robot][None])[0]
            path = planner.paths.find_path(start, goals[robot, robot])
            # Rounding may have moved the known position, and with it the goal, to another component. There is
            # no path then, and the robot stays.
            routes.append(path[1:] if len(path) > 0 else start[None])
        return replace(
            memory,
            sightings=sightings,
            goals=goals,
            routes=tuple(routes),
            waypoint_indices=np.zeros(len(goals), dtype=np.intp),
            plan_time=seen.time,
        )

    def _compute_goals(
        self, placement_map: PlacementMap, known_positions: FloatArray, last_goals: FloatArray
    ) -> FloatArray:
        """Return the goals of all robots, (n, 2) m, in the plan of one robot; nan for unknown robots.

        Parameters
        ----------
        placement_map : PlacementMap
        known_positions : (n, 2) array, m
            The planning robot's own position, and the last known ones of the others; nan for robots that it
            does not know.
        last_goals : (n, 2) array, m
            Goals in that robot's last plan; nan for robots that were not part of it.
        """
        is_known = np.isfinite(known_positions[:, 0])
        robots = np.flatnonzero(is_known)
        positions = find_nearest_inside(placement_map.planner.configuration_space, known_positions[robots])
        previous_goals = np.where(np.isfinite(last_goals[robots]), last_goals[robots], positions)
        known_team = KnownTeam(
            robots=robots,
            positions=positions,
            components=placement_map.find_components(positions),
            previous_goals=previous_goals,
        )
        chosen = self.choose_candidates(placement_map, known_team)
        goals = np.full_like(known_positions, np.nan)
        goals[robots] = placement_map.assign(positions, chosen)
        return goals
