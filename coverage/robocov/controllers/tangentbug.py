"""Voronoi coverage with TangentBug as local planner: Lloyd's algorithm that goes round obstacles."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum
from typing import NamedTuple

import numpy as np

from robocov.arrays import Array, ComplexArray, freeze
from robocov.compiled import kernel
from robocov.controllers.base import BaseController, Memory
from robocov.controllers.driving import (
    Margins,
    avoid_collisions,
    collect_obstacle_points,
    compute_approach_velocities,
    compute_drive_forces,
    update_returns,
)
from robocov.controllers.gains import gain, response_time_gain
from robocov.controllers.known_cells import cells_choice, compute_known_cells
from robocov.observation import Decision, Observations, Scanning, compute_headings
from robocov.team import Team

_GRAIN = 0.1  # side in metres of the squares in which a robot remembers what it has met
_EAGERNESS = 4.0  # speed in 1/s with which the distance to what is close may fall to the clearance
_BETTER = 0.2  # what counts as nearer to the goal must be so much nearer, m: else the modes take turns
_BACK = 0.3  # distance in metres at which a robot has come back to a place
_ARRIVED = 0.05  # distance in metres at which a robot has arrived
_WALK = 1.0  # way in metres along a boundary that is not worth trying
_WANES = 0.9  # part of its patience that is left to a robot after every goal that it has kept
_TOUCHING = 0.95  # a point that is already nearer than the clearance is kept off by this part of its distance
_DETOUR = "longest way along a boundary, in those to the goal; null: once round"


class Mode(Enum):
    """Mode of a robot."""

    GOAL = "motion to the goal"
    BOUNDARY = "boundary following"
    LEAVING = "leaving the boundary"
    RETURN = "back to the point of the boundary that is nearest to the goal"
    PROJECTED = "at that point"


@dataclass(frozen=True, slots=True, eq=False)
class Bug:
    """Memory of one robot's way; places are (2,) m."""

    mode: Mode
    turn: int  # round which way it looks for the end of what blocks it: 1 counter-clockwise, -1 clockwise
    way: Array  # where it is heading now
    passing: bool = False  # whether it goes on from there, and need not slow down
    aim: Array | None = None  # the goal that it keeps since it met something; None while it moves
    best: Array | None = None  # of all boundaries followed, and places left for, the nearest to it
    entered: Array | None = None  # where it met the boundary that it follows
    last: Array | None = None  # where it was when it looked last
    followed: float = 0.0  # length of its way along that boundary, m
    patience: float = math.inf  # the longest that it goes along one, m
    resting: Array | None = None  # the moving goal when it came to rest at `best`
    tries: int = 0  # how many goals it has kept so far

    def before(self, position: Array, goal: Array, moved: float) -> Bug:
        """Return the bug without the goal that it keeps, when that is done with and there is another one.

        A robot that rests tries again when its goal has moved by so many metres, and more with every try.
        """
        if self.aim is None:
            return self
        done = math.dist(position, self.aim) < _ARRIVED
        if self.mode is Mode.PROJECTED:
            if self.resting is None and math.dist(position, self.way) < _ARRIVED:
                return replace(self, resting=freeze(goal))
            done = done or (self.resting is not None and math.dist(goal, self.resting) > moved * self.tries)
        return Bug(Mode.GOAL, self.turn, self.way, tries=self.tries) if done else self


@dataclass(frozen=True, slots=True, eq=False)
class TangentBugMemory(Memory):
    """Memory of the robots, with the ways that they are on."""

    bugs: tuple[Bug, ...] = ()
    met: tuple[ComplexArray, ...] = ()  # (w,) squares in which each has met something: column + i row


