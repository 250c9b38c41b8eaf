"""The pymunk bodies of a world: obstacles and robots, and their states as arrays.

Only pymunk's public interface is used. `pymunk.batch` reads and writes the states of all bodies of a space
in one call.
"""

from __future__ import annotations

import math

import numpy as np
import pymunk
from pymunk import batch

from robocov.arrays import Array, IntArray
from robocov.world.obstacle_pieces import Mover, Obstacles

WALL_CATEGORY = 0b1
"""Filter category of shapes that robots never enter: walls and failed robots, but not moving obstacles."""
WALLS_ONLY = pymunk.ShapeFilter(mask=WALL_CATEGORY)
"""Filter of queries that find only walls and failed robots."""
MAX_TEAMS_PER_SPACE = 31
"""Number of teams that one space can keep apart: each needs a filter category, and so do the walls."""

_ALL_BUT_WALLS = pymunk.ShapeFilter.ALL_CATEGORIES() & ~WALL_CATEGORY
_FORCE_FIELD = batch.BodyFields.FORCE
_STATE_FIELDS = batch.BodyFields.POSITION | batch.BodyFields.VELOCITY
_CONTACT_FIELDS = batch.ArbiterFields.BODY_A_ID | batch.ArbiterFields.BODY_B_ID


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
    mover_bodies : list of pymunk.Body
        A kinematic body for each moving obstacle, whose position is its displacement since time zero.
    """
    space = pymunk.Space()
    mover_bodies = []
    for polygon in obstacles.walls:
        space.add(pymunk.Poly(space.static_body, polygon.tolist()))
    if obstacles.failed_robots is not None:
        for x, y, radius in obstacles.failed_robots.tolist():
            space.add(pymunk.Circle(space.static_body, radius, (x, y)))
    for mover in obstacles.movers:
        body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        space.add(body)
        for polygon in mover.pieces:
            shape = pymunk.Poly(body, polygon.tolist())
            shape.filter = pymunk.ShapeFilter(categories=_ALL_BUT_WALLS)
            space.add(shape)
        mover_bodies.append(body)
    return space, mover_bodies


def build_robot(mass: float, radius: float, team: int | None = None) -> tuple[pymunk.Body, pymunk.Circle]:
    """Build the body of a robot: a frictionless disc that never rotates.

    The heading of a unicycle is part of `World.steering`; no contact depends on it.

    Parameters
    ----------
    mass : float, kg
    radius : float, m
    team : int or None
        Index of the robot's team, from 0 to ``MAX_TEAMS_PER_SPACE - 1``, if several teams share the space:
        robots of different teams do not collide. By default, the robot collides with all others.

    Returns
    -------
    body : pymunk.Body
    disc : pymunk.Circle
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

    Rows are in the order in which pymunk lists the bodies; `find_rows` returns the rows of given bodies.
    Arrays are changed in place, and take effect when they are written.

    Parameters
    ----------
    space : pymunk.Space
        The space whose bodies are read and written.
    capacity : int
        Largest number of bodies that the space will contain.

    Attributes
    ----------
    forces : (capacity, 2) array, N
        Forces for the next step of the space, which pymunk resets after each step.
    states : (capacity, 4) array, m and m/s
        x, y, vx and vy.
    """

    def __init__(self, space: pymunk.Space, capacity: int) -> None:
        self._space = space
        # One spare row, because pymunk reallocates a buffer as soon as it is full.
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

        Returns
        -------
        slice or int array
            In the order of the list. A slice if they are consecutive, which is the usual case and makes
            indexing faster.
        """
        self._id_buffer.clear()
        batch.get_space_bodies(self._space, batch.BodyFields.BODY_ID, self._id_buffer)
        row_of_body = {identifier: row for row, identifier in enumerate(self._read_ids())}
        rows = [row_of_body[body.id] for body in bodies]
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
            Ids of the bodies; each appears once for every contact that it has.
        """
        self._id_buffer.clear()
        batch.get_space_arbiters(self._space, _CONTACT_FIELDS, self._id_buffer)
        return self._read_ids()

    def _read_ids(self) -> list[int]:
        data = self._id_buffer.int_buf()
        if len(data) == 0:
            return []
        ids: list[int] = np.frombuffer(data, dtype=np.uintp).tolist()
        return ids


def _wrap_array(array: Array) -> batch.Buffer:
    """Return a buffer that reads from and writes to an array."""
    buffer = batch.Buffer()
    buffer.set_float_buf(array)
    return buffer


def compute_mover_states(movers: tuple[Mover, ...], time: float, dt: float) -> Array:
    """Compute the displacements and velocities of moving obstacles.

    Parameters
    ----------
    movers : tuple of Mover
    time : float, s
        Simulation time.
    dt : float, s
        Period over which the velocity is averaged, so that a step of `dt` ends exactly on the path.

    Returns
    -------
    (m, 4) array, m and m/s
        Displacement since time zero and velocity: x, y, vx, vy.
    """
    states = np.empty((len(movers), 4))
    for row, mover in enumerate(movers):
        displacement = mover.path.compute_displacement(time)
        states[row, :2] = displacement
        states[row, 2:] = (mover.path.compute_displacement(time + dt) - displacement) / dt
    return states
