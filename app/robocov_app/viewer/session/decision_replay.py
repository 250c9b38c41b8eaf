"""Decisions of the past made again from kept moments."""

from contextlib import suppress
from copy import deepcopy
from dataclasses import replace
from functools import lru_cache

import numpy as np

from robocov.conditions.perception import Perception
from robocov.controllers import inform_controller
from robocov.controllers.base import Controller
from robocov.defaults import DEFAULT_DT_S
from robocov.environment import Environment
from robocov.errors import ParameterError
from robocov.observation import Decision, Observations, Snapshot
from robocov.observation.neighbors import Neighbors
from robocov.sensor import RangeSensor
from robocov.voronoi import partition_by_travel_time
from robocov.world.obstacle_pieces import build_movers, build_solid_pieces
from robocov_app.viewer.session.moments import PaneSetup, State


def replayed_snapshot(state: State, time: float, dt: float = DEFAULT_DT_S) -> Snapshot:
    """Return a moment as it was at a time, s; a controller that fails on it decided nothing."""
    setup, team, positions = state.setup, state.setup.team, state.positions
    region, density, sensor = setup.solid.region, setup.solid.density, sensor_in(setup.solid)
    sensor.set_time(time)
    points = sensor.find_nearest_points(positions, team.sensing_range)
    neighbors = Neighbors.from_ranges(positions, team.communication_range)
    seen = Observations(positions, state.velocities, neighbors, points, region, time, team.max_speed)
    seen = replace(seen, density=density, steering=state.steering)
    if (perception := _perception(setup, dt)) is not None:
        inbox = perception.create_inbox() if state.inbox is None else state.inbox
        seen, _ = perception.perceive(seen, inbox, np.ones(len(positions), dtype=bool))
    decision, recorded = _decision(seen, state), state.recorded
    if recorded is not None and not np.allclose(decision.forces, recorded.forces, rtol=1e-9, atol=1e-9):
        decision = recorded  # the controller is not what it was, or not loaded
        if setup.law.gains.get("cells") == "time" and team.has_mixed_speeds:
            cells = partition_by_travel_time(positions, team.max_speed, region, density=density)
            decision = replace(decision, cells=cells)
    return Snapshot(seen, decision, None if perception is None else positions)


def _decision(seen: Observations, state: State) -> Decision:
    nothing, controller = Decision(np.zeros_like(seen.positions)), _controller(state.setup)
    if controller is None:
        return nothing
    try:
        memory = deepcopy(state.memory)  # it may change what it remembers, and is asked again
        if memory is None:
            memory = controller.begin(state.setup.solid.region, state.setup.team)
        decision = controller.decide(seen, memory)
        given = (decision.forces, decision.forces if decision.goals is None else decision.goals)
        good = isinstance(decision, Decision) and all(isinstance(rows, np.ndarray) for rows in given)
        good = good and all(rows.shape == seen.positions.shape for rows in given)
    except BaseException:  # a user's controller may do anything
        return nothing
    return decision if good and np.isfinite(decision.forces).all() else nothing


@lru_cache(maxsize=8)  # as many as there are panes, and some more
def _controller(setup: PaneSetup) -> Controller | None:
    with suppress(ParameterError):  # what a saved run was made with may be gone
        return inform_controller(setup.law.made(), setup.solid.static)
    return None


@lru_cache(maxsize=8)
def _perception(setup: PaneSetup, dt: float) -> Perception | None:
    return None if setup.conditions is None else Perception(setup.conditions, setup.team, dt)


@lru_cache(maxsize=4)
def sensor_in(environment: Environment) -> RangeSensor:
    return RangeSensor(build_solid_pieces(environment), build_movers(environment))
