"""Voronoi coverage with TangentBug as local planner: Lloyd's algorithm for robots that avoid obstacles."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum
from typing import NamedTuple, TypeAlias

import numpy as np

from robocov.arrays import copy_read_only
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
from robocov.typing import FloatArray

_SQUARE_SIDE_M = 0.1
"""Side of the squares that store the obstacle points a robot has detected."""
_MIN_IMPROVEMENT_M = 0.2
"""Minimum difference for a point to count as nearer to the goal; otherwise, modes would alternate."""
_RETURN_RADIUS_M = 0.3
"""Distance from a point at which a robot has returned to it."""
_ARRIVAL_RADIUS_M = 0.05
"""Distance from a point at which a robot has arrived."""
_MIN_BOUNDARY_LENGTH_M = 1.0
"""Minimum length of a boundary that is worth following."""
_MAX_LENGTH_DECAY = 0.9
"""Factor by which the maximum length of a followed boundary shrinks with each fixed goal."""
_CONTACT_FRACTION = 0.95
"""Fraction of the current distance to which a robot within the clearance may approach a point."""
_MIN_LENGTH = 1e-300
"""Minimum divisor; prevents division by zero."""
_ROUNDING_M = 1e-9
"""Tolerance of free distances for rounding errors."""
_MAX_RETURN_FACTOR = 3.0
"""Path length, there and back, after which a robot gives up its return to the best point, relative to the
maximum length of its boundary."""

COUNTERCLOCKWISE = 1
CLOCKWISE = -1
"""Direction in which a robot turns away from an obstacle.

After a counter-clockwise turn, the obstacle is on the robot's right.
"""

Squares: TypeAlias = frozenset[tuple[int, int]]
"""Columns and rows of squares of the plane, of side `_SQUARE_SIDE_M`, counted from the origin."""


class Mode(Enum):
    """Mode of a robot."""

    GOAL = "motion to the goal"
    BOUNDARY = "boundary following"
    LEAVING = "leaving the boundary"
    RETURN = "return along the boundary to its point nearest to the goal"
    BEST_POINT = "motion straight to the best point, and rest there"


@dataclass(frozen=True, slots=True, eq=False)
class FixedGoal:
    """A goal that does not move with the robot's centroid while the robot passes an obstacle. Immutable."""

    position: FloatArray
    """(2,) m, position of the centroid when the goal was fixed."""
    best_point: FloatArray | None = None
    """(2,) m, the point nearest to the goal among the points of the boundaries that the robot has followed,
    and those at which it has left them."""
    resting_centroid: FloatArray | None = None
    """(2,) m, the robot's centroid when it came to rest at `best_point`."""


@dataclass(frozen=True, slots=True, eq=False)
class FollowedBoundary:
    """The path of a robot along the boundary that it follows. Immutable."""

    entry_point: FloatArray
    """(2,) m, position at which the robot began to follow the boundary."""
    last_position: FloatArray
    """(2,) m, position of the robot at the last scan."""
    length: float
    """Length of the path, m."""
    max_length: float
    """Length, m, after which the robot gives up."""

    def extend(self, position: FloatArray) -> FollowedBoundary:
        """Return the path after the robot has moved straight to a position, (2,) m."""
        length = self.length + math.dist(position, self.last_position)
        return replace(self, length=length, last_position=position)

    def is_complete(self) -> bool:
        """Return whether the robot has followed the whole boundary, back to its entry point."""
        # A robot that has only moved a little is still near its entry point.
        if self.length <= 2.0 * math.pi * _RETURN_RADIUS_M:
            return False
        return math.dist(self.last_position, self.entry_point) < _RETURN_RADIUS_M


