"""Specification of a run, shared by the window, the command line, a sweep, learning and the paper."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from robocov.arrays import Array
from robocov.conditions import Conditions
from robocov.controllers import Controller, make_controller
from robocov.controllers.gains import Value
from robocov.controllers.user_modules import ControllerSource, provide_modules
from robocov.defaults import DEFAULT_DT_S
from robocov.environment import Environment
from robocov.record import Record, Recorder
from robocov.simulation import Simulation, TeamState, check_joins
from robocov.team import Team

MOST_ROWS = 2e7  # largest record, in moments times robots: about 2 GB
COST_RATE = 10.0  # samples of the coverage cost per simulated second


@dataclass(frozen=True, eq=False)
class RunSpec:
    """One run: all that its result depends on; the only place that makes simulations and recorders of it.

    `source`: the file of `controller`, where that may be gone. `positions`, `velocities`, (n, 2) m and m/s:
    else drawn by `start` and `seed`, and at rest. `steering`: see `Simulation`. `duration` and
    the control period `dt` are in s.
    """

    environment: Environment
    controller: str = "rapf"
    gains: Mapping[str, Value] = field(default_factory=dict)
    source: ControllerSource | None = None
    team: Team = field(default_factory=lambda: Team.homogeneous(6))
    start: str | None = None
    seed: int | None = 0
    positions: Array | None = None
    velocities: Array | None = None
    steering: Array | None = None
    duration: float = 60.0
    dt: float = DEFAULT_DT_S
    conditions: Conditions | None = None

    @cached_property
    def starts(self) -> Array:
        """Starting positions, (n, 2) m; raises StartError when there is no room for the team."""
        if self.positions is not None:
            return self.positions
        radius = float(self.team.radius.max())  # room for the largest
        return self.environment.start(self.start).sample(len(self.team), seed=self.seed or 0, radius=radius)

    @property
    def steps(self) -> int:
        return round(self.duration / self.dt)

    def made_controller(self) -> Controller:
        return make_controller(self.controller, self.gains, source=self.source)

    def check(self) -> None:
        """Raise what would be raised at the beginning: ParameterError, StartError."""
        self.made_controller()
        _ = self.starts
        check_joins(self.environment, self.conditions)

    def simulation(
        self, controller: Controller | None = None, *, steps: int = 0, resumed: bool = False
    ) -> Simulation:
        """Build the simulation of the run.

        Parameters
        ----------
        controller : Controller or None
            By default the run's own.
        steps : int
            Number of control steps taken before.
        resumed : bool
            Whether a simulation computed the positions and velocities, see `TeamState.is_computed`.
        """
        state = TeamState(
            positions=self.starts,
            velocities=self.velocities,
            steering=self.steering,
            steps=steps,
            is_computed=resumed,
        )
        return Simulation(
            self.environment,
            controller or self.made_controller(),
            state,
            self.team,
            self.dt,
            conditions=self.conditions,
        )

    def recorder(self, controller: Controller, name: str | None = None) -> Recorder:
        """Return what makes a record of the run; `name` is that of a controller that goes by another one."""
        start = self.start if self.positions is not None else self.environment.start(self.start).name
        origin: dict[str, Any] = {"start": start, "seed": self.seed, "conditions": self.conditions}
        return Recorder(self.environment, self.team, controller, self.dt, name=name, **origin)

    def record(
        self,
        simulation: Simulation | None = None,
        *,
        every: int = 1,
        watch: Callable[[int], bool] = lambda step: False,
    ) -> Record:
        """Simulate, and return the record of one step in `every` and the last; `watch` may end the run."""
        with provide_modules(self.source.modules if self.source else {}):
            simulation = simulation or self.simulation()
            recorder = self.recorder(simulation.controller, self.controller)
            for step, snapshot in enumerate(simulation.snapshots(self.duration)):
                last = watch(step) or step == self.steps
                if last or step % every == 0:
                    recorder.add(snapshot)
                if last:
                    break
            return recorder.record(simulation.joined)
