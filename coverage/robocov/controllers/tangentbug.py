"""Voronoi coverage with TangentBug as local planner: Lloyd's algorithm for robots that avoid obstacles."""

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
from robocov.observation import Decision, Observations, Scanning, compute_ray_directions
from robocov.team import Team

_SQUARE_SIDE_M = 0.1
"""Side of the squares in which a robot stores the obstacle points that it has detected."""
_MIN_IMPROVEMENT_M = 0.2
"""Minimum difference for a point to count as nearer to the goal; smaller values let modes alternate."""
_RETURN_RADIUS_M = 0.3
"""Distance from a point within which a robot has returned to it."""
_ARRIVAL_RADIUS_M = 0.05
"""Distance from a point at which a robot has arrived."""
_MIN_BOUNDARY_LENGTH_M = 1.0
"""Minimum length of a boundary that is worth following."""
_PATIENCE_DECAY = 0.9
"""Factor of the length for which boundaries are followed, with each attempt to reach a goal."""
_CONTACT_FRACTION = 0.95
"""Fraction of its present distance to which a robot may approach a point that is within the clearance."""


_MIN_LENGTH = 1e-300
"""Lower limit of lengths in divisions, which only that of a zero vector is below."""
_ROUNDING_M = 1e-9
"""Length by which a free distance may be too small because of rounding."""
_MAX_RETURN_FACTOR = 3.0
"""A robot gives up its return after the maximum length of its boundary, times this factor."""


class Mode(Enum):
    """Mode of a robot."""

    GOAL = "motion to the goal"
    BOUNDARY = "boundary following"
    LEAVING = "leaving the boundary"
    RETURN = "return to the point of the boundary that is nearest to the goal"
    PROJECTED = "arrival at that point"


@dataclass(frozen=True, slots=True, eq=False)
class BugState:
    """Navigation state of one robot; points are (2,) arrays in m. Immutable."""

    mode: Mode
    turn: int
    """Direction in which it passes obstacles: 1 if they are on its right, counter-clockwise; else -1."""
    waypoint: Array
    """Point that it heads for."""
    is_passing: bool = False
    """Whether it continues from the waypoint, and need not slow down there."""
    fixed_goal: Array | None = None
    """Its goal while it passes an obstacle; None while the goal is its centroid."""
    best_point: Array | None = None
    """The point nearest to the fixed goal of all boundaries that it followed or left."""
    entry_point: Array | None = None
    """Point at which it began to follow the boundary."""
    last_position: Array | None = None
    """Its position at the last scan."""
    followed_length: float = 0.0
    """Length of its path along the boundary, m."""
    max_followed_length: float = math.inf
    """Length, m, after which it gives up following the boundary."""
    resting_centroid: Array | None = None
    """Its centroid when it came to rest at `best_point`."""
    attempts: int = 0
    """Number of goals that it has fixed so far."""

    def release_goal(self, position: Array, centroid: Array, min_move: float) -> BugState:
        """Return the state without the fixed goal if that is reached, or given up and out of date.

        Parameters
        ----------
        position : (2,) array, m
        centroid : (2,) array, m
            The moving goal, the centroid of the robot's cell.
        min_move : float, m
            A robot at rest tries again if its centroid has moved by this, times the number of attempts.
        """
        if self.fixed_goal is None:
            return self
        is_done = math.dist(position, self.fixed_goal) < _ARRIVAL_RADIUS_M
        if self.mode is Mode.PROJECTED:
            if self.resting_centroid is None:
                if math.dist(position, self.waypoint) < _ARRIVAL_RADIUS_M:
                    return replace(self, resting_centroid=freeze(centroid))
            elif math.dist(centroid, self.resting_centroid) > min_move * self.attempts:
                is_done = True
        if not is_done:
            return self
        return BugState(Mode.GOAL, self.turn, self.waypoint, attempts=self.attempts)


