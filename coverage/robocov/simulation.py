"""The simulation: observe all, decide all, then move."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterator
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from robocov.arrays import Array
from robocov.controllers import CONTROLLERS
from robocov.controllers.base import Controller
from robocov.environment import Environment
from robocov.errors import ParameterError, RobocovError, StartError, counted, shown
from robocov.neighbours import Neighbours
from robocov.observation import Decision, Observations, Snapshot
from robocov.record import Record, Recorder
from robocov.robots import Team
from robocov.sensor import RangeSensor
from robocov.solid import solid_pieces
from robocov.world import SINK, World

DEFAULT_DT = 1 / 60
"""Control period in seconds where nothing else is said."""


class Simulation:
    """A team under one controller in one environment.

    Parameters
    ----------
    environment : Environment
    controller : Controller
    starts : (n, 2) m
        Centres of the robots at the beginning.
    team : Team
        By default `Team.homogeneous(n)`.
    dt : float, s
        Control period. The physics takes substeps where it needs them.
    velocities : (n, 2) m/s
        At the beginning; by default the robots are at rest.
    time : float, s
        At the beginning.

    Raises
    ------
    StartError
        When a robot would start in a wall or in another robot.
    ParameterError
        When dt is out of range, or team and starts differ in size.

    Examples
    --------
    >>> from robocov.controllers import Rapf
    >>> from robocov.environment import Environment
    >>> room = Environment("room", ((0, 0), (10, 0), (10, 10), (0, 10)))
    >>> simulation = Simulation(room, Rapf(), starts=[[1.0, 1.0], [2.0, 1.0]])
    >>> simulation.step()
    >>> simulation.positions.shape
    (2, 2)
    """

    def __init__(
        self,
        environment: Environment,
        controller: Controller,
        starts: Array | list[list[float]],
        team: Team | None = None,
        dt: float = DEFAULT_DT,
        *,
        velocities: Array | None = None,
        time: float = 0.0,
    ) -> None:
        positions = np.array(starts, dtype=float)
        if positions.ndim != 2 or positions.shape[1] != 2 or len(positions) < 1:
            raise StartError(
                f"starts: an array of shape {positions.shape}, but (n, 2) with n of at least 1 was wanted"
            )
        self.team = Team.homogeneous(len(positions)) if team is None else team
        if len(self.team) != len(positions):
            raise ParameterError(f"team: {len(self.team)} robots, but {len(positions)} starts")
        check_dt(dt)
        if isinstance(controller, type) or not isinstance(controller, Controller):
            raise ParameterError(
                f"controller: {shown(controller)}, but a controller, as in Rapf(), was wanted"
            )
        if velocities is not None:
            velocities = np.array(velocities, dtype=float)
            if velocities.shape != positions.shape or not np.isfinite(velocities).all():
                raise StartError(
                    f"velocities: {shown(velocities.tolist())}, but finite [x, y] for each robot were wanted"
                )
        # who moves may lean on something, and sink in a little
        _check_starts(environment, positions, self.team, 1e-6 if velocities is None else 2.0 * SINK)
        self.environment = environment
        self.controller = controller
        self.dt = dt
        pieces = solid_pieces(environment)
        self._sensor = RangeSensor(pieces)
        self._world = World(pieces, self.team, positions, velocities)
        self._began = time
        self._steps = 0
        self._memory = self._asked(lambda: controller.begin(environment.region, self.team))
        self._snapshot: Snapshot | None = None

    def __repr__(self) -> str:
        where = f"{self.controller.name} on {self.environment.name}"
        return f"<Simulation {where}, {counted(len(self.team), 'robot')}, at {self.time:.2f} s>"

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
    def sensor(self) -> RangeSensor:
        """The range sensor of the robots, for ray scans."""
        return self._sensor

    @property
    def memory(self) -> Any:
        """What the controller remembers; not to be changed."""
        return self._memory

    @property
    def snapshot(self) -> Snapshot:
        """The present state, what is seen in it, and what is decided on it."""
        if self._snapshot is None:
            seen = self.observe()
            self._snapshot = Snapshot(seen, self._decide(seen))
        return self._snapshot

    def _decide(self, seen: Observations) -> Decision:
        decision = self._asked(lambda: self.controller.decide(seen, self._memory))
        return self._checked(decision, seen.time)

    def _asked(self, question: Callable[[], Any]) -> Any:
        """Ask the controller; a fault of a controller that is not ours becomes one clear line."""
        try:
            return question()
        except RobocovError:
            raise
        except (Exception, SystemExit) as error:
            if type(self.controller) in CONTROLLERS.values():
                raise
            frames = traceback.extract_tb(error.__traceback__)
            home = str(Path(__file__).parent)
            theirs = [frame for frame in frames if not frame.filename.startswith(home)] or frames
            raise ParameterError(
                f"controller {self.controller.name!r}: {type(error).__name__}: {error} "
                f"({Path(theirs[-1].filename).name}, line {theirs[-1].lineno}) at {self.time:.3f} s"
            ) from error

    def observe(self) -> Observations:
        """Return what each robot knows now."""
        positions = self._world.positions
        points = self._sensor.nearest(positions, self.team.sensing_range)
        points.setflags(write=False)
        return Observations(
            positions=positions,
            velocities=self._world.velocities,
            neighbours=Neighbours.within(positions, self.team.communication_range),
            obstacle_points=points,
            region=self.environment.region,
            time=self.time,
        )

    def step(self, pushes: Array | None = None) -> None:
        """Make one control step.

        Parameters
        ----------
        pushes : (n, 2) N or None
            Forces from outside, as by a hand, beside the controller's; see `World.step`. A record does
            not know of them.

        Raises
        ------
        ParameterError
            When the controller returns anything but finite forces of shape (n, 2), or the pushes are not.
        """
        if pushes is not None:
            pushes = self._rows(pushes, "pushes")
            if not np.isfinite(pushes).all():
                raise ParameterError(f"pushes: {shown(pushes.tolist())}, but finite newtons were wanted")
        decision = self.snapshot.decision
        self._world.step(decision.forces, self.dt, pushes)
        self._memory = decision.memory
        self._steps += 1
        self._snapshot = None

    def snapshots(self, duration: float) -> Iterator[Snapshot]:
        """Yield the present snapshot and one after every step, until `duration` seconds have passed."""
        if not 0.0 <= duration < np.inf:
            raise ParameterError(f"duration: {shown(duration)} s, but a finite number from 0 was wanted")
        yield self.snapshot
        for _ in range(round(duration / self.dt)):
            self.step()
            yield self.snapshot

    def run(
        self,
        duration: float,
        *,
        start: str | None = None,
        seed: int | None = None,
        on_snapshot: Callable[[Snapshot], None] | None = None,
    ) -> Record:
        """Run for `duration` seconds and return the whole of it.

        Parameters
        ----------
        duration : float, s
        start : str, seed : int
            Where the starts came from, kept in the record.
        on_snapshot : callable
            Called with every snapshot, for progress.
        """
        recorder = Recorder(self.environment, self.team, self.controller, self.dt, start=start, seed=seed)
        for snapshot in self.snapshots(duration):
            recorder.add(snapshot)
            if on_snapshot is not None:
                on_snapshot(snapshot)
        return recorder.record()

    def copy(self) -> Simulation:
        """Return an independent simulation in the same state; it goes on identically, bit for bit."""
        twin = object.__new__(Simulation)
        twin.__dict__.update(self.__dict__)
        twin._world = self._world.copy()
        twin._memory = deepcopy(self._memory)
        twin._snapshot = None  # it holds the memory that the step after it will hand on
        return twin

    def remembering(self, memory: Any) -> Simulation:
        """Return a simulation in the same state whose controller remembers something else.

        Parameters
        ----------
        memory : object
            What the `memory` of a simulation was, of the same controller and number of robots.
        """
        twin = self.copy()
        twin._memory = deepcopy(memory)
        return twin

    def changed(
        self,
        *,
        environment: Environment | None = None,
        controller: Controller | None = None,
        team: Team | None = None,
        positions: Array | None = None,
        velocities: Array | None = None,
    ) -> Simulation:
        """Return a simulation that goes on from here with something else; this one stays as it is.

        What the controller remembers is kept as long as neither it nor the number of robots changes.

        Parameters
        ----------
        environment, controller, team
            By default the same.
        positions, velocities : (n, 2) m and m/s
            By default the present ones.

        Raises
        ------
        StartError
            When a robot is in a wall or in another robot by more than what touching robots sink in.
        ParameterError
            When sizes differ.
        """
        twin = Simulation(
            self.environment if environment is None else environment,
            self.controller if controller is None else controller,
            self.positions if positions is None else positions,
            self.team if team is None else team,
            self.dt,
            velocities=self.velocities if velocities is None else velocities,
            time=self.time,
        )
        if controller is None and len(twin.team) == len(self.team):
            twin._memory = deepcopy(self._memory)
        return twin

    def _checked(self, made: Any, time: float) -> Decision:
        """Return the decision when it is one that can be carried out and recorded."""
        where = f"controller {self.controller.name!r}"
        if not isinstance(made, Decision):
            raise ParameterError(f"{where}: decide gave {shown(made)}, but a Decision was wanted")
        decision: Decision = made
        forces = self._rows(decision.forces, f"{where}: forces")
        goals = None if decision.goals is None else self._rows(decision.goals, f"{where}: goals")
        if forces is not decision.forces or goals is not decision.goals:
            decision = replace(decision, forces=forces, goals=goals)
        if not np.isfinite(forces).all():
            robot = int(np.flatnonzero(~np.isfinite(forces).all(axis=1))[0])
            raise ParameterError(
                f"{where}: force {forces[robot].tolist()} on robot {robot + 1} "
                f"at {time:.3f} s, but finite newtons were wanted"
            )
        return decision

    def _rows(self, values: Any, what: str) -> Array:
        """Return two numbers for each robot as an array, the same one where it is one already."""
        try:
            array = np.asarray(values, dtype=np.float64)
        except (TypeError, ValueError):
            raise ParameterError(f"{what}: {shown(values)}, but numbers were wanted") from None
        if array.shape != (len(self.team), 2):
            raise ParameterError(f"{what} of shape {array.shape}, but {(len(self.team), 2)} was wanted")
        return array


def check_dt(dt: float) -> None:
    """Check a control period.

    Raises
    ------
    ParameterError
        When it is out of range.
    """
    if not 1e-4 <= dt <= 1.0:
        raise ParameterError(f"dt: {shown(dt)} s, but a number from 0.0001 to 1 s was wanted")


def _check_starts(environment: Environment, positions: Array, team: Team, slack: float) -> None:
    """Check that robots are free, but for so many metres."""
    for i in np.flatnonzero(~np.isfinite(positions).all(axis=1)).tolist():
        raise StartError(f"starts[{i}] = {positions[i].tolist()}: finite numbers were wanted")
    points = shapely.points(positions)
    inside = shapely.contains_properly(environment.free, points)
    wall = shapely.distance(environment.free.boundary, points)
    for i in range(len(positions)):
        place = f"starts[{i}] = [{positions[i, 0]:g}, {positions[i, 1]:g}]"
        if not inside[i]:
            raise StartError(
                f"{place} is inside an obstacle or outside the boundary of map {environment.name!r}"
            )
        if wall[i] < team.radius[i] - slack:
            raise StartError(
                f"{place} is {wall[i]:.3g} m from a wall, but a robot of radius {team.radius[i]:g} m must fit"
            )
    first, second, distance = Neighbours(len(positions)).closer_than(
        positions, 2.0 * float(team.radius.max())
    )
    clash = distance < team.radius[first] + team.radius[second] - slack
    if clash.any():
        k = int(np.flatnonzero(clash)[0])
        raise StartError(
            f"starts[{first[k]}] and starts[{second[k]}] are {distance[k]:.3g} m apart: the robots overlap"
        )
