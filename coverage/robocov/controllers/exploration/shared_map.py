"""Base class of controllers in which robots share their maps and plan for the whole team."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, NamedTuple

import numpy as np
import scipy

from robocov.controllers.base import TIME_TOLERANCE_S, BaseController, Information
from robocov.controllers.driving import update_returns
from robocov.controllers.exploration.route_following import RouteGains, RouteProgress, follow_routes
from robocov.controllers.exploration.scan_exchange import ScanExchange
from robocov.controllers.exploration.visits import NO_TARGETS, Visits, extract_reported_targets
from robocov.controllers.gains import gain, response_time_gain
from robocov.density import Density
from robocov.k_median import run_lloyd
from robocov.observation import Decision, Observations, Scanning
from robocov.observation.region import Region
from robocov.planning.discovered_map import DiscoveredMap
from robocov.planning.goal_candidates import choose_candidates
from robocov.planning.grid_planner import GridPlanner
from robocov.planning.raster import Raster
from robocov.planning.team_placement import UNREACHABLE_M
from robocov.planning.window import Window
from robocov.team import Team
from robocov.typing import BoolArray, FloatArray, IntArray

MIN_CELL_SIZE_M = 0.05
"""Side of the cells of maps; cells are larger in very large regions."""
MAX_MAP_CELLS = 1_000_000
"""Maximum number of cells of a map."""
MAX_SILENCE_S = 5.0
"""Silence after which a robot counts as missing, if it should be within communication range."""
CERTAIN_RANGE_FRACTION = 0.8
"""Fraction of the communication range within which messages of a robot would certainly arrive."""

_REFINEMENT_RADIUS = 1.5
"""Maximum distance of nearby nodes from a chosen candidate, in candidate spacings."""


class Group(NamedTuple):
    """The k robots that a robot plans for: itself and the robots it has received messages from."""

    robots: IntArray
    """(k,) Indices of the robots, ascending."""
    positions: FloatArray
    """(k, 2) m, their known or assumed positions."""
    message_times: FloatArray
    """(k,) s, times of their last messages."""

    @property
    def time(self) -> float:
        """Time at which the robot plans, s. It knows its own position at that time."""
        return float(self.message_times.max())

    @property
    def is_in_range(self) -> BoolArray:
        """Whether the position of each robot is known at present rather than assumed, (k,)."""
        return np.asarray(self.message_times == self.time)

    def has_new_neighbor(self, previous: Group) -> bool:
        """Return whether a robot is in range that was not in range in a previous group."""
        robots_in_range = self.robots[self.is_in_range]
        earlier_robots_in_range = previous.robots[previous.is_in_range]
        return len(np.setdiff1d(robots_in_range, earlier_robots_in_range)) > 0

    def match(self, other: Group) -> tuple[IntArray, IntArray]:
        """Find the robots that are in both of two groups.

        Parameters
        ----------
        other : Group

        Returns
        -------
        rows, other_rows : (j,) int arrays
            Index of each of these robots in this group and in the other one.
        """
        _, rows, other_rows = np.intersect1d(self.robots, other.robots, return_indices=True)
        return rows, other_rows


class RobotLimits(NamedTuple):
    """Limits of a robot that matter for its plans."""

    radius: float
    """m."""
    max_speed: float
    """m/s."""
    sensing_range: float
    """m."""


class Placement(NamedTuple):
    """Goals of a group of robots, and whether they are final."""

    goals: FloatArray
    """(k, 2) m, in the order of the robots of the group."""
    is_final: bool
    """Whether the goals stay the same until the map, the density or the group changes."""
    visits: Visits | None = None
    """The visits to targets on frontiers; None for controllers that do not explore frontiers."""


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """Plan of a robot for its group. Immutable."""

    group: Group
    """The group when the plan was made."""
    placement: Placement
    known_map: DiscoveredMap
    """The map for which it was made."""
    planner: GridPlanner
    density: Density | None

    def add_reported_visits(self, targets: FloatArray) -> Plan:
        """Return the plan together with reported visits to targets, (t, 2) m, that are over."""
        visits = self.placement.visits
        if visits is None or len(targets) == 0:
            return self
        placement = self.placement._replace(visits=visits.add_reported(targets))
        return replace(self, placement=placement)

    def __deepcopy__(self, memo: object) -> Plan:
        # Copies share the object, because it never changes.
        return self


class Situation(NamedTuple):
    """Situation of a robot that plans for k robots: itself and the robots it has received messages from."""

    group: Group
    """The k robots."""
    previous_plan: Plan | None
    known_map: DiscoveredMap
    planner: GridPlanner
    density: Density | None
    limits: RobotLimits
    """Limits of the robot that plans."""

    @property
    def positions(self) -> FloatArray:
        """Known or assumed positions of the robots, (k, 2) m."""
        return self.group.positions

    @property
    def previous_goals(self) -> FloatArray:
        """Goals of the robots in the last plan, (k, 2) m; nan for robots without one."""
        goals = np.full(self.positions.shape, np.nan)
        if self.previous_plan is not None:
            rows, previous_rows = self.group.match(self.previous_plan.group)
            goals[rows] = self.previous_plan.placement.goals[previous_rows]
        return goals

    def compute_weights(self, is_counted: BoolArray) -> FloatArray:
        """Compute the weights of the nodes of the planner.

        Parameters
        ----------
        is_counted : (rows, columns) bool array
            Which cells of the map count.

        Returns
        -------
        (m,) array
            Number of counted cells that each node represents, times the density. 0 for nodes that no robot
            can reach.
        """
        map_window = self.planner.map_window
        weights = map_window.sum_by_node(map_window.window.crop(is_counted, fill=False))
        weights = weights * np.isfinite(self.planner.compute_distances_from(self.positions))
        if self.density is not None and not self.density.is_uniform:
            weights = weights * self.density.evaluate(map_window.nodes)
        return np.asarray(weights, dtype=np.float64)


class Candidates(NamedTuple):
    """Candidate positions for the goals of a plan, with a table of distances for `robocov.k_median`."""

    positions: FloatArray
    """(c, 2) m, the candidate positions."""
    table: FloatArray
    """(m, c) Weighted distances from the m nodes that count in the cost to the candidates."""

    @classmethod
    def build_at_nodes(cls, situation: Situation, weights: FloatArray, nodes: IntArray) -> Candidates:
        """Build a candidate at each of the given nodes whose weight is positive.

        Parameters
        ----------
        situation : Situation
        weights : (m,) array
            Weights of all nodes, from `Situation.compute_weights`.
        nodes : (c,) int array
            Nodes at which there may be candidates.

        Returns
        -------
        Candidates
        """
        targets = np.flatnonzero(weights > 0.0)
        nodes = nodes[weights[nodes] > 0.0]
        distances = situation.planner.graph.compute_distance_table(nodes)[:, targets]
        table = (np.minimum(distances, UNREACHABLE_M) * weights[targets]).T
        return cls(positions=situation.planner.map_window.nodes[nodes], table=np.ascontiguousarray(table))

    @classmethod
    def build_spread_out(cls, situation: Situation, weights: FloatArray) -> Candidates:
        """Build candidates that are spread over the nodes with clearance and a positive weight.

        Parameters
        ----------
        situation : Situation
        weights : (m,) array
            Weights of all nodes, from `Situation.compute_weights`.

        Returns
        -------
        Candidates
        """
        planner = situation.planner
        nodes = choose_candidates(planner.graph, planner.map_window.has_clearance)
        return cls.build_at_nodes(situation, weights, nodes)

    def compute_cost(self, chosen: IntArray) -> float:
        """Compute the coverage cost with a robot at each of the chosen candidates, (k,)."""
        return float(self.table[:, chosen].min(axis=1).sum())

    def assign_to_positions(self, positions: FloatArray) -> IntArray:
        """Assign a different candidate to each position so that the sum of squared distances is minimal.

        Parameters
        ----------
        positions : (k, 2) array, m
            At most as many as there are candidates.

        Returns
        -------
        (k,) int array
            Index of the candidate of each position.
        """
        squared_distances = ((positions[:, None] - self.positions) ** 2).sum(axis=2)
        _, candidates = scipy.optimize.linear_sum_assignment(squared_distances)
        return np.asarray(candidates, dtype=np.intp)

    def refine(self, situation: Situation, weights: FloatArray, chosen: IntArray) -> FloatArray:
        """Improve positions at candidates by Lloyd's iteration on all nodes near them.

        Parameters
        ----------
        situation : Situation
        weights : (m,) array
            Weights of all nodes, from `Situation.compute_weights`.
        chosen : (k,) int array
            Indices of candidates.

        Returns
        -------
        (k, 2) array, m
            Positions of nodes.
        """
        map_window = situation.planner.map_window
        positions = self.positions[chosen]
        # Candidate spacing, estimated from the ratio of nodes to candidates.
        spacing = map_window.spacing * math.sqrt(np.count_nonzero(weights) / len(self.positions))
        squared_distances = ((map_window.nodes[:, None] - positions) ** 2).sum(axis=2).min(axis=1)
        is_close = map_window.has_clearance & (squared_distances < (_REFINEMENT_RADIUS * spacing) ** 2)
        fine = Candidates.build_at_nodes(situation, weights, np.flatnonzero(is_close))
        return fine.positions[run_lloyd(fine.table, fine.assign_to_positions(positions))]


def assign_goals(situation: Situation, goals: FloatArray) -> FloatArray:
    """Assign goals to robots so that the sum of the squared path lengths is minimal.

    The assignment stays the same while robots move along straight paths.

    Parameters
    ----------
    situation : Situation
    goals : (k, 2) array, m

    Returns
    -------
    (k, 2) array, m
        The goals in the order of the robots.
    """
    planner = situation.planner
    nodes = [planner.visibility.find_nearest_node(goal) for goal in goals]
    distances = np.array(
        [planner.compute_distances_from(position[None])[nodes] for position in situation.positions]
    )
    _, assignment = scipy.optimize.linear_sum_assignment(np.minimum(distances, UNREACHABLE_M) ** 2)
    return np.asarray(goals[assignment])


@dataclass(frozen=True, slots=True, eq=False)
class SharedMapMemory:
    """Memory of all robots of a team. Row or entry i belongs to robot i alone."""

    team: Team
    """The robots. Each robot knows only its own body and limits."""
    exchange: ScanExchange
    """The scans of each robot, its own and those that have arrived from others, and their map."""
    plans: tuple[Plan | None, ...]
    """The last plan of each robot; None before the first one."""
    routes: tuple[FloatArray, ...]
    """Waypoints of each robot, (w, 2) m. The last one is its goal. Empty before the first plan."""
    waypoint_indices: IntArray
    """(n,) Index, in its route, of the waypoint that each robot heads for."""
    reported_targets: tuple[FloatArray, ...]
    """For each robot, targets, (t, 2) m, of visits that others have reported as over since its last plan.
    Visits that the robot already knew to be over are left out."""
    next_plan_time: float = -math.inf
    """Time at which all robots plan next, s."""
    returns: FloatArray | None = None
    """(n, rays, 2) m, obstacle points in the last scan of each robot; nan for none."""

    @property
    def maps(self) -> tuple[DiscoveredMap, ...]:
        """The map of each robot when it last planned, from its own scans and those of others."""
        return self.exchange.maps


@dataclass(frozen=True)
class SharedMapController(BaseController):
    """Base class of controllers in which each robot plans for itself and the robots it knows from messages.

    Robots scan twice a second, and send each other their scans (see the module `scan_exchange`): 542 bytes
    for each scan, and with six robots 81 bytes for a digest of the scans that a robot has. Every `period`
    seconds, each robot makes a plan on the map of the scans that it has, and follows the shortest route to
    its own goal in that plan. Robots with the same knowledge make the same plan. A robot that is out of
    range is assumed to be at its goal, and is removed from the plan if no message arrives from it there. With
    short communication ranges plans differ, and two robots may move to the same position until they are in
    range of each other.
    """

    information: ClassVar[Information] = "shared map"
    scanning = Scanning(rays=240, period=0.5)

    period: float = gain(2.0, "s", "time between two plans", low=0.05, high=60.0)
    nodes: float = gain(
        1600.0, "nodes", "maximum number of nodes of the planning lattice", low=16.0, high=1e5, whole=True
    )
    clearance: float = gain(0.03, "m", "margin between robots and walls along paths", high=10.0)
    k_prop: float = gain(2.0, "1/s", "desired speed per meter of distance to the goal", high=100.0)
    response_time: float = response_time_gain()

    @abstractmethod
    def compute_placement(self, situation: Situation) -> Placement:
        """Compute the goals of the robots of a group. Subclasses implement this method.

        It is called when a robot plans, unless its last plan is final and still valid.

        Parameters
        ----------
        situation : Situation
            Positions of the k robots of the group, and the map on which to plan.

        Returns
        -------
        Placement
            Goals of the k robots, in the order of their positions.
        """

    def begin(self, region: Region, team: Team) -> SharedMapMemory:
        """Return the initial memory, with no walls or other robots known."""
        n = len(team)
        return SharedMapMemory(
            team=team,
            # A radius of None: only the cells that rays cross are marked free.
            exchange=ScanExchange.build_empty(build_unknown_map(region), n, robot_radii=[None] * n),
            plans=(None,) * n,
            routes=(),
            waypoint_indices=np.zeros(n, dtype=np.intp),
            reported_targets=(NO_TARGETS,) * n,
        )

    def decide(self, seen: Observations, memory: SharedMapMemory) -> Decision:
        """Compute the forces along the routes to the robots' own goals in their plans."""
        exchange = memory.exchange.receive(seen)
        if seen.messages:
            memory = replace(memory, reported_targets=_collect_reported_targets(seen, memory))
        # Scans arrive one step after they are taken, so robots plan one step after each scan.
        if exchange.has_scans and seen.time >= memory.next_plan_time - TIME_TOLERANCE_S:
            exchange = exchange.update_maps(range(len(seen.positions)))
            memory = self._plan_routes(seen, replace(memory, exchange=exchange))
            # Robots may report visits after they have planned.
            exchange = memory.exchange
        if seen.scans is not None:
            exchange = exchange.add_scans(seen, seen.scans)
        exchange, messages = exchange.send(seen)
        # Before the first plan, robots stay where they are.
        routes = memory.routes or tuple(seen.positions[:, None])
        returns = update_returns(seen, memory.returns)
        command = follow_routes(
            seen,
            memory.team,
            RouteProgress(routes, memory.waypoint_indices),
            returns,
            RouteGains(self.k_prop, self.response_time),
        )
        return Decision(
            forces=command.forces,
            goals=command.goals,
            terms={"attraction": command.forces},
            memory=replace(
                memory, exchange=exchange, waypoint_indices=command.waypoint_indices, returns=returns
            ),
            messages=messages,
        )

    def _plan_routes(self, seen: Observations, memory: SharedMapMemory) -> SharedMapMemory:
        """Return the memory with new plans and with the routes of all robots to their goals."""
        plans = self._make_plans(seen, memory)
        routes = []
        for robot, plan in enumerate(plans):
            # A plan has a goal for each robot of its group, whose indices are in ascending order.
            own_row = np.searchsorted(plan.group.robots, robot)
            own_goal = plan.placement.goals[own_row]
            routes.append(plan.planner.find_route(seen.positions[robot], own_goal))
        return replace(
            memory,
            exchange=_add_visit_reports(seen, memory, plans),
            plans=plans,
            routes=tuple(routes),
            waypoint_indices=np.zeros_like(memory.waypoint_indices),
            reported_targets=(NO_TARGETS,) * len(plans),
            next_plan_time=seen.time + self.period,
        )

    def _make_plans(self, seen: Observations, memory: SharedMapMemory) -> tuple[Plan, ...]:
        """Return the plan of each robot; robots with the same knowledge share one."""
        plans: list[Plan] = []
        plans_by_knowledge: dict[tuple[object, ...], Plan] = {}
        for robot, previous_plan in enumerate(memory.plans):
            known_map = memory.maps[robot]
            group = _build_group(seen, memory.team, previous_plan, robot)
            limits = RobotLimits(
                radius=float(memory.team.radius[robot]),
                max_speed=float(memory.team.max_speed[robot]),
                sensing_range=float(memory.team.sensing_range[robot]),
            )
            reported_targets = memory.reported_targets[robot]
            arrays = tuple(column.tobytes() for column in (*group, reported_targets))
            key = (id(known_map), id(previous_plan), limits, *arrays)
            if key not in plans_by_knowledge:
                informed_plan = previous_plan
                if informed_plan is not None:
                    informed_plan = informed_plan.add_reported_visits(reported_targets)
                plans_by_knowledge[key] = self._make_plan(seen, known_map, informed_plan, group, limits)
            plans.append(plans_by_knowledge[key])
        return tuple(plans)

    def _make_plan(
        self,
        seen: Observations,
        known_map: DiscoveredMap,
        previous_plan: Plan | None,
        group: Group,
        limits: RobotLimits,
    ) -> Plan:
        """Return the plan of a robot for its group.

        A final plan that is still valid is returned with the current positions of the group.
        """
        if previous_plan is not None and _is_still_valid(previous_plan, known_map, seen.density, group):
            return replace(previous_plan, group=group)
        window = Window.build_around(known_map.raster, group.positions[0], math.inf, int(self.nodes))
        if previous_plan is None:
            planner = GridPlanner(known_map, window, limits.radius + self.clearance)
        else:
            planner = previous_plan.planner
        planner = planner.update(known_map, window)
        situation = Situation(
            group=group,
            previous_plan=previous_plan,
            known_map=known_map,
            planner=planner,
            density=seen.density,
            limits=limits,
        )
        return Plan(
            group=group,
            placement=self.compute_placement(situation),
            known_map=known_map,
            planner=planner,
            density=seen.density,
        )


