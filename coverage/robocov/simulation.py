"""The simulation: observe all, decide all, then move. Many runs of small teams are moved on together."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from copy import copy, deepcopy
from dataclasses import replace
from time import process_time
from typing import Any

import numpy as np
import shapely

from robocov.arrays import Array, BoolArray
from robocov.conditions import TIME_TOLERANCE_S, Conditions, JoinedRobot
from robocov.conditions.perception import Inbox, Perception, ignore_idle_robots
from robocov.controllers import CONTROLLERS, informed, remembers
from robocov.controllers.base import Controller, IndividualController, Individually, for_team
from robocov.controllers.user_modules import fault_of, location_of
from robocov.drawing import show
from robocov.environment import Environment, require_environment
from robocov.errors import (
    ParameterError,
    RobocovError,
    StartError,
    format_count,
    is_number,
    quote,
    require_type,
    to_floats,
)
from robocov.observation import (
    Decision,
    Observations,
    Scanning,
    Scans,
    Snapshot,
    check_decision,
    check_forces,
    copy_decision,
)
from robocov.observation.neighbours import Neighbours
from robocov.record import ARRAYS, Record, Recorder
from robocov.sensor import RangeSensor
from robocov.team import Team
from robocov.world import MAX_PENETRATION, ChangingWorld, World
from robocov.world.free_positions import require_free_starts
from robocov.world.obstacle_pieces import build_movers, build_solid_pieces

DEFAULT_DT = 1 / 60
"""Control period in seconds where nothing else is said."""
_LARGEST_TEAM = 15  # from 16 robots on cells come off a triangulation, and a step of one team is as quick
_AT_ONCE = 64  # runs that are moved on together


class Simulation:
    """A team under one controller in one environment.

    Parameters
    ----------
    controller : Controller or IndividualController
        A law for one robot is asked for every robot in turn.
    starts, velocities, time : (n, 2) m, (n, 2) m/s, s
        At the beginning; by default robots are at rest.
    steering : (n, 2) rad, rad/s
        Heading, from +x, and turning rate of unicycles at the beginning; by default as they move.
    steps : int
        Made before, since `time`.
    resumed : bool
        Go on from positions and velocities that a simulation had, bit for bit as it did: who leaned on
        something may stand deeper in it than who starts.
    team : Team
        By default `Team.homogeneous(n)`.
    dt : float, s
        Control period. The physics takes substeps where it needs them.
    conditions : Conditions or None
        What goes wrong, or changes, during the run; None: nothing does.
    runs : int
        So many runs at once, of equal teams, with one row for each robot of the first, of the second, and so
        on. Robots of different runs know nothing of each other. See `simulate_many`.

    `memory` is what the controller remembers, `inbox` the messages that the robots have, None where they know
    the others as they are. `joined` lists the robots that have joined since the simulation was made.

    Raises StartError when a robot would start in a wall or in another robot, ParameterError when dt is out of
    range, or team and starts differ in size.

    Examples
    --------
    >>> import robocov as rc
    >>> rooms = rc.load_map("rooms")
    >>> simulation = rc.Simulation(rooms, rc.Rapf(), rooms.start().sample(6, seed=0))
    >>> simulation.step()
    >>> simulation.positions.shape
    (6, 2)
    """

    def __init__(
        self,
        environment: Environment,
        controller: Controller | IndividualController,
        starts: Array | list[list[float]],
        team: Team | None = None,
        dt: float = DEFAULT_DT,
        *,
        velocities: Array | None = None,
        steering: Array | None = None,
        time: float = 0.0,
        steps: int = 0,
        resumed: bool = False,
        conditions: Conditions | None = None,
        runs: int = 1,
    ) -> None:
        require_environment(environment)
        positions = to_floats("starts", starts, "[x, y] of each robot in metres", StartError)
        if positions.ndim != 2 or positions.shape[1] != 2 or len(positions) < 1:
            wanted = "(n, 2) with n of at least 1 was wanted"
            raise StartError(f"starts: an array of shape {positions.shape}, but {wanted}")
        self.team = Team.homogeneous(len(positions)) if team is None else team
        require_type("team", self.team, Team, "a Team")
        if len(self.team) != len(positions):
            raise ParameterError(f"team: {len(self.team)} robots, but {len(positions)} starts")
        each, rest = divmod(len(positions), runs)
        if runs > 1 and (rest or environment.has_moving_obstacles or conditions is not None):
            wanted = "equal teams, no conditions and obstacles that stand still were wanted"
            raise ParameterError(f"runs: {runs} of {len(positions)} robots, but {wanted}")
        self._each_run = [slice(k * each, (k + 1) * each) for k in range(runs)]
        check_dt(dt)
        controller = for_team(controller)
        if isinstance(controller, type) or not isinstance(controller, Controller):
            wanted = "a controller, as in Rapf(), with a method decide or force, was wanted"
            raise ParameterError(f"controller: {quote(controller)}, but {wanted}")
        if velocities is not None:
            velocities = to_floats("velocities", velocities, "[x, y] of each robot in m/s", StartError)
            if velocities.shape != positions.shape or not np.isfinite(velocities).all():
                wanted = "finite [x, y] for each robot were wanted"
                raise StartError(f"velocities: {quote(velocities.tolist())}, but {wanted}")
        if steering is not None:
            steering = to_floats("steering", steering, "[heading, turning rate] of each robot", StartError)
            if steering.shape != positions.shape or not np.isfinite(steering).all():
                wanted = "finite [heading, turning rate] for each robot were wanted"
                raise StartError(f"steering: {quote(steering.tolist())}, but {wanted}")
        if conditions is not None:
            require_type("conditions", conditions, Conditions, "Conditions")
            conditions.check_team(len(positions))
            conditions = None if conditions.is_ideal else conditions
            if not resumed:
                check_joins(environment, conditions)
        self.joined: tuple[JoinedRobot, ...] = ()
        self.environment, self.controller, self.dt = environment, controller, dt
        self.deciding = 0.0  # seconds of processor time that the controller has taken to decide so far
        self._began, self._steps = time, steps
        # who moves may lean on something, and sink in a little
        slack = 1e-6 if velocities is None else 2.0 * MAX_PENETRATION
        there = None if conditions is None else conditions.find_working(self.time, len(positions))
        for run in self._each_run if not resumed else ():
            require_free_starts(environment.at(self.time), positions[run], self.team[run], slack, there)
        self._built_in = type(controller) in CONTROLLERS.values()
        self.conditions = conditions
        walls, moving = build_solid_pieces(environment), build_movers(environment)
        changes = conditions is not None and conditions.has_team_changes
        self._obstacles_change = bool(moving) or changes
        self.sensor = RangeSensor(walls, moving)
        self._world: World | ChangingWorld
        if conditions is not None and changes:
            given = conditions, environment, self.team, positions, velocities
            self._world = ChangingWorld(*given, steering=steering, time=self.time)
        else:
            given_state = walls, self.team, positions, velocities
            self._world = World(*given_state, steering=steering, movers=moving, runs=runs)
        self._perception = None if conditions is None else Perception(conditions, self.team, dt)
        self.inbox = None if self._perception is None else self._perception.create_inbox()
        self._everybody = None
        if np.isinf(self.team.communication_range).all():
            self._everybody = Neighbours.combine([Neighbours(each)] * runs)
        self._law = self._asked(informed, controller, environment.static)
        self.memory = self._asked(self._law.begin, environment.region, self.team)
        self._scanning: Scanning | None = self._asked(getattr, controller, "scanning", None)
        if not isinstance(self._scanning, Scanning | None):
            found = f"controller {controller.name!r}: scanning: expected a Scanning"
            raise ParameterError(f"{found}, got {quote(self._scanning)}")
        self._begin_step()

    def _begin_step(self) -> None:
        """Turn to the present: nothing is observed or decided yet, and the sensor's obstacles move on."""
        self._observation: tuple[Observations, Inbox | None] | None = None
        self._snapshot: Snapshot | None = None
        if self._obstacles_change:
            self.sensor.set_time(self.time, self._world.failed_robots)

    def __repr__(self) -> str:
        where = f"{self.controller.name} on {self.environment.name}"
        return f"<Simulation {where}, {format_count(len(self.team), 'robot')}, at {self.time:.2f} s>"

    @property
    def time(self) -> float:
        """Simulated time in seconds."""
        return self._began + self._steps * self.dt

    @property
    def positions(self) -> Array:
        """Centres of the robots, (n, 2) m."""
        return self._world.positions

    @property
    def velocities(self) -> Array:
        """Velocities, (n, 2) m/s."""
        return self._world.velocities

    @property
    def steering(self) -> Array | None:
        """Heading and turning rate of unicycles, (n, 2) rad and rad/s; None in a team of points."""
        return self._world.steering

    @property
    def working(self) -> BoolArray:
        """Mask of robots present and not failed, (n,) bool."""
        return self._world.working

    def observe(self) -> Observations:
        """Return what each robot knows now."""
        return self._observed()[0]

    @property
    def snapshot(self) -> Snapshot:
        """The present state, what is seen in it, and what is decided on it."""
        if self._snapshot is None:
            seen, inbox = self._observed()
            began = process_time()
            self._snapshot = Snapshot(seen, self._decided(seen))
            self.deciding += process_time() - began
            if self._perception is not None:
                decision = ignore_idle_robots(self._snapshot.decision, self.working)
                self._snapshot = Snapshot(seen, decision, self.positions, self.working, inbox)
        return self._snapshot

    def _observed(self) -> tuple[Observations, Inbox | None]:
        """Return what each robot knows now, and the messages that it then has."""
        if self._observation is None:
            team, scanning, neighbours, scans = self.team, self._scanning, self._everybody, None
            if neighbours is None:
                ranges, runs = team.communication_range, self._each_run
                parts = [Neighbours.from_ranges(self.positions[run], ranges[run]) for run in runs]
                neighbours = Neighbours.combine(parts)
            if scanning is not None and self._steps % scanning.count_steps(self.dt) == 0:
                scans = Scans(*self.sensor.scan(self.positions, scanning.rays, team.sensing_range))
            seen = Observations(
                positions=self.positions,
                velocities=self.velocities,
                neighbours=neighbours,
                obstacle_points=self.sensor.find_nearest_points(self.positions, team.sensing_range),
                region=self.environment.region,
                time=self.time,
                max_speeds=team.max_speed,
                density=self.environment.density,
                scans=scans,
                steering=self.steering,
            )
            if self._perception is None:
                self._observation = seen, None
            else:
                self._observation = self._perception.perceive(seen, self.inbox, self.working)
        return self._observation

    def _decided(self, seen: Observations) -> Decision:
        count, name = len(seen.positions), self.controller.name
        if self._built_in:
            return check_decision(self._law.decide(seen, self.memory), count, name, seen.time)
        # a user's controller may change what it is given, and use again what it gave
        memory = self.memory
        if remembers(self.controller):
            with suppress(Exception):  # there may be no way to copy it
                memory = deepcopy(memory)
        made = self._asked(self._law.decide, replace(seen), memory)
        source = "" if isinstance(self._law, Individually) else location_of(self._law.decide)
        return copy_decision(check_decision(made, count, name, seen.time, source), name, source)

    def _asked(self, question: Callable[..., Any], *args: Any) -> Any:
        """Ask the controller; a fault of a controller that is not ours becomes one clear line."""
        try:
            return question(*args)
        except (RobocovError, KeyboardInterrupt):
            raise
        except BaseException as error:
            if self._built_in:
                raise
            where = f"controller {self.controller.name!r}"
            raise fault_of(where, error, f" at {self.time:.3f} s") from error

    def step(self, external_forces: Array | None = None, *, forces: Array | None = None) -> None:
        """Make one control step.

        External forces, (n, 2) N, act as by a hand, beside the controller's; see `World.step`. A record does
        not know of them. `forces`, (n, 2) N, are in place of the controller's, as by one who learns; it is
        not asked then.

        Raises ParameterError when one of them, or what the controller returns, is not finite and (n, 2).
        """
        count, memory = len(self.team), self.memory
        if external_forces is not None:
            external_forces = check_forces(external_forces, count, "external_forces")
        if forces is None:
            decision = self.snapshot.decision
            forces, memory = decision.forces, decision.memory
        else:
            forces = check_forces(forces, count, "forces")
        inbox = None if self._perception is None else self._observed()[1]
        before = self.positions
        self._world.step(forces, self.dt, external_forces, time=self.time)
        self.memory, self.inbox = memory, inbox
        self._steps += 1
        if self.conditions is not None and self.conditions.joins:
            self.joined += self._find_joined(before)
        self._begin_step()

    def _find_joined(self, before: Array) -> tuple[JoinedRobot, ...]:
        """Return the robots that joined in the last step; positions `before` it are where they were to."""
        assert self.conditions is not None
        earlier, now = self.conditions.find_present(
            np.array([self.time - self.dt, self.time]), len(self.team)
        )
        return tuple(
            JoinedRobot(
                robot=robot + 1,
                time=self.time,
                place=(float(self.positions[robot, 0]), float(self.positions[robot, 1])),
                requested=(float(before[robot, 0]), float(before[robot, 1])),
            )
            for robot in np.flatnonzero(now & ~earlier & self.working).tolist()
        )

    def restart(self, run: int, positions: Array) -> None:
        """Put the robots of a run to other places, at rest; raises StartError where they do not fit."""
        require_free_starts(self.environment.at(self.time), positions, self.team[self._each_run[run]], 1e-6)
        assert isinstance(self._world, World)
        self._world.place(run, positions)
        self._begin_step()

    def snapshots(self, duration: float) -> Iterator[Snapshot]:
        """Yield the present snapshot and one after every step, until `duration` seconds have passed."""
        if not is_number(duration) or not 0.0 <= duration < np.inf:
            raise ParameterError(f"duration: {quote(duration)} s, but a finite number from 0 was wanted")
        yield self.snapshot
        for _ in range(round(duration / self.dt)):
            self.step()
            yield self.snapshot

    def run(self, duration: float, *, start: str | None = None, seed: int | None = None) -> Record:
        """Run for `duration` seconds and return the whole of it.

        `start` and `seed` say where the starts came from, for the record.
        """
        given = self.environment, self.team, self.controller, self.dt
        recorder = Recorder(*given, start=start, seed=seed, conditions=self.conditions)
        for snapshot in self.snapshots(duration):
            recorder.add(snapshot)
        return recorder.record(self.joined)

    def show(self, *, height: int = 620) -> Any:
        """Show it as the interactive window, live in a notebook's cell of `height` px: see `robocov.show`.

        The window begins with the team as it is now, at 0 s; what happens there does not change this one.
        """
        return show(self, height=height)

    def copy(self) -> Simulation:
        """Return an independent simulation in the same state; it goes on identically, bit for bit."""
        twin = copy(self)
        twin._world = self._world.copy()
        twin.memory = deepcopy(self.memory)
        if self._obstacles_change:
            twin.sensor = self.sensor.copy()
        twin._begin_step()  # a snapshot holds the memory that the step after it will hand on
        return twin

    def __getstate__(self) -> dict[str, Any]:
        """Return the state to pickle: all but what is recomputed from it, as in `copy`."""
        return {**vars(self), "_observation": None, "_snapshot": None}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Resume a pickled or deep-copied simulation; it goes on identically, bit for bit."""
        vars(self).update(state)
        self._begin_step()

    def with_density(self, environment: Environment) -> Simulation:
        """Return a simulation that goes on from here in the same place by another density."""
        twin = self.copy()
        twin.environment = environment
        twin._law = twin._asked(informed, twin.controller, environment.static)
        twin._begin_step()
        return twin

    def remembering(self, memory: Any, inbox: Inbox | None = None) -> Simulation:
        """Return a simulation in the same state with another `memory`, and `inbox` unless that is None."""
        twin = self.copy()
        twin.inbox = self.inbox if inbox is None else inbox
        twin.memory = deepcopy(memory)
        return twin

    def changed(
        self,
        *,
        environment: Environment | None = None,
        controller: Controller | IndividualController | None = None,
        team: Team | None = None,
        positions: Array | None = None,
        velocities: Array | None = None,
        steering: Array | None = None,
        conditions: Conditions | None = None,
    ) -> Simulation:
        """Return a simulation that goes on from here with something else; this one stays as it is.

        What the controller remembers is kept as long as neither it nor the number of robots changes, messages
        as long as neither that nor the conditions do. Raises as `Simulation` does; robots may touch.
        """
        if steering is None and (team is None or len(team) == len(self.team)):
            steering = self.steering
        twin = Simulation(
            self.environment if environment is None else environment,
            self.controller if controller is None else controller,
            self.positions if positions is None else positions,
            self.team if team is None else team,
            self.dt,
            velocities=self.velocities if velocities is None else velocities,
            steering=steering,
            time=self._began,
            steps=self._steps,
            conditions=self.conditions if conditions is None else conditions,
        )
        twin.joined = self.joined
        if len(twin.team) == len(self.team):
            twin.inbox = self.inbox if conditions is None else twin.inbox
            twin.memory = deepcopy(self.memory) if controller is None else twin.memory
        return twin


def simulate_many(
    environment: Environment,
    controller: Controller | IndividualController,
    starts: Sequence[Array],
    duration: float,
    team: Team | None = None,
    dt: float = DEFAULT_DT,
    *,
    conditions: Sequence[Conditions | None] | None = None,
    start: str | None = None,
    seeds: Sequence[int] | None = None,
) -> list[Record]:
    """Simulate runs of one controller in one environment, and return their records.

    Each is the same, bit for bit, as ``Simulation(environment, controller, starts[k], ...).run(duration)``.
    Teams of up to 15 points under a law that remembers nothing (RAPF, RPF, Lloyd, range-limited), without
    conditions and moving obstacles, are moved on together, several times as quickly; others one by one.

    `starts`, (n, 2) m each, may differ in size without `team`; they, `conditions` and `seeds` are of each
    run, all else is the same for all. `start` and `seeds` say where the starts came from, for the records.
    """
    each = [None] * len(starts) if conditions is None else conditions
    own_seeds = [None] * len(starts) if seeds is None else seeds
    together: dict[int, list[int]] = {}
    records: dict[int, Record] = {}
    by_itself = (
        environment.has_moving_obstacles
        or remembers(controller)
        or type(controller) not in CONTROLLERS.values()
    )
    by_itself = by_itself or (team is not None and bool(team.is_unicycle.any()))
    for run, (positions, under) in enumerate(zip(starts, each, strict=True)):
        if by_itself or len(positions) > _LARGEST_TEAM or not (under is None or under.is_ideal):
            simulation = Simulation(environment, controller, positions, team, dt, conditions=under)
            records[run] = simulation.run(duration, start=start, seed=own_seeds[run])
        else:
            together.setdefault(len(positions), []).append(run)
    for size, group in together.items():
        one = Team.homogeneous(size) if team is None else team
        for first in range(0, len(group), _AT_ONCE):
            runs = group[first : first + _AT_ONCE]
            places = np.concatenate([starts[run] for run in runs])
            robots = Team.concatenate([one] * len(runs))
            simulation = Simulation(environment, controller, places, robots, dt, runs=len(runs))
            record = simulation.run(duration, start=start)
            for k, run in enumerate(runs):
                rows = slice(k * size, (k + 1) * size)
                own = {name: getattr(record, name)[:, rows].copy() for name in ARRAYS[1:]}
                records[run] = replace(record, team=one, seed=own_seeds[run], **own)
    return [records[run] for run in range(len(starts))]


def check_joins(environment: Environment, conditions: Conditions | None) -> None:
    """Check where robots are to join.

    Parameters
    ----------
    environment : Environment
        Its boundary has to enclose the places.
    conditions : Conditions or None
        None: no robot joins.

    Raises
    ------
    ParameterError
        If a robot is to join outside of the boundary, or at a place of its own but from the beginning.
    """
    for k, join in enumerate(() if conditions is None else conditions.joins):
        if join.place is None:
            continue
        x, y = join.place
        where = f"conditions.joins[{k}]"
        if join.time <= TIME_TOLERANCE_S:
            expected = "expected a time above 0 s for a robot that joins at a place of its own"
            raise ParameterError(f"{where}: {expected}, got robot {join.robot} at {join.time:g} s")
        if not environment.boundary_polygon.covers(shapely.Point(x, y)):
            left, bottom, right, top = environment.boundary_polygon.bounds
            inside = f"inside the boundary of map {environment.name!r}"
            extent = f"x from {left:g} to {right:g} m, y from {bottom:g} to {top:g} m"
            got = f"got [{x:g}, {y:g}] for robot {join.robot}"
            raise ParameterError(f"{where}: expected a place {inside} ({extent}), {got}")


def check_dt(dt: float) -> None:
    """Check a control period; raises ParameterError when it is out of range."""
    if not is_number(dt) or not 1e-4 <= dt <= 1.0:
        raise ParameterError(f"dt: {quote(dt)} s, but a number from 0.0001 to 1 s was wanted")
