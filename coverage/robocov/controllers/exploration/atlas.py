"""Atlas: each robot plans the placement of its team on the map that it has discovered itself."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray
from robocov.controllers.base import TIME_TOLERANCE_S, BaseController
from robocov.controllers.driving import update_returns
from robocov.controllers.exploration.atlas_memory import (
    AtlasMemory,
    JamState,
    OwnMotion,
    PlanBasis,
    PlannerState,
    TeamGoals,
    TeamKnowledge,
    TraveledPath,
)
from robocov.controllers.exploration.localization import (
    Estimates,
    assume_closer_neighbors,
    estimate_positions,
)
from robocov.controllers.exploration.route_following import RouteGains, RouteProgress, follow_routes
from robocov.controllers.exploration.scan_exchange import ScanExchange
from robocov.controllers.exploration.shared_map import (
    CERTAIN_RANGE_FRACTION,
    MAX_SILENCE_S,
    build_unknown_map,
)
from robocov.controllers.exploration.teammates import TeammateReport, Teammates, receive_reports
from robocov.controllers.gains import gain, response_time_gain
from robocov.density import Density
from robocov.observation import Decision, Message, Observations, Scanning
from robocov.observation.region import Region
from robocov.planning.discovered_map import DiscoveredMap
from robocov.planning.grid_planner import GridPlanner
from robocov.planning.own_goal import OwnGoal, find_own_goal
from robocov.planning.team_placement import MinSavings, TeamSituation, compute_node_weights, place_team
from robocov.planning.viewpoint import find_viewpoint
from robocov.planning.window import Window
from robocov.team import Team

MAX_PLANNING_GROUP = 8
"""Number of robots that a robot with its own map plans for: itself and the nearest others."""
MIN_REST_S = 3.0
"""Time after which a robot that has not moved is at rest."""

_MIN_TEAM_NODES = 1000
_MAX_TEAM_NODES = 4000
"""Range of the number of nodes of the lattice for a whole team."""
_NODES_PER_ROBOT = 160
"""Number of nodes for each robot, within that range."""
_MIN_NODES_PER_ROBOT = 27
"""Minimum number of nodes for each robot, even if they exceed the range."""
_GROUP_NODES = 500
"""Number of nodes of the lattice for a group within a larger team."""
_OWN_NODES = 2500
"""Number of nodes of the lattice on which a robot finds its own goal."""
_GROUP_REACH = 2.0
"""Size of the window for a group, relative to the distance of its farthest robot."""
_MIN_GROUP_REACH_M = 1.0
"""Minimum size of that window."""
_MAX_IDLE_MOVE = 0.1
"""Distance that a robot may move without a new plan, as a fraction of the spacing of nodes."""
_CHANGED_WALL_RADII = 4.0
"""Length of changed walls, in radii, that matters: longer than the visible side of a failed robot."""
_ARRIVAL_RADIUS_M = 0.35
"""Distance from a goal at which a robot has arrived."""
_LISTENING_S = 2.0
"""Time that robots with delayed messages wait at their starts."""
_SHARED_PATIENCE_FACTOR = 2.5
"""Factor of the patience if all robots learn from what one of them sees."""
_MIN_PROGRESS_M = 0.05
"""A robot that moves less between two plans, away from its goal, is stuck."""
_MAX_STUCK_PLANS = 3
"""Number of plans after which a stuck robot is in a jam."""
_JAM_RADIUS_M = 0.7
"""Distance from a robot within which others are in the same jam."""
_MAX_EVASION_S = 8.0
"""Maximum time that a robot spends moving out of a jam."""
_SWAP_SAVING = 0.1
"""Fraction of the squared path lengths that an exchange of goals must save."""
_JOINT_PLANNING_CROSSINGS = 3.0
"""Time that a robot spends planning for others, in multiples of the time it needs to cross the region."""
_STAGGERING = 0.5
"""Fraction of the period in which all robots make their first plans."""
_MAX_DOUBLINGS = 60.0
"""Limit of exponents of 2: larger powers make no difference."""
_GOLDEN_FRACTION = (math.sqrt(5.0) - 1.0) / 2.0
"""Its multiples, modulo 1, are spread evenly between 0 and 1."""


class _Others(NamedTuple):
    """The other robots that a robot knows of; first those that it plans for."""

    robots: IntArray
    """(k,) Their numbers."""
    positions: Array
    """(k, 2) m"""
    is_fixed: BoolArray
    """(k,) Whether each is at rest, out of contact now, or not planned for."""
    is_quiet: bool
    """Whether all of them are at rest or out of contact now."""


class _LostRobots(NamedTuple):
    """Masks of the lost robots among the k that a robot knows of; it has lost none that it hears."""

    has_failed: BoolArray
    """(k,) Whether each has become silent although it cannot have moved out of range."""
    is_missing: BoolArray
    """(k,) Whether each is not heard although its assumed position is well within range."""


class _Cooperation(NamedTuple):
    """Extent to which a robot plans for the others."""

    is_agreed: bool
    """Whether all robots plan on the same map, and therefore make the same plan."""
    is_joint: bool
    """Whether the robot plans for others as well, not for itself alone."""
    is_fixed: BoolArray
    """(k,) Whether each of the others keeps its position in the plan."""
    savings_factor: float
    """Factor of the savings that relocations and goals require."""


class _TeamPlan(NamedTuple):
    """The latest plan on a planner that several robots share."""

    key: tuple[object, ...]
    density: Density | None
    goals: Array
    """(k, 2) m, in the order of the numbers of the robots."""


_LATEST_PLANS: WeakKeyDictionary[GridPlanner, _TeamPlan] = WeakKeyDictionary()


@dataclass(frozen=True)
class Atlas(BaseController):
    """Each robot maps the region, plans for the whole team on its own map, and moves to its own goal.

    Robots scan twice a second, and send each other nothing but their positions. Every `period` seconds, a
    robot reduces the coverage cost (22) on its own map in four stages:

    1. *Plan for the team.* It computes goals for all robots that it knows of. Robots at rest keep their
       positions.
    2. *Own goal.* It refines its own goal on a finer lattice.
    3. *Viewpoints.* At its goal, it looks at unknown parts of its cell if these matter enough for the cost.
    4. *Route.* It follows the shortest path on its map, and brakes before walls and other robots.

    The gains are the fields of the dataclass; `get_gains` returns their meanings, units and ranges.

    Parameters
    ----------
    period : float, s
        Time between two plans of a robot.
    threshold : float
        Fraction of the cost that a relocation must save.
    nearby : float
        Fraction of the cost that a relocation within the robot's own cell must save.
    rest : float
        Fraction of the cost of its own cell that a robot's new goal must save.
    stake : float
        Fraction of that cost that must be at stake for a viewpoint.
    patience : float
        Path length to viewpoints that doubles `stake`, in diameters of the region.
    settling : float
        Path length that doubles the required savings, in diameters of the region.
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

    *Plan for the team.* The solver alternates Lloyd's iteration with interchange (the k-median problem),
    starting from the last plan. A relocation must save the fraction `threshold` of the cost, or `nearby` if
    it is within the robot's own cell. Goals are assigned so that the sum of the squared path lengths is
    minimal; this assignment does not change while the robots move. After the time in which a robot could
    cross the region a few times, it plans for itself alone on known free space, and leaves its cell only
    while all others are at rest. In a team of more than `MAX_PLANNING_GROUP` robots, each robot plans for
    itself and its nearest neighbors only.

    *Own goal and viewpoints.* A new goal must save the fraction `rest` of the cost of the robot's own cell. A
    viewpoint must put at least the fraction `stake` of that cost at stake; the fraction doubles with the
    length of the path to viewpoints (`patience`). A robot without others does not look for viewpoints,
    because its goal hardly depends on unknown space.

    *Coming to rest.* The required savings double with the path length of a robot (`settling`), not with time,
    so that a team at rest still responds to changes. Path lengths start from zero when a robot joins or
    fails, and when a wall appears or disappears.

    *Lost robots.* A robot out of range is assumed to be at its goal in the last plan, and is removed from the
    plan if it is not heard there.

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
    stake: float = gain(0.004, "1", "fraction of the cost that must be at stake for a viewpoint", high=1.0)
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
    clearance: float = gain(0.03, "m", "gap between robots and walls along routes", high=10.0)
    k_prop: float = gain(2.0, "1/s", "desired speed per meter of distance to the goal", high=100.0)
    response_time: float = response_time_gain()

    def begin(self, region: Region, team: Team) -> AtlasMemory:
        """Return the memory of robots that know neither walls nor other robots.

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
                delay = self.period * _STAGGERING * (robot * _GOLDEN_FRACTION % 1.0)
            states.append(PlannerState(unknown_map, next_plan_time=delay, knowledge=no_knowledge))
        routes = (np.full((1, 2), np.nan),) * len(team)
        return AtlasMemory(team, tuple(states), routes, np.zeros(len(team), dtype=np.intp))

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
        first_plan_time = 0.0 if estimates is None else _LISTENING_S
        memory = self._update_maps(seen, memory)
        due_robots = self._list_due_robots(seen, memory, first_plan_time=first_plan_time)
        memory = self._plan_routes(seen, memory, due_robots)
        memory, messages = self._send_messages(seen, memory, due_robots)
        returns = update_returns(seen, memory.returns)
        command = follow_routes(
            conservative,
            memory.team,
            RouteProgress(memory.routes, memory.legs),
            returns,
            RouteGains(self.k_prop, self.response_time),
        )
        return Decision(
            forces=command.forces,
            goals=command.goals,
            terms={"attraction": command.forces},
            memory=replace(memory, legs=command.legs, returns=returns, estimates=estimates),
            messages=messages,
        )

    def _update_maps(self, seen: Observations, memory: AtlasMemory) -> AtlasMemory:
        """Return the memory with the maps after the scans of this step, if there are any."""
        if seen.scans is None:
            return memory
        states = []
        for robot, state in enumerate(memory.states):
            scanned = state.known_map.add_scan(
                seen.positions[robot], seen.scans.distances[robot], seen.scans.hit[robot]
            )
            # Cells at the positions of other robots are free.
            neighbors = seen.get_neighbor_positions(robot)
            known_map = scanned.add_robots(neighbors, float(memory.team.radius[robot]))
            states.append(replace(state, known_map=known_map))
        return replace(memory, states=tuple(states))

    def _list_due_robots(
        self, seen: Observations, memory: AtlasMemory, *, first_plan_time: float
    ) -> list[int]:
        """Return the robots that plan in this step."""
        return [
            robot
            for robot, state in enumerate(memory.states)
            if seen.time >= max(state.next_plan_time, first_plan_time) - TIME_TOLERANCE_S
        ]

    def _plan_routes(self, seen: Observations, memory: AtlasMemory, due_robots: Sequence[int]) -> AtlasMemory:
        """Return the memory with the plans of some robots, and their routes to their goals."""
        states = list(memory.states)
        routes = list(memory.routes)
        legs = memory.legs.copy()
        for robot, state in enumerate(states):
            if robot in due_robots:
                reports = self._list_reports(seen, memory, robot)
                states[robot], goal = self._plan(seen, memory, robot, reports)
                basis = states[robot].basis
                if goal is not None and basis is not None:
                    routes[robot] = basis.planner.find_route(seen.positions[robot], goal)
                    legs[robot] = 0
            elif state.basis is None:
                routes[robot] = seen.positions[robot : robot + 1]
        return replace(memory, states=tuple(states), routes=tuple(routes), legs=legs)

    def _list_reports(self, seen: Observations, memory: AtlasMemory, robot: int) -> list[TeammateReport]:
        """Return the reports about others that a robot has received."""
        return []

    def _send_messages(
        self, seen: Observations, memory: AtlasMemory, due_robots: Sequence[int]
    ) -> tuple[AtlasMemory, tuple[tuple[Message, ...], ...]]:
        """Return the memory and the messages that each robot sends; empty if robots send none."""
        return memory, ()

    def _is_agreed(self, teammates: Teammates, seen: Observations, memory: AtlasMemory, robot: int) -> bool:
        """Return whether a robot and its teammates plan on the same map; see `_Cooperation`."""
        return False

    def _plan(
        self, seen: Observations, memory: AtlasMemory, robot: int, reports: Sequence[TeammateReport]
    ) -> tuple[PlannerState, Array | None]:
        """Update a robot's plan; return its state, and its goal or None if it keeps its route."""
        team = memory.team
        previous = memory.states[robot]
        position = seen.positions[robot]
        known_map = previous.known_map
        radius = float(team.radius[robot])
        max_speed = float(team.max_speed[robot])
        knowledge = _update_knowledge(previous, seen, team, robot, reports)
        is_agreed = self._is_agreed(knowledge.teammates, seen, memory, robot)
        others = _list_others(knowledge.teammates, position, seen.time, is_agreed=is_agreed)
        window = Window.build_around(known_map.raster, position, math.inf, _OWN_NODES)
        spacing = window.stride * known_map.raster.cell_size
        period = self._compute_period(previous, robot, spacing / max_speed)
        state = replace(previous, knowledge=knowledge, next_plan_time=seen.time + period)
        robots = np.concatenate([[robot], others.robots])
        positions = np.vstack([position, others.positions])
        if _may_skip_plan(previous, robots, positions, others.is_quiet, max_move=_MAX_IDLE_MOVE * spacing):
            return state, None
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
        cooperation = self._choose_cooperation(state, seen, others, max_speed=max_speed, is_agreed=is_agreed)
        team_goals = self._plan_for_team(state.team_goals, basis, seen, cooperation)
        state = replace(state, team_goals=team_goals)
        return self._plan_own_motion(previous, state, seen, cooperation, robot)

    def _plan_own_motion(
        self,
        previous: PlannerState,
        state: PlannerState,
        seen: Observations,
        cooperation: _Cooperation,
        robot: int,
    ) -> tuple[PlannerState, Array]:
        """Return the state of a robot after the plan for its team, and the robot's next goal."""
        position = seen.positions[robot]
        viewpoint = None if previous.motion is None else previous.motion.viewpoint
        own = self._find_own_goal(state, seen, cooperation)
        if own is None:
            return replace(state, motion=OwnMotion(position, viewpoint)), position
        if cooperation.is_agreed and previous.basis is not None:
            step_length = math.dist(position, previous.basis.positions[0])
            jam, evasion_goal = _find_evasion_goal(state, own.goal, step_length, seen.time, robot)
            state = replace(state, jam=jam)
            if evasion_goal is not None:
                return replace(state, motion=OwnMotion(own.goal, viewpoint)), evasion_goal
        # After a change of the team or the walls, the path length starts from zero.
        added_length = max(state.path.length - previous.path.length, 0.0)
        path, motion = self._choose_motion(
            state, own, position, added_length, is_agreed=cooperation.is_agreed
        )
        goal = motion.goal if motion.viewpoint is None else motion.viewpoint
        return replace(state, path=path, motion=motion), goal

    def _choose_cooperation(
        self, state: PlannerState, seen: Observations, others: _Others, *, max_speed: float, is_agreed: bool
    ) -> _Cooperation:
        """Choose the extent to which a robot plans for the others, which shrinks over time."""
        diameter = seen.region.diameter
        joint_planning_time = _JOINT_PLANNING_CROSSINGS * diameter / max_speed
        is_joint = is_agreed or seen.time - state.path.start_time <= joint_planning_time
        is_fixed = others.is_fixed
        if is_agreed:
            is_fixed = np.zeros_like(is_fixed)
        elif not is_joint:
            is_fixed = np.ones_like(is_fixed)
        doublings = min(state.path.length / (self.settling * diameter), _MAX_DOUBLINGS)
        return _Cooperation(
            is_agreed=is_agreed, is_joint=is_joint, is_fixed=is_fixed, savings_factor=2.0**doublings
        )

    def _find_own_goal(
        self, state: PlannerState, seen: Observations, cooperation: _Cooperation
    ) -> OwnGoal | None:
        """Return a robot's own goal, near its goal in the plan; None if that goal has no node nearby."""
        assert state.basis is not None and state.team_goals is not None
        planner = state.basis.planner
        goals = state.team_goals.goals
        first_node = planner.find_nearest_node(goals[0])
        if first_node < 0:
            return None
        is_free = ~cooperation.is_fixed
        # Robots that the plan has no goal for, which come last, are fixed.
        is_planned_and_free = is_free[: len(goals) - 1]
        other_positions = state.basis.positions[1:].copy()
        other_positions[is_free] = goals[1:][is_planned_and_free]
        return find_own_goal(
            planner,
            compute_node_weights(planner, seen.density),
            other_positions,
            first_node,
            previous_goal=np.full(2, np.nan) if state.motion is None else state.motion.goal,
            min_saving=min(1.0, self.rest * cooperation.savings_factor),
        )

    def _compute_period(self, previous: PlannerState, robot: int, time_to_next_node: float) -> float:
        """Return the time until the next plan, s: at least the time to move to the next node."""
        period = max(self.period, time_to_next_node)
        if previous.basis is None and self.is_staggered:
            # The periods after the first plan differ, so that the robots keep planning at different times.
            period = period * (1.0 + (robot + 1) * _GOLDEN_FRACTION % 1.0)
        return period

    def _plan_for_team(
        self, previous: TeamGoals | None, basis: PlanBasis, seen: Observations, cooperation: _Cooperation
    ) -> TeamGoals:
        """Return goals for the team, or for a robot and its nearest neighbors."""
        size = len(basis.robots)
        if not cooperation.is_agreed:
            size = min(size, MAX_PLANNING_GROUP)
        group = basis.robots[:size]
        is_whole_team = size == len(basis.robots)
        window = _build_team_window(basis.known_map, basis.positions[:size], is_whole_team=is_whole_team)
        previous_planner = basis.planner if previous is None else previous.planner
        planner = previous_planner.update(basis.known_map, window)
        situation = _build_situation(basis, size, previous, cooperation.is_fixed)
        min_savings = self._compute_min_savings(cooperation, size, is_quiet=basis.is_quiet)
        if cooperation.is_agreed:
            goals = _place_agreed_team(planner, seen.density, group, situation, min_savings)
        else:
            # A robot that plans for itself alone does not move to cells that may not be free.
            weights = compute_node_weights(planner, seen.density, only_known=not cooperation.is_joint)
            goals = place_team(planner, weights, situation, min_savings)
        return TeamGoals(planner=planner, robots=group, goals=goals)

    def _compute_min_savings(
        self, cooperation: _Cooperation, group_size: int, *, is_quiet: bool
    ) -> MinSavings:
        """Return the fractions of the cost that changes of a plan must save; 1 allows no change."""
        # A plan that all robots share must not depend on the path length of the robot that computes it.
        factor = 1.0 if cooperation.is_agreed else cooperation.savings_factor
        relocation = 1.0
        if cooperation.is_joint or is_quiet:
            # The relocation of one of many robots saves less.
            scale = min(1.0, MAX_PLANNING_GROUP / group_size)
            relocation = min(1.0, self.threshold * scale * factor)
        return MinSavings(
            relocation=relocation,
            own_cell=min(1.0, self.nearby * factor),
            swap=_SWAP_SAVING if cooperation.is_agreed else 0.0,
        )

    def _choose_motion(
        self, state: PlannerState, own: OwnGoal, position: Array, added_length: float, *, is_agreed: bool
    ) -> tuple[TraveledPath, OwnMotion]:
        """Return a robot's updated path and its motion: straight to its own goal, or first to a viewpoint.

        The robot looks for a viewpoint when it has arrived at its goal, and again in every plan on the way to
        a viewpoint. `added_length` is the length of its path since the last plan, m.
        """
        assert state.basis is not None
        planner = state.basis.planner
        path = state.path
        previous_viewpoint = None if state.motion is None else state.motion.viewpoint
        is_away_from_goal = math.dist(own.goal, position) > _ARRIVAL_RADIUS_M
        if previous_viewpoint is None and is_away_from_goal:
            return path, OwnMotion(own.goal)
        if previous_viewpoint is not None:
            path = replace(path, viewpoint_length=path.viewpoint_length + added_length)
            if math.dist(previous_viewpoint, position) < _ARRIVAL_RADIUS_M:
                path = replace(path, viewpoints=(*path.viewpoints, previous_viewpoint))
        viewpoint = None
        node = planner.find_own_node(position)
        # The goal of a lone robot hardly depends on unknown space, so it needs no viewpoints.
        has_others = len(state.basis.robots) > 1
        if node >= 0 and self.stake < 1.0 and has_others:
            # The longer the path to viewpoints already is, the more must be at stake for another one.
            patience = self.patience * (_SHARED_PATIENCE_FACTOR if is_agreed else 1.0)
            doubling_length = patience * state.known_map.raster.region.diameter
            doublings = min(path.viewpoint_length / doubling_length, _MAX_DOUBLINGS)
            min_stake = self.stake * own.cost * 2.0**doublings
            viewpoint = find_viewpoint(
                planner,
                own.cell_distances,
                path_lengths=planner.get_distances(node),
                min_stake=min_stake,
                previous_viewpoints=path.viewpoints,
            )
        return path, OwnMotion(own.goal, viewpoint, is_idle=viewpoint is None)


