"""Executors of a sweep's tasks: processes of this machine, or the workers of a Dask cluster."""

import asyncio
import logging
import math
import os
import queue
import signal
import subprocess
import tempfile
import threading
import time
import uuid
from abc import ABC, abstractmethod
from collections import Counter, deque
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import Any, NamedTuple, Self, TypeAlias

from robocov.errors import InputError, OutputError
from robocov.optional_imports import import_optional
from robocov_app.jobs.messages import READY, receive
from robocov_app.jobs.processes import ask_process, end_process, start_process
from robocov_app.sweep.tasks import Task
from robocov_app.sweep.worker import Outcome, build_failure, perform
from robocov_app.terminal.supervision import describe_status

_ENDS = 2  # workers that may end through a task before it counts as failed
_IN_A_ROW = 20  # workers that may end one after the other without a finished run in between
_STARTS = 3  # how often a process may end before it has begun
_LAST_WORDS = 4000  # characters of the complaints of a process that ended that are kept
_OUTSIDE = -getattr(signal, "SIGKILL", 9)  # status of what a user, or a lack of memory, has ended
PATIENCE = 10.0  # seconds that a scheduler has for an answer
_LEAST = 4  # tasks that are handed out to a cluster which has no workers yet
_LOOK = 2.0  # seconds between two looks at how many workers there are; they may come and go


class Lost(NamedTuple):
    """A worker has ended in the midst of a task; `blamed`: certainly because of the task itself."""

    cause: str
    details: str
    blamed: bool


Returned: TypeAlias = tuple[Task, Outcome | Lost]


class Executor(ABC):
    """Does tasks; a context, whose end stops what is going on.

    A task whose worker has ended is done again, alone where another may be to blame. When workers have ended
    twice through it, it has failed; when they end again and again, all ends. `lost` counts them.
    """

    def __init__(self) -> None:
        self._backlog: deque[Task] = deque()
        self._alone: deque[Task] = deque()
        self._ends: Counter[str] = Counter()
        self._out = 0
        self._lonely = False  # whether the one that is out is to be alone
        self.lost = self._in_a_row = 0
        self._back: queue.SimpleQueue[tuple[Task, Any]] = queue.SimpleQueue()  # with futures that are done

    def __enter__(self) -> Self:
        return self

    @abstractmethod
    def __exit__(self, *exception: object) -> None: ...

    @property
    @abstractmethod
    def most(self) -> int:
        """Number of tasks to hand out at once, so that nobody is idle."""

    @abstractmethod
    def _hand_out(self, task: Task) -> None: ...

    def _awaited(self, task: Task, future: Any) -> None:
        future.add_done_callback(lambda done: self._back.put((task, done)))

    def _returned(self, timeout: float) -> Returned | None:
        """Return a task that was handed out, and what came of it; None where none is for so many seconds."""
        with suppress(queue.Empty):
            task, future = self._back.get(timeout=timeout)
            return task, self._result(future)
        return None

    def _result(self, future: Any) -> Outcome | Lost:
        return future.result()  # type: ignore[no-any-return]

    @property
    def waiting(self) -> str:
        """Why no worker is at work, in words; empty where one is."""
        return ""

    @property
    def busy(self) -> int:
        return self._out + len(self._backlog) + len(self._alone)

    def submit(self, task: Task) -> None:
        self._backlog.append(task)
        self._feed()

    def next(self, timeout: float) -> tuple[Task, Outcome] | None:
        """Return a task that has come back, in any order; None where none does for so many seconds."""
        self._feed()
        back = self._returned(timeout)
        if back is None:
            return None
        task, came = back
        together, self._lonely = self._out > 1, False
        self._out -= 1
        outcome = self._considered(task, came, together) if isinstance(came, Lost) else came
        if outcome is came:
            self._in_a_row = 0
        self._feed()
        return None if outcome is None else (task, outcome)

    def _feed(self) -> None:
        while self._backlog and not (self._lonely or self._alone) and self._out < self.most:
            self._hand_out(self._backlog.popleft())
            self._out += 1
        if self._alone and not self._out:
            self._lonely, self._out = True, 1
            self._hand_out(self._alone.popleft())

    def _considered(self, task: Task, lost: Lost, together: bool) -> Outcome | None:
        self.lost += 1
        self._in_a_row += 1
        if self._in_a_row > max(_IN_A_ROW, 4 * self.most):
            ends = f"{self._in_a_row} workers have ended one after the other, the last one as {lost.cause}"
            raise OutputError(f"{ends}; what is done is kept, and the same command goes on")
        if together and not lost.blamed:
            self._alone.append(task)
            return None
        self._ends[task.name] += 1
        if self._ends[task.name] < _ENDS:
            (self._backlog if lost.blamed else self._alone).appendleft(task)
            return None
        return build_failure(lost.cause, lost.details)


class LocalPool(Executor):
    """Processes on this machine, each of which does one task at a time; one that ends is replaced."""

    def __init__(self, workers: int) -> None:
        super().__init__()
        self._workers = [_Worker() for _ in range(workers)]
        self._idle = list(self._workers)  # the last one that came back is the next to go
        self._threads = ThreadPoolExecutor(max(1, workers))

    def __exit__(self, *exception: object) -> None:
        for worker in self._workers:
            worker.stop()
        self._threads.shutdown(cancel_futures=True)
        for worker in self._workers:
            worker.end()
            worker.complaints.close()

    @property
    def most(self) -> int:
        return len(self._workers) + 1  # one is ready for the first that comes back

    def _hand_out(self, task: Task) -> None:
        self._awaited(task, self._threads.submit(self._done, task))

    def _done(self, task: Task) -> Outcome | Lost:
        worker = self._idle.pop()
        try:
            return worker.done(task)
        finally:
            self._idle.append(worker)


