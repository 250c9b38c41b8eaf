"""Contacts: finding the robots that touch something, and moving them again in fine substeps.

Besides positions and velocities, pymunk stores cached impulses, overlap corrections that it has yet to apply,
and a search tree whose shape depends on the past. A step must depend on nothing but positions and velocities,
so that a copy of a world continues identically, bit for bit. Therefore all robots are first moved as if there
were no contacts (`ContactDetector`). The robots that pymunk reports in contact are then moved again, from the
same state, by a `ContactSolver`, which stores nothing between steps.
"""

from __future__ import annotations

import math

import pymunk

from robocov.team import Team
from robocov.typing import FloatArray, IntArray
from robocov.world.bodies import WALLS_ONLY, BodyAndDisc, BodyArrays, build_obstacle_space, build_robot
from robocov.world.dynamics import compute_clip_factor
from robocov.world.obstacle_pieces import Obstacles

MAX_PENETRATION_M = 1e-3
"""Maximum depth to which robots may sink into walls or each other. A robot in contact moves no farther than
this in one substep."""

_MAX_TRAVEL_RADII = 0.1
"""Maximum distance that a robot in contact moves in one substep, as a fraction of the smallest radius."""
_MAX_SUBSTEPS = 64
"""Maximum number of finer substeps into which a substep of `World` is divided. Very fast robots may then sink
in deeper than `MAX_PENETRATION_M`."""
_COLLISION_SLOP_M = 1e-4
"""Overlap that pymunk does not correct."""
_MOVING_COLLISION_BIAS = 1e-9
"""Fraction of an overlap that remains after one second if obstacles move. It is not 0, so that a robot that a
moving obstacle has run over is pushed out gradually."""
_BASE_ITERATIONS = 20
"""Number of solver iterations, to which twice the ratio of masses is added."""
_MAX_CORNER_WALLS = 3
"""Maximum number of walls that a pushed robot is moved out of, one after another, as in a corner."""


