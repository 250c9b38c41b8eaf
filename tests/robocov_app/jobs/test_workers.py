"""Workers in processes: requests, progress, and processes that end or take too long."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import closing

import numpy as np
import pytest
from slow_service import Doubling

from robocov_app.jobs import workers as module
from robocov_app.jobs.messages import READY, Codec, receive, send
from robocov_app.jobs.processes import ask_process, end_process, start_process
from robocov_app.jobs.workers import DirectWorker, LatestWorker

HANG_LIMIT_S = 60.0
"""Time after which a test fails instead of waiting."""
SERVICE = "slow_service:Doubling"


def wait_for(condition):
    """Wait until a condition returns something true, and return it."""
    end = time.monotonic() + HANG_LIMIT_S
    while not (result := condition()):
        assert time.monotonic() < end, "the condition is never met"
        time.sleep(0.002)
    return result


def ask(worker, request):
    """Ask a worker, and return the answer; None if there is none."""
    worker.put(request)
    answer = None
    while worker.is_busy:
        answer = worker.poll()
        time.sleep(0.002)
    return answer


@pytest.fixture
def worker():
    with closing(LatestWorker(SERVICE, "doubles")) as worker:
        yield worker


def test_requests_are_answered_by_one_process(worker):
    assert (worker.poll(), worker.is_busy, worker.is_alive) == (None, False, False)
    assert ask(worker, 4) == 8
    assert (worker.poll(), worker.is_alive, worker.problem) == (None, True, "")
    pid = ask(worker, "print")
    assert pid == worker.process.pid != os.getpid()
    assert ask(worker, "bad") is None
    assert worker.problem == "bad: it is"
    assert ask(worker, None) is None
    assert worker.problem.startswith("it could not be doubled: unsupported operand")
    for number in range(2000):
        worker.put(number)
    wait_for(lambda: worker.poll() == 3998)
    assert (worker.is_busy, worker.problem) == (False, "")
    received = ask(worker, "list received")
    assert len(received) < 1000
    assert ask(worker, "print") == pid


def test_progress_and_newer_requests_are_passed_on(worker):
    assert ask(worker, 1) == 2
    worker.put("slow")
    assert wait_for(lambda: worker.progress) >= 1
    worker.put(5)
    assert worker.progress is None
    assert wait_for(worker.poll) == 10


def test_a_process_that_works_too_long_is_replaced():
    with closing(LatestWorker(SERVICE, "doubles", patience=0.0)) as worker:
        worker.put("sleep")
        first = worker.process
        time.sleep(0.01)
        assert ask(worker, 3) == 6
        assert first.poll() is not None
        pid = ask(worker, "print")
        time.sleep(0.01)
        assert ask(worker, "print") == pid, "the patience does not apply to answered requests"


@pytest.mark.skipif(sys.platform == "win32", reason="no such signals")
def test_a_process_that_dies_is_reported_and_replaced(worker):
    assert ask(worker, 1) == 2
    worker.put("sleep")
    worker.process.kill()
    problem = wait_for(lambda: worker.poll() or worker.problem)
    assert problem.startswith("the process that doubles has ended")
    assert not problem.endswith("while starting")
    assert not worker.is_busy and not worker.is_alive
    assert ask(worker, 2) == 4
    assert worker.problem == ""


def test_no_call_of_a_worker_blocks(monkeypatch, worker):
    """The loop of a window continues while the process reads no requests."""
    gate = threading.Event()
    was_opened = []

    def send_behind_gate(stream, message):
        was_opened.append(gate.wait(HANG_LIMIT_S))
        send(stream, message)

    monkeypatch.setattr(module, "send", send_behind_gate)
    for number in range(300):
        worker.put(number)
        assert worker.poll() is None
    gate.set()
    wait_for(lambda: worker.poll() == 598)
    assert all(was_opened), "no message had to wait until the time limit"


def test_each_process_has_its_own_codec():
    class CountingCodec(Codec):
        def __init__(self):
            self.encoded = 0

        def encode(self, request):
            self.encoded += 1
            return self.encoded * request

        def decode(self, answer):
            return -answer

    with closing(LatestWorker(SERVICE, "doubles", CountingCodec)) as worker:
        assert [ask(worker, 1), ask(worker, 1)] == [-2, -4]
        worker.close()
        assert ask(worker, 1) == -2
    direct = DirectWorker(Doubling(), CountingCodec())
    direct.put(10)
    assert (direct.poll(), direct.poll(), direct.is_busy) == (-20, None, False)


def test_a_direct_worker_answers_at_once(capsys):
    worker = DirectWorker(Doubling())
    assert worker.poll() is None
    assert ask(worker, 4) is None, "it is never busy"
    assert (worker.poll(), worker.poll()) == (8, None)
    worker.put(None)
    assert worker.poll() is None
    assert worker.problem.startswith("it could not be doubled: ")
    assert "TypeError" in capsys.readouterr().err
    worker.close()


def test_a_worker_may_be_closed_twice_or_without_a_process(worker):
    worker.close()
    worker.put(1)
    worker.close()
    worker.close()
    assert not worker.is_alive


def test_a_worker_can_be_closed_while_it_is_woken_by_a_request(worker):
    closing_thread = threading.Thread(target=worker.close, daemon=True)

    class InterruptedEvent(threading.Event):
        """An event whose first `clear` is delayed until `close` has set the event, too."""

        set_count = 0

        def set(self):
            super().set()
            self.set_count += 1

        def clear(self):
            if self.set_count == 1:
                closing_thread.start()
                wait_for(lambda: self.set_count == 2)
            super().clear()

    worker._has_request = InterruptedEvent()
    worker.put(1)
    wait_for(lambda: closing_thread.ident is not None)
    closing_thread.join(HANG_LIMIT_S)
    assert not closing_thread.is_alive()


def test_requests_to_a_process_are_answered_one_by_one():
    process = start_process(SERVICE)
    assert [ask_process(process, number).answer for number in (1, 2)] == [2, 4]
    assert ask_process(process, "bad").problem == "bad: it is"
    process.kill()
    assert ask_process(process, 1) is None
    assert end_process(process) != 0


def test_a_process_without_a_service_ends(capfd):
    process = start_process("slow_service:Nothing")
    assert receive(process.stdout) != READY
    assert end_process(process) == 1
    assert "Nothing" in capfd.readouterr().err


PARENT = """
import signal, time
# It may be ignored where the tests were started.
signal.signal(signal.SIGINT, signal.default_int_handler)
from robocov_app.jobs.workers import LatestWorker
worker = LatestWorker("slow_service:Doubling", "doubles")
worker.put(1)
while worker.poll() is None:
    time.sleep(0.01)
