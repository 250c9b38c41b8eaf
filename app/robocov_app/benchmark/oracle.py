"""The oracle: robots that know the map and walk straight to the best placement that was found for it.

The benchmark hands this file to its runs as a controller of a user's, because it obeys no rule of distributed
control: who goes where is decided for all robots at once, and it knows who will fail. The placements stand in
the map's extra content, under ``oracle``: a list of ``[from (s), [robots], [[x, y], ...]]``.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
from scipy.optimize import linear_sum_assignment

from robocov.arrays import Array, IntArray
from robocov.controllers.base import BaseController
from robocov.controllers.driving import update_returns
from robocov.controllers.gains import gain, response_time_gain
from robocov.controllers.geodesic_lloyd import GeodesicPlanner
from robocov.controllers.route_following import follow_routes
from robocov.environment import Environment, find_nearest_inside
from robocov.errors import ParameterError
from robocov.observation import Decision, Observations, Scanning
from robocov.observation.region import Region
from robocov.team import Team

_COARSE = 8  # lattice of the plan, which is asked for ways only


@dataclass(frozen=True, eq=False)
class OracleMemory:
    """Memory of the routes, and of where each robot is to be in the end."""

    team: Team
    routes: tuple[Array, ...]  # the way-points of each, (w, 2) m
    legs: IntArray  # (n,), the way-point that is headed for
    returns: Array | None = None  # (n, rays, 2) m, what the last scan of each met
    stage: int = -1
    planned: float = -np.inf  # s


@dataclass(frozen=True)
class Oracle(BaseController):
    """Walks to the best placement: a yardstick for the time and ways of robots that know the map.

    Robots are assigned to places such that the sum of the squared ways, geodesic ones, is least, anew in
    each `period`. They go there by the shortest ways among walls that are widened by the radius and
    `clearance`, with the braking, giving way and keeping off of `follow_routes`. With that care it is no
    bound: who dares more may be there sooner.
    """

    name = "oracle"
    label = "Oracle"
    summary = "knows the map and the best placement, and walks there; decides for all robots at once"
    information = "whole map"
    scanning = Scanning(rays=240, period=0.5)

    period: float = gain(1.0, "s", "between two looks for the ways", low=0.05, high=60.0)
    clearance: float = gain(0.03, "m", "that routes keep between rim and walls", high=10.0)
    k_prop: float = gain(2.0, "1/s", "wanted speed per metre of distance to the goal", high=100.0)
    response_time: float = response_time_gain()
    environment: Environment | None = field(default=None, repr=False, compare=False)

    def inform(self, environment: Environment) -> Oracle:
        """Return the same law with the map."""
        return replace(self, environment=environment)

    def begin(self, region: Region, team: Team) -> OracleMemory:
        """Return the memory before the first assignment; a ParameterError where the map has no placement."""
        if self.environment is None or "oracle" not in self.environment.extra:
            told = "the map does not tell the best placement, which only those of the benchmark do"
            raise ParameterError(f"controller {self.name!r}: {told}")
        nowhere = (np.full((1, 2), np.nan),) * len(team)
        return OracleMemory(team, nowhere, np.zeros(len(team), dtype=np.intp))

    def decide(self, seen: Observations, memory: OracleMemory) -> Decision:
        """Return the forces along the ways, which are looked for again now and then."""
        assert self.environment is not None
        plan = _plan(self.environment, float(memory.team.radius.max()) + self.clearance)
        stages = self.environment.extra["oracle"]
        stage = max(k for k, (begin, _, _) in enumerate(stages) if begin <= seen.time + 1e-9)
        if stage != memory.stage or seen.time >= memory.planned + self.period - 1e-9:
            # also for robots on their way: who stands in another one's takes over its goal
            robots = np.array(stages[stage][1], dtype=np.intp)
            inside = find_nearest_inside(plan.configuration_space, seen.positions)
            goals = find_nearest_inside(plan.configuration_space, np.array(stages[stage][2], dtype=float))
            places = inside.copy()
            places[robots] = goals[assigned(plan, inside[robots], goals)]
            routes = tuple(way(plan, at, goal) for at, goal in zip(inside, places, strict=True))
            legs = np.zeros(len(routes), dtype=np.intp)
            memory = replace(memory, stage=stage, routes=routes, legs=legs, planned=seen.time)
        returns, drive = update_returns(seen, memory.returns), (self.k_prop, self.response_time)
        forces, goals, legs = follow_routes(seen, memory.team, memory.routes, memory.legs, returns, *drive)
        return Decision(
            forces, goals, {"attraction": forces}, memory=replace(memory, legs=legs, returns=returns)
        )


def assigned(plan: GeodesicPlanner, places: Array, goals: Array) -> IntArray:
    """Return which goal each robot at (n, 2) places walks to: the sum of the squared ways is least."""
    ways = plan.paths.compute_distances(places, goals)
    ways = np.where(np.isfinite(ways), ways, 1e6)
    return np.asarray(linear_sum_assignment(ways**2)[1])


def way(plan: GeodesicPlanner, place: Array, goal: Array) -> Array:
    """Return the way-points to a goal, (w, 2) m; the place alone where no way leads."""
    path = plan.paths.find_path(place, goal)
    return path[1:] if len(path) > 1 else place[None]


@lru_cache(maxsize=4)
def _plan(environment: Environment, clearance: float) -> GeodesicPlanner:
    return GeodesicPlanner(environment, clearance, _COARSE)