@dataclass(frozen=True)
class TangentBug(BaseController):
    """Voronoi coverage of non-convex environments (Breitenmoser et al., ICRA 2010).

    The goal of every robot is the centroid of its Voronoi cell of the convex region, as Lloyd's
    algorithm has it, and TangentBug (Kamon, Rivlin and Rimon 1996) drives it there by what its scans see:

    - *Motion to the goal*: straight there, or, where something blocks the way, to that end of the
      blocking contour by way of which the goal is nearer, as long as this leads nearer to the goal.
    - *Boundary following*: where it does not, along the boundary, until some place in view is nearer to
      the goal than all of the boundary that was followed: d_reach < d_followed.
    - *Projection*: a robot that has been round in vain cannot reach its goal, which lies in an obstacle.
      It goes to the point of the boundary that is nearest to the goal, and rests. So it does at once
      where the goal lies in what it has met so far, or closer to that than a robot can be.

    Decided here: a robot's own centroid moves with it, and would pull it back from every detour, so that
    it keeps the goal from where it meets a boundary until it is there or has given up. It follows a
    boundary `detour` times as far as the goal is away, and then goes back; a way round a wall may be as
    long as the building. It tries again when its centroid has moved by `moved`. Scans are of the robot's
    own sensor; its body is accounted for by widening what they meet by radius and `clearance`.
    Robots that are near are gone round by sliding along them.

    Taken from the paper's abstract and what is generally known of both papers, not from their text. That
    others may be as large as the largest of the team is taken for granted.
    """

    name = "tangentbug"
    label = "LA + TangentBug"
    summary = "Lloyd's algorithm, with TangentBug to go round obstacles (Breitenmoser et al. 2010)"
    scanning = Scanning(rays=120, period=0.1)
    memory_type = TangentBugMemory

    clearance: float = gain(0.05, "m", "distance kept from obstacles and robots, rim to rim", high=10.0)
    jump: float = gain(0.5, "m", "depth of a step in the view that is an end of an obstacle", low=0.01)
    detour: float | None = gain(4.0, "distances", _DETOUR, optional=True)
    moved: float = gain(0.25, "m", "way of a goal given up after which it is tried again", high=1e4)
    k_prop: float = gain(2.0, "1/s", "wanted speed per metre of distance to the goal", high=100.0)
    response_time: float = response_time_gain()
    cells: str = cells_choice()

    def decide(self, seen: Observations, memory: TangentBugMemory) -> Decision:
        team, cells = memory.team, compute_known_cells(seen, self.cells, memory.triangulation)
        goals, returns, met = cells.centroid, update_returns(seen, memory.returns), memory.met
        points = collect_obstacle_points(seen, returns)
        bugs = memory.bugs or tuple(Bug(Mode.GOAL, 1, position) for position in seen.positions)
        if not memory.bugs or seen.scans is not None or returns is None:
            met = tuple(_remembered(near, met[i : i + 1]) for i, near in enumerate(points))
            each = zip(bugs, range(len(bugs)), goals, points, met, strict=True)
            bugs = tuple(self._after_look(seen, team, *bug) for bug in each)
        # until the next scan, who has its centroid in view follows it
        direct = np.array([bug.aim is None and not bug.passing for bug in bugs])
        passing = np.array([bug.passing for bug in bugs])
        offset = np.where(direct[:, None], goals, np.array([bug.way for bug in bugs])) - seen.positions
        # towards the next way-points, slowed before what is close
        distance = np.hypot(*offset.T)
        speed = np.where(passing, team.max_speed, np.minimum(self.k_prop * distance, team.max_speed))
        wanted = compute_approach_velocities(
            offset, math.inf, np.minimum(speed, distance / self.response_time)
        )
        keep = team.radius + 0.5 * self.clearance
        apart = keep + float(team.radius.max())
        wanted = avoid_collisions(wanted, seen, team, points, Margins(keep, apart, _EAGERNESS, 0.5))
        forces = compute_drive_forces(wanted, seen, team, self.response_time)
        kept = [own if bug.aim is None else bug.aim for bug, own in zip(bugs, goals, strict=True)]
        memory = TangentBugMemory(team, returns, cells.triangulation, bugs, met)
        return Decision(forces, np.array(kept), {"attraction": forces}, cells, memory)

    def _after_look(
        self, seen: Observations, team: Team, bug: Bug, i: int, goal: Array, points: Array, met: ComplexArray
    ) -> Bug:
        """Return what robot i does from now on."""
        position, directions = seen.positions[i], compute_headings(self.scanning.rays)
        bug = bug.before(position, goal, self.moved)
        goal = (goal if bug.aim is None else bug.aim) - position
        reach = min(float(team.sensing_range[i]), seen.region.diameter)
        keep = float(team.radius[i]) + self.clearance
        points = points - position
        free = free_distances(points, directions, keep, reach)
        walls = (np.column_stack([met.real, met.imag]) + 0.5) * _GRAIN - position
        return Look(self, position, goal, points, walls, directions, free, keep, reach).next(bug)


def _remembered(points: Array, met: tuple[ComplexArray, ...]) -> ComplexArray:
    """Return the squares that a robot has met something in, with those of (k, 2) points; nan for none."""
    square = np.floor(points[~np.isnan(points[:, 0])] / _GRAIN)
    return np.unique(np.concatenate([*met, square[:, 0] + 1j * square[:, 1]]))


