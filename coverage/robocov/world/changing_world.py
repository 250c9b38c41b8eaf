"""A world whose robots fail and join: that of those that are there, made anew whenever that changes.

A world goes on the same from its positions and velocities alone, so that to make it anew changes nothing
for the others. A robot that failed is an obstacle from then on; one that has not joined yet is nowhere.
"""

from __future__ import annotations

import numpy as np

from robocov.arrays import Array, BoolArray
from robocov.conditions import Conditions
from robocov.environment import Environment
from robocov.errors import StartError
from robocov.robots import Team
from robocov.world import World
from robocov.world.relocation import nearest_free
from robocov.world.solid import movers, solid_pieces


class ChangingWorld:
    """As `World`, with a row for every robot that ever is; its arrays are read-only.

    The position of a robot that has not joined yet is where it would start, or is to join; those that do not
    work have no velocity.
    """

    def __init__(
        self,
        conditions: Conditions,
        environment: Environment,
        team: Team,
        positions: Array,
        velocities: Array | None = None,
        *,
        time: float = 0.0,
    ) -> None:
        self._conditions, self._environment, self.team = conditions, environment, team
        self._pieces, self._movers = solid_pieces(environment), movers(environment)
        self.positions = np.array(positions, dtype=float)
        self.velocities = np.zeros_like(self.positions) if velocities is None else np.array(velocities)
        self.working = conditions.working(time, len(team))
        self._failed = conditions.failed(time, len(team))
        for join in conditions.joins:
            if join.place is not None and not (self.working | self._failed)[join.robot - 1]:
                self.positions[join.robot - 1] = join.place
        self._begin()

    @property
    def failed_robots(self) -> Array:
        """x, y and radius of the robots that have failed, (w, 3) m."""
        return np.column_stack([self.positions, self.team.radius])[self._failed]

    def copy(self) -> ChangingWorld:
        """Return an independent world in the same state, which goes on identically."""
        twin = object.__new__(ChangingWorld)
        twin.__dict__.update(self.__dict__)
        twin._world = None if self._world is None else self._world.copy()
        return twin

    def step(
        self, forces: Array, dt: float, external_forces: Array | None = None, *, time: float = 0.0
    ) -> None:
        """Move on as `World.step`; then robots fail and join. Raises StartError where one finds no room."""
        rows, there, time_after = self._rows, self.working | self._failed, time + dt
        self.positions, self.velocities = self.positions.copy(), np.zeros_like(self.velocities)
        if self._world is not None:
            external = None if external_forces is None else external_forces[rows]
            self._world.step(forces[rows], dt, external, time=time)
            self.positions[rows], self.velocities[rows] = self._world.positions, self._world.velocities
        working = self._conditions.working(time_after, len(self.team))
        failed = self._conditions.failed(time_after, len(self.team))
        if (working != self.working).any() or (failed != self._failed).any():
            self._failed = failed & there
            for robot in np.flatnonzero(working & ~there).tolist():
                self.positions[robot] = self._place(robot, there, time_after)
                there[robot] = True
            self.working = working
            self.velocities[~working] = 0.0
            self._begin()
        self._protect()

    def _place(self, robot: int, there: BoolArray, time: float) -> tuple[float, float]:
        """Return where a robot joins, as near as it fits beside those that are there."""
        radius, (x, y) = self.team.radius, self.positions[robot].tolist()
        environment, others = self._environment.at(time), self.positions[there]
        try:
            return nearest_free(environment, float(radius[robot]), others, (x, y), radius[there])
        except StartError:
            raise StartError(
                f"robot {robot + 1} joins at {time:g} s at [{x:g}, {y:g}], but there is no room for it in "
                f"map {self._environment.name!r}"
            ) from None

    def _begin(self) -> None:
        """Make the world of the robots that work."""
        self._protect()
        rows = self._rows = np.flatnonzero(self.working)
        # a team of none is no team
        self._world: World | None = None
        if len(rows):
            state = self.team[rows], self.positions[rows], self.velocities[rows]
            self._world = World(self._pieces, *state, movers=self._movers, failed_robots=self.failed_robots)

    def _protect(self) -> None:
        for array in (self.positions, self.velocities, self.working):
            array.setflags(write=False)
