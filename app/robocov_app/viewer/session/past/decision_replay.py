"""Observations and decisions of the past, recomputed from recorded states."""

from contextlib import suppress
from copy import deepcopy
from dataclasses import replace
from functools import lru_cache

import numpy as np

from robocov.conditions import Conditions
from robocov.conditions.communication import Radio
from robocov.conditions.perception import Perception
from robocov.controllers import inform_controller
from robocov.controllers.base import Controller
from robocov.defaults import DEFAULT_DT_S
from robocov.environment import Environment
from robocov.errors import ParameterError
from robocov.observation import Decision, Observations, Snapshot
from robocov.observation.neighbors import Neighbors
from robocov.sensor import RangeSensor
from robocov.simulation.sensing import get_known_map
from robocov.voronoi import partition_by_travel_time
from robocov.world.obstacle_pieces import build_moving_obstacles, build_solid_pieces
from robocov_app.terminal.interruption import suppress_controller_errors
from robocov_app.viewer.session.past.states import PaneSetup, PaneState

RECORD_TOLERANCE = 1e-9
"""Relative and absolute tolerance within which recomputed forces agree with those of a record."""


def rebuild_snapshot(state: PaneState, time: float, dt: float = DEFAULT_DT_S) -> Snapshot:
    """Recompute the observations and the decision of a recorded state.

    Parameters
    ----------
    state : PaneState
        The state.
    time : float, s
        Time of the state.
    dt : float, s
        Control period.

    Returns
    -------
    Snapshot
        Observations and decision. If the state has a recorded decision, and the controller raises or decides
        differently, the decision is the recorded one. Without a record, all forces are zero if the controller
        raises.
    """
    seen = _observe(state, time)
    perception = _build_perception(state.setup, dt)
    true_positions = None
    inbox = state.inbox
    if perception is not None:
        if inbox is None:
            inbox = perception.create_inbox()
        seen, inbox = perception.perceive(seen, inbox, np.ones(len(state.positions), dtype=bool))
        true_positions = state.positions
    _, seen = _build_radio(state.setup, dt).receive_messages(inbox, round(time / dt), seen)
    decision = _decide(seen, state)
    if state.recorded is not None and not has_same_forces(decision, state.recorded):
        # The controller has changed since the record was made, or it cannot be loaded.
        decision = _complete_recorded_decision(state)
    return Snapshot(seen, decision, true_positions)


def _observe(state: PaneState, time: float) -> Observations:
    """Return the ideal observations of the robots, without noise and message loss."""
    team = state.setup.team
    environment = state.setup.sensed_environment
    sensor = get_sensor(environment, time)
    points = sensor.find_nearest_points(state.positions, team.sensing_range)
    neighbors = Neighbors.from_ranges(state.positions, team.communication_range)
    seen = Observations(
        state.positions, state.velocities, neighbors, points, environment.region, time, team.max_speed
    )
    return replace(seen, density=environment.density, steering=state.steering)


def has_same_forces(decision: Decision, recorded: Decision) -> bool:
    """Return whether a decision agrees with the recorded one."""
    return np.allclose(decision.forces, recorded.forces, rtol=RECORD_TOLERANCE, atol=RECORD_TOLERANCE)


def _complete_recorded_decision(state: PaneState) -> Decision:
    """Return the recorded decision, with cells by travel time added, which records do not contain."""
    assert state.recorded is not None
    team = state.setup.team
    if state.setup.controller.gains.get("cells") != "time" or not team.has_mixed_speeds:
        return state.recorded
    environment = state.setup.sensed_environment
    cells = partition_by_travel_time(
        state.positions, team.max_speed, environment.region, density=environment.density
    )
    return replace(state.recorded, cells=cells)


def _decide(seen: Observations, state: PaneState) -> Decision:
    """Call the controller again; if it raises or returns invalid forces, all forces are zero."""
    no_forces = Decision(np.zeros_like(seen.positions))
    controller = _build_controller(state.setup)
    if controller is None:
        return no_forces
    with suppress_controller_errors():
        # The controller may change its memory in place, but this state may be displayed again.
        memory = deepcopy(state.memory)
        if memory is None:
            memory = controller.begin(state.setup.sensed_environment.region, state.setup.team)
        decision = controller.decide(seen, memory)
        if _is_usable(decision, seen.positions.shape):
            return decision
    return no_forces


def _is_usable(decision: object, shape: tuple[int, ...]) -> bool:
    """Return whether a controller has returned finite forces, and goals of the same shape or none."""
    if not isinstance(decision, Decision):
        return False
    goals = decision.forces if decision.goals is None else decision.goals
    for rows in (decision.forces, goals):
        if not isinstance(rows, np.ndarray) or rows.shape != shape:
            return False
    return bool(np.isfinite(decision.forces).all())


# Each pane has one setup, but after an edit, earlier setups are still displayed.
@lru_cache(maxsize=8)
def _build_controller(setup: PaneSetup) -> Controller | None:
    """Build the controller of a pane; None if it cannot be built, for example if it no longer exists."""
    with suppress(ParameterError):
        known_map = get_known_map(setup.sensed_environment, setup.conditions)
        return inform_controller(setup.controller.build(), known_map)
    return None


@lru_cache(maxsize=8)
def _build_perception(setup: PaneSetup, dt: float) -> Perception | None:
    if setup.conditions is None:
        return None
    return Perception(setup.conditions, setup.team, dt)


@lru_cache(maxsize=8)
def _build_radio(setup: PaneSetup, dt: float) -> Radio:
    return Radio(setup.conditions or Conditions(), setup.team.communication_range, dt)


def get_sensor(environment: Environment, time: float) -> RangeSensor:
    """Return the range sensor on a map, with moving obstacles at their positions at a time, in s.

    The sensor is cached: the next call for the same map changes its time.
    """
    sensor = _build_sensor(environment)
    sensor.set_time(time)
    return sensor


@lru_cache(maxsize=4)
def _build_sensor(environment: Environment) -> RangeSensor:
    return RangeSensor(build_solid_pieces(environment), build_moving_obstacles(environment))