worker.put("sleep")
print(worker.process.pid, flush=True)
while True:  # A signal just before a sleep does not end it.
    time.sleep(0.1)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no such signals")
@pytest.mark.parametrize(
    "signal_name",
    ["SIGKILL", *(pytest.param(name, marks=pytest.mark.slow) for name in ("SIGTERM", "SIGINT"))],
)
def test_no_process_outlives_its_parent(signal_name):
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-c", PARENT]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env=environment
    ) as parent:
        try:
            child = int(parent.stdout.readline())
            parent.send_signal(getattr(signal, signal_name))
            parent.wait(HANG_LIMIT_S)
        finally:
            parent.kill()

    def has_ended():
        try:
            os.kill(child, 0)
        except ProcessLookupError:
            return True
        # In a container, ended processes may stay as zombies.
        with open(f"/proc/{child}/stat") as file:  # noqa: PTH123
            return file.read().rpartition(")")[2].split()[0] == "Z"

    wait_for(has_ended)


@pytest.mark.parametrize("length", [0, 3, 8, 20])
def test_an_incomplete_message_is_the_end_of_a_stream(tmp_path, length):
    path = tmp_path / "pipe"
    with path.open("wb") as file:
        send(file, {"a": np.arange(5)})
    message = path.read_bytes()
    path.write_bytes(message + message[:length])
    with path.open("rb") as file:
        assert receive(file)["a"].tolist() == [0, 1, 2, 3, 4]
        assert receive(file) is None
