"""The world of a fixed team: robots under forces, among obstacles.

Equation numbers refer to Renzaglia and Martinelli, "Distributed Coverage Control for a Multi-Robot Team in a
Non-Convex Environment".
"""

from __future__ import annotations

import math
from copy import copy
from dataclasses import dataclass
from typing import Any

import numpy as np

from robocov.arrays import compute_lengths
from robocov.errors import ParameterError
from robocov.observation.close_pairs import find_close_pairs
from robocov.team import Team
from robocov.typing import BoolArray, FloatArray
from robocov.world.bodies import MAX_TEAMS_PER_SPACE, compute_obstacle_states
from robocov.world.contacts import ContactDetector, ContactSolver
from robocov.world.dynamics import MotionResponse, compute_net_forces, compute_response
from robocov.world.obstacle_pieces import Obstacles
from robocov.world.unicycles import (
    DriveCommand,
    Wheels,
    compute_drive_command,
    initialize_steering,
    remove_sideways_velocity,
)

MAX_SUBSTEP_S = 0.02
"""Maximum duration of a substep."""
MAX_MASS_RATIO = 1000.0
"""Maximum ratio of the masses of two robots. With larger ratios, contacts cannot be resolved."""

_NO_FORCES = np.zeros((0, 2))
"""External forces of a step without external forces."""
_SUBSTEP_COUNT_TOLERANCE = 1e-9
"""Maximum rounding error of a number of substeps."""


@dataclass(frozen=True, eq=False)
class _SpeedLimits:
    """Maximum speeds of robots at the end of a substep, (n,) m/s each.

    A robot that is faster than its maximum speed brakes as hard as it can.
    """

    without_external_forces: FloatArray
    """Maximum speeds if no external forces act."""
    with_external_forces: FloatArray
    """Maximum speeds if external forces act, which are the same or higher."""


