"""SIGTERM and SIGHUP end a window in time, whatever it is doing, and its draft is there."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from robocov_app.storage.autosave import find_drafts
from robocov_app.toolkit.termination import ending_on_signals, is_ending

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals")

KIND = "robocov-test"
HANG_LIMIT_S = 30.0

PROGRAM = """
import sys, time
from pathlib import Path
from robocov_app.storage.autosave import Autosaver
from robocov_app.toolkit.termination import ending_on_signals, is_ending

def be_busy():
    # as a compiler that never looks whether it is to end
    while True:
        time.sleep(0.01)

def run_loop():
    while not is_ending():
        time.sleep(0.01)

with ending_on_signals():
    saver = Autosaver(Path(sys.argv[1]), "robocov-test")
    saver.flush()
    print("ready", flush=True)
    sys.stdin.readline()
    saver.save_draft(lambda: {"work": 1})
    print("changed", flush=True)
    {main}()
    saver.close(discard=False)
    print("closed")
"""


@contextmanager
def program(folder: Path, main: str, *, prefix: tuple[str, ...] = ()) -> Iterator[subprocess.Popen[str]]:
    """Run the program up to a change that is not written yet."""
    script = PROGRAM.replace("{main}", main)
    pipe = subprocess.PIPE
    process = subprocess.Popen(
        [*prefix, sys.executable, "-c", script, str(folder)], stdin=pipe, stdout=pipe, stderr=pipe, text=True
    )
    try:
        assert process.stdout is not None and process.stdin is not None
        assert process.stdout.readline() == "ready\n"
        process.stdin.write("\n")
        process.stdin.flush()
        assert process.stdout.readline() == "changed\n"
        yield process
    finally:
        if process.poll() is None:
            process.kill()
        process.communicate()


def works_in(folder: Path) -> list[object]:
    return [record.content["work"] for record in find_drafts(folder, KIND, lambda record: record)]


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_busy_window_ends_with_its_draft_written(number: int, tmp_path: Path) -> None:
    with program(tmp_path, "be_busy") as process:
        process.send_signal(number)
        assert process.wait(HANG_LIMIT_S) == 128 + number
        assert process.stderr is not None and process.stderr.read() == ""
    assert works_in(tmp_path) == [1]


def test_a_window_whose_loop_runs_closes_in_order(tmp_path: Path) -> None:
    with program(tmp_path, "run_loop") as process:
        process.send_signal(signal.SIGTERM)
        assert process.wait(HANG_LIMIT_S) == 0
        assert process.stdout is not None and process.stdout.read() == "closed\n"
    assert works_in(tmp_path) == [1]


def test_signals_that_are_ignored_stay_ignored(tmp_path: Path) -> None:
    with program(tmp_path, "run_loop", prefix=("nohup",)) as process:
        process.send_signal(signal.SIGHUP)
        with pytest.raises(subprocess.TimeoutExpired):
            process.wait(1.5)
        process.send_signal(signal.SIGTERM)
        process.wait(HANG_LIMIT_S)


def test_handlers_are_as_before_afterwards() -> None:
    before = signal.getsignal(signal.SIGTERM), signal.getsignal(signal.SIGHUP)
    with ending_on_signals(), ending_on_signals():
        assert not is_ending()
        assert signal.getsignal(signal.SIGTERM) is not before[0]
    assert (signal.getsignal(signal.SIGTERM), signal.getsignal(signal.SIGHUP)) == before
    assert signal.set_wakeup_fd(-1) == -1


def test_an_error_within_is_passed_on() -> None:
    with pytest.raises(ZeroDivisionError), ending_on_signals():
        _ = 1 / 0
    assert not is_ending()
