"""Sessions whose past is a saved run, or the runs of a comparison side by side."""

from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import replace
from typing import Any

import numpy as np

from robocov.controllers import has_memory, inform_controller
from robocov.errors import InputError
from robocov.files.result_names import RECORD_FILE
from robocov.observation import Decision
from robocov.record import Record
from robocov.simulation.sensing import get_known_map
from robocov_app.runs.saved_runs import SavedRun, build_roster
from robocov_app.terminal.interruption import suppress_controller_errors
from robocov_app.viewer.session.document import SessionDocument
from robocov_app.viewer.session.pane import STEPS_BETWEEN_SENSED_POINTS, Pane
from robocov_app.viewer.session.pane_group import AutomaticEvent, PaneGroup, keeps_a_robot
from robocov_app.viewer.session.past.history import MAX_HISTORY_BYTES, RunHistory, estimate_state_bytes
from robocov_app.viewer.session.past.recorded_knowledge import (
    Knowledge,
    build_team_state,
    recompute_knowledge,
)
from robocov_app.viewer.session.past.states import PaneSetup, PaneState, RunState
from robocov_app.viewer.session.past.trails import rebuild_trail
from robocov_app.viewer.session.present import Present
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice
from robocov_app.viewer.session.setup.missing_controller import find_controller, use_placeholder
from robocov_app.viewer.session.setup.robot_properties import RobotProperties
from robocov_app.viewer.session.setup.scenario import MAX_PANES, SessionScenario
from robocov_app.viewer.session.timeline import Timeline

MAX_RECORD_BYTES = 400_000_000
"""Maximum memory for states of records; of longer records, older states are thinned."""
_PERIOD_TOLERANCE = 1e-6
_TIME_TOLERANCE = 1e-6
"""Relative tolerance of the times of a record, which are rounded."""
_STEP_TOLERANCE = 1e-3
"""Absolute tolerance of these times, as a fraction of the interval between two of them."""
_FORCE_TOLERANCE = 1e-9


def build_replay_session(saved: Sequence[SavedRun], controllers: Sequence[str] = ()) -> Session:
    """Build a session whose past is a saved run, or the runs of a comparison side by side.

    It displays time 0 and is playing.

    Parameters
    ----------
    saved : sequence of SavedRun
        The runs, one for each pane.
    controllers : sequence of str
        Controllers in users' files that may be loaded, so that their runs can be continued. These are names
        that the user has typed, never names found in the runs themselves.

    Returns
    -------
    Session

    Raises
    ------
    InputError
        If the runs do not belong together, or the window cannot display them.
    """
    runs = [run._replace(record=_detect_period(run.record)) for run in saved]
    _check_runs(runs)
    runs = [_start_at_zero(run) for run in runs]
    _check_same_setting(runs)
    records = [run.record for run in runs]
    choices = [find_controller(record, controllers) for record in records]
    placeholders = tuple(use_placeholder(choice) for choice in choices)
    start_scenario = _build_start_scenario(records[0], placeholders)
    history = _build_history(records, replace(start_scenario, controllers=tuple(choices)))
    document = SessionDocument.start(start_scenario)
    head = document.nodes[0]
    head.last_step = history.last.step
    head.automatic_events.update(_list_drag_events(records[0], history.dt))
    run = _resume_end(history.last)
    for pane, saved_run in zip(run.panes, runs, strict=True):
        _restore_pane(pane, saved_run, history)
    timeline = Timeline(
        document,
        Present(head, run, history),
        record_end_time=history.last.step * history.dt,
        is_record_reproducible=all(record.session.get("repeatable", True) for record in records),
    )
    timeline.show(0)
    return Session(timeline=timeline)


def get_control_period(record: Record) -> float:
    """Return the control period of a record, s; the interval of its states may be a multiple of that."""
    dt = float(record.session.get("control_dt_s", record.dt))
    steps = record.dt / dt
    is_multiple = abs(steps - round(steps)) < _PERIOD_TOLERANCE
    if is_multiple:
        return dt
    return record.dt


def _detect_period(record: Record) -> Record:
    """Return a record with `dt` replaced by the interval of its states, if it was thinned evenly."""
    interval = float(record.time[-1] - record.time[0]) / max(len(record) - 1, 1)
    steps = round(interval / record.dt)
    if steps <= 1 or abs(interval / record.dt - steps) > _PERIOD_TOLERANCE:
        return record
    session = {**record.session, "control_dt_s": get_control_period(record)}
    return replace(record, dt=steps * record.dt, session=session)