@dataclass(frozen=True, slots=True, eq=False)
class NavigationState:
    """Navigation mode, waypoint and goal of a robot between two scans. Immutable."""

    mode: Mode
    turn: int
    """Direction in which the robot turns to pass an obstacle: `COUNTERCLOCKWISE` (obstacle on its right) or
    `CLOCKWISE` (on its left)."""
    waypoint: FloatArray
    """(2,) m, point that the robot heads for."""
    passes_waypoint: bool = False
    """Whether the robot moves on past the waypoint, and does not slow down there."""
    attempts: int = 0
    """Number of attempts: goals that the robot has fixed so far."""
    fixed_goal: FixedGoal | None = None
    """None while the robot's goal is its centroid."""
    boundary: FollowedBoundary | None = None
    """None unless the robot follows a boundary, or returns along it."""

    def get_goal(self, centroid: FloatArray) -> FloatArray:
        """Return the fixed goal, or else the centroid, (2,) m."""
        return centroid if self.fixed_goal is None else self.fixed_goal.position

    def release_goal(self, position: FloatArray, centroid: FloatArray, min_move: float) -> NavigationState:
        """Release the fixed goal if the robot has reached it or should try a new one; return the new state.

        When the robot arrives at its best point, its centroid is recorded as `resting_centroid`. Otherwise
        the state is returned unchanged.

        Parameters
        ----------
        position : (2,) array, m
        centroid : (2,) array, m
            The moving goal, the centroid of the robot's cell.
        min_move : float, m
            A robot at rest at its best point tries again once its centroid has moved by more than
            ``min_move * attempts``.

        Returns
        -------
        NavigationState
        """
        goal = self.fixed_goal
        if goal is None:
            return self
        is_done = math.dist(position, goal.position) < _ARRIVAL_RADIUS_M
        if self.mode is Mode.BEST_POINT:
            if goal.resting_centroid is None:
                if math.dist(position, self.waypoint) < _ARRIVAL_RADIUS_M:
                    return replace(self, fixed_goal=replace(goal, resting_centroid=copy_read_only(centroid)))
            elif math.dist(centroid, goal.resting_centroid) > min_move * self.attempts:
                is_done = True
        if not is_done:
            return self
        return NavigationState(Mode.GOAL, self.turn, self.waypoint, attempts=self.attempts)


@dataclass(frozen=True, slots=True, eq=False)
class TangentBugMemory(Memory):
    """Memory of the robots, with their navigation states."""

    states: tuple[NavigationState, ...] = ()
    obstacle_squares: tuple[Squares, ...] = ()
    """The squares in which each robot has detected obstacle points."""


