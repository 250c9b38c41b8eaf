"""Contacts: finding the robots that touch something, and moving them again in fine substeps.

Besides positions and velocities, pymunk stores cached impulses, overlap corrections that it has yet to
apply, and a search tree whose shape depends on the past. A step must depend on nothing but positions and
velocities, so that a copy of a world continues identically, bit for bit. Therefore all robots are first moved
as if there were no contacts (`ContactDetector`), and those that pymunk reports in contact are moved again,
from the same state, by a `ContactSolver`, which stores nothing between steps.
"""

from __future__ import annotations

import math

import pymunk

from robocov.arrays import Array, IntArray
from robocov.team import Team
from robocov.world.bodies import WALLS_ONLY, BodyArrays, build_obstacle_space, build_robot
from robocov.world.dynamics import compute_clip_factor
from robocov.world.obstacle_pieces import Obstacles

MAX_PENETRATION = 1e-3
"""Maximum depth, in meters, to which robots may sink into walls or each other. A robot in contact moves no
farther than this in one substep."""

_MAX_SUBSTEPS = 64
"""Maximum number of substeps of a step; very fast robots may then sink in farther."""
_COLLISION_SLOP_M = 1e-4
"""Overlap with a wall that pymunk does not correct."""
_MOVER_COLLISION_BIAS = 1e-9
"""Fraction of an overlap that remains after one second if obstacles move: not 0, so that a robot that one of
them has run over is pushed out gradually."""
_BASE_ITERATIONS = 20
"""Solver iterations, to which those for the ratio of masses are added."""
_MAX_CORNER_WALLS = 3
"""Maximum number of walls in a corner that a pushed robot is moved out of, one after the other."""