def _check_runs(saved: Sequence[SavedRun]) -> None:
    """Raise an InputError unless the window can display each of the runs."""
    if not 1 <= len(saved) <= MAX_PANES:
        reason = f"{len(saved)} runs, but the window has space for {MAX_PANES}; --frames and --video show all"
        raise InputError(f"{saved[0].folder.parent}: {reason}")
    for run in saved:
        record = run.record
        even_times = np.arange(len(record)) * record.dt
        elapsed = record.time - record.time[0]
        tolerance = _STEP_TOLERANCE * record.dt
        if not np.allclose(elapsed, even_times, rtol=_TIME_TOLERANCE, atol=tolerance):
            file = run.folder / RECORD_FILE
            raise InputError(f"{file}: time: expected times {record.dt:g} s apart")
        if record.time[0] > tolerance and record.environment.has_moving_obstacles:
            reason = (
                f"expected a record from 0 s on, because obstacles move, got one from {record.time[0]:g} s on"
            )
            raise InputError(f"{run.folder}: {reason}; --frames and --video show such runs")
        idle_rows = np.flatnonzero(~record.is_working.any(axis=1))
        if len(idle_rows):
            time = record.time[idle_rows[0]]
            reason = f"expected a working robot at all times, got none at {time:g} s"
            raise InputError(f"{run.folder}: {reason}; --frames and --video show such runs")


def _start_at_zero(run: SavedRun) -> SavedRun:
    """Return a run whose times are shifted so that it starts at 0 s, like a session."""
    record = run.record
    start_time = float(record.time[0])
    if start_time == 0.0:
        return run
    conditions = record.conditions
    if conditions is not None:
        conditions = conditions.advance(start_time, len(record.team))
    joined = tuple(robot._replace(time=robot.time - start_time) for robot in record.joined)
    record = replace(record, time=record.time - start_time, conditions=conditions, joined=joined)
    history = run.history
    if history is not None:
        history = replace(history, time=history.time - start_time)
    return run._replace(record=record, history=history)


def _check_same_setting(saved: Sequence[SavedRun]) -> None:
    """Raise an InputError unless the runs can be displayed side by side."""
    first = _describe_run(saved[0].record)
    for run in saved:
        for name, value in _describe_run(run.record).items():
            if value != first[name]:
                expected = f"expected {first[name]} as in {saved[0].folder}, got {value}"
                raise InputError(f"{run.folder}: {name}: {expected}; --frames and --video show both")


def _describe_run(record: Record) -> Mapping[str, object]:
    """Return the properties that runs must share to be displayed side by side."""
    return {
        "dt_s": record.dt,
        "states": len(record),
        "team": record.team.to_dict(),
        "robots": build_roster(record).numbers,
        "conditions": record.conditions,
    }


def _build_start_scenario(record: Record, controllers: tuple[ControllerChoice, ...]) -> SessionScenario:
    """Build the scenario of several runs from the record of the first run."""
    roster = build_roster(record)
    # Every map has the start "uniform", even if it does not define it.
    is_start_available = record.start in {"uniform", *roster.environment.starts}
    return SessionScenario(
        roster.environment,
        controllers,
        len(record.team),
        start=record.start if is_start_available else None,
        seed=record.seed or 0,
        properties=RobotProperties.from_team(record.team, roster.numbers),
        dt=get_control_period(record),
        given_starts=np.array(record.positions[0]),
        velocities=np.array(record.velocities[0]),
        steering=None if record.steering is None else np.array(record.steering[0]),
        conditions=record.conditions,
    )


def _build_history(records: Sequence[Record], scenario: SessionScenario) -> RunHistory:
    """Build the recorded past of a session from records, one for each pane."""
    first = records[0]
    dt = scenario.dt
    pane_states = []
    for record, choice in zip(records, scenario.controllers, strict=True):
        roster = build_roster(record)
        setup = PaneSetup(scenario.environment, choice, scenario.properties, roster.numbers, roster.failed)
        pane_states.append(_build_states(record, setup))
    steps_between_states = round(first.dt / dt)
    run_states: list[RunState] = []
    for index in range(len(first)):
        states = {pane: states[index] for pane, states in enumerate(pane_states)}
        run_states.append(RunState(index * steps_between_states, states, scenario))
    # Enough memory that the record is not thinned, up to `MAX_RECORD_BYTES`.
    needed_bytes = sum(map(estimate_state_bytes, run_states))
    history = RunHistory(dt, MAX_HISTORY_BYTES + min(needed_bytes, MAX_RECORD_BYTES))
    for state in run_states:
        history.append(state)
    return history


def _list_drag_events(record: Record, dt: float) -> list[AutomaticEvent]:
    """Return an event for each drag of robots while the record was made."""
    events = []
    for drag in record.session.get("edits", ()):
        numbers = ", ".join(map(str, drag["robots"]))
        text = f"robot {numbers} was dragged"
        if len(drag["robots"]) > 1:
            text = f"robots {numbers} were dragged"
        events.append(AutomaticEvent(round(drag["to_s"] / dt), "hand", text))
    return events


