"""Shared base of laws that plan for their team on a map that all who hear each other share."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import ClassVar, NamedTuple, TypeAlias

import numpy as np
import scipy

from robocov.arrays import Array, BoolArray, IntArray
from robocov.controllers.base import Information, Law
from robocov.controllers.driving import update_returns
from robocov.controllers.gains import gain, response_time_gain
from robocov.controllers.route_following import follow_routes
from robocov.density import Density
from robocov.k_median import run_lloyd
from robocov.observation import Decision, Observations, Scanning, Scans
from robocov.observation.neighbours import Neighbours
from robocov.observation.region import Region
from robocov.planning.discovered_map import DiscoveredMap
from robocov.planning.grid_planner import GridPlanner
from robocov.planning.raster import Raster
from robocov.planning.window import Window
from robocov.team import Team

FINEST_CELL, MOST_CELLS = 0.05, 1_000_000  # side of a cell of the maps, m, larger in very large regions

_FAR = 1e9  # metres that stand for "there is no way"
_MISSED, _IN_RANGE = 5.0, 0.8  # who is silent for so many seconds where it would be, to so much of the range


class Group(NamedTuple):
    """The k robots that one plans for: itself and those that it has heard."""

    robots: IntArray  # their numbers, ascending
    at: Array  # where they are, or are presumed to be, (k, 2) m
    heard: Array  # when they were heard, s


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """Plan of a robot for its group. Immutable."""

    group: Group  # as it was then
    places: Array  # where they are to go, (k, 2) m
    final: bool  # whether it stays as long as map, φ and robots stay the same
    notes: Array  # what the law has noted, (m, 2) m
    known: DiscoveredMap  # the map that it was made on
    ways: GridPlanner
    density: Density | None

    def __deepcopy__(self, memo: object) -> Plan:
        return self


class Situation(NamedTuple):
    """Situation of a robot that plans for k robots, itself and those that it has heard."""

    at: Array  # where they are, or are presumed to be, (k, 2) m
    begin: Array  # where they were to go by the last plan, (k, 2) m; nan for who was not in it
    former: Plan | None  # the last plan
    known: DiscoveredMap
    ways: GridPlanner
    density: Density | None
    reach: float  # the robot's sensing range, m

    def weights(self, cells: BoolArray) -> Array:
        """Return the number of these cells that each node stands for, times φ, (m,); 0 where no way leads."""
        weights = self.ways.sum_by_node(self.ways.window.crop(cells, False))
        weights = weights * np.isfinite(self.ways.compute_distances_from(self.at))
        if self.density is not None and not self.density.is_uniform:
            weights = weights * self.density.evaluate(self.ways.nodes)
        return np.asarray(weights, dtype=np.float64)


class Candidates(NamedTuple):
    """Places that a plan chooses among, with what `robocov.k_median` wants."""

    places: Array  # (c, 2) m
    table: Array  # (m, c) distances from what is to be covered, weighted

    @classmethod
    def at_nodes(cls, now: Situation, weights: Array, nodes: IntArray) -> Candidates:
        """Return those of some nodes that a way leads to, for the weights of all nodes."""
        target, nodes = np.flatnonzero(weights > 0.0), nodes[weights[nodes] > 0.0]
        away = np.minimum(now.ways.compute_distance_table(nodes)[:, target], _FAR)
        return cls(now.ways.nodes[nodes], np.ascontiguousarray((away * weights[target]).T))

    def total(self, chosen: IntArray) -> float:
        """Return the cost of some."""
        return float(self.table[:, chosen].min(axis=1).sum())

    def nearest(self, places: Array) -> IntArray:
        """Return one for each of (k, 2) places, no two the same: those nearest on the whole."""
        square = ((places[:, None] - self.places) ** 2).sum(axis=2)
        return np.asarray(scipy.optimize.linear_sum_assignment(square)[1], dtype=np.intp)

    def refined(self, now: Situation, weights: Array, chosen: IntArray) -> Array:
        """Return the places, (k, 2) m, to which Lloyd's iteration leads among the nodes near the chosen."""
        ways, places = now.ways, self.places[chosen]
        apart = ways.spacing * math.sqrt(np.count_nonzero(weights) / len(self.places))
        square = ((ways.nodes[:, None] - places) ** 2).sum(axis=2).min(axis=1)
        fine = Candidates.at_nodes(
            now, weights, np.flatnonzero(ways.is_roomy & (square < (1.5 * apart) ** 2))
        )
        return fine.places[run_lloyd(fine.table, fine.nearest(places))]


