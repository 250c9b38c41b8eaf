"""The oracle: robots that know the map, and take the shortest paths to the best placement found for the map.

The benchmark passes this file to its runs like a user's controller, because the oracle is not distributed:
its goals are assigned for all robots at once, and failures are known in advance. The placements are in the
extra content of the map, under ``oracle``: a list of ``[start (s), [robots], [[x, y], ...]]``.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment

from robocov.controllers.base import TIME_TOLERANCE_S, BaseController, is_plan_due
from robocov.controllers.driving import update_returns
from robocov.controllers.exploration.route_following import RouteGains, RouteProgress, follow_routes
from robocov.controllers.gains import gain, response_time_gain
from robocov.controllers.geodesic_lloyd import GeodesicPlanner
from robocov.environment import Environment, find_nearest_inside
from robocov.errors import ParameterError
from robocov.observation import Decision, Observations, Scanning
from robocov.observation.region import Region
from robocov.team import Team
from robocov.typing import FloatArray, IntArray

_PLANNER_LATTICE = 8
"""Number of sites along a side of the planner's lattice, on which no costs are computed."""
_UNREACHABLE_M = 1e6
"""Length that stands for a missing path when goals are assigned."""


@dataclass(frozen=True, eq=False)
class OracleMemory:
    """Memory of n robots: the routes to their goals, and their progress along the routes."""

    team: Team
    routes: tuple[FloatArray, ...]
    """Waypoints of each robot, (w, 2) m."""
    waypoint_indices: IntArray
    """Index, in its route, of the waypoint that each robot heads for, (n,)."""
    returns: FloatArray | None = None
    """Points that the last scan of each robot hit, (n, rays, 2) m."""
    stage: int = -1
    """Index of the placement in use."""
    plan_time: float = -np.inf
    """Time of the last plan, s."""


@dataclass(frozen=True)
class Oracle(BaseController):
    """Moves to the best placement: a baseline for the time and path length of robots that know the map.

    Once in each `period`, goals are assigned to robots such that the sum of the squared geodesic distances is
    minimal. The robots follow the shortest paths among walls that are enlarged by their radius and
    `clearance`, and brake, give way and keep their distance as in `follow_routes`. The time is not a lower
    bound, because robots that brake later may arrive earlier.
    """

    name = "oracle"
    label = "Oracle"
    summary = "knows the map and the best placement, and moves there; decides for all robots at once"
    information = "whole map"
    scanning = Scanning(rays=240, period=0.5)

    period: float = gain(1.0, "s", "time between two plans of the paths", low=0.05, high=60.0)
    clearance: float = gain(0.03, "m", "margin between robots and walls along paths", high=10.0)
    k_prop: float = gain(2.0, "1/s", "desired speed per meter of distance to the goal", high=100.0)
    response_time: float = response_time_gain()
    environment: Environment | None = field(default=None, repr=False, compare=False)

    def inform(self, environment: Environment) -> Oracle:
        """Return the same controller with the map."""
        return replace(self, environment=environment)

    def begin(self, region: Region, team: Team) -> OracleMemory:
        """Return the memory before the first plan; raise ParameterError if the map has no placement."""
        if self.environment is None or "oracle" not in self.environment.extra:
            raise ParameterError(
                f"controller {self.name!r}: expected a map with the best placement, which only maps of the "
                "benchmark have"
            )
        unknown = (np.full((1, 2), np.nan),) * len(team)
        return OracleMemory(team, routes=unknown, waypoint_indices=np.zeros(len(team), dtype=np.intp))

    def decide(self, seen: Observations, memory: OracleMemory) -> Decision:
        """Compute the forces along the paths, which are planned in each period and at each new stage."""
        assert self.environment is not None
        stages = self.environment.extra["oracle"]
        stage = _find_stage(stages, seen.time)
        if stage != memory.stage or is_plan_due(memory.plan_time, self.period, seen.time):
            wall_distance = float(memory.team.radius.max()) + self.clearance
            planner = _get_planner(self.environment, wall_distance)
            _, robots, positions = stages[stage]
            routes = plan_routes(planner, seen.positions, robots, np.array(positions, dtype=float))
            memory = replace(
                memory,
                stage=stage,
                routes=routes,
                waypoint_indices=np.zeros(len(routes), dtype=np.intp),
                plan_time=seen.time,
            )
        returns = update_returns(seen, memory.returns)
        forces, goals, waypoint_indices = follow_routes(
            seen,
            memory.team,
            RouteProgress(memory.routes, memory.waypoint_indices),
            returns,
            RouteGains(self.k_prop, self.response_time),
        )
        memory = replace(memory, waypoint_indices=waypoint_indices, returns=returns)
        return Decision(forces, goals, {"attraction": forces}, memory=memory)


def _find_stage(stages: list[Any], time: float) -> int:
    """Return the index of the placement to use at a time, s: the last placement that has started."""
    started_stages = [k for k, (start, _, _) in enumerate(stages) if start <= time + TIME_TOLERANCE_S]
    return max(started_stages)


def plan_routes(
    planner: GeodesicPlanner, positions: FloatArray, robots: list[int], placement: FloatArray
) -> tuple[FloatArray, ...]:
    """Assign the positions of a placement to robots, and plan the shortest paths to them.

    Goals are assigned again while the robots move, so that a robot that blocks another takes over its goal.

    Parameters
    ----------
    planner : GeodesicPlanner
        Computes shortest paths on the map.
    positions : (n, 2) array, m
        Current positions of the robots.
    robots : list of int
        Rows of the k working robots; the others stay where they are.
    placement : (k, 2) array, m
        Goals of the working robots, in any order.

    Returns
    -------
    tuple of (w, 2) arrays, m
        Waypoints of each of the n robots.
    """
    working = np.array(robots, dtype=np.intp)
    inside = find_nearest_inside(planner.configuration_space, positions)
    goals = find_nearest_inside(planner.configuration_space, placement)
    targets = inside.copy()
    targets[working] = goals[assign_goals(planner, inside[working], goals)]
    return tuple(
        find_waypoints(planner, position, target) for position, target in zip(inside, targets, strict=True)
    )


def assign_goals(planner: GeodesicPlanner, positions: FloatArray, goals: FloatArray) -> IntArray:
    """Assign each robot a goal such that the sum of the squared geodesic distances is minimal.

    Parameters
    ----------
    planner : GeodesicPlanner
        Computes shortest paths on the map.
    positions, goals : (n, 2) arrays, m
        Current positions of the robots, and the goals in any order.

    Returns
    -------
    (n,) array of int
        Index of the goal of each robot.
    """
    lengths = planner.paths.compute_distances(positions, goals)
    lengths = np.where(np.isfinite(lengths), lengths, _UNREACHABLE_M)
    return np.asarray(linear_sum_assignment(lengths**2)[1])


def find_waypoints(planner: GeodesicPlanner, position: FloatArray, goal: FloatArray) -> FloatArray:
    """Return the waypoints of the shortest path, (w, 2) m; the position alone if there is no path."""
    path = planner.paths.find_path(position, goal)
    return path[1:] if len(path) > 1 else position[None]


@lru_cache(maxsize=4)
def _get_planner(environment: Environment, clearance: float) -> GeodesicPlanner:
    """Return the planner for a map; the latest planners are kept in memory."""
    return GeodesicPlanner(environment, clearance, _PLANNER_LATTICE, radius=0.0)