def _update_knowledge(
    state: PlannerState, seen: Observations, team: Team, robot: int, reports: Sequence[TeammateReport]
) -> TeamKnowledge:
    """Return what a robot knows of the others now."""
    knowledge = state.knowledge
    teammates = _assume_at_goals(knowledge.teammates, state.team_goals)
    lost = _find_lost_robots(teammates, seen, team, robot)
    is_lost = lost.has_failed | lost.is_missing
    failed_robots = teammates.robots[lost.has_failed].tolist()
    lost_robots = teammates.robots[is_lost].tolist()
    loss_times = {**knowledge.loss_times, **dict.fromkeys(lost_robots, seen.time)}
    teammates = teammates.add_observation(
        robots=seen.neighbors.list_neighbors(robot),
        positions=seen.get_neighbor_positions(robot),
        own_position=seen.positions[robot],
        time=seen.time,
        is_lost=is_lost,
    )
    if reports:
        teammates = teammates.add_reports(reports, robot, loss_times)
    encountered = (knowledge.encountered - {*failed_robots}) | {*teammates.robots.tolist()}
    return TeamKnowledge(teammates=teammates, encountered=encountered, loss_times=loss_times)


def _find_evasion_goal(
    state: PlannerState, own_goal: Array, step_length: float, time: float, robot: int
) -> tuple[JamState, Array | None]:
    """Return the state of a robot in a jam, and a goal outside the jam; None if it need not move away."""
    assert state.basis is not None
    positions = state.basis.positions
    position = positions[0]
    jam = state.jam
    is_stuck = step_length < _MIN_PROGRESS_M and math.dist(position, own_goal) > _ARRIVAL_RADIUS_M
    jam = replace(jam, stuck_plans=jam.stuck_plans + 1 if is_stuck else 0)
    if jam.stuck_plans >= _MAX_STUCK_PLANS:
        # Robots move away for different times, so that they do not all return at once.
        duration = _MAX_EVASION_S * ((robot + time) * _GOLDEN_FRACTION % 1.0)
        jam = JamState(stuck_plans=0, evasion_end=time + duration)
    is_close = ((positions - position) ** 2).sum(axis=1) < _JAM_RADIUS_M**2
    away = position - positions[is_close].mean(axis=0)
    if not (time < jam.evasion_end and away.any()):
        return jam, None
    goal = position + away * (_JAM_RADIUS_M / float(np.hypot(*away)))
    return replace(jam, stuck_plans=0), goal


