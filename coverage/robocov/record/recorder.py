"""The recorder, which collects the steps of a simulation into a record."""

from __future__ import annotations

import sys
from dataclasses import KW_ONLY, dataclass

import numpy as np

from robocov.conditions import Conditions, JoinedRobot
from robocov.controllers import Controller, get_gain_values, get_recorded_name
from robocov.controllers.gains import Value
from robocov.controllers.individual import unwrap_controller
from robocov.environment import Environment
from robocov.errors import ParameterError, quote, require_type, require_whole_number, to_one_line
from robocov.observation import Snapshot
from robocov.record.record import Record
from robocov.record.record_arrays import STEERING, list_array_names
from robocov.team import Team
from robocov.typing import FloatArray


@dataclass(eq=False)
class Recorder:
    """Collects snapshots of a simulation into a `Record`.

    Parameters
    ----------
    environment : Environment
        The map of the run.
    team : Team
        The robots.
    controller : Controller
        The controller of the run, whose name, label and gains are recorded.
    dt : float, s
        Control period.
    name : str or None
        Name under which the controller was found, such as ``mine.py:MyController``; by default its own name.
    start : str or None
        Name of the start from which the initial positions were sampled.
    seed : int or None
        Seed from which the initial positions were sampled.
    conditions : Conditions or None
        None if the conditions are ideal.

    Raises
    ------
    ParameterError
        If a gain of the controller, the start or the seed cannot be recorded.

    Examples
    --------
    >>> import robocov as rc
    >>> rooms = rc.load_map("rooms")
    >>> simulation = rc.Simulation(rooms, rc.Rapf(), rooms.start().sample(6, seed=0))
    >>> recorder = Recorder(rooms, simulation.team, simulation.controller, simulation.dt)
    >>> for snapshot in simulation.snapshots(duration=1.0):
    ...     recorder.add(snapshot)
    >>> recorder.record()
    <Record rapf on Rooms, 6 robots, 1.0 s>
    """

    environment: Environment
    team: Team
    controller: Controller
    dt: float
    _: KW_ONLY
    name: str | None = None
    start: str | None = None
    seed: int | None = None
    conditions: Conditions | None = None

    def __post_init__(self) -> None:
        if self.start is not None:
            require_type("start", self.start, str, "the name of a start, or None")
        if self.seed is not None:
            require_whole_number("seed", self.seed, 0)
        if self.name is None:
            self.name = get_recorded_name(self.controller)
        self._gains = get_gain_values(unwrap_controller(self.controller))
        for gain, value in self._gains.items():
            if not _is_recordable(value):
                raise ParameterError(
                    f"controller {self.name!r}: {gain}: expected a finite number, got {quote(value)}"
                )
        self._times: list[float] = []
        self._sent_bytes: list[int] = []
        self._rows: dict[str, list[FloatArray]] = {
            name: [] for name in list_array_names(self.team) if name != "time"
        }

    def add(self, snapshot: Snapshot) -> None:
        """Append a time step.

        Parameters
        ----------
        snapshot : Snapshot
            State, observations and decision of the step. Their arrays are copied.
        """
        goals = snapshot.decision.goals
        if goals is None:
            goals = np.full_like(snapshot.seen.positions, np.nan)
        self._times.append(snapshot.seen.time)
        self._sent_bytes.append(snapshot.sent_bytes)
        self._rows["positions"].append(snapshot.positions.copy())
        self._rows["velocities"].append(snapshot.seen.velocities.copy())
        self._rows["forces"].append(snapshot.decision.forces.copy())
        self._rows["goals"].append(goals.copy())
        self._rows["obstacle_points"].append(snapshot.seen.obstacle_points.copy())
        if snapshot.steering is not None:
            self._rows[STEERING].append(snapshot.steering.copy())

    def record(self, joined: tuple[JoinedRobot, ...] = ()) -> Record:
        """Return the record of the time steps so far.

        Parameters
        ----------
        joined : tuple of JoinedRobot
            Robots that have joined. The record leaves out those that are present at its first step.

        Returns
        -------
        Record
        """
        arrays = {name: np.array(rows) for name, rows in self._rows.items()}
        sent_bytes = None
        if any(self._sent_bytes):
            sent_bytes = np.array(self._sent_bytes, dtype=np.float64)
        return Record(
            environment=self.environment,
            team=self.team,
            controller=str(self.name),
            label=to_one_line(self.controller.label),
            gains=self._gains,
            start=self.start,
            # The JSON encoder rejects NumPy integers.
            seed=None if self.seed is None else int(self.seed),
            dt=self.dt,
            time=np.array(self._times),
            positions=arrays["positions"],
            velocities=arrays["velocities"],
            forces=arrays["forces"],
            goals=arrays["goals"],
            obstacle_points=arrays["obstacle_points"],
            conditions=self.conditions,
            steering=arrays.get(STEERING),
            joined=tuple(robot for robot in joined if robot.time > self._times[0]),
            sent_bytes=sent_bytes,
        )


def _is_recordable(value: Value) -> bool:
    """Return whether a gain can be written to JSON, which has no infinite numbers."""
    if value is None or isinstance(value, str):
        return True
    return isinstance(value, int | float) and abs(value) <= sys.float_info.max
