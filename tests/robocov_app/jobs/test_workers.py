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
from robocov_app.jobs.messages import READY, Wire, receive, send
from robocov_app.jobs.processes import ask_process, end_process, start_process
from robocov_app.jobs.workers import DirectWorker, LatestWorker

PATIENCE = 60.0
"""Seconds after which nothing will come any more."""
SERVICE = "slow_service:Doubling"


def until(condition):
    end = time.monotonic() + PATIENCE
    while not (result := condition()):
        assert time.monotonic() < end, "it does not come"
        time.sleep(0.002)
    return result


def answer_of(worker, question):
    worker.put(question)
    answer = None
    while worker.is_busy:
        answer = worker.poll()
        time.sleep(0.002)
    return answer


@pytest.fixture
def worker():
    with closing(LatestWorker(SERVICE, "doubles")) as worker:
        yield worker


def test_questions_are_answered_by_one_process(worker):
    assert (worker.poll(), worker.is_busy, worker.is_alive) == (None, False, False)
    assert answer_of(worker, 4) == 8
    assert (worker.poll(), worker.is_alive, worker.problem) == (None, True, "")
    pid = answer_of(worker, "print")
    assert pid == worker.process.pid != os.getpid()
    assert answer_of(worker, "bad") is None
    assert worker.problem == "bad: it is"
    assert answer_of(worker, None) is None
    assert worker.problem.startswith("it could not be doubled: unsupported operand")
    for number in range(2000):
        worker.put(number)
    until(lambda: worker.poll() == 3998)
    assert (worker.is_busy, worker.problem) == (False, "")
    heard = answer_of(worker, "heard")
    assert len(heard) < 1000
    assert answer_of(worker, "print") == pid


def test_how_far_it_is_and_that_there_is_a_newer_one(worker):
    assert answer_of(worker, 1) == 2
    worker.put("slow")
    assert until(lambda: worker.progress) >= 1
    worker.put(5)
    assert worker.progress is None
    assert until(worker.poll) == 10


def test_patience_ends_with_an_older_question():
    with closing(LatestWorker(SERVICE, "doubles", patience=0.0)) as worker:
        worker.put("sleep")
        first = worker.process
        time.sleep(0.01)
        assert answer_of(worker, 3) == 6
        assert first.poll() is not None
        pid = answer_of(worker, "print")
        time.sleep(0.01)
        assert answer_of(worker, "print") == pid, "what is answered is waited for"


@pytest.mark.skipif(sys.platform == "win32", reason="no such signals")
def test_a_process_that_dies_is_said_and_replaced(worker):
    assert answer_of(worker, 1) == 2
    worker.put("sleep")
    worker.process.kill()
    problem = until(lambda: worker.poll() or worker.problem)
    assert problem.startswith("the process that doubles has ended")
    assert not problem.endswith("while starting")
    assert not worker.is_busy and not worker.is_alive
    assert answer_of(worker, 2) == 4
    assert worker.problem == ""


def test_no_call_waits(monkeypatch, worker):
    """A frame loop goes on while nobody reads."""
    gate, waited = threading.Event(), []
    monkeypatch.setattr(module, "send", lambda *what: (waited.append(gate.wait(PATIENCE)), send(*what)))
    for number in range(300):
        worker.put(number)
        assert worker.poll() is None
    gate.set()
    until(lambda: worker.poll() == 598)
    assert all(waited), "nobody had to wait until the gate gave up"


def test_each_process_has_its_own_wire():
    class Counting(Wire):
        def __init__(self):
            self.said = 0

        def encode(self, question):
            self.said += 1
            return self.said * question

        def decode(self, answer):
            return -answer

    with closing(LatestWorker(SERVICE, "doubles", Counting)) as worker:
        assert [answer_of(worker, 1), answer_of(worker, 1)] == [-2, -4]
        worker.close()
        assert answer_of(worker, 1) == -2
    direct = DirectWorker(Doubling(), Counting())
    direct.put(10)
    assert (direct.poll(), direct.poll(), direct.is_busy) == (-20, None, False)


def test_in_this_process(capsys):
    worker = DirectWorker(Doubling())
    assert worker.poll() is None
    assert answer_of(worker, 4) is None, "it is never busy"
    assert (worker.poll(), worker.poll()) == (8, None)
    worker.put(None)
    assert worker.poll() is None
    assert worker.problem.startswith("it could not be doubled: ")
    assert "TypeError" in capsys.readouterr().err
    worker.close()


def test_closing_twice_or_without_a_process_is_no_fault(worker):
    worker.close()
    worker.put(1)
    worker.close()
    worker.close()
    assert not worker.is_alive


def test_one_that_waits_asks_one_after_the_other():
    process = start_process(SERVICE)
    assert [ask_process(process, number).answer for number in (1, 2)] == [2, 4]
    assert ask_process(process, "bad").problem == "bad: it is"
    process.kill()
    assert ask_process(process, 1) is None
    assert end_process(process) != 0


def test_one_without_a_service_ends(capfd):
    process = start_process("slow_service:Nothing")
    assert receive(process.stdout) != READY
    assert end_process(process) == 1
    assert "Nothing" in capfd.readouterr().err


PARENT = """
import signal, time
# whoever starts the tests may have had this one ignored
signal.signal(signal.SIGINT, signal.default_int_handler)
from robocov_app.jobs.workers import LatestWorker
worker = LatestWorker("slow_service:Doubling", "doubles")
worker.put(1)
while worker.poll() is None:
    time.sleep(0.01)
worker.put("sleep")
print(worker.process.pid, flush=True)
while True:  # a signal just before a sleep does not end it
    time.sleep(0.1)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no such signals")
@pytest.mark.parametrize(
    "way", ["SIGKILL", *(pytest.param(way, marks=pytest.mark.slow) for way in ("SIGTERM", "SIGINT"))]
)
def test_no_process_outlives_its_parent(way):
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-c", PARENT]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env=environment
    ) as parent:
        try:
            child = int(parent.stdout.readline())
            parent.send_signal(getattr(signal, way))
            parent.wait(PATIENCE)
        finally:
            parent.kill()

    def gone():
        try:
            os.kill(child, 0)
        except ProcessLookupError:
            return True
        # in a container there may be nobody to take away what has ended
        with open(f"/proc/{child}/stat") as file:  # noqa: PTH123
            return file.read().rpartition(")")[2].split()[0] == "Z"

    until(gone)


@pytest.mark.parametrize("cut", [0, 3, 8, 20])
def test_a_message_that_ends_too_early_is_the_end(tmp_path, cut):
    path = tmp_path / "pipe"
    with path.open("wb") as file:
        send(file, {"a": np.arange(5)})
    whole = path.read_bytes()
    path.write_bytes(whole + whole[:cut])
    with path.open("rb") as file:
        assert receive(file)["a"].tolist() == [0, 1, 2, 3, 4]
        assert receive(file) is None