class ContactDetector:
    """Moves robots as if there were no contacts, and reports which robots did touch something.

    Several teams may share the space. Robots of different teams pass through each other.

    Parameters
    ----------
    obstacles : Obstacles
        Walls, moving obstacles and failed robots.
    team : Team
        All n robots of all teams, one team after another.
    positions : (n, 2) array, m
        Centers of the robots.
    velocities : (n, 2) array, m/s
        Velocities of the robots.
    team_count : int
        Number of teams, which have equal sizes.
    """

    def __init__(
        self,
        obstacles: Obstacles,
        team: Team,
        positions: FloatArray,
        velocities: FloatArray,
        team_count: int = 1,
    ) -> None:
        space, moving_bodies = build_obstacle_space(obstacles)
        # This space detects contacts, but does not resolve them. It forgets contacts after a step.
        space.iterations = 1
        space.collision_persistence = 1
        space.collision_bias = 1.0  # Overlaps are never pushed apart.
        team_size = len(team) // team_count
        robots = []
        for row, (mass, radius) in enumerate(zip(team.mass.tolist(), team.radius.tolist(), strict=True)):
            body, disc = build_robot(mass=mass, radius=radius, team=row // team_size)
            # The position is set before the body is added. Otherwise, pymunk would register a contact between
            # discs that are added at the same position.
            body.position = tuple(positions[row].tolist())
            space.add(body, disc)
            robots.append(body)
        self._space = space
        self._arrays = BodyArrays(space, capacity=len(moving_bodies) + len(robots) + 1)
        self._robot_rows = self._arrays.find_rows(robots)
        self._moving_rows = self._arrays.find_rows(moving_bodies)
        self._robot_of_body = {body.id: robot for robot, body in enumerate(robots)}
        self.set_robots(positions, velocities)

    def set_robots(self, positions: FloatArray, velocities: FloatArray) -> None:
        """Set the states of all robots.

        Parameters
        ----------
        positions : (n, 2) array, m
            Centers of the robots.
        velocities : (n, 2) array, m/s
            Velocities of the robots.
        """
        self._arrays.states[self._robot_rows, :2] = positions
        self._arrays.states[self._robot_rows, 2:] = velocities
        self._arrays.write_states()

    def set_moving_obstacles(self, states: FloatArray) -> None:
        """Set the states of moving obstacles.

        Parameters
        ----------
        states : (m, 4) array, m and m/s
            Displacements and velocities, as returned by `bodies.compute_obstacle_states`.
        """
        self._arrays.states[self._moving_rows] = states
        self._arrays.write_states()

    def step(self, net_forces: FloatArray, dt: float) -> FloatArray:
        """Move all robots under net forces.

        Parameters
        ----------
        net_forces : (n, 2) array, N
            Force on each robot.
        dt : float, s
            Duration of the step.

        Returns
        -------
        (n, 4) array, m and m/s
            x, y, vx and vy of each robot after the step.
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
            Indices of the robots, ascending.
        """
        bodies = self._arrays.list_touching_bodies()
        return sorted({self._robot_of_body[body] for body in bodies if body in self._robot_of_body})


class ContactSolver:
    """Moves robots that touch something, in a space that contains only these robots and the obstacles.

    A step of this class is a substep of `World`. It is divided into finer substeps, so that robots in contact
    move only a little in each. The space stores nothing about earlier contacts, because pymunk forgets a
    contact when a disc is removed.

    Parameters
    ----------
    team : Team
        All robots that may come into contact.
    obstacles : Obstacles
        Walls, moving obstacles and failed robots.
    """

    def __init__(self, team: Team, obstacles: Obstacles) -> None:
        self._team = team
        self._max_obstacle_speed = obstacles.max_speed
        space, self._moving_bodies = build_obstacle_space(obstacles)
        # For a light robot between a heavy one and a wall, the solver needs about as many iterations as the
        # ratio of the masses.
        mass_ratio = float(team.mass.max() / team.mass.min())
        space.iterations = _BASE_ITERATIONS + math.ceil(2.0 * mass_ratio)
        space.collision_slop = _COLLISION_SLOP_M
        # If the bias is 0, pymunk corrects all overlap beyond the slop in one substep.
        space.collision_bias = _MOVING_COLLISION_BIAS if self._moving_bodies else 0.0
        self._space = space
        self._arrays = BodyArrays(space, capacity=len(self._moving_bodies) + len(team) + 1)
        self._moving_rows = self._arrays.find_rows(self._moving_bodies)
        self._robots = [
            build_robot(mass=mass, radius=radius)
            for mass, radius in zip(team.mass.tolist(), team.radius.tolist(), strict=True)
        ]
        self._max_travel = min(MAX_PENETRATION_M, _MAX_TRAVEL_RADII * float(team.radius.min()))

    def move(
        self,
        robots: IntArray,
        states: FloatArray,
        net_forces: FloatArray,
        obstacle_states: FloatArray,
        max_speed: FloatArray,
        dt: float,
    ) -> FloatArray:
        """Move some robots by one substep of `World`, and resolve their contacts.

        Parameters
        ----------
        robots : (k,) array
            Indices of the robots in the team, ascending.
        states : (k, 4) array, m and m/s
            x, y, vx and vy of these robots before the substep.
        net_forces : (k, 2) array, N
            Force on each of these robots.
        obstacle_states : (m, 4) array, m and m/s
            Displacements and velocities of the moving obstacles, as returned by
            `bodies.compute_obstacle_states`.
        max_speed : (k,) array, m/s
            Speed to which each robot is limited after the substep, because a contact may accelerate it.
        dt : float, s
            Duration of the substep of `World`.

        Returns
        -------
        (k, 4) array, m and m/s
            x, y, vx and vy of these robots after the substep.
        """
        bodies_and_discs = [self._robots[robot] for robot in robots.tolist()]
        bodies = [body for body, _ in bodies_and_discs]
        discs = [disc for _, disc in bodies_and_discs]
        self._space.add(*bodies)
        try:
            rows = self._arrays.find_rows(bodies)
            # The states of all other bodies, such as the static body, are 0.
            self._arrays.states[:] = 0.0
            self._arrays.states[self._moving_rows] = obstacle_states
            self._arrays.states[rows] = states
            self._arrays.write_states()
            # As in `ContactDetector`, discs are added only after their bodies were placed.
            self._space.add(*discs)
            self._arrays.forces[rows] = net_forces
            substep_count = self._count_substeps(robots, states, net_forces, dt)
            substep = dt / substep_count
            for _ in range(substep_count):
                self._arrays.write_forces()
                self._run_substep(bodies_and_discs, substep)
            # Without the discs, the step that applies the corrections finds no new contacts.
            self._space.remove(*discs)
            self._arrays.read_states()
            final_states = self._arrays.states[rows].copy()
            for k, (vx, vy) in enumerate(final_states[:, 2:].tolist()):
                final_states[k, 2:] *= compute_clip_factor(vx, vy, float(max_speed[k]))
            self._apply_pending_corrections(bodies_and_discs, substep)
            self._arrays.read_states()
            # The corrections changed the positions. The velocities stay those from before the corrections.
            final_states[:, :2] = self._arrays.states[rows, :2]
            return final_states
        finally:
            # Leave no robots in the space, even after an interruption.
            self._arrays.forces[:] = 0.0
            self._space.remove(*[disc for disc in discs if disc.space is not None])
            self._space.remove(*bodies)

    def _count_substeps(self, robots: IntArray, states: FloatArray, net_forces: FloatArray, dt: float) -> int:
        """Return the number of substeps that limits the travel in each to `_max_travel`.

        It is at most `_MAX_SUBSTEPS`, even if the travel is then longer.
        """
        max_squared_speed = 0.0
        masses = self._team.mass[robots].tolist()
        for (_, _, vx, vy), (fx, fy), m in zip(states.tolist(), net_forces.tolist(), masses, strict=True):
            final_vx = vx + fx * (dt / m)
            final_vy = vy + fy * (dt / m)
            max_squared_speed = max(
                max_squared_speed, vx * vx + vy * vy, final_vx * final_vx + final_vy * final_vy
            )
        speed = math.sqrt(max_squared_speed) + self._max_obstacle_speed
        return min(_MAX_SUBSTEPS, max(1, math.ceil(speed * dt / self._max_travel)))

    def _apply_pending_corrections(self, bodies_and_discs: list[BodyAndDisc], dt: float) -> None:
        """Apply the overlap corrections that pymunk has computed but not yet applied.

        Pymunk applies them in the next substep, which here is one at rest.
        """
        self._arrays.states[:, 2:] = 0.0
        self._arrays.write_states()
        self._run_substep(bodies_and_discs, dt)

    def _run_substep(self, bodies_and_discs: list[BodyAndDisc], dt: float) -> None:
        """Run a substep, and move robots out of walls into which a moving obstacle has pushed them."""
        if not self._moving_bodies:
            self._space.step(dt)
            return
        old_positions = [body.position for body, _ in bodies_and_discs]
        self._space.step(dt)
        self._keep_out_of_walls(bodies_and_discs, old_positions)

    def _keep_out_of_walls(
        self, bodies_and_discs: list[BodyAndDisc], old_positions: list[pymunk.Vec2d]
    ) -> None:
        """Move robots out of walls into which a moving obstacle has pushed them.

        Walls take precedence over moving obstacles, which then pass over the robot.
        """
        for (body, disc), old_position in zip(bodies_and_discs, old_positions, strict=True):
            crossed_wall = self._space.segment_query_first(old_position, body.position, 0.0, WALLS_ONLY)
            if crossed_wall is not None:
                body.position = old_position
            for _ in range(_MAX_CORNER_WALLS):  # Leaving one wall may mean entering another.
                wall = self._space.point_query_nearest(body.position, disc.radius, WALLS_ONLY)
                if wall is None or wall.distance >= disc.radius - _COLLISION_SLOP_M:
                    break
                # If the center is inside the wall, the vector from the wall to the center leads deeper into
                # it.
                if wall.distance <= 0.0:
                    break
                away = body.position - wall.point
                body.position = wall.point + away * (disc.radius / math.hypot(*away))
