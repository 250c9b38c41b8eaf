"""The physical world: robots as pymunk bodies among static polygons.

Each step the controller's forces, the viscous term of (28) and the kinematic limits are combined,
for all robots at once, into the net force that pymunk integrates; contacts are pymunk's.

A step depends on positions and velocities alone. pymunk keeps more than that between steps (cached
contact impulses, a pending push out of an overlap, the shape of its search tree), all of which
matters only in contact. So a step is first made as if nothing touched; if pymunk reports a contact
it is made again from the same state with the contact memory emptied, in substeps fine enough that
no robot sinks into anything by more than `MAX_PENETRATION`. That is what makes a copy of a running
world go on identically, bit for bit.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pymunk
from pymunk import batch

from robocov.arrays import Array
from robocov.errors import ParameterError
from robocov.robots import Team
from robocov.world.moving_bodies import MovingBodies

if TYPE_CHECKING:
    from robocov.world.solid import Mover

LONGEST_SUBSTEP = 0.02
"""Longest substep in seconds."""

MAX_PENETRATION = 1e-3
"""Depth in metres to which robots may sink into walls or each other; in contact no substep is longer."""

MAX_MASS_RATIO = 1000.0
"""Heaviest robot by the lightest; beyond it contacts cannot be resolved."""

_MOST_SUBSTEPS = 64
_STATE = batch.BodyFields.POSITION | batch.BodyFields.VELOCITY


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
    wrecks : (w, 3) m or None
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
        wrecks: Array | None = None,
    ) -> None:
        self.team = team
        self._pieces, self._wrecks = pieces, wrecks
        self._space = pymunk.Space()
        light, heavy = float(team.mass.min()), float(team.mass.max())
        if heavy > MAX_MASS_RATIO * light:
            most = f"robots at most {MAX_MASS_RATIO:g} times as heavy as the lightest"
            raise ParameterError(f"team.mass: {light:g} to {heavy:g} kg, but {most} were wanted")
        # sequential impulses: a light robot between a heavy one and a wall needs as many as the ratio
        self._space.iterations = 20 + math.ceil(2.0 * heavy / light)
        self._space.collision_slop = 1e-4
        # the part of an overlap that is left after a second: none after a substep; only what a moving
        # obstacle has run over is deep, and comes out of it gradually
        self._space.collision_bias = 1e-9 if movers else 0.0
        self._touched = False
        for ring in pieces:
            wall = pymunk.Poly(self._space.static_body, ring.tolist())
            wall.friction = wall.elasticity = 0.0
            self._space.add(wall)
        for x, y, radius in [] if wrecks is None else wrecks.tolist():
            wreck = pymunk.Circle(self._space.static_body, radius, (x, y))
            wreck.friction = wreck.elasticity = 0.0
            self._space.add(wreck)
        self._positions = np.array(positions, dtype=float)
        self._bodies: list[pymunk.Body] = []
        self._discs: list[pymunk.Circle] = []
        for (x, y), mass, radius in zip(
            self._positions.tolist(), team.mass.tolist(), team.radius.tolist(), strict=True
        ):
            body = pymunk.Body(mass, math.inf)
            # before it enters the space, which keeps a pair for any two discs that enter in one place
            body.position = x, y
            disc = pymunk.Circle(body, radius)
            disc.friction = disc.elasticity = 0.0
            self._space.add(body, disc)
            self._bodies.append(body)
            self._discs.append(disc)
        self._space.on_collision(pre_solve=self._note_contact)
        self._moving = MovingBodies(self._space, movers, self._discs) if movers else None

        # pymunk.batch goes through the robots in the order in which they were added, then come the
        # obstacles that move and the static body: hence some rows more
        rows = len(team) + len(movers) + 1
        self._force = np.zeros((rows, 2))
        self._force_buffer = batch.Buffer()
        self._force_buffer.set_float_buf(self._force)
        self._state = np.zeros((rows, 4))
        self._state_buffer = batch.Buffer()
        self._state_buffer.set_float_buf(self._state)
        self._read_buffer = batch.Buffer()
        self._velocities = np.zeros_like(self._positions)
        if velocities is not None:
            self._velocities[:] = velocities
        self._protect()
        self._write_state()

        self._thrown = bool((np.hypot(*self._velocities.T) > team.max_speed).any())
        self._mass = team.mass[:, None]
        self._response: dict[float, tuple[Array, Array]] = {}
        self._fastest = float(team.max_speed.max())
        self._smallest = float(team.radius.min())

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
            movers=() if self._moving is None else self._moving.movers,
            wrecks=self._wrecks,
        )

    def step(self, forces: Array, dt: float, pushes: Array | None = None, *, time: float = 0.0) -> None:
        """Move on by `dt` seconds under `forces`, (n, 2) N.

        The forces are the controllers'; viscosity and limits are added here, the same for all.

        Parameters
        ----------
        forces : (n, 2) N
        dt : float, s
        pushes : (n, 2) N or None
            From outside, as by a hand. They know no limits; a robot that they have made faster than it
            can be brakes as hard as it can.
        """
        fastest = self._fastest
        if pushes is not None or self._thrown:
            speed = np.hypot(*self._velocities.T)
            gain = 0.0 if pushes is None else np.hypot(*pushes.T) / self.team.mass * dt
            fastest = max(fastest, float((speed + gain).max()))
        if self._moving is not None:
            fastest += self._moving.fastest
        # a robot must not cross a thin wall within one substep
        parts = max(math.ceil(dt / LONGEST_SUBSTEP - 1e-9), math.ceil(fastest * dt / self._smallest))
        for part in range(parts):
            if self._moving is not None:
                self._moving.place(time + part * (dt / parts), dt / parts)
            self._substep(forces, dt / parts, pushes)

    def _substep(self, forces: Array, dt: float, pushes: Array | None) -> None:
        limit = self._speed_limit(dt)
        robots = self._force[: len(self.team)]
        robots[:] = self._net_force(forces, dt, limit)
        if pushes is not None:
            robots += pushes
            limit = np.maximum(
                limit, np.hypot(*self._velocities.T) + np.hypot(*pushes.T) / self.team.mass * dt
            )
        self._touched = False
        batch.set_space_bodies(self._space, batch.BodyFields.FORCE, self._force_buffer)
        self._space.step(dt)
        if self._touched:
            self._substep_in_contact(dt, limit)
        else:
            self._read_state()
        if pushes is not None or self._thrown:
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
            self._response = {dt: (decay[:, None], drive[:, None])}
        decay, drive = self._response[dt]
        velocities = self._velocities
        change = _limited(drive * forces - decay * velocities, self.team.max_acceleration * dt)
        reached = _limited(velocities + change, limit)
        return np.asarray((reached - velocities) * (self._mass / dt))

    def _substep_in_contact(self, dt: float, limit: Array) -> None:
        self._write_state()
        self._forget_contacts()
        travel = min(MAX_PENETRATION, 0.1 * self._smallest)
        fastest = max(self._fastest, float(limit.max()))
        if self._moving is not None:
            self._moving.back()
            fastest += self._moving.fastest
        parts = min(_MOST_SUBSTEPS, max(2, math.ceil(fastest * dt / travel)))
        for _ in range(parts):
            batch.set_space_bodies(self._space, batch.BodyFields.FORCE, self._force_buffer)
            if self._moving is None:
                self._space.step(dt / parts)
            else:
                self._moving.before_walls(lambda: self._space.step(dt / parts))
        if self._moving is None:
            self._settle_overlap(dt / parts)
        else:
            self._moving.before_walls(lambda: self._settle_overlap(dt / parts))
        self._read_state()
        # impulses of a contact may exceed what a robot can do by itself
        speed_limited = _limited(self._velocities, limit)
        if speed_limited is not self._velocities:
            self._velocities = speed_limited
            self._protect()
        self._write_state()

    def _forget_contacts(self) -> None:
        """Empty what pymunk remembers of contacts, and lay the robots' search tree anew."""
        self._space.remove(*self._discs)
        self._space.add(*self._discs)

    def _settle_overlap(self, dt: float) -> None:
        """Carry out the push out of an overlap that pymunk has decided but not yet applied."""
        for body in self._bodies:
            velocity = body.velocity
            body.velocity = (0.0, 0.0)
            pymunk.Body.update_position(body, dt)
            body.velocity = velocity

    def _note_contact(self, arbiter: pymunk.Arbiter, space: pymunk.Space, data: object) -> None:
        self._touched = True
        if self._moving is not None:
            self._moving.touched(arbiter)

    def _write_state(self) -> None:
        count = len(self.team)
        self._state[:count, :2] = self._positions
        self._state[:count, 2:] = self._velocities
        if self._moving is not None:
            self._state[count:-1] = self._moving.state
        batch.set_space_bodies(self._space, _STATE, self._state_buffer)

    def _protect(self) -> None:
        """Keep whoever gets the state (a controller, a record) from changing it."""
        self._positions.setflags(write=False)
        self._velocities.setflags(write=False)

    def _read_state(self) -> None:
        self._read_buffer.clear()
        batch.get_space_bodies(self._space, _STATE, self._read_buffer)
        state = np.frombuffer(self._read_buffer.float_buf(), dtype=np.float64).reshape(-1, 4)
        count = len(self.team)
        self._positions = state[:count, :2].copy()
        self._velocities = state[:count, 2:].copy()
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