class ContactDetector:
    """Moves robots as if there were no contacts, and reports which robots did touch something.

    Several teams may share the space; robots of different teams pass through each other.

    Parameters
    ----------
    obstacles : Obstacles
    team : Team
        All robots of all teams, n of them.
    positions, velocities : (n, 2) arrays, m and m/s
    team_count : int
        Number of teams, of equal size.
    """

    def __init__(
        self, obstacles: Obstacles, team: Team, positions: Array, velocities: Array, team_count: int = 1
    ) -> None:
        space, movers = build_obstacle_space(obstacles)
        # This space only detects contacts: it does not resolve them, and forgets them after a step.
        space.iterations = 1
        space.collision_persistence = 1
        space.collision_bias = 1.0  # Overlaps are never pushed apart.
        team_size = len(team) // team_count
        robots = []
        for row, (mass, radius) in enumerate(zip(team.mass.tolist(), team.radius.tolist(), strict=True)):
            body, disc = build_robot(mass=mass, radius=radius, team=row // team_size)
            # Set the position first: pymunk would register a contact between discs added at one place.
            body.position = tuple(positions[row].tolist())
            space.add(body, disc)
            robots.append(body)
        self._space = space
        self._arrays = BodyArrays(space, capacity=len(movers) + len(robots) + 1)
        self._robot_rows = self._arrays.find_rows(robots)
        self._mover_rows = self._arrays.find_rows(movers)
        self._robot_of_body = {body.id: robot for robot, body in enumerate(robots)}
        self.set_robots(positions, velocities)

    def set_robots(self, positions: Array, velocities: Array) -> None:
        """Set the states of all robots.

        Parameters
        ----------
        positions : (n, 2) array, m
        velocities : (n, 2) array, m/s
        """
        self._arrays.states[self._robot_rows, :2] = positions
        self._arrays.states[self._robot_rows, 2:] = velocities
        self._arrays.write_states()

    def set_movers(self, states: Array) -> None:
        """Set the states of moving obstacles.

        Parameters
        ----------
        states : (movers, 4) array, m and m/s
            As `bodies.compute_mover_states` returns them.
        """
        self._arrays.states[self._mover_rows] = states
        self._arrays.write_states()

    def step(self, net_forces: Array, dt: float) -> Array:
        """Move all robots under net forces.

        Parameters
        ----------
        net_forces : (n, 2) array, N
        dt : float, s

        Returns
        -------
        (n, 4) array, m and m/s
            x, y, vx and vy of each robot.
        """
        self._arrays.forces[self._robot_rows] = net_forces
        self._arrays.write_forces()
        self._space.step(dt)
        self._arrays.read_states()
        return self._arrays.states[self._robot_rows].copy()

    def list_touching_robots(self) -> list[int]:
        """List the robots that touched something in the last step.

        Returns
        -------
        list of int
            Ascending.
        """
        bodies = self._arrays.list_touching_bodies()
        return sorted({self._robot_of_body[body] for body in bodies if body in self._robot_of_body})


class ContactSolver:
    """Moves robots that touch something, in a space that contains only them and the obstacles.

    It stores nothing between calls: pymunk drops a contact when the discs leave the space.

    Parameters
    ----------
    team : Team
        All robots that may come into contact.
    obstacles : Obstacles
    """

    def __init__(self, team: Team, obstacles: Obstacles) -> None:
        self._team = team
        self._max_mover_speed = obstacles.max_speed
        space, self._movers = build_obstacle_space(obstacles)
        # A light robot between a heavy one and a wall needs about as many iterations as the ratio of masses.
        mass_ratio = float(team.mass.max() / team.mass.min())
        space.iterations = _BASE_ITERATIONS + math.ceil(2.0 * mass_ratio)
        space.collision_slop = _COLLISION_SLOP_M
        # With 0, each substep removes all overlap.
        space.collision_bias = _MOVER_COLLISION_BIAS if self._movers else 0.0
        self._space = space
        self._arrays = BodyArrays(space, capacity=len(self._movers) + len(team) + 1)
        self._mover_rows = self._arrays.find_rows(self._movers)
        self._robots = [
            build_robot(mass=mass, radius=radius)
            for mass, radius in zip(team.mass.tolist(), team.radius.tolist(), strict=True)
        ]
        self._max_travel = min(MAX_PENETRATION, 0.1 * float(team.radius.min()))

    def move(
        self,
        robots: IntArray,
        states: Array,
        net_forces: Array,
        mover_states: Array,
        max_speed: Array,
        dt: float,
    ) -> Array:
        """Move some robots by `dt` seconds, with contacts.

        Parameters
        ----------
        robots : (k,) array
            Their rows in the team, ascending.
        states : (k, 4) array, m and m/s
            x, y, vx, vy of these robots.
        net_forces : (k, 2) array, N
        mover_states : (movers, 4) array, m and m/s
            As `bodies.compute_mover_states` returns them.
        max_speed : (k,) array, m/s
            Maximum speed of each robot afterwards: a contact can make it faster than its drive can.
        dt : float, s

        Returns
        -------
        (k, 4) array, m and m/s
            x, y, vx, vy afterwards.
        """
        members = [self._robots[robot] for robot in robots.tolist()]
        bodies = [body for body, _ in members]
        discs = [disc for _, disc in members]
        self._space.add(*bodies)
        try:
            rows = self._arrays.find_rows(bodies)
            self._arrays.states[:] = 0.0  # This includes the row of the static body.
            self._arrays.states[self._mover_rows] = mover_states
            self._arrays.states[rows] = states
            self._arrays.write_states()
            self._space.add(*discs)
            self._arrays.forces[rows] = net_forces
            substeps = self._count_substeps(robots, states, net_forces, dt)
            self._run_substeps(members, substeps, dt / substeps)
            self._space.remove(*discs)
            self._arrays.read_states()
            final = self._arrays.states[rows].copy()
            for row, (vx, vy) in enumerate(final[:, 2:].tolist()):
                final[row, 2:] *= compute_clip_factor(vx, vy, float(max_speed[row]))
            # These corrections change the positions; the velocities are those from before.
            self._finish_corrections(members, dt / substeps)
            final[:, :2] = self._arrays.states[rows, :2]
            return final
        finally:
            # Leave no robots in the space, even after an interruption.
            self._arrays.forces[:] = 0.0
            self._space.remove(*[disc for disc in discs if disc.space is not None])
            self._space.remove(*bodies)

    def _count_substeps(self, robots: IntArray, states: Array, net_forces: Array, dt: float) -> int:
        """Return how many substeps limit the travel in each to `_max_travel`, at most `_MAX_SUBSTEPS`."""
        max_squared_speed = 0.0
        mass = self._team.mass[robots].tolist()
        for (_, _, vx, vy), (fx, fy), m in zip(states.tolist(), net_forces.tolist(), mass, strict=True):
            final_vx = vx + fx * (dt / m)
            final_vy = vy + fy * (dt / m)
            max_squared_speed = max(
                max_squared_speed, vx * vx + vy * vy, final_vx * final_vx + final_vy * final_vy
            )
        speed = math.sqrt(max_squared_speed) + self._max_mover_speed
        return min(_MAX_SUBSTEPS, max(1, math.ceil(speed * dt / self._max_travel)))

    def _run_substeps(
        self, members: list[tuple[pymunk.Body, pymunk.Circle]], substeps: int, dt: float
    ) -> None:
        """Run substeps of `dt` seconds each, all under the same forces."""
        for _ in range(substeps):
            self._arrays.write_forces()
            self._run_substep(members, dt)

    def _finish_corrections(self, members: list[tuple[pymunk.Body, pymunk.Circle]], dt: float) -> None:
        """Apply the overlap corrections that pymunk has computed but not yet applied, and read the states."""
        self._arrays.states[:, 2:] = 0.0
        self._arrays.write_states()
        self._run_substep(members, dt)
        self._arrays.read_states()

    def _run_substep(self, members: list[tuple[pymunk.Body, pymunk.Circle]], dt: float) -> None:
        """Run a substep; afterwards, no robot is in a wall into which a moving obstacle has pushed it."""
        if not self._movers:
            self._space.step(dt)
            return
        old_positions = [body.position for body, _ in members]
        self._space.step(dt)
        self._keep_out_of_walls(members, old_positions)

    def _keep_out_of_walls(
        self, members: list[tuple[pymunk.Body, pymunk.Circle]], old_positions: list[pymunk.Vec2d]
    ) -> None:
        """Move robots that a moving obstacle has pushed into a wall back in front of that wall.

        Walls take precedence over moving obstacles, which then pass over the robot.
        """
        for (body, disc), old_position in zip(members, old_positions, strict=True):
            crossed = self._space.segment_query_first(old_position, body.position, 0.0, WALLS_ONLY)
            if crossed is not None:
                body.position = old_position
            for _ in range(_MAX_CORNER_WALLS):  # Leaving one wall may mean entering another.
                wall = self._space.point_query_nearest(body.position, disc.radius, WALLS_ONLY)
                if wall is None or wall.distance >= disc.radius - _COLLISION_SLOP_M or wall.distance <= 0.0:
                    break
                away = body.position - wall.point
                body.position = wall.point + away * (disc.radius / math.hypot(*away))