def _assume_at_goals(teammates: Teammates, plan: TeamGoals | None) -> Teammates:
    """Return what a robot knows of the others, with each one at its goal in the last plan, if it has one."""
    if plan is None:
        return teammates
    _, rows, planned_rows = np.intersect1d(teammates.robots, plan.robots, return_indices=True)
    positions = teammates.positions.copy()
    positions[rows] = plan.goals[planned_rows]
    return teammates._replace(positions=positions)


def _find_lost_robots(teammates: Teammates, seen: Observations, team: Team, robot: int) -> _LostRobots:
    """Find which of the others have failed or are missing, for a robot with the given number."""
    communication_range = float(team.communication_range[robot])
    is_heard = np.isin(teammates.robots, seen.neighbors.list_neighbors(robot))
    silence = np.where(is_heard, 0.0, seen.time - teammates.heard_times)
    # Both robots may have moved apart at full speed.
    max_distance = teammates.heard_distances + 2.0 * float(team.max_speed[robot]) * silence
    distance = np.sqrt(((teammates.positions - seen.positions[robot]) ** 2).sum(axis=1))
    return _LostRobots(
        has_failed=(silence > 0.0) & (max_distance < communication_range),
        is_missing=(silence > MAX_SILENCE_S) & (distance < CERTAIN_RANGE_FRACTION * communication_range),
    )


