"""Saved runs in the window again: as the past of a session that can be looked at and gone on from."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from copy import deepcopy
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from robocov.controllers import CONTROLLERS, has_memory, inform_controller
from robocov.controllers.base import Controller
from robocov.controllers.gains import Gain, Option
from robocov.errors import InputError, ParameterError, RobocovError
from robocov.observation import Decision, Observations
from robocov.observation.region import Region
from robocov.record import Record
from robocov.team import Team
from robocov_app.runs.saved_runs import SavedRun, build_roster
from robocov_app.viewer.session.moments import MOST_BYTES, History, Moment, PaneSetup, State
from robocov_app.viewer.session.pane import SENSED_EVERY, Pane, resumed
from robocov_app.viewer.session.scenario import MOST_PANES, ControllerChoice, Scenario, TeamSpec
from robocov_app.viewer.session.session import Session

MOST_OF_RECORDS = 400_000_000  # bytes of moments beside records' arrays; of longer ones old ones are thinned
_OF_A_MOMENT = 1500  # about how many bytes a moment of one pane takes, beside those arrays


@dataclass(frozen=True)
class LostController(ControllerChoice):
    """A controller that is not loaded, or does not take its gains: its runs can be looked at."""

    title: str = ""  # what people called it
    reason: str = ""  # why it cannot be had
    stands_in: bool = False  # at the end of such a run, as its own controller, until somebody wants to go on
    summary = "stands for a controller that is not there any more"

    @property
    def label(self) -> str:
        return self.title

    @property
    def known(self) -> dict[str, Gain | Option]:
        return {}

    def made(self) -> Controller:
        if self.stands_in:
            return self
        raise ParameterError(f"this run can be looked at, but not gone on with: {self.reason}")

    def begin(self, region: Region, team: Team) -> None:
        """Nothing is remembered."""

    def decide(self, seen: Observations, memory: None) -> Decision:
        replace(self, stands_in=False).made()
        raise AssertionError


def replayed_session(saved: Sequence[SavedRun], controllers: Sequence[str] = ()) -> Session:
    """Return a session whose past is a saved run, or the runs of a comparison side by side.

    Its beginning is looked at, and it plays. `controllers`: those that may be loaded beside the built-in
    ones, so that their runs can be gone on with: names that the user has typed, never ones of the runs
    themselves. Raises InputError when the runs do not go together, or are none that the window can show.
    """
    saved = [each._replace(record=_paced(each.record)) for each in saved]
    records = [each.record for each in saved]
    _check(saved)
    rosters = [build_roster(record) for record in records]
    first, dt = records[0], control_dt(records[0])
    limits, environment = TeamSpec.of(first.team, rosters[0].numbers), rosters[0].environment
    laws = [law_of(record, controllers) for record in records]
    given, moving = np.array(first.positions[0]), np.array(first.velocities[0])
    start = first.start if first.start in environment.starts else None
    choice = tuple(map(_standing, laws)), len(first.team), start, first.seed or 0
    scenario = Scenario(environment, *choice, limits, dt, given, moving, first.conditions)
    session, states = Session(scenario), list[list[State]]()
    for record, law, roster in zip(records, laws, rosters, strict=True):
        states.append(_states_of(record, PaneSetup(environment, law, limits, roster.numbers, roster.failed)))
    needed = len(first) * len(records) * (_OF_A_MOMENT + first.positions[0].nbytes * 2)
    history = History(dt, MOST_BYTES + min(needed, MOST_OF_RECORDS))
    scenario = replace(scenario, laws=tuple(laws))
    for k in range(len(first)):
        now = {pane: each[k] for pane, each in enumerate(states)}
        history.add(Moment(k * round(first.dt / dt), now, scenario))
    for pane, each in zip(session.panes, saved, strict=True):
        _put(pane, each, history)
    for touched in first.session.get("touched", ()):
        words = f"robot {', '.join(map(str, touched['robots']))} was dragged"
        session.head.happenings.add((round(touched["to_s"] / dt), "hand", words))
    session.recall(history)
    session.repeatable = all(record.session.get("repeatable", True) for record in records)
    return session


def control_dt(record: Record) -> float:
    """Return the control period, s; moments of a record may be farther apart than that."""
    dt = float(record.session.get("control_dt_s", record.dt))
    return dt if abs(record.dt / dt - round(record.dt / dt)) < 1e-6 else record.dt


def _paced(record: Record) -> Record:
    """Return a record that was thinned as one whose `dt` is the time between its moments, if that is even."""
    gap = float(record.time[-1] - record.time[0]) / max(len(record) - 1, 1)
    steps = round(gap / record.dt)
    if steps <= 1 or abs(gap / record.dt - steps) > 1e-6:
        return record
    session = {**record.session, "control_dt_s": control_dt(record)}
    return replace(record, dt=steps * record.dt, session=session)


def law_of(record: Record, controllers: Sequence[str] = ()) -> ControllerChoice:
    kind = record.controller.rpartition(":")[2]
    known = [name for name in controllers if name.rpartition(":")[2] == kind]
    name, gains = record.controller, dict(record.gains)
    if name not in (*CONTROLLERS, *known):
        if not known:
            own = f"FILE.py:{kind}" if kind != name else kind
            reason = f"is none of robocov's controllers; to go on, open it with --controller {own}"
            return LostController(name, gains, record.label, f"{record.label} {reason}")
        name = known[0]
    law = ControllerChoice(name, gains)
    try:
        law.made()
        return law.plain()
    except RobocovError as error:
        return LostController(record.controller, gains, record.label, str(error))


def _check(saved: Sequence[SavedRun]) -> None:
    if not 1 <= len(saved) <= MOST_PANES:
        known = f"{len(saved)} runs, but the window has room for {MOST_PANES}; --frames and --video show all"
        raise InputError(f"{saved[0].folder.parent}: {known}")
    first = saved[0].record
    for each in saved:
        record, where = each.record, each.folder
        even = np.arange(len(record)) * record.dt
        if not np.allclose(record.time - record.time[0], even, rtol=1e-6, atol=1e-3 * record.dt):
            raise InputError(f"{where / 'record.npz'}: time: expected times {record.dt:g} s apart")
        for what, mine, others in (
            ("dt_s", record.dt, first.dt),
            ("moments", len(record), len(first)),
            ("team", record.team.to_dict(), first.team.to_dict()),
            ("robots", build_roster(record).numbers, build_roster(first).numbers),
            ("conditions", record.conditions, first.conditions),
        ):
            if mine != others:
                wanted = f"expected {others} as in {saved[0].folder}, got {mine}"
                raise InputError(f"{where}: {what}: {wanted}; --frames and --video show both")


def _standing(law: ControllerChoice) -> ControllerChoice:
    return replace(law, stands_in=True) if isinstance(law, LostController) else law


def _states_of(record: Record, cast: PaneSetup) -> list[State]:
    arrays, states = (record.positions, record.velocities, record.forces, record.goals), []
    fixed = [np.broadcast_to(array, array.shape) for array in arrays]  # nobody can change them
    remembered = zip(_memories_of(record, cast.law), _circumstances_of(record, cast), strict=True)
    for k, (memory, there) in enumerate(remembered):
        rows = slice(None) if there is cast else np.flatnonzero(record.working[k])
        positions, velocities, forces, goals = (array[k][rows] for array in fixed)
        decision = Decision(forces, None if np.isnan(record.goals[k]).all() else goals)
        steering = None if record.steering is None else record.steering[k][rows]
        states.append(State(there, positions, velocities, memory, decision, steering=steering))
    return states


def _circumstances_of(record: Record, cast: PaneSetup) -> Iterator[PaneSetup]:
    """Yield the circumstances of each moment: who worked, and who had failed; messages no record tells."""
    if record.conditions is None:
        yield from [cast] * len(record)
        return
    known: dict[bytes, PaneSetup] = {}
    rest = record.conditions.drop_team_changes()
    for places, working, there in zip(record.positions, record.working, record.present, strict=True):
        key = working.tobytes() + there.tobytes()
        if key not in known:
            wrecks = np.flatnonzero(there & ~working)
            failed = {cast.numbers[row]: tuple(places[row].tolist()) for row in wrecks}
            numbers = tuple(cast.numbers[row] for row in np.flatnonzero(working))
            known[key] = replace(cast, numbers=numbers, failed={**cast.failed, **failed}, conditions=rest)
        yield known[key]


def _memories_of(record: Record, law: ControllerChoice) -> list[Any]:
    """Return what the controller, asked again, remembers at each moment; None once it decides otherwise."""
    found: list[Any] = []
    with suppress(BaseException):  # a user's controller may do anything; a lost one is not there
        controller = law.made()
        if not has_memory(controller):
            return [None] * len(record)
        controller = inform_controller(controller, record.environment.static)
        memory = controller.begin(record.environment.region, record.team)
        for k in range(len(record)):
            found.append(deepcopy(memory))
            decision = controller.decide(record.snapshot(k).seen, memory)
            if not np.allclose(decision.forces, record.forces[k], rtol=1e-9, atol=1e-9):
                break
            memory = decision.memory
    return found + [None] * (len(record) - len(found))


def _put(pane: Pane, saved: SavedRun, history: History) -> None:
    record, last = saved.record, history.last
    state = last.states[pane.number]
    standing = replace(state.setup, law=_standing(state.setup.law))
    pane.simulation = resumed(state._replace(setup=standing), history.dt, last.step)
    pane.setup, pane.starts = state.setup, record.positions[0][record.working[-1]]
    for k in range(0, len(record), max(1, round(SENSED_EVERY * history.dt / record.dt))):
        numbers = history[k].states[pane.number].setup.numbers
        pane.sensed.add(k * record.dt, numbers, record.obstacle_points[k][record.working[k]])
    if saved.history is not None:
        told = {"distance": saved.history.mean_distance, "time": saved.history.mean_time}
        for what, values in told.items():
            for time, value in zip(saved.history.time, () if values is None else values, strict=False):
                pane.curves[what].add(float(time), float(value))