class Gap(NamedTuple):
    """An end of the contour that blocks the way: the first ray past it, and a point just past it, m."""

    ray: int
    point: Array


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """One robot's scan: all places and distances are from it, in m."""

    law: TangentBug
    position: Array  # (2,), its own
    goal: Array  # (2,)
    points: Array  # (m, 2) obstacle points; nan where a ray met nothing
    walls: Array  # (w, 2), all that it has met so far, to within `_GRAIN`
    directions: Array  # (k, 2) unit vectors evenly round a full turn
    free: Array  # (k,), how far the robot can go straight on along each
    keep: float  # distance that its centre keeps from obstacles
    reach: float  # range of its sensor

    def next(self, bug: Bug) -> Bug:
        """Return what the robot does from now on."""
        free = self._towards(self.goal) >= self.reach - 1e-9
        if self._in_view(self.goal) or (bug.mode is Mode.GOAL and free):
            return self._off(bug, Mode.GOAL, self.position + self.goal)
        if bug.mode is Mode.PROJECTED:
            return bug
        if bug.mode is Mode.LEAVING:
            there = bug.way - self.position
            if math.hypot(*there) > _BACK and self._in_view(there):
                return bug
            # as good as reached: the next place to leave for must be nearer
            bug = replace(bug, mode=Mode.GOAL, best=bug.way)
        return self._to_goal(bug) if bug.mode is Mode.GOAL else self._along_boundary(bug)

    def _off(self, bug: Bug, mode: Mode, way: Array, passing: bool = False) -> Bug:
        """Return the bug on its way through free space."""
        return replace(bug, mode=mode, way=freeze(way), passing=passing, entered=None, followed=0.0)

    def _in_view(self, place: Array) -> bool:
        """Return whether the robot can go straight to a place."""
        far = math.hypot(*place)
        return far < _ARRIVED or self._towards(place) >= far - 1e-9

    def _towards(self, place: Array) -> float:
        """Return how far the robot can go straight on towards a place, m."""
        direction = place / max(math.hypot(*place), 1e-300)
        return float(free_distances(self.points, direction[None], self.keep, self.reach)[0])

    def _ends(self, towards: Array) -> dict[int, Gap]:
        """Return the ends of the contour that blocks the view in a direction, by the turn to them."""
        first, at = int((self.directions * towards).sum(axis=1).argmax()), self._towards(towards)
        known = at, self.law.jump, self.reach
        ends = {turn: end_of_contour(self.free, self.directions, first, turn, *known) for turn in (1, -1)}
        return {turn: end for turn, end in ends.items() if end is not None}

    def _to_goal(self, bug: Bug) -> Bug:
        ends = self._ends(self.goal)
        left = {turn: math.dist(self.goal, end.point) for turn, end in ends.items()}
        by_way_of = {turn: math.hypot(*end.point) + left[turn] for turn, end in ends.items()}
        if bug.turn in ends:
            # of two that are about as good, the one that it was going to
            by_way_of[bug.turn] -= _BETTER
        distance = math.hypot(*self.goal)
        nearer = [turn for turn in ends if left[turn] < distance]
        turn = min(nearer or ends, key=by_way_of.__getitem__, default=bug.turn)
        if nearer:
            way = self.position + ends[turn].point
            return self._off(replace(bug, turn=turn), Mode.GOAL, way, passing=True)
        here, goal = freeze(self.position), freeze(self.position + self.goal)
        tries = bug.tries + (bug.aim is None)
        patience = np.inf if self.law.detour is None else self.law.detour * distance * _WANES**tries
        bug = replace(bug, mode=Mode.BOUNDARY, turn=turn, passing=True, aim=goal, tries=tries)
        bug = replace(bug, entered=here, last=here, followed=0.0, patience=float(patience))
        inside = len(self.walls) and np.hypot(*(self.goal - self.walls).T).min() < self.keep + _GRAIN
        if inside or patience < _WALK:
            # the goal is in what the robot has met, or too close to it for any robot
            return self._at_best(replace(bug, best=self._best(bug, ends)))
        return self._along_boundary(bug)

    def _along_boundary(self, bug: Bug) -> Bug:
        entered = bug.entered
        assert entered is not None and bug.last is not None
        bug = replace(bug, followed=bug.followed + math.dist(self.position, bug.last), last=self.position)
        distances = np.hypot(*self.points.T)
        if np.isnan(distances).all():
            return self._off(bug, Mode.GOAL, self.position + self.goal)
        ends = self._ends(self.points[int(np.nanargmin(distances))])
        # of a closed contour all is in view
        end = ends[bug.turn].point if bug.turn in ends else np.zeros(2)
        best = self._best(bug, ends)
        bug = replace(bug, way=freeze(self.position + end), best=best)
        if bug.mode is Mode.RETURN:
            lost = bug.followed > 3.0 * bug.patience
            return self._at_best(replace(bug, best=freeze(self.position)) if lost else bug)
        # every ray where it is nearest to the goal
        along = np.clip((self.directions * self.goal).sum(axis=1), 0.0, self.free)
        left = np.hypot(*(self.goal - along[:, None] * self.directions).T)
        ray = int(left.argmin())
        if left[ray] < math.dist(self.position + self.goal, best) - _BETTER:
            there = self.position + along[ray] * self.directions[ray]
            return self._off(bug, Mode.LEAVING, there, passing=True)
        round_once = bug.followed > 2.0 * np.pi * _BACK and math.dist(self.position, entered) < _BACK
        if round_once or not ends or bug.followed > bug.patience:
            # who has not been round goes back the way that it came
            turn = bug.turn if round_once else -bug.turn
            return self._at_best(replace(bug, mode=Mode.RETURN, turn=turn))
        return bug

    def _best(self, bug: Bug, ends: dict[int, Gap]) -> Array:
        """Return the point of the boundary followed, and in view, that is nearest to the goal, (2,) m."""
        rays = np.arange(len(self.free))
        if len(ends) == 2:
            # from the one end round to the other
            first = ends[-1].ray + 1
            rays = np.sort((first + np.arange((ends[1].ray - first) % len(rays))) % len(rays))
        places = self.free[rays, None] * self.directions[rays]
        known = np.zeros(2) if bug.best is None else bug.best - self.position
        places = np.vstack([known, places])
        return freeze(self.position + places[np.hypot(*(self.goal - places).T).argmin()])

    def _at_best(self, bug: Bug) -> Bug:
        """Return the bug on the last piece of its way to the best point, when that is in view."""
        assert bug.best is not None
        there = bug.best - self.position
        far, free = math.hypot(*there), self._towards(there)
        # seen from here the boundary may be a little closer than it looked
        if far < _ARRIVED or free >= far - self.keep:
            way = freeze(self.position + there * min(1.0, free / max(far, 1e-300)))
            return replace(bug, mode=Mode.PROJECTED, way=way, passing=False, entered=None, resting=None)
        return bug if bug.mode is Mode.RETURN else replace(bug, mode=Mode.RETURN)