def _extend_path(
    previous: PlannerState, state: PlannerState, position: Array, time: float, radius: float
) -> TraveledPath:
    """Return the path with the move since the last plan; after a change, a new path starts."""
    if previous.basis is None or _has_changed(previous, state, radius):
        return TraveledPath(start_time=time)
    move = math.dist(position, previous.basis.positions[0])
    return replace(state.path, length=state.path.length + move)


def _build_situation(
    basis: PlanBasis, size: int, previous: TeamGoals | None, is_fixed: BoolArray
) -> TeamSituation:
    """Return the situation of the first `size` robots of a team; they start from their previous goals.

    Fixed robots, and those without a previous goal, start from their positions. The first robot
    has no entry in `is_fixed`, (k - 1,).
    """
    group = basis.robots[:size]
    positions = basis.positions[:size]
    is_fixed_in_group = np.concatenate([[False], is_fixed])[:size]
    previous_goals = positions.copy()
    if previous is not None:
        _, rows, previous_rows = np.intersect1d(group, previous.robots, return_indices=True)
        is_free = ~is_fixed_in_group[rows]
        previous_goals[rows[is_free]] = previous.goals[previous_rows[is_free]]
    return TeamSituation(
        positions=positions,
        previous_goals=previous_goals,
        is_fixed=is_fixed_in_group,
        other_positions=basis.positions[size:],
    )