@dataclass(frozen=True)
class TangentBug(BaseController):
    """Voronoi coverage of non-convex environments (Breitenmoser et al., ICRA 2010).

    The goal of each robot is the centroid of its Voronoi cell of the convex region, as for `Lloyd`.
    TangentBug (Kamon, Rivlin and Rimon 1996) steers it there by means of its range scans:

    - *Motion to the goal*: the robot moves straight to the goal. If an obstacle blocks the path, the robot
      moves to one end of the blocking contour. Of the ends that are nearer to the goal than the robot is, it
      chooses the one with the shorter path to the goal.
    - *Boundary following*: if there is no such end, it follows the boundary until a point in view is nearer
      to the goal, by at least 0.2 m, than any boundary point seen so far (d_reach < d_followed).
    - *Projection*: a robot that has followed the whole boundary without finding such a point cannot reach its
      goal, which is inside an obstacle. It moves to the point of the boundary nearest to the goal, its best
      point, and comes to rest. It does so at once if the goal is closer to a detected obstacle point than a
      robot can be, or if it may follow the boundary for less than 1 m.

    Notes
    -----
    We had only the paper's abstract, not the full texts of the papers; details may differ. The following
    choices are our own. The centroid of a robot's cell moves with the robot, and would draw it back from each
    detour; therefore the goal is fixed from the time when the robot starts to follow a boundary until it is
    reached or given up. Because a boundary may be very long, the robot follows it for at most
    `detour` * 0.9**k times the distance to its goal in attempt k = 1, 2, ... It then returns to its best
    point, and comes to rest there. It tries again after the centroid has moved by `moved` times the number of
    attempts. Obstacles in a scan are enlarged by the radius of the robot and `clearance`. Robots slide along
    each other, and assume that others may be as large as the largest of the team.
    """

    name = "tangentbug"
    label = "Lloyd + TangentBug"
    summary = "Lloyd's algorithm, with TangentBug to avoid obstacles (Breitenmoser et al. 2010)"
    scanning = Scanning(rays=120, period=0.1)
    memory_type = TangentBugMemory

    clearance: float = gain(0.05, "m", "minimum gap to obstacles and other robots", high=10.0)
    jump: float = gain(0.5, "m", "minimum jump of the free distance at the end of a contour", low=0.01)
    detour: float | None = gain(
        4.0,
        "distances",
        "maximum path along a boundary, in distances to the goal; null for once around",
        optional=True,
    )
    moved: float = gain(
        0.25,
        "m",
        "distance per attempt that the centroid must move before an unreachable goal is tried again",
        high=1e4,
    )
    k_prop: float = gain(2.0, "1/s", "desired speed per meter of distance to the goal", high=100.0)
    response_time: float = response_time_gain()
    cells: str = cells_choice()

    def decide(self, seen: Observations, memory: TangentBugMemory) -> Decision:
        """Compute the forces that drive each robot to its waypoint."""
        team = memory.team
        cells = compute_known_cells(seen, self.cells, memory.triangulation)
        returns = update_returns(seen, memory.returns)
        obstacle_points = collect_obstacle_points(seen, returns)
        states = memory.states or tuple(
            NavigationState(Mode.GOAL, COUNTERCLOCKWISE, position) for position in seen.positions
        )
        obstacle_squares = memory.obstacle_squares or (frozenset(),) * len(team)
        # Robots navigate after each scan. Before the first scan, they navigate in every step, using the
        # closest obstacle points.
        if not memory.states or seen.scans is not None or returns is None:
            obstacle_squares = tuple(
                _add_squares(squares, points)
                for squares, points in zip(obstacle_squares, obstacle_points, strict=True)
            )
            states = self._navigate(seen, team, states, cells.centroids, obstacle_points, obstacle_squares)
        velocities = self._compute_velocities(seen, team, states, cells.centroids)
        # Paths keep the whole clearance. With half of it as the margin, collision avoidance does not stop a
        # robot on such a path.
        margins = Margins.build_with_gap(team, 0.5 * self.clearance)
        velocities = avoid_collisions(velocities, seen, team, obstacle_points, margins)
        forces = compute_drive_forces(velocities, seen, team, self.response_time)
        goals = [state.get_goal(centroid) for state, centroid in zip(states, cells.centroids, strict=True)]
        return Decision(
            forces=forces,
            goals=np.array(goals),
            terms={"attraction": forces},
            cells=cells,
            memory=TangentBugMemory(
                team=team,
                returns=returns,
                triangulation=cells.triangulation,
                states=states,
                obstacle_squares=obstacle_squares,
            ),
        )

    def _navigate(
        self,
        seen: Observations,
        team: Team,
        states: tuple[NavigationState, ...],
        centroids: FloatArray,
        obstacle_points: FloatArray,
        obstacle_squares: tuple[Squares, ...],
    ) -> tuple[NavigationState, ...]:
        """Return the navigation states of all robots after a scan."""
        directions = compute_ray_directions(self.scanning.rays)
        updated_states = []
        for i, state in enumerate(states):
            position = seen.positions[i]
            state = state.release_goal(position, centroids[i], self.moved)
            points = obstacle_points[i] - position
            clearance = float(team.radius[i]) + self.clearance
            sensing_range = min(float(team.sensing_range[i]), seen.region.diameter)
            view = ObstacleView(
                points=points,
                directions=directions,
                free_distances=compute_free_distances(points, directions, clearance, sensing_range),
                clearance=clearance,
                sensing_range=sensing_range,
            )
            navigator = Navigator(
                controller=self,
                view=view,
                position=position,
                goal_offset=state.get_goal(centroids[i]) - position,
                obstacle_squares=obstacle_squares[i],
            )
            updated_states.append(navigator.update(state))
        return tuple(updated_states)

    def _compute_velocities(
        self, seen: Observations, team: Team, states: tuple[NavigationState, ...], centroids: FloatArray
    ) -> FloatArray:
        """Return the desired velocities toward the waypoints, (n, 2) m/s."""
        waypoints = np.array([state.waypoint for state in states])
        passes_waypoint = np.array([state.passes_waypoint for state in states])
        # A robot whose path toward its centroid is free follows the centroid until the next scan.
        follows_centroid = np.array(
            [state.fixed_goal is None and not state.passes_waypoint for state in states]
        )
        waypoints = np.where(follows_centroid[:, None], centroids, waypoints)
        offsets = waypoints - seen.positions
        distance = np.hypot(*offsets.T)
        speed = np.where(passes_waypoint, team.max_speed, np.minimum(self.k_prop * distance, team.max_speed))
        # A waypoint that is close must not be overshot.
        speed = np.minimum(speed, distance / self.response_time)
        return compute_approach_velocities(offsets, gain=math.inf, max_speed=speed)


