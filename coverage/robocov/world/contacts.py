"""Robots in contact: moved on by fine substeps, in a space that holds them, the obstacles and nobody else.

Obstacles that move go their way whatever is in it. What they meet they push, and what pushes is stronger
than any robot. Walls are stronger still: where a robot has no room left between a moving obstacle and a wall,
it stays in front of the wall, and the obstacle goes over it; it is pushed out again, where that is nearest,
once there is room. No robot gets into a wall or through one that way.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pymunk
from pymunk._chipmunk_cffi import lib

from robocov.world.engine import STATES, Engine, substeps

if TYPE_CHECKING:
    from robocov.arrays import Array, IntArray
    from robocov.robots import Team
    from robocov.world.solid import Mover

MAX_PENETRATION = 1e-3
"""Depth in metres to which robots may sink into walls or each other; in contact no substep is longer."""

_MOST_SUBSTEPS = 64

_SLOP = 1e-4
"""Metres that a robot may lean into a wall."""

_WALLS = pymunk.ShapeFilter(mask=0b1)
"""Of queries for walls alone."""

_NO_WALL = pymunk.ShapeFilter(categories=pymunk.ShapeFilter.ALL_CATEGORIES() & ~0b1)
"""Of robots and of obstacles that move."""


class ContactSolver:
    """Moves those robots on that touch each other, walls, or obstacles that move.

    It keeps nothing from one call to the next: what pymunk remembers of contacts goes with the discs.
    """

    def __init__(
        self, pieces: tuple[Array, ...], team: Team, movers: tuple[Mover, ...], failed_robots: Array | None
    ) -> None:
        self._team, self._movers = team, movers
        self._space = obstacle_space(pieces, movers, failed_robots)
        # sequential impulses: a light robot between a heavy one and a wall needs as many as the ratio
        self._space.iterations = 20 + math.ceil(2.0 * float(team.mass.max() / team.mass.min()))
        self._space.collision_slop = _SLOP
        # the part of an overlap that is left after a second: none after a substep; only what a moving
        # obstacle has run over is deep, and comes out of it gradually
        self._space.collision_bias = 1e-9 if movers else 0.0
        self._engine = Engine([self._space], len(movers), len(team))
        self._travel = min(MAX_PENETRATION, 0.1 * float(team.radius.min()))
        self._fastest_mover = max((mover.path.speed for mover in movers), default=0.0)
        self._robots: dict[int, tuple[pymunk.Body, pymunk.Circle]] = {}

    def moved(self, rows: IntArray, state: Array, forces: Array, motion: Array, dt: float) -> Array:
        """Return the state, (k, 4) m and m/s, of the robots of ascending rows after `dt` seconds.

        `state` is that before, `forces` (k, 2) N are net and constant, `motion` (m, 4) m and m/s is that of
        the obstacles that move.
        """
        reached = state[:, 2:] + forces * (dt / self._team.mass[rows, None])
        square = np.maximum((state[:, 2:] ** 2).sum(axis=1), (reached**2).sum(axis=1)).max()
        fastest = math.sqrt(square) + self._fastest_mover
        parts = min(_MOST_SUBSTEPS, max(1, math.ceil(fastest * dt / self._travel)))

        engine, space = self._engine, self._space._space
        states, net = engine.states[0], engine.forces[0]
        mine = slice(len(motion), len(motion) + len(rows))
        robots = [self._robot(row) for row in rows.tolist()]
        # in C, as Python's `Space.add` and `remove` cost more than all else
        for body, _ in robots:
            lib.cpSpaceAddBody(space, body._body)
        states[: mine.start], states[mine], states[mine.stop] = motion, state, 0.0
        engine.write(STATES)
        for _, disc in robots:
            lib.cpSpaceAddShape(space, disc._shape)
        net[:] = 0.0
        net[mine] = forces
        self._substeps(robots, parts, dt / parts)
        for _, disc in robots:
            lib.cpSpaceRemoveShape(space, disc._shape)
        engine.read()
        velocities = states[mine, 2:].copy()
        # what is left is the push out of an overlap that pymunk has decided but not yet applied
        states[: mine.stop, 2:] = net[:] = 0.0
        engine.write(STATES)
        self._substeps(robots, 1, dt / parts)
        engine.read()
        for body, _ in robots:
            lib.cpSpaceRemoveBody(space, body._body)
        return np.hstack([states[mine, :2], velocities])

    def _robot(self, row: int) -> tuple[pymunk.Body, pymunk.Circle]:
        if row not in self._robots:
            self._robots[row] = robot_body(float(self._team.mass[row]), float(self._team.radius[row]))
        return self._robots[row]

    def _substeps(self, robots: list[tuple[pymunk.Body, pymunk.Circle]], count: int, dt: float) -> None:
        if not self._movers:
            substeps(self._engine.addresses, self._engine.filled, 0, count, dt)
            return
        for _ in range(count):
            before = [body.position for body, _ in robots]
            substeps(self._engine.addresses, self._engine.filled, 0, 1, dt)
            for (body, disc), place in zip(robots, before, strict=True):
                self._keep_before_walls(body, disc.radius, place)

    def _keep_before_walls(self, body: pymunk.Body, radius: float, before: pymunk.Vec2d) -> None:
        """Leave a robot that was pushed into a wall, from some place, in front of the wall."""
        if self._space.segment_query_first(before, body.position, 0.0, _WALLS) is not None:
            body.position = before
        for _ in range(3):  # out of one wall may be into another, in a corner
            wall = self._space.point_query_nearest(body.position, radius, _WALLS)
            if wall is None or wall.distance >= radius - _SLOP or wall.distance <= 0.0:
                return
            away = body.position - wall.point
            body.position = wall.point + away * (radius / math.hypot(*away))


def obstacle_space(
    pieces: tuple[Array, ...], movers: tuple[Mover, ...], failed_robots: Array | None
) -> pymunk.Space:
    """Return a space with all that robots may run into but each other; shapes have no friction by default."""
    space = pymunk.Space()
    walls: list[pymunk.Shape] = [pymunk.Poly(space.static_body, ring.tolist()) for ring in pieces]
    for x, y, radius in [] if failed_robots is None else failed_robots.tolist():
        walls.append(pymunk.Circle(space.static_body, radius, (x, y)))
    space.add(*walls)
    for mover in movers:
        for shape in added_mover(space, mover).shapes:
            shape.filter = _NO_WALL
    return space


def added_mover(space: pymunk.Space, mover: Mover) -> pymunk.Body:
    """Add an obstacle that moves to a space, where it is at time zero; its position is its shift."""
    body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
    space.add(body, *[pymunk.Poly(body, ring.tolist()) for ring in mover.pieces])
    return body


def robot_body(mass: float, radius: float) -> tuple[pymunk.Body, pymunk.Circle]:
    """Return a frictionless disc that does not turn."""
    body = pymunk.Body(mass, math.inf)
    disc = pymunk.Circle(body, radius)
    disc.filter = _NO_WALL
    return body, disc
