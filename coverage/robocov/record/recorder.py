"""The recorder: snapshots while a run goes on, a record at any time."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

import numpy as np

from robocov.controllers import gain_values
from robocov.errors import ParameterError, shown
from robocov.record import ARRAYS, Record

if TYPE_CHECKING:
    from robocov.arrays import Array
    from robocov.conditions import Conditions
    from robocov.controllers.base import Controller
    from robocov.environment import Environment
    from robocov.observation import Snapshot
    from robocov.robots import Team


class Recorder:
    """Collects snapshots into a `Record`; what was collected can be had at any time.

    The parameters are attributes of the record; `name` is the controller's where it is not its own, as in
    ``mine.py:MyController``.
    """

    def __init__(
        self,
        environment: Environment,
        team: Team,
        controller: Controller,
        dt: float,
        *,
        name: str | None = None,
        start: str | None = None,
        seed: int | None = None,
        conditions: Conditions | None = None,
    ) -> None:
        self._conditions = conditions
        self._name = controller.name if name is None else name
        self._environment, self._team, self._controller, self._dt = environment, team, controller, dt
        self._start, self._seed = start, seed
        self._gains = gain_values(getattr(controller, "law", controller))
        for gain, value in self._gains.items():
            number = isinstance(value, int | float) and abs(value) <= sys.float_info.max
            if not (value is None or isinstance(value, str) or number):
                raise ParameterError(
                    f"controller {self._name!r}: {gain}: {shown(value)}, but a finite number was wanted, for "
                    f"the record"
                )
        self._time: list[float] = []
        self._rows: dict[str, list[Array]] = {name: [] for name in ARRAYS[1:]}

    def add(self, snapshot: Snapshot) -> None:
        """Append one moment; its arrays are copied."""
        seen, decision = snapshot.seen, snapshot.decision
        self._time.append(seen.time)
        goals = decision.goals if decision.goals is not None else np.full_like(seen.positions, np.nan)
        for name, row in (
            ("positions", snapshot.positions),
            ("velocities", seen.velocities),
            ("forces", decision.forces),
            ("goals", goals),
            ("obstacle_points", seen.obstacle_points),
        ):
            self._rows[name].append(row.copy())

    def record(self) -> Record:
        """Return what was collected so far."""
        arrays: dict[str, Any] = {name: np.array(rows) for name, rows in self._rows.items()}
        return Record(
            environment=self._environment,
            team=self._team,
            controller=self._name,
            label=self._controller.label,
            gains=self._gains,
            start=self._start,
            seed=self._seed,
            dt=self._dt,
            conditions=self._conditions,
            time=np.array(self._time),
            **arrays,
        )
