"""Ctrl+C, and a controller's own exceptions, while the past of a record is recomputed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from sample_sessions import advance_session, start_session
from session_records import COUNTING, build_record

from robocov.conditions import Conditions
from robocov.record import Record
from robocov_app.runs.saved_runs import SavedRun
from robocov_app.terminal.interruption import note_interrupts
from robocov_app.viewer.session.past.decision_replay import rebuild_snapshot
from robocov_app.viewer.session.recorded import build_replay_session
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice

CTRL_C = "import signal; signal.raise_signal(signal.SIGINT)"
OWN_ERRORS = ("raise KeyboardInterrupt", "raise SystemExit", "raise GeneratorExit", "raise BaseException")
CONDITIONS = Conditions(sensing_noise=0.01)
STATES = 5

pytestmark = pytest.mark.usefixtures("interruptible")


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "mine.py"
    path.write_text(COUNTING)
    return path


def record_counting(file: Path) -> Record:
    session = start_session(ControllerChoice(f"{file}:Counting"), robots=2)
    return build_record(advance_session(session, STATES - 1))


def change_controller(file: Path, statement: str) -> None:
    """Let the controller execute a statement when it decides."""
    file.write_text(COUNTING.replace("        direction =", f"        {statement}\n        direction ="))


def replay(file: Path, record: Record) -> Session:
    return build_replay_session([SavedRun(Path("saved"), record, None)], (f"{file}:Counting",))


@pytest.mark.parametrize("conditions", [None, CONDITIONS], ids=["ideal", "conditions"])
def test_ctrl_c_while_a_record_is_opened_ends_the_command(file: Path, conditions: Conditions | None) -> None:
    record = replace(record_counting(file), conditions=conditions)
    change_controller(file, CTRL_C)
    with note_interrupts(), pytest.raises(KeyboardInterrupt):
        replay(file, record)


@pytest.mark.parametrize("statement", OWN_ERRORS)
@pytest.mark.parametrize("conditions", [None, CONDITIONS], ids=["ideal", "conditions"])
def test_an_error_of_a_controller_does_not_prevent_a_replay(
    file: Path, conditions: Conditions | None, statement: str
) -> None:
    record = replace(record_counting(file), conditions=conditions)
    change_controller(file, statement)
    with note_interrupts():
        session = replay(file, record)
        session.show_time(0.0)
        snapshot = session.displayed.get_snapshot(session.timeline.panes[0])
    assert len(session.timeline.history) == STATES
    np.testing.assert_array_equal(snapshot.decision.forces, record.forces[0])


def test_ctrl_c_while_a_decision_is_recomputed_ends_the_command(file: Path) -> None:
    change_controller(file, f"if seen.time > 10.0: {CTRL_C}")
    session = advance_session(start_session(ControllerChoice(f"{file}:Counting"), robots=2), 2)
    state = session.timeline.history[1].states[0]
    with note_interrupts(), pytest.raises(KeyboardInterrupt):
        rebuild_snapshot(state, 11.0)
