"""The physical world: robots as pymunk bodies among static polygons.

Each step the controller's forces, the viscous term of (28) and the kinematic limits are combined,
for all robots at once, into the net force that pymunk integrates; contacts are pymunk's.

A step depends on positions and velocities alone. pymunk keeps more than that between steps (cached
contact impulses, a pending push out of an overlap, the shape of its search tree), all of which
matters only in contact. So a step is first made as if nothing touched; those whom pymunk reports in
contact, and whoever they are moved against, are moved again from the same state by `ContactSolver`, in
substeps fine enough that no robot sinks into anything by more than `MAX_PENETRATION`. That is what makes
a copy of a running world go on identically, bit for bit, and what keeps a contact a matter of those in it.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from pymunk import batch

from robocov.arrays import Array, IntArray
from robocov.errors import ParameterError
from robocov.observation.neighbours import close_pairs
from robocov.robots import Team
from robocov.world.contacts import ContactSolver, obstacle_space, robot_body
from robocov.world.moving_bodies import motion

if TYPE_CHECKING:
    from robocov.world.solid import Mover

LONGEST_SUBSTEP = 0.02
"""Longest substep in seconds."""

MAX_MASS_RATIO = 1000.0
"""Heaviest robot by the lightest; beyond it contacts cannot be resolved."""

_STATE = batch.BodyFields.POSITION | batch.BodyFields.VELOCITY
_BODIES = batch.ArbiterFields.BODY_A_ID | batch.ArbiterFields.BODY_B_ID


class World:
    """Bodies of a team among solid pieces.

    Parameters
    ----------
    pieces : convex polygons, (k, 2) m each
        What `solid.solid_pieces` returns.
    team : Team
    positions : (n, 2) m
    velocities : (n, 2) m/s, at rest by default
    movers : tuple of Mover
        Obstacles that move, as kinematic bodies; see `robocov.world.moving_bodies`.
    failed_robots : (w, 3) m or None
        x, y and radius of robots that have failed, and stand in the way.

    Raises
    ------
    ParameterError
        When a robot is more than `MAX_MASS_RATIO` times as heavy as another one.
    """

    def __init__(
        self,
        pieces: tuple[Array, ...],
        team: Team,
        positions: Array,
        velocities: Array | None = None,
        *,
        movers: tuple[Mover, ...] = (),
        failed_robots: Array | None = None,
    ) -> None:
        self.team = team
        self._pieces, self._movers, self._failed_robots = pieces, movers, failed_robots
        light, heavy = float(team.mass.min()), float(team.mass.max())
        if heavy > MAX_MASS_RATIO * light:
            most = f"robots at most {MAX_MASS_RATIO:g} times as heavy as the lightest"
            raise ParameterError(f"team.mass: {light:g} to {heavy:g} kg, but {most} were wanted")
        # this space only tells who touches: nothing is pushed out of an overlap, nothing is remembered
        self._space = obstacle_space(pieces, movers, failed_robots)
        self._space.iterations = self._space.collision_persistence = 1
        self._space.collision_bias = 1.0
        self._contacts: ContactSolver | None = None
        self._positions = np.array(positions, dtype=float)
        self._row: dict[int, int] = {}
        for (x, y), mass, radius in zip(
            self._positions.tolist(), team.mass.tolist(), team.radius.tolist(), strict=True
        ):
            body, disc = robot_body(mass, radius)
            # before it enters the space, which keeps a pair for any two discs that enter in one place
            body.position = x, y
            self._space.add(body, disc)
            self._row[body.id] = len(self._row)
        self._moving = motion(movers, 0.0, 1.0)
        self._fastest_mover = max((mover.path.speed for mover in movers), default=0.0)

        # pymunk.batch goes through the obstacles that move, the robots, both in the order in which they
        # were added, and the static body: hence some rows more
        self._rows = slice(len(movers), len(movers) + len(team))
        rows = len(team) + len(movers) + 1
        self._force = np.zeros((rows, 2))
        self._force_buffer = batch.Buffer()
        self._force_buffer.set_float_buf(self._force)
        self._state = np.zeros((rows, 4))
        self._state_buffer = batch.Buffer()
        self._state_buffer.set_float_buf(self._state)
        self._read_buffer, self._arbiters = batch.Buffer(), batch.Buffer()
        self._velocities = np.zeros_like(self._positions)
        if velocities is not None:
            self._velocities[:] = velocities
        self._protect()
        self._write_state()

        self._thrown = bool((np.hypot(*self._velocities.T) > team.max_speed).any())
        self._response: dict[float, tuple[Array, Array, Array, Array]] = {}
        self._fastest = float(team.max_speed.max())
        self._smallest, self._largest = float(team.radius.min()), float(team.radius.max())

    @property
    def positions(self) -> Array:
        """Centres of the robots, (n, 2) m; read-only."""
        return self._positions

    @property
    def velocities(self) -> Array:
        """Velocities, (n, 2) m/s; read-only."""
        return self._velocities

    def copy(self) -> World:
        """Return an independent world in the same state, which goes on identically."""
        return World(
            self._pieces,
            self.team,
            self._positions,
            self._velocities,
            movers=self._movers,
            failed_robots=self._failed_robots,
        )

    def step(
        self, forces: Array, dt: float, external_forces: Array | None = None, *, time: float = 0.0
    ) -> None:
        """Move on by `dt` seconds under `forces`, (n, 2) N.

        The forces are the controllers'; viscosity and limits are added here, the same for all.

        Parameters
        ----------
        forces : (n, 2) N
        dt : float, s
        external_forces : (n, 2) N or None
            From outside, as by a hand. They know no limits; a robot that they have made faster than it
            can be brakes as hard as it can.
        """
        fastest = self._fastest
        if external_forces is not None or self._thrown:
            speed = np.hypot(*self._velocities.T)
            gain = 0.0 if external_forces is None else np.hypot(*external_forces.T) / self.team.mass * dt
            fastest = max(fastest, float((speed + gain).max()))
        fastest += self._fastest_mover
        # a robot must not cross a thin wall within one substep
        parts = max(math.ceil(dt / LONGEST_SUBSTEP - 1e-9), math.ceil(fastest * dt / self._smallest))
        for part in range(parts):
            if self._movers:
                self._moving = motion(self._movers, time + part * (dt / parts), dt / parts)
                self._write_state()
            self._substep(forces, dt / parts, external_forces)

    def _substep(self, forces: Array, dt: float, external_forces: Array | None) -> None:
        limit = self._speed_limit(dt)
        net = self._net_force(forces, dt, limit)
        if external_forces is not None:
            net = net + external_forces
            limit = np.maximum(
                limit, np.hypot(*self._velocities.T) + np.hypot(*external_forces.T) / self.team.mass * dt
            )
        before = self._positions, self._velocities
        self._force[self._rows] = net
        batch.set_space_bodies(self._space, batch.BodyFields.FORCE, self._force_buffer)
        self._space.step(dt)
        self._read_state()
        touching = self._touching()
        if touching:
            self._resolve_contacts(np.array(touching), np.hstack(before), net, dt, limit)
        if external_forces is not None or self._thrown:
            self._thrown = bool((np.hypot(*self._velocities.T) > self.team.max_speed).any())

    def _speed_limit(self, dt: float) -> Array:
        """Return how fast each robot may be after one substep, (n,) m/s: what was thrown brakes."""
        if not self._thrown:
            return self.team.max_speed
        braked = np.hypot(*self._velocities.T) - self.team.max_acceleration * dt
        return np.asarray(np.maximum(self.team.max_speed, braked))

    def _net_force(self, forces: Array, dt: float, limit: Array) -> Array:
        """Return the constant net force, (n, 2) N, that makes one substep obey (28) and the limits.

        The linear equation m q'' = F - nu q' is solved exactly over the substep, so viscosity is
        stable at any dt; then acceleration and speed are limited, in this order. Limiting the
        speed cannot break the limit of the acceleration: the old velocity lies within the limit,
        and projecting onto a disc does not move a point away from a point of the disc.
        """
        if dt not in self._response:
            rate = self.team.viscosity / self.team.mass
            decay = -np.expm1(-rate * dt)
            drive = np.where(rate > 0, decay / np.where(rate > 0, rate, 1.0), dt) / self.team.mass
            inertia, most = self.team.mass / dt, self.team.max_acceleration * dt
            self._response = {dt: (decay[:, None], drive[:, None], inertia[:, None], most)}
        decay, drive, inertia, most = self._response[dt]
        velocities = self._velocities
        change = _limited(drive * forces - decay * velocities, most)
        reached = _limited(velocities + change, limit)
        return np.asarray((reached - velocities) * inertia)

    def _touching(self) -> list[int]:
        """Return the robots that touched something after the last free substep."""
        self._arbiters.clear()
        batch.get_space_arbiters(self._space, _BODIES, self._arbiters)
        found = np.frombuffer(self._arbiters.int_buf(), dtype=np.uintp).tolist()
        return sorted({self._row[body] for body in found if body in self._row})

    def _resolve_contacts(self, rows: IntArray, before: Array, net: Array, dt: float, limit: Array) -> None:
        """Move robots again that touch something, and with them whoever they are moved against."""
        if self._contacts is None:
            self._contacts = ContactSolver(self._pieces, self.team, self._movers, self._failed_robots)
        radius, free = self.team.radius, np.hstack([self._positions, self._velocities])
        while True:
            state = free.copy()
            state[rows] = self._contacts.moved(rows, before[rows], net[rows], self._moving, dt)
            resolved = np.zeros(len(state), dtype=bool)
            resolved[rows] = True
            first, second, distance = close_pairs(state[:, :2], 2.0 * self._largest)
            reached = resolved[first] & ~resolved[second] & (distance < radius[first] + radius[second])
            if not reached.any():
                break
            resolved[second[reached]] = True
            rows = np.flatnonzero(resolved)
        # impulses of a contact may exceed what a robot can do by itself
        state[rows, 2:] = _limited(state[rows, 2:], limit[rows])
        self._positions, self._velocities = state[:, :2].copy(), state[:, 2:].copy()
        self._protect()
        self._write_state()

    def _write_state(self) -> None:
        self._state[: len(self._moving)] = self._moving
        self._state[self._rows, :2] = self._positions
        self._state[self._rows, 2:] = self._velocities
        batch.set_space_bodies(self._space, _STATE, self._state_buffer)

    def _protect(self) -> None:
        """Keep whoever gets the state (a controller, a record) from changing it."""
        self._positions.setflags(write=False)
        self._velocities.setflags(write=False)

    def _read_state(self) -> None:
        self._read_buffer.clear()
        batch.get_space_bodies(self._space, _STATE, self._read_buffer)
        state = np.frombuffer(self._read_buffer.float_buf(), dtype=np.float64).reshape(-1, 4)
        self._positions = state[self._rows, :2].copy()
        self._velocities = state[self._rows, 2:].copy()
        self._protect()


def _limited(vectors: Array, limit: Array) -> Array:
    """Return (n, 2) vectors shortened to at most `limit` (n,); the same array when none is longer."""
    square = vectors[:, 0] ** 2 + vectors[:, 1] ** 2
    excess = square > limit * limit
    if not excess.any():
        return vectors
    scale = np.ones(len(vectors))
    scale[excess] = limit[excess] / np.sqrt(square[excess])
    return vectors * scale[:, None]