class World:
    """Robots as pymunk bodies among static polygons, moving obstacles and failed robots.

    Parameters
    ----------
    obstacles : Obstacles
        Everything that is solid, as returned by `robocov.world.obstacle_pieces.build_obstacles`.
    team : Team
        The n robots.
    positions : (n, 2) array, m
        Centers of the robots.
    velocities : (n, 2) array or None, m/s
        Velocities of the robots. By default, robots are at rest.
    steering : (n, 2) array or None, rad and rad/s
        Heading and turning rate of unicycles. By default, they face the direction in which they move.
    runs : int
        Number of independent runs with teams of equal size. Row ``r * n / runs + i`` is robot i of run r.
        Robots of different runs pass through each other.

    Attributes
    ----------
    team : Team
        The n robots.
    failed_robots : (f, 3) array or None, m
        Center x, y and radius of the failed robots among the obstacles.
    positions : (n, 2) array, m
        Centers of the robots. Read-only.
    velocities : (n, 2) array, m/s
        Velocities of the robots. Read-only.
    steering : (n, 2) array or None, rad and rad/s
        Heading and turning rate of unicycles; None for a team without unicycles. Read-only.
    is_working : (n,) bool array
        Whether each robot works; always True.

    Raises
    ------
    ParameterError
        If a robot is more than `MAX_MASS_RATIO` times as heavy as another one.

    See Also
    --------
    Simulation : A world with a controller and sensors.
    RangeSensor : What robots sense of the obstacles.

    Notes
    -----
    In each step, the forces of the controllers, the viscous term of (28) and the kinematic limits are
    combined into the net forces that pymunk integrates. Pymunk resolves contacts, in substeps so fine that no
    robot sinks into a static wall or another robot by more than `contacts.MAX_PENETRATION_M`. Besides its
    arguments, a step depends only on positions, velocities and steering, so that a copy continues
    identically, bit for bit.

    Moving obstacles stay on their paths and push robots aside. They may press a robot deeper into a wall: by
    some millimeters, and in very acute corners by centimeters. Walls take precedence. If no space is left
    between a moving obstacle and a wall, the robot stays in front of the wall, and the obstacle passes over
    it. Once there is space, the robot is pushed out on the nearest side.

    Examples
    --------
    >>> import numpy as np
    >>> import robocov as rc
    >>> from robocov.world.obstacle_pieces import build_obstacles
    >>> obstacles = build_obstacles(rc.load_map("square"))
    >>> world = rc.World(obstacles, rc.Team.homogeneous(1), np.array([[1.0, 1.0]]))
    >>> world.step(np.array([[1.0, 0.0]]), dt=0.02)
    >>> world.velocities.round(4)
    array([[0.0196, 0.    ]])
    """

    def __init__(
        self,
        obstacles: Obstacles,
        team: Team,
        positions: FloatArray,
        velocities: FloatArray | None = None,
        *,
        steering: FloatArray | None = None,
        runs: int = 1,
    ) -> None:
        lightest = float(team.mass.min())
        heaviest = float(team.mass.max())
        if heaviest > MAX_MASS_RATIO * lightest:
            raise ParameterError(
                f"team.mass: expected robots at most {MAX_MASS_RATIO:g} times as heavy as the lightest, "
                f"got {lightest:g} to {heaviest:g} kg"
            )
        self.team = team
        self.failed_robots = obstacles.failed_robots
        self.is_working: BoolArray = np.ones(len(team), dtype=bool)
        self._obstacles = obstacles
        self._is_unicycle = team.is_unicycle
        self._max_team_speed = float(team.max_speed.max())
        self._min_radius = float(team.radius.min())
        self._team_size = len(team) // runs
        self._may_exceed_max_speed = velocities is not None
        if velocities is None:
            velocities = np.zeros((len(team), 2))
        positions = np.array(positions, dtype=float)
        velocities = np.array(velocities, dtype=float)
        steering = initialize_steering(team, velocities, steering)
        self._set_state(positions, velocities, steering)
        # These values do not matter, because each substep sets the states of moving obstacles first.
        self._obstacle_states = compute_obstacle_states(obstacles.moving_obstacles, time=0.0, dt=1.0)
        self._response: MotionResponse | None = None
        self._response_dt = math.nan
        # Both are built on first use, and are the only objects that a step changes in place.
        self._spaces: list[tuple[slice, ContactDetector]] | None = None
        self._contact_solver: ContactSolver | None = None

    def place(self, run: int, positions: FloatArray) -> None:
        """Move the robots of a run to new positions, at rest and facing along +x.

        Parameters
        ----------
        run : int
            Index of the run, from 0.
        positions : (n / runs, 2) array, m
            New centers of the robots.
        """
        rows = self._get_rows(run)
        new_positions = self.positions.copy()
        new_velocities = self.velocities.copy()
        new_positions[rows] = positions
        new_velocities[rows] = 0.0
        new_steering = None
        if self.steering is not None:
            new_steering = self.steering.copy()
            new_steering[rows] = 0.0
        self._set_state(new_positions, new_velocities, new_steering)
        self._update_spaces()

    def copy(self) -> World:
        """Return an independent copy in the same state, which continues identically.

        Returns
        -------
        World
            The copy.
        """
        # The copy has the state that `__getstate__` returns: its own spaces are built on first use.
        return copy(self)

    def __getstate__(self) -> dict[str, Any]:
        # Both are derived from other attributes and rebuilt on demand.
        return {**vars(self), "_spaces": None, "_contact_solver": None}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self._make_state_read_only()  # Pickles do not contain the flags of arrays.

    def step(
        self, forces: FloatArray, dt: float, external_forces: FloatArray | None = None, *, time: float = 0.0
    ) -> None:
        """Advance all robots by one step, under forces, viscosity and limits.

        Parameters
        ----------
        forces : (n, 2) array, N
            Forces of the controllers.
        dt : float, s
            Duration of the step, which is divided into substeps if necessary.
        external_forces : (n, 2) array or None, N
            Further forces to which no limits apply, such as the force of a mouse that drags a robot. A robot
            that was pushed beyond its maximum speed brakes as hard as it can.
        time : float, s
            Simulation time at the start of the step, which determines the positions of moving obstacles.
        """
        external = _NO_FORCES
        if external_forces is not None:
            external = np.array(external_forces, dtype=float)
        substep_count = self._count_substeps(external, dt)
        substep = dt / substep_count
        for k in range(substep_count):
            if self._obstacles.moving_obstacles:
                self._move_obstacles(time + k * substep, substep)
            self._run_substep(forces, external, substep)

    def _count_substeps(self, external: FloatArray, dt: float) -> int:
        """Return the number of substeps in a step, so that no robot can cross a thin wall in a substep."""
        max_speed = self._max_team_speed
        if self._may_exceed_max_speed or len(external) > 0:
            possible_speeds = self._compute_speeds() + self._compute_external_accelerations(external) * dt
            max_speed = max(max_speed, float(possible_speeds.max()))
        # In a substep, a robot moves by no more than its radius relative to any obstacle.
        travel_in_radii = (max_speed + self._obstacles.max_speed) * dt / self._min_radius
        return max(math.ceil(dt / MAX_SUBSTEP_S - _SUBSTEP_COUNT_TOLERANCE), math.ceil(travel_in_radii))

    def _run_substep(self, forces: FloatArray, external: FloatArray, dt: float) -> None:
        """Advance one substep.

        All robots are first moved as if there were no contacts. Those that touched something are then moved
        again from the same initial states, and their contacts are resolved.
        """
        response = self._get_response(dt)
        max_speed_after_contact = self.team.max_speed
        may_exceed_max_speed = self._may_exceed_max_speed or len(external) > 0
        if may_exceed_max_speed:
            # The limits of the controllers' forces do not allow for external forces, which are added to the
            # limited net forces. The limits after contacts do.
            limits = self._compute_speed_limits(external, dt)
            response = response._replace(max_speed=limits.without_external_forces)
            max_speed_after_contact = limits.with_external_forces
        is_rolling = self._find_rolling(external)
        steering = self.steering
        if steering is not None:
            command = self._compute_drive_command(forces, steering, is_rolling, response, dt)
            forces = command.forces
            steering = command.steering
            response = command.response
        net_forces = compute_net_forces(forces, self.velocities, response, external)
        states = self._move_freely(net_forces, dt)
        states, has_contacts = self._resolve_contacts(states, net_forces, max_speed_after_contact, dt)
        positions = np.ascontiguousarray(states[:, :2])
        velocities = np.ascontiguousarray(states[:, 2:])
        if steering is not None and has_contacts:
            # The outer wheel is faster than the center by this speed.
            turning_speed = 0.5 * self.team.track_width * np.abs(steering[:, 1])
            velocities = remove_sideways_velocity(
                velocities=velocities,
                steering=steering,
                max_speed=max_speed_after_contact - turning_speed,
                is_rolling=is_rolling,
            )
        if may_exceed_max_speed:
            speeds = compute_lengths(velocities)
            self._may_exceed_max_speed = bool((speeds > self.team.max_speed).any())
        self._set_state(positions, velocities, steering)
        if has_contacts:
            self._update_spaces()

    def _compute_drive_command(
        self,
        forces: FloatArray,
        steering: FloatArray,
        is_rolling: BoolArray,
        response: MotionResponse,
        dt: float,
    ) -> DriveCommand:
        """Compute the motion of the wheels in a substep. Robots that are not rolling do not turn."""
        return compute_drive_command(
            forces=forces,
            velocities=self.velocities,
            # The heading stays, and the turning rate of robots that are not rolling becomes 0.
            steering=steering * np.column_stack([np.ones(len(is_rolling)), is_rolling]),
            response=response,
            wheels=Wheels(self.team.track_width, self.team.turning_rate, is_rolling),
            dt=dt,
        )

    def _get_response(self, dt: float) -> MotionResponse:
        """Return the response of the team, which is computed again only if the duration has changed."""
        if self._response is None or self._response_dt != dt:
            self._response = compute_response(self.team, dt)
            self._response_dt = dt
        return self._response

    def _compute_speed_limits(self, external: FloatArray, dt: float) -> _SpeedLimits:
        """Compute the maximum speeds of robots at the end of a substep."""
        speeds = self._compute_speeds()
        without_external = np.maximum(self.team.max_speed, speeds - self.team.max_acceleration * dt)
        with_external = without_external
        if len(external) > 0:
            pushed_speeds = speeds + self._compute_external_accelerations(external) * dt
            with_external = np.maximum(without_external, pushed_speeds)
        return _SpeedLimits(without_external_forces=without_external, with_external_forces=with_external)

    def _find_rolling(self, external: FloatArray) -> BoolArray:
        """Return whether each robot is moved by wheels: unicycles on which no external force acts, (n,)."""
        if len(external) > 0:
            return self._is_unicycle & ~external.any(axis=1)
        return self._is_unicycle

    def _compute_external_accelerations(self, external: FloatArray) -> FloatArray:
        """Return the magnitudes of the accelerations due to external forces, (n,) m/s²."""
        if len(external) == 0:
            return np.zeros(len(self.team))
        return compute_lengths(external) / self.team.mass

    def _compute_speeds(self) -> FloatArray:
        """Return the speeds of the robots, (n,) m/s."""
        return compute_lengths(self.velocities)

    def _set_state(self, positions: FloatArray, velocities: FloatArray, steering: FloatArray | None) -> None:
        """Set the state of all robots, and make its arrays read-only."""
        self.positions = positions
        self.velocities = velocities
        self.steering = steering
        self._make_state_read_only()

    def _make_state_read_only(self) -> None:
        """Make the arrays of the state read-only."""
        for array in (self.positions, self.velocities, self.steering):
            if array is not None:
                array.setflags(write=False)

    def _get_rows(self, run: int) -> slice:
        """Return the rows of the robots of a run."""
        return slice(run * self._team_size, (run + 1) * self._team_size)

    def _get_spaces(self) -> list[tuple[slice, ContactDetector]]:
        """Return the spaces that move robots and detect contacts, each with the rows of its robots.

        The spaces are built by the first call. Each contains the teams of up to `MAX_TEAMS_PER_SPACE` runs.
        """
        if self._spaces is None:
            spaces = []
            robots_per_space = MAX_TEAMS_PER_SPACE * self._team_size
            for start in range(0, len(self.team), robots_per_space):
                rows = slice(start, min(start + robots_per_space, len(self.team)))
                space = ContactDetector(
                    obstacles=self._obstacles,
                    team=self.team[rows],
                    positions=self.positions[rows],
                    velocities=self.velocities[rows],
                    team_count=(rows.stop - rows.start) // self._team_size,
                )
                space.set_moving_obstacles(self._obstacle_states)
                spaces.append((rows, space))
            # Assigned only now, so that an interruption leaves no incomplete list.
            self._spaces = spaces
        return self._spaces

    def _update_spaces(self) -> None:
        """Copy the state of the robots to the pymunk bodies, after it was changed outside pymunk."""
        if self._spaces is not None:
            for rows, space in self._spaces:
                space.set_robots(self.positions[rows], self.velocities[rows])

    def _move_obstacles(self, time: float, dt: float) -> None:
        """Set the states of moving obstacles at the start of a substep."""
        self._obstacle_states = compute_obstacle_states(self._obstacles.moving_obstacles, time, dt)
        for _, space in self._get_spaces():
            space.set_moving_obstacles(self._obstacle_states)

    def _move_freely(self, net_forces: FloatArray, dt: float) -> FloatArray:
        """Move the robots for one substep as if there were no contacts, and return their states.

        The states are x, y, vx and vy, (n, 4).
        """
        states = [space.step(net_forces[rows], dt) for rows, space in self._get_spaces()]
        return states[0] if len(states) == 1 else np.concatenate(states)

    def _list_touching_robots(self) -> list[int]:
        """Return the robots that touched something during the last `_move_freely`, ascending."""
        robots: list[int] = []
        for rows, space in self._get_spaces():
            robots += [rows.start + robot for robot in space.list_touching_robots()]
        return robots

    def _resolve_contacts(
        self, states: FloatArray, net_forces: FloatArray, max_speed: FloatArray, dt: float
    ) -> tuple[FloatArray, bool]:
        """Return the states after resolving contacts, and whether there were any."""
        touching_by_run: dict[int, list[int]] = {}
        for robot in self._list_touching_robots():
            touching_by_run.setdefault(robot // self._team_size, []).append(robot)
        if not touching_by_run:
            return states, False
        states = states.copy()
        for run, touching_robots in touching_by_run.items():
            self._resolve_contacts_in_run(
                run=run,
                touching_robots=touching_robots,
                states=states,
                net_forces=net_forces,
                max_speed=max_speed,
                dt=dt,
            )
        return states, True

    def _resolve_contacts_in_run(
        self,
        run: int,
        touching_robots: list[int],
        states: FloatArray,
        net_forces: FloatArray,
        max_speed: FloatArray,
        dt: float,
    ) -> None:
        """Move the robots in contact again, together with all robots into which they are pushed.

        The new states are written to `states`.
        """
        if self._contact_solver is None:
            self._contact_solver = ContactSolver(self.team, self._obstacles)
        rows = self._get_rows(run)
        radius = self.team.radius[rows]
        initial_states = np.column_stack([self.positions, self.velocities])
        is_resolved = np.zeros(self._team_size, dtype=bool)
        robots = np.array(touching_robots)
        while True:
            states[robots] = self._contact_solver.move(
                robots=robots,
                states=initial_states[robots],
                net_forces=net_forces[robots],
                obstacle_states=self._obstacle_states,
                max_speed=max_speed[robots],
                dt=dt,
            )
            is_resolved[robots - rows.start] = True
            positions = np.ascontiguousarray(states[rows, :2])
            first, second, distances = find_close_pairs(positions, 2.0 * float(radius.max()))
            is_overlapping = distances < radius[first] + radius[second]
            is_pushed = is_resolved[first] & ~is_resolved[second] & is_overlapping
            if not is_pushed.any():
                return
            # Move all these robots once more from their initial states, together with the pushed ones.
            is_resolved[second[is_pushed]] = True
            robots = rows.start + np.flatnonzero(is_resolved)