@kernel
def free_distances(points: Array, directions: Array, clearance: float, reach: float) -> Array:
    """Return how far a disc can go straight on along each of (k, 2) directions, (k,) m, `reach` at most.

    Its centre keeps a clearance (m) from (m, 2) m obstacle points, which are relative to it; nan where none.
    """
    result = np.empty(len(directions))
    for k in range(len(directions)):
        ahead_x, ahead_y = directions[k]
        result[k] = reach
        for x, y in points:
            along = ahead_x * x + ahead_y * y
            across = ahead_x * y - ahead_y * x
            keep = min(clearance, _TOUCHING * math.sqrt(x * x + y * y))
            depth2 = keep * keep - across * across
            # nan is not above 0
            if along > 0.0 and depth2 > 0.0:
                result[k] = min(result[k], max(along - math.sqrt(depth2), 0.0))
    return result


def end_of_contour(
    free: Array, directions: Array, first: int, turn: int, blocked_at: float, jump: float, reach: float
) -> Gap | None:
    """Return where the contour ends that blocks a ray, going round by `turn`; None when it is closed.

    The `first` ray, of the (k,) m free ones in (k, 2) directions, is the nearest to the direction that is
    blocked, `blocked_at` so many metres. The contour ends where the next ray is free for longer by `jump`,
    or so far that it meets nothing, `reach`.
    """
    rays = (first + turn * np.arange(len(free))) % len(free)
    ahead, before = free[rays], np.append(blocked_at, free[rays[:-1]])
    ends = np.flatnonzero((ahead > before + jump) | (ahead >= reach))
    if not len(ends):
        return None
    k = ends[0]
    return Gap(int(rays[k]), directions[rays[k]] * min(ahead[k], before[k] + jump))