def _build_states(record: Record, setup: PaneSetup) -> list[PaneState]:
    """Build the state of a pane at each time of a record."""
    # broadcast_to returns read-only views, so that the record cannot be changed by accident.
    positions = np.broadcast_to(record.positions, record.positions.shape)
    velocities = np.broadcast_to(record.velocities, record.velocities.shape)
    forces = np.broadcast_to(record.forces, record.forces.shape)
    goals = np.broadcast_to(record.goals, record.goals.shape)
    knowledge = _recompute_knowledge(record, setup.controller)
    setups = _build_setups(record, setup)
    states = []
    for index in range(len(record)):
        rows: Any = slice(None)  # all robots, unless some do not work in this state
        if setups[index] is not setup:
            rows = np.flatnonzero(record.is_working[index])
        has_goals = not np.isnan(record.goals[index]).all()
        decision = Decision(forces[index][rows], goals[index][rows] if has_goals else None)
        steering = None if record.steering is None else record.steering[index][rows]
        states.append(
            PaneState(
                setups[index],
                positions[index][rows],
                velocities[index][rows],
                knowledge[index].memory,
                decision,
                inbox=knowledge[index].inbox,
                steering=steering,
                all_robots=build_team_state(record, index) if setups[index].follows_schedule else None,
            )
        )
    return states


def _build_setups(record: Record, setup: PaneSetup) -> list[PaneSetup]:
    """Return the setup of each state; states with the same sets of working and failed robots share one."""
    if record.conditions is None:
        return [setup] * len(record)
    setup_by_robots: dict[bytes, PaneSetup] = {}
    conditions = record.conditions.drop_team_changes()
    scheduled_robots = 0
    if _can_follow_schedule(record, setup):
        conditions = record.conditions
        scheduled_robots = len(record.team)
    setups = []
    for positions, working, present in zip(
        record.positions, record.is_working, record.is_present, strict=True
    ):
        key = working.tobytes() + present.tobytes()
        if key not in setup_by_robots:
            # Failed robots do not move, so their positions are the same in all states that share the setup.
            failed = dict(setup.failed)
            for row in np.flatnonzero(present & ~working):
                failed[setup.numbers[row]] = tuple(positions[row].tolist())
            numbers = tuple(setup.numbers[row] for row in np.flatnonzero(working))
            setup_by_robots[key] = replace(
                setup,
                numbers=numbers,
                failed=failed,
                conditions=conditions,
                scheduled_robots=scheduled_robots,
            )
        setups.append(setup_by_robots[key])
    return setups


def _can_follow_schedule(record: Record, setup: PaneSetup) -> bool:
    """Return whether the simulation itself lets robots of a record fail and join when it is continued."""
    if record.conditions is None or not keeps_a_robot(record.conditions, len(record.team)):
        return False
    return not setup.failed and setup.numbers == tuple(range(1, len(record.team) + 1))


def _recompute_knowledge(record: Record, choice: ControllerChoice) -> list[Knowledge]:
    """Recompute the memory of the controller and the messages at each state; None where it is impossible."""
    if record.conditions is not None:
        return recompute_knowledge(record, choice, get_control_period(record))
    return [Knowledge(memory, None) for memory in _recompute_memories(record, choice)]


def _recompute_memories(record: Record, choice: ControllerChoice) -> list[Any]:
    """Recompute the memory of the controller at each state by letting it decide again.

    The memory is None if the controller is missing or has no memory, and at all states after the first
    decision that differs from the record.
    """
    memories: list[Any] = []
    # A missing controller cannot be built.
    with suppress_controller_errors():
        controller = choice.build()
        if not has_memory(controller):
            return [None] * len(record)
        controller = inform_controller(controller, get_known_map(record.environment, record.conditions))
        memory = controller.begin(record.environment.region, record.team)
        for index in range(len(record)):
            memories.append(deepcopy(memory))
            decision = controller.decide(record.snapshot(index).seen, memory)
            is_same = np.allclose(
                decision.forces, record.forces[index], rtol=_FORCE_TOLERANCE, atol=_FORCE_TOLERANCE
            )
            if not is_same:
                break
            memory = decision.memory
    return memories + [None] * (len(record) - len(memories))


def _resume_end(last: RunState) -> PaneGroup:
    """Resume the last state of a record; placeholders stand in for missing controllers."""
    states = {}
    for number, state in last.states.items():
        setup = replace(state.setup, controller=use_placeholder(state.setup.controller))
        states[number] = state._replace(setup=setup)
    run = PaneGroup.resume(last._replace(states=states))
    for pane in run.panes:
        pane.setup = last.states[pane.number].setup
    return run


def _restore_pane(pane: Pane, saved: SavedRun, history: RunHistory) -> None:
    """Restore the trail, sensed points and cost curves of a pane from a saved run."""
    record = saved.record
    pane.trail = rebuild_trail(history, pane.number)
    stride = max(1, round(STEPS_BETWEEN_SENSED_POINTS * history.dt / record.dt))
    robot_numbers = np.array(build_roster(record).numbers)
    # The history of a long record is thinned, so that its indices differ from those of the record.
    for index in range(0, len(record), stride):
        is_working = record.is_working[index]
        numbers = robot_numbers[is_working].tolist()
        pane.sensed.add(index * record.dt, numbers, record.obstacle_points[index][is_working])
    if saved.history is None:
        return
    values_by_quantity = {"distance": saved.history.mean_distance, "time": saved.history.mean_time}
    for quantity, values in values_by_quantity.items():
        if values is None:
            continue
        for time, value in zip(saved.history.time, values, strict=False):
            pane.curves[quantity].add(float(time), float(value))