@dataclass(frozen=True, slots=True, eq=False)
class TangentBugMemory(Memory):
    """Memory of the robots, with their navigation states."""

    bugs: tuple[BugState, ...] = ()
    obstacle_squares: tuple[ComplexArray, ...] = ()
    """(w,) Squares in which each robot has detected obstacle points, as complex numbers column + i row."""


@dataclass(frozen=True)
class TangentBug(BaseController):
    """Voronoi coverage of non-convex environments (Breitenmoser et al., ICRA 2010).

    The goal of each robot is the centroid of its Voronoi cell of the convex region, as for `Lloyd`.
    TangentBug (Kamon, Rivlin and Rimon 1996) drives it there by its scans:

    - *Motion to the goal*: the robot moves straight to the goal. If an obstacle blocks the path, it moves to
      the end of the blocking contour with the shorter path to the goal, as long as the distance to the goal
      decreases.
    - *Boundary following*: otherwise it follows the boundary until a point in view is nearer to the goal than
      the boundary followed so far: d_reach < d_followed.
    - *Projection*: a robot that has followed the whole boundary without finding such a point cannot reach its
      goal, which is inside an obstacle. It moves to the point of the boundary nearest to the goal, and comes
      to rest. It does so at once if the goal is in a known obstacle, or closer to one than a robot can be.

    Notes
    -----
    The implementation is based on the paper's abstract and on general knowledge, not on the full texts of the
    papers. The following choices are our own. A robot's centroid moves with the robot, and would draw it back
    from each detour; therefore the goal is fixed from the time when the robot begins to follow a boundary
    until it is reached or given up. Because a boundary may be as long as the building, the robot follows it
    for at most `detour` times the distance to its goal, and then returns. It tries again after its centroid
    has moved by `moved`. Obstacles in a scan are enlarged by the radius of the robot and `clearance`. Robots
    slide along each other, and assume that others may be as large as the largest of the team.
    """

    name = "tangentbug"
    label = "LA + TangentBug"
    summary = "Lloyd's algorithm, with TangentBug to avoid obstacles (Breitenmoser et al. 2010)"
    scanning = Scanning(rays=120, period=0.1)
    memory_type = TangentBugMemory

    clearance: float = gain(0.05, "m", "minimum gap to obstacles and other robots", high=10.0)
    jump: float = gain(0.5, "m", "minimum step of the depth in view at the end of an obstacle", low=0.01)
    detour: float | None = gain(
        4.0,
        "distances",
        "maximum path along a boundary, in distances to the goal; null: once around",
        optional=True,
    )
    moved: float = gain(0.25, "m", "move of a goal given up after which it is tried again", high=1e4)
    k_prop: float = gain(2.0, "1/s", "desired speed per meter of distance to the goal", high=100.0)
    response_time: float = response_time_gain()
    cells: str = cells_choice()

    def decide(self, seen: Observations, memory: TangentBugMemory) -> Decision:
        """Compute the forces that drive each robot to its waypoint."""
        team = memory.team
        cells = compute_known_cells(seen, self.cells, memory.triangulation)
        returns = update_returns(seen, memory.returns)
        obstacle_points = collect_obstacle_points(seen, returns)
        bugs = memory.bugs or tuple(BugState(Mode.GOAL, 1, position) for position in seen.positions)
        obstacle_squares = memory.obstacle_squares or (np.empty(0, dtype=np.complex128),) * len(team)
        # Robots navigate after each scan. Before the first one, they use the closest obstacle points instead.
        if not memory.bugs or seen.scans is not None or returns is None:
            obstacle_squares = tuple(
                _add_squares(squares, points)
                for squares, points in zip(obstacle_squares, obstacle_points, strict=True)
            )
            bugs = self._navigate(seen, team, bugs, cells.centroid, obstacle_points, obstacle_squares)
        velocities = self._compute_velocities(seen, team, bugs, cells.centroid)
        margins = Margins.build_with_gap(team, 0.5 * self.clearance)
        velocities = avoid_collisions(velocities, seen, team, obstacle_points, margins)
        forces = compute_drive_forces(velocities, seen, team, self.response_time)
        goals = [
            centroid if bug.fixed_goal is None else bug.fixed_goal
            for bug, centroid in zip(bugs, cells.centroid, strict=True)
        ]
        return Decision(
            forces=forces,
            goals=np.array(goals),
            terms={"attraction": forces},
            cells=cells,
            memory=TangentBugMemory(
                team=team,
                returns=returns,
                triangulation=cells.triangulation,
                bugs=bugs,
                obstacle_squares=obstacle_squares,
            ),
        )

    def _navigate(
        self,
        seen: Observations,
        team: Team,
        bugs: tuple[BugState, ...],
        centroids: Array,
        obstacle_points: Array,
        obstacle_squares: tuple[ComplexArray, ...],
    ) -> tuple[BugState, ...]:
        """Return the navigation states of all robots after a scan."""
        directions = compute_ray_directions(self.scanning.rays)
        updated_bugs = []
        for i, bug in enumerate(bugs):
            position = seen.positions[i]
            bug = bug.release_goal(position, centroids[i], self.moved)
            goal = centroids[i] if bug.fixed_goal is None else bug.fixed_goal
            points = obstacle_points[i] - position
            clearance = float(team.radius[i]) + self.clearance
            reach = min(float(team.sensing_range[i]), seen.region.diameter)
            squares = np.column_stack([obstacle_squares[i].real, obstacle_squares[i].imag])
            navigator = Navigator(
                jump=self.jump,
                detour=self.detour,
                position=position,
                goal=goal - position,
                points=points,
                known_points=(squares + 0.5) * _SQUARE_SIDE_M - position,
                directions=directions,
                free_distances=compute_free_distances(points, directions, clearance, reach),
                clearance=clearance,
                reach=reach,
            )
            updated_bugs.append(navigator.update(bug))
        return tuple(updated_bugs)

    def _compute_velocities(
        self, seen: Observations, team: Team, bugs: tuple[BugState, ...], centroids: Array
    ) -> Array:
        """Return the desired velocities toward the waypoints, (n, 2) m/s."""
        waypoints = np.array([bug.waypoint for bug in bugs])
        is_passing = np.array([bug.is_passing for bug in bugs])
        # A robot with its centroid in view follows it until the next scan.
        follows_centroid = np.array([bug.fixed_goal is None and not bug.is_passing for bug in bugs])
        waypoints = np.where(follows_centroid[:, None], centroids, waypoints)
        offsets = waypoints - seen.positions
        distance = np.hypot(*offsets.T)
        speed = np.where(is_passing, team.max_speed, np.minimum(self.k_prop * distance, team.max_speed))
        # A waypoint that is close must not be overshot.
        speed = np.minimum(speed, distance / self.response_time)
        return compute_approach_velocities(offsets, math.inf, speed)


