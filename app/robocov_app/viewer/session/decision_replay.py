"""Replay of a controller's past observations and decisions, for the layers and the inspector."""

from __future__ import annotations

from contextlib import suppress
from copy import deepcopy
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from robocov.conditions.perception import Perception
from robocov.controllers import informed
from robocov.errors import ParameterError
from robocov.observation import Decision, Observations, Snapshot
from robocov.observation.neighbours import Neighbours
from robocov.sensor import RangeSensor
from robocov.simulation import DEFAULT_DT
from robocov.voronoi.weighted_cells import weighted_partition
from robocov.world.solid import movers, solid_pieces

if TYPE_CHECKING:
    from robocov.controllers.base import Controller
    from robocov.environment import Environment
    from robocov_app.viewer.session.history import PaneSetup, State


class DecisionReplay:
    """Explains states; it keeps what many of them have in common.

    `dt`, s: the control period, which messages and noise depend on.
    """

    def __init__(self, dt: float = DEFAULT_DT) -> None:
        self.dt = dt
        # as many as there are panes, and some more
        self._explaining = lru_cache(maxsize=8)(_Explaining)

    def snapshot(self, state: State, time: float) -> Snapshot:
        """Return the moment as it was; a controller that fails on it decided nothing. `time` in s."""
        return self._explaining(state.setup, self.dt).snapshot(state, time)


class _Explaining:
    """Shared part of states of the same circumstances."""

    def __init__(self, setup: PaneSetup, dt: float) -> None:
        self._region, self._density = setup.solid.region, setup.solid.density
        conditions = setup.conditions
        self._perception = None if conditions is None else Perception(conditions, setup.team, dt)
        self._sensor = _sensor_in(setup.solid)
        self._team = setup.team
        self._by_time = setup.law.gains.get("cells") == "time" and self._team.mixed_speeds
        self._controller: Controller | None = None
        with suppress(ParameterError):  # what a saved run was made with may be gone
            self._controller = informed(setup.law.made(), setup.solid.static)

    def snapshot(self, state: State, time: float) -> Snapshot:
        self._sensor.show(time)
        seen = Observations(
            positions=state.positions,
            velocities=state.velocities,
            neighbours=Neighbours.within(state.positions, self._team.communication_range),
            obstacle_points=self._sensor.nearest(state.positions, self._team.sensing_range),
            region=self._region,
            time=time,
            max_speeds=self._team.max_speed,
            density=self._density,
            steering=state.steering,
        )
        if self._perception is not None:
            inbox = self._perception.begin() if state.inbox is None else state.inbox
            seen, _ = self._perception.known(seen, inbox, np.ones(len(state.positions), dtype=bool))
        decision = self._decision(seen, state)
        if state.recorded is not None and not _agree(decision, state.recorded):
            # the controller is not what it was, or not loaded
            decision = state.recorded
            if self._by_time:
                cells = weighted_partition(
                    state.positions, self._team.max_speed, self._region, density=self._density
                )
                decision = replace(decision, cells=cells)
        return Snapshot(seen, decision, None if self._perception is None else state.positions)

    def _decision(self, seen: Observations, state: State) -> Decision:
        nothing = Decision(np.zeros_like(seen.positions))
        if self._controller is None:
            return nothing
        try:
            # it may change what it remembers, and is asked again
            memory = deepcopy(state.memory)
            if memory is None:
                memory = self._controller.begin(self._region, self._team)
            decision = self._controller.decide(seen, memory)
            good = isinstance(decision, Decision) and all(
                isinstance(rows, np.ndarray) and rows.shape == seen.positions.shape
                for rows in (decision.forces, *(() if decision.goals is None else (decision.goals,)))
            )
        except (Exception, SystemExit):  # a user's controller may do anything
            return nothing
        return decision if good and np.isfinite(decision.forces).all() else nothing


def _agree(decision: Decision, recorded: Decision) -> bool:
    """Whether a decision that was made again, with all that explains it, is the recorded one."""
    return bool(np.allclose(decision.forces, recorded.forces, rtol=1e-9, atol=1e-9))


@lru_cache(maxsize=4)
def _sensor_in(environment: Environment) -> RangeSensor:
    return RangeSensor(solid_pieces(environment), movers(environment))
