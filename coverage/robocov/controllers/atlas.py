"""Atlas: every robot plans the placement of its team on the map that it has discovered itself."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray
from robocov.controllers.base import BaseController
from robocov.controllers.driving import update_returns
from robocov.controllers.gains import gain, response_time_gain
from robocov.controllers.localization import Estimates, assume_closer_neighbours, estimate_positions
from robocov.controllers.route_following import follow_routes
from robocov.controllers.shared_map import (
    CERTAIN_RANGE_FRACTION,
    MAX_SILENCE_S,
    Circle,
    build_unknown_map,
    list_circles,
    update_maps,
)
from robocov.controllers.teammates import Teammates
from robocov.density import Density
from robocov.observation import Decision, Observations, Scanning, Scans
from robocov.observation.region import Region
from robocov.planning.discovered_map import DiscoveredMap
from robocov.planning.grid_planner import GridPlanner
from robocov.planning.own_goal import OwnGoal, find_own_goal
from robocov.planning.team_placement import MinSavings, TeamSituation, compute_node_weights, place_team
from robocov.planning.viewpoint import find_viewpoint
from robocov.planning.window import Window
from robocov.team import Team

MAX_PLANNING_GROUP = 8
"""Number of robots that a robot with a map of its own plans for: itself and the nearest others."""
MIN_REST_S = 3.0
"""Time after which a robot that has not moved is at rest."""

_MIN_TEAM_NODES = 1000
_MAX_TEAM_NODES = 4000
"""Nodes of the lattice for a whole team, unless `_MIN_NODES_PER_ROBOT` asks for more."""
_NODES_PER_ROBOT = 160
_MIN_NODES_PER_ROBOT = 27
_GROUP_NODES = 500
"""Nodes of the lattice for a group within a larger team."""
_OWN_NODES = 2500
"""Nodes of the lattice on which a robot finds its own goal."""
_GROUP_REACH = 2.0
"""A group is planned for in a window this many times as far as its robots are,"""
_MIN_GROUP_REACH_M = 1.0
"""but at least as far as this."""
_MAX_IDLE_MOVE = 0.1
"""Fraction of the spacing of nodes that others may move without a new plan."""
_CHANGED_WALL_RADII = 4.0
"""Length of changed walls, in radii: longer than the visible side of a robot that has failed."""
_ARRIVAL_RADIUS_M = 0.35
_LISTENING_S = 2.0
"""Time that robots whose messages are late stay where they start."""
_SHARED_PATIENCE_FACTOR = 2.5
"""Factor of the patience if all robots learn of a look."""
_MIN_PROGRESS_M = 0.05
"""A robot that moves less between two plans, away from its goal, does not get on."""
_MAX_STUCK_PLANS = 3
"""Number of such plans after which it is in a jam,"""
_JAM_RADIUS_M = 0.7
"""with the robots within this distance,"""
_MAX_EVASION_S = 8.0
"""and makes way for at most this time."""
_SWAP_SAVING = 0.1
"""Fraction of the squared path lengths that an exchange of goals must save."""
_JOINT_PLANNING_CROSSINGS = 3.0
"""A robot plans for others as long as it takes to cross the region this many times."""
_STAGGERING = 0.5
"""Fraction of the period in which all robots make their first plans."""
_GOLDEN_FRACTION = (math.sqrt(5.0) - 1.0) / 2.0


@dataclass(frozen=True, eq=False)
class PlannerState:
    """Memory of one robot. Immutable."""

    known_map: DiscoveredMap
    next_plan_time: float
    """s"""
    teammates: Teammates
    met: frozenset[int] = frozenset()
    """Robots that it has ever heard, or heard of, and that have not failed."""
    gone: Mapping[int, float] = field(default_factory=dict)
    """When it took a robot for failed, or missed it, s. Never changed in place."""
    start_time: float = 0.0
    """When it started, or the team or the walls changed, s."""
    path_length: float = 0.0
    """How far it has moved since then, m."""
    looking_length: float = 0.0
    """How far of that it has moved to look around, m."""
    planned_map: DiscoveredMap | None = None
    """The map when the last plan was made."""
    planner: GridPlanner | None = None
    team_planner: GridPlanner | None = None
    group: IntArray | None = None
    """(k,) Robots at the last plan, this one first."""
    positions: Array | None = None
    """(k, 2) m, where they were."""
    was_quiet: bool = False
    """Whether all others were at rest then."""
    planned_robots: IntArray | None = None
    """(p,) Robots that the last plan was made for."""
    planned_goals: Array | None = None
    """(p, 2) m, their goals in it."""
    own_goal: Array | None = None
    """(2,) m"""
    viewpoint: Array | None = None
    """(2,) m, where it goes first, to look around."""
    former_viewpoints: tuple[Array, ...] = ()
    is_idle: bool = False
    """Whether the next plan may be skipped if nothing has changed."""
    stuck_plans: int = 0
    """Number of plans for which it has not got on, away from its goal."""
    evasion_end: float = 0.0
    """Time until which it makes way for others, s."""

    def __deepcopy__(self, memo: object) -> PlannerState:
        return self


@dataclass(frozen=True, slots=True, eq=False)
class AtlasMemory:
    """Memory of the robots."""

    team: Team
    """A robot knows its own limits."""
    states: tuple[PlannerState, ...]
    """One of each robot."""
    routes: tuple[Array, ...]
    """Waypoints of each robot, (w, 2) m, the last one the goal."""
    legs: IntArray
    """(n,) Number of the waypoint that each robot heads for."""
    returns: Array | None = None
    """(n, rays, 2) m, what the last scan of each robot has met."""
    estimates: Estimates | None = None
    """Position estimates, if robots know each other by messages."""

    @property
    def maps(self) -> tuple[DiscoveredMap, ...]:
        """The map that each robot has discovered."""
        return tuple(state.known_map for state in self.states)

    @property
    def reports(self) -> tuple[Teammates, ...]:
        """What each robot knows of the others, which it reports if maps are shared."""
        return tuple(state.teammates for state in self.states)


class _Others(NamedTuple):
    """The other robots from the view of one, those that it plans for first."""

    robots: IntArray
    positions: Array
    """(k, 2) m"""
    is_fixed: BoolArray
    """(k,) Whether each is at rest, was not heard now, or is not planned for."""
    is_quiet: bool
    """Whether all of them are at rest."""


class _TeamPlan(NamedTuple):
    """The latest plan on a planner that several robots share."""

    key: tuple[object, ...]
    density: Density | None
    goals: Array
    """(k, 2) m, by the numbers of the robots."""


_LATEST_PLANS: WeakKeyDictionary[GridPlanner, _TeamPlan] = WeakKeyDictionary()


@dataclass(frozen=True)
class Atlas(BaseController):
    """Each robot plans for its whole team on its own discovered map, and goes to its own goal in that plan.

    Twice a second every robot scans, and adds what it sees to its own grid (`DiscoveredMap`). Cells where the
    robots that it hears are become free. Robots send nothing but positions. A robot that gets out of range is
    presumed to go to its goal in the plan, and forgotten when it is missed there. Once in `period` seconds a
    robot looks for positions P with a low coverage cost (22) on its own map,

        J(P) = sum over q of w_q min_j d(q, p_j),

    where q are the nodes of a lattice, d the geodesic distances among the walls that it knows, and w_q the
    areas, times φ; unknown cells count by their openness: insides of obstacles hardly do (`openness`).

    1. *A plan for the team.* Lloyd's iteration from the former plan on, in turn with interchange (the
       k-median problem), on a coarse lattice. A robot at rest (`MIN_REST_S`) is where it wants to be, and
       keeps its position in the plan. Relocations must save the fraction `threshold` of J, one within its own
       cell the fraction `nearby`. Goals are assigned such that the sum of the squared path lengths is
       minimal, which stays so on the way. When there has been time to cross the region a few times, each
       robot decides for itself alone, by what it knows to be free, and relocates out of its cell only while
       all others are at rest.
    2. *Its own goal.* The local minimum of J by its own position, on a fine lattice, between its nodes by a
       parabola; a goal that saves less than the fraction `rest` of the cost of its own cell is not worth a
       move.
    3. *A look.* At its goal, it goes to look at what is still unknown of its own cell, as long as the stake
       is higher than the fraction `stake` of J, which doubles with the distance that it moves to look
       (`patience`). A robot that is alone does not look: its goal hardly depends on what it has not seen.
    4. *The route* is the shortest one on its map, braking before walls and other robots (`route_following`).

    Private maps agree more and more where it matters, and so do the plans. If they do not, the team comes to
    rest by 1, and because the saving that relocations and goals require doubles with the path length of a
    robot, not with time (`settling`): a robot at rest stays as ready to move as it was. It starts again when
    robots join or fail, and when a robot sees a wall appear or disappear. In a team of more than
    `MAX_PLANNING_GROUP` robots each plans for itself and its nearest ones, in the part of the map where these
    are; the others are where they are.
    """

    name = "atlas"
    label = "Atlas"
    summary = "plans the team's placement on the map that each robot discovers itself"
    scanning = Scanning(rays=240, period=0.5)
    staggered: ClassVar[bool] = True  # whether robots plan at different times

    period: float = gain(1.0, "s", "between two plans of a robot", low=0.05, high=60.0)
    threshold: float = gain(0.01, "1", "part of the cost that a relocation must save", high=1.0)
    nearby: float = gain(0.003, "1", "part of the cost that a relocation in its own cell must save", high=1.0)
    rest: float = gain(0.002, "1", "part of its own cell's cost that a new goal must save", high=1.0)
    stake: float = gain(0.004, "1", "part of the cost that is worth a look", high=1.0)
    patience: float = gain(
        0.12, "1", "way of looks, in diameters of the region, that doubles it", low=1e-3, high=1e4
    )
    settling: float = gain(
        0.5, "1", "way, in diameters, that doubles what relocations and goals must save", low=1e-3, high=1e6
    )
    clearance: float = gain(0.03, "m", "that routes keep between rim and walls", high=10.0)
    k_prop: float = gain(2.0, "1/s", "wanted speed per metre of distance to the goal", high=100.0)
    response_time: float = response_time_gain()

    def begin(self, region: Region, team: Team) -> AtlasMemory:
        """Return the memory of robots that have seen nothing yet."""
        unknown_map = build_unknown_map(region)
        nobody = Teammates.build_empty()
        states = []
        for robot in range(len(team)):
            delay = 0.0
            if self.staggered:
                delay = self.period * _STAGGERING * (robot * _GOLDEN_FRACTION % 1.0)
            states.append(PlannerState(unknown_map, delay, nobody))
        routes = (np.full((1, 2), np.nan),) * len(team)
        return AtlasMemory(team, tuple(states), routes, np.zeros(len(team), dtype=np.intp))

    def decide(self, seen: Observations, memory: AtlasMemory) -> Decision:
        estimates = memory.estimates
        first_plan_time = 0.0 if estimates is None else _LISTENING_S
        if seen.reported_positions is not None:
            previous = estimates or Estimates.build_initial(len(seen.positions))
            seen, estimates = estimate_positions(seen, previous, memory.team)
            first_plan_time = _LISTENING_S
        states = list(memory.states)
        if seen.scans is not None:
            maps = self._update_maps(list(memory.maps), seen, seen.scans, memory.team.radius)
            states = [
                replace(state, known_map=known_map) for state, known_map in zip(states, maps, strict=True)
            ]
        routes = list(memory.routes)
        legs = memory.legs.copy()
        for robot, state in enumerate(states):
            if seen.time >= max(state.next_plan_time, first_plan_time) - 1e-9:
                reports = self._list_reports(states, seen.neighbours.list_neighbours(robot))
                states[robot], goal = self._plan(seen, memory.team, state, robot, reports)
                planner = states[robot].planner
                if goal is not None and planner is not None:
                    routes[robot] = planner.find_route(seen.positions[robot], goal)
                    legs[robot] = 0
            elif state.planned_map is None:
                routes[robot] = seen.positions[robot : robot + 1]
        returns = update_returns(seen, memory.returns)
        cautious = seen
        if estimates is not None and seen.reported_positions is not None:
            cautious = assume_closer_neighbours(seen, estimates)
        command = follow_routes(cautious, memory.team, routes, legs, returns, self.k_prop, self.response_time)
        return Decision(
            command.forces,
            command.goals,
            {"attraction": command.forces},
            memory=AtlasMemory(
                team=memory.team,
                states=tuple(states),
                routes=tuple(routes),
                legs=command.legs,
                returns=returns,
                estimates=estimates,
            ),
        )

    def _update_maps(
        self, maps: list[DiscoveredMap], seen: Observations, scans: Scans, radius: Array
    ) -> list[DiscoveredMap]:
        """Return the maps after a scan of each robot; cells where others are become free."""
        later = []
        for robot, known_map in enumerate(maps):
            scanned = known_map.add_scan(seen.positions[robot], scans.distances[robot], scans.hit[robot])
            neighbours = seen.get_neighbour_positions(robot)
            later.append(scanned.add_robots(neighbours, float(radius[robot])))
        return later

    def _list_reports(self, states: Sequence[PlannerState], heard: IntArray) -> list[Teammates]:
        """Return what the robots that are heard report of others."""
        return []

    def _is_agreed(self, teammates: Teammates, seen: Observations) -> bool:
        """Return whether all robots plan on the same map, and therefore make the same plan."""
        return False

    def _plan(
        self, seen: Observations, team: Team, before: PlannerState, robot: int, reports: Sequence[Teammates]
    ) -> tuple[PlannerState, Array | None]:
        """Return the state of a robot after its plan, and where to go; None if its route stays."""
        position = seen.positions[robot]
        raster = before.known_map.raster
        max_speed = float(team.max_speed[robot])
        radius = float(team.radius[robot])
        state = self._update_teammates(seen, team, before, robot, reports)
        is_agreed = self._is_agreed(state.teammates, seen)
        others = _list_others(state.teammates, position, seen.time, is_agreed=is_agreed)
        window = Window.build_around(raster, position, math.inf, _OWN_NODES)
        spacing = window.stride * raster.cell_size
        step_length = 0.0 if before.positions is None else math.dist(position, before.positions[0])
        state = replace(
            state,
            next_plan_time=seen.time + self._compute_period(before, robot, spacing / max_speed),
            path_length=before.path_length + step_length,
            was_quiet=others.is_quiet,
        )
        if _has_changed(before, state, radius):
            state = replace(
                state, start_time=seen.time, path_length=0.0, looking_length=0.0, former_viewpoints=()
            )
        group = np.concatenate([[robot], others.robots])
        positions = np.vstack([position, others.positions])
        if _is_unchanged(before, group, positions, others.is_quiet, max_move=_MAX_IDLE_MOVE * spacing):
            return replace(state, path_length=before.path_length), None
        clearance = radius + self.clearance
        planner = state.planner or GridPlanner.get_shared(state.known_map, window, clearance)
        planner = planner.update(state.known_map, window)
        state = replace(state, planned_map=state.known_map, positions=positions, group=group, planner=planner)
        joint_planning_time = _JOINT_PLANNING_CROSSINGS * seen.region.diameter / max_speed
        is_joint = is_agreed or seen.time - state.start_time <= joint_planning_time
        if not is_joint:
            is_fixed = np.ones_like(others.is_fixed)  # Each robot decides for itself alone.
        elif is_agreed:
            is_fixed = np.zeros_like(others.is_fixed)
        else:
            is_fixed = others.is_fixed
        settling = 2.0 ** min(state.path_length / (self.settling * seen.region.diameter), 60.0)
        state = self._plan_for_team(state, seen, is_fixed, settling, is_joint=is_joint, is_agreed=is_agreed)
        goals = state.planned_goals
        assert goals is not None
        first_node = planner.find_nearest_node(goals[0])
        if first_node < 0:
            return replace(state, own_goal=position, is_idle=False), position
        other_positions = others.positions.copy()
        other_positions[~is_fixed] = goals[1:][~is_fixed[: len(goals) - 1]]
        own = find_own_goal(
            planner,
            compute_node_weights(planner, seen.density),
            other_positions,
            first_node,
            np.full(2, np.nan) if state.own_goal is None else state.own_goal,
            min(1.0, self.rest * settling),
        )
        state = replace(state, own_goal=own.goal)
        if is_agreed and before.positions is not None:
            state, evasion_goal = self._find_evasion_goal(state, step_length, seen.time, robot)
            if evasion_goal is not None:
                return state, evasion_goal
        walked = state.path_length - before.path_length
        return self._choose_goal(state, own, position, walked, is_agreed=is_agreed)

    def _compute_period(self, before: PlannerState, robot: int, time_to_next_node: float) -> float:
        """Return the time until the next plan, s: no robot gets farther than to the next node meanwhile."""
        period = max(self.period, time_to_next_node)
        if before.planned_map is None and self.staggered:
            period = period * (1.0 + (robot + 1) * _GOLDEN_FRACTION % 1.0)
        return period

    def _update_teammates(
        self, seen: Observations, team: Team, state: PlannerState, robot: int, reports: Sequence[Teammates]
    ) -> PlannerState:
        """Return the state with what a robot now knows of the others: where they are, and who is gone.

        A robot that falls silent and cannot have got out of range has failed. Others are presumed to be where
        they were going, and are forgotten, but not taken for failed, when they are not heard there.
        """
        teammates = state.teammates
        position = seen.positions[robot]
        communication_range = float(team.communication_range[robot])
        robots = seen.neighbours.list_neighbours(robot)
        silence = np.where(np.isin(teammates.robots, robots), 0.0, seen.time - teammates.heard_times)
        max_distance = teammates.heard_distances + 2.0 * float(team.max_speed[robot]) * silence
        has_failed = (silence > 0.0) & (max_distance < communication_range)
        if state.planned_robots is not None and state.planned_goals is not None:
            _, here, there = np.intersect1d(teammates.robots, state.planned_robots, return_indices=True)
            teammates = teammates._replace(positions=teammates.positions.copy())
            teammates.positions[here] = state.planned_goals[there]
        distance = np.sqrt(((teammates.positions - position) ** 2).sum(axis=1))
        is_missed = (silence > MAX_SILENCE_S) & (distance < CERTAIN_RANGE_FRACTION * communication_range)
        is_gone = has_failed | is_missed
        met = state.met - {*teammates.robots[has_failed].tolist()}
        gone = {**state.gone, **dict.fromkeys(teammates.robots[is_gone].tolist(), seen.time)}
        neighbours = seen.get_neighbour_positions(robot)
        teammates = teammates.add_observation(robots, neighbours, position, seen.time, is_gone)
        if reports:
            teammates = teammates.add_reports(reports, robot, gone)
        return replace(state, teammates=teammates, met=met | {*teammates.robots.tolist()}, gone=gone)

    def _plan_for_team(
        self,
        state: PlannerState,
        seen: Observations,
        is_fixed: BoolArray,
        settling: float,
        *,
        is_joint: bool,
        is_agreed: bool,
    ) -> PlannerState:
        """Return the state with a plan for the team, or for the robot and its nearest ones."""
        assert state.planner is not None and state.positions is not None and state.group is not None
        size = len(state.group) if is_agreed else min(len(state.group), MAX_PLANNING_GROUP)
        group = state.group[:size]
        positions = state.positions[:size]
        window = _build_team_window(state.known_map, positions, is_whole_team=size == len(state.group))
        planner = (state.team_planner or state.planner).update(state.known_map, window)
        fixed = np.concatenate([[False], is_fixed])[:size]
        goals = positions.copy()
        if state.planned_robots is not None and state.planned_goals is not None:
            _, here, there = np.intersect1d(group, state.planned_robots, return_indices=True)
            is_free = ~fixed[here]
            former_goals = state.planned_goals[there]
            goals[here[is_free]] = former_goals[is_free]
        if is_agreed:
            settling = 1.0  # Each robot moves along another path, but all make one plan.
        # A relocation of one of many robots saves less.
        relocation = self.threshold * min(1.0, MAX_PLANNING_GROUP / len(group)) * settling
        may_relocate = is_joint or state.was_quiet
        min_savings = MinSavings(
            relocation=min(1.0, relocation) if may_relocate else 1.0,
            own_cell=min(1.0, self.nearby * settling),
            swap=_SWAP_SAVING * is_agreed,
        )
        # Robots that plan on the same map make the same plan, which is computed once.
        order = np.argsort(group) if is_agreed else np.arange(len(group))
        situation = TeamSituation(
            positions=positions[order],
            former_goals=goals[order],
            is_fixed=fixed[order],
            other_positions=state.positions[size:],
        )
        key = (
            group[order].tobytes(),
            situation.positions.tobytes(),
            situation.former_goals.tobytes(),
            min_savings.relocation,
        )
        plan = _LATEST_PLANS.get(planner) if is_agreed else None
        if plan is None or plan.key != key or plan.density is not seen.density:
            # A robot that decides for itself does not leave for cells that may not be free.
            weights = compute_node_weights(planner, seen.density, only_known=not is_joint)
            plan = _TeamPlan(key, seen.density, place_team(planner, weights, situation, min_savings))
            if is_agreed:
                _LATEST_PLANS[planner] = plan
        planned_goals = np.empty_like(goals)
        planned_goals[order] = plan.goals
        return replace(state, team_planner=planner, planned_robots=group, planned_goals=planned_goals)

    def _find_evasion_goal(
        self, state: PlannerState, step_length: float, time: float, robot: int
    ) -> tuple[PlannerState, Array | None]:
        """Return the state, and where to make way for others in the same jam; None if it is in none."""
        assert state.positions is not None and state.own_goal is not None
        positions = state.positions
        position = positions[0]
        is_stuck = step_length < _MIN_PROGRESS_M and math.dist(position, state.own_goal) > _ARRIVAL_RADIUS_M
        state = replace(state, stuck_plans=state.stuck_plans + 1 if is_stuck else 0)
        if state.stuck_plans >= _MAX_STUCK_PLANS:
            # Each robot makes way for another time, so that they do not all come back at once.
            duration = _MAX_EVASION_S * ((robot + time) * _GOLDEN_FRACTION % 1.0)
            state = replace(state, stuck_plans=0, evasion_end=time + duration)
        is_close = ((positions - position) ** 2).sum(axis=1) < _JAM_RADIUS_M**2
        away = position - positions[is_close].mean(axis=0)
        if not (time < state.evasion_end and away.any()):
            return state, None
        goal = position + away * (_JAM_RADIUS_M / float(np.hypot(*away)))
        return replace(state, stuck_plans=0, is_idle=False), goal

    def _choose_goal(
        self, state: PlannerState, own: OwnGoal, position: Array, walked: float, *, is_agreed: bool
    ) -> tuple[PlannerState, Array]:
        """Return the state, and where to go: to the own goal, or first to a viewpoint."""
        planner = state.planner
        assert planner is not None and state.group is not None
        if state.viewpoint is None and math.dist(own.goal, position) > _ARRIVAL_RADIUS_M:
            return replace(state, is_idle=False), own.goal
        former_viewpoints = state.former_viewpoints
        looking_length = state.looking_length
        if state.viewpoint is not None:
            looking_length += max(walked, 0.0)
            if math.dist(state.viewpoint, position) < _ARRIVAL_RADIUS_M:
                former_viewpoints = (*former_viewpoints, state.viewpoint)
        viewpoint = None
        node = planner.find_own_node(position)
        # The goal of a robot that is alone hardly depends on what it has not seen.
        if node >= 0 and self.stake < 1.0 and len(state.group) > 1:
            patience = self.patience * (_SHARED_PATIENCE_FACTOR if is_agreed else 1.0)
            doubling_length = patience * state.known_map.raster.region.diameter
            min_stake = self.stake * own.cost * 2.0 ** min(looking_length / doubling_length, 60.0)
            path_lengths = planner.get_distances(node)
            viewpoint = find_viewpoint(
                planner, own.cell_distances, path_lengths, min_stake, former_viewpoints
            )
        state = replace(
            state,
            viewpoint=viewpoint,
            former_viewpoints=former_viewpoints,
            looking_length=looking_length,
            is_idle=viewpoint is None,
        )
        return state, own.goal if viewpoint is None else viewpoint


def _list_others(teammates: Teammates, position: Array, time: float, *, is_agreed: bool) -> _Others:
    """Return the others, those that a robot at (2,) m plans for first."""
    is_fixed = (time - teammates.rest_times >= MIN_REST_S) | (teammates.heard_times < time)
    is_quiet = bool(is_fixed.all())
    is_beyond = np.full(len(teammates.robots), not is_agreed)
    square = ((teammates.positions - position) ** 2).sum(axis=1)
    nearest = np.argsort(square, kind="stable")[: MAX_PLANNING_GROUP - 1]
    is_beyond[nearest] = False
    order = np.argsort(is_beyond, kind="stable")
    return _Others(
        robots=teammates.robots[order],
        positions=teammates.positions[order],
        is_fixed=(is_fixed | is_beyond)[order],
        is_quiet=is_quiet,
    )


def _has_changed(before: PlannerState, state: PlannerState, radius: float) -> bool:
    """Return whether this is the first plan, or team or walls have changed: there may be much to do again."""
    if before.planned_map is None or state.met != before.met:
        return True
    changed_walls = state.known_map.count_changed_walls(before.planned_map)
    return changed_walls * state.known_map.raster.cell_size > _CHANGED_WALL_RADII * radius


def _is_unchanged(
    before: PlannerState, group: IntArray, positions: Array, is_quiet: bool, *, max_move: float
) -> bool:
    """Return whether a robot is idle, and nothing has changed since its last plan."""
    if before.group is None or before.positions is None:
        return False
    return (
        before.is_idle
        and before.planned_map is before.known_map
        and before.was_quiet == is_quiet
        and np.array_equal(before.group, group)
        and bool(np.abs(positions - before.positions).max() < max_move)
    )


def _build_team_window(known_map: DiscoveredMap, positions: Array, *, is_whole_team: bool) -> Window:
    """Build the window in which a team, or a group at (k, 2) m around the first one, is planned for."""
    if is_whole_team:
        max_nodes = min(_NODES_PER_ROBOT * len(positions), _MAX_TEAM_NODES)
        max_nodes = max(_MIN_TEAM_NODES, max_nodes, _MIN_NODES_PER_ROBOT * len(positions))
        return Window.build_around(known_map.raster, positions[0], math.inf, max_nodes)
    extent = float(np.sqrt(((positions - positions[0]) ** 2).sum(axis=1).max()))
    reach = max(_GROUP_REACH * extent, _MIN_GROUP_REACH_M)
    return Window.build_around(known_map.raster, positions[0], reach, _GROUP_NODES)


@dataclass(frozen=True)
class AtlasShared(Atlas):
    """`Atlas`, but robots that hear each other also send each other their maps, and where others are.

    As long as a robot hears all robots that it has met, all have the same map and make the same plan for the
    whole team, however large: relocations are final, no robot has to decide for itself alone, and all learn
    of a look. A robot that has not got on for some plans, away from its goal, is in a jam, and makes way for
    a while, each robot for another time. A robot that does not hear all others acts like `Atlas` on the map
    that it has, and presumes the robots that it does not hear where they were last heard by one that it
    hears.
    """

    name = "atlas-shared"
    label = "Atlas, shared maps"
    summary = "as Atlas, with the maps merged among the robots that hear each other"
    information = "shared map"
    staggered = False  # one plan is for all

    def _update_maps(
        self, maps: list[DiscoveredMap], seen: Observations, scans: Scans, radius: Array
    ) -> list[DiscoveredMap]:
        circles = list_circles(seen.neighbours)
        # Robots that share a map also share the next one.
        later: dict[tuple[int, Circle, float], DiscoveredMap] = {}
        result = []
        scanned_maps = update_maps(maps, seen, scans, circles)
        for known_map, circle, size in zip(scanned_maps, circles, radius.tolist(), strict=True):
            key = (id(known_map), circle, size)
            if key not in later:
                later[key] = known_map.add_robots(seen.positions[list(circle)], size)
            result.append(later[key])
        return result

    def _list_reports(self, states: Sequence[PlannerState], heard: IntArray) -> list[Teammates]:
        if len(heard) == len(states) - 1:  # A robot that hears all others needs no reports.
            return []
        return [states[other].teammates for other in heard.tolist()]

    def _is_agreed(self, teammates: Teammates, seen: Observations) -> bool:
        return bool((teammates.heard_times == seen.time).all())