def _add_squares(squares: Squares, points: FloatArray) -> Squares:
    """Return the squares together with those that contain obstacle points, (k, 2) m; ignore nan."""
    detected = points[~np.isnan(points[:, 0])]
    indices = np.floor(detected / _SQUARE_SIDE_M).astype(np.intp)
    return squares | {(column, row) for column, row in indices.tolist()}


class ContourEnd(NamedTuple):
    """End of the contour that blocks the path."""

    ray: int
    """Index of the first ray past the end."""
    point: FloatArray
    """(2,) m, a free point just past the end, relative to the robot."""


@dataclass(frozen=True, slots=True, eq=False)
class ObstacleView:
    """The obstacles that one robot sees. Points and distances are relative to the robot, in m."""

    points: FloatArray
    """(m, 2) Obstacle points; nan for rays that hit nothing."""
    directions: FloatArray
    """(k, 2) Unit vectors of the rays."""
    free_distances: FloatArray
    """(k,) Distance that the robot can move straight along each ray."""
    clearance: float
    """Distance that the robot's center keeps from obstacles."""
    sensing_range: float
    """Range of the robot's sensor."""

    def can_reach(self, point: FloatArray) -> bool:
        """Return whether the robot can move straight to a point."""
        distance = math.hypot(*point)
        return distance < _ARRIVAL_RADIUS_M or self.compute_free_distance(point) >= distance - _ROUNDING_M

    def compute_free_distance(self, point: FloatArray) -> float:
        """Return the distance that the robot can move straight toward a point, which it may pass."""
        direction = point / max(math.hypot(*point), _MIN_LENGTH)
        return float(
            compute_free_distances(self.points, direction[None], self.clearance, self.sensing_range)[0]
        )

    def find_nearest_point(self) -> FloatArray | None:
        """Return the nearest obstacle point, (2,), or None if the robot sees no obstacle."""
        distances = np.hypot(*self.points.T)
        return None if np.isnan(distances).all() else self.points[int(np.nanargmin(distances))]

    def find_contour_ends(self, direction: FloatArray, jump: float) -> dict[int, ContourEnd]:
        """Return the ends of the contour that blocks the view in a direction.

        Parameters
        ----------
        direction : (2,) array
            Of any length.
        jump : float, m
            Minimum increase of the free distance from one ray to the next at an end of the contour. The
            contour also ends before a ray whose free distance is the range of the sensor.

        Returns
        -------
        dict of int to ContourEnd
            The end that a turn in each direction leads to, by `COUNTERCLOCKWISE` and `CLOCKWISE`. Empty if
            the contour is closed.
        """
        first_ray = int((self.directions * direction).sum(axis=1).argmax())
        free_distance = self.compute_free_distance(direction)
        ends = {}
        for turn in (COUNTERCLOCKWISE, CLOCKWISE):
            # All rays, in the order in which a turn from the first one passes them.
            rays = (first_ray + turn * np.arange(len(self.directions))) % len(self.directions)
            distances = self.free_distances[rays]
            previous_distances = np.append(free_distance, distances[:-1])
            has_jump = distances > previous_distances + jump
            is_past_end = has_jump | (distances >= self.sensing_range)
            if is_past_end.any():
                k = int(is_past_end.argmax())
                # The robot moves to a free point close to the contour, not to the far end of the free ray.
                end_distance = min(distances[k], previous_distances[k] + jump)
                point = self.directions[rays[k]] * end_distance
                ends[turn] = ContourEnd(ray=int(rays[k]), point=point)
        return ends


