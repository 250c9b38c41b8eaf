"""What a controller saw and decided in a state of the past, for the layers and the inspector."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from robocov.neighbours import Neighbours
from robocov.observation import Decision, Observations, Snapshot
from robocov.sensor import RangeSensor
from robocov.solid import solid_pieces
from robocov_app.demo.lane import with_failed

if TYPE_CHECKING:
    from robocov_app.demo.history import Circumstances, State


class Past:
    """Explains states; it keeps what many of them have in common."""

    def __init__(self) -> None:
        self._circumstances: Circumstances | None = None

    def snapshot(self, state: State, time: float) -> Snapshot:
        """Return the moment as it was; a controller that fails on it decided nothing."""
        circumstances = state.circumstances
        if circumstances is not self._circumstances:
            environment = with_failed(circumstances)
            self._region = environment.region
            self._sensor = RangeSensor(solid_pieces(environment))
            self._team = circumstances.limits.team(len(circumstances.numbers))
            self._controller = circumstances.law.made()
            self._circumstances = circumstances
        seen = Observations(
            positions=state.positions,
            velocities=state.velocities,
            neighbours=Neighbours.within(state.positions, self._team.communication_range),
            obstacle_points=self._sensor.nearest(state.positions, self._team.sensing_range),
            region=self._region,
            time=time,
        )
        memory = state.memory
        try:
            if memory is None:
                memory = self._controller.begin(self._region, self._team)
            decision = self._controller.decide(seen, memory)
        except Exception:  # a user's controller may do anything
            decision = Decision(np.zeros_like(state.positions))
        return Snapshot(seen, decision)