def _add_squares(squares: ComplexArray, points: Array) -> ComplexArray:
    """Return the squares and those that contain the given obstacle points, (k, 2) m; nan for none."""
    indices = np.floor(points[~np.isnan(points[:, 0])] / _SQUARE_SIDE_M)
    return np.unique(np.concatenate([squares, indices[:, 0] + 1j * indices[:, 1]]))


class ContourEnd(NamedTuple):
    """End of the contour that blocks the path."""

    ray: int
    """The first ray past it."""
    point: Array
    """(2,) m, a point just past it."""


@dataclass(frozen=True, slots=True, eq=False)
class Navigator:
    """Decisions of one robot from its last scan. Points and distances are relative to it, in m."""

    jump: float
    """Minimum step of the depth in view at the end of an obstacle."""
    detour: float | None
    """Maximum path along a boundary, in distances to the goal."""
    position: Array
    """(2,) Position of the robot in the region."""
    goal: Array
    """(2,)"""
    points: Array
    """(m, 2) Obstacle points; nan for rays that hit nothing."""
    known_points: Array
    """(w, 2) Centers of the squares in which it has detected obstacle points so far."""
    directions: Array
    """(k, 2) Unit vectors of the rays."""
    free_distances: Array
    """(k,) Distance that the robot can move straight along each ray, m."""
    clearance: float
    """Distance that its center keeps from obstacles."""
    reach: float
    """Range of its sensor."""

    def update(self, bug: BugState) -> BugState:
        """Return the navigation state after the scan."""
        is_goal_in_view = self._is_in_view(self.goal)
        is_free_ahead = self._compute_free_distance(self.goal) >= self.reach - _ROUNDING_M
        if is_goal_in_view or (bug.mode is Mode.GOAL and is_free_ahead):
            return self._head_for(bug, Mode.GOAL, self.position + self.goal)
        if bug.mode is Mode.PROJECTED:
            return bug
        if bug.mode is Mode.LEAVING:
            offset = bug.waypoint - self.position
            if math.hypot(*offset) > _RETURN_RADIUS_M and self._is_in_view(offset):
                return bug
            # The next point at which it leaves a boundary has to be nearer to the goal.
            bug = replace(bug, mode=Mode.GOAL, best_point=bug.waypoint)
        if bug.mode is Mode.GOAL:
            return self._move_to_goal(bug)
        return self._follow_boundary(bug)

    def _head_for(self, bug: BugState, mode: Mode, waypoint: Array, *, is_passing: bool = False) -> BugState:
        """Return the state of a robot that moves through free space."""
        return replace(
            bug,
            mode=mode,
            waypoint=freeze(waypoint),
            is_passing=is_passing,
            entry_point=None,
            followed_length=0.0,
        )

    def _is_in_view(self, offset: Array) -> bool:
        """Return whether the robot can move straight to a point."""
        distance = math.hypot(*offset)
        return distance < _ARRIVAL_RADIUS_M or self._compute_free_distance(offset) >= distance - _ROUNDING_M

    def _compute_free_distance(self, offset: Array) -> float:
        """Return the distance that the robot can move straight toward a point, m."""
        direction = offset / max(math.hypot(*offset), _MIN_LENGTH)
        return float(compute_free_distances(self.points, direction[None], self.clearance, self.reach)[0])

    def _find_contour_ends(self, direction: Array) -> dict[int, ContourEnd]:
        """Return the ends of the contour that blocks the view in a direction, by the turn toward each."""
        first_ray = int((self.directions * direction).sum(axis=1).argmax())
        blocked_distance = self._compute_free_distance(direction)
        ends = {}
        for turn in (1, -1):
            end = find_contour_end(
                free_distances=self.free_distances,
                directions=self.directions,
                first_ray=first_ray,
                turn=turn,
                blocked_distance=blocked_distance,
                jump=self.jump,
                reach=self.reach,
            )
            if end is not None:
                ends[turn] = end
        return ends

    def _move_to_goal(self, bug: BugState) -> BugState:
        """Return the state of a robot that moves to the goal, past the obstacle that blocks the path."""
        ends = self._find_contour_ends(self.goal)
        remaining = {turn: math.dist(self.goal, end.point) for turn, end in ends.items()}
        path_lengths = {turn: math.hypot(*end.point) + remaining[turn] for turn, end in ends.items()}
        if bug.turn in ends:
            # The robot does not alternate between two ends with about the same path length.
            path_lengths[bug.turn] -= _MIN_IMPROVEMENT_M
        goal_distance = math.hypot(*self.goal)
        approaching_turns = [turn for turn in ends if remaining[turn] < goal_distance]
        turn = min(approaching_turns or ends, key=path_lengths.__getitem__, default=bug.turn)
        bug = replace(bug, turn=turn)
        if approaching_turns:
            return self._head_for(bug, Mode.GOAL, self.position + ends[turn].point, is_passing=True)
        return self._enter_boundary(bug, ends)

    def _enter_boundary(self, bug: BugState, ends: dict[int, ContourEnd]) -> BugState:
        """Return the state of a robot that fixes its goal, and begins to follow a boundary."""
        attempts = bug.attempts
        if bug.fixed_goal is None:
            attempts += 1
        max_followed_length = math.inf
        if self.detour is not None:
            max_followed_length = self.detour * math.hypot(*self.goal) * _PATIENCE_DECAY**attempts
        position = freeze(self.position)
        bug = replace(
            bug,
            mode=Mode.BOUNDARY,
            is_passing=True,
            fixed_goal=freeze(self.position + self.goal),
            attempts=attempts,
            entry_point=position,
            last_position=position,
            followed_length=0.0,
            max_followed_length=max_followed_length,
        )
        if self._is_goal_blocked() or max_followed_length < _MIN_BOUNDARY_LENGTH_M:
            return self._move_to_best_point(replace(bug, best_point=self._find_best_point(bug, ends)))
        return self._follow_boundary(bug)

    def _is_goal_blocked(self) -> bool:
        """Return whether the goal is in a known obstacle, or too close to one."""
        if not len(self.known_points):
            return False
        distance = np.hypot(*(self.goal - self.known_points).T).min()
        return bool(distance < self.clearance + _SQUARE_SIDE_M)

    def _follow_boundary(self, bug: BugState) -> BugState:
        """Return the state of a robot that follows a boundary."""
        assert bug.last_position is not None
        followed_length = bug.followed_length + math.dist(self.position, bug.last_position)
        bug = replace(bug, followed_length=followed_length, last_position=self.position)
        distances = np.hypot(*self.points.T)
        if np.isnan(distances).all():
            return self._head_for(bug, Mode.GOAL, self.position + self.goal)
        ends = self._find_contour_ends(self.points[int(np.nanargmin(distances))])
        # A closed contour has no end to move to.
        offset = ends[bug.turn].point if bug.turn in ends else np.zeros(2)
        best_point = self._find_best_point(bug, ends)
        bug = replace(bug, waypoint=freeze(self.position + offset), best_point=best_point)
        if bug.mode is Mode.RETURN:
            if bug.followed_length > _MAX_RETURN_FACTOR * bug.max_followed_length:
                # The robot has lost its best point, and stays where it is.
                bug = replace(bug, best_point=freeze(self.position))
            return self._move_to_best_point(bug)
        leaving_point = self._find_leaving_point(best_point)
        if leaving_point is not None:
            return self._head_for(bug, Mode.LEAVING, leaving_point, is_passing=True)
        is_around = self._is_around(bug)
        if is_around or not ends or bug.followed_length > bug.max_followed_length:
            # After a full turn, the robot keeps going; otherwise it returns the way it came.
            turn = bug.turn if is_around else -bug.turn
            return self._move_to_best_point(replace(bug, mode=Mode.RETURN, turn=turn))
        return bug

    def _is_around(self, bug: BugState) -> bool:
        """Return whether a robot has followed the whole boundary, back to its entry point."""
        assert bug.entry_point is not None
        if bug.followed_length <= 2.0 * math.pi * _RETURN_RADIUS_M:
            return False
        return math.dist(self.position, bug.entry_point) < _RETURN_RADIUS_M

    def _find_leaving_point(self, best_point: Array) -> Array | None:
        """Return the point in view nearest to the goal, (2,) m, if it is nearer than the best point."""
        # On each ray, the point nearest to the goal.
        depths = np.clip((self.directions * self.goal).sum(axis=1), 0.0, self.free_distances)
        remaining = np.hypot(*(self.goal - depths[:, None] * self.directions).T)
        ray = int(remaining.argmin())
        if remaining[ray] >= math.dist(self.position + self.goal, best_point) - _MIN_IMPROVEMENT_M:
            return None
        return np.asarray(self.position + depths[ray] * self.directions[ray])

    def _find_best_point(self, bug: BugState, ends: dict[int, ContourEnd]) -> Array:
        """Return the boundary point, followed so far or now in view, that is nearest to the goal, (2,) m."""
        rays = np.arange(len(self.free_distances))
        if len(ends) == 2:
            # The contour extends counter-clockwise from one end to the other.
            first = ends[-1].ray + 1
            count = (ends[1].ray - first) % len(rays)
            rays = np.sort((first + np.arange(count)) % len(rays))
        best_so_far = np.zeros(2) if bug.best_point is None else bug.best_point - self.position
        points = np.vstack([best_so_far, self.free_distances[rays, None] * self.directions[rays]])
        nearest = np.hypot(*(self.goal - points).T).argmin()
        return freeze(self.position + points[nearest])

    def _move_to_best_point(self, bug: BugState) -> BugState:
        """Return the state of a robot that heads for its best point if that is in view, or returns to it."""
        assert bug.best_point is not None
        offset = bug.best_point - self.position
        distance = math.hypot(*offset)
        free_distance = self._compute_free_distance(offset)
        # Seen from here, the boundary may be a little closer to the point than it was before.
        if distance >= _ARRIVAL_RADIUS_M and free_distance < distance - self.clearance:
            return replace(bug, mode=Mode.RETURN)
        fraction = min(1.0, free_distance / max(distance, _MIN_LENGTH))
        return replace(
            bug,
            mode=Mode.PROJECTED,
            waypoint=freeze(self.position + offset * fraction),
            is_passing=False,
            entry_point=None,
            resting_centroid=None,
        )


