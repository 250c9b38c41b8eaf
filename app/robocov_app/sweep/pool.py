"""Processes on this machine that do tasks."""

from __future__ import annotations

import os
import queue
import signal
import subprocess
import tempfile
import threading
from typing import IO, TYPE_CHECKING, TypeAlias

from robocov.errors import OutputError
from robocov_app.sweep.crew import Crew, Lost, Returned
from robocov_app.sweep.performing import Outcome
from robocov_app.toolkit.worker import READY, asked, ended, receive, started

if TYPE_CHECKING:
    from robocov_app.sweep.task import Task

_STARTS = 3
"""How often a process may end before it has begun."""

_LAST_WORDS = 4000
"""Characters of the complaints of a process that ended that are kept."""

_OUTSIDE = -getattr(signal, "SIGKILL", 9)
"""The status of a process that was ended from outside: by a user, or because memory ran out."""


_Event: TypeAlias = "tuple[Task, Outcome | Lost | OutputError]"


class LocalPool(Crew):
    """Processes on this machine, each of which does one task at a time.

    A process that ends is replaced. If it was ended from outside, there may have been too little memory for
    all of them.
    """

    def __init__(self, workers: int) -> None:
        super().__init__()
        self._tasks: queue.SimpleQueue[Task | None] = queue.SimpleQueue()
        self._events: queue.SimpleQueue[_Event] = queue.SimpleQueue()
        self._hands = [_Hand(self._tasks, self._events) for _ in range(workers)]

    def __exit__(self, *exception: object) -> None:
        for hand in self._hands:
            hand.stop()
        for _ in self._hands:
            self._tasks.put(None)
        for hand in self._hands:
            hand.join()

    @property
    def most(self) -> int:
        """As many as there are processes, and one that is ready for the first that comes back."""
        return len(self._hands) + 1

    def _hand_out(self, task: Task) -> None:
        self._tasks.put(task)

    def _returned(self, timeout: float) -> Returned | None:
        try:
            task, event = self._events.get(timeout=timeout)
        except queue.Empty:
            return None
        if isinstance(event, OutputError):
            raise event
        return task, event


class _Hand:
    """A thread that hands tasks to a process, and starts another one when that ends."""

    def __init__(self, tasks: queue.SimpleQueue[Task | None], events: queue.SimpleQueue[_Event]) -> None:
        self._tasks, self._events = tasks, events
        self._process: subprocess.Popen[bytes] | None = None
        self._complaints: IO[bytes] | None = None
        self._stopped = False
        self._starting = threading.Lock()
        self._thread = threading.Thread(target=self._work, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the process, whatever it does."""
        with self._starting:
            self._stopped = True
            if self._process is not None:
                self._process.kill()

    def join(self) -> None:
        """Wait until the thread has ended."""
        self._thread.join()

    def _work(self) -> None:
        while (task := self._tasks.get()) is not None and not self._stopped:
            try:
                self._events.put((task, self._done(task)))
            except OutputError as error:
                self._events.put((task, error))
        self._end()

    def _done(self, task: Task) -> Outcome | Lost:
        if self._process is None or self._process.poll() is not None:
            self._begin()
        assert self._process is not None and self._complaints is not None
        self._complaints.truncate(0)  # what it says of this task, and does not grow for ever
        reply = asked(self._process, task)
        if reply is not None and isinstance(reply.answer, Outcome):
            return reply.answer
        status, said = self._end()
        return Lost(f"its process ended ({_cause(status)})", said, blamed=status != _OUTSIDE)

    def _begin(self) -> None:
        """Start a process, and wait until it is there."""
        for _ in range(_STARTS):
            self._end()
            # appended to, so that it can be emptied
            self._complaints = tempfile.TemporaryFile("a+b")  # noqa: SIM115 - closed with the process
            with self._starting:
                if self._stopped:
                    break
                self._process = started("robocov_app.sweep.performing:Performing", stderr=self._complaints)
            assert self._process.stdout
            if receive(self._process.stdout) == READY:
                return
        said = self._end()[1].strip().splitlines() or ["it says nothing"]
        raise OutputError(f"no process for the runs can be started: {said[-1]}")

    def _end(self) -> tuple[int, str]:
        """Make sure that the process has ended; return its status and its last words."""
        status, said = 0, b""
        if self._process is not None:
            status = ended(self._process)
            self._process = None
        if self._complaints is not None:
            self._complaints.seek(0)
            said = self._complaints.read()[-_LAST_WORDS:]
            self._complaints.close()
            self._complaints = None
        return status, said.decode(errors="replace")


def _cause(status: int) -> str:
    """Return in words how a process ended.

    >>> _cause(-9), _cause(3)
    ('signal 9', 'exit status 3')
    """
    return f"signal {-status}" if status < 0 else f"exit status {status}"


def processors() -> int:
    """Return how many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
