"""Lloyd's algorithm on geodesic cells, by robots that know the whole map: the informed upper bound."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon

from robocov.arrays import Array
from robocov.controllers.base import BaseController
from robocov.controllers.driving import compute_approach_velocities, compute_drive_forces
from robocov.controllers.gains import gain, response_time_gain
from robocov.cost import CoverageCost
from robocov.environment import Environment, PolygonObstacle
from robocov.errors import ParameterError
from robocov.geodesic import Geodesics
from robocov.observation import Decision, Observations
from robocov.observation.region import Region
from robocov.optimum import find_nearest_inside
from robocov.team import Team

_SEGMENTS = 2  # edges of a quarter circle around corners of walls: they cut 8 % of the clearance off it
_SIMPLER = 0.005  # metres by which the walls of the room may be simplified: every corner costs time


@dataclass(frozen=True, slots=True, eq=False)
class GeodesicMemory:
    """Memory of the last planning."""

    team: Team
    goals: Array | None = None  # (n, 2) m
    way: Array | None = None  # (n, 2) m, the first way-points to them
    beyond: Array | None = None  # (n,) m, lengths of the ways from there
    planned: float = -np.inf  # s


@dataclass(frozen=True)
class GeodesicLloyd(BaseController):
    """Lloyd's algorithm with geodesic Voronoi cells of the known map.

    Pimenta et al. (CDC 2008) and Bhattacharya, Ghrist and Kumar (IJRR 33, 2014) descend the cost with the
    length d of the shortest way in place of the straight distance: the gradient for f(d) points, for
    each place q of the robot's geodesic cell, along the first piece of the way to it, by f'(d). For
    f = d^s with 1 <= s <= 2 the function of the robot's place is bounded from above by a paraboloid
    around the first way-point c of q, with weight d^(s-1) / |c - p|. The goal is the lowest point of the
    sum of these: the weighted mean of the first way-points, which never raises the cost, and is the
    centroid where s = 2 and nothing is in the way, a step of Weiszfeld's for s = 1, the cost (22). A
    density of the map weighs the places.

    Distances are exact, the cell is sampled on a lattice. A goal is moved into the room that walls
    widened by radius and `clearance` leave, and the robots go there by its shortest ways.

    It knows the whole map from the beginning, which no other law does: a bound, not a rival. Taken from
    what is generally known of the two papers, not from their text; the papers' cells are those of a grid.
    """

    name = "geodesic-lloyd"
    label = "Geodesic Lloyd"
    summary = "Lloyd's algorithm with geodesic cells, knowing the whole map (Pimenta 2008, Bhattacharya 2014)"
    information = "whole map"

    exponent: float = gain(2.0, "1", "s: f = d^s; 2 as in the papers, 1 the cost (22)", low=1.0, high=2.0)
    lattice: float = gain(48.0, "cells", "of the lattice along a side", low=4.0, high=512.0, whole=True)
    clearance: float = gain(0.03, "m", "distance that ways keep from walls, beyond the radius", high=10.0)
    period: float = gain(0.2, "s", "time from one planning to the next", high=60.0)
    k_prop: float = gain(2.0, "1/s", "wanted speed per metre of way to the goal", high=100.0)
    response_time: float = response_time_gain()
    environment: Environment | None = field(default=None, repr=False, compare=False)

    def inform(self, environment: Environment) -> GeodesicLloyd:
        """Return the same law with the map."""
        return replace(self, environment=environment)

    def begin(self, region: Region, team: Team) -> GeodesicMemory:
        """Return what the robots know of themselves; a ParameterError when no robot fits into the map."""
        self._plan(team)
        return GeodesicMemory(team)

    def decide(self, seen: Observations, memory: GeodesicMemory) -> Decision:
        team = memory.team
        if memory.way is None or not memory.planned <= seen.time < memory.planned + self.period - 1e-9:
            goals, way, beyond = self._plan(team).ways(seen, self.exponent)
            memory = GeodesicMemory(team, goals, way, beyond, seen.time)
        assert memory.way is not None and memory.beyond is not None
        offset = memory.way - seen.positions
        distance = np.hypot(*offset.T)
        speed = np.minimum(self.k_prop * (distance + memory.beyond), team.max_speed)
        # the last metre before a way-point that is not the goal is not slower than the others
        speed = np.minimum(speed, distance / self.response_time)
        forces = compute_drive_forces(
            compute_approach_velocities(offset, np.inf, speed), seen, team, self.response_time
        )
        return Decision(forces, memory.goals, {"attraction": forces}, memory=memory)

    def _plan(self, team: Team) -> Plan:
        if self.environment is None:
            told = "it has not been told the map; inform(environment) was wanted"
            raise ParameterError(f"controller {self.name!r}: {told}")
        return _cached(self.environment, float(team.radius.max()) + self.clearance, int(self.lattice))


class Plan:
    """The map as robots see it whose centres keep a clearance (m) from the walls; immutable.

    It has the `cost` that is descended, the `room` where centres may be, and the shortest `paths` in there.
    """

    def __init__(self, environment: Environment, clearance: float, lattice: int) -> None:
        room = environment.free.buffer(-clearance, quad_segs=_SEGMENTS).simplify(_SIMPLER)
        if room.is_empty:
            told = f"no room for robots that keep {clearance:g} m from its walls"
            raise ParameterError(f"map {environment.name!r} has {told}")
        walls = environment.region.polygon.difference(room)
        solid = tuple(_obstacle(part) for part in shapely.get_parts(walls) if isinstance(part, Polygon))
        ring = tuple((x, y) for x, y in environment.region.vertices.tolist())
        inner = Environment(environment.name, ring, solid)
        self.cost, self.paths = CoverageCost(environment, lattice), Geodesics(inner)
        self.room: MultiPolygon = inner.free
        shapely.prepare(self.room)

    def ways(self, seen: Observations, exponent: float) -> tuple[Array, Array, Array]:
        """Return each robot's goal and the first way-point to it, (n, 2) m, and the way left, (n,) m."""
        places = find_nearest_inside(self.room, seen.positions)
        if seen.neighbours.is_complete:
            goals = self._goals(places, exponent)
        else:
            goals = np.empty_like(places)
            for i in range(len(places)):
                heard = find_nearest_inside(self.room, seen.get_neighbour_positions(i))
                goals[i] = self._goals(np.vstack([places[i], heard]), exponent)[0]
        way, beyond = goals.copy(), np.zeros(len(goals))
        lines = shapely.linestrings(np.stack([places, goals], axis=1))
        for i in np.flatnonzero(~shapely.covers(self.room, lines)).tolist():
            path = self.paths.find_path(places[i], goals[i])
            if len(path) < 2:
                goals[i] = way[i] = places[i]  # in another room
                continue
            way[i] = path[1]
            beyond[i] = np.hypot(*np.diff(path[1:], axis=0).T).sum()
        return goals, way, beyond

    def _goals(self, places: Array, exponent: float) -> Array:
        """Return the goals of robots at (k, 2) places."""
        result = self.cost(places)
        site = np.flatnonzero(result.owner >= 0)
        owner, first, distance = result.owner[site], result.first_waypoints[site], result.distances[site]
        # a site under the robot would hold it fast
        step = np.maximum(np.hypot(*(first - places[owner]).T), 0.25 * self.cost.spacing)
        weight = np.maximum(distance, step) ** (exponent - 1.0) / step
        if result.weights is not None:
            weight *= result.weights[site]
        n = len(places)
        total = np.bincount(owner, weight, minlength=n)
        goals = np.column_stack([np.bincount(owner, weight * part, minlength=n) for part in first.T])
        held = total > 0.0
        goals = np.where(held[:, None], goals / np.where(held, total, 1.0)[:, None], places)
        return find_nearest_inside(self.room, np.asarray(goals))


def _obstacle(part: Polygon) -> PolygonObstacle:
    outer, *holes = (tuple(map(tuple, ring.coords[:-1])) for ring in (part.exterior, *part.interiors))
    return PolygonObstacle(outer, tuple(holes))


# a plan takes long, and memories of robots must not hold it
_cached = lru_cache(maxsize=8)(Plan)