@dataclass(frozen=True, slots=True, eq=False)
class Navigator:
    """Decisions of one robot after a scan."""

    controller: TangentBug
    view: ObstacleView
    position: FloatArray
    """(2,) m, position of the robot in the region."""
    goal_offset: FloatArray
    """(2,) m, goal of the robot relative to its position."""
    obstacle_squares: Squares
    """Squares in which the robot has detected obstacle points."""

    def update(self, state: NavigationState) -> NavigationState:
        """Return the navigation state after the scan.

        In any mode, a robot that can move straight to its goal does so. Otherwise, the mode decides.
        """
        if self.view.can_reach(self.goal_offset):
            return self._head_for(state, Mode.GOAL, self.position + self.goal_offset)
        if state.mode is Mode.BEST_POINT:
            return state
        if state.mode in (Mode.BOUNDARY, Mode.RETURN):
            return self._follow_boundary(state)
        if state.mode is Mode.LEAVING:
            if self._must_approach_waypoint(state):
                return state
            # If the path toward the goal is free now, `_move_to_goal` heads along a ray close to it, and the
            # robot heads for the goal itself after the next scan.
            state = self._finish_leaving(state)
        elif self._is_free_ahead():
            return self._head_for(state, Mode.GOAL, self.position + self.goal_offset)
        return self._move_to_goal(state)

    def _is_free_ahead(self) -> bool:
        """Return whether the straight path toward the goal is free up to the sensing range."""
        return self.view.compute_free_distance(self.goal_offset) >= self.view.sensing_range - _ROUNDING_M

    def _must_approach_waypoint(self, state: NavigationState) -> bool:
        """Return whether the robot has not yet reached the waypoint, and can move straight to it."""
        offset = state.waypoint - self.position
        return math.hypot(*offset) > _RETURN_RADIUS_M and self.view.can_reach(offset)

    def _finish_leaving(self, state: NavigationState) -> NavigationState:
        """Return the state of a robot that no longer heads for the point at which it leaves a boundary."""
        assert state.fixed_goal is not None
        # The next point at which the robot leaves a boundary has to be nearer to the goal than this one.
        goal = replace(state.fixed_goal, best_point=state.waypoint)
        return replace(state, mode=Mode.GOAL, fixed_goal=goal)

    def _head_for(
        self, state: NavigationState, mode: Mode, waypoint: FloatArray, *, passes_waypoint: bool = False
    ) -> NavigationState:
        """Return the state of a robot that moves straight to a waypoint through free space."""
        return replace(
            state,
            mode=mode,
            waypoint=copy_read_only(waypoint),
            passes_waypoint=passes_waypoint,
            boundary=None,
        )

    def _move_to_goal(self, state: NavigationState) -> NavigationState:
        """Return the state of a robot that moves to the goal, past the obstacle that blocks the path.

        If no end of the blocking contour is nearer to the goal than the robot is, it follows the boundary.
        """
        ends = self.view.find_contour_ends(self.goal_offset, self.controller.jump)
        remaining_distances = {turn: math.dist(self.goal_offset, end.point) for turn, end in ends.items()}
        path_lengths = {
            turn: math.hypot(*end.point) + remaining_distances[turn] for turn, end in ends.items()
        }
        if state.turn in ends:
            # The robot does not alternate between two ends with about the same path length.
            path_lengths[state.turn] -= _MIN_IMPROVEMENT_M
        goal_distance = math.hypot(*self.goal_offset)
        approaching_turns = [turn for turn in ends if remaining_distances[turn] < goal_distance]
        # Without an approaching turn, this is the direction in which the robot follows the boundary.
        turn = min(approaching_turns or ends, key=path_lengths.__getitem__, default=state.turn)
        state = replace(state, turn=turn)
        if approaching_turns:
            return self._head_for(state, Mode.GOAL, self.position + ends[turn].point, passes_waypoint=True)
        return self._enter_boundary(state, ends)

    def _enter_boundary(self, state: NavigationState, ends: dict[int, ContourEnd]) -> NavigationState:
        """Fix the goal at its current position, start to follow a boundary, and return the new state.

        The robot moves to its best point instead if the goal is too close to an obstacle, or if it may follow
        the boundary for less than `_MIN_BOUNDARY_LENGTH_M`.
        """
        best_point = None
        attempts = state.attempts
        if state.fixed_goal is None:
            attempts += 1
        else:
            # Following another boundary toward the same fixed goal is not a new attempt.
            best_point = state.fixed_goal.best_point
        max_length = self._compute_max_boundary_length(attempts)
        position = copy_read_only(self.position)
        state = replace(
            state,
            mode=Mode.BOUNDARY,
            passes_waypoint=True,
            attempts=attempts,
            fixed_goal=FixedGoal(copy_read_only(self.position + self.goal_offset), best_point),
            boundary=FollowedBoundary(position, position, length=0.0, max_length=max_length),
        )
        if self._is_goal_blocked() or max_length < _MIN_BOUNDARY_LENGTH_M:
            return self._plan_move_to_best_point(state, self._find_best_point(state, ends))
        return self._follow_boundary(state)

    def _compute_max_boundary_length(self, attempts: int) -> float:
        """Return the length after which the robot gives up a boundary, m; shorter with each attempt."""
        if self.controller.detour is None:
            return math.inf
        return self.controller.detour * math.hypot(*self.goal_offset) * _MAX_LENGTH_DECAY**attempts

    def _is_goal_blocked(self) -> bool:
        """Return whether the goal is too close to a detected obstacle point.

        A goal deep inside an obstacle is not recognized.
        """
        if not self.obstacle_squares:
            return False
        centers = (np.array(list(self.obstacle_squares)) + 0.5) * _SQUARE_SIDE_M
        distance = np.hypot(*(self.goal_offset - (centers - self.position)).T).min()
        # The side of a square is added because an obstacle point may lie anywhere in its square.
        return bool(distance < self.view.clearance + _SQUARE_SIDE_M)

    def _follow_boundary(self, state: NavigationState) -> NavigationState:
        """Return the state of a robot that follows a boundary."""
        assert state.boundary is not None
        assert state.fixed_goal is not None
        nearest_point = self.view.find_nearest_point()
        if nearest_point is None:
            return self._head_for(state, Mode.GOAL, self.position + self.goal_offset)
        ends = self.view.find_contour_ends(nearest_point, self.controller.jump)
        # A closed contour has no end to move to.
        offset = ends[state.turn].point if state.turn in ends else np.zeros(2)
        boundary = state.boundary.extend(self.position)
        best_point = self._find_best_point(state, ends)
        state = replace(
            state,
            waypoint=copy_read_only(self.position + offset),
            fixed_goal=replace(state.fixed_goal, best_point=best_point),
            boundary=boundary,
        )
        if state.mode is Mode.RETURN:
            if boundary.length > _MAX_RETURN_FACTOR * boundary.max_length:
                # The robot has lost its best point, and stays where it is.
                best_point = copy_read_only(self.position)
            return self._plan_move_to_best_point(state, best_point)
        leaving_point = self._find_leaving_point(best_point)
        if leaving_point is not None:
            return self._head_for(state, Mode.LEAVING, leaving_point, passes_waypoint=True)
        is_complete = boundary.is_complete()
        if is_complete or not ends or boundary.length > boundary.max_length:
            # After a full turn, the robot keeps its direction. Otherwise, it turns and goes back on its path.
            turn = state.turn if is_complete else -state.turn
            return self._plan_move_to_best_point(replace(state, mode=Mode.RETURN, turn=turn), best_point)
        return state

    def _find_leaving_point(self, best_point: FloatArray) -> FloatArray | None:
        """Return the point in view nearest to the goal, (2,) m, if it is nearer than the best point."""
        directions = self.view.directions
        # On each ray, the point nearest to the goal.
        depths = np.clip((directions * self.goal_offset).sum(axis=1), 0.0, self.view.free_distances)
        remaining_distances = np.hypot(*(self.goal_offset - depths[:, None] * directions).T)
        ray = int(remaining_distances.argmin())
        best_distance = math.dist(self.position + self.goal_offset, best_point)
        if remaining_distances[ray] >= best_distance - _MIN_IMPROVEMENT_M:
            return None
        return np.asarray(self.position + depths[ray] * directions[ray])

    def _find_best_point(self, state: NavigationState, ends: dict[int, ContourEnd]) -> FloatArray:
        """Return the boundary point, followed so far or now in view, that is nearest to the goal, (2,) m."""
        assert state.fixed_goal is not None
        rays = np.arange(len(self.view.free_distances))
        if len(ends) == 2:
            # The contour extends counter-clockwise from one end to the other. The rays are sorted, so that
            # `argmin` chooses the one with the lowest index if several points are equally near.
            first = ends[CLOCKWISE].ray + 1
            count = (ends[COUNTERCLOCKWISE].ray - first) % len(rays)
            rays = np.sort((first + np.arange(count)) % len(rays))
        best_so_far = np.zeros(2)
        if state.fixed_goal.best_point is not None:
            best_so_far = state.fixed_goal.best_point - self.position
        contour = self.view.free_distances[rays, None] * self.view.directions[rays]
        points = np.vstack([best_so_far, contour])
        nearest = np.hypot(*(self.goal_offset - points).T).argmin()
        return copy_read_only(self.position + points[nearest])

    def _plan_move_to_best_point(self, state: NavigationState, best_point: FloatArray) -> NavigationState:
        """Return the state of a robot on its way to the best point.

        It moves straight to the point if it is in view, or else back along the boundary.
        """
        assert state.fixed_goal is not None
        goal = replace(state.fixed_goal, best_point=best_point, resting_centroid=None)
        offset = best_point - self.position
        distance = math.hypot(*offset)
        free_distance = self.view.compute_free_distance(offset)
        # Allow a tolerance of one clearance: from here, the view may end slightly short of the point.
        if distance >= _ARRIVAL_RADIUS_M and free_distance < distance - self.view.clearance:
            return replace(state, mode=Mode.RETURN, fixed_goal=goal)
        fraction = min(1.0, free_distance / max(distance, _MIN_LENGTH))
        return replace(
            state,
            mode=Mode.BEST_POINT,
            waypoint=copy_read_only(self.position + offset * fraction),
            passes_waypoint=False,
            fixed_goal=goal,
            boundary=None,
        )


@kernel
def compute_free_distances(
    points: FloatArray, directions: FloatArray, clearance: float, max_distance: float
) -> FloatArray:
    """Compute the distance that a disc can move straight in each direction.

    Parameters
    ----------
    points : (m, 2) array, m
        Obstacle points relative to the center of the disc; rows of nan stand for no point.
    directions : (k, 2) array
        Unit vectors.
    clearance : float, m
        Distance that the center keeps from the points. Points that are already nearer may be approached to
        95% of their distance.
    max_distance : float, m
        Upper limit of the distances.

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
        free_distances[k] = max_distance
        for x, y in points:
            # The coordinates of the point along the direction and across it. The disc meets the clearance of
            # the point at the distance along - sqrt(min_distance² - across²).
            along = direction_x * x + direction_y * y
            across = direction_x * y - direction_y * x
            min_distance = min(clearance, _CONTACT_FRACTION * math.sqrt(x * x + y * y))
            squared_depth = min_distance * min_distance - across * across
            # For nan, which stands for no point, both comparisons are false.
            if along > 0.0 and squared_depth > 0.0:
                free_distance = max(along - math.sqrt(squared_depth), 0.0)
                free_distances[k] = min(free_distances[k], free_distance)
    return free_distances
