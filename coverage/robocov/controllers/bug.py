"""TangentBug: what one robot that looks for a way to its goal remembers, and how it goes on."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from robocov.arrays import Array, frozen
from robocov.controllers.tangents import Gap, end_of_contour, free_distances

_BETTER = 0.2
"""What counts as nearer to the goal must be so much nearer, m: else the modes take turns."""

_BACK = 0.3
"""Distance in metres at which a robot has come back to a place."""

_ARRIVED = 0.05
"""Distance in metres at which a robot has arrived."""

_WALK = 1.0
"""Way in metres along a boundary that is not worth trying."""

_WANES = 0.9
"""Part of its patience that is left to a robot after every goal that it has kept."""


class Mode(Enum):
    """What a robot is doing."""

    GOAL = "motion to the goal"
    BOUNDARY = "boundary following"
    LEAVING = "leaving the boundary"
    RETURN = "back to the point of the boundary that is nearest to the goal"
    PROJECTED = "at that point"


@dataclass(frozen=True, slots=True, eq=False)
class Bug:
    """What one robot remembers of its way.

    Attributes
    ----------
    mode : Mode
    turn : {1, -1}
        Which way round it looks for the end of what blocks it: counter-clockwise or clockwise.
    way : (2,) m
        Where it is heading now.
    passing : bool
        Whether it goes on from there, so that it need not slow down.
    aim : (2,) m or None
        The goal that it keeps, since it met something on the way there; None while its goal moves.
    best : (2,) m or None
        Of all boundaries followed for that goal, and all places left for, the point nearest to it.
    entered, last : (2,) m or None
        Where it met the boundary that it follows, and where it was when it looked last.
    followed, patience : float, m
        Length of its way along that boundary, and the longest that it goes.
    resting : (2,) m or None
        The moving goal when it came to rest at `best`.
    tries : int
        How many goals it has kept so far.
    """

    mode: Mode
    turn: int
    way: Array
    passing: bool = False
    aim: Array | None = None
    best: Array | None = None
    entered: Array | None = None
    last: Array | None = None
    followed: float = 0.0
    patience: float = np.inf
    resting: Array | None = None
    tries: int = 0

    def before(self, position: Array, goal: Array, moved: float) -> Bug:
        """Return the bug without the goal that it keeps, when that is done with and there is another one.

        Parameters
        ----------
        position, goal : (2,) m
            The robot's, and where it should be going now.
        moved : float, m
            Way of the goal after which a robot that rests tries again, and so much more with every try.
        """
        if self.aim is None:
            return self
        done = _length(position - self.aim) < _ARRIVED
        if self.mode is Mode.PROJECTED:
            if self.resting is None and _length(position - self.way) < _ARRIVED:
                return replace(self, resting=frozen(goal))
            done = done or (self.resting is not None and _length(goal - self.resting) > moved * self.tries)
        return Bug(Mode.GOAL, self.turn, self.way, tries=self.tries) if done else self


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """What one robot sees in one scan.

    Attributes
    ----------
    position : (2,) m
    goal : (2,) m
        From the robot.
    points : (m, 2) m
        Obstacle points, from the robot; nan where a ray met nothing.
    walls : (w, 2) m
        All that it has met so far, from the robot, to within `grain`.
    directions : (k, 2)
        Unit vectors evenly round a full turn, and
    free : (k,) m
        how far the robot can go straight on along each.
    keep, reach : float, m
        Distance that its centre keeps from obstacles, and range of its sensor.
    grain, jump : float, m
        Rounding of what is remembered; depth of a step in the view that is an end of an obstacle.
    detour : float or None
        Longest way along a boundary, in parts of the distance to the goal; None for no limit.
    """

    position: Array
    goal: Array
    points: Array
    walls: Array
    directions: Array
    free: Array
    keep: float
    reach: float
    grain: float
    jump: float
    detour: float | None

    def next(self, bug: Bug) -> Bug:
        """Return what the robot does from now on."""
        if self._in_view(self.goal) or (bug.mode is Mode.GOAL and self._ahead_is_free()):
            return self._off(bug, Mode.GOAL, self.position + self.goal)
        if bug.mode is Mode.PROJECTED:
            return bug
        if bug.mode is Mode.LEAVING:
            there = bug.way - self.position
            if _length(there) > _BACK and self._in_view(there):
                return bug
            # as good as reached: the next place to leave for must be nearer
            bug = replace(bug, mode=Mode.GOAL, best=bug.way)
        return self._to_goal(bug) if bug.mode is Mode.GOAL else self._along_boundary(bug)

    def _off(self, bug: Bug, mode: Mode, way: Array, passing: bool = False) -> Bug:
        """Return the bug on its way through free space."""
        return replace(bug, mode=mode, way=frozen(way), passing=passing, entered=None, followed=0.0)

    def _in_view(self, place: Array) -> bool:
        """Return whether the robot can go straight to a place."""
        far = _length(place)
        return far < _ARRIVED or self._towards(place) >= far - 1e-9

    def _ahead_is_free(self) -> bool:
        """Return whether the robot can go as far towards its goal as it sees."""
        return self._towards(self.goal) >= self.reach - 1e-9

    def _towards(self, place: Array) -> float:
        """Return how far the robot can go straight on towards a place, m."""
        direction = place / max(_length(place), 1e-300)
        return float(free_distances(self.points, direction[None], self.keep, self.reach)[0])

    def _ends(self, towards: Array) -> dict[int, Gap]:
        """Return the ends of the contour that blocks the view in a direction, by the turn to them."""
        first, at = int((self.directions @ towards).argmax()), self._towards(towards)
        found = {}
        for turn in (1, -1):
            end = end_of_contour(self.free, self.directions, first, turn, at, self.jump, self.reach)
            if end is not None:
                found[turn] = end
        return found

    def _to_goal(self, bug: Bug) -> Bug:
        ends = self._ends(self.goal)
        by_way_of = {turn: _length(end.point) + _length(self.goal - end.point) for turn, end in ends.items()}
        # of two that are about as good, the one that it was going to
        by_way_of = {turn: far - (_BETTER if turn == bug.turn else 0.0) for turn, far in by_way_of.items()}
        distance = _length(self.goal)
        nearer = [turn for turn, end in ends.items() if _length(self.goal - end.point) < distance]
        if nearer:
            turn = min(nearer, key=lambda turn: by_way_of[turn])
            way = self.position + ends[turn].point
            return self._off(replace(bug, turn=turn), Mode.GOAL, way, passing=True)
        turn = min(ends, key=lambda turn: by_way_of[turn], default=bug.turn)
        here, goal = frozen(self.position), frozen(self.position + self.goal)
        tries = bug.tries + (bug.aim is None)
        patience = np.inf if self.detour is None else self.detour * distance * _WANES**tries
        bug = replace(bug, mode=Mode.BOUNDARY, turn=turn, passing=True, aim=goal, tries=tries)
        bug = replace(bug, entered=here, last=here, followed=0.0, patience=float(patience))
        inside = len(self.walls) and np.hypot(*(self.goal - self.walls).T).min() < self.keep + self.grain
        if inside or patience < _WALK:
            # the goal is in what the robot has met, or too close to it for any robot
            return self._at_best(replace(bug, best=self._best(bug, ends)))
        return self._along_boundary(bug)

    def _along_boundary(self, bug: Bug) -> Bug:
        entered = bug.entered
        assert entered is not None and bug.last is not None
        bug = replace(bug, followed=bug.followed + _length(self.position - bug.last), last=self.position)
        distances = np.hypot(*self.points.T)
        if np.isnan(distances).all():
            return self._off(bug, Mode.GOAL, self.position + self.goal)
        ends = self._ends(self.points[int(np.nanargmin(distances))])
        # of a closed contour all is in view
        end = ends[bug.turn].point if bug.turn in ends else np.zeros(2)
        best = self._best(bug, ends)
        bug = replace(bug, way=frozen(self.position + end), best=best)
        if bug.mode is Mode.RETURN:
            lost = bug.followed > 3.0 * bug.patience
            return self._at_best(replace(bug, best=frozen(self.position)) if lost else bug)
        # every ray where it is nearest to the goal
        along = np.clip(self.directions @ self.goal, 0.0, self.free)
        left = np.hypot(*(self.goal - along[:, None] * self.directions).T)
        ray = int(left.argmin())
        if left[ray] < _length(self.position + self.goal - best) - _BETTER:
            there = self.position + along[ray] * self.directions[ray]
            return self._off(bug, Mode.LEAVING, there, passing=True)
        round_once = bug.followed > 2.0 * np.pi * _BACK and _length(self.position - entered) < _BACK
        if round_once or not ends or bug.followed > bug.patience:
            # who has not been round goes back the way that it came
            turn = bug.turn if round_once else -bug.turn
            return self._at_best(replace(bug, mode=Mode.RETURN, turn=turn))
        return bug

    def _best(self, bug: Bug, ends: dict[int, Gap]) -> Array:
        """Return the point of the boundary followed, and in view, that is nearest to the goal, (2,) m."""
        seen = np.ones(len(self.free), dtype=bool)
        if len(ends) == 2:
            # from the one end round to the other
            span = (ends[1].ray - ends[-1].ray - 1) % len(seen)
            seen[:] = False
            seen[(ends[-1].ray + 1 + np.arange(span)) % len(seen)] = True
        places = self.free[seen, None] * self.directions[seen]
        known = np.zeros(2) if bug.best is None else bug.best - self.position
        places = np.concatenate([known[None], places])
        return frozen(self.position + places[np.hypot(*(self.goal - places).T).argmin()])

    def _at_best(self, bug: Bug) -> Bug:
        """Return the bug on the last piece of its way to the best point, when that is in view."""
        assert bug.best is not None
        there = bug.best - self.position
        far, free = _length(there), self._towards(there)
        # seen from here the boundary may be a little closer than it looked
        if far < _ARRIVED or free >= far - self.keep:
            way = frozen(self.position + there * min(1.0, free / max(far, 1e-300)))
            return replace(bug, mode=Mode.PROJECTED, way=way, passing=False, entered=None, resting=None)
        return bug if bug.mode is Mode.RETURN else replace(bug, mode=Mode.RETURN)


def _length(vector: Array) -> float:
    return float(np.hypot(vector[0], vector[1]))
