"""Atlas: each robot plans the placement of its team on the map that it has discovered itself.

Equation numbers refer to Renzaglia and Martinelli, "Distributed Coverage Control for a Multi-Robot Team in a
Non-Convex Environment".
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from robocov.controllers.base import TIME_TOLERANCE_S, BaseController
from robocov.controllers.driving import update_returns
from robocov.controllers.exploration.atlas_memory import (
    AtlasMemory,
    OwnMotion,
    PlanBasis,
    PlannerState,
    TeamKnowledge,
    TraveledPath,
)
from robocov.controllers.exploration.jams import plan_evasion
from robocov.controllers.exploration.localization import (
    Estimates,
    assume_closer_neighbors,
    estimate_positions,
)
from robocov.controllers.exploration.route_following import RouteGains, RouteProgress, follow_routes
from robocov.controllers.exploration.scan_exchange import ScanExchange
from robocov.controllers.exploration.shared_map import build_unknown_map
from robocov.controllers.exploration.staggering import compute_stagger_fraction
from robocov.controllers.exploration.team_goals import Cooperation, compute_team_goals
from robocov.controllers.exploration.team_knowledge import (
    MAX_PLANNING_GROUP,
    OtherRobots,
    list_others,
    update_knowledge,
)
from robocov.controllers.exploration.teammates import TeammateReport, Teammates
from robocov.controllers.gains import gain, response_time_gain
from robocov.density import Density
from robocov.observation import Decision, Message, Observations, Scanning
from robocov.observation.region import Region
from robocov.planning.discovered_map import DiscoveredMap
from robocov.planning.grid_planner import GridPlanner
from robocov.planning.node_visibility import NO_NODE
from robocov.planning.own_goal import OwnGoal, find_own_goal
from robocov.planning.team_placement import MinSavings, compute_node_weights
from robocov.planning.viewpoint import compute_patch_costs, compute_possible_savings, find_viewpoint
from robocov.planning.window import Window
from robocov.team import Team
from robocov.typing import FloatArray, IntArray

_OWN_NODES = 2500
"""Number of nodes of the lattice on which a robot finds its own goal."""
_MAX_IDLE_MOVE = 0.1
"""Distance that a robot may move without a new plan, as a fraction of the spacing of nodes."""
_CHANGED_WALL_RADII = 4.0
"""Minimum length of changed walls that matters, in radii of the robot. The visible side of a failed robot,
which looks like a new wall, is shorter."""
_ARRIVAL_RADIUS_M = 0.35
"""Distance from a goal or a viewpoint at which a robot has arrived."""
_LISTENING_S = 2.0
"""Time that robots wait at their starts if they know the positions of others only from messages."""
_SHARED_PATIENCE_FACTOR = 2.5
"""Factor of the gain `patience` if all robots learn what one of them sees."""
_MIN_POSSIBLE_SAVING = 0.15
"""Fraction of the coverage cost that one more robot, placed in an unknown patch, must save if the whole patch
is free. Robots do not look into patches that save less, unless these are worth the gain `stake`."""
_POSSIBLE_SAVING_DOUBLING_LENGTH = 1.0
"""Path length to viewpoints that doubles `_MIN_POSSIBLE_SAVING`, in diameters of the region."""
_MIN_PROGRESS_M = 0.05
"""A robot that has not arrived at its goal and moves less than this between two plans is stuck."""
_SWAP_SAVING = 0.1
"""Fraction of the sum of squared path lengths that an exchange of goals must save."""
_JOINT_PLANNING_CROSSINGS = 3.0
"""Time that a robot spends planning for others, in multiples of the time it needs to cross the region."""
_STAGGERING = 0.5
"""Fraction of the period over which the first plans of the robots are spread."""
_MAX_DOUBLINGS = 60.0
"""Limit of exponents of 2: larger powers make no difference."""


@dataclass(frozen=True)
class Atlas(BaseController):
    """Each robot maps the region, plans for the whole team on its own map, and moves to its own goal.

    Robots scan twice a second, and send each other nothing but their positions. Every `period` seconds, a
    robot reduces the coverage cost (22) on its own map in four stages:

    1. *Plan for the team.* It computes goals for all robots that it knows of. Robots at rest keep their
       positions.
    2. *Own goal.* It refines its own goal on a finer lattice.
    3. *Viewpoints.* At its goal, it looks at unknown parts of its cell if these matter enough for the cost,
       and at other unknown space that no other robot is closer to if this could save much.
    4. *Route.* It follows the shortest path on its map, and brakes before walls and other robots.

    The gains are the fields of the dataclass; `get_gains` returns their meanings, units and ranges.

    Parameters
    ----------
    period : float, s
        Time between two plans of a robot.
    threshold : float
        Fraction of the coverage cost that a relocation must save.
    nearby : float
        Fraction of the coverage cost that a relocation within the robot's own cell must save.
    rest : float
        Fraction of the cost of its own cell that a robot's new goal must save.
    stake : float
        Fraction of the coverage cost that unknown space must be expected to contribute before a robot moves
        to a viewpoint to look at it; see Notes for an exception. With 1, robots never move to viewpoints.
    patience : float
        Path length to viewpoints after which this fraction is doubled, in diameters of the region.
    settling : float
        Path length after which the required savings are doubled, in diameters of the region.
    clearance : float, m
        Gap between robots and walls along routes.
    k_prop : float, 1/s
        Desired speed per meter of distance to the goal.
    response_time : float, s
        Time constant with which the desired velocity is reached.

    See Also
    --------
    AtlasShared : The same controller with shared maps.

    Notes
    -----
    The coverage cost of positions P on the map is

        J(P) = sum over q of w_q min_j d(q, p_j),

    where q are the nodes of a lattice, d are geodesic distances among known walls, and w_q are areas times φ.
    Unknown cells are weighted by the probability that they are free (`openness`), because the insides of
    obstacles stay unknown.

    *Plan for the team.* The goals solve a k-median problem: starting from the last plan, Lloyd's iteration
    alternates with interchange. A relocation must save the fraction `threshold` of the cost, or `nearby` if
    it is within the robot's own cell. Goals are assigned so that the sum of the squared path lengths is
    minimal; this assignment does not change while the robots move. After the time in which a robot could
    cross the region a few times, it plans for itself alone on known free space, and leaves its cell only
    while all others are at rest. In a team of more than `MAX_PLANNING_GROUP` robots, each robot plans for
    itself and its nearest neighbors only.

    *Own goal and viewpoints.* A new goal must save the fraction `rest` of the cost of the robot's own cell. A
    robot moves to a viewpoint if the unknown space that it would see there is expected to contribute at least
    the fraction `stake` of the cost. This fraction doubles with the length of the paths to viewpoints
    (`patience`). Unknown space among walls is probably the inside of an obstacle, but may be a winding
    corridor. A robot at its goal therefore also looks into unknown space if one more robot there would save a
    large fraction of the cost, assuming that all of the space is free. A robot that knows of no others does
    not look for viewpoints, because its goal hardly depends on unknown space.

    *Coming to rest.* The required savings double with the path length of a robot (`settling`), not with time,
    so that a team at rest still responds to changes. Path lengths start from zero when a robot joins or
    fails, and when a wall appears or disappears.

    *Lost robots.* A robot out of range is assumed to be at its goal in the last plan, and is removed from the
    plan if no message arrives from it there.

    Examples
    --------
    >>> import robocov as rc
    >>> room = rc.Environment("room", ((0, 0), (8, 0), (8, 6), (0, 6)))
    >>> simulation = rc.Simulation(room, rc.Atlas(), [[1.0, 1.0]])
    >>> simulation.run(12.0).positions[-1].round(0)
    array([[4., 3.]])
    """

    name = "atlas"
    label = "Atlas"
    summary = "plans the team's placement on the map that each robot discovers itself"
    scanning = Scanning(rays=240, period=0.5)
    is_staggered: ClassVar[bool] = True
    """Whether robots plan at different times."""

    period: float = gain(1.0, "s", "time between two plans of a robot", low=0.05, high=60.0)
    threshold: float = gain(0.01, "1", "fraction of the cost that a relocation must save", high=1.0)
    nearby: float = gain(
        0.003, "1", "fraction of the cost that a move within its own cell must save", high=1.0
    )
    rest: float = gain(0.002, "1", "fraction of its own cell's cost that a new goal must save", high=1.0)
    stake: float = gain(
        0.016, "1", "fraction of the cost that unknown space seen from a viewpoint must contribute", high=1.0
    )
    patience: float = gain(
        0.12,
        "1",
        "path length to viewpoints that doubles the stake, in diameters of the region",
        low=1e-3,
        high=1e4,
    )
    settling: float = gain(
        0.5,
        "1",
        "path length that doubles the required savings, in diameters of the region",
        low=1e-3,
        high=1e6,
    )
    clearance: float = gain(0.03, "m", "margin between robots and walls along paths", high=10.0)
    k_prop: float = gain(2.0, "1/s", "desired speed per meter of distance to the goal", high=100.0)
    response_time: float = response_time_gain()

    def begin(self, region: Region, team: Team) -> AtlasMemory:
        """Return the initial memory, with no walls or other robots known.

        Parameters
        ----------
        region : Region
            The known outer boundary.
        team : Team

        Returns
        -------
        AtlasMemory
        """
        unknown_map = build_unknown_map(region)
        no_knowledge = TeamKnowledge(Teammates.build_empty())
        states = []
        for robot in range(len(team)):
            delay = 0.0
            if self.is_staggered:
                delay = self.period * _STAGGERING * compute_stagger_fraction(robot)
            states.append(PlannerState(unknown_map, next_plan_time=delay, knowledge=no_knowledge))
        return AtlasMemory(
            team=team,
            states=tuple(states),
            routes=(np.full((1, 2), np.nan),) * len(team),
            waypoint_indices=np.zeros(len(team), dtype=np.intp),
            exchange=self._build_exchange(unknown_map, team),
            reports=({},) * len(team),
        )

    def _build_exchange(self, unknown_map: DiscoveredMap, team: Team) -> ScanExchange | None:
        """Return an exchange in which no robot has any scans yet; None if robots share no scans."""
        return None

    def decide(self, seen: Observations, memory: AtlasMemory) -> Decision:
        """Plan the routes that are due, and compute the forces that lead all robots along their routes.

        Parameters
        ----------
        seen : Observations
        memory : AtlasMemory
            From `begin` or the previous decision.

        Returns
        -------
        Decision
        """
        estimates = memory.estimates
        # Plans use the most likely positions of neighbors; collision avoidance assumes that they are closer.
        conservative = seen
        if seen.reported_positions is not None:
            previous = estimates or Estimates.build_initial(len(seen.positions))
            seen, estimates = estimate_positions(seen, previous, memory.team)
            conservative = assume_closer_neighbors(seen, estimates)
        earliest_plan_time = 0.0 if estimates is None else _LISTENING_S
        memory = self._update_maps(seen, memory)
        due_robots = self._list_due_robots(seen, memory, earliest_plan_time=earliest_plan_time)
        memory = self._plan_routes(seen, memory, due_robots)
        memory, messages = self._send_messages(seen, memory, due_robots)
        returns = update_returns(seen, memory.returns)
        command = follow_routes(
            conservative,
            memory.team,
            RouteProgress(memory.routes, memory.waypoint_indices),
            returns,
            RouteGains(self.k_prop, self.response_time),
        )
        return Decision(
            forces=command.forces,
            goals=command.goals,
            terms={"attraction": command.forces},
            memory=replace(
                memory, waypoint_indices=command.waypoint_indices, returns=returns, estimates=estimates
            ),
            messages=messages,
        )

    def _update_maps(self, seen: Observations, memory: AtlasMemory) -> AtlasMemory:
        """Return the memory with the maps after the scans of this step, if there are any."""
        if seen.scans is None:
            return memory
        states = []
        for robot, state in enumerate(memory.states):
            scanned = state.known_map.add_scan(
                seen.positions[robot], seen.scans.distances[robot], seen.scans.is_hit[robot]
            )
            # Cells at the positions of other robots are free.
            neighbors = seen.get_neighbor_positions(robot)
            known_map = scanned.add_robots(neighbors, float(memory.team.radius[robot]))
            states.append(replace(state, known_map=known_map))
        return replace(memory, states=tuple(states))

    def _list_due_robots(
        self, seen: Observations, memory: AtlasMemory, *, earliest_plan_time: float
    ) -> list[int]:
        """Return the robots that make a plan in this step; no robot does before `earliest_plan_time`, s."""
        return [
            robot
            for robot, state in enumerate(memory.states)
            if seen.time >= max(state.next_plan_time, earliest_plan_time) - TIME_TOLERANCE_S
        ]

    def _plan_routes(self, seen: Observations, memory: AtlasMemory, due_robots: Sequence[int]) -> AtlasMemory:
        """Return the memory with new plans of some robots, and with their routes to their goals."""
        states = list(memory.states)
        routes = list(memory.routes)
        waypoint_indices = memory.waypoint_indices.copy()
        for robot, state in enumerate(states):
            if robot in due_robots:
                reports = self._list_reports(seen, memory, robot)
                states[robot], goal = self._plan(seen, memory, robot, reports)
                basis = states[robot].basis
                if goal is not None and basis is not None:
                    routes[robot] = basis.planner.find_route(seen.positions[robot], goal)
                    waypoint_indices[robot] = 0
            elif state.basis is None:
                # Before its first plan, a robot stays where it is.
                routes[robot] = seen.positions[robot : robot + 1]
        return replace(memory, states=tuple(states), routes=tuple(routes), waypoint_indices=waypoint_indices)

    def _list_reports(self, seen: Observations, memory: AtlasMemory, robot: int) -> list[TeammateReport]:
        """Return the reports that a robot uses in its plan; none here, because robots send no reports."""
        return []

    def _send_messages(
        self, seen: Observations, memory: AtlasMemory, due_robots: Sequence[int]
    ) -> tuple[AtlasMemory, tuple[tuple[Message, ...], ...]]:
        """Return the memory after this step's messages, and the messages; none here."""
        return memory, ()

    def _is_agreed(self, teammates: Teammates, seen: Observations, memory: AtlasMemory, robot: int) -> bool:
        """Return whether a robot and its teammates plan on the same map, and so make the same plan."""
        return False

    def _plan(
        self, seen: Observations, memory: AtlasMemory, robot: int, reports: Sequence[TeammateReport]
    ) -> tuple[PlannerState, FloatArray | None]:
        """Make a plan for a robot. Return its state, and its goal; None if it keeps its current route."""
        team = memory.team
        previous = memory.states[robot]
        position = seen.positions[robot]
        known_map = previous.known_map
        knowledge = update_knowledge(previous.knowledge, previous.team_goals, seen, team, robot, reports)
        is_agreed = self._is_agreed(knowledge.teammates, seen, memory, robot)
        others = list_others(knowledge.teammates, position, seen.time, plans_for_all=is_agreed)

        window = Window.build_around(known_map.raster, position, math.inf, _OWN_NODES)
        spacing = window.stride * known_map.raster.cell_size
        time_to_next_node = spacing / float(team.max_speed[robot])
        period = self._compute_period(previous, robot, time_to_next_node)
        state = replace(previous, knowledge=knowledge, next_plan_time=seen.time + period)
        robots = np.concatenate([[robot], others.robots])
        positions = np.vstack([position, others.positions])
        if _may_skip_plan(
            previous, robots, positions, is_quiet=others.is_quiet, max_move=_MAX_IDLE_MOVE * spacing
        ):
            return state, None

        radius = float(team.radius[robot])
        if previous.basis is None:
            planner = GridPlanner.get_shared(known_map, window, radius + self.clearance)
        else:
            planner = previous.basis.planner
        basis = PlanBasis(
            known_map=known_map,
            planner=planner.update(known_map, window),
            robots=robots,
            positions=positions,
            is_quiet=others.is_quiet,
        )
        path = _extend_path(previous, state, position, seen.time, radius)
        state = replace(state, basis=basis, path=path)
        cooperation = self._choose_cooperation(
            path, seen, others, max_speed=float(team.max_speed[robot]), is_agreed=is_agreed
        )
        min_savings = self._compute_min_savings(cooperation, is_quiet=basis.is_quiet)
        team_goals = compute_team_goals(previous.team_goals, basis, seen.density, cooperation, min_savings)
        state = replace(state, team_goals=team_goals)
        return self._plan_own_motion(previous, state, seen, cooperation, robot)

    def _compute_period(self, previous: PlannerState, robot: int, time_to_next_node: float) -> float:
        """Return the time until a robot's next plan, s: at least the time to move to the next node.

        After a robot's first plan, it is longer by a fraction that differs from robot to robot.
        """
        period = max(self.period, time_to_next_node)
        if previous.basis is None and self.is_staggered:
            # The times from the first plan to the second differ, so that robots keep planning at different
            # times. The delay of the first plan depends on `robot`; the next number gives a different
            # fraction, above 0 also for robot 0.
            period = period * (1.0 + compute_stagger_fraction(robot + 1))
        return period

    def _choose_cooperation(
        self,
        path: TraveledPath,
        seen: Observations,
        others: OtherRobots,
        *,
        max_speed: float,
        is_agreed: bool,
    ) -> Cooperation:
        """Choose the extent to which a robot plans for the others, which shrinks over time."""
        diameter = seen.region.diameter
        joint_planning_time = _JOINT_PLANNING_CROSSINGS * diameter / max_speed
        is_joint = is_agreed or seen.time - path.start_time <= joint_planning_time
        team_size = 1 + len(others.robots)
        group_size = min(team_size, MAX_PLANNING_GROUP)
        is_fixed = others.is_fixed
        if is_agreed:
            # All robots make the same plan for the whole team, in which each robot may get a new goal.
            group_size = team_size
            is_fixed = np.zeros_like(is_fixed)
        elif not is_joint:
            # The robot plans for itself alone: all others keep their positions.
            is_fixed = np.ones_like(is_fixed)
        doublings = min(path.length / (self.settling * diameter), _MAX_DOUBLINGS)
        return Cooperation(
            is_agreed=is_agreed,
            is_joint=is_joint,
            group_size=group_size,
            is_fixed=is_fixed,
            savings_factor=2.0**doublings,
        )

    def _compute_min_savings(self, cooperation: Cooperation, *, is_quiet: bool) -> MinSavings:
        """Return the fractions of the cost that changes of a plan must save; 1 allows no change."""
        # A plan that all robots share must not depend on the path length of the robot that computes it.
        factor = 1.0 if cooperation.is_agreed else cooperation.savings_factor
        relocation = 1.0
        if cooperation.is_joint or is_quiet:
            # The relocation of one of many robots saves less.
            scale = min(1.0, MAX_PLANNING_GROUP / cooperation.group_size)
            relocation = min(1.0, self.threshold * scale * factor)
        return MinSavings(
            relocation=relocation,
            own_cell=min(1.0, self.nearby * factor),
            swap=_SWAP_SAVING if cooperation.is_agreed else 0.0,
        )

    def _plan_own_motion(
        self,
        previous: PlannerState,
        state: PlannerState,
        seen: Observations,
        cooperation: Cooperation,
        robot: int,
    ) -> tuple[PlannerState, FloatArray]:
        """Return the state of a robot after the plan for its team, and the point to which it moves next."""
        position = seen.positions[robot]
        viewpoint = previous.viewpoint
        own = self._find_own_goal(state, seen, cooperation)
        if own is None:
            return replace(state, motion=OwnMotion(position, viewpoint)), position
        if cooperation.is_agreed and previous.basis is not None and state.basis is not None:
            move = math.dist(position, previous.basis.positions[0])
            is_stuck = move < _MIN_PROGRESS_M and math.dist(position, own.goal) > _ARRIVAL_RADIUS_M
            jam, evasion_goal = plan_evasion(
                state.jam, state.basis.positions, is_stuck=is_stuck, time=seen.time, robot=robot
            )
            state = replace(state, jam=jam)
            if evasion_goal is not None:
                return replace(state, motion=OwnMotion(own.goal, viewpoint)), evasion_goal
        # After a change of the team or the walls, the path length starts from zero.
        added_length = max(state.path.length - previous.path.length, 0.0)
        path = _extend_viewpoint_path(state, position, added_length)
        state = replace(state, path=path)
        motion = self._choose_motion(state, cooperation, own, position, seen.density)
        goal = motion.goal if motion.viewpoint is None else motion.viewpoint
        return replace(state, motion=motion), goal

    def _find_own_goal(
        self, state: PlannerState, seen: Observations, cooperation: Cooperation
    ) -> OwnGoal | None:
        """Return a robot's own goal, near its goal in the team's plan; None if no node has clearance."""
        assert state.basis is not None and state.team_goals is not None
        planner = state.basis.planner
        first_node = planner.visibility.find_entry_node(state.team_goals.goals[0])
        if first_node == NO_NODE:
            return None
        return find_own_goal(
            planner,
            compute_node_weights(planner.map_window, seen.density),
            _predict_other_positions(state, cooperation),
            first_node,
            previous_goal=np.full(2, np.nan) if state.motion is None else state.motion.goal,
            min_saving=min(1.0, self.rest * cooperation.savings_factor),
        )

    def _choose_motion(
        self,
        state: PlannerState,
        cooperation: Cooperation,
        own: OwnGoal,
        position: FloatArray,
        density: Density | None,
    ) -> OwnMotion:
        """Return a robot's motion: straight to its own goal, or first to a viewpoint.

        The robot looks for a viewpoint when it has arrived at its goal, and again in each plan that it makes
        on a path to a viewpoint.
        """
        assert state.basis is not None
        is_away_from_goal = math.dist(own.goal, position) > _ARRIVAL_RADIUS_M
        if is_away_from_goal and state.viewpoint is None:
            return OwnMotion(own.goal)
        viewpoint = None
        node = state.basis.planner.visibility.find_entry_node(position)
        # The goal of a lone robot hardly depends on unknown space, so it needs no viewpoints.
        has_others = len(state.basis.robots) > 1
        if node != NO_NODE and self.stake < 1.0 and has_others:
            viewpoint = self._find_viewpoint(state, cooperation, own, node, density)
        return OwnMotion(own.goal, viewpoint, is_idle=viewpoint is None)

    def _find_viewpoint(
        self,
        state: PlannerState,
        cooperation: Cooperation,
        own: OwnGoal,
        node: int,
        density: Density | None,
    ) -> FloatArray | None:
        """Return the viewpoint to which a robot at a node moves next, (2,) m; None if there is none."""
        assert state.basis is not None
        planner = state.basis.planner
        # The longer the path to viewpoints already is, the more must be gained from another one.
        patience = self.patience * (_SHARED_PATIENCE_FACTOR if cooperation.is_agreed else 1.0)
        costs = compute_patch_costs(planner.map_window, own.cell_distances, density)
        min_cost = self.stake * own.cost * _compute_path_factor(state, patience)
        costs[costs <= min_cost] = 0.0
        path_lengths = planner.graph.get_distances(node)
        viewpoint = find_viewpoint(planner.map_window, costs, path_lengths, state.path.viewpoints)
        if viewpoint is not None:
            return viewpoint
        return self._find_viewpoint_by_possible_saving(state, cooperation, own, node, density)

    def _find_viewpoint_by_possible_saving(
        self,
        state: PlannerState,
        cooperation: Cooperation,
        own: OwnGoal,
        node: int,
        density: Density | None,
    ) -> FloatArray | None:
        """Return a viewpoint at an unknown patch that would matter if it were free; None if there is none.

        The expected cost hardly counts unknown space among walls. Here, all unknown cells count fully, in the
        cells of other robots as well. The robot leaves patches to others whose expected position is closer.

        A robot with its own map sets out only while all others that it knows of are at rest or out of
        contact, because the placement is worse while it is away. On its way to any viewpoint, it may
        continue. Robots that all plan on the same map need not wait.
        """
        assert state.basis is not None
        may_go = cooperation.is_agreed or state.basis.is_quiet or state.viewpoint is not None
        if not may_go:
            return None
        planner = state.basis.planner
        other_positions = _predict_other_positions(state, cooperation)
        path_factor = _compute_path_factor(state, _POSSIBLE_SAVING_DOUBLING_LENGTH)
        savings = compute_possible_savings(
            planner,
            planner.compute_distances_from(np.vstack([own.goal, other_positions])),
            density,
            min_saving=_MIN_POSSIBLE_SAVING * own.cost * path_factor,
        )
        # If no known free space connects another robot with this one, the path between them may be blocked.
        # The other robot then does not count as closer.
        is_connected = planner.map_window.find_connected(state.basis.positions)[1:]
        other_distances = planner.compute_distances_from(other_positions[is_connected])
        # The robot's own path starts at its node, which makes it slightly too short. Therefore, two robots at
        # nearly the same distance may both go.
        path_lengths = planner.graph.get_distances(node)
        is_closest = path_lengths < other_distances
        own_path_lengths = np.where(is_closest, path_lengths, np.inf)
        return find_viewpoint(planner.map_window, savings, own_path_lengths, state.path.viewpoints)