def build_unknown_map(region: Region) -> DiscoveredMap:
    """Build the map of a robot that has not seen anything of a region yet."""
    low_x, low_y, high_x, high_y = region.bounds
    cell_size = max(MIN_CELL_SIZE_M, math.sqrt((high_x - low_x) * (high_y - low_y) / MAX_MAP_CELLS))
    return DiscoveredMap.build_unknown(Raster(region, cell_size))


def _is_still_valid(plan: Plan, known_map: DiscoveredMap, density: Density | None, group: Group) -> bool:
    """Return whether a plan is final, and was made for this map, density and group."""
    return (
        plan.placement.is_final
        and plan.known_map is known_map
        and plan.density is density
        and np.array_equal(group.robots, plan.group.robots)
    )


def _build_group(seen: Observations, team: Team, previous_plan: Plan | None, robot: int) -> Group:
    """Return the group of a robot: itself, its neighbors, and some robots that are out of range.

    A robot that is out of range is assumed to be at its goal in the previous plan. It stays in the group
    unless it has been silent for long although it would certainly be in range there.
    """
    position = seen.positions[robot : robot + 1]
    robots = np.append(seen.neighbors.list_neighbors(robot), robot)
    positions = np.vstack([seen.get_neighbor_positions(robot), position])
    message_times = np.full(len(robots), seen.time)
    if previous_plan is not None:
        previous = previous_plan.group
        goals = previous_plan.placement.goals
        distance = np.sqrt(((goals - position) ** 2).sum(axis=1))
        is_silent = seen.time - previous.message_times > MAX_SILENCE_S
        is_close = distance < CERTAIN_RANGE_FRACTION * team.communication_range[robot]
        is_neighbor = np.isin(previous.robots, robots)
        is_assumed = ~(is_neighbor | (is_silent & is_close))
        robots = np.concatenate([robots, previous.robots[is_assumed]])
        positions = np.vstack([positions, goals[is_assumed]])
        message_times = np.concatenate([message_times, previous.message_times[is_assumed]])
    order = np.argsort(robots)
    return Group(robots=robots[order], positions=positions[order], message_times=message_times[order])


