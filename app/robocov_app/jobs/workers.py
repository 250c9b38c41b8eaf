"""Workers of a window that must not wait: only the newest question counts."""

from __future__ import annotations

import subprocess
import threading
import time
import traceback
from collections import deque
from contextlib import suppress
from math import inf
from typing import Any, Generic, TypeAlias, TypeVar

from robocov_app.jobs.messages import READY, Channel, Reply, Service, Wire, answer_questions, receive, send
from robocov_app.jobs.processes import start_process
from robocov_app.terminal.supervision import describe_status

_Answer = TypeVar("_Answer")


class LatestWorker(Generic[_Answer]):
    """A service in a process of its own; a question starts it if it is not running.

    Parameters
    ----------
    service : str
        ``package.module:Class``.
    task : str
        Its work as a verb phrase for messages, such as ``measures the map``.
    wire : type
        Translates questions and answers.
    patience : float, s
        A process that works longer on an older question is ended for a newer one.

    Attributes
    ----------
    problem : str
        Reason why there is no answer to the last question; empty if there is one.
    process : subprocess.Popen or None
        One thread writes to it, and another one reads from it.
    """

    def __init__(self, service: str, task: str, wire: type[Wire] = Wire, *, patience: float = inf) -> None:
        self.problem = ""
        self.process: subprocess.Popen[bytes] | None = None
        self._service = service
        self._task = task
        self._wire = wire
        self._patience = patience
        self._waiting_since = 0.0
        self._number = 0
        self._answered_number = 0
        self._has_ended = False
        self._is_ready = False
        self._progress: Reply | None = None
        self._replies: deque[Reply] = deque(maxlen=1)
        self._questions: deque[tuple[int, object]] = deque(maxlen=1)
        self._has_question = threading.Event()
        self._threads: list[threading.Thread] = []

    @property
    def is_alive(self) -> bool:
        """Whether there is a process that can answer."""
        return self.process is not None and not self._has_ended

    @property
    def is_busy(self) -> bool:
        """Whether the newest question has no answer yet."""
        return self._answered_number < self._number

    @property
    def progress(self) -> Any:
        """Progress of the newest question, as the service reports it; None if it has not yet."""
        latest = self._progress
        if latest is None or latest.number != self._number:
            return None
        return latest.answer

    def put(self, question: object) -> None:
        """Ask a question. Older questions without an answer are dropped.

        Parameters
        ----------
        question : object
        """
        now = time.monotonic()
        if not self.is_busy:
            self._waiting_since = now
        if not self.is_alive or now - self._waiting_since > self._patience:
            self.close()
            self._waiting_since = now
            try:
                self._start()
            except OSError as error:
                # There is no memory or no process left. The next question tries again.
                self._number += 1
                self._answered_number = self._number
                reason = error.strerror or error
                self.problem = f"the process that {self._task} cannot be started: {reason}"
                return
        self._number += 1
        self._questions.append((self._number, question))
        self._has_question.set()

    def _start(self) -> None:
        process = start_process(self._service)
        wire = self._wire()
        self.process = process
        self._has_ended = False
        self._is_ready = False
        self._threads = [
            threading.Thread(target=target, args=(process, wire), daemon=True)
            for target in (self._write, self._read)
        ]
        for thread in self._threads:
            thread.start()

    def poll(self) -> _Answer | None:
        """Return the newest answer since the last call, once.

        Returns
        -------
        object or None
            While the worker is `is_busy`, it is the answer to an older question. None if there is none.
        """
        if self.process is None:
            return None
        # Read before the replies, because the last one may arrive just before the process ends.
        has_ended = self._has_ended
        reply = None
        if self._replies:
            reply = self._replies.pop()
        if reply is not None:
            self._answered_number = reply.number
            self.problem = reply.problem
            self._waiting_since = time.monotonic()
        if has_ended and self.is_busy:
            self._answered_number = self._number
            self.problem = f"the process that {self._task} has ended{self._describe_end()}"
            return None
        if reply is None:
            return None
        answer: _Answer | None = reply.answer
        return answer

    def _describe_end(self) -> str:
        """Return how the process has ended, and whether that was while it started."""
        assert self.process is not None
        status = self.process.poll()
        description = ""
        if status is not None:
            description = f" ({describe_status(status)})"
        if not self._is_ready:
            description += " while starting"
        return description

    def close(self) -> None:
        """End the process."""
        if self.process is None:
            return
        process = self.process
        self.process = None
        self._has_question.set()
        process.kill()
        process.wait()
        for thread in self._threads:
            thread.join()
        self._questions.clear()
        self._replies.clear()

    def _write(self, process: subprocess.Popen[bytes], wire: Wire) -> None:
        """Send the newest question whenever there is one; the target of a thread."""
        assert process.stdin is not None
        try:
            # If the process has ended, the thread that reads notices it.
            with suppress(OSError), process.stdin as stream:
                while self._has_question.wait() and self.process is process:
                    self._has_question.clear()
                    if self._questions:
                        number, question = self._questions.pop()
                        send(stream, (number, wire.encode(question)))
        except Exception:
            # A question that cannot be sent must not be waited for.
            traceback.print_exc()
            if self.process is process:
                self._has_ended = True

    def _read(self, process: subprocess.Popen[bytes], wire: Wire) -> None:
        """Receive replies until the process ends; the target of a thread."""
        assert process.stdout is not None
        try:
            with process.stdout as stream:
                self._is_ready = receive(stream) == READY
                while (reply := receive(stream)) is not None:
                    if not reply.is_final:
                        self._progress = reply
                        continue
                    if reply.answer is not None:
                        reply = Reply(reply.number, wire.decode(reply.answer), reply.problem)
                    self._replies.append(reply)
        except Exception:
            # An answer that cannot be read must not be waited for either.
            traceback.print_exc()
        finally:
            self._has_ended = True


class DirectWorker(Generic[_Answer]):
    """A service that answers in this process at once, for frames without a display and for tests.

    Parameters
    ----------
    service : Service
    wire : Wire or None
        Translates questions and answers.

    Attributes
    ----------
    problem : str
        Reason why there is no answer to the last question; empty if there is one.
    """

    is_busy = False
    is_alive = True
    progress = None

    def __init__(self, service: Service, wire: Wire | None = None) -> None:
        self.problem = ""
        self._service = service
        self._wire = wire or Wire()
        self._answer: Any = None

    def put(self, question: object) -> None:
        """Ask a question, and wait for the answer."""
        reply = answer_questions(self._service, [(0, self._wire.encode(question))], Channel())
        self.problem = reply.problem
        self._answer = reply.answer

    def poll(self) -> _Answer | None:
        """Return the answer to the last question, once; None if there is none."""
        encoded = self._answer
        self._answer = None
        if encoded is None:
            return None
        answer: _Answer = self._wire.decode(encoded)
        return answer

    def close(self) -> None:
        """Do nothing, because there is no process to end."""


Worker: TypeAlias = LatestWorker[_Answer] | DirectWorker[_Answer]