def _place_agreed_team(
    planner: GridPlanner,
    density: Density | None,
    group: IntArray,
    situation: TeamSituation,
    min_savings: MinSavings,
) -> Array:
    """Return the goals of a team, (k, 2) m, in the plan on which all robots agree.

    The plan is computed for the first robot that needs it, and stored for the others.
    """
    # In ascending order, the situation is the same for all robots.
    order = np.argsort(group)
    situation = TeamSituation(
        positions=situation.positions[order],
        previous_goals=situation.previous_goals[order],
        is_fixed=situation.is_fixed[order],
        other_positions=situation.other_positions,
    )
    key = (
        group[order].tobytes(),
        situation.positions.tobytes(),
        situation.previous_goals.tobytes(),
        min_savings.relocation,
    )
    plan = _LATEST_PLANS.get(planner)
    if plan is None or plan.key != key or plan.density is not density:
        weights = compute_node_weights(planner, density)
        plan = _TeamPlan(key=key, density=density, goals=place_team(planner, weights, situation, min_savings))
        _LATEST_PLANS[planner] = plan
    goals = np.empty_like(plan.goals)
    goals[order] = plan.goals
    return goals


def _list_others(teammates: Teammates, position: Array, time: float, *, is_agreed: bool) -> _Others:
    """Return the other robots, first those that a robot at `position`, (2,) m, plans for."""
    is_fixed = (time - teammates.rest_times >= MIN_REST_S) | (teammates.heard_times < time)
    is_quiet = bool(is_fixed.all())
    is_outside_group = np.full(len(teammates.robots), not is_agreed)
    squared_distances = ((teammates.positions - position) ** 2).sum(axis=1)
    nearest = np.argsort(squared_distances, kind="stable")[: MAX_PLANNING_GROUP - 1]
    is_outside_group[nearest] = False
    order = np.argsort(is_outside_group, kind="stable")
    return _Others(
        robots=teammates.robots[order],
        positions=teammates.positions[order],
        is_fixed=(is_fixed | is_outside_group)[order],
        is_quiet=is_quiet,
    )


