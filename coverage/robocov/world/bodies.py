"""The physical world: robots as pymunk bodies among static polygons.

Each step the controller's forces, the viscous term of (28) and the kinematic limits are combined into the net
force that pymunk integrates; contacts are pymunk's.

A step depends on positions and velocities alone. pymunk keeps more than that between steps (cached
contact impulses, a pending push out of an overlap, the shape of its search tree), all of which
matters only in contact. So a step is first made as if nothing touched; those whom pymunk reports in
contact, and whoever they are moved against, are moved again from the same state by `ContactSolver`, in
substeps fine enough that no robot sinks into anything by more than `MAX_PENETRATION`. That is what makes
a copy of a running world go on identically, bit for bit, and what keeps a contact a matter of those in it.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray
from robocov.compiled import inner_kernel, kernel
from robocov.errors import ParameterError
from robocov.observation.neighbours import close_pairs
from robocov.robots import Team
from robocov.world.contacts import ContactSolver, obstacle_space, robot_body
from robocov.world.engine import STATES, Engine, observed_step

if TYPE_CHECKING:
    from robocov.world.solid import Mover

LONGEST_SUBSTEP = 0.02
"""Longest substep in seconds."""

MAX_MASS_RATIO = 1000.0
"""Heaviest robot by the lightest; beyond it contacts cannot be resolved."""

_NONE = np.zeros((0, 2))


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
        Obstacles that move, as kinematic bodies; see `robocov.world.contacts`.
    failed_robots : (w, 3) m or None
        x, y and radius of robots that have failed, and stand in the way.
    runs : int
        In so many worlds at once, each with its part of the robots, which never meet those of the others.

    Raises ParameterError when a robot is more than `MAX_MASS_RATIO` times as heavy as another one.
    """

    _positions: Array
    _velocities: Array

    def __init__(
        self,
        pieces: tuple[Array, ...],
        team: Team,
        positions: Array,
        velocities: Array | None = None,
        *,
        movers: tuple[Mover, ...] = (),
        failed_robots: Array | None = None,
        runs: int = 1,
    ) -> None:
        self.team, self._runs = team, runs
        self._pieces, self._movers, self.failed_robots = pieces, movers, failed_robots
        light, heavy = float(team.mass.min()), float(team.mass.max())
        if heavy > MAX_MASS_RATIO * light:
            most = f"robots at most {MAX_MASS_RATIO:g} times as heavy as the lightest"
            raise ParameterError(f"team.mass: {light:g} to {heavy:g} kg, but {most} were wanted")
        state = np.zeros((2, len(team), 2))
        state[0] = positions
        if velocities is not None:
            state[1] = velocities
        self._set_state(state)
        self._fast = self._anybody_fast()
        self._moving = motion(movers, 0.0, 1.0)
        self._row: dict[int, int] = {}
        self._contacts: ContactSolver | None = None
        self._fastest_mover = max((mover.path.speed for mover in movers), default=0.0)
        self._planned = self._answered = math.nan

    @property
    def positions(self) -> Array:
        """Centres of the robots, (n, 2) m; read-only."""
        return self._positions

    @property
    def velocities(self) -> Array:
        """Velocities, (n, 2) m/s; read-only."""
        return self._velocities

    def place(self, run: int, positions: Array) -> None:
        """Put the robots of a run to other places, (n / runs, 2) m, at rest."""
        rows = self._rows(run)
        state = np.array([self._positions, self._velocities])
        state[0, rows], state[1, rows] = positions, 0.0
        self._set_state(state)
        self._write_state(self._engine, run)

    @property
    def working(self) -> BoolArray:
        """All robots, (n,) bool: those that do not work are in no `World`."""
        return np.ones(len(self.team), dtype=bool)

    def copy(self) -> World:
        """Return an independent world in the same state, which goes on identically."""
        twin = object.__new__(World)
        # the engine, made anew when it is needed, is all that is changed in place
        twin.__dict__.update({name: value for name, value in vars(self).items() if name != "_engine"})
        twin._contacts = None
        return twin

    def step(
        self, forces: Array, dt: float, external_forces: Array | None = None, *, time: float = 0.0
    ) -> None:
        """Move on by `dt` seconds under the controllers' forces, (n, 2) N, viscosity and limits.

        External forces, (n, 2) N, as by a hand, know no limits; a robot that they have made faster than it
        can be by itself brakes as hard as it can.
        """
        if external_forces is not None:
            external_forces = np.array(external_forces, dtype=float)
        if external_forces is not None or self._fast:
            parts = self._substeps(dt, float((self._speeds() + self._gain(external_forces, dt)).max()))
        else:
            if self._planned != dt:
                self._planned, self._usual_substeps = dt, self._substeps(dt)
            parts = self._usual_substeps
        for part in range(parts):
            if self._movers:
                self._moving = motion(self._movers, time + part * (dt / parts), dt / parts)
                for run in range(self._runs):
                    self._write_state(self._engine, run)
            self._substep(forces, dt / parts, external_forces)

    def _substeps(self, dt: float, speed: float = 0.0) -> int:
        """Return of how many substeps a step consists: a robot must not cross a thin wall within one."""
        fastest = max(float(self.team.max_speed.max()), speed) + self._fastest_mover
        crossing = fastest * dt / float(self.team.radius.min())
        return max(math.ceil(dt / LONGEST_SUBSTEP - 1e-9), math.ceil(crossing))

    def _speeds(self) -> Array:
        return np.asarray(np.hypot(self._velocities[:, 0], self._velocities[:, 1]))

    def _gain(self, external_forces: Array | None, dt: float) -> Array | float:
        """Return how much faster external forces may make each robot, m/s."""
        return 0.0 if external_forces is None else np.hypot(*external_forces.T) / self.team.mass * dt

    def _anybody_fast(self) -> bool:
        """Whether a robot is faster than it can be by itself."""
        return bool((self._speeds() > self.team.max_speed).any())

    @cached_property
    def _engine(self) -> Engine:
        """The space that tells who touches: nothing is pushed out of an overlap, nothing is remembered."""
        spaces = []
        self._row = {}
        columns = self._positions.tolist(), self.team.mass.tolist(), self.team.radius.tolist()
        each = len(self.team) // self._runs
        for row, (place, mass, radius) in enumerate(zip(*columns, strict=True)):
            if row % each == 0:
                space = obstacle_space(self._pieces, self._movers, self.failed_robots)
                space.iterations = space.collision_persistence = 1
                space.collision_bias = 1.0
                spaces.append(space)
            body, disc = robot_body(mass, radius)
            # before it enters the space, which keeps a pair for any two discs that enter in one place
            body.position = tuple(place)
            space.add(body, disc)
            self._row[body.id] = row
        engine = Engine(spaces, len(self._movers), each)
        for run in range(self._runs):
            self._write_state(engine, run)
        return engine

    def _rows(self, run: int) -> slice:
        each = len(self.team) // self._runs
        return slice(run * each, (run + 1) * each)

    def _write_state(self, engine: Engine, run: int) -> None:
        begin, state = len(self._movers), engine.states[run]
        rows = self._rows(run)
        state[:begin] = self._moving
        state[begin:-1, :2], state[begin:-1, 2:] = self._positions[rows], self._velocities[rows]
        engine.write(STATES, run)

    def _substep(self, forces: Array, dt: float, external_forces: Array | None) -> None:
        engine = self._engine
        if self._answered != dt:
            self._answered, self._response = dt, response(self.team, dt)
        answer, limit = self._response, self.team.max_speed
        if self._fast:
            # who is faster than it can be by itself brakes
            limit = np.maximum(limit, self._speeds() - self.team.max_acceleration * dt)
            answer = answer.copy()
            answer[:, 4] = limit
        if external_forces is not None:
            limit = np.maximum(limit, self._speeds() + self._gain(external_forces, dt))
        state = np.empty((2, len(forces), 2))
        engine.robots[:] = forces.reshape(self._runs, -1, 2)
        external = _NONE if external_forces is None else external_forces
        engine.forget_contacts()
        _free_substep(
            engine.addresses, engine.filled, engine.forces, engine.states, answer, external, state, dt
        )
        by_run: dict[int, list[int]] = {}
        for row in self._touching():
            by_run.setdefault(row * self._runs // len(forces), []).append(row)
        for run, rows in by_run.items():
            self._resolve_contacts(np.array(rows), self._rows(run), state, dt, limit)
        self._set_state(state)
        for run in by_run:
            self._write_state(engine, run)
        if external_forces is not None or self._fast:
            self._fast = self._anybody_fast()

    def _touching(self) -> list[int]:
        """Return the robots that touched something in the last free substep."""
        touching = self._engine.touching()
        return sorted({self._row[body] for body in touching if body in self._row}) if touching else []

    def _set_state(self, state: Array) -> None:
        # whoever gets it, a controller or a record, must not change it
        state.setflags(write=False)
        self._positions, self._velocities = state[0], state[1]

    def _resolve_contacts(self, rows: IntArray, run: slice, free: Array, dt: float, limit: Array) -> None:
        """Move robots of a run again that touch something, and with them whoever they are moved against.

        `free`, (2, n, 2) m and m/s, is how all moved as if nobody touched anything, and is corrected.
        """
        solver = self._contacts
        self._contacts = None  # it is of no use once it was interrupted
        if solver is None:
            solver = ContactSolver(self._pieces, self.team, self._movers, self.failed_robots)
        each, radius, positions = run.stop - run.start, self.team.radius[run], free[0, run].copy()
        net = self._engine.robots[run.start // each]
        resolved = np.zeros(each, dtype=bool)
        while True:
            before = np.hstack([self._positions[rows], self._velocities[rows]])
            moved = solver.moved(rows, before, net[rows - run.start], self._moving, dt)
            positions[rows - run.start] = moved[:, :2]
            resolved[rows - run.start] = True
            first, second, distance = close_pairs(positions, 2.0 * float(radius.max()))
            reached = resolved[first] & ~resolved[second] & (distance < radius[first] + radius[second])
            if not reached.any():
                break
            resolved[second[reached]] = True
            rows = run.start + np.flatnonzero(resolved)
        # impulses of a contact may exceed what a robot can do by itself
        free[0, rows], free[1, rows] = moved[:, :2], scale_to_limits(moved[:, 2:], limit[rows])
        self._contacts = solver


def response(team: Team, dt: float) -> Array:
    """Return how robots answer to forces for `dt` seconds, (n, 5): see `_free_substep`.

    The columns: part of the velocity that viscosity takes (28), velocity by force in m/s/N, force by change
    of velocity in N/(m/s), most change of velocity and most speed in m/s.
    """
    rate = team.viscosity / team.mass
    decay = -np.expm1(-rate * dt)
    drive = np.where(rate > 0, decay / np.where(rate > 0, rate, 1.0), dt) / team.mass
    return np.column_stack([decay, drive, team.mass / dt, team.max_acceleration * dt, team.max_speed])


@inner_kernel
def _scale(x: float, y: float, limit: float) -> float:
    """Return by what to multiply a vector so that it is no longer than `limit`."""
    square = x * x + y * y
    return limit / math.sqrt(square) if square > limit * limit else 1.0


@kernel
def _free_substep(
    addresses: IntArray,
    filled: IntArray,
    forces: Array,
    states: Array,
    answer: Array,
    external: Array,
    moved: Array,
    dt: float,
) -> None:
    """Move all bodies by one substep as if nothing touched; make net forces of the controllers'.

    The linear equation m q'' = F - nu q' is solved exactly over the substep, so viscosity is stable at any
    dt; then acceleration and speed are limited, in this order. Limiting the speed cannot break the limit of
    the acceleration: the old velocity lies within the limit, and projecting onto a disc does not move a point
    away from a point of the disc.
    """
    each = len(answer) // len(addresses)
    begin = states.shape[1] - 1 - each
    for i in range(len(answer)):
        run, row = i // each, begin + i % each
        vx, vy = states[run, row, 2], states[run, row, 3]
        decay, drive = answer[i, 0], answer[i, 1]
        dx, dy = drive * forces[run, row, 0] - decay * vx, drive * forces[run, row, 1] - decay * vy
        scale = _scale(dx, dy, answer[i, 3])
        ux, uy = vx + dx * scale, vy + dy * scale
        scale = _scale(ux, uy, answer[i, 4])
        forces[run, row, 0] = (ux * scale - vx) * answer[i, 2]
        forces[run, row, 1] = (uy * scale - vy) * answer[i, 2]
        if len(external):
            forces[run, row, 0] += external[i, 0]
            forces[run, row, 1] += external[i, 1]
    for run in range(len(addresses)):
        observed_step(addresses, filled, run, dt)
    for i in range(len(answer)):
        for k in range(2):
            moved[0, i, k] = states[i // each, begin + i % each, k]
            moved[1, i, k] = states[i // each, begin + i % each, 2 + k]


def scale_to_limits(vectors: Array, limit: Array) -> Array:
    """Return (n, 2) vectors shortened to at most `limit` (n,)."""
    square = vectors[:, 0] ** 2 + vectors[:, 1] ** 2
    excess = square > limit * limit
    scale = np.ones(len(vectors))
    scale[excess] = limit[excess] / np.sqrt(square[excess])
    return vectors * scale[:, None]


def motion(movers: tuple[Mover, ...], time: float, dt: float) -> Array:
    """Return where moving obstacles are at a time, and how fast for `dt` seconds, (m, 4) m and m/s."""
    state = np.empty((len(movers), 4))
    for row, mover in enumerate(movers):
        here = mover.path.shift(time)
        state[row] = *here, *((mover.path.shift(time + dt) - here) / dt)
    return state
