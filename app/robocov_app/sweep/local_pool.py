"""Worker processes on this machine."""

from __future__ import annotations

import os
import signal
import subprocess
import tempfile
import threading
from concurrent.futures import ThreadPoolExecutor

from robocov.errors import OutputError
from robocov_app.jobs.messages import READY, receive
from robocov_app.jobs.processes import ask_process, end_process, start_process
from robocov_app.sweep.executor import Executor, LostWorker
from robocov_app.sweep.tasks import Task
from robocov_app.sweep.worker import Outcome
from robocov_app.terminal.supervision import describe_status

_MAX_STARTS = 3
"""Maximum number of attempts to start a process."""
_MAX_OUTPUT_CHARS = 4000
"""Number of characters at the end of a process's error output that are kept."""
_KILLED_STATUS = -getattr(signal, "SIGKILL", 9)
"""Exit status of a process that was killed, for example by the system because memory ran out."""


class LocalPool(Executor):
    """Processes on this machine that each execute one task at a time and are replaced when they end.

    Parameters
    ----------
    workers : int
        Number of processes.
    """

    def __init__(self, workers: int) -> None:
        super().__init__()
        self._workers = [_WorkerProcess() for _ in range(workers)]
        self._idle_workers = list(self._workers)
        self._threads = ThreadPoolExecutor(max(1, workers))

    def __exit__(self, *exception: object) -> None:
        for worker in self._workers:
            worker.kill()
        self._threads.shutdown(cancel_futures=True)
        for worker in self._workers:
            worker.close()

    @property
    def capacity(self) -> int:
        """One more than the number of processes, so that a process that becomes idle has a task to start."""
        return len(self._workers) + 1

    def _start(self, task: Task) -> None:
        self._add_future(task, self._threads.submit(self._execute, task))

    def _execute(self, task: Task) -> Outcome | LostWorker:
        """Execute a task in an idle process; called in a thread of the pool.

        There are as many threads as processes, so that an idle process always exists.
        """
        worker = self._idle_workers.pop()
        try:
            return worker.execute(task)
        finally:
            self._idle_workers.append(worker)


class _WorkerProcess:
    """A process that executes tasks; when it has ended, the next task starts another one."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        # In append mode, the file can be emptied while the process has it open.
        self._error_output = tempfile.TemporaryFile("a+b", buffering=0)  # noqa: SIM115 - see `close`
        self._is_stopped = False
        self._start_lock = threading.Lock()

    def kill(self) -> None:
        """Kill the process, and prevent the start of another one."""
        with self._start_lock:
            self._is_stopped = True
            if self._process is not None:
                self._process.kill()

    def close(self) -> None:
        """End the process, and close its error output."""
        self._end()
        self._error_output.close()

    def execute(self, task: Task) -> Outcome | LostWorker:
        """Execute a task; raise OutputError if no process can be started."""
        process = self._process
        if process is None or process.poll() is not None:
            process = self._start()
        # Keep only the output of this task, so that the file does not grow forever.
        self._error_output.truncate(0)
        reply = ask_process(process, task)
        if reply is not None and isinstance(reply.answer, Outcome):
            return reply.answer
        status, output = self._end()
        cause = f"its process ended ({describe_status(status)})"
        if task.source is not None:
            # The controller of the user may have ended the process.
            cause = f"controller {task.controller!r}: {cause}"
        return LostWorker(cause, output, is_caused_by_task=status != _KILLED_STATUS)

    def _start(self) -> subprocess.Popen[bytes]:
        """Start a process; raise OutputError if that fails repeatedly."""
        for _ in range(_MAX_STARTS):
            self._end()
            self._error_output.truncate(0)
            with self._start_lock:
                if self._is_stopped:
                    break
                process = start_process("robocov_app.sweep.worker:TaskService", stderr=self._error_output)
                self._process = process
            assert process.stdout is not None
            if receive(process.stdout) == READY:
                return process
        status, output = self._end()
        reason = f"worker {describe_status(status)} while starting"
        lines = output.strip().splitlines()
        if lines:
            reason = f"{reason}: {lines[-1]}"
        raise OutputError(f"a worker process cannot be started: {reason}")

    def _end(self) -> tuple[int, str]:
        """End the process if it is running; return its exit status and the end of its error output."""
        status = 0
        if self._process is not None:
            status = end_process(self._process)
        self._process = None
        self._error_output.seek(0)
        output = self._error_output.read()[-_MAX_OUTPUT_CHARS:]
        return status, output.decode(errors="replace")


def count_processors() -> int:
    """Return the number of processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