def _collect_reported_targets(seen: Observations, memory: SharedMapMemory) -> tuple[FloatArray, ...]:
    """Return the reported targets of each robot, including new ones in the reports of this step."""
    collected = []
    for robot, (plan, earlier_targets) in enumerate(zip(memory.plans, memory.reported_targets, strict=True)):
        targets = extract_reported_targets(seen, robot)
        visits = None if plan is None else plan.placement.visits
        if visits is not None and len(targets) > 0:
            new_targets = visits.select_new(targets)
            # Without repetitions and in ascending order, whichever report arrived first: robots with equal
            # knowledge share one plan.
            collected.append(np.unique(np.vstack([earlier_targets, new_targets]), axis=0))
        else:
            collected.append(earlier_targets)
    return tuple(collected)


def _add_visit_reports(seen: Observations, memory: SharedMapMemory, plans: Sequence[Plan]) -> ScanExchange:
    """Return the exchange with outgoing reports of the visits that are over in the new plans.

    While all robots are in range of each other, they make the same plans unless messages are lost or late.
    They then send reports only after a robot has come into range.
    """
    exchange = memory.exchange
    for robot, (previous_plan, plan) in enumerate(zip(memory.plans, plans, strict=True)):
        visits = plan.placement.visits
        # In a first plan, no visit is over.
        if previous_plan is None or visits is None or not visits.is_over.any():
            continue
        neighbors = seen.neighbors.list_neighbors(robot).tolist()
        is_team_in_range = len(neighbors) == len(plans) - 1 and exchange.neighbors_reach_all(robot, neighbors)
        if not is_team_in_range or plan.group.has_new_neighbor(previous_plan.group):
            exchange = exchange.add_message(robot, visits.build_report())
    return exchange
