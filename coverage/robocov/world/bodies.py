"""The pymunk bodies of a world: obstacles and robots, and their states as arrays.

Only pymunk's public interface is used. `pymunk.batch` reads and writes the states of all bodies of a space
in one call.
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
import pymunk
from pymunk import batch

from robocov.typing import FloatArray, IntArray
from robocov.world.obstacle_pieces import MovingObstacle, Obstacles

BodyAndDisc: TypeAlias = tuple[pymunk.Body, pymunk.Circle]
"""The body of a robot, and its shape."""

WALL_CATEGORY = 0b1
"""Filter category of shapes that robots never enter: walls and failed robots, but not moving obstacles."""
WALLS_ONLY = pymunk.ShapeFilter(mask=WALL_CATEGORY)
"""Filter of queries that find only walls and failed robots."""
MAX_TEAMS_PER_SPACE = 31
"""Maximum number of teams in one space. A filter has 32 categories: one for walls, and one for each team."""

_ALL_BUT_WALLS = pymunk.ShapeFilter.ALL_CATEGORIES() & ~WALL_CATEGORY
"""Filter categories of moving obstacles, and of robots that collide with all others."""
_FORCE_FIELD = batch.BodyFields.FORCE
_STATE_FIELDS = batch.BodyFields.POSITION | batch.BodyFields.VELOCITY
"""Fields of bodies in `BodyArrays.forces` and `BodyArrays.states`."""
_CONTACT_FIELDS = batch.ArbiterFields.BODY_A_ID | batch.ArbiterFields.BODY_B_ID
"""Fields of contacts: the ids of the two bodies."""


def build_obstacle_space(obstacles: Obstacles) -> tuple[pymunk.Space, list[pymunk.Body]]:
    """Build a space with all obstacles and no robots.

    Walls and failed robots belong to the static body. Shapes have no friction.

    Parameters
    ----------
    obstacles : Obstacles
        Content of the space.

    Returns
    -------
    space : pymunk.Space
        Space in which all moving obstacles are at their positions at time zero.
    moving_bodies : list of pymunk.Body
        A kinematic body for each moving obstacle. The position of the body is the displacement of the
        obstacle since time zero.
    """
    space = pymunk.Space()
    moving_bodies = []
    # Walls and failed robots keep the default filter, which contains all categories and so `WALL_CATEGORY`.
    for polygon in obstacles.walls:
        space.add(pymunk.Poly(space.static_body, polygon.tolist()))
    if obstacles.failed_robots is not None:
        for x, y, radius in obstacles.failed_robots.tolist():
            space.add(pymunk.Circle(space.static_body, radius, (x, y)))
    for obstacle in obstacles.moving_obstacles:
        body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        space.add(body)
        for polygon in obstacle.pieces:
            shape = pymunk.Poly(body, polygon.tolist())
            shape.filter = pymunk.ShapeFilter(categories=_ALL_BUT_WALLS)
            space.add(shape)
        moving_bodies.append(body)
    return space, moving_bodies


def build_robot(mass: float, radius: float, team: int | None = None) -> BodyAndDisc:
    """Build the body of a robot: a frictionless disc that never rotates.

    Contacts do not depend on the heading of a unicycle, which is part of `World.steering`.

    Parameters
    ----------
    mass : float, kg
        Mass of the robot.
    radius : float, m
        Radius of the robot.
    team : int or None
        Index of the robot's team, from 0 to ``MAX_TEAMS_PER_SPACE - 1``, if several teams share the space.
        Robots of different teams do not collide. By default, the robot collides with all others.

    Returns
    -------
    body : pymunk.Body
        Body with infinite moment of inertia.
    disc : pymunk.Circle
        Shape of the body.
    """
    body = pymunk.Body(mass, math.inf)
    disc = pymunk.Circle(body, radius)
    if team is None:
        disc.filter = pymunk.ShapeFilter(categories=_ALL_BUT_WALLS)
    else:
        own_category = 0b10 << team
        disc.filter = pymunk.ShapeFilter(categories=own_category, mask=own_category | WALL_CATEGORY)
    return body, disc


class BodyArrays:
    """Positions, velocities and forces of the bodies of a space as arrays.

    Each row belongs to a body, in the order in which pymunk lists the bodies. `find_rows` returns the rows of
    given bodies. Changes of the arrays take effect when the arrays are written to the space.

    Parameters
    ----------
    space : pymunk.Space
        The space whose bodies are read and written.
    capacity : int
        Maximum number of bodies that the space will contain.

    Attributes
    ----------
    forces : (capacity, 2) array, N
        Forces for the next step of the space, which pymunk resets after each step.
    states : (capacity, 4) array, m and m/s
        x, y, vx and vy.
    """

    def __init__(self, space: pymunk.Space, capacity: int) -> None:
        self._space = space
        # An additional row is needed, because pymunk reallocates a buffer as soon as it is full.
        self.forces = np.zeros((capacity + 1, 2))
        self.states = np.zeros((capacity + 1, 4))
        self._force_buffer = _wrap_array(self.forces)
        self._state_buffer = _wrap_array(self.states)
        self._id_buffer = batch.Buffer()

    def find_rows(self, bodies: list[pymunk.Body]) -> slice | IntArray:
        """Find the rows of bodies that are in the space.

        Parameters
        ----------
        bodies : list of pymunk.Body
            Bodies in the space.

        Returns
        -------
        slice or int array
            Row of each body, in the order of the list. If the rows are consecutive, which is the usual case,
            they are a slice, which makes indexing faster.
        """
        self._id_buffer.clear()
        batch.get_space_bodies(self._space, batch.BodyFields.BODY_ID, self._id_buffer)
        rows_by_id = {body_id: row for row, body_id in enumerate(self._read_ids())}
        rows = [rows_by_id[body.id] for body in bodies]
        first = rows[0] if rows else 0
        if rows == list(range(first, first + len(rows))):
            return slice(first, first + len(rows))
        return np.array(rows, dtype=np.intp)

    def write_forces(self) -> None:
        """Set the forces of all bodies for the next step."""
        batch.set_space_bodies(self._space, _FORCE_FIELD, self._force_buffer)

    def write_states(self) -> None:
        """Set the positions and velocities of all bodies."""
        batch.set_space_bodies(self._space, _STATE_FIELDS, self._state_buffer)

    def read_states(self) -> None:
        """Read the positions and velocities of all bodies into `states`."""
        self._state_buffer.clear()
        batch.get_space_bodies(self._space, _STATE_FIELDS, self._state_buffer)

    def list_touching_bodies(self) -> list[int]:
        """List the bodies that were in contact in the last step.

        Returns
        -------
        list of int
            Ids of the bodies. A body appears once for each of its contacts.
        """
        self._id_buffer.clear()
        batch.get_space_arbiters(self._space, _CONTACT_FIELDS, self._id_buffer)
        return self._read_ids()

    def _read_ids(self) -> list[int]:
        """Return the ids of bodies that pymunk has written to the buffer."""
        buffer = self._id_buffer.int_buf()
        if len(buffer) == 0:
            return []
        ids: list[int] = np.frombuffer(buffer, dtype=np.uintp).tolist()
        return ids


def _wrap_array(array: FloatArray) -> batch.Buffer:
    """Return a buffer that reads from and writes to an array."""
    buffer = batch.Buffer()
    buffer.set_float_buf(array)
    return buffer


def compute_obstacle_states(
    moving_obstacles: tuple[MovingObstacle, ...], time: float, dt: float
) -> FloatArray:
    """Compute the displacements and velocities of moving obstacles.

    Parameters
    ----------
    moving_obstacles : tuple of MovingObstacle
        The m obstacles.
    time : float, s
        Simulation time.
    dt : float, s
        Duration of the next step. The velocity is the mean velocity over this step, so that the obstacle is
        exactly on its path at the end.

    Returns
    -------
    (m, 4) array, m and m/s
        Displacement since time zero, x and y, and velocity, vx and vy.
    """
    states = np.empty((len(moving_obstacles), 4))
    for row, obstacle in enumerate(moving_obstacles):
        displacement = obstacle.path.compute_displacement(time)
        states[row, :2] = displacement
        states[row, 2:] = (obstacle.path.compute_displacement(time + dt) - displacement) / dt
    return states
