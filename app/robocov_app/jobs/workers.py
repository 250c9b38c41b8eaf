"""Background workers for a window that must not block. Only the newest request is answered."""

from __future__ import annotations

import subprocess
import threading
import time
import traceback
from collections import deque
from contextlib import suppress
from math import inf
from typing import Any, Generic, TypeAlias, TypeVar

from robocov_app.jobs.messages import (
    READY,
    Channel,
    Codec,
    Progress,
    Reply,
    Service,
    answer_requests,
    receive,
    send,
)
from robocov_app.jobs.processes import start_process
from robocov_app.terminal.supervision import describe_status

_Answer = TypeVar("_Answer")


class LatestWorker(Generic[_Answer]):
    """A service in a separate process. A request starts the process if it is not running.

    Parameters
    ----------
    service : str
        Class of the service as ``package.module:Class``.
    work_description : str
        Work of the service as a verb phrase for messages, such as ``measures the map``.
    codec : type
        Converts requests and answers; see `Codec`.
    patience : float, s
        If a new request arrives after an older one has been unanswered for longer than this, the process is
        restarted.

    Attributes
    ----------
    problem : str
        Reason why there is no answer to the last request; empty if there is one.
    process : subprocess.Popen or None
        Process of the service. One thread writes to it, and another one reads from it.
    """

    def __init__(
        self, service: str, work_description: str, codec: type[Codec] = Codec, *, patience: float = inf
    ) -> None:
        self.problem = ""
        self.process: subprocess.Popen[bytes] | None = None
        self._service = service
        self._work_description = work_description
        self._codec = codec
        self._patience = patience
        self._waiting_since = 0.0
        self._number = 0
        self._answered_number = 0
        self._has_ended = False
        self._is_ready = False
        self._progress: Progress | None = None
        self._replies: deque[Reply] = deque(maxlen=1)
        self._requests: deque[tuple[int, object]] = deque(maxlen=1)
        self._has_request = threading.Event()
        self._threads: list[threading.Thread] = []

    @property
    def is_alive(self) -> bool:
        """Whether the process is running and can answer."""
        return self.process is not None and not self._has_ended

    @property
    def is_busy(self) -> bool:
        """Whether the newest request has no answer yet."""
        return self._answered_number < self._number

    @property
    def progress(self) -> Any:
        """Latest progress that the service reported for the newest request; None if there is none yet."""
        latest = self._progress
        if latest is None or latest.number != self._number:
            return None
        return latest.value

    def put(self, request: object) -> None:
        """Send a request without waiting for the answer.

        Older requests that have not been sent yet are dropped.

        Parameters
        ----------
        request : object
            The request, in the form that the codec expects.
        """
        try:
            self._restart_if_needed()
        except OSError as error:
            # The system is out of memory or processes. The next request tries again.
            self._number += 1
            self._answered_number = self._number
            reason = error.strerror or error
            self.problem = f"the process that {self._work_description} cannot be started: {reason}"
            return
        self._number += 1
        self._requests.append((self._number, request))
        self._has_request.set()

    def _restart_if_needed(self) -> None:
        """Restart the process if it has ended, or has worked on a request for longer than the patience."""
        now = time.monotonic()
        if not self.is_busy:
            self._waiting_since = now
        if not self.is_alive or now - self._waiting_since > self._patience:
            self.close()
            self._waiting_since = now
            self._start()

    def _start(self) -> None:
        """Start the process, and the two threads that write requests to it and read its replies."""
        process = start_process(self._service)
        # A new codec, because it may remember the data that the previous process has received.
        codec = self._codec()
        self.process = process
        self._has_ended = False
        self._is_ready = False
        self._threads = [
            threading.Thread(target=target, args=(process, codec), daemon=True)
            for target in (self._write, self._read)
        ]
        for thread in self._threads:
            thread.start()

    def poll(self) -> _Answer | None:
        """Return the newest answer that has arrived since the last call; call this regularly.

        Returns
        -------
        object or None
            None if no answer has arrived. While `is_busy`, the answer belongs to an older request.
        """
        if self.process is None:
            return None
        # This is read before the replies, because the last reply may arrive just before the process ends.
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
            self.problem = f"the process that {self._work_description} has ended{self._describe_end()}"
            return None
        if reply is None:
            return None
        answer: _Answer | None = reply.answer
        return answer

    def _describe_end(self) -> str:
        """Describe the exit status of the process, and whether it ended during its start."""
        assert self.process is not None
        status = self.process.poll()
        description = ""
        if status is not None:
            description = f" ({describe_status(status)})"
        if not self._is_ready:
            description += " while starting"
        return description

    def close(self) -> None:
        """End the process and its threads, and drop requests and answers."""
        if self.process is None:
            return
        process = self.process
        # Wakes the writing thread, which ends because the process no longer belongs to the worker.
        self.process = None
        self._has_request.set()
        process.kill()
        process.wait()
        for thread in self._threads:
            thread.join()
        self._requests.clear()
        self._replies.clear()

    def _write(self, process: subprocess.Popen[bytes], codec: Codec) -> None:
        """Send the newest request whenever there is one; the target of the writing thread."""
        assert process.stdin is not None
        try:
            # If the process has ended, the reading thread notices it.
            with suppress(OSError), process.stdin as stream:
                while self._has_request.wait():
                    # Cleared before the checks, so that a later request or `close` wakes the thread again.
                    self._has_request.clear()
                    if self.process is not process:
                        break
                    if self._requests:
                        number, request = self._requests.pop()
                        send(stream, (number, codec.encode(request)))
        except Exception:
            # A request that cannot be sent gets no answer, so the window must not wait for one.
            traceback.print_exc()
            if self.process is process:
                self._has_ended = True

    def _read(self, process: subprocess.Popen[bytes], codec: Codec) -> None:
        """Receive replies until the process ends; the target of the reading thread."""
        assert process.stdout is not None
        try:
            with process.stdout as stream:
                self._is_ready = receive(stream) == READY
                while (message := receive(stream)) is not None:
                    if isinstance(message, Progress):
                        self._progress = message
                        continue
                    answer = message.answer
                    if answer is not None:
                        answer = codec.decode(answer)
                    self._replies.append(Reply(message.number, answer, message.problem))
        except Exception:
            # The window must not wait for an answer that cannot be read.
            traceback.print_exc()
        finally:
            self._has_ended = True


class DirectWorker(Generic[_Answer]):
    """A service that answers immediately in this process, for rendering without a display and for tests.

    Parameters
    ----------
    service : Service
        The service.
    codec : Codec or None
        Converts requests and answers; see `Codec`.

    Attributes
    ----------
    problem : str
        Reason why there is no answer to the last request; empty if there is one.
    """

    is_busy = False
    is_alive = True
    progress = None

    def __init__(self, service: Service, codec: Codec | None = None) -> None:
        self.problem = ""
        self._service = service
        self._codec = codec or Codec()
        self._answer: Any = None

    def put(self, request: object) -> None:
        """Answer a request before returning."""
        reply = answer_requests(self._service, [(0, self._codec.encode(request))], Channel())
        self.problem = reply.problem
        self._answer = reply.answer

    def poll(self) -> _Answer | None:
        """Return the answer to the last request, or None if there is none or it was returned before."""
        encoded = self._answer
        self._answer = None
        if encoded is None:
            return None
        answer: _Answer = self._codec.decode(encoded)
        return answer

    def close(self) -> None:
        """Do nothing, because there is no process to end."""


Worker: TypeAlias = LatestWorker[_Answer] | DirectWorker[_Answer]