def assigned(now: Situation, places: Array) -> Array:
    """Return the places in the order of the robots, (k, 2) m: the squared ways to them are the least in sum.

    That stays so on the way, as far as ways are straight.
    """
    nodes = [now.ways.find_nearest_node(place) for place in places]
    away = np.array([now.ways.compute_distances_from(at[None])[nodes] for at in now.at])
    return np.asarray(places[scipy.optimize.linear_sum_assignment(np.minimum(away, _FAR) ** 2)[1]])


@dataclass(frozen=True, slots=True, eq=False)
class SharedMapMemory:
    """Memory of the robots."""

    team: Team  # a robot knows its own limits
    maps: tuple[DiscoveredMap, ...]  # what each has discovered, or has been told
    plans: tuple[Plan | None, ...]
    routes: tuple[Array, ...]  # the way-points of each, (w, 2) m, the last one the goal
    legs: IntArray  # (n,), the way-point that is headed for
    due: float = -math.inf  # when they plan next, s
    returns: Array | None = None  # (n, rays, 2) m, what the last scan of each met


@dataclass(frozen=True)
class SharedMapLaw(Law):
    """Base class of laws by which each robot plans for itself and all that it hears on the map they share.

    Robots scan and merge their maps with those of whom they hear (`DiscoveredMap`). Once in `period` seconds
    all plan: who knows the same makes the same plan, and goes to its own place in it by the shortest way. Who
    is not heard any more is presumed to be where it was to go, and forgotten when it is missed there; with
    short ranges plans differ, and two robots may go to the same place until they hear each other.
    """

    information: ClassVar[Information] = "shared map"
    scanning = Scanning(rays=240, period=0.5)

    period: float = gain(2.0, "s", "between two plans", low=0.05, high=60.0)
    nodes: float = gain(1600.0, "nodes", "of the lattice of ways, at most", low=16.0, high=1e5, whole=True)
    clearance: float = gain(0.03, "m", "that routes keep between rim and walls", high=10.0)
    k_prop: float = gain(2.0, "1/s", "wanted speed per metre of distance to the goal", high=100.0)
    response_time: float = response_time_gain()

    @abstractmethod
    def placed(self, now: Situation) -> tuple[Array, bool, Array]:
        """Return where the robots are to go, (k, 2) m, whether that is final, and notes for the next plan."""

    def begin(self, region: Region, team: Team) -> SharedMapMemory:
        """Return the memory of robots that have seen nothing yet."""
        low_x, low_y, high_x, high_y = region.bounds
        cell = max(FINEST_CELL, math.sqrt((high_x - low_x) * (high_y - low_y) / MOST_CELLS))
        n, nothing = len(team), DiscoveredMap.build_unknown(Raster(region, cell))
        return SharedMapMemory(team, (nothing,) * n, (None,) * n, (), np.zeros(n, dtype=np.intp))

    def decide(self, seen: Observations, memory: SharedMapMemory) -> Decision:
        """Return the forces along the ways to the robots' own places in their plans."""
        team, scans = memory.team, seen.scans
        if scans is not None:
            maps = surveyed(memory.maps, seen, scans, circles(seen.neighbours))
            memory = replace(memory, maps=tuple(maps))
        if seen.time >= memory.due - 1e-9:
            plans = self._plans(seen, memory)
            own = [plan.places[np.searchsorted(plan.group.robots, i)] for i, plan in enumerate(plans)]
            each_own = zip(plans, seen.positions, own, strict=True)
            routes = tuple(plan.ways.find_route(at, place) for plan, at, place in each_own)
            legs, due = np.zeros_like(memory.legs), seen.time + self.period
            memory = replace(memory, plans=plans, routes=routes, legs=legs, due=due)
        returns, drive = update_returns(seen, memory.returns), (self.k_prop, self.response_time)
        forces, goals, legs = follow_routes(seen, team, memory.routes, memory.legs, returns, *drive)
        after = replace(memory, legs=legs, returns=returns)
        return Decision(forces, goals, {"attraction": forces}, memory=after)

    def _plans(self, seen: Observations, memory: SharedMapMemory) -> tuple[Plan, ...]:
        """Return the plan of each robot; those who know the same share one."""
        plans: list[Plan] = []
        made: dict[tuple[object, ...], Plan] = {}
        team = memory.team
        for i, former in enumerate(memory.plans):
            known, group = memory.maps[i], _group(seen, team, former, i)
            sizes = float(team.radius[i]), float(team.sensing_range[i])
            key = (id(known), id(former), *sizes, *(each.tobytes() for each in group))
            if key not in made:
                made[key] = self._plan(seen, known, former, group, *sizes)
            plans.append(made[key])
        return tuple(plans)

    def _plan(
        self, seen: Observations, known: DiscoveredMap, former: Plan | None, group: Group,
        radius: float, reach: float,
    ) -> Plan:  # fmt: skip
        """Return a plan of a robot with this radius and sensing range, m."""
        begin = np.full(group.at.shape, np.nan)
        if former is not None:
            same = former.known is known and former.density is seen.density
            if former.final and same and np.array_equal(group.robots, former.group.robots):
                return replace(former, group=group)
            _, here, there = np.intersect1d(group.robots, former.group.robots, return_indices=True)
            begin[here] = former.places[there]
        window = Window.build_around(known.raster, group.at[0], math.inf, int(self.nodes))
        ways = GridPlanner(known, window, radius + self.clearance) if former is None else former.ways
        ways = ways.update(known, window)
        now = Situation(group.at, begin, former, known, ways, seen.density, reach)
        return Plan(group, *self.placed(now), known, ways, seen.density)


