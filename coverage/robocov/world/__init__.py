"""The physical world: robots as pymunk bodies among static polygons and obstacles that move.

Each step the controller's forces, the viscous term of (28) and the kinematic limits are combined into the net
force that pymunk integrates; contacts are pymunk's.

A step depends on positions and velocities alone, so that a copy goes on identically, bit for bit. pymunk
keeps more (cached contact impulses, a pending push out of an overlap, the shape of its search tree), which
matters only in contact. So a step is first made as if nothing touched; those whom pymunk reports in contact,
and whoever they are moved against, are moved again from the same state by `ContactSolver`, in substeps fine
enough that no robot sinks into anything by more than `MAX_PENETRATION`.

Obstacles that move go their way whatever is in it, and push what they meet. Walls are stronger still: where a
robot has no room left between a moving obstacle and a wall, it stays in front of the wall, and the obstacle
goes over it; it is pushed out again, where that is nearest, once there is room.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from copy import copy
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
import pymunk

from robocov.arrays import Array, BoolArray, IntArray, frozen
from robocov.conditions import Conditions
from robocov.environment import Environment
from robocov.errors import ParameterError, StartError
from robocov.observation.neighbours import close_pairs
from robocov.robots import Team
from robocov.world.engine import Engine, State, addresses_of, enter, free_substep, leave, response, substeps
from robocov.world.relocation import nearest_free
from robocov.world.solid import Mover, movers, solid_pieces
from robocov.world.steering import gripped, steered

LONGEST_SUBSTEP = 0.02  # s
MAX_MASS_RATIO = 1000.0
"""Heaviest robot by the lightest; beyond it contacts cannot be resolved."""
MAX_PENETRATION = 1e-3
"""Depth in metres to which robots may sink into walls or each other; in contact no substep is longer."""

_MOST_SUBSTEPS = 64
_SLOP = 1e-4  # metres that a robot may lean into a wall
_WALLS = pymunk.ShapeFilter(mask=0b1)
_NO_WALL = pymunk.ShapeFilter(categories=pymunk.ShapeFilter.ALL_CATEGORIES() & ~0b1)
_NONE = np.zeros((0, 2))

Robot: TypeAlias = tuple[pymunk.Body, pymunk.Circle]
Obstacles: TypeAlias = tuple[tuple[Array, ...], tuple[Mover, ...], Array | None]
"""Solid pieces, obstacles that move, robots that have failed: as `World` takes them."""


class World:
    """Bodies of a team, by default at rest, among solid pieces, as of `solid.solid_pieces`.

    Of `failed_robots`, which stand in the way, x, y and radius are given, (w, 3) m. There may be several runs
    at once, each with an equal part of the robots, which never meet those of the others.

    Raises ParameterError when a robot is more than `MAX_MASS_RATIO` times as heavy as another one.
    """

    positions: Array
    """Centres of the robots, (n, 2) m; read-only."""
    velocities: Array
    """(n, 2) m/s; read-only."""
    steering: Array | None
    """Heading and turning rate of unicycles, (n, 2) rad and rad/s; None in a team of points. Read-only."""

    def __init__(
        self,
        pieces: tuple[Array, ...],
        team: Team,
        positions: Array,
        velocities: Array | None = None,
        *,
        steering: Array | None = None,
        movers: tuple[Mover, ...] = (),
        failed_robots: Array | None = None,
        runs: int = 1,
    ) -> None:
        light, heavy = float(team.mass.min()), float(team.mass.max())
        if heavy > MAX_MASS_RATIO * light:
            most = f"robots at most {MAX_MASS_RATIO:g} times as heavy as the lightest"
            raise ParameterError(f"team.mass: {light:g} to {heavy:g} kg, but {most} were wanted")
        self.team, self._runs, self._each = team, runs, len(team) // runs
        self._obstacles, self._movers = (pieces, movers, failed_robots), movers
        self.failed_robots = failed_robots
        self.working: BoolArray = np.ones(len(team), dtype=bool)  # who does not is in no `World`
        state = np.zeros((2, len(team), 2))
        state[0], state[1] = positions, 0.0 if velocities is None else velocities
        self._set_state(state)
        self.steering = initial_steering(team, self.velocities, steering)
        self._rolls, self._body = team.turns, np.column_stack([team.track_width, team.turning_rate])
        self._fast = velocities is not None
        """Whether a robot may be faster than it can be by itself."""
        self._moving = motion(movers, 0.0, 1.0)
        self._contacts: ContactSolver | None = None
        self._fastest, self._thinnest = float(team.max_speed.max()), float(team.radius.min())
        self._mover_speed = max((mover.path.speed for mover in movers), default=0.0)
        self._answered = math.nan

    def place(self, run: int, positions: Array) -> None:
        """Put the robots of a run to other places, (n / runs, 2) m, at rest."""
        rows = self._rows(run)
        state = np.array([self.positions, self.velocities])
        state[0, rows], state[1, rows] = positions, 0.0
        self._set_state(state, [run])
        if self.steering is not None:
            steering = self.steering.copy()
            steering[rows] = 0.0
            self.steering = frozen(steering)

    def copy(self) -> World:
        """Return an independent world in the same state, which goes on identically."""
        return copy(self)

    def __getstate__(self) -> dict[str, Any]:
        # the engine and the solver, rebuilt when they are needed, are all that is changed in place
        state = {**vars(self), "_contacts": None}
        state.pop("_engine", None)
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        for array in (self.positions, self.velocities, self.steering):
            if array is not None:
                array.setflags(write=False)  # pickles do not say so

    def step(
        self, forces: Array, dt: float, external_forces: Array | None = None, *, time: float = 0.0
    ) -> None:
        """Move on by `dt` seconds under the controllers' forces, (n, 2) N, viscosity and limits.

        External forces, (n, 2) N, as by a hand, know no limits; a robot that they have made faster than it
        can be by itself brakes as hard as it can.
        """
        external, push = _NONE, np.zeros(1)
        if external_forces is not None:
            external = np.array(external_forces, dtype=float)
            push = np.hypot(*external.T) / self.team.mass
        speed = self._fastest
        if self._fast or len(external):
            speed = max(speed, float((self._speeds() + push * dt).max()))
        # a robot must not cross a thin wall within a substep
        crossing = (speed + self._mover_speed) * dt / self._thinnest
        parts = max(math.ceil(dt / LONGEST_SUBSTEP - 1e-9), math.ceil(crossing))
        for part in range(parts):
            if self._movers:
                self._moving = motion(self._movers, time + part * (dt / parts), dt / parts)
                self._write_state(self._engine, 0)
            self._substep(forces, dt / parts, external, push)

    def _speeds(self) -> Array:
        return np.asarray(np.hypot(self.velocities[:, 0], self.velocities[:, 1]))

    @cached_property
    def _engine(self) -> Engine:
        """The spaces that tell who touches: nothing is pushed out of an overlap, nothing is remembered."""
        spaces = []
        self._row: dict[int, int] = {}
        columns = self.positions.tolist(), self.team.mass.tolist(), self.team.radius.tolist()
        for row, (place, mass, radius) in enumerate(zip(*columns, strict=True)):
            if row % self._each == 0:
                space = obstacle_space(self._obstacles)
                space.iterations = space.collision_persistence = 1
                space.collision_bias = 1.0
                spaces.append(space)
            body, disc = robot_body(mass, radius)
            # before it enters the space, which keeps a pair for any two discs that enter in one place
            body.position = tuple(place)
            space.add(body, disc)
            self._row[body.id] = row
        engine = Engine(spaces, len(self._movers), self._each)
        for run in range(self._runs):
            self._write_state(engine, run)
        return engine

    def _rows(self, run: int) -> slice:
        return slice(run * self._each, (run + 1) * self._each)

    def _write_state(self, engine: Engine, run: int) -> None:
        begin, state, rows = len(self._movers), engine.states[run], self._rows(run)
        state[:begin] = self._moving
        state[begin:-1, :2], state[begin:-1, 2:] = self.positions[rows], self.velocities[rows]
        engine.write(run)

    def _substep(self, forces: Array, dt: float, external: Array, push: Array) -> None:
        engine, unusual = self._engine, self._fast or len(external) > 0
        if self._answered != dt:
            self._answered, self._response = dt, response(self.team, dt)
        answer, limit = self._response, self.team.max_speed
        if unusual:
            # who is faster than it can be by itself brakes
            limit = np.maximum(limit, self._speeds() - self.team.max_acceleration * dt)
            answer = np.column_stack([answer[:, :4], limit])
        if len(external):
            limit = np.maximum(limit, self._speeds() + push * dt)
        rolls, steering = self._rolls, self.steering
        if steering is not None:
            if len(external):
                rolls = rolls & ~external.any(axis=1)
            # who is carried keeps its heading
            steering = steering * np.column_stack([np.ones(len(rolls)), rolls])
            states = forces, self.velocities, steering, answer, self._body, rolls
            forces, steering, answer = steered(*states, dt)
        engine.robots[:] = forces.reshape(self._runs, -1, 2)
        engine.forget_contacts()
        state = free_substep(engine.buffers, answer, external, dt)
        touching: dict[int, list[int]] = {}
        for row in self._touching():
            touching.setdefault(row // self._each, []).append(row)
        for run, rows in touching.items():
            self._resolve_contacts(run, np.array(rows), state, dt, limit)
        if steering is not None:
            self.steering = frozen(steering)
            if touching:
                room = limit - 0.5 * self.team.track_width * np.abs(steering[:, 1])
                gripped(state[1], steering, room, rolls)
        self._set_state(state, touching)
        if unusual:
            self._fast = bool((self._speeds() > self.team.max_speed).any())

    def _touching(self) -> list[int]:
        """Return the robots that touched something in the last free substep."""
        return sorted({self._row[body] for body in self._engine.touching() if body in self._row})

    def _set_state(self, state: Array, corrected: Iterable[int] = ()) -> None:
        """Turn to a state, (2, n, 2), which is not that of the engine in some runs."""
        state.setflags(write=False)  # whoever gets it, a controller or a record, must not change it
        self.positions, self.velocities = state
        for run in corrected:
            self._write_state(self._engine, run)

    def _resolve_contacts(self, run: int, rows: IntArray, free: Array, dt: float, limit: Array) -> None:
        """Correct the free motion, (2, n, 2), of who touches something, and of whoever is moved by them."""
        solver = self._contacts or ContactSolver(self.team, self._obstacles, self._mover_speed)
        self._contacts = None  # it is of no use once it was interrupted
        all_rows, net = self._rows(run), self._engine.robots[run]
        radius, begin = self.team.radius[all_rows], all_rows.start
        resolved = np.zeros(self._each, dtype=bool)
        while True:
            solver.move(rows, (self.positions, self.velocities, net), self._moving, dt, limit, free)
            resolved[rows - begin] = True
            first, second, distance = close_pairs(free[0, all_rows], 2.0 * float(radius.max()))
            reached = resolved[first] & ~resolved[second] & (distance < radius[first] + radius[second])
            if not reached.any():
                break
            resolved[second[reached]] = True
            rows = begin + np.flatnonzero(resolved)
        self._contacts = solver


class ChangingWorld:
    """A world whose robots fail and join: that of those that are there, made anew whenever that changes.

    It has a row for every robot that ever is. One that failed is an obstacle from then on; one that has not
    joined yet is nowhere, its position where it would start, or is to join. For the others nothing changes.
    """

    def __init__(
        self,
        conditions: Conditions,
        environment: Environment,
        team: Team,
        positions: Array,
        velocities: Array | None = None,
        *,
        steering: Array | None = None,
        time: float = 0.0,
    ) -> None:
        self._conditions, self._environment, self.team = conditions, environment, team
        self._pieces, self._movers = solid_pieces(environment), movers(environment)
        self.positions = np.array(positions, dtype=float)
        self.velocities = np.zeros_like(self.positions) if velocities is None else np.array(velocities)
        self.steering = initial_steering(team, self.velocities, steering)
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
        twin = copy(self)
        twin._world = None if self._world is None else self._world.copy()
        return twin

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self._protect()  # pickles do not say that arrays are read-only

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
            if self.steering is not None and self._world.steering is not None:
                self.steering = self.steering.copy()
                self.steering[rows] = self._world.steering
        working = self._conditions.working(time_after, len(self.team))
        failed = self._conditions.failed(time_after, len(self.team))
        if (working != self.working).any() or (failed != self._failed).any():
            self._failed = failed & there
            for robot in np.flatnonzero(working & ~there).tolist():
                self.positions[robot] = self._place(robot, there, time_after)
                there[robot] = True
            self.working = working
            self.velocities[~working] = 0.0
            if self.steering is not None:
                self.steering = self.steering * np.column_stack([np.ones(len(working)), working])
            self._begin()
        self._protect()

    def _place(self, robot: int, there: BoolArray, time: float) -> tuple[float, float]:
        """Return where a robot joins, as near as it fits beside those that are there."""
        radius, (x, y) = self.team.radius, self.positions[robot].tolist()
        environment, others = self._environment.at(time), self.positions[there]
        try:
            return nearest_free(environment, float(radius[robot]), others, (x, y), radius[there])
        except StartError:
            joins = f"robot {robot + 1} joins at {time:g} s at [{x:g}, {y:g}]"
            where = f"map {self._environment.name!r}"
            raise StartError(f"{joins}, but there is no room for it in {where}") from None

    def _begin(self) -> None:
        """Make the world of the robots that work."""
        self._protect()
        rows = self._rows = np.flatnonzero(self.working)
        # a team of none is no team
        self._world: World | None = None
        if len(rows):
            state = self.team[rows], self.positions[rows], self.velocities[rows]
            steering = None if self.steering is None else self.steering[rows]
            movers, failed = self._movers, self.failed_robots
            self._world = World(self._pieces, *state, steering=steering, movers=movers, failed_robots=failed)

    def _protect(self) -> None:
        for array in (self.positions, self.velocities, self.working, self.steering):
            if array is not None:
                array.setflags(write=False)


class ContactSolver:
    """Moves those robots on that touch something, in a space that holds them, the obstacles and nobody else.

    It keeps nothing from one call to the next: what pymunk remembers of contacts goes with the discs.
    """

    def __init__(self, team: Team, obstacles: Obstacles, mover_speed: float) -> None:
        _, movers, _ = obstacles
        self._team, self._movers, self._mover_speed = team, movers, mover_speed
        self._space = obstacle_space(obstacles)
        # sequential impulses: a light robot between a heavy one and a wall needs as many as the ratio
        self._space.iterations = 20 + math.ceil(2.0 * float(team.mass.max() / team.mass.min()))
        self._space.collision_slop = _SLOP
        # the part of an overlap that is left after a second: none after a substep; only what a moving
        # obstacle has run over is deep, and comes out of it gradually
        self._space.collision_bias = 1e-9 if movers else 0.0
        self._engine = Engine([self._space], len(movers), len(team))
        self._travel = min(MAX_PENETRATION, 0.1 * float(team.radius.min()))
        self._robots = list(map(robot_body, team.mass.tolist(), team.radius.tolist()))
        self._members = np.array([addresses_of(body._body, disc._shape) for body, disc in self._robots])

    def move(self, rows: IntArray, now: State, motion: Array, dt: float, limit: Array, moved: Array) -> None:
        """Move robots of ascending rows on by `dt` seconds, no faster in the end than (n,) m/s.

        The motion of obstacles is (m, 4); into `moved`, (2, n, 2), go positions and velocities.
        """
        buffers, members = self._engine.buffers, self._members
        self._engine.states[0, : len(motion)] = motion
        speed = enter(buffers, members, rows, now, self._team.mass, dt) + self._mover_speed
        parts = min(_MOST_SUBSTEPS, max(1, math.ceil(speed * dt / self._travel)))
        # what moves may push robots into walls
        pushed = [self._robots[row] for row in rows.tolist()] if self._movers else []
        for _ in range(parts if pushed else 1):
            before = [body.position for body, _ in pushed]
            substeps(buffers, 0, 1 if pushed else parts, dt / parts)
            self._keep_before_walls(pushed, before)
        before = [body.position for body, _ in pushed]
        leave(buffers, members, rows, limit, moved, dt / parts)
        if pushed:
            self._keep_before_walls(pushed, before)
            moved[0, rows] = [body.position for body, _ in pushed]

    def _keep_before_walls(self, robots: list[Robot], before: list[pymunk.Vec2d]) -> None:
        """Leave robots that were pushed into a wall, from some places, in front of the wall."""
        for (body, disc), place in zip(robots, before, strict=True):
            if self._space.segment_query_first(place, body.position, 0.0, _WALLS) is not None:
                body.position = place
            for _ in range(3):  # out of one wall may be into another, in a corner
                wall = self._space.point_query_nearest(body.position, disc.radius, _WALLS)
                if wall is None or wall.distance >= disc.radius - _SLOP or wall.distance <= 0.0:
                    break
                away = body.position - wall.point
                body.position = wall.point + away * (disc.radius / math.hypot(*away))


def obstacle_space(obstacles: Obstacles) -> pymunk.Space:
    """Return a space with all that robots may run into but each other; shapes have no friction by default."""
    (pieces, movers, failed_robots), space = obstacles, pymunk.Space()
    walls: list[pymunk.Shape] = [pymunk.Poly(space.static_body, ring.tolist()) for ring in pieces]
    for x, y, radius in [] if failed_robots is None else failed_robots.tolist():
        walls.append(pymunk.Circle(space.static_body, radius, (x, y)))
    space.add(*walls)
    for mover in movers:
        # where it is at time zero: its position is its shift
        body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        space.add(body, *[pymunk.Poly(body, ring.tolist()) for ring in mover.pieces])
        for shape in body.shapes:
            shape.filter = _NO_WALL
    return space


def initial_steering(team: Team, velocities: Array, steering: Array | None) -> Array | None:
    """Return heading and turning rate of a team, by default as it moves; None where nobody turns."""
    if not team.turns.any():
        return None
    if steering is None:
        # math's, which is the same on every processor
        steering = np.array([(math.atan2(y, x), 0.0) for x, y in velocities.tolist()])
    return frozen(steering)


def robot_body(mass: float, radius: float) -> Robot:
    """Return a frictionless disc; that of a unicycle turns in `World.steering`: no contact depends on it."""
    body = pymunk.Body(mass, math.inf)
    disc = pymunk.Circle(body, radius)
    disc.filter = _NO_WALL
    return body, disc


def motion(movers: tuple[Mover, ...], time: float, dt: float) -> Array:
    """Return where moving obstacles are at a time, and how fast for `dt` seconds, (m, 4) m and m/s."""
    state = np.empty((len(movers), 4))
    for row, mover in enumerate(movers):
        here = mover.path.shift(time)
        state[row] = *here, *((mover.path.shift(time + dt) - here) / dt)
    return state