class _Worker:
    """A process that does tasks; another one is started when it ends."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        # appended to, so that it can be emptied
        self.complaints = tempfile.TemporaryFile("a+b", buffering=0)  # noqa: SIM115 - the pool closes it
        self._stopped, self._starting = False, threading.Lock()

    def stop(self) -> None:
        with self._starting:
            self._stopped = True
            if self._process is not None:
                self._process.kill()

    def done(self, task: Task) -> Outcome | Lost:
        """Do a task; raises OutputError where no process can be started."""
        process = self._process
        if process is None or process.poll() is not None:
            process = self._begun()
        self.complaints.truncate(0)  # what it says of this task, and does not grow for ever
        reply = ask_process(process, task)
        if reply is not None and isinstance(reply.answer, Outcome):
            return reply.answer
        status, said = self.end()
        # a controller of the user's may have ended it
        whose = "" if task.source is None else f"controller {task.controller!r}: "
        cause = f"{whose}its process ended ({describe_status(status)})"
        return Lost(cause, said, blamed=status != _OUTSIDE)

    def _begun(self) -> subprocess.Popen[bytes]:
        for _ in range(_STARTS):
            self.end()
            self.complaints.truncate(0)
            with self._starting:
                if self._stopped:
                    break
                process = start_process("robocov_app.sweep.worker:TaskService", stderr=self.complaints)
                self._process = process
            assert process.stdout
            if receive(process.stdout) == READY:
                return process
        status, complaints = self.end()
        ending = f"worker {describe_status(status)} while starting"
        said = complaints.strip().splitlines()
        reason = f"{ending}: {said[-1]}" if said else ending
        raise OutputError(f"no process for the runs can be started: {reason}")

    def end(self) -> tuple[int, str]:
        """Make sure that the process has ended; return its status and its last words."""
        status = 0 if self._process is None else end_process(self._process)
        self._process = None
        self.complaints.seek(0)
        return status, self.complaints.read()[-_LAST_WORDS:].decode(errors="replace")


def processors() -> int:
    return len(os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else ()) or os.cpu_count() or 1


class Cluster(Executor):
    """The workers of a Dask cluster; they need robocov, and no disk that is shared."""

    def __init__(self, address: str) -> None:
        super().__init__()
        dask = import_optional("distributed", "dask", "--scheduler: ")
        self._address, self._killed = address, dask.KilledWorker
        self._futures: set[Any] = set()

        async def greet() -> None:
            """Do as Dask's own client, which would wait for an answer for ever."""
            arguments = dask.Security().get_connection_args("client")
            line = await asyncio.wait_for(dask.comm.connect(address, timeout=PATIENCE, **arguments), PATIENCE)
            await line.close()

        try:
            if not address.startswith("inproc://"):  # that is in this process
                with ThreadPoolExecutor(1) as thread:  # this one may have a loop of events: in a notebook
                    thread.submit(lambda: asyncio.run(greet())).result()
            self._client = dask.Client(address, timeout=PATIENCE, set_as_default=False)
        except (OSError, ValueError, TypeError, TimeoutError) as error:
            reason = " ".join(str(error).split()) or f"no answer in {PATIENCE:g} s"
            raise InputError(f"--scheduler: {address}: cannot be reached: {reason}") from error
        self._threads, self._asked = 0, -math.inf
        # what it has to say of a scheduler that goes is said here, in one line
        self._talk = logging.getLogger("distributed.client")
        self._level = self._talk.level
        self._talk.setLevel(logging.CRITICAL)

    def __exit__(self, *exception: object) -> None:
        with suppress(Exception):  # the scheduler may be gone
            self._client.cancel(list(self._futures))
        with suppress(Exception):
            self._client.close()
        self._talk.setLevel(self._level)

    @property
    def most(self) -> int:
        """Twice as many as there are threads: on its way to a worker, a task takes time."""
        return max(_LEAST, 2 * self.threads)

    @property
    def threads(self) -> int:
        if time.monotonic() - self._asked > _LOOK:
            self._threads = 0
            with suppress(Exception):  # the scheduler may be gone
                self._threads = sum(self._client.nthreads().values())
            self._asked = time.monotonic()
        return self._threads

    @property
    def waiting(self) -> str:
        return "" if self.threads else f"no workers are connected to {self._address}; waiting"

    def _hand_out(self, task: Task) -> None:
        # a result is that of this sweep alone, whatever else the cluster does
        future: Any = self._client.submit(perform, task, key=f"robocov-{uuid.uuid4().hex}", pure=False)
        self._futures.add(future)
        self._awaited(task, future)

    def _result(self, future: Any) -> Outcome | Lost:
        self._futures.remove(future)
        try:
            return super()._result(future)
        except Exception as error:
            if isinstance(error, self._killed):  # so has every task that waited for the same worker
                return Lost("the process of its worker ended", str(error), blamed=False)
            reason = getattr(error, "reason", None) or f"{type(error).__name__}: {error}"
            reason = " ".join(str(reason).split())
            raise OutputError(f"--scheduler: {self._address}: the runs cannot go on: {reason}") from error
