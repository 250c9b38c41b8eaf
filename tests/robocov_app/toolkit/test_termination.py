"""Processes that are ended by SIGTERM or SIGHUP, and their drafts."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from robocov_app.storage.autosave import find_drafts
from robocov_app.toolkit.window.termination import ending_on_signals, is_ending

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals")

KIND = "robocov-test"
HANG_LIMIT_S = 30.0

PROGRAM = """
import sys, time
from pathlib import Path
from robocov_app.storage.autosave import Autosaver
from robocov_app.toolkit.window.termination import ending_on_signals, is_ending

def be_busy():
    # Like a compiler, this never checks whether it has to end.
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
def run_program(folder: Path, main: str, *, prefix: tuple[str, ...] = ()) -> Iterator[subprocess.Popen[str]]:
    """Run the program until it has a change that is not saved.

    `main` is the function of the program that runs then, and `prefix` is a command that starts the program.
    """
    script = PROGRAM.replace("{main}", main)
    process = subprocess.Popen(
        [*prefix, sys.executable, "-c", script, str(folder)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout is not None
        assert process.stdin is not None
        assert process.stdout.readline() == "ready\n"
        process.stdin.write("\n")
        process.stdin.flush()
        assert process.stdout.readline() == "changed\n"
        yield process
    finally:
        if process.poll() is None:
            process.kill()
        process.communicate()


def list_saved_work(folder: Path) -> list[object]:
    """Return the content of all drafts."""
    return [record.content["work"] for record in find_drafts(folder, KIND, lambda record: record)]


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_busy_process_ends_after_writing_its_draft(number: int, tmp_path: Path) -> None:
    with run_program(tmp_path, "be_busy") as process:
        process.send_signal(number)
        assert process.wait(HANG_LIMIT_S) == 128 + number
        assert process.stderr is not None
        assert process.stderr.read() == ""
    assert list_saved_work(tmp_path) == [1]


def test_a_loop_that_checks_for_signals_ends_with_status_0(tmp_path: Path) -> None:
    with run_program(tmp_path, "run_loop") as process:
        process.send_signal(signal.SIGTERM)
        assert process.wait(HANG_LIMIT_S) == 0
        assert process.stdout is not None
        assert process.stdout.read() == "closed\n"
    assert list_saved_work(tmp_path) == [1]


def test_a_signal_that_was_ignored_is_still_ignored(tmp_path: Path) -> None:
    with run_program(tmp_path, "run_loop", prefix=("nohup",)) as process:
        process.send_signal(signal.SIGHUP)
        with pytest.raises(subprocess.TimeoutExpired):
            process.wait(1.5)
        process.send_signal(signal.SIGTERM)
        process.wait(HANG_LIMIT_S)


def test_previous_handlers_are_restored() -> None:
    numbers = (signal.SIGTERM, signal.SIGHUP)
    handlers = [signal.getsignal(number) for number in numbers]
    with ending_on_signals(), ending_on_signals():
        assert not is_ending()
        assert signal.getsignal(signal.SIGTERM) is not handlers[0]
    assert [signal.getsignal(number) for number in numbers] == handlers
    assert signal.set_wakeup_fd(-1) == -1


def test_exceptions_are_passed_on() -> None:
    with pytest.raises(ZeroDivisionError), ending_on_signals():
        _ = 1 / 0
    assert not is_ending()