@kernel
def compute_free_distances(points: Array, directions: Array, clearance: float, reach: float) -> Array:
    """Compute the distance that a disc can move straight in each direction.

    Parameters
    ----------
    points : (m, 2) array, m
        Obstacle points relative to the center of the disc; nan for none.
    directions : (k, 2) array
        Unit vectors.
    clearance : float, m
        Distance that the center keeps from the points. Points that are already nearer may be approached to
        95 % of their distance.
    reach : float, m
        Maximum result.

    Returns
    -------
    (k,) array, m

    Examples
    --------
    >>> compute_free_distances(np.array([[1.0, 0.0]]), np.array([[1.0, 0.0], [0.0, 1.0]]), 0.25, 2.0)
    array([0.75, 2.  ])
    """
    free_distances = np.empty(len(directions))
    for k in range(len(directions)):
        direction_x, direction_y = directions[k]
        free_distances[k] = reach
        for x, y in points:
            along = direction_x * x + direction_y * y
            across = direction_x * y - direction_y * x
            min_distance = min(clearance, _CONTACT_FRACTION * math.sqrt(x * x + y * y))
            squared_depth = min_distance * min_distance - across * across
            # Comparisons with nan are false: there is no point.
            if along > 0.0 and squared_depth > 0.0:
                free_distance = max(along - math.sqrt(squared_depth), 0.0)
                free_distances[k] = min(free_distances[k], free_distance)
    return free_distances


