"""Atlas: every robot plans the placement of its team on the map that it has discovered itself."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray
from robocov.controllers.base import Law
from robocov.controllers.driving import update_returns
from robocov.controllers.gains import gain, response_time_gain
from robocov.controllers.localization import Estimates, assume_closer_neighbours, estimate_positions
from robocov.controllers.route_following import follow_routes
from robocov.controllers.shared_map import Circle, list_circles, update_maps
from robocov.observation import Decision, Observations, Scanning, Scans
from robocov.observation.region import Region
from robocov.planning.discovered_map import DiscoveredMap
from robocov.planning.grid_planner import GridPlanner
from robocov.planning.own_goal import OwnGoal, find_own_goal
from robocov.planning.raster import Raster
from robocov.planning.team_placement import MinSavings, TeamSituation, compute_node_weights, place_team
from robocov.planning.viewpoint import find_viewpoint
from robocov.planning.window import Window
from robocov.team import Team

FINEST_CELL, MOST_CELLS = 0.05, 1_000_000  # side of a cell of the maps, m, larger in very large regions
TEAM_NODES, GROUP_NODES, OWN_NODES = 1000, 500, 2500  # of lattices: for a team, for its group, for itself
ROBOT_NODES, ENOUGH, FEWEST = 160, 4000, 27  # a large team's: so many a robot, up to so many, at least these
STILL_FOR, STILL_WITHIN = 3.0, 0.1  # who does not get so many metres away for so many seconds rests

_AROUND, _LEAST = 2.0, 1.0  # a group is planned for in a window so many times as far as it is, and that, m
# who is not heard for so many seconds where it would be, to so much of the range
_MISSED, _IN_RANGE = 5.0, 0.8
_HARDLY = 0.1  # part of the spacing of the nodes that others may move before a plan is made anew
_WALLS = 4.0  # radii of the robot: longer than the side of another one that shows, which has failed
_ARRIVED = 0.35  # metres from a place at which it counts as reached
MAX_PLANNING_GROUP = 8  # who plans by a map of its own plans for itself and so many less one that it hears
_LISTENED = 2.0  # seconds that robots whose messages are late stay where they begin
_LOOKED_FOR_ALL = 2.5  # so many times the patience where all learn of a look
# who gets on less than so far, m, for so many plans is in a jam with those so far around, m
_GETS_ON, _JAMMED, _CROWD = 0.05, 3, 0.7
_SWAPPING = 0.1  # part of the squared ways that robots must save to swap the places of one plan
_BACKOFF = 8.0  # s, at most, that it makes way then
_JOINTLY = 3.0  # a robot plans for others as long as it takes to cross the region so many times
_STAGGERED = 0.5  # part of the period in which all robots make their first plans
_GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0
_LATEST_PLANS: WeakKeyDictionary[GridPlanner, Any] = WeakKeyDictionary()


class Teammates(NamedTuple):
    """Knowledge of a robot about (k,) others."""

    robots: IntArray  # their numbers, ascending
    at: Array  # where they are, or are presumed to be, (k, 2) m
    heard: Array  # when they were last heard, s,
    away: Array  # and how far away that was, m
    since: Array  # since when they have been, to within `STILL_WITHIN`, s,
    places: Array  # at (k, 2) m

    def updated(self, robots: IntArray, at: Array, place: Array, time: float, gone: BoolArray) -> Teammates:
        """Return it after one more look at some from a place; of the rest, the `gone` are left out."""
        kept, new = ~(np.isin(self.robots, robots) | gone), np.full(len(robots), time)
        seen = Teammates(robots, at, new, np.sqrt(((at - place) ** 2).sum(axis=1)), new, at)
        both = [np.concatenate([mine, theirs[kept]]) for mine, theirs in zip(seen, self, strict=True)]
        order = np.argsort(both[0])
        later = Teammates(*(each[order] for each in both))
        _, here, there = np.intersect1d(later.robots, self.robots, assume_unique=True, return_indices=True)
        still = np.sqrt(((later.at[here] - self.places[there]) ** 2).sum(axis=1)) < STILL_WITHIN
        here, there = here[still], there[still]
        later.places[here], later.since[here] = self.places[there], self.since[there]
        return later

    def joined(self, reports: Sequence[Teammates], i: int, gone: Mapping[int, float]) -> Teammates:
        """Return it with what robot i is told of others that were heard later, and after they were `gone`."""
        every: list[Sequence[Any]] = [self]
        for report in reports:
            since = [math.inf if j == i else gone.get(j, -1.0) for j in report.robots.tolist()]
            new = report.heard > np.array(since)
            told = report._replace(away=np.full(len(new), math.inf))
            every.append([each[new] for each in told])
        merged = [np.concatenate(each) for each in zip(*every, strict=True)]
        order = np.lexsort((-merged[2], merged[0]))  # stable: of reports as late the first one counts
        order = order[np.unique(merged[0][order], return_index=True)[1]]
        return Teammates(*(each[order] for each in merged))


@dataclass(frozen=True, eq=False)
class PlannerState:
    """Memory of one robot. Immutable."""

    known: DiscoveredMap
    due: float  # when it plans next, s
    others: Teammates
    met: frozenset[int] = frozenset()  # whom it has ever heard, or heard of, that has not failed,
    gone: Mapping[int, float] = field(default_factory=dict)  # when it took one for failed, or missed it, s
    since: float = 0.0  # when it began, or the team, or the walls, became others, s,
    walked: float = 0.0  # how far it has walked since then, m,
    looked: float = 0.0  # and how much of that to look around
    planned: DiscoveredMap | None = None  # the map when the last plan was made,
    ways: GridPlanner | None = None  # and what was computed of it
    team_ways: GridPlanner | None = None
    situation: Array | None = None  # (k, 2) m, where the robots were at the last plan, this one first,
    group: IntArray | None = None  # (k,), who they were,
    quiet: bool = False  # whether all others rested then,
    places: Array | None = None  # (k, 3), and where they were to be: number, x, y
    own: Array | None = None  # (2,) m, its own place in the plan,
    node: int = -1  # and the node there
    look: Array | None = None  # (2,) m, where it goes first, to look around,
    former: tuple[Array, ...] = ()  # from where it has,
    idle: bool = False  # whether the next plan may be left out where nothing has changed
    jammed: int = 0  # how many plans it has not got on for, away from its place
    backing: float = 0.0  # until when it makes way, s

    def __deepcopy__(self, memo: object) -> PlannerState:
        return self


@dataclass(frozen=True, slots=True, eq=False)
class AtlasMemory:
    """Memory of the robots."""

    team: Team  # a robot knows its own limits
    states: tuple[PlannerState, ...]  # one for each robot
    routes: tuple[Array, ...]  # the way-points of each, (w, 2) m, the last one the goal
    legs: IntArray  # (n,), the way-point that is headed for
    returns: Array | None = None  # (n, rays, 2) m, what the last scan of each met
    estimates: Estimates | None = None  # where robots know each other by messages

    @property
    def maps(self) -> tuple[DiscoveredMap, ...]:
        """The map that each robot has discovered."""
        return tuple(state.known for state in self.states)

    @property
    def reports(self) -> tuple[Teammates, ...]:
        """Last known positions of the others, of each robot, which it tells where maps are shared."""
        return tuple(state.others for state in self.states)


@dataclass(frozen=True)
class Atlas(Law):
    """Each robot plans for its whole team on its own discovered map, and goes to its own place in that plan.

    Twice a second every robot scans, and enters what it sees into its own grid (`DiscoveredMap`). It also
    watches where the robots that it hears are: there it is free. Nothing but positions is ever told. Who gets
    out of range is presumed to come to its place in the plan, and forgotten when it is missed there. Once in
    `period` seconds a robot looks for places P with a low coverage cost (22) on its own map,

        J(P) = sum over q of w_q min_j d(q, p_j),

    where q are the nodes of a lattice, d the geodesic distances among the walls that it knows, and w_q the
    areas, times φ; what is unknown counts by its openness: insides of obstacles hardly do (`openness`).

    1. *A plan for all.* From its former plan on, Lloyd's iteration in turn with interchange (the k-median
       problem), on a coarse lattice. Who has rested for `STILL_FOR` seconds has said where it wants to be,
       and is there in the plan. Relocations must save the part `threshold` of J, one in its own cell the
       part `nearby`. Who goes where is such that the sum of the squared ways is least, which stays so on the
       way. Once there has been time to cross the region some times, each decides for itself alone, by what
       it knows to be free, and relocates out of its cell only while all others rest.
    2. *Its own place.* The local minimum of J by its own place, on a fine lattice, between its nodes by a
       parabola; a goal that saves less than the part `rest` of what its own cell costs is not worth moving.
    3. *A look.* When it is there, it looks at what is still unknown of its own cell, as long as what is at
       stake is more than the part `stake` of J, which doubles as it walks to look (`patience`). A robot alone
       does not look: its place hardly depends on what it has not seen.
    4. *The way* is the shortest on its map, braking before walls and other robots (`route_following`).

    Private maps agree ever more where it matters, and so do the plans. Where they do not, the team comes to
    rest by 1, and as what a relocation or a goal must save doubles with the way that a robot walks, not with
    time (`settling`): who rests stays as ready to move as it was. It begins anew when robots join or fail,
    and when a robot sees a wall come or go. Of more than `MAX_PLANNING_GROUP` robots each plans for itself
    and its nearest ones, in the part of the map where these are; the others are where they are.
    """

    name = "atlas"
    label = "Atlas"
    summary = "plans the team's placement on the map that each robot discovers itself"
    scanning = Scanning(rays=240, period=0.5)
    staggered: ClassVar[bool] = True  # whether robots plan at different moments

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
        low_x, low_y, high_x, high_y = region.bounds
        cell = max(FINEST_CELL, math.sqrt((high_x - low_x) * (high_y - low_y) / MOST_CELLS))
        empty = DiscoveredMap.build_unknown(Raster(region, cell))
        nowhere, never = np.empty((0, 2)), np.empty(0)
        nobody = Teammates(np.empty(0, dtype=np.intp), nowhere, never, never, never, nowhere)
        first = [self.period * _STAGGERED * (i * _GOLDEN % 1.0) * self.staggered for i in range(len(team))]
        states = tuple(PlannerState(empty, due, nobody) for due in first)
        routes = (np.full((1, 2), np.nan),) * len(team)
        return AtlasMemory(team, states, routes, np.zeros(len(team), dtype=np.intp))

    def decide(self, seen: Observations, memory: AtlasMemory) -> Decision:
        estimates = memory.estimates
        if seen.reported_positions is not None:
            seen, estimates = estimate_positions(
                seen, estimates or Estimates.build_initial(len(seen.positions)), memory.team
            )
        states, scans = list(memory.states), seen.scans
        if scans is not None:
            maps = self._surveyed([state.known for state in states], seen, scans, memory.team.radius)
            states = [replace(state, known=known) for state, known in zip(states, maps, strict=True)]
        routes, legs = list(memory.routes), memory.legs.copy()
        for i, state in enumerate(states):
            if seen.time >= max(state.due, 0.0 if estimates is None else _LISTENED) - 1e-9:
                reports = self._reports(states, seen.neighbours.list_neighbours(i))
                states[i], goal = self._planned(seen, memory.team, state, i, reports)
                ways = states[i].ways
                if goal is not None and ways is not None:
                    routes[i], legs[i] = ways.find_route(seen.positions[i], goal), 0
            elif state.planned is None:
                routes[i] = seen.positions[i : i + 1]
        team, returns = memory.team, update_returns(seen, memory.returns)
        drive = self.k_prop, self.response_time
        near = (
            seen
            if estimates is None or seen.reported_positions is None
            else assume_closer_neighbours(seen, estimates)
        )
        forces, goals, legs = follow_routes(near, team, routes, legs, returns, *drive)
        after = AtlasMemory(team, tuple(states), tuple(routes), legs, returns, estimates)
        return Decision(forces, goals, {"attraction": forces}, memory=after)

    def _surveyed(
        self, maps: list[DiscoveredMap], seen: Observations, scans: Scans, radius: Array
    ) -> list[DiscoveredMap]:
        """Return the maps after a scan of each robot; where others are, it is free."""
        each = zip(maps, seen.positions, scans.distances, scans.hit, strict=True)
        maps = [known.add_scan(*scan) for known, *scan in each]
        return [
            known.add_robots(seen.get_neighbour_positions(i), float(radius[i]))
            for i, known in enumerate(maps)
        ]

    def _reports(self, states: Sequence[PlannerState], heard: IntArray) -> list[Teammates]:
        """Return what robots that are heard tell of others."""
        return []

    def _agreed(self, others: Teammates, seen: Observations) -> bool:
        """Return whether all plan on the same map, so that all come to the same plan."""
        return False

    def _planned(
        self, seen: Observations, team: Team, state: PlannerState, i: int, reports: Sequence[Teammates]
    ) -> tuple[PlannerState, Array | None]:
        """Return what robot i remembers after its plan, and where to go; None for where it goes already."""
        place, raster, fastest = seen.positions[i], state.known.raster, float(team.max_speed[i])
        before = state
        state = self._met(seen, team, state, i, reports)
        known, met = state.others, state.met
        others, at = known.robots, known.at
        still = (seen.time - known.since >= STILL_FOR) | (known.heard < seen.time)
        quiet, agreed = bool(still.all()), self._agreed(known, seen)
        # those that it plans for come first
        beyond = np.full(len(at), not agreed)
        beyond[np.argsort(((at - place) ** 2).sum(axis=1), kind="stable")[: MAX_PLANNING_GROUP - 1]] = False
        order = np.argsort(beyond, kind="stable")
        others, at, still = others[order], at[order], (still | beyond)[order]
        window = Window.build_around(raster, place, math.inf, OWN_NODES)
        spacing = window.stride * raster.cell_size
        # nobody gets farther than to the next node meanwhile
        period = max(self.period, spacing / fastest)
        first = state.planned is None
        due = seen.time + period * (1.0 + (i + 1) * _GOLDEN % 1.0 if first and self.staggered else 1.0)
        walked = state.walked
        if state.situation is not None:
            walked += math.dist(place, state.situation[0])
        state = replace(state, due=due, walked=walked, quiet=quiet)
        # a team, or walls, that have changed: there may be much to do again
        walls = 0 if state.planned is None else state.known.count_changed_walls(state.planned)
        if first or met != before.met or walls * raster.cell_size > _WALLS * float(team.radius[i]):
            state = replace(state, since=seen.time, walked=0.0, looked=0.0, former=())
        situation, group = np.vstack([place, at]), np.concatenate([[i], others])
        same = before.idle and before.planned is before.known and before.quiet == quiet
        if same and before.group is not None and np.array_equal(before.group, group):
            assert before.situation is not None
            if np.abs(situation - before.situation).max() < _HARDLY * spacing:
                return replace(state, walked=before.walked), None
        state = replace(state, planned=state.known, situation=situation, group=group)
        clearance = float(team.radius[i]) + self.clearance
        ways = state.ways or GridPlanner.get_shared(state.known, window, clearance)
        ways = ways.update(state.known, window)
        state = replace(state, ways=ways)
        weights = compute_node_weights(ways, seen.density)
        settling = 2.0 ** min(state.walked / (self.settling * seen.region.diameter), 60.0)
        together = agreed or seen.time - state.since <= _JOINTLY * seen.region.diameter / fastest
        # afterwards each decides for itself alone
        still = still & (not agreed) if together else np.ones_like(still)
        state, places = self._plan_for_all(state, seen, still, settling, together=together, agreed=agreed)
        begin = ways.find_nearest_node(places[0])
        at[~still] = places[1:][~still[: len(places) - 1]]
        if begin < 0:
            return replace(state, own=place, idle=False), place
        former = np.full(2, np.nan) if state.own is None else state.own
        own = find_own_goal(ways, weights, at, begin, former, min(1.0, self.rest * settling))
        state = replace(state, own=own.goal, node=own.node)
        if agreed and before.situation is not None:
            state, aside = self._aside(state, before.situation[0], seen.time, i)
            if aside is not None:
                return state, aside
        return self._looking(state, own, place, state.walked - before.walked, agreed=agreed)

    def _met(
        self, seen: Observations, team: Team, state: PlannerState, i: int, reports: Sequence[Teammates]
    ) -> PlannerState:
        """Return what robot i knows of the others now: where they are, whom it has met, and who is gone.

        Who falls silent and cannot have got out of range has failed. Others are presumed to be where they
        were going, and are forgotten, not taken for failed, when they are not heard there.
        """
        known, hears, place = state.others, float(team.communication_range[i]), seen.positions[i]
        robots, at = seen.neighbours.list_neighbours(i), seen.get_neighbour_positions(i)
        silence = np.where(np.isin(known.robots, robots), 0.0, seen.time - known.heard)
        failed = (silence > 0.0) & (known.away + 2.0 * float(team.max_speed[i]) * silence < hears)
        if state.places is not None:
            _, here, there = np.intersect1d(known.robots, state.places[:, 0], return_indices=True)
            known = known._replace(at=known.at.copy())
            known.at[here] = state.places[there, 1:]
        away = np.sqrt(((known.at - place) ** 2).sum(axis=1))
        missed = (silence > _MISSED) & (away < _IN_RANGE * hears)
        lost = known.robots[failed | missed].tolist()
        met = state.met - {*known.robots[failed].tolist()}
        gone = {**state.gone, **dict.fromkeys(lost, seen.time)}
        known = known.updated(robots, at, place, seen.time, failed | missed)
        if reports:
            known = known.joined(reports, i, gone)
        return replace(state, others=known, met=met | {*known.robots.tolist()}, gone=gone)

    def _plan_for_all(
        self, state: PlannerState, seen: Observations, still: BoolArray, settling: float,
        *, together: bool, agreed: bool,
    ) -> tuple[PlannerState, Array]:  # fmt: skip
        """Return the state with a plan for the team, and the places in it, (k, 2) m, the own one first."""
        known = state.known
        assert state.ways is not None and state.situation is not None and state.group is not None
        most = len(state.group) if agreed else MAX_PLANNING_GROUP
        group, (now, others) = state.group[:most], np.split(state.situation, [most])
        nodes = min(ROBOT_NODES * len(now), ENOUGH)
        reach, nodes = math.inf, max(TEAM_NODES, nodes, FEWEST * len(now))
        if len(others):
            away = float(np.sqrt(((now - now[0]) ** 2).sum(axis=1).max()))
            reach, nodes = max(_AROUND * away, _LEAST), GROUP_NODES
        window = Window.build_around(known.raster, now[0], reach, nodes)
        ways = (state.team_ways or state.ways).update(known, window)
        fixed = np.concatenate([[False], still])[: len(now)]
        begin = now.copy()
        if state.places is not None:
            robots, places = state.places[:, 0].astype(np.intp), state.places[:, 1:]
            _, here, there = np.intersect1d(group, robots, return_indices=True)
            free = ~fixed[here]
            begin[here[free]] = places[there[free]]
        # who decides alone goes nowhere else while others do
        settling = 1.0 if agreed else settling  # as each robot walks another way
        worth = self.threshold * min(1.0, MAX_PLANNING_GROUP / len(group))  # of many robots each saves less
        threshold = min(1.0, worth * settling) if together or state.quiet else 1.0
        nearby = min(1.0, self.nearby * settling)
        # who plans on the same map comes to the same plan, which is made once
        order = np.argsort(group) if agreed else np.arange(len(group))
        key = (*(each[order].tobytes() for each in (group, now, begin)), threshold)
        latest = _LATEST_PLANS.get(ways) if agreed else None
        made = latest[1] if latest is not None and latest[0] == key else None
        if made is None or made[0] is not seen.density:
            # who is there already does not leave for what may not be there
            weights = compute_node_weights(ways, seen.density, only_known=not together)
            own = TeamSituation(now[order], begin[order], fixed[order], others)
            made = (
                seen.density,
                place_team(ways, weights, own, MinSavings(threshold, nearby, _SWAPPING * agreed)),
            )
            if agreed:
                _LATEST_PLANS[ways] = key, made
        places = np.empty_like(begin)
        places[order] = made[1]
        return replace(state, team_ways=ways, places=np.column_stack([group, places])), places

    def _aside(
        self, state: PlannerState, before: Array, time: float, i: int
    ) -> tuple[PlannerState, Array | None]:
        """Return the state, and where to make way to for those in the same jam; None where it is in none."""
        situation = state.situation
        assert situation is not None and state.own is not None
        place = situation[0]
        stands = math.dist(place, before) < _GETS_ON and math.dist(place, state.own) > _ARRIVED
        state = replace(state, jammed=state.jammed + 1 if stands else 0)
        if state.jammed >= _JAMMED:
            # each for another time, so that they do not all come back at once
            state = replace(state, jammed=0, backing=time + _BACKOFF * ((i + time) * _GOLDEN % 1.0))
        crowd = situation[((situation - place) ** 2).sum(axis=1) < _CROWD**2]
        back = place - crowd.mean(axis=0)
        if not (time < state.backing and back.any()):
            return state, None
        return replace(state, jammed=0, idle=False), place + back * (_CROWD / float(np.hypot(*back)))

    def _looking(
        self, state: PlannerState, own: OwnGoal, place: Array, step: float, *, agreed: bool
    ) -> tuple[PlannerState, Array]:
        """Return the state, and where to go: to the own place, or first to what there is to see."""
        ways, former, look = state.ways, state.former, None
        assert ways is not None and state.group is not None
        node = ways.find_own_node(place)
        if state.look is not None and math.dist(state.look, place) < _ARRIVED:
            former = (*former, state.look)
        if state.look is None and math.dist(own.goal, place) > _ARRIVED:
            return replace(state, idle=False), own.goal
        looked = state.looked + max(step, 0.0) * (state.look is not None)
        # the place of who is alone hardly depends on what it has not seen
        if node >= 0 and self.stake < 1.0 and len(state.group) > 1:
            far = self.patience * (_LOOKED_FOR_ALL if agreed else 1.0) * state.known.raster.region.diameter
            least = self.stake * own.cost * 2.0 ** min(looked / far, 60.0)
            look = find_viewpoint(ways, own.cell_distances, ways.get_distances(node), least, former)
        state = replace(state, look=look, former=former, looked=looked, idle=look is None)
        return state, own.goal if look is None else look


@dataclass(frozen=True)
class AtlasShared(Atlas):
    """`Atlas`, but robots that hear each other also tell each other their maps, and where others are.

    As long as a robot hears all that it has met, all have the same map, and all make the same plan, for the
    whole team, however large: relocations are for good, nobody has to decide for itself alone, and everybody
    learns of a look. Who has not got on for some plans, away from its place, is in a jam, and makes way for
    a while, each for another one. Whoever does not hear all of them goes by `Atlas` on the map that it has,
    and presumes those that it does not hear where they were last heard by anybody who tells it.
    """

    name = "atlas-shared"
    label = "Atlas, shared maps"
    summary = "as Atlas, with the maps merged among the robots that hear each other"
    information = "shared map"
    staggered = False  # one plan is for all

    def _surveyed(
        self, maps: list[DiscoveredMap], seen: Observations, scans: Scans, radius: Array
    ) -> list[DiscoveredMap]:
        around, visited = list_circles(seen.neighbours), dict[tuple[int, Circle, float], DiscoveredMap]()
        told = update_maps(maps, seen, scans, around)
        # those who share a map share the next one, too
        for known, circle, size in (each := list(zip(told, around, radius.tolist(), strict=True))):
            if (id(known), circle, size) not in visited:
                visited[id(known), circle, size] = known.add_robots(seen.positions[list(circle)], size)
        return [visited[id(known), circle, size] for known, circle, size in each]

    def _reports(self, states: Sequence[PlannerState], heard: IntArray) -> list[Teammates]:
        if len(heard) == len(states) - 1:  # who hears all need not be told
            return []
        return [states[j].others for j in heard.tolist()]

    def _agreed(self, others: Teammates, seen: Observations) -> bool:
        return bool((others.heard == seen.time).all())
