"""One controller at work on the team: a pane of the window."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from robocov.controllers import CONTROLLERS
from robocov.errors import StartError
from robocov.relocation import relocated
from robocov.simulation import Simulation
from robocov_app.demo.curves import Curve
from robocov_app.demo.history import Circumstances, State
from robocov_app.demo.trail import Trail
from robocov_app.view.sensed import Sensed

if TYPE_CHECKING:
    from collections.abc import Sequence

    from robocov.arrays import Array
    from robocov.environment import Environment
    from robocov_app.demo.scenario import Law


SENSED_EVERY = 3
"""What is sensed is noted at every so many steps."""


class Lane:
    """A team under one controller, which can be touched.

    A robot that failed stands where it is and says nothing: the others do not hear it any more, but their
    range sensors see it, as they see any obstacle.

    Parameters
    ----------
    number : int
        Of the pane, for good.
    circumstances : Circumstances
    positions : (n, 2) m
    dt : float, s
    velocities : (n, 2) m/s or None
        At rest by default.
    time : float, s

    Raises
    ------
    StartError
        When a robot is in a wall or in another one.
    """

    def __init__(
        self,
        number: int,
        circumstances: Circumstances,
        positions: Array,
        dt: float,
        velocities: Array | None = None,
        time: float = 0.0,
    ) -> None:
        self.number = number
        self.circumstances = circumstances
        self.simulation = simulation_of(circumstances, positions, dt, velocities, time)
        self.starts = np.array(positions, dtype=float)
        self.trail = Trail(len(positions))
        self.trail.add(time, self.simulation.positions)
        self.curve = Curve()
        self.sensed = Sensed()
        self._steps = 0

    @property
    def law(self) -> Law:
        """The controller as it was chosen."""
        return self.circumstances.law

    @property
    def numbers(self) -> tuple[int, ...]:
        """What people call the robots that work, row by row."""
        return self.circumstances.numbers

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self.simulation.time

    def row(self, number: int) -> int | None:
        """Return the row of a robot by its number; None where it does not work."""
        return self.numbers.index(number) if number in self.numbers else None

    def step(self, pushes: Array | None = None) -> None:
        """Make one control step."""
        if self._steps % SENSED_EVERY == 0:
            seen = self.simulation.snapshot.seen
            self.sensed.add(seen.time, self.numbers, seen.obstacle_points)
        self._steps += 1
        self.simulation.step(pushes)
        self.trail.add(self.time, self.simulation.positions)

    def state(self) -> State:
        """Return what is needed to go on from here."""
        simulation = self.simulation
        return State(
            self.circumstances,
            simulation.positions,
            simulation.velocities,
            None if type(simulation.controller) in CONTROLLERS.values() else simulation.memory,
        )

    def resume(self, state: State, time: float, starts: Array) -> None:
        """Go on from an earlier state."""
        self.circumstances = state.circumstances
        self.simulation = resumed(state, self.simulation.dt, time)
        self.starts = starts
        self.sensed.cut(time)

    def change(
        self,
        circumstances: Circumstances,
        positions: Array | None = None,
        velocities: Array | None = None,
    ) -> None:
        """Go on from here in other circumstances; what cannot be leaves everything as it was.

        Robots that do not fit any more are pushed out of what is in the way.

        Parameters
        ----------
        circumstances : Circumstances
        positions, velocities : (n, 2)
            By default the present ones.

        Raises
        ------
        StartError
            When there is no room for a robot.
        ParameterError
            When the controller or the team does not take a value.
        """
        old = self.simulation
        positions = old.positions if positions is None else positions
        velocities = old.velocities if velocities is None else velocities
        same_law = circumstances.law == self.circumstances.law
        team = circumstances.limits.team(len(circumstances.numbers))
        environment = with_failed(circumstances)
        controller = old.controller if same_law else circumstances.law.made()
        try:
            new = old.changed(
                environment=environment,
                controller=None if same_law else controller,
                team=team,
                positions=positions,
                velocities=velocities,
            )
        except StartError:
            placed = relocated(environment, positions, team)
            moved = np.hypot(*(placed - positions).T) > 1e-3
            new = old.changed(
                environment=environment,
                controller=None if same_law else controller,
                team=team,
                positions=placed,
                velocities=np.where(moved[:, None], 0.0, velocities),
            )
        if circumstances.numbers != self.numbers:
            self._renumber(self.numbers, circumstances.numbers, new.positions)
        self.simulation, self.circumstances = new, circumstances
        self.trail.add(self.time, new.positions, always=True)

    def _renumber(self, before: Sequence[int], after: Sequence[int], positions: Array) -> None:
        """Let trail and starts follow the robots that are there now."""
        old, times = self.trail.positions, self.trail.time
        trail = Trail(len(after))
        rows = np.full((len(old), len(after), 2), np.nan)
        starts = np.array(positions, dtype=float)
        for row, number in enumerate(after):
            if number in before:
                rows[:, row] = old[:, before.index(number)]
                starts[row] = self.starts[before.index(number)]
        for time, place in zip(times.tolist(), rows, strict=True):
            trail.add(time, place, always=True)
        self.trail, self.starts = trail, starts


def with_failed(circumstances: Circumstances) -> Environment:
    """Return the map with the robots that failed as obstacles, which is what the others sense."""
    return circumstances.solid


def simulation_of(
    circumstances: Circumstances, positions: Array, dt: float, velocities: Array | None, time: float
) -> Simulation:
    """Return a simulation in these circumstances.

    Raises
    ------
    StartError, ParameterError
        As `Simulation`.
    """
    return Simulation(
        with_failed(circumstances),
        circumstances.law.made(),
        positions,
        circumstances.limits.team(len(circumstances.numbers)),
        dt,
        velocities=velocities,
        time=time,
    )


def resumed(state: State, dt: float, time: float) -> Simulation:
    """Return a simulation that goes on from a state, with what the controller remembered."""
    simulation = simulation_of(state.circumstances, state.positions, dt, state.velocities, time)
    if state.memory is not None:
        simulation = simulation.remembering(state.memory)
    return simulation