def find_contour_end(
    free_distances: Array,
    directions: Array,
    first_ray: int,
    turn: int,
    blocked_distance: float,
    jump: float,
    reach: float,
) -> ContourEnd | None:
    """Find the end of the contour that blocks a ray.

    Parameters
    ----------
    free_distances : (k,) array, m
        Distance that the robot can move along each ray.
    directions : (k, 2) array
        Unit vectors of the rays.
    first_ray : int
        The ray nearest to the blocked direction.
    turn : int
        1 to search counter-clockwise, -1 clockwise.
    blocked_distance : float, m
        Free distance in the blocked direction.
    jump : float, m
        The contour ends before a ray whose free distance exceeds that of the previous ray by this.
    reach : float, m
        The contour also ends before a ray with this free distance.

    Returns
    -------
    ContourEnd or None
        None if the contour is closed.
    """
    rays = (first_ray + turn * np.arange(len(free_distances))) % len(free_distances)
    distances = free_distances[rays]
    previous = np.append(blocked_distance, distances[:-1])
    is_past_end = (distances > previous + jump) | (distances >= reach)
    if not is_past_end.any():
        return None
    k = int(is_past_end.argmax())
    point = directions[rays[k]] * min(distances[k], previous[k] + jump)
    return ContourEnd(ray=int(rays[k]), point=point)