Circle: TypeAlias = tuple[int, ...]
"""A robot and those that it hears, ascending."""


def circles(neighbours: Neighbours) -> list[Circle]:
    """Return the circle of each robot."""
    if neighbours.is_complete:
        return [tuple(range(neighbours.count))] * neighbours.count
    return [tuple(sorted({i, *neighbours.list_neighbours(i).tolist()})) for i in range(neighbours.count)]


def surveyed(
    maps: Sequence[DiscoveredMap], seen: Observations, scans: Scans, around: Sequence[Circle]
) -> list[DiscoveredMap]:
    """Return the maps after a scan of each robot, told to those in its circle.

    Robots that all hear each other share one map, into which all scans go, and where the last one counts:
    maps that are merged time and again would keep what one of them has mistaken.
    """
    every = list(zip(seen.positions, scans.distances, scans.hit, strict=True))
    own = cache(lambda i: maps[i].add_scan(*every[i]))
    together, sizes, later = dict[Circle, DiscoveredMap](), Counter(around), []
    for i, circle in enumerate(around):
        if sizes[circle] < len(circle):
            later.append(own(i).merge(own(k) for k in circle if k != i))
            continue
        if circle not in together:
            one = maps[i].merge(maps[k] for k in circle if maps[k] is not maps[i])
            for k in circle:
                one = one.add_scan(*every[k])
            together[circle] = one
        later.append(together[circle])
    return later


def _group(seen: Observations, team: Team, former: Plan | None, i: int) -> Group:
    """Return for whom robot i plans."""
    place = seen.positions[i : i + 1]
    robots = np.append(seen.neighbours.list_neighbours(i), i)
    at, heard = np.vstack([seen.get_neighbour_positions(i), place]), np.full(len(robots), seen.time)
    if former is not None:
        away = np.sqrt(((former.places - place) ** 2).sum(axis=1))
        late = seen.time - former.group.heard > _MISSED
        missed = late & (away < _IN_RANGE * team.communication_range[i])
        silent = ~(np.isin(former.group.robots, robots) | missed)
        robots = np.concatenate([robots, former.group.robots[silent]])
        at = np.vstack([at, former.places[silent]])
        heard = np.concatenate([heard, former.group.heard[silent]])
    order = np.argsort(robots)
    return Group(robots[order], at[order], heard[order])
