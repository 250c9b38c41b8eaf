"""Robots in contact: moved on by fine substeps, in a space that holds them, the obstacles and nobody else."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pymunk
from pymunk import batch

from robocov.sensor import added_mover
from robocov.world.moving_bodies import NO_WALL, keep_before_walls

if TYPE_CHECKING:
    from robocov.arrays import Array, IntArray
    from robocov.robots import Team
    from robocov.world.solid import Mover

MAX_PENETRATION = 1e-3
"""Depth in metres to which robots may sink into walls or each other; in contact no substep is longer."""

_MOST_SUBSTEPS = 64
_STATE = batch.BodyFields.POSITION | batch.BodyFields.VELOCITY


class ContactSolver:
    """Moves those robots on that touch each other, walls, or obstacles that move.

    It keeps nothing from one call to the next: what pymunk remembers of contacts goes with the discs.

    Parameters
    ----------
    pieces, team, movers, failed_robots
        As of `World`.
    """

    def __init__(
        self, pieces: tuple[Array, ...], team: Team, movers: tuple[Mover, ...], failed_robots: Array | None
    ) -> None:
        self._team, self._movers = team, movers
        self._space = obstacle_space(pieces, movers, failed_robots)
        # sequential impulses: a light robot between a heavy one and a wall needs as many as the ratio
        self._space.iterations = 20 + math.ceil(2.0 * float(team.mass.max() / team.mass.min()))
        self._space.collision_slop = 1e-4
        # the part of an overlap that is left after a second: none after a substep; only what a moving
        # obstacle has run over is deep, and comes out of it gradually
        self._space.collision_bias = 1e-9 if movers else 0.0
        self._travel = min(MAX_PENETRATION, 0.1 * float(team.radius.min()))
        self._fastest_mover = max((mover.path.speed for mover in movers), default=0.0)
        self._robots: dict[int, tuple[pymunk.Body, pymunk.Circle]] = {}
        self._sent, self._read = batch.Buffer(), batch.Buffer()

    def moved(self, rows: IntArray, state: Array, forces: Array, motion: Array, dt: float) -> Array:
        """Return the positions and velocities of some robots after `dt` seconds, (k, 4) m and m/s.

        Parameters
        ----------
        rows : (k,)
            The robots, ascending.
        state : (k, 4) m and m/s
            Their positions and velocities.
        forces : (k, 2) N
            Net, and constant.
        motion : (m, 4) m and m/s
            Of the obstacles that move.
        dt : float, s
        """
        reached = state[:, 2:] + forces * (dt / self._team.mass[rows, None])
        square = np.maximum((state[:, 2:] ** 2).sum(axis=1), (reached**2).sum(axis=1)).max()
        fastest = math.sqrt(square) + self._fastest_mover
        parts = min(_MOST_SUBSTEPS, max(1, math.ceil(fastest * dt / self._travel)))

        # pymunk.batch goes through obstacles that move, robots as they were added, and the static body
        mine = slice(len(motion), len(motion) + len(rows))
        values = np.zeros((mine.stop + 1, 4))
        values[: mine.start], values[mine] = motion, state
        bodies, discs = zip(*map(self._robot, rows.tolist()), strict=True)
        self._space.add(*bodies)
        self._sent.set_float_buf(values)
        batch.set_space_bodies(self._space, _STATE, self._sent)
        self._space.add(*discs)
        values = np.zeros((mine.stop + 1, 2))
        values[mine] = forces
        self._sent.set_float_buf(values)
        for _ in range(parts):
            batch.set_space_bodies(self._space, batch.BodyFields.FORCE, self._sent)
            self._step(discs, dt / parts)
        self._space.remove(*discs)
        velocities = self._state()[mine, 2:]
        # what is left is the push out of an overlap that pymunk has decided but not yet applied
        values[mine] = 0.0
        batch.set_space_bodies(self._space, batch.BodyFields.VELOCITY, self._sent)
        self._step(discs, dt / parts)
        settled = self._state()[mine]
        settled[:, 2:] = velocities
        self._space.remove(*bodies)
        return settled

    def _robot(self, row: int) -> tuple[pymunk.Body, pymunk.Circle]:
        if row not in self._robots:
            self._robots[row] = robot_body(float(self._team.mass[row]), float(self._team.radius[row]))
        return self._robots[row]

    def _step(self, discs: tuple[pymunk.Circle, ...], dt: float) -> None:
        if not self._movers:
            self._space.step(dt)
            return
        places = [disc.body.position for disc in discs if disc.body is not None]
        self._space.step(dt)
        for disc, place in zip(discs, places, strict=True):
            keep_before_walls(self._space, disc, place)

    def _state(self) -> Array:
        self._read.clear()
        batch.get_space_bodies(self._space, _STATE, self._read)
        return np.frombuffer(self._read.float_buf(), dtype=np.float64).reshape(-1, 4).copy()


def obstacle_space(
    pieces: tuple[Array, ...], movers: tuple[Mover, ...], failed_robots: Array | None
) -> pymunk.Space:
    """Return a space with all that robots may run into but each other."""
    space = pymunk.Space()
    walls: list[pymunk.Shape] = [pymunk.Poly(space.static_body, ring.tolist()) for ring in pieces]
    for x, y, radius in [] if failed_robots is None else failed_robots.tolist():
        walls.append(pymunk.Circle(space.static_body, radius, (x, y)))
    for wall in walls:
        wall.friction = wall.elasticity = 0.0
    space.add(*walls)
    for mover in movers:
        for shape in added_mover(space, mover).shapes:
            shape.filter = NO_WALL
    return space


def robot_body(mass: float, radius: float) -> tuple[pymunk.Body, pymunk.Circle]:
    """Return a frictionless disc that does not turn."""
    body = pymunk.Body(mass, math.inf)
    disc = pymunk.Circle(body, radius)
    disc.friction = disc.elasticity = 0.0
    disc.filter = NO_WALL
    return body, disc