def _compute_path_factor(state: PlannerState, doubling_length: float) -> float:
    """Return the factor by which the required gain of a viewpoint has grown with the path to viewpoints.

    It is 1 at first, and doubles with each `doubling_length`, in diameters of the region.
    """
    diameter = state.known_map.raster.region.diameter
    doublings = min(state.path.viewpoint_length / (doubling_length * diameter), _MAX_DOUBLINGS)
    return float(2.0**doublings)


def _predict_other_positions(state: PlannerState, cooperation: Cooperation) -> FloatArray:
    """Return where a robot expects the k others, (k, 2) m: mobile ones at their goals in its plan."""
    assert state.basis is not None and state.team_goals is not None
    team_goals = state.team_goals.goals
    is_mobile = ~cooperation.is_fixed
    # The robots without a goal in the plan come last. All of them are fixed.
    is_mobile_in_plan = is_mobile[: len(team_goals) - 1]
    positions = state.basis.positions[1:].copy()
    positions[is_mobile] = team_goals[1:][is_mobile_in_plan]
    return positions


def _may_skip_plan(
    previous: PlannerState, robots: IntArray, positions: FloatArray, *, is_quiet: bool, max_move: float
) -> bool:
    """Return whether a robot may skip its plan: it is idle, and nothing has changed since its last plan."""
    basis = previous.basis
    if basis is None or previous.motion is None:
        return False
    return (
        previous.motion.is_idle
        and basis.known_map is previous.known_map
        and basis.is_quiet == is_quiet
        and np.array_equal(basis.robots, robots)
        and bool(np.abs(positions - basis.positions).max() < max_move)
    )