def _has_changed(previous: PlannerState, state: PlannerState, radius: float) -> bool:
    """Return whether the team or the walls have changed since the last plan."""
    assert previous.basis is not None
    if state.knowledge.encountered != previous.knowledge.encountered:
        return True
    changed_walls = state.known_map.count_changed_walls(previous.basis.known_map)
    return changed_walls * state.known_map.raster.cell_size > _CHANGED_WALL_RADII * radius


def _may_skip_plan(
    previous: PlannerState, robots: IntArray, positions: Array, is_quiet: bool, *, max_move: float
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


def _build_team_window(known_map: DiscoveredMap, positions: Array, *, is_whole_team: bool) -> Window:
    """Build the window of the plan for a team, or for a group around its first robot, at (k, 2) m."""
    if is_whole_team:
        max_nodes = min(_NODES_PER_ROBOT * len(positions), _MAX_TEAM_NODES)
        max_nodes = max(_MIN_TEAM_NODES, max_nodes, _MIN_NODES_PER_ROBOT * len(positions))
        return Window.build_around(known_map.raster, positions[0], math.inf, max_nodes)
    extent = float(np.sqrt(((positions - positions[0]) ** 2).sum(axis=1).max()))
    reach = max(_GROUP_REACH * extent, _MIN_GROUP_REACH_M)
    return Window.build_around(known_map.raster, positions[0], reach, _GROUP_NODES)


@dataclass(frozen=True)
class AtlasShared(Atlas):
    """`Atlas` with shared maps: robots send each other their scans, and positions of others.

    Robots that all hear each other have the same map, and make the same plan for the whole team, however
    large it is. Relocations are then final, no robot plans for itself alone, and all learn from each
    viewpoint. A robot that does not hear all others behaves as with `Atlas`. It assumes that robots out of
    range are where one of its neighbors last heard them.

    Messages are those of the module `scan_exchange`, twice a second: 542 bytes for a scan, and with six
    robots 81 bytes for a digest of the scans that a robot has. With each plan, a robot that is heard by one
    which does not hear all others also sends a report: 28 bytes for each robot that it knows of.

    Parameters
    ----------
    period, threshold, nearby, rest, stake, patience, settling, clearance, k_prop, response_time
        See `Atlas`.

    See Also
    --------
    Atlas : The same controller without shared maps.

    Notes
    -----
    A robot that is stuck away from its goal for several plans is in a jam. It moves away from the robots
    around it for a while, each robot for a different time.

    Examples
    --------
    >>> import robocov as rc
    >>> rc.run("square", rc.AtlasShared(), robots=2, duration=1.0)
    <Record atlas-shared on Square, 2 robots, 1.0 s>
    """

    name = "atlas-shared"
    label = "Atlas, shared maps"
    summary = "as Atlas, with maps merged among the robots that hear each other"
    information = "shared map"
    is_staggered = False

    def begin(self, region: Region, team: Team) -> AtlasMemory:
        """Return the memory of robots that know neither walls nor other robots.

        Parameters
        ----------
        region : Region
            The known outer boundary.
        team : Team

        Returns
        -------
        AtlasMemory
            With an exchange of scans in which no robot has received any.
        """
        memory = super().begin(region, team)
        n = len(team)
        unknown_map = memory.states[0].known_map
        exchange = ScanExchange.start(unknown_map, n, robot_radii=team.radius.tolist())
        return replace(memory, exchange=exchange, reports=({},) * n)

    def _update_maps(self, seen: Observations, memory: AtlasMemory) -> AtlasMemory:
        """Return the memory with the scans and reports that have arrived; maps are updated before plans."""
        assert memory.exchange is not None
        exchange = memory.exchange.receive(seen)
        reports = memory.reports
        if seen.messages:
            reports = tuple(
                {**known_reports, **receive_reports(seen, robot)}
                for robot, known_reports in enumerate(memory.reports)
            )
        return replace(memory, exchange=exchange, reports=reports)

    def _list_due_robots(
        self, seen: Observations, memory: AtlasMemory, *, first_plan_time: float
    ) -> list[int]:
        assert memory.exchange is not None
        if not memory.exchange.has_scans:
            return []
        return super()._list_due_robots(seen, memory, first_plan_time=first_plan_time)

    def _plan_routes(self, seen: Observations, memory: AtlasMemory, due_robots: Sequence[int]) -> AtlasMemory:
        assert memory.exchange is not None
        exchange = memory.exchange.update_maps(due_robots)
        states = list(memory.states)
        for robot in due_robots:
            states[robot] = replace(states[robot], known_map=exchange.maps[robot])
        memory = replace(memory, states=tuple(states), exchange=exchange)
        planned = super()._plan_routes(seen, memory, due_robots)
        # A plan uses the reports that have arrived since the last one.
        reports = list(memory.reports)
        for robot in due_robots:
            reports[robot] = {}
        return replace(planned, reports=tuple(reports))

    def _list_reports(self, seen: Observations, memory: AtlasMemory, robot: int) -> list[TeammateReport]:
        hears_all = len(seen.neighbors.list_neighbors(robot)) == len(memory.states) - 1
        if hears_all:
            return []
        return [report for _, report in sorted(memory.reports[robot].items())]

    def _send_messages(
        self, seen: Observations, memory: AtlasMemory, due_robots: Sequence[int]
    ) -> tuple[AtlasMemory, tuple[tuple[Message, ...], ...]]:
        exchange = memory.exchange
        assert exchange is not None
        for robot in due_robots:
            neighbors = seen.neighbors.list_neighbors(robot).tolist()
            teammates = memory.states[robot].knowledge.teammates
            # Robots that hear all others need no reports.
            if len(teammates.robots) > 0 and not exchange.hear_all(robot, neighbors):
                report = teammates.build_report()
                exchange = exchange.add_message(robot, Message(report, report.size))
        if seen.scans is not None:
            exchange = exchange.add_scans(seen, seen.scans)
        exchange, messages = exchange.send(seen)
        return replace(memory, exchange=exchange), messages

    def _is_agreed(self, teammates: Teammates, seen: Observations, memory: AtlasMemory, robot: int) -> bool:
        return bool((teammates.heard_times == seen.time).all())
