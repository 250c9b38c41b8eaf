"""The world of a team whose robots fail and join."""

from __future__ import annotations

from copy import copy
from dataclasses import replace
from typing import Any

import numpy as np

from robocov.conditions import Conditions
from robocov.environment import Environment
from robocov.errors import StartError, format_position
from robocov.team import Team
from robocov.typing import BoolArray, FloatArray
from robocov.world.free_positions import find_free_position
from robocov.world.obstacle_pieces import build_obstacles
from robocov.world.unicycles import initialize_steering
from robocov.world.world import World

_TURNING_RATE = 1
"""Column of the steering: turning rate, rad/s."""


class ChangingWorld:
    """A world whose robots fail and join at given times.

    Its arrays have a row for each robot that is part of the team at any time. A robot that has failed is an
    obstacle from then on. A robot that has not joined yet is not in the world, and its row contains the
    position at which it will join. Whenever the team changes, the working robots continue in a new `World`.

    Parameters
    ----------
    conditions : Conditions
        Times at which robots fail and join.
    environment : Environment
        The map.
    team : Team
        All n robots.
    positions : (n, 2) array, m
        Centers of the robots.
    velocities : (n, 2) array or None, m/s
        Velocities of the robots. By default, robots are at rest.
    steering : (n, 2) array or None, rad and rad/s
        Heading and turning rate of unicycles. By default, they face the direction in which they move.
    time : float, s
        Simulation time of this state.

    Attributes
    ----------
    team : Team
        All n robots.
    positions : (n, 2) array, m
        Centers of the robots. Read-only.
    velocities : (n, 2) array, m/s
        Velocities of the robots. Read-only.
    steering : (n, 2) array or None, rad and rad/s
        Heading and turning rate of unicycles; None for a team without unicycles. Read-only.
    is_working : (n,) bool array
        Whether each robot is present and has not failed. Read-only.
    """

    def __init__(
        self,
        conditions: Conditions,
        environment: Environment,
        team: Team,
        positions: FloatArray,
        velocities: FloatArray | None = None,
        *,
        steering: FloatArray | None = None,
        time: float = 0.0,
    ) -> None:
        self.team = team
        self._conditions = conditions
        self._environment = environment
        self._obstacles = build_obstacles(environment)
        self.positions = np.array(positions, dtype=float)
        self.velocities = np.zeros_like(self.positions)
        if velocities is not None:
            self.velocities = np.array(velocities, dtype=float)
        self.steering = initialize_steering(team, self.velocities, steering)
        self.is_working = conditions.find_working_robots(time, len(team))
        self._stop_idle_robots()
        self._failed = conditions.find_failed_robots(time, len(team))
        is_absent = ~(self.is_working | self._failed)
        for join in conditions.joins:
            if join.position is not None and is_absent[join.robot - 1]:
                self.positions[join.robot - 1] = join.position
        self._build_world()

    @property
    def failed_robots(self) -> FloatArray:
        """Center x, center y and radius of each robot that has failed, (f, 3) m."""
        return np.column_stack([self.positions, self.team.radius])[self._failed]

    def copy(self) -> ChangingWorld:
        """Return an independent copy in the same state, which continues identically.

        Returns
        -------
        ChangingWorld
            The copy.
        """
        world = copy(self)
        world._world = None if self._world is None else self._world.copy()
        return world

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self._make_state_read_only()  # Pickles do not contain the flags of arrays.

    def step(
        self, forces: FloatArray, dt: float, external_forces: FloatArray | None = None, *, time: float = 0.0
    ) -> None:
        """Move the working robots by `World.step`, then let robots fail and join.

        Parameters
        ----------
        forces : (n, 2) array, N
            Forces of the controllers.
        dt : float, s
            Duration of the step.
        external_forces : (n, 2) array or None, N
            Further forces; see `World.step`.
        time : float, s
            Simulation time at the start of the step.

        Raises
        ------
        StartError
            If there is no space for a robot that joins.
        """
        self._move_working_robots(forces, dt, external_forces, time)
        self._change_team(time + dt)
        self._make_state_read_only()

    def _move_working_robots(
        self, forces: FloatArray, dt: float, external_forces: FloatArray | None, time: float
    ) -> None:
        """Move the working robots in their own world. All other robots stay at rest at their positions."""
        self.positions = self.positions.copy()
        self.velocities = np.zeros_like(self.velocities)
        if self._world is None:
            return
        rows = self._working_rows
        external = None if external_forces is None else external_forces[rows]
        self._world.step(forces[rows], dt, external, time=time)
        self.positions[rows] = self._world.positions
        self.velocities[rows] = self._world.velocities
        if self.steering is not None and self._world.steering is not None:
            self.steering = self.steering.copy()
            self.steering[rows] = self._world.steering

    def _change_team(self, time: float) -> None:
        """Apply the changes of the team up to a time: stop robots that fail, and place robots that join."""
        is_working = self._conditions.find_working_robots(time, len(self.team))
        is_present = self.is_working | self._failed
        # A robot that fails in the step in which it would join never enters.
        failed = self._conditions.find_failed_robots(time, len(self.team)) & is_present
        if (is_working == self.is_working).all() and (failed == self._failed).all():
            return
        self._failed = failed
        for robot in np.flatnonzero(is_working & ~is_present).tolist():
            self.positions[robot] = self._find_joining_position(robot, is_present, time)
            is_present[robot] = True
        self.is_working = is_working
        self._stop_idle_robots()
        self._build_world()

    def _stop_idle_robots(self) -> None:
        """Set the velocities and turning rates of the robots that do not work to zero."""
        self.velocities[~self.is_working] = 0.0
        if self.steering is not None:
            self.steering = self.steering.copy()
            self.steering[:, _TURNING_RATE] *= self.is_working

    def _find_joining_position(self, robot: int, is_present: BoolArray, time: float) -> tuple[float, float]:
        """Return the free position nearest to the position at which a robot should join."""
        x, y = self.positions[robot].tolist()
        try:
            return find_free_position(
                self._environment.at(time),
                float(self.team.radius[robot]),
                self.positions[is_present],
                (x, y),
                self.team.radius[is_present],
            )
        except StartError:
            raise StartError(
                f"robot {robot + 1} joins at {time:g} s at {format_position(x, y)}, "
                f"but there is no space for it in map {self._environment.name!r}"
            ) from None

    def _build_world(self) -> None:
        """Build the world of the working robots, or set it to None if there are none."""
        self._make_state_read_only()
        self._working_rows = np.flatnonzero(self.is_working)
        self._world: World | None = None
        if len(self._working_rows) > 0:
            rows = self._working_rows
            self._world = World(
                replace(self._obstacles, failed_robots=self.failed_robots),
                self.team[rows],
                self.positions[rows],
                self.velocities[rows],
                steering=None if self.steering is None else self.steering[rows],
            )

    def _make_state_read_only(self) -> None:
        """Make the arrays of the state read-only."""
        for array in (self.positions, self.velocities, self.is_working, self.steering):
            if array is not None:
                array.setflags(write=False)