def _extend_path(
    previous: PlannerState, state: PlannerState, position: FloatArray, time: float, radius: float
) -> TraveledPath:
    """Return the path with the move since the last plan. After a change, a new path starts."""
    if previous.basis is None or _has_changed(previous, state, radius):
        return TraveledPath(start_time=time)
    move = math.dist(position, previous.basis.positions[0])
    return replace(state.path, length=state.path.length + move)


def _has_changed(previous: PlannerState, state: PlannerState, radius: float) -> bool:
    """Return whether the team or the walls have changed since the last plan."""
    assert previous.basis is not None
    if state.knowledge.encountered != previous.knowledge.encountered:
        return True
    changed_walls = state.known_map.count_changed_walls(previous.basis.known_map)
    return changed_walls * state.known_map.raster.cell_size > _CHANGED_WALL_RADII * radius


def _extend_viewpoint_path(state: PlannerState, position: FloatArray, added_length: float) -> TraveledPath:
    """Return the path with the last move included in the statistics of viewpoints.

    If the robot was heading for a viewpoint, the length of the move, `added_length` in meters, is added to
    the path length spent on viewpoints, and the viewpoint is recorded if the robot has reached it.
    """
    viewpoint = state.viewpoint
    if viewpoint is None:
        return state.path
    viewpoints = state.path.viewpoints
    if math.dist(viewpoint, position) < _ARRIVAL_RADIUS_M:
        viewpoints = (*viewpoints, viewpoint)
    return replace(
        state.path,
        viewpoint_length=state.path.viewpoint_length + added_length,
        viewpoints=viewpoints,
    )
