"""One controller at work on the team: a pane of the window."""

from copy import deepcopy
from functools import partial
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np

from robocov.arrays import Array
from robocov.controllers import has_memory
from robocov.errors import StartError
from robocov.observation import Snapshot
from robocov.scenario import Scenario
from robocov.simulation import Simulation
from robocov.world.free_positions import relocate_robots
from robocov_app.render.scene import Scene, Sensed
from robocov_app.viewer.session.curves import Curve
from robocov_app.viewer.session.moments import PaneSetup, State, Trail, of_robots
from robocov_app.viewer.session.scenario import ControllerChoice

SENSED_EVERY = 3  # steps between notes of what is sensed


class Continuation(NamedTuple):
    """Continuation of a pane. `positions`, `velocities`, (n, 2) m and m/s: by default the present ones."""

    setup: PaneSetup
    positions: Array | None = None
    velocities: Array | None = None


class Pane:
    """A team under one controller, which can be touched. Robots that failed are obstacles to the others."""

    def __init__(self, number: int, setup: PaneSetup, simulation: Simulation) -> None:
        self.number, self.setup, self.simulation = number, setup, simulation
        self.starts = simulation.positions
        self.trail = Trail(len(self.starts))
        self.trail.add(simulation.time, self.starts)
        self.curves = {"distance": Curve(), "time": Curve()}
        self.curve, self.sensed, self._steps = self.curves["distance"], Sensed(), 0

    @property
    def law(self) -> ControllerChoice:
        return self.setup.law

    @property
    def numbers(self) -> tuple[int, ...]:
        return self.setup.numbers

    @property
    def time(self) -> float:
        return self.simulation.time

    def row(self, number: int) -> int | None:
        return self.numbers.index(number) if number in self.numbers else None

    def step(self, pushes: Array | None = None) -> None:
        if self._steps % SENSED_EVERY == 0:
            seen = self.simulation.observe_and_decide().seen
            self.sensed.add(seen.time, self.numbers, seen.obstacle_points)
        self._steps += 1
        self.simulation.step(pushes)
        self.trail.add(self.time, self.simulation.positions)

    def scene(self, setup: PaneSetup, snapshot: Snapshot, trail: tuple[Array, Array], **more: Any) -> Scene:
        team = self.simulation.team if setup is self.setup else setup.team
        more |= {"numbers": setup.numbers, "failed": setup.failed, "label": setup.law.label}
        more["failed_radii"] = {number: setup.limits.radius_of(number) for number in setup.failed}
        more["starts"] = self.starts if len(self.starts) == len(setup.numbers) else None
        more |= {"trail": trail[0] if len(trail[0]) else None, "trail_time": trail[1]}
        return Scene.of(setup.environment, team, snapshot, **more)

    def state(self) -> State:
        simulation = self.simulation
        # who wrote a controller may have it change what it remembers
        memory = deepcopy(simulation.memory) if has_memory(simulation.controller) else None
        moving = simulation.positions, simulation.velocities
        return State(self.setup, *moving, memory, None, simulation.inbox, simulation.steering)

    def changed(self, wanted: Continuation) -> Simulation:
        """Return the simulation that goes on from here as wanted; the pane stays as it is.

        Robots that do not fit are pushed out of what is in the way. StartError when there is no room for one;
        ParameterError when the controller or the team does not take a value.
        """
        old, setup = self.simulation, wanted.setup
        environment, team = setup.solid, setup.team
        # the same controller goes on remembering; one without memory begins anew, as when resumed
        goes_on = setup.law == self.law and has_memory(old.controller)
        controller = None if goes_on else setup.law.made()
        known = attrgetter("law", "limits", "numbers", "failed")
        alike = wanted.positions is None and known(self.setup) == known(setup)
        if alike and setup.environment.has_same_geometry(self.setup.environment):
            return old.with_density(environment)  # all else stays, as when it is painted
        row_of = {number: row for row, number in enumerate(self.numbers)}  # who stays keeps what is its own
        rows = np.array([row_of.get(number, -1) for number in setup.numbers], dtype=np.intp)
        steering = None if old.steering is None else np.where(rows[:, None] < 0, 0.0, old.steering[rows])
        other: dict[str, Any] = {"controller": controller, "team": team, "steering": steering}
        make = partial(old.with_changes, environment=environment, **other)
        positions = old.positions if wanted.positions is None else wanted.positions
        velocities = old.velocities if wanted.velocities is None else wanted.velocities
        try:
            changed = make(positions=positions, velocities=velocities)
        except StartError:  # who does not fit comes to rest where it does
            placed = relocate_robots(environment.at(old.time), positions, team)
            moved = np.hypot(*(placed - positions).T) > 1e-3
            changed = make(positions=placed, velocities=np.where(moved[:, None], 0.0, velocities))
        if old.inbox is not None and setup.numbers != self.numbers:
            changed = changed.with_memory(changed.memory, old.inbox.select_robots(rows))
        return changed

    def take(self, setup: PaneSetup, simulation: Simulation) -> None:
        before, after = self.numbers, setup.numbers
        if after != before:
            self.trail, starts = self.trail.of_robots(before, after), of_robots(self.starts, before, after)
            self.starts = np.where(np.isnan(starts), simulation.positions, starts)
        self.simulation, self.setup = simulation, setup
        self.trail.add(self.time, simulation.positions, always=True)


def begun(
    setup: PaneSetup, positions: Array, dt: float, velocities: Array | None = None, **later: Any
) -> Simulation:
    """Return a simulation that begins so, or goes on `later`; StartError, ParameterError as `Simulation`."""
    scenario = Scenario(
        setup.solid,
        setup.law.made(),
        team=setup.team,
        starts=positions,
        velocities=velocities,
        steering=later.pop("steering", None),
        dt=dt,
        conditions=setup.conditions,
    )
    return scenario.build_simulation(**later)


def resumed(state: State, dt: float, step: int) -> Simulation:
    later: dict[str, Any] = {"steering": state.steering, "steps": step, "is_computed": True}
    simulation = begun(state.setup, state.positions, dt, state.velocities, **later)
    return simulation.with_memory(simulation.memory if state.memory is None else state.memory, state.inbox)
